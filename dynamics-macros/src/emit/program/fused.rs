//! Which products are written together with the sum that reads them.
//!
//! A product that one sum or difference alone reads needs no value of its own: a sum with a product is one
//! operation where the target of the build has an instruction for it, with one rounding instead of two. The
//! choice depends on the whole program, whichever of its results are printed, for one state or for several
//! side by side: all of these round alike.

use std::collections::{BTreeMap, BTreeSet};

use dynamics_symbolic::graph::{Graph, Node, NodeId};
use dynamics_symbolic::schedule::{Program, Step};

use super::{defined, read};

/// Sums with the products that are written with them.
#[derive(Clone, Default)]
pub(super) struct Fused {
    /// The product of each such sum or difference.
    sums: BTreeMap<NodeId, NodeId>,
    products: BTreeSet<NodeId>,
}

impl Fused {
    /// Those of the steps, which are some of the program's; `wanted` and the program's results have values of
    /// their own.
    pub(super) fn of(graph: &Graph, program: &Program, steps: &[Step], wanted: &BTreeSet<NodeId>) -> Self {
        let mut reads: BTreeMap<NodeId, usize> = BTreeMap::new();
        let mut levels: BTreeMap<NodeId, usize> = BTreeMap::new();
        for step in program.hoisted.iter().chain(&program.body) {
            let mut level = 0;
            for id in read(graph, step) {
                *reads.entry(id).or_default() += 1;
                level = level.max(levels.get(&id).copied().unwrap_or(0));
            }
            levels.extend(defined(step).into_iter().map(|id| (id, level + latency(graph, step))));
        }
        let here: BTreeSet<NodeId> = steps.iter().flat_map(defined).collect();
        let alone = |id: &NodeId| {
            matches!(graph.node(*id), Node::Mul(..))
                && reads.get(id) == Some(&1)
                && here.contains(id)
                && !wanted.contains(id)
                && !program.results.contains(id)
        };
        let mut fused = Self::default();
        for id in &here {
            let (Node::Add(a, b) | Node::Sub(a, b)) = graph.node(*id) else { continue };
            // Of two products the one that is known last: the other one is ready by then.
            if let Some(product) = [a, b].into_iter().filter(alone).max_by_key(|id| levels.get(id)) {
                fused.sums.insert(*id, product);
                fused.products.insert(product);
            }
        }
        fused
    }

    /// Whether a step's value is written elsewhere.
    pub(super) fn skips(&self, step: &Step) -> bool {
        matches!(step, Step::Node(id) if self.products.contains(id))
    }

    /// The product that is written with a sum or difference.
    pub(super) fn product(&self, sum: NodeId) -> Option<NodeId> {
        self.sums.get(&sum).copied()
    }

    /// The nodes that a step reads, the factors of such a product among them.
    pub(super) fn read(&self, graph: &Graph, step: &Step) -> Vec<NodeId> {
        let mut nodes = read(graph, step);
        if let Step::Node(sum) = step
            && let Some(product) = self.product(*sum)
        {
            nodes.retain(|id| *id != product);
            nodes.extend(graph.node(product).children());
        }
        nodes
    }
}

/// How long a step takes, in additions.
fn latency(graph: &Graph, step: &Step) -> usize {
    match step {
        Step::Node(id) => match graph.node(*id) {
            Node::Neg(_) => 0,
            Node::Add(..) | Node::Sub(..) | Node::Mul(..) => 1,
            Node::Div(..) => 4,
            _ => 8,
        },
        Step::SinCos { .. } | Step::Smooth { .. } => 10,
    }
}

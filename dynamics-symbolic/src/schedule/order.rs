//! Scheduling: depth-first from the results, so that a step stands close to its first use; deterministic.

use std::collections::BTreeMap;

use crate::graph::{FunctionId, Graph, Node, NodeId, Unary};

use super::program::{Cost, Program, Step};

/// When what depends on parameters alone is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Staging {
    /// Once per model, kept in the constants.
    Hoisted,
    /// In the body, like everything else.
    Inline,
}

/// The program that computes `results`.
#[must_use]
pub fn schedule(g: &Graph, name: &str, results: &[NodeId], staging: Staging) -> Program {
    let groups = Groups::new(g, results);
    let constants = match staging {
        Staging::Hoisted => frontier(g, results),
        Staging::Inline => Vec::new(),
    };
    let mut done = vec![false; g.len()];
    let hoisted = emit(g, &groups, &constants, &mut done);
    let mut done = vec![false; g.len()];
    for id in &constants {
        done[id.index()] = true;
    }
    let body = emit(g, &groups, results, &mut done);
    Program {
        name: name.into(),
        hoisted_cost: Cost::of(g, &hoisted),
        cost: Cost::of(g, &body),
        hoisted,
        constants,
        body,
        results: results.to_vec(),
    }
}

/// Whether a node is read where it is used: no step of its own.
fn is_leaf(g: &Graph, id: NodeId) -> bool {
    matches!(g.node(id), Node::Number(_) | Node::Symbol(_))
}

/// Parameter-only nodes that are worth a constant and that something outside, or a result, reads. A negation is cheaper made again than loaded.
fn frontier(g: &Graph, results: &[NodeId]) -> Vec<NodeId> {
    let mut seen = vec![false; g.len()];
    let mut found = Vec::new();
    let mut stack: Vec<NodeId> = results.iter().rev().copied().collect();
    while let Some(id) = stack.pop() {
        if core::mem::replace(&mut seen[id.index()], true) || is_leaf(g, id) {
            continue;
        }
        if g.is_constant(id) && !matches!(g.node(id), Node::Neg(_)) {
            found.push(id);
            continue;
        }
        let children: Vec<NodeId> = g.node(id).children().collect();
        stack.extend(children.into_iter().rev());
    }
    found
}

/// Which sines, cosines and orders of smooth functions belong together.
struct Groups {
    sin_cos: BTreeMap<NodeId, (Option<NodeId>, Option<NodeId>)>,
    smooth: BTreeMap<(FunctionId, NodeId), [Option<NodeId>; 4]>,
}

impl Groups {
    fn new(g: &Graph, results: &[NodeId]) -> Self {
        let mut groups = Self { sin_cos: BTreeMap::new(), smooth: BTreeMap::new() };
        for id in g.cone(results) {
            match g.node(id) {
                Node::Unary(Unary::Sin, angle) => groups.sin_cos.entry(angle).or_default().0 = Some(id),
                Node::Unary(Unary::Cos, angle) => groups.sin_cos.entry(angle).or_default().1 = Some(id),
                Node::Smooth { function, order, argument } => {
                    groups.smooth.entry((function, argument)).or_default()[usize::from(order)] = Some(id); // ≤ 3, checked before
                }
                _ => {}
            }
        }
        groups
    }
}

/// Steps for `results`, except what is `done`.
fn emit(g: &Graph, groups: &Groups, results: &[NodeId], done: &mut [bool]) -> Vec<Step> {
    let mut steps = Vec::new();
    // (node, whether its arguments are done).
    let mut stack: Vec<(NodeId, bool)> = results.iter().rev().map(|r| (*r, false)).collect();
    while let Some((id, ready)) = stack.pop() {
        if done[id.index()] || is_leaf(g, id) {
            continue;
        }
        if !ready {
            stack.push((id, true));
            let children: Vec<NodeId> = g.node(id).children().collect();
            stack.extend(children.into_iter().rev().map(|c| (c, false)));
            continue;
        }
        match g.node(id) {
            Node::Unary(Unary::Sin | Unary::Cos, angle) => {
                let (sin, cos) = groups.sin_cos[&angle];
                [sin, cos].into_iter().flatten().for_each(|x| done[x.index()] = true);
                steps.push(Step::SinCos { angle, sin, cos });
            }
            Node::Smooth { function, argument, .. } => {
                let orders = groups.smooth[&(function, argument)];
                orders.into_iter().flatten().for_each(|x| done[x.index()] = true);
                steps.push(Step::Smooth { orders });
            }
            _ => {
                done[id.index()] = true;
                steps.push(Step::Node(id));
            }
        }
    }
    steps
}

impl Cost {
    /// Operations of some steps.
    #[must_use]
    pub fn of(g: &Graph, steps: &[Step]) -> Self {
        let mut cost = Self::default();
        for step in steps {
            match step {
                Step::SinCos { .. } => cost.sin_cos += 1,
                Step::Smooth { .. } => cost.functions += 1,
                Step::Node(id) => match g.node(*id) {
                    Node::Number(_) | Node::Symbol(_) => {}
                    Node::Add(..) | Node::Sub(..) | Node::Neg(_) => cost.additions += 1,
                    Node::Mul(..) => cost.multiplications += 1,
                    Node::Div(..) => cost.divisions += 1,
                    Node::Unary(Unary::Sqrt, _) => cost.roots += 1,
                    _ => cost.functions += 1,
                },
            }
        }
        cost
    }
}

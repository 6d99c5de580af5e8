//! Scheduling: sines and cosines first, then depth-first from the results, so that a step stands close to its
//! first use; deterministic.
//!
//! Sines and cosines whose angles are known at the same time stand together: back ends evaluate them side by
//! side, which is where an inlined sine is several times faster than one call after the other, and what
//! follows need not wait for one of them in its middle.

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

/// Parameter-only nodes that are worth a constant and that something outside, or a result, reads. A negation
/// is cheaper made again than loaded.
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
                    // At most 3, which was checked before.
                    groups.smooth.entry((function, argument)).or_default()[usize::from(order)] = Some(id);
                }
                _ => {}
            }
        }
        groups
    }
}

/// Most operations of a program whose sines and cosines are gathered into levels. Longer programs are cut
/// into functions by back ends, which hand over every value that is needed later; there sines and cosines
/// stay where they are used.
const MOST_OPERATIONS_SORTED: usize = 4_000;

/// Steps for `results`, except what is `done`.
fn emit(g: &Graph, groups: &Groups, results: &[NodeId], done: &mut [bool]) -> Vec<Step> {
    let mut order = StepOrder { g, groups, done, steps: Vec::new() };
    for angles in order.levels(results) {
        order.visit(&angles);
        for angle in angles {
            order.sin_cos(angle);
        }
    }
    order.visit(results);
    order.steps
}

/// Steps in the order in which they are computed.
struct StepOrder<'a> {
    g: &'a Graph,
    groups: &'a Groups,
    done: &'a mut [bool],
    steps: Vec<Step>,
}

impl StepOrder<'_> {
    /// The angles whose sines and cosines `results` need: those that need none themselves, those that need
    /// only these, and so on. Levels of a single angle are left where they are used.
    fn levels(&self, results: &[NodeId]) -> Vec<Vec<NodeId>> {
        let needed = self.needed(results);
        if needed.len() > MOST_OPERATIONS_SORTED {
            return Vec::new();
        }
        let mut depths: BTreeMap<NodeId, usize> = BTreeMap::new();
        let mut levels: Vec<Vec<NodeId>> = Vec::new();
        for id in needed {
            let below =
                self.g.node(id).children().filter_map(|child| depths.get(&child)).max().copied().unwrap_or(0);
            let Node::Unary(Unary::Sin | Unary::Cos, angle) = self.g.node(id) else {
                depths.insert(id, below);
                continue;
            };
            depths.insert(id, below + 1);
            levels.resize(levels.len().max(below + 1), Vec::new());
            if !levels[below].contains(&angle) {
                levels[below].push(angle);
            }
        }
        levels.retain(|angles| angles.len() > 1);
        levels
    }

    /// The nodes that `results` need and that are not scheduled yet, arguments first.
    fn needed(&self, results: &[NodeId]) -> Vec<NodeId> {
        let mut seen = vec![false; self.g.len()];
        let mut stack = results.to_vec();
        while let Some(id) = stack.pop() {
            if !self.done[id.index()]
                && !is_leaf(self.g, id)
                && !core::mem::replace(&mut seen[id.index()], true)
            {
                stack.extend(self.g.node(id).children());
            }
        }
        self.g.ids().filter(|id| seen[id.index()]).collect()
    }

    /// The sine and cosine of an angle that is known, as far as they are wanted.
    fn sin_cos(&mut self, angle: NodeId) {
        let (sin, cos) = self.groups.sin_cos[&angle];
        let wanted = [sin, cos].into_iter().flatten();
        if wanted.clone().all(|x| self.done[x.index()]) {
            return;
        }
        wanted.for_each(|x| self.done[x.index()] = true);
        self.steps.push(Step::SinCos { angle, sin, cos });
    }

    /// Depth-first.
    fn visit(&mut self, results: &[NodeId]) {
        // (node, whether its arguments are done).
        let mut stack: Vec<(NodeId, bool)> = results.iter().rev().map(|r| (*r, false)).collect();
        while let Some((id, ready)) = stack.pop() {
            if self.done[id.index()] || is_leaf(self.g, id) {
                continue;
            }
            if !ready {
                stack.push((id, true));
                let children: Vec<NodeId> = self.g.node(id).children().collect();
                stack.extend(children.into_iter().rev().map(|c| (c, false)));
                continue;
            }
            match self.g.node(id) {
                Node::Unary(Unary::Sin | Unary::Cos, angle) => self.sin_cos(angle),
                Node::Smooth { function, argument, .. } => {
                    let orders = self.groups.smooth[&(function, argument)];
                    orders.into_iter().flatten().for_each(|x| self.done[x.index()] = true);
                    self.steps.push(Step::Smooth { orders });
                }
                _ => {
                    self.done[id.index()] = true;
                    self.steps.push(Step::Node(id));
                }
            }
        }
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::Symbol;

    fn angles_in_order(steps: &[Step]) -> Vec<Option<NodeId>> {
        let angle = |step: &Step| if let Step::SinCos { angle, .. } = step { Some(*angle) } else { None };
        steps.iter().map(angle).collect()
    }

    /// What of a sum of these has a place in the program, sines by their angles.
    fn order(build: impl FnOnce(&mut Graph, [NodeId; 3]) -> (NodeId, Vec<NodeId>)) {
        let mut g = Graph::default();
        let q = [0, 1, 2].map(|i| g.symbol(Symbol::Coordinate(i)));
        let (result, together) = build(&mut g, q);
        let program = schedule(&g, "test", &[result], Staging::Inline);
        let angles = angles_in_order(&program.body);
        let first = angles.iter().position(Option::is_some).expect("there are sines");
        let run: Vec<NodeId> = angles[first..].iter().map_while(|angle| *angle).collect();
        assert_eq!(run, together);
        // Each step once, after its arguments.
        let mut done: Vec<NodeId> = Vec::new();
        for step in &program.body {
            let (defined, read): (Vec<NodeId>, Vec<NodeId>) = match step {
                Step::Node(id) => (vec![*id], g.node(*id).children().collect()),
                Step::SinCos { angle, sin, cos } => (sin.iter().chain(cos).copied().collect(), vec![*angle]),
                Step::Smooth { .. } => unreachable!("there is none"),
            };
            assert!(read.iter().all(|id| is_leaf(&g, *id) || done.contains(id)));
            assert!(defined.iter().all(|id| !done.contains(id)));
            done.extend(defined);
        }
        assert!(done.contains(&result));
    }

    #[test]
    fn sines_stand_together() {
        order(|g, [x, y, z]| {
            let (sum, product) = (g.add(x, y), g.mul(x, z));
            let [a, b, c] = [sum, z, product].map(|angle| g.unary(Unary::Sin, angle));
            let scaled = g.mul(a, x);
            let divided = g.div(scaled, b).expect("not zero");
            let result = g.add(divided, c);
            (result, vec![sum, z, product])
        });
    }

    #[test]
    fn a_sine_of_a_sine_stands_with_its_own_kind() {
        order(|g, [x, y, z]| {
            let inner = [x, y, z].map(|angle| g.unary(Unary::Cos, angle));
            let first = g.add(inner[0], inner[1]);
            let second = g.mul(inner[1], inner[2]);
            let [a, b] = [first, second].map(|angle| g.unary(Unary::Sin, angle));
            let result = g.mul(a, b);
            (result, vec![x, y, z])
        });
    }
}

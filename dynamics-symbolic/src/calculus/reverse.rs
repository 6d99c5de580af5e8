//! Reverse sweep: gradients.

use std::collections::BTreeMap;

use crate::graph::{Graph, Node, NodeId, NodeMap, Symbol};

use super::local::{BranchChoice, partials};

/// Gradient of Σ seedₖ·rootₖ with respect to `symbols`; the seeds are held fixed.
pub fn gradient(g: &mut Graph, seeded: &[(NodeId, NodeId)], symbols: &[Symbol]) -> Vec<NodeId> {
    let roots: Vec<NodeId> = seeded.iter().map(|(root, _)| *root).collect();
    let ids = g.cone(&roots);
    gradient_over(g, &ids, seeded, symbols)
}

/// The same by symbols of one kind, numbered below n: the entries of those that the roots contain. Other
/// symbols are not even looked up, so that rows of a sparse Jacobian take time in proportion to what they are
/// made of.
pub fn gradient_entries(
    g: &mut Graph,
    seeded: &[(NodeId, NodeId)],
    kind: fn(u32) -> Symbol,
    n: usize,
) -> Vec<(usize, NodeId)> {
    let roots: Vec<NodeId> = seeded.iter().map(|(root, _)| *root).collect();
    let ids = g.cone(&roots);
    let mut found: Vec<u32> = ids
        .iter()
        .filter_map(|id| match g.node(*id) {
            Node::Symbol(s) => s.number().filter(|i| kind(*i) == s && (*i as usize) < n),
            _ => None,
        })
        .collect();
    found.sort_unstable();
    let symbols: Vec<Symbol> = found.iter().copied().map(kind).collect();
    let slopes = gradient_over(g, &ids, seeded, &symbols);
    found.into_iter().map(|i| i as usize).zip(slopes).collect()
}

fn gradient_over(
    g: &mut Graph,
    ids: &[NodeId],
    seeded: &[(NodeId, NodeId)],
    symbols: &[Symbol],
) -> Vec<NodeId> {
    // Only what leads to one of the symbols is swept.
    let mut active = NodeMap::new(ids, false);
    for id in ids {
        let leads = match g.node(*id) {
            Node::Symbol(s) => symbols.contains(&s),
            node => node.children().any(|c| active.get(c)),
        };
        active.set(*id, leads);
    }
    let mut sweep = ReverseSweep { symbols, active, chosen: BTreeMap::new() };
    // Inner choices first: no recursion, and each is swept once however often it is read.
    for id in ids {
        if let Some(choice) = BranchChoice::of(g.node(*id)).filter(|_| sweep.active.get(*id)) {
            sweep.choose(g, *id, choice);
        }
    }
    sweep.run(g, ids, seeded)
}

/// What all sweeps of one gradient share.
struct ReverseSweep<'a> {
    symbols: &'a [Symbol],
    active: NodeMap<bool>,
    /// Gradients of choices: choices between the gradients of their branches.
    chosen: BTreeMap<NodeId, Vec<NodeId>>,
}

impl ReverseSweep<'_> {
    fn choose(&mut self, g: &mut Graph, id: NodeId, choice: BranchChoice) {
        let one = g.one();
        let [then, otherwise] = [choice.then, choice.otherwise].map(|branch| {
            let ids = g.cone(&[branch]);
            self.run(g, &ids, &[(branch, one)])
        });
        let gradient = then.into_iter().zip(otherwise).map(|(t, o)| choice.between(g, t, o)).collect();
        self.chosen.insert(id, gradient);
    }

    /// One sweep over `ids`, from the last to the first.
    fn run(&self, g: &mut Graph, ids: &[NodeId], seeded: &[(NodeId, NodeId)]) -> Vec<NodeId> {
        let mut adjoint: NodeMap<Option<NodeId>> = NodeMap::new(ids, None);
        for (root, seed) in seeded {
            let sum = accumulated(g, adjoint.get(*root), *seed);
            adjoint.set(*root, Some(sum));
        }
        let mut through_choices: Vec<Option<NodeId>> = vec![None; self.symbols.len()];
        for id in ids.iter().rev().filter(|id| self.active.get(**id)) {
            let Some(own) = adjoint.get(*id) else { continue };
            if let Some(gradient) = self.chosen.get(id) {
                for (slot, partial) in through_choices.iter_mut().zip(gradient) {
                    if !g.is_zero(*partial) {
                        let term = g.mul(*partial, own);
                        *slot = Some(accumulated(g, *slot, term));
                    }
                }
                continue;
            }
            for (child, partial) in partials(g, *id, &|c| self.active.get(c)) {
                let term = g.mul(partial, own);
                let sum = accumulated(g, adjoint.get(child), term);
                adjoint.set(child, Some(sum));
            }
        }
        self.symbols
            .iter()
            .zip(through_choices)
            .map(|(s, through)| {
                let symbol = g.symbol(*s);
                let direct = adjoint.get(symbol);
                match (direct, through) {
                    (Some(a), Some(b)) => g.add(a, b),
                    (Some(a), None) | (None, Some(a)) => a,
                    (None, None) => g.zero(),
                }
            })
            .collect()
    }
}

fn accumulated(g: &mut Graph, sum: Option<NodeId>, term: NodeId) -> NodeId {
    match sum {
        Some(sum) => g.add(sum, term),
        None => term,
    }
}

#[cfg(test)]
mod tests {
    use super::{Graph, NodeId, Symbol, gradient, gradient_entries};
    use crate::graph::{Binary, Unary};

    #[test]
    fn entries_are_those_of_the_whole_gradient() {
        let mut g = Graph::new();
        let (q, u): (Vec<NodeId>, Vec<NodeId>) =
            (0..9).map(|i| (g.symbol(Symbol::Coordinate(i)), g.symbol(Symbol::Rate(i)))).unzip();
        let (angle, speed) = (g.mul(q[7], u[1]), g.mul(q[2], u[2]));
        let sine = g.unary(Unary::Sin, angle);
        let root = g.binary(Binary::Max, sine, speed);
        let seed = g.integer(3);
        for kind in [Symbol::Coordinate as fn(u32) -> Symbol, Symbol::Rate, Symbol::Input] {
            let symbols: Vec<Symbol> = (0..8).map(kind).collect();
            let whole = gradient(&mut g, &[(root, seed)], &symbols);
            let expected: Vec<(usize, NodeId)> =
                whole.into_iter().enumerate().filter(|(_, slope)| !g.is_zero(*slope)).collect();
            assert_eq!(gradient_entries(&mut g, &[(root, seed)], kind, 8), expected);
        }
    }
}

//! Reverse sweep: gradients.

use std::collections::BTreeMap;

use crate::graph::{Graph, Node, NodeId, Symbol};

use super::local::{BranchChoice, partials};

/// Gradient of Σ seedₖ·rootₖ with respect to `symbols`; the seeds are held fixed.
pub fn gradient(g: &mut Graph, seeded: &[(NodeId, NodeId)], symbols: &[Symbol]) -> Vec<NodeId> {
    let roots: Vec<NodeId> = seeded.iter().map(|(root, _)| *root).collect();
    let ids = g.cone(&roots);
    let end = ids.last().map_or(0, |id| id.index() + 1);
    // Only what leads to one of the symbols is swept.
    let mut active = vec![false; end];
    for id in &ids {
        active[id.index()] = match g.node(*id) {
            Node::Symbol(s) => symbols.contains(&s),
            node => node.children().any(|c| active[c.index()]),
        };
    }
    let mut sweep = ReverseSweep { symbols, active, chosen: BTreeMap::new() };
    // Inner choices first: no recursion, and each is swept once however often it is read.
    for id in &ids {
        if let Some(choice) = BranchChoice::of(g.node(*id)).filter(|_| sweep.active[id.index()]) {
            sweep.choose(g, *id, choice);
        }
    }
    sweep.run(g, &ids, seeded)
}

/// What all sweeps of one gradient share.
struct ReverseSweep<'a> {
    symbols: &'a [Symbol],
    active: Vec<bool>,
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
        let mut adjoint: Vec<Option<NodeId>> = vec![None; self.active.len()];
        for (root, seed) in seeded {
            accumulate(g, &mut adjoint[root.index()], *seed);
        }
        let mut through_choices: Vec<Option<NodeId>> = vec![None; self.symbols.len()];
        for id in ids.iter().rev().filter(|id| self.active[id.index()]) {
            let Some(own) = adjoint[id.index()] else { continue };
            if let Some(gradient) = self.chosen.get(id) {
                for (slot, partial) in through_choices.iter_mut().zip(gradient) {
                    if !g.is_zero(*partial) {
                        let term = g.mul(*partial, own);
                        accumulate(g, slot, term);
                    }
                }
                continue;
            }
            for (child, partial) in partials(g, *id, &|c| self.active[c.index()]) {
                let term = g.mul(partial, own);
                accumulate(g, &mut adjoint[child.index()], term);
            }
        }
        self.symbols
            .iter()
            .zip(through_choices)
            .map(|(s, through)| {
                let symbol = g.symbol(*s);
                let direct = adjoint.get(symbol.index()).copied().flatten();
                match (direct, through) {
                    (Some(a), Some(b)) => g.add(a, b),
                    (Some(a), None) | (None, Some(a)) => a,
                    (None, None) => g.zero(),
                }
            })
            .collect()
    }
}

fn accumulate(g: &mut Graph, slot: &mut Option<NodeId>, term: NodeId) {
    *slot = Some(match *slot {
        Some(sum) => g.add(sum, term),
        None => term,
    });
}

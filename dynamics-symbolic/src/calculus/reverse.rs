//! Reverse sweep: gradients.

use crate::graph::{Graph, Node, NodeId, Symbol};

use super::local::partials;

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
    let mut adjoint: Vec<Option<NodeId>> = vec![None; end];
    for (root, seed) in seeded {
        accumulate(g, &mut adjoint, *root, *seed);
    }
    for id in ids.iter().rev().filter(|id| active[id.index()]) {
        let Some(own) = adjoint[id.index()] else { continue };
        for (child, partial) in partials(g, *id, &|c| active[c.index()]) {
            let term = g.mul(partial, own);
            accumulate(g, &mut adjoint, child, term);
        }
    }
    symbols
        .iter()
        .map(|s| {
            let symbol = g.symbol(*s);
            adjoint.get(symbol.index()).copied().flatten().unwrap_or_else(|| g.zero())
        })
        .collect()
}

fn accumulate(g: &mut Graph, adjoint: &mut [Option<NodeId>], at: NodeId, term: NodeId) {
    let slot = &mut adjoint[at.index()];
    *slot = Some(match *slot {
        Some(sum) => g.add(sum, term),
        None => term,
    });
}

//! Gradients of an element, entry by entry.

use crate::calculus::{gradient, gradient_entries};
use crate::graph::{Graph, NodeId, Symbol};

/// The gradient's entries that are not zero.
pub(super) fn entries(
    g: &mut Graph,
    seeded: &[(NodeId, NodeId)],
    kind: fn(u32) -> Symbol,
    n: usize,
) -> Vec<(usize, NodeId)> {
    let all = gradient_entries(g, seeded, kind, n);
    all.into_iter().filter(|(_, slope)| !g.is_zero(*slope)).collect()
}

/// −∂f/∂symbols by rows, where it is not zero.
pub(super) fn slopes(
    g: &mut Graph,
    of: &[(usize, NodeId)],
    kind: fn(u32) -> Symbol,
    n: usize,
) -> Vec<(usize, usize, NodeId)> {
    let symbols: Vec<Symbol> = (0..n as u32).map(kind).collect();
    let one = g.one();
    let mut all = Vec::new();
    for (a, node) in of {
        let row = gradient(g, &[(*node, one)], &symbols);
        for (b, slope) in row.into_iter().enumerate() {
            if !g.is_zero(slope) {
                all.push((*a, b, g.neg(slope)));
            }
        }
    }
    all
}

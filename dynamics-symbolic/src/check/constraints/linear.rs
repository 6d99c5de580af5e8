//! Nonholonomic rows are A(q, t) q̇ + b(q, t).

use crate::calculus::gradient;
use crate::check::quadratic::degree_at_most;
use crate::graph::{NodeId, Sampler, Symbol};
use crate::mechanics::Model;

use super::contents::foreign;
use crate::check::finding::ConstraintFinding;

/// Nonholonomic rows that are not of first degree in the velocities. One finding per constraint.
pub(super) fn linear(model: &Model, found: &mut Vec<ConstraintFinding>) {
    for c in model.constraints.iter().filter(|c| !c.is_holonomic()) {
        let bent = c.components.iter().find(|(_, node)| {
            let straight = || degree_at_most(model, &[*node], 1, &is_rate) || steady_slope(model, *node);
            !foreign(model.graph.dependence(*node)) && !straight()
        });
        let fault = bent.map(|(suffix, _)| ConstraintFinding::NotLinear {
            name: format!("{}{suffix}", c.name),
            origin: c.origin,
        });
        found.extend(fault);
    }
}

pub(in crate::check) fn is_rate(s: Symbol) -> bool {
    matches!(s, Symbol::Rate(_))
}

/// Whether the gradient by the velocities does not depend on them. Differences say nothing of `min` and
/// `max`, which are opaque to samples; the gradient of a choice is a choice between gradients, the same for
/// all velocities where its branches are linear and its condition is free of them.
pub(in crate::check) fn steady_slope(model: &Model, node: NodeId) -> bool {
    let mut g = model.graph.clone();
    let one = g.one();
    let rates: Vec<Symbol> = (0..model.coordinates.len() as u32).map(Symbol::Rate).collect();
    let slopes = gradient(&mut g, &[(node, one)], &rates);
    let sampler = Sampler::new(&g, &slopes);
    let at = |point: u64| sampler.with(&mut |s| sampler.random(s, if is_rate(s) { point } else { 0 }));
    at(0) == at(1)
}

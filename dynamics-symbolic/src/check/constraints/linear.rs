//! Nonholonomic rows are A(q, t) q̇ + b(q, t).

use crate::check::quadratic::degree_at_most;
use crate::graph::Symbol;
use crate::mechanics::Model;

use super::contents::foreign;
use super::finding::ConstraintFinding;

/// Nonholonomic rows that are not of first degree in the velocities. One finding per constraint.
pub(super) fn linear(model: &Model, found: &mut Vec<ConstraintFinding>) {
    for c in model.constraints.iter().filter(|c| !c.is_holonomic()) {
        let bent = c.components.iter().find(|(_, node)| {
            !foreign(model.graph.dependence(*node))
                && !degree_at_most(model, &[*node], 1, &|s| matches!(s, Symbol::Rate(_)))
        });
        let fault = bent
            .map(|(suffix, _)| ConstraintFinding::NotLinear { name: format!("{}{suffix}", c.name), origin: c.origin });
        found.extend(fault);
    }
}

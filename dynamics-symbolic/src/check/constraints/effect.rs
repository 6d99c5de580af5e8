//! Every row restricts something: none is identically zero, none is made of parameters and time alone.

use crate::graph::Dependence;
use crate::mechanics::Model;

use super::contents::foreign;
use crate::check::finding::ConstraintFinding;

/// Rows that restrict nothing, or nothing that moves. One finding per row.
pub(super) fn without_effect(model: &Model, found: &mut Vec<ConstraintFinding>) {
    let g = &model.graph;
    for c in &model.constraints {
        for (suffix, node) in &c.components {
            let (name, origin, depends) = (format!("{}{suffix}", c.name), c.origin, g.dependence(*node));
            let (rates, coordinates) = (depends.on(Dependence::RATES), depends.on(Dependence::COORDINATES));
            if foreign(depends) || g.is_zero(*node) && c.redundant {
                continue;
            }
            if g.is_zero(*node) {
                found.push(ConstraintFinding::AlwaysZero { name, origin });
            } else if !rates && !coordinates {
                found.push(ConstraintFinding::WithoutCoordinate { name, origin });
            } else if !rates && !c.is_holonomic() {
                found.push(ConstraintFinding::NonholonomicWithoutVelocities { name, origin });
            }
        }
    }
}

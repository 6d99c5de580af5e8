//! What a constraint may contain: holonomic rows are functions of q and t, nonholonomic ones of q, q̇ and t.
//!
//! Accelerations and reactions are what follows from the constraints. Inputs have no known rates, and γ
//! contains the rates of everything that a row contains. Modes tell which constraints hold; a row that
//! depended on them would jump where they change.

use crate::graph::Dependence;
use crate::mechanics::Model;

use crate::check::finding::ConstraintFinding;

/// What no row may contain, with the reason.
pub(in crate::check) const FOREIGN: [(Dependence, &str, &str); 4] = [
    (Dependence::ACCELERATIONS, "accelerations", "they are what the constraints decide"),
    (Dependence::MULTIPLIERS, "reactions", "they are what holds the constraints"),
    (Dependence::INPUTS, "inputs", "its time derivatives would contain their rates, which are not known"),
    (Dependence::MODES, "modes", "what holds is the same whichever constraints are switched on"),
];

/// Accelerations, reactions, inputs, modes in constraints; velocities in holonomic ones. One finding per
/// constraint.
pub(super) fn contents(model: &Model, found: &mut Vec<ConstraintFinding>) {
    for c in &model.constraints {
        let origin = c.origin;
        let fault = c.components.iter().find_map(|(suffix, node)| {
            let on = |what| model.graph.dependence(*node).on(what);
            let name = format!("{}{suffix}", c.name);
            if let Some((_, what, reason)) = FOREIGN.into_iter().find(|(what, ..)| on(*what)) {
                Some(ConstraintFinding::Contains { name, what, reason, origin })
            } else if c.is_holonomic() && on(Dependence::RATES) {
                Some(ConstraintFinding::HolonomicWithVelocities { name, origin })
            } else {
                None
            }
        });
        found.extend(fault);
    }
}

/// Whether a node contains what no row may contain: then it has been reported as such.
pub(super) fn foreign(dependence: Dependence) -> bool {
    FOREIGN.iter().any(|(what, ..)| dependence.on(*what))
}

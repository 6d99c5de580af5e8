//! Checks of the constraints: one rule per file, called from visible lists.
//!
//! A constraint may do nothing, may never hold, or may not be what it is declared to be. The model then has
//! no motions or unintended ones, and a solver would at best report a singular matrix. These checks report it
//! in terms of the declarations, before anything runs.

mod analysis;
pub(super) mod contents;
mod effect;
pub(super) mod exact;
mod generic;
mod inertia;
mod integrable;
mod likely;
pub(super) mod linear;
mod loops;
mod manifold;
mod newton;
mod orthogonal;
mod roots;
mod rows;
mod sample;
mod tangent;

use crate::mechanics::{Equations, Model};

use super::finding::Finding;

pub use analysis::{Analysis, RankScope, Ranks, analyse};
pub use loops::{Loop, loops};
pub use sample::Sample;

pub use super::finding::{Combination, ConstraintFinding};

/// Checks of what is declared, one row at a time.
pub(super) fn declared(model: &Model, found: &mut Vec<Finding>) {
    let mut faults = Vec::new();
    // Rows are functions of q, t, and for nonholonomic ones q̇; the derivation relies on it.
    contents::contents(model, &mut faults);
    // A row that restricts nothing was meant to do something else.
    effect::without_effect(model, &mut faults);
    // A q̇ + b: Appell's and Chetaev's rule, and with it the reaction Aᵀλ, hold for rows linear in the
    // velocities.
    linear::linear(model, &mut faults);
    // Where √f = 0 holds its gradient is infinite: no multiplier is the reaction.
    roots::roots(model, &mut faults);
    found.extend(faults.into_iter().map(Finding::Constraint));
}

/// Checks of what was derived.
pub(super) fn derived(model: &Model, equations: &Equations, analysis: &Analysis, found: &mut Vec<Finding>) {
    // Accelerations exist where the constraints leave no direction without inertia.
    inertia::inertia(model, equations, analysis, found);
}

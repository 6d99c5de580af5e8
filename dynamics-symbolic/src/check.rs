//! Model checks: one rule per file, called from a visible list. Findings carry data and origins, never
//! wording.
//!
//! Questions of rank, symmetry and structure are answered by exact linear algebra on random samples modulo p.
//! `units/` is the algebra of dimensions with the solver that infers them. `constraints/` looks at rows one
//! by one, together (rank modulo p, in a copy of the graph), where they hold (states that Newton's method
//! finds from random starts, at nominal values if there are any, with deflation where Φ has a double root),
//! and at what they leave free (Lie brackets, inertia).
//!
//! Invariant: no mistake is reported that only failed to be disproved. A set of constraints is called
//! contradictory only if its parameters are known and it is small enough for a search to be reliable. Models
//! do not declare which switched rows are on together, so each is checked beside those that always hold.

mod choices;
pub mod constraints;
mod contents;
mod definite;
mod effect;
mod finding;
pub mod hazards;
mod inertia;
mod jumps;
mod modular;
mod quadratic;
mod rotations;
mod speeds;
pub mod structure;
mod symmetry;
pub mod units;
mod unused;

use crate::mechanics::{Equations, Model};

pub use constraints::Analysis;
pub use finding::Finding;
pub use symmetry::{conserved, power_unit};

/// Checks of what is declared, before anything is derived.
#[must_use]
pub fn declared(model: &Model) -> Vec<Finding> {
    let mut found = Vec::new();
    // A parameter that nothing reads is a term that was forgotten.
    unused::unused(model, &mut found);
    found.extend(one_by_one(model));
    found
}

/// Checks of what is declared, each declaration by itself: also where others of the model are missing,
/// because they have mistakes of another kind.
#[must_use]
pub fn one_by_one(model: &Model) -> Vec<Finding> {
    let mut found = Vec::new();
    // Roles are functions of certain quantities only; the derivation relies on it.
    contents::contents(model, &mut found);
    // M q̈ + … is linear in q̈ with M(q, t) only for T of second degree.
    quadratic::quadratic(model, &mut found);
    // Nor does it hold where T jumps.
    jumps::jumps(model, &mut found);
    // An energy that depends on nothing that moves is a slip, not a choice.
    effect::without_effect(model, &mut found);
    // What holds the parts together has rules of its own.
    constraints::declared(model, &mut found);
    // Speeds stand for the velocities: w = Y q̇ + y.
    speeds::declared(model, &mut found);
    found
}

/// Whether the speeds determine all velocities beside the constraints, of which this is known.
#[must_use]
pub fn speeds(model: &Model, analysis: &Analysis) -> Vec<Finding> {
    let mut found = Vec::new();
    speeds::together(model, analysis, &mut found);
    found
}

/// Directions of motion without inertia: for models whose mass matrix met a pivot that is zero in every
/// state, that of coordinate `pivot`.
#[must_use]
pub fn singular(model: &mut Model, pivot: usize) -> Vec<Finding> {
    let mut found = Vec::new();
    inertia::inertia(model, pivot, &mut found);
    found
}

/// Checks of what was derived.
#[must_use]
pub fn derived(model: &mut Model, equations: &Equations, analysis: &Analysis) -> Vec<Finding> {
    let mut found = Vec::new();
    // A force that moves nothing is applied at the wrong point.
    effect::idle_forces(model, &mut found);
    // Negative inertia runs away: a sign is wrong. With constraints it is looked for along the free
    // directions.
    if equations.constraints.is_none() {
        definite::definite(model, equations, &mut found);
    }
    // The energies of bodies are those of rotations.
    rotations::rotations(model, analysis, &mut found);
    constraints::derived(model, equations, analysis, &mut found);
    found
}

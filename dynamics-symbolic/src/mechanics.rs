//! From a declared model to its equations of motion: M, Q, q̈, λ, momenta, energies, powers, Jacobians.
//!
//! There are three derivations. If T is a sum of products of true velocities, M = JᵀWJ directly. Otherwise
//! the momenta p = ∂L/∂q̇ are differentiated. For rigid bodies that hang on one another, recursions in
//! the axes of the bodies are taken if they are shorter. Jacobians follow by the implicit function theorem
//! from the residual of inverse dynamics.
//!
//! Products are never expanded. Christoffel symbols are formed for at most four coordinates, where they are
//! counted against the sweep (double pendulum: 33 operations for M and Q, not 52).
//!
//! Notes of bodies and speeds are believed only if the equations that they give have the values of the plain
//! ones, coordinate by coordinate, by fingerprints. A wrong note costs operations, never a wrong motion. The
//! solution in speeds is taken without constraints only if K and BᵀM B are finite everywhere, so that it
//! fails nowhere where M does not.
//!
//! Every set of up to three switched constraints that may be released is a smaller system, solved likewise
//! while all together stay cheap; of more, all on and all off. What has no solution on the graph (repeated
//! rows, forces that depend on reactions, too many operations) is left to the general solver of the runtime,
//! with the reason. With constraints, outputs, events and powers keep the symbols q̈ and λ, so that one
//! solution per state serves them all.

mod articulated_bodies;
mod bodies;
mod constraints;
mod derive;
mod directions;
mod equations;
mod forces;
mod inverse;
mod lagrange;
mod limits;
mod model;
mod picture;
mod released;
mod solution;
mod speeds;
mod twists;
mod vectors;
mod velocity_form;

pub use crate::algebra::{Elimination, Guard, Guarded, Unrolled};
pub(crate) use constraints::reaction;
pub use derive::{derive, derive_on, momentum_rates, output_variations, residual, variations};
pub use directions::directions;
pub use equations::{
    ConservedKind, ConservedQuantity, ConstraintDerivatives, ConstraintEquations, Derivation, Equations,
    General, Jacobians, Named, NoDerivatives, NoSpeedForm, Pivot, Released, Solution, SpeedEquations,
    Underivable, Variations,
};
pub use limits::MOST_OPERATIONS;
pub use model::{
    AngleSet, Assumption, AssumptionKind, Body, Constraint, ConstraintKind, Coordinate, Energy, EnergyRole,
    Event, Force, ForceTerm, FrameStep, Function, Input, Model, Output, Parameter, Speed,
};
pub use picture::{DrawnPoint, Extra, Figure, Figures, NamedPoint, NotFollowed, Pen, Picture, Shape};
pub use solution::Manifold;

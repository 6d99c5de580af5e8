//! From a declared model to its equations of motion.

mod bodies;
mod constraints;
mod derive;
mod equations;
mod forces;
mod inverse;
mod lagrange;
mod levers;
mod model;
mod released;
mod solution;
mod speeds;
mod twists;
mod vectors;
mod velocity_form;

pub use crate::algebra::{Elimination, Guard, Guarded, Unrolled};
pub(crate) use constraints::reaction;
pub use derive::{derive, derive_on, momentum_rates, output_variations, residual, variations};
pub use equations::{
    Aside, ConstraintDerivatives, ConstraintEquations, Derivation, Equations, General, Jacobians, Named,
    Pivot, Released, Solution, SpeedEquations, Underivable, Variations, Withheld,
};
pub use model::{
    AngleSet, Body, Claim, Constraint, ConstraintKind, Coordinate, Energy, EnergyRole, Event, Force,
    ForceTerm, Function, Input, Model, Output, Parameter, Premise, Speed, Step,
};
pub use solution::Manifold;

//! From a declared model to its equations of motion.

mod derive;
mod equations;
mod forces;
mod inverse;
mod lagrange;
mod model;
mod velocity_form;

pub use crate::algebra::{Elimination, Guard, Guarded, Unrolled};
pub use derive::{Underivable, derive};
pub use equations::{ConstraintEquations, Derivation, Equations, General, Jacobians, Named, Pivot, Solution};
pub use model::{
    Constraint, ConstraintKind, Coordinate, Energy, EnergyRole, Event, Force, ForceTerm, Function, Input, Model,
    Output, Parameter,
};

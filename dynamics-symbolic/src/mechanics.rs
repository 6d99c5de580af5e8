//! From a declared model to its equations of motion.

mod equations;
mod model;

pub use equations::{Derivation, Equations, Named, Pivot};
pub use model::{Coordinate, Energy, EnergyRole, Event, Force, ForceTerm, Function, Input, Model, Output, Parameter};

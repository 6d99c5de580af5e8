//! Units: dimensions with rational exponents, unit expressions as users write them, and a solver that infers
//! what is not declared.
//!
//! A model is written in one coherent system, SI (m, kg, s, N, …) or US customary (ft, slug, s, lb); scaled
//! units (mm, kN, deg) are recognised and refused with their factor, because a factor that is applied
//! silently is a factor that is forgotten. Angles in radians count as 1.
//!
//! The checks work on [`UnitExpr`]s, which the caller attaches to its values: products and powers combine,
//! sums and comparisons [equate](Units::equate). Every equation carries an [`Origin`](crate::graph::Origin),
//! so that a conflict can be reported where it arose.

mod dimension;
mod exponent;
mod parse;
mod solve;
mod table;

pub use dimension::{Dimension, System};
pub use exponent::Exponent;
pub use parse::{Unit, UnitError};
pub use solve::{Conflict, Inference, MixedSystems, UnitExpr, Units};

//! Implicit methods for stiff systems, by Newton's method on the equations of their stages.

mod esdirk4;
mod generalized_alpha;
mod radau5;

pub use esdirk4::Esdirk4;
pub use generalized_alpha::GeneralizedAlpha;
pub use radau5::{Collocation, Radau5, RadauInterpolant};

//! Methods of fixed step that preserve a structure of the motion: symplectic ones, and one that keeps energy.

pub(super) mod composition;
mod energy_midpoint;
mod fixed_point;
mod gauss;
mod semi_implicit_euler;
mod stormer_verlet;

pub use composition::{Composition, Composition4, Composition6, Composition8};
pub use energy_midpoint::EnergyMidpoint;
pub use gauss::{Gauss, Gauss4, Gauss6};
pub use semi_implicit_euler::SemiImplicitEuler;
pub use stormer_verlet::{Rattle, StormerVerlet};

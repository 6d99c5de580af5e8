//! Parts of steps by themselves, for benchmarks and tests of their bits.

pub use crate::drift::DriftAndKick;
pub use crate::mass::Accelerations;
pub use crate::tangent::NewtonStep;

//! Dense linear algebra on slices, in memory that the caller lends, without allocation.

pub(crate) mod elimination;
pub(crate) mod lu;
mod memory;
pub(crate) mod orthogonal;
mod rows;
mod svd;

pub(crate) use lu::Lu;
pub(crate) use memory::{Indices, WorkMemory};
pub(crate) use rows::{add, add_scaled, dot, max_abs, norm, swap_rows};
pub(crate) use svd::Svd;

/// A pivot of M = LDLᵀ below this part of its diagonal element is rounding: eliminations of n ≤ 100
/// coordinates leave at most about n·ε ≈ 2·10⁻¹⁴ of it.
pub const PIVOT_TOLERANCE: f64 = 1e-13;

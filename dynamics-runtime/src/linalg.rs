//! Dense linear algebra on slices, in a workspace that the caller lends, without allocation.

pub(crate) mod elimination;
pub(crate) mod lu;
pub(crate) mod orthogonal;
mod rows;
mod svd;
mod workspace;

pub(crate) use lu::Lu;
pub(crate) use rows::{add, add_scaled, dot, max_abs, norm, swap_rows};
pub(crate) use svd::Svd;
pub(crate) use workspace::{Indices, WorkspaceSlices};

/// A pivot of M = LDLᵀ below this part of its diagonal element is rounding: eliminations of n ≤ 100
/// coordinates leave at most about n·ε ≈ 2·10⁻¹⁴ of it.
pub const PIVOT_TOLERANCE: f64 = 1e-13;

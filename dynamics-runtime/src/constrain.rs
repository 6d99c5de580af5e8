//! Constraints at run time: general rank-revealing solves, projection, partitioning, friction.

/// Length of the memory that the general solvers need for n coordinates and r constraint rows.
#[must_use]
pub const fn workspace_len(n: usize, r: usize) -> usize {
    // Several matrices of each shape, and vectors.
    4 * n * n + 4 * n * r + 2 * r * r + 12 * (n + r)
}

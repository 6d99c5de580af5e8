//! The directions in which branches leave a point: those in which F changes least.
//!
//! They are the right singular vectors of the least singular values of [K, F_p], with forces weighted by
//! inertia, and coordinates and parameters in their scales. On a branch the null space has one dimension, in
//! a simple branch point two, and one more for each further stiffness that vanishes there.

use alloc::vec::Vec;

use dynamics_runtime::model::Constraints;
use nalgebra::{DMatrix, DVector};

use super::problem::{Balance, ContinuationProblem, Direction};

/// The `count` directions in which F changes least, orthonormal in the scales of coordinates and parameters.
/// There are fewer if the problem has fewer unknowns.
pub(super) fn null_space<M: Constraints>(
    problem: &ContinuationProblem<'_, M>,
    balance: &Balance<M>,
    count: usize,
) -> Option<Vec<Direction>> {
    let (unknowns, n) = (balance.jacobian.ncols(), balance.size());
    let scales = DVector::from_fn(unknowns, |j, _| problem.scale_of(balance, j));
    let scaled = balance.jacobian_per_inertia()? * DMatrix::from_diagonal(&scales);
    if !scaled.iter().all(|x| x.is_finite()) {
        return None;
    }
    // A thin decomposition omits the null space. A further row of zeros includes it.
    let svd = scaled.insert_row(n, 0.0).try_svd(false, true, f64::EPSILON, 1000)?;
    let mut order: Vec<usize> = (0..unknowns).collect();
    order.sort_by(|i, j| svd.singular_values[*i].total_cmp(&svd.singular_values[*j]));
    let v_t = svd.v_t?;
    // Singular vectors are orthonormal in independent coordinates, directions are so in all of them.
    let mut space: Vec<Direction> = Vec::new();
    for k in order.into_iter().take(count) {
        let mut direction = balance.direction(&v_t.row(k).transpose().component_mul(&scales), problem.count);
        for known in &space {
            let along = problem.dot(known, &direction);
            direction = Direction {
                q: &direction.q - &known.q * along,
                p: core::array::from_fn(|k| direction.p[k] - along * known.p[k]),
            };
        }
        let norm = problem.norm(&direction);
        if norm > 0.0 {
            space.push(direction.scaled(1.0 / norm));
        }
    }
    (!space.is_empty()).then_some(space)
}

/// The two directions in which F changes least. Away from branch points, and at folds, the first of them is
/// the tangent of the branch.
pub(super) fn null_plane<M: Constraints>(
    problem: &ContinuationProblem<'_, M>,
    balance: &Balance<M>,
) -> Option<[Direction; 2]> {
    null_space(problem, balance, 2)?.try_into().ok()
}

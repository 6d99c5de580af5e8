//! Condition numbers of mass matrices: κ = ‖S‖₁ ‖S⁻¹‖₁ of M scaled to a unit diagonal.

use alloc::vec::Vec;

use nalgebra::DMatrix;

use super::gradients::mass;
use super::inertia::{projected_inertia, unit_inertias};
use super::with_workspace;
use crate::math;
use crate::model::{Constraints, StaticTraits};

/// κ of M at a state.
pub(crate) fn condition_number<M: Constraints>(model: &M, state: &M::State) -> f64 {
    with_workspace::<M, _>(|workspace| {
        mass_condition_number(M::COORDINATES.len(), mass(model, state, workspace), M::IS_CONSTRAINED)
    })
}

/// κ of the inertia on the velocities that the constraints leave: of P S P + b (1 − P), P the projection
/// onto these velocities, b their mean inertia.
pub(crate) fn constrained_condition_number<M: Constraints>(model: &M, state: &M::State) -> f64 {
    let n = M::COORDINATES.len();
    let mean = |mass: &[f64], has_constraints: usize| match n.saturating_sub(has_constraints) {
        0 => 1.0,
        free => (0..n).map(|i| mass[i * n + i]).sum::<f64>() / free as f64,
    };
    let projected = projected_inertia(model, state, &unit_inertias(model, state), mean);
    projected.map_or(f64::NAN, |projected| mass_condition_number(n, &projected, false))
}

/// κ of M by rows; exactly 1 where M is diagonal. Coordinates without any inertia are left out where there
/// are constraints, which determine them. M determines the accelerations of the others.
pub(crate) fn mass_condition_number(n: usize, mass: &[f64], has_constraints: bool) -> f64 {
    let entry = |i: usize, j: usize| mass[i * n + j];
    let with_inertia: Vec<usize> =
        (0..n).filter(|i| !has_constraints || (0..n).any(|j| entry(*i, j) != 0.0)).collect();
    let scale = |i: usize| if entry(i, i) == 0.0 { 1.0 } else { entry(i, i).abs() };
    let scaled = |i: usize, j: usize| entry(i, j) / math::sqrt(scale(i) * scale(j));
    let scaled = DMatrix::from_fn(with_inertia.len(), with_inertia.len(), |i, j| {
        scaled(with_inertia[i], with_inertia[j])
    });
    if scaled.iter().any(|x| x.is_nan()) {
        return f64::NAN;
    }
    let size = norm(&scaled);
    if size == 1.0 && scaled.diagonal().iter().all(|x| x.abs() == 1.0) {
        // A unit diagonal and nothing else.
        return 1.0;
    }
    // By elimination. Up to four rows `try_inverse` of a matrix has closed forms, which return finite numbers
    // for matrices of rank n − 2.
    scaled.lu().try_inverse().map_or(f64::INFINITY, |inverse| size * norm(&inverse))
}

/// ‖A‖₁, the largest sum of absolute values in a column.
fn norm(matrix: &DMatrix<f64>) -> f64 {
    matrix.column_iter().map(|column| column.iter().map(|x| x.abs()).sum()).fold(0.0, f64::max)
}

//! Condition numbers of mass matrices.

use alloc::vec::Vec;

use nalgebra::DMatrix;

use super::gradients::mass;
use super::inertia::{left_inertia, unit_inertias};
use super::with_workspace;
use crate::math;
use crate::model::{Constraints, Known};

pub(crate) fn condition_number<M: Constraints>(model: &M, state: &M::State) -> f64 {
    with_workspace::<M, _>(|workspace| {
        condition_of(M::COORDINATES.len(), mass(model, state, workspace), M::IS_HELD)
    })
}

/// κ of P S P + b (1 − P), P onto the velocities that the constraints leave, b the mean inertia of these.
pub(crate) fn left_condition<M: Constraints>(model: &M, state: &M::State) -> f64 {
    let n = M::COORDINATES.len();
    let mean = |mass: &[f64], held: usize| match n.saturating_sub(held) {
        0 => 1.0,
        free => (0..n).map(|i| mass[i * n + i]).sum::<f64>() / free as f64,
    };
    let left = left_inertia(model, state, &unit_inertias(model, state), mean);
    left.map_or(f64::NAN, |left| condition_of(n, &left, false))
}

/// Of M by rows; an exact 1 where it is diagonal. Coordinates without any inertia are carried along by
/// constraints, if there are any (`held`); the accelerations of the others are what M determines.
pub(crate) fn condition_of(n: usize, mass: &[f64], held: bool) -> f64 {
    let entry = |i: usize, j: usize| mass[i * n + j];
    let heavy: Vec<usize> = (0..n).filter(|i| !held || (0..n).any(|j| entry(*i, j) != 0.0)).collect();
    let scale = |i: usize| if entry(i, i) == 0.0 { 1.0 } else { entry(i, i).abs() };
    let scaled = |i: usize, j: usize| entry(i, j) / math::sqrt(scale(i) * scale(j));
    let scaled = DMatrix::from_fn(heavy.len(), heavy.len(), |i, j| scaled(heavy[i], heavy[j]));
    if scaled.iter().any(|x| x.is_nan()) {
        return f64::NAN;
    }
    let size = norm(&scaled);
    if size == 1.0 && scaled.diagonal().iter().all(|x| x.abs() == 1.0) {
        // Nothing beside a unit diagonal.
        return 1.0;
    }
    // By elimination: up to four rows `try_inverse` has closed forms, which make a number of what is singular
    // twice.
    scaled.lu().try_inverse().map_or(f64::INFINITY, |inverse| size * norm(&inverse))
}

/// ‖A‖₁, the largest sum of absolute values in a column.
fn norm(matrix: &DMatrix<f64>) -> f64 {
    matrix.column_iter().map(|column| column.iter().map(|x| x.abs()).sum()).fold(0.0, f64::max)
}

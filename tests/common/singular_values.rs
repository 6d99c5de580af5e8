//! Ranks of constraints by singular values, as nothing of the library computes them.

use dynamics::model::{Constraints, Terms, Vector};
use nalgebra::DMatrix;

/// Φ_q at a state, its rows scaled to length one.
pub(crate) fn jacobian<M: Constraints>(model: &M, state: &M::State) -> DMatrix<f64> {
    let (n, r) = (M::Vector::LEN, M::Rows::LEN);
    let (mut mass, mut force, mut jacobian, mut gamma) =
        (vec![0.0; n * n], vec![0.0; n], vec![0.0; r * n], vec![0.0; r]);
    model.terms(
        state,
        &mut Terms { mass: &mut mass, force: &mut force, jacobian: &mut jacobian, gamma: &mut gamma },
    );
    let mut rows = DMatrix::from_row_slice(r, n, &jacobian);
    rows.row_iter_mut().for_each(|mut row| row /= row.norm());
    rows
}

/// The number of singular values that are none of rounding.
pub(crate) fn rank(jacobian: &DMatrix<f64>) -> usize {
    jacobian.clone().svd(false, false).singular_values.iter().filter(|s| **s > 1e-9).count()
}

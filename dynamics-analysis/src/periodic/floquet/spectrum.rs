//! Multipliers of a matrix with a known uncertainty, without those that are known to be 1.

use alloc::vec::Vec;

use nalgebra::{Complex, DMatrix, DVector};

use super::Multiplier;
use crate::linearize::{eigenvector, matrix_eigenvalues};
use crate::periodic::PeriodicError;
use crate::periodic::symmetry::{Known, Trivial};

/// Vectors whose part off the span of others is at most this count as dependent on them. Directions are known
/// to about 1e-7 (`symmetry.rs`).
const DEPENDENT_DIRECTION: f64 = 1e-6;
/// Relative error of the form W, which is made of differences of the momenta. Formulas of order 6 leave less.
const FORM_ERROR: f64 = 1e-10;
/// Factor on the error of M within which the symplectic defect is allowed. A smaller factor may take an error
/// of integration for damping.
const DEFECT_ERROR_FACTOR: f64 = 10.0;

/// The matrix in the scales of the coordinates, w_i⁻¹ m_ij w_j.
fn scale(m: &DMatrix<f64>, weights: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(m.nrows(), m.ncols(), |i, j| m[(i, j)] * weights[j] / weights[i])
}

/// A monodromy matrix and the error bounds of its elements, in the scales of the coordinates.
pub(super) struct Scaled {
    m: DMatrix<f64>,
    uncertainty: DMatrix<f64>,
    weights: DVector<f64>,
}

impl Scaled {
    pub(super) fn new(m: &DMatrix<f64>, uncertainty: &DMatrix<f64>, weights: DVector<f64>) -> Self {
        Self { m: scale(m, &weights), uncertainty: scale(uncertainty, &weights), weights }
    }

    /// A bilinear form in the scales of the coordinates.
    fn weigh(&self, w: &DMatrix<f64>) -> DMatrix<f64> {
        DMatrix::from_fn(w.nrows(), w.ncols(), |i, j| w[(i, j)] * self.weights[i] * self.weights[j])
    }

    /// ‖MᵀWM − W‖/‖W‖.
    pub(super) fn defect(&self, w: &DMatrix<f64>) -> f64 {
        let w = self.weigh(w);
        (self.m.tr_mul(&(&w * &self.m)) - &w).amax() / w.amax().max(f64::MIN_POSITIVE)
    }

    /// The largest defect that the errors of M and W can cause.
    pub(super) fn allowed_defect(&self, w: &DMatrix<f64>) -> f64 {
        let w = self.weigh(w).abs();
        let (m, off) = (self.m.abs(), &self.uncertainty);
        let of_m = m.tr_mul(&(&w * off)) + off.tr_mul(&(&w * &m));
        let of_w = m.tr_mul(&(&w * &m)) * FORM_ERROR;
        (DEFECT_ERROR_FACTOR * of_m + of_w).amax() / w.amax().max(f64::MIN_POSITIVE)
    }

    /// All multipliers with their shapes. Those known to be 1 are removed first, the others computed on the
    /// complement.
    pub(super) fn multipliers(
        &self,
        known: &Known,
    ) -> Result<(Vec<Multiplier>, Vec<DVector<f64>>), PeriodicError> {
        let n = self.m.nrows();
        let unit = |x: DVector<f64>| {
            let size = x.norm();
            x / size
        };
        let right = known.right.iter().map(|(x, why)| (unit(x.component_div(&self.weights)), *why));
        let mut taken: Vec<(DVector<f64>, Trivial)> = right.collect();
        let rights = taken.len();
        for (x, why) in &known.left {
            let x = unit(x.component_mul(&self.weights));
            // A left direction that is not orthogonal to the right ones belongs to the same multiplier.
            if taken[..rights].iter().all(|(right, _)| right.dot(&x).abs() < DEPENDENT_DIRECTION) {
                taken.push((x, *why));
            }
        }
        let (basis, used) = complement(n, &taken);
        let mut found: Vec<Multiplier> = used
            .into_iter()
            .map(|why| Multiplier {
                value: Complex::new(1.0, 0.0),
                uncertainty: 0.0,
                conditioning: 1.0,
                trivial: Some(why),
            })
            .collect();
        let rest = basis.tr_mul(&(&self.m * &basis));
        let off = basis.abs().tr_mul(&(&self.uncertainty * basis.abs()));
        let mut shapes = alloc::vec![DVector::zeros(n); found.len()];
        for (multiplier, shape) in spectrum(&rest, &off)? {
            found.push(multiplier);
            let of_all = basis.map(|x| Complex::new(x, 0.0)) * shape;
            shapes.push(of_all.map(|x| x.norm()));
        }
        Ok((found, shapes))
    }
}

/// An orthonormal basis of the orthogonal complement of some vectors, and the reasons of those that were
/// independent. By Gram–Schmidt, twice for each vector.
fn complement(n: usize, taken: &[(DVector<f64>, Trivial)]) -> (DMatrix<f64>, Vec<Trivial>) {
    let mut basis: Vec<DVector<f64>> = Vec::new();
    let rest = |x: &DVector<f64>, basis: &[DVector<f64>]| {
        let mut x = x.clone();
        for _ in 0..2 {
            basis.iter().for_each(|b| x -= b * b.dot(&x));
        }
        x
    };
    let mut used = Vec::new();
    for (x, why) in taken {
        let left = rest(x, &basis);
        if left.norm() > DEPENDENT_DIRECTION {
            basis.push(left.normalize());
            used.push(*why);
        }
    }
    let first = basis.len();
    while basis.len() < n {
        let units = (0..n).map(|k| rest(&DVector::from_fn(n, |i, _| if i == k { 1.0 } else { 0.0 }), &basis));
        let Some(best) = units.max_by(|a, b| a.norm().total_cmp(&b.norm())) else { break };
        basis.push(best.normalize());
    }
    let columns: Vec<DVector<f64>> = basis.split_off(first);
    let matrix = if columns.is_empty() { DMatrix::zeros(n, 0) } else { DMatrix::from_columns(&columns) };
    (matrix, used)
}

/// A multiplier, and its eigenvector.
type WithShape = (Multiplier, DVector<Complex<f64>>);

/// Eigenvalues with vectors, and their error bounds if the elements may be wrong by `off`: the first-order
/// bound, and at most Elsner's bound.
fn spectrum(a: &DMatrix<f64>, off: &DMatrix<f64>) -> Result<Vec<WithShape>, PeriodicError> {
    let n = a.nrows();
    let mut found = Vec::with_capacity(n);
    for (k, value) in
        matrix_eigenvalues(a.clone()).map_err(PeriodicError::Eigenvalues)?.into_iter().enumerate()
    {
        let right = eigenvector(a, value, k).map_err(PeriodicError::Eigenvalues)?;
        let left = eigenvector(&a.transpose(), value.conj(), k).map_err(PeriodicError::Eigenvalues)?;
        let of = |x: &DVector<Complex<f64>>| x.map(|x| x.norm());
        let product = left.dotc(&right).norm().max(f64::MIN_POSITIVE);
        let bound = of(&left).dot(&(off * of(&right))) / product;
        let part = 1.0 / n as f64;
        let uncertainty = bound.min((2.0 * a.norm() + off.norm()).powf(1.0 - part) * off.norm().powf(part));
        let size = of(&left).dot(&(a.abs() * of(&right)));
        let conditioning = size / (product * value.norm().max(f64::MIN_POSITIVE));
        found.push((Multiplier { value, uncertainty, conditioning, trivial: None }, right));
    }
    Ok(found)
}

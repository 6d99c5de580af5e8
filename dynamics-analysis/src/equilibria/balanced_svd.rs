//! The singular value decomposition of a balanced stiffness matrix, and the displacements that forces cause.

use nalgebra::{DMatrix, DVector, SVD};

/// Singular values of the balanced K below this share of the largest are zero. Rounding leaves about
/// 10⁻¹⁶ times the number of rows.
pub(crate) const ZERO_SINGULAR_VALUE: f64 = 1e-13;

/// A matrix with balanced rows and columns: R A C, with R and C diagonal, so that the largest element of each
/// column is 1.
pub(crate) struct Equilibrated {
    pub(crate) rows: DVector<f64>,
    pub(crate) columns: DVector<f64>,
    pub(crate) matrix: DMatrix<f64>,
}

impl Equilibrated {
    pub(crate) fn of(a: &DMatrix<f64>) -> Self {
        let inverse = |most: f64| if most >= f64::MIN_POSITIVE { 1.0 / most } else { 1.0 };
        let rows = DVector::from_iterator(a.nrows(), a.row_iter().map(|row| inverse(row.amax())));
        let mut matrix = DMatrix::from_diagonal(&rows) * a;
        let columns =
            DVector::from_iterator(a.ncols(), matrix.column_iter().map(|column| inverse(column.amax())));
        matrix.column_iter_mut().zip(columns.iter()).for_each(|(mut column, c)| column *= *c);
        Self { rows, columns, matrix }
    }
}

/// K = R⁻¹ (U Σ Vᵀ) C⁻¹ with balanced rows and columns, so that soft directions keep their digits
/// beside stiff ones.
pub(super) struct BalancedSvd {
    pub(super) rows: DVector<f64>,
    pub(super) columns: DVector<f64>,
    pub(super) svd: SVD<f64, nalgebra::Dyn, nalgebra::Dyn>,
}

impl BalancedSvd {
    pub(super) fn of(k: &DMatrix<f64>) -> Option<Self> {
        let Equilibrated { rows, columns, matrix } = Equilibrated::of(k);
        let svd = SVD::try_new(matrix, true, true, f64::EPSILON, 300 * (k.nrows() + k.ncols()))?;
        Some(Self { rows, columns, svd })
    }

    /// δz of least size with K δz = `right`. Along directions without stiffness it is zero.
    pub(super) fn solve(&self, right: &DVector<f64>) -> DVector<f64> {
        let (Some(u), Some(v_t)) = (&self.svd.u, &self.svd.v_t) else {
            return DVector::zeros(self.columns.len());
        };
        let along = u.tr_mul(&right.component_mul(&self.rows));
        let least = ZERO_SINGULAR_VALUE * self.svd.singular_values.amax();
        let sigma = &self.svd.singular_values;
        let scaled = along.zip_map(sigma, |x, sigma| if sigma > least { x / sigma } else { 0.0 });
        v_t.tr_mul(&scaled).component_mul(&self.columns)
    }

    /// The pseudo-inverse of K on the directions whose singular values are above this share of the largest,
    /// except for one direction.
    pub(super) fn inverse_without(&self, share: f64, one: usize) -> DMatrix<f64> {
        let (Some(u), Some(v_t)) = (&self.svd.u, &self.svd.v_t) else {
            return DMatrix::zeros(self.columns.len(), self.rows.len());
        };
        let least = share * self.svd.singular_values.amax();
        let mut inverse = self.svd.singular_values.map(|sigma| if sigma > least { 1.0 / sigma } else { 0.0 });
        inverse[one] = 0.0;
        let balanced = v_t.tr_mul(&(DMatrix::from_diagonal(&inverse) * u.transpose()));
        DMatrix::from_diagonal(&self.columns) * balanced * DMatrix::from_diagonal(&self.rows)
    }

    /// The largest |δz| that forces of these magnitudes can cause, along directions with stiffness.
    pub(super) fn reach(&self, forces: &DVector<f64>) -> DVector<f64> {
        let (Some(u), Some(v_t)) = (&self.svd.u, &self.svd.v_t) else {
            return DVector::zeros(self.columns.len());
        };
        let along = u.abs().tr_mul(&forces.component_mul(&self.rows));
        let least = ZERO_SINGULAR_VALUE * self.svd.singular_values.amax();
        let scaled = along.zip_map(&self.svd.singular_values, |x, s| if s > least { x / s } else { 0.0 });
        v_t.abs().tr_mul(&scaled).component_mul(&self.columns)
    }
}

//! Singular value decomposition of the constraint Jacobian at a point of the path, and a test that all
//! Jacobians between two points have full rank.

use alloc::vec;
use alloc::vec::Vec;

use crate::constrain::active_set::active;
use crate::constrain::system::ModelTerms;
use crate::constrain::{Gradients, gradients};
use crate::linalg::Svd;
use crate::linalg::WorkspaceSlices;
use crate::math;
use crate::model::{Constraints, ModelState, Terms, Vector};

/// Scales that do not change along the path: active rows and weights of the coordinates.
pub(super) struct PathScaling {
    /// Active holonomic rows.
    pub(super) rows: Vec<usize>,
    /// w: scaled coordinates are y = w q, w = √Mᵢᵢ at the start.
    pub(super) weights: Vec<f64>,
    /// Norms of the rows at the start, for constraints of one row. Scaled by itself such a row has length 1
    /// everywhere but where its gradient vanishes.
    initial_norms: Vec<f64>,
}

impl PathScaling {
    /// The scales at a start.
    pub(super) fn from<M: Constraints>(model: &M, start: &M::State, rows: Vec<usize>) -> Self {
        let weights = weights(model, start);
        let scaling = Self { initial_norms: vec![0.0; rows.len()], rows, weights };
        // Rows that are not finite are reported by the first decomposition.
        let initial_norms = scaling.norms(model, start).unwrap_or_else(|_| scaling.initial_norms.clone());
        Self { initial_norms, ..scaling }
    }

    /// ‖w x‖.
    pub(super) fn length(&self, x: &[f64]) -> f64 {
        math::sqrt(x.iter().zip(&self.weights).map(|(x, w)| (x * w) * (x * w)).sum())
    }

    /// ‖w (1 + |q|)‖, the size that changes of the coordinates are compared with.
    pub(super) fn scale(&self, q: &[f64]) -> f64 {
        math::sqrt(q.iter().zip(&self.weights).map(|(q, w)| math::powi(w * (1.0 + q.abs()), 2)).sum())
    }

    /// Φ_q, rows divided by `scales`, columns by w; by columns.
    pub(super) fn jacobian<M: Constraints>(&self, model: &M, state: &M::State, scales: &[f64]) -> Vec<f64> {
        let mut workspace = vec![0.0; gradients::workspace_len(M::Vector::LEN, M::Rows::LEN)];
        let gradients = Gradients::alone(model, state, &mut workspace);
        let columns = self.weights.iter().enumerate();
        columns
            .flat_map(|(j, w)| self.rows.iter().zip(scales).map(move |(row, s)| (*row, j, w * s)))
            .map(|(row, j, scale)| gradients.row(row)[j] / scale)
            .collect()
    }

    /// Scales of the rows: the largest norm of a row of the same constraint, so that a component of a vector
    /// that loses its gradient shows it. Single rows have their norm at the start, if that is larger. An
    /// error names a row that is not finite.
    fn norms<M: Constraints>(&self, model: &M, state: &M::State) -> Result<Vec<f64>, usize> {
        let mut workspace = vec![0.0; gradients::workspace_len(M::Vector::LEN, M::Rows::LEN)];
        let gradients = Gradients::alone(model, state, &mut workspace);
        let square = |row: usize| -> f64 {
            gradients.row(row).iter().zip(&self.weights).map(|(x, w)| math::powi(x / w, 2)).sum()
        };
        if let Some(row) = self.rows.iter().find(|row| !square(**row).is_finite()) {
            return Err(*row);
        }
        let mut norms = Vec::with_capacity(self.rows.len());
        for constraint in active::<M>(state.active_set(), true) {
            let rows = constraint.first..constraint.first + constraint.rows;
            let norm = math::sqrt(rows.clone().map(square).fold(0.0, f64::max));
            let norm =
                if constraint.rows == 1 { math::max(norm, self.initial_norms[norms.len()]) } else { norm };
            norms.extend(rows.map(|_| if norm > 0.0 { norm } else { 1.0 }));
        }
        Ok(norms)
    }
}

/// U Σ Vᵀ of the scaled Jacobian at a point.
#[derive(Clone)]
pub(super) struct JacobianSvd {
    /// Norms of the rows.
    pub(super) scales: Vec<f64>,
    a: Vec<f64>,
    v: Vec<f64>,
    pub(super) sigma: Vec<f64>,
    /// Number of refinements since the last full decomposition.
    refinements: u32,
}

/// Most refinements in a row, each of which adds rounding to V. A smaller number costs full decompositions, a
/// larger one digits of V.
const MAX_REFINEMENTS: u32 = 100;

impl JacobianSvd {
    pub(super) fn new<M: Constraints>(
        scaling: &PathScaling,
        model: &M,
        state: &M::State,
    ) -> Result<Self, usize> {
        let (m, n) = (scaling.rows.len(), scaling.weights.len());
        let scales = scaling.norms(model, state)?;
        let mut a = scaling.jacobian(model, state, &scales);
        let (mut v, mut sigma) = (vec![0.0; n * n], vec![0.0; n]);
        Svd::new(m, &mut a, &mut v, &mut sigma);
        Ok(Self { scales, a, v, sigma, refinements: 0 })
    }

    /// The decomposition at a point nearby, at a third of the cost: the V of this one nearly decomposes that
    /// Jacobian, too.
    pub(super) fn next<M: Constraints>(
        &self,
        scaling: &PathScaling,
        model: &M,
        state: &M::State,
    ) -> Result<Self, usize> {
        if self.refinements == MAX_REFINEMENTS {
            return Self::new(scaling, model, state);
        }
        let scales = scaling.norms(model, state)?;
        let jacobian = scaling.jacobian(model, state, &scales);
        let (m, n) = (scales.len(), self.sigma.len());
        let (mut a, mut v, mut sigma) = (vec![0.0; m * n], self.v.clone(), vec![0.0; n]);
        for (image, right) in a.chunks_exact_mut(m).zip(self.v.chunks_exact(n)) {
            multiply(&jacobian, right, image);
        }
        Svd::refined(m, &mut a, &mut v, &mut sigma);
        Ok(Self { scales, a, v, sigma, refinements: self.refinements + 1 })
    }

    fn svd(&self) -> Svd<'_> {
        Svd { a: &self.a, v: &self.v, sigma: &self.sigma, m: self.scales.len() }
    }

    /// Index of the smallest singular value.
    fn weakest(&self) -> usize {
        let order = |i: &usize, j: &usize| self.sigma[*i].total_cmp(&self.sigma[*j]);
        (0..self.sigma.len()).min_by(order).unwrap_or(0)
    }

    /// The smallest singular value.
    pub(super) fn least(&self) -> f64 {
        self.sigma.get(self.weakest()).copied().unwrap_or(0.0)
    }

    /// The largest singular value.
    pub(super) fn largest(&self) -> f64 {
        self.svd().largest()
    }

    /// Largest over smallest singular value.
    pub(super) fn condition(&self) -> f64 {
        self.svd().largest() / self.least()
    }

    /// Number of singular values above this part of the largest.
    pub(super) fn rank(&self, cut: f64) -> usize {
        let cut = cut * self.svd().largest();
        self.sigma.iter().filter(|sigma| **sigma > cut).count()
    }

    /// Size of every scaled coordinate in the right singular vectors of the zero singular values.
    pub(super) fn freedom(&self, cut: f64) -> Vec<f64> {
        let (n, cut) = (self.sigma.len(), cut * self.svd().largest());
        let mut out = vec![0.0; n];
        for j in (0..n).filter(|j| self.sigma[*j] <= cut) {
            out.iter_mut().zip(self.svd().right(j)).for_each(|(out, v)| *out = math::hypot(*out, *v));
        }
        out
    }

    /// Length of the part of scaled rows outside of the range of the singular values above this part of the
    /// largest.
    pub(super) fn beyond_range(&self, cut: f64, rows: &[f64]) -> f64 {
        let mut left = rows.to_vec();
        for _ in 0..2 {
            for j in (0..self.sigma.len()).filter(|j| self.sigma[*j] > cut * self.svd().largest()) {
                let column = self.svd().column(j);
                let share: f64 = left.iter().zip(column).map(|(x, a)| x * a).sum();
                let share = share / (self.sigma[j] * self.sigma[j]);
                left.iter_mut().zip(column).for_each(|(x, a)| *x -= share * a);
            }
        }
        math::sqrt(left.iter().map(|x| x * x).sum())
    }

    /// Right and left singular vector of the smallest singular value, in scaled coordinates and rows.
    ///
    /// Where that value is 0 the left vector is the one that the others leave.
    pub(super) fn weakest_vectors(&self) -> (Vec<f64>, Vec<f64>) {
        let weakest = self.weakest();
        let right = self.svd().right(weakest).to_vec();
        let column = self.svd().column(weakest);
        let mut left = column.to_vec();
        let m = left.len();
        let unit = |left: &mut Vec<f64>| {
            let length = math::sqrt(left.iter().map(|x| x * x).sum());
            left.iter_mut().for_each(|x| *x /= length);
            length
        };
        if self.sigma[weakest] > 1e-12 * self.svd().largest() {
            unit(&mut left);
            return (right, left);
        }
        // The column is rounding noise. Take the unit vector with the largest component orthogonal to the
        // other columns.
        let mut largest_least = (0.0, left);
        for k in 0..m {
            let mut candidate = vec![0.0; m];
            candidate[k] = 1.0;
            for _ in 0..2 {
                for j in (0..self.sigma.len()).filter(|j| *j != weakest && self.sigma[*j] > 0.0) {
                    let column = self.svd().column(j);
                    let share: f64 = candidate.iter().zip(column).map(|(c, a)| c * a).sum();
                    let share = share / (self.sigma[j] * self.sigma[j]);
                    candidate.iter_mut().zip(column).for_each(|(c, a)| *c -= share * a);
                }
            }
            let length = unit(&mut candidate);
            if length > largest_least.0 {
                largest_least = (length, candidate);
            }
        }
        (right, largest_least.1)
    }

    /// Whether all matrices on the straight line from here to the Jacobian J at another point have full rank,
    /// with a margin: the symmetric part of Σ^-½ (UᵀJV) Σ^-½, which is the identity here, stays above
    /// ¼. The condition is sufficient, not necessary. It holds for every step that is short enough, and
    /// limits by how much of itself any singular value falls in one step.
    pub(super) fn has_full_rank_toward(&self, jacobian: &[f64]) -> bool {
        let (m, n) = (self.scales.len(), self.sigma.len());
        let svd = self.svd();
        let mut image = vec![0.0; m];
        let mut d = vec![0.0; n * n];
        for j in 0..n {
            multiply(jacobian, svd.right(j), &mut image);
            for i in 0..n {
                let product: f64 = svd.column(i).iter().zip(&image).map(|(a, b)| a * b).sum();
                d[i * n + j] = product / (self.sigma[i] * math::sqrt(self.sigma[i] * self.sigma[j]));
            }
        }
        let entry =
            |i: usize, j: usize| 0.5 * (d[i * n + j] + d[j * n + i]) - if i == j { 0.25 } else { 0.0 };
        is_positive_definite(n, entry)
    }
}

/// image = A x, A by columns.
fn multiply(a: &[f64], x: &[f64], image: &mut [f64]) {
    image.fill(0.0);
    for (column, x) in a.chunks_exact(image.len()).zip(x) {
        if *x != 0.0 {
            image.iter_mut().zip(column).for_each(|(out, a)| *out += x * a);
        }
    }
}

/// Whether a symmetric matrix is positive definite, by Cholesky's elimination.
fn is_positive_definite(n: usize, entry: impl Fn(usize, usize) -> f64) -> bool {
    let mut l = vec![0.0; n * n];
    for i in 0..n {
        for j in 0..=i {
            let sum: f64 = (0..j).map(|k| l[i * n + k] * l[j * n + k]).sum();
            let rest = entry(i, j) - sum;
            if i != j {
                l[i * n + j] = rest / l[j * n + j];
            } else if rest > 0.0 {
                l[i * n + i] = math::sqrt(rest);
            } else {
                // Also for NaN.
                return false;
            }
        }
    }
    l.iter().all(|x| x.is_finite())
}

/// Weights of the coordinates at a state: √Mᵢᵢ. Coordinates without inertia get the smallest of the
/// others.
pub(super) fn weights<M: Constraints>(model: &M, state: &M::State) -> Vec<f64> {
    let (n, r) = (M::Vector::LEN, M::Rows::LEN);
    let mut workspace = vec![0.0; gradients::workspace_len(n, r)];
    let ModelTerms { mass, force, jacobian, gamma } =
        ModelTerms::new(n, r, &mut WorkspaceSlices::new(&mut workspace));
    model.terms(state, &mut Terms { mass, force, jacobian, gamma });
    let mut weights: Vec<f64> = mass.iter().step_by(n + 1).copied().collect();
    crate::constrain::assemble::weigh(&mut weights);
    weights
}

//! Workspace of the assembly, and in it the linearised constraints A y = −Φ/s with A = Φ_q/(s w), y = w q.

use crate::constrain::active_set::{active, active_rows};
use crate::constrain::gradients;
use crate::error::StateError;
use crate::linalg::Svd;
use crate::linalg::norm;
use crate::math;
use crate::model::{ActiveSet, Constraints, ModelState, Terms, Vector};

/// Lower bound of the weights, in parts of the largest one. Without it, a heavy flywheel would push the
/// singular values of light coordinates below the rank tolerance.
const MIN_WEIGHT_RATIO: f64 = 1e-4;

/// Slices of one workspace. Scaled coordinates are y = w q with w = √Mᵢᵢ. Rows are divided by the norm
/// s of their constraint over all columns.
pub(super) struct AssemblyWorkspace<'w> {
    pub(super) mass: &'w mut [f64],
    force: &'w mut [f64],
    pub(super) jacobian: &'w mut [f64],
    gamma: &'w mut [f64],
    /// The usual lengths of the rows of Φ_q.
    pub(super) usual_lengths: &'w mut [f64],
    /// w of every coordinate.
    pub(super) weights: &'w mut [f64],
    /// s of every active row, in their order; the same for the rows of one constraint.
    pub(super) scales: &'w mut [f64],
    /// Right-hand sides and residuals of the active rows.
    pub(super) right: &'w mut [f64],
    /// Steps in the free coordinates.
    pub(super) steps: [&'w mut [f64]; 3],
    a: &'w mut [f64],
    pub(super) v: &'w mut [f64],
    pub(super) sigma: &'w mut [f64],
    /// A second decomposition.
    pub(super) spare: [&'w mut [f64]; 3],
    /// Number of active rows and of free columns of what is decomposed.
    pub(super) shape: (usize, usize),
}

/// Length of the workspace of an [`AssemblyWorkspace`].
pub(in crate::constrain) const fn workspace_len(n: usize, r: usize) -> usize {
    4 * n * n + 2 * r * n + 7 * n + 4 * r
}

impl<'w> AssemblyWorkspace<'w> {
    pub(super) fn new(workspace: &'w mut [f64], n: usize, r: usize) -> Self {
        assert!(workspace.len() >= workspace_len(n, r), "the workspace is shorter than `workspace_len`");
        let mut rest = workspace;
        let mut take = |len: usize| {
            let (head, tail) = core::mem::take(&mut rest).split_at_mut(len);
            rest = tail;
            head
        };
        Self {
            mass: take(n * n),
            force: take(n),
            jacobian: take(r * n),
            gamma: take(r),
            usual_lengths: take(r),
            weights: take(n),
            scales: take(r),
            right: take(r),
            steps: [take(n), take(n), take(n)],
            a: take(r * n),
            v: take(n * n),
            sigma: take(n),
            spare: [take(n * n), take(n * n), take(n)],
            shape: (0, 0),
        }
    }

    /// Evaluates M and Φ_q at a state.
    pub(super) fn evaluate<M: Constraints>(&mut self, model: &M, state: &M::State) {
        self.mass.fill(0.0);
        self.jacobian.fill(0.0);
        let (mass, force, jacobian, gamma) =
            (&mut *self.mass, &mut *self.force, &mut *self.jacobian, &mut *self.gamma);
        gradients::terms(model, state, &mut Terms { mass, force, jacobian, gamma }, self.usual_lengths);
    }

    /// Sets the weights from the mass matrix.
    pub(super) fn weigh(&mut self) {
        let n = self.weights.len();
        self.weights.iter_mut().enumerate().for_each(|(i, weight)| *weight = self.mass[i * n + i]);
        weigh(self.weights);
    }

    /// Scales the active rows of Φ_q and decomposes them in the columns that are free;
    /// [`AssemblyWorkspace::evaluate`] comes before.
    pub(super) fn decompose<M: Constraints>(
        &mut self,
        active_set: ActiveSet,
        holonomic: bool,
        given: &[bool],
    ) -> Result<(), StateError> {
        self.rescale::<M>(active_set, holonomic)?;
        self.decompose_in_scales::<M>(active_set, holonomic, given);
        Ok(())
    }

    /// Scales of the rows: one per constraint, the largest norm of its rows, so that components of a vector
    /// count alike whatever their gradients at the guess are. If each row had its own scale, a closest
    /// approach could be a place where a vector is longer than elsewhere.
    fn rescale<M: Constraints>(&mut self, active_set: ActiveSet, holonomic: bool) -> Result<(), StateError> {
        let n = self.weights.len();
        let square = |row: usize| -> f64 {
            (0..n).map(|j| math::powi(self.jacobian[row * n + j] / self.weights[j], 2)).sum()
        };
        let mut k = 0;
        for constraint in active::<M>(active_set, holonomic) {
            let rows = constraint.first..constraint.first + constraint.rows;
            if let Some(row) = rows.clone().find(|row| !square(*row).is_finite()) {
                return Err(StateError::GradientNotFinite { row: M::ROWS[row].name });
            }
            let largest = rows.clone().map(square).fold(0.0, f64::max);
            let scale = if largest > 0.0 { math::sqrt(largest) } else { 1.0 };
            self.scales[k..k + rows.len()].fill(scale);
            k += rows.len();
        }
        Ok(())
    }

    /// [`AssemblyWorkspace::decompose`] in the present scales of the rows.
    pub(super) fn decompose_in_scales<M: Constraints>(
        &mut self,
        active_set: ActiveSet,
        holonomic: bool,
        given: &[bool],
    ) {
        let n = self.weights.len();
        let rows = || active_rows::<M>(active_set, holonomic).enumerate();
        let m = rows().count();
        for (column, j) in free_columns(given).enumerate() {
            for (k, row) in rows() {
                self.a[column * m + k] = self.jacobian[row * n + j] / (self.weights[j] * self.scales[k]);
            }
        }
        let f = free_columns(given).count();
        self.shape = (m, f);
        Svd::new(m, &mut self.a[..m * f], &mut self.v[..f * f], &mut self.sigma[..f]);
    }

    /// The last decomposition.
    pub(super) fn svd(&self) -> Svd<'_> {
        let (m, f) = self.shape;
        Svd { a: &self.a[..m * f], v: &self.v[..f * f], sigma: &self.sigma[..f], m }
    }

    /// steps\[to\] = A⁺ right, or the damped solution.
    pub(super) fn solve(&mut self, to: usize, cut: f64, mu: f64) {
        let (m, f) = self.shape;
        let svd = Svd { a: &self.a[..m * f], v: &self.v[..f * f], sigma: &self.sigma[..f], m };
        let cut = cut * svd.largest();
        svd.solve(&self.right[..m], cut, mu, &mut self.steps[to][..f]);
    }

    /// Writes −values/s of the active rows to the right-hand side and returns ‖values/s‖. An error names a
    /// row that is not finite.
    pub(super) fn load_residual<M: Constraints>(
        &mut self,
        active_set: ActiveSet,
        holonomic: bool,
        values: &[f64],
    ) -> Result<f64, StateError> {
        for (k, row) in active_rows::<M>(active_set, holonomic).enumerate() {
            self.right[k] = -values[row] / self.scales[k];
            if !self.right[k].is_finite() {
                return Err(StateError::ConstraintNotFinite { row: M::ROWS[row].name });
            }
        }
        let (m, _) = self.shape;
        Ok(norm(&self.right[..m]))
    }

    /// Copies a right singular vector, a direction in the free coordinates, to `spare\[0\]`.
    pub(super) fn copy_right_singular_vector(&mut self, column: usize) {
        let (_, f) = self.shape;
        self.spare[0][..f].copy_from_slice(&self.v[column * f..][..f]);
    }

    /// ‖steps\[k\]‖.
    pub(super) fn step_norm(&self, k: usize) -> f64 {
        norm(&self.steps[k][..self.shape.1])
    }
}

/// Replaces inertias Mᵢᵢ by weights √Mᵢᵢ. Coordinates without inertia get the smallest weight of
/// the others.
pub(crate) fn weigh(inertias: &mut [f64]) {
    let (mut least, mut largest) = (f64::INFINITY, 0.0);
    for m in inertias.iter_mut() {
        *m = if *m > 0.0 && m.is_finite() { math::sqrt(*m) } else { 0.0 };
        if *m > 0.0 {
            (least, largest) = (f64::min(least, *m), f64::max(largest, *m));
        }
    }
    let least = if largest > 0.0 { least.max(MIN_WEIGHT_RATIO * largest) } else { 1.0 };
    inertias.iter_mut().for_each(|weight| *weight = weight.max(least));
}

/// Indices of the free columns.
pub(super) fn free_columns(given: &[bool]) -> impl Iterator<Item = usize> + Clone {
    given.iter().enumerate().filter(|(_, given)| !**given).map(|(j, _)| j)
}

/// Moves the free elements of `values` by a step in scaled coordinates.
pub(super) fn shift(values: &mut [f64], given: &[bool], weights: &[f64], factor: f64, step: &[f64]) {
    let free_columns = values.iter_mut().zip(weights).zip(given).filter(|(_, given)| !**given);
    for (((value, weight), _), step) in free_columns.zip(step) {
        *value += factor * step / weight;
    }
}

/// A copy of the state with its coordinates moved.
pub(super) fn moved<S: ModelState>(
    state: &S,
    given: &[bool],
    weights: &[f64],
    factor: f64,
    step: &[f64],
) -> S {
    let mut out = *state;
    shift(out.q_mut().as_mut_slice(), given, weights, factor, step);
    out
}

#[cfg(test)]
mod tests {
    use super::weigh;

    #[test]
    fn what_has_no_inertia_weighs_as_little_as_the_least_of_the_others() {
        let weights = |mut inertias: [f64; 4]| {
            weigh(&mut inertias);
            inertias
        };
        assert_eq!(weights([4.0, 0.0, 1.0, f64::NAN]), [2.0, 1.0, 1.0, 1.0]);
        assert_eq!(weights([1e20, 1.0, -1.0, 1e18]), [1e10, 1e6, 1e6, 1e9]);
        assert_eq!(weights([0.0, f64::INFINITY, -1.0, f64::NAN]), [1.0; 4]);
    }
}

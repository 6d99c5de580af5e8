//! The variational equations along a motion, ẋ = A(t) x + b(t): A = ∂(q̇, q̈)/∂(q, q̇), and a column
//! of b for each variable, ∂(q̇, q̈)/∂p or 0 for elements of the start. `equations.rs` computes the
//! derivatives.

use alloc::vec::Vec;

use dynamics_runtime::model::{ModelState, Parameters, Vector};
use dynamics_runtime::simulate::{Motion, Sampler, Simulate};
use nalgebra::{DMatrix, DVector};

use super::super::equations::{coefficients, differences, not_solved};
use super::super::sensitivity_error::SensitivityError;
use super::collocation::AtNode;

/// First step of differences of a law of inputs, relative to a coordinate or velocity (at least 1). Rounding
/// is then near 1e-12, and laws may have curvature within a hundredth.
const LAW_STEP: f64 = 1e-4;

/// A and b along a motion.
pub(in super::super) struct VariationalEquations<'a, 'm, M: Simulate> {
    pub(in super::super) motion: &'a Motion<'m, M>,
    /// The parameter of each column of b; `None` for elements of the start.
    pub(in super::super) parameters: Vec<Option<usize>>,
    pub(in super::super) sampler: Sampler<'a, 'm, M>,
    /// Whether all derivatives so far were exact, none differences.
    pub(in super::super) exact: bool,
}

impl<'a, 'm, M: Simulate + Parameters + Clone> VariationalEquations<'a, 'm, M> {
    pub(in super::super) fn new(motion: &'a Motion<'m, M>, parameters: Vec<Option<usize>>) -> Self {
        Self { motion, parameters, sampler: motion.sampler(), exact: true }
    }

    /// At a time.
    pub(in super::super) fn at(&mut self, t: f64) -> Result<AtNode, SensitivityError> {
        let state = self.sampler.at(t);
        self.of(&state)
    }

    /// At a state of the motion.
    pub(in super::super) fn of(&mut self, state: &M::State) -> Result<AtNode, SensitivityError> {
        let (n, model) = (M::Vector::LEN, self.motion.model());
        let parameters: Vec<usize> = self.parameters.iter().flatten().copied().collect();
        let mut found = coefficients(model, self.motion.constants(), state, &parameters)?;
        self.exact &= found.exact;
        if self.motion.has_law() {
            self.add_law(state, &mut found.by_q, &mut found.by_u)?;
        }
        let mut a = DMatrix::zeros(2 * n, 2 * n);
        a.view_mut((0, n), (n, n)).fill_with_identity();
        a.view_mut((n, 0), (n, n)).copy_from(&found.by_q);
        a.view_mut((n, n), (n, n)).copy_from(&found.by_u);
        let mut b = DMatrix::zeros(2 * n, self.parameters.len());
        let of_parameters = self.parameters.iter().enumerate().filter(|(_, p)| p.is_some());
        for (k, (column, _)) in of_parameters.enumerate() {
            b.view_mut((n, column), (n, 1)).copy_from(&found.by_p.column(k));
        }
        Ok((a, b))
    }

    /// Adds the derivatives of a law of inputs, by differences of order 4.
    fn add_law(
        &mut self,
        state: &M::State,
        by_q: &mut DMatrix<f64>,
        by_u: &mut DMatrix<f64>,
    ) -> Result<(), SensitivityError> {
        let (n, motion) = (M::Vector::LEN, self.motion);
        let accelerations = |inputs: M::Inputs| {
            let mut other = *state;
            *other.inputs_mut() = inputs;
            let found = motion.model().accelerations_with(motion.constants(), &other);
            found.map_err(|error| not_solved::<M>(state, error))
        };
        let none = DVector::zeros(n);
        for j in 0..2 * n {
            let value = if j < n { state.q()[j] } else { state.u()[j - n] };
            let h = LAW_STEP * value.abs().max(1.0);
            let moved = |by: f64| {
                let mut moved = *state;
                if j < n {
                    moved.q_mut()[j] += by
                } else {
                    moved.u_mut()[j - n] += by
                }
                *motion.complete(moved).inputs()
            };
            if moved(h) == moved(-h) && moved(h) == *state.inputs() {
                continue;
            }
            self.exact = false;
            let by = differences(h, &none, |by| {
                Ok(DVector::from_column_slice(accelerations(moved(by))?.as_slice()))
            })?;
            let matrix = if j < n { &mut *by_q } else { &mut *by_u };
            (0..n).for_each(|i| matrix[(i, j % n)] += by[i]);
        }
        Ok(())
    }
}

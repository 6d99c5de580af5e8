//! Initial consistency: whether a start, or a state that an action left, fulfils the constraints.
//!
//! A start has to fulfil Φ = 0 and Φ̇ = 0 to what is typed ([`check_held`]); formulations that project
//! then move it onto the constraints to rounding level. A state that an action left is treated likewise;
//! where constraints may drift, it must not violate them more than before the action. Impacts are applied
//! before, in `events/action.rs`.

use crate::constrain;
use crate::constrain::active_set::active_rows;
use crate::constrain::assemble::{CONSISTENT, ViolationScale, check_active_constraints};
use crate::error::{SolveError, StateError};
use crate::linalg::max_abs;
use crate::model::{Constraints, ModelState, StaticTraits, Vector};
use crate::simulate::stabilization::{Distances, Stabilization};

impl<M: Constraints> Stabilization<M> {
    /// Checks a start, and projects it where the formulation projects.
    pub(crate) fn ensure_consistent_start(
        &mut self,
        model: &M,
        state: &mut M::State,
    ) -> Result<(), ConsistencyError> {
        if M::IS_UNCONSTRAINED {
            return Ok(());
        }
        self.check_and_project(model, state, ViolationScale::RowSize)?;
        Ok(constrain::check_sides(model, state)?)
    }

    /// Checks the constraints that hold, and projects where the formulation projects.
    fn check_and_project(
        &mut self,
        model: &M,
        state: &mut M::State,
        against: ViolationScale,
    ) -> Result<(), ConsistencyError> {
        check_active_constraints(model, state, against)?;
        if self.projects() {
            self.project(model, state)?;
        }
        Ok(())
    }

    /// Checks a state that an action made of the state `before`, and projects it where the formulation
    /// projects. Where constraints may drift, the action must not have increased their violation.
    pub(crate) fn ensure_consistent_after_action(
        &mut self,
        model: &M,
        before: &M::State,
        state: &mut M::State,
    ) -> Result<(), ConsistencyError> {
        // An inspection of the drift before the action does not predict the drift behind it.
        self.last_inspection = None;
        if self.projects() {
            self.check_and_project(model, state, ViolationScale::OnePlusLargest)
        } else {
            Ok(self.check_not_worse(model, before, state)?)
        }
    }

    /// Refuses a state that violates a row by more than a start may, and by more than twice its violation
    /// before the action, if the row held then.
    fn check_not_worse(&mut self, model: &M, before: &M::State, state: &M::State) -> Result<(), StateError> {
        let held = before.active_set();
        let distances = |stabilization: &mut Self, state: &M::State, row: usize| {
            let (velocity, of) =
                (model.velocity_residual(state), Distances::of(model, state, &mut stabilization.workspace));
            let position = if row < M::Residual::LEN { model.residual(state)[row] } else { 0.0 };
            [(position, of.distance(row, position)), (velocity[row], of.distance(row, velocity[row]))]
        };
        let sizes = [state.q(), state.u()].map(|values| CONSISTENT * (1.0 + max_abs(values.as_slice())));
        for row in active_rows::<M>(state.active_set(), false) {
            let held_before = active_rows::<M>(held, false).any(|known| known == row);
            let distances_before = if held_before {
                distances(self, before, row).map(|(_, distance)| distance)
            } else {
                [0.0; 2]
            };
            let [position, velocity] = distances(self, state, row);
            let is_permitted =
                |(_, distance): (f64, f64), at: usize| distance <= sizes[at].max(2.0 * distances_before[at]);
            let (row, switched) = constrain::assemble::row_names::<M>(row);
            if !is_permitted(position, 0) {
                let (residual, distance) = position;
                return Err(StateError::ConstraintViolated { row, residual, distance, switched });
            }
            if !is_permitted(velocity, 1) {
                let (residual, distance) = velocity;
                return Err(StateError::VelocityViolated { row, residual, distance, switched });
            }
        }
        Ok(())
    }
}

/// Why a state is not consistent with the constraints.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub(crate) enum ConsistencyError {
    #[error(transparent)]
    State(#[from] StateError),
    #[error(transparent)]
    Solve(#[from] SolveError),
}

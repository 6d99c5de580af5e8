//! Whether a start, or what an action makes of a state, has a place on the constraints.

use crate::constrain;
use crate::constrain::active_set::active_rows;
use crate::constrain::assemble::{CONSISTENT, ViolationScale, check_active_constraints};
use crate::error::{SolveError, StateError};
use crate::linalg::max_abs;
use crate::model::{Constraints, Known, ModelState, Vector};
use crate::simulate::stabilization::{Distances, Stabilization};

impl<M: Constraints> Stabilization<M> {
    /// Checks a start, and puts it onto the constraints where the formulation keeps it there.
    pub(crate) fn begin(&mut self, model: &M, state: &mut M::State) -> Result<(), PlaceError> {
        if M::IS_FREE {
            return Ok(());
        }
        self.put(model, state, ViolationScale::RowSize)?;
        Ok(constrain::check_sides(model, state)?)
    }

    /// The same for the constraints that hold alone.
    fn put(&mut self, model: &M, state: &mut M::State, against: ViolationScale) -> Result<(), PlaceError> {
        check_active_constraints(model, state, against)?;
        if self.projects() {
            self.project(model, state)?;
        }
        Ok(())
    }

    /// The same for a state that an action made of another one. Where constraints may drift they have, and it
    /// must not have made that worse.
    pub(crate) fn place(
        &mut self,
        model: &M,
        before: &M::State,
        state: &mut M::State,
    ) -> Result<(), PlaceError> {
        // What was seen before an action says nothing of what follows it.
        self.look = None;
        if self.projects() {
            self.put(model, state, ViolationScale::OnePlusLargest)
        } else {
            Ok(self.check_worse(model, before, state)?)
        }
    }

    /// Refuses a state that violates a row by more than a start may, and by more than twice what it was
    /// violated by before, where it held.
    fn check_worse(&mut self, model: &M, before: &M::State, state: &M::State) -> Result<(), StateError> {
        let held = before.modes();
        let distances = |stabilization: &mut Self, state: &M::State, row: usize| {
            let (velocity, of) =
                (model.velocity_residual(state), Distances::of(model, state, &mut stabilization.workspace));
            let position = if row < M::Residual::LEN { model.residual(state)[row] } else { 0.0 };
            [(position, of.along(row, position)), (velocity[row], of.along(row, velocity[row]))]
        };
        let sizes = [state.q(), state.u()].map(|values| CONSISTENT * (1.0 + max_abs(values.as_slice())));
        for row in active_rows::<M>(state.modes(), false) {
            let held_before = active_rows::<M>(held, false).any(|known| known == row);
            let past = if held_before {
                distances(self, before, row).map(|(_, distance)| distance)
            } else {
                [0.0; 2]
            };
            let [position, velocity] = distances(self, state, row);
            let kept = |(_, distance): (f64, f64), at: usize| distance <= sizes[at].max(2.0 * past[at]);
            let (row, switched) = constrain::assemble::row_names::<M>(row);
            if !kept(position, 0) {
                let (residual, distance) = position;
                return Err(StateError::ConstraintViolated { row, residual, distance, switched });
            }
            if !kept(velocity, 1) {
                let (residual, distance) = velocity;
                return Err(StateError::VelocityViolated { row, residual, distance, switched });
            }
        }
        Ok(())
    }
}

/// Why a state has no place on the constraints.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum PlaceError {
    State(StateError),
    Solve(SolveError),
}

impl From<StateError> for PlaceError {
    fn from(error: StateError) -> Self {
        Self::State(error)
    }
}

impl From<SolveError> for PlaceError {
    fn from(error: SolveError) -> Self {
        Self::Solve(error)
    }
}

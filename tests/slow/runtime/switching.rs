//! Constraints that switch: impacts, contacts that close and lift off, sticking and slipping, latches, each
//! against closed forms.

use crate::common;

mod contacts;
mod couplings;
mod friction;
mod planks;

use common::constrained::{Held, PainleveRod, constraint, held};
use common::*;
use dynamics_runtime::constrain;
use dynamics_runtime::error::{SingularMassMatrix, SolveError};
use dynamics_runtime::model::{
    Constraint, ConstraintKind, Constraints, Dynamics, Events, Model, ModelState, Outputs, Powers, Quantity,
    Solved, SolverKind, Terms,
};
use dynamics_runtime::simulate::{
    Contact, Direction, EventAction, EventActionError, Flow, Formulation, Motion, OptionError, Simulate,
    SimulationErrorKind,
};
use nalgebra::{SMatrix, SVector};

const fn switched(name: &'static str, kind: ConstraintKind, row: usize, index: usize) -> Constraint {
    Constraint { switched: Some(index), ..constraint(name, kind, row, 1) }
}

fn released<const N: usize>(
    mut state: PlainState<N, 0>,
    switches: impl IntoIterator<Item = usize>,
) -> PlainState<N, 0> {
    switches.into_iter().for_each(|index| state.active_set_mut().release(index, 1.0));
    state
}

//! States with displaced coordinates, their return to the constraints, and the sizes of displacements and
//! velocities.

use core::borrow::Borrow;

use dynamics_runtime::constrain::{Projection, project_positions, with_workspace};
use dynamics_runtime::error::SolveError;
use dynamics_runtime::model::{Constraints, ModelState, Vector};
use nalgebra::DVector;

/// The state whose coordinates are displaced by a step, with all else as it is.
pub(crate) fn displaced<S: ModelState>(state: &S, step: impl IntoIterator<Item: Borrow<f64>>) -> S {
    let mut nearby = *state;
    nearby.q_mut().as_mut_slice().iter_mut().zip(step).for_each(|(q, d)| *q += d.borrow());
    nearby
}

/// The state after a move `by` along a direction of q and q̇, one above the other.
pub(crate) fn moved_along<S: ModelState>(state: &S, along: &DVector<f64>, by: f64) -> S {
    let n = <S::Vector as Vector>::LEN;
    let mut moved = *state;
    (0..n).for_each(|i| moved.q_mut()[i] += by * along[i]);
    (0..n).for_each(|i| moved.u_mut()[i] += by * along[n + i]);
    moved
}

/// Projects the positions of a state onto the constraints.
pub(crate) fn project<M: Constraints>(
    model: &M,
    constants: &M::Constants,
    state: &mut M::State,
) -> Result<Projection, SolveError> {
    with_workspace::<M, _>(|workspace| project_positions(model, constants, state, workspace))
}

/// The state whose positions are projected onto the constraints.
pub(crate) fn projected<M: Constraints>(
    model: &M,
    constants: &M::Constants,
    mut state: M::State,
) -> Result<M::State, SolveError> {
    project(model, constants, &mut state).map(|_| state)
}

/// The largest element of a displacement, each relative to the scale of its coordinate.
pub(crate) fn size_in_scales(step: &DVector<f64>, scales: &[f64]) -> f64 {
    step.iter().zip(scales).fold(0.0, |most: f64, (d, scale)| most.max(d.abs() / scale))
}

/// The largest magnitude of a velocity.
pub(crate) fn fastest<S: ModelState>(state: &S) -> f64 {
    state.u().as_slice().iter().fold(0.0, |most: f64, u| most.max(u.abs()))
}

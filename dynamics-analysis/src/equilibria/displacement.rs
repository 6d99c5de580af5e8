//! States with displaced coordinates, their return to the constraints, and the sizes of displacements and
//! velocities.

use dynamics_runtime::constrain::{project_positions, with_workspace};
use dynamics_runtime::model::{Constraints, ModelState, Vector};
use nalgebra::DVector;

/// The state whose coordinates are displaced by a step, with all else as it is.
pub(super) fn displaced<S: ModelState>(state: &S, step: &DVector<f64>) -> S {
    let mut nearby = *state;
    nearby.q_mut().as_mut_slice().iter_mut().zip(step.iter()).for_each(|(q, d)| *q += d);
    nearby
}

/// The largest element of a displacement, each relative to the scale of its coordinate.
pub(super) fn size_in_scales(step: &DVector<f64>, scales: &[f64]) -> f64 {
    step.iter().zip(scales).fold(0.0, |most: f64, (d, scale)| most.max(d.abs() / scale))
}

/// The largest magnitude of a velocity.
pub(super) fn fastest<S: ModelState>(state: &S) -> f64 {
    state.u().as_slice().iter().fold(0.0, |most: f64, u| most.max(u.abs()))
}

/// The state whose positions are projected onto the constraints; `None` if that fails.
pub(super) fn projected<M: Constraints>(
    model: &M,
    constants: &M::Constants,
    mut state: M::State,
) -> Option<M::State> {
    let projection =
        with_workspace::<M, _>(|workspace| project_positions(model, constants, &mut state, workspace));
    projection.ok().map(|_| state)
}

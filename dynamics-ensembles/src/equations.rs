//! What identifies the equations of a model: a digest of their values at states around the start.
//!
//! A model has no text that all kinds of models share, and a text would not show what its functions compute.
//! Values do: another force, constraint, output or event gives other values.

use dynamics_analysis::shared::RandomNumbers;
use dynamics_runtime::model::{ModelState, SimulationModel, Vector};

use crate::inputs::digest;

/// States at which the equations are evaluated.
const STATES: usize = 8;
/// How far these lie from the start, in every coordinate, velocity and input.
const DISTANCE: f64 = 0.7;

/// A digest of the equations of a model.
pub(crate) fn of_model<M: SimulationModel>(model: &M, start: &M::State) -> String {
    let mut random = RandomNumbers(0);
    let mut around = |x: &mut f64| {
        let by = random.within([-DISTANCE, DISTANCE]);
        *x = if x.is_finite() { *x + by } else { by };
    };
    let mut numbers = Vec::new();
    for k in 0..STATES {
        let (mut q, mut u, mut inputs) = (*start.q(), *start.u(), *start.inputs());
        for vector in [q.as_mut_slice(), u.as_mut_slice(), inputs.as_mut_slice()] {
            vector.iter_mut().for_each(&mut around);
        }
        let mut state = M::State::new(start.t() + 0.1 * k as f64, q, u, inputs);
        *state.active_set_mut() = start.active_set();
        if let Ok(accelerations) = model.accelerations(&state) {
            numbers.extend_from_slice(accelerations.as_slice());
        }
        numbers.push(model.energy_function(&state));
        numbers.extend_from_slice(model.momenta(&state).as_slice());
        numbers.extend_from_slice(model.generalized_force(&state).as_slice());
        let mut values = vec![0.0; M::OUTPUTS.len()];
        if model.outputs(&state, &mut values).is_ok() {
            numbers.extend_from_slice(&values);
        }
        let mut values = vec![0.0; M::EVENTS.len()];
        if model.events(&state, &mut values).is_ok() {
            numbers.extend_from_slice(&values);
        }
    }
    // One kind of NaN.
    digest(numbers.into_iter().map(|x| if x.is_nan() { f64::NAN } else { x }))
}

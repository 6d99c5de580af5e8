//! Copies of a state: displaced by a small amount, and at another time.

use crate::model::{Constraints, ModelState, Vector};

/// Displacement of [`nearby_state`], in parts of 1 + |q|. A gradient that vanishes linearly is, at 10⁻⁶
/// from its zero, 10⁻³ of what it is at this distance.
pub(crate) const NEARBY_DISTANCE: f64 = 1e-3;

/// A state displaced a little, and a little later, where a drive has moved on. Every coordinate changes by a
/// different amount, so that no symmetry of the model hides the change.
pub(crate) fn nearby_state<M: Constraints>(state: &M::State) -> M::State {
    let n = M::COORDINATES.len();
    let mut nearby_state = at_time(state, state.t() + NEARBY_DISTANCE * (1.0 + state.t().abs()));
    for (i, q) in nearby_state.q_mut().as_mut_slice().iter_mut().enumerate() {
        *q += NEARBY_DISTANCE * (1.0 + q.abs()) * (1.0 + 0.37 * i as f64 / n as f64);
    }
    nearby_state
}

/// The state at another time.
// Public for dynamics-analysis alone.
#[doc(hidden)]
#[must_use]
pub fn at_time<S: ModelState>(state: &S, t: f64) -> S {
    let mut out = S::new(t, *state.q(), *state.u(), *state.inputs());
    *out.active_set_mut() = state.active_set();
    out
}

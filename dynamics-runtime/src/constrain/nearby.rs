//! States a little beside another one, and at another time.

use crate::model::{Constraints, ModelState, Vector};

/// How far away a state [`beside`] another is, against 1 + |q|: a gradient that vanishes linearly has 10⁻³ of
/// its value there at 10⁻⁶ from its zero.
pub(crate) const NEARBY: f64 = 1e-3;

/// A state a little off, and a little later, where a drive has moved on: every coordinate by a different
/// amount, so that no symmetry of the model hides the change.
pub(crate) fn beside<M: Constraints>(state: &M::State) -> M::State {
    let n = M::COORDINATES.len();
    let mut beside = at_time(state, state.t() + NEARBY * (1.0 + state.t().abs()));
    for (i, q) in beside.q_mut().as_mut_slice().iter_mut().enumerate() {
        *q += NEARBY * (1.0 + q.abs()) * (1.0 + 0.37 * i as f64 / n as f64);
    }
    beside
}

/// The state at another time.
// Public for dynamics-analysis alone.
#[doc(hidden)]
#[must_use]
pub fn at_time<S: ModelState>(state: &S, t: f64) -> S {
    let mut out = S::new(t, *state.q(), *state.u(), *state.inputs());
    *out.modes_mut() = state.modes();
    out
}

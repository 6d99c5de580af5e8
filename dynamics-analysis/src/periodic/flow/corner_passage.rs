//! Steps of a motion with tangent vectors that end where a branch of the model ends (`corners.rs`).

use alloc::boxed::Box;
use alloc::vec::Vec;

use dynamics_runtime::constrain::at_time;
use dynamics_runtime::error::SolveError;
use dynamics_runtime::model::{Constraints, ModelState, Vector};

use super::{Flow, unpack};
use crate::periodic::PeriodicError;
use crate::periodic::corners::{Crossed, HeldBranches, apply_saltation, kinks_at, slope};

/// Relative jump of accelerations up to which it is rounding, for branches, which can be held on both sides.
const ROUNDING_OF_JUMP: f64 = 1e-12;
/// The same for pieces of functions, which cannot be held: both sides are a little apart.
const ROUNDING_OF_PIECES: f64 = 1e-9;

/// The state just beyond the corner, with its tangent vectors.
pub(super) struct Passed<S> {
    pub(super) state: S,
    pub(super) y: Vec<f64>,
}

impl<M: Constraints> Flow<'_, M> {
    /// Whether a state lies where a force jumps, or within the time `within` of such a state. Rounding would
    /// then decide whether the jump is before or after it.
    pub(in crate::periodic) fn starts_on_corner(
        &mut self,
        state: &M::State,
        within: f64,
    ) -> Result<bool, SolveError> {
        let here = HeldBranches::at(self.model, state);
        let u = state.u();
        let held = here.hold(state);
        let a = self.accelerations(&held)?;
        for (index, kink) in kinks_at(self.model, state).iter().enumerate().take(M::KINKS) {
            if !kink.decides || kink.is_cut {
                continue;
            }
            let value = |by: f64| {
                let mut moved = at_time(&held, held.t() + by);
                let n = M::Vector::LEN;
                (0..n).for_each(|i| moved.q_mut()[i] += by * u[i] + 0.5 * by * by * a[i]);
                (0..n).for_each(|i| moved.u_mut()[i] += by * a[i]);
                kinks_at(self.model, &moved)[index].value
            };
            if kink.value.abs() > within * slope(within, value).abs() {
                continue;
            }
            let mut other = HeldBranches::at(self.model, state);
            other.flip(index, kink, kink.smooth);
            let beyond = self.accelerations(&other.hold(state))?;
            let size =
                a.as_slice().iter().chain(beyond.as_slice()).fold(0.0, |most: f64, a| most.max(a.abs()));
            if a.as_slice()
                .iter()
                .zip(beyond.as_slice())
                .any(|(a, b)| (a - b).abs() > ROUNDING_OF_JUMP * size)
            {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Ends the step where the first branch ends, and goes on to the next branch. Tangent vectors are
    /// multiplied by the saltation matrix if the acceleration jumps.
    pub(super) fn pass_corner(
        &mut self,
        corners: &mut HeldBranches,
        from: &M::State,
        (y, rate): (&[f64], &[f64]),
        mut crossed: Crossed,
        step: f64,
    ) -> Result<Passed<M::State>, PeriodicError> {
        let time = from.t();
        let (mut low, mut high) = (0.0, step);
        let (mut short, mut beyond) = (y.to_vec(), Vec::new());
        // Bisection on whether any branch has ended finds the first of several.
        while high - low > 4.0 * f64::EPSILON * time.abs().max(step) {
            let middle = 0.5 * (low + high);
            let (end, _) = self.attempt(from, corners, y, rate, middle)?;
            match corners.crossed(self.model, &unpack(from, time + middle, &end)) {
                Some(first) => (high, crossed, beyond) = (middle, first, end),
                None => (low, short) = (middle, end),
            }
        }
        if beyond.is_empty() {
            beyond = self.attempt(from, corners, y, rate, high)?.0;
        }
        let mut state = unpack(from, time + high, &beyond);
        let before = corners.hold(&state);
        let Crossed(index) = crossed;
        let kink = kinks_at(self.model, &before)[index];
        let ends =
            |error| PeriodicError::Ends { time: before.t(), reason: Box::new(PeriodicError::Solve(error)) };
        // Accelerations on both sides. Pieces of functions cannot be held, so for these the state before is
        // the last one on the piece.
        let last = if kink.decides { before } else { corners.hold(&unpack(from, time + low, &short)) };
        let old = self.accelerations(&last).map_err(ends)?;
        corners.flip(index, &kink, kinks_at(self.model, &state)[index].smooth);
        let after = corners.hold(&state);
        let new = self.accelerations(&after).map_err(ends)?;
        let (was, is) = (old.as_slice(), new.as_slice());
        let size = was.iter().chain(is).fold(0.0, |most: f64, a| most.max(a.abs()));
        let jump: Vec<f64> = was.iter().zip(is).map(|(a, b)| b - a).collect();
        let rounding = if kink.decides { ROUNDING_OF_JUMP } else { ROUNDING_OF_PIECES };
        if !kink.is_cut && jump.iter().any(|jump| jump.abs() > rounding * size) {
            apply_saltation(self.model, (&before, was, is), index, &jump, (&mut beyond, step))?;
        }
        state = unpack(&state, state.t(), &beyond);
        Ok(Passed { state, y: beyond })
    }
}

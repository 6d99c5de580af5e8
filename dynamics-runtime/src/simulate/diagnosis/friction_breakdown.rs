//! Friction as the cause of collapsing steps: rest on the jump of friction, or a reaction without bounds
//! (Painlevé's paradox).
//!
//! Friction by the sign of a velocity brings that velocity to zero, and there the accelerations of both sides
//! lead back. No step goes on from there (Filippov's sliding mode, which a switched constraint provides).
//! Near Painlevé's paradox the reaction of a contact with friction grows as the inverse of a vanishing
//! determinant (Génot & Brogliato, Eur. J. Mech. A/Solids 18 (1999) 653–677). An integrator sees both as
//! any other collapse. Accelerations a little ahead of the state distinguish them.

use alloc::boxed::Box;

use crate::constrain::{TopContributors, solve_once};
use crate::error::SolveError;
use crate::model::{Constraints, ModelState, Vector};
use crate::simulate::failure::SimulationErrorKind as Kind;

/// First and last time ahead that is tested, in parts of 1 + |t|.
const LOOK_AHEAD: (f64, f64) = (1e-12, 1e-2);
/// Jumps are searched up to this time: stiff, smooth accelerations change sign in longer times.
const JUMP_HORIZON: f64 = 1e-8;
/// Factors by which the way back across the jump may take longer than the way there. The rod of
/// `tests/slow/failures/outcomes/friction.rs` needs more than the first.
const RETURN_TIME_FACTORS: [f64; 5] = [1.0, 4.0, 16.0, 64.0, 256.0];
/// Accelerations return where they differ by at most this part of the jump from those before it.
const RETURNED_SHARE: f64 = 0.1;
/// Accelerations jump where they change by more than this part of 1 + |q̈|.
const JUMP_SHARE: f64 = 1e-3;

/// The cause of a collapsing step, if it is friction.
pub(crate) fn explain<M: Constraints>(model: &M, state: &M::State, kind: &Kind) -> Option<Kind> {
    let constants = model.constants().ok()?;
    let cause = || Box::new(kind.copy());
    let accelerations =
        |state: &M::State| solve_once(model, &constants, state).map(|solved| solved.accelerations);
    let here = accelerations(state).ok()?;
    let size = 1.0 + state.t().abs();
    let mut time = LOOK_AHEAD.0 * size;
    while time <= LOOK_AHEAD.1 * size {
        let there = ahead(state, &here, time);
        match accelerations(&there) {
            Err(SolveError::Friction { row, .. }) => {
                return Some(Kind::FrictionGrows { row, ahead: time, cause: cause() });
            }
            Ok(across) if time <= JUMP_HORIZON * size => {
                // The way back may be slower than the way there.
                let returned = |times: &f64| accelerations(&ahead(&there, &across, times * time)).ok();
                let coordinates = RETURN_TIME_FACTORS
                    .iter()
                    .filter_map(returned)
                    .find_map(|returned| alternating_coordinates::<M>(&here, &across, &returned));
                if let Some(coordinates) = coordinates {
                    return Some(Kind::RestsOnJump { coordinates, cause: cause() });
                }
            }
            _ => {}
        }
        time *= 2.0;
    }
    None
}

/// The state a little later.
fn ahead<S: ModelState>(state: &S, accelerations: &S::Vector, time: f64) -> S {
    let mut ahead = *state;
    for i in 0..S::Vector::LEN {
        ahead.q_mut()[i] += time * state.u()[i];
        ahead.u_mut()[i] += time * accelerations[i];
    }
    ahead
}

/// The coordinates whose accelerations jump between here and there, and jump back where they lead from there.
fn alternating_coordinates<M: Constraints>(
    here: &M::Vector,
    there: &M::Vector,
    returned: &M::Vector,
) -> Option<TopContributors> {
    let difference = |a: &M::Vector, b: &M::Vector, i: usize| (a[i] - b[i]).abs();
    let n = M::Vector::LEN;
    let largest_difference =
        |a: &M::Vector, b: &M::Vector| (0..n).map(|i| difference(a, b, i)).fold(0.0, f64::max);
    let size =
        1.0 + here.as_slice().iter().fold(0.0, |largest_difference: f64, a| largest_difference.max(a.abs()));
    let jump = largest_difference(here, there);
    let alternates = jump > JUMP_SHARE * size && largest_difference(here, returned) <= RETURNED_SHARE * jump;
    alternates
        .then(|| TopContributors::ranked(M::COORDINATES, (0..n).map(|i| (i, difference(here, there, i)))))
}

//! Gimbal lock as the cause of a failure: three angles whose first and last axes fall on one line.

use alloc::boxed::Box;

use crate::constrain::conditioning::condition_number;
use crate::model::{AngleSet, Constraints, ModelState, Vector};
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::simulate::failure::gimbal_lock::GimbalLock;

/// Angles farther from locking than this, in rad, are not reported.
pub(crate) const LARGEST_LOCK_ANGLE: f64 = 0.05;
/// A failure is attributed to angles that are nearer to locking than this, in rad.
const LOCKED_ANGLE: f64 = 1e-3;

/// Ratio by which the condition number of the mass matrix must exceed that at twice the distance. For a free
/// body the ratio is four. Rings and rotors with their own inertia have a regular mass matrix there, and a
/// matrix that is ill-conditioned for another reason stays so.
const CONDITION_RATIO: f64 = 2.0;

/// Gimbal lock of a set of angles at a state, if the mass matrix suffers from it.
pub(crate) fn find_lock<M: Constraints>(model: &M, state: &M::State, set: AngleSet) -> Option<GimbalLock> {
    let q = state.q().as_slice();
    let (distance, middle) = (set.distance(q), q[set.angles[1]]);
    if distance > LARGEST_LOCK_ANGLE || distance.is_nan() {
        return None;
    }
    let (lock, mut farther) = (set.locks_at(middle).value(), *state);
    farther.q_mut().as_mut_slice()[set.angles[1]] =
        lock + (2.0 * distance).max(LOCKED_ANGLE).copysign(middle - lock);
    let [conditioning, condition_farther] = [state, &farther].map(|state| condition_number(model, state));
    let names = set.angles.map(|i| M::COORDINATES[i].name);
    let found = GimbalLock {
        set,
        names,
        distance,
        middle,
        time: state.t(),
        conditioning,
        doubtful: false,
        passed_over: false,
    };
    (conditioning > CONDITION_RATIO * condition_farther).then_some(found)
}

/// A failure with gimbal lock as its cause, where angles lock.
pub(crate) fn explain<M: Constraints>(model: &M, state: &M::State, kind: Kind) -> Kind {
    if const { M::ANGLE_SETS.is_empty() } {
        return kind;
    }
    let locked = M::ANGLE_SETS
        .iter()
        .filter_map(|set| find_lock(model, state, *set))
        .filter(|at| at.distance < LOCKED_ANGLE);
    match locked.reduce(|a, b| if b.distance < a.distance { b } else { a }) {
        Some(find_lock) => Kind::GimbalLock { at: Box::new(find_lock), cause: Box::new(kind) },
        None => kind,
    }
}

//! Gimbal lock as what a failure comes from.

use alloc::boxed::Box;

use crate::constrain::conditioning::condition_number;
use crate::model::{AngleSet, Constraints, ModelState, Vector};
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::simulate::failure::gimbal_lock::GimbalLock;

/// Angles farther from locking than this are not told of.
pub(crate) const LARGEST_LOCK_ANGLE: f64 = 0.05;
/// Angles nearer to locking than this are what a failure beside comes from.
const LOCKED: f64 = 1e-3;

/// How much worse the mass matrix has to be than at twice the distance to be so for that reason. Of a free
/// body it is four times as bad; rings and rotors with inertia of their own have a regular mass matrix there,
/// and what is bad for another reason stays so.
const WORSE: f64 = 2.0;

/// A set at a state, where the mass matrix is the worse for it.
pub(crate) fn locking<M: Constraints>(model: &M, state: &M::State, set: AngleSet) -> Option<GimbalLock> {
    let q = state.q().as_slice();
    let (distance, middle) = (set.distance(q), q[set.angles[1]]);
    if distance > LARGEST_LOCK_ANGLE || distance.is_nan() {
        return None;
    }
    let (lock, mut away) = (set.locks_at(middle).value(), *state);
    away.q_mut().as_mut_slice()[set.angles[1]] = lock + (2.0 * distance).max(LOCKED).copysign(middle - lock);
    let [conditioning, elsewhere] = [state, &away].map(|state| condition_number(model, state));
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
    (conditioning > WORSE * elsewhere).then_some(found)
}

/// A failure where angles lock, with their names.
pub(crate) fn explain<M: Constraints>(model: &M, state: &M::State, kind: Kind) -> Kind {
    if const { M::ANGLE_SETS.is_empty() } {
        return kind;
    }
    let locked =
        M::ANGLE_SETS.iter().filter_map(|set| locking(model, state, *set)).filter(|at| at.distance < LOCKED);
    match locked.reduce(|a, b| if b.distance < a.distance { b } else { a }) {
        Some(locking) => Kind::GimbalLock { at: Box::new(locking), cause: Box::new(kind) },
        None => kind,
    }
}

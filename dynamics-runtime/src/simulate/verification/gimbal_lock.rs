//! Gimbal lock along a motion: the nearest approach of three angles to locking, and whether the mass matrix
//! suffers.
//!
//! Steps may be longer than the approach that they pass. So the middle angle is followed within steps, by the
//! cubic through their ends or by the dense output of the method.

use crate::golden_section::golden_section_maximum;
use crate::integrate::Tolerances;
use crate::model::{AngleSet, ModelState, SimulationModel, Vector};
use crate::simulate::diagnosis::gimbal_lock::{LARGEST_LOCK_ANGLE, find_lock};
use crate::simulate::failure::gimbal_lock::GimbalLock;
use crate::simulate::trajectory::motion::Motion;

/// Relative rounding of the accelerations that is acceptable where no tolerance was given.
const PERMITTED_ROUNDING: f64 = 1e-6;
/// Parts of a step at whose ends the cubic is evaluated.
const PARTS_PER_STEP: usize = 16;
/// Fixed steps are too long where 2 × the change of the middle angle in a step exceeds its distance from
/// locking: the other angles turn too fast there.
const COARSE_STEP_RATIO: f64 = 2.0;

impl<M: SimulationModel> Motion<'_, M> {
    /// The nearest approach of any set of angles to gimbal lock, where the mass matrix suffers from it.
    /// `refined`: by the method's own states within steps, not only by the cubics of their ends.
    pub(crate) fn gimbal_lock(&self, refined: bool) -> Option<GimbalLock> {
        if const { M::ANGLE_SETS.is_empty() } {
            return None;
        }
        let nearest = M::ANGLE_SETS.iter().filter_map(|set| self.nearest_lock(*set, refined));
        nearest.reduce(|a, b| if b.distance < a.distance { b } else { a })
    }

    fn nearest_lock(&self, set: AngleSet, refined: bool) -> Option<GimbalLock> {
        let distance = |state: &M::State| set.distance(state.q().as_slice());
        let (mut times, mut best) = ([self.start_time(); 3], None::<(f64, f64)>);
        let mut around = [f64::INFINITY; 3];
        let mut sampler = (refined && self.is_repeatable()).then(|| self.sampler());
        let end = self.end_time();
        let mut consider = |times: [f64; 3], around: [f64; 3]| {
            if around[1] > LARGEST_LOCK_ANGLE || around[0] < around[1] || around[2] < around[1] {
                return;
            }
            let found = match &mut sampler {
                Some(sampler) if times[0] != times[2] => {
                    let (time, least) =
                        golden_section_maximum(times[0], times[2], &mut |t| -distance(&sampler.at(t)));
                    if -least < around[1] || around[1] == 0.0 {
                        (time, -least)
                    } else {
                        (times[1], around[1])
                    }
                }
                _ => (times[1], around[1]),
            };
            if best.is_none_or(|best| found.1 < best.1) {
                best = Some(found);
            }
        };
        let middle = |state: &M::State| {
            let i = set.angles[1];
            [state.t(), state.q().as_slice()[i], state.u().as_slice()[i]]
        };
        let mut before: Option<MiddleAngle> = None;
        for state in self.steps() {
            // Steps may be longer than what they pass.
            for (t, distance) in
                before.into_iter().flat_map(|before| distances_within(set, before, middle(&state)))
            {
                (times, around) = ([times[1], times[2], t], [around[1], around[2], distance]);
                consider(times, around);
            }
            (times, around) = ([times[1], times[2], state.t()], [around[1], around[2], distance(&state)]);
            consider(times, around);
            before = Some(middle(&state));
        }
        consider([times[1], times[2], end], [around[1], around[2], f64::INFINITY]);
        let (time, _) = best?;
        let found = find_lock(self.model(), &self.sampler().at(time), set)?;
        let Tolerances { absolute, relative } = self.trajectory.tolerances;
        let permitted = if self.trajectory.fixed { PERMITTED_ROUNDING } else { absolute.max(relative) };
        let largest_change = if self.trajectory.fixed { self.largest_change(set, time) } else { 0.0 };
        let passed_over = COARSE_STEP_RATIO * largest_change > found.distance;
        Some(GimbalLock {
            doubtful: passed_over || f64::EPSILON * found.conditioning > permitted,
            passed_over,
            ..found
        })
    }

    /// By how much the middle angle of a set changes in the longest of the steps around a time.
    fn largest_change(&self, set: AngleSet, time: f64) -> f64 {
        let middle = |state: &M::State| state.q().as_slice()[set.angles[1]];
        let steps = || self.steps().zip(self.steps().skip(1));
        // The step that contains the time, and those that end or begin there.
        let near = steps().filter(|(a, b)| (a.t() - time) * (b.t() - time) <= 0.0);
        near.fold(0.0, |most, (a, b)| f64::max(most, (middle(&b) - middle(&a)).abs()))
    }
}

/// A time, with the middle angle of a set and its rate.
type MiddleAngle = [f64; 3];

/// Times and distances from locking inside of a step, by the cubic of its ends; 0 where the angle passes a
/// value at which the set locks.
fn distances_within(
    set: AngleSet,
    [t, a, va]: MiddleAngle,
    [to, b, vb]: MiddleAngle,
) -> impl Iterator<Item = (f64, f64)> {
    let h = to - t;
    let (va, vb) = (h * va, h * vb);
    let cubic =
        move |s: f64| a + s * (va + s * (3.0 * (b - a) - 2.0 * va - vb + s * (2.0 * (a - b) + va + vb)));
    let distance = move |k: usize| f64::from(k as u32) / f64::from(PARTS_PER_STEP as u32);
    (1..=PARTS_PER_STEP).filter_map(move |k| {
        let [last, angle] = [k - 1, k].map(|k| cubic(distance(k)));
        let [before, lock] = [last, angle].map(|angle| set.locks_at(angle));
        // On two sides of one value; in the middle between two the nearest is another.
        let passes = before == lock && (last - lock.value()) * (angle - lock.value()) < 0.0;
        match (passes, k == PARTS_PER_STEP) {
            (true, _) => Some((t + h * (distance(k) - 0.5 * distance(1)), 0.0)),
            (false, true) => None,
            (false, false) => Some((t + h * distance(k), (angle - lock.value()).abs())),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A set of Euler's locks at 0 and π: passing π/2 is as far from both as can be.
    #[test]
    fn only_passing_a_value_is_no_distance() {
        let set = AngleSet { angles: [0, 1, 2], axes: [3, 1, 3] };
        let least = |from: MiddleAngle, to: MiddleAngle| {
            distances_within(set, from, to).map(|(_, far)| far).fold(f64::INFINITY, f64::min)
        };
        assert!(least([0.0, 1.2, 0.8], [1.0, 2.0, 0.8]) > 1.1);
        assert_eq!(least([0.0, -0.4, 0.8], [1.0, 0.4, 0.8]), 0.0);
        assert_eq!(least([0.0, 2.7, 0.9], [1.0, 3.6, 0.9]), 0.0);
        // Between ends that are both on one side of it, there and back.
        assert_eq!(least([0.0, 0.1, -2.0], [1.0, 0.1, 2.0]), 0.0);
    }
}

//! Detects motions whose velocities or accelerations jump, because their sensitivities jump too.
//!
//! Events with resets, constraints that engage or let go, and branches of the model are recorded by the
//! motion, whose steps end at them. Fixed steps do not end at them, so they are searched for branches that
//! change within. A law of inputs is not recorded. It is sampled between the ends and the middle of every
//! step, at one fixed time, so that jumps at given times do not count, because they do not move. A difference
//! that does not shrink with the distance is a jump.

use alloc::string::ToString;

use dynamics_runtime::model::{Kink, MAX_KINKS, ModelState, Vector};
use dynamics_runtime::simulate::{Motion, Simulate};

use super::super::sensitivity_error::SensitivityError;
use crate::LinearizeError;

/// Difference of an input over half a step, relative to its values, above which it is examined for a jump. A
/// smaller value costs time, a larger one misses small jumps.
const EXAMINED_INPUT_CHANGE: f64 = 1e-3;
/// Halvings of an interval with a difference.
const MAX_HALVINGS: usize = 30;
/// Part of the difference that a jump leaves after all halvings; a slope leaves 2⁻³⁰ = 1e-9 of it.
const PERSISTENT_SHARE: f64 = 0.3;
/// Parts of a fixed step at whose ends branches are compared. A branch that begins and ends within a part is
/// missed.
const PARTS_OF_FIXED_STEP: usize = 8;
/// Distances from a branch change, in parts of the step, at which accelerations are compared: a far one and a
/// near one.
const FAR_DISTANCE: f64 = 1e-4;
/// The near distance.
const NEAR_DISTANCE: f64 = 1e-6;
/// Relative difference of accelerations up to which it is rounding. Smaller jumps change sensitivities by as
/// little.
const ROUNDING_OF_ACCELERATIONS: f64 = 1e-9;

/// Returns an error if velocities, accelerations or inputs jump along a motion.
pub(in super::super) fn refuse_jumps<M: Simulate>(
    motion: &Motion<'_, M>,
    knots: &[M::State],
) -> Result<(), SensitivityError> {
    if !M::KINKS_ARE_ALL {
        return Err(LinearizeError::BranchesNotFollowed.into());
    }
    refuse_resets(motion)?;
    for (k, pair) in knots.windows(2).enumerate() {
        let (from, to) = (pair[0].t(), pair[1].t());
        if pair[0].active_set() != pair[1].active_set() {
            return Err(SensitivityError::Jump { time: to, what: "constraints engage or let go".into() });
        }
        if k > 0 && M::KINKS > 0 {
            refuse_jump(motion, from, (from - knots[k - 1].t()).abs().min((to - from).abs()))?;
        }
        if motion.is_fixed() && M::KINKS > 0 {
            refuse_within(motion, from, to)?;
        }
        if motion.has_law() {
            refuse_law(motion, from, to)?;
        }
    }
    Ok(())
}

/// Refuses motions with resets or impacts, at which velocities or inputs jump.
fn refuse_resets<M: Simulate>(motion: &Motion<'_, M>) -> Result<(), SensitivityError> {
    let jumps = |event: &&dynamics_runtime::simulate::EventRecord<M::State>| {
        event.before != event.after || !event.impacts.is_empty()
    };
    match motion.events().iter().find(jumps) {
        Some(event) => Err(SensitivityError::Jump { time: event.time(), what: event.name.to_string() }),
        None => Ok(()),
    }
}

/// Refuses a branch change at which accelerations jump: their difference over it does not shrink with the
/// distance.
fn refuse_jump<M: Simulate>(motion: &Motion<'_, M>, t: f64, h: f64) -> Result<(), SensitivityError> {
    let across = |distance: f64| {
        let [before, after] = [t - distance, t + distance].map(|t| motion.accelerations_at(t));
        let size = |v: &M::Vector| v.as_slice().iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let between = before.as_slice().iter().zip(after.as_slice()).map(|(a, b)| (a - b).abs());
        (between.fold(0.0, f64::max), size(&before).max(size(&after)))
    };
    let ((far, size), (near, _)) = (across(FAR_DISTANCE * h), across(NEAR_DISTANCE * h));
    if near > ROUNDING_OF_ACCELERATIONS * size && near > PERSISTENT_SHARE * far {
        return Err(SensitivityError::Jump { time: t, what: "an acceleration".into() });
    }
    Ok(())
}

/// Refuses jumps of accelerations within a step of fixed size. Branch changes between its parts are located
/// by bisection.
fn refuse_within<M: Simulate>(motion: &Motion<'_, M>, from: f64, to: f64) -> Result<(), SensitivityError> {
    let mut sampler = motion.sampler();
    let mut kinks = |t: f64| {
        let mut kinks = [Kink::NONE; MAX_KINKS];
        motion.model().kinks(&sampler.at(t), &mut kinks);
        kinks
    };
    let at = |k: usize| {
        if k == PARTS_OF_FIXED_STEP { to } else { from + (to - from) * k as f64 / PARTS_OF_FIXED_STEP as f64 }
    };
    let mut before = kinks(from);
    for part in 0..PARTS_OF_FIXED_STEP {
        let after = kinks(at(part + 1));
        for i in (0..M::KINKS).filter(|i| changes(&before[*i], &after[*i])) {
            let (mut ends, mut first) = ([at(part), at(part + 1)], before[i]);
            for _ in 0..MAX_HALVINGS {
                let half = 0.5 * (ends[0] + ends[1]);
                let kink = kinks(half)[i];
                if changes(&first, &kink) {
                    ends[1] = half;
                } else {
                    (ends[0], first) = (half, kink);
                }
            }
            refuse_jump(motion, 0.5 * (ends[0] + ends[1]), (to - from).abs())?;
        }
        before = after;
    }
    Ok(())
}

/// Whether two values of a switching function belong to different branches or pieces.
fn changes(before: &Kink, after: &Kink) -> bool {
    before.smooth != after.smooth
}

/// Refuses laws of inputs that jump with the state between two times.
fn refuse_law<M: Simulate>(motion: &Motion<'_, M>, from: f64, to: f64) -> Result<(), SensitivityError> {
    let mut sampler = motion.sampler();
    let at_time = 0.5 * (from + to);
    let mut inputs = |t: f64| {
        let state = sampler.at(t);
        *motion.complete(dynamics_runtime::constrain::at_time(&state, at_time)).inputs()
    };
    let middle = inputs(at_time);
    for mut ends in [[(from, inputs(from)), (at_time, middle)], [(at_time, middle), (to, inputs(to))]] {
        let differ = |[(_, one), (_, other)]: &[(f64, M::Inputs); 2], i: usize| {
            let (one, other) = (one.as_slice()[i], other.as_slice()[i]);
            ((one - other).abs(), one.abs().max(other.abs()))
        };
        for i in 0..M::Inputs::LEN {
            let (first, size) = differ(&ends, i);
            if first <= EXAMINED_INPUT_CHANGE * size {
                continue;
            }
            for _ in 0..MAX_HALVINGS {
                let half = 0.5 * (ends[0].0 + ends[1].0);
                let half = (half, inputs(half));
                let sides = [[ends[0], half], [half, ends[1]]];
                ends = if differ(&sides[0], i).0 >= differ(&sides[1], i).0 { sides[0] } else { sides[1] };
            }
            if differ(&ends, i).0 > PERSISTENT_SHARE * first {
                return Err(SensitivityError::Jump { time: ends[0].0, what: M::INPUTS[i].name.to_string() });
            }
        }
    }
    Ok(())
}

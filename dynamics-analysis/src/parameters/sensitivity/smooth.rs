//! Detects motions whose velocities or accelerations jump, because their sensitivities jump too.
//!
//! Events with resets, constraints that engage or let go, and branches of the model are recorded by the
//! motion, whose steps end at them. Fixed steps do not end at them, so they are searched for branches that
//! change within. A law of inputs is not recorded. It is sampled between the ends and the middle of every
//! step, at one fixed time, so that jumps at given times do not count, because they do not move. A difference
//! that does not shrink with the distance is a jump.

use alloc::string::ToString;

use dynamics_runtime::model::{Kink, MOST_KINKS, ModelState, Vector};
use dynamics_runtime::simulate::{Motion, Simulate};

use super::super::sensitivity_error::SensitivityError;
use crate::LinearizeError;

/// A difference of inputs, in parts of the largest of its input on both sides, that is looked at more
/// closely.
const STEEP: f64 = 1e-3;
/// How often a distance is halved, and what has to be left of a difference for it to be a jump: a slope
/// leaves 1e-9.
const HALVED: (usize, f64) = (30, 0.3);
/// How often a step of a fixed size is looked at.
const LOOKS: usize = 8;

/// That a motion has nothing of it.
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
        if pair[0].modes() != pair[1].modes() {
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

/// A motion with resets has velocities that jump, or inputs.
fn refuse_resets<M: Simulate>(motion: &Motion<'_, M>) -> Result<(), SensitivityError> {
    let jumps = |event: &&dynamics_runtime::simulate::EventRecord<M::State>| {
        event.before != event.after || !event.impacts.is_empty()
    };
    match motion.events().iter().find(jumps) {
        Some(event) => Err(SensitivityError::Jump { time: event.time(), what: event.name.to_string() }),
        None => Ok(()),
    }
}

/// Whether accelerations jump where a branch changes: what lies between both sides then does not shrink with
/// their distance.
fn refuse_jump<M: Simulate>(motion: &Motion<'_, M>, t: f64, h: f64) -> Result<(), SensitivityError> {
    let across = |distance: f64| {
        let [before, after] = [t - distance, t + distance].map(|t| motion.accelerations_at(t));
        let size = |v: &M::Vector| v.as_slice().iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let between = before.as_slice().iter().zip(after.as_slice()).map(|(a, b)| (a - b).abs());
        (between.fold(0.0, f64::max), size(&before).max(size(&after)))
    };
    let ((far, size), (near, _)) = (across(1e-4 * h), across(1e-6 * h));
    if near > 1e-9 * size && near > 0.3 * far {
        return Err(SensitivityError::Jump { time: t, what: "an acceleration".into() });
    }
    Ok(())
}

/// Whether accelerations jump within a step, where any branch changes between two looks at it.
fn refuse_within<M: Simulate>(motion: &Motion<'_, M>, from: f64, to: f64) -> Result<(), SensitivityError> {
    let mut sampler = motion.sampler();
    let mut kinks = |t: f64| {
        let mut kinks = [Kink::NONE; MOST_KINKS];
        motion.model().kinks(&sampler.at(t), &mut kinks);
        kinks
    };
    let at = |k: usize| if k == LOOKS { to } else { from + (to - from) * k as f64 / LOOKS as f64 };
    let mut before = kinks(from);
    for look in 0..LOOKS {
        let after = kinks(at(look + 1));
        for i in (0..M::KINKS).filter(|i| changes(&before[*i], &after[*i])) {
            let (mut ends, mut first) = ([at(look), at(look + 1)], before[i]);
            for _ in 0..HALVED.0 {
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

/// Whether it is another branch, or piece. A value on the very edge belongs to one of them.
fn changes(before: &Kink, after: &Kink) -> bool {
    before.smooth != after.smooth
}

/// Whether a law of inputs jumps with the state between two times.
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
            if first <= STEEP * size {
                continue;
            }
            for _ in 0..HALVED.0 {
                let half = 0.5 * (ends[0].0 + ends[1].0);
                let half = (half, inputs(half));
                let sides = [[ends[0], half], [half, ends[1]]];
                ends = if differ(&sides[0], i).0 >= differ(&sides[1], i).0 { sides[0] } else { sides[1] };
            }
            if differ(&ends, i).0 > HALVED.1 * first {
                return Err(SensitivityError::Jump { time: ends[0].0, what: M::INPUTS[i].name.to_string() });
            }
        }
    }
    Ok(())
}

//! How far motions are from the true ones: their steps made again in halves.
//!
//! A step in two halves has a fraction of its error, in the same direction: 2⁻ᵖ at order p. A second motion
//! in halves is followed from the start, and carries on what it differs by. So that difference is the error,
//! but for that fraction, with all that the motion makes of it: errors of one sign that add up, chaos, shifts
//! along a limit cycle that only add up, expanding phases that contracting ones take back (Richardson's
//! extrapolation, global: Hairer, Nørsett & Wanner, Solving ODE I, §II.4). About as much is found where
//! rounding decides. Where forces choose between expressions the second motion keeps the branches of the
//! first, at the times at which this had them. It costs two to three times what the run did.
//!
//! Over 759 motions (double pendulums, orbits, tops, oscillators of van der Pol and Duffing, dampers of one
//! side, stiff springs, four-bars; ten methods, tolerances from 1e-4 to 1e-13) what is told is 0.87 to 1.3
//! times the error for nine of ten, and beyond a factor of 30 of it once, beside an unstable rest at 1e-13.

use alloc::boxed::Box;
use alloc::vec::Vec;
use core::ops::Range;

use crate::integrate::{Accelerations as _, Phase, Step, StepFlags, StepNode, Switching as _, zip};
use crate::model::{ModelState, SimulationModel, Vector};
use crate::simulate::erased_method::StepReplay;
use crate::simulate::trajectory::motion::Motion;

/// What a motion goes through in a smaller part of its time may be off by a small shift of that time: jumps
/// of relaxation oscillations, with what leads up to them. Van der Pol's equation (ε = 1e-6) by Radau IIA at
/// 1e-5 is off by 514 permitted errors for half a thousandth of its time, by 84 for two and by 13 for ten; by
/// ESDIRK4(3) by 2370, 407 and 63. What lasts no longer is not told: `.estimate_error()` measures it.
const LASTING: f64 = 1e-2;
/// Halves that cannot be made, or not with a permitted error, are halved again, where the second motion is
/// still in what the first has gone through; so many steps of it at most for each of the first.
const MOST_STEPS: usize = 8;

/// A motion beside one in half steps, in permitted errors.
#[derive(Clone, Copy)]
pub(crate) struct StepDoubling {
    /// The largest difference that lasts, or that at the end.
    pub(crate) lasting: f64,
    /// The largest of all.
    pub(crate) largest: f64,
    /// When steps of the second motion became too many, if they did: from there on it changes as the first
    /// does.
    pub(crate) given_up: Option<f64>,
}

impl<M: SimulationModel> Motion<'_, M> {
    /// How far it is from a motion in half steps.
    pub(crate) fn apart_from_halves(&self) -> StepDoubling {
        let records = &self.trajectory.records;
        let (mut y, mut apart) = (records[0].knot().y, Vec::with_capacity(records.len()));
        self.leave_constraints(&mut y);
        let direction = self.trajectory.direction();
        let relayed =
            |(from, _): &(f64, _)| records.partition_point(|r| (r.state.t() - from) * direction < 0.0);
        let change = self.trajectory.relay.as_ref().map_or(records.len(), relayed);
        let mut given_up = None;
        for part in [0..change, change..records.len()] {
            if let Some(erased_method) =
                (!part.is_empty()).then(|| self.trajectory.erased_method_of(part.start)).flatten()
            {
                let ended = self.halve(erased_method.step_replay(), part, &mut y, &mut apart);
                given_up = given_up.or(ended);
            }
        }
        let largest = apart.iter().fold(0.0f64, |most, (_, apart)| most.max(*apart));
        StepDoubling { lasting: lasting(&mut apart), largest, given_up }
    }

    /// Changes velocities by a rounding error of their own: what rests where nothing can rest, or stays in a
    /// plane that rounding alone would have it leave, has the same halves otherwise.
    fn leave_constraints(&self, y: &mut Phase<M::Vector>) {
        let tolerances = &self.trajectory.tolerances;
        let unit = f64::EPSILON / tolerances.absolute.max(tolerances.relative);
        for (i, u) in y.u.as_mut_slice().iter_mut().enumerate() {
            // No sum or difference of two vanishes.
            *u += unit * tolerances.scale(*u, *u) * (1.0 + 0.1 * i as f64);
        }
    }

    /// Follows the steps that leave some records in halves, beginning and ending at `y`, and notes the length
    /// of each and the difference at its end, in permitted errors. When that took too many steps is returned.
    fn halve(
        &self,
        step_replay: Box<dyn StepReplay<M>>,
        part: Range<usize>,
        y: &mut Phase<M::Vector>,
        apart: &mut Vec<(f64, f64)>,
    ) -> Option<f64> {
        let records = &self.trajectory.records;
        let left = MOST_STEPS * part.len() + 1000;
        let (mut a, mut second) = (None, HalvedRun { step_replay, room: Vec::new(), left, given_up: None });
        for index in part.filter(|index| index + 1 < records.len()) {
            let [here, there] = [0, 1].map(|i| records[index + i].knot());
            if records[index].kept.branches {
                // Those of the step before are not its own.
                a = None;
            }
            let end = match records[index].h {
                0.0 => None,
                _ => self.follow(&mut second, index, (here.t, *y, a), there.t),
            };
            a = end.map(|end| end.a);
            *y = end.map_or_else(
                || {
                    // A reset changes both alike, and so does what cannot be made in halves.
                    second.step_replay.forget();
                    zip(y, &zip(&there.y, &here.y, |after, before| after - before), |y, change| y + change)
                },
                |end| end.y,
            );
            if records[index].h != 0.0 {
                apart.push((records[index].h.abs(), self.most_permitted_errors(y, &there.y)));
            }
        }
        second.given_up
    }

    /// Where two halves of the way to `end_t` end, by what moves the motion after a record; what cannot be
    /// made as one step is made as several.
    fn follow(
        &self,
        second: &mut HalvedRun<M>,
        index: usize,
        (t, y, a): (f64, Phase<M::Vector>, Option<M::Vector>),
        end_t: f64,
    ) -> Option<StepNode<M::Vector>> {
        let middle = t + 0.5 * (end_t - t);
        if second.left < 2 {
            second.given_up = second.given_up.or(Some(t));
            return None;
        }
        if middle == t || middle == end_t {
            return None;
        }
        let mut half = |(t, y, a), end_t| {
            second.left = second.left.saturating_sub(1);
            self.one(second, index, (t, y, a), end_t).or_else(|| {
                second.step_replay.forget();
                self.follow(second, index, (t, y, a), end_t)
            })
        };
        let StepNode { t, y, a } = half((t, y, a), middle)?;
        half((t, y, Some(a)), end_t)
    }

    /// The end of one step, from accelerations `a`, where they are known.
    fn one(
        &self,
        second: &mut HalvedRun<M>,
        index: usize,
        (t, y, a): (f64, Phase<M::Vector>, Option<M::Vector>),
        end_t: f64,
    ) -> Option<StepNode<M::Vector>> {
        let HalvedRun { step_replay, room, .. } = second;
        let mut rhs = self.rhs_in(index, core::mem::take(room));
        let record = &self.trajectory.records[index];
        let kept = StepFlags { stages: record.kept.stages, ..StepFlags::default() };
        let mut make = || {
            if record.kept.branches {
                rhs.hold_branches(&mut record.knot(), record.h, true).ok()?;
            }
            let a = match a {
                Some(a) => a,
                None => rhs.accelerations(t, &y.q, &y.u).ok()?,
            };
            let start = StepNode { t, y, a };
            let mut step = Step { start, end: start, h: end_t - t, kept };
            let (y, error) = step_replay.end_on_branches(&mut rhs, &step, &self.trajectory.tolerances)?;
            if error > 1.0 {
                return None;
            }
            step.end = StepNode { t: end_t, y, a: rhs.accelerations(end_t, &y.q, &y.u).ok()? };
            step_replay.accepted(&step);
            Some(step.end)
        };
        let end = make();
        *room = rhs.stabilization.into_workspace();
        end
    }

    /// The largest difference of an element, in what is permitted of it.
    pub(crate) fn most_permitted_errors(&self, x: &Phase<M::Vector>, y: &Phase<M::Vector>) -> f64 {
        let tolerances = &self.trajectory.tolerances;
        let parts = [(&x.q, &y.q), (&x.u, &y.u)];
        let pairs = parts.into_iter().flat_map(|(x, y)| x.as_slice().iter().zip(y.as_slice()));
        pairs.fold(0.0, |most, (x, y)| most.max((x - y).abs() / tolerances.scale(*x, *y)))
    }
}

/// What makes the second motion, and how many more steps of it are worth while.
struct HalvedRun<M: SimulationModel> {
    step_replay: Box<dyn StepReplay<M>>,
    /// What the constraints are kept in.
    room: Vec<f64>,
    left: usize,
    given_up: Option<f64>,
}

/// Of differences at the ends of steps of some length: the last one, or what the others exceed for a part of
/// the time that lasts.
fn lasting(apart: &mut [(f64, f64)]) -> f64 {
    let last = apart.last().map_or(0.0, |(_, apart)| *apart);
    // What is at both ends of a step lasts as long as it.
    let mut before = 0.0;
    for (_, apart) in &mut *apart {
        (*apart, before) = (apart.min(before), *apart);
    }
    let mut left = LASTING * apart.iter().map(|(h, _)| h).sum::<f64>();
    apart.sort_by(|(_, a), (_, b)| b.total_cmp(a));
    let lasts = apart.iter().find(|(h, _)| {
        left -= h;
        left <= 0.0
    });
    lasts.map_or(last, |(_, apart)| apart.max(last))
}

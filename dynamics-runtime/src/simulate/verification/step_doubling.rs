//! Step doubling: an estimate of the global error by a second motion with halved steps.
//!
//! A step in two halves has the fraction 2⁻ᵖ of its error at order p, in the same direction. A second
//! motion in halves is followed from the start, and keeps its difference from the first. So that difference
//! is the error but for this fraction, with everything that the motion makes of it: errors of one sign that
//! add up, chaos, shifts along a limit cycle, expanding phases that contracting ones take back (Richardson's
//! extrapolation, global: Hairer, Nørsett & Wanner, Solving ODE I, §II.4). The estimate is about right
//! where rounding dominates, too. Where forces choose between expressions the second motion keeps the
//! branches of the first, at the same times, so that errors in the time of a switch are not seen. It costs
//! two to three times the run.
//!
//! Measured on 759 motions (double pendulums, orbits, tops, oscillators of van der Pol and Duffing, one-sided
//! dampers, stiff springs, four-bars; ten methods, tolerances from 1e-4 to 1e-13): the estimate is 0.87 to
//! 1.3 times the error for nine of ten, and wrong by more than a factor of 30 once, near an unstable rest at
//! 1e-13.

use alloc::boxed::Box;
use alloc::vec::Vec;
use core::ops::Range;

use crate::integrate::{Accelerations as _, Phase, Step, StepFlags, StepNode, Switching as _, zip};
use crate::model::{ModelState, SimulationModel, Vector};
use crate::simulate::erased_method::StepReplay;
use crate::simulate::trajectory::motion::Motion;

/// Differences that last for less than this part of the time are not reported as lasting: they may be a small
/// shift of the time of a jump, as in relaxation oscillations. Measured on van der Pol's equation
/// (ε = 1e-6): Radau IIA at 1e-5 is off by 514 permitted errors for half a thousandth of the time, by 84 for
/// two thousandths and by 13 for ten; ESDIRK4(3) by 2370, 407 and 63. `.estimate_error()` measures what lasts
/// shorter.
const LASTING_SHARE: f64 = 1e-2;
/// Half steps that fail, or have more than a permitted error, are halved again. So many steps of the second
/// motion are allowed for each of the first.
const MAX_STEPS_PER_STEP: usize = 8;

/// Differences of a motion from one in half steps, in permitted errors.
#[derive(Clone, Copy)]
pub(crate) struct StepDoubling {
    /// The largest difference that lasts, or that at the end.
    pub(crate) lasting: f64,
    /// The largest of all.
    pub(crate) largest: f64,
    /// Time from which on the second motion needed too many steps, if it did; from there on it changes as the
    /// first does.
    pub(crate) given_up: Option<f64>,
}

impl<M: SimulationModel> Motion<'_, M> {
    /// How far it is from a motion in half steps.
    pub(crate) fn step_doubling(&self) -> StepDoubling {
        let records = &self.trajectory.records;
        let (mut y, mut differences) = (records[0].knot().y, Vec::with_capacity(records.len()));
        self.perturb_velocities(&mut y);
        let direction = self.trajectory.direction();
        let relayed =
            |(from, _): &(f64, _)| records.partition_point(|r| (r.state.t() - from) * direction < 0.0);
        let change = self.trajectory.relay.as_ref().map_or(records.len(), relayed);
        let mut given_up = None;
        for part in [0..change, change..records.len()] {
            if let Some(erased_method) =
                (!part.is_empty()).then(|| self.trajectory.erased_method_of(part.start)).flatten()
            {
                let ended =
                    self.follow_in_halves(erased_method.step_replay(), part, &mut y, &mut differences);
                given_up = given_up.or(ended);
            }
        }
        let largest = differences.iter().fold(0.0f64, |most, (_, differences)| most.max(*differences));
        StepDoubling { lasting: lasting(&mut differences), largest, given_up }
    }

    /// Perturbs velocities by a rounding error. Otherwise the second motion would stay exactly at an unstable
    /// rest, or in a plane, as the first does.
    fn perturb_velocities(&self, y: &mut Phase<M::Vector>) {
        let tolerances = &self.trajectory.tolerances;
        let unit = f64::EPSILON / tolerances.absolute.max(tolerances.relative);
        for (i, u) in y.u.as_mut_slice().iter_mut().enumerate() {
            // No sum or difference of two vanishes.
            *u += unit * tolerances.scale(*u, *u) * (1.0 + 0.1 * i as f64);
        }
    }

    /// Follows the steps that leave some records in halves, beginning and ending at `y`, and notes the length
    /// of each and the difference at its end, in permitted errors. When that took too many steps is returned.
    fn follow_in_halves(
        &self,
        step_replay: Box<dyn StepReplay<M>>,
        part: Range<usize>,
        y: &mut Phase<M::Vector>,
        differences: &mut Vec<(f64, f64)>,
    ) -> Option<f64> {
        let records = &self.trajectory.records;
        let steps_left = MAX_STEPS_PER_STEP * part.len() + 1000;
        let (mut a, mut halved) =
            (None, HalvedRun { step_replay, workspace: Vec::new(), steps_left, given_up: None });
        for index in part.filter(|index| index + 1 < records.len()) {
            let [here, there] = [0, 1].map(|i| records[index + i].knot());
            if records[index].flags.branches {
                // Those of the step before are not its own.
                a = None;
            }
            let end = match records[index].h {
                0.0 => None,
                _ => self.make_in_halves(&mut halved, index, (here.t, *y, a), there.t),
            };
            a = end.map(|end| end.a);
            *y = end.map_or_else(
                || {
                    // A reset changes both alike, and so does what cannot be made in halves.
                    halved.step_replay.forget();
                    zip(y, &zip(&there.y, &here.y, |after, before| after - before), |y, change| y + change)
                },
                |end| end.y,
            );
            if records[index].h != 0.0 {
                differences.push((records[index].h.abs(), self.most_permitted_errors(y, &there.y)));
            }
        }
        halved.given_up
    }

    /// Where two halves of the way to `end_t` end, by what moves the motion after a record; what cannot be
    /// made as one step is made as several.
    fn make_in_halves(
        &self,
        halved: &mut HalvedRun<M>,
        index: usize,
        (t, y, a): (f64, Phase<M::Vector>, Option<M::Vector>),
        end_t: f64,
    ) -> Option<StepNode<M::Vector>> {
        let middle = t + 0.5 * (end_t - t);
        if halved.steps_left < 2 {
            halved.given_up = halved.given_up.or(Some(t));
            return None;
        }
        if middle == t || middle == end_t {
            return None;
        }
        let mut half = |(t, y, a), end_t| {
            halved.steps_left = halved.steps_left.saturating_sub(1);
            self.make_step(halved, index, (t, y, a), end_t).or_else(|| {
                halved.step_replay.forget();
                self.make_in_halves(halved, index, (t, y, a), end_t)
            })
        };
        let StepNode { t, y, a } = half((t, y, a), middle)?;
        half((t, y, Some(a)), end_t)
    }

    /// The end of one step, from accelerations `a`, where they are known.
    fn make_step(
        &self,
        halved: &mut HalvedRun<M>,
        index: usize,
        (t, y, a): (f64, Phase<M::Vector>, Option<M::Vector>),
        end_t: f64,
    ) -> Option<StepNode<M::Vector>> {
        let HalvedRun { step_replay, workspace, .. } = halved;
        let mut rhs = self.rhs_in(index, core::mem::take(workspace));
        let record = &self.trajectory.records[index];
        let flags = StepFlags { stages: record.flags.stages, ..StepFlags::default() };
        let mut make = || {
            if record.flags.branches {
                rhs.hold_branches(&mut record.knot(), record.h, true).ok()?;
            }
            let a = match a {
                Some(a) => a,
                None => rhs.accelerations(t, &y.q, &y.u).ok()?,
            };
            let start = StepNode { t, y, a };
            let mut step = Step { start, end: start, h: end_t - t, flags };
            let (y, error) = step_replay.end_on_branches(&mut rhs, &step, &self.trajectory.tolerances)?;
            if error > 1.0 {
                return None;
            }
            step.end = StepNode { t: end_t, y, a: rhs.accelerations(end_t, &y.q, &y.u).ok()? };
            step_replay.accepted(&step);
            Some(step.end)
        };
        let end = make();
        *workspace = rhs.stabilization.into_workspace();
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
    workspace: Vec<f64>,
    steps_left: usize,
    given_up: Option<f64>,
}

/// The lasting difference: the last one, or the value that the others exceed for [`LASTING_SHARE`] of the
/// time. `differences`: lengths of steps, and differences at their ends.
fn lasting(differences: &mut [(f64, f64)]) -> f64 {
    let last = differences.last().map_or(0.0, |(_, differences)| *differences);
    // A difference at both ends of a step lasts for the step.
    let mut before = 0.0;
    for (_, differences) in &mut *differences {
        (*differences, before) = (differences.min(before), *differences);
    }
    let mut steps_left = LASTING_SHARE * differences.iter().map(|(h, _)| h).sum::<f64>();
    differences.sort_by(|(_, a), (_, b)| b.total_cmp(a));
    let lasts = differences.iter().find(|(h, _)| {
        steps_left -= h;
        steps_left <= 0.0
    });
    lasts.map_or(last, |(_, differences)| differences.max(last))
}

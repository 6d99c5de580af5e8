//! Step size collapse: steps that become shorter without end towards a time that they do not reach.
//!
//! Whenever the number of steps has doubled, the duration of the later half is compared with that of the half
//! before. If it is the part r < 1 of that several times in a row, all further doublings together take no
//! more than r/(1 − r) of the last duration. That gives the time which the steps approach. Steps that stall
//! before a singular position are found earlier, in `singular_stall.rs`; accumulating events in
//! `events/zeno.rs`.

use alloc::vec::Vec;

use crate::constrain::TopContributors;
use crate::integrate::Method;
use crate::math;
use crate::model::{SimulationModel, StaticTraits, Vector};
use crate::simulate::erased_method::stepping::StepStatistics;
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::simulate::right_hand_side::RightHandSide;
use crate::simulate::run::monitor::{Monitor, Watched};

/// Number of steps at the first check. Fewer would include the transient of the step size at the start.
const FIRST_CHECK: u64 = 1024;
/// Largest ratio r of two durations that counts as shrinking. The nearer the bound to 1, the more motions
/// that only slow down for a while would be ended.
const MAX_DURATION_RATIO: f64 = 0.7;
/// Shrinking doublings in a row that end the motion: at 65,536 steps at the earliest, of which the last half
/// took at most 0.7⁵ = 0.17 of the time of steps 1,025 to 2,048.
const SHRINKING_DOUBLINGS: u32 = 5;

/// Ends a motion whose steps become shorter without end.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StepSizeCollapse {
    /// Number of steps at the next check.
    next_check: u64,
    /// Time of the motion at the last check.
    last_check_time: Option<f64>,
    /// Duration of the steps between the last two checks.
    last_duration: f64,
    /// Doublings in a row whose duration shrank.
    shrinking_doublings: u32,
}

impl<M: SimulationModel> Monitor<M> for StepSizeCollapse {
    fn begin(_: &mut Watched<'_, '_, '_, M>, _: Method) -> Self {
        Self::new()
    }

    #[inline(always)]
    fn before_step(
        &mut self,
        run: &mut Watched<'_, '_, '_, M>,
        statistics: &StepStatistics,
    ) -> Result<(), Kind> {
        // A stiff or sliding motion is reported as such, by the step limit.
        if let Some(at) = self.approached_time(run.steps_tried(statistics), statistics.t, run.plan.end)
            && statistics.stiff_at.is_none()
            && statistics.slides_at.is_none()
        {
            return Err(steps_vanish(run, at));
        }
        Ok(())
    }
}

/// The error of steps that become shorter without end: with the coordinates that accelerate most, and the
/// constraints with the largest forces.
#[cold]
pub(crate) fn steps_vanish<M: SimulationModel>(run: &mut Watched<'_, '_, '_, M>, at: f64) -> Kind {
    let state = run.now();
    let accelerations = run.stepper.now().a;
    let coordinates =
        TopContributors::ranked(M::COORDINATES, accelerations.as_slice().iter().copied().enumerate());
    let RightHandSide { model, constants, stabilization, .. } = &mut run.plan.rhs;
    let mut forces = Vec::new();
    if M::IS_UNCONSTRAINED {
        // There are no constraints.
    } else if let Ok(reactions) = stabilization.reactions(model, constants, &state) {
        let gradients = stabilization.gradients(model, &state);
        forces.extend((0..M::Rows::LEN).map(|row| {
            let length = gradients.row(row).iter().map(|x| x * x).sum::<f64>();
            (row, reactions[row] * math::sqrt(length))
        }));
    }
    Kind::StepsVanish { at, coordinates, rows: TopContributors::ranked(M::ROWS, forces.into_iter()) }
}

impl StepSizeCollapse {
    fn new() -> Self {
        Self { next_check: FIRST_CHECK, last_check_time: None, last_duration: 0.0, shrinking_doublings: 0 }
    }

    /// The time that the steps approach, if they do not come to the end. `made` steps were made up to t.
    #[inline]
    fn approached_time(&mut self, made: u64, t: f64, end: f64) -> Option<f64> {
        if made < self.next_check { None } else { self.check(made, t, end) }
    }

    #[cold]
    fn check(&mut self, made: u64, t: f64, end: f64) -> Option<f64> {
        self.next_check = made.max(self.next_check).saturating_mul(2);
        let duration = (t - self.last_check_time.replace(t)?).abs();
        let ratio = duration / math::max(self.last_duration, f64::MIN_POSITIVE);
        self.last_duration = duration;
        self.shrinking_doublings = if ratio <= MAX_DURATION_RATIO { self.shrinking_doublings + 1 } else { 0 };
        let at = t + (duration * ratio / (1.0 - ratio)).copysign(end - t);
        // With a margin of two: the time may be underestimated.
        let ends_early = (at - t).abs() < 0.5 * (end - t).abs();
        (self.shrinking_doublings >= SHRINKING_DOUBLINGS && ends_early).then_some(at)
    }
}

#[cfg(test)]
mod tests {
    use super::StepSizeCollapse;

    /// Steps of this size at these times: the number after which it is seen that they do not reach 10, and
    /// the time they approach.
    fn seen(h: impl Fn(f64) -> f64) -> Option<(u64, f64)> {
        let (mut collapse, mut t) = (StepSizeCollapse::new(), 0.0);
        (1..1_000_000).find_map(|made| {
            t += h(t);
            assert!(t < 10.0 || made > 1000);
            (t < 10.0).then(|| collapse.approached_time(made, t, 10.0)).flatten().map(|at| (made, at))
        })
    }

    #[test]
    fn steps_that_vanish_are_seen_and_others_are_not() {
        let (made, at) = seen(|t| 1e-3 * (2.0 - t).powi(2)).unwrap();
        assert!(made <= 1 << 17 && (at - 2.0).abs() < 1e-3, "{made} {at}");
        // Equal ones, ones that become shorter and reach the end, and ones that are short for a while.
        assert_eq!(seen(|_| 1e-5), None);
        assert_eq!(seen(|t| 1e-4 * (-t).exp().max(2e-1)), None);
        assert_eq!(seen(|t| 1e-6 + 1e-2 * (t - 2.0).powi(2)), None);
    }
}

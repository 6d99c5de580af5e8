//! Sliding mode: a motion that slides along a jump of its accelerations (A. F. Filippov, Differential
//! Equations with Discontinuous Righthand Sides, Kluwer 1988).
//!
//! The accelerations on both sides lead back to the switching surface, so steps cross it to and fro and are
//! as short as the tolerance requires. The stepper finds that the motion slides
//! (`right_hand_side/switching_functions.rs`). This monitor ends the motion once it is clear that its steps
//! would run out, long before they do. It does not integrate Filippov's sliding motion.

use crate::integrate::Method;
use crate::model::SimulationModel;
use crate::simulate::erased_method::stepping::StepStatistics;
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::simulate::run::monitor::{Monitor, Watched};
use crate::simulate::run::monitors::step_limit::too_many_steps;

/// Checks during the permitted steps, at equal numbers of steps.
const CHECKS_PER_RUN: u64 = 64;
/// Fewest steps between two checks, so that their mean progress is meaningful.
const MIN_STEPS_BETWEEN_CHECKS: u64 = 1024;
/// Most steps per finding of a motion that slides throughout. The stepper does not look for 32 steps after a
/// finding, so about three findings in a hundred steps are possible.
const MAX_STEPS_PER_FINDING: u64 = 100;
/// Factor by which the steps needed to the end have to exceed those that are left. The motion may stop
/// sliding and advance faster, so a factor of 1 would end motions that arrive.
const REQUIRED_EXCESS: f64 = 2.0;

/// Ends a motion that slides and would use up its steps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SlidingMode {
    /// At the last check: steps made, time, number of findings.
    made: u64,
    t: f64,
    found: u64,
}

impl<M: SimulationModel> Monitor<M> for SlidingMode {
    fn begin(run: &mut Watched<'_, '_, '_, M>, _: Method) -> Self {
        Self::from(run.stepper.now().t)
    }

    #[inline(always)]
    fn before_step(
        &mut self,
        run: &mut Watched<'_, '_, '_, M>,
        statistics: &StepStatistics,
    ) -> Result<(), Kind> {
        let steps = (run.steps_tried(statistics), run.plan.max_steps);
        let slides = statistics.slides;
        if slides > 0 && self.would_run_out(steps, (statistics.t, run.plan.end), slides) {
            return Err(too_many_steps(run, statistics));
        }
        Ok(())
    }
}

impl SlidingMode {
    fn from(t: f64) -> Self {
        Self { made: 0, t, found: 0 }
    }

    /// Whether the motion has slid throughout the steps since the last check, and would not come to its end
    /// with the steps that are left. `found` is the number of findings so far.
    #[inline]
    fn would_run_out(&mut self, (made, limit): (u64, u64), (t, end): (f64, f64), found: u64) -> bool {
        made >= self.made + (limit / CHECKS_PER_RUN).max(MIN_STEPS_BETWEEN_CHECKS)
            && self.check(made, limit, (t, end), found)
    }

    #[cold]
    fn check(&mut self, made: u64, limit: u64, (t, end): (f64, f64), found: u64) -> bool {
        let (steps, advanced, findings) =
            (made - self.made, (t - self.t).abs(), found.saturating_sub(self.found));
        *self = Self { made, t, found };
        let (time_left, steps_left) = ((end - t).abs(), limit.saturating_sub(made) as f64);
        findings.saturating_mul(MAX_STEPS_PER_FINDING) >= steps
            && time_left * steps as f64 > REQUIRED_EXCESS * advanced * steps_left
    }
}

#[cfg(test)]
mod tests {
    use super::SlidingMode;

    /// Steps of this size, of which every n-th is found to slide, on the way from 0 to 10: after how many of
    /// a million it is given up.
    fn given_up(h: impl Fn(u64) -> f64, slides: impl Fn(u64) -> bool) -> Option<u64> {
        let (mut slide, mut t, mut found) = (SlidingMode::from(0.0), 0.0, 0);
        (1..1_000_000).find(|made| {
            t += h(*made);
            found += u64::from(slides(*made));
            t < 10.0 && slide.would_run_out((*made, 1_000_000), (t, 10.0), found)
        })
    }

    #[test]
    fn what_slides_all_along_and_comes_to_no_end_is_given_up() {
        let often = |made: u64| made.is_multiple_of(33);
        assert!(given_up(|_| 1e-7, often).is_some_and(|made| made < 20_000));
        // From half the way on.
        let late = |made: u64| if made <= 1000 { 5e-3 } else { 1e-7 };
        assert!(given_up(late, |made| made > 1000 && often(made)).is_some_and(|made| made < 40_000));
        // It comes to the end; it slid once; it advances faster after a while.
        assert_eq!(given_up(|_| 1e-4, often), None);
        assert_eq!(given_up(|_| 1e-7, |made| made == 1000), None);
        assert_eq!(given_up(|made| if (1000..9000).contains(&made) { 1e-7 } else { 1e-4 }, often), None);
    }
}

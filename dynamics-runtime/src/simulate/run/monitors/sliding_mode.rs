//! Motions that slide along a jump of their accelerations: either side leads back to it, and steps go to and
//! fro across it, as short as the tolerance asks for. Whether they would come to the end is seen long before
//! the permitted steps are used up (A. F. Filippov, Differential Equations with Discontinuous Righthand
//! Sides, Kluwer 1988).

use crate::integrate::Method;
use crate::model::SimulationModel;
use crate::simulate::erased_method::stepping::StepStatistics;
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::simulate::run::monitor::{Monitor, Watched};
use crate::simulate::run::monitors::step_limit::too_many_steps;

/// Parts of the permitted steps, after each of which it is looked at.
const PARTS: u64 = 64;
/// Fewest steps of such a part.
const FEWEST_STEPS: u64 = 1024;
/// Of so many steps at least one finds the motion sliding where it does: after one that has, 32 do not look.
const STEPS_PER_FINDING: u64 = 100;
/// By how many times what is left of the permitted steps would have to be exceeded: what slides may go on
/// from there, faster.
const MARGIN: f64 = 2.0;

/// Ends a motion that slides and would use up its steps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SlidingMode {
    /// Where the last part of the permitted steps began: steps made, time, how often it was found to slide.
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
        let steps = (run.steps_tried(statistics), run.plan.most_steps);
        let slides = statistics.slides;
        if slides > 0 && self.outlasts(steps, (statistics.t, run.plan.end), slides) {
            return Err(too_many_steps(run, statistics));
        }
        Ok(())
    }
}

impl SlidingMode {
    fn from(t: f64) -> Self {
        Self { made: 0, t, found: 0 }
    }

    /// So many steps were made, up to t, and so often the motion was found to slide: whether it did all along
    /// the last part of the permitted steps, and would not come to the end with the others.
    #[inline]
    fn outlasts(&mut self, (made, limit): (u64, u64), (t, end): (f64, f64), found: u64) -> bool {
        made >= self.made + (limit / PARTS).max(FEWEST_STEPS) && self.looks(made, limit, (t, end), found)
    }

    #[cold]
    fn looks(&mut self, made: u64, limit: u64, (t, end): (f64, f64), found: u64) -> bool {
        let (steps, won, slid) = (made - self.made, (t - self.t).abs(), found.saturating_sub(self.found));
        *self = Self { made, t, found };
        let (left, permitted) = ((end - t).abs(), limit.saturating_sub(made) as f64);
        slid.saturating_mul(STEPS_PER_FINDING) >= steps && left * steps as f64 > MARGIN * won * permitted
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
            t < 10.0 && slide.outlasts((*made, 1_000_000), (t, 10.0), found)
        })
    }

    #[test]
    fn what_slides_all_along_and_comes_to_no_end_is_given_up() {
        let often = |made: u64| made.is_multiple_of(33);
        assert!(given_up(|_| 1e-7, often).is_some_and(|made| made < 20_000));
        // From half the way on.
        let late = |made: u64| if made <= 1000 { 5e-3 } else { 1e-7 };
        assert!(given_up(late, |made| made > 1000 && often(made)).is_some_and(|made| made < 40_000));
        // It comes to the end, it slid once, it goes on faster after a while.
        assert_eq!(given_up(|_| 1e-4, often), None);
        assert_eq!(given_up(|_| 1e-7, |made| made == 1000), None);
        assert_eq!(given_up(|made| if (1000..9000).contains(&made) { 1e-7 } else { 1e-4 }, often), None);
    }
}

//! Steps that hardly go on any more before a singular position of the constraints: rounding errors count for
//! more than the tolerance there, the nearer the more.

use crate::integrate::{Method, StepOptions};
use crate::model::SimulationModel;
use crate::simulate::diagnosis::singular_position;
use crate::simulate::erased_method::stepping::StepStatistics;
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::simulate::run::monitor::{Monitor, Watched};
use crate::simulate::run::monitors::step_size_collapse::steps_vanish;

/// Steps between two looks at how far they came.
const LOOK_INTERVAL: u64 = 512;

/// Ends a motion that would use up its steps before a singular position.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SingularStall {
    /// The number of steps at which the next look is taken.
    next: u64,
    /// When the last look was.
    last: f64,
}

impl<M: SimulationModel> Monitor<M> for SingularStall {
    fn begin(_: &mut Watched<'_, '_, '_, M>, _: Method) -> Self {
        Self::new()
    }

    #[inline(always)]
    fn before_step(
        &mut self,
        run: &mut Watched<'_, '_, '_, M>,
        statistics: &StepStatistics,
    ) -> Result<(), Kind> {
        let made = run.steps_tried(statistics);
        match self.took(made, statistics.t) {
            Some(took) => look(run, statistics, (made, took)),
            None => Ok(()),
        }
    }
}

/// The last [`LOOK_INTERVAL`] of the steps made took this time.
#[cold]
fn look<M: SimulationModel>(
    run: &mut Watched<'_, '_, '_, M>,
    statistics: &StepStatistics,
    (made, took): (u64, f64),
) -> Result<(), Kind> {
    let StepOptions { fixed, most, .. } = run.plan.options;
    let (now, limit) = (statistics.t, run.plan.most_steps);
    if fixed.is_none()
        && statistics.proposed < most
        && runs_out(took, (made, limit), (now, run.plan.end))
        && singular_position::stalls_before_singular_position(run.plan.rhs.model, &run.now(), took)
    {
        return Err(steps_vanish(run, now));
    }
    Ok(())
}

impl SingularStall {
    fn new() -> Self {
        Self { next: LOOK_INTERVAL, last: f64::NEG_INFINITY }
    }

    /// The time that the last [`LOOK_INTERVAL`] steps took, where so many were made.
    #[inline(always)]
    fn took(&mut self, made: u64, t: f64) -> Option<f64> {
        if made < self.next {
            return None;
        }
        self.next = made + LOOK_INTERVAL;
        Some((t - core::mem::replace(&mut self.last, t)).abs())
    }
}

/// Whether steps that go on as the last [`LOOK_INTERVAL`] did, which took this time, are used up before the
/// end: what rests beside such a position comes to its end.
fn runs_out(took: f64, (made, limit): (u64, u64), (t, end): (f64, f64)) -> bool {
    took * (limit.saturating_sub(made) as f64) < LOOK_INTERVAL as f64 * (end - t).abs()
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use super::SingularStall;

    #[test]
    fn what_many_steps_took_is_told() {
        let mut stall = SingularStall::new();
        let took: Vec<f64> = (1..=2048).filter_map(|made| stall.took(made, 0.5 * made as f64)).collect();
        assert_eq!(took, [f64::INFINITY, 256.0, 256.0, 256.0]);
    }
}

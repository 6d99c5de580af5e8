//! Singular stall: steps that hardly advance before a singular position of the constraints.
//!
//! Near it the constraints amplify rounding errors above the tolerance, so steps become ever shorter. If the
//! last steps are so short that the permitted steps would run out, and the singular position is near
//! (`diagnosis/singular_position.rs`), the motion ends.

use crate::integrate::{Method, StepOptions};
use crate::model::SimulationModel;
use crate::simulate::diagnosis::singular_position;
use crate::simulate::erased_method::stepping::StepStatistics;
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::simulate::run::monitor::{Monitor, Watched};
use crate::simulate::run::monitors::step_size_collapse::steps_vanish;

/// Steps between two checks of the progress. The check is cheap, the diagnosis that may follow is not.
const STALL_CHECK_INTERVAL: u64 = 512;

/// Ends a motion that would use up its steps before a singular position.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SingularStall {
    /// Number of steps of the next check.
    next_check: u64,
    /// Time of the motion at the last check.
    last_check_time: f64,
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
        let steps_made = run.steps_tried(statistics);
        match self.duration_since_check(steps_made, statistics.t) {
            Some(duration) => check_stall(run, statistics, (steps_made, duration)),
            None => Ok(()),
        }
    }
}

/// An error if the motion stalls: the last [`STALL_CHECK_INTERVAL`] steps advanced it by this duration.
#[cold]
fn check_stall<M: SimulationModel>(
    run: &mut Watched<'_, '_, '_, M>,
    statistics: &StepStatistics,
    (steps_made, duration): (u64, f64),
) -> Result<(), Kind> {
    let StepOptions { fixed, most, .. } = run.plan.options;
    let (now, limit) = (statistics.t, run.plan.max_steps);
    if fixed.is_none()
        && statistics.proposed < most
        && steps_run_out(duration, (steps_made, limit), (now, run.plan.end))
        && singular_position::stalls_before_singular_position(run.plan.rhs.model, &run.now(), duration)
    {
        return Err(steps_vanish(run, now));
    }
    Ok(())
}

impl SingularStall {
    fn new() -> Self {
        Self { next_check: STALL_CHECK_INTERVAL, last_check_time: f64::NEG_INFINITY }
    }

    /// The duration of the last [`STALL_CHECK_INTERVAL`] steps, where so many were made since the last check.
    #[inline(always)]
    fn duration_since_check(&mut self, steps_made: u64, t: f64) -> Option<f64> {
        if steps_made < self.next_check {
            return None;
        }
        self.next_check = steps_made + STALL_CHECK_INTERVAL;
        Some((t - core::mem::replace(&mut self.last_check_time, t)).abs())
    }
}

/// Whether the permitted steps would run out before the end if all advanced as the last
/// [`STALL_CHECK_INTERVAL`] did. A motion that rests near a singular position comes to its end.
fn steps_run_out(duration: f64, (steps_made, limit): (u64, u64), (t, end): (f64, f64)) -> bool {
    duration * (limit.saturating_sub(steps_made) as f64) < STALL_CHECK_INTERVAL as f64 * (end - t).abs()
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use super::SingularStall;

    #[test]
    fn the_duration_of_many_steps_is_returned() {
        let mut stall = SingularStall::new();
        let duration: Vec<f64> = (1..=2048)
            .filter_map(|steps_made| stall.duration_since_check(steps_made, 0.5 * steps_made as f64))
            .collect();
        assert_eq!(duration, [f64::INFINITY, 256.0, 256.0, 256.0]);
    }
}

//! Cancellation: a run ends because another thread or a signal handler has set a flag, or a function says so.

use core::sync::atomic::Ordering;

use crate::integrate::Method;
use crate::model::SimulationModel;
use crate::simulate::erased_method::stepping::StepStatistics;
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::simulate::run::monitor::{Monitor, Watched};

/// Reads the flag of [`cancel`](crate::simulate::Simulation::cancel) before every step, and calls the
/// function of [`cancel_when`](crate::simulate::Simulation::cancel_when).
pub(crate) struct Cancellation;

impl<M: SimulationModel> Monitor<M> for Cancellation {
    fn begin(_: &mut Watched<'_, '_, '_, M>, _: Method) -> Self {
        Self
    }

    #[inline(always)]
    fn before_step(&mut self, run: &mut Watched<'_, '_, '_, M>, _: &StepStatistics) -> Result<(), Kind> {
        let flag = run.plan.cancel.is_some_and(|flag| flag.load(Ordering::Relaxed));
        match flag || run.plan.cancel_when.is_some_and(|asked| asked()) {
            true => Err(Kind::Cancelled),
            false => Ok(()),
        }
    }
}

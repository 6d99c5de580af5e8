//! Cancellation: a run ends because another thread or a signal handler has set a flag.

use core::sync::atomic::Ordering;

use crate::integrate::Method;
use crate::model::SimulationModel;
use crate::simulate::erased_method::stepping::StepStatistics;
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::simulate::run::monitor::{Monitor, Watched};

/// Reads the flag of [`cancel`](crate::simulate::Simulation::cancel) before every step.
pub(crate) struct Cancellation;

impl<M: SimulationModel> Monitor<M> for Cancellation {
    fn begin(_: &mut Watched<'_, '_, '_, M>, _: Method) -> Self {
        Self
    }

    #[inline(always)]
    fn before_step(&mut self, run: &mut Watched<'_, '_, '_, M>, _: &StepStatistics) -> Result<(), Kind> {
        match run.plan.cancel {
            Some(flag) if flag.load(Ordering::Relaxed) => Err(Kind::Cancelled),
            _ => Ok(()),
        }
    }
}

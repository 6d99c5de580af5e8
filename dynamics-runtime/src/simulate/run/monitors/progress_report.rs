//! The progress bar of a run.

use crate::integrate::Method;
use crate::model::SimulationModel;
use crate::simulate::run::monitor::{Advice, Monitor, Retreat, Watched};

/// Moves the bar of the plan, which lasts over a change of methods.
pub(crate) struct ProgressReport;

impl<M: SimulationModel> Monitor<M> for ProgressReport {
    fn begin(_: &mut Watched<'_, '_, '_, M>, _: Method) -> Self {
        Self
    }

    #[inline(always)]
    fn after_step(
        &mut self,
        run: &mut Watched<'_, '_, '_, M>,
        _: bool,
    ) -> Result<Advice, Retreat<M::Vector>> {
        run.plan.progress.at(run.stepper.now().t);
        Ok(Advice::Continue)
    }
}

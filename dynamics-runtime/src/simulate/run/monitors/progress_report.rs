//! Progress report: the progress bar of a run.

use crate::integrate::Method;
use crate::model::SimulationModel;
use crate::simulate::run::monitor::{Advice, Monitor, Retreat, Watched};

/// Advances the progress bar, which belongs to the plan and so survives a change of method.
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

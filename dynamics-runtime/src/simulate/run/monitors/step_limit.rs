//! Step limit: a run has used up its steps.

use crate::integrate::Method;
use crate::model::{ModelState as _, SimulationModel};
use crate::simulate::erased_method::stepping::StepStatistics;
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::simulate::run::monitor::{Monitor, Watched};
use crate::simulate::stabilization::adaptive_gain;

/// Ends a motion that took as many steps as [`max_steps`](crate::simulate::Simulation::max_steps) permits.
pub(crate) struct StepLimit;

impl<M: SimulationModel> Monitor<M> for StepLimit {
    fn begin(_: &mut Watched<'_, '_, '_, M>, _: Method) -> Self {
        Self
    }

    #[inline(always)]
    fn before_step(
        &mut self,
        run: &mut Watched<'_, '_, '_, M>,
        statistics: &StepStatistics,
    ) -> Result<(), Kind> {
        if run.steps_tried(statistics) >= run.plan.max_steps {
            return Err(too_many_steps(run, statistics));
        }
        Ok(())
    }
}

/// The error of a run whose steps are used up, or will be before its end, with the reason that the stepper
/// found: stiffness, sliding, or Baumgarte's gains.
#[cold]
pub(crate) fn too_many_steps<M: SimulationModel>(
    run: &Watched<'_, '_, '_, M>,
    statistics: &StepStatistics,
) -> Kind {
    let StepStatistics { t, stiff_at, slides_at, .. } = *statistics;
    let formulation = run.plan.rhs.stabilization.formulation;
    let interval = [run.plan.start.t(), t];
    let gain = adaptive_gain::bounding_gain(formulation, interval, run.steps_tried(statistics));
    Kind::TooManySteps { limit: run.plan.max_steps, stiff_at, slides_at, gain }
}

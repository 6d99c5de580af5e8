//! The interface of monitors, which watch a run for one failure mode each.
//!
//! A monitor is asked at the same four points of every step. It sees the state of the run and answers with
//! data. The loop of the run acts on the answer: it ends the motion, undoes a step or changes the method. The
//! list of monitors is in [`super::monitors`], and their errors are kinds of [`crate::simulate::failure`].

use crate::integrate::{Method, Step, StepNode};
use crate::model::SimulationModel;
use crate::simulate::erased_method::stepping::{ErasedStepper, StepStatistics};
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::simulate::run::plan::RunPlan;

/// A run as monitors see it.
pub(crate) struct Watched<'w, 'r, 'm, M: SimulationModel> {
    pub(crate) plan: &'w mut RunPlan<'r, 'm, M>,
    pub(crate) stepper: &'w mut dyn ErasedStepper<M>,
}

impl<M: SimulationModel> Watched<'_, '_, '_, M> {
    /// The state that the run has reached.
    pub(crate) fn now(&self) -> M::State {
        let StepNode { t, y, .. } = self.stepper.now();
        self.plan.rhs.state(*t, &y.q, &y.u)
    }

    /// Attempted steps so far, including those of the method before this one.
    #[inline(always)]
    pub(crate) fn steps_tried(&self, statistics: &StepStatistics) -> u64 {
        let before = self.plan.resume_from.as_ref().map_or(0, |(_, steps)| *steps);
        before + statistics.accepted + statistics.rejected
    }
}

/// Watches a run for one failure mode.
pub(crate) trait Monitor<M: SimulationModel>: Sized {
    /// A monitor of a run that is about to begin, or to continue with another method.
    fn begin(run: &mut Watched<'_, '_, '_, M>, method: Method) -> Self;

    /// Asked before the next step. An error ends the motion at the current state.
    #[inline(always)]
    fn before_step(
        &mut self,
        _run: &mut Watched<'_, '_, '_, M>,
        _statistics: &StepStatistics,
    ) -> Result<(), Kind> {
        Ok(())
    }

    /// Asked about a step as the method made it, before its events are located.
    #[inline(always)]
    fn after_attempt(
        &mut self,
        _run: &mut Watched<'_, '_, '_, M>,
        _step: &Step<M::Vector>,
    ) -> Result<(), Objection> {
        Ok(())
    }

    /// Asked about a step that is to be recorded, up to an event with an action.
    #[inline(always)]
    fn before_record(
        &mut self,
        _run: &mut Watched<'_, '_, '_, M>,
        _step: &Step<M::Vector>,
    ) -> Result<(), Objection> {
        Ok(())
    }

    /// Asked after a step was recorded. `ends`: the motion ends here, or continues from another state.
    #[inline(always)]
    fn after_step(
        &mut self,
        _run: &mut Watched<'_, '_, '_, M>,
        _ends: bool,
    ) -> Result<Advice, Retreat<M::Vector>> {
        Ok(Advice::Continue)
    }

    /// The motion continues from another state, which an action left.
    #[inline(always)]
    fn restart(&mut self) {}

    /// The run has ended with an error: adds to it what this monitor found of the reason.
    #[inline(always)]
    fn explain(&mut self, _run: &mut Watched<'_, '_, '_, M>, _kind: &mut Kind) {}
}

/// The error of a step that is not recorded yet, and the part of the step that is valid.
pub(crate) struct Objection {
    pub(crate) kind: Kind,
    pub(crate) valid: Valid,
}

/// The part of a step that belongs to the motion, if the motion ends in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Valid {
    /// Nothing: the motion ends at the start of the step.
    Nothing,
    /// Up to this part of it, from 0 to 1.
    UpTo(f64),
    /// All of it: the motion ends at the end of the step.
    Whole,
}

/// How a run continues after a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Advice {
    /// With the same method.
    Continue,
    /// With a method for stiff motions.
    ChangeMethod,
}

/// The error with which a motion ends at an earlier node. What was recorded behind that is not part of the
/// motion.
pub(crate) struct Retreat<V> {
    pub(crate) kind: Kind,
    pub(crate) to: StepNode<V>,
}

/// Implements [`Monitor`] for a tuple of monitors, which are asked in turn. It is a tuple and not a list of
/// trait objects because a step of a small model takes hundreds of nanoseconds, and because monitors that do
/// not apply to a model are then not compiled.
///
/// A tuple of another length than the one below does not implement [`Monitor`]. A list of eleven monitors
/// needs an eleventh letter.
macro_rules! in_turn {
    ($($monitor:ident)*) => {
        #[allow(non_snake_case, reason = "variables of the monitors' types are called like them")]
        impl<M: SimulationModel, $($monitor: Monitor<M>),*> Monitor<M> for ($($monitor,)*) {
            fn begin(run: &mut Watched<'_, '_, '_, M>, method: Method) -> Self {
                ($($monitor::begin(run, method),)*)
            }

            #[inline(always)]
            fn before_step(
                &mut self,
                run: &mut Watched<'_, '_, '_, M>,
                statistics: &StepStatistics,
            ) -> Result<(), Kind> {
                let ($($monitor,)*) = self;
                $($monitor.before_step(run, statistics)?;)*
                Ok(())
            }

            #[inline(always)]
            fn after_attempt(
                &mut self,
                run: &mut Watched<'_, '_, '_, M>,
                step: &Step<M::Vector>,
            ) -> Result<(), Objection> {
                let ($($monitor,)*) = self;
                $($monitor.after_attempt(run, step)?;)*
                Ok(())
            }

            #[inline(always)]
            fn before_record(
                &mut self,
                run: &mut Watched<'_, '_, '_, M>,
                step: &Step<M::Vector>,
            ) -> Result<(), Objection> {
                let ($($monitor,)*) = self;
                $($monitor.before_record(run, step)?;)*
                Ok(())
            }

            #[inline(always)]
            fn after_step(
                &mut self,
                run: &mut Watched<'_, '_, '_, M>,
                ends: bool,
            ) -> Result<Advice, Retreat<M::Vector>> {
                let ($($monitor,)*) = self;
                $(if $monitor.after_step(run, ends)? == Advice::ChangeMethod {
                    return Ok(Advice::ChangeMethod);
                })*
                Ok(Advice::Continue)
            }

            #[inline(always)]
            fn restart(&mut self) {
                let ($($monitor,)*) = self;
                $(Monitor::<M>::restart($monitor);)*
            }

            fn explain(&mut self, run: &mut Watched<'_, '_, '_, M>, kind: &mut Kind) {
                let ($($monitor,)*) = self;
                $($monitor.explain(run, kind);)*
            }
        }
    };
}
// As many letters as `Monitors` in `monitors.rs` has entries: ten.
in_turn!(A B C D E F G H I J);

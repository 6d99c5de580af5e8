//! What watches a run, without the run knowing what it watches for.
//!
//! A monitor looks for one way in which a motion goes wrong, or in which its method does. It is asked at the
//! same four places of every step, sees where the run stands, and answers by data: the run itself ends the
//! motion, takes a step back or changes its method. [`super::monitors`] has the list of them.

use crate::integrate::{Method, Step, StepNode};
use crate::model::SimulationModel;
use crate::simulate::erased_method::stepping::{ErasedStepper, StepStatistics};
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::simulate::run::plan::RunPlan;

/// Where a run stands, as monitors see it.
pub(crate) struct Watched<'w, 'r, 'm, M: SimulationModel> {
    pub(crate) plan: &'w mut RunPlan<'r, 'm, M>,
    pub(crate) stepper: &'w mut dyn ErasedStepper<M>,
}

impl<M: SimulationModel> Watched<'_, '_, '_, M> {
    /// The state in which it stands.
    pub(crate) fn now(&self) -> M::State {
        let StepNode { t, y, .. } = self.stepper.now();
        self.plan.rhs.state(*t, &y.q, &y.u)
    }

    /// Steps that were tried so far, by the method before this one too.
    #[inline(always)]
    pub(crate) fn steps_tried(&self, statistics: &StepStatistics) -> u64 {
        let before = self.plan.resumes.as_ref().map_or(0, |(_, steps)| *steps);
        before + statistics.accepted + statistics.rejected
    }
}

/// Watches a run for one thing.
pub(crate) trait Monitor<M: SimulationModel>: Sized {
    /// Of a run that is about to begin, or goes on with another method, from where it stands.
    fn begin(run: &mut Watched<'_, '_, '_, M>, method: Method) -> Self;

    /// Before the next step is tried. An error ends the motion where it stands.
    #[inline(always)]
    fn before_step(
        &mut self,
        _run: &mut Watched<'_, '_, '_, M>,
        _statistics: &StepStatistics,
    ) -> Result<(), Kind> {
        Ok(())
    }

    /// A step as the method made it, before events are looked for in it.
    #[inline(always)]
    fn after_attempt(
        &mut self,
        _run: &mut Watched<'_, '_, '_, M>,
        _step: &Step<M::Vector>,
    ) -> Result<(), Objection> {
        Ok(())
    }

    /// A step as it is going to be recorded: up to an event that acts.
    #[inline(always)]
    fn before_record(
        &mut self,
        _run: &mut Watched<'_, '_, '_, M>,
        _step: &Step<M::Vector>,
    ) -> Result<(), Objection> {
        Ok(())
    }

    /// A step is recorded. `ends`: the motion ends here, or goes on from another state.
    #[inline(always)]
    fn after_step(
        &mut self,
        _run: &mut Watched<'_, '_, '_, M>,
        _ends: bool,
    ) -> Result<Advice, Retreat<M::Vector>> {
        Ok(Advice::Continue)
    }

    /// The motion goes on from another state, which an event left.
    #[inline(always)]
    fn restart(&mut self) {}

    /// The run has broken off: what this monitor knows of the reason is added to it.
    #[inline(always)]
    fn explain(&mut self, _run: &mut Watched<'_, '_, '_, M>, _kind: &mut Kind) {}
}

/// What a monitor has against a step that is not recorded yet.
pub(crate) struct Objection {
    pub(crate) kind: Kind,
    pub(crate) valid: Valid,
}

/// Which part of a step belongs to the motion although it ends in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Valid {
    /// None: the motion ends where the step starts.
    Nothing,
    /// Up to this part of it, in 0 to 1.
    UpTo(f64),
    /// All of it: the motion ends where the step ends.
    Whole,
}

/// How a run is to go on after a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Advice {
    /// As it did.
    Continue,
    /// By a method for stiff motions.
    ChangeMethod,
}

/// The motion ends with this, and what was recorded from a place on is not part of it.
pub(crate) struct Retreat<V> {
    pub(crate) kind: Kind,
    pub(crate) to: StepNode<V>,
}

/// Makes a list of monitors one that asks them in turn. A tuple and no list of trait objects: a step of a
/// small model takes hundreds of nanoseconds, and what does not apply to a model is not compiled.
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
in_turn!(A B C D E F G H I J);

//! The loop of a run: make a step, locate its events, record it.
//!
//! Each turn of [`RunState::step_to_end`] does the following.
//!
//! 1. Monitors are asked before the step.
//! 2. The stepper makes a step. It is accepted or rejected in `integrate/stepper.rs`; here only accepted
//!    steps arrive. A step that met a corner of a unilateral constraint is shortened
//!    (`constraint_discontinuity.rs`).
//! 3. Monitors are asked about the step. If one objects, its valid part is recorded and the motion ends.
//! 4. The step is shortened to the first event that calls for an action, and recorded (`event_steps.rs`); the
//!    actions are applied and the motion restarts (`event_handling.rs`).
//! 5. Monitors are asked after the step.
//!
//! The monitors are listed in [`monitors`]; a new failure mode, or a warning that needs every step, is one
//! more of them. Checks of a finished motion are in `verification/`. This file depends on no particular
//! monitor. `simulation/execution.rs` calls [`run`].

pub(crate) mod constraint_discontinuity;
pub(crate) mod event_handling;
pub(crate) mod event_steps;
pub(crate) mod failure;
pub(crate) mod monitor;
pub(crate) mod monitors;
pub(crate) mod plan;
pub(crate) mod sinks;

use alloc::vec::Vec;

use crate::integrate::{Phase, Step, StepNode, StepOptions, Tolerances};
use crate::model::{ModelState, SimulationModel, StaticTraits};
use crate::simulate::erased_method::ErasedMethod;
use crate::simulate::erased_method::stepping::{ErasedStepper, StepStatistics};
use crate::simulate::events::rules::Flow;
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::simulate::run::failure::{RunFailure, evaluation};
use crate::simulate::run::monitor::{Advice, Monitor, Objection, Retreat, Valid, Watched};
use crate::simulate::run::monitors::Monitors;
use crate::simulate::run::plan::{RunEnd, RunPlan};
use crate::simulate::run::sinks::Sink;
use crate::simulate::stabilization::singular_start::time_until_determined;
use crate::simulate::trajectory::record::{Counts, Record};

/// Runs a plan with one method. After a failure the sink contains the motion up to there.
pub(crate) fn run<M: SimulationModel>(
    erased_method: &dyn ErasedMethod<M>,
    plan: &mut RunPlan<'_, '_, M>,
    sink: &mut dyn Sink<M>,
) -> (Counts, Result<RunEnd<M::State>, RunFailure>) {
    // The stepper at the start, or where another method has stopped.
    let from = plan.resume_from.map_or(plan.start, |(state, _)| state);
    let method = erased_method.method();
    let y = Phase { q: *from.q(), u: *from.u() };
    let mut stepper = match erased_method.begin(&mut plan.rhs, (from.t(), y), plan.end, plan.options) {
        Ok(stepper) => stepper,
        Err(error) => {
            sink.end_segment(Record::unmoved(from));
            let counts = Counts { evaluations: plan.rhs.evaluations, ..Counts::default() };
            return (counts, Err(RunFailure::of_step::<M>(error).explained(plan, &from, method)));
        }
    };
    let stepper = &mut *stepper;
    // The loop.
    let started = if plan.resume_from.is_some() { Ok(()) } else { treat_singular_start(plan, stepper) };
    plan.rhs.stabilization.is_under_way = true;
    let result = started.map_err(RunFailure::here).and_then(|()| {
        let monitors = Monitor::begin(&mut Watched { plan, stepper }, method);
        RunState { plan, stepper, monitors }.execute(sink)
    });
    let result = result.map_err(|failure| {
        let StepNode { t, y, .. } = stepper.now();
        failure.explained(plan, &plan.rhs.state(*t, &y.q, &y.u), method)
    });
    // Counts and the last record.
    let StepStatistics { accepted, rejected, stiff_at, slides_at, .. } = stepper.statistics();
    let counts = Counts {
        steps: accepted,
        rejected,
        evaluations: plan.rhs.evaluations,
        wall_time: None,
        stiff_at,
        slides_at,
        subdivided_steps: stepper.subdivided_steps(),
    };
    // After a change of method, the next record is that of the new method.
    if !matches!(result, Ok(RunEnd::Stiff(_))) {
        sink.end_segment(Record::new(stepper.now(), plan.rhs.held_inputs, plan.rhs.active_set));
    }
    (counts, result)
}

/// Replaces the accelerations of a singular start by those of the branch along which its velocities point.
fn treat_singular_start<'m, M: SimulationModel>(
    plan: &mut RunPlan<'_, 'm, M>,
    stepper: &mut dyn ErasedStepper<M>,
) -> Result<(), Kind> {
    if M::IS_UNCONSTRAINED {
        return Ok(());
    }
    let rhs = &mut plan.rhs;
    if rhs.stabilization.counts.dependent == 0 {
        return Ok(());
    }
    let now = stepper.now();
    let (start, found) = (rhs.state(now.t, &now.y.q, &now.y.u), now.a);
    if let Some(a) = rhs.stabilization.singular_start(rhs.model, rhs.constants, &start, &found)? {
        let Tolerances { absolute, relative } = plan.options.tolerances;
        stepper.set_accelerations(a, time_until_determined(&start, absolute + relative));
    }
    Ok(())
}

/// A run between its steps, compiled once for all methods.
struct RunState<'f, 'r, 'm, M: SimulationModel> {
    plan: &'f mut RunPlan<'r, 'm, M>,
    stepper: &'f mut dyn ErasedStepper<M>,
    monitors: Monitors<M>,
}

impl<'r, 'm, M: SimulationModel> RunState<'_, 'r, 'm, M> {
    /// Runs to the end. Monitors add to an error what they found of its reason.
    fn execute(mut self, sink: &mut dyn Sink<M>) -> Result<RunEnd<M::State>, RunFailure> {
        let result = self.step_to_end(sink);
        result.map_err(|mut failure| {
            let (monitors, mut watched) = self.watched();
            monitors.explain(&mut watched, &mut failure.kind);
            failure
        })
    }

    /// Makes steps up to the end, or to where the motion ends earlier.
    fn step_to_end(&mut self, sink: &mut dyn Sink<M>) -> Result<RunEnd<M::State>, RunFailure> {
        if self.plan.resume_from.is_none() {
            self.begin_motion(sink)?;
        }
        loop {
            let statistics = self.stepper.statistics();
            if statistics.t == self.plan.end {
                return Ok(RunEnd::Finished);
            }
            // A step of the method, ended before a corner of a unilateral constraint.
            self.before_step(&statistics)?;
            let mut step = self.advance()?;
            let corner = self.end_before_corner(&mut step)?;
            // Record it, up to the first event with an action, or up to where a monitor objects.
            let flow = match self.after_attempt(&step) {
                Ok(()) => self.accept(sink, step)?,
                Err(objection) => match self.accept_valid_part(sink, &step, objection)? {
                    Flow::Continue => continue,
                    Flow::Stop => return Ok(RunEnd::Finished),
                },
            };
            let flow = match corner {
                // No event before the corner had an action.
                Some(after) if flow == Flow::Continue && self.stepper.now().t == step.end.t => {
                    self.pass_corner(sink, after, step.h)?
                }
                _ => flow,
            };
            // Continue, stop, or change the method.
            let ends = flow == Flow::Stop || self.stepper.now().t == self.plan.end;
            let advice = self.after_step(sink, ends)?;
            if flow == Flow::Stop {
                return Ok(RunEnd::Finished);
            }
            if advice == Advice::ChangeMethod {
                return Ok(RunEnd::Stiff(self.current_state()));
            }
        }
    }

    /// Treats unilateral constraints at the start: a contact that would have to pull lifts off there,
    /// sticking that would break away slips.
    fn begin_motion(&mut self, sink: &mut dyn Sink<M>) -> Result<(), RunFailure> {
        let start = self.current_state();
        self.plan.locator.start_at(&start).map_err(RunFailure::here)?;
        let (mut after, mut events) = (start, Vec::new());
        self.switch_untenable(&mut after, &mut events).map_err(RunFailure::here)?;
        if !events.is_empty() {
            self.restart_from(sink, &start, &after)?;
            events.into_iter().for_each(|event| sink.event(event));
            let resumed = self.current_state();
            self.plan.locator.start_at(&resumed).map_err(RunFailure::here)?;
        }
        self.find_rest_in_corner().map_or(Ok(()), |kind| Err(RunFailure::here(kind)))
    }

    /// The state that the run has reached.
    fn current_state(&self) -> M::State {
        let StepNode { t, y, .. } = self.stepper.now();
        self.plan.rhs.state(*t, &y.q, &y.u)
    }

    /// Records a step, up to the first event that calls for an action.
    fn accept(&mut self, sink: &mut dyn Sink<M>, step: Step<M::Vector>) -> Result<Flow, RunFailure> {
        if !self.plan.locator.is_empty() {
            return self.step_with_events(sink, step);
        }
        self.before_record(sink, &step)?;
        self.record(sink, &step).map_err(RunFailure::here)
    }

    /// Records the valid part of a step to which a monitor objects. If an event calls for an action in that
    /// part the motion continues from there, else it ends with the objection.
    #[cold]
    fn accept_valid_part(
        &mut self,
        sink: &mut dyn Sink<M>,
        step: &Step<M::Vector>,
        Objection { kind, valid }: Objection,
    ) -> Result<Flow, RunFailure> {
        let failure = RunFailure { kind, h: step.h };
        let Some(part) = self.valid_part(step, valid) else { return Err(failure) };
        if valid == Valid::Whole {
            // Without its events, as the constraints may not hold in it. The objection remains the error even
            // where the sink cannot take the step.
            let _ = self.record(sink, &part);
            return Err(failure);
        }
        let flow = self.accept(sink, part)?;
        let acted = flow == Flow::Stop || self.stepper.now().t != part.end.t;
        if acted { Ok(flow) } else { Err(failure) }
    }

    /// The valid part of a step, made again by the method. The step is undone where there is none.
    #[cold]
    fn valid_part(&mut self, step: &Step<M::Vector>, valid: Valid) -> Option<Step<M::Vector>> {
        let theta = match valid {
            Valid::Whole => return Some(*step),
            Valid::UpTo(theta) => theta,
            Valid::Nothing => 0.0,
        };
        let end_t = step.start.t + theta * step.h;
        let part = if theta == 0.0 || end_t == step.start.t {
            None
        } else {
            self.stepper.shorten(&mut self.plan.rhs, step, end_t).ok()
        };
        if part.is_none() {
            // The motion in the sink ends where the step starts.
            self.stepper.undo(step);
        }
        part
    }

    /// Gives a finished step to the sink, with an interpolant that is made where the sink asks for it.
    fn record(&mut self, sink: &mut dyn Sink<M>, step: &Step<M::Vector>) -> Result<Flow, Kind> {
        let RunPlan { rhs, options: StepOptions { tolerances, .. }, .. } = &mut *self.plan;
        let from = Record::of(
            step,
            rhs.held_inputs,
            rhs.active_set,
            (rhs.stabilization.mean_sensitivity, rhs.stabilization.correction_time()),
        );
        let to = rhs.state(step.end.t, &step.end.y.q, &step.end.y.u);
        let (mut dense, mut step) = (None, *step);
        let flow = sink.step(from, &to, &mut |theta| {
            if dense.is_none() {
                let built = self.stepper.dense(rhs, &step, true).map_err(evaluation::<M>)?;
                step.flags.between = rhs.projects_between(&*built, &step, tolerances);
                dense = Some(built);
            }
            let dense = dense.as_deref().expect("built just above");
            Ok(rhs.state_within(dense, &step, tolerances, theta))
        });
        self.plan.rhs.stabilization.update_mean_sensitivity();
        flow
    }

    /// The monitors, and the run as they see it.
    #[inline(always)]
    fn watched(&mut self) -> (&mut Monitors<M>, Watched<'_, 'r, 'm, M>) {
        (&mut self.monitors, Watched { plan: self.plan, stepper: self.stepper })
    }

    /// Asks the monitors before a step.
    #[inline]
    fn before_step(&mut self, statistics: &StepStatistics) -> Result<(), RunFailure> {
        let (monitors, mut watched) = self.watched();
        let answer = monitors.before_step(&mut watched, statistics);
        answer.map_err(|kind| RunFailure { kind, h: statistics.proposed })
    }

    /// Asks the monitors about a step as the method made it.
    #[inline]
    fn after_attempt(&mut self, step: &Step<M::Vector>) -> Result<(), Objection> {
        let (monitors, mut watched) = self.watched();
        monitors.after_attempt(&mut watched, step)
    }

    /// Asks the monitors about a step that is to be recorded. If one objects, its valid part is recorded and
    /// the motion ends.
    #[inline]
    fn before_record(&mut self, sink: &mut dyn Sink<M>, step: &Step<M::Vector>) -> Result<(), RunFailure> {
        let (monitors, mut watched) = self.watched();
        let Err(Objection { kind, valid }) = monitors.before_record(&mut watched, step) else {
            return Ok(());
        };
        if let Some(part) = self.valid_part(step, valid) {
            self.record(sink, &part).map_err(|kind| RunFailure { kind, h: step.h })?;
        }
        Err(RunFailure { kind, h: step.h })
    }

    /// Asks the monitors about a step that was recorded. `ends`: the motion ends here, or continues from
    /// another state.
    #[inline]
    fn after_step(&mut self, sink: &mut dyn Sink<M>, ends: bool) -> Result<Advice, RunFailure> {
        let (monitors, mut watched) = self.watched();
        monitors.after_step(&mut watched, ends).map_err(|Retreat { kind, to }| {
            let h = self.stepper.statistics().proposed;
            self.stepper.roll_back(&to);
            sink.truncate(to.t);
            RunFailure { kind, h }
        })
    }

    /// Undoes a step that is not in the sink, and returns the failure.
    fn undo_step(&mut self, step: &Step<M::Vector>, failure: RunFailure) -> RunFailure {
        self.stepper.undo(step);
        failure
    }
}

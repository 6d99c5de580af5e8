//! The loop of a run: step, look for events, record.
//!
//! What watches it are the [`monitors`]. This file knows that there are some, and none of them.

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
use crate::model::{Known, ModelState, SimulationModel};
use crate::simulate::erased_method::ErasedMethod;
use crate::simulate::erased_method::stepping::{ErasedStepper, StepStatistics};
use crate::simulate::events::location::Flow;
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::simulate::run::failure::{RunFailure, evaluation};
use crate::simulate::run::monitor::{Advice, Monitor, Objection, Retreat, Valid, Watched};
use crate::simulate::run::monitors::Monitors;
use crate::simulate::run::plan::{RunEnd, RunPlan};
use crate::simulate::run::sinks::Sink;
use crate::simulate::stabilization::singular_start::least_distance;
use crate::simulate::trajectory::record::{Counts, Record};

/// Runs a plan with one method. What was computed before a failure is in the sink.
pub(crate) fn run<M: SimulationModel>(
    erased_method: &dyn ErasedMethod<M>,
    plan: &mut RunPlan<'_, '_, M>,
    sink: &mut dyn Sink<M>,
) -> (Counts, Result<RunEnd<M::State>, RunFailure>) {
    let from = plan.resumes.map_or(plan.start, |(state, _)| state);
    let method = erased_method.method();
    let y = Phase { q: *from.q(), u: *from.u() };
    let mut stepper = match erased_method.begin(&mut plan.rhs, (from.t(), y), plan.end, plan.options) {
        Ok(stepper) => stepper,
        Err(error) => {
            sink.stand(Record::unmoved(from));
            let counts = Counts { evaluations: plan.rhs.evaluations, ..Counts::default() };
            return (counts, Err(RunFailure::of_step::<M>(error).explained(plan, &from, method)));
        }
    };
    let stepper = &mut *stepper;
    let begun = if plan.resumes.is_some() { Ok(()) } else { begin_singular(plan, stepper) };
    plan.rhs.stabilization.under_way = true;
    let result = begun.map_err(RunFailure::here).and_then(|()| {
        let monitors = Monitor::begin(&mut Watched { plan, stepper }, method);
        RunState { plan, stepper, monitors }.execute(sink)
    });
    let result = result.map_err(|failure| {
        let StepNode { t, y, .. } = stepper.now();
        failure.explained(plan, &plan.rhs.state(*t, &y.q, &y.u), method)
    });
    let StepStatistics { accepted, rejected, stiff_at, slides_at, .. } = stepper.statistics();
    let counts = Counts {
        steps: accepted,
        rejected,
        evaluations: plan.rhs.evaluations,
        wall_time: None,
        stiff_at,
        slides_at,
        parted: stepper.parted(),
    };
    // The next record is made by the method that goes on.
    if !matches!(result, Ok(RunEnd::Stiff(_))) {
        sink.stand(Record::new(stepper.now(), plan.rhs.held, plan.rhs.modes));
    }
    (counts, result)
}

/// At a singular start the accelerations are those of the branch on which the velocities are.
fn begin_singular<'m, M: SimulationModel>(
    plan: &mut RunPlan<'_, 'm, M>,
    stepper: &mut dyn ErasedStepper<M>,
) -> Result<(), Kind> {
    if M::IS_FREE {
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
        stepper.leave_with(a, least_distance(&start, absolute + relative));
    }
    Ok(())
}

/// What a run does beside its steps, compiled once for all methods.
struct RunState<'f, 'r, 'm, M: SimulationModel> {
    plan: &'f mut RunPlan<'r, 'm, M>,
    stepper: &'f mut dyn ErasedStepper<M>,
    monitors: Monitors<M>,
}

impl<'r, 'm, M: SimulationModel> RunState<'_, 'r, 'm, M> {
    fn execute(mut self, sink: &mut dyn Sink<M>) -> Result<RunEnd<M::State>, RunFailure> {
        let result = self.steps(sink);
        result.map_err(|mut failure| {
            let (monitors, mut watched) = self.watched();
            monitors.explain(&mut watched, &mut failure.kind);
            failure
        })
    }

    /// One step after another, up to the end or where something ends the motion.
    fn steps(&mut self, sink: &mut dyn Sink<M>) -> Result<RunEnd<M::State>, RunFailure> {
        if self.plan.resumes.is_none() {
            self.begin(sink)?;
        }
        loop {
            let statistics = self.stepper.statistics();
            if statistics.t == self.plan.end {
                return Ok(RunEnd::Arrived);
            }
            self.before_step(&statistics)?;
            let mut step = self.advance()?;
            let corner = self.end_before_corner(&mut step)?;
            let flow = match self.after_attempt(&step) {
                Ok(()) => self.accept(sink, step)?,
                Err(objection) => match self.accept_part(sink, &step, objection)? {
                    Flow::Continue => continue,
                    Flow::Stop => return Ok(RunEnd::Arrived),
                },
            };
            let flow = match corner {
                // No event before it has acted.
                Some(after) if flow == Flow::Continue && self.stepper.now().t == step.end.t => {
                    self.turn_corner(sink, after, step.h)?
                }
                _ => flow,
            };
            let ends = flow == Flow::Stop || self.stepper.now().t == self.plan.end;
            let advice = self.after_step(sink, ends)?;
            if flow == Flow::Stop {
                return Ok(RunEnd::Arrived);
            }
            if advice == Advice::ChangeMethod {
                return Ok(RunEnd::Stiff(self.now()));
            }
        }
    }

    /// Looks at the start: a contact that would have to pull lifts off there, what sticks and would break
    /// away slips.
    fn begin(&mut self, sink: &mut dyn Sink<M>) -> Result<(), RunFailure> {
        let start = self.now();
        self.plan.locator.begin(&start).map_err(RunFailure::here)?;
        let (mut after, mut events) = (start, Vec::new());
        self.switch_back(&mut after, &mut events).map_err(RunFailure::here)?;
        if !events.is_empty() {
            self.go_on_from(sink, &start, &after)?;
            events.into_iter().for_each(|event| sink.event(event));
            let resumed = self.now();
            self.plan.locator.begin(&resumed).map_err(RunFailure::here)?;
        }
        self.rests_in_corner().map_or(Ok(()), |kind| Err(RunFailure::here(kind)))
    }

    /// The state in which it stands.
    fn now(&self) -> M::State {
        let StepNode { t, y, .. } = self.stepper.now();
        self.plan.rhs.state(*t, &y.q, &y.u)
    }

    /// Takes a step into the motion, up to the first event that acts.
    fn accept(&mut self, sink: &mut dyn Sink<M>, step: Step<M::Vector>) -> Result<Flow, RunFailure> {
        if !self.plan.locator.is_empty() {
            return self.step_with_events(sink, step);
        }
        self.before_record(sink, &step)?;
        self.record(sink, &step).map_err(RunFailure::here)
    }

    /// Takes what is valid of a step that a monitor objects to. The motion goes on where an event acts in
    /// that part, and else ends with the objection.
    #[cold]
    fn accept_part(
        &mut self,
        sink: &mut dyn Sink<M>,
        step: &Step<M::Vector>,
        Objection { kind, valid }: Objection,
    ) -> Result<Flow, RunFailure> {
        let failure = RunFailure { kind, h: step.h };
        let Some(part) = self.valid_part(step, valid) else { return Err(failure) };
        let flow = self.accept(sink, part)?;
        let acted = flow == Flow::Stop || self.stepper.now().t != part.end.t;
        if acted { Ok(flow) } else { Err(failure) }
    }

    /// The part of a step that is valid, made by the method; the step is undone where there is none.
    #[cold]
    fn valid_part(&mut self, step: &Step<M::Vector>, valid: Valid) -> Option<Step<M::Vector>> {
        let theta = match valid {
            Valid::Whole => return None,
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
            // What the sink gets ends where the step begins.
            self.stepper.undo(step);
        }
        part
    }

    /// Gives a finished step to the sink.
    fn record(&mut self, sink: &mut dyn Sink<M>, step: &Step<M::Vector>) -> Result<Flow, Kind> {
        let RunPlan { rhs, options: StepOptions { tolerances, .. }, .. } = &mut *self.plan;
        let from = Record::of(step, rhs.held, rhs.modes, (rhs.stabilization.usual, rhs.stabilization.pace()));
        let to = rhs.state(step.end.t, &step.end.y.q, &step.end.y.u);
        let (mut dense, mut step) = (None, *step);
        let flow = sink.step(from, &to, &mut |theta| {
            if dense.is_none() {
                let built = self.stepper.dense(rhs, &step, true).map_err(evaluation::<M>)?;
                step.kept.between = rhs.projects_between(&*built, &step, tolerances);
                dense = Some(built);
            }
            let dense = dense.as_deref().expect("built just above");
            Ok(rhs.within(dense, &step, tolerances, theta))
        });
        self.plan.rhs.stabilization.learn();
        flow
    }

    /// The monitors, and what they see.
    #[inline(always)]
    fn watched(&mut self) -> (&mut Monitors<M>, Watched<'_, 'r, 'm, M>) {
        (&mut self.monitors, Watched { plan: self.plan, stepper: self.stepper })
    }

    #[inline]
    fn before_step(&mut self, statistics: &StepStatistics) -> Result<(), RunFailure> {
        let (monitors, mut watched) = self.watched();
        let asked = monitors.before_step(&mut watched, statistics);
        asked.map_err(|kind| RunFailure { kind, h: statistics.proposed })
    }

    #[inline]
    fn after_attempt(&mut self, step: &Step<M::Vector>) -> Result<(), Objection> {
        let (monitors, mut watched) = self.watched();
        monitors.after_attempt(&mut watched, step)
    }

    /// Asks the monitors about a step that is going to be recorded. Where one objects, what is valid of the
    /// step is recorded, and the motion ends there.
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

    /// Asks the monitors about a step that was recorded. `ends`: the motion ends here, or goes on from
    /// another state.
    #[inline]
    fn after_step(&mut self, sink: &mut dyn Sink<M>, ends: bool) -> Result<Advice, RunFailure> {
        let (monitors, mut watched) = self.watched();
        monitors.after_step(&mut watched, ends).map_err(|Retreat { kind, to }| {
            let h = self.stepper.statistics().proposed;
            self.stepper.go_back(&to);
            sink.go_back(to.t);
            RunFailure { kind, h }
        })
    }

    /// Takes back a step that the sink has not seen: what it got ends where the step begins.
    fn take_back(&mut self, step: &Step<M::Vector>, failure: RunFailure) -> RunFailure {
        self.stepper.undo(step);
        failure
    }
}

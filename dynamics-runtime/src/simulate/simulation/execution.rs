//! Running a simulation.

use crate::constrain::gradients::{is_positive, mass};
use crate::constrain::solve_general;
use crate::error::{SingularMassMatrix, SolveError};
use crate::integrate::StepOptions;
use crate::integrate::choice::Radau5;
use crate::model::{Branches, Known, ModelState, SimulationModel, Vector};
use crate::progress::Progress;
use crate::simulate::diagnosis;
use crate::simulate::erased_method::SharedMethod;
use crate::simulate::events::location::{EventLocator, Flow};
use crate::simulate::events::unilateral::UnilateralConstraint;
use crate::simulate::failure::{OptionError, SimulationErrorKind};
use crate::simulate::options::formulation::Formulation;
use crate::simulate::pilot_run::PilotRun;
use crate::simulate::right_hand_side::{InputLaw, RightHandSide, with_inputs};
use crate::simulate::run::failure::RunFailure;
use crate::simulate::run::plan::{RunEnd, RunPlan};
use crate::simulate::run::run;
use crate::simulate::run::sinks::{ObserverSink, RecordingSink, Sink};
use crate::simulate::simulation::Simulation;
use crate::simulate::simulation::check::Checked;
use crate::simulate::stabilization::{ContactHistory, PlaceError, Stabilization, StabilizationCounts};
use crate::simulate::trajectory::error::SimulationError;
use crate::simulate::trajectory::global_error::ReferenceSettings;
use crate::simulate::trajectory::motion::Motion;
use crate::simulate::trajectory::record::{Counts, Record, Trajectory};
use crate::simulate::verification::global_error::{between, compare};
use crate::simulate::verification::reference_run::{ReferenceRun, ReferenceSink, comparison_times};
use alloc::boxed::Box;
use alloc::string::ToString;
use alloc::sync::Arc;
use alloc::vec;
use alloc::vec::Vec;

impl<'m, M: SimulationModel> Simulation<'m, M> {
    /// Runs the simulation and keeps its motion.
    pub fn run(mut self) -> Result<Motion<'m, M>, SimulationError<M>> {
        let checked = self.check()?;
        let room = self.place(&checked)?;
        let mut keep = RecordingSink { records: Vec::new(), events: Vec::new() };
        let (run, result) = self.execute(checked, room, &mut keep)?;
        let trajectory = Trajectory { records: keep.records, events: keep.events, ..run.trajectory };
        if let Err(halt) = result {
            return Err(broken_off(halt, trajectory));
        }
        let mut motion = Motion::new(run.model, run.constants, run.law, trajectory);
        if let (Some(mut second), Some(erased_method)) = (run.second, &motion.trajectory.erased_method) {
            let mut error = compare(&motion.trajectory, &mut second, erased_method.method().order());
            error.between = error.ratio.map(|_| between(&motion, &second.middles));
            motion.trajectory.error = Some(Arc::new(error));
        }
        Ok(motion)
    }

    /// Runs the simulation and keeps nothing: shows every accepted state, or the states at the output times
    /// where such are given, to `observer`, which may end it. Returns the last state.
    pub fn run_with<R: Into<Flow>>(
        mut self,
        mut observer: impl FnMut(&M::State) -> R,
    ) -> Result<M::State, SimulationError<M>> {
        if self.estimates {
            return Err(self.refused(OptionError::NothingToCompare.into()));
        }
        let checked = self.check()?;
        let room = self.place(&checked)?;
        let mut observer = |state: &M::State| observer(state).into();
        let start = self.start;
        let times = checked.output_times.clone();
        // The start is shown here, as often as it is asked for; the run itself shows what its steps reach.
        let at_start =
            times.as_ref().map_or(1, |times| times.iter().take_while(|t| **t == start.t()).count());
        let first = with_inputs::<M>(self.law.as_ref(), start);
        for _ in 0..at_start {
            if observer(&first) == Flow::Stop {
                return Ok(first);
            }
        }
        let mut times = times.map(|mut times| times.split_off(at_start).into_iter());
        let next = times.as_mut().and_then(Iterator::next);
        let mut show = ObserverSink { observer: &mut observer, times, next, last: None };
        let (run, result) = self.execute(checked, room, &mut show)?;
        let last = show.last.unwrap_or_else(|| Record::unmoved(start));
        match result {
            Ok(()) => Ok(with_inputs::<M>(run.law.as_ref(), last.state)),
            Err(halt) => Err(broken_off(halt, Trajectory { records: vec![last], ..run.trajectory })),
        }
    }

    /// Runs into a sink, with the options checked.
    fn execute(
        mut self,
        checked: Checked<'m, M>,
        mut room: Vec<f64>,
        sink: &mut dyn Sink<M>,
    ) -> Result<RunResult<'m, M>, SimulationError<M>> {
        let constants = self.constants()?;
        self.check_inertia(&mut room)?;
        let (law, added_events) = (self.law.take(), core::mem::take(&mut self.added_events));
        let (erased_method, reason) = checked.method;
        let setup = RunSetup {
            simulation: &self,
            constants: &constants,
            law: law.as_ref(),
            formulation: checked.formulation.as_ref().map(|(formulation, _)| *formulation),
            contacts: checked.unilaterals.iter().filter_map(UnilateralConstraint::closing::<M>).collect(),
            end: checked.end,
        };
        let mut options = checked.options;
        let piloted = if checked.by_size { setup.pilot(&erased_method, &mut options) } else { None };
        let mut plan = RunPlan {
            locator: EventLocator::new(
                self.model,
                constants,
                added_events,
                checked.unilaterals,
                checked.rules,
            ),
            progress: self.progress_to(checked.end),
            hands_over: checked.hands_over,
            ..setup.plan(setup.right_hand_side(room), options)
        };
        let (mut counts, relay, result) = run_method(&erased_method, &mut plan, sink);
        let (mut stabilization, kept) = (plan.rhs.stabilization.counts, plan.locator.kept());
        if let Some((evaluations, before)) = piloted {
            counts.evaluations += evaluations;
            stabilization.add_evaluations(&before);
        }
        let second = (self.estimates && result.is_ok()).then(|| {
            setup.reference(&erased_method, &mut plan, (options, checked.hands_over), &sink.times())
        });
        let trajectory = Trajectory {
            erased_method: Some(erased_method),
            relay,
            reason,
            tolerances: options.tolerances,
            records: Vec::new(),
            output_times: checked.output_times,
            events: Vec::new(),
            counts,
            has_law: law.is_some(),
            formulation: checked.formulation,
            stabilization,
            kept,
            consistent: self.consistent,
            error: None,
            fixed: options.fixed.is_some(),
        };
        drop(plan);
        Ok((FinishedRun { model: self.model, constants, law, trajectory, second }, result))
    }

    #[cfg(feature = "progress")]
    fn progress_to(&self, end: f64) -> Progress {
        if self.progress { Progress::new(self.start.t(), end) } else { Progress::none() }
    }

    #[cfg(not(feature = "progress"))]
    fn progress_to(&self, _: f64) -> Progress {
        Progress::none()
    }

    fn constants(&self) -> Result<M::Constants, SimulationError<M>> {
        let constants = self.model.constants();
        constants.map_err(|error| {
            let kind = SimulationErrorKind::SingularMassMatrix(error);
            self.refused(diagnosis::explain_singular_mass_matrix(
                self.model,
                &with_inputs::<M>(self.law.as_ref(), self.start),
                kind,
            ))
        })
    }

    /// Refuses negative inertia at the start: generated code that eliminates constraints does not see the
    /// sign of what it divides by.
    fn check_inertia(&self, room: &mut [f64]) -> Result<(), SimulationError<M>> {
        if !M::KINETIC || M::IS_FREE {
            return Ok(());
        }
        let start = with_inputs::<M>(self.law.as_ref(), self.start);
        if is_positive(self.model, &start, room) {
            return Ok(());
        }
        match solve_general(self.model, &start, room).err() {
            Some(SolveError::SingularMassMatrix(error)) if error.negative => {
                Err(self.refused(SimulationErrorKind::SingularMassMatrix(error)))
            }
            // Where squares of it overflow, no solution shows the sign.
            Some(_) => huge_and_negative(self.model, &start, room)
                .map_or(Ok(()), |error| Err(self.refused(SimulationErrorKind::SingularMassMatrix(error)))),
            None => Ok(()),
        }
    }

    fn refused(&self, kind: SimulationErrorKind) -> SimulationError<M> {
        let start = self.start;
        SimulationError { kind, time: start.t(), step: 0.0, state: Box::new(start), trajectory: None }
    }

    /// Puts the start onto the constraints, once it is known to lie there to within what was typed. The
    /// memory that this took is there for the run.
    fn place(&mut self, checked: &Checked<'m, M>) -> Result<Vec<f64>, SimulationError<M>> {
        let formulation = checked.formulation.as_ref().map(|(formulation, _)| *formulation);
        // Constraints may contain inputs; what is held stays what it was.
        let (mut start, held) = (with_inputs::<M>(self.law.as_ref(), self.start), *self.start.inputs());
        let run = (self.start.t(), checked.end);
        let mut stabilization = Stabilization::new(formulation, self.drift_limit, self.constants()?, run);
        for unilateral in &checked.unilaterals {
            unilateral.turn(start.modes(), self.model, &mut start, &mut stabilization);
        }
        match stabilization.begin(self.model, &mut start) {
            Ok(()) => {
                *start.inputs_mut() = held;
                self.start = start;
            }
            Err(PlaceError::State(error)) => {
                return Err(self.refused(SimulationErrorKind::Start(Box::new(error))));
            }
            Err(PlaceError::Solve(error)) => return Err(self.refused(error.into())),
        }
        Ok(stabilization.into_memory())
    }

    fn check(&mut self) -> Result<Checked<'m, M>, SimulationError<M>> {
        self.check_options().map_err(|error| self.refused(error.into()))
    }
}

/// What the runs of a simulation have in common: the pilot run, the run itself, and the reference run.
struct RunSetup<'r, 'm, M: SimulationModel> {
    simulation: &'r Simulation<'m, M>,
    constants: &'r M::Constants,
    law: Option<&'r InputLaw<'m, M>>,
    formulation: Option<Formulation>,
    contacts: Vec<ContactHistory>,
    end: f64,
}

impl<'r, 'm, M: SimulationModel> RunSetup<'r, 'm, M> {
    /// At the start, with memory that was used before.
    fn right_hand_side(&self, room: Vec<f64>) -> RightHandSide<'r, 'm, M> {
        let Simulation { model, start, drift_limit, .. } = self.simulation;
        let interval = (start.t(), self.end);
        let mut stabilization =
            Stabilization::within(self.formulation, *drift_limit, *self.constants, interval, room);
        stabilization.contacts.clone_from(&self.contacts);
        RightHandSide {
            model,
            constants: self.constants,
            law: self.law,
            held: *start.inputs(),
            modes: start.modes(),
            evaluations: 0,
            branches: Branches::FREE,
            known: Branches::FREE,
            memory: None,
            listener: None,
            stabilization,
        }
    }

    /// A run without events that shows no progress and keeps its method.
    fn plan(&self, rhs: RightHandSide<'r, 'm, M>, options: StepOptions) -> RunPlan<'r, 'm, M> {
        let Simulation { model, start, most_steps, cancel, .. } = self.simulation;
        RunPlan {
            rhs,
            start: *start,
            end: self.end,
            options,
            most_steps: *most_steps,
            cancel: *cancel,
            locator: EventLocator::new(model, *self.constants, Vec::new(), Vec::new(), Vec::new()),
            progress: Progress::none(),
            hands_over: false,
            resumes: None,
        }
    }

    /// Runs ahead where the size of the motion decides the absolute tolerance, and gives the options that.
    /// What it took is told.
    fn pilot(
        &self,
        erased_method: &SharedMethod<M>,
        options: &mut StepOptions,
    ) -> Option<(u64, StabilizationCounts)> {
        let start = &self.simulation.start;
        let mut pilot = PilotRun::of(&mut self.right_hand_side(Vec::new()), start)?;
        let mut plan = self.plan(self.right_hand_side(Vec::new()), *options);
        // What ends it early ends the run itself, too, or has been put right there by an event.
        let (counts, _) = run(&**erased_method, &mut plan, &mut pilot);
        let absolute = &mut options.tolerances.absolute;
        *absolute = pilot.absolute(&mut self.right_hand_side(Vec::new()), *absolute);
        Some((counts.evaluations, plan.rhs.stabilization.counts))
    }

    /// Runs once more with settings that tell the error of the run at these times.
    fn reference(
        &self,
        erased_method: &SharedMethod<M>,
        plan: &mut RunPlan<'r, 'm, M>,
        (options, hands_over): (StepOptions, bool),
        times: &[f64],
    ) -> ReferenceRun<M> {
        let settings = ReferenceSettings::of(&options, erased_method.method());
        plan.restart(self.right_hand_side(Vec::new()), settings.options(options), hands_over);
        plan.most_steps = self.simulation.most_steps.saturating_mul(ReferenceSettings::MORE_STEPS);
        let (times, is_middle) = comparison_times(times, options.fixed.is_some());
        let mut probe = ReferenceSink::at(times);
        let (counts, _, result) = run_method(erased_method, plan, &mut probe);
        let broken_off = result.err().map(|failure| (probe.reached, failure.kind.to_string()));
        let (mut states, mut middles) = (Vec::new(), Vec::new());
        for (state, is_middle) in probe.states.into_iter().zip(is_middle) {
            if is_middle { &mut middles } else { &mut states }.push(state);
        }
        ReferenceRun { run: settings, states, middles, events: probe.events, counts, broken_off }
    }
}

/// The first coordinate whose inertia is negative, of a size whose square is beyond all numbers.
fn huge_and_negative<M: SimulationModel>(
    model: &M,
    state: &M::State,
    room: &mut [f64],
) -> Option<SingularMassMatrix> {
    let mass = mass(model, state, room);
    let own = |i: usize| mass[i * (M::Vector::LEN + 1)];
    let coordinate = (0..M::Vector::LEN).find(|&i| own(i) < 0.0 && (own(i) * own(i)).is_infinite())?;
    let (name, pivot) = (M::COORDINATES[coordinate].name, own(coordinate));
    Some(SingularMassMatrix { coordinate, name, pivot, negative: true })
}

/// Counts, when which method took over, how it ended.
type RunOutcome<M> = (Counts, Option<(f64, SharedMethod<M>)>, Result<(), RunFailure>);

/// Runs a plan to its end; over to an implicit method where it is stiff. From when and with which is told.
fn run_method<M: SimulationModel>(
    erased_method: &SharedMethod<M>,
    plan: &mut RunPlan<'_, '_, M>,
    sink: &mut dyn Sink<M>,
) -> RunOutcome<M> {
    #[cfg(feature = "std")]
    let (begun, _watch) = (std::time::Instant::now(), crate::slow_build::SlowBuildNote::start());
    #[allow(unused_mut, reason = "without `std` there is no clock to set it by")]
    let (mut counts, mut result) = run(&**erased_method, plan, sink);
    let mut relay = None;
    if let Ok(RunEnd::Stiff(state)) = &result {
        let implicit: SharedMethod<M> = Arc::new(Radau5);
        relay = Some((state.t(), Arc::clone(&implicit)));
        (counts, result) = resume(&implicit, plan, *state, &counts, sink);
    }
    #[cfg(feature = "std")]
    {
        counts.wall_time = Some(begun.elapsed());
    }
    (counts, relay, result.map(|_| ()))
}

/// Goes on with another method from where one stopped; counts are those of both.
fn resume<M: SimulationModel>(
    erased_method: &SharedMethod<M>,
    plan: &mut RunPlan<'_, '_, M>,
    state: M::State,
    before: &Counts,
    sink: &mut dyn Sink<M>,
) -> (Counts, Result<RunEnd<M::State>, RunFailure>) {
    plan.resumes = Some((state, before.steps + before.rejected));
    plan.hands_over = false;
    // What was asked for the first step is over.
    plan.options.first = None;
    let (after, result) = run(&**erased_method, plan, sink);
    // The right-hand side has counted its evaluations all along.
    let (steps, rejected) = (before.steps + after.steps, before.rejected + after.rejected);
    (
        Counts {
            steps,
            rejected,
            stiff_at: before.stiff_at,
            slides_at: before.slides_at.or(after.slides_at),
            ..after
        },
        result,
    )
}

/// What is left of a simulation that has run; the trajectory's records are in the sink.
struct FinishedRun<'m, M: SimulationModel> {
    model: &'m M,
    constants: M::Constants,
    law: Option<InputLaw<'m, M>>,
    trajectory: Trajectory<M>,
    /// The run that tells its error, where one was asked for.
    second: Option<ReferenceRun<M>>,
}

/// A run with how it ended.
type RunResult<'m, M> = (FinishedRun<'m, M>, Result<(), RunFailure>);

fn broken_off<M: SimulationModel>(halt: RunFailure, trajectory: Trajectory<M>) -> SimulationError<M> {
    let state = trajectory.last().state;
    SimulationError {
        kind: halt.kind,
        time: state.t(),
        step: halt.h,
        state: Box::new(state),
        trajectory: Some(Box::new(trajectory)),
    }
}

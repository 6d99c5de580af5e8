//! Running a simulation: start, pilot run, the run itself and the reference run.
//!
//! 1. `check.rs` checks the options.
//! 2. The start is made consistent with the constraints ([`Stabilization::ensure_consistent_start`]).
//! 3. A pilot run finds the absolute tolerance of small motions (`pilot_run.rs`).
//! 4. [`run_method`] runs the plan with the chosen method (`run.rs`), and with Radau IIA from where the
//!    motion is stiff.
//! 5. Where an estimate of the error was asked for, a reference run repeats it with a tighter tolerance.
//!
//! The results go to a [`Sink`]: records for a [`Motion`], or states for an observer.

use crate::constrain::gradients::{is_positive, mass};
use crate::constrain::solve_general;
use crate::error::{SingularMassMatrix, SolveError};
use crate::integrate::choice::Radau5;
use crate::integrate::{
    Accelerations as _, Method, Step, StepError, StepFlags, StepNode, StepOptions, Tolerances,
};
use crate::model::{ModelState, SimulationModel, StaticTraits, Vector};
use crate::progress::Progress;
use crate::simulate::diagnosis;
use crate::simulate::erased_method::{ErasedMethod, SharedMethod};
use crate::simulate::events::location::EventLocator;
use crate::simulate::events::rules::Flow;
use crate::simulate::events::unilateral::{UnilateralConstraint, UnilateralConstraints};
use crate::simulate::failure::{OptionError, SimulationErrorKind};
use crate::simulate::options::defaults::DEFAULT_TOLERANCE;
use crate::simulate::options::formulation::Formulation;
use crate::simulate::pilot_run::PilotRun;
use crate::simulate::right_hand_side::{InputLaw, RightHandSide, with_inputs};
use crate::simulate::run::failure::RunFailure;
use crate::simulate::run::plan::{RunEnd, RunPlan};
use crate::simulate::run::run;
use crate::simulate::run::sinks::{ObserverSink, RecordingSink, Sink};
use crate::simulate::simulation::Simulation;
use crate::simulate::simulation::check::Checked;
use crate::simulate::stabilization::{ConsistencyError, ContactHistory, Stabilization, StabilizationCounts};
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
        let formulation = checked.formulation.as_ref().map(|(formulation, _)| *formulation);
        let workspace = self.make_start_consistent(formulation, &checked.unilaterals, checked.end)?;
        let mut sink = RecordingSink { records: Vec::new(), events: Vec::new() };
        let (run, result) = self.execute(checked, workspace, &mut sink)?;
        let trajectory = Trajectory { records: sink.records, events: sink.events, ..run.trajectory };
        if let Err(failure) = result {
            return Err(interrupted(failure, trajectory));
        }
        let mut motion = Motion::new(run.model, run.constants, run.law, Arc::new(trajectory));
        if let (Some(mut reference), Some(erased_method)) = (run.reference, &motion.trajectory.erased_method)
        {
            let mut error = compare(&motion.trajectory, &mut reference, erased_method.method().order());
            error.between = error.ratio.map(|_| between(&motion, &reference.middles));
            Arc::make_mut(&mut motion.trajectory).error = Some(Arc::new(error));
        }
        Ok(motion)
    }

    /// Runs the simulation without keeping its motion. `observer` receives every accepted state, or the
    /// states at the output times where such are given, and may end the run. Returns the last state.
    pub fn run_with<R: Into<Flow>>(
        mut self,
        mut observer: impl FnMut(&M::State) -> R,
    ) -> Result<M::State, SimulationError<M>> {
        if self.estimates_error {
            return Err(self.refuse(OptionError::NothingToCompare.into()));
        }
        let checked = self.check()?;
        let formulation = checked.formulation.as_ref().map(|(formulation, _)| *formulation);
        let workspace = self.make_start_consistent(formulation, &checked.unilaterals, checked.end)?;
        let mut observer = |state: &M::State| observer(state).into();
        let start = self.start;
        let times = checked.output_times.clone();
        // The observer receives the start here, once for each output time at it. Steps give the others.
        let outputs_at_start =
            times.as_ref().map_or(1, |times| times.iter().take_while(|t| **t == start.t()).count());
        let first = with_inputs::<M>(self.law.as_ref(), start);
        for _ in 0..outputs_at_start {
            if observer(&first) == Flow::Stop {
                return Ok(first);
            }
        }
        let mut times = times.map(|mut times| times.split_off(outputs_at_start).into_iter());
        let next = times.as_mut().and_then(Iterator::next);
        let mut sink = ObserverSink { observer: &mut observer, times, next, last: None };
        let (run, result) = self.execute(checked, workspace, &mut sink)?;
        let last = sink.last.unwrap_or_else(|| Record::unmoved(start));
        match result {
            Ok(()) => Ok(with_inputs::<M>(run.law.as_ref(), last.state)),
            Err(failure) => Err(interrupted(failure, Trajectory { records: vec![last], ..run.trajectory })),
        }
    }

    /// What [`Simulation::run`] finds before its first step, whatever its method: parameters, the start,
    /// declared contacts and actions, and accelerations at the start.
    ///
    /// # Errors
    /// Those of the run.
    // Public for live pages alone, which bring methods of their own.
    #[doc(hidden)]
    pub fn check_beginning(mut self) -> Result<(), SimulationError<M>> {
        let (formulation, unilaterals) = self.check_declared().map_err(|error| self.refuse(error.into()))?;
        let end = self.end.unwrap_or(f64::INFINITY);
        let mut workspace = self.make_start_consistent(formulation, &unilaterals, end)?;
        let constants = self.constants()?;
        self.check_inertia(&mut workspace)?;
        let contacts = unilaterals.iter().filter_map(UnilateralConstraint::contact_history::<M>).collect();
        let law = self.law.as_ref();
        let setup = RunSetup { simulation: &self, constants: &constants, law, formulation, contacts, end };
        let options = StepOptions {
            tolerances: Tolerances::both(DEFAULT_TOLERANCE),
            fixed: None,
            first: None,
            most: f64::INFINITY,
        };
        let mut plan = setup.plan(setup.right_hand_side(workspace), options);
        let found = accelerations_at_start(&mut plan.rhs, &self.start);
        found.map_err(|failure| self.refuse(failure.explained(&plan, &self.start, Method::Dop853).kind))
    }

    /// The absolute tolerances of all coordinates, then of all velocities, by the size that each unit has in
    /// the first steps. A run takes the smallest of them for all.
    ///
    /// # Errors
    /// Those of [`Simulation::run`] before its first step.
    // Public for functional mock-up units alone, whose states have nominal values.
    #[doc(hidden)]
    pub fn tolerances_by_unit(mut self) -> Result<Vec<f64>, SimulationError<M>> {
        let checked = self.check()?;
        let formulation = checked.formulation.as_ref().map(|(formulation, _)| *formulation);
        self.make_start_consistent(formulation, &checked.unilaterals, checked.end)?;
        let constants = self.constants()?;
        let contacts =
            checked.unilaterals.iter().filter_map(UnilateralConstraint::contact_history::<M>).collect();
        let (law, end) = (self.law.as_ref(), checked.end);
        let setup = RunSetup { simulation: &self, constants: &constants, law, formulation, contacts, end };
        Ok(setup.tolerances_by_unit(&checked.method.0, checked.options))
    }

    /// Runs into a sink, with checked options.
    fn execute(
        mut self,
        checked: Checked<'m, M>,
        mut workspace: Vec<f64>,
        sink: &mut dyn Sink<M>,
    ) -> Result<RunResult<'m, M>, SimulationError<M>> {
        // What depends on parameters, and the start.
        let constants = self.constants()?;
        self.check_inertia(&mut workspace)?;
        let (law, added_events) = (self.law.take(), core::mem::take(&mut self.added_events));
        let (erased_method, reason) = checked.method;
        let setup = RunSetup {
            simulation: &self,
            constants: &constants,
            law: law.as_ref(),
            formulation: checked.formulation.as_ref().map(|(formulation, _)| *formulation),
            contacts: checked
                .unilaterals
                .iter()
                .filter_map(UnilateralConstraint::contact_history::<M>)
                .collect(),
            end: checked.end,
        };
        // The pilot run sets the absolute tolerance; then the run itself.
        let mut options = checked.options;
        let pilot_costs = if checked.scales_with_motion {
            setup.make_pilot_run(&erased_method, &mut options)
        } else {
            None
        };
        let mut plan = RunPlan {
            locator: EventLocator::new(
                self.model,
                constants,
                added_events,
                checked.unilaterals,
                checked.rules,
            ),
            progress: self.progress_to(checked.end),
            may_change_method: checked.may_change_method,
            ..setup.plan(setup.right_hand_side(workspace), options)
        };
        let (mut counts, relay, result) = run_method(&erased_method, &mut plan, sink);
        let (mut stabilization, masked_events) =
            (plan.rhs.stabilization.counts, plan.locator.masked_events());
        if let Some((evaluations, before)) = pilot_costs {
            counts.evaluations += evaluations;
            stabilization.add_evaluations(&before);
        }
        // The reference run, with the same plan from its start.
        let reference = (self.estimates_error && result.is_ok()).then(|| {
            setup.make_reference_run(
                &erased_method,
                &mut plan,
                (options, checked.may_change_method),
                &sink.times(),
            )
        });
        // The trajectory without its records, which are in the sink.
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
            masked_events,
            consistent: self.consistent_output,
            error: None,
            fixed: options.fixed.is_some(),
        };
        drop(plan);
        Ok((FinishedRun { model: self.model, constants, law, trajectory, reference }, result))
    }

    /// Sets the absolute tolerance of the options by a pilot run, where the motion is small.
    pub(super) fn make_pilot_run(
        &self,
        erased_method: &SharedMethod<M>,
        constants: &M::Constants,
        options: &mut StepOptions,
        end: f64,
    ) {
        let setup =
            RunSetup { simulation: self, constants, law: None, formulation: None, contacts: Vec::new(), end };
        setup.make_pilot_run(erased_method, options);
    }

    /// Whether an implicit step of size h from here has a permitted error.
    pub(super) fn implicit_step_passes(
        &self,
        constants: &M::Constants,
        tolerances: &Tolerances,
        now: StepNode<M::Vector>,
        h: f64,
    ) -> bool {
        let end = self.end.unwrap_or(now.t);
        let setup =
            RunSetup { simulation: self, constants, law: None, formulation: None, contacts: Vec::new(), end };
        let step = Step { start: now, end: now, h, flags: StepFlags::default() };
        let mut replay = ErasedMethod::<M>::step_replay(&Radau5);
        let found = replay.end_of(&mut setup.right_hand_side(Vec::new()), &step, tolerances);
        found.is_some_and(|(_, error)| error <= 1.0)
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
            self.refuse(diagnosis::explain_singular_mass_matrix(
                self.model,
                &with_inputs::<M>(self.law.as_ref(), self.start),
                kind,
            ))
        })
    }

    /// Refuses negative inertia at the start: generated code that eliminates constraints does not check the
    /// signs of its pivots.
    fn check_inertia(&self, workspace: &mut [f64]) -> Result<(), SimulationError<M>> {
        if !M::KINETIC || M::IS_UNCONSTRAINED {
            return Ok(());
        }
        let start = with_inputs::<M>(self.law.as_ref(), self.start);
        if is_positive(self.model, &start, workspace) {
            return Ok(());
        }
        match solve_general(self.model, &start, workspace).err() {
            Some(SolveError::SingularMassMatrix(error)) if error.negative => {
                Err(self.refuse(SimulationErrorKind::SingularMassMatrix(error)))
            }
            // Where squares of the inertia overflow, the solution failed for another reason.
            Some(_) => negative_overflowing_inertia(self.model, &start, workspace)
                .map_or(Ok(()), |error| Err(self.refuse(SimulationErrorKind::SingularMassMatrix(error)))),
            None => Ok(()),
        }
    }

    fn refuse(&self, kind: SimulationErrorKind) -> SimulationError<M> {
        let start = self.start;
        SimulationError { kind, time: start.t(), step: 0.0, state: Box::new(start), trajectory: None }
    }

    /// Checks that the start fulfils the constraints, and projects it where the formulation projects. Returns
    /// the workspace, for the run.
    fn make_start_consistent(
        &mut self,
        formulation: Option<Formulation>,
        unilaterals: &UnilateralConstraints,
        end: f64,
    ) -> Result<Vec<f64>, SimulationError<M>> {
        // Constraints may contain inputs: the start is checked with those of the law, and keeps its own.
        let (mut start, held) = (with_inputs::<M>(self.law.as_ref(), self.start), *self.start.inputs());
        let run = (self.start.t(), end);
        let mut stabilization = Stabilization::new(formulation, self.drift_limit, self.constants()?, run);
        for unilateral in unilaterals {
            unilateral.align_slip_side(start.active_set(), self.model, &mut start, &mut stabilization);
        }
        match stabilization.ensure_consistent_start(self.model, &mut start) {
            Ok(()) => {
                *start.inputs_mut() = held;
                self.start = start;
            }
            Err(ConsistencyError::State(error)) => {
                return Err(self.refuse(SimulationErrorKind::Start(Box::new(error))));
            }
            Err(ConsistencyError::Solve(error)) => return Err(self.refuse(error.into())),
        }
        Ok(stabilization.into_workspace())
    }

    fn check(&mut self) -> Result<Checked<'m, M>, SimulationError<M>> {
        self.check_options().map_err(|error| self.refuse(error.into()))
    }
}

/// What the pilot run, the run and the reference run of a simulation have in common.
struct RunSetup<'r, 'm, M: SimulationModel> {
    simulation: &'r Simulation<'m, M>,
    constants: &'r M::Constants,
    law: Option<&'r InputLaw<'m, M>>,
    formulation: Option<Formulation>,
    contacts: Vec<ContactHistory>,
    end: f64,
}

impl<'r, 'm, M: SimulationModel> RunSetup<'r, 'm, M> {
    /// The right-hand side at the start, with a workspace that was used before.
    fn right_hand_side(&self, workspace: Vec<f64>) -> RightHandSide<'r, 'm, M> {
        let Simulation { model, start, drift_limit, .. } = self.simulation;
        let interval = (start.t(), self.end);
        let mut stabilization = Stabilization::with_workspace(
            self.formulation,
            *drift_limit,
            *self.constants,
            interval,
            workspace,
        );
        stabilization.contacts.clone_from(&self.contacts);
        RightHandSide::new(model, self.constants, self.law, start, stabilization)
    }

    /// A run without events, without progress bar and without change of method.
    fn plan(&self, rhs: RightHandSide<'r, 'm, M>, options: StepOptions) -> RunPlan<'r, 'm, M> {
        let Simulation { model, start, max_steps, cancel, cancel_when, .. } = self.simulation;
        RunPlan {
            rhs,
            start: *start,
            end: self.end,
            options,
            max_steps: *max_steps,
            cancel: *cancel,
            cancel_when: cancel_when.as_deref(),
            locator: EventLocator::new(model, *self.constants, Vec::new(), Vec::new(), Vec::new()),
            progress: Progress::none(),
            may_change_method: false,
            resume_from: None,
        }
    }

    /// Makes the pilot run, where the motion is small, and sets the absolute tolerance of the options.
    /// Returns the costs of the pilot run.
    fn make_pilot_run(
        &self,
        erased_method: &SharedMethod<M>,
        options: &mut StepOptions,
    ) -> Option<(u64, StabilizationCounts)> {
        let start = &self.simulation.start;
        let mut pilot = PilotRun::start(&mut self.right_hand_side(Vec::new()), start)?;
        let mut plan = self.plan(self.right_hand_side(Vec::new()), *options);
        // An error of the pilot run is ignored: the run meets it, too, or an event of the run prevents it.
        let (counts, _) = run(&**erased_method, &mut plan, &mut pilot);
        let absolute = &mut options.tolerances.absolute;
        *absolute = pilot.absolute_tolerance(&mut self.right_hand_side(Vec::new()), *absolute);
        Some((counts.evaluations, plan.rhs.stabilization.counts))
    }

    /// Makes the pilot run, where the motion is small, for the absolute tolerances of all units.
    fn tolerances_by_unit(&self, erased_method: &SharedMethod<M>, options: StepOptions) -> Vec<f64> {
        let (start, tolerance) = (&self.simulation.start, options.tolerances.absolute);
        let Some(mut pilot) = PilotRun::start(&mut self.right_hand_side(Vec::new()), start) else {
            return vec![tolerance; 2 * M::Vector::LEN];
        };
        let mut plan = self.plan(self.right_hand_side(Vec::new()), options);
        // Where the motion ends early, its steps until then say what they can.
        let _ = run(&**erased_method, &mut plan, &mut pilot);
        pilot.tolerances_by_unit(&mut self.right_hand_side(Vec::new()), tolerance)
    }

    /// Makes the reference run, whose difference at these times estimates the error of the run.
    fn make_reference_run(
        &self,
        erased_method: &SharedMethod<M>,
        plan: &mut RunPlan<'r, 'm, M>,
        (options, may_change_method): (StepOptions, bool),
        times: &[f64],
    ) -> ReferenceRun<M> {
        let settings = ReferenceSettings::of(&options, erased_method.method());
        plan.restart(self.right_hand_side(Vec::new()), settings.options(options), may_change_method);
        plan.max_steps = self.simulation.max_steps.saturating_mul(ReferenceSettings::MORE_STEPS);
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

/// Whether accelerations exist at a start, or, where it is a singular position, along its velocities.
fn accelerations_at_start<M: SimulationModel>(
    rhs: &mut RightHandSide<'_, '_, M>,
    start: &M::State,
) -> Result<(), RunFailure> {
    let found = rhs.accelerations(start.t(), start.q(), start.u());
    let found = found.map_err(|error| RunFailure::of_step::<M>(StepError::Evaluation(error)))?;
    if let Some(coordinate) = found.as_slice().iter().position(|x| !x.is_finite()) {
        return Err(RunFailure::of_step::<M>(StepError::NotFinite { coordinate, h: 0.0 }));
    }
    if M::IS_UNCONSTRAINED || rhs.stabilization.counts.dependent == 0 {
        return Ok(());
    }
    let start = rhs.state(start.t(), start.q(), start.u());
    let along = rhs.stabilization.singular_start(rhs.model, rhs.constants, &start, &found);
    along.map(|_| ()).map_err(RunFailure::here)
}

/// The first coordinate with a negative inertia whose square overflows.
fn negative_overflowing_inertia<M: SimulationModel>(
    model: &M,
    state: &M::State,
    workspace: &mut [f64],
) -> Option<SingularMassMatrix> {
    let mass = mass(model, state, workspace);
    let own = |i: usize| mass[i * (M::Vector::LEN + 1)];
    let coordinate = (0..M::Vector::LEN).find(|&i| own(i) < 0.0 && (own(i) * own(i)).is_infinite())?;
    let (name, pivot) = (M::COORDINATES[coordinate].name, own(coordinate));
    Some(SingularMassMatrix { coordinate, name, pivot, negative: true })
}

/// The counts; the time of a change of method and the new method; how the run ended.
type RunOutcome<M> = (Counts, Option<(f64, SharedMethod<M>)>, Result<(), RunFailure>);

/// Runs a plan to its end, with Radau IIA from where the motion is stiff.
fn run_method<M: SimulationModel>(
    erased_method: &SharedMethod<M>,
    plan: &mut RunPlan<'_, '_, M>,
    sink: &mut dyn Sink<M>,
) -> RunOutcome<M> {
    #[cfg(feature = "std")]
    let (started, _watch) = (std::time::Instant::now(), crate::slow_build::SlowBuildNote::start());
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
        counts.wall_time = Some(started.elapsed());
    }
    (counts, relay, result.map(|_| ()))
}

/// Continues with another method from where the first stopped. The counts are those of both.
fn resume<M: SimulationModel>(
    erased_method: &SharedMethod<M>,
    plan: &mut RunPlan<'_, '_, M>,
    state: M::State,
    before: &Counts,
    sink: &mut dyn Sink<M>,
) -> (Counts, Result<RunEnd<M::State>, RunFailure>) {
    plan.resume_from = Some((state, before.steps + before.rejected));
    plan.may_change_method = false;
    // The option `first_step` was for the first method.
    plan.options.first = None;
    let (after, result) = run(&**erased_method, plan, sink);
    // The right-hand side has counted the evaluations of both.
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

/// A simulation that has run. The records of its trajectory are in the sink.
struct FinishedRun<'m, M: SimulationModel> {
    model: &'m M,
    constants: M::Constants,
    law: Option<InputLaw<'m, M>>,
    trajectory: Trajectory<M>,
    /// The reference run, where one was asked for.
    reference: Option<ReferenceRun<M>>,
}

/// A finished run, and how it ended.
type RunResult<'m, M> = (FinishedRun<'m, M>, Result<(), RunFailure>);

/// The error of a run that ended early, with the motion up to there.
fn interrupted<M: SimulationModel>(failure: RunFailure, trajectory: Trajectory<M>) -> SimulationError<M> {
    let state = trajectory.last().state;
    SimulationError {
        kind: failure.kind,
        time: state.t(),
        step: failure.h,
        state: Box::new(state),
        trajectory: Some(Arc::new(trajectory)),
    }
}

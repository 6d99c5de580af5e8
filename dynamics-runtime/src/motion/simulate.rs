//! The options of a simulation, and running it.

use alloc::boxed::Box;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::sync::Arc;
use alloc::vec;
use alloc::vec::Vec;
use core::sync::atomic::AtomicBool;

use super::change::Change;
use super::driver::AnyDriver;
use super::error::{OptionError, SimulationError, SimulationErrorKind, suggest};
use super::estimate::compare;
use super::formulation::Formulation;
use super::functions::AdHoc;
use super::guard::{Contact, Guard, Guards};
use super::plant::{InputLaw, Plant, with_inputs};
use super::progress::Progress;
use super::query::Motion;
use super::record::{Counts, Record, Trajectory};
use super::run::{Ended, Halt, Keep, Plan, Show, Sink};
use super::second::{Probe, Second, SecondRun};
use super::upkeep::{PlaceError, Upkeep};
use super::watch::{Action, Flow, Rule, Watch};
use crate::integrate::{Direction, StepOptions, Tolerances};
use crate::methods::{Any, Dop853, Radau5, Rk4, Suits, Tsit5, Verner9};
use crate::model::{Branches, Constraints, Events, Expansion, ModelState, Outputs, Powers, Vector};

/// Above this tolerance Tsitouras 5(4) is chosen. Measured by time for the same error on double pendulum and Kepler (e = 0.9), all explicit methods lie
/// within a quarter of each other at errors of 1e-3.
const LOOSE: f64 = 1e-4;
/// Below this tolerance, and without constraints, Verner 9(8) is chosen instead of DOP853, of whose time it takes 0.75 to an error of 1e-6 and 0.65 to 1e-9. Above,
/// it gains little, and where motions are stiff its error estimate, which grows steeply, bounds the steps before stability does and hides that. With
/// constraints it takes 0.8 (Andrews) to 1 (car axis), but near singular positions, where these amplify errors, its one error estimate sees less than
/// the two of DOP853.
const MANY_DIGITS: f64 = 1e-6;
/// Below this tolerance Radau IIA needs so many steps that an explicit method at the border of its stability is no slower, so runs go on.
const TIGHT: f64 = 1e-11;
/// Number of coordinates above which one step of an implicit method, which factors matrices of that size, costs more than thousands of evaluations.
const LARGE: usize = 100;
/// Nine digits: far below what a plot shows or a parameter is known to, at less than twice the cost of six with Verner 9(8).
const DEFAULT_TOLERANCE: f64 = 1e-9;
/// A million steps are a few hundred megabytes of motion at most, and minutes of work: beyond it something is wrong more often
/// than not.
const DEFAULT_MAX_STEPS: u64 = 1_000_000;
/// A thousand times what a start may miss its constraints by: a picture still looks right, a number no longer is.
const DEFAULT_DRIFT_LIMIT: f64 = 1e-3;

/// Models that can be moved: every model that says its powers, outputs, events and constraints, as all derived ones do.
pub trait Simulate: Powers + Outputs + Events + Constraints {
    /// Opens a simulation from a start state; options follow, [`Simulation::run`] runs it.
    fn simulate(&self, start: Self::State) -> Simulation<'_, Self> {
        Simulation::new(self, start)
    }
}

impl<M: Powers + Outputs + Events + Constraints> Simulate for M {}

/// A simulation with its options, before it runs.
#[must_use = "a simulation does nothing until `.run()`"]
pub struct Simulation<'m, M: Simulate> {
    model: &'m M,
    start: M::State,
    end: Option<f64>,
    method: Option<AnyDriver<M>>,
    /// With the option that gave them.
    tolerances: Option<(Tolerances, &'static str)>,
    fixed: Option<f64>,
    first: Option<f64>,
    most: Option<f64>,
    most_steps: u64,
    output: Output,
    law: Option<InputLaw<'m, M>>,
    ad_hoc: Vec<AdHoc<'m, M::State>>,
    actions: Vec<(String, Direction, Action<'m, M>)>,
    contacts: Vec<(String, Contact)>,
    /// Constraint and breakaway event.
    sticking: Vec<(String, String)>,
    formulation: Option<Formulation>,
    drift_limit: f64,
    consistent: bool,
    estimates: bool,
    cancel: Option<&'m AtomicBool>,
    #[cfg(feature = "progress")]
    progress: bool,
}

enum Output {
    Steps,
    Times(Vec<f64>),
    Every(f64),
}

impl<'m, M: Simulate> Simulation<'m, M> {
    fn new(model: &'m M, start: M::State) -> Self {
        Self {
            model,
            start,
            end: None,
            method: None,
            tolerances: None,
            fixed: None,
            first: None,
            most: None,
            most_steps: DEFAULT_MAX_STEPS,
            output: Output::Steps,
            law: None,
            ad_hoc: Vec::new(),
            actions: Vec::new(),
            contacts: Vec::new(),
            sticking: Vec::new(),
            formulation: None,
            drift_limit: DEFAULT_DRIFT_LIMIT,
            consistent: false,
            estimates: false,
            cancel: None,
            #[cfg(feature = "progress")]
            progress: false,
        }
    }

    /// End time; may lie before the start: the motion then runs backwards in time.
    pub fn until(mut self, t: f64) -> Self {
        self.end = Some(t);
        self
    }

    /// Permitted local error per step, absolute (in the unit of each coordinate and velocity) and relative alike. Default 1e-9.
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.tolerances = Some((Tolerances::both(tolerance), "tolerance"));
        self
    }

    /// Permitted local error per step: absolute + relative·|value|, for coordinates and velocities alike.
    pub fn tolerances(mut self, absolute: f64, relative: f64) -> Self {
        self.tolerances = Some((Tolerances { absolute, relative }, "tolerances"));
        self
    }

    /// Overrides the choice of the method: one of [`crate::methods`].
    ///
    /// Without it: RK4 where a fixed step is given, else Tsitouras 5(4) for tolerances above 1e-4, Verner 9(8) below 1e-6 without constraints, else DOP853; where the motion turns out to be
    /// stiff for these, Radau IIA goes on, and the summary says from when.
    pub fn method(mut self, method: impl Into<Any<M>>) -> Self {
        self.method = Some(method.into().0);
        self
    }

    /// Makes all steps this long (the last one shorter where it has to be); no error is estimated.
    pub fn fixed_step(mut self, h: f64) -> Self {
        self.fixed = Some(h);
        self
    }

    /// Length of the first step; chosen from the problem where it is not given.
    pub fn first_step(mut self, h: f64) -> Self {
        self.first = Some(h);
        self
    }

    /// Longest step, for inputs or forces that change within a time that the state does not show.
    pub fn max_step(mut self, h: f64) -> Self {
        self.most = Some(h);
        self
    }

    /// Most steps, rejected ones included. Default 1,000,000.
    pub fn max_steps(mut self, steps: u64) -> Self {
        self.most_steps = steps;
        self
    }

    /// Times at which [`Motion::states`] gives the state; taken from the dense output, they do not change the steps.
    pub fn output_times(mut self, times: impl IntoIterator<Item = f64>) -> Self {
        self.output = Output::Times(times.into_iter().collect());
        self
    }

    /// Output times at equal intervals from the start, the end included where an interval ends there.
    pub fn every(mut self, interval: f64) -> Self {
        self.output = Output::Every(interval);
        self
    }

    /// Input values as a function of time and state: controls, prescribed motions. Called at every stage of every step, and again
    /// when the motion is asked for states in between, so it should depend on its arguments alone (`Send` and `Sync`, so
    /// that motions may cross threads, keep cells out of it). The inputs of the state that it
    /// gets are those of the start, or what a reset set them to.
    pub fn inputs<R: Into<M::Inputs>>(mut self, law: impl Fn(f64, &M::State) -> R + Send + Sync + 'm) -> Self {
        self.law = Some(Box::new(move |t, state| law(t, state).into()));
        self
    }

    /// Declares an event function beside those of the model: its zero crossings are located and listed.
    pub fn event(mut self, name: &str, function: impl Fn(&M::State) -> f64 + 'm) -> Self {
        self.ad_hoc.push(AdHoc { name: name.into(), function: Box::new(function) });
        self
    }

    /// Calls `action` with the state at every crossing of an event in the given direction (along the motion): an impact changes
    /// velocities, a switch changes inputs. It may return [`Flow::Stop`] to end the simulation there. Inputs that it sets are
    /// held; where [`Simulation::inputs`] supplies them, the closure sees what was set in the state that it gets.
    pub fn on_event<R: Into<Flow>>(
        mut self,
        name: &str,
        direction: Direction,
        mut action: impl FnMut(&mut M::State) -> R + 'm,
    ) -> Self {
        let action = Action::Reset(Box::new(move |change| action(change.state_mut()).into()));
        self.actions.push((name.into(), direction, action));
        self
    }

    /// Calls `action` at every crossing of an event in the given direction, as [`Simulation::on_event`] does, with a [`Change`], which can
    /// also hit, engage and release constraints. The state that is left has to fulfil the constraints that hold then.
    pub fn on_event_with<R: Into<Flow>>(
        mut self,
        name: &str,
        direction: Direction,
        mut action: impl FnMut(&mut Change<'_, M>) -> R + 'm,
    ) -> Self {
        let action = Action::Reset(Box::new(move |change| action(change).into()));
        self.actions.push((name.into(), direction, action));
        self
    }

    /// Makes a switched holonomic constraint of one row a unilateral contact: free where Φ > 0, and where it is closed it pushes (λ > 0) and never
    /// pulls. It rebounds or closes where Φ falls to zero and lifts off where λ does. Its events are listed as `floor contact`.
    pub fn contact(mut self, name: &str, contact: impl Into<Contact>) -> Self {
        self.contacts.push((name.into(), contact.into()));
        self
    }

    /// Makes a switched nonholonomic constraint of one row stick and slip: it is released where the event `breakaway` falls to zero (a
    /// limit of friction less |λ|), to the side against λ, and holds again where the slip A q̇ + b returns to zero, unless it would break away there at
    /// once. A start or an action that leaves it slipping leaves it slipping to the side of its velocity. Its events are listed as `belt slip`.
    pub fn stick_slip(mut self, name: &str, breakaway: &str) -> Self {
        self.sticking.push((name.into(), breakaway.into()));
        self
    }

    /// How the constraints are kept. Without it: [`Formulation::Projected`].
    pub fn formulation(mut self, formulation: Formulation) -> Self {
        self.formulation = Some(formulation);
        self
    }

    /// Ends the simulation with an error where a constraint has drifted by more than this part of 1 + |q|, as |Φ|/‖Φ_q‖, or its
    /// velocities by more than this part of 1 + |q̇|, as |Φ̇|/‖Φ_q‖ or |A q̇ + b|/‖A‖; infinite: never. Default 1e-3. Matters to formulations that let constraints drift.
    pub fn drift_limit(mut self, limit: f64) -> Self {
        self.drift_limit = limit;
        self
    }

    /// Puts states between steps, too, onto the constraints: without it dense output fulfils them to the tolerance only.
    pub fn consistent_output(mut self) -> Self {
        self.consistent = true;
        self
    }

    /// Estimates the error of the motion, [`Motion::global_error`], by running it a second time, with 1/100 of the tolerance (half the fixed step): tolerances
    /// bound what a step adds, and what the motion makes of it is seen only so. Takes 2 to 4 times the time of the run alone. Actions of
    /// events are called in both runs, so they should depend on the state alone.
    pub fn estimate_error(mut self) -> Self {
        self.estimates = true;
        self
    }

    /// Ends the simulation at the first crossing of an event in the given direction.
    pub fn stop_at(mut self, name: &str, direction: Direction) -> Self {
        self.actions.push((name.into(), direction, Action::Stop));
        self
    }

    /// Ends the simulation with an error as soon as the flag is raised, from another thread or a signal handler.
    pub fn cancel(mut self, flag: &'m AtomicBool) -> Self {
        self.cancel = Some(flag);
        self
    }

    /// Shows a progress bar on the error stream where the run takes longer than a second.
    #[cfg(feature = "progress")]
    pub fn progress(mut self) -> Self {
        self.progress = true;
        self
    }

    /// Runs the simulation and keeps its motion.
    pub fn run(mut self) -> Result<Motion<'m, M>, SimulationError<M>> {
        let checked = self.check()?;
        self.place(&checked)?;
        let mut keep = Keep { records: Vec::new(), events: Vec::new() };
        let (run, result) = self.fly(checked, &mut keep)?;
        let mut trajectory = Trajectory { records: keep.records, events: keep.events, ..run.trajectory };
        if let (Some(second), Some(driver)) = (run.second, &trajectory.driver) {
            let order = driver.method().order();
            trajectory.error = Some(Arc::new(compare(&trajectory, second, order)));
        }
        match result {
            Ok(()) => Ok(Motion::new(run.model, run.constants, run.law, trajectory)),
            Err(halt) => Err(broken_off(halt, trajectory)),
        }
    }

    /// Runs the simulation and keeps nothing: shows every accepted state, or the states at the output times where such are
    /// given, to `observer`, which may end it. Returns the last state.
    pub fn run_with<R: Into<Flow>>(
        mut self,
        mut observer: impl FnMut(&M::State) -> R,
    ) -> Result<M::State, SimulationError<M>> {
        if self.estimates {
            return Err(self.refused(OptionError::NothingToCompare.into()));
        }
        let checked = self.check()?;
        self.place(&checked)?;
        let mut observer = |state: &M::State| observer(state).into();
        let start = self.start;
        let times = checked.output_times.clone();
        // The start is shown here, as often as it is asked for; the run itself shows what its steps reach.
        let at_start = times.as_ref().map_or(1, |times| times.iter().take_while(|t| **t == start.t()).count());
        let first = with_inputs::<M>(self.law.as_ref(), start);
        for _ in 0..at_start {
            if observer(&first) == Flow::Stop {
                return Ok(first);
            }
        }
        let mut times = times.map(|mut times| times.split_off(at_start).into_iter());
        let next = times.as_mut().and_then(Iterator::next);
        let mut show = Show { observer: &mut observer, times, next, last: None };
        let (run, result) = self.fly(checked, &mut show)?;
        let last = show.last.unwrap_or_else(|| Record::unmoved(start));
        match result {
            Ok(()) => Ok(with_inputs::<M>(run.law.as_ref(), last.state)),
            Err(halt) => Err(broken_off(halt, Trajectory { records: vec![last], ..run.trajectory })),
        }
    }

    /// Runs into a sink, with the options checked.
    fn fly(mut self, checked: Checked<'m, M>, sink: &mut dyn Sink<M>) -> Result<Landed<'m, M>, SimulationError<M>> {
        let constants = self.constants()?;
        let law = self.law.take();
        let (driver, reason) = checked.method;
        let contacts: Vec<_> = checked.guards.iter().filter_map(Guard::closing::<M>).collect();
        let plant = || {
            let formulation = checked.formulation.as_ref().map(|(formulation, _)| *formulation);
            let mut upkeep = Upkeep::new(formulation, self.drift_limit, constants, (self.start.t(), checked.end));
            upkeep.contacts.clone_from(&contacts);
            Plant {
                model: self.model,
                constants: &constants,
                law: law.as_ref(),
                held: *self.start.inputs(),
                modes: self.start.modes(),
                evaluations: 0,
                branches: Branches::FREE,
                known: Branches::FREE,
                upkeep,
            }
        };
        let mut plan = Plan {
            plant: plant(),
            start: self.start,
            end: checked.end,
            options: checked.options,
            most_steps: self.most_steps,
            cancel: self.cancel,
            watch: Watch::new(self.model, constants, self.ad_hoc, checked.guards, checked.rules),
            #[cfg(feature = "progress")]
            progress: if self.progress { Progress::new(self.start.t(), checked.end) } else { Progress::none() },
            #[cfg(not(feature = "progress"))]
            progress: Progress::none(),
            hands_over: checked.hands_over,
            resumes: None,
        };
        let (counts, relay, result) = sail(&driver, &mut plan, sink);
        let (upkept, usual) = (plan.plant.upkeep.upkept, plan.plant.upkeep.usual);
        let second = (self.estimates && result.is_ok()).then(|| {
            let second = SecondRun::of(&checked.options, driver.method());
            plan.restart(plant(), second.options(checked.options), checked.hands_over);
            plan.most_steps = self.most_steps.saturating_mul(SecondRun::MORE_STEPS);
            let mut probe = Probe::at(sink.times());
            let (counts, _, result) = sail(&driver, &mut plan, &mut probe);
            let broken_off = result.err().map(|halt| (probe.reached, halt.kind.to_string()));
            Second { run: second, states: probe.states, events: probe.events, counts, broken_off }
        });
        let trajectory = Trajectory {
            driver: Some(driver),
            relay,
            reason,
            tolerances: checked.options.tolerances,
            records: Vec::new(),
            output_times: checked.output_times,
            events: Vec::new(),
            counts,
            has_law: law.is_some(),
            formulation: checked.formulation,
            upkept,
            usual,
            consistent: self.consistent,
            error: None,
            fixed: checked.options.fixed.is_some(),
        };
        drop(plan);
        Ok((Ran { model: self.model, constants, law, trajectory, second }, result))
    }

    fn constants(&self) -> Result<M::Constants, SimulationError<M>> {
        self.model.constants().map_err(|error| self.refused(SimulationErrorKind::SingularMassMatrix(error)))
    }

    fn refused(&self, kind: SimulationErrorKind) -> SimulationError<M> {
        let start = self.start;
        SimulationError { kind, time: start.t(), step: 0.0, state: Box::new(start), trajectory: None }
    }

    /// Puts the start onto the constraints, once it is known to lie there to within what was typed.
    fn place(&mut self, checked: &Checked<'m, M>) -> Result<(), SimulationError<M>> {
        let formulation = checked.formulation.as_ref().map(|(formulation, _)| *formulation);
        // Constraints may contain inputs; what is held stays what it was.
        let (mut start, held) = (with_inputs::<M>(self.law.as_ref(), self.start), *self.start.inputs());
        let run = (self.start.t(), checked.end);
        let mut upkeep = Upkeep::new(formulation, self.drift_limit, self.constants()?, run);
        for guard in &checked.guards {
            guard.turn(start.modes(), self.model, &mut start, &mut upkeep);
        }
        match upkeep.begin(self.model, &mut start) {
            Ok(()) => {
                *start.inputs_mut() = held;
                self.start = start;
            }
            Err(PlaceError::State(error)) => return Err(self.refused(SimulationErrorKind::Start(Box::new(error)))),
            Err(PlaceError::Solve(error)) => return Err(self.refused(error.into())),
        }
        Ok(())
    }

    fn check(&mut self) -> Result<Checked<'m, M>, SimulationError<M>> {
        self.check_options().map_err(|error| self.refused(error.into()))
    }

    fn check_options(&mut self) -> Result<Checked<'m, M>, OptionError> {
        OptionError::check_parameters(self.model)?;
        self.check_start()?;
        let end = self.end.ok_or(OptionError::NoEnd)?;
        number("until", end, end.is_finite(), "a finite time")?;
        let options = self.check_steps()?;
        let method = self.choose_method(&options.tolerances)?;
        self.check_suits(&method.0)?;
        let output_times = self.output_list()?;
        let formulation = Formulation::choose::<M>(self.formulation)?;
        self.check_series(&method.0, formulation.as_ref().map(|(formulation, _)| *formulation))?;
        let tightest = options.tolerances.absolute.min(options.tolerances.relative);
        let hands_over = self.method.is_none() && self.fixed.is_none() && tightest >= TIGHT && M::Vector::LEN <= LARGE;
        number("drift_limit", self.drift_limit, self.drift_limit > 0.0, "a limit above 0")?;
        let guards = self.check_guards(end)?;
        let rules = self.check_events(&guards)?;
        Ok(Checked { end, options, method, hands_over, output_times, formulation, guards, rules })
    }

    fn check_start(&self) -> Result<(), OptionError> {
        let not_finite = |v: &[f64]| v.iter().position(|x| !x.is_finite());
        if !self.start.t().is_finite() {
            return Err(OptionError::StartNotFinite { name: "t", rate: false });
        }
        if let Some(i) = not_finite(self.start.q().as_slice()) {
            return Err(OptionError::StartNotFinite { name: M::COORDINATES[i].name, rate: false });
        }
        if let Some(i) = not_finite(self.start.u().as_slice()) {
            return Err(OptionError::StartNotFinite { name: M::COORDINATES[i].name, rate: true });
        }
        match not_finite(self.start.inputs().as_slice()) {
            Some(i) if self.law.is_none() => Err(OptionError::InputWithoutValue { input: M::INPUTS[i].name }),
            _ => Ok(()),
        }
    }

    fn check_steps(&self) -> Result<StepOptions, OptionError> {
        let (tolerances, option) = self.tolerances.unwrap_or((Tolerances::both(DEFAULT_TOLERANCE), "tolerance"));
        let Tolerances { absolute, relative } = tolerances;
        let [above, least, finest] = match option {
            "tolerance" => ["a tolerance above 0", "a tolerance above 0", "at least 1e-15: `f64` resolves no less"],
            _ => [
                "an absolute tolerance above 0",
                "a relative tolerance of 0 or more",
                "a relative tolerance of at least 1e-15: `f64` resolves no less",
            ],
        };
        number(option, absolute, absolute > 0.0 && absolute.is_finite(), above)?;
        number(option, relative, relative >= 0.0 && relative.is_finite(), least)?;
        number(option, relative, relative == 0.0 || relative >= 1e-15, finest)?;
        let length = "a length of time above 0, and above the resolution of `f64` at the times simulated";
        let resolution = 4.0 * f64::EPSILON * self.start.t().abs().max(self.end.map_or(0.0, f64::abs));
        for (option, value) in [("fixed_step", self.fixed), ("first_step", self.first)] {
            let Some(value) = value else { continue };
            number(option, value, value > resolution && value.is_finite(), length)?;
        }
        let most = self.most.unwrap_or(f64::INFINITY);
        number("max_step", most, most > resolution, length)?;
        number("max_steps", self.most_steps as f64, self.most_steps > 0, "at least 1")?;
        if self.fixed.is_some() {
            let given = [("first_step", self.first.is_some()), ("max_step", self.most.is_some())];
            let tolerance = [(option, self.tolerances.is_some())];
            if let Some(&(option, _)) = given.iter().chain(&tolerance).find(|(_, given)| *given) {
                return Err(OptionError::FixedStepExcludes { option });
            }
        }
        Ok(StepOptions { tolerances, fixed: self.fixed, first: self.first, most })
    }

    fn choose_method(&self, tolerances: &Tolerances) -> Result<(AnyDriver<M>, String), OptionError> {
        let loosest = tolerances.absolute.max(tolerances.relative);
        let chosen = |driver: AnyDriver<M>, reason: String| (driver, reason);
        Ok(match (self.method.clone(), self.fixed) {
            (Some(method), None) if !method.is_adaptive() => {
                return Err(OptionError::NeedsFixedStep { method: method.method() });
            }
            (Some(method), Some(h)) => (method, format!("as asked for, with a fixed step of {h}")),
            (Some(method), None) => (method, format!("as asked for, at tolerance {loosest:e}")),
            (None, Some(h)) => chosen(Arc::new(Rk4), format!("because the step is fixed, {h}")),
            (None, None) if loosest > LOOSE => {
                chosen(Arc::new(Tsit5), format!("because tolerance {loosest:e} asks for few digits"))
            }
            // A constant, so that models with constraints have no code of it.
            (None, None) if const { M::ROWS.is_empty() } && loosest < MANY_DIGITS => {
                chosen(Arc::new(Verner9), format!("because its long steps win at tolerance {loosest:e}"))
            }
            (None, None) => chosen(Arc::new(Dop853), format!("because its long steps win at tolerance {loosest:e}")),
        })
    }

    fn check_series(&self, method: &AnyDriver<M>, formulation: Option<Formulation>) -> Result<(), OptionError> {
        if !method.needs_series() {
            return Ok(());
        }
        let adds = |of: &Formulation| matches!(of, Formulation::Baumgarte { .. } | Formulation::BaumgarteTied);
        if let Some(formulation) = formulation.filter(adds) {
            return Err(OptionError::SeriesExcludes { method: method.method(), formulation });
        }
        let reason = match M::SERIES {
            Expansion::None { reason } => reason,
            Expansion::Generated { .. } if self.law.is_some() => "its inputs follow a closure",
            Expansion::Generated { .. } => return Ok(()),
        };
        Err(OptionError::NoSeries { method: method.method(), reason })
    }

    /// Methods that preserve something are refused where they would not.
    fn check_suits(&self, method: &AnyDriver<M>) -> Result<(), OptionError> {
        let (suits, method) = (method.suits(), method.method());
        if suits == Suits::Any {
            return Ok(());
        }
        let unsuited = |reason, remedy| Err(OptionError::Unsuited { method, reason, remedy });
        let constrained = !M::ROWS.is_empty();
        if constrained && suits != Suits::SeparableHolonomic {
            return unsuited(
                "it has constraints",
                "use methods::Rattle, or a method that preserves nothing, as methods::Dop853",
            );
        }
        if M::VELOCITY_FORCES && matches!(suits, Suits::Separable | Suits::SeparableHolonomic) {
            let reason = "its forces, or the Coriolis terms of a mass matrix that moves, contain velocities";
            let remedy = if constrained {
                "use methods::Dop853"
            } else {
                "use methods::Gauss4, methods::Gauss6 or methods::EnergyMidpoint"
            };
            return unsuited(reason, remedy);
        }
        if M::VelocityOffset::LEN > 0 {
            return unsuited("it has nonholonomic constraints", "use methods::Dop853");
        }
        if constrained && self.formulation.is_some_and(|formulation| formulation != Formulation::Projected) {
            return unsuited(
                "its steps are projected and `.formulation(..)` asks for something else",
                "leave that out",
            );
        }
        let conserved = M::CONSERVED.iter().any(|quantity| matches!(quantity.name, "energy" | "energy function"));
        if suits == Suits::Conservative && (!conserved || self.law.is_some()) {
            return unsuited("its energy is not conserved", "use methods::Gauss4 or methods::Gauss6");
        }
        Ok(())
    }

    /// The output times, checked and in the order of the motion.
    fn output_list(&self) -> Result<Option<Vec<f64>>, OptionError> {
        let (start, end) = (self.start.t(), self.end.ok_or(OptionError::NoEnd)?);
        let direction = if end < start { -1.0 } else { 1.0 };
        match &self.output {
            Output::Steps => Ok(None),
            Output::Times(times) => {
                let outside = |&t: &f64| !((t - start) * direction >= 0.0 && (end - t) * direction >= 0.0);
                if let Some(time) = times.iter().copied().find(outside) {
                    return Err(OptionError::OutputTime { time, start, end });
                }
                let mut times = times.clone();
                times.sort_by(|a, b| (a * direction).total_cmp(&(b * direction)));
                Ok(Some(times))
            }
            Output::Every(interval) => {
                number("every", *interval, *interval > 0.0 && interval.is_finite(), "an interval above 0")?;
                let span = (end - start).abs();
                let count = intervals(span, *interval);
                number("every", *interval, count <= 100_000_000, "an interval that gives fewer than 10⁸ times")?;
                Ok(Some(every(start, end, *interval)))
            }
        }
    }

    /// Index of an event of the model or of the simulation.
    fn event_index(&self, name: &str) -> Result<usize, OptionError> {
        let names = || M::EVENTS.iter().map(|e| e.name).chain(self.ad_hoc.iter().map(|e| e.name.as_str()));
        names().position(|known| known == name).ok_or_else(|| {
            let suggestion = suggest(name, names());
            OptionError::UnknownEvent { name: name.into(), suggestion }
        })
    }

    fn check_guards(&self, end: f64) -> Result<Guards, OptionError> {
        let contacts = self.contacts.iter().map(|(name, _)| ("contact", name));
        let sticking = self.sticking.iter().map(|(name, _)| ("stick_slip", name));
        if let Some((option, name)) = contacts.chain(sticking).next()
            && end < self.start.t()
        {
            return Err(OptionError::Backwards { option, constraint: name.clone() });
        }
        let mut guards = Vec::with_capacity(self.contacts.len() + self.sticking.len());
        for (name, contact) in &self.contacts {
            guards.push(Guard::contact::<M>(name, *contact)?);
        }
        for (name, breakaway) in &self.sticking {
            guards.push(Guard::stick::<M>(name, || self.event_index(breakaway))?);
        }
        Ok(guards)
    }

    /// The rules: what guards do comes before what was asked for at their events.
    fn check_events(&mut self, guards: &Guards) -> Result<Vec<Rule<'m, M>>, OptionError> {
        let own = M::EVENTS.iter().map(|e| e.name);
        let given = self.ad_hoc.iter().map(|e| e.name.as_str());
        let names: Vec<&str> = own.chain(given).chain(guards.iter().map(|guard| guard.name.as_str())).collect();
        for (i, name) in names.iter().enumerate().skip(M::EVENTS.len()) {
            if names[..i].contains(name) {
                return Err(OptionError::DuplicateEvent { name: name.to_string() });
            }
        }
        let first = M::EVENTS.len() + self.ad_hoc.len();
        let guard = |i| Rule { index: first + i, direction: Direction::Falling, action: Action::Guard(i) };
        let mut rules: Vec<Rule<'m, M>> = (0..guards.len()).map(guard).collect();
        for (name, direction, action) in self.actions.drain(..) {
            let Some(index) = names.iter().position(|known| *known == name) else {
                let suggestion = suggest(&name, names.iter().copied());
                return Err(OptionError::UnknownEvent { name, suggestion });
            };
            rules.push(Rule { index, direction, action });
        }
        Ok(rules)
    }
}

/// Number of intervals in a span, with a millionth of one as slack: 10 / 0.1 must give the last of its 101 times.
fn intervals(span: f64, interval: f64) -> u64 {
    (span / interval + 1e-6) as u64
}

/// Times at equal intervals from the start, the end included where an interval ends there.
pub(super) fn every(start: f64, end: f64, interval: f64) -> Vec<f64> {
    let direction = if end < start { -1.0 } else { 1.0 };
    let at = |k: u64| {
        let t = start + direction * (k as f64 * interval);
        if (end - t) * direction < 0.0 { end } else { t }
    };
    (0..=intervals((end - start).abs(), interval)).map(at).collect()
}

/// What the options say once they are checked.
struct Checked<'m, M: Simulate> {
    end: f64,
    options: StepOptions,
    method: (AnyDriver<M>, String),
    /// An implicit method is to go on where the motion is stiff.
    hands_over: bool,
    output_times: Option<Vec<f64>>,
    formulation: Option<(Formulation, String)>,
    guards: Guards,
    rules: Vec<Rule<'m, M>>,
}

/// Counts, when which method took over, how it ended.
type Sailed<M> = (Counts, Option<(f64, AnyDriver<M>)>, Result<(), Halt>);

/// Runs a plan to its end; over to an implicit method where it is stiff. From when and with which is told.
fn sail<M: Simulate>(driver: &AnyDriver<M>, plan: &mut Plan<'_, '_, M>, sink: &mut dyn Sink<M>) -> Sailed<M> {
    #[cfg(feature = "std")]
    let begun = std::time::Instant::now();
    #[allow(unused_mut, reason = "without `std` there is no clock to set it by")]
    let (mut counts, mut result) = driver.run(plan, sink);
    let mut relay = None;
    if let Ok(Ended::Stiff(state)) = &result {
        let implicit: AnyDriver<M> = Arc::new(Radau5);
        relay = Some((state.t(), Arc::clone(&implicit)));
        (counts, result) = go_on(&implicit, plan, *state, &counts, sink);
    }
    #[cfg(feature = "std")]
    {
        counts.wall_time = Some(begun.elapsed());
    }
    (counts, relay, result.map(|_| ()))
}

/// Goes on with another method from where one stopped; counts are those of both.
fn go_on<M: Simulate>(
    driver: &AnyDriver<M>,
    plan: &mut Plan<'_, '_, M>,
    state: M::State,
    before: &Counts,
    sink: &mut dyn Sink<M>,
) -> (Counts, Result<Ended<M::State>, Halt>) {
    plan.resumes = Some((state, before.steps + before.rejected));
    plan.hands_over = false;
    // What was asked for the first step is over.
    plan.options.first = None;
    let (after, result) = driver.run(plan, sink);
    // The plant has counted its evaluations all along.
    let (steps, rejected) = (before.steps + after.steps, before.rejected + after.rejected);
    (
        Counts { steps, rejected, stiff_at: before.stiff_at, slides_at: before.slides_at.or(after.slides_at), ..after },
        result,
    )
}

/// What is left of a simulation that has run; the trajectory's records are in the sink.
struct Ran<'m, M: Simulate> {
    model: &'m M,
    constants: M::Constants,
    law: Option<InputLaw<'m, M>>,
    trajectory: Trajectory<M>,
    /// The run that tells its error, where one was asked for.
    second: Option<Second<M>>,
}

/// A run with how it ended.
type Landed<'m, M> = (Ran<'m, M>, Result<(), Halt>);

fn number(option: &'static str, value: f64, good: bool, admissible: &'static str) -> Result<(), OptionError> {
    if good { Ok(()) } else { Err(OptionError::Number { option, value, admissible }) }
}

fn broken_off<M: Simulate>(halt: Halt, trajectory: Trajectory<M>) -> SimulationError<M> {
    let state = trajectory.last().state;
    SimulationError {
        kind: halt.kind,
        time: state.t(),
        step: halt.h,
        state: Box::new(state),
        trajectory: Some(Box::new(trajectory)),
    }
}

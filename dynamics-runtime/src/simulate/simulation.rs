//! The builder of a simulation: one method for each option, then `.run()`.
//!
//! `simulation/check.rs` checks the options and chooses the method; `simulation/execution.rs` runs;
//! `simulation/description.rs` writes the options as texts.

pub(crate) mod check;
mod description;
mod execution;
pub(crate) mod side_by_side;

use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec::Vec;
use core::sync::atomic::AtomicBool;

use crate::integrate::{Direction, Tolerances};
use crate::model::{InputValues, SimulationModel};
use crate::simulate::AnyMethod;
use crate::simulate::erased_method::SharedMethod;
use crate::simulate::events::action::EventAction;
use crate::simulate::events::functions::AddedEvent;
use crate::simulate::events::rules::{Action, Flow};
use crate::simulate::options::contact::Contact;
use crate::simulate::options::defaults::{DEFAULT_DRIFT_LIMIT, DEFAULT_MAX_STEPS};
use crate::simulate::options::formulation::Formulation;
use crate::simulate::right_hand_side::{InputLaw, with_inputs};

/// Opens simulations. Every model that can be simulated has it.
pub trait Simulate: SimulationModel {
    /// Opens a simulation from a start state; options follow, [`Simulation::run`] runs it.
    fn simulate(&self, start: Self::State) -> Simulation<'_, Self> {
        Simulation::new(self, start)
    }
}

impl<M: SimulationModel> Simulate for M {}

/// A simulation with its options, before it runs.
#[must_use = "a simulation does nothing until `.run()`"]
pub struct Simulation<'m, M: SimulationModel> {
    model: &'m M,
    start: M::State,
    end: Option<f64>,
    method: Option<SharedMethod<M>>,
    /// Tolerances, with the option that gave them.
    tolerances: Option<(Tolerances, ToleranceOption)>,
    fixed: Option<f64>,
    first: Option<f64>,
    most: Option<f64>,
    max_steps: u64,
    output: Output,
    law: Option<InputLaw<'m, M>>,
    added_events: Vec<AddedEvent<'m, M::State>>,
    actions: Vec<(String, Direction, Action<'m, M>)>,
    contacts: Vec<(String, Contact)>,
    /// Names of constraints that stick and slip, each with its breakaway event.
    sticking: Vec<(String, String)>,
    formulation: Option<Formulation>,
    drift_limit: f64,
    consistent_output: bool,
    estimates_error: bool,
    cancel: Option<&'m AtomicBool>,
    cancel_when: Option<Box<dyn Fn() -> bool + 'm>>,
    #[cfg(feature = "progress")]
    progress: bool,
}

/// The output times as they were asked for.
enum Output {
    Steps,
    Times(Vec<f64>),
    Every(f64),
}

/// The option that gave the tolerances of a simulation.
#[derive(Clone, Copy, PartialEq)]
enum ToleranceOption {
    /// One for both. The absolute one is scaled with the size of the motion.
    Tolerance,
    /// Each of its own.
    Tolerances,
}

impl ToleranceOption {
    /// Its name.
    const fn name(self) -> &'static str {
        match self {
            Self::Tolerance => "tolerance",
            Self::Tolerances => "tolerances",
        }
    }
}

impl<'m, M: SimulationModel> Simulation<'m, M> {
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
            max_steps: DEFAULT_MAX_STEPS,
            output: Output::Steps,
            law: None,
            added_events: Vec::new(),
            actions: Vec::new(),
            contacts: Vec::new(),
            sticking: Vec::new(),
            formulation: None,
            drift_limit: DEFAULT_DRIFT_LIMIT,
            consistent_output: false,
            estimates_error: false,
            cancel: None,
            cancel_when: None,
            #[cfg(feature = "progress")]
            progress: false,
        }
    }

    /// End time; may lie before the start: the motion then runs backwards in time.
    pub fn until(mut self, t: f64) -> Self {
        self.end = Some(t);
        self
    }

    /// Permitted error, absolute (in the unit of each coordinate and velocity) and relative alike. Default
    /// 1e-9.
    ///
    /// It bounds the error of each step. Errors of steps add up, and the motion may amplify them.
    /// [`Motion::verify`](crate::simulate::Motion::verify) reports the sum where it is above ten tolerances.
    ///
    /// The absolute tolerance of small motions is smaller. Where all coordinates of one unit, or all of their
    /// velocities, stay below 0.1 in the first steps, it is the tolerance times ten times the largest of
    /// them.
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.tolerances = Some((Tolerances::both(tolerance), ToleranceOption::Tolerance));
        self
    }

    /// Permitted error of each step, absolute + relative·|value|, for coordinates and velocities. The
    /// absolute tolerance is not scaled with the size of the motion.
    pub fn tolerances(mut self, absolute: f64, relative: f64) -> Self {
        self.tolerances = Some((Tolerances { absolute, relative }, ToleranceOption::Tolerances));
        self
    }

    /// This tolerance, with another one for values near zero if `absolute` is given, unless tolerances or a
    /// fixed step were set before. Both cases report tolerances that are not positive.
    // Public for dynamics-analysis alone.
    #[doc(hidden)]
    pub fn or_tolerance(mut self, tolerance: f64, absolute: Option<f64>) -> Self {
        let known = self.tolerances.is_some() || self.fixed.is_some();
        match absolute {
            _ if !(tolerance > 0.0 && tolerance < 1.0) => {
                self.fixed = None;
                self.tolerance(tolerance)
            }
            _ if known => self,
            Some(absolute) => self.tolerances(absolute, tolerance),
            None => self.tolerance(tolerance),
        }
    }

    /// Overrides the choice of the method: one of [`crate::methods`].
    ///
    /// Without it: RK4 with a fixed step, else Tsitouras 5(4) for tolerances above 1e-4. Between 1e-12 and
    /// 1e-4 extrapolation (Gragg, Bulirsch, Stoer) where the model has no constraints, no input closure and
    /// code for several states at once. Else Verner 9(8) without constraints, if the tolerance is below 1e-6
    /// or there is such code, and DOP853. Where the motion turns out to be stiff, Radau IIA continues, and
    /// the summary reports the time.
    pub fn method(mut self, method: impl Into<AnyMethod<M>>) -> Self {
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

    /// Most steps, rejected ones included. The limit is checked before every step, so attempts that the last
    /// step rejects may exceed it. Default 1,000,000. A run whose steps become shorter without end is ended
    /// before.
    pub fn max_steps(mut self, steps: u64) -> Self {
        self.max_steps = steps;
        self
    }

    /// Times at which [`Motion::states`](super::Motion::states) returns the state, in the order of the
    /// motion. The states come from the dense output, so the times do not change the steps.
    pub fn output_times(mut self, times: impl IntoIterator<Item = f64>) -> Self {
        self.output = Output::Times(times.into_iter().collect());
        self
    }

    /// Output times at equal intervals from the start, the end included where an interval ends there.
    pub fn every(mut self, interval: f64) -> Self {
        self.output = Output::Every(interval);
        self
    }

    /// Input values as a function of time and state: controls, prescribed motions. Called at every stage of
    /// every step, and again when the motion is asked for states in between, so it should depend on its
    /// arguments alone (`Send` and `Sync`, so that motions may cross threads, keep cells out of it). The
    /// inputs of the state that it gets are those of the start, or what a reset set them to.
    pub fn inputs<R: InputValues<M::Inputs>>(
        mut self,
        law: impl Fn(f64, &M::State) -> R + Send + Sync + 'm,
    ) -> Self {
        self.law = Some(Box::new(move |t, state| law(t, state).values()));
        self
    }

    /// Declares an event function in addition to those of the model: its zero crossings are located and
    /// listed.
    pub fn event(mut self, name: &str, function: impl Fn(&M::State) -> f64 + 'm) -> Self {
        self.added_events.push(AddedEvent { name: name.into(), function: Box::new(function) });
        self
    }

    /// Calls `action` with the state at every crossing of an event in the given direction (along the motion):
    /// an impact changes velocities, a switch changes inputs. It may return [`Flow::Stop`] to end the
    /// simulation there. A motion that starts where the function is zero crosses there if it moves on in that
    /// direction. Inputs that it sets are held; where [`Simulation::inputs`] supplies them, the closure sees
    /// what was set in the state that it gets.
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

    /// Calls `action` at every crossing of an event in the given direction, as [`Simulation::on_event`]
    /// does, with a [`EventAction`], which can also hit, engage and release constraints. The state that is
    /// left has to fulfil the constraints that hold then.
    ///
    /// What cannot be done (a name that is not known) ends the run with an error; the action itself returns
    /// nothing, or a [`Flow`]:
    ///
    /// ```
    /// # use dynamics_runtime as dynamics;
    /// use dynamics::simulate::{Direction, Flow, Simulate, SimulationError};
    ///
    /// /// A hook catches what passes it, once, and lets go of it at a signal; a wall ends the run.
    /// fn caught<M: Simulate>(model: &M, start: M::State) -> Result<M::State, SimulationError<M>> {
    ///     let run = model.simulate(start).until(5.0);
    ///     let run = run.on_event_with("at_hook", Direction::Rising, |change| change.engage("hook"));
    ///     let run = run.on_event_with("signal", Direction::Any, |change| change.release("hook"));
    ///     let run = run.on_event_with("at_wall", Direction::Falling, |change| {
    ///         change.impact("wall", 0.5);
    ///         let lost: f64 = change.impacts().iter().map(|impact| impact.energy_lost).sum();
    ///         if lost > 10.0 { Flow::Stop } else { Flow::Continue }
    ///     });
    ///     Ok(run.run()?.end())
    /// }
    /// ```
    ///
    /// The guide to events and control runs such a model.
    pub fn on_event_with<R: Into<Flow>>(
        mut self,
        name: &str,
        direction: Direction,
        mut action: impl FnMut(&mut EventAction<'_, M>) -> R + 'm,
    ) -> Self {
        let action = Action::Reset(Box::new(move |change| action(change).into()));
        self.actions.push((name.into(), direction, action));
        self
    }

    /// Makes a switched holonomic constraint of one row a unilateral contact: free where Φ > 0, and where it
    /// is closed it pushes (λ > 0) and never pulls. It rebounds or closes where Φ falls to zero and lifts
    /// off where λ does. Where it is closed and Φ̇ jumps by a branch of its function, as where a floor
    /// starts to move or bends, it is struck, or opens. Its events are listed as `floor contact`.
    pub fn contact(mut self, name: &str, contact: impl Into<Contact>) -> Self {
        self.contacts.push((name.into(), contact.into()));
        self
    }

    /// Makes a switched nonholonomic constraint of one row stick and slip: it is released where the event
    /// `breakaway` falls to zero (a limit of friction less |λ|), to the side against λ, and holds again
    /// where the slip A q̇ + b returns to zero, unless it would break away there at once. Where A q̇ + b
    /// jumps by a branch of its function, as where a belt changes its speed, it slips from there: friction
    /// has no impulse. A start or an action that leaves it slipping leaves it slipping to the side of its
    /// velocity. Its events are listed as `belt slip`.
    pub fn stick_slip(mut self, name: &str, breakaway: &str) -> Self {
        self.sticking.push((name.into(), breakaway.into()));
        self
    }

    /// How the constraints are kept. Without it: [`Formulation::Projected`].
    pub fn formulation(mut self, formulation: Formulation) -> Self {
        self.formulation = Some(formulation);
        self
    }

    /// Ends the simulation with an error where a constraint has drifted by more than this part of s + |q|, as
    /// |Φ|/‖Φ_q‖, or its velocities by more than this part of s + |q̇|, as |Φ̇|/‖Φ_q‖ or |A
    /// q̇ + b|/‖A‖, of the coordinates in its row, by unit; s is the model's largest parameter of the
    /// same unit, at most 1, and 1 of angles and where there is none. Infinite: never. Default 1e-3. Matters
    /// to formulations that let constraints drift.
    pub fn drift_limit(mut self, limit: f64) -> Self {
        self.drift_limit = limit;
        self
    }

    /// Projects states between steps, too. Without it dense output fulfils the constraints to the tolerance
    /// only.
    pub fn consistent_output(mut self) -> Self {
        self.consistent_output = true;
        self
    }

    /// Estimates the error of the motion, [`Motion::global_error`](super::Motion::global_error), by a second
    /// run with 1/100 of the tolerance (half the fixed step). Tolerances bound what one step adds. What the
    /// motion makes of it is seen only so.
    ///
    /// Takes 2 to 4 times the time of the run alone, and 3 to 5 times for runs of up to 256 steps, which are
    /// compared in the middle of each step, too. Actions of events are called in both runs, so they should
    /// depend on the state alone.
    pub fn estimate_error(mut self) -> Self {
        self.estimates_error = true;
        self
    }

    /// Ends the simulation at the first crossing of an event in the given direction.
    pub fn stop_at(mut self, name: &str, direction: Direction) -> Self {
        self.actions.push((name.into(), direction, Action::Stop));
        self
    }

    /// Ends the simulation with an error as soon as the flag is set, by another thread or a signal handler.
    pub fn cancel(mut self, flag: &'m AtomicBool) -> Self {
        self.cancel = Some(flag);
        self
    }

    /// Ends the simulation with an error as soon as the function returns true. It is called before every
    /// step, by the thread that runs: there a program asks for signals, or whether its user waits no longer.
    pub fn cancel_when(mut self, asked: impl Fn() -> bool + 'm) -> Self {
        self.cancel_when = Some(Box::new(asked));
        self
    }

    /// Shows a progress bar on the error stream where the run takes longer than a second.
    #[cfg(feature = "progress")]
    pub fn progress(mut self) -> Self {
        self.progress = true;
        self
    }

    /// A state with the inputs of the input law, if there is one.
    pub(crate) fn complete(&self, state: M::State) -> M::State {
        with_inputs::<M>(self.law.as_ref(), state)
    }

    /// Names and values of the events given at this simulation, at a state.
    pub(crate) fn added_events_at(&self, state: &M::State) -> Vec<(String, f64)> {
        let state = with_inputs::<M>(self.law.as_ref(), *state);
        self.added_events.iter().map(|event| (event.name.clone(), (event.function)(&state))).collect()
    }
}

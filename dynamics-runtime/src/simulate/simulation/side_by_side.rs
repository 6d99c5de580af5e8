//! Which simulations can be made side by side with others (`ensemble.rs`), and what these need of them.

use alloc::format;
use alloc::string::String;
use alloc::sync::Arc;
use alloc::vec;
use alloc::vec::Vec;

use crate::error::SolveError;
use crate::integrate::choice;
use crate::integrate::{Direction, Phase, StepNode, StepOptions, Stepper, Tolerances, Verner9};
use crate::model::{ModelState, SimulationModel, StaticTraits, Vector};
use crate::simulate::erased_method::SharedMethod;
use crate::simulate::failure::OptionError;
use crate::simulate::options::defaults::DEFAULT_TOLERANCE;
use crate::simulate::run::monitors::stiffness_detection::{
    FINEST_TOLERANCE, LENGTHS_FROM_ONE_PLACE, worthwhile_factor,
};
use crate::simulate::simulation::check::{MAX_IMPLICIT_COORDINATES, check_event_names};
use crate::simulate::simulation::{Output, Simulation, ToleranceOption};

/// Parts of a step at whose ends event functions are compared: as many as of Verner 9(8) alone.
const EVENT_PARTS: usize = 8;
/// A step comes near an event if a parabola through three neighbouring values of its function comes this near
/// zero, in parts of the largest of them.
const NEAR_EVENT: f64 = 0.1;

/// A simulation that is made in a lane.
pub(crate) struct LanePlan<M: SimulationModel> {
    pub(crate) constants: M::Constants,
    pub(crate) options: StepOptions,
    pub(crate) end: f64,
    /// Size of the first step.
    pub(crate) first: f64,
    pub(crate) events: WatchedEvents,
}

/// The events that act on a run.
pub(crate) struct WatchedEvents {
    events: Vec<WatchedEvent>,
    /// Memory for the values of all events of the model.
    of_model: Vec<f64>,
}

impl WatchedEvents {
    pub(crate) fn is_empty(&self) -> bool {
        self.events.is_empty()
    }
}

/// An event that acts, with its values in a step.
struct WatchedEvent {
    /// Events of the model come first, then those of the simulation.
    index: usize,
    direction: Direction,
    values: [f64; EVENT_PARTS + 1],
}

impl<'m, M: SimulationModel> Simulation<'m, M> {
    /// The model that moves.
    #[must_use]
    pub fn model(&self) -> &'m M {
        self.model
    }

    /// The relative error that a step may make, as it was asked for or by default.
    #[must_use]
    pub fn relative_tolerance(&self) -> f64 {
        self.tolerances.map_or(DEFAULT_TOLERANCE, |(tolerances, _)| tolerances.relative)
    }

    pub(crate) fn start(&self) -> &M::State {
        &self.start
    }

    /// The state of the motion at a time.
    pub(crate) fn state_at(&self, t: f64, y: &Phase<M::Vector>) -> M::State {
        let mut state = M::State::new(t, y.q, y.u, *self.start.inputs());
        *state.active_set_mut() = self.start.active_set();
        state
    }

    /// Most steps.
    pub(crate) fn step_limit(&self) -> u64 {
        self.max_steps
    }

    /// The same simulation from a later state of its motion, with the tolerances that it had there.
    pub(crate) fn going_on_from(self, start: M::State, tolerances: Tolerances) -> Self {
        Self { start, first: None, tolerances: Some((tolerances, ToleranceOption::Tolerances)), ..self }
    }

    /// Whether implicit steps that are so much longer than these that they are worthwhile are as accurate:
    /// what stiffness means. `stiffness_detection.rs` says why.
    #[cold]
    pub(crate) fn is_stiff(
        &self,
        constants: &M::Constants,
        options: &StepOptions,
        (t, y): (f64, &Phase<M::Vector>),
        mean_step: f64,
    ) -> bool {
        let Some(end) = self.end else { return false };
        let tolerance = options.tolerances.absolute.max(options.tolerances.relative);
        if M::Vector::LEN > MAX_IMPLICIT_COORDINATES
            || tolerance < FINEST_TOLERANCE
            || mean_step > 0.5 * options.most
        {
            return false;
        }
        let Ok(a) = self.model.accelerations_with(constants, &self.state_at(t, y)) else { return false };
        let now = StepNode { t, y: *y, a };
        LENGTHS_FROM_ONE_PLACE.iter().all(|part| {
            let h = (part * worthwhile_factor(M::Vector::LEN) * mean_step).copysign(end - t);
            h.abs() <= (end - t).abs() && self.implicit_step_passes(constants, &options.tolerances, now, h)
        })
    }

    /// The option that lanes do not have, if one is set.
    fn option_without_lanes(&self) -> Option<&'static str> {
        // All options, so that none is forgotten.
        let Self {
            model: _,
            start: _,
            end: _,
            method,
            tolerances: _,
            fixed,
            first: _,
            most: _,
            max_steps: _,
            output,
            law,
            added_events: _,
            actions: _,
            contacts,
            sticking,
            formulation,
            drift_limit,
            consistent_output,
            estimates_error,
            cancel,
            cancel_when,
            #[cfg(feature = "progress")]
            progress,
        } = self;
        #[cfg(not(feature = "progress"))]
        let progress = &false;
        let options = [
            (method.is_some(), "`.method(..)`"),
            (fixed.is_some(), "`.fixed_step(..)`"),
            (law.is_some(), "`.inputs(..)`"),
            (!contacts.is_empty(), "`.contact(..)`"),
            (!sticking.is_empty(), "`.stick_slip(..)`"),
            (formulation.is_some(), "`.formulation(..)`"),
            (cancel.is_some(), "`.cancel(..)`"),
            (cancel_when.is_some(), "`.cancel_when(..)`"),
            // Not above 0, or not a number: its own run reports it.
            (drift_limit.partial_cmp(&0.0) != Some(core::cmp::Ordering::Greater), "`.drift_limit(..)`"),
            (*consistent_output, "`.consistent_output()`"),
            (*estimates_error, "`.estimate_error()`"),
            (*progress, "`.progress()`"),
            (!matches!(output, Output::Steps), "output times"),
        ];
        options.iter().find(|(is_set, _)| *is_set).map(|(_, option)| *option)
    }

    /// Why the simulation is made alone and not side by side with others; `None` where it may be in a lane.
    // Public for dynamics-ensembles alone.
    #[doc(hidden)]
    #[must_use]
    pub fn made_alone_because(&self) -> Option<String> {
        if !M::IS_UNCONSTRAINED {
            return Some(format!("`{}` has constraints", M::NAME));
        }
        if !M::HAS_LANES {
            let why = "has expressions that choose (`if`, `abs`, `min`), or no straight-line code";
            return Some(format!("`{}` {why}", M::NAME));
        }
        self.option_without_lanes().map(|option| format!("the option is set: {option}"))
    }

    /// What a lane needs; `None` where the simulation is to be run alone: it has options that lanes do not
    /// have, or its start or its options are wrong, which its own run reports.
    pub(crate) fn side_by_side(&self) -> Option<LanePlan<M>> {
        let Self { end, tolerances, .. } = self;
        let is_plain = self.option_without_lanes().is_none();
        let end = end.filter(|end| is_plain && end.is_finite() && *end != self.start.t())?;
        check_event_names(&self.event_names(), M::EVENTS.len()).ok()?;
        OptionError::check_parameters(self.model).ok()?;
        self.check_start().ok()?;
        let mut options = self.check_steps().ok()?;
        let constants = self.model.constants().ok()?;
        let events = self.watched_events()?;
        if tolerances.is_none_or(|(_, option)| option == ToleranceOption::Tolerance) {
            let method: SharedMethod<M> = Arc::new(choice::Verner9);
            self.make_pilot_run(&method, &constants, &mut options, end);
        }
        let mut accelerations = |t: f64, q: &M::Vector, u: &M::Vector| -> Result<M::Vector, SolveError> {
            self.model.accelerations_with(&constants, &self.state_at(t, &Phase { q: *q, u: *u }))
        };
        let y = Phase { q: *self.start.q(), u: *self.start.u() };
        let stepper = Stepper::<M::Vector, Verner9<M::Vector>>::new(
            &mut accelerations,
            self.start.t(),
            y,
            end,
            options,
        )
        .ok()?;
        let first = stepper.proposed_step();
        Some(LanePlan { constants, options, end, first, events })
    }

    /// The events that act, with their values at the start; `None` where a name is unknown, or where a value
    /// is zero or does not exist.
    fn watched_events(&self) -> Option<WatchedEvents> {
        let mut events = Vec::with_capacity(self.actions.len());
        for (name, direction, _) in &self.actions {
            let own = M::EVENTS.iter().position(|event| event.name == name);
            let added = || Some(M::EVENTS.len() + self.added_events.iter().position(|e| e.name == *name)?);
            let index = own.or_else(added)?;
            events.push(WatchedEvent { index, direction: *direction, values: [0.0; EVENT_PARTS + 1] });
        }
        let mut watched = WatchedEvents { events, of_model: vec![0.0; M::EVENTS.len()] };
        let is_crossed = |event: &WatchedEvent| event.values[EVENT_PARTS] == 0.0;
        let has_values = self.evaluate(&mut watched, &self.start, EVENT_PARTS);
        (has_values && !watched.events.iter().any(is_crossed)).then_some(watched)
    }

    /// Evaluates events at a state, the end of a part of a step. False where one has no value.
    fn evaluate(
        &self,
        WatchedEvents { events, of_model }: &mut WatchedEvents,
        state: &M::State,
        part: usize,
    ) -> bool {
        let is_of_model = |event: &WatchedEvent| event.index < M::EVENTS.len();
        if events.iter().any(is_of_model) && self.model.events(state, of_model).is_err() {
            return false;
        }
        let mut has_values = true;
        for event in events {
            let value = match of_model.get(event.index) {
                Some(value) => *value,
                None => (self.added_events[event.index - M::EVENTS.len()].function)(state),
            };
            has_values &= !value.is_nan();
            event.values[part] = value;
        }
        has_values
    }

    /// Whether an event may have acted in a step: its function has changed its sign between parts, comes near
    /// zero, or has no value.
    pub(crate) fn may_act(&self, watched: &mut WatchedEvents, from: &M::State, to: &M::State) -> bool {
        watched.events.iter_mut().for_each(|event| event.values[0] = event.values[EVENT_PARTS]);
        (1..EVENT_PARTS).any(|part| !self.evaluate(watched, &self.between(from, to, part), part))
            || !self.evaluate(watched, to, EVENT_PARTS)
            || watched.events.iter().any(WatchedEvent::may_act)
    }

    /// The state at the end of a part of a step, by the cubic through q and q̇ at the ends of the step.
    fn between(&self, from: &M::State, to: &M::State, part: usize) -> M::State {
        let (h, x) = (to.t() - from.t(), part as f64 / EVENT_PARTS as f64);
        let mut y = Phase { q: *from.q(), u: *from.u() };
        for i in 0..M::Vector::LEN {
            let (u, v) = (from.u()[i], to.u()[i]);
            let slope = (to.q()[i] - from.q()[i]) / h;
            let (bend, twist) = (3.0 * slope - 2.0 * u - v, u + v - 2.0 * slope);
            y.q[i] += h * x * (u + x * (bend + x * twist));
            y.u[i] = u + x * (2.0 * bend + 3.0 * x * twist);
        }
        self.state_at(from.t() + x * h, &y)
    }
}

impl WatchedEvent {
    /// Whether the function changes its sign in the step in a direction that counts, or a parabola through
    /// its values comes near zero.
    fn may_act(&self) -> bool {
        let crosses = |pair: &[f64]| {
            let found = if pair[0] < 0.0 { Direction::Rising } else { Direction::Falling };
            pair[0].signum() != pair[1].signum() && self.direction.admits(found)
        };
        self.values.contains(&0.0)
            || self.values.windows(2).any(crosses)
            || self.values.windows(3).any(|values| comes_near_zero([values[0], values[1], values[2]]))
    }
}

/// Whether the parabola through three values of one sign comes near zero between them.
fn comes_near_zero(values: [f64; 3]) -> bool {
    // p(x) = a − slope x + bend x², x from 0 to 1, positive away from zero.
    let [a, b, c] = values.map(|value| value * values[0].signum());
    let (slope, bend) = (3.0 * a - 4.0 * b + c, 2.0 * a - 4.0 * b + 2.0 * c);
    let has_minimum = slope > 0.0 && slope < 2.0 * bend;
    let least = a - slope * slope / (4.0 * bend);
    has_minimum && b > 0.0 && c > 0.0 && least < NEAR_EVENT * a.max(b).max(c)
}

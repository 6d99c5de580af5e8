//! Event location: the crossings of all event functions within a step, and their signs from step to step.
//!
//! [`EventLocator::scan`] samples the functions on the step's interpolant and follows each from sample to
//! sample: `Scan::follow` (`integrate/events/crossing.rs`) brackets the crossings, `root` (`root.rs` there)
//! locates them. `run/event_steps.rs` then ends the step at the first crossing that calls for an action.
//!
//! * A function that is exactly zero at the start of the motion has not crossed. Only a reset for one
//!   direction is applied there, if the motion leaves zero in that direction (a ball that starts on the floor
//!   moving down bounces).
//! * After a reset that changed q or q̇, the function that fired restarts where it leaves zero
//!   (`restart.rs`). Turned away, its return is a new crossing, however soon. Continuing with a slope, it has
//!   passed (a kick). At rest and continuing from there (a ball laid on the floor), the event would repeat at
//!   once. That is an error, because a motion that is held needs a constraint.
//! * Events in ever shorter intervals are an error that names the time which they approach (`zeno.rs`).
//! * Contacts whose reactions of least norm push are closed, whether the reactions are unique or not. If one
//!   of them pulls, another choice of the reactions might not. Then it is undecided which contact lifts off,
//!   which is an error.
//! * A contact that lifts off and would close again before it is seen to open has a reaction that grazes
//!   zero. It stays closed for that time: neither the gap nor the pull is resolved.
//! * A function that a constraint holds at zero, up to rounding, has no crossings (`masked.rs`).
//! * A unilateral constraint (`unilateral.rs`) switches where its function falls through zero. Its function
//!   is then another one, and restarts. If that leaves zero downwards the constraint switches again at once;
//!   twice at one instant is an error.

use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;

use crate::model::{ModelState, SimulationModel, StaticTraits, Vector};
use crate::simulate::events::action::EventAction;
use crate::simulate::events::functions::{AddedEvent, EventFunctions};
use crate::simulate::events::restart::{Departure, SignState, departure_from_zero};
use crate::simulate::events::rules::{Action, Flow, Rule, calls_for_action};
use crate::simulate::events::unilateral::{UnilateralConstraint, UnilateralConstraints};
use crate::simulate::failure::SimulationErrorKind as Kind;

use crate::constrain::assemble::CONSISTENT;
use crate::integrate::{Crossing, Direction, Scan, ScanError, Step, StepNode, sample_position};
use crate::linalg::max_abs;
use crate::simulate::events::lift_off::SIMULTANEOUS_THETA;
use crate::simulate::events::lift_off::{LiftOff, classify_lift_off};
use crate::simulate::events::zeno::Zeno;

/// Rounding error of an event function, relative to four times its largest value in the step plus 1 + |q|
/// plus [`rounding_near_start`]: some units in the last place. Changes of sign at this level are no
/// crossings.
const EVENT_ROUNDING: f64 = 4.0 * f64::EPSILON;
/// Largest value in a step, in the function's unit, of a unilateral constraint that other constraints hold at
/// zero. Above it a function that does not leave zero regularly moves, and falls where it is seen below zero.
const AT_REST_VALUE: f64 = 1e-11;

/// Values up to this part of the largest one in the step are zero at a state that an action left: the
/// crossing was located by iteration, not to the last place.
const AT_ZERO: f64 = 1e-13;

/// Drift of a contact while it was closed, in parts of its size. A contact that has just opened may close by
/// this and still lifts off. With a smaller bound formulations that let constraints drift would end there.
const LIFT_OFF_DRIFT: f64 = 1e-9;

/// Parts of a step at which a function has to be held at zero to be masked: its ends and two parts between,
/// at unequal distances, so that a function that is zero at one of them by chance is not masked.
const MASK_PROBES: [f64; 4] = [0.0, 0.3, 0.6, 1.0];

/// Locates the events of a run, and applies their rules.
pub(crate) struct EventLocator<'m, M: SimulationModel> {
    functions: EventFunctions<'m, M>,
    pub(crate) rules: Vec<Rule<'m, M>>,
    signs_at_start: Vec<SignState>,
    zeno: Vec<Zeno>,
    values: Vec<f64>,
    /// Values of all functions at the samples of the step, sample by sample.
    samples: Vec<f64>,
    /// Parts of the step at which the samples are.
    thetas: Vec<f64>,
    /// Samples (θ, g) of the function that is followed.
    column: Vec<(f64, f64)>,
    start_values: Vec<f64>,
    /// Largest |g| at the samples of the step, per function.
    sizes: Vec<f64>,
    /// Signs at the end of the step.
    signs_at_end: Vec<f64>,
    /// Crossings of the step, in order.
    pub(crate) found: Vec<Crossing>,
    /// Functions that constraints hold at zero, as was found so far.
    masked: Vec<bool>,
}

impl<'m, M: SimulationModel> EventLocator<'m, M> {
    pub(crate) fn new(
        model: &'m M,
        constants: M::Constants,
        added_events: Vec<AddedEvent<'m, M::State>>,
        unilaterals: UnilateralConstraints,
        rules: Vec<Rule<'m, M>>,
    ) -> Self {
        let functions = EventFunctions::new(model, constants, added_events, unilaterals);
        let count = functions.count();
        Self {
            functions,
            rules,
            signs_at_start: vec![SignState::Zero; count],
            zeno: vec![Zeno::default(); count],
            values: vec![0.0; count],
            samples: Vec::new(),
            thetas: Vec::new(),
            column: Vec::new(),
            start_values: vec![0.0; count],
            sizes: vec![0.0; count],
            signs_at_end: vec![0.0; count],
            found: Vec::new(),
            masked: vec![false; count],
        }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.signs_at_start.is_empty()
    }

    pub(crate) fn name(&self, index: usize) -> &str {
        self.functions.name(index)
    }

    /// The unilateral constraints with the indices of their functions.
    pub(crate) fn unilaterals(&self) -> impl Iterator<Item = (usize, &UnilateralConstraint)> + Clone {
        (self.functions.first_unilateral()..).zip(&self.functions.unilaterals)
    }

    /// The function of a unilateral constraint that cannot stay as it is at a state at which constraints were
    /// switched: a contact that would pull, sticking that would break away.
    pub(crate) fn find_untenable(&mut self, state: &M::State) -> Result<Option<usize>, Kind> {
        if self.functions.unilaterals.is_empty() {
            return Ok(None);
        }
        self.evaluate(state)?;
        Ok(self
            .unilaterals()
            .find(|(index, unilateral)| unilateral.is_untenable::<M>(state, self.values[*index]))
            .map(|(index, _)| index))
    }

    /// Names of the events whose functions constraints held at zero.
    pub(crate) fn masked_events(&self) -> Vec<String> {
        (0..self.masked.len())
            .filter(|index| self.masked[*index])
            .map(|index| self.name(index).into())
            .collect()
    }

    /// Resets the locator for another run with the same functions and rules.
    pub(crate) fn restart(&mut self) {
        self.zeno.fill(Zeno::default());
        self.masked.fill(false);
        self.functions.unilaterals.iter_mut().for_each(UnilateralConstraint::restart);
        self.found.clear();
    }

    /// Determines the signs at the start of the motion, or where it restarts.
    pub(crate) fn start_at(&mut self, start: &M::State) -> Result<(), Kind> {
        self.evaluate(start)?;
        for (sign, value) in self.signs_at_start.iter_mut().zip(&self.values) {
            *sign = if *value == 0.0 { SignState::ZeroAtStart } else { SignState::Sign(value.signum()) };
        }
        for index in self.functions.first_unilateral()..self.functions.count() {
            if self.values[index] < 0.0 && !self.functions.holds(index, start) {
                self.functions.check_open(index, start)?;
                self.signs_at_start[index] = SignState::ZeroAtStart;
            }
        }
        Ok(())
    }

    /// Finds the crossings within a step, in their order; `state(θ)` interpolates. The search ends at the
    /// first one that calls for an action, as the step will end there.
    pub(crate) fn scan(
        &mut self,
        step: &Step<M::Vector>,
        parts: usize,
        state: impl Fn(f64) -> M::State,
    ) -> Result<(), Kind> {
        // Samples of all functions, and the rounding errors of their values.
        self.found.clear();
        let size = self.sample(parts, &state)?;
        let resolution = 4.0 * f64::EPSILON * (1.0f64).max(step.start.t.abs() / step.h.abs());
        let rounding = EVENT_ROUNDING * size + rounding_near_start(&step.start, false);
        // Function by function, up to the first crossing so far that calls for an action. An error counts
        // only if it is met before that.
        let (mut horizon, mut first_error) = (1.0, None);
        for index in 0..self.signs_at_start.len() {
            let departure = self.departure(index, &step.start, &state);
            let (start, sign) = match departure {
                // A constraint that the last action engaged may hold the function at zero.
                Err(Kind::EventRepeats { .. }) if self.is_masked_throughout(index, &state)? => (None, 0.0),
                departure => departure?,
            };
            let noise = EVENT_ROUNDING * 4.0 * self.sizes[index] + rounding;
            let mut scan = Scan::new(sign, resolution, noise)
                .up_to(self.first_acting_theta(horizon) + SIMULTANEOUS_THETA);
            let so_far = self.found.len()
                - usize::from(self.found.last().is_some_and(|crossing| crossing.index == index));
            let mut followed = self.follow(index, start, &mut scan, &state);
            if (followed.is_err() || self.found.len() > so_far) && self.is_masked_throughout(index, &state)? {
                // A constraint holds it at zero: its sign is that of rounding.
                self.found.truncate(so_far);
                followed = Ok(());
            }
            self.signs_at_end[index] = scan.sign();
            horizon = self.first_acting_theta(horizon);
            if let Err(error) = followed {
                let earlier = first_error.take().filter(|(theta, _)| *theta <= scan.reached());
                first_error = earlier.or(Some((scan.reached(), error)));
            }
        }
        sort(&mut self.found);
        match first_error {
            Some((theta, error)) if theta <= horizon => Err(error),
            _ => Ok(()),
        }
    }

    /// Whether constraints hold a function at zero throughout a step, see [`EventFunctions::is_masked`].
    #[cold]
    fn is_masked_throughout(&mut self, index: usize, state: &impl Fn(f64) -> M::State) -> Result<bool, Kind> {
        if M::IS_UNCONSTRAINED || index >= self.functions.first_unilateral() {
            return Ok(false);
        }
        for theta in MASK_PROBES {
            if !self.functions.is_masked(index, &state(theta), &mut self.values)? {
                return Ok(false);
            }
        }
        self.masked[index] = true;
        Ok(true)
    }

    /// Samples all functions at the ends of the parts of a step. Returns 1 + max |q|.
    fn sample(&mut self, parts: usize, state: &impl Fn(f64) -> M::State) -> Result<f64, Kind> {
        self.sizes.fill(0.0);
        self.samples.clear();
        if self.thetas.len() != parts + 1 {
            self.thetas = (0..=parts).map(|part| sample_position(part, parts)).collect();
        }
        let mut size = 0.0f64;
        for part in 0..=parts {
            let state = state(self.thetas[part]);
            self.evaluate(&state)?;
            self.samples.extend_from_slice(&self.values);
            for (size, value) in self.sizes.iter_mut().zip(&self.values) {
                *size = size.max(value.abs());
            }
            size = size.max(max_abs(state.q().as_slice()));
        }
        self.start_values.copy_from_slice(&self.samples[..self.signs_at_start.len()]);
        Ok(1.0 + size)
    }

    /// The first crossing found so far that calls for an action, or else `horizon`.
    fn first_acting_theta(&self, horizon: f64) -> f64 {
        self.found
            .iter()
            .filter(|c| calls_for_action(&self.rules, c))
            .fold(horizon, |first, c| first.min(c.theta))
    }

    /// Finds the crossings of one function, from `start`, where it was seen to leave zero, if it starts at
    /// zero.
    fn follow(
        &mut self,
        index: usize,
        start: Option<(f64, f64)>,
        scan: &mut Scan,
        state: &impl Fn(f64) -> M::State,
    ) -> Result<(), Kind> {
        let Self { functions, values, samples, thetas, column, found, rules, signs_at_start, .. } = self;
        column.clear();
        let own = samples.chunks_exact(signs_at_start.len()).map(|row| row[index]);
        column.extend(thetas.iter().copied().zip(own));
        let mut function = |theta: f64| functions.value(index, &state(theta), values);
        let mut take = |theta, direction| {
            found.push(Crossing { index, theta, direction });
            found.last().is_some_and(|crossing| !calls_for_action(rules, crossing))
        };
        if let Some(start) = start {
            column.retain(|sample| sample.0 > start.0);
            column.insert(0, start);
        }
        let followed = scan.follow(column, &mut function, &mut take);
        followed.map_err(|error| match error {
            ScanError::Function(error) => error,
            ScanError::Unresolved => Kind::EventUnresolved { event: functions.name(index).into() },
        })
    }

    /// Where a function that starts at zero is seen to leave it, and its sign from there on; for other
    /// functions the sign at the start of the step.
    fn departure(
        &mut self,
        index: usize,
        start_node: &StepNode<M::Vector>,
        state: &impl Fn(f64) -> M::State,
    ) -> Result<(Option<(f64, f64)>, f64), Kind> {
        let value = self.start_values[index];
        if let SignState::Sign(sign) = self.signs_at_start[index] {
            return match self.functions.grazes_until(index, &state(0.0)) {
                Some(until) if sign < 0.0 => self.follow_grazing(index, until, state),
                _ => Ok((None, sign)),
            };
        }
        let Self { functions, values, .. } = self;
        let is_gap = functions.is_open_gap(index, &state(0.0));
        let noise = rounding_near_start(start_node, is_gap);
        let departure =
            departure_from_zero(value, noise, &mut |theta| functions.value(index, &state(theta), values))?;
        if is_gap
            && matches!(self.signs_at_start[index], SignState::JustFired(_))
            && !departure.is_seen_to_rise()
        {
            let drift = (2.0 * value.abs()).max(LIFT_OFF_DRIFT * functions.gap_size(index, &state(0.0)));
            let until =
                match classify_lift_off(drift, &mut |theta| functions.value(index, &state(theta), values))? {
                    LiftOff::Opens(start) => return Ok((Some(start), 1.0)),
                    LiftOff::Falls(theta) => theta,
                    LiftOff::Stays => 1.0,
                };
            self.functions.note_grazing(index, start_node.t, state(until).t());
        }
        let (Departure::Slope { theta, value: now } | Departure::Tangent { theta, value: now }) = departure
        else {
            return self.departure_not_seen(index, departure);
        };
        let direction = if now > 0.0 { Direction::Rising } else { Direction::Falling };
        match self.signs_at_start[index] {
            SignState::JustFired(_) | SignState::ZeroAtStart | SignState::Zero
                if index >= self.functions.first_unilateral() && direction == Direction::Falling =>
            {
                self.functions.note_reaction_ahead(index, &state(theta))?;
                self.found.push(Crossing { index, theta: 0.0, direction });
            }
            // With a slope it passes on: the reset only slowed it. Without a slope the reset brought it to
            // rest at the event, which would repeat at once.
            SignState::JustFired(fired)
                if fired == direction && matches!(departure, Departure::Tangent { .. }) =>
            {
                return Err(self.repeats_error(index));
            }
            SignState::ZeroAtStart if self.has_reset_for(index, direction) => {
                self.found.push(Crossing { index, theta: 0.0, direction });
                // With a slope it passes on.
                if matches!(departure, Departure::Slope { .. }) {
                    self.signs_at_start[index] = SignState::Zero;
                }
            }
            _ => {}
        }
        Ok((Some((theta, now)), now.signum()))
    }

    /// A closed contact whose reaction grazes zero and is negative at the start: it is followed from the time
    /// up to which it may pull, and released if it is negative there.
    fn follow_grazing(
        &mut self,
        index: usize,
        until: f64,
        state: &impl Fn(f64) -> M::State,
    ) -> Result<(Option<(f64, f64)>, f64), Kind> {
        let (from, to) = (state(0.0).t(), state(1.0).t());
        let theta = ((until - from) / (to - from)).clamp(0.0, 1.0);
        let value = self.functions.value(index, &state(theta), &mut self.values)?;
        if value < 0.0 && theta < 1.0 {
            self.found.push(Crossing { index, theta, direction: Direction::Falling });
        }
        Ok((Some((theta, value)), if value < 0.0 { -1.0 } else { 1.0 }))
    }

    /// Treats a function that is not seen to leave zero. An open contact that returns before it is seen to
    /// open touches again at once.
    fn departure_not_seen(
        &mut self,
        index: usize,
        departure: Departure,
    ) -> Result<(Option<(f64, f64)>, f64), Kind> {
        let is_unilateral = index >= self.functions.first_unilateral();
        match departure {
            Departure::Hidden { sign } if is_unilateral && sign > 0.0 => {
                self.found.push(Crossing { index, theta: 0.0, direction: Direction::Falling });
                Ok((None, 0.0))
            }
            Departure::Hidden { .. } if matches!(self.signs_at_start[index], SignState::JustFired(_)) => {
                Err(self.repeats_error(index))
            }
            // It moves irregularly: it falls where it is seen below zero.
            Departure::Constant if is_unilateral && self.sizes[index] > AT_REST_VALUE => Ok((None, 1.0)),
            _ => Ok((None, 0.0)),
        }
    }

    fn repeats_error(&self, index: usize) -> Kind {
        Kind::EventRepeats { event: self.name(index).into() }
    }

    /// Whether a reset is declared for exactly this direction of the function.
    fn has_reset_for(&self, index: usize, direction: Direction) -> bool {
        let resets = |action: &Action<'_, M>| matches!(action, Action::Reset(_));
        self.rules.iter().any(|r| r.index == index && r.direction == direction && resets(&r.action))
    }

    /// Index in `found` of the first crossing that calls for an action.
    pub(crate) fn first_acting(&self) -> Option<usize> {
        self.found.iter().position(|c| calls_for_action(&self.rules, c))
    }

    /// Moves crossings to the end of the step, which was made to end at them: the end is more accurate than
    /// the interpolant. All crossings that the scan found of an acting function are replaced; of others the
    /// last one of the same direction.
    pub(crate) fn move_to_step_end(&mut self, known: &[Crossing]) {
        for crossing in known {
            if calls_for_action(&self.rules, crossing) {
                self.found.retain(|c| c.index != crossing.index);
            } else if let Some(last) = self.found.iter().rposition(|c| c.index == crossing.index)
                && self.found[last].direction == crossing.direction
            {
                self.found.remove(last);
            }
            self.found.push(*crossing);
        }
    }

    /// Discards the crossings after the first acting one, except those at the same instant.
    pub(crate) fn discard_after(&mut self, acting: usize) {
        let theta = self.found[acting].theta;
        self.found.retain(|c| c.theta <= theta + SIMULTANEOUS_THETA);
    }

    /// The step had no action: the next one starts with the signs at its end.
    pub(crate) fn continue_without_action(&mut self) {
        for (sign_at_start, sign) in self.signs_at_start.iter_mut().zip(&self.signs_at_end) {
            *sign_at_start = if *sign == 0.0 { SignState::Zero } else { SignState::Sign(*sign) };
        }
    }

    /// Applies the rules of a crossing. Returns whether the simulation stops.
    pub(crate) fn apply_rules(&mut self, crossing: &Crossing, change: &mut EventAction<'_, M>) -> bool {
        let mut stop = false;
        for rule in &mut self.rules {
            if rule.index != crossing.index || !rule.direction.admits(crossing.direction) {
                continue;
            }
            stop |= match &mut rule.action {
                Action::Stop => true,
                Action::Reset(reset) => reset(change) == Flow::Stop,
                Action::UnilateralConstraint(unilateral) => {
                    self.functions.unilaterals[*unilateral].switch(change);
                    false
                }
            };
        }
        stop
    }

    /// Determines the signs after the actions at the crossings from `acting` on. `place` is the state at
    /// which they happened, if the state after lies beyond it: functions that cross zero in between have not
    /// crossed yet.
    pub(crate) fn continue_after_actions(
        &mut self,
        acting: usize,
        before: &M::State,
        after: &M::State,
        place: Option<&M::State>,
        h: f64,
    ) -> Result<(), Kind> {
        let switched = before.active_set() != after.active_set();
        let moved = switched || before.q() != after.q() || before.u() != after.u();
        self.evaluate(before)?;
        self.start_values.copy_from_slice(&self.values);
        if let Some(place) = place {
            self.evaluate(place)?;
        }
        let at_place = place.map(|_| self.values[..self.functions.first_unilateral()].to_vec());
        self.evaluate(after)?;
        at_place.iter().for_each(|values| self.values[..values.len()].copy_from_slice(values));
        for index in 0..self.signs_at_start.len() {
            let value = self.values[index];
            let fired = self.found[acting..]
                .iter()
                .rev()
                .find(|c| c.index == index && calls_for_action(&self.rules, c))
                .copied();
            let noise = (4.0 * self.start_values[index].abs()).max(AT_ZERO * self.sizes[index]);
            if index >= self.functions.first_unilateral() {
                self.signs_at_start[index] = self.unilateral_after_action(index, after, fired.is_some())?;
                if self.functions.is_closed(index, after) {
                    self.zeno[index] = Zeno::default();
                } else if fired.is_some() {
                    let name = self.name(index).into();
                    let speed = self.functions.impact_speed(index, before);
                    self.zeno[index].note_event(before.t(), h, speed, name)?;
                }
                continue;
            }
            self.signs_at_start[index] = match fired {
                Some(c) if moved && value.abs() <= noise => {
                    let name = self.name(index).into();
                    self.zeno[index].note_event(before.t(), h, 0.0, name)?;
                    SignState::JustFired(c.direction)
                }
                // A reset that leaves a ball at rest on the floor at the start would repeat at once. One that
                // leaves a function that passes zero with a slope only observes it.
                Some(c)
                    if c.theta == 0.0
                        && before == after
                        && self.signs_at_start[index] == SignState::ZeroAtStart =>
                {
                    return Err(self.repeats_error(index));
                }
                Some(c) if !moved => {
                    SignState::Sign(if c.direction == Direction::Rising { 1.0 } else { -1.0 })
                }
                _ if value == 0.0 => SignState::Zero,
                // The constraint that held it at zero was released: it leaves zero from there, whatever its
                // sign is by rounding.
                None if switched && self.functions.is_masked(index, before, &mut self.values.clone())? => {
                    SignState::Zero
                }
                _ if moved || fired.is_some() => SignState::Sign(value.signum()),
                _ => self.sign_without_action(index, value),
            };
        }
        Ok(())
    }

    /// The sign of a unilateral constraint at a state that an action left, at which `values` were evaluated.
    /// One that fell to zero and was released or rebounds restarts there, see [`EventLocator::departure`].
    fn unilateral_after_action(
        &mut self,
        index: usize,
        after: &M::State,
        fired: bool,
    ) -> Result<SignState, Kind> {
        let value = self.values[index];
        let holds = self.functions.holds(index, after);
        if value < 0.0 && !holds {
            self.functions.check_open(index, after)?;
        }
        let unilateral = &self.functions.unilaterals[index - self.functions.first_unilateral()];
        // A constraint that slips to the other side since a jump, or a contact above the ground that fell
        // away, is away from zero.
        let is_away_from_zero = match unilateral.is_contact() {
            true => value > 0.0 && !holds && self.functions.is_open(index, after),
            false => value > CONSISTENT * self.sizes[index],
        };
        let at_zero = !holds
            && (fired && !is_away_from_zero || value <= 0.0 || value.abs() <= AT_ZERO * self.sizes[index]);
        // At zero up to rounding.
        Ok(if holds && unilateral.grazes_at(after.t()) {
            SignState::Sign(-1.0)
        } else if at_zero || value == 0.0 {
            SignState::JustFired(Direction::Falling)
        } else {
            SignState::Sign(value.signum())
        })
    }

    /// The sign of a function without action at a state that no action moved: by its last crossing, as its
    /// value may still be zero up to rounding.
    fn sign_without_action(&self, index: usize, value: f64) -> SignState {
        match self.found.iter().rev().find(|c| c.index == index) {
            Some(c) => SignState::Sign(if c.direction == Direction::Rising { 1.0 } else { -1.0 }),
            None => SignState::Sign(value.signum()),
        }
    }

    /// Value of one function at a state.
    pub(crate) fn value(&mut self, index: usize, state: &M::State) -> Result<f64, Kind> {
        self.functions.value(index, state, &mut self.values)
    }

    fn evaluate(&mut self, state: &M::State) -> Result<(), Kind> {
        self.functions.evaluate(state, &mut self.values)
    }
}

/// Rounding error of a function near the start of a step, by the rounding of the state and of the time. A gap
/// depends on positions alone, other functions on velocities too.
fn rounding_near_start<V: Vector>(StepNode { t, y, a }: &StepNode<V>, is_gap: bool) -> f64 {
    let [q, u, a] = [&y.q, &y.u, a].map(|values| max_abs(values.as_slice()));
    EVENT_ROUNDING * if is_gap { q + t.abs() * u } else { q + u + t.abs() * u.max(a) }
}

fn sort(crossings: &mut [Crossing]) {
    crossings.sort_by(|a, b| a.theta.total_cmp(&b.theta));
}

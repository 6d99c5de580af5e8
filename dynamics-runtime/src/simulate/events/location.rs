//! Watches the event functions through every step.
//!
//! Rules that the code below follows:
//!
//! * A function that is exactly zero at the start has not crossed. Only a reset that is called for rising or
//!   for falling alone is applied there, when the motion leaves zero in that direction (a ball that starts on
//!   the floor moving down bounces).
//! * After a reset that changed q or u, the function that fired starts again from where it leaves zero:
//!   turned away, coming back is a new crossing, however soon; going on with a slope, it has passed (a kick);
//!   at rest and going on from there (a ball laid down on the floor), the event would happen again at once:
//!   an error, because a motion that is held needs a constraint.
//! * Events that follow each other in ever shorter time are an error that names the time they approach.
//! * Contacts whose reactions of least norm push bear what they have to, unique or not. One of them that
//!   pulls may do so for another choice of reactions only: then which one lifts off is not decided, and that
//!   is an error.
//! * A contact that lifts off and would be back before it is seen to open has grazed zero with its reaction,
//!   and goes on holding for as long as that takes: neither a gap nor a pull of that size is resolved.
//! * What crosses zero because a constraint that holds keeps it there, but for rounding, has not crossed: see
//!   `masked.rs`.
//! * A unilateral constraint (see `unilateral.rs`) acts where its function falls through zero. Where its
//!   constraint was switched, the function is another one, and starts afresh; a unilateral constraint that
//!   leaves zero to the wrong side acts again at once, and doing so twice at one instant is an error.

use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;

use crate::model::{Known, ModelState, SimulationModel, Vector};
use crate::simulate::events::action::EventAction;
use crate::simulate::events::functions::{AddedEvent, EventFunctions};
use crate::simulate::events::restart::Departure;
use crate::simulate::events::unilateral::{UnilateralConstraint, UnilateralConstraints};
use crate::simulate::failure::SimulationErrorKind;

use crate::constrain::assemble::CONSISTENT;
use crate::integrate::{Crossing, Direction, Scan, ScanError, Step, StepNode, sample_position};
use crate::linalg::max_abs;
use crate::simulate::events::lift_off::SIMULTANEOUS;
use crate::simulate::events::lift_off::{Lift, left, lifts};
use crate::simulate::events::zeno::Zeno;

/// Whether a simulation goes on after an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Flow {
    /// It goes on.
    Continue,
    /// It ends here.
    Stop,
}

impl From<()> for Flow {
    fn from((): ()) -> Self {
        Self::Continue
    }
}

/// What is to happen at an event.
pub(crate) enum Action<'m, M: SimulationModel> {
    Stop,
    Reset(Box<Reset<'m, M>>),
    /// The unilateral constraint with this index does what is due.
    UnilateralConstraint(usize),
}

/// An action given by the user.
pub(crate) type Reset<'m, M> = dyn FnMut(&mut EventAction<'_, M>) -> Flow + 'm;

/// An action with the crossings it is meant for.
pub(crate) struct Rule<'m, M: SimulationModel> {
    pub(crate) index: usize,
    pub(crate) direction: Direction,
    pub(crate) action: Action<'m, M>,
}

/// Rounding errors of a function, in parts of four times its largest value in a step plus 1 + |q| and of what
/// [`early_noise`] adds.
const NOISE: f64 = 4.0 * f64::EPSILON;
/// A unilateral constraint whose function stays below this is at zero throughout a step, held there by
/// others.
const RESTLESS: f64 = 1e-11;

/// What an open contact may close further, in parts of the size of what it involves, where it has just opened
/// and opens for good: what has drifted while it was closed.
const LIFT: f64 = 1e-9;

/// What is known of a function where a step starts.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Standing {
    /// Its sign, 1 or −1.
    Sign(f64),
    /// It is zero at the start of the motion.
    ZeroAtStart,
    /// It is zero after a reset at a crossing in this direction.
    JustFired(Direction),
    /// It is zero for another reason.
    Zero,
}

/// The event functions of a run with their actions.
pub(crate) struct EventLocator<'m, M: SimulationModel> {
    functions: EventFunctions<'m, M>,
    pub(crate) rules: Vec<Rule<'m, M>>,
    standing: Vec<Standing>,
    zeno: Vec<Zeno>,
    values: Vec<f64>,
    /// Values of all functions at the samples of the step, one sample after the other.
    samples: Vec<f64>,
    /// Where in the step the samples are.
    places: Vec<f64>,
    /// Samples (θ, g) of one function.
    column: Vec<(f64, f64)>,
    start_values: Vec<f64>,
    /// Largest |g| at the samples of the step, per function.
    sizes: Vec<f64>,
    /// Signs at the end of the step.
    signs: Vec<f64>,
    /// Crossings of the step, in order.
    pub(crate) found: Vec<Crossing>,
    /// Functions that constraints were found to hold at zero.
    kept: Vec<bool>,
}

type Fault = SimulationErrorKind;

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
            standing: vec![Standing::Zero; count],
            zeno: vec![Zeno::default(); count],
            values: vec![0.0; count],
            samples: Vec::new(),
            places: Vec::new(),
            column: Vec::new(),
            start_values: vec![0.0; count],
            sizes: vec![0.0; count],
            signs: vec![0.0; count],
            found: Vec::new(),
            kept: vec![false; count],
        }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.standing.is_empty()
    }

    pub(crate) fn name(&self, index: usize) -> &str {
        self.functions.name(index)
    }

    /// The unilateral constraints with the indices of their functions.
    pub(crate) fn unilaterals(&self) -> impl Iterator<Item = (usize, &UnilateralConstraint)> + Clone {
        (self.functions.first_guard()..).zip(&self.functions.unilaterals)
    }

    /// A unilateral constraint that cannot stay as it is at a state at which constraints were switched: its
    /// function's index.
    pub(crate) fn untenable(&mut self, state: &M::State) -> Result<Option<usize>, Fault> {
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
    pub(crate) fn kept(&self) -> Vec<String> {
        (0..self.kept.len()).filter(|index| self.kept[*index]).map(|index| self.name(index).into()).collect()
    }

    /// Forgets a run, for another one with the same functions and actions.
    pub(crate) fn restart(&mut self) {
        self.zeno.fill(Zeno::default());
        self.kept.fill(false);
        self.functions.unilaterals.iter_mut().for_each(UnilateralConstraint::restart);
        self.found.clear();
    }

    /// Signs at the start of the motion.
    pub(crate) fn begin(&mut self, start: &M::State) -> Result<(), Fault> {
        self.evaluate(start)?;
        for (standing, value) in self.standing.iter_mut().zip(&self.values) {
            *standing = if *value == 0.0 { Standing::ZeroAtStart } else { Standing::Sign(value.signum()) };
        }
        for index in self.functions.first_guard()..self.functions.count() {
            if self.values[index] < 0.0 && !self.functions.holds(index, start) {
                self.functions.check_open(index, start)?;
                self.standing[index] = Standing::ZeroAtStart;
            }
        }
        Ok(())
    }

    /// Finds the crossings within a step and orders them; `state(θ)` interpolates. Beyond the first one that
    /// calls for an action, where the step will end, nothing is looked for.
    pub(crate) fn scan(
        &mut self,
        step: &Step<M::Vector>,
        parts: usize,
        state: impl Fn(f64) -> M::State,
    ) -> Result<(), Fault> {
        self.found.clear();
        let size = self.sample(parts, &state)?;
        let resolution = 4.0 * f64::EPSILON * (1.0f64).max(step.start.t.abs() / step.h.abs());
        let rounding = NOISE * size + early_noise(&step.start, false);
        let (mut horizon, mut fault) = (1.0, None);
        for index in 0..self.standing.len() {
            let departure = self.departure(index, &step.start, &state);
            let (start, sign) = match departure {
                // What engaged where the function crossed holds it there from then on.
                Err(Fault::EventRepeats { .. }) if self.is_kept(index, &state)? => (None, 0.0),
                departure => departure?,
            };
            let noise = NOISE * 4.0 * self.sizes[index] + rounding;
            let mut scan = Scan::new(sign, resolution, noise).up_to(self.first_end(horizon) + SIMULTANEOUS);
            let so_far = self.found.len()
                - usize::from(self.found.last().is_some_and(|crossing| crossing.index == index));
            let mut followed = self.follow(index, start, &mut scan, &state);
            if (followed.is_err() || self.found.len() > so_far) && self.is_kept(index, &state)? {
                // Its sign is that of rounding.
                self.found.truncate(so_far);
                followed = Ok(());
            }
            self.signs[index] = scan.sign();
            horizon = self.first_end(horizon);
            if let Err(error) = followed {
                let earlier = fault.take().filter(|(theta, _)| *theta <= scan.reached());
                fault = earlier.or(Some((scan.reached(), error)));
            }
        }
        sort(&mut self.found);
        match fault {
            Some((theta, fault)) if theta <= horizon => Err(fault),
            _ => Ok(()),
        }
    }

    /// Whether a function is zero all over a step because constraints hold, see [`EventFunctions::is_kept`].
    #[cold]
    fn is_kept(&mut self, index: usize, state: &impl Fn(f64) -> M::State) -> Result<bool, Fault> {
        if M::IS_FREE || index >= self.functions.first_guard() {
            return Ok(false);
        }
        for theta in [0.0, 0.3, 0.6, 1.0] {
            if !self.functions.is_kept(index, &state(theta), &mut self.values)? {
                return Ok(false);
            }
        }
        self.kept[index] = true;
        Ok(true)
    }

    /// Samples all functions at the ends of the parts of a step; 1 + |q|.
    fn sample(&mut self, parts: usize, state: &impl Fn(f64) -> M::State) -> Result<f64, Fault> {
        self.sizes.fill(0.0);
        self.samples.clear();
        if self.places.len() != parts + 1 {
            self.places = (0..=parts).map(|part| sample_position(part, parts)).collect();
        }
        let mut size = 0.0f64;
        for part in 0..=parts {
            let state = state(self.places[part]);
            self.evaluate(&state)?;
            self.samples.extend_from_slice(&self.values);
            for (size, value) in self.sizes.iter_mut().zip(&self.values) {
                *size = size.max(value.abs());
            }
            size = size.max(max_abs(state.q().as_slice()));
        }
        self.start_values.copy_from_slice(&self.samples[..self.standing.len()]);
        Ok(1.0 + size)
    }

    /// The first crossing found so far that calls for an action, or else `horizon`.
    fn first_end(&self, horizon: f64) -> f64 {
        self.found.iter().filter(|c| acts(&self.rules, c)).fold(horizon, |first, c| first.min(c.theta))
    }

    /// Follows a function through the step from where it is seen to leave zero, if it starts there.
    fn follow(
        &mut self,
        index: usize,
        start: Option<(f64, f64)>,
        scan: &mut Scan,
        state: &impl Fn(f64) -> M::State,
    ) -> Result<(), Fault> {
        let Self { functions, values, samples, places, column, found, rules, standing, .. } = self;
        column.clear();
        let own = samples.chunks_exact(standing.len()).map(|row| row[index]);
        column.extend(places.iter().copied().zip(own));
        let mut function = |theta: f64| functions.value(index, &state(theta), values);
        let mut take = |theta, direction| {
            found.push(Crossing { index, theta, direction });
            found.last().is_some_and(|crossing| !acts(rules, crossing))
        };
        if let Some(start) = start {
            column.retain(|sample| sample.0 > start.0);
            column.insert(0, start);
        }
        let followed = scan.follow(column, &mut function, &mut take);
        followed.map_err(|error| match error {
            ScanError::Function(fault) => fault,
            ScanError::Unresolved => Fault::EventUnresolved { event: functions.name(index).into() },
        })
    }

    /// Where a function that starts at zero is seen to leave it, and its sign from there or from the start of
    /// the step on.
    fn departure(
        &mut self,
        index: usize,
        knot: &StepNode<M::Vector>,
        state: &impl Fn(f64) -> M::State,
    ) -> Result<(Option<(f64, f64)>, f64), Fault> {
        let value = self.start_values[index];
        if let Standing::Sign(sign) = self.standing[index] {
            return match self.functions.grazes_until(index, &state(0.0)) {
                Some(until) if sign < 0.0 => self.grazing(index, until, state),
                _ => Ok((None, sign)),
            };
        }
        let Self { functions, values, .. } = self;
        let is_position = functions.is_position(index, &state(0.0));
        let noise = early_noise(knot, is_position);
        let left = left(value, noise, &mut |theta| functions.value(index, &state(theta), values))?;
        if is_position && matches!(self.standing[index], Standing::JustFired(_)) && !left.is_seen_to_rise() {
            let drift = (2.0 * value.abs()).max(LIFT * functions.size(index, &state(0.0)));
            let until = match lifts(drift, &mut |theta| functions.value(index, &state(theta), values))? {
                Lift::Opens(start) => return Ok((Some(start), 1.0)),
                Lift::Falls(theta) => theta,
                Lift::Stays => 1.0,
            };
            self.functions.graze(index, knot.t, state(until).t());
        }
        let (Departure::Slope { theta, value: now } | Departure::Tangent { theta, value: now }) = left else {
            return self.hidden_departure(index, left);
        };
        let direction = if now > 0.0 { Direction::Rising } else { Direction::Falling };
        match self.standing[index] {
            Standing::JustFired(_) | Standing::ZeroAtStart | Standing::Zero
                if index >= self.functions.first_guard() && direction == Direction::Falling =>
            {
                self.functions.look_ahead(index, &state(theta))?;
                self.found.push(Crossing { index, theta: 0.0, direction });
            }
            // With a slope it passes on, as a reset that only slows it may want. Without one it was brought
            // to rest at the event.
            Standing::JustFired(fired) if fired == direction && matches!(left, Departure::Tangent { .. }) => {
                return Err(self.repeats(index));
            }
            Standing::ZeroAtStart if self.resets_on(index, direction) => {
                self.found.push(Crossing { index, theta: 0.0, direction });
                // With a slope it passes on there, too.
                if matches!(left, Departure::Slope { .. }) {
                    self.standing[index] = Standing::Zero;
                }
            }
            _ => {}
        }
        Ok((Some((theta, now)), now.signum()))
    }

    /// A contact whose reaction has grazed zero, and is negative: it is followed again from when on it should
    /// be closed, and released where it is negative there.
    fn grazing(
        &mut self,
        index: usize,
        until: f64,
        state: &impl Fn(f64) -> M::State,
    ) -> Result<(Option<(f64, f64)>, f64), Fault> {
        let (from, to) = (state(0.0).t(), state(1.0).t());
        let theta = ((until - from) / (to - from)).clamp(0.0, 1.0);
        let value = self.functions.value(index, &state(theta), &mut self.values)?;
        if value < 0.0 && theta < 1.0 {
            self.found.push(Crossing { index, theta, direction: Direction::Falling });
        }
        Ok((Some((theta, value)), if value < 0.0 { -1.0 } else { 1.0 }))
    }

    /// A function that is not seen to leave zero. An open contact that does not rise, or is back before that
    /// is seen, touches again at once.
    fn hidden_departure(
        &mut self,
        index: usize,
        left: Departure,
    ) -> Result<(Option<(f64, f64)>, f64), Fault> {
        let is_guard = index >= self.functions.first_guard();
        match left {
            Departure::Hidden { sign } if is_guard && sign > 0.0 => {
                self.found.push(Crossing { index, theta: 0.0, direction: Direction::Falling });
                Ok((None, 0.0))
            }
            Departure::Hidden { .. } if matches!(self.standing[index], Standing::JustFired(_)) => {
                Err(self.repeats(index))
            }
            // It moves, if not regularly: where it is seen below zero it has fallen.
            Departure::Constant if is_guard && self.sizes[index] > RESTLESS => Ok((None, 1.0)),
            _ => Ok((None, 0.0)),
        }
    }

    fn repeats(&self, index: usize) -> Fault {
        Fault::EventRepeats { event: self.name(index).into() }
    }

    /// Whether a reset is declared for just this direction of the function.
    fn resets_on(&self, index: usize, direction: Direction) -> bool {
        let resets = |action: &Action<'_, M>| matches!(action, Action::Reset(_));
        self.rules.iter().any(|r| r.index == index && r.direction == direction && resets(&r.action))
    }

    /// Position in `found` of the first crossing that calls for an action.
    pub(crate) fn first_acting(&self) -> Option<usize> {
        self.found.iter().position(|c| acts(&self.rules, c))
    }

    /// Puts crossings to the end of the step, which was made to end at them: what its interpolant says of
    /// them is less. Of those that act it says nothing else, for others rising and falling go on by turns.
    pub(crate) fn end_with(&mut self, known: &[Crossing]) {
        for crossing in known {
            if acts(&self.rules, crossing) {
                self.found.retain(|c| c.index != crossing.index);
            } else if let Some(last) = self.found.iter().rposition(|c| c.index == crossing.index)
                && self.found[last].direction == crossing.direction
            {
                self.found.remove(last);
            }
            self.found.push(*crossing);
        }
    }

    /// Forgets the crossings after the first acting one and what happens with it at the same instant.
    pub(crate) fn cut_after(&mut self, acting: usize) {
        let theta = self.found[acting].theta;
        self.found.retain(|c| c.theta <= theta + SIMULTANEOUS);
    }

    /// No action: the signs at the end of the step are those of the scans.
    pub(crate) fn carry_on(&mut self) {
        for (standing, sign) in self.standing.iter_mut().zip(&self.signs) {
            *standing = if *sign == 0.0 { Standing::Zero } else { Standing::Sign(*sign) };
        }
    }

    /// Calls the actions for a crossing. Returns whether the simulation stops.
    pub(crate) fn act(&mut self, crossing: &Crossing, change: &mut EventAction<'_, M>) -> bool {
        let mut stop = false;
        for rule in &mut self.rules {
            if rule.index != crossing.index || !rule.direction.admits(crossing.direction) {
                continue;
            }
            stop |= match &mut rule.action {
                Action::Stop => true,
                Action::Reset(reset) => reset(change) == Flow::Stop,
                Action::UnilateralConstraint(unilateral) => {
                    self.functions.unilaterals[*unilateral].act(change);
                    false
                }
            };
        }
        stop
    }

    /// Signs after actions at the crossings found from `acting` on. `place`: where they happened, if the
    /// state after lies beyond it: what crosses zero in between has not crossed yet.
    pub(crate) fn resume(
        &mut self,
        acting: usize,
        before: &M::State,
        after: &M::State,
        place: Option<&M::State>,
        h: f64,
    ) -> Result<(), Fault> {
        let switched = before.modes() != after.modes();
        let moved = switched || before.q() != after.q() || before.u() != after.u();
        self.evaluate(before)?;
        self.start_values.copy_from_slice(&self.values);
        if let Some(place) = place {
            self.evaluate(place)?;
        }
        let at_place = place.map(|_| self.values[..self.functions.first_guard()].to_vec());
        self.evaluate(after)?;
        at_place.iter().for_each(|values| self.values[..values.len()].copy_from_slice(values));
        for index in 0..self.standing.len() {
            let value = self.values[index];
            let fired =
                self.found[acting..].iter().rev().find(|c| c.index == index && acts(&self.rules, c)).copied();
            let noise = (4.0 * self.start_values[index].abs()).max(1e-13 * self.sizes[index]);
            if index >= self.functions.first_guard() {
                self.standing[index] = self.guard_after(index, after, fired.is_some())?;
                if self.functions.is_closed(index, after) {
                    self.zeno[index] = Zeno::default();
                } else if fired.is_some() {
                    let name = self.name(index).into();
                    let speed = self.functions.approach(index, before);
                    self.zeno[index].note(before.t(), h, speed, name)?;
                }
                continue;
            }
            self.standing[index] = match fired {
                Some(c) if moved && value.abs() <= noise => {
                    let name = self.name(index).into();
                    self.zeno[index].note(before.t(), h, 0.0, name)?;
                    Standing::JustFired(c.direction)
                }
                // A reset that leaves the ball where it starts, on the floor and at rest, does nothing
                // against what pulls it down. One that leaves what passes zero with a slope only looks at it.
                Some(c)
                    if c.theta == 0.0 && before == after && self.standing[index] == Standing::ZeroAtStart =>
                {
                    return Err(self.repeats(index));
                }
                Some(c) if !moved => {
                    Standing::Sign(if c.direction == Direction::Rising { 1.0 } else { -1.0 })
                }
                _ if value == 0.0 => Standing::Zero,
                // What kept it at zero lets go: it leaves from there, on whatever side rounding has put it.
                None if switched && self.functions.is_kept(index, before, &mut self.values.clone())? => {
                    Standing::Zero
                }
                _ if moved || fired.is_some() => Standing::Sign(value.signum()),
                _ => self.crossed_or_held(index, value),
            };
        }
        Ok(())
    }

    /// Where a unilateral constraint stands at a state that an action left; `values` are those there. What
    /// fell to zero and was released or thrown back starts anew from there, see [`EventLocator::departure`].
    fn guard_after(&mut self, index: usize, after: &M::State, fired: bool) -> Result<Standing, Fault> {
        let value = self.values[index];
        let holds = self.functions.holds(index, after);
        if value < 0.0 && !holds {
            self.functions.check_open(index, after)?;
        }
        let unilateral = &self.functions.unilaterals[index - self.functions.first_guard()];
        // What slips to the other side since a jump, or stands over the ground that was left, is not about
        // zero.
        let leapt = match unilateral.is_contact() {
            true => value > 0.0 && !holds && self.functions.is_apart(index, after),
            false => value > CONSISTENT * self.sizes[index],
        };
        let at_zero = !holds && (fired && !leapt || value <= 0.0 || value.abs() <= 1e-13 * self.sizes[index]);
        // About zero, whatever rounding makes of it.
        Ok(if holds && unilateral.grazes_at(after.t()) {
            Standing::Sign(-1.0)
        } else if at_zero || value == 0.0 {
            Standing::JustFired(Direction::Falling)
        } else {
            Standing::Sign(value.signum())
        })
    }

    /// The sign of a function that did not act, at a state that was not moved: near zero its last crossing
    /// decides.
    fn crossed_or_held(&self, index: usize, value: f64) -> Standing {
        match self.found.iter().rev().find(|c| c.index == index) {
            Some(c) => Standing::Sign(if c.direction == Direction::Rising { 1.0 } else { -1.0 }),
            None => Standing::Sign(value.signum()),
        }
    }

    /// Value of one function at a state.
    pub(crate) fn value(&mut self, index: usize, state: &M::State) -> Result<f64, Fault> {
        self.functions.value(index, state, &mut self.values)
    }

    fn evaluate(&mut self, state: &M::State) -> Result<(), Fault> {
        self.functions.evaluate(state, &mut self.values)
    }
}

/// Rounding errors of a function near the start of a step, of positions alone or of velocities too: what it
/// is taken of is rounded, and so are the times.
fn early_noise<V: Vector>(StepNode { t, y, a }: &StepNode<V>, is_position: bool) -> f64 {
    let [q, u, a] = [&y.q, &y.u, a].map(|values| max_abs(values.as_slice()));
    NOISE * if is_position { q + t.abs() * u } else { q + u + t.abs() * u.max(a) }
}

fn sort(crossings: &mut [Crossing]) {
    crossings.sort_by(|a, b| a.theta.total_cmp(&b.theta));
}

/// Whether a crossing calls for an action.
fn acts<M: SimulationModel>(rules: &[Rule<'_, M>], crossing: &Crossing) -> bool {
    rules.iter().any(|r| r.index == crossing.index && r.direction.admits(crossing.direction))
}

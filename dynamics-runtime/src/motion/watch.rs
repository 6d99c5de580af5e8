//! Watches the event functions through every step.
//!
//! Rules that the code below follows:
//!
//! * A function that is exactly zero at the start has not crossed. Only a reset that is called for rising or for falling alone
//!   is applied there, when the motion leaves zero in that direction (a ball that starts on the floor moving down bounces).
//! * After a reset that changed q or u, the function that fired starts again from where it leaves zero: turned away, coming back is a
//!   new crossing, however soon; going on with a slope, it has passed (a kick); at rest and going on from there (a ball laid down
//!   on the floor), the event would happen again at once: an error, because a motion that is held needs a constraint.
//! * Events that follow each other in ever shorter time are an error that names the time they approach.
//! * Contacts whose reactions of least norm push bear what they have to, unique or not. One of them that pulls may do so for another choice of reactions
//!   only: then which one lifts off is not decided, and that is an error.
//! * A guard (see `guard.rs`) acts where its function falls through zero. Where its constraint was switched, the function is another
//!   one, and starts afresh; a guard that leaves zero to the wrong side acts again at once, and doing so twice at one instant is an error.

use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;
use core::cell::RefCell;

use super::change::Change;
use super::error::SimulationErrorKind;
use super::guard::{Guard, Guards};
use super::leave::{Leave, leave};
use super::simulate::Simulate;
use super::upkeep::apart;
use crate::constrain::{self, OutcomeOf};
use crate::error::SolveError;
use crate::integrate::{Crossing, Dense, Direction, Scan, Step};
use crate::model::{Events, ModelState};

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

/// An event function given at the simulation.
pub(crate) struct AdHoc<'m, S> {
    pub(crate) name: String,
    pub(crate) function: Box<dyn Fn(&S) -> f64 + 'm>,
}

/// What is to happen at an event.
pub(crate) enum Action<'m, M: Simulate> {
    Stop,
    Reset(Box<Reset<'m, M>>),
    /// The guard with this index does what is due.
    Guard(usize),
}

/// An action given by the user.
pub(crate) type Reset<'m, M> = dyn FnMut(&mut Change<'_, M>) -> Flow + 'm;

/// An action with the crossings it is meant for.
pub(crate) struct Rule<'m, M: Simulate> {
    pub(crate) index: usize,
    pub(crate) direction: Direction,
    pub(crate) action: Action<'m, M>,
}

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
pub(crate) struct Watch<'m, M: Simulate> {
    functions: Functions<'m, M>,
    pub(crate) rules: Vec<Rule<'m, M>>,
    standing: Vec<Standing>,
    zeno: Vec<Zeno>,
    values: Vec<f64>,
    scratch: Vec<f64>,
    start_values: Vec<f64>,
    /// Largest |g| met in the step, per function.
    sizes: Vec<f64>,
    scans: Vec<Scan>,
    /// Crossings of the step, in order.
    pub(crate) found: Vec<Crossing>,
}

type Fault = SimulationErrorKind;

/// The functions that are watched: those of the model, those given at the simulation, those of the guards.
struct Functions<'m, M: Simulate> {
    model: &'m M,
    constants: M::Constants,
    ad_hoc: Vec<AdHoc<'m, M::State>>,
    guards: Guards,
    /// For reactions of guards.
    workspace: RefCell<Vec<f64>>,
}

impl<'m, M: Simulate> Functions<'m, M> {
    fn new(model: &'m M, constants: M::Constants, ad_hoc: Vec<AdHoc<'m, M::State>>, guards: Guards) -> Self {
        let len = if guards.is_empty() { 0 } else { constrain::workspace_len(M::COORDINATES.len(), M::ROWS.len()) };
        Self { model, constants, ad_hoc, guards, workspace: RefCell::new(vec![0.0; len]) }
    }

    fn count(&self) -> usize {
        self.first_guard() + self.guards.len()
    }

    fn first_guard(&self) -> usize {
        M::EVENTS.len() + self.ad_hoc.len()
    }

    fn name(&self, index: usize) -> &str {
        if let Some(event) = M::EVENTS.get(index) {
            return event.name;
        }
        match self.ad_hoc.get(index - M::EVENTS.len()) {
            Some(event) => &event.name,
            None => &self.guards[index - self.first_guard()].name,
        }
    }

    fn evaluate(&self, state: &M::State, values: &mut [f64]) -> Result<(), SolveError> {
        let (own, given) = values.split_at_mut(M::EVENTS.len());
        self.model.events(state, own)?;
        for (value, event) in given.iter_mut().zip(&self.ad_hoc) {
            *value = (event.function)(state);
        }
        let (events, guarded) = values.split_at_mut(self.first_guard());
        let mut known = None;
        for (value, guard) in guarded.iter_mut().zip(&self.guards) {
            *value = guard.value(self.model, state, events, || match known {
                Some(reactions) => Ok(reactions),
                None => self.reactions(state).inspect(|reactions| known = Some(*reactions)),
            })?;
            let is_contact = guard.is_contact() && guard.holds(state);
            if is_contact && *value < 0.0 && known.is_some_and(|reactions| !reactions.unique()) {
                constrain::check_unique(self.model, state, guard.constraint.first, &mut self.workspace.borrow_mut())?;
            }
        }
        Ok(())
    }

    fn holds(&self, index: usize, state: &M::State) -> bool {
        self.guards[index - self.first_guard()].holds(state)
    }

    /// A contact that is open has to be so where it is free, but for rounding.
    fn check_open(&self, index: usize, state: &M::State) -> Result<(), Fault> {
        let guard = &self.guards[index - self.first_guard()];
        if !guard.is_contact() {
            return Ok(());
        }
        match apart(self.model, state, guard.constraint, &mut self.workspace.borrow_mut()) {
            Some((row, residual)) => Err(Fault::Penetration { row, residual }),
            None => Ok(()),
        }
    }

    fn reactions(&self, state: &M::State) -> Result<OutcomeOf<M>, SolveError> {
        constrain::solve(self.model, &self.constants, state, &mut self.workspace.borrow_mut())
    }
}

impl<'m, M: Simulate> Watch<'m, M> {
    pub(crate) fn new(
        model: &'m M,
        constants: M::Constants,
        ad_hoc: Vec<AdHoc<'m, M::State>>,
        guards: Guards,
        rules: Vec<Rule<'m, M>>,
    ) -> Self {
        let functions = Functions::new(model, constants, ad_hoc, guards);
        let count = functions.count();
        Self {
            functions,
            rules,
            standing: vec![Standing::Zero; count],
            zeno: vec![Zeno::default(); count],
            values: vec![0.0; count],
            scratch: vec![0.0; count],
            start_values: vec![0.0; count],
            sizes: vec![0.0; count],
            scans: Vec::with_capacity(count),
            found: Vec::new(),
        }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.standing.is_empty()
    }

    pub(crate) fn name(&self, index: usize) -> &str {
        self.functions.name(index)
    }

    /// The guards with the indices of their functions.
    pub(crate) fn guards(&self) -> impl Iterator<Item = (usize, &Guard)> {
        (self.functions.first_guard()..).zip(&self.functions.guards)
    }

    /// A guard that cannot stay as it is at a state at which constraints were switched: its function's index.
    pub(crate) fn untenable(&mut self, state: &M::State) -> Result<Option<usize>, Fault> {
        if self.functions.guards.is_empty() {
            return Ok(None);
        }
        self.evaluate(state)?;
        Ok(self
            .guards()
            .find(|(index, guard)| guard.is_untenable::<M>(state, self.values[*index]))
            .map(|(index, _)| index))
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

    /// Finds the crossings within a step and orders them; `state(θ)` interpolates.
    pub(crate) fn scan(
        &mut self,
        step: &Step<M::Vector>,
        parts: usize,
        state: impl Fn(f64) -> M::State,
    ) -> Result<(), Fault> {
        self.found.clear();
        self.scans.clear();
        self.sizes.fill(0.0);
        self.evaluate(&state(0.0))?;
        self.start_values.copy_from_slice(&self.values);
        self.evaluate(&state(1.0))?;
        self.note_sizes();
        for index in 0..self.standing.len() {
            let scan = self.departure(index, &state)?;
            self.scans.push(scan);
        }
        let resolution = 4.0 * f64::EPSILON * (1.0f64).max(step.start.t.abs() / step.h.abs());
        for part in 1..=parts {
            let theta = part as f64 / parts as f64;
            self.evaluate(&state(theta))?;
            self.note_sizes();
            self.advance(theta, resolution, &state);
        }
        self.found.sort_by(|a, b| a.theta.total_cmp(&b.theta));
        Ok(())
    }

    fn advance(&mut self, theta: f64, resolution: f64, state: &impl Fn(f64) -> M::State) {
        let Self { functions, values, scratch, scans, found, .. } = self;
        for (index, scan) in scans.iter_mut().enumerate() {
            let mut function = |theta: f64| match functions.evaluate(&state(theta), scratch) {
                Ok(()) => scratch[index],
                Err(_) => f64::NAN,
            };
            if theta <= scan.last_theta() {
                continue;
            }
            scan.sample(theta, values[index], resolution, &mut function, |theta, direction| {
                found.push(Crossing { index, theta, direction });
            });
        }
    }

    /// Where the scan of a function starts in this step, and with which sign.
    fn departure(&mut self, index: usize, state: &impl Fn(f64) -> M::State) -> Result<Scan, Fault> {
        let value = self.start_values[index];
        if let Standing::Sign(sign) = self.standing[index] {
            return Ok(Scan::new(0.0, value, sign));
        }
        let left = leave(value, |theta| {
            self.evaluate(&state(theta))?;
            Ok::<f64, Fault>(self.values[index])
        })?;
        let (Leave::Slope { theta, value: now } | Leave::Tangent { theta, value: now }) = left else {
            let turned_back = matches!((left, self.standing[index]), (Leave::Hidden { .. }, Standing::JustFired(_)));
            return if turned_back { Err(self.repeats(index)) } else { Ok(Scan::new(0.0, value, 0.0)) };
        };
        let direction = if now > 0.0 { Direction::Rising } else { Direction::Falling };
        match self.standing[index] {
            Standing::JustFired(_) | Standing::ZeroAtStart | Standing::Zero
                if index >= self.functions.first_guard() && direction == Direction::Falling =>
            {
                self.found.push(Crossing { index, theta: 0.0, direction });
            }
            // With a slope it passes on, as a reset that only slows it may want. Without one it was brought to rest at the event.
            Standing::JustFired(fired) if fired == direction && matches!(left, Leave::Tangent { .. }) => {
                return Err(self.repeats(index));
            }
            Standing::ZeroAtStart if self.resets_on(index, direction) => {
                self.found.push(Crossing { index, theta: 0.0, direction });
            }
            _ => {}
        }
        Ok(Scan::new(theta, now, now.signum()))
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
        self.found.iter().position(|c| self.acts(c))
    }

    fn acts(&self, crossing: &Crossing) -> bool {
        self.rules.iter().any(|r| r.index == crossing.index && r.direction.admits(crossing.direction))
    }

    /// Forgets the crossings after the first acting one and what happens with it at the same instant.
    pub(crate) fn cut_after(&mut self, acting: usize) {
        let theta = self.found[acting].theta;
        self.found.retain(|c| c.theta <= theta + 1e-12);
    }

    /// No action: the signs at the end of the step are those of the scans.
    pub(crate) fn carry_on(&mut self) {
        for (standing, scan) in self.standing.iter_mut().zip(&self.scans) {
            *standing = if scan.sign() == 0.0 { Standing::Zero } else { Standing::Sign(scan.sign()) };
        }
    }

    /// Calls the actions for a crossing. Returns whether the simulation stops.
    pub(crate) fn act(&mut self, crossing: &Crossing, change: &mut Change<'_, M>) -> bool {
        let mut stop = false;
        for rule in &mut self.rules {
            if rule.index != crossing.index || !rule.direction.admits(crossing.direction) {
                continue;
            }
            stop |= match &mut rule.action {
                Action::Stop => true,
                Action::Reset(reset) => reset(change) == Flow::Stop,
                Action::Guard(guard) => {
                    self.functions.guards[*guard].act(change);
                    false
                }
            };
        }
        stop
    }

    /// Signs after actions at the crossings found from `acting` on.
    pub(crate) fn resume(&mut self, acting: usize, before: &M::State, after: &M::State, h: f64) -> Result<(), Fault> {
        let switched = before.modes() != after.modes();
        let moved = switched || before.q() != after.q() || before.u() != after.u();
        self.evaluate(before)?;
        self.start_values.copy_from_slice(&self.values);
        self.evaluate(after)?;
        for index in 0..self.standing.len() {
            let value = self.values[index];
            let fired = self.found[acting..].iter().rev().find(|c| c.index == index && self.acts(c)).copied();
            let noise = (4.0 * self.start_values[index].abs()).max(1e-13 * self.sizes[index]);
            if index >= self.functions.first_guard() {
                self.standing[index] = self.guard_after(index, after, fired.is_some())?;
                if fired.is_some() {
                    let name = self.name(index).into();
                    self.zeno[index].note(before.t(), h, name)?;
                }
                continue;
            }
            self.standing[index] = match fired {
                Some(c) if moved && value.abs() <= noise => {
                    let name = self.name(index).into();
                    self.zeno[index].note(before.t(), h, name)?;
                    Standing::JustFired(c.direction)
                }
                // A reset that leaves the ball where it starts, on the floor and at rest, does nothing against what pulls it down.
                Some(_) if before == after && self.standing[index] == Standing::ZeroAtStart => {
                    return Err(self.repeats(index));
                }
                Some(c) if !moved => Standing::Sign(if c.direction == Direction::Rising { 1.0 } else { -1.0 }),
                _ if value == 0.0 => Standing::Zero,
                _ if moved || fired.is_some() => Standing::Sign(value.signum()),
                _ => self.crossed_or_held(index, value),
            };
        }
        Ok(())
    }

    /// Where a guard stands at a state that an action left; `values` are those there. What fell to zero and was released or thrown back
    /// starts anew from there, see [`Watch::departure`].
    fn guard_after(&mut self, index: usize, after: &M::State, fired: bool) -> Result<Standing, Fault> {
        let value = self.values[index];
        let holds = self.functions.holds(index, after);
        if value < 0.0 && !holds {
            self.functions.check_open(index, after)?;
        }
        let at_zero = !holds && (fired || value <= 0.0 || value.abs() <= 1e-13 * self.sizes[index]);
        Ok(if at_zero || value == 0.0 {
            Standing::JustFired(Direction::Falling)
        } else {
            Standing::Sign(value.signum())
        })
    }

    /// The sign of a function that did not act, at a state that was not moved: near zero its last crossing decides.
    fn crossed_or_held(&self, index: usize, value: f64) -> Standing {
        match self.found.iter().rev().find(|c| c.index == index) {
            Some(c) => Standing::Sign(if c.direction == Direction::Rising { 1.0 } else { -1.0 }),
            None => Standing::Sign(value.signum()),
        }
    }

    /// Value of one function at a state.
    pub(crate) fn value(&mut self, index: usize, state: &M::State) -> Result<f64, Fault> {
        self.evaluate(state)?;
        Ok(self.values[index])
    }

    fn note_sizes(&mut self) {
        for (size, value) in self.sizes.iter_mut().zip(&self.values) {
            *size = size.max(value.abs());
        }
    }

    fn evaluate(&mut self, state: &M::State) -> Result<(), Fault> {
        self.functions.evaluate(state, &mut self.values).map_err(Fault::from)?;
        match self.values.iter().position(|v| v.is_nan()) {
            Some(index) => Err(Fault::EventNotANumber { event: self.name(index).into() }),
            None => Ok(()),
        }
    }
}

/// Interpolates states within a step.
pub(crate) fn state_within<M: Events, D: Dense<M::Vector>>(
    dense: &D,
    step: &Step<M::Vector>,
    theta: f64,
    with_inputs: impl Fn(f64, &M::Vector, &M::Vector) -> M::State,
) -> M::State {
    if theta >= 1.0 {
        return with_inputs(step.end.t, &step.end.y.q, &step.end.y.u);
    }
    let y = if theta <= 0.0 { step.start.y } else { dense.at(theta) };
    with_inputs(step.start.t + theta * step.h, &y.q, &y.u)
}

/// Guards one event against accumulation: many resets in a row, each sooner than the one before, at last a millionth of the
/// first interval apart.
#[derive(Clone, Copy, Debug, Default)]
struct Zeno {
    last: Option<f64>,
    first_interval: f64,
    interval: f64,
    shrinking: u32,
}

impl Zeno {
    fn note(&mut self, t: f64, h: f64, event: String) -> Result<(), Fault> {
        let Some(last) = self.last.replace(t) else {
            return Ok(());
        };
        let interval = (t - last).abs();
        if interval < self.interval {
            self.shrinking += 1;
        } else {
            (self.first_interval, self.shrinking) = (interval, 0);
        }
        let ratio = interval / self.interval;
        self.interval = interval;
        let accumulates = self.shrinking >= 8 && interval < 1e-6 * self.first_interval;
        let stands = interval <= 16.0 * f64::EPSILON * t.abs();
        if accumulates || stands {
            let left = if ratio < 1.0 { interval * ratio / (1.0 - ratio) } else { 0.0 };
            return Err(Fault::EventsAccumulate { event, at: t + left.copysign(h) });
        }
        Ok(())
    }
}

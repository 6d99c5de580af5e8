//! What happens at an event: actions, what they leave, and how the motion goes on from there.

use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec::Vec;

use crate::integrate::{Crossing, Direction, Phase};
use crate::model::{Known, ModelState, SimulationModel, Vector};
use crate::simulate::events::action::EventAction;
use crate::simulate::events::location::Flow;
use crate::simulate::events::slip_direction;
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::simulate::run::RunState;
use crate::simulate::run::failure::RunFailure;
use crate::simulate::run::monitor::Monitor as _;
use crate::simulate::run::plan::RunPlan;
use crate::simulate::run::sinks::Sink;
use crate::simulate::trajectory::record::{EventRecord, Record};

impl<M: SimulationModel> RunState<'_, '_, '_, M> {
    /// Calls the actions at the state reached and goes on from what they leave.
    pub(crate) fn act(&mut self, sink: &mut dyn Sink<M>, acting: usize, h: f64) -> Result<Flow, RunFailure> {
        let at = |kind| RunFailure { kind, h };
        let before = self.now();
        let mut after = before;
        let crossings: Vec<Crossing> = self.plan.locator.found[acting..].to_vec();
        let mut events = Vec::with_capacity(crossings.len());
        for crossing in &crossings {
            events.push(self.change(crossing, &before, &mut after).map_err(at)?);
        }
        self.conclude(sink, (before, after), events, (acting, None, h))
    }

    /// Goes on from a state that actions left, of another one, with the events so far. `place`: where they
    /// happened, if they left a state beyond it.
    pub(crate) fn conclude(
        &mut self,
        sink: &mut dyn Sink<M>,
        (before, mut after): (M::State, M::State),
        mut events: Vec<EventRecord<M::State>>,
        (acting, place, h): (usize, Option<&M::State>, f64),
    ) -> Result<Flow, RunFailure> {
        let at = |kind| RunFailure { kind, h };
        self.switch_back(&mut after, &mut events).map_err(at)?;
        let flow = if events.iter().any(|event| event.stopped) { Flow::Stop } else { Flow::Continue };
        if before != after {
            self.go_on_from(sink, &before, &after)?;
        }
        // With an inputs law the state after carries what the law says of it.
        let resumed = self.now();
        if let Some(last) = events.last_mut() {
            last.after = resumed;
        }
        events.into_iter().for_each(|event| sink.event(event));
        if flow == Flow::Continue {
            self.plan.locator.resume(acting, &before, &resumed, place, h).map_err(at)?;
        }
        Ok(flow)
    }

    /// Calls the actions of a crossing.
    fn change(
        &mut self,
        crossing: &Crossing,
        before: &M::State,
        after: &mut M::State,
    ) -> Result<EventRecord<M::State>, Kind> {
        let RunPlan { rhs, locator, options, .. } = &mut *self.plan;
        let name: String = locator.name(crossing.index).into();
        let from = *after;
        let change = EventAction::new(rhs.model, rhs.constants, *before, after, &mut rhs.stabilization);
        let mut change = change.after(options);
        let stopped = locator.act(crossing, &mut change);
        let impacts = change
            .finish()
            .map_err(|error| Kind::EventAction { event: name.clone(), error: Box::new(error) })?;
        check_reset::<M>(&name, before, after)?;
        self.put(&name, &from, after)?;
        let Crossing { index, direction, .. } = *crossing;
        Ok(EventRecord { name, index, direction, before: from, after: *after, impacts, stopped })
    }

    /// What slipped before a change slips to the side of its velocity after it; and the state that it left is
    /// put onto the constraints.
    pub(crate) fn put(&mut self, event: &str, from: &M::State, after: &mut M::State) -> Result<(), Kind> {
        let RunPlan { rhs, locator, .. } = &mut *self.plan;
        for (_, unilateral) in locator.unilaterals() {
            unilateral.turn(from.modes(), rhs.model, after, &mut rhs.stabilization);
        }
        if M::IS_UNSWITCHED {
            // Nothing slips.
        } else if from != after {
            for slipping in slip_direction::unfollowed::<M>(
                after.modes(),
                locator.unilaterals().map(|(_, unilateral)| unilateral),
            ) {
                slip_direction::turn(rhs.model, &mut rhs.stabilization, slipping, from.modes(), after);
            }
        }
        if M::IS_FREE {
            // Nothing to put it onto.
        } else if from != after {
            let placed = rhs.stabilization.place(rhs.model, from, after);
            placed
                .map_err(|error| Kind::EventAction { event: event.into(), error: Box::new(error.into()) })?;
        }
        Ok(())
    }

    /// Unilateral constraints that cannot stay as the actions left them act at once: a contact that would
    /// pull lifts off, what sticks and would break away slips.
    pub(crate) fn switch_back(
        &mut self,
        after: &mut M::State,
        events: &mut Vec<EventRecord<M::State>>,
    ) -> Result<(), Kind> {
        if M::IS_UNSWITCHED {
            return Ok(());
        }
        let most = 2 * self.plan.locator.unilaterals().count();
        for _ in 0..=most {
            let Some(index) = self.plan.locator.untenable(after)? else {
                return Ok(());
            };
            let crossing = Crossing { index, theta: 1.0, direction: Direction::Falling };
            let now = *after;
            events.push(self.change(&crossing, &now, after)?);
        }
        let event = events.last().map_or_else(String::new, |event| event.name.clone());
        Err(Kind::EventRepeats { event })
    }

    /// Goes on from a state that actions left.
    pub(crate) fn go_on_from(
        &mut self,
        sink: &mut dyn Sink<M>,
        before: &M::State,
        after: &M::State,
    ) -> Result<(), RunFailure> {
        self.after_step(sink, true)?;
        self.monitors.restart();
        let RunPlan { rhs, end, .. } = &mut *self.plan;
        let stand = Record::new(self.stepper.now(), rhs.held, rhs.modes);
        hold(&mut rhs.held, before.inputs(), after.inputs());
        rhs.modes = after.modes();
        let y = Phase { q: *after.q(), u: *after.u() };
        self.stepper.restart(rhs, before.t(), y, *end).map_err(RunFailure::of_step::<M>)?;
        sink.stand(stand);
        Ok(())
    }
}

/// Holds the inputs that a reset changed; an inputs law, whose values the others may be, sees them in its
/// state.
fn hold<V: Vector>(held: &mut V, before: &V, after: &V) {
    for i in 0..V::LEN {
        if after[i] != before[i] {
            held[i] = after[i];
        }
    }
}

pub(crate) fn check_reset<M: SimulationModel>(
    event: &str,
    before: &M::State,
    after: &M::State,
) -> Result<(), Kind> {
    let bad = |name| Err(Kind::BadReset { event: event.into(), name });
    if after.t() != before.t() {
        return bad("t");
    }
    let not_finite = |v: &[f64]| v.iter().position(|x| !x.is_finite());
    if let Some(i) = not_finite(after.q().as_slice()).or(not_finite(after.u().as_slice())) {
        return bad(M::COORDINATES[i].name);
    }
    match not_finite(after.inputs().as_slice()) {
        Some(i) => bad(M::INPUTS[i].name),
        None => Ok(()),
    }
}

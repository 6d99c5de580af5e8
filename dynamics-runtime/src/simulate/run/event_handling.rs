//! What happens at an event: actions are applied, and the motion restarts from the state that they leave.
//!
//! [`RunState::apply_actions`] applies the rules of all crossings at this instant (`events/location.rs`,
//! `events/action.rs`). The state is checked and made consistent with the constraints; unilateral constraints
//! that cannot stay as they are switch again; the stepper restarts. Where the step ends that leads here is
//! decided in `event_steps.rs`.

use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec::Vec;

use crate::integrate::{Crossing, Direction, Phase};
use crate::model::{ModelState, SimulationModel, StaticTraits, Vector};
use crate::simulate::events::action::EventAction;
use crate::simulate::events::rules::Flow;
use crate::simulate::events::slip_direction;
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::simulate::run::RunState;
use crate::simulate::run::failure::RunFailure;
use crate::simulate::run::monitor::Monitor as _;
use crate::simulate::run::plan::RunPlan;
use crate::simulate::run::sinks::Sink;
use crate::simulate::trajectory::record::{EventRecord, Record};

impl<M: SimulationModel> RunState<'_, '_, '_, M> {
    /// Applies the actions at the current state, and continues from the state that they leave.
    pub(crate) fn apply_actions(
        &mut self,
        sink: &mut dyn Sink<M>,
        acting: usize,
        h: f64,
    ) -> Result<Flow, RunFailure> {
        let failure = |kind| RunFailure { kind, h };
        let before = self.current_state();
        let mut after = before;
        let crossings: Vec<Crossing> = self.plan.locator.found[acting..].to_vec();
        let mut events = Vec::with_capacity(crossings.len());
        for crossing in &crossings {
            events.push(self.act_on_crossing(crossing, &before, &mut after).map_err(failure)?);
        }
        self.continue_after_actions(sink, (before, after), events, (acting, None, h))
    }

    /// Continues from the state `after` that actions made of the state `before`, and gives the events to the
    /// sink. `place` is the state at which they happened, if the state after lies beyond it.
    pub(crate) fn continue_after_actions(
        &mut self,
        sink: &mut dyn Sink<M>,
        (before, mut after): (M::State, M::State),
        mut events: Vec<EventRecord<M::State>>,
        (acting, place, h): (usize, Option<&M::State>, f64),
    ) -> Result<Flow, RunFailure> {
        let failure = |kind| RunFailure { kind, h };
        self.switch_untenable(&mut after, &mut events).map_err(failure)?;
        let flow = if events.iter().any(|event| event.stopped) { Flow::Stop } else { Flow::Continue };
        if before != after {
            self.restart_from(sink, &before, &after)?;
        }
        // The state after has the inputs of the law, if there is one.
        let resumed = self.current_state();
        if let Some(last) = events.last_mut() {
            last.after = resumed;
        }
        events.into_iter().for_each(|event| sink.event(event));
        if flow == Flow::Continue {
            self.plan.locator.continue_after_actions(acting, &before, &resumed, place, h).map_err(failure)?;
        }
        Ok(flow)
    }

    /// Applies the actions of one crossing.
    fn act_on_crossing(
        &mut self,
        crossing: &Crossing,
        before: &M::State,
        after: &mut M::State,
    ) -> Result<EventRecord<M::State>, Kind> {
        let RunPlan { rhs, locator, options, .. } = &mut *self.plan;
        let name: String = locator.name(crossing.index).into();
        let from = *after;
        let change = EventAction::new(rhs.model, rhs.constants, *before, after, &mut rhs.stabilization);
        let mut change = change.at_end_of_steps(options);
        let stopped = locator.apply_rules(crossing, &mut change);
        let impacts = change
            .finish()
            .map_err(|error| Kind::EventAction { event: name.clone(), error: Box::new(error) })?;
        check_reset_state::<M>(&name, before, after)?;
        self.make_consistent(&name, &from, after)?;
        let Crossing { index, direction, .. } = *crossing;
        Ok(EventRecord { name, index, direction, before: from, after: *after, impacts, stopped })
    }

    /// Makes the state that an action left consistent: released friction constraints get the side of their
    /// slip, and the state is checked against the constraints and projected.
    pub(crate) fn make_consistent(
        &mut self,
        event: &str,
        from: &M::State,
        after: &mut M::State,
    ) -> Result<(), Kind> {
        let RunPlan { rhs, locator, .. } = &mut *self.plan;
        for (_, unilateral) in locator.unilaterals() {
            unilateral.align_slip_side(from.active_set(), rhs.model, after, &mut rhs.stabilization);
        }
        if M::IS_UNSWITCHED {
            // Nothing slips.
        } else if from != after {
            for slipping in slip_direction::without_rule::<M>(
                after.active_set(),
                locator.unilaterals().map(|(_, unilateral)| unilateral),
            ) {
                slip_direction::align_side(
                    rhs.model,
                    &mut rhs.stabilization,
                    slipping,
                    from.active_set(),
                    after,
                );
            }
        }
        if M::IS_UNCONSTRAINED {
            // There are no constraints.
        } else if from != after {
            let placed = rhs.stabilization.ensure_consistent_after_action(rhs.model, from, after);
            placed
                .map_err(|error| Kind::EventAction { event: event.into(), error: Box::new(error.into()) })?;
        }
        Ok(())
    }

    /// Switches unilateral constraints that cannot stay as the actions left them: a contact that would pull
    /// lifts off, sticking that would break away slips. An error after two switches for each of them.
    pub(crate) fn switch_untenable(
        &mut self,
        after: &mut M::State,
        events: &mut Vec<EventRecord<M::State>>,
    ) -> Result<(), Kind> {
        if M::IS_UNSWITCHED {
            return Ok(());
        }
        let max_switches = 2 * self.plan.locator.unilaterals().count();
        for _ in 0..=max_switches {
            let Some(index) = self.plan.locator.find_untenable(after)? else {
                return Ok(());
            };
            let crossing = Crossing { index, theta: 1.0, direction: Direction::Falling };
            let now = *after;
            events.push(self.act_on_crossing(&crossing, &now, after)?);
        }
        let event = events.last().map_or_else(String::new, |event| event.name.clone());
        Err(Kind::EventRepeats { event })
    }

    /// Restarts the motion from the state `after` that actions made of the state `before`.
    pub(crate) fn restart_from(
        &mut self,
        sink: &mut dyn Sink<M>,
        before: &M::State,
        after: &M::State,
    ) -> Result<(), RunFailure> {
        self.after_step(sink, true)?;
        self.monitors.restart();
        let RunPlan { rhs, end, .. } = &mut *self.plan;
        let last_record = Record::new(self.stepper.now(), rhs.held_inputs, rhs.active_set);
        update_held_inputs(&mut rhs.held_inputs, before.inputs(), after.inputs());
        rhs.active_set = after.active_set();
        let y = Phase { q: *after.q(), u: *after.u() };
        self.stepper.restart(rhs, before.t(), y, *end).map_err(RunFailure::of_step::<M>)?;
        sink.end_segment(last_record);
        Ok(())
    }
}

/// Updates the held inputs that a reset changed. The others may be values of an input law, which are not
/// held.
fn update_held_inputs<V: Vector>(held: &mut V, before: &V, after: &V) {
    for i in 0..V::LEN {
        if after[i] != before[i] {
            held[i] = after[i];
        }
    }
}

/// Refuses a state of a reset that has another time or values that are not finite.
pub(crate) fn check_reset_state<M: SimulationModel>(
    event: &str,
    before: &M::State,
    after: &M::State,
) -> Result<(), Kind> {
    let bad_reset = |name| Err(Kind::BadReset { event: event.into(), name });
    if after.t() != before.t() {
        return bad_reset("t");
    }
    let not_finite = |v: &[f64]| v.iter().position(|x| !x.is_finite());
    if let Some(i) = not_finite(after.q().as_slice()).or(not_finite(after.u().as_slice())) {
        return bad_reset(M::COORDINATES[i].name);
    }
    match not_finite(after.inputs().as_slice()) {
        Some(i) => bad_reset(M::INPUTS[i].name),
        None => Ok(()),
    }
}

//! Constraint discontinuities (corners): a kink of the model at which a closed contact or a sticking
//! constraint changes, as a floor that starts to move, or a belt whose speed jumps.
//!
//! A constraint that requires a jump of velocities needs an impact law. Contacts have one: they are struck
//! with the velocity of the other side of the corner, or open if that falls away. Sticking has friction as
//! its force, which gives no impulse: the constraint slips, in the direction of its velocity behind the
//! corner. A constraint without such a rule is left to the next step, which reports the discontinuity.
//!
//! The step ends just before the corner, on the branches with which it began
//! ([`RunState::end_before_corner`]), and the motion continues just behind it ([`RunState::pass_corner`]). A
//! fixed step that meets a corner is made again to end there ([`RunState::advance`]). Kinks themselves are
//! located in `right_hand_side/switching_functions.rs`. Rest in a corner is found in
//! `events/contact_corner.rs`.

use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec::Vec;

use crate::constrain::active_set::{active_rows, holds};
use crate::constrain::nearby::at_time;
use crate::integrate::{Crossing, Direction, Phase, Step, StepNode, plus_scaled, zip};
use crate::linalg::max_abs;
use crate::model::{Branches, Constraint, ModelState, SimulationModel, StaticTraits, Vector};
use crate::simulate::events::action::EventAction;
use crate::simulate::events::contact_corner;
use crate::simulate::events::rules::Flow;
use crate::simulate::failure::{JumpingQuantity, SimulationErrorKind as Kind};
use crate::simulate::right_hand_side::RightHandSide;
use crate::simulate::run::RunState;
use crate::simulate::run::event_handling::check_reset_state;
use crate::simulate::run::failure::RunFailure;
use crate::simulate::run::plan::RunPlan;
use crate::simulate::run::sinks::Sink;
use crate::simulate::trajectory::record::EventRecord;

/// Smallest jump of a row, as a distance in parts of 1 + |q| or 1 + |q̇|, that is not rounding.
const MIN_ROW_JUMP: f64 = 1e-10;
/// Time, in parts of 1 + |t|, for which a motion that rests in a corner stays there with its velocities. It
/// distinguishes rest from passing through the corner.
const CORNER_REST_TIME: f64 = 1e-3;
/// Stages of a fixed step lie within this many step sizes of its start.
const STAGE_REACH: f64 = 1.1;
/// Most attempts to end a step just before a corner, each farther from it by [`BACKOFF_FACTOR`].
const MAX_SHORTENINGS: usize = 8;
/// See [`MAX_SHORTENINGS`].
const BACKOFF_FACTOR: f64 = 16.0;

/// What a unilateral constraint does at a corner.
#[derive(Clone, Copy, PartialEq)]
enum CornerKind {
    /// It slips, to this side.
    Slips(f64),
    /// It opens.
    Opens,
    /// It is struck.
    Struck,
    /// Its gap jumps to this negative value: the body meets the ground from the side. That is an error.
    MetFromSide(f64),
}

/// A unilateral constraint at a corner, with the index of its event function.
#[derive(Clone, Copy)]
struct CornerEvent {
    index: usize,
    constraint: &'static Constraint,
    kind: CornerKind,
}

impl CornerEvent {
    /// The row that is met from the side, and its gap.
    fn met_gap(&self) -> Option<(usize, f64)> {
        if let CornerKind::MetFromSide(gap) = self.kind { Some((self.constraint.first, gap)) } else { None }
    }
}

/// A jump of a row: of its positions and of its velocities, 0 where it does not jump.
struct RowJump {
    row: usize,
    position: f64,
    velocity: f64,
    /// Φ̇ or A q̇ + b behind the jump.
    after: f64,
}

impl<M: SimulationModel> RunState<'_, '_, '_, M> {
    /// An error where the motion rests in a corner of a constraint without a rule. Its steps would return to
    /// the corner, ever shorter, or leave it to an undetermined side.
    pub(crate) fn find_rest_in_corner(&mut self) -> Option<Kind> {
        if !M::HAS_KINKS || M::IS_UNCONSTRAINED {
            return None;
        }
        let now = self.current_state();
        let mut later = at_time(&now, now.t() + CORNER_REST_TIME * (1.0 + now.t().abs()));
        (0..M::Vector::LEN).for_each(|i| later.q_mut()[i] += (later.t() - now.t()) * now.u()[i]);
        let RunPlan { rhs, locator, .. } = &mut *self.plan;
        let has_rule =
            |row: &usize| locator.unilaterals().any(|(_, unilateral)| unilateral.constraint.first == *row);
        let rows = active_rows::<M>(now.active_set(), true).filter(|row| !has_rule(row));
        let stabilization = (rhs.constants, &mut rhs.stabilization);
        let (row, leads_away) = contact_corner::rests_in(rhs.model, stabilization, [&now, &later], rows)?;
        Some(Kind::RestsInCorner { row: M::ROWS[row].name, leads_away })
    }

    /// The next step. One of fixed size that meets a corner ends there.
    #[inline]
    pub(crate) fn advance(&mut self) -> Result<Step<M::Vector>, RunFailure> {
        // A model without switched constraints has no rules for corners.
        if M::IS_UNSWITCHED {
            return self.stepper.step(&mut self.plan.rhs, self.plan.end).map_err(RunFailure::of_step::<M>);
        }
        match self.plan.options.fixed {
            Some(h) if M::HAS_KINKS && self.has_corner_rules() => self.advance_fixed_step(h),
            _ => self.stepper.step(&mut self.plan.rhs, self.plan.end).map_err(RunFailure::of_step::<M>),
        }
    }

    /// A fixed step that ends at a corner if it meets one.
    #[cold]
    fn advance_fixed_step(&mut self, h: f64) -> Result<Step<M::Vector>, RunFailure> {
        let start = *self.stepper.now();
        // A stage may lie behind a corner that the end of the step does not reach.
        let corner_expected = self.meets_corner(&start, &extrapolated(&start, STAGE_REACH * h));
        if corner_expected {
            self.stepper.end_at_branch(None);
        }
        let attempt = self.stepper.step(&mut self.plan.rhs, self.plan.end).map_err(RunFailure::of_step::<M>);
        let meets = match &attempt {
            Ok(step) if !corner_expected => self.meets_corner(&start, &step.end),
            _ => false,
        };
        if !meets {
            return attempt;
        }
        self.stepper.end_at_branch(attempt.as_ref().ok());
        self.stepper.step(&mut self.plan.rhs, self.plan.end).map_err(RunFailure::of_step::<M>)
    }

    /// Whether a constraint has a rule for corners now: a closed contact, or any that sticks and slips.
    fn has_corner_rules(&self) -> bool {
        let active_set = self.plan.rhs.active_set;
        self.plan
            .locator
            .unilaterals()
            .any(|(_, unilateral)| !unilateral.is_contact() || unilateral.holds_in(active_set))
    }

    /// Whether a constraint with a rule differs between the branches at the start and at the end of a step.
    #[cold]
    fn meets_corner(&mut self, start: &StepNode<M::Vector>, end: &StepNode<M::Vector>) -> bool {
        let (rhs, h) = (&self.plan.rhs, end.t - start.t);
        let (before, after) = (rhs.branches_after(start, h), rhs.branches_after(end, h));
        let state = rhs.state(end.t, &end.y.q, &end.y.u);
        // Each changed branch by itself: two changes may cancel.
        let mut changed = (0..M::KINKS).filter(|i| before.holds(*i) && !after.agrees(before.alone(*i)));
        changed.any(|i| {
            let mut one = before;
            one.hold(i, !before.below(i, false));
            self.needs_corner_rule(&state, before, one)
        }) || !before.agrees(after) && self.needs_corner_rule(&state, before, after)
    }

    /// Whether a constraint with a rule differs at a state between two sets of branches.
    fn needs_corner_rule(&mut self, state: &M::State, before: Branches, after: Branches) -> bool {
        let (mut on_before, mut on_after) = (*state, *state);
        on_before.hold(before);
        on_after.hold(after);
        self.corner_events(&on_before, &on_after).is_none_or(|corner_events| !corner_events.is_empty())
    }

    /// Shortens a step that ended just behind a corner to end just before it, if a rule applies there.
    /// Returns the branches behind the corner.
    #[inline]
    pub(crate) fn end_before_corner(
        &mut self,
        step: &mut Step<M::Vector>,
    ) -> Result<Option<Branches>, RunFailure> {
        if M::IS_UNSWITCHED
            || M::IS_SMOOTH
            || !step.flags.branches
            || step.end.t == self.plan.end
            || !self.has_corner_rules()
        {
            return Ok(None);
        }
        let rhs = &self.plan.rhs;
        let (before, after) =
            (rhs.held_branches, rhs.branches_after(&step.end, self.stepper.statistics().proposed));
        if before.agrees(after) { Ok(None) } else { self.shorten_before_corner(step, before, after) }
    }

    /// Shortens the step by growing times until its end lies on the branches before the corner.
    #[cold]
    fn shorten_before_corner(
        &mut self,
        step: &mut Step<M::Vector>,
        before: Branches,
        after: Branches,
    ) -> Result<Option<Branches>, RunFailure> {
        let whole = *step;
        let state = self.current_state();
        if !self.needs_corner_rule(&state, before, after) {
            return Ok(None);
        }
        let Some((_, shift)) = self.plan.rhs.shifted_onto(&state, before, -1.0) else { return Ok(None) };
        let mut back = 2.0 * shift;
        for _ in 0..MAX_SHORTENINGS {
            let end_t = whole.end.t - back;
            if end_t <= whole.start.t {
                break;
            }
            let Ok(shorter) = self.stepper.shorten(&mut self.plan.rhs, &whole, end_t) else { break };
            *step = shorter;
            if self.plan.rhs.is_on_branches(&self.current_state(), before) {
                return Ok(Some(after));
            }
            back *= BACKOFF_FACTOR;
        }
        // No end before the corner was found: keep the whole step. The next one reports the discontinuity.
        *step = self
            .stepper
            .shorten(&mut self.plan.rhs, &whole, whole.end.t)
            .map_err(RunFailure::of_step::<M>)?;
        Ok(None)
    }

    /// Continues behind a corner just before which the last step has ended.
    #[cold]
    pub(crate) fn pass_corner(
        &mut self,
        sink: &mut dyn Sink<M>,
        after: Branches,
        h: f64,
    ) -> Result<Flow, RunFailure> {
        if M::IS_UNSWITCHED {
            return Ok(Flow::Continue);
        }
        let failure = |kind| RunFailure { kind, h };
        let now = self.current_state();
        let Some((behind, _)) = self.plan.rhs.shifted_onto(&now, after, 1.0) else {
            return Ok(Flow::Continue);
        };
        let before = self.plan.rhs.held_branches;
        if self.plan.rhs.is_cut_between(&now, before, after) {
            // An angle jumps by 2π at its branch cut while nothing moves. The next step reports the
            // discontinuity.
            return Ok(Flow::Continue);
        }
        // Compare one state on both branches: the states before and behind differ by more than rounding at
        // late times, and a bend would look like a corner.
        let (mut on_before, mut on_after) = (now, now);
        on_before.hold(before);
        on_after.hold(after);
        let corner_events = self.corner_events(&on_before, &on_after).unwrap_or_default();
        if corner_events.is_empty() {
            return Ok(Flow::Continue);
        }
        if let Some((row, gap)) = corner_events.iter().find_map(CornerEvent::met_gap) {
            return Err(failure(Kind::ContactJumps { row: M::ROWS[row].name, gap }));
        }
        let mut after_events = behind;
        let events =
            self.apply_corner_events(&corner_events, &now, &behind, &mut after_events).map_err(failure)?;
        let crossing = |corner: &CornerEvent| Crossing {
            index: corner.index,
            theta: 1.0,
            direction: Direction::Falling,
        };
        self.plan.locator.found = corner_events.iter().map(crossing).collect();
        let place = self.plan.rhs.state(now.t(), now.q(), after_events.u());
        self.continue_after_actions(sink, (behind, after_events), events, (0, Some(&place), h))
    }

    /// What unilateral constraints do at a corner between two states. `None` if a constraint without a rule
    /// jumps there, which the next step reports.
    fn corner_events(&mut self, now: &M::State, behind: &M::State) -> Option<Vec<CornerEvent>> {
        let RunPlan { rhs, locator, .. } = &mut *self.plan;
        let mut corner_events = Vec::new();
        for RowJump { row, position, velocity, after } in row_jumps(rhs, now, behind) {
            let Some((index, unilateral)) =
                locator.unilaterals().find(|(_, unilateral)| unilateral.constraint.first == row)
            else {
                if holds::<M>(now.active_set(), row) {
                    return None;
                }
                continue;
            };
            let kind = match (unilateral.is_contact(), unilateral.holds(now)) {
                (false, true) => CornerKind::Slips(velocity.signum()),
                // A slipping constraint whose slip jumps to the other side.
                (false, false) if velocity != 0.0 && after * unilateral.side_of(now) < 0.0 => {
                    CornerKind::Slips(after.signum())
                }
                (_, false) => continue,
                (true, true) if position < 0.0 => CornerKind::MetFromSide(position),
                (true, true) if position > 0.0 || velocity > 0.0 => CornerKind::Opens,
                (true, true) => CornerKind::Struck,
            };
            corner_events.push(CornerEvent { index, constraint: unilateral.constraint, kind });
        }
        Some(corner_events)
    }

    /// Applies the rules at a corner, and returns the events.
    fn apply_corner_events(
        &mut self,
        corner_events: &[CornerEvent],
        now: &M::State,
        behind: &M::State,
        after_events: &mut M::State,
    ) -> Result<Vec<EventRecord<M::State>>, Kind> {
        let RunPlan { rhs, locator, .. } = &mut *self.plan;
        let name = |corner: &CornerEvent| String::from(locator.name(corner.index));
        for CornerEvent { index, kind, .. } in corner_events {
            let side = if let CornerKind::Slips(side) = kind { *side } else { 1.0 };
            let (_, unilateral) =
                locator.unilaterals().find(|(known, _)| known == index).expect("found among them");
            unilateral.release(after_events, side);
        }
        let mut change =
            EventAction::new(rhs.model, rhs.constants, *behind, after_events, &mut rhs.stabilization);
        for corner in corner_events.iter().filter(|corner| corner.kind == CornerKind::Struck) {
            // It may have been hit already together with another one.
            if rhs.model.velocity_residual(change.state())[corner.constraint.first] < 0.0 {
                change.close(corner.constraint);
            }
        }
        let event = name(&corner_events[0]);
        let mut impacts = change
            .finish()
            .map_err(|error| Kind::EventAction { event: event.clone(), error: Box::new(error) })?;
        check_reset_state::<M>(&event, behind, after_events)?;
        let records = corner_events.iter().map(|corner| EventRecord {
            name: name(corner),
            index: corner.index,
            direction: Direction::Falling,
            before: *behind,
            after: *after_events,
            impacts: if corner.kind == CornerKind::Struck {
                core::mem::take(&mut impacts)
            } else {
                Vec::new()
            },
            stopped: false,
        });
        let records: Vec<_> = records.collect();
        let state_behind = rhs.state(now.t(), now.q(), after_events.u());
        let rates = rhs.model.velocity_residual(&state_behind);
        for CornerEvent { constraint, kind, .. } in corner_events {
            // The body still meets the face along which it came. How the impulse divides between the two
            // faces is undetermined.
            if *kind == CornerKind::Struck
                && rates[constraint.first] <= MIN_ROW_JUMP * (1.0 + max_abs(after_events.u().as_slice()))
            {
                let (row, jump) = (M::ROWS[constraint.first].name, rates[constraint.first]);
                let (what, cause) = (JumpingQuantity::Velocities, Box::new(Kind::EventRepeats { event }));
                return Err(Kind::ConstraintJumps { row, what, jump, cause });
            }
        }
        self.make_consistent(&event, behind, after_events)?;
        Ok(records)
    }
}

/// The end of a step of size h with constant acceleration.
fn extrapolated<V: Vector>(start: &StepNode<V>, h: f64) -> StepNode<V> {
    let rates = Phase { q: plus_scaled(&start.y.u, 0.5 * h, &start.a), u: start.a };
    StepNode { t: start.t + h, y: zip(&start.y, &rates, |y, rate| y + h * rate), a: start.a }
}

/// The rows that jump between two states which differ by rounding and by their branches alone.
fn row_jumps<M: SimulationModel>(
    rhs: &mut RightHandSide<'_, '_, M>,
    one: &M::State,
    other: &M::State,
) -> Vec<RowJump> {
    let model = rhs.model;
    let [(p, v), (r, w)] = [one, other].map(|state| (model.residual(state), model.velocity_residual(state)));
    let [of_q, of_u] = [one.q(), one.u()].map(|values| MIN_ROW_JUMP * (1.0 + max_abs(values.as_slice())));
    let gradients = rhs.stabilization.gradients(model, other);
    let jumps = (0..M::Rows::LEN).filter_map(|row| {
        let far = |jump: f64, least: f64| if gradients.distance(row, jump) > least { jump } else { 0.0 };
        let position = if row < M::Residual::LEN { far(r[row] - p[row], of_q) } else { 0.0 };
        let velocity = far(w[row] - v[row], of_u);
        (position != 0.0 || velocity != 0.0).then_some(RowJump { row, position, velocity, after: w[row] })
    });
    jumps.collect()
}

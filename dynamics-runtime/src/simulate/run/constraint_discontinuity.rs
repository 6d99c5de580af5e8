//! Corners of what holds by a rule: a contact whose floor starts to move, what sticks to a belt whose speed
//! jumps.
//!
//! A constraint that asks for a jump of velocities takes an impact, and does not say which. Where it is a
//! contact, its law does: Newton's, of the velocity at which the other side of the corner meets the body; and
//! where the corner falls away, it opens. What sticks has friction for its force, which gives no impulse: it
//! slips, to the side of the velocity that it has there. A step ends just before the corner, on the branches
//! that it began with, and the motion goes on from just behind it; a fixed step that meets one is made again,
//! to end there.

use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec::Vec;

use crate::constrain::active_set::{active_rows, holds};
use crate::constrain::nearby::at_time;
use crate::integrate::{Crossing, Direction, Phase, Step, StepNode, zip};
use crate::linalg::max_abs;
use crate::model::{Branches, Constraint, Known, ModelState, SimulationModel, Vector};
use crate::simulate::events::action::EventAction;
use crate::simulate::events::contact_corner;
use crate::simulate::events::location::Flow;
use crate::simulate::failure::{JumpingQuantity, SimulationErrorKind as Kind};
use crate::simulate::right_hand_side::RightHandSide;
use crate::simulate::run::RunState;
use crate::simulate::run::event_handling::check_reset;
use crate::simulate::run::failure::RunFailure;
use crate::simulate::run::plan::RunPlan;
use crate::simulate::run::sinks::Sink;
use crate::simulate::trajectory::record::EventRecord;

/// Jumps of what a row asks for above this part of 1 + |q| or 1 + |q̇| are no rounding.
const JUMPS: f64 = 1e-10;
/// Time that a motion that rests in a corner does so at least, in parts of 1 + |t|.
const RESTS: f64 = 1e-3;
/// Stages of a fixed step lie within so many times its size.
const STAGES: f64 = 1.1;
/// Attempts to end a step just before a corner, each farther from it than the one before by [`FARTHER`].
const MOST_ATTEMPTS: usize = 8;
/// See [`MOST_ATTEMPTS`].
const FARTHER: f64 = 16.0;

/// How a constraint that holds by a rule meets its corner.
#[derive(Clone, Copy, PartialEq)]
enum CornerKind {
    /// It slips, to this side.
    Slips(f64),
    /// It opens.
    Opens,
    /// It is struck.
    Struck,
    /// It is met from the side: its gap jumps to this.
    Met(f64),
}

/// A unilateral constraint at its corner: the index of its function.
#[derive(Clone, Copy)]
struct CornerEvent {
    index: usize,
    constraint: &'static Constraint,
    way: CornerKind,
}

impl CornerEvent {
    /// The row that is met from the side, and its gap.
    fn meets(&self) -> Option<(usize, f64)> {
        if let CornerKind::Met(gap) = self.way { Some((self.constraint.first, gap)) } else { None }
    }
}

/// What a row asks for jumps by so much, 0 where it does not.
struct Jump {
    row: usize,
    position: f64,
    velocity: f64,
    /// Φ̇ or A q̇ + b behind it.
    after: f64,
}

impl<M: SimulationModel> RunState<'_, '_, '_, M> {
    /// Where a motion rests in a corner of a constraint steps come back to it, ever shorter, or leave it to a
    /// side that nothing chose.
    pub(crate) fn rests_in_corner(&mut self) -> Option<Kind> {
        if !M::HAS_KINKS || M::IS_FREE {
            return None;
        }
        let now = self.now();
        let mut later = at_time(&now, now.t() + RESTS * (1.0 + now.t().abs()));
        (0..M::Vector::LEN).for_each(|i| later.q_mut()[i] += (later.t() - now.t()) * now.u()[i]);
        let RunPlan { rhs, locator, .. } = &mut *self.plan;
        let ruled =
            |row: &usize| locator.unilaterals().any(|(_, unilateral)| unilateral.constraint.first == *row);
        let rows = active_rows::<M>(now.modes(), true).filter(|row| !ruled(row));
        let stabilization = (rhs.constants, &mut rhs.stabilization);
        let (row, leads_away) = contact_corner::rests_in(rhs.model, stabilization, [&now, &later], rows)?;
        Some(Kind::RestsInCorner { row: M::ROWS[row].name, leads_away })
    }

    /// The next step. One of fixed size that meets a corner ends there.
    #[inline]
    pub(crate) fn advance(&mut self) -> Result<Step<M::Vector>, RunFailure> {
        // Only unilateral constraints have rules for corners.
        if M::IS_UNSWITCHED {
            return self.stepper.step(&mut self.plan.rhs, self.plan.end).map_err(RunFailure::of_step::<M>);
        }
        match self.plan.options.fixed {
            Some(h) if M::HAS_KINKS && self.follows_corners() => self.advance_by(h),
            _ => self.stepper.step(&mut self.plan.rhs, self.plan.end).map_err(RunFailure::of_step::<M>),
        }
    }

    #[cold]
    fn advance_by(&mut self, h: f64) -> Result<Step<M::Vector>, RunFailure> {
        let start = *self.stepper.now();
        // Stages may stand beyond a corner that the end does not reach.
        let holds = self.meets_corner(&start, &ahead(&start, STAGES * h));
        if holds {
            self.stepper.end_at_branch(None);
        }
        let made = self.stepper.step(&mut self.plan.rhs, self.plan.end).map_err(RunFailure::of_step::<M>);
        let meets = match &made {
            Ok(step) if !holds => self.meets_corner(&start, &step.end),
            _ => false,
        };
        if !meets {
            return made;
        }
        self.stepper.end_at_branch(made.as_ref().ok());
        self.stepper.step(&mut self.plan.rhs, self.plan.end).map_err(RunFailure::of_step::<M>)
    }

    /// Whether there is a constraint that has a rule for its corners.
    fn follows_corners(&self) -> bool {
        let modes = self.plan.rhs.modes;
        self.plan
            .locator
            .unilaterals()
            .any(|(_, unilateral)| !unilateral.is_contact() || unilateral.holds_in(modes))
    }

    /// Whether a constraint that holds by a rule asks for something else on the branches on which a step ends
    /// than on those on which it began.
    #[cold]
    fn meets_corner(&mut self, start: &StepNode<M::Vector>, end: &StepNode<M::Vector>) -> bool {
        let (rhs, h) = (&self.plan.rhs, end.t - start.t);
        let (before, after) = (rhs.branches_after(start, h), rhs.branches_after(end, h));
        let state = rhs.state(end.t, &end.y.q, &end.y.u);
        // One after the other: what two of them change may be the same again.
        let mut changed = (0..M::KINKS).filter(|i| before.holds(*i) && !after.agrees(before.alone(*i)));
        changed.any(|i| {
            let mut one = before;
            one.hold(i, !before.below(i, false));
            self.rule_jumps(&state, before, one)
        }) || !before.agrees(after) && self.rule_jumps(&state, before, after)
    }

    /// Whether a constraint that holds by a rule asks for something else at a state on other branches.
    fn rule_jumps(&mut self, state: &M::State, before: Branches, after: Branches) -> bool {
        let (mut held, mut beyond) = (*state, *state);
        held.hold(before);
        beyond.hold(after);
        self.turns(&held, &beyond).is_none_or(|turns| !turns.is_empty())
    }

    /// Ends a step that has come just behind a corner just before it, as a rule knows how to go on there: the
    /// branches behind it.
    #[inline]
    pub(crate) fn end_before_corner(
        &mut self,
        step: &mut Step<M::Vector>,
    ) -> Result<Option<Branches>, RunFailure> {
        if M::IS_UNSWITCHED
            || M::IS_SMOOTH
            || !step.kept.branches
            || step.end.t == self.plan.end
            || !self.follows_corners()
        {
            return Ok(None);
        }
        let rhs = &self.plan.rhs;
        let (before, after) =
            (rhs.branches, rhs.branches_after(&step.end, self.stepper.statistics().proposed));
        if before.agrees(after) { Ok(None) } else { self.end_before(step, before, after) }
    }

    #[cold]
    fn end_before(
        &mut self,
        step: &mut Step<M::Vector>,
        before: Branches,
        after: Branches,
    ) -> Result<Option<Branches>, RunFailure> {
        let whole = *step;
        let state = self.now();
        if !self.rule_jumps(&state, before, after) {
            return Ok(None);
        }
        let Some((_, off)) = self.plan.rhs.shifted_onto(&state, before, -1.0) else { return Ok(None) };
        let mut back = 2.0 * off;
        for _ in 0..MOST_ATTEMPTS {
            let end_t = whole.end.t - back;
            if end_t <= whole.start.t {
                break;
            }
            let Ok(shorter) = self.stepper.shorten(&mut self.plan.rhs, &whole, end_t) else { break };
            *step = shorter;
            if self.plan.rhs.is_on(&self.now(), before) {
                return Ok(Some(after));
            }
            back *= FARTHER;
        }
        // As far as it went, it says what it has met.
        *step = self
            .stepper
            .shorten(&mut self.plan.rhs, &whole, whole.end.t)
            .map_err(RunFailure::of_step::<M>)?;
        Ok(None)
    }

    /// Goes on behind a corner just before which the motion stands.
    #[cold]
    pub(crate) fn turn_corner(
        &mut self,
        sink: &mut dyn Sink<M>,
        after: Branches,
        h: f64,
    ) -> Result<Flow, RunFailure> {
        if M::IS_UNSWITCHED {
            return Ok(Flow::Continue);
        }
        let at = |kind| RunFailure { kind, h };
        let now = self.now();
        let Some((behind, _)) = self.plan.rhs.shifted_onto(&now, after, 1.0) else {
            return Ok(Flow::Continue);
        };
        let before = self.plan.rhs.branches;
        if self.plan.rhs.is_cut_between(&now, before, after) {
            // Where an angle jumps by a turn nothing that moves does: the next step says what it meets.
            return Ok(Flow::Continue);
        }
        // One state on both branches: what bends is no corner, however far apart the two states are at late
        // times.
        let (mut held, mut beyond) = (now, now);
        held.hold(before);
        beyond.hold(after);
        let turns = self.turns(&held, &beyond).unwrap_or_default();
        if turns.is_empty() {
            return Ok(Flow::Continue);
        }
        if let Some((row, gap)) = turns.iter().find_map(CornerEvent::meets) {
            return Err(at(Kind::ContactJumps { row: M::ROWS[row].name, gap }));
        }
        let mut left = behind;
        let events = self.turned(&turns, &now, &behind, &mut left).map_err(at)?;
        let crossing =
            |turn: &CornerEvent| Crossing { index: turn.index, theta: 1.0, direction: Direction::Falling };
        self.plan.locator.found = turns.iter().map(crossing).collect();
        let place = self.plan.rhs.state(now.t(), now.q(), left.u());
        self.conclude(sink, (behind, left), events, (0, Some(&place), h))
    }

    /// What is to be done at a corner between two states; `None` where it is one of a constraint without a
    /// rule, so that the next step says what it meets.
    fn turns(&mut self, now: &M::State, behind: &M::State) -> Option<Vec<CornerEvent>> {
        let RunPlan { rhs, locator, .. } = &mut *self.plan;
        let mut turns = Vec::new();
        for Jump { row, position, velocity, after } in jumps(rhs, now, behind) {
            let Some((index, unilateral)) =
                locator.unilaterals().find(|(_, unilateral)| unilateral.constraint.first == row)
            else {
                if holds::<M>(now.modes(), row) {
                    return None;
                }
                continue;
            };
            let way = match (unilateral.is_contact(), unilateral.holds(now)) {
                (false, true) => CornerKind::Slips(velocity.signum()),
                // What slips to the other side from there.
                (false, false) if velocity != 0.0 && after * unilateral.side_of(now) < 0.0 => {
                    CornerKind::Slips(after.signum())
                }
                (_, false) => continue,
                (true, true) if position < 0.0 => CornerKind::Met(position),
                (true, true) if position > 0.0 || velocity > 0.0 => CornerKind::Opens,
                (true, true) => CornerKind::Struck,
            };
            turns.push(CornerEvent { index, constraint: unilateral.constraint, way });
        }
        Some(turns)
    }

    /// Does what is to be done at a corner; the events of it.
    fn turned(
        &mut self,
        turns: &[CornerEvent],
        now: &M::State,
        behind: &M::State,
        left: &mut M::State,
    ) -> Result<Vec<EventRecord<M::State>>, Kind> {
        let RunPlan { rhs, locator, .. } = &mut *self.plan;
        let name = |turn: &CornerEvent| String::from(locator.name(turn.index));
        for CornerEvent { index, way, .. } in turns {
            let side = if let CornerKind::Slips(side) = way { *side } else { 1.0 };
            let (_, unilateral) =
                locator.unilaterals().find(|(known, _)| known == index).expect("found among them");
            unilateral.let_go(left, side);
        }
        let mut change = EventAction::new(rhs.model, rhs.constants, *behind, left, &mut rhs.stabilization);
        for turn in turns.iter().filter(|turn| turn.way == CornerKind::Struck) {
            // One that is struck may be hit along with another one.
            if rhs.model.velocity_residual(change.state())[turn.constraint.first] < 0.0 {
                change.close(turn.constraint);
            }
        }
        let event = name(&turns[0]);
        let mut impacts = change
            .finish()
            .map_err(|error| Kind::EventAction { event: event.clone(), error: Box::new(error) })?;
        check_reset::<M>(&event, behind, left)?;
        let records = turns.iter().map(|turn| EventRecord {
            name: name(turn),
            index: turn.index,
            direction: Direction::Falling,
            before: *behind,
            after: *left,
            impacts: if turn.way == CornerKind::Struck { core::mem::take(&mut impacts) } else { Vec::new() },
            stopped: false,
        });
        let records: Vec<_> = records.collect();
        let thrown = rhs.state(now.t(), now.q(), left.u());
        let rates = rhs.model.velocity_residual(&thrown);
        for CornerEvent { constraint, way, .. } in turns {
            // The face along which it came is in the way, too: what each of the two gives the corner does not
            // say.
            if *way == CornerKind::Struck
                && rates[constraint.first] <= JUMPS * (1.0 + max_abs(left.u().as_slice()))
            {
                let (row, jump) = (M::ROWS[constraint.first].name, rates[constraint.first]);
                let (what, cause) = (JumpingQuantity::Velocities, Box::new(Kind::EventRepeats { event }));
                return Err(Kind::ConstraintJumps { row, what, jump, cause });
            }
        }
        self.put(&event, behind, left)?;
        Ok(records)
    }
}

/// The step that goes on as it is accelerated at its start.
fn ahead<V: Vector>(start: &StepNode<V>, h: f64) -> StepNode<V> {
    let rates = Phase { q: zip_vectors(&start.y.u, &start.a, 0.5 * h), u: start.a };
    StepNode { t: start.t + h, y: zip(&start.y, &rates, |y, rate| y + h * rate), a: start.a }
}

/// x + factor y.
fn zip_vectors<V: Vector>(x: &V, y: &V, factor: f64) -> V {
    let mut sum = *x;
    (0..V::LEN).for_each(|i| sum[i] += factor * y[i]);
    sum
}

/// The rows that ask for something else at the second of two states that are the same but for rounding, and
/// for the branches by which they are judged.
fn jumps<M: SimulationModel>(
    rhs: &mut RightHandSide<'_, '_, M>,
    one: &M::State,
    other: &M::State,
) -> Vec<Jump> {
    let model = rhs.model;
    let [(p, v), (r, w)] = [one, other].map(|state| (model.residual(state), model.velocity_residual(state)));
    let [of_q, of_u] = [one.q(), one.u()].map(|values| JUMPS * (1.0 + max_abs(values.as_slice())));
    let gradients = rhs.stabilization.gradients(model, other);
    let jumps = (0..M::Rows::LEN).filter_map(|row| {
        let far = |jump: f64, least: f64| if gradients.distance(row, jump) > least { jump } else { 0.0 };
        let position = if row < M::Residual::LEN { far(r[row] - p[row], of_q) } else { 0.0 };
        let velocity = far(w[row] - v[row], of_u);
        (position != 0.0 || velocity != 0.0).then_some(Jump { row, position, velocity, after: w[row] })
    });
    jumps.collect()
}

//! Steps with events: the events of a step, and its end at the first event that calls for an action.
//!
//! A crossing is found on the interpolant (`events/location.rs`), but the step ends where the method itself
//! has it: it is made again to end there. The error of the interpolant is within the tolerance, but functions
//! of stiff forces amplify it: the reaction of a spring of 10⁶ N/m changes by 1 N per micrometre, and the
//! time of the event by hundreds of tolerances. Ends of steps are more accurate, because fast modes have
//! decayed there.
//!
//! The crossing is corrected by Newton's method with the slope of the interpolant. Where that leads far from
//! the interpolant's crossing, by secants of the repeated steps within a bracket; the crossings of the
//! shortened step are then located once more. Implicit methods relocate crossings without an action, too, by
//! two or three steps of a copy of the stepper, so that the motion does not depend on them.
//!
//! What happens at the event is in `event_handling.rs`.

use alloc::vec::Vec;
use core::cell::RefCell;

use crate::integrate::{Crossing, Dense, Direction, Step, StepNode};
use crate::model::{Model, ModelState, SimulationModel};
use crate::simulate::erased_method::Interpolant;
use crate::simulate::erased_method::stepping::ErasedStepper;
use crate::simulate::events::rules::Flow;
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::simulate::run::RunState;
use crate::simulate::run::failure::{RunFailure, evaluation};
use crate::simulate::run::plan::RunPlan;
use crate::simulate::run::sinks::Sink;
use crate::simulate::trajectory::record::EventRecord;

/// Deviation of an event function from its secant half-way, in parts of its change, above which it jumps
/// there. At a jump it is a half. At a kink it is less, if the two slopes differ by less than a factor of 5
/// or so.
const JUMP_DEVIATION: f64 = 0.35;
/// Part of a step up to which the method's crossing may differ from the interpolant's without locating all
/// crossings again. Also half the interval for the slope.
const INTERPOLANT_ERROR: f64 = 1e-4;
/// Most repeated steps for a crossing that is near that of the interpolant: Newton's method has converged by
/// then.
const MAX_TRIALS_NEAR: usize = 3;
/// Most repeated steps for a crossing elsewhere, by secants and bisection.
const MAX_TRIALS_FAR: usize = 10;

/// Parts of a step that differ by less are one: the search elsewhere ends.
const THETA_RESOLUTION: f64 = 1e-10;
/// A crossing elsewhere counts only if the function there is below this part of its value at the
/// interpolant's crossing. Else the function may only touch zero, and the interpolant's crossing is taken.
const REQUIRED_GAIN: f64 = 0.1;

/// Where the method itself has a crossing.
enum CrossingPlace {
    /// At the start of the step.
    AtStart,
    /// Where the interpolant has it, up to [`INTERPOLANT_ERROR`].
    AsInterpolated,
    /// Elsewhere.
    Elsewhere,
}

/// The interpolant of a step, and the events before the first one that acts.
type StepCrossings<M> = (Interpolant<<M as Model>::Vector>, Vec<EventRecord<<M as Model>::State>>);

impl<M: SimulationModel> RunState<'_, '_, '_, M> {
    /// Records a step with its events, up to the first one that calls for an action, which is applied.
    pub(crate) fn step_with_events(
        &mut self,
        sink: &mut dyn Sink<M>,
        mut step: Step<M::Vector>,
    ) -> Result<Flow, RunFailure> {
        let h = step.h;
        let failure = |kind| RunFailure { kind, h };
        // Crossings at the end of the step, once it was made again to end at them.
        let mut at_step_end: Vec<Crossing> = Vec::new();
        loop {
            let (dense, mut events) = self.find_crossings(&mut step, &at_step_end)?;
            if !events.is_empty() {
                self.relocate_passive_events(&step, &*dense, &mut events);
            }
            let locator = &mut self.plan.locator;
            let Some(acting) = locator.first_acting() else {
                locator.continue_without_action();
                self.before_record(sink, &step)?;
                sort_by_time(&mut events, h);
                events.into_iter().for_each(|event| sink.event(event));
                return self.record(sink, &step).map_err(failure);
            };
            // Make the step again to end at the crossing; locate once more if that is elsewhere.
            locator.discard_after(acting);
            let crossing = locator.found[acting];
            let whole = step;
            let place = if at_step_end.contains(&crossing) {
                CrossingPlace::AsInterpolated
            } else {
                match end_at_crossing(self.stepper, self.plan, (&mut step, &*dense), &crossing) {
                    Ok(place) => place,
                    Err(failure) => return Err(self.undo_step(&whole, failure)),
                }
            };
            if matches!(place, CrossingPlace::Elsewhere) {
                at_step_end = self
                    .plan
                    .locator
                    .found
                    .iter()
                    .filter(|found| is_simultaneous(found, &crossing))
                    .copied()
                    .collect();
                at_step_end.iter_mut().for_each(|crossing| crossing.theta = 1.0);
                continue;
            }
            let has_length = !matches!(place, CrossingPlace::AtStart);
            if has_length {
                self.before_record(sink, &step)?;
            } else {
                // Implicit methods have no step of length zero. The attempt counts as a rejected step, so
                // that events without end reach the limit of the steps.
                self.stepper.reject(&whole);
            }
            let end = self.current_state();
            let simultaneous = self.plan.locator.found.iter().map(|found| is_simultaneous(found, &crossing));
            for (event, is_at_crossing) in events.iter_mut().zip(simultaneous) {
                // Events at the instant of the action, or later than the end that the method found, are at
                // that end.
                if is_at_crossing && has_length || (event.time() - end.t()) * h > 0.0 {
                    (event.before, event.after) = (end, end);
                }
            }
            sort_by_time(&mut events, h);
            events.into_iter().for_each(|event| sink.event(event));
            let flow = if has_length { self.record(sink, &step).map_err(failure)? } else { Flow::Continue };
            let acted = self.apply_actions(sink, acting, step.h)?;
            return Ok(if flow == Flow::Stop { flow } else { acted });
        }
    }

    /// Locates the crossings of a step. Returns its interpolant, and the events before the first one that
    /// calls for an action.
    fn find_crossings(
        &mut self,
        step: &mut Step<M::Vector>,
        at_step_end: &[Crossing],
    ) -> Result<StepCrossings<M>, RunFailure> {
        let h = step.h;
        let failure = |kind| RunFailure { kind, h };
        let RunPlan { rhs, locator, options, .. } = &mut *self.plan;
        // If the interpolant or the scan fails, it does so within this step: the motion ends before it.
        let dense = match self.stepper.dense(rhs, step, false) {
            Ok(dense) => dense,
            Err(error) => return Err(self.undo_step(step, failure(evaluation::<M>(error)))),
        };
        step.flags.between = rhs.projects_between(&*dense, step, &options.tolerances);
        let rhs = RefCell::new(rhs);
        let step = &*step;
        let state = |theta: f64| rhs.borrow_mut().state_within(&*dense, step, &options.tolerances, theta);
        if let Err(kind) = locator.scan(step, self.stepper.scan(), state) {
            return Err(self.undo_step(step, failure(kind)));
        }
        locator.move_to_step_end(at_step_end);
        let acting = locator.first_acting();
        let passive = &locator.found[..acting.unwrap_or(locator.found.len())];
        let events = passive
            .iter()
            .map(|crossing| passive_event(locator.name(crossing.index), crossing, state(crossing.theta)));
        let events = events.collect();
        Ok((dense, events))
    }

    /// Moves events without an action to where the method itself has them, by trial steps of a copy of the
    /// stepper. The run itself does not change.
    fn relocate_passive_events(
        &mut self,
        whole: &Step<M::Vector>,
        dense: &dyn Dense<M::Vector>,
        events: &mut [EventRecord<M::State>],
    ) {
        let found = &self.plan.locator.found;
        let acting = self.plan.locator.first_acting().map(|acting| found[acting]);
        let is_separate =
            |crossing: &Crossing| !acting.is_some_and(|acting| is_simultaneous(crossing, &acting));
        let found: Vec<Crossing> = found[..events.len()].to_vec();
        let Some(mut trial_stepper) = self.stepper.clone_for_trials() else { return };
        let saved = self.plan.rhs.save_for_trials();
        for (event, crossing) in events.iter_mut().zip(&found).filter(|(_, crossing)| is_separate(crossing)) {
            let mut step = *whole;
            // Where no step ends at the crossing, the interpolant's place is kept.
            if let Ok(CrossingPlace::AsInterpolated | CrossingPlace::Elsewhere) =
                end_at_crossing(&mut *trial_stepper, self.plan, (&mut step, dense), crossing)
            {
                let StepNode { t, y, .. } = step.end;
                let state = self.plan.rhs.state(t, &y.q, &y.u);
                (event.before, event.after) = (state, state);
            }
        }
        self.plan.rhs.restore_after_trials(saved);
    }
}

/// Makes a step again to end at a crossing: the event function is zero at the end, by the method and not by
/// its interpolant. `step` is the whole step at first, and the shortened one at the end.
fn end_at_crossing<M: SimulationModel>(
    stepper: &mut dyn ErasedStepper<M>,
    plan: &mut RunPlan<'_, '_, M>,
    (step, dense): (&mut Step<M::Vector>, &dyn Dense<M::Vector>),
    crossing: &Crossing,
) -> Result<CrossingPlace, RunFailure> {
    let whole = *step;
    let failure = |kind| RunFailure { kind, h: whole.h };
    let mut search = CrossingSearch::new(crossing);
    let (mut theta, mut is_step_current) = (crossing.theta, true);
    loop {
        let end_t = whole.start.t + theta * whole.h;
        if theta <= 0.0 || end_t == whole.start.t {
            return Ok(CrossingPlace::AtStart);
        }
        let RunPlan { rhs, locator, .. } = &mut *plan;
        *step = match stepper.shorten(rhs, &whole, end_t) {
            Ok(step) => step,
            // A trial step that fails ends the search with the best one so far.
            Err(_) if search.best.is_some() => {
                is_step_current = false;
                break;
            }
            Err(error) => return Err(RunFailure::of_step::<M>(error)),
        };
        let reached = rhs.state(step.end.t, &step.end.y.q, &step.end.y.u);
        let miss = locator.value(crossing.index, &reached).map_err(failure)?;
        if !search.note_trial(theta, miss) {
            break;
        }
        let Some(slope) = event_slope(plan, (&whole, dense), crossing, theta)? else { break };
        let Some(better) = search.next_theta(slope) else { break };
        theta = better;
    }
    // The last trial may not be the best one.
    let theta = search.best_theta().unwrap_or(theta);
    let end_t = whole.start.t + theta * whole.h;
    if !is_step_current || end_t != step.end.t {
        *step = stepper.shorten(&mut plan.rhs, &whole, end_t).map_err(RunFailure::of_step::<M>)?;
    }
    Ok(if (theta - crossing.theta).abs() <= INTERPOLANT_ERROR {
        CrossingPlace::AsInterpolated
    } else {
        CrossingPlace::Elsewhere
    })
}

/// The slope of the event function on the interpolant; `None` at a jump, as a reaction has where a force
/// jumps. There a secant would lead away from the crossing. Kinks whose slopes differ by more than about a
/// factor of 5 count as jumps; the interpolant's crossing is then taken.
fn event_slope<M: SimulationModel>(
    plan: &mut RunPlan<'_, '_, M>,
    (whole, dense): (&Step<M::Vector>, &dyn Dense<M::Vector>),
    crossing: &Crossing,
    theta: f64,
) -> Result<Option<f64>, RunFailure> {
    let RunPlan { rhs, locator, options, .. } = plan;
    let (a, b) = ((theta - INTERPOLANT_ERROR).max(0.0), (theta + INTERPOLANT_ERROR).min(1.0));
    let mut g = |theta| {
        let state = rhs.state_within(dense, whole, &options.tolerances, theta);
        locator.value(crossing.index, &state).map_err(|kind: Kind| RunFailure { kind, h: whole.h })
    };
    let (from, to) = (g(a)?, g(b)?);
    let is_jump = (g(0.5 * (a + b))? - 0.5 * (from + to)).abs() > JUMP_DEVIATION * (to - from).abs();
    Ok((!is_jump).then_some((to - from) / (b - a)))
}

/// Search for the part θ of a step that ends at a crossing.
struct CrossingSearch {
    /// θ on the interpolant, and the value of the function at the end of the step made to there.
    interpolated: (f64, f64),
    /// Sign of the function behind the crossing: 1 if it rises, else −1.
    sign_behind: f64,
    /// Values of θ before and behind the crossing.
    bracket: (f64, f64),
    /// The last trial θ, with the value of the function at its end.
    last: Option<(f64, f64)>,
    /// The trial before it.
    previous: Option<(f64, f64)>,
    /// The trial with the least |g|.
    best: Option<(f64, f64)>,
    trials: usize,
    /// Whether the crossing is not where the interpolant has it.
    is_elsewhere: bool,
    /// Trials that were no better than an earlier one.
    trials_without_gain: usize,
}

impl CrossingSearch {
    fn new(crossing: &Crossing) -> Self {
        let sign_behind = if crossing.direction == Direction::Rising { 1.0 } else { -1.0 };
        let (last, previous, best) = (None, None, None);
        Self {
            interpolated: (crossing.theta, f64::INFINITY),
            sign_behind,
            bracket: (0.0, 1.0),
            last,
            previous,
            best,
            trials: 0,
            is_elsewhere: false,
            trials_without_gain: 0,
        }
    }

    /// Notes the value of the function at the end of a trial. Returns whether to continue.
    fn note_trial(&mut self, theta: f64, miss: f64) -> bool {
        self.trials += 1;
        if self.trials == 1 {
            self.interpolated.1 = miss;
        }
        (self.previous, self.last) = (self.last, Some((theta, miss)));
        let end = if miss * self.sign_behind < 0.0 { &mut self.bracket.0 } else { &mut self.bracket.1 };
        *end = theta;
        if self.best.is_some_and(|(_, least)| miss.abs() >= least.abs()) {
            self.trials_without_gain += 1;
        } else {
            self.best = Some((theta, miss));
        }
        let (max_without_gain, max_trials) =
            if self.is_elsewhere { (2, MAX_TRIALS_FAR) } else { (1, MAX_TRIALS_NEAR) };
        miss != 0.0 && self.trials_without_gain < max_without_gain && self.trials < max_trials
    }

    /// The next trial: by Newton's method with this slope, or by the secant of the last two trials if the
    /// crossing is elsewhere.
    fn next_theta(&mut self, slope: f64) -> Option<f64> {
        let (theta, miss) = self.last?;
        let secant = self.previous.map(|(before, value)| (miss - value) / (theta - before));
        let slope = if self.is_elsewhere { secant? } else { slope };
        let better = theta - miss / slope;
        if !better.is_finite() {
            return None;
        }
        if !self.is_elsewhere && (better - self.interpolated.0).abs() <= INTERPOLANT_ERROR {
            return (better <= 1.0).then_some(better);
        }
        self.is_elsewhere = true;
        let (from, to) = self.bracket;
        let better = if better > from && better < to { better } else { 0.5 * (from + to) };
        ((better - theta).abs() > THETA_RESOLUTION).then_some(better)
    }

    /// The θ that ends at the crossing. A function that only touches zero may have no crossing by the method
    /// itself: then that of the interpolant is taken.
    fn best_theta(&self) -> Option<f64> {
        let (theta, miss) = self.best?;
        let is_no_gain = self.is_elsewhere && miss.abs() > REQUIRED_GAIN * self.interpolated.1.abs();
        Some(if is_no_gain { self.interpolated.0 } else { theta })
    }
}

/// Sorts the events of a step of size h by insertion: they are few and almost in order, and a sort of slices
/// would be compiled with every model.
fn sort_by_time<S: ModelState>(events: &mut [EventRecord<S>], h: f64) {
    let time = |event: &EventRecord<S>| event.time() * h.signum();
    for end in 1..events.len() {
        let mut i = end;
        while i > 0 && time(&events[i]).total_cmp(&time(&events[i - 1])).is_lt() {
            events.swap(i, i - 1);
            i -= 1;
        }
    }
}

/// Whether two crossings happen at the same instant, as far as the interpolant resolves.
fn is_simultaneous(one: &Crossing, other: &Crossing) -> bool {
    (one.theta - other.theta).abs() <= crate::simulate::events::lift_off::SIMULTANEOUS_THETA
}

/// The event of a crossing without an action.
fn passive_event<S: ModelState>(name: &str, crossing: &Crossing, state: S) -> EventRecord<S> {
    let Crossing { index, direction, .. } = *crossing;
    EventRecord {
        name: name.into(),
        index,
        direction,
        before: state,
        after: state,
        impacts: Vec::new(),
        stopped: false,
    }
}

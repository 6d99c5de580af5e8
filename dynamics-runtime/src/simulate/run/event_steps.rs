//! Steps with events: which happen in a step, and where it ends at one that acts.
//!
//! A crossing is found by the interpolant, but a step ends where the method itself has it: it is made again
//! to end there. What the interpolant is off, within what is permitted, functions that read stiff forces
//! amplify: the reaction to a spring of 10⁶ N/m is off by 1 N for a micrometre, and with it an instant by
//! hundreds of tolerances. Ends of steps know better, as what is stiff has died out there. So the place is
//! corrected by the slope of the interpolant, and where that leads far from where it had the crossing, by
//! secants of what the steps made again give, in a bracket. The crossings of such a step are looked for once
//! more, up to its new end. Crossings at which nothing acts are put there likewise where methods are
//! implicit, by steps of a second stepper, so that the motion is what it is without them: two or three steps
//! for each.

use alloc::vec::Vec;
use core::cell::RefCell;

use crate::integrate::{Crossing, Dense, Direction, Step, StepNode};
use crate::model::{Model, ModelState, SimulationModel};
use crate::simulate::erased_method::Interpolant;
use crate::simulate::erased_method::stepping::ErasedStepper;
use crate::simulate::events::location::Flow;
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::simulate::run::RunState;
use crate::simulate::run::failure::{RunFailure, evaluation};
use crate::simulate::run::plan::RunPlan;
use crate::simulate::run::sinks::Sink;
use crate::simulate::trajectory::record::EventRecord;

/// Deviation of an event function half-way from the secant, in parts of its change, from which on it jumps.
const JUMPS: f64 = 0.35;
/// Part of a step by which its interpolant may be off without its crossings being looked for again, and on
/// which its slope is taken.
const NEAR: f64 = 1e-4;
/// Steps made again to end at a crossing that is near where the interpolant has it.
const FEW: usize = 3;
/// The same where it is not.
const MOST: usize = 10;

/// Parts of a step that are told apart there.
const RESOLVED: f64 = 1e-10;
/// Part of what is missed where the interpolant has a crossing that may be left where it is found elsewhere.
const BETTER: f64 = 0.1;

/// Where a step that was made again has come to.
enum Reached {
    /// The crossing is at the very start of the step.
    Start,
    /// Where the interpolant has it, but for [`NEAR`].
    Near,
    /// Elsewhere.
    Far,
}

/// The interpolant of a step, and the events before the first one that acts.
type Looked<M> = (Interpolant<<M as Model>::Vector>, Vec<EventRecord<<M as Model>::State>>);

impl<M: SimulationModel> RunState<'_, '_, '_, M> {
    /// A step with its events: ends it at the first one that calls for an action.
    pub(crate) fn step_with_events(
        &mut self,
        sink: &mut dyn Sink<M>,
        mut step: Step<M::Vector>,
    ) -> Result<Flow, RunFailure> {
        let h = step.h;
        let at = |kind| RunFailure { kind, h };
        // Crossings that are known to be at the end of the step, as it was made again to end there.
        let mut known: Vec<Crossing> = Vec::new();
        loop {
            let (dense, mut events) = self.look(&mut step, &known)?;
            if !events.is_empty() {
                self.sharpen(&step, &*dense, &mut events);
            }
            let locator = &mut self.plan.locator;
            let Some(acting) = locator.first_acting() else {
                locator.carry_on();
                self.before_record(sink, &step)?;
                in_order(&mut events, h);
                events.into_iter().for_each(|event| sink.event(event));
                return self.record(sink, &step).map_err(at);
            };
            locator.cut_after(acting);
            let crossing = locator.found[acting];
            let whole = step;
            let reached = if known.contains(&crossing) {
                Reached::Near
            } else {
                match end_at(self.stepper, self.plan, (&mut step, &*dense), &crossing) {
                    Ok(reached) => reached,
                    Err(failure) => return Err(self.take_back(&whole, failure)),
                }
            };
            if matches!(reached, Reached::Far) {
                known =
                    self.plan.locator.found.iter().filter(|found| is_at(found, &crossing)).copied().collect();
                known.iter_mut().for_each(|crossing| crossing.theta = 1.0);
                continue;
            }
            let moves = !matches!(reached, Reached::Start);
            if moves {
                self.before_record(sink, &step)?;
            } else {
                // Implicit methods have no step of length zero. It counts, so that events without end come to
                // that of the steps.
                self.stepper.reject(&whole);
            }
            let end = self.now();
            let places = self.plan.locator.found.iter().map(|found| is_at(found, &crossing));
            for (event, at_once) in events.iter_mut().zip(places) {
                // Where the interpolant has it at the same instant, or later than the end that the method
                // itself has found.
                if at_once && moves || (event.time() - end.t()) * h > 0.0 {
                    (event.before, event.after) = (end, end);
                }
            }
            in_order(&mut events, h);
            events.into_iter().for_each(|event| sink.event(event));
            let flow = if moves { self.record(sink, &step).map_err(at)? } else { Flow::Continue };
            let acted = self.act(sink, acting, step.h)?;
            return Ok(if flow == Flow::Stop { flow } else { acted });
        }
    }

    /// Looks for the crossings of a step, and gives its interpolant and the events before the first one that
    /// acts.
    fn look(&mut self, step: &mut Step<M::Vector>, known: &[Crossing]) -> Result<Looked<M>, RunFailure> {
        let h = step.h;
        let at = |kind| RunFailure { kind, h };
        let RunPlan { rhs, locator, options, .. } = &mut *self.plan;
        // What the interpolant or the scan objects to lies within this step: the motion ends before it.
        // It tells whether there is a crossing. Where one that acts is, the method itself tells; by implicit
        // methods all of them.
        let dense = match self.stepper.dense(rhs, step, false) {
            Ok(dense) => dense,
            Err(error) => return Err(self.take_back(step, at(evaluation::<M>(error)))),
        };
        step.kept.between = rhs.projects_between(&*dense, step, &options.tolerances);
        let rhs = RefCell::new(rhs);
        let step = &*step;
        let state = |theta: f64| rhs.borrow_mut().within(&*dense, step, &options.tolerances, theta);
        if let Err(kind) = locator.scan(step, self.stepper.scan(), state) {
            return Err(self.take_back(step, at(kind)));
        }
        locator.end_with(known);
        let acting = locator.first_acting();
        let passive = &locator.found[..acting.unwrap_or(locator.found.len())];
        let events = passive
            .iter()
            .map(|crossing| passed(locator.name(crossing.index), crossing, state(crossing.theta)));
        let events = events.collect();
        Ok((dense, events))
    }

    /// Puts the events that nothing acts at where the method itself has them, by steps of another stepper, of
    /// which nothing is left.
    fn sharpen(
        &mut self,
        whole: &Step<M::Vector>,
        dense: &dyn Dense<M::Vector>,
        events: &mut [EventRecord<M::State>],
    ) {
        let found = &self.plan.locator.found;
        let acting = self.plan.locator.first_acting().map(|acting| found[acting]);
        let apart = |crossing: &Crossing| !acting.is_some_and(|acting| is_at(crossing, &acting));
        let found: Vec<Crossing> = found[..events.len()].to_vec();
        let Some(mut twin) = self.stepper.twin() else { return };
        let RunPlan { rhs, .. } = &mut *self.plan;
        let (branches, noted, listener) =
            ((rhs.branches, rhs.known), rhs.stabilization.noted(), rhs.listener.take());
        for (event, crossing) in events.iter_mut().zip(&found).filter(|(_, crossing)| apart(crossing)) {
            let mut step = *whole;
            // Where no step ends there, what the interpolant says is all that is known.
            if let Ok(Reached::Near | Reached::Far) =
                end_at(&mut *twin, self.plan, (&mut step, dense), crossing)
            {
                let StepNode { t, y, .. } = step.end;
                let state = self.plan.rhs.state(t, &y.q, &y.u);
                (event.before, event.after) = (state, state);
            }
        }
        let RunPlan { rhs, .. } = &mut *self.plan;
        (rhs.branches, rhs.known) = branches;
        rhs.stabilization.put_back(noted);
        rhs.listener = listener;
    }
}

/// Ends the step at the crossing, by the method itself and not by its interpolant: a few corrections put the
/// event function to zero at the state that results.
fn end_at<M: SimulationModel>(
    stepper: &mut dyn ErasedStepper<M>,
    plan: &mut RunPlan<'_, '_, M>,
    (step, dense): (&mut Step<M::Vector>, &dyn Dense<M::Vector>),
    crossing: &Crossing,
) -> Result<Reached, RunFailure> {
    let whole = *step;
    let at = |kind| RunFailure { kind, h: whole.h };
    let mut search = Search::new(crossing);
    let (mut theta, mut stands) = (crossing.theta, true);
    loop {
        let end_t = whole.start.t + theta * whole.h;
        if theta <= 0.0 || end_t == whole.start.t {
            return Ok(Reached::Start);
        }
        let RunPlan { rhs, locator, .. } = &mut *plan;
        *step = match stepper.shorten(rhs, &whole, end_t) {
            Ok(step) => step,
            // What was found before counts.
            Err(_) if search.best.is_some() => {
                stands = false;
                break;
            }
            Err(error) => return Err(RunFailure::of_step::<M>(error)),
        };
        let reached = rhs.state(step.end.t, &step.end.y.q, &step.end.y.u);
        let miss = locator.value(crossing.index, &reached).map_err(at)?;
        if !search.note(theta, miss) {
            break;
        }
        let Some(slope) = slope(plan, (&whole, dense), crossing, theta)? else { break };
        let Some(better) = search.next(slope) else { break };
        theta = better;
    }
    // The last correction may have been the worse one.
    let theta = search.found().unwrap_or(theta);
    let end_t = whole.start.t + theta * whole.h;
    if !stands || end_t != step.end.t {
        *step = stepper.shorten(&mut plan.rhs, &whole, end_t).map_err(RunFailure::of_step::<M>)?;
    }
    Ok(if (theta - crossing.theta).abs() <= NEAR { Reached::Near } else { Reached::Far })
}

/// The slope of the event function by the interpolant. Where it jumps, as a reaction does where a force
/// jumps, a secant leads away from the place: half-way it is on one side of the jump. A kink whose slopes are
/// less than five to one apart bends less; of a sharper one the interpolant's place is taken.
fn slope<M: SimulationModel>(
    plan: &mut RunPlan<'_, '_, M>,
    (whole, dense): (&Step<M::Vector>, &dyn Dense<M::Vector>),
    crossing: &Crossing,
    theta: f64,
) -> Result<Option<f64>, RunFailure> {
    let RunPlan { rhs, locator, options, .. } = plan;
    let (a, b) = ((theta - NEAR).max(0.0), (theta + NEAR).min(1.0));
    let mut g = |theta| {
        let state = rhs.within(dense, whole, &options.tolerances, theta);
        locator.value(crossing.index, &state).map_err(|kind: Kind| RunFailure { kind, h: whole.h })
    };
    let (from, to) = (g(a)?, g(b)?);
    let jumps = (g(0.5 * (a + b))? - 0.5 * (from + to)).abs() > JUMPS * (to - from).abs();
    Ok((!jumps).then_some((to - from) / (b - a)))
}

/// The search for the part of a step that ends at a crossing.
struct Search {
    /// Where the interpolant has it, and the value of the function there.
    first: (f64, f64),
    /// 1 where the function rises, else −1.
    side: f64,
    /// Parts that end before and behind the crossing.
    between: (f64, f64),
    /// The last part, with the value of the function at its end.
    last: Option<(f64, f64)>,
    /// The one before it.
    past: Option<(f64, f64)>,
    /// That with the least |g|.
    best: Option<(f64, f64)>,
    made: usize,
    /// It is not where the interpolant has it.
    far: bool,
    /// Parts that were no better than one before.
    vain: usize,
}

impl Search {
    fn new(crossing: &Crossing) -> Self {
        let side = if crossing.direction == Direction::Rising { 1.0 } else { -1.0 };
        let (last, past, best) = (None, None, None);
        Self {
            first: (crossing.theta, f64::INFINITY),
            side,
            between: (0.0, 1.0),
            last,
            past,
            best,
            made: 0,
            far: false,
            vain: 0,
        }
    }

    /// Notes the value of the function at the end of a part; whether to go on.
    fn note(&mut self, theta: f64, miss: f64) -> bool {
        self.made += 1;
        if self.made == 1 {
            self.first.1 = miss;
        }
        (self.past, self.last) = (self.last, Some((theta, miss)));
        let end = if miss * self.side < 0.0 { &mut self.between.0 } else { &mut self.between.1 };
        *end = theta;
        if self.best.is_some_and(|(_, least)| miss.abs() >= least.abs()) {
            self.vain += 1;
        } else {
            self.best = Some((theta, miss));
        }
        let (vain, most) = if self.far { (2, MOST) } else { (1, FEW) };
        miss != 0.0 && self.vain < vain && self.made < most
    }

    /// The part to be tried next, by this slope or, far from where the interpolant has the crossing, by the
    /// last two parts.
    fn next(&mut self, slope: f64) -> Option<f64> {
        let (theta, miss) = self.last?;
        let secant = self.past.map(|(before, value)| (miss - value) / (theta - before));
        let slope = if self.far { secant? } else { slope };
        let better = theta - miss / slope;
        if !better.is_finite() {
            return None;
        }
        if !self.far && (better - self.first.0).abs() <= NEAR {
            return (better <= 1.0).then_some(better);
        }
        self.far = true;
        let (from, to) = self.between;
        let better = if better > from && better < to { better } else { 0.5 * (from + to) };
        ((better - theta).abs() > RESOLVED).then_some(better)
    }

    /// The part that ends at the crossing. A function that only touches zero may have none by the method
    /// itself: then it is where the interpolant has it.
    fn found(&self) -> Option<f64> {
        let (theta, miss) = self.best?;
        let worse = self.far && miss.abs() > BETTER * self.first.1.abs();
        Some(if worse { self.first.0 } else { theta })
    }
}

/// Sorts the events of a step of this length. They are few and in order but for corrections; a sort of slices
/// would be compiled with every model.
fn in_order<S: ModelState>(events: &mut [EventRecord<S>], h: f64) {
    let time = |event: &EventRecord<S>| event.time() * h.signum();
    for end in 1..events.len() {
        let mut i = end;
        while i > 0 && time(&events[i]).total_cmp(&time(&events[i - 1])).is_lt() {
            events.swap(i, i - 1);
            i -= 1;
        }
    }
}

/// Whether a crossing is at the same place as another one, as far as the interpolant tells.
fn is_at(one: &Crossing, other: &Crossing) -> bool {
    (one.theta - other.theta).abs() <= crate::simulate::events::lift_off::SIMULTANEOUS
}

fn passed<S: ModelState>(name: &str, crossing: &Crossing, state: S) -> EventRecord<S> {
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

//! The loop of a run: step, look for events, record.

pub(crate) mod branch_identification;
pub(crate) mod constraint_discontinuity;
pub(crate) mod event_handling;
pub(crate) mod event_steps;
pub(crate) mod sinks;
pub(crate) mod sliding_mode;
pub(crate) mod step_size_collapse;
pub(crate) mod stiffness_detection;

use alloc::boxed::Box;
use alloc::vec::Vec;
use core::sync::atomic::{AtomicBool, Ordering};

use crate::constrain::Involved;
use crate::constrain::held::active_rows;
use crate::constrain::nearby::at_time;
use crate::constrain::weakness::{Weakness, weakness};
use crate::integrate::{Dense, Hermite, Method, Phase, Step, StepError, StepNode, StepOptions, Tolerances};
use crate::math;
use crate::model::{Dynamics, Known, ModelState, SimulationModel, Vector};
use crate::motion::diagnosis::{self, Corner, RunMethod, singular_position};
use crate::motion::erased_method::ErasedMethod;
pub(crate) use crate::motion::erased_method::stepping::{ErasedStepper, StepResult, StepStatistics};
use crate::motion::events::contact_corner;
use crate::motion::events::location::{EventLocator, Flow};
use crate::motion::events::slip_direction::{self, SlipDirection, SlipReversal};
use crate::motion::failure::SimulationErrorKind as Kind;
use crate::motion::right_hand_side::{EvaluationError, RightHandSide};
use crate::motion::run::branch_identification::{BranchContact, BranchIdentification};
use crate::motion::run::sinks::Sink;
use crate::motion::run::sliding_mode::SlidingMode;
use crate::motion::run::step_size_collapse::StepSizeCollapse;
use crate::motion::run::stiffness_detection::Stiffness;
pub(crate) use crate::motion::run::stiffness_detection::longer;
use crate::motion::stabilization::singular_start::least_distance;
use crate::motion::stabilization::{DriftVerdict, Drifted, adaptive_gain};
use crate::motion::trajectory::record::{Counts, Record};

/// Conditioning of constraints from which on a singular position is near.
const WEAK: f64 = 5.0;
/// Part of a motion that drift may decide where none is known to be near: a single row says nothing of its
/// size, and loses its direction where its gradient vanishes.
const TURNED: f64 = 0.1;

/// Time that a motion that rests does so at least, in parts of 1 + |t|.
const RESTS: f64 = 1e-3;

/// What a run needs to know.
pub(crate) struct RunPlan<'r, 'm, M: SimulationModel> {
    pub(crate) rhs: RightHandSide<'r, 'm, M>,
    pub(crate) start: M::State,
    pub(crate) end: f64,
    pub(crate) options: StepOptions,
    pub(crate) most_steps: u64,
    pub(crate) cancel: Option<&'m AtomicBool>,
    pub(crate) locator: EventLocator<'m, M>,
    pub(crate) progress: crate::progress::Progress,
    /// Where the motion turns out to be stiff for its method, another one is to go on.
    pub(crate) hands_over: bool,
    /// The state from which this method goes on, and the steps made before.
    pub(crate) resumes: Option<(M::State, u64)>,
}

impl<'r, 'm, M: SimulationModel> RunPlan<'r, 'm, M> {
    /// Puts everything back to the start, for another run with other options that shows no progress.
    pub(crate) fn restart(&mut self, rhs: RightHandSide<'r, 'm, M>, options: StepOptions, hands_over: bool) {
        (self.rhs, self.options, self.hands_over) = (rhs, options, hands_over);
        self.resumes = None;
        self.locator.restart();
        self.progress = crate::progress::Progress::none();
    }
}

/// How a run ended that did not break off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum RunEnd<S> {
    /// At its end, or where it was stopped.
    Arrived,
    /// Here, because it is stiff for the method.
    Stiff(S),
}

/// Why and where a run broke off.
pub(crate) struct Failure {
    pub(crate) kind: Kind,
    pub(crate) h: f64,
}

/// Runs a plan with one method. What was computed before a failure is in the sink.
pub(crate) fn run<M: SimulationModel>(
    erased_method: &dyn ErasedMethod<M>,
    plan: &mut RunPlan<'_, '_, M>,
    sink: &mut dyn Sink<M>,
) -> (Counts, Result<RunEnd<M::State>, Failure>) {
    let from = plan.resumes.map_or(plan.start, |(state, _)| state);
    let y = Phase { q: *from.q(), u: *from.u() };
    let mut stepper = match erased_method.begin(&mut plan.rhs, (from.t(), y), plan.end, plan.options) {
        Ok(stepper) => stepper,
        Err(error) => {
            sink.stand(Record::unmoved(from));
            let counts = Counts { evaluations: plan.rhs.evaluations, ..Counts::default() };
            return (
                counts,
                Err(explained(plan, &from, Failure { h: 0.0, ..halt::<M>(error) }, erased_method.method())),
            );
        }
    };
    let stepper = &mut *stepper;
    let begun = if plan.resumes.is_some() { Ok(()) } else { begin_singular(plan, stepper) };
    plan.rhs.stabilization.under_way = true;
    let result = match begun {
        Ok(()) => {
            let touching = BranchIdentification::from(&mut plan.rhs, &from);
            let (slide, stiffness) =
                (SlidingMode::from(from.t()), Stiffness::from(from.t(), erased_method.method()));
            RunState { plan, stepper, creep: StepSizeCollapse::new(), slide, touching, stiffness }
                .execute(sink)
        }
        Err(kind) => Err(Failure { kind, h: 0.0 }),
    };
    let now = |plan: &RunPlan<'_, '_, M>, StepNode { t, y, .. }: &StepNode<M::Vector>| {
        plan.rhs.state(*t, &y.q, &y.u)
    };
    let result =
        result.map_err(|halt| explained(plan, &now(plan, stepper.now()), halt, erased_method.method()));
    let StepStatistics { accepted, rejected, stiff_at, slides_at, .. } = stepper.statistics();
    let counts = Counts {
        steps: accepted,
        rejected,
        evaluations: plan.rhs.evaluations,
        wall_time: None,
        stiff_at,
        slides_at,
        parted: stepper.parted(),
    };
    // The next record is made by the method that goes on.
    if !matches!(result, Ok(RunEnd::Stiff(_))) {
        sink.stand(Record::new(stepper.now(), plan.rhs.held, plan.rhs.modes));
    }
    (counts, result)
}

/// At a singular start the accelerations are those of the branch on which the velocities are.
fn begin_singular<'m, M: SimulationModel>(
    plan: &mut RunPlan<'_, 'm, M>,
    stepper: &mut dyn ErasedStepper<M>,
) -> Result<(), Kind> {
    if M::IS_FREE {
        return Ok(());
    }
    let rhs = &mut plan.rhs;
    if rhs.stabilization.counts.dependent == 0 {
        return Ok(());
    }
    let now = stepper.now();
    let (start, found) = (rhs.state(now.t, &now.y.q, &now.y.u), now.a);
    if let Some(a) = rhs.stabilization.singular_start(rhs.model, rhs.constants, &start, &found)? {
        let Tolerances { absolute, relative } = plan.options.tolerances;
        stepper.leave_with(a, least_distance(&start, absolute + relative));
    }
    Ok(())
}

/// What a run does beside its steps, compiled once for all methods.
struct RunState<'f, 'r, 'm, M: SimulationModel> {
    plan: &'f mut RunPlan<'r, 'm, M>,
    stepper: &'f mut dyn ErasedStepper<M>,
    creep: StepSizeCollapse,
    slide: SlidingMode,
    touching: BranchIdentification<M>,
    stiffness: Stiffness<M>,
}

impl<M: SimulationModel> RunState<'_, '_, '_, M> {
    fn execute(mut self, sink: &mut dyn Sink<M>) -> Result<RunEnd<M::State>, Failure> {
        let at = |kind| Failure { kind, h: 0.0 };
        if self.plan.resumes.is_none() {
            self.begin(sink)?;
        }
        loop {
            let statistics = self.stepper.statistics();
            if statistics.t == self.plan.end {
                break;
            }
            self.check(&statistics).map_err(|kind| Failure { kind, h: statistics.proposed })?;
            let mut step = self.advance()?;
            let corner = self.end_before_corner(&mut step)?;
            if let Err(kind) = self.check_drift(&step) {
                match self.drifted_off(sink, &step, kind)? {
                    Flow::Continue => continue,
                    Flow::Stop => break,
                }
            }
            let flow = if self.plan.locator.is_empty() {
                self.check_sides(sink, &step)?;
                self.hand_over(sink, &step).map_err(at)?
            } else {
                self.step_with_events(sink, step)?
            };
            let flow = match corner {
                // No event before it has acted.
                Some(after) if flow == Flow::Continue && self.stepper.now().t == step.end.t => {
                    self.turn_corner(sink, after, step.h)?
                }
                _ => flow,
            };
            self.plan.progress.at(step.end.t);
            let last = flow == Flow::Stop || self.stepper.now().t == self.plan.end;
            self.check_branch(sink, last)?;
            if flow == Flow::Stop {
                break;
            }
            if self.is_stiff() {
                return Ok(RunEnd::Stiff(self.now()));
            }
        }
        Ok(RunEnd::Arrived)
    }

    /// Looks at the start: a contact that would have to pull lifts off there, what sticks and would break
    /// away slips.
    fn begin(&mut self, sink: &mut dyn Sink<M>) -> Result<(), Failure> {
        let at = |kind| Failure { kind, h: 0.0 };
        let start = self.now();
        self.plan.locator.begin(&start).map_err(at)?;
        let (mut after, mut events) = (start, Vec::new());
        self.switch_back(&mut after, &mut events).map_err(at)?;
        if !events.is_empty() {
            self.go_on_from(sink, &start, &after)?;
            events.into_iter().for_each(|event| sink.event(event));
            let resumed = self.now();
            self.plan.locator.begin(&resumed).map_err(at)?;
        }
        self.rests_in_corner().map_or(Ok(()), |kind| Err(at(kind)))
    }

    /// Where a motion rests in a corner of a constraint steps come back to it, ever shorter, or leave it to a
    /// side that nothing chose.
    fn rests_in_corner(&mut self) -> Option<Kind> {
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

    /// Ends the motion where branches of a constraint touch and it went over to another one, or may have: see
    /// [`crate::motion::run::branch_identification`].
    #[inline]
    pub(crate) fn check_branch(&mut self, sink: &mut dyn Sink<M>, last: bool) -> Result<(), Failure> {
        if M::IS_FREE || self.touching.is_idle() {
            return Ok(());
        }
        let found = self.touching.reached(&mut self.plan.rhs, self.stepper.now(), last);
        let Some(BranchContact { rows, at, changed, before }) = found else { return Ok(()) };
        let h = self.stepper.statistics().proposed;
        self.stepper.go_back(&before);
        sink.go_back(before.t);
        Err(Failure { kind: Kind::BranchesTouch { rows, at, changed }, h })
    }

    fn now(&self) -> M::State {
        let knot = self.stepper.now();
        self.plan.rhs.state(knot.t, &knot.y.q, &knot.y.u)
    }

    fn check(&mut self, statistics: &StepStatistics) -> Result<(), Kind> {
        let limit = self.plan.most_steps;
        let before = self.plan.resumes.as_ref().map_or(0, |(_, steps)| *steps);
        let StepStatistics { t: now, accepted, rejected, proposed, stiff_at, slides_at, slides } =
            *statistics;
        let made = before + accepted + rejected;
        // Where it is stiff or slides, that is what is to be said.
        if let Some(at) = self.creep.note(made, now, self.plan.end)
            && stiff_at.is_none()
            && slides_at.is_none()
        {
            return Err(self.vanish(at));
        }
        let StepOptions { fixed, most, .. } = self.plan.options;
        if let Some(took) = self.creep.took(made, now)
            && fixed.is_none()
            && proposed < most
            && self.creep.runs_out(took, (made, limit), (now, self.plan.end))
            && singular_position::stalls_before_singular_position(self.plan.rhs.model, &self.now(), took)
        {
            return Err(self.vanish(now));
        }
        let slides = slides > 0 && self.slide.outlasts((made, limit), (now, self.plan.end), slides);
        if made >= limit || slides {
            let way = [self.plan.start.t(), now];
            let stiff_at = stiff_at.or_else(|| self.is_held_by_stability(statistics).then_some(now));
            let gain = adaptive_gain::bounding_gain(self.plan.rhs.stabilization.formulation, way, made);
            return Err(Kind::TooManySteps { limit, stiff_at, slides_at, gain });
        }
        match self.plan.cancel {
            Some(flag) if flag.load(Ordering::Relaxed) => Err(Kind::Cancelled),
            _ => Ok(()),
        }
    }

    /// Steps become shorter without end towards a time: who accelerates there, and what holds it.
    #[cold]
    fn vanish(&mut self, at: f64) -> Kind {
        let state = self.now();
        let accelerations = self.stepper.now().a;
        let coordinates =
            Involved::ranked(M::COORDINATES, accelerations.as_slice().iter().copied().enumerate());
        let RunPlan { rhs, .. } = &mut *self.plan;
        let RightHandSide { model, constants, stabilization, .. } = rhs;
        let mut pulls = Vec::new();
        if M::IS_FREE {
            // Nothing holds it.
        } else if let Ok(reactions) = stabilization.reactions(model, constants, &state) {
            let gradients = stabilization.gradients(model, &state);
            pulls.extend((0..M::Rows::LEN).map(|row| {
                let length = gradients.row(row).iter().map(|x| x * x).sum::<f64>();
                (row, reactions[row] * math::sqrt(length))
            }));
        }
        Kind::StepsVanish { at, coordinates, rows: Involved::ranked(M::ROWS, pulls.into_iter()) }
    }

    /// A step after which the constraints have drifted too far: where one of them has a corner within it, the
    /// motion ends there, and goes on from an event before it that acts.
    #[cold]
    fn drifted_off(
        &mut self,
        sink: &mut dyn Sink<M>,
        step: &Step<M::Vector>,
        kind: Kind,
    ) -> Result<Flow, Failure> {
        let Step { start, end, h, .. } = step;
        if M::IS_FREE {
            return Err(Failure { kind, h: *h });
        }
        let RunPlan { rhs, .. } = &mut *self.plan;
        let between = Hermite::between(start, end, *h);
        let corner = diagnosis::corner_within(rhs.model, |theta| {
            let y = between.at(theta);
            rhs.state(start.t + theta * h, &y.q, &y.u)
        });
        let Some(Corner { row, what, jump, at }) = corner.filter(|_| matches!(kind, Kind::Drift { .. }))
        else {
            return Err(Failure { kind, h: *h });
        };
        let kind = Kind::ConstraintJumps { row: M::ROWS[row].name, what, jump, cause: Box::new(kind) };
        let end_t = start.t + at * h;
        if end_t == start.t {
            return Err(self.take_back(step, Failure { kind, h: *h }));
        }
        let up_to = match self.stepper.shorten(rhs, step, end_t) {
            Ok(up_to) => up_to,
            Err(_) => return Err(self.take_back(step, Failure { kind, h: *h })),
        };
        let flow = if self.plan.locator.is_empty() {
            self.hand_over(sink, &up_to).map_err(|kind| Failure { kind, h: *h })?
        } else {
            self.step_with_events(sink, up_to)?
        };
        // An event before it has acted.
        let acted = flow == Flow::Stop || self.stepper.now().t != end_t;
        if acted { Ok(flow) } else { Err(Failure { kind, h: *h }) }
    }

    /// Formulations that let constraints drift may do so within limits.
    fn check_drift(&mut self, step: &Step<M::Vector>) -> Result<(), Kind> {
        let rhs = &mut self.plan.rhs;
        if M::IS_FREE || rhs.stabilization.settles() {
            return Ok(());
        }
        let state = rhs.state(step.end.t, &step.end.y.q, &step.end.y.u);
        let (part, shortened) = match rhs.stabilization.look(rhs.model, &state, step.h)? {
            DriftVerdict::Harmless => return Ok(()),
            DriftVerdict::TooFar(Drifted { what, row, residual, distance, limit }) => {
                return Err(Kind::Drift { what, row, residual, distance, limit });
            }
            DriftVerdict::Decides { part, shortened } => (part, shortened),
        };
        let Weakness { condition, rows, coordinates } = weakness(rhs.model, &state);
        // Plain drift of constraints that are far from losing rank has a limit of its own.
        if condition < WEAK && (part < TURNED || shortened < WEAK) {
            return Ok(());
        }
        let condition = math::max(condition, shortened);
        Err(Kind::BranchUndetermined { rows, coordinates, condition })
    }

    /// Gives a finished step to the sink.
    fn hand_over(&mut self, sink: &mut dyn Sink<M>, step: &Step<M::Vector>) -> Result<Flow, Kind> {
        let RunPlan { rhs, options: StepOptions { tolerances, .. }, .. } = &mut *self.plan;
        let from = Record::of(step, rhs.held, rhs.modes, (rhs.stabilization.usual, rhs.stabilization.pace()));
        let to = rhs.state(step.end.t, &step.end.y.q, &step.end.y.u);
        let (mut dense, mut step) = (None, *step);
        let flow = sink.step(from, &to, &mut |theta| {
            if dense.is_none() {
                let built = self.stepper.dense(rhs, &step, true).map_err(evaluation::<M>)?;
                step.kept.between = rhs.settles_between(&*built, &step, tolerances);
                dense = Some(built);
            }
            let dense = dense.as_deref().expect("built just above");
            Ok(rhs.within(dense, &step, tolerances, theta))
        });
        self.plan.rhs.stabilization.learn();
        flow
    }

    /// Ends the motion where a released constraint begins to slip against the side by which it rubs: see
    /// [`sides`].
    #[inline]
    fn check_sides(&mut self, sink: &mut dyn Sink<M>, step: &Step<M::Vector>) -> Result<(), Failure> {
        if M::IS_UNSWITCHED {
            return Ok(());
        }
        let RunPlan { rhs, locator, .. } = &mut *self.plan;
        if rhs.modes.all_hold() {
            return Ok(());
        }
        let unfollowed = slip_direction::unfollowed::<M>(
            rhs.modes,
            locator.unilaterals().map(|(_, unilateral)| unilateral),
        );
        let suspects =
            unfollowed.filter_map(|slipping| Some((slipping, slip_direction::suspect(rhs, step, slipping)?)));
        let suspects: Vec<_> = suspects.collect();
        if suspects.is_empty() { Ok(()) } else { self.check_suspects(sink, step, &suspects) }
    }

    #[cold]
    fn check_suspects(
        &mut self,
        sink: &mut dyn Sink<M>,
        step: &Step<M::Vector>,
        suspects: &[(SlipDirection, usize)],
    ) -> Result<(), Failure> {
        let RunPlan { rhs, options, .. } = &mut *self.plan;
        let at = |kind| Failure { kind, h: step.h };
        let dense = match self.stepper.dense(rhs, step, false) {
            Ok(dense) => dense,
            Err(error) => return Err(self.take_back(step, at(evaluation::<M>(error)))),
        };
        let turned = suspects.iter().filter_map(|(slipping, place)| {
            slip_direction::turned(rhs, step, &*dense, &options.tolerances, *slipping, *place)
        });
        let Some(first) = turned.min_by(|a, b| a.theta.total_cmp(&b.theta)) else { return Ok(()) };
        let SlipReversal { constraint, side, slip, theta, at: when, sticks } = first;
        let halt = at(Kind::SlipsBack { constraint: constraint.name, side, slip, at: when, sticks });
        let end_t = step.start.t + theta * step.h;
        if theta == 0.0 || end_t == step.start.t {
            return Err(self.take_back(step, halt));
        }
        // What comes before is right, and belongs to the motion.
        match self.stepper.shorten(rhs, step, end_t) {
            Ok(up_to) => self.hand_over(sink, &up_to).map_err(at).and(Err(halt)),
            Err(_) => Err(self.take_back(step, halt)),
        }
    }

    /// Takes back a step that the sink has not seen: what it got ends where the step begins.
    fn take_back(&mut self, step: &Step<M::Vector>, halt: Failure) -> Failure {
        self.stepper.undo(step);
        halt
    }
}

fn evaluation<M: Dynamics>(error: EvaluationError) -> Kind {
    match error {
        EvaluationError::Solve(error) => error.into(),
        EvaluationError::Input(i) => Kind::InputNotFinite { input: M::INPUTS[i].name },
    }
}

fn halt<M: Dynamics>(error: StepError<EvaluationError>) -> Failure {
    let name = |i: usize| M::COORDINATES[i].name;
    match error {
        StepError::Evaluation(error) => Failure { kind: evaluation::<M>(error), h: 0.0 },
        StepError::NotFinite { coordinate, h } => {
            Failure { kind: Kind::AccelerationNotFinite { coordinate: name(coordinate) }, h }
        }
        StepError::StepTooSmall { coordinate, h } => {
            Failure { kind: Kind::StepSizeTooSmall { coordinate: name(coordinate) }, h }
        }
        StepError::Displaced { coordinate, h } => {
            Failure { kind: Kind::StepDisplaced { coordinate: name(coordinate) }, h }
        }
        StepError::NotSolved { coordinate, h } => {
            Failure { kind: Kind::StepNotSolved { coordinate: name(coordinate) }, h }
        }
    }
}

/// What a run stopped with, and what it comes from, where that shows.
pub(crate) fn explained<M: SimulationModel>(
    plan: &RunPlan<'_, '_, M>,
    at: &M::State,
    Failure { kind, h }: Failure,
    method: Method,
) -> Failure {
    let way = RunMethod::of(method, &plan.options, plan.rhs.stabilization.formulation);
    // What an evaluation met has no step of its own.
    let direction = if plan.end < at.t() { -1.0 } else { 1.0 };
    let h = if h == 0.0 { plan.options.fixed.map_or(0.0, |fixed| direction * fixed.abs()) } else { h };
    Failure { kind: diagnosis::explain(plan.rhs.model, &plan.start, at, (kind, h), way), h }
}

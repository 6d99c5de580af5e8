//! The stepper: one accepted step after another.
//!
//! [`Stepper::step`] repeats attempts until one is accepted. An attempt ([`Stepper::try_step`]) asks the
//! method for the stages and the end of a step, projects the end onto the constraints and evaluates q̈ there.
//! Then, in this order: a step with a discontinuity is repeated to end there (`switching`), one near a
//! position where constraints lose rank is repeated elsewhere (`singularity_crossing`), and the controller
//! accepts it or makes it smaller. `first_step` chooses the first size. `truncation` has what happens to
//! accepted steps at events, `replay` repeats recorded steps, `defect_control` checks their dense output,
//! `stiffness` tests whether stability bounds the steps.

use crate::integrate::discontinuity::DiscontinuityHandling;
use crate::integrate::step::{Step, StepError, StepFlags, StepOptions};
use crate::integrate::stepper::first_step::{first_step, start_accelerations};
use crate::integrate::{BranchHold, Controller, Phase, Scheme, StepNode, System, Tolerances};
use crate::model::Vector;

#[cfg(feature = "alloc")]
mod defect_control;
mod first_step;
mod replay;
mod singularity_crossing;
mod stiffness;
mod switching;
mod truncation;

use singularity_crossing::{CrossingVerdict, SingularityCrossing, UNCERTAIN_END};
use stiffness::STIFFNESS_INTERVAL;

/// Rejections in a row before a step is given up. From h ≈ |t| to the resolution of time it takes 25
/// quarterings or 50 halvings; 60 leaves a margin.
const MAX_REJECTIONS: u32 = 60;
/// A step that cannot be evaluated is repeated at this part of its size. The states that cannot be evaluated
/// are seldom near the start, so a larger value only costs attempts.
const FAILED_STEP_PART: f64 = 0.25;
/// The same where the iterations of an implicit method did not converge. Their rate is proportional to the
/// step or better, so that half a step usually suffices.
const UNSOLVED_STEP_PART: f64 = 0.5;
/// A step below this part of |t| is given up: the parts of the step that the stages take are then no longer
/// resolved by the rounding of times.
const RESOLVED_STEP_PART: f64 = 4.0 * f64::EPSILON;
/// A projection that moves the end of a step by so many times the constraint violation shows that the step is
/// near a position where the constraints lose rank. It is then repeated with projected stages, if it moves by
/// more than [`SIGNIFICANT_MOVE`], too. Away from such positions the ratio is near 1.
const AMPLIFIED_MOVE: f64 = 2.0;
/// Moves of the projection up to this, in permitted errors, are no more than the error of a step.
const SIGNIFICANT_MOVE: f64 = 1.0;
/// An error this large, in permitted errors, is not that of a step that is a little too long. Stages that
/// violate the constraints near rank loss cause it. A smaller value projects stages where steps are merely
/// too long, and each projection costs an attempt.
const OFF_CONSTRAINT_ERROR: f64 = 30.0;
/// Projecting the stages has helped if it makes a large error smaller than this part of it. A smaller value
/// gives the projection up where it still makes steps longer, a larger one pays for attempts that gain
/// little.
const HELPFUL_ERROR_PART: f64 = 0.1;
/// After a projection of the stages that did not help, so many attempts are made without. A larger value
/// delays the projection where it would help, a smaller one makes more attempts twice.
const ATTEMPTS_WITHOUT_STAGE_PROJECTION: u32 = 4;
/// Part of a step by which the last one may be longer to meet the limit exactly, so that no tiny step is left
/// over. A fixed step may stretch only by the rounding of times.
const LAST_STEP_STRETCH: f64 = 1e-2;
/// See [`LAST_STEP_STRETCH`].
const FIXED_STEP_STRETCH: f64 = 1e-9;
/// A step shorter than this part of the proposed one was cut short: by a limit, a discontinuity or a retry.
const CUT_SHORT_PART: f64 = 0.99;

/// Drives a method over a system, step by step. Allocates nothing.
///
/// ```
/// # use dynamics_runtime as dynamics;
/// use dynamics::integrate::{Dop853, Phase, StepOptions, Stepper, Tolerances};
/// use nalgebra::SVector;
/// type V = SVector<f64, 1>;
///
/// // q̈ = −q
/// let mut oscillator = |_t: f64, q: &V, _u: &V| Ok::<V, core::convert::Infallible>(-q);
/// let start = Phase { q: V::new(1.0), u: V::new(0.0) };
/// let tolerances = Tolerances::both(1e-12);
/// let options = StepOptions { tolerances, fixed: None, first: None, most: f64::INFINITY };
/// let mut stepper = Stepper::<V, Dop853<V>>::new(&mut oscillator, 0.0, start, 10.0, options).unwrap();
/// while stepper.now().t < 10.0 {
///     stepper.step(&mut oscillator, 10.0).unwrap();
/// }
/// assert!((stepper.now().y.q[0] - 10f64.cos()).abs() < 1e-11);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Stepper<V, S> {
    scheme: S,
    options: StepOptions,
    control: Option<Controller>,
    now: StepNode<V>,
    /// Size proposed for the next step, positive.
    h: f64,
    /// Time from which fixed steps are counted, and their number, so that rounding of times does not add up.
    origin: (f64, u64),
    accepted: u64,
    rejected: u64,
    /// Steps beyond the border of stability in a row, and steps away from it since the last of them.
    stiffness_counts: (u32, u32),
    stiff_at: Option<f64>,
    slides_at: Option<f64>,
    slides: u64,
    /// Attempts in which a large error is no reason to project the stages: it did not help before.
    attempts_without_stage_projection: u32,
    discontinuity: DiscontinuityHandling,
    crossing: SingularityCrossing,
}

impl<V: Vector, S: Scheme<V>> Stepper<V, S> {
    /// Starts at time t in direction of `limit`; one evaluation, and a few more to find the first step.
    pub fn new<Y: System<V>>(
        system: &mut Y,
        t: f64,
        y: Phase<V>,
        limit: f64,
        options: StepOptions,
    ) -> Result<Self, StepError<Y::Error>> {
        Self::with(S::new(), system, t, y, limit, options)
    }

    /// As [`Stepper::new`], with a method that has options of its own.
    pub fn with<Y: System<V>>(
        scheme: S,
        system: &mut Y,
        t: f64,
        y: Phase<V>,
        limit: f64,
        options: StepOptions,
    ) -> Result<Self, StepError<Y::Error>> {
        let a = start_accelerations(system, t, &y)?;
        let mut stepper = Self {
            scheme,
            options,
            control: S::CONTROL.map(|settings| Controller::new(settings, S::ERROR_ORDER)),
            now: StepNode { t, y, a },
            h: 0.0,
            origin: (t, 0),
            accepted: 0,
            rejected: 0,
            stiffness_counts: (0, 0),
            stiff_at: None,
            slides_at: None,
            slides: 0,
            attempts_without_stage_projection: 0,
            discontinuity: DiscontinuityHandling::default(),
            crossing: SingularityCrossing::default(),
        };
        stepper.h = match (options.fixed, options.first) {
            (Some(h), _) | (None, Some(h)) => h.abs(),
            (None, None) => stepper.first_step(system, limit),
        };
        Ok(stepper)
    }

    /// The present state.
    #[must_use]
    pub fn now(&self) -> &StepNode<V> {
        &self.now
    }

    /// The method, with its data of the step tried last.
    #[must_use]
    pub fn scheme(&self) -> &S {
        &self.scheme
    }

    /// Sets the accelerations of the present state, which the system cannot evaluate: a position where the
    /// constraints lose rank. The next step is proposed to be no shorter than `h`, since accelerations so
    /// near to that position are rounding.
    pub fn set_accelerations(&mut self, a: V, h: f64) {
        self.now.a = a;
        self.h = self.h.max(h.min(self.options.most));
    }

    /// Permitted local error.
    #[must_use]
    pub fn tolerances(&self) -> Tolerances {
        self.options.tolerances
    }

    /// Accepted steps so far.
    #[must_use]
    pub fn accepted(&self) -> u64 {
        self.accepted
    }

    /// Rejected steps so far.
    #[must_use]
    pub fn rejected(&self) -> u64 {
        self.rejected
    }

    /// Size proposed for the next step, positive.
    #[must_use]
    pub fn proposed_step(&self) -> f64 {
        self.h
    }

    /// When the problem was first found stiff for this method: stability, not accuracy, bounds the step
    /// there.
    #[must_use]
    pub fn stiff_at(&self) -> Option<f64> {
        self.stiff_at
    }

    /// When the motion was first found to slide along a discontinuity of the accelerations, to which these
    /// lead back from both sides.
    #[must_use]
    pub fn slides_at(&self) -> Option<f64> {
        self.slides_at
    }

    /// How often it was found to slide. After each time the next 32 steps do not look for it.
    #[must_use]
    pub fn slides(&self) -> u64 {
        self.slides
    }

    /// Number of fixed steps that were divided, to have their stages away from positions where the
    /// constraints nearly lose rank, and the start of the first.
    #[must_use]
    pub fn subdivided_steps(&self) -> (u64, Option<f64>) {
        self.crossing.subdivided_steps()
    }

    /// Makes one step towards `limit`, which is met exactly and never passed.
    #[inline]
    pub fn step<Y: System<V>>(&mut self, system: &mut Y, limit: f64) -> Result<Step<V>, StepError<Y::Error>> {
        self.discontinuity.begin_step();
        self.begin_step(system, limit).map_err(StepError::Evaluation)?;
        let start = self.now;
        let (mut retries, mut failures, mut chosen_end) = (0, 0, None);
        self.crossing.begin_step();
        loop {
            // The end of this attempt: at a discontinuity, as the step size says, or that of a retry.
            let (mut end_t, mut h) = chosen_end.take().unwrap_or_else(|| self.next_time(limit));
            if Y::IS_UNCONSTRAINED {
                // No retries.
            } else if retries > 0 {
                end_t = self.retry_end((h, retries), limit);
                h = end_t - start.t;
            }
            if end_t == start.t {
                // Time does not resolve the step: t is large, or the first or fixed step is far too small.
                return Err(StepError::StepTooSmall { coordinate: 0, h: self.h });
            }
            let mut trial = self.try_step::<_, false>(system, end_t, h);
            // A step that passes a discontinuity is repeated to end there.
            if let Ok(made) = &trial {
                match self.end_at_kink(system, made) {
                    Ok(None) => {}
                    Ok(Some(end)) => {
                        chosen_end = Some(end);
                        self.rejected += 1;
                        continue;
                    }
                    Err(error) => trial = Err(StepRejection::Evaluation(error)),
                }
            }
            // A fixed step whose stages disagree unusually is repeated elsewhere.
            if Y::IS_UNCONSTRAINED {
                // Nothing of this is compiled.
            } else {
                match self.judge_crossing(system, (retries, h), &trial) {
                    CrossingVerdict::Accept => {}
                    CrossingVerdict::AcceptBest => trial = self.check_disagreement(trial, h),
                    CrossingVerdict::Retry(retry) => {
                        retries = retry;
                        self.rejected += 1;
                        continue;
                    }
                }
            }
            // Under step control an uncertain end is avoided, and then the error decides.
            let failure = match trial {
                Ok(trial) if self.needs_retry(system, &mut retries, &trial) => {
                    self.rejected += 1;
                    continue;
                }
                Ok(trial) => {
                    if let Some(better) = self.better_end::<Y>(&trial, retries) {
                        (chosen_end, retries) = (Some((better, better - start.t)), 0);
                        self.rejected += 1;
                        continue;
                    }
                    if self.judge(trial.error, h.abs()) {
                        self.discontinuity.accept_step(h.abs());
                        system.accept_step();
                        return Ok(self.commit(&trial, h));
                    }
                    StepRejection::Error
                }
                Err(failure) => failure,
            };
            // A rejected step is repeated with a smaller size.
            retries = 0;
            failures += 1;
            self.rejected += 1;
            if !matches!(failure, StepRejection::Error) {
                let is_unsolved = matches!(failure, StepRejection::NotSolved);
                let shorter = if is_unsolved { UNSOLVED_STEP_PART } else { FAILED_STEP_PART };
                self.h = shorter * h.abs();
                self.control.iter_mut().for_each(Controller::failed);
            }
            let hopeless = self.h <= RESOLVED_STEP_PART * start.t.abs() || failures > MAX_REJECTIONS;
            if hopeless || self.is_fixed() {
                return Err(self.give_up(failure, h));
            }
        }
    }

    /// The size of the first step from the present state.
    fn first_step<Y: System<V>>(&self, system: &mut Y, limit: f64) -> f64 {
        let t = self.now.t;
        let (most, direction) =
            (self.options.most.min((limit - t).abs()), if limit < t { -1.0 } else { 1.0 });
        first_step(system, &self.now, (S::ORDER, S::LONG_STEPS), direction, most, &self.options.tolerances)
    }

    /// Asks methods that propose the size of their steps for that of the next one.
    #[inline(always)]
    fn propose<Y: System<V>>(&mut self, system: &mut Y, limit: f64) {
        if self.is_fixed() {
            return;
        }
        let direction = limit - self.now.t;
        let h = self.h.min(self.options.most).min(direction.abs()).copysign(direction);
        if let Some(proposed) = self.scheme.propose(system, &self.now, h, &self.options.tolerances) {
            let first = self.options.first.filter(|_| self.accepted == 0).unwrap_or(f64::INFINITY);
            self.h = proposed.min(first.abs()).min(self.options.most);
        }
    }

    pub(crate) fn is_fixed(&self) -> bool {
        self.options.fixed.is_some() || self.control.is_none()
    }

    /// End and signed size of the next step; `t + h` is the end exactly.
    #[inline(always)]
    fn next_time(&self, limit: f64) -> (f64, f64) {
        let t = self.now.t;
        let left = limit - t;
        let h = self.h.min(self.options.most);
        let stretch = if self.is_fixed() { FIXED_STEP_STRETCH } else { LAST_STEP_STRETCH };
        if left.abs() <= h * (1.0 + stretch) {
            return (limit, left);
        }
        let end = match self.options.fixed {
            Some(h) => self.origin.0 + (self.origin.1 + 1) as f64 * h.abs().copysign(left),
            None => t + h.copysign(left),
        };
        (end, end - t)
    }

    /// An attempt at a step, before it is judged. `REPLAY`: in place of an accepted step.
    #[inline(always)]
    fn try_step<Y: System<V>, const REPLAY: bool>(
        &mut self,
        system: &mut Y,
        end_t: f64,
        h: f64,
    ) -> Result<Trial<V>, StepRejection<Y::Error>> {
        use StepRejection::{Displaced, Evaluation, NotFinite};
        let (mut flags, mut error_before) = (StepFlags::default(), 0.0);
        self.attempts_without_stage_projection = self.attempts_without_stage_projection.saturating_sub(1);
        let branches = self.hold_branches(system, h).map_err(Evaluation)? != BranchHold::Free;
        let begin = self.now;
        loop {
            // 1. The end of the step and its error, by the method.
            let (mut y, mut error) = self.attempt::<_, REPLAY>(system, &begin, h, flags)?;
            // 2. A large error may come from stages off the constraints: once more with projected stages.
            let tolerances = &self.options.tolerances;
            if flags.stages {
                self.note_stage_projection(error, error_before);
            } else if error > OFF_CONSTRAINT_ERROR
                && self.attempts_without_stage_projection == 0
                && !self.is_fixed()
                && system.project_stages(true, tolerances)
            {
                (error_before, flags.stages) = (error, true);
                continue;
            }
            // 3. If the error is too large, only the part that projection leaves counts. A permitted error is
            // not reduced, or the next step would grow by it.
            if error > 1.0 && !self.is_fixed() {
                // States between the ends keep what the projection of the end removes.
                flags.between = true;
                error *= self.share_after_projection(system, end_t, &y).map_err(Evaluation)?;
            }
            let tolerances = &self.options.tolerances;
            let mut stage_disagreement = self.stage_disagreement(system, error, &y);
            // 4. Projection of the end, if the step may be accepted.
            let is_acceptable = error <= 1.0 || self.is_fixed();
            let unprojected = y;
            let moved = if Y::IS_UNCONSTRAINED || !is_acceptable {
                None
            } else {
                system.project(end_t, &mut y, tolerances).map_err(Evaluation)?
            };
            if Y::IS_UNCONSTRAINED {
                // Nothing of this is compiled.
            } else if let Some(moved) = moved
                && moved.by > SIGNIFICANT_MOVE
            {
                if moved.by > AMPLIFIED_MOVE * moved.violation
                    && !flags.stages
                    && S::IS_EXPLICIT
                    && system.project_stages(true, tolerances)
                {
                    (error_before, flags) =
                        (f64::INFINITY, StepFlags { stages: true, ..StepFlags::default() });
                    continue;
                }
                flags.between = true;
                if self.is_fixed()
                    && let Some(coordinate) = self.displaced_coordinate(&unprojected, &y, h)
                {
                    return Err(Displaced(coordinate));
                }
            }
            // 5. The accelerations at the end. Stages of the method belong to the end before projection.
            let noise = moved.as_ref().map_or(0.0, |moved| moved.noise);
            let a = match moved {
                Some(moved) => {
                    let by_projection = self
                        .projection_error(system, &moved, (&unprojected, &y), end_t)
                        .map_err(Evaluation)?;
                    error = error.max(by_projection);
                    if moved.noise > UNCERTAIN_END {
                        stage_disagreement = stage_disagreement.max(moved.noise);
                    }
                    system.accelerations(end_t, &y.q, &y.u)
                }
                None => self.scheme.finish(system, end_t, &y),
            };
            let a = a.map_err(Evaluation)?;
            if let Some(coordinate) = a.as_slice().iter().position(|x| !x.is_finite()) {
                return Err(NotFinite(coordinate));
            }
            flags.branches = branches;
            let end = StepNode { t: end_t, y, a };
            return Ok(Trial { start: begin, end, error, stage_disagreement, noise, flags });
        }
    }

    /// Suspends the projection of stages for a while, if it did not make the error much smaller.
    fn note_stage_projection(&mut self, error: f64, error_before: f64) {
        let is_still_large = error > HELPFUL_ERROR_PART * error_before;
        self.attempts_without_stage_projection =
            if is_still_large { ATTEMPTS_WITHOUT_STAGE_PROJECTION } else { 0 };
    }

    /// The end of a step and its error by the method alone, with stages projected as `flags` says.
    #[inline(always)]
    fn attempt<Y: System<V>, const REPLAY: bool>(
        &mut self,
        system: &mut Y,
        begin: &StepNode<V>,
        h: f64,
        flags: StepFlags,
    ) -> Result<(Phase<V>, f64), StepRejection<Y::Error>> {
        let tolerances = &self.options.tolerances;
        // Before the start is evaluated, whose accelerations may depend on it.
        system.project_stages(flags.stages, tolerances);
        let mut start = *begin;
        system.begin_attempt(&mut start, h).map_err(StepRejection::Evaluation)?;
        let attempt = if REPLAY {
            Self::replay_attempt(&mut self.scheme, system, (&start, h), tolerances)
        } else {
            self.scheme.attempt(system, &start, h, tolerances)
        };
        let (y, error) = attempt.map_err(StepRejection::Evaluation)?;
        if !self.scheme.has_converged() {
            return Err(StepRejection::NotSolved);
        }
        if !(y.is_finite() && error.is_finite()) {
            return Err(StepRejection::NotFinite(self.not_finite_coordinate()));
        }
        Ok((y, error))
    }

    /// The share of the error that is left when the end of the step is projected. Near rank loss, rounding in
    /// the direction that the constraints nearly lose would otherwise count as an error of the method, which
    /// no step size makes smaller.
    #[cold]
    fn share_after_projection<Y: System<V>>(
        &mut self,
        system: &mut Y,
        t: f64,
        y: &Phase<V>,
    ) -> Result<f64, Y::Error> {
        let error = self.scheme.error_vector();
        let Some(left) = system.error_after_projection(t, y, &error)? else {
            return Ok(1.0);
        };
        let tolerances = &self.options.tolerances;
        let size = |error| tolerances.norm(error, &self.now.y, y);
        let (part, whole) = (size(&left), size(&error));
        Ok(if part < whole { part / whole } else { 1.0 })
    }

    /// Whether a step with this error is accepted; chooses the size of the next one.
    #[inline(always)]
    fn judge(&mut self, error: f64, h: f64) -> bool {
        if self.options.fixed.is_some() || S::PROPOSES_STEP && error <= 1.0 {
            return true;
        }
        let Some(control) = &mut self.control else {
            return true;
        };
        let (accepted, factor) = control.judge(error);
        let factor = self.scheme.adjust_step_factor(factor, error);
        // A step that was cut short and accepted is no reason against a longer proposal. One that was cut
        // short and rejected is.
        let (proposed, next) = (self.h.min(self.options.most), h * factor);
        let cut = h < CUT_SHORT_PART * proposed;
        self.h = if accepted && cut { next.max(proposed) } else { next }.min(self.options.most);
        accepted
    }

    /// Accepts a step: the stepper stands at its end.
    #[inline(always)]
    fn commit(&mut self, trial: &Trial<V>, h: f64) -> Step<V> {
        let Trial { start, end, flags, .. } = *trial;
        self.note_fixed_step(end.t, h);
        self.now = end;
        self.accepted += 1;
        if self.stiffness_counts.0 > 0 || self.accepted.is_multiple_of(STIFFNESS_INTERVAL) {
            self.test_stiffness(h, &end);
        }
        let step = Step { start, end, h, flags };
        self.scheme.accept_step(&step);
        step
    }

    /// The coordinate by which the attempt became infinite or not a number.
    fn not_finite_coordinate(&self) -> usize {
        not_finite_coordinate(self.scheme.stages())
    }

    /// The coordinate whose error is the largest.
    fn worst(&self) -> usize {
        let y = &self.now.y;
        self.options.tolerances.worst(&self.scheme.error_vector(), y, y)
    }

    /// The error that ends the run after a rejection.
    fn give_up<E>(&self, failure: StepRejection<E>, h: f64) -> StepError<E> {
        match failure {
            StepRejection::Evaluation(error) => StepError::Evaluation(error),
            StepRejection::NotFinite(coordinate) => StepError::NotFinite { coordinate, h },
            StepRejection::Error => StepError::StepTooSmall { coordinate: self.worst(), h },
            StepRejection::NotSolved => StepError::NotSolved { coordinate: self.worst(), h },
            StepRejection::Displaced(coordinate) => StepError::Displaced { coordinate, h },
        }
    }
}

/// An attempt that reached its end. Errors are in permitted errors: 1 is what the tolerance permits.
struct Trial<V> {
    /// Its start, with the accelerations of the held branches.
    start: StepNode<V>,
    end: StepNode<V>,
    error: f64,
    /// The disagreement of its stages.
    stage_disagreement: f64,
    /// The uncertainty of its end from rounding.
    noise: f64,
    flags: StepFlags,
}

/// Why an attempt was rejected.
enum StepRejection<E> {
    Error,
    Evaluation(E),
    NotFinite(usize),
    NotSolved,
    Displaced(usize),
}

/// The coordinate that is not finite in the first of these stages where one is not.
#[cold]
#[inline(never)]
fn not_finite_coordinate<V: Vector>(stages: &[Phase<V>]) -> usize {
    let bad = |v: &V| v.as_slice().iter().position(|x| !x.is_finite());
    let in_stages = stages.iter().find_map(|k| bad(&k.u).or(bad(&k.q)));
    // If every stage is finite and the sum is not, it overflows: the largest acceleration is the cause.
    in_stages.unwrap_or_else(|| {
        let last = &stages[stages.len() - 1];
        (0..V::LEN).max_by(|&i, &j| last.u[i].abs().total_cmp(&last.u[j].abs())).unwrap_or(0)
    })
}

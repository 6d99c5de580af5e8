//! One accepted step after another.

use super::discontinuity::Landing;
use super::first_step::first_step;
use super::{Controller, Hold, Phase, Scheme, Settled, StepNode, System, Tolerances};
use crate::model::Vector;

#[cfg(feature = "alloc")]
mod between;
mod singularity_crossing;
mod switching;
mod truncation;

use crate::integrate::step::Step;
use crate::integrate::step::StepError;
use crate::integrate::step::StepFlags;
use crate::integrate::step::StepOptions;
use singularity_crossing::{Passing, UNCERTAIN, Verdict};

/// Rejections in a row before a step is given up. A step that cannot be evaluated is quartered each time, one
/// whose error is too large shrinks as the power law of the error says: neither takes half as many.
const MOST_REJECTIONS: u32 = 60;
/// A step whose end moves by so many times what it was off, along what holds it, is near a singular position
/// of that: made again with its stages settled, if it moves by more than [`FAR_IN_ERRORS`] permitted errors.
const AMPLIFIED: f64 = 2.0;
/// See [`AMPLIFIED`].
const FAR_IN_ERRORS: f64 = 1.0;
/// An error this large is no matter of a step that is a little too long.
const SURPRISE: f64 = 30.0;
/// See [`Stepper::fruitless`].
const FRUITLESS: u32 = 4;
/// Steps between two looks at stiffness while nothing is suspected.
const STIFFNESS_INTERVAL: u64 = 32;

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
    /// Fixed steps are counted from here, so that their times carry no accumulated rounding.
    origin: (f64, u64),
    accepted: u64,
    rejected: u64,
    suspicion: (u32, u32),
    stiff_at: Option<f64>,
    slides_at: Option<f64>,
    slides: u64,
    /// For so many attempts stages are not settled because of a large error: it did not help.
    fruitless: u32,
    landing: Landing,
    passing: Passing,
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
            suspicion: (0, 0),
            stiff_at: None,
            slides_at: None,
            slides: 0,
            fruitless: 0,
            landing: Landing::default(),
            passing: Passing::default(),
        };
        stepper.h = match (options.fixed, options.first) {
            (Some(h), _) | (None, Some(h)) => h.abs(),
            (None, None) => stepper.first_step(system, limit),
        };
        Ok(stepper)
    }

    /// Where it stands.
    #[must_use]
    pub fn now(&self) -> &StepNode<V> {
        &self.now
    }

    /// The method, with what it knows of the step tried last.
    #[must_use]
    pub fn scheme(&self) -> &S {
        &self.scheme
    }

    /// Replaces the accelerations where it stands, at a position at which the system itself does not know
    /// them; the next step is proposed to be no shorter than `h`, as accelerations so near to that position
    /// are noise.
    pub fn leave_with(&mut self, a: V, h: f64) {
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

    /// When the motion was first found to slide along a place where accelerations jump, which they lead to
    /// from both sides.
    #[must_use]
    pub fn slides_at(&self) -> Option<f64> {
        self.slides_at
    }

    /// How often it was found to. For 32 steps after each time it is not looked for.
    #[must_use]
    pub fn slides(&self) -> u64 {
        self.slides
    }

    /// How many fixed steps were made in parts, to go round positions where what holds the system nearly
    /// loses a direction, and when the first.
    #[must_use]
    pub fn parted(&self) -> (u64, Option<f64>) {
        self.passing.parted()
    }

    /// Makes one step towards `limit`, which is met exactly and never passed.
    #[inline]
    pub fn step<Y: System<V>>(&mut self, system: &mut Y, limit: f64) -> Result<Step<V>, StepError<Y::Error>> {
        self.landing.begin();
        self.begin(system, limit).map_err(StepError::Evaluation)?;
        let start = self.now;
        let (mut detours, mut failures, mut landing) = (0, 0, None);
        self.passing.begin();
        loop {
            let (mut end_t, mut h) = landing.take().unwrap_or_else(|| self.next_time(limit));
            if Y::IS_FREE {
                // No detours.
            } else if detours > 0 {
                end_t = self.end_of_detour((h, detours), limit);
                h = end_t - start.t;
            }
            if end_t == start.t {
                // Time does not resolve the step: at a large t, or where the first or fixed step is absurdly
                // small.
                return Err(StepError::StepTooSmall { coordinate: 0, h: self.h });
            }
            let mut trial = self.try_step::<_, false>(system, end_t, h);
            if let Ok(made) = &trial {
                match self.landing(system, made) {
                    Ok(None) => {}
                    Ok(Some(end)) => {
                        landing = Some(end);
                        self.rejected += 1;
                        continue;
                    }
                    Err(error) => trial = Err(StepRejection::Evaluation(error)),
                }
            }
            if Y::IS_FREE {
                // There is nothing to pass, and nothing of this is compiled.
            } else {
                match self.passes(system, (detours, h), &trial) {
                    Verdict::Good => {}
                    Verdict::Best => trial = self.left_where_it_is(trial, h),
                    Verdict::Again(shortened) => {
                        detours = shortened;
                        self.rejected += 1;
                        continue;
                    }
                }
            }
            let failure = match trial {
                Ok(trial) if self.goes_on(system, &mut detours, &trial) => {
                    self.rejected += 1;
                    continue;
                }
                Ok(trial) => {
                    if let Some(better) = self.better::<Y>(&trial, detours) {
                        (landing, detours) = (Some((better, better - start.t)), 0);
                        self.rejected += 1;
                        continue;
                    }
                    if self.judge(trial.error, h.abs()) {
                        self.landing.made(h.abs());
                        system.accepted();
                        return Ok(self.commit(&trial, h));
                    }
                    StepRejection::Error
                }
                Err(failure) => failure,
            };
            detours = 0;
            failures += 1;
            self.rejected += 1;
            if !matches!(failure, StepRejection::Error) {
                let shorter = if matches!(failure, StepRejection::NotSolved) { 0.5 } else { 0.25 };
                self.h = shorter * h.abs();
                self.control.iter_mut().for_each(Controller::failed);
            }
            let hopeless = self.h <= 4.0 * f64::EPSILON * start.t.abs() || failures > MOST_REJECTIONS;
            if hopeless || self.is_fixed() {
                return Err(self.give_up(failure, h));
            }
        }
    }

    /// The first step from where it stands.
    fn first_step<Y: System<V>>(&self, system: &mut Y, limit: f64) -> f64 {
        let t = self.now.t;
        let (most, direction) =
            (self.options.most.min((limit - t).abs()), if limit < t { -1.0 } else { 1.0 });
        first_step(system, &self.now, (S::ORDER, S::LONG_STEPS), direction, most, &self.options.tolerances)
    }

    /// Lets the method say how long the next step is.
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

    /// End and signed size of the next step: no tiny last step is left over, and `t + h` is exact.
    #[inline(always)]
    fn next_time(&self, limit: f64) -> (f64, f64) {
        let t = self.now.t;
        let left = limit - t;
        let h = self.h.min(self.options.most);
        let slack = if self.is_fixed() { 1e-9 } else { 1e-2 };
        if left.abs() <= h * (1.0 + slack) {
            return (limit, left);
        }
        let end = match self.options.fixed {
            Some(h) => self.origin.0 + (self.origin.1 + 1) as f64 * h.abs().copysign(left),
            None => t + h.copysign(left),
        };
        (end, end - t)
    }

    /// A step as it is found, before it is judged. `AGAIN`: instead of one that was made.
    #[inline(always)]
    fn try_step<Y: System<V>, const AGAIN: bool>(
        &mut self,
        system: &mut Y,
        end_t: f64,
        h: f64,
    ) -> Result<Trial<V>, StepRejection<Y::Error>> {
        let (mut kept, mut plain) = (StepFlags::default(), 0.0);
        self.fruitless = self.fruitless.saturating_sub(1);
        let branches = self.hold_branches(system, h).map_err(StepRejection::Evaluation)? != Hold::Off;
        let begin = self.now;
        loop {
            // Before the start is looked at, which may depend on it.
            let tolerances = &self.options.tolerances;
            system.hold_stages(kept.stages, tolerances);
            let mut start = begin;
            system.attempting(&mut start, h).map_err(StepRejection::Evaluation)?;
            let attempt = if AGAIN {
                Self::attempt_again(&mut self.scheme, system, (&start, h), tolerances)
            } else {
                self.scheme.attempt(system, &start, h, tolerances)
            };
            let (mut y, mut error) = attempt.map_err(StepRejection::Evaluation)?;
            if !self.scheme.converged() {
                return Err(StepRejection::NotSolved);
            }
            if !(y.is_finite() && error.is_finite()) {
                return Err(StepRejection::NotFinite(self.culprit()));
            }
            if kept.stages {
                self.fruitless = if error > 0.1 * plain { FRUITLESS } else { 0 };
            } else if error > SURPRISE
                && self.fruitless == 0
                && !self.is_fixed()
                && system.hold_stages(true, tolerances)
            {
                (plain, kept.stages) = (error, true);
                continue;
            }
            // An error that is permitted as it is does not buy longer steps.
            if error > 1.0 && !self.is_fixed() {
                // What settling removes from the end is left in the states of the stages.
                kept.between = true;
                error *= self.lasting_part(system, end_t, &y).map_err(StepRejection::Evaluation)?;
            }
            let tolerances = &self.options.tolerances;
            let mut apart = self.apart(system, error, &y);
            let acceptable = error <= 1.0 || self.is_fixed();
            let unsettled = y;
            let moved = if Y::IS_FREE || !acceptable {
                None
            } else {
                system.settle(end_t, &mut y, tolerances).map_err(StepRejection::Evaluation)?
            };
            if Y::IS_FREE {
                // Nothing moves it, and nothing of this is compiled.
            } else if let Some(Settled { by, violation, .. }) = moved {
                if by > FAR_IN_ERRORS
                    && by > AMPLIFIED * violation
                    && !kept.stages
                    && Self::hold(system, tolerances)
                {
                    (plain, kept) = (f64::INFINITY, StepFlags { stages: true, ..StepFlags::default() });
                    continue;
                }
                kept.between |= by > FAR_IN_ERRORS;
                if by > FAR_IN_ERRORS
                    && self.is_fixed()
                    && let Some(coordinate) = self.displaced(&unsettled, &y, h)
                {
                    return Err(StepRejection::Displaced(coordinate));
                }
            }
            // Stages of the step lie where it ended before it was settled.
            let noise = moved.as_ref().map_or(0.0, |moved| moved.noise);
            let a = match moved {
                Some(moved) => {
                    let decided = self
                        .decided(system, &moved, (&unsettled, &y), end_t)
                        .map_err(StepRejection::Evaluation)?;
                    error = error.max(decided);
                    apart = if moved.noise > UNCERTAIN { apart.max(moved.noise) } else { apart };
                    system.accelerations(end_t, &y.q, &y.u)
                }
                None => self.scheme.finish(system, end_t, &y),
            };
            let a = a.map_err(StepRejection::Evaluation)?;
            return match a.as_slice().iter().position(|x| !x.is_finite()) {
                Some(coordinate) => Err(StepRejection::NotFinite(coordinate)),
                None => {
                    kept.branches = branches;
                    Ok(Trial { start: begin, end: StepNode { t: end_t, y, a }, error, apart, noise, kept })
                }
            };
        }
    }

    /// Settles stages, if the method has stages that are states of the solution.
    fn hold<Y: System<V>>(system: &mut Y, tolerances: &Tolerances) -> bool {
        Self::is_explicit() && system.hold_stages(true, tolerances)
    }

    /// What settling the end of a step removes is no error of it: the share of the error that lasts. Near a
    /// singular position, rounding errors of the direction that the constraints lose would else be taken for
    /// errors of the method, which no step size makes smaller.
    #[cold]
    fn lasting_part<Y: System<V>>(&mut self, system: &mut Y, t: f64, y: &Phase<V>) -> Result<f64, Y::Error> {
        let error = self.scheme.error_vector();
        let Some(lasting) = system.lasting(t, y, &error)? else {
            return Ok(1.0);
        };
        let tolerances = &self.options.tolerances;
        let size = |error| tolerances.norm(error, &self.now.y, y);
        let (part, whole) = (size(&lasting), size(&error));
        Ok(if part < whole { part / whole } else { 1.0 })
    }

    #[inline(always)]
    fn judge(&mut self, error: f64, h: f64) -> bool {
        if self.options.fixed.is_some() || S::PROPOSES && error <= 1.0 {
            return true;
        }
        let Some(control) = &mut self.control else {
            return true;
        };
        let (accepted, factor) = control.judge(error);
        let factor = self.scheme.pace(factor, error);
        // A step that was cut short, by the end of the motion or to go round a singular position, proves
        // nothing against longer ones; one that is rejected does, however much longer the proposal was.
        let (proposed, next) = (self.h.min(self.options.most), h * factor);
        let cut = h < 0.99 * proposed;
        self.h = if accepted && cut { next.max(proposed) } else { next }.min(self.options.most);
        accepted
    }

    #[inline(always)]
    fn commit(&mut self, trial: &Trial<V>, h: f64) -> Step<V> {
        let Trial { start, end, kept, .. } = *trial;
        self.note_passed(end.t, h);
        self.now = end;
        self.accepted += 1;
        if self.suspicion.0 > 0 || self.accepted.is_multiple_of(STIFFNESS_INTERVAL) {
            self.suspect(h, &end);
        }
        let step = Step { start, end, h, kept };
        self.scheme.accepted(&step);
        step
    }

    /// Hairer's test: 15 steps at the border of stability, not interrupted by 6 away from it, mean stiffness.
    fn suspect(&mut self, h: f64, end: &StepNode<V>) {
        let Some(size) = self.scheme.stiffness(h, end) else {
            return;
        };
        if size > S::STABILITY_BORDER {
            self.suspicion = (self.suspicion.0 + 1, 0);
            if self.suspicion.0 >= 15 {
                self.stiff_at.get_or_insert(end.t);
                self.suspicion = (0, 0);
            }
        } else {
            self.suspicion.1 += 1;
            if self.suspicion.1 >= 6 {
                self.suspicion = (0, 0);
            }
        }
    }

    fn culprit(&self) -> usize {
        culprit(self.scheme.stages())
    }

    fn worst(&self) -> usize {
        let y = &self.now.y;
        self.options.tolerances.worst(&self.scheme.error_vector(), y, y)
    }

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

/// A step that could be made.
struct Trial<V> {
    /// Where it starts, with the accelerations of its branches.
    start: StepNode<V>,
    end: StepNode<V>,
    /// Its error, 1: as much as the tolerance permits.
    error: f64,
    /// What its stages disagree by, in the same measure.
    apart: f64,
    /// What rounding errors leave open of its end, in the same measure.
    noise: f64,
    kept: StepFlags,
}

/// Why an attempt was rejected.
enum StepRejection<E> {
    Error,
    Evaluation(E),
    NotFinite(usize),
    NotSolved,
    Displaced(usize),
}

/// The coordinate by which a step whose stages have these derivatives became infinite.
#[cold]
#[inline(never)]
fn culprit<V: Vector>(stages: &[Phase<V>]) -> usize {
    let bad = |v: &V| v.as_slice().iter().position(|x| !x.is_finite());
    let in_stages = stages.iter().find_map(|k| bad(&k.u).or(bad(&k.q)));
    // Every stage finite and the sum not: overflow, where the largest acceleration is the cause.
    in_stages.unwrap_or_else(|| {
        let last = &stages[stages.len() - 1];
        (0..V::LEN).max_by(|&i, &j| last.u[i].abs().total_cmp(&last.u[j].abs())).unwrap_or(0)
    })
}

fn start_accelerations<V: Vector, Y: System<V>>(
    system: &mut Y,
    t: f64,
    y: &Phase<V>,
) -> Result<V, StepError<Y::Error>> {
    system.free_branches();
    let a = system.accelerations(t, &y.q, &y.u).map_err(StepError::Evaluation)?;
    match a.as_slice().iter().position(|x| !x.is_finite()) {
        Some(coordinate) => Err(StepError::NotFinite { coordinate, h: 0.0 }),
        None => Ok(a),
    }
}

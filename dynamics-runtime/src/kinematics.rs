//! Kinematically driven mechanisms: constraints leave no freedom, and the motion follows from them alone.
//!
//! `model.kinematics(guess)` ([`Mechanism`](crate::mechanism::Mechanism)) opens an [`Analysis`]; options
//! follow, [`Analysis::run`] runs it. At every time positions solve Φ(q, t) = 0, velocities Φ_q q̇ = −Φ_t,
//! accelerations Φ_q q̈ = γ, and the multipliers Φ_qᵀλ = M q̈ − Q: of the driving constraint λ is the force
//! or torque that the drive has to give, of the others the reactions. The result is a [`KinematicMotion`],
//! which is a [`Motion`] (charts, tables, animations, `reaction_at("drive", t)`) with a summary of its own.
//! States between the steps are solved too.
//!
//! Singular positions end the analysis with an error that names the time, the kind, the rows and the
//! coordinates:
//!
//! * **lock-up**: a limit point, beyond which there is no position (a crank drives a rocker beyond its
//!   reach);
//! * **bifurcation**: branches of the assembly meet (change point of a parallelogram).
//!   [`Analysis::through_bifurcations`] passes them on the branch whose velocities are continuous.

mod error;
mod jacobian_svd;
mod locate;
mod summary;
mod trace;

use alloc::boxed::Box;
use alloc::vec;
use alloc::vec::Vec;
use core::ops::Deref;

use error::KinematicsErrorKind as Kind;
pub use error::{KinematicsError, KinematicsErrorKind};
use jacobian_svd::{JacobianSvd, PathScaling};
use locate::{SUSPECT_RATIO, SingularPoint};
pub use summary::{KinematicSummary, Passage};
use trace::{PathCounts, PathPoint, PathTracer};

use crate::constrain::{self, TopContributors};
use crate::math;
use crate::model::{Constraints, Model, ModelState, Vector};
use crate::simulate::{Motion, OptionError, Simulate};

/// Default of the longest step, in parts of the whole interval.
const MAX_STEP_SHARE: f64 = 0.05;
/// Singular values below this part of the largest count as degrees of freedom at the start. Assembled
/// positions leave zeros of about 10⁻¹⁰; larger values would take near-singular starts for free ones.
const FREEDOM_TOLERANCE: f64 = 1e-9;
const DEFAULT_MAX_STEPS: u64 = 1_000_000;

/// A kinematic analysis with its options, before it runs.
#[must_use = "an analysis does nothing until `.run()`"]
pub struct Analysis<'m, M: Simulate + Constraints> {
    model: &'m M,
    guess: M::State,
    end: Option<f64>,
    output: Option<PathOutput>,
    longest: Option<f64>,
    most_steps: u64,
    passes_bifurcations: bool,
}

/// Which states an analysis gives.
#[derive(Clone, Copy)]
enum PathOutput {
    Every(f64),
    Intervals(u32),
}

/// The options after their checks.
struct KinematicOptions {
    end: f64,
    longest: f64,
    every: Option<f64>,
}

/// The path of a mechanism as far as it was followed.
pub(crate) struct FollowedPath<M: Model> {
    states: Vec<(M::State, M::Vector)>,
    summary: KinematicSummary,
    every: Option<f64>,
}

impl<M: Model> Clone for FollowedPath<M> {
    fn clone(&self) -> Self {
        Self { states: self.states.clone(), summary: self.summary.clone(), every: self.every }
    }
}

/// The motion of a driven mechanism.
///
/// It is a [`Motion`] by dereference; [`KinematicMotion::summary`] says what the analysis took and how near
/// it came to singular positions.
pub struct KinematicMotion<'m, M: Simulate + Constraints> {
    motion: Motion<'m, M>,
    summary: KinematicSummary,
}

impl<M: Simulate + Constraints> KinematicMotion<'_, M> {
    /// Steps, corrections, the worst condition and where it was met, bifurcations that were passed.
    #[must_use]
    pub fn summary(&self) -> &KinematicSummary {
        &self.summary
    }
}

impl<'m, M: Simulate + Constraints> Deref for KinematicMotion<'m, M> {
    type Target = Motion<'m, M>;
    fn deref(&self) -> &Self::Target {
        &self.motion
    }
}

/// Its summary.
impl<M: Simulate + Constraints> core::fmt::Display for KinematicMotion<'_, M> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        core::fmt::Display::fmt(&self.summary, f)
    }
}

impl<M: Simulate + Constraints> core::fmt::Debug for KinematicMotion<'_, M> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("KinematicMotion")
            .field("motion", &self.motion)
            .field("summary", &self.summary)
            .finish()
    }
}

impl<M: Simulate + Constraints> KinematicsError<M> {
    /// The motion up to where the analysis stopped; `None` where nothing moved.
    #[must_use]
    pub fn motion<'m>(&self, model: &'m M) -> Option<KinematicMotion<'m, M>> {
        Some((**self.reached.as_ref()?).clone().into_motion(model, model.constants().ok()?))
    }
}

impl<M: Simulate + Constraints> FollowedPath<M> {
    fn into_motion(self, model: &M, constants: M::Constants) -> KinematicMotion<'_, M> {
        let motion = Motion::of_positions(model, constants, self.states, self.every, self.summary.counts());
        KinematicMotion { motion, summary: self.summary }
    }
}

impl<'m, M: Simulate + Constraints> Analysis<'m, M> {
    pub(crate) fn new(model: &'m M, guess: M::State) -> Self {
        Self {
            model,
            guess,
            end: None,
            output: None,
            longest: None,
            most_steps: DEFAULT_MAX_STEPS,
            passes_bifurcations: false,
        }
    }

    /// End time; may lie before the start.
    pub fn until(mut self, t: f64) -> Self {
        self.end = Some(t);
        self
    }

    /// Gives states at equal intervals from the start, as [`Motion::states`]; the steps of the path are
    /// chosen by themselves.
    pub fn every(mut self, interval: f64) -> Self {
        self.output = Some(PathOutput::Every(interval));
        self
    }

    /// Divides the whole interval into so many equal parts, as [`Analysis::every`] does.
    pub fn intervals(mut self, count: u32) -> Self {
        self.output = Some(PathOutput::Intervals(count));
        self
    }

    /// Longest step of the path; a twentieth of the interval where it is not given. A drive that moves out
    /// and back within one step is not seen.
    pub fn max_step(mut self, h: f64) -> Self {
        self.longest = Some(h);
        self
    }

    /// Most steps, refused ones included. Default 1,000,000.
    pub fn max_steps(mut self, steps: u64) -> Self {
        self.most_steps = steps;
        self
    }

    /// Passes bifurcations on the branch on which velocities and accelerations are continuous; without it
    /// they end the analysis, and with it those do beyond which no such branch is found. The summary lists
    /// what was passed.
    pub fn through_bifurcations(mut self) -> Self {
        self.passes_bifurcations = true;
        self
    }

    /// Follows the mechanism.
    ///
    /// # Errors
    /// [`KinematicsErrorKind`]; what was computed up to there is in the error.
    pub fn run(self) -> Result<KinematicMotion<'m, M>, KinematicsError<M>> {
        let refused = |kind: Kind| KinematicsError {
            kind,
            time: self.guess.t(),
            state: Box::new(self.guess),
            reached: None,
        };
        let KinematicOptions { end, longest, every } = self.check().map_err(|error| refused(error.into()))?;
        let constants = self.model.constants().map_err(|error| refused(Kind::SingularMassMatrix(error)))?;
        let (tracer, start) = self.begin(&constants).map_err(refused)?;
        let mut path = Path::new(tracer, start, end, longest, self.most_steps, self.passes_bifurcations);
        let result = path.follow();
        let reached = path.reached(every);
        match result {
            Ok(()) => Ok(reached.into_motion(self.model, constants)),
            Err(PathStop { kind, state }) => Err(KinematicsError {
                kind,
                time: state.t(),
                state: Box::new(state),
                reached: Some(Box::new(reached)),
            }),
        }
    }

    fn check(&self) -> Result<KinematicOptions, OptionError> {
        let number = |option, value: f64, good: bool, admissible| {
            if good { Ok(()) } else { Err(OptionError::Number { option, value, admissible }) }
        };
        OptionError::check_parameters(self.model)?;
        let start = self.guess.t();
        let end = self.end.ok_or(OptionError::NoEnd)?;
        number("until", end, end.is_finite() && end != start, "a time other than the start's")?;
        let span = (end - start).abs();
        let longest = self.longest.unwrap_or(MAX_STEP_SHARE * span);
        number(
            "max_step",
            longest,
            longest > 4.0 * f64::EPSILON * start.abs().max(end.abs()),
            "a length above 0",
        )?;
        number("max_steps", self.most_steps as f64, self.most_steps > 0, "at least 1")?;
        let every = match self.output {
            None => None,
            Some(PathOutput::Every(every)) => {
                number("every", every, every > 0.0 && every.is_finite(), "an interval above 0")?;
                number("every", every, span / every < 1e8, "an interval that gives fewer than 10⁸ times")?;
                Some(every)
            }
            Some(PathOutput::Intervals(count)) => {
                let value = f64::from(count);
                number("intervals", value, (1.0..1e8).contains(&value), "a number from 1 to less than 10⁸")?;
                Some(span / value)
            }
        };
        Ok(KinematicOptions { end, longest, every })
    }

    /// The first point: assembled, without freedom, regular.
    fn begin<'c>(&self, constants: &'c M::Constants) -> Result<(PathTracer<'c, M>, PathPoint<M>), Kind>
    where
        'm: 'c,
    {
        if M::ROWS.is_empty() {
            let coordinates = TopContributors::ranked(M::COORDINATES, (0..M::Vector::LEN).map(|i| (i, 1.0)));
            return Err(Kind::Freedom { degrees: M::Vector::LEN, coordinates, of_velocities: 0 });
        }
        let none = vec![false; M::Vector::LEN];
        let all = vec![true; M::Vector::LEN];
        let mut resting = self.guess;
        *resting.u_mut() = M::Vector::zeros();
        // Positions first. Velocities need not exist in a singular position.
        let rows: Vec<usize> = constrain::active_set::active_rows::<M>(resting.active_set(), true).collect();
        let placed = constrain::assemble::positions_of(self.model, resting, &none).map_err(Kind::Start)?;
        let scaling = PathScaling::from(self.model, &placed, rows);
        let svd = self.svd(&scaling, &placed)?;
        let rank = svd.rank(FREEDOM_TOLERANCE);
        if rank < M::Vector::LEN {
            return Err(self.not_driven(&scaling, &placed, &svd));
        }
        let placed = constrain::assemble(self.model, placed, &all, &none).map_err(Kind::Start)?;
        let mut tracer = PathTracer::new(self.model, constants, scaling);
        let point = tracer.complete(placed, None)?;
        Ok((tracer, point))
    }

    fn svd(&self, scaling: &PathScaling, state: &M::State) -> Result<JacobianSvd, Kind> {
        JacobianSvd::new(scaling, self.model, state).map_err(|row| {
            Kind::Start(crate::error::StateError::ConstraintNotFinite { row: M::ROWS[row].name })
        })
    }

    /// The error for a start without full rank. Degrees of freedom also exist at a nearby state; in a
    /// singular position the rank is full there.
    fn not_driven(&self, scaling: &PathScaling, state: &M::State, svd: &JacobianSvd) -> Kind {
        let n = M::Vector::LEN;
        let mut beside = *state;
        for (i, q) in beside.q_mut().as_mut_slice().iter_mut().enumerate() {
            *q += 1e-2 * (1.0 + q.abs()) * (0.5 + math::sin(1.0 + 2.4 * i as f64));
        }
        let generic =
            JacobianSvd::new(scaling, self.model, &beside).map_or(0, |svd| svd.rank(FREEDOM_TOLERANCE));
        let freedom = svd.freedom(FREEDOM_TOLERANCE);
        let coordinates = TopContributors::ranked(M::COORDINATES, freedom.iter().copied().enumerate());
        if generic < n {
            let of_velocities = M::VelocityOffset::LEN;
            return Kind::Freedom { degrees: n - svd.rank(FREEDOM_TOLERANCE), coordinates, of_velocities };
        }
        let (_, left) = svd.weakest_vectors();
        let rows = TopContributors::ranked(M::ROWS, scaling.rows.iter().copied().zip(left.iter().copied()));
        Kind::SingularStart { rows, coordinates }
    }
}

/// Why and where a path ends early.
struct PathStop<S> {
    kind: Kind,
    state: S,
}

/// A path that is being followed.
struct Path<'c, M: Constraints> {
    tracer: PathTracer<'c, M>,
    end: f64,
    longest: f64,
    most_steps: u64,
    passes_bifurcations: bool,
    direction: f64,
    states: Vec<(M::State, M::Vector)>,
    /// The last points, for locating singular positions.
    recent: Vec<PathPoint<M>>,
    /// Largest value so far of the smallest singular value.
    largest_least: f64,
    /// The path is suspected to lead to a singular position where the smallest singular value is below this.
    suspect_below: f64,
    worst_condition: (f64, f64),
    passages: Vec<Passage>,
}

/// Exponent with which the smallest singular value falls with the distance, from which on branches touch. It
/// is 1 where branches cross and 2 where they touch.
const TOUCHING_EXPONENT: f64 = 1.4;
/// Least ratio of two distances from a bifurcation from which the exponent is computed.
const DISTANCE_RATIO: f64 = 1.5;
/// Number of points that are kept for locating singular positions.
const POINTS_KEPT: usize = 6;

impl<'c, M: Constraints> Path<'c, M> {
    fn new(
        tracer: PathTracer<'c, M>,
        start: PathPoint<M>,
        end: f64,
        longest: f64,
        most_steps: u64,
        passes_bifurcations: bool,
    ) -> Self {
        let direction = if end < start.state.t() { -1.0 } else { 1.0 };
        let mut path = Self {
            tracer,
            end,
            longest,
            most_steps,
            passes_bifurcations,
            direction,
            states: Vec::new(),
            recent: Vec::new(),
            largest_least: 0.0,
            suspect_below: 0.0,
            worst_condition: (0.0, start.state.t()),
            passages: Vec::new(),
        };
        path.record_point(start);
        path
    }

    fn last(&self) -> &PathPoint<M> {
        self.recent.last().expect("the start is there from the beginning")
    }

    fn record_point(&mut self, point: PathPoint<M>) {
        let (least, condition) = (point.svd.least(), point.svd.condition());
        if condition > self.worst_condition.0 {
            self.worst_condition = (condition, point.state.t());
        }
        if least > self.largest_least {
            self.largest_least = least;
        }
        // The suspicion ends where σ is well above the bound again.
        if self.suspect_below == 0.0 || least > 10.0 * self.suspect_below {
            self.suspect_below = SUSPECT_RATIO * self.largest_least;
        }
        self.states.push((point.state, point.accelerations));
        if self.recent.len() == POINTS_KEPT {
            self.recent.remove(0);
        }
        self.recent.push(point);
    }

    fn stop(&self, kind: Kind) -> PathStop<M::State> {
        PathStop { kind, state: self.last().state }
    }

    /// Follows the path to the end, or to a singular position.
    fn follow(&mut self) -> Result<(), PathStop<M::State>> {
        let least = 16.0 * f64::EPSILON * self.end.abs().max(self.last().state.t().abs());
        let mut h = self.longest * 0.02;
        loop {
            let now = self.last().state.t();
            let left = (self.end - now).abs();
            if left == 0.0 {
                return Ok(());
            }
            if self.tracer.counts.steps + self.tracer.counts.rejected >= self.most_steps {
                return Err(self.stop(Kind::TooManySteps { limit: self.most_steps }));
            }
            h = h.min(self.longest);
            let t = if h > 0.99 * left { self.end } else { now + self.direction * h };
            let from = self.recent.last().expect("the start is there from the beginning");
            match self.tracer.step(from, t) {
                Ok((point, contraction)) => {
                    self.tracer.counts.steps += 1;
                    h = (t - now).abs() * PathTracer::<M>::growth(contraction);
                    self.record_point(point);
                    self.check_singularity()?;
                }
                Err(kind) => {
                    self.tracer.counts.rejected += 1;
                    h = 0.5 * (t - now).abs();
                    if h <= least {
                        return Err(self.explain_failure(kind));
                    }
                }
            }
        }
    }

    /// Locates a singular position where one is suspected, and passes it or stops.
    fn check_singularity(&mut self) -> Result<(), PathStop<M::State>> {
        if self.last().svd.least() >= self.suspect_below {
            return Ok(());
        }
        let Some(singular) = self.tracer.locate(&self.recent) else {
            // Try again when it is nearer.
            self.suspect_below *= 0.1;
            return Ok(());
        };
        // Beyond the end it does not matter.
        if self.direction * (singular.state.t() - self.end) > 1e-12 * (1.0 + self.end.abs()) {
            return Ok(());
        }
        self.handle_singularity(singular)
    }

    fn handle_singularity(&mut self, singular: SingularPoint<M::State>) -> Result<(), PathStop<M::State>> {
        let SingularPoint { state, locks_up, loss, rows, coordinates } = singular;
        if locks_up {
            return Err(PathStop { kind: Kind::LockUp { rows, coordinates }, state });
        }
        // Branches that touch are closer to each other than any prediction.
        if self.branches_touch(&state) {
            return Err(PathStop { kind: Kind::BranchesTouch { rows, coordinates }, state });
        }
        let pass_bifurcation = if self.passes_bifurcations { self.pass_bifurcation(&state) } else { None };
        let Some(point) = pass_bifurcation else {
            return Err(PathStop {
                kind: Kind::Bifurcation { loss, rows, coordinates, tried: self.passes_bifurcations },
                state,
            });
        };
        self.passages.push(Passage { time: state.t(), rows, coordinates });
        self.recent.clear();
        self.suspect_below = SUSPECT_RATIO * point.svd.least();
        self.tracer.counts.steps += 1;
        self.record_point(point);
        Ok(())
    }

    /// Whether branches touch at a bifurcation: the smallest singular value then falls faster than in
    /// proportion to the distance.
    fn branches_touch(&self, at: &M::State) -> bool {
        let distance = |point: &PathPoint<M>| (at.t() - point.state.t()).abs();
        let last = self.last();
        let farther =
            self.recent.iter().rev().find(|point| distance(point) >= DISTANCE_RATIO * distance(last));
        farther.is_some_and(|far| {
            let [near, far] =
                [last, far].map(|point| (math::ln(distance(point)), math::ln(point.svd.least())));
            (far.1 - near.1) / (far.0 - near.0) > TOUCHING_EXPONENT
        })
    }

    /// The point as far behind a bifurcation as the last one is before it, on the branch with continuous
    /// velocities.
    fn pass_bifurcation(&mut self, at: &M::State) -> Option<PathPoint<M>> {
        let from = self.last().clone();
        let distance = at.t() - from.state.t();
        let mirrored = at.t() + distance;
        // The end may come first, as long as it is well away from the bifurcation.
        let ends = self.direction * (self.end - mirrored) < 0.0;
        let t = if ends { self.end } else { mirrored };
        if ends && (t - at.t()).abs() < 0.1 * distance.abs() {
            return None;
        }
        let mut state = PathTracer::predict(&from, t);
        let predicted = *state.u();
        self.tracer.solve_positions(&mut state).ok()?;
        let point = self.tracer.complete(state, None).ok()?;
        let mut turned = *point.state.u();
        trace::add(&mut turned, -1.0, &predicted);
        let length = |v: &M::Vector| self.tracer.scaling.length(v.as_slice());
        (length(&turned) <= 0.01 * length(&predicted)).then_some(point)
    }

    /// The error where the path cannot be continued: a singular position if the last points lead to one,
    /// otherwise the failure of the last step.
    fn explain_failure(&self, kind: Kind) -> PathStop<M::State> {
        match self.tracer.locate(&self.recent) {
            Some(SingularPoint { state, locks_up: true, rows, coordinates, .. }) => {
                PathStop { kind: Kind::LockUp { rows, coordinates }, state }
            }
            Some(SingularPoint { state, loss, rows, coordinates, .. }) => PathStop {
                kind: Kind::Bifurcation { loss, rows, coordinates, tried: self.passes_bifurcations },
                state,
            },
            None => self.stop(kind),
        }
    }

    fn reached(&mut self, every: Option<f64>) -> FollowedPath<M> {
        let PathCounts { steps, rejected, corrections } = self.tracer.counts;
        let at = |state: &M::State| state.t();
        let summary = KinematicSummary {
            model: M::NAME,
            interval: (at(&self.states[0].0), at(&self.states[self.states.len() - 1].0)),
            steps,
            rejected,
            corrections,
            worst_condition: self.worst_condition.0,
            worst_condition_time: self.worst_condition.1,
            passages: core::mem::take(&mut self.passages),
        };
        FollowedPath { states: core::mem::take(&mut self.states), summary, every }
    }
}

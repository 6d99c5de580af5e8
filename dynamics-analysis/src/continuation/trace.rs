//! Steps along a branch.
//!
//! A step x₁ = x₀ + h t goes along the tangent t and returns to the branch, F(x) = 0, in the plane normal
//! to it (Keller's pseudo-arclength), or at constant parameter (load control). Its length follows the angle
//! between tangents (`step_control.rs`) and the number of corrections. A step in which the tangent turns too
//! far is repeated with half its length, so that the branch is not left for another one nearby. The middle of
//! each step is computed, too, and the points at which a stiffness or the slope of the parameter may have its
//! minimum. A quantity that changes sign twice within a step is detected there. E. L. Allgower & K. Georg,
//! *Introduction to Numerical Continuation Methods*, chapters 4 to 6.

use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec::Vec;
use core::f64::consts::TAU;

use dynamics_runtime::model::{Constraints, ModelState, Powers, Vector};
use dynamics_runtime::progress::Progress;

use super::branch::{Branch, BranchEnd, PointOnBranch, SpecialPoint};
use super::error::ContinuationError;
use super::newton::{CorrectorError, SingularityCondition};
use super::problem::{Balance, ContinuationPoint, ContinuationProblem, Direction};
use super::step_control::{MAX_TURN, length_ratio};
use super::test_functions::TestFunctions;
use crate::equilibria::{EquilibriumError, judge};

/// Steps longer than this are halved if a test function changes sign in them and no special point can be
/// computed there: the step then led to another branch, or cut a bend. Shorter steps are accepted, and the
/// point is reported as it was enclosed.
const MIN_STEP_AT_UNLOCATED_POINT: f64 = 1e-6;
/// Steps up to this length count as creeping: [`MAX_CREEPING_STEPS`] of them advance the branch by no more
/// than 4·10⁻⁶. Without this bound, a corner of the forces that shrinks every step would take all points
/// of the branch.
const CREEPING_STEP: f64 = 1e-7;
/// The branch is given up after this many creeping steps in a row. One longer step starts the count again.
const MAX_CREEPING_STEPS: usize = 40;

/// Under load control, a fold within this distance of the last point is the limit load. If none is there, the
/// failure is reported as that of any branch.
const MAX_DISTANCE_TO_LIMIT: f64 = 1e-2;
/// Largest distance of the middle of a step from the cubic through its ends, as a share of the step. For a
/// smooth branch it is of fourth order in the step. With a larger value steps lead to neighbouring branches,
/// with a smaller one they become short in sharp bends.
const MAX_DEVIATION_FROM_CUBIC: f64 = 0.01;
/// A branch has returned to its first point if it passes it within this distance. Points are accurate to
/// rounding, so that the distance is only that along the curved branch. Other pieces of a branch that pass
/// nearer than this would be taken for its beginning.
const CLOSURE_DISTANCE: f64 = 1e-6;

/// Largest distance of a given start from the equilibrium, in the scales of the coordinates, in addition to
/// ten times the uncertainty of the equilibrium. It allows for starts that were written with six digits.
const MAX_START_ERROR: f64 = 1e-6;
/// Distance beyond the last point at which the model is evaluated, to report why the branch ends there.
const MODEL_PROBE_DISTANCE: f64 = 1e-4;
/// Largest distance between the predictor and the corrected point, as a share of the step: farther away the
/// corrector has found another branch.
const MAX_CORRECTION: f64 = 0.5;
/// The same for the first step from a branch point, in steps. Its direction is known less accurately, because
/// branches bend away from the null space.
pub(super) const MAX_CORRECTION_AT_BRANCH_POINT: f64 = 3.0;
/// A closed branch has more points than this.
const MIN_POINTS_BEFORE_CLOSURE: usize = 3;
/// A chord passes the first point of a closed branch within this share of the step: arcs whose
/// tangent turns by less than 0.35 rad leave it by at most 0.044 of its length.
const MAX_CHORD_DISTANCE: f64 = 0.1;
/// Steps that needed more corrections than this are followed by shorter ones.
const MAX_EASY_CORRECTIONS: usize = 6;

/// How a branch is followed.
#[derive(Clone, Debug)]
pub(super) struct ContinuationOptions {
    pub(super) name: String,
    pub(super) range: [f64; 2],
    pub(super) first: f64,
    pub(super) longest: f64,
    pub(super) shortest: f64,
    pub(super) points: usize,
    pub(super) load_control: bool,
    #[cfg(feature = "progress")]
    pub(super) progress: bool,
}

/// A point on a branch with its tangent and its test functions.
pub(super) struct Sample<M: Constraints> {
    pub(super) balance: Balance<M>,
    pub(super) tangent: Direction,
    pub(super) test_functions: TestFunctions,
}

impl<M: Constraints> Sample<M> {
    pub(super) fn point(&self) -> &ContinuationPoint<M::State> {
        &self.balance.place
    }

    pub(super) fn coordinates(&self) -> &[usize] {
        &self.balance.statics.tangent.coordinates
    }
}

/// The continuation of one branch, with what was computed of it.
pub(super) struct Tracer<'t, M: Constraints> {
    pub(super) problem: &'t ContinuationProblem<'t, M>,
    pub(super) options: &'t ContinuationOptions,
    pub(super) periodic: &'t [bool],
    pub(super) points: Vec<PointOnBranch<M::State>>,
    pub(super) special: Vec<SpecialPoint<M::State>>,
    rejected: usize,
    derivative_error: f64,
    progress: Progress,
}

/// An accepted step: its middle and its end.
enum StepOutcome<M: Constraints> {
    /// With the length of the next step.
    Taken(Box<Sample<M>>, Box<Sample<M>>, f64),
    /// It ends at an end of the range.
    Last(Box<Sample<M>>, Box<Sample<M>>),
}

impl<'t, M: Constraints + Powers> Tracer<'t, M> {
    pub(super) fn new(
        problem: &'t ContinuationProblem<'t, M>,
        options: &'t ContinuationOptions,
        periodic: &'t [bool],
    ) -> Self {
        #[cfg(feature = "progress")]
        let progress = if options.progress {
            Progress::of("points", 0.0, options.points as f64)
        } else {
            Progress::none()
        };
        #[cfg(not(feature = "progress"))]
        let progress = Progress::none();
        let (points, special) = (Vec::new(), Vec::new());
        Self { problem, options, periodic, points, special, rejected: 0, derivative_error: 0.0, progress }
    }

    /// A point in balance, with the direction in which its branch continues.
    pub(super) fn sample(&self, balance: Balance<M>, along: &Direction) -> Result<Sample<M>, CorrectorError> {
        let tangent = self.problem.tangent(&balance, along, None).ok_or(CorrectorError::NotConverged)?;
        let test_functions =
            TestFunctions::of(self.problem, &balance, &tangent).map_err(CorrectorError::Model)?;
        Ok(Sample { balance, tangent, test_functions })
    }

    /// The point on the branch in the plane normal to the tangent of a sample, at the distance `s` along it,
    /// and the corrections that it took. It lies no farther from there than `reach`.
    pub(super) fn point_at(
        &self,
        from: &Sample<M>,
        s: f64,
        reach: f64,
    ) -> Result<(Sample<M>, usize), CorrectorError> {
        let guess = self.problem.moved(from.point(), &from.tangent.scaled(s));
        let plane = Some((&from.tangent, &guess));
        let corrected = self.problem.solve(&guess, from.coordinates(), plane, None, reach)?;
        Ok((self.sample(corrected.balance, &from.tangent)?, corrected.iterations))
    }

    /// As [`Tracer::point_at`], in the plane of the value that the parameter has on the tangent there.
    fn point_at_parameter(
        &self,
        from: &Sample<M>,
        s: f64,
        reach: f64,
    ) -> Result<(Sample<M>, usize), CorrectorError> {
        let guess = self.problem.moved(from.point(), &from.tangent.scaled(s));
        let normal = Direction { q: &from.tangent.q * 0.0, p: [1.0, 0.0] };
        let corrected =
            self.problem.solve(&guess, from.coordinates(), Some((&normal, &guess)), None, reach)?;
        Ok((self.sample(corrected.balance, &from.tangent)?, corrected.iterations))
    }

    /// Starts at a point in balance along a direction; `branching` if branches meet at this point.
    pub(super) fn run(
        mut self,
        first: Sample<M>,
        branching: bool,
    ) -> Result<Branch<M::State>, ContinuationError<M::State>> {
        let (mut here, mut h) = (first, self.options.first.min(self.options.longest));
        let (origin, direction) = (*here.point(), here.tangent.clone());
        self.push_point(&here, 0.0);
        if !branching {
            self.begin_in_fold(&here);
        }
        let (mut failure, mut creeping_steps) = (CorrectorError::NotConverged, 0);
        while self.points.len() < self.options.points {
            self.progress.at(self.points.len() as f64);
            let leaving = branching && self.points.len() == 1;
            // A step, or half of it once more.
            let step = match self.step(&here, h, leaving) {
                Ok(step) => step,
                Err(why) => {
                    self.rejected += 1;
                    failure = if let CorrectorError::Model(_) = why { why } else { failure };
                    h *= 0.5;
                    if h < self.options.shortest {
                        return Err(self.stopped(&here, h, failure));
                    }
                    continue;
                }
            };
            if h > CREEPING_STEP {
                (failure, creeping_steps) = (CorrectorError::NotConverged, 0);
            } else {
                creeping_steps += 1;
                if creeping_steps > MAX_CREEPING_STEPS {
                    return Err(self.stopped(&here, h, failure));
                }
            }
            let (middle, next, after, last) = match step {
                StepOutcome::Taken(middle, next, after) => (middle, next, after, false),
                StepOutcome::Last(middle, next) => (middle, next, h, true),
            };
            // Special points in it. If one cannot be computed, the step is repeated with half its length.
            let known = self.special.len();
            let sound = leaving || self.find_special_points_in_step(&here, &middle, &next);
            if !sound && h > MIN_STEP_AT_UNLOCATED_POINT {
                self.special.truncate(known);
                (self.rejected, h) = (self.rejected + 1, 0.5 * h);
                continue;
            }
            // The next point is accepted, and the branch ends if it is closed or at an end of the range.
            let distance = self.problem.distance(here.point(), middle.point())
                + self.problem.distance(middle.point(), next.point());
            if !last && self.passes_start(&origin, &direction, &here, &next) {
                self.append_start(here.point());
                return self.finish_if_time_independent(BranchEnd::Closed);
            }
            self.push_point(&next, distance);
            if !leaving {
                self.find_flutter_onset(&here, &next);
            }
            (here, h) = (*next, after.min(self.options.longest));
            if last {
                return self.finish_if_time_independent(BranchEnd::Range);
            }
        }
        self.finish_if_time_independent(BranchEnd::Points)
    }

    /// One step of length h, or up to the end of the range.
    fn step(&self, here: &Sample<M>, h: f64, leaving: bool) -> Result<StepOutcome<M>, CorrectorError> {
        let ratio = if leaving { MAX_CORRECTION_AT_BRANCH_POINT } else { MAX_CORRECTION };
        let [lo, hi] = self.options.range;
        let p = |sample: &Sample<M>| sample.point().p[0];
        let slope = here.tangent.p[0];
        let bound = if slope > 0.0 { hi } else { lo };
        // The predictor ends at the end of the range if that is nearer than h along the tangent.
        let remaining = if slope == 0.0 { f64::INFINITY } else { (bound - p(here)) / slope };
        let (mut s, mut last) = if remaining <= h { (remaining.max(0.0), true) } else { (h, false) };
        let mut found = None;
        // The corrector. A step that bends out of the range is cut at its end.
        if !last {
            let reach = ratio * s;
            let (next, iterations) = match self.options.load_control {
                true => self.point_at_parameter(here, s, reach)?,
                false => self.point_at(here, s, reach)?,
            };
            if (lo..=hi).contains(&p(&next)) {
                found = Some((next, iterations));
            } else {
                (s, last) = (s * ((bound - p(here)) / (p(&next) - p(here))).clamp(0.0, 1.0), true);
            }
        }
        let (mut next, iterations) = match found {
            Some(found) => found,
            None => self.to_bound(here, s, bound, MAX_CORRECTION * h)?,
        };
        if last {
            next.balance.place.p[0] = bound;
        }
        let middle = self.point_at(here, 0.5 * self.distance_ahead(here, &next), ratio * s)?.0;
        let angle = self.problem.angle(&here.tangent, &next.tangent);
        if !leaving && (angle > MAX_TURN || self.deviates_from_cubic(here, &middle, &next)) {
            return Err(CorrectorError::NotConverged);
        }
        // If forces change with time here, shorter steps approach the point where that begins.
        next.balance.check_time(false).map_err(CorrectorError::Model)?;
        if last {
            return Ok(StepOutcome::Last(Box::new(middle), Box::new(next)));
        }
        let by_angle = length_ratio(angle);
        let by_effort = if iterations > MAX_EASY_CORRECTIONS { 0.5 } else { 2.0 };
        let after = if leaving { h } else { h * by_angle.min(by_effort) };
        Ok(StepOutcome::Taken(Box::new(middle), Box::new(next), after))
    }

    /// Whether the middle of a step deviates from the cubic Hermite polynomial through its ends,
    ///
    /// ```text
    /// x(½) = ½ (x₀ + x₁) + ⅛ h (t₀ − t₁)
    /// ```
    ///
    /// The step then led to another branch, or cut a bend.
    fn deviates_from_cubic(&self, here: &Sample<M>, middle: &Sample<M>, next: &Sample<M>) -> bool {
        let length = self.problem.distance(here.point(), next.point());
        let chord = self.problem.between(here.point(), next.point());
        let to = self.problem.between(here.point(), middle.point());
        let (a, b) = (&here.tangent, &next.tangent);
        let cubic = |c: f64, a: f64, b: f64| 0.5 * c + 0.125 * length * (a - b);
        let deviation = Direction {
            q: &to.q - &chord.q * 0.5 - (&a.q - &b.q) * (0.125 * length),
            p: [to.p[0] - cubic(chord.p[0], a.p[0], b.p[0]), 0.0],
        };
        // The middle lies in a plane normal to the first tangent, a little before or after that of the cubic.
        // So only the part normal to the branch counts.
        let along = self.problem.dot(&deviation, &middle.tangent);
        (self.problem.dot(&deviation, &deviation) - along * along).max(0.0).sqrt()
            > MAX_DEVIATION_FROM_CUBIC * length
    }

    /// The point at the end `bound` of the range, which is at about the distance `s` along the tangent.
    fn to_bound(
        &self,
        here: &Sample<M>,
        s: f64,
        bound: f64,
        reach: f64,
    ) -> Result<(Sample<M>, usize), CorrectorError> {
        let mut guess = self.problem.moved(here.point(), &here.tangent.scaled(s));
        guess.p[0] = bound;
        let normal = Direction { q: &here.tangent.q * 0.0, p: [1.0, 0.0] };
        let corrected =
            self.problem.solve(&guess, here.coordinates(), Some((&normal, &guess)), None, reach)?;
        Ok((self.sample(corrected.balance, &here.tangent)?, corrected.iterations))
    }

    /// The distance from one point to another along the tangent of the first.
    pub(super) fn distance_ahead(&self, from: &Sample<M>, to: &Sample<M>) -> f64 {
        self.problem.dot(&from.tangent, &self.problem.between(from.point(), to.point()))
    }

    /// Whether the step passes the first point of the branch in its direction. Angles on which the model
    /// depends with period 2π are compared modulo 2π.
    fn passes_start(
        &self,
        origin: &ContinuationPoint<M::State>,
        direction: &Direction,
        here: &Sample<M>,
        next: &Sample<M>,
    ) -> bool {
        if self.points.len() <= MIN_POINTS_BEFORE_CLOSURE || self.problem.dot(direction, &next.tangent) < 0.5
        {
            return false;
        }
        let from_origin = |to: &Sample<M>| {
            let mut by = self.problem.between(origin, to.point());
            for (q, _) in by.q.iter_mut().zip(self.periodic).filter(|(_, periodic)| **periodic) {
                *q -= TAU * (*q / TAU).round();
            }
            by
        };
        let (before, after) = (from_origin(here), from_origin(next));
        let (a, b) = (self.problem.dot(direction, &before), self.problem.dot(direction, &after));
        let length = self.problem.distance(here.point(), next.point());
        if !(a < 0.0 && b >= 0.0) || self.problem.norm(&after) > 2.0 * length {
            return false;
        }
        // The chord passes the first point within a tenth of the step, because a step bends less than that.
        let part = -a / (b - a);
        let mix = |x: [f64; 2], k: usize| (1.0 - part) * x[0] + part * if k == 0 { x[1] } else { 0.0 };
        let q = &before.q * (1.0 - part) + &after.q * part;
        let p = [mix([before.p[0], after.p[0]], 0), 0.0];
        if self.problem.norm(&Direction { q, p }) > MAX_CHORD_DISTANCE * length {
            return false;
        }
        // The branch itself passes through the first point. Otherwise this is another piece of it nearby.
        let Ok((there, _)) = self.point_at(here, part * self.distance_ahead(here, next), 0.5 * length) else {
            return false;
        };
        let back = there.tangent.scaled(-self.problem.dot(&there.tangent, &from_origin(&there)));
        let rest = from_origin(&there);
        let missed_by = Direction { q: &rest.q + &back.q, p: [rest.p[0] + back.p[0], 0.0] };
        let along = self.problem.norm(&back);
        // The tangential part is removed to first order; curvature leaves its square.
        self.problem.norm(&missed_by) <= CLOSURE_DISTANCE + along * along / length
    }

    /// Appends the first point once more, as the last one of a closed branch.
    fn append_start(&mut self, here: &ContinuationPoint<M::State>) {
        let [first, .., last] = &self.points[..] else { return };
        let first = first.clone();
        let there = ContinuationPoint { state: first.state, p: [first.parameter, 0.0] };
        let mut by = self.problem.between(here, &there);
        by.q.iter_mut()
            .zip(self.periodic)
            .filter(|(_, p)| **p)
            .for_each(|(q, _)| *q -= TAU * (*q / TAU).round());
        let arclength = last.arclength + self.problem.norm(&by);
        let state = self.problem.moved(here, &by).state;
        self.points.push(PointOnBranch { arclength, state, ..first });
    }

    /// Appends a point, at this distance from the last one, and judges its stability.
    pub(super) fn push_point(&mut self, sample: &Sample<M>, distance: f64) {
        let arclength = self.points.last().map_or(0.0, |last| last.arclength) + distance;
        let (place, model) = (sample.point(), &sample.balance.model);
        self.derivative_error = self.derivative_error.max(sample.balance.derivative_error);
        let stability = judge(model, &place.state);
        self.points.push(PointOnBranch { parameter: place.p[0], state: place.state, arclength, stability });
    }

    /// The length of the branch up to a point beside its last one.
    pub(super) fn arclength(&self, place: &ContinuationPoint<M::State>) -> f64 {
        self.points.last().map_or(0.0, |last| {
            last.arclength
                + self.problem.distance(
                    &ContinuationPoint { state: last.state, p: [last.parameter, place.p[1]] },
                    place,
                )
        })
    }

    fn finish(self, end: BranchEnd) -> Branch<M::State> {
        let mut special = self.special;
        special.sort_by(|a, b| a.arclength.total_cmp(&b.arclength));
        Branch {
            points: self.points,
            special,
            end,
            parameter: self.options.name.clone(),
            coordinates: M::COORDINATES,
            rejected: self.rejected,
            derivative_error: self.derivative_error,
        }
    }

    /// The branch, if forces on it do not change with time. Its last point and its special points are checked
    /// like the start. If this finds a change, all points are checked.
    fn finish_if_time_independent(
        self,
        end: BranchEnd,
    ) -> Result<Branch<M::State>, ContinuationError<M::State>> {
        match self.first_change_in_time() {
            None => Ok(self.finish(end)),
            Some((known, reason)) => Err(self.ended_by_time(known, reason)),
        }
    }

    /// The number of points before forces change with time, and the reason.
    fn first_change_in_time(&self) -> Option<(usize, EquilibriumError)> {
        let time_error_at = |state: M::State, parameter: f64| {
            let found = self.problem.check_times(&ContinuationPoint { state, p: [parameter, 0.0] });
            found.err().filter(EquilibriumError::is_of_time)
        };
        let last = self.points.last().and_then(|point| time_error_at(point.state, point.parameter));
        let special = || {
            self.special
                .iter()
                .find_map(|one| Some((one.arclength, time_error_at(one.state, one.parameter)?)))
        };
        let (arclength, reason) = last.map(|reason| (f64::INFINITY, reason)).or_else(special)?;
        let first = self
            .points
            .iter()
            .enumerate()
            .find_map(|(k, one)| Some((k, time_error_at(one.state, one.parameter)?)));
        let before = self.points.iter().filter(|point| point.arclength <= arclength).count();
        Some(first.filter(|(k, _)| *k <= before).unwrap_or((before, reason)))
    }

    /// Ends after this number of points, because forces change with time beyond.
    pub(super) fn ended_by_time(
        mut self,
        known: usize,
        reason: EquilibriumError,
    ) -> ContinuationError<M::State> {
        self.points.truncate(known);
        let Some(last) = self.points.last() else { return ContinuationError::Start(reason) };
        let (parameter, arclength) = (last.parameter, last.arclength);
        self.special.retain(|one| one.arclength <= arclength);
        ContinuationError::Model { parameter, reason, branch: Box::new(self.finish(BranchEnd::Points)) }
    }

    /// The error of a branch on which no step can be taken, with what was computed.
    fn stopped(self, here: &Sample<M>, step: f64, failure: CorrectorError) -> ContinuationError<M::State> {
        let parameter = here.point().p[0];
        let failure = match (failure, self.first_change_in_time()) {
            (CorrectorError::Model(reason), None) if reason.is_of_time() => {
                let known = self.points.len();
                return self.ended_by_time(known, reason);
            }
            (_, Some((known, reason))) => return self.ended_by_time(known, reason),
            (failure, None) => failure,
        };
        if self.options.load_control
            && let Some((limit, at)) = self.limit_load_ahead(here)
        {
            let (name, branch) = (self.options.name.clone(), self.finish(BranchEnd::Points));
            return ContinuationError::LimitLoad {
                parameter: name,
                limit,
                at: Box::new(at),
                branch: Box::new(branch),
            };
        }
        let beyond = self.problem.moved(here.point(), &here.tangent.scaled(MODEL_PROBE_DISTANCE));
        let failure =
            self.problem.balance(&beyond, here.coordinates()).err().map_or(failure, CorrectorError::Model);
        let branch = Box::new(self.finish(BranchEnd::Points));
        match failure {
            CorrectorError::Model(reason) => ContinuationError::Model { parameter, reason, branch },
            CorrectorError::NotConverged => ContinuationError::Stuck { parameter, step, branch },
        }
    }

    /// The parameter and the state in the fold just ahead.
    fn limit_load_ahead(&self, here: &Sample<M>) -> Option<(f64, M::State)> {
        let singular = SingularityCondition::near(&here.balance, false, None)?;
        let found = self
            .problem
            .solve(here.point(), here.coordinates(), None, Some(&singular), MAX_DISTANCE_TO_LIMIT)
            .ok()?;
        let place = found.balance.place;
        Some((place.p[0], place.state))
    }
}

/// The coordinates of a direction, with the largest element 1.
pub(super) fn shape<V: Vector>(of: &Direction) -> V {
    let mut out = V::zeros();
    let most = of.q.amax();
    let first = of.q.iter().find(|x| x.abs() >= 0.999_999 * most).copied().unwrap_or(1.0);
    if most > 0.0 {
        out.as_mut_slice().iter_mut().zip(of.q.iter()).for_each(|(x, q)| *x = q / first + 0.0);
    }
    out
}

/// Refuses a start that is not in balance: one that is farther from the equilibrium `found` than 10⁻⁶ of
/// its scales and ten times its uncertainty.
pub(super) fn check_near<S: ModelState>(
    start: &S,
    found: &S,
    scales: &[f64],
    uncertainty: &[f64],
    names: &'static [dynamics_runtime::model::Quantity],
) -> Result<(), ContinuationError<S>> {
    let distance = |i: usize| (start.q().as_slice()[i] - found.q().as_slice()[i]).abs();
    let worst =
        (0..scales.len()).max_by(|i, j| (distance(*i) / scales[*i]).total_cmp(&(distance(*j) / scales[*j])));
    match worst {
        Some(i) if distance(i) > MAX_START_ERROR * scales[i] + 10.0 * uncertainty[i] => {
            Err(ContinuationError::NotInBalance {
                coordinate: names[i].name,
                off: distance(i),
                nearest: *found,
            })
        }
        _ => Ok(()),
    }
}

//! Curves of special points in the plane of two parameters p and r.
//!
//! On such a curve F(z, p, r) = 0 and g(z, p, r) = 0, where g is the test function of the special point
//! (`newton.rs`, `hopf_test_function.rs`). The curve is followed like a branch, by tangents and planes normal
//! to them (`trace.rs`).

use alloc::vec::Vec;
use core::ops::RangeInclusive;

use dynamics_runtime::model::{Constraints, ModelState, Powers, Vector};

use super::ContinuationError;
use super::branch::BranchEnd;
use super::newton::{CorrectedPoint, CorrectorError, SingularityCondition};
use super::problem::{Balance, ContinuationPoint, ContinuationProblem, Direction, is_range};
use super::step_control::{MAX_TURN, length_ratio};
use crate::equilibria::{EquilibriumError, has_nonholonomic_rows, scales};

/// The longest step unless given, as along branches.
const DEFAULT_LONGEST_STEP: f64 = 0.05;
/// Largest number of points unless given. Points of curves cost more than those of branches, because slopes
/// of the test function are differences.
const DEFAULT_POINTS: usize = 1000;
/// The first step, as a share of the longest.
const FIRST_STEP_SHARE: f64 = 0.2;
/// Largest distance of the given special point from the first point of the curve. A point of a family that
/// differs from that of the branch is refused.
const MAX_START_CORRECTION: f64 = 1e-2;
/// Shortest step along a curve. If a shorter one would be needed, the curve cannot be followed any further.
const MIN_STEP: f64 = 1e-9;
/// How far beyond the last point the model is evaluated, to report why the curve ends there.
const MODEL_PROBE_DISTANCE: f64 = 1e-3;

/// The start, the ranges and the steps of a curve.
pub(super) struct CurveOptions<S> {
    pub(super) place: ContinuationPoint<S>,
    pub(super) ranges: [[f64; 2]; 2],
    pub(super) longest: f64,
    pub(super) points: usize,
    pub(super) backward: bool,
}

/// A curve of special points of a kind `K` in the plane of two parameters with its options, before it is
/// followed.
#[must_use = "a curve does nothing until `.run()`"]
pub struct PlaneCurve<M: Constraints, F, K> {
    pub(super) make: F,
    pub(super) plan: CurveOptions<M::State>,
    pub(super) kind: K,
}

impl<M: Constraints + Powers, F: Fn(f64, f64) -> M, K> PlaneCurve<M, F, K> {
    /// The ranges of both parameters: the curve ends where it leaves one of them.
    pub fn until(mut self, first: RangeInclusive<f64>, second: RangeInclusive<f64>) -> Self {
        self.plan.ranges = [&first, &second].map(|range| [*range.start(), *range.end()]);
        self
    }

    /// Begins toward smaller values of the second parameter.
    pub fn backward(mut self) -> Self {
        self.plan.backward = true;
        self
    }

    /// The longest step, 0.05 unless given; both parameters by their ranges.
    pub fn longest_step(mut self, length: f64) -> Self {
        self.plan.longest = length;
        self
    }

    /// Most points, two or more: 1,000 unless given.
    pub fn points(mut self, count: usize) -> Self {
        self.plan.points = count;
        self
    }
}

/// A curve, as far as it was followed.
pub(super) struct TracedCurve<S> {
    pub(super) points: Vec<([f64; 2], S)>,
    /// Points before which both parameters turned round: cusps.
    pub(super) turns: Vec<usize>,
    pub(super) end: BranchEnd,
}

/// The further equation g = 0 near a point; `None` if there is none.
type Condition<'c, M> = dyn Fn(&Balance<M>) -> Option<SingularityCondition> + 'c;

/// A curve, and the error if it could not be followed to its end: what is wrong with the model beyond, if
/// that is the reason.
pub(super) type Followed<S> = (TracedCurve<S>, Result<(), Option<EquilibriumError>>);

impl<S: ModelState> CurveOptions<S> {
    pub(super) fn at(place: ContinuationPoint<S>) -> Self {
        Self {
            place,
            ranges: [[f64::NAN; 2]; 2],
            longest: DEFAULT_LONGEST_STEP,
            points: DEFAULT_POINTS,
            backward: false,
        }
    }

    /// Follows the curve. `not_found` is the error if the start is no such point.
    pub(super) fn run<M: Constraints<State = S> + Powers>(
        &self,
        make: &dyn Fn([f64; 2]) -> M,
        condition: &Condition<'_, M>,
        not_found: ContinuationError<S>,
    ) -> Result<Followed<S>, ContinuationError<S>> {
        for (k, range) in self.ranges.into_iter().enumerate() {
            let start = self.place.p[k];
            if !is_range(range, start) {
                return Err(ContinuationError::Range { range, start });
            }
        }
        if self.points < 2 {
            return Err(ContinuationError::Points { count: self.points });
        }
        if !(self.longest.is_finite() && self.longest > 0.0) {
            return Err(ContinuationError::Option { name: "longest_step", value: self.longest });
        }
        if has_nonholonomic_rows::<M>(&self.place.state) {
            return Err(ContinuationError::Nonholonomic);
        }
        // The problem, with the scales of its unknowns.
        let widths = self.ranges.map(|[lo, hi]| hi - lo);
        let scales = scales(M::COORDINATES, self.place.state.q().as_slice());
        let mut problem = ContinuationProblem { make, count: 2, scales, widths, fixed: Vec::new() };
        problem.fixed = problem.ignorable(&problem.balance(&self.place, &[])?);
        let balance = problem.balance(&self.place, &[])?;
        problem.set_length_scales(&balance, &[]);
        let Some(singular) = condition(&balance) else { return Err(not_found) };
        let mut along = super::zero_direction(M::Vector::LEN);
        along.p[1] = if self.backward { -widths[1] } else { widths[1] };
        // The first point, at the given value of the second parameter.
        let start = problem.solve(
            &self.place,
            &[],
            Some((&along, &self.place)),
            Some(&singular),
            MAX_START_CORRECTION,
        );
        let Ok(start) = start else { return Err(not_found) };
        let Some(tangent) = problem.tangent(&start.balance, &along, Some(&singular)) else {
            return Err(not_found);
        };
        start.balance.check_time(true)?;
        Ok(cut_where_time_matters(&problem, self.follow(&problem, start, tangent, condition)))
    }

    /// Follows the curve from its first point to the end of a range, or as far as possible.
    fn follow<M: Constraints<State = S> + Powers>(
        &self,
        problem: &ContinuationProblem<'_, M>,
        start: CorrectedPoint<M>,
        mut tangent: Direction,
        condition: &Condition<'_, M>,
    ) -> Followed<S> {
        let mut here = start.balance;
        let mut curve = TracedCurve { points: Vec::new(), turns: Vec::new(), end: BranchEnd::Points };
        curve.points.push((here.place.p, here.place.state));
        let (mut h, mut failure) = (FIRST_STEP_SHARE * self.longest, None);
        while curve.points.len() < self.points {
            let (next, along) = match step(problem, &here, &tangent, h, condition) {
                Ok(taken) => taken,
                Err(why) => {
                    failure = if let CorrectorError::Model(reason) = why { Some(reason) } else { failure };
                    h *= 0.5;
                    if h < MIN_STEP {
                        // Near the end of a model slopes do not exist. The model beyond it says why.
                        let beyond = problem.moved(&here.place, &tangent.scaled(MODEL_PROBE_DISTANCE));
                        return (curve, Err(failure.or_else(|| problem.balance(&beyond, &[]).err())));
                    }
                    continue;
                }
            };
            let left = (0..2)
                .find(|k| !(self.ranges[*k][0]..=self.ranges[*k][1]).contains(&next.balance.place.p[*k]));
            if let Some(k) = left {
                // The curve left a range: the last point lies on its edge.
                let bound = if along.p[k] > 0.0 { self.ranges[k][1] } else { self.ranges[k][0] };
                let part = (bound - here.place.p[k]) / (next.balance.place.p[k] - here.place.p[k]);
                let step = problem.between(&here.place, &next.balance.place);
                let mut guess = problem.moved(&here.place, &step.scaled(part));
                guess.p[k] = bound;
                let mut normal = super::zero_direction(here.lift.nrows());
                normal.p[k] = 1.0;
                let last = problem.solve(&guess, &[], Some((&normal, &guess)), condition(&here).as_ref(), h);
                if let Ok(last) = last {
                    let mut place = last.balance.place;
                    place.p[k] = bound;
                    curve.points.push((place.p, place.state));
                }
                curve.end = BranchEnd::Range;
                return (curve, Ok(()));
            }
            let of_parameters =
                |k: usize| tangent.p[k] * along.p[k] / (problem.widths[k] * problem.widths[k]);
            // At a cusp the curve turns round in the plane of both parameters.
            if of_parameters(0) + of_parameters(1) < 0.0 {
                curve.turns.push(curve.points.len());
            }
            h = (h * length_ratio(problem.angle(&tangent, &along))).min(self.longest);
            (here, tangent, failure) = (next.balance, along, None);
            curve.points.push((here.place.p, here.place.state));
        }
        (curve, Ok(()))
    }
}

/// The curve up to where forces change with time. The last point is checked like the first one. If this finds
/// a change, all points are checked.
fn cut_where_time_matters<M: Constraints>(
    problem: &ContinuationProblem<'_, M>,
    (mut curve, end): Followed<M::State>,
) -> Followed<M::State> {
    let time_error_at = |(p, state): &([f64; 2], M::State)| {
        let found = problem.check_times(&ContinuationPoint { state: *state, p: *p });
        found.err().filter(EquilibriumError::is_of_time)
    };
    let Some(of_last) = curve.points.last().and_then(time_error_at) else { return (curve, end) };
    let first = curve.points.iter().enumerate().find_map(|(k, point)| Some((k, time_error_at(point)?)));
    let (known, reason) = first.unwrap_or((curve.points.len() - 1, of_last));
    curve.points.truncate(known);
    curve.turns.retain(|turn| *turn < known);
    (curve, Err(Some(reason)))
}

/// One step of length h: the next point and the tangent there.
fn step<M: Constraints>(
    problem: &ContinuationProblem<'_, M>,
    here: &Balance<M>,
    tangent: &Direction,
    h: f64,
    condition: &Condition<'_, M>,
) -> Result<(CorrectedPoint<M>, Direction), CorrectorError> {
    let guess = problem.moved(&here.place, &tangent.scaled(h));
    let coordinates = &here.statics.tangent.coordinates;
    let singular = condition(here).ok_or(CorrectorError::NotConverged)?;
    let next = problem.solve(&guess, coordinates, Some((tangent, &guess)), Some(&singular), 0.5 * h)?;
    next.balance.check_time(false).map_err(CorrectorError::Model)?;
    let along =
        problem.tangent(&next.balance, tangent, Some(&singular)).ok_or(CorrectorError::NotConverged)?;
    if problem.angle(tangent, &along) > MAX_TURN {
        return Err(CorrectorError::NotConverged);
    }
    Ok((next, along))
}

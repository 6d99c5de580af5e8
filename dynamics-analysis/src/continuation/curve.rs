//! Curves of special points in the plane of two parameters.
//!
//! On such a curve F(z, p, r) = 0 and one more equation holds, g(z, p, r) = 0 (`newton.rs`). The curve is
//! followed like a branch, by tangents and planes normal to them.

use alloc::vec::Vec;
use core::ops::RangeInclusive;

use dynamics_runtime::model::{Constraints, ModelState, Powers, Vector};

use super::ContinuationError;
use super::branch::BranchEnd;
use super::newton::{Arrived, Missed, Singular};
use super::problem::{Balance, ContinuationPoint, ContinuationProblem, Direction, is_range};
use crate::equilibria::{EquilibriumError, scales};

/// Steps shorter than this come to no end.
const SHORTEST: f64 = 1e-9;
/// How far beyond the last point a model is looked at.
const BEYOND: f64 = 1e-3;
/// Angle between tangents that steps aim at, and the largest that is taken, in rad.
const AIM: f64 = 0.12;
const TURN: f64 = 0.35;

/// From where to where a curve is followed, and how.
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
    /// Points before which both parameters turned round.
    pub(super) turns: Vec<usize>,
    pub(super) end: BranchEnd,
}

/// The further equation beside a place.
type Condition<'c, M> = dyn Fn(&Balance<M>) -> Option<Singular> + 'c;

/// A curve, and where it could not be followed to its end, what is wrong with the model beyond, if that is
/// why.
pub(super) type Followed<S> = (TracedCurve<S>, Option<Option<EquilibriumError>>);

impl<S: ModelState> CurveOptions<S> {
    pub(super) fn at(place: ContinuationPoint<S>) -> Self {
        Self { place, ranges: [[f64::NAN; 2]; 2], longest: 0.05, points: 1000, backward: false }
    }

    /// Follows it; `none` where there is no such point at the start.
    pub(super) fn run<M: Constraints<State = S> + Powers>(
        &self,
        make: &dyn Fn([f64; 2]) -> M,
        condition: &Condition<'_, M>,
        none: ContinuationError<S>,
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
        if super::rolls::<M>(&self.place.state) {
            return Err(ContinuationError::Nonholonomic);
        }
        let widths = self.ranges.map(|[lo, hi]| hi - lo);
        let scales = scales(M::COORDINATES, self.place.state.q().as_slice());
        let mut problem = ContinuationProblem { make, count: 2, scales, widths, held: Vec::new() };
        problem.held = problem.ignorable(&problem.balance(&self.place, &[])?);
        let balance = problem.balance(&self.place, &[])?;
        problem.measure_lengths(&balance, &[]);
        let Some(singular) = condition(&balance) else { return Err(none) };
        let mut along = super::none(M::Vector::LEN);
        along.p[1] = if self.backward { -widths[1] } else { widths[1] };
        // The point at the second parameter as it was given.
        let start = problem.solve(&self.place, &[], Some((&along, &self.place)), Some(&singular), 1e-2);
        let Ok(start) = start else { return Err(none) };
        let Some(tangent) = problem.tangent(&start.balance, &along, Some(&singular)) else {
            return Err(none);
        };
        start.balance.check_time(true)?;
        Ok(timeless(&problem, self.follow(&problem, start, tangent, condition)))
    }

    fn follow<M: Constraints<State = S> + Powers>(
        &self,
        problem: &ContinuationProblem<'_, M>,
        start: Arrived<M>,
        mut tangent: Direction,
        condition: &Condition<'_, M>,
    ) -> Followed<S> {
        let mut here = start.balance;
        let mut curve = TracedCurve { points: Vec::new(), turns: Vec::new(), end: BranchEnd::Points };
        curve.points.push((here.place.p, here.place.state));
        let (mut h, mut missed) = (0.2 * self.longest, None);
        while curve.points.len() < self.points {
            let (next, along) = match step(problem, &here, &tangent, h, condition) {
                Ok(taken) => taken,
                Err(why) => {
                    missed = if let Missed::Model(reason) = why { Some(reason) } else { missed };
                    h *= 0.5;
                    if h < SHORTEST {
                        // Slopes do not exist near the end of a model. The reason is found a little further
                        // on.
                        let beyond = problem.moved(&here.place, &tangent.scaled(BEYOND));
                        return (curve, Some(missed.or_else(|| problem.balance(&beyond, &[]).err())));
                    }
                    continue;
                }
            };
            let left = (0..2)
                .find(|k| !(self.ranges[*k][0]..=self.ranges[*k][1]).contains(&next.balance.place.p[*k]));
            if let Some(k) = left {
                // The last point lies on the edge of the range.
                let bound = if along.p[k] > 0.0 { self.ranges[k][1] } else { self.ranges[k][0] };
                let part = (bound - here.place.p[k]) / (next.balance.place.p[k] - here.place.p[k]);
                let step = problem.between(&here.place, &next.balance.place);
                let mut guess = problem.moved(&here.place, &step.scaled(part));
                guess.p[k] = bound;
                let mut normal = super::none(here.lift.nrows());
                normal.p[k] = 1.0;
                let last = problem.solve(&guess, &[], Some((&normal, &guess)), condition(&here).as_ref(), h);
                if let Ok(last) = last {
                    let mut place = last.balance.place;
                    place.p[k] = bound;
                    curve.points.push((place.p, place.state));
                }
                curve.end = BranchEnd::Range;
                return (curve, None);
            }
            let turn = problem.dot(&tangent, &along).clamp(-1.0, 1.0).acos();
            let of_parameters =
                |k: usize| tangent.p[k] * along.p[k] / (problem.widths[k] * problem.widths[k]);
            if of_parameters(0) + of_parameters(1) < 0.0 {
                curve.turns.push(curve.points.len());
            }
            (here, tangent, missed) = (next.balance, along, None);
            curve.points.push((here.place.p, here.place.state));
            h = (h * if turn > 0.0 { (AIM / turn).clamp(0.5, 2.0) } else { 2.0 }).min(self.longest);
        }
        (curve, None)
    }
}

/// The curve up to where forces change with time: its last point is looked at as the first one was, and where
/// that shows anything, all are.
fn timeless<M: Constraints>(
    problem: &ContinuationProblem<'_, M>,
    (mut curve, lost): Followed<M::State>,
) -> Followed<M::State> {
    let at = |(p, state): &([f64; 2], M::State)| {
        let found = problem.check_times(&ContinuationPoint { state: *state, p: *p });
        found.err().filter(EquilibriumError::is_of_time)
    };
    let Some(of_last) = curve.points.last().and_then(at) else { return (curve, lost) };
    let first = curve.points.iter().enumerate().find_map(|(k, point)| Some((k, at(point)?)));
    let (known, reason) = first.unwrap_or((curve.points.len() - 1, of_last));
    curve.points.truncate(known);
    curve.turns.retain(|turn| *turn < known);
    (curve, Some(Some(reason)))
}

fn step<M: Constraints>(
    problem: &ContinuationProblem<'_, M>,
    here: &Balance<M>,
    tangent: &Direction,
    h: f64,
    condition: &Condition<'_, M>,
) -> Result<(Arrived<M>, Direction), Missed> {
    let guess = problem.moved(&here.place, &tangent.scaled(h));
    let coordinates = &here.statics.tangent.coordinates;
    let singular = condition(here).ok_or(Missed::Far)?;
    let next = problem.solve(&guess, coordinates, Some((tangent, &guess)), Some(&singular), 0.5 * h)?;
    next.balance.check_time(false).map_err(Missed::Model)?;
    let along = problem.tangent(&next.balance, tangent, Some(&singular)).ok_or(Missed::Far)?;
    if problem.dot(tangent, &along).clamp(-1.0, 1.0).acos() > TURN {
        return Err(Missed::Far);
    }
    Ok((next, along))
}

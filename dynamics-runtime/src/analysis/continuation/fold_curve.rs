//! Folds as a second parameter changes: the limit load over an imperfection, the edge of a region in which there are more equilibria.
//!
//! The curve fulfils F(z, p, r) = 0 and g(z, p, r) = 0 (`newton.rs`) and is followed as a branch is. At a cusp, where two curves of folds meet and vanish, it
//! turns round in both parameters, and is as regular as elsewhere. R. Seydel, *Practical Bifurcation and Stability Analysis*, §5.6.

use alloc::boxed::Box;
use alloc::vec::Vec;
use core::ops::RangeInclusive;

use super::ContinuationError;
use super::branch::{BranchEnd, Special};
use super::newton::{Arrived, Missed, Singular};
use super::problem::{Direction, Place, Problem, is_range};
use crate::analysis::equilibria::scales;
use crate::model::{Constraints, ModelState, Powers, Quantity, Vector};

/// A curve of folds in the plane of two parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct FoldCurve<S: ModelState> {
    /// Both parameters and the equilibrium in the fold, along the curve.
    pub points: Vec<([f64; 2], S)>,
    /// Cusps, in which two curves of folds meet and vanish: each lies between the point of this number and the one before it, where both parameters
    /// stand still.
    pub cusps: Vec<usize>,
    /// Why it ends.
    pub end: BranchEnd,
    /// The coordinates.
    pub coordinates: &'static [Quantity],
}

/// A curve of folds with its options, before it is followed.
#[must_use = "a curve of folds does nothing until `.run()`"]
pub struct FoldCurves<M: Constraints, F> {
    make: F,
    place: Place<M::State>,
    ranges: [[f64; 2]; 2],
    longest: f64,
    points: usize,
    backward: bool,
}

/// Opens a curve of folds of a family with two parameters, from a fold of its first parameter at the value `second` of the other.
///
/// ```text
/// let fold = branch.folds().next().unwrap();
/// fold_curve(|load, offset| Column { load, offset, ..column.clone() }, fold, 0.01).until(0.0..=20.0, 0.0..=0.1).run()?
/// ```
pub fn fold_curve<M: Constraints + Powers, F: Fn(f64, f64) -> M>(
    make: F,
    fold: &Special<M::State>,
    second: f64,
) -> FoldCurves<M, F> {
    let place = Place { state: fold.state, p: [fold.parameter, second] };
    FoldCurves { make, place, ranges: [[f64::NAN; 2]; 2], longest: 0.05, points: 1000, backward: false }
}

impl<M: Constraints + Powers, F: Fn(f64, f64) -> M> FoldCurves<M, F> {
    /// The ranges of both parameters: the curve ends where it leaves one of them.
    pub fn until(mut self, first: RangeInclusive<f64>, second: RangeInclusive<f64>) -> Self {
        self.ranges = [&first, &second].map(|range| [*range.start(), *range.end()]);
        self
    }

    /// First toward smaller values of the second parameter.
    pub fn backward(mut self) -> Self {
        self.backward = true;
        self
    }

    /// The longest step, 0.05 unless given; both parameters by their ranges.
    pub fn longest_step(mut self, length: f64) -> Self {
        self.longest = length;
        self
    }

    /// Most points, two or more: 1,000 unless given.
    pub fn points(mut self, count: usize) -> Self {
        self.points = count;
        self
    }

    /// Follows the curve.
    ///
    /// # Errors
    /// Ranges that are empty or without the start; no fold at the start; a model that stops being one.
    pub fn run(&self) -> Result<FoldCurve<M::State>, ContinuationError<M::State>> {
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
        let make = |p: [f64; 2]| (self.make)(p[0], p[1]);
        let widths = self.ranges.map(|[lo, hi]| hi - lo);
        let scales = scales(M::COORDINATES, self.place.state.q().as_slice());
        let mut problem = Problem { make: &make, count: 2, scales, widths, held: Vec::new() };
        problem.held = problem.ignorable(&problem.balance(&self.place, &[])?);
        let balance = problem.balance(&self.place, &[])?;
        let singular = Singular::beside(&balance, false, None).ok_or(ContinuationError::NoFold)?;
        let along = |k: usize| {
            let mut way = super::none(balance.lift.nrows());
            way.p[k] = if self.backward { -widths[k] } else { widths[k] };
            way
        };
        // The fold at the second parameter as it was given.
        let start = problem
            .solve(&self.place, &[], Some((&along(1), &self.place)), Some(&singular), 1e-2)
            .map_err(|_| ContinuationError::NoFold)?;
        let tangent = problem.tangent(&start.balance, &along(1), Some(&singular)).ok_or(ContinuationError::NoFold)?;
        self.follow(&problem, start, tangent)
    }

    fn follow(
        &self,
        problem: &Problem<'_, M>,
        start: Arrived<M>,
        mut tangent: Direction,
    ) -> Result<FoldCurve<M::State>, ContinuationError<M::State>> {
        let mut here = start.balance;
        let mut curve =
            FoldCurve { points: Vec::new(), cusps: Vec::new(), end: BranchEnd::Points, coordinates: M::COORDINATES };
        curve.points.push((here.place.p, here.place.state));
        let (mut h, mut missed) = (0.2 * self.longest, Missed::Far);
        while curve.points.len() < self.points {
            let taken = self.step(problem, &here, &tangent, h);
            let (next, along) = match taken {
                Ok(taken) => taken,
                Err(why) => {
                    missed = if let Missed::Model(_) = why { why } else { missed };
                    h *= 0.5;
                    if h < 1e-9 {
                        return Err(self.ended(missed, &curve));
                    }
                    continue;
                }
            };
            let left = (0..2).find(|k| !(self.ranges[*k][0]..=self.ranges[*k][1]).contains(&next.balance.place.p[*k]));
            if let Some(k) = left {
                // The last point lies on the edge of the range.
                let bound = if along.p[k] > 0.0 { self.ranges[k][1] } else { self.ranges[k][0] };
                let part = (bound - here.place.p[k]) / (next.balance.place.p[k] - here.place.p[k]);
                let step = problem.between(&here.place, &next.balance.place);
                let mut guess = problem.moved(&here.place, &step.scaled(part));
                guess.p[k] = bound;
                let mut normal = super::none(here.lift.nrows());
                normal.p[k] = 1.0;
                let singular = Singular::beside(&here, false, None);
                let last = problem.solve(&guess, &[], Some((&normal, &guess)), singular.as_ref(), h);
                if let Ok(last) = last {
                    let mut place = last.balance.place;
                    place.p[k] = bound;
                    curve.points.push((place.p, place.state));
                }
                curve.end = BranchEnd::Range;
                return Ok(curve);
            }
            let turn = problem.dot(&tangent, &along).clamp(-1.0, 1.0).acos();
            let of_parameters = |k: usize| tangent.p[k] * along.p[k] / (problem.widths[k] * problem.widths[k]);
            if of_parameters(0) + of_parameters(1) < 0.0 {
                curve.cusps.push(curve.points.len());
            }
            (here, tangent, missed) = (next.balance, along, Missed::Far);
            curve.points.push((here.place.p, here.place.state));
            h = (h * if turn > 0.0 { (0.12 / turn).clamp(0.5, 2.0) } else { 2.0 }).min(self.longest);
        }
        Ok(curve)
    }

    fn step(
        &self,
        problem: &Problem<'_, M>,
        here: &super::problem::Balance<M>,
        tangent: &Direction,
        h: f64,
    ) -> Result<(Arrived<M>, Direction), Missed> {
        let guess = problem.moved(&here.place, &tangent.scaled(h));
        let coordinates = &here.statics.tangent.coordinates;
        let singular = Singular::beside(here, false, None).ok_or(Missed::Far)?;
        let next = problem.solve(&guess, coordinates, Some((tangent, &guess)), Some(&singular), 0.5 * h)?;
        let along = problem.tangent(&next.balance, tangent, Some(&singular)).ok_or(Missed::Far)?;
        if problem.dot(tangent, &along).clamp(-1.0, 1.0).acos() > 0.35 {
            return Err(Missed::Far);
        }
        Ok((next, along))
    }

    /// Why it cannot be followed, with what was computed.
    fn ended(&self, missed: Missed, curve: &FoldCurve<M::State>) -> ContinuationError<M::State> {
        let at = curve.points.last().map_or([f64::NAN; 2], |(p, _)| *p);
        ContinuationError::FoldCurve {
            at,
            reason: if let Missed::Model(reason) = missed { Some(reason) } else { None },
            curve: Box::new(curve.clone()),
        }
    }
}

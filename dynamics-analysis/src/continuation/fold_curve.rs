//! Folds as a second parameter changes: the limit load over an imperfection, the edge of a region in which
//! there are more equilibria.
//!
//! The curve fulfils F(z, p, r) = 0 and g(z, p, r) = 0 (`newton.rs`) and is followed like a branch. At a cusp
//! two curves of folds meet and vanish. There the curve turns round in both parameters, but it is still
//! regular. R. Seydel, *Practical Bifurcation and Stability Analysis*, §5.6.

use alloc::boxed::Box;

use dynamics_runtime::model::{Constraints, Powers};

use super::ContinuationError;
use super::branch::SpecialPoint;
use super::curve::{CurveOptions, PlaneCurve, TracedCurve};
use super::followed_curves::FoldCurve;
use super::newton::SingularityCondition;
use super::problem::ContinuationPoint;

/// The kind of curve that [`fold_curve`] opens.
#[derive(Clone, Copy, Debug)]
pub struct OfFolds;

/// A curve of folds with its options, before it is followed.
pub type FoldCurves<M, F> = PlaneCurve<M, F, OfFolds>;

/// Opens a curve of folds of a family with two parameters, from a fold of its first parameter at the value
/// `second` of the other.
///
/// ```text
/// let fold = branch.folds().next().unwrap();
/// let column = |load, offset| Column { load, offset, ..column.clone() };
/// fold_curve(column, fold, 0.01).until(0.0..=20.0, 0.0..=0.1).run()?
/// ```
pub fn fold_curve<M: Constraints + Powers, F: Fn(f64, f64) -> M>(
    make: F,
    fold: &SpecialPoint<M::State>,
    second: f64,
) -> FoldCurves<M, F> {
    let place = ContinuationPoint { state: fold.state, p: [fold.parameter, second] };
    PlaneCurve { make, plan: CurveOptions::at(place), kind: OfFolds }
}

impl<M: Constraints + Powers, F: Fn(f64, f64) -> M> FoldCurves<M, F> {
    /// Follows the curve.
    ///
    /// # Errors
    /// Ranges that are empty or without the start; no fold at the start; a model that becomes impossible on
    /// the way.
    pub fn run(self) -> Result<FoldCurve<M::State>, ContinuationError<M::State>> {
        let make = |p: [f64; 2]| (self.make)(p[0], p[1]);
        let fold = |balance: &_| SingularityCondition::near(balance, false, None);
        let found = self.plan.run::<M>(&make, &fold, ContinuationError::NoFold)?;
        let result = |curve: TracedCurve<M::State>| FoldCurve {
            points: curve.points,
            cusps: curve.turns,
            end: curve.end,
            coordinates: M::COORDINATES,
        };
        match found {
            (curve, Ok(())) => Ok(result(curve)),
            (curve, Err(reason)) => Err(ContinuationError::FoldCurve {
                at: curve.points.last().map_or([f64::NAN; 2], |(p, _)| *p),
                reason,
                curve: Box::new(result(curve)),
            }),
        }
    }
}

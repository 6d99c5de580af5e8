//! The onset of flutter as a second parameter changes: the edge of a region in which oscillations grow.
//!
//! On it the forces balance, and the test function of `hopf_test_function.rs` is zero. A curve of Hopf points
//! ends where its frequency becomes zero, on a curve of folds or branch points (F. Takens, 1974;
//! R. I. Bogdanov, 1975).

use alloc::boxed::Box;
use alloc::vec::Vec;
use core::cell::Cell;

use dynamics_runtime::model::{Constraints, Powers};

use super::ContinuationError;
use super::branch::{BranchEnd, SpecialKind, SpecialPoint};
use super::curve::{CurveOptions, PlaneCurve, TracedCurve};
use super::followed_curves::HopfCurve;
use super::hopf_test_function::HopfTest;
use super::newton::SingularityCondition;
use super::problem::{Balance, ContinuationPoint};

/// A curve that cannot be followed any further ends where the frequency is zero if the last frequency is
/// below this share of the largest, and falling. Near that end the frequency is a square root of the
/// distance, so that a tenth of it is reached at about a hundredth of the curve.
const MAX_RATIO_AT_ZERO_FREQUENCY: f64 = 0.1;

/// The kind of curve that [`hopf_curve`] opens.
#[derive(Clone, Copy, Debug)]
pub struct OfHopfPoints(SpecialKind);

/// A curve of Hopf points with its options, before it is followed.
pub type HopfCurves<M, F> = PlaneCurve<M, F, OfHopfPoints>;

/// Opens a curve of Hopf points of a family with two parameters, from one of its first parameter at the value
/// `second` of the other; of an undamped system, of points in which two frequencies meet.
///
/// ```text
/// let hopf = branch.special.iter().find(|one| matches!(one.kind, SpecialKind::Hopf { .. })).unwrap();
/// let column = |load, damping| Column { load, damping, ..column.clone() };
/// hopf_curve(column, hopf, 0.1).until(0.0..=6.0, 0.0..=2.0).run()?
/// ```
pub fn hopf_curve<M: Constraints + Powers, F: Fn(f64, f64) -> M>(
    make: F,
    hopf: &SpecialPoint<M::State>,
    second: f64,
) -> HopfCurves<M, F> {
    let place = ContinuationPoint { state: hopf.state, p: [hopf.parameter, second] };
    PlaneCurve { make, plan: CurveOptions::at(place), kind: OfHopfPoints(hopf.kind) }
}

impl<M: Constraints + Powers, F: Fn(f64, f64) -> M> HopfCurves<M, F> {
    /// Follows the curve.
    ///
    /// # Errors
    /// Ranges that are empty or without the start; no Hopf point at the start; a curve that cannot be
    /// followed any further before its frequency is zero.
    pub fn run(self) -> Result<HopfCurve<M::State>, ContinuationError<M::State>> {
        let (frequency, undamped) = match self.kind.0 {
            SpecialKind::Hopf { frequency } => (frequency, false),
            SpecialKind::FrequenciesMeet { frequency } => (frequency, true),
            _ => return Err(ContinuationError::NoHopf),
        };
        let make = |p: [f64; 2]| (self.make)(p[0], p[1]);
        // The frequency at the last point: that at the next one is near it.
        let last = Cell::new(frequency);
        let hopf = |balance: &Balance<M>| {
            let now = HopfTest { frequency: last.get(), undamped }
                .frequency(&balance.model, &balance.place.state)?;
            last.set(now);
            Some(SingularityCondition::imaginary_pair(balance, HopfTest { frequency: now, undamped }))
        };
        let (curve, outcome) = self.plan.run::<M>(&make, &hopf, ContinuationError::NoHopf)?;
        // The frequency at each point, near that at the point before.
        let mut frequencies = Vec::with_capacity(curve.points.len());
        let mut now = frequency;
        for (p, state) in &curve.points {
            now = HopfTest { frequency: now, undamped }.frequency(&make(*p), state).unwrap_or(f64::NAN);
            frequencies.push(now);
        }
        // A curve that ends with a small and falling frequency ends where the frequency is zero.
        let most = frequencies.iter().fold(0.0, |most: f64, x| most.max(*x));
        let limit = MAX_RATIO_AT_ZERO_FREQUENCY * most;
        let slow = matches!(&frequencies[..], [.., before, last] if last < before && *last < limit);
        let result = |curve: TracedCurve<M::State>, end| HopfCurve {
            points: curve.points,
            frequencies,
            end,
            coordinates: M::COORDINATES,
        };
        match outcome {
            Ok(()) => {
                let end = curve.end;
                Ok(result(curve, end))
            }
            Err(None) if slow => Ok(result(curve, BranchEnd::ZeroFrequency)),
            Err(reason) => Err(ContinuationError::HopfCurve {
                at: curve.points.last().map_or([f64::NAN; 2], |(p, _)| *p),
                reason,
                curve: Box::new(result(curve, BranchEnd::Points)),
            }),
        }
    }
}

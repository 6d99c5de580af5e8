//! Classification of branch points: transcritical, or a pitchfork, by how the parameter changes along each
//! arm.
//!
//! ```text
//! p − p* = A h + B h² + C h³ + …        h along the direction of a branch, to both sides
//! ```
//!
//! The parameter passes p* along a branch with A ≠ 0. It turns round along one with A = 0 and B ≠ 0, as
//! along the arms of a pitchfork (M. Golubitsky & D. G. Schaeffer, *Singularities and Groups in Bifurcation
//! Theory* I, chapter II). A single distance h does not decide: B hides a small A, and C looks like A. Half
//! the difference of both sides, A h + C h³, separates them: from h to h/4 it falls to a quarter, or to a
//! 64th.

use alloc::boxed::Box;

use dynamics_runtime::model::{Constraints, Powers};

use super::branch::SpecialKind;
use super::problem::{Balance, Direction};
use super::trace::{MAX_CORRECTION_AT_BRANCH_POINT, Sample, Tracer};

/// First distance from the branch point at which an arm is examined, in the scales of coordinates and
/// parameter.
const FIRST_PROBE_DISTANCE: f64 = 1e-2;
/// Each next distance is this share of the last.
const PROBE_DISTANCE_RATIO: f64 = 0.25;
/// Number of distances: the last one is 10⁻² / 4¹³ = 1.5·10⁻¹⁰. Two branch points 10⁻⁵ apart
/// need distances below that; nearer than the last one rounding decides.
const PROBE_COUNT: usize = 14;
/// Changes of the parameter below this share of its range and size are rounding: points are accurate to
/// some 10⁻¹⁵, and 10⁻¹² leaves room for ill-conditioned ones.
const PARAMETER_ROUNDING: f64 = 1e-12;
/// If the difference of both sides is below this share of their mean, it may come from the error of the
/// branch point itself. The parameter then turns round.
const MAX_ASYMMETRY: f64 = 1e-6;
/// A difference of both sides that falls by less than this, as the distance falls to a quarter, is linear in
/// the distance. Linear terms fall by 4, cubic ones by 64.
const MAX_LINEAR_RATIO: f64 = 8.0;

/// The course of the parameter along a branch through a branch point.
enum ParameterCourse<M: Constraints> {
    /// It passes p*, with this change per length.
    Passes(f64),
    /// It turns round. A point of the branch beside the branch point.
    Turns(Box<Sample<M>>),
    /// It is constant to rounding, or the branch could not be followed.
    Unknown,
}

impl<M: Constraints + Powers> Tracer<'_, M> {
    /// The kind of a branch point in which two branches with these directions meet.
    pub(super) fn classify(&self, balance: &Balance<M>, directions: &[Direction; 2]) -> SpecialKind {
        let [own, other] = directions;
        let (bent, slope, straight) =
            match (self.parameter_course(balance, other), self.parameter_course(balance, own)) {
                (ParameterCourse::Passes(_), ParameterCourse::Passes(_)) => {
                    return SpecialKind::Transcritical;
                }
                (ParameterCourse::Turns(bent), ParameterCourse::Passes(slope)) => (bent, slope, own),
                (ParameterCourse::Passes(slope), ParameterCourse::Turns(bent)) => (bent, slope, other),
                _ => return SpecialKind::BranchPoint,
            };
        // A pitchfork is supercritical if the arms have fewer negative stiffnesses than the straight branch
        // at the same value of the parameter. A little farther on the straight branch may have changed once
        // more.
        let h = (bent.point().p[0] - balance.place.p[0]) / slope;
        match self.point_on_arm(balance, &straight.scaled(h.signum()), h.abs()) {
            Some(straight_point) => SpecialKind::Pitchfork {
                supercritical: bent.test_functions.negative_count()
                    < straight_point.test_functions.negative_count(),
            },
            None => SpecialKind::BranchPoint,
        }
    }

    /// The course of the parameter along a branch, from the mean and half the difference of both sides at
    /// several distances.
    fn parameter_course(&self, balance: &Balance<M>, direction: &Direction) -> ParameterCourse<M> {
        let star = balance.place.p[0];
        let noise = PARAMETER_ROUNDING * (self.problem.widths[0] + star.abs());
        let sides = |h: f64| {
            let [plus, minus] =
                [1.0, -1.0].map(|sign| self.point_on_arm(balance, &direction.scaled(sign), h));
            let places = [plus?, minus?];
            let changes = [&places[0], &places[1]].map(|sample| sample.point().p[0] - star);
            Some((places, 0.5 * (changes[0] + changes[1]), 0.5 * (changes[0] - changes[1])))
        };
        // From large distances to small ones, until the difference of both sides is linear or rounding.
        let (mut turned, mut before): (Option<Sample<M>>, Option<f64>) = (None, None);
        for h in probe_distances() {
            let Some((places, mean, difference)) = sides(h) else {
                (turned, before) = (None, None);
                continue;
            };
            let is_level = difference.abs() <= noise + MAX_ASYMMETRY * mean.abs();
            if !is_level && before.is_some_and(|before| (before / difference).abs() < MAX_LINEAR_RATIO) {
                return ParameterCourse::Passes(difference / h);
            }
            if mean.abs() > noise.max(difference.abs()) && turned.is_none() {
                let [plus, _] = places;
                turned = Some(plus);
            }
            match turned {
                Some(place) if is_level => return ParameterCourse::Turns(Box::new(place)),
                // Nothing changes measurably at this distance, nor at smaller ones.
                None if is_level => break,
                _ => before = Some(difference),
            }
        }
        ParameterCourse::Unknown
    }

    /// A point of the branch that leaves a branch point in this direction, at the distance h.
    pub(super) fn point_on_arm(
        &self,
        balance: &Balance<M>,
        direction: &Direction,
        h: f64,
    ) -> Option<Sample<M>> {
        let guess = self.problem.moved(&balance.place, &direction.scaled(h));
        let coordinates = &balance.statics.tangent.coordinates;
        let corrected = self
            .problem
            .solve(&guess, coordinates, Some((direction, &guess)), None, MAX_CORRECTION_AT_BRANCH_POINT * h)
            .ok()?;
        self.sample(corrected.balance, direction).ok()
    }
}

/// Distances from a branch point at which arms are examined, from large to small.
pub(super) fn probe_distances() -> impl Iterator<Item = f64> {
    core::iter::successors(Some(FIRST_PROBE_DISTANCE), |h| Some(h * PROBE_DISTANCE_RATIO)).take(PROBE_COUNT)
}

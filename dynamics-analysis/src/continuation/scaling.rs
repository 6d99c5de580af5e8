//! Scales of coordinates.
//!
//! Steps along a branch, and the tolerance of Newton's method, need a scale for each coordinate that is not
//! an angle. Usually this is the largest value of its unit at the start. That value is no scale in a straight
//! column, in a column with a tiny imperfection, or if the origin is far away. There the scale is the
//! distance over which the stiffness of the structure changes. If the start is a fold, where some stiffness
//! is zero, it is the distance over which the load changes.

use alloc::vec::Vec;

use dynamics_runtime::model::{Constraints, ModelState, Vector};
use nalgebra::{DMatrix, DVector};

use super::null_space::null_plane;
use super::problem::{Balance, ContinuationPoint, ContinuationProblem};

/// A unit whose coordinates are all below this at the start has only zeros there, up to rounding.
const ZERO_SIZE: f64 = 1e-12;
/// The scale of such coordinates, as a share of their linear change over the range of the parameter.
const SHARE_OF_LINEAR_CHANGE: f64 = 0.1;
/// Trial displacements are these numbers times the powers of ten of [`TRIAL_DECADES`]: a length scale is
/// needed to a factor of three.
const TRIAL_MANTISSAS: [f64; 2] = [1.0, 3.0];
/// Powers of ten of the trial displacements, in the unit of the coordinate. They cover picometres to 10⁹
/// kilometres for coordinates in metres.
const TRIAL_DECADES: core::ops::RangeInclusive<i32> = -12..=12;
/// The length scale is the largest displacement that changes the stiffness by at most this share of its
/// largest value over the range of the parameter. With a larger share steps pass over bends, with a smaller
/// one they become short.
const MAX_STIFFNESS_CHANGE: f64 = 0.5;
/// In a fold, the scale is the displacement whose force is this share of what the whole range of the
/// parameter does.
const FOLD_FORCE_SHARE: f64 = 0.1;
/// The start is in a fold, or next to one, if the force of the stiffness at that displacement is less than
/// this share of the allowed force. Otherwise the displacement says where the stiffness acts, not where the
/// fold ends.
const MAX_STIFFNESS_FORCE_IN_FOLD: f64 = 0.1;
/// A start is a fold only if the parameter pushes along the softest shape, by more than this share of its
/// whole effect. In a branch point the push is zero, up to rounding and errors of differences.
const MIN_PUSH_ALONG_SOFT_SHAPE: f64 = 1e-6;
/// A size at the start is no scale if the length over which stiffness changes is more than this many times as
/// large: a tiny imperfection would make tiny steps.
const MAX_LENGTH_OVER_START: f64 = 30.0;
/// A size at the start is no scale if it is more than this many times the length over which stiffness
/// changes: the origin is far away. This bound is wider than the other one, because a scale that is too large
/// only costs rejected steps.
const MAX_START_OVER_LENGTH: f64 = 300.0;

impl<M: Constraints> ContinuationProblem<'_, M> {
    /// Sets the scales of coordinates whose unit has only zeros at the start: a tenth of their linear change
    /// over the range of the parameter. Returns those that do not change.
    pub(super) fn set_scales_of_zeros(
        &mut self,
        place: &ContinuationPoint<M::State>,
        balance: &Balance<M>,
    ) -> Vec<usize> {
        let q = place.state.q().as_slice();
        let of_unit = |i: usize, f: &dyn Fn(usize) -> f64| {
            let same = (0..q.len()).filter(|j| M::COORDINATES[*j].unit == M::COORDINATES[i].unit);
            same.map(f).fold(0.0, f64::max)
        };
        let is_zero = |i: &usize| !M::COORDINATES[*i].is_angle() && of_unit(*i, &|j| q[j].abs()) < ZERO_SIZE;
        let zeros: Vec<usize> = (0..q.len()).filter(is_zero).collect();
        let direction = null_plane(self, balance)
            .map(|[direction, _]| direction)
            .filter(|_| self.fold_extent(balance).is_none());
        let moves = |i: usize| {
            direction.as_ref().map_or(0.0, |direction| {
                SHARE_OF_LINEAR_CHANGE * (direction.q[i] / direction.p[0] * self.widths[0]).abs()
            })
        };
        let found: Vec<f64> = zeros.iter().map(|i| of_unit(*i, &moves)).collect();
        zeros
            .iter()
            .zip(&found)
            .filter(|(_, found)| **found > 0.0)
            .for_each(|(i, found)| self.scales[*i] = *found);
        zeros.into_iter().zip(found).filter(|(_, found)| *found == 0.0).map(|(i, _)| i).collect()
    }

    /// For a start in a fold or next to one, the changes of all coordinates along the softest shape that need
    /// a change of the parameter by a tenth of its range. There the softest stiffness is nearly zero, so that
    /// its relative change is no scale. `None` for other starts.
    fn fold_extent(&self, balance: &Balance<M>) -> Option<DVector<f64>> {
        // The softest shape, and the force along it that the parameter makes over a tenth of its range.
        let (lower, reduced) = balance.stiffness_per_inertia()?;
        let svd = reduced.try_svd(true, true, f64::EPSILON, 1000)?;
        let (least, sigma) = svd.singular_values.argmin();
        let left = svd.u?.column(least).into_owned();
        let along = lower.tr_solve_lower_triangular(&svd.v_t?.row(least).transpose())?;
        let size = along.amax();
        let (along, sigma) = (along / size, sigma / size);
        let by_parameter = lower.solve_lower_triangular(&balance.by_parameter(0))?;
        let push = left.dot(&by_parameter).abs();
        let allowed = FOLD_FORCE_SHARE * push * self.widths[0];
        if !(size.is_finite() && push > MIN_PUSH_ALONG_SOFT_SHAPE * by_parameter.norm()) {
            return None;
        }
        // The largest trial displacement, to both sides, whose force along the shape is allowed.
        let mut unknowns = DVector::zeros(balance.lift.ncols());
        unknowns.rows_mut(0, along.len()).copy_from(&along);
        let is_within = |h: f64| {
            let place = self.moved(&balance.place, &balance.direction(&(&unknowns * h), self.count));
            let preferred = &balance.statics.tangent.coordinates;
            let there = self
                .projected(&place, &balance.statics)
                .and_then(|place| self.balance(&place, preferred).ok());
            let force = there.filter(|there| there.size() == along.len())?.force - &balance.force;
            Some(left.dot(&lower.solve_lower_triangular(&force)?).abs() <= allowed)
        };
        let mut reach = None;
        for h in TRIAL_DECADES.flat_map(|decade| TRIAL_MANTISSAS.map(|x| x * 10.0_f64.powi(decade))) {
            if ![h, -h].into_iter().all(|h| is_within(h) == Some(true)) {
                break;
            }
            reach = Some(h);
        }
        let reach = reach.filter(|h| sigma * h < MAX_STIFFNESS_FORCE_IN_FOLD * allowed)?;
        Some(balance.direction(&(unknowns * reach), self.count).q.abs())
    }

    /// Sets the scales of coordinates whose size at the start is no scale: to the distance over which the
    /// stiffness changes, or in a fold, over which the load does.
    pub(super) fn set_length_scales(&mut self, balance: &Balance<M>, unmoved: &[usize]) {
        let in_fold = self.fold_extent(balance);
        let most = self.largest_stiffness(balance);
        let mut units: Vec<&str> = Vec::new();
        for quantity in M::COORDINATES.iter().filter(|quantity| !quantity.is_angle()) {
            if !units.contains(&quantity.unit) {
                units.push(quantity.unit);
            }
        }
        for unit in units {
            let of_unit = |i: &usize| M::COORDINATES[*i].unit == unit;
            let length = match &in_fold {
                None => most.and_then(|most| self.stiffness_length(balance, unit, most)),
                Some(reach) => {
                    let most = (0..reach.len()).filter(of_unit).map(|i| reach[i]).fold(0.0, f64::max);
                    Some(most).filter(|most| *most > 0.0)
                }
            };
            let Some(length) = length else { continue };
            for (i, scale) in self.scales.iter_mut().enumerate().filter(|(i, _)| of_unit(i)) {
                let is_scale = !unmoved.contains(&i)
                    && *scale >= length / MAX_LENGTH_OVER_START
                    && *scale <= length * MAX_START_OVER_LENGTH;
                *scale = if is_scale { *scale } else { length };
            }
        }
    }

    /// The largest stiffness per inertia at a position, over the range of the parameter.
    fn largest_stiffness(&self, balance: &Balance<M>) -> Option<f64> {
        let here = balance.stiffness_per_inertia()?.1.amax();
        let stiffness_at = |p: f64| {
            let moved = ContinuationPoint { p: [p, balance.place.p[1]], ..balance.place };
            Some(self.stiffness_per_inertia_at(&self.projected(&moved, &balance.statics)?, balance)?.amax())
        };
        let ends = [-0.5, 0.5].map(|part| stiffness_at(balance.place.p[0] + part * self.widths[0]));
        Some(ends.into_iter().flatten().filter(|x| x.is_finite()).fold(here, f64::max))
    }

    /// The stiffness per inertia at a point; `None` if its independent coordinates are others than those of
    /// `like`.
    fn stiffness_per_inertia_at(
        &self,
        place: &ContinuationPoint<M::State>,
        like: &Balance<M>,
    ) -> Option<DMatrix<f64>> {
        let preferred = &like.statics.tangent.coordinates;
        let there = self.balance(place, preferred).ok()?;
        (there.statics.tangent.coordinates == *preferred)
            .then(|| there.stiffness_per_inertia())?
            .map(|(_, k)| k)
    }

    /// The largest trial displacement of all coordinates of a unit, in different proportions, that leaves the
    /// stiffness as it is up to a share of its largest value `most`. `None` if there is no such coordinate,
    /// or if no displacement changes the stiffness.
    fn stiffness_length(&self, balance: &Balance<M>, unit: &str, most: f64) -> Option<f64> {
        let here = balance.stiffness_per_inertia()?.1;
        let coordinates = &balance.statics.tangent.coordinates;
        let parts = DVector::from_fn(balance.lift.ncols(), |j, _| {
            let of_unit = j < balance.size() && M::COORDINATES[coordinates[balance.free[j]]].unit == unit;
            let sign = if j.is_multiple_of(2) { 1.0 } else { -1.0 };
            if of_unit { sign / (1.0 + 0.3 * j as f64) } else { 0.0 }
        });
        let largest = parts.amax();
        if !(largest > 0.0 && most > 0.0) {
            return None;
        }
        let parts = parts / largest;
        let is_within = |h: f64| {
            let place = self.moved(&balance.place, &balance.direction(&(&parts * h), self.count));
            let there = self
                .projected(&place, &balance.statics)
                .and_then(|place| self.stiffness_per_inertia_at(&place, balance));
            there.is_some_and(|k| (k - &here).amax() <= MAX_STIFFNESS_CHANGE * most)
        };
        let mut last = None;
        for h in TRIAL_DECADES.flat_map(|decade| TRIAL_MANTISSAS.map(|x| x * 10.0_f64.powi(decade))) {
            if !is_within(h) {
                return last;
            }
            last = Some(h);
        }
        None
    }
}

//! Scales of coordinates.
//!
//! Steps along a branch, and the tolerance of Newton's method, need a length scale for each coordinate that
//! is not an angle. Usually this is the largest value of its unit at the start. That is no measure in a
//! straight column, in a column with a tiny imperfection, or if the origin is far away. There the scale is
//! the distance over which the stiffness of the structure changes.

use alloc::vec::Vec;

use dynamics_runtime::model::{Constraints, ModelState, Vector};
use nalgebra::{DMatrix, DVector};

use super::locate::null_plane;
use super::problem::{Balance, ContinuationPoint, ContinuationProblem};

/// Displacements tried: these times powers of ten.
const MANTISSAS: [f64; 2] = [1.0, 3.0];
const DECADES: core::ops::RangeInclusive<i32> = -12..=12;
/// Changes of the stiffness by this part of its largest on the parameter's range make another structure of
/// it.
const ANOTHER: f64 = 0.5;
/// Forces up to this part of what the parameter's range makes of them say how far a fold reaches.
const PART: f64 = 0.1;
/// Where the stiffness makes less than this part of them, the start is in a fold, or next to one.
const IN_FOLD: f64 = 0.1;
/// A parameter that pushes along the softest shape by less than this part of all it does makes no fold of it.
const ASKEW: f64 = 1e-6;
/// A size at the start so much smaller, or larger, than what matters says nothing.
const SMALLER: f64 = 30.0;
const LARGER: f64 = 300.0;

impl<M: Constraints> ContinuationProblem<'_, M> {
    /// Coordinates of a unit of which all are 0 at the start, by a tenth of what they would do over the whole
    /// range; those that would not move are the result.
    pub(super) fn measure_zeros(
        &mut self,
        place: &ContinuationPoint<M::State>,
        balance: &Balance<M>,
    ) -> Vec<usize> {
        let q = place.state.q().as_slice();
        let of_unit = |i: usize, f: &dyn Fn(usize) -> f64| {
            let same = (0..q.len()).filter(|j| M::COORDINATES[*j].unit == M::COORDINATES[i].unit);
            same.map(f).fold(0.0, f64::max)
        };
        let is_zero = |i: &usize| M::COORDINATES[*i].unit != "rad" && of_unit(*i, &|j| q[j].abs()) < 1e-12;
        let zeros: Vec<usize> = (0..q.len()).filter(is_zero).collect();
        let way =
            null_plane(self, balance).map(|[way, _]| way).filter(|_| self.fold_reach(balance).is_none());
        let moves =
            |i: usize| way.as_ref().map_or(0.0, |way| 0.1 * (way.q[i] / way.p[0] * self.widths[0]).abs());
        let found: Vec<f64> = zeros.iter().map(|i| of_unit(*i, &moves)).collect();
        zeros
            .iter()
            .zip(&found)
            .filter(|(_, found)| **found > 0.0)
            .for_each(|(i, found)| self.scales[*i] = *found);
        zeros.into_iter().zip(found).filter(|(_, found)| *found == 0.0).map(|(i, _)| i).collect()
    }

    /// From a start in a fold, or next to one, how far coordinates go along the softest shape before the
    /// parameter would have to change by a tenth of its range: there the stiffness is next to none, and says
    /// nothing of how far it stays as it is. `None` elsewhere.
    fn fold_reach(&self, balance: &Balance<M>) -> Option<DVector<f64>> {
        let (lower, reduced) = balance.per_inertia()?;
        let svd = reduced.try_svd(true, true, f64::EPSILON, 1000)?;
        let (least, sigma) = svd.singular_values.argmin();
        let left = svd.u?.column(least).into_owned();
        let along = lower.tr_solve_lower_triangular(&svd.v_t?.row(least).transpose())?;
        let size = along.amax();
        let (along, sigma) = (along / size, sigma / size);
        let by_parameter = lower.solve_lower_triangular(&balance.by_parameter(0))?;
        let push = left.dot(&by_parameter).abs();
        let allowed = PART * push * self.widths[0];
        if !(size.is_finite() && push > ASKEW * by_parameter.norm()) {
            return None;
        }
        let mut unknowns = DVector::zeros(balance.lift.ncols());
        unknowns.rows_mut(0, along.len()).copy_from(&along);
        let stays = |h: f64| {
            let place = self.moved(&balance.place, &balance.direction(&(&unknowns * h), self.count));
            let preferred = &balance.statics.tangent.coordinates;
            let there =
                self.placed(&place, &balance.statics).and_then(|place| self.balance(&place, preferred).ok());
            let force = there.filter(|there| there.size() == along.len())?.force - &balance.force;
            Some(left.dot(&lower.solve_lower_triangular(&force)?).abs() <= allowed)
        };
        let mut reach = None;
        for h in DECADES.flat_map(|decade| MANTISSAS.map(|x| x * 10.0_f64.powi(decade))) {
            if ![h, -h].into_iter().all(|h| stays(h) == Some(true)) {
                break;
            }
            reach = Some(h);
        }
        let reach = reach.filter(|h| sigma * h < IN_FOLD * allowed)?;
        Some(balance.direction(&(unknowns * reach), self.count).q.abs())
    }

    /// Coordinates of which the start says nothing, by how far they go before the stiffness is another one;
    /// in a fold, before the load is.
    pub(super) fn measure_lengths(&mut self, balance: &Balance<M>, still: &[usize]) {
        let in_fold = self.fold_reach(balance);
        let most = self.stiffest(balance);
        let mut units: Vec<&str> = Vec::new();
        for quantity in M::COORDINATES.iter().filter(|quantity| quantity.unit != "rad") {
            if !units.contains(&quantity.unit) {
                units.push(quantity.unit);
            }
        }
        for unit in units {
            let of_unit = |i: &usize| M::COORDINATES[*i].unit == unit;
            let length = match &in_fold {
                None => most.and_then(|most| self.length(balance, unit, most)),
                Some(reach) => {
                    let most = (0..reach.len()).filter(of_unit).map(|i| reach[i]).fold(0.0, f64::max);
                    Some(most).filter(|most| *most > 0.0)
                }
            };
            let Some(length) = length else { continue };
            for (i, scale) in self.scales.iter_mut().enumerate().filter(|(i, _)| of_unit(i)) {
                let is_told = !still.contains(&i) && *scale >= length / SMALLER && *scale <= length * LARGER;
                *scale = if is_told { *scale } else { length };
            }
        }
    }

    /// The largest stiffness per inertia at a position, over the parameter's range.
    fn stiffest(&self, balance: &Balance<M>) -> Option<f64> {
        let here = balance.per_inertia()?.1.amax();
        let at = |p: f64| {
            let moved = ContinuationPoint { p: [p, balance.place.p[1]], ..balance.place };
            Some(self.per_inertia(&self.placed(&moved, &balance.statics)?, balance)?.amax())
        };
        let ends = [-0.5, 0.5].map(|part| at(balance.place.p[0] + part * self.widths[0]));
        Some(ends.into_iter().flatten().filter(|x| x.is_finite()).fold(here, f64::max))
    }

    fn per_inertia(&self, place: &ContinuationPoint<M::State>, like: &Balance<M>) -> Option<DMatrix<f64>> {
        let preferred = &like.statics.tangent.coordinates;
        let there = self.balance(place, preferred).ok()?;
        (there.statics.tangent.coordinates == *preferred).then(|| there.per_inertia())?.map(|(_, k)| k)
    }

    /// How far coordinates of a unit go, each by another part of it, before the stiffness is another one.
    fn length(&self, balance: &Balance<M>, unit: &str, most: f64) -> Option<f64> {
        let here = balance.per_inertia()?.1;
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
        let stays = |h: f64| {
            let place = self.moved(&balance.place, &balance.direction(&(&parts * h), self.count));
            let there =
                self.placed(&place, &balance.statics).and_then(|place| self.per_inertia(&place, balance));
            there.is_some_and(|k| (k - &here).amax() <= ANOTHER * most)
        };
        let mut last = None;
        for h in DECADES.flat_map(|decade| MANTISSAS.map(|x| x * 10.0_f64.powi(decade))) {
            if !stays(h) {
                return last;
            }
            last = Some(h);
        }
        None
    }
}

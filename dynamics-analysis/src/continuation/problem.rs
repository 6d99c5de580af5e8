//! Balance as equations for coordinates and parameters together.
//!
//! At a point (q, p) that need not be in balance, nor exactly on the constraints, the equations are
//! F = Eᵀr = 0 for the independent coordinates z and the parameters, with r = −Q − Φ_qᵀλ at q̈ = 0
//! (`equilibria/statics.rs`). To first order
//!
//! ```text
//! δq = D δz + P δp + c
//! δF = K δz + F_p δp + Eᵀr_q c        F_p = Eᵀ(r_p + r_q P)
//! ```
//!
//! where P is the response of the dependent coordinates to Φ_p, and c that to Φ itself: the way back to the
//! constraints. K, D and Eᵀr_q are exact. The effect of the parameter, r_p and Φ_p, is known to the
//! closure alone. They are central differences of exact forces and residuals, with Richardson extrapolation
//! and a measured error. They steer the iteration. F and K alone decide whether a point is in balance and
//! whether its stiffness is singular.

use alloc::vec::Vec;

use dynamics_runtime::constrain::active_rows;
use dynamics_runtime::error::StateError;
use dynamics_runtime::model::{Constraints, ModelState, Vector};
use nalgebra::{DMatrix, DVector};

use crate::displacement::displaced;
use crate::equilibria::{EquilibriumError, FORCE_NOISE_FACTOR, Statics, check_time};

/// Steps of differences by a parameter, as shares of its range, from large to small. With Richardson
/// extrapolation truncation falls with the fourth power of the step, rounding grows with its inverse. The
/// step with the least measured error counts.
const PARAMETER_STEPS: [f64; 4] = [1e-2, 1e-3, 1e-4, 1e-5];
/// Smaller steps are not tried once the measured relative error of a difference is below this. No smaller
/// step would be better by much: rounding contributes 10⁻¹⁴ at the largest step, and 10⁻¹¹ at the
/// smallest.
const SUFFICIENT_ERROR: f64 = 1e-11;
/// The narrowest range of a parameter, relative to its size. In a narrower one, the smallest step of
/// differences is less than 10⁻¹³ of the parameter, and its effect is mostly rounding.
const MIN_RELATIVE_RANGE: f64 = 1e-8;

/// A last correction up to this length, in the scales of the unknowns, is rounding: the point is in balance
/// whatever force is left. Rounding of forces moves a point by about 10⁻¹⁶ times its conditioning; this
/// allows for a conditioning of 10⁵.
const ROUNDED_CORRECTION: f64 = 1e-11;
/// Largest number of corrections back to the constraints. They converge quadratically, or linearly at
/// singular positions, where 20 leave a millionth of the distance.
const MAX_PROJECTIONS: usize = 20;

/// A position at values of the parameters. The second parameter is 0 in families with one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ContinuationPoint<S> {
    pub(super) state: S,
    pub(super) p: [f64; 2],
}

/// A direction in all coordinates and parameters.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Direction {
    pub(super) q: DVector<f64>,
    pub(super) p: [f64; 2],
}

impl Direction {
    pub(super) fn scaled(&self, by: f64) -> Self {
        Self { q: &self.q * by, p: self.p.map(|p| by * p) }
    }
}

/// A family of models with the scales of its coordinates and parameters.
pub(super) struct ContinuationProblem<'f, M: Constraints> {
    pub(super) make: &'f dyn Fn([f64; 2]) -> M,
    /// The number of parameters: 1 or 2.
    pub(super) count: usize,
    /// The scales of the coordinates.
    pub(super) scales: Vec<f64>,
    /// The scales of the parameters: the widths of their ranges.
    pub(super) widths: [f64; 2],
    /// Ignorable coordinates: they keep their values.
    pub(super) fixed: Vec<usize>,
}

/// The linearised equations of balance at a point.
pub(super) struct Balance<M: Constraints> {
    pub(super) place: ContinuationPoint<M::State>,
    pub(super) model: M,
    pub(super) statics: Statics<M::Rows>,
    /// The independent coordinates that are not fixed, by their index among the independent ones.
    pub(super) free: Vec<usize>,
    /// F + Eᵀr_q c, of length n: the residual force once the constraints are fulfilled.
    pub(super) force: DVector<f64>,
    /// [K, F_p], n × (n + parameters).
    pub(super) jacobian: DMatrix<f64>,
    /// [D, P], N × (n + parameters): the change of all coordinates with the unknowns.
    pub(super) lift: DMatrix<f64>,
    /// c, of length N.
    pub(super) offset: DVector<f64>,
    /// The measured relative error of F_p.
    pub(super) derivative_error: f64,
}

impl<M: Constraints> ContinuationProblem<'_, M> {
    /// The scale of the j-th unknown.
    pub(super) fn scale_of(&self, balance: &Balance<M>, j: usize) -> f64 {
        match j.checked_sub(balance.size()) {
            Some(k) => self.widths[k],
            None => self.scales[balance.statics.tangent.coordinates[balance.free[j]]],
        }
    }

    /// The distance between neighbours, in the scales of coordinates and parameters.
    pub(super) fn distance(&self, a: &ContinuationPoint<M::State>, b: &ContinuationPoint<M::State>) -> f64 {
        self.norm(&self.between(a, b))
    }

    /// The direction from one point to another.
    pub(super) fn between(
        &self,
        a: &ContinuationPoint<M::State>,
        b: &ContinuationPoint<M::State>,
    ) -> Direction {
        let coordinates =
            |place: &ContinuationPoint<M::State>| DVector::from_column_slice(place.state.q().as_slice());
        Direction { q: coordinates(b) - coordinates(a), p: [b.p[0] - a.p[0], b.p[1] - a.p[1]] }
    }

    /// The scalar product of two directions, in the scales of coordinates and parameters.
    pub(super) fn dot(&self, a: &Direction, b: &Direction) -> f64 {
        let of_q: f64 = self.scales.iter().enumerate().map(|(i, s)| a.q[i] * b.q[i] / (s * s)).sum();
        of_q + (0..self.count).map(|k| a.p[k] * b.p[k] / (self.widths[k] * self.widths[k])).sum::<f64>()
    }

    pub(super) fn norm(&self, a: &Direction) -> f64 {
        self.dot(a, a).sqrt()
    }

    /// The angle between two unit directions, in rad.
    pub(super) fn angle(&self, a: &Direction, b: &Direction) -> f64 {
        self.dot(a, b).clamp(-1.0, 1.0).acos()
    }

    /// A point moved along a direction, which need not be on the constraints.
    pub(super) fn moved(
        &self,
        place: &ContinuationPoint<M::State>,
        by: &Direction,
    ) -> ContinuationPoint<M::State> {
        let mut next = *place;
        next.state = displaced(&place.state, &by.q);
        (0..self.count).for_each(|k| next.p[k] += by.p[k]);
        next
    }

    /// The model at values of the parameters, if its own parameters are finite.
    pub(super) fn model(&self, p: [f64; 2]) -> Result<M, EquilibriumError> {
        let model = (self.make)(p);
        StateError::check_parameters(&model)?;
        Ok(model)
    }

    /// Forces and stiffness alone. `preferred` coordinates are independent if possible.
    pub(super) fn statics(
        &self,
        place: &ContinuationPoint<M::State>,
        preferred: &[usize],
    ) -> Result<Statics<M::Rows>, EquilibriumError> {
        Statics::of(&self.model(place.p)?, &place.state, preferred)
    }

    /// Checks that forces which balance at a point do so at all times at which those of an equilibrium are
    /// sampled.
    pub(super) fn check_times(&self, place: &ContinuationPoint<M::State>) -> Result<(), EquilibriumError> {
        if !M::EXPLICIT_TIME {
            return Ok(());
        }
        check_time(&self.model(place.p)?, &place.state, &self.statics(place, &[])?, true)
    }

    /// The indices among the independent coordinates of those that are not fixed.
    pub(super) fn free(&self, statics: &Statics<M::Rows>) -> Vec<usize> {
        let is_free = |k: &usize| !self.fixed.contains(&statics.tangent.coordinates[*k]);
        (0..statics.tangent.coordinates.len()).filter(is_free).collect()
    }

    /// The linearised equations at a point. `preferred` coordinates are independent if possible.
    pub(super) fn balance(
        &self,
        place: &ContinuationPoint<M::State>,
        preferred: &[usize],
    ) -> Result<Balance<M>, EquilibriumError> {
        let model = self.model(place.p)?;
        let statics = Statics::of(&model, &place.state, preferred)?;
        let free = self.free(&statics);
        let n = free.len();
        let rows: Vec<usize> = active_rows::<M>(place.state.active_set(), false).collect();
        let residual = model.residual(&place.state);
        let column =
            |values: &M::Residual| DMatrix::from_fn(rows.len(), 1, |i, _| values.as_slice()[rows[i]]);
        let offset = statics.tangent.particular(&column(&residual)).column(0).into_owned();
        // The residual force, corrected to first order by the return to the constraints.
        let mut force = &statics.force + &statics.by_all * &offset;
        force = DVector::from_fn(n, |i, _| force[free[i]]);
        // K and D of the free coordinates.
        let mut jacobian = DMatrix::zeros(n, n + self.count);
        let mut lift = DMatrix::zeros(M::Vector::LEN, n + self.count);
        for (j, k) in free.iter().enumerate() {
            (0..n).for_each(|i| jacobian[(i, j)] = statics.stiffness[(free[i], *k)]);
            lift.set_column(j, &statics.tangent.positions.column(*k));
        }
        let mut derivative_error: f64 = 0.0;
        // F_p and P of each parameter, by differences.
        for k in 0..self.count {
            let model_at = |value: f64| {
                let mut p = place.p;
                p[k] = value;
                self.model(p).ok()
            };
            let of_rows = difference(place.p[k], self.widths[k], |value| {
                let moved = model_at(value)?.residual(&place.state);
                Some(column(&moved).column(0).into_owned())
            })?;
            let of_force = difference(place.p[k], self.widths[k], |value| {
                statics.force_nearby(&model_at(value)?, &place.state).ok()
            })?;
            let dependent =
                statics.tangent.particular(&DMatrix::from_columns(&[of_rows.0])).column(0).into_owned();
            let total = of_force.0 + &statics.by_all * &dependent;
            (0..n).for_each(|i| jacobian[(i, n + k)] = total[free[i]]);
            lift.set_column(n + k, &dependent);
            derivative_error = derivative_error.max(of_rows.1).max(of_force.1);
        }
        Ok(Balance { place: *place, model, statics, free, force, jacobian, lift, offset, derivative_error })
    }

    /// Returns a point to the constraints by Newton's method, with the independent coordinates of `like`
    /// kept. `None` if that does not converge.
    pub(super) fn projected(
        &self,
        place: &ContinuationPoint<M::State>,
        like: &Statics<M::Rows>,
    ) -> Option<ContinuationPoint<M::State>> {
        if M::Residual::LEN == 0 {
            return Some(*place);
        }
        let (model, mut next) = (self.model(place.p).ok()?, *place);
        let mut last = f64::INFINITY;
        for _ in 0..MAX_PROJECTIONS {
            let rows: Vec<usize> = active_rows::<M>(next.state.active_set(), false).collect();
            let residual = model.residual(&next.state);
            let left = DMatrix::from_fn(rows.len(), 1, |i, _| residual.as_slice()[rows[i]]);
            let change =
                Statics::of(&model, &next.state, &like.tangent.coordinates).ok()?.tangent.particular(&left);
            let change = Direction { q: change.column(0).into_owned(), p: [0.0; 2] };
            let size = self.norm(&change);
            if size <= f64::EPSILON || (size <= 1e-10 && size >= 0.5 * last) {
                return Some(next);
            }
            next = self.moved(&next, &change);
            last = size;
        }
        None
    }
}

impl<M: Constraints> Balance<M> {
    /// n, the number of free coordinates.
    pub(super) fn size(&self) -> usize {
        self.free.len()
    }

    /// The direction of a change of the unknowns.
    pub(super) fn direction(&self, unknowns: &DVector<f64>, count: usize) -> Direction {
        let n = self.size();
        let part = unknowns.rows(0, n + count);
        let p = core::array::from_fn(|k| if k < count { unknowns[n + k] } else { 0.0 });
        Direction { q: &self.lift * part, p }
    }

    /// The inertia of the free coordinates, n × n.
    pub(super) fn mass(&self) -> DMatrix<f64> {
        self.statics.mass.select_rows(&self.free).select_columns(&self.free)
    }

    /// K of the free coordinates, n × n.
    pub(super) fn stiffness(&self) -> DMatrix<f64> {
        self.jacobian.columns(0, self.size()).into_owned()
    }

    /// L of M = L Lᵀ, and L⁻¹ K L⁻ᵀ, of the free coordinates.
    pub(super) fn stiffness_per_inertia(&self) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
        let lower = self.mass().cholesky()?.unpack();
        let half = lower.solve_lower_triangular(&self.stiffness())?;
        let reduced = lower.solve_lower_triangular(&half.transpose())?.transpose();
        Some((lower, reduced))
    }

    /// L⁻¹ [K, F_p]: forces of all units weighed alike.
    pub(super) fn jacobian_per_inertia(&self) -> Option<DMatrix<f64>> {
        self.mass().cholesky()?.unpack().solve_lower_triangular(&self.jacobian)
    }

    /// F_p of a parameter.
    pub(super) fn by_parameter(&self, k: usize) -> DVector<f64> {
        self.jacobian.column(self.size() + k).into_owned()
    }

    /// Checks that forces do not change with time: at three times, or at `all` those at which an equilibrium
    /// is sampled.
    pub(super) fn check_time(&self, all: bool) -> Result<(), EquilibriumError> {
        check_time(&self.model, &self.place.state, &self.statics, all)
    }

    /// Whether the residual force, or the last correction, is rounding.
    pub(super) fn is_balanced(&self, change: f64) -> Result<bool, EquilibriumError> {
        let noise = self.statics.noise(&self.model, &self.place.state)?;
        let rounded = |k: &usize| self.statics.force[*k].abs() <= FORCE_NOISE_FACTOR * noise[*k];
        Ok(change <= ROUNDED_CORRECTION || self.free.iter().all(rounded))
    }
}

/// Whether a parameter can be followed over a range from a value: the range is finite, contains the value,
/// and is not narrower than [`MIN_RELATIVE_RANGE`].
pub(super) fn is_range([lo, hi]: [f64; 2], start: f64) -> bool {
    let width = hi - lo;
    lo.is_finite()
        && width.is_finite()
        && width > MIN_RELATIVE_RANGE * lo.abs().max(hi.abs())
        && (lo..=hi).contains(&start)
}

/// The derivative of a function of one number, and its measured relative error. It is a central difference
/// with Richardson extrapolation, or a one-sided one where the function is defined on one side only, with the
/// best of several steps.
pub(super) fn difference(
    at: f64,
    width: f64,
    f: impl Fn(f64) -> Option<DVector<f64>>,
) -> Result<(DVector<f64>, f64), EquilibriumError> {
    let f = |x: f64| f(x).filter(|value| value.iter().all(|x| x.is_finite()));
    let mut best: Option<(DVector<f64>, f64)> = None;
    for part in PARAMETER_STEPS {
        let h = part * width;
        if at + 0.5 * h == at - 0.5 * h {
            continue;
        }
        let two = [h, 0.5 * h].map(|h| {
            if let (Some(above), Some(below)) = (f(at + h), f(at - h)) {
                return Some((&above - &below) / ((at + h) - (at - h)));
            }
            let side = |h: f64| Some((f(at + h)? * 4.0 - f(at + 2.0 * h)? - f(at)? * 3.0) / (2.0 * h));
            side(h).or_else(|| side(-h))
        });
        let [Some(coarse), Some(fine)] = two else { continue };
        let found = (&fine * 4.0 - &coarse) / 3.0;
        if !found.iter().all(|x| x.is_finite()) {
            continue;
        }
        let size = found.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let difference = (&found - &fine).iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let error = if size > 0.0 { difference / size } else { 0.0 };
        if best.as_ref().is_none_or(|(_, least)| error < *least) {
            best = Some((found, error));
        }
        if error <= SUFFICIENT_ERROR {
            break;
        }
    }
    best.ok_or(EquilibriumError::NotDefined { parameter: at })
}

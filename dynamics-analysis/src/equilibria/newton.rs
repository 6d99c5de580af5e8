//! Newton's method for balance, along the constraints.
//!
//! Each iteration solves K δz = −F with the exact K, moves δq = D δz, and returns to the constraints;
//! the step is halved until ‖F‖ falls by Armijo's condition. ‖F‖ is the minimum over λ of the
//! forces, weighted by the inertias at the start, and K is its derivative (`Statics::covariant`). Both belong
//! to the position, not to the choice of independent coordinates. For example, with its height as the
//! coordinate, a pendulum has the same force everywhere, which no Newton step could make smaller. If less
//! than a 32nd of the step is accepted, K is nearly singular and its direction is of little use. A
//! Levenberg–Marquardt step with adaptive damping takes its place (J. Nocedal & S. J. Wright, *Numerical
//! Optimization*, §10.3 and §11.2). It converges to the nearest minimum of ‖F‖. If that is not 0, there
//! is no equilibrium, and K is singular there: the load is beyond a fold. If ‖F‖ does not fall to first
//! order, it may be at a maximum, as for a level pendulum. Then points a little beside are tried, first in
//! the direction of the force.
//!
//! Near the end every full step is taken until the corrections no longer shrink: to rounding, whatever the
//! units. Directions in which K vanishes completely (cyclic coordinates) are left alone.

use alloc::vec::Vec;

use dynamics_runtime::error::SolveError;
use dynamics_runtime::model::{Constraints, ModelState, Vector};
use nalgebra::{DMatrix, DVector};

use super::balanced_svd::BalancedSvd;
use super::rounding::FORCE_NOISE_FACTOR;
use super::soft_directions::SoftDirections;
use super::statics::{Statics, scales};
use super::{EquilibriumError, corner};
use crate::LinearizeError;
use crate::displacement::{displaced, project, size_in_scales};

/// Largest number of iterations. Near a fold and at a pitchfork each takes a half or a third of the error,
/// for forces that begin with the fifth power a fifth. From 1 to 10⁻¹⁶, the latter needs 165 of them.
const MAX_ITERATIONS: usize = 500;
/// Converged corrections that are more than this share of the last no longer shrink: what is left is
/// rounding. A root of the ninth order makes each correction 8/9 of the last and still counts as shrinking.
const STALLED_CORRECTION_RATIO: f64 = 0.9;
/// From corrections of this length on, in the scales of the coordinates, full Newton steps are taken without
/// a test of ‖F‖, until they no longer shrink: rounding would decide that test.
const CONVERGED_CORRECTION: f64 = 1e-7;
/// The smallest share of a Newton step that is tried. A smaller accepted share shows that K is nearly
/// singular; the Levenberg–Marquardt step makes better progress then.
const MIN_NEWTON_SHARE: f64 = 1.0 / 32.0;
/// A predicted decrease of ‖F‖² below this share of it is rounding: ‖F‖ has its minimum here.
const MIN_RELATIVE_DECREASE: f64 = 1e-13;
/// A coordinate beyond this many times its scale at the start, plus one unit of it, has run away. Forces of
/// an equilibrium there would be rounding.
const RUNAWAY_RATIO: f64 = 1e12;
/// If the force has fallen below this share of that at the start without convergence, the search runs away
/// along forces that decay, as 1/x does.
const RUNAWAY_FORCE_RATIO: f64 = 1e-12;
/// Where ‖F‖ does not fall to first order, points at these distances, in the scales of the coordinates,
/// are tried. At 10⁻³ a decrease of second order is 10⁻⁶, far above rounding.
const STALL_PROBE_DISTANCES: [f64; 2] = [1e-3, 1e-2];
/// Such a point is taken if ‖F‖² is smaller there by more than this share.
const MIN_PROBE_DECREASE: f64 = 1e-10;

/// The first damping of Levenberg–Marquardt steps, relative to the square of the largest stiffness.
const FIRST_DAMPING: f64 = 1e-3;
/// The least damping, likewise: below it a step is Newton's to rounding.
const MIN_DAMPING: f64 = 1e-12;
/// Largest number of dampings that are tried for a step. Each is four times the last, so that they cover 48
/// powers of ten.
const MAX_DAMPING_TRIALS: usize = 80;
/// A damped step is accepted if ‖F‖² falls by more than this share of what the linear model predicts.
const MIN_GAIN_RATIO: f64 = 1e-3;
/// A share s of a Newton step is accepted if ‖F‖² falls by more than this times s, relative: twice
/// Armijo's usual constant of 10⁻⁴, because ‖F‖² falls twice as fast as ‖F‖.
const ARMIJO_DECREASE: f64 = 2e-4;
/// Longest step of an angle, in rad.
const MAX_ANGLE_STEP: f64 = 1.0;
/// Longest step of other coordinates, in their scales.
const MAX_STEP_IN_SCALES: f64 = 10.0;
/// Inertias below this share of the largest are not positive, up to rounding. The metric has 1 in their
/// place.
const MIN_INERTIA_SHARE: f64 = 1e-12;
/// A last correction up to this length, in the scales of the coordinates, is rounding if it takes all of the
/// force.
const ROUNDED_CORRECTION: f64 = 1e-11;
/// The share of a force that a correction may leave and still take all of it: nothing of the force acts along
/// directions without stiffness.
const REMAINING_FORCE_SHARE: f64 = 1e-6;

/// The equilibrium at which the search ended.
pub(super) struct EquilibriumSolution<M: Constraints> {
    pub(super) state: M::State,
    pub(super) statics: Statics<M::Rows>,
    pub(super) iterations: usize,
    /// The error of each coordinate that rounding of forces may cause.
    pub(super) uncertainty: Vec<f64>,
}

/// The iteration at one position.
struct NewtonIteration<'m, M: Constraints> {
    model: &'m M,
    constants: M::Constants,
    /// The scales of the coordinates at the start.
    initial_scales: Vec<f64>,
    /// Inertias by coordinate: fixed for the run, so that ‖F‖ at different positions can be compared.
    metric: Vec<f64>,
    /// The damping of the next Levenberg–Marquardt step.
    damping: f64,
    /// The largest force at the start.
    initial_force: f64,
}

/// F and K in orthonormal vectors of the metric: L⁻¹F and L⁻¹K L⁻ᵀ with L Lᵀ = EᵀG E, and Lᵀ
/// of the coordinates.
struct WeightedEquations {
    force: DVector<f64>,
    stiffness: DMatrix<f64>,
    upper: DMatrix<f64>,
}

/// Lower triangular L with L Lᵀ = BᵀG B.
fn lower(metric: &[f64], basis: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let metric = DMatrix::from_diagonal(&DVector::from_column_slice(metric));
    basis.tr_mul(&(metric * basis)).cholesky().map(nalgebra::Cholesky::unpack)
}

/// The error of the independent coordinates from rounding of F.
fn coordinate_uncertainty<M: Constraints>(
    model: &M,
    state: &M::State,
    statics: &Statics<M::Rows>,
    factors: &BalancedSvd,
    noise: &DVector<f64>,
) -> Result<DVector<f64>, EquilibriumError> {
    // At folds and pitchforks each correction takes a half or a third of the error, so that what remains is
    // up to three times the last one.
    let uncertainty = factors.reach(noise) + 3.0 * factors.solve(&statics.force).abs();
    let soft = SoftDirections { model, state, statics, factors, noise }.reach()?;
    Ok(uncertainty.zip_map(&soft, f64::max))
}

/// The error of the independent coordinates of an equilibrium.
pub(super) fn position_uncertainty<M: Constraints>(
    model: &M,
    state: &M::State,
    statics: &Statics<M::Rows>,
) -> Result<DVector<f64>, EquilibriumError> {
    let size = statics.stiffness.nrows();
    if size == 0 {
        return Ok(DVector::zeros(statics.stiffness.ncols()));
    }
    let factors = BalancedSvd::of(&statics.stiffness).ok_or(LinearizeError::NoConvergence { size })?;
    coordinate_uncertainty(model, state, statics, &factors, &statics.noise(model, state)?)
}

/// Newton's method from a state on the constraints, whose velocities are kept.
pub(super) fn solve<M: Constraints>(
    model: &M,
    start: M::State,
) -> Result<EquilibriumSolution<M>, EquilibriumError> {
    let constants = model.constants().map_err(SolveError::from)?;
    let mut state = start;
    let mut statics = Statics::of(model, &state, &[])?;
    let initial_scales = scales(M::COORDINATES, state.q().as_slice());
    let initial_force = statics.force.amax();
    let most = statics.masses.amax();
    let metric = statics
        .masses
        .iter()
        .map(|mass| if *mass > MIN_INERTIA_SHARE * most { *mass } else { 1.0 })
        .collect();
    let mut search =
        NewtonIteration { model, constants, initial_scales, metric, damping: FIRST_DAMPING, initial_force };
    let mut last = f64::INFINITY;
    if statics.force.is_empty() {
        // A system without freedom is in equilibrium: its reactions balance all forces.
        return Ok(EquilibriumSolution {
            state,
            statics,
            iterations: 0,
            uncertainty: alloc::vec![0.0; M::Vector::LEN],
        });
    }
    for iteration in 0..MAX_ITERATIONS {
        let stiffness = statics.covariant(model, &state, &search.metric)?;
        let factors =
            BalancedSvd::of(&stiffness).ok_or_else(|| search.no_convergence(iteration, &statics, &state))?;
        let newton = factors.solve(&-&statics.force);
        let change = search.relative_change(&state, &(&statics.tangent.positions * &newton));
        let is_near = change <= CONVERGED_CORRECTION;
        // Near the end, full steps until corrections no longer shrink.
        let ends =
            is_near && (change <= f64::EPSILON * f64::EPSILON || change > STALLED_CORRECTION_RATIO * last);
        let next = match is_near {
            true => search.moved(&state, &statics, &newton).filter(|_| !ends),
            false => search.newton_step(&state, &statics, (&stiffness, &newton))?,
        };
        last = if is_near { change } else { f64::INFINITY };
        let Some(next) =
            next.or_else(|| search.probe_nearby(&state, &statics, (&stiffness, &factors), change))
        else {
            return search.accept(state, statics, &factors, change, iteration);
        };
        state = next;
        search.check_bounds(&state)?;
        statics = Statics::of(model, &state, &[])?;
    }
    Err(search.no_convergence(MAX_ITERATIONS, &statics, &state))
}

impl<M: Constraints> NewtonIteration<'_, M> {
    fn weighted_equations(
        &self,
        statics: &Statics<M::Rows>,
        stiffness: &DMatrix<f64>,
    ) -> Option<WeightedEquations> {
        let [e, d] =
            [&statics.tangent.velocities, &statics.tangent.positions].map(|basis| lower(&self.metric, basis));
        let (e, d) = (e?, d?);
        let half = e.solve_lower_triangular(stiffness)?;
        Some(WeightedEquations {
            force: e.solve_lower_triangular(&statics.force)?,
            stiffness: d.solve_lower_triangular(&half.transpose())?.transpose(),
            upper: d.transpose(),
        })
    }

    /// The largest change of a coordinate, in its scale.
    fn relative_change(&self, state: &M::State, change: &DVector<f64>) -> f64 {
        size_in_scales(change, &scales(M::COORDINATES, state.q().as_slice()))
    }

    /// The position after a change of the independent coordinates. `None` if the projection onto the
    /// constraints fails or leads far away.
    fn moved(&self, state: &M::State, statics: &Statics<M::Rows>, change: &DVector<f64>) -> Option<M::State> {
        self.moved_by(state, &(&statics.tangent.positions * change))
    }

    /// As [`Self::moved`], after a step of all coordinates.
    fn moved_by(&self, state: &M::State, step: &DVector<f64>) -> Option<M::State> {
        let mut next = displaced(state, step);
        let taken = project(self.model, &self.constants, &mut next).ok()?;
        let size = scales(M::COORDINATES, state.q().as_slice()).into_iter().fold(0.0, f64::max);
        // A projection that is nearly as long as the step leads to another branch of the constraints.
        (taken.change <= 0.5 * step.amax() + 1e-6 * size && next.q().as_slice().iter().all(|q| q.is_finite()))
            .then_some(next)
    }

    /// ‖F‖² after a change.
    fn merit(&self, next: &M::State) -> Option<f64> {
        let there = Statics::of(self.model, next, &[]).ok()?;
        let force = lower(&self.metric, &there.tangent.velocities)?.solve_lower_triangular(&there.force)?;
        Some(force.norm_squared()).filter(|merit| merit.is_finite())
    }

    /// A share of Newton's step with a sufficient decrease of ‖F‖, or a Levenberg–Marquardt step.
    /// `None` if neither makes ‖F‖ smaller.
    fn newton_step(
        &mut self,
        state: &M::State,
        statics: &Statics<M::Rows>,
        (stiffness, newton): (&DMatrix<f64>, &DVector<f64>),
    ) -> Result<Option<M::State>, EquilibriumError> {
        let weighted = self.weighted_equations(statics, stiffness).ok_or(LinearizeError::Inertia)?;
        let here = weighted.force.norm_squared();
        let mut part = self.step_limit(state, &(&statics.tangent.positions * newton));
        let least = MIN_NEWTON_SHARE * part;
        while part >= least {
            if let Some(next) = self.moved(state, statics, &(part * newton))
                && self.merit(&next).is_some_and(|merit| merit <= (1.0 - ARMIJO_DECREASE * part) * here)
            {
                return Ok(Some(next));
            }
            part *= 0.5;
        }
        Ok(self.levenberg_marquardt_step(state, statics, &weighted))
    }

    /// The largest share of a change, up to 1, in which no coordinate exceeds its longest step.
    fn step_limit(&self, state: &M::State, change: &DVector<f64>) -> f64 {
        let scales = scales(M::COORDINATES, state.q().as_slice());
        let allowed = M::COORDINATES
            .iter()
            .zip(scales)
            .map(|(q, scale)| if q.is_angle() { MAX_ANGLE_STEP } else { MAX_STEP_IN_SCALES * scale });
        change.iter().zip(allowed).fold(1.0, |part: f64, (d, allowed)| part.min(allowed / d.abs()))
    }

    /// A Levenberg–Marquardt step. `None` if no damping makes ‖F‖ smaller by more than rounding.
    fn levenberg_marquardt_step(
        &mut self,
        state: &M::State,
        statics: &Statics<M::Rows>,
        weighted: &WeightedEquations,
    ) -> Option<M::State> {
        let WeightedEquations { force, stiffness, upper } = weighted;
        let here = force.norm_squared();
        let (square, slope) = (stiffness.tr_mul(stiffness), stiffness.tr_mul(force));
        let floor = square.diagonal().amax().max(f64::MIN_POSITIVE);
        for _ in 0..MAX_DAMPING_TRIALS {
            let damping = self.damping * floor.max(slope.norm());
            let damped = &square + DMatrix::from_diagonal_element(square.nrows(), square.nrows(), damping);
            let scaled_step = -damped.cholesky()?.solve(&slope);
            let change = upper.solve_upper_triangular(&scaled_step)?;
            let predicted = -(2.0 * slope.dot(&scaled_step) + scaled_step.dot(&(&square * &scaled_step)));
            if predicted <= MIN_RELATIVE_DECREASE * here {
                return None;
            }
            let change = self.step_limit(state, &(&statics.tangent.positions * &change)) * change;
            if let Some(next) = self.moved(state, statics, &change)
                && self.merit(&next).is_some_and(|merit| merit <= here - MIN_GAIN_RATIO * predicted)
            {
                self.damping = (self.damping / 3.0).max(MIN_DAMPING);
                return Some(next);
            }
            self.damping *= 4.0;
        }
        None
    }

    /// For a stalled search that is not in balance, a point nearby with a smaller ‖F‖, in the direction
    /// of the force or of the least stiffness. There may be one although ‖F‖ does not fall to first
    /// order.
    fn probe_nearby(
        &self,
        state: &M::State,
        statics: &Statics<M::Rows>,
        (stiffness, factors): (&DMatrix<f64>, &BalancedSvd),
        change: f64,
    ) -> Option<M::State> {
        let noise = statics.noise(self.model, state).ok()?;
        if self.is_balanced(statics, factors, change, &noise) {
            return None;
        }
        let weighted = self.weighted_equations(statics, stiffness)?;
        let here = weighted.force.norm_squared();
        // Directions: the acceleration first, then those of growing stiffness.
        let acceleration = statics
            .mass
            .clone()
            .cholesky()
            .map(|mass| &statics.tangent.velocities * mass.solve(&-&statics.force));
        let square = weighted.stiffness.tr_mul(&weighted.stiffness).symmetric_eigen();
        let mut order: Vec<usize> = (0..square.eigenvalues.len()).collect();
        order.sort_by(|i, j| square.eigenvalues[*i].total_cmp(&square.eigenvalues[*j]));
        let soft = order.into_iter().filter_map(|k| {
            let along = weighted.upper.solve_upper_triangular(&square.eigenvectors.column(k).into_owned())?;
            Some(&statics.tangent.positions * along)
        });
        // The first point, to either side of one of them, at which ‖F‖ is smaller.
        for direction in acceleration.into_iter().chain(soft) {
            let size = self.relative_change(state, &direction);
            if size <= 0.0 || !size.is_finite() {
                continue;
            }
            for far in STALL_PROBE_DISTANCES.into_iter().flat_map(|far| [far, -far]) {
                let next = self.moved_by(state, &(&direction * (far / size)));
                let is_less = |next: &M::State| {
                    self.merit(next).is_some_and(|merit| merit < here * (1.0 - MIN_PROBE_DECREASE))
                };
                if let Some(next) = next.filter(is_less) {
                    return Some(next);
                }
            }
        }
        None
    }

    /// Whether the residual force is rounding.
    fn is_balanced(
        &self,
        statics: &Statics<M::Rows>,
        factors: &BalancedSvd,
        change: f64,
        noise: &DVector<f64>,
    ) -> bool {
        let rounded = statics
            .force
            .iter()
            .zip(noise.iter())
            .all(|(force, noise)| force.abs() <= FORCE_NOISE_FACTOR * noise);
        // Or the last correction was rounding, and took all of the force.
        let left = &statics.force + &statics.stiffness * factors.solve(&-&statics.force);
        let takes_all = left
            .iter()
            .zip(statics.force.iter())
            .all(|(left, force)| left.abs() <= REMAINING_FORCE_SHARE * force.abs());
        rounded || (takes_all && change <= ROUNDED_CORRECTION)
    }

    /// The equilibrium at a state in balance to rounding, or the reason why there is none.
    fn accept(
        &self,
        state: M::State,
        statics: Statics<M::Rows>,
        factors: &BalancedSvd,
        change: f64,
        iterations: usize,
    ) -> Result<EquilibriumSolution<M>, EquilibriumError> {
        let noise = statics.noise(self.model, &state)?;
        if !self.is_balanced(&statics, factors, change, &noise) {
            let resting = corner::downhill_corner(self.model, &self.constants, &state, &statics)?;
            return Err(resting.unwrap_or_else(|| self.no_equilibrium(&state, &statics)));
        }
        let uncertainty = coordinate_uncertainty(self.model, &state, &statics, factors, &noise)?;
        let uncertainty = statics.tangent.positions.abs() * uncertainty;
        Ok(EquilibriumSolution {
            uncertainty: uncertainty.iter().copied().collect(),
            state,
            statics,
            iterations,
        })
    }

    /// The error at a minimum of ‖F‖ that is not zero.
    fn no_equilibrium(&self, state: &M::State, statics: &Statics<M::Rows>) -> EquilibriumError {
        let (i, force_left) = statics.worst();
        if force_left.abs() < f64::MIN_POSITIVE {
            return EquilibriumError::Faded {
                coordinate: M::COORDINATES[i].name,
                value: state.q().as_slice()[i],
            };
        }
        // The direction of least stiffness.
        let soft = statics.covariant(self.model, state, &self.metric).ok();
        let soft =
            soft.and_then(|stiffness| self.weighted_equations(statics, &stiffness)).and_then(|weighted| {
                let square = weighted.stiffness.tr_mul(&weighted.stiffness).symmetric_eigen();
                let least = square.eigenvectors.column(square.eigenvalues.imin()).into_owned();
                Some((&statics.tangent.positions * weighted.upper.solve_upper_triangular(&least)?).iamax())
            });
        EquilibriumError::NoEquilibrium {
            coordinate: M::COORDINATES[i].name,
            force_left,
            soft: M::COORDINATES[soft.unwrap_or(i)].name,
            at: state.q().as_slice().to_vec(),
        }
    }

    /// The error after too many iterations.
    fn no_convergence(
        &self,
        iterations: usize,
        statics: &Statics<M::Rows>,
        state: &M::State,
    ) -> EquilibriumError {
        let (i, force_left) = statics.worst();
        if force_left.abs() <= RUNAWAY_FORCE_RATIO * self.initial_force {
            return EquilibriumError::Diverged {
                coordinate: M::COORDINATES[i].name,
                value: state.q().as_slice()[i],
            };
        }
        EquilibriumError::NoConvergence { iterations, coordinate: M::COORDINATES[i].name, force_left }
    }

    /// Refuses coordinates that have run away.
    fn check_bounds(&self, state: &M::State) -> Result<(), EquilibriumError> {
        let values = state.q().as_slice().iter().zip(&self.initial_scales);
        let away = |(_, (q, first)): &(usize, (&f64, &f64))| q.abs() > RUNAWAY_RATIO * (1.0 + **first);
        match values.enumerate().find(away) {
            Some((i, (q, _))) => {
                Err(EquilibriumError::Diverged { coordinate: M::COORDINATES[i].name, value: *q })
            }
            None => Ok(()),
        }
    }
}

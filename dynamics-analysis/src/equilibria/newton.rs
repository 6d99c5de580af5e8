//! Newton's method for balance, along the constraints.
//!
//! Each iteration solves K δz = −F with the exact K, moves δq = D δz, and returns to the constraints;
//! the step is halved until ‖F‖ falls as Armijo asks. ‖F‖ is the minimum over λ of the forces,
//! weighted by the inertias at the start, and K is its derivative (`Statics::covariant`). Both belong to the
//! position, not to the choice of independent coordinates. For example, with its height as the coordinate, a
//! pendulum has the same force everywhere, which no Newton step could make smaller. If less than a 32nd of
//! the step is accepted, K is nearly singular and its direction is of little use. A Levenberg–Marquardt
//! step with adaptive damping takes its place (J. Nocedal & S. J. Wright, *Numerical Optimization*, §10.3
//! and §11.2). It converges to the nearest minimum of ‖F‖. If that is not 0, there is no equilibrium,
//! and K is singular there: the load is beyond a fold. If ‖F‖ does not fall to first order, it may be at
//! a maximum, as for a level pendulum. Then points a little beside are tried, first in the direction of the
//! force.
//!
//! Near the end every full step is taken until the corrections no longer shrink: to rounding, whatever the
//! units. Directions in which K vanishes completely (cyclic coordinates) are left alone.

use alloc::vec::Vec;

use dynamics_runtime::constrain::{project_positions, with_workspace};
use dynamics_runtime::error::SolveError;
use dynamics_runtime::model::{Constraints, ModelState, Vector};
use nalgebra::{DMatrix, DVector};

use super::factors::BalancedSvd;
use super::soft::Soft;
use super::statics::{Statics, scales};
use super::{EquilibriumError, corner};
use crate::LinearizeError;

/// Most iterations. Beside a fold, and at a pitchfork, each takes a third to a half of the error; of forces
/// that begin with the fifth power a fifth.
const MOST_ITERATIONS: usize = 500;
/// Corrections that are still this part of the last no longer shrink: those of a ninth power do.
const SETTLED: f64 = 0.9;
/// Corrections from here on, of what coordinates are measured by, are the last ones.
const LAST_CORRECTION: f64 = 1e-7;
/// The smallest part of a Newton step that is worth taking.
const LEAST_PART: f64 = 1.0 / 32.0;
/// A fall of ‖F‖², relative, below which it is the least.
const LEVEL: f64 = 1e-13;
/// Coordinates beyond this many times of what they were measured by have run away.
const AWAY: f64 = 1e12;
/// Forces that became so much smaller in all iterations, and still do, run away.
const FADING: f64 = 1e-12;
/// How far beside a place where ‖F‖ does not fall to first order it is looked at, in what coordinates are
/// measured by, and by which part of it ‖F‖² has to be smaller there.
const STALL_PROBES: [f64; 2] = [1e-3, 1e-2];
const SMALLER: f64 = 1e-10;
/// Forces up to this many times their measured rounding count as balance.
const ROUNDED: f64 = 1e3;

/// Where the search ended.
pub(super) struct Settled<M: Constraints> {
    pub(super) state: M::State,
    pub(super) statics: Statics<M::Rows>,
    pub(super) iterations: usize,
    /// How far each coordinate may be off for the rounding of forces.
    pub(super) uncertainty: Vec<f64>,
}

/// The iteration at one position.
struct NewtonIteration<'m, M: Constraints> {
    model: &'m M,
    constants: M::Constants,
    /// What coordinates of the start are measured by.
    first: Vec<f64>,
    /// Inertias by coordinate: fixed for the run, so that ‖F‖ at different positions can be compared.
    metric: Vec<f64>,
    mu: f64,
    /// The largest force at the start.
    most: f64,
}

/// F and K in unit vectors of the metric: L⁻¹F and L⁻¹K L⁻ᵀ with L Lᵀ = EᵀG E, and Lᵀ of the
/// coordinates.
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

/// How far the independent coordinates may be off for what rounding leaves of F.
fn uncertainty<M: Constraints>(
    model: &M,
    state: &M::State,
    statics: &Statics<M::Rows>,
    factors: &BalancedSvd,
    noise: &DVector<f64>,
) -> Result<DVector<f64>, EquilibriumError> {
    // At folds and pitchforks corrections shrink by a half or a third each: what is left is a few times the
    // last.
    let reach = factors.reach(noise) + 3.0 * factors.solve(&statics.force).abs();
    let soft = Soft { model, state, statics, factors, noise }.reach()?;
    Ok(reach.zip_map(&soft, f64::max))
}

/// How far the independent coordinates of what counts as an equilibrium may be off.
pub(super) fn distance<M: Constraints>(
    model: &M,
    state: &M::State,
    statics: &Statics<M::Rows>,
) -> Result<DVector<f64>, EquilibriumError> {
    let size = statics.stiffness.nrows();
    if size == 0 {
        return Ok(DVector::zeros(statics.stiffness.ncols()));
    }
    let factors = BalancedSvd::of(&statics.stiffness).ok_or(LinearizeError::NoConvergence { size })?;
    uncertainty(model, state, statics, &factors, &statics.noise(model, state)?)
}

/// From a state on the constraints, whose velocities stay.
pub(super) fn settle<M: Constraints>(model: &M, start: M::State) -> Result<Settled<M>, EquilibriumError> {
    let constants = model.constants().map_err(SolveError::from)?;
    let mut state = start;
    let mut statics = Statics::of(model, &state, &[])?;
    let first = scales(M::COORDINATES, state.q().as_slice());
    let most = statics.masses.amax();
    let metric = statics.masses.iter().map(|mass| if *mass > 1e-12 * most { *mass } else { 1.0 }).collect();
    let mut search =
        NewtonIteration { model, constants, first, metric, mu: 1e-3, most: statics.force.amax() };
    let mut last = f64::INFINITY;
    if statics.force.is_empty() {
        // What cannot move rests, whatever acts: its reactions hold it.
        return Ok(Settled { state, statics, iterations: 0, uncertainty: alloc::vec![0.0; M::Vector::LEN] });
    }
    for iteration in 0..MOST_ITERATIONS {
        let stiffness = statics.covariant(model, &state, &search.metric)?;
        let factors =
            BalancedSvd::of(&stiffness).ok_or_else(|| search.unsettled(iteration, &statics, &state))?;
        let newton = factors.solve(&-&statics.force);
        let change = search.relative(&state, &(&statics.tangent.positions * &newton));
        let is_near = change <= LAST_CORRECTION;
        // In the end only what rounding moves is left.
        let ends = is_near && (change <= f64::EPSILON * f64::EPSILON || change > SETTLED * last);
        let next = match is_near {
            true => search.moved(&state, &statics, &newton).filter(|_| !ends),
            false => search.step(&state, &statics, (&stiffness, &newton))?,
        };
        last = if is_near { change } else { f64::INFINITY };
        let Some(next) = next.or_else(|| search.downhill(&state, &statics, (&stiffness, &factors), change))
        else {
            return search.accept(state, statics, &factors, change, iteration);
        };
        state = next;
        search.check_bounds(&state)?;
        statics = Statics::of(model, &state, &[])?;
    }
    Err(search.unsettled(MOST_ITERATIONS, &statics, &state))
}

impl<M: Constraints> NewtonIteration<'_, M> {
    fn weighed(&self, statics: &Statics<M::Rows>, stiffness: &DMatrix<f64>) -> Option<WeightedEquations> {
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

    /// The largest change of a coordinate against what it is measured by.
    fn relative(&self, state: &M::State, change: &DVector<f64>) -> f64 {
        let scales = scales(M::COORDINATES, state.q().as_slice());
        change.iter().zip(scales).fold(0.0, |most, (d, scale)| most.max(d.abs() / scale))
    }

    /// The position after a change of the independent coordinates; `None` where the constraints cannot be
    /// followed that far.
    fn moved(&self, state: &M::State, statics: &Statics<M::Rows>, change: &DVector<f64>) -> Option<M::State> {
        self.moved_by(state, &(&statics.tangent.positions * change))
    }

    /// As [`Self::moved`], after a step of all coordinates.
    fn moved_by(&self, state: &M::State, step: &DVector<f64>) -> Option<M::State> {
        let mut next = *state;
        next.q_mut().as_mut_slice().iter_mut().zip(step.iter()).for_each(|(q, d)| *q += d);
        let taken = with_workspace::<M, _>(|memory| {
            project_positions(self.model, &self.constants, &mut next, memory)
        });
        let taken = taken.ok()?;
        let size = scales(M::COORDINATES, state.q().as_slice()).into_iter().fold(0.0, f64::max);
        // A way back that is as long as the step leads to another branch.
        (taken.change <= 0.5 * step.amax() + 1e-6 * size && next.q().as_slice().iter().all(|q| q.is_finite()))
            .then_some(next)
    }

    /// ‖F‖² after a change.
    fn merit(&self, next: &M::State) -> Option<f64> {
        let there = Statics::of(self.model, next, &[]).ok()?;
        let force = lower(&self.metric, &there.tangent.velocities)?.solve_lower_triangular(&there.force)?;
        Some(force.norm_squared()).filter(|merit| merit.is_finite())
    }

    /// The next position; `None` where ‖F‖ is the least nearby.
    fn step(
        &mut self,
        state: &M::State,
        statics: &Statics<M::Rows>,
        (stiffness, newton): (&DMatrix<f64>, &DVector<f64>),
    ) -> Result<Option<M::State>, EquilibriumError> {
        let weighed = self.weighed(statics, stiffness).ok_or(LinearizeError::Inertia)?;
        let here = weighed.force.norm_squared();
        let mut part = self.bound(state, &(&statics.tangent.positions * newton));
        let least = LEAST_PART * part;
        while part >= least {
            if let Some(next) = self.moved(state, statics, &(part * newton))
                && self.merit(&next).is_some_and(|merit| merit <= (1.0 - 2e-4 * part) * here)
            {
                return Ok(Some(next));
            }
            part *= 0.5;
        }
        Ok(self.damped(state, statics, &weighed))
    }

    /// At most 1 rad of angles, at most ten times what other coordinates are measured by.
    fn bound(&self, state: &M::State, change: &DVector<f64>) -> f64 {
        let scales = scales(M::COORDINATES, state.q().as_slice());
        let allowed = M::COORDINATES
            .iter()
            .zip(scales)
            .map(|(q, scale)| if q.unit == "rad" { 1.0 } else { 10.0 * scale });
        change.iter().zip(allowed).fold(1.0, |part: f64, (d, allowed)| part.min(allowed / d.abs()))
    }

    /// A Levenberg–Marquardt step; `None` where none makes ‖F‖ smaller by more than rounding.
    fn damped(
        &mut self,
        state: &M::State,
        statics: &Statics<M::Rows>,
        weighed: &WeightedEquations,
    ) -> Option<M::State> {
        let WeightedEquations { force, stiffness, upper } = weighed;
        let here = force.norm_squared();
        let (square, slope) = (stiffness.tr_mul(stiffness), stiffness.tr_mul(force));
        let floor = square.diagonal().amax().max(f64::MIN_POSITIVE);
        for _ in 0..80 {
            let damping = self.mu * floor.max(slope.norm());
            let damped = &square + DMatrix::from_diagonal_element(square.nrows(), square.nrows(), damping);
            let scaled_step = -damped.cholesky()?.solve(&slope);
            let change = upper.solve_upper_triangular(&scaled_step)?;
            let predicted = -(2.0 * slope.dot(&scaled_step) + scaled_step.dot(&(&square * &scaled_step)));
            if predicted <= LEVEL * here {
                return None;
            }
            let change = self.bound(state, &(&statics.tangent.positions * &change)) * change;
            if let Some(next) = self.moved(state, statics, &change)
                && self.merit(&next).is_some_and(|merit| merit <= here - 1e-3 * predicted)
            {
                self.mu = (self.mu / 3.0).max(1e-12);
                return Some(next);
            }
            self.mu *= 4.0;
        }
        None
    }

    /// A point near one that is not in balance, at which ‖F‖ is smaller although it does not fall to
    /// first order: in the direction of the force, or of the least stiffness.
    fn downhill(
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
        let weighed = self.weighed(statics, stiffness)?;
        let here = weighed.force.norm_squared();
        let falls = statics
            .mass
            .clone()
            .cholesky()
            .map(|mass| &statics.tangent.velocities * mass.solve(&-&statics.force));
        let square = weighed.stiffness.tr_mul(&weighed.stiffness).symmetric_eigen();
        let mut order: Vec<usize> = (0..square.eigenvalues.len()).collect();
        order.sort_by(|i, j| square.eigenvalues[*i].total_cmp(&square.eigenvalues[*j]));
        let soft = order.into_iter().filter_map(|k| {
            let along = weighed.upper.solve_upper_triangular(&square.eigenvectors.column(k).into_owned())?;
            Some(&statics.tangent.positions * along)
        });
        for way in falls.into_iter().chain(soft) {
            let size = self.relative(state, &way);
            if size <= 0.0 || !size.is_finite() {
                continue;
            }
            for far in STALL_PROBES.into_iter().flat_map(|far| [far, -far]) {
                let next = self.moved_by(state, &(&way * (far / size)));
                let is_less =
                    |next: &M::State| self.merit(next).is_some_and(|merit| merit < here * (1.0 - SMALLER));
                if let Some(next) = next.filter(is_less) {
                    return Some(next);
                }
            }
        }
        None
    }

    /// Whether what is left of forces is rounding.
    fn is_balanced(
        &self,
        statics: &Statics<M::Rows>,
        factors: &BalancedSvd,
        change: f64,
        noise: &DVector<f64>,
    ) -> bool {
        let rounded =
            statics.force.iter().zip(noise.iter()).all(|(force, noise)| force.abs() <= ROUNDED * noise);
        // Or the last correction was rounding, and took all of the force: nothing of it acts where nothing
        // resists.
        let left = &statics.force + &statics.stiffness * factors.solve(&-&statics.force);
        let gone =
            left.iter().zip(statics.force.iter()).all(|(left, force)| left.abs() <= 1e-6 * force.abs());
        rounded || (gone && change <= 1e-11)
    }

    /// What is in balance to rounding is an equilibrium.
    fn accept(
        &self,
        state: M::State,
        statics: Statics<M::Rows>,
        factors: &BalancedSvd,
        change: f64,
        iterations: usize,
    ) -> Result<Settled<M>, EquilibriumError> {
        let noise = statics.noise(self.model, &state)?;
        if !self.is_balanced(&statics, factors, change, &noise) {
            let resting = corner::beside(self.model, &self.constants, &state, &statics)?;
            return Err(resting.unwrap_or_else(|| self.none(&state, &statics)));
        }
        let reach = uncertainty(self.model, &state, &statics, factors, &noise)?;
        let reach = statics.tangent.positions.abs() * reach;
        Ok(Settled { uncertainty: reach.iter().copied().collect(), state, statics, iterations })
    }

    /// Where ‖F‖ is the least.
    fn none(&self, state: &M::State, statics: &Statics<M::Rows>) -> EquilibriumError {
        let (i, force_left) = statics.worst();
        if force_left.abs() < f64::MIN_POSITIVE {
            return EquilibriumError::Faded {
                coordinate: M::COORDINATES[i].name,
                value: state.q().as_slice()[i],
            };
        }
        // The direction that K resists least.
        let soft = statics.covariant(self.model, state, &self.metric).ok();
        let soft = soft.and_then(|stiffness| self.weighed(statics, &stiffness)).and_then(|weighed| {
            let square = weighed.stiffness.tr_mul(&weighed.stiffness).symmetric_eigen();
            let least = square.eigenvectors.column(square.eigenvalues.imin()).into_owned();
            Some((&statics.tangent.positions * weighed.upper.solve_upper_triangular(&least)?).iamax())
        });
        EquilibriumError::NoEquilibrium {
            coordinate: M::COORDINATES[i].name,
            force_left,
            soft: M::COORDINATES[soft.unwrap_or(i)].name,
            at: state.q().as_slice().to_vec(),
        }
    }

    fn unsettled(&self, iterations: usize, statics: &Statics<M::Rows>, state: &M::State) -> EquilibriumError {
        let (i, force_left) = statics.worst();
        if force_left.abs() <= FADING * self.most {
            return EquilibriumError::Diverged {
                coordinate: M::COORDINATES[i].name,
                value: state.q().as_slice()[i],
            };
        }
        EquilibriumError::NoConvergence { iterations, coordinate: M::COORDINATES[i].name, force_left }
    }

    fn check_bounds(&self, state: &M::State) -> Result<(), EquilibriumError> {
        let values = state.q().as_slice().iter().zip(&self.first);
        let away = |(_, (q, first)): &(usize, (&f64, &f64))| q.abs() > AWAY * (1.0 + **first);
        match values.enumerate().find(away) {
            Some((i, (q, _))) => {
                Err(EquilibriumError::Diverged { coordinate: M::COORDINATES[i].name, value: *q })
            }
            None => Ok(()),
        }
    }
}

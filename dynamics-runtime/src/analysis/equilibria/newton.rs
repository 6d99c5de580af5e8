//! Newton's method for balance, along the constraints.
//!
//! Each iteration solves K δz = −F with the exact K, moves δq = D δz, and returns to the constraints; the step is halved until ‖F‖, forces weighed by the
//! inertias that they move, falls as Armijo asks. Where less than a 32nd of the step is admitted, K is nearly singular and the direction worth little: a
//! Levenberg–Marquardt step, whose damping is adapted, takes its place (J. Nocedal & S. J. Wright, *Numerical Optimization*, §10.3 and §11.2). It goes on to
//! the least ‖F‖ nearby; if that is not 0 there is no equilibrium, and K has lost a direction there: a fold lies between it and the load.
//!
//! Near the end every full step is taken until the corrections no longer shrink: to rounding, whatever the units. Directions in which K vanishes altogether
//! (coordinates on which nothing depends) are left alone.

use alloc::vec::Vec;

use nalgebra::{DMatrix, DVector, SVD};

use super::EquilibriumError;
use super::statics::{Statics, scales};
use crate::analysis::LinearizeError;
use crate::constrain::{project_positions, with_workspace};
use crate::error::SolveError;
use crate::model::{Constraints, ModelState, Vector};

/// Most iterations. Beside a fold, and at a pitchfork, each takes a third to a half of the error.
const MOST: usize = 300;
/// Corrections from here on, of what coordinates are measured by, are the last ones.
const NEAR: f64 = 1e-7;
/// The smallest part of a Newton step that is worth taking.
const LEAST_PART: f64 = 1.0 / 32.0;
/// A fall of ‖F‖², relative, below which it is the least.
const LEVEL: f64 = 1e-13;
/// Coordinates beyond this many times of what they were measured by have run away.
const AWAY: f64 = 1e12;
/// Singular values of the balanced K below this, against the largest, are zero.
pub(super) const VANISHED: f64 = 1e-13;
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

/// K = R⁻¹ (U Σ Vᵀ) C⁻¹ with rows and columns balanced, so that what is soft is not lost beside what is stiff.
struct Factors {
    rows: DVector<f64>,
    columns: DVector<f64>,
    svd: SVD<f64, nalgebra::Dyn, nalgebra::Dyn>,
}

impl Factors {
    fn of(k: &DMatrix<f64>) -> Option<Self> {
        let inverse = |most: f64| if most > 0.0 { 1.0 / most } else { 1.0 };
        let rows = DVector::from_iterator(k.nrows(), k.row_iter().map(|row| inverse(row.amax())));
        let mut balanced = DMatrix::from_diagonal(&rows) * k;
        let columns = DVector::from_iterator(k.ncols(), balanced.column_iter().map(|column| inverse(column.amax())));
        balanced.column_iter_mut().zip(columns.iter()).for_each(|(mut column, c)| column *= *c);
        let svd = SVD::try_new(balanced, true, true, f64::EPSILON, 300 * (k.nrows() + k.ncols()))?;
        Some(Self { rows, columns, svd })
    }

    /// δz of least size with K δz = `right`, where directions that vanish stand still.
    fn solve(&self, right: &DVector<f64>) -> DVector<f64> {
        let (Some(u), Some(v_t)) = (&self.svd.u, &self.svd.v_t) else { return DVector::zeros(self.columns.len()) };
        let along = u.tr_mul(&right.component_mul(&self.rows));
        let least = VANISHED * self.svd.singular_values.amax();
        let sigma = &self.svd.singular_values;
        let scaled = along.zip_map(sigma, |x, sigma| if sigma > least { x / sigma } else { 0.0 });
        v_t.tr_mul(&scaled).component_mul(&self.columns)
    }

    /// The largest |δz| that forces of these sizes could cause, along directions that do not vanish.
    fn reach(&self, forces: &DVector<f64>) -> DVector<f64> {
        let (Some(u), Some(v_t)) = (&self.svd.u, &self.svd.v_t) else { return DVector::zeros(self.columns.len()) };
        let along = u.abs().tr_mul(&forces.component_mul(&self.rows));
        let least = VANISHED * self.svd.singular_values.amax();
        let scaled = along.zip_map(&self.svd.singular_values, |x, s| if s > least { x / s } else { 0.0 });
        v_t.abs().tr_mul(&scaled).component_mul(&self.columns)
    }
}

/// The iteration at one position.
struct Search<'m, M: Constraints> {
    model: &'m M,
    constants: M::Constants,
    /// What coordinates of the start are measured by.
    first: Vec<f64>,
    /// 1/√inertia of forces, by coordinate: fixed for the run, so that ‖F‖ at different positions can be compared.
    weights: Vec<f64>,
    mu: f64,
}

/// What rounding leaves of F, and how far the independent coordinates may be off for it.
fn uncertainty<M: Constraints>(
    model: &M,
    state: &M::State,
    statics: &Statics<M::Rows>,
    factors: &Factors,
) -> Result<(DVector<f64>, DVector<f64>), EquilibriumError> {
    let noise = statics.noise(model, state)?;
    // At folds and pitchforks corrections shrink by a half or a third each: what is left is a few times the last.
    let reach = factors.reach(&noise) + 3.0 * factors.solve(&statics.force).abs();
    Ok((noise, reach))
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
    let factors = Factors::of(&statics.stiffness).ok_or(LinearizeError::NoConvergence { size })?;
    Ok(uncertainty(model, state, statics, &factors)?.1)
}

/// From a state on the constraints, whose velocities stay.
pub(super) fn settle<M: Constraints>(model: &M, start: M::State) -> Result<Settled<M>, EquilibriumError> {
    let constants = model.constants().map_err(SolveError::from)?;
    let mut state = start;
    let mut statics = Statics::of(model, &state, &[])?;
    let first = scales(M::COORDINATES, state.q().as_slice());
    let mut search = Search { model, constants, first, weights: alloc::vec![0.0; M::Vector::LEN], mu: 1e-3 };
    let mut last = f64::INFINITY;
    if statics.force.is_empty() {
        // What cannot move rests, whatever acts: its reactions hold it.
        return Ok(Settled { state, statics, iterations: 0, uncertainty: alloc::vec![0.0; M::Vector::LEN] });
    }
    for iteration in 0..MOST {
        search.weigh(&statics);
        let factors = Factors::of(&statics.stiffness).ok_or_else(|| search.unsettled(iteration, &statics))?;
        let newton = factors.solve(&-&statics.force);
        let change = search.relative(&state, &(&statics.tangent.positions * &newton));
        if change <= NEAR {
            // In the end only what rounding moves is left.
            if change <= f64::EPSILON * f64::EPSILON || change > 0.8 * last {
                return search.accept(state, statics, &factors, change, iteration);
            }
            let Some(next) = search.moved(&state, &statics, &newton) else {
                return search.accept(state, statics, &factors, change, iteration);
            };
            last = change;
            statics = Statics::of(model, &next, &[])?;
            state = next;
            continue;
        }
        last = f64::INFINITY;
        match search.step(&state, &statics, &newton)? {
            Some(next) => {
                state = next;
                search.check_bounds(&state)?;
                statics = Statics::of(model, &state, &[])?;
            }
            None => return search.accept(state, statics, &factors, change, iteration),
        }
    }
    Err(search.unsettled(MOST, &statics))
}

impl<M: Constraints> Search<'_, M> {
    /// Coordinates keep the weight that they had when they were first independent.
    fn weigh(&mut self, statics: &Statics<M::Rows>) {
        let most = statics.inertia.amax();
        for (i, inertia) in statics.tangent.rates.iter().zip(statics.inertia.iter()) {
            let weight = &mut self.weights[*i];
            if *weight == 0.0 {
                *weight = if *inertia > 1e-12 * most { 1.0 / inertia.sqrt() } else { 1.0 };
            }
        }
    }

    /// The weights of these coordinates.
    fn weights(&self, of: &[usize]) -> DVector<f64> {
        let weight = |i: &usize| if self.weights[*i] > 0.0 { self.weights[*i] } else { 1.0 };
        DVector::from_iterator(of.len(), of.iter().map(weight))
    }

    fn weighed(&self, statics: &Statics<M::Rows>) -> DVector<f64> {
        self.weights(&statics.tangent.rates).component_mul(&statics.force)
    }

    /// K of weighed forces by weighed coordinates, 1/s², and the weights of the coordinates.
    fn weighed_stiffness(&self, statics: &Statics<M::Rows>) -> (DMatrix<f64>, DVector<f64>) {
        let rows = DMatrix::from_diagonal(&self.weights(&statics.tangent.rates));
        let columns = self.weights(&statics.tangent.coordinates);
        (rows * &statics.stiffness * DMatrix::from_diagonal(&columns), columns)
    }

    /// The largest change of a coordinate against what it is measured by.
    fn relative(&self, state: &M::State, change: &DVector<f64>) -> f64 {
        let scales = scales(M::COORDINATES, state.q().as_slice());
        change.iter().zip(scales).fold(0.0, |most, (d, scale)| most.max(d.abs() / scale))
    }

    /// The position after a change of the independent coordinates; `None` where the constraints cannot be followed that far.
    fn moved(&self, state: &M::State, statics: &Statics<M::Rows>, change: &DVector<f64>) -> Option<M::State> {
        let mut next = *state;
        let step = &statics.tangent.positions * change;
        next.q_mut().as_mut_slice().iter_mut().zip(step.iter()).for_each(|(q, d)| *q += d);
        let taken = with_workspace::<M, _>(|memory| project_positions(self.model, &self.constants, &mut next, memory));
        let taken = taken.ok()?;
        let size = scales(M::COORDINATES, state.q().as_slice()).into_iter().fold(0.0, f64::max);
        // A way back that is as long as the step leads to another branch.
        (taken.change <= 0.5 * step.amax() + 1e-6 * size && next.q().as_slice().iter().all(|q| q.is_finite()))
            .then_some(next)
    }

    /// ‖F‖² after a change, in the same independent coordinates.
    fn merit(&self, next: &M::State, statics: &Statics<M::Rows>) -> Option<f64> {
        let there = Statics::of(self.model, next, &statics.tangent.coordinates).ok()?;
        Some(self.weighed(&there).norm_squared()).filter(|merit| merit.is_finite())
    }

    /// The next position; `None` where ‖F‖ is the least nearby.
    fn step(
        &mut self,
        state: &M::State,
        statics: &Statics<M::Rows>,
        newton: &DVector<f64>,
    ) -> Result<Option<M::State>, EquilibriumError> {
        let here = self.weighed(statics).norm_squared();
        let mut part = self.bound(state, &(&statics.tangent.positions * newton));
        let least = LEAST_PART * part;
        while part >= least {
            if let Some(next) = self.moved(state, statics, &(part * newton))
                && self.merit(&next, statics).is_some_and(|merit| merit <= (1.0 - 2e-4 * part) * here)
            {
                return Ok(Some(next));
            }
            part *= 0.5;
        }
        Ok(self.damped(state, statics, here))
    }

    /// At most 1 rad of angles, at most ten times what other coordinates are measured by.
    fn bound(&self, state: &M::State, change: &DVector<f64>) -> f64 {
        let scales = scales(M::COORDINATES, state.q().as_slice());
        let allowed =
            M::COORDINATES.iter().zip(scales).map(|(q, scale)| if q.unit == "rad" { 1.0 } else { 10.0 * scale });
        change.iter().zip(allowed).fold(1.0, |part: f64, (d, allowed)| part.min(allowed / d.abs()))
    }

    /// A Levenberg–Marquardt step; `None` where none makes ‖F‖ smaller by more than rounding.
    fn damped(&mut self, state: &M::State, statics: &Statics<M::Rows>, here: f64) -> Option<M::State> {
        let force = self.weighed(statics);
        let (scaled, columns) = self.weighed_stiffness(statics);
        let (square, slope) = (scaled.tr_mul(&scaled), scaled.tr_mul(&force));
        let floor = square.diagonal().amax().max(f64::MIN_POSITIVE);
        for _ in 0..80 {
            let damping = self.mu * floor.max(slope.norm());
            let damped = &square + DMatrix::from_diagonal_element(square.nrows(), square.nrows(), damping);
            let scaled_step = -damped.cholesky()?.solve(&slope);
            let change = scaled_step.component_mul(&columns);
            let predicted = -(2.0 * slope.dot(&scaled_step) + scaled_step.dot(&(&square * &scaled_step)));
            if predicted <= LEVEL * here {
                return None;
            }
            let change = self.bound(state, &(&statics.tangent.positions * &change)) * change;
            if let Some(next) = self.moved(state, statics, &change)
                && self.merit(&next, statics).is_some_and(|merit| merit <= here - 1e-3 * predicted)
            {
                self.mu = (self.mu / 3.0).max(1e-12);
                return Some(next);
            }
            self.mu *= 4.0;
        }
        None
    }

    /// What is in balance to rounding is an equilibrium.
    fn accept(
        &self,
        state: M::State,
        statics: Statics<M::Rows>,
        factors: &Factors,
        change: f64,
        iterations: usize,
    ) -> Result<Settled<M>, EquilibriumError> {
        let (noise, reach) = uncertainty(self.model, &state, &statics, factors)?;
        let rounded = statics.force.iter().zip(noise.iter()).all(|(force, noise)| force.abs() <= ROUNDED * noise);
        // Or the last correction was rounding, and took all of the force: nothing of it acts where nothing resists.
        let left = &statics.force + &statics.stiffness * factors.solve(&-&statics.force);
        let gone = left.iter().zip(statics.force.iter()).all(|(left, force)| left.abs() <= 1e-6 * force.abs());
        let balanced = rounded || (gone && change <= 1e-11);
        if !balanced {
            return Err(self.none(&state, &statics));
        }
        let reach = statics.tangent.positions.abs() * reach;
        Ok(Settled { uncertainty: reach.iter().copied().collect(), state, statics, iterations })
    }

    /// Where ‖F‖ is the least.
    fn none(&self, state: &M::State, statics: &Statics<M::Rows>) -> EquilibriumError {
        let (i, force_left) = statics.worst();
        // The direction that K resists least.
        let (scaled, columns) = self.weighed_stiffness(statics);
        let square = scaled.tr_mul(&scaled).symmetric_eigen();
        let soft = (!square.eigenvalues.is_empty()).then(|| {
            let least = square.eigenvectors.column(square.eigenvalues.imin()).component_mul(&columns);
            (&statics.tangent.positions * least).iamax()
        });
        EquilibriumError::NoEquilibrium {
            coordinate: M::COORDINATES[i].name,
            force_left,
            soft: M::COORDINATES[soft.unwrap_or(i)].name,
            at: state.q().as_slice().to_vec(),
        }
    }

    fn unsettled(&self, iterations: usize, statics: &Statics<M::Rows>) -> EquilibriumError {
        let (i, force_left) = statics.worst();
        EquilibriumError::NoConvergence { iterations, coordinate: M::COORDINATES[i].name, force_left }
    }

    fn check_bounds(&self, state: &M::State) -> Result<(), EquilibriumError> {
        let values = state.q().as_slice().iter().zip(&self.first);
        let away = |(_, (q, first)): &(usize, (&f64, &f64))| q.abs() > AWAY * (1.0 + **first);
        match values.enumerate().find(away) {
            Some((i, (q, _))) => Err(EquilibriumError::Diverged { coordinate: M::COORDINATES[i].name, value: *q }),
            None => Ok(()),
        }
    }
}

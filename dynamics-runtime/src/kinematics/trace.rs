//! Following the position of a driven mechanism through time.
//!
//! Predictor: Taylor's series from q, q̇, q̈, whose error is h³/6 q⃛. Corrector: Newton–Raphson on
//! Φ(q, t) = 0. A step is accepted where three conditions hold: Newton's method contracts well from the
//! prediction (Θ = ‖δ₁‖/‖δ₀‖ ≤ ¼, so that the solution is the only one nearby); no singular
//! position can lie between (see [`super::jacobian_svd::JacobianSvd::has_full_rank_toward`]); and the way
//! back leads to the start. So branches are not lost, and singular positions are approached in ever shorter
//! steps instead of being passed over. The step size follows from Θ ∼ h³. Source: P. Deuflhard, Newton
//! Methods for Nonlinear Problems, Springer 2004, §5.1; E. J. Haug, Computer Aided Kinematics and Dynamics,
//! Allyn & Bacon 1989, §4.5.

use alloc::vec;
use alloc::vec::Vec;

use super::error::KinematicsErrorKind as Kind;
use super::jacobian_svd::{JacobianSvd, PathScaling};
use crate::constrain;
use crate::constrain::nearby::at_time;
use crate::error::SolveError;
use crate::math;
use crate::model::{Constraints, Model, ModelState, Vector};

/// Largest contraction Θ of an accepted step.
const MAX_CONTRACTION: f64 = 0.25;
/// Contraction that the step size aims at: Newton's method then needs three corrections.
const TARGET_CONTRACTION: f64 = 0.02;
/// Largest first correction of an accepted step, in parts of the size of the coordinates.
const MAX_FIRST_CORRECTION: f64 = 0.1;
/// Taylor's series from the end of an accepted step leads back to its start within this part of its length,
/// or within [`SHORT_WAY`].
const RETURN_SHARE: f64 = 0.25;
/// Steps below this part of the unit of the coordinates are too short for that test: drives begin from rest,
/// for example as t⁴.
const SHORT_WAY: f64 = 1e-3;
/// Corrections below this part of the size of the coordinates end the iteration: the next one would be of the
/// order of their square, which is rounding.
const CONVERGED_CORRECTION: f64 = 1e-11;
/// Most Newton corrections in a step.
const MAX_CORRECTIONS: u32 = 12;

/// A point of the path.
pub(super) struct PathPoint<M: Model> {
    pub(super) state: M::State,
    pub(super) accelerations: M::Vector,
    pub(super) svd: JacobianSvd,
}

// By hand, because a derive would ask the same of the model.
impl<M: Model> Clone for PathPoint<M> {
    fn clone(&self) -> Self {
        Self { state: self.state, accelerations: self.accelerations, svd: self.svd.clone() }
    }
}

/// Counts of steps and corrections.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct PathCounts {
    pub(super) steps: u64,
    pub(super) rejected: u64,
    pub(super) corrections: u64,
}

pub(super) struct PathTracer<'m, M: Constraints> {
    pub(super) model: &'m M,
    pub(super) constants: &'m M::Constants,
    pub(super) scaling: PathScaling,
    pub(super) workspace: Vec<f64>,
    pub(super) counts: PathCounts,
}

impl<'m, M: Constraints> PathTracer<'m, M> {
    pub(super) fn new(model: &'m M, constants: &'m M::Constants, scaling: PathScaling) -> Self {
        let workspace = vec![0.0; constrain::workspace_len(M::Vector::LEN, M::Rows::LEN)];
        Self { model, constants, scaling, workspace, counts: PathCounts::default() }
    }

    /// Velocities, accelerations and the Jacobian at a position that fulfils the constraints; `state` comes
    /// with predicted velocities, `before` is the frame of a point nearby.
    pub(super) fn complete(
        &mut self,
        mut state: M::State,
        before: Option<&JacobianSvd>,
    ) -> Result<PathPoint<M>, Kind> {
        let mut right = self.model.velocity_residual(&state);
        negate(&mut right);
        let change = constrain::correct(self.model, self.constants, &state, &right, &mut self.workspace)?;
        add(state.u_mut(), 1.0, &change);
        let accelerations = constrain::solve_driven(self.model, self.constants, &state, &mut self.workspace)?;
        let not_finite = |row: usize| Kind::Solve(SolveError::ConstraintNotFinite { row: M::ROWS[row].name });
        let svd = match before {
            Some(before) => before.next(&self.scaling, self.model, &state),
            None => JacobianSvd::new(&self.scaling, self.model, &state),
        };
        let svd = svd.map_err(not_finite)?;
        Ok(PathPoint { state, accelerations, svd })
    }

    /// Taylor's prediction at another time.
    pub(super) fn predict(from: &PathPoint<M>, t: f64) -> M::State {
        let mut state = from.state;
        let h = t - from.state.t();
        let (mut q, mut u) = (*state.q(), *state.u());
        add(&mut q, h, &u);
        add(&mut q, 0.5 * h * h, &from.accelerations);
        add(&mut u, h, &from.accelerations);
        *state.q_mut() = q;
        *state.u_mut() = u;
        at_time(&state, t)
    }

    /// Newton–Raphson on Φ = 0. Returns the largest contraction, or an error where it does not converge to
    /// the nearby solution.
    pub(super) fn solve_positions(&mut self, state: &mut M::State) -> Result<f64, Kind> {
        let scale = self.scaling.scale(state.q().as_slice());
        let (mut last, mut contraction) = (f64::INFINITY, 0.0f64);
        for k in 0..MAX_CORRECTIONS {
            let right = self.right(state)?;
            let step = constrain::correct(self.model, self.constants, state, &right, &mut self.workspace)?;
            self.counts.corrections += 1;
            let length = self.scaling.length(step.as_slice()) / scale;
            let theta = length / last;
            let longest = if k == 0 { MAX_FIRST_CORRECTION } else { MAX_CONTRACTION * last };
            if length.is_nan() || length > longest {
                // At the level of rounding corrections do not shrink any more.
                return if last <= 1e-9 { Ok(contraction) } else { Err(self.no_continuation(state)) };
            }
            add(state.q_mut(), 1.0, &step);
            // Contractions of rounding-level corrections say nothing about curvature.
            contraction = if k > 0 && last > 1e-6 { contraction.max(theta) } else { contraction };
            if length <= CONVERGED_CORRECTION {
                return Ok(contraction);
            }
            last = length;
        }
        Err(self.no_continuation(state))
    }

    /// A step to another time. Where it fails a shorter one may succeed.
    pub(super) fn step(&mut self, from: &PathPoint<M>, t: f64) -> Result<(PathPoint<M>, f64), Kind> {
        let mut state = Self::predict(from, t);
        let contraction = self.solve_positions(&mut state)?;
        let jacobian = self.scaling.jacobian(self.model, &state, &from.svd.scales);
        if !from.svd.has_full_rank_toward(&jacobian) {
            return Err(self.no_continuation(&state));
        }
        let point = self.complete(state, Some(&from.svd))?;
        if !self.leads_back(&point, &from.state) {
            return Err(self.no_continuation(&point.state));
        }
        Ok((point, contraction))
    }

    /// Whether Taylor's series from the end of a step leads back to its start. Near a singular position
    /// angles turn fast, and a prediction may reach the same position some turns further. All constraints
    /// hold there, and only this test shows that the turns were not made.
    fn leads_back(&self, to: &PathPoint<M>, from: &M::State) -> bool {
        let mut missed = *Self::predict(to, from.t()).q();
        add(&mut missed, -1.0, from.q());
        let mut way = *to.state.q();
        add(&mut way, -1.0, from.q());
        let length = |x: &M::Vector| self.scaling.length(x.as_slice());
        let unit = self.scaling.scale(M::Vector::zeros().as_slice());
        length(&missed) <= RETURN_SHARE * length(&way) + SHORT_WAY * unit
    }

    /// The factor by which the next step may be longer.
    pub(super) fn growth(contraction: f64) -> f64 {
        math::cbrt(TARGET_CONTRACTION / contraction.max(1e-9)).clamp(0.5, 2.0)
    }

    fn right(&self, state: &M::State) -> Result<M::Rows, Kind> {
        let mut right = M::Rows::zeros();
        let values = self.model.residual(state);
        for row in &self.scaling.rows {
            right[*row] = -values[*row];
            if !values[*row].is_finite() {
                return Err(Kind::Solve(SolveError::ConstraintNotFinite { row: M::ROWS[*row].name }));
            }
        }
        Ok(right)
    }

    fn no_continuation(&self, state: &M::State) -> Kind {
        let values = self.model.residual(state);
        let size = |row: &usize| values[*row].abs();
        let worst_condition =
            self.scaling.rows.iter().copied().reduce(|a, b| if size(&b) > size(&a) { b } else { a });
        let row = worst_condition.unwrap_or(0);
        Kind::NoContinuation { row: M::ROWS[row].name, residual: values[row] }
    }
}

fn negate<V: Vector>(values: &mut V) {
    values.as_mut_slice().iter_mut().for_each(|x| *x = -*x);
}

pub(super) fn add<V: Vector>(to: &mut V, factor: f64, more: &V) {
    for i in 0..V::LEN {
        to[i] += factor * more[i];
    }
}

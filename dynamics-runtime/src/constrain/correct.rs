//! Corrections that constraints call for: Baumgarte's terms, and what projections and impacts are made of.

use super::{DiagnosedAccelerations, FactoredEquations, accelerate, holds, solve_with_correction};
use crate::error::SolveError;
use crate::linalg::add;
use crate::model::{Constraints, Model, ModelState, Vector};

/// δ with M δ = Φ_qᵀ μ for some μ, Φ_q δ = `right`: the change of least M-norm that the constraints can make.
///
/// Where constraints repeat each other, `right` is met as well as it can be, by least squares: whoever
/// corrects says what is left over.
///
/// # Errors
/// As [`super::solve`], without contradictions.
pub fn correct<M: Constraints>(
    model: &M,
    constants: &M::Constants,
    state: &M::State,
    right: &M::Rows,
    workspace: &mut [f64],
) -> Result<M::Vector, SolveError> {
    if let Some(delta) = model.correct_unrolled(constants, state, right) {
        return Ok(delta);
    }
    let modes = state.modes();
    let correction = correct_rows(model, state, right, &|row| holds::<M>(modes, row), workspace)?;
    Ok(correction.change)
}

/// A change of coordinates or velocities that the constraints make, and what they take to make it.
pub(super) struct ConstraintCorrection<V, R> {
    /// δ.
    pub(super) change: V,
    /// μ with M δ = Φ_qᵀ μ: impulses, where velocities change.
    pub(super) impulses: R,
}

/// A correction of a model.
pub(super) type CorrectionOf<M> = ConstraintCorrection<<M as Model>::Vector, <M as Constraints>::Rows>;

impl<V: Vector, R: Vector> ConstraintCorrection<V, R> {
    pub(super) fn none() -> Self {
        Self { change: V::zeros(), impulses: R::zeros() }
    }

    /// Where M is not finite.
    pub(super) fn undefined() -> Self {
        let mut correction = Self::none();
        correction.change.as_mut_slice().fill(f64::NAN);
        correction.impulses.as_mut_slice().fill(f64::NAN);
        correction
    }
}

/// [`correct`] by the general solver, for the rows that `active` admits.
pub(super) fn correct_rows<M: Constraints>(
    model: &M,
    state: &M::State,
    right: &M::Rows,
    active: &dyn Fn(usize) -> bool,
    workspace: &mut [f64],
) -> Result<CorrectionOf<M>, SolveError> {
    let Some(mut factored) = FactoredEquations::new(model, state, active, false, workspace)? else {
        return Ok(ConstraintCorrection::undefined());
    };
    // A state on the constraints is on all of them, as near as rounding lets it be.
    factored.system.ignore_redundancy();
    let mut correction = ConstraintCorrection::none();
    let ConstraintCorrection { change, impulses }: &mut CorrectionOf<M> = &mut correction;
    let _left_over = factored.system.solve(
        factored.force,
        right.as_slice(),
        change.as_mut_slice(),
        impulses.as_mut_slice(),
    );
    Ok(correction)
}

/// q̈ with Baumgarte's stabilisation: Φ_q q̈ = γ − 2αΦ̇ − β²Φ; for rows A q̇ + b, which have no Φ, γ − 2α(A
/// q̇ + b).
///
/// Drift then obeys Φ̈ + 2αΦ̇ + β²Φ = 0: with α = β it decays as (1 + αt)e^{−αt}, without overshoot, and an
/// explicit method of step h has to have αh within its region of stability. Reactions are those of
/// [`super::solve`]: what keeps the drift small is no force that the model bears. Baumgarte, Comput. Methods
/// Appl. Mech. Eng. 1 (1972) 1–16.
///
/// # Errors
/// As [`super::solve`].
pub fn solve_baumgarte<M: Constraints>(
    model: &M,
    constants: &M::Constants,
    state: &M::State,
    (alpha, beta): (f64, f64),
    workspace: &mut [f64],
) -> Result<DiagnosedAccelerations<M::Vector>, SolveError> {
    let mut right = model.velocity_residual(state);
    right.as_mut_slice().iter_mut().for_each(|x| *x *= -2.0 * alpha);
    let residual = model.residual(state);
    for (right, residual) in right.as_mut_slice().iter_mut().zip(residual.as_slice()) {
        *right -= beta * beta * residual;
    }
    if M::Rows::LEN == 0 {
        return accelerate(model, constants, state, workspace);
    }
    let unrolled = (!M::FRICTION).then(|| model.accelerate_unrolled(constants, state)).flatten();
    let Some((mut accelerations, more)) = unrolled.zip(model.correct_unrolled(constants, state, &right))
    else {
        return solve_with_correction(model, state, Some(&right), workspace)
            .map(DiagnosedAccelerations::from);
    };
    add(accelerations.as_mut_slice(), more.as_slice());
    Ok(DiagnosedAccelerations { accelerations, diagnosis: None })
}

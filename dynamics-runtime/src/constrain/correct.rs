//! Corrections along the constraint forces: M δ = Φ_qᵀ μ, Φ_q δ = r.
//!
//! Projections of positions and velocities, impacts and Baumgarte's stabilization are made of them.

use super::{DiagnosedAccelerations, FactoredEquations, accelerate, holds, solve_with_correction};
use crate::error::SolveError;
use crate::linalg::add;
use crate::model::{Constraints, Model, ModelState, Vector};

/// The correction δ of least M-norm with Φ_q δ = `right`: M δ = Φ_qᵀ μ for some μ.
///
/// Where constraints repeat each other, `right` is met in the sense of least squares. The caller checks what
/// is left over.
///
/// # Errors
/// As [`super::solve`], but contradictions are not reported.
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
    let active_set = state.active_set();
    let correction = correct_rows(model, state, right, &|row| holds::<M>(active_set, row), workspace)?;
    Ok(correction.change)
}

/// A change of coordinates or velocities by constraint forces, with the impulses that make it.
pub(super) struct ConstraintCorrection<V, R> {
    /// δ.
    pub(super) change: V,
    /// μ with M δ = Φ_qᵀ μ: impulses, where velocities change.
    pub(super) impulses: R,
}

/// [`ConstraintCorrection`] of a model.
pub(super) type CorrectionOf<M> = ConstraintCorrection<<M as Model>::Vector, <M as Constraints>::Rows>;

impl<V: Vector, R: Vector> ConstraintCorrection<V, R> {
    pub(super) fn none() -> Self {
        Self { change: V::zeros(), impulses: R::zeros() }
    }

    /// NaN, where M is not finite.
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
    // A state on the constraints fulfils all rows, redundant ones included.
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
/// The drift then obeys Φ̈ + 2αΦ̇ + β²Φ = 0. With α = β it decays as (1 + αt)e^{−αt}, without
/// overshoot. An explicit method of step h must have αh within its region of stability. The reactions of a
/// motion are those of [`super::solve`]: the force that keeps the drift small is none that the modelled
/// bodies bear. Source: J. Baumgarte, Comput. Methods Appl. Mech. Eng. 1 (1972) 1–16.
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

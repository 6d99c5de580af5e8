//! Projection onto the constraints: positions onto Φ = 0, velocities onto Φ_q q̇ + Φ_t = 0 and A q̇ + b = 0.
//!
//! Positions by Newton's method with mass-weighted steps, M δ = Φ_qᵀ μ, Φ_q δ = −Φ. The result is,
//! to second order, the nearest point in the metric of M, so that a projection after a step disturbs the
//! motion as little as possible. Velocities by one such step, which is exact: it leaves the velocities along
//! the constraints as they are, like an impact. Newton's method converges quadratically from what a step
//! leaves, as a rule in one correction. Sources: Lubich, Nowak, Pöhle & Engstler, MEXX (1992); Hairer &
//! Wanner, Solving ODEs II, §VII.2.
//!
//! A position where the gradient of a row vanishes is a double root of Newton's method. It shows in steps
//! that halve the distance, and is reported as a vanishing gradient.

use core::ops::Range;

use super::correct::{correct, correct_rows};
use super::{Gradients, holds, system_names};
use crate::error::SolveError;
use crate::linalg::{add, max_abs, norm};
use crate::model::{Constraints, ModelState, Vector};

/// Which equations of the constraints: Φ = 0, or Φ_q q̇ + Φ_t = 0 with A q̇ + b = 0.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum ConstraintLevel {
    Positions,
    Velocities,
}

impl ConstraintLevel {
    /// As errors name it.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Positions => "positions",
            Self::Velocities => "velocities",
        }
    }
}

/// Most Newton steps. From a drift of 10⁻³ four are enough.
const MAX_NEWTON_STEPS: u32 = 25;
/// Most simplified Newton steps. They converge linearly, so that there are more than of Newton's own. A
/// projection that needs more is an error.
const MAX_SIMPLIFIED_STEPS: u32 = 100;
/// Distance, in parts of 1 + |q|, at which constraints count as satisfied where they cannot all be: redundant
/// constraints whose lengths were rounded. With a smaller bound, lengths of nine digits would be refused; a
/// larger one would accept a drift that users see.
const ADMISSIBLE_DISTANCE: f64 = 1e-9;
/// So many steps in which Φ falls to about a quarter, that is, in which the distance is halved, show a double
/// root. A smaller value would take slow starts of Newton's method for double roots, a larger one would
/// report more of these as constraints that cannot be fulfilled.
const DOUBLE_ROOT_HALVINGS: u32 = 8;
/// Ratios of Φ after a step to Φ before it that count as a quarter.
const ABOUT_A_QUARTER: Range<f64> = 0.2..0.3;
/// Newton's method diverges where Φ grows by more than this factor with a change of more than
/// [`DIVERGING_CHANGE`]. A smaller factor would refuse searches that recover.
const DIVERGENCE_GROWTH: f64 = 10.0;
/// See [`DIVERGENCE_GROWTH`]. Below, growth of Φ may be rounding near rank loss.
const DIVERGING_CHANGE: f64 = 1e-3;
/// A predicted correction up to this is rounding.
const CORRECTION_ROUNDING: f64 = 2.0 * f64::EPSILON;
/// Newton's method ends after a correction up to this, √ε and a margin, that left Φ at [`STALLED_RATIO`] or
/// more: Φ is then at its rounding.
const STALLED_CHANGE: f64 = 1e-7;
/// See [`STALLED_CHANGE`].
const STALLED_RATIO: f64 = 0.5;
/// Simplified steps end where a correction up to this is no smaller than the one before: it is rounding,
/// amplified where the constraints are near rank loss.
const STALLED_SIMPLIFIED_CHANGE: f64 = 1e-10;
/// Simplified steps diverge where a correction is this many times the smallest one so far.
const SIMPLIFIED_DIVERGENCE_GROWTH: f64 = 2.0;
/// A change of velocities up to this needs no second pass: its rounding errors, ε times the change, are then
/// far below those of the velocities.
const SINGLE_PASS_CHANGE: f64 = 1e-4;

/// Cost and size of a projection.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Projection {
    /// Corrections made.
    pub iterations: u32,
    /// How many of them the general solver made.
    pub general: u32,
    /// Greatest change of a coordinate or velocity x, over 1 + |x|.
    pub change: f64,
    /// Greatest |δ|/|r| of a correction δ for the residuals r, in the units of the coordinates and rows. It
    /// grows without limit toward a position where the constraints lose rank.
    pub sensitivity: f64,
}

impl Projection {
    fn record_sensitivity(&mut self, correction: &[f64], residual: f64) {
        self.sensitivity = self.sensitivity.max(max_abs(correction) / residual);
    }
}

/// Whether Newton's method ends after a correction of the size `change` that took Φ from `before` to `after`.
/// Quadratic convergence predicts the size of the next correction. It is not made where it would be rounding,
/// or where the last one gained nothing.
#[inline(always)]
pub(super) fn is_converged(change: f64, before: f64, after: f64) -> bool {
    let next = change * (after / before);
    next <= CORRECTION_ROUNDING || (change <= STALLED_CHANGE && after >= STALLED_RATIO * before)
}

/// Moves q to Φ(q, t) = 0, to rounding level. Released constraints are ignored. Velocities stay.
///
/// # Errors
/// [`SolveError::OffConstraint`] where there is no such q nearby; the state is then where the search ended.
/// Those of [`super::correct()`].
pub fn project_positions<M: Constraints>(
    model: &M,
    constants: &M::Constants,
    state: &mut M::State,
    workspace: &mut [f64],
) -> Result<Projection, SolveError> {
    let mut projection = Projection::default();
    if M::Residual::LEN == 0 {
        return Ok(projection);
    }
    let start = *state.q();
    let mut right = position_right_hand_side(model, state)?;
    let mut largest = largest(&right);
    // Steps in which Φ fell to about a quarter: on a double root Newton's method halves the distance every
    // time.
    let mut halvings = 0;
    while largest > 0.0 {
        if projection.iterations == MAX_NEWTON_STEPS {
            return Err(if halvings >= DOUBLE_ROOT_HALVINGS {
                vanishing_gradient(model, state, workspace)
            } else {
                off_constraint(model, state, ConstraintLevel::Positions, workspace)
            });
        }
        let delta = correction(model, constants, state, &right, true, &mut projection, workspace)?;
        projection.record_sensitivity(delta.as_slice(), largest);
        let change = relative_change(delta.as_slice(), state.q().as_slice());
        add(state.q_mut().as_mut_slice(), delta.as_slice());
        let before = largest;
        right = position_right_hand_side(model, state)?;
        largest = self::largest(&right);
        if !change.is_finite()
            || (projection.iterations > 1
                && largest > DIVERGENCE_GROWTH * before
                && change > DIVERGING_CHANGE)
        {
            return Err(off_constraint(model, state, ConstraintLevel::Positions, workspace));
        }
        halvings += u32::from(ABOUT_A_QUARTER.contains(&(largest / before)));
        // Or the search ends where the gradient counts as vanished.
        if change == 0.0 && halvings >= DOUBLE_ROOT_HALVINGS {
            return Err(vanishing_gradient(model, state, workspace));
        }
        if is_converged(change, before, largest) {
            break;
        }
    }
    projection.change = relative_difference(start.as_slice(), state.q().as_slice());
    // Where the generated code applies the rows have full rank, and Newton's limit satisfies all of them. The
    // general solver may have returned a least-squares compromise.
    if projection.general > 0 {
        check_admissible(model, state, ConstraintLevel::Positions, workspace)?
    }
    Ok(projection)
}

/// Moves the q of `end` to Φ(q, t) = 0 along M⁻¹Φ_qᵀ of another state, `from`. These are simplified
/// Newton steps. They converge at a rate in proportion to the distance of the two states, and end at rounding
/// level. RATTLE needs this projection: along gradients of the end the step would not be symplectic.
///
/// # Errors
/// As [`project_positions`].
pub fn project_along<M: Constraints>(
    model: &M,
    constants: &M::Constants,
    from: &M::State,
    end: &mut M::State,
    workspace: &mut [f64],
) -> Result<(), SolveError> {
    let (mut before, mut least) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..MAX_SIMPLIFIED_STEPS {
        let right = position_right_hand_side(model, end)?;
        let delta = correct(model, constants, from, &right, workspace)?;
        let change = relative_change(delta.as_slice(), from.q().as_slice());
        add(end.q_mut().as_mut_slice(), delta.as_slice());
        if change == 0.0 || (change >= before && change <= STALLED_SIMPLIFIED_CHANGE) {
            return Ok(());
        }
        least = change.min(least);
        if change.is_nan() || change > SIMPLIFIED_DIVERGENCE_GROWTH * least {
            break;
        }
        before = change;
    }
    Err(off_constraint(model, end, ConstraintLevel::Positions, workspace))
}

/// Changes q̇ to satisfy Φ_q q̇ + Φ_t = 0 and A q̇ + b = 0 at the state's positions.
///
/// # Errors
/// [`SolveError::OffConstraint`] where there are no such velocities. Those of [`super::correct()`].
pub fn project_velocities<M: Constraints>(
    model: &M,
    constants: &M::Constants,
    state: &mut M::State,
    workspace: &mut [f64],
) -> Result<Projection, SolveError> {
    let mut projection = Projection::default();
    if M::Rows::LEN == 0 {
        return Ok(projection);
    }
    let start = *state.u();
    // The second pass removes the rounding errors of a large first one.
    for _ in 0..2 {
        let right = velocity_right_hand_side(model, state)?;
        let largest = largest(&right);
        if largest == 0.0 {
            break;
        }
        let delta = correction(model, constants, state, &right, false, &mut projection, workspace)?;
        projection.record_sensitivity(delta.as_slice(), largest);
        let change = relative_change(delta.as_slice(), state.u().as_slice());
        add(state.u_mut().as_mut_slice(), delta.as_slice());
        if !change.is_finite() {
            return Err(off_constraint(model, state, ConstraintLevel::Velocities, workspace));
        }
        if change <= SINGLE_PASS_CHANGE {
            break;
        }
    }
    projection.change = relative_difference(start.as_slice(), state.u().as_slice());
    if projection.general > 0 {
        check_admissible(model, state, ConstraintLevel::Velocities, workspace)?
    }
    Ok(projection)
}

/// One correction, by the generated code where it applies; counts it.
fn correction<M: Constraints>(
    model: &M,
    constants: &M::Constants,
    state: &M::State,
    right: &M::Rows,
    positions: bool,
    projection: &mut Projection,
    workspace: &mut [f64],
) -> Result<M::Vector, SolveError> {
    projection.iterations += 1;
    if let Some(delta) = model.correct_unrolled(constants, state, right) {
        return Ok(delta);
    }
    projection.general += 1;
    let (active_set, position_rows) = (state.active_set(), M::Residual::LEN);
    // Nonholonomic rows do not restrict positions.
    let active = |row: usize| holds::<M>(active_set, row) && (!positions || row < position_rows);
    correct_rows(model, state, right, &active, workspace).map(|correction| correction.change)
}

/// −Φ, and 0 for rows without Φ or released.
fn position_right_hand_side<M: Constraints>(model: &M, state: &M::State) -> Result<M::Rows, SolveError> {
    let residual = model.residual(state);
    let mut right = M::Rows::zeros();
    let values = right.as_mut_slice().iter_mut().zip(residual.as_slice());
    values.for_each(|(right, residual)| *right = -residual);
    active_and_finite::<M>(state, right)
}

/// −Φ̇, and 0 for released rows.
fn velocity_right_hand_side<M: Constraints>(model: &M, state: &M::State) -> Result<M::Rows, SolveError> {
    let mut right = model.velocity_residual(state);
    right.as_mut_slice().iter_mut().for_each(|x| *x = -*x);
    active_and_finite::<M>(state, right)
}

/// A right-hand side with 0 for released rows; an error where it is not finite.
fn active_and_finite<M: Constraints>(state: &M::State, mut right: M::Rows) -> Result<M::Rows, SolveError> {
    let active_set = state.active_set();
    for (row, x) in right.as_mut_slice().iter_mut().enumerate() {
        if !holds::<M>(active_set, row) {
            *x = 0.0;
        } else if !x.is_finite() {
            return Err(SolveError::ConstraintNotFinite { row: system_names::<M>().row(row) });
        }
    }
    Ok(right)
}

/// Checks that the distance of a state from each row's constraint, |Φ|/‖Φ_q‖, is admissible.
pub(super) fn check_admissible<M: Constraints>(
    model: &M,
    state: &M::State,
    level: ConstraintLevel,
    workspace: &mut [f64],
) -> Result<(), SolveError> {
    let (_, _, distance) = worst_row(model, state, level, workspace)?;
    let at = if level == ConstraintLevel::Positions { state.q() } else { state.u() };
    let admissible = ADMISSIBLE_DISTANCE * (1.0 + max_abs(at.as_slice()));
    if distance <= admissible { Ok(()) } else { Err(off_constraint(model, state, level, workspace)) }
}

/// The row with the largest distance: its index, residual and distance.
fn worst_row<M: Constraints>(
    model: &M,
    state: &M::State,
    level: ConstraintLevel,
    workspace: &mut [f64],
) -> Result<(usize, f64, f64), SolveError> {
    let right = if level == ConstraintLevel::Positions {
        position_right_hand_side(model, state)?
    } else {
        velocity_right_hand_side(model, state)?
    };
    let gradients = Gradients::of(model, state, workspace);
    let mut worst_row = (0, 0.0, 0.0);
    for (row, x) in right.as_slice().iter().enumerate().filter(|(_, x)| **x != 0.0) {
        let distance = gradients.distance(row, *x);
        if distance.is_nan() || distance > worst_row.2 {
            worst_row = (row, -x, distance);
        }
    }
    Ok(worst_row)
}

/// The error that names the row with the largest distance.
#[cold]
fn off_constraint<M: Constraints>(
    model: &M,
    state: &M::State,
    level: ConstraintLevel,
    workspace: &mut [f64],
) -> SolveError {
    match worst_row(model, state, level, workspace) {
        Ok((row, residual, distance)) => SolveError::OffConstraint {
            what: level.name(),
            row: system_names::<M>().row(row),
            residual,
            distance,
        },
        Err(error) => error,
    }
}

/// The error that names the row with the shortest gradient.
#[cold]
fn vanishing_gradient<M: Constraints>(model: &M, state: &M::State, workspace: &mut [f64]) -> SolveError {
    let gradients = Gradients::of(model, state, workspace);
    let rows = (0..M::Residual::LEN).filter(|row| holds::<M>(state.active_set(), *row));
    let lengths = rows.map(|row| (row, norm(gradients.row(row))));
    let least = lengths.fold((0, f64::INFINITY), |least, next| if next.1 < least.1 { next } else { least });
    SolveError::VanishingGradient { row: system_names::<M>().row(least.0) }
}

fn largest<V: Vector>(x: &V) -> f64 {
    max_abs(x.as_slice())
}

/// max |δ|/(1 + |x|).
fn relative_change(delta: &[f64], x: &[f64]) -> f64 {
    delta.iter().zip(x).fold(0.0, |most, (d, x)| crate::math::max(most, d.abs() / (1.0 + x.abs())))
}

fn relative_difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |most, (a, b)| crate::math::max(most, (a - b).abs() / (1.0 + b.abs())))
}

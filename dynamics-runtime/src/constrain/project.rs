//! Projection onto the constraints: positions onto Φ = 0, velocities onto Φ_q q̇ + Φ_t = 0 and A q̇ + b = 0.
//!
//! Positions by Newton with mass-weighted steps, M δ = Φ_qᵀ μ, Φ_q δ = −Φ: the point that results is, to
//! second order, the nearest in the metric of M, so that a projection after a step disturbs the motion as
//! little as it can. Velocities by one such step, which is exact: it leaves what is not against the
//! constraints alone, as an impact would. Lubich, Nowak, Pöhle & Engstler, MEXX (1992); Hairer & Wanner,
//! Solving ODEs II, §VII.2. Converges quadratically from what a step leaves behind: one correction as a rule.

use super::correct::{correct, correct_rows};
use super::{Gradients, holds, system_names};
use crate::error::SolveError;
use crate::linalg::{add, max_abs, norm};
use crate::model::{Constraints, ModelState, Vector};

/// Most Newton steps; from a drift of 1e-3 four are enough.
const MOST_PROJECTION_STEPS: u32 = 25;
/// Most simplified Newton steps.
const MOST_ALONG: u32 = 100;
/// Distance at which constraints still count as satisfied where they cannot all be: redundant ones, declared
/// with numbers that were rounded.
const ADMISSIBLE: f64 = 1e-9;

/// What a projection took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Projection {
    /// Corrections made.
    pub iterations: u32,
    /// How many of them took the general solver.
    pub general: u32,
    /// Greatest change of a coordinate or velocity x, over 1 + |x|.
    pub change: f64,
    /// Greatest |δ|/|r| of a correction δ for the residuals r, in the units of the coordinates and rows:
    /// grows without limit toward a position where the constraints lose rank.
    pub sensitivity: f64,
}

impl Projection {
    fn note(&mut self, correction: &[f64], residual: f64) {
        self.sensitivity = self.sensitivity.max(max_abs(correction) / residual);
    }
}

/// Moves q to Φ(q, t) = 0, to rounding level; constraints that are released are not looked at. Velocities
/// stay.
///
/// # Errors
/// [`SolveError::OffConstraint`] where there is no such q nearby; the state is then where the search ended.
/// What [`super::correct()`] says.
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
    let mut right = position_right(model, state)?;
    let mut size = size(&right);
    // Newton on a double root halves the distance with every step, and Φ falls to a quarter.
    let mut halvings = 0;
    while size > 0.0 {
        if projection.iterations == MOST_PROJECTION_STEPS {
            return Err(if halvings >= 8 {
                vanishing(model, state, workspace)
            } else {
                off(model, state, "positions", workspace)
            });
        }
        let delta = correction(model, constants, state, &right, true, &mut projection, workspace)?;
        projection.note(delta.as_slice(), size);
        let change = relative(delta.as_slice(), state.q().as_slice());
        add(state.q_mut().as_mut_slice(), delta.as_slice());
        let before = size;
        right = position_right(model, state)?;
        size = self::size(&right);
        if !change.is_finite() || (projection.iterations > 1 && size > 10.0 * before && change > 1e-3) {
            return Err(off(model, state, "positions", workspace));
        }
        halvings += u32::from((0.2..0.3).contains(&(size / before)));
        // It ends where the gradient counts as vanished.
        if change == 0.0 && halvings >= 8 {
            return Err(vanishing(model, state, workspace));
        }
        // The next correction would be about this; where that is rounding, or nothing is gained any more, it
        // is not made.
        let next = change * (size / before);
        if next <= 2.0 * f64::EPSILON || (change <= 1e-7 && size >= 0.5 * before) {
            break;
        }
    }
    projection.change = difference(start.as_slice(), state.q().as_slice());
    // Unrolled code has full rank: what it converged to satisfies all rows. The general solver may have had
    // to compromise.
    if projection.general > 0 {
        admit(model, state, "positions", workspace)?
    }
    Ok(projection)
}

/// Moves the q of `end` to Φ(q, t) = 0 along M⁻¹Φ_qᵀ of another state, `from`: simplified Newton steps, which
/// converge at a rate in proportion to the distance of the two, and end where rounding stops them. RATTLE
/// asks for it: along gradients of the end the step would not be symplectic.
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
    for _ in 0..MOST_ALONG {
        let right = position_right(model, end)?;
        let delta = correct(model, constants, from, &right, workspace)?;
        let change = relative(delta.as_slice(), from.q().as_slice());
        add(end.q_mut().as_mut_slice(), delta.as_slice());
        if change == 0.0 || (change >= before && change <= 1e-10) {
            return Ok(());
        }
        least = change.min(least);
        if change.is_nan() || change > 2.0 * least {
            break;
        }
        before = change;
    }
    Err(off(model, end, "positions", workspace))
}

/// Changes q̇ to satisfy Φ_q q̇ + Φ_t = 0 and A q̇ + b = 0 at the state's positions.
///
/// # Errors
/// [`SolveError::OffConstraint`] where there are no such velocities. What [`super::correct()`] says.
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
    // The second pass takes the rounding errors of a large first one.
    for _ in 0..2 {
        let right = velocity_right(model, state)?;
        let size = size(&right);
        if size == 0.0 {
            break;
        }
        let delta = correction(model, constants, state, &right, false, &mut projection, workspace)?;
        projection.note(delta.as_slice(), size);
        let change = relative(delta.as_slice(), state.u().as_slice());
        add(state.u_mut().as_mut_slice(), delta.as_slice());
        if !change.is_finite() {
            return Err(off(model, state, "velocities", workspace));
        }
        if change <= 1e-4 {
            break;
        }
    }
    projection.change = difference(start.as_slice(), state.u().as_slice());
    if projection.general > 0 {
        admit(model, state, "velocities", workspace)?
    }
    Ok(projection)
}

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
    let (modes, positional) = (state.modes(), M::Residual::LEN);
    // Positions are not bound by rows that restrict velocities.
    let active = |row: usize| holds::<M>(modes, row) && (!positions || row < positional);
    correct_rows(model, state, right, &active, workspace).map(|correction| correction.change)
}

/// −Φ, and 0 for rows without Φ or released.
fn position_right<M: Constraints>(model: &M, state: &M::State) -> Result<M::Rows, SolveError> {
    let residual = model.residual(state);
    let mut right = M::Rows::zeros();
    let values = right.as_mut_slice().iter_mut().zip(residual.as_slice());
    values.for_each(|(right, residual)| *right = -residual);
    held_and_finite::<M>(state, right)
}

/// −Φ̇, and 0 for released rows.
fn velocity_right<M: Constraints>(model: &M, state: &M::State) -> Result<M::Rows, SolveError> {
    let mut right = model.velocity_residual(state);
    right.as_mut_slice().iter_mut().for_each(|x| *x = -*x);
    held_and_finite::<M>(state, right)
}

fn held_and_finite<M: Constraints>(state: &M::State, mut right: M::Rows) -> Result<M::Rows, SolveError> {
    let modes = state.modes();
    for (row, x) in right.as_mut_slice().iter_mut().enumerate() {
        if !holds::<M>(modes, row) {
            *x = 0.0;
        } else if !x.is_finite() {
            return Err(SolveError::ConstraintNotFinite { row: system_names::<M>().row(row) });
        }
    }
    Ok(right)
}

/// The distance of a state from each row's constraint, |Φ|/‖Φ_q‖, is admissible.
pub(super) fn admit<M: Constraints>(
    model: &M,
    state: &M::State,
    what: &'static str,
    workspace: &mut [f64],
) -> Result<(), SolveError> {
    let (_, _, distance) = worst(model, state, what, workspace)?;
    let at = if what == "positions" { state.q() } else { state.u() };
    let admissible = ADMISSIBLE * (1.0 + max_abs(at.as_slice()));
    if distance <= admissible { Ok(()) } else { Err(off(model, state, what, workspace)) }
}

/// The row that is missed most: its index, residual and distance.
fn worst<M: Constraints>(
    model: &M,
    state: &M::State,
    what: &'static str,
    workspace: &mut [f64],
) -> Result<(usize, f64, f64), SolveError> {
    let right =
        if what == "positions" { position_right(model, state)? } else { velocity_right(model, state)? };
    let gradients = Gradients::of(model, state, workspace);
    let mut worst = (0, 0.0, 0.0);
    for (row, x) in right.as_slice().iter().enumerate().filter(|(_, x)| **x != 0.0) {
        let distance = gradients.distance(row, *x);
        if distance.is_nan() || distance > worst.2 {
            worst = (row, -x, distance);
        }
    }
    Ok(worst)
}

#[cold]
fn off<M: Constraints>(model: &M, state: &M::State, what: &'static str, workspace: &mut [f64]) -> SolveError {
    match worst(model, state, what, workspace) {
        Ok((row, residual, distance)) => {
            SolveError::OffConstraint { what, row: system_names::<M>().row(row), residual, distance }
        }
        Err(error) => error,
    }
}

/// The row whose gradient is shortest.
#[cold]
fn vanishing<M: Constraints>(model: &M, state: &M::State, workspace: &mut [f64]) -> SolveError {
    let gradients = Gradients::of(model, state, workspace);
    let rows = (0..M::Residual::LEN).filter(|row| holds::<M>(state.modes(), *row));
    let lengths = rows.map(|row| (row, norm(gradients.row(row))));
    let least = lengths.fold((0, f64::INFINITY), |least, next| if next.1 < least.1 { next } else { least });
    SolveError::VanishingGradient { row: system_names::<M>().row(least.0) }
}

fn size<V: Vector>(x: &V) -> f64 {
    max_abs(x.as_slice())
}

/// max |δ|/(1 + |x|).
fn relative(delta: &[f64], x: &[f64]) -> f64 {
    delta.iter().zip(x).fold(0.0, |most, (d, x)| crate::math::max(most, d.abs() / (1.0 + x.abs())))
}

fn difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |most, (a, b)| crate::math::max(most, (a - b).abs() / (1.0 + b.abs())))
}

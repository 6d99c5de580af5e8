//! Starts at singular positions: the accelerations of the branch on which the velocities are.

use crate::constrain::nearby::at_time;
use crate::constrain::rank_margin::{RankMargin, rank_margin};
use crate::error::SolveError;
use crate::linalg::max_abs;
use crate::model::{Constraints, ModelState, Vector};
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::{constrain, math};

/// Conditioning from which on constraints are taken for singular, whatever it was elsewhere.
pub(crate) const SINGULAR: f64 = 1e6;

/// Time to either side of a singular start at which accelerations are looked at, in parts of the time in
/// which the motion turns.
const SINGULAR_START_INTERVAL: f64 = 1e-3;

/// Relative difference up to which accelerations to both sides of it agree.
const AGREE: f64 = 0.05;

/// How long a motion takes to be so far from a singular start that its velocities are determined to within a
/// tolerance: at a distance x of it the constraints know them to ε/x².
pub(crate) fn least_distance<S: ModelState>(start: &S, tolerance: f64) -> f64 {
    let speed = max_abs(start.u().as_slice());
    if speed > 0.0 { 3.0 * math::sqrt(f64::EPSILON / tolerance) / speed } else { 0.0 }
}

/// The accelerations at a start where the general solver found constraints that depend on each other; `None`
/// where the position is not a singular one.
///
/// At a singular position Φ_q q̈ = γ says nothing of the direction in which branches part. Where velocities
/// follow a branch it is the limit of what holds beside the position: the mean of both sides, extrapolated.
///
/// # Errors
/// [`Kind::SingularStart`] where both sides do not agree.
pub(crate) fn start_accelerations<M: Constraints>(
    model: &M,
    constants: &M::Constants,
    start: &M::State,
    found: &M::Vector,
    workspace: &mut [f64],
) -> Result<Option<M::Vector>, Kind> {
    let RankMargin { condition, rows, coordinates } = rank_margin(model, start);
    if condition < SINGULAR {
        return Ok(None);
    }
    let undetermined = Kind::SingularStart { rows, coordinates };
    let size = |x: &M::Vector| max_abs(x.as_slice());
    let (speed, force) = (size(start.u()), size(found));
    if speed == 0.0 {
        // At rest and without forces it stays; where forces begin to move it branches are open.
        return if force == 0.0 { Ok(Some(*found)) } else { Err(undetermined) };
    }
    let tau = SINGULAR_START_INTERVAL * (1.0 / speed).min(speed / force);
    let mut beside = |tau: f64| -> Result<M::Vector, SolveError> {
        let mut state = at_time(start, start.t() + tau);
        for i in 0..M::Vector::LEN {
            state.q_mut()[i] += tau * (start.u()[i] + 0.5 * tau * found[i]);
            state.u_mut()[i] += tau * found[i];
        }
        constrain::project_positions(model, constants, &mut state, workspace)?;
        constrain::project_velocities(model, constants, &mut state, workspace)?;
        Ok(constrain::solve(model, constants, &state, workspace)?.accelerations)
    };
    let mut mean = |tau: f64| -> Result<(M::Vector, f64), SolveError> {
        let (before, after) = (beside(-tau)?, beside(tau)?);
        let mean = combined(&before, 0.5, &after, 0.5);
        Ok((mean, size(&combined(&after, 1.0, &before, -1.0))))
    };
    let (Ok((near, apart)), Ok((far, _))) = (mean(tau), mean(2.0 * tau)) else { return Err(undetermined) };
    // Errors of the means grow with τ².
    let limit = combined(&near, 4.0 / 3.0, &far, -1.0 / 3.0);
    let scale = size(&limit).max(force).max(speed * speed);
    let settled = size(&combined(&near, 1.0, &far, -1.0)) <= AGREE * scale && apart <= AGREE * scale;
    if !settled || !size(&limit).is_finite() {
        return Err(undetermined);
    }
    Ok(Some(limit))
}

/// a x + b y.
pub(crate) fn combined<V: Vector>(x: &V, a: f64, y: &V, b: f64) -> V {
    let mut out = V::zeros();
    (0..V::LEN).for_each(|i| out[i] = a * x[i] + b * y[i]);
    out
}

//! Starts at singular positions: the accelerations of the branch along which the velocities point.
//!
//! At a singular position Φ_q loses rank, and Φ_q q̈ = γ leaves the acceleration across the branches
//! open. The velocities of a start still choose a branch. Its acceleration is the limit of the accelerations
//! on both sides, extrapolated from two distances. `run.rs` asks for it at the start of a run, and
//! `Stabilization::branch_limit` where a stage lies in such a position. Near, but not in, a singular position
//! the stepper shortens or repeats steps; see `integrate/stepper/singularity_crossing.rs`.

use crate::constrain::nearby::at_time;
use crate::constrain::rank_margin::{RankMargin, rank_margin};
use crate::error::SolveError;
use crate::linalg::max_abs;
use crate::model::{Constraints, ModelState, Vector};
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::{constrain, math};

/// Condition of the constraints, with rows scaled to unit length, above which a position is singular whatever
/// the condition is elsewhere: a start there gets the accelerations of its branch, and a failure there has
/// the position as its cause. At 1e6 a correction amplifies rounding errors to about 1e-10 of the
/// coordinates. With a smaller value starts near a singular position get the limit at the position instead of
/// their own accelerations; with a larger one accelerations are used that rounding has determined.
pub(crate) const BRANCH_LIMIT_CONDITION: f64 = 1e6;

/// Time to either side of a singular start at which accelerations are evaluated, in parts of the time in
/// which the motion turns, min(1/|q̇|, |q̇|/|q̈|). Nearer, rounding is amplified as ε/x³; farther, the
/// error of the extrapolated limit grows as the fourth power.
const SIDE_INTERVAL: f64 = 1e-3;

/// Relative difference up to which the accelerations of both sides, and of both distances, agree. More is a
/// start whose velocities follow no branch.
const MAX_SIDE_DIFFERENCE: f64 = 0.05;

/// Time in which a motion leaves a singular start so far that its velocities are determined to the tolerance:
/// at a distance x the constraints determine them to ε/x².
pub(crate) fn time_until_determined<S: ModelState>(start: &S, tolerance: f64) -> f64 {
    let speed = max_abs(start.u().as_slice());
    if speed > 0.0 { 3.0 * math::sqrt(f64::EPSILON / tolerance) / speed } else { 0.0 }
}

/// The accelerations at a start where the general solver found dependent constraints; `None` where the
/// position is not singular. They are the mean of the accelerations on both sides, extrapolated to the start.
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
    if condition < BRANCH_LIMIT_CONDITION {
        return Ok(None);
    }
    let undetermined = Kind::SingularStart { rows, coordinates };
    let size = |x: &M::Vector| max_abs(x.as_slice());
    let (speed, force) = (size(start.u()), size(found));
    if speed == 0.0 {
        // At rest and without forces it stays; where forces begin to move it branches are open.
        return if force == 0.0 { Ok(Some(*found)) } else { Err(undetermined) };
    }
    // Accelerations a little before and behind, on the constraints.
    let tau = SIDE_INTERVAL * (1.0 / speed).min(speed / force);
    let mut accelerations_at = |tau: f64| -> Result<M::Vector, SolveError> {
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
        let (before, after) = (accelerations_at(-tau)?, accelerations_at(tau)?);
        let mean = combined(&before, 0.5, &after, 0.5);
        Ok((mean, size(&combined(&after, 1.0, &before, -1.0))))
    };
    let (Ok((near, difference)), Ok((far, _))) = (mean(tau), mean(2.0 * tau)) else {
        return Err(undetermined);
    };
    // Errors of the means grow as τ²: Richardson extrapolation.
    let limit = combined(&near, 4.0 / 3.0, &far, -1.0 / 3.0);
    let scale = size(&limit).max(force).max(speed * speed);
    let agree = size(&combined(&near, 1.0, &far, -1.0)) <= MAX_SIDE_DIFFERENCE * scale
        && difference <= MAX_SIDE_DIFFERENCE * scale;
    if !agree || !size(&limit).is_finite() {
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

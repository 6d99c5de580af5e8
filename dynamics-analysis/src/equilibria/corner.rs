//! Rest in a corner of the potential: a branch of the model changes there, and the forces on both sides drive
//! toward it.
//!
//! An example is the minimum of |x|, where no slope exists. No position has its forces in balance. Newton's
//! method ends where it began, because a constant force does not become smaller. So the search goes downhill
//! until the branch changes and the force drives back.

use dynamics_runtime::constrain::{project_positions, with_workspace};
use dynamics_runtime::model::{Constraints, Kink, MOST_KINKS, ModelState, Vector};
use nalgebra::DVector;

use super::EquilibriumError;
use super::statics::{Statics, scales};

/// The first distance that is looked at, in what coordinates are measured by, and how often it is doubled.
const FIRST: f64 = 1e-9;
const DOUBLED: usize = 34;
/// Halvings up to where a choice changes.
const HALVED: usize = 60;

/// The error that names the corner, if downhill from a place there is one.
pub(super) fn beside<M: Constraints>(
    model: &M,
    constants: &M::Constants,
    state: &M::State,
    statics: &Statics<M::Rows>,
) -> Result<Option<EquilibriumError>, EquilibriumError> {
    if M::KINKS == 0 || statics.force.is_empty() {
        return Ok(None);
    }
    let Some(mass) = statics.mass.clone().cholesky() else { return Ok(None) };
    let scales = scales(M::COORDINATES, state.q().as_slice());
    // As it would begin to move: F = −Q − Φ_qᵀλ.
    let way = &statics.tangent.velocities * mass.solve(&-&statics.force);
    let size = way.iter().zip(&scales).fold(0.0, |most: f64, (x, scale)| most.max(x.abs() / scale));
    if size <= 0.0 || !size.is_finite() {
        return Ok(None);
    }
    let way = way / size;
    let at = |s: f64| {
        let mut beside = *state;
        beside.q_mut().as_mut_slice().iter_mut().zip(way.iter()).for_each(|(q, d)| *q += s * d);
        let placed =
            with_workspace::<M, _>(|memory| project_positions(model, constants, &mut beside, memory));
        placed.ok().map(|_| beside)
    };
    let side = |beside: &M::State| {
        let mut kinks = [Kink::NONE; MOST_KINKS];
        model.kinks(beside, &mut kinks);
        kinks.map(|kink| kink.decides && kink.value < 0.0)
    };
    let here = side(state);
    let Some((mut lo, mut hi)) = (0..DOUBLED).find_map(|k| {
        let s = FIRST * f64::powi(2.0, k as i32);
        let changed = at(s).is_some_and(|beside| side(&beside) != here);
        changed.then_some((if k == 0 { 0.0 } else { 0.5 * s }, s))
    }) else {
        return Ok(None);
    };
    for _ in 0..HALVED {
        let middle = 0.5 * (lo + hi);
        match at(middle) {
            Some(beside) if side(&beside) == here => lo = middle,
            _ => hi = middle,
        }
    }
    // A little to both sides of it, for what rounds in between.
    let far = (hi - lo).max(1e-9 * hi);
    let (Some(before), Some(after)) = (at(lo - far), at(hi + far)) else { return Ok(None) };
    let force = |beside: &M::State| -> Result<DVector<f64>, EquilibriumError> {
        Ok(Statics::of(model, beside, &statics.tangent.coordinates)?.force)
    };
    let (before, after) = (force(&before)?, force(&after)?);
    let along = way.select_rows(&statics.tangent.rates);
    if before.len() != along.len()
        || after.len() != along.len()
        || before.dot(&along) >= 0.0
        || after.dot(&along) <= 0.0
    {
        return Ok(None);
    }
    let i = (&after - &before).iamax();
    Ok(Some(EquilibriumError::Corner {
        coordinate: M::COORDINATES[statics.tangent.rates[i]].name,
        force: after[i],
    }))
}

//! Rest in a corner of the potential: a switching function of the model is zero there, and the forces on both
//! sides drive toward it.
//!
//! An example is the minimum of |x|, where no slope exists. Forces balance nowhere. Newton's method ends
//! where it began, because a constant force does not become smaller. So the search goes along the
//! acceleration until a branch of the model changes, and compares the forces on both sides.

use dynamics_runtime::model::{Constraints, Kink, MAX_KINKS, ModelState, Vector};
use nalgebra::DVector;

use super::EquilibriumError;
use super::statics::{Statics, scales};
use crate::displacement::{displaced, projected, size_in_scales};

/// The first distance downhill, in the scales of the coordinates.
const FIRST_DISTANCE: f64 = 1e-9;
/// How often it is doubled: up to 8.6 scales.
const MAX_DOUBLINGS: usize = 34;
/// Forces are compared at this distance to both sides of a corner, relative to the distance of the corner.
const CORNER_MARGIN: f64 = 1e-9;
/// Largest number of bisections that enclose the change of branch; 52 exhaust the digits.
const MAX_BISECTIONS: usize = 60;

/// The error that names the corner, if there is one downhill from a position.
pub(super) fn downhill_corner<M: Constraints>(
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
    // The direction of the acceleration from rest: M v̇ = −F.
    let direction = &statics.tangent.velocities * mass.solve(&-&statics.force);
    let size = size_in_scales(&direction, &scales);
    if size <= 0.0 || !size.is_finite() {
        return Ok(None);
    }
    let direction = direction / size;
    let state_at = |s: f64| projected(model, constants, displaced(state, &(&direction * s))).ok();
    // The first change of a branch along it, by doubling and bisection.
    let side = |nearby: &M::State| {
        let mut kinks = [Kink::NONE; MAX_KINKS];
        model.kinks(nearby, &mut kinks);
        kinks.map(|kink| kink.decides && kink.value < 0.0)
    };
    let here = side(state);
    let Some((mut lo, mut hi)) = (0..MAX_DOUBLINGS).find_map(|k| {
        let s = FIRST_DISTANCE * f64::powi(2.0, k as i32);
        let changed = state_at(s).is_some_and(|nearby| side(&nearby) != here);
        changed.then_some((if k == 0 { 0.0 } else { 0.5 * s }, s))
    }) else {
        return Ok(None);
    };
    for _ in 0..MAX_BISECTIONS {
        let middle = 0.5 * (lo + hi);
        match state_at(middle) {
            Some(nearby) if side(&nearby) == here => lo = middle,
            _ => hi = middle,
        }
    }
    // Positions to both sides of it, at a distance that exceeds rounding.
    let far = (hi - lo).max(CORNER_MARGIN * hi);
    let (Some(before), Some(after)) = (state_at(lo - far), state_at(hi + far)) else { return Ok(None) };
    // A corner of rest: the force drives ahead before it and back behind it.
    let force = |nearby: &M::State| -> Result<DVector<f64>, EquilibriumError> {
        Ok(Statics::of(model, nearby, &statics.tangent.coordinates)?.force)
    };
    let (before, after) = (force(&before)?, force(&after)?);
    let along = direction.select_rows(&statics.tangent.rates);
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

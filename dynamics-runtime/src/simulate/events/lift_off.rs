//! Lift-off: whether a contact that was released really opens.
//!
//! A contact lifts off gently: its gap grows with t³, so that Φ̇ is at the level of rounding or of drift
//! and does not decide. The gap itself is followed instead, until it is larger than the drift from the time
//! when the contact was closed. `location.rs` asks where its function leaves zero without being seen to rise.

use crate::simulate::failure::SimulationErrorKind;

/// How a contact that was released moves.
pub(crate) enum LiftOff {
    /// It is open at θ, by this gap.
    Opens((f64, f64)),
    /// At θ it has closed further than by the drift.
    Falls(f64),
    /// Neither within the step.
    Stays,
}

/// Whether a released contact opens, for a gap that has drifted by `drift` before.
pub(crate) fn classify_lift_off(
    drift: f64,
    gap: &mut dyn FnMut(f64) -> Result<f64, SimulationErrorKind>,
) -> Result<LiftOff, SimulationErrorKind> {
    let mut theta = SIMULTANEOUS_THETA;
    while theta <= 1.0 {
        let value = gap(theta)?;
        if value > drift {
            return Ok(LiftOff::Opens((theta, value)));
        }
        if value < -drift {
            return Ok(LiftOff::Falls(theta));
        }
        theta *= 2.0;
    }
    Ok(LiftOff::Stays)
}

/// Crossings closer than this part of a step happen at the same instant: the interpolant does not order them.
pub(crate) const SIMULTANEOUS_THETA: f64 = 1e-12;

//! Whether a contact lifts off, and how a function leaves zero.

use crate::simulate::events::restart::{Departure, leave};
use crate::simulate::failure::SimulationErrorKind;

/// What becomes of a contact that has just opened.
pub(crate) enum Lift {
    /// It is seen to be open at θ, by this gap.
    Opens((f64, f64)),
    /// It closes further than by what has drifted before, at θ.
    Falls(f64),
    /// Neither within the step.
    Stays,
}

/// Where a contact that has just opened is seen to be open, if its gap falls no further than by what has
/// drifted before: lift-off is gentle, Φ grows with t³, and Φ̇ at rounding or drift level decides nothing.
pub(crate) fn lifts(
    drift: f64,
    gap: &mut dyn FnMut(f64) -> Result<f64, SimulationErrorKind>,
) -> Result<Lift, SimulationErrorKind> {
    let mut theta = SIMULTANEOUS;
    while theta <= 1.0 {
        let value = gap(theta)?;
        if value > drift {
            return Ok(Lift::Opens((theta, value)));
        }
        if value < -drift {
            return Ok(Lift::Falls(theta));
        }
        theta *= 2.0;
    }
    Ok(Lift::Stays)
}

/// [`leave`], compiled once and not with every model.
pub(crate) fn left(
    start: f64,
    noise: f64,
    gap: &mut dyn FnMut(f64) -> Result<f64, SimulationErrorKind>,
) -> Result<Departure, SimulationErrorKind> {
    leave(start, noise, gap)
}

/// Events closer than this in a step happen at the same instant.
pub(crate) const SIMULTANEOUS: f64 = 1e-12;

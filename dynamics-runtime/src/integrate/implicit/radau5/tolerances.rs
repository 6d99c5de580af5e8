//! The tolerances of the error estimate and of Newton's iterations.

use crate::integrate::Tolerances;
use crate::math;

/// Part of the permitted error that Newton's iterations may leave: see [`newton_tolerance`].
const NEWTON_ERROR_PART: f64 = 0.01;

/// The estimate has order 3, the result 5: an estimate of tolerance^⅔ belongs to an error of about the
/// tolerance.
pub(super) fn scaled_tolerances(tolerances: &Tolerances) -> Tolerances {
    let inner = |x: f64| 0.1 * math::powf(x, 2.0 / 3.0);
    let Tolerances { absolute, relative } = *tolerances;
    match relative > 0.0 {
        true => Tolerances { absolute: inner(relative) * absolute / relative, relative: inner(relative) },
        false => Tolerances { absolute: inner(absolute), relative },
    }
}

/// The part of `permitted` that Newton's iterations may leave: a hundredth of the error permitted in the
/// result, and no less than rounding. Where convergence bounds the step and not accuracy, it adds up.
pub(super) fn newton_tolerance(tolerances: &Tolerances, permitted: &Tolerances) -> f64 {
    let (wanted, inner) = match permitted.relative > 0.0 {
        true => (tolerances.relative, permitted.relative),
        false => (tolerances.absolute, permitted.absolute),
    };
    (10.0 * f64::EPSILON / inner).max((NEWTON_ERROR_PART * wanted / inner).min(0.03))
}

//! The length of steps along branches and curves, by the angle between tangents (E. L. Allgower & K. Georg,
//! *Introduction to Numerical Continuation Methods*, chapter 6).

/// The angle between the tangents at both ends of a step, in rad, that step lengths aim at. At 7°, fifty
/// points draw a closed curve smoothly, and the predictor is near enough for a few corrections.
const DESIRED_TURN: f64 = 0.12;
/// The largest angle between the tangents at both ends of a step, in rad, that is accepted (20°). After a
/// sharper turn the corrector may have found another branch.
pub(super) const MAX_TURN: f64 = 0.35;

/// The ratio of the next step length to that of a step in which the tangent turned by this angle, from ½
/// to 2.
pub(super) fn length_ratio(turn: f64) -> f64 {
    if turn > 0.0 { (DESIRED_TURN / turn).clamp(0.5, 2.0) } else { 2.0 }
}

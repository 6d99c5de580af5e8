//! The first step size, from the problem itself.
//!
//! An explicit Euler step of a hundredth of the scale of the solution estimates the second derivative; the step is then the one
//! whose local error of order p would be one hundredth of the tolerance.
//! Source: Hairer, Nørsett, Wanner, *Solving Ordinary Differential Equations I*, §II.4, "starting step size".

use super::tableau::zip;
use super::{Knot, Phase, System, Tolerances};
use crate::math;
use crate::model::Vector;

/// |h| for a method of the given order; costs one to four evaluations. `direction` is ±1, `most` an upper bound.
pub(crate) fn first_step<V: Vector, S: System<V>>(
    system: &mut S,
    start: &Knot<V>,
    order: u32,
    direction: f64,
    most: f64,
    tolerances: &Tolerances,
) -> f64 {
    let slope = start.derivative();
    let size = |x: &Phase<V>| tolerances.norm(x, &start.y, &start.y);
    let (d0, d1) = (size(&start.y), size(&slope));
    let mut h = if d0 < 1e-10 || d1 < 1e-10 || !(d0 / d1).is_finite() { 1e-6 } else { 0.01 * d0 / d1 }.min(most);
    // The Euler step may leave the region where the accelerations exist: then a smaller one is tried.
    for _ in 0..4 {
        let y = zip(&start.y, &slope, |y, k| y + direction * h * k);
        let Ok(a) = system.accelerations(start.t + direction * h, &y.q, &y.u) else {
            h *= 1e-2;
            continue;
        };
        let change = zip(&Phase { q: y.u, u: a }, &slope, |x, y| x - y);
        let d2 = size(&change) / h;
        if !d2.is_finite() {
            h *= 1e-2;
            continue;
        }
        let curvature = d1.max(d2);
        let fine = if curvature <= 1e-15 {
            (h * 1e-3).max(1e-6)
        } else {
            math::powf(0.01 / curvature, 1.0 / f64::from(order))
        };
        return fine.min(100.0 * h).min(most);
    }
    h
}

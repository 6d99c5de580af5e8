//! The accelerations at a start, and the first step size, from the problem itself.
//!
//! An explicit Euler step of a hundredth of the scale of the solution estimates the second derivative; the
//! step is then the one whose local error of order p would be one hundredth of the tolerance.
//!
//! The estimate compares changes of a velocity with its tolerance. From rest the velocity is zero, and the
//! step is hundreds of times too short. Methods that need only some dozens of steps
//! ([`Scheme::LONG_STEPS`](crate::integrate::Scheme::LONG_STEPS)) therefore take a longer step, where the
//! characteristic times of the mechanism allow it: |q|/|q̇|, √(|q|/|q̈|) and |q̈|/|q⃛|. In a part x of the
//! least of them a method of order p has a relative error of order x^(p+1) in |q|; the step is the one for
//! which this is a hundredth of the tolerance, but at most [`MAX_STEP_RATIO`] times the estimate above.
//! Source: Hairer, Nørsett, Wanner, *Solving Ordinary Differential Equations I*, §II.4, "starting step
//! size", steps a to f, and the function `hinit` of the code `dopri5.f`.

use crate::integrate::phase::zip;
use crate::integrate::step::StepError;
use crate::integrate::{Phase, StepNode, System, Tolerances};
use crate::math;
use crate::model::Vector;

/// Largest ratio of the step by characteristic times to the one by the second derivative: see the header. If
/// they differ by more, one of them is not representative of the motion.
const MAX_STEP_RATIO: f64 = 100.0;
/// Length of the Euler step, in parts of the scale of the solution: step b of the source.
const EULER_STEP_SHARE: f64 = 0.01;
/// Local error that the first step aims at, in permitted errors: step e of the source.
const FIRST_ERROR: f64 = 0.01;
/// Norms of the state and of its derivative below this give no scale. The source and `hinit` have 10⁻⁵ for
/// norms, which is 10⁻¹⁰ for their squares.
const ZERO_NORM: f64 = 1e-10;
/// A step where nothing gives a scale, in the model's unit of time: steps b and e of the source.
const STEP_WITHOUT_SCALE: f64 = 1e-6;
/// Derivatives up to this, in permitted errors per unit of time (squared for the
/// second), count as zero: step e of the source.
const ZERO_CURVATURE: f64 = 1e-15;
/// The step where derivatives are zero, in parts of the Euler step: step e of the source. It is short, since
/// a force may act only later.
const UNCURVED_STEP_SHARE: f64 = 1e-3;
/// Largest ratio of the step by the second derivative to the Euler step that estimated it: step f of the
/// source.
const MAX_EULER_STEPS: f64 = 100.0;
/// Most Euler steps that are tried where the accelerations have no value. If none has one, the first step is
/// 10⁻⁸ of the first Euler step, and the loop of attempts reports what has no value.
const MAX_EULER_TRIALS: u32 = 4;
/// Factor from one trial of an Euler step to the next.
const SHORTER_EULER_STEP: f64 = 1e-2;

/// |h| for a method of the given order, which makes `long` steps or not; costs one to four evaluations.
/// `direction` is ±1, `most` an upper bound.
pub(super) fn first_step<V: Vector, S: System<V>>(
    system: &mut S,
    start: &StepNode<V>,
    (order, long): (u32, bool),
    direction: f64,
    most: f64,
    tolerances: &Tolerances,
) -> f64 {
    let slope = start.derivative();
    let size = |x: &Phase<V>| tolerances.norm(x, &start.y, &start.y);
    let (d0, d1) = (size(&start.y), size(&slope));
    let has_scale = d0 >= ZERO_NORM && d1 >= ZERO_NORM && (d0 / d1).is_finite();
    let mut h = if has_scale { EULER_STEP_SHARE * d0 / d1 } else { STEP_WITHOUT_SCALE }.min(most);
    // The Euler step may leave the region where the accelerations exist. Then a smaller one is tried.
    for _ in 0..MAX_EULER_TRIALS {
        let y = zip(&start.y, &slope, |y, k| y + direction * h * k);
        let Ok(a) = system.accelerations(start.t + direction * h, &y.q, &y.u) else {
            h *= SHORTER_EULER_STEP;
            continue;
        };
        let change = zip(&Phase { q: y.u, u: a }, &slope, |x, y| x - y);
        let d2 = size(&change) / h;
        if !d2.is_finite() {
            h *= SHORTER_EULER_STEP;
            continue;
        }
        let curvature = d1.max(d2);
        let fine = if curvature <= ZERO_CURVATURE {
            (h * UNCURVED_STEP_SHARE).max(STEP_WITHOUT_SCALE)
        } else {
            math::powf(FIRST_ERROR / curvature, 1.0 / f64::from(order))
        };
        let of_order = fine.min(MAX_EULER_STEPS * h);
        let characteristic = if long { characteristic_step(start, &a, h, order, tolerances) } else { 0.0 };
        return of_order.max(characteristic.min(MAX_STEP_RATIO * of_order)).min(most);
    }
    h
}

/// The step by the characteristic times of the mechanism, from its accelerations after an Euler step of
/// length `h`; 0 where it has none.
fn characteristic_step<V: Vector>(
    start: &StepNode<V>,
    later: &V,
    h: f64,
    order: u32,
    tolerances: &Tolerances,
) -> f64 {
    let Phase { q, u } = start.y;
    // All in tolerances of q, since only ratios count.
    let size = |x: V| tolerances.norm(&Phase { q: x, u: V::zeros() }, &start.y, &start.y);
    let mut change = *later;
    (0..V::LEN).for_each(|i| change[i] -= start.a[i]);
    let (q, u, a, change) = (size(q), size(u), size(start.a), size(change));
    // Infinite for a quantity that does not change.
    let time = (q / u).min(math::sqrt(q / a)).min(a * h / change);
    let step = time * math::powf(FIRST_ERROR / q, 1.0 / f64::from(order + 1));
    if step.is_finite() { step } else { 0.0 }
}

/// The accelerations at a start, with all branches released.
pub(super) fn start_accelerations<V: Vector, Y: System<V>>(
    system: &mut Y,
    t: f64,
    y: &Phase<V>,
) -> Result<V, StepError<Y::Error>> {
    system.release_branches();
    let a = system.accelerations(t, &y.q, &y.u).map_err(StepError::Evaluation)?;
    match a.as_slice().iter().position(|x| !x.is_finite()) {
        Some(coordinate) => Err(StepError::NotFinite { coordinate, h: 0.0 }),
        None => Ok(a),
    }
}

#[cfg(test)]
mod tests {
    use core::convert::Infallible;

    use super::*;
    use nalgebra::SVector;

    type V = SVector<f64, 1>;

    /// The first step of order 14 of q̈ = a(t, q, u), short and long.
    fn steps(a: impl Fn(f64, f64, f64) -> f64, q: f64, u: f64) -> [f64; 2] {
        let mut system = |t: f64, q: &V, u: &V| Ok::<V, Infallible>(V::new(a(t, q[0], u[0])));
        let start = StepNode { t: 0.0, y: Phase { q: V::new(q), u: V::new(u) }, a: V::new(a(0.0, q, u)) };
        let tolerances = Tolerances::both(1e-6);
        [false, true].map(|long| first_step(&mut system, &start, (14, long), 1.0, 1e3, &tolerances))
    }

    /// √(|q|/|q̈|) is 1/ω from rest, whatever ω is, and order 14 leaves a hundredth of 10⁻⁶ in 0.3 of it.
    #[test]
    fn a_long_step_from_rest_is_a_part_of_the_time_in_which_the_mechanism_moves() {
        for omega in [1e-3f64, 1.0, 1e4] {
            let [short, long] = steps(|_, q, _| -omega * omega * q, 1.0, 0.0);
            assert!(
                (long * omega - 0.314).abs() < 0.001 || long == MAX_STEP_RATIO * short,
                "{short:e} {long:e}"
            );
            // The short one does not know seconds from milliseconds.
            assert!(omega == 1.0 || short < 0.1 * long, "{short:e} {long:e}");
        }
        // The least of the times: a damper that brakes in 10⁻⁴, a motion that is under way, a push that comes
        // up in 10⁻³ make it no longer than it is.
        for [short, long] in [
            steps(|_, q, u| -q - 1e4 * u, 1.0, 0.0),
            steps(|_, q, _| -q, 1.0, 1e3),
            steps(|t, q, _| -q * (t / 1e-3).exp(), 1.0, 0.0),
        ] {
            assert!(long == short || long < 1e-3, "{short:e} {long:e}");
        }
    }

    /// Nothing moves, or nothing tells how large it is: the short step.
    #[test]
    fn without_times_of_its_own_the_first_step_is_short() {
        for (a, q) in [(0.0, 1.0), (1.0, 0.0), (0.0, 0.0)] {
            let [short, long] = steps(|_, _, _| a, q, 0.0);
            assert!(long == short || a > 0.0 && long <= MAX_STEP_RATIO * short, "{short:e} {long:e}");
            assert!(long > 0.0 && long.is_finite());
        }
    }
}

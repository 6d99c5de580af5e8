//! Composition: symmetric compositions of Störmer–Verlet steps to order 4, 6 and 8.
//!
//! * **Problem**: that of [`StormerVerlet`](crate::integrate::StormerVerlet), where more digits are wanted:
//!   celestial and molecular motions over many periods.
//! * **Formula**: Verlet steps of γ₁h, γ₂h, …, γₛh one after the other, γᵢ = γₛ₊₁₋ᵢ, some of them backwards.
//!   Σγ = 1 and the vanishing of Σγ³, Σγ⁵ and of what their commutators leave raise the order: 5 steps for
//!   order 4 (Suzuki), 9 for order 6, 17 for order 8 (Kahan and Li).
//! * **Order** 4, 6 or 8; no error estimate, hence a fixed step.
//! * **Structure**: symplectic and reversible where Verlet's steps are; the energy error stays at O(hᵖ). With
//!   velocities in the forces they are neither, and of order 3 at most.
//! * **Dense output**: the quintic through q, q̇, q̈ at both ends ([`Hermite`](crate::integrate::Hermite)):
//!   its error is O(h⁶) in q, O(h⁵) in u, above that of the ends at order 6 and 8.
//! * **Stability**: oscillations to hω = 2.7, 2.5 and 3.1.
//! * **Rounding**: steps are added by a [`CompensatedSum`].
//! * **Cost**: 5, 9 or 17 evaluations of q̈ per step.
//! * **Source**: Suzuki, Phys. Lett. A 146 (1990) 319; Kahan, Li, Math. Comp. 66 (1997) 1089; Hairer, Lubich,
//!   Wanner, *Geometric Numerical Integration*, 2nd ed., §II.4 and §V.3.2.

use crate::integrate::compensated_summation::CompensatedSum;
use crate::integrate::geometric::stormer_verlet::verlet;
use crate::integrate::phase::zip;
use crate::integrate::{ControllerSettings, Method, Phase, Scheme, StepNode, System, Tolerances};
use crate::model::Vector;

/// Suzuki's five steps, 1/(4 − ∛4): the first two, and the middle one.
const FOURTH: [f64; 3] = [0.4144907717943757, 0.4144907717943757, -0.6579630871775028];
/// Kahan and Li's nine steps of order 6, `s9odr6a`: the first four, and the middle one.
const SIXTH: [f64; 5] =
    [0.3921614440073141, 0.33259913678935943, -0.7062461725576393, 0.0822135962935508, 0.79854399093483];
/// Kahan and Li's seventeen steps of order 8, `s17odr8a`: the first eight, and the middle one.
const EIGHTH: [f64; 9] = [
    0.13020248308889007,
    0.5611629817751084,
    -0.38947496264484727,
    0.1588419065551556,
    -0.39590389413323757,
    0.1845396409783157,
    0.25837438768632204,
    0.2950117236093103,
    -0.6055085338300346,
];

/// A symmetric composition of `S` Verlet steps.
#[derive(Clone, Copy, Debug)]
pub struct Composition<V, const S: usize> {
    k: [Phase<V>; S],
    /// q̈ at the end.
    last: V,
    compensation: CompensatedSum<V>,
}

/// Order 4 by five steps.
pub type Composition4<V> = Composition<V, 5>;
/// Order 6 by nine steps.
pub type Composition6<V> = Composition<V, 9>;
/// Order 8 by seventeen steps.
pub type Composition8<V> = Composition<V, 17>;

/// The steps of a composition, first half and middle.
pub(in crate::integrate) const fn half(steps: usize) -> &'static [f64] {
    match steps {
        5 => &FOURTH,
        9 => &SIXTH,
        17 => &EIGHTH,
        _ => panic!("there is no composition of so many steps"),
    }
}

impl<V: Vector, const S: usize> Composition<V, S> {
    const HALF: &'static [f64] = half(S);

    /// γᵢ.
    #[inline(always)]
    fn share(i: usize) -> f64 {
        Self::HALF[if i < Self::HALF.len() { i } else { S - 1 - i }]
    }
}

impl<V: Vector, const S: usize> Scheme<V> for Composition<V, S> {
    const METHOD: Method = match S {
        5 => Method::Composition4,
        9 => Method::Composition6,
        _ => Method::Composition8,
    };
    const ORDER: u32 = match S {
        5 => 4,
        9 => 6,
        _ => 8,
    };
    const ERROR_ORDER: u32 = Self::ORDER;
    const CONTROL: Option<ControllerSettings> = None;
    const WEIGHTS: &'static [f64] = &[];
    const STABILITY_BORDER: f64 = 2.5;
    const EVENT_PANELS: usize = 8;
    quintic!(V);

    fn new() -> Self {
        Self { k: [Phase::zeros(); S], last: V::zeros(), compensation: CompensatedSum::new() }
    }

    #[inline(always)]
    fn attempt<Y: System<V>>(
        &mut self,
        system: &mut Y,
        start: &StepNode<V>,
        h: f64,
        _: &Tolerances,
    ) -> Result<(Phase<V>, f64), Y::Error> {
        // The changes of the Verlet steps are summed before they are added to the start. So positions are
        // rounded once, and backward steps cancel forward ones also far from the origin of q.
        let (mut knot, mut way, mut done) = (*start, Phase::zeros(), 0.0);
        for i in 0..S {
            self.k[i] = knot.derivative();
            let a = verlet(system, &start.y, &mut way, &knot, Self::share(i) * h)?;
            done += Self::share(i);
            let y = zip(&start.y, &way, |y, way| y + way);
            knot = StepNode { t: start.t + done * h, y, a };
            if system.has_velocity_forces() {
                knot.a = system.accelerations(knot.t, &y.q, &y.u)?;
            }
        }
        self.last = knot.a;
        Ok((self.compensation.add(&start.y, &way), 0.0))
    }

    #[inline(always)]
    fn finish<Y: System<V>>(&mut self, _: &mut Y, _: f64, _: &Phase<V>) -> Result<V, Y::Error> {
        Ok(self.last)
    }

    fn stages(&self) -> &[Phase<V>] {
        &self.k
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Σγ = 1, Σγ³ = Σγ⁵ = … = 0 below the order: the conditions of the trees without branches. The others
    /// are seen in the observed order.
    #[test]
    fn odd_powers_of_the_steps_cancel() {
        for (steps, powers) in [(5, &[3][..]), (9, &[3, 5]), (17, &[3, 5, 7])] {
            let half = half(steps);
            let sum = |power: i32| {
                let (middle, first) = half.split_last().expect("not empty");
                2.0 * first.iter().map(|g| g.powi(power)).sum::<f64>() + middle.powi(power)
            };
            assert_eq!(2 * half.len() - 1, steps);
            assert!((sum(1) - 1.0).abs() < 4e-16, "{}", sum(1));
            for power in powers {
                assert!(sum(*power).abs() < 1e-15, "{steps} steps, power {power}: {:e}", sum(*power));
            }
        }
    }
}

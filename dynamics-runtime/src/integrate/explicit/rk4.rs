//! RK4: the classical Runge–Kutta method.
//!
//! * **Problem**: smooth, not stiff; a step known to suit it (real time, comparison, fixed sampling).
//! * **Formula**: y₁ = y₀ + h/6·(k₁ + 2k₂ + 2k₃ + k₄), k₂ and k₃ at the middle, k₄ at the end.
//! * **Order** 4; local error O(h⁵); no error estimate, hence a fixed step.
//! * **Dense output**: the quintic through q, q̇, q̈ at both ends ([`Hermite`](crate::integrate::Hermite)),
//!   of higher order than the step.
//! * **Stability**: real axis to −2.79, imaginary axis to ±2.83.
//! * **Cost**: 4 evaluations of q̈ per step.
//! * **Source**: Kutta, Z. Math. Phys. 46 (1901) 435; Hairer, Nørsett, Wanner, *Solving ODE I*, §II.1.

use crate::integrate::explicit::tableau::{TableauRow, advance, stiffness, sum, unrolled_stages};
use crate::integrate::phase::zip;
use crate::integrate::{ControllerSettings, Method, Phase, Scheme, StepNode, System, Tolerances};
use crate::math;
use crate::model::Vector;

const C: [f64; 4] = [0.0, 0.5, 0.5, 1.0];
const A2: TableauRow<1> = [(0, 0.5)];
const A3: TableauRow<1> = [(1, 0.5)];
const A4: TableauRow<1> = [(2, 1.0)];
const B: TableauRow<4> = [(0, 1.0 / 6.0), (1, 1.0 / 3.0), (2, 1.0 / 3.0), (3, 1.0 / 6.0)];

/// The classical Runge–Kutta method, order 4.
#[derive(Clone, Copy, Debug)]
pub struct Rk4<V> {
    k: [Phase<V>; 4],
    last: Phase<V>,
    h: f64,
}

impl<V: Vector> Scheme<V> for Rk4<V> {
    const METHOD: Method = Method::Rk4;
    const IS_EXPLICIT: bool = true;
    const ORDER: u32 = 4;
    const ERROR_ORDER: u32 = 4;
    const CONTROL: Option<ControllerSettings> = None;
    const WEIGHTS: &'static [f64] = &[1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0];
    const STABILITY_BORDER: f64 = 2.785;
    const EVENT_PANELS: usize = 4;
    quintic!(V);

    fn new() -> Self {
        Self { k: [Phase::zeros(); 4], last: Phase::zeros(), h: 0.0 }
    }

    #[inline(always)]
    fn attempt<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        h: f64,
        _: &Tolerances,
    ) -> Result<(Phase<V>, f64), S::Error> {
        let StepNode { t, y, .. } = start;
        self.h = h;
        let k = &mut self.k;
        k[0] = start.derivative();
        self.last = unrolled_stages!(system, (t, y, h), C, k, [1: A2, 2: A3, 3: A4]);
        Ok((advance(y, h, &B, k), 0.0))
    }

    fn stages(&self) -> &[Phase<V>] {
        &self.k
    }

    /// The difference of the two middle stages, and that of their sum from the stages at the ends: both of
    /// second order.
    fn stage_disagreement(&self) -> Phase<V> {
        let middle = sum(&[(1, -1.0), (2, 1.0)], &self.k);
        let ends = sum(&[(0, 1.0), (1, -1.0), (2, -1.0), (3, 1.0)], &self.k);
        zip(&middle, &ends, |middle, ends| self.h / 6.0 * math::max(middle.abs(), ends.abs()))
    }

    fn stiffness(&self, h: f64, end: &StepNode<V>) -> Option<f64> {
        stiffness(h, (&end.y, &end.a), (&self.last, &self.k[3].u))
    }
}

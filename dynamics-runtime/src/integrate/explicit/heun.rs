//! Heun: Heun's method of order 2, for teaching.
//!
//! * **Problem**: none that another method would not solve better. It shows what a predictor and a second
//!   evaluation gain: order 2. For the same accuracy [`Rk4`](crate::integrate::Rk4) costs less in all but the
//!   roughest runs.
//! * **Formula**: y₁ = y₀ + h/2·(k₁ + k₂) with k₁ at the start and k₂ at the end y₀ + h k₁
//!   of an Euler step: the trapezoidal rule with a predictor.
//! * **Order** 2; local error O(h³); no error estimate, hence a fixed step.
//! * **Dense output**: the quintic through q, q̇, q̈ at both ends ([`Hermite`](crate::integrate::Hermite)).
//! * **Stability**: real axis to −2, nothing of the imaginary axis. The amplitude of an undamped
//!   oscillation grows by √(1 + h⁴ω⁴/4) in each step.
//! * **Cost**: 2 evaluations of q̈ per step.
//! * **Source**: Heun, Z. Math. Phys. 45 (1900) 23; Hairer, Nørsett, Wanner, *Solving ODE I*, §II.1.

use crate::integrate::explicit::tableau::{TableauRow, advance, stiffness, sum, unrolled_stages};
use crate::integrate::phase::scaled;
use crate::integrate::{ControllerSettings, Method, Phase, Scheme, StepNode, System, Tolerances};
use crate::model::Vector;

const C: [f64; 2] = [0.0, 1.0];
const A2: TableauRow<1> = [(0, 1.0)];
const B: TableauRow<2> = [(0, 0.5), (1, 0.5)];

/// Heun's method, order 2, for teaching.
#[derive(Clone, Copy, Debug)]
pub struct Heun<V> {
    k: [Phase<V>; 2],
    /// The end of the Euler step.
    predicted: Phase<V>,
    h: f64,
}

impl<V: Vector> Scheme<V> for Heun<V> {
    const METHOD: Method = Method::Heun;
    const IS_EXPLICIT: bool = true;
    const ORDER: u32 = 2;
    const ERROR_ORDER: u32 = 2;
    const CONTROL: Option<ControllerSettings> = None;
    const WEIGHTS: &'static [f64] = &[0.5, 0.5];
    const STABILITY_BORDER: f64 = 2.0;
    const EVENT_PANELS: usize = 4;
    quintic!(V);

    fn new() -> Self {
        Self { k: [Phase::zeros(); 2], predicted: Phase::zeros(), h: 0.0 }
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
        self.predicted = unrolled_stages!(system, (t, y, h), C, k, [1: A2]);
        Ok((advance(y, h, &B, k), 0.0))
    }

    fn stages(&self) -> &[Phase<V>] {
        &self.k
    }

    /// What the corrector changes: the error of the Euler step, of second order.
    fn stage_disagreement(&self) -> Phase<V> {
        scaled(0.5 * self.h, &sum(&[(0, -1.0), (1, 1.0)], &self.k))
    }

    fn stiffness(&self, h: f64, end: &StepNode<V>) -> Option<f64> {
        stiffness(h, (&end.y, &end.a), (&self.predicted, &self.k[1].u))
    }
}

//! ExplicitEuler: Euler's method, for teaching.
//!
//! * **Problem**: none that another method would not solve better. It shows what order 1 means, and that a
//!   method can add energy: an oscillator spirals outwards at every step size. At the same cost
//!   [`SemiImplicitEuler`](crate::integrate::SemiImplicitEuler) keeps oscillations bounded; for the same
//!   accuracy [`Rk4`](crate::integrate::Rk4) costs far less.
//! * **Formula**: q₁ = q₀ + h u₀, u₁ = u₀ + h q̈(t₀, q₀, u₀).
//! * **Order** 1; local error O(h²); no error estimate, hence a fixed step.
//! * **Dense output**: the quintic through q, q̇, q̈ at both ends ([`Hermite`](crate::integrate::Hermite)).
//! * **Stability**: the disc |1 + hλ| ≤ 1: real axis to −2, nothing of the imaginary axis. The amplitude
//!   of an undamped oscillation grows by √(1 + h²ω²) in each step.
//! * **Cost**: 1 evaluation of q̈ per step.
//! * **Source**: Euler, *Institutiones calculi integralis* I (1768) §650; Hairer, Nørsett, Wanner, *Solving
//!   ODE I*, §I.7.

use crate::integrate::phase::zip;
use crate::integrate::{ControllerSettings, Method, Phase, Scheme, StepNode, System, Tolerances};
use crate::model::Vector;

/// Euler's method, order 1, for teaching.
#[derive(Clone, Copy, Debug)]
pub struct ExplicitEuler<V> {
    k: [Phase<V>; 1],
}

// `IS_EXPLICIT` is false: the only stage is the start of the step, which lies on the constraints.
impl<V: Vector> Scheme<V> for ExplicitEuler<V> {
    const METHOD: Method = Method::ExplicitEuler;
    const ORDER: u32 = 1;
    const ERROR_ORDER: u32 = 1;
    const CONTROL: Option<ControllerSettings> = None;
    const WEIGHTS: &'static [f64] = &[1.0];
    const STABILITY_BORDER: f64 = 2.0;
    const EVENT_PANELS: usize = 4;
    quintic!(V);

    fn new() -> Self {
        Self { k: [Phase::zeros()] }
    }

    #[inline(always)]
    fn attempt<S: System<V>>(
        &mut self,
        _: &mut S,
        start: &StepNode<V>,
        h: f64,
        _: &Tolerances,
    ) -> Result<(Phase<V>, f64), S::Error> {
        self.k[0] = start.derivative();
        Ok((zip(&start.y, &self.k[0], |y, k| y + h * k), 0.0))
    }

    fn stages(&self) -> &[Phase<V>] {
        &self.k
    }
}

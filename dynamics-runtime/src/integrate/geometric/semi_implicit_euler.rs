//! SemiImplicitEuler: the semi-implicit (symplectic) Euler method.
//!
//! * **Problem**: real time at a fixed rate, with time for one evaluation per step, and accuracy of about one
//!   per cent.
//! * **Formula**: u₁ = u₀ + h a(t₀, q₀, u₀), q₁ = q₀ + h u₁: positions move with the new velocities. That one
//!   difference from Euler's method keeps oscillations from growing.
//! * **Order** 1; no error estimate, hence a fixed step.
//! * **Structure**: symplectic where q̈ = a(t, q) comes from a potential and a constant M; energy then errs
//!   by O(h) for exponentially long times.
//! * **Dense output**: the quintic through q, q̇, q̈ at both ends ([`Hermite`](crate::integrate::Hermite)).
//! * **Stability**: oscillations to hω = 2.
//! * **Cost**: 1 evaluation of q̈ per step.
//! * **Source**: Hairer, Lubich, Wanner, *Geometric Numerical Integration*, 2nd ed., §I.1.2 and §VI.3.

use crate::integrate::phase::zip;
use crate::integrate::{ControllerSettings, Method, Phase, Scheme, StepNode, System, Tolerances};
use crate::model::Vector;

/// The semi-implicit Euler method, order 1.
#[derive(Clone, Copy, Debug)]
pub struct SemiImplicitEuler<V> {
    k: [Phase<V>; 1],
}

impl<V: Vector> Scheme<V> for SemiImplicitEuler<V> {
    const METHOD: Method = Method::SemiImplicitEuler;
    const ORDER: u32 = 1;
    const ERROR_ORDER: u32 = 1;
    const CONTROL: Option<ControllerSettings> = None;
    const WEIGHTS: &'static [f64] = &[];
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
        let moved = zip(&start.y, &self.k[0], |y, k| y + h * k);
        let q = zip(&start.y, &Phase { q: moved.u, u: moved.u }, |q, u| q + h * u).q;
        Ok((Phase { q, u: moved.u }, 0.0))
    }

    fn stages(&self) -> &[Phase<V>] {
        &self.k
    }
}

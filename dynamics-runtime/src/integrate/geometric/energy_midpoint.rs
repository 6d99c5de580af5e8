//! EnergyMidpoint: the midpoint rule with Gonzalez's discrete gradient: energy to rounding.
//!
//! * **Problem**: long motions of conservative systems at large steps, where energy has to be kept exactly:
//!   as a bound on the motion, for instance, that no step may break.
//! * **Formula**: q₁ = q₀ + h ū, u₁ = u₀ + h (a(q̄, ū) + β ū), ū = (u₀ + u₁)/2, q̄ = (q₀ + q₁)/2, with β such
//!   that E(q₁, u₁) = E(q₀, u₀). While M is constant and a = −M⁻¹∇V, this is the discrete gradient ∇V(q̄) +
//!   (ΔV − ∇V(q̄)·Δq)/(ΔqᵀMΔq) MΔq. β is O(h²): the rule is of order 2.
//! * **Order** 2; no error estimate, hence a fixed step.
//! * **Structure**: keeps E to rounding, however many the steps (what rounding leaves of one step is made
//!   good in the next: 2·10⁻¹⁴ of T and V up to 10 after 10⁶ steps of Kepler's problem with e = 0.9),
//!   symmetric and reversible; not symplectic, and it keeps no momenta. Systems that do not tell their energy
//!   ([`Canonical::energy`](crate::integrate::Canonical::energy)) get the midpoint rule.
//! * **Dense output**: the quintic through q, q̇, q̈ at both ends ([`Hermite`](crate::integrate::Hermite)).
//! * **Stability**: energy bounds the motion; the iterations converge to hω = 1, and from hω = 2 on the step
//!   is refused.
//! * **Cost**: 1 evaluation of q̈ and 3 of E per iteration, 6 to 15 iterations a step, 1 of q̈ at its end and
//!   1 of E at either.
//! * **Source**: Gonzalez, J. Nonlinear Sci. 6 (1996) 449; Hairer, Lubich, Wanner, *Geometric Numerical
//!   Integration*, 2nd ed., §V.5.

use crate::integrate::geometric::fixed_point::{Course, FixedPoint, correction};
use crate::integrate::phase::zip;
use crate::integrate::{ControllerSettings, Method, Phase, Scheme, StepNode, System, Tolerances};
use crate::model::Vector;

/// Below this part of the energy's size, motion is too slow to take up what is missing of it: at turning
/// points, where the rule itself errs least.
const SLOW: f64 = 1e-13;
/// As much of the energies is rounding.
const ROUNDED: f64 = 8.0 * f64::EPSILON;
/// Iterations after which only rounding is missing of the energy, if it is as small as that: what is slow
/// takes it up by corrections without end.
const FIRST: u32 = 3;

/// The midpoint rule that keeps the energy, order 2.
#[derive(Clone, Copy, Debug)]
pub struct EnergyMidpoint<V> {
    k: [Phase<V>; 2],
    solved: bool,
    kept: Option<LastStep<V>>,
}

/// What the last step kept.
#[derive(Clone, Copy, Debug)]
struct LastStep<V> {
    energy: f64,
    /// Where it started and ended, with the energies that these states have.
    states: [(Phase<V>, f64); 2],
}

impl<V: Vector> EnergyMidpoint<V> {
    /// The end of the step whose velocities change by h (a + β ū), with the middle of both.
    fn end(start: &Phase<V>, h: f64, a: &V, middle: &V, beta: f64) -> Phase<V> {
        let mut end = *start;
        for l in 0..V::LEN {
            end.u[l] = start.u[l] + h * (a[l] + beta * middle[l]);
            end.q[l] = start.q[l] + 0.5 * h * (start.u[l] + end.u[l]);
        }
        end
    }
}

impl<V: Vector> Scheme<V> for EnergyMidpoint<V> {
    const METHOD: Method = Method::EnergyMidpoint;
    const ORDER: u32 = 2;
    const ERROR_ORDER: u32 = 2;
    const CONTROL: Option<ControllerSettings> = None;
    const WEIGHTS: &'static [f64] = &[];
    const STABILITY_BORDER: f64 = f64::INFINITY;
    const SCAN: usize = 4;
    quintic!(V);

    fn new() -> Self {
        Self { k: [Phase::zeros(); 2], solved: true, kept: None }
    }

    fn attempt<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        h: f64,
        _: &Tolerances,
    ) -> Result<(Phase<V>, f64), S::Error> {
        self.k[0] = start.derivative();
        let (y0, middle_t) = (&start.y, start.t + 0.5 * h);
        let own = system.energy(start.t, y0);
        // Of the state from which the run goes on, not of this step's start: what rounding leaves of one step
        // is not left again in the next. A state that has another energy by now is one of another system,
        // whose parameters or inputs have changed since.
        let goes_on = |own: f64| self.kept.filter(|kept| kept.states.contains(&(*y0, own)));
        let energy = own.map(|own| goes_on(own).map_or(own, |kept| kept.energy));
        // Positions follow from velocities, here as in every iteration: where velocities stand, all stands.
        let mut end = Self::end(y0, h, &start.a, &y0.u, 0.0);
        let (mut beta, mut course, mut iteration) = (0.0, FixedPoint::new(), 0);
        loop {
            let middle = zip(y0, &end, |a, b| 0.5 * (a + b));
            let a = system.accelerations(middle_t, &middle.q, &middle.u)?;
            self.k[1] = Phase { q: middle.u, u: a };
            if let Some(energy) = energy {
                let missing = |end: &Phase<V>, system: &mut S| {
                    system.energy(start.t + h, end).map_or(0.0, |there| energy - there)
                };
                let rest = Phase { q: middle.q, u: V::zeros() };
                let at = |y: &Phase<V>, system: &mut S| system.energy(middle_t, y).unwrap_or(energy);
                // T of the middle: E is quadratic in u.
                let at_rest = at(&rest, system);
                let motion = at(&middle, system) - at_rest;
                if motion.abs() > SLOW * energy.abs() {
                    let missing = missing(&Self::end(y0, h, &a, &middle.u, beta), system);
                    let rounding = ROUNDED * energy.abs().max(at_rest.abs());
                    if iteration < FIRST || missing.abs() > rounding {
                        beta += missing / (2.0 * h * motion);
                    }
                }
            }
            let new = Self::end(y0, h, &a, &middle.u, beta);
            let values = (0..V::LEN).map(|l| (end.u[l], new.u[l], y0.u[l]));
            let next = course.after(correction(values, (y0.q.as_slice(), h)));
            (end, iteration) = (new, iteration + 1);
            // What is not finite makes an end that is not, and that is what is said then.
            self.solved = next != Course::Lost || !end.is_finite();
            if next != Course::Again || !end.is_finite() {
                let there = own.zip(system.energy(start.t + h, &end));
                let states = there.map(|(own, there)| [(*y0, own), (end, there)]);
                self.kept = energy.zip(states).map(|(energy, states)| LastStep { energy, states });
                return Ok((end, 0.0));
            }
        }
    }

    fn finish<S: System<V>>(&mut self, system: &mut S, end_t: f64, end: &Phase<V>) -> Result<V, S::Error> {
        system.accelerations(end_t, &end.q, &end.u)
    }

    fn forget(&mut self) {
        self.kept = None;
    }

    fn stages(&self) -> &[Phase<V>] {
        &self.k
    }

    fn error_vector(&self) -> Phase<V> {
        Phase::zeros()
    }

    fn converged(&self) -> bool {
        self.solved
    }

    fn stiffness(&self, _: f64, _: &StepNode<V>) -> Option<f64> {
        None
    }
}

//! EnergyMidpoint: the midpoint rule with Gonzalez's discrete gradient: energy to rounding.
//!
//! * **Problem**: long motions of conservative systems at large steps, where energy has to be kept exactly:
//!   as a bound on the motion, for instance, that no step may break.
//! * **Formula**: q₁ = q₀ + h ū, u₁ = u₀ + h (a(q̄, ū) + β ū), ū = (u₀ + u₁)/2, q̄ = (q₀ + q₁)/2, with β such
//!   that E(q₁, u₁) = E(q₀, u₀). While M is constant and a = −M⁻¹∇V, this is the discrete gradient ∇V(q̄) +
//!   (ΔV − ∇V(q̄)·Δq)/(ΔqᵀMΔq) MΔq. β is O(h²): the rule is of order 2.
//! * **Order** 2; no error estimate, hence a fixed step.
//! * **Structure**: keeps E to rounding, however many the steps (each corrects the rounding of the one
//!   before: 2·10⁻¹⁴ of T and V up to 10 after 10⁶ steps of Kepler's problem with e = 0.9),
//!   symmetric and reversible; not symplectic, and it keeps no momenta. Systems without
//!   [`Canonical::energy`](crate::integrate::Canonical::energy) get the midpoint rule.
//! * **Dense output**: the quintic through q, q̇, q̈ at both ends ([`Hermite`](crate::integrate::Hermite)).
//! * **Stability**: energy bounds the motion; the iterations converge to hω = 1, and from hω = 2 on the step
//!   is an error.
//! * **Cost**: 1 evaluation of q̈ and 3 of E per iteration, 6 to 15 iterations a step, 1 of q̈ at its end and
//!   1 of E at either.
//! * **Source**: Gonzalez, J. Nonlinear Sci. 6 (1996) 449; Hairer, Lubich, Wanner, *Geometric Numerical
//!   Integration*, 2nd ed., §V.5.

use crate::integrate::geometric::fixed_point::{FixedPoint, IterationStatus, relative_correction};
use crate::integrate::phase::zip;
use crate::integrate::{ControllerSettings, Method, Phase, Scheme, StepNode, System, Tolerances};
use crate::model::Vector;

/// A kinetic energy below this part of the energy is not corrected: at turning points a small defect would
/// take a large β, and the rule itself errs least there.
const MIN_KINETIC_PART: f64 = 1e-13;
/// Relative rounding of the energies.
const ENERGY_ROUNDING: f64 = 8.0 * f64::EPSILON;
/// After so many iterations a defect of the energy as small as its rounding is no longer corrected: slow
/// motions would take corrections without end.
const ITERATIONS_WITH_CORRECTION: u32 = 3;

/// The midpoint rule that keeps the energy, order 2.
#[derive(Clone, Copy, Debug)]
pub struct EnergyMidpoint<V> {
    k: [Phase<V>; 2],
    solved: bool,
    last: Option<LastEnergyStep<V>>,
}

/// The last step.
#[derive(Clone, Copy, Debug)]
struct LastEnergyStep<V> {
    /// The energy that the run conserves.
    energy: f64,
    /// Its start and its end, with the energies of these states.
    states: [(Phase<V>, f64); 2],
}

impl<V: Vector> EnergyMidpoint<V> {
    /// The end of the step whose velocities change by h (a + β ū), with ū = `middle`.
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
    const EVENT_PANELS: usize = 4;
    quintic!(V);

    fn new() -> Self {
        Self { k: [Phase::zeros(); 2], solved: true, last: None }
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
        // The energy of the run, not of this state: rounding errors of the steps do not add up. If the state
        // has another energy than it had at the end of the last step, parameters or inputs have changed.
        let continued = |own: f64| self.last.filter(|last| last.states.contains(&(*y0, own)));
        let energy = own.map(|own| continued(own).map_or(own, |last| last.energy));
        // Positions follow from velocities in every iteration, so that only velocities have to converge.
        let mut end = Self::end(y0, h, &start.a, &y0.u, 0.0);
        let (mut beta, mut progress, mut iteration) = (0.0, FixedPoint::new(), 0);
        loop {
            let middle = zip(y0, &end, |a, b| 0.5 * (a + b));
            let a = system.accelerations(middle_t, &middle.q, &middle.u)?;
            self.k[1] = Phase { q: middle.u, u: a };
            // β from the defect of the energy: E changes by 2hβ times the kinetic energy of the middle.
            if let Some(energy) = energy {
                let missing = |end: &Phase<V>, system: &mut S| {
                    system.energy(start.t + h, end).map_or(0.0, |there| energy - there)
                };
                let rest = Phase { q: middle.q, u: V::zeros() };
                let at = |y: &Phase<V>, system: &mut S| system.energy(middle_t, y).unwrap_or(energy);
                // The kinetic energy of the middle, since E is quadratic in u.
                let at_rest = at(&rest, system);
                let motion = at(&middle, system) - at_rest;
                if motion.abs() > MIN_KINETIC_PART * energy.abs() {
                    let missing = missing(&Self::end(y0, h, &a, &middle.u, beta), system);
                    let rounding = ENERGY_ROUNDING * energy.abs().max(at_rest.abs());
                    if iteration < ITERATIONS_WITH_CORRECTION || missing.abs() > rounding {
                        beta += missing / (2.0 * h * motion);
                    }
                }
            }
            // The end with this β, and whether the iterations have converged.
            let new = Self::end(y0, h, &a, &middle.u, beta);
            let values = (0..V::LEN).map(|l| (end.u[l], new.u[l], y0.u[l]));
            let next = progress.judge(relative_correction(values, (y0.q.as_slice(), h)));
            (end, iteration) = (new, iteration + 1);
            // Values that are not finite lead to an end that is not, and the stepper reports that.
            self.solved = next != IterationStatus::Diverged || !end.is_finite();
            if next != IterationStatus::Continue || !end.is_finite() {
                let there = own.zip(system.energy(start.t + h, &end));
                let states = there.map(|(own, there)| [(*y0, own), (end, there)]);
                self.last = energy.zip(states).map(|(energy, states)| LastEnergyStep { energy, states });
                return Ok((end, 0.0));
            }
        }
    }

    fn forget_history(&mut self) {
        self.last = None;
    }

    fn stages(&self) -> &[Phase<V>] {
        &self.k
    }

    fn has_converged(&self) -> bool {
        self.solved
    }
}

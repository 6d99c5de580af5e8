//! StormerVerlet: the Störmer–Verlet method in its velocity form, with RATTLE for constraints.
//!
//! * **Problem**: long motions of conservative systems whose forces depend on positions and time alone, at
//!   moderate accuracy: energy and invariants stay near their values however long the motion, where other
//!   methods lose or gain a little in every step.
//! * **Formula**: u½ = u₀ + h/2·a₀, q₁ = q₀ + h u½, u₁ = u½ + h/2·a₁. With holonomic constraints q₁ is moved
//!   along M⁻¹Φ_qᵀ(q₀) onto Φ = 0 and u½ with it, then u₁ along M⁻¹Φ_qᵀ(q₁) onto Φ̇ = 0: RATTLE, symplectic
//!   and reversible on the constraints as Verlet's is without.
//! * **Order** 2; no error estimate, hence a fixed step: a step that varied would lose what the method is
//!   for.
//! * **Structure**: symplectic, reversible, keeps linear and quadratic momenta to rounding. The energy error
//!   is bounded by O(h²) for times exponentially long in 1/h, as the step is all but exactly a motion of a
//!   nearby energy. True while M is constant and forces have no velocities: simulations refuse other models,
//!   since M(q) brings velocities into Q. Systems with velocity forces
//!   ([`Accelerations::has_velocity_forces`](crate::integrate::Accelerations::has_velocity_forces)) are
//!   evaluated twice per step, which keeps order 2 and nothing else.
//! * **Change points** are not passed: near a position where constraints lose rank, moves along their
//!   gradients at the start of a step do not reach Φ = 0 at its end. Simulations end there with an error that
//!   names the position and the methods that pass it.
//! * **Resonance**: steps near hω = π/2, 2π/3, … of a nonlinear oscillation excite it by the step; hω < 1 is
//!   safe.
//! * **Dense output**: the quintic through q, q̇, q̈ at both ends ([`Hermite`](crate::integrate::Hermite)).
//! * **Stability**: oscillations to hω = 2.
//! * **Cost**: 1 evaluation of q̈ per step; with constraints 2, and corrections.
//! * **Source**: Hairer, Lubich, Wanner, *Geometric Numerical Integration*, 2nd ed., §I.1.4, §VI.3, §VII.1.4,
//!   §IX; Andersen, J. Comput. Phys. 52 (1983) 24; Leimkuhler, Skeel, J. Comput. Phys. 112 (1994) 117.

use crate::integrate::phase::{plus_scaled, zip};
use crate::integrate::{ControllerSettings, Method, Phase, Scheme, StepNode, System, Tolerances};
use crate::model::Vector;

/// One step of the velocity form, without constraints. It starts at (t, q̈) and at the state `y` plus the
/// displacement `way`, to which its change is added. Returns q̈ at its end, at the velocity u½ + h/2·a₀.
#[inline(always)]
pub(super) fn verlet<V: Vector, S: System<V>>(
    system: &mut S,
    y: &Phase<V>,
    way: &mut Phase<V>,
    StepNode { t, a, .. }: &StepNode<V>,
    h: f64,
) -> Result<V, S::Error> {
    let half = plus_scaled(&way.u, 0.5 * h, a);
    let u = plus_scaled(&y.u, 1.0, &half);
    way.q = plus_scaled(&way.q, h, &u);
    let a = system.accelerations(t + h, &plus_scaled(&y.q, 1.0, &way.q), &plus_scaled(&u, 0.5 * h, a))?;
    way.u = plus_scaled(&half, 0.5 * h, &a);
    Ok(a)
}

/// The second half of a step: state and derivative at its end.
#[inline(always)]
fn end<V: Vector, S: System<V>>(
    system: &mut S,
    start: &StepNode<V>,
    h: f64,
    q: V,
    half: V,
) -> Result<(Phase<V>, Phase<V>), S::Error> {
    let a = system.accelerations(start.t + h, &q, &plus_scaled(&half, 0.5 * h, &start.a))?;
    let y = Phase { q, u: plus_scaled(&half, 0.5 * h, &a) };
    Ok((y, Phase { q: y.u, u: a }))
}

/// Störmer's and Verlet's method, order 2.
#[derive(Clone, Copy, Debug)]
pub struct StormerVerlet<V> {
    k: [Phase<V>; 2],
}

/// The same with holonomic constraints: RATTLE, order 2.
#[derive(Clone, Copy, Debug)]
pub struct Rattle<V> {
    k: [Phase<V>; 2],
}

macro_rules! scheme {
    ($name:ident, $attempt:expr) => {
        impl<V: Vector> Scheme<V> for $name<V> {
            const METHOD: Method = Method::$name;
            const ORDER: u32 = 2;
            const ERROR_ORDER: u32 = 2;
            const CONTROL: Option<ControllerSettings> = None;
            const WEIGHTS: &'static [f64] = &[];
            const STABILITY_BORDER: f64 = 2.0;
            const EVENT_PANELS: usize = 4;
            quintic!(V);

            fn new() -> Self {
                Self { k: [Phase::zeros(); 2] }
            }

            #[inline(always)]
            fn attempt<S: System<V>>(
                &mut self,
                system: &mut S,
                start: &StepNode<V>,
                h: f64,
                _: &Tolerances,
            ) -> Result<(Phase<V>, f64), S::Error> {
                self.k[0] = start.derivative();
                let (y, derivative) = $attempt(system, start, h)?;
                self.k[1] = derivative;
                Ok((y, 0.0))
            }

            #[inline(always)]
            fn finish<S: System<V>>(
                &mut self,
                system: &mut S,
                end_t: f64,
                end: &Phase<V>,
            ) -> Result<V, S::Error> {
                if system.has_velocity_forces() {
                    system.accelerations(end_t, &end.q, &end.u)
                } else {
                    Ok(self.k[1].u)
                }
            }

            fn stages(&self) -> &[Phase<V>] {
                &self.k
            }
        }
    };
}

scheme!(StormerVerlet, |system: &mut S, start: &StepNode<V>, h: f64| {
    let mut way = Phase::zeros();
    let a = verlet(system, &start.y, &mut way, start, h)?;
    let y = zip(&start.y, &way, |y, way| y + way);
    Ok((y, Phase { q: y.u, u: a }))
});
scheme!(Rattle, |system: &mut S, start: &StepNode<V>, h: f64| {
    let mut half = plus_scaled(&start.y.u, 0.5 * h, &start.a);
    let free = plus_scaled(&start.y.q, h, &half);
    let mut q = free;
    system.project_position(start, h, &mut q)?;
    let change = zip(&Phase { q, u: q }, &Phase { q: free, u: free }, |held, free| held - free).q;
    half = plus_scaled(&half, 1.0 / h, &change);
    end(system, start, h, q, half)
});

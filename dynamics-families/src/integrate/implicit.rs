//! Implicit midpoint rule, Newmark's method, generalized-α.
//!
//! * **Problem**: M q̈ = Q(t, q, q̇) with oscillations that are faster than the steps; fixed step.
//! * **Formula**: one acceleration a₁ per step is unknown. With a₀ from the step before,
//!
//! ```text
//! M (μ₁ a₁ + μ₀ a₀) = Q(t + e h, q + e h u + h² (ξ₁ a₁ + ξ₀ a₀), u + h (η₁ a₁ + η₀ a₀))
//! q₁ = q + h u + h² (z₁ a₁ + z₀ a₀)      u₁ = u + h (w₁ a₁ + w₀ a₀)
//! ```
//!
//!   Generalized-α: μ₀ = α_m = (2ρ − 1)/(ρ + 1), e = 1 − α_f = 1/(ρ + 1), γ = 1/2 − α_m + α_f,
//!   β = (1 − α_m + α_f)²/4. Newmark: μ₁ = e = 1, γ = 1/2, β = 1/4. Midpoint: μ₁ = 1, e = 1/2, ξ₁ = 1/4,
//!   η₁ = 1/2, z₁ = 1/2, w₁ = 1.
//! * **Order** 2; stable at any step for linear models without negative damping.
//! * **Equations**: Newton with the tangent μ₁ M + η₁ h D + ξ₁ h² K, whose factors are kept as long as
//!   corrections shrink fast; corrections are measured by √Σ mᵢ xᵢ².
//! * **Source**: Newmark, J. Eng. Mech. Div. ASCE 85 (1959) 67; Chung, Hulbert, J. Appl. Mech. 60 (1993) 371.

use crate::equations::Equations;
use crate::failure::FamilyErrorKind;
use crate::integrate::{FixedStep, Point};
use crate::mass::coordinate_name;
use crate::methods::FamilyMethod;
use crate::model::{FamilyModel, Sizes, View};
use crate::tangent::{Coefficients, Tangent};

/// Most corrections of a step.
const MOST_ITERATIONS: u32 = 30;
/// Corrections that shrink less need a new tangent.
const SLOW: f64 = 0.2;
/// Error that is left, in parts of the size of accelerations.
const ACCURACY: f64 = 1e-13;
/// Corrections below this that no longer shrink are rounding.
const ROUNDING: f64 = 1e-9;
/// Accelerations are known no better than positions over h², to so many units in their last place.
const LAST_PLACES: f64 = 4.0;
/// Corrections below so many of these that no longer shrink are rounding, too.
const ROUNDED_PLACES: f64 = 100.0;

/// The coefficients of the head of this file: of (a₀, a₁).
#[derive(Clone, Copy, Debug)]
struct Formula {
    mass: [f64; 2],
    time: f64,
    position: [f64; 2],
    velocity: [f64; 2],
    end_position: [f64; 2],
    end_velocity: [f64; 2],
}

impl Formula {
    fn new(method: FamilyMethod) -> Self {
        let alpha = |mass: f64, force: f64| {
            let (gamma, beta) = (0.5 - mass + force, 0.25 * (1.0 - mass + force).powi(2));
            let time = 1.0 - force;
            let (end_position, end_velocity) = ([0.5 - beta, beta], [1.0 - gamma, gamma]);
            Self {
                mass: [mass, 1.0 - mass],
                time,
                position: end_position.map(|z| time * z),
                velocity: end_velocity.map(|w| time * w),
                end_position,
                end_velocity,
            }
        };
        match method {
            FamilyMethod::GeneralizedAlpha { rho } => {
                alpha((2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0))
            }
            FamilyMethod::ImplicitMidpoint => Self {
                mass: [0.0, 1.0],
                time: 0.5,
                position: [0.0, 0.25],
                velocity: [0.0, 0.5],
                end_position: [0.0, 0.5],
                end_velocity: [0.0, 1.0],
            },
            _ => alpha(0.0, 0.0),
        }
    }
}

/// One of the methods, with its memory.
pub(crate) struct Implicit {
    formula: Formula,
    tangent: Tangent,
    ends: Sizes,
    /// The step that the factors belong to; NaN without factors.
    factored: f64,
    /// a₀; not known at the start.
    a: Option<Vec<f64>>,
    next: Vec<f64>,
    inertia: Vec<f64>,
    correction: Vec<f64>,
    stage: Point,
}

impl Implicit {
    pub(crate) fn new<M: FamilyModel>(
        method: FamilyMethod,
        model: &M,
        y: &Point,
        inputs: &[f64],
        ends: &Sizes,
    ) -> Result<Self, FamilyErrorKind> {
        let at = View { t: y.t, q: &y.q, u: &y.u, inputs };
        let zeros = || vec![0.0; y.q.len()];
        Ok(Self {
            formula: Formula::new(method),
            tangent: Tangent::new(model, at, ends, None)?,
            ends: ends.clone(),
            factored: f64::NAN,
            a: None,
            next: zeros(),
            inertia: zeros(),
            correction: zeros(),
            stage: y.clone(),
        })
    }

    /// The state at which forces are evaluated, from a₀ and the present a₁.
    fn set_stage(&mut self, y: &Point, a: &[f64], h: f64) {
        let Formula { time, position, velocity, .. } = self.formula;
        self.stage.t = y.t + time * h;
        for (i, (&old, &new)) in a.iter().zip(&self.next).enumerate() {
            self.stage.q[i] = y.q[i] + h * (time * y.u[i] + h * (position[0] * old + position[1] * new));
            self.stage.u[i] = y.u[i] + h * (velocity[0] * old + velocity[1] * new);
        }
    }

    fn factor<M: FamilyModel>(
        &mut self,
        equations: &Equations<'_, '_, M>,
        h: f64,
    ) -> Result<(), FamilyErrorKind> {
        let Formula { mass, position, velocity, .. } = self.formula;
        let weights =
            Coefficients { mass: mass[1], damping: velocity[1] * h, stiffness: position[1] * h * h };
        let Point { t, q, u } = &self.stage;
        let at = View { t: *t, q, u, inputs: &equations.inputs };
        self.tangent.assemble(equations.model, at, weights, None)?;
        self.factored = h;
        self.tangent.factor::<M>(&self.ends)
    }

    /// Solves for a₁ = `next`.
    fn solve<M: FamilyModel>(
        &mut self,
        equations: &mut Equations<'_, '_, M>,
        y: &Point,
        a: &[f64],
        h: f64,
    ) -> Result<(), FamilyErrorKind> {
        self.next.copy_from_slice(a);
        let speed = self.tangent.norm(&y.u) / h.abs();
        let unit = f64::EPSILON * self.tangent.norm(&y.q) / (h * h);
        let mut before = f64::INFINITY;
        for iteration in 0..MOST_ITERATIONS {
            self.set_stage(y, a, h);
            // M (μ₁ a₁ + μ₀ a₀) − Q, in `correction`.
            let [old, new] = self.formula.mass;
            for (inertia, (a, next)) in self.inertia.iter_mut().zip(a.iter().zip(&self.next)) {
                *inertia = old * a + new * next;
            }
            let Point { t, q, u } = &self.stage;
            equations.forces(*t, q, u, &mut self.correction)?;
            // A stage without finite forces has no tangent either: the step is not solved.
            if !self.correction.iter().all(|force| force.is_finite()) {
                break;
            }
            if self.factored != h {
                self.factor(equations, h)?;
            }
            self.subtract_inertia();
            self.tangent.solve(&mut self.correction);
            self.next.iter_mut().zip(&self.correction).for_each(|(a, change)| *a += change);
            let size = self.tangent.norm(&self.correction);
            let scale = self.tangent.norm(&self.next) + speed;
            if size.is_nan() || scale.is_infinite() {
                break;
            }
            let ratio = if before > 0.0 { size / before } else { 0.0 };
            // The first correction says nothing of how fast further ones shrink.
            let left = if iteration == 0 { size } else { size * (ratio / (1.0 - ratio.min(0.9))).min(1.0) };
            let is_rounding = ratio > 0.5 && size <= ROUNDING * scale + ROUNDED_PLACES * unit;
            if left <= ACCURACY * scale + LAST_PLACES * unit || is_rounding {
                return Ok(());
            }
            if iteration > 0 && ratio > SLOW {
                self.factored = f64::NAN;
            }
            before = size;
        }
        self.factored = f64::NAN;
        let worst = |best: usize, i: usize| {
            let size = |i: usize| {
                let x = self.correction[i];
                if x.is_finite() { self.tangent.diagonal[i] * x * x } else { f64::INFINITY }
            };
            if size(i) > size(best) { i } else { best }
        };
        let unknown = (0..a.len()).fold(0, worst);
        Err(FamilyErrorKind::NotSolved { coordinate: coordinate_name::<M>(&self.ends, unknown) })
    }

    /// `correction` −= M `inertia`.
    fn subtract_inertia(&mut self) {
        // The stage is set anew before its next use.
        self.tangent.mass_times(&self.inertia, &mut self.stage.u);
        self.correction.iter_mut().zip(&self.stage.u).for_each(|(force, inertia)| *force -= inertia);
    }
}

impl<M: FamilyModel> FixedStep<M> for Implicit {
    fn begin(
        &mut self,
        equations: &mut Equations<'_, '_, M>,
        y: &mut Point,
        _: f64,
    ) -> Result<(), FamilyErrorKind> {
        let mut a = vec![0.0; y.q.len()];
        equations.accelerations(y.t, &y.q, &y.u, &mut a)?;
        self.a = Some(a);
        Ok(())
    }

    fn advance(
        &mut self,
        equations: &mut Equations<'_, '_, M>,
        y: &mut Point,
        h: f64,
        _: f64,
    ) -> Result<(), FamilyErrorKind> {
        if self.a.is_none() {
            FixedStep::<M>::begin(self, equations, y, h)?;
        }
        let Some(mut a) = self.a.take() else { return Ok(()) };
        let solved = self.solve(equations, y, &a, h);
        if solved.is_ok() {
            let Formula { end_position, end_velocity, .. } = self.formula;
            for (i, a) in a.iter_mut().enumerate() {
                let (old, new) = (*a, self.next[i]);
                y.q[i] += h * (y.u[i] + h * (end_position[0] * old + end_position[1] * new));
                y.u[i] += h * (end_velocity[0] * old + end_velocity[1] * new);
                *a = new;
            }
        }
        self.a = Some(a);
        solved
    }

    fn state(
        &mut self,
        _: &mut Equations<'_, '_, M>,
        y: &Point,
        _: f64,
        into: &mut Point,
    ) -> Result<(), FamilyErrorKind> {
        into.copy_from(y);
        Ok(())
    }

    fn restart(&mut self) {
        self.a = None;
    }

    fn bytes(&self) -> usize {
        self.tangent.bytes() + 48 * self.next.len()
    }
}

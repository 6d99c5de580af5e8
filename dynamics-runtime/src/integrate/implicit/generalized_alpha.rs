//! GeneralizedAlpha: the generalized-α method with adjustable damping, for constraints as they are (index 3).
//!
//! * **Problem**: flexible and stiff mechanisms with fixed steps. Oscillations that are faster than the steps
//!   are damped, slow ones are not: ρ∞ is the factor by which a step damps the former.
//! * **Formula**: M q̈₁ = Q₁ + Φ_qᵀλ₁ and Φ(q₁) = 0 at the end of the step, with q₁ = q₀ + h u₀ + h²((½ − β)
//!   a₀ + β a₁), u₁ = u₀ + h((1 − γ) a₀ + γ a₁), (1 − αₘ) a₁ + αₘ a₀ = (1 − α_f) q̈₁ + α_f q̈₀ and αₘ = (2ρ∞
//!   − 1)/(ρ∞ + 1), α_f = ρ∞/(ρ∞ + 1), γ = ½ + α_f − αₘ, β = ¼(1 + α_f − αₘ)². The unknown a₁ is
//!   accelerations, its constraint Φ/(h²β): so scaled the iteration matrix tends to a multiple of the
//!   identity as h → 0.
//! * **Multipliers** are unknowns of their own: q̈₁ differs from the accelerations q̈(q₁, u₁), for which Φ̈ =
//!   0, by M⁻¹Φ_qᵀδλ. So P(q̈₁ − q̈(q₁, u₁)) = 0 is all that is left of the equations of motion, P the
//!   projection along M⁻¹Φ_qᵀ onto Φ_q v = 0, and Newton's matrix needs no more than the Jacobians of q̈(q,
//!   u). [`GeneralizedAlpha::accelerations`] gives q̈₁, whose M q̈₁ − Q₁ is Φ_qᵀλ₁.
//! * **Order** 2 in q, u and λ. The auxiliary acceleration a is q̈ at a time αₘ − α_f steps ahead, and the
//!   method's own velocities are off Φ̇ = 0 by h²(⅙ − β − ½(αₘ − α_f)) of the part of q⃛ that the constraints
//!   contribute. A start without these two offsets gives λ an error O(h) for some 1/(1 − ρ∞) steps. Here the
//!   first step takes a from q̈ at its own ends: it is Newmark's with γ = ½ and β = ¼(1 + (αₘ − α_f)²). Its λ
//!   gives the offset of the velocities. Both offsets are handed from step to step. Where the step size
//!   changes, they are scaled, and the parts of the constraints are taken anew from accelerations with
//!   Φ̈ = 0. The ends of steps lie on Φ̇ = 0.
//! * **Error estimate**: the difference from the integrals of the parabola through three q̈, of order 3. It
//!   contains fast oscillations, and every change of the step size excites some: with step control stiff
//!   motions cost many times as much as with a fixed step. Local errors add up to order 2, so for a tolerance
//!   ε a step may have a tenth of ε^{3/2}.
//! * **Dense output**: the quintic through q, q̇, q̈ at both ends ([`Hermite`](crate::integrate::Hermite)).
//! * **Stability**: A-stable, ρ → ρ∞ at infinite frequency: ρ∞ = 1 damps nothing, ρ∞ = 0 all that is fast in
//!   one step. Fast oscillations overshoot in the first steps. With constraints λ needs ρ∞ < 1.
//! * **Cost**: 1 evaluation of q̈ and a projection per iteration, 2 to 4 iterations, 1 at the end of
//!   constrained steps; a Jacobian and N projections where iterations converge slowly.
//! * **Source**: Chung & Hulbert, J. Appl. Mech. 60 (1993) 371; Arnold & Brüls, Multibody Syst. Dyn. 18
//!   (2007) 185; the start: Arnold, Brüls & Cardona, Numer. Math. 129 (2015) 149; scaling: Bottasso, Bauchau
//!   & Cardona, SIAM J. Sci. Comput. 29 (2007) 397.

use crate::integrate::phase::plus_scaled;
use crate::integrate::{ControllerSettings, Method, Phase, Scheme, Step, StepNode, System, Tolerances};
use crate::linalg::elimination::{Matrices, factor, solve};
use crate::math;
use crate::model::Vector;

/// Most Newton iterations of a step.
const MAX_NEWTON_STEPS: u32 = 15;
/// Corrections that are so many times the smallest of the earlier ones diverge. The first ones may grow by
/// less.
const DIVERGENCE_GROWTH: f64 = 1e3;
/// Rate of convergence up to which the matrix is kept for the next step. A larger value costs iterations, a
/// smaller one matrices.
const KEPT_MATRIX_RATE: f64 = 1e-2;
/// Rate of convergence from which on the iterations get a new matrix.
const RENEWAL_RATE: f64 = 0.1;
/// The matrix serves steps that differ from its own by no more than this part: times are rounded.
const SAME_STEP_PART: f64 = 1e-6;
/// Factor up to which a step does not grow although it could: the matrix is kept, and each change of the step
/// excites fast oscillations.
const UNCHANGED_STEP_GROWTH: f64 = 1.3;
/// Part of the permitted error that the iterations may leave.
const NEWTON_ERROR_PART: f64 = 1e-2;
/// Corrections of positions up to this part of the summands of the positions are rounding.
const CORRECTION_ROUNDING: f64 = 16.0 * f64::EPSILON;
/// Corrections that shrink by no more than this factor are rounding already below [`STALLED_CORRECTION`]:
/// near a rank loss the constraints amplify rounding.
const STALLED_RATE: f64 = 0.5;
/// See [`STALLED_RATE`]; a part of the summands of the positions.
const STALLED_CORRECTION: f64 = 1e-10;
/// A step more than so many times as long as the one before starts anew: scaled to it, the data of the short
/// step would be mostly rounding.
const MAX_STEP_RATIO_CONTINUED: f64 = 4.0;
/// Largest part of the displacement of a step that the constraints may contribute. A larger one leads to
/// another assembly of the mechanism.
const MAX_CONSTRAINT_PART: f64 = 0.25;
/// ρ∞ of [`Scheme::new`]: damps fast oscillations by a fifth per step.
const DEFAULT_RHO: f64 = 0.8;

/// αₘ, α_f, β and γ.
#[derive(Clone, Copy, Debug, PartialEq)]
struct AlphaCoefficients {
    m: f64,
    f: f64,
    beta: f64,
    gamma: f64,
}

impl AlphaCoefficients {
    fn of(rho: f64) -> Self {
        let (m, f) = ((2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0));
        Self { m, f, beta: 0.25 * (1.0 + f - m) * (1.0 + f - m), gamma: 0.5 + f - m }
    }

    /// The time between q̈ and a, in steps.
    fn ahead(&self) -> f64 {
        self.m - self.f
    }

    /// The local error of q, in h³ q⃛.
    fn position_error(&self) -> f64 {
        1.0 / 6.0 - self.beta - 0.5 * self.ahead()
    }

    /// Those of a first step, which starts with a = q̈: Newmark's.
    fn first(&self) -> Self {
        Self { m: 0.0, f: 0.0, beta: 0.25 * (1.0 + self.ahead() * self.ahead()), gamma: 0.5 }
    }

    /// q̈₁ = κ a₁ + …
    fn kappa(&self) -> f64 {
        (1.0 - self.m) / (1.0 - self.f)
    }
}

/// The generalized-α method.
#[derive(Clone, Debug)]
pub struct GeneralizedAlpha<V: Vector> {
    /// Those of the chosen ρ∞.
    chosen: AlphaCoefficients,
    /// Those of the step that is being made.
    coefficients: AlphaCoefficients,
    /// G = hγ ∂q̈/∂u + h²β ∂q̈/∂q; memory for ∂q̈/∂u; κ − P G, factored.
    matrices: Matrices<V, 3>,
    exchanges: V,
    /// Step size and β for which the matrix is factored; 0: it is not.
    factored_for: (f64, f64),
    k: [Phase<V>; 2],
    initial: AlphaStepStart<V>,
    /// a at the end of the step.
    a: V,
    /// Its end, before it is projected.
    end: Phase<V>,
    result: AlphaStepEnd<V>,
    last: Option<LastAlphaStep<V>>,
    error: Phase<V>,
    solved: bool,
}

/// The data with which a step starts.
#[derive(Clone, Copy, Debug)]
struct AlphaStepStart<V> {
    /// q̈ of the method.
    qdd: V,
    /// The auxiliary acceleration a.
    a: V,
    /// The method's own velocities.
    u: V,
    /// The size of the last step, and q̈ of the method at its start.
    last_step: Option<(f64, V)>,
}

/// The data that a step hands to the next one.
#[derive(Clone, Copy, Debug)]
struct AlphaStepEnd<V> {
    /// q̈ of the method.
    qdd: V,
    /// a − q̈.
    a_offset: V,
    /// The method's own velocities less the projected ones, after a first step; `None`: their difference.
    velocity_offset: Option<V>,
}

/// The last accepted step.
#[derive(Clone, Copy, Debug)]
struct LastAlphaStep<V> {
    end: StepNode<V>,
    h: f64,
    result: AlphaStepEnd<V>,
    /// The method's own velocities less the projected ones.
    velocity_offset: V,
    /// q̈ of the method at its start.
    start_qdd: V,
    /// q̈ of the state at its start, for which Φ̈ = 0.
    start_a: V,
}

/// The largest absolute value; NaN is left out.
fn largest<V: Vector>(v: &V) -> f64 {
    v.as_slice().iter().fold(0.0, |most, x| math::max(most, x.abs()))
}

/// The tolerances of a step for which the error of the run is about the tolerance: see the header.
fn step_tolerances(tolerances: &Tolerances) -> Tolerances {
    let loosest = tolerances.relative.max(tolerances.absolute);
    let factor = 0.1 * math::sqrt(loosest.min(1.0));
    Tolerances { absolute: factor * tolerances.absolute, relative: factor * tolerances.relative }
}

impl<V: Vector> GeneralizedAlpha<V> {
    /// The method with the factor ρ∞, 0 to 1, by which a step damps infinitely fast oscillations.
    #[must_use]
    pub fn damping(rho: f64) -> Self {
        let chosen = AlphaCoefficients::of(rho.clamp(0.0, 1.0));
        let zero = V::zeros();
        Self {
            chosen,
            coefficients: chosen,
            matrices: Matrices::new(),
            exchanges: zero,
            factored_for: (0.0, 0.0),
            k: [Phase::zeros(); 2],
            initial: AlphaStepStart { qdd: zero, a: zero, u: zero, last_step: None },
            a: zero,
            end: Phase::zeros(),
            result: AlphaStepEnd { qdd: zero, a_offset: zero, velocity_offset: None },
            last: None,
            error: Phase::zeros(),
            solved: true,
        }
    }

    /// q̈ of the method at the end of the step tried last. Its multipliers λ follow from M q̈ − Q = Φ_qᵀλ.
    /// They differ from those of the state, for which Φ̈ = 0.
    pub fn accelerations(&self) -> &V {
        &self.k[1].u
    }

    /// Takes the data of the last step, or starts anew.
    fn begin<S: System<V>>(&mut self, system: &mut S, start: &StepNode<V>, h: f64) -> Result<(), S::Error> {
        let last = self.last.filter(|last| {
            let ratio = h / last.h;
            last.end == *start && ratio > 0.0 && ratio <= MAX_STEP_RATIO_CONTINUED
        });
        let Some(LastAlphaStep {
            h: long,
            result: AlphaStepEnd { mut qdd, mut a_offset, .. },
            mut velocity_offset,
            start_qdd,
            start_a,
            ..
        }) = last
        else {
            self.coefficients = self.chosen.first();
            self.initial = AlphaStepStart { qdd: start.a, a: start.a, u: start.y.u, last_step: None };
            return Ok(());
        };
        self.coefficients = self.chosen;
        let ratio = h / long;
        if (ratio - 1.0).abs() > SAME_STEP_PART {
            if system.has_constraints() {
                // Growing steps would amplify errors of λ. So the parts that constraints contribute are taken
                // from accelerations for which Φ̈ = 0.
                let (t, y, change) = (start.t, &start.y, plus_scaled(&start.a, -1.0, &start_a));
                let part = system.inadmissible_component(t, y, &plus_scaled(&qdd, -1.0, &start.a), false)?;
                qdd = plus_scaled(&qdd, -1.0, &part);
                let part = system.inadmissible_component(
                    t,
                    y,
                    &plus_scaled(&a_offset, -self.chosen.ahead(), &change),
                    false,
                )?;
                a_offset = plus_scaled(&a_offset, -1.0, &part);
                let part = system.inadmissible_component(t, y, &change, true)?;
                velocity_offset = plus_scaled(&V::zeros(), self.chosen.position_error() * long, &part);
            }
            a_offset.as_mut_slice().iter_mut().for_each(|x| *x *= ratio);
            velocity_offset.as_mut_slice().iter_mut().for_each(|x| *x *= ratio * ratio);
        }
        self.initial = AlphaStepStart {
            qdd,
            a: plus_scaled(&qdd, 1.0, &a_offset),
            u: plus_scaled(&start.y.u, 1.0, &velocity_offset),
            last_step: Some((long, start_qdd)),
        };
        Ok(())
    }

    /// Stores the data for the next step. After a first step they use q⃛, as its λ shows it.
    fn store_result<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        h: f64,
    ) -> Result<(), S::Error> {
        let qdd = self.k[1].u;
        self.result = AlphaStepEnd { qdd, a_offset: plus_scaled(&self.a, -1.0, &qdd), velocity_offset: None };
        if self.initial.last_step.is_some() {
            return Ok(());
        }
        let mut change = plus_scaled(&qdd, -1.0, &start.a);
        if system.has_constraints() {
            // Φ(q₁) = 0 adds (⅙ − β)/β of h q⃛ to the component of q̈₁ along M⁻¹Φ_qᵀ, so that its change is
            // h q⃛/(6β).
            let by_constraints = system.inadmissible_component(start.t + h, &self.end, &change, true)?;
            let (error, beta) = (self.chosen.position_error(), self.coefficients.beta);
            self.result.qdd = plus_scaled(&qdd, -6.0 * error, &by_constraints);
            self.result.velocity_offset =
                Some(plus_scaled(&V::zeros(), 6.0 * beta * error * h, &by_constraints));
            self.k[1].u = self.result.qdd;
            change = plus_scaled(&change, 6.0 * beta - 1.0, &by_constraints);
        }
        self.result.a_offset = plus_scaled(&V::zeros(), self.chosen.ahead(), &change);
        Ok(())
    }

    /// Factors κ − P(hγ ∂q̈/∂u + h²β ∂q̈/∂q) at a point; false where that is singular.
    fn factor<S: System<V>>(&mut self, system: &mut S, at: &StepNode<V>, h: f64) -> Result<bool, S::Error> {
        let (n, AlphaCoefficients { beta, gamma, .. }) = (V::LEN, self.coefficients);
        self.factored_for = (0.0, 0.0);
        let (moved, rest) = self.matrices.all().split_at_mut(n * n);
        let (by_u, matrix) = rest.split_at_mut(n * n);
        system.jacobian(at, moved, by_u)?;
        for (by_q, by_u) in moved.iter_mut().zip(by_u) {
            *by_q = h * gamma * *by_u + h * h * beta * *by_q;
        }
        for column in 0..n {
            let mut part = V::zeros();
            (0..n).for_each(|row| part[row] = moved[row * n + column]);
            if system.has_constraints() {
                part = plus_scaled(&part, -1.0, &system.inadmissible_component(at.t, &at.y, &part, false)?);
            }
            (0..n).for_each(|row| matrix[row * n + column] = -part[row]);
        }
        (0..n).for_each(|i| matrix[i * n + i] += self.coefficients.kappa());
        let exchanges = factor(matrix);
        self.exchanges = exchanges.unwrap_or_else(V::zeros);
        self.factored_for = if exchanges.is_some() { (h, beta) } else { (0.0, 0.0) };
        Ok(exchanges.is_some())
    }

    /// The end of the step for the present a.
    fn end(&self, start: &StepNode<V>, h: f64) -> Phase<V> {
        let (AlphaCoefficients { beta, gamma, .. }, AlphaStepStart { a, u, .. }) =
            (self.coefficients, &self.initial);
        let mut end = Phase { q: start.y.q, u: *u };
        for l in 0..V::LEN {
            end.q[l] += h * (u[l] + h * ((0.5 - beta) * a[l] + beta * self.a[l]));
            end.u[l] += h * ((1.0 - gamma) * a[l] + gamma * self.a[l]);
        }
        end
    }

    /// The largest summand of the positions.
    fn summands(&self, start: &StepNode<V>, h: f64) -> f64 {
        let AlphaStepStart { a, u, .. } = &self.initial;
        let of_a = h * h * math::max(largest(a), largest(&self.a));
        math::max(math::max(largest(&start.y.q), h.abs() * largest(u)), of_a)
    }

    /// q̈ of the method for the present a.
    fn method_acceleration(&self) -> V {
        let AlphaCoefficients { m, f, .. } = self.coefficients;
        let AlphaStepStart { a, qdd, .. } = &self.initial;
        let mut found = self.a;
        (0..V::LEN).for_each(|l| found[l] = ((1.0 - m) * found[l] + m * a[l] - f * qdd[l]) / (1.0 - f));
        found
    }

    /// Newton's correction of a, and the part of it that moves positions onto the constraints.
    fn correction<S: System<V>>(
        &mut self,
        system: &mut S,
        at: &StepNode<V>,
        qdd: &V,
        h: f64,
    ) -> Result<(V, V), S::Error> {
        let (n, AlphaCoefficients { beta, gamma, .. }) = (V::LEN, self.coefficients);
        let mut right = plus_scaled(&at.a, -1.0, qdd);
        let mut onto = V::zeros();
        if system.has_constraints() {
            onto = system.constraint_correction(at.t, &at.y, h * beta / gamma)?;
            onto.as_mut_slice().iter_mut().for_each(|x| *x /= h * h * beta);
            let moved = self.matrices.one(0);
            for (row, right) in moved.chunks_exact(n).zip(right.as_mut_slice()) {
                *right += row.iter().zip(onto.as_slice()).map(|(g, x)| g * x).sum::<f64>();
            }
            right = plus_scaled(&right, -1.0, &system.inadmissible_component(at.t, &at.y, &right, false)?);
        }
        solve(self.matrices.one(2), &self.exchanges, &mut right);
        Ok((plus_scaled(&right, 1.0, &onto), onto))
    }

    /// Solves for a at the end of the step; false where that fails.
    fn iterate<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        h: f64,
        permitted: &Tolerances,
    ) -> Result<bool, S::Error> {
        let AlphaCoefficients { beta, gamma, .. } = self.coefficients;
        let enough =
            NEWTON_ERROR_PART.max(10.0 * f64::EPSILON / permitted.relative.max(f64::MIN_POSITIVE)).min(0.1);
        let (factored_h, factored_beta) = self.factored_for;
        let mut needs_matrix =
            factored_h == 0.0 || factored_beta != beta || (h / factored_h - 1.0).abs() > SAME_STEP_PART;
        let (mut first, mut before, mut rate, mut by_constraints) =
            (f64::INFINITY, f64::INFINITY, 1.0, V::zeros());
        for iteration in 1..=MAX_NEWTON_STEPS {
            (self.end, self.k[1].u) = (self.end(start, h), self.method_acceleration());
            let (y, qdd) = (self.end, self.k[1].u);
            self.k[1].q = y.u;
            // 1. The correction of a, with a new matrix where the iterations are slow.
            let a = system.accelerations(start.t + h, &y.q, &y.u)?;
            let at = StepNode { t: start.t + h, y, a };
            if needs_matrix && !self.factor(system, &at, h)? {
                return Ok(false);
            }
            let (change, onto) = self.correction(system, &at, &qdd, h)?;
            let moved = Phase { q: change, u: change };
            let moved = Phase {
                q: plus_scaled(&V::zeros(), h * h * beta, &moved.q),
                u: plus_scaled(&V::zeros(), h * gamma, &moved.u),
            };
            let size = permitted.norm(&moved, &start.y, &y);
            self.error = moved;
            if !size.is_finite() {
                // Values that are not finite lead to an end that is not, and the stepper reports that.
                self.end.u = moved.u;
                return Ok(true);
            }
            (self.a, by_constraints) =
                (plus_scaled(&self.a, 1.0, &change), plus_scaled(&by_constraints, h * h * beta, &onto));
            // 2. Converged: the rest is small enough, or the correction is rounding.
            if iteration > 1 {
                rate = size / before;
            }
            let noise =
                if iteration > 2 && rate > STALLED_RATE { STALLED_CORRECTION } else { CORRECTION_ROUNDING };
            let is_rounding = iteration > 1 && largest(&moved.q) <= noise * self.summands(start, h);
            if size == 0.0 || is_rounding || rate < 1.0 && rate / (1.0 - rate) * size <= enough {
                if rate > KEPT_MATRIX_RATE {
                    self.factored_for = (0.0, 0.0);
                }
                (self.end, self.k[1].u) = (self.end(start, h), self.method_acceleration());
                let way = plus_scaled(&self.end.q, -1.0, &start.y.q);
                return Ok(largest(&by_constraints)
                    <= MAX_CONSTRAINT_PART * largest(&way) + CORRECTION_ROUNDING * self.summands(start, h));
            }
            // 3. Diverged, or another iteration.
            if size > DIVERGENCE_GROWTH * first {
                return Ok(false);
            }
            needs_matrix = rate > RENEWAL_RATE && iteration > 1;
            (first, before) = (first.min(size), size);
        }
        Ok(false)
    }

    /// The error of the step without its component along M⁻¹Φ_qᵀ. It is not filtered: a filter would accept
    /// steps that pass over stiff transients at the start.
    fn estimate<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        h: f64,
    ) -> Result<(), S::Error> {
        let (AlphaStepStart { qdd, u, last_step, .. }, end, last) = (&self.initial, &self.end, &self.k[1].u);
        let mut error = Phase::<V>::zeros();
        for l in 0..V::LEN {
            let bend = match last_step {
                Some((long, first)) => ((last[l] - qdd[l]) / h - (qdd[l] - first[l]) / long) / (h + long),
                None => 0.0,
            };
            error.u[l] = end.u[l] - u[l] - h * (0.5 * (qdd[l] + last[l]) - bend * h * h / 6.0);
            let mean = qdd[l] / 3.0 + last[l] / 6.0 - bend * h * h / 12.0;
            error.q[l] = end.q[l] - start.y.q[l] - h * (u[l] + h * mean);
        }
        if system.has_constraints() {
            error.q = plus_scaled(
                &error.q,
                -1.0,
                &system.inadmissible_component(start.t + h, end, &error.q, true)?,
            );
            error.u = plus_scaled(
                &error.u,
                -1.0,
                &system.inadmissible_component(start.t + h, end, &error.u, false)?,
            );
        }
        self.error = error;
        Ok(())
    }
}

impl<V: Vector> Scheme<V> for GeneralizedAlpha<V> {
    const METHOD: Method = Method::GeneralizedAlpha;
    const ORDER: u32 = 2;
    const ERROR_ORDER: u32 = 2;
    const CONTROL: Option<ControllerSettings> =
        Some(ControllerSettings { safety: 0.9, beta: 0.0, shrink: 0.2, grow: 3.0 });
    const WEIGHTS: &'static [f64] = &[];
    const STABILITY_BORDER: f64 = f64::INFINITY;
    const EVENT_PANELS: usize = 4;
    quintic!(V);

    fn new() -> Self {
        Self::damping(DEFAULT_RHO)
    }

    fn forget_history(&mut self) {
        (self.last, self.factored_for) = (None, (0.0, 0.0));
    }

    fn attempt<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        h: f64,
        tolerances: &Tolerances,
    ) -> Result<(Phase<V>, f64), S::Error> {
        self.k[0] = start.derivative();
        self.begin(system, start, h)?;
        let AlphaStepStart { qdd, a, last_step, .. } = &self.initial;
        self.a = match last_step {
            Some((long, first)) => plus_scaled(&plus_scaled(a, h / long, qdd), -h / long, first),
            None => *a,
        };
        let permitted = step_tolerances(tolerances);
        self.solved = self.iterate(system, start, h, &permitted)?;
        if !self.solved || !self.end.is_finite() {
            self.factored_for = (0.0, 0.0);
            return Ok((self.end, 0.0));
        }
        self.estimate(system, start, h)?;
        self.store_result(system, start, h)?;
        Ok((self.end, permitted.norm(&self.error, &start.y, &self.end)))
    }

    fn stages(&self) -> &[Phase<V>] {
        &self.k
    }

    fn error_vector(&self) -> Phase<V> {
        self.error
    }

    fn has_converged(&self) -> bool {
        self.solved
    }

    fn accept_step(&mut self, step: &Step<V>) {
        self.last = Some(LastAlphaStep {
            end: step.end,
            h: step.h,
            result: self.result,
            velocity_offset: self
                .result
                .velocity_offset
                .unwrap_or_else(|| plus_scaled(&self.end.u, -1.0, &step.end.y.u)),
            start_qdd: self.initial.qdd,
            start_a: self.k[0].u,
        });
    }

    fn adjust_step_factor(&mut self, factor: f64, error: f64) -> f64 {
        // The matrix is kept, and the data of the last step need no scaling.
        if error <= 1.0 && (1.0..=UNCHANGED_STEP_GROWTH).contains(&factor) { 1.0 } else { factor }
    }
}

//! GeneralizedAlpha: the generalized-α method with adjustable damping, for constraints as they are (index 3).
//!
//! * **Problem**: flexible and stiff mechanisms with fixed steps, where oscillations that are faster than the
//!   steps have to fade, and slow ones not: one number, ρ∞, says by which factor a step damps the former.
//! * **Formula**: M q̈₁ = Q₁ + Φ_qᵀλ₁ and Φ(q₁) = 0 at the end of the step, with q₁ = q₀ + h u₀ + h²((½ − β)
//!   a₀ + β a₁), u₁ = u₀ + h((1 − γ) a₀ + γ a₁), (1 − αₘ) a₁ + αₘ a₀ = (1 − α_f) q̈₁ + α_f q̈₀ and αₘ = (2ρ∞
//!   − 1)/(ρ∞ + 1), α_f = ρ∞/(ρ∞ + 1), γ = ½ + α_f − αₘ, β = ¼(1 + α_f − αₘ)². The unknown a₁ is
//!   accelerations, its constraint Φ/(h²β): so scaled the iteration matrix tends to a multiple of the
//!   identity as h → 0.
//! * **Multipliers** are unknowns of their own: q̈₁ differs from the accelerations q̈(q₁, u₁), for which Φ̈ =
//!   0, by M⁻¹Φ_qᵀδλ. So P(q̈₁ − q̈(q₁, u₁)) = 0 is all that is left of the equations of motion, P the
//!   projection along M⁻¹Φ_qᵀ onto Φ_q v = 0, and Newton's matrix needs no more than the Jacobians of q̈(q,
//!   u). [`GeneralizedAlpha::accelerations`] gives q̈₁, whose M q̈₁ − Q₁ is Φ_qᵀλ₁.
//! * **Order** 2 in q, u and λ. a stands for q̈ at a time that lies αₘ − α_f steps ahead, and the method's
//!   own velocities beside Φ̇ = 0 by h²(⅙ − β − ½(αₘ − α_f)) of what constraints do to q⃛: with a start that
//!   knows neither, λ errs by O(h) for some 1/(1 − ρ∞) steps. Here the first step takes a from q̈ at its own
//!   ends, which makes it Newmark's with γ = ½ and β = ¼(1 + (αₘ − α_f)²), and its λ tells what velocities
//!   are to be beside. Both are carried on from step to step; where the step changes, they are scaled with
//!   it, and what constraints do is taken anew from accelerations that know no λ. The ends of steps lie on
//!   Φ̇ = 0.
//! * **Error estimate**: the difference from the integrals of the parabola through three q̈, of order 3. Fast
//!   oscillations count, and every change of the step starts some: with step control stiff motions cost many
//!   times what they do with a fixed step. What is left in a step adds up with order 2, so a tolerance ε is
//!   held by permitting a tenth of ε^{3/2} in a step.
//! * **Dense output**: the quintic through q, q̇, q̈ at both ends ([`Hermite`](crate::integrate::Hermite)).
//! * **Stability**: A-stable, ρ → ρ∞ at infinite frequency: ρ∞ = 1 damps nothing, ρ∞ = 0 all that is fast in
//!   one step. Fast oscillations overshoot in the first steps. With constraints λ needs ρ∞ < 1.
//! * **Cost**: 1 evaluation of q̈ and a projection per iteration, 2 to 4 iterations, 1 at the end of
//!   constrained steps; a Jacobian and N projections where iterations converge slowly.
//! * **Source**: Chung & Hulbert, J. Appl. Mech. 60 (1993) 371; Arnold & Brüls, Multibody Syst. Dyn. 18
//!   (2007) 185; the start: Arnold, Brüls & Cardona, Numer. Math. 129 (2015) 149; scaling: Bottasso, Bauchau
//!   & Cardona, SIAM J. Sci. Comput. 29 (2007) 397.

use crate::integrate::{ControllerSettings, Method, Phase, Scheme, Step, StepNode, System, Tolerances};
use crate::linalg::elimination::{Matrices, factor, solve};
use crate::math;
use crate::model::Vector;

/// Most Newton iterations.
const MOST_NEWTON_STEPS: u32 = 15;
/// Corrections that are so many times the smallest one so far diverge: what Newton's method itself does in
/// the beginning says little.
const GROWTH: f64 = 1e3;
/// Iterations that converge at this rate or faster keep the matrix for the next step.
const FAST: f64 = 1e-2;
/// Iterations that converge no faster get a new matrix.
const SLOW: f64 = 0.1;
/// The matrix serves steps that differ from its own by no more than this part.
const SAME: f64 = 1e-6;
/// Largest factor by which a step could grow and is left as it is.
const STEADY: f64 = 1.3;
/// Share of the permitted error that iterations may leave.
const LEFT: f64 = 1e-2;
/// Corrections of positions by this part of what they are summed from are rounding errors.
const ROUNDING: f64 = 16.0 * f64::EPSILON;
/// Those that shrink no faster than by this factor are, if they are as small as this part: near singular
/// positions constraints amplify rounding errors.
const STALLS: f64 = 0.5;
const STALLED: f64 = 1e-10;
/// Steps so many times as long as the one before start afresh: what they would take over from that is little
/// but rounding errors.
const LONGER: f64 = 4.0;
/// Constraints may bend the way of a step by no more than this part of it: another way of closing a mechanism
/// would be found then.
const BENT: f64 = 0.25;
/// The damping that is taken where none is given.
const USUAL: f64 = 0.8;

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

    /// By how many steps a is ahead of q̈.
    fn ahead(&self) -> f64 {
        self.m - self.f
    }

    /// What a step leaves of q, in h³ q⃛.
    fn left_of_q(&self) -> f64 {
        1.0 / 6.0 - self.beta - 0.5 * self.ahead()
    }

    /// Those of a first step, whose a is q̈ as far as can be known: Newmark's.
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
    asked: AlphaCoefficients,
    /// Those of the step that is being made.
    coefficients: AlphaCoefficients,
    /// G = hγ ∂q̈/∂u + h²β ∂q̈/∂q; room for ∂q̈/∂u; κ − P G, factored.
    matrices: Matrices<V, 3>,
    exchanges: V,
    /// Step for which the matrix is factored, 0: it is not; and its β.
    factored_for: (f64, f64),
    k: [Phase<V>; 2],
    from: From<V>,
    /// a at the end of the step.
    a: V,
    /// Its end, before it is projected.
    end: Phase<V>,
    left: Left<V>,
    last: Option<LastAlphaStep<V>>,
    error: Phase<V>,
    solved: bool,
}

/// What a step starts with.
#[derive(Clone, Copy, Debug)]
struct From<V> {
    /// q̈ and a.
    own: V,
    a: V,
    /// The method's own velocities.
    u: V,
    /// The step before: its size and q̈ where it started.
    before: Option<(f64, V)>,
}

/// What a step leaves to the next.
#[derive(Clone, Copy, Debug)]
struct Left<V> {
    /// q̈, and a less q̈.
    own: V,
    lag: V,
    /// The method's own velocities less those that were projected, where that does not tell.
    astray: Option<V>,
}

/// The last accepted step.
#[derive(Clone, Copy, Debug)]
struct LastAlphaStep<V> {
    end: StepNode<V>,
    h: f64,
    left: Left<V>,
    astray: V,
    /// q̈ at its start: the method's own, and for which Φ̈ = 0.
    before: V,
    a: V,
}

/// x + s y.
#[inline(always)]
fn plus<V: Vector>(x: &V, s: f64, y: &V) -> V {
    let mut sum = *x;
    (0..V::LEN).for_each(|l| sum[l] += s * y[l]);
    sum
}

fn largest<V: Vector>(v: &V) -> f64 {
    v.as_slice().iter().fold(0.0, |most, x| math::max(most, x.abs()))
}

/// What a step may leave, so that the tolerance holds in the end.
fn permitted(tolerances: &Tolerances) -> Tolerances {
    let loosest = tolerances.relative.max(tolerances.absolute);
    let factor = 0.1 * math::sqrt(loosest.min(1.0));
    Tolerances { absolute: factor * tolerances.absolute, relative: factor * tolerances.relative }
}

impl<V: Vector> GeneralizedAlpha<V> {
    /// With a factor ρ∞ from 0 to 1 by which a step damps what is infinitely fast.
    #[must_use]
    pub fn damping(rho: f64) -> Self {
        let asked = AlphaCoefficients::of(rho.clamp(0.0, 1.0));
        let zero = V::zeros();
        Self {
            asked,
            coefficients: asked,
            matrices: Matrices::new(),
            exchanges: zero,
            factored_for: (0.0, 0.0),
            k: [Phase::zeros(); 2],
            from: From { own: zero, a: zero, u: zero, before: None },
            a: zero,
            end: Phase::zeros(),
            left: Left { own: zero, lag: zero, astray: None },
            last: None,
            error: Phase::zeros(),
            solved: true,
        }
    }

    /// q̈ at the end of the step tried last as the method has it: M q̈ − Q = Φ_qᵀλ gives its own multipliers
    /// λ. Beside it stand those of the state, for which Φ̈ = 0.
    pub fn accelerations(&self) -> &V {
        &self.k[1].u
    }

    /// Goes on from the last step, or starts.
    fn begin<S: System<V>>(&mut self, system: &mut S, start: &StepNode<V>, h: f64) -> Result<(), S::Error> {
        let last = self.last.filter(|last| {
            let ratio = h / last.h;
            last.end == *start && ratio > 0.0 && ratio <= LONGER
        });
        let Some(LastAlphaStep {
            h: long, left: Left { mut own, mut lag, .. }, mut astray, before, a, ..
        }) = last
        else {
            self.coefficients = self.asked.first();
            self.from = From { own: start.a, a: start.a, u: start.y.u, before: None };
            return Ok(());
        };
        self.coefficients = self.asked;
        let ratio = h / long;
        if (ratio - 1.0).abs() > SAME {
            if system.has_constraints() {
                // Errors of λ would be amplified where steps grow: what constraints do comes from
                // accelerations for which Φ̈ = 0.
                let (t, y, change) = (start.t, &start.y, plus(&start.a, -1.0, &a));
                let part = system.inadmissible_component(t, y, &plus(&own, -1.0, &start.a), false)?;
                own = plus(&own, -1.0, &part);
                let part =
                    system.inadmissible_component(t, y, &plus(&lag, -self.asked.ahead(), &change), false)?;
                lag = plus(&lag, -1.0, &part);
                let part = system.inadmissible_component(t, y, &change, true)?;
                astray = plus(&V::zeros(), self.asked.left_of_q() * long, &part);
            }
            lag.as_mut_slice().iter_mut().for_each(|x| *x *= ratio);
            astray.as_mut_slice().iter_mut().for_each(|x| *x *= ratio * ratio);
        }
        self.from = From {
            own,
            a: plus(&own, 1.0, &lag),
            u: plus(&start.y.u, 1.0, &astray),
            before: Some((long, before)),
        };
        Ok(())
    }

    /// What the step just solved leaves: after a first one, what that reveals of q⃛ is made use of.
    fn leave<S: System<V>>(&mut self, system: &mut S, start: &StepNode<V>, h: f64) -> Result<(), S::Error> {
        let own = self.k[1].u;
        self.left = Left { own, lag: plus(&self.a, -1.0, &own), astray: None };
        if self.from.before.is_some() {
            return Ok(());
        }
        let mut change = plus(&own, -1.0, &start.a);
        if system.has_constraints() {
            // Φ(q₁) = 0 makes q̈₁ wrong by (⅙ − β)/β of h q⃛ across the constraints, so that its change is h
            // q⃛/(6β).
            let across = system.inadmissible_component(start.t + h, &self.end, &change, true)?;
            let (left, beta) = (self.asked.left_of_q(), self.coefficients.beta);
            self.left.own = plus(&own, -6.0 * left, &across);
            self.left.astray = Some(plus(&V::zeros(), 6.0 * beta * left * h, &across));
            self.k[1].u = self.left.own;
            change = plus(&change, 6.0 * beta - 1.0, &across);
        }
        self.left.lag = plus(&V::zeros(), self.asked.ahead(), &change);
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
                part = plus(&part, -1.0, &system.inadmissible_component(at.t, &at.y, &part, false)?);
            }
            (0..n).for_each(|row| matrix[row * n + column] = -part[row]);
        }
        (0..n).for_each(|i| matrix[i * n + i] += self.coefficients.kappa());
        let exchanges = factor(matrix);
        self.exchanges = exchanges.unwrap_or_else(V::zeros);
        self.factored_for = if exchanges.is_some() { (h, beta) } else { (0.0, 0.0) };
        Ok(exchanges.is_some())
    }

    /// The end of the step with this a.
    fn end(&self, start: &StepNode<V>, h: f64) -> Phase<V> {
        let (AlphaCoefficients { beta, gamma, .. }, From { a, u, .. }) = (self.coefficients, &self.from);
        let mut end = Phase { q: start.y.q, u: *u };
        for l in 0..V::LEN {
            end.q[l] += h * (u[l] + h * ((0.5 - beta) * a[l] + beta * self.a[l]));
            end.u[l] += h * ((1.0 - gamma) * a[l] + gamma * self.a[l]);
        }
        end
    }

    /// The largest number that positions are summed from.
    fn summands(&self, start: &StepNode<V>, h: f64) -> f64 {
        let From { a, u, .. } = &self.from;
        let of_a = h * h * math::max(largest(a), largest(&self.a));
        math::max(math::max(largest(&start.y.q), h.abs() * largest(u)), of_a)
    }

    /// q̈ that belongs to a.
    fn own(&self) -> V {
        let AlphaCoefficients { m, f, .. } = self.coefficients;
        let From { a, own, .. } = &self.from;
        let mut found = self.a;
        (0..V::LEN).for_each(|l| found[l] = ((1.0 - m) * found[l] + m * a[l] - f * own[l]) / (1.0 - f));
        found
    }

    /// Newton's correction of a, and the part of it that constraints ask for.
    fn correction<S: System<V>>(
        &mut self,
        system: &mut S,
        at: &StepNode<V>,
        own: &V,
        h: f64,
    ) -> Result<(V, V), S::Error> {
        let (n, AlphaCoefficients { beta, gamma, .. }) = (V::LEN, self.coefficients);
        let mut right = plus(&at.a, -1.0, own);
        let mut onto = V::zeros();
        if system.has_constraints() {
            onto = system.constraint_correction(at.t, &at.y, h * beta / gamma)?;
            onto.as_mut_slice().iter_mut().for_each(|x| *x /= h * h * beta);
            let moved = self.matrices.one(0);
            for (row, right) in moved.chunks_exact(n).zip(right.as_mut_slice()) {
                *right += row.iter().zip(onto.as_slice()).map(|(g, x)| g * x).sum::<f64>();
            }
            right = plus(&right, -1.0, &system.inadmissible_component(at.t, &at.y, &right, false)?);
        }
        solve(self.matrices.one(2), &self.exchanges, &mut right);
        Ok((plus(&right, 1.0, &onto), onto))
    }

    /// Solves for a at the end of the step. Whether that succeeds.
    fn iterate<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        h: f64,
        permitted: &Tolerances,
    ) -> Result<bool, S::Error> {
        let AlphaCoefficients { beta, gamma, .. } = self.coefficients;
        let enough = LEFT.max(10.0 * f64::EPSILON / permitted.relative.max(f64::MIN_POSITIVE)).min(0.1);
        let (known, by) = self.factored_for;
        let mut fresh = known == 0.0 || by != beta || (h / known - 1.0).abs() > SAME;
        let (mut first, mut before, mut rate, mut bent) = (f64::INFINITY, f64::INFINITY, 1.0, V::zeros());
        for iteration in 1..=MOST_NEWTON_STEPS {
            (self.end, self.k[1].u) = (self.end(start, h), self.own());
            let (y, own) = (self.end, self.k[1].u);
            self.k[1].q = y.u;
            let a = system.accelerations(start.t + h, &y.q, &y.u)?;
            let at = StepNode { t: start.t + h, y, a };
            if fresh && !self.factor(system, &at, h)? {
                return Ok(false);
            }
            let (change, onto) = self.correction(system, &at, &own, h)?;
            let moved = Phase { q: change, u: change };
            let moved = Phase {
                q: plus(&V::zeros(), h * h * beta, &moved.q),
                u: plus(&V::zeros(), h * gamma, &moved.u),
            };
            let size = permitted.norm(&moved, &start.y, &y);
            self.error = moved;
            if !size.is_finite() {
                // What is not finite makes an end that is not, and that is what is said then.
                self.end.u = moved.u;
                return Ok(true);
            }
            (self.a, bent) = (plus(&self.a, 1.0, &change), plus(&bent, h * h * beta, &onto));
            if iteration > 1 {
                rate = size / before;
            }
            let noise = if iteration > 2 && rate > STALLS { STALLED } else { ROUNDING };
            let rounded = iteration > 1 && largest(&moved.q) <= noise * self.summands(start, h);
            if size == 0.0 || rounded || rate < 1.0 && rate / (1.0 - rate) * size <= enough {
                if rate > FAST {
                    self.factored_for = (0.0, 0.0);
                }
                (self.end, self.k[1].u) = (self.end(start, h), self.own());
                let way = plus(&self.end.q, -1.0, &start.y.q);
                return Ok(largest(&bent) <= BENT * largest(&way) + ROUNDING * self.summands(start, h));
            }
            if size > GROWTH * first {
                return Ok(false);
            }
            fresh = rate > SLOW && iteration > 1;
            (first, before) = (first.min(size), size);
        }
        Ok(false)
    }

    /// The error of the step, what constraints do not permit left out. It is not filtered: steps that pass
    /// over what is stiff at the start would pass with it.
    fn estimate<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        h: f64,
    ) -> Result<(), S::Error> {
        let (From { own, u, before, .. }, end, last) = (&self.from, &self.end, &self.k[1].u);
        let mut error = Phase::<V>::zeros();
        for l in 0..V::LEN {
            let bend = match before {
                Some((long, first)) => ((last[l] - own[l]) / h - (own[l] - first[l]) / long) / (h + long),
                None => 0.0,
            };
            error.u[l] = end.u[l] - u[l] - h * (0.5 * (own[l] + last[l]) - bend * h * h / 6.0);
            let mean = own[l] / 3.0 + last[l] / 6.0 - bend * h * h / 12.0;
            error.q[l] = end.q[l] - start.y.q[l] - h * (u[l] + h * mean);
        }
        if system.has_constraints() {
            error.q = plus(&error.q, -1.0, &system.inadmissible_component(start.t + h, end, &error.q, true)?);
            error.u =
                plus(&error.u, -1.0, &system.inadmissible_component(start.t + h, end, &error.u, false)?);
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
        Self::damping(USUAL)
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
        let From { own, a, before, .. } = &self.from;
        self.a = match before {
            Some((long, first)) => plus(&plus(a, h / long, own), -h / long, first),
            None => *a,
        };
        let permitted = permitted(tolerances);
        self.solved = self.iterate(system, start, h, &permitted)?;
        if !self.solved || !self.end.is_finite() {
            self.factored_for = (0.0, 0.0);
            return Ok((self.end, 0.0));
        }
        self.estimate(system, start, h)?;
        self.leave(system, start, h)?;
        Ok((self.end, permitted.norm(&self.error, &start.y, &self.end)))
    }

    fn finish<S: System<V>>(&mut self, system: &mut S, end_t: f64, end: &Phase<V>) -> Result<V, S::Error> {
        system.accelerations(end_t, &end.q, &end.u)
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
            left: self.left,
            astray: self.left.astray.unwrap_or_else(|| plus(&self.end.u, -1.0, &step.end.y.u)),
            before: self.from.own,
            a: self.k[0].u,
        });
    }

    fn adjust_step_factor(&mut self, factor: f64, error: f64) -> f64 {
        // The matrix is kept, and what is carried on.
        if error <= 1.0 && (1.0..=STEADY).contains(&factor) { 1.0 } else { factor }
    }

    fn stiffness(&self, _: f64, _: &StepNode<V>) -> Option<f64> {
        None
    }
}

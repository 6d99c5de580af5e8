//! Radau5: Radau IIA of order 5, implicit.
//!
//! * **Problem**: stiff motions, at tolerances down to about 10⁻¹⁰: springs and dampers that are fast against
//!   what is looked for.
//! * **Formula**: collocation at c = (4 − √6)/10, (4 + √6)/10, 1. Of the stages only the velocities are
//!   unknown, as q̇ = u gives the positions: Zᵘ = h A a(q₀ + h c u₀ + h A Zᵘ, u₀ + Zᵘ). Simplified Newton
//!   iterations in variables W = T⁻¹ Zᵘ that diagonalise A⁻¹: with an eigenvalue μ of A⁻¹/h, each is one
//!   system of N equations, (μ − ∂a/∂u − ∂a/∂q/μ) ΔW = T⁻¹ a − μ W, one real and one complex.
//! * **Jacobian and factors** are kept while the iterations converge fast, and the step while it would change
//!   little.
//! * **Order** 5, 3 for stages. Velocities and positions of very stiff motions may converge with order 3
//!   alone: order reduction.
//! * **Error estimate**: an embedded formula of order 3 with the factored real matrix as filter, (γ/h − J)⁻¹
//!   (f₀ + Σ eᵢ Zᵢ/h), so that what is stiff does not shorten the steps. It is far larger than the error of
//!   the step; as in Hairer's code it is held against 0.1 · tolerance^⅔. Predictive step control
//!   (Gustafsson).
//! * **Dense output**: the collocation polynomial of order 3 for u, its integral, of order 4, for q; where
//!   the quintic through q, q̇, q̈ at both ends ([`Hermite`]) agrees with it to what it may be off, that one,
//!   of order 4 in u: up to five times nearer where nothing is stiff. Where the quintic solves the equations
//!   of the stages nothing is made again for it; else Newton's iterations start from the known ends of the
//!   step.
//! * **Stability**: A-, B- and L-stable: what is stiff is damped, oscillations too. It is no method for
//!   oscillations that matter.
//! * **Cost**: 3 evaluations of q̈ per iteration, 2 to 5 iterations a step, and 1 at its end; 2N + 1 for a
//!   Jacobian by differences.
//! * **Constraints**: the stages solve the system with Φ̈ = 0, its multipliers eliminated, and the end is
//!   projected. The stabilised form of index 2 (Gear, Gupta & Leimkuhler), in which λ and a multiplier of Φ =
//!   0 are unknowns of the stages, was measured beside it on the car axis, 1,200 fixed steps: the same errors
//!   of q (6e-9) and u (2e-7), but its own λ has order 3 and is wrong by 2e-5, those of the state, as they
//!   are here, have order 5 and are wrong by 4e-8. It would cost larger matrices for that, and drift is at
//!   rounding either way. Six digits of the multipliers of Andrews' mechanism and of the car axis at
//!   tolerance 1e-8, where the index-3 code `radau5.f` has 0.2 and 2.7, are promised by tests
//!   (`tests/slow/mechanisms/`): hence no GGL form.
//! * **Moderate accuracy**: an ESDIRK method of order 4 ([`Esdirk4`](crate::integrate::Esdirk4)) and a Rosenbrock method
//!   of order 4 were measured beside it. On a pendulum on a stiff damped spring (k = 1e8) errors of their
//!   steps, each within its tolerance, all have one sign and add up to hundreds of times the tolerance, for
//!   stages of order 2 and less see a stiff direction that turns as a constraint of index 3; here it is
//!   twenty times.
//! * **Source**: Hairer & Wanner, *Solving ODE II*, 2nd ed., §IV.8; code `radau5.f`; Gustafsson, ACM TOMS 20
//!   (1994) 496.

use crate::integrate::phase::zip;
use crate::integrate::{
    ControllerSettings, Dense as _, Hermite, Method, Phase, Scheme, Step, StepNode, System, Tolerances,
};
use crate::linalg::elimination::{Matrices, product, reciprocal, solve, solve_blocks, solve_complex};
use crate::math;
use crate::model::Vector;

mod dense;
mod factorization;
mod table;
use dense::Cubic;
pub use dense::{Collocation, RadauInterpolant};
use factorization::split;
use table::*;

/// Most Newton iterations.
const MOST_ITERATIONS: u32 = 7;
/// Iterations that converge at this rate or faster keep the Jacobian.
const FAST: f64 = 1e-3;
/// Largest factor by which a step could grow and is left as it is, with its factored matrices.
const STEADY: f64 = 1.2;
/// Factored matrices serve steps that differ from theirs by no more than this part.
const SAME: f64 = 1e-6;
const SAFETY: f64 = 0.9;
/// Bounds of old over new step.
const SHRINK: f64 = 5.0;
const GROW: f64 = 1.0 / 8.0;
/// Share of the permitted error that Newton's iterations may leave.
const LEFT: f64 = 0.01;
/// The same, of what is left otherwise, where the Jacobians of the stages are used.
const STAGED_LEFT: f64 = 1e-4;
/// Number of N×N matrices that memory is needed for.
const SQUARES: usize = 14;
/// Steps that are made with the Jacobians of their stages before one Jacobian is tried again; twice as many
/// each time that this fails.
const STAGED: u32 = 32;
/// Iterations with the Jacobians of the stages that converge no faster get new ones.
const SLOW: f64 = 0.1;

/// Radau IIA of order 5.
#[derive(Clone, Debug)]
pub struct Radau5<V: Vector> {
    matrices: Matrices<V, SQUARES>,
    /// Where the Jacobian was computed.
    jacobian_at: Option<(f64, Phase<V>)>,
    /// Step for which the matrices are factored; 0: none.
    factored_for: f64,
    exchanges: [V; 2],
    /// Steps still to be made with the Jacobians of the stages, and how many there were the last time.
    staged: (u32, u32),
    stage_exchanges: [V; 3],
    /// u of the stages less u at the start.
    z: [V; 3],
    k: [Phase<V>; 4],
    error: Phase<V>,
    solved: bool,
    /// Where the attempt before this one started, and its step.
    tried: Option<(f64, Phase<V>)>,
    repeated: bool,
    h: f64,
    /// Newton iterations of this attempt and their rate; the factor between correction and error.
    iterations: u32,
    rate: f64,
    factor: f64,
    last: Option<LastRadauStep<V>>,
    /// u of the stages less u at the start, nearly, where the step to be tried is one that was made before.
    known: Option<[V; 3]>,
    /// What error estimates are held against, for these tolerances.
    permitted: Tolerances,
    permitted_for: Tolerances,
    /// Error of the step that is being accepted.
    judged: f64,
}

/// The last accepted step.
#[derive(Clone, Copy, Debug)]
struct LastRadauStep<V> {
    end: (f64, Phase<V>),
    h: f64,
    error: f64,
    velocities: Cubic<V>,
    /// Newton's rate allows the Jacobian to be kept.
    keep: bool,
}

/// How the Newton iterations ended.
#[derive(PartialEq)]
enum NewtonOutcome {
    Solved,
    /// They diverge, or would need too many.
    Slow,
    /// A stage is not a number.
    NotFinite,
}

impl<V: Vector> Radau5<V> {
    fn differentiate<S: System<V>>(&mut self, system: &mut S, start: &StepNode<V>) -> Result<(), S::Error> {
        let [by_q, by_u, ..] = split(&mut self.matrices);
        // Until it is complete there is none.
        (self.jacobian_at, self.factored_for) = (None, 0.0);
        system.jacobian(start, by_q, by_u)?;
        self.jacobian_at = Some((start.t, start.y));
        Ok(())
    }

    /// Stage i: its phase, from the velocities of all stages.
    #[inline(always)]
    fn stage(&self, start: &StepNode<V>, h: f64, i: usize) -> Phase<V> {
        let mut y = start.y;
        for l in 0..V::LEN {
            let along = A[i][0] * self.z[0][l] + A[i][1] * self.z[1][l] + A[i][2] * self.z[2][l];
            y.q[l] += h * (C[i] * start.y.u[l] + along);
            y.u[l] += self.z[i][l];
        }
        y
    }

    /// Solves for the stages, from where `z` is: with one Jacobian in transformed variables, or with one for
    /// each stage. `enough`: the part of the permitted error that may be left.
    fn iterate<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        h: f64,
        scale: &Phase<V>,
        (enough, staged): (f64, bool),
    ) -> Result<NewtonOutcome, S::Error> {
        let mut w = combine(&T_INVERSE, &self.z);
        self.factor = 1.0;
        if !(if staged { self.factor_filter(h) } else { self.factor_transformed(h) }) {
            return Ok(NewtonOutcome::Slow);
        }
        let mut renew = staged;
        self.rate = FAST;
        let (mut first, mut before, mut rate_before) = (0.0, 0.0, 0.0);
        for iteration in 1..=MOST_ITERATIONS {
            self.iterations = iteration;
            for (i, c) in C.iter().enumerate() {
                let y = self.stage(start, h, i);
                let a = system.accelerations(start.t + c * h, &y.q, &y.u)?;
                self.k[i + 1] = Phase { q: y.u, u: a };
            }
            if renew && !self.factor_stages(system, start, h)? {
                return Ok(NewtonOutcome::Slow);
            }
            let change = if staged { self.staged_correction(h) } else { self.correction(&w, h) };
            let size = self.size(&change, h, scale);
            renew = false;
            // Where this fails, what is corrected most is to blame.
            self.error.u = change[0];
            if !size.is_finite() {
                return Ok(NewtonOutcome::NotFinite);
            }
            if iteration > 1 {
                let rate = size / before;
                self.rate = if iteration == 2 { rate } else { math::sqrt(rate * rate_before) };
                rate_before = rate;
                renew = staged && rate > SLOW;
                if self.rate >= 0.99 {
                    // Corrections that do not get smaller, and are no more than may be left, are the rounding
                    // of stiff forces.
                    let rounding = size.max(before) <= enough;
                    // What Newton's method itself does in the beginning says little.
                    if !rounding && (!staged || size > 1e3 * first) {
                        return Ok(NewtonOutcome::Slow);
                    }
                    self.factor = 1.0;
                } else {
                    self.factor = self.rate / (1.0 - self.rate);
                    let left = math::powi(self.rate, (MOST_ITERATIONS - 1).saturating_sub(iteration) as i32);
                    if !staged && iteration < MOST_ITERATIONS && self.factor * size * left >= enough {
                        return Ok(NewtonOutcome::Slow);
                    }
                }
            } else {
                first = size;
            }
            before = size.max(f64::EPSILON);
            for (w, change) in w.iter_mut().zip(&change) {
                (0..V::LEN).for_each(|l| w[l] += change[l]);
            }
            self.z = combine(&T, &w);
            // One correction does not tell whether the next is smaller: a stiff direction that turns makes
            // another large of what is small in it.
            if self.factor * size <= enough && iteration > 1 {
                return Ok(NewtonOutcome::Solved);
            }
        }
        Ok(NewtonOutcome::Slow)
    }

    /// ΔW from the accelerations of the stages.
    #[inline(always)]
    fn correction(&mut self, w: &[V; 3], h: f64) -> [V; 3] {
        let mut change = combine(&T_INVERSE, &[self.k[1].u, self.k[2].u, self.k[3].u]);
        for l in 0..V::LEN {
            change[0][l] -= GAMMA / h * w[0][l];
            let (re, im) = product((ALPHA / h, BETA / h), (w[1][l], w[2][l]));
            change[1][l] -= re;
            change[2][l] -= im;
        }
        let [_, _, real, re, im, _] = split(&mut self.matrices);
        let [first, second, third] = &mut change;
        solve(real, &self.exchanges[0], first);
        solve_complex(re, im, &self.exchanges[1], second, third);
        change
    }

    /// As [`Radau5::correction`], with the Jacobians of the stages.
    #[inline(always)]
    fn staged_correction(&mut self, h: f64) -> [V; 3] {
        let mut change = combine(&A_INVERSE, &self.z);
        for (change, k) in change.iter_mut().zip(&self.k[1..]) {
            (0..V::LEN).for_each(|l| change[l] = k.u[l] - change[l] / h);
        }
        let [_, _, _, _, _, large] = split(&mut self.matrices);
        solve_blocks(large, &self.stage_exchanges, &mut change);
        combine(&T_INVERSE, &change)
    }

    /// What error estimates are held against: powers, which take as long as an evaluation of a small model.
    #[inline(always)]
    fn permit(&mut self, tolerances: &Tolerances) -> Tolerances {
        if self.permitted_for != *tolerances {
            (self.permitted, self.permitted_for) = (of_estimate(tolerances), *tolerances);
        }
        self.permitted
    }

    /// Norm of a correction: of the velocities, and of the positions that follow.
    #[inline(always)]
    fn size(&self, change: &[V; 3], h: f64, scale: &Phase<V>) -> f64 {
        let inverse = reciprocal(ALPHA / h, BETA / h);
        let mut sum = 0.0;
        for l in 0..V::LEN {
            let (re, im) = product(inverse, (change[1][l], change[2][l]));
            let of_q = [h / GAMMA * change[0][l], re, im];
            for (u, q) in change.iter().map(|change| change[l]).zip(of_q) {
                let (u, q) = (u / scale.u[l], q / scale.q[l]);
                sum += u * u + q * q;
            }
        }
        math::sqrt(sum / (6 * V::LEN) as f64)
    }

    /// (γ/h − J)⁻¹ v, for J = [[0, 1], [∂a/∂q, ∂a/∂u]].
    #[inline(always)]
    fn filter(&mut self, v: &Phase<V>, h: f64) -> Phase<V> {
        let n = V::LEN;
        let [by_q, _, real, ..] = split(&mut self.matrices);
        let mut error = *v;
        for i in 0..n {
            let along: f64 = (0..n).map(|j| by_q[i * n + j] * v.q[j]).sum();
            error.u[i] += h / GAMMA * along;
        }
        solve(real, &self.exchanges[0], &mut error.u);
        for i in 0..n {
            error.q[i] = h / GAMMA * (error.u[i] + v.q[i]);
        }
        error
    }

    /// The scaled norm of the error estimate.
    fn estimate<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        end: &Phase<V>,
        h: f64,
        permitted: &Tolerances,
    ) -> f64 {
        let mut stages = Phase::<V>::zeros();
        for (i, e) in E.iter().enumerate() {
            let y = self.stage(start, h, i);
            for l in 0..V::LEN {
                stages.q[l] += e / h * (y.q[l] - start.y.q[l]);
                stages.u[l] += e / h * self.z[i][l];
            }
        }
        self.error = self.filter(&zip(&stages, &start.derivative(), |e, f| e + f), h);
        let norm = permitted.norm(&self.error, &start.y, end);
        if norm < 1.0 || !(self.last.is_none() || self.repeated) {
            return norm;
        }
        // Once more through the filter: what is very stiff is else overestimated in the first steps.
        let moved = zip(&start.y, &self.error, |y, e| y + e);
        let Ok(a) = system.accelerations(start.t, &moved.q, &moved.u) else { return norm };
        let error = self.filter(&zip(&stages, &Phase { q: moved.u, u: a }, |e, f| e + f), h);
        let again = permitted.norm(&error, &start.y, end);
        if again.is_finite() {
            self.error = error;
            return again;
        }
        norm
    }
}

/// Σⱼ mᵢⱼ vⱼ.
#[inline(always)]
fn combine<V: Vector>(matrix: &[[f64; 3]; 3], v: &[V; 3]) -> [V; 3] {
    core::array::from_fn(|i| {
        let mut sum = V::zeros();
        for l in 0..V::LEN {
            sum[l] = matrix[i][0] * v[0][l] + matrix[i][1] * v[1][l] + matrix[i][2] * v[2][l];
        }
        sum
    })
}

/// The estimate has order 3, the result 5: an estimate of tolerance^⅔ belongs to an error of about the
/// tolerance.
fn of_estimate(tolerances: &Tolerances) -> Tolerances {
    let inner = |x: f64| 0.1 * math::powf(x, 2.0 / 3.0);
    let Tolerances { absolute, relative } = *tolerances;
    match relative > 0.0 {
        true => Tolerances { absolute: inner(relative) * absolute / relative, relative: inner(relative) },
        false => Tolerances { absolute: inner(absolute), relative },
    }
}

/// The part of `permitted` that Newton's iterations may leave: a hundredth of what is permitted in the
/// result. Where convergence and not accuracy bounds the step, what they leave adds up.
fn enough(tolerances: &Tolerances, permitted: &Tolerances) -> f64 {
    let (wanted, inner) = match permitted.relative > 0.0 {
        true => (tolerances.relative, permitted.relative),
        false => (tolerances.absolute, permitted.absolute),
    };
    (10.0 * f64::EPSILON / inner).max((LEFT * wanted / inner).min(0.03))
}

impl<V: Vector> Scheme<V> for Radau5<V> {
    const METHOD: Method = Method::Radau5;
    const ORDER: u32 = 5;
    const ERROR_ORDER: u32 = 3;
    const CONTROL: Option<ControllerSettings> =
        Some(ControllerSettings { safety: SAFETY, beta: 0.0, shrink: 1.0 / SHRINK, grow: 1.0 / GROW });
    const WEIGHTS: &'static [f64] = &[];
    const STABILITY_BORDER: f64 = f64::INFINITY;
    const EVENT_PANELS: usize = 8;
    type Dense = RadauInterpolant<V>;

    fn new() -> Self {
        Self {
            matrices: Matrices::new(),
            jacobian_at: None,
            factored_for: 0.0,
            exchanges: [V::zeros(); 2],
            staged: (0, STAGED / 2),
            stage_exchanges: [V::zeros(); 3],
            z: [V::zeros(); 3],
            k: [Phase::zeros(); 4],
            error: Phase::zeros(),
            solved: true,
            tried: None,
            repeated: false,
            h: 0.0,
            iterations: 0,
            rate: FAST,
            factor: 1.0,
            last: None,
            known: None,
            permitted: Tolerances::both(0.0),
            permitted_for: Tolerances::both(0.0),
            judged: 0.0,
        }
    }

    /// Constraints that are switched change the forces, and not the state.
    fn forget_history(&mut self) {
        (self.last, self.jacobian_at, self.tried, self.known) = (None, None, None, None);
    }

    fn attempt<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        h: f64,
        tolerances: &Tolerances,
    ) -> Result<(Phase<V>, f64), S::Error> {
        // Also where one Jacobian does not do and those of the stages are tried; and not in another step, if
        // this one fails.
        let known = self.known.take();
        let here = Some((start.t, start.y));
        self.repeated = self.tried == here;
        (self.tried, self.h) = (here, h);
        // Nothing counts of a step that was taken back.
        self.last = self.last.filter(|last| here == Some(last.end));
        self.k[0] = start.derivative();
        let permitted = self.permit(tolerances);
        let scale = zip(&start.y, &start.y, |x, y| permitted.scale(x, y));
        let enough = enough(tolerances, &permitted);
        let mut staged = self.staged.0 > 0;
        let keeps = !staged
            && self.last.is_some_and(|last| last.keep)
            && !self.repeated
            && self.jacobian_at.is_some();
        let mut fresh = self.jacobian_at == here;
        if !(fresh || keeps) {
            self.differentiate(system, start)?;
            fresh = true;
        }
        loop {
            self.z = match (known, &self.last) {
                (Some(known), _) => known,
                (None, Some(last)) => C.map(|c| last.velocities.beyond(c * h / last.h)),
                (None, None) => [V::zeros(); 3],
            };
            let enough = match staged {
                // Newton's method converges fast, and what is stiff turns small errors of positions into
                // large forces.
                true => (STAGED_LEFT * enough)
                    .max(10.0 * f64::EPSILON / permitted.relative.max(permitted.absolute)),
                false => enough,
            };
            let ended = self.iterate(system, start, h, &scale, (enough, staged))?;
            self.solved = ended != NewtonOutcome::Slow;
            match ended {
                NewtonOutcome::Solved => break,
                _ if !fresh => {
                    self.differentiate(system, start)?;
                    fresh = true;
                }
                NewtonOutcome::Slow if !staged => {
                    staged = true;
                    self.factored_for = 0.0;
                    self.staged.1 = (2 * self.staged.1).min(1 << 20);
                    self.staged.0 = self.staged.1;
                }
                NewtonOutcome::Slow => {
                    self.factor = 1.0;
                    return Ok((start.y, f64::INFINITY));
                }
                NewtonOutcome::NotFinite => return Ok((start.y, f64::NAN)),
            }
        }
        let end = self.stage(start, h, 2);
        let error = self.estimate(system, start, &end, h, &permitted);
        Ok((end, error))
    }

    #[inline(always)]
    fn finish<S: System<V>>(&mut self, system: &mut S, end_t: f64, end: &Phase<V>) -> Result<V, S::Error> {
        system.accelerations(end_t, &end.q, &end.u)
    }

    fn dense<S: System<V>>(
        &mut self,
        _: &mut S,
        start: &StepNode<V>,
        end: &StepNode<V>,
        h: f64,
    ) -> Result<RadauInterpolant<V>, S::Error> {
        let mut z = self.z;
        // The end may have been projected.
        (0..V::LEN).for_each(|l| z[2][l] = end.y.u[l] - start.y.u[l]);
        let stages = Collocation::new(start.y, &Cubic::new(&z), &end.y, h);
        Ok(RadauInterpolant::choose(Hermite::between(start, end, h), stages, &end.y, &self.permitted))
    }

    /// The quintic, where it solves the equations of the stages to within what is permitted: with r = q̈(θ) −
    /// a there, its u differs from that of the stages by h A r, what is stiff by less; r is 0 at the end, and
    /// of the other columns the first two rows of |A| sum to 0.7 at most.
    fn dense_from_ends<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        end: &StepNode<V>,
        h: f64,
        tolerances: &Tolerances,
    ) -> Result<Option<RadauInterpolant<V>>, S::Error> {
        let permitted = self.permit(tolerances);
        let quintic = Hermite::between(start, end, h);
        for c in [C[0], C[1]] {
            let y = quintic.at(c);
            let a = system.accelerations(start.t + c * h, &y.q, &y.u)?;
            let (has, mut apart) = (quintic.acceleration(c), Phase::<V>::zeros());
            for l in 0..V::LEN {
                let left = h * (a[l] - has[l]);
                (apart.q[l], apart.u[l]) = (h * left, left);
            }
            // What is not a number is not small.
            let near = permitted.norm(&apart, &start.y, &end.y) <= 1.0;
            if !near {
                return Ok(None);
            }
        }
        Ok(Some(RadauInterpolant::Quintic(quintic)))
    }

    fn prepare_replay(&mut self, step: &Step<V>, part: f64) -> bool {
        let Step { start, end, h, .. } = step;
        let between = Hermite::between(start, end, *h);
        self.known = Some(C.map(|c| zip(&between.at(c * part), &start.y, |to, from| to - from).u));
        true
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
        self.staged.0 = self.staged.0.saturating_sub(1);
        self.last = Some(LastRadauStep {
            end: (step.end.t, step.end.y),
            h: step.h,
            error: self.judged.max(1e-2),
            velocities: Cubic::new(&self.z),
            keep: self.rate <= FAST,
        });
    }

    fn adjust_step_factor(&mut self, _: f64, error: f64) -> f64 {
        self.judged = error;
        // Many iterations make a shorter step worth while.
        let most = f64::from(MOST_ITERATIONS);
        let safety = SAFETY.min(SAFETY * (1.0 + 2.0 * most) / (f64::from(self.iterations) + 2.0 * most));
        let root = |x: f64| math::sqrt(math::sqrt(x));
        let mut shorter = (root(error) / safety).clamp(GROW, SHRINK);
        if error > 1.0 {
            // The first step is a guess.
            return if self.last.is_none() { 0.1 } else { 1.0 / shorter };
        }
        if let Some(last) = &self.last {
            let predicted = last.h / self.h * root(error * error / last.error) / SAFETY;
            shorter = shorter.max(predicted.clamp(GROW, SHRINK));
        }
        if self.repeated {
            shorter = shorter.max(1.0);
        }
        let factor = 1.0 / shorter;
        if self.staged.0 == 0 && self.rate <= FAST && (1.0..=STEADY).contains(&factor) { 1.0 } else { factor }
    }

    fn stiffness(&self, _: f64, _: &StepNode<V>) -> Option<f64> {
        None
    }
}

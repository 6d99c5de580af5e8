//! Radau5: Radau IIA of order 5, implicit.
//!
//! * **Problem**: stiff motions, at tolerances down to about 10⁻¹⁰: springs and dampers that are much faster
//!   than the motion of interest.
//! * **Formula**: collocation at c = (4 − √6)/10, (4 + √6)/10, 1. Of the stages only the velocities are
//!   unknown, as q̇ = u gives the positions: Zᵘ = h A a(q₀ + h c u₀ + h A Zᵘ, u₀ + Zᵘ). Simplified Newton
//!   iterations in variables W = T⁻¹ Zᵘ that diagonalise A⁻¹: with an eigenvalue μ of A⁻¹/h, each is one
//!   system of N equations, (μ − ∂a/∂u − ∂a/∂q/μ) ΔW = T⁻¹ a − μ W, one real and one complex.
//! * **Jacobian and factors** are kept while the iterations converge fast, and the step while it would change
//!   little.
//! * **Order** 5, 3 for stages. Velocities and positions of very stiff motions may converge with order 3
//!   alone: order reduction.
//! * **Error estimate**: an embedded formula of order 3 with the factored real matrix as filter, (γ/h − J)⁻¹
//!   (f₀ + Σ eᵢ Zᵢ/h), so that stiff components do not shorten the steps. It is far larger than the error of
//!   the step; as in Hairer's code it is compared with 0.1 · tolerance^⅔. Predictive step control
//!   (Gustafsson).
//! * **Dense output**: the collocation polynomial of order 3 for u, its integral, of order 4, for q; where
//!   the quintic through q, q̇, q̈ at both ends ([`Hermite`]) agrees with it to its permitted error, the
//!   quintic, of order 4 in u: up to five times more accurate where nothing is stiff. Where the quintic
//!   solves the equations of the stages, the step is not repeated for it; else Newton's iterations start from
//!   the recorded ends of the step.
//! * **Stability**: A-, B- and L-stable: stiff components are damped, and so are fast oscillations. Do not
//!   use it for oscillations of interest.
//! * **Cost**: 3 evaluations of q̈ per iteration, 2 to 5 iterations a step, and 1 at its end; 2N + 1 for a
//!   Jacobian by differences.
//! * **Constraints**: the stages solve the system with Φ̈ = 0, its multipliers eliminated, and the end is
//!   projected. The stabilised form of index 2 (Gear, Gupta & Leimkuhler), in which λ and a multiplier of Φ =
//!   0 are unknowns of the stages, was measured beside it on the car axis, 1,200 fixed steps: the same errors
//!   of q (6e-9) and u (2e-7), but its own λ has order 3 and is wrong by 2e-5, those of the state, as they
//!   are here, have order 5 and are wrong by 4e-8. It would need larger matrices for that, and drift is at
//!   rounding either way. Tests (`tests/slow/mechanisms/`) demand six digits of the multipliers of Andrews'
//!   mechanism and of the car axis at tolerance 1e-8, where the index-3 code `radau5.f` has 0.2 and 2.7. So
//!   there is no GGL form.
//! * **Moderate accuracy**: an ESDIRK method of order 4 ([`Esdirk4`](crate::integrate::Esdirk4)) and a
//!   Rosenbrock method of order 4 were measured beside it. On a pendulum on a stiff damped spring (k = 1e8)
//!   errors of their steps, each within its tolerance, all have one sign and add up to hundreds of times the
//!   tolerance: to stages of order 2 or less a stiff direction that turns is a constraint of index 3. Here it
//!   is twenty times.
//! * **Source**: Hairer & Wanner, *Solving ODE II*, 2nd ed., §IV.8; code `radau5.f`; Gustafsson, ACM TOMS 20
//!   (1994) 496.

use crate::integrate::phase::zip;
use crate::integrate::{
    ControllerSettings, Dense as _, Hermite, Method, Phase, Scheme, Step, StepNode, System, Tolerances,
};
use crate::linalg::elimination::{Matrices, complex_product, reciprocal, solve, solve_blocks, solve_complex};
use crate::math;
use crate::model::Vector;

mod dense;
mod factorization;
mod table;
mod tolerances;
use dense::Cubic;
pub use dense::{Collocation, RadauInterpolant};
use factorization::split;
use table::*;
use tolerances::{newton_tolerance, scaled_tolerances};

/// Most Newton iterations of a step: that of `radau5.f`.
const MAX_ITERATIONS: u32 = 7;
/// Rate of convergence up to which the Jacobian is kept for the next step: that of `radau5.f`.
const KEPT_JACOBIAN_RATE: f64 = 1e-3;
/// Factor up to which a step does not grow although it could, so that its factored matrices are kept: that of
/// `radau5.f`.
const UNCHANGED_STEP_GROWTH: f64 = 1.2;
/// Factored matrices serve steps that differ from theirs by no more than this part: times are rounded.
const SAME_STEP_PART: f64 = 1e-6;
/// Safety factor of the step size: that of `radau5.f`.
const SAFETY: f64 = 0.9;
/// Largest ratio of old to new step: that of `radau5.f`.
const LARGEST_STEP_RATIO: f64 = 5.0;
/// Smallest ratio of old to new step: that of `radau5.f`.
const SMALLEST_STEP_RATIO: f64 = 1.0 / 8.0;
/// With the Jacobians of the stages Newton's iterations may leave this part of what they may leave otherwise:
/// they converge fast, and stiff forces amplify small errors of positions.
const STAGE_JACOBIAN_ERROR_PART: f64 = 1e-4;
/// Number of N×N matrices that memory is needed for: ∂a/∂q, ∂a/∂u, a real and a complex one, and the nine
/// blocks of the matrix of all stages.
const MATRIX_COUNT: usize = 14;
/// Steps that are made with the Jacobians of their stages before one Jacobian is tried again; the number
/// doubles each time that this fails.
const STAGE_JACOBIAN_STEPS: u32 = 32;
/// Rate of convergence from which on the Jacobians of the stages are renewed.
const RENEWAL_RATE: f64 = 0.1;

/// Radau IIA of order 5.
#[derive(Clone, Debug)]
pub struct Radau5<V: Vector> {
    matrices: Matrices<V, MATRIX_COUNT>,
    /// Where the Jacobian was computed.
    jacobian_at: Option<(f64, Phase<V>)>,
    /// Step for which the matrices are factored; 0: none.
    factored_for: f64,
    exchanges: [V; 2],
    /// Steps still to be made with the Jacobians of the stages, and their number when one Jacobian failed
    /// last.
    stage_jacobian_steps: (u32, u32),
    stage_exchanges: [V; 3],
    /// u of the stages less u at the start.
    z: [V; 3],
    k: [Phase<V>; 4],
    error: Phase<V>,
    solved: bool,
    /// The start of the attempt before this one.
    last_attempt: Option<(f64, Phase<V>)>,
    /// This attempt starts where the one before did: that one was rejected.
    is_repeated: bool,
    h: f64,
    /// Newton iterations of this attempt, and their rate of convergence.
    iterations: u32,
    rate: f64,
    /// Factor from the last correction to what is left of the error of the iterations.
    factor: f64,
    last: Option<LastRadauStep<V>>,
    /// u of the stages less u at the start, approximately, where a recorded step is repeated.
    replay_z: Option<[V; 3]>,
    /// The tolerances of error estimates that belong to the tolerances of the user.
    permitted: Tolerances,
    permitted_for: Tolerances,
    /// Error of the step that is being accepted.
    accepted_error: f64,
}

/// The last accepted step.
#[derive(Clone, Copy, Debug)]
struct LastRadauStep<V> {
    end: (f64, Phase<V>),
    h: f64,
    error: f64,
    velocities: Cubic<V>,
    /// Newton's iterations converged fast enough to keep the Jacobian.
    keeps_jacobian: bool,
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
    /// Evaluates the Jacobian at the start of a step.
    fn differentiate<S: System<V>>(&mut self, system: &mut S, start: &StepNode<V>) -> Result<(), S::Error> {
        let [by_q, by_u, ..] = split(&mut self.matrices);
        // The matrix is invalid while it is written, also if that fails.
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

    /// Solves for the stages by Newton's method from `z` on: with one Jacobian in the variables W, or, if
    /// `staged`, with a Jacobian for each stage. `enough`: the part of the permitted error that may be left.
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
        self.rate = KEPT_JACOBIAN_RATE;
        let (mut first, mut before, mut rate_before) = (0.0, 0.0, 0.0);
        for iteration in 1..=MAX_ITERATIONS {
            self.iterations = iteration;
            // 1. The accelerations of the stages, and the correction.
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
            // If the step fails, the error names the coordinate that is corrected most.
            self.error.u = change[0];
            if !size.is_finite() {
                return Ok(NewtonOutcome::NotFinite);
            }
            // 2. The rate of convergence; iterations that need too many more are given up.
            if iteration > 1 {
                let rate = size / before;
                self.rate = if iteration == 2 { rate } else { math::sqrt(rate * rate_before) };
                rate_before = rate;
                renew = staged && rate > RENEWAL_RATE;
                if self.rate >= 0.99 {
                    // Corrections that do not become smaller, and are no larger than may be left, are
                    // rounding of stiff forces.
                    let rounding = size.max(before) <= enough;
                    // With the Jacobians of the stages the first corrections may grow.
                    if !rounding && (!staged || size > 1e3 * first) {
                        return Ok(NewtonOutcome::Slow);
                    }
                    self.factor = 1.0;
                } else {
                    self.factor = self.rate / (1.0 - self.rate);
                    let left = math::powi(self.rate, (MAX_ITERATIONS - 1).saturating_sub(iteration) as i32);
                    if !staged && iteration < MAX_ITERATIONS && self.factor * size * left >= enough {
                        return Ok(NewtonOutcome::Slow);
                    }
                }
            } else {
                first = size;
            }
            // 3. The corrected stages.
            before = size.max(f64::EPSILON);
            for (w, change) in w.iter_mut().zip(&change) {
                (0..V::LEN).for_each(|l| w[l] += change[l]);
            }
            self.z = combine(&T, &w);
            // A single small correction is not enough: where a stiff direction turns, the next one may be
            // larger.
            if self.factor * size <= enough && iteration > 1 {
                return Ok(NewtonOutcome::Solved);
            }
        }
        Ok(NewtonOutcome::Slow)
    }

    /// Newton's correction ΔW from the accelerations of the stages.
    #[inline(always)]
    fn correction(&mut self, w: &[V; 3], h: f64) -> [V; 3] {
        let mut change = combine(&T_INVERSE, &[self.k[1].u, self.k[2].u, self.k[3].u]);
        for l in 0..V::LEN {
            change[0][l] -= GAMMA / h * w[0][l];
            let (re, im) = complex_product((ALPHA / h, BETA / h), (w[1][l], w[2][l]));
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

    /// The tolerances of error estimates. They are kept, since powers take as long as an evaluation of a
    /// small model.
    #[inline(always)]
    fn estimate_tolerances(&mut self, tolerances: &Tolerances) -> Tolerances {
        if self.permitted_for != *tolerances {
            (self.permitted, self.permitted_for) = (scaled_tolerances(tolerances), *tolerances);
        }
        self.permitted
    }

    /// Norm of a correction: of the velocities, and of the positions that follow.
    #[inline(always)]
    fn size(&self, change: &[V; 3], h: f64, scale: &Phase<V>) -> f64 {
        let inverse = reciprocal(ALPHA / h, BETA / h);
        let mut sum = 0.0;
        for l in 0..V::LEN {
            let (re, im) = complex_product(inverse, (change[1][l], change[2][l]));
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
        if norm < 1.0 || !(self.last.is_none() || self.is_repeated) {
            return norm;
        }
        // In the first steps the estimate is too large for very stiff components: it is filtered once more.
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

impl<V: Vector> Scheme<V> for Radau5<V> {
    const METHOD: Method = Method::Radau5;
    const ORDER: u32 = 5;
    const ERROR_ORDER: u32 = 3;
    const CONTROL: Option<ControllerSettings> = Some(ControllerSettings {
        safety: SAFETY,
        beta: 0.0,
        shrink: 1.0 / LARGEST_STEP_RATIO,
        grow: 1.0 / SMALLEST_STEP_RATIO,
    });
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
            stage_jacobian_steps: (0, STAGE_JACOBIAN_STEPS / 2),
            stage_exchanges: [V::zeros(); 3],
            z: [V::zeros(); 3],
            k: [Phase::zeros(); 4],
            error: Phase::zeros(),
            solved: true,
            last_attempt: None,
            is_repeated: false,
            h: 0.0,
            iterations: 0,
            rate: KEPT_JACOBIAN_RATE,
            factor: 1.0,
            last: None,
            replay_z: None,
            permitted: Tolerances::both(0.0),
            permitted_for: Tolerances::both(0.0),
            accepted_error: 0.0,
        }
    }

    /// Also after switching constraints, which changes the forces and not the state.
    fn forget_history(&mut self) {
        (self.last, self.jacobian_at, self.last_attempt, self.replay_z) = (None, None, None, None);
    }

    fn attempt<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        h: f64,
        tolerances: &Tolerances,
    ) -> Result<(Phase<V>, f64), S::Error> {
        // It serves all Newton iterations of this attempt, and no other attempt.
        let replay_z = self.replay_z.take();
        let here = Some((start.t, start.y));
        self.is_repeated = self.last_attempt == here;
        (self.last_attempt, self.h) = (here, h);
        // A step that was taken back is not continued.
        self.last = self.last.filter(|last| here == Some(last.end));
        self.k[0] = start.derivative();
        let permitted = self.estimate_tolerances(tolerances);
        let scale = zip(&start.y, &start.y, |x, y| permitted.scale(x, y));
        let enough = newton_tolerance(tolerances, &permitted);
        // 1. The Jacobian: kept while Newton's iterations converge fast, else evaluated here.
        let mut staged = self.stage_jacobian_steps.0 > 0;
        let keeps = !staged
            && self.last.is_some_and(|last| last.keeps_jacobian)
            && !self.is_repeated
            && self.jacobian_at.is_some();
        let mut fresh = self.jacobian_at == here;
        if !(fresh || keeps) {
            self.differentiate(system, start)?;
            fresh = true;
        }
        // 2. The stages. Where the iterations fail: first a new Jacobian, then one for each stage.
        loop {
            self.z = match (replay_z, &self.last) {
                (Some(z), _) => z,
                (None, Some(last)) => C.map(|c| last.velocities.beyond(c * h / last.h)),
                (None, None) => [V::zeros(); 3],
            };
            let enough = match staged {
                true => (STAGE_JACOBIAN_ERROR_PART * enough)
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
                    self.stage_jacobian_steps.1 = (2 * self.stage_jacobian_steps.1).min(1 << 20);
                    self.stage_jacobian_steps.0 = self.stage_jacobian_steps.1;
                }
                NewtonOutcome::Slow => {
                    self.factor = 1.0;
                    return Ok((start.y, f64::INFINITY));
                }
                NewtonOutcome::NotFinite => return Ok((start.y, f64::NAN)),
            }
        }
        // 3. The end is the last stage.
        let end = self.stage(start, h, 2);
        let error = self.estimate(system, start, &end, h, &permitted);
        Ok((end, error))
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

    /// The quintic, where it solves the equations of the stages to the permitted error. With r = q̈(θ) − a at
    /// the nodes its u differs from that of the stages by h A r, and by less in stiff components. r is 0 at
    /// the end, and in the other columns the first two rows of |A| sum to 0.7 at most.
    fn dense_from_ends<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        end: &StepNode<V>,
        h: f64,
        tolerances: &Tolerances,
    ) -> Result<Option<RadauInterpolant<V>>, S::Error> {
        let permitted = self.estimate_tolerances(tolerances);
        let quintic = Hermite::between(start, end, h);
        for c in [C[0], C[1]] {
            let y = quintic.at(c);
            let a = system.accelerations(start.t + c * h, &y.q, &y.u)?;
            let (has, mut apart) = (quintic.acceleration(c), Phase::<V>::zeros());
            for l in 0..V::LEN {
                let left = h * (a[l] - has[l]);
                (apart.q[l], apart.u[l]) = (h * left, left);
            }
            // NaN is not near.
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
        self.replay_z = Some(C.map(|c| zip(&between.at(c * part), &start.y, |to, from| to - from).u));
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
        self.stage_jacobian_steps.0 = self.stage_jacobian_steps.0.saturating_sub(1);
        self.last = Some(LastRadauStep {
            end: (step.end.t, step.end.y),
            h: step.h,
            error: self.accepted_error.max(1e-2),
            velocities: Cubic::new(&self.z),
            keeps_jacobian: self.rate <= KEPT_JACOBIAN_RATE,
        });
    }

    fn adjust_step_factor(&mut self, _: f64, error: f64) -> f64 {
        self.accepted_error = error;
        // After many iterations a shorter step is cheaper.
        let most = f64::from(MAX_ITERATIONS);
        let safety = SAFETY.min(SAFETY * (1.0 + 2.0 * most) / (f64::from(self.iterations) + 2.0 * most));
        let root = |x: f64| math::sqrt(math::sqrt(x));
        let mut shorter = (root(error) / safety).clamp(SMALLEST_STEP_RATIO, LARGEST_STEP_RATIO);
        if error > 1.0 {
            // The first step is a guess: it may be far too long.
            return if self.last.is_none() { 0.1 } else { 1.0 / shorter };
        }
        if let Some(last) = &self.last {
            let predicted = last.h / self.h * root(error * error / last.error) / SAFETY;
            shorter = shorter.max(predicted.clamp(SMALLEST_STEP_RATIO, LARGEST_STEP_RATIO));
        }
        if self.is_repeated {
            shorter = shorter.max(1.0);
        }
        let factor = 1.0 / shorter;
        if self.stage_jacobian_steps.0 == 0
            && self.rate <= KEPT_JACOBIAN_RATE
            && (1.0..=UNCHANGED_STEP_GROWTH).contains(&factor)
        {
            1.0
        } else {
            factor
        }
    }
}

//! Esdirk4: a diagonally implicit Runge–Kutta method of order 4(3), for stiff motions at moderate accuracy.
//!
//! * **Problem**: stiff springs, dampers and controllers in models of tens of coordinates, at tolerances of
//!   about 10⁻³ to 10⁻⁵. Its one real matrix of N rows is a fifth of what Radau IIA factors.
//! * **Formula**: ESDIRK4(3)6L\[2\]SA: six stages one after the other, the first of them the start, the last
//!   one the end. Of each only its velocities are unknown, U = u* + hγ a(q* + hγ U, U), γ = ¼, with u* and q*
//!   from the stages before: simplified Newton iterations with 1 − hγ ∂a/∂u − (hγ)² ∂a/∂q, one real matrix of
//!   N rows for all stages. The fifth stage lies 4 % of the step beyond its end: accelerations have to exist
//!   there.
//! * **Jacobian and factors** are kept from step to step while the iterations converge fast, and renewed
//!   within a stage where they do not: a stiff direction that turns asks for that.
//! * **Order** 4, stages of order 2. Positions and velocities of very stiff motions may converge with orders
//!   2 to 3: order reduction, more of it than Radau IIA has, which is why that is the method for many digits.
//! * **Where it fails**: a stiff direction that turns (a bob on a stiff spring) acts on stages of order 2
//!   like a constraint of index 3. The order is then 2. The errors of the steps, each within its tolerance,
//!   all take energy away and add up to hundreds of times the tolerance (Radau IIA: 20 times). `verify()`
//!   measures it by step doubling.
//! * **Error estimate**: four times the difference from the embedded formula of order 3, filtered by (1 − hγ
//!   J)⁻¹, so that stiff components do not shorten the steps.
//! * **Dense output**: the quintic through q, q̇, q̈ at both ends ([`Hermite`]), with the q̈ for which the
//!   stages were solved: free of the rounding errors that stiff forces make of positions.
//! * **Stability**: L-stable; the embedded formula damps stiff components, too. Oscillations are damped as
//!   with Radau IIA. Step control resolves them, at their cost.
//! * **Beside Radau IIA**, chains of bobs on stiff damped springs (k = 1e8) that swing for 2 s, same error at
//!   the end, one run: with 40 coordinates 0.4 of its time to 8e-5 and as much to 7e-6; with 16 coordinates
//!   1.4 times its time to 3e-5 and 3 times to 4e-6, with 4 coordinates 2.5 times to 1e-4 and 6 times to
//!   2e-6. Use it for many coordinates and few digits only.
//! * **Cost**: 1 evaluation of q̈ per iteration, 5 stages of 1 to 3 iterations; a Jacobian and one
//!   factorisation of N³/3 where they are renewed.
//! * **Source**: Kennedy & Carpenter, NASA/TM–2016–219173, §7.3; filter: Hairer & Wanner, *Solving ODE II*,
//!   §IV.8.

use crate::integrate::phase::zip;
use crate::integrate::{
    ControllerSettings, Dense as _, Hermite, Method, Phase, Scheme, Step, StepNode, System, Tolerances,
};
use crate::linalg::elimination::{Matrices, factor, solve};
use crate::math;
use crate::model::Vector;

mod table;
use table::*;

/// Most Newton iterations of a stage.
const MAX_STAGE_ITERATIONS: u32 = 10;
/// Rate of convergence from which on the iterations get a new Jacobian. A smaller value costs Jacobians, a
/// larger one iterations.
const RENEWAL_RATE: f64 = 0.2;
/// Rate of convergence up to which the Jacobian is kept for the next step.
const KEPT_JACOBIAN_RATE: f64 = 0.05;
/// Factored matrices serve steps that differ from theirs by no more than this part: times are rounded.
const SAME_STEP_PART: f64 = 1e-6;
/// Factor up to which a step does not grow although it could: its factored matrices are kept. A larger value
/// makes more steps, a smaller one more factorisations.
const UNCHANGED_STEP_GROWTH: f64 = 1.2;
/// Part of the permitted error that Newton's iterations may leave: they leave it in every stage, with one
/// sign where convergence is slow.
const NEWTON_ERROR_PART: f64 = 0.003;
/// Factor from the difference of the embedded formula to the error estimate. That difference is less than the
/// error: for y′ = λy two thirds of it at |hλ| = ½, a third at 1, a tenth at 2.
const ESTIMATE_FACTOR: f64 = 4.0;

/// ESDIRK4(3)6L\[2\]SA.
#[derive(Clone, Debug)]
pub struct Esdirk4<V: Vector> {
    /// ∂a/∂q, ∂a/∂u, and 1 − hγ ∂a/∂u − (hγ)² ∂a/∂q, factored.
    matrices: Matrices<V, 3>,
    exchanges: V,
    /// Step for which the matrix is factored; 0: none.
    factored_for: f64,
    /// Whether there is a Jacobian that may be used.
    has_jacobian: bool,
    /// Velocities and accelerations of the stages.
    k: [Phase<V>; STAGES],
    error: Phase<V>,
    solved: bool,
    /// Slowest rate of convergence in this step.
    rate: f64,
    /// Velocities from which the iterations of the stages start, where a recorded step is repeated.
    replay_velocities: Option<[V; STAGES]>,
    /// The last accepted step: its end, its size, changes of the velocities to its stages.
    last: Option<(StepNode<V>, f64, [V; STAGES])>,
}

/// How the iterations of a stage ended.
#[derive(PartialEq)]
enum StageOutcome {
    Solved,
    /// They converge too slowly, or diverge.
    Slow,
    NotFinite,
}

impl<V: Vector> Esdirk4<V> {
    /// Evaluates the Jacobian at a point.
    fn differentiate<S: System<V>>(&mut self, system: &mut S, at: &StepNode<V>) -> Result<(), S::Error> {
        // The matrix is invalid while it is written, also if that fails.
        (self.has_jacobian, self.factored_for) = (false, 0.0);
        let n = V::LEN * V::LEN;
        let (by_q, rest) = self.matrices.all().split_at_mut(n);
        system.jacobian(at, by_q, &mut rest[..n])?;
        self.has_jacobian = true;
        Ok(())
    }

    /// Factors the matrix of the stages for a step size; false where it is singular.
    fn factor(&mut self, h: f64) -> bool {
        if self.factored_for != 0.0 && (h / self.factored_for - 1.0).abs() <= SAME_STEP_PART {
            return true;
        }
        let (n, step) = (V::LEN, GAMMA * h);
        let (by_q, rest) = self.matrices.all().split_at_mut(n * n);
        let (by_u, matrix) = rest.split_at_mut(n * n);
        for i in 0..n * n {
            matrix[i] = -step * (by_u[i] + step * by_q[i]);
        }
        (0..n).for_each(|i| matrix[i * n + i] += 1.0);
        let exchanges = factor(matrix);
        self.exchanges = exchanges.unwrap_or_else(V::zeros);
        self.factored_for = if exchanges.is_some() { h } else { 0.0 };
        exchanges.is_some()
    }

    /// q* and u* of stage i, from the stages before it.
    #[inline(always)]
    fn stage_base(&self, start: &Phase<V>, h: f64, i: usize) -> Phase<V> {
        let mut y = *start;
        for (k, a) in self.k.iter().zip(&A[i]).take(i) {
            for l in 0..V::LEN {
                y.q[l] += h * a * k.q[l];
                y.u[l] += h * a * k.u[l];
            }
        }
        y
    }

    /// Velocities from which the iterations of stage i start: those of the polynomial through the stages
    /// before it, or, for the first implicit stage, through the stages of the last step.
    #[inline(always)]
    fn predicted(&self, start: &StepNode<V>, h: f64, i: usize) -> V {
        let mut u = start.y.u;
        if let Some(velocities) = &self.replay_velocities {
            return velocities[i];
        }
        match &self.last {
            _ if i > 1 => {
                let weights = continued(i, C[i]);
                for (k, w) in self.k.iter().zip(weights).take(i).skip(1) {
                    (0..V::LEN).for_each(|l| u[l] += w * (k.q[l] - start.y.u[l]));
                }
            }
            Some((end, size, stages)) if *end == *start => {
                let weights = continued(1, 1.0 + C[1] * h / size);
                for l in 0..V::LEN {
                    let along: f64 = (1..STAGES).map(|j| weights[j] * stages[j][l]).sum();
                    u[l] += along - stages[STAGES - 1][l];
                }
            }
            _ => {}
        }
        u
    }

    /// Solves for stage i by simplified Newton iterations, until the correction that is left is no larger
    /// than `enough` in units of `scale`.
    fn stage<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        (h, i): (f64, usize),
        (scale, enough): (&Phase<V>, f64),
    ) -> Result<StageOutcome, S::Error> {
        let (t, step) = (start.t + C[i] * h, GAMMA * h);
        let (base, mut u) = (self.stage_base(&start.y, h, i), self.predicted(start, h, i));
        let (mut before, mut renewed) = (f64::INFINITY, false);
        for iteration in 1..=MAX_STAGE_ITERATIONS {
            let q = zip(&Phase { q: base.q, u: base.u }, &Phase { q: u, u }, |x, u| x + step * u).q;
            let a = system.accelerations(t, &q, &u)?;
            if !self.has_jacobian {
                self.differentiate(system, &StepNode { t, y: Phase { q, u }, a })?;
                renewed = true;
            }
            if !self.factor(h) {
                return Ok(StageOutcome::Slow);
            }
            // Newton's correction of U, and its size for U and hγU.
            let mut change = base.u;
            (0..V::LEN).for_each(|l| change[l] += step * a[l] - u[l]);
            solve(self.matrices.one(2), &self.exchanges, &mut change);
            let mut sum = 0.0;
            for l in 0..V::LEN {
                let (of_u, of_q) = (change[l] / scale.u[l], step * change[l] / scale.q[l]);
                sum += of_u * of_u + of_q * of_q;
                u[l] += change[l];
            }
            let size = math::sqrt(sum / (2 * V::LEN) as f64);
            // If the step fails, the error names the coordinate that is corrected most.
            self.error.u = change;
            if !size.is_finite() {
                return Ok(StageOutcome::NotFinite);
            }
            // The rate of convergence gives what is left of the error; where it is slow the Jacobian is
            // renewed.
            let rate = if iteration > 1 { size / before } else { 1.0 };
            if iteration > 1 {
                self.rate = self.rate.max(rate);
            }
            let left = if rate < 1.0 { size * rate / (1.0 - rate) } else { size };
            if left <= enough {
                let mut k = Phase { q: u, u };
                (0..V::LEN).for_each(|l| k.u[l] = (u[l] - base.u[l]) / step);
                self.k[i] = k;
                return Ok(StageOutcome::Solved);
            }
            if iteration > 1 && rate > RENEWAL_RATE {
                if rate > 2.0 && renewed {
                    return Ok(StageOutcome::Slow);
                }
                self.has_jacobian = false;
            }
            before = size;
        }
        Ok(StageOutcome::Slow)
    }

    /// (1 − hγ J)⁻¹ v, for J = [[0, 1], [∂a/∂q, ∂a/∂u]].
    #[inline(always)]
    fn filter(&mut self, v: &Phase<V>, h: f64) -> Phase<V> {
        let (n, step) = (V::LEN, GAMMA * h);
        let mut error = *v;
        let by_q = self.matrices.one(0);
        for i in 0..n {
            let along: f64 = (0..n).map(|j| by_q[i * n + j] * v.q[j]).sum();
            error.u[i] += step * along;
        }
        solve(self.matrices.one(2), &self.exchanges, &mut error.u);
        (0..n).for_each(|i| error.q[i] += step * error.u[i]);
        error
    }

    /// Newton's method for all stages, one after the other.
    fn stages<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        h: f64,
        tolerances: &Tolerances,
    ) -> Result<StageOutcome, S::Error> {
        let scale = zip(&start.y, &start.y, |x, y| tolerances.scale(x, y));
        let tightest = tolerances.relative.max(f64::MIN_POSITIVE);
        let enough = NEWTON_ERROR_PART.max(10.0 * f64::EPSILON / tightest).min(0.1);
        for i in 1..STAGES {
            let ended = self.stage(system, start, (h, i), (&scale, enough))?;
            if ended != StageOutcome::Solved {
                return Ok(ended);
            }
        }
        Ok(StageOutcome::Solved)
    }
}

impl<V: Vector> Scheme<V> for Esdirk4<V> {
    const METHOD: Method = Method::Esdirk4;
    const ORDER: u32 = 4;
    const ERROR_ORDER: u32 = 3;
    const CONTROL: Option<ControllerSettings> =
        Some(ControllerSettings { safety: 0.9, beta: 0.0, shrink: 0.2, grow: 5.0 });
    const WEIGHTS: &'static [f64] = &[];
    const STABILITY_BORDER: f64 = f64::INFINITY;
    const EVENT_PANELS: usize = 8;
    quintic!(V);

    fn new() -> Self {
        Self {
            matrices: Matrices::new(),
            exchanges: V::zeros(),
            factored_for: 0.0,
            has_jacobian: false,
            k: [Phase::zeros(); STAGES],
            error: Phase::zeros(),
            solved: true,
            rate: 0.0,
            replay_velocities: None,
            last: None,
        }
    }

    fn forget_history(&mut self) {
        (self.last, self.has_jacobian, self.replay_velocities) = (None, false, None);
    }

    fn attempt<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        h: f64,
        tolerances: &Tolerances,
    ) -> Result<(Phase<V>, f64), S::Error> {
        self.k[0] = start.derivative();
        self.has_jacobian &= self.rate <= KEPT_JACOBIAN_RATE;
        self.rate = 0.0;
        let ended = self.stages(system, start, h, tolerances);
        self.replay_velocities = None;
        let ended = ended?;
        self.solved = ended != StageOutcome::Slow;
        if ended != StageOutcome::Solved {
            self.has_jacobian = false;
            return Ok((start.y, if self.solved { f64::NAN } else { f64::INFINITY }));
        }
        // The end, and the filtered difference from the embedded formula.
        let base = self.stage_base(&start.y, h, STAGES - 1);
        let last = &self.k[STAGES - 1];
        let mut end = Phase { q: base.q, u: last.q };
        (0..V::LEN).for_each(|l| end.q[l] += GAMMA * h * last.q[l]);
        let mut error = Phase::<V>::zeros();
        for (k, e) in self.k.iter().zip(E) {
            for l in 0..V::LEN {
                error.q[l] += ESTIMATE_FACTOR * h * e * k.q[l];
                error.u[l] += ESTIMATE_FACTOR * h * e * k.u[l];
            }
        }
        self.error = self.filter(&error, h);
        Ok((end, tolerances.norm(&self.error, &start.y, &end)))
    }

    /// The q̈ for which the last stage was solved.
    fn finish<S: System<V>>(&mut self, _: &mut S, _: f64, _: &Phase<V>) -> Result<V, S::Error> {
        Ok(self.k[STAGES - 1].u)
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

    fn prepare_replay(&mut self, step: &Step<V>, part: f64) -> bool {
        let Step { start, end, h, .. } = step;
        let between = Hermite::between(start, end, *h);
        self.replay_velocities = Some(C.map(|c| between.at(c * part).u));
        true
    }

    fn accept_step(&mut self, step: &Step<V>) {
        let mut changes = [V::zeros(); STAGES];
        for (change, k) in changes.iter_mut().zip(&self.k) {
            (0..V::LEN).for_each(|l| change[l] = k.q[l] - step.start.y.u[l]);
        }
        self.last = Some((step.end, step.h, changes));
    }

    fn adjust_step_factor(&mut self, factor: f64, error: f64) -> f64 {
        if error <= 1.0 && (1.0..=UNCHANGED_STEP_GROWTH).contains(&factor) { 1.0 } else { factor }
    }
}

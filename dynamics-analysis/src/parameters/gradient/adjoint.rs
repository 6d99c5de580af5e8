//! The adjoint equations, integrated backward along a motion (`gradient.rs`).
//!
//! Steps by Gauss collocation with five nodes; the difference from four nodes is the error. The quadratures
//! of J and its derivatives use the same nodes and are under error control, too. Steps end at the ends of the
//! motion's steps, at the instants of the objective, and at corners of the integrand.

use alloc::vec::Vec;

use dynamics_runtime::constrain::at_time;
use dynamics_runtime::model::{ModelState, Parameters, Vector};
use dynamics_runtime::simulate::{Motion, Simulate};
use nalgebra::{DMatrix, DVector};

use super::super::equations::{project_changes, size};
use super::super::sensitivity::collocation::{
    FACTOR_WITHOUT_SOLUTION, Gauss, MAX_FACTOR_AFTER_REJECTION, step_factor,
};
use super::super::sensitivity::forward_pass::{
    LAST_STEP_FACTOR, MAX_STEPS, MORE_REPEATED_STEPS, REPEATED_STEPS_FACTOR, RESOLVED_SHARE,
};
use super::super::sensitivity::jumps::refuse_jumps;
use super::super::sensitivity::variational_equations::VariationalEquations;
use super::super::sensitivity_error::SensitivityError;
use super::super::variable::Variable;
use super::corners::IntegrandCorners;
use super::objective::{Instant, ParsedObjective, WeightedSum};

/// Least scale of the error of a derivative, relative to the influence of the whole motion on J divided by
/// the size of the variable. A derivative without influence is only rounding.
const MIN_INFLUENCE: f64 = 1e-3;
/// Derivatives below this part of their least scale are integrated a second time with their own scale.
const REPEATED_DERIVATIVE_SIZE: f64 = 1e-2;
/// Largest difference between the change of an integrand over a step and the integral of its rate, relative
/// to the integrand. A larger difference is examined for a jump.
const EXAMINED_MISMATCH: f64 = 1e-6;
/// The same in tolerances, if that is larger.
const EXAMINED_MISMATCH_IN_TOLERANCES: f64 = 100.0;
/// Halvings of a step with such a difference.
const MAX_HALVINGS: usize = 10;
/// Part of the difference that a jump leaves after all halvings; a corner leaves 2⁻¹⁰, a thousandth.
const PERSISTENT_SHARE: f64 = 0.3;
/// Step of differences of the integrand by time, in parts of a step of integration.
const TIME_DIFFERENCE_STEP: f64 = 1e-4;

/// J and its derivatives.
pub(super) struct AdjointGradient {
    pub(super) value: f64,
    pub(super) derivatives: Vec<f64>,
    pub(super) steps: usize,
    pub(super) exact: bool,
}

/// Integrates the adjoint equations backward. Derivatives far below their least scale are integrated a second
/// time with their own scale, since the variable may only have a small size.
pub(super) fn integrate_backward<M: Simulate + Parameters + Clone>(
    motion: &Motion<'_, M>,
    variables: &[Variable],
    plan: &ParsedObjective,
    tolerance: f64,
) -> Result<AdjointGradient, SensitivityError> {
    let knots: Vec<M::State> = motion.steps().collect();
    let (start, end) = (motion.start_time(), motion.end_time());
    let outside = |instant: &&Instant| !(start.min(end)..=start.max(end)).contains(&instant.time);
    if let Some(instant) = plan.instants.iter().find(outside) {
        return Err(SensitivityError::OutOfRange { time: instant.time, start, end });
    }
    refuse_jumps(motion, &knots)?;
    let values = variables.iter().map(|variable| variable.value(motion.model(), &motion.start()));
    let mut least: Vec<f64> = values.map(|value| MIN_INFLUENCE / value.map_or(1.0, size)).collect();
    let (found, pass) =
        AdjointPass::run(motion, &knots, variables, plan, (tolerance, MAX_STEPS), &least, None)?;
    let mut again = false;
    for (k, least) in least.iter_mut().enumerate() {
        if pass.gathered[k] > 0.0 && pass.gathered[k] < REPEATED_DERIVATIVE_SIZE * *least * pass.moved {
            *least = 0.0;
            again = true;
        }
    }
    let most = REPEATED_STEPS_FACTOR * found.steps + MORE_REPEATED_STEPS;
    match again.then(|| {
        AdjointPass::run(motion, &knots, variables, plan, (tolerance, most), &least, Some(pass.corners))
    }) {
        Some(Ok((finer, _))) => Ok(finer),
        _ => Ok(found),
    }
}

/// The integration: λ, the accumulated value and derivatives, and the scales of errors.
struct AdjointPass<'a, 'm, M: Simulate> {
    linear: VariationalEquations<'a, 'm, M>,
    plan: &'a ParsedObjective,
    fine: Gauss,
    coarse: Gauss,
    tolerance: f64,
    most_steps: usize,
    /// The largest positions and velocities of the motion.
    sizes: [f64; 2],
    /// The sizes of the variables.
    variable_sizes: Vec<f64>,
    /// The least scales of the derivatives, relative to `moved`.
    least: Vec<f64>,
    lambda: DMatrix<f64>,
    derivatives: DVector<f64>,
    value: f64,
    /// ∫ |λᵀb + ℓ_p| dt of each variable so far.
    gathered: DVector<f64>,
    /// ∫ |ℓ| dt so far.
    gathered_value: f64,
    /// The least scale of errors of J.
    least_value: f64,
    /// The largest absolute values of the elements of λ so far.
    largest: DVector<f64>,
    /// The largest of these times the size of its coordinate or velocity: the influence of the whole motion
    /// on J.
    moved: f64,
    /// The largest integrand so far.
    integrand: f64,
    /// Corners of the integrand: the times on both sides of each.
    corners: Vec<[f64; 2]>,
    /// The next step.
    h: f64,
    steps: usize,
}

/// The result of a step: λ at its end, and the increments of value and derivatives.
struct AdjointStep {
    lambda: DMatrix<f64>,
    derivatives: DVector<f64>,
    gathered: DVector<f64>,
    value: f64,
    gathered_value: f64,
    /// ∫ ℓ̇ dt, and the largest |ℓ|.
    rise: f64,
    integrand: f64,
}

impl<'a, 'm, M: Simulate + Parameters + Clone> AdjointPass<'a, 'm, M> {
    /// Runs the integration. `corners` are those of the first one, if there was one.
    fn run(
        motion: &'a Motion<'m, M>,
        knots: &[M::State],
        variables: &[Variable],
        plan: &'a ParsedObjective,
        (tolerance, most_steps): (f64, usize),
        least: &[f64],
        corners: Option<Vec<[f64; 2]>>,
    ) -> Result<(AdjointGradient, Self), SensitivityError> {
        let (n, count) = (M::Vector::LEN, variables.len());
        let parameters = variables.iter().map(|variable| match variable {
            Variable::Parameter(i) => Some(*i),
            _ => None,
        });
        let most = |of: fn(&M::State) -> &M::Vector| {
            knots.iter().flat_map(|state| of(state).as_slice()).fold(0.0, |most: f64, x| most.max(x.abs()))
        };
        let mut pass = Self {
            linear: VariationalEquations::new(motion, parameters.collect()),
            plan,
            fine: Gauss::new(5),
            coarse: Gauss::new(4),
            tolerance,
            most_steps,
            sizes: [most(M::State::q), most(M::State::u)],
            variable_sizes: variables
                .iter()
                .map(|v| v.value(motion.model(), &motion.start()).map_or(1.0, size))
                .collect(),
            least: least.to_vec(),
            lambda: DMatrix::zeros(2 * n, 1),
            derivatives: DVector::zeros(count),
            value: 0.0,
            gathered: DVector::zeros(count),
            gathered_value: 0.0,
            least_value: 0.0,
            largest: DVector::zeros(2 * n),
            moved: 0.0,
            integrand: 0.0,
            corners: Vec::new(),
            h: knots.windows(2).last().map_or(0.0, |pair| pair[0].t() - pair[1].t()),
            steps: 0,
        };
        // The size of the integrand, its corners, then from the end to the start.
        pass.measure_integrand(knots)?;
        pass.corners = match corners {
            Some(corners) => corners,
            None => pass.find_corners(knots)?,
        };
        pass.along(knots)?;
        pass.at_start(&knots[0], variables)?;
        let found = AdjointGradient {
            value: pass.value,
            derivatives: pass.derivatives.as_slice().to_vec(),
            steps: pass.steps,
            exact: pass.linear.exact,
        };
        let all = found.derivatives.iter().chain([&found.value]);
        if all.copied().all(f64::is_finite) {
            Ok((found, pass))
        } else {
            Err(SensitivityError::NotFinite { time: motion.start_time() })
        }
    }

    /// The largest integrand at the ends of the motion's steps, for the scale of its errors.
    fn measure_integrand(&mut self, knots: &[M::State]) -> Result<(), SensitivityError> {
        let Some(integrand) = &self.plan.integrand else { return Ok(()) };
        for state in knots {
            self.integrand = self.integrand.max(integrand.value(&self.linear, state)?.abs());
        }
        let motion = self.linear.motion;
        self.least_value = MIN_INFLUENCE * self.integrand * (motion.end_time() - motion.start_time()).abs();
        Ok(())
    }

    /// The corners of the integrand, at which its derivatives jump. If it jumps itself, there is no gradient.
    fn find_corners(&mut self, knots: &[M::State]) -> Result<Vec<[f64; 2]>, SensitivityError> {
        let plan = self.plan;
        let Some(integrand) = plan.integrand.as_ref().filter(|integrand| integrand.has_outputs()) else {
            return Ok(Vec::new());
        };
        let sizes = self.sizes.map(|size| if size > 0.0 { size } else { 1.0 });
        let asks = self.linear.parameters.iter().any(Option::is_some);
        let parameter_sizes = if asks { self.variable_sizes.clone() } else { Vec::new() };
        let (linear, with_parameters) = (&mut self.linear, false);
        let mut corners = IntegrandCorners {
            linear,
            integrand,
            sizes,
            parameter_sizes,
            with_parameters,
            largest_derivative: 0.0,
            largest_value: 0.0,
            samples: 0,
        };
        let found = corners.along(knots)?;
        for [time, after] in found.iter().copied() {
            let [before, after] = [self.integrand_at(integrand, time)?, self.integrand_at(integrand, after)?];
            if (after - before).abs()
                > self.examined_difference() * self.integrand.max(before.abs()).max(after.abs())
            {
                return Err(SensitivityError::Jump { time, what: "an output that is integrated".into() });
            }
        }
        Ok(found)
    }

    /// Relative difference between the change of an integrand and the integral of its rate above which it is
    /// examined.
    fn examined_difference(&self) -> f64 {
        EXAMINED_MISMATCH.max(EXAMINED_MISMATCH_IN_TOLERANCES * self.tolerance)
    }

    /// Integrates from the end to the start, and adds the terms of the objective at their instants.
    fn along(&mut self, knots: &[M::State]) -> Result<(), SensitivityError> {
        let plan = self.plan;
        let forward = knots.last().is_some_and(|end| end.t() > knots[0].t());
        let mut instants: Vec<&Instant> = plan.instants.iter().collect();
        if !forward {
            instants.reverse();
        }
        let mut last = true;
        for pair in knots.windows(2).rev() {
            let (from, to) = (pair[0].t(), pair[1].t());
            if !last {
                self.project(&pair[1])?;
            }
            last = false;
            let mut t = to;
            let inside =
                |instant: &&&Instant| if forward { instant.time > from } else { instant.time < from };
            while let Some(instant) = instants.last().filter(inside) {
                if instant.time != t {
                    self.integrate_to(t, instant.time)?;
                    t = instant.time;
                }
                self.add_instant(instant)?;
                instants.pop();
            }
            self.integrate_to(t, from)?;
        }
        instants.iter().rev().try_for_each(|instant| self.add_instant(instant))
    }

    /// Adds a term at an instant to the value, λ and the derivatives.
    fn add_instant(&mut self, instant: &Instant) -> Result<(), SensitivityError> {
        let state = self.linear.sampler.at(instant.time);
        let (a, _) = self.linear.of(&state)?;
        let (value, sum) = instant.read(&self.linear, &state)?;
        let by = sum.derivatives(&self.linear, &state, &a)?;
        self.linear.exact &= by.exact;
        self.value += value;
        self.lambda += &by.state;
        self.gathered += by.parameters.abs();
        self.derivatives += by.parameters;
        self.update_sizes();
        Ok(())
    }

    /// Updates the largest elements of λ.
    fn update_sizes(&mut self) {
        let n = M::Vector::LEN;
        self.largest.zip_apply(&self.lambda.column(0), |most, x| *most = most.max(x.abs()));
        let moved = |i: usize| self.largest[i] * self.sizes[i / n];
        self.moved = (0..2 * n).map(moved).fold(self.moved, f64::max);
    }

    /// λ → Pᵀλ for the projection x → P x − c of variations onto the constraints.
    fn project(&mut self, state: &M::State) -> Result<(), SensitivityError> {
        if M::Rows::LEN == 0 {
            return Ok(());
        }
        let (n, count) = (M::Vector::LEN, self.linear.parameters.len());
        let mut changes = DMatrix::zeros(2 * n, 2 * n + count);
        changes.columns_mut(0, 2 * n).fill_with_identity();
        let mut parameters = alloc::vec![None; 2 * n];
        parameters.extend_from_slice(&self.linear.parameters);
        project_changes(self.linear.motion.model(), state, &parameters, &mut changes)?;
        self.derivatives += changes.columns(2 * n, count).tr_mul(&self.lambda.column(0));
        self.lambda = changes.columns(0, 2 * n).tr_mul(&self.lambda);
        Ok(())
    }

    /// Adds λ(0)ᵀ ∂y(0)/∂p: of elements of the start, and of parameters with which the projected start
    /// moves.
    fn at_start(&mut self, state: &M::State, variables: &[Variable]) -> Result<(), SensitivityError> {
        let n = M::Vector::LEN;
        let mut changes = DMatrix::zeros(2 * n, variables.len());
        for (k, variable) in variables.iter().enumerate() {
            match variable {
                Variable::Parameter(_) => {}
                Variable::Position(i) => changes[(*i, k)] = 1.0,
                Variable::Velocity(i) => changes[(n + i, k)] = 1.0,
            }
        }
        project_changes(self.linear.motion.model(), state, &self.linear.parameters, &mut changes)?;
        self.derivatives += changes.tr_mul(&self.lambda.column(0));
        Ok(())
    }

    /// Integrates from one time to another, against the motion, over corners of the integrand.
    fn integrate_to(&mut self, from: f64, to: f64) -> Result<(), SensitivityError> {
        let (low, high) = (from.min(to), from.max(to));
        let lies = |[before, after]: &&[f64; 2]| *before > low && *after < high;
        let mut inside: Vec<[f64; 2]> = self.corners.iter().filter(lies).copied().collect();
        if to < from {
            inside.iter_mut().for_each(|sides| sides.reverse());
            inside.reverse();
        }
        let mut t = from;
        for [near, far] in inside {
            self.integrate_smooth(t, near)?;
            t = far;
        }
        self.integrate_smooth(t, to)
    }

    /// Integrates from one time to another, between which motion and integrand are smooth.
    fn integrate_smooth(&mut self, from: f64, to: f64) -> Result<(), SensitivityError> {
        let sign = (to - from).signum();
        let mut t = from;
        while sign * (to - t) > 0.0 {
            self.h = sign * self.h.abs();
            let last = (to - t).abs() <= self.h.abs() * LAST_STEP_FACTOR;
            let h = if last { to - t } else { self.h };
            if t + RESOLVED_SHARE * h == t && !last || self.steps >= self.most_steps {
                return Err(SensitivityError::StepTooSmall { time: t });
            }
            let (Some(fine), Some(coarse)) = (self.step(t, h, true)?, self.step(t, h, false)?) else {
                self.h = FACTOR_WITHOUT_SOLUTION * h;
                continue;
            };
            let error = self.error(&fine, &coarse);
            let factor = step_factor(error);
            self.steps += 1;
            if error <= 1.0 {
                let next = if last { to } else { t + h };
                self.refuse_jump(t, next, &fine)?;
                t = next;
                self.accept(fine);
                // A step shortened at its end says little about the next one.
                self.h = if last { self.h.abs().max(factor * h.abs()) } else { factor * h };
            } else {
                self.h = factor.min(MAX_FACTOR_AFTER_REJECTION) * h;
            }
        }
        Ok(())
    }

    /// Takes over an accepted step.
    fn accept(&mut self, step: AdjointStep) {
        self.lambda = step.lambda;
        self.derivatives += step.derivatives;
        self.gathered += step.gathered;
        self.value += step.value;
        self.gathered_value += step.gathered_value;
        self.integrand = self.integrand.max(step.integrand);
        self.update_sizes();
    }

    /// A step with five or four nodes; `None` if the equations of the stages have no solution.
    fn step(&mut self, t: f64, h: f64, fine: bool) -> Result<Option<AdjointStep>, SensitivityError> {
        let (n, count) = (M::Vector::LEN, self.linear.parameters.len());
        let nodes = if fine { self.fine.nodes.clone() } else { self.coarse.nodes.clone() };
        let (mut equations, mut of_parameters) = (Vec::new(), Vec::new());
        let mut step = AdjointStep {
            lambda: DMatrix::zeros(0, 0),
            derivatives: DVector::zeros(count),
            gathered: DVector::zeros(count),
            value: 0.0,
            gathered_value: 0.0,
            rise: 0.0,
            integrand: 0.0,
        };
        // The equations at the nodes, and the quadrature of the integrand.
        for (c, weight) in nodes.iter().zip(self.gauss(fine).weights.clone().iter()) {
            let state = self.linear.sampler.at(t + c * h);
            let (a, b) = self.linear.of(&state)?;
            let mut source = DMatrix::zeros(2 * n, 1);
            let mut direct = DVector::zeros(count);
            if let Some(integrand) = &self.plan.integrand {
                let by = integrand.derivatives(&self.linear, &state, &a)?;
                self.linear.exact &= by.exact;
                let value = integrand.value(&self.linear, &state)?;
                step.value -= h * weight * value;
                step.gathered_value += (h * weight * value).abs();
                step.integrand = step.integrand.max(value.abs());
                if fine && integrand.has_outputs() {
                    step.rise +=
                        h * weight * self.rate(integrand, &state, &by.state, TIME_DIFFERENCE_STEP * h)?;
                }
                source.set_column(0, &-by.state);
                direct = by.parameters;
            }
            equations.push((-a.transpose(), source));
            of_parameters.push((b, direct));
        }
        // λ at the end and at the nodes, then the quadrature of the derivatives.
        let gauss = self.gauss(fine);
        let Some((end, stages)) = gauss.with_stages(&self.lambda, h, &equations) else { return Ok(None) };
        step.lambda = end;
        for ((lambda, (b, direct)), weight) in stages.iter().zip(&of_parameters).zip(gauss.weights.iter()) {
            let gained = (b.tr_mul(&lambda.column(0)) + direct) * (-h * weight);
            step.gathered += gained.abs();
            step.derivatives += gained;
        }
        Ok(Some(step))
    }

    /// The formula with five or with four nodes.
    fn gauss(&self, fine: bool) -> &Gauss {
        if fine { &self.fine } else { &self.coarse }
    }

    /// dℓ/dt along the motion.
    fn rate(
        &self,
        integrand: &WeightedSum,
        state: &M::State,
        by: &DVector<f64>,
        h: f64,
    ) -> Result<f64, SensitivityError> {
        let motion = self.linear.motion;
        let accelerations = motion.accelerations_of(state);
        let rates = state.u().as_slice().iter().chain(accelerations.as_slice());
        let of_state: f64 = rates.zip(by.iter()).map(|(x, by)| x * by).sum();
        let later = |by: f64| {
            let moved = at_time(state, state.t() + by);
            let moved = if motion.has_law() { motion.complete(moved) } else { moved };
            integrand.value(&self.linear, &moved)
        };
        Ok(of_state + (later(h)? - later(-h)?) / (2.0 * h))
    }

    /// The difference of both orders in tolerances.
    fn error(&self, fine: &AdjointStep, coarse: &AdjointStep) -> f64 {
        let n = M::Vector::LEN;
        let mut most = 0.0_f64;
        let mut measure = |off: f64, size: f64| {
            most = most.max(if off > 0.0 || off.is_nan() { off / (self.tolerance * size) } else { 0.0 });
        };
        for (half, size) in self.sizes.iter().enumerate() {
            let (mut off, mut largest) = (0.0_f64, 0.0_f64);
            for i in half * n..(half + 1) * n {
                off = off.max((fine.lambda[i] - coarse.lambda[i]).abs());
                largest = largest.max(self.largest[i]).max(fine.lambda[i].abs());
            }
            let least = if *size > 0.0 { MIN_INFLUENCE * self.moved / size } else { 0.0 };
            measure(off, largest.max(least));
        }
        for k in 0..fine.derivatives.len() {
            let off = (fine.derivatives[k] - coarse.derivatives[k]).abs();
            measure(off, (self.gathered[k] + fine.gathered[k]).max(self.least[k] * self.moved));
        }
        let size = (self.gathered_value + fine.gathered_value).max(self.least_value);
        measure((fine.value - coarse.value).abs(), size);
        if most.is_nan() { f64::INFINITY } else { most }
    }

    /// Checks that an integrand changed over a step by the integral of its rate. The difference at a corner
    /// shrinks with the interval, that at a jump does not.
    fn refuse_jump(&mut self, from: f64, to: f64, step: &AdjointStep) -> Result<(), SensitivityError> {
        let plan = self.plan;
        let Some(integrand) = plan.integrand.as_ref().filter(|integrand| integrand.has_outputs()) else {
            return Ok(());
        };
        let mut ends = [(from, self.integrand_at(integrand, from)?), (to, self.integrand_at(integrand, to)?)];
        let largest =
            [ends[0].1, ends[1].1, step.integrand].iter().fold(self.integrand, |most, x| most.max(x.abs()));
        let first = (ends[1].1 - ends[0].1 - step.rise).abs();
        if first <= self.examined_difference() * largest {
            return Ok(());
        }
        let mut left = first;
        for _ in 0..MAX_HALVINGS {
            let half = 0.5 * (ends[0].0 + ends[1].0);
            let half = (half, self.integrand_at(integrand, half)?);
            let sides = [[ends[0], half], [half, ends[1]]];
            let [one, other] =
                [self.rate_mismatch(integrand, sides[0])?, self.rate_mismatch(integrand, sides[1])?];
            (ends, left) = if one >= other { (sides[0], one) } else { (sides[1], other) };
        }
        if left > PERSISTENT_SHARE * first {
            return Err(SensitivityError::Jump {
                time: ends[0].0,
                what: "an output that is integrated".into(),
            });
        }
        Ok(())
    }

    fn integrand_at(&mut self, integrand: &WeightedSum, t: f64) -> Result<f64, SensitivityError> {
        let state = self.linear.sampler.at(t);
        integrand.value(&self.linear, &state)
    }

    /// The difference between the change of an integrand over an interval and the integral of its rate.
    fn rate_mismatch(
        &mut self,
        integrand: &WeightedSum,
        ends: [(f64, f64); 2],
    ) -> Result<f64, SensitivityError> {
        let h = ends[1].0 - ends[0].0;
        let mut left = ends[1].1 - ends[0].1;
        for (c, weight) in self.fine.nodes.clone().iter().zip(self.fine.weights.clone().iter()) {
            let state = self.linear.sampler.at(ends[0].0 + c * h);
            let (a, _) = self.linear.of(&state)?;
            let by = integrand.derivatives(&self.linear, &state, &a)?;
            left -= h * weight * self.rate(integrand, &state, &by.state, TIME_DIFFERENCE_STEP * h)?;
        }
        Ok(left.abs())
    }
}

//! The adjoint equations, integrated back along a motion.

use alloc::vec::Vec;

use dynamics_runtime::constrain::at_time;
use dynamics_runtime::model::{ModelState, Parameters, Vector};
use dynamics_runtime::simulate::{Motion, Simulate};
use nalgebra::{DMatrix, DVector};

use super::super::equations::{settle, size};
use super::super::sensitivity::along::MOST_STEPS;
use super::super::sensitivity::collocation::Gauss;
use super::super::sensitivity::linear::VariationalEquations;
use super::super::sensitivity::smooth::refuse_jumps;
use super::super::sensitivity_error::SensitivityError;
use super::super::variable::Variable;
use super::corners::IntegrandCorners;
use super::objective::{Blend, Instant, ParsedObjective};

/// Derivatives are measured by no less than this part of what moving the whole motion does, for each size of
/// their variable: what has no influence is made of rounding alone.
const LEAST_INFLUENCE: f64 = 1e-3;
/// Derivatives below this part of that are followed again, by their own size; in at most so many times the
/// steps, and so many more.
const OWN: f64 = 1e-2;
const AGAIN: (usize, usize) = (4, 100);
/// What the change of an integrand may differ from the integral of its rate, in parts of it, or in tolerances
/// of them: more is a jump.
const JUMP: (f64, f64) = (1e-6, 100.0);
/// How often such a step is halved, and what has to be left for it to be a jump: a corner leaves a
/// thousandth.
const HALVED: (usize, f64) = (10, 0.3);
/// Steps of differences by time, in parts of a step.
const LATER: f64 = 1e-4;

/// What was found.
pub(super) struct AdjointGradient {
    pub(super) value: f64,
    pub(super) derivatives: Vec<f64>,
    pub(super) steps: usize,
    pub(super) exact: bool,
}

/// J and its derivatives.
pub(super) fn back<M: Simulate + Parameters + Clone>(
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
    let mut least: Vec<f64> = values.map(|value| LEAST_INFLUENCE / value.map_or(1.0, size)).collect();
    let (found, way) =
        AdjointPass::follow(motion, &knots, variables, plan, (tolerance, MOST_STEPS), &least, None)?;
    let mut again = false;
    for (k, least) in least.iter_mut().enumerate() {
        if way.gathered[k] > 0.0 && way.gathered[k] < OWN * *least * way.moved {
            *least = 0.0;
            again = true;
        }
    }
    let most = AGAIN.0 * found.steps + AGAIN.1;
    match again.then(|| {
        AdjointPass::follow(motion, &knots, variables, plan, (tolerance, most), &least, Some(way.corners))
    }) {
        Some(Ok((finer, _))) => Ok(finer),
        _ => Ok(found),
    }
}

/// λ, what it has gathered, and what errors are measured by.
struct AdjointPass<'a, 'm, M: Simulate> {
    linear: VariationalEquations<'a, 'm, M>,
    plan: &'a ParsedObjective,
    fine: Gauss,
    coarse: Gauss,
    tolerance: f64,
    most_steps: usize,
    /// The largest positions and velocities of the motion.
    sizes: [f64; 2],
    /// Those of the variables.
    of_variables: Vec<f64>,
    least: Vec<f64>,
    lambda: DMatrix<f64>,
    derivatives: DVector<f64>,
    value: f64,
    /// ∫ |λᵀb + ℓ_p| dt of each variable so far.
    gathered: DVector<f64>,
    /// ∫ |ℓ| dt so far.
    gathered_value: f64,
    /// What J is measured by at least.
    least_value: f64,
    /// The largest elements of λ so far, and the most that they make of the whole motion.
    largest: DVector<f64>,
    moved: f64,
    /// The largest integrand so far.
    integrand: f64,
    /// Where derivatives of the integrand jump: the times on both sides.
    corners: Vec<[f64; 2]>,
    h: f64,
    steps: usize,
}

/// What a step adds.
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
    fn follow(
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
        let mut way = Self {
            linear: VariationalEquations::new(motion, parameters.collect()),
            plan,
            fine: Gauss::new(5),
            coarse: Gauss::new(4),
            tolerance,
            most_steps,
            sizes: [most(M::State::q), most(M::State::u)],
            of_variables: variables
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
        way.look(knots)?;
        way.corners = match corners {
            Some(corners) => corners,
            None => way.find_corners(knots)?,
        };
        way.along(knots)?;
        way.at_start(&knots[0], variables)?;
        let found = AdjointGradient {
            value: way.value,
            derivatives: way.derivatives.as_slice().to_vec(),
            steps: way.steps,
            exact: way.linear.exact,
        };
        let all = found.derivatives.iter().chain([&found.value]);
        if all.copied().all(f64::is_finite) {
            Ok((found, way))
        } else {
            Err(SensitivityError::NotFinite { time: motion.start_time() })
        }
    }

    /// How large the integrand is: beside that its errors count.
    fn look(&mut self, knots: &[M::State]) -> Result<(), SensitivityError> {
        let Some(integrand) = &self.plan.integrand else { return Ok(()) };
        for state in knots {
            self.integrand = self.integrand.max(integrand.value(&self.linear, state)?.abs());
        }
        let motion = self.linear.motion;
        self.least_value = LEAST_INFLUENCE * self.integrand * (motion.end_time() - motion.start_time()).abs();
        Ok(())
    }

    /// Where derivatives of the integrand jump. Where it does itself there is no gradient.
    fn find_corners(&mut self, knots: &[M::State]) -> Result<Vec<[f64; 2]>, SensitivityError> {
        let plan = self.plan;
        let Some(integrand) = plan.integrand.as_ref().filter(|integrand| integrand.has_outputs()) else {
            return Ok(Vec::new());
        };
        let sizes = self.sizes.map(|size| if size > 0.0 { size } else { 1.0 });
        let asks = self.linear.parameters.iter().any(Option::is_some);
        let of_parameters = if asks { self.of_variables.clone() } else { Vec::new() };
        let (linear, with_parameters) = (&mut self.linear, false);
        let mut corners = IntegrandCorners {
            linear,
            integrand,
            sizes,
            of_parameters,
            with_parameters,
            largest: 0.0,
            highest: 0.0,
            looks: 0,
        };
        let found = corners.along(knots)?;
        for [time, after] in found.iter().copied() {
            let [before, after] = [self.integrand_at(integrand, time)?, self.integrand_at(integrand, after)?];
            if (after - before).abs() > self.jump() * self.integrand.max(before.abs()).max(after.abs()) {
                return Err(SensitivityError::Jump { time, what: "an output that is integrated".into() });
            }
        }
        Ok(found)
    }

    /// What the change of an integrand may differ from what is foretold, in parts of it.
    fn jump(&self) -> f64 {
        JUMP.0.max(JUMP.1 * self.tolerance)
    }

    /// From the end to the start, instants on the way.
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
                self.settle(&pair[1])?;
            }
            last = false;
            let mut t = to;
            let inside =
                |instant: &&&Instant| if forward { instant.time > from } else { instant.time < from };
            while let Some(instant) = instants.last().filter(inside) {
                if instant.time != t {
                    self.go(t, instant.time)?;
                    t = instant.time;
                }
                self.take(instant)?;
                instants.pop();
            }
            self.go(t, from)?;
        }
        instants.iter().rev().try_for_each(|instant| self.take(instant))
    }

    /// Adds what is taken at an instant.
    fn take(&mut self, instant: &Instant) -> Result<(), SensitivityError> {
        let state = self.linear.sampler.at(instant.time);
        let (a, _) = self.linear.of(&state)?;
        let (value, blend) = instant.read(&self.linear, &state)?;
        let by = blend.derivatives(&self.linear, &state, &a)?;
        self.linear.exact &= by.exact;
        self.value += value;
        self.lambda += &by.state;
        self.gathered += by.parameters.abs();
        self.derivatives += by.parameters;
        self.measure();
        Ok(())
    }

    /// Remembers the sizes of λ.
    fn measure(&mut self) {
        let n = M::Vector::LEN;
        self.largest.zip_apply(&self.lambda.column(0), |most, x| *most = most.max(x.abs()));
        let moved = |i: usize| self.largest[i] * self.sizes[i / n];
        self.moved = (0..2 * n).map(moved).fold(self.moved, f64::max);
    }

    /// λ → Pᵀλ for x → P x − c, by which variations are put onto the constraints.
    fn settle(&mut self, state: &M::State) -> Result<(), SensitivityError> {
        if M::Rows::LEN == 0 {
            return Ok(());
        }
        let (n, count) = (M::Vector::LEN, self.linear.parameters.len());
        let mut changes = DMatrix::zeros(2 * n, 2 * n + count);
        changes.columns_mut(0, 2 * n).fill_with_identity();
        let mut parameters = alloc::vec![None; 2 * n];
        parameters.extend_from_slice(&self.linear.parameters);
        settle(self.linear.motion.model(), state, &parameters, &mut changes)?;
        self.derivatives += changes.columns(2 * n, count).tr_mul(&self.lambda.column(0));
        self.lambda = changes.columns(0, 2 * n).tr_mul(&self.lambda);
        Ok(())
    }

    /// What the start does, and moves of itself with the parameters.
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
        settle(self.linear.motion.model(), state, &self.linear.parameters, &mut changes)?;
        self.derivatives += changes.tr_mul(&self.lambda.column(0));
        Ok(())
    }

    /// From one time to another, against the motion, over corners of the integrand.
    fn go(&mut self, from: f64, to: f64) -> Result<(), SensitivityError> {
        let (low, high) = (from.min(to), from.max(to));
        let lies = |[before, after]: &&[f64; 2]| *before > low && *after < high;
        let mut inside: Vec<[f64; 2]> = self.corners.iter().filter(lies).copied().collect();
        if to < from {
            inside.iter_mut().for_each(|sides| sides.reverse());
            inside.reverse();
        }
        let mut t = from;
        for [near, far] in inside {
            self.smooth(t, near)?;
            t = far;
        }
        self.smooth(t, to)
    }

    /// From one time to another, between which motion and integrand are smooth.
    fn smooth(&mut self, from: f64, to: f64) -> Result<(), SensitivityError> {
        let sign = (to - from).signum();
        let mut t = from;
        while sign * (to - t) > 0.0 {
            self.h = sign * self.h.abs();
            // The last step is not left with a splinter.
            let last = (to - t).abs() <= self.h.abs() * 1.01;
            let h = if last { to - t } else { self.h };
            if t + 0.01 * h == t && !last || self.steps >= self.most_steps {
                return Err(SensitivityError::StepTooSmall { time: t });
            }
            let (Some(fine), Some(coarse)) = (self.step(t, h, true)?, self.step(t, h, false)?) else {
                self.h = 0.2 * h;
                continue;
            };
            let error = self.error(&fine, &coarse);
            let factor = if error > 0.0 { (0.9 * error.powf(-1.0 / 9.0)).clamp(0.2, 4.0) } else { 4.0 };
            self.steps += 1;
            if error <= 1.0 {
                let next = if last { to } else { t + h };
                self.refuse_jump(t, next, &fine)?;
                t = next;
                self.accept(fine);
                // A step that was cut short says little of the next.
                self.h = if last { self.h.abs().max(factor * h.abs()) } else { factor * h };
            } else {
                self.h = factor.min(0.9) * h;
            }
        }
        Ok(())
    }

    fn accept(&mut self, step: AdjointStep) {
        self.lambda = step.lambda;
        self.derivatives += step.derivatives;
        self.gathered += step.gathered;
        self.value += step.value;
        self.gathered_value += step.gathered_value;
        self.integrand = self.integrand.max(step.integrand);
        self.measure();
    }

    /// Tries a step; `None` where it has no solution.
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
                    step.rise += h * weight * self.rate(integrand, &state, &by.state, LATER * h)?;
                }
                source.set_column(0, &-by.state);
                direct = by.parameters;
            }
            equations.push((-a.transpose(), source));
            of_parameters.push((b, direct));
        }
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

    fn gauss(&self, fine: bool) -> &Gauss {
        if fine { &self.fine } else { &self.coarse }
    }

    /// dℓ/dt along the motion.
    fn rate(
        &self,
        integrand: &Blend,
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

    /// By how many tolerances the lower order differs.
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
            let least = if *size > 0.0 { LEAST_INFLUENCE * self.moved / size } else { 0.0 };
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

    /// That an integrand rose by as much as its rate says. What a corner leaves shrinks with the step, what a
    /// jump leaves does not.
    fn refuse_jump(&mut self, from: f64, to: f64, step: &AdjointStep) -> Result<(), SensitivityError> {
        let plan = self.plan;
        let Some(integrand) = plan.integrand.as_ref().filter(|integrand| integrand.has_outputs()) else {
            return Ok(());
        };
        let mut ends = [(from, self.integrand_at(integrand, from)?), (to, self.integrand_at(integrand, to)?)];
        let largest =
            [ends[0].1, ends[1].1, step.integrand].iter().fold(self.integrand, |most, x| most.max(x.abs()));
        let first = (ends[1].1 - ends[0].1 - step.rise).abs();
        if first <= self.jump() * largest {
            return Ok(());
        }
        let mut left = first;
        for _ in 0..HALVED.0 {
            let half = 0.5 * (ends[0].0 + ends[1].0);
            let half = (half, self.integrand_at(integrand, half)?);
            let sides = [[ends[0], half], [half, ends[1]]];
            let [one, other] =
                [self.unexplained(integrand, sides[0])?, self.unexplained(integrand, sides[1])?];
            (ends, left) = if one >= other { (sides[0], one) } else { (sides[1], other) };
        }
        if left > HALVED.1 * first {
            return Err(SensitivityError::Jump {
                time: ends[0].0,
                what: "an output that is integrated".into(),
            });
        }
        Ok(())
    }

    fn integrand_at(&mut self, integrand: &Blend, t: f64) -> Result<f64, SensitivityError> {
        let state = self.linear.sampler.at(t);
        integrand.value(&self.linear, &state)
    }

    /// By how much an integrand rises that its rate does not say.
    fn unexplained(&mut self, integrand: &Blend, ends: [(f64, f64); 2]) -> Result<f64, SensitivityError> {
        let h = ends[1].0 - ends[0].0;
        let mut left = ends[1].1 - ends[0].1;
        for (c, weight) in self.fine.nodes.clone().iter().zip(self.fine.weights.clone().iter()) {
            let state = self.linear.sampler.at(ends[0].0 + c * h);
            let (a, _) = self.linear.of(&state)?;
            let by = integrand.derivatives(&self.linear, &state, &a)?;
            left -= h * weight * self.rate(integrand, &state, &by.state, LATER * h)?;
        }
        Ok(left.abs())
    }
}

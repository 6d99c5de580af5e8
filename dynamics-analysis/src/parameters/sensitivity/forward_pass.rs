//! The variational equations, integrated along a motion (`sensitivity.rs`).
//!
//! Steps by Gauss collocation with five nodes; the difference from four nodes is the error. Errors are
//! relative to the largest element so far of the positions, or velocities, of each column. At the ends of the
//! motion's steps S is projected onto the tangent space of the constraints.

use alloc::vec::Vec;

use dynamics_runtime::model::{ModelState, Parameters, Vector};
use dynamics_runtime::simulate::{Motion, Simulate};
use nalgebra::DMatrix;

use super::super::equations::{project_changes, size};
use super::super::sensitivity_error::SensitivityError;
use super::super::variable::Variable;
use super::collocation::{FACTOR_WITHOUT_SOLUTION, Gauss, MAX_FACTOR_AFTER_REJECTION, step_factor};
use super::jumps::refuse_jumps;
use super::variational_equations::VariationalEquations;

/// Least scale of the errors of a column, relative to the size of the motion divided by the size of the
/// variable. A column without influence is only rounding, and would need infinitely short steps with its own
/// scale.
const MIN_COLUMN_SCALE: f64 = 1e-3;
/// Columns below this part of their least scale are integrated a second time with their own scale.
const REPEATED_COLUMN_SIZE: f64 = 1e-2;
/// The second integration may take this many times the steps of the first one, plus [`MORE_REPEATED_STEPS`].
pub(in super::super) const REPEATED_STEPS_FACTOR: usize = 4;
/// Steps that the second integration may take in addition. If the column or derivative was only
/// rounding, no steps are short enough, and the first result counts.
pub(in super::super) const MORE_REPEATED_STEPS: usize = 100;
/// Most steps.
pub(in super::super) const MAX_STEPS: usize = 1_000_000;
/// A last step may be longer than the step size by this factor, so that no tiny step is left.
pub(in super::super) const LAST_STEP_FACTOR: f64 = 1.01;
/// Part of a step below which time does not resolve it: the nodes must be different times.
pub(in super::super) const RESOLVED_SHARE: f64 = 0.01;

/// The sensitivities at the requested times.
pub(super) struct SensitivitySolution {
    pub(super) changes: Vec<DMatrix<f64>>,
    pub(super) exact: bool,
    pub(super) steps: usize,
}

/// S at the given times, in the direction of the motion.
///
/// A parameter near zero has a small size, so its column may be far below the least scale and yet have an
/// influence. Such columns are integrated a second time with their own scale.
pub(super) fn sensitivities<M: Simulate + Parameters + Clone>(
    motion: &Motion<'_, M>,
    variables: &[Variable],
    times: &[f64],
    tolerance: f64,
) -> Result<SensitivitySolution, SensitivityError> {
    let n = M::Vector::LEN;
    let mut least = least_scales(motion, variables);
    let (found, largest) = integrate(motion, variables, times, tolerance, &least, MAX_STEPS)?;
    let mut again = false;
    for (half, rows) in [largest.rows(0, n), largest.rows(n, n)].iter().enumerate() {
        for column in 0..variables.len() {
            let most = rows.column(column).amax();
            if most > 0.0 && most < REPEATED_COLUMN_SIZE * least[(half, column)] {
                least[(half, column)] = 0.0;
                again = true;
            }
        }
    }
    let most = REPEATED_STEPS_FACTOR * found.steps + MORE_REPEATED_STEPS;
    match again.then(|| integrate(motion, variables, times, tolerance, &least, most)) {
        Some(Ok((finer, _))) => Ok(finer),
        _ => Ok(found),
    }
}

/// S with errors relative to at least `least`, in at most `most_steps` steps; and its largest elements.
fn integrate<M: Simulate + Parameters + Clone>(
    motion: &Motion<'_, M>,
    variables: &[Variable],
    times: &[f64],
    tolerance: f64,
    least: &DMatrix<f64>,
    most_steps: usize,
) -> Result<(SensitivitySolution, DMatrix<f64>), SensitivityError> {
    let knots: Vec<M::State> = motion.steps().collect();
    refuse_jumps(motion, &knots)?;
    let parameters = variables.iter().map(|variable| match variable {
        Variable::Parameter(i) => Some(*i),
        _ => None,
    });
    let parameters: Vec<Option<usize>> = parameters.collect();
    // The start: unit columns for its elements, projected onto the constraints.
    let n = M::Vector::LEN;
    let mut x = DMatrix::zeros(2 * n, variables.len());
    for (k, variable) in variables.iter().enumerate() {
        match variable {
            Variable::Parameter(_) => {}
            Variable::Position(i) => x[(*i, k)] = 1.0,
            Variable::Velocity(i) => x[(n + i, k)] = 1.0,
        }
    }
    project_changes(motion.model(), &motion.start(), &parameters, &mut x)?;
    let first = knots.get(1).map_or(0.0, |next| next.t() - knots[0].t());
    let mut pass = ForwardPass {
        linear: VariationalEquations::new(motion, parameters),
        fine: Gauss::new(5),
        coarse: Gauss::new(4),
        tolerance,
        least: least.clone(),
        most_steps,
        largest: x.map(f64::abs),
        h: first,
        found: SensitivitySolution { changes: Vec::new(), exact: true, steps: 0 },
    };
    let mut times = times.iter().copied().peekable();
    let sign = first.signum();
    while times.next_if(|t| *t == knots[0].t()).is_some() {
        pass.found.changes.push(x.clone());
    }
    // From step to step of the motion, with the requested times in between.
    for pair in knots.windows(2) {
        let (from, to) = (pair[0].t(), pair[1].t());
        let mut t = from;
        while let Some(at) = times.next_if(|at| sign * (to - at) >= 0.0) {
            x = pass.integrate_to(x, t, at)?;
            t = at;
            pass.found.changes.push(x.clone());
        }
        if t != to {
            x = pass.integrate_to(x, t, to)?;
        }
        // Remove the drift off the constraints. Sensitivities at times in between have that of one step at
        // most.
        project_changes(motion.model(), &pair[1], &pass.linear.parameters, &mut x)?;
    }
    pass.found.exact = pass.linear.exact;
    Ok((pass.found, pass.largest))
}

/// The least scales of the positions and velocities of each column, 2×K.
fn least_scales<M: Simulate>(motion: &Motion<'_, M>, variables: &[Variable]) -> DMatrix<f64> {
    let start = motion.start();
    let largest = |of: fn(&M::State) -> &M::Vector| {
        let all = motion
            .steps()
            .map(|state| of(&state).as_slice().iter().fold(0.0, |most: f64, x| most.max(x.abs())));
        all.fold(0.0, f64::max)
    };
    let of_motion = [largest(M::State::q), largest(M::State::u)];
    let of = |k: usize| variables[k].value(motion.model(), &start).map_or(1.0, size);
    DMatrix::from_fn(2, variables.len(), |half, k| MIN_COLUMN_SCALE * of_motion[half] / of(k))
}

/// The integration of S.
struct ForwardPass<'a, 'm, M: Simulate> {
    linear: VariationalEquations<'a, 'm, M>,
    fine: Gauss,
    coarse: Gauss,
    tolerance: f64,
    /// The least scales of the positions and velocities of each column, 2×K.
    least: DMatrix<f64>,
    most_steps: usize,
    /// The largest absolute value of each element so far.
    largest: DMatrix<f64>,
    /// The next step.
    h: f64,
    found: SensitivitySolution,
}

impl<M: Simulate + Parameters + Clone> ForwardPass<'_, '_, M> {
    /// From one time to another, between which the motion is smooth.
    fn integrate_to(
        &mut self,
        mut x: DMatrix<f64>,
        from: f64,
        to: f64,
    ) -> Result<DMatrix<f64>, SensitivityError> {
        let sign = (to - from).signum();
        let mut t = from;
        while sign * (to - t) > 0.0 {
            self.h = sign * self.h.abs();
            let last = (to - t).abs() <= self.h.abs() * LAST_STEP_FACTOR;
            let h = if last { to - t } else { self.h };
            if t + RESOLVED_SHARE * h == t && !last || self.found.steps >= self.most_steps {
                return Err(SensitivityError::StepTooSmall { time: t });
            }
            let mut at_nodes = |nodes: &[f64]| {
                nodes.iter().map(|c| self.linear.at(t + c * h)).collect::<Result<Vec<_>, _>>()
            };
            let (fine, coarse) = (at_nodes(&self.fine.nodes)?, at_nodes(&self.coarse.nodes)?);
            let ends = (self.fine.step(&x, h, &fine), self.coarse.step(&x, h, &coarse));
            let (Some(end), Some(lower)) = ends else {
                self.h = FACTOR_WITHOUT_SOLUTION * h;
                continue;
            };
            let error = self.error(&end, &lower);
            let factor = step_factor(error);
            self.found.steps += 1;
            if error <= 1.0 {
                (x, t) = (end, if last { to } else { t + h });
                self.largest.zip_apply(&x, |most, x| *most = most.max(x.abs()));
                // A step shortened at its end says little about the next one.
                self.h = if last { self.h.abs().max(factor * h.abs()) } else { factor * h };
            } else {
                self.h = factor.min(MAX_FACTOR_AFTER_REJECTION) * h;
            }
        }
        Ok(x)
    }

    /// The difference of both orders in tolerances, relative to the largest position, or velocity, of each
    /// column.
    fn error(&self, end: &DMatrix<f64>, lower: &DMatrix<f64>) -> f64 {
        let n = M::Vector::LEN;
        let mut most = 0.0_f64;
        for column in 0..end.ncols() {
            for half in [0, n] {
                let (mut off, mut size) = (0.0_f64, self.least[(half / n, column)]);
                for i in half..half + n {
                    let at = (i, column);
                    off = off.max((end[at] - lower[at]).abs());
                    size = size.max(self.largest[at]).max(end[at].abs());
                }
                most = most.max(if off > 0.0 { off / (self.tolerance * size) } else { 0.0 });
            }
        }
        most
    }
}

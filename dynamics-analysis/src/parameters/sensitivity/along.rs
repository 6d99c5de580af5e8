//! The variational equations, integrated along a motion.

use alloc::vec::Vec;

use dynamics_runtime::model::{ModelState, Parameters, Vector};
use dynamics_runtime::simulate::{Motion, Simulate};
use nalgebra::DMatrix;

use super::super::equations::{settle, size};
use super::super::sensitivity_error::SensitivityError;
use super::super::variable::Variable;
use super::collocation::Gauss;
use super::linear::VariationalEquations;
use super::smooth::refuse_jumps;

/// Columns below this part of the motion per unit of the variable are scaled by the motion instead, because a
/// column without influence is only rounding.
const LEAST_COLUMN_SCALE: f64 = 1e-3;
/// Columns below this part of that are followed again, by their own size; in at most so many times the steps,
/// and so many more.
const OWN: f64 = 1e-2;
const AGAIN: (usize, usize) = (4, 100);
/// Most steps.
pub(in super::super) const MOST_STEPS: usize = 1_000_000;

/// What was found at the times, and how.
pub(super) struct SensitivitySolution {
    pub(super) changes: Vec<DMatrix<f64>>,
    pub(super) exact: bool,
    pub(super) steps: usize,
}

/// S at the given times, which stand along the motion.
///
/// A parameter near zero has a small size, by which a column that matters may look like rounding: columns far
/// below what they were measured by are followed once more by their own size alone.
pub(super) fn along<M: Simulate + Parameters + Clone>(
    motion: &Motion<'_, M>,
    variables: &[Variable],
    times: &[f64],
    tolerance: f64,
) -> Result<SensitivitySolution, SensitivityError> {
    let n = M::Vector::LEN;
    let mut least = least(motion, variables);
    let (found, largest) = follow(motion, variables, times, tolerance, &least, MOST_STEPS)?;
    let mut again = false;
    for (half, rows) in [largest.rows(0, n), largest.rows(n, n)].iter().enumerate() {
        for column in 0..variables.len() {
            let most = rows.column(column).amax();
            if most > 0.0 && most < OWN * least[(half, column)] {
                least[(half, column)] = 0.0;
                again = true;
            }
        }
    }
    // Where it was rounding after all, no steps are short enough.
    let most = AGAIN.0 * found.steps + AGAIN.1;
    match again.then(|| follow(motion, variables, times, tolerance, &least, most)) {
        Some(Ok((finer, _))) => Ok(finer),
        _ => Ok(found),
    }
}

/// S, its errors measured at least by `least`, in so many steps; and its largest elements.
fn follow<M: Simulate + Parameters + Clone>(
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
    let n = M::Vector::LEN;
    let mut x = DMatrix::zeros(2 * n, variables.len());
    for (k, variable) in variables.iter().enumerate() {
        match variable {
            Variable::Parameter(_) => {}
            Variable::Position(i) => x[(*i, k)] = 1.0,
            Variable::Velocity(i) => x[(n + i, k)] = 1.0,
        }
    }
    settle(motion.model(), &motion.start(), &parameters, &mut x)?;
    let first = knots.get(1).map_or(0.0, |next| next.t() - knots[0].t());
    let mut way = ForwardPass {
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
        way.found.changes.push(x.clone());
    }
    for pair in knots.windows(2) {
        let (from, to) = (pair[0].t(), pair[1].t());
        let mut t = from;
        while let Some(at) = times.next_if(|at| sign * (to - at) >= 0.0) {
            x = way.go(x, t, at)?;
            t = at;
            way.found.changes.push(x.clone());
        }
        if t != to {
            x = way.go(x, t, to)?;
        }
        // Errors of steps drift off the constraints; what is kept at times between is off by one step's at
        // most.
        settle(motion.model(), &pair[1], &way.linear.parameters, &mut x)?;
    }
    way.found.exact = way.linear.exact;
    Ok((way.found, way.largest))
}

/// What columns are measured by at least.
fn least<M: Simulate>(motion: &Motion<'_, M>, variables: &[Variable]) -> DMatrix<f64> {
    let start = motion.start();
    let largest = |of: fn(&M::State) -> &M::Vector| {
        let all = motion
            .steps()
            .map(|state| of(&state).as_slice().iter().fold(0.0, |most: f64, x| most.max(x.abs())));
        all.fold(0.0, f64::max)
    };
    let of_motion = [largest(M::State::q), largest(M::State::u)];
    let of = |k: usize| variables[k].value(motion.model(), &start).map_or(1.0, size);
    DMatrix::from_fn(2, variables.len(), |half, k| LEAST_COLUMN_SCALE * of_motion[half] / of(k))
}

struct ForwardPass<'a, 'm, M: Simulate> {
    linear: VariationalEquations<'a, 'm, M>,
    fine: Gauss,
    coarse: Gauss,
    tolerance: f64,
    /// What the positions and the velocities of each column are measured by at least, 2×K.
    least: DMatrix<f64>,
    most_steps: usize,
    /// The largest of each element so far: what errors are measured by.
    largest: DMatrix<f64>,
    h: f64,
    found: SensitivitySolution,
}

impl<M: Simulate + Parameters + Clone> ForwardPass<'_, '_, M> {
    /// From one time to another, between which the motion is smooth.
    fn go(&mut self, mut x: DMatrix<f64>, from: f64, to: f64) -> Result<DMatrix<f64>, SensitivityError> {
        let sign = (to - from).signum();
        let mut t = from;
        while sign * (to - t) > 0.0 {
            self.h = sign * self.h.abs();
            // The last step is not left with a splinter.
            let last = (to - t).abs() <= self.h.abs() * 1.01;
            let h = if last { to - t } else { self.h };
            if t + 0.01 * h == t && !last || self.found.steps >= self.most_steps {
                return Err(SensitivityError::StepTooSmall { time: t });
            }
            let mut at_nodes = |nodes: &[f64]| {
                nodes.iter().map(|c| self.linear.at(t + c * h)).collect::<Result<Vec<_>, _>>()
            };
            let (fine, coarse) = (at_nodes(&self.fine.nodes)?, at_nodes(&self.coarse.nodes)?);
            let ends = (self.fine.step(&x, h, &fine), self.coarse.step(&x, h, &coarse));
            let (Some(end), Some(lower)) = ends else {
                self.h = 0.2 * h;
                continue;
            };
            let error = self.error(&end, &lower);
            let factor = if error > 0.0 { (0.9 * error.powf(-1.0 / 9.0)).clamp(0.2, 4.0) } else { 4.0 };
            self.found.steps += 1;
            if error <= 1.0 {
                (x, t) = (end, if last { to } else { t + h });
                self.largest.zip_apply(&x, |most, x| *most = most.max(x.abs()));
                // A step that was cut short says little of the next.
                self.h = if last { self.h.abs().max(factor * h.abs()) } else { factor * h };
            } else {
                self.h = factor.min(0.9) * h;
            }
        }
        Ok(x)
    }

    /// By how many tolerances the lower order differs, positions and velocities of each column measured by
    /// their own largest.
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

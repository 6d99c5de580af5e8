//! A motion with its variations: state and tangent vectors, integrated together.
//!
//! ```text
//! q̈ = a(q, q̇, t)        δq̈ = a_q δq + a_u δq̇ for every tangent vector
//! ∫ tr a_u dt, the logarithm of the change of volumes
//! ```
//!
//! With constraints, a is the constrained acceleration. Tangent vectors start in the tangent space and stay
//! there to the tolerance. After every step the motion is projected back. Volumes: q̈ = a(q, q̇, t) has the
//! divergence tr a_u (Liouville); the constrained directions obey Φ̈ = 0, which has none. By Verner's pair of
//! order 9(8) (`integrate/explicit/verner9.rs`), with the tangent vectors under error control, so that they
//! are as accurate as the motion. If a branch of the model changes, the step ends, and a jump of the
//! acceleration transforms the tangent vectors (`corners.rs`, `flow/corner_passage.rs`).

mod corner_passage;

use alloc::boxed::Box;
use alloc::vec::Vec;

use dynamics_runtime::constrain::{accelerate, project_positions, project_velocities};
use dynamics_runtime::error::SolveError;
use dynamics_runtime::integrate::verner9_table::{self as table, ROWS};
use dynamics_runtime::integrate::{Controller, ControllerSettings};
use dynamics_runtime::model::{Constraints, ModelState, Vector};
use nalgebra::DMatrix;

use super::PeriodicError;
use super::corners::HeldBranches;
use super::variation::derivatives;
use crate::LinearizeError;

/// Settings of the step size controller: those of the method itself (`integrate/verner9.rs`).
const CONTROLLER_SETTINGS: ControllerSettings =
    ControllerSettings { safety: 0.9, beta: 0.0, shrink: 0.333, grow: 6.0 };
/// Multiple of the first coordinates or velocities (at least 1) at which a motion counts as diverged. A
/// larger one costs time before the error; a smaller one could end motions that return.
const DIVERGED: f64 = 1e8;
/// Reciprocal of the part of the integration time in which a motion may cover the distance of its start:
/// coordinates divided by this time are allowed as velocities.
const FAST_PARTS: f64 = 1e3;
/// Least length of a tangent vector as a scale of its error. Shorter ones have decayed, and would underflow.
const MIN_TANGENT_SCALE: f64 = 1e-200;
/// Part of h q̇ (or of q/h) that is the least scale of errors of displacements (or velocities) of a tangent
/// vector.
const MIN_TANGENT_SHARE: f64 = 0.01;
/// First step, relative to the integration time. The controller adapts it within a few steps.
const FIRST_STEP: f64 = 1e-3;
/// Step, in roundings of the time, below which the integration stalls. The stages of a shorter step would be
/// at equal times.
const MIN_STEP_ROUNDINGS: f64 = 16.0;
/// Step, relative to the integration time, down to which a failed step is repeated with a quarter of the
/// size.
const MIN_REPEATED_STEP: f64 = 1e-10;
/// A step of at least this part of the time that is left ends at its end.
const LAST_STEP_SHARE: f64 = 0.9999;
/// Largest part of the time that is left for any other step. With a little more than a half, the last two
/// steps are equal, and no tiny step is left.
const LARGEST_STEP_SHARE: f64 = 0.5001;
/// Factor of a step that failed because a stage has no rates.
const FACTOR_AFTER_FAILURE: f64 = 0.25;
/// Step, relative to the integration time, below which stages on another branch mean that the motion touches
/// the corner. A larger value refuses motions that cross the corner twice in a short time.
const MIN_STEP_AT_CORNER: f64 = 1e-9;

/// Integrates a model with its variations; modes, and inputs, are those of the start.
pub(super) struct Flow<'m, M: Constraints> {
    pub(super) model: &'m M,
    pub(super) constants: M::Constants,
    pub(super) tolerance: f64,
    pub(super) most_steps: usize,
    workspace: Vec<f64>,
    by: [Vec<f64>; 2],
    stages: Vec<Vec<f64>>,
    /// Whether a stage of the last attempt lay on another branch.
    left_branch: bool,
}

/// The end of an integration.
pub(super) struct FlowEnd<S> {
    pub(super) state: S,
    /// 2N×K: δq above δq̇.
    pub(super) tangents: DMatrix<f64>,
    /// ∫ tr a_u dt; 0 where there are no tangent vectors.
    pub(super) divergence: f64,
    pub(super) steps: usize,
}

/// The state of an integration between two steps.
struct FlowState<S> {
    state: S,
    /// State, tangent vectors and divergence, one after the other.
    y: Vec<f64>,
    /// ẏ.
    slope: Vec<f64>,
    corners: HeldBranches,
    control: Controller,
    /// The size of the next step.
    h: f64,
    /// The time of the whole integration.
    span: f64,
}

impl<'m, M: Constraints> Flow<'m, M> {
    pub(super) fn new(model: &'m M, tolerance: f64, most_steps: usize) -> Result<Self, PeriodicError> {
        if M::FRICTION {
            return Err(PeriodicError::Derivatives(LinearizeError::Friction));
        }
        if !M::KINKS_ARE_ALL {
            return Err(PeriodicError::Derivatives(LinearizeError::BranchesNotFollowed));
        }
        let n = M::Vector::LEN;
        let workspace = dynamics_runtime::constrain::workspace_len(n, M::Rows::LEN);
        Ok(Self {
            model,
            constants: model.constants().map_err(SolveError::from)?,
            tolerance,
            most_steps,
            workspace: alloc::vec![0.0; workspace],
            by: [alloc::vec![0.0; n * n], alloc::vec![0.0; n * n]],
            stages: alloc::vec![Vec::new(); ROWS.len()],
            left_branch: false,
        })
    }

    /// q̈ at a state.
    pub(super) fn accelerations(&mut self, state: &M::State) -> Result<M::Vector, SolveError> {
        Ok(accelerate(self.model, &self.constants, state, &mut self.workspace)?.accelerations)
    }

    /// Projects a state onto the constraints.
    pub(super) fn project(&mut self, state: &mut M::State) -> Result<(), SolveError> {
        project_positions(self.model, &self.constants, state, &mut self.workspace)?;
        project_velocities(self.model, &self.constants, state, &mut self.workspace)?;
        Ok(())
    }

    /// Integrates a motion, with tangent vectors if there are any, up to a time. `visit` is called with every
    /// accepted state, without the start.
    pub(super) fn integrate(
        &mut self,
        start: &M::State,
        tangents: &DMatrix<f64>,
        until: f64,
        visit: &mut dyn FnMut(&M::State),
    ) -> Result<FlowEnd<M::State>, PeriodicError> {
        let (n, k) = (2 * M::Vector::LEN, tangents.ncols());
        let most = |x: &[f64]| x.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
        let reach = most(start.q().as_slice());
        let fast = most(start.u().as_slice()).max(FAST_PARTS * reach / (until - start.t()));
        let half = n / 2;
        let mut current = self.begin(start, tangents, until)?;
        let (mut steps, mut tried) = (0, 0);
        while current.state.t() < until {
            tried += 1;
            if tried > self.most_steps {
                return Err(PeriodicError::Steps { time: current.state.t(), steps });
            }
            if !self.step(&mut current, until)? {
                continue;
            }
            steps += 1;
            let (of_q, of_u) = (largest(&current.y[..half]), largest(&current.y[half..n]));
            let ((i, worst), far) =
                if of_q.1 > DIVERGED * reach { (of_q, DIVERGED * reach) } else { (of_u, DIVERGED * fast) };
            if worst > far {
                let coordinate = M::COORDINATES[i].name;
                return Err(PeriodicError::RunsAway { time: current.state.t(), coordinate, value: worst });
            }
            let held = current.corners.hold(&current.state);
            current.slope = self.rate(&held, &current.y).map_err(|error| ends(held.t(), error))?;
            visit(&current.state);
        }
        let tangents = DMatrix::from_column_slice(n, k, &current.y[n..n + n * k]);
        Ok(FlowEnd { state: current.state, tangents, divergence: current.y[n + n * k], steps })
    }

    /// The state before the first step.
    fn begin(
        &mut self,
        start: &M::State,
        tangents: &DMatrix<f64>,
        until: f64,
    ) -> Result<FlowState<M::State>, PeriodicError> {
        let y = pack(start, tangents);
        let corners = HeldBranches::at(self.model, start);
        let slope = self.rate(&corners.hold(start), &y)?;
        if !slope.iter().all(|x| x.is_finite()) {
            return Err(not_finite::<M>(start, &slope));
        }
        let span = until - start.t();
        Ok(FlowState {
            state: *start,
            y,
            slope,
            corners,
            control: Controller::new(CONTROLLER_SETTINGS, 8),
            h: FIRST_STEP * span,
            span,
        })
    }

    /// Tries a step, and returns whether it was accepted.
    fn step(&mut self, current: &mut FlowState<M::State>, until: f64) -> Result<bool, PeriodicError> {
        let time = current.state.t();
        let left = until - time;
        // The last two steps share the time that is left.
        let (step, last) = if current.h >= LAST_STEP_SHARE * left {
            (left, true)
        } else {
            (current.h.min(LARGEST_STEP_SHARE * left), false)
        };
        if step <= MIN_STEP_ROUNDINGS * f64::EPSILON * time.abs().max(until.abs()) && !last {
            return Err(PeriodicError::Stalls { time });
        }
        let (end, factor) =
            match self.attempt(&current.state, &current.corners, &current.y, &current.slope, step) {
                Ok((end, error)) if error.is_finite() => match current.control.judge(error) {
                    (true, factor) => (end, factor),
                    (false, factor) => {
                        current.h = step * factor;
                        return Ok(false);
                    }
                },
                // A stage may lie beyond the end of the model; a shorter step may succeed.
                Ok(_) | Err(_) if step > MIN_REPEATED_STEP * current.span => {
                    current.control.failed();
                    current.h = FACTOR_AFTER_FAILURE * step;
                    return Ok(false);
                }
                Ok(_) => return Err(not_finite::<M>(&current.state, &current.slope)),
                Err(error) => return Err(ends(time, error)),
            };
        let mut there = unpack(&current.state, if last { until } else { time + step }, &end);
        match current.corners.crossed(self.model, &there) {
            Some(crossed) => {
                let passed = self.pass_corner(
                    &mut current.corners,
                    &current.state,
                    (&current.y, &current.slope),
                    crossed,
                    step,
                )?;
                (there, current.y) = (passed.state, passed.y);
                current.control.restart();
                current.h = step;
            }
            // Only stages are on another branch: the motion leaves the branch and comes back within the step.
            None if self.left_branch => {
                if step < MIN_STEP_AT_CORNER * current.span {
                    return Err(PeriodicError::Grazes { time });
                }
                current.h = 0.5 * step;
                return Ok(false);
            }
            None => {
                current.y = end;
                current.h = if last { current.h } else { step * factor };
            }
        }
        // Project back onto the constraints.
        if !M::ROWS.is_empty() {
            self.project(&mut there).map_err(|error| ends(there.t(), error.into()))?;
            let n = M::Vector::LEN;
            current.y[..n].copy_from_slice(there.q().as_slice());
            current.y[n..2 * n].copy_from_slice(there.u().as_slice());
        }
        current.state = there;
        Ok(true)
    }

    /// The end of a step, and its error norm; 1 is the permitted error.
    pub(super) fn attempt(
        &mut self,
        from: &M::State,
        corners: &HeldBranches,
        y: &[f64],
        slope: &[f64],
        h: f64,
    ) -> Result<(Vec<f64>, f64), PeriodicError> {
        let mut stages = core::mem::take(&mut self.stages);
        self.left_branch = false;
        stages[0].clear();
        stages[0].extend_from_slice(slope);
        for s in 1..ROWS.len() {
            let at = advance(y, h, ROWS[s], &stages);
            let state = corners.hold(&unpack(from, from.t() + table::C[s] * h, &at));
            self.left_branch |= table::C[s] < 1.0 && corners.crossed(self.model, &state).is_some();
            match self.rate(&state, &at) {
                Ok(rate) => stages[s] = rate,
                Err(error) => {
                    self.stages = stages;
                    return Err(error);
                }
            }
        }
        let end = advance(y, h, &table::B, &stages);
        let error = advance(&alloc::vec![0.0; y.len()], h, &table::E, &stages);
        self.stages = stages;
        let norm = self.norm(&error, y, &end, h);
        Ok((end, norm))
    }

    /// ẏ at a state, with the tangent vectors and the divergence in `y`.
    pub(super) fn rate(&mut self, state: &M::State, y: &[f64]) -> Result<Vec<f64>, PeriodicError> {
        let n = M::Vector::LEN;
        let k = (y.len() - 1) / (2 * n) - 1;
        let accelerations = self.accelerations(state)?;
        let mut rate = alloc::vec![0.0; y.len()];
        rate[..n].copy_from_slice(state.u().as_slice());
        rate[n..2 * n].copy_from_slice(accelerations.as_slice());
        if k == 0 {
            return Ok(rate);
        }
        derivatives(self.model, state, &mut self.by).map_err(PeriodicError::Derivatives)?;
        let [by_q, by_u] = &self.by;
        for column in 1..=k {
            let first = 2 * n * column;
            let tangent = &y[first..first + 2 * n];
            let out = &mut rate[first..first + 2 * n];
            out[..n].copy_from_slice(&tangent[n..]);
            for i in 0..n {
                let row = |m: &[f64], x: &[f64]| -> f64 {
                    m[n * i..n * (i + 1)].iter().zip(x).map(|(a, b)| a * b).sum()
                };
                out[n + i] = row(by_q, &tangent[..n]) + row(by_u, &tangent[n..]);
            }
        }
        rate[y.len() - 1] = (0..n).map(|i| by_u[i * n + i]).sum();
        Ok(rate)
    }

    /// The error norm: the larger of the root mean square of the state and the largest element of every
    /// tangent vector, each relative to the permitted error.
    fn norm(&self, error: &[f64], from: &[f64], to: &[f64], h: f64) -> f64 {
        let n = M::Vector::LEN;
        let of_state = (0..2 * n).map(|i| {
            let scale = self.tolerance * (1.0 + from[i].abs().max(to[i].abs()));
            (error[i] / scale).powi(2)
        });
        let mut worst = (of_state.sum::<f64>() / (2 * n) as f64).sqrt();
        let most = |values: &[f64]| largest(values).1;
        for first in (2 * n..from.len() - 1).step_by(2 * n) {
            let blocks = [first..first + n, first + n..first + 2 * n];
            let [q, u] = blocks.clone().map(|block| most(&from[block.clone()]).max(most(&to[block])));
            // The scale of displacements, and of velocities, is their largest element, or the change that the
            // other block causes within the step.
            let scales = [q.max(MIN_TANGENT_SHARE * h * u), u.max(MIN_TANGENT_SHARE * q / h)];
            for (block, size) in blocks.into_iter().zip(scales) {
                let off = most(&error[block]);
                if size > 0.0 || off.is_nan() {
                    worst = dynamics_runtime::math::max(
                        worst,
                        off / (self.tolerance * size.max(MIN_TANGENT_SCALE)),
                    );
                }
            }
        }
        worst
    }
}

/// Index and absolute value of the largest element; NaN if one is NaN.
fn largest(values: &[f64]) -> (usize, f64) {
    let larger = |most: (usize, f64), (i, x): (usize, &f64)| {
        if x.abs() > most.1 || x.is_nan() { (i, x.abs()) } else { most }
    };
    values.iter().enumerate().fold((0, 0.0), larger)
}

/// The error of a motion that ends at a time.
fn ends(time: f64, error: PeriodicError) -> PeriodicError {
    match error {
        PeriodicError::NotFinite { .. } => error,
        reason => PeriodicError::Ends { time, reason: Box::new(reason) },
    }
}

/// The error of a state with rates that are not finite: an input without a value, or the acceleration.
fn not_finite<M: Constraints>(at: &M::State, slope: &[f64]) -> PeriodicError {
    if let Some(unset) = at.inputs().as_slice().iter().position(|input| input.is_nan()) {
        return PeriodicError::Derivatives(LinearizeError::InputNotSet { input: M::INPUTS[unset].name });
    }
    let n = M::Vector::LEN;
    let i = slope[n..2 * n].iter().position(|x| !x.is_finite()).unwrap_or(0);
    PeriodicError::NotFinite { time: at.t(), coordinate: M::COORDINATES[i].name }
}

/// y: q, q̇, the tangent vectors one after the other, and the divergence.
fn pack<S: ModelState>(state: &S, tangents: &DMatrix<f64>) -> Vec<f64> {
    [state.q().as_slice(), state.u().as_slice(), tangents.as_slice(), &[0.0]].concat()
}

/// The state in `y` at a time; inputs and modes are those of `like`.
fn unpack<S: ModelState>(like: &S, t: f64, y: &[f64]) -> S {
    let n = <S::Vector as Vector>::LEN;
    let mut state = dynamics_runtime::constrain::at_time(like, t);
    state.q_mut().as_mut_slice().copy_from_slice(&y[..n]);
    state.u_mut().as_mut_slice().copy_from_slice(&y[n..2 * n]);
    state
}

/// y + h Σⱼ aⱼ kⱼ.
fn advance(y: &[f64], h: f64, row: &[(usize, f64)], stages: &[Vec<f64>]) -> Vec<f64> {
    let mut out = alloc::vec![0.0; y.len()];
    for (j, a) in row {
        out.iter_mut().zip(&stages[*j]).for_each(|(out, k)| *out += a * k);
    }
    out.iter_mut().zip(y).for_each(|(out, y)| *out = y + h * *out);
    out
}

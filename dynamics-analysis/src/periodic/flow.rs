//! A motion with its variations: state and tangent vectors, integrated together.
//!
//! ```text
//! q̈ = a(q, q̇, t)        δq̈ = a_q δq + a_u δq̇ for every tangent vector
//! ∫ tr a_u dt, the logarithm of the factor of volumes
//! ```
//!
//! With constraints, a is the constrained acceleration. Tangent vectors start in the tangent space and stay
//! there to the tolerance. After every step the motion is projected back. Volumes: q̈ = a(q, q̇, t) has the
//! divergence tr a_u (Liouville); the constrained directions obey Φ̈ = 0, which has none. By Verner's pair of
//! order 9(8) (`integrate/verner9.rs`), with the tangent vectors under error control, so that they are as
//! accurate as the motion. If a branch of the model changes, the step ends, and a jump of the acceleration
//! transforms the tangent vectors (`corners.rs`, `flow/corner_passage.rs`).

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

/// As the method itself has them.
const CONTROL: ControllerSettings = ControllerSettings { safety: 0.9, beta: 0.0, shrink: 0.333, grow: 6.0 };
/// Beyond this multiple of where it started, and of 1, a motion counts as run away.
const RUN_AWAY: f64 = 1e8;

/// Tangent vectors that are shorter have died away: on the way to zero they leave the range of numbers, where
/// nothing is to be measured by them.
const GONE: f64 = 1e-200;

/// Integrates a model with its variations; modes, and inputs, are those of the start.
pub(super) struct Flow<'m, M: Constraints> {
    pub(super) model: &'m M,
    pub(super) constants: M::Constants,
    pub(super) tolerance: f64,
    pub(super) most_steps: usize,
    workspace: Vec<f64>,
    by: [Vec<f64>; 2],
    stages: Vec<Vec<f64>>,
    /// Whether a stage of the last attempt lay where another branch holds.
    dips: bool,
}

/// What became of a state and its tangent vectors.
pub(super) struct Flown<S> {
    pub(super) state: S,
    /// 2N×K: δq above δq̇.
    pub(super) tangents: DMatrix<f64>,
    /// ∫ tr a_u dt; 0 where there are no tangent vectors.
    pub(super) divergence: f64,
    pub(super) steps: usize,
}

/// Where a motion is.
struct Ride<S> {
    state: S,
    /// State, tangent vectors and divergence, one after the other.
    y: Vec<f64>,
    slope: Vec<f64>,
    corners: HeldBranches,
    control: Controller,
    /// The next step.
    h: f64,
    /// Of the whole way.
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
            dips: false,
        })
    }

    /// q̈ at a state.
    pub(super) fn accelerations(&mut self, state: &M::State) -> Result<M::Vector, SolveError> {
        Ok(accelerate(self.model, &self.constants, state, &mut self.workspace)?.accelerations)
    }

    /// Puts a state onto the constraints.
    pub(super) fn place(&mut self, state: &mut M::State) -> Result<(), SolveError> {
        project_positions(self.model, &self.constants, state, &mut self.workspace)?;
        project_velocities(self.model, &self.constants, state, &mut self.workspace)?;
        Ok(())
    }

    /// Follows a motion, with tangent vectors if there are any, up to a time; every accepted state is shown,
    /// the start not.
    pub(super) fn fly(
        &mut self,
        start: &M::State,
        tangents: &DMatrix<f64>,
        until: f64,
        visit: &mut dyn FnMut(&M::State),
    ) -> Result<Flown<M::State>, PeriodicError> {
        let (n, k) = (2 * M::Vector::LEN, tangents.ncols());
        let most = |x: &[f64]| x.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
        let reach = most(start.q().as_slice());
        // What goes so far within a thousandth of the way is fast, but need not be far.
        let fast = most(start.u().as_slice()).max(1e3 * reach / (until - start.t()));
        let half = n / 2;
        let mut ride = self.depart(start, tangents, until)?;
        let (mut steps, mut tried) = (0, 0);
        while ride.state.t() < until {
            tried += 1;
            if tried > self.most_steps {
                return Err(PeriodicError::Steps { time: ride.state.t(), steps });
            }
            if !self.step(&mut ride, until)? {
                continue;
            }
            steps += 1;
            let (of_q, of_u) = (largest(&ride.y[..half]), largest(&ride.y[half..n]));
            let ((i, worst), far) =
                if of_q.1 > RUN_AWAY * reach { (of_q, RUN_AWAY * reach) } else { (of_u, RUN_AWAY * fast) };
            if worst > far {
                let coordinate = M::COORDINATES[i].name;
                return Err(PeriodicError::RunsAway { time: ride.state.t(), coordinate, value: worst });
            }
            let held = ride.corners.hold(&ride.state);
            ride.slope = self.rate(&held, &ride.y).map_err(|error| ends(held.t(), error))?;
            visit(&ride.state);
        }
        let tangents = DMatrix::from_column_slice(n, k, &ride.y[n..n + n * k]);
        Ok(Flown { state: ride.state, tangents, divergence: ride.y[n + n * k], steps })
    }

    /// Before the first step.
    fn depart(
        &mut self,
        start: &M::State,
        tangents: &DMatrix<f64>,
        until: f64,
    ) -> Result<Ride<M::State>, PeriodicError> {
        let y = pack(start, tangents);
        let corners = HeldBranches::at(self.model, start);
        let slope = self.rate(&corners.hold(start), &y)?;
        if !slope.iter().all(|x| x.is_finite()) {
            return Err(not_finite::<M>(start, &slope));
        }
        let span = until - start.t();
        Ok(Ride {
            state: *start,
            y,
            slope,
            corners,
            control: Controller::new(CONTROL, 8),
            h: 1e-3 * span,
            span,
        })
    }

    /// Tries a step; whether it was made.
    fn step(&mut self, ride: &mut Ride<M::State>, until: f64) -> Result<bool, PeriodicError> {
        let time = ride.state.t();
        let left = until - time;
        // The last two steps share what is left.
        let (step, last) =
            if ride.h >= 0.9999 * left { (left, true) } else { (ride.h.min(0.5001 * left), false) };
        if step <= 16.0 * f64::EPSILON * time.abs().max(until.abs()) && !last {
            return Err(PeriodicError::Stalls { time });
        }
        let (end, factor) = match self.attempt(&ride.state, &ride.corners, &ride.y, &ride.slope, step) {
            Ok((end, error)) if error.is_finite() => match ride.control.judge(error) {
                (true, factor) => (end, factor),
                (false, factor) => {
                    ride.h = step * factor;
                    return Ok(false);
                }
            },
            // Beyond the place where the model ends shorter steps may still do.
            Ok(_) | Err(_) if step > 1e-10 * ride.span => {
                ride.control.failed();
                ride.h = 0.25 * step;
                return Ok(false);
            }
            Ok(_) => return Err(not_finite::<M>(&ride.state, &ride.slope)),
            Err(error) => return Err(ends(time, error)),
        };
        let mut there = unpack(&ride.state, if last { until } else { time + step }, &end);
        match ride.corners.crossed(self.model, &there) {
            Some(crossed) => {
                let passed =
                    self.pass_corner(&mut ride.corners, &ride.state, (&ride.y, &ride.slope), crossed, step)?;
                (there, ride.y) = (passed.state, passed.y);
                ride.control.restart();
                ride.h = step;
            }
            // In and out again within the step: seen by its stages alone.
            None if self.dips => {
                if step < 1e-9 * ride.span {
                    return Err(PeriodicError::Grazes { time });
                }
                ride.h = 0.5 * step;
                return Ok(false);
            }
            None => {
                ride.y = end;
                ride.h = if last { ride.h } else { step * factor };
            }
        }
        if !M::ROWS.is_empty() {
            self.place(&mut there).map_err(|error| ends(there.t(), error.into()))?;
            let n = M::Vector::LEN;
            ride.y[..n].copy_from_slice(there.q().as_slice());
            ride.y[n..2 * n].copy_from_slice(there.u().as_slice());
        }
        ride.state = there;
        Ok(true)
    }

    /// The end of a step, and its error against what is permitted.
    pub(super) fn attempt(
        &mut self,
        from: &M::State,
        corners: &HeldBranches,
        y: &[f64],
        slope: &[f64],
        h: f64,
    ) -> Result<(Vec<f64>, f64), PeriodicError> {
        let mut stages = core::mem::take(&mut self.stages);
        self.dips = false;
        stages[0].clear();
        stages[0].extend_from_slice(slope);
        for s in 1..ROWS.len() {
            let at = advance(y, h, ROWS[s], &stages);
            let state = corners.hold(&unpack(from, from.t() + table::C[s] * h, &at));
            self.dips |= table::C[s] < 1.0 && corners.crossed(self.model, &state).is_some();
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

    /// The rates of everything at a state, whose tangent vectors and divergence stand in `y`.
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

    /// The largest of errors over what is permitted, of the state, as root mean square, and of every tangent
    /// vector.
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
            // Displacements and velocities are measured by their largest, and by what the other makes of them
            // within the step.
            for (block, size) in blocks.into_iter().zip([q.max(0.01 * h * u), u.max(0.01 * q / h)]) {
                let off = most(&error[block]);
                if size > 0.0 || off.is_nan() {
                    worst = dynamics_runtime::math::max(worst, off / (self.tolerance * size.max(GONE)));
                }
            }
        }
        worst
    }
}

/// Index and size of the largest element; NaN where one is.
fn largest(values: &[f64]) -> (usize, f64) {
    let larger = |most: (usize, f64), (i, x): (usize, &f64)| {
        if x.abs() > most.1 || x.is_nan() { (i, x.abs()) } else { most }
    };
    values.iter().enumerate().fold((0, 0.0), larger)
}

fn ends(time: f64, error: PeriodicError) -> PeriodicError {
    match error {
        PeriodicError::NotFinite { .. } => error,
        reason => PeriodicError::Ends { time, reason: Box::new(reason) },
    }
}

fn not_finite<M: Constraints>(at: &M::State, slope: &[f64]) -> PeriodicError {
    if let Some(unset) = at.inputs().as_slice().iter().position(|input| input.is_nan()) {
        return PeriodicError::Derivatives(LinearizeError::InputNotSet { input: M::INPUTS[unset].name });
    }
    let n = M::Vector::LEN;
    let i = slope[n..2 * n].iter().position(|x| !x.is_finite()).unwrap_or(0);
    PeriodicError::NotFinite { time: at.t(), coordinate: M::COORDINATES[i].name }
}

/// q, q̇, the tangent vectors one after the other, and a place for the divergence.
fn pack<S: ModelState>(state: &S, tangents: &DMatrix<f64>) -> Vec<f64> {
    [state.q().as_slice(), state.u().as_slice(), tangents.as_slice(), &[0.0]].concat()
}

/// The state in `y`, otherwise as another.
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

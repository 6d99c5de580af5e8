//! Instability that long steps pass over.
//!
//! Beside a rest that is unstable, e^(λt), the motion hardly changes for a while, so steps grow, and then no
//! method follows: z = h λ beyond 5 or so a Runge–Kutta method has differences grow by R(z), a polynomial or
//! less than 1 where it is L-stable, and not by e^z (Hairer & Wanner, Solving ODE II, IV.3: what damps for z
//! → −∞ damps for z → +∞, too). The motion then stays where the true one leaves, in half steps as in whole
//! ones, and its error estimates see nothing. So a neighbour is followed through the longest steps twice, by
//! the method, and by the linearised equations of the step's start and of its end in many small steps of the
//! implicit Euler method, v' = w, w' = K v + B w:
//!
//! (I − τB − τ²K) w₁ = w + τ K v,  v₁ = v + τ w₁
//!
//! which has what grows grow and what is stiff die. What grows at both ends, and far less by the method, is
//! told. Coefficients that stay as they are through a step of some radians are wrong by a factor, so growth
//! by a hundred in a step is the least that counts.

use alloc::vec;
use alloc::vec::Vec;
use core::fmt;

use crate::integrate::{Accelerations as _, Phase, Stabilized as _, Step, StepNode, Tolerances, zip};
use crate::linalg::elimination::{factor, solve};
use crate::math;
use crate::model::{SimulationModel, Vector};
use crate::simulate::right_hand_side::RightHandSide;
use crate::simulate::trajectory::motion::Motion;
use crate::wording::Rounded;

/// So many steps are looked at, the longest ones.
const STEPS_EXAMINED: usize = 12;
/// Larger models would pay more for it than for the run.
const MOST_COORDINATES: usize = 100;
/// Small steps within one: growth is seen up to z of their number. More of them are tried while n² times
/// their number stays below the last.
const SUBSTEPS: [usize; 3] = [64, 1024, 16_384];
const MAX_OPERATIONS: usize = 10_000_000;
/// Growth in a step, in all of these, and what the method may lose of it.
const MIN_STEP_GROWTH: f64 = 100.0;
const MIN_TOTAL_GROWTH: f64 = 1e3;
const MIN_LOST_GROWTH: f64 = 10.0;
/// Nothing needs to be known of growth beyond this.
const MAX_GROWTH: f64 = 1e30;
/// How far the neighbour is, in parts of 1 + |value|.
const PERTURBATION: f64 = 1e-8;

/// What is so far apart, in the same parts, grows no more as the linearised equations have it.
const LINEAR_RANGE: f64 = 1e-2;

/// What a step and one beside it come to in small steps.
struct SubsteppedNeighbour<V: Vector> {
    /// The end of the one beside.
    end: Phase<V>,
    /// Its difference to that of the step.
    difference: Phase<V>,
    /// The two were so far apart in between that they went ways of their own.
    left_linear_range: bool,
}

/// Growth of differences that the steps of a motion have passed over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MissedInstability {
    /// The longest step in which: from here to there.
    pub during: (f64, f64),
    /// By how much differences grow in it.
    pub by: f64,
    /// By how much they grow in the step that was made.
    pub shown: f64,
}

impl MissedInstability {
    /// The warning.
    pub(crate) fn write(&self, f: &mut fmt::Formatter<'_>, fixed: bool) -> fmt::Result {
        let Self { during: (from, to), by, shown } = self;
        let (from, to) = (Rounded(*from), Rounded(*to));
        let by = if *by < MAX_GROWTH {
            alloc::format!("{by:.0e}")
        } else {
            alloc::format!("more than {MAX_GROWTH:.0e}")
        };
        let remedy = if fixed { "shorten the fixed step" } else { "limit steps with `.max_step(..)`" };
        write!(
            f,
            "an unstable motion is stepped over: from t = {from} to {to} differences grow by {by}, and by \
             {shown:.0e} in the step; {remedy}"
        )
    }
}

impl<M: SimulationModel> Motion<'_, M> {
    /// Whether growth is looked for: not of larger models.
    pub(crate) fn affords_instability_check(&self) -> bool {
        M::Vector::LEN <= MOST_COORDINATES
    }

    /// What grows in the longest steps more than they show.
    pub(crate) fn missed_instability(&self) -> Option<MissedInstability> {
        if M::Vector::LEN == 0 || !self.affords_instability_check() {
            return None;
        }
        let records = &self.trajectory.records;
        let mut longest: Vec<usize> = (0..records.len()).filter(|&i| records[i].h != 0.0).collect();
        longest.sort_by(|&i, &j| records[j].h.abs().total_cmp(&records[i].h.abs()).then(i.cmp(&j)));
        let (mut total_growth, mut lost, mut worst) = (1.0f64, 1.0f64, None::<MissedInstability>);
        for index in longest.into_iter().take(STEPS_EXAMINED) {
            let Some(found) = self.instability_in_step(index) else { continue };
            (total_growth, lost) = (total_growth * found.by, lost * (found.by / found.shown).max(1.0));
            if worst.is_none_or(|worst| found.by > worst.by) {
                worst = Some(found);
            }
        }
        worst.filter(|_| total_growth > MIN_TOTAL_GROWTH && lost > MIN_LOST_GROWTH)
    }

    /// By how much differences grow in the step that leaves a record; `None` where that is little.
    fn instability_in_step(&self, index: usize) -> Option<MissedInstability> {
        let step = self.step(index);
        let tolerances = &self.trajectory.tolerances;
        let mut rhs = self.rhs(index);
        let mut difference = perturbation::<M::Vector>(&step.start.y);
        if let Some(along) = rhs.lasting(step.start.t, &step.start.y, &difference).ok()? {
            difference = along;
        }
        let mut by = f64::INFINITY;
        for at in [&step.start, &step.end] {
            by = by.min(self.linear_growth(&mut rhs, at, (&difference, step.h))?);
            if by < MIN_STEP_GROWTH {
                return None;
            }
        }
        let y = zip(&step.start.y, &difference, |y, by| y + by);
        let a = rhs.accelerations(step.start.t, &y.q, &y.u).ok()?;
        let neighbour = Step { start: StepNode { t: step.start.t, y, a }, ..step };
        let mut step_replay = self.trajectory.erased_method_of(index)?.step_replay();
        let (end, _) = step_replay.end_of(&mut rhs, &neighbour, tolerances)?;
        let shown = permitted_errors(tolerances, &zip(&end, &step.end.y, |a, b| a - b), &step)
            / permitted_errors(tolerances, &difference, &step);
        if !shown.is_finite() || by / shown <= MIN_LOST_GROWTH {
            return Some(MissedInstability { during: (step.start.t, step.end.t), by, shown })
                .filter(|_| shown.is_finite());
        }
        // Coefficients that are as they are for a moment, as beside a singular position, grow nothing.
        let Some(parts) = self.substep_neighbour(index, &neighbour) else {
            return Some(MissedInstability { during: (step.start.t, step.end.t), by, shown });
        };
        let by = match parts.left_linear_range {
            false => by.min(
                permitted_errors(tolerances, &parts.difference, &step)
                    / permitted_errors(tolerances, &difference, &step),
            ),
            // How far apart two motions are that have both left says nothing: whether the step has the one
            // beside go where it goes.
            true => {
                let missed = permitted_errors(tolerances, &zip(&end, &parts.end, |a, b| a - b), &step);
                let spread = permitted_errors(tolerances, &zip(&end, &step.end.y, |a, b| a - b), &step);
                if missed < spread / MIN_LOST_GROWTH { shown } else { by }
            }
        };
        (by >= MIN_STEP_GROWTH).then_some(MissedInstability { during: (step.start.t, step.end.t), by, shown })
    }

    /// A step and one beside it by the method in small steps; `None` where these cannot be made.
    fn substep_neighbour(
        &self,
        index: usize,
        neighbour: &Step<M::Vector>,
    ) -> Option<SubsteppedNeighbour<M::Vector>> {
        let step = self.step(index);
        let (mut rhs, tolerances) = (self.rhs(index), &self.trajectory.tolerances);
        let mut replays = [
            self.trajectory.erased_method_of(index)?.step_replay(),
            self.trajectory.erased_method_of(index)?.step_replay(),
        ];
        let (mut ends, mut left_linear_range) = ([step.start, neighbour.start], false);
        let h = step.h / SUBSTEPS[0] as f64;
        for _ in 0..SUBSTEPS[0] {
            for (at, step_replay) in ends.iter_mut().zip(&mut replays) {
                let part = Step { start: *at, end: *at, h, kept: step.kept };
                let (y, _) = step_replay.end_of(&mut rhs, &part, tolerances)?;
                *at = StepNode { t: at.t + h, y, a: rhs.accelerations(at.t + h, &y.q, &y.u).ok()? };
            }
            let elements = |y: &Phase<M::Vector>, i| (y.q[i], y.u[i]);
            left_linear_range |= (0..M::Vector::LEN).any(|i| {
                let [(q, u), (q2, u2)] = [elements(&ends[0].y, i), elements(&ends[1].y, i)];
                (q2 - q).abs() > LINEAR_RANGE * (1.0 + q.abs())
                    || (u2 - u).abs() > LINEAR_RANGE * (1.0 + u.abs())
            });
        }
        let [end, neighbour] = ends.map(|at| at.y);
        let difference = zip(&neighbour, &end, |a, b| a - b);
        let finite = permitted_errors(tolerances, &difference, &step).is_finite();
        finite.then_some(SubsteppedNeighbour { end: neighbour, difference, left_linear_range })
    }

    /// The growth of a difference by the linearised equations of one place, in time h: from the second
    /// quarter of it to the last, squared, as a swing has its velocity larger than its place by whatever
    /// units.
    fn linear_growth(
        &self,
        rhs: &mut RightHandSide<'_, '_, M>,
        at: &StepNode<M::Vector>,
        (difference, h): (&Phase<M::Vector>, f64),
    ) -> Option<f64> {
        let n = M::Vector::LEN;
        let (mut by_q, mut by_u) = (vec![0.0; n * n], vec![0.0; n * n]);
        rhs.jacobian(at, &mut by_q, &mut by_u).ok()?;
        let tolerances = &self.trajectory.tolerances;
        let first = tolerances.norm(difference, &at.y, &at.y);
        // λ² v = K v + λ B v, so that |λ| ≤ ‖B‖ + √‖K‖ by sums of rows.
        let norm = |matrix: &[f64]| {
            matrix.chunks(n).map(|row| row.iter().map(|x| x.abs()).sum()).fold(0.0, f64::max)
        };
        let eigenvalue_bound = h.abs() * (norm(&by_u) + math::sqrt(norm(&by_q)));
        if eigenvalue_bound < math::ln(MIN_STEP_GROWTH) {
            return Some(1.0);
        }
        let mut by = 0.0f64;
        for parts in
            SUBSTEPS.into_iter().filter(|parts| *parts == SUBSTEPS[0] || parts * n * n <= MAX_OPERATIONS)
        {
            let tau = h / parts as f64;
            let mut matrix: Vec<f64> = (0..n * n)
                .map(|k| f64::from(u8::from(k % (n + 1) == 0)) - tau * (by_u[k] + tau * by_q[k]))
                .collect();
            let Some(exchanges) = factor::<M::Vector>(&mut matrix) else { continue };
            let (Phase { q: mut v, u: mut w }, mut growth_by_quarter) = (*difference, [0.0f64; 4]);
            for part in 0..parts {
                for i in 0..n {
                    w[i] += tau * (0..n).map(|j| by_q[i * n + j] * v[j]).sum::<f64>();
                }
                // The old w is on the right, and what is found is the new one.
                solve(&matrix, &exchanges, &mut w);
                (0..n).for_each(|i| v[i] += tau * w[i]);
                let grown = tolerances.norm(&Phase { q: v, u: w }, &at.y, &at.y) / first;
                if grown.is_nan() || grown >= MAX_GROWTH {
                    return Some(MAX_GROWTH);
                }
                let quarter = &mut growth_by_quarter[4 * part / parts];
                *quarter = quarter.max(grown);
            }
            by = by.max(math::powi(growth_by_quarter[3] / growth_by_quarter[1], 2));
            if by > MIN_STEP_GROWTH || eigenvalue_bound < parts as f64 {
                break;
            }
        }
        Some(by)
    }
}

/// A difference with a part along whatever grows.
fn perturbation<V: Vector>(y: &Phase<V>) -> Phase<V> {
    let mut difference = Phase::<V>::zeros();
    for (part, values) in [(&mut difference.q, &y.q), (&mut difference.u, &y.u)] {
        for (i, (x, value)) in part.as_mut_slice().iter_mut().zip(values.as_slice()).enumerate() {
            // No sum or difference of two elements vanishes.
            *x = PERTURBATION * (1.0 + value.abs()) * (1.0 + 0.1 * i as f64);
        }
    }
    difference
}

/// A difference in permitted errors, at the start of a step for both of its ends.
fn permitted_errors<V: Vector>(tolerances: &Tolerances, difference: &Phase<V>, step: &Step<V>) -> f64 {
    tolerances.norm(difference, &step.start.y, &step.start.y)
}

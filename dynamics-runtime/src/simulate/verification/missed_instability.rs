//! Instability that long steps pass over.
//!
//! Near an unstable rest, with solutions e^(λt), the motion hardly changes for a while, so that steps grow.
//! For z = h λ beyond about 5 a Runge–Kutta method then multiplies differences by R(z), a polynomial, or a
//! number below 1 where it is L-stable, and not by e^z (Hairer & Wanner, Solving ODE II, IV.3: what damps for
//! z → −∞ also damps for z → +∞). The computed motion stays where the true one leaves, in half
//! steps as in whole ones, and error estimates see nothing. So a neighbour is followed through the longest
//! steps twice: by the method, and by the linearised equations at the start and the end of the step, v' = w,
//! w' = K v + B w, in many small steps of the implicit Euler method:
//!
//! (I − τB − τ²K) w₁ = w + τ K v,  v₁ = v + τ w₁
//!
//! In it unstable modes grow and stiff modes decay. Growth at both ends that the method does not show is
//! reported. The linearised equations are frozen through a step of some radians, and so wrong by a factor.
//! Therefore growth by less than a hundred in a step is ignored.

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

/// The longest steps are examined, so many of them.
const STEPS_EXAMINED: usize = 12;
/// Largest model that is examined. In larger ones the check costs more than the run.
const MAX_COORDINATES: usize = 100;
/// Numbers of implicit substeps within a step: z up to their number is resolved. More are tried only while
/// n² times their number is at most [`MAX_OPERATIONS`].
const SUBSTEPS: [usize; 3] = [64, 1024, 16_384];
/// See [`SUBSTEPS`].
const MAX_OPERATIONS: usize = 10_000_000;
/// Least growth in a step. The frozen linearised equations are wrong by a factor, so that less growth is not
/// known.
const MIN_STEP_GROWTH: f64 = 100.0;
/// Least growth in all examined steps together. A smaller value reports growth that the errors of the frozen
/// equations may explain, a larger one misses motions that leave slowly.
const MIN_TOTAL_GROWTH: f64 = 1e3;
/// Factor by which the growth that the method shows may fall short of that of the equations.
const MIN_LOST_GROWTH: f64 = 10.0;
/// Growth is followed up to this factor.
const MAX_GROWTH: f64 = 1e30;
/// Distance of the neighbour, in parts of 1 + |value|.
const PERTURBATION: f64 = 1e-8;

/// Differences beyond this, in the same parts, no longer follow the linearised equations.
const LINEAR_RANGE: f64 = 1e-2;

/// A neighbour of a step, followed in small steps of the method.
struct SubsteppedNeighbour<V: Vector> {
    /// The end of the one beside.
    end: Phase<V>,
    /// Its difference to that of the step.
    difference: Phase<V>,
    /// Whether the difference left the range of the linearised equations.
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
    /// Whether instability is searched: not in large models.
    pub(crate) fn affords_instability_check(&self) -> bool {
        M::Vector::LEN <= MAX_COORDINATES
    }

    /// Instability that the longest steps pass over.
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

    /// Growth of differences in the step that leaves a record; `None` where it is small.
    fn instability_in_step(&self, index: usize) -> Option<MissedInstability> {
        let step = self.step(index);
        let tolerances = &self.trajectory.tolerances;
        let mut rhs = self.rhs(index);
        let mut difference = perturbation::<M::Vector>(&step.start.y);
        if let Some(along) = rhs.error_after_projection(step.start.t, &step.start.y, &difference).ok()? {
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
        // Confirm by small steps of the method: coefficients that last for a moment only, as near a singular
        // position, cause no growth.
        let Some(parts) = self.substep_neighbour(index, &neighbour) else {
            return Some(MissedInstability { during: (step.start.t, step.end.t), by, shown });
        };
        let by = match parts.left_linear_range {
            false => by.min(
                permitted_errors(tolerances, &parts.difference, &step)
                    / permitted_errors(tolerances, &difference, &step),
            ),
            // The distance of two motions that have both left is meaningless. What counts is whether the step
            // takes the neighbour to where the small steps do.
            true => {
                let missed = permitted_errors(tolerances, &zip(&end, &parts.end, |a, b| a - b), &step);
                let spread = permitted_errors(tolerances, &zip(&end, &step.end.y, |a, b| a - b), &step);
                if missed < spread / MIN_LOST_GROWTH { shown } else { by }
            }
        };
        (by >= MIN_STEP_GROWTH).then_some(MissedInstability { during: (step.start.t, step.end.t), by, shown })
    }

    /// Follows a step and its neighbour by the method in small steps; `None` where these fail.
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
                let part = Step { start: *at, end: *at, h, flags: step.flags };
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

    /// Growth of a difference by the linearised equations at one state, in time h. It is the growth from the
    /// second quarter to the last, squared: in the first quarter position and velocity exchange, whose units
    /// differ.
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
                // The old w is the right-hand side, the solution the new one.
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

/// A perturbation with a component along every mode.
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

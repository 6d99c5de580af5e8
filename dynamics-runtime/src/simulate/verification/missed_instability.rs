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
const STEPS: usize = 12;
/// Larger models would pay more for it than for the run.
const MOST_COORDINATES: usize = 100;
/// Small steps within one: growth is seen up to z of their number. More of them are tried while n² times
/// their number stays below the last.
const PARTS: [usize; 3] = [64, 1024, 16_384];
const EFFORT: usize = 10_000_000;
/// Growth in a step, in all of these, and what the method may lose of it.
const GROWS: f64 = 100.0;
const GROWS_IN_ALL: f64 = 1e3;
const LOST: f64 = 10.0;
/// Nothing needs to be known of growth beyond this.
const ENOUGH: f64 = 1e30;
/// How far the neighbour is, in parts of 1 + |value|.
const NEAR: f64 = 1e-8;

/// What is so far apart, in the same parts, grows no more as the linearised equations have it.
const FILLS: f64 = 1e-2;

/// What a step and one beside it come to in small steps.
struct InParts<V: Vector> {
    /// The end of the one beside.
    end: Phase<V>,
    /// Its difference to that of the step.
    apart: Phase<V>,
    /// The two were so far apart in between that they went ways of their own.
    fills: bool,
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
        let by =
            if *by < ENOUGH { alloc::format!("{by:.0e}") } else { alloc::format!("more than {ENOUGH:.0e}") };
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
    pub(crate) fn affords_growth(&self) -> bool {
        M::Vector::LEN <= MOST_COORDINATES
    }

    /// What grows in the longest steps more than they show.
    pub(crate) fn missed_instability(&self) -> Option<MissedInstability> {
        if M::Vector::LEN == 0 || !self.affords_growth() {
            return None;
        }
        let records = &self.trajectory.records;
        let mut longest: Vec<usize> = (0..records.len()).filter(|&i| records[i].h != 0.0).collect();
        longest.sort_by(|&i, &j| records[j].h.abs().total_cmp(&records[i].h.abs()).then(i.cmp(&j)));
        let (mut all, mut lost, mut worst) = (1.0f64, 1.0f64, None::<MissedInstability>);
        for index in longest.into_iter().take(STEPS) {
            let Some(found) = self.outgrown_in(index) else { continue };
            (all, lost) = (all * found.by, lost * (found.by / found.shown).max(1.0));
            if worst.is_none_or(|worst| found.by > worst.by) {
                worst = Some(found);
            }
        }
        worst.filter(|_| all > GROWS_IN_ALL && lost > LOST)
    }

    /// By how much differences grow in the step that leaves a record; `None` where that is little.
    fn outgrown_in(&self, index: usize) -> Option<MissedInstability> {
        let step = self.step(index);
        let tolerances = &self.trajectory.tolerances;
        let mut rhs = self.rhs(index);
        let mut apart = nearby::<M::Vector>(&step.start.y);
        if let Some(along) = rhs.error_after_projection(step.start.t, &step.start.y, &apart).ok()? {
            apart = along;
        }
        let mut by = f64::INFINITY;
        for at in [&step.start, &step.end] {
            by = by.min(self.growth(&mut rhs, at, (&apart, step.h))?);
            if by < GROWS {
                return None;
            }
        }
        let y = zip(&step.start.y, &apart, |y, by| y + by);
        let a = rhs.accelerations(step.start.t, &y.q, &y.u).ok()?;
        let beside = Step { start: StepNode { t: step.start.t, y, a }, ..step };
        let mut step_replay = self.trajectory.erased_method_of(index)?.step_replay();
        let (end, _) = step_replay.end_of(&mut rhs, &beside, tolerances)?;
        let shown =
            size(tolerances, &zip(&end, &step.end.y, |a, b| a - b), &step) / size(tolerances, &apart, &step);
        if !shown.is_finite() || by / shown <= LOST {
            return Some(MissedInstability { during: (step.start.t, step.end.t), by, shown })
                .filter(|_| shown.is_finite());
        }
        // Coefficients that are as they are for a moment, as beside a singular position, grow nothing.
        let Some(parts) = self.in_parts(index, &beside) else {
            return Some(MissedInstability { during: (step.start.t, step.end.t), by, shown });
        };
        let by = match parts.fills {
            false => by.min(size(tolerances, &parts.apart, &step) / size(tolerances, &apart, &step)),
            // How far apart two motions are that have both left says nothing: whether the step has the one
            // beside go where it goes.
            true => {
                let missed = size(tolerances, &zip(&end, &parts.end, |a, b| a - b), &step);
                let spread = size(tolerances, &zip(&end, &step.end.y, |a, b| a - b), &step);
                if missed < spread / LOST { shown } else { by }
            }
        };
        (by >= GROWS).then_some(MissedInstability { during: (step.start.t, step.end.t), by, shown })
    }

    /// A step and one beside it by the method in small steps; `None` where these cannot be made.
    fn in_parts(&self, index: usize, beside: &Step<M::Vector>) -> Option<InParts<M::Vector>> {
        let step = self.step(index);
        let (mut rhs, tolerances) = (self.rhs(index), &self.trajectory.tolerances);
        let mut makers = [
            self.trajectory.erased_method_of(index)?.step_replay(),
            self.trajectory.erased_method_of(index)?.step_replay(),
        ];
        let (mut ends, mut fills) = ([step.start, beside.start], false);
        let h = step.h / PARTS[0] as f64;
        for _ in 0..PARTS[0] {
            for (at, step_replay) in ends.iter_mut().zip(&mut makers) {
                let part = Step { start: *at, end: *at, h, kept: step.kept };
                let (y, _) = step_replay.end_of(&mut rhs, &part, tolerances)?;
                *at = StepNode { t: at.t + h, y, a: rhs.accelerations(at.t + h, &y.q, &y.u).ok()? };
            }
            let elements = |y: &Phase<M::Vector>, i| (y.q[i], y.u[i]);
            fills |= (0..M::Vector::LEN).any(|i| {
                let [(q, u), (q2, u2)] = [elements(&ends[0].y, i), elements(&ends[1].y, i)];
                (q2 - q).abs() > FILLS * (1.0 + q.abs()) || (u2 - u).abs() > FILLS * (1.0 + u.abs())
            });
        }
        let [end, beside] = ends.map(|at| at.y);
        let apart = zip(&beside, &end, |a, b| a - b);
        let finite = size(tolerances, &apart, &step).is_finite();
        finite.then_some(InParts { end: beside, apart, fills })
    }

    /// The growth of a difference by the linearised equations of one place, in time h: from the second
    /// quarter of it to the last, squared, as a swing has its velocity larger than its place by whatever
    /// units.
    fn growth(
        &self,
        rhs: &mut RightHandSide<'_, '_, M>,
        at: &StepNode<M::Vector>,
        (apart, h): (&Phase<M::Vector>, f64),
    ) -> Option<f64> {
        let n = M::Vector::LEN;
        let (mut by_q, mut by_u) = (vec![0.0; n * n], vec![0.0; n * n]);
        rhs.jacobian(at, &mut by_q, &mut by_u).ok()?;
        let tolerances = &self.trajectory.tolerances;
        let first = tolerances.norm(apart, &at.y, &at.y);
        // λ² v = K v + λ B v, so that |λ| ≤ ‖B‖ + √‖K‖ by sums of rows.
        let norm = |matrix: &[f64]| {
            matrix.chunks(n).map(|row| row.iter().map(|x| x.abs()).sum()).fold(0.0, f64::max)
        };
        let most = h.abs() * (norm(&by_u) + math::sqrt(norm(&by_q)));
        if most < math::ln(GROWS) {
            return Some(1.0);
        }
        let mut by = 0.0f64;
        for parts in PARTS.into_iter().filter(|parts| *parts == PARTS[0] || parts * n * n <= EFFORT) {
            let tau = h / parts as f64;
            let mut matrix: Vec<f64> = (0..n * n)
                .map(|k| f64::from(u8::from(k % (n + 1) == 0)) - tau * (by_u[k] + tau * by_q[k]))
                .collect();
            let Some(exchanges) = factor::<M::Vector>(&mut matrix) else { continue };
            let (Phase { q: mut v, u: mut w }, mut quarters) = (*apart, [0.0f64; 4]);
            for part in 0..parts {
                for i in 0..n {
                    w[i] += tau * (0..n).map(|j| by_q[i * n + j] * v[j]).sum::<f64>();
                }
                // The old w is on the right, and what is found is the new one.
                solve(&matrix, &exchanges, &mut w);
                (0..n).for_each(|i| v[i] += tau * w[i]);
                let grown = tolerances.norm(&Phase { q: v, u: w }, &at.y, &at.y) / first;
                if grown.is_nan() || grown >= ENOUGH {
                    return Some(ENOUGH);
                }
                let quarter = &mut quarters[4 * part / parts];
                *quarter = quarter.max(grown);
            }
            by = by.max(math::powi(quarters[3] / quarters[1], 2));
            if by > GROWS || most < parts as f64 {
                break;
            }
        }
        Some(by)
    }
}

/// A difference with a part along whatever grows.
fn nearby<V: Vector>(y: &Phase<V>) -> Phase<V> {
    let mut apart = Phase::<V>::zeros();
    for (part, values) in [(&mut apart.q, &y.q), (&mut apart.u, &y.u)] {
        for (i, (x, value)) in part.as_mut_slice().iter_mut().zip(values.as_slice()).enumerate() {
            // No sum or difference of two elements vanishes.
            *x = NEAR * (1.0 + value.abs()) * (1.0 + 0.1 * i as f64);
        }
    }
    apart
}

/// A difference in permitted errors, at the start of a step for both of its ends.
fn size<V: Vector>(tolerances: &Tolerances, apart: &Phase<V>, step: &Step<V>) -> f64 {
    tolerances.norm(apart, &step.start.y, &step.start.y)
}

//! Undersampled forces: forces that act only between the stages of a step.
//!
//! A step control sees only its own evaluations. A push that ends before a stage falls into it, or a narrow
//! well that the motion flies through, is invisible to them, and to a second run at a smaller tolerance. Here
//! the impulse ∫ q̈ dt of each long step, and its displacement ∫ (t₁ − t) q̈ dt, which alone
//! remains behind a well, are integrated twice by Gauss's rule along one path, the quintic through the step's
//! ends: with four nodes, as a method of order 8 samples it (twelve where orders are higher), and in parts.
//! Where the force is smooth within the step both agree to far below the tolerance.
//!
//! Forces of stiff motions also respond to the deviation of the path from the motion. There the impulse is
//! reduced to what damping and stiffness leave of it within the step, (1 − h ∂q̈/∂q̇ − h²
//! ∂q̈/∂q)⁻¹ Δu, an implicit step. Forces shorter than about a thousandth of the motion may be
//! missed here, too; only `.max_step(..)` excludes them. The check costs some thousand evaluations.

use alloc::vec;
use core::fmt;

use crate::integrate::{Accelerations as _, Dense as _, Hermite, Method, Step, StepNode, Switching as _};
use crate::linalg::elimination::{factor, solve};
use crate::model::{SimulationModel, Vector};
use crate::simulate::right_hand_side::RightHandSide;
use crate::simulate::trajectory::motion::Motion;
use crate::wording::Rounded;

/// Nodes and weights of Gauss's rule of order 8 on (0, 1): Hairer, Nørsett & Wanner, Solving ODE I, §II.1.
const NODES: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];
/// Steps below this part of the motion are not examined: what they hide is too short to be found here.
const LONG_STEP_SHARE: f64 = 2e-3;
/// Missed impulses above this many permitted errors are reported. It is a tenth of the bound of other
/// warnings, because a missed impulse acts until the end.
const MISSED_ERRORS: f64 = 100.0;
/// The same for the part of an impulse that damping and stiffness leave in a step.
const MISSED_ERRORS_STIFF: f64 = 3.0;
/// The step made in parts must differ by this part of that bound, to confirm the finding.
const CONFIRMED_SHARE: f64 = 0.1;
/// Evaluations of the check: per evaluation of the run, at least (for small models), and at most.
const EVALUATIONS: (u64, u64, u64) = (2, 4000, 8000);

/// A force that the steps of a motion have not sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UndersampledForce {
    /// The coordinate that it should have changed.
    pub name: &'static str,
    /// Whether it is missed most in the velocity, as an impulse is, or in the place, as what pushes and pulls
    /// back.
    pub of_velocity: bool,
    /// When: the step from here to there.
    pub during: (f64, f64),
    /// By how much, in permitted errors.
    pub times: f64,
}

impl UndersampledForce {
    /// The warning.
    pub(crate) fn write(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, of_velocity, during: (from, to), times } = self;
        let of = if *of_velocity { "the velocity of " } else { "" };
        let (from, to) = (Rounded(*from), Rounded(*to));
        write!(
            f,
            "a force is over between the stages of a step, from t = {from} to {to}, and is missed: by \
             {times:.0e} times the tolerance of {of}{name}; limit steps with `.max_step(..)`"
        )
    }
}

impl<M: SimulationModel> Motion<'_, M> {
    /// The largest impulse that one of the long steps has missed, if it matters.
    pub(crate) fn undersampled_force(&self, stiff: bool) -> Option<UndersampledForce> {
        let records = &self.trajectory.records;
        let least = LONG_STEP_SHARE * (self.end_time() - self.start_time()).abs();
        let long = || (0..records.len()).filter(|&i| records[i].h != 0.0 && records[i].h.abs() >= least);
        let least_points = EVALUATIONS.1 / (1 + M::Vector::LEN as u64 / 16);
        let points = (EVALUATIONS.0 * self.counts().evaluations).clamp(least_points, EVALUATIONS.2) as usize;
        // Steps of orders to 20 and more are as long as many derivatives allow.
        let seen = if matches!(self.method(), Method::Taylor | Method::GraggBulirschStoer) { 3 } else { 1 };
        let parts = [seen, (points / (NODES.len() * long().count().max(1))).max(2 * seen)];
        let found = long().filter_map(|index| Some((index, self.missed_impulse(index, parts, stiff)?)));
        let (index, found) = found.max_by(|(_, a), (_, b)| a.times.total_cmp(&b.times))?;
        (self.difference_to_parts(index, parts[1]) > CONFIRMED_SHARE * MISSED_ERRORS).then_some(found)
    }

    /// Difference of the end of a step from that of the step made in parts, in permitted errors. It confirms
    /// a finding: the quintic path is not the motion, and may oscillate in a long step where the motion does
    /// not.
    fn difference_to_parts(&self, index: usize, parts: usize) -> f64 {
        let step = self.step(index);
        let (mut rhs, tolerances) = (self.rhs(index), &self.trajectory.tolerances);
        let Some(mut step_replay) =
            self.trajectory.erased_method_of(index).map(|erased_method| erased_method.step_replay())
        else {
            return 0.0;
        };
        let (mut at, h) = (step.start, step.h / parts as f64);
        for _ in 0..parts {
            let part = Step { start: at, end: at, h, flags: step.flags };
            let made = step_replay.end_of(&mut rhs, &part, tolerances);
            let made = made.and_then(|(y, _)| Some((y, rhs.accelerations(at.t + h, &y.q, &y.u).ok()?)));
            // A step that cannot be made in parts does not refute the finding.
            let Some((y, a)) = made else { return f64::INFINITY };
            at = StepNode { t: at.t + h, y, a };
        }
        self.most_permitted_errors(&at.y, &step.end.y)
    }

    /// The force that the step of a record has missed; `None` where it cannot be evaluated.
    fn missed_impulse(&self, index: usize, parts: [usize; 2], stiff: bool) -> Option<UndersampledForce> {
        let Step { mut start, mut end, h, flags } = self.step(index);
        let mut rhs = self.rhs(index);
        rhs.hold_branches(&mut start, h, flags.branches).ok()?;
        if flags.branches {
            // The step that follows may have found others there.
            end.a = rhs.accelerations(end.t, &end.y.q, &end.y.u).ok()?;
        }
        let path = Hermite::between(&start, &end, h);
        let mut impulse = |parts: usize| {
            let (part, mut sum, mut carried) = (1.0 / parts as f64, M::Vector::zeros(), M::Vector::zeros());
            for (k, (node, weight)) in (0..parts).flat_map(|k| NODES.map(|node| (k, node))) {
                let theta = part * (k as f64 + node);
                let y = path.at(theta);
                let a = rhs.accelerations(start.t + theta * h, &y.q, &y.u).ok()?;
                let weight = part * weight * h;
                let sums = sum.as_mut_slice().iter_mut().zip(carried.as_mut_slice());
                for ((sum, carried), a) in sums.zip(a.as_slice()) {
                    *sum += weight * a;
                    *carried += weight * h * (1.0 - theta) * a;
                }
            }
            Some((sum, carried))
        };
        let (seen, (mut missed, mut carried)) = (impulse(parts[0])?, impulse(parts[1])?);
        (0..M::Vector::LEN)
            .for_each(|i| (missed[i], carried[i]) = (missed[i] - seen.0[i], carried[i] - seen.1[i]));
        let tolerances = &self.trajectory.tolerances;
        let largest_impulse = |missed: &M::Vector| {
            let times = |i: usize| missed[i].abs() / tolerances.scale(start.y.u[i], end.y.u[i]);
            (0..M::Vector::LEN).map(|i| (i, times(i))).max_by(|(_, a), (_, b)| a.total_cmp(b))
        };
        let largest_displacement = |carried: &M::Vector| {
            let times = |i: usize| carried[i].abs() / tolerances.scale(start.y.q[i], end.y.q[i]);
            (0..M::Vector::LEN).map(|i| (i, times(i))).max_by(|(_, a), (_, b)| a.total_cmp(b))
        };
        let (mut i, mut times) = largest_impulse(&missed)?;
        let (mut threshold, mut of_velocity) = (MISSED_ERRORS, true);
        if stiff && times > MISSED_ERRORS {
            damp_within_step(&mut rhs, (&start, h), &mut missed)?;
            (i, times) = largest_impulse(&missed)?;
            threshold = MISSED_ERRORS_STIFF;
        }
        if times <= threshold {
            if stiff && largest_displacement(&carried)?.1 > MISSED_ERRORS {
                // Stiffness and damping reduce displacements, too.
                damp_within_step(&mut rhs, (&start, h), &mut carried)?;
            }
            let (k, largest_displacement) = largest_displacement(&carried)?;
            if largest_displacement > MISSED_ERRORS {
                (i, times, threshold, of_velocity) = (k, largest_displacement, MISSED_ERRORS, false);
            }
        }
        (times.is_finite() && times > threshold).then_some(UndersampledForce {
            name: M::COORDINATES[i].name,
            of_velocity,
            during: (start.t, end.t),
            times,
        })
    }
}

/// Reduces an impulse to what damping and stiffness leave of it at the end of a step.
fn damp_within_step<M: SimulationModel>(
    rhs: &mut RightHandSide<'_, '_, M>,
    (start, h): (&StepNode<M::Vector>, f64),
    impulse: &mut M::Vector,
) -> Option<()> {
    let n = M::Vector::LEN;
    let (mut by_q, mut by_u) = (vec![0.0; n * n], vec![0.0; n * n]);
    rhs.jacobian(start, &mut by_q, &mut by_u).ok()?;
    for (k, (x, by_u)) in by_q.iter_mut().zip(&by_u).enumerate() {
        *x = f64::from(u8::from(k % (n + 1) == 0)) - h * (by_u + h * *x);
    }
    let exchanges = factor::<M::Vector>(&mut by_q)?;
    solve(&by_q, &exchanges, impulse);
    Some(())
}

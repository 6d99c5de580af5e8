//! Branch changes of the model along a motion with tangent vectors.
//!
//! Steps hold the branches they started on, and end where one changes: k(q, q̇, t) = 0. If the acceleration
//! jumps there from a⁻ to a⁺, neighbours, which arrive earlier or later, gain or lose by the difference (the
//! saltation matrix: Aizerman & Gantmakher, Q. J. Mech. Appl. Math. 11 (1958) 225; Leine & Nijmeijer,
//! *Dynamics and Bifurcations of Non-Smooth Mechanical Systems*, §7):
//!
//! ```text
//! δq̇⁺ = δq̇⁻ + (a⁺ − a⁻) (∇k·δx)/k̇⁻        volumes are multiplied by k̇⁺/k̇⁻
//! ```
//!
//! If k̇ changes its sign or vanishes, the motion slides along the corner or only touches it. Then there are
//! no linear equations.

use alloc::vec::Vec;

use dynamics_runtime::model::{Branches, Constraints, Kink, MAX_KINKS, ModelState, Vector};

use super::PeriodicError;

/// Step of differences along the motion, in parts of the step of integration. The formula of order 6 then
/// leaves rounding only, for switching functions that are smooth over a step.
const SLOPE_STEP: f64 = 1e-3;
/// Step of differences along a tangent vector, as its largest displacement. A tangent vector is a small
/// disturbance; this step is small against coordinates of size 1.
const TANGENT_STEP: f64 = 1e-4;
/// Least rate of a switching function at a transversal crossing, relative to the terms of the rate, and of
/// the rate after relative to the rate before. Slower crossings count as touching: their saltation matrix
/// would be larger than 1e6.
const MIN_CROSSING_RATE: f64 = 1e-6;

/// The branches of the model on which a step is held.
pub(super) struct HeldBranches {
    /// Number of switching functions of the model.
    count: usize,
    held: Branches,
    /// Whether each switching function is negative on its branch.
    below: [bool; MAX_KINKS],
    /// The interval of each piece of a piecewise function.
    smooth: [[f64; 2]; MAX_KINKS],
}

/// The index of the switching function whose branch has ended.
#[derive(Clone, Copy)]
pub(super) struct Crossed(pub(super) usize);

/// g′(0) by central differences of order 6.
pub(super) fn slope(h: f64, mut g: impl FnMut(f64) -> f64) -> f64 {
    let mut pair = |k: f64| g(k * h) - g(-k * h);
    (45.0 * pair(1.0) - 9.0 * pair(2.0) + pair(3.0)) / (60.0 * h)
}

impl HeldBranches {
    /// The branches at a state.
    pub(super) fn at<M: Constraints>(model: &M, state: &M::State) -> Self {
        let kinks = kinks_at(model, state);
        let mut held = Branches::FREE;
        let deciding = kinks.iter().enumerate().take(M::KINKS).filter(|(_, kink)| kink.decides);
        deciding.for_each(|(index, kink)| held.hold(index, kink.value < 0.0));
        Self {
            count: M::KINKS,
            held,
            below: kinks.map(|kink| kink.value < 0.0),
            smooth: kinks.map(|kink| kink.smooth),
        }
    }

    /// The state on these branches.
    pub(super) fn hold<S: ModelState>(&self, state: &S) -> S {
        let mut state = *state;
        if self.count > 0 {
            state.hold(self.held);
        }
        state
    }

    /// The first switching function whose branch has ended before this state.
    pub(super) fn crossed<M: Constraints>(&self, model: &M, state: &M::State) -> Option<Crossed> {
        if self.count == 0 {
            return None;
        }
        let kinks = kinks_at(model, &self.hold(state));
        let beyond = |(index, kink): (usize, &Kink)| {
            if kink.decides {
                let other = kink.value != 0.0 && (kink.value < 0.0) != self.below[index];
                return other.then_some(Crossed(index));
            }
            let [low, high] = self.smooth[index];
            (kink.value < low || kink.value > high).then_some(Crossed(index))
        };
        kinks.iter().enumerate().take(self.count).find_map(beyond)
    }

    /// Goes over to the other branch, or to the next piece.
    pub(super) fn flip(&mut self, index: usize, kink: &Kink, piece: [f64; 2]) {
        if kink.decides {
            self.below[index] = !self.below[index];
            self.held.hold(index, self.below[index]);
        } else {
            self.smooth[index] = piece;
        }
    }
}

/// Applies the saltation matrix to the tangent vectors in `y` where the acceleration jumps from `old` to
/// `new`.
pub(super) fn apply_saltation<M: Constraints>(
    model: &M,
    (at, old, new): (&M::State, &[f64], &[f64]),
    index: usize,
    jump: &[f64],
    (y, step): (&mut [f64], f64),
) -> Result<(), PeriodicError> {
    let n = M::Vector::LEN;
    let value = |dt: f64, dq: &[f64], du: &[f64], by: f64| {
        let mut moved = dynamics_runtime::constrain::at_time(at, at.t() + by * dt);
        moved.q_mut().as_mut_slice().iter_mut().zip(dq).for_each(|(q, d)| *q += by * d);
        moved.u_mut().as_mut_slice().iter_mut().zip(du).for_each(|(u, d)| *u += by * d);
        kinks_at(model, &moved)[index].value
    };
    // k̇ before and after, and the terms of which it consists.
    let u = at.u().as_slice();
    let along = |a: &[f64]| slope(SLOPE_STEP * step, |by| value(1.0, u, a, by));
    let (before, after) = (along(old), along(new));
    let terms = (0..n).map(|i| {
        let unit = |k: usize, x: f64| if k == i { x } else { 0.0 };
        let of = |x: f64| (0..n).map(|k| unit(k, x)).collect::<Vec<_>>();
        let none = alloc::vec![0.0; n];
        let by_q = slope(SLOPE_STEP * step, |by| value(0.0, &of(u[i]), &none, by));
        let by_u = slope(SLOPE_STEP * step, |by| value(0.0, &none, &of(old[i]), by));
        by_q.abs() + by_u.abs()
    });
    let size = terms.sum::<f64>();
    if before.abs() <= MIN_CROSSING_RATE * size
        || before == 0.0
        || after / before <= MIN_CROSSING_RATE
        || !(after / before).is_finite()
    {
        return Err(PeriodicError::Grazes { time: at.t() });
    }
    let last = y.len() - 1;
    for first in (2 * n..last).step_by(2 * n) {
        let (dq, du) = y[first..first + 2 * n].split_at(n);
        let largest = dq.iter().chain(du).fold(0.0, |most: f64, x| most.max(x.abs()));
        if largest == 0.0 {
            continue;
        }
        let (dq, du) = (dq.to_vec(), du.to_vec());
        let gain = slope(TANGENT_STEP / largest, |by| value(0.0, &dq, &du, by)) / before;
        (0..n).for_each(|i| y[first + n + i] += jump[i] * gain);
    }
    y[last] += (after / before).ln();
    Ok(())
}

/// The switching functions of a model at a state.
pub(super) fn kinks_at<M: Constraints>(model: &M, state: &M::State) -> [Kink; MAX_KINKS] {
    let mut kinks = [Kink::NONE; MAX_KINKS];
    model.kinks(state, &mut kinks);
    kinks
}

//! Where a branch of the model changes on the way of a motion with tangent vectors.
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
//! Where k̇ changes its sign, or vanishes, the motion stays there, or touches: there are no linear equations
//! then.

use alloc::vec::Vec;

use super::PeriodicError;
use super::flow::{Flow, unpack};
use crate::error::SolveError;
use crate::model::{Branches, Constraints, Kink, MOST_KINKS, ModelState, Vector};

/// The branches that are held.
pub(super) struct Corners {
    count: usize,
    held: Branches,
    below: [bool; MOST_KINKS],
    smooth: [[f64; 2]; MOST_KINKS],
}

/// The kink whose branch has ended.
#[derive(Clone, Copy)]
pub(super) struct Crossed(usize);

/// The state, with tangent vectors, just beyond.
pub(super) struct Passed<S> {
    pub(super) state: S,
    pub(super) y: Vec<f64>,
}

/// g′(0) to order 6.
pub(super) fn slope(h: f64, mut g: impl FnMut(f64) -> f64) -> f64 {
    let mut pair = |k: f64| g(k * h) - g(-k * h);
    (45.0 * pair(1.0) - 9.0 * pair(2.0) + pair(3.0)) / (60.0 * h)
}

impl Corners {
    pub(super) fn at<M: Constraints>(model: &M, state: &M::State) -> Self {
        let kinks = read(model, state);
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

    /// A kink whose branch has ended before this state.
    pub(super) fn crossed<M: Constraints>(&self, model: &M, state: &M::State) -> Option<Crossed> {
        if self.count == 0 {
            return None;
        }
        let kinks = read(model, &self.hold(state));
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

    /// Whether a state lies where a force jumps, to what a motion passes in `within`: whether the jump comes
    /// before it, or after it, is for rounding to say.
    pub(super) fn starts_on<M: Constraints>(
        flow: &mut Flow<'_, M>,
        state: &M::State,
        within: f64,
    ) -> Result<bool, SolveError> {
        let here = Self::at(flow.model, state);
        let u = state.u();
        let held = here.hold(state);
        let a = flow.accelerations(&held)?;
        for (index, kink) in read(flow.model, state).iter().enumerate().take(here.count) {
            if !kink.decides || kink.is_cut {
                continue;
            }
            let value = |by: f64| {
                let mut moved = crate::constrain::nearby::at_time(&held, held.t() + by);
                let n = M::Vector::LEN;
                (0..n).for_each(|i| moved.q_mut()[i] += by * u[i] + 0.5 * by * by * a[i]);
                (0..n).for_each(|i| moved.u_mut()[i] += by * a[i]);
                read(flow.model, &moved)[index].value
            };
            if kink.value.abs() > within * slope(within, value).abs() {
                continue;
            }
            let mut other = Self::at(flow.model, state);
            other.flip(index, kink, kink.smooth);
            let beyond = flow.accelerations(&other.hold(state))?;
            let size =
                a.as_slice().iter().chain(beyond.as_slice()).fold(0.0, |most: f64, a| most.max(a.abs()));
            if a.as_slice().iter().zip(beyond.as_slice()).any(|(a, b)| (a - b).abs() > 1e-12 * size) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Ends the step where the first branch ends, and passes on to the other.
    pub(super) fn pass<M: Constraints>(
        &mut self,
        flow: &mut Flow<'_, M>,
        from: &M::State,
        (y, rate): (&[f64], &[f64]),
        mut crossed: Crossed,
        step: f64,
    ) -> Result<Passed<M::State>, PeriodicError> {
        let time = from.t();
        let (mut low, mut high) = (0.0, step);
        let (mut short, mut beyond) = (y.to_vec(), Vec::new());
        // By bisection on whether anything has changed: of several, the first.
        while high - low > 4.0 * f64::EPSILON * time.abs().max(step) {
            let middle = 0.5 * (low + high);
            let (end, _) = flow.attempt(from, self, y, rate, middle)?;
            match self.crossed(flow.model, &unpack(from, time + middle, &end)) {
                Some(first) => (high, crossed, beyond) = (middle, first, end),
                None => (low, short) = (middle, end),
            }
        }
        if beyond.is_empty() {
            beyond = flow.attempt(from, self, y, rate, high)?.0;
        }
        let mut state = unpack(from, time + high, &beyond);
        let before = self.hold(&state);
        let Crossed(index) = crossed;
        let kink = read(flow.model, &before)[index];
        let fall = |error| PeriodicError::Ends {
            time: before.t(),
            reason: alloc::boxed::Box::new(PeriodicError::Solve(error)),
        };
        // Pieces of functions cannot be held: of these the one before is that of the last state before its
        // end.
        let last = if kink.decides { before } else { self.hold(&unpack(from, time + low, &short)) };
        let old = flow.accelerations(&last).map_err(fall)?;
        self.flip(index, &kink, read(flow.model, &state)[index].smooth);
        let after = self.hold(&state);
        let new = flow.accelerations(&after).map_err(fall)?;
        let (was, is) = (old.as_slice(), new.as_slice());
        let size = was.iter().chain(is).fold(0.0, |most: f64, a| most.max(a.abs()));
        let jump: Vec<f64> = was.iter().zip(is).map(|(a, b)| b - a).collect();
        let rounding = if kink.decides { 1e-12 } else { 1e-9 };
        if !kink.is_cut && jump.iter().any(|jump| jump.abs() > rounding * size) {
            turn(flow.model, (&before, was, is), index, &jump, (&mut beyond, step))?;
        }
        state = unpack(&state, state.t(), &beyond);
        Ok(Passed { state, y: beyond })
    }

    /// Goes over to the other branch, or to the next piece.
    fn flip(&mut self, index: usize, kink: &Kink, piece: [f64; 2]) {
        if kink.decides {
            self.below[index] = !self.below[index];
            self.held.hold(index, self.below[index]);
        } else {
            self.smooth[index] = piece;
        }
    }
}

/// Turns the tangent vectors in `y` where the acceleration jumps.
fn turn<M: Constraints>(
    model: &M,
    (at, old, new): (&M::State, &[f64], &[f64]),
    index: usize,
    jump: &[f64],
    (y, step): (&mut [f64], f64),
) -> Result<(), PeriodicError> {
    let n = M::Vector::LEN;
    let value = |dt: f64, dq: &[f64], du: &[f64], by: f64| {
        let mut moved = crate::constrain::nearby::at_time(at, at.t() + by * dt);
        moved.q_mut().as_mut_slice().iter_mut().zip(dq).for_each(|(q, d)| *q += by * d);
        moved.u_mut().as_mut_slice().iter_mut().zip(du).for_each(|(u, d)| *u += by * d);
        read(model, &moved)[index].value
    };
    let u = at.u().as_slice();
    let along = |a: &[f64]| slope(1e-3 * step, |by| value(1.0, u, a, by));
    let (before, after) = (along(old), along(new));
    let terms = (0..n).map(|i| {
        let unit = |k: usize, x: f64| if k == i { x } else { 0.0 };
        let of = |x: f64| (0..n).map(|k| unit(k, x)).collect::<Vec<_>>();
        let none = alloc::vec![0.0; n];
        let by_q = slope(1e-3 * step, |by| value(0.0, &of(u[i]), &none, by));
        let by_u = slope(1e-3 * step, |by| value(0.0, &none, &of(old[i]), by));
        by_q.abs() + by_u.abs()
    });
    // Slower than what it is made of by so much, it touches.
    let size = terms.sum::<f64>();
    if before.abs() <= 1e-6 * size || before == 0.0 || after / before <= 1e-6 || !(after / before).is_finite()
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
        let gain = slope(1e-4 / largest, |by| value(0.0, &dq, &du, by)) / before;
        (0..n).for_each(|i| y[first + n + i] += jump[i] * gain);
    }
    y[last] += (after / before).ln();
    Ok(())
}

fn read<M: Constraints>(model: &M, state: &M::State) -> [Kink; MOST_KINKS] {
    let mut kinks = [Kink::NONE; MOST_KINKS];
    model.kinks(state, &mut kinks);
    kinks
}

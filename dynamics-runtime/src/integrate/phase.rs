//! Points of phase space, alone and several side by side, the nodes between steps, and arithmetic with them.

use crate::lanes::{Lanes, Wide};
use crate::model::Vector;

/// A point (q, u) of phase space, or a derivative (q̇, u̇) there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phase<V> {
    /// Generalized coordinates, or q̇ in a derivative.
    pub q: V,
    /// Generalized velocities, or q̈ in a derivative.
    pub u: V,
}

impl<V: Vector> Phase<V> {
    /// Both parts zero.
    #[must_use]
    pub fn zeros() -> Self {
        Self { q: V::zeros(), u: V::zeros() }
    }

    /// Whether every element is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        let finite = |v: &V| v.as_slice().iter().all(|x| x.is_finite());
        finite(&self.q) && finite(&self.u)
    }
}

/// Several phases side by side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stages<V: Vector, L: Lanes> {
    /// Generalized coordinates; q̇ in derivatives.
    pub q: V::Wide<L>,
    /// Generalized velocities; q̈ in derivatives.
    pub u: V::Wide<L>,
}

impl<V: Vector, L: Lanes> Stages<V, L> {
    /// All zero.
    #[inline(always)]
    #[must_use]
    pub fn zeros() -> Self {
        Self { q: V::Wide::<L>::zeros(), u: V::Wide::<L>::zeros() }
    }
    /// The phase of one lane.
    #[inline(always)]
    #[must_use]
    pub fn of(&self, lane: usize) -> Phase<V> {
        let mut phase = Phase::<V>::zeros();
        for i in 0..V::LEN {
            phase.q[i] = self.q.as_slice()[i].lane(lane);
            phase.u[i] = self.u.as_slice()[i].lane(lane);
        }
        phase
    }
    /// Puts a phase into one lane.
    #[inline(always)]
    pub fn put(&mut self, lane: usize, phase: &Phase<V>) {
        for i in 0..V::LEN {
            let (q, u) = (&mut self.q.as_mut_slice()[i], &mut self.u.as_mut_slice()[i]);
            (*q, *u) = (q.with_lane(lane, phase.q[i]), u.with_lane(lane, phase.u[i]));
        }
    }
}

/// A node between two steps: time, phase and the accelerations there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepNode<V> {
    /// Time.
    pub t: f64,
    /// q and u.
    pub y: Phase<V>,
    /// q̈.
    pub a: V,
}

impl<V: Vector> StepNode<V> {
    /// (q̇, q̈): the first stage of every method here.
    #[inline(always)]
    pub(crate) fn derivative(&self) -> Phase<V> {
        Phase { q: self.y.u, u: self.a }
    }
}

/// Element by element: combine(x, y).
#[inline(always)]
pub(crate) fn zip<V: Vector>(x: &Phase<V>, y: &Phase<V>, combine: impl Fn(f64, f64) -> f64) -> Phase<V> {
    let mut out = *x;
    for i in 0..V::LEN {
        out.q.as_mut_slice()[i] = combine(x.q.as_slice()[i], y.q.as_slice()[i]);
        out.u.as_mut_slice()[i] = combine(x.u.as_slice()[i], y.u.as_slice()[i]);
    }
    out
}

/// s x, element by element.
#[inline(always)]
pub(super) fn scaled<V: Vector>(s: f64, x: &Phase<V>) -> Phase<V> {
    zip(x, x, |x, _| s * x)
}

/// x + s y, element by element.
#[inline(always)]
pub(crate) fn plus_scaled<V: Vector>(x: &V, s: f64, y: &V) -> V {
    let mut out = *x;
    (0..V::LEN).for_each(|i| out[i] = x.as_slice()[i] + s * y.as_slice()[i]);
    out
}

/// A vector of NaN: what has no value.
pub(super) fn nan_vector<V: Vector>() -> V {
    let mut out = V::zeros();
    out.as_mut_slice().fill(f64::NAN);
    out
}

//! Kinks, where the accelerations of a model are not smooth, and the branches that a step holds.

use crate::math;
use crate::smooth::SmoothFunction;

/// Most kinks of a model: [`Branches`] has as many bits.
pub const MAX_KINKS: usize = 64;

/// A switching function: a value with the interval around it in which accelerations are smooth. Steps end
/// where the value leaves the interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kink {
    /// The value on which a branch of the model depends, or the argument of a function in pieces.
    pub value: f64,
    /// The interval of the value in which neither branch nor piece changes.
    pub smooth: [f64; 2],
    /// Whether its sign selects a branch, which a state can hold.
    pub decides: bool,
    /// Whether an angle from `atan2` jumps by a full turn there: expressions of the angle jump, the motion
    /// does not.
    pub is_cut: bool,
}

impl Kink {
    /// No kink: no value leaves this interval.
    pub const NONE: Self =
        Self { value: 0.0, smooth: [f64::NEG_INFINITY, f64::INFINITY], decides: false, is_cut: false };

    /// Of a branch that changes where the value changes its sign.
    #[inline]
    #[must_use]
    pub fn at_zero(value: f64) -> Self {
        let smooth = if value < 0.0 { [f64::NEG_INFINITY, 0.0] } else { [0.0, f64::INFINITY] };
        Self { value, smooth, decides: true, is_cut: false }
    }

    /// Where an angle jumps by a turn.
    #[inline]
    #[must_use]
    pub fn of_a_cut(self) -> Self {
        Self { is_cut: true, ..self }
    }

    /// Of a function at x.
    #[inline]
    #[must_use]
    pub fn of(function: &impl SmoothFunction, x: f64) -> Self {
        Self { value: x, smooth: function.piece(x), decides: false, is_cut: false }
    }
}

/// Branches of a model's choices that are held while a step is made, by the index of the kink that decides
/// them: see [`Dynamics::kinks`](super::Dynamics::kinks).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Branches {
    held: u64,
    below: u64,
}

impl Branches {
    /// No branch is held: values decide.
    pub const FREE: Self = Self { held: 0, below: 0 };

    /// Holds the branch of a kink's value below or above zero.
    pub fn hold(&mut self, kink: usize, below: bool) {
        self.held |= 1 << kink;
        self.below = self.below & !(1 << kink) | u64::from(below) << kink;
    }

    /// Whether all branches that both hold are equal.
    #[must_use]
    pub fn agrees(self, other: Self) -> bool {
        (self.below ^ other.below) & self.held & other.held == 0
    }

    /// The branch of one kink alone.
    #[must_use]
    pub fn alone(self, kink: usize) -> Self {
        Self { held: self.held & 1 << kink, below: self.below & 1 << kink }
    }

    /// Whether the other holds every branch that this one holds, on either side.
    #[must_use]
    pub fn is_part_of(self, other: Self) -> bool {
        self.held & !other.held == 0
    }

    /// Whether the branch is held.
    #[must_use]
    pub fn holds(self, kink: usize) -> bool {
        self.held >> kink & 1 == 1
    }

    /// Whether the value counts as negative: by the held branch, else by its sign.
    #[inline(always)]
    #[must_use]
    pub fn below(self, kink: usize, now: bool) -> bool {
        if self.holds(kink) { self.below >> kink & 1 == 1 } else { now }
    }

    /// |x|.
    #[inline(always)]
    #[must_use]
    pub fn abs(self, kink: usize, x: f64) -> f64 {
        match (self.holds(kink), self.below >> kink & 1 == 1) {
            (false, _) => math::abs(x),
            (true, true) => -x,
            (true, false) => x,
        }
    }

    /// The sign of x.
    #[inline(always)]
    #[must_use]
    pub fn signum(self, kink: usize, x: f64) -> f64 {
        match (self.holds(kink), self.below >> kink & 1 == 1) {
            (false, _) => math::signum(x),
            (true, true) => -1.0,
            (true, false) => 1.0,
        }
    }

    /// The angle of (x, y); continuous across ±π where the sign of y is held.
    #[inline(always)]
    #[must_use]
    pub fn atan2(self, kink: usize, y: f64, x: f64) -> f64 {
        let angle = math::atan2(y, x);
        let below = self.below >> kink & 1 == 1;
        if !self.holds(kink) || x >= 0.0 || below == (angle < 0.0) {
            return angle;
        }
        if below { angle - core::f64::consts::TAU } else { angle + core::f64::consts::TAU }
    }

    /// The smaller of a and b; the kink's value is a − b, or b − a where they are exchanged.
    #[inline(always)]
    #[must_use]
    pub fn min(self, kink: usize, exchanged: bool, a: f64, b: f64) -> f64 {
        match (self.holds(kink), (self.below >> kink & 1 == 1) != exchanged) {
            (false, _) => math::min(a, b),
            (true, true) => a,
            (true, false) => b,
        }
    }

    /// The larger, likewise.
    #[inline(always)]
    #[must_use]
    pub fn max(self, kink: usize, exchanged: bool, a: f64, b: f64) -> f64 {
        match (self.holds(kink), (self.below >> kink & 1 == 1) != exchanged) {
            (false, _) => math::max(a, b),
            (true, true) => b,
            (true, false) => a,
        }
    }
}

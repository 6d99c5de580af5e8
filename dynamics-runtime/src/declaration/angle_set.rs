//! Sets of three angles, and where they have gimbal lock.

use core::f64::consts::{FRAC_PI_2, PI};
use core::fmt;

use crate::math::abs;

/// Three coordinates that rotate a body one after another, each about an axis of the frame that the rotations
/// before it left: a 3-1-3 set, for example.
///
/// Gimbal lock: where the first and the last axis coincide, the first and the last angle rotate about the
/// same axis, and the three do not determine the orientation. Near it the rates of the angles grow without
/// bounds, and M is singular there unless each angle has inertia of its own. Sets with equal first and last
/// axis (Euler) lock where the middle angle is 0, ±π, ..; the others (Tait–Bryan) at ±π/2, .. Source: J.
/// Stuelpnagel, SIAM Review 6 (1964) 422.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AngleSet {
    /// Indices of the coordinates, in the order of the turns.
    pub angles: [usize; 3],
    /// The axes, 1 to 3.
    pub axes: [u8; 3],
}

impl AngleSet {
    /// Distance of the middle angle from the nearest value at which the set locks, in rad; NaN for NaN.
    #[must_use]
    pub fn distance(&self, q: &[f64]) -> f64 {
        let middle = q[self.angles[1]];
        abs(middle - self.locks_at(middle).value())
    }

    /// The value nearest to an angle at which the set locks.
    pub(crate) fn locks_at(&self, middle: f64) -> QuarterTurns {
        let of_euler = self.axes[0] == self.axes[2];
        let offset = if of_euler { 0.0 } else { 0.5 };
        let whole = libm::round(middle / PI - offset);
        QuarterTurns(2.0 * (whole + offset))
    }
}

/// `3-1-3`.
impl fmt::Display for AngleSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [a, b, c] = self.axes;
        write!(f, "{a}-{b}-{c}")
    }
}

/// A multiple of π/2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct QuarterTurns(f64);

impl QuarterTurns {
    /// In rad.
    pub(crate) fn value(self) -> f64 {
        self.0 * FRAC_PI_2
    }
}

/// `0`, `π/2`, `-π`, `3π/2`.
impl fmt::Display for QuarterTurns {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sign = if self.0 < 0.0 { "-" } else { "" };
        let size = abs(self.0);
        let (count, half) = if size % 2.0 == 0.0 { (0.5 * size, "") } else { (size, "/2") };
        if size == 0.0 {
            f.write_str("0")
        } else if count == 1.0 {
            write!(f, "{sign}π{half}")
        } else {
            write!(f, "{sign}{count}π{half}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn where_sets_lock() {
        let euler = AngleSet { angles: [0, 1, 2], axes: [3, 1, 3] };
        let cardan = AngleSet { axes: [1, 2, 3], ..euler };
        let of =
            |set: AngleSet, middle: f64| (set.locks_at(middle).value(), set.distance(&[0.3, middle, 0.7]));
        for turns in [-3.0, -1.0, 0.0, 1.0, 2.0] {
            let (at, distance) = of(euler, turns * PI + 0.25);
            assert!((at - turns * PI).abs() < 1e-14 && (distance - 0.25).abs() < 1e-14);
            let (at, distance) = of(cardan, (turns + 0.5) * PI - 0.25);
            assert!((at - (turns + 0.5) * PI).abs() < 1e-14 && (distance - 0.25).abs() < 1e-14);
        }
        assert!(of(euler, f64::NAN).1.is_nan());
        let text = |set: AngleSet, middle: f64| shown(set.locks_at(middle));
        for (set, middle, wanted) in [
            (euler, 0.1, "0"),
            (euler, -3.0, "-π"),
            (euler, 6.0, "2π"),
            (cardan, 1.5, "π/2"),
            (cardan, -1.5, "-π/2"),
            (cardan, 4.7, "3π/2"),
        ] {
            assert_eq!(text(set, middle), wanted);
        }
        assert_eq!(shown(euler), "3-1-3");
    }

    extern crate std;

    fn shown(what: impl fmt::Display) -> std::string::String {
        std::format!("{what}")
    }
}

//! The elementary functions of time jets, under the names that `f64` gives them.
//!
//! Each passes its value and its first two derivatives to the chain rule, in the form with the least
//! cancellation.

use super::Expr;
use crate::math;

impl Expr {
    /// sin x.
    #[inline]
    #[must_use]
    pub fn sin(self) -> Self {
        self.sin_cos().0
    }

    /// cos x.
    #[inline]
    #[must_use]
    pub fn cos(self) -> Self {
        self.sin_cos().1
    }

    /// (sin x, cos x).
    #[inline]
    #[must_use]
    pub fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = math::sin_cos(self.value);
        (self.chain(sin, cos, -sin), self.chain(cos, -sin, -cos))
    }

    /// tan x.
    #[inline]
    #[must_use]
    pub fn tan(self) -> Self {
        let f = math::tan(self.value);
        let f1 = 1.0 + f * f;
        self.chain(f, f1, 2.0 * f * f1)
    }

    /// arcsin x; NaN outside −1..1.
    #[inline]
    #[must_use]
    pub fn asin(self) -> Self {
        let x = self.value;
        let f1 = 1.0 / math::sqrt((1.0 - x) * (1.0 + x));
        self.chain(math::asin(x), f1, x * f1 * f1 * f1)
    }

    /// arccos x; NaN outside −1..1.
    #[inline]
    #[must_use]
    pub fn acos(self) -> Self {
        let x = self.value;
        let f1 = -1.0 / math::sqrt((1.0 - x) * (1.0 + x));
        self.chain(math::acos(x), f1, x * f1 * f1 * f1)
    }

    /// arctan x.
    #[inline]
    #[must_use]
    pub fn atan(self) -> Self {
        let x = self.value;
        let f1 = 1.0 / (1.0 + x * x);
        self.chain(math::atan(x), f1, -2.0 * x * f1 * f1)
    }

    /// Angle of the point (`x`, self) in −π..π, self being its ordinate y, as with `f64`.
    #[inline]
    #[must_use]
    pub fn atan2(self, x: impl Into<Self>) -> Self {
        let (y, x) = (self, x.into());
        let r = math::hypot(y.value, x.value);
        // Direction cosines instead of x/r²: the squares of very large and very small lengths leave the range
        // of f64.
        let (sin, cos) = (y.value / r, x.value / r);
        let bend = 2.0 * sin * cos / r / r;
        let twist = (sin - cos) * (sin + cos) / r / r;
        let gradient = [cos / r, -sin / r];
        y.chain2(x, math::atan2(y.value, x.value), gradient, [-bend, twist, bend])
    }

    /// √(x² + y²), x being self.
    #[inline]
    #[must_use]
    pub fn hypot(self, y: impl Into<Self>) -> Self {
        let (x, y) = (self, y.into());
        let r = math::hypot(x.value, y.value);
        let (cos, sin) = (x.value / r, y.value / r);
        let hessian = [sin * sin / r, -sin * cos / r, cos * cos / r];
        x.chain2(y, r, [cos, sin], hessian)
    }

    /// sinh x.
    #[inline]
    #[must_use]
    pub fn sinh(self) -> Self {
        let (f, f1) = (math::sinh(self.value), math::cosh(self.value));
        self.chain(f, f1, f)
    }

    /// cosh x.
    #[inline]
    #[must_use]
    pub fn cosh(self) -> Self {
        let (f, f1) = (math::cosh(self.value), math::sinh(self.value));
        self.chain(f, f1, f)
    }

    /// tanh x.
    #[inline]
    #[must_use]
    pub fn tanh(self) -> Self {
        let f = math::tanh(self.value);
        // 1/cosh² x: 1 − tanh² x has no digits left from |x| = 19 on.
        let sech = 1.0 / math::cosh(self.value);
        let f1 = sech * sech;
        self.chain(f, f1, -2.0 * f * f1)
    }

    /// eˣ.
    #[inline]
    #[must_use]
    pub fn exp(self) -> Self {
        let f = math::exp(self.value);
        self.chain(f, f, f)
    }

    /// Natural logarithm; NaN below 0.
    #[inline]
    #[must_use]
    pub fn ln(self) -> Self {
        let f1 = 1.0 / self.value;
        self.chain(math::ln(self.value), f1, -f1 * f1)
    }

    /// √x; NaN below 0. At 0 the derivatives of what moves are not finite.
    #[inline]
    #[must_use]
    pub fn sqrt(self) -> Self {
        let f = math::sqrt(self.value);
        let f1 = 0.5 / f;
        self.chain(f, f1, -0.5 * f1 / self.value)
    }

    /// ∛x. At 0 the derivatives of what moves are not finite.
    #[inline]
    #[must_use]
    pub fn cbrt(self) -> Self {
        let f = math::cbrt(self.value);
        let f1 = 1.0 / (3.0 * f * f);
        self.chain(f, f1, -2.0 / 3.0 * f1 / self.value)
    }

    /// 1/x.
    #[inline]
    #[must_use]
    pub fn recip(self) -> Self {
        let f = 1.0 / self.value;
        self.chain(f, -f * f, 2.0 * f * f * f)
    }

    /// xⁿ for an integer n; x⁰ = 1.
    #[inline]
    #[must_use]
    pub fn powi(self, n: i32) -> Self {
        match n {
            0 => Self::ONE,
            1 => self,
            2 => self * self,
            _ => {
                let x = self.value;
                let f = math::powi(x, n);
                let factor = f64::from(n);
                // For n < 0 the neighbouring powers by division: n − 2 may not be an i32, and x = 0 is a pole
                // anyway.
                let (lower, lowest) =
                    if n > 0 { (math::powi(x, n - 1), math::powi(x, n - 2)) } else { (f / x, f / x / x) };
                self.chain(f, factor * lower, factor * (factor - 1.0) * lowest)
            }
        }
    }

    /// xʸ; NaN for a negative x, except with a constant y that is an integer. x⁰ = 1 for a constant
    /// exponent 0.
    #[inline]
    #[must_use]
    pub fn powf(self, y: impl Into<Self>) -> Self {
        let (x, y) = (self, y.into());
        let f = math::powf(x.value, y.value);
        if y.is_constant() {
            return x.to_constant_power(f, y.value);
        }
        let lower = math::powf(x.value, y.value - 1.0);
        let lowest = math::powf(x.value, y.value - 2.0);
        let log = math::ln(x.value);
        let gradient = [y.value * lower, f * log];
        let hessian = [y.value * (y.value - 1.0) * lowest, lower * (1.0 + y.value * log), f * log * log];
        x.chain2(y, f, gradient, hessian)
    }

    /// xʸ = f with a constant y. A vanishing factor y or y − 1 wins over a power of 0 that is infinite.
    #[inline]
    fn to_constant_power(self, f: f64, y: f64) -> Self {
        if y == 0.0 {
            Self::ONE
        } else if y == 1.0 {
            self
        } else if y == 2.0 {
            self * self
        } else {
            let x = self.value;
            self.chain(f, y * math::powf(x, y - 1.0), y * (y - 1.0) * math::powf(x, y - 2.0))
        }
    }

    /// |x|; its derivative is that of the branch that [`signum`](Self::signum) names, +1 at 0 (−1 at −0).
    #[inline]
    #[must_use]
    pub fn abs(self) -> Self {
        if self.value.is_nan() {
            Self::UNKNOWN
        } else if self.value.is_sign_negative() {
            -self
        } else {
            self
        }
    }

    /// The sign of x as `f64` has it: 1 for x ≥ +0, −1 for x ≤ −0. Its derivative is taken as 0, at the jump
    /// too.
    #[inline]
    #[must_use]
    pub fn signum(self) -> Self {
        if self.value.is_nan() { Self::UNKNOWN } else { Self::constant(self.value.signum()) }
    }

    /// The lesser of the two with its derivatives; self where they are equal; NaN if either is (unlike
    /// `f64::min`, which drops it).
    #[inline]
    #[must_use]
    pub fn min(self, other: impl Into<Self>) -> Self {
        let other = other.into();
        if self.value <= other.value {
            self
        } else if other.value < self.value {
            other
        } else {
            Self::UNKNOWN
        }
    }

    /// The greater of the two with its derivatives; self where they are equal; NaN if either is (unlike
    /// `f64::max`, which drops it).
    #[inline]
    #[must_use]
    pub fn max(self, other: impl Into<Self>) -> Self {
        let other = other.into();
        if self.value >= other.value {
            self
        } else if other.value > self.value {
            other
        } else {
            Self::UNKNOWN
        }
    }

    /// `self.max(least).min(greatest)`.
    #[inline]
    #[must_use]
    pub fn clamp(self, least: impl Into<Self>, greatest: impl Into<Self>) -> Self {
        self.max(least).min(greatest)
    }

    /// `self * factor + term`; a single rounding is not promised.
    #[inline]
    #[must_use]
    pub fn mul_add(self, factor: impl Into<Self>, term: impl Into<Self>) -> Self {
        self * factor.into() + term.into()
    }

    /// f(x, y), x being self, from its gradient (f_x, f_y) and its second derivatives (f_xx, f_xy, f_yy).
    ///
    /// An argument that is constant takes no part, even where the derivative with respect to it is infinite.
    #[inline(always)]
    fn chain2(self, y: Self, f: f64, [fx, fy]: [f64; 2], [fxx, fxy, fyy]: [f64; 3]) -> Self {
        let x = self;
        if y.is_constant() {
            return x.chain(f, fx, fxx);
        }
        if x.is_constant() {
            return y.chain(f, fy, fyy);
        }
        Self {
            value: f,
            first: fx * x.first + fy * y.first,
            second: fx * x.second
                + fy * y.second
                + fxx * x.first * x.first
                + 2.0 * fxy * x.first * y.first
                + fyy * y.first * y.first,
            beyond: f64::NAN,
        }
    }
}

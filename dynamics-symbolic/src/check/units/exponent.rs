//! Rational exponents of units.

use core::fmt;

/// An exponent `numerator / denominator`, reduced, denominator positive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Exponent {
    numerator: i64,
    denominator: i64,
}

const fn gcd(mut a: u128, mut b: u128) -> u128 {
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a
}

impl Exponent {
    /// 0.
    pub const ZERO: Self = Self::integer(0);
    /// 1.
    pub const ONE: Self = Self::integer(1);
    /// ½, the exponent of a square root.
    pub const HALF: Self = Self { numerator: 1, denominator: 2 };
    /// ⅓, the exponent of a cube root.
    pub const THIRD: Self = Self { numerator: 1, denominator: 3 };

    /// An integer.
    #[must_use]
    pub const fn integer(n: i32) -> Self {
        Self { numerator: n as i64, denominator: 1 }
    }

    /// `n / d`; `None` where d is zero or the reduced fraction does not fit.
    #[must_use]
    pub fn ratio(n: i128, d: i128) -> Option<Self> {
        let g = i128::try_from(gcd(n.unsigned_abs(), d.unsigned_abs())).ok()?;
        if d == 0 || g == 0 {
            return None;
        }
        let sign = d.signum();
        let numerator = (n / g).checked_mul(sign)?.try_into().ok()?;
        let denominator = (d / g).checked_mul(sign)?.try_into().ok()?;
        Some(Self { numerator, denominator })
    }

    /// Numerator, carrying the sign.
    #[must_use]
    pub const fn numerator(self) -> i64 {
        self.numerator
    }
    /// Denominator, positive.
    #[must_use]
    pub const fn denominator(self) -> i64 {
        self.denominator
    }
    /// Whether it is 0.
    #[must_use]
    pub const fn is_zero(self) -> bool {
        self.numerator == 0
    }
    /// Whether it is below 0.
    #[must_use]
    pub const fn is_negative(self) -> bool {
        self.numerator < 0
    }

    /// Sum; `None` where it does not fit.
    #[must_use]
    pub fn plus(self, o: Self) -> Option<Self> {
        let ((a, b), (c, d)) = (self.wide(), o.wide());
        Self::ratio((a * d).checked_add(c * b)?, b * d)
    }
    /// Product; `None` where it does not fit.
    #[must_use]
    pub fn times(self, o: Self) -> Option<Self> {
        let ((a, b), (c, d)) = (self.wide(), o.wide());
        Self::ratio(a * c, b * d)
    }
    /// Quotient; `None` where `o` is 0 or the result does not fit.
    #[must_use]
    pub fn over(self, o: Self) -> Option<Self> {
        let ((a, b), (c, d)) = (self.wide(), o.wide());
        Self::ratio(a * d, b * c)
    }
    /// Negation; `None` where it does not fit.
    #[must_use]
    pub fn negated(self) -> Option<Self> {
        Some(Self { numerator: self.numerator.checked_neg()?, ..self })
    }

    fn wide(self) -> (i128, i128) {
        (self.numerator.into(), self.denominator.into())
    }
}

impl fmt::Display for Exponent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.denominator == 1 {
            write!(f, "{}", self.numerator)
        } else {
            write!(f, "({}/{})", self.numerator, self.denominator)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Exponent;

    #[test]
    fn fractions_are_reduced_and_signs_are_in_the_numerator() {
        assert_eq!(Exponent::ratio(2, -4).unwrap().to_string(), "(-1/2)");
        assert_eq!(Exponent::HALF.plus(Exponent::HALF), Some(Exponent::ONE));
        assert_eq!(Exponent::HALF.over(Exponent::ZERO), None);
        assert_eq!(Exponent::ratio(0, 7), Some(Exponent::ZERO));
    }

    #[test]
    fn what_does_not_fit_is_none() {
        let large = Exponent::ratio(i64::MAX.into(), 1).unwrap();
        assert_eq!(large.times(large), None);
        assert_eq!(large.plus(large), None);
        let smallest = Exponent::ratio(i64::MIN.into(), 1).unwrap();
        assert_eq!(smallest.negated(), None);
        assert_eq!(smallest.over(Exponent::integer(-1)), None);
    }
}

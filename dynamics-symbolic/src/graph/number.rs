//! Numbers: exact rationals as long as they fit, `f64` beyond.

use core::cmp::Ordering;

/// A literal or folded constant.
#[derive(Clone, Copy, Debug)]
pub enum Number {
    /// `numerator / denominator`, reduced, denominator positive.
    Rational(i128, i128),
    /// Anything else, finite.
    Float(f64),
}

const fn gcd(mut a: u128, mut b: u128) -> u128 {
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a
}

/// n / d correctly rounded: 64 quotient bits by long division and a sticky bit, of which the conversion
/// keeps 53. |n| and d are below 2¹²⁶.
fn divide(n: i128, d: i128) -> f64 {
    if n == 0 {
        return 0.0;
    }
    let (mut rest, mut divisor) = (n.unsigned_abs(), d.unsigned_abs());
    let scale = divisor.leading_zeros() as i32 - rest.leading_zeros() as i32;
    if scale < 0 {
        rest <<= -scale
    } else {
        divisor <<= scale
    }
    let mut quotient: u128 = 0;
    for _ in 0..64 {
        quotient <<= 1;
        if rest >= divisor {
            rest -= divisor;
            quotient |= 1;
        }
        rest <<= 1;
    }
    let rounded = (quotient << 1 | u128::from(rest != 0)) as f64;
    let value = rounded * 2f64.powi(scale - 64);
    if n < 0 { -value } else { value }
}

/// Bound of numerator and denominator. Products of two numbers below it fit into `i128`, and two integers
/// below it differ by less than the modulus of fingerprints, 2⁶¹ − 31: otherwise two of them could have
/// the same fingerprint.
const NUMBER_BOUND: i128 = 1 << 60;

/// Integers below it are exact as floats: just under 2⁵³.
const LARGEST_EXACT_INTEGER: f64 = 9e15;

impl Number {
    /// Zero.
    pub const ZERO: Self = Self::Rational(0, 1);
    /// One.
    pub const ONE: Self = Self::Rational(1, 1);

    /// The integer `n`.
    #[must_use]
    pub fn integer(n: i64) -> Self {
        Self::ratio(n.into(), 1)
    }

    /// `n / d` reduced; a float where it does not fit. `d` is not zero.
    #[must_use]
    pub fn ratio(n: i128, d: i128) -> Self {
        debug_assert!(d != 0);
        let g = gcd(n.unsigned_abs(), d.unsigned_abs()).max(1) as i128;
        let sign = if d < 0 { -1 } else { 1 };
        let (n, d) = (sign * (n / g), sign * (d / g));
        if n.abs() < NUMBER_BOUND && d < NUMBER_BOUND {
            Self::Rational(n, d)
        } else {
            Self::Float(divide(n, d))
        }
    }

    /// Parses a decimal literal as Rust writes it, without suffix: `1`, `0.25`, `6.674e-11`, underscores
    /// allowed. Exact where it fits.
    #[must_use]
    pub fn parse(text: &str) -> Option<Self> {
        let text: String = text.chars().filter(|c| *c != '_').collect();
        let value: f64 = text.parse().ok()?;
        let (mantissa, exponent) = match text.find(['e', 'E']) {
            Some(at) => (&text[..at], text[at + 1..].parse::<i32>().ok()?),
            None => (text.as_str(), 0),
        };
        let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
        let digits = format!("{whole}{fraction}");
        let exponent = exponent - i32::try_from(fraction.len()).ok()?;
        let exact = || {
            let n: i128 = digits.parse().ok()?;
            let power = 10i128.checked_pow(exponent.unsigned_abs())?;
            if exponent >= 0 {
                Some(Self::ratio(n.checked_mul(power)?, 1))
            } else {
                Some(Self::ratio(n, power))
            }
        };
        exact()
            .filter(|n| matches!(n, Self::Rational(..)))
            .or_else(|| value.is_finite().then_some(Self::Float(value)))
    }

    /// The nearest `f64`, correctly rounded.
    #[must_use]
    pub fn value(self) -> f64 {
        match self {
            Self::Rational(n, d) => divide(n, d),
            Self::Float(x) => x,
        }
    }

    /// Whether it is exactly the integer `n`.
    #[must_use]
    pub fn is(self, n: i64) -> bool {
        matches!(self, Self::Rational(m, 1) if m == i128::from(n))
    }

    /// Whether it is below zero.
    #[must_use]
    pub fn is_negative(self) -> bool {
        match self {
            Self::Rational(n, _) => n < 0,
            Self::Float(x) => x < 0.0,
        }
    }

    /// Sum; `None` where it is not finite.
    #[must_use]
    pub fn plus(self, other: Self) -> Option<Self> {
        match (self, other) {
            (Self::Rational(a, b), Self::Rational(c, d)) => Some(Self::ratio(a * d + c * b, b * d)),
            _ => Self::float(self.value() + other.value()),
        }
    }

    /// Product; `None` where it is not finite.
    #[must_use]
    pub fn times(self, other: Self) -> Option<Self> {
        match (self, other) {
            (Self::Rational(a, b), Self::Rational(c, d)) => Some(Self::ratio(a * c, b * d)),
            _ => Self::float(self.value() * other.value()),
        }
    }

    /// Opposite.
    #[must_use]
    pub fn opposite(self) -> Self {
        match self {
            Self::Rational(a, b) => Self::Rational(-a, b),
            Self::Float(x) => Self::Float(-x),
        }
    }

    /// Quotient; `None` where it is not finite.
    #[must_use]
    pub fn over(self, other: Self) -> Option<Self> {
        match (self, other) {
            (_, Self::Rational(0, _)) => None,
            (Self::Rational(a, b), Self::Rational(c, d)) => Some(Self::ratio(a * d, b * c)),
            _ => Self::float(self.value() / other.value()),
        }
    }

    fn float(x: f64) -> Option<Self> {
        x.is_finite().then_some(Self::Float(x))
    }

    /// A float as a number, an integer where it is one; `None` where it is not finite.
    #[must_use]
    pub fn finite(x: f64) -> Option<Self> {
        if x.fract() == 0.0 && x.abs() < LARGEST_EXACT_INTEGER {
            Some(Self::integer(x as i64))
        } else {
            x.is_finite().then_some(Self::Float(x))
        }
    }

    /// Reciprocal; `None` for zero.
    #[must_use]
    pub fn recip(self) -> Option<Self> {
        match self {
            Self::Rational(0, _) => None,
            Self::Rational(a, b) => Some(Self::ratio(b, a)),
            Self::Float(x) => Self::float(1.0 / x),
        }
    }

    /// Order by value.
    #[must_use]
    pub fn compare(self, other: Self) -> Option<Ordering> {
        self.value().partial_cmp(&other.value())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rationals_are_rounded_as_the_standard_library_rounds_decimal_literals() {
        for text in
            ["0.1", "6.674e-11", "9007199254740993", "0.3333333333333333333", "123456789.123456789", "2.5e-1"]
        {
            let number = Number::parse(text).expect("a literal");
            assert_eq!(number.value().to_bits(), text.parse::<f64>().expect("a literal").to_bits(), "{text}");
        }
        assert_eq!(Number::ratio(1, 3).value().to_bits(), (1.0f64 / 3.0).to_bits());
        assert_eq!(Number::ratio(-2, 7).value().to_bits(), (-2.0f64 / 7.0).to_bits());
        // 2⁶¹ + 257 over 3: numerator beyond 2⁵³; the reference is (2⁶¹ + 257)/3 = 768614336404564736.0 to
        // the nearest.
        assert_eq!(Number::ratio((1 << 61) + 257, 3).value(), 768_614_336_404_564_736.0);
        // A tie that double rounding would break: 2⁵³ + 1 is half way, to even.
        assert_eq!(Number::ratio((1 << 53) + 1, 1).value(), 9_007_199_254_740_992.0);
        assert_eq!(Number::ratio((1 << 54) + 3, 2).value(), 9_007_199_254_740_994.0);
    }

    #[test]
    fn nothing_infinite_is_a_number() {
        assert!(Number::parse("1e999").is_none());
        let large = Number::parse("1e300").expect("finite");
        assert!(large.times(large).is_none());
        assert!(Number::ZERO.recip().is_none());
        assert!(Number::Float(1e-320).recip().is_none());
    }
}

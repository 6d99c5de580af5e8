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

/// Largest magnitude of numerator and denominator, so that products of two fit into `i128`.
const LIMIT: i128 = 1 << 62;

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
        if n.abs() < LIMIT && d < LIMIT { Self::Rational(n, d) } else { Self::Float(n as f64 / d as f64) }
    }

    /// Parses a decimal literal as Rust writes it, without suffix: `1`, `0.25`, `6.674e-11`, underscores allowed. Exact where it fits.
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
            if exponent >= 0 { Some(Self::ratio(n.checked_mul(power)?, 1)) } else { Some(Self::ratio(n, power)) }
        };
        Some(exact().filter(|n| matches!(n, Self::Rational(..))).unwrap_or(Self::Float(value)))
    }

    /// The nearest `f64`.
    #[must_use]
    pub fn value(self) -> f64 {
        match self {
            Self::Rational(n, d) => n as f64 / d as f64,
            Self::Float(x) => x,
        }
    }

    /// Whether it is exactly the integer `n`.
    #[must_use]
    pub fn is(self, n: i64) -> bool {
        matches!(self, Self::Rational(m, 1) if m == i128::from(n))
    }

    /// Sum.
    #[must_use]
    pub fn add(self, other: Self) -> Self {
        match (self, other) {
            (Self::Rational(a, b), Self::Rational(c, d)) => Self::ratio(a * d + c * b, b * d),
            _ => Self::Float(self.value() + other.value()),
        }
    }

    /// Product.
    #[must_use]
    pub fn mul(self, other: Self) -> Self {
        match (self, other) {
            (Self::Rational(a, b), Self::Rational(c, d)) => Self::ratio(a * c, b * d),
            _ => Self::Float(self.value() * other.value()),
        }
    }

    /// Negation.
    #[must_use]
    pub fn neg(self) -> Self {
        match self {
            Self::Rational(a, b) => Self::Rational(-a, b),
            Self::Float(x) => Self::Float(-x),
        }
    }

    /// Reciprocal; `None` for zero.
    #[must_use]
    pub fn recip(self) -> Option<Self> {
        match self {
            Self::Rational(0, _) => None,
            Self::Rational(a, b) => Some(Self::ratio(b, a)),
            Self::Float(x) => (x != 0.0).then(|| Self::Float(1.0 / x)),
        }
    }

    /// Order by value.
    #[must_use]
    pub fn compare(self, other: Self) -> Option<Ordering> {
        self.value().partial_cmp(&other.value())
    }
}

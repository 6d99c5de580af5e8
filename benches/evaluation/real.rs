//! Numbers that the hand-written accelerations run on: `f64` with the standard library's sines or with the
//! inlined ones, and pairs of `f64` with 31 digits, which all errors are measured against.

use std::f64::consts::FRAC_PI_2;
use std::ops::{Add, Div, Mul, Neg, Sub};

use dynamics::sin_cos;

/// What the hand-written functions need of a number.
pub(crate) trait Real: Copy
where
    Self: Add<Output = Self> + Sub<Output = Self> + Neg<Output = Self>,
    Self: Mul<Output = Self> + Div<Output = Self>,
{
    fn of(x: f64) -> Self;
    fn sqrt(self) -> Self;
    /// (sin x, cos x) of all angles of a model.
    fn sin_cos<const N: usize>(angles: [Self; N]) -> [(Self, Self); N];
    fn to_f64(self) -> f64;
}

/// `f64` with the standard library's sines.
#[derive(Clone, Copy)]
pub(crate) struct Standard(f64);

/// `f64` with the sines of derived models.
#[derive(Clone, Copy)]
pub(crate) struct Inlined(f64);

/// The unevaluated sum of two `f64`, the second below half a unit in the last place of the first: errors
/// below 1e-31 (Dekker 1971; Hida, Li, Bailey 2001).
#[derive(Clone, Copy)]
pub(crate) struct Pair(f64, f64);

macro_rules! plain {
    ($name:ident, $angles:ident => $pairs:expr) => {
        plain!(@op $name, Add, add, +);
        plain!(@op $name, Sub, sub, -);
        plain!(@op $name, Mul, mul, *);
        plain!(@op $name, Div, div, /);
        impl Neg for $name {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                Self(-self.0)
            }
        }
        impl Real for $name {
            #[inline(always)]
            fn of(x: f64) -> Self {
                Self(x)
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                Self(self.0.sqrt())
            }
            #[inline(always)]
            fn sin_cos<const N: usize>($angles: [Self; N]) -> [(Self, Self); N] {
                $pairs
            }
            #[inline(always)]
            fn to_f64(self) -> f64 {
                self.0
            }
        }
    };
    (@op $name:ident, $trait:ident, $method:ident, $sign:tt) => {
        impl $trait for $name {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(self.0 $sign other.0)
            }
        }
    };
}

plain!(Standard, angles => angles.map(|x| {
    let (s, c) = x.0.sin_cos();
    (Self(s), Self(c))
}));
plain!(Inlined, angles => {
    let (s, c) = sin_cos::lanes(angles.map(|x| x.0));
    std::array::from_fn(|i| (Self(s[i]), Self(c[i])))
});

/// a + b and what rounding left of it.
fn sum(a: f64, b: f64) -> Pair {
    let s = a + b;
    let of_b = s - a;
    Pair(s, (a - (s - of_b)) + (b - of_b))
}

/// a b and what rounding left of it.
fn product(a: f64, b: f64) -> Pair {
    let p = a * b;
    Pair(p, a.mul_add(b, -p))
}

impl Add for Pair {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let (high, low) = (sum(self.0, other.0), sum(self.1, other.1));
        let high = sum(high.0, high.1 + low.0);
        sum(high.0, high.1 + low.1)
    }
}

impl Sub for Pair {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Neg for Pair {
    type Output = Self;
    fn neg(self) -> Self {
        Self(-self.0, -self.1)
    }
}

impl Mul for Pair {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let p = product(self.0, other.0);
        sum(p.0, p.1 + (self.0 * other.1 + self.1 * other.0))
    }
}

impl Div for Pair {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let first = self.0 / other.0;
        let rest = self - other * Self(first, 0.0);
        let second = rest.0 / other.0;
        let rest = rest - other * Self(second, 0.0);
        sum(first, second) + Self(rest.0 / other.0, 0.0)
    }
}

impl Real for Pair {
    fn of(x: f64) -> Self {
        Self(x, 0.0)
    }
    fn sqrt(self) -> Self {
        let root = Self(self.0.sqrt(), 0.0);
        root + (self - root * root) / (root + root)
    }
    fn sin_cos<const N: usize>(angles: [Self; N]) -> [(Self, Self); N] {
        angles.map(turned)
    }
    fn to_f64(self) -> f64 {
        self.0
    }
}

/// Sine and cosine by their series, of an angle that is no more than some turns.
fn turned(x: Pair) -> (Pair, Pair) {
    let quarters = (x.0 / FRAC_PI_2).round();
    let right = [FRAC_PI_2, 6.123_233_995_736_766e-17, -1.497_384_904_859_169_8e-33];
    let r = right.iter().fold(x, |r, part| r - product(quarters, *part));
    let (mut term, mut sums) = (Pair::of(1.0), [Pair::of(1.0), Pair::of(0.0)]);
    for k in 1..=32u8 {
        term = term * r / Pair::of(f64::from(k));
        let signed = if k & 2 == 0 { term } else { -term };
        sums[usize::from(k & 1)] = sums[usize::from(k & 1)] + signed;
    }
    let [cos, sin] = sums;
    match quarters.rem_euclid(4.0) as u8 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

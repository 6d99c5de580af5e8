//! Elementary functions for generated code and time jets: the standard library's with `std`, `libm` without.

use crate::lanes::Lanes;

macro_rules! elementary {
    ($($name:ident / $libm:ident: $meaning:literal),* $(,)?) => {$(
        #[doc = $meaning]
        #[inline(always)]
        #[must_use]
        pub fn $name(x: f64) -> f64 {
            #[cfg(feature = "std")]
            { f64::$name(x) }
            #[cfg(not(feature = "std"))]
            { libm::$libm(x) }
        }
    )*};
}

elementary! {
    sin / sin: "sin x.", cos / cos: "cos x.", tan / tan: "tan x.",
    asin / asin: "arcsin x.", acos / acos: "arccos x.", atan / atan: "arctan x.",
    sinh / sinh: "sinh x.", cosh / cosh: "cosh x.", tanh / tanh: "tanh x.",
    exp / exp: "eˣ.", ln / log: "Natural logarithm.", sqrt / sqrt: "√x.", cbrt / cbrt: "∛x.",
}

/// sum + a b: with one rounding where the target of the build has an instruction for it, else with two.
#[inline(always)]
#[must_use]
pub fn add_product(sum: f64, a: f64, b: f64) -> f64 {
    a.times_plus(b, sum)
}

/// sum − a b, rounded as [`add_product`].
#[inline(always)]
#[must_use]
pub fn sub_product(sum: f64, a: f64, b: f64) -> f64 {
    sum.minus_product(a, b)
}

/// a b − term, rounded as [`add_product`].
#[inline(always)]
#[must_use]
pub fn product_sub(a: f64, b: f64, term: f64) -> f64 {
    a.times_minus(b, term)
}

/// (sin x, cos x).
#[inline(always)]
#[must_use]
pub fn sin_cos(x: f64) -> (f64, f64) {
    #[cfg(feature = "std")]
    {
        f64::sin_cos(x)
    }
    #[cfg(not(feature = "std"))]
    {
        libm::sincos(x)
    }
}

/// Angle of the point (x, y).
#[inline(always)]
#[must_use]
pub fn atan2(y: f64, x: f64) -> f64 {
    #[cfg(feature = "std")]
    {
        f64::atan2(y, x)
    }
    #[cfg(not(feature = "std"))]
    {
        libm::atan2(y, x)
    }
}

/// √(x² + y²) without overflow.
#[inline(always)]
#[must_use]
pub fn hypot(x: f64, y: f64) -> f64 {
    #[cfg(feature = "std")]
    {
        f64::hypot(x, y)
    }
    #[cfg(not(feature = "std"))]
    {
        libm::hypot(x, y)
    }
}

/// xʸ.
#[inline(always)]
#[must_use]
pub fn powf(x: f64, y: f64) -> f64 {
    #[cfg(feature = "std")]
    {
        f64::powf(x, y)
    }
    #[cfg(not(feature = "std"))]
    {
        libm::pow(x, y)
    }
}

/// |x|.
#[inline(always)]
#[must_use]
pub fn abs(x: f64) -> f64 {
    x.abs()
}

/// 1 for x ≥ +0, −1 for x ≤ −0.
#[inline(always)]
#[must_use]
pub fn signum(x: f64) -> f64 {
    x.signum()
}

/// The lesser, the first where they are equal; NaN if either is (unlike `f64::min`, which drops it).
#[inline(always)]
#[must_use]
pub fn min(a: f64, b: f64) -> f64 {
    if a <= b {
        a
    } else if b < a {
        b
    } else {
        f64::NAN
    }
}

/// The greater, the first where they are equal; NaN if either is (unlike `f64::max`, which drops it).
#[inline(always)]
#[must_use]
pub fn max(a: f64, b: f64) -> f64 {
    if a >= b {
        a
    } else if b > a {
        b
    } else {
        f64::NAN
    }
}

/// ab + c; a single rounding is not promised.
#[inline(always)]
#[must_use]
pub fn mul_add(a: f64, b: f64, c: f64) -> f64 {
    a * b + c
}

/// xⁿ by repeated squaring: ⌊log₂|n|⌋ + popcount roundings at most.
#[inline]
#[must_use]
pub fn powi(x: f64, n: i32) -> f64 {
    let mut remaining = n.unsigned_abs();
    let mut square = x;
    let mut product = 1.0;
    while remaining != 0 {
        if remaining & 1 == 1 {
            product *= square;
        }
        remaining >>= 1;
        square *= square;
    }
    if n < 0 { 1.0 / product } else { product }
}

macro_rules! methods {
    ($($name:ident($($argument:ident: $type:ty),*) -> $result:ty;)*) => {
        /// The elementary functions as methods of `f64` where the standard library, which has them of its
        /// own, is absent.
        ///
        /// With `std` the inherent methods take precedence, so that a model's source is the same in both
        /// worlds.
        pub trait F64Ext {$(
            #[doc = concat!("`f64::", stringify!($name), "`.")]
            #[must_use]
            fn $name(self, $($argument: $type),*) -> $result;
        )*}

        impl F64Ext for f64 {$(
            #[inline(always)]
            fn $name(self, $($argument: $type),*) -> $result {
                $name(self, $($argument),*)
            }
        )*}
    };
}

methods! {
    sin() -> f64; cos() -> f64; tan() -> f64;
    asin() -> f64; acos() -> f64; atan() -> f64;
    sinh() -> f64; cosh() -> f64; tanh() -> f64;
    exp() -> f64; ln() -> f64; sqrt() -> f64; cbrt() -> f64;
    sin_cos() -> (f64, f64);
    atan2(x: f64) -> f64; hypot(y: f64) -> f64;
    powf(y: f64) -> f64; powi(n: i32) -> f64;
    mul_add(factor: f64, term: f64) -> f64;
}

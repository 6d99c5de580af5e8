//! Elementary functions for generated code and time jets: the standard library's with `std`, `libm` without.

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

/// log₂ x to 1e-4 for normal x > 0: for step sizes, at a twentieth of the time of the exact function.
#[inline(always)]
pub(crate) fn log2_roughly(x: f64) -> f64 {
    let bits = x.to_bits();
    let exponent = ((bits >> 52) & 0x7ff) as f64 - 1023.0;
    // log₂(1 + f) by Chebyshev's expansion, to 1.0e-4; no division, as the length of a step waits for it.
    let f = f64::from_bits(bits & 0x000f_ffff_ffff_ffff | 0x3ff0_0000_0000_0000) - 1.0;
    let (low, high) =
        (add_product(1.437_302_17, -0.672_934_193, f), add_product(0.315_467_609, -0.080_010_877, f));
    let log2 = add_product(exponent + 1.001_890e-4, f, add_product(low, f * f, high));
    if (f64::MIN_POSITIVE..f64::INFINITY).contains(&x) {
        log2
    } else if x == f64::INFINITY {
        1024.0
    } else if x >= 0.0 {
        -1074.0
    } else {
        f64::NAN
    }
}

/// 2ˣ to 1e-4.
#[inline(always)]
pub(crate) fn exp2_roughly(x: f64) -> f64 {
    /// Added to a number, its last bits are those of the nearest integer.
    const SHIFT: f64 = 6_755_399_441_055_744.0;
    let x = x.clamp(-1022.0, 1023.0);
    let shifted = x + SHIFT;
    let f = x - (shifted - SHIFT);
    // By Chebyshev's expansion on |f| ≤ ½, to 2.7e-6.
    let (low, high) =
        (add_product(1.000_000_08, 0.693_121_03, f), add_product(0.240_221_07, 0.055_922_04, f));
    let square = f * f;
    let power = add_product(low, square, add_product(high, 0.009_676_04, square));
    f64::from_bits(shifted.to_bits().wrapping_add(1023) << 52) * power
}

/// sum + a b: with one rounding where the target has an instruction for it, else with two.
#[inline(always)]
#[must_use]
pub fn add_product(sum: f64, a: f64, b: f64) -> f64 {
    #[cfg(feature = "std")]
    if crate::sin_cos::FUSED {
        return a.mul_add(b, sum);
    }
    sum + a * b
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rough_powers_of_two_are_good_enough_for_steps() {
        for i in -2000..2000 {
            let x = 0.3 * f64::from(i);
            assert!((exp2_roughly(x) / x.exp2() - 1.0).abs() < 1e-4, "{x}");
            assert!((log2_roughly(x.exp2()) - x).abs() < 1e-3, "{x}: {}", log2_roughly(x.exp2()));
        }
        assert_eq!(log2_roughly(f64::INFINITY), 1024.0);
        assert!(log2_roughly(f64::NAN).is_nan());
        assert_eq!(log2_roughly(0.0), -1074.0);
    }
}

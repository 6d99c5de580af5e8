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

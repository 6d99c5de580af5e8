//! Powers of two and logarithms to four digits: for step sizes, which need no more.

use crate::math::add_product;

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

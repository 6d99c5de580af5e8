//! 1/√x by sums and products, inlined and without a branch.
//!
//! Square roots and divisions are the slowest operations of a vector unit: eight numbers of each in one
//! vector take as long as forty sums. Loops that divide by many roots are three times as fast with these.
//!
//! * **Range**: positive normal numbers, see [`is_far`]. [`reciprocal_and_root`] takes all others to the processor.
//! * **First guess**: a constant less half of the bits of x, which halves the exponent and changes its sign
//!   (Lomont, *Fast inverse square root*, 2003, with his constant for double precision): within 3.5 %.
//! * **Refinement**: with s = x y², 1/√x = y s^(−1/2). The first polynomial of degree 2 in s has the least
//!   largest error on [0.932, 1.07]; the error is then below 2.5e-5. The second one is the Taylor series of
//!   (1 − r)^(−1/2) to r³, r = 1 − s, with an error below 2e-18.
//! * **Error**: below 1.8 units of 2⁻⁵³ of the value, 0.45 on average. A root by the processor and a division
//!   have at most 1.5 and 0.5 on average.
//! * **Bits**: the same on every processor. No product is fused with a sum, whatever the target of the build.

/// 0x5fe6eb50c7b537a9: Lomont's constant.
const GUESS: u64 = 0x5fe6_eb50_c7b5_37a9;
/// The coefficients of s⁰, s¹ and s² in the first refinement.
const FIRST: [f64; 3] = [1.876_598_34, -1.252_100_34, 0.375_502_21];

/// Whether a number is outside of the range of [`near`]: not positive, not normal, not finite.
#[inline(always)]
#[must_use]
pub fn is_far(x: f64) -> bool {
    !(f64::MIN_POSITIVE..=f64::MAX).contains(&x)
}

/// 1/√x for positive normal numbers. What it returns for others is no result.
#[inline(always)]
#[must_use]
pub fn near(x: f64) -> f64 {
    let y = f64::from_bits(GUESS.wrapping_sub(x.to_bits() >> 1));
    let s = x * y * y;
    let y = y * (FIRST[0] + s * (FIRST[1] + s * FIRST[2]));
    let r = 1.0 - x * y * y;
    y + y * (r * (0.5 + r * (0.375 + r * 0.3125)))
}

/// 1/√x and √x: as [`near`] has them in its range, elsewhere by a root and a division.
#[inline(always)]
#[must_use]
pub fn reciprocal_and_root(x: f64) -> (f64, f64) {
    if is_far(x) {
        return (by_division(x), crate::lanes::sines::sqrt(x));
    }
    let reciprocal = near(x);
    (reciprocal, x * reciprocal)
}

#[cold]
#[inline(never)]
fn by_division(x: f64) -> f64 {
    1.0 / crate::lanes::sines::sqrt(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// (1 − x y²)/2 in parts that are exact: the relative error of y.
    fn error(x: f64, y: f64) -> f64 {
        let halves = |a: f64| {
            let high = f64::from_bits(a.to_bits() & !0x7ff_ffff);
            [high, a - high]
        };
        // Scaled to x in [1, 4), where nothing is lost below the normal numbers.
        let even = (x.to_bits() >> 52).wrapping_sub(1023) as i64 >> 1;
        let (x, y) = (x * 0.25f64.powi(even as i32), y * 2f64.powi(even as i32));
        let square = y * y;
        let [high, low] = halves(y);
        let lost = ((high * high - square) + 2.0 * high * low) + low * low;
        let ([a, b], [c, d]) = (halves(x), halves(square));
        0.5 * ((((1.0 - a * c) - a * d) - b * c) - b * d - x * lost)
    }

    #[test]
    fn the_error_is_as_promised() {
        let (mut x, mut worst) = (f64::MIN_POSITIVE, 0.0f64);
        while x < 1e300 {
            for step in 0..40 {
                let x = x * (1.0 + f64::from(step) * 0.037_123);
                worst = worst.max(error(x, reciprocal_and_root(x).0).abs());
            }
            x *= 1.317_9;
        }
        let units = worst / (0.5 * f64::EPSILON);
        // It is not exact either: a comparison of a function with itself would pass this test as well.
        assert!(units > 0.9 && units < 1.8, "{units}");
    }

    #[test]
    fn numbers_out_of_range_are_divided() {
        for x in [0.0, -0.0, 5e-324, -1.0, f64::INFINITY, f64::NAN, f64::MIN_POSITIVE / 2.0] {
            assert!(is_far(x));
            let (found, expected) = (reciprocal_and_root(x).0, 1.0 / x.sqrt());
            assert!(found.to_bits() == expected.to_bits() || found.is_nan() && expected.is_nan(), "{x}");
            let (found, expected) = (reciprocal_and_root(x).1, x.sqrt());
            assert!(found.to_bits() == expected.to_bits() || found.is_nan() && expected.is_nan(), "{x}");
        }
        for x in [f64::MIN_POSITIVE, 1.0, f64::MAX] {
            assert!(!is_far(x) && (reciprocal_and_root(x).0 * x.sqrt() - 1.0).abs() < 4e-16, "{x}");
        }
    }
}

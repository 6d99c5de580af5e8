//! Sine and cosine of lanes, one number among them: reduction, kernels and quarter turns. Theory and errors
//! are in the head of `sin_cos.rs`.

use crate::lanes::Lanes;

/// (sin x, cos x) as the platform has them: within 0.6 units in the last place with the usual libraries, one
/// call.
#[inline(always)]
#[must_use]
pub fn accurate(x: f64) -> (f64, f64) {
    #[cfg(feature = "std")]
    {
        f64::sin_cos(x)
    }
    #[cfg(not(feature = "std"))]
    {
        libm::sincos(x)
    }
}

/// Largest |x| that is reduced here. Up to it k = 2x/π has at most 20 bits, so that k times a part of π/2
/// of 33 bits is exact.
pub(crate) const LARGEST_REDUCED: f64 = 1_048_576.0;

/// Whether the target multiplies and adds in one instruction; where it does not, `f64::mul_add` is a slow
/// library call.
#[doc(hidden)]
pub const FUSED: bool = cfg!(all(
    feature = "std",
    any(
        all(any(target_arch = "x86", target_arch = "x86_64"), target_feature = "fma"),
        all(target_arch = "aarch64", target_feature = "neon"),
        target_arch = "powerpc64",
        target_arch = "s390x",
    )
));

/// (sin x, cos x) within 0.8 units in the last place.
#[inline(always)]
#[must_use]
pub fn fast(x: f64) -> (f64, f64) {
    if !(-LARGEST_REDUCED..=LARGEST_REDUCED).contains(&x) {
        return far(x);
    }
    near(x)
}

/// [`fast`] where |x| ≤ [`LARGEST_REDUCED`] in every lane.
#[inline(always)]
pub(crate) fn near<L: Lanes>(x: L) -> (L, L) {
    let (quarter, r, c) = if L::FUSED { reduce_fused(x, L::times_plus) } else { reduce(x) };
    L::turn(quarter, sine(r, c), cosine(r, c))
}

#[cold]
#[inline(never)]
fn far(x: f64) -> (f64, f64) {
    accurate(x)
}

const TWO_OVER_PI: f64 = core::f64::consts::FRAC_2_PI;
/// 1.5·2⁵². Added to a number below 2⁵¹, it leaves the nearest integer in the last bits.
const ROUNDING_SHIFT: f64 = 6_755_399_441_055_744.0;

/// The nearest integer to 2x/π, as a number and in the last bits of one.
#[inline(always)]
fn nearest_quarter<L: Lanes>(x: L, plus: impl Fn(L, L, L) -> L) -> (L, L) {
    let shift = L::splat(ROUNDING_SHIFT);
    let shifted = plus(x, L::splat(TWO_OVER_PI), shift);
    (shifted - shift, shifted)
}

/// π/2 in a part of 53 bits, one of 33 bits, and what is left.
const FUSED_PARTS_OF_HALF_PI: [f64; 3] =
    bits([0x3FF9_21FB_5444_2D18, 0x3C91_A626_3310_0000, 0x3A71_701B_839A_2520]);
/// π/2 in two parts of 33 bits, and what is left: fdlibm's pio2_1, pio2_2, pio2_2t.
const PARTS_OF_HALF_PI: [f64; 3] =
    bits([0x3FF9_21FB_5440_0000, 0x3DD0_B461_1A60_0000, 0x3BA3_198A_2E03_7073]);
/// Coefficients of r³, r⁵, … of the sine: fdlibm's S1 to S6.
const SINE: [f64; 6] = bits([
    0xBFC5_5555_5555_5549,
    0x3F81_1111_1110_F8A6,
    0xBF2A_01A0_19C1_61D5,
    0x3EC7_1DE3_57B1_FE7D,
    0xBE5A_E5E6_8A2B_9CEB,
    0x3DE5_D93A_5ACF_D57C,
]);
/// Coefficients of r⁴, r⁶, … of the cosine: fdlibm's C1 to C6.
const COSINE: [f64; 6] = bits([
    0x3FA5_5555_5555_554C,
    0xBF56_C16C_16C1_5177,
    0x3EFA_01A0_19CB_1590,
    0xBE92_7E4F_809C_52AD,
    0x3E21_EE9E_BDB4_B1C4,
    0xBDA8_FAE9_BE88_38D4,
]);

/// Numbers of these bits.
const fn bits<const N: usize>(of: [u64; N]) -> [f64; N] {
    let (mut numbers, mut i) = ([0.0; N], 0);
    while i < N {
        numbers[i] = f64::from_bits(of[i]);
        i += 1;
    }
    numbers
}

/// x = kπ/2 + r − c, with a fused multiply–add. Returns k in the last bits of a number, r and c.
///
/// `first` is a multiple of 2⁻⁵³, w = k·middle is one of 2⁻⁸⁶ of at most 53 bits, |w| <
/// 2⁻³⁴. So r is exact below 2⁻³³, and `first` − r is w. Where r is larger, `first` is no smaller
/// than w, so that `first` − r is exact (Dekker). Both ways r − (`first` − w) is what rounding added to
/// r.
#[inline(always)]
fn reduce_fused<L: Lanes>(x: L, fused: impl Fn(L, L, L) -> L) -> (L, L, L) {
    let [high, middle, rest] = FUSED_PARTS_OF_HALF_PI;
    let (high, middle, rest) = (L::splat(high), L::splat(middle), L::splat(rest));
    let (k, quarter) = nearest_quarter(x, &fused);
    let first = fused(-k, high, x);
    let r = fused(-k, middle, first);
    (quarter, r, fused(k, rest, fused(k, middle, r - first)))
}

/// x = kπ/2 + r − c, by products that are exact. Returns k in the last bits of a number, r and c.
#[inline(always)]
fn reduce<L: Lanes>(x: L) -> (L, L, L) {
    let [part1, part2, rest] = PARTS_OF_HALF_PI;
    let (part1, part2, rest) = (L::splat(part1), L::splat(part2), L::splat(rest));
    let (k, quarter) = nearest_quarter(x, times_and_plus);
    let first = x - k * part1;
    let w = k * part2;
    let second = first - w;
    // What the subtraction rounded off joins the rest.
    let rest = k * rest - ((first - second) - w);
    let r = second - rest;
    (quarter, r, rest - (second - r))
}

/// ab + c with two roundings. Not a closure, which would be compiled without the instructions of the lanes.
#[inline(always)]
fn times_and_plus<L: Lanes>(a: L, b: L, c: L) -> L {
    a * b + c
}

/// ab + c, fused where that is one instruction of the build's target.
#[inline(always)]
pub(crate) fn times_plus(a: f64, b: f64, c: f64) -> f64 {
    #[cfg(feature = "std")]
    if FUSED {
        return a.mul_add(b, c);
    }
    a * b + c
}

/// √x.
#[inline(always)]
pub(crate) fn sqrt(x: f64) -> f64 {
    #[cfg(feature = "std")]
    {
        f64::sqrt(x)
    }
    #[cfg(not(feature = "std"))]
    {
        libm::sqrt(x)
    }
}

/// a₀ + a₁z + a₂z² + … with five or six coefficients by Estrin's scheme: three operations wait for
/// each other instead of five.
#[inline(always)]
fn polynomial<L: Lanes, const N: usize>(of: [f64; N], z: L) -> L {
    // One by one: `map` of an array is a call.
    let k = |i: usize| L::splat(of[i]);
    let plus = L::times_plus;
    let w = z * z;
    let last = if N == 6 { plus(z, k(5), k(4)) } else { k(4) };
    plus(w, plus(w, last, plus(z, k(3), k(2))), plus(z, k(1), k(0)))
}

/// sin(r − c) for |r| ≤ π/4: r − (c(1 − r²/2) − r³P(r²)), in the order that keeps the sign of
/// zero.
#[inline(always)]
fn sine<L: Lanes>(r: L, c: L) -> L {
    let z = r * r;
    let v = z * r;
    let of_c = c * L::times_plus(z, L::splat(-0.5), L::splat(1.0));
    if L::FUSED {
        return r - of_c.minus_product(v, polynomial(SINE, z));
    }
    // Without fused products the sum that the polynomial ends with costs 0.05 units in the last place: the
    // first coefficient is multiplied by itself.
    let [first, rest @ ..] = SINE;
    r - ((of_c - z * v * polynomial(rest, z)) - v * L::splat(first))
}

/// cos(r − c) for |r| ≤ π/4: 1 − r²/2, less what rounding added to it and less −rc − r⁴P(r²).
///
/// The last operation is a difference because compilers that vectorise swap the terms of sums.
#[inline(always)]
fn cosine<L: Lanes>(r: L, c: L) -> L {
    let (z, one, half) = (r * r, L::splat(1.0), L::splat(0.5) * r);
    let one_less = one.minus_product(half, r);
    let added = half.times_plus(r, one_less - one);
    one_less - added.minus_product(r, c).minus_product(z * z, polynomial(COSINE, z))
}

/// Sine and cosine a number of right angles further on; only the last two bits of the number count.
#[inline(always)]
pub(crate) fn turn(quarter: u64, sine: f64, cosine: f64) -> (f64, f64) {
    let odd = quarter & 1 == 1;
    let (s, c) = if odd { (cosine, sine) } else { (sine, cosine) };
    let sign = |bit: u64, x: f64| f64::from_bits(x.to_bits() ^ (bit >> 1 & 1) << 63);
    (sign(quarter, s), sign(quarter.wrapping_add(1), c))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Both reductions on every target: the fused one is slow without the instruction, but right.
    #[test]
    fn reductions_agree() {
        let mut x = 1.0e-3;
        while x < LARGEST_REDUCED {
            for x in [x, -x, x.next_up()] {
                let ((k, r, c), (k2, r2, c2)) = (reduce_fused(x, f64::mul_add), reduce(x));
                assert_eq!(k.to_bits(), k2.to_bits());
                // k times what the three parts of `reduce` leave of π/2, 2⁻¹²⁰ of it, and rounding of
                // c.
                let (rest, rounding) = (x.abs() * 1.0e-36, f64::EPSILON * c.abs().max(c2.abs()));
                assert!((r - r2 - (c - c2)).abs() <= rest + rounding, "{x}: {r} {c}, {r2} {c2}");
            }
            x *= 1.000_37;
        }
    }
}

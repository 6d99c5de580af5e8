//! Sine and cosine together, inlined and without a branch that depends on the angle. With the standard
//! library, this call takes most of the time of a small model. Derived models evaluate [`lanes`] of angles,
//! unless `#[model(sin_cos = accurate)]` asks for the standard library.
//!
//! * **Time** of a pair, against 11 ns of glibc's: four side by side 2.2 ns with fused products in vectors of
//!   four, 6 ns in plain x86-64; one by itself 8 ns and 10 ns. Alone in a chain of dependent operations: 20
//!   ns and 27 ns against 22 ns. Double pendulum with two: 0.6 and 0.75 of the time.
//! * **Range**: |x| ≤ 2²⁰ (about 10⁶); beyond, and for infinities and NaN, [`accurate`], the standard
//!   library's or `libm`'s.
//! * **Reduction**: k = round(2x/π), x − kπ/2 as a sum r + c of two numbers. With a fused multiply–add the
//!   first subtraction is exact, since it leaves a multiple of the last place of x smaller than one; π/2 in
//!   three parts of 53 bits is then enough. Without it π/2 is taken in three parts, of which the first two
//!   have 33 bits, so that k times them is exact (Cody, Waite, *Software Manual for the Elementary
//!   Functions*, 1980).
//! * **Kernels**: the minimax polynomials of Sun's fdlibm (`k_sin.c`, `k_cos.c`) on |r| ≤ π/4, with the
//!   correction c to first order.
//! * **Error**: below 0.8 units in the last place, of sine as of cosine, small values near multiples of π/2
//!   included (`tests/sin_cos.rs` compares with 70 digits).

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

/// Sines and cosines of several angles side by side, each the same as [`fast`] has it.
///
/// No branch depends on the angle, so compilers can evaluate two or four angles in one vector register. Four
/// then take little longer than one.
#[inline(always)]
#[must_use]
pub fn lanes<const N: usize>(x: [f64; N]) -> ([f64; N], [f64; N]) {
    let (mut sines, mut cosines) = ([0.0; N], [0.0; N]);
    let mut i = 0;
    while i < N {
        match N - i {
            1 => (sines[i], cosines[i]) = fast(x[i]),
            2 => place([i, i + 1], side_by_side([x[i], x[i + 1]]), &mut sines, &mut cosines),
            // Three are four, one of them twice: what is no vector takes longer than the vector.
            rest => {
                let at = core::array::from_fn(|k| i + if k < rest { k } else { rest - 1 });
                place::<4>(at, side_by_side(at.map(|k| x[k])), &mut sines, &mut cosines);
            }
        }
        i += 4;
    }
    (sines, cosines)
}

/// Writes sines and cosines to their places.
#[inline(always)]
fn place<const K: usize>(
    at: [usize; K],
    values: ([f64; K], [f64; K]),
    sines: &mut [f64],
    cosines: &mut [f64],
) {
    for ((at, s), c) in at.into_iter().zip(values.0).zip(values.1) {
        (sines[at], cosines[at]) = (s, c);
    }
}

/// One vector of angles.
#[inline(always)]
fn side_by_side<const K: usize>(x: [f64; K]) -> ([f64; K], [f64; K]) {
    let mut all_near = true;
    for x in x {
        all_near &= (-LARGEST_REDUCED..=LARGEST_REDUCED).contains(&x);
    }
    if all_near { each(x, near) } else { far_apart(x) }
}

#[cold]
#[inline(never)]
fn far_apart<const K: usize>(x: [f64; K]) -> ([f64; K], [f64; K]) {
    each(x, fast)
}

#[inline(always)]
fn each<const K: usize>(x: [f64; K], function: impl Fn(f64) -> (f64, f64)) -> ([f64; K], [f64; K]) {
    let (mut sines, mut cosines) = ([0.0; K], [0.0; K]);
    for i in 0..K {
        (sines[i], cosines[i]) = function(x[i]);
    }
    (sines, cosines)
}

/// [`fast`] where |x| ≤ [`LARGEST_REDUCED`].
#[inline(always)]
fn near(x: f64) -> (f64, f64) {
    let (quarter, r, c) = if FUSED { reduce_fused(x) } else { reduce(x) };
    turn(quarter, sine(r, c), cosine(r, c))
}

#[cold]
#[inline(never)]
fn far(x: f64) -> (f64, f64) {
    accurate(x)
}

pub(crate) const TWO_OVER_PI: f64 = core::f64::consts::FRAC_2_PI;
/// 1.5·2⁵². Added to a number below 2⁵¹, it leaves the nearest integer in the last bits.
pub(crate) const ROUNDING_SHIFT: f64 = 6_755_399_441_055_744.0;

/// The nearest integer to 2x/π, as a number and its last bits.
#[inline(always)]
fn nearest_quarter(x: f64) -> (f64, u64) {
    let shifted = x * TWO_OVER_PI + ROUNDING_SHIFT;
    (shifted - ROUNDING_SHIFT, shifted.to_bits())
}

/// π/2 in three parts of 53 bits each.
pub(crate) const FUSED_PARTS_OF_HALF_PI: [f64; 3] =
    bits([0x3FF9_21FB_5444_2D18, 0x3C91_A626_3314_5C07, 0xB91F_1976_B7ED_8FBC]);
/// π/2 in two parts of 33 bits, and what is left: fdlibm's pio2_1, pio2_2, pio2_2t.
pub(crate) const PARTS_OF_HALF_PI: [f64; 3] =
    bits([0x3FF9_21FB_5440_0000, 0x3DD0_B461_1A60_0000, 0x3BA3_198A_2E03_7073]);
/// Coefficients of r³, r⁵, … of the sine: fdlibm's S1 to S6.
pub(crate) const SINE: [f64; 6] = bits([
    0xBFC5_5555_5555_5549,
    0x3F81_1111_1110_F8A6,
    0xBF2A_01A0_19C1_61D5,
    0x3EC7_1DE3_57B1_FE7D,
    0xBE5A_E5E6_8A2B_9CEB,
    0x3DE5_D93A_5ACF_D57C,
]);
/// Coefficients of r⁴, r⁶, … of the cosine: fdlibm's C1 to C6.
pub(crate) const COSINE: [f64; 6] = bits([
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

/// x = kπ/2 + r + c, with a fused multiply–add. Returns the last bits of k, r and c.
#[inline(always)]
pub(crate) fn reduce_fused(x: f64) -> (u64, f64, f64) {
    let [high, low, rest] = FUSED_PARTS_OF_HALF_PI;
    let (k, quarter) = nearest_quarter(x);
    let first = fused(-k, high, x);
    let w = k * low;
    // Either of `first` and w can be the larger: the error of their difference in the form that does not care
    // (Knuth).
    let r = first - w;
    let of_w = first - r;
    let rounded = (first - (r + of_w)) - (w - of_w);
    (quarter, r, rounded - fused(k, rest, fused(k, low, -w)))
}

/// ab + c with one rounding.
#[inline(always)]
fn fused(a: f64, b: f64, c: f64) -> f64 {
    #[cfg(feature = "std")]
    {
        f64::mul_add(a, b, c)
    }
    #[cfg(not(feature = "std"))]
    {
        libm::fma(a, b, c)
    }
}

/// x = kπ/2 + r + c, by products that are exact. Returns the last bits of k, r and c.
#[inline(always)]
pub(crate) fn reduce(x: f64) -> (u64, f64, f64) {
    let [part1, part2, rest] = PARTS_OF_HALF_PI;
    let (k, quarter) = nearest_quarter(x);
    let first = x - k * part1;
    let w = k * part2;
    let second = first - w;
    // What the subtraction rounded off joins the rest.
    let rest = k * rest - ((first - second) - w);
    let r = second - rest;
    (quarter, r, (second - r) - rest)
}

/// ab + c, fused where that is one instruction.
#[inline(always)]
fn plus(a: f64, b: f64, c: f64) -> f64 {
    if FUSED { fused(a, b, c) } else { a * b + c }
}

/// sin(r + c) for |r| ≤ π/4.
#[inline(always)]
fn sine(r: f64, c: f64) -> f64 {
    let [s1, s2, s3, s4, s5, s6] = SINE;
    let z = r * r;
    let w = z * z;
    let polynomial = plus(w, plus(z, plus(z, s6, s5), s4), plus(z, s3, s2));
    let v = z * r;
    r - (plus(z, plus(-v, polynomial, 0.5 * c), -c) - v * s1)
}

/// cos(r + c) for |r| ≤ π/4.
#[inline(always)]
fn cosine(r: f64, c: f64) -> f64 {
    let [c1, c2, c3, c4, c5, c6] = COSINE;
    let z = r * r;
    let w = z * z;
    let polynomial = plus(w, plus(w, plus(z, c6, c5), plus(z, c4, c3)), plus(z, c2, c1));
    let half = 0.5 * z;
    let one_less = 1.0 - half;
    one_less + (((1.0 - one_less) - half) + plus(w, polynomial, -(r * c)))
}

/// Sine and cosine a number of right angles further on; only the last two bits of the number count.
#[inline(always)]
fn turn(quarter: u64, sine: f64, cosine: f64) -> (f64, f64) {
    let odd = quarter & 1 == 1;
    let (s, c) = if odd { (cosine, sine) } else { (sine, cosine) };
    let sign = |bit: u64, x: f64| f64::from_bits(x.to_bits() ^ (bit >> 1 & 1) << 63);
    (sign(quarter, s), sign(quarter.wrapping_add(1), c))
}

/// sin x, within 0.8 units in the last place.
#[inline(always)]
#[must_use]
pub fn sin(x: f64) -> f64 {
    fast(x).0
}

/// cos x, within 0.8 units in the last place.
#[inline(always)]
#[must_use]
pub fn cos(x: f64) -> f64 {
    fast(x).1
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
                let ((k, r, c), (k2, r2, c2)) = (reduce_fused(x), reduce(x));
                assert_eq!(k, k2);
                // k times what the three parts of `reduce` leave of π/2, 2⁻¹²⁰ of it, and rounding of c.
                let (rest, rounding) = (x.abs() * 1.0e-36, f64::EPSILON * c.abs().max(c2.abs()));
                assert!((r - r2 + (c - c2)).abs() <= rest + rounding, "{x}: {r} {c}, {r2} {c2}");
            }
            x *= 1.000_37;
        }
    }

    /// Alone or beside others, near and far: the same bits.
    #[test]
    fn beside_others_an_angle_has_the_same_sine() {
        fn check<const N: usize>(x: [f64; N]) {
            let (sines, cosines) = lanes(x);
            for (i, x) in x.into_iter().enumerate() {
                let (s, c) = fast(x);
                assert_eq!(
                    [sines[i], cosines[i]].map(f64::to_bits),
                    [s, c].map(f64::to_bits),
                    "{x}, {i} of {N}"
                );
            }
        }
        fn all(x: impl Fn(usize) -> f64) {
            check::<0>([]);
            check::<1>(core::array::from_fn(&x));
            check::<2>(core::array::from_fn(&x));
            check::<3>(core::array::from_fn(&x));
            check::<4>(core::array::from_fn(&x));
            check::<7>(core::array::from_fn(&x));
            check::<18>(core::array::from_fn(&x));
        }
        for k in 0..200 {
            all(|i| (k * 18 + i) as f64 * 0.017 - 30.0);
        }
        for far in [f64::NAN, f64::INFINITY, 1e300, -2e6, LARGEST_REDUCED, -0.0, 5e-324] {
            for at in 0..18 {
                all(|i| if i == at { far } else { 0.3 * i as f64 });
            }
        }
    }

    #[test]
    fn what_is_not_a_number_stays_so_and_zero_keeps_its_sign() {
        for x in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let (s, c) = fast(x);
            assert!(s.is_nan() && c.is_nan());
        }
        assert!(fast(-0.0).0.is_sign_negative() && fast(0.0).0.is_sign_positive());
        assert_eq!(fast(1e300), accurate(1e300));
        assert_eq!(fast(f64::MIN_POSITIVE), (f64::MIN_POSITIVE, 1.0));
        assert_eq!(fast(5e-324), (5e-324, 1.0));
        assert!((fast(LARGEST_REDUCED).0 - accurate(LARGEST_REDUCED).0).abs() < 1e-15);
    }
}

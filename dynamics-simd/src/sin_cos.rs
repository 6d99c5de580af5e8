//! Sine and cosine together, inlined and without a branch that depends on the angle. With the standard
//! library, this call takes most of the time of a small model. Derived models evaluate [`lanes`] of angles,
//! unless `#[model(sin_cos = accurate)]` asks for the standard library.
//!
//! * **Time** of a pair, against 17 ns of glibc's (28 November 2026, a Xeon of the Sapphire Rapids family):
//!   four side by side 2.2 ns each with fused products in vectors of four, 6.6 ns in plain x86-64; one by
//!   itself 8 ns and 14 ns. Alone in a chain of dependent operations: 20 ns and 28 ns against 27 ns.
//! * **Range**: |x| ≤ 2²⁰ (about 10⁶); beyond, and for infinities and NaN, [`accurate`], the standard
//!   library's or `libm`'s.
//! * **Reduction**: k = round(2x/π), x − kπ/2 as a difference r − c of two numbers. With a fused
//!   multiply–add the first subtraction is exact, since it leaves a multiple of the last place of x smaller
//!   than one; π/2 in parts of 53, 33 and 53 bits is then enough. Without it π/2 is taken in three parts,
//!   of which the first two have 33 bits, so that k times them is exact (Cody, Waite, *Software Manual for
//!   the Elementary Functions*, 1980).
//! * **Kernels**: the minimax polynomials of Sun's fdlibm (`k_sin.c`, `k_cos.c`) on |r| ≤ π/4, with the
//!   correction c to first order, by Estrin's scheme: few operations wait for each other.
//! * **Error**: below 0.8 units in the last place, of sine as of cosine, small values near multiples of π/2
//!   included (`tests/sin_cos.rs` compares with 70 digits).

use crate::lanes::Lanes;
use crate::lanes::sines::LARGEST_REDUCED;
use crate::lanes::sines::near as reduced;
pub use crate::lanes::sines::{FUSED, accurate, fast};
use crate::portable::Portable;

/// Whether an angle is outside of the range of [`near`].
#[inline(always)]
#[must_use]
pub fn is_far(x: f64) -> bool {
    !(-LARGEST_REDUCED..=LARGEST_REDUCED).contains(&x)
}

/// [`fast`] without its branch, for angles that are not [far](is_far): loops of it vectorise.
#[inline(always)]
#[must_use]
pub fn near(x: f64) -> (f64, f64) {
    reduced(x)
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
    if !all_near {
        return far_apart(x);
    }
    // Written as a vector: a compiler that looks for vectors in single numbers finds some of them, and moves
    // numbers to and fro.
    if K == Portable::COUNT {
        let (mut sines, mut cosines) = ([0.0; K], [0.0; K]);
        let (s, c) = reduced(Portable::load(&x));
        s.store(&mut sines);
        c.store(&mut cosines);
        return (sines, cosines);
    }
    each(x, reduced)
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

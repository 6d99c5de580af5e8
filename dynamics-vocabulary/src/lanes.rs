//! Four numbers side by side, in one or two vector registers. Accelerations of four states at once take
//! little longer than those of one, because most of the time of one is latency.
//!
//! Every operation rounds each lane as `f64` does and in the same order, sines and cosines too, so that
//! generated code gives the same bits side by side and one after the other (`tests/quick/language/sines.rs`).

use core::ops::{Add, Div, Mul, Neg, Sub};

use wide::{bytemuck, f64x4, u64x4};

use crate::sin_cos;

/// Number of lanes: one vector of four doubles, or two of two.
pub const COUNT: usize = 4;

/// Four numbers side by side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lanes(f64x4);

/// A vector of lanes, whose length is part of its type: `[Lanes; N]`.
pub trait Wide: Copy + PartialEq + core::fmt::Debug + Send + Sync + 'static {
    /// All elements zero.
    fn zeros() -> Self;
    /// The elements in order.
    fn as_slice(&self) -> &[Lanes];
    /// The elements in order, to be changed.
    fn as_mut_slice(&mut self) -> &mut [Lanes];
}

impl<const N: usize> Wide for [Lanes; N] {
    #[inline(always)]
    fn zeros() -> Self {
        [Lanes::ZERO; N]
    }
    #[inline(always)]
    fn as_slice(&self) -> &[Lanes] {
        self
    }
    #[inline(always)]
    fn as_mut_slice(&mut self) -> &mut [Lanes] {
        self
    }
}

/// Whether products and sums of vectors are fused where those of one number are, so that both round alike.
const ALIKE: bool =
    !sin_cos::FUSED || cfg!(any(target_arch = "x86", target_arch = "x86_64", target_arch = "aarch64"));

impl Lanes {
    /// 0 in every lane.
    pub const ZERO: Self = Self(f64x4::ZERO);

    /// The same number in every lane.
    #[inline(always)]
    #[must_use]
    pub fn splat(x: f64) -> Self {
        Self(f64x4::splat(x))
    }

    /// One number per lane.
    #[inline(always)]
    #[must_use]
    pub fn new(lanes: [f64; COUNT]) -> Self {
        Self(f64x4::new(lanes))
    }

    /// The number of every lane.
    #[inline(always)]
    #[must_use]
    pub fn to_array(self) -> [f64; COUNT] {
        self.0.to_array()
    }

    /// √x.
    #[inline(always)]
    #[must_use]
    pub fn sqrt(self) -> Self {
        Self(self.0.sqrt())
    }

    /// A function of one number, lane by lane.
    #[inline(always)]
    #[must_use]
    pub fn map(self, function: impl Fn(f64) -> f64) -> Self {
        Self::new(self.to_array().map(function))
    }

    /// A function of two numbers, lane by lane.
    #[inline(always)]
    #[must_use]
    pub fn zip(self, other: Self, function: impl Fn(f64, f64) -> f64) -> Self {
        let (a, b) = (self.to_array(), other.to_array());
        Self::new(core::array::from_fn(|i| function(a[i], b[i])))
    }

    /// These numbers in some lanes, in the others those of `other`.
    #[inline(always)]
    #[must_use]
    pub fn or(self, lanes: [bool; COUNT], other: Self) -> Self {
        let [a, b, c, d] = lanes;
        let bits = |lane| if lane { u64::MAX } else { 0 };
        let mask: f64x4 = bytemuck::cast(u64x4::new([bits(a), bits(b), bits(c), bits(d)]));
        Self(mask.bitselect(self.0, other.0))
    }

    /// Whether |x| > tolerance·|scale| in every lane; NaN is not.
    #[inline(always)]
    #[must_use]
    pub fn exceed(self, tolerance: f64, scale: Self) -> bool {
        self.0.abs().simd_gt(f64x4::splat(tolerance) * scale.0.abs()).all()
    }

    /// Whether x > tolerance·|scale| in every lane; NaN is not.
    #[inline(always)]
    #[must_use]
    pub fn exceed_signed(self, tolerance: f64, scale: Self) -> bool {
        self.0.simd_gt(f64x4::splat(tolerance) * scale.0.abs()).all()
    }

    /// (sin x, cos x), each as [`sin_cos::fast`] has it.
    #[inline(always)]
    #[must_use]
    pub fn sin_cos(self) -> (Self, Self) {
        let near = f64x4::splat(sin_cos::LARGEST_REDUCED).simd_ge(self.0.abs());
        if ALIKE && near.all() { self.near() } else { self.far(sin_cos::fast) }
    }

    /// (sin x, cos x), each as [`sin_cos::accurate`] has it.
    #[inline(always)]
    #[must_use]
    pub fn sin_cos_accurate(self) -> (Self, Self) {
        self.far(sin_cos::accurate)
    }

    #[cold]
    #[inline(never)]
    fn far(self, function: fn(f64) -> (f64, f64)) -> (Self, Self) {
        let both = self.to_array().map(function);
        (Self::new(both.map(|(sin, _)| sin)), Self::new(both.map(|(_, cos)| cos)))
    }

    /// The steps of [`sin_cos::fast`], on vectors: what the compiler makes of four numbers in an array takes
    /// three times as long.
    #[inline(always)]
    fn near(self) -> (Self, Self) {
        let (quarter, r, c) = if sin_cos::FUSED { self.reduce_fused() } else { self.reduce() };
        let (sine, cosine) = (sine(r, c), cosine(r, c));
        let one = u64x4::splat(1);
        let odd: f64x4 = bytemuck::cast(u64x4::splat(0) - (quarter & one));
        let sign = |quarter: u64x4, x: f64x4| -> Self {
            let bits: u64x4 = bytemuck::cast(x);
            Self(bytemuck::cast(bits ^ (((quarter >> 1u32) & one) << 63u32)))
        };
        (sign(quarter, odd.bitselect(cosine, sine)), sign(quarter + one, odd.bitselect(sine, cosine)))
    }

    /// [`sin_cos::reduce_fused`].
    #[inline(always)]
    fn reduce_fused(self) -> (u64x4, f64x4, f64x4) {
        let [high, low, rest] = sin_cos::FUSED_PARTS_OF_HALF_PI;
        let (x, high, low, rest) = (self.0, f64x4::splat(high), f64x4::splat(low), f64x4::splat(rest));
        let (k, quarter) = nearest_quarter(x);
        let first = (-k).mul_add(high, x);
        let w = k * low;
        let r = first - w;
        let of_w = first - r;
        let rounded = (first - (r + of_w)) - (w - of_w);
        (quarter, r, rounded - k.mul_add(rest, k.mul_add(low, -w)))
    }

    /// [`sin_cos::reduce`].
    #[inline(always)]
    fn reduce(self) -> (u64x4, f64x4, f64x4) {
        let [part1, part2, rest] = sin_cos::PARTS_OF_HALF_PI;
        let (x, part1, part2, rest) = (self.0, f64x4::splat(part1), f64x4::splat(part2), f64x4::splat(rest));
        let (k, quarter) = nearest_quarter(x);
        let first = x - k * part1;
        let w = k * part2;
        let second = first - w;
        let rest = k * rest - ((first - second) - w);
        let r = second - rest;
        (quarter, r, (second - r) - rest)
    }
}

#[inline(always)]
fn nearest_quarter(x: f64x4) -> (f64x4, u64x4) {
    let round = f64x4::splat(sin_cos::ROUNDING_SHIFT);
    let shifted = x * f64x4::splat(sin_cos::TWO_OVER_PI) + round;
    (shifted - round, bytemuck::cast(shifted))
}

/// ab + c, fused where that is one instruction.
#[inline(always)]
fn plus(a: f64x4, b: f64x4, c: f64x4) -> f64x4 {
    if sin_cos::FUSED { a.mul_add(b, c) } else { a * b + c }
}

/// sin(r + c) for |r| ≤ π/4.
#[inline(always)]
fn sine(r: f64x4, c: f64x4) -> f64x4 {
    // One by one: `map` of an array is a call.
    let k = |i: usize| f64x4::splat(sin_cos::SINE[i]);
    let (s1, s2, s3, s4, s5, s6) = (k(0), k(1), k(2), k(3), k(4), k(5));
    let z = r * r;
    let w = z * z;
    let polynomial = plus(w, plus(z, plus(z, s6, s5), s4), plus(z, s3, s2));
    let v = z * r;
    r - (plus(z, plus(-v, polynomial, f64x4::splat(0.5) * c), -c) - v * s1)
}

/// cos(r + c) for |r| ≤ π/4.
#[inline(always)]
fn cosine(r: f64x4, c: f64x4) -> f64x4 {
    // One by one: `map` of an array is a call.
    let k = |i: usize| f64x4::splat(sin_cos::COSINE[i]);
    let (c1, c2, c3, c4, c5, c6) = (k(0), k(1), k(2), k(3), k(4), k(5));
    let z = r * r;
    let w = z * z;
    let polynomial = plus(w, plus(w, plus(z, c6, c5), plus(z, c4, c3)), plus(z, c2, c1));
    let half = f64x4::splat(0.5) * z;
    let one = f64x4::splat(1.0);
    let one_less = one - half;
    one_less + (((one - one_less) - half) + plus(w, polynomial, -(r * c)))
}

/// An operation of two lanes.
macro_rules! operation {
    ($($trait:ident $function:ident $sign:tt)*) => {$(
        impl $trait for Lanes {
            type Output = Self;
            #[inline(always)]
            fn $function(self, other: Self) -> Self {
                Self(self.0 $sign other.0)
            }
        }
    )*};
}

operation! { Add add + Sub sub - Mul mul * Div div / }

impl Neg for Lanes {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bits(lanes: Lanes) -> [u64; COUNT] {
        lanes.to_array().map(f64::to_bits)
    }

    /// The same bits as one by one, in every quarter, near and far, and both ways of reduction.
    #[test]
    fn sines_beside_others_are_those_of_one() {
        let mut x = 1.0e-3;
        while x < sin_cos::LARGEST_REDUCED {
            let angles = [x, -x, x + 0.7, 2.0 - x];
            let (sines, cosines) = Lanes::new(angles).sin_cos();
            assert_eq!(bits(sines), angles.map(|x| sin_cos::fast(x).0.to_bits()), "{angles:?}");
            assert_eq!(bits(cosines), angles.map(|x| sin_cos::fast(x).1.to_bits()), "{angles:?}");
            let check = |(quarter, r, c): (u64x4, f64x4, f64x4), one: fn(f64) -> (u64, f64, f64)| {
                for (i, angle) in angles.into_iter().enumerate() {
                    assert_eq!(
                        (quarter.to_array()[i], r.to_array()[i], c.to_array()[i]),
                        one(angle),
                        "{angle}"
                    );
                }
            };
            check(Lanes::new(angles).reduce(), sin_cos::reduce);
            // Without the instruction a vector's product and sum round twice.
            if sin_cos::FUSED {
                check(Lanes::new(angles).reduce_fused(), sin_cos::reduce_fused);
            }
            x *= 1.003_7;
        }
        for far in [f64::NAN, f64::INFINITY, -2e6, sin_cos::LARGEST_REDUCED, 1e300, -0.0, 5e-324] {
            for at in 0..COUNT {
                let angles = core::array::from_fn(|i| if i == at { far } else { i as f64 });
                let ((sines, cosines), one) = (Lanes::new(angles).sin_cos(), angles.map(sin_cos::fast));
                for ((s, c), one) in sines.to_array().into_iter().zip(cosines.to_array()).zip(one) {
                    assert!(s.to_bits() == one.0.to_bits() || s.is_nan() && one.0.is_nan(), "{angles:?}");
                    assert!(c.to_bits() == one.1.to_bits() || c.is_nan() && one.1.is_nan(), "{angles:?}");
                }
            }
        }
    }

    /// One lane that does not is enough, as is one that is no number.
    #[test]
    fn what_exceeds_does_so_in_every_lane() {
        let scale = Lanes::splat(-2.0);
        assert!(Lanes::new([3.0, -3.0, 2.5, 9.0]).exceed(1.0, scale));
        assert!(!Lanes::new([3.0, -3.0, 2.5, 9.0]).exceed_signed(1.0, scale));
        assert!(Lanes::splat(3.0).exceed_signed(1.0, scale));
        for (at, bad) in [(0, 2.0), (1, f64::NAN), (2, -0.5), (3, 0.0)] {
            let mut lanes = [3.0; COUNT];
            lanes[at] = bad;
            assert!(!Lanes::new(lanes).exceed(1.0, scale) && !Lanes::new(lanes).exceed_signed(1.0, scale));
        }
    }
}

//! Four numbers in the vectors that the build's target has, on every target.

use core::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

use wide::{bytemuck, f64x4, u64x4};

use crate::lanes::sines as sin_cos;
use crate::lanes::{Code, Lanes};

/// Four numbers side by side, in one or two vector registers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Portable(f64x4);

/// One yes or no per lane: all bits of it, or none.
#[derive(Clone, Copy, Debug)]
pub struct PortableMask(f64x4);

/// Whether products and sums of vectors are fused where those of one number are, so that both round alike.
const IS_FUSED_ALIKE: bool =
    !sin_cos::FUSED || cfg!(any(target_arch = "x86", target_arch = "x86_64", target_arch = "aarch64"));

impl Lanes for Portable {
    const COUNT: usize = 4;
    type Mask = PortableMask;

    #[inline]
    fn call<C: Code>(code: C) -> C::Output {
        code.run()
    }
    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self(f64x4::splat(x))
    }
    #[inline(always)]
    fn load(from: &[f64]) -> Self {
        Self(f64x4::new([from[0], from[1], from[2], from[3]]))
    }
    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        to[..4].copy_from_slice(&self.0.to_array());
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt())
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.abs())
    }
    #[inline(always)]
    fn times_plus(self, b: Self, c: Self) -> Self {
        if !sin_cos::FUSED {
            return Self(self.0 * b.0 + c.0);
        }
        if IS_FUSED_ALIKE {
            return Self(self.0.mul_add(b.0, c.0));
        }
        let (a, b, c) = (self.0.to_array(), b.0.to_array(), c.0.to_array());
        Self(f64x4::new(core::array::from_fn(|i| sin_cos::times_plus(a[i], b[i], c[i]))))
    }
    #[inline(always)]
    fn less(self, other: Self) -> PortableMask {
        PortableMask(self.0.simd_lt(other.0))
    }
    #[inline(always)]
    fn at_most(self, other: Self) -> PortableMask {
        PortableMask(self.0.simd_le(other.0))
    }
    #[inline(always)]
    fn mask(bits: u32) -> PortableMask {
        let lane = |i: u32| if bits >> i & 1 == 1 { u64::MAX } else { 0 };
        PortableMask(bytemuck::cast(u64x4::new([lane(0), lane(1), lane(2), lane(3)])))
    }
    #[inline(always)]
    fn bits(mask: PortableMask) -> u32 {
        mask.0.to_bitmask()
    }
    #[inline(always)]
    fn or(self, mask: PortableMask, other: Self) -> Self {
        Self(mask.0.bitselect(self.0, other.0))
    }
    #[inline(always)]
    fn turn(quarter: Self, sine: Self, cosine: Self) -> (Self, Self) {
        let quarter: u64x4 = bytemuck::cast(quarter.0);
        let one = u64x4::splat(1);
        let odd: f64x4 = bytemuck::cast(u64x4::splat(0) - (quarter & one));
        let sign = |quarter: u64x4, x: f64x4| -> Self {
            let bits: u64x4 = bytemuck::cast(x);
            Self(bytemuck::cast(bits ^ (((quarter >> 1u32) & one) << 63u32)))
        };
        (sign(quarter, odd.bitselect(cosine.0, sine.0)), sign(quarter + one, odd.bitselect(sine.0, cosine.0)))
    }
}

/// An operation of two vectors.
macro_rules! operations {
    ($($trait:ident $function:ident $sign:tt)*) => {$(
        impl $trait for Portable {
            type Output = Self;
            #[inline(always)]
            fn $function(self, other: Self) -> Self {
                Self(self.0 $sign other.0)
            }
        }
    )*};
}

operations! { Add add + Sub sub - Mul mul * Div div / }

impl Neg for Portable {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl BitAnd for PortableMask {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

impl BitOr for PortableMask {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl Not for PortableMask {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        let bits: u64x4 = bytemuck::cast(self.0);
        Self(bytemuck::cast(bits ^ u64x4::splat(u64::MAX)))
    }
}

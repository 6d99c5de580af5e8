//! Two vectors as one: twice the lanes.

use core::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

use crate::lanes::{Code, Lanes};

/// Two vectors. While one waits for the result of an operation the other goes on: twice as many lanes take
/// less than twice as long, where the registers suffice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pair<L>(L, L);

/// The masks of two vectors.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PairMask<M>(M, M);

macro_rules! of_both {
    ($($trait:ident $function:ident),+) => {$(
        impl<L: Lanes> $trait for Pair<L> {
            type Output = Self;
            #[inline(always)]
            fn $function(self, other: Self) -> Self {
                Self(self.0.$function(other.0), self.1.$function(other.1))
            }
        }
    )+};
}
of_both! { Add add, Sub sub, Mul mul, Div div }

impl<L: Lanes> Neg for Pair<L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0, -self.1)
    }
}

impl<M: BitAnd<Output = M>> BitAnd for PairMask<M> {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0, self.1 & other.1)
    }
}

impl<M: BitOr<Output = M>> BitOr for PairMask<M> {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0, self.1 | other.1)
    }
}

impl<M: Not<Output = M>> Not for PairMask<M> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(!self.0, !self.1)
    }
}

impl<L: Lanes> Lanes for Pair<L> {
    const COUNT: usize = 2 * L::COUNT;
    const FUSED: bool = L::FUSED;
    type Mask = PairMask<L::Mask>;

    #[inline(always)]
    fn call<C: Code>(code: C) -> C::Output {
        L::call(code)
    }
    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self(L::splat(x), L::splat(x))
    }
    #[inline(always)]
    fn load(from: &[f64]) -> Self {
        Self(L::load(from), L::load(&from[L::COUNT..]))
    }
    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        self.0.store(to);
        self.1.store(&mut to[L::COUNT..]);
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt(), self.1.sqrt())
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.abs(), self.1.abs())
    }
    #[inline(always)]
    fn times_plus(self, b: Self, c: Self) -> Self {
        Self(self.0.times_plus(b.0, c.0), self.1.times_plus(b.1, c.1))
    }
    #[inline(always)]
    fn less(self, other: Self) -> Self::Mask {
        PairMask(self.0.less(other.0), self.1.less(other.1))
    }
    #[inline(always)]
    fn at_most(self, other: Self) -> Self::Mask {
        PairMask(self.0.at_most(other.0), self.1.at_most(other.1))
    }
    #[inline(always)]
    fn mask(bits: u32) -> Self::Mask {
        PairMask(L::mask(bits), L::mask(bits >> L::COUNT))
    }
    #[inline(always)]
    fn bits(mask: Self::Mask) -> u32 {
        L::bits(mask.0) | L::bits(mask.1) << L::COUNT
    }
    #[inline(always)]
    fn or(self, mask: Self::Mask, other: Self) -> Self {
        Self(self.0.or(mask.0, other.0), self.1.or(mask.1, other.1))
    }
    #[inline(always)]
    fn turn(quarter: Self, sine: Self, cosine: Self) -> (Self, Self) {
        let (a, b) = L::turn(quarter.0, sine.0, cosine.0);
        let (c, d) = L::turn(quarter.1, sine.1, cosine.1);
        (Self(a, c), Self(b, d))
    }
}

//! The traits of numbers side by side, and one number as lanes.

pub(crate) mod sines;

use core::fmt::Debug;
use core::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

use sines::LARGEST_REDUCED;

/// Numbers side by side, [`Lanes::COUNT`] of them. Accelerations of four states at once take little longer
/// than those of one, because most of the time of one is latency.
///
/// All functions are inlined into the [`Code`] that calls them: only there the compiler may use the
/// instructions of the type.
pub trait Lanes:
    Copy
    + Debug
    + PartialEq
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// How many numbers.
    const COUNT: usize;
    /// Whether [`Lanes::times_plus`] rounds once: where the target of the build has an instruction for it
    /// ([`FUSED`](crate::sin_cos::FUSED)), and in [`in_fused_lanes`](crate::in_fused_lanes).
    const FUSED: bool = sines::FUSED;
    /// One yes or no per lane.
    type Mask: Copy + BitAnd<Output = Self::Mask> + BitOr<Output = Self::Mask> + Not<Output = Self::Mask>;

    /// Runs code in a function that may use the instructions of these lanes.
    fn call<C: Code>(code: C) -> C::Output;
    /// The same number in every lane.
    fn splat(x: f64) -> Self;
    /// The first [`Lanes::COUNT`] numbers of a slice.
    fn load(from: &[f64]) -> Self;
    /// Writes the numbers to the first [`Lanes::COUNT`] places of a slice.
    fn store(self, to: &mut [f64]);
    /// √x.
    #[must_use]
    fn sqrt(self) -> Self;
    /// |x|.
    #[must_use]
    fn abs(self) -> Self;
    /// self·b + c: with one rounding if [`Lanes::FUSED`], else with two.
    #[must_use]
    fn times_plus(self, b: Self, c: Self) -> Self;
    /// self·b − c, rounded as [`Lanes::times_plus`].
    #[inline(always)]
    #[must_use]
    fn times_minus(self, b: Self, c: Self) -> Self {
        if Self::FUSED { self.times_plus(b, -c) } else { self * b - c }
    }
    /// self − a·b, rounded as [`Lanes::times_plus`].
    #[inline(always)]
    #[must_use]
    fn minus_product(self, a: Self, b: Self) -> Self {
        if Self::FUSED { (-a).times_plus(b, self) } else { self - a * b }
    }
    /// self < other, lane by lane; false for NaN.
    fn less(self, other: Self) -> Self::Mask;
    /// self ≤ other, lane by lane; false for NaN.
    fn at_most(self, other: Self) -> Self::Mask;
    /// The mask whose lane i is bit i.
    fn mask(bits: u32) -> Self::Mask;
    /// A mask as bits.
    fn bits(mask: Self::Mask) -> u32;
    /// These numbers in the lanes of the mask, in the others those of `other`.
    #[must_use]
    fn or(self, mask: Self::Mask, other: Self) -> Self;
    /// Sine and cosine a number of right angles further on: the last two bits of `quarter`.
    fn turn(quarter: Self, sine: Self, cosine: Self) -> (Self, Self);

    /// 0 in every lane.
    #[inline(always)]
    #[must_use]
    fn zero() -> Self {
        Self::splat(0.0)
    }
    /// The number of one lane.
    #[inline(always)]
    #[must_use]
    fn lane(self, lane: usize) -> f64 {
        self.array()[..Self::COUNT][lane]
    }
    /// This number in one lane, the others as they are.
    #[inline(always)]
    #[must_use]
    fn with_lane(self, lane: usize, x: f64) -> Self {
        let mut array = self.array();
        array[..Self::COUNT][lane] = x;
        Self::load(&array)
    }
    /// A function of one number, lane by lane.
    #[inline(always)]
    #[must_use]
    fn map(self, function: impl Fn(f64) -> f64) -> Self {
        let mut array = self.array();
        for x in &mut array[..Self::COUNT] {
            *x = function(*x);
        }
        Self::load(&array)
    }
    /// A function of two numbers, lane by lane.
    #[inline(always)]
    #[must_use]
    fn zip(self, other: Self, function: impl Fn(f64, f64) -> f64) -> Self {
        let (mut array, others) = (self.array(), other.array());
        for (x, y) in array[..Self::COUNT].iter_mut().zip(others) {
            *x = function(*x, y);
        }
        Self::load(&array)
    }
    /// The numbers in order, and zeros after them.
    #[inline(always)]
    #[must_use]
    fn array(self) -> [f64; MAX_COUNT] {
        let mut array = [0.0; MAX_COUNT];
        self.store(&mut array);
        array
    }
    /// Whether every lane of a mask says yes.
    #[inline(always)]
    #[must_use]
    fn all(mask: Self::Mask) -> bool {
        Self::bits(mask) == u32::MAX >> (u32::BITS - Self::COUNT as u32)
    }
    /// Whether |x| > tolerance·|scale| in every lane; NaN is not.
    #[inline(always)]
    #[must_use]
    fn exceed(self, tolerance: f64, scale: Self) -> bool {
        self.abs().exceed_signed(tolerance, scale)
    }
    /// Whether x > tolerance·|scale| in every lane; NaN is not.
    #[inline(always)]
    #[must_use]
    fn exceed_signed(self, tolerance: f64, scale: Self) -> bool {
        Self::all((Self::splat(tolerance) * scale.abs()).less(self))
    }
    /// (sin x, cos x), each as [`fast`](crate::sin_cos::fast) has it.
    #[inline(always)]
    #[must_use]
    fn sin_cos(self) -> (Self, Self) {
        let near = Self::all(self.abs().at_most(Self::splat(LARGEST_REDUCED)));
        if near { sines::near(self) } else { some_far(self) }
    }
    /// (sin x, cos x), each as [`accurate`](crate::sin_cos::accurate) has it.
    #[inline(always)]
    #[must_use]
    fn sin_cos_accurate(self) -> (Self, Self) {
        one_by_one(self, sines::accurate)
    }
}

/// Most lanes of a type.
pub(crate) const MAX_COUNT: usize = 16;

/// [`Lanes::sin_cos`] where some angles are too far for the reduction: the others have the bits that they
/// have without these.
#[cold]
#[inline(never)]
fn some_far<L: Lanes>(x: L) -> (L, L) {
    let near = x.abs().at_most(L::splat(LARGEST_REDUCED));
    let (mut sine, mut cosine) = sines::near(x.or(near, L::zero()));
    for lane in (0..L::COUNT).filter(|lane| L::bits(near) >> lane & 1 == 0) {
        let (s, c) = sines::accurate(x.lane(lane));
        (sine, cosine) = (sine.with_lane(lane, s), cosine.with_lane(lane, c));
    }
    (sine, cosine)
}

/// Both results of a function, lane by lane.
#[inline(always)]
fn one_by_one<L: Lanes>(x: L, function: fn(f64) -> (f64, f64)) -> (L, L) {
    let (sines, cosines) = each(x.array(), L::COUNT, function);
    (L::load(&sines), L::load(&cosines))
}

/// The first `count` angles. A function of its own, so that a rare or slow way is not copied everywhere.
#[cold]
#[inline(never)]
fn each(
    x: [f64; MAX_COUNT],
    count: usize,
    function: fn(f64) -> (f64, f64),
) -> ([f64; MAX_COUNT], [f64; MAX_COUNT]) {
    let (mut sines, mut cosines) = ([0.0; MAX_COUNT], [0.0; MAX_COUNT]);
    for i in 0..count {
        (sines[i], cosines[i]) = function(x[i]);
    }
    (sines, cosines)
}

/// A vector of lanes, whose length is part of its type: `[L; N]`.
pub trait Wide<L>: Copy + PartialEq + Debug + Send + Sync + 'static {
    /// All elements zero.
    fn zeros() -> Self;
    /// The elements in order.
    fn as_slice(&self) -> &[L];
    /// The elements in order, to be changed.
    fn as_mut_slice(&mut self) -> &mut [L];
}

impl<L: Lanes, const N: usize> Wide<L> for [L; N] {
    #[inline(always)]
    fn zeros() -> Self {
        [L::zero(); N]
    }
    #[inline(always)]
    fn as_slice(&self) -> &[L] {
        self
    }
    #[inline(always)]
    fn as_mut_slice(&mut self) -> &mut [L] {
        self
    }
}

/// Code that uses some type of lanes, for [`Lanes::call`].
///
/// Implementations are `#[inline(always)]`, as is all that they call in hot places: a function that is not
/// inlined is compiled without the instructions of the lanes.
pub trait Code {
    /// What it returns.
    type Output;
    /// The code.
    fn run(self) -> Self::Output;
}

/// One number: what lanes are compared with.
impl Lanes for f64 {
    const COUNT: usize = 1;
    type Mask = bool;

    #[inline]
    fn call<C: Code>(code: C) -> C::Output {
        code.run()
    }
    #[inline(always)]
    fn splat(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn load(from: &[f64]) -> Self {
        from[0]
    }
    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        to[0] = self;
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        sines::sqrt(self)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }
    #[inline(always)]
    fn times_plus(self, b: Self, c: Self) -> Self {
        sines::times_plus(self, b, c)
    }
    #[inline(always)]
    fn less(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn at_most(self, other: Self) -> bool {
        self <= other
    }
    #[inline(always)]
    fn mask(bits: u32) -> bool {
        bits & 1 == 1
    }
    #[inline(always)]
    fn bits(mask: bool) -> u32 {
        u32::from(mask)
    }
    #[inline(always)]
    fn or(self, mask: bool, other: Self) -> Self {
        if mask { self } else { other }
    }
    #[inline(always)]
    fn turn(quarter: Self, sine: Self, cosine: Self) -> (Self, Self) {
        sines::turn(quarter.to_bits(), sine, cosine)
    }
}

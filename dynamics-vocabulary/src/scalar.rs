//! The element types of vectors and matrices: numbers and time jets.

use core::fmt::Debug;
use core::ops::{Add, Div, Mul, Neg, Sub};

use crate::expr::Expr;
use crate::math;

mod sealed {
    pub trait Sealed {}
    impl Sealed for f64 {}
    impl Sealed for crate::expr::Expr {}
}

/// A component of [`Vec2`](crate::Vec2), [`Vec3`](crate::Vec3) and [`Mat3`](crate::Mat3): `f64` in
/// parameters, [`Expr`] in what moves.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a scalar; vectors and matrices are made of and scaled by `f64` and `Expr`",
    label = "neither `f64` nor `Expr`",
    note = "write whole numbers with a point: `2.0`, and indices as `f64::from(i)` or `i as f64`"
)]
pub trait Scalar:
    sealed::Sealed + Copy + Debug + Default + Into<Expr> + With<Self, Mixed = Self> + Neg<Output = Self>
{
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;
    /// The value.
    fn value(self) -> f64;
    /// The value of the first time derivative; 0 for `f64`.
    fn rate(self) -> f64;
    /// The time derivative; 0 for `f64`.
    #[must_use]
    fn dt(self) -> Self;
    /// Square root.
    #[must_use]
    fn sqrt(self) -> Self;
    /// Sine and cosine.
    #[must_use]
    fn sin_cos(self) -> (Self, Self);
}

/// Arithmetic between two kinds of scalar: if one of them is an [`Expr`], so is the result.
pub trait With<B>:
    Sized
    + Add<B, Output = Self::Mixed>
    + Sub<B, Output = Self::Mixed>
    + Mul<B, Output = Self::Mixed>
    + Div<B, Output = Self::Mixed>
{
    /// The kind of the result.
    type Mixed: Scalar;
}

/// The kind of what `A` and `B` combine to.
pub type Mixed<A, B> = <A as With<B>>::Mixed;

impl With<f64> for f64 {
    type Mixed = f64;
}
impl With<Expr> for f64 {
    type Mixed = Expr;
}
impl With<f64> for Expr {
    type Mixed = Expr;
}
impl With<Expr> for Expr {
    type Mixed = Expr;
}

impl Scalar for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    #[inline(always)]
    fn value(self) -> f64 {
        self
    }
    #[inline(always)]
    fn rate(self) -> f64 {
        0.0
    }
    #[inline(always)]
    fn dt(self) -> Self {
        0.0
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        math::sqrt(self)
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        math::sin_cos(self)
    }
}

impl Scalar for Expr {
    const ZERO: Self = Expr::ZERO;
    const ONE: Self = Expr::ONE;
    #[inline(always)]
    fn value(self) -> f64 {
        Expr::value(self)
    }
    #[inline(always)]
    fn rate(self) -> f64 {
        Expr::rate(self)
    }
    #[inline(always)]
    fn dt(self) -> Self {
        Expr::dt(self)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Expr::sqrt(self)
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        Expr::sin_cos(self)
    }
}

//! Arithmetic and comparison of time jets, with each other and with `f64`, by value and by reference as `f64`
//! has them.

use core::cmp::Ordering;
use core::iter::Sum;
use core::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use super::Expr;

impl Expr {
    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            first: self.first + other.first,
            second: self.second + other.second,
            beyond: self.beyond + other.beyond,
        }
    }

    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        self.plus(-other)
    }

    /// Leibniz: (xy)˙ = ẋy + xẏ, (xy)¨ = ẍy + 2ẋẏ + xÿ.
    #[inline(always)]
    fn times(self, other: Self) -> Self {
        Self {
            value: self.value * other.value,
            first: self.first * other.value + self.value * other.first,
            second: self.second * other.value + 2.0 * (self.first * other.first) + self.value * other.second,
            beyond: self.product_beyond(other),
        }
    }

    /// The product of two polynomials of degree at most 2 has no third and fourth derivative where all of
    /// 3(ẍẏ + ẋÿ) and 6ẍÿ vanish, factor by factor: a product that merely underflows does not.
    #[inline(always)]
    fn product_beyond(self, other: Self) -> f64 {
        let known = self.beyond == 0.0 && other.beyond == 0.0;
        let low_degree =
            (self.second == 0.0 && other.second == 0.0) || self.is_constant() || other.is_constant();
        if known && low_degree { 0.0 } else { f64::NAN }
    }

    /// z = x/y from x = zy: ż = (ẋ − zẏ)/y, z̈ = (ẍ − 2żẏ − zÿ)/y.
    #[inline(always)]
    fn over(self, other: Self) -> Self {
        let value = self.value / other.value;
        if other.is_constant() {
            if self.is_constant() {
                return Self::constant(value);
            }
            let beyond = self.beyond;
            return Self {
                value,
                first: self.first / other.value,
                second: self.second / other.value,
                beyond,
            };
        }
        let first = (self.first - value * other.first) / other.value;
        let second = (self.second - 2.0 * (first * other.first) - value * other.second) / other.value;
        Self { value, first, second, beyond: f64::NAN }
    }
}

impl Neg for Expr {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { value: -self.value, first: -self.first, second: -self.second, beyond: -self.beyond }
    }
}

impl Neg for &Expr {
    type Output = Expr;
    #[inline(always)]
    fn neg(self) -> Expr {
        -*self
    }
}

macro_rules! operator {
    ($($trait:ident $function:ident $assign_trait:ident $assign:ident $method:ident),* $(,)?) => {$(
        operator!(@pair $trait $function $method: Expr, Expr);
        operator!(@pair $trait $function $method: Expr, f64);
        operator!(@pair $trait $function $method: f64, Expr);
        operator!(@assign $assign_trait $assign $method: Expr);
        operator!(@assign $assign_trait $assign $method: f64);
    )*};
    (@pair $trait:ident $function:ident $method:ident: $left:ty, $right:ty) => {
        operator!(@one $trait $function $method: $left, $right);
        operator!(@one $trait $function $method: &$left, $right);
        operator!(@one $trait $function $method: $left, &$right);
        operator!(@one $trait $function $method: &$left, &$right);
    };
    (@one $trait:ident $function:ident $method:ident: $left:ty, $right:ty) => {
        impl $trait<$right> for $left {
            type Output = Expr;
            #[inline(always)]
            #[allow(clippy::clone_on_copy, reason = "the operands are values or references")]
            fn $function(self, other: $right) -> Expr {
                Expr::from(self.clone()).$method(Expr::from(other.clone()))
            }
        }
    };
    (@assign $trait:ident $function:ident $method:ident: $right:ty) => {
        impl $trait<$right> for Expr {
            #[inline(always)]
            fn $function(&mut self, other: $right) {
                *self = self.$method(Expr::from(other));
            }
        }
        impl $trait<&$right> for Expr {
            #[inline(always)]
            fn $function(&mut self, other: &$right) {
                *self = self.$method(Expr::from(*other));
            }
        }
    };
}

operator! {
    Add add AddAssign add_assign plus,
    Sub sub SubAssign sub_assign minus,
    Mul mul MulAssign mul_assign times,
    Div div DivAssign div_assign over,
}

impl Sum for Expr {
    fn sum<I: Iterator<Item = Self>>(terms: I) -> Self {
        terms.fold(Self::ZERO, Self::plus)
    }
}

impl<'a> Sum<&'a Expr> for Expr {
    fn sum<I: Iterator<Item = &'a Expr>>(terms: I) -> Self {
        terms.copied().sum()
    }
}

impl Sum<f64> for Expr {
    fn sum<I: Iterator<Item = f64>>(terms: I) -> Self {
        Self::constant(terms.sum())
    }
}

macro_rules! compare {
    ($($left:ty, $right:ty);* $(;)?) => {$(
        impl PartialEq<$right> for $left {
            #[inline(always)]
            fn eq(&self, other: &$right) -> bool {
                Expr::from(*self).value == Expr::from(*other).value
            }
        }
        impl PartialOrd<$right> for $left {
            #[inline(always)]
            fn partial_cmp(&self, other: &$right) -> Option<Ordering> {
                Expr::from(*self).value.partial_cmp(&Expr::from(*other).value)
            }
        }
    )*};
}

compare! { Expr, Expr; Expr, f64; f64, Expr }

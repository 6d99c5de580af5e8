//! The time derivative of arrays and tuples of [`Expr`], vectors and matrices, and of parameters.

use crate::expr::Expr;
use crate::matrix::Mat3;
use crate::scalar::Scalar;
use crate::vector::{Vec2, Vec3};

/// `.dt()` for every value in a model's function, element by element; 0 for parameters.
///
/// [`Expr`], the vectors and the matrices have it as a method of their own; the trait adds `f64`, arrays and
/// tuples.
///
/// ```
/// # use dynamics_vocabulary as dynamics;
/// use dynamics::{Expr, TimeDerivative, vec2};
///
/// let theta = [Expr::coordinate(0.1, 2.0, 0.0), Expr::coordinate(0.2, 3.0, 0.0)];
/// let [first, second] = theta.dt();
/// assert_eq!((first.value(), second.value()), (2.0, 3.0));
/// let (place, length) = (vec2(theta[0], 1.0), 0.5).dt();
/// assert_eq!((place.x.value(), length), (2.0, 0.0));
/// ```
pub trait TimeDerivative {
    /// The total time derivative.
    #[must_use]
    fn dt(self) -> Self;
}

impl TimeDerivative for f64 {
    /// A parameter does not change while the model moves.
    #[inline(always)]
    fn dt(self) -> Self {
        0.0
    }
}

impl TimeDerivative for Expr {
    #[inline(always)]
    fn dt(self) -> Self {
        Expr::dt(self)
    }
}

macro_rules! inherent {
    ($($Kind:ident),*) => {$(
        impl<T: Scalar> TimeDerivative for $Kind<T> {
            #[inline(always)]
            fn dt(self) -> Self {
                $Kind::dt(self)
            }
        }
    )*};
}
inherent! { Vec2, Vec3, Mat3 }

impl<T: TimeDerivative, const N: usize> TimeDerivative for [T; N] {
    #[inline]
    fn dt(self) -> Self {
        self.map(T::dt)
    }
}

macro_rules! tuple {
    ($($($Item:ident)*;)*) => {$(
        impl<$($Item: TimeDerivative),*> TimeDerivative for ($($Item,)*) {
            #[inline]
            #[allow(non_snake_case, reason = "the variables are named like the types of the elements")]
            fn dt(self) -> Self {
                let ($($Item,)*) = self;
                ($($Item.dt(),)*)
            }
        }
    )*};
}
tuple! {
    A;
    A B;
    A B C;
    A B C D;
    A B C D E;
    A B C D E F;
}

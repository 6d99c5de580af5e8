//! Applied forces of a model.
//!
//! The equations of motion need the generalized components Q = (∂r/∂q)ᵀF of a force. They are derived
//! when the model is compiled. At run time a `Force` contains only its power.

use core::iter::Sum;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use crate::expr::Expr;
use crate::scalar::Scalar;
use crate::vector::{Vec2, Vec3};

/// A force, a moment, any generalized force, or a sum of them: what `#[force]` functions return.
///
/// ```
/// # use dynamics_vocabulary as dynamics;
/// use dynamics::{Expr, Force, vec2};
///
/// let x = Expr::coordinate(1.0, 3.0, 0.0);
/// let weight = Force::at(vec2(x, 2.0 * x), vec2(0.0, -10.0));
/// let drag = Force::along(x, -0.5 * x.dt());
/// assert_eq!(weight.power(), -60.0);
/// assert_eq!((weight + drag).power(), -64.5);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Force {
    power: f64,
}

impl Force {
    /// No force; the start of sums.
    pub const ZERO: Self = Self { power: 0.0 };

    /// A force vector F acting at the point r, both of the plane or both of space, in the same inertial
    /// frame.
    ///
    /// Its power is F·ṙ, its generalized components are (∂r/∂q)ᵀF.
    #[inline]
    #[must_use]
    pub fn at<P: Place, F: Place<Space = P::Space>>(point: P, vector: F) -> Self {
        let (velocity, vector) = (point.components().map(Expr::rate), vector.components().map(Expr::value));
        Self { power: velocity[0] * vector[0] + velocity[1] * vector[1] + velocity[2] * vector[2] }
    }

    /// A generalized force of this magnitude, work-conjugate to the expression e: a moment to an angle, a
    /// tension to a length (positive where it acts toward growing e), a pressure to a volume.
    ///
    /// Its power is magnitude·ė, its generalized components are magnitude·∂e/∂q.
    #[inline]
    #[must_use]
    pub fn along(expression: impl Into<Expr>, magnitude: impl Into<Expr>) -> Self {
        Self { power: magnitude.into().value() * expression.into().rate() }
    }

    /// The work done on the system per unit of time; NaN where the rate of a point is not known.
    #[inline]
    #[must_use]
    pub const fn power(self) -> f64 {
        self.power
    }
}

/// A vector of the plane or of space: where a force acts and what it is.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a vector; a force acts at a `Vec2` or a `Vec3` and is one",
    label = "not a `Vec2` or `Vec3`",
    note = "a moment or any other generalized force is `Force::along(expression, magnitude)`"
)]
pub trait Place: sealed::Sealed {
    /// Distinguishes the plane from space.
    type Space;
    /// The Cartesian components; z = 0 in the plane.
    fn components(self) -> [Expr; 3];
}

/// Vectors of the plane.
#[derive(Clone, Copy, Debug)]
pub enum Plane {}

/// Vectors of space.
#[derive(Clone, Copy, Debug)]
pub enum Spatial {}

mod sealed {
    pub trait Sealed {}
    impl<T> Sealed for crate::vector::Vec2<T> {}
    impl<T> Sealed for crate::vector::Vec3<T> {}
}

impl<T: Scalar> Place for Vec2<T> {
    type Space = Plane;
    #[inline]
    fn components(self) -> [Expr; 3] {
        [self.x.into(), self.y.into(), Expr::ZERO]
    }
}

impl<T: Scalar> Place for Vec3<T> {
    type Space = Spatial;
    #[inline]
    fn components(self) -> [Expr; 3] {
        self.map(T::into).to_array()
    }
}

impl Add for Force {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Self { power: self.power + other.power }
    }
}

impl Sub for Force {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        Self { power: self.power - other.power }
    }
}

impl Neg for Force {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self { power: -self.power }
    }
}

impl AddAssign for Force {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Force {
    #[inline]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl<S: Scalar> Mul<S> for Force {
    type Output = Self;
    #[inline]
    fn mul(self, factor: S) -> Self {
        Self { power: self.power * factor.value() }
    }
}

impl<S: Scalar> Div<S> for Force {
    type Output = Self;
    #[inline]
    fn div(self, divisor: S) -> Self {
        Self { power: self.power / divisor.value() }
    }
}

impl Mul<Force> for f64 {
    type Output = Force;
    #[inline]
    fn mul(self, force: Force) -> Force {
        force * self
    }
}

impl Mul<Force> for Expr {
    type Output = Force;
    #[inline]
    fn mul(self, force: Force) -> Force {
        force * self
    }
}

impl Sum for Force {
    fn sum<I: Iterator<Item = Self>>(terms: I) -> Self {
        terms.fold(Self::ZERO, Self::add)
    }
}

//! Plane and spatial vectors of time jets and of plain numbers.
//!
//! `Vec3` alone is `Vec3<Expr>`, a vector that moves; `Vec3<f64>` is a vector of parameters or values. They
//! mix in every operation. If an operand contains [`Expr`], so does the result.

use core::iter::Sum;
use core::ops::{Add, AddAssign, Div, DivAssign, Index, Mul, MulAssign, Neg, Sub, SubAssign};

use crate::expr::Expr;
use crate::scalar::{Mixed, Scalar, With};

macro_rules! tuple_of {
    ($t:ident; $x:ident $y:ident) => {
        ($t, $t)
    };
    ($t:ident; $x:ident $y:ident $z:ident) => {
        ($t, $t, $t)
    };
}

macro_rules! vector {
    (
        $(#[$doc:meta])*
        $Vec:ident, $vec:ident, $n:literal, $nalgebra:ident: $($field:ident $axis:literal),*
    ) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        pub struct $Vec<T = Expr> {
            $(#[doc = concat!("Component along ", $axis, ".")] pub $field: T,)*
        }

        #[doc = concat!("A vector that may move, from components of `f64` and [`Expr`] mixed.")]
        #[inline(always)]
        #[must_use]
        pub fn $vec($($field: impl Into<Expr>),*) -> $Vec {
            $Vec { $($field: $field.into()),* }
        }

        impl $Vec {
            /// The zero vector; the start of sums.
            pub const ZERO: Self = Self { $($field: Expr::ZERO),* };
        }

        impl<T> $Vec<T> {
            /// From components of one type.
            #[inline(always)]
            #[must_use]
            pub const fn new($($field: T),*) -> Self {
                Self { $($field),* }
            }

            /// The components in order.
            #[inline(always)]
            #[must_use]
            pub fn to_array(self) -> [T; $n] {
                [$(self.$field),*]
            }

            #[inline(always)]
            pub(crate) fn map<U>(self, f: impl Fn(T) -> U) -> $Vec<U> {
                $Vec { $($field: f(self.$field)),* }
            }
        }

        impl<T: Scalar> $Vec<T> {
            /// Scalar product a·b.
            #[inline(always)]
            #[must_use]
            pub fn dot<B: Scalar>(self, other: $Vec<B>) -> Mixed<T, B>
            where
                T: With<B>,
            {
                let products = [$(self.$field * other.$field),*];
                sum(products)
            }

            /// a·a.
            #[inline(always)]
            #[must_use]
            pub fn norm_squared(self) -> T {
                self.dot(self)
            }

            /// Length √(a·a). Where it is 0 the rate of a vector that moves is not finite.
            #[inline(always)]
            #[must_use]
            pub fn norm(self) -> T {
                self.norm_squared().sqrt()
            }

            /// a/|a|; NaN for the zero vector.
            #[inline(always)]
            #[must_use]
            pub fn normalize(self) -> Self {
                let length = self.norm();
                self.map(|component| component / length)
            }

            /// The total time derivative, component by component; zero for parameters.
            #[inline(always)]
            #[must_use]
            pub fn dt(self) -> Self {
                self.map(T::dt)
            }

            /// The values of the components.
            #[inline(always)]
            #[must_use]
            pub fn value(self) -> $Vec<f64> {
                self.map(T::value)
            }

            /// The values of the components' time derivatives.
            #[inline(always)]
            #[must_use]
            pub fn rate(self) -> $Vec<f64> {
                self.map(T::rate)
            }
        }

        impl<T> Index<usize> for $Vec<T> {
            type Output = T;
            #[doc = concat!("Component 0 to ", $n, " − 1; panics beyond, as arrays do.")]
            #[inline(always)]
            fn index(&self, index: usize) -> &T {
                [$(&self.$field),*][index]
            }
        }

        impl<A: With<B>, B> Add<$Vec<B>> for $Vec<A> {
            type Output = $Vec<Mixed<A, B>>;
            #[inline(always)]
            fn add(self, other: $Vec<B>) -> Self::Output {
                $Vec { $($field: self.$field + other.$field),* }
            }
        }

        impl<A: With<B>, B> Sub<$Vec<B>> for $Vec<A> {
            type Output = $Vec<Mixed<A, B>>;
            #[inline(always)]
            fn sub(self, other: $Vec<B>) -> Self::Output {
                $Vec { $($field: self.$field - other.$field),* }
            }
        }

        impl<A: With<B>, B: Scalar> Mul<B> for $Vec<A> {
            type Output = $Vec<Mixed<A, B>>;
            #[inline(always)]
            fn mul(self, factor: B) -> Self::Output {
                $Vec { $($field: self.$field * factor),* }
            }
        }

        impl<A: With<B>, B: Scalar> Div<B> for $Vec<A> {
            type Output = $Vec<Mixed<A, B>>;
            #[inline(always)]
            fn div(self, divisor: B) -> Self::Output {
                $Vec { $($field: self.$field / divisor),* }
            }
        }

        impl<T> Mul<$Vec<T>> for f64
        where
            f64: With<T>,
        {
            type Output = $Vec<Mixed<f64, T>>;
            #[inline(always)]
            fn mul(self, vector: $Vec<T>) -> Self::Output {
                $Vec { $($field: self * vector.$field),* }
            }
        }

        impl<T> Mul<$Vec<T>> for Expr
        where
            Expr: With<T>,
        {
            type Output = $Vec<Mixed<Expr, T>>;
            #[inline(always)]
            fn mul(self, vector: $Vec<T>) -> Self::Output {
                $Vec { $($field: self * vector.$field),* }
            }
        }

        impl<T: Neg> Neg for $Vec<T> {
            type Output = $Vec<T::Output>;
            #[inline(always)]
            fn neg(self) -> Self::Output {
                $Vec { $($field: -self.$field),* }
            }
        }

        impl<A: AddAssign<B>, B> AddAssign<$Vec<B>> for $Vec<A> {
            #[inline(always)]
            fn add_assign(&mut self, other: $Vec<B>) {
                $(self.$field += other.$field;)*
            }
        }

        impl<A: SubAssign<B>, B> SubAssign<$Vec<B>> for $Vec<A> {
            #[inline(always)]
            fn sub_assign(&mut self, other: $Vec<B>) {
                $(self.$field -= other.$field;)*
            }
        }

        impl<A: MulAssign<B>, B: Scalar> MulAssign<B> for $Vec<A> {
            #[inline(always)]
            fn mul_assign(&mut self, factor: B) {
                $(self.$field *= factor;)*
            }
        }

        impl<A: DivAssign<B>, B: Scalar> DivAssign<B> for $Vec<A> {
            #[inline(always)]
            fn div_assign(&mut self, divisor: B) {
                $(self.$field /= divisor;)*
            }
        }

        impl<T: Scalar> Sum for $Vec<T> {
            fn sum<I: Iterator<Item = Self>>(terms: I) -> Self {
                terms.fold(Self { $($field: T::ZERO),* }, |total, term| total + term)
            }
        }

        impl<'a, T: Scalar> Sum<&'a Self> for $Vec<T> {
            fn sum<I: Iterator<Item = &'a Self>>(terms: I) -> Self {
                terms.copied().sum()
            }
        }

        impl<T> From<[T; $n]> for $Vec<T> {
            #[inline(always)]
            fn from([$($field),*]: [T; $n]) -> Self {
                Self { $($field),* }
            }
        }

        impl<T> From<tuple_of!(T; $($field)*)> for $Vec<T> {
            #[inline(always)]
            fn from(($($field),*): tuple_of!(T; $($field)*)) -> Self {
                Self { $($field),* }
            }
        }

        impl From<$Vec<f64>> for $Vec {
            #[inline(always)]
            fn from(vector: $Vec<f64>) -> Self {
                vector.map(Expr::from)
            }
        }

        impl<T: Copy> From<nalgebra::$nalgebra<T>> for $Vec<T> {
            #[inline(always)]
            fn from(vector: nalgebra::$nalgebra<T>) -> Self {
                Self::from(vector.data.0[0])
            }
        }

        impl<T> From<$Vec<T>> for nalgebra::$nalgebra<T> {
            #[inline(always)]
            fn from(vector: $Vec<T>) -> Self {
                Self::from_array_storage(nalgebra::ArrayStorage([vector.to_array()]))
            }
        }
    };
}

vector! {
    /// A vector of the plane.
    ///
    /// ```
    /// # use dynamics_vocabulary as dynamics;
    /// use dynamics::{Expr, Vec2, vec2};
    ///
    /// fn bob(length: f64, theta: Expr) -> Vec2 {
    ///     length * vec2(theta.sin(), -theta.cos())
    /// }
    /// let velocity = bob(2.0, Expr::coordinate(0.0, 3.0, 0.0)).dt();
    /// assert_eq!(velocity.value(), Vec2::new(6.0, 0.0));
    /// ```
    Vec2, vec2, 2, Vector2: x "x", y "y"
}

vector! {
    /// A vector of space, in a right-handed orthogonal frame.
    Vec3, vec3, 3, Vector3: x "x", y "y", z "z"
}

/// The sum from left to right, starting with the first: no rounding with a zero, no sign lost.
#[inline(always)]
fn sum<T: Scalar, const N: usize>(terms: [T; N]) -> T {
    let [first, ..] = terms.as_slice() else {
        return T::ZERO;
    };
    terms[1..].iter().fold(*first, |total, &term| total + term)
}

impl Vec2 {
    /// Unit vector along x.
    pub const X: Self = Self { x: Expr::ONE, y: Expr::ZERO };
    /// Unit vector along y.
    pub const Y: Self = Self { x: Expr::ZERO, y: Expr::ONE };
}

impl Vec3 {
    /// Unit vector along x.
    pub const X: Self = Self { x: Expr::ONE, y: Expr::ZERO, z: Expr::ZERO };
    /// Unit vector along y.
    pub const Y: Self = Self { x: Expr::ZERO, y: Expr::ONE, z: Expr::ZERO };
    /// Unit vector along z.
    pub const Z: Self = Self { x: Expr::ZERO, y: Expr::ZERO, z: Expr::ONE };
}

impl<T: Scalar> Vec2<T> {
    /// The component of a×b normal to the plane, aₓb_y − a_ybₓ: positive where b lies counter-clockwise of a.
    #[inline(always)]
    #[must_use]
    pub fn cross<B: Scalar>(self, other: Vec2<B>) -> Mixed<T, B>
    where
        T: With<B>,
    {
        self.x * other.y - self.y * other.x
    }

    /// The vector turned counter-clockwise by a right angle, (−y, x).
    #[inline(always)]
    #[must_use]
    pub fn perp(self) -> Self {
        Self { x: -self.y, y: self.x }
    }
}

impl<T: Scalar> Vec3<T> {
    /// Vector product a×b.
    #[inline(always)]
    #[must_use]
    pub fn cross<B: Scalar>(self, other: Vec3<B>) -> Vec3<Mixed<T, B>>
    where
        T: With<B>,
    {
        Vec3 {
            x: self.y * other.z - self.z * other.y,
            y: self.z * other.x - self.x * other.z,
            z: self.x * other.y - self.y * other.x,
        }
    }
}

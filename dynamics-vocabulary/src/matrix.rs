//! 3×3 matrices of time jets and of plain numbers: rotations and inertia tensors.

use core::ops::{Add, AddAssign, Div, Index, IndexMut, Mul, Neg, Sub, SubAssign};

use crate::expr::Expr;
use crate::scalar::{Mixed, Scalar, With};
use crate::vector::Vec3;

/// A 3×3 matrix, stored by rows. `Mat3` alone is `Mat3<Expr>`, which moves; `Mat3<f64>` holds parameters or
/// values.
///
/// ```
/// # use dynamics_vocabulary as dynamics;
/// use dynamics::{Expr, Mat3, Vec3, vec3};
///
/// // A point fixed in a body that turns about z: its velocity is ω × r.
/// let phi = Expr::coordinate(0.4, 2.0, 0.0);
/// let point = Mat3::rotation_z(phi) * vec3(1.0, 0.0, 0.5);
/// let difference = point.dt() - 2.0 * Vec3::Z.cross(point);
/// assert!(difference.value().norm() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mat3<T = Expr> {
    rows: [Vec3<T>; 3],
}

impl Mat3 {
    /// The zero matrix; the start of sums.
    pub const ZERO: Self = Self { rows: [Vec3::ZERO; 3] };
    /// The identity.
    pub const IDENTITY: Self = Self { rows: [Vec3::X, Vec3::Y, Vec3::Z] };
}

impl<T> Mat3<T> {
    /// From its three rows.
    #[inline(always)]
    #[must_use]
    pub const fn from_rows(first: Vec3<T>, second: Vec3<T>, third: Vec3<T>) -> Self {
        Self { rows: [first, second, third] }
    }

    #[inline(always)]
    fn map<U>(self, f: impl Fn(Vec3<T>) -> Vec3<U>) -> Mat3<U> {
        Mat3 { rows: self.rows.map(f) }
    }
}

impl<T: Scalar> Mat3<T> {
    /// From its three columns.
    #[inline(always)]
    #[must_use]
    pub fn from_columns(first: Vec3<T>, second: Vec3<T>, third: Vec3<T>) -> Self {
        Self::from_rows(first, second, third).transpose()
    }

    /// The diagonal matrix with these elements: principal moments of inertia.
    #[inline(always)]
    #[must_use]
    pub fn diagonal(xx: T, yy: T, zz: T) -> Self {
        let o = T::ZERO;
        Self::from([[xx, o, o], [o, yy, o], [o, o, zz]])
    }

    /// The matrix of v×: `Mat3::skew(v) * w` is v × w.
    #[inline(always)]
    #[must_use]
    pub fn skew(v: Vec3<T>) -> Self {
        let o = T::ZERO;
        Self::from([[o, -v.z, v.y], [v.z, o, -v.x], [-v.y, v.x, o]])
    }

    /// Turns vectors about x by an angle in rad, right-handed: y goes toward z.
    #[inline(always)]
    #[must_use]
    pub fn rotation_x(angle: T) -> Self {
        let (s, c) = angle.sin_cos();
        let (o, i) = (T::ZERO, T::ONE);
        Self::from([[i, o, o], [o, c, -s], [o, s, c]])
    }

    /// Turns vectors about y by an angle in rad, right-handed: z goes toward x.
    #[inline(always)]
    #[must_use]
    pub fn rotation_y(angle: T) -> Self {
        let (s, c) = angle.sin_cos();
        let (o, i) = (T::ZERO, T::ONE);
        Self::from([[c, o, s], [o, i, o], [-s, o, c]])
    }

    /// Turns vectors about z by an angle in rad, right-handed: x goes toward y.
    #[inline(always)]
    #[must_use]
    pub fn rotation_z(angle: T) -> Self {
        let (s, c) = angle.sin_cos();
        let (o, i) = (T::ZERO, T::ONE);
        Self::from([[c, -s, o], [s, c, o], [o, o, i]])
    }

    /// Row i, 0 to 2; panics beyond, as indices of arrays do.
    #[inline(always)]
    #[must_use]
    pub fn row(self, i: usize) -> Vec3<T> {
        self.rows[i]
    }

    /// Column i, 0 to 2; panics beyond, as indices of arrays do.
    #[inline(always)]
    #[must_use]
    pub fn column(self, i: usize) -> Vec3<T> {
        let [a, b, c] = self.rows;
        Vec3::new(a[i], b[i], c[i])
    }

    /// The transpose; the inverse of a rotation.
    #[inline(always)]
    #[must_use]
    pub fn transpose(self) -> Self {
        Self { rows: [self.column(0), self.column(1), self.column(2)] }
    }

    /// Sum of the diagonal.
    #[inline(always)]
    #[must_use]
    pub fn trace(self) -> T {
        let [a, b, c] = self.rows;
        a.x + b.y + c.z
    }

    /// Determinant: the triple product of the rows.
    #[inline(always)]
    #[must_use]
    pub fn determinant(self) -> T {
        let [a, b, c] = self.rows;
        a.dot(b.cross(c))
    }

    /// The total time derivative, element by element; zero for parameters.
    #[inline(always)]
    #[must_use]
    pub fn dt(self) -> Self {
        self.map(Vec3::dt)
    }

    /// The values of the elements.
    #[inline(always)]
    #[must_use]
    pub fn value(self) -> Mat3<f64> {
        self.map(Vec3::value)
    }

    /// The values of the elements' time derivatives.
    #[inline(always)]
    #[must_use]
    pub fn rate(self) -> Mat3<f64> {
        self.map(Vec3::rate)
    }

    /// The elements by rows.
    #[inline(always)]
    #[must_use]
    pub fn to_array(self) -> [[T; 3]; 3] {
        self.rows.map(Vec3::to_array)
    }
}

impl<T> Index<(usize, usize)> for Mat3<T> {
    type Output = T;
    /// The element of row i, column j, both 0 to 2; panics beyond, as arrays do.
    #[inline(always)]
    fn index(&self, (i, j): (usize, usize)) -> &T {
        &self.rows[i][j]
    }
}

impl<T> IndexMut<(usize, usize)> for Mat3<T> {
    /// The element of row i, column j, both 0 to 2; panics beyond, as arrays do.
    #[inline(always)]
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut T {
        let row = &mut self.rows[i];
        [&mut row.x, &mut row.y, &mut row.z].into_iter().nth(j).expect("three columns")
    }
}

macro_rules! elementwise {
    ($($trait:ident $function:ident),*) => {$(
        impl<A: With<B>, B> $trait<Mat3<B>> for Mat3<A> {
            type Output = Mat3<Mixed<A, B>>;
            #[inline(always)]
            fn $function(self, other: Mat3<B>) -> Self::Output {
                let ([a, b, c], [x, y, z]) = (self.rows, other.rows);
                Mat3 { rows: [a.$function(x), b.$function(y), c.$function(z)] }
            }
        }
    )*};
}
elementwise! { Add add, Sub sub }

macro_rules! elementwise_assign {
    ($($trait:ident $function:ident),*) => {$(
        impl<A: $trait<B>, B> $trait<Mat3<B>> for Mat3<A> {
            #[inline(always)]
            fn $function(&mut self, other: Mat3<B>) {
                let ([a, b, c], [x, y, z]) = (&mut self.rows, other.rows);
                a.$function(x);
                b.$function(y);
                c.$function(z);
            }
        }
    )*};
}
elementwise_assign! { AddAssign add_assign, SubAssign sub_assign }

impl<T: Neg> Neg for Mat3<T> {
    type Output = Mat3<T::Output>;
    #[inline(always)]
    fn neg(self) -> Self::Output {
        self.map(Neg::neg)
    }
}

macro_rules! by_scalar {
    ($($trait:ident $function:ident $operator:tt),*) => {$(
        impl<A: With<B>, B: Scalar> $trait<B> for Mat3<A> {
            type Output = Mat3<Mixed<A, B>>;
            #[inline(always)]
            fn $function(self, scalar: B) -> Self::Output {
                self.map(|row| row $operator scalar)
            }
        }
    )*};
}
by_scalar! { Mul mul *, Div div / }

macro_rules! scalar_times {
    ($($Scalar:ty),*) => {$(
        impl<T> Mul<Mat3<T>> for $Scalar
        where
            $Scalar: With<T>,
        {
            type Output = Mat3<Mixed<$Scalar, T>>;
            #[inline(always)]
            fn mul(self, matrix: Mat3<T>) -> Self::Output {
                matrix.map(|row| row.map(|element| self * element))
            }
        }
    )*};
}
scalar_times! { f64, Expr }

impl<A: Scalar + With<B>, B: Scalar> Mul<Vec3<B>> for Mat3<A> {
    type Output = Vec3<Mixed<A, B>>;
    #[inline(always)]
    fn mul(self, vector: Vec3<B>) -> Self::Output {
        let [x, y, z] = self.rows.map(|row| row.dot(vector));
        Vec3 { x, y, z }
    }
}

impl<A: Scalar + With<B>, B: Scalar> Mul<Mat3<B>> for Mat3<A> {
    type Output = Mat3<Mixed<A, B>>;
    #[inline(always)]
    fn mul(self, other: Mat3<B>) -> Self::Output {
        let columns = other.transpose();
        self.map(|row| {
            let [x, y, z] = columns.rows.map(|column| row.dot(column));
            Vec3 { x, y, z }
        })
    }
}

impl<T> From<[[T; 3]; 3]> for Mat3<T> {
    #[inline(always)]
    fn from(rows: [[T; 3]; 3]) -> Self {
        Self { rows: rows.map(Vec3::from) }
    }
}

impl From<Mat3<f64>> for Mat3 {
    #[inline(always)]
    fn from(matrix: Mat3<f64>) -> Self {
        matrix.map(Vec3::from)
    }
}

impl<T: Scalar> From<nalgebra::Matrix3<T>> for Mat3<T> {
    #[inline(always)]
    fn from(matrix: nalgebra::Matrix3<T>) -> Self {
        let [first, second, third] = matrix.data.0.map(Vec3::from);
        Self::from_columns(first, second, third)
    }
}

impl<T: Scalar> From<Mat3<T>> for nalgebra::Matrix3<T> {
    #[inline(always)]
    fn from(matrix: Mat3<T>) -> Self {
        Self::from_array_storage(nalgebra::ArrayStorage(matrix.transpose().to_array()))
    }
}

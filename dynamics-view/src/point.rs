//! Points of a picture, and the types that convert to them.

use alloc::vec::Vec;

/// A point of a picture: in the plane, or in space with z up. A picture with points in space is shown in
/// perspective, from an eye that the viewer moves. A point (x, y) of the plane is then at (x, 0, y).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Point {
    /// x to the right, y up.
    Planar([f64; 2]),
    /// x and y level, z up.
    Spatial([f64; 3]),
}

impl Point {
    /// In space.
    pub(crate) fn in_space(self) -> [f64; 3] {
        match self {
            Self::Planar([x, y]) => [x, 0.0, y],
            Self::Spatial(point) => point,
        }
    }

    pub(crate) fn offset(self, [dx, dy]: [f64; 2]) -> Self {
        match self {
            Self::Planar([x, y]) => Self::Planar([x + dx, y + dy]),
            // In space a plane figure stands upright: its own plane is x–z.
            Self::Spatial([x, y, z]) => Self::Spatial([x + dx, y, z + dy]),
        }
    }
}

impl<T: Number> From<[T; 2]> for Point {
    fn from(point: [T; 2]) -> Self {
        Self::Planar(point.map(Number::value))
    }
}

impl<T: Number> From<[T; 3]> for Point {
    fn from(point: [T; 3]) -> Self {
        Self::Spatial(point.map(Number::value))
    }
}

/// A length or an angle of a figure, or a coordinate of a point: a plain number, or one that moves, of which
/// the value is drawn.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a number that can be drawn; pictures are made of `f64` and `Expr`",
    label = "neither `f64` nor `Expr`",
    note = "write whole numbers with a point: `2.0`, and indices as `f64::from(i)` or `i as f64`"
)]
pub trait Number: Copy {
    /// Its value.
    fn value(self) -> f64;
}

impl Number for f64 {
    fn value(self) -> f64 {
        self
    }
}

/// The placement of a solid: the axes of a body, in which its places are given.
pub trait Placement: Copy {
    /// A place, by its coordinates along the body's axes.
    type Place: Copy;
    /// The place moved by so much along each axis.
    fn moved(place: Self::Place, along: [f64; 3]) -> Self::Place;
    /// Where the place is in space.
    fn point(self, place: Self::Place) -> Point;
}

/// Results of functions that the automatic picture of a model can draw as points: a vector, or an array of
/// vectors.
pub trait Places {
    /// The places in their order.
    fn places(self) -> Vec<Point>;
}

impl<P: Places, const N: usize> Places for [P; N] {
    fn places(self) -> Vec<Point> {
        self.into_iter().flat_map(P::places).collect()
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Where a body is that was turned about x, then about z.
    #[derive(Clone, Copy)]
    pub(crate) struct Body {
        pub(crate) origin: [f64; 3],
        pub(crate) about_x: f64,
        pub(crate) about_z: f64,
    }

    impl Body {
        pub(crate) fn place(self, [x, y, z]: [f64; 3]) -> [f64; 3] {
            let (sin, cos) = libm::sincos(self.about_x);
            let (y, z) = (cos * y - sin * z, sin * y + cos * z);
            let (sin, cos) = libm::sincos(self.about_z);
            let [x0, y0, z0] = self.origin;
            [x0 + cos * x - sin * y, y0 + sin * x + cos * y, z0 + z]
        }
    }

    impl Placement for Body {
        type Place = [f64; 3];
        fn moved([x, y, z]: [f64; 3], [dx, dy, dz]: [f64; 3]) -> [f64; 3] {
            [x + dx, y + dy, z + dz]
        }
        fn point(self, place: [f64; 3]) -> Point {
            self.place(place).into()
        }
    }
}

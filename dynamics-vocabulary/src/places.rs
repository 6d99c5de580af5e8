//! What pictures are drawn with: values that move, vectors, frames.

use alloc::vec::Vec;

use dynamics_view::{Number, Placement, Places, Point};

use crate::bodies::Frame;
use crate::expr::Expr;
use crate::scalar::Scalar;
use crate::vector::{Vec2, Vec3};

impl Number for Expr {
    fn value(self) -> f64 {
        Self::value(self)
    }
}

impl<T: Scalar> From<Vec2<T>> for Point {
    fn from(point: Vec2<T>) -> Self {
        Self::Planar([point.x.value(), point.y.value()])
    }
}

impl<T: Scalar> From<Vec3<T>> for Point {
    fn from(point: Vec3<T>) -> Self {
        Self::Spatial([point.x.value(), point.y.value(), point.z.value()])
    }
}

impl<T: Scalar> Places for Vec2<T> {
    fn places(self) -> Vec<Point> {
        [self.into()].into()
    }
}

impl<T: Scalar> Places for Vec3<T> {
    fn places(self) -> Vec<Point> {
        [self.into()].into()
    }
}

impl Placement for Frame {
    type Place = Vec3;
    fn moved(place: Vec3, along: [f64; 3]) -> Vec3 {
        place + Vec3::from(along)
    }
    fn point(self, place: Vec3) -> Point {
        Self::point(self, place).into()
    }
}

#[cfg(test)]
mod tests {
    use dynamics_view::{Drawing, Figure, Shape};

    use super::*;
    use crate::{Mat3, vec2, vec3};

    fn points(shape: &Shape) -> &[Point] {
        match &shape.figure {
            Figure::Polyline { points, .. } => points,
            other => panic!("{other:?} has no points"),
        }
    }

    #[test]
    fn values_that_move_are_drawn_where_they_are() {
        let s = Expr::coordinate(0.5, 2.0, 0.0);
        let drawing =
            Drawing::new().line(vec2(s, 1.0), Vec2::new(3.0, 4.0)).disc(vec3(s, 0.0, 2.0 * s), s).dot([s, s]);
        assert_eq!(points(&drawing.shapes()[0]), [Point::Planar([0.5, 1.0]), Point::Planar([3.0, 4.0])]);
        assert_eq!(
            drawing.shapes()[1].figure,
            Figure::Circle { center: Point::Spatial([0.5, 0.0, 1.0]), radius: 0.5, filled: true }
        );
    }

    #[test]
    fn solids_stand_where_their_frame_does() {
        let frame = Frame::new(vec3(1.0, 2.0, 3.0), Mat3::rotation_z(core::f64::consts::FRAC_PI_2));
        let drawing = Drawing::new().cuboid(frame, vec3(1.0, 0.0, 0.0), [4.0, 2.0, 6.0]);
        let Figure::Cuboid { center, faces } = &drawing.shapes()[0].figure else { panic!("{drawing:?}") };
        let expected = [[1.0, 3.0, 3.0], [1.0, 5.0, 3.0], [0.0, 3.0, 3.0], [1.0, 3.0, 6.0]];
        for (point, expected) in core::iter::once(center).chain(faces).zip(expected) {
            let Point::Spatial(place) = point else { panic!("{point:?}") };
            for (x, expected) in place.iter().zip(expected) {
                assert!((x - expected).abs() < 1e-14, "{point:?}");
            }
        }
    }

    #[test]
    fn arrays_of_places_are_drawn_as_chains() {
        let links: [Vec2; 30] = core::array::from_fn(|k| vec2(k as f64, 1.0));
        let drawing = Drawing::of_helpers(&[("links", links.places()), ("end", vec2(30.0, 0.0).places())]);
        let count = |wanted: fn(&Figure) -> bool| {
            drawing.shapes().iter().filter(|shape| wanted(&shape.figure)).count()
        };
        assert_eq!(count(|figure| matches!(figure, Figure::Dot { .. })), 31);
        assert_eq!(
            count(|figure| matches!(figure, Figure::Polyline { points, .. } if points.len() == 32)),
            1
        );
        let traces = drawing.shapes().iter().filter_map(|shape| match &shape.figure {
            Figure::Trace { name, .. } => Some(name.as_str()),
            _ => None,
        });
        assert_eq!(traces.collect::<Vec<_>>(), ["links[29]", "end"]);
        let corners = [[vec3(0.0, 0.0, 1.0), vec3(1.0, 0.0, 1.0)], [vec3(0.0, 1.0, 1.0); 2]].places();
        assert_eq!((corners.len(), corners[1]), (4, Point::Spatial([1.0, 0.0, 1.0])));
        assert_eq!(Drawing::of_helpers(&[("corners", corners)]).shapes().len(), 4 + 2 + 4);
    }
}

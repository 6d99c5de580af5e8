//! The picture of a model at one instant.

use alloc::string::String;
use alloc::vec::Vec;

use crate::color::Color;
use crate::point::{Number, Placement, Point};

/// Most points that each have a trace in the automatic picture. Of more, lines over lines, only the last of
/// every helper has one.
const MOST_TRACED: usize = 6;

/// What is drawn. Lengths are the model's unless a pixel size is named.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Figure {
    /// Straight lines from point to point; filled if closed and a fill is set.
    Polyline {
        /// The corners.
        points: Vec<Point>,
        /// Whether the last is joined to the first.
        closed: bool,
    },
    /// A circle, or a disc where it is filled.
    Circle {
        /// The centre.
        center: Point,
        /// The radius.
        radius: f64,
        /// Whether it is a disc.
        filled: bool,
    },
    /// Part of a circle of the plane.
    Arc {
        /// The centre.
        center: Point,
        /// The radius.
        radius: f64,
        /// The angle where it begins, in rad, counter-clockwise from the x-axis.
        from: f64,
        /// The angle where it ends.
        to: f64,
    },
    /// A marker of fixed size in pixels.
    Dot {
        /// The centre.
        center: Point,
    },
    /// A zig-zag between two points; its amplitude is in pixels.
    Spring {
        /// One end.
        from: Point,
        /// The other end.
        to: Point,
        /// Number of coils.
        coils: u32,
    },
    /// A line with a head at `to`; the head's size is in pixels.
    Arrow {
        /// The tail.
        from: Point,
        /// The head.
        to: Point,
    },
    /// Words.
    Text {
        /// Where.
        at: Point,
        /// The words.
        text: String,
        /// Whether the words are beside the point, to its upper right, instead of centred on it.
        beside: bool,
    },
    /// The path of a point.
    Trace {
        /// Identifies the point from one instant to the next.
        name: String,
        /// Where the point is now.
        at: Point,
        /// How far back in time the trace reaches; `None`: to the beginning.
        seconds: Option<f64>,
    },
    /// A line with a hatch on its right-hand side as seen from `from` to `to`: solid ground.
    Ground {
        /// One end.
        from: Point,
        /// The other end.
        to: Point,
    },
    /// A support that a body turns about.
    Pivot {
        /// Where.
        at: Point,
    },
    /// A solid box: its middle, and the middles of three faces that share a corner.
    Cuboid {
        /// The middle.
        center: Point,
        /// The middles of three faces.
        faces: [Point; 3],
    },
    /// A solid of revolution with flat ends and a straight side.
    Cone {
        /// The middle of one end.
        from: Point,
        /// The middle of the other end.
        to: Point,
        /// The radii of both ends; equal ones: a cylinder.
        radii: [f64; 2],
    },
}

/// A figure with the pen that it is drawn with.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// What is drawn.
    pub figure: Figure,
    /// Colour of lines, of text and of discs.
    pub color: Color,
    /// Colour inside a closed figure; `None`: not filled.
    pub fill: Option<Color>,
    /// Width of lines in pixels.
    pub width: f64,
    /// Whether lines are dashed.
    pub dashed: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Pen {
    color: Color,
    fill: Option<Color>,
    width: f64,
    dashed: bool,
}

impl Default for Pen {
    fn default() -> Self {
        Self { color: Color::Auto, fill: None, width: 2.0, dashed: false }
    }
}

/// A picture of the model at one instant, built figure by figure; later figures cover earlier ones.
///
/// [`color`](Drawing::color), [`fill`](Drawing::fill), [`width`](Drawing::width) and
/// [`dashed`](Drawing::dashed) set the pen for the figures that follow, and [`plain`](Drawing::plain) resets
/// it. A figure with a coordinate that is not finite is left out at that instant.
///
/// Lengths are those of the model; line widths, dots, arrow heads and springs have sizes in pixels. Points
/// are `[x, y]` with y up, `[x, y, z]` with z up, or vectors of a model. Every figure of the plane:
///
/// ```
/// # mod dynamics {
/// #     pub use dynamics_view as output;
/// # }
/// use dynamics::output::{Color, Drawing};
///
/// let picture = Drawing::new()
///     .line([0.0, 0.0], [1.0, 0.6])
///     .polyline([[2.0, 0.0], [2.3, 0.6], [2.6, 0.1]])
///     .fill(Color::Amber)
///     .polygon([[4.0, 0.0], [5.0, 0.0], [4.5, 0.7]]) // closed and filled
///     .rectangle([6.5, 0.3], 1.0, 0.4, 0.4) // centre, width, height, angle in rad
///     .plain()
///     .curve(0.0, 1.0, 40, |s| [8.0 + s, 0.3 * s * s]) // from, to, number of straight pieces
///     .arc([4.5, 2.1], 0.5, 0.3, 2.8) // centre, radius, from and to in rad
///     .circle([2.5, 2.3], 0.3)
///     .disc([0.5, 2.3], 0.3)
///     .dot([6.5, 2.3])
///     .pivot([8.5, 2.3]) // a support
///     .ground([4.0, 4.3], [5.0, 4.3])
///     .spring([0.0, 4.3], [1.0, 4.3])
///     .coils([2.0, 4.3], [3.0, 4.3], 4)
///     .color(Color::Red)
///     .arrow([6.0, 4.1], [7.0, 4.6])
///     .text([6.5, 3.6], "centred on a point")
///     .label([8.2, 4.2], "beside a point")
///     .trace("tip", [7.0, 4.6]) // the whole path of a point
///     .tail("centre", [0.5, 2.3], 2.0); // its path in the last two seconds
/// let in_space = Drawing::new()
///     .axes(1.0)
///     .cylinder([2.0, 1.0, 0.5], [3.0, 1.0, 0.5], 0.5) // from end to end, radius
///     .cone([2.5, 3.0, 0.0], [2.5, 3.0, 1.2], 0.5); // base, tip, radius
/// assert_eq!(picture.shapes().len(), 18);
/// # assert!(in_space.shapes().len() > 2);
/// ```
///
/// [`cuboid`](Drawing::cuboid) takes the frame of a body. [`with`](Drawing::with) puts another drawing on
/// top.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drawing {
    shapes: Vec<Shape>,
    pen: Pen,
}

/// The figures.
impl Drawing {
    /// An empty picture.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// A chain from the origin through the named points, each with a dot and a trace. Without any point it
    /// says so.
    #[must_use]
    pub fn of_points(points: &[(&str, Point)]) -> Self {
        let helpers: Vec<_> = points.iter().map(|&(name, point)| (name, [point].into())).collect();
        Self::of_helpers(&helpers)
    }

    /// The picture of a model without `#[drawing]`: a chain from the origin through the points that its
    /// functions return, those of an array in their order. Each point has a dot. Each has a trace if there
    /// are few points, otherwise only the last one of each function. Without any point the picture says so.
    #[must_use]
    pub fn of_helpers(helpers: &[(&str, Vec<Point>)]) -> Self {
        let points = || helpers.iter().flat_map(|(_, points)| points.iter().copied());
        let Some(first) = points().next() else { return Self::of_nothing() };
        let origin = match first {
            Point::Spatial(_) => Point::Spatial([0.0; 3]),
            Point::Planar(_) => Point::Planar([0.0; 2]),
        };
        let all = points().count() <= MOST_TRACED;
        let mut drawing = Self::new();
        for (name, points) in helpers {
            for (k, &point) in points.iter().enumerate().filter(|(k, _)| all || k + 1 == points.len()) {
                let name =
                    if points.len() == 1 { String::from(*name) } else { alloc::format!("{name}[{k}]") };
                drawing = drawing.trace(name, point);
            }
        }
        drawing = drawing.polyline(core::iter::once(origin).chain(points())).pivot(origin);
        points().fold(drawing, Self::dot)
    }

    /// The picture of a model that has no points, but coordinates called `x` and `y`: a dot with a trace for
    /// each. What joins them is unknown.
    #[must_use]
    pub fn of_places(places: &[(&str, Point)]) -> Self {
        let traced = places.iter().fold(Self::new(), |drawing, &(name, point)| drawing.trace(name, point));
        places.iter().fold(traced, |drawing, &(_, point)| drawing.dot(point))
    }

    /// An empty picture reads like a mistake: what is missing, in words.
    fn of_nothing() -> Self {
        let lines = [
            "nothing is known to draw:",
            "write a function that returns a place, a Vec2 or Vec3,",
            "or one with #[drawing]",
        ];
        let heights = [1.0, 0.0, -1.0];
        lines.into_iter().zip(heights).fold(Self::new(), |drawing, (line, y)| drawing.text([0.0, y], line))
    }

    /// A straight line: a massless rod, a thread.
    #[must_use]
    pub fn line(self, from: impl Into<Point>, to: impl Into<Point>) -> Self {
        self.figure(Figure::Polyline { points: [from.into(), to.into()].into(), closed: false })
    }

    /// Straight lines from point to point.
    #[must_use]
    pub fn polyline<P: Into<Point>>(self, points: impl IntoIterator<Item = P>) -> Self {
        self.figure(Figure::Polyline { points: points.into_iter().map(Into::into).collect(), closed: false })
    }

    /// A closed polygon, filled if the pen has a fill.
    #[must_use]
    pub fn polygon<P: Into<Point>>(self, points: impl IntoIterator<Item = P>) -> Self {
        self.figure(Figure::Polyline { points: points.into_iter().map(Into::into).collect(), closed: true })
    }

    /// The curve s ↦ `point(s)` for s from `from` to `to`, in `segments` straight pieces: a track, a cam, a
    /// rail.
    #[must_use]
    pub fn curve<P: Into<Point>>(
        self,
        from: f64,
        to: f64,
        segments: usize,
        mut point: impl FnMut(f64) -> P,
    ) -> Self {
        let segments = segments.max(1);
        self.polyline((0..=segments).map(|k| {
            let part = k as f64 / segments as f64;
            point(from * (1.0 - part) + to * part)
        }))
    }

    /// A disc of the given radius; in space, a ball.
    #[must_use]
    pub fn disc(self, center: impl Into<Point>, radius: impl Number) -> Self {
        self.figure(Figure::Circle { center: center.into(), radius: radius.value(), filled: true })
    }

    /// A circle of the given radius; in space, the outline of a ball.
    #[must_use]
    pub fn circle(self, center: impl Into<Point>, radius: impl Number) -> Self {
        self.figure(Figure::Circle { center: center.into(), radius: radius.value(), filled: false })
    }

    /// A disc of a few pixels, however large the picture is.
    #[must_use]
    pub fn dot(self, center: impl Into<Point>) -> Self {
        self.figure(Figure::Dot { center: center.into() })
    }

    /// A rectangle about its centre, turned counter-clockwise by `angle` (rad); filled if the pen has a fill.
    /// In space it stands upright in the plane of x and z.
    #[must_use]
    pub fn rectangle(
        self,
        center: impl Into<Point>,
        width: impl Number,
        height: impl Number,
        angle: impl Number,
    ) -> Self {
        let center = center.into();
        let (width, height) = (width.value(), height.value());
        let (sin, cos) = libm::sincos(angle.value());
        let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)];
        self.polygon(corners.map(|(x, y)| {
            let (x, y) = (x * width, y * height);
            center.offset([cos * x - sin * y, sin * x + cos * y])
        }))
    }

    /// An arc about `center` from angle `from` to angle `to` (rad, counter-clockwise from the x-axis); in
    /// space it stands upright in the plane of x and z.
    #[must_use]
    pub fn arc(
        self,
        center: impl Into<Point>,
        radius: impl Number,
        from: impl Number,
        to: impl Number,
    ) -> Self {
        let (center, radius) = (center.into(), radius.value());
        let (from, to) = (from.value(), to.value());
        if matches!(center, Point::Planar(_)) {
            return self.figure(Figure::Arc { center, radius, from, to });
        }
        self.curve(from, to, 48, |angle| {
            let (sin, cos) = libm::sincos(angle);
            center.offset([radius * cos, radius * sin])
        })
    }

    /// A coil spring between two points.
    #[must_use]
    pub fn spring(self, from: impl Into<Point>, to: impl Into<Point>) -> Self {
        self.coils(from, to, 9)
    }

    /// A spring with so many coils.
    #[must_use]
    pub fn coils(self, from: impl Into<Point>, to: impl Into<Point>, coils: u32) -> Self {
        self.figure(Figure::Spring { from: from.into(), to: to.into(), coils })
    }

    /// An arrow: a force, a velocity.
    #[must_use]
    pub fn arrow(self, from: impl Into<Point>, to: impl Into<Point>) -> Self {
        self.figure(Figure::Arrow { from: from.into(), to: to.into() })
    }

    /// The whole path of a point so far. `name` distinguishes it from the other traces of the picture.
    #[must_use]
    pub fn trace(self, name: impl Into<String>, at: impl Into<Point>) -> Self {
        self.figure(Figure::Trace { name: name.into(), at: at.into(), seconds: None })
    }

    /// The path of a point in the last `seconds` of the model's time, fading.
    #[must_use]
    pub fn tail(self, name: impl Into<String>, at: impl Into<Point>, seconds: f64) -> Self {
        self.figure(Figure::Trace { name: name.into(), at: at.into(), seconds: Some(seconds) })
    }

    /// Words beside a point.
    #[must_use]
    pub fn label(self, at: impl Into<Point>, text: impl Into<String>) -> Self {
        self.figure(Figure::Text { at: at.into(), text: text.into(), beside: true })
    }

    /// Words centred upon a point.
    #[must_use]
    pub fn text(self, at: impl Into<Point>, text: impl Into<String>) -> Self {
        self.figure(Figure::Text { at: at.into(), text: text.into(), beside: false })
    }

    /// Solid ground: a line, hatched on its right-hand side as seen from `from` to `to`.
    #[must_use]
    pub fn ground(self, from: impl Into<Point>, to: impl Into<Point>) -> Self {
        self.figure(Figure::Ground { from: from.into(), to: to.into() })
    }

    /// A fixed support that a body turns about.
    #[must_use]
    pub fn pivot(self, at: impl Into<Point>) -> Self {
        self.figure(Figure::Pivot { at: at.into() })
    }

    /// A solid box in a frame: its middle there, and its lengths along the frame's axes.
    #[must_use]
    pub fn cuboid<A: Placement>(self, frame: A, center: impl Into<A::Place>, lengths: [f64; 3]) -> Self {
        let center = center.into();
        let half = |axis: usize| {
            let mut along = [0.0; 3];
            along[axis] = 0.5 * lengths[axis];
            frame.point(A::moved(center, along))
        };
        self.figure(Figure::Cuboid { center: frame.point(center), faces: [half(0), half(1), half(2)] })
    }

    /// A solid cylinder between the middles of its ends: a wheel, a shaft, a rod.
    #[must_use]
    pub fn cylinder(self, from: impl Into<Point>, to: impl Into<Point>, radius: impl Number) -> Self {
        let radii = [radius.value(); 2];
        self.figure(Figure::Cone { from: from.into(), to: to.into(), radii })
    }

    /// A solid cone from the middle of its base to its tip.
    #[must_use]
    pub fn cone(self, base: impl Into<Point>, tip: impl Into<Point>, radius: impl Number) -> Self {
        self.figure(Figure::Cone { from: base.into(), to: tip.into(), radii: [radius.value(), 0.0] })
    }

    /// The axes x, y, z of space, each of the given length, with their names.
    #[must_use]
    pub fn axes(self, length: f64) -> Self {
        let (x, y, z) = ([length, 0.0, 0.0], [0.0, length, 0.0], [0.0, 0.0, length]);
        let pen = self.pen;
        let mut drawing = self.plain().color(Color::Faint).width(1.0);
        for (axis, name) in [(x, "x"), (y, "y"), (z, "z")] {
            drawing = drawing.arrow([0.0; 3], axis).label(axis, name);
        }
        drawing.pen = pen;
        drawing
    }

    fn figure(mut self, figure: Figure) -> Self {
        let Pen { color, fill, width, dashed } = self.pen;
        self.shapes.push(Shape { figure, color, fill, width, dashed });
        self
    }
}

/// The pen.
impl Drawing {
    /// The colour of the figures that follow.
    #[must_use]
    pub fn color(mut self, color: Color) -> Self {
        self.pen.color = color;
        self
    }

    /// The colour inside the closed figures that follow.
    #[must_use]
    pub fn fill(mut self, color: Color) -> Self {
        self.pen.fill = Some(color);
        self
    }

    /// The line width in pixels of the figures that follow; 2 unless set.
    #[must_use]
    pub fn width(mut self, pixels: f64) -> Self {
        self.pen.width = pixels;
        self
    }

    /// Dashed lines in the figures that follow.
    #[must_use]
    pub fn dashed(mut self) -> Self {
        self.pen.dashed = true;
        self
    }

    /// The pen as it was at the beginning.
    #[must_use]
    pub fn plain(mut self) -> Self {
        self.pen = Pen::default();
        self
    }
}

/// What was drawn.
impl Drawing {
    /// The figures in the order in which they are painted.
    #[must_use]
    pub fn shapes(&self) -> &[Shape] {
        &self.shapes
    }

    /// Puts another picture on top of this one.
    #[must_use]
    pub fn with(mut self, other: Self) -> Self {
        self.shapes.extend(other.shapes);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(shape: &Shape) -> &[Point] {
        match &shape.figure {
            Figure::Polyline { points, .. } => points,
            other => panic!("{other:?} has no points"),
        }
    }

    #[test]
    fn the_pen_holds_for_what_follows() {
        let drawing = Drawing::new()
            .line([0.0, 0.0], [1.0, 0.0])
            .color(Color::Red)
            .fill(Color::Blue)
            .width(5.0)
            .dashed()
            .line([0.0, 0.0], [1.0, 0.0])
            .plain()
            .dot([0.0, 0.0]);
        let seen: Vec<_> = drawing
            .shapes()
            .iter()
            .map(|shape| (shape.color, shape.fill, shape.width, shape.dashed))
            .collect();
        assert_eq!(
            seen,
            [
                (Color::Auto, None, 2.0, false),
                (Color::Red, Some(Color::Blue), 5.0, true),
                (Color::Auto, None, 2.0, false)
            ]
        );
    }

    #[test]
    fn axes_leave_the_pen_alone() {
        let drawing = Drawing::new().color(Color::Red).axes(1.0).dot([0.0, 0.0]);
        assert_eq!(drawing.shapes().last().map(|s| s.color), Some(Color::Red));
    }

    #[test]
    fn a_turned_rectangle_has_its_corners_where_the_rotation_puts_them() {
        let drawing = Drawing::new().rectangle([1.0, 2.0], 4.0, 2.0, core::f64::consts::FRAC_PI_2);
        let expected = [[2.0, 0.0], [2.0, 4.0], [0.0, 4.0], [0.0, 0.0]];
        for (point, expected) in points(&drawing.shapes()[0]).iter().zip(expected) {
            let [x, _, y] = point.in_space();
            assert!((x - expected[0]).abs() < 1e-14 && (y - expected[1]).abs() < 1e-14);
        }
    }

    #[test]
    fn cones_end_in_a_tip_and_cylinders_do_not() {
        let drawing =
            Drawing::new().cone([0.0; 3], [0.0, 0.0, 1.0], 0.5).cylinder([0.0; 3], [1.0, 0.0, 0.0], 0.1);
        let radii = |k: usize| match drawing.shapes()[k].figure {
            Figure::Cone { radii, .. } => radii,
            _ => panic!("{drawing:?}"),
        };
        assert_eq!((radii(0), radii(1)), ([0.5, 0.0], [0.1, 0.1]));
    }

    #[test]
    fn the_default_picture_goes_from_the_origin_through_the_points() {
        let drawing =
            Drawing::of_points(&[("a", Point::Planar([1.0, 0.0])), ("b", Point::Planar([1.0, 1.0]))]);
        let chain =
            drawing.shapes().iter().find(|shape| matches!(shape.figure, Figure::Polyline { .. })).unwrap();
        assert_eq!(
            points(chain),
            [Point::Planar([0.0, 0.0]), Point::Planar([1.0, 0.0]), Point::Planar([1.0, 1.0])]
        );
    }

    #[test]
    fn a_picture_without_points_is_not_empty() {
        let nothing = Drawing::of_points(&[]);
        let words = nothing.shapes().iter().filter_map(|shape| match &shape.figure {
            Figure::Text { text, .. } => Some(text.as_str()),
            _ => None,
        });
        assert!(words.collect::<Vec<_>>().join(" ").contains("#[drawing]"));
        let places = Drawing::of_places(&[("x, y", Point::Planar([1.0, 0.0]))]);
        assert_eq!(places.shapes().len(), 2, "a trace and a dot");
    }

    #[test]
    fn curves_meet_their_ends_exactly() {
        let drawing = Drawing::new().curve(0.1, 0.7, 7, |s| [s, 2.0 * s]);
        let points = points(&drawing.shapes()[0]);
        assert_eq!(points.len(), 8);
        assert_eq!(points[0], Point::Planar([0.1, 0.2]));
        assert_eq!(points[7], Point::Planar([0.7, 1.4]));
    }
}

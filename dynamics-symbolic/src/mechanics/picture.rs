//! What a model shows of itself: the figures of its `#[drawing]`, and its named points.
//!
//! A picture has expressions of its own. They begin with those of the declared model. Nothing that only a
//! picture reads can change the derivation, its texts or its programs.

use crate::graph::{FunctionId, Graph, NodeId, Symbol};

/// The picture of a model at one instant, as expressions.
///
/// They may contain everything that outputs contain: velocities, accelerations, multipliers, modes, inputs.
/// Numbers that a program knows beside the parameters are parameters behind the last one of the model, see
/// [`Extra`].
#[derive(Clone, Debug, Default)]
pub struct Picture {
    /// All expressions: those of the declared model, and what the picture adds.
    pub graph: Graph,
    /// The figures of `#[drawing]`.
    pub figures: Figures,
    /// Points with names: places that helper functions return, or else coordinates called `x` and `y`.
    pub points: Vec<NamedPoint>,
    /// The meaning of the parameters behind those of the model: `extras[k]` is
    /// `Symbol::Parameter(first_extra + k)`.
    pub extras: Vec<Extra>,
    /// Number of the parameters of the model.
    pub first_extra: u32,
}

impl Picture {
    /// The symbol of the number that curves run over; [`Figure::Curve::point`] contains it.
    #[must_use]
    pub fn running(&self) -> Symbol {
        let at = self.extras.iter().position(|extra| *extra == Extra::Running).unwrap_or(0);
        Symbol::Parameter(self.first_extra + at as u32)
    }

    /// The numbers of all figures, one figure after the other, as [`Shape::numbers`] has them: the results of
    /// one program.
    #[must_use]
    pub fn numbers(&self) -> Vec<NodeId> {
        match &self.figures {
            Figures::Of(shapes) => shapes.iter().flat_map(Shape::numbers).collect(),
            Figures::None | Figures::NotFollowed(_) => Vec::new(),
        }
    }
}

/// A number that pictures read and that the model does not declare.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extra {
    /// The number that a curve runs over.
    Running,
    /// The smallest argument of a smooth function, `domain()[0]`.
    Start(FunctionId),
    /// The largest argument of a smooth function, `domain()[1]`.
    End(FunctionId),
}

/// What is known of `#[drawing]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Figures {
    /// The model has no such function.
    #[default]
    None,
    /// The figures in the order in which they are painted.
    Of(Vec<Shape>),
    /// The function contains what the language of pictures does not have.
    NotFollowed(NotFollowed),
}

/// The expression of a drawing that is not followed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NotFollowed {
    /// The expression, shortened.
    pub expression: String,
    /// Its line in the user's file, where that is known.
    pub line: Option<usize>,
}

impl core::fmt::Display for NotFollowed {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "its drawing contains `{}`", self.expression)?;
        match self.line {
            Some(line) => write!(f, " in line {line}, which is not followed"),
            None => write!(f, ", which is not followed"),
        }
    }
}

/// A point with a name.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedPoint {
    /// The function's name, elements of arrays as `joint[3]`; of coordinates `x, y`.
    pub name: String,
    /// Where it is.
    pub at: DrawnPoint,
}

/// Two coordinates in the plane (y up), or three in space (z up).
pub type DrawnPoint = Vec<NodeId>;

/// What is drawn: the figures of `dynamics-view`, with expressions for their numbers. Lengths are the
/// model's.
#[derive(Clone, Debug, PartialEq)]
pub enum Figure {
    /// Straight lines from point to point.
    Polyline {
        /// The corners.
        points: Vec<DrawnPoint>,
        /// Whether the last is joined to the first.
        closed: bool,
    },
    /// Straight lines through the points of a curve.
    Curve {
        /// The number that is run over begins here.
        from: NodeId,
        /// It ends here.
        to: NodeId,
        /// Number of straight pieces. Point k is at from·(1 − k/n) + to·(k/n).
        segments: usize,
        /// The point of the curve at [`Picture::running`].
        point: DrawnPoint,
    },
    /// A circle or a disc.
    Circle {
        /// The centre.
        center: DrawnPoint,
        /// The radius.
        radius: NodeId,
        /// Whether it is a disc.
        filled: bool,
    },
    /// Part of a circle of the plane.
    Arc {
        /// The centre.
        center: DrawnPoint,
        /// The radius.
        radius: NodeId,
        /// The angle where it begins, in rad, counter-clockwise from the x-axis.
        from: NodeId,
        /// The angle where it ends.
        to: NodeId,
    },
    /// A marker of fixed size in pixels.
    Dot {
        /// The centre.
        center: DrawnPoint,
    },
    /// A zig-zag between two points.
    Spring {
        /// One end.
        from: DrawnPoint,
        /// The other end.
        to: DrawnPoint,
        /// Number of coils.
        coils: u32,
    },
    /// A line with a head at `to`.
    Arrow {
        /// The tail.
        from: DrawnPoint,
        /// The head.
        to: DrawnPoint,
    },
    /// Words.
    Text {
        /// Where.
        at: DrawnPoint,
        /// The words.
        text: String,
        /// Whether the words are beside the point instead of centred on it.
        beside: bool,
    },
    /// The path of a point.
    Trace {
        /// Identifies the point from one instant to the next.
        name: String,
        /// Where the point is now.
        at: DrawnPoint,
        /// How far back in time the trace reaches; `None`: to the beginning.
        seconds: Option<NodeId>,
    },
    /// Solid ground.
    Ground {
        /// One end.
        from: DrawnPoint,
        /// The other end.
        to: DrawnPoint,
    },
    /// A support that a body turns about.
    Pivot {
        /// Where.
        at: DrawnPoint,
    },
    /// A solid box.
    Cuboid {
        /// The middle.
        center: DrawnPoint,
        /// The middles of three faces that share a corner.
        faces: [DrawnPoint; 3],
    },
    /// A solid of revolution with flat ends and a straight side.
    Cone {
        /// The middle of one end.
        from: DrawnPoint,
        /// The middle of the other end.
        to: DrawnPoint,
        /// The radii of both ends.
        radii: [NodeId; 2],
    },
}

impl Figure {
    /// Its kind in lower case.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Polyline { .. } => "polyline",
            Self::Curve { .. } => "curve",
            Self::Circle { .. } => "circle",
            Self::Arc { .. } => "arc",
            Self::Dot { .. } => "dot",
            Self::Spring { .. } => "spring",
            Self::Arrow { .. } => "arrow",
            Self::Text { .. } => "text",
            Self::Trace { .. } => "trace",
            Self::Ground { .. } => "ground",
            Self::Pivot { .. } => "pivot",
            Self::Cuboid { .. } => "cuboid",
            Self::Cone { .. } => "cone",
        }
    }

    /// Its numbers in the order of its fields, without the point of a curve, which has a program of its own.
    #[must_use]
    pub fn numbers(&self) -> Vec<NodeId> {
        match self {
            Self::Polyline { points, .. } => points.concat(),
            Self::Curve { from, to, .. } => vec![*from, *to],
            Self::Circle { center, radius, .. } => [center.as_slice(), &[*radius]].concat(),
            Self::Arc { center, radius, from, to } => [center.as_slice(), &[*radius, *from, *to]].concat(),
            Self::Dot { center: at } | Self::Text { at, .. } | Self::Pivot { at } => at.clone(),
            Self::Spring { from, to, .. } | Self::Arrow { from, to } | Self::Ground { from, to } => {
                [from.as_slice(), to].concat()
            }
            Self::Trace { at, seconds, .. } => at.iter().chain(seconds).copied().collect(),
            Self::Cuboid { center, faces } => [center.clone(), faces.concat()].concat(),
            Self::Cone { from, to, radii } => [from.as_slice(), to, radii].concat(),
        }
    }

    /// This figure with the numbers and points of `other`, both handed to `join`, where they differ in
    /// nothing else.
    #[must_use]
    pub fn joined(&self, other: &Self, mut join: impl FnMut(NodeId, NodeId) -> NodeId) -> Option<Self> {
        let (mut made, mut plain) = (self.clone(), other.clone());
        let (own, others) = (made.nodes_mut(), plain.nodes_mut());
        if own.len() != others.len() {
            return None;
        }
        for (own, other) in own.into_iter().zip(others) {
            let (first, second) = (*own, *other);
            *other = first;
            *own = join(first, second);
        }
        (plain == *self).then_some(made)
    }

    /// The figure with points of one kind: where it has points of the plane and of space, (x, y) becomes
    /// (x, 0, y), as `dynamics-view` has it.
    #[must_use]
    pub fn lifted(mut self, zero: NodeId) -> Self {
        let mut points = self.points_mut();
        if points.iter().any(|point| point.len() == 3) {
            let of_plane = points.iter_mut().filter(|point| point.len() == 2);
            of_plane.for_each(|point| point.insert(1, zero));
        }
        self
    }

    fn points_mut(&mut self) -> Vec<&mut DrawnPoint> {
        match self {
            Self::Polyline { points, .. } => points.iter_mut().collect(),
            Self::Curve { point: at, .. }
            | Self::Circle { center: at, .. }
            | Self::Arc { center: at, .. }
            | Self::Dot { center: at }
            | Self::Text { at, .. }
            | Self::Trace { at, .. }
            | Self::Pivot { at } => vec![at],
            Self::Spring { from, to, .. }
            | Self::Arrow { from, to }
            | Self::Ground { from, to }
            | Self::Cone { from, to, .. } => vec![from, to],
            Self::Cuboid { center, faces } => [center].into_iter().chain(faces).collect(),
        }
    }

    /// All expressions, those of a curve's point included.
    fn nodes_mut(&mut self) -> Vec<&mut NodeId> {
        match self {
            Self::Polyline { points, .. } => points.iter_mut().flatten().collect(),
            Self::Curve { from, to, point, .. } => [from, to].into_iter().chain(point).collect(),
            Self::Circle { center, radius, .. } => center.iter_mut().chain([radius]).collect(),
            Self::Arc { center, radius, from, to } => center.iter_mut().chain([radius, from, to]).collect(),
            Self::Dot { center: at } | Self::Text { at, .. } | Self::Pivot { at } => at.iter_mut().collect(),
            Self::Spring { from, to, .. } | Self::Arrow { from, to } | Self::Ground { from, to } => {
                from.iter_mut().chain(to).collect()
            }
            Self::Trace { at, seconds, .. } => at.iter_mut().chain(seconds).collect(),
            Self::Cuboid { center, faces } => center.iter_mut().chain(faces.iter_mut().flatten()).collect(),
            Self::Cone { from, to, radii } => from.iter_mut().chain(to).chain(radii).collect(),
        }
    }
}

/// A figure with the pen that it is drawn with.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// What is drawn.
    pub figure: Figure,
    /// The pen.
    pub pen: Pen,
    /// Whether it is drawn at this instant: where the value is not zero. `None`: always.
    pub shown: Option<NodeId>,
}

impl Shape {
    /// The figure's numbers, then `shown` where it is given.
    #[must_use]
    pub fn numbers(&self) -> Vec<NodeId> {
        self.figure.numbers().into_iter().chain(self.shown).collect()
    }
}

/// A pen. Colours are names in lower case or `#rrggbb`, as pages have them; `auto` is the figure's own.
#[derive(Clone, Debug, PartialEq)]
pub struct Pen {
    /// Colour of lines, of text and of discs.
    pub color: String,
    /// Colour inside a closed figure; `None`: not filled.
    pub fill: Option<String>,
    /// Width of lines in pixels.
    pub width: f64,
    /// Whether lines are dashed.
    pub dashed: bool,
}

impl Default for Pen {
    fn default() -> Self {
        Self { color: "auto".to_owned(), fill: None, width: 2.0, dashed: false }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_of_one_kind_are_joined_number_by_number() {
        let mut graph = Graph::default();
        let [a, b, c, d] = [2, 3, 5, 7].map(|n| graph.integer(n));
        let disc = |x, y, radius, filled| Figure::Circle { center: vec![x, y], radius, filled };
        let joined = disc(a, b, c, true).joined(&disc(a, d, d, true), |x, y| if x == y { x } else { y });
        assert_eq!(joined, Some(disc(a, d, d, true)));
        assert_eq!(disc(a, b, c, true).joined(&disc(a, b, c, false), |x, _| x), None);
        assert_eq!(disc(a, b, c, true).joined(&Figure::Dot { center: vec![a, b, c] }, |x, _| x), None);
        let line = |points: &[&[NodeId]]| Figure::Polyline {
            points: points.iter().map(|point| point.to_vec()).collect(),
            closed: false,
        };
        // Three points of the plane are not two of space.
        assert_eq!(
            line(&[&[a, b], &[a, b], &[a, b]]).joined(&line(&[&[a, b, c], &[a, b, c]]), |x, _| x),
            None
        );
    }

    #[test]
    fn points_of_the_plane_stand_upright_beside_those_of_space() {
        let mut graph = Graph::default();
        let [zero, a, b, c] = [0, 2, 3, 5].map(|n| graph.integer(n));
        let spring = |from: &[NodeId], to: &[NodeId]| Figure::Spring {
            from: from.to_vec(),
            to: to.to_vec(),
            coils: 5,
        };
        assert_eq!(spring(&[a, b], &[a, b, c]).lifted(zero), spring(&[a, zero, b], &[a, b, c]));
        assert_eq!(spring(&[a, b], &[b, c]).lifted(zero), spring(&[a, b], &[b, c]));
    }

    #[test]
    fn numbers_of_a_picture_are_those_of_its_figures_in_order() {
        let mut graph = Graph::default();
        let [a, b, c, d] = [2, 3, 5, 7].map(|n| graph.integer(n));
        let shape = |figure, shown| Shape { figure, pen: Pen::default(), shown };
        let curve = Figure::Curve { from: a, to: b, segments: 3, point: vec![c, d] };
        let trace = Figure::Trace { name: String::new(), at: vec![c, d], seconds: Some(a) };
        let figures = Figures::Of(vec![shape(curve, None), shape(trace, Some(b))]);
        let picture = Picture { graph, figures, ..Picture::default() };
        // The point of a curve has a program of its own.
        assert_eq!(picture.numbers(), [a, b, c, d, a, b]);
    }

    #[test]
    fn what_is_not_followed_is_named_with_its_line() {
        let mut reason = NotFollowed { expression: "table()".to_owned(), line: Some(12) };
        assert_eq!(reason.to_string(), "its drawing contains `table()` in line 12, which is not followed");
        reason.line = None;
        assert_eq!(reason.to_string(), "its drawing contains `table()`, which is not followed");
    }
}

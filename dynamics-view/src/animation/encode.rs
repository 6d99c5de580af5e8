//! Pictures of many instants as a few columns of small integers.
//!
//! Every point has three numbers; in pages that show nothing of space the one for the depth is left out.
//!
//! Instants whose pictures have the same figures form a *scene*: its figures are written once, and every
//! number that moves is a column over the instants. Columns that are equal are written once, columns that
//! stand still are a single number, and the others are differences of integers: places in units of 1/20,000
//! of the view, finer than any screen. So a link of a mechanism costs a few bytes per instant.

use alloc::collections::BTreeMap;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::fmt::Write;

use crate::color::Color;
use crate::drawing::{Drawing, Figure, Shape};
use crate::point::Point;
use crate::text::{json, json_number};

/// Coordinate beyond which a point counts as not finite. Its square would overflow from 1e154 on.
const LARGEST_COORDINATE: f64 = 1e150;

/// Integers to a radian in which pages write angles. At the end of a line of 1000 pixels one is a tenth of a
/// pixel.
const PARTS_OF_RADIAN: f64 = 10_000.0;

/// Integers to the larger side of the view in which pages write places: twenty to a pixel where that side has
/// 1000 pixels.
const PARTS_OF_VIEW: f64 = 20_000.0;

/// The box that holds everything.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bounds {
    lo: [f64; 3],
    hi: [f64; 3],
}

impl Bounds {
    pub(super) const EMPTY: Self = Self { lo: [f64::INFINITY; 3], hi: [f64::NEG_INFINITY; 3] };

    /// A point, and what reaches from it so far along each axis.
    fn include(&mut self, point: [f64; 3], reach: [f64; 3]) {
        let reach = reach.map(f64::abs);
        if reach.iter().chain(&point).all(|x| x.abs() < LARGEST_COORDINATE) {
            self.lo = core::array::from_fn(|axis| self.lo[axis].min(point[axis] - reach[axis]));
            self.hi = core::array::from_fn(|axis| self.hi[axis].max(point[axis] + reach[axis]));
        }
    }

    /// All of a figure but what is measured in pixels, for which the page leaves room.
    fn hold(&mut self, figure: &Figure) {
        match figure {
            Figure::Circle { center, radius, .. } | Figure::Arc { center, radius, .. } => {
                self.include(center.in_space(), [*radius; 3]);
            }
            Figure::Cuboid { center, faces } => {
                let center = center.in_space();
                let halves = faces.map(|face| {
                    let face = face.in_space();
                    core::array::from_fn::<f64, 3, _>(|axis| face[axis] - center[axis])
                });
                let reach = core::array::from_fn(|axis| halves.iter().map(|half| half[axis].abs()).sum());
                self.include(center, reach);
            }
            Figure::Cone { from, to, radii } => {
                let (from, to) = (from.in_space(), to.in_space());
                let along: [f64; 3] = core::array::from_fn(|axis| to[axis] - from[axis]);
                let squared: f64 = along.iter().map(|x| x * x).sum();
                // A circle about the unit vector e reaches r √(1 − eᵢ²) along axis i.
                let level = along
                    .map(|x| if squared > 0.0 { libm::sqrt((1.0 - x * x / squared).max(0.0)) } else { 1.0 });
                self.include(from, level.map(|part| part * radii[0]));
                self.include(to, level.map(|part| part * radii[1]));
            }
            Figure::Polyline { points, .. } => {
                points.iter().for_each(|point| self.include(point.in_space(), [0.0; 3]))
            }
            Figure::Spring { from, to, .. } | Figure::Arrow { from, to } | Figure::Ground { from, to } => {
                [from, to].into_iter().for_each(|point| self.include(point.in_space(), [0.0; 3]));
            }
            Figure::Dot { center: at }
            | Figure::Text { at, .. }
            | Figure::Trace { at, .. }
            | Figure::Pivot { at } => self.include(at.in_space(), [0.0; 3]),
        }
    }

    pub(super) fn union(self, other: Self) -> Self {
        Self {
            lo: core::array::from_fn(|axis| self.lo[axis].min(other.lo[axis])),
            hi: core::array::from_fn(|axis| self.hi[axis].max(other.hi[axis])),
        }
    }

    /// The integer grid of these bounds.
    pub(super) fn grid(self, spatial: bool) -> Grid {
        let unit = Grid { spatial, ..UNIT_GRID };
        if self.lo[0] > self.hi[0] {
            return unit;
        }
        let mut size: [f64; 3] = core::array::from_fn(|axis| self.hi[axis] - self.lo[axis]);
        if !spatial {
            size[DEPTH_AXIS] = 0.0;
        }
        let largest = size.into_iter().fold(0.0, f64::max);
        if largest < 1e-290 {
            // A single point gets a view about it.
            return Grid { origin: self.lo, ..unit };
        }
        let quantum = largest / PARTS_OF_VIEW;
        Grid {
            origin: core::array::from_fn(|axis| 0.5 * (self.lo[axis] + self.hi[axis])),
            quantum,
            half: size.map(|side| libm::ceil(0.5 * side / quantum) as i64),
            spatial,
        }
    }
}

/// Index of the axis that pages of planar drawings leave out.
const DEPTH_AXIS: usize = 1;

/// Places as integers, counted from the middle of the view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Grid {
    pub(super) origin: [f64; 3],
    pub(super) quantum: f64,
    /// Half the sides of the view.
    pub(super) half: [i64; 3],
    /// Whether there is a depth.
    pub(super) spatial: bool,
}

/// The grid of the square with side 2 about the origin.
const UNIT_GRID: Grid =
    Grid { origin: [0.0; 3], quantum: 2.0 / PARTS_OF_VIEW, half: [10_000; 3], spatial: false };

/// What a number of a figure measures.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Measure {
    /// Along this axis.
    Place(usize),
    Length,
    Angle,
}

impl Grid {
    /// The axes that are written.
    pub(super) fn axes(&self) -> impl Iterator<Item = usize> + use<> {
        let spatial = self.spatial;
        (0..3).filter(move |&axis| spatial || axis != DEPTH_AXIS)
    }

    fn integer(&self, value: f64, measure: Measure) -> Option<i64> {
        let parts = match measure {
            Measure::Place(axis) => (value - self.origin[axis]) / self.quantum,
            Measure::Length => value / self.quantum,
            Measure::Angle => value * PARTS_OF_RADIAN,
        };
        // 2⁵³: beyond, the page's numbers have gaps.
        (parts.abs() < 9e15).then(|| libm::round(parts) as i64)
    }
}

/// One value per instant of a scene, and only one while it stands still.
#[derive(Clone, Debug, PartialEq)]
enum Column<T> {
    Still(T),
    Moving(Vec<T>),
}

impl<T: Clone + PartialEq> Column<T> {
    /// Adds the value of the instant after `seen` others.
    fn push(&mut self, value: T, seen: usize) {
        match self {
            Self::Still(still) if *still == value => {}
            Self::Still(still) => {
                let mut values = alloc::vec![still.clone(); seen];
                values.push(value);
                *self = Self::Moving(values);
            }
            Self::Moving(values) => values.push(value),
        }
    }
}

/// A number that may be NaN and then equals itself.
#[derive(Clone, Copy, Debug)]
struct EncodedNumber(f64);

impl PartialEq for EncodedNumber {
    fn eq(&self, other: &Self) -> bool {
        self.0 == other.0 || (self.0.is_nan() && other.0.is_nan())
    }
}

/// The instants whose pictures have the same figures.
#[derive(Debug)]
struct Scene {
    /// What stays the same of each figure, as the inside of a JSON object.
    figures: Vec<String>,
    measures: Vec<Measure>,
    numbers: Vec<Column<EncodedNumber>>,
    /// The words of text figures in order.
    words: Vec<Column<String>>,
    instants: usize,
}

/// The pictures of one motion.
#[derive(Debug)]
pub(super) struct Reel {
    scenes: Vec<Scene>,
    known: BTreeMap<Vec<String>, usize>,
    /// The scene of each instant.
    order: Vec<usize>,
    pub(super) bounds: Bounds,
    /// Whether any point is one of space.
    pub(super) spatial: bool,
    /// The colour of lines that have none of their own.
    ink: Color,
}

/// A picture taken apart.
#[derive(Default)]
struct Parts {
    figures: Vec<String>,
    measures: Vec<Measure>,
    numbers: Vec<f64>,
    words: Vec<String>,
}

impl Reel {
    /// An empty reel; where several motions share a view, lines take the `ink` of their motion.
    pub(super) fn new(ink: Color) -> Self {
        Self {
            scenes: Vec::new(),
            known: BTreeMap::new(),
            order: Vec::new(),
            bounds: Bounds::EMPTY,
            spatial: false,
            ink,
        }
    }

    /// Adds the picture of the next instant.
    pub(super) fn push(&mut self, drawing: &Drawing) {
        let mut parts = Parts::default();
        for shape in drawing.shapes() {
            self.take_apart(shape, &mut parts);
        }
        let Parts { figures, measures, numbers, words } = parts;
        let numbers = numbers.into_iter().map(EncodedNumber);
        if let Some(&id) = self.known.get(&figures) {
            let scene = &mut self.scenes[id];
            for (column, number) in scene.numbers.iter_mut().zip(numbers) {
                column.push(number, scene.instants);
            }
            for (column, word) in scene.words.iter_mut().zip(words) {
                column.push(word, scene.instants);
            }
            scene.instants += 1;
            self.order.push(id);
            return;
        }
        self.order.push(self.scenes.len());
        self.known.insert(figures.clone(), self.scenes.len());
        self.scenes.push(Scene {
            figures,
            measures,
            numbers: numbers.map(Column::Still).collect(),
            words: words.into_iter().map(Column::Still).collect(),
            instants: 1,
        });
    }

    fn take_apart(&mut self, shape: &Shape, parts: &mut Parts) {
        let Sketch { mut figure, points, lengths, angles, own, solid } =
            Sketch::of(&shape.figure, &mut parts.words);
        pen(&mut figure, shape, own.unwrap_or(self.ink));
        self.spatial |= solid || points.iter().any(|point| matches!(point, Point::Spatial(_)));
        self.bounds.hold(&shape.figure);
        for point in points {
            let place = point.in_space();
            parts.numbers.extend(place);
            parts.measures.extend([0, 1, 2].map(Measure::Place));
        }
        for length in lengths {
            parts.numbers.push(length);
            parts.measures.push(Measure::Length);
        }
        for angle in angles.into_iter().flatten() {
            parts.numbers.push(angle);
            parts.measures.push(Measure::Angle);
        }
        parts.figures.push(figure);
    }

    /// As JSON: `{"scenes":[…],"order":[…]}`, the order left out where there is one scene.
    pub(super) fn to_json(&self, grid: &Grid) -> String {
        let scenes: Vec<_> = self.scenes.iter().map(|scene| scene.to_json(grid)).collect();
        let mut out = format!("{{\"scenes\":[{}]", scenes.join(","));
        if self.scenes.len() > 1 {
            let order: Vec<_> = self.order.iter().map(ToString::to_string).collect();
            let _ = write!(out, ",\"order\":[{}]", order.join(","));
        }
        out.push('}');
        out
    }
}

/// A figure apart from its pen.
struct Sketch {
    /// What does not move, without the closing brace.
    figure: String,
    points: Vec<Point>,
    /// Radii of what is round.
    lengths: Vec<f64>,
    /// From where to where an arc goes.
    angles: Option<[f64; 2]>,
    /// Its colour, where it is not that of the drawing.
    own: Option<Color>,
    /// Whether it is of space whatever its points are.
    solid: bool,
}

impl Sketch {
    fn of(drawn: &Figure, words: &mut Vec<String>) -> Self {
        let (mut figure, mut points) = (String::new(), Vec::new());
        let (mut lengths, mut angles, mut own, mut solid) = (Vec::new(), None, None, false);
        match drawn {
            Figure::Polyline { points: corners, closed } => {
                points.extend(corners);
                let _ = write!(figure, "\"k\":\"line\",\"n\":{}", corners.len());
                if *closed {
                    figure.push_str(",\"z\":1");
                }
            }
            Figure::Circle { center, radius, filled } => {
                points.push(*center);
                lengths.push(*radius);
                figure.push_str(if *filled { "\"k\":\"disc\"" } else { "\"k\":\"circle\"" });
                if *filled {
                    own = Some(Color::Accent);
                }
            }
            Figure::Arc { center, radius, from, to } => {
                points.push(*center);
                lengths.push(*radius);
                angles = Some([*from, *to]);
                figure.push_str("\"k\":\"arc\"");
            }
            Figure::Dot { center } => {
                points.push(*center);
                figure.push_str("\"k\":\"dot\"");
                own = Some(Color::Accent);
            }
            Figure::Spring { from, to, coils } => {
                points.extend([from, to]);
                let _ = write!(figure, "\"k\":\"spring\",\"n\":{}", (*coils).clamp(1, 500));
            }
            Figure::Arrow { from, to } => {
                points.extend([from, to]);
                figure.push_str("\"k\":\"arrow\"");
            }
            Figure::Text { at, text, beside } => {
                points.push(*at);
                let _ = write!(figure, "\"k\":\"text\",\"b\":{}", u8::from(*beside));
                words.push(text.clone());
                own = Some(Color::Ink);
            }
            Figure::Trace { name, at, seconds } => {
                points.push(*at);
                let _ = write!(figure, "\"k\":\"trace\",\"name\":{}", json(name));
                if let Some(seconds) = seconds {
                    let _ = write!(figure, ",\"s\":{}", json_number(*seconds));
                }
                own = Some(Color::Accent);
            }
            Figure::Ground { from, to } => {
                points.extend([from, to]);
                figure.push_str("\"k\":\"ground\"");
                own = Some(Color::Faint);
            }
            Figure::Pivot { at } => {
                points.push(*at);
                figure.push_str("\"k\":\"pivot\"");
                own = Some(Color::Faint);
            }
            Figure::Cuboid { center, faces } => {
                points.push(*center);
                points.extend(faces);
                figure.push_str("\"k\":\"cuboid\"");
                (own, solid) = (Some(Color::Accent), true);
            }
            Figure::Cone { from, to, radii } => {
                points.extend([from, to]);
                lengths.extend(radii);
                figure.push_str("\"k\":\"cone\"");
                (own, solid) = (Some(Color::Accent), true);
            }
        }
        Self { figure, points, lengths, angles, own, solid }
    }
}

fn pen(figure: &mut String, shape: &Shape, own: Color) {
    let resolved = |color: Color| if color == Color::Auto { own } else { color };
    let _ =
        write!(figure, ",\"c\":{},\"w\":{}", json(&resolved(shape.color).role()), json_number(shape.width));
    if let Some(fill) = shape.fill {
        let _ = write!(figure, ",\"f\":{}", json(&resolved(fill).role()));
    }
    if shape.dashed {
        figure.push_str(",\"d\":1");
    }
}

impl Scene {
    fn to_json(&self, grid: &Grid) -> String {
        let mut columns: Vec<String> = Vec::new();
        let mut written: BTreeMap<String, usize> = BTreeMap::new();
        let mut places: Vec<String> = Vec::new();
        let written_axes: Vec<usize> = grid.axes().collect();
        for (column, measure) in self.numbers.iter().zip(&self.measures) {
            if matches!(measure, Measure::Place(axis) if !written_axes.contains(axis)) {
                continue;
            }
            let text = match column {
                Column::Still(value) => match grid.integer(value.0, *measure) {
                    Some(integer) => integer.to_string(),
                    None => String::from("null"),
                },
                Column::Moving(values) => {
                    differences(values.iter().map(|value| grid.integer(value.0, *measure)))
                }
            };
            let id = *written.entry(text.clone()).or_insert_with(|| {
                columns.push(text);
                columns.len() - 1
            });
            places.push(id.to_string());
        }
        let words: Vec<_> = self.words.iter().map(words_json).collect();
        let figures: Vec<_> = self.figures.iter().map(|inside| format!("{{{inside}}}")).collect();
        format!(
            "{{\"figures\":[{}],\"columns\":[{}],\"places\":[{}],\"words\":[{}]}}",
            figures.join(","),
            columns.join(","),
            places.join(","),
            words.join(",")
        )
    }
}

fn words_json(column: &Column<String>) -> String {
    match column {
        Column::Still(word) => json(word),
        Column::Moving(words) => {
            let words: Vec<_> = words.iter().map(|word| json(word)).collect();
            format!("[{}]", words.join(","))
        }
    }
}

/// `[first, difference, difference, …]`; a missing value is `null` and the difference after it counts from
/// the last one there was.
pub(super) fn differences(values: impl Iterator<Item = Option<i64>>) -> String {
    let mut out = String::from("[");
    let mut last = 0;
    for (k, value) in values.enumerate() {
        if k > 0 {
            out.push(',');
        }
        match value {
            Some(value) => {
                let _ = write!(out, "{}", value - last);
                last = value;
            }
            None => out.push_str("null"),
        }
    }
    out.push(']');
    out
}

#[cfg(test)]
mod tests;

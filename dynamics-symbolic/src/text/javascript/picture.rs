//! The picture of a model in JavaScript: a program for the numbers of its figures, and what the figures are.
//!
//! The program writes the numbers of all figures one after the other, as [`Shape::numbers`] has them. The
//! points of curves follow behind them, each curve in a loop.

use std::mem;

use crate::graph::NodeId;
use crate::mechanics::{Figure, Figures, Model, NamedPoint, Pen, Picture, Shape};
use crate::schedule::{Program, Staging, schedule};

use super::super::program::lines;
use super::super::source::STYLE;
use super::{ARGUMENTS, JavaScript};

/// A printed picture.
#[derive(Default)]
pub(super) struct Printed {
    /// The programs `points` and `drawing` and the list `figures`: members of the object of all programs.
    pub(super) programs: String,
    /// What the page knows of them: members of its `model`.
    pub(super) about: String,
    /// Whether it shows anything of space.
    pub(super) in_space: bool,
    /// Why a part of it is left out, in words.
    pub(super) obstacle: Option<String>,
}

/// Prints a picture as far as its programs take no more than so many operations: without its drawing, or
/// without both where they take more.
pub(super) fn picture(language: &JavaScript, model: &mut Model, picture: Picture, most: usize) -> Printed {
    let Picture { graph, figures, mut points, .. } = picture;
    // The picture has expressions of its own.
    let declared = mem::replace(&mut model.graph, graph);
    let mut printed = Printed::default();
    let mut left = most;
    let program = points_program(model, &points);
    match left.checked_sub(program.cost.total()) {
        Some(rest) => left = rest,
        None => {
            printed.obstacle = Some(left_out("points take", program.cost.total(), "has no picture"));
            points.clear();
        }
    }
    if !points.is_empty() {
        printed.programs = format!("points: {},\n", super::function(language, model, &program));
    }
    printed.in_space = points.iter().any(|point| point.at.len() == 3);
    if let Figures::Of(shapes) = &figures {
        let operations = drawing_operations(model, shapes);
        if operations <= left {
            printed.in_space = shapes.iter().any(|shape| dimension(&shape.figure) == 3);
            printed.programs.push_str(&drawing(language, model, shapes, printed.in_space));
        } else {
            let instead = if points.is_empty() { "has no picture" } else { "draws points" };
            printed.obstacle = Some(left_out("drawing takes", operations, instead));
        }
    }
    model.graph = declared;
    let named = points
        .iter()
        .map(|NamedPoint { name, at }| format!("{{ name: {}, dimension: {} }}", quoted(name), at.len()));
    let Printed { in_space, about, .. } = &mut printed;
    *about = format!("space: {in_space}, points: [{}]", named.collect::<Vec<_>>().join(", "));
    printed
}

fn left_out(what: &str, operations: usize, instead: &str) -> String {
    format!("its {what} {operations} operations, too many beside its programs: its live page {instead}")
}

fn points_program(model: &Model, points: &[NamedPoint]) -> Program {
    let all: Vec<NodeId> = points.iter().flat_map(|point| point.at.iter().copied()).collect();
    schedule(&model.graph, "points", &all, Staging::Inline)
}

/// Operations of the program of a drawing. The point of a curve counts once: it stands in a loop.
fn drawing_operations(model: &Model, shapes: &[Shape]) -> usize {
    let numbers: Vec<NodeId> = shapes.iter().flat_map(Shape::numbers).collect();
    let curves = shapes.iter().filter_map(|shape| match &shape.figure {
        Figure::Curve { point, .. } => Some(point.as_slice()),
        _ => None,
    });
    let all = [numbers.as_slice()].into_iter().chain(curves);
    all.map(|nodes| schedule(&model.graph, "drawing", nodes, Staging::Inline).cost.total()).sum()
}

fn drawing(language: &JavaScript, model: &Model, shapes: &[Shape], in_space: bool) -> String {
    let numbers: Vec<NodeId> = shapes.iter().flat_map(Shape::numbers).collect();
    let program = schedule(&model.graph, "drawing", &numbers, Staging::Inline);
    let mut body = statements(language, model, &program, "out", "  ", |i| i.to_string());
    let (mut figures, mut next, mut end) = (Vec::new(), 0, numbers.len());
    for shape in shapes {
        let count = shape.figure.numbers().len();
        let own = match &shape.figure {
            Figure::Curve { segments, point, .. } => {
                body.push_str(&curve(language, model, point, *segments, [next, end]));
                let first = end;
                end += (segments + 1) * point.len();
                [first, (segments + 1) * point.len()]
            }
            _ => [next, count],
        };
        figures.push(figure(shape, own, next + count, in_space));
        next += count + usize::from(shape.shown.is_some());
    }
    format!(
        "drawing: {{ results: {end}, constants: 0, run({ARGUMENTS}) {{\n{body}}} }},\n\
         figures: [\n{}\n],\n",
        figures.join(",\n")
    )
}

/// The assignments of a program, and its results as elements of an array.
fn statements(
    language: &JavaScript,
    model: &Model,
    program: &Program,
    into: &str,
    indent: &str,
    place: impl Fn(usize) -> String,
) -> String {
    let (lines, results) = lines(language, model, program, STYLE);
    let lines = lines.iter().map(|line| format!("{indent}{}\n", line.text));
    let results = results.iter().enumerate();
    let results = results.map(|(i, value)| format!("{indent}{into}[{}] = {};\n", place(i), value.text));
    lines.chain(results).collect()
}

/// The loop over the points of a curve. Its ends are the numbers from `ends` on, its points go to `start`.
fn curve(
    language: &JavaScript,
    model: &Model,
    point: &[NodeId],
    segments: usize,
    [ends, start]: [usize; 2],
) -> String {
    let program = schedule(&model.graph, "curve", point, Staging::Inline);
    let dimension = point.len();
    let place = |axis| format!("{start} + {dimension}*i + {axis}");
    let body = statements(language, model, &program, "out", "    ", place);
    format!(
        "  for (let i = 0; i <= {segments}; i++) {{\n    \
         const s = out[{ends}]*(1 - i/{segments}) + out[{}]*(i/{segments});\n{body}  }}\n",
        ends + 1
    )
}

/// `[kind, places of its numbers, style, extra]`; a place is a number, or [first, count]. `after` is the
/// place behind the figure's own numbers.
fn figure(shape: &Shape, [first, count]: [usize; 2], after: usize, in_space: bool) -> String {
    let Pen { color, fill, width, dashed } = &shape.pen;
    let mut style = Vec::new();
    if color != "auto" {
        style.push(format!("color: {}", quoted(color)));
    }
    style.extend(fill.iter().map(|fill| format!("fill: {}", quoted(fill))));
    if *width != Pen::default().width {
        style.push(format!("width: {width:?}"));
    }
    if *dashed {
        style.push("dashed: true".to_owned());
    }
    let mut extra = match &shape.figure {
        Figure::Polyline { closed: true, .. } => vec!["closed: true".to_owned()],
        Figure::Circle { filled: true, .. } => vec!["filled: true".to_owned()],
        Figure::Spring { coils, .. } => vec![format!("coils: {coils}")],
        Figure::Text { text, beside, .. } => vec![format!("text: {}, beside: {beside}", quoted(text))],
        Figure::Trace { name, seconds, .. } => {
            vec![format!("name: {}, seconds: {}", quoted(name), seconds.is_some())]
        }
        _ => Vec::new(),
    };
    let mut places = format!("[{first}, {count}]");
    if shape.shown.is_some() {
        extra.push("shown: true".to_owned());
        places.push_str(&format!(", {after}"));
    }
    if in_space && dimension(&shape.figure) == 2 {
        extra.push("dimension: 2".to_owned());
    }
    let kind = match shape.figure.kind() {
        "curve" => "polyline",
        kind => kind,
    };
    let (style, extra) = (style.join(", "), extra.join(", "));
    format!("[\"{kind}\", [{places}], {{ {style} }}, {{ {extra} }}]")
}

/// The largest number of coordinates of a figure's points.
fn dimension(figure: &Figure) -> usize {
    match figure {
        Figure::Polyline { points, .. } => points.iter().map(Vec::len).max().unwrap_or(2),
        Figure::Curve { point: at, .. }
        | Figure::Circle { center: at, .. }
        | Figure::Arc { center: at, .. }
        | Figure::Dot { center: at }
        | Figure::Text { at, .. }
        | Figure::Trace { at, .. }
        | Figure::Pivot { at }
        | Figure::Cuboid { center: at, .. } => at.len(),
        Figure::Spring { from, to, .. }
        | Figure::Arrow { from, to }
        | Figure::Ground { from, to }
        | Figure::Cone { from, to, .. } => from.len().max(to.len()),
    }
}

/// A text of JavaScript that stands in a page: what would end a script is written by its number.
pub(crate) fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            '\n' => out.push_str("\\n"),
            '<' | '>' | '&' | '\u{2028}' | '\u{2029}' => out.push_str(&format!("\\u{:04x}", c as u32)),
            c if c < ' ' => out.push_str(&format!("\\u{:04x}", c as u32)),
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

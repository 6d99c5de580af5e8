//! The methods of `Drawing`.

use std::mem;
use std::rc::Rc;

use dynamics_symbolic::graph::{NodeId, Number, Unary};
use dynamics_symbolic::mechanics::{DrawnPoint, Extra, Figure, Pen, Shape};
use syn::Ident;

use super::super::Elaborator;
use super::super::calls::Argument;
use super::super::values::{Canvas, Choice, Condition, Scalar, Value};
use crate::messages;

/// Most figures of a drawing. Each one is painted in every frame of a page.
const MOST_FIGURES: usize = 2_000;

/// The methods that set the pen.
const PEN_METHODS: &[&str] = &["color", "fill", "width", "dashed", "plain"];

/// Coils of a spring that says nothing of them.
const COILS: u32 = 9;

/// Straight pieces of an arc in space.
const PIECES_OF_ARC: usize = 48;

type Text = Rc<Choice<String>>;

impl Elaborator<'_> {
    /// `drawing.method(..)`.
    pub(super) fn figure_method(
        &mut self,
        canvas: Rc<Canvas>,
        name: &Ident,
        arguments: &[Argument],
    ) -> Value {
        self.steps += 1;
        let made = if PEN_METHODS.iter().any(|known| name == known) {
            self.with_pen(canvas, name, arguments)
        } else {
            self.made(canvas, name, arguments)
        };
        match made {
            Some(canvas) => Value::Drawing(canvas),
            None if self.diagnostics.raised() > 0 => Value::Poison,
            None => self.fail(name.span(), &messages::not_followed(name)),
        }
    }

    /// The drawing with another pen.
    fn with_pen(
        &mut self,
        mut canvas: Rc<Canvas>,
        name: &Ident,
        arguments: &[Argument],
    ) -> Option<Rc<Canvas>> {
        let pen = &canvas.pen;
        let pen = match (name.to_string().as_str(), arguments) {
            ("color", [(Value::Color(color), _)]) => {
                pen.changed(color, &|pen, color| pen.color.clone_from(color))
            }
            ("fill", [(Value::Color(color), _)]) => {
                pen.changed(color, &|pen, color| pen.fill = Some(color.clone()))
            }
            ("width", [(width, place)]) => {
                let width = self.scalar(width.clone(), *place)?;
                // Of a width that parameters decide nobody knows the number here.
                let width = self.value_of(&width)?;
                canvas.pen.changed(&Choice::Is(width), &|pen, width| pen.width = *width)
            }
            ("dashed", []) => pen.changed(&Choice::Is(true), &|pen, dashed| pen.dashed = *dashed),
            ("plain", []) => Some(Choice::Is(Pen::default())),
            _ => None,
        };
        let pen = pen?;
        Rc::make_mut(&mut canvas).pen = pen;
        Some(canvas)
    }

    /// The drawing with one more figure; `None` where this is no figure, or a part of it has no value.
    fn made(&mut self, canvas: Rc<Canvas>, name: &Ident, arguments: &[Argument]) -> Option<Rc<Canvas>> {
        let figure = match (name.to_string().as_str(), arguments) {
            ("line", [from, to]) => {
                Figure::Polyline { points: vec![self.point(from)?, self.point(to)?], closed: false }
            }
            ("polyline", [all]) => Figure::Polyline { points: self.points(all)?, closed: false },
            ("polygon", [all]) => Figure::Polyline { points: self.points(all)?, closed: true },
            ("curve", [from, to, segments, curve]) => self.curve(from, to, segments, curve)?,
            ("disc" | "circle", [center, radius]) => {
                let filled = name == "disc";
                Figure::Circle { center: self.point(center)?, radius: self.length(radius)?, filled }
            }
            ("dot", [center]) => Figure::Dot { center: self.point(center)? },
            ("rectangle", [center, width, height, angle]) => self.rectangle(center, width, height, angle)?,
            ("arc", [center, radius, from, to]) => self.arc(center, radius, from, to)?,
            ("spring", [from, to]) => {
                Figure::Spring { from: self.point(from)?, to: self.point(to)?, coils: COILS }
            }
            ("coils", [from, to, (Value::Integer(n), _)]) => {
                let coils = u32::try_from(n.value).ok()?;
                Figure::Spring { from: self.point(from)?, to: self.point(to)?, coils }
            }
            ("arrow", [from, to]) => Figure::Arrow { from: self.point(from)?, to: self.point(to)? },
            ("ground", [from, to]) => Figure::Ground { from: self.point(from)?, to: self.point(to)? },
            ("pivot", [at]) => Figure::Pivot { at: self.point(at)? },
            ("trace" | "tail", [(Value::Text(text), _), at, rest @ ..]) => {
                let at = self.point(at)?;
                let seconds = match rest {
                    [] => None,
                    [seconds] => Some(self.length(seconds)?),
                    _ => return None,
                };
                let figure = |name: &str| Figure::Trace { name: name.into(), at: at.clone(), seconds };
                return self.with_text(canvas, text, &figure);
            }
            ("label" | "text", [at, (Value::Text(text), _)]) => {
                let (at, beside) = (self.point(at)?, name == "label");
                let figure = |text: &str| Figure::Text { at: at.clone(), text: text.into(), beside };
                return self.with_text(canvas, text, &figure);
            }
            ("cuboid", [frame, center, lengths]) => self.cuboid(name, frame, center, lengths)?,
            ("cylinder" | "cone", [from, to, radius]) => {
                let (from, to, radius) = (self.point(from)?, self.point(to)?, self.length(radius)?);
                let end = if name == "cone" { self.model.graph.zero() } else { radius };
                Figure::Cone { from, to, radii: [radius, end] }
            }
            ("axes", [length]) => return self.axes(canvas, length),
            ("with", [(Value::Drawing(other), _)]) => {
                let mut canvas = canvas;
                Rc::make_mut(&mut canvas).shapes.extend_from_slice(&other.shapes);
                return (canvas.shapes.len() <= MOST_FIGURES).then_some(canvas);
            }
            _ => return None,
        };
        self.with_figure(canvas, &Condition::Known(true), &figure)
    }

    /// The drawing with one more figure where a condition holds, in every case of the pen.
    fn with_figure(
        &mut self,
        mut canvas: Rc<Canvas>,
        condition: &Condition,
        figure: &Figure,
    ) -> Option<Rc<Canvas>> {
        let figure = figure.clone().lifted(self.model.graph.zero());
        let pen = canvas.pen.clone();
        for (holds, pen) in pen.cases() {
            let holds = condition.clone().and(holds);
            if let Some(shown) = self.shown(&holds, None) {
                let shape = Shape { figure: figure.clone(), pen: pen.clone(), shown };
                Rc::make_mut(&mut canvas).shapes.push(shape);
            }
        }
        (canvas.shapes.len() <= MOST_FIGURES).then_some(canvas)
    }

    /// The drawing with a figure for every case of a text.
    fn with_text(
        &mut self,
        mut canvas: Rc<Canvas>,
        text: &Text,
        figure: &dyn Fn(&str) -> Figure,
    ) -> Option<Rc<Canvas>> {
        for (holds, text) in text.cases() {
            canvas = self.with_figure(canvas, &holds, &figure(text))?;
        }
        Some(canvas)
    }

    /// What is not zero where a condition holds and the figure is shown anyway; `None` where it never is,
    /// `Some(None)` where it always is.
    fn shown(&mut self, condition: &Condition, shown: Option<NodeId>) -> Option<Option<NodeId>> {
        match condition {
            Condition::Known(true) => Some(shown),
            Condition::Known(false) => None,
            condition => {
                let (zero, one) = (self.model.graph.zero(), self.model.graph.one());
                Some(Some(self.select_node(condition, shown.unwrap_or(one), zero)))
            }
        }
    }

    /// `if condition { a } else { b }`. Figures of the same kind are one figure whose numbers are chosen.
    /// Otherwise each is shown where its condition holds.
    pub(in super::super) fn select_drawing(
        &mut self,
        condition: &Condition,
        a: &Canvas,
        b: &Canvas,
    ) -> Option<Value> {
        let pen = Choice::between(condition, &a.pen, &b.pen)?;
        let alike = a.shapes.iter().zip(&b.shapes).take_while(|(a, b)| a == b).count();
        let mut shapes = a.shapes[..alike].to_vec();
        let (rest_a, rest_b) = (&a.shapes[alike..], &b.shapes[alike..]);
        if rest_a.len() == rest_b.len()
            && let Some(joined) = self.joined(condition, rest_a, rest_b)
        {
            shapes.extend(joined);
        } else {
            for (holds, rest) in [(condition.clone(), rest_a), (condition.clone().not(), rest_b)] {
                for shape in rest {
                    if let Some(shown) = self.shown(&holds, shape.shown) {
                        shapes.push(Shape { shown, ..shape.clone() });
                    }
                }
            }
        }
        (shapes.len() <= MOST_FIGURES).then(|| Value::Drawing(Rc::new(Canvas { shapes, pen })))
    }

    /// Shapes that are alike but for their numbers, pair by pair.
    fn joined(&mut self, condition: &Condition, a: &[Shape], b: &[Shape]) -> Option<Vec<Shape>> {
        let mut all = Vec::new();
        for (a, b) in a.iter().zip(b) {
            if a.pen != b.pen || a.shown != b.shown {
                return None;
            }
            let figure = a.figure.joined(&b.figure, |x, y| self.select_node(condition, x, y))?;
            all.push(Shape { figure, ..a.clone() });
        }
        Some(all)
    }

    fn length(&mut self, (value, place): &Argument) -> Option<NodeId> {
        self.scalar(value.clone(), *place).map(|x| x.node)
    }

    /// A curve is its point at one number, and the numbers that are run over.
    fn curve(
        &mut self,
        from: &Argument,
        to: &Argument,
        segments: &Argument,
        curve: &Argument,
    ) -> Option<Figure> {
        let (from, to) = (self.length(from)?, self.length(to)?);
        let Value::Integer(segments) = segments.0 else { return None };
        let segments = usize::try_from(segments.value).ok()?.max(1);
        let running = self.extra_scalar(Extra::Running);
        let point = self.call_argument(curve, vec![running.into()]);
        let point = self.point(&(point, curve.1))?;
        Some(Figure::Curve { from, to, segments, point })
    }

    fn rectangle(
        &mut self,
        center: &Argument,
        width: &Argument,
        height: &Argument,
        angle: &Argument,
    ) -> Option<Figure> {
        let (center, angle) = (self.point(center)?, self.length(angle)?);
        let (width, height) = (self.length(width)?, self.length(height)?);
        let graph = &mut self.model.graph;
        let (sin, cos) = (graph.unary(Unary::Sin, angle), graph.unary(Unary::Cos, angle));
        let half = graph.number(Number::Float(0.5));
        let (right, up) = (graph.mul(half, width), graph.mul(half, height));
        let (left, down) = (graph.neg(right), graph.neg(up));
        let corners = [(left, down), (right, down), (right, up), (left, up)].map(|(x, y)| {
            let (along, across) = (graph.mul(cos, x), graph.mul(sin, y));
            let dx = graph.sub(along, across);
            let (along, across) = (graph.mul(sin, x), graph.mul(cos, y));
            (dx, graph.add(along, across))
        });
        let points = corners.map(|by| self.offset(&center, by)).into();
        Some(Figure::Polyline { points, closed: true })
    }

    /// A point moved within the plane of plane figures, in space that of x and z.
    fn offset(&mut self, point: &DrawnPoint, (dx, dy): (NodeId, NodeId)) -> DrawnPoint {
        let mut moved = point.clone();
        let graph = &mut self.model.graph;
        moved[0] = graph.add(point[0], dx);
        if let (Some(last), Some(known)) = (moved.last_mut(), point.last()) {
            *last = graph.add(*known, dy);
        }
        moved
    }

    fn arc(
        &mut self,
        center: &Argument,
        radius: &Argument,
        from: &Argument,
        to: &Argument,
    ) -> Option<Figure> {
        let (center, radius) = (self.point(center)?, self.length(radius)?);
        let (from, to) = (self.length(from)?, self.length(to)?);
        if center.len() == 2 {
            return Some(Figure::Arc { center, radius, from, to });
        }
        let angle = self.extra(Extra::Running);
        let graph = &mut self.model.graph;
        let (sin, cos) = (graph.unary(Unary::Sin, angle), graph.unary(Unary::Cos, angle));
        let by = (graph.mul(radius, cos), graph.mul(radius, sin));
        let point = self.offset(&center, by);
        Some(Figure::Curve { from, to, segments: PIECES_OF_ARC, point })
    }

    fn cuboid(
        &mut self,
        name: &Ident,
        frame: &Argument,
        center: &Argument,
        lengths: &Argument,
    ) -> Option<Figure> {
        let (Value::Record(record), at) = frame else { return None };
        let center = match &center.0 {
            Value::Array(items) | Value::Tuple(items) => {
                self.vector_of(items.iter().map(|item| (item.clone(), center.1)).collect())
            }
            other => other.clone(),
        };
        let (Value::Vector(center), Value::Array(lengths)) = (center, &lengths.0) else { return None };
        if center.len() != 3 || lengths.len() != 3 {
            return None;
        }
        let mut places = vec![center.clone()];
        for axis in 0..3 {
            let length = self.scalar(lengths[axis].clone(), *at)?;
            let graph = &mut self.model.graph;
            let half = graph.number(Number::Float(0.5));
            let half = graph.mul(half, length.node);
            let mut place = center.clone();
            place[axis] = Scalar { node: graph.add(place[axis].node, half), unit: length.unit };
            places.push(place);
        }
        let word = Ident::new("point", name.span());
        let mut points = Vec::new();
        for place in places {
            let arguments = vec![(Value::Record(record.clone()), *at), (Value::Vector(place), *at)];
            let point = self.library_call(record.ty, &word, arguments, *at);
            points.push(self.point(&(point, *at))?);
        }
        let [center, x, y, z] = <[DrawnPoint; 4]>::try_from(points).ok()?;
        Some(Figure::Cuboid { center, faces: [x, y, z] })
    }

    /// `Drawing::of_points(&[(name, point), ..])`: a chain from the origin through the points, each with a
    /// dot and a trace; `Drawing::of_places` without the chain.
    pub(super) fn drawing_of(&mut self, chained: bool, points: &Argument) -> Option<Value> {
        let Value::Array(items) = &points.0 else { return None };
        let (mut names, mut places) = (Vec::new(), Vec::new());
        for item in items.iter() {
            let Value::Tuple(pair) = item else { return None };
            let [Value::Text(name), place] = pair.as_slice() else { return None };
            names.push(name.clone());
            places.push(self.point(&(place.clone(), points.1))?);
        }
        let mut canvas: Rc<Canvas> = Rc::default();
        for (name, at) in names.iter().zip(&places) {
            let figure = |name: &str| Figure::Trace { name: name.into(), at: at.clone(), seconds: None };
            canvas = self.with_text(canvas, name, &figure)?;
        }
        let mut figures = Vec::new();
        if chained {
            let origin = vec![self.model.graph.zero(); places.first()?.len()];
            let points = [origin.clone()].into_iter().chain(places.iter().cloned()).collect();
            figures.extend([Figure::Polyline { points, closed: false }, Figure::Pivot { at: origin }]);
        }
        figures.extend(places.into_iter().map(|center| Figure::Dot { center }));
        for figure in figures {
            canvas = self.with_figure(canvas, &Condition::Known(true), &figure)?;
        }
        Some(Value::Drawing(canvas))
    }

    /// The axes of space with their names, in a pen of their own.
    fn axes(&mut self, canvas: Rc<Canvas>, length: &Argument) -> Option<Rc<Canvas>> {
        let (length, zero) = (self.length(length)?, self.model.graph.zero());
        let faint = Pen { color: "faint".to_owned(), width: 1.0, ..Pen::default() };
        let mut canvas = canvas;
        let pen = mem::replace(&mut Rc::make_mut(&mut canvas).pen, Choice::Is(faint));
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            let mut to = vec![zero; 3];
            to[axis] = length;
            let text = Figure::Text { at: to.clone(), text: name.to_owned(), beside: true };
            for figure in [Figure::Arrow { from: vec![zero; 3], to }, text] {
                canvas = self.with_figure(canvas, &Condition::Known(true), &figure)?;
            }
        }
        Rc::make_mut(&mut canvas).pen = pen;
        Some(canvas)
    }
}

//! The methods of `Drawing`.

use std::rc::Rc;

use dynamics_symbolic::graph::{NodeId, Number, Unary};
use dynamics_symbolic::mechanics::{Extra, Figure, Point, Shape, Style};
use syn::{Expr, ExprCall, ExprMethodCall, ExprPath, Ident};

use super::super::Elaborator;
use super::super::calls::Argument;
use super::super::values::{Condition, Scalar, Value};
use super::Choice;
use crate::diagnostics::Place;
use crate::messages;

/// Most figures of a drawing.
const MOST_FIGURES: usize = 10_000;

/// Coils of a spring that says nothing of them.
const COILS: u32 = 9;

/// Straight pieces of an arc in space.
const PIECES_OF_ARC: usize = 48;

/// Named colours; the page has them in lower case.
const COLORS: &[&str] =
    &["Auto", "Ink", "Faint", "Accent", "Blue", "Red", "Green", "Amber", "Purple", "Teal", "Brown", "Pink"];

/// The colours that `Color::cycle` takes in turn.
const CYCLE: [&str; 8] = ["blue", "red", "green", "amber", "purple", "teal", "brown", "pink"];

/// A drawing: its figures so far, and its pen.
#[derive(Clone, Debug, PartialEq)]
pub(in super::super) struct Canvas {
    shapes: Vec<Shape>,
    pen: Choice<Style>,
}

impl Default for Canvas {
    fn default() -> Self {
        Self { shapes: Vec::new(), pen: Choice::Is(Style::default()) }
    }
}

impl Canvas {
    /// The figures in the order in which they are painted.
    pub(in super::super) fn shapes(&self) -> &[Shape] {
        &self.shapes
    }
}

type Text = Rc<Choice<String>>;

impl<'a> Elaborator<'a> {
    /// `receiver.method(..)` where a drawing is followed.
    pub(in super::super) fn drawn_method(&mut self, e: &'a ExprMethodCall, receiver: Value) -> Value {
        let (name, at) = (&e.method, Place::from(e.method.span()));
        let is_of_constraint = name == "reaction" || name == "slip";
        if receiver.is_poison() {
            return Value::Poison;
        }
        if matches!(receiver, Value::Coordinates) && is_of_constraint {
            return self.of_constraint(e);
        }
        let arguments = self.arguments(&e.args);
        if arguments.iter().any(|(argument, _)| argument.is_poison()) {
            return Value::Poison;
        }
        let drawn = match &receiver {
            Value::Drawing(_) if name == "clone" && arguments.is_empty() => return receiver,
            Value::Drawing(canvas) => return self.figure_method(canvas, name, &arguments),
            Value::Array(items) => self.drawn_sequence(items, true, name, &arguments),
            Value::Sequence(items) => self.drawn_sequence(items, false, name, &arguments),
            Value::Scalar(x) => self.drawn_scalar(x, name, &arguments),
            Value::Function(f) => self.drawn_function(*f, name, &arguments),
            Value::Vector(_) | Value::Matrix(_) if name == "value" && arguments.is_empty() => {
                return receiver;
            }
            Value::Vector(_) if name == "rate" && arguments.is_empty() => {
                return self.time_derivative(receiver, name);
            }
            Value::Text(_) if name == "to_string" && arguments.is_empty() => return receiver,
            Value::Closure(_) if name == "clone" && arguments.is_empty() => return receiver,
            Value::Closure(_) => return self.fail(at, &messages::closure_method(name)),
            _ => None,
        };
        drawn.unwrap_or_else(|| self.method(receiver, name, arguments))
    }

    /// `path(..)` where a drawing is followed; `None` for what models have, too.
    pub(in super::super) fn drawn_call(&mut self, e: &'a ExprCall) -> Option<Value> {
        if let Some(value) = self.call_of_closure(e) {
            return Some(value);
        }
        let Expr::Path(path) = &*e.func else { return None };
        let names: Vec<String> = path.path.segments.iter().map(|s| s.ident.to_string()).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let place = Place::of(&e.func);
        match names.as_slice() {
            [.., "Drawing", "new" | "default"] if e.args.is_empty() => Some(Value::Drawing(Rc::default())),
            [.., "Color", "Rgb" | "cycle"] => {
                let arguments = self.arguments(&e.args);
                Some(self.color_of_numbers(names.last() == Some(&"cycle"), &arguments, place))
            }
            [.., "Point", "Planar" | "Spatial"] | [.., "String", "from"] if e.args.len() == 1 => {
                Some(self.expression(&e.args[0]))
            }
            [.., "iter", "once"] | ["once"] if e.args.len() == 1 => {
                let item = self.expression(&e.args[0]);
                Some(Value::Sequence(Rc::new(vec![item])))
            }
            _ => None,
        }
    }

    /// A path where a drawing is followed; `None` for what models have, too.
    pub(in super::super) fn drawn_path(&mut self, e: &ExprPath) -> Option<Value> {
        let mut last = e.path.segments.iter().rev().map(|s| &s.ident);
        match (last.next(), last.next()) {
            (Some(name), Some(ty)) if ty == "Color" && COLORS.iter().any(|known| name == known) => {
                Some(Value::Color(Rc::new(Choice::Is(name.to_string().to_lowercase()))))
            }
            // Imported constants of std are asserted to be std's, but not where only a drawing reads them. A
            // name of one letter is too likely to be the user's own.
            (Some(name), None) if name == "E" && self.frame().find("E").is_none() => {
                Some(self.fail(name.span(), &messages::foreign_constant(name)))
            }
            _ => None,
        }
    }

    /// `Color::Rgb(r, g, b)` and `Color::cycle(k)`.
    fn color_of_numbers(&mut self, cycle: bool, arguments: &[Argument], at: Place) -> Value {
        let mut numbers = Vec::new();
        for (value, _) in arguments {
            match value {
                Value::Integer(i) => numbers.push(i.value),
                Value::Poison => return Value::Poison,
                _ => {}
            }
        }
        let name = match (cycle, numbers.as_slice()) {
            (true, [k]) => CYCLE[k.rem_euclid(CYCLE.len() as i128) as usize].to_owned(),
            (false, [r, g, b]) => format!("#{r:02x}{g:02x}{b:02x}"),
            _ => return self.fail(at, &messages::foreign_function("Color", "")),
        };
        Value::Color(Rc::new(Choice::Is(name)))
    }

    /// `drawing.method(..)`.
    fn figure_method(&mut self, canvas: &Rc<Canvas>, name: &Ident, arguments: &[Argument]) -> Value {
        if let Some(pen) = self.pen_method(canvas, name, arguments) {
            return pen;
        }
        let made = self.made(canvas.clone(), name, arguments);
        match made {
            Some(canvas) => self.bounded(Value::Drawing(canvas), name.span()),
            None if self.diagnostics.raised() > 0 => Value::Poison,
            None => self.fail(name.span(), &messages::not_followed(name)),
        }
    }

    /// The methods that set the pen.
    fn pen_method(&mut self, canvas: &Rc<Canvas>, name: &Ident, arguments: &[Argument]) -> Option<Value> {
        let color = |arguments: &[Argument]| match arguments {
            [(Value::Color(color), _)] => Some(color.clone()),
            _ => None,
        };
        let pen = &canvas.pen;
        let pen = match (name.to_string().as_str(), arguments) {
            ("color", _) => pen.changed(&*color(arguments)?, &|style, color| style.color.clone_from(color)),
            ("fill", _) => pen.changed(&*color(arguments)?, &|style, color| style.fill = Some(color.clone())),
            ("width", [(width, place)]) => {
                let width = self.scalar(width.clone(), *place)?;
                // Of a width that parameters decide nobody knows the number here.
                let width = self.value_of(&width)?;
                pen.changed(&Choice::Is(width), &|style, width| style.width = *width)
            }
            ("dashed", []) => pen.changed(&Choice::Is(true), &|style, dashed| style.dashed = *dashed),
            ("plain", []) => Some(Choice::Is(Style::default())),
            _ => return None,
        };
        Some(Value::Drawing(Rc::new(Canvas { shapes: canvas.shapes.clone(), pen: pen? })))
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
                return Some(canvas);
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
        let pen = canvas.pen.clone();
        for (holds, style) in pen.cases() {
            let holds = condition.clone().and(holds);
            if let Some(shown) = self.shown(&holds, None) {
                let shape = Shape { figure: figure.clone(), style: style.clone(), shown };
                Rc::make_mut(&mut canvas).shapes.push(shape);
            }
        }
        if canvas.shapes.len() <= MOST_FIGURES {
            return Some(canvas);
        }
        self.exhausted = true;
        None
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
        Some(Value::Drawing(Rc::new(Canvas { shapes, pen })))
    }

    /// Shapes that are alike but for their numbers, pair by pair.
    fn joined(&mut self, condition: &Condition, a: &[Shape], b: &[Shape]) -> Option<Vec<Shape>> {
        let mut all = Vec::new();
        for (a, b) in a.iter().zip(b) {
            if a.style != b.style || a.shown != b.shown {
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
    fn offset(&mut self, point: &Point, (dx, dy): (NodeId, NodeId)) -> Point {
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
        let [center, x, y, z] = <[Point; 4]>::try_from(points).ok()?;
        Some(Figure::Cuboid { center, faces: [x, y, z] })
    }

    /// The axes of space with their names, in a pen of their own.
    fn axes(&mut self, canvas: Rc<Canvas>, length: &Argument) -> Option<Rc<Canvas>> {
        let (length, zero) = (self.length(length)?, self.model.graph.zero());
        let pen = canvas.pen.clone();
        let faint = Style { color: "faint".to_owned(), width: 1.0, ..Style::default() };
        let mut canvas = Rc::new(Canvas { shapes: canvas.shapes.clone(), pen: Choice::Is(faint) });
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

//! Calls: functions of the impl, constructors, and methods by path.

use std::rc::Rc;

use quote::ToTokens;
use syn::punctuated::Punctuated;
use syn::{Expr, ExprCall, ExprMethodCall, FnArg, Ident, Token};

use dynamics_symbolic::families::Axis;
use dynamics_symbolic::graph::{Dependence, Number};

use super::Elaborator;
use super::operators::Operator;
use super::scope::{Flow, Frame};
use super::values::{Scalar, Term, Value};
use crate::diagnostics::Place;
use crate::messages;

/// An argument with its place.
pub(super) type Argument = (Value, Place);

impl<'a> Elaborator<'a> {
    pub(super) fn arguments(&mut self, args: &'a Punctuated<Expr, Token![,]>) -> Vec<Argument> {
        args.iter().map(|e| (self.expression(e), Place::of(e))).collect()
    }

    /// `receiver.method(..)`.
    pub(super) fn method_call(&mut self, e: &'a ExprMethodCall, receiver: Value) -> Value {
        if self.draws() {
            return self.drawn_method(e, receiver);
        }
        if matches!(receiver, Value::Coordinates) && (e.method == "reaction" || e.method == "slip") {
            return self.of_constraint(e);
        }
        if let (Some(Expr::Closure(closure)), true) = (e.args.first(), e.method == "map" && e.args.len() == 1)
        {
            match receiver {
                Value::Range(range) => return self.map_range(range, closure, Place::of(&e.receiver)),
                Value::Sequence(items) => return self.map_sequence(&items, closure),
                Value::Mapped(made) => return self.map_mapped(&made, closure),
                _ => {}
            }
        }
        if e.args.iter().any(|a| matches!(a, Expr::Closure(_))) {
            if receiver.is_poison() {
                return Value::Poison;
            }
            return self.fail(e.method.span(), &messages::closure_method(&e.method));
        }
        let arguments = self.arguments(&e.args);
        self.method(receiver, &e.method, arguments)
    }

    /// A method of a value, whichever way it was called.
    pub(super) fn method(&mut self, receiver: Value, name: &Ident, arguments: Vec<Argument>) -> Value {
        let text = name.to_string();
        if receiver.is_poison() {
            return Value::Poison;
        }
        // A model's own function comes before one of a trait.
        let is_own =
            matches!(receiver, Value::Model) && self.implementation.functions.iter().any(|f| f.name == *name);
        // Conversions between `f64` and `Expr`, copies and borrows change nothing here.
        if !is_own && matches!(text.as_str(), "into" | "clone" | "to_owned") && arguments.is_empty() {
            return receiver;
        }
        if matches!(text.as_str(), "value" | "rate" | "acceleration" | "power" | "is_constant")
            && arguments.is_empty()
            && !matches!(receiver, Value::Model | Value::Record(_))
        {
            return self.fail(name.span(), &messages::read_out(&text));
        }
        match receiver {
            Value::Model => {
                let mut all = vec![(Value::Model, Place::from(name.span()))];
                all.extend(arguments);
                self.call_function(name, all)
            }
            Value::Scalar(s) => self.scalar_method(s, name, arguments),
            Value::Integer(i) => self.integer_method(i, name, arguments),
            Value::Vector(v) => self.vector_method(v, name, arguments),
            Value::Matrix(m) => self.matrix_method(m, name, arguments),
            Value::Array(items) => self.array_method(items, name, arguments),
            Value::Sequence(items) => self.sequence_method(items, name, arguments),
            Value::Tuple(items) if text == "dt" && arguments.is_empty() => {
                self.time_derivative(Value::Tuple(items), name)
            }
            Value::Record(record) => {
                let (ty, place) = (record.ty, Place::from(name.span()));
                let mut all = vec![(Value::Record(record), place)];
                all.extend(arguments);
                self.library_call(ty, name, all, place)
            }
            Value::Function(function) => self.function_method(function, name, arguments),
            Value::Mapped(made) => self.mapped_method(&made, name, &arguments),
            Value::Total(total) if text == "dt" && arguments.is_empty() => {
                self.each(&total, |this, value| this.time_derivative(value, name))
            }
            Value::Total(_) => self.made_of_sum(name.span()),
            Value::Range(range) if text == "rev" && arguments.is_empty() => Value::Range(range),
            Value::Index(_) => {
                self.fail(name.span(), &messages::index_form(name, crate::syntax::MOST_OFFSET))
            }
            Value::Family(field) if text == "len" && arguments.is_empty() => {
                self.length_of(field, Axis::First)
            }
            Value::GridRow(field, _) if text == "len" && arguments.is_empty() => {
                self.length_of(field, Axis::Second)
            }
            // An unknown argument is reported where it stands.
            _ if arguments.iter().any(|(argument, _)| argument.is_poison()) => Value::Poison,
            other => self.unknown_method(&other, name, &[]),
        }
    }

    /// A method that a shape does not have.
    pub(super) fn unknown_method(&mut self, receiver: &Value, name: &Ident, known: &[&str]) -> Value {
        const RENAMED: &[(&str, &str)] = &[
            ("log", "ln"),
            ("pow", "powi"),
            ("square", "powi"),
            ("length", "norm"),
            ("magnitude", "norm"),
            ("length_squared", "norm_squared"),
            ("magnitude_squared", "norm_squared"),
            ("sign", "signum"),
            ("arctan2", "atan2"),
            ("normalized", "normalize"),
            ("transposed", "transpose"),
            ("det", "determinant"),
            ("sincos", "sin_cos"),
            ("derivative", "dt"),
            ("unit", "normalize"),
        ];
        let text = name.to_string();
        let renamed =
            RENAMED.iter().find(|(wrong, right)| *wrong == text && known.contains(right)).map(|(_, r)| *r);
        let hint = match renamed.or_else(|| crate::suggest::nearest(&text, known.iter().copied())) {
            Some(best) => format!("did you mean `{best}`?"),
            None if matches!(receiver, Value::Family(_) | Value::GridRow(..) | Value::Numbered(_)) => {
                "write `(0..self.n).map(|i| ..)` or a `for` loop, and read the nodes by their index".into()
            }
            None if matches!(receiver, Value::Range(_)) => {
                "write `map` or a `for` loop over the indices that are meant".into()
            }
            None if known.is_empty() => "use its parts".into(),
            None => "the manual lists what models can use".into(),
        };
        self.fail(name.span(), &messages::unknown_method(receiver.shape(), name, hint))
    }

    /// Whether a method got as many arguments as it takes. (rustc says it too, but only once the model is
    /// understood.)
    pub(super) fn takes(&mut self, name: &Ident, arguments: &[Argument], expected: usize) -> bool {
        let fits = arguments.len() == expected;
        if !fits {
            self.fail(name.span(), &messages::argument_count(name, expected, arguments.len()));
        }
        fits && !arguments.iter().any(|(value, _)| value.is_poison())
    }

    /// A function of the impl.
    pub(super) fn call_function(&mut self, name: &Ident, arguments: Vec<Argument>) -> Value {
        let implementation = self.implementation;
        let Some(index) = implementation.functions.iter().position(|f| f.name == *name) else {
            let known: Vec<String> = implementation.functions.iter().map(|f| f.name.to_string()).collect();
            let near = crate::suggest::nearest(&name.to_string(), known.iter().map(String::as_str));
            let hint = match near {
                Some(best) => format!("did you mean `{best}`?"),
                None => "move it into this block from another `impl`, which the macro does not see".into(),
            };
            return self.fail(name.span(), &messages::unknown_function(name, hint));
        };
        if self.frames.iter().any(|f| f.function == Some(index)) {
            return self.fail(name.span(), &messages::recursion(name));
        }
        let function = &implementation.functions[index];
        let inputs = &function.item.sig.inputs;
        if inputs.len() != arguments.len() {
            let receiver = usize::from(matches!(arguments.first(), Some((Value::Model, _))));
            let (expected, found) = (inputs.len().saturating_sub(receiver), arguments.len() - receiver);
            return self.fail(name.span(), &messages::argument_count(name, expected, found));
        }
        self.note_call(index, &arguments);
        let frame = Frame { function: Some(index), scopes: vec![Vec::new()], ..Frame::default() };
        self.frames.push(frame);
        self.reach(index);
        for (input, (value, _)) in inputs.iter().zip(arguments) {
            match input {
                FnArg::Receiver(_) => self.frame().declare("self".into(), value),
                FnArg::Typed(argument) => {
                    if let syn::Type::Reference(reference) = &*argument.ty
                        && let Some(mutability) = reference.mutability
                        && !value.is_poison()
                    {
                        self.fail(mutability.span, &messages::mutable_reference());
                    }
                    self.declared_as(&value, &argument.ty);
                    self.bind(&argument.pat, value);
                }
            }
        }
        let value = self.statements(&function.item.block.stmts);
        let value = match self.frames.pop().and_then(|frame| frame.flow) {
            Some(Flow::Return(value)) => value,
            _ => value,
        };
        if let syn::ReturnType::Type(_, ty) = &function.item.sig.output {
            self.declared_as(&value, ty);
        }
        self.note_returned(index, &value);
        value
    }

    fn has_function(&self, name: &Ident) -> bool {
        self.implementation.functions.iter().any(|f| f.name == *name)
    }

    /// Some role calls this function.
    pub(super) fn reach(&mut self, index: usize) {
        if self.reached.insert(index) {
            let function = &self.implementation.functions[index].item;
            let (inputs, output) =
                (function.sig.inputs.to_token_stream(), function.sig.output.to_token_stream());
            for tokens in [inputs, output, function.block.to_token_stream()] {
                self.refuse_single_precision(tokens);
            }
        }
    }

    /// `path(..)`.
    pub(super) fn call(&mut self, e: &'a ExprCall) -> Value {
        if self.draws()
            && let Some(value) = self.drawn_call(e)
        {
            return value;
        }
        let Expr::Path(path) = &*e.func else {
            return self.fail(Place::of(&e.func), &messages::call_of_value());
        };
        let segments: Vec<&Ident> = path.path.segments.iter().map(|s| &s.ident).collect();
        let place = Place::of(&e.func);
        if e.args.iter().any(|a| matches!(a, Expr::Closure(_))) {
            let name = segments.last().map(ToString::to_string).unwrap_or_default();
            return self.fail(place, &messages::closure_method(name));
        }
        if let [name] = segments.as_slice()
            && (*name == "reaction" || *name == "slip")
        {
            return self.fail(name.span(), &messages::reaction_argument(name));
        }
        let arguments = self.arguments(&e.args);
        if let [.., ty, name] = segments.as_slice()
            && let Some(record) = self.library_type(ty)
        {
            self.taken_for_owner(&path.path);
            return self.library_call(record, name, arguments, place);
        }
        match segments.as_slice() {
            [ty, name] if *ty == "Self" || **ty == self.declaration.name => {
                self.call_function(name, arguments)
            }
            // A longer path may lead to a type of the same name elsewhere: `dynamics::Force::along` in a
            // model called `Force`.
            [.., ty, name] if **ty == self.declaration.name && self.has_function(name) => {
                self.call_function(name, arguments)
            }
            [.., ty, name] => {
                self.taken_for_owner(&path.path);
                self.associated(ty, name, arguments, place)
            }
            [name] => self.free_function(name, &path.path, arguments),
            [] => Value::Poison,
        }
    }

    /// `vec2(..)`, `vec3(..)`.
    fn free_function(&mut self, name: &Ident, path: &syn::Path, arguments: Vec<Argument>) -> Value {
        let expected = match name.to_string().as_str() {
            "vec2" => 2,
            "vec3" => 3,
            text if self.frame().find(text).is_some() => {
                let poisoned = self.frame().find(text).is_some_and(Value::is_poison);
                return if poisoned {
                    Value::Poison
                } else {
                    self.fail(name.span(), &messages::call_of_value())
                };
            }
            text => {
                let methods = self.implementation.functions.iter().any(|f| f.name == text);
                let message = if methods {
                    messages::function_without_self(name)
                } else {
                    let hint = crate::suggest::did_you_mean_only(text, ["vec2", "vec3"]);
                    messages::foreign_function(name, hint)
                };
                return self.fail(name.span(), &message);
            }
        };
        if arguments.len() != expected {
            return self.fail(name.span(), &messages::argument_count(name, expected, arguments.len()));
        }
        self.taken_for_library(path);
        self.vector_of(arguments)
    }

    /// `Type::name(..)`.
    pub(super) fn associated(
        &mut self,
        ty: &Ident,
        name: &Ident,
        mut arguments: Vec<Argument>,
        place: Place,
    ) -> Value {
        let (ty_text, text) = (ty.to_string(), name.to_string());
        let known = match (ty_text.as_str(), text.as_str()) {
            ("Expr" | "f64", "from") | ("Expr", "constant") => 1,
            ("Vec2", "new") | ("Force", "at" | "along") | ("f64", "midpoint") => 2,
            ("Vec3", "new") | ("Mat3", "from_rows" | "from_columns" | "diagonal") => 3,
            ("Mat3", "outer" | "axis_angle" | "euler" | "euler_space") => 2,
            ("Vec2" | "Vec3" | "Mat3", "from")
            | ("Mat3", "skew" | "rotation_x" | "rotation_y" | "rotation_z" | "euler_parameters") => 1,
            ("Mat3", "identity") => 0,
            ("Expr" | "f64" | "Vec2" | "Vec3" | "Mat3", _) if !arguments.is_empty() => {
                let (receiver, at) = arguments.remove(0);
                // In drawings real numbers may come from coordinates: `q.x.value()`.
                if let ("f64", Value::Scalar(x), false) = (ty_text.as_str(), &receiver, self.draws())
                    && !self.model.graph.dependence(x.node).within(Dependence::PARAMETERS)
                {
                    return self.fail(at, &messages::function_of_f64(&text));
                }
                return self.method(receiver, name, arguments);
            }
            _ => {
                let path = format!("{ty}::{name}");
                return self.fail(place, &messages::foreign_function(path, ""));
            }
        };
        if !self.takes(name, &arguments, known) {
            return Value::Poison;
        }
        match (ty_text.as_str(), text.as_str()) {
            ("f64", "midpoint") => self.midpoint(arguments, name),
            ("Expr" | "f64", _) => {
                let (value, place) = arguments.remove(0);
                self.scalar(value, place).into()
            }
            ("Vec2" | "Vec3", "new") => self.vector_of(arguments),
            ("Vec2" | "Vec3", _) => {
                self.vector_from(if ty_text == "Vec2" { 2 } else { 3 }, arguments.remove(0))
            }
            ("Force", "at") => self.force_at(arguments),
            ("Force", _) => self.force_along(arguments),
            _ => self.matrix_constructor(name, arguments),
        }
    }

    /// `f64::midpoint(a, b)`, which clippy makes of `(a + b) / 2.0`.
    fn midpoint(&mut self, arguments: Vec<Argument>, name: &Ident) -> Value {
        let mut parts = Vec::new();
        for (value, place) in arguments {
            match self.scalar(value, place) {
                Some(part) => parts.push(part),
                None => return Value::Poison,
            }
        }
        let [a, b] = parts.as_slice() else { return Value::Poison };
        let two = self.number(Number::integer(2));
        let sum = self.sum(Operator::Add, a, b, name.span());
        sum.and_then(|sum| self.quotient(&sum, &two, name.span())).into()
    }

    /// `Vec3::from(array, tuple or vector)`.
    fn vector_from(&mut self, n: usize, (value, place): Argument) -> Value {
        match value {
            Value::Vector(v) if v.len() == n => Value::Vector(v),
            Value::Array(items) | Value::Tuple(items) if items.len() == n => {
                self.vector_of(items.iter().map(|v| (v.clone(), place)).collect())
            }
            other => self.fail(place, &messages::expected_shape(format!("{n} scalars"), other.shape())),
        }
    }

    /// `Force::at(point, vector)`.
    fn force_at(&mut self, mut arguments: Vec<Argument>) -> Value {
        let (vector, at_vector) = arguments.remove(1);
        let (point, at_point) = arguments.remove(0);
        match (point, vector) {
            (Value::Vector(point), Value::Vector(vector)) if point.len() == vector.len() => {
                Value::Force(Rc::new(vec![Term::At {
                    point,
                    vector,
                    place: Place::joined(at_point, at_vector),
                }]))
            }
            (point @ Value::Vector(_), vector) => {
                self.fail(at_vector, &messages::expected_shape(point.shape(), vector.shape()))
            }
            (point, _) => {
                self.fail(at_point, &messages::expected_shape("a `Vec2` or a `Vec3`", point.shape()))
            }
        }
    }

    /// `Force::along(expression, magnitude)`.
    fn force_along(&mut self, mut arguments: Vec<Argument>) -> Value {
        let (magnitude, at_magnitude) = arguments.remove(1);
        let (expression, at_expression) = arguments.remove(0);
        let expression: Option<Scalar> = self.scalar(expression, at_expression);
        let magnitude = self.scalar(magnitude, at_magnitude);
        match (expression, magnitude) {
            (Some(expression), Some(magnitude)) => {
                let place = Place::joined(at_expression, at_magnitude);
                Value::Force(Rc::new(vec![Term::Along { expression, magnitude, place }]))
            }
            _ => Value::Poison,
        }
    }
}

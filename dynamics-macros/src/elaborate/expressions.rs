//! Expressions: one function per kind, called from one visible dispatch.

use std::rc::Rc;

use dynamics_symbolic::graph::Number;
use quote::ToTokens;
use syn::spanned::Spanned;
use syn::{BinOp, Expr, Lit, Member, Type, UnOp};

use super::Elaborator;
use super::integer_types::{IntegerType, TypeOf};
use super::operators::Operator;
use super::scope::Flow;
use super::values::{Choice, Condition, Integer, Value};
use crate::diagnostics::Place;
use crate::messages::{self, Message};

/// Most expressions within expressions, over all calls. Deeper nesting is a mistake, or would exhaust the
/// stack.
const MAX_DEPTH: usize = 100;
/// Most expressions that are evaluated in all. A model far above this exceeds the limit on operations anyway.
const MAX_STEPS: usize = 1_000_000;
/// Most nodes of the graph before the equations are derived. Ten times the operations that one emitted
/// function may have.
const MAX_NODES: usize = 200_000;

impl<'a> Elaborator<'a> {
    /// Reports an error; its value silences everything that follows from it.
    pub(super) fn fail(&mut self, place: impl Into<Place>, message: &Message) -> Value {
        self.diagnostics.error(place, message);
        Value::Poison
    }

    /// A value that was put together from parts, unless there are too many: shared parts make sizes that no
    /// memory holds.
    pub(super) fn bounded(&mut self, value: Value, place: impl Into<Place>) -> Value {
        let size = value.size();
        self.steps += size;
        if size as i128 > super::control::MAX_ITERATIONS {
            return self.fail(place, &messages::too_many_operations());
        }
        value
    }

    /// Counts one more expression; false, with an error, where the model is beyond all limits.
    fn step(&mut self, expr: &Expr) -> bool {
        self.steps += 1;
        if self.exhausted || self.families.cut.is_some() {
            return false;
        }
        let message = if self.depth > MAX_DEPTH {
            messages::nested_too_deeply()
        } else if self.steps > MAX_STEPS || self.model.graph.len() > MAX_NODES {
            messages::too_many_operations()
        } else {
            return true;
        };
        self.exhausted = true;
        self.diagnostics.error(Place::of(expr), &message);
        false
    }

    /// The value of an expression.
    ///
    /// Chains that nest to the left (sums, products, method calls, fields) are unwound by a loop: a sum of a
    /// thousand terms is no recursion.
    pub(super) fn expression(&mut self, expr: &'a Expr) -> Value {
        self.depth += 1;
        let mut chain = Vec::new();
        let mut inner = expr;
        loop {
            chain.push(inner);
            inner = match inner {
                Expr::Binary(e) if arithmetic(&e.op).is_some() => &e.left,
                Expr::MethodCall(e) => &e.receiver,
                Expr::Field(e) => &e.base,
                _ => break,
            };
        }
        let mut value = Value::Poison;
        let mut first = true;
        while let Some(next) = chain.pop() {
            if !self.step(next) || self.frame().flow.is_some() {
                value = Value::Poison;
                break;
            }
            value = if first { self.single(next) } else { self.chained(next, value) };
            if value.is_poison() && self.draws() {
                self.note_not_followed(next);
            }
            first = false;
        }
        self.depth -= 1;
        value
    }

    /// A link of a chain, given the value on its left.
    fn chained(&mut self, expr: &'a Expr, left: Value) -> Value {
        match expr {
            Expr::Binary(e) => {
                let right = self.expression(&e.right);
                let Some(op) = arithmetic(&e.op) else { return Value::Poison };
                self.note_term(None, op, &e.left, &left);
                self.note_term(None, op, &e.right, &right);
                self.arithmetic(op, left, right, e.op.span())
            }
            Expr::MethodCall(e) => self.method_call(e, left),
            Expr::Field(e) => self.field(left, &e.member),
            _ => Value::Poison,
        }
    }

    /// An expression that is not the continuation of a chain.
    fn single(&mut self, expr: &'a Expr) -> Value {
        match expr {
            Expr::Lit(e) => self.literal(&e.lit),
            Expr::Path(e) => self.path(e),
            Expr::Paren(e) => self.expression(&e.expr),
            Expr::Group(e) => self.expression(&e.expr),
            Expr::Reference(e) => self.reference(e),
            Expr::Unary(e) => self.unary(e),
            Expr::Binary(e) => self.logic(e),
            Expr::Cast(e) => self.cast(e),
            Expr::Call(e) => self.call(e),
            Expr::Index(e) => self.index(e),
            Expr::Tuple(e) => {
                let items = e.elems.iter().map(|x| self.expression(x)).collect();
                self.bounded(Value::tuple(items), Place::of(e))
            }
            Expr::Array(e) => {
                let items: Vec<Value> = e.elems.iter().map(|x| self.expression(x)).collect();
                self.all_of_one_type(&items);
                self.bounded(Value::array(items), Place::of(e))
            }
            Expr::Repeat(e) => self.repeat(e),
            Expr::Range(e) => self.range(e),
            Expr::Struct(e) => self.structure(e),
            Expr::Block(e) if e.label.is_none() => self.block(&e.block),
            Expr::If(e) => self.conditional(e),
            Expr::Match(e) => self.matching(e),
            Expr::ForLoop(e) => self.for_loop(e),
            Expr::Assign(e) => self.assign(&e.left, &e.right),
            Expr::Return(e) if !self.frame().rounds.is_empty() => {
                self.fail(e.return_token.span, &messages::round_left("return"))
            }
            Expr::Return(e) => {
                let value = e.expr.as_ref().map_or_else(Value::unit, |x| self.expression(x));
                self.leave(Flow::Return(value), e.return_token.span)
            }
            Expr::Break(e) if e.label.is_none() && e.expr.is_none() => {
                self.leave(Flow::Break, e.break_token.span)
            }
            Expr::Continue(e) if e.label.is_none() => self.leave(Flow::Continue, e.continue_token.span),
            Expr::Closure(e) if self.draws() => self.closure_value(e),
            Expr::Macro(e) if self.draws() => {
                let value = self.drawn_macro(&e.mac);
                value.unwrap_or_else(|| self.macro_call(&e.mac))
            }
            other => self.unsupported(other),
        }
    }

    /// What the language does not have, with what to write instead.
    fn unsupported(&mut self, expr: &Expr) -> Value {
        let (place, what, remedy) = match expr {
            Expr::Closure(e) => (Place::of(e), "closures", "write a `for` loop or a function of the impl"),
            Expr::While(e) => (
                e.while_token.span.into(),
                "`while` loops",
                "write a `for` loop over a range known at compile time",
            ),
            Expr::Loop(e) => {
                (e.loop_token.span.into(), "`loop`s", "write a `for` loop over a range known at compile time")
            }
            Expr::Macro(e) => return self.macro_call(&e.mac),
            Expr::Try(e) => {
                (e.question_token.span().into(), "`?`", "a model's functions return plain values")
            }
            Expr::Unsafe(e) => (e.unsafe_token.span.into(), "`unsafe` blocks", "write the expression itself"),
            Expr::Async(_) | Expr::Await(_) | Expr::Yield(_) => {
                (Place::of(expr), "asynchronous code", "write the expression itself")
            }
            Expr::Let(e) => (e.let_token.span.into(), "`if let`", "use `let` and `if` on a comparison"),
            Expr::Block(e) => (Place::of(&e.label), "labels", "write loops without labels"),
            Expr::Break(e) => {
                (e.break_token.span.into(), "labels and values of `break`", "assign to a variable before")
            }
            Expr::Continue(e) => (e.continue_token.span.into(), "labels", "write loops without labels"),
            Expr::Const(e) => (e.const_token.span.into(), "`const` blocks", "write a constant of the impl"),
            _ => (
                Place::of(expr),
                "this kind of expression",
                "write it with arithmetic, functions, `if` and `for`",
            ),
        };
        self.fail(place, &messages::unsupported(what, remedy))
    }

    /// What a macro expands to is not seen; for those of std it is known what else to do.
    pub(super) fn macro_call(&mut self, call: &syn::Macro) -> Value {
        let name = crate::syntax::path_text(&call.path);
        let remedy =
            match call.path.segments.last().map(|s| s.ident.to_string()).unwrap_or_default().as_str() {
                "println" | "print" | "eprintln" | "eprint" | "dbg" => {
                    "remove it, and mark what you want to see `#[output]`"
                }
                "assert" | "assert_eq" | "assert_ne" | "debug_assert" | "debug_assert_eq"
                | "debug_assert_ne" => "check parameters where the model is made",
                "panic" | "unreachable" | "todo" | "unimplemented" => "give every case a value",
                "vec" => "write an array, `[..]`",
                _ => "write its code out",
            };
        self.fail(Place::of(&call.path), &messages::macro_in_model(name, remedy))
    }

    fn literal(&mut self, lit: &Lit) -> Value {
        match lit {
            Lit::Float(x) => match Number::parse(x.base10_digits()) {
                Some(n) if n.value().is_finite() => self.number(n).into(),
                _ => self.fail(lit.span(), &messages::not_finite(format!("`{x}`"))),
            },
            Lit::Int(x) if x.suffix().starts_with('f') => match Number::parse(x.base10_digits()) {
                Some(n) if n.value().is_finite() => self.number(n).into(),
                _ => self.fail(lit.span(), &messages::not_finite(format!("`{x}`"))),
            },
            Lit::Int(x) => match x.base10_parse::<i64>() {
                Ok(n) => self.integer_literal(n.into(), x.suffix()),
                Err(_) => self.fail(lit.span(), &messages::integer_too_large(x)),
            },
            Lit::Bool(b) => Value::Condition(Condition::Known(b.value)),
            Lit::Str(text) if self.draws() => Value::Text(Rc::new(Choice::Is(text.value()))),
            other => {
                let text = other.to_token_stream();
                self.fail(other.span(), &messages::literal_kind(text))
            }
        }
    }

    /// `&x`; `&mut x` would let a function change a variable of its caller.
    fn reference(&mut self, e: &'a syn::ExprReference) -> Value {
        if let Some(mutability) = e.mutability {
            return self.fail(mutability.span, &messages::mutable_reference());
        }
        self.expression(&e.expr)
    }

    fn unary(&mut self, e: &'a syn::ExprUnary) -> Value {
        let value = self.expression(&e.expr);
        match (&e.op, value) {
            (_, Value::Poison) => Value::Poison,
            (UnOp::Neg(minus), value) => self.negated(value, minus.span),
            (UnOp::Not(_), Value::Condition(c)) => Value::Condition(c.not()),
            (UnOp::Not(not), other) => self.fail(not.span, &messages::operand("!", other.shape())),
            (_, value) => value,
        }
    }

    /// Comparisons, `&&`, `||`, and operators that only look like arithmetic.
    fn logic(&mut self, e: &'a syn::ExprBinary) -> Value {
        use BinOp::{And, BitXor, Eq, Ge, Gt, Le, Lt, Ne, Or};
        if let Some(op) = compound(&e.op) {
            return self.assign_compound(op, &e.left, &e.right, e.op.span());
        }
        let at = e.op.span();
        if matches!(e.op, BitXor(_)) {
            // It binds weaker than `+`: whatever its sides are, they are not what was meant.
            return self.fail(at, &messages::caret_as_power());
        }
        let left = self.expression(&e.left);
        match (&e.op, &left) {
            // As Rust does: what stands on the right may hold only where this does not decide, as in
            // `i > 0 && a[i - 1] > 0.0`.
            (And(_), Value::Condition(Condition::Known(false)))
            | (Or(_), Value::Condition(Condition::Known(true))) => {
                return left;
            }
            _ => {}
        }
        let right = self.expression(&e.right);
        match (&e.op, left, right) {
            (_, Value::Poison, _) | (_, _, Value::Poison) => Value::Poison,
            (And(_), Value::Condition(a), Value::Condition(b)) => Value::Condition(a.and(b)),
            (Or(_), Value::Condition(a), Value::Condition(b)) => Value::Condition(a.or(b)),
            (op @ (Lt(_) | Le(_) | Gt(_) | Ge(_) | Eq(_) | Ne(_)), a, b) => self.compare(op, a, b, at),
            (op, a, b) => {
                let text = op.to_token_stream().to_string();
                if matches!(op, And(_) | Or(_)) {
                    return self.fail(at, &messages::shape_mismatch(text, a.shape(), b.shape()));
                }
                self.fail(at, &messages::bit_operator(text))
            }
        }
    }

    /// Integers become real numbers or other integers; everything else that `as` can do to real numbers
    /// rounds.
    fn cast(&mut self, e: &'a syn::ExprCast) -> Value {
        let value = self.expression(&e.expr);
        let name = match &*e.ty {
            Type::Path(path) => path.path.segments.last().map(|s| s.ident.to_string()).unwrap_or_default(),
            _ => String::new(),
        };
        match (value, name.as_str(), IntegerType::named(&name)) {
            (Value::Poison, ..) => Value::Poison,
            (Value::Integer(i), "f64", _) => self.real(i),
            (Value::Index(index), "f64", _) => self.index_as_real(index),
            (value @ Value::Index(_), "usize", _) => value,
            (Value::Integer(i), _, Some(ty)) => self.integer_cast(i, ty, e.as_token.span),
            (value @ Value::Scalar(_), "f64", _) => value,
            // Single precision is reported where it is written.
            (_, "f32", _) => Value::Poison,
            (value, ..) => {
                let to = e.ty.to_token_stream();
                self.fail(e.as_token.span, &messages::cast(value.shape(), to))
            }
        }
    }

    /// `[x; n]`.
    fn repeat(&mut self, e: &'a syn::ExprRepeat) -> Value {
        let value = self.expression(&e.expr);
        let length = self.expression(&e.len);
        self.is_of(&length, TypeOf::USIZE);
        match length {
            Value::Poison => Value::Poison,
            Value::Integer(n) if (0..=super::control::MAX_ITERATIONS).contains(&n.value) => {
                if n.value.saturating_mul(value.size() as i128) > super::control::MAX_ITERATIONS {
                    return self.fail(Place::of(e), &messages::too_many_operations());
                }
                self.bounded(Value::array(vec![value; n.value as usize]), Place::of(e))
            }
            _ => self.fail(Place::of(&e.len), &messages::length_unknown()),
        }
    }

    /// `Vec2 { x, y }`, `Vec3 { x, y, z }`, and the library's types.
    fn structure(&mut self, e: &'a syn::ExprStruct) -> Value {
        let last = e.path.segments.last().map(|s| &s.ident);
        if let Some(ty) = last.and_then(|name| self.library_type(name)) {
            self.taken_for_library(&e.path);
            return self.record(ty, e);
        }
        let name = last.map(ToString::to_string).unwrap_or_default();
        let members: &[&str] = match name.as_str() {
            "Vec2" => &["x", "y"],
            "Vec3" => &["x", "y", "z"],
            _ => {
                let path = Place::of(&e.path);
                return self.fail(
                    path,
                    &messages::unsupported("structs other than vectors", "use a tuple or an array"),
                );
            }
        };
        self.taken_for_library(&e.path);
        let mut parts = Vec::new();
        for member in members {
            let field = e.fields.iter().find(|f| matches!(&f.member, Member::Named(n) if n == member));
            // A missing or doubled field is rustc's to say; it needs a value here only to go on.
            let value = field.map_or(Value::Poison, |f| self.expression(&f.expr));
            parts.push((value, Place::of(e)));
        }
        self.vector_of(parts)
    }

    /// `base.member`.
    pub(super) fn field(&mut self, base: Value, member: &Member) -> Value {
        let at = member.span();
        match (base, member) {
            (Value::Poison, _) => Value::Poison,
            (Value::Model, Member::Named(name)) => self.parameter(name),
            (Value::Coordinates, Member::Named(name)) => self.coordinate(name),
            (Value::Tuple(items), Member::Unnamed(i)) => match items.get(i.index as usize) {
                Some(value) => value.clone(),
                None => self.fail(at, &messages::index_out_of_range(i.index, "a tuple", items.len())),
            },
            (Value::Vector(v), Member::Named(name)) => {
                let k = ["x", "y", "z"].iter().position(|c| name == c);
                match k.and_then(|k| v.get(k)) {
                    Some(x) => Value::Scalar(x.clone()),
                    None => self.fail(at, &messages::no_component(name, v.len())),
                }
            }
            (Value::Record(record), member) => self.record_field(&record, member, at),
            (Value::Total(total), member @ Member::Named(_)) => {
                self.each(&total, |this, value| this.field(value, member))
            }
            (other, member) => {
                let member = match member {
                    Member::Named(name) => name.to_string(),
                    Member::Unnamed(i) => i.index.to_string(),
                };
                self.fail(at, &messages::no_field(other.shape(), member))
            }
        }
    }

    /// `base[index]`.
    fn index(&mut self, e: &'a syn::ExprIndex) -> Value {
        let base = self.expression(&e.expr);
        let index = self.expression(&e.index);
        self.element(&base, &index, &e.index)
    }

    /// An element of a value.
    pub(super) fn element(&mut self, base: &Value, index: &Value, at: &Expr) -> Value {
        let pick = |i: i128, n: usize| usize::try_from(i).ok().filter(|i| *i < n);
        self.is_of(index, TypeOf::USIZE);
        match (base, index) {
            (Value::Poison, _) | (_, Value::Poison) => Value::Poison,
            (Value::Family(field), index) => self.node_or_row(*field, index, at),
            (Value::GridRow(field, row), index) => self.node_of_row(*field, *row, index, at),
            (Value::Numbered(parameter), index) => self.numbered_element(*parameter, index, at),
            (Value::Array(items) | Value::Sequence(items), Value::Integer(i)) => {
                match pick(i.value, items.len()) {
                    Some(k) => items[k].clone(),
                    None => self.fail(
                        Place::of(at),
                        &messages::index_out_of_range(i.value, "the array", items.len()),
                    ),
                }
            }
            (Value::Vector(v), Value::Integer(i)) => match pick(i.value, v.len()) {
                Some(k) => Value::Scalar(v[k].clone()),
                None => {
                    self.fail(Place::of(at), &messages::index_out_of_range(i.value, "the vector", v.len()))
                }
            },
            (Value::Matrix(m), Value::Tuple(pair)) => match pair.as_slice() {
                [Value::Integer(i), Value::Integer(j)] => match (pick(i.value, 3), pick(j.value, 3)) {
                    (Some(i), Some(j)) => Value::Scalar(m[i][j].clone()),
                    (None, _) => {
                        self.fail(Place::of(at), &messages::index_out_of_range(i.value, "the matrix", 3))
                    }
                    (_, None) => {
                        self.fail(Place::of(at), &messages::index_out_of_range(j.value, "the matrix", 3))
                    }
                },
                items if items.iter().any(Value::is_poison) => Value::Poison,
                _ => self.fail(Place::of(at), &messages::matrix_index()),
            },
            (Value::Matrix(_), _) => self.fail(Place::of(at), &messages::matrix_index()),
            (Value::Array(_) | Value::Sequence(_) | Value::Vector(_), other) => {
                self.fail(Place::of(at), &messages::index_unknown(other.shape()))
            }
            (other, _) => self.fail(Place::of(at), &messages::not_indexable(other.shape())),
        }
    }

    /// A value as a vector of its scalars; poison where a part is not a scalar.
    pub(super) fn vector_of(&mut self, parts: Vec<(Value, Place)>) -> Value {
        let mut scalars = Vec::new();
        let mut poisoned = false;
        for (value, place) in parts {
            match self.scalar(value, place) {
                Some(scalar) => scalars.push(scalar),
                None => poisoned = true,
            }
        }
        if poisoned { Value::Poison } else { Value::Vector(scalars) }
    }

    /// A value that has to be a scalar.
    pub(super) fn scalar(&mut self, value: Value, place: impl Into<Place>) -> Option<super::values::Scalar> {
        match value {
            Value::Scalar(s) => Some(s),
            Value::Poison => None,
            Value::Integer(i) => match self.real(i) {
                Value::Scalar(s) => Some(s),
                _ => None,
            },
            other => {
                if matches!(other, Value::Total(_)) {
                    self.made_of_sum(place);
                    return None;
                }
                self.diagnostics.error(place, &messages::expected_shape("a scalar", other.shape()));
                None
            }
        }
    }

    /// The frame of the current call.
    pub(super) fn frame(&mut self) -> &mut super::scope::Frame {
        if self.frames.is_empty() {
            self.frames.push(super::scope::Frame::default());
        }
        self.frames.last_mut().expect("one was pushed just now if there was none")
    }

    /// A range or its bounds as integers.
    fn range(&mut self, e: &'a syn::ExprRange) -> Value {
        let bound = |this: &mut Self, expr: &'a Option<Box<Expr>>| match expr {
            None => None,
            Some(expr) => match this.expression(expr) {
                Value::Poison => Some(None),
                value @ (Value::Integer(_) | Value::Index(_)) => Some(Some(value)),
                other => {
                    this.diagnostics.error(Place::of(expr), &messages::loop_bound(other.shape()));
                    Some(None)
                }
            },
        };
        let start = bound(self, &e.start);
        let end = bound(self, &e.end);
        let (Some(start), Some(end)) = (start, end) else {
            return self.fail(Place::of(e), &messages::open_range());
        };
        let (Some(start), Some(end)) = (start, end) else { return Value::Poison };
        let closed = matches!(e.limits, syn::RangeLimits::Closed(_));
        let (Value::Integer(start), Value::Integer(end)) = (&start, &end) else {
            return self.index_range(&start, &end, closed, Place::of(e));
        };
        let (start, end) = (*start, *end);
        let ty = self.one_type(&start, &end);
        let (start, end) = (start.value, end.value);
        let end = if closed { end + 1 } else { end };
        if end - start > super::control::MAX_ITERATIONS {
            return self.fail(
                Place::of(e),
                &messages::too_many_iterations(end - start, super::control::MAX_ITERATIONS),
            );
        }
        self.steps += usize::try_from(end - start).unwrap_or(0);
        let item = |value| Value::Integer(Integer { value, truncated: None, ty });
        Value::Sequence(Rc::new((start..end).map(item).collect()))
    }
}

/// The arithmetic operators.
fn arithmetic(op: &BinOp) -> Option<Operator> {
    match op {
        BinOp::Add(_) => Some(Operator::Add),
        BinOp::Sub(_) => Some(Operator::Sub),
        BinOp::Mul(_) => Some(Operator::Mul),
        BinOp::Div(_) => Some(Operator::Div),
        BinOp::Rem(_) => Some(Operator::Rem),
        _ => None,
    }
}

/// The operators that assign.
pub(super) fn compound(op: &BinOp) -> Option<Operator> {
    match op {
        BinOp::AddAssign(_) => Some(Operator::Add),
        BinOp::SubAssign(_) => Some(Operator::Sub),
        BinOp::MulAssign(_) => Some(Operator::Mul),
        BinOp::DivAssign(_) => Some(Operator::Div),
        BinOp::RemAssign(_) => Some(Operator::Rem),
        _ => None,
    }
}

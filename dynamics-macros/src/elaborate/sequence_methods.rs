//! Methods of arrays and of the sequences that `for` runs over.

use std::rc::Rc;

use syn::Ident;

use super::Elaborator;
use super::calls::Argument;
use super::integer_types::TypeOf;
use super::operators::Operator;
use super::values::{Condition, Value};
use crate::diagnostics::Place;
use crate::messages;

const ARRAY_METHODS: &[&str] = &["len", "iter", "into_iter", "dt", "is_empty"];
const SEQUENCE_METHODS: &[&str] = &[
    "rev",
    "enumerate",
    "zip",
    "skip",
    "take",
    "step_by",
    "copied",
    "cloned",
    "iter",
    "into_iter",
    "len",
    "sum",
    "contains",
    "map",
    "collect",
];

/// Methods that take closures, which cannot be followed.
const CLOSURE_METHODS: &[&str] =
    &["fold", "for_each", "filter", "flat_map", "scan", "reduce", "all", "any", "map_while", "take_while"];

impl<'a> Elaborator<'a> {
    /// `.map(|item| ..)`, item by item.
    pub(super) fn map_sequence(&mut self, items: &[Value], closure: &'a syn::ExprClosure) -> Value {
        if items.is_empty() {
            return Value::Mapped(Rc::default());
        }
        let mut made = Vec::new();
        for item in items {
            made.push(self.closure(closure, item.clone()));
            if self.exhausted {
                break;
            }
            self.steps += 1;
        }
        self.bounded(Value::Sequence(Rc::new(made)), Place::of(closure))
    }

    pub(super) fn array_method(
        &mut self,
        items: Rc<Vec<Value>>,
        name: &Ident,
        arguments: Vec<Argument>,
    ) -> Value {
        match (name.to_string().as_str(), arguments.len()) {
            ("len", 0) => Value::count(items.len()),
            ("iter" | "into_iter", 0) => Value::Sequence(items),
            ("dt", 0) => self.time_derivative(Value::Array(items), name),
            ("iter_mut", _) => self.fail(name.span(), &messages::mutable_iterator()),
            (text, _) if CLOSURE_METHODS.contains(&text) => {
                self.fail(name.span(), &messages::closure_method(name))
            }
            _ => self.unknown_method(&Value::Array(items), name, ARRAY_METHODS),
        }
    }

    pub(super) fn sequence_method(
        &mut self,
        items: Rc<Vec<Value>>,
        name: &Ident,
        mut arguments: Vec<Argument>,
    ) -> Value {
        let text = name.to_string();
        let made: Vec<Value> = match (text.as_str(), arguments.len()) {
            ("copied" | "cloned" | "iter" | "into_iter", 0) => return Value::Sequence(items),
            ("len" | "count", 0) => return Value::count(items.len()),
            ("sum", 0) => return self.sum_of_items(&items, name),
            ("collect", 0) => return Value::Array(items),
            ("rev", 0) => items.iter().rev().cloned().collect(),
            ("enumerate", 0) => {
                let pair = |(i, item): (usize, &Value)| Value::tuple(vec![Value::count(i), item.clone()]);
                items.iter().enumerate().map(pair).collect()
            }
            ("contains", 1) => return self.contains(&items, arguments.remove(0)),
            ("zip", 1) => match arguments.remove(0) {
                (Value::Array(other) | Value::Sequence(other), _) => {
                    let pair = |(a, b): (&Value, &Value)| Value::tuple(vec![a.clone(), b.clone()]);
                    items.iter().zip(other.iter()).map(pair).collect()
                }
                (Value::Poison, _) => return Value::Poison,
                (other, place) => return self.fail(place, &messages::not_iterable(other.shape())),
            },
            ("skip" | "take" | "step_by", 1) => match arguments.remove(0) {
                (Value::Integer(n), place) => {
                    self.is_of(&Value::Integer(n), TypeOf::USIZE);
                    let n = usize::try_from(n.value).unwrap_or(0);
                    match text.as_str() {
                        "skip" => items.iter().skip(n).cloned().collect(),
                        "take" => items.iter().take(n).cloned().collect(),
                        _ if n == 0 => return self.fail(place, &messages::division_by_zero()),
                        _ => items.iter().step_by(n).cloned().collect(),
                    }
                }
                (Value::Poison, _) => return Value::Poison,
                (other, place) => return self.fail(place, &messages::loop_bound(other.shape())),
            },
            (text, _) if CLOSURE_METHODS.contains(&text) => {
                return self.fail(name.span(), &messages::closure_method(name));
            }
            _ => return self.unknown_method(&Value::Sequence(items), name, SEQUENCE_METHODS),
        };
        self.bounded(Value::Sequence(Rc::new(made)), name.span())
    }

    /// `(0..n).contains(&i)`.
    fn contains(&mut self, items: &[Value], (value, place): Argument) -> Value {
        self.all_of_one_type(&[items.first().cloned().unwrap_or(Value::Unset), value.clone()]);
        match value {
            Value::Poison => Value::Poison,
            Value::Integer(i) => {
                let found = items.iter().any(|item| matches!(item, Value::Integer(j) if j.value == i.value));
                Value::Condition(Condition::Known(found))
            }
            other => self.fail(place, &messages::expected_shape("an integer", other.shape())),
        }
    }

    /// `.sum()`.
    fn sum_of_items(&mut self, items: &[Value], name: &Ident) -> Value {
        let mut items = items.iter().cloned();
        // The sum of nothing has the type that rustc infers for it; zero of scalars is the only one that
        // loops over numbers can mean.
        let mut sum = items.next().unwrap_or_else(|| self.integer_literal(0, ""));
        for item in items {
            sum = self.arithmetic(Operator::Add, sum, item, name.span());
        }
        sum
    }
}

//! Closures of drawings: a body with the variables that were in scope where it was written.
//!
//! A closure may read these, not assign to them. That a drawing changes a variable of its caller inside of a
//! closure is not followed.

use std::rc::Rc;

use syn::{Expr, ExprCall, ExprClosure, ExprPath};

use super::super::Elaborator;
use super::super::scope::{Flow, Frame, Variable};
use super::super::values::Value;
use crate::diagnostics::Place;
use crate::messages;

/// A closure as it was made, or a function by its path.
#[derive(Clone)]
pub(super) enum Closure<'a> {
    Written { closure: &'a ExprClosure, captured: Rc<Vec<Vec<Variable>>> },
    Path(&'a ExprPath),
}

impl<'a> Elaborator<'a> {
    /// `|x| ..` as a value.
    pub(in super::super) fn closure_value(&mut self, closure: &'a ExprClosure) -> Value {
        let captured = Rc::new(self.frame().scopes.clone());
        self.new_closure(Closure::Written { closure, captured })
    }

    /// `Type::function` as a value.
    pub(super) fn path_value(&mut self, path: &'a ExprPath) -> Value {
        self.new_closure(Closure::Path(path))
    }

    fn new_closure(&mut self, closure: Closure<'a>) -> Value {
        let closures = &mut self.picture.get_or_insert_default().closures;
        closures.push(closure);
        Value::Closure(closures.len() - 1)
    }

    /// `name(..)` and `(expression)(..)` of closures; `None` where something else is called.
    pub(super) fn call_of_closure(&mut self, e: &'a ExprCall) -> Option<Value> {
        let closure = match &*e.func {
            Expr::Path(path) => self.frame().find(&path.path.get_ident()?.to_string())?.clone(),
            func => self.expression(func),
        };
        let Value::Closure(closure) = closure else { return None };
        let arguments = e.args.iter().map(|argument| self.expression(argument)).collect();
        Some(self.call_closure(closure, arguments, Place::of(&e.func)))
    }

    /// The value of a closure for these arguments.
    pub(super) fn call_closure(&mut self, closure: usize, arguments: Vec<Value>, at: Place) -> Value {
        let known = self.picture.as_ref().and_then(|followed| followed.closures.get(closure)).cloned();
        let (written, captured) = match known {
            Some(Closure::Written { closure, captured }) => (closure, captured),
            Some(Closure::Path(path)) => {
                let mut last = path.path.segments.iter().rev().map(|s| &s.ident);
                let (Some(name), Some(ty)) = (last.next(), last.next()) else { return Value::Poison };
                let arguments = arguments.into_iter().map(|argument| (argument, at)).collect();
                return self.call_by_path(ty, name, arguments, at);
            }
            None => return Value::Poison,
        };
        if written.inputs.len() != arguments.len() {
            let message = messages::argument_count("closure", written.inputs.len(), arguments.len());
            return self.fail(at, &message);
        }
        let mut scopes = captured.to_vec();
        let captured = scopes.len();
        scopes.push(Vec::new());
        self.frames.push(Frame { scopes, captured, ..Frame::default() });
        for (pattern, value) in written.inputs.iter().zip(arguments) {
            self.bind(pattern, value);
        }
        let value = self.expression(&written.body);
        match self.frames.pop().and_then(|frame| frame.flow) {
            Some(Flow::Return(value)) => value,
            _ => value,
        }
    }

    /// A closure among the arguments of a method.
    pub(super) fn call_argument(&mut self, closure: &(Value, Place), arguments: Vec<Value>) -> Value {
        match closure {
            (Value::Closure(index), at) => self.call_closure(*index, arguments, *at),
            (Value::Poison, _) => Value::Poison,
            (other, at) => self.fail(*at, &messages::expected_shape("a closure", other.shape())),
        }
    }
}

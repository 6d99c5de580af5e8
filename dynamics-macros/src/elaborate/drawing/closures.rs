//! Closures of drawings: a body with the variables that were in scope where it was written.
//!
//! A closure may read these, not assign to them. That a drawing changes a variable of its caller inside of a
//! closure is not followed.

use std::rc::Rc;

use syn::{Expr, ExprCall, ExprClosure};

use super::super::Elaborator;
use super::super::scope::{Flow, Frame, Variable};
use super::super::values::Value;
use crate::diagnostics::Place;
use crate::messages;

/// A closure as it was made.
#[derive(Clone)]
pub(super) struct Closure<'a> {
    written: &'a ExprClosure,
    captured: Rc<Vec<Vec<Variable>>>,
}

impl<'a> Elaborator<'a> {
    /// `|x| ..` as a value.
    pub(in super::super) fn closure_value(&mut self, written: &'a ExprClosure) -> Value {
        let captured = Rc::new(self.frame().scopes.clone());
        let closures = &mut self.picture.get_or_insert_default().closures;
        closures.push(Closure { written, captured });
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
        let Some(Closure { written, captured }) = known else { return Value::Poison };
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

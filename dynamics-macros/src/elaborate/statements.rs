//! Blocks, `let`, assignments.

use std::rc::Rc;

use proc_macro2::Span;
use quote::ToTokens;
use syn::spanned::Spanned;
use syn::{Block, Expr, Item, Local, Member, Stmt};

use super::Elaborator;
use super::operators::Operator;
use super::scope::Flow;
use super::values::Value;
use crate::diagnostics::Place;
use crate::messages;

/// One step from a variable into its value.
enum Step<'a> {
    Index(Value, &'a Expr),
    Member(&'a Member),
}

impl<'a> Elaborator<'a> {
    /// A block in a scope of its own; its value is its tail.
    pub(super) fn block(&mut self, block: &'a Block) -> Value {
        self.frame().scopes.push(Vec::new());
        let value = self.statements(&block.stmts);
        self.frame().scopes.pop();
        value
    }

    /// Statements one after another, until control leaves.
    pub(super) fn statements(&mut self, statements: &'a [Stmt]) -> Value {
        let mut value = Value::unit();
        for statement in statements {
            value = match statement {
                Stmt::Local(local) => {
                    self.local(local);
                    Value::unit()
                }
                Stmt::Item(item) => {
                    self.item(item);
                    Value::unit()
                }
                Stmt::Expr(expr, semicolon) => {
                    let value = self.expression(expr);
                    if semicolon.is_some() { Value::unit() } else { value }
                }
                Stmt::Macro(call) => self.macro_call(&call.mac),
            };
            if self.draws() {
                self.note_statement_not_followed(statement);
            }
            if self.frame().flow.is_some() || self.exhausted || self.families.cut.is_some() {
                return Value::Poison;
            }
        }
        value
    }

    fn local(&mut self, local: &'a Local) {
        let value = match &local.init {
            None => Value::Unset,
            Some(init) => {
                if let Some((else_token, _)) = &init.diverge {
                    let message =
                        messages::unsupported("`let .. else`", "use `let` and `if` on a comparison");
                    self.diagnostics.error(else_token.span, &message);
                    return self.bind_names(&local.pat);
                }
                self.expression(&init.expr)
            }
        };
        self.bind(&local.pat, value);
    }

    /// Constants in a function are like `let`s; imports change nothing; everything else has no meaning in a
    /// model.
    fn item(&mut self, item: &'a Item) {
        match item {
            Item::Const(constant) => {
                let value = self.expression(&constant.expr);
                self.declared_as(&value, &constant.ty);
                self.frame().declare(constant.ident.to_string(), value);
            }
            Item::Use(_) => {}
            other => {
                let message =
                    messages::unsupported("items inside functions", "move them out of the function");
                self.diagnostics.error(Place::of(other), &message);
            }
        }
    }

    /// Leaves a loop or a function; only where that is decided now.
    pub(super) fn leave(&mut self, flow: Flow, at: Span) -> Value {
        let frame = self.frame();
        if matches!(flow, Flow::Break) && frame.rounds.last() == Some(&frame.loops.len()) {
            return self.fail(at, &messages::round_left("break"));
        }
        let reachable = match flow {
            Flow::Return(_) => 0,
            Flow::Break | Flow::Continue => frame.loops.last().copied().unwrap_or(0),
        };
        if frame.undecided > reachable {
            let name = match flow {
                Flow::Return(_) => "return",
                Flow::Break => "break",
                Flow::Continue => "continue",
            };
            return self.fail(at, &messages::undecided_exit(name));
        }
        frame.flow = Some(flow);
        Value::Poison
    }

    /// `place = value`.
    pub(super) fn assign(&mut self, place: &'a Expr, value: &'a Expr) -> Value {
        let new = self.expression(value);
        match place {
            Expr::Infer(_) => Value::unit(),
            Expr::Tuple(parts) => self.assign_parts(parts.elems.iter(), new, Place::of(place)),
            Expr::Array(parts) => self.assign_parts(parts.elems.iter(), new, Place::of(place)),
            _ => self.store(place, new),
        }
    }

    /// `(a, b) = value`.
    fn assign_parts(
        &mut self,
        parts: impl ExactSizeIterator<Item = &'a Expr>,
        new: Value,
        at: Place,
    ) -> Value {
        let items = match new {
            Value::Tuple(items) | Value::Array(items) if items.len() == parts.len() => items,
            Value::Poison => Rc::new(vec![Value::Poison; parts.len()]),
            other => return self.fail(at, &messages::pattern_mismatch(other.shape())),
        };
        for (part, item) in parts.zip(items.iter()) {
            if !matches!(part, Expr::Infer(_)) {
                self.store(part, item.clone());
            }
        }
        Value::unit()
    }

    /// `place ∘= value`.
    pub(super) fn assign_compound(
        &mut self,
        op: Operator,
        place: &'a Expr,
        value: &'a Expr,
        at: Span,
    ) -> Value {
        let right = self.expression(value);
        if let Some(done) = self.accumulate(op, place, &right, at) {
            return done;
        }
        let left = self.expression(place);
        self.note_term(Some(place), op, value, &right);
        let new = self.arithmetic(op, left, right, at);
        self.store(place, new)
    }

    /// Writes to a variable, or to a part of one.
    pub(super) fn store(&mut self, place: &'a Expr, new: Value) -> Value {
        let Some((name, steps)) = self.steps_into(place) else { return Value::Poison };
        let Some(old) = self.frame().find(&name.to_string()).cloned() else {
            return self.unknown_variable(&name);
        };
        if matches!(old, Value::Accumulator(_)) {
            return self.misused_sum(&name, Place::of(place));
        }
        if self.frame().is_captured(&name.to_string()) {
            return self.fail(Place::of(place), &messages::not_assignable(&name));
        }
        // A variable keeps its type.
        if steps.is_empty() {
            self.all_of_one_type(&[old.clone(), new.clone()]);
        }
        let written = self.written(old, &steps, new);
        if let Some(variable) = self.frame().find_mut(&name.to_string()) {
            *variable = written;
        }
        Value::unit()
    }

    /// The variable that a place expression starts from, and the way from there.
    fn steps_into(&mut self, place: &'a Expr) -> Option<(syn::Ident, Vec<Step<'a>>)> {
        let mut steps = Vec::new();
        let mut at = place;
        loop {
            at = match at {
                Expr::Paren(e) => &e.expr,
                Expr::Group(e) => &e.expr,
                Expr::Unary(e) if matches!(e.op, syn::UnOp::Deref(_)) => &e.expr,
                Expr::Index(e) => {
                    let index = self.expression(&e.index);
                    steps.push(Step::Index(index, &e.index));
                    &e.expr
                }
                Expr::Field(e) => {
                    steps.push(Step::Member(&e.member));
                    &e.base
                }
                Expr::Path(e) if e.path.get_ident().is_some() => {
                    steps.reverse();
                    return e.path.get_ident().map(|name| (name.clone(), steps));
                }
                other => {
                    let text = other.to_token_stream();
                    self.fail(Place::of(place), &messages::not_assignable(text));
                    return None;
                }
            };
        }
    }

    /// `old` with `new` at the end of the way.
    fn written(&mut self, old: Value, steps: &[Step<'a>], new: Value) -> Value {
        let Some((step, rest)) = steps.split_first() else { return new };
        match (&old, step) {
            (Value::Poison, _) => return Value::Poison,
            (Value::Model | Value::Coordinates, Step::Member(member)) => {
                return self.fail(member.span(), &messages::not_assignable(member.to_token_stream()));
            }
            _ => {}
        }
        let inner = match step {
            Step::Index(index, at) => self.element(&old, index, at),
            Step::Member(member) => self.field(old.clone(), member),
        };
        let inner = self.written(inner, rest, new);
        let slot = match step {
            Step::Index(Value::Integer(i), _) => usize::try_from(i.value).ok(),
            Step::Member(Member::Unnamed(i)) => Some(i.index as usize),
            Step::Member(Member::Named(name)) => ["x", "y", "z"].iter().position(|c| name == c),
            Step::Index(..) => None,
        };
        let (Some(k), false) = (slot, inner.is_poison()) else { return Value::Poison };
        match (old, inner) {
            (Value::Array(mut items), inner) if k < items.len() => {
                Rc::make_mut(&mut items)[k] = inner;
                Value::Array(items)
            }
            (Value::Tuple(mut items), inner) if k < items.len() => {
                Rc::make_mut(&mut items)[k] = inner;
                Value::Tuple(items)
            }
            (Value::Vector(mut v), Value::Scalar(x)) if k < v.len() => {
                v[k] = x;
                Value::Vector(v)
            }
            _ => Value::Poison,
        }
    }

    /// A name that nothing in scope has.
    pub(super) fn unknown_variable(&mut self, name: &syn::Ident) -> Value {
        let known = self.frame().names();
        let hint = match crate::suggest::nearest(&name.to_string(), known.iter().map(String::as_str)) {
            Some(best) => format!("did you mean `{best}`?"),
            None => {
                "declare what stands outside of the `impl` as a constant of the `impl`, `Self::NAME`".into()
            }
        };
        self.fail(name.span(), &messages::unknown_name(name, hint))
    }
}

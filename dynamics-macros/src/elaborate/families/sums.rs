//! Sums over an index: rounds, what they give, and what can be made of sums.

use std::rc::Rc;

use dynamics_symbolic::families::{Anchor, NodeIndex, Range};
use dynamics_symbolic::graph::Number;
use proc_macro2::Span;
use syn::{Expr, ExprClosure, ExprForLoop, Ident};

use super::indices::value_of;
use crate::diagnostics::Place;
use crate::elaborate::Elaborator;
use crate::elaborate::calls::Argument;
use crate::elaborate::control::same;
use crate::elaborate::expressions::compound;
use crate::elaborate::operators::Operator;
use crate::elaborate::scope::Flow;
use crate::elaborate::values::{Addend, Condition, Scalar, Total, Value};
use crate::messages;
use crate::syntax::Role;

/// Most rounds at an end of a range that are elaborated one by one.
const MOST_UNROLLED: i64 = 8;

impl<'a> Elaborator<'a> {
    /// The values that `round` gives for all indices of a range: for single indices, and for what is left.
    /// `None` where a round is a mistake, which is reported.
    fn rounds(
        &mut self,
        range: Range,
        at: Place,
        round: &mut dyn FnMut(&mut Self, Value) -> Value,
    ) -> Option<Vec<(Option<Range>, Value)>> {
        if self.families.range.is_some() {
            self.fail(at, &messages::rounds_in_rounds());
            return None;
        }
        let (mut left, mut made) = (vec![range], Vec::new());
        while let Some(range) = left.pop() {
            let length = match (range.start, range.end) {
                (Anchor::Start(a), Anchor::Start(b)) => Some(b - a),
                (Anchor::End { count: a, plus: k }, Anchor::End { count: b, plus: l }) if a == b => {
                    Some(l - k)
                }
                (Anchor::Start(_), Anchor::End { .. }) => None,
                (Anchor::End { .. }, Anchor::Start(_)) => Some(0),
                _ => {
                    self.fail(at, &messages::counts_compared());
                    return None;
                }
            };
            let alone = length == Some(1);
            match length {
                Some(..=0) => continue,
                Some(n @ 2..=MOST_UNROLLED) => {
                    left.extend((0..n).rev().map(|k| {
                        let start = range.start.shifted(k);
                        Range { start, end: start.shifted(1) }
                    }));
                    continue;
                }
                _ => {}
            }
            let index = if alone { NodeIndex::Fixed(range.start) } else { NodeIndex::Round(0) };
            let before = self.frame().scopes.clone();
            self.families.range = (!alone).then_some(range);
            let value = round(self, value_of(index));
            self.families.range = None;
            self.steps += 1;
            if matches!(value, Value::Total(_)) {
                self.made_of_sum(at);
                return None;
            }
            if let Some(cut) = self.families.cut.take() {
                self.frame().scopes = before;
                left.push(Range { start: cut, end: range.end });
                left.push(Range { start: range.start, end: cut });
                continue;
            }
            if value.is_poison() || self.exhausted {
                return None;
            }
            made.push(((!alone).then_some(range), value));
        }
        Some(made)
    }

    /// `range.map(|i| ..)`.
    pub(in crate::elaborate) fn map_range(
        &mut self,
        range: Range,
        closure: &'a ExprClosure,
        at: Place,
    ) -> Value {
        let made = self.rounds(range, at, &mut |this, index| this.closure(closure, index));
        made.map_or(Value::Poison, |made| Value::Mapped(Rc::new(made)))
    }

    /// `range.map(..).map(|value| ..)`.
    pub(in crate::elaborate) fn map_mapped(
        &mut self,
        made: &[(Option<Range>, Value)],
        closure: &'a ExprClosure,
    ) -> Value {
        let mut again = Vec::new();
        for (range, value) in made {
            let outer = std::mem::replace(&mut self.families.range, *range);
            let value = self.closure(closure, value.clone());
            self.families.range = outer;
            if value.is_poison() {
                return Value::Poison;
            }
            again.push((*range, value));
        }
        Value::Mapped(Rc::new(again))
    }

    /// A closure of one argument.
    pub(in crate::elaborate) fn closure(&mut self, closure: &'a ExprClosure, argument: Value) -> Value {
        if closure.inputs.len() != 1 {
            let place = Place::of(closure);
            return self.fail(place, &messages::argument_count("closure", 1, closure.inputs.len()));
        }
        self.frame().scopes.push(Vec::new());
        self.bind(&closure.inputs[0], argument);
        let value = self.expression(&closure.body);
        self.frame().scopes.pop();
        match self.frame().flow.take() {
            Some(Flow::Return(value)) => value,
            _ => value,
        }
    }

    /// `range.map(..).sum()` and `.collect()`.
    pub(in crate::elaborate) fn mapped_method(
        &mut self,
        made: &Rc<Vec<(Option<Range>, Value)>>,
        name: &Ident,
        arguments: &[Argument],
    ) -> Value {
        match (name.to_string().as_str(), arguments.len()) {
            ("collect", 0) => Value::Mapped(made.clone()),
            ("sum", 0) => {
                let mut rest = Value::Unset;
                let mut rounds = Vec::new();
                for (range, value) in made.iter() {
                    match range {
                        Some(range) => rounds.push((*range, value.clone())),
                        None if matches!(rest, Value::Unset) => rest = value.clone(),
                        None => rest = self.arithmetic(Operator::Add, rest, value.clone(), name.span()),
                    }
                }
                if matches!(rest, Value::Unset) {
                    // A sum of nothing is taken for one of scalars.
                    rest = match rounds.first() {
                        Some((_, value)) => self.nothing_like(value),
                        None => self.number(Number::integer(0)).into(),
                    };
                }
                self.total(rest, rounds)
            }
            _ => self.unknown_method(&Value::Mapped(made.clone()), name, &["sum", "collect"]),
        }
    }

    /// The value that adds nothing.
    fn nothing_like(&mut self, value: &Value) -> Value {
        let zero = |scalar: &Scalar| Scalar { node: self.model.graph.zero(), unit: scalar.unit.clone() };
        match value {
            Value::Scalar(scalar) => Value::Scalar(zero(scalar)),
            Value::Vector(all) => Value::Vector(all.iter().map(zero).collect()),
            Value::Force(_) => Value::Force(Rc::default()),
            other => other.clone(),
        }
    }

    pub(in crate::elaborate) fn total(&mut self, rest: Value, rounds: Vec<(Range, Value)>) -> Value {
        if rest.is_poison() || rounds.iter().any(|(_, value)| value.is_poison()) {
            return Value::Poison;
        }
        if rounds.is_empty() { rest } else { Value::Total(Rc::new(Total { rest, rounds })) }
    }

    /// left ∘ right where one of both is a sum over an index.
    pub(in crate::elaborate) fn total_arithmetic(
        &mut self,
        op: Operator,
        left: Value,
        right: Value,
        at: Span,
    ) -> Value {
        use Operator::{Add, Div, Mul, Sub};
        match (op, left, right) {
            (Add | Sub, Value::Total(a), b) => {
                let (other, more) = match b {
                    Value::Total(b) => (b.rest.clone(), b.rounds.clone()),
                    other => (other, Vec::new()),
                };
                let rest = self.arithmetic(op, a.rest.clone(), other, at);
                let mut rounds = a.rounds.clone();
                for (range, value) in more {
                    let value = if op == Sub { self.negated(value, at) } else { value };
                    rounds.push((range, value));
                }
                self.total(rest, rounds)
            }
            (Add | Sub, a, Value::Total(b)) => {
                let rest = self.arithmetic(op, a, b.rest.clone(), at);
                let mut rounds = Vec::new();
                for (range, value) in b.rounds.clone() {
                    let value = if op == Sub { self.negated(value, at) } else { value };
                    rounds.push((range, value));
                }
                self.total(rest, rounds)
            }
            (Mul, Value::Total(_), Value::Total(_)) => self.made_of_sum(at),
            (Mul | Div, Value::Total(a), factor) => {
                self.each(&a, |this, value| this.arithmetic(op, value, factor.clone(), at))
            }
            (Mul, factor, Value::Total(b)) => {
                self.each(&b, |this, value| this.arithmetic(op, factor.clone(), value, at))
            }
            _ => self.made_of_sum(at),
        }
    }

    /// Something that cannot be made of a sum over an index. Outputs run as they are written, and may.
    pub(in crate::elaborate) fn made_of_sum(&mut self, at: impl Into<Place>) -> Value {
        match self.role {
            Role::Output => Value::Poison,
            _ => self.fail(at, &messages::sum_as_value()),
        }
    }

    /// The same done to every part of a sum.
    pub(in crate::elaborate) fn each(
        &mut self,
        total: &Total,
        mut of: impl FnMut(&mut Self, Value) -> Value,
    ) -> Value {
        let rest = of(self, total.rest.clone());
        let rounds = total.rounds.iter().map(|(range, value)| (*range, of(self, value.clone()))).collect();
        self.total(rest, rounds)
    }

    /// `for i in range { .. }`: what it assigns outside of itself may only be added up.
    pub(in crate::elaborate) fn index_loop(&mut self, range: Range, e: &'a ExprForLoop) -> Value {
        let mut assigned = Assigned { names: Vec::new() };
        syn::visit::Visit::visit_block(&mut assigned, &e.body);
        // Whoever reads them in a round, but to add, is told so.
        let mut names = assigned.names;
        names.sort_unstable();
        names.dedup();
        names.retain(|name| self.frame().find(name).is_some());
        let mut before: Vec<(String, Value)> = Vec::new();
        for name in names {
            if let Some(variable) = self.frame().find_mut(&name) {
                let old = std::mem::replace(variable, Value::Accumulator(Rc::default()));
                before.push((name, old));
            }
        }
        let undecided = self.frame().undecided;
        self.frame().loops.push(undecided);
        let depth = self.frame().loops.len();
        self.frame().rounds.push(depth);
        let names: Vec<String> = before.iter().map(|(name, _)| name.clone()).collect();
        let made = self.rounds(range, Place::of(&e.expr), &mut |this, index| {
            this.frame().scopes.push(Vec::new());
            this.bind(&e.pat, index);
            this.block(&e.body);
            this.frame().scopes.pop();
            // `continue`: others are refused where they stand.
            this.frame().flow = None;
            let added = names.iter().map(|name| {
                let emptied = Value::Accumulator(Rc::default());
                this.frame().find_mut(name).map_or(Value::Poison, |v| std::mem::replace(v, emptied))
            });
            Value::tuple(added.collect())
        });
        self.frame().rounds.pop();
        self.frame().loops.pop();
        for (k, (name, old)) in before.into_iter().enumerate() {
            let value = match &made {
                Some(made) => self.added_up(old, made, k),
                None => Value::Poison,
            };
            if let Some(variable) = self.frame().find_mut(&name) {
                *variable = value;
            }
        }
        Value::unit()
    }

    /// `old` and what the rounds have added to variable `k`.
    fn added_up(&mut self, old: Value, made: &[(Option<Range>, Value)], k: usize) -> Value {
        let mut sum = old;
        for (range, variables) in made {
            let Value::Tuple(variables) = variables else { continue };
            let Some(Value::Accumulator(added)) = variables.get(k) else { return Value::Poison };
            for Addend { value, at } in added.iter() {
                let value = match range {
                    Some(range) => {
                        let rest = self.nothing_like(value);
                        self.total(rest, vec![(*range, value.clone())])
                    }
                    None => value.clone(),
                };
                sum = self.arithmetic(Operator::Add, sum, value, *at);
            }
        }
        sum
    }

    /// `place += value` where the variable adds up what rounds give; `None` where it does not.
    pub(in crate::elaborate) fn accumulate(
        &mut self,
        op: Operator,
        place: &Expr,
        value: &Value,
        at: Span,
    ) -> Option<Value> {
        let Expr::Path(path) = place else { return None };
        let name = path.path.get_ident()?.to_string();
        let Some(Value::Accumulator(added)) = self.frame().find(&name).cloned() else { return None };
        if !matches!(op, Operator::Add | Operator::Sub) {
            return Some(self.misused_sum(path.path.get_ident()?, at));
        }
        if matches!(value, Value::Total(_)) {
            return Some(self.made_of_sum(at));
        }
        let value = if op == Operator::Sub { self.negated(value.clone(), at) } else { value.clone() };
        let new = if value.is_poison() {
            Value::Poison
        } else {
            Value::Accumulator(Rc::new(added.iter().cloned().chain([Addend { value, at }]).collect()))
        };
        if let Some(variable) = self.frame().find_mut(&name) {
            *variable = new;
        }
        Some(Value::unit())
    }

    /// Reports that a round does something else with a variable than add to it, once for each variable.
    pub(in crate::elaborate) fn misused_sum(&mut self, name: &Ident, at: impl Into<Place>) -> Value {
        if let Some(variable) = self.frame().find_mut(&name.to_string()) {
            *variable = Value::Poison;
        }
        self.fail(at, &messages::round_assigns(name))
    }

    /// What two branches of an `if` on the motion add to a variable, as a selection.
    pub(in crate::elaborate) fn select_added(
        &mut self,
        condition: &Condition,
        then: &[Addend],
        otherwise: &[Addend],
        at: Place,
    ) -> Value {
        let alike = |(a, b): &(&Addend, &Addend)| same(&a.value, &b.value);
        let before = then.iter().zip(otherwise).take_while(alike).count();
        let mut all = then[..before].to_vec();
        let (then, otherwise) = (&then[before..], &otherwise[before..]);
        let Some(one) = then.first().or(otherwise.first()) else {
            return Value::Accumulator(Rc::new(all));
        };
        let nothing = self.nothing_like(&one.value);
        let mut sum = |all: &[Addend]| {
            all.iter().fold(nothing.clone(), |sum, added| {
                self.arithmetic(Operator::Add, sum, added.value.clone(), added.at)
            })
        };
        let (span, then, otherwise) = (one.at, sum(then), sum(otherwise));
        match self.select(condition, &then, &otherwise, at) {
            Value::Poison => Value::Poison,
            value => {
                all.push(Addend { value, at: span });
                Value::Accumulator(Rc::new(all))
            }
        }
    }
}

/// Names of what a block assigns.
struct Assigned {
    names: Vec<String>,
}

impl<'ast> syn::visit::Visit<'ast> for Assigned {
    fn visit_expr_binary(&mut self, e: &'ast syn::ExprBinary) {
        if compound(&e.op).is_some() {
            self.names.extend(assigned_variable(&e.left));
        }
        syn::visit::visit_expr_binary(self, e);
    }
    fn visit_expr_assign(&mut self, e: &'ast syn::ExprAssign) {
        match &*e.left {
            Expr::Tuple(parts) => self.names.extend(parts.elems.iter().filter_map(assigned_variable)),
            Expr::Array(parts) => self.names.extend(parts.elems.iter().filter_map(assigned_variable)),
            place => self.names.extend(assigned_variable(place)),
        }
        syn::visit::visit_expr_assign(self, e);
    }
}

/// The variable of which a place is a part, or which it is.
fn assigned_variable(place: &Expr) -> Option<String> {
    match place {
        Expr::Path(path) => path.path.get_ident().map(ToString::to_string),
        Expr::Index(e) => assigned_variable(&e.expr),
        Expr::Field(e) => assigned_variable(&e.base),
        Expr::Paren(e) => assigned_variable(&e.expr),
        Expr::Group(e) => assigned_variable(&e.expr),
        Expr::Unary(e) => assigned_variable(&e.expr),
        _ => None,
    }
}

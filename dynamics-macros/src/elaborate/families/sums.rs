//! Sums over an index: rounds, what they give, and what can be made of sums.

use std::rc::Rc;

use dynamics_symbolic::families::{Anchor, NodeIndex, Range, Rounds};
use dynamics_symbolic::graph::Number;
use proc_macro2::Span;
use syn::{Expr, ExprClosure, ExprForLoop, Ident};

use super::super::Elaborator;
use super::super::calls::Argument;
use super::super::control::same;
use super::super::expressions::compound;
use super::super::operators::Operator;
use super::super::scope::Flow;
use super::super::values::{Addend, Condition, Scalar, Total, Value};
use super::indices::value_of;
use crate::diagnostics::Place;
use crate::messages;
use crate::syntax::Role;

/// Most rounds at an end of a range that are elaborated one by one.
const MOST_UNROLLED: i64 = 8;

impl<'a> Elaborator<'a> {
    /// The values that `round` gives for all indices of a range: for single indices, and for what is left.
    /// `None` where a round is a mistake, which is reported, and where the range of a loop around has to be
    /// cut.
    pub(super) fn rounds(
        &mut self,
        range: Range,
        at: Place,
        round: &mut dyn FnMut(&mut Self, Value) -> Value,
    ) -> Option<Vec<(Rounds, Value)>> {
        let outside = self.families.rounds;
        let Some(axis) = outside.next_axis() else {
            self.fail(at, &messages::rounds_in_rounds());
            return None;
        };
        let (mut left, mut made) = (vec![range], Vec::new());
        while let Some(range) = left.pop() {
            let length = self.length_of_range(range, at)?;
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
            let index = if alone { NodeIndex::Fixed(range.start) } else { NodeIndex::Round(axis, 0) };
            let before = self.frame().scopes.clone();
            let inside = if alone { outside } else { outside.with_inside(range)? };
            let value = self.in_rounds(inside, at, &mut |this| round(this, value_of(index)));
            self.steps += 1;
            match self.families.cut {
                Some((of, cut)) if of == axis && !alone => {
                    self.families.cut = None;
                    self.frame().scopes = before;
                    left.push(Range { start: cut, end: range.end });
                    left.push(Range { start: range.start, end: cut });
                    continue;
                }
                Some(_) => return None,
                None => {}
            }
            if value.is_poison() || self.exhausted {
                return None;
            }
            made.push((inside, value));
        }
        Some(made)
    }

    /// What is made in a round of these rounds, which may be those that are open.
    fn in_rounds(&mut self, inside: Rounds, at: Place, round: &mut dyn FnMut(&mut Self) -> Value) -> Value {
        let (outside, scope) = (self.families.rounds, self.families.scope);
        if inside != outside {
            self.families.scopes += 1;
            self.families.scope = self.families.scopes;
        }
        self.families.rounds = inside;
        let value = round(self);
        let foreign = self.is_foreign(&value);
        (self.families.rounds, self.families.scope) = (outside, scope);
        if foreign { self.made_of_sum(at) } else { value }
    }

    /// How many indices a range has; `Some(None)` where that depends on a count, `None` where two counts
    /// decide it, which is reported.
    #[expect(clippy::option_option, reason = "no length, and no answer, are two things")]
    fn length_of_range(&mut self, range: Range, at: Place) -> Option<Option<i64>> {
        match (range.start, range.end) {
            (Anchor::Start(a), Anchor::Start(b)) => Some(Some(b - a)),
            (Anchor::End { count: a, plus: k }, Anchor::End { count: b, plus: l }) if a == b => {
                Some(Some(l - k))
            }
            (Anchor::Start(_), Anchor::End { .. }) => Some(None),
            (Anchor::End { .. }, Anchor::Start(_)) => {
                // Empty for counts that are large enough, which is noted.
                self.anchor_at_most(range.end, range.start)?;
                Some(Some(0))
            }
            _ => {
                self.fail(at, &messages::counts_compared());
                None
            }
        }
    }

    /// `range.map(|i| ..)`.
    pub(in super::super) fn map_range(&mut self, range: Range, closure: &'a ExprClosure, at: Place) -> Value {
        let made = self.rounds(range, at, &mut |this, index| this.closure(closure, index));
        made.map_or(Value::Poison, |made| Value::Mapped(Rc::new(made)))
    }

    /// `range.map(..).map(|value| ..)`.
    pub(in super::super) fn map_mapped(
        &mut self,
        made: &[(Rounds, Value)],
        closure: &'a ExprClosure,
    ) -> Value {
        let outside = self.families.rounds;
        let (mut left, mut again) = (made.to_vec(), Vec::new());
        left.reverse();
        while let Some((rounds, value)) = left.pop() {
            let before = self.frame().scopes.clone();
            let new =
                self.in_rounds(rounds, Place::of(closure), &mut |this| this.closure(closure, value.clone()));
            match self.families.cut {
                Some((of, cut)) if outside.range(of).is_none() => {
                    self.families.cut = None;
                    self.frame().scopes = before;
                    let parts = rounds
                        .range(of)
                        .map(|Range { start, end }| [Range { start: cut, end }, Range { start, end: cut }]);
                    let parts = parts.into_iter().flatten();
                    left.extend(parts.filter_map(|part| Some((outside.with_inside(part)?, value.clone()))));
                    continue;
                }
                Some(_) => return Value::Poison,
                None => {}
            }
            if new.is_poison() {
                return Value::Poison;
            }
            again.push((rounds, new));
        }
        Value::Mapped(Rc::new(again))
    }

    /// A closure of one argument.
    pub(in super::super) fn closure(&mut self, closure: &'a ExprClosure, argument: Value) -> Value {
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
    pub(in super::super) fn mapped_method(
        &mut self,
        made: &Rc<Vec<(Rounds, Value)>>,
        name: &Ident,
        arguments: &[Argument],
    ) -> Value {
        match (name.to_string().as_str(), arguments.len()) {
            ("collect", 0) => Value::Mapped(made.clone()),
            ("sum", 0) => {
                let mut sum = Value::Unset;
                let mut rounds = Vec::new();
                for (of, value) in made.iter() {
                    match &sum {
                        _ if *of != self.families.rounds => rounds.extend(summands(*of, value)),
                        Value::Unset => sum = value.clone(),
                        _ => sum = self.arithmetic(Operator::Add, sum, value.clone(), name.span()),
                    }
                }
                if matches!(sum, Value::Unset) {
                    // A sum of nothing is taken for one of scalars.
                    sum = match rounds.first() {
                        Some((_, value)) => self.nothing_like(value),
                        None => self.number(Number::integer(0)).into(),
                    };
                }
                self.total(sum, rounds)
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
            Value::Total(total) => self.nothing_like(&total.rest),
            other => other.clone(),
        }
    }

    /// A value, which may be a sum already, and what rounds add to it.
    pub(in super::super) fn total(&mut self, rest: Value, rounds: Vec<(Rounds, Value)>) -> Value {
        if rest.is_poison() || rounds.iter().any(|(_, value)| value.is_poison()) {
            return Value::Poison;
        }
        let (rest, rounds) = match rest {
            Value::Total(total) => (total.rest.clone(), [total.rounds.clone(), rounds].concat()),
            rest => (rest, rounds),
        };
        if rounds.is_empty() {
            return rest;
        }
        Value::Total(Rc::new(Total { rest, rounds, scope: self.families.scope }))
    }

    /// left ∘ right where one of both is a sum over an index.
    pub(in super::super) fn total_arithmetic(
        &mut self,
        op: Operator,
        left: Value,
        right: Value,
        at: Span,
    ) -> Value {
        use Operator::{Add, Div, Mul, Sub};
        if self.is_foreign(&left) || self.is_foreign(&right) {
            return self.made_of_sum(at);
        }
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

    /// Whether a value is a sum that was made outside of the round that is elaborated: it is the same number
    /// in all rounds, and no sum of the round's own.
    fn is_foreign(&self, value: &Value) -> bool {
        matches!(value, Value::Total(total) if total.scope != self.families.scope)
    }

    /// Something that cannot be made of a sum over an index. Outputs run as they are written, and may.
    pub(in super::super) fn made_of_sum(&mut self, at: impl Into<Place>) -> Value {
        match self.role {
            Role::Output => Value::Poison,
            _ => self.fail(at, &messages::sum_as_value()),
        }
    }

    /// The same done to every part of a sum.
    pub(in super::super) fn each(
        &mut self,
        total: &Total,
        mut of: impl FnMut(&mut Self, Value) -> Value,
    ) -> Value {
        let rest = of(self, total.rest.clone());
        let rounds = total.rounds.iter().map(|(rounds, value)| (*rounds, of(self, value.clone()))).collect();
        match self.total(rest, rounds) {
            // Made where the sum was.
            Value::Total(made) => Value::Total(Rc::new(Total { scope: total.scope, ..(*made).clone() })),
            other => other,
        }
    }

    /// `for i in range { .. }`: what it assigns outside of itself may only be added up.
    pub(in super::super) fn index_loop(&mut self, range: Range, e: &'a ExprForLoop) -> Value {
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
    fn added_up(&mut self, old: Value, made: &[(Rounds, Value)], k: usize) -> Value {
        let mut sum = old;
        for (rounds, variables) in made {
            let Value::Tuple(variables) = variables else { continue };
            let Some(Value::Accumulator(added)) = variables.get(k) else { return Value::Poison };
            for Addend { value, at } in added.iter() {
                let value = if *rounds == self.families.rounds {
                    value.clone()
                } else {
                    let rest = self.nothing_like(value);
                    self.total(rest, summands(*rounds, value))
                };
                sum = match sum {
                    // The variable of a loop around, which adds up itself.
                    Value::Accumulator(known) if !value.is_poison() => {
                        let added = Addend { value, at: *at };
                        Value::Accumulator(Rc::new(known.iter().cloned().chain([added]).collect()))
                    }
                    Value::Accumulator(_) => Value::Poison,
                    sum => self.arithmetic(Operator::Add, sum, value, *at),
                };
            }
        }
        sum
    }

    /// `place += value` where the variable adds up what rounds give; `None` where it does not.
    pub(in super::super) fn accumulate(
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
        if self.is_foreign(value) {
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
    pub(in super::super) fn misused_sum(&mut self, name: &Ident, at: impl Into<Place>) -> Value {
        if let Some(variable) = self.frame().find_mut(&name.to_string()) {
            *variable = Value::Poison;
        }
        self.fail(at, &messages::round_assigns(name))
    }

    /// What two branches of an `if` on the motion add to a variable, as a selection.
    pub(in super::super) fn select_added(
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

/// What rounds give that have a value, which may be a sum itself.
fn summands(rounds: Rounds, value: &Value) -> Vec<(Rounds, Value)> {
    match value {
        Value::Total(total) => {
            let own = (rounds, total.rest.clone());
            total.rounds.iter().cloned().chain([own]).collect()
        }
        other => vec![(rounds, other.clone())],
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

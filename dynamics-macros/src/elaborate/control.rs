//! `if`, `match` and `for`. What is decided by integers is decided now; what is decided by the motion becomes
//! a selection.

use std::rc::Rc;

use dynamics_symbolic::graph::{Comparison, NodeId};
use syn::{Expr, ExprForLoop, ExprIf, ExprMatch, Lit, Pat};

use super::Elaborator;
use super::scope::{Flow, Variable};
use super::values::{Choice, Condition, Record, Scalar, Term, Value};
use crate::diagnostics::Place;
use crate::messages;

/// Most iterations of one loop, and most elements of one `[x; n]`. Loops are unrolled, so that a larger bound
/// allows larger expansions.
pub(super) const MAX_ITERATIONS: i128 = 100_000;

type Scopes = Vec<Vec<Variable>>;

impl<'a> Elaborator<'a> {
    /// A comparison of two nodes, decided where both are numbers.
    pub(super) fn comparison(&mut self, comparison: Comparison, left: NodeId, right: NodeId) -> Condition {
        let graph = &self.model.graph;
        match (graph.as_number(left), graph.as_number(right)) {
            (Some(a), Some(b)) => {
                let order = a.compare(b);
                Condition::Known(match comparison {
                    Comparison::Less => order.is_some_and(|o| o.is_lt()),
                    Comparison::LessEqual => order.is_some_and(|o| o.is_le()),
                    Comparison::Equal => order.is_some_and(|o| o.is_eq()),
                })
            }
            _ => Condition::Compare(comparison, left, right),
        }
    }

    /// `if .. { .. } else { .. }`.
    pub(super) fn conditional(&mut self, e: &'a ExprIf) -> Value {
        if let Expr::Let(inner) = &*e.cond {
            return self.fail(inner.let_token.span, &messages::unsupported("`if let`", "use a comparison"));
        }
        match self.expression(&e.cond) {
            Value::Condition(Condition::Known(true)) => self.block(&e.then_branch),
            Value::Condition(Condition::Known(false)) => self.otherwise(e),
            Value::Condition(condition) => self.undecided(e, Some(condition)),
            Value::Poison => self.undecided(e, None),
            other => {
                self.fail(Place::of(&e.cond), &messages::not_a_condition(other.shape()));
                self.undecided(e, None)
            }
        }
    }

    fn otherwise(&mut self, e: &'a ExprIf) -> Value {
        e.else_branch.as_ref().map_or_else(Value::unit, |(_, branch)| self.expression(branch))
    }

    /// Both branches, each on its own copy of the variables; then a selection of everything that differs.
    /// Without a condition (a mistake in it is reported already) whatever differs is unknown.
    fn undecided(&mut self, e: &'a ExprIf, condition: Option<Condition>) -> Value {
        let before = self.frame().scopes.clone();
        self.frame().undecided += 1;
        let then = self.block(&e.then_branch);
        let after_then = std::mem::replace(&mut self.frame().scopes, before);
        let otherwise = self.otherwise(e);
        self.frame().undecided -= 1;
        let after_else = std::mem::take(&mut self.frame().scopes);
        let place = Place::from(e.if_token.span);
        self.frame().scopes = Vec::new();
        let merged = self.merge(condition.as_ref(), after_then, after_else, place);
        self.frame().scopes = merged;
        match condition {
            Some(condition) => self.select(&condition, &then, &otherwise, place),
            None => Value::Poison,
        }
    }

    /// Variables after both branches. The branches' own scopes are gone: both sides have the same names in
    /// the same order.
    fn merge(
        &mut self,
        condition: Option<&Condition>,
        then: Scopes,
        otherwise: Scopes,
        place: Place,
    ) -> Scopes {
        let pairs = then.into_iter().zip(otherwise);
        let mut merged = Vec::new();
        for (a, b) in pairs {
            let mut scope = Vec::new();
            for (a, b) in a.into_iter().zip(b) {
                let value = match condition {
                    _ if same(&a.value, &b.value) => a.value,
                    Some(condition) => self.select(condition, &a.value, &b.value, place),
                    None => Value::Poison,
                };
                scope.push(Variable { name: a.name, value });
            }
            merged.push(scope);
        }
        merged
    }

    /// `if condition { then } else { otherwise }` for values of any shape.
    pub(super) fn select(
        &mut self,
        condition: &Condition,
        then: &Value,
        otherwise: &Value,
        at: Place,
    ) -> Value {
        if same(then, otherwise) {
            return then.clone();
        }
        match (then, otherwise) {
            (Value::Poison | Value::Unset, _) | (_, Value::Poison | Value::Unset) => Value::Poison,
            (Value::Condition(a), Value::Condition(b)) => {
                let (yes, no) = (condition.clone().and(a.clone()), condition.clone().not().and(b.clone()));
                Value::Condition(yes.or(no))
            }
            (Value::Integer(_), Value::Integer(_)) => self.fail(at, &messages::undecided_integer()),
            (Value::Tuple(a), Value::Tuple(b)) if a.len() == b.len() => {
                Value::Tuple(Rc::new(self.select_all(condition, a, b, at)))
            }
            (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
                Value::Array(Rc::new(self.select_all(condition, a, b, at)))
            }
            (Value::Vector(a), Value::Vector(b)) if a.len() == b.len() => {
                let pairs = a.iter().zip(b).map(|(a, b)| self.select_scalar(condition, a, b, at));
                pairs.collect::<Option<Vec<_>>>().map_or(Value::Poison, Value::Vector)
            }
            (Value::Matrix(a), Value::Matrix(b)) => {
                let mut k = 0;
                let made = self.matrix_map(a, |e, x| {
                    let y = &b[k / 3][k % 3];
                    k += 1;
                    e.select_scalar(condition, x, y, at)
                });
                made.unwrap_or(Value::Poison)
            }
            (Value::Force(a), Value::Force(b)) => self.select_force(condition, a, b, at),
            (Value::Record(a), Value::Record(b)) if a.ty == b.ty => {
                let fields = self.select_all(condition, &a.fields, &b.fields, at);
                if fields.iter().any(Value::is_poison) {
                    return Value::Poison;
                }
                Value::Record(Rc::new(Record { ty: a.ty, name: a.name.clone(), fields }))
            }
            (Value::Scalar(_) | Value::Integer(_), Value::Scalar(_) | Value::Integer(_)) => {
                let (a, b) = (self.scalar(then.clone(), at), self.scalar(otherwise.clone(), at));
                match (a, b) {
                    (Some(a), Some(b)) => self.select_scalar(condition, &a, &b, at).into(),
                    _ => Value::Poison,
                }
            }
            (Value::Accumulator(a), Value::Accumulator(b)) => self.select_added(condition, a, b, at),
            (Value::Index(_), Value::Index(_) | Value::Integer(_)) | (Value::Integer(_), Value::Index(_)) => {
                self.fail(at, &messages::undecided_integer())
            }
            (Value::Total(_), _) | (_, Value::Total(_)) => self.made_of_sum(at),
            (Value::Drawing(a), Value::Drawing(b)) => match self.select_drawing(condition, a, b) {
                Some(drawing) => drawing,
                None => self.fail(at, &messages::too_many_operations()),
            },
            (Value::Text(a), Value::Text(b)) => match Choice::between(condition, a, b) {
                Some(text) => Value::Text(Rc::new(text)),
                None => self.fail(at, &messages::too_many_operations()),
            },
            (Value::Color(a), Value::Color(b)) => match Choice::between(condition, a, b) {
                Some(color) => Value::Color(Rc::new(color)),
                None => self.fail(at, &messages::too_many_operations()),
            },
            (a, b) => self.fail(at, &messages::branches_differ(a.shape(), b.shape())),
        }
    }

    fn select_all(&mut self, condition: &Condition, a: &[Value], b: &[Value], at: Place) -> Vec<Value> {
        a.iter().zip(b).map(|(a, b)| self.select(condition, a, b, at)).collect()
    }

    fn select_scalar(&mut self, condition: &Condition, a: &Scalar, b: &Scalar, at: Place) -> Option<Scalar> {
        let unit = self.equate(&a.unit, &b.unit, at, messages::unit_of_branches)?;
        Some(Scalar { node: self.select_node(condition, a.node, b.node), unit })
    }

    pub(super) fn select_node(&mut self, condition: &Condition, a: NodeId, b: NodeId) -> NodeId {
        match condition {
            Condition::Known(true) => a,
            Condition::Known(false) => b,
            Condition::Compare(comparison, left, right) => {
                self.model.graph.select(*comparison, *left, *right, a, b)
            }
            Condition::Not(inner) => self.select_node(inner, b, a),
            Condition::And(first, second) => {
                let inner = self.select_node(second, a, b);
                self.select_node(first, inner, b)
            }
        }
    }

    /// A force in one branch is a force with magnitude zero in the other.
    fn select_force(&mut self, condition: &Condition, a: &[Term], b: &[Term], at: Place) -> Value {
        let mut terms = Vec::new();
        for (own, holds) in [(a, condition.clone()), (b, condition.clone().not())] {
            for term in own {
                let mut gate = |x: &Scalar| {
                    let zero = Scalar { node: self.model.graph.zero(), unit: None };
                    self.select_scalar(&holds, x, &zero, at)
                };
                let gated = match term {
                    Term::At { point, vector, place } => vector
                        .iter()
                        .map(&mut gate)
                        .collect::<Option<Vec<_>>>()
                        .map(|vector| Term::At { point: point.clone(), vector, place: *place }),
                    Term::Along { expression, magnitude, place } => gate(magnitude).map(|magnitude| {
                        Term::Along { expression: expression.clone(), magnitude, place: *place }
                    }),
                };
                let Some(gated) = gated else { return Value::Poison };
                terms.push(gated);
            }
        }
        Value::Force(Rc::new(terms))
    }

    /// `match` on an integer that is known now.
    pub(super) fn matching(&mut self, e: &'a ExprMatch) -> Value {
        let value = match self.expression(&e.expr) {
            Value::Poison => return Value::Poison,
            Value::Integer(i) => i,
            other => {
                let message = messages::match_on(other.shape());
                return self.fail(Place::of(&e.expr), &message);
            }
        };
        for arm in &e.arms {
            match self.matches(&arm.pat, value.value) {
                Some(false) => {}
                None => return Value::Poison,
                Some(true) => {
                    self.frame().scopes.push(Vec::new());
                    if let Pat::Ident(_) = &arm.pat {
                        self.bind(&arm.pat, Value::Integer(value));
                    }
                    let result = self.expression(&arm.body);
                    self.frame().scopes.pop();
                    return result;
                }
            }
        }
        // Patterns that are not exhaustive are rustc's to report; a value that none of them has cannot get
        // past it.
        self.fail(Place::of(&e.expr), &messages::no_arm(value.value))
    }

    /// Whether an integer has a pattern.
    fn matches(&mut self, pattern: &'a Pat, value: i128) -> Option<bool> {
        let literal = |e: &Expr| -> Option<i128> {
            let (negative, lit) = match e {
                Expr::Unary(u) if matches!(u.op, syn::UnOp::Neg(_)) => (true, &*u.expr),
                e => (false, e),
            };
            match lit {
                Expr::Lit(l) => match &l.lit {
                    Lit::Int(i) => i.base10_parse::<i128>().ok().map(|i| if negative { -i } else { i }),
                    _ => None,
                },
                _ => None,
            }
        };
        match pattern {
            Pat::Wild(_) => return Some(true),
            Pat::Ident(ident) if ident.subpat.is_none() => return Some(true),
            Pat::Paren(inner) => return self.matches(&inner.pat, value),
            Pat::Or(cases) => {
                for case in &cases.cases {
                    if self.matches(case, value)? {
                        return Some(true);
                    }
                }
                return Some(false);
            }
            Pat::Lit(lit) => {
                if let Lit::Int(i) = &lit.lit
                    && let Ok(i) = i.base10_parse::<i128>()
                {
                    return Some(i == value);
                }
            }
            Pat::Range(range) => {
                let bound = |e: &Option<Box<Expr>>, open| e.as_ref().map_or(Some(open), |e| literal(e));
                if let (Some(start), Some(end)) =
                    (bound(&range.start, i128::MIN), bound(&range.end, i128::MAX))
                {
                    let closed = matches!(range.limits, syn::RangeLimits::Closed(_)) || range.end.is_none();
                    return Some(value >= start && (value < end || closed && value == end));
                }
            }
            _ => {}
        }
        let message =
            messages::unsupported("this kind of pattern", "match integers, ranges of them, names and `_`");
        self.fail(Place::of(pattern), &message);
        None
    }

    /// `for pattern in range-or-array { .. }`, unrolled.
    pub(super) fn for_loop(&mut self, e: &'a ExprForLoop) -> Value {
        if let Some(label) = &e.label {
            // What its rounds would have assigned is not known.
            self.frame().scopes.iter_mut().flatten().for_each(|variable| variable.value = Value::Poison);
            return self
                .fail(Place::of(label), &messages::unsupported("labels", "write loops without labels"));
        }
        let items = match self.expression(&e.expr) {
            Value::Array(items) | Value::Sequence(items) => items,
            Value::Range(range) => return self.index_loop(range, e),
            // One round over an unknown item finds the other mistakes in the body.
            Value::Poison => Rc::new(vec![Value::Poison]),
            other => {
                let message = match other {
                    Value::Family(_) | Value::GridRow(..) | Value::Numbered(_) => {
                        messages::family_as_list(other.shape())
                    }
                    other => messages::not_iterable(other.shape()),
                };
                return self.fail(Place::of(&e.expr), &message);
            }
        };
        let undecided = self.frame().undecided;
        self.frame().loops.push(undecided);
        for item in items.iter() {
            self.frame().scopes.push(Vec::new());
            self.bind(&e.pat, item.clone());
            self.block(&e.body);
            self.frame().scopes.pop();
            let flow = self.frame().flow.take();
            match flow {
                Some(Flow::Break) => break,
                Some(Flow::Continue) | None => {}
                Some(flow) => {
                    self.frame().flow = Some(flow);
                    break;
                }
            }
            if self.exhausted {
                break;
            }
            // An empty body's rounds cost something too.
            self.steps += 1;
        }
        self.frame().loops.pop();
        Value::unit()
    }
}

/// Whether two values are one and the same, so that nothing needs selecting.
pub(super) fn same(a: &Value, b: &Value) -> bool {
    let all = |a: &[Value], b: &[Value]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| same(a, b));
    match (a, b) {
        (Value::Unset, Value::Unset)
        | (Value::Model, Value::Model)
        | (Value::Coordinates, Value::Coordinates) => true,
        (Value::Scalar(a), Value::Scalar(b)) => a.node == b.node && a.unit == b.unit,
        (Value::Integer(a), Value::Integer(b)) => a.value == b.value,
        (Value::Condition(Condition::Known(a)), Value::Condition(Condition::Known(b))) => a == b,
        (Value::Tuple(a), Value::Tuple(b))
        | (Value::Array(a), Value::Array(b))
        | (Value::Sequence(a), Value::Sequence(b)) => Rc::ptr_eq(a, b) || all(a, b),
        (Value::Vector(a), Value::Vector(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.node == b.node && a.unit == b.unit)
        }
        (Value::Matrix(a), Value::Matrix(b)) => Rc::ptr_eq(a, b),
        (Value::Force(a), Value::Force(b)) => Rc::ptr_eq(a, b),
        (Value::Record(a), Value::Record(b)) => Rc::ptr_eq(a, b),
        (Value::Axes(a), Value::Axes(b)) => a == b,
        (Value::Function(a), Value::Function(b)) => a == b,
        (Value::Index(a), Value::Index(b)) => a == b,
        (Value::Range(a), Value::Range(b)) => a == b,
        (Value::Family(a), Value::Family(b)) | (Value::Numbered(a), Value::Numbered(b)) => a == b,
        (Value::GridRow(a, i), Value::GridRow(b, j)) => (a, i) == (b, j),
        (Value::Mapped(a), Value::Mapped(b)) => Rc::ptr_eq(a, b),
        (Value::Total(a), Value::Total(b)) => Rc::ptr_eq(a, b),
        (Value::Accumulator(a), Value::Accumulator(b)) => Rc::ptr_eq(a, b),
        (Value::Drawing(a), Value::Drawing(b)) => Rc::ptr_eq(a, b) || a == b,
        (Value::Closure(a), Value::Closure(b)) => a == b,
        (Value::Text(a), Value::Text(b)) | (Value::Color(a), Value::Color(b)) => a == b,
        _ => false,
    }
}

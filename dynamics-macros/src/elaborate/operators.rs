//! Operators on values.

use std::rc::Rc;

use dynamics_symbolic::graph::{Comparison, Number};
use proc_macro2::Span;

use super::Elaborator;
use super::dimensions::{product, quotient};
use super::values::{Condition, Integer, Scalar, Term, Value};
use crate::diagnostics::Place;
use crate::messages;

/// The operators of arithmetic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Operator {
    Add,
    Sub,
    Mul,
    Div,
    Rem,
}

impl Operator {
    /// As written.
    pub(super) fn sign(self) -> &'static str {
        match self {
            Self::Add => "+",
            Self::Sub => "-",
            Self::Mul => "*",
            Self::Div => "/",
            Self::Rem => "%",
        }
    }
}

impl Elaborator<'_> {
    /// A literal or folded number without unit.
    pub(super) fn number(&mut self, number: Number) -> Scalar {
        let unit = if number.is(0) { None } else { self.dimensionless() };
        Scalar { node: self.model.graph.number(number), unit }
    }

    /// left ∘ right, with `at` the operator's place.
    pub(super) fn arithmetic(&mut self, op: Operator, left: Value, right: Value, at: Span) -> Value {
        let known = |e: &Self, v: &Value| match v {
            Value::Scalar(s) => e.value_of(s).is_some(),
            Value::Integer(_) => true,
            _ => false,
        };
        let numbers = known(self, &left) && known(self, &right);
        let value = self.combined(op, left, right, at);
        match &value {
            // The graph folds numbers unless the result is not a number.
            Value::Scalar(s) if numbers && self.value_of(s).is_none_or(|x| !x.is_finite()) => {
                self.fail(at, &messages::not_finite(format!("this `{}`", op.sign())))
            }
            Value::Force(terms) => {
                self.steps += terms.len();
                value
            }
            _ => value,
        }
    }

    fn combined(&mut self, op: Operator, left: Value, right: Value, at: Span) -> Value {
        use Operator::{Add, Div, Mul, Rem, Sub};
        if left.is_poison() || right.is_poison() {
            return Value::Poison;
        }
        if matches!((&left, &right), (Value::Index(_), _) | (_, Value::Index(_))) {
            return self.index_arithmetic(op, &left, &right, at);
        }
        if matches!((&left, &right), (Value::Total(_), _) | (_, Value::Total(_))) {
            return self.total_arithmetic(op, left, right, at);
        }
        match (op, self.mixed(op.sign(), left, right, at)) {
            (_, (Value::Poison, _) | (_, Value::Poison)) => Value::Poison,
            (op, (Value::Integer(a), Value::Integer(b))) => self.integers(op, a, b, at),
            (Add | Sub, (Value::Scalar(a), Value::Scalar(b))) => self.sum(op, &a, &b, at).into(),
            (Mul, (Value::Scalar(a), Value::Scalar(b))) => self.product(&a, &b).into(),
            (Div, (Value::Scalar(a), Value::Scalar(b))) => self.quotient(&a, &b, at).into(),
            (Add | Sub, (Value::Vector(a), Value::Vector(b))) if a.len() == b.len() => {
                let sum = a.iter().zip(&b).map(|(a, b)| self.sum(op, a, b, at)).collect::<Option<Vec<_>>>();
                if let (Add, Some(sum)) = (op, &sum) {
                    self.note_sum(&a, &b, sum);
                }
                sum.map_or(Value::Poison, Value::Vector)
            }
            (Mul, (Value::Scalar(s), Value::Vector(v)) | (Value::Vector(v), Value::Scalar(s))) => {
                Value::Vector(v.iter().map(|x| self.product(&s, x)).collect())
            }
            (Div, (Value::Vector(v), Value::Scalar(s))) => {
                let all = v.iter().map(|x| self.quotient(x, &s, at)).collect::<Option<Vec<_>>>();
                all.map_or(Value::Poison, Value::Vector)
            }
            (Add | Sub | Mul | Div, (Value::Matrix(a), b)) => self.matrix_left(op, &a, b, at),
            (Mul, (Value::Scalar(s), Value::Matrix(m))) => {
                self.matrix_map(&m, |e, x| Some(e.product(&s, x))).unwrap_or(Value::Poison)
            }
            (Add | Sub, (Value::Force(a), Value::Force(b))) => {
                let b = if op == Sub { self.scaled_force(&b, None) } else { b.to_vec() };
                Value::Force(Rc::new(a.iter().cloned().chain(b).collect()))
            }
            (Mul, (Value::Scalar(s), Value::Force(f)) | (Value::Force(f), Value::Scalar(s))) => {
                Value::Force(Rc::new(self.scaled_force(&f, Some(&s))))
            }
            (Div, (Value::Force(f), Value::Scalar(s))) => {
                let one = self.number(Number::ONE);
                let Some(factor) = self.quotient(&one, &s, at) else { return Value::Poison };
                Value::Force(Rc::new(self.scaled_force(&f, Some(&factor))))
            }
            (Rem, (Value::Scalar(_), _)) => self.fail(at, &messages::remainder_of_expression()),
            (op, (a, b)) => self.fail(at, &messages::shape_mismatch(op.sign(), a.shape(), b.shape())),
        }
    }

    /// Integers do not meet real numbers in Rust.
    fn mixed(&mut self, sign: &str, left: Value, right: Value, at: Span) -> (Value, Value) {
        let (integer, other) = match (&left, &right) {
            (Value::Integer(_), Value::Integer(_)) => return (left, right),
            (Value::Integer(i), other) | (other, Value::Integer(i)) => (*i, other.shape()),
            _ => return (left, right),
        };
        // A remainder that was dropped on the way is the first mistake.
        if !self.real(integer).is_poison() {
            self.fail(at, &messages::integer_with_real(sign, integer.value, other));
        }
        (Value::Poison, Value::Poison)
    }

    /// An integer as a real number; an error where a division before has dropped its remainder.
    pub(super) fn real(&mut self, integer: Integer) -> Value {
        if let Some(at) = integer.truncated.filter(|_| !self.draws()) {
            return self.fail(at, &messages::integer_division(integer.value));
        }
        // Above 2⁵³ `as f64` rounds.
        match i64::try_from(integer.value).ok().filter(|n| n.unsigned_abs() <= 1 << f64::MANTISSA_DIGITS) {
            Some(n) => self.number(Number::integer(n)).into(),
            None => self.number(Number::Float(integer.value as f64)).into(),
        }
    }

    fn integers(&mut self, op: Operator, a: Integer, b: Integer, at: Span) -> Value {
        let value = match op {
            Operator::Add => a.value.checked_add(b.value),
            Operator::Sub => a.value.checked_sub(b.value),
            Operator::Mul => a.value.checked_mul(b.value),
            Operator::Div => a.value.checked_div(b.value),
            Operator::Rem => a.value.checked_rem(b.value),
        };
        let ty = self.one_type(&a, &b);
        let Some(value) = value else {
            return self.fail(at, &messages::integer_overflow(op.sign(), a.value, b.value));
        };
        let inexact = op == Operator::Div && a.value % b.value != 0;
        let truncated = if inexact { Some(at) } else { a.truncated.or(b.truncated) };
        self.held(Integer { value, truncated, ty }, op.sign(), at)
    }

    /// a ± b.
    pub(super) fn sum(
        &mut self,
        op: Operator,
        a: &Scalar,
        b: &Scalar,
        at: impl Into<Place>,
    ) -> Option<Scalar> {
        let unit = self.equate(&a.unit, &b.unit, at, |l, r| super::dimensions::mismatch(op.sign(), l, r))?;
        let graph = &mut self.model.graph;
        let node = if op == Operator::Sub { graph.sub(a.node, b.node) } else { graph.add(a.node, b.node) };
        Some(Scalar { node, unit })
    }

    /// a·b.
    pub(super) fn product(&mut self, a: &Scalar, b: &Scalar) -> Scalar {
        Scalar { node: self.model.graph.mul(a.node, b.node), unit: product(&a.unit, &b.unit) }
    }

    /// a / b; an error where b is zero whatever the values are.
    pub(super) fn quotient(&mut self, a: &Scalar, b: &Scalar, at: impl Into<Place>) -> Option<Scalar> {
        match self.model.graph.div(a.node, b.node) {
            Some(node) => Some(Scalar { node, unit: quotient(&a.unit, &b.unit) }),
            None => {
                self.diagnostics.error(at, &messages::division_by_zero());
                None
            }
        }
    }

    /// Σ aᵢbᵢ.
    pub(super) fn dot(&mut self, a: &[Scalar], b: &[Scalar], at: impl Into<Place> + Copy) -> Option<Scalar> {
        let mut sum = self.number(Number::ZERO);
        for (a, b) in a.iter().zip(b) {
            let term = self.product(a, b);
            sum = self.sum(Operator::Add, &sum, &term, at)?;
        }
        Some(sum)
    }

    fn matrix_left(&mut self, op: Operator, a: &Rc<[[Scalar; 3]; 3]>, right: Value, at: Span) -> Value {
        let made = match (op, right) {
            (Operator::Add | Operator::Sub, Value::Matrix(b)) => {
                let mut k = 0;
                self.matrix_map(a, |e, x| {
                    let y = &b[k / 3][k % 3];
                    k += 1;
                    e.sum(op, x, y, at)
                })
            }
            (Operator::Mul, Value::Scalar(s)) => self.matrix_map(a, |e, x| Some(e.product(x, &s))),
            (Operator::Div, Value::Scalar(s)) => self.matrix_map(a, |e, x| e.quotient(x, &s, at)),
            (Operator::Mul, Value::Vector(v)) if v.len() == 3 => {
                let rows = a.iter().map(|row| self.dot(row, &v, at)).collect::<Option<Vec<_>>>();
                if let Some(product) = &rows {
                    self.note_carried(a, &v, product);
                }
                rows.map(Value::Vector)
            }
            (Operator::Mul, Value::Matrix(b)) => {
                let mut k = 0;
                let product = self.matrix_map(a, |e, _| {
                    let column = [0, 1, 2].map(|i| b[i][k % 3].clone());
                    let row = &a[k / 3];
                    k += 1;
                    e.dot(row, &column, at)
                });
                if let Some(product) = &product {
                    self.note_product(a, &b, product);
                }
                product
            }
            (_, right) => {
                return self.fail(at, &messages::shape_mismatch(op.sign(), "a `Mat3`", right.shape()));
            }
        };
        made.unwrap_or(Value::Poison)
    }

    /// A matrix from the elements of another, row by row.
    pub(super) fn matrix_map(
        &mut self,
        m: &[[Scalar; 3]; 3],
        mut f: impl FnMut(&mut Self, &Scalar) -> Option<Scalar>,
    ) -> Option<Value> {
        let mut row = |e: &mut Self, r: &[Scalar; 3]| Some([f(e, &r[0])?, f(e, &r[1])?, f(e, &r[2])?]);
        Some(Value::matrix([row(self, &m[0])?, row(self, &m[1])?, row(self, &m[2])?]))
    }

    /// −a.
    pub(super) fn negative(&mut self, a: &Scalar) -> Scalar {
        Scalar { node: self.model.graph.neg(a.node), unit: a.unit.clone() }
    }

    /// The terms of a force times a factor; negated without one.
    fn scaled_force(&mut self, terms: &[Term], factor: Option<&Scalar>) -> Vec<Term> {
        let mut scale = |x: &Scalar| match factor {
            Some(factor) => self.product(factor, x),
            None => self.negative(x),
        };
        let mut term = |t: &Term| match t {
            Term::At { point, vector, place } => Term::At {
                point: point.clone(),
                vector: vector.iter().map(&mut scale).collect(),
                place: *place,
            },
            Term::Along { expression, magnitude, place } => {
                Term::Along { expression: expression.clone(), magnitude: scale(magnitude), place: *place }
            }
        };
        terms.iter().map(&mut term).collect()
    }

    /// −value or !value.
    pub(super) fn negated(&mut self, value: Value, at: Span) -> Value {
        match value {
            Value::Poison => Value::Poison,
            Value::Integer(i) => match i.value.checked_neg() {
                Some(value) => self.held(Integer { value, ..i }, "-", at),
                None => self.fail(at, &messages::integer_overflow("-", 0, i.value)),
            },
            Value::Scalar(s) => self.negative(&s).into(),
            Value::Vector(v) => Value::Vector(v.iter().map(|x| self.negative(x)).collect()),
            Value::Matrix(m) => self.matrix_map(&m, |e, x| Some(e.negative(x))).unwrap_or(Value::Poison),
            Value::Force(f) => Value::Force(Rc::new(self.scaled_force(&f, None))),
            Value::Total(total) => self.each(&total, |this, value| this.negated(value, at)),
            other => self.fail(at, &messages::operand("-", other.shape())),
        }
    }

    /// left ∘ right as a condition.
    pub(super) fn compare(&mut self, op: &syn::BinOp, left: Value, right: Value, at: Span) -> Value {
        use syn::BinOp::{Eq, Ge, Gt, Le, Lt, Ne};
        if left.is_poison() || right.is_poison() {
            return Value::Poison;
        }
        if matches!((&left, &right), (Value::Index(_), _) | (_, Value::Index(_))) {
            return self.index_comparison(op, &left, &right, at);
        }
        let (a, b) = match self.mixed(&quote::ToTokens::to_token_stream(op).to_string(), left, right, at) {
            (Value::Integer(a), Value::Integer(b)) => {
                self.one_type(&a, &b);
                let (a, b) = (a.value, b.value);
                return Value::Condition(Condition::Known(match op {
                    Lt(_) => a < b,
                    Le(_) => a <= b,
                    Gt(_) => a > b,
                    Ge(_) => a >= b,
                    Ne(_) => a != b,
                    _ => a == b,
                }));
            }
            (Value::Condition(a), Value::Condition(b)) if matches!(op, Eq(_) | Ne(_)) => {
                let same = a.clone().and(b.clone()).or(a.not().and(b.not()));
                return Value::Condition(if matches!(op, Eq(_)) { same } else { same.not() });
            }
            (Value::Scalar(a), Value::Scalar(b)) => (a, b),
            (Value::Poison, _) | (_, Value::Poison) => return Value::Poison,
            (Value::Total(_), _) | (_, Value::Total(_)) => return self.made_of_sum(at),
            (a, b) => return self.fail(at, &messages::comparison_of(a.shape(), b.shape())),
        };
        let sign = match op {
            Lt(_) => "<",
            Le(_) => "<=",
            Gt(_) => ">",
            Ge(_) => ">=",
            Ne(_) => "!=",
            _ => "==",
        };
        if self.equate(&a.unit, &b.unit, at, |l, r| super::dimensions::mismatch(sign, l, r)).is_none() {
            return Value::Poison;
        }
        let (a, b) = (a.node, b.node);
        Value::Condition(match op {
            Lt(_) => self.comparison(Comparison::Less, a, b),
            Gt(_) => self.comparison(Comparison::Less, b, a),
            Le(_) => self.comparison(Comparison::LessEqual, a, b),
            Ge(_) => self.comparison(Comparison::LessEqual, b, a),
            Ne(_) => self.comparison(Comparison::Equal, a, b).not(),
            _ => self.comparison(Comparison::Equal, a, b),
        })
    }
}

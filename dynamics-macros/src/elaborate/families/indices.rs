//! Indices of families: what can be computed with them, and how they are compared.
//!
//! A count is taken to be larger than every number that it is compared with. How large it has to be for that
//! is noted in `FamilyModel::least`.

use dynamics_symbolic::families::{Anchor, Axis, NodeIndex, Range, Source};
use dynamics_symbolic::graph::Number;
use proc_macro2::Span;
use syn::BinOp;

use super::super::Elaborator;
use super::super::integer_types::TypeOf;
use super::super::operators::Operator;
use super::super::values::{Condition, Value};
use crate::diagnostics::Place;
use crate::messages;
use crate::syntax::MOST_OFFSET;

/// Most that a number among indices may be: models are unrolled beyond it to be checked.
const MOST_NUMBER: i64 = 256;

impl Elaborator<'_> {
    /// left ∘ right where one of both is an index.
    pub(in super::super) fn index_arithmetic(
        &mut self,
        op: Operator,
        left: &Value,
        right: &Value,
        at: Span,
    ) -> Value {
        use Operator::{Add, Rem, Sub};
        let (Some(a), Some(b)) = (index_of(left), index_of(right)) else {
            return self.fail(at, &messages::shape_mismatch(op.sign(), left.shape(), right.shape()));
        };
        let small = |k: i64| k.abs() <= MOST_OFFSET;
        match (op, a, b) {
            (Add, index, NodeIndex::Fixed(Anchor::Start(k)))
            | (Add, NodeIndex::Fixed(Anchor::Start(k)), index)
                if small(k) =>
            {
                self.within_reach(index.shifted(k), op, at)
            }
            (Sub, index, NodeIndex::Fixed(Anchor::Start(k))) if small(k) => {
                let index = index.shifted(-k);
                if let NodeIndex::Fixed(Anchor::End { count, plus }) = index {
                    // As in Rust, where a `usize` below 0 is a panic.
                    self.at_least(count, -plus);
                }
                self.within_reach(index, op, at)
            }
            // Within the rounds of a range all are below the count, or all are not.
            (Rem, a, b @ NodeIndex::Fixed(Anchor::End { .. })) => match self.index_less(a, b) {
                Some(true) => Value::Index(a),
                Some(false) => self.index_arithmetic(Sub, &value_of(a), &value_of(b), at),
                None if self.families.cut.is_some() => Value::Poison,
                None => self.fail(at, &messages::counts_compared()),
            },
            (Sub, NodeIndex::Round(of, a), NodeIndex::Round(other, b)) if of == other => {
                self.small_integer(a - b)
            }
            (
                Sub,
                NodeIndex::Fixed(Anchor::End { count: a, plus: k }),
                NodeIndex::Fixed(Anchor::End { count: b, plus: l }),
            ) if a == b => self.small_integer(k - l),
            _ => self.fail(at, &messages::index_form(op.sign(), MOST_OFFSET)),
        }
    }

    /// An index, unless steps one after the other went further than loops reach.
    fn within_reach(&mut self, index: NodeIndex, op: Operator, at: Span) -> Value {
        match index {
            NodeIndex::Round(_, k) if k.abs() > MOST_OFFSET => {
                self.fail(at, &messages::index_form(op.sign(), MOST_OFFSET))
            }
            index => Value::Index(index),
        }
    }

    fn small_integer(&mut self, value: i64) -> Value {
        let literal = self.integer_literal(value.into(), "");
        self.is_of(&literal, TypeOf::USIZE);
        literal
    }

    /// `a ∘ b` of two indices, one of which is none that is known now.
    pub(in super::super) fn index_comparison(
        &mut self,
        op: &BinOp,
        left: &Value,
        right: &Value,
        at: Span,
    ) -> Value {
        let (Some(a), Some(b)) = (index_of(left), index_of(right)) else {
            return self.fail(at, &messages::comparison_of(left.shape(), right.shape()));
        };
        if self.is_far(a, at) || self.is_far(b, at) {
            return Value::Poison;
        }
        let decided = match op {
            BinOp::Lt(_) => self.index_less(a, b),
            BinOp::Ge(_) => self.index_less(a, b).map(|less| !less),
            BinOp::Gt(_) => self.index_less(b, a),
            BinOp::Le(_) => self.index_less(b, a).map(|less| !less),
            BinOp::Ne(_) => self.index_equal(a, b).map(|equal| !equal),
            _ => self.index_equal(a, b),
        };
        match decided {
            Some(known) => Value::Condition(Condition::Known(known)),
            None if self.families.cut.is_some() => Value::Poison,
            None if [a, b].iter().all(|index| matches!(index, NodeIndex::Round(..))) => {
                self.fail(at, &messages::indices_compared())
            }
            None => self.fail(at, &messages::counts_compared()),
        }
    }

    /// a < b of two fixed indices. A count is larger than a number.
    fn anchor_less(&mut self, a: Anchor, b: Anchor) -> Option<bool> {
        match (a, b) {
            (Anchor::Start(a), Anchor::Start(b)) => Some(a < b),
            (Anchor::Start(k), Anchor::End { count, plus }) => {
                self.at_least(count, k - plus + 1);
                Some(true)
            }
            (Anchor::End { count, plus }, Anchor::Start(k)) => {
                self.at_least(count, k - plus + 1);
                Some(false)
            }
            (Anchor::End { count: a, plus: k }, Anchor::End { count: b, plus: l }) => {
                (a == b).then_some(k < l)
            }
        }
    }

    /// a ≤ b, where a count may be as large as the number.
    pub(super) fn anchor_at_most(&mut self, a: Anchor, b: Anchor) -> Option<bool> {
        match (a, b) {
            (Anchor::Start(k), Anchor::End { count, plus }) => {
                self.at_least(count, k - plus);
                Some(true)
            }
            _ => self.anchor_less(b, a).map(|less| !less),
        }
    }

    fn at_least(&mut self, count: u32, value: i64) {
        let least = &mut self.families.found.least[count as usize];
        *least = (*least).max(value);
    }

    fn index_less(&mut self, a: NodeIndex, b: NodeIndex) -> Option<bool> {
        match (a, b) {
            (NodeIndex::Round(of, k), NodeIndex::Round(other, l)) => (of == other).then_some(k < l),
            (NodeIndex::Fixed(a), NodeIndex::Fixed(b)) => self.anchor_less(a, b),
            // i + k < b.
            (NodeIndex::Round(of, k), NodeIndex::Fixed(b)) => self.round_below(of, b.shifted(-k)),
            // a < i + k, that is not i < a − k + 1.
            (NodeIndex::Fixed(a), NodeIndex::Round(of, k)) => {
                self.round_below(of, a.shifted(1 - k)).map(|below| !below)
            }
        }
    }

    fn index_equal(&mut self, a: NodeIndex, b: NodeIndex) -> Option<bool> {
        match (a, b) {
            (NodeIndex::Round(of, k), NodeIndex::Round(other, l)) => (of == other).then_some(k == l),
            (NodeIndex::Fixed(a), NodeIndex::Fixed(b)) => {
                let less = self.anchor_less(a, b)?;
                Some(!less && !self.anchor_less(b, a)?)
            }
            (NodeIndex::Round(of, k), NodeIndex::Fixed(at))
            | (NodeIndex::Fixed(at), NodeIndex::Round(of, k)) => {
                let at = at.shifted(-k);
                // i = at: neither below nor above.
                if self.round_below(of, at)? {
                    return Some(false);
                }
                self.round_below(of, at.shifted(1))
            }
        }
    }

    /// Whether the index is before `end` in all rounds; where it is in some and is not in others, that is
    /// where they are cut.
    fn round_below(&mut self, axis: Axis, end: Anchor) -> Option<bool> {
        let range = self.families.rounds.range(axis)?;
        let least = self.families.found.least.clone();
        if self.anchor_at_most(end, range.start)? {
            return Some(false);
        }
        self.families.found.least.clone_from(&least);
        if self.anchor_at_most(range.end, end)? {
            return Some(true);
        }
        // Both parts may be empty, but not overlap.
        self.families.found.least = least;
        self.anchor_at_most(range.start, end)?;
        self.anchor_at_most(end, range.end)?;
        self.families.cut = Some((axis, end));
        None
    }

    /// `index as f64`.
    pub(in super::super) fn index_as_real(&mut self, index: NodeIndex) -> Value {
        let (source, plus) = match index {
            NodeIndex::Round(axis, k) => (Source::Round(axis), k),
            NodeIndex::Fixed(Anchor::End { count, plus }) => (Source::Count(count), plus),
            NodeIndex::Fixed(Anchor::Start(k)) => {
                let integer = self.small_integer(k);
                let Value::Integer(integer) = integer else { return Value::Poison };
                return self.real(integer);
            }
        };
        let name = match source {
            Source::Count(count) => self.families.found.counts[count as usize].clone(),
            Source::Round(axis) => axis.name().to_owned(),
            Source::Scalar(_) | Source::Numbered { .. } => return Value::Poison,
        };
        let unit = self.dimensionless();
        let base = self.source(source, name, unit, String::new(), Place::from(Span::call_site()));
        let plus = self.number(Number::integer(plus));
        self.sum(Operator::Add, &base, &plus, Span::call_site()).into()
    }

    /// Whether an index is a number too far from 0, which is reported.
    pub(super) fn is_far(&mut self, index: NodeIndex, at: impl Into<Place>) -> bool {
        let far = matches!(index, NodeIndex::Fixed(Anchor::Start(k)) if k > MOST_NUMBER);
        if far {
            let text = index.text(&self.families.found.counts);
            self.fail(at, &messages::index_far(text, MOST_NUMBER));
        }
        far
    }

    /// `start..end`, one of which is no number.
    pub(in super::super) fn index_range(
        &mut self,
        start: &Value,
        end: &Value,
        closed: bool,
        at: Place,
    ) -> Value {
        let fixed = |value: &Value| match index_of(value) {
            Some(NodeIndex::Fixed(anchor)) => Some(anchor),
            _ => None,
        };
        let (Some(start), Some(end)) = (fixed(start), fixed(end)) else {
            return self.fail(at, &messages::range_of_round());
        };
        let end = if closed { end.shifted(1) } else { end };
        if [start, end].into_iter().any(|anchor| self.is_far(NodeIndex::Fixed(anchor), at)) {
            return Value::Poison;
        }
        Value::Range(Range { start, end })
    }
}

/// An integer as an index.
pub(super) fn index_of(value: &Value) -> Option<NodeIndex> {
    match value {
        Value::Index(index) => Some(*index),
        Value::Integer(i) => i64::try_from(i.value).ok().map(|k| NodeIndex::Fixed(Anchor::Start(k))),
        _ => None,
    }
}

/// An index as a value: a number where it is one.
pub(super) fn value_of(index: NodeIndex) -> Value {
    match index {
        NodeIndex::Fixed(Anchor::Start(k)) => Value::count(usize::try_from(k).unwrap_or_default()),
        other => Value::Index(other),
    }
}

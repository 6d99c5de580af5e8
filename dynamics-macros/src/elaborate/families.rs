//! Families: indices, ranges and sums whose ends are known when the program runs.
//!
//! A round of a sum is elaborated once for a whole range of indices. An index is i + k, a count + k or a
//! number. A comparison that not all rounds of a range decide alike cuts the range, and both parts are
//! elaborated by themselves, so that `if i == 0 { .. }` gives a round of its own. What a round reads is a
//! symbol of its element: `s[i]` and `s[i + 1]` are two coordinates there.
//!
//! A count is taken to be larger than every number that it is compared with. How large it has to be for that
//! is noted, and checked when the model is used.

use std::rc::Rc;

use dynamics_symbolic::families::{
    Anchor, FamilyModel, Field, Local, NodeIndex, Range, Source, Term, TermKind,
};
use dynamics_symbolic::graph::{Number, Symbol};
use proc_macro2::Span;
use syn::{BinOp, Expr, ExprClosure, ExprForLoop, Ident};

use super::Elaborator;
use super::calls::Argument;
use super::control::same;
use super::declare::SymbolKind;
use super::integer_types::TypeOf;
use super::operators::Operator;
use super::scope::Flow;
use super::values::{Addend, Condition, Numbered, Scalar, Total, UnitOf, Value};
use crate::diagnostics::Place;
use crate::messages;
use crate::syntax::{FieldKind, MOST_OFFSET, Role};

/// Most that a number among indices may be: models are unrolled beyond it to be checked.
const MOST_NUMBER: i64 = 256;

/// Most rounds at an end of a range that are elaborated one by one.
const MOST_UNROLLED: i64 = 8;

/// Families in elaboration; without counts in models that have none.
#[derive(Clone, Debug, Default)]
pub(super) struct Families {
    /// The values of the counts where the model is unrolled.
    pub(super) values: Vec<i64>,
    /// Whether counts have no values.
    pub(super) symbolic: bool,
    /// The declared coordinates: of families, the name and unit of their nodes.
    pub(super) coordinates: Vec<Numbered>,
    /// The numbered parameters.
    pub(super) parameters: Vec<Numbered>,
    /// What is found, but for the graph and the names of its symbols.
    pub(super) found: FamilyModel,
    /// The rounds that are elaborated.
    pub(super) range: Option<Range>,
    /// Where their range has to be cut: they do not decide a comparison alike.
    pub(super) cut: Option<Anchor>,
    /// For functions `(&self, q, index)`: the indices for which they were called.
    pub(super) called: Vec<(usize, Range)>,
}

/// The end of a range, and how far below 0 or above the last index a node is.
enum Reach {
    Inside,
    Below,
    Above,
    Unknown,
}

impl<'a> Elaborator<'a> {
    /// The value of the count with this name.
    pub(super) fn count(&mut self, name: &Ident) -> Value {
        let Some(count) = self.declaration.counts().position(|known| known == name) else {
            return Value::Poison;
        };
        match self.families.values.get(count) {
            Some(value) => Value::count(usize::try_from(*value).unwrap_or_default()),
            None => Value::Index(NodeIndex::Fixed(Anchor::End { count: count as u32, plus: 0 })),
        }
    }

    /// The field of a coordinate for the engine.
    pub(super) fn note_field(&mut self, name: &Ident, unit: String) {
        let length = self.declaration.coordinates.iter().find(|quantity| quantity.name == *name);
        let length = length.and_then(|quantity| quantity.family.as_ref()).and_then(|family| {
            let count = self.declaration.counts().position(|known| *known == family.count)?;
            Some(Anchor::End { count: count as u32, plus: family.plus })
        });
        self.families.found.fields.push(Field { name: name.to_string(), unit, length });
    }

    /// left ∘ right where one of both is an index.
    pub(super) fn index_arithmetic(&mut self, op: Operator, left: &Value, right: &Value, at: Span) -> Value {
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
                Value::Index(moved(index, k))
            }
            (Sub, index, NodeIndex::Fixed(Anchor::Start(k))) if small(k) => {
                let index = moved(index, -k);
                if let NodeIndex::Fixed(Anchor::End { count, plus }) = index {
                    // As in Rust, where a `usize` below 0 is a panic.
                    self.at_least(count, -plus);
                }
                Value::Index(index)
            }
            // Within the rounds of a range all are below the count, or all are not.
            (Rem, a, b @ NodeIndex::Fixed(Anchor::End { .. })) => match self.index_less(a, b) {
                Some(true) => Value::Index(a),
                Some(false) => self.index_arithmetic(Sub, &value_of(a), &value_of(b), at),
                None if self.families.cut.is_some() => Value::Poison,
                None => self.fail(at, &messages::counts_compared()),
            },
            (Sub, NodeIndex::Round(a), NodeIndex::Round(b)) => self.small_integer(a - b),
            (
                Sub,
                NodeIndex::Fixed(Anchor::End { count: a, plus: k }),
                NodeIndex::Fixed(Anchor::End { count: b, plus: l }),
            ) if a == b => self.small_integer(k - l),
            _ => self.fail(at, &messages::index_form(op.sign(), MOST_OFFSET)),
        }
    }

    fn small_integer(&mut self, value: i64) -> Value {
        let literal = self.integer_literal(value.into(), "");
        self.is_of(&literal, TypeOf::USIZE);
        literal
    }

    /// `a ∘ b` of two indices, one of which is none that is known now.
    pub(super) fn index_comparison(&mut self, op: &BinOp, left: &Value, right: &Value, at: Span) -> Value {
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
    fn anchor_at_most(&mut self, a: Anchor, b: Anchor) -> Option<bool> {
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
            (NodeIndex::Round(k), NodeIndex::Round(l)) => Some(k < l),
            (NodeIndex::Fixed(a), NodeIndex::Fixed(b)) => self.anchor_less(a, b),
            // i + k < b.
            (NodeIndex::Round(k), NodeIndex::Fixed(b)) => self.round_below(b.shifted(-k)),
            // a < i + k, that is not i < a − k + 1.
            (NodeIndex::Fixed(a), NodeIndex::Round(k)) => {
                self.round_below(a.shifted(1 - k)).map(|below| !below)
            }
        }
    }

    fn index_equal(&mut self, a: NodeIndex, b: NodeIndex) -> Option<bool> {
        match (a, b) {
            (NodeIndex::Round(k), NodeIndex::Round(l)) => Some(k == l),
            (NodeIndex::Fixed(a), NodeIndex::Fixed(b)) => {
                let less = self.anchor_less(a, b)?;
                Some(!less && !self.anchor_less(b, a)?)
            }
            (NodeIndex::Round(k), NodeIndex::Fixed(at)) | (NodeIndex::Fixed(at), NodeIndex::Round(k)) => {
                let at = at.shifted(-k);
                // i = at: neither below nor above.
                if self.round_below(at)? {
                    return Some(false);
                }
                self.round_below(at.shifted(1))
            }
        }
    }

    /// Whether all rounds are before `end`; where some are and some are not, that is where they are cut.
    fn round_below(&mut self, end: Anchor) -> Option<bool> {
        let range = self.families.range?;
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
        self.families.cut = Some(end);
        None
    }

    /// `index as f64`.
    pub(super) fn index_as_real(&mut self, index: NodeIndex) -> Value {
        let (source, plus) = match index {
            NodeIndex::Round(k) => (Source::Round, k),
            NodeIndex::Fixed(Anchor::End { count, plus }) => (Source::Count(count), plus),
            NodeIndex::Fixed(Anchor::Start(k)) => {
                let integer = self.small_integer(k);
                let Value::Integer(integer) = integer else { return Value::Poison };
                return self.real(integer);
            }
        };
        let name = match source {
            Source::Count(count) => self.families.found.counts[count as usize].clone(),
            _ => "i".to_owned(),
        };
        let unit = self.dimensionless();
        let base = self.source(source, name, unit, String::new(), Place::from(Span::call_site()));
        let plus = self.number(Number::integer(plus));
        self.sum(Operator::Add, &base, &plus, Span::call_site()).into()
    }

    /// The symbol of a parameter of elements, one for each.
    fn source(&mut self, source: Source, name: String, unit: UnitOf, text: String, place: Place) -> Scalar {
        self.note_scalars();
        let known = self.families.found.sources.iter().position(|known| *known == source);
        let number = known.unwrap_or_else(|| {
            self.families.found.sources.push(source);
            self.declare_symbol(SymbolKind::Parameter, name, text, place);
            self.families.found.sources.len() - 1
        });
        Scalar { node: self.model.graph.symbol(Symbol::Parameter(number as u32)), unit }
    }

    /// Scalar parameters come first.
    pub(super) fn note_scalars(&mut self) {
        let known = self.families.found.sources.len();
        for k in known..self.model.parameters.len() {
            self.families.found.sources.push(Source::Scalar(k as u32));
        }
    }

    /// `q.s[index]`.
    pub(super) fn node(&mut self, field: usize, index: &Value, at: &Expr) -> Value {
        let Some(index) = index_of(index) else {
            return self.fail(Place::of(at), &messages::index_unknown(index.shape()));
        };
        if self.is_far(index, Place::of(at)) {
            return Value::Poison;
        }
        let Some(length) = self.families.found.fields[field].length else { return Value::Poison };
        let name = self.families.found.fields[field].name.clone();
        if !self.reaches(&name, index, length, at) {
            return Value::Poison;
        }
        let Numbered { unit, unit_text, place, .. } = self.families.coordinates[field].clone();
        let local = Local { field: field as u32, index };
        let known = self.families.found.locals.iter().position(|known| *known == local);
        let number = known.unwrap_or_else(|| {
            self.families.found.locals.push(local);
            let name = format!("{name}[{}]", index.text(&self.families.found.counts));
            self.declare_symbol(SymbolKind::Coordinate, name, unit_text, place);
            self.families.found.locals.len() - 1
        });
        Scalar { node: self.model.graph.symbol(Symbol::Coordinate(number as u32)), unit }.into()
    }

    /// `q.s.len()`.
    pub(super) fn length_of(&mut self, field: usize) -> Value {
        let length = self.families.found.fields[field].length;
        length.map_or(Value::Poison, |length| value_of(NodeIndex::Fixed(length)))
    }

    /// `self.mass[index]` of a numbered parameter. Its length is checked when the model is used.
    pub(super) fn numbered_element(&mut self, parameter: usize, index: &Value, at: &Expr) -> Value {
        let Some(index) = index_of(index) else {
            return self.fail(Place::of(at), &messages::index_unknown(index.shape()));
        };
        let Numbered { name, unit, unit_text, place } = self.families.parameters[parameter].clone();
        if !self.families.symbolic {
            // The model is unrolled: every element that is read is a parameter.
            let NodeIndex::Fixed(Anchor::Start(k)) = index else { return Value::Poison };
            let element = format!("{name}[{k}]");
            let known = self.model.parameters.iter().position(|p| p.name == element);
            let number = known.unwrap_or_else(|| {
                self.declare_symbol(SymbolKind::Parameter, element, unit_text, place);
                self.model.parameters.len() - 1
            });
            return Scalar { node: self.model.graph.symbol(Symbol::Parameter(number as u32)), unit }.into();
        }
        let (first, end) = match (index, self.families.range) {
            (NodeIndex::Fixed(at), _) => (at, at.shifted(1)),
            (NodeIndex::Round(k), Some(range)) => (range.start.shifted(k), range.end.shifted(k)),
            (NodeIndex::Round(_), None) => return Value::Poison,
        };
        if self.anchor_at_most(Anchor::Start(0), first) != Some(true) {
            let text = index.text(&self.families.found.counts);
            return self.fail(Place::of(at), &messages::index_below(name, text, self.rounds_text(index)));
        }
        let read = (parameter as u32, end);
        if !self.families.found.reads.contains(&read) {
            self.families.found.reads.push(read);
        }
        let text = format!("{name}[{}]", index.text(&self.families.found.counts));
        self.source(Source::Numbered { parameter: read.0, index }, text, unit, unit_text, place).into()
    }

    /// Whether all rounds read nodes that there are; else that is reported.
    fn reaches(&mut self, name: &str, index: NodeIndex, length: Anchor, at: &Expr) -> bool {
        let (first, end) = match (index, self.families.range) {
            (NodeIndex::Fixed(at), _) => (at, at.shifted(1)),
            (NodeIndex::Round(k), Some(range)) => (range.start.shifted(k), range.end.shifted(k)),
            (NodeIndex::Round(_), None) => return false,
        };
        let reach = match (self.anchor_at_most(Anchor::Start(0), first), self.anchor_at_most(end, length)) {
            (Some(false), _) => Reach::Below,
            (_, Some(false)) => Reach::Above,
            (Some(true), Some(true)) => Reach::Inside,
            _ => Reach::Unknown,
        };
        let counts = &self.families.found.counts;
        let (length_text, index_text) = (length.text(counts), index.text(counts));
        let rounds = self.rounds_text(index);
        let message = match reach {
            Reach::Inside => return true,
            Reach::Below => messages::index_below(name, index_text, rounds),
            Reach::Above => messages::index_above(name, index_text, rounds, length_text),
            Reach::Unknown => messages::index_of_other_count(name, index_text, rounds, length_text),
        };
        self.fail(Place::of(at), &message);
        false
    }

    /// Which rounds an index is about: ` with i from 0 to nodes - 1`.
    fn rounds_text(&self, index: NodeIndex) -> String {
        let counts = &self.families.found.counts;
        match (index, self.families.range) {
            (NodeIndex::Round(_), Some(range)) => {
                format!(" with i from {} to {}", range.start.text(counts), range.end.shifted(-1).text(counts))
            }
            _ => String::new(),
        }
    }

    /// Whether an index is a number too far from 0, which is reported.
    fn is_far(&mut self, index: NodeIndex, at: impl Into<Place>) -> bool {
        let far = matches!(index, NodeIndex::Fixed(Anchor::Start(k)) if k > MOST_NUMBER);
        if far {
            let text = index.text(&self.families.found.counts);
            self.fail(at, &messages::index_far(text, MOST_NUMBER));
        }
        far
    }

    /// `start..end`, one of which is no number.
    pub(super) fn index_range(&mut self, start: &Value, end: &Value, closed: bool, at: Place) -> Value {
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
    pub(super) fn map_range(&mut self, range: Range, closure: &'a ExprClosure, at: Place) -> Value {
        let made = self.rounds(range, at, &mut |this, index| this.closure(closure, index));
        made.map_or(Value::Poison, |made| Value::Mapped(Rc::new(made)))
    }

    /// `range.map(..).map(|value| ..)`.
    pub(super) fn map_mapped(&mut self, made: &[(Option<Range>, Value)], closure: &'a ExprClosure) -> Value {
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
    pub(super) fn closure(&mut self, closure: &'a ExprClosure, argument: Value) -> Value {
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
    pub(super) fn mapped_method(
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

    pub(super) fn total(&mut self, rest: Value, rounds: Vec<(Range, Value)>) -> Value {
        if rest.is_poison() || rounds.iter().any(|(_, value)| value.is_poison()) {
            return Value::Poison;
        }
        if rounds.is_empty() { rest } else { Value::Total(Rc::new(Total { rest, rounds })) }
    }

    /// left ∘ right where one of both is a sum over an index.
    pub(super) fn total_arithmetic(&mut self, op: Operator, left: Value, right: Value, at: Span) -> Value {
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
    pub(super) fn made_of_sum(&mut self, at: impl Into<Place>) -> Value {
        match self.role {
            Role::Output => Value::Poison,
            _ => self.fail(at, &messages::sum_as_value()),
        }
    }

    /// The same done to every part of a sum.
    pub(super) fn each(&mut self, total: &Total, mut of: impl FnMut(&mut Self, Value) -> Value) -> Value {
        let rest = of(self, total.rest.clone());
        let rounds = total.rounds.iter().map(|(range, value)| (*range, of(self, value.clone()))).collect();
        self.total(rest, rounds)
    }

    /// `for i in range { .. }`: what it assigns outside of itself may only be added up.
    pub(super) fn index_loop(&mut self, range: Range, e: &'a ExprForLoop) -> Value {
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
    pub(super) fn accumulate(
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
    pub(super) fn misused_sum(&mut self, name: &Ident, at: impl Into<Place>) -> Value {
        if let Some(variable) = self.frame().find_mut(&name.to_string()) {
            *variable = Value::Poison;
        }
        self.fail(at, &messages::round_assigns(name))
    }

    /// What two branches of an `if` on the motion add to a variable, as a selection.
    pub(super) fn select_added(
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

    /// Notes for which indices a helper is called.
    pub(super) fn note_call(&mut self, function: usize, arguments: &[Argument]) {
        let [(Value::Model, _), (Value::Coordinates, _), (index, _)] = arguments else { return };
        let (Some(index), true) = (index_of(index), self.families.symbolic) else { return };
        let range = match (index, self.families.range) {
            (NodeIndex::Fixed(at), _) => Range { start: at, end: at.shifted(1) },
            (NodeIndex::Round(k), Some(range)) => {
                Range { start: range.start.shifted(k), end: range.end.shifted(k) }
            }
            (NodeIndex::Round(_), None) => return,
        };
        self.families.called.push((function, range));
    }

    /// Refuses speeds, and numbered parameters and counts that nothing reads.
    pub(super) fn check_families(&mut self) {
        if let Some(speed) = self.declaration.speeds.first() {
            let message = messages::role_beside_families("speeds", "use the velocities of coordinates");
            self.diagnostics.error(speed.name.span(), &message);
        }
        if self.diagnostics.len() > 0 {
            return;
        }
        let found = &self.families.found;
        let mut unread: Vec<(String, Place)> = Vec::new();
        for (k, parameter) in self.families.parameters.iter().enumerate() {
            if !found.reads.iter().any(|(read, _)| *read as usize == k) {
                unread.push((parameter.name.clone(), parameter.place));
            }
        }
        let fields = self.declaration.fields.iter().filter(|field| field.kind == FieldKind::Count);
        for (k, field) in fields.enumerate() {
            let of = |anchor: Anchor| matches!(anchor, Anchor::End { count, .. } if count as usize == k);
            let ranges = found.terms.iter().filter_map(|term| term.range);
            let ends = ranges.flat_map(|range| [range.start, range.end]);
            let lengths = found.fields.iter().filter_map(|field| field.length);
            let node = |local: &Local| matches!(local.index, NodeIndex::Fixed(anchor) if of(anchor));
            let number = |source: &Source| matches!(source, Source::Count(count) if *count as usize == k);
            let read = ends.chain(lengths).chain(found.reads.iter().map(|(_, end)| *end)).any(of)
                || found.locals.iter().any(node)
                || found.sources.iter().any(number)
                || found.least[k] > 0;
            if !read {
                unread.push((field.name.to_string(), Place::from(field.name.span())));
            }
        }
        for (name, place) in unread {
            self.diagnostics.error(place, &messages::unused("parameter", name));
        }
    }

    /// Adds a term of a role: a value, or a sum of them over an index.
    pub(super) fn family_terms(
        &mut self,
        function: &str,
        place: Place,
        value: Value,
        kind: &mut dyn FnMut(&mut Self, Value) -> Option<TermKind>,
    ) {
        let parts = match value {
            Value::Total(total) => {
                let rounds = total.rounds.iter().map(|(range, value)| (Some(*range), value.clone()));
                rounds.chain([(None, total.rest.clone())]).collect()
            }
            other => vec![(None, other)],
        };
        for (range, value) in parts {
            let Some(kind) = kind(self, value) else { return };
            if is_nothing(self, &kind) {
                continue;
            }
            let origin = self.origins.add(place);
            let function = function.to_owned();
            self.families.found.terms.push(Term { function, range, kind, origin });
        }
    }
}

/// Whether a term adds nothing.
fn is_nothing(elaborator: &Elaborator<'_>, kind: &TermKind) -> bool {
    match kind {
        TermKind::Energy(_, node) => elaborator.model.graph.is_zero(*node),
        TermKind::Force(terms) => terms.is_empty(),
    }
}

/// Names of what a block assigns.
struct Assigned {
    names: Vec<String>,
}

impl<'ast> syn::visit::Visit<'ast> for Assigned {
    fn visit_expr_binary(&mut self, e: &'ast syn::ExprBinary) {
        if super::expressions::compound(&e.op).is_some() {
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

/// An index `by` further.
fn moved(index: NodeIndex, by: i64) -> NodeIndex {
    match index {
        NodeIndex::Round(k) => NodeIndex::Round(k + by),
        NodeIndex::Fixed(at) => NodeIndex::Fixed(at.shifted(by)),
    }
}

/// An integer as an index.
fn index_of(value: &Value) -> Option<NodeIndex> {
    match value {
        Value::Index(index) => Some(*index),
        Value::Integer(i) => i64::try_from(i.value).ok().map(|k| NodeIndex::Fixed(Anchor::Start(k))),
        _ => None,
    }
}

/// An index as a value: a number where it is one.
fn value_of(index: NodeIndex) -> Value {
    match index {
        NodeIndex::Fixed(Anchor::Start(k)) => Value::count(usize::try_from(k).unwrap_or_default()),
        other => Value::Index(other),
    }
}

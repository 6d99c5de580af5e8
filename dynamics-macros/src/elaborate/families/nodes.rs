//! What a round reads: nodes of families, elements of parameters. Every one is a symbol of its element, and
//! is proved to be there in all rounds.

use dynamics_symbolic::families::{Anchor, Field, Local, NodeIndex, Range, Source};
use dynamics_symbolic::graph::Symbol;
use syn::Expr;

use super::super::Elaborator;
use super::super::declare::SymbolKind;
use super::super::values::{Numbered, Scalar, UnitOf, Value};
use super::indices::index_of;
use crate::diagnostics::Place;
use crate::messages;

/// The end of a range, and how far below 0 or above the last index a node is.
enum Reach {
    Inside,
    Below,
    Above,
    Unknown,
}

impl Elaborator<'_> {
    /// The symbol of a parameter of elements, one for each.
    pub(super) fn source(
        &mut self,
        source: Source,
        name: String,
        unit: UnitOf,
        text: String,
        place: Place,
    ) -> Scalar {
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
    pub(in super::super) fn note_scalars(&mut self) {
        let known = self.families.found.sources.len();
        for k in known..self.model.parameters.len() {
            self.families.found.sources.push(Source::Scalar(k as u32));
        }
    }

    /// `q.s[index]`, and `q.w[index]` of a grid.
    pub(in super::super) fn node_or_row(&mut self, field: usize, index: &Value, at: &Expr) -> Value {
        let Some(index) = self.node_index(index, at) else { return Value::Poison };
        let Field { name, length, columns, .. } = self.families.found.fields[field].clone();
        let Some(length) = length else { return Value::Poison };
        if !self.reaches(&name, index, length, columns.is_some(), at) {
            return Value::Poison;
        }
        match columns {
            Some(_) => Value::GridRow(field, index),
            None => self.node(Local::of(field as u32, index)),
        }
    }

    /// `q.w[row][index]`.
    pub(in super::super) fn node_of_row(
        &mut self,
        field: usize,
        row: NodeIndex,
        index: &Value,
        at: &Expr,
    ) -> Value {
        let Some(index) = self.node_index(index, at) else { return Value::Poison };
        let Field { name, columns, .. } = self.families.found.fields[field].clone();
        let Some(columns) = columns else { return Value::Poison };
        let name = format!("{name}[{}]", row.text(&self.families.found.counts));
        if !self.reaches(&name, index, columns, false, at) {
            return Value::Poison;
        }
        self.node(Local { column: Some(index), ..Local::of(field as u32, row) })
    }

    /// A value as an index of a node; `None` where it is none, which is reported.
    fn node_index(&mut self, index: &Value, at: &Expr) -> Option<NodeIndex> {
        let Some(known) = index_of(index) else {
            self.fail(Place::of(at), &messages::index_unknown(index.shape()));
            return None;
        };
        (!self.is_far(known, Place::of(at))).then_some(known)
    }

    /// The coordinate of elements that a node is.
    fn node(&mut self, local: Local) -> Value {
        let Numbered { name, unit, unit_text, place } =
            self.families.coordinates[local.field as usize].clone();
        let known = self.families.found.locals.iter().position(|known| *known == local);
        let number = known.unwrap_or_else(|| {
            self.families.found.locals.push(local);
            let name = local.text(&name, &self.families.found.counts);
            self.declare_symbol(SymbolKind::Coordinate, name, unit_text, place);
            self.families.found.locals.len() - 1
        });
        Scalar { node: self.model.graph.symbol(Symbol::Coordinate(number as u32)), unit }.into()
    }

    /// `self.mass[index]` of a numbered parameter. Its length is checked when the model is used.
    pub(in super::super) fn numbered_element(&mut self, parameter: usize, index: &Value, at: &Expr) -> Value {
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
        let Some(Range { start: first, end }) = index.values(self.families.rounds) else {
            return Value::Poison;
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

    /// Whether all rounds read nodes, or rows of a grid, that there are; else that is reported.
    fn reaches(&mut self, name: &str, index: NodeIndex, length: Anchor, rows: bool, at: &Expr) -> bool {
        let Some(Range { start: first, end }) = index.values(self.families.rounds) else { return false };
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
            Reach::Above => {
                let what = if rows { "row" } else { "node" };
                messages::index_above(name, index_text, rounds, what, length_text)
            }
            Reach::Unknown if rows => messages::row_of_other_count(name, index_text, rounds, length_text),
            Reach::Unknown => messages::index_of_other_count(name, index_text, rounds, length_text),
        };
        self.fail(Place::of(at), &message);
        false
    }

    /// Which rounds an index is about: ` with i from 0 to nodes - 1`.
    fn rounds_text(&self, index: NodeIndex) -> String {
        let counts = &self.families.found.counts;
        match (index, index.values(self.families.rounds)) {
            (NodeIndex::Round(axis, k), Some(range)) => {
                let Range { start, end } = range.shifted(-k);
                let (start, last) = (start.text(counts), end.shifted(-1).text(counts));
                format!(" with {} from {start} to {last}", axis.name())
            }
            _ => String::new(),
        }
    }
}

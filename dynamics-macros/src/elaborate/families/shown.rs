//! What a live page shows of a model with families: outputs, and where nodes are.
//!
//! Both are functions of Rust, which run as they are written. For a page they are followed as expressions,
//! for a whole range of indices at a time. What cannot be followed is no mistake: the page lacks it.

use std::mem;

use dynamics_symbolic::families::{NodeIndex, Range, Rounds, Shown, ShownPart};
use dynamics_symbolic::graph::NodeId;
use proc_macro2::Span;

use super::super::Elaborator;
use super::super::scope::Frame;
use super::super::values::{Scalar, UnitOf, Value, flatten};
use crate::diagnostics::{Diagnostics, Place};
use crate::syntax::{Function, Role};

use super::indices::index_of;

/// Rounds, the indices with which a helper is called in them, and what it returns.
type ShownValue = (Rounds, Vec<NodeIndex>, Value);

impl Elaborator<'_> {
    /// Notes the value of an output.
    pub(in super::super) fn note_output(&mut self, function: &Function, value: Value) {
        let numbered = matches!(value, Value::Mapped(_));
        let values: Vec<(Rounds, Value)> = match value {
            Value::Mapped(made) => made.to_vec(),
            Value::Total(total) => {
                let once = (Rounds::Once, total.rest.clone());
                total.rounds.iter().cloned().chain([once]).collect()
            }
            other => vec![(Rounds::Once, other)],
        };
        let parts = values.into_iter().map(|(rounds, value)| (rounds, Vec::new(), value));
        self.note_shown(function, false, numbered, parts.collect());
    }

    /// Follows the helpers that say where nodes are, for all indices for which they are called. Mistakes are
    /// none here, and nothing else that is known of the model changes.
    pub(in super::super) fn note_places(&mut self) {
        if self.diagnostics.len() > 0 || self.exhausted {
            return;
        }
        let known = mem::replace(self.diagnostics, Diagnostics::new());
        let (least, reads) = (self.families.found.least.clone(), self.families.found.reads.clone());
        self.role = Role::Output;
        for (index, ranges) in hulls(&self.families.called) {
            let function = &self.implementation.functions[index];
            let Some(ranges) = ranges.filter(|_| function.may_be_place_of_index()) else { continue };
            if let Some(values) = self.placed(index, &ranges)
                && self.families.found.least == least
                && self.diagnostics.len() == 0
            {
                self.note_shown(function, true, true, values);
            }
            self.families.found.least.clone_from(&least);
            self.families.found.reads.clone_from(&reads);
            self.families.cut = None;
            let _ = mem::replace(self.diagnostics, Diagnostics::new()).finish();
        }
        let unread = mem::replace(self.diagnostics, known);
        let _ = unread.finish();
    }

    /// What a helper returns for all indices of these ranges, with these indices; `None` where it cannot be
    /// followed.
    fn placed(&mut self, index: usize, ranges: &[Range]) -> Option<Vec<ShownValue>> {
        self.frames.push(Frame { scopes: vec![Vec::new()], ..Frame::default() });
        let at = Place::from(Span::call_site());
        let name = &self.implementation.functions[index].name;
        let made = self.rounds(ranges[0], at, &mut |this, first| {
            let called = |this: &mut Self, indices: &[&Value]| {
                let indices = indices.iter().map(|index| (*index).clone());
                let arguments = [Value::Model, Value::Coordinates].into_iter().chain(indices.clone());
                match this.call_function(name, arguments.map(|value| (value, at)).collect()) {
                    Value::Poison => Value::Poison,
                    place => Value::tuple(indices.chain([place]).collect()),
                }
            };
            let Some(inner) = ranges.get(1) else { return called(this, &[&first]) };
            match this.rounds(*inner, at, &mut |this, second| called(this, &[&first, &second])) {
                Some(made) => Value::Mapped(made.into()),
                None => Value::Poison,
            }
        });
        self.frames.pop();
        let nested = made?.into_iter().flat_map(|(rounds, value)| match value {
            Value::Mapped(made) => made.to_vec(),
            value => vec![(rounds, value)],
        });
        let part = |(rounds, value): (Rounds, Value)| {
            let Value::Tuple(items) = value else { return None };
            let (place, indices) = items.split_last()?;
            Some((rounds, indices.iter().map(index_of).collect::<Option<_>>()?, place.clone()))
        };
        nested.map(part).collect()
    }

    fn note_shown(&mut self, function: &Function, is_place: bool, numbered: bool, values: Vec<ShownValue>) {
        let (mut parts, mut suffixes): (Vec<ShownPart>, Vec<String>) = (Vec::new(), Vec::new());
        for (rounds, indices, value) in values {
            let value = match value {
                Value::Integer(_) => self.scalar(value, function.name.span()).into(),
                value => value,
            };
            let (mut components, mut units): (Vec<(String, Scalar)>, Vec<UnitOf>) = (Vec::new(), Vec::new());
            if !flatten(&value, "", &mut components, &mut units) || components.is_empty() {
                return;
            }
            let (own, values): (Vec<String>, Vec<NodeId>) =
                components.into_iter().map(|(suffix, scalar)| (suffix, scalar.node)).unzip();
            if !parts.is_empty() && suffixes != own {
                return;
            }
            suffixes = own;
            parts.push(ShownPart { rounds, indices, values });
        }
        let function = function.name.to_string();
        self.families.found.shown.push(Shown { function, is_place, numbered, suffixes, parts });
    }
}

/// For each function the smallest ranges that contain all indices for which it is called; `None` where two
/// counts decide which is the last.
pub(crate) fn hulls(called: &[(usize, Vec<Range>)]) -> Vec<(usize, Option<Vec<Range>>)> {
    let mut all: Vec<(usize, Option<Vec<Range>>)> = Vec::new();
    for (index, ranges) in called {
        match all.iter_mut().find(|(known, _)| known == index) {
            Some((_, whole)) => {
                let hull = |known: &Vec<Range>| known.iter().zip(ranges).map(|(a, b)| a.hull(*b)).collect();
                *whole = whole.as_ref().and_then(hull);
            }
            None => all.push((*index, Some(ranges.clone()))),
        }
    }
    all
}

//! Families: indices, ranges and sums whose ends are known when the program runs.
//!
//! A round of a sum is elaborated once for a whole range of indices. An index is i + k, a count + k or a
//! number. A comparison that not all rounds of a range decide alike cuts the range, and both parts are
//! elaborated by themselves, so that `if i == 0 { .. }` gives a round of its own. What a round reads is a
//! symbol of its element: `s[i]` and `s[i + 1]` are two coordinates there.
//!
//! A loop inside another one has a second index, j. A comparison in its rounds may cut either range: that of
//! the outer loop is elaborated again from there.
//!
//! A count is taken to be larger than every number that it is compared with. How large it has to be for that
//! is noted, and checked when the model is used.

mod constraints;
mod indices;
mod nodes;
mod shown;
mod sums;

pub(crate) use shown::hulls;

use dynamics_symbolic::families::{
    Anchor, Axis, FamilyModel, Field, Local, NodeIndex, Range, Rounds, Source, Term, TermKind,
};
use syn::Ident;

use super::Elaborator;
use super::calls::Argument;
use super::values::{Numbered, Value};
use crate::diagnostics::Place;
use crate::messages;
use crate::syntax::{FamilyLength, FieldKind};
use indices::{index_of, value_of};

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
    pub(super) rounds: Rounds,
    /// Which elaboration of a round this is, 0 outside of all rounds: a sum that was made in another one is
    /// none of this one.
    pub(super) scope: u32,
    /// How many rounds were elaborated.
    pub(super) scopes: u32,
    /// Where the range of an index has to be cut: its rounds do not decide a comparison alike.
    pub(super) cut: Option<(Axis, Anchor)>,
    /// For functions `(&self, q, index)` and `(&self, q, index, index)`: the indices for which they were
    /// called.
    pub(super) called: Vec<(usize, Vec<Range>)>,
}

impl Elaborator<'_> {
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
        let quantity = self.declaration.coordinates.iter().find(|quantity| quantity.name == *name);
        let anchor = |family: Option<&FamilyLength>| {
            let family = family?;
            let count = self.declaration.counts().position(|known| *known == family.count)?;
            Some(Anchor::End { count: count as u32, plus: family.plus })
        };
        let length = anchor(quantity.and_then(|quantity| quantity.family.as_ref()));
        let columns = anchor(quantity.and_then(|quantity| quantity.family_columns.as_ref()));
        self.families.found.fields.push(Field { name: name.to_string(), unit, length, columns });
    }

    /// `q.s.len()`, `q.w.len()`, `q.w[i].len()`.
    pub(super) fn length_of(&mut self, field: usize, axis: Axis) -> Value {
        let field = &self.families.found.fields[field];
        let length = if axis == Axis::First { field.length } else { field.columns };
        length.map_or(Value::Poison, |length| value_of(NodeIndex::Fixed(length)))
    }

    /// Notes for which indices a helper is called.
    pub(super) fn note_call(&mut self, function: usize, arguments: &[Argument]) {
        let [(Value::Model, _), (Value::Coordinates, _), indices @ ..] = arguments else { return };
        if !self.families.symbolic || !(1..=2).contains(&indices.len()) {
            return;
        }
        let rounds = self.families.rounds;
        let ranges = indices.iter().map(|(index, _)| index_of(index)?.values(rounds));
        if let Some(ranges) = ranges.collect::<Option<Vec<Range>>>() {
            self.families.called.push((function, ranges));
        }
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
            let of_rows = found.constraints.iter().flat_map(|c| &c.parts).filter_map(|part| part.range);
            let ranges = found.terms.iter().flat_map(|term| term.rounds.ranges()).chain(of_rows);
            let ends = ranges.flat_map(|range| [range.start, range.end]);
            let lengths = found.fields.iter().flat_map(|field| [field.length, field.columns]).flatten();
            let fixed = |index: NodeIndex| matches!(index, NodeIndex::Fixed(anchor) if of(anchor));
            let node = |local: &Local| fixed(local.index) || local.column.is_some_and(fixed);
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
                let once = (Rounds::Once, total.rest.clone());
                total.rounds.iter().cloned().chain([once]).collect()
            }
            other => vec![(Rounds::Once, other)],
        };
        for (rounds, value) in parts {
            let Some(kind) = kind(self, value) else { return };
            if is_nothing(self, &kind) {
                continue;
            }
            let origin = self.origins.add(place);
            let function = function.to_owned();
            self.families.found.terms.push(Term { function, rounds, kind, origin });
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

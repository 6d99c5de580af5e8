//! What a model with families declares.

use crate::graph::{NodeId, Origin};
use crate::mechanics::{ConstraintKind, EnergyRole, ForceTerm, Model};

/// An index that no round changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Anchor {
    /// k.
    Start(i64),
    /// A count plus k.
    End {
        /// Which count.
        count: u32,
        /// What is added to it.
        plus: i64,
    },
}

impl Anchor {
    /// The index `by` further.
    #[must_use]
    pub fn shifted(self, by: i64) -> Self {
        match self {
            Self::Start(k) => Self::Start(k + by),
            Self::End { count, plus } => Self::End { count, plus: plus + by },
        }
    }

    /// Its value at these counts.
    #[must_use]
    pub fn at(self, counts: &[i64]) -> i64 {
        match self {
            Self::Start(k) => k,
            Self::End { count, plus } => counts[count as usize] + plus,
        }
    }

    /// Whether it is not behind another; `None` where two counts decide that. A count is larger than every
    /// number beside it.
    fn at_most(self, other: Self) -> Option<bool> {
        match (self, other) {
            (Self::End { count: a, .. }, Self::End { count: b, .. }) if a != b => None,
            _ => Some(self <= other),
        }
    }

    /// As the user writes it.
    #[must_use]
    pub fn text(self, counts: &[String]) -> String {
        match self {
            Self::Start(k) => k.to_string(),
            Self::End { count, plus } => with_offset(&counts[count as usize], plus),
        }
    }
}

/// `name`, `name + 2`, `name - 1`.
pub(super) fn with_offset(name: &str, plus: i64) -> String {
    match plus {
        0 => name.to_owned(),
        1.. => format!("{name} + {plus}"),
        _ => format!("{name} - {}", -plus),
    }
}

/// One of the two indices that a sum may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Axis {
    /// i: the index of the only loop, or of the outer one.
    First,
    /// j: the index of the loop inside another one.
    Second,
}

impl Axis {
    /// Both.
    pub const ALL: [Self; 2] = [Self::First, Self::Second];

    /// Its letter in texts.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::First => "i",
            Self::Second => "j",
        }
    }
}

/// Which node of a field an element reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum NodeIndex {
    /// i + k or j + k, i and j the indices of the round.
    Round(Axis, i64),
    /// The same node in every round.
    Fixed(Anchor),
}

impl NodeIndex {
    /// The index `by` further.
    #[must_use]
    pub fn shifted(self, by: i64) -> Self {
        match self {
            Self::Round(axis, k) => Self::Round(axis, k + by),
            Self::Fixed(at) => Self::Fixed(at.shifted(by)),
        }
    }

    /// How much further than the round it is; `None` where it is the same in all rounds.
    #[must_use]
    pub fn offset(self) -> Option<i64> {
        match self {
            Self::Round(_, k) => Some(k),
            Self::Fixed(_) => None,
        }
    }

    /// The same index where those of the round are these.
    #[must_use]
    pub fn with(self, round: [Self; 2]) -> Self {
        match self {
            Self::Round(axis, k) => round[axis as usize].shifted(k),
            fixed @ Self::Fixed(_) => fixed,
        }
    }

    /// As the user writes it.
    #[must_use]
    pub fn text(self, counts: &[String]) -> String {
        match self {
            Self::Round(axis, k) => with_offset(axis.name(), k),
            Self::Fixed(anchor) => anchor.text(counts),
        }
    }

    /// Its value in round (i, j), at these counts.
    #[must_use]
    pub fn at(self, round: [i64; 2], counts: &[i64]) -> i64 {
        match self {
            Self::Round(axis, k) => round[axis as usize] + k,
            Self::Fixed(anchor) => anchor.at(counts),
        }
    }

    /// All values that it has in these rounds; `None` where they have no such index.
    #[must_use]
    pub fn values(self, rounds: Rounds) -> Option<Range> {
        match self {
            Self::Round(axis, k) => rounds.range(axis).map(|range| range.shifted(k)),
            Self::Fixed(at) => Some(Range { start: at, end: at.shifted(1) }),
        }
    }
}

/// Indices from `start` to before `end`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Range {
    /// The first.
    pub start: Anchor,
    /// The one after the last.
    pub end: Anchor,
}

impl Range {
    /// The smallest range that contains both; `None` where two counts decide which index is the first or the
    /// last.
    #[must_use]
    pub fn hull(self, other: Self) -> Option<Self> {
        let start = if self.start.at_most(other.start)? { self.start } else { other.start };
        let end = if self.end.at_most(other.end)? { other.end } else { self.end };
        Some(Self { start, end })
    }

    /// All indices `by` further.
    #[must_use]
    pub fn shifted(self, by: i64) -> Self {
        Self { start: self.start.shifted(by), end: self.end.shifted(by) }
    }

    /// Its indices at these counts.
    #[must_use]
    pub fn at(self, counts: &[i64]) -> core::ops::Range<i64> {
        self.start.at(counts)..self.end.at(counts)
    }
}

/// The rounds of an element.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Rounds {
    /// One, with no index.
    #[default]
    Once,
    /// Those of a loop over i.
    Over(Range),
    /// Those of a loop over i with a loop over j inside.
    Nested(Range, Range),
}

impl Rounds {
    /// The range of an index; `None` where the rounds have no such index.
    #[must_use]
    pub fn range(self, axis: Axis) -> Option<Range> {
        match (self, axis) {
            (Self::Over(range) | Self::Nested(range, _), Axis::First) => Some(range),
            (Self::Nested(_, range), Axis::Second) => Some(range),
            _ => None,
        }
    }

    /// Its ranges, the outer one first.
    pub fn ranges(self) -> impl Iterator<Item = Range> {
        Axis::ALL.into_iter().filter_map(move |axis| self.range(axis))
    }

    /// The index of a further loop inside; `None` where there are two already.
    #[must_use]
    pub fn next_axis(self) -> Option<Axis> {
        Axis::ALL.into_iter().find(|axis| self.range(*axis).is_none())
    }

    /// The rounds of a further loop inside; `None` where there are two already.
    #[must_use]
    pub fn with_inside(self, range: Range) -> Option<Self> {
        match self {
            Self::Once => Some(Self::Over(range)),
            Self::Over(outer) => Some(Self::Nested(outer, range)),
            Self::Nested(..) => None,
        }
    }

    /// Every round (i, j) at these counts; 0 for an index that there is not.
    #[must_use]
    pub fn all(self, counts: &[i64]) -> Vec<[i64; 2]> {
        let [outer, inner] = Axis::ALL.map(|axis| self.range(axis).map_or(0..1, |range| range.at(counts)));
        outer.flat_map(|i| inner.clone().map(move |j| [i, j])).collect()
    }
}

/// A declared coordinate: a family, or an ordinary coordinate.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Field {
    /// The user's name.
    pub name: String,
    /// Its unit as text, empty where unknown or 1.
    pub unit: String,
    /// The number of its nodes, of a grid of its rows; `None` for an ordinary coordinate.
    pub length: Option<Anchor>,
    /// The number of columns of a grid.
    pub columns: Option<Anchor>,
}

impl Field {
    /// How many coordinates it has at these counts. Those of a grid lie row by row.
    #[must_use]
    pub fn nodes(&self, counts: &[i64]) -> i64 {
        self.length.map_or(1, |length| length.at(counts)) * self.width(counts)
    }

    /// How far rows are apart.
    #[must_use]
    pub fn width(&self, counts: &[i64]) -> i64 {
        self.columns.map_or(1, |columns| columns.at(counts))
    }
}

/// A coordinate of an element: `Symbol::Coordinate(i)` is `locals[i]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Local {
    /// Which field.
    pub field: u32,
    /// Which of its nodes, of a grid which row.
    pub index: NodeIndex,
    /// Which column of a grid.
    pub column: Option<NodeIndex>,
}

impl Local {
    /// A node of a family with one index, or an ordinary coordinate.
    #[must_use]
    pub fn of(field: u32, index: NodeIndex) -> Self {
        Self { field, index, column: None }
    }

    /// The same node where the indices of the round are these.
    #[must_use]
    pub fn with(self, round: [NodeIndex; 2]) -> Self {
        let column = self.column.map(|column| column.with(round));
        Self { field: self.field, index: self.index.with(round), column }
    }

    /// As the user writes it: `s[i + 1]`, `w[i][j]`.
    #[must_use]
    pub fn text(self, name: &str, counts: &[String]) -> String {
        let column = self.column.map_or_else(String::new, |column| format!("[{}]", column.text(counts)));
        format!("{name}[{}]{column}", self.index.text(counts))
    }
}

/// Where a parameter of an element comes from: `Symbol::Parameter(i)` is `sources[i]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Source {
    /// A scalar parameter of the model, by its number there.
    Scalar(u32),
    /// A count as a number.
    Count(u32),
    /// An index of the round as a number.
    Round(Axis),
    /// An element of a numbered parameter.
    Numbered {
        /// Which of them.
        parameter: u32,
        /// Which element.
        index: NodeIndex,
    },
}

/// What a term adds to the model.
#[derive(Clone, Debug)]
pub enum TermKind {
    /// An energy or a dissipation function.
    Energy(EnergyRole, NodeId),
    /// An applied force.
    Force(Vec<ForceTerm>),
}

/// A term of the model: of every round of a loop, or of two, or by itself.
#[derive(Clone, Debug)]
pub struct Term {
    /// The function that has it.
    pub function: String,
    /// When it is added.
    pub rounds: Rounds,
    /// What it adds.
    pub kind: TermKind,
    /// Where it was declared.
    pub origin: Origin,
}

/// Rows of a constraint: of every round of a range, or by themselves.
#[derive(Clone, Debug)]
pub struct RowPart {
    /// The rounds; `None`: once, with no index.
    pub range: Option<Range>,
    /// The value of each component: Φ, or A q̇ + b.
    pub values: Vec<NodeId>,
}

/// A constraint of a model with families.
#[derive(Clone, Debug)]
pub struct FamilyConstraint {
    /// The user's name.
    pub name: String,
    /// What it restricts.
    pub kind: ConstraintKind,
    /// Whether every round has rows of its own; else what all rounds say is added up.
    pub numbered: bool,
    /// Suffixes of the components of a round: `""`, `.x`.
    pub components: Vec<String>,
    /// The unit of each component as text, empty where unknown or 1.
    pub units: Vec<String>,
    /// What it says, in the order of its rows.
    pub parts: Vec<RowPart>,
    /// Where it was declared.
    pub origin: Origin,
}

impl FamilyConstraint {
    /// Whether it restricts coordinates.
    #[must_use]
    pub fn is_holonomic(&self) -> bool {
        self.kind == ConstraintKind::Holonomic
    }
}

/// What a live page shows beside the motion: an output, or where the nodes are that a helper places.
#[derive(Clone, Debug)]
pub struct Shown {
    /// The function.
    pub function: String,
    /// Whether it is a helper that says where nodes are, and no output.
    pub is_place: bool,
    /// Whether every round has values of its own; else those of all rounds are added.
    pub numbered: bool,
    /// What the names of its components end with: nothing, `.x`, or `[0]`.
    pub suffixes: Vec<String>,
    /// The values, in the order of the indices.
    pub parts: Vec<ShownPart>,
}

/// What the rounds of a range show.
#[derive(Clone, Debug)]
pub struct ShownPart {
    /// The rounds.
    pub rounds: Rounds,
    /// Of a place the indices that the helper is called with.
    pub indices: Vec<NodeIndex>,
    /// The components.
    pub values: Vec<NodeId>,
}

/// A multiplier in texts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Multiplier {
    /// Which constraint.
    pub constraint: usize,
    /// Which component of it.
    pub component: usize,
    /// Which of its rows; `None` where all rounds add to one row, or the number has another form.
    pub index: Option<NodeIndex>,
}

/// A model with families as declared.
#[derive(Clone, Debug, Default)]
pub struct FamilyModel {
    /// Graph, inputs, functions. Its coordinates are [`Self::locals`], its parameters [`Self::sources`].
    pub model: Model,
    /// The declared coordinates.
    pub fields: Vec<Field>,
    /// The names of the counts.
    pub counts: Vec<String>,
    /// The names of the numbered parameters.
    pub numbered: Vec<String>,
    /// The coordinates that elements read.
    pub locals: Vec<Local>,
    /// The parameters that elements read.
    pub sources: Vec<Source>,
    /// What adds up to the equations of motion.
    pub terms: Vec<Term>,
    /// The constraints, the holonomic ones first.
    pub constraints: Vec<FamilyConstraint>,
    /// Multipliers that texts name: `Symbol::Multiplier(i)` is `multipliers[i]`.
    pub multipliers: Vec<Multiplier>,
    /// Outputs and places, as far as they can be followed.
    pub shown: Vec<Shown>,
    /// The smallest value of every count for which the order of all indices is as the terms assume it.
    pub least: Vec<i64>,
    /// Numbered parameters with the indices after the last that are read.
    pub reads: Vec<(u32, Anchor)>,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn end(count: u32, plus: i64) -> Anchor {
        Anchor::End { count, plus }
    }

    #[test]
    fn the_hull_of_two_ranges_is_known_for_one_count() {
        let short = Range { start: Anchor::Start(1), end: end(0, 0) };
        let late = Range { start: end(0, -1), end: end(0, 2) };
        let whole = Range { start: Anchor::Start(1), end: end(0, 2) };
        assert_eq!(short.hull(late), Some(whole));
        assert_eq!(late.hull(short), Some(whole));
    }

    /// Which of two counts is larger is known when the program runs.
    #[test]
    fn the_hull_of_ranges_of_two_counts_is_not_known() {
        let [one, other] = [0, 1].map(|count| Range { start: Anchor::Start(0), end: end(count, 0) });
        assert_eq!(one.hull(other), None);
        assert_eq!(one.hull(one), Some(one));
    }
}

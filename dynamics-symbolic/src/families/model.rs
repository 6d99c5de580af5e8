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

/// Which node of a field an element reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum NodeIndex {
    /// i + k, i the index of the round.
    Round(i64),
    /// The same node in every round.
    Fixed(Anchor),
}

impl NodeIndex {
    /// As the user writes it.
    #[must_use]
    pub fn text(self, counts: &[String]) -> String {
        match self {
            Self::Round(k) => with_offset("i", k),
            Self::Fixed(anchor) => anchor.text(counts),
        }
    }

    /// Its value in round `i`, at these counts.
    #[must_use]
    pub fn at(self, i: i64, counts: &[i64]) -> i64 {
        match self {
            Self::Round(k) => i + k,
            Self::Fixed(anchor) => anchor.at(counts),
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

/// A declared coordinate: a family, or an ordinary coordinate.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Field {
    /// The user's name.
    pub name: String,
    /// Its unit as text, empty where unknown or 1.
    pub unit: String,
    /// The number of its nodes; `None` for an ordinary coordinate.
    pub length: Option<Anchor>,
}

/// A coordinate of an element: `Symbol::Coordinate(i)` is `locals[i]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Local {
    /// Which field.
    pub field: u32,
    /// Which of its nodes.
    pub index: NodeIndex,
}

/// Where a parameter of an element comes from: `Symbol::Parameter(i)` is `sources[i]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Source {
    /// A scalar parameter of the model, by its number there.
    Scalar(u32),
    /// A count as a number.
    Count(u32),
    /// The index of the round as a number.
    Round,
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

/// A term of the model: of every round of a range, or by itself.
#[derive(Clone, Debug)]
pub struct Term {
    /// The function that has it.
    pub function: String,
    /// The rounds; `None`: once, with no index.
    pub range: Option<Range>,
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
    /// The smallest value of every count for which the order of all indices is as the terms assume it.
    pub least: Vec<i64>,
    /// Numbered parameters with the indices after the last that are read.
    pub reads: Vec<(u32, Anchor)>,
}

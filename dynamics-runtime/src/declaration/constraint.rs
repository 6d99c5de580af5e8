//! The declared constraints of a model, and how its equations are solved with them.

/// What a constraint restricts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ConstraintKind {
    /// Φ(q, t) = 0.
    Holonomic,
    /// A(q, t) q̇ + b(q, t) = 0.
    Nonholonomic,
}

/// A constraint of a model: one function with `#[holonomic]` or `#[nonholonomic]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Constraint {
    /// Its name.
    pub name: &'static str,
    /// What it restricts.
    pub kind: ConstraintKind,
    /// Its first row.
    pub first: usize,
    /// Number of its rows.
    pub rows: usize,
    /// It was declared to repeat others.
    pub redundant: bool,
    /// Its index among the switched constraints, if it is switched on and off: see
    /// [`ActiveSet`](crate::model::ActiveSet).
    pub switched: Option<usize>,
}

/// The solver of a model's accelerations and multipliers, where no pivot is too small.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SolverKind {
    /// There are no constraints.
    Unconstrained,
    /// By straight-line code, generated for this order of elimination.
    Unrolled {
        /// In words, for summaries: `loops eliminated block by block (beta leads)`.
        elimination: &'static str,
    },
    /// By the general rank-revealing solver.
    General {
        /// Why, in words: `constraints repeat each other`.
        reason: &'static str,
    },
}

/// Coordinates that generated code solves for from rows of the constraints, as many as these, before what
/// leads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Block {
    /// The rows.
    pub rows: &'static [usize],
    /// The coordinates.
    pub coordinates: &'static [usize],
}

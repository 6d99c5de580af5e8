//! The solution of M q̈ − Φ_qᵀλ = Q, Φ_q q̈ = γ as nodes of the graph.

use crate::graph::NodeId;

/// In which order unknowns are eliminated.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Elimination {
    /// q̈ and λ together, fewest neighbours first, a multiplier only after every coordinate in its row.
    MinimumDegree,
    /// Dependent coordinates in blocks of rows first (null space): (rows, dependent coordinates) of each
    /// block in order.
    Blocks(Vec<(Vec<usize>, Vec<usize>)>),
    /// The declared speeds lead, and all coordinates follow from them and the constraints.
    Speeds,
}

/// What a guard belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Guarded {
    /// A pivot of the inertia of this coordinate.
    Coordinate(usize),
    /// A pivot of this constraint row.
    Row(usize),
}

/// Smallest ratio of a pivot of the inertia to the diagonal element that it came from. It is 450 ε: a smaller
/// pivot is rounding of the elimination.
pub(super) const LEAST_INERTIA_RATIO: f64 = 1e-13;

/// A pivot of the unrolled solution, with the size that it is compared with: below `tolerance`·|scale| the
/// general solver takes over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guard {
    /// Whose it is.
    pub of: Guarded,
    /// The pivot or determinant.
    pub pivot: NodeId,
    /// What it is compared with.
    pub scale: NodeId,
    /// The smallest admissible ratio.
    pub tolerance: f64,
}

/// The solution on the graph.
#[derive(Clone, Debug)]
pub struct Unrolled {
    /// The order of elimination that was chosen.
    pub elimination: Elimination,
    /// q̈, N.
    pub accelerations: Vec<NodeId>,
    /// λ, R.
    pub multipliers: Vec<NodeId>,
    /// Pivots to check.
    pub guards: Vec<Guard>,
    /// δ, N, with M δ = Φ_qᵀμ for some μ, Φ_q δ = r, where the right-hand sides r are the symbols
    /// `Symbol::Multiplier`. Mass-weighted corrections of positions and velocities and Baumgarte's terms are
    /// such solutions.
    pub correction: Vec<NodeId>,
    /// The same pivots, by nodes that the correction shares.
    pub correction_guards: Vec<Guard>,
}

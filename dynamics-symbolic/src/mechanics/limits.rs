//! How large equations may become.

/// Most operations of one emitted function. Beyond, rustc takes minutes, and the general solver, which works
/// on arrays, takes over.
pub const MOST_OPERATIONS: usize = 20_000;

/// Nodes after which deriving Jacobians is given up: three for each operation that can be emitted. The
/// largest model that fits takes half.
pub(super) const MOST_NODES: usize = 3 * MOST_OPERATIONS;

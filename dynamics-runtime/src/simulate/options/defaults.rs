//! Defaults of the options of a simulation.

/// Default tolerance. Nine digits are far more than a plot shows or a parameter has, and cost less than twice
/// as much as six with Verner 9(8).
pub const DEFAULT_TOLERANCE: f64 = 1e-9;

/// Default limit of the number of steps. The motion of a million steps takes a few hundred megabytes at most,
/// and minutes to compute. Runs with more steps are usually mistakes.
pub const DEFAULT_MAX_STEPS: u64 = 1_000_000;

/// Default drift limit, in parts of the size of the coordinates: a thousand times the violation that a start
/// may have. Pictures of such a motion still look right, its numbers are wrong.
pub(crate) const DEFAULT_DRIFT_LIMIT: f64 = 1e-3;

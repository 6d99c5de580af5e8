//! What a simulation does where its options do not say.

/// Nine digits: far below what a plot shows or a parameter is known to, at less than twice the cost of six
/// with Verner 9(8).
pub(crate) const DEFAULT_TOLERANCE: f64 = 1e-9;

/// A million steps are a few hundred megabytes of motion at most, and minutes of work: beyond it something is
/// wrong more often than not.
pub(crate) const DEFAULT_MAX_STEPS: u64 = 1_000_000;

/// A thousand times what a start may miss its constraints by: a picture still looks right, a number no longer
/// is.
pub(crate) const DEFAULT_DRIFT_LIMIT: f64 = 1e-3;

//! What the rows say of the distribution of a number.

mod binomial;
mod importance;
mod mean;
mod quantile;

pub use importance::{Importance, ImportanceOfInput};
pub use mean::Mean;
pub use quantile::Quantile;

use crate::error::EnsembleError;

/// The confidence of intervals.
pub(crate) const CONFIDENCE: f64 = 0.95;

/// An error unless it is a probability, neither 0 nor 1.
fn check_probability(what: &'static str, value: f64) -> Result<(), EnsembleError> {
    if value > 0.0 && value < 1.0 { Ok(()) } else { Err(EnsembleError::Probability { what, value }) }
}

/// An error if there are too few runs.
fn check_count(what: &'static str, least: usize, found: usize) -> Result<(), EnsembleError> {
    if found >= least { Ok(()) } else { Err(EnsembleError::TooFewRuns { what, least, found }) }
}

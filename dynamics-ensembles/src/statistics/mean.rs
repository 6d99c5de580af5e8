//! Mean and standard deviation.

use super::{CONFIDENCE, check_count};
use crate::error::EnsembleError;
use crate::inputs::standard_normal;

/// The mean of a number over all runs that did not fail.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mean {
    /// The mean.
    pub value: f64,
    /// Half the length of its 95 % interval, by the normal distribution, for independent runs. Of Sobol
    /// sequences and Latin hypercubes the error is usually smaller. On a grid it means nothing.
    pub margin: f64,
    /// The standard deviation of the number itself, with n − 1.
    pub deviation: f64,
    /// The smallest value.
    pub least: f64,
    /// The largest value.
    pub greatest: f64,
    /// Runs that did not fail.
    pub runs: usize,
}

impl std::fmt::Display for Mean {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { value, margin, deviation, least, greatest, runs } = self;
        write!(
            f,
            "mean {value:.6e} ± {margin:.1e} (95 %), standard deviation {deviation:.4e}, from {least:.4e} \
             to {greatest:.4e}, {runs} runs"
        )
    }
}

impl Mean {
    pub(crate) fn of(values: &[f64]) -> Result<Self, EnsembleError> {
        check_count("a mean", 2, values.len())?;
        let n = values.len() as f64;
        let value = values.iter().sum::<f64>() / n;
        let squares: f64 = values.iter().map(|x| (x - value).powi(2)).sum();
        let deviation = (squares / (n - 1.0)).sqrt();
        let margin = standard_normal(0.5 + 0.5 * CONFIDENCE) * deviation / n.sqrt();
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        let greatest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        Ok(Self { value, margin, deviation, least, greatest, runs: values.len() })
    }
}

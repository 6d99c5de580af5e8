//! Robust losses, which outliers do not dominate.
//!
//! Instead of Σ r² the sum Σ s² ρ(r/s) is minimised. s is the scale of the noise: the given σ, or 1.4826
//! times the median of |r|, which up to half of the data may be outliers without moving far. Each round fits
//! with weights w = ψ(r/s)/(r/s), ψ = ρ'/2, and then updates scale and weights (P. W. Holland & R. E. Welsch,
//! Comm. Statist. A 6 (1977) 813). The first weights are those at the first values, so that no outlier
//! attracts the search. Cauchy's loss has several minima: it begins where Huber's ends.
//!
//! Covariance after P. J. Huber, *Robust Statistics* (1981), §7.6: κ² s² [Σ ψ²/(n − p)]/(mean ψ')² (JᵀJ)⁻¹, κ
//! = 1 + (p/n) var ψ'/(mean ψ')².

use alloc::vec::Vec;

use nalgebra::{DMatrix, DVector};

use super::super::sensitivity_error::SensitivityError;
use super::levenberg::{Levenberg, Outcome, ResidualEvaluation};

/// Limit of Huber's loss, in scales, at which normal noise costs 5 % of the information (Holland & Welsch,
/// table 1).
const HUBER_LIMIT: f64 = 1.345;

/// How residuals are weighted in a fit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum Loss {
    /// ρ = r²: least squares. One outlier can dominate the fit.
    #[default]
    Squares,
    /// ρ = r² up to this many times the scale, linear from there on: an outlier pulls with a constant force.
    /// One minimum, where least squares have one.
    Huber(f64),
    /// ρ = c² ln(1 + (r/c)²), c this many times the scale: an outlier pulls the less the farther it is off.
    Cauchy(f64),
}

impl Loss {
    /// Huber's, with 1.345 times the scale: standard errors 2.5 % larger than those of least squares where
    /// the noise is normal.
    pub const HUBER: Self = Self::Huber(HUBER_LIMIT);
    /// Cauchy's, with 2.385 times the scale: likewise.
    pub const CAUCHY: Self = Self::Cauchy(CAUCHY_LIMIT);

    /// The limit of the loss; `None` of least squares.
    #[must_use]
    pub fn limit(self) -> Option<f64> {
        match self {
            Self::Squares => None,
            Self::Huber(limit) | Self::Cauchy(limit) => Some(limit),
        }
    }

    /// ψ(x)/x.
    fn weight(self, x: f64) -> f64 {
        match self {
            Self::Squares => 1.0,
            Self::Huber(k) if x.abs() <= k => 1.0,
            Self::Huber(k) => k / x.abs(),
            Self::Cauchy(c) => 1.0 / (1.0 + (x / c).powi(2)),
        }
    }

    /// ψ'(x).
    fn slope(self, x: f64) -> f64 {
        match self {
            Self::Squares => 1.0,
            Self::Huber(k) if x.abs() <= k => 1.0,
            Self::Huber(_) => 0.0,
            Self::Cauchy(c) => {
                let square = (x / c).powi(2);
                (1.0 - square) / (1.0 + square).powi(2)
            }
        }
    }
}

/// Limit of Cauchy's loss, in scales, with the same efficiency (Holland & Welsch, table 1).
const CAUCHY_LIMIT: f64 = 2.385;

/// Standard deviation of normal noise divided by the median of its absolute value.
const SIGMA_PER_MEDIAN: f64 = 1.4826;
/// Most rounds of reweighting. Each removes a third of the error or more.
const MAX_ROUNDS: usize = 100;
/// Most rounds of Huber's loss before them, which only have to come near.
const MAX_HUBER_ROUNDS: usize = 20;
/// Rounds after which a search within a round that does not converge ends the fit. The first ones begin far
/// away.
const ROUNDS_THAT_MAY_FAIL: usize = 4;
/// Relative change of the scale and of the weighted residuals at which the rounds have converged.
const CONVERGED_ROUND_CHANGE: f64 = 1e-6;

/// The weights of the data in a fit.
#[derive(Clone, Debug)]
pub(super) struct FitWeights {
    pub(super) loss: Loss,
    /// s, in σ; 1 where σ is given or the loss is that of least squares.
    pub(super) scale: f64,
    /// One for each datum.
    pub(super) weights: Vec<f64>,
}

impl FitWeights {
    pub(super) fn evenly(count: usize) -> Self {
        Self { loss: Loss::Squares, scale: 1.0, weights: alloc::vec![1.0; count] }
    }

    fn of(loss: Loss, scale: f64, residuals: &DVector<f64>) -> Self {
        Self { loss, scale, weights: residuals.iter().map(|r| loss.weight(r / scale)).collect() }
    }

    /// The factor of (JᵀJ)⁻¹ in the covariance of p unknowns; `None` if most data lie beyond the limit.
    pub(super) fn variance(&self, residuals: &DVector<f64>, unknowns: usize) -> Option<f64> {
        let (n, p) = (residuals.len() as f64, unknowns as f64);
        let slopes: Vec<f64> = residuals.iter().map(|r| self.loss.slope(r / self.scale)).collect();
        let mean = slopes.iter().sum::<f64>() / n;
        let scatter = slopes.iter().map(|slope| (slope - mean).powi(2)).sum::<f64>() / n;
        let pulls: f64 = residuals.iter().zip(&self.weights).map(|(r, w)| (r * w).powi(2)).sum();
        let larger = 1.0 + p / n * scatter / (mean * mean);
        let found = larger * larger * pulls / ((n - p) * mean * mean);
        (mean > 0.0 && n > p).then_some(found)
    }
}

/// Minimises the sum of losses by iteratively reweighted least squares: rounds of Huber's loss, then of the
/// loss itself. A scale that is not given is updated in each round, and is at least `least`.
pub(super) fn minimize(
    search: &Levenberg<'_>,
    (loss, scale, least): (Loss, Option<f64>, f64),
    first: &DVector<f64>,
    evaluate: impl Fn(&DVector<f64>, bool) -> ResidualEvaluation,
) -> Result<(Outcome, FitWeights), SensitivityError> {
    let scale_of = |residuals: &DVector<f64>| scale.unwrap_or_else(|| median_size(residuals).max(least));
    let mut at = first.clone();
    let (mut residuals, _) = evaluate(&at, false)?;
    let mut iterations = 0;
    let mut last = None;
    let nearer = Loss::Huber(loss.limit().map_or(HUBER_LIMIT, |limit| limit.min(HUBER_LIMIT)));
    // Each round minimises with the weights of the residuals before it.
    for (stage, most) in [(nearer, MAX_HUBER_ROUNDS), (loss, MAX_ROUNDS)] {
        for round in 1..=most {
            let weighed = FitWeights::of(stage, scale_of(&residuals), &residuals);
            let roots = DVector::from_iterator(residuals.len(), weighed.weights.iter().map(|w| w.sqrt()));
            let found = search.minimize(&at, |at, jacobian| {
                let (residuals, by) = evaluate(at, jacobian)?;
                Ok((residuals.component_mul(&roots), by.map(|by| by_rows(by, &roots))))
            })?;
            iterations += found.iterations;
            let before = residuals;
            at = found.at;
            residuals = evaluate(&at, false)?.0;
            let again = FitWeights::of(stage, scale_of(&residuals), &residuals);
            // Converged if neither the weighted residuals nor the scale change.
            let moved = (&residuals - &before).component_mul(&roots).norm();
            let settles = moved <= CONVERGED_ROUND_CHANGE * residuals.component_mul(&roots).norm().max(least)
                && (again.scale - weighed.scale).abs() <= CONVERGED_ROUND_CHANGE * weighed.scale;
            last = Some((again, found.settled && settles));
            if settles || (!found.settled && round > ROUNDS_THAT_MAY_FAIL) {
                break;
            }
        }
    }
    let (weighed, settled) = last.unwrap_or_else(|| (FitWeights::evenly(residuals.len()), false));
    let (residuals, jacobian) = evaluate(&at, true)?;
    let jacobian = jacobian.unwrap_or_else(|| DMatrix::zeros(0, 0));
    Ok((Outcome { at, residuals, jacobian, iterations, settled }, weighed))
}

/// The matrix with its rows multiplied by factors.
fn by_rows(mut matrix: DMatrix<f64>, factors: &DVector<f64>) -> DMatrix<f64> {
    matrix.row_iter_mut().zip(factors.iter()).for_each(|(mut row, factor)| row *= *factor);
    matrix
}

/// 1.4826 times the median of |r|.
pub(super) fn median_size(residuals: &DVector<f64>) -> f64 {
    SIGMA_PER_MEDIAN * median(&mut residuals.iter().map(|r| r.abs()).collect::<Vec<_>>())
}

/// The median; 0 if there are no values.
pub(super) fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() {
        0 => 0.0,
        odd if odd % 2 == 1 => values[middle],
        _ => 0.5 * (values[middle - 1] + values[middle]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ψ' by differences of ψ, and weights that fall with the size.
    #[test]
    fn slopes_are_those_of_the_pulls() {
        for loss in [Loss::Squares, Loss::HUBER, Loss::CAUCHY, Loss::Huber(0.3), Loss::Cauchy(7.0)] {
            for x in [-9.0, -1.0, -0.1, 0.2, 1.1, 3.0, 40.0] {
                let pull = |x: f64| x * loss.weight(x);
                let slope = (pull(x + 1e-6) - pull(x - 1e-6)) / 2e-6;
                assert!((slope - loss.slope(x)).abs() < 1e-8, "{loss:?} {x}");
                assert!(loss.weight(x) <= loss.weight(0.9 * x));
            }
        }
        assert_eq!(median_size(&DVector::from_row_slice(&[1.0, -2.0, 900.0])), 2.0 * SIGMA_PER_MEDIAN);
        assert_eq!(median_size(&DVector::from_row_slice(&[1.0, -2.0, 4.0, 900.0])), 3.0 * SIGMA_PER_MEDIAN);
    }
}

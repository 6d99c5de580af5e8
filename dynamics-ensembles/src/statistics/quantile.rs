//! Quantiles with bounds that hold for every distribution.
//!
//! Of n independent runs the number below the p-quantile has the binomial distribution of n and p. So the
//! interval from the l-th to the u-th smallest value has the quantile with probability P(l ≤ K < u),
//! whatever the distribution (H. A. David & H. N. Nagaraja, *Order Statistics*, 2003, section 7.1).

use super::binomial::Binomial;
use super::{check_count, check_probability};
use crate::error::EnsembleError;

/// A quantile of a number over all runs that did not fail.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantile {
    /// The probability.
    pub p: f64,
    /// The value below which this part of the runs lies, interpolated between neighbours.
    pub value: f64,
    /// The lower bound; −∞ where the runs are too few for one.
    pub low: f64,
    /// The upper bound; ∞ where the runs are too few for one.
    pub high: f64,
    /// The probability that the bounds enclose the quantile, at least the confidence that was asked for, for
    /// independent runs.
    pub coverage: f64,
    /// Runs that did not fail.
    pub runs: usize,
}

impl std::fmt::Display for Quantile {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { p, value, low, high, coverage, runs } = self;
        let (percent, covered) = (100.0 * p, 100.0 * coverage);
        write!(
            f,
            "{percent} % of {runs} runs lie below {value:.6e}, between {low:.4e} and {high:.4e} with \
             {covered:.1} % confidence"
        )
    }
}

impl Quantile {
    /// The quantile of values in any order.
    pub(crate) fn of(values: &[f64], p: f64, confidence: f64) -> Result<Self, EnsembleError> {
        check_probability("the probability of a quantile", p)?;
        check_probability("the confidence of a quantile", confidence)?;
        check_count("a quantile", 1, values.len())?;
        let mut sorted = values.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let n = sorted.len();
        // Hyndman and Fan's definition 7, NumPy's default.
        let place = (n - 1) as f64 * p;
        let (below, part) = (place as usize, place.fract());
        let (a, b) = (sorted[below], sorted[(below + 1).min(n - 1)]);
        // Not a + part·(b − a): ∞ − ∞ is not a number.
        let value = if part == 0.0 || a == b { a } else { a * (1.0 - part) + b * part };
        let binomial = Binomial::new(n, p);
        let outside = 0.5 * (1.0 - confidence);
        // The l-th smallest value is above the quantile if less than l values are below it.
        let l = binomial.largest_with_less(outside);
        let u = binomial.smallest_with_more(outside);
        let low = l.checked_sub(1).map_or(f64::NEG_INFINITY, |place| sorted[place]);
        let high = sorted.get(u - 1).copied().unwrap_or(f64::INFINITY);
        let coverage = binomial.at_most(u.checked_sub(1)) - binomial.at_most(l.checked_sub(1));
        Ok(Self { p, value, low, high, coverage, runs: n })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dynamics_analysis::shared::RandomNumbers;

    /// 2,000 samples: the bounds enclose the true quantile as often as they say, within three standard
    /// deviations, and at least as often as was asked for.
    #[test]
    fn bounds_enclose_the_quantile_as_often_as_they_say() {
        let mut numbers = RandomNumbers(5);
        for (n, p, confidence) in [(20, 0.5, 0.95), (100, 0.9, 0.95), (400, 0.01, 0.8), (59, 0.95, 0.9)] {
            let (mut enclosed, mut says) = (0, 0.0);
            let samples = 2000;
            for _ in 0..samples {
                // The p-quantile of these is p².
                let values: Vec<f64> = (0..n).map(|_| numbers.within([0.0, 1.0]).powi(2)).collect();
                let found = Quantile::of(&values, p, confidence).unwrap();
                enclosed += usize::from(found.low <= p * p && p * p < found.high);
                says = found.coverage;
            }
            assert!(says >= confidence, "{n} {p}: {says}");
            let part = enclosed as f64 / f64::from(samples);
            let deviation = (says * (1.0 - says) / f64::from(samples)).sqrt();
            assert!((part - says).abs() < 3.0 * deviation + 1e-3, "{n} {p}: {part} of {says}");
        }
    }

    #[test]
    fn too_few_runs_have_no_bound() {
        let found = Quantile::of(&[1.0, 2.0, 3.0], 0.99, 0.95).unwrap();
        assert_eq!((found.high, found.runs), (f64::INFINITY, 3));
        assert!(found.value > 2.9 && found.coverage >= 0.95);
        let median = Quantile::of(&[4.0, 1.0, 2.0, 3.0], 0.5, 0.5).unwrap();
        assert_eq!(median.value, 2.5);
        let infinite = Quantile::of(&[1.0, f64::INFINITY, f64::INFINITY], 0.9, 0.5).unwrap();
        assert_eq!(infinite.value, f64::INFINITY);
    }

    #[test]
    fn probabilities_that_are_none_are_refused() {
        for p in [0.0, 1.0, -0.5, f64::NAN] {
            assert!(matches!(Quantile::of(&[1.0], p, 0.9), Err(EnsembleError::Probability { .. })), "{p}");
            assert!(matches!(Quantile::of(&[1.0], 0.5, p), Err(EnsembleError::Probability { .. })), "{p}");
        }
        assert!(matches!(Quantile::of(&[], 0.5, 0.9), Err(EnsembleError::TooFewRuns { .. })));
    }
}

//! The binomial distribution: how many of n independent runs lie below a quantile.

/// Terms below this part of the largest one are left out.
const NEGLIGIBLE: f64 = 1e-18;

/// Probabilities of k successes in n trials, around the most probable k.
pub(super) struct Binomial {
    /// The first k of the list.
    first: usize,
    /// The probability of less than or exactly k successes, for each k of the list.
    cumulated: Vec<f64>,
}

impl Binomial {
    /// Of n trials that succeed with probability p.
    pub(super) fn new(n: usize, p: f64) -> Self {
        let mode = (((n + 1) as f64 * p) as usize).min(n);
        // Relative to the most probable term: products of ratios of neighbours, so that no term overflows.
        let down = |k: usize| k as f64 / (n - k + 1) as f64 * ((1.0 - p) / p);
        let up = |k: usize| (n - k) as f64 / (k + 1) as f64 * (p / (1.0 - p));
        let (mut below, mut term) = (Vec::new(), 1.0);
        for k in (1..=mode).rev() {
            term *= down(k);
            if term < NEGLIGIBLE {
                break;
            }
            below.push(term);
        }
        let first = mode - below.len();
        let mut terms: Vec<f64> = below.into_iter().rev().collect();
        terms.push(1.0);
        term = 1.0;
        for k in mode..n {
            term *= up(k);
            if term < NEGLIGIBLE {
                break;
            }
            terms.push(term);
        }
        let total: f64 = terms.iter().sum();
        let mut sum = 0.0;
        let cumulated = terms.iter().map(|term| {
            sum += term / total;
            sum
        });
        Self { first, cumulated: cumulated.collect() }
    }

    /// The probability of at most k successes; 0 for less than none.
    pub(super) fn at_most(&self, k: Option<usize>) -> f64 {
        match k.and_then(|k| k.checked_sub(self.first)) {
            Some(place) => self.cumulated.get(place).copied().unwrap_or(1.0).min(1.0),
            None => 0.0,
        }
    }

    /// The largest k so that less than k successes have at most this probability.
    pub(super) fn largest_with_less(&self, probability: f64) -> usize {
        self.first + self.cumulated.iter().take_while(|sum| **sum <= probability).count()
    }

    /// The smallest k so that k or more successes have at most this probability.
    pub(super) fn smallest_with_more(&self, probability: f64) -> usize {
        let enough = |sum: &&f64| 1.0 - **sum > probability;
        self.first + self.cumulated.iter().take_while(enough).count() + 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against sums of products, term by term.
    #[test]
    fn sums_are_those_of_the_terms() {
        for (n, p) in [(1, 0.5), (10, 0.3), (20, 0.95), (30, 0.01)] {
            let binomial = Binomial::new(n, p);
            let term = |k: usize| {
                let chosen: f64 = (0..k).map(|i| (n - i) as f64 / (k - i) as f64).product();
                chosen * f64::powi(p, k as i32) * f64::powi(1.0 - p, (n - k) as i32)
            };
            let mut sum = 0.0;
            assert_eq!(binomial.at_most(None), 0.0);
            for k in 0..=n {
                sum += term(k);
                assert!((binomial.at_most(Some(k)) - sum).abs() < 1e-14, "{n} {p} {k}");
            }
        }
    }

    #[test]
    fn large_numbers_approach_the_normal_distribution() {
        let (n, p) = (10_000_000, 0.2);
        let binomial = Binomial::new(n, p);
        let deviation = (n as f64 * p * (1.0 - p)).sqrt();
        for x in [-2.0, -0.5, 0.0, 1.0, 3.0] {
            let k = (n as f64 * p + x * deviation) as usize;
            let at = (k as f64 + 0.5 - n as f64 * p) / deviation;
            let normal = 0.5 * libm::erfc(-at / std::f64::consts::SQRT_2);
            assert!((binomial.at_most(Some(k)) - normal).abs() < 1e-4, "{x}");
        }
    }
}

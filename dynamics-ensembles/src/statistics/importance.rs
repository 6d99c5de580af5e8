//! Sobol indices: which part of the variance of a number is due to each input (I. M. Sobol', 1993).
//!
//! S_i = V(E(f | x_i)) / V(f), the part of the input alone, and T_i = E(V(f | all but x_i)) / V(f), the part
//! of the input with all others. From the runs f_A, f_B, f_i of each group (A. Saltelli et al., 2010; M. J.
//! W. Jansen, 1999):
//!
//!   S_i V = mean f_B (f_i − f_A),   T_i V = ½ mean (f_A − f_i)².
//!
//! V is the variance over all runs. Intervals are those of a bootstrap over groups.

use dynamics_analysis::shared::RandomNumbers;

use super::{CONFIDENCE, check_count};
use crate::error::EnsembleError;

/// Samples of the bootstrap: the ends of 95 % intervals are then its 25th values from both ends.
const BOOTSTRAP_SAMPLES: usize = 1000;
/// Fewest samples in which the number varies: without more of them the ends of intervals would be another
/// part.
const LEAST_SAMPLES: usize = 990;
/// Fewest groups: an interval from fewer means nothing.
const MIN_GROUPS: usize = 16;
/// A variance below this part of the squared mean is rounding.
const CONSTANT: f64 = 1e-24;

/// The importance of all inputs for one number.
#[derive(Clone, Debug, PartialEq)]
pub struct Importance {
    /// The number.
    pub of: String,
    /// For each input, in the order of the columns.
    pub inputs: Vec<ImportanceOfInput>,
    /// The variance of the number.
    pub variance: f64,
    /// Groups of runs without failure.
    pub groups: usize,
    /// Groups that were left out because one of their runs failed.
    pub left_out: usize,
}

/// The parts of the variance that are due to an input, with 95 % intervals.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportanceOfInput {
    /// The input.
    pub input: String,
    /// The part of the input alone, S.
    pub first_order: f64,
    /// Its interval.
    pub first_order_interval: [f64; 2],
    /// The part of the input together with all others, T.
    pub total: f64,
    /// Its interval.
    pub total_interval: [f64; 2],
}

impl std::fmt::Display for Importance {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(f, "importance for {} (variance {:.4e}, {} groups)", self.of, self.variance, self.groups)?;
        let width = self.inputs.iter().map(|input| input.input.chars().count()).max().unwrap_or(0).max(5);
        writeln!(f, "{:width$}   alone  95 % interval     with others  95 % interval", "input")?;
        for input in &self.inputs {
            let ([a, b], [c, d]) = (input.first_order_interval, input.total_interval);
            let (name, first, total) = (&input.input, input.first_order, input.total);
            writeln!(
                f,
                "{name:width$}  {first:6.3}  {a:6.3} to {b:6.3}       {total:6.3}  {c:6.3} to {d:6.3}"
            )?;
        }
        if self.left_out > 0 {
            writeln!(f, "{} groups were left out: one of their runs failed", self.left_out)?;
        }
        Ok(())
    }
}

impl Importance {
    /// Of groups f_A, f_B, f_1, …, f_d, one after the other; NaN where a run failed.
    pub(crate) fn of_groups(of: &str, inputs: &[String], values: &[f64]) -> Result<Self, EnsembleError> {
        let length = inputs.len() + 2;
        let all = values.chunks_exact(length);
        let total = all.len();
        let groups: Vec<&[f64]> = all.filter(|group| group.iter().all(|x| x.is_finite())).collect();
        check_count("the importance of inputs", MIN_GROUPS * length, groups.len() * length)?;
        // The mean is taken off: the estimates do not depend on it, and their scatter does.
        let mean = groups.iter().flat_map(|group| *group).sum::<f64>() / (length * groups.len()) as f64;
        let centred: Vec<Vec<f64>> =
            groups.iter().map(|group| group.iter().map(|x| x - mean).collect()).collect();
        let every: Vec<usize> = (0..groups.len()).collect();
        let variance = Sums::of(&centred, &every).variance;
        let varies = variance > CONSTANT * mean * mean;
        if !varies {
            return Err(EnsembleError::Constant { column: of.into() });
        }
        let found = Sums::of(&centred, &every);
        let mut numbers = RandomNumbers(0);
        let mut samples = Vec::with_capacity(BOOTSTRAP_SAMPLES);
        let mut drawn = every.clone();
        for _ in 0..BOOTSTRAP_SAMPLES {
            drawn.iter_mut().for_each(|group| *group = numbers.below(groups.len()));
            samples.push(Sums::of(&centred, &drawn));
        }
        // Where the number varies in a few groups only some samples have none of them, and no parts of a
        // variance.
        samples.retain(|sums| sums.variance > CONSTANT * mean * mean && sums.is_finite());
        if samples.len() < LEAST_SAMPLES {
            return Err(EnsembleError::NearlyConstant { column: of.into() });
        }
        let one = |(i, input): (usize, &String)| ImportanceOfInput {
            input: input.clone(),
            first_order: found.first[i],
            first_order_interval: interval(samples.iter().map(|sums| sums.first[i])),
            total: found.total[i],
            total_interval: interval(samples.iter().map(|sums| sums.total[i])),
        };
        let inputs = inputs.iter().enumerate().map(one).collect();
        Ok(Self { of: of.into(), inputs, variance, groups: groups.len(), left_out: total - groups.len() })
    }
}

/// Estimates from some groups.
struct Sums {
    variance: f64,
    first: Vec<f64>,
    total: Vec<f64>,
}

impl Sums {
    fn is_finite(&self) -> bool {
        self.first.iter().chain(&self.total).all(|part| part.is_finite())
    }

    fn of(groups: &[Vec<f64>], drawn: &[usize]) -> Self {
        let inputs = groups[0].len() - 2;
        let (mut first, mut total) = (vec![0.0; inputs], vec![0.0; inputs]);
        let (mut sum, mut squares) = (0.0, 0.0);
        for group in drawn.iter().map(|k| &groups[*k]) {
            let (a, b) = (group[0], group[1]);
            sum += group.iter().sum::<f64>();
            squares += group.iter().map(|x| x * x).sum::<f64>();
            for (i, mixed) in group[2..].iter().enumerate() {
                first[i] += b * (mixed - a);
                total[i] += 0.5 * (a - mixed).powi(2);
            }
        }
        let n = drawn.len() as f64;
        // All samples have one distribution. With those of A and B alone a few large values elsewhere give
        // parts far above 1.
        let all = n * groups[0].len() as f64;
        let variance = squares / all - (sum / all).powi(2);
        let part = |sums: Vec<f64>| sums.into_iter().map(|sum| sum / n / variance).collect();
        Self { variance, first: part(first), total: part(total) }
    }
}

/// The middle 95 % of values.
fn interval(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let outside = (0.5 * (1.0 - CONFIDENCE) * sorted.len() as f64) as usize;
    [sorted[outside], sorted[sorted.len() - 1 - outside]]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Groups of one input, of which some have numbers that vary.
    fn of(groups: usize, varying: usize) -> Result<Importance, EnsembleError> {
        let group = |k: usize| if k < varying { [k as f64, 1.0, 2.0 + k as f64] } else { [0.0; 3] };
        let values: Vec<f64> = (0..groups).flat_map(group).collect();
        Importance::of_groups("x", &["a".into()], &values)
    }

    #[test]
    fn intervals_are_numbers_or_refused() {
        assert!(matches!(of(16, 0), Err(EnsembleError::Constant { .. })));
        // Without the one group that varies a sample has no variance.
        let error = of(16, 1).unwrap_err();
        assert!(matches!(error, EnsembleError::NearlyConstant { .. }), "{error}");
        for varying in 5..16 {
            let found = of(16, varying).unwrap();
            let input = &found.inputs[0];
            let ends = input.first_order_interval.into_iter().chain(input.total_interval);
            assert!(ends.into_iter().all(f64::is_finite), "{varying} {found}");
        }
    }
}

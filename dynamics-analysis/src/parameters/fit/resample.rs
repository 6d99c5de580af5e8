//! Bootstrap: the scatter of the result if the measurement were repeated.

use alloc::string::{String, ToString};
use alloc::vec::Vec;

use dynamics_runtime::model::Parameters;
use dynamics_runtime::simulate::Simulate;
use nalgebra::{DMatrix, DVector};

use super::super::parallel::ordered;
use super::{Fit, FitError, FitProblem};
use crate::random_numbers::RandomNumbers;

/// Fits of data with resampled residuals.
#[derive(Clone, Debug, PartialEq)]
pub struct Resampled {
    /// The unknowns.
    pub names: Vec<String>,
    /// The values of each fit, or the reason of its failure, in the order of their seeds.
    pub samples: Vec<Result<Vec<f64>, String>>,
}

impl Resampled {
    fn good(&self) -> impl Iterator<Item = &Vec<f64>> {
        self.samples.iter().filter_map(|sample| sample.as_ref().ok())
    }

    /// How many fits failed.
    #[must_use]
    pub fn failures(&self) -> usize {
        self.samples.iter().filter(|sample| sample.is_err()).count()
    }

    /// The interval of an unknown that contains this part of the samples, with as many below as above (0.95
    /// for 95 %). `None` if the name is unknown, the part is not between 0 and 1, or there are no samples.
    #[must_use]
    pub fn interval(&self, name: &str, part: f64) -> Option<[f64; 2]> {
        let k = self.names.iter().position(|n| n == name)?;
        if !(0.0..=1.0).contains(&part) {
            return None;
        }
        let mut values: Vec<f64> = self.good().map(|sample| sample[k]).collect();
        values.sort_by(f64::total_cmp);
        let last = values.len().checked_sub(1)?;
        let at = |p: f64| {
            let place = p * last as f64;
            let (below, share) = (place.floor() as usize, place.fract());
            values[below] + share * (values[(below + 1).min(last)] - values[below])
        };
        Some([at(0.5 - 0.5 * part), at(0.5 + 0.5 * part)])
    }

    /// The covariance of the samples; `None` of fewer than two.
    #[must_use]
    pub fn covariance(&self) -> Option<DMatrix<f64>> {
        let (count, n) = (self.good().count(), self.names.len());
        if count < 2 {
            return None;
        }
        let mut mean = DVector::zeros(n);
        self.good().for_each(|sample| mean += DVector::from_column_slice(sample));
        mean /= count as f64;
        let mut found = DMatrix::zeros(n, n);
        for sample in self.good() {
            let off = DVector::from_column_slice(sample) - &mean;
            found += &off * off.transpose();
        }
        Some(found / (count - 1) as f64)
    }
}

/// Fits `count` data sets with resampled residuals. Each has its own random numbers, so the result does not
/// depend on the number of threads.
pub(super) fn resample<M: Simulate + Parameters + Clone + Sync>(
    problem: &FitProblem<'_, M>,
    fit: &Fit,
    count: usize,
    seed: u64,
) -> Result<Resampled, FitError> {
    let at = DVector::from_iterator(fit.found.len(), fit.found.iter().map(|fitted| fitted.value));
    // Residuals of a fit are smaller than the noise, by √(degrees of freedom/data). They are scaled and
    // centred.
    let noise_factor = {
        let total: usize = fit.residuals.iter().map(|r| r.points.len()).sum();
        (total as f64 / fit.freedom.max(1) as f64).sqrt()
    };
    let one = |index: usize| {
        let mut numbers = RandomNumbers(seed ^ (index as u64).wrapping_mul(RandomNumbers::STATE_INCREMENT));
        let mut residuals = fit.residuals.iter();
        let drawn = problem.experiments.iter().map(|experiment| {
            let mut series = experiment.series.clone();
            for (series, left) in series.iter_mut().zip(residuals.by_ref()) {
                let mean = left.points.iter().map(|(_, r)| r).sum::<f64>() / left.points.len() as f64;
                for (point, (_, residual)) in series.points.iter_mut().zip(&left.points) {
                    let drawn = left.points[numbers.below(left.points.len())].1;
                    point.1 += residual - noise_factor * (drawn - mean);
                }
            }
            experiment.with(series)
        });
        let again = FitProblem {
            experiments: drawn.collect(),
            unknowns: problem.unknowns.clone(),
            tolerance: problem.tolerance,
            max_iterations: problem.max_iterations,
            absolute: problem.absolute,
            loss: problem.loss,
        };
        let found = again.solve_from(&at).map_err(|error| error.to_string())?;
        Ok(found.found.iter().map(|fitted| fitted.value).collect())
    };
    let samples = ordered(count, None, false, one).map_err(FitError::Threads)?;
    Ok(Resampled { names: fit.found.iter().map(|fitted| fitted.name.clone()).collect(), samples })
}

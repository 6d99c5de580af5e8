//! Results of fits.

use alloc::string::String;
use alloc::vec::Vec;

use nalgebra::DMatrix;

use super::robust::{self, Loss};

/// One unknown that was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    /// Its name.
    pub name: String,
    /// Its unit, `""` where it is 1 or not known.
    pub unit: String,
    /// The value.
    pub value: f64,
    /// Its standard error; `None` on a bound, where the error is not defined.
    pub standard_error: Option<f64>,
}

/// Residuals of one quantity, model less measured, in its unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Residuals {
    /// The quantity.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// (t, model − measured), in the order in which the data were given.
    pub points: Vec<(f64, f64)>,
    /// The weight of each residual, at most 1; all are 1 in least squares.
    pub weights: Vec<f64>,
    /// Their root mean square.
    pub rms: f64,
    /// How much of the scatter of the data the model explains: 1 − Σ residual² / Σ (y − ȳ)²; NaN of data that
    /// do not scatter.
    pub explained: f64,
    /// Correlation of residuals that are neighbours in time. It is near 0 for pure noise; effects that the
    /// model lacks correlate neighbours. Within ±2/√(data) it is not significant.
    pub neighbours: f64,
}

/// A datum that alone makes more than half of Σ residual² of its quantity, if there are ten data or more: an
/// outlier, or an effect that the model lacks.
#[derive(Clone, Debug, PartialEq)]
pub struct Outlier {
    /// The quantity.
    pub quantity: String,
    /// Its unit.
    pub unit: String,
    /// The row, from 0.
    pub row: usize,
    /// Its time.
    pub time: f64,
    /// Model less measured.
    pub residual: f64,
    /// How many times the median of the other residuals that is; infinite where they are 0.
    pub times: f64,
    /// The part of Σ residual² that it makes.
    pub part: f64,
}

/// Fewest data of a quantity that can have an outlier. With fewer, one residual may be half of the sum of
/// squares by chance.
const MIN_DATA_FOR_OUTLIERS: usize = 10;
/// Least part of the sum of squares that an outlier makes. The datum then counts for more than all others
/// together.
const MIN_OUTLIER_SHARE: f64 = 0.5;

impl Outlier {
    /// The first outlier, and the index of its quantity.
    pub(super) fn among(residuals: &[Residuals]) -> Option<(usize, Self)> {
        residuals.iter().enumerate().find_map(|(index, left)| {
            let mut others: Vec<f64> = left.points.iter().map(|(_, r)| r.abs()).collect();
            let row = (0..others.len()).max_by(|a, b| others[*a].total_cmp(&others[*b]))?;
            let part = others[row].powi(2) / others.iter().map(|r| r * r).sum::<f64>();
            let largest = others.swap_remove(row);
            let times = largest / robust::median(&mut others);
            let (quantity, unit, (time, residual)) = (left.name.clone(), left.unit.clone(), left.points[row]);
            (left.points.len() >= MIN_DATA_FOR_OUTLIERS && part > MIN_OUTLIER_SHARE)
                .then_some((index, Self { quantity, unit, row, time, residual, times, part }))
        })
    }
}

/// The values that come nearest to the data.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// The unknowns, as they were asked for.
    pub found: Vec<Fitted>,
    /// Covariance of those that lie on no bound, in their order; rows and columns of the others are 0. In the
    /// products of the units.
    pub covariance: DMatrix<f64>,
    /// Correlations, between −1 and 1; likewise.
    pub correlation: DMatrix<f64>,
    /// Σ w (residual/σ)², σ = 1 where none was given, and the weights w all 1 in least squares.
    pub chi_squared: f64,
    /// The loss function.
    pub loss: Loss,
    /// The scale of the noise that the loss used, in σ: 1 in least squares and where σ was given, else from
    /// the median of the residuals.
    pub scale: f64,
    /// Data less unknowns that lie on no bound.
    pub freedom: usize,
    /// Whether the noise was given: the covariance is then not scaled by the residuals.
    pub absolute: bool,
    /// The number of unknowns that the data identify: all of them, otherwise there is no fit.
    pub rank: usize,
    /// The smallest pivot of the normalised columns of the Jacobian: 1 if the unknowns are independent, 1e-6
    /// if they can no longer be distinguished.
    pub independence: f64,
    /// The residuals, by quantity.
    pub residuals: Vec<Residuals>,
    /// Iterations made.
    pub iterations: usize,
}

impl Fit {
    /// One of the unknowns, by name.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&Fitted> {
        self.found.iter().find(|fitted| fitted.name == name)
    }

    /// The datum that alone makes more than half of the sum of squares of its quantity.
    #[must_use]
    pub fn outlier(&self) -> Option<Outlier> {
        Outlier::among(&self.residuals).map(|(_, outlier)| outlier)
    }

    /// χ² per degree of freedom: near 1 where model and given noise are right; `None` where no freedom is
    /// left.
    #[must_use]
    pub fn reduced_chi_squared(&self) -> Option<f64> {
        (self.freedom > 0).then(|| self.chi_squared / self.freedom as f64)
    }
}

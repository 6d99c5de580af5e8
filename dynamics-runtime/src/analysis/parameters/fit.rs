//! Parameters and starts from measured motion: least squares with exact derivatives.
//!
//! The sum of squares χ² = Σ ((yᵢ − f(tᵢ; p))/σᵢ)² is made smallest by the method of Levenberg and Marquardt (`levenberg.rs`), its Jacobian from the variational
//! equations ([`Sensitivity`](super::Sensitivity)), within bounds. At the minimum the covariance of what was found is s² (JᵀJ)⁻¹, J weighted by 1/σ, with s² = 1 where the σ of the noise are
//! given and χ²/(data − parameters) where they are not (Y. Bard, *Nonlinear Parameter Estimation*, 1974, §§5-7, 7-5; W. H. Press et al., *Numerical Recipes*, §15.4–15.6).
//!
//! What the data cannot tell apart has no minimum but a valley: columns of J that depend on each other are found by elimination with column pivoting, and the fit is an error that names them.

mod data;
mod error;
mod levenberg;
mod resample;
mod result;
mod show;

use alloc::borrow::ToOwned;
use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec::Vec;

use nalgebra::{DMatrix, DVector};

use data::{Given, Series};
pub use error::FitError;
use levenberg::{Levenberg, Outcome};
pub use resample::Resampled;
pub use result::{Fit, Fitted, Residuals};

use super::sensitivity::{Asked, Options, SensitivityError};
use super::variable::{Variable, VariableError};
use crate::model::{ModelState, Parameters, Vector as _};
use crate::motion::{Simulate, Simulation};

/// Columns of J, free of their sizes, whose pivot is below this part of the largest cannot be told apart: the error of derivatives lies near 1e-8.
const RANK: f64 = 1e-6;
/// Tolerance of motions where none is given: noise is never as small.
const TOLERANCE: f64 = 1e-9;
/// Measured motions may be smaller than others by this part for their tolerance to follow.
const SPAN: f64 = 1e-6;
/// Errors of motions, in tolerances: what is gained below the square of them is gained by chance.
const BLUR: f64 = 10.0;

/// What is to be found.
#[derive(Clone, Debug)]
pub(super) struct Unknown {
    pub(super) name: String,
    pub(super) variable: Variable,
    pub(super) bounds: [f64; 2],
    /// Where it begins.
    pub(super) first: f64,
}

/// A fit with its options, before it runs.
///
/// ```text
/// let fit = model
///     .fit(start)
///     .find(["damping", "x"])                              // a parameter, and a coordinate of the start
///     .find_within("stiffness", [1e3, 1e6])
///     .data("travel", measured)                            // (t, value) of an output, a coordinate or a velocity
///     .run()?;
/// println!("{fit}");                                       // values ± standard errors with units, correlations, residuals
/// ```
#[must_use = "a fit does nothing until `.run()`"]
pub struct Fitting<'m, M: Simulate> {
    model: &'m M,
    start: M::State,
    asked: Vec<(String, [f64; 2])>,
    data: Vec<Given>,
    tolerance: Option<f64>,
    options: Option<Options<'m, M>>,
    most: usize,
}

/// A fit that was checked.
pub(super) struct Problem<'a, M: Simulate> {
    pub(super) model: &'a M,
    pub(super) start: M::State,
    pub(super) unknowns: Vec<Unknown>,
    pub(super) series: Vec<Series>,
    pub(super) end: f64,
    pub(super) tolerance: f64,
    /// The tolerance of what is near zero, where it is another.
    pub(super) small: Option<f64>,
    pub(super) options: Option<&'a Options<'a, M>>,
    pub(super) most: usize,
    /// Whether the noise was given.
    pub(super) absolute: bool,
}

impl<'m, M: Simulate + Parameters + Clone> Fitting<'m, M> {
    pub(super) fn new(model: &'m M, start: M::State) -> Self {
        let (asked, data) = (Vec::new(), Vec::new());
        Self { model, start, asked, data, tolerance: None, options: None, most: 200 }
    }

    /// Parameters, coordinates and velocities of the start that are to be found; they begin with the values of the model and the start that the fit was opened with.
    pub fn find<S: AsRef<str>>(mut self, names: impl IntoIterator<Item = S>) -> Self {
        let anywhere = [f64::NEG_INFINITY, f64::INFINITY];
        self.asked.extend(names.into_iter().map(|name| (name.as_ref().to_owned(), anywhere)));
        self
    }

    /// One that is to be found within bounds, both included.
    pub fn find_within(mut self, name: &str, bounds: [f64; 2]) -> Self {
        self.asked.push((name.to_owned(), bounds));
        self
    }

    /// Measured values of an output, a coordinate or a velocity: (t, value), in the unit of the quantity. Times may come in any order and several times.
    ///
    /// All data without a σ of their own count as equally noisy, each in its unit: give σ by [`Fitting::data_with`] where quantities differ.
    pub fn data(mut self, name: &str, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        self.data.push(Given { name: name.to_owned(), points: points.into_iter().collect(), sigma: None });
        self
    }

    /// As [`Fitting::data`], with the standard deviation of the noise, in the unit of the quantity.
    pub fn data_with(mut self, name: &str, sigma: f64, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        self.data.push(Given { name: name.to_owned(), points: points.into_iter().collect(), sigma: Some(sigma) });
        self
    }

    /// Tolerance of the motions, absolute and relative alike. Without it 1e-9, absolute of measured coordinates and velocities that are smaller than 1 by their size: errors
    /// of motions are not in the standard errors. Where only outputs are measured, of a motion much smaller than its units, it is to be set.
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.tolerance = Some(tolerance);
        self
    }

    /// Options of all simulations: a method, the law of inputs of the experiment.
    pub fn with(mut self, options: impl Fn(Simulation<'_, M>) -> Simulation<'_, M> + Send + Sync + 'm) -> Self {
        self.options = Some(Box::new(options));
        self
    }

    /// Most iterations, 200 unless set.
    pub fn iterations(mut self, most: usize) -> Self {
        self.most = most;
        self
    }

    /// Finds them.
    ///
    /// # Errors
    /// Names and data that make no sense; fewer data than unknowns; motions that fail at the start of the search; unknowns that the data cannot tell apart; iterations that do not settle. What was
    /// found up to there is in the error.
    pub fn run(&self) -> Result<Fit, FitError> {
        self.problem()?.solve()
    }

    /// Finds them, and how they would scatter if the measurement were repeated: by so many fits of data whose residuals are drawn anew, with replacement, from those that
    /// the fit left of the same quantity (B. Efron & R. J. Tibshirani, *An Introduction to the Bootstrap*, §9.4). On all cores with the feature `parallel`; the same numbers for the same seed, however many those are.
    ///
    /// # Errors
    /// As [`Fitting::run`].
    pub fn resample(&self, count: usize, seed: u64) -> Result<(Fit, Resampled), FitError>
    where
        M: Sync,
    {
        let problem = self.problem()?;
        let fit = problem.solve()?;
        let resampled = resample::resample(&problem, &fit, count, seed)?;
        Ok((fit, resampled))
    }

    fn problem(&self) -> Result<Problem<'_, M>, FitError> {
        let mut unknowns: Vec<Unknown> = Vec::new();
        for (name, bounds) in &self.asked {
            let variable = Variable::of::<M>(name)?;
            if unknowns.iter().any(|other| other.variable == variable) {
                return Err(VariableError::Twice { name: name.clone() }.into());
            }
            let first =
                variable.value(self.model, &self.start).ok_or_else(|| FitError::NotTold { name: name.clone() })?;
            if !first.is_finite() {
                return Err(VariableError::NotFinite { name: name.clone(), value: first }.into());
            }
            variable.check(self.model, &self.start, first)?;
            // Also false where a bound is not a number.
            if !(bounds[0] < bounds[1] && bounds[0] <= first && first <= bounds[1]) {
                return Err(FitError::Bounds { name: name.clone(), bounds: *bounds, first });
            }
            unknowns.push(Unknown { name: name.clone(), variable, bounds: *bounds, first });
        }
        if unknowns.is_empty() {
            return Err(FitError::NothingToFind);
        }
        let (series, end) = data::read::<M>(&self.data, self.start.t())?;
        let (count, needed) = (series.iter().map(|s| s.points.len()).sum::<usize>(), unknowns.len());
        let absolute = self.data.iter().all(|given| given.sigma.is_some());
        // Without the noise one more is needed to tell it.
        if count < needed + usize::from(!absolute) {
            return Err(FitError::TooFewData { data: count, unknowns: needed, noise: !absolute });
        }
        // No finer than rounding of what else moves lets it be.
        let largest =
            self.start.q().as_slice().iter().chain(self.start.u().as_slice()).fold(0.0, |m: f64, x| m.max(x.abs()));
        let size = data::least_size(&series).map(|size| size.max(SPAN * largest)).filter(|size| *size < 1.0);
        let small = if self.tolerance.is_none() { size.map(|size| TOLERANCE * size) } else { None };
        Ok(Problem {
            model: self.model,
            start: self.start,
            unknowns,
            series,
            end,
            tolerance: self.tolerance.unwrap_or(TOLERANCE),
            small,
            options: self.options.as_ref(),
            most: self.most,
            absolute,
        })
    }
}

impl<M: Simulate + Parameters + Clone> Problem<'_, M> {
    /// The model and the start with these values.
    fn with(&self, values: &DVector<f64>) -> (M, M::State) {
        let (mut model, mut start) = (self.model.clone(), self.start);
        for (unknown, value) in self.unknowns.iter().zip(values.iter()) {
            unknown.variable.set(&mut model, &mut start, *value);
        }
        (model, start)
    }

    /// Residuals (f − y)/σ, and their Jacobian where it is asked for.
    pub(super) fn evaluate(
        &self,
        values: &DVector<f64>,
        jacobian: bool,
    ) -> Result<(DVector<f64>, Option<DMatrix<f64>>), SensitivityError> {
        let (model, start) = self.with(values);
        let variables: Vec<Variable> = self.unknowns.iter().map(|unknown| unknown.variable).collect();
        let mut times: Vec<f64> = self.series.iter().flat_map(|s| &s.points).map(|(t, _)| *t).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        let (tolerance, absolute) = (self.tolerance, self.small);
        let asked = Asked { variables: &variables, end: self.end, tolerance, absolute, times: Some(&times) };
        let options = self.options.map(|options| options as &dyn Fn(_) -> _);
        if jacobian {
            let found = asked.run(&model, start, options)?;
            let by = data::jacobian(&self.series, &found)?;
            return Ok((data::residuals(&self.series, &found.motion)?, Some(by)));
        }
        Ok((data::residuals(&self.series, &asked.motion(&model, start, options)?)?, None))
    }

    /// Root of the sum of squares of the modelled values, each by its σ.
    pub(super) fn modelled(&self, residuals: &DVector<f64>) -> f64 {
        let measured = self.series.iter().flat_map(|s| s.points.iter().map(|(_, y)| y / s.sigma));
        residuals.iter().zip(measured).map(|(r, y)| (r + y).powi(2)).sum::<f64>().sqrt()
    }

    pub(super) fn solve(&self) -> Result<Fit, FitError> {
        let first = DVector::from_iterator(self.unknowns.len(), self.unknowns.iter().map(|unknown| unknown.first));
        self.solve_from(&first)
    }

    pub(super) fn solve_from(&self, first: &DVector<f64>) -> Result<Fit, FitError> {
        let bounds: Vec<[f64; 2]> = self.unknowns.iter().map(|unknown| unknown.bounds).collect();
        let measured: f64 = self.series.iter().flat_map(|s| s.points.iter().map(|(_, y)| (y / s.sigma).powi(2))).sum();
        let search = Levenberg { bounds: &bounds, most: self.most, blur: measured * (BLUR * self.tolerance).powi(2) };
        let Outcome { at, residuals, jacobian, iterations, settled } =
            search.minimize(first, |values, jacobian| self.evaluate(values, jacobian))?;
        let fit = Fit::of(self, &at, residuals, &jacobian, iterations)?;
        if settled { Ok(fit) } else { Err(FitError::NotSettled { iterations, so_far: Box::new(fit) }) }
    }
}

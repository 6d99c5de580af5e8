//! Parameters and starts from measured motion: least squares with exact derivatives.
//!
//! The sum of squares χ² = Σ ((yᵢ − f(tᵢ; p))/σᵢ)² is minimised within bounds by the method of Levenberg and
//! Marquardt (`levenberg.rs`). Its Jacobian comes from the variational equations
//! ([`Sensitivity`](super::Sensitivity)). At the minimum the covariance of the unknowns is s² (JᵀJ)⁻¹, J
//! weighted by 1/σ, with s² = 1 where the σ of the noise are given and χ²/(data − parameters) where they are
//! not (Y. Bard, *Nonlinear Parameter Estimation*, 1974, §§5-7, 7-5; W. H. Press et al., *Numerical Recipes*,
//! §15.4–15.6).
//!
//! Unknowns that the data cannot identify have a valley instead of a minimum. Dependent columns of J are
//! found by elimination with column pivoting, and the fit returns an error that names the unknowns.

mod data;
mod error;
mod experiment;
mod levenberg;
mod resample;
mod result;
mod robust;
mod show;
mod statistics;

use alloc::borrow::ToOwned;
use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec::Vec;

use dynamics_runtime::model::Parameters;
use dynamics_runtime::simulate::{Simulate, Simulation};
use nalgebra::{DMatrix, DVector};

use data::{Given, Series, named};
pub use error::FitError;
use experiment::{Experiment, ExperimentSetup};
use levenberg::{Levenberg, Outcome};
pub use resample::Resampled;
pub use result::{Fit, Fitted, Outlier, Residuals};
use robust::FitWeights;
pub use robust::Loss;

use super::sensitivity_error::SensitivityError;
use super::variable::{Variable, VariableError};

/// Least pivot of the normalised columns of J, at which unknowns can be identified. It lies above the error
/// of the derivatives, near 1e-8.
const RANK_TOLERANCE_OF_JACOBIAN: f64 = 1e-6;
/// Default tolerance of motions, far below the noise of measurements.
const DEFAULT_TOLERANCE: f64 = 1e-9;
/// Least size of measured coordinates, relative to the largest of the start, as the scale of the absolute
/// tolerance. Rounding of the larger ones forbids a finer tolerance.
const MIN_RELATIVE_SIZE: f64 = 1e-6;
/// Largest standard error of a found unknown, relative to its value and its first value. Data that hardly
/// determine an unknown leave an error of some times its value; after an outlier drew it away, the error is
/// 1e9 times and more.
const MAX_RELATIVE_STANDARD_ERROR: f64 = 1e3;
/// Errors of motions, in tolerances. A decrease of χ² below the square of them is only such errors. A
/// smaller value lets searches end with an error although they converged; a larger one ends them early.
const MOTION_ERROR_IN_TOLERANCES: f64 = 10.0;
/// Default limit on iterations.
const DEFAULT_MAX_ITERATIONS: usize = 200;

/// An unknown of the fit.
#[derive(Clone, Debug)]
pub(super) struct Unknown {
    pub(super) name: String,
    pub(super) variable: Variable,
    /// The index of the experiment to whose start it belongs; for a parameter, the one in which it was named.
    pub(super) experiment: usize,
    pub(super) bounds: [f64; 2],
    /// Its first value.
    pub(super) first: f64,
}

/// A fit with its options, before it runs.
///
/// ```text
/// let fit = model
///     .fit(start)
///     .find(["damping", "x"])               // a parameter, and a coordinate of the start
///     .find_within("stiffness", [1e3, 1e6])
///     .data("travel", measured)             // (t, value) of an output, a coordinate or a velocity
///     .experiment(other_start).find(["x"])  // another run of the same model, with a start of its own
///     .data("travel", measured_there)
///     .run()?;
/// println!("{fit}");                        // values ± standard errors with units, correlations, residuals
/// ```
#[must_use = "a fit does nothing until `.run()`"]
pub struct Fitting<'m, M: Simulate> {
    model: &'m M,
    /// All experiments but the last.
    earlier: Vec<ExperimentSetup<'m, M>>,
    /// The experiment to which data, options and unknowns are added.
    current: ExperimentSetup<'m, M>,
    tolerance: Option<f64>,
    max_iterations: usize,
    loss: Loss,
}

/// A fit whose options were checked.
pub(super) struct FitProblem<'a, M: Simulate> {
    pub(super) experiments: Vec<Experiment<'a, M>>,
    pub(super) unknowns: Vec<Unknown>,
    pub(super) tolerance: f64,
    pub(super) max_iterations: usize,
    /// Whether the noise was given.
    pub(super) absolute: bool,
    pub(super) loss: Loss,
}

impl<'m, M: Simulate + Parameters + Clone> Fitting<'m, M> {
    pub(super) fn new(model: &'m M, start: M::State) -> Self {
        Self {
            model,
            earlier: Vec::new(),
            current: ExperimentSetup::new(start),
            tolerance: None,
            max_iterations: DEFAULT_MAX_ITERATIONS,
            loss: Loss::Squares,
        }
    }

    /// The unknowns: parameters, coordinates and velocities of the start. Their first values are those of the
    /// given model and start.
    pub fn find<S: AsRef<str>>(mut self, names: impl IntoIterator<Item = S>) -> Self {
        let anywhere = [f64::NEG_INFINITY, f64::INFINITY];
        self.current.unknowns.extend(names.into_iter().map(|name| (name.as_ref().to_owned(), anywhere)));
        self
    }

    /// An unknown within bounds, both included.
    pub fn find_within(mut self, name: &str, bounds: [f64; 2]) -> Self {
        self.current.unknowns.push((name.to_owned(), bounds));
        self
    }

    /// Measured values of an output, a coordinate or a velocity: (t, value), in the unit of the quantity.
    /// Times may come in any order and several times.
    ///
    /// All data without a σ of their own count as equally noisy, each in its unit: give σ by
    /// [`Fitting::data_with`] where quantities differ.
    pub fn data(mut self, name: &str, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        self.current.data.push(Given {
            name: name.to_owned(),
            points: points.into_iter().collect(),
            sigma: None,
        });
        self
    }

    /// As [`Fitting::data`], with the standard deviation of the noise, in the unit of the quantity.
    pub fn data_with(mut self, name: &str, sigma: f64, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        self.current.data.push(Given {
            name: name.to_owned(),
            points: points.into_iter().collect(),
            sigma: Some(sigma),
        });
        self
    }

    /// Tolerance of the motions, absolute and relative alike. Without it 1e-9, absolute of measured
    /// coordinates and velocities that are smaller than 1 by their size: errors of motions are not in the
    /// standard errors. Where only outputs are measured, of a motion much smaller than its units, it is to be
    /// set.
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.tolerance = Some(tolerance);
        self
    }

    /// Opens another experiment with its own start. Data, options and unknown starts that follow belong to
    /// it. In the result their names have the suffix `(experiment 2)`. Unknown parameters are common to all
    /// experiments.
    pub fn experiment(mut self, start: M::State) -> Self {
        self.earlier.push(core::mem::replace(&mut self.current, ExperimentSetup::new(start)));
        self
    }

    /// A parameter whose known value in this experiment differs from that of the model, such as an added
    /// load. If it is an unknown of other experiments, it is not one here.
    pub fn known(mut self, name: &str, value: f64) -> Self {
        self.current.known.push((name.to_owned(), value));
        self
    }

    /// Options of all simulations of the experiment: a method, its law of inputs.
    pub fn with(
        mut self,
        options: impl Fn(Simulation<'_, M>) -> Simulation<'_, M> + Send + Sync + 'm,
    ) -> Self {
        self.current.options = Some(Box::new(options));
        self
    }

    /// The loss function: [`Loss::HUBER`] or [`Loss::CAUCHY`] for data with outliers, which would dominate
    /// least squares. The scale beyond which data count less is the σ of [`Fitting::data_with`]. If none is
    /// given, it comes from the median of the residuals. Standard errors come from the residuals in either
    /// case.
    pub fn loss(mut self, loss: Loss) -> Self {
        self.loss = loss;
        self
    }

    /// Most iterations, 200 unless set.
    pub fn iterations(mut self, most: usize) -> Self {
        self.max_iterations = most;
        self
    }

    /// Finds them.
    ///
    /// # Errors
    /// Invalid names or data; fewer data than unknowns; motions that fail at the start of the search;
    /// unknowns that the data cannot identify, or that diverged; iterations that do not converge. The error
    /// contains what was found up to there.
    pub fn run(self) -> Result<Fit, FitError> {
        self.problem()?.solve()
    }

    /// Finds the unknowns, and their scatter if the measurement were repeated. For this it fits many data
    /// sets, whose residuals are drawn, with replacement, from those of the same quantity in the first fit
    /// (B. Efron & R. J. Tibshirani, *An Introduction to the Bootstrap*, §9.4). On all cores with the feature
    /// `parallel`; the same numbers for the same seed, however many those are.
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

    fn problem(&self) -> Result<FitProblem<'_, M>, FitError> {
        let setups: Vec<&ExperimentSetup<'m, M>> = self.earlier.iter().chain([&self.current]).collect();
        let unknowns = self.unknowns(&setups)?;
        let own_tolerance = self.tolerance.is_some();
        let experiments =
            setups.iter().enumerate().map(|(k, setup)| Experiment::of(self.model, setup, k, own_tolerance));
        let experiments = experiments.collect::<Result<Vec<_>, _>>()?;
        let absolute = data::all_or_none(setups.iter().flat_map(|setup| &setup.data))?;
        let (count, needed) = (experiments.iter().map(Experiment::count).sum::<usize>(), unknowns.len());
        // If the noise is not given, it is one unknown more.
        if count < needed + usize::from(!absolute) {
            return Err(FitError::TooFewData { data: count, unknowns: needed, noise: !absolute });
        }
        if let Some(limit) = self.loss.limit().filter(|limit| !(*limit > 0.0 && limit.is_finite())) {
            return Err(FitError::Loss { limit });
        }
        let tolerance = self.tolerance.unwrap_or(DEFAULT_TOLERANCE);
        Ok(FitProblem {
            experiments,
            unknowns,
            tolerance,
            max_iterations: self.max_iterations,
            absolute,
            loss: self.loss,
        })
    }

    /// The unknowns of all experiments, each once.
    fn unknowns(&self, setups: &[&ExperimentSetup<'m, M>]) -> Result<Vec<Unknown>, FitError> {
        let mut unknowns: Vec<Unknown> = Vec::new();
        let named_unknowns = setups
            .iter()
            .enumerate()
            .flat_map(|(k, setup)| setup.unknowns.iter().map(move |unknown| (k, setup, unknown)));
        for (experiment, setup, (name, bounds)) in named_unknowns {
            let variable = Variable::of::<M>(name)?;
            let shared = matches!(variable, Variable::Parameter(_));
            let same =
                |other: &Unknown| other.variable == variable && (shared || other.experiment == experiment);
            if unknowns.iter().any(same) {
                return Err(VariableError::Twice { name: name.clone() }.into());
            }
            let first = variable
                .value(self.model, &setup.start)
                .ok_or_else(|| FitError::NoParameterValue { name: name.clone() })?;
            if !first.is_finite() {
                return Err(VariableError::NotFinite { name: name.clone(), value: first }.into());
            }
            variable.check(self.model, &setup.start, first)?;
            // The condition is also false if a bound is NaN.
            if !(bounds[0] < bounds[1] && bounds[0] <= first && first <= bounds[1]) {
                return Err(FitError::Bounds { name: name.clone(), bounds: *bounds, first });
            }
            let name = if shared { name.clone() } else { named(name, experiment) };
            unknowns.push(Unknown { name, variable, experiment, bounds: *bounds, first });
        }
        if unknowns.is_empty() { Err(FitError::NothingToFind) } else { Ok(unknowns) }
    }
}

impl<M: Simulate + Parameters + Clone> FitProblem<'_, M> {
    /// The measured series of all experiments.
    pub(super) fn series(&self) -> impl Iterator<Item = &Series> {
        self.experiments.iter().flat_map(|experiment| &experiment.series)
    }

    /// Residuals (f − y)/σ, and their Jacobian where it is asked for, experiment by experiment.
    pub(super) fn evaluate(
        &self,
        values: &DVector<f64>,
        jacobian: bool,
    ) -> Result<(DVector<f64>, Option<DMatrix<f64>>), SensitivityError> {
        let count = self.experiments.iter().map(Experiment::count).sum();
        let mut residuals = DVector::zeros(count);
        let mut all = DMatrix::zeros(if jacobian { count } else { 0 }, self.unknowns.len());
        let mut row = 0;
        for experiment in &self.experiments {
            let (own, by) = experiment.evaluate((&self.unknowns, values), self.tolerance, jacobian)?;
            residuals.rows_mut(row, own.len()).copy_from(&own);
            if jacobian {
                all.rows_mut(row, own.len()).copy_from(&by);
            }
            row += own.len();
        }
        Ok((residuals, jacobian.then_some(all)))
    }

    /// The norm of the modelled values, each divided by its σ.
    pub(super) fn modelled(&self, residuals: &DVector<f64>) -> f64 {
        let measured = self.series().flat_map(|s| s.points.iter().map(|(_, y)| y / s.sigma));
        residuals.iter().zip(measured).map(|(r, y)| (r + y).powi(2)).sum::<f64>().sqrt()
    }

    pub(super) fn solve(&self) -> Result<Fit, FitError> {
        let first =
            DVector::from_iterator(self.unknowns.len(), self.unknowns.iter().map(|unknown| unknown.first));
        self.solve_from(&first)
    }

    pub(super) fn solve_from(&self, first: &DVector<f64>) -> Result<Fit, FitError> {
        self.search_from(first).map_err(|error| self.explained(error, first))
    }

    /// Adds the cause to an error of the search: first values at which there is no motion, or an outlier.
    fn explained(&self, error: FitError, first: &DVector<f64>) -> FitError {
        use SensitivityError::{Motion, NotFinite, OutOfRange, Solve, StepTooSmall};
        let outlier = match &error {
            FitError::Motion(
                Motion(_) | NotFinite { .. } | OutOfRange { .. } | Solve { .. } | StepTooSmall { .. },
            ) if self.evaluate(first, true).is_err() => {
                let values = self.unknowns.iter().zip(first).map(|(unknown, x)| (unknown.name.clone(), *x));
                let FitError::Motion(cause) = error else { return error };
                return FitError::FirstValues { values: values.collect(), cause: Box::new(cause) };
            }
            FitError::NotSettled { so_far, .. } | FitError::NothingFound { so_far, .. } => so_far.outlier(),
            _ => None,
        };
        match outlier.or_else(|| statistics::outlier_at(self, first)).filter(|_| self.loss == Loss::Squares) {
            Some(outlier) => FitError::Outlier { outlier: Box::new(outlier), cause: Box::new(error) },
            None => error,
        }
    }

    fn search_from(&self, first: &DVector<f64>) -> Result<Fit, FitError> {
        let bounds: Vec<[f64; 2]> = self.unknowns.iter().map(|unknown| unknown.bounds).collect();
        let values = self.series().flat_map(|s| s.points.iter().map(|(_, y)| y / s.sigma));
        let values = DVector::from_iterator(self.series().map(|s| s.points.len()).sum(), values);
        // The size of the measured values; with a robust loss the median, which outliers do not change.
        let measured = match self.loss {
            Loss::Squares => values.norm_squared(),
            _ => values.len() as f64 * robust::median_size(&values).powi(2),
        };
        let search = Levenberg {
            bounds: &bounds,
            max_iterations: self.max_iterations,
            least_gain: measured * (MOTION_ERROR_IN_TOLERANCES * self.tolerance).powi(2),
        };
        let evaluate = |values: &DVector<f64>, jacobian: bool| self.evaluate(values, jacobian);
        let (outcome, weighed) = match self.loss {
            Loss::Squares => {
                let outcome = search.minimize(first, evaluate)?;
                let count = outcome.residuals.len();
                (outcome, FitWeights::evenly(count))
            }
            loss => {
                // The noise is at least as large as the errors of the motions.
                let least =
                    MOTION_ERROR_IN_TOLERANCES * self.tolerance * (measured / values.len() as f64).sqrt();
                let scale = self.absolute.then_some(1.0);
                robust::minimize(&search, (loss, scale, least.max(f64::MIN_POSITIVE)), first, evaluate)?
            }
        };
        let Outcome { at, residuals, jacobian, iterations, settled } = outcome;
        let fit = Fit::of(self, &at, (residuals, weighed), &jacobian, iterations)?;
        if !settled {
            return Err(FitError::NotSettled { iterations, so_far: Box::new(fit) });
        }
        self.check_found(fit)
    }

    /// Checks that every unknown is finite and has a certain digit.
    fn check_found(&self, fit: Fit) -> Result<Fit, FitError> {
        let undetermined = fit.found.iter().zip(&self.unknowns).find(|(found, unknown)| {
            let size = found.value.abs().max(super::equations::size(unknown.first));
            let has_no_digit = |error: f64| error.is_nan() || error > MAX_RELATIVE_STANDARD_ERROR * size;
            !found.value.is_finite() || found.standard_error.is_some_and(has_no_digit)
        });
        match undetermined.map(|(found, unknown)| (found.name.clone(), unknown.first)) {
            Some((name, first)) => Err(FitError::NothingFound { name, first, so_far: Box::new(fit) }),
            None => Ok(fit),
        }
    }
}

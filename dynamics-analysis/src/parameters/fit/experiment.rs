//! Experiments: each has a start, known parameters, options and data. The unknown parameters are common to
//! all.

use alloc::string::String;
use alloc::vec::Vec;

use dynamics_runtime::model::{ModelState, Parameters, Vector};
use dynamics_runtime::simulate::Simulate;
use nalgebra::{DMatrix, DVector};

use super::super::sensitivity::{SensitivityRequest, SensitivityRunSetup};
use super::super::sensitivity_error::SensitivityError;
use super::super::variable::{Variable, VariableError};
use super::data::{self, Given, Series};
use super::{DEFAULT_TOLERANCE, FitError, MIN_RELATIVE_SIZE, Unknown};

/// An experiment as it was given.
pub(super) struct ExperimentSetup<'m, M: Simulate> {
    pub(super) start: M::State,
    /// Its unknowns by name, parameters and elements of its start, with bounds.
    pub(super) unknowns: Vec<(String, [f64; 2])>,
    /// Parameters whose known values differ from those of the model.
    pub(super) known: Vec<(String, f64)>,
    pub(super) data: Vec<Given>,
    pub(super) options: Option<SensitivityRunSetup<'m, M>>,
}

impl<M: Simulate> ExperimentSetup<'_, M> {
    pub(super) fn new(start: M::State) -> Self {
        Self { start, unknowns: Vec::new(), known: Vec::new(), data: Vec::new(), options: None }
    }
}

/// An experiment whose data and options were checked.
pub(in super::super) struct Experiment<'a, M: Simulate> {
    index: usize,
    /// The model with the known parameters.
    model: M,
    start: M::State,
    pub(super) known: Vec<Variable>,
    pub(super) series: Vec<Series>,
    end: f64,
    /// The absolute tolerance, if it differs from the relative one.
    absolute_tolerance: Option<f64>,
    options: Option<&'a SensitivityRunSetup<'a, M>>,
}

impl<'a, M: Simulate + Parameters + Clone> Experiment<'a, M> {
    pub(super) fn of(
        model: &M,
        setup: &'a ExperimentSetup<'_, M>,
        index: usize,
        own_tolerance: bool,
    ) -> Result<Self, FitError> {
        let (mut model, mut known) = (model.clone(), Vec::new());
        for (name, value) in &setup.known {
            let variable = Variable::of::<M>(name)?;
            if !matches!(variable, Variable::Parameter(_)) {
                return Err(FitError::NotAParameter { name: name.clone() });
            }
            if known.contains(&variable) {
                return Err(VariableError::Twice { name: name.clone() }.into());
            }
            if !value.is_finite() {
                return Err(VariableError::NotFinite { name: name.clone(), value: *value }.into());
            }
            if !variable.set(&mut model, &mut setup.start.clone(), *value) {
                return Err(VariableError::Fixed { name: name.clone() }.into());
            }
            known.push(variable);
        }
        let start = setup.start;
        let (series, end) = data::read::<M>(&setup.data, start.t(), index)?;
        // Motions smaller than 1 have an absolute tolerance by their size, as fine as rounding of the largest
        // coordinate permits.
        let largest =
            start.q().as_slice().iter().chain(start.u().as_slice()).fold(0.0, |m: f64, x| m.max(x.abs()));
        let size = data::least_size(&series)
            .map(|size| size.max(MIN_RELATIVE_SIZE * largest))
            .filter(|size| *size < 1.0);
        let absolute_tolerance = if own_tolerance { None } else { size.map(|size| DEFAULT_TOLERANCE * size) };
        let options = setup.options.as_ref();
        Ok(Self { index, model, start, known, series, end, absolute_tolerance, options })
    }

    /// The same with other data.
    pub(super) fn with(&self, series: Vec<Series>) -> Self {
        let (model, known) = (self.model.clone(), self.known.clone());
        Self { model, known, series, ..*self }
    }

    /// Whether an unknown belongs to this experiment.
    fn has(&self, unknown: &Unknown) -> bool {
        match unknown.variable {
            Variable::Parameter(_) => !self.known.contains(&unknown.variable),
            _ => unknown.experiment == self.index,
        }
    }

    /// The number of measured values.
    pub(super) fn count(&self) -> usize {
        self.series.iter().map(|s| s.points.len()).sum()
    }

    /// Residuals (f − y)/σ with these values of all unknowns, and their Jacobian where it is asked for.
    pub(super) fn evaluate(
        &self,
        (unknowns, values): (&[Unknown], &DVector<f64>),
        tolerance: f64,
        jacobian: bool,
    ) -> Result<(DVector<f64>, DMatrix<f64>), SensitivityError> {
        let (mut model, mut start) = (self.model.clone(), self.start);
        let own: Vec<usize> = (0..unknowns.len()).filter(|i| self.has(&unknowns[*i])).collect();
        for i in &own {
            unknowns[*i].variable.set(&mut model, &mut start, values[*i]);
        }
        let variables: Vec<Variable> = own.iter().map(|i| unknowns[*i].variable).collect();
        let mut times: Vec<f64> = self.series.iter().flat_map(|s| &s.points).map(|(t, _)| *t).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        let (end, absolute) = (self.end, self.absolute_tolerance);
        let request =
            SensitivityRequest { variables: &variables, end, tolerance, absolute, times: Some(&times) };
        let options = self.options.map(|options| options as &dyn Fn(_) -> _);
        let mut by = DMatrix::zeros(if jacobian { self.count() } else { 0 }, unknowns.len());
        if !jacobian || own.is_empty() {
            return Ok((data::residuals(&self.series, &request.motion(&model, start, options)?)?, by));
        }
        let found = request.run(&model, start, options)?;
        let by_own = data::jacobian(&self.series, &found)?;
        own.iter().enumerate().for_each(|(k, i)| by.set_column(*i, &by_own.column(k)));
        Ok((data::residuals(&self.series, &found.motion)?, by))
    }
}

//! How a motion changes with parameters and with its start: the forward variational equations.
//!
//! For S = ∂(q, q̇)/∂(p, start), 2N×K,
//!
//! ```text
//! Ṡ = ⎡   0        1    ⎤ S + ⎡    0    ⎤
//!     ⎣ ∂q̈/∂q   ∂q̈/∂q̇ ⎦     ⎣ ∂q̈/∂p ⎦
//! ```
//!
//! with S(0) = 0 for parameters and a unit column for each element of the start, are integrated along the
//! motion (E. Hairer, S. P. Nørsett & G. Wanner, *Solving Ordinary Differential Equations I*, §I.14), on
//! its dense output, between its steps' ends, by Gauss collocation of order 10 with steps of its own, at the
//! tolerance of the motion. The derivatives are exact, unless [`Sensitivities::exact`] says that differences
//! were used. The error of the motion enters to first order.
//!
//! With constraints S lies in their tangent space, Φ_q δq + Φ_p δp = 0: the start is moved along with a
//! parameter as simulations put starts onto their constraints, by the smallest correction measured by M, and
//! so is a unit change of a start.
//!
//! If velocities or accelerations jump, S jumps too, because the instant of the jump moves with the
//! parameters. Such motions are refused: resets, impacts, constraints that engage or release, forces that
//! jump. Forces with corners (|x|, max) are allowed.

pub(super) mod collocation;
pub(super) mod forward_pass;
pub(super) mod jumps;
pub(super) mod variational_equations;

use alloc::borrow::ToOwned;
use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec::Vec;

use dynamics_runtime::model::{ModelState, Parameters, Vector};
use dynamics_runtime::simulate::{Motion, Simulate, Simulation};
use dynamics_view::suggest;
use nalgebra::{DMatrix, DVector};

use super::equations::{self, differences};
use super::sensitivity_error::SensitivityError;
use super::sweep::RunFailure;
use super::variable::Variable;
use crate::displacement::moved_along;
use crate::linearize::scales;

/// A function that sets options of the simulation.
pub(super) type SensitivityRunSetup<'m, M> =
    Box<dyn Fn(Simulation<'_, M>) -> Simulation<'_, M> + Send + Sync + 'm>;

/// Default tolerance, as that of simulations.
pub(super) const DEFAULT_TOLERANCE: f64 = 1e-9;
/// Motions whose coordinates and velocities all stay below this size have an absolute tolerance relative to
/// their size. With an absolute tolerance for size 1 their sensitivities would lose digits.
const SMALL_MOTION: f64 = 0.1;
/// Least size of a motion as the scale of this tolerance. A smaller tolerance would be below the rounding of
/// times and parameters of size 1.
const MIN_MOTION_SIZE: f64 = 1e-6;
/// Step of differences of outputs, relative to the sizes of the coordinates and of the parameter. The error
/// of order 4 and rounding are then both near 1e-12.
pub(super) const OUTPUT_STEP: f64 = 1e-3;
/// Least size of a coordinate as the scale of this step. Without it a coordinate that is 0 would have no
/// step.
const MIN_COORDINATE_SIZE: f64 = 1e-6;

/// Sensitivities of a motion with their options, before they are computed.
///
/// ```text
/// let found = model.sensitivities(start).by(["length", "theta"]).until(10.0).output_times(times).run()?;
/// let curve = found.series("theta", "length")?;        // ∂theta(t)/∂length
/// ```
#[must_use = "sensitivities are not computed until `.run()`"]
pub struct Sensitivity<'m, M: Simulate> {
    model: &'m M,
    start: M::State,
    names: Vec<String>,
    end: Option<f64>,
    tolerance: f64,
    times: Option<Vec<f64>>,
    options: Option<SensitivityRunSetup<'m, M>>,
}

impl<'m, M: Simulate + Parameters + Clone> Sensitivity<'m, M> {
    pub(super) fn new(model: &'m M, start: M::State) -> Self {
        Self {
            model,
            start,
            names: Vec::new(),
            end: None,
            tolerance: DEFAULT_TOLERANCE,
            times: None,
            options: None,
        }
    }

    /// Parameters, coordinates and velocities of the start, by which the motion is differentiated.
    pub fn by<S: AsRef<str>>(mut self, names: impl IntoIterator<Item = S>) -> Self {
        self.names.extend(names.into_iter().map(|name| name.as_ref().to_owned()));
        self
    }

    /// End time; may lie before the start.
    pub fn until(mut self, t: f64) -> Self {
        self.end = Some(t);
        self
    }

    /// Permitted local error per step of the motion and of its sensitivities. For the latter it is relative
    /// to the largest value so far of the column, or to a thousandth of the motion divided by the size of the
    /// variable, if that is more. Default 1e-9.
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.tolerance = tolerance;
        self
    }

    /// Times at which they are kept; without this, at the ends of the motion's steps.
    pub fn output_times(mut self, times: impl IntoIterator<Item = f64>) -> Self {
        self.times = Some(times.into_iter().collect());
        self
    }

    /// Options of the simulation: a method, a law of inputs. The dependence of a law on the state is
    /// differentiated by differences. Parameters inside the law are not taken into account.
    pub fn with(
        mut self,
        options: impl Fn(Simulation<'_, M>) -> Simulation<'_, M> + Send + Sync + 'm,
    ) -> Self {
        self.options = Some(Box::new(options));
        self
    }

    /// Runs the motion, then its variational equations.
    ///
    /// # Errors
    /// Unknown names; a motion that fails; forces that depend on reactions; jumps; a model without
    /// derivatives.
    pub fn run(self) -> Result<Sensitivities<'m, M>, SensitivityError> {
        let variables = Variable::all_of::<M>(&self.names)?;
        if variables.is_empty() {
            return Err(SensitivityError::NoVariables);
        }
        let options = self.options.as_deref().map(|options| options as &dyn Fn(_) -> _);
        let (end, tolerance) = (self.end.ok_or(SensitivityError::NoEnd)?, self.tolerance);
        SensitivityRequest {
            variables: &variables,
            end,
            tolerance,
            absolute: None,
            times: self.times.as_deref(),
        }
        .run(self.model, self.start, options)
    }
}

/// A request for sensitivities, with names resolved.
pub(super) struct SensitivityRequest<'a> {
    pub(super) variables: &'a [Variable],
    pub(super) end: f64,
    pub(super) tolerance: f64,
    /// The absolute tolerance, if it differs from the relative one.
    pub(super) absolute: Option<f64>,
    pub(super) times: Option<&'a [f64]>,
}

impl SensitivityRequest<'_> {
    /// The motion alone.
    pub(super) fn motion<'m, M: Simulate>(
        &self,
        model: &'m M,
        start: M::State,
        options: Option<&dyn Fn(Simulation<'m, M>) -> Simulation<'m, M>>,
    ) -> Result<Motion<'m, M>, SensitivityError> {
        let run = |absolute: Option<f64>| {
            let simulation = model.simulate(start).until(self.end);
            let simulation = match options {
                Some(options) => options(simulation),
                None => simulation,
            };
            // After the options: a fixed step among them needs no tolerance, and tolerances among them have
            // priority.
            let simulation = simulation.or_tolerance(self.tolerance, absolute);
            simulation.run().map_err(|error| SensitivityError::Motion(RunFailure::from(error)))
        };
        let motion = run(self.absolute)?;
        let elements = |state: M::State| {
            let of = |v: &M::Vector| v.as_slice().iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            of(state.q()).max(of(state.u()))
        };
        let size = motion.steps().map(elements).fold(0.0, f64::max);
        // A small motion is run again, with an absolute tolerance by its size.
        if self.absolute.is_none() && size > 0.0 && size < SMALL_MOTION {
            return run(Some(self.tolerance * size.max(MIN_MOTION_SIZE)));
        }
        Ok(motion)
    }

    pub(super) fn run<'m, M: Simulate + Parameters + Clone>(
        &self,
        model: &'m M,
        start: M::State,
        options: Option<&dyn Fn(Simulation<'m, M>) -> Simulation<'m, M>>,
    ) -> Result<Sensitivities<'m, M>, SensitivityError> {
        if M::FRICTION {
            return Err(SensitivityError::Friction);
        }
        let motion = self.motion(model, start, options)?;
        let times = self.times(&motion)?;
        let found = forward_pass::sensitivities(&motion, self.variables, &times, self.tolerance)?;
        let variables = self.variables.to_vec();
        Ok(Sensitivities {
            motion,
            variables,
            times,
            changes: found.changes,
            exact: found.exact,
            steps: found.steps,
        })
    }

    /// The output times, each once, in the direction of the motion.
    fn times<M: Simulate>(&self, motion: &Motion<'_, M>) -> Result<Vec<f64>, SensitivityError> {
        let (start, end) = (motion.start_time(), motion.end_time());
        let mut times = match self.times {
            Some(times) => times.to_vec(),
            None => motion.steps().map(|state| state.t()).collect(),
        };
        let within = |t: &f64| (start.min(end)..=start.max(end)).contains(t);
        if let Some(time) = times.iter().find(|t| !within(t)) {
            return Err(SensitivityError::OutOfRange { time: *time, start, end });
        }
        times.sort_by(f64::total_cmp);
        times.dedup();
        if end < start {
            times.reverse();
        }
        Ok(times)
    }
}

/// The sensitivities of a motion.
pub struct Sensitivities<'m, M: Simulate> {
    /// The motion.
    pub motion: Motion<'m, M>,
    variables: Vec<Variable>,
    times: Vec<f64>,
    changes: Vec<DMatrix<f64>>,
    /// Whether all derivatives are exact: no differences of the equations by a parameter, nor of a law of
    /// inputs. Otherwise the coefficients have about 12 correct digits, those of laws 9.
    pub exact: bool,
    /// Steps that the variational equations took.
    pub steps: usize,
}

impl<M: Simulate + Parameters + Clone> Sensitivities<'_, M> {
    /// The times at which they are kept, along the motion, each once.
    #[must_use]
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// The variables by which the motion was differentiated, one for each column.
    #[must_use]
    pub fn variables(&self) -> &[Variable] {
        &self.variables
    }

    /// ∂(q, q̇)/∂(variables) at the time of this index, 2N×K, in the units of each coordinate by those of
    /// each variable.
    #[must_use]
    pub fn matrix(&self, index: usize) -> Option<&DMatrix<f64>> {
        self.changes.get(index)
    }

    /// (t, ∂`quantity`/∂`by`): of a coordinate (`theta`), a velocity (`theta_rate`) or an output. Outputs are
    /// differentiated along the change of the state by differences of order 4 of their own code, good to
    /// about 10 digits.
    ///
    /// # Errors
    /// Unknown names; outputs that do not exist at a state.
    pub fn series(&self, quantity: &str, by: &str) -> Result<Vec<(f64, f64)>, SensitivityError> {
        let variable = Variable::of::<M>(by)?;
        let column = self.variables.iter().position(|v| *v == variable);
        let column = column.ok_or_else(|| SensitivityError::NotAsked { name: by.to_owned() })?;
        let quantity = MeasuredQuantity::of::<M>(quantity)?;
        let value = |k: usize| Ok((self.times[k], self.rows(&[quantity], k)?[(0, column)]));
        (0..self.times.len()).map(value).collect()
    }

    /// The derivatives of these quantities at the time of an index, a row for each.
    pub(super) fn rows(
        &self,
        quantities: &[MeasuredQuantity],
        index: usize,
    ) -> Result<DMatrix<f64>, SensitivityError> {
        let (n, changes) = (M::Vector::LEN, &self.changes[index]);
        let mut found = DMatrix::zeros(quantities.len(), self.variables.len());
        let outputs = quantities.iter().any(|q| matches!(q, MeasuredQuantity::Output(_)));
        let of_outputs = if outputs { Some(self.outputs(index)?) } else { None };
        for (i, quantity) in quantities.iter().enumerate() {
            match (quantity, &of_outputs) {
                (MeasuredQuantity::Position(k), _) => found.set_row(i, &changes.row(*k)),
                (MeasuredQuantity::Velocity(k), _) => found.set_row(i, &changes.row(n + k)),
                (MeasuredQuantity::Output(k), Some(outputs)) => found.set_row(i, &outputs.row(*k)),
                (MeasuredQuantity::Output(_), None) => {}
            }
        }
        Ok(found)
    }

    /// ∂outputs/∂variables by differences along the columns.
    fn outputs(&self, index: usize) -> Result<DMatrix<f64>, SensitivityError> {
        let (n, state) = (M::Vector::LEN, self.motion.at(self.times[index]));
        let sizes = [state.q().as_slice(), state.u().as_slice()].map(|of| scales(M::COORDINATES, of));
        let mut found = DMatrix::zeros(M::OUTPUTS.len(), self.variables.len());
        for (k, variable) in self.variables.iter().enumerate() {
            let column = self.changes[index].column(k).into_owned();
            // The step moves no coordinate, nor the parameter, by more than a thousandth of its size.
            let of_state = (0..2 * n)
                .map(|i| column[i].abs() / sizes[i / n][i % n].max(MIN_COORDINATE_SIZE))
                .fold(0.0, f64::max);
            let of_parameter = match variable {
                Variable::Parameter(p) => {
                    let value = self.motion.model().parameter(*p);
                    1.0 / equations::size(
                        value.ok_or(SensitivityError::NoParameterValue { name: M::PARAMETERS[*p].name })?,
                    )
                }
                _ => 0.0,
            };
            let h = OUTPUT_STEP / of_state.max(of_parameter).max(f64::MIN_POSITIVE);
            let h = if h.is_finite() { h } else { OUTPUT_STEP };
            let none = DVector::zeros(M::OUTPUTS.len());
            let by = differences(h, &none, |by| self.outputs_nearby(&state, &column, *variable, by))?;
            found.set_column(k, &by);
        }
        Ok(found)
    }

    /// The outputs at a state moved along a column by `by`, with the parameter moved, too.
    fn outputs_nearby(
        &self,
        state: &M::State,
        column: &DVector<f64>,
        variable: Variable,
        by: f64,
    ) -> Result<DVector<f64>, SensitivityError> {
        let state = moved_along(state, column, by);
        let state = if self.motion.has_law() { self.motion.complete(state) } else { state };
        let mut values = alloc::vec![0.0; M::OUTPUTS.len()];
        let model = self.motion.model();
        let result = match variable {
            Variable::Parameter(p) => {
                let moved = super::variable::moved(model, p, by);
                let moved =
                    moved.ok_or(SensitivityError::NoParameterValue { name: M::PARAMETERS[p].name })?;
                moved.outputs(&state, &mut values)
            }
            _ => model.outputs(&state, &mut values),
        };
        result.map_err(|error| equations::not_solved::<M>(&state, error))?;
        Ok(DVector::from_vec(values))
    }
}

/// A quantity that can be measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MeasuredQuantity {
    Position(usize),
    Velocity(usize),
    Output(usize),
}

impl MeasuredQuantity {
    /// The quantity of a name.
    pub(super) fn of<M: Simulate>(name: &str) -> Result<Self, SensitivityError> {
        if let Some(i) = M::OUTPUTS.iter().position(|output| output.name == name) {
            return Ok(Self::Output(i));
        }
        match Variable::of::<M>(name) {
            Ok(Variable::Position(i)) => Ok(Self::Position(i)),
            Ok(Variable::Velocity(i)) => Ok(Self::Velocity(i)),
            _ => {
                let known = M::OUTPUTS.iter().chain(M::COORDINATES).map(|q| q.name);
                Err(SensitivityError::UnknownQuantity {
                    name: name.to_owned(),
                    nearest: suggest(name, known),
                })
            }
        }
    }

    /// Its unit.
    pub(super) fn unit<M: Simulate>(self) -> String {
        match self {
            Self::Position(i) => Variable::Position(i).unit::<M>(),
            Self::Velocity(i) => Variable::Velocity(i).unit::<M>(),
            Self::Output(i) => M::OUTPUTS[i].unit.to_owned(),
        }
    }
}

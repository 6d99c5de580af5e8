//! What can be written, and what not: everything is refused here, before a file exists.

use dynamics_runtime::model::{ModelState, PrintedInC, SimulationModel, Vector};
use dynamics_runtime::simulate::Simulate as _;
use dynamics_runtime::smooth::{Pieces, SmoothFunction};

use crate::error::ExportError;
use crate::export::CExport;

/// Most steps of the example, so that a typing error does not run for days.
const MOST_STEPS: f64 = 1e9;

/// What is written.
pub(crate) struct Plan<M: SimulationModel> {
    /// The smooth functions, in order.
    pub(crate) functions: Vec<Pieces>,
    pub(crate) parameters: Vec<f64>,
    pub(crate) start: M::State,
    /// Steps of the example.
    pub(crate) steps: u64,
}

/// Checks the model and all that was chosen for it.
pub(crate) fn plan<M: SimulationModel + PrintedInC>(export: &CExport<'_, M>) -> Result<Plan<M>, ExportError> {
    if !M::C.obstacles.is_empty() {
        let reasons = M::C.obstacles.iter().map(|&reason| reason.to_owned()).collect();
        return Err(ExportError::NotPrintable { model: M::NAME, reasons });
    }
    if export.library_sines && export.single {
        return Err(ExportError::Sines { reason: "the library has no sines of floats" });
    }
    if export.library_sines && M::C.accurate {
        return Err(ExportError::Sines { reason: "the model has `sin_cos = accurate`, those of `<math.h>`" });
    }
    let functions = functions(export.model)?;
    let number = |option, value: f64| match value > 0.0 && value.is_finite() {
        true => Ok(()),
        false => Err(ExportError::Number { option, value, range: "a positive number" }),
    };
    number("the step of the example", export.step)?;
    number("the duration of the example", export.duration)?;
    // A quotient that rounding brought just above a whole number is this number.
    let quotient = export.duration / export.step;
    let steps = (quotient * (1.0 - 4.0 * f64::EPSILON)).ceil();
    if steps > MOST_STEPS {
        let range = "no more than 1e9 steps long";
        return Err(ExportError::Number { option: "the example", value: steps, range });
    }
    let start = start(export)?;
    // A value that the model does not tell was refused with the parameter's name by the simulation's checks.
    let parameter = |i| export.model.parameter(i).unwrap_or(f64::NAN);
    let parameters: Vec<f64> = (0..M::PARAMETERS.len()).map(parameter).collect();
    let plan = Plan { functions, parameters, start, steps: steps as u64 };
    if export.single {
        floats(export, &plan)?;
    }
    Ok(plan)
}

/// The start of the example, at which a simulation could begin.
fn start<M: SimulationModel + PrintedInC>(export: &CExport<'_, M>) -> Result<M::State, ExportError> {
    let zero = || M::State::new(0.0, M::Vector::zeros(), M::Vector::zeros(), M::Inputs::zeros());
    let start = export.start.unwrap_or_else(zero);
    for (quantity, &value) in M::INPUTS.iter().zip(start.inputs().as_slice()) {
        if !value.is_finite() {
            return Err(ExportError::Input { name: quantity.name, value });
        }
    }
    let is_given = export.start.is_some();
    export.model.simulate(start).check_beginning().map_err(|error| ExportError::Start {
        start: if is_given { "its start" } else { "rest in 0" },
        is_given,
        source: Box::new(error.kind),
    })?;
    Ok(start)
}

/// The pieces of the smooth functions.
fn functions<M: PrintedInC>(model: &M) -> Result<Vec<Pieces>, ExportError> {
    let of = |(name, function): (&&str, &dyn SmoothFunction)| {
        let name = (*name).to_owned();
        let Some(pieces) = function.pieces() else { return Err(ExportError::Function { name }) };
        match pieces.fault(function) {
            Some(fault) => Err(ExportError::Pieces { name, fault }),
            None => Ok(pieces),
        }
    };
    M::FUNCTIONS.iter().zip(model.smooth_functions()).map(of).collect()
}

/// Whether floats hold all numbers.
fn floats<M: SimulationModel + PrintedInC>(
    export: &CExport<'_, M>,
    plan: &Plan<M>,
) -> Result<(), ExportError> {
    let fits = |value: f64| {
        let single = value as f32;
        single.is_finite() && (single == 0.0) == (value == 0.0)
    };
    let check = |what: &dyn Fn() -> String, value: f64| match fits(value) {
        true => Ok(()),
        false => Err(ExportError::Float { what: what(), value }),
    };
    for (quantity, &value) in M::PARAMETERS.iter().zip(&plan.parameters) {
        check(&|| format!("the parameter `{}`", quantity.name), value)?;
    }
    for (name, Pieces { knots, coefficients, .. }) in M::FUNCTIONS.iter().zip(&plan.functions) {
        for &value in knots.iter().chain(coefficients.as_flattened()) {
            check(&|| format!("a number of the smooth function `{name}`"), value)?;
        }
    }
    check(&|| "the step of the example".to_owned(), export.step)
}

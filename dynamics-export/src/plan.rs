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
    /// `None` where none is wanted.
    pub(crate) example: Option<Example<M>>,
}

/// What moves in the example.
pub(crate) struct Example<M: SimulationModel> {
    pub(crate) parameters: Vec<f64>,
    pub(crate) start: M::State,
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
    let example = if export.example { Some(example(export)?) } else { None };
    let plan = Plan { functions, example };
    if export.single {
        floats(export, &plan)?;
    }
    Ok(plan)
}

/// Checks what was chosen for the example.
fn example<M: SimulationModel + PrintedInC>(export: &CExport<'_, M>) -> Result<Example<M>, ExportError> {
    let number = |option, value: f64| match value > 0.0 && value.is_finite() {
        true => Ok(()),
        false => Err(ExportError::Number { option, value, range: "a positive number" }),
    };
    number("the step of the example", export.step)?;
    number("the duration of the example", export.duration)?;
    let start = start(export)?;
    let steps = steps(start.t(), export.step, export.duration);
    if steps > MOST_STEPS {
        let range = "no more than 1e9 steps long";
        return Err(ExportError::Number { option: "the example", value: steps, range });
    }
    // A value that the model does not tell was refused with the parameter's name by the simulation's checks.
    let parameter = |i| export.model.parameter(i).unwrap_or(f64::NAN);
    let parameters: Vec<f64> = (0..M::PARAMETERS.len()).map(parameter).collect();
    Ok(Example { parameters, start, steps: steps as u64 })
}

/// How many steps a run with this fixed step makes: its last one ends at the end, shorter than the others or
/// longer by rounding.
fn steps(start: f64, step: f64, duration: f64) -> f64 {
    const STRETCH: f64 = 1e-9;
    let is_last = |number: f64| start + duration - (start + (number - 1.0) * step) <= step * (1.0 + STRETCH);
    let about = (duration / step).ceil().max(1.0);
    // The quotient is rounded, too.
    [about - 1.0, about].into_iter().find(|&number| number >= 1.0 && is_last(number)).unwrap_or(about + 1.0)
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
        start: words(is_given),
        is_given,
        source: Box::new(error.kind),
    })?;
    if !M::ROWS.is_empty() {
        let solved = export.model.constants().ok().and_then(|k| export.model.solve_unrolled(&k, &start));
        let is_released = |i| start.active_set().side(i) != 0.0;
        let switched = M::CONSTRAINTS.iter().filter(|c| c.switched.is_some()).count();
        if solved.is_none() {
            let remedy = match (0..switched).any(is_released) {
                true => "engage its constraints, or begin elsewhere",
                false => "begin elsewhere",
            };
            return Err(ExportError::Unsolved { start: words(is_given), remedy });
        }
    }
    Ok(start)
}

/// Which start.
fn words(is_given: bool) -> &'static str {
    if is_given { "its start" } else { "rest in 0" }
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
    for value in literals(M::C.programs) {
        check(&|| "a number of the equations".to_owned(), value)?;
    }
    for (name, Pieces { knots, coefficients, .. }) in M::FUNCTIONS.iter().zip(&plan.functions) {
        for &value in knots.iter().chain(coefficients.as_flattened()) {
            check(&|| format!("a number of the smooth function `{name}`"), value)?;
        }
    }
    let Some(Example { parameters, start, .. }) = &plan.example else { return Ok(()) };
    let all = [
        ("the parameter", M::PARAMETERS, parameters.as_slice()),
        ("the start's coordinate", M::COORDINATES, start.q().as_slice()),
        ("the start's rate of", M::COORDINATES, start.u().as_slice()),
        ("the start's input", M::INPUTS, start.inputs().as_slice()),
    ];
    for (what, quantities, values) in all {
        for (quantity, &value) in quantities.iter().zip(values) {
            check(&|| format!("{what} `{}`", quantity.name), value)?;
        }
    }
    let times = [
        ("the time of the start", start.t()),
        ("the end of the example", start.t() + export.duration),
        ("the step of the example", export.step),
    ];
    times.into_iter().try_for_each(|(what, value)| check(&|| what.to_owned(), value))
}

/// The numbers of a template: `@` stands behind each of them, and behind names of functions.
fn literals(text: &str) -> impl Iterator<Item = f64> {
    text.split('@').filter_map(|before| {
        let is_part = |c: char| c.is_ascii_digit() || c == '.' || c == 'e';
        let is_signed = |rest: &str| rest.ends_with("e-") || rest.ends_with("e+");
        let mut rest = before;
        while let Some(shorter) = rest.strip_suffix(is_part) {
            let sign = if is_signed(shorter) { 1 } else { 0 };
            rest = &shorter[..shorter.len() - sign];
        }
        before[rest.len()..].parse().ok()
    })
}

#[cfg(test)]
mod tests {
    use super::{literals, steps};

    #[test]
    fn steps_are_those_of_a_run() {
        assert_eq!(steps(0.0, 0.001, 10.0), 10_000.0);
        assert_eq!(steps(0.0, 0.1, 0.3), 3.0);
        assert_eq!(steps(0.0, 0.3, 1.0), 4.0);
        assert_eq!(steps(0.0, 2.0, 1.0), 1.0);
        assert_eq!(steps(5.0, 0.001, 0.0025), 3.0);
    }

    #[test]
    fn numbers_are_read_from_a_text() {
        let text = "const real v1 = 1.5@*x - sin@(2e-60@*v0) + atan2@(y, -1e+3@);";
        let all: Vec<f64> = literals(text).collect();
        assert_eq!(all, [1.5, 2e-60, 2.0, 1e3]);
    }
}

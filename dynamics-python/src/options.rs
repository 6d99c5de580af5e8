//! Options of a run, as Python gives them.

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMapping, PyString};

use dynamics::simulate::{Contact, Direction, Formulation};

use crate::arrays;
use crate::info::Info;

/// The options of a run that are data.
#[derive(Clone, Debug, Default)]
pub(crate) struct Options {
    pub(crate) until: f64,
    pub(crate) tolerance: Option<f64>,
    pub(crate) tolerances: Option<(f64, f64)>,
    pub(crate) method: Option<MethodName>,
    pub(crate) fixed_step: Option<f64>,
    pub(crate) first_step: Option<f64>,
    pub(crate) max_step: Option<f64>,
    pub(crate) max_steps: Option<u64>,
    pub(crate) times: Option<Vec<f64>>,
    pub(crate) every: Option<f64>,
    pub(crate) contacts: Vec<(String, Contact)>,
    pub(crate) stick_slips: Vec<(String, String)>,
    pub(crate) stops: Vec<(String, Direction)>,
    pub(crate) formulation: Option<Formulation>,
    pub(crate) drift_limit: Option<f64>,
    pub(crate) consistent_output: bool,
    pub(crate) estimate_error: bool,
}

/// A method with its option.
#[derive(Clone, Debug)]
pub(crate) struct MethodName {
    pub(crate) name: &'static str,
    pub(crate) option: Option<f64>,
}

/// Calls of Python in a run.
#[derive(Debug, Default)]
pub(crate) struct Callbacks {
    /// `inputs(t, state)`.
    pub(crate) inputs: Option<Py<PyAny>>,
    /// `events = {name: function of the state}`.
    pub(crate) events: Vec<(String, Py<PyAny>)>,
    /// `on_event = {name: action}`.
    pub(crate) actions: Vec<(String, Direction, Py<PyAny>)>,
}

impl Callbacks {
    /// All functions.
    pub(crate) fn functions(&self) -> impl Iterator<Item = &Py<PyAny>> {
        let events = self.events.iter().map(|(_, function)| function);
        self.inputs.iter().chain(events).chain(self.actions.iter().map(|(_, _, action)| action))
    }
}

/// Names of methods in Python.
pub(crate) const METHODS: &[&str] = &[
    "rk4",
    "dormand_prince5",
    "dop853",
    "tsit5",
    "verner9",
    "gragg_bulirsch_stoer",
    "taylor",
    "radau5",
    "generalized_alpha",
    "gauss6",
    "semi_implicit_euler",
    "stormer_verlet",
    "rattle",
    #[cfg(feature = "all-methods")]
    "esdirk4",
    #[cfg(feature = "all-methods")]
    "gauss4",
    #[cfg(feature = "all-methods")]
    "energy_midpoint",
    #[cfg(feature = "all-methods")]
    "composition4",
    #[cfg(feature = "all-methods")]
    "composition6",
    #[cfg(feature = "all-methods")]
    "composition8",
    #[cfg(feature = "all-methods")]
    "explicit_euler",
    #[cfg(feature = "all-methods")]
    "heun",
    #[cfg(feature = "all-methods")]
    "adams_bashforth2",
    #[cfg(feature = "all-methods")]
    "adams_bashforth3",
    #[cfg(feature = "all-methods")]
    "adams_bashforth4",
];

/// Methods that take an option, and its name.
const WITH_OPTION: &[(&str, &str)] = &[("taylor", "order"), ("generalized_alpha", "rho")];

/// Refuses two options of which one would be ignored.
pub(crate) fn one_of(one: (&str, bool), other: (&str, bool)) -> PyResult<()> {
    match one.1 && other.1 {
        true => Err(PyValueError::new_err(format!("give {} or {}, not both", one.0, other.0))),
        false => Ok(()),
    }
}

/// The entries of a dictionary or of another mapping; None of anything else.
pub(crate) fn entries<'py>(value: &Bound<'py, PyAny>) -> Option<Bound<'py, PyDict>> {
    if let Ok(entries) = value.cast::<PyDict>() {
        return Some(entries.clone());
    }
    let entries = PyDict::new(value.py());
    entries.update(value.cast::<PyMapping>().ok()?).ok()?;
    Some(entries)
}

/// `"dop853"`, or `("generalized_alpha", 0.5)`.
pub(crate) fn method(value: &Bound<'_, PyAny>) -> PyResult<MethodName> {
    let (name, option): (String, Option<f64>) = match value.extract::<String>() {
        Ok(name) => (name, None),
        Err(_) => {
            value.extract::<(String, f64)>().map(|(name, option)| (name, Some(option))).map_err(|_| {
                PyTypeError::new_err(
                    "method: give a name, or a name and its option: (\"generalized_alpha\", 0.5)",
                )
            })?
        }
    };
    let Some(known) = METHODS.iter().find(|known| **known == name) else {
        let known = METHODS.join(", ");
        let more = match cfg!(feature = "all-methods") {
            true => "",
            false => "; further ones with the feature `all-methods` of dynamics-python",
        };
        return Err(PyValueError::new_err(format!(
            "method: `{name}` is not known; the methods are {known}{more}"
        )));
    };
    if option.is_some() && WITH_OPTION.iter().all(|(with, _)| with != known) {
        return Err(PyValueError::new_err(format!("method: `{name}` has no option")));
    }
    if let (&"taylor", Some(order)) = (known, option)
        && (order.fract() != 0.0 || !(0.0..=1e3).contains(&order))
    {
        return Err(PyValueError::new_err(format!(
            "method: the order of `taylor` is a number from 4 to 30, not {order}"
        )));
    }
    Ok(MethodName { name: known, option })
}

/// `"projected"`, `"baumgarte"`, or `("baumgarte", alpha, beta)`.
pub(crate) fn formulation(value: &Bound<'_, PyAny>) -> PyResult<Formulation> {
    if let Ok((name, alpha, beta)) = value.extract::<(String, f64, f64)>()
        && name == "baumgarte"
    {
        return Ok(Formulation::Baumgarte { alpha, beta });
    }
    match value.extract::<String>().as_deref() {
        Ok("augmented") => Ok(Formulation::Augmented),
        Ok("baumgarte") => Ok(Formulation::BaumgarteTied),
        Ok("projected") => Ok(Formulation::Projected),
        Ok("embedded") => Ok(Formulation::Embedded),
        _ => Err(PyValueError::new_err(
            "formulation: give \"projected\", \"embedded\", \"augmented\", \"baumgarte\", or (\"baumgarte\", \
             alpha, beta)",
        )),
    }
}

/// `"rising"`, `"falling"` or `"any"`.
pub(crate) fn direction(what: &str, value: &Bound<'_, PyAny>) -> PyResult<Direction> {
    match value.extract::<String>().as_deref() {
        Ok("rising") => Ok(Direction::Rising),
        Ok("falling") => Ok(Direction::Falling),
        Ok("any") => Ok(Direction::Any),
        _ => Err(PyValueError::new_err(format!("{what}: a direction is \"rising\", \"falling\" or \"any\""))),
    }
}

/// `stop_at="landing"`, or `stop_at={"landing": "falling"}`.
pub(crate) fn stops(value: &Bound<'_, PyAny>) -> PyResult<Vec<(String, Direction)>> {
    if let Ok(name) = value.extract::<String>() {
        return Ok(vec![(name, Direction::Any)]);
    }
    if let Some(entries) = entries(value) {
        return entries.iter().map(|(name, to)| Ok((name.extract()?, direction("stop_at", &to)?))).collect();
    }
    let names: Vec<String> = value.extract().map_err(|_| {
        PyTypeError::new_err("stop_at: give the name of an event, a list of names, or {name: direction}")
    })?;
    Ok(names.into_iter().map(|name| (name, Direction::Any)).collect())
}

/// `contact={"floor": 0.8}`.
pub(crate) fn contacts(value: &Bound<'_, PyAny>) -> PyResult<Vec<(String, Contact)>> {
    let wrong = || PyTypeError::new_err("contact: give {name of the constraint: coefficient of restitution}");
    let entries = entries(value).ok_or_else(wrong)?;
    let of = |(name, restitution): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
        let restitution: f64 = restitution.extract().map_err(|_| wrong())?;
        Ok((name.extract().map_err(|_| wrong())?, restitution.into()))
    };
    entries.iter().map(of).collect()
}

/// `stick_slip={"belt": "breakaway"}`.
pub(crate) fn stick_slips(value: &Bound<'_, PyAny>) -> PyResult<Vec<(String, String)>> {
    let wrong =
        || PyTypeError::new_err("stick_slip: give {name of the constraint: name of the breakaway event}");
    let entries = entries(value).ok_or_else(wrong)?;
    entries
        .iter()
        .map(|(name, event)| Ok((name.extract()?, event.extract()?)))
        .collect::<PyResult<_>>()
        .map_err(|_| wrong())
}

/// `ranges={"g": (0.0, 25.0)}`.
pub(crate) fn ranges(value: &Bound<'_, PyAny>) -> PyResult<Vec<(String, [f64; 2])>> {
    let wrong = || PyTypeError::new_err("ranges: give {name of the parameter: (from, to)}");
    let entries = entries(value).ok_or_else(wrong)?;
    let of = |(name, ends): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
        PyResult::Ok((name.extract()?, ends.extract::<[f64; 2]>()?))
    };
    entries.iter().map(of).collect::<PyResult<_>>().map_err(|_| wrong())
}

/// `on_event={"bounce": action}`, or `{"bounce": ("falling", action)}`.
pub(crate) fn actions(value: &Bound<'_, PyAny>) -> PyResult<Vec<(String, Direction, Py<PyAny>)>> {
    const NEEDED: &str =
        "on_event: give {name of an event: function of the state}, or {name: (direction, function)}";
    let entries = entries(value).ok_or_else(|| PyTypeError::new_err(NEEDED))?;
    let of = |(name, action): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
        let name: String = name.extract().map_err(|_| PyTypeError::new_err(NEEDED))?;
        if action.is_callable() {
            return Ok((name, Direction::Any, action.unbind()));
        }
        let (to, action): (Bound<'_, PyAny>, Bound<'_, PyAny>) =
            action.extract().map_err(|_| PyTypeError::new_err(NEEDED))?;
        if !action.is_callable() {
            return Err(PyTypeError::new_err(NEEDED));
        }
        Ok((name, direction("on_event", &to)?, action.unbind()))
    };
    entries.iter().map(of).collect()
}

/// `events={"apex": lambda state: state.theta_rate}`.
pub(crate) fn events(value: &Bound<'_, PyAny>) -> PyResult<Vec<(String, Py<PyAny>)>> {
    const NEEDED: &str = "events: give {name: function of the state that returns a number}";
    let entries = entries(value).ok_or_else(|| PyTypeError::new_err(NEEDED))?;
    let of = |(name, function): (Bound<'_, PyAny>, Bound<'_, PyAny>)| match function.is_callable() {
        true => Ok((name.extract().map_err(|_| PyTypeError::new_err(NEEDED))?, function.unbind())),
        false => Err(PyTypeError::new_err(NEEDED)),
    };
    entries.iter().map(of).collect()
}

/// Values of the inputs: a number or a sequence of all of them in order, or a dictionary by name.
pub(crate) fn inputs(info: &Info, value: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let count = info.scalars.inputs.len();
    let names = || info.inputs.iter().map(|slot| slot.shown()).collect::<Vec<_>>().join(", ");
    if count == 0 {
        return Err(PyTypeError::new_err(format!("inputs: {} has no inputs", info.name)));
    }
    // One number without a detour by NumPy: laws return it at every stage.
    if let (1, Ok(value)) = (count, arrays::number(value)) {
        return Ok(vec![value]);
    }
    if let Some(entries) = entries(value) {
        let mut values = vec![f64::NAN; count];
        for (name, given) in entries.iter() {
            let name: String = name.extract()?;
            let slot = info.inputs.iter().find(|slot| slot.name == name).ok_or_else(|| {
                PyTypeError::new_err(format!("inputs: `{name}` is not one; the inputs are {}", names()))
            })?;
            let given = arrays::numbers(&name, &given)?;
            let given: Vec<f64> = arrays::elements(&given);
            if given.len() != slot.width() {
                return Err(PyValueError::new_err(format!(
                    "inputs: {} takes {} values",
                    slot.shown(),
                    slot.width()
                )));
            }
            values[slot.at..slot.at + slot.width()].copy_from_slice(&given);
        }
        if let Some(i) = values.iter().position(|value| value.is_nan()) {
            let name = info.scalars.inputs[i].name;
            return Err(PyValueError::new_err(format!("inputs: `{name}` is missing, or not a number")));
        }
        return Ok(values);
    }
    if value.is_instance_of::<PyString>() {
        return Err(PyTypeError::new_err(format!("inputs: numbers are needed for {}", names())));
    }
    let array = arrays::numbers("inputs", value)?;
    let values: Vec<f64> = arrays::elements(&array);
    if values.len() != count {
        let given = values.len();
        return Err(PyValueError::new_err(format!("inputs: {given} values for {count} inputs, {}", names())));
    }
    Ok(values)
}

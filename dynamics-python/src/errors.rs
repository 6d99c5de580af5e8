//! The exceptions, which `errors.py` defines.

use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyType};

use crate::data::Failure;
use crate::motion::Motion;

/// Names of the exceptions.
pub(crate) const NAMES: [&str; 3] = ["SimulationError", "StateError", "EvaluationError"];

static CLASSES: PyOnceLock<Py<PyDict>> = PyOnceLock::new();

/// The class of an exception.
pub(crate) fn class<'py>(py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyType>> {
    let classes = CLASSES.get_or_try_init(py, || {
        let code = std::ffi::CString::new(include_str!("errors.py"))?;
        // Not a module: all modules with models would share it, and each would overwrite the classes of those
        // before.
        let classes = PyDict::new(py);
        classes.set_item("__name__", "dynamics_errors")?;
        py.run(&code, Some(&classes), None)?;
        PyResult::Ok(classes.unbind())
    })?;
    Ok(classes.as_any().bind(py).get_item(name)?.cast_into::<PyType>()?)
}

/// An exception with a text.
pub(crate) fn raised(py: Python<'_>, name: &str, text: String) -> PyErr {
    match class(py, name) {
        Ok(class) => PyErr::from_type(class, text),
        Err(error) => error,
    }
}

/// A run that ended early, with what it computed.
pub(crate) fn simulation(
    py: Python<'_>,
    failure: Failure,
    state: Bound<'_, PyAny>,
    partial: Option<Motion>,
) -> PyResult<PyErr> {
    let error = class(py, "SimulationError")?.call1((failure.text,))?;
    error.setattr("kind", failure.kind)?;
    error.setattr("time", failure.time)?;
    error.setattr("step", failure.step)?;
    error.setattr("state", state)?;
    error.setattr("partial", partial)?;
    Ok(PyErr::from_value(error))
}

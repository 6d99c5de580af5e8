//! `Equilibrium` and `Linearization`.

use pyo3::prelude::*;

use crate::arrays;
use crate::data::LinearData;
use crate::state::State;

/// An equilibrium of a model.
#[pyclass(frozen, module = "dynamics")]
#[derive(Debug)]
pub struct Equilibrium {
    pub(crate) state: Py<State>,
    pub(crate) text: String,
    pub(crate) stability: String,
}

#[pymethods]
impl Equilibrium {
    /// The state.
    #[getter]
    fn state(&self, py: Python<'_>) -> Py<State> {
        self.state.clone_ref(py)
    }

    /// Whether it is stable, and why.
    #[getter]
    fn stability(&self) -> &str {
        &self.stability
    }

    fn __repr__(&self) -> String {
        format!("{}\n{}", self.text.trim_end(), self.stability)
    }
}

/// The linear equations of small motions about a state: mass z̈ + damping ż + stiffness z = input w.
#[pyclass(frozen, module = "dynamics")]
#[derive(Debug)]
pub struct Linearization {
    pub(crate) data: LinearData,
}

#[pymethods]
impl Linearization {
    /// The independent coordinates z.
    #[getter]
    fn coordinates(&self) -> Vec<String> {
        self.data.coordinates.clone()
    }

    /// The mass matrix, F×F.
    #[getter]
    fn mass<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::matrix(py, self.data.mass.clone())
    }

    /// Damping and gyroscopic terms, F×F.
    #[getter]
    fn damping<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::matrix(py, self.data.damping.clone())
    }

    /// Stiffness and circulatory terms, F×C.
    #[getter]
    fn stiffness<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::matrix(py, self.data.stiffness.clone())
    }

    /// Generalized forces of unit inputs, F×W.
    #[getter]
    fn input<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::matrix(py, self.data.input.clone())
    }

    /// Natural frequencies of the modes, in rad per unit of time.
    #[getter]
    fn frequencies<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        arrays::vector(py, self.data.modes.iter().map(|(frequency, _)| *frequency).collect())
    }

    /// Damping ratios of the modes: 0 without damping, negative where the mode grows.
    #[getter]
    fn damping_ratios<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        arrays::vector(py, self.data.modes.iter().map(|(_, ratio)| *ratio).collect())
    }

    fn __repr__(&self) -> String {
        self.data.text.clone()
    }
}

//! `State`: a state of a model by the model's names.

use std::sync::Arc;

use pyo3::exceptions::{PyAttributeError, PyKeyError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::arrays;
use crate::data::StateData;
use crate::info::{Info, Part, Slot};

/// A state of a model: time, generalized coordinates, velocities and inputs, with an attribute for every
/// name. It does not change; `replace(theta=0.1)` returns another one.
#[pyclass(frozen, module = "dynamics")]
#[derive(Debug)]
pub struct State {
    pub(crate) info: Arc<Info>,
    pub(crate) data: StateData,
}

impl State {
    pub(crate) fn new(info: &Arc<Info>, data: StateData) -> Self {
        Self { info: Arc::clone(info), data }
    }

    fn part(&self, part: Part) -> &[f64] {
        match part {
            Part::Coordinates => &self.data.q,
            Part::Velocities => &self.data.u,
            Part::Inputs => &self.data.inputs,
        }
    }

    fn named<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Option<Bound<'py, PyAny>>> {
        let Some((part, slot)) = self.info.find(name) else { return Ok(None) };
        value(py, self.part(part), slot).map(Some)
    }

    /// Switched constraints that are released, and their sides.
    fn sides(&self) -> impl Iterator<Item = (&'static str, f64)> + '_ {
        let switched = self.info.constraints.iter().filter(|(_, switched)| *switched).enumerate();
        let released = switched.filter(|(i, _)| !self.data.active_set.holds(*i));
        released.map(|(i, (name, _))| (*name, self.data.active_set.side(i)))
    }

    /// The same as a dictionary.
    fn release<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let sides = PyDict::new(py);
        self.sides().try_for_each(|(name, side)| sides.set_item(name, side))?;
        Ok(sides)
    }

    /// Names and values as `state(..)` takes them.
    fn given<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let given = PyDict::new(py);
        for slot in &self.info.coordinates {
            given.set_item(&slot.name, value(py, &self.data.q, slot)?)?;
            given.set_item(format!("{}_rate", slot.name), value(py, &self.data.u, slot)?)?;
        }
        for slot in &self.info.inputs {
            given.set_item(&slot.name, value(py, &self.data.inputs, slot)?)?;
        }
        Ok(given)
    }
}

/// A number, or a read-only array.
fn value<'py>(py: Python<'py>, from: &[f64], slot: &Slot) -> PyResult<Bound<'py, PyAny>> {
    match slot.len {
        None => Ok(from[slot.at].into_pyobject(py)?.into_any()),
        Some(len) => arrays::read_only(arrays::vector(py, from[slot.at..slot.at + len].to_vec())),
    }
}

/// Writes a number, or as many as the quantity has, to their places.
pub(crate) fn set(into: &mut [f64], slot: &Slot, given: &Bound<'_, PyAny>) -> PyResult<()> {
    let Some(len) = slot.len else {
        into[slot.at] = arrays::number(given).map_err(|error: PyErr| {
            PyTypeError::new_err(format!("{}: {}", slot.shown(), error.value(given.py())))
        })?;
        return Ok(());
    };
    let values = arrays::times(&slot.name, given)?;
    if values.len() != len {
        return Err(PyValueError::new_err(format!("{}: {} values are given", slot.shown(), values.len())));
    }
    into[slot.at..slot.at + len].copy_from_slice(&values);
    Ok(())
}

#[pymethods]
impl State {
    /// Time.
    #[getter]
    fn t(&self) -> f64 {
        self.data.t
    }

    /// Generalized coordinates, N.
    #[getter]
    fn q<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::read_only(arrays::vector(py, self.data.q.clone()))
    }

    /// Generalized velocities q̇, N.
    #[getter]
    fn u<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::read_only(arrays::vector(py, self.data.u.clone()))
    }

    /// Input values; NaN where they are not set.
    #[getter]
    fn inputs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::read_only(arrays::vector(py, self.data.inputs.clone()))
    }

    /// Names of the switched constraints that are released.
    #[getter]
    fn released(&self) -> Vec<&'static str> {
        self.sides().map(|(name, _)| name).collect()
    }

    /// All names and values, and the sides of released constraints as `release`: what `state(..)` takes.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = self.given(py)?;
        all.set_item("t", self.data.t)?;
        if !self.data.active_set.all_hold() {
            all.set_item("release", self.release(py)?)?;
        }
        Ok(all)
    }

    /// Another state with some values changed, as an action of an event returns it. The constraints are not
    /// checked here; a run checks them.
    #[pyo3(signature = (*, t=None, **values))]
    fn replace(&self, t: Option<f64>, values: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let mut data = self.data.clone();
        data.t = t.unwrap_or(data.t);
        for (name, given) in values.into_iter().flat_map(|values| values.iter()) {
            let name: String = name.extract()?;
            let (part, slot) = self.info.find(&name).ok_or_else(|| {
                let (model, names) = (self.info.name, self.info.state_names());
                PyTypeError::new_err(format!("a state of {model} has no `{name}`; it has {names}"))
            })?;
            let into = match part {
                Part::Coordinates => &mut data.q,
                Part::Velocities => &mut data.u,
                Part::Inputs => &mut data.inputs,
            };
            set(into, slot, &given)?;
        }
        Ok(Self::new(&self.info, data))
    }

    fn __getattr__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        self.named(py, name)?.ok_or_else(|| {
            let (model, names) = (self.info.name, self.info.state_names());
            PyAttributeError::new_err(format!("a state of {model} has no `{name}`; it has t, q, u, {names}"))
        })
    }

    fn __getitem__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        self.named(py, name)?.ok_or_else(|| {
            let (model, names) = (self.info.name, self.info.state_names());
            PyKeyError::new_err(format!("a state of {model} has no `{name}`; it has {names}"))
        })
    }

    fn __dir__(&self) -> Vec<String> {
        let own = ["t", "q", "u", "inputs", "released", "replace", "to_dict"].map(str::to_owned);
        let coordinates = self.info.coordinates.iter();
        let names = coordinates.flat_map(|slot| [slot.name.clone(), format!("{}_rate", slot.name)]);
        own.into_iter().chain(names).chain(self.info.inputs.iter().map(|slot| slot.name.clone())).collect()
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let class = self.info.class.get().ok_or_else(|| PyTypeError::new_err("this state has no class"))?;
        let parts = (self.data.t, self.given(py)?, self.release(py)?).into_pyobject(py)?;
        Ok((class.bind(py).getattr("_state_of")?, parts))
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        let other = other.cast::<Self>();
        other.is_ok_and(|other| other.get().info.name == self.info.name && other.get().data.is(&self.data))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let mut parts = vec![format!("t={}", self.data.t)];
        for (name, given) in self.given(py)?.iter() {
            let shown = given.call_method0("tolist").unwrap_or(given);
            parts.push(format!("{name}={}", shown.repr()?));
        }
        Ok(format!("<state of {}: {}>", self.info.name, parts.join(", ")))
    }
}

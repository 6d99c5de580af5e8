//! `Motion`: the result of a run, as arrays.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::exceptions::{PyAttributeError, PyKeyError, PyTypeError, PyValueError};
use pyo3::gc::{PyTraverseError, PyVisit};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple, PyType};

use crate::arrays;
use crate::data::{Columns, Matrix, Table};
use crate::erased::{AnyMotion, File, Times};
use crate::info::{Info, Part};
use crate::law::Interruption;
use crate::live::{LivePage, framed};
use crate::state::State;
use crate::summary::{Event, Summary};

/// Height of a cell of a notebook, in pixels.
const HEIGHT: u32 = 640;

/// The motion of a model: states at any time, and all quantities that follow from a state.
///
/// Attributes are arrays over `motion.t`, the times that the run was asked for, or its accepted steps:
/// `motion.theta`, `motion.theta_rate`, inputs and outputs by name, `motion.energy`.
#[pyclass(frozen, module = "dynamics")]
pub struct Motion {
    pub(crate) info: Arc<Info>,
    pub(crate) motion: Arc<dyn AnyMotion>,
    /// The class of the model that moved, and the parameters that it had then.
    pub(crate) class: Py<PyType>,
    pub(crate) parameters: Py<PyDict>,
    /// It belongs to an exception, and stays behind where that is pickled.
    pub(crate) is_partial: bool,
}

impl std::fmt::Debug for Motion {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Motion").field("model", &self.info.name).finish_non_exhaustive()
    }
}

impl Motion {
    /// Works on the motion without Python's lock. Exceptions of a law of inputs, and Ctrl-C, are raised.
    fn read<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&dyn AnyMotion, &Interruption) -> T + Send,
    ) -> PyResult<T> {
        let interruption = Interruption::default();
        let result = py.detach(|| work(&*self.motion, &interruption));
        match interruption.take() {
            Some(error) => Err(error),
            None => Ok(result),
        }
    }

    fn table(&self, py: Python<'_>, times: Times, columns: Columns) -> PyResult<Table> {
        self.read(py, |motion, interruption| motion.table(times, columns, interruption))?
            .map_err(PyValueError::new_err)
    }

    /// A quantity over times by its name; `None` where there is none of this name.
    fn named<'py>(&self, py: Python<'py>, name: &str, times: Times) -> PyResult<Option<Bound<'py, PyAny>>> {
        if let Some((part, slot)) = self.info.find(name) {
            let table = self.table(py, times, Columns::default())?;
            let from = match part {
                Part::Coordinates => &table.q,
                Part::Velocities => &table.u,
                Part::Inputs => &table.inputs,
            };
            return arrays::columns(py, from, slot.at, slot.len).map(Some);
        }
        if let Some(at) = self.info.outputs.iter().position(|output| output.name == name) {
            let table = self.table(py, times, Columns { outputs: true, ..Columns::default() })?;
            return arrays::columns(py, &table.outputs, at, None).map(Some);
        }
        // Vectors and arrays by their common name: `place` of `place.x`, `force` of `force[0]`.
        let parts = |full: &str| full.strip_prefix(name).is_some_and(|rest| rest.starts_with(['.', '[']));
        let Some(at) = self.info.outputs.iter().position(|output| parts(output.name)) else {
            return Ok(None);
        };
        let len = self.info.outputs[at..].iter().take_while(|output| parts(output.name)).count();
        let table = self.table(py, times, Columns { outputs: true, ..Columns::default() })?;
        arrays::columns(py, &table.outputs, at, Some(len)).map(Some)
    }

    fn names(&self) -> String {
        let outputs: Vec<&str> = self.info.outputs.iter().map(|output| output.name).collect();
        let outputs = if outputs.is_empty() { String::new() } else { format!(", {}", outputs.join(", ")) };
        format!("t, q, u, energy, {}{outputs}", self.info.state_names())
    }

    /// Columns of a table by name, arrays flattened if asked so.
    fn columns_of<'py>(
        &self,
        py: Python<'py>,
        table: &Table,
        (asked, flat): (Columns, bool),
    ) -> PyResult<Vec<(String, Bound<'py, PyAny>)>> {
        let mut columns = vec![("t".to_owned(), arrays::vector(py, table.t.clone()))];
        let mut add = |name: String, from: &Matrix, at: usize, len: Option<usize>| {
            columns.push((name, arrays::columns(py, from, at, len)?));
            PyResult::Ok(())
        };
        let coordinates = &self.info.coordinates[..];
        let accelerating = if asked.accelerations { coordinates } else { &[] };
        let parts = [
            (coordinates, "", &table.q),
            (coordinates, "_rate", &table.u),
            (&self.info.inputs, "", &table.inputs),
            (accelerating, "_acceleration", &table.accelerations),
        ];
        for (slots, suffix, from) in parts {
            for slot in slots {
                let name = format!("{}{suffix}", slot.name);
                match slot.len {
                    Some(len) if flat => {
                        for i in 0..len {
                            add(format!("{name}[{i}]"), from, slot.at + i, None)?;
                        }
                    }
                    len => add(name, from, slot.at, len)?,
                }
            }
        }
        if asked.outputs {
            for (at, output) in self.info.outputs.iter().enumerate() {
                add(output.name.to_owned(), &table.outputs, at, None)?;
            }
        }
        if asked.multipliers {
            for (at, row) in self.info.rows.iter().enumerate() {
                add(format!("lambda[{}]", row.name), &table.multipliers, at, None)?;
            }
        }
        if asked.energy {
            columns.push(("energy".to_owned(), arrays::vector(py, table.energy.clone())));
        }
        Ok(columns)
    }

    /// The table that `to_numpy` and `to_pandas` make arrays of, and what it holds.
    fn asked(
        &self,
        py: Python<'_>,
        times: Option<&Bound<'_, PyAny>>,
        accelerations: bool,
        multipliers: bool,
    ) -> PyResult<(Table, Columns)> {
        let times = match times {
            None => Times::OfRun,
            Some(times) => Times::These(arrays::times("times", times)?),
        };
        let outputs = !self.info.outputs.is_empty();
        let columns = Columns { outputs, accelerations, multipliers, energy: true };
        Ok((self.table(py, times, columns)?, columns))
    }

    fn write_as(&self, py: Python<'_>, what: File, path: PathBuf) -> PyResult<()> {
        self.read(py, |motion, interruption| motion.write(what, &path, interruption))?
            .map_err(PyValueError::new_err)
    }
}

#[pymethods]
impl Motion {
    /// The model that moved. It has the parameters that it had then.
    #[getter]
    fn model<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.class.bind(py).call((), Some(self.parameters.bind(py)))
    }

    /// The times of the run's output, or of its accepted steps.
    #[getter]
    fn t<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(arrays::vector(py, self.table(py, Times::OfRun, Columns::default())?.t))
    }

    /// Generalized coordinates over `t`, by rows.
    #[getter]
    fn q<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::matrix(py, self.table(py, Times::OfRun, Columns::default())?.q)
    }

    /// Generalized velocities over `t`, by rows.
    #[getter]
    fn u<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::matrix(py, self.table(py, Times::OfRun, Columns::default())?.u)
    }

    /// The energy function q̇·∂L/∂q̇ − L over `t`.
    #[getter]
    fn energy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let columns = Columns { energy: true, ..Columns::default() };
        Ok(arrays::vector(py, self.table(py, Times::OfRun, columns)?.energy))
    }

    /// The state at the start.
    #[getter]
    fn start(&self, py: Python<'_>) -> PyResult<State> {
        Ok(State::new(&self.info, self.read(py, |motion, interruption| motion.start(interruption))?))
    }

    /// The state at the end.
    #[getter]
    fn end(&self, py: Python<'_>) -> PyResult<State> {
        Ok(State::new(&self.info, self.read(py, |motion, interruption| motion.end(interruption))?))
    }

    /// Start and end of the motion.
    #[getter]
    fn interval(&self) -> (f64, f64) {
        self.motion.interval()
    }

    /// The state at a time, from the method's dense output; for an array of times a dictionary of arrays, as
    /// `to_numpy` gives it. A time outside of the motion is a ValueError.
    fn at<'py>(&self, py: Python<'py>, t: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let Ok(t) = t.extract::<f64>() else {
            return self.to_numpy(py, Some(t), "dict", false, false);
        };
        let state = self.read(py, |motion, interruption| motion.at(t, interruption))?;
        let state = state.map_err(PyValueError::new_err)?;
        Ok(Bound::new(py, State::new(&self.info, state))?.into_any())
    }

    /// A coordinate, rate, input or output over times: `t`, where none are given.
    #[pyo3(signature = (name, times=None))]
    fn get<'py>(
        &self,
        py: Python<'py>,
        name: &str,
        times: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let times = match times {
            None => Times::OfRun,
            Some(times) => Times::These(arrays::times("times", times)?),
        };
        self.named(py, name, times)?.ok_or_else(|| {
            PyKeyError::new_err(format!("{} has no `{name}`; it has {}", self.info.name, self.names()))
        })
    }

    /// The multipliers of a constraint over times, by rows of the constraint: the force that pushes toward
    /// growing Φ.
    #[pyo3(signature = (constraint, times=None))]
    fn reaction<'py>(
        &self,
        py: Python<'py>,
        constraint: &str,
        times: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let of_it = |row: &str| {
            row.strip_prefix(constraint).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
        };
        let Some(at) = self.info.rows.iter().position(|row| of_it(row.name)) else {
            let names: Vec<&str> = self.info.constraints.iter().map(|(name, _)| *name).collect();
            let names = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
            return Err(PyKeyError::new_err(format!(
                "{} has no constraint `{constraint}`; its constraints are {names}",
                self.info.name
            )));
        };
        let len = self.info.rows[at..].iter().take_while(|row| of_it(row.name)).count();
        let alone = len == 1 && self.info.rows[at].name == constraint;
        let (table, _) = self.asked(py, times, false, true)?;
        arrays::columns(py, &table.multipliers, at, (!alone).then_some(len))
    }

    /// All columns as arrays of NumPy: t, coordinates, rates, inputs, outputs, energy; on request
    /// accelerations and multipliers (`lambda[closure.x]`).
    ///
    /// times: where, instead of `t`. form: "dict" (arrays by name; an array coordinate has one row per time),
    /// "structured" (one structured array) or "matrix" (two dimensions, in the order of `columns`).
    #[pyo3(signature = (times=None, *, form="dict", accelerations=false, multipliers=false))]
    fn to_numpy<'py>(
        &self,
        py: Python<'py>,
        times: Option<&Bound<'py, PyAny>>,
        form: &str,
        accelerations: bool,
        multipliers: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        if !["dict", "structured", "matrix"].contains(&form) {
            return Err(PyValueError::new_err(format!(
                "form: `{form}` is not known; give \"dict\", \"structured\" or \"matrix\""
            )));
        }
        let (table, asked) = self.asked(py, times, accelerations, multipliers)?;
        let columns = self.columns_of(py, &table, (asked, form == "matrix"))?;
        let numpy = py.import("numpy")?;
        match form {
            "structured" => structured(py, &columns, table.t.len()),
            "matrix" => {
                let arrays: Vec<Bound<'py, PyAny>> = columns.into_iter().map(|(_, array)| array).collect();
                numpy.call_method1("column_stack", (arrays,))
            }
            _ => {
                let dict = PyDict::new(py);
                columns.into_iter().try_for_each(|(name, array)| dict.set_item(name, array))?;
                Ok(dict.into_any())
            }
        }
    }

    /// Names of the columns of `to_numpy(form="matrix")` and of `to_pandas()`.
    #[getter]
    fn columns(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        let start = PyList::new(py, [self.interval().0])?;
        let (table, asked) = self.asked(py, Some(start.as_any()), false, false)?;
        Ok(self.columns_of(py, &table, (asked, true))?.into_iter().map(|(name, _)| name).collect())
    }

    /// A DataFrame of pandas with the times as its index; array coordinates as `theta[0]`, `theta[1]`, ….
    #[pyo3(signature = (times=None, *, accelerations=false, multipliers=false))]
    fn to_pandas<'py>(
        &self,
        py: Python<'py>,
        times: Option<&Bound<'py, PyAny>>,
        accelerations: bool,
        multipliers: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let pandas = py.import("pandas")?;
        let (table, asked) = self.asked(py, times, accelerations, multipliers)?;
        let columns = PyDict::new(py);
        for (name, array) in self.columns_of(py, &table, (asked, true))? {
            columns.set_item(name, array)?;
        }
        pandas.call_method1("DataFrame", (columns,))?.call_method1("set_index", ("t",))
    }

    /// The events that happened, in order.
    #[getter]
    fn events(&self, py: Python<'_>) -> PyResult<Vec<Event>> {
        let events = self.read(py, |motion, interruption| motion.events(interruption))?;
        Ok(events.into_iter().map(|data| Event { info: Arc::clone(&self.info), data }).collect())
    }

    /// What the run cost and found. It repeats no step.
    #[getter]
    fn summary(&self, py: Python<'_>) -> PyResult<Summary> {
        Ok(Summary { data: self.read(py, |motion, interruption| motion.summary(false, interruption))? })
    }

    /// The summary with all checks that repeat the motion: its global error, works of forces, singular
    /// positions. It costs three to five times as much as the run, and Ctrl-C does not end it.
    fn verify(&self, py: Python<'_>) -> PyResult<Summary> {
        Ok(Summary { data: self.read(py, |motion, interruption| motion.summary(true, interruption))? })
    }

    /// Writes the motion as one page, `.html`, that plays in any browser.
    fn animate(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        self.write_as(py, File::Page, path)
    }

    /// Writes a table, `.csv`.
    fn write_csv(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        self.write_as(py, File::Table, path)
    }

    /// Writes a chart of coordinates and velocities, `.svg`; `what="outputs"` or `"energy"` of those.
    #[pyo3(signature = (path, what="coordinates"))]
    fn plot(&self, py: Python<'_>, path: PathBuf, what: &str) -> PyResult<()> {
        let what = match what {
            "coordinates" => File::History,
            "outputs" => File::Outputs,
            "energy" => File::Energy,
            _ => {
                return Err(PyValueError::new_err(format!(
                    "what: `{what}` is not known; give \"coordinates\", \"outputs\" or \"energy\""
                )));
            }
        };
        self.write_as(py, what, path)
    }

    /// A live page that simulates the model from this start, with the contacts and stops of the run.
    fn live(&self, py: Python<'_>) -> PyResult<LivePage> {
        let html = self.read(py, |motion, interruption| motion.live(interruption))?;
        Ok(LivePage::new(html.map_err(PyValueError::new_err)?, HEIGHT))
    }

    /// In a notebook the motion plays.
    fn _repr_html_(&self, py: Python<'_>) -> PyResult<Option<String>> {
        let page = self.read(py, |motion, interruption| motion.page(interruption))?;
        Ok(page.ok().map(|page| framed(&page, HEIGHT)))
    }

    fn __getattr__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        // What Python and notebooks look for on every object.
        if !name.starts_with('_')
            && let Some(found) = self.named(py, name, Times::OfRun)?
        {
            return Ok(found);
        }
        let (model, names) = (self.info.name, self.names());
        Err(PyAttributeError::new_err(format!("a motion of {model} has no `{name}`; it has {names}")))
    }

    fn __getitem__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        self.get(py, name, None)
    }

    fn __dir__(slf: &Bound<'_, Self>) -> PyResult<Vec<String>> {
        let info = &slf.get().info;
        let own: Vec<String> = slf.get_type().dir()?.extract()?;
        let names =
            info.coordinates.iter().flat_map(|slot| [slot.name.clone(), format!("{}_rate", slot.name)]);
        let inputs = info.inputs.iter().map(|slot| slot.name.clone());
        Ok(own.into_iter().chain(names).chain(inputs).chain(info.output_names()).collect())
    }

    /// It does not change.
    fn __copy__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    fn __deepcopy__<'py>(slf: Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf
    }

    /// Functions of Python that the run calls may refer to the motion.
    fn __traverse__(&self, visit: PyVisit<'_>) -> Result<(), PyTraverseError> {
        visit.call(&self.class)?;
        visit.call(&self.parameters)?;
        self.motion.callbacks().functions().try_for_each(|function| visit.call(function))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyType>, Bound<'py, PyTuple>)> {
        if self.is_partial {
            // An exception with a motion crosses to another process, and has None there.
            return Ok((py.None().bind(py).get_type(), PyTuple::empty(py)));
        }
        Err(PyTypeError::new_err(
            "a Motion is not pickled: it keeps the steps of a run. Send what is needed of it, as \
             motion.to_numpy() or motion.end, or the model and its start, and simulate again",
        ))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let ((from, to), summary) = (self.interval(), self.summary(py)?);
        let (name, steps) = (self.info.name, summary.data.steps);
        Ok(format!(
            "<motion of {name} from t = {from} to {to} in {steps} steps; print(motion.summary) says more>"
        ))
    }
}

/// One structured array of several.
fn structured<'py>(
    py: Python<'py>,
    columns: &[(String, Bound<'py, PyAny>)],
    rows: usize,
) -> PyResult<Bound<'py, PyAny>> {
    let fields = PyList::empty(py);
    for (name, array) in columns {
        let shape: Vec<usize> = array.getattr("shape")?.extract()?;
        match shape[..] {
            [_, len] => fields.append((name, "f8", (len,)))?,
            _ => fields.append((name, "f8"))?,
        }
    }
    let all = py.import("numpy")?.call_method1("empty", (rows, fields))?;
    columns.iter().try_for_each(|(name, array)| all.set_item(name, array))?;
    Ok(all)
}

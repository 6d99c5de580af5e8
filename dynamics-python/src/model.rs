//! `Model`: the base of the classes of all models.

use std::sync::{Arc, RwLock};

use pyo3::exceptions::{PyAttributeError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple, PyType};

use dynamics::model::ActiveSet;

use crate::arrays::{self, Rows};
use crate::data::{Evaluation, StateData};
use crate::erased::{AnyClass, AnyModel, LiveOptions, States};
use crate::errors;
use crate::info::Info;
use crate::law::{Interruption, Signals};
use crate::linear::{Equilibrium, Linearization};
use crate::live::LivePage;
use crate::motion::Motion;
use crate::options::{self, Callbacks, Options};
use crate::start::{self, given_state};
use crate::state::State;

/// Name of the attribute of a class that holds its model's class in Rust.
pub(crate) const CLASS: &str = "_dynamics_class";

/// The class of a model in Rust, as an attribute of the class in Python.
#[pyclass(frozen, module = "dynamics")]
pub(crate) struct ClassOfModel {
    pub(crate) class: Arc<dyn AnyClass>,
}

impl std::fmt::Debug for ClassOfModel {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ClassOfModel").field("name", &self.class.info().name).finish()
    }
}

/// What changes where a parameter is set.
struct Values {
    model: Arc<dyn AnyModel>,
    /// What the attributes show.
    shown: Py<PyDict>,
}

/// The base of the classes of all models.
#[pyclass(subclass, frozen, module = "dynamics")]
pub struct Model {
    pub(crate) info: Arc<Info>,
    values: RwLock<Values>,
}

impl std::fmt::Debug for Model {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Model").field("name", &self.info.name).finish_non_exhaustive()
    }
}

impl Model {
    /// The model as it is now. Runs and motions keep it, whatever is set later.
    fn model(&self) -> Arc<dyn AnyModel> {
        Arc::clone(&self.values.read().unwrap_or_else(|poisoned| poisoned.into_inner()).model)
    }

    /// The model as it is now, and what its attributes show.
    fn now(&self, py: Python<'_>) -> (Arc<dyn AnyModel>, Py<PyDict>) {
        let values = self.values.read().unwrap_or_else(|poisoned| poisoned.into_inner());
        (Arc::clone(&values.model), values.shown.clone_ref(py))
    }

    /// Names and values of the parameters, in order.
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        // Not within the lock: making a dictionary may collect garbage, which may run any code of Python.
        self.now(py).1.bind(py).copy()
    }

    /// The parameter with this name.
    pub(crate) fn parameter<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        self.parameters(py)?.get_item(name)?.ok_or_else(|| PyAttributeError::new_err(name.to_owned()))
    }

    fn own<'a, 'py>(&self, given: &'a Bound<'py, State>) -> PyResult<&'a StateData> {
        match Arc::ptr_eq(&given.get().info, &self.info) {
            true => Ok(&given.get().data),
            false => Err(PyTypeError::new_err(format!(
                "a state of {} is given to {}; make one with its own state(..)",
                given.get().info.name,
                self.info.name
            ))),
        }
    }

    /// Evaluates at the states of these arguments.
    fn evaluate<'py>(
        &self,
        py: Python<'py>,
        what: Evaluation,
        at: &At<'_, 'py>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (states, count) = at.states(&self.info)?;
        let model = self.model();
        // One state takes less time than to let go of the lock.
        let evaluated = match count {
            None => model.evaluate(what, &states),
            Some(_) => py.detach(|| model.evaluate(what, &states)),
        };
        let (values, shape) = evaluated.map_err(|text| errors::raised(py, "EvaluationError", text))?;
        let unknown = |values: &[f64]| values.iter().any(|value| value.is_nan());
        if unknown(&states.inputs.values) && unknown(&values) {
            let names: Vec<String> = self.info.inputs.iter().map(|slot| slot.shown()).collect();
            return Err(PyTypeError::new_err(format!("{what:?} need inputs: give {}", names.join(", "))));
        }
        let shape: Vec<usize> = count.into_iter().chain(shape).collect();
        arrays::shaped(py, values, &shape)
    }
}

/// Where a model is evaluated: a state, or q, q̇, t and inputs, each for one state or by rows.
struct At<'a, 'py> {
    q: &'a Bound<'py, PyAny>,
    u: Option<&'a Bound<'py, PyAny>>,
    t: Option<&'a Bound<'py, PyAny>>,
    inputs: Option<&'a Bound<'py, PyAny>>,
    release: Option<&'a Bound<'py, PyAny>>,
}

impl At<'_, '_> {
    /// The states, and how many, where some argument has rows.
    fn states(&self, info: &Info) -> PyResult<(States, Option<usize>)> {
        let n = info.scalars.coordinates.len();
        let same = |values: Vec<f64>| Rows { values, count: None };
        if let Ok(state) = self.q.cast::<State>() {
            let data = &state.get().data;
            if !std::ptr::eq(&*state.get().info, info)
                || self.u.is_some()
                || self.t.is_some()
                || self.release.is_some()
            {
                return Err(PyTypeError::new_err(format!(
                    "give a state of {} alone, or with inputs; or q, u, t, inputs and release",
                    info.name
                )));
            }
            let [q, u] = [&data.q, &data.u].map(|values| same(values.clone()));
            let inputs = match self.inputs {
                None => same(data.inputs.clone()),
                Some(_) => self.inputs(info)?,
            };
            let (count, active_set) = (inputs.count, data.active_set);
            let t = same(vec![data.t]);
            // Its constraints were released to their sides when it was made.
            let sided = u32::MAX;
            return Ok((States { count: count.unwrap_or(1), active_set, sided, q, u, inputs, t }, count));
        }
        let q = Rows::read("q", n, self.q)?;
        let u = self.u.map_or(Ok(same(vec![0.0; n])), |u| Rows::read("u", n, u))?;
        let t = match self.t {
            None => same(vec![0.0]),
            Some(t) => {
                let values = arrays::times("t", t)?;
                let count = t.extract::<f64>().is_err().then_some(values.len());
                Rows { values, count }
            }
        };
        let inputs = self.inputs(info)?;
        let release = self.release.map(|names| start::released(info, names)).transpose()?;
        let (active_set, sided) = release.unwrap_or((ActiveSet::ALL_HOLD, 0));
        let mut count = None;
        for (name, rows) in [("q", q.count), ("u", u.count), ("t", t.count), ("inputs", inputs.count)] {
            match (count, rows) {
                (Some((first, a)), Some(b)) if a != b => {
                    return Err(PyValueError::new_err(format!("{first} has {a} rows, {name} has {b}")));
                }
                (None, Some(rows)) => count = Some((name, rows)),
                _ => {}
            }
        }
        let count = count.map(|(_, rows)| rows);
        Ok((States { count: count.unwrap_or(1), active_set, sided, q, u, inputs, t }, count))
    }

    /// The inputs: for all states or by rows, or constant ones by name.
    fn inputs(&self, info: &Info) -> PyResult<Rows> {
        let m = info.scalars.inputs.len();
        match self.inputs {
            None => Ok(Rows { values: vec![f64::NAN; m], count: None }),
            // Where there are no inputs, this says so.
            Some(given) if m == 0 || options::entries(given).is_some() => {
                Ok(Rows { values: options::inputs(info, given)?, count: None })
            }
            Some(given) => Rows::read("inputs", m, given),
        }
    }
}

#[pymethods]
impl Model {
    #[new]
    #[classmethod]
    #[pyo3(signature = (*args, **parameters))]
    fn new(
        cls: &Bound<'_, PyType>,
        args: &Bound<'_, PyTuple>,
        parameters: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let py = cls.py();
        let Ok(class) = cls.getattr(CLASS) else {
            return Err(PyTypeError::new_err(
                "Model is the base of the classes of models; make one of those",
            ));
        };
        let class = Arc::clone(&class.cast_into::<ClassOfModel>()?.get().class);
        let info = Arc::clone(class.info());
        if !args.is_empty() {
            return Err(PyTypeError::new_err(format!(
                "{} takes its parameters by name: {}",
                info.name,
                info.field_names()
            )));
        }
        let none = PyDict::new(py);
        let (model, shown) = class.construct(parameters.unwrap_or(&none))?;
        Ok(Self { info, values: RwLock::new(Values { model, shown: shown.unbind() }) })
    }

    /// Names and values of the parameters.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.parameters(py)
    }

    /// Another model with some parameters changed.
    #[pyo3(signature = (**parameters))]
    fn replace<'py>(
        slf: &Bound<'py, Self>,
        parameters: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let all = slf.get().parameters(slf.py())?;
        if let Some(parameters) = parameters {
            all.update(parameters.as_mapping())?;
        }
        slf.get_type().call((), Some(&all))
    }

    /// A state by name: coordinates (`theta=0.1`), rates (`theta_rate=2.0`), inputs, generalized speeds; what
    /// is not given is 0, an input that is not given is NaN.
    ///
    /// assemble: solve what is not given from the constraints, positions from their guesses
    /// (`theta_guess=0.1`). release: names of switched constraints that do not hold, or {name: side}.
    #[pyo3(signature = (*, t=0.0, assemble=false, release=None, **values))]
    fn state(
        &self,
        py: Python<'_>,
        t: f64,
        assemble: bool,
        release: Option<&Bound<'_, PyAny>>,
        values: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<State> {
        let given = given_state(&self.info, t, assemble, release, values)?;
        let state = self.model().state(&given).map_err(|text| errors::raised(py, "StateError", text))?;
        Ok(State::new(&self.info, state))
    }

    /// Runs a simulation from a start.
    ///
    /// until: the end time. tolerance: permitted error of a step, 1e-9 where it is not given. method: a name
    /// ("dop853", "radau5", "taylor", ..), or a name and its option. inputs: constant values, or a function
    /// of time and state that returns them. events: {name: function of the state}; their zeros are located.
    /// on_event: {name of an event: function of the state that returns a changed state, "stop" or None}.
    /// stop_at: the event that ends the run. contact: {switched constraint: restitution}. stick_slip:
    /// {switched constraint: event}. times, every: where `motion.t` is; the accepted steps without them.
    ///
    /// Python's lock is free while it runs. Ctrl-C ends the run. A run that fails raises SimulationError,
    /// whose `partial` is the motion up to there.
    #[pyo3(signature = (start, *, until, tolerance=None, tolerances=None, method=None, fixed_step=None,
        first_step=None, max_step=None, max_steps=None, times=None, every=None, inputs=None, events=None,
        on_event=None, stop_at=None, contact=None, stick_slip=None, formulation=None, drift_limit=None,
        consistent_output=false, estimate_error=false))]
    #[allow(clippy::too_many_arguments)]
    fn simulate<'py>(
        slf: &Bound<'py, Self>,
        start: &Bound<'py, State>,
        until: f64,
        tolerance: Option<f64>,
        tolerances: Option<(f64, f64)>,
        method: Option<&Bound<'py, PyAny>>,
        fixed_step: Option<f64>,
        first_step: Option<f64>,
        max_step: Option<f64>,
        max_steps: Option<u64>,
        times: Option<&Bound<'py, PyAny>>,
        every: Option<f64>,
        inputs: Option<&Bound<'py, PyAny>>,
        events: Option<&Bound<'py, PyAny>>,
        on_event: Option<&Bound<'py, PyAny>>,
        stop_at: Option<&Bound<'py, PyAny>>,
        contact: Option<&Bound<'py, PyAny>>,
        stick_slip: Option<&Bound<'py, PyAny>>,
        formulation: Option<&Bound<'py, PyAny>>,
        drift_limit: Option<f64>,
        consistent_output: bool,
        estimate_error: bool,
    ) -> PyResult<Motion> {
        options::one_of(("tolerance", tolerance.is_some()), ("tolerances", tolerances.is_some()))?;
        options::one_of(("times", times.is_some()), ("every", every.is_some()))?;
        let options = Options {
            until,
            tolerance,
            tolerances,
            method: method.map(options::method).transpose()?,
            fixed_step,
            first_step,
            max_step,
            max_steps,
            times: times.map(|times| arrays::times("times", times)).transpose()?,
            every,
            contacts: contact.map(options::contacts).transpose()?.unwrap_or_default(),
            stick_slips: stick_slip.map(options::stick_slips).transpose()?.unwrap_or_default(),
            stops: stop_at.map(options::stops).transpose()?.unwrap_or_default(),
            formulation: formulation.map(options::formulation).transpose()?,
            drift_limit,
            consistent_output,
            estimate_error,
        };
        let callbacks = Callbacks {
            inputs: inputs.filter(|inputs| inputs.is_callable()).map(|inputs| inputs.clone().unbind()),
            events: events.map(options::events).transpose()?.unwrap_or_default(),
            actions: on_event.map(options::actions).transpose()?.unwrap_or_default(),
        };
        let model = slf.get();
        let mut from = model.own(start)?.clone();
        if let Some(constant) = inputs.filter(|inputs| !inputs.is_callable()) {
            from.inputs = options::inputs(&model.info, constant)?;
        }
        if callbacks.inputs.is_some() && model.info.inputs.is_empty() {
            return Err(PyTypeError::new_err(format!("inputs: {} has no inputs", model.info.name)));
        }
        run(slf, &from, &options, callbacks)
    }

    /// q̈ at states: `accelerations(state)`, or q and q̇ as arrays, for one state or by rows, with Python's
    /// lock free.
    ///
    /// inputs: instead of those of a state; an array, or a dictionary by name. release: switched constraints
    /// that do not hold, as `state(..)` takes them; a state has its own.
    #[pyo3(signature = (q, u=None, t=None, inputs=None, *, release=None))]
    fn accelerations<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        u: Option<&Bound<'py, PyAny>>,
        t: Option<&Bound<'py, PyAny>>,
        inputs: Option<&Bound<'py, PyAny>>,
        release: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.evaluate(py, Evaluation::Accelerations, &At { q, u, t, inputs, release })
    }

    /// The mass matrix M(q,t), N×N, as `accelerations` takes its arguments.
    #[pyo3(signature = (q, t=None, inputs=None, *, release=None))]
    fn mass_matrix<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        t: Option<&Bound<'py, PyAny>>,
        inputs: Option<&Bound<'py, PyAny>>,
        release: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.evaluate(py, Evaluation::MassMatrix, &At { q, u: None, t, inputs, release })
    }

    /// Other quantities at states, as `accelerations` takes its arguments: "generalized_force", "momenta",
    /// "energy", "conserved", "outputs", "multipliers", "residual", "velocity_residual", "jacobian",
    /// "derivatives" (∂q̈/∂q and ∂q̈/∂q̇), "accelerations", "mass_matrix".
    #[pyo3(signature = (what, q, u=None, t=None, inputs=None, *, release=None), name = "evaluate")]
    #[allow(clippy::too_many_arguments)]
    fn evaluate_named<'py>(
        &self,
        py: Python<'py>,
        what: &str,
        q: &Bound<'py, PyAny>,
        u: Option<&Bound<'py, PyAny>>,
        t: Option<&Bound<'py, PyAny>>,
        inputs: Option<&Bound<'py, PyAny>>,
        release: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let Some((_, evaluation)) = EVALUATIONS.iter().find(|(name, _)| *name == what) else {
            let names: Vec<&str> = EVALUATIONS.iter().map(|(name, _)| *name).collect();
            return Err(PyValueError::new_err(format!(
                "`{what}` is not known; give one of {}",
                names.join(", ")
            )));
        };
        self.evaluate(py, *evaluation, &At { q, u, t, inputs, release })
    }

    /// The equilibrium near a state, with a verdict on its stability.
    fn equilibrium(&self, py: Python<'_>, near: &Bound<'_, State>) -> PyResult<Equilibrium> {
        let (model, near) = (self.model(), self.own(near)?);
        let found = py.detach(|| model.equilibrium(near));
        let (state, text, stability) = found.map_err(|text| errors::raised(py, "EvaluationError", text))?;
        Ok(Equilibrium { state: State::new(&self.info, state).into_pyobject(py)?.unbind(), text, stability })
    }

    /// The linear equations of small motions about a state: mass, damping, stiffness, and the modes.
    fn linearize(&self, py: Python<'_>, at: &Bound<'_, State>) -> PyResult<Linearization> {
        let (model, at) = (self.model(), self.own(at)?);
        let data = py.detach(|| model.linearize(at));
        Ok(Linearization { data: data.map_err(|text| errors::raised(py, "EvaluationError", text))? })
    }

    /// A page that simulates this model from a start, in the browser, and in the cell of a notebook.
    ///
    /// title: instead of the model's name. ranges: ends of sliders, {parameter: (from, to)}. hold: parameters
    /// without a slider. plot: names that are plotted. phase: the coordinate of the phase plane.
    #[pyo3(signature = (start, *, title=None, ranges=None, hold=None, plot=None, phase=None, tolerance=None,
        until=None, contact=None, stick_slip=None, stop_at=None, height=640))]
    #[allow(clippy::too_many_arguments)]
    fn live(
        &self,
        start: &Bound<'_, State>,
        title: Option<String>,
        ranges: Option<&Bound<'_, PyAny>>,
        hold: Option<Vec<String>>,
        plot: Option<Vec<String>>,
        phase: Option<String>,
        tolerance: Option<f64>,
        until: Option<f64>,
        contact: Option<&Bound<'_, PyAny>>,
        stick_slip: Option<&Bound<'_, PyAny>>,
        stop_at: Option<&Bound<'_, PyAny>>,
        height: u32,
    ) -> PyResult<LivePage> {
        let run = Options {
            contacts: contact.map(options::contacts).transpose()?.unwrap_or_default(),
            stick_slips: stick_slip.map(options::stick_slips).transpose()?.unwrap_or_default(),
            stops: stop_at.map(options::stops).transpose()?.unwrap_or_default(),
            ..Options::default()
        };
        let options = LiveOptions {
            title,
            ranges: ranges.map(options::ranges).transpose()?.unwrap_or_default(),
            hold: hold.unwrap_or_default(),
            plots: plot.unwrap_or_default(),
            phase,
            tolerance,
            until,
            run,
        };
        let html = self.model().live(self.own(start)?, &options).map_err(PyValueError::new_err)?;
        Ok(LivePage::new(html, height))
    }

    /// In a notebook the model shows its equations.
    fn _repr_latex_(&self) -> String {
        self.info.latex.trim().to_owned()
    }

    fn __setattr__(slf: &Bound<'_, Self>, name: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
        let (py, model) = (slf.py(), slf.get());
        if model.info.fields.iter().all(|field| field.name != name) {
            return Err(PyAttributeError::new_err(format!(
                "{} has no parameter `{name}`; its parameters are {}",
                model.info.name,
                model.info.field_names()
            )));
        }
        let mut value = value.clone();
        loop {
            // Read together: the conversion may run code of Python, and another thread may set a parameter.
            let (before, shown) = model.now(py);
            let (changed, shown_value) = before.with_field(name, &value)?;
            // A new dictionary: copies of the old one may be in use.
            let all = shown.bind(py).copy()?;
            all.set_item(name, &shown_value)?;
            let values = Values { model: changed, shown: all.unbind() };
            // What is replaced is dropped after the lock.
            let replaced = {
                let mut now = model.values.write().unwrap_or_else(|poisoned| poisoned.into_inner());
                if Arc::ptr_eq(&now.model, &before) {
                    Some(std::mem::replace(&mut *now, values))
                } else {
                    None
                }
            };
            if replaced.is_some() {
                return Ok(());
            }
            // Something else was set in between. What was converted is not converted again.
            value = shown_value;
        }
    }

    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
        Ok((PyTuple::empty(py), self.parameters(py)?))
    }

    /// A state out of its parts, as a pickled one has them: names, so that a program with another order of
    /// the coordinates does not mix them up.
    #[classmethod]
    fn _state_of(
        cls: &Bound<'_, PyType>,
        t: f64,
        values: &Bound<'_, PyDict>,
        release: &Bound<'_, PyDict>,
    ) -> PyResult<State> {
        let class = cls.getattr(CLASS)?.cast_into::<ClassOfModel>()?;
        let info = class.get().class.info();
        let rates = info.coordinates.iter().map(|slot| format!("{}_rate", slot.name));
        let slots = info.coordinates.iter().chain(&info.inputs);
        let names: Vec<String> = slots.map(|slot| slot.name.clone()).chain(rates).collect();
        let given: Vec<String> = values.keys().extract()?;
        if given.len() != names.len() || given.iter().any(|name| !names.contains(name)) {
            let (given, names) = (given.join(", "), names.join(", "));
            return Err(PyValueError::new_err(format!(
                "this was not pickled from a state of this {}: it has {given}; the model has {names}",
                info.name
            )));
        }
        Ok(State::new(info, given_state(info, t, false, Some(release.as_any()), Some(values))?.state))
    }

    fn __eq__(slf: &Bound<'_, Self>, other: &Bound<'_, PyAny>) -> PyResult<bool> {
        let Ok(other) = other.cast::<Self>() else { return Ok(false) };
        if !slf.get_type().is(other.get_type()) {
            return Ok(false);
        }
        let [all, others] = [slf.get().parameters(slf.py())?, other.get().parameters(slf.py())?];
        same(all.as_any(), others.as_any())
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let mut parts = Vec::new();
        for (name, value) in self.parameters(py)?.iter() {
            let value = value.call_method0("tolist").unwrap_or(value);
            parts.push(format!("{name}={}", value.repr()?));
        }
        Ok(format!("{}({})", self.info.name, parts.join(", ")))
    }
}

/// Whether two values are equal, arrays by their elements, within tuples, lists and dictionaries, too.
fn same(one: &Bound<'_, PyAny>, other: &Bound<'_, PyAny>) -> PyResult<bool> {
    if let (Ok(one), Ok(other)) = (one.cast::<PyDict>(), other.cast::<PyDict>()) {
        let of = |(key, value): (Bound<'_, PyAny>, Bound<'_, PyAny>)| match other.get_item(key)? {
            Some(of_other) => same(&value, &of_other),
            None => Ok(false),
        };
        return all(one.len() == other.len(), one.iter().map(of));
    }
    if let (Ok(one), Ok(other)) = (one.cast::<PyTuple>(), other.cast::<PyTuple>()) {
        return all(one.len() == other.len(), one.iter().zip(other).map(|(one, other)| same(&one, &other)));
    }
    if let (Ok(one), Ok(other)) = (one.cast::<PyList>(), other.cast::<PyList>()) {
        return all(one.len() == other.len(), one.iter().zip(other).map(|(one, other)| same(&one, &other)));
    }
    one.py().import("numpy")?.call_method1("array_equal", (one, other))?.is_truthy()
}

/// Whether all hold; the first error counts.
fn all(first: bool, mut rest: impl Iterator<Item = PyResult<bool>>) -> PyResult<bool> {
    if !first {
        return Ok(false);
    }
    rest.find(|one| !matches!(one, Ok(true))).unwrap_or(Ok(true))
}

/// Names of what can be evaluated.
pub(crate) const EVALUATIONS: &[(&str, Evaluation)] = &[
    ("accelerations", Evaluation::Accelerations),
    ("mass_matrix", Evaluation::MassMatrix),
    ("generalized_force", Evaluation::GeneralizedForce),
    ("momenta", Evaluation::Momenta),
    ("energy", Evaluation::Energy),
    ("conserved", Evaluation::Conserved),
    ("outputs", Evaluation::Outputs),
    ("multipliers", Evaluation::Multipliers),
    ("residual", Evaluation::Residual),
    ("velocity_residual", Evaluation::VelocityResidual),
    ("jacobian", Evaluation::Jacobian),
    ("derivatives", Evaluation::Derivatives),
];

/// Runs, and raises what has to be raised.
fn run(
    slf: &Bound<'_, Model>,
    start: &StateData,
    options: &Options,
    callbacks: Callbacks,
) -> PyResult<Motion> {
    let (py, model) = (slf.py(), slf.get());
    let (interruption, callbacks) = (Interruption::default(), Arc::new(callbacks));
    // Read together: another thread may set a parameter.
    let (running, parameters) = model.now(py);
    let signals = Signals::of_this_thread(py)?;
    let (motion, failure) =
        py.detach(|| running.simulate(start, options, callbacks, &interruption, &signals));
    let (info, class) = (Arc::clone(&model.info), slf.get_type().unbind());
    let motion = motion.map(|motion| Motion { info, motion, class, parameters, is_partial: false });
    if let Some(error) = interruption.take() {
        // A `KeyboardInterrupt`, or what a function of Python raised, with what was computed up to there.
        if let Some(motion) = motion {
            // An exception without room for it arrives as it is.
            let _ = error.value(py).setattr("partial", Motion { is_partial: true, ..motion });
        }
        return Err(error);
    }
    match (motion, failure) {
        (Some(motion), None) => Ok(motion),
        (_, Some(failure)) if failure.is_option => Err(PyValueError::new_err(failure.text)),
        // As `state(..)` raises it: `replace(..)` of a state does not check the constraints.
        (_, Some(failure)) if failure.kind == "Start" => Err(errors::raised(py, "StateError", failure.text)),
        (motion, Some(failure)) => {
            let state = State::new(&model.info, failure.state.clone()).into_pyobject(py)?;
            let partial = motion.map(|motion| Motion { is_partial: true, ..motion });
            Err(errors::simulation(py, failure, state.into_any(), partial)?)
        }
        (None, None) => Err(errors::raised(py, "EvaluationError", "the motion has no constants".to_owned())),
    }
}

//! `Summary`: what a run cost and found, and `Event`: what happened on the way.

use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::data::EventData;
use crate::info::Info;
use crate::state::State;

/// What a run cost and found. `print(motion.summary)` shows all of it.
#[pyclass(frozen, module = "dynamics")]
#[derive(Debug)]
pub struct Summary {
    pub(crate) data: dynamics::simulate::Summary,
}

#[pymethods]
impl Summary {
    /// Name of the model.
    #[getter]
    fn model(&self) -> &'static str {
        self.data.model
    }

    /// Whether it is that of `motion.verify()`, which repeats the motion.
    #[getter]
    fn verified(&self) -> bool {
        self.data.verified
    }

    /// Start and end of the motion.
    #[getter]
    fn interval(&self) -> (f64, f64) {
        self.data.interval
    }

    /// The method.
    #[getter]
    fn method(&self) -> String {
        self.data.method.to_string()
    }

    /// Why this method.
    #[getter]
    fn reason(&self) -> &str {
        &self.data.reason
    }

    /// When the run changed its method because the motion was stiff, and to which; None where it did not.
    #[getter]
    fn switched(&self) -> Option<(f64, String)> {
        self.data.switched.map(|(t, method)| (t, method.to_string()))
    }

    /// Accepted steps.
    #[getter]
    fn steps(&self) -> u64 {
        self.data.steps
    }

    /// Rejected steps.
    #[getter]
    fn rejected(&self) -> u64 {
        self.data.rejected
    }

    /// Evaluations of the accelerations.
    #[getter]
    fn evaluations(&self) -> u64 {
        self.data.evaluations
    }

    /// Time that the run took, in seconds.
    #[getter]
    fn wall_time(&self) -> Option<f64> {
        self.data.wall_time.map(|time| time.as_secs_f64())
    }

    /// Largest change of the energy less the work of forces, relative to `energy_scale`. NaN where the work
    /// is not known; `motion.verify()` integrates it.
    #[getter]
    fn energy_drift(&self) -> f64 {
        self.data.energy_drift
    }

    /// The largest energy met.
    #[getter]
    fn energy_scale(&self) -> f64 {
        self.data.energy_scale
    }

    /// Largest change of every further conserved quantity, by name.
    #[getter]
    fn conserved<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        self.data.conserved.iter().try_for_each(|drift| all.set_item(drift.name, drift.largest))?;
        Ok(all)
    }

    /// Names of the events and how often each happened.
    #[getter]
    fn events<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        self.data.events.iter().try_for_each(|(name, count)| all.set_item(name, count))?;
        Ok(all)
    }

    /// The event that ended the motion, or None.
    #[getter]
    fn stopped_by(&self) -> Option<&str> {
        self.data.stopped_by.as_deref()
    }

    /// Energy that the moving bodies lost in impacts.
    #[getter]
    fn energy_lost(&self) -> f64 {
        self.data.energy_lost
    }

    /// Everything that makes the motion doubtful, in words; empty where nothing does.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.data.warnings().iter().map(ToString::to_string).collect()
    }

    fn __str__(&self) -> String {
        self.data.to_string()
    }

    fn __repr__(&self) -> String {
        self.data.to_string()
    }
}

/// An event that happened: a zero crossing of one of the model's event functions, or of the run's.
#[pyclass(frozen, module = "dynamics")]
#[derive(Debug)]
pub struct Event {
    pub(crate) info: Arc<Info>,
    pub(crate) data: EventData,
}

#[pymethods]
impl Event {
    /// The event's name.
    #[getter]
    fn name(&self) -> &str {
        &self.data.name
    }

    /// When it happened.
    #[getter]
    fn t(&self) -> f64 {
        self.data.before.t
    }

    /// "rising" or "falling", along the motion.
    #[getter]
    fn direction(&self) -> &'static str {
        if self.data.rising { "rising" } else { "falling" }
    }

    /// The state just before.
    #[getter]
    fn before(&self) -> State {
        State::new(&self.info, self.data.before.clone())
    }

    /// The state just after; differs where an impact or an action changed it.
    #[getter]
    fn after(&self) -> State {
        State::new(&self.info, self.data.after.clone())
    }

    /// Energy that the moving bodies lost in impacts.
    #[getter]
    fn energy_lost(&self) -> f64 {
        self.data.energy_lost
    }

    /// How many constraints were hit.
    #[getter]
    fn impacts(&self) -> usize {
        self.data.impacts
    }

    /// Whether the motion ended here.
    #[getter]
    fn stopped(&self) -> bool {
        self.data.stopped
    }

    fn __repr__(&self) -> String {
        format!("<event {} at t = {}, {}>", self.data.name, self.data.before.t, self.direction())
    }
}

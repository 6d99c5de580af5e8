//! A model, its class and its motions without their types: what the classes of Python hold.

use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyDict;

use dynamics::model::ActiveSet;
use dynamics::simulate::Summary;

use crate::arrays::Rows;
use crate::data::{Columns, Evaluation, EventData, Failure, GivenState, LinearData, StateData, Table};
use crate::info::Info;
use crate::law::{Interruption, Signals};
use crate::options::{Callbacks, Options};

/// A class of models.
pub(crate) trait AnyClass: Send + Sync {
    fn info(&self) -> &Arc<Info>;
    /// A model from keyword arguments, and what its attributes show.
    fn construct<'py>(
        &self,
        values: &Bound<'py, PyDict>,
    ) -> PyResult<(Arc<dyn AnyModel>, Bound<'py, PyDict>)>;
}

/// A run that has ended: its motion, if anything was computed, and why it ended early.
pub(crate) type RunResult = (Option<Arc<dyn AnyMotion>>, Option<Failure>);

/// Where models are evaluated: q, q̇ and inputs by rows, the times, and which switched constraints hold.
pub(crate) struct States {
    pub(crate) count: usize,
    pub(crate) active_set: ActiveSet,
    /// Released constraints whose side was given, by bits. The others are released to where they move.
    pub(crate) sided: u32,
    pub(crate) q: Rows,
    pub(crate) u: Rows,
    pub(crate) inputs: Rows,
    pub(crate) t: Rows,
}

/// A model.
pub(crate) trait AnyModel: Send + Sync {
    /// The model with one field changed, and what its attribute shows.
    fn with_field<'py>(
        &self,
        name: &str,
        value: &Bound<'py, PyAny>,
    ) -> PyResult<(Arc<dyn AnyModel>, Bound<'py, PyAny>)>;
    /// The state of given values, with the constraints checked or, where it is to be assembled, solved.
    fn state(&self, given: &GivenState) -> Result<StateData, String>;
    /// A run. Exceptions of callbacks are left in the interruption.
    fn simulate(
        self: Arc<Self>,
        start: &StateData,
        options: &Options,
        callbacks: Arc<Callbacks>,
        interruption: &Interruption,
        signals: &Signals,
    ) -> RunResult;
    /// Values at states, row by row, and how many there are in a row; an error names the row.
    fn evaluate(&self, what: Evaluation, at: &States) -> Result<(Vec<f64>, Vec<usize>), String>;
    /// A live page.
    fn live(&self, start: &StateData, options: &LiveOptions) -> Result<String, String>;
    /// The equilibrium near a state, with its text, and the verdict on its stability.
    fn equilibrium(&self, near: &StateData) -> Result<(StateData, String, String), String>;
    /// The linearised model at a state.
    fn linearize(&self, at: &StateData) -> Result<LinearData, String>;
}

/// The options of a live page.
#[derive(Clone, Debug, Default)]
pub(crate) struct LiveOptions {
    pub(crate) title: Option<String>,
    pub(crate) ranges: Vec<(String, [f64; 2])>,
    pub(crate) hold: Vec<String>,
    pub(crate) plots: Vec<String>,
    pub(crate) phase: Option<String>,
    pub(crate) tolerance: Option<f64>,
    pub(crate) until: Option<f64>,
    /// Contacts, stick–slip and stops, as of runs.
    pub(crate) run: Options,
}

/// The times of a table.
#[derive(Clone, Debug)]
pub(crate) enum Times {
    /// Those at which the run was asked for states, or its steps.
    OfRun,
    These(Vec<f64>),
}

/// A motion. Where a law of inputs is a function of Python, an exception is left in the interruption.
pub(crate) trait AnyMotion: Send + Sync {
    fn interval(&self) -> (f64, f64);
    /// The functions of Python that its run called. Nothing else holds them.
    fn callbacks(&self) -> &Callbacks;
    fn start(&self, interruption: &Interruption) -> StateData;
    fn end(&self, interruption: &Interruption) -> StateData;
    /// The state at a time.
    fn at(&self, t: f64, interruption: &Interruption) -> Result<StateData, String>;
    fn table(&self, times: Times, columns: Columns, interruption: &Interruption) -> Result<Table, String>;
    fn events(&self, interruption: &Interruption) -> Vec<EventData>;
    fn summary(&self, verify: bool, interruption: &Interruption) -> Summary;
    /// A page that plays it.
    fn page(&self, interruption: &Interruption) -> Result<String, String>;
    /// Writes a file: `.html` the page, `.csv` a table, `.svg` a chart of it.
    fn write(&self, what: File, path: &std::path::Path, interruption: &Interruption) -> Result<(), String>;
    /// A live page from its start, with the rules of its run.
    fn live(&self, interruption: &Interruption) -> Result<String, String>;
}

/// What is written to a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum File {
    Page,
    Table,
    History,
    Outputs,
    Energy,
}

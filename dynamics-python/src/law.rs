//! Functions of Python that a run calls: laws of inputs, event functions, actions at events.
//!
//! A run cannot raise an exception of Python. The first one is kept, the run is cancelled, and the exception
//! is raised when the run has ended.

use std::cell::Cell;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use dynamics::simulate::Flow;

use crate::arrays;
use crate::data::StateData;
use crate::info::Info;
use crate::options;
use crate::state::State;

/// Asks a run to end, and keeps why.
#[derive(Debug, Default)]
pub(crate) struct Interruption {
    /// What the run reads before every step.
    pub(crate) flag: AtomicBool,
    error: Mutex<Option<PyErr>>,
}

impl Interruption {
    /// Ends the run; the first reason counts.
    pub(crate) fn raise(&self, error: PyErr) {
        let mut kept = self.error.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        kept.get_or_insert(error);
        self.flag.store(true, Ordering::Relaxed);
    }

    /// The reason, if there is one.
    pub(crate) fn take(&self) -> Option<PyErr> {
        self.error.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).take()
    }
}

/// How long a signal may wait: short enough to feel immediate, long enough to cost nothing.
const BETWEEN_SIGNALS: Duration = Duration::from_millis(50);

/// Looks for signals in a run. Python handles them on its main thread; elsewhere there is nothing to do.
#[derive(Debug)]
pub(crate) struct Signals {
    is_main: bool,
}

impl Signals {
    /// Of the thread that calls this.
    pub(crate) fn of_this_thread(py: Python<'_>) -> PyResult<Self> {
        let threading = py.import("threading")?;
        let main = threading.call_method0("main_thread")?;
        Ok(Self { is_main: threading.call_method0("current_thread")?.is(&main) })
    }

    /// What a run asks before every step: whether a signal raised an exception (`KeyboardInterrupt`), which
    /// is kept in the interruption.
    pub(crate) fn asked(&self, interruption: &Interruption) -> impl Fn() -> bool {
        let last = Cell::new(Instant::now());
        move || {
            if !self.is_main || last.get().elapsed() < BETWEEN_SIGNALS {
                return false;
            }
            last.set(Instant::now());
            match Python::attach(|py| py.check_signals()) {
                Ok(()) => false,
                Err(error) => {
                    interruption.raise(error);
                    true
                }
            }
        }
    }
}

/// A function of Python that is called with states of a model.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Function<'a> {
    pub(crate) info: &'a Arc<Info>,
    pub(crate) function: &'a Py<PyAny>,
    pub(crate) interruption: &'a Interruption,
}

impl Function<'_> {
    fn state<'py>(&self, py: Python<'py>, state: StateData) -> PyResult<Bound<'py, State>> {
        Bound::new(py, State::new(self.info, state))
    }

    /// Values of the inputs at a time and state; NaN where the function fails.
    pub(crate) fn inputs(&self, t: f64, state: StateData) -> Vec<f64> {
        self.call(vec![f64::NAN; self.info.scalars.inputs.len()], |py| {
            let returned = self.function.bind(py).call1((t, self.state(py, state)?))?;
            options::inputs(self.info, &returned)
        })
    }

    /// The value of an event function; NaN where it fails.
    pub(crate) fn number(&self, state: StateData) -> f64 {
        self.call(f64::NAN, |py| arrays::number(&self.function.bind(py).call1((self.state(py, state)?,))?))
    }

    /// What an action does: the state after it, if it changes the state, and whether the run goes on.
    pub(crate) fn action(&self, state: StateData) -> (Option<StateData>, Flow) {
        const NEEDED: &str = "an action of on_event returns None, a changed state, or \"stop\"";
        self.call((None, Flow::Stop), |py| {
            let returned = self.function.bind(py).call1((self.state(py, state)?,))?;
            if returned.is_none() {
                return Ok((None, Flow::Continue));
            }
            if let Ok(changed) = returned.cast::<State>() {
                return match Arc::ptr_eq(&changed.get().info, self.info) {
                    true => Ok((Some(changed.get().data.clone()), Flow::Continue)),
                    false => {
                        Err(PyTypeError::new_err("an action of on_event returned a state of another model"))
                    }
                };
            }
            match returned.extract::<String>().as_deref() {
                Ok("stop") => Ok((None, Flow::Stop)),
                _ => Err(PyTypeError::new_err(NEEDED)),
            }
        })
    }

    fn call<T>(&self, otherwise: T, call: impl FnOnce(Python<'_>) -> PyResult<T>) -> T {
        // After the first exception Python is not asked again.
        if self.interruption.flag.load(Ordering::Relaxed) {
            return otherwise;
        }
        Python::attach(call).unwrap_or_else(|error| {
            self.interruption.raise(error);
            otherwise
        })
    }
}

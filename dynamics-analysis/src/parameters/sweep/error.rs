//! What goes wrong in a sweep, and in a run of one.

use alloc::string::{String, ToString};
use core::fmt;

use dynamics_runtime::error::StateError;
use dynamics_runtime::model::{Dynamics, ModelState, Vector};
use dynamics_runtime::simulate::{MotionError, SimulationError};

use super::super::variable::VariableError;

/// Why a run of a sweep has no result.
#[derive(Clone, PartialEq)]
pub struct RunFailure {
    /// The time that it had reached; `None` where nothing moved.
    pub time: Option<f64>,
    /// What happened.
    pub message: String,
    /// q, then q̇, of the last good state; empty where there is none.
    pub state: alloc::vec::Vec<f64>,
}

impl RunFailure {
    /// A failure in words of one's own.
    #[must_use]
    pub fn new(message: impl Into<String>) -> Self {
        Self { time: None, message: message.into(), state: alloc::vec::Vec::new() }
    }
}

impl fmt::Display for RunFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

dynamics_runtime::sentence_for_debugging!(RunFailure);
impl core::error::Error for RunFailure {}

impl<M: Dynamics> From<SimulationError<M>> for RunFailure {
    fn from(error: SimulationError<M>) -> Self {
        let state = error.state.q().as_slice().iter().chain(error.state.u().as_slice());
        Self { time: Some(error.time), state: state.copied().collect(), message: error.to_string() }
    }
}

impl From<MotionError> for RunFailure {
    fn from(error: MotionError) -> Self {
        Self::new(error.to_string())
    }
}

impl From<StateError> for RunFailure {
    fn from(error: StateError) -> Self {
        Self::new(error.to_string())
    }
}

/// Why there is no sweep.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SweepError {
    /// A name or a value.
    #[error(transparent)]
    Variable(#[from] VariableError),
    /// Nothing varies.
    #[error("nothing varies; add an axis with `.over(name, values)`")]
    NoAxis,
    /// An axis has no values.
    #[error("the axis `{name}` has no values; give at least one")]
    Empty {
        /// What was to vary along it.
        name: String,
    },
    /// The grid has more than 2³² points.
    #[error("the grid has more than 2³² points; sweep over parts of it")]
    TooMany,
    /// The cores cannot be had.
    #[error("the threads cannot be started ({0}); ask for fewer with `.threads(..)`")]
    Threads(String),
}

dynamics_runtime::sentence_for_debugging!(SweepError);

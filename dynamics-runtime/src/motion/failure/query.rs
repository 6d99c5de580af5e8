//! Why a motion has no answer.

use alloc::string::String;
use core::fmt;

use crate::error::SolveError;
use crate::wording::Readable;

/// Why a motion has no answer to a question.
#[derive(Clone, PartialEq)]
#[non_exhaustive]
pub enum MotionError {
    /// The time lies outside the motion.
    OutOfRange {
        /// What was asked.
        time: f64,
        /// Start of the motion.
        start: f64,
        /// End of the motion.
        end: f64,
    },
    /// There is no output of this name.
    UnknownOutput {
        /// What was asked.
        name: String,
        /// The nearest known name.
        suggestion: Option<String>,
    },
    /// There is no constraint of this name.
    UnknownConstraint {
        /// What was asked.
        name: String,
        /// The nearest known name.
        suggestion: Option<String>,
    },
    /// Accelerations or reactions do not exist there.
    Solve(SolveError),
}

impl fmt::Display for MotionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OutOfRange { time, start, end } => {
                let [time, start, end] = [*time, *start, *end].map(Readable);
                write!(f, "t = {time} lies outside the motion, which goes from {start} to {end}")
            }
            Self::UnknownOutput { name, suggestion: Some(near) } => {
                write!(f, "there is no output `{name}`; did you mean `{near}`?")
            }
            Self::UnknownOutput { name, suggestion: None } => {
                write!(f, "there is no output `{name}`; declare it with `#[output]`")
            }
            Self::UnknownConstraint { name, suggestion: Some(near) } => {
                write!(f, "there is no constraint `{name}`; did you mean `{near}`?")
            }
            Self::UnknownConstraint { name, suggestion: None } => {
                write!(
                    f,
                    "there is no constraint `{name}`; declare it with `#[holonomic]` or `#[nonholonomic]`"
                )
            }
            Self::Solve(error) => error.fmt(f),
        }
    }
}

crate::error::sentence_for_debugging!(MotionError);
impl core::error::Error for MotionError {}

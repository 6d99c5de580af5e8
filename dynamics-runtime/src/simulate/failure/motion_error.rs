//! Errors of queries to a motion.

use alloc::string::String;
use core::fmt;

use crate::error::SolveError;
use crate::wording::Readable;

/// Why a motion has no answer to a question.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MotionError {
    /// The time lies outside the motion.
    #[error(fmt = out_of_range)]
    OutOfRange {
        /// What was asked.
        time: f64,
        /// Start of the motion.
        start: f64,
        /// End of the motion.
        end: f64,
    },
    /// There is no output of this name.
    #[error(fmt = unknown_output)]
    UnknownOutput {
        /// What was asked.
        name: String,
        /// The nearest known name.
        suggestion: Option<String>,
    },
    /// There is no constraint of this name.
    #[error(fmt = unknown_constraint)]
    UnknownConstraint {
        /// What was asked.
        name: String,
        /// The nearest known name.
        suggestion: Option<String>,
    },
    /// Accelerations or reactions do not exist there.
    #[error(transparent)]
    Solve(SolveError),
}

fn out_of_range(time: &f64, start: &f64, end: &f64, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let [time, start, end] = [*time, *start, *end].map(Readable);
    write!(f, "t = {time} lies outside the motion, which goes from {start} to {end}")
}

fn unknown_output(name: &str, suggestion: &Option<String>, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    match suggestion {
        Some(near) => write!(f, "there is no output `{name}`; did you mean `{near}`?"),
        None => write!(f, "there is no output `{name}`; declare it with `#[output]`"),
    }
}

fn unknown_constraint(name: &str, suggestion: &Option<String>, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    match suggestion {
        Some(near) => write!(f, "there is no constraint `{name}`; did you mean `{near}`?"),
        None => {
            write!(f, "there is no constraint `{name}`; declare it with `#[holonomic]` or `#[nonholonomic]`")
        }
    }
}

crate::error::sentence_for_debugging!(MotionError);

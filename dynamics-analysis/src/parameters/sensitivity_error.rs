//! Why there are no sensitivities.

use alloc::string::String;
use core::fmt;

use dynamics_runtime::error::SolveError;

use super::sweep::RunFailure;
use super::variable::VariableError;
use crate::{EquilibriumError, LinearizeError};

/// Why a motion, an equilibrium or a frequency has no derivatives by a parameter or a start.
#[derive(Clone, PartialEq)]
#[non_exhaustive]
pub enum SensitivityError {
    /// A name or a value.
    Variable(VariableError),
    /// Nothing was named to differentiate by.
    NoVariables,
    /// No end time was given.
    NoEnd,
    /// The series of this name was not asked for.
    NotAsked {
        /// The name.
        name: String,
    },
    /// There is no coordinate, velocity or output of this name.
    UnknownQuantity {
        /// What was asked for.
        name: String,
        /// What may have been meant.
        nearest: Option<String>,
    },
    /// The model, written by hand, does not give the value of a parameter.
    NotTold {
        /// The parameter.
        name: &'static str,
    },
    /// The motion failed.
    Motion(RunFailure),
    /// A time lies outside the motion.
    OutOfRange {
        /// The time.
        time: f64,
        /// Start of the motion.
        start: f64,
        /// End of the motion.
        end: f64,
    },
    /// The objective has no terms.
    NoObjective,
    /// A weight of the objective is not a finite number.
    Weight {
        /// The quantity.
        name: String,
        /// The weight.
        weight: f64,
    },
    /// A point of the objective is not a finite number.
    NotANumber {
        /// The quantity.
        name: String,
        /// Which of its points, from 0.
        row: usize,
        /// Its time.
        time: f64,
        /// Its value.
        value: f64,
    },
    /// An event ends the motion before its time, and its end moves with the parameters.
    EndsBefore {
        /// When it ends.
        time: f64,
        /// When it was to end.
        end: f64,
    },
    /// Applied forces depend on reactions.
    Friction,
    /// With another value of the parameter, or another start, constraints that repeat each other contradict
    /// each other.
    Contradicts {
        /// The parameter; `None` where it is the start.
        parameter: Option<&'static str>,
        /// A row that cannot be fulfilled with the others.
        row: &'static str,
    },
    /// Velocities or accelerations jump.
    Jump {
        /// When.
        time: f64,
        /// The event, or what jumps.
        what: String,
    },
    /// The model was written by hand, its derivatives are too large to be generated, or they take a fourth
    /// derivative of a function given by its values.
    NoDerivatives,
    /// There are no accelerations at a state of the motion.
    Solve {
        /// When.
        time: f64,
        /// Why.
        error: SolveError,
    },
    /// A derivative is not finite.
    NotFinite {
        /// When.
        time: f64,
    },
    /// The variational equations need steps below the resolution of time.
    StepTooSmall {
        /// When.
        time: f64,
    },
    /// The state is no equilibrium.
    Equilibrium(EquilibriumError),
    /// There are no small motions.
    Linearize(LinearizeError),
    /// The equilibrium has no derivative: nothing resists along some direction, as in a fold.
    Fold {
        /// The coordinate that moves most along it.
        coordinate: &'static str,
        /// The smallest over the largest singular value of the stiffness, free of units.
        ratio: f64,
    },
    /// Small motions are damped, gyroscopic or circulatory: their frequencies are not those of mass and
    /// stiffness.
    NotConservative {
        /// The largest of those terms, relative to its neighbours.
        part: f64,
    },
}

impl From<VariableError> for SensitivityError {
    fn from(error: VariableError) -> Self {
        Self::Variable(error)
    }
}

impl From<EquilibriumError> for SensitivityError {
    fn from(error: EquilibriumError) -> Self {
        Self::Equilibrium(error)
    }
}

impl From<LinearizeError> for SensitivityError {
    fn from(error: LinearizeError) -> Self {
        Self::Linearize(error)
    }
}

impl fmt::Display for SensitivityError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Variable(error) => error.fmt(f),
            Self::NoVariables => {
                f.write_str("nothing to differentiate by; name parameters or starts with `.by(..)`")
            }
            Self::NoEnd => f.write_str("no end time was given; set it with `.until(..)`"),
            Self::NotAsked { name } => write!(f, "`{name}` was not differentiated by; add it to `.by(..)`"),
            Self::UnknownQuantity { name, nearest: Some(near) } => {
                write!(f, "there is no coordinate, velocity or output `{name}`; did you mean `{near}`?")
            }
            Self::UnknownQuantity { name, nearest: None } => {
                write!(f, "there is no coordinate, velocity or output `{name}`; declare it with `#[output]`")
            }
            Self::NotTold { name } => {
                write!(f, "the model does not tell the value of `{name}`; implement `Dynamics::parameter`")
            }
            Self::Motion(failure) => failure.fmt(f),
            Self::OutOfRange { time, start, end } => {
                write!(f, "t = {time} lies outside the motion, which goes from {start} to {end}")
            }
            Self::NoObjective => f.write_str(
                "the objective is made of nothing; add `.end(..)`, `.integral(..)` or \
                    `.squares(..)` with points",
            ),
            Self::Weight { name, weight } => {
                write!(f, "the weight of `{name}` is {weight}; give a finite number")
            }
            Self::NotANumber { name, row, time, value } => {
                write!(f, "point {row} of `{name}` is ({time}, {value}); give finite numbers")
            }
            Self::EndsBefore { time, end } => write!(
                f,
                "an event ends the motion at t = {time}, before {end}, and its end moves with the \
                 parameters; let it end before that event"
            ),
            Self::Friction => f.write_str(
                "forces depend on reactions, and then there are no derivatives; write friction with given \
                 normal forces",
            ),
            Self::Contradicts { parameter, row } => {
                let what = parameter.unwrap_or("the start");
                write!(
                    f,
                    "with another `{what}` the row `{row}` contradicts others, which it repeats now; "
                )?;
                f.write_str("let one parameter stand in all of them")
            }
            Self::Jump { time, what } => write!(
                f,
                "at t = {time} something jumps ({what}), and sensitivities with it; end the motion before, \
                 or smooth what jumps"
            ),
            Self::NoDerivatives => LinearizeError::NoDerivatives.fmt(f),
            Self::Solve { time, error } => write!(f, "at t = {time}: {error}"),
            Self::NotFinite { time } => write!(
                f,
                "at t = {time} a derivative is not finite; look for roots and quotients of what becomes zero \
                 there"
            ),
            Self::StepTooSmall { time } => write!(
                f,
                "the sensitivities grow too fast at t = {time} for any step; end the motion before, or ask \
                 for fewer digits"
            ),
            Self::Equilibrium(error) => error.fmt(f),
            Self::Linearize(error) => error.fmt(f),
            Self::Fold { coordinate, ratio } => write!(
                f,
                "nothing resists along `{coordinate}` (stiffness {ratio:.1e} of the largest), so that the \
                 equilibrium has no derivative; follow it by its arc length"
            ),
            Self::NotConservative { part } => write!(
                f,
                "damping, gyroscopic or circulatory terms are {part:.1e} of the others, and frequencies not \
                 those of mass and stiffness; take them out"
            ),
        }
    }
}

dynamics_runtime::sentence_for_debugging!(SensitivityError);
impl core::error::Error for SensitivityError {}

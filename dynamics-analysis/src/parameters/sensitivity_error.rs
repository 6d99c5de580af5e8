//! The errors of sensitivities, gradients, and derivatives of equilibria.

use alloc::string::String;
use core::fmt;

use dynamics_runtime::error::SolveError;

use super::sweep::RunFailure;
use super::variable::VariableError;
use crate::{EquilibriumError, LinearizeError};

/// Why a motion, an equilibrium or a frequency has no derivatives by a parameter or a start.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SensitivityError {
    /// A name or a value.
    #[error(transparent)]
    Variable(#[from] VariableError),
    /// No parameter or start was named to differentiate by.
    #[error("nothing to differentiate by; name parameters or starts with `.by(..)`")]
    NoVariables,
    /// No end time was given.
    #[error("no end time was given; set it with `.until(..)`")]
    NoEnd,
    /// The series of this name was not asked for.
    #[error("`{name}` was not differentiated by; add it to `.by(..)`")]
    NotAsked {
        /// The name.
        name: String,
    },
    /// There is no coordinate, velocity or output of this name.
    #[error(fmt = unknown_quantity)]
    UnknownQuantity {
        /// The name that was asked for.
        name: String,
        /// A similar name.
        nearest: Option<String>,
    },
    /// The model, written by hand, does not give the value of a parameter.
    #[error("the model does not tell the value of `{name}`; implement `Dynamics::parameter`")]
    NoParameterValue {
        /// The parameter.
        name: &'static str,
    },
    /// The motion failed.
    #[error(transparent)]
    Motion(RunFailure),
    /// A time lies outside the motion.
    #[error("t = {time} lies outside the motion, which goes from {start} to {end}")]
    OutOfRange {
        /// The time.
        time: f64,
        /// Start of the motion.
        start: f64,
        /// End of the motion.
        end: f64,
    },
    /// The objective has no terms.
    #[error(
        "the objective is made of nothing; add `.end(..)`, `.integral(..)` or `.squares(..)` with points"
    )]
    NoObjective,
    /// A weight of the objective is not a finite number.
    #[error("the weight of `{name}` is {weight}; give a finite number")]
    Weight {
        /// The quantity.
        name: String,
        /// The weight.
        weight: f64,
    },
    /// A point of the objective is not a finite number.
    #[error("point {row} of `{name}` is ({time}, {value}); give finite numbers")]
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
    #[error(
        "an event ends the motion at t = {time}, before {end}, and its end moves with the parameters; let it \
         end before that event"
    )]
    EndsBefore {
        /// The time at which it ends.
        time: f64,
        /// The end time that was set.
        end: f64,
    },
    /// Applied forces depend on reactions.
    #[error(
        "forces depend on reactions, and then there are no derivatives; write friction with given normal \
         forces"
    )]
    Friction,
    /// With another value of the parameter, or another start, constraints that repeat each other contradict
    /// each other.
    #[error(fmt = contradicts)]
    Contradicts {
        /// The parameter; `None` where it is the start.
        parameter: Option<&'static str>,
        /// A row that cannot be fulfilled with the others.
        row: &'static str,
    },
    /// Velocities or accelerations jump.
    #[error(
        "at t = {time} something jumps ({what}), and sensitivities with it; end the motion before, or smooth \
         what jumps"
    )]
    Jump {
        /// When.
        time: f64,
        /// The event, or what jumps.
        what: String,
    },
    /// The model was written by hand, its derivatives are too large to be generated, or they take a fourth
    /// derivative of a function given by its values.
    #[error("{}", LinearizeError::NoDerivatives)]
    NoDerivatives,
    /// There are no accelerations at a state of the motion.
    #[error("at t = {time}: {error}")]
    Solve {
        /// When.
        time: f64,
        /// Why.
        error: SolveError,
    },
    /// A derivative is not finite.
    #[error(
        "at t = {time} a derivative is not finite; look for roots and quotients of what becomes zero there"
    )]
    NotFinite {
        /// When.
        time: f64,
    },
    /// The variational equations need steps below the resolution of time.
    #[error(
        "the sensitivities grow too fast at t = {time} for any step; end the motion before, or ask for fewer \
         digits"
    )]
    StepTooSmall {
        /// When.
        time: f64,
    },
    /// The state is no equilibrium.
    #[error(transparent)]
    Equilibrium(#[from] EquilibriumError),
    /// There are no small motions.
    #[error(transparent)]
    Linearize(#[from] LinearizeError),
    /// The equilibrium has no derivative: nothing resists along some direction, as in a fold.
    #[error(
        "nothing resists along `{coordinate}` (stiffness {ratio:.1e} of the largest), so that the \
         equilibrium has no derivative; follow it by its arc length"
    )]
    Fold {
        /// The coordinate that moves most along it.
        coordinate: &'static str,
        /// The smallest over the largest singular value of the stiffness, free of units.
        ratio: f64,
    },
    /// Small motions are damped, gyroscopic or circulatory: their frequencies are not those of mass and
    /// stiffness.
    #[error(
        "damping, gyroscopic or circulatory terms are {part:.1e} of the others, and frequencies not those of \
         mass and stiffness; take them out"
    )]
    NotConservative {
        /// The largest of those terms, relative to its neighbours.
        part: f64,
    },
}

fn unknown_quantity(name: &str, nearest: &Option<String>, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    match nearest {
        Some(near) => {
            write!(f, "there is no coordinate, velocity or output `{name}`; did you mean `{near}`?")
        }
        None => write!(f, "there is no coordinate, velocity or output `{name}`; declare it with `#[output]`"),
    }
}

fn contradicts(parameter: &Option<&'static str>, row: &str, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let what = parameter.unwrap_or("the start");
    write!(f, "with another `{what}` the row `{row}` contradicts others, which it repeats now; ")?;
    f.write_str("let one parameter stand in all of them")
}

dynamics_runtime::sentence_for_debugging!(SensitivityError);

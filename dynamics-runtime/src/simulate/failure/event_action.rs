//! Errors of the actions of events on states and constraints.

use alloc::boxed::Box;
use alloc::string::String;

use crate::error::{SolveError, StateError};

/// Why an action of an event cannot be carried out.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EventActionError {
    /// There is no constraint of this name.
    #[error(fmt = unknown_constraint)]
    UnknownConstraint {
        /// What was given.
        name: String,
        /// The nearest known name.
        suggestion: Option<String>,
    },
    /// The constraint is not one that can be switched.
    #[error("constraint `{constraint}` always holds; declare it with `(switched)`")]
    NotSwitched {
        /// Its name.
        constraint: &'static str,
    },
    /// A constraint is to engage at a place where it does not hold.
    #[error(
        "`{row}` is to engage where its residual is {residual:e}; engage it where it crosses zero, or move \
         the state there first"
    )]
    EngagedApart {
        /// Its row that is missed most.
        row: &'static str,
        /// Φ there.
        residual: f64,
    },
    /// A constraint is to be hit at a place where it does not touch.
    #[error(
        "`{row}` is to be hit where its residual is {residual:e}; hit it where it crosses zero, or move the \
         state there first"
    )]
    ImpactApart {
        /// Its row that is missed most.
        row: &'static str,
        /// Φ there.
        residual: f64,
    },
    /// A constraint that pushes only is to be hit while Φ grows: it moves away.
    #[error(
        "`{row}` is to be hit while it grows, by {rate:e} per unit of time: a released constraint pushes \
         only, to where it is positive; hit it where it falls, write it with the opposite sign, or stop it \
         with `engage`"
    )]
    ImpactAway {
        /// Its row.
        row: &'static str,
        /// Φ̇ there.
        rate: f64,
    },
    /// The gap of a contact jumps past zero: the body has met a step from the side, and the function of the
    /// contact does not say how.
    #[error(
        "the gap of contact `{row}` jumps past zero, it is {residual:.3e} beside the jump: the body meets a \
         step from the side, and how that is hit the gap does not say; declare the face of the step as a \
         `(switched)` constraint with a `.contact(..)` of its own"
    )]
    ContactJumps {
        /// Its row.
        row: &'static str,
        /// Φ beside the jump.
        residual: f64,
    },
    /// A contact without a corner is met far below its ground.
    #[error(
        "the gap of contact `{row}` is {residual:.3e} already where it is seen to be met: what happens \
         within the steps before is not resolved; tighten the tolerance, or make steps shorter, by \
         `.max_step(..)` or `.fixed_step(..)`"
    )]
    ContactMissed {
        /// Its row.
        row: &'static str,
        /// Φ there.
        residual: f64,
    },
    /// A contact is hit in a corner of its ground, and the motion does not say on which face.
    #[error(
        "contact `{row}` has a corner here, and is hit in it: what each of its faces gives its gap does not \
         say; declare each as a `(switched)` constraint with a `.contact(..)` of its own"
    )]
    ContactEdge {
        /// Its row.
        row: &'static str,
    },
    /// The side to which a constraint is released cannot be told from its reaction: there is none, or one for
    /// each of several rows.
    #[error(
        "the reaction of `{constraint}` does not say to which side it is released; say so with \
         `release_to(\"{constraint}\", side)`"
    )]
    NoSide {
        /// Its name.
        constraint: &'static str,
    },
    /// A coefficient of restitution outside 0 to 1.
    #[error("a coefficient of restitution of {value} is not possible; give one from 0 to 1")]
    Restitution {
        /// What was given.
        value: f64,
    },
    /// The constraints have no common solution.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// The state that was left does not fulfil the constraints that hold.
    #[error(fmt = left)]
    State(Box<StateError>),
}

/// The text for an invalid state after an action. The remedies for starts do not apply there.
fn left(error: &StateError, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
    match error {
        StateError::ConstraintViolated { row, residual, .. } => write!(
            f,
            "the action moved coordinates off constraint `{row}`: its residual is {residual:e}; move with \
             them what it ties to them"
        ),
        StateError::VelocityViolated { row, residual, .. } => write!(
            f,
            "the action left velocities that violate constraint `{row}`: its residual is {residual:e}; \
             change those that it ties together alike, as `state.u *= -0.5` does, or let what is met be a \
             `(switched)` constraint with `.contact(..)`"
        ),
        other => write!(f, "{other}"),
    }
}

fn unknown_constraint(
    name: &str,
    suggestion: &Option<String>,
    f: &mut core::fmt::Formatter<'_>,
) -> core::fmt::Result {
    write!(f, "there is no constraint `{name}`; ")?;
    match suggestion {
        Some(near) => write!(f, "did you mean `{near}`?"),
        None => f.write_str("declare it with `#[holonomic]` or `#[nonholonomic]`"),
    }
}

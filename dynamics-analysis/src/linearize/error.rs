//! The errors of linearisation: why there are no linear equations, or no eigenvalues.

use alloc::string::String;
use core::fmt;

use dynamics_runtime::error::{SolveError, StateError};

/// Why there is no linear model.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LinearizeError {
    /// The state is not one of the model.
    #[error(transparent)]
    State(#[from] StateError),
    /// There are no accelerations or reactions at the state.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// The equations depend on an input that has no value.
    #[error("the equations depend on inputs, and `{input}` has no value; set it in the state")]
    InputNotSet {
        /// The input.
        input: &'static str,
    },
    /// A derivative is not finite at the state.
    #[error(
        "a derivative of the equations of motion is not finite at this state; move it off the place where a \
         function has a corner or a pole"
    )]
    NotFinite,
    /// A branch of the model (`if`, min, max, abs, signum) changes exactly at this state: each side has other
    /// derivatives.
    #[error(
        "a choice of the model (`if`, min, max, abs, signum) changes at this very state, so that each side \
         has small motions of its own; move it to the side that is meant"
    )]
    Corner,
    /// The model has more branch changes than can be followed, so jumps along a motion would be missed.
    #[error(
        "choices of the model (`if`, min, max, abs, signum) are more than the {} that are followed, or \
         depend on accelerations, so that jumps on the way are not seen; smooth some of them",
        dynamics_runtime::model::MAX_KINKS
    )]
    BranchesNotFollowed,
    /// The model was written by hand, its derivatives are too large to be generated, or they take a fourth
    /// derivative of a function given by its values.
    #[error(
        "the model has no exact derivatives: it is written by hand, they are too large to be generated, or \
         they take fourth derivatives of a curve; use fewer coordinates, or no slopes of curves"
    )]
    NoDerivatives,
    /// Applied forces depend on reactions.
    #[error(
        "forces that depend on reactions are not smooth where slip turns round; leave the friction out, or \
         linearise the model with it as a damper"
    )]
    Friction,
    /// A name is not that of a coordinate.
    #[error(fmt = unknown_coordinate)]
    UnknownCoordinate {
        /// The name that was asked for.
        name: String,
        /// A coordinate of a similar name, if there is one.
        nearest: Option<String>,
    },
    /// A requested coordinate is not independent: it follows from the other requested ones or from the
    /// constraints.
    #[error(
        "`{name}` is not independent of the other coordinates that were asked for; leave it out, or ask for \
         it alone"
    )]
    Dependent {
        /// Its name.
        name: &'static str,
    },
    /// The position is singular: nearby more rows are independent, or there is no other position. So the
    /// constraints have no tangent space here.
    #[error(fmt = singular_position)]
    SingularPosition {
        /// Independent rows here.
        rank: usize,
        /// Independent rows nearby; `None` if nothing can be assembled there.
        rank_nearby: Option<usize>,
    },
    /// The mass matrix is not positive definite on the tangent space of the constraints.
    #[error(
        "the mass matrix is not positive definite on what the constraints leave; give every coordinate \
         inertia, or constrain it"
    )]
    Inertia,
    /// The motion is neither an equilibrium nor steady: an independent velocity changes.
    #[error(
        "the state is neither an equilibrium nor a steady motion: the velocity of `{name}` changes by \
         {acceleration:.3e} per second; eigenvalues say nothing there"
    )]
    Accelerates {
        /// The coordinate.
        name: &'static str,
        /// Its acceleration.
        acceleration: f64,
    },
    /// The coefficients change along the motion.
    #[error(
        "the coefficients of small motions change along the motion (by {change:.1e} of the largest over a \
         hundredth of its time scale), so that eigenvalues say nothing; choose coordinates that turn along, \
         or use the equations with coefficients that vary"
    )]
    Varies {
        /// The change over a hundredth of the motion's time scale, relative to the largest coefficient.
        change: f64,
    },
    /// A little later on this motion there are no linear equations in the same coordinates, so it is unknown
    /// whether the coefficients are constant. The mechanism or the model ends there, or rows change their
    /// rank.
    #[error(
        "a little later the motion has no linear equations in these coordinates, so that nobody knows \
         whether the coefficients stay, and eigenvalues say nothing; choose other coordinates, or a state \
         farther from where the constraints or the model end"
    )]
    Ends,
    /// The iteration for eigenvalues did not converge.
    #[error(
        "the eigenvalues of a {size} x {size} matrix were not found; scale the parameters to similar sizes"
    )]
    NoConvergence {
        /// Size of the matrix.
        size: usize,
    },
}

fn unknown_coordinate(name: &str, nearest: &Option<String>, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    match nearest {
        None => write!(f, "no coordinate is called `{name}`; array elements are written `theta[0]`"),
        Some(nearest) => write!(f, "no coordinate is called `{name}`; did you mean `{nearest}`?"),
    }
}

fn singular_position(rank: &usize, rank_nearby: &Option<usize>, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    match rank_nearby {
        None => write!(
            f,
            "the position is singular: {rank} rows of the constraints are independent here, which leaves \
             a direction, in which nothing can be assembled; leave a row out that only repeats others, \
             or change a dimension"
        ),
        Some(nearby) => write!(
            f,
            "the position is singular: {rank} rows of the constraints are independent here, {nearby} \
             beside it, so that small motions have no tangent space; linearise beside it"
        ),
    }
}

dynamics_runtime::sentence_for_debugging!(LinearizeError);

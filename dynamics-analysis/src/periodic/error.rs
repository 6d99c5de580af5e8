//! The errors of periodic motions, multipliers, exponents and sections.

use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec::Vec;
use core::fmt;

use dynamics_runtime::error::{SolveError, StateError};

use crate::LinearizeError;

/// Why periodic motions, multipliers, exponents or sections cannot be computed.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PeriodicError {
    /// The start is not a state of the model.
    #[error(transparent)]
    State(#[from] StateError),
    /// The parameters alone make the equations singular.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// There are no derivatives.
    #[error(transparent)]
    Derivatives(LinearizeError),
    /// An option has an invalid value.
    #[error("{what} is {value}; it has to be {needed}")]
    Option {
        /// Which.
        what: &'static str,
        /// Its value.
        value: f64,
        /// The valid values.
        needed: &'static str,
    },
    /// The constraints leave no freedom.
    #[error(
        "the constraints leave nothing free, so that nothing can be disturbed; release one, or look at the \
         motion by `kinematics`"
    )]
    NoFreedom,
    /// A name is not that of a coordinate.
    #[error(fmt = unknown_coordinate)]
    UnknownCoordinate {
        /// The name that was asked for.
        name: String,
        /// A coordinate of a similar name, if there is one.
        nearest: Option<String>,
    },
    /// The motion ends: there are no accelerations, or no derivatives of them.
    #[error("the motion ends at t = {time:.6}: {reason}")]
    Ends {
        /// When.
        time: f64,
        /// Why.
        reason: Box<PeriodicError>,
    },
    /// A force, or a derivative of one, is not a number.
    #[error(
        "the acceleration of `{coordinate}`, or a derivative of it, is not a number at t = {time:.6}; set \
         every input, and keep the motion off poles of the model"
    )]
    NotFinite {
        /// When.
        time: f64,
        /// The coordinate that is accelerated by it.
        coordinate: &'static str,
    },
    /// The motion diverges.
    #[error(
        "the motion runs away: `{coordinate}` or its velocity is {value:.2e} at t = {time:.6}; start nearer, \
         or give states along the closed motion by `.through(..)`"
    )]
    RunsAway {
        /// When.
        time: f64,
        /// The coordinate that diverged, or whose velocity did.
        coordinate: &'static str,
        /// Its absolute value, or that of its velocity.
        value: f64,
    },
    /// More steps than are allowed.
    #[error(
        "{steps} steps were made up to t = {time:.6}; loosen the tolerance or allow more by \
         `.max_steps(..)`; the method is explicit, for its tangent vectors' sake: what is stiff in the model \
         makes its steps short, so hold it by a constraint instead, or leave it out, where its swinging is \
         not asked for"
    )]
    Steps {
        /// The time that was reached.
        time: f64,
        /// Steps made.
        steps: usize,
    },
    /// The step size falls below the resolution of time.
    #[error(
        "steps become shorter without end at t = {time:.6}; the equations are singular there, or the \
         tolerance asks for more than rounding leaves"
    )]
    Stalls {
        /// When.
        time: f64,
    },
    /// The motion touches a place where a branch of the model changes, or stays in it. The motion after it
    /// has no derivative.
    #[error(
        "the motion touches a place where a branch of the model changes, or stays in it, at t = {time:.6}: \
         small disturbances have no linear equations there; move the start or a parameter, or round the \
         corner off"
    )]
    Grazes {
        /// When.
        time: f64,
    },
    /// The period begins where a force jumps: rounding would decide whether the jump is at the start, at the
    /// end, or at both.
    #[error(
        "the motion starts, or one of its segments does, where a force jumps, at t = {time:.6}: whether it \
         jumps at the start or at the end is for rounding to say; start elsewhere on the motion"
    )]
    StartsOnCorner {
        /// When.
        time: f64,
    },
    /// The equations of motion do not repeat after the period.
    #[error(
        "the equations of motion do not repeat after the period: the acceleration of `{coordinate}` differs \
         by {change:.1e} of the largest; give a period of what drives the model"
    )]
    NotPeriodic {
        /// The coordinate whose acceleration differs most.
        coordinate: &'static str,
        /// By how much, relative to the largest.
        change: f64,
    },
    /// The equations of motion differ after one period and the given advance of the coordinates.
    #[error(
        "the equations of motion are others where `{turned}` is further by {by}: the acceleration of \
         `{coordinate}` differs by {change:.1e} of the largest; give whole turns, or what the model repeats \
         after"
    )]
    NotAlike {
        /// A coordinate that is to advance.
        turned: &'static str,
        /// By how much.
        by: f64,
        /// The coordinate whose acceleration differs most.
        coordinate: &'static str,
        /// By how much, relative to the largest.
        change: f64,
    },
    /// The motion does not return to its start.
    #[error(
        "the motion does not close: `{coordinate}` or its velocity misses its start by {miss:.2e} of its \
         range; find the closed one by `periodic(..)`, where an angle goes on turning with `.advance(..)`"
    )]
    NotClosed {
        /// The coordinate that misses most, or whose velocity does.
        coordinate: &'static str,
        /// By how much, in parts of the range of the coordinate.
        miss: f64,
    },
    /// The search ended at rest, which has every period.
    #[error("the search ended at rest, at {at:.4?}, which has every period; start from a larger motion")]
    Rests {
        /// Coordinates, then velocities.
        at: Vec<f64>,
    },
    /// Closed motions form a family, and none was chosen.
    #[error(fmt = not_isolated)]
    NotIsolated {
        /// The coordinate that changes most from one to the next.
        coordinate: &'static str,
        /// Smallest over largest singular value of the conditions.
        ratio: f64,
        /// The conserved quantities.
        conserved: Vec<&'static str>,
        /// Conditions that would choose one and are not set yet, as they are written.
        remedies: Vec<String>,
        /// The period of the one that was found.
        period: f64,
        /// Its start: coordinates, then velocities.
        at: Vec<f64>,
    },
    /// Newton's method does not converge.
    #[error(fmt = no_convergence)]
    NoConvergence {
        /// Iterations made.
        iterations: usize,
        /// The coordinate that misses most, or whose velocity does.
        coordinate: &'static str,
        /// By how much, in parts of the range of the coordinate, where it came nearest.
        miss: f64,
        /// The period there.
        period: f64,
        /// The start there: coordinates, then velocities.
        at: Vec<f64>,
        /// The error of the last shot that failed, if one did.
        because: Option<Box<PeriodicError>>,
    },
    /// Neighbours separate or approach so fast that the numbers overflow or underflow.
    #[error(
        "neighbours part or come together so fast at t = {time:.6} that numbers do not hold it in a part of \
         1/{} of the run; take the means over a shorter time by `.during(..)`",
        100 * .parts
    )]
    TooFast {
        /// When.
        time: f64,
        /// How often a hundredth of the run was divided.
        parts: usize,
    },
    /// The section was crossed less often than asked for.
    #[error(fmt = never_crossed)]
    NeverCrossed {
        /// The number of crossings.
        points: usize,
        /// The end of the search.
        until: f64,
        /// The least and the greatest value of the section function on the way.
        range: [f64; 2],
        /// The points, without those that were skipped: time, coordinates, then velocities of each.
        found: Vec<Vec<f64>>,
    },
    /// The simulation for the points of a section failed.
    #[error("the run broke off after {points} points: {reason}")]
    BrokenOff {
        /// Points up to there.
        points: usize,
        /// Why.
        reason: String,
        /// The points: time, coordinates, then velocities of each.
        found: Vec<Vec<f64>>,
    },
    /// The eigenvalues of a matrix could not be computed.
    #[error(transparent)]
    Eigenvalues(LinearizeError),
}

fn unknown_coordinate(name: &str, nearest: &Option<String>, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    match nearest {
        None => write!(f, "no coordinate is called `{name}`; array elements are written `theta[0]`"),
        Some(nearest) => write!(f, "no coordinate is called `{name}`; did you mean `{nearest}`?"),
    }
}

fn not_isolated(
    coordinate: &str,
    ratio: &f64,
    conserved: &[&'static str],
    remedies: &[String],
    period: &f64,
    _at: &[f64],
    f: &mut fmt::Formatter<'_>,
) -> fmt::Result {
    write!(
        f,
        "closed motions lie side by side (along `{coordinate}`, singular values {ratio:.0e}; one \
         has the period {period:.9})"
    )?;
    if !conserved.is_empty() {
        write!(f, ", as {} is conserved", conserved.join(", "))?;
    }
    match remedies.split_last() {
        Some((last, [])) => write!(f, "; choose one by `{last}`"),
        Some((last, others)) => write!(f, "; choose one by `{}` or `{last}`", others.join("`, `")),
        None => write!(
            f,
            "; what is held does not choose one: hold another coordinate, or hold `{coordinate}` \
             by a constraint"
        ),
    }
}

fn no_convergence(
    iterations: &usize,
    coordinate: &str,
    miss: &f64,
    period: &f64,
    _at: &[f64],
    because: &Option<Box<PeriodicError>>,
    f: &mut fmt::Formatter<'_>,
) -> fmt::Result {
    write!(
        f,
        "no closed motion was found in {iterations} iterations: at best `{coordinate}` or its \
         velocity ends {miss:.2e} of its range away from its start, with the period {period:.6}; \
         start nearer, as from a section's closest return, or divide the period by \
         `.segments(..)` or `.through(..)`"
    )?;
    because.as_ref().map_or(Ok(()), |reason| write!(f, " (shots beside it: {reason})"))
}

fn never_crossed(
    points: &usize,
    until: &f64,
    range: &[f64; 2],
    _found: &[Vec<f64>],
    f: &mut fmt::Formatter<'_>,
) -> fmt::Result {
    let [low, high] = range;
    write!(
        f,
        "the section was crossed {points} times up to t = {until}, its function stayed between \
         {low:.4e} and {high:.4e}; look for longer, or move the section"
    )
}

dynamics_runtime::sentence_for_debugging!(PeriodicError);

//! Why a mechanism cannot be followed.

use alloc::boxed::Box;
use core::fmt;

use crate::constrain::TopContributors;
use crate::error::{SingularMassMatrix, SolveError, StateError};
use crate::model::{Constraints, Model, ModelState};
use crate::simulate::OptionError;
use crate::wording::Readable;

/// A kinematic analysis that stopped before its end. What was computed up to there is still in hand:
/// [`KinematicsError::motion`].
pub struct KinematicsError<M: Model> {
    /// What happened.
    pub kind: KinematicsErrorKind,
    /// When: the time that was located, or of the last position that was reached.
    pub time: f64,
    /// The position there; velocities are those of the last position that was reached.
    pub state: Box<M::State>,
    pub(super) reached: Option<Box<super::FollowedPath<M>>>,
}

/// The kinds of failure.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum KinematicsErrorKind {
    /// An option makes no sense.
    Option(OptionError),
    /// The guess cannot be assembled.
    Start(StateError),
    /// The mass matrix of the model's constants has no inverse.
    SingularMassMatrix(SingularMassMatrix),
    /// The holonomic constraints leave freedom: the motion follows from forces too.
    Freedom {
        /// How much.
        degrees: usize,
        /// The coordinates that can move.
        coordinates: TopContributors,
        /// Rows of nonholonomic constraints, which decide velocities and no positions.
        of_velocities: usize,
    },
    /// The start is a singular position.
    SingularStart {
        /// The rows that depend on each other there.
        rows: TopContributors,
        /// The coordinates that are not determined there.
        coordinates: TopContributors,
    },
    /// Lock-up: the drive cannot move the mechanism further. A limit point: Φ_q loses rank and Φ_t is not in
    /// its range.
    LockUp {
        /// The rows that hold against each other.
        rows: TopContributors,
        /// The coordinates whose velocities grow beyond all bounds.
        coordinates: TopContributors,
    },
    /// The assembly bifurcates: Φ_q loses rank, and branches meet on which the drive can move on.
    Bifurcation {
        /// By how much the rank falls.
        loss: usize,
        /// The rows that depend on each other there.
        rows: TopContributors,
        /// The coordinates that are free to go either way.
        coordinates: TopContributors,
        /// Whether it was to be passed: beyond it no position has velocities that continue those before it.
        tried: bool,
    },
    /// Branches of the assembly touch: they have a tangent in common, and which of them the mechanism goes on
    /// along no velocity says.
    BranchesTouch {
        /// The rows that depend on each other there.
        rows: TopContributors,
        /// The coordinates in which the branches differ.
        coordinates: TopContributors,
    },
    /// The position does not continue, however short the step: the drive jumps, or the constraints end there.
    NoContinuation {
        /// The row that is missed most.
        row: &'static str,
        /// By how much.
        residual: f64,
    },
    /// Velocities, accelerations or reactions do not exist.
    Solve(SolveError),
    /// More steps than `.max_steps(..)` permits.
    TooManySteps {
        /// The limit.
        limit: u64,
    },
}

impl From<OptionError> for KinematicsErrorKind {
    fn from(error: OptionError) -> Self {
        Self::Option(error)
    }
}

impl From<SolveError> for KinematicsErrorKind {
    fn from(error: SolveError) -> Self {
        Self::Solve(error)
    }
}

/// A row with a smaller residual is fulfilled, so that its gradient must vanish.
const FULFILLED_RESIDUAL: f64 = 1e-14;

impl fmt::Display for KinematicsErrorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Option(error) => error.fmt(f),
            Self::Start(error) => error.fmt(f),
            Self::SingularMassMatrix(error) => error.fmt(f),
            Self::Freedom { degrees, coordinates, of_velocities } => {
                let s = if *degrees == 1 { "" } else { "s" };
                match of_velocities {
                    0 => write!(
                        f,
                        "the constraints leave {degrees} degree{s} of freedom, in {coordinates}; add driving \
                         constraints, or use `simulate`"
                    ),
                    _ => write!(
                        f,
                        "the constraints on positions leave {degrees} degree{s} of freedom, in \
                         {coordinates}, and those on velocities (`#[nonholonomic]`) say nothing of where it \
                         is; use `simulate`, or drive positions by `#[holonomic]` constraints"
                    ),
                }
            }
            Self::SingularStart { rows, coordinates } => write!(
                f,
                "the start is a singular position: the rank falls with {rows}, which leaves {coordinates} \
                 open; begin at another time"
            ),
            Self::LockUp { rows, coordinates } => write!(
                f,
                "the mechanism locks up: {rows} hold against each other, and the drive would have to move \
                 {coordinates} with infinite velocity; end the motion before, or drive another coordinate"
            ),
            Self::Bifurcation { loss, rows, coordinates, tried } => write!(
                f,
                "the assembly bifurcates: the rank falls by {loss} with {rows}, and {coordinates} can go \
                 either way{}",
                if *tried {
                    ", but no branch continues the velocities of this one, as `.through_bifurcations()` \
                     asks; add a constraint that decides, or end the motion before"
                } else {
                    "; add a constraint that decides, or pass it smoothly with `.through_bifurcations()`"
                }
            ),
            Self::BranchesTouch { rows, coordinates } => write!(
                f,
                "branches of the assembly touch: the rank falls with {rows}, and {coordinates} go on along \
                 either of two branches that have a tangent in common; declare the branch that is meant by \
                 itself, or end the motion before"
            ),
            Self::NoContinuation { row, residual } if residual.abs() <= FULFILLED_RESIDUAL => write!(
                f,
                "the position does not continue, although `{row}` is fulfilled here: its gradient vanishes, \
                 and branches meet or end; a closure that is written by its components, a row for each, \
                 instead of one distance has such positions told apart and passed"
            ),
            Self::NoContinuation { row, residual } => write!(
                f,
                "the position does not continue: however short the step, `{row}` cannot be fulfilled (missed \
                 by {residual:e}); the drive jumps here, or the constraint is not defined further on"
            ),
            Self::Solve(error) => error.fmt(f),
            Self::TooManySteps { limit } => write!(f, "more than {limit} steps; raise `.max_steps(..)`"),
        }
    }
}

impl<M: Constraints> fmt::Display for KinematicsError<M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.reached.is_none() {
            return write!(f, "`{}` was not moved: {}", M::NAME, self.kind);
        }
        write!(f, "`{}` stopped at t = {}: {}", M::NAME, Readable(self.time), self.kind)?;
        write!(f, "\n  position there:")?;
        for (coordinate, q) in M::COORDINATES.iter().zip(crate::model::Vector::as_slice(self.state.q())) {
            write!(f, "\n    {} = {}", coordinate.name, Readable(*q))?;
        }
        Ok(())
    }
}

crate::error::sentence_for_debugging!(KinematicsError<M: Constraints>);
impl<M: Constraints> core::error::Error for KinematicsError<M> {}

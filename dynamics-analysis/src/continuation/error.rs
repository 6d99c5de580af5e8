//! Why a branch could not be followed, and how far it went.

use alloc::boxed::Box;
use alloc::string::String;
use core::fmt;

use dynamics_runtime::model::ModelState;

use super::branch::Branch;
use super::followed_curves::{FoldCurve, HopfCurve};
use crate::EquilibriumError;

/// Why a continuation failed. What was computed up to there is in the error.
#[derive(Clone, PartialEq)]
#[non_exhaustive]
pub enum ContinuationError<S: ModelState> {
    /// There is no equilibrium at the start, or it cannot be computed.
    Start(EquilibriumError),
    /// The start is not in balance; the nearest equilibrium is elsewhere.
    NotInBalance {
        /// The coordinate that is farthest off.
        coordinate: &'static str,
        /// By how much.
        off: f64,
        /// The equilibrium.
        nearest: S,
    },
    /// The equilibria form a continuum at one value of the parameter, or the start is a branch point: the
    /// branch has no unique direction.
    NotIsolated {
        /// The coordinate along which nothing resists.
        coordinate: &'static str,
    },
    /// Rolling and gliding systems have more positions of rest than the equations can distinguish.
    Nonholonomic,
    /// The constraints leave no freedom, or no force acts on the remaining freedom.
    NothingMoves,
    /// The range of a parameter is empty, not finite, or narrower than 10⁻⁸ of the parameter (its effect
    /// would be below rounding), or the start is not in it.
    Range {
        /// From where to where.
        range: [f64; 2],
        /// The parameter of the start.
        start: f64,
    },
    /// An option makes no sense.
    Option {
        /// Its name.
        name: &'static str,
        /// What was given.
        value: f64,
    },
    /// A branch of less than two points.
    Points {
        /// How many were allowed.
        count: usize,
    },
    /// Under load control: equilibria end in a fold, and beyond it there is none nearby.
    LimitLoad {
        /// What the parameter is called.
        parameter: String,
        /// The limit load.
        limit: f64,
        /// The equilibrium there.
        at: Box<S>,
        /// What was computed up to there.
        branch: Box<Branch<S>>,
    },
    /// The model becomes impossible: forces that are not finite or that change with time, inertia that is not
    /// positive, constraints that cannot hold.
    Model {
        /// The last value of the parameter at which all was well.
        parameter: f64,
        /// What is wrong beyond it.
        reason: EquilibriumError,
        /// What was computed up to there.
        branch: Box<Branch<S>>,
    },
    /// The branch could not be followed any further, however short the steps.
    Stuck {
        /// The last value of the parameter.
        parameter: f64,
        /// The shortest step that was tried.
        step: f64,
        /// What was computed up to there.
        branch: Box<Branch<S>>,
    },
    /// A curve of folds could not be followed any further.
    FoldCurve {
        /// The last values of both parameters.
        at: [f64; 2],
        /// What is wrong with the model beyond, if that is why.
        reason: Option<EquilibriumError>,
        /// What was computed up to there.
        curve: Box<FoldCurve<S>>,
    },
    /// A curve of Hopf points could not be followed any further.
    HopfCurve {
        /// The last values of both parameters.
        at: [f64; 2],
        /// What is wrong with the model beyond, if that is why.
        reason: Option<EquilibriumError>,
        /// What was computed up to there.
        curve: Box<HopfCurve<S>>,
    },
    /// The point is no branch point of the branch.
    NoBranchPoint {
        /// The parameter there.
        parameter: f64,
    },
    /// No other branch was found in a branch point.
    NoOtherBranch {
        /// The parameter there.
        parameter: f64,
    },
    /// Branches leave a point in every direction: a symmetry carries them into each other.
    Everywhere {
        /// The parameter there.
        parameter: f64,
    },
    /// The start has no fold that could be followed.
    NoFold,
    /// The start has no pair of eigenvalues on the imaginary axis that could be followed.
    NoHopf,
    /// There is no buckling load: the stiffness does not decrease with the parameter, or the start is not a
    /// stable equilibrium.
    NoBuckling {
        /// Why.
        reason: &'static str,
    },
}

impl<S: ModelState> ContinuationError<S> {
    /// What was computed before it failed, if anything was.
    #[must_use]
    pub fn branch(&self) -> Option<&Branch<S>> {
        match self {
            Self::LimitLoad { branch, .. } | Self::Model { branch, .. } | Self::Stuck { branch, .. } => {
                Some(branch)
            }
            _ => None,
        }
    }
}

impl<S: ModelState> fmt::Display for ContinuationError<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Start(error) => write!(f, "there is no equilibrium to start from: {error}"),
            Self::NotInBalance { coordinate, off, .. } => write!(
                f,
                "the start is not in balance: `{coordinate}` is {off:.3e} away from the next equilibrium; \
                 start from what `.equilibrium(&start)` gives"
            ),
            Self::NotIsolated { coordinate } => write!(
                f,
                "nothing resists along `{coordinate}` at the start, whatever the parameter: equilibria lie \
                 side by side, or branches meet here; hold that coordinate, or start at another value of the \
                 parameter"
            ),
            Self::Nonholonomic => f.write_str(
                "what rolls or glides rests in more positions than its equations tell apart, so that there \
                 is no one branch; hold the coordinates that only say where it is",
            ),
            Self::NothingMoves => f.write_str(
                "nothing can move that a force acts on, so that there is no equilibrium to be followed; \
                 leave a constraint out",
            ),
            Self::Range { range: [from, to], start } => write!(
                f,
                "the range of the parameter, from {from} to {to}, is empty, not finite, without {start}, or \
                 so narrow that rounding of the parameter hides what it does; give finite ends in order with \
                 `.until(from..=to)`, and count a parameter that hardly changes from a value nearby"
            ),
            Self::Option { name, value } => {
                write!(f, "`.{name}({value})` makes no sense; give a positive number")
            }
            Self::Points { count } => {
                write!(f, "`.points({count})` leaves no branch; allow two points or more")
            }
            Self::LimitLoad { parameter, limit, .. } => write!(
                f,
                "the load cannot be carried beyond {limit:.12} ({parameter}): equilibria end there in a \
                 fold; leave load control, and the branch is followed through it, or simulate what happens \
                 beyond"
            ),
            Self::Model { parameter, reason, .. } => {
                write!(f, "the model ends beyond {parameter} of its parameter: {reason}")
            }
            Self::Stuck { parameter, step, .. } => write!(
                f,
                "the branch could not be followed beyond {parameter} of its parameter, with steps down to \
                 {step:.1e}: forces have a corner or a jump there, or the constraints a singular position; \
                 round it off, or start beyond it. Or the parameter or a coordinate is so large beside what \
                 happens to it that rounding hides it; count it from a place nearby"
            ),
            Self::FoldCurve { at: [p, r], reason: Some(reason), .. } => {
                write!(f, "the model ends beyond {p}, {r} of its parameters: {reason}")
            }
            Self::FoldCurve { at: [p, r], reason: None, .. } => write!(
                f,
                "the curve of folds could not be followed beyond {p}, {r} of the parameters: forces have a \
                 corner there, or it ends in a place where more than one direction does not resist; take \
                 shorter steps, or start beyond it"
            ),
            Self::HopfCurve { at: [p, r], reason: Some(reason), .. } => {
                write!(f, "the model ends beyond {p}, {r} of its parameters: {reason}")
            }
            Self::HopfCurve { at: [p, r], reason: None, .. } => write!(
                f,
                "the curve of Hopf points could not be followed beyond {p}, {r} of the parameters: another \
                 pair of eigenvalues meets this one, or damping sets in or vanishes; take shorter steps, or \
                 start beyond it"
            ),
            Self::NoHopf => f.write_str(
                "the point is no Hopf point of the family at these parameters, nor one in which frequencies \
                 meet; start from one of `branch.special` of such a kind",
            ),
            Self::NoBranchPoint { parameter } => write!(
                f,
                "no branches meet at {parameter} of the parameter; switch at a pitchfork or a transcritical \
                 point of a branch"
            ),
            Self::NoOtherBranch { parameter } => write!(
                f,
                "no other branch was found where branches meet at {parameter} of the parameter; the point \
                 must be one of this very family, or start on the other branch with an equilibrium that \
                 `.equilibrium(&start)` finds"
            ),
            Self::Everywhere { parameter } => write!(
                f,
                "branches leave in every direction where several stiffnesses vanish at {parameter} of the \
                 parameter: a symmetry tells none from another; hold one coordinate by a constraint, or make \
                 the axes a little different"
            ),
            Self::NoFold => f.write_str(
                "the point is no fold of the family at these parameters; start from one of `branch.folds()`",
            ),
            Self::NoBuckling { reason } => write!(f, "there is no buckling load: {reason}"),
        }
    }
}

dynamics_runtime::sentence_for_debugging!(ContinuationError<S: ModelState>);
impl<S: ModelState> core::error::Error for ContinuationError<S> {}

impl<S: ModelState> From<EquilibriumError> for ContinuationError<S> {
    fn from(error: EquilibriumError) -> Self {
        Self::Start(error)
    }
}

//! Errors of continuations, with the branch or the curve that was computed.

use alloc::boxed::Box;
use alloc::string::String;
use core::fmt;

use dynamics_runtime::model::ModelState;

use super::branch::Branch;
use super::followed_curves::{FoldCurve, HopfCurve};
use crate::EquilibriumError;

/// Why a continuation failed. What was computed up to there is in the error.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ContinuationError<S: ModelState> {
    /// There is no equilibrium at the start, or it cannot be computed.
    #[error("there is no equilibrium to start from: {0}")]
    Start(EquilibriumError),
    /// The start is not in balance; the nearest equilibrium is elsewhere.
    #[error(
        "the start is not in balance: `{coordinate}` is {off:.3e} away from the next equilibrium; start from \
         what `.equilibrium(&start)` gives"
    )]
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
    #[error(
        "nothing resists along `{coordinate}` at the start, whatever the parameter: equilibria lie side by \
         side, or branches meet here; hold that coordinate, or start at another value of the parameter"
    )]
    NotIsolated {
        /// The coordinate along which nothing resists.
        coordinate: &'static str,
    },
    /// Rolling and gliding systems have more positions of rest than the equations can distinguish.
    #[error(
        "what rolls or glides rests in more positions than its equations tell apart, so that there is no one \
         branch; hold the coordinates that only say where it is"
    )]
    Nonholonomic,
    /// The constraints leave no freedom, or no force acts on the remaining freedom.
    #[error(
        "nothing can move that a force acts on, so that there is no equilibrium to be followed; leave a \
         constraint out"
    )]
    NothingMoves,
    /// The range of a parameter is empty, not finite, or narrower than 10⁻⁸ of the parameter (its effect
    /// would be below rounding), or the start is not in it.
    #[error(
        "the range of the parameter, from {from} to {to}, is empty, not finite, without {start}, or \
         so narrow that rounding of the parameter hides what it does; give finite ends in order with \
         `.until(from..=to)`, and count a parameter that hardly changes from a value nearby",
        from = .range[0],
        to = .range[1]
    )]
    Range {
        /// From where to where.
        range: [f64; 2],
        /// The parameter of the start.
        start: f64,
    },
    /// An option makes no sense.
    #[error("`.{name}({value})` makes no sense; give a positive number")]
    Option {
        /// Its name.
        name: &'static str,
        /// What was given.
        value: f64,
    },
    /// A branch of less than two points.
    #[error("`.points({count})` leaves no branch; allow two points or more")]
    Points {
        /// How many were allowed.
        count: usize,
    },
    /// Under load control: equilibria end in a fold, and beyond it there is none nearby.
    #[error(
        "the load cannot be carried beyond {limit:.12} ({parameter}): equilibria end there in a fold; leave \
         load control, and the branch is followed through it, or simulate what happens beyond"
    )]
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
    #[error("the model ends beyond {parameter} of its parameter: {reason}")]
    Model {
        /// The last value of the parameter at which all was well.
        parameter: f64,
        /// What is wrong beyond it.
        reason: EquilibriumError,
        /// What was computed up to there.
        branch: Box<Branch<S>>,
    },
    /// The branch could not be followed any further, however short the steps.
    #[error(
        "the branch could not be followed beyond {parameter} of its parameter, with steps down to \
         {step:.1e}: forces have a corner or a jump there, or the constraints a singular position; round it \
         off, or start beyond it. Or the parameter or a coordinate is so large beside what happens to it \
         that rounding hides it; count it from a place nearby"
    )]
    Stuck {
        /// The last value of the parameter.
        parameter: f64,
        /// The shortest step that was tried.
        step: f64,
        /// What was computed up to there.
        branch: Box<Branch<S>>,
    },
    /// A curve of folds could not be followed any further.
    #[error(fmt = fold_curve)]
    FoldCurve {
        /// The last values of both parameters.
        at: [f64; 2],
        /// What is wrong with the model beyond, if that is why.
        reason: Option<EquilibriumError>,
        /// What was computed up to there.
        curve: Box<FoldCurve<S>>,
    },
    /// A curve of Hopf points could not be followed any further.
    #[error(fmt = hopf_curve)]
    HopfCurve {
        /// The last values of both parameters.
        at: [f64; 2],
        /// What is wrong with the model beyond, if that is why.
        reason: Option<EquilibriumError>,
        /// What was computed up to there.
        curve: Box<HopfCurve<S>>,
    },
    /// The point is no branch point of the branch.
    #[error(
        "no branches meet at {parameter} of the parameter; switch at a pitchfork or a transcritical point of \
         a branch"
    )]
    NoBranchPoint {
        /// The parameter there.
        parameter: f64,
    },
    /// No other branch was found in a branch point.
    #[error(
        "no other branch was found where branches meet at {parameter} of the parameter; the point must be \
         one of this very family, or start on the other branch with an equilibrium that \
         `.equilibrium(&start)` finds"
    )]
    NoOtherBranch {
        /// The parameter there.
        parameter: f64,
    },
    /// Branches leave a point in every direction: a symmetry carries them into each other.
    #[error(
        "branches leave in every direction where several stiffnesses vanish at {parameter} of the parameter: \
         a symmetry tells none from another; hold one coordinate by a constraint, or make the axes a little \
         different"
    )]
    ContinuumOfBranches {
        /// The parameter there.
        parameter: f64,
    },
    /// The start has no fold that could be followed.
    #[error("the point is no fold of the family at these parameters; start from one of `branch.folds()`")]
    NoFold,
    /// The start has no pair of eigenvalues on the imaginary axis that could be followed.
    #[error(
        "the point is no Hopf point of the family at these parameters, nor one in which frequencies meet; \
         start from one of `branch.special` of such a kind"
    )]
    NoHopf,
    /// There is no buckling load: the stiffness does not decrease with the parameter, or the start is not a
    /// stable equilibrium.
    #[error("there is no buckling load: {reason}")]
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

fn fold_curve<S: ModelState>(
    at: &[f64; 2],
    reason: &Option<EquilibriumError>,
    _curve: &FoldCurve<S>,
    f: &mut fmt::Formatter<'_>,
) -> fmt::Result {
    match (at, reason) {
        ([p, r], Some(reason)) => write!(f, "the model ends beyond {p}, {r} of its parameters: {reason}"),
        ([p, r], None) => write!(
            f,
            "the curve of folds could not be followed beyond {p}, {r} of the parameters: forces have a \
             corner there, or it ends in a place where more than one direction does not resist; take \
             shorter steps, or start beyond it"
        ),
    }
}

fn hopf_curve<S: ModelState>(
    at: &[f64; 2],
    reason: &Option<EquilibriumError>,
    _curve: &HopfCurve<S>,
    f: &mut fmt::Formatter<'_>,
) -> fmt::Result {
    match (at, reason) {
        ([p, r], Some(reason)) => write!(f, "the model ends beyond {p}, {r} of its parameters: {reason}"),
        ([p, r], None) => write!(
            f,
            "the curve of Hopf points could not be followed beyond {p}, {r} of the parameters: another \
             pair of eigenvalues meets this one, or damping sets in or vanishes; take shorter steps, or \
             start beyond it"
        ),
    }
}

dynamics_runtime::sentence_for_debugging!(ContinuationError<S: ModelState>);

impl<S: ModelState> From<EquilibriumError> for ContinuationError<S> {
    fn from(error: EquilibriumError) -> Self {
        Self::Start(error)
    }
}

//! The results of a continuation.

use alloc::string::String;
use alloc::vec::Vec;

use dynamics_runtime::model::{ModelState, Quantity};

use super::problem::Direction;
use crate::{EquilibriumError, Stability};

/// A branch of equilibria, or of steady motions, in the order in which it was followed.
#[derive(Clone, Debug, PartialEq)]
pub struct Branch<S: ModelState> {
    /// Its points; never empty.
    pub points: Vec<PointOnBranch<S>>,
    /// Folds, branch points and onsets of flutter on it, in the same order.
    pub special: Vec<SpecialPoint<S>>,
    /// Why it ends.
    pub end: BranchEnd,
    /// What the parameter is called.
    pub parameter: String,
    /// The coordinates.
    pub coordinates: &'static [Quantity],
    /// Steps that were tried and made shorter.
    pub rejected: usize,
    /// The largest relative error of the derivatives by the parameter, which are differences. They steer the
    /// steps. No point depends on them, except for the test that distinguishes branch points from near
    /// misses.
    pub derivative_error: f64,
}

/// A point of a branch.
#[derive(Clone, Debug, PartialEq)]
pub struct PointOnBranch<S: ModelState> {
    /// The parameter.
    pub parameter: f64,
    /// The equilibrium, or steady motion.
    pub state: S,
    /// The length of the branch up to here, in the scales of coordinates and parameter.
    pub arclength: f64,
    /// The verdict, or why there is none.
    pub stability: Result<Stability, EquilibriumError>,
}

/// The stability at a point, according to linear theory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum StabilityClass {
    /// Small disturbances stay small.
    Stable,
    /// Some grow.
    Unstable,
    /// Linear theory does not decide, or there is no verdict.
    Undecided,
}

impl<S: ModelState> PointOnBranch<S> {
    /// The stability according to linear theory.
    #[must_use]
    pub fn stability_class(&self) -> StabilityClass {
        match &self.stability {
            Ok(verdict) if verdict.is_stable() => StabilityClass::Stable,
            Ok(verdict) if verdict.is_unstable() => StabilityClass::Unstable,
            _ => StabilityClass::Undecided,
        }
    }
}

/// A point in which the number of equilibria, or their stability, changes: a bifurcation or a fold.
#[derive(Clone, Debug, PartialEq)]
pub struct SpecialPoint<S: ModelState> {
    /// Its kind.
    pub kind: SpecialKind,
    /// The parameter.
    pub parameter: f64,
    /// The last correction of the parameter, or the width of the interval if it could only be enclosed.
    pub uncertainty: f64,
    /// The equilibrium.
    pub state: S,
    /// The length of the branch up to here.
    pub arclength: f64,
    /// The motion of all coordinates that has no stiffness: the buckling mode, with largest element 1. Zero
    /// at the onset of flutter.
    pub shape: S::Vector,
    /// Directions of this branch and of the one that crosses it, for branch points.
    pub(super) directions: Option<[Direction; 2]>,
}

/// The kind of a special point.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum SpecialKind {
    /// The parameter turns round: a limit point, where two equilibria meet and vanish.
    Fold,
    /// Two more branches, mirror images of each other to first order, leave to one side of the parameter. The
    /// pitchfork is supercritical if they take over the stability, subcritical if they are unstable.
    Pitchfork {
        /// Which of the two.
        supercritical: bool,
    },
    /// Two branches cross, and exchange stability.
    Transcritical,
    /// Branches meet, but their kind is unknown: none could be followed far enough, or both turn round.
    BranchPoint,
    /// Several stiffnesses vanish at once, or too close together to be told apart.
    MultipleBifurcation {
        /// How many.
        count: usize,
    },
    /// A damped pair of eigenvalues passes the imaginary axis: oscillations begin to grow.
    Hopf {
        /// In rad/s.
        frequency: f64,
    },
    /// Two frequencies of an undamped system meet and leave the imaginary axis: flutter begins.
    FrequenciesMeet {
        /// In rad/s.
        frequency: f64,
    },
    /// An oscillating growth becomes a monotonic one here, or the reverse.
    FlutterDivergence {
        /// As e^(growth t), in 1/s.
        growth: f64,
    },
}

impl SpecialKind {
    /// Whether branches meet there, so that [`super::Continuation::switch`] can leave this one.
    #[must_use]
    pub fn is_branch_point(&self) -> bool {
        matches!(self, Self::Pitchfork { .. } | Self::Transcritical | Self::BranchPoint)
    }
}

/// Why a branch ends.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum BranchEnd {
    /// The parameter reached an end of its range.
    Range,
    /// The branch returned to its first point.
    Closed,
    /// The frequency of a curve of Hopf points became zero.
    ZeroFrequency,
    /// The branch reached its maximum number of points.
    Points,
}

impl<S: ModelState> Branch<S> {
    /// The special points of a kind.
    pub fn special_where(
        &self,
        is_meant: impl Fn(&SpecialKind) -> bool,
    ) -> impl Iterator<Item = &SpecialPoint<S>> {
        self.special.iter().filter(move |one| is_meant(&one.kind))
    }

    /// Its folds: limit points.
    pub fn folds(&self) -> impl Iterator<Item = &SpecialPoint<S>> {
        self.special_where(|kind| matches!(kind, SpecialKind::Fold))
    }

    /// Its branch points: pitchforks, transcritical points, and those of unknown kind.
    pub fn branch_points(&self) -> impl Iterator<Item = &SpecialPoint<S>> {
        self.special_where(SpecialKind::is_branch_point)
    }

    /// Least and greatest parameter on it.
    #[must_use]
    pub fn range(&self) -> [f64; 2] {
        let all = self.points.iter().map(|point| point.parameter);
        all.fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], p| [lo.min(p), hi.max(p)])
    }
}

/// Several branches that belong together.
#[derive(Clone, Debug, PartialEq)]
pub struct Diagram<S: ModelState> {
    /// The branches, each once. The first is the one through the start.
    pub branches: Vec<Branch<S>>,
    /// Why others could not be followed: the parameter where they leave, and the reason.
    pub failures: Vec<(f64, String)>,
    /// The number of branches, or of branch points, that were not followed because of the limit of branches.
    pub left_out: usize,
}

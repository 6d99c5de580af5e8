//! Curves of folds and of Hopf points, as far as they were followed.

use alloc::vec::Vec;

use dynamics_runtime::model::{ModelState, Quantity};

use super::branch::BranchEnd;

/// A curve of folds in the plane of two parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct FoldCurve<S: ModelState> {
    /// Both parameters and the equilibrium in the fold, along the curve.
    pub points: Vec<([f64; 2], S)>,
    /// Cusps, in which two curves of folds meet and vanish. Each lies between the point of this index and the
    /// one before it; both parameters have an extremum there.
    pub cusps: Vec<usize>,
    /// Why it ends.
    pub end: BranchEnd,
    /// The coordinates.
    pub coordinates: &'static [Quantity],
}

/// A curve of Hopf points in the plane of two parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct HopfCurve<S: ModelState> {
    /// Both parameters and the equilibrium in the Hopf point, along the curve.
    pub points: Vec<([f64; 2], S)>,
    /// The frequency in each, in rad/s.
    pub frequencies: Vec<f64>,
    /// Why it ends.
    pub end: BranchEnd,
    /// The coordinates.
    pub coordinates: &'static [Quantity],
}

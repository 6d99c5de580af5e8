//! Branches of equilibria as a parameter changes: folds, branch points, the onset of flutter, and the
//! stability between them.
//!
//! ```text
//! let arch = continuation(|load| Truss { load, ..truss.clone() }).from(&start, 0.0).until(0.0..=50.0);
//! let branch = arch.run()?;                          // through every limit point
//! let diagram = arch.branches(10)?;                  // and on all branches that are connected to it
//! arch.load_controlled().run()?;                     // the error says where the load can no more be carried
//! ```
//!
//! A closure makes the model from a value of the parameter. The parameter can be any field or several
//! together, a length as well as a load. Along the branch the equilibria are those of [`super::Equilibria`],
//! constraints and reactions included, with the same coordinates and exact derivatives. Only the closure
//! depends on the parameter, so derivatives by it are differences of exact forces, with a measured error.
//! They steer steps and give the directions of branches. Equilibria and points of singular stiffness are
//! computed from forces and stiffness alone.
//!
//! Time is held. If forces change with time, even at later times alone, there is no equilibrium, and branches
//! and curves end. Forces are sampled at three times in each point, and at all times of
//! [`Analyze::equilibrium`](crate::Analyze::equilibrium) in the last point and in special points.
//!
//! Terms are those of AUTO, MatCont and BifurcationKit: folds (limit points), branch points, Hopf points;
//! natural continuation is load control. Switched constraints keep the on/off state of the start. R. Seydel,
//! *Practical Bifurcation and Stability Analysis*; E. L. Allgower & K. Georg, *Introduction to Numerical
//! Continuation Methods*.

mod branch;
mod branch_classification;
mod buckling;
mod curve;
mod error;
mod flutter;
mod fold_curve;
mod followed_curves;
mod hopf_curve;
mod hopf_test_function;
mod locate;
mod multiple_bifurcation;
mod newton;
mod null_space;
mod problem;
mod scaling;
mod show;
mod step_control;
mod switch;
mod test_functions;
mod trace;

use alloc::borrow::ToOwned;
use alloc::string::String;
use core::ops::RangeInclusive;

use dynamics_runtime::model::{Constraints, ModelState, Powers, Vector};
use nalgebra::DMatrix;

pub use branch::{Branch, BranchEnd, Diagram, PointOnBranch, SpecialKind, SpecialPoint, StabilityClass};
pub use buckling::{Buckling, CriticalLoad};
pub use curve::PlaneCurve;
pub use error::ContinuationError;
pub use fold_curve::{FoldCurves, OfFolds, fold_curve};
pub use followed_curves::{FoldCurve, HopfCurve};
pub use hopf_curve::{HopfCurves, OfHopfPoints, hopf_curve};

use super::equilibria::{EquilibriumOptions, find, has_nonholonomic_rows, periodic, scales};
use null_space::null_plane;
use problem::{ContinuationPoint, ContinuationProblem, Direction, is_range};
use trace::{ContinuationOptions, Sample, Tracer, check_near};

/// The first step unless given. A branch whose scales are right begins with a few steps of this length; a
/// longer one would often be halved.
const DEFAULT_FIRST_STEP: f64 = 0.01;
/// The longest step unless given: a branch along which the parameter crosses its range has twenty points at
/// least, which draw a chart.
const DEFAULT_LONGEST_STEP: f64 = 0.05;
/// The shortest step. If a shorter one would be needed, the branch cannot be followed any further. Points are
/// accurate to some 10⁻¹⁵, so that the tangent over a step is known to six digits.
const SHORTEST_STEP: f64 = 1e-9;
/// Largest number of points of a branch unless given. It ends branches that never leave the range.
const DEFAULT_POINTS: usize = 2000;
/// If the ratio of the smallest to the largest singular value of [K, F_p] at the start is below this, in
/// scales of coordinates and with forces weighted by inertia, the branch has no unique direction. Rounding
/// leaves about 10⁻¹⁶, differences by the parameter 10⁻¹³. A larger value refuses starts near branch
/// points.
const RANK_TOLERANCE_AT_START: f64 = 1e-12;
/// Where ignorable coordinates are looked for beside the start: changes of the coordinates in their scales,
/// and of the parameter in its range. No symmetry of a model maps these points to each other or to the start.
const IGNORABLE_PROBES: [[f64; 2]; 2] = [[0.037, 1e-3], [-0.071, -1e-3]];
/// Rows and columns of [K, F_p] below this share of the largest element are zero, up to rounding. A
/// coordinate with a real stiffness below that is taken for an ignorable one, and stands still.
const IGNORABLE_SHARE: f64 = 1e-14;

/// A family of models: one for each value of a parameter.
#[must_use = "a family does nothing by itself; go on with `.from(&start, value)`"]
pub struct Family<F> {
    make: F,
}

/// Opens the continuation of a family of models.
///
/// ```text
/// continuation(|stiffness| Truss { stiffness, ..truss.clone() }).from(&start, 10.0).until(1.0..=10.0).run()?
/// ```
pub fn continuation<M: Constraints + Powers, F: Fn(f64) -> M>(make: F) -> Family<F> {
    Family { make }
}

impl<F> Family<F> {
    /// Starts from an equilibrium at a value of the parameter. Velocities other than 0 must belong to cyclic
    /// coordinates; they are kept (a steady motion).
    pub fn from<M: Constraints + Powers>(self, start: &M::State, value: f64) -> Continuation<M, F>
    where
        F: Fn(f64) -> M,
    {
        let options = ContinuationOptions {
            name: "parameter".to_owned(),
            range: [f64::NAN; 2],
            first: DEFAULT_FIRST_STEP,
            longest: DEFAULT_LONGEST_STEP,
            shortest: SHORTEST_STEP,
            points: DEFAULT_POINTS,
            load_control: false,
            #[cfg(feature = "progress")]
            progress: false,
        };
        Continuation { make: self.make, start: *start, value, forward: None, options }
    }
}

/// A continuation with its options, before it runs.
#[must_use = "a continuation does nothing until `.run()`"]
#[derive(Clone)]
pub struct Continuation<M: Constraints, F> {
    make: F,
    start: M::State,
    value: f64,
    forward: Option<bool>,
    options: ContinuationOptions,
}

impl<M: Constraints + Powers, F: Fn(f64) -> M> Continuation<M, F> {
    /// The range of the parameter. The branch ends exactly at its ends. Its width is the scale of the
    /// parameter.
    pub fn until(mut self, range: RangeInclusive<f64>) -> Self {
        self.options.range = [*range.start(), *range.end()];
        self
    }

    /// What the parameter is called, with its unit, in charts and messages: `load in N`.
    pub fn named(mut self, name: impl Into<String>) -> Self {
        self.options.name = name.into();
        self
    }

    /// Begins toward smaller values of the parameter. Without this the branch begins toward larger values,
    /// unless the start is at the upper end of the range. If the start is a fold, this chooses the side; the
    /// fold is then the first special point.
    pub fn backward(mut self) -> Self {
        self.forward = Some(false);
        self
    }

    /// The longest step, 0.05 unless given. Its length adds up changes of the parameter in parts of its
    /// range, of angles in rad, and of other coordinates in the largest value of their unit at the start. If
    /// that value is no scale, the distance counts over which the stiffness changes noticeably.
    pub fn longest_step(mut self, length: f64) -> Self {
        self.options.longest = length;
        self
    }

    /// The first step, 0.01 unless given.
    pub fn first_step(mut self, length: f64) -> Self {
        self.options.first = length;
        self
    }

    /// Most points of a branch, two or more: 2,000 unless given.
    pub fn points(mut self, count: usize) -> Self {
        self.options.points = count;
        self
    }

    /// Load control: prescribes the parameter, as weights in a testing machine do. The run fails at the first
    /// limit point; the error has the limit load and all that was computed.
    pub fn load_controlled(mut self) -> Self {
        self.options.load_control = true;
        self
    }

    /// Shows a progress bar on the error stream, by points of the most that are allowed, where a branch takes
    /// longer than a second.
    #[cfg(feature = "progress")]
    pub fn progress(mut self) -> Self {
        self.options.progress = true;
        self
    }

    /// Follows the branch.
    ///
    /// # Errors
    /// A start that is not an equilibrium, or not an isolated one; invalid options; a model that becomes
    /// impossible on the way; under load control, the limit load. The last two contain the branch up to
    /// there.
    pub fn run(self) -> Result<Branch<M::State>, ContinuationError<M::State>> {
        let forward = self.forward.unwrap_or(self.value < self.options.range[1]);
        self.with_problem(|problem, periodic| self.run_direction(problem, periodic, forward))
    }

    fn run_direction(
        &self,
        problem: &ContinuationProblem<'_, M>,
        periodic: &[bool],
        forward: bool,
    ) -> Result<Branch<M::State>, ContinuationError<M::State>> {
        let tracer = Tracer::new(problem, &self.options, periodic);
        tracer.run(self.first_sample(problem, if forward { 1.0 } else { -1.0 })?, false)
    }

    /// Checks the options, and calls `f` with the problem that they pose and with which coordinates are
    /// periodic.
    fn with_problem<R>(
        &self,
        f: impl FnOnce(&ContinuationProblem<'_, M>, &[bool]) -> Result<R, ContinuationError<M::State>>,
    ) -> Result<R, ContinuationError<M::State>> {
        let range @ [lo, hi] = self.options.range;
        if !is_range(range, self.value) {
            return Err(ContinuationError::Range { range, start: self.value });
        }
        for (name, value) in [("first_step", self.options.first), ("longest_step", self.options.longest)] {
            if !(value.is_finite() && value > self.options.shortest) {
                return Err(ContinuationError::Option { name, value });
            }
        }
        if self.options.points < 2 {
            return Err(ContinuationError::Points { count: self.options.points });
        }
        if has_nonholonomic_rows::<M>(&self.start) {
            return Err(ContinuationError::Nonholonomic);
        }
        let make = |p: [f64; 2]| (self.make)(p[0]);
        let model = make([self.value, 0.0]);
        let scales = scales(M::COORDINATES, self.start.q().as_slice());
        let mut problem = ContinuationProblem {
            make: &make,
            count: 1,
            scales,
            widths: [hi - lo, 1.0],
            fixed: alloc::vec::Vec::new(),
        };
        let place = self.start_in_balance(&model, &problem)?;
        let periodic = periodic(&model, &place.state);
        problem.prepare(&place)?;
        f(&problem, &periodic)
    }

    /// The equilibrium at the start, to rounding. A start that is not near it is refused.
    fn start_in_balance(
        &self,
        model: &M,
        problem: &ContinuationProblem<'_, M>,
    ) -> Result<ContinuationPoint<M::State>, ContinuationError<M::State>> {
        let moving = self.start.u().as_slice().iter().any(|u| *u != 0.0);
        let found = find(model, &self.start, EquilibriumOptions { moving, ..EquilibriumOptions::REST })?;
        let uncertainty = found.uncertainty.as_slice();
        check_near(&self.start, &found.state, &problem.scales, uncertainty, M::COORDINATES)?;
        Ok(ContinuationPoint { state: found.state, p: [self.value, 0.0] })
    }

    /// The first point of the branch, with the tangent along which the parameter changes by this sign.
    fn first_sample(
        &self,
        problem: &ContinuationProblem<'_, M>,
        sign: f64,
    ) -> Result<Sample<M>, ContinuationError<M::State>> {
        let model = problem.model([self.value, 0.0])?;
        let place = self.start_in_balance(&model, problem)?;
        let balance = problem.balance(&place, &[])?;
        let not_isolated = || ContinuationError::NotIsolated { coordinate: M::COORDINATES[0].name };
        let [direction, _] = null_plane(problem, &balance).ok_or_else(not_isolated)?;
        let along = direction.scaled(if direction.p[0] * sign < 0.0 { -1.0 } else { 1.0 });
        let tracer = Tracer::new(problem, &self.options, &[]);
        tracer.sample(balance, &along).map_err(|missed| match missed {
            newton::CorrectorError::Model(error) => ContinuationError::Start(error),
            newton::CorrectorError::NotConverged => not_isolated(),
        })
    }
}

impl<M: Constraints> ContinuationProblem<'_, M> {
    /// Finds the coordinates that no force depends on, and the scales of the others.
    fn prepare(&mut self, place: &ContinuationPoint<M::State>) -> Result<(), ContinuationError<M::State>> {
        let balance = self.balance(place, &[])?;
        self.fixed = self.ignorable(&balance);
        let balance = self.balance(place, &[])?;
        if balance.size() == 0 {
            return Err(ContinuationError::NothingMoves);
        }
        if let Some(singular) = self.rank_deficiency(&balance) {
            return Err(ContinuationError::NotIsolated { coordinate: M::COORDINATES[singular].name });
        }
        let unmoved = self.set_scales_of_zeros(place, &balance);
        self.set_length_scales(&balance, &unmoved);
        Ok(())
    }

    /// The coordinate that moves most in the null space of the forces, if [K, F_p] has not full rank: then
    /// equilibria are a continuum at one value of the parameter, or the start is a branch point.
    fn rank_deficiency(&self, balance: &problem::Balance<M>) -> Option<usize> {
        let weighted = balance.jacobian_per_inertia()?;
        let (n, unknowns) = weighted.shape();
        let scaled = DMatrix::from_fn(n, unknowns, |i, j| weighted[(i, j)] * self.scale_of(balance, j));
        if !scaled.iter().all(|x| x.is_finite()) {
            return None;
        }
        let values = scaled.clone().svd(false, false).singular_values;
        let ratio = values.min() / values.max().max(f64::MIN_POSITIVE);
        (ratio <= RANK_TOLERANCE_AT_START).then(|| {
            let square = (&scaled * scaled.transpose()).symmetric_eigen();
            let left = square.eigenvectors.column(square.eigenvalues.imin()).iamax();
            balance.statics.tangent.coordinates[balance.free[left]]
        })
    }

    /// Independent coordinates that no force depends on and on which none acts, at the start and at two
    /// positions beside it, whatever the parameter.
    fn ignorable(&self, balance: &problem::Balance<M>) -> alloc::vec::Vec<usize> {
        let coordinates = &balance.statics.tangent.coordinates;
        let mut places = alloc::vec![balance.place];
        for [of_q, of_p] in IGNORABLE_PROBES {
            let by = nalgebra::DVector::from_fn(balance.lift.ncols(), |j, _| match j < balance.size() {
                true => of_q * self.scale_of(balance, j) / (1.0 + j as f64),
                false => of_p * self.widths[j - balance.size()],
            });
            let nearby = self.moved(&balance.place, &balance.direction(&by, self.count));
            places.extend(self.projected(&nearby, &balance.statics));
        }
        let there: alloc::vec::Vec<_> =
            places.iter().filter_map(|place| self.balance(place, coordinates).ok()).collect();
        let nothing = |k: &usize| {
            there.len() >= 2
                && there.iter().all(|one| {
                    let zero = IGNORABLE_SHARE * one.jacobian.amax();
                    one.statics.tangent.coordinates == *coordinates
                        && one.jacobian.row(*k).amax() <= zero
                        && one.jacobian.column(*k).amax() <= zero
                })
        };
        (0..coordinates.len()).filter(nothing).map(|k| coordinates[k]).collect()
    }
}

/// The direction of length zero.
fn zero_direction(n: usize) -> Direction {
    Direction { q: nalgebra::DVector::zeros(n), p: [0.0; 2] }
}

//! Buckling loads as an eigenvalue problem.
//!
//! Along the branch through the start the stiffness is K₀ + (p − p₀) K₁ to first order, with
//! K₁ = dK/dp along the branch. It vanishes along x if
//!
//! ```text
//! K₀ x = −(p − p₀) K₁ x
//! ```
//!
//! (linear buckling analysis: Z. P. Bažant & L. Cedolin, *Stability of Structures*, chapter 4). K₀ is
//! exact, K₁ a difference of exact stiffnesses. If K is linear in the parameter, as in columns that stay
//! straight, the loads are those of the branch points. The deviation from linearity is measured for each
//! load. Branch points that [`super::Continuation::run`] locates do not need this assumption.

use alloc::string::String;
use alloc::vec::Vec;

use dynamics_runtime::model::{Constraints, ModelState, Powers, Quantity};
use nalgebra::{DMatrix, DVector};

use super::null_space::null_plane;
use super::problem::{Balance, ContinuationProblem, Direction, difference};
use super::trace::{Tracer, shape};
use super::{Continuation, ContinuationError};
use crate::equilibria::EquilibriumError;

/// Shares of the way to the first load at which forces must not change with time: beside the start, half-way,
/// and at the load.
const TIME_CHECK_SHARES: [f64; 3] = [1e-3, 0.5, 1.0];

/// Stiffnesses whose elements differ from their transposed by more than this share of the largest one have no
/// potential. K₁ is a difference with an error of up to about 10⁻¹¹; follower loads leave more than
/// 10⁻⁹ unless they are that small a share of all loads.
const MAX_ASYMMETRY: f64 = 1e-9;
/// Eigenvalues below this share of the largest are zero: the stiffness of that mode does not depend on the
/// parameter, and its load is infinite.
const ZERO_EIGENVALUE: f64 = 1e-12;

/// The loads at which a structure buckles, by linear theory.
#[derive(Clone, Debug, PartialEq)]
pub struct Buckling<S: ModelState> {
    /// The loads in the direction in which the parameter is followed, the nearest first.
    pub loads: Vec<CriticalLoad<S>>,
    /// What the parameter is called.
    pub parameter: String,
    /// The coordinates.
    pub coordinates: &'static [Quantity],
}

/// A load at which a structure buckles, with its mode.
#[derive(Clone, Debug, PartialEq)]
pub struct CriticalLoad<S: ModelState> {
    /// The value of the parameter.
    pub parameter: f64,
    /// The buckling mode in all coordinates, with largest element 1.
    pub shape: S::Vector,
    /// ‖K(p) x‖ ∞ against ‖K₀ x‖ ∞ at this load, on the straight continuation of the branch: at
    /// rounding level if linear theory is exact; at 0.1 it is of little use.
    pub nonlinearity: f64,
}

impl<M: Constraints + Powers, F: Fn(f64) -> M> Continuation<M, F> {
    /// The loads at which the structure buckles, from stiffness and its change with the parameter at the
    /// start.
    ///
    /// # Errors
    /// A start that is not a stable equilibrium; forces without a potential, or that change with time on the
    /// way; no buckling in this direction.
    pub fn buckling(&self) -> Result<Buckling<M::State>, ContinuationError<M::State>> {
        let forward = self.forward.unwrap_or(self.value < self.options.range[1]);
        self.with_problem(|problem, _| {
            let first = self.first_sample(problem, if forward { 1.0 } else { -1.0 })?;
            let loads = critical_loads(problem, &first.balance, if forward { 1.0 } else { -1.0 })?;
            if let Err(reason) = check_times_up_to(problem, &first.balance, loads[0].parameter) {
                let mut tracer = Tracer::new(problem, &self.options, &[]);
                tracer.push_point(&first, 0.0);
                return Err(tracer.ended_by_time(1, reason));
            }
            Ok(Buckling { loads, parameter: self.options.name.clone(), coordinates: M::COORDINATES })
        })
    }
}

/// Checks that forces do not change with time on the way to the first load: on the branch, or on its straight
/// continuation if the branch is not found.
fn check_times_up_to<M: Constraints>(
    problem: &ContinuationProblem<'_, M>,
    balance: &Balance<M>,
    load: f64,
) -> Result<(), EquilibriumError> {
    if !M::EXPLICIT_TIME {
        return Ok(());
    }
    let Some([direction, _]) = null_plane(problem, balance) else { return Ok(()) };
    let whole = direction.scaled((load - balance.place.p[0]) / direction.p[0]);
    let normal = Direction { q: &direction.q * 0.0, p: [1.0, 0.0] };
    for part in TIME_CHECK_SHARES {
        let step = whole.scaled(part);
        let guess = problem.moved(&balance.place, &step);
        let coordinates = &balance.statics.tangent.coordinates;
        let found =
            problem.solve(&guess, coordinates, Some((&normal, &guess)), None, 0.5 * problem.norm(&step));
        let straight = || problem.projected(&guess, &balance.statics);
        let Some(place) = found.ok().map(|found| found.balance.place).or_else(straight) else { continue };
        problem.check_times(&place)?;
    }
    Ok(())
}

/// The loads in the direction `sign` of the parameter, from the generalized eigenvalue problem.
fn critical_loads<M: Constraints>(
    problem: &ContinuationProblem<'_, M>,
    balance: &Balance<M>,
    sign: f64,
) -> Result<Vec<CriticalLoad<M::State>>, ContinuationError<M::State>> {
    let none = |reason: &'static str| ContinuationError::NoBuckling { reason };
    let [direction, _] = null_plane(problem, balance).ok_or_else(|| none("the start is singular"))?;
    if direction.p[0] == 0.0 {
        return Err(none("the start is a fold"));
    }
    let direction = direction.scaled(1.0 / direction.p[0]);
    // K₀, and the stiffness along the branch.
    let n = balance.size();
    let here = balance.stiffness();
    // The straight continuation of the branch, back on the constraints.
    let stiffness_at = |change: f64| {
        let place =
            problem.projected(&problem.moved(&balance.place, &direction.scaled(change)), &balance.statics)?;
        let there = problem.statics(&place, &balance.statics.tangent.coordinates).ok()?;
        let same = there.tangent.coordinates == balance.statics.tangent.coordinates;
        same.then(|| there.stiffness.select_rows(&balance.free).select_columns(&balance.free))
    };
    // K₁, a difference along the branch.
    let column = |k: DMatrix<f64>| DVector::from_column_slice(k.as_slice());
    let (slope, _) = difference(0.0, problem.widths[0], |change| stiffness_at(change).map(column))?;
    let slope = DMatrix::from_column_slice(n, n, slope.as_slice());
    let is_asymmetric = |k: &DMatrix<f64>| (k - k.transpose()).amax() > MAX_ASYMMETRY * k.amax();
    if is_asymmetric(&here) || is_asymmetric(&slope) {
        return Err(none(
            "the loads have no potential, and flutter may come first; follow the branch with `.run()`",
        ));
    }
    // With K₀ = L Lᵀ the problem is symmetric: L⁻¹ K₁ L⁻ᵀ y = −1/(p − p₀) y.
    let symmetric_part = |k: &DMatrix<f64>| 0.5 * (k + k.transpose());
    let lower = symmetric_part(&here).cholesky().map(nalgebra::Cholesky::unpack);
    let lower = lower.ok_or_else(|| none("the start is not stable; start below the first buckling load"))?;
    let solve = |right: &DMatrix<f64>| lower.solve_lower_triangular(right);
    let reduced = solve(&symmetric_part(&slope)).and_then(|half| solve(&half.transpose()));
    let reduced = symmetric_part(&reduced.ok_or_else(|| none("the start is singular"))?);
    let eigen = reduced.symmetric_eigen();
    // Loads in the wanted direction, with their modes.
    let most = eigen.eigenvalues.amax();
    let mut loads = Vec::new();
    for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        let change = -1.0 / value;
        if value.abs() <= ZERO_EIGENVALUE * most || change * sign <= 0.0 {
            continue;
        }
        let Some(x) = lower.tr_solve_lower_triangular(&vector.into_owned()) else { continue };
        let nonlinearity = stiffness_at(change).map_or(f64::NAN, |k| (k * &x).amax() / (&here * &x).amax());
        let mut unknowns = DVector::zeros(n + problem.count);
        unknowns.rows_mut(0, n).copy_from(&x);
        let mode: Direction = balance.direction(&unknowns, problem.count);
        loads.push(CriticalLoad {
            parameter: balance.place.p[0] + change,
            shape: shape(&mode),
            nonlinearity,
        });
    }
    if loads.is_empty() {
        return Err(none("stiffness does not become less as the parameter goes this way"));
    }
    loads.sort_by(|a, b| (a.parameter * sign).total_cmp(&(b.parameter * sign)));
    Ok(loads)
}

//! Newton's method for points on a branch, and for its singular points.
//!
//! A point on a branch is the intersection of F = 0 with a plane ⟨n, x − x₀⟩ = 0 of x = (q, p)
//! (H. B. Keller, in *Applications of Bifurcation Theory*, 1977; E. L. Allgower & K. Georg, *Introduction to
//! Numerical Continuation Methods*). K is singular where g = 0 in the bordered system
//!
//! ```text
//! [K  b] [v]   [0]        a fold:          F = 0,        g = 0                      for z, p
//! [cᵀ 0] [g] = [1]        a branch point:  F + β b = 0,  g = 0,  f = wᵀF_p = 0      for z, p, β
//! ```
//!
//! with w from the transposed system, and β = 0 in the end (A. Griewank & G. W. Reddien, IMA J. Numer. Anal.
//! 4 (1984) 295; G. Moore, Numer. Funct. Anal. Optim. 2 (1980) 441). Both systems are regular at the points
//! that they solve for, unlike the equations of a branch, so no digits are lost. g and f are exact except for
//! F_p. Their slopes are differences, which only steer the iteration.

use alloc::vec::Vec;

use dynamics_runtime::model::Constraints;
use nalgebra::{DMatrix, DVector};

use super::hopf_test_function::HopfTest;
use super::problem::{Balance, ContinuationPoint, ContinuationProblem, Direction};
use crate::equilibria::{Equilibrated, EquilibriumError, ZERO_SINGULAR_VALUE};
use crate::linearize::matrix_eigenvalues;

/// Largest number of corrections. The iteration converges quadratically from a guess at the distance of a
/// step, so that more than eight corrections mean a step that was too long. The rest is for roots of
/// multiplicity three, where each correction takes a third of the error.
const MAX_CORRECTIONS: usize = 12;
/// From corrections of this length on, in the scales of the unknowns, the iteration ends as soon as a
/// correction is more than half of the last. Quadratic convergence makes the next one 10⁻¹⁶, which is
/// rounding.
const CONVERGED_CORRECTION: f64 = 1e-8;
/// Step of the central differences for the slopes of g and f, in the scales of the unknowns. It is near the
/// cube root of the rounding unit, 6·10⁻⁶, where truncation and rounding are alike. The slopes only
/// steer the iteration.
const SLOPE_STEP: f64 = 1e-5;

/// Largest value of a test at a computed point, relative to its change over the scale of an unknown. Slopes
/// are central differences with an error of some 10⁻¹⁰, so that a converged test is far below this.
const MAX_TEST_RESIDUAL: f64 = 1e-7;
/// If the ratio of the smallest to the largest pivot of a balanced matrix is below this, the system is solved
/// by singular values instead of by elimination: fewer than four digits would be left.
const MIN_PIVOT_RATIO: f64 = 1e-12;

/// A further equation for a point beside balance: K is singular, or has eigenvalues on the imaginary axis.
pub(super) struct SingularityCondition {
    /// A branch point: F_p lies in the range of K, too.
    pub(super) branching: bool,
    /// If given, a pair of eigenvalues on the imaginary axis is asked for instead of a singular K.
    pub(super) hopf: Option<HopfTest>,
    /// The borders b and c.
    pub(super) borders: [DVector<f64>; 2],
    /// The independent coordinates that b, c, and all slopes belong to.
    pub(super) coordinates: Vec<usize>,
}

impl SingularityCondition {
    /// The condition that K is singular, with borders for a point near the singular one. They are the left
    /// and the right singular vector of the eigenvalue μ of the stiffness per inertia that is nearest to
    /// `soft`, or to zero if `soft` is `None`. Forces and displacements are weighted by inertia, so that the
    /// result does not depend on units, and a soft direction is not mistaken for a singular one.
    pub(super) fn near<M: Constraints>(
        balance: &Balance<M>,
        branching: bool,
        soft: Option<f64>,
    ) -> Option<Self> {
        let (lower, k) = balance.stiffness_per_inertia()?;
        let n = k.nrows();
        let real = matrix_eigenvalues(k.clone()).ok()?.into_iter().filter(|x| x.im == 0.0).map(|x| x.re);
        let wanted = soft.unwrap_or(0.0);
        let mu = real.min_by(|a, b| (a - wanted).abs().total_cmp(&(b - wanted).abs()))?;
        let svd = (k - DMatrix::identity(n, n) * mu).try_svd(true, true, f64::EPSILON, 1000)?;
        let least = svd.singular_values.imin();
        let (left, right) = (svd.u?.column(least).into_owned(), svd.v_t?.row(least).transpose());
        let coordinates = balance.statics.tangent.coordinates.clone();
        Some(Self { branching, hopf: None, borders: [&lower * left, lower * right], coordinates })
    }

    /// The condition that a pair of eigenvalues lies on the imaginary axis, or that two pairs are equal.
    pub(super) fn imaginary_pair<M: Constraints>(balance: &Balance<M>, hopf: HopfTest) -> Self {
        let none = DVector::zeros(balance.size());
        let coordinates = balance.statics.tangent.coordinates.clone();
        Self { branching: false, hopf: Some(hopf), borders: [none.clone(), none], coordinates }
    }

    /// The number of equations that the condition adds.
    fn count(&self) -> usize {
        1 + usize::from(self.branching)
    }

    /// g, and f at branch points, from the bordered system of the stiffness `k`.
    fn tests(&self, k: &DMatrix<f64>, by_p: impl Fn() -> Option<DVector<f64>>) -> Option<Vec<f64>> {
        let (n, [b, c]) = (k.nrows(), &self.borders);
        let mut bordered = DMatrix::zeros(n + 1, n + 1);
        bordered.view_mut((0, 0), (n, n)).copy_from(k);
        bordered.view_mut((0, n), (n, 1)).copy_from(b);
        bordered.view_mut((n, 0), (1, n)).copy_from(&c.transpose());
        let mut right = DVector::zeros(n + 1);
        right[n] = 1.0;
        let of_v = linear(&bordered, &right)?;
        let mut found = alloc::vec![of_v[n]];
        if self.branching {
            found.push(linear(&bordered.transpose(), &right)?.rows(0, n).dot(&by_p()?));
        }
        Some(found)
    }

    /// The same at another point; `None` if its independent coordinates are others.
    fn tests_at<M: Constraints>(
        &self,
        problem: &ContinuationProblem<'_, M>,
        place: &ContinuationPoint<M::State>,
    ) -> Option<Vec<f64>> {
        if let Some(hopf) = &self.hopf {
            return Some(alloc::vec![hopf.test(&problem.model(place.p).ok()?, &place.state)?]);
        }
        if self.branching {
            let there = problem.balance(place, &self.coordinates).ok()?;
            (there.statics.tangent.coordinates == self.coordinates)
                .then(|| self.tests(&there.stiffness(), || Some(there.by_parameter(0))))?
        } else {
            let there = problem.statics(place, &self.coordinates).ok()?;
            let free = problem.free(&there);
            let k = there.stiffness.select_rows(&free).select_columns(&free);
            (there.tangent.coordinates == self.coordinates).then(|| self.tests(&k, || None))?
        }
    }

    /// g and f, and a row of their slopes by all unknowns.
    pub(super) fn values_and_slopes<M: Constraints>(
        &self,
        problem: &ContinuationProblem<'_, M>,
        balance: &Balance<M>,
    ) -> Option<(Vec<f64>, DMatrix<f64>)> {
        let here = match &self.hopf {
            Some(hopf) => alloc::vec![hopf.test(&balance.model, &balance.place.state)?],
            None => self.tests(&balance.stiffness(), || Some(balance.by_parameter(0)))?,
        };
        let unknowns = balance.lift.ncols();
        let mut slopes = DMatrix::zeros(self.count(), unknowns);
        for j in 0..unknowns {
            let mut unit = DVector::zeros(unknowns);
            unit[j] = SLOPE_STEP * problem.scale_of(balance, j);
            let moved = |sign: f64| {
                let by = balance.direction(&(&unit * sign), problem.count);
                let place = problem.projected(&problem.moved(&balance.place, &by), &balance.statics)?;
                self.tests_at(problem, &place)
            };
            let (above, below) = (moved(1.0)?, moved(-1.0)?);
            (0..self.count()).for_each(|i| slopes[(i, j)] = (above[i] - below[i]) / (2.0 * unit[j]));
        }
        Some((here, slopes))
    }
}

/// A point that Newton's method computed.
pub(super) struct CorrectedPoint<M: Constraints> {
    pub(super) balance: Balance<M>,
    pub(super) iterations: usize,
    /// The error of the first parameter: its last change, and the sum of the further ones if corrections go
    /// on falling as slowly as at last.
    pub(super) parameter_error: f64,
    /// β, the push that a branch point needs to be in balance: zero if branches meet.
    pub(super) beta: f64,
}

/// Why Newton's method computed no point.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum CorrectorError {
    /// The iteration did not converge, or went too far.
    NotConverged,
    /// The model has no finite forces there, or its constraints cannot be followed.
    Model(EquilibriumError),
}

impl<M: Constraints> ContinuationProblem<'_, M> {
    /// The row ⟨n, ·⟩ of the plane with normal n, by the unknowns.
    pub(super) fn plane_row(&self, normal: &Direction, balance: &Balance<M>) -> DVector<f64> {
        let n = balance.size();
        DVector::from_fn(n + self.count, |j, _| {
            let mut unit = DVector::zeros(n + self.count);
            unit[j] = 1.0;
            self.dot(normal, &balance.direction(&unit, self.count))
        })
    }

    /// Newton's method from a guess to a point in balance. `plane` is a normal and a point of the plane in
    /// which it lies. `singular` is a further condition. Points farther than `reach` from the guess are
    /// refused.
    pub(super) fn solve(
        &self,
        guess: &ContinuationPoint<M::State>,
        preferred: &[usize],
        plane: Option<(&Direction, &ContinuationPoint<M::State>)>,
        singular: Option<&SingularityCondition>,
        reach: f64,
    ) -> Result<CorrectedPoint<M>, CorrectorError> {
        let (mut place, mut last, mut beta) = (*guess, f64::INFINITY, 0.0);
        for iterations in 0..MAX_CORRECTIONS {
            let balance = self.balance(&place, preferred).map_err(CorrectorError::Model)?;
            let (matrix, right) =
                self.system(&balance, plane, singular, beta).ok_or(CorrectorError::NotConverged)?;
            let n = balance.size();
            let step = linear(&matrix, &-&right).ok_or(CorrectorError::NotConverged)?;
            let scales = DVector::from_fn(n + self.count, |j, _| self.scale_of(&balance, j));
            let correction = balance.direction(&step, self.count);
            let correction = Direction { q: &correction.q + &balance.offset, ..correction };
            let change = self.norm(&correction);
            let away = self.distance(guess, &self.moved(&place, &correction));
            if !(change.is_finite() && away <= reach) {
                return Err(CorrectorError::NotConverged);
            }
            if change <= CONVERGED_CORRECTION && (change <= 4.0 * f64::EPSILON || change >= 0.5 * last) {
                // Corrections no longer shrink. The point is accepted if the residuals are rounding, too.
                if !balance.is_balanced(change).map_err(CorrectorError::Model)? {
                    return Err(CorrectorError::NotConverged);
                }
                if singular.is_some_and(|singular| {
                    !tests_are_zero(&matrix, &right, n..n + singular.count(), &scales)
                }) {
                    return Err(CorrectorError::NotConverged);
                }
                let rate = change / last;
                // Linear convergence means a multiple root. For multiplicity three, the largest expected,
                // the error is up to three times the geometric sum of the corrections.
                let series = if rate > 0.5 && rate < 1.0 { 3.0 / (1.0 - rate) } else { 1.0 };
                return Ok(CorrectedPoint {
                    balance,
                    iterations,
                    parameter_error: correction.p[0].abs() * series,
                    beta,
                });
            }
            last = change;
            if singular.is_some_and(|singular| singular.branching) {
                beta += step[n + self.count];
            }
            place = self.moved(&place, &correction);
        }
        Err(CorrectorError::NotConverged)
    }

    /// Matrix and residual of the equations for a step of all unknowns: the n equations of balance, the
    /// tests of `singular`, and the plane. The unknowns are z, the parameters, and β at branch points.
    fn system(
        &self,
        balance: &Balance<M>,
        plane: Option<(&Direction, &ContinuationPoint<M::State>)>,
        singular: Option<&SingularityCondition>,
        beta: f64,
    ) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let (n, count) = (balance.size(), self.count);
        let tests = singular.map_or(0, SingularityCondition::count);
        let unknowns = n + count + usize::from(tests == 2);
        let mut matrix = DMatrix::zeros(unknowns, unknowns);
        let mut right = DVector::zeros(unknowns);
        matrix.view_mut((0, 0), (n, n + count)).copy_from(&balance.jacobian);
        right.rows_mut(0, n).copy_from(&balance.force);
        if let Some(singular) = singular {
            if balance.statics.tangent.coordinates != singular.coordinates {
                return None;
            }
            let (values, slopes) = singular.values_and_slopes(self, balance)?;
            matrix.view_mut((n, 0), (tests, n + count)).copy_from(&slopes);
            right.rows_mut(n, tests).copy_from_slice(&values);
            if singular.branching {
                matrix.view_mut((0, n + count), (n, 1)).copy_from(&singular.borders[0]);
                right.rows_mut(0, n).axpy(beta, &singular.borders[0], 1.0);
            }
        }
        if let Some((normal, through)) = plane {
            matrix
                .view_mut((n + tests, 0), (1, n + count))
                .copy_from(&self.plane_row(normal, balance).transpose());
            let from_plane = self.between(through, &balance.place);
            right[n + tests] =
                self.dot(normal, &Direction { q: &from_plane.q + &balance.offset, p: from_plane.p });
        }
        Some((matrix, right))
    }

    /// The tangent of the branch at a point, of unit length, on the side of the direction `along`.
    pub(super) fn tangent(
        &self,
        balance: &Balance<M>,
        along: &Direction,
        singular: Option<&SingularityCondition>,
    ) -> Option<Direction> {
        let (mut matrix, mut right) = self.system(balance, Some((along, &balance.place)), singular, 0.0)?;
        let last = right.len() - 1;
        right.fill(0.0);
        right[last] = 1.0;
        // The plane goes through the point itself, so that its row only normalises the direction.
        let size = matrix.row(last).amax();
        matrix.row_mut(last).unscale_mut(size);
        let found = balance.direction(&linear(&matrix, &right)?, self.count);
        let norm = self.norm(&found);
        (norm > 0.0 && norm.is_finite()).then(|| found.scaled(1.0 / norm))
    }
}

/// Whether the tests are zero to the accuracy of their slopes. Near a corner of the forces a slope does not
/// exist, and a small step does not prove that a test is zero.
fn tests_are_zero(
    matrix: &DMatrix<f64>,
    right: &DVector<f64>,
    rows: core::ops::Range<usize>,
    scales: &DVector<f64>,
) -> bool {
    rows.into_iter().all(|i| {
        let slope = (0..scales.len()).fold(0.0, |most: f64, j| most.max((matrix[(i, j)] * scales[j]).abs()));
        right[i].abs() <= MAX_TEST_RESIDUAL * slope
    })
}

/// The solution of a square system with balanced rows and columns. In directions in which the matrix is
/// singular, the solution is zero.
pub(super) fn linear(matrix: &DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
    let Equilibrated { rows, columns, matrix: balanced } = Equilibrated::of(matrix);
    let right = right.component_mul(&rows);
    let lu = balanced.clone().lu();
    let pivots = lu.u().diagonal().abs();
    let solution = (pivots.min() > MIN_PIVOT_RATIO * pivots.max()).then(|| lu.solve(&right)).flatten();
    let solution = match solution {
        Some(found) => found,
        None => balanced.try_svd(true, true, f64::EPSILON, 1000)?.solve(&right, ZERO_SINGULAR_VALUE).ok()?,
    };
    solution.iter().all(|x| x.is_finite()).then(|| solution.component_mul(&columns))
}

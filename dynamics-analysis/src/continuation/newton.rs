//! Newton's method for points on a branch, and for its singular points.
//!
//! A point on a branch is where F = 0 meets a plane ⟨n, x − x₀⟩ = 0 of x = (q, p) (H. B. Keller, in
//! *Applications of Bifurcation Theory*, 1977; E. L. Allgower & K. Georg, *Introduction to Numerical
//! Continuation Methods*). A singular K is recognised by g of the bordered system
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

use super::hopf_test_function::Swings;
use super::problem::{Balance, ContinuationPoint, ContinuationProblem, Direction};
use crate::equilibria::EquilibriumError;
use crate::linearize::matrix_eigenvalues;

/// Most corrections. More than eight mean that the step was too long.
const MOST_CORRECTIONS: usize = 12;
/// Corrections from here on are the last ones.
const LAST_CORRECTION: f64 = 1e-8;
/// What coordinates and parameters are moved by for slopes of g and f, of what they are measured by.
const ASIDE: f64 = 1e-5;

/// What is asked of a place beside balance: that K is singular.
pub(super) struct Singular {
    /// Whether F_p is to lie in the range of K, too: a branch point.
    pub(super) branching: bool,
    /// Instead of a singular K, a pair of eigenvalues on the imaginary axis.
    pub(super) swings: Option<Swings>,
    /// b and c.
    pub(super) borders: [DVector<f64>; 2],
    /// Independent coordinates of all this.
    pub(super) coordinates: Vec<usize>,
}

impl Singular {
    /// With the borders that suit a place near which K is singular: the shapes, by columns and by rows, of
    /// the stiffness per inertia μ that is nearest to `soft`, to zero if none is given. They are those of
    /// forces and displacements weighed by inertia, so that units play no part, and what is soft is told from
    /// what vanishes.
    pub(super) fn beside<M: Constraints>(
        balance: &Balance<M>,
        branching: bool,
        soft: Option<f64>,
    ) -> Option<Self> {
        let (lower, k) = balance.per_inertia()?;
        let n = k.nrows();
        let real = matrix_eigenvalues(k.clone()).ok()?.into_iter().filter(|x| x.im == 0.0).map(|x| x.re);
        let wanted = soft.unwrap_or(0.0);
        let mu = real.min_by(|a, b| (a - wanted).abs().total_cmp(&(b - wanted).abs()))?;
        let svd = (k - DMatrix::identity(n, n) * mu).try_svd(true, true, f64::EPSILON, 1000)?;
        let least = svd.singular_values.imin();
        let (left, right) = (svd.u?.column(least).into_owned(), svd.v_t?.row(least).transpose());
        let coordinates = balance.statics.tangent.coordinates.clone();
        Some(Self { branching, swings: None, borders: [&lower * left, lower * right], coordinates })
    }

    /// That a pair of eigenvalues lies on the imaginary axis, or two of them are one.
    pub(super) fn swinging<M: Constraints>(balance: &Balance<M>, swings: Swings) -> Self {
        let none = DVector::zeros(balance.size());
        let coordinates = balance.statics.tangent.coordinates.clone();
        Self { branching: false, swings: Some(swings), borders: [none.clone(), none], coordinates }
    }

    /// How many equations this adds.
    fn count(&self) -> usize {
        1 + usize::from(self.branching)
    }

    /// g, and f.
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

    fn at<M: Constraints>(
        &self,
        problem: &ContinuationProblem<'_, M>,
        place: &ContinuationPoint<M::State>,
    ) -> Option<Vec<f64>> {
        if let Some(swings) = &self.swings {
            return Some(alloc::vec![swings.test(&problem.model(place.p).ok()?, &place.state)?]);
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

    /// g and f, and a row of slopes by all unknowns for each.
    pub(super) fn rows<M: Constraints>(
        &self,
        problem: &ContinuationProblem<'_, M>,
        balance: &Balance<M>,
    ) -> Option<(Vec<f64>, DMatrix<f64>)> {
        let here = match &self.swings {
            Some(swings) => alloc::vec![swings.test(&balance.model, &balance.place.state)?],
            None => self.tests(&balance.stiffness(), || Some(balance.by_parameter(0)))?,
        };
        let unknowns = balance.lift.ncols();
        let mut slopes = DMatrix::zeros(self.count(), unknowns);
        for j in 0..unknowns {
            let mut unit = DVector::zeros(unknowns);
            unit[j] = ASIDE * problem.measure(balance, j);
            let aside = |sign: f64| {
                let by = balance.direction(&(&unit * sign), problem.count);
                let place = problem.placed(&problem.moved(&balance.place, &by), &balance.statics)?;
                self.at(problem, &place)
            };
            let (above, below) = (aside(1.0)?, aside(-1.0)?);
            (0..self.count()).for_each(|i| slopes[(i, j)] = (above[i] - below[i]) / (2.0 * unit[j]));
        }
        Some((here, slopes))
    }
}

/// Where Newton's method arrived.
pub(super) struct Arrived<M: Constraints> {
    pub(super) balance: Balance<M>,
    pub(super) iterations: usize,
    /// The last change of the first parameter, and all that would follow if corrections went on falling as
    /// slowly as at last.
    pub(super) change: f64,
    /// β.
    pub(super) beta: f64,
}

/// Why it did not.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Missed {
    /// The iteration did not converge, or went too far.
    Far,
    /// The model has no forces or constraints that can be followed.
    Model(EquilibriumError),
}

impl<M: Constraints> ContinuationProblem<'_, M> {
    /// What the j-th unknown is measured by.
    pub(super) fn measure(&self, balance: &Balance<M>, j: usize) -> f64 {
        match j.checked_sub(balance.size()) {
            Some(k) => self.widths[k],
            None => self.scales[balance.statics.tangent.coordinates[balance.free[j]]],
        }
    }

    /// ⟨n, ·⟩ of the unknowns.
    pub(super) fn plane_row(&self, normal: &Direction, balance: &Balance<M>) -> DVector<f64> {
        let n = balance.size();
        DVector::from_fn(n + self.count, |j, _| {
            let mut unit = DVector::zeros(n + self.count);
            unit[j] = 1.0;
            self.dot(normal, &balance.direction(&unit, self.count))
        })
    }

    /// From a guess to balance on a plane through `through`, and to a singular K if that is asked for; no
    /// farther than `reach` from the guess.
    pub(super) fn solve(
        &self,
        guess: &ContinuationPoint<M::State>,
        preferred: &[usize],
        plane: Option<(&Direction, &ContinuationPoint<M::State>)>,
        singular: Option<&Singular>,
        reach: f64,
    ) -> Result<Arrived<M>, Missed> {
        let (mut place, mut last, mut beta) = (*guess, f64::INFINITY, 0.0);
        for iterations in 0..MOST_CORRECTIONS {
            let balance = self.balance(&place, preferred).map_err(Missed::Model)?;
            let (matrix, right) = self.system(&balance, plane, singular, beta).ok_or(Missed::Far)?;
            let n = balance.size();
            let step = linear(&matrix, &-&right).ok_or(Missed::Far)?;
            let scales = DVector::from_fn(n + self.count, |j, _| self.measure(&balance, j));
            let by = balance.direction(&step, self.count);
            let by = Direction { q: &by.q + &balance.offset, ..by };
            let change = self.norm(&by);
            let away = self.distance(guess, &self.moved(&place, &by));
            if !(change.is_finite() && away <= reach) {
                return Err(Missed::Far);
            }
            if change <= LAST_CORRECTION && (change <= 4.0 * f64::EPSILON || change >= 0.5 * last) {
                // What is left is rounding.
                if !balance.is_balanced(change).map_err(Missed::Model)? {
                    return Err(Missed::Far);
                }
                if singular
                    .is_some_and(|singular| !settled(&matrix, &right, n..n + singular.count(), &scales))
                {
                    return Err(Missed::Far);
                }
                let rate = change / last;
                // At a root of multiplicity three or less, which this is where it creeps.
                let on = if rate > 0.5 && rate < 1.0 { 3.0 / (1.0 - rate) } else { 1.0 };
                return Ok(Arrived { balance, iterations, change: by.p[0].abs() * on, beta });
            }
            last = change;
            if singular.is_some_and(|singular| singular.branching) {
                beta += step[n + self.count];
            }
            place = self.moved(&place, &by);
        }
        Err(Missed::Far)
    }

    /// The equations for a step of all unknowns, scaled by nothing yet: matrix, and what is left.
    fn system(
        &self,
        balance: &Balance<M>,
        plane: Option<(&Direction, &ContinuationPoint<M::State>)>,
        singular: Option<&Singular>,
        beta: f64,
    ) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let (n, count) = (balance.size(), self.count);
        let tests = singular.map_or(0, Singular::count);
        let unknowns = n + count + usize::from(tests == 2);
        let mut matrix = DMatrix::zeros(unknowns, unknowns);
        let mut right = DVector::zeros(unknowns);
        matrix.view_mut((0, 0), (n, n + count)).copy_from(&balance.jacobian);
        right.rows_mut(0, n).copy_from(&balance.force);
        if let Some(singular) = singular {
            if balance.statics.tangent.coordinates != singular.coordinates {
                return None;
            }
            let (values, slopes) = singular.rows(self, balance)?;
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
            let gone = self.between(through, &balance.place);
            right[n + tests] = self.dot(normal, &Direction { q: &gone.q + &balance.offset, p: gone.p });
        }
        Some((matrix, right))
    }

    /// The direction of the branch at a place, of unit length, nearest to a direction in which it was
    /// followed.
    pub(super) fn tangent(
        &self,
        balance: &Balance<M>,
        along: &Direction,
        singular: Option<&Singular>,
    ) -> Option<Direction> {
        let (mut matrix, mut right) = self.system(balance, Some((along, &balance.place)), singular, 0.0)?;
        let last = right.len() - 1;
        right.fill(0.0);
        right[last] = 1.0;
        // The plane goes through the place itself; what is off the constraints plays no part.
        let size = matrix.row(last).amax();
        matrix.row_mut(last).unscale_mut(size);
        let found = balance.direction(&linear(&matrix, &right)?, self.count);
        let norm = self.norm(&found);
        (norm > 0.0 && norm.is_finite()).then(|| found.scaled(1.0 / norm))
    }
}

/// Whether these equations are fulfilled to the accuracy of their slopes. If a slope does not exist, as near
/// a corner, small steps prove nothing.
fn settled(
    matrix: &DMatrix<f64>,
    right: &DVector<f64>,
    rows: core::ops::Range<usize>,
    scales: &DVector<f64>,
) -> bool {
    rows.into_iter().all(|i| {
        let slope = (0..scales.len()).fold(0.0, |most: f64, j| most.max((matrix[(i, j)] * scales[j]).abs()));
        right[i].abs() <= 1e-7 * slope
    })
}

/// The solution of a square system, rows and columns balanced; directions in which it is singular stand
/// still.
pub(super) fn linear(matrix: &DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
    let inverse = |most: f64| if most >= f64::MIN_POSITIVE { 1.0 / most } else { 1.0 };
    let rows = DVector::from_iterator(matrix.nrows(), matrix.row_iter().map(|row| inverse(row.amax())));
    let mut balanced = DMatrix::from_diagonal(&rows) * matrix;
    let columns =
        DVector::from_iterator(matrix.ncols(), balanced.column_iter().map(|column| inverse(column.amax())));
    balanced.column_iter_mut().zip(columns.iter()).for_each(|(mut column, c)| column *= *c);
    let right = right.component_mul(&rows);
    let lu = balanced.clone().lu();
    let pivots = lu.u().diagonal().abs();
    let solution = (pivots.min() > 1e-12 * pivots.max()).then(|| lu.solve(&right)).flatten();
    let solution = match solution {
        Some(found) => found,
        None => balanced.try_svd(true, true, f64::EPSILON, 1000)?.solve(&right, 1e-13).ok()?,
    };
    solution.iter().all(|x| x.is_finite()).then(|| solution.component_mul(&columns))
}

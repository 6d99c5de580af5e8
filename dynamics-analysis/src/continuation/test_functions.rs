//! Test functions of folds and branch points: the stiffnesses along a branch.
//!
//! At folds and branch points a stiffness μ of K x = μ M x changes sign. The sign of det K would
//! distinguish an odd number of sign changes from an even one, but not two from none. So each μ is followed
//! by its mode shape x. Two that change sign in one step are both detected, in the same direction or in
//! opposite ones. If shapes turn too far in a step to be matched, the interval is halved. At a fold dp/ds
//! changes sign, too. At a branch point it need not. On test functions see R. Seydel, *Practical Bifurcation
//! and Stability Analysis*, §5.3.

use alloc::vec::Vec;

use dynamics_runtime::model::Constraints;
use nalgebra::{Complex, DMatrix, DVector};

use super::problem::{Balance, ContinuationProblem, Direction};
use crate::equilibria::EquilibriumError;
use crate::linearize::{LinearizeError, matrix_eigenvalues};

/// Least agreement, as the sum of cos² of angles, between a shape and those of one sign at the other place.
/// Below it, the shape turned so far that its sign change is uncertain. A value above ½ makes the match
/// unique.
const MIN_SHAPE_AGREEMENT: f64 = 0.6;
/// Elements of the stiffness that differ from their transposed by less than this share of the largest element
/// are equal. Forces with a potential leave differences of rounding; follower forces leave differences of
/// their own size.
const SYMMETRY_TOLERANCE: f64 = 1e-10;
/// A minimum within a step is examined if the parabola through three places has it below this share of the
/// smaller end. A larger value examines more harmless minima, at the cost of a point each. A smaller one
/// misses narrow pairs of sign changes.
const MAX_MINIMUM_RATIO: f64 = 0.3;
/// An eigenvalue counts as real if its imaginary part is below this share of its size. Where two real ones
/// meet, each is off by about the root of the rounding unit, 1.5·10⁻⁸.
const REAL_EIGENVALUE_TOLERANCE: f64 = 1e-6;

/// The test functions at a point of a branch.
#[derive(Clone, Debug)]
pub(super) struct TestFunctions {
    /// dp/ds of the branch, of the first parameter in its measure.
    pub(super) slope: f64,
    /// Real μ, ascending.
    pub(super) stiffnesses: Vec<f64>,
    /// Their shapes, by columns, orthonormal in M; `None` if K is not symmetric.
    shapes: Option<DMatrix<f64>>,
    mass: DMatrix<f64>,
    coordinates: Vec<usize>,
}

/// The sign changes between two points of a branch.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SignChanges {
    /// The μ that change sign, by their index at the first point.
    pub(super) crossing: Vec<usize>,
    /// Whether the parameter has an extremum between them.
    pub(super) parameter_turns: bool,
    /// Whether each μ of one point has its counterpart at the other.
    pub(super) all_matched: bool,
}

impl TestFunctions {
    /// The test functions at a point in balance with the tangent of the branch.
    pub(super) fn of<M: Constraints>(
        problem: &ContinuationProblem<'_, M>,
        balance: &Balance<M>,
        tangent: &Direction,
    ) -> Result<Self, EquilibriumError> {
        let slope = tangent.p[0] / problem.widths[0];
        let (lower, reduced) = balance.stiffness_per_inertia().ok_or(LinearizeError::Inertia)?;
        let mass = balance.mass();
        let coordinates = balance.free.iter().map(|k| balance.statics.tangent.coordinates[*k]).collect();
        let n = reduced.nrows();
        if (&reduced - reduced.transpose()).amax() > SYMMETRY_TOLERANCE * reduced.amax() {
            let all = matrix_eigenvalues(reduced)?;
            let is_real = |x: &&Complex<f64>| x.im.abs() <= REAL_EIGENVALUE_TOLERANCE * x.norm();
            let mut stiffnesses: Vec<f64> = all.iter().filter(is_real).map(|x| x.re).collect();
            stiffnesses.sort_by(f64::total_cmp);
            return Ok(Self { slope, stiffnesses, shapes: None, mass, coordinates });
        }
        let symmetric = 0.5 * (&reduced + reduced.transpose());
        let eigen = symmetric.try_symmetric_eigen(f64::EPSILON, 300 * n.max(1));
        let eigen = eigen.ok_or(LinearizeError::NoConvergence { size: n })?;
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|i, j| eigen.eigenvalues[*i].total_cmp(&eigen.eigenvalues[*j]));
        let shapes = lower.tr_solve_lower_triangular(&eigen.eigenvectors.select_columns(&order));
        let stiffnesses = order.iter().map(|i| eigen.eigenvalues[*i]).collect();
        Ok(Self { slope, stiffnesses, shapes, mass, coordinates })
    }

    /// The number of negative stiffnesses.
    pub(super) fn negative_count(&self) -> usize {
        self.stiffnesses.iter().filter(|x| **x < 0.0).count()
    }

    /// The index of the μ nearest to zero.
    fn softest(&self) -> Option<usize> {
        (0..self.stiffnesses.len())
            .min_by(|i, j| self.stiffnesses[*i].abs().total_cmp(&self.stiffnesses[*j].abs()))
    }

    /// The μ of the largest magnitude.
    pub(super) fn stiffest(&self) -> Option<f64> {
        self.stiffnesses.iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs()))
    }

    /// cos² of the angles between the shapes of two points, a row for each shape of this one.
    fn agreement(&self, other: &Self) -> Option<DMatrix<f64>> {
        let (Some(a), Some(b)) = (&self.shapes, &other.shapes) else { return None };
        (self.coordinates == other.coordinates).then(|| (a.tr_mul(&(&other.mass * b))).map(|x| x * x))
    }

    /// The μ at another point whose shape is that of the k-th one here. If K is not symmetric, it is the
    /// k-th one in ascending order, or the one nearest to zero if some have become complex.
    pub(super) fn matching(&self, k: usize, other: &Self) -> Option<f64> {
        let of_shape = self.agreement(other).map(|all| all.row(k).transpose().imax());
        let index = match of_shape {
            Some(index) => Some(index),
            // The k-th one in order is a continuous function; the one nearest to zero is not.
            None if self.stiffnesses.len() == other.stiffnesses.len() => Some(k),
            None => other.softest(),
        };
        index.and_then(|index| other.stiffnesses.get(index)).copied()
    }

    /// The sign changes from here to another point. A μ changes sign if its shape is found among those of
    /// the other sign there.
    pub(super) fn sign_changes(&self, other: &Self) -> SignChanges {
        let parameter_turns = self.slope * other.slope < 0.0;
        let negative = |x: &f64| *x < 0.0;
        let Some(agreement) = self.agreement(other) else {
            return self.sign_changes_in_order(other, parameter_turns);
        };
        let (mut crossing, mut all_matched) = (Vec::new(), true);
        let mut taken = DVector::from_element(other.stiffnesses.len(), false);
        for (k, stiffness) in self.stiffnesses.iter().enumerate() {
            let row = agreement.row(k).transpose();
            let index = row.imax();
            // The subspace of all shapes of one sign is compared: within it shapes may turn into each other.
            let agreement_with_sign = |sign: bool| -> f64 {
                row.iter()
                    .zip(&other.stiffnesses)
                    .filter(|(_, x)| negative(x) == sign)
                    .map(|(part, _)| *part)
                    .sum()
            };
            if agreement_with_sign(negative(stiffness)) >= MIN_SHAPE_AGREEMENT {
                continue;
            }
            all_matched &= agreement_with_sign(!negative(stiffness)) >= MIN_SHAPE_AGREEMENT && !taken[index];
            taken[index] = true;
            crossing.push(k);
        }
        // The signs that were followed have to account for the change of the number of negative ones.
        let negatives = |one: &Self| one.negative_count() as i64;
        let net: i64 = crossing.iter().map(|k| if negative(&self.stiffnesses[*k]) { -1 } else { 1 }).sum();
        all_matched &= negatives(other) - negatives(self) == net;
        SignChanges { crossing, parameter_turns, all_matched }
    }

    /// Shares of a step at which a μ, or dp/ds, may have a minimum near zero or beyond it, by the parabolas
    /// through the values here, in the middle and at the end of the step.
    pub(super) fn suspected_minima(&self, middle: &Self, end: &Self) -> Vec<f64> {
        let of_stiffnesses = (0..self.stiffnesses.len())
            .filter_map(|k| Some([self.stiffnesses[k], self.matching(k, middle)?, self.matching(k, end)?]));
        let all = of_stiffnesses.chain([[self.slope, middle.slope, end.slope]]);
        let mut found: Vec<f64> = all.filter_map(near_zero_minimum).collect();
        found.sort_by(f64::total_cmp);
        found
    }

    /// The sign changes if K is not symmetric, so that there are no shapes to match: by ascending order, or
    /// by the number of negative ones if some have become complex.
    fn sign_changes_in_order(&self, other: &Self, parameter_turns: bool) -> SignChanges {
        if self.stiffnesses.len() == other.stiffnesses.len() {
            let pairs = self.stiffnesses.iter().zip(&other.stiffnesses).enumerate();
            let crossing = pairs.filter(|(_, (a, b))| (**a < 0.0) != (**b < 0.0)).map(|(k, _)| k).collect();
            return SignChanges { crossing, parameter_turns, all_matched: true };
        }
        let (before, after) = (self.negative_count(), other.negative_count());
        // Real eigenvalues become complex in pairs, which leaves the parity.
        let count = before.abs_diff(after) % 2;
        let mut order: Vec<usize> = (0..self.stiffnesses.len()).collect();
        order.sort_by(|i, j| self.stiffnesses[*i].abs().total_cmp(&self.stiffnesses[*j].abs()));
        order.truncate(count);
        SignChanges { crossing: order, parameter_turns, all_matched: true }
    }
}

/// The place of the minimum, by magnitude, of the parabola through values at 0, ½ and 1, if the values have
/// one sign and the minimum is near zero or beyond it.
fn near_zero_minimum([first, middle, last]: [f64; 3]) -> Option<f64> {
    // The same test of signs as for counting: an exact zero counts as positive.
    let one_sign = [middle, last].iter().all(|x| (*x < 0.0) == (first < 0.0));
    let bend = 2.0 * (first - 2.0 * middle + last);
    let rise = last - first - bend;
    let at = -0.5 * rise / bend;
    let least = first - 0.25 * rise * rise / bend;
    let near = least * first <= 0.0 || least.abs() < MAX_MINIMUM_RATIO * first.abs().min(last.abs());
    let bends_away = (bend < 0.0) == (first < 0.0);
    (one_sign && bends_away && at > 0.0 && at < 1.0 && near).then_some(at)
}

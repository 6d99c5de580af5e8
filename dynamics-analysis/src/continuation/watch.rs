//! Test functions along a branch: the stiffnesses.
//!
//! At folds and branch points a stiffness μ of K x = μ M x passes zero. The sign of a determinant
//! distinguishes odd from even, but not two from none. So each μ is followed by its shape x, and two that
//! pass zero in one step are both detected, in the same direction or in opposite ones. If shapes turn too far
//! in a step to be matched, the step is cut. At a fold the parameter turns round, too; at a branch point it
//! need not.

use alloc::vec::Vec;

use dynamics_runtime::model::Constraints;
use nalgebra::{Complex, DMatrix, DVector};

use super::problem::{Balance, ContinuationProblem, Direction};
use crate::equilibria::{EquilibriumError, Statics};
use crate::linearize::{LinearizeError, matrix_eigenvalues};

/// Shapes that agree less than this, cos² of their angle, may be others.
const SAME_SHAPE: f64 = 0.6;
/// Elements that differ by less than this part of the largest are one: a stiffness of a potential is
/// symmetric.
const SYMMETRIC: f64 = 1e-10;
/// A minimum below this part of the neighbouring values is examined.
const LOW: f64 = 0.3;
/// Imaginary parts below this part are rounding: where two real ones meet, each is off by the root of it.
const REAL: f64 = 1e-6;

/// Stiffnesses per inertia at a place.
#[derive(Clone, Debug)]
pub(super) struct Watch {
    /// dp/ds of the branch, of the first parameter in its measure.
    pub(super) slope: f64,
    /// Real μ, ascending.
    pub(super) squares: Vec<f64>,
    /// Their shapes, orthonormal in M; none where K is not symmetric.
    shapes: Option<DMatrix<f64>>,
    mass: DMatrix<f64>,
    coordinates: Vec<usize>,
}

/// What happens between two places.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Changes {
    /// The μ that pass zero, by their number in the first place.
    pub(super) crossing: Vec<usize>,
    /// Whether the parameter turns round.
    pub(super) turns: bool,
    /// Whether each μ could be followed.
    pub(super) sure: bool,
}

impl Watch {
    pub(super) fn of<M: Constraints>(
        problem: &ContinuationProblem<'_, M>,
        balance: &Balance<M>,
        tangent: &Direction,
    ) -> Result<Self, EquilibriumError> {
        let found = Self::of_statics(&balance.statics, &balance.free)?;
        Ok(Self { slope: tangent.p[0] / problem.widths[0], ..found })
    }

    fn of_statics<R: dynamics_runtime::model::Vector>(
        statics: &Statics<R>,
        free: &[usize],
    ) -> Result<Self, EquilibriumError> {
        let part = |m: &DMatrix<f64>| m.select_rows(free).select_columns(free);
        let (k, mass) = (part(&statics.stiffness), part(&statics.mass));
        let coordinates = free.iter().map(|k| statics.tangent.coordinates[*k]).collect();
        let lower = mass.clone().cholesky().ok_or(LinearizeError::Inertia)?.unpack();
        let half = lower.solve_lower_triangular(&k).ok_or(LinearizeError::Inertia)?;
        let reduced =
            lower.solve_lower_triangular(&half.transpose()).ok_or(LinearizeError::Inertia)?.transpose();
        let n = reduced.nrows();
        if (&reduced - reduced.transpose()).amax() > SYMMETRIC * reduced.amax() {
            let all = matrix_eigenvalues(reduced)?;
            let is_real = |x: &&Complex<f64>| x.im.abs() <= REAL * x.norm();
            let mut squares: Vec<f64> = all.iter().filter(is_real).map(|x| x.re).collect();
            squares.sort_by(f64::total_cmp);
            return Ok(Self { slope: 0.0, squares, shapes: None, mass, coordinates });
        }
        let symmetric = 0.5 * (&reduced + reduced.transpose());
        let eigen = symmetric.try_symmetric_eigen(f64::EPSILON, 300 * n.max(1));
        let eigen = eigen.ok_or(LinearizeError::NoConvergence { size: n })?;
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|i, j| eigen.eigenvalues[*i].total_cmp(&eigen.eigenvalues[*j]));
        let shapes = lower.tr_solve_lower_triangular(&eigen.eigenvectors.select_columns(&order));
        let squares = order.iter().map(|i| eigen.eigenvalues[*i]).collect();
        Ok(Self { slope: 0.0, squares, shapes, mass, coordinates })
    }

    /// How many directions do not resist.
    pub(super) fn negative(&self) -> usize {
        self.squares.iter().filter(|x| **x < 0.0).count()
    }

    /// The number of the μ next to zero.
    pub(super) fn softest(&self) -> Option<usize> {
        (0..self.squares.len()).min_by(|i, j| self.squares[*i].abs().total_cmp(&self.squares[*j].abs()))
    }

    /// The largest μ by size.
    pub(super) fn stiffest(&self) -> Option<f64> {
        self.squares.iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs()))
    }

    /// cos² of the angles between all shapes of two places, a row for each of this one.
    fn agreement(&self, other: &Self) -> Option<DMatrix<f64>> {
        let (Some(a), Some(b)) = (&self.shapes, &other.shapes) else { return None };
        (self.coordinates == other.coordinates).then(|| (a.tr_mul(&(&other.mass * b))).map(|x| x * x))
    }

    /// The μ of another place that has the shape of the k-th one here; where shapes say nothing, the k-th, or
    /// the one next to zero where others have become complex.
    pub(super) fn like(&self, k: usize, other: &Self) -> Option<f64> {
        let of_shape = self.agreement(other).map(|all| all.row(k).transpose().imax());
        let index = match of_shape {
            Some(index) => Some(index),
            // In order they are continuous, as the one next to zero is not.
            None if self.squares.len() == other.squares.len() => Some(k),
            None => other.softest(),
        };
        index.and_then(|index| other.squares.get(index)).copied()
    }

    pub(super) fn changes(&self, other: &Self) -> Changes {
        let turns = self.slope * other.slope < 0.0;
        let negative = |x: &f64| *x < 0.0;
        let Some(agreement) = self.agreement(other) else {
            return self.by_number(other, turns);
        };
        let (mut crossing, mut sure) = (Vec::new(), true);
        let mut taken = DVector::from_element(other.squares.len(), false);
        for (k, square) in self.squares.iter().enumerate() {
            let row = agreement.row(k).transpose();
            let index = row.imax();
            // Shapes of one sign may turn into each other as they like.
            let of_sign = |sign: bool| -> f64 {
                row.iter()
                    .zip(&other.squares)
                    .filter(|(_, x)| negative(x) == sign)
                    .map(|(part, _)| *part)
                    .sum()
            };
            let stays = of_sign(negative(square));
            if stays >= SAME_SHAPE {
                continue;
            }
            sure &= of_sign(!negative(square)) >= SAME_SHAPE && !taken[index];
            taken[index] = true;
            crossing.push(k);
        }
        let balance = |one: &Self| one.negative() as i64;
        let net: i64 = crossing.iter().map(|k| if negative(&self.squares[*k]) { -1 } else { 1 }).sum();
        sure &= balance(other) - balance(self) == net;
        Changes { crossing, turns, sure }
    }

    /// Parts of the way from here over the middle to an end at which a μ, or the slope of the parameter,
    /// seems to dip to zero, or past it, and come back: those of the parabolas through three places.
    pub(super) fn dips(&self, middle: &Self, end: &Self) -> Vec<f64> {
        let of_squares = (0..self.squares.len())
            .filter_map(|k| Some([self.squares[k], self.like(k, middle)?, self.like(k, end)?]));
        let all = of_squares.chain([[self.slope, middle.slope, end.slope]]);
        let mut found: Vec<f64> = all.filter_map(dip).collect();
        found.sort_by(f64::total_cmp);
        found
    }

    /// Where shapes say nothing, by their order, or by the number of those that do not resist where others
    /// have become complex.
    fn by_number(&self, other: &Self, turns: bool) -> Changes {
        if self.squares.len() == other.squares.len() {
            let pairs = self.squares.iter().zip(&other.squares).enumerate();
            let crossing = pairs.filter(|(_, (a, b))| (**a < 0.0) != (**b < 0.0)).map(|(k, _)| k).collect();
            return Changes { crossing, turns, sure: true };
        }
        let (before, after) = (self.negative(), other.negative());
        // Those that became complex leave in pairs.
        let count = before.abs_diff(after) % 2;
        let mut order: Vec<usize> = (0..self.squares.len()).collect();
        order.sort_by(|i, j| self.squares[*i].abs().total_cmp(&self.squares[*j].abs()));
        order.truncate(count);
        Changes { crossing: order, turns, sure: true }
    }
}

/// Where a parabola through values at 0, ½ and 1 of one sign comes near zero, or passes it, between them.
fn dip([first, middle, last]: [f64; 3]) -> Option<f64> {
    // The sign for counting changes: an exact zero has not changed its sign.
    let one_sign = [middle, last].iter().all(|x| (*x < 0.0) == (first < 0.0));
    let bend = 2.0 * (first - 2.0 * middle + last);
    let rise = last - first - bend;
    let at = -0.5 * rise / bend;
    let least = first - 0.25 * rise * rise / bend;
    let near = least * first <= 0.0 || least.abs() < LOW * first.abs().min(last.abs());
    let bends_away = (bend < 0.0) == (first < 0.0);
    (one_sign && bends_away && at > 0.0 && at < 1.0 && near).then_some(at)
}

//! Singular values by one-sided Jacobi rotations: A V = U Σ.
//!
//! The columns of A are turned against each other until they are orthogonal; their lengths are then the
//! singular values. It is the most accurate of the dense methods (small singular values keep their relative
//! accuracy where columns differ in scale alone) and works in place, without allocation. Cost: 6 to 10 sweeps
//! of about 3 m n² operations, so it is used for decisions that are made once (assembly, singular
//! configurations), not in steps. Source: G. H. Golub and C. F. Van Loan, Matrix Computations, 4th ed.,
//! §8.6.3.

use super::rows::dot;
use crate::math;

/// Most sweeps. 6 to 10 are needed; only matrices with NaN reach this bound.
const MAX_SWEEPS: usize = 40;

/// A decomposed matrix of m rows and n columns, stored by columns.
pub(crate) struct Svd<'a> {
    /// U Σ, m×n by columns.
    pub(crate) a: &'a [f64],
    /// V, n×n by columns.
    pub(crate) v: &'a [f64],
    /// Singular values in the order of the columns, which is not sorted; n of them, those beyond the rank
    /// about 0.
    pub(crate) sigma: &'a [f64],
    /// Number of rows.
    pub(crate) m: usize,
}

impl<'a> Svd<'a> {
    /// Decomposes the m×n matrix in `a` (by columns), n = `sigma.len()`; `v` needs n² elements.
    pub(crate) fn new(m: usize, a: &'a mut [f64], v: &'a mut [f64], sigma: &'a mut [f64]) -> Self {
        let n = sigma.len();
        v.fill(0.0);
        (0..n).for_each(|j| v[j * n + j] = 1.0);
        Self::refined(m, a, v, sigma)
    }

    /// Decomposes the matrix A V in `a` for a V that is orthogonal, from a matrix near A: two sweeps are then
    /// enough. What rounding takes from the orthogonality of V adds up over a row of such calls, by about
    /// 10⁻¹⁶ each.
    pub(crate) fn refined(m: usize, a: &'a mut [f64], v: &'a mut [f64], sigma: &'a mut [f64]) -> Self {
        let n = sigma.len();
        for _ in 0..MAX_SWEEPS {
            if !sweep(m, n, a, v, sigma) {
                break;
            }
        }
        for (j, sigma) in sigma.iter_mut().enumerate() {
            let column = &a[j * m..][..m];
            *sigma = math::sqrt(dot(column, column));
        }
        Self { a, v, sigma, m }
    }

    /// σⱼ uⱼ.
    pub(crate) fn column(&self, j: usize) -> &'a [f64] {
        &self.a[j * self.m..][..self.m]
    }

    /// vⱼ.
    pub(crate) fn right(&self, j: usize) -> &'a [f64] {
        let n = self.sigma.len();
        &self.v[j * n..][..n]
    }

    /// The largest singular value, 0 for a matrix without elements.
    pub(crate) fn largest(&self) -> f64 {
        self.sigma.iter().copied().fold(0.0, f64::max)
    }

    /// Writes x = A⁺ b, of all least-squares solutions the shortest; singular values below `cut` count as
    /// zero. With `mu` > 0 the damped solution (AᵀA + μ²) x = Aᵀ b instead.
    pub(crate) fn solve(&self, b: &[f64], cut: f64, mu: f64, x: &mut [f64]) {
        x.fill(0.0);
        for (j, &sigma) in self.sigma.iter().enumerate() {
            if sigma > cut {
                let factor = dot(self.column(j), b) / (sigma * sigma + mu * mu);
                x.iter_mut().zip(self.right(j)).for_each(|(x, v)| *x += factor * v);
            }
        }
    }
}

/// Makes all pairs of columns orthogonal once; false where they were, to the rounding of their products.
/// `squares` is a workspace for the squares of their lengths.
fn sweep(m: usize, n: usize, a: &mut [f64], v: &mut [f64], squares: &mut [f64]) -> bool {
    (0..n).for_each(|j| squares[j] = squared_length(a, m, j));
    let rounding = m as f64 * f64::EPSILON;
    // A product of columns below this is rounding.
    let noise = squares.iter().copied().fold(0.0, f64::max) * f64::EPSILON * f64::EPSILON;
    let mut has_rotated = false;
    for i in 0..n {
        for j in i + 1..n {
            let pq = dot_in_four_sums(&a[i * m..][..m], &a[j * m..][..m]);
            let orthogonal = pq * pq <= rounding * rounding * squares[i] * squares[j];
            // Comparisons with NaN are false: such a matrix ends the sweeps by their number.
            if orthogonal || pq.abs() <= noise {
                continue;
            }
            has_rotated = true;
            let zeta = (squares[j] - squares[i]) / (2.0 * pq);
            let t = zeta.signum() / (zeta.abs() + math::hypot(1.0, zeta));
            let c = 1.0 / math::hypot(1.0, t);
            rotate(a, m, i, j, c, c * t);
            rotate(v, n, i, j, c, c * t);
            for (k, change) in [(i, -t * pq), (j, t * pq)] {
                let square = squares[k] + change;
                // After cancellation the square is computed anew: the column may be rounding only.
                squares[k] = if square < 0.5 * squares[k] { squared_length(a, m, k) } else { square };
            }
        }
    }
    has_rotated
}

/// The square of the length of column j.
fn squared_length(a: &[f64], m: usize, j: usize) -> f64 {
    dot_in_four_sums(&a[j * m..][..m], &a[j * m..][..m])
}

/// Σ pᵢ qᵢ in four sums that the compiler can vectorise: other bits than [`dot`].
fn dot_in_four_sums(p: &[f64], q: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    let (quads, rest) = (p.chunks_exact(4).zip(q.chunks_exact(4)), p.len() / 4 * 4);
    for (p, q) in quads {
        (0..4).for_each(|k| sums[k] += p[k] * q[k]);
    }
    sums[0] + sums[1] + (sums[2] + sums[3]) + dot(&p[rest..], &q[rest..])
}

/// Rotates columns i < j of length m: (p, q) ← (c p − s q, s p + c q).
fn rotate(columns: &mut [f64], m: usize, i: usize, j: usize, c: f64, s: f64) {
    let (left, right) = columns.split_at_mut(j * m);
    for (p, q) in left[i * m..][..m].iter_mut().zip(&mut right[..m]) {
        (*p, *q) = (c * *p - s * *q, s * *p + c * *q);
    }
}

// Matrices of dynamic size, to compare with, need the standard library.
#[cfg(all(test, feature = "std"))]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]
        /// For all shapes and ranks: A V = U Σ with orthogonal columns, and least squares by its definition:
        /// A x is the part of b in the range, x has none in the null space. (nalgebra's own decomposition
        /// misses some of these by 10⁻³.)
        #[test]
        fn decomposes_and_solves(
            (m, n) in (1usize..8, 1usize..8),
            rank in 1usize..8,
            numbers in proptest::collection::vec(-1.0f64..1.0, 200),
        ) {
            let k = rank.min(m).min(n);
            let left = DMatrix::from_fn(m, k, |i, j| numbers[i * 8 + j]);
            let right = DMatrix::from_fn(k, n, |i, j| numbers[64 + i * 8 + j]);
            let matrix = left * right;
            let b = DVector::from_fn(m, |i, _| numbers[150 + i]);
            let mut a: Vec<f64> = matrix.iter().copied().collect();
            let (mut v, mut sigma, mut x) = (vec![0.0; n * n], vec![0.0; n], vec![0.0; n]);
            let svd = Svd::new(m, &mut a, &mut v, &mut sigma);
            let right = DMatrix::from_column_slice(n, n, svd.v);
            prop_assert!((right.transpose() * &right - DMatrix::identity(n, n)).amax() < 1e-14);
            prop_assert!((&matrix * &right - DMatrix::from_column_slice(m, n, svd.a)).amax() < 1e-14);
            for j in 0..n {
                for i in 0..j {
                    let rounding = 2.0 * m as f64 * f64::EPSILON * svd.largest().powi(2);
                    prop_assert!(dot(svd.column(i), svd.column(j)).abs() <= rounding);
                }
            }
            prop_assert!(svd.sigma.iter().filter(|sigma| **sigma > 1e-13).count() <= k);
            let cut = 1e-9;
            prop_assume!(svd.sigma.iter().all(|sigma| *sigma < 1e-13 || *sigma > 1e-3));
            svd.solve(b.as_slice(), cut, 0.0, &mut x);
            let x = DVector::from_vec(x);
            prop_assert!((matrix.transpose() * (&matrix * &x - &b)).amax() < 1e-11);
            for j in (0..n).filter(|j| svd.sigma[*j] < cut) {
                prop_assert!(dot(svd.right(j), x.as_slice()).abs() < 1e-11);
            }
        }
    }

    #[test]
    fn a_matrix_that_is_not_a_number_ends_too() {
        let mut a = [f64::NAN, 1.0, 2.0, 3.0];
        let (mut v, mut sigma) = ([0.0; 4], [0.0; 2]);
        assert!(Svd::new(2, &mut a, &mut v, &mut sigma).sigma.iter().any(|s| s.is_nan()));
    }
}

//! Square systems by Gaussian elimination with row pivoting, of a size that is known at run time.

use super::rows::{dot, swap_rows, two_rows};
use super::workspace::{Indices, WorkspaceSlices};

/// P A = L U. Rows should be of about equal length.
pub(crate) struct Lu<'w> {
    k: usize,
    a: &'w mut [f64],
    order: Indices<'w>,
    /// The smallest pivot: 0 or NaN where A is singular or not finite.
    pub(crate) least: f64,
    /// Whether the determinant is negative.
    pub(crate) negative: bool,
}

/// Length of the workspace of a factorization besides A.
pub(crate) const fn workspace_len(k: usize) -> usize {
    k
}

impl<'w> Lu<'w> {
    /// Factors A (k×k by rows), in place.
    pub(crate) fn new(a: &'w mut [f64], k: usize, workspace: &mut WorkspaceSlices<'w>) -> Self {
        let mut order = workspace.indices(k);
        let (mut least, mut negative) = (f64::INFINITY, false);
        for j in 0..k {
            let pivot = (j..k).map(|i| (i, a[i * k + j].abs()));
            let (row, size) = pivot.fold((j, 0.0), |best, next| if next.1 > best.1 { next } else { best });
            least = crate::math::min(least, size);
            if size == 0.0 {
                continue;
            }
            swap_rows(a, k, j, row);
            order.swap(j, row);
            negative ^= (row != j) ^ (a[j * k + j] < 0.0);
            for i in j + 1..k {
                let (upper, lower) = two_rows(a, k, j, i);
                lower[j] /= upper[j];
                let factor = lower[j];
                if factor != 0.0 {
                    lower[j + 1..].iter_mut().zip(&upper[j + 1..]).for_each(|(l, u)| *l -= factor * u);
                }
            }
        }
        Self { k, a, order, least, negative }
    }

    /// A x = b. `x` and `b` have k elements.
    pub(crate) fn solve(&self, b: &[f64], x: &mut [f64]) {
        let k = self.k;
        for i in 0..k {
            x[i] = b[self.order.get(i)] - dot(&self.a[i * k..i * k + i], &x[..i]);
        }
        for i in (0..k).rev() {
            let later = dot(&self.a[i * k + i + 1..(i + 1) * k], &x[i + 1..]);
            x[i] = (x[i] - later) / self.a[i * k + i];
        }
    }
}

/// Gaussian elimination with complete pivoting on A (m×n by rows), which is overwritten: lists rows and
/// columns in the order in which they were chosen. Returns the rank — pivots above `tolerance` times the
/// first — and the last admitted pivot over the first.
pub(crate) fn choose(
    a: &mut [f64],
    m: usize,
    n: usize,
    tolerance: f64,
    rows: &mut Indices<'_>,
    columns: &mut Indices<'_>,
) -> (usize, f64) {
    let (mut rank, mut first, mut last) = (0, 0.0, 0.0);
    while rank < m.min(n) {
        let mut best = (rank, rank, 0.0);
        for i in rank..m {
            for j in rank..n {
                let size = a[i * n + j].abs();
                if size > best.2 {
                    best = (i, j, size);
                }
            }
        }
        if rank == 0 {
            first = best.2;
        }
        if best.2 <= tolerance * first {
            break;
        }
        last = best.2;
        swap_rows(a, n, rank, best.0);
        rows.swap(rank, best.0);
        (0..m).for_each(|i| a.swap(i * n + rank, i * n + best.1));
        columns.swap(rank, best.1);
        for i in rank + 1..m {
            let (upper, lower) = two_rows(a, n, rank, i);
            let factor = lower[rank] / upper[rank];
            lower[rank..].iter_mut().zip(&upper[rank..]).for_each(|(l, u)| *l -= factor * u);
        }
        rank += 1;
    }
    (rank, if rank == 0 { 1.0 } else { last / first })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_system_is_solved_to_rounding() {
        let a = [0.0, 2.0, 1.0, 3.0, 1.0, 0.0, 0.5, 1.0, 4.0];
        let exact = [1.0, -2.0, 0.5];
        let b: Vec<f64> = a.chunks_exact(3).map(|row| dot(row, &exact)).collect();
        let (mut copy, mut work, mut x) = (a, [0.0; 6], [0.0; 3]);
        let mut workspace = WorkspaceSlices::new(&mut work);
        let lu = Lu::new(&mut copy, 3, &mut workspace);
        lu.solve(&b, &mut x);
        assert!(x.iter().zip(exact).all(|(x, e)| (x - e).abs() < 1e-15), "{x:?}");
        assert!(lu.least > 0.1);
        // 0·(4 − 0) − 2·(12 − 0) + 1·(3 − 0.5).
        assert!(lu.negative);
    }

    #[test]
    fn singular_and_not_finite_blocks_say_so() {
        for a in [[1.0, 2.0, 2.0, 4.0], [0.0; 4], [f64::NAN, 1.0, 1.0, 0.0]] {
            let (mut copy, mut work) = (a, [0.0; 4]);
            let least = Lu::new(&mut copy, 2, &mut WorkspaceSlices::new(&mut work)).least;
            assert!(least.abs() < 1e-15 || least.is_nan(), "{least}");
        }
    }

    #[test]
    fn complete_pivoting_finds_rank_and_the_largest_elements() {
        let mut a = [1.0, 2.0, 8.0, 2.0, 4.0, 16.0, 0.0, 1.0, 0.0];
        let mut work = [0.0; 6];
        let mut workspace = WorkspaceSlices::new(&mut work);
        let (mut rows, mut columns) = (workspace.indices(3), workspace.indices(3));
        let (rank, _) = choose(&mut a, 3, 3, 1e-10, &mut rows, &mut columns);
        assert_eq!((rank, rows.get(0), columns.get(0), rows.get(1), columns.get(1)), (2, 1, 2, 2, 1));
    }
}

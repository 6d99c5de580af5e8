//! Small dense matrices by rows: what borders and subspaces need.

/// Eigenvalues, rising, and eigenvectors (column k belongs to eigenvalue k) of a symmetric matrix by rows, by
/// Jacobi's rotations. Source: Golub, Van Loan, *Matrix Computations*, 4th ed., §8.5.
pub(crate) fn symmetric_eigen(matrix: &mut [f64], n: usize) -> (Vec<f64>, Vec<f64>) {
    let mut vectors = vec![0.0; n * n];
    (0..n).for_each(|i| vectors[i * n + i] = 1.0);
    for _ in 0..60 {
        let (mut off, mut all) = (0.0, 0.0);
        for i in 0..n {
            for j in 0..n {
                let square = matrix[i * n + j] * matrix[i * n + j];
                all += square;
                off += if i == j { 0.0 } else { square };
            }
        }
        if off <= 1e-34 * all {
            break;
        }
        for p in 0..n {
            for q in p + 1..n {
                rotate(matrix, &mut vectors, n, p, q);
            }
        }
    }
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| matrix[a * n + a].total_cmp(&matrix[b * n + b]));
    let values = order.iter().map(|&k| matrix[k * n + k]).collect();
    let mut sorted = vec![0.0; n * n];
    for (k, &from) in order.iter().enumerate() {
        (0..n).for_each(|i| sorted[i * n + k] = vectors[i * n + from]);
    }
    (values, sorted)
}

/// Makes the entry (p, q) zero.
fn rotate(matrix: &mut [f64], vectors: &mut [f64], n: usize, p: usize, q: usize) {
    let entry = matrix[p * n + q];
    if entry == 0.0 {
        return;
    }
    let theta = (matrix[q * n + q] - matrix[p * n + p]) / (2.0 * entry);
    let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
    let c = 1.0 / t.hypot(1.0);
    let s = t * c;
    for k in 0..n {
        let (x, y) = (matrix[k * n + p], matrix[k * n + q]);
        (matrix[k * n + p], matrix[k * n + q]) = (c * x - s * y, s * x + c * y);
    }
    for k in 0..n {
        let (x, y) = (matrix[p * n + k], matrix[q * n + k]);
        (matrix[p * n + k], matrix[q * n + k]) = (c * x - s * y, s * x + c * y);
        let (x, y) = (vectors[k * n + p], vectors[k * n + q]);
        (vectors[k * n + p], vectors[k * n + q]) = (c * x - s * y, s * x + c * y);
    }
}

/// L U of a dense matrix by rows, with partial pivoting.
#[derive(Clone, Debug, Default)]
pub(crate) struct DenseLu {
    n: usize,
    pub(crate) rows: Vec<f64>,
    swaps: Vec<usize>,
}

impl DenseLu {
    pub(crate) fn new(n: usize) -> Self {
        Self { n, rows: vec![0.0; n * n], swaps: vec![0; n] }
    }

    /// Factors what is in `rows`. The error is the column without a pivot.
    pub(crate) fn factor(&mut self) -> Result<(), usize> {
        let n = self.n;
        for k in 0..n {
            let size = |row: usize| self.rows[row * n + k].abs();
            let pivot = (k + 1..n).fold(k, |best, row| if size(row) > size(best) { row } else { best });
            self.swaps[k] = pivot;
            if !(size(pivot) > 0.0 && size(pivot).is_finite()) {
                return Err(k);
            }
            if pivot != k {
                (0..n).for_each(|c| self.rows.swap(k * n + c, pivot * n + c));
            }
            for row in k + 1..n {
                let factor = self.rows[row * n + k] / self.rows[k * n + k];
                self.rows[row * n + k] = factor;
                (k + 1..n).for_each(|c| self.rows[row * n + c] -= factor * self.rows[k * n + c]);
            }
        }
        Ok(())
    }

    /// Replaces x by the solution.
    pub(crate) fn solve(&self, x: &mut [f64]) {
        let n = self.n;
        // Whole rows were swapped, multipliers too: swaps come first.
        (0..n).for_each(|k| x.swap(k, self.swaps[k]));
        for k in 0..n {
            x[k] -= (0..k).map(|c| self.rows[k * n + c] * x[c]).sum::<f64>();
        }
        for k in (0..n).rev() {
            let above: f64 = (k + 1..n).map(|c| self.rows[k * n + c] * x[c]).sum();
            x[k] = (x[k] - above) / self.rows[k * n + k];
        }
    }
}

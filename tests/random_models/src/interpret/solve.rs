//! M q̈ − (Φ_qᵀ + ∂Q/∂λ) λ = Q, Φ_q q̈ = γ by Gaussian elimination with complete pivoting.

/// The matrices by rows; N coordinates, R rows.
pub(super) struct System {
    pub(super) mass: Vec<f64>,
    pub(super) force: Vec<f64>,
    pub(super) jacobian: Vec<f64>,
    pub(super) gamma: Vec<f64>,
    /// ∂Q/∂λ, N×R.
    pub(super) by_multipliers: Vec<f64>,
}

/// A pivot this much smaller than the entries that it came from is none.
const NO_PIVOT: f64 = 1e-9;

impl System {
    /// Q at these multipliers becomes what is left of it at none.
    pub(super) fn linearise(&mut self, multipliers: &[f64]) {
        let rows = multipliers.len();
        for (i, force) in self.force.iter_mut().enumerate() {
            let by = &self.by_multipliers[rows * i..rows * (i + 1)];
            *force -= by.iter().zip(multipliers).map(|(b, l)| b * l).sum::<f64>();
        }
    }

    /// q̈ and λ, the entries changed by `rounding` of their size, up or down. λ is NaN where rows repeat each
    /// other, and q̈ where it is not determined either.
    pub(super) fn solve(&self, rounding: f64) -> (Vec<f64>, Vec<f64>) {
        let (n, rows) = (self.force.len(), self.gamma.len());
        let size = n + rows;
        let mut a: Vec<Vec<f64>> = (0..size)
            .map(|i| match i.checked_sub(n) {
                None => {
                    let held =
                        (0..rows).map(|r| -self.jacobian[n * r + i] - self.by_multipliers[rows * i + r]);
                    let mass = self.mass[n * i..n * (i + 1)].iter().copied();
                    mass.chain(held).chain([self.force[i]]).collect()
                }
                Some(r) => {
                    let row = self.jacobian[n * r..n * (r + 1)].iter().copied();
                    row.chain(vec![0.0; rows]).chain([self.gamma[r]]).collect()
                }
            })
            .collect();
        for (i, row) in a.iter_mut().enumerate() {
            let sign = |j: usize| if (i * i + 3 * j) % 5 < 2 { -1.0 } else { 1.0 };
            row.iter_mut().enumerate().for_each(|(j, x)| *x *= 1.0 + sign(j) * rounding);
        }
        let (mut x, free) = eliminate(a);
        let lambda = x.split_off(n);
        if free.is_empty() {
            return (x, lambda);
        }
        let undetermined = if free.iter().any(|k| *k < n) { vec![f64::NAN; n] } else { x };
        (undetermined, vec![f64::NAN; rows])
    }
}

/// The solution, and the unknowns that are not determined, which are 0 in it.
pub(super) fn eliminate(mut a: Vec<Vec<f64>>) -> (Vec<f64>, Vec<usize>) {
    let size = a.len();
    // Rows of one size, so that units do not choose the pivots.
    for row in &mut a {
        let largest = row[..size].iter().fold(0.0_f64, |s, x| s.max(x.abs()));
        if largest > 0.0 {
            row.iter_mut().for_each(|x| *x /= largest);
        }
    }
    let mut order: Vec<usize> = (0..size).collect();
    let mut rank = size;
    for k in 0..size {
        let entries = (k..size).flat_map(|i| (k..size).map(move |j| (i, j)));
        let pivot = entries.max_by(|(i, j), (m, n)| a[*i][*j].abs().total_cmp(&a[*m][*n].abs()));
        let Some((i, j)) = pivot.filter(|(i, j)| a[*i][*j].abs() > NO_PIVOT) else {
            rank = k;
            break;
        };
        a.swap(k, i);
        a.iter_mut().for_each(|row| row.swap(k, j));
        order.swap(k, j);
        let (above, below) = a.split_at_mut(k + 1);
        let pivot = &above[k];
        for row in below {
            let factor = row[k] / pivot[k];
            if factor != 0.0 {
                row[k..].iter_mut().zip(&pivot[k..]).for_each(|(x, p)| *x -= factor * p);
            }
        }
    }
    let mut x = vec![0.0; size];
    for k in (0..rank).rev() {
        let known: f64 = (k + 1..rank).map(|j| a[k][j] * x[order[j]]).sum();
        x[order[k]] = (a[k][size] - known) / a[k][k];
    }
    (x, order[rank..].to_vec())
}

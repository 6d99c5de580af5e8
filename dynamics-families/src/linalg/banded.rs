//! A square banded matrix and its factors: LDLᵀ, and LU with partial pivoting.
//!
//! Factors cost O(n b²), solutions O(n b), with b the half width. Source: Golub, Van Loan, *Matrix
//! Computations*, 4th ed., §4.3.

use super::narrow;

/// A square matrix whose entries are at most `half` places from the diagonal.
#[derive(Clone, Debug)]
pub(crate) struct Banded {
    pub(crate) n: usize,
    pub(crate) half: usize,
    /// Row i has the columns i − half to i + half.
    data: Vec<f64>,
}

impl Banded {
    pub(crate) fn new(n: usize, half: usize) -> Self {
        Self { n, half, data: vec![0.0; n * (2 * half + 1)] }
    }

    pub(crate) fn clear(&mut self) {
        self.data.fill(0.0);
    }

    /// Adds to an entry; false where it lies outside the band.
    #[inline]
    pub(crate) fn add(&mut self, row: usize, column: usize, value: f64) -> bool {
        let shifted = column + self.half;
        if shifted < row || shifted - row > 2 * self.half {
            return false;
        }
        self.data[row * (2 * self.half + 1) + shifted - row] += value;
        true
    }

    /// Becomes a diagonal matrix.
    pub(crate) fn set_diagonal(&mut self, entries: impl Iterator<Item = f64>) {
        for (row, entry) in self.data.chunks_exact_mut(2 * self.half + 1).zip(entries) {
            row.fill(0.0);
            row[self.half] = entry;
        }
    }

    /// Adds multiples to entries of which each is `stride` rows and columns after the one before; false where
    /// they lie outside the band.
    pub(crate) fn add_run(
        &mut self,
        [row, column]: [usize; 2],
        stride: usize,
        values: &[f64],
        factor: f64,
    ) -> bool {
        let (shifted, width) = (column + self.half, 2 * self.half + 1);
        if shifted < row || shifted - row > 2 * self.half {
            return false;
        }
        let places = self.data[row * width + shifted - row..].iter_mut().step_by(stride * width);
        places.zip(values).for_each(|(place, value)| *place += factor * value);
        true
    }

    /// The columns of a row that are inside the matrix, with the entries.
    pub(crate) fn row(&self, row: usize) -> (usize, &[f64]) {
        let width = 2 * self.half + 1;
        let first = row.saturating_sub(self.half);
        let last = (row + self.half + 1).min(self.n);
        let offset = row * width + first + self.half - row;
        (first, &self.data[offset..offset + last - first])
    }

    /// Adds the product with x to y.
    pub(crate) fn multiply_add(&self, x: &[f64], y: &mut [f64]) {
        for (i, y) in y.iter_mut().enumerate() {
            let (first, row) = self.row(i);
            let mut sum = 0.0;
            for (a, x) in row.iter().zip(&x[first..]) {
                sum += a * x;
            }
            *y += sum;
        }
    }

    /// Adds a multiple of another matrix whose band is no wider.
    pub(crate) fn add_multiple(&mut self, factor: f64, other: &Self) {
        let (width, narrow) = (2 * self.half + 1, 2 * other.half + 1);
        let shift = self.half - other.half;
        for (mine, theirs) in self.data.chunks_exact_mut(width).zip(other.data.chunks_exact(narrow)) {
            for (mine, theirs) in mine[shift..].iter_mut().zip(theirs) {
                *mine += factor * theirs;
            }
        }
    }

    /// Whether both halves agree to rounding.
    pub(crate) fn is_symmetric(&self, rounding: f64) -> bool {
        let width = 2 * self.half + 1;
        (0..self.n).all(|i| {
            (i + 1..(i + self.half + 1).min(self.n)).all(|j| {
                let upper = self.data[i * width + self.half + j - i];
                let lower = self.data[j * width + self.half + i - j];
                (upper - lower).abs() <= rounding * (upper.abs() + lower.abs())
            })
        })
    }
}

/// What factors do at a pivot that is not positive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Pivots {
    /// They end.
    Positive,
    /// They end where one is at rounding; rows are to be scaled to 1.
    Regular,
    /// They go on; one that vanishes is replaced by one at rounding. Signs of pivots are the signs of the
    /// eigenvalues (Sylvester).
    AnySign,
}

/// Smallest pivot, in parts of the largest entry of its row.
const LEAST_PIVOT: f64 = 1e-15;

/// Smallest pivot of a matrix with rows scaled to 1, whose rows are to be independent.
pub(crate) const LEAST_SCALED_PIVOT: f64 = 1e-13;

/// L D Lᵀ of a symmetric banded matrix. Only its lower half is read.
#[derive(Clone, Debug)]
pub(crate) struct Ldl {
    half: usize,
    /// Row i of L: the columns i − half to i − 1.
    lower: Vec<f64>,
    inverse: Vec<f64>,
    row: Vec<f64>,
    /// Places after which a recurrence has forgotten its start, of tridiagonal matrices.
    way: Option<usize>,
    /// Pivots below zero.
    pub(crate) negative: usize,
    /// Whether a pivot was at rounding.
    pub(crate) singular: bool,
}

impl Ldl {
    pub(crate) fn new(n: usize, half: usize) -> Self {
        let (lower, inverse) = (vec![0.0; n * half], vec![0.0; n]);
        Self { half, lower, inverse, row: vec![0.0; half + 1], way: None, negative: 0, singular: false }
    }

    /// Factors a matrix of this size. The error is the place of a pivot that is not as it should be.
    pub(crate) fn factor(&mut self, matrix: &Banded, pivots: Pivots) -> Result<(), usize> {
        (self.negative, self.singular) = (0, false);
        if matrix.half != self.half {
            return self.factor_any(matrix, pivots);
        }
        match self.half {
            1 => self.factor_narrow::<1>(matrix, pivots)?,
            2 => self.factor_narrow::<2>(matrix, pivots)?,
            3 => self.factor_narrow::<3>(matrix, pivots)?,
            4 => self.factor_narrow::<4>(matrix, pivots)?,
            5 => self.factor_narrow::<5>(matrix, pivots)?,
            _ => self.factor_any(matrix, pivots)?,
        }
        self.way = if self.half == 1 { narrow::way(&self.lower) } else { None };
        Ok(())
    }

    fn factor_any(&mut self, matrix: &Banded, pivots: Pivots) -> Result<(), usize> {
        let b = self.half;
        for i in 0..matrix.n {
            let first = i.saturating_sub(b);
            let (from, entries) = matrix.row(i);
            // A matrix may have a narrower band than its factors have memory for.
            let row = &mut self.row[..i - first + 1];
            row.fill(0.0);
            let count = i + 1 - from;
            let start = row.len() - count;
            row[start..].copy_from_slice(&entries[..count]);
            let scale = entries.iter().fold(0.0f64, |most, entry| most.max(entry.abs()));
            let mut pivot = row[i - first];
            for j in first..i {
                let low = first.max(j.saturating_sub(b));
                let of_j = &self.lower[j * b + (low + b - j)..j * b + b];
                let mut value = row[j - first];
                for (w, l) in row[low - first..j - first].iter().zip(of_j) {
                    value -= w * l;
                }
                row[j - first] = value;
                let l = value * self.inverse[j];
                pivot -= value * l;
                self.lower[i * b + (j + b - i)] = l;
            }
            let pivot = self.checked(pivot, scale, pivots).ok_or(i)?;
            self.inverse[i] = 1.0 / pivot;
        }
        Ok(())
    }

    fn factor_narrow<const B: usize>(&mut self, matrix: &Banded, pivots: Pivots) -> Result<(), usize> {
        let mut window = narrow::Window::<B>::new();
        for (i, entries) in matrix.data.chunks_exact(2 * B + 1).enumerate() {
            let scale = entries.iter().fold(0.0f64, |most, entry| most.max(entry.abs()));
            let row = window.eliminate(&core::array::from_fn(|k| entries[k]), entries[B]);
            let pivot = self.checked(row.pivot, scale, pivots).ok_or(i)?;
            let inverse = 1.0 / pivot;
            window.push(row.lower, inverse);
            self.inverse[i] = inverse;
            self.lower[i * B..(i + 1) * B].copy_from_slice(&row.lower);
        }
        Ok(())
    }

    /// A pivot as it is used, of a row whose largest entry is `scale`; none where it is not as it should be.
    #[inline(always)]
    fn checked(&mut self, mut pivot: f64, scale: f64, pivots: Pivots) -> Option<f64> {
        let least = LEAST_PIVOT * scale;
        if pivots == Pivots::Regular && pivot.abs() <= LEAST_SCALED_PIVOT {
            return None;
        }
        if pivots == Pivots::Positive && pivot.partial_cmp(&least) != Some(core::cmp::Ordering::Greater) {
            return None;
        }
        if !pivot.is_finite() {
            return None;
        }
        if pivot.abs() <= least {
            self.singular = true;
            pivot = if scale > 0.0 { least } else { f64::MIN_POSITIVE };
        }
        self.negative += usize::from(pivot < 0.0);
        Some(pivot)
    }

    /// Replaces x by the solution.
    pub(crate) fn solve(&self, x: &mut [f64]) {
        match self.half {
            0 => x.iter_mut().zip(&self.inverse).for_each(|(x, inverse)| *x *= inverse),
            1 => narrow::solve_tridiagonal(&self.lower, &self.inverse, x, self.way),
            2 => narrow::solve::<2>(&self.lower, &self.inverse, x),
            3 => narrow::solve::<3>(&self.lower, &self.inverse, x),
            4 => narrow::solve::<4>(&self.lower, &self.inverse, x),
            5 => narrow::solve::<5>(&self.lower, &self.inverse, x),
            _ => self.solve_band(x),
        }
    }

    fn solve_band(&self, x: &mut [f64]) {
        let (n, b) = (x.len(), self.half);
        for i in 0..n {
            let first = i.saturating_sub(b);
            let row = &self.lower[i * b + (first + b - i)..(i + 1) * b];
            let mut value = x[i];
            for (l, x) in row.iter().zip(&x[first..i]) {
                value -= l * x;
            }
            x[i] = value;
        }
        x.iter_mut().zip(&self.inverse).for_each(|(x, inverse)| *x *= inverse);
        for i in (0..n).rev() {
            let first = i.saturating_sub(b);
            let row = &self.lower[i * b + (first + b - i)..(i + 1) * b];
            let value = x[i];
            for (x, l) in x[first..i].iter_mut().zip(row) {
                *x -= l * value;
            }
        }
    }
}

/// P L U of a banded matrix, with partial pivoting.
#[derive(Clone, Debug)]
pub(crate) struct Lu {
    half: usize,
    /// Row i has the columns i − half to i + 2 half.
    rows: Vec<f64>,
    multipliers: Vec<f64>,
    swaps: Vec<usize>,
}

impl Lu {
    pub(crate) fn new(n: usize, half: usize) -> Self {
        let (rows, multipliers) = (vec![0.0; n * (3 * half + 1)], vec![0.0; n * half]);
        Self { half, rows, multipliers, swaps: vec![0; n] }
    }

    /// Factors a matrix of this size. The error is the place of a column without a pivot.
    pub(crate) fn factor(&mut self, matrix: &Banded) -> Result<(), usize> {
        let (n, b) = (matrix.n, self.half);
        let width = 3 * b + 1;
        self.rows.fill(0.0);
        let mut scale = 0.0f64;
        for i in 0..n {
            let (first, entries) = matrix.row(i);
            let offset = i * width + first + b - i;
            self.rows[offset..offset + entries.len()].copy_from_slice(entries);
            scale = entries.iter().fold(scale, |most, entry| most.max(entry.abs()));
        }
        for k in 0..n {
            let last = (k + b + 1).min(n);
            let at = |row: usize| row * width + k + b - row;
            let mut pivot = k;
            for row in k + 1..last {
                if self.rows[at(row)].abs() > self.rows[at(pivot)].abs() {
                    pivot = row;
                }
            }
            let value = self.rows[at(pivot)];
            if value.is_nan() || value.abs() <= f64::EPSILON * f64::EPSILON * scale {
                return Err(k);
            }
            self.swaps[k] = pivot;
            let count = (2 * b + 1).min(n - k);
            let (mine, theirs) = (at(k), at(pivot));
            if pivot != k {
                for c in 0..count {
                    self.rows.swap(mine + c, theirs + c);
                }
            }
            for row in k + 1..last {
                let other = at(row);
                let factor = self.rows[other] / self.rows[mine];
                self.multipliers[k * b + row - k - 1] = factor;
                if factor != 0.0 {
                    let (above, below) = self.rows.split_at_mut(other);
                    for (x, y) in below[1..count].iter_mut().zip(&above[mine + 1..mine + count]) {
                        *x -= factor * y;
                    }
                }
            }
        }
        Ok(())
    }

    /// Replaces x by the solution.
    pub(crate) fn solve(&self, x: &mut [f64]) {
        let (n, b) = (x.len(), self.half);
        let width = 3 * b + 1;
        for k in 0..n {
            x.swap(k, self.swaps[k]);
            let value = x[k];
            for (x, factor) in x[k + 1..].iter_mut().zip(&self.multipliers[k * b..(k + 1) * b]) {
                *x -= factor * value;
            }
        }
        for k in (0..n).rev() {
            let count = (2 * b + 1).min(n - k);
            let row = &self.rows[k * width + b..k * width + b + count];
            let mut value = x[k];
            for (a, x) in row[1..].iter().zip(&x[k + 1..]) {
                value -= a * x;
            }
            x[k] = value / row[0];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A matrix of numbers without a pattern, symmetric where asked.
    fn example(n: usize, half: usize, symmetric: bool) -> Banded {
        let mut matrix = Banded::new(n, half);
        for i in 0..n {
            for j in i.saturating_sub(half)..(i + half + 1).min(n) {
                let (a, b) = if symmetric { (i.min(j), i.max(j)) } else { (i, j) };
                let value = (((a + 3) * (b + 5) * (a + 2 * b + 7) * 7919) % 1009) as f64 / 1009.0 - 0.45;
                let _ = matrix.add(i, j, if i == j && symmetric { 2.0 * value } else { value });
            }
        }
        matrix
    }

    #[test]
    fn factors_solve_to_rounding() {
        for (n, half) in [(1, 0), (5, 0), (9, 1), (40, 3), (7, 6)] {
            let x: Vec<f64> = (0..n).map(|i| 1.0 + (i as f64).cos()).collect();
            for symmetric in [true, false] {
                let matrix = example(n, half, symmetric);
                let mut y = vec![0.0; n];
                matrix.multiply_add(&x, &mut y);
                let mut lu = Lu::new(n, half);
                lu.factor(&matrix).expect("regular");
                let mut z = y.clone();
                lu.solve(&mut z);
                let error = z.iter().zip(&x).fold(0.0f64, |most, (z, x)| most.max((z - x).abs()));
                assert!(error < 1e-10, "{n} {half} {error:e}");
                assert_eq!(matrix.is_symmetric(0.0), symmetric || half == 0);
                if symmetric {
                    let mut ldl = Ldl::new(n, half);
                    ldl.factor(&matrix, Pivots::AnySign).expect("regular");
                    let mut z = y.clone();
                    ldl.solve(&mut z);
                    let error = z.iter().zip(&x).fold(0.0f64, |most, (z, x)| most.max((z - x).abs()));
                    assert!(error < 1e-8, "{n} {half} {error:e}");
                }
            }
        }
    }

    #[test]
    fn signs_of_pivots_count_eigenvalues() {
        // 2 − 2 cos(k π/(n + 1)) less a shift.
        let n = 50;
        for shift in [0.0, 0.5, 1.7, 3.9, 4.1] {
            let mut matrix = Banded::new(n, 1);
            for i in 0..n {
                matrix.add(i, i, 2.0 - shift);
                if i > 0 {
                    matrix.add(i, i - 1, -1.0);
                    matrix.add(i - 1, i, -1.0);
                }
            }
            let below = (1..=n)
                .filter(|&k| 2.0 - 2.0 * (k as f64 * core::f64::consts::PI / (n + 1) as f64).cos() < shift);
            let mut ldl = Ldl::new(n, 1);
            ldl.factor(&matrix, Pivots::AnySign).expect("finite");
            assert_eq!(ldl.negative, below.count());
        }
    }
}

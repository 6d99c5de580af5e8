//! Symmetric matrices whose elements stand near the diagonal, and their factors L D Lᵀ.
//!
//! n (w + 1) numbers for half-bandwidth w; factoring takes n w² operations, solving 4 n w (G. H. Golub & C.
//! F. Van Loan, *Matrix Computations*, §4.3). There is no pivoting, so the factors of an indefinite matrix
//! may be inaccurate; the caller checks this. The signs of D still count eigenvalues (Sylvester's law).

use alloc::vec::Vec;

use super::VibrationError;

/// A symmetric n×n matrix of half-bandwidth w: element (i, j) is zero where |i − j| > w.
#[derive(Clone, Debug, PartialEq)]
pub struct Banded {
    n: usize,
    width: usize,
    /// Row by row, elements (i, i − w) to (i, i).
    values: Vec<f64>,
}

impl Banded {
    /// All zero.
    #[must_use]
    pub fn zeros(n: usize, width: usize) -> Self {
        Self { n, width, values: alloc::vec![0.0; n * (width + 1)] }
    }

    /// With these elements on the diagonal.
    #[must_use]
    pub fn diagonal(values: &[f64]) -> Self {
        Self { n: values.len(), width: 0, values: values.to_vec() }
    }

    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.n
    }

    /// Whether it has no rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.n == 0
    }

    /// Half-bandwidth.
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Element (i, j); 0 outside of the band.
    #[must_use]
    pub fn get(&self, i: usize, j: usize) -> f64 {
        let (row, column) = (i.max(j), i.min(j));
        if row >= self.n || row - column > self.width { 0.0 } else { self.values[self.at(row, column)] }
    }

    /// Adds to element (i, j) and (j, i), as springs and finite elements are assembled.
    ///
    /// # Errors
    /// An element outside of the band.
    pub fn add(&mut self, i: usize, j: usize, value: f64) -> Result<(), VibrationError> {
        let (row, column) = (i.max(j), i.min(j));
        if row >= self.n || row - column > self.width {
            return Err(VibrationError::Shapes { shapes: [(i, j), (self.n, self.width)].into() });
        }
        let at = self.at(row, column);
        self.values[at] += value;
        Ok(())
    }

    /// Index of an element of the lower triangle within `values`.
    fn at(&self, row: usize, column: usize) -> usize {
        row * (self.width + 1) + self.width + column - row
    }

    pub(super) fn is_finite(&self) -> bool {
        self.values.iter().all(|x| x.is_finite())
    }

    pub(super) fn is_zero(&self) -> bool {
        self.values.iter().all(|x| *x == 0.0)
    }

    /// A x.
    pub(super) fn times(&self, x: &[f64]) -> Vec<f64> {
        let mut y = alloc::vec![0.0; self.n];
        for i in 0..self.n {
            for j in i.saturating_sub(self.width)..i {
                let a = self.values[self.at(i, j)];
                y[i] += a * x[j];
                y[j] += a * x[i];
            }
            y[i] += self.values[self.at(i, i)] * x[i];
        }
        y
    }

    /// A − `shift` B, with the larger half-bandwidth.
    pub(super) fn minus(&self, shift: f64, b: &Self) -> Self {
        let mut found = Self::zeros(self.n, self.width.max(b.width));
        for i in 0..self.n {
            for j in i.saturating_sub(found.width)..=i {
                let at = found.at(i, j);
                found.values[at] = self.get(i, j) - shift * b.get(i, j);
            }
        }
        found
    }

    /// The factors L D Lᵀ, in place; `Err` with the row whose pivot is zero or not finite.
    pub(super) fn factor(mut self) -> Result<BandedLdlt, usize> {
        let w = self.width;
        for i in 0..self.n {
            for j in i.saturating_sub(w)..=i {
                let mut value = self.values[self.at(i, j)];
                for k in i.saturating_sub(w).max(j.saturating_sub(w))..j {
                    value -=
                        self.values[self.at(i, k)] * self.values[self.at(j, k)] * self.values[self.at(k, k)];
                }
                let at = self.at(i, j);
                self.values[at] = if i == j { value } else { value / self.values[self.at(j, j)] };
            }
            let pivot = self.values[self.at(i, i)];
            if pivot == 0.0 || !pivot.is_finite() {
                return Err(i);
            }
        }
        Ok(BandedLdlt { of: self })
    }
}

/// The factors L D Lᵀ of a banded matrix: D on the diagonal, L below it.
pub(super) struct BandedLdlt {
    of: Banded,
}

impl BandedLdlt {
    /// The number of negative elements of D, which is the number of negative eigenvalues.
    pub(super) fn negative(&self) -> usize {
        (0..self.of.n).filter(|i| self.of.get(*i, *i) < 0.0).count()
    }

    /// The first row whose element of D is negative.
    pub(super) fn first_negative(&self) -> Option<usize> {
        (0..self.of.n).find(|i| self.of.get(*i, *i) < 0.0)
    }

    /// Solves in place.
    pub(super) fn solve(&self, x: &mut [f64]) {
        let (n, w) = (self.of.n, self.of.width);
        for i in 0..n {
            for j in i.saturating_sub(w)..i {
                x[i] -= self.of.values[self.of.at(i, j)] * x[j];
            }
        }
        for (i, x) in x.iter_mut().enumerate() {
            *x /= self.of.values[self.of.at(i, i)];
        }
        for i in (0..n).rev() {
            for j in i.saturating_sub(w)..i {
                x[j] -= self.of.values[self.of.at(i, j)] * x[i];
            }
        }
    }
}

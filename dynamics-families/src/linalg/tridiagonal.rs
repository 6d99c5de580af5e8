//! Symmetric positive definite tridiagonal systems, from both ends to the middle: two recurrences side by
//! side take little more time than one, because each waits for its own divisions.

/// Factors of a tridiagonal matrix.
#[derive(Clone, Debug)]
pub(crate) struct Tridiagonal {
    /// 1/pivot of every place.
    inverse: Vec<f64>,
    /// The entry towards the end where elimination began, over that pivot.
    lower: Vec<f64>,
}

/// Smallest pivot, in parts of the entry on the diagonal.
const LEAST_PIVOT: f64 = 1e-13;

impl Tridiagonal {
    pub(crate) fn new(n: usize) -> Self {
        Self { inverse: vec![0.0; n], lower: vec![0.0; n] }
    }

    /// Factors the matrix with this diagonal; `beside[i]` couples i − 1 and i. The error is the place of a
    /// pivot that is not positive.
    pub(crate) fn factor(&mut self, diagonal: &[f64], beside: &[f64]) -> Result<(), usize> {
        let n = diagonal.len();
        if n == 0 {
            return Ok(());
        }
        // The middle is eliminated last.
        let middle = n / 2;
        let good = |pivot: f64, k: usize| pivot > LEAST_PIVOT * diagonal[k];
        let mut all_good = true;
        let (mut before, mut after) = (0.0, 0.0);
        // Places k from the start and n − 1 − k from the end; the latter has `middle` or one fewer.
        let from_end = n - 1 - middle;
        for k in 0..middle {
            let low = beside_at(beside, k) * before;
            let pivot = diagonal[k] - low * beside_at(beside, k);
            before = 1.0 / pivot;
            self.lower[k] = low;
            self.inverse[k] = before;
            all_good &= good(pivot, k);
            if k < from_end {
                let at = n - 1 - k;
                let coupling = if k == 0 { 0.0 } else { beside[at + 1] };
                let high = coupling * after;
                let pivot = diagonal[at] - high * coupling;
                after = 1.0 / pivot;
                self.lower[at] = high;
                self.inverse[at] = after;
                all_good &= good(pivot, at);
            }
        }
        let low = beside_at(beside, middle);
        let high = if middle + 1 < n { beside[middle + 1] } else { 0.0 };
        let pivot = diagonal[middle] - low * low * before - high * high * after;
        self.inverse[middle] = 1.0 / pivot;
        self.lower[middle] = low * before;
        all_good &= good(pivot, middle);
        if all_good {
            return Ok(());
        }
        let bad = (0..n).find(|&k| !good(1.0 / self.inverse[k], k));
        Err(bad.unwrap_or(middle))
    }

    /// Replaces x by the solution. `beside` is that of the factors.
    pub(crate) fn solve(&self, beside: &[f64], x: &mut [f64]) {
        let n = x.len();
        if n == 0 {
            return;
        }
        let middle = n / 2;
        let from_end = n - 1 - middle;
        let (mut before, mut after) = (0.0, 0.0);
        for k in 0..middle {
            before = x[k] - self.lower[k] * before;
            x[k] = before;
            if k < from_end {
                let at = n - 1 - k;
                after = x[at] - self.lower[at] * after;
                x[at] = after;
            }
        }
        let high = if middle + 1 < n { beside[middle + 1] * self.inverse[middle + 1] } else { 0.0 };
        let value = (x[middle] - self.lower[middle] * before - high * after) * self.inverse[middle];
        x[middle] = value;
        let (mut right, mut left) = (value, value);
        for k in (0..middle).rev() {
            right = (x[k] - beside[k + 1] * right) * self.inverse[k];
            x[k] = right;
            if k < from_end {
                let at = n - 1 - k;
                left = (x[at] - beside[at] * left) * self.inverse[at];
                x[at] = left;
            }
        }
    }

    /// Bytes on the heap.
    pub(crate) fn bytes(&self) -> usize {
        16 * self.inverse.len()
    }
}

/// The coupling of k − 1 and k; none before the first.
fn beside_at(beside: &[f64], k: usize) -> f64 {
    if k == 0 { 0.0 } else { beside[k] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn systems_of_every_size_are_solved() {
        for n in 1..40 {
            let diagonal: Vec<f64> = (0..n).map(|i| 2.0 + (i as f64).cos()).collect();
            let beside: Vec<f64> = (0..n).map(|i| (0.7 * i as f64).sin()).collect();
            let exact: Vec<f64> = (0..n).map(|i| (1.3 * i as f64).cos()).collect();
            let mut x: Vec<f64> = (0..n)
                .map(|i| {
                    let before = if i > 0 { beside[i] * exact[i - 1] } else { 0.0 };
                    let after = if i + 1 < n { beside[i + 1] * exact[i + 1] } else { 0.0 };
                    diagonal[i] * exact[i] + before + after
                })
                .collect();
            let mut factors = Tridiagonal::new(n);
            assert_eq!(factors.factor(&diagonal, &beside), Ok(()));
            factors.solve(&beside, &mut x);
            assert!(x.iter().zip(&exact).all(|(x, exact)| (x - exact).abs() < 1e-12), "{n}");
        }
    }

    #[test]
    fn dependent_rows_are_found() {
        // Two equal rows.
        let mut factors = Tridiagonal::new(3);
        assert!(factors.factor(&[1.0, 1.0, 2.0], &[0.0, 1.0, 0.0]).is_err());
        assert!(factors.factor(&[1.0, f64::NAN, 2.0], &[0.0, 1.0, 0.0]).is_err());
    }
}

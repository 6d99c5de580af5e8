//! Numeric rank of rows in a given order, by Gram–Schmidt with reorthogonalisation.
//!
//! Rows are scaled to length one first. The remainder of a dependent row is of the size of the rounding
//! errors, or of the error of the projection onto the manifold, 1e-12. That of an independent row at a random
//! state is rarely below 1e-4. [`DEPENDENT_REST`] lies between them.

/// Largest remainder, of a row of length one, with which the row depends on those before it. It lies between
/// the errors of rounding and projection, 1e-12, and the remainders of independent rows, which are rarely
/// below 1e-4.
pub(super) const DEPENDENT_REST: f64 = 1e-7;

/// Rows in orthonormal form, with what they are made of.
#[derive(Clone, Debug, Default)]
pub(super) struct Basis {
    /// Orthonormal vectors.
    vectors: Vec<Vec<f64>>,
    /// The independent rows, by name.
    names: Vec<usize>,
    /// Each vector as a combination of the independent rows up to its own.
    made: Vec<Vec<f64>>,
}

impl Basis {
    pub(super) fn rank(&self) -> usize {
        self.vectors.len()
    }

    /// Adds a row; where it depends on those that are there, its coefficients by name. An empty row depends
    /// on nothing.
    pub(super) fn add(&mut self, name: usize, row: &[f64]) -> Option<Vec<(usize, f64)>> {
        let length = norm(row);
        if length == 0.0 {
            return Some(Vec::new());
        }
        let (rest, mut made) = self.rest(row);
        let left = norm(&rest);
        if left > DEPENDENT_REST {
            made.push(1.0 / length);
            self.vectors.push(rest.iter().map(|x| x / left).collect());
            self.made.push(made.into_iter().map(|c| c / left).collect());
            self.names.push(name);
            return None;
        }
        // 0 ≈ row/‖row‖ + Σ c s: row = −‖row‖ Σ c s.
        Some(self.names.iter().copied().zip(made.into_iter().map(|c| -length * c)).collect())
    }

    /// What is left of a row scaled to length one without its part along those that are there: row/‖row‖ + Σ
    /// made·(independent rows).
    pub(super) fn rest(&self, row: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let length = norm(row);
        let unit = |x: &f64| if length > 0.0 { x / length } else { 0.0 };
        let mut rest: Vec<f64> = row.iter().map(unit).collect();
        let mut made = vec![0.0; self.rank()];
        for _ in 0..2 {
            for (vector, its_made) in self.vectors.iter().zip(&self.made) {
                let along: f64 = rest.iter().zip(vector).map(|(a, b)| a * b).sum();
                rest.iter_mut().zip(vector).for_each(|(x, v)| *x -= along * v);
                made.iter_mut().zip(its_made).for_each(|(m, c)| *m -= along * c);
            }
        }
        (rest, made)
    }

    /// An orthonormal basis of what is orthogonal to all rows, of vectors of this length.
    pub(super) fn complement(&self, length: usize) -> Vec<Vec<f64>> {
        let mut all = self.clone();
        let unit = |j: usize| (0..length).map(|i| if i == j { 1.0 } else { 0.0 }).collect::<Vec<f64>>();
        let mut left: Vec<usize> = (0..length).collect();
        // The axis farthest from the span first, so that none is a difference of nearly equal numbers.
        while all.rank() < length {
            let outside = |j: &usize| 1.0 - all.vectors.iter().map(|v| v[*j] * v[*j]).sum::<f64>();
            let Some((at, _)) = left.iter().map(outside).enumerate().max_by(|a, b| a.1.total_cmp(&b.1))
            else {
                break;
            };
            let axis = left.swap_remove(at);
            all.add(usize::MAX, &unit(axis));
        }
        all.vectors.split_off(self.rank())
    }
}

pub(super) fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Largest denominator of a fraction that is recognised.
const LARGEST_DENOMINATOR: i64 = 12;
/// Largest numerator of a fraction that is recognised.
const LARGEST_NUMERATOR: f64 = 1e3;
/// Distance from a fraction, in parts of 1/d, below which a number is read as one. Coefficients of dependent
/// rows are known to about 1e-7, see [`DEPENDENT_REST`].
const FRACTION_TOLERANCE: f64 = 1e-6;

/// The fraction n/d that a number is within [`FRACTION_TOLERANCE`] of.
pub(super) fn fraction(x: f64) -> Option<(i64, i64)> {
    let close = |d: &i64| {
        let n = x * *d as f64;
        (n - n.round()).abs() < FRACTION_TOLERANCE && n.abs() < LARGEST_NUMERATOR
    };
    (1..=LARGEST_DENOMINATOR).find(close).map(|d| ((x * d as f64).round() as i64, d))
}

#[cfg(test)]
mod tests {
    use super::{Basis, fraction, norm};

    #[test]
    fn dependent_rows_come_with_their_coefficients() {
        let mut b = Basis::default();
        assert_eq!(b.add(4, &[3.0, 0.0, 4.0]), None);
        assert_eq!(b.add(5, &[1.0, 2.0, 0.0]), None);
        let coefficients = b.add(6, &[1.0, -4.0, 4.0]).expect("row 4 minus twice row 5");
        let of = |r: usize| coefficients.iter().find(|(s, _)| *s == r).map_or(0.0, |(_, c)| *c);
        assert!((of(4) - 1.0).abs() < 1e-12 && (of(5) + 2.0).abs() < 1e-12, "{coefficients:?}");
        let free = b.complement(3);
        assert_eq!(free.len(), 1);
        let along = |row: [f64; 3]| row.iter().zip(&free[0]).map(|(a, b)| a * b).sum::<f64>().abs();
        assert!(
            along([3.0, 0.0, 4.0]) < 1e-14
                && along([1.0, 2.0, 0.0]) < 1e-14
                && (norm(&free[0]) - 1.0).abs() < 1e-14
        );
    }

    #[test]
    fn fractions_are_read() {
        assert_eq!(fraction(-0.75), Some((-3, 4)));
        assert_eq!(fraction(2.0), Some((2, 1)));
        assert_eq!(fraction(0.1234), None);
    }
}

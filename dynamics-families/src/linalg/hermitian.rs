//! Small Hermitian matrices: what waves of one phase per node need. Entries are pairs (real, imaginary), by
//! rows.

use core::ops::{Add, Mul, Sub};

/// A complex number.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Complex {
    pub(crate) re: f64,
    pub(crate) im: f64,
}

impl Complex {
    pub(crate) const fn new(re: f64, im: f64) -> Self {
        Self { re, im }
    }

    /// e^{i phase}.
    pub(crate) fn turned(phase: f64) -> Self {
        Self::new(phase.cos(), phase.sin())
    }

    pub(crate) fn conj(self) -> Self {
        Self::new(self.re, -self.im)
    }

    pub(crate) fn scaled(self, by: f64) -> Self {
        Self::new(self.re * by, self.im * by)
    }

    pub(crate) fn size(self) -> f64 {
        self.re.hypot(self.im)
    }
}

impl Add for Complex {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::new(self.re + other.re, self.im + other.im)
    }
}

impl Sub for Complex {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self::new(self.re - other.re, self.im - other.im)
    }
}

impl Mul for Complex {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self::new(self.re * other.re - self.im * other.im, self.re * other.im + self.im * other.re)
    }
}

/// A square matrix of complex numbers by rows.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Square {
    pub(crate) n: usize,
    pub(crate) entries: Vec<Complex>,
}

impl Square {
    pub(crate) fn new(n: usize) -> Self {
        Self { n, entries: vec![Complex::default(); n * n] }
    }

    pub(crate) fn at(&self, i: usize, j: usize) -> Complex {
        self.entries[i * self.n + j]
    }

    pub(crate) fn at_mut(&mut self, i: usize, j: usize) -> &mut Complex {
        &mut self.entries[i * self.n + j]
    }

    /// The product with another of the same size.
    pub(crate) fn times(&self, other: &Self) -> Self {
        let mut product = Self::new(self.n);
        for i in 0..self.n {
            for j in 0..self.n {
                let terms = (0..self.n).map(|k| self.at(i, k) * other.at(k, j));
                *product.at_mut(i, j) = terms.fold(Complex::default(), Complex::add);
            }
        }
        product
    }

    /// Vᴴ A V: this matrix between vectors, which are the columns of V.
    pub(crate) fn between(&self, vectors: &Self) -> Self {
        let mut left = Self::new(self.n);
        for i in 0..self.n {
            for j in 0..self.n {
                *left.at_mut(i, j) = vectors.at(j, i).conj();
            }
        }
        left.times(&self.times(vectors))
    }

    /// Eigenvalues, rising, and eigenvectors by columns of a Hermitian matrix, by Jacobi's rotations. Source:
    /// Golub, Van Loan, *Matrix Computations*, 4th ed., §8.5.
    pub(crate) fn eigen(&self) -> (Vec<f64>, Self) {
        let n = self.n;
        let (mut a, mut v) = (self.clone(), Self::new(n));
        (0..n).for_each(|i| *v.at_mut(i, i) = Complex::new(1.0, 0.0));
        for _ in 0..60 {
            let (mut off, mut all) = (0.0, 0.0);
            for i in 0..n {
                for j in 0..n {
                    let size = a.at(i, j).size();
                    all += size * size;
                    off += if i == j { 0.0 } else { size * size };
                }
            }
            if off <= 1e-34 * all {
                break;
            }
            for p in 0..n {
                for q in p + 1..n {
                    rotate(&mut a, &mut v, p, q);
                }
            }
        }
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|&i, &j| a.at(i, i).re.total_cmp(&a.at(j, j).re));
        let values = order.iter().map(|&k| a.at(k, k).re).collect();
        let mut sorted = Self::new(n);
        for (k, &from) in order.iter().enumerate() {
            (0..n).for_each(|i| *sorted.at_mut(i, k) = v.at(i, from));
        }
        (values, sorted)
    }
}

/// Sizes of entries that are taken to be zero.
const SMALLEST: f64 = 1e-280;

/// Makes the entries (p, q) and (q, p) zero: a phase that makes them real, then a rotation.
fn rotate(a: &mut Square, v: &mut Square, p: usize, q: usize) {
    let entry = a.at(p, q);
    let size = entry.size();
    // A phase of numbers near the smallest ones has few digits: a rotation by it would not keep lengths.
    let negligible = 1e-20 * (a.at(p, p).re * a.at(q, q).re).abs().sqrt();
    if size <= negligible.max(SMALLEST) {
        return;
    }
    let theta = (a.at(q, q).re - a.at(p, p).re) / (2.0 * size);
    let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
    let c = 1.0 / t.hypot(1.0);
    let s = t * c;
    let phase = Complex::new(entry.re / size, entry.im / size);
    // Columns p' = c p − s e^{−iφ} q and q' = s p + c e^{−iφ} q.
    let turned = |matrix: &mut Square| {
        for k in 0..matrix.n {
            let (x, y) = (matrix.at(k, p), matrix.at(k, q) * phase.conj());
            *matrix.at_mut(k, p) = x.scaled(c) - y.scaled(s);
            *matrix.at_mut(k, q) = x.scaled(s) + y.scaled(c);
        }
    };
    turned(a);
    turned(v);
    for k in 0..a.n {
        let (x, y) = (a.at(p, k), a.at(q, k) * phase);
        *a.at_mut(p, k) = x.scaled(c) - y.scaled(s);
        *a.at_mut(q, k) = x.scaled(s) + y.scaled(c);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvectors_diagonalise() {
        let n = 4;
        let mut a = Square::new(n);
        for i in 0..n {
            for j in i..n {
                let entry = Complex::new(
                    ((3 * i + 5 * j) as f64).sin(),
                    if i == j { 0.0 } else { ((i + 7 * j) as f64).cos() },
                );
                *a.at_mut(i, j) = entry;
                *a.at_mut(j, i) = entry.conj();
            }
        }
        let (values, vectors) = a.eigen();
        assert!(values.is_sorted());
        let mut unit = Square::new(n);
        (0..n).for_each(|i| *unit.at_mut(i, i) = Complex::new(1.0, 0.0));
        let (diagonal, lengths) = (a.between(&vectors), unit.between(&vectors));
        for (i, value) in values.into_iter().enumerate() {
            for j in 0..n {
                let exact = if i == j { value } else { 0.0 };
                assert!((diagonal.at(i, j) - Complex::new(exact, 0.0)).size() < 1e-14, "{i} {j}");
                assert!((lengths.at(i, j) - unit.at(i, j)).size() < 1e-14, "{i} {j}");
            }
        }
    }
}

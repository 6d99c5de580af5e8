//! Square systems of real and of complex numbers with as many rows as a [`Vector`], or blocks of them:
//! Gaussian elimination with row pivoting in place. Nothing is allocated.
//!
//! Matrices stand by rows; complex ones as two of real numbers. Rows and columns carry the units of the
//! coordinates, the diagonal is what an identity matrix adds: it leads wherever steps are short enough, so
//! rows are not scaled before a pivot is chosen.

use crate::model::Vector;

/// K matrices of as many rows and columns as a vector has elements.
#[cfg(feature = "alloc")]
#[derive(Clone, Debug)]
pub(crate) struct Matrices<V, const K: usize> {
    // On the heap, as the matrices of a large model do not fit the stack; allocated once.
    all: alloc::boxed::Box<[f64]>,
    of: core::marker::PhantomData<V>,
}

#[cfg(feature = "alloc")]
impl<V: Vector, const K: usize> Matrices<V, K> {
    pub(crate) fn new() -> Self {
        Self { all: alloc::vec![0.0; K * V::LEN * V::LEN].into_boxed_slice(), of: core::marker::PhantomData }
    }

    #[inline(always)]
    pub(crate) fn all(&mut self) -> &mut [f64] {
        &mut self.all
    }
}

#[cfg(not(feature = "alloc"))]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Matrices<V: Vector, const K: usize>([V::Square; K]);

#[cfg(not(feature = "alloc"))]
impl<V: Vector, const K: usize> Matrices<V, K> {
    pub(crate) fn new() -> Self {
        Self([crate::model::Square::zeros(); K])
    }

    #[inline(always)]
    pub(crate) fn all(&mut self) -> &mut [f64] {
        crate::model::Square::flatten(&mut self.0)
    }
}

impl<V: Vector, const K: usize> Matrices<V, K> {
    /// One of them.
    #[inline(always)]
    pub(crate) fn one(&mut self, index: usize) -> &mut [f64] {
        &mut self.all()[index * V::LEN * V::LEN..(index + 1) * V::LEN * V::LEN]
    }
}

/// P A = L U in place. Returns with which row each one was exchanged, `None` where A is singular or not
/// finite.
#[inline]
pub(crate) fn factor<V: Vector>(a: &mut [f64]) -> Option<V> {
    let mut exchanges = V::zeros();
    eliminate(a, V::LEN, |j, row| exchanges[j] = row as f64).then_some(exchanges)
}

/// As [`factor`], for a matrix of B×B blocks.
#[inline]
pub(crate) fn factor_blocks<V: Vector, const B: usize>(a: &mut [f64]) -> Option<[V; B]> {
    let mut exchanges = [V::zeros(); B];
    eliminate(a, B * V::LEN, |j, row| exchanges[j / V::LEN][j % V::LEN] = row as f64).then_some(exchanges)
}

/// P A = L U in place; false where A is singular or not finite.
#[inline(always)]
fn eliminate(a: &mut [f64], n: usize, mut exchanged: impl FnMut(usize, usize)) -> bool {
    for j in 0..n {
        let size = |i: usize| a[i * n + j].abs();
        let row = (j + 1..n).fold(j, |best, i| if size(i) > size(best) { i } else { best });
        exchanged(j, row);
        // NaN fails, too.
        if !(a[row * n + j].abs() > 0.0 && a[row * n + j].is_finite()) {
            return false;
        }
        if row != j {
            (0..n).for_each(|k| a.swap(j * n + k, row * n + k));
        }
        let inverse = 1.0 / a[j * n + j];
        let (upper, lower) = a.split_at_mut((j + 1) * n);
        let upper = &upper[j * n..];
        for row in lower.chunks_exact_mut(n) {
            let factor = row[j] * inverse;
            row[j] = factor;
            for k in j + 1..n {
                row[k] -= factor * upper[k];
            }
        }
    }
    true
}

/// A x = b in place of b, with what [`factor`] left.
#[inline]
pub(crate) fn solve<V: Vector>(a: &[f64], exchanges: &V, b: &mut V) {
    let n = V::LEN;
    // Multipliers were exchanged with their rows: first all exchanges.
    (0..n).for_each(|j| b.as_mut_slice().swap(j, exchanges[j] as usize));
    for j in 0..n {
        let x = b[j];
        for i in j + 1..n {
            b[i] -= a[i * n + j] * x;
        }
    }
    for i in (0..n).rev() {
        let mut x = b[i];
        for k in i + 1..n {
            x -= a[i * n + k] * b[k];
        }
        b[i] = x / a[i * n + i];
    }
}

/// As [`solve`], with what [`factor_blocks`] left.
#[inline]
pub(crate) fn solve_blocks<V: Vector, const B: usize>(a: &[f64], exchanges: &[V; B], b: &mut [V; B]) {
    let (m, n) = (V::LEN, B * V::LEN);
    for j in 0..n {
        let row = exchanges[j / m][j % m] as usize;
        let (x, y) = (b[row / m][row % m], b[j / m][j % m]);
        (b[j / m][j % m], b[row / m][row % m]) = (x, y);
    }
    for j in 0..n {
        let x = b[j / m][j % m];
        for i in j + 1..n {
            b[i / m][i % m] -= a[i * n + j] * x;
        }
    }
    for i in (0..n).rev() {
        let mut x = b[i / m][i % m];
        for k in i + 1..n {
            x -= a[i * n + k] * b[k / m][k % m];
        }
        b[i / m][i % m] = x / a[i * n + i];
    }
}

/// As [`factor`], for A = re + i im. Reciprocals of the pivots stand in their places.
pub(crate) fn factor_complex<V: Vector>(re: &mut [f64], im: &mut [f64]) -> Option<V> {
    let n = V::LEN;
    let mut exchanges = V::zeros();
    for j in 0..n {
        let size = |i: usize| re[i * n + j].abs() + im[i * n + j].abs();
        let row = (j + 1..n).fold(j, |best, i| if size(i) > size(best) { i } else { best });
        exchanges[j] = row as f64;
        if !(size(row) > 0.0 && size(row).is_finite()) {
            return None;
        }
        if row != j {
            for k in 0..n {
                re.swap(j * n + k, row * n + k);
                im.swap(j * n + k, row * n + k);
            }
        }
        let inverse = reciprocal(re[j * n + j], im[j * n + j]);
        (re[j * n + j], im[j * n + j]) = inverse;
        for i in j + 1..n {
            let factor = complex_product((re[i * n + j], im[i * n + j]), inverse);
            (re[i * n + j], im[i * n + j]) = factor;
            for k in j + 1..n {
                let (r, s) = complex_product(factor, (re[j * n + k], im[j * n + k]));
                re[i * n + k] -= r;
                im[i * n + k] -= s;
            }
        }
    }
    Some(exchanges)
}

/// A (x + i y) = b + i c in place of b and c, with what [`factor_complex`] left.
pub(crate) fn solve_complex<V: Vector>(re: &[f64], im: &[f64], exchanges: &V, b: &mut V, c: &mut V) {
    let n = V::LEN;
    for j in 0..n {
        b.as_mut_slice().swap(j, exchanges[j] as usize);
        c.as_mut_slice().swap(j, exchanges[j] as usize);
    }
    for j in 0..n {
        let x = (b[j], c[j]);
        for i in j + 1..n {
            let (r, s) = complex_product((re[i * n + j], im[i * n + j]), x);
            b[i] -= r;
            c[i] -= s;
        }
    }
    for i in (0..n).rev() {
        let (mut x, mut y) = (b[i], c[i]);
        for k in i + 1..n {
            let (r, s) = complex_product((re[i * n + k], im[i * n + k]), (b[k], c[k]));
            x -= r;
            y -= s;
        }
        (b[i], c[i]) = complex_product((x, y), (re[i * n + i], im[i * n + i]));
    }
}

/// (a + i b)(c + i d).
#[inline(always)]
pub(crate) fn complex_product((a, b): (f64, f64), (c, d): (f64, f64)) -> (f64, f64) {
    (a * c - b * d, a * d + b * c)
}

/// 1/(a + i b), by Smith's formula: no square overflows.
#[inline(always)]
pub(crate) fn reciprocal(a: f64, b: f64) -> (f64, f64) {
    if a.abs() >= b.abs() {
        let ratio = b / a;
        let size = a + b * ratio;
        (1.0 / size, -ratio / size)
    } else {
        let ratio = a / b;
        let size = a * ratio + b;
        (ratio / size, -1.0 / size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Complex, SMatrix, SVector};

    const N: usize = 6;
    type V = SVector<f64, N>;

    /// Numbers between −1 and 1 from a linear congruence.
    fn numbers(seed: u64) -> impl FnMut() -> f64 {
        let mut x = seed;
        move || {
            x = x.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (x >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }
    }

    #[test]
    fn real_and_complex_systems_are_solved_to_rounding() {
        let mut next = numbers(7);
        for _ in 0..20 {
            let a = SMatrix::<Complex<f64>, N, N>::from_fn(|i, _| {
                // A zero to begin with makes exchanges necessary.
                Complex::new(if i == 0 { 0.0 } else { next() }, next())
            });
            let exact = SVector::<Complex<f64>, N>::from_fn(|_, _| Complex::new(next(), next()));
            let b = a * exact;
            let mut re: Vec<f64> = a.transpose().iter().map(|x| x.re).collect();
            let mut im: Vec<f64> = a.transpose().iter().map(|x| x.im).collect();
            let (mut x, mut y) = (b.map(|x| x.re), b.map(|x| x.im));
            let exchanges: V = factor_complex(&mut re, &mut im).expect("regular");
            solve_complex(&re, &im, &exchanges, &mut x, &mut y);
            let error = (x - exact.map(|x| x.re)).norm() + (y - exact.map(|x| x.im)).norm();
            assert!(error < 1e-12, "{error}");

            let a = SMatrix::<f64, N, N>::from_fn(|i, j| if i == j { 0.0 } else { next() });
            let exact = V::from_fn(|_, _| next());
            let mut rows: Vec<f64> = a.transpose().iter().copied().collect();
            let mut x = a * exact;
            let exchanges: V = factor(&mut rows).expect("regular");
            solve(&rows, &exchanges, &mut x);
            assert!((x - exact).norm() < 1e-12);

            // The same in three by three blocks of two.
            let mut rows: Vec<f64> = a.transpose().iter().copied().collect();
            let b = a * exact;
            let mut x: [SVector<f64, 2>; 3] =
                std::array::from_fn(|i| SVector::from([b[2 * i], b[2 * i + 1]]));
            let exchanges = factor_blocks(&mut rows).expect("regular");
            solve_blocks(&rows, &exchanges, &mut x);
            assert!((0..N).all(|i| (x[i / 2][i % 2] - exact[i]).abs() < 1e-12));
        }
    }

    #[test]
    fn singular_and_not_finite_matrices_say_so() {
        type W = SVector<f64, 2>;
        for a in [[1.0, 2.0, 2.0, 4.0], [0.0; 4], [f64::NAN, 1.0, 1.0, 0.0], [f64::INFINITY, 0.0, 0.0, 1.0]] {
            let (mut re, mut im) = (a, [0.0; 4]);
            assert_eq!(factor::<W>(&mut a.clone()), None, "{a:?}");
            assert_eq!(factor_complex::<W>(&mut re, &mut im), None, "{a:?}");
        }
    }
}

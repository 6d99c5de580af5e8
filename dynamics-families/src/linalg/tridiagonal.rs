//! Symmetric positive definite tridiagonal systems, factored and solved at once.
//!
//! Long systems are cut into eight stretches with separators between them, which are eliminated side by side
//! as lanes of a vector: each recurrence waits for its own divisions, and eight wait no longer than one.
//! Every stretch is solved for its right-hand side and for a unit at either separator; a small system then
//! gives the separators. Exact but for rounding, and with the same bits at every width of vectors, since
//! there are always eight. Source: Wang, ACM Trans. Math. Softw. 7 (1981) 170.
//!
//! Short systems are eliminated from both ends to the middle.

use crate::loops::{Pass, in_wide_vectors};

/// Stretches.
const LANES: usize = 8;
/// Size from which stretches pay.
const LONG: usize = 96;
/// Smallest pivot, in parts of the entry on the diagonal.
const LEAST_PIVOT: f64 = 1e-13;

type Lane = [f64; LANES];

/// Memory of a solution.
#[derive(Clone, Debug)]
pub(crate) struct Tridiagonal {
    /// 1/pivot of every place, and the entry towards the end where elimination began over that pivot.
    inverse: Vec<f64>,
    lower: Vec<f64>,
    /// Of every place of the stretches: solution, and what units at the left and the right separator give.
    rows: Vec<[Lane; 3]>,
}

impl Tridiagonal {
    pub(crate) fn new(n: usize) -> Self {
        let (short, long) = if n < LONG { (n, 0) } else { (0, (n + 1) / LANES - 1) };
        Self { inverse: vec![0.0; short], lower: vec![0.0; short], rows: vec![[[0.0; LANES]; 3]; long] }
    }

    /// Replaces x by the solution for the matrix with this diagonal; `beside[i]` couples i − 1 and i. The
    /// diagonal is used up. The error is the place of a pivot that is not positive.
    pub(crate) fn solve(&mut self, diagonal: &mut [f64], beside: &[f64], x: &mut [f64]) -> Result<(), usize> {
        if x.len() < LONG {
            self.factor(diagonal, beside)?;
            self.substitute(beside, x);
            return Ok(());
        }
        let rows = &mut self.rows[..];
        match in_wide_vectors(Stretches { rows, diagonal, beside, x }) {
            true => Ok(()),
            false => Err(bad_pivot(diagonal, beside)),
        }
    }

    /// L D Lᵀ from both ends; the middle is eliminated last.
    fn factor(&mut self, diagonal: &[f64], beside: &[f64]) -> Result<(), usize> {
        let n = diagonal.len();
        if n == 0 {
            return Ok(());
        }
        let middle = n / 2;
        let good = |pivot: f64, k: usize| is_good(pivot, diagonal[k]);
        let (mut before, mut after) = (0.0, 0.0);
        for k in 0..middle {
            let coupling = if k == 0 { 0.0 } else { beside[k] };
            let low = coupling * before;
            let pivot = diagonal[k] - low * coupling;
            if !good(pivot, k) {
                return Err(k);
            }
            before = 1.0 / pivot;
            (self.lower[k], self.inverse[k]) = (low, before);
        }
        for k in (middle + 1..n).rev() {
            let coupling = if k + 1 == n { 0.0 } else { beside[k + 1] };
            let high = coupling * after;
            let pivot = diagonal[k] - high * coupling;
            if !good(pivot, k) {
                return Err(k);
            }
            after = 1.0 / pivot;
            (self.lower[k], self.inverse[k]) = (high, after);
        }
        let low = if middle > 0 { beside[middle] } else { 0.0 };
        let high = if middle + 1 < n { beside[middle + 1] } else { 0.0 };
        let pivot = diagonal[middle] - low * low * before - high * high * after;
        if !good(pivot, middle) {
            return Err(middle);
        }
        (self.lower[middle], self.inverse[middle]) = (low * before, 1.0 / pivot);
        Ok(())
    }

    fn substitute(&self, beside: &[f64], x: &mut [f64]) {
        let n = x.len();
        if n == 0 {
            return;
        }
        let middle = n / 2;
        let (mut before, mut after) = (0.0, 0.0);
        for (x, lower) in x[..middle].iter_mut().zip(&self.lower) {
            before = *x - lower * before;
            *x = before;
        }
        for k in (middle + 1..n).rev() {
            after = x[k] - self.lower[k] * after;
            x[k] = after;
        }
        let high = if middle + 1 < n { beside[middle + 1] * self.inverse[middle + 1] } else { 0.0 };
        let value = (x[middle] - self.lower[middle] * before - high * after) * self.inverse[middle];
        x[middle] = value;
        let (mut right, mut left) = (value, value);
        for k in (0..middle).rev() {
            right = (x[k] - beside[k + 1] * right) * self.inverse[k];
            x[k] = right;
        }
        for k in middle + 1..n {
            left = (x[k] - beside[k] * left) * self.inverse[k];
            x[k] = left;
        }
    }

    /// Bytes on the heap.
    pub(crate) fn bytes(&self) -> usize {
        16 * self.inverse.len() + 24 * LANES * self.rows.len()
    }
}

/// Whether a pivot is positive; one that is no number is not.
#[inline(always)]
fn is_good(pivot: f64, entry: f64) -> bool {
    pivot > LEAST_PIVOT * entry
}

/// The first place, from the start, whose pivot is not positive.
fn bad_pivot(diagonal: &[f64], beside: &[f64]) -> usize {
    let mut inverse = 0.0;
    let bad = |(k, entry): (usize, &f64)| {
        let coupling = if k == 0 { 0.0 } else { beside[k] };
        let pivot = entry - coupling * coupling * inverse;
        inverse = 1.0 / pivot;
        !is_good(pivot, *entry)
    };
    diagonal.iter().enumerate().position(bad).unwrap_or(0)
}

/// Eight stretches. Returns whether all pivots were positive; else the diagonal is as it was, but for the
/// last places, whose neighbours were eliminated.
struct Stretches<'a> {
    rows: &'a mut [[Lane; 3]],
    diagonal: &'a mut [f64],
    beside: &'a [f64],
    x: &'a mut [f64],
}

impl Pass for Stretches<'_> {
    type Output = bool;

    #[inline(always)]
    fn run(self) -> bool {
        let Self { rows, diagonal, beside, x } = self;
        let (n, length) = (x.len(), rows.len());
        let stride = length + 1;
        // Places behind the last stretch are eliminated one by one, from the end.
        let whole = stride * LANES - 1;
        let mut good = true;
        let mut kept = diagonal[n - 1];
        for k in (whole..n).rev() {
            let factor = beside[k] / diagonal[k];
            good &= is_good(diagonal[k], kept);
            kept = diagonal[k - 1];
            diagonal[k - 1] -= factor * beside[k];
            x[k - 1] -= factor * x[k];
        }
        good &= is_good(diagonal[whole - 1], kept);
        let (good_stretches, first, ends) = eliminate(rows, diagonal, beside, x, stride);
        let separators = separators(diagonal, beside, x, stride, &first, &ends);
        if !(good && good_stretches && separators.is_some()) {
            return false;
        }
        let Some(separators) = separators else { return false };
        let mut left = [0.0; LANES];
        left[1..].copy_from_slice(&separators[..LANES - 1]);
        let right = separators;
        for (i, [z, s, r]) in rows.iter().enumerate() {
            for k in 0..LANES {
                x[k * stride + i] = z[k] - s[k] * left[k] - r[k] * right[k];
            }
        }
        for k in 0..LANES - 1 {
            x[k * stride + length] = separators[k];
        }
        for k in whole..n {
            x[k] = (x[k] - beside[k] * x[k - 1]) / diagonal[k];
        }
        true
    }
}

/// Solves every stretch for its right-hand side and for both separators. Returns whether the pivots are
/// positive, and the three solutions at its first and at its last place.
#[inline(always)]
fn eliminate(
    rows: &mut [[Lane; 3]],
    diagonal: &[f64],
    beside: &[f64],
    x: &[f64],
    stride: usize,
) -> (bool, [Lane; 3], [Lane; 3]) {
    let length = rows.len();
    let at = |of: &[f64], i: usize| -> Lane { core::array::from_fn(|k| of[k * stride + i]) };
    let mut least = [f64::INFINITY; LANES];
    let (mut inverse, mut z, mut s) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    // What couples with the place before: for the first ones the separator.
    let mut coupling = [0.0; LANES];
    let before: Lane = core::array::from_fn(|k| if k == 0 { 0.0 } else { beside[k * stride] });
    for (i, row) in rows.iter_mut().enumerate() {
        let (d, b) = (at(diagonal, i), at(x, i));
        let mut lower = [0.0; LANES];
        for k in 0..LANES {
            lower[k] = coupling[k] * inverse[k];
            let pivot = d[k] - lower[k] * coupling[k];
            least[k] = least[k].min(pivot - LEAST_PIVOT * d[k]);
            inverse[k] = 1.0 / pivot;
            z[k] = b[k] - lower[k] * z[k];
            s[k] = if i == 0 { before[k] } else { -lower[k] * s[k] };
        }
        *row = [z, s, inverse];
        if i + 1 < length {
            coupling = at(beside, i + 1);
        }
    }
    let after: Lane =
        core::array::from_fn(|k| if k + 1 == LANES { 0.0 } else { beside[k * stride + length] });
    let mut r = [0.0; LANES];
    let mut ends = [[0.0; LANES]; 3];
    for (i, row) in rows.iter_mut().enumerate().rev() {
        let [y, t, inverse] = *row;
        for k in 0..LANES {
            if i + 1 == length {
                (z[k], s[k], r[k]) = (inverse[k] * y[k], inverse[k] * t[k], inverse[k] * after[k]);
            } else {
                z[k] = inverse[k] * (y[k] - coupling[k] * z[k]);
                s[k] = inverse[k] * (t[k] - coupling[k] * s[k]);
                r[k] *= -inverse[k] * coupling[k];
            }
        }
        *row = [z, s, r];
        if i + 1 == length {
            ends = *row;
        }
        coupling = at(beside, i);
    }
    // What is no number spreads to the first place.
    let numbers = z.iter().chain(&s).chain(&r).all(|value| value.is_finite());
    (numbers && least.iter().all(|least| *least > 0.0), [z, s, r], ends)
}

/// The separators, behind every stretch but the last; `None` where a pivot is not positive.
#[inline(always)]
fn separators(
    diagonal: &[f64],
    beside: &[f64],
    x: &[f64],
    stride: usize,
    first: &[Lane; 3],
    ends: &[Lane; 3],
) -> Option<Lane> {
    let count = LANES - 1;
    let (mut pivots, mut couplings, mut values) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    for j in 0..count {
        let row = (j + 1) * stride - 1;
        let (before, after) = (beside[row], beside[row + 1]);
        pivots[j] = diagonal[row] - before * ends[2][j] - after * first[1][j + 1];
        values[j] = x[row] - before * ends[0][j] - after * first[0][j + 1];
        // With the separator that follows.
        couplings[j] = -after * first[2][j + 1];
    }
    for j in 0..count {
        if j > 0 {
            let lower = couplings[j - 1] / pivots[j - 1];
            pivots[j] -= lower * couplings[j - 1];
            values[j] -= lower * values[j - 1];
        }
        if !is_good(pivots[j], diagonal[(j + 1) * stride - 1]) {
            return None;
        }
    }
    for j in (0..count).rev() {
        let after = if j + 1 < count { couplings[j] * values[j + 1] } else { 0.0 };
        values[j] = (values[j] - after) / pivots[j];
    }
    values[count] = 0.0;
    Some(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn systems_of_every_size_are_solved() {
        for n in (1..40).chain(90..130).chain([1000, 1001, 1006, 1007, 1008]) {
            let diagonal: Vec<f64> = (0..n).map(|i| 3.0 + (i as f64).cos()).collect();
            let beside: Vec<f64> = (0..n).map(|i| (0.7 * i as f64).sin()).collect();
            let exact: Vec<f64> = (0..n).map(|i| (1.3 * i as f64).cos()).collect();
            let mut x: Vec<f64> = (0..n)
                .map(|i| {
                    let before = if i > 0 { beside[i] * exact[i - 1] } else { 0.0 };
                    let after = if i + 1 < n { beside[i + 1] * exact[i + 1] } else { 0.0 };
                    diagonal[i] * exact[i] + before + after
                })
                .collect();
            let solved = Tridiagonal::new(n).solve(&mut diagonal.clone(), &beside, &mut x);
            assert_eq!(solved, Ok(()), "{n}");
            assert!(x.iter().zip(&exact).all(|(x, exact)| (x - exact).abs() < 1e-12), "{n}");
        }
    }

    /// Two equal rows, and one that is no number.
    #[test]
    fn dependent_rows_are_found() {
        for n in [3, 200] {
            for bad in [1.0, f64::NAN] {
                for k in [1, n / 2, n - 1] {
                    let (mut diagonal, mut beside) = (vec![1.0; n], vec![0.0; n]);
                    (diagonal[k], beside[k]) = (bad, 1.0);
                    let solved = Tridiagonal::new(n).solve(&mut diagonal, &beside, &mut vec![1.0; n]);
                    let found = solved.expect_err("dependent");
                    assert!(found == k || found == k - 1, "{n} {k} {found}");
                }
            }
        }
    }
}

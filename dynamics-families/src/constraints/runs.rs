//! Sparse products as runs: stretches of entries whose indices all go on by one, or stay.
//!
//! Entries of numbered constraints lie round after round, so nearly all of a model's entries belong to a few
//! runs. A run is a loop over slices, which vectorises; nothing is looked up entry by entry.

use std::collections::HashMap;

use crate::generated::{BLOCK, Sum, block_sum};
use crate::loops::{Pass, in_wide_vectors};

/// A stretch of entries: N indices, and whether each of them goes on by one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct EntryRun<const N: usize> {
    pub(super) start: [usize; N],
    pub(super) steps: [bool; N],
    pub(super) length: usize,
}

impl<const N: usize> EntryRun<N> {
    fn one(start: [usize; N]) -> Self {
        Self { start, steps: [true; N], length: 1 }
    }

    /// Whether it goes on with these indices.
    fn takes(&mut self, next: [usize; N]) -> bool {
        let mut steps = self.steps;
        for k in 0..N {
            let here = self.start[k] + if self.steps[k] { self.length - 1 } else { 0 };
            steps[k] = match next[k].checked_sub(here) {
                Some(0) => false,
                Some(1) => true,
                _ => return false,
            };
        }
        if self.length > 1 && steps != self.steps {
            return false;
        }
        self.steps = steps;
        self.length += 1;
        true
    }

    /// The indices of its entry `at`.
    pub(super) fn index(&self, which: usize, at: usize) -> usize {
        self.start[which] + if self.steps[which] { at } else { 0 }
    }
}

/// EntryRuns of entries that come in order, each to be found by one of its indices: the next of it.
pub(super) struct EntryRuns<const N: usize> {
    pub(super) all: Vec<EntryRun<N>>,
    /// EntryRuns by what follows their last entry.
    open: HashMap<[usize; 2], usize>,
}

impl<const N: usize> EntryRuns<N> {
    pub(super) fn new() -> Self {
        Self { all: Vec::new(), open: HashMap::new() }
    }

    /// Adds an entry. `key` are two indices that go on by one within a run.
    pub(super) fn add(&mut self, key: [usize; 2], entry: [usize; N]) {
        let next = key.map(|index| index + 1);
        if let Some(run) = self.open.remove(&key)
            && self.all[run].takes(entry)
        {
            self.open.insert(next, run);
            return;
        }
        self.all.push(EntryRun::one(entry));
        self.open.insert(next, self.all.len() - 1);
    }
}

/// Entries of Φ_q and A as runs of (row, coordinate, entry).
#[derive(Clone, Debug)]
pub(super) struct Jacobian {
    runs: Vec<EntryRun<3>>,
}

impl Jacobian {
    /// From pairs of a row and a coordinate, in the order of the entries.
    pub(super) fn new(pairs: &[(u32, u32)]) -> Self {
        let mut runs: Vec<EntryRun<3>> = Vec::new();
        for (entry, &(row, unknown)) in pairs.iter().enumerate() {
            let entry = [row as usize, unknown as usize, entry];
            if !runs.last_mut().is_some_and(|run| run.takes(entry)) {
                runs.push(EntryRun::one(entry));
            }
        }
        Self { runs }
    }

    /// y += factor · J x.
    pub(super) fn multiply_add(&self, values: &[f64], x: &[f64], factor: f64, y: &mut [f64]) {
        in_wide_vectors(Product { jacobian: self, values, x, factor, y });
    }

    /// y += w Jᵀ x, with a weight of every coordinate; all weights are 1 where there are none.
    pub(super) fn multiply_transposed_add(
        &self,
        values: &[f64],
        x: &[f64],
        weights: Option<&[f64]>,
        y: &mut [f64],
    ) {
        in_wide_vectors(Transposed { jacobian: self, values, x, weights, y });
    }
}

/// y += factor · J x.
struct Product<'a> {
    jacobian: &'a Jacobian,
    values: &'a [f64],
    x: &'a [f64],
    factor: f64,
    y: &'a mut [f64],
}

impl Pass for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { jacobian, values, x, factor, y } = self;
        for run in &jacobian.runs {
            let entries = &values[run.start[2]..][..run.length];
            match run.steps {
                [true, true, _] => {
                    let (y, x) = (&mut y[run.start[0]..][..run.length], &x[run.start[1]..][..run.length]);
                    for ((y, x), entry) in y.iter_mut().zip(x).zip(entries) {
                        *y += factor * (entry * x);
                    }
                }
                [false, true, _] => {
                    let mut sum = Sum::default();
                    let mut products = [0.0; BLOCK];
                    for from in (0..run.length).step_by(BLOCK) {
                        let to = run.length.min(from + BLOCK);
                        let x = &x[run.start[1] + from..run.start[1] + to];
                        for ((product, entry), x) in products.iter_mut().zip(&entries[from..to]).zip(x) {
                            *product = entry * x;
                        }
                        sum.add(block_sum(&products[..to - from]));
                    }
                    y[run.start[0]] += factor * sum.total();
                }
                _ => {
                    for (k, entry) in entries.iter().enumerate() {
                        y[run.index(0, k)] += factor * (entry * x[run.index(1, k)]);
                    }
                }
            }
        }
    }
}

/// y += w Jᵀ x.
struct Transposed<'a> {
    jacobian: &'a Jacobian,
    values: &'a [f64],
    x: &'a [f64],
    weights: Option<&'a [f64]>,
    y: &'a mut [f64],
}

impl Pass for Transposed<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { jacobian, values, x, weights, y } = self;
        for run in &jacobian.runs {
            let entries = &values[run.start[2]..][..run.length];
            match (run.steps, weights) {
                ([true, true, _], Some(weights)) => {
                    let (y, x) = (&mut y[run.start[1]..][..run.length], &x[run.start[0]..][..run.length]);
                    let weights = &weights[run.start[1]..][..run.length];
                    for (((y, x), entry), weight) in y.iter_mut().zip(x).zip(entries).zip(weights) {
                        *y += weight * (entry * x);
                    }
                }
                _ => {
                    for (k, entry) in entries.iter().enumerate() {
                        let unknown = run.index(1, k);
                        let weight = weights.map_or(1.0, |weights| weights[unknown]);
                        y[unknown] += weight * (entry * x[run.index(0, k)]);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two diagonals, a sum over all coordinates, and one that all rows share.
    #[test]
    fn products_are_those_of_the_entries() {
        let n = 700u32;
        let mut pairs: Vec<(u32, u32)> = (0..n).map(|i| (i, i)).collect();
        pairs.extend((1..n).map(|i| (i, i - 1)));
        pairs.extend((0..n).map(|i| (n, i)));
        pairs.extend((0..n).map(|i| (i, n)));
        let jacobian = Jacobian::new(&pairs);
        assert_eq!(jacobian.runs.len(), 4);
        let wave =
            |length: usize, by: f64| -> Vec<f64> { (0..length).map(|i| (i as f64 * by).sin()).collect() };
        let values = wave(pairs.len(), 0.3);
        let (x, z) = (wave(n as usize + 1, 0.7), wave(n as usize + 1, 1.1));
        let (mut y, mut transposed) = (z.clone(), z.clone());
        jacobian.multiply_add(&values, &x, -2.0, &mut y);
        jacobian.multiply_transposed_add(&values, &x, Some(&z), &mut transposed);
        let (mut slow, mut slow_transposed) = (z.clone(), z.clone());
        for (&(row, unknown), value) in pairs.iter().zip(&values) {
            slow[row as usize] -= 2.0 * value * x[unknown as usize];
            slow_transposed[unknown as usize] += z[unknown as usize] * value * x[row as usize];
        }
        let near = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
        assert!(near(&y, &slow) && near(&transposed, &slow_transposed));
    }
}

//! The system of the multipliers where M is diagonal: S = J M⁻¹ Jᵀ, with one row for every constraint.
//!
//! Rows that share a coordinate are coupled. Chains couple neighbours only, and their S is tridiagonal; other
//! constraints by index give a band, perhaps with a border.

use std::sync::Arc;

use super::runs::{EntryRun, EntryRuns};
use crate::generated::{BLOCK, Sum, block_sum};
use crate::linalg::bordered::{Bordered, Factors, Kind};
use crate::linalg::order::Layout;
use crate::linalg::tridiagonal::Tridiagonal;
use crate::loops::{Pass, in_wide_vectors};
use crate::model::Sizes;

/// Rows that one coordinate may stand in; where more do, S has no few entries per row.
const MOST_ROWS_OF_ONE: usize = 64;

/// S and its factors.
#[derive(Debug)]
pub(super) struct Schur {
    /// Products of two entries over a mass: (entry of S, first entry, second entry, coordinate).
    products: Vec<EntryRun<4>>,
    /// Entries of S.
    values: Vec<f64>,
    form: Form,
}

#[derive(Debug)]
enum Form {
    /// `values` are the diagonal, then the couplings with the row before. The diagonal is copied for every
    /// solution.
    Tridiagonal(Tridiagonal, Vec<f64>),
    /// Rows and columns of `values`, the lower half.
    /// They are scaled to a diagonal of 1.
    Bordered { pairs: Vec<(u32, u32)>, scale: Vec<f64>, parts: Box<(Bordered, Factors)>, memory: Vec<f64> },
}

impl Schur {
    /// For entries at these pairs of a row and a coordinate; `None` where S is no banded matrix with a
    /// border.
    pub(super) fn new(pairs: &[(u32, u32)], unknowns: usize, row_ends: &[usize]) -> Option<Self> {
        let rows = row_ends.last().copied().unwrap_or(0);
        // Entries by their coordinate.
        let mut by_unknown: Vec<(u32, u32, u32)> =
            pairs.iter().enumerate().map(|(entry, &(row, unknown))| (unknown, row, entry as u32)).collect();
        by_unknown.sort_unstable();
        debug_assert!(by_unknown.iter().all(|entry| (entry.0 as usize) < unknowns));
        let groups = || by_unknown.chunk_by(|a, b| a.0 == b.0);
        if groups().any(|group| group.len() > MOST_ROWS_OF_ONE) {
            return None;
        }
        let coupled = |visit: &mut dyn FnMut(usize, usize, [usize; 3])| {
            for group in groups() {
                for &(unknown, row, first) in group {
                    for &(_, column, second) in group {
                        if column <= row {
                            visit(
                                row as usize,
                                column as usize,
                                [first as usize, second as usize, unknown as usize],
                            );
                        }
                    }
                }
            }
        };
        let mut is_tridiagonal = true;
        coupled(&mut |row, column, _| is_tridiagonal &= row - column <= 1);
        let mut runs = EntryRuns::new();
        if is_tridiagonal {
            coupled(&mut |row, column, [first, second, unknown]| {
                let entry = if row == column { row } else { rows + row };
                runs.add([first, second], [entry, first, second, unknown]);
            });
            let form = Form::Tridiagonal(Tridiagonal::new(rows), vec![0.0; rows]);
            return Some(Self { products: runs.all, values: vec![0.0; 2 * rows], form });
        }
        let layout =
            Layout::new(&Sizes::from(row_ends.to_vec()), &mut |visit| coupled(&mut |i, j, _| visit(i, j)))
                .ok()?;
        let layout = Arc::new(layout);
        let mut entries: Vec<(u32, u32)> = Vec::new();
        coupled(&mut |row, column, _| entries.push((row as u32, column as u32)));
        // By diagonals, so that runs go on along them.
        entries.sort_unstable_by_key(|&(row, column)| (row - column, row));
        entries.dedup();
        coupled(&mut |row, column, [first, second, unknown]| {
            let key = (row as u32 - column as u32, row as u32);
            let found = entries.binary_search_by_key(&key, |&(row, column)| (row - column, row));
            if let Ok(entry) = found {
                runs.add([first, second], [entry, first, second, unknown]);
            }
        });
        let parts = Box::new((Bordered::new(&layout), Factors::new(&layout, Kind::Regular)));
        let values = vec![0.0; entries.len()];
        let (scale, memory) = (vec![1.0; rows], vec![0.0; rows]);
        let form = Form::Bordered { pairs: entries, scale, parts, memory };
        Some(Self { products: runs.all, values, form })
    }

    /// Assembles S for these entries of J and inverse masses, and factors it where that is kept. The error is
    /// a row that depends on others, or restricts nothing.
    pub(super) fn factor(&mut self, jacobian: &[f64], inverse: &[f64]) -> Result<(), usize> {
        let Self { products, values, form } = self;
        in_wide_vectors(Assembly { products, jacobian, inverse, values });
        match form {
            Form::Tridiagonal(..) => Ok(()),
            Form::Bordered { pairs, scale, parts, .. } => {
                let (matrix, factors) = &mut **parts;
                matrix.clear();
                // The diagonal comes first.
                for (&(row, column), value) in pairs.iter().zip(&*values) {
                    let (row, column) = (row as usize, column as usize);
                    if row == column {
                        if !(*value > 0.0 && value.is_finite()) {
                            return Err(row);
                        }
                        scale[row] = 1.0 / value.sqrt();
                    }
                    let scaled = value * scale[row] * scale[column];
                    matrix.add(row, column, scaled);
                    if row != column {
                        matrix.add(column, row, scaled);
                    }
                }
                factors.factor(matrix, Kind::Regular)
            }
        }
    }

    /// Replaces x by S⁻¹ x. The error is that of [`Self::factor`].
    pub(super) fn solve(&mut self, x: &mut [f64]) -> Result<(), usize> {
        match &mut self.form {
            Form::Tridiagonal(memory, diagonal) => {
                let (kept, beside) = self.values.split_at(self.values.len() / 2);
                diagonal.copy_from_slice(kept);
                return memory.solve(diagonal, beside, x);
            }
            Form::Bordered { scale, parts, memory, .. } => {
                x.iter_mut().zip(&*scale).for_each(|(x, scale)| *x *= scale);
                parts.1.solve(x, memory);
                x.iter_mut().zip(&*scale).for_each(|(x, scale)| *x *= scale);
            }
        }
        Ok(())
    }

    /// Its structure in words.
    pub(super) fn describe(&self) -> String {
        match &self.form {
            Form::Tridiagonal(..) => String::from("tridiagonal"),
            Form::Bordered { parts, .. } => parts.0.layout.describe(),
        }
    }

    /// Bytes on the heap.
    pub(super) fn bytes(&self) -> usize {
        let form = match &self.form {
            Form::Tridiagonal(memory, diagonal) => memory.bytes() + 8 * diagonal.len(),
            Form::Bordered { pairs, parts, memory, .. } => {
                8 * pairs.len() + parts.0.bytes() + parts.1.bytes() + 16 * memory.len()
            }
        };
        8 * self.values.len() + form
    }
}

/// Sums all products.
struct Assembly<'a> {
    products: &'a [EntryRun<4>],
    jacobian: &'a [f64],
    inverse: &'a [f64],
    values: &'a mut [f64],
}

impl Pass for Assembly<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.values.fill(0.0);
        for run in self.products {
            add_products(run, self.jacobian, self.inverse, self.values);
        }
    }
}

/// Adds the products of a run to entries of S.
#[inline(always)]
fn add_products(run: &EntryRun<4>, jacobian: &[f64], inverse: &[f64], values: &mut [f64]) {
    let [to, first, second, unknown] = run.start;
    match run.steps {
        [true, true, true, true] => {
            let (to, first) = (&mut values[to..][..run.length], &jacobian[first..][..run.length]);
            let (second, inverse) = (&jacobian[second..][..run.length], &inverse[unknown..][..run.length]);
            for (((to, first), second), inverse) in to.iter_mut().zip(first).zip(second).zip(inverse) {
                *to += first * inverse * second;
            }
        }
        [false, ..] => {
            let mut sum = Sum::default();
            let mut products = [0.0; BLOCK];
            for from in (0..run.length).step_by(BLOCK) {
                let count = BLOCK.min(run.length - from);
                for (k, product) in products[..count].iter_mut().enumerate() {
                    let at = from + k;
                    *product =
                        jacobian[run.index(1, at)] * inverse[run.index(3, at)] * jacobian[run.index(2, at)];
                }
                sum.add(block_sum(&products[..count]));
            }
            values[to] += sum.total();
        }
        _ => {
            for k in 0..run.length {
                values[run.index(0, k)] +=
                    jacobian[run.index(1, k)] * inverse[run.index(3, k)] * jacobian[run.index(2, k)];
            }
        }
    }
}

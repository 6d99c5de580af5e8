//! A banded matrix with a border, and its factors by Schur's complement:
//!
//! ```text
//! [A B] [x]   [f]      S = D − C A⁻¹ B,   y = S⁻¹ (g − C A⁻¹ f),   x = A⁻¹ f − A⁻¹ B y
//! [C D] [y] = [g]
//! ```

use std::sync::Arc;

use crate::linalg::banded::{Banded, LEAST_SCALED_PIVOT, Ldl, Lu, Pivots};
use crate::linalg::dense::{DenseLu, symmetric_eigen};
use crate::linalg::order::Layout;

/// Difference of both halves of a symmetric matrix, in parts of the entry: what sums in another order leave.
const SYMMETRY_ROUNDING: f64 = 1e-9;

/// The matrix. Unknowns are those of the model; places are those of the layout.
#[derive(Clone, Debug)]
pub(crate) struct Bordered {
    pub(crate) layout: Arc<Layout>,
    core: Banded,
    /// B, column by column.
    right: Vec<f64>,
    /// C, row by row.
    below: Vec<f64>,
    /// D, row by row.
    corner: Vec<f64>,
}

impl Bordered {
    pub(crate) fn new(layout: &Arc<Layout>) -> Self {
        let (n, m) = (layout.core, layout.border());
        Self {
            layout: Arc::clone(layout),
            core: Banded::new(n, layout.half),
            right: vec![0.0; n * m],
            below: vec![0.0; n * m],
            corner: vec![0.0; m * m],
        }
    }

    pub(crate) fn clear(&mut self) {
        self.core.clear();
        [&mut self.right, &mut self.below, &mut self.corner].into_iter().for_each(|x| x.fill(0.0));
    }

    /// Adds to the entry of two unknowns; false where the layout has no place for it.
    #[inline]
    pub(crate) fn add(&mut self, row: usize, column: usize, value: f64) -> bool {
        let (row, column) = (self.layout.place[row], self.layout.place[column]);
        let (n, m) = (self.core.n, self.layout.border());
        match (row < n, column < n) {
            (true, true) => return self.core.add(row, column, value),
            (true, false) => self.right[(column - n) * n + row] += value,
            (false, true) => self.below[(row - n) * n + column] += value,
            (false, false) => self.corner[(row - n) * m + column - n] += value,
        }
        true
    }

    /// Becomes a multiple of a diagonal matrix, whose entries are in the order of the model: in one pass.
    pub(crate) fn set_diagonal(&mut self, entries: &[f64], factor: f64) {
        let (core, border) = self.layout.unknown.split_at(self.core.n);
        self.core.set_diagonal(core.iter().map(|&unknown| factor * entries[unknown]));
        [&mut self.right, &mut self.below, &mut self.corner].into_iter().for_each(|x| x.fill(0.0));
        for (k, &unknown) in border.iter().enumerate() {
            self.corner[k * border.len() + k] = factor * entries[unknown];
        }
    }

    /// Adds multiples along a diagonal: value k to row + k and column + k.
    pub(crate) fn add_run(&mut self, row: usize, column: usize, values: &[f64], factor: f64) -> bool {
        let [rows, columns] = [row, column].map(|first| self.layout.stride(first, values.len()));
        if let (Some(stride), true) = (rows, rows == columns) {
            let places = [row, column].map(|unknown| self.layout.place[unknown]);
            return self.core.add_run(places, stride, values, factor);
        }
        let mut fits = true;
        for (k, value) in values.iter().enumerate() {
            fits &= self.add(row + k, column + k, factor * value);
        }
        fits
    }

    /// Adds a multiple of a matrix of the same layout.
    pub(crate) fn add_multiple(&mut self, factor: f64, other: &Self) {
        self.core.add_multiple(factor, &other.core);
        for (mine, theirs) in [
            (&mut self.right, &other.right),
            (&mut self.below, &other.below),
            (&mut self.corner, &other.corner),
        ] {
            mine.iter_mut().zip(theirs).for_each(|(mine, theirs)| *mine += factor * theirs);
        }
    }

    /// y = A x, both in the order of places.
    pub(crate) fn multiply(&self, x: &[f64], y: &mut [f64]) {
        let (n, m) = (self.core.n, self.layout.border());
        y.fill(0.0);
        self.core.multiply_add(&x[..n], &mut y[..n]);
        for k in 0..m {
            let border = x[n + k];
            y[..n].iter_mut().zip(&self.right[k * n..(k + 1) * n]).for_each(|(y, a)| *y += a * border);
            let row: f64 = self.below[k * n..(k + 1) * n].iter().zip(x).map(|(a, x)| a * x).sum();
            let corner: f64 = self.corner[k * m..(k + 1) * m].iter().zip(&x[n..]).map(|(a, x)| a * x).sum();
            y[n + k] = row + corner;
        }
    }

    pub(crate) fn is_symmetric(&self) -> bool {
        let (rounding, m) = (SYMMETRY_ROUNDING, self.layout.border());
        let alike = |a: f64, b: f64| (a - b).abs() <= rounding * (a.abs() + b.abs());
        self.core.is_symmetric(rounding)
            && self.right.iter().zip(&self.below).all(|(&a, &b)| alike(a, b))
            && (0..m).all(|i| (0..i).all(|j| alike(self.corner[i * m + j], self.corner[j * m + i])))
    }

    /// Calls `visit` with the place of each row, its entry on the diagonal, and (place, entry) of the others.
    pub(crate) fn for_each_row(
        &self,
        mut visit: impl FnMut(usize, f64, &mut dyn Iterator<Item = (usize, f64)>),
    ) {
        let (n, m) = (self.core.n, self.layout.border());
        for i in 0..n {
            let (first, row) = self.core.row(i);
            let border = (0..m).map(|k| (n + k, self.right[k * n + i]));
            let band = row.iter().enumerate().map(|(k, &a)| (first + k, a));
            visit(i, row[i - first], &mut band.filter(|&(j, _)| j != i).chain(border));
        }
        for k in 0..m {
            let band = self.below[k * n..(k + 1) * n].iter().copied().enumerate();
            let corner = (0..m).filter(|&l| l != k).map(|l| (n + l, self.corner[k * m + l]));
            visit(n + k, self.corner[k * m + k], &mut band.chain(corner));
        }
    }

    /// Bytes on the heap.
    pub(crate) fn bytes(&self) -> usize {
        let core = self.core.n * (2 * self.core.half + 1);
        8 * (core + self.right.len() + self.below.len() + self.corner.len())
    }
}

#[derive(Clone, Debug)]
enum Core {
    Ldl(Ldl),
    Lu(Lu),
}

/// How a matrix is factored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Symmetric and positive definite, or an error.
    Positive,
    /// Symmetric, of any inertia.
    Symmetric,
    /// Symmetric, of any inertia but without small pivots, or an error. Rows are to be scaled to 1.
    Regular,
    /// Of any kind.
    General,
}

/// Factors of a [`Bordered`] matrix; reused for others of the same layout.
#[derive(Clone, Debug)]
pub(crate) struct Factors {
    layout: Arc<Layout>,
    core: Core,
    /// A⁻¹ B.
    solved: Vec<f64>,
    below: Vec<f64>,
    schur: DenseLu,
    /// Eigenvalues below zero, of symmetric matrices.
    pub(crate) negative: usize,
    /// Whether an eigenvalue is zero to rounding, of symmetric matrices.
    pub(crate) singular: bool,
}

impl Factors {
    pub(crate) fn new(layout: &Arc<Layout>, kind: Kind) -> Self {
        let (n, m) = (layout.core, layout.border());
        let core = match kind {
            Kind::General => Core::Lu(Lu::new(n, layout.half)),
            _ => Core::Ldl(Ldl::new(n, layout.half)),
        };
        Self {
            layout: Arc::clone(layout),
            core,
            solved: vec![0.0; n * m],
            below: vec![0.0; n * m],
            schur: DenseLu::new(m),
            negative: 0,
            singular: false,
        }
    }

    /// Factors a matrix. The error is the unknown at which that fails.
    pub(crate) fn factor(&mut self, matrix: &Bordered, kind: Kind) -> Result<(), usize> {
        let (n, m) = (self.layout.core, self.layout.border());
        let unknown = |place: usize| self.layout.unknown[place];
        match &mut self.core {
            Core::Lu(lu) => lu.factor(&matrix.core).map_err(unknown)?,
            Core::Ldl(ldl) => {
                let pivots = match kind {
                    Kind::Positive => Pivots::Positive,
                    Kind::Regular => Pivots::Regular,
                    Kind::Symmetric | Kind::General => Pivots::AnySign,
                };
                ldl.factor(&matrix.core, pivots).map_err(unknown)?;
                (self.negative, self.singular) = (ldl.negative, ldl.singular);
            }
        }
        if m == 0 {
            return Ok(());
        }
        self.solved.copy_from_slice(&matrix.right);
        self.below.copy_from_slice(&matrix.below);
        for k in 0..m {
            self.core.solve(&mut self.solved[k * n..(k + 1) * n]);
        }
        for k in 0..m {
            for l in 0..m {
                let row = &self.below[k * n..(k + 1) * n];
                let column = &self.solved[l * n..(l + 1) * n];
                let product = crate::generated::sum(0..n, |i| row[i] * column[i]);
                self.schur.rows[k * m + l] = matrix.corner[k * m + l] - product;
            }
        }
        if matches!(self.core, Core::Ldl(_)) {
            // The inertia of the whole is that of A and of S together (Haynsworth 1968).
            let (values, _) = symmetric_eigen(&mut self.schur.rows.clone(), m);
            let largest = values.iter().fold(0.0f64, |most, value| most.max(value.abs()));
            // What is scaled to 1 is small by itself, even where nothing else is in the border.
            let least = if kind == Kind::Regular { LEAST_SCALED_PIVOT } else { f64::EPSILON * largest };
            if kind == Kind::Positive && !values.iter().all(|&value| value > least) {
                return Err(unknown(n));
            }
            self.negative += values.iter().filter(|&&value| value < 0.0).count();
            self.singular |= values.iter().any(|value| value.abs() <= least);
            if kind == Kind::Regular && self.singular {
                return Err(unknown(n));
            }
        }
        self.schur.factor().map_err(|k| self.layout.unknown[n + k])
    }

    /// Replaces x, in the order of the model, by the solution. `memory` has the same length.
    pub(crate) fn solve(&self, x: &mut [f64], memory: &mut [f64]) {
        if self.layout.in_order {
            return self.solve_ordered(x);
        }
        memory.iter_mut().zip(&self.layout.unknown).for_each(|(place, &unknown)| *place = x[unknown]);
        self.solve_ordered(memory);
        memory.iter().zip(&self.layout.unknown).for_each(|(value, &unknown)| x[unknown] = *value);
    }

    /// The same in the order of places.
    pub(crate) fn solve_ordered(&self, x: &mut [f64]) {
        let n = self.layout.core;
        let (core, border) = x.split_at_mut(n);
        self.core.solve(core);
        // Without a border there are no rows, and chunks of length 0 do not exist.
        for (value, row) in border.iter_mut().zip(self.below.chunks_exact(n.max(1))) {
            *value -= crate::generated::sum(0..n, |i| row[i] * core[i]);
        }
        self.schur.solve(border);
        for (value, column) in border.iter().zip(self.solved.chunks_exact(n.max(1))) {
            core.iter_mut().zip(column).for_each(|(x, a)| *x -= a * value);
        }
    }

    /// Bytes on the heap.
    pub(crate) fn bytes(&self) -> usize {
        let core = match &self.core {
            Core::Ldl(_) => self.layout.core * (self.layout.half + 1),
            Core::Lu(_) => self.layout.core * (4 * self.layout.half + 2),
        };
        8 * (core + self.solved.len() + self.below.len())
    }
}

impl Core {
    fn solve(&self, x: &mut [f64]) {
        match self {
            Self::Ldl(ldl) => ldl.solve(x),
            Self::Lu(lu) => lu.solve(x),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chain whose first unknown couples to all: factors of every kind solve it.
    #[test]
    fn borders_are_solved_and_counted() {
        let n = 400;
        let mut entries = Vec::new();
        for i in 0..n {
            entries.push((i, i, if i == 0 { -3.0 } else { 2.5 }));
            if i > 1 {
                entries.extend([(i, i - 1, -1.0), (i - 1, i, -1.0)]);
            }
            if i > 0 {
                entries.extend([(0, i, 0.1), (i, 0, 0.1)]);
            }
        }
        let ends = vec![1, n];
        let layout = Layout::new(&ends.into(), &mut |visit| {
            entries.iter().for_each(|&(i, j, _)| visit(i, j));
        })
        .expect("banded");
        assert_eq!((layout.border(), layout.half), (1, 1));
        let layout = Arc::new(layout);
        let mut matrix = Bordered::new(&layout);
        entries.iter().for_each(|&(i, j, value)| assert!(matrix.add(i, j, value)));
        assert!(matrix.is_symmetric());
        let x: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
        let mut f = vec![0.0; n];
        entries.iter().for_each(|&(i, j, value)| f[i] += value * x[j]);
        for kind in [Kind::Symmetric, Kind::General] {
            let mut factors = Factors::new(&layout, kind);
            factors.factor(&matrix, kind).expect("regular");
            let mut y = f.clone();
            factors.solve(&mut y, &mut vec![0.0; n]);
            assert!(y.iter().zip(&x).all(|(y, x)| (y - x).abs() < 1e-12));
            if kind == Kind::Symmetric {
                assert_eq!((factors.negative, factors.singular), (1, false));
            }
        }
        let mut factors = Factors::new(&layout, Kind::Positive);
        assert_eq!(factors.factor(&matrix, Kind::Positive), Err(0));
    }
}

//! The system of accelerations and multipliers where M is not diagonal, or one coordinate stands in many
//! rows:
//!
//! ```text
//! [M  Jᵀ] [x ]   [0]
//! [J  0 ] [−μ] = [r]
//! ```
//!
//! Every row follows the coordinates that it couples, so that L D Lᵀ exists without pivoting where rows are
//! independent. Coordinates are scaled to masses of 1, rows to a length of 1.

use std::sync::Arc;

use crate::linalg::bordered::{Bordered, Factors, Kind};
use crate::linalg::order::{Layout, NotBanded};
use crate::model::Sizes;

/// The matrix and its factors; n coordinates, then R rows.
#[derive(Debug)]
pub(super) struct Saddle {
    n: usize,
    /// Entries of M, the unscaled ones.
    mass: Vec<(u32, u32, f64)>,
    /// Pairs of a row and a coordinate, in the order of the entries.
    pairs: Vec<(u32, u32)>,
    /// 1/√mᵢᵢ.
    scale: Vec<f64>,
    /// 1 over the length of a row.
    row_scale: Vec<f64>,
    matrix: Bordered,
    factors: Factors,
    x: Vec<f64>,
    memory: Vec<f64>,
}

impl Saddle {
    pub(super) fn new(
        mass: Vec<(u32, u32, f64)>,
        pairs: Vec<(u32, u32)>,
        ends: &Sizes,
        row_ends: &[usize],
    ) -> Result<Self, NotBanded> {
        let n = ends.last().copied().unwrap_or(0);
        let rows = row_ends.last().copied().unwrap_or(0);
        let layout = Layout::with_rows(
            ends,
            row_ends,
            &mut |visit| mass.iter().for_each(|&(i, j, _)| visit(i as usize, j as usize)),
            &pairs,
        )?;
        let layout = Arc::new(layout);
        let mut diagonal = vec![0.0; n];
        for &(i, j, value) in &mass {
            if i == j {
                diagonal[i as usize] += value;
            }
        }
        Ok(Self {
            n,
            scale: diagonal.iter().map(|mass: &f64| 1.0 / mass.sqrt()).collect(),
            row_scale: vec![1.0; rows],
            matrix: Bordered::new(&layout),
            factors: Factors::new(&layout, Kind::Regular),
            x: vec![0.0; n + rows],
            memory: vec![0.0; n + rows],
            mass,
            pairs,
        })
    }

    /// Factors the matrix for these entries of J. The error is a row that depends on others, or restricts
    /// nothing; or a coordinate whose mass is not positive.
    pub(super) fn factor(&mut self, jacobian: &[f64]) -> Result<(), usize> {
        let (n, scale) = (self.n, &self.scale);
        self.row_scale.fill(0.0);
        for (&(row, unknown), value) in self.pairs.iter().zip(jacobian) {
            self.row_scale[row as usize] += (value * scale[unknown as usize]).powi(2);
        }
        if let Some(row) = self.row_scale.iter().position(|square| !(*square > 0.0 && square.is_finite())) {
            return Err(n + row);
        }
        self.row_scale.iter_mut().for_each(|square| *square = 1.0 / square.sqrt());
        self.matrix.clear();
        for &(i, j, value) in &self.mass {
            let (i, j) = (i as usize, j as usize);
            self.matrix.add(i, j, value * scale[i] * scale[j]);
        }
        for (&(row, unknown), value) in self.pairs.iter().zip(jacobian) {
            let (row, unknown) = (row as usize, unknown as usize);
            let value = value * scale[unknown] * self.row_scale[row];
            self.matrix.add(n + row, unknown, value);
            self.matrix.add(unknown, n + row, value);
        }
        self.factors.factor(&self.matrix, Kind::Regular)
    }

    /// Solves for a right-hand side r: x is written to `change`, μ in the place of r.
    pub(super) fn solve(&mut self, r: &mut [f64], change: &mut [f64]) {
        let (above, below) = self.x.split_at_mut(self.n);
        above.fill(0.0);
        for ((x, r), scale) in below.iter_mut().zip(&*r).zip(&self.row_scale) {
            *x = r * scale;
        }
        self.factors.solve(&mut self.x, &mut self.memory);
        let (above, below) = self.x.split_at(self.n);
        for ((change, x), scale) in change.iter_mut().zip(above).zip(&self.scale) {
            *change = x * scale;
        }
        for ((r, x), scale) in r.iter_mut().zip(below).zip(&self.row_scale) {
            *r = -x * scale;
        }
    }

    /// Its structure in words.
    pub(super) fn describe(&self) -> String {
        self.matrix.layout.describe()
    }

    /// Bytes on the heap.
    pub(super) fn bytes(&self) -> usize {
        let lists = 16 * self.mass.len() + 8 * self.pairs.len();
        self.matrix.bytes() + self.factors.bytes() + lists + 24 * self.x.len()
    }
}

//! Mass and stiffness as banded matrices, from a linearised model or from single elements, in an order of
//! their rows that makes the band narrow.
//!
//! Rows are numbered by the reverse Cuthill–McKee order (A. George & J. W. Liu, *Computer Solution of Large
//! Sparse Positive Definite Systems*, §4.3–4.4): starting from a peripheral row, level by level, rows with
//! few neighbours first, and then reversed. The peripheral row is found by repeated searches from end to end
//! while the distance grows (N. E. Gibbs, W. G. Poole & P. K. Stockmeyer, SIAM J. Numer. Anal. 13 (1976)
//! 236). The given order is kept if its band is not wider. A chain has half-bandwidth 1, a closed ring 2, a
//! grid of a×b its shorter side, however they are numbered.

use alloc::vec::Vec;

use super::lowest::{LowestModes, lowest_modes};
use super::{Banded, VibrationError};
use crate::linearize::Linearization;

/// Elements a_ij up to this part of √(a_ii a_jj) are rounding of the linearisation and are left out, since
/// they would widen the band.
const MIN_COUPLING: f64 = 4.0 * f64::EPSILON;

/// M and K as banded matrices, with their rows in an order that makes the bands narrow.
#[derive(Clone, Debug, PartialEq)]
pub struct BandedModel {
    /// M.
    pub mass: Banded,
    /// K.
    pub stiffness: Banded,
    /// The coordinate of each row, as an index in the order in which the coordinates were given.
    pub order: Vec<usize>,
}

impl BandedModel {
    /// From single elements (i, j, value) of `n` coordinates, given once for (i, j) and (j, i) together.
    /// Elements with the same indices are added, as springs and finite elements are assembled.
    ///
    /// # Errors
    /// Indices beyond `n`, and values that are not finite.
    pub fn from_elements(
        n: usize,
        mass: impl IntoIterator<Item = (usize, usize, f64)>,
        stiffness: impl IntoIterator<Item = (usize, usize, f64)>,
    ) -> Result<Self, VibrationError> {
        let [mass, stiffness]: [Vec<_>; 2] = [mass.into_iter().collect(), stiffness.into_iter().collect()];
        for (i, j, value) in mass.iter().chain(&stiffness) {
            if *i >= n || *j >= n {
                return Err(VibrationError::Shapes { shapes: [(*i, *j), (n, n)].into() });
            }
            if !value.is_finite() {
                let must_be = "a finite number";
                return Err(VibrationError::Value { what: "an element of a matrix", value: *value, must_be });
            }
        }
        let mut neighbours = alloc::vec![Vec::new(); n];
        for (i, j, _) in mass.iter().chain(&stiffness).filter(|(i, j, _)| i != j) {
            neighbours[*i].push(*j);
            neighbours[*j].push(*i);
        }
        for of in &mut neighbours {
            of.sort_unstable();
            of.dedup();
        }
        let order = order(&neighbours);
        let mut row = alloc::vec![0; n];
        order.iter().enumerate().for_each(|(at, coordinate)| row[*coordinate] = at);
        let banded = |elements: &[(usize, usize, f64)]| {
            let width = elements.iter().map(|(i, j, _)| row[*i].abs_diff(row[*j])).max().unwrap_or(0);
            let mut found = Banded::zeros(n, width);
            elements.iter().try_for_each(|(i, j, value)| found.add(row[*i], row[*j], *value))?;
            Ok::<_, VibrationError>(found)
        };
        Ok(Self { mass: banded(&mass)?, stiffness: banded(&stiffness)?, order })
    }

    /// The `count` lowest modes, as of [`lowest_modes`]; rows of the shapes are coordinates in the order in
    /// which they were given.
    ///
    /// # Errors
    /// As [`lowest_modes`]; rows of matrices that are not definite are named by their coordinate.
    pub fn lowest_modes(&self, count: usize) -> Result<LowestModes, VibrationError> {
        let named = |error| match error {
            VibrationError::NotDefinite { matrix, row } => {
                VibrationError::NotDefinite { matrix, row: self.order[row] }
            }
            other => other,
        };
        let mut found = lowest_modes(&self.mass, &self.stiffness, count).map_err(named)?;
        let shapes = found.shapes.clone();
        for (at, coordinate) in self.order.iter().enumerate() {
            found.shapes.row_mut(*coordinate).copy_from(&shapes.row(at));
        }
        Ok(found)
    }
}

impl Linearization {
    /// Mass and stiffness of the independent coordinates as banded matrices, for the lowest modes of large
    /// models. Elements that are zero or only rounding are left out, and the coordinates are reordered for a
    /// narrow band. Damping is left out, too: these are the normal modes.
    ///
    /// # Errors
    /// Where there are no normal modes, as for [`Linearization::normal_modes`]: gyroscopic or circulatory
    /// terms, rolling, a position that is no equilibrium.
    pub fn banded(&self) -> Result<BandedModel, VibrationError> {
        let stiffness = self.stiffness_of_normal_modes()?;
        let n = self.mass.nrows();
        let elements = |of: &nalgebra::DMatrix<f64>| {
            let least = |i: usize, j: usize| MIN_COUPLING * (of[(i, i)] * of[(j, j)]).abs().sqrt();
            let below = (0..n).flat_map(|i| (0..=i).map(move |j| (i, j)));
            let kept = below.filter(|(i, j)| i == j || of[(*i, *j)].abs() > least(*i, *j));
            kept.map(|(i, j)| (i, j, of[(i, j)])).collect::<Vec<_>>()
        };
        BandedModel::from_elements(n, elements(&self.mass), elements(&stiffness))
    }
}

/// The reverse Cuthill–McKee order, or the given order if its band is not wider.
fn order(neighbours: &[Vec<usize>]) -> Vec<usize> {
    let n = neighbours.len();
    let mut taken = alloc::vec![false; n];
    let mut found: Vec<usize> = Vec::with_capacity(n);
    for first in 0..n {
        if !taken[first] {
            let part = level_structure(neighbours, peripheral_row(neighbours, first)).0;
            part.iter().for_each(|i| taken[*i] = true);
            found.extend(part);
        }
    }
    found.reverse();
    let mut row = alloc::vec![0; n];
    found.iter().enumerate().for_each(|(at, i)| row[*i] = at);
    let width = |row: &dyn Fn(usize) -> usize| {
        let of = |i: usize| neighbours[i].iter().map(|j| row(i).abs_diff(row(*j))).max().unwrap_or(0);
        (0..n).map(of).max().unwrap_or(0)
    };
    if width(&|i| i) <= width(&|i| row[i]) { (0..n).collect() } else { found }
}

/// A nearly peripheral row: searches go from a row to the last level and from there on, while the number of
/// levels grows.
fn peripheral_row(neighbours: &[Vec<usize>], mut first: usize) -> usize {
    let (mut all, mut far) = level_structure(neighbours, first);
    loop {
        let last = all.len() - far.1;
        let Some(next) = all[last..].iter().copied().min_by_key(|i| neighbours[*i].len()) else {
            return first;
        };
        let (then, farther) = level_structure(neighbours, next);
        if farther.0 <= far.0 {
            return next;
        }
        (first, all, far) = (next, then, farther);
    }
}

/// The rows connected with a row, level by level, rows with few neighbours first; then the number of the last
/// level and its number of rows.
fn level_structure(neighbours: &[Vec<usize>], first: usize) -> (Vec<usize>, (usize, usize)) {
    let mut level = alloc::vec![usize::MAX; neighbours.len()];
    let mut found = alloc::vec![first];
    level[first] = 0;
    let mut next = 0;
    while let Some(i) = found.get(next).copied() {
        next += 1;
        let mut new: Vec<usize> = neighbours[i].iter().copied().filter(|j| level[*j] == usize::MAX).collect();
        new.sort_by_key(|j| (neighbours[*j].len(), *j));
        new.iter().for_each(|j| level[*j] = level[i] + 1);
        found.extend(new);
    }
    let last = found.last().map_or(0, |i| level[*i]);
    let of_last = found.iter().filter(|i| level[**i] == last).count();
    (found, (last, of_last))
}

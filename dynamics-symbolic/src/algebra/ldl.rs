//! M = LDLᵀ unrolled on the graph, entries that are identically zero skipped.
//!
//! Eliminated from the last unknown of the order to the first, so that every step only touches neighbours of the eliminated unknown; the order
//! is by minimum degree, ties toward the last coordinate, which for a chain eliminates from its tip and for decoupled blocks creates no fill
//! between them.

use crate::graph::{Graph, NodeId};

/// The factors of a symmetric matrix.
#[derive(Clone, Debug)]
pub struct Factors {
    /// Unknowns in the order of elimination.
    order: Vec<usize>,
    /// Dᵢ by unknown.
    pivots: Vec<NodeId>,
    /// 1/Dᵢ by unknown.
    reciprocals: Vec<NodeId>,
    /// By eliminated unknown k: (i, Lᵢₖ) for the unknowns i eliminated later.
    columns: Vec<Vec<(usize, NodeId)>>,
}

impl Factors {
    /// Factors a symmetric matrix, of which the lower triangle is read.
    ///
    /// # Errors
    /// The unknown whose pivot is identically zero.
    pub fn new(g: &mut Graph, matrix: &[Vec<NodeId>]) -> Result<Self, usize> {
        let n = matrix.len();
        let mut rest: Vec<Vec<NodeId>> = (0..n).map(|i| (0..n).map(|j| matrix[i.max(j)][i.min(j)]).collect()).collect();
        let mut left: Vec<usize> = (0..n).collect();
        let zero = g.zero();
        let mut factors =
            Self { order: Vec::new(), pivots: vec![zero; n], reciprocals: vec![zero; n], columns: vec![Vec::new(); n] };
        while let Some(k) = next(g, &rest, &left) {
            left.retain(|i| *i != k);
            let pivot = rest[k][k];
            let one = g.one();
            let Some(reciprocal) = g.div(one, pivot) else { return Err(k) };
            factors.order.push(k);
            factors.pivots[k] = pivot;
            factors.reciprocals[k] = reciprocal;
            let neighbours: Vec<usize> = left.iter().copied().filter(|i| !g.is_zero(rest[*i][k])).collect();
            for (at, &i) in neighbours.iter().enumerate() {
                let l = g.mul_as_is(rest[i][k], reciprocal);
                factors.columns[k].push((i, l));
                for &j in &neighbours[..=at] {
                    let product = g.mul_as_is(l, rest[j][k]);
                    let entry = g.sub(rest[i][j], product);
                    rest[i][j] = entry;
                    rest[j][i] = entry;
                }
            }
        }
        Ok(factors)
    }

    /// Unknowns in the order of elimination, with their pivots.
    pub fn pivots(&self) -> impl Iterator<Item = (usize, NodeId)> + '_ {
        self.order.iter().map(|k| (*k, self.pivots[*k]))
    }

    /// x with M x = `right`.
    #[must_use]
    pub fn solve(&self, g: &mut Graph, right: &[NodeId]) -> Vec<NodeId> {
        let mut x = right.to_vec();
        for &k in &self.order {
            for &(i, l) in &self.columns[k] {
                let product = g.mul_as_is(l, x[k]);
                x[i] = g.sub(x[i], product);
            }
        }
        for &k in self.order.iter().rev() {
            // −2 m r ṙ φ̇ / (m r²) is −2 ṙ φ̇ / r, as one would write it.
            let short = if self.columns[k].is_empty() { g.cancelled_quotient(x[k], self.pivots[k]) } else { None };
            let mut value = short.unwrap_or_else(|| g.mul_as_is(self.reciprocals[k], x[k]));
            for &(i, l) in &self.columns[k] {
                let product = g.mul_as_is(l, x[i]);
                value = g.sub(value, product);
            }
            x[k] = value;
        }
        x
    }
}

/// The unknown with the fewest neighbours among those left; the last of them on ties.
fn next(g: &Graph, rest: &[Vec<NodeId>], left: &[usize]) -> Option<usize> {
    let degree = |k: usize| left.iter().filter(|i| **i != k && !g.is_zero(rest[**i][k])).count();
    left.iter().copied().min_by_key(|k| (degree(*k), core::cmp::Reverse(*k)))
}

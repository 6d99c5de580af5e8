//! M = LDLᵀ unrolled on the graph, entries that are identically zero skipped.
//!
//! Eliminated from the last unknown of the order to the first, so that every step only touches neighbours of
//! the eliminated unknown; the order is by minimum degree, ties toward the last coordinate, which for a chain
//! eliminates from its tip and for decoupled blocks creates no fill between them.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

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
        let mut rest = Rest::of(g, matrix);
        let mut factors = Self::empty(g, matrix.len());
        while let Some(k) = rest.fewest_neighbours(|_| true) {
            factors.eliminate(g, &mut rest, k).ok_or(k)?;
        }
        Ok(factors)
    }

    /// The same; `None` where a pivot is identically zero, or the graph gets more than `most` nodes.
    pub(super) fn within(g: &mut Graph, matrix: &[Vec<NodeId>], most: usize) -> Option<Self> {
        let mut rest = Rest::of(g, matrix);
        let mut factors = Self::empty(g, matrix.len());
        while let Some(k) = rest.fewest_neighbours(|_| true) {
            factors.eliminate(g, &mut rest, k)?;
            if g.len() > most {
                return None;
            }
        }
        Some(factors)
    }

    /// Factors of which no unknown is eliminated yet.
    pub(super) fn empty(g: &Graph, n: usize) -> Self {
        let zero = g.zero();
        Self {
            order: Vec::new(),
            pivots: vec![zero; n],
            reciprocals: vec![zero; n],
            columns: vec![Vec::new(); n],
        }
    }

    /// Eliminates an unknown from what is left: the products that were subtracted from the diagonal, by
    /// unknown; `None` where its pivot is zero.
    pub(super) fn eliminate(
        &mut self,
        g: &mut Graph,
        rest: &mut Rest,
        k: usize,
    ) -> Option<Vec<(usize, NodeId)>> {
        let (pivot, one) = (rest.diagonal(g, k), g.one());
        let reciprocal = g.div(one, pivot)?;
        self.order.push(k);
        self.pivots[k] = pivot;
        self.reciprocals[k] = reciprocal;
        let neighbours = rest.remove(k);
        let mut subtracted = Vec::with_capacity(neighbours.len());
        for (at, &(i, entry)) in neighbours.iter().enumerate() {
            let l = g.mul_as_is(entry, reciprocal);
            self.columns[k].push((i, l));
            for &(j, other) in &neighbours[..=at] {
                let product = g.mul_as_is(l, other);
                let updated = rest.get(g, i, j);
                let updated = g.sub(updated, product);
                rest.set(g, i, j, updated);
                if i == j {
                    subtracted.push((i, product));
                }
            }
        }
        Some(subtracted)
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
            self.forward(g, k, &mut x);
        }
        for &k in self.order.iter().rev() {
            x[k] = self.back(g, k, &x);
        }
        x
    }

    /// Takes what was eliminated with unknown k off the right-hand side.
    pub(super) fn forward(&self, g: &mut Graph, k: usize, x: &mut [NodeId]) {
        for &(i, l) in &self.columns[k] {
            let product = g.mul_as_is(l, x[k]);
            x[i] = g.sub(x[i], product);
        }
    }

    /// The value of unknown k, given those that were eliminated later and its own right-hand side.
    pub(super) fn back(&self, g: &mut Graph, k: usize, x: &[NodeId]) -> NodeId {
        // −2 m r ṙ φ̇ / (m r²) is −2 ṙ φ̇ / r, as one would write it.
        let short =
            if self.columns[k].is_empty() { g.cancelled_quotient(x[k], self.pivots[k]) } else { None };
        let mut value = short.unwrap_or_else(|| g.mul_as_is(self.reciprocals[k], x[k]));
        for &(i, l) in &self.columns[k] {
            let product = g.mul_as_is(l, x[i]);
            value = g.sub(value, product);
        }
        value
    }
}

/// Another graph, into which values of this one are carried.
pub(crate) trait Elsewhere {
    /// The other graph.
    fn graph(&mut self) -> &mut Graph;
    /// A value of this graph there.
    fn carry(&mut self, id: NodeId) -> NodeId;
}

impl Factors {
    /// x with M x = `right`, where right-hand sides and solution are nodes of another graph.
    pub(crate) fn solve_elsewhere(&self, other: &mut impl Elsewhere, right: &[NodeId]) -> Vec<NodeId> {
        let mut x = right.to_vec();
        for &k in &self.order {
            for &(i, l) in &self.columns[k] {
                let l = other.carry(l);
                let product = other.graph().mul_as_is(l, x[k]);
                x[i] = other.graph().sub(x[i], product);
            }
        }
        for &k in self.order.iter().rev() {
            let reciprocal = other.carry(self.reciprocals[k]);
            let mut value = other.graph().mul_as_is(reciprocal, x[k]);
            for &(i, l) in &self.columns[k] {
                let l = other.carry(l);
                let product = other.graph().mul_as_is(l, x[i]);
                value = other.graph().sub(value, product);
            }
            x[k] = value;
        }
        x
    }
}

/// What is left of a symmetric matrix after some unknowns are eliminated: entries that are not identically
/// zero, by row.
#[derive(Clone, Debug)]
pub(super) struct Rest {
    rows: Vec<BTreeMap<usize, NodeId>>,
    /// Unknowns that are left by their numbers of neighbours, the last one first among equals.
    left: BTreeSet<(usize, Reverse<usize>)>,
}

impl Rest {
    pub(super) fn new(n: usize) -> Self {
        Self { rows: vec![BTreeMap::new(); n], left: (0..n).map(|k| (0, Reverse(k))).collect() }
    }

    /// All of a matrix, of which the lower triangle is read.
    fn of(g: &Graph, matrix: &[Vec<NodeId>]) -> Self {
        let mut rest = Self::new(matrix.len());
        for (i, row) in matrix.iter().enumerate() {
            row[..=i].iter().enumerate().for_each(|(j, entry)| rest.set(g, i, j, *entry));
        }
        rest
    }

    pub(super) fn get(&self, g: &Graph, i: usize, j: usize) -> NodeId {
        self.rows[i].get(&j).copied().unwrap_or(g.zero())
    }

    pub(super) fn diagonal(&self, g: &Graph, i: usize) -> NodeId {
        self.get(g, i, i)
    }

    pub(super) fn set(&mut self, g: &Graph, i: usize, j: usize, entry: NodeId) {
        for (i, j) in [(i, j), (j, i)] {
            let before = self.degree(i);
            if g.is_zero(entry) {
                self.rows[i].remove(&j);
            } else {
                self.rows[i].insert(j, entry);
            }
            self.count_again(i, before);
        }
    }

    /// Number of neighbours.
    fn degree(&self, k: usize) -> usize {
        self.rows[k].len() - usize::from(self.rows[k].contains_key(&k))
    }

    /// Puts an unknown that had so many neighbours in its place.
    fn count_again(&mut self, k: usize, before: usize) {
        let now = self.degree(k);
        if now != before && self.left.remove(&(before, Reverse(k))) {
            self.left.insert((now, Reverse(k)));
        }
    }

    /// The unknowns that share an entry with `k`, ascending.
    pub(super) fn neighbours(&self, k: usize) -> impl Iterator<Item = usize> + '_ {
        self.rows[k].keys().copied().filter(move |i| *i != k)
    }

    /// Whether no unknown is left.
    pub(super) fn is_done(&self) -> bool {
        self.left.is_empty()
    }

    /// The unknown with the fewest neighbours among those left that are `ready`; the last of them on ties.
    pub(super) fn fewest_neighbours(&self, ready: impl Fn(usize) -> bool) -> Option<usize> {
        self.left.iter().map(|(_, Reverse(k))| *k).find(|k| ready(*k))
    }

    /// The last of the unknowns that are left and ready.
    pub(super) fn last(&self, ready: impl Fn(usize) -> bool) -> Option<usize> {
        self.left.iter().map(|(_, Reverse(k))| *k).filter(|k| ready(*k)).max()
    }

    /// Takes an unknown out: its neighbours with their entries.
    pub(super) fn remove(&mut self, k: usize) -> Vec<(usize, NodeId)> {
        self.left.remove(&(self.degree(k), Reverse(k)));
        let row = core::mem::take(&mut self.rows[k]);
        for i in row.keys().copied().filter(|i| *i != k) {
            let before = self.degree(i);
            self.rows[i].remove(&k);
            self.count_again(i, before);
        }
        row.into_iter().filter(|(i, _)| *i != k).collect()
    }
}

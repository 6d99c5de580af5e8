//! Sparse matrices and vectors of nodes: what is identically zero is not there.

use std::collections::BTreeMap;

use crate::graph::{Graph, NodeId};

/// A sparse matrix by rows.
#[derive(Clone, Debug)]
pub(super) struct SparseMatrix {
    pub(super) rows: Vec<BTreeMap<usize, NodeId>>,
    /// The rows in which each column has entries, ascending.
    columns: Vec<Vec<usize>>,
}

impl SparseMatrix {
    /// From a dense matrix with `width` columns.
    pub(super) fn new(g: &Graph, matrix: &[Vec<NodeId>], width: usize) -> Self {
        let entries =
            |row: &Vec<NodeId>| row.iter().copied().enumerate().filter(|(_, x)| !g.is_zero(*x)).collect();
        let rows: Vec<BTreeMap<usize, NodeId>> = matrix.iter().map(entries).collect();
        let mut columns = vec![Vec::new(); width];
        for (i, row) in rows.iter().enumerate() {
            row.keys().for_each(|j| columns[*j].push(i));
        }
        Self { rows, columns }
    }

    /// The entries of a column by row.
    pub(super) fn column(&self, j: usize) -> impl Iterator<Item = (usize, NodeId)> + '_ {
        self.columns[j].iter().map(move |i| (*i, self.rows[*i][&j]))
    }

    /// Columns with entries, by row.
    pub(super) fn pattern(&self) -> Vec<Vec<usize>> {
        self.rows.iter().map(|row| row.keys().copied().collect()).collect()
    }
}

/// A sparse vector.
#[derive(Clone, Debug, Default)]
pub(super) struct Values(BTreeMap<usize, NodeId>);

impl Values {
    pub(super) fn get(&self, g: &Graph, i: usize) -> NodeId {
        self.0.get(&i).copied().unwrap_or(g.zero())
    }

    pub(super) fn set(&mut self, i: usize, value: NodeId) {
        self.0.insert(i, value);
    }

    /// Entry i less a·b.
    pub(super) fn subtract(&mut self, g: &mut Graph, i: usize, a: NodeId, b: NodeId) {
        let product = g.mul(a, b);
        let old = self.get(g, i);
        let updated = g.sub(old, product);
        self.set(i, updated);
    }

    /// All entries that were set.
    pub(super) fn into_entries(self) -> impl Iterator<Item = (usize, NodeId)> {
        self.0.into_iter()
    }

    /// Entries that are not identically zero.
    pub(super) fn entries<'a>(&'a self, g: &'a Graph) -> impl Iterator<Item = (usize, NodeId)> + 'a {
        self.0.iter().filter(|(_, x)| !g.is_zero(**x)).map(|(i, x)| (*i, *x))
    }
}

/// Σ aᵢ bᵢ.
pub(super) fn dot(g: &mut Graph, a: &[NodeId], b: &[NodeId]) -> NodeId {
    let mut sum = g.zero();
    for (a, b) in a.iter().zip(b) {
        let product = g.mul(*a, *b);
        sum = g.add(sum, product);
    }
    sum
}

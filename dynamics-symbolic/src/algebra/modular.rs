//! Null spaces of sparse matrices modulo 2⁶¹ − 31, from the values that nodes have at the random points.

use std::collections::{BTreeMap, BTreeSet};

use crate::graph::Fingerprint;

/// A basis of the vectors x with A x = 0, as vectors of which each has one free column in which it is 1 and
/// the others are 0: a choice of the columns that determine all others.
#[derive(Clone, Debug)]
pub(crate) struct FreeColumns(Vec<(usize, BTreeMap<usize, Fingerprint>)>);

impl FreeColumns {
    /// Of a matrix with n columns, given by rows. The columns declared first are the free ones where there is
    /// a choice.
    pub(crate) fn new(rows: Vec<BTreeMap<usize, Fingerprint>>, n: usize) -> Self {
        let pivots = echelon(rows, n);
        let mut is_free = vec![true; n];
        pivots.iter().for_each(|(column, _)| is_free[*column] = false);
        let vector = |free: usize| {
            let mut x = BTreeMap::from([(free, Fingerprint::ONE)]);
            // A pivot's column follows from columns before it.
            for (column, row) in pivots.iter().rev().skip_while(|(column, _)| *column < free) {
                let terms = row.range(..column).filter_map(|(c, a)| x.get(c).map(|x| a.mul(*x)));
                let sum = terms.fold(Fingerprint::ZERO, Fingerprint::add);
                if sum != Fingerprint::ZERO {
                    x.insert(*column, sum.neg());
                }
            }
            (free, x)
        };
        Self((0..n).filter(|c| is_free[*c]).map(vector).collect())
    }

    /// The vectors, by their free columns.
    pub(crate) fn vectors(&self) -> impl Iterator<Item = (usize, &BTreeMap<usize, Fingerprint>)> {
        self.0.iter().map(|(free, x)| (*free, x))
    }

    /// The free columns; ascending before any is exchanged.
    pub(super) fn columns(&self) -> Vec<usize> {
        self.0.iter().map(|(free, _)| *free).collect()
    }

    /// The entries of all vectors in so many columns: singular where these do not determine the others.
    pub(super) fn minor(&self, columns: &[usize]) -> Vec<Vec<Fingerprint>> {
        let row = |x: &BTreeMap<usize, Fingerprint>| {
            columns.iter().map(|c| x.get(c).copied().unwrap_or_default()).collect()
        };
        self.0.iter().map(|(_, x)| row(x)).collect()
    }

    /// Whether a column can be free in the place of one that is. The columns determine the others if and only
    /// if their minor is regular, and it is the identity but for one column.
    pub(super) fn can_exchange(&self, free: usize, column: usize) -> bool {
        let vector = self.0.iter().find(|(other, _)| *other == free);
        vector.and_then(|(_, x)| x.get(&column)).is_some_and(|x| x.is_unit())
    }

    /// Makes a column free in the place of one that is and can be exchanged.
    pub(super) fn exchange(&mut self, free: usize, column: usize) {
        let Some(at) = self.0.iter().position(|(other, _)| *other == free) else { return };
        let mut vector = core::mem::take(&mut self.0[at].1);
        let reciprocal = Fingerprint::ONE.div(vector[&column]);
        vector.values_mut().for_each(|x| *x = x.mul(reciprocal));
        self.0.iter_mut().for_each(|(_, other)| clear(other, column, &vector));
        self.0[at] = (column, vector);
    }
}

/// Pivot columns with their rows, 1 there and without entries in later columns, from the last column to the
/// first.
fn echelon(
    mut rows: Vec<BTreeMap<usize, Fingerprint>>,
    n: usize,
) -> Vec<(usize, BTreeMap<usize, Fingerprint>)> {
    let mut of_column = vec![BTreeSet::new(); n];
    for (r, row) in rows.iter().enumerate() {
        row.keys().for_each(|c| _ = of_column[*c].insert(r));
    }
    let mut pivots = Vec::new();
    for column in (0..n).rev() {
        let candidates = of_column[column].iter().copied().filter(|r| rows[*r][&column].is_unit());
        let Some(at) = candidates.min_by_key(|r| rows[*r].len()) else { continue };
        let mut pivot = core::mem::take(&mut rows[at]);
        pivot.keys().for_each(|c| _ = of_column[*c].remove(&at));
        let reciprocal = Fingerprint::ONE.div(pivot[&column]);
        pivot.values_mut().for_each(|x| *x = x.mul(reciprocal));
        for r in core::mem::take(&mut of_column[column]) {
            clear(&mut rows[r], column, &pivot);
            for c in pivot.keys() {
                if rows[r].contains_key(c) {
                    of_column[*c].insert(r);
                } else {
                    of_column[*c].remove(&r);
                }
            }
        }
        pivots.push((column, pivot));
    }
    pivots
}

/// Subtracts the multiple of `pivot`, 1 in this column, that clears it.
fn clear(row: &mut BTreeMap<usize, Fingerprint>, column: usize, pivot: &BTreeMap<usize, Fingerprint>) {
    let Some(factor) = row.get(&column).copied() else { return };
    for (c, x) in pivot {
        let entry = row.entry(*c).or_insert(Fingerprint::ZERO);
        *entry = entry.sub(factor.mul(*x));
        if *entry == Fingerprint::ZERO {
            row.remove(c);
        }
    }
}

/// Whether a square matrix is singular.
pub(super) fn is_singular(mut matrix: Vec<Vec<Fingerprint>>) -> bool {
    let n = matrix.len();
    for k in 0..n {
        let Some(found) = (k..n).find(|r| matrix[*r][k].is_unit()) else { return true };
        matrix.swap(k, found);
        let reciprocal = Fingerprint::ONE.div(matrix[k][k]);
        let (done, rest) = matrix.split_at_mut(k + 1);
        for row in rest {
            let factor = row[k].mul(reciprocal);
            row.iter_mut().zip(&done[k]).for_each(|(x, p)| *x = x.sub(factor.mul(*p)));
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::{BTreeMap, Fingerprint, FreeColumns, is_singular};

    fn dense(rows: &[&[u64]]) -> Vec<Vec<Fingerprint>> {
        let number = |n: &u64| (0..*n).fold(Fingerprint::ZERO, |s, _| s.add(Fingerprint::ONE));
        rows.iter().map(|r| r.iter().map(number).collect()).collect()
    }

    fn sparse(rows: &[&[u64]]) -> Vec<BTreeMap<usize, Fingerprint>> {
        let entries = |r: Vec<Fingerprint>| {
            r.into_iter().enumerate().filter(|(_, x)| *x != Fingerprint::ZERO).collect()
        };
        dense(rows).into_iter().map(entries).collect()
    }

    #[test]
    fn every_row_is_orthogonal_to_the_null_space() {
        let rows = [&[1, 2, 3, 0][..], &[2, 4, 6, 0], &[0, 1, 1, 5]];
        let mut basis = FreeColumns::new(sparse(&rows), 4);
        assert_eq!(basis.columns(), [0, 1], "what is declared first is free");
        null(&rows, &basis);
        // x₀ = −2 x₁ − 3 x₂, x₁ = −x₂ − 5 x₃.
        assert!(basis.can_exchange(0, 3) && basis.can_exchange(1, 2));
        basis.exchange(1, 3);
        assert_eq!(basis.columns(), [0, 3]);
        null(&rows, &basis);
    }

    fn null(rows: &[&[u64]], basis: &FreeColumns) {
        for row in sparse(rows) {
            for (_, x) in &basis.0 {
                let sum = row.iter().filter_map(|(c, a)| x.get(c).map(|x| a.mul(*x)));
                assert_eq!(sum.fold(Fingerprint::ZERO, Fingerprint::add), Fingerprint::ZERO);
            }
        }
    }

    /// Exchanges are allowed where the minor of the columns that would be free is regular, also after others.
    #[test]
    fn columns_can_be_exchanged_where_their_minor_is_regular() {
        let rows = [&[1, 2, 0, 3, 0, 0][..], &[0, 1, 4, 0, 0, 0], &[2, 0, 0, 0, 1, 7]];
        let start = FreeColumns::new(sparse(&rows), 6);
        let mut basis = start.clone();
        for (leaves, enters) in [(0, 3), (2, 1), (3, 0), (1, 2)] {
            let free = basis.columns();
            for (at, c) in (0..3).flat_map(|at| (0..6).map(move |c| (at, c))) {
                let mut set = free.clone();
                set[at] = c;
                let regular = !is_singular(start.minor(&set)) && !free.contains(&c);
                assert_eq!(
                    basis.can_exchange(free[at], c) && !free.contains(&c),
                    regular,
                    "{free:?}, {set:?}"
                );
            }
            basis.exchange(leaves, enters);
            null(&rows, &basis);
            let identity = basis.minor(&basis.columns());
            let one = |i, j| if i == j { Fingerprint::ONE } else { Fingerprint::ZERO };
            assert!((0..3).all(|i| (0..3).all(|j| identity[i][j] == one(i, j))));
        }
    }

    #[test]
    fn singular_matrices_are_told_from_regular_ones() {
        assert!(is_singular(dense(&[&[1, 2], &[2, 4]])));
        assert!(!is_singular(dense(&[&[0, 2], &[2, 4]])));
        assert!(!is_singular(Vec::new()));
    }
}

//! Null spaces of sparse matrices modulo 2⁶¹ − 31, from the values that nodes have at the random points.

use std::collections::BTreeMap;

use crate::graph::Fingerprint;

/// A basis of the vectors x of length n with `rows`·x = 0, one for every free column: that column, and the
/// vector. The columns declared first are the free ones where there is a choice.
pub(super) fn null_space(
    mut rows: Vec<BTreeMap<usize, Fingerprint>>,
    n: usize,
) -> Vec<(usize, BTreeMap<usize, Fingerprint>)> {
    let mut pivots: Vec<(usize, BTreeMap<usize, Fingerprint>)> = Vec::new();
    let mut free = Vec::new();
    for column in (0..n).rev() {
        let candidates =
            rows.iter().enumerate().filter(|(_, row)| row.get(&column).is_some_and(|x| x.is_unit()));
        let Some((at, _)) = candidates.min_by_key(|(_, row)| row.len()) else {
            free.push(column);
            continue;
        };
        let mut pivot = rows.swap_remove(at);
        let reciprocal = Fingerprint::ONE.div(pivot[&column]);
        pivot.values_mut().for_each(|x| *x = x.mul(reciprocal));
        rows.iter_mut()
            .chain(pivots.iter_mut().map(|(_, row)| row))
            .for_each(|row| clear(row, column, &pivot));
        pivots.push((column, pivot));
    }
    free.reverse();
    let vector = |free: usize| {
        let entries = pivots.iter().filter_map(|(column, row)| row.get(&free).map(|x| (*column, x.neg())));
        (free, entries.chain([(free, Fingerprint::ONE)]).collect())
    };
    free.into_iter().map(vector).collect()
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
    use super::{BTreeMap, Fingerprint, is_singular, null_space};

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
        let basis = null_space(sparse(&rows), 4);
        assert_eq!(
            basis.iter().map(|(free, _)| *free).collect::<Vec<_>>(),
            [0, 1],
            "what is declared first is free"
        );
        for row in sparse(&rows) {
            for (_, x) in &basis {
                let sum = row.iter().filter_map(|(c, a)| x.get(c).map(|x| a.mul(*x)));
                assert_eq!(sum.fold(Fingerprint::ZERO, Fingerprint::add), Fingerprint::ZERO);
            }
        }
    }

    #[test]
    fn singular_matrices_are_told_from_regular_ones() {
        assert!(is_singular(dense(&[&[1, 2], &[2, 4]])));
        assert!(!is_singular(dense(&[&[0, 2], &[2, 4]])));
        assert!(!is_singular(Vec::new()));
    }
}

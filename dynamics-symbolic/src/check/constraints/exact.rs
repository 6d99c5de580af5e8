//! Elimination modulo 2⁶¹ − 31, row by row in a given order: which rows depend on those before them, and how.

use crate::graph::Fingerprint;

/// A sparse vector: indices ascending, no zeros.
pub(in crate::check) type SparseVector = Vec<(usize, Fingerprint)>;

/// a − factor·b.
fn minus(a: &SparseVector, factor: Fingerprint, b: &SparseVector) -> SparseVector {
    let mut result = Vec::with_capacity(a.len() + b.len());
    let (mut a, mut b) = (a.iter().copied().peekable(), b.iter().copied().peekable());
    loop {
        let entry = match (a.peek(), b.peek()) {
            (None, None) => return result,
            (Some((i, x)), Some((j, y))) if i == j => (*i, x.sub(factor.mul(*y)), true, true),
            (Some((i, x)), Some((j, _))) if i < j => (*i, *x, true, false),
            (Some((i, x)), None) => (*i, *x, true, false),
            (_, Some((j, y))) => (*j, factor.mul(*y).neg(), false, true),
        };
        let (index, value, from_a, from_b) = entry;
        if from_a {
            a.next();
        }
        if from_b {
            b.next();
        }
        if value != Fingerprint::ZERO {
            result.push((index, value));
        }
    }
}

/// What became of a row.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::check) enum Outcome {
    /// It does not depend on the rows before.
    Independent,
    /// It is this combination of them; the right-hand side agrees or does not.
    Dependent {
        /// Coefficients by row.
        coefficients: SparseVector,
        /// Whether the right-hand sides satisfy the same relation.
        consistent: bool,
    },
}

/// Rows in echelon form.
#[derive(Clone, Debug, Default)]
pub(in crate::check) struct Echelon {
    reduced: Vec<ReducedRow>,
    /// Position in `reduced` of the row that leads with a column.
    leading: Vec<Option<usize>>,
}

/// A row less multiples of those before, leading entry 1.
#[derive(Clone, Debug)]
struct ReducedRow {
    entries: SparseVector,
    right: Fingerprint,
    name: usize,
    /// What was subtracted, by position in [`Echelon::reduced`]. What the row is made of in terms of the rows
    /// that were given follows from all of these; in a long chain each row is made of all before it.
    subtracted: Vec<(usize, Fingerprint)>,
    /// What the difference was multiplied by.
    scale: Fingerprint,
}

impl Echelon {
    /// Number of independent rows.
    pub(in crate::check) fn rank(&self) -> usize {
        self.reduced.len()
    }

    /// Adds a row with its right-hand side, unless it depends on those that are there.
    pub(in crate::check) fn add(&mut self, name: usize, row: &SparseVector, right: Fingerprint) -> Outcome {
        let (mut row, mut right, mut subtracted) = (row.clone(), right, Vec::new());
        // Entries before the current one lead no reduced row.
        let mut at = 0;
        while at < row.len() {
            let (column, value) = row[at];
            match self.leading.get(column).copied().flatten() {
                Some(known) => {
                    let other = &self.reduced[known];
                    row = minus(&row, value, &other.entries);
                    right = right.sub(value.mul(other.right));
                    subtracted.push((known, value));
                }
                None => at += 1,
            }
        }
        let Some((column, value)) = row.first().copied() else {
            let coefficients = self.coefficients(&subtracted);
            return Outcome::Dependent { coefficients, consistent: right == Fingerprint::ZERO };
        };
        let scale = Fingerprint::ONE.div(value);
        let entries = row.into_iter().map(|(i, x)| (i, x.mul(scale))).collect();
        if self.leading.len() <= column {
            self.leading.resize(column + 1, None);
        }
        self.leading[column] = Some(self.reduced.len());
        self.reduced.push(ReducedRow { entries, right: right.mul(scale), name, subtracted, scale });
        Outcome::Independent
    }

    /// A sum of multiples of reduced rows in terms of the rows that were given.
    fn coefficients(&self, sum: &[(usize, Fingerprint)]) -> SparseVector {
        let mut factors = vec![Fingerprint::ZERO; self.reduced.len()];
        sum.iter().for_each(|(at, factor)| factors[*at] = factors[*at].add(*factor));
        let mut given = Vec::new();
        // From the last to the first, as each is made of rows before it.
        for (at, row) in self.reduced.iter().enumerate().rev() {
            let factor = factors[at].mul(row.scale);
            if factor == Fingerprint::ZERO {
                continue;
            }
            given.push((row.name, factor));
            for (before, x) in &row.subtracted {
                factors[*before] = factors[*before].sub(factor.mul(*x));
            }
        }
        given.sort_unstable_by_key(|(name, _)| *name);
        given
    }
}

#[cfg(test)]
mod tests {
    use super::{Echelon, Outcome, SparseVector};
    use crate::graph::{Fingerprint, Number};

    fn number(n: i64) -> Fingerprint {
        Fingerprint::number(Number::integer(n))
    }

    fn sparse(row: &[i64]) -> SparseVector {
        row.iter().enumerate().filter(|(_, x)| **x != 0).map(|(i, x)| (i, number(*x))).collect()
    }

    #[test]
    fn a_dependent_row_is_a_combination_of_those_before() {
        let mut e = Echelon::default();
        assert_eq!(e.add(7, &sparse(&[0, 2, 1]), number(1)), Outcome::Independent);
        assert_eq!(e.add(8, &sparse(&[1, 1, 0]), number(5)), Outcome::Independent);
        // 3·(row 7) − 2·(row 8), with a right-hand side that fits and one that does not.
        for (right, consistent) in [(-7, true), (0, false)] {
            let coefficients = vec![(7, number(3)), (8, number(-2))];
            let outcome = e.add(9, &sparse(&[-2, 4, 3]), number(right));
            assert_eq!(outcome, Outcome::Dependent { coefficients, consistent });
        }
        assert_eq!(e.add(10, &sparse(&[0, 0, 5]), number(0)), Outcome::Independent);
        assert_eq!(e.rank(), 3);
    }

    #[test]
    fn an_empty_row_depends_on_nothing() {
        let mut e = Echelon::default();
        let nothing = Outcome::Dependent { coefficients: Vec::new(), consistent: true };
        assert_eq!(e.add(0, &Vec::new(), number(0)), nothing);
    }
}

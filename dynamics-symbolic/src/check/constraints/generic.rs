//! Rank of the rows in every state, by elimination modulo 2⁶¹ − 31 at random points.
//!
//! A row of Φ_q that depends on others at a random point does so everywhere. Where the coefficients are
//! constants of the motion, the row itself is that combination of the others up to something that does not
//! depend on the coordinates: zero, then it repeats them, or not, then it contradicts them. Otherwise only
//! the manifold Φ = 0 can tell.

use crate::check::modular::{combination, integers};
use crate::graph::{Fingerprint, NodeId, Sampler, Symbol};

use super::exact::{Echelon, Outcome, SparseVector};
use super::rows::ConstraintRows;
use crate::check::finding::Combination;

/// A row that depends on others.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Dependent {
    /// The row.
    pub(super) row: usize,
    /// The others that take part.
    pub(super) others: Vec<usize>,
    /// The combination, for messages.
    pub(super) of: Combination,
    /// What follows from it.
    pub(super) verdict: Verdict,
}

/// What the dependence of a row means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    /// The row holds where the others hold.
    Repeats,
    /// The row cannot hold where the others hold.
    Contradicts,
    /// It depends on the state in which the others hold.
    Open,
}

/// Φ_q, Φ_t and Φ at random points. Parameters are the same at all of them.
pub(super) struct Samples {
    /// Per point and row: the row of Φ_q, then Φ_t or b, then Φ or A q̇ + b.
    points: Vec<Vec<(SparseVector, Fingerprint, Fingerprint)>>,
    coordinates: usize,
    holonomic: usize,
}

impl Samples {
    /// As many points as settle the constant coefficients of all rows.
    pub(super) fn of(rows: &ConstraintRows) -> Self {
        let nodes: Vec<NodeId> = (0..rows.len())
            .flat_map(|r| {
                rows.jacobian[r].iter().map(|(_, node)| *node).chain([rows.offset[r], rows.values[r]])
            })
            .collect();
        let sampler = Sampler::new(&rows.graph, &nodes);
        let count = 3 + rows.len().div_ceil(rows.coordinates.max(1)) as u64;
        let point = |point: u64| {
            let fixed = |s: Symbol| matches!(s, Symbol::Parameter(_));
            let mut values =
                sampler.with(&mut |s| sampler.random(s, if fixed(s) { 0 } else { point })).into_iter();
            let mut next = || values.next().expect("a value for every node");
            let row = |r: usize| {
                let columns = rows.jacobian[r].iter().map(|(j, _)| *j);
                let entries: Vec<(usize, Fingerprint)> = columns.map(|j| (j, next())).collect();
                let nonzero = entries.into_iter().filter(|(_, x)| *x != Fingerprint::ZERO).collect();
                (nonzero, next(), next())
            };
            (0..rows.len()).map(row).collect()
        };
        let points = (0..count).map(point).collect();
        Self { points, coordinates: rows.coordinates, holonomic: rows.holonomic }
    }

    /// Which of the rows in this order depend on those before them.
    pub(super) fn dependents(&self, rows: &ConstraintRows, order: &[usize]) -> (usize, Vec<Dependent>) {
        let mut here = Echelon::default();
        let mut independent = Vec::new();
        let mut found = Vec::new();
        for r in order {
            let (row, offset, _) = &self.points[0][*r];
            match here.add(*r, row, *offset) {
                Outcome::Independent => independent.push(*r),
                Outcome::Dependent { coefficients, consistent } => {
                    found.push(self.judge(rows, *r, &independent, &coefficients, consistent));
                }
            }
        }
        (here.rank(), found)
    }

    /// What the dependence of row r, with these coefficients at one point, means.
    fn judge(
        &self,
        rows: &ConstraintRows,
        r: usize,
        independent: &[usize],
        at_one: &SparseVector,
        consistent: bool,
    ) -> Dependent {
        let mut everywhere = Echelon::default();
        independent.iter().for_each(|s| drop(everywhere.add(*s, &self.joined(*s), Fingerprint::ZERO)));
        let constant = match everywhere.add(r, &self.joined(r), Fingerprint::ZERO) {
            Outcome::Dependent { coefficients, .. } => Some(coefficients),
            Outcome::Independent => None,
        };
        let others: Vec<usize> = at_one.iter().map(|(s, _)| *s).collect();
        let holonomic = r < self.holonomic && others.iter().all(|s| *s < self.holonomic);
        let verdict = match &constant {
            Some(c) if holonomic && !(consistent && self.remainder(r, c) == Fingerprint::ZERO) => {
                Verdict::Contradicts
            }
            // What holds on the manifold only is not known here.
            None if self.holonomic > 0 => Verdict::Open,
            _ if consistent => Verdict::Repeats,
            _ if self.holonomic > 0 => Verdict::Open,
            _ => Verdict::Contradicts,
        };
        let text = constant.and_then(|c| rational(&c)).map(|(scale, factors)| {
            let names = rows.named(r, factors.iter().map(|(s, _)| *s));
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            let numbers: Vec<i64> = factors.iter().map(|(_, c)| *c).collect();
            let sum = combination(&numbers, &names);
            match (scale, numbers.len()) {
                (1, _) => sum,
                (_, 1) => format!("{sum}/{scale}"),
                _ => format!("({sum})/{scale}"),
            }
        });
        let of = text
            .map_or_else(|| Combination::Of(rows.named(r, others.iter().copied())), Combination::Constant);
        Dependent { row: r, others, of, verdict }
    }

    /// A row at all points side by side.
    fn joined(&self, r: usize) -> SparseVector {
        let shift = |(i, point): (usize, &Vec<(SparseVector, Fingerprint, Fingerprint)>)| {
            let moved = point[r].0.iter().map(move |(j, x)| (i * self.coordinates + j, *x));
            moved.collect::<SparseVector>()
        };
        self.points.iter().enumerate().flat_map(shift).collect()
    }

    /// Φ_r minus the combination of the other Φ.
    fn remainder(&self, r: usize, coefficients: &SparseVector) -> Fingerprint {
        let value = |s: usize| self.points[0][s].2;
        coefficients.iter().fold(value(r), |rest, (s, c)| rest.sub(c.mul(value(*s))))
    }
}

/// Coefficients as integers over a common denominator; `None` where they are no rational constants.
fn rational(coefficients: &SparseVector) -> Option<(i64, Vec<(usize, i64)>)> {
    let vector: Vec<Fingerprint> =
        core::iter::once(Fingerprint::ONE).chain(coefficients.iter().map(|(_, c)| *c)).collect();
    let numbers = integers(&vector)?;
    let (scale, rest) = numbers.split_first()?;
    Some((*scale, coefficients.iter().map(|(s, _)| *s).zip(rest.iter().copied()).collect()))
}

/// The rows that are in a relation: those that depend on others, and the others.
pub(super) fn entangled(found: &[Dependent]) -> Vec<usize> {
    let mut rows: Vec<usize> = found.iter().flat_map(|d| d.others.iter().copied().chain([d.row])).collect();
    rows.sort_unstable();
    rows.dedup();
    rows
}

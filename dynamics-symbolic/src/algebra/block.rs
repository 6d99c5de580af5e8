//! A square block of the dependent coordinates' Jacobian, factored on the graph: first the pivots that are
//! constants, which need no guard and cost nothing (the joints of bodies in absolute coordinates), then
//! pivots by fewest neighbours, until at most three unknowns are left. These are solved by cofactors: one
//! division, no pivot that could vanish while the determinant does not.

use std::collections::BTreeMap;

use crate::graph::{Graph, NodeId};

use super::sparse::{SparseMatrix, Values, dot};
use super::unrolled::{Guard, Guarded};

/// Most unknowns of a block that are solved by cofactors, whose number of products grows with the factorial.
/// Three unknowns take one division and no pivot that could vanish while the determinant does not.
const MOST_BY_COFACTORS: usize = 3;
/// Smallest ratio of a determinant, or a pivot, to the norms of its columns and rows at which the solution on
/// the graph is used. Below it the general solver takes over. A ratio of 1e-3 costs about three of sixteen
/// digits. A smaller bound would lose more of them, a larger one would call the general solver more often.
pub(super) const LEAST_DETERMINANT_RATIO: f64 = 1e-3;

/// One step of Gaussian elimination, all numbers being those of the whole system.
#[derive(Clone, Debug)]
struct EliminationStep {
    row: usize,
    column: usize,
    reciprocal: NodeId,
    /// (row r, Lᵣ) for the rows below.
    below: Vec<(usize, NodeId)>,
    /// (column c, U_c) for the columns to the right.
    right: Vec<(usize, NodeId)>,
}

/// A factored block A.
#[derive(Clone, Debug)]
pub(super) struct BlockFactors {
    steps: Vec<EliminationStep>,
    rows: Vec<usize>,
    columns: Vec<usize>,
    /// Of the core that is left after the steps, by column and row: A⁻¹·det A.
    adjugate: Vec<Vec<NodeId>>,
    /// 1/det A of the core.
    reciprocal: NodeId,
    pub(super) guards: Vec<Guard>,
}

/// Entries by row and column that are not identically zero.
type Entries = BTreeMap<usize, BTreeMap<usize, NodeId>>;

impl BlockFactors {
    /// Factors the block of the given rows and columns; `None` where it is singular in every state.
    pub(super) fn new(
        g: &mut Graph,
        jacobian: &SparseMatrix,
        rows: &[usize],
        columns: &[usize],
    ) -> Option<Self> {
        let mut left: Entries = rows
            .iter()
            .map(|r| {
                let inside = jacobian.rows[*r].iter().filter(|(c, _)| columns.contains(c));
                (*r, inside.map(|(c, x)| (*c, *x)).collect())
            })
            .collect();
        if let Some(inverse) = Self::orthogonal(g, jacobian, rows, columns) {
            return Some(inverse);
        }
        let mut steps = Vec::new();
        let mut guards = Vec::new();
        while let Some((row, column)) = next_pivot(g, &left) {
            let step = eliminate(g, &mut left, row, column, &mut guards)?;
            steps.push(step);
        }
        let core_rows: Vec<usize> = left.keys().copied().collect();
        let taken: Vec<usize> = steps.iter().map(|s| s.column).collect();
        let core_columns: Vec<usize> = columns.iter().copied().filter(|c| !taken.contains(c)).collect();
        let zero = g.zero();
        let core: Vec<Vec<NodeId>> = core_rows
            .iter()
            .map(|r| core_columns.iter().map(|c| left[r].get(c).copied().unwrap_or(zero)).collect())
            .collect();
        let (adjugate, determinant) = cofactors(g, &core);
        let one = g.one();
        let reciprocal = g.div(one, determinant)?;
        if g.as_number(determinant).is_none() {
            let whole = steps.is_empty().then_some(jacobian);
            guards.push(guard(g, determinant, &core, (&core_rows, &core_columns), whole));
        }
        Some(Self { steps, rows: core_rows, columns: core_columns, adjugate, reciprocal, guards })
    }

    /// Rows at right angles to each other, more than cofactors serve: A⁻¹ = Aᵀ(A Aᵀ)⁻¹ with a diagonal A Aᵀ,
    /// as for angular velocities by Euler parameters beside the rate of their norm.
    fn orthogonal(g: &mut Graph, jacobian: &SparseMatrix, rows: &[usize], columns: &[usize]) -> Option<Self> {
        let n = rows.len();
        if n <= MOST_BY_COFACTORS {
            return None;
        }
        let zero = g.zero();
        let dense: Vec<Vec<NodeId>> = rows
            .iter()
            .map(|r| columns.iter().map(|c| jacobian.rows[*r].get(c).copied().unwrap_or(zero)).collect())
            .collect();
        // On a copy, so that products that are not wanted leave no trace.
        let mut trial = g.clone();
        let apart = |(i, j): (usize, usize)| {
            let product = dot(&mut trial, &dense[i], &dense[j]);
            trial.is_zero(product)
        };
        if !(0..n).flat_map(|i| (0..i).map(move |j| (i, j))).all(apart) {
            return None;
        }
        let (mut guards, mut adjugate) = (Vec::new(), vec![vec![zero; n]; n]);
        for (i, row) in dense.iter().enumerate() {
            let square = dot(g, row, row);
            if g.as_number(square).is_none() {
                // Below nothing but zero itself: rows at right angles are as independent as they are long.
                guards.push(Guard {
                    of: Guarded::Row(rows[i]),
                    pivot: square,
                    scale: square,
                    tolerance: LEAST_DETERMINANT_RATIO,
                });
            }
            let one = g.one();
            let reciprocal = g.div(one, square)?;
            for (column, entry) in adjugate.iter_mut().zip(row) {
                column[i] = g.mul(reciprocal, *entry);
            }
        }
        let (rows, columns, reciprocal) = (rows.to_vec(), columns.to_vec(), g.one());
        Some(Self { steps: Vec::new(), rows, columns, adjugate, reciprocal, guards })
    }

    /// x by column with A x = `right`, that by row; what is not of this block is left alone.
    pub(super) fn solve(&self, g: &mut Graph, mut right: Values) -> Values {
        for step in &self.steps {
            let value = right.get(g, step.row);
            for (row, l) in &step.below {
                right.subtract(g, *row, *l, value);
            }
        }
        let b: Vec<NodeId> = self.rows.iter().map(|r| right.get(g, *r)).collect();
        let mut x = Values::default();
        for (column, cofactors) in self.columns.iter().zip(&self.adjugate) {
            let sum = dot(g, cofactors, &b);
            x.set(*column, g.mul(self.reciprocal, sum));
        }
        for step in self.steps.iter().rev() {
            for (column, u) in &step.right {
                let value = x.get(g, *column);
                right.subtract(g, step.row, *u, value);
            }
            let value = right.get(g, step.row);
            x.set(step.column, g.mul(step.reciprocal, value));
        }
        x
    }

    /// y by row with Aᵀ y = `right`, that by column.
    pub(super) fn solve_transposed(&self, g: &mut Graph, mut right: Values) -> Values {
        let mut y = Values::default();
        for step in &self.steps {
            let own = right.get(g, step.column);
            let value = g.mul(step.reciprocal, own);
            y.set(step.row, value);
            for (column, u) in &step.right {
                right.subtract(g, *column, *u, value);
            }
        }
        let b: Vec<NodeId> = self.columns.iter().map(|c| right.get(g, *c)).collect();
        for (i, row) in self.rows.iter().enumerate() {
            let cofactors: Vec<NodeId> = self.adjugate.iter().map(|of_column| of_column[i]).collect();
            let sum = dot(g, &cofactors, &b);
            y.set(*row, g.mul(self.reciprocal, sum));
        }
        for step in self.steps.iter().rev() {
            for (row, l) in &step.below {
                let value = y.get(g, *row);
                y.subtract(g, step.row, *l, value);
            }
        }
        y
    }
}

/// The next pivot of a block: numbers while more than one unknown is left, anything while more than the core
/// is; fewest products first.
fn next_pivot(g: &Graph, left: &Entries) -> Option<(usize, usize)> {
    let mut count: BTreeMap<usize, usize> = BTreeMap::new();
    left.values().flat_map(|row| row.keys()).for_each(|c| *count.entry(*c).or_default() += 1);
    let entries = left.iter().flat_map(|(r, row)| row.iter().map(move |(c, x)| (*r, *c, row.len(), *x)));
    let rank = |x: NodeId| if g.as_number(x).is_some() { 0 } else { 1 + u8::from(!g.is_constant(x)) };
    entries
        .filter(|(.., x)| left.len() > if rank(*x) == 0 { 1 } else { MOST_BY_COFACTORS })
        .min_by_key(|(r, c, length, x)| (rank(*x) > 0, (length - 1) * (count[c] - 1), rank(*x), *r, *c))
        .map(|(r, c, ..)| (r, c))
}

fn eliminate(
    g: &mut Graph,
    left: &mut Entries,
    row: usize,
    column: usize,
    guards: &mut Vec<Guard>,
) -> Option<EliminationStep> {
    let mut right = left.remove(&row)?;
    let pivot = right[&column];
    if g.as_number(pivot).is_none() {
        let entries: Vec<NodeId> = right.values().copied().collect();
        guards.push(Guard {
            of: Guarded::Row(row),
            pivot: g.mul(pivot, pivot),
            scale: dot(g, &entries, &entries),
            tolerance: LEAST_DETERMINANT_RATIO * LEAST_DETERMINANT_RATIO,
        });
    }
    right.remove(&column);
    let one = g.one();
    let reciprocal = g.div(one, pivot)?;
    let mut below = Vec::new();
    for (r, entries) in left.iter_mut() {
        let Some(entry) = entries.remove(&column) else { continue };
        let l = g.mul(reciprocal, entry);
        below.push((*r, l));
        for (c, u) in &right {
            let product = g.mul(l, *u);
            let old = entries.get(c).copied().unwrap_or(g.zero());
            let updated = g.sub(old, product);
            if g.is_zero(updated) {
                entries.remove(c);
            } else {
                entries.insert(*c, updated);
            }
        }
    }
    Some(EliminationStep { row, column, reciprocal, below, right: right.into_iter().collect() })
}

/// The adjugate (by column and row) and the determinant of a matrix of at most three rows.
fn cofactors(g: &mut Graph, a: &[Vec<NodeId>]) -> (Vec<Vec<NodeId>>, NodeId) {
    let n = a.len();
    let mut adjugate = vec![vec![g.one(); n]; n];
    if n > 1 {
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            // The rows and columns in cyclic order make all signs of 3×3 positive.
            let (rows, columns) = match n {
                2 => ([1 - i, 1 - i], [1 - j, 1 - j]),
                _ => ([(i + 1) % 3, (i + 2) % 3], [(j + 1) % 3, (j + 2) % 3]),
            };
            adjugate[j][i] = if n == 2 {
                let entry = a[rows[0]][columns[0]];
                if (i + j) % 2 == 0 { entry } else { g.neg(entry) }
            } else {
                let product = g.mul(a[rows[0]][columns[0]], a[rows[1]][columns[1]]);
                let other = g.mul(a[rows[0]][columns[1]], a[rows[1]][columns[0]]);
                g.sub(product, other)
            };
        }
    }
    let first: Vec<NodeId> = adjugate.iter().map(|of_column| of_column[0]).collect();
    let determinant = dot(g, &a[0], &first);
    (adjugate, determinant)
}

/// The determinant of what is left of a block beside the norms of its columns, det² against Π‖column‖². For
/// links of given length the norms are constants and the ratio is the sine of an angle. Where a norm varies
/// it could vanish with the determinant, so the rows count too.
fn guard(
    g: &mut Graph,
    determinant: NodeId,
    core: &[Vec<NodeId>],
    (rows, columns): (&[usize], &[usize]),
    whole: Option<&SparseMatrix>,
) -> Guard {
    let (mut scale, mut varies) = (g.one(), false);
    for (j, column) in columns.iter().enumerate() {
        let mut norm = norm_of_column(g, core, j);
        if let Some(jacobian) = whole
            && (rows.len() == 1 || !g.is_constant(norm))
        {
            let all: Vec<NodeId> = jacobian.column(*column).map(|(_, x)| x).collect();
            let longer = dot(g, &all, &all);
            if rows.len() == 1 || g.is_constant(longer) {
                norm = longer;
            }
        }
        varies |= !g.is_constant(norm);
        scale = g.mul(scale, norm);
    }
    if varies {
        let mut by_rows = g.one();
        for (i, row) in rows.iter().enumerate() {
            let entries = whole.map_or_else(|| core[i].clone(), |j| j.rows[*row].values().copied().collect());
            let norm = dot(g, &entries, &entries);
            by_rows = g.mul(by_rows, norm);
        }
        scale = g.add(scale, by_rows);
    }
    let pivot = g.mul(determinant, determinant);
    Guard {
        of: Guarded::Row(rows[0]),
        pivot,
        scale,
        tolerance: LEAST_DETERMINANT_RATIO * LEAST_DETERMINANT_RATIO,
    }
}

/// ‖column j‖², or, where that is a constant and this is not, ‖column j ± another column‖²: the determinant
/// stays the same. The angle of a link relative to another moves both.
fn norm_of_column(g: &mut Graph, core: &[Vec<NodeId>], j: usize) -> NodeId {
    let own: Vec<NodeId> = core.iter().map(|row| row[j]).collect();
    let norm = dot(g, &own, &own);
    if g.is_constant(norm) {
        return norm;
    }
    for (k, add) in (0..core.len()).filter(|k| *k != j).flat_map(|k| [(k, false), (k, true)]) {
        let other: Vec<NodeId> = core.iter().map(|row| row[k]).collect();
        let length = dot(g, &other, &other);
        let combine = |g: &mut Graph, a, b| if add { g.add(a, b) } else { g.sub(a, b) };
        let both: Vec<NodeId> = own.iter().zip(&other).map(|(a, b)| combine(g, *a, *b)).collect();
        let shorter = dot(g, &both, &both);
        // Only by a column that is itself left alone.
        if g.is_constant(length) && g.is_constant(shorter) {
            return shorter;
        }
    }
    norm
}

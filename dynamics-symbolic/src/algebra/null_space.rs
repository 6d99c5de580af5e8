//! Independent coordinates: with q̈ = R q̈_i + s, Φ_q R = 0, the equations of motion are
//!
//!   (Rᵀ M R) q̈_i = Rᵀ (Q − M s)        λ from the dependent rows of M q̈ − Q = Φ_qᵀλ
//!
//! The dependent columns of Φ_q are brought to block triangular form, so that R and s follow by
//! substitution, block by block: a loop of a mechanism after the other. λ follows from the transposed blocks
//! in the opposite order.

use crate::calculus::remove_coordinates;
use crate::graph::{Graph, NodeId};

use super::block::BlockFactors;
use super::ldl::Factors;
use super::sparse::{SparseMatrix, Values};
use super::structure::{Block, blocks};
use super::unrolled::{Guard, Guarded, LEAST_INERTIA_RATIO};

/// As [`LEAST_DETERMINANT_RATIO`](super::block::LEAST_DETERMINANT_RATIO), of a block that follows two
/// independent coordinates or more. Its pivot p adds an inertia of 1/p² that they have in common. The
/// elimination takes it away again, with the digits of their own inertia, and what follows them is off by 1/p
/// of that: ε/p³ is lost, or 2e-10 at this bound.
const LEAST_COUPLED_RATIO: f64 = 1e-2;

/// A choice of independent coordinates with the blocks that determine the others, in order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Partition {
    pub(super) independent: Vec<usize>,
    pub(super) blocks: Vec<Block>,
}

/// The reduced system.
#[derive(Clone, Debug)]
pub(super) struct NullSpace {
    partition: Partition,
    /// Rows at the head of the Jacobian that are no constraints: speeds, which lead in the place of
    /// independent coordinates.
    speeds: usize,
    mass: SparseMatrix,
    jacobian: SparseMatrix,
    blocks: Vec<BlockFactors>,
    /// Columns of R.
    motions: Vec<Values>,
    /// Columns of M R.
    momenta: Vec<Values>,
    reduced: Factors,
    pub(super) guards: Vec<Guard>,
}

impl NullSpace {
    /// Reduces the system of M (N×N) and Φ_q (R×N); `None` where a block or the reduced inertia is
    /// singular in every state, and where the graph gets more than `most` nodes on the way.
    pub(super) fn new(
        g: &mut Graph,
        mass: &SparseMatrix,
        jacobian: &SparseMatrix,
        partition: &Partition,
        most: usize,
    ) -> Option<Self> {
        let mut blocks = Vec::new();
        for (rows, columns) in &partition.blocks {
            blocks.push(BlockFactors::new(g, jacobian, rows, columns)?);
        }
        let mut motions = Vec::new();
        for i in &partition.independent {
            let mut motion = Values::default();
            motion.set(*i, g.one());
            substitute(g, jacobian, &partition.blocks, &blocks, &mut motion, None);
            motions.push(motion);
            within(g, most)?;
        }
        let leaders = partition.independent.clone();
        Self::led_by(g, mass, jacobian, (partition.clone(), blocks), motions, (0, &leaders), most)
    }

    /// Reduces the system of M (N×N) to speeds: `kinematics` are their gradients by the velocities, then
    /// Φ_q, N rows in all, which determine all velocities. Column r of R is what moves where speed r is 1,
    /// the others and the constraints' rows being 0.
    pub(super) fn by_speeds(
        g: &mut Graph,
        mass: &SparseMatrix,
        kinematics: &SparseMatrix,
        speeds: usize,
    ) -> Option<Self> {
        let n = mass.rows.len();
        let all: Vec<usize> = (0..n).collect();
        let partition = Partition { independent: Vec::new(), blocks: blocks(&kinematics.pattern(), &all)? };
        let mut factors = Vec::new();
        for (rows, columns) in &partition.blocks {
            factors.push(BlockFactors::new(g, kinematics, rows, columns)?);
        }
        let mut motions = Vec::new();
        for r in 0..speeds {
            let unit: Vec<NodeId> = (0..n).map(|k| if k == r { g.one() } else { g.zero() }).collect();
            let mut motion = Values::default();
            substitute(g, kinematics, &partition.blocks, &factors, &mut motion, Some(&unit));
            motions.push(motion);
        }
        // The coordinate by which a vanishing inertia is reported: the first one that the speed contains.
        let leader = |r: usize| kinematics.rows[r].keys().next().copied().unwrap_or(0);
        let leaders: Vec<usize> = (0..speeds).map(leader).collect();
        Self::led_by(g, mass, kinematics, (partition, factors), motions, (speeds, &leaders), usize::MAX)
    }

    /// Reduces M by the columns `motions` of R. A coordinate of `leaders` names each in reports.
    fn led_by(
        g: &mut Graph,
        mass: &SparseMatrix,
        jacobian: &SparseMatrix,
        (partition, blocks): (Partition, Vec<BlockFactors>),
        motions: Vec<Values>,
        (speeds, leaders): (usize, &[usize]),
        most: usize,
    ) -> Option<Self> {
        let momenta: Vec<Values> = motions.iter().map(|motion| times(g, mass, motion)).collect();
        let mut matrix = Vec::new();
        for (i, motion) in motions.iter().enumerate() {
            let row: Vec<NodeId> =
                momenta[..=i].iter().map(|momentum| product(g, motion, momentum)).collect();
            // In a body's own axes its inertia is constant.
            matrix.push(if speeds > 0 { remove_coordinates(g, &row) } else { row });
            within(g, most)?;
        }
        let reduced = Factors::within(g, &matrix, most)?;
        let mut guards = Vec::new();
        for ((_, columns), block) in partition.blocks.iter().zip(&blocks) {
            let follows = |motion: &&Values| columns.iter().any(|c| !g.is_zero(motion.get(g, *c)));
            let coupled = motions.iter().filter(follows).count() > 1;
            let least = if coupled { LEAST_COUPLED_RATIO * LEAST_COUPLED_RATIO } else { 0.0 };
            guards.extend(block.guards.iter().map(|guard| {
                let of = match guard.of {
                    // Speeds are reported by the coordinates that they move.
                    Guarded::Row(row) if row < speeds => Guarded::Coordinate(columns[0]),
                    Guarded::Row(row) => Guarded::Row(row - speeds),
                    of => of,
                };
                Guard { of, tolerance: guard.tolerance.max(least), ..*guard }
            }));
        }
        let pivots = reduced.pivots().filter(|(_, pivot)| g.as_number(*pivot).is_none());
        guards.extend(pivots.map(|(i, pivot)| Guard {
            of: Guarded::Coordinate(leaders[i]),
            pivot,
            scale: matrix[i][i],
            tolerance: LEAST_INERTIA_RATIO,
        }));
        let (mass, jacobian) = (mass.clone(), jacobian.clone());
        Some(Self { partition, speeds, mass, jacobian, blocks, motions, momenta, reduced, guards })
    }

    /// Number of speeds that lead; 0 where coordinates do.
    pub(super) fn speeds(&self) -> usize {
        self.speeds
    }

    /// N.
    pub(super) fn coordinates(&self) -> usize {
        self.mass.rows.len()
    }

    /// The right-hand sides of all rows: those of the constraints, after zeros for the speeds.
    fn padded(&self, g: &Graph, right: &[NodeId]) -> Vec<NodeId> {
        let mut all = vec![g.zero(); self.jacobian.rows.len() - right.len()];
        all.extend(right);
        all
    }

    /// The blocks: rows and dependent coordinates.
    pub(super) fn blocks(&self) -> &[Block] {
        &self.partition.blocks
    }

    /// q̈ and λ. Where speeds lead, γ may begin with what of their rates does not come from q̈: every
    /// choice of it gives the same solution, some shorter ones.
    pub(super) fn solve(
        &self,
        g: &mut Graph,
        force: &[NodeId],
        gamma: &[NodeId],
    ) -> (Vec<NodeId>, Vec<NodeId>) {
        let n = force.len();
        let gamma = &self.padded(g, gamma)[..];
        // s, and Q − M s.
        let mut drift = Values::default();
        substitute(g, &self.jacobian, &self.partition.blocks, &self.blocks, &mut drift, Some(gamma));
        let carried = times(g, &self.mass, &drift);
        let mut driving = Values::default();
        for (k, force) in force.iter().enumerate() {
            let inert = carried.get(g, k);
            driving.set(k, g.sub(*force, inert));
        }
        let right: Vec<NodeId> = self.motions.iter().map(|motion| product(g, motion, &driving)).collect();
        let leading = self.reduced.solve(g, &right);
        let mut accelerations: Vec<NodeId> = (0..n).map(|k| drift.get(g, k)).collect();
        if self.speeds > 0 {
            accelerations = self.moved(g, &leading, gamma);
            let multipliers = self.multipliers_by_motions(g, &accelerations, force);
            return (accelerations, multipliers);
        }
        // M q̈ − Q.
        let mut unbalanced: Vec<NodeId> = (0..n).map(|k| driving.get(g, k)).collect();
        unbalanced.iter_mut().for_each(|x| *x = g.neg(*x));
        for (a, (motion, momentum)) in leading.iter().zip(self.motions.iter().zip(&self.momenta)) {
            for (sums, column) in [(&mut accelerations, motion), (&mut unbalanced, momentum)] {
                add_multiple(g, sums, column, *a);
            }
        }
        (accelerations, self.multipliers(g, &unbalanced))
    }

    /// q̈ of speeds that change by `leading` beside what `gamma` says, by one substitution instead of one
    /// for each column of R.
    fn moved(&self, g: &mut Graph, leading: &[NodeId], gamma: &[NodeId]) -> Vec<NodeId> {
        let mut right = gamma.to_vec();
        for (right, own) in right.iter_mut().zip(leading) {
            *right = g.add(*own, *right);
        }
        let mut moved = Values::default();
        substitute(g, &self.jacobian, &self.partition.blocks, &self.blocks, &mut moved, Some(&right));
        (0..gamma.len()).map(|k| moved.get(g, k)).collect()
    }

    /// RᵀM R.
    pub(super) fn inertia(&self, g: &mut Graph) -> Vec<Vec<NodeId>> {
        let row = |g: &mut Graph, motion: &Values| {
            let row: Vec<NodeId> = self.momenta.iter().map(|momentum| product(g, motion, momentum)).collect();
            remove_coordinates(g, &row)
        };
        self.motions.iter().map(|motion| row(g, motion)).collect()
    }

    /// What moves where this row of the Jacobian is 1 and the others are 0: a column of its inverse, where
    /// speeds lead.
    pub(super) fn moved_by(&self, g: &mut Graph, row: usize) -> Vec<NodeId> {
        let n = self.jacobian.rows.len();
        let unit: Vec<NodeId> = (0..n).map(|k| if k == row { g.one() } else { g.zero() }).collect();
        let mut motion = Values::default();
        substitute(g, &self.jacobian, &self.partition.blocks, &self.blocks, &mut motion, Some(&unit));
        (0..n).map(|k| motion.get(g, k)).collect()
    }

    /// δ = R δ_i + s with (Rᵀ M R) δ_i = −(M R)ᵀ s: M itself is not read any more.
    pub(super) fn correct(&self, g: &mut Graph, right: &[NodeId]) -> Vec<NodeId> {
        let right = &self.padded(g, right)[..];
        let mut whole = Values::default();
        substitute(g, &self.jacobian, &self.partition.blocks, &self.blocks, &mut whole, Some(right));
        let against = |g: &mut Graph, momentum: &Values| {
            let inert = product(g, &whole, momentum);
            g.neg(inert)
        };
        let driving: Vec<NodeId> = self.momenta.iter().map(|momentum| against(g, momentum)).collect();
        let leading = self.reduced.solve(g, &driving);
        let mut delta: Vec<NodeId> = (0..self.mass.rows.len()).map(|k| whole.get(g, k)).collect();
        for (a, motion) in leading.iter().zip(&self.motions) {
            add_multiple(g, &mut delta, motion, *a);
        }
        delta
    }

    /// λ of each row as the power of M q̈ − Q along what moves where the row is 1 and all others, the
    /// speeds among them, are 0: often M leaves little of it.
    fn multipliers_by_motions(
        &self,
        g: &mut Graph,
        accelerations: &[NodeId],
        force: &[NodeId],
    ) -> Vec<NodeId> {
        let mut values = Values::default();
        accelerations.iter().enumerate().for_each(|(k, a)| values.set(k, *a));
        let mut multiplier = |row: usize| {
            let mut motion = Values::default();
            self.moved_by(g, row).into_iter().enumerate().for_each(|(k, b)| motion.set(k, b));
            let momentum = times(g, &self.mass, &motion);
            let inert = product(g, &momentum, &values);
            let given = (0..force.len()).fold(g.zero(), |sum, k| {
                let term = motion.get(g, k);
                let term = g.mul(term, force[k]);
                g.add(sum, term)
            });
            g.sub(inert, given)
        };
        (self.speeds..self.jacobian.rows.len()).map(&mut multiplier).collect()
    }

    /// λ with Φ_qᵀλ = `unbalanced` in the dependent coordinates: the blocks transposed, from the last to
    /// the first.
    fn multipliers(&self, g: &mut Graph, unbalanced: &[NodeId]) -> Vec<NodeId> {
        let mut multipliers = vec![None; self.jacobian.rows.len()];
        for ((_, columns), factors) in self.partition.blocks.iter().zip(&self.blocks).rev() {
            let mut right = Values::default();
            for &c in columns {
                right.set(c, unbalanced[c]);
                for (row, entry) in self.jacobian.column(c) {
                    if let Some(known) = multipliers[row] {
                        right.subtract(g, c, entry, known);
                    }
                }
            }
            let found: Vec<(usize, NodeId)> = factors.solve_transposed(g, right).into_entries().collect();
            found.into_iter().for_each(|(row, value)| multipliers[row] = Some(value));
        }
        let zero = g.zero();
        multipliers.into_iter().map(|x| x.unwrap_or(zero)).collect()
    }
}

/// `None` where the graph has more nodes.
fn within(g: &Graph, most: usize) -> Option<()> {
    (g.len() <= most).then_some(())
}

/// Adds the dependent entries to `x` so that Φ_q x = `right` (zero where there is none).
fn substitute(
    g: &mut Graph,
    jacobian: &SparseMatrix,
    blocks: &[Block],
    factors: &[BlockFactors],
    x: &mut Values,
    right: Option<&[NodeId]>,
) {
    for ((rows, columns), factors) in blocks.iter().zip(factors) {
        let mut rest = Values::default();
        for &r in rows {
            rest.set(r, right.map_or(g.zero(), |right| right[r]));
            for (c, entry) in jacobian.rows[r].iter().filter(|(c, _)| !columns.contains(c)) {
                let known = x.get(g, *c);
                rest.subtract(g, r, *entry, known);
            }
        }
        if rows.iter().any(|r| !g.is_zero(rest.get(g, *r))) {
            let found: Vec<(usize, NodeId)> = factors.solve(g, rest).into_entries().collect();
            found.into_iter().for_each(|(c, value)| x.set(c, value));
        }
    }
}

/// A x.
fn times(g: &mut Graph, a: &SparseMatrix, x: &Values) -> Values {
    let mut sums = Values::default();
    let entries: Vec<(usize, NodeId)> = x.entries(g).collect();
    for (j, value) in entries {
        for (i, entry) in a.column(j) {
            let product = g.mul(entry, value);
            let old = sums.get(g, i);
            sums.set(i, g.add(old, product));
        }
    }
    sums
}

/// `sums` + column·a.
fn add_multiple(g: &mut Graph, sums: &mut [NodeId], column: &Values, a: NodeId) {
    let entries: Vec<(usize, NodeId)> = column.entries(g).collect();
    for (k, entry) in entries {
        let product = g.mul(entry, a);
        sums[k] = g.add(sums[k], product);
    }
}

/// xᵀ y.
fn product(g: &mut Graph, x: &Values, y: &Values) -> NodeId {
    let entries: Vec<(usize, NodeId)> = x.entries(g).collect();
    let mut sum = g.zero();
    for (i, value) in entries {
        let other = y.get(g, i);
        let product = g.mul(value, other);
        sum = g.add(sum, product);
    }
    sum
}

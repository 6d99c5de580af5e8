//! Minimal coordinates by coordinate partitioning: some coordinates lead, the constraints give the others.
//!
//! From Φ(q, t) = 0 the dependent coordinates q_D follow from the independent q_I by Newton on the block Φ_D,
//! warm from what they were; from Φ_q q̇ + Φ_t = 0 and A q̇ + b = 0 likewise the dependent velocities, by one
//! linear solve; with nonholonomic rows there are fewer independent velocities than coordinates. Wehage &
//! Haug, J. Mech. Design 104 (1982) 247–255.
//!
//! The blocks are chosen by Gaussian elimination with complete pivoting, coordinates scaled by their inertia
//! and rows to unit length: what is light and moves most becomes dependent. Chosen anew, by
//! [`Embedding::renew`], where the block's conditioning (its least pivot, with rows of Φ_q at unit length)
//! has fallen to seven tenths of what it was, if that helps. Where a block fails — a dead point — states are
//! projected, weighted by masses, and counted.
//!
//! For questions about a state, and for integrators of one's own. Motions let no coordinate lead for longer
//! than a moment: within a step it may turn round, and where two blocks meet what one misses is another's.
//! Measured with DOP853, stages and ends by blocks that were judged at every step: on an elliptic trammel
//! that spins a hundred to two thousand times the error of projection, on pendulums in x and y ten times. See
//! [`Formulation::Embedded`](crate::simulate::Formulation::Embedded).

use super::project::{admit, project_positions, project_velocities};
use super::system::{ModelTerms, RANK_TOLERANCE, scale_coordinates};
use super::{Gradients, borrow_workspace, gradients, holds, system_names};
use crate::error::SolveError;
use crate::linalg::lu::{self, Lu};
use crate::linalg::{WorkMemory, max_abs, norm};
use crate::math::sqrt;
use crate::model::{Constraints, Model, ModelState, Modes, Terms, Vector};

/// Share of the conditioning at its choice to which a block may fall before it is chosen anew. What the
/// independent coordinates miss, the dependent ones miss by as many times more as the block is worse, and a
/// step goes on from there: with a fifth, pendulums in x and y lose one to two digits at the same tolerance
/// and take a fifth more steps.
const DEGRADED: f64 = 0.7;
/// By how much a block must be better than the one in use to be chosen instead.
const WORTH: f64 = 1.05;
/// Conditioning below which a block is not used.
const USELESS: f64 = 1e-9;
/// Most Newton steps for dependent coordinates.
const MOST_NEWTON_STEPS: u32 = 12;

/// Which rows determine which coordinates.
#[derive(Clone, Copy, Debug)]
struct Partition<V, R> {
    /// Number of rows that hold.
    active: usize,
    rank: usize,
    /// Indices, as numbers: their count is that of the rows, whatever the model.
    rows: R,
    columns: R,
    /// Of the coordinates, when the partition was chosen: what the conditioning is judged in.
    scale: V,
    /// Least pivot then.
    quality: f64,
    /// Whether the determinant of the block was negative then.
    negative: bool,
}

/// Independent and dependent coordinates and velocities of a model.
#[derive(Clone, Copy, Debug)]
pub struct Embedding<M: Constraints> {
    positions: PartitionOf<M>,
    velocities: PartitionOf<M>,
    modes: Modes,
    /// How often the blocks were chosen anew.
    pub renewals: u64,
    /// How often a block failed and the projection took over.
    pub projections: u64,
    /// The worst conditioning that a block was used with: its least pivot, with rows of Φ_q at unit length.
    pub worst: f64,
}

/// Memory that an embedding takes.
pub(super) const fn memory(n: usize, r: usize) -> usize {
    let choice = n * n + 3 * n + n * r + 3 * r;
    let block = r * r + 4 * r + lu::memory(r) + gradients::memory(n, r);
    if choice > block { choice } else { block }
}

impl<M: Constraints> Embedding<M> {
    /// Chooses the dependent coordinates and velocities at a state, which should satisfy the constraints.
    ///
    /// # Errors
    /// A constraint that is not finite.
    pub fn new(model: &M, state: &M::State, workspace: &mut [f64]) -> Result<Self, SolveError> {
        let (positions, velocities) = Self::choose(model, state, workspace)?;
        let worst = positions.quality.min(velocities.quality);
        Ok(Self { positions, velocities, modes: state.modes(), renewals: 0, projections: 0, worst })
    }

    fn choose(model: &M, state: &M::State, workspace: &mut [f64]) -> Result<PartitionPair<M>, SolveError> {
        let modes = state.modes();
        let velocities = partition(model, state, &|row| holds::<M>(modes, row), workspace)?;
        if M::Residual::LEN == M::Rows::LEN {
            return Ok((velocities, velocities));
        }
        let holonomic = |row: usize| row < M::Residual::LEN && holds::<M>(modes, row);
        Ok((partition(model, state, &holonomic, workspace)?, velocities))
    }

    /// Indices of the coordinates that the constraints determine.
    pub fn dependent_coordinates(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.positions.rank).map(|i| self.positions.columns[i] as usize)
    }

    /// Indices of the velocities that the constraints determine.
    pub fn dependent_velocities(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.velocities.rank).map(|i| self.velocities.columns[i] as usize)
    }

    /// Rows by which the dependent velocities are determined.
    #[cfg(feature = "alloc")]
    pub(super) fn chosen_rows(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.velocities.rank).map(|i| self.velocities.rows[i] as usize)
    }

    /// Computes the dependent coordinates and velocities from the independent ones, which stay, at the
    /// state's time.
    ///
    /// # Errors
    /// [`SolveError::OffConstraint`] where the constraints cannot be satisfied near the state, a constraint
    /// that is not finite.
    pub fn restore(
        &mut self,
        model: &M,
        state: &mut M::State,
        workspace: &mut [f64],
    ) -> Result<(), SolveError> {
        if !self.restore_by_blocks(model, state, workspace)? {
            self.projections += 1;
            let constants = model.constants()?;
            project_positions(model, &constants, state, workspace)?;
            project_velocities(model, &constants, state, workspace)?;
        }
        Ok(())
    }

    /// Whether the blocks gave the dependent coordinates and velocities; else the state is what it was.
    fn restore_by_blocks(
        &mut self,
        model: &M,
        state: &mut M::State,
        workspace: &mut [f64],
    ) -> Result<bool, SolveError> {
        if state.modes() != self.modes {
            // Other constraints: another partition.
            let others = Self::new(model, state, workspace)?;
            *self = Self {
                renewals: self.renewals + 1,
                projections: self.projections,
                worst: self.worst.min(others.worst),
                ..others
            };
        }
        let start = *state.q();
        let restored = self.restore_positions(model, state, workspace)?
            && self.restore_velocities(model, state, workspace)?;
        if !restored {
            *state.q_mut() = start;
        }
        Ok(restored)
    }

    /// Newton on the dependent coordinates; whether it converged.
    fn restore_positions(
        &mut self,
        model: &M,
        state: &mut M::State,
        workspace: &mut [f64],
    ) -> Result<bool, SolveError> {
        let k = self.positions.rank;
        let mut size = f64::INFINITY;
        let mut change = 1.0;
        for _ in 0..MOST_NEWTON_STEPS {
            let residual = model.residual(state);
            let before = core::mem::replace(&mut size, max_abs(self.pick(&residual, workspace)));
            if !size.is_finite() {
                return Err(self.not_finite(&residual));
            }
            // The next correction would be rounding, or no longer gains anything.
            let next = change * (size / before);
            let settled = next <= 2.0 * f64::EPSILON || (change <= 1e-7 && size >= 0.5 * before);
            if size == 0.0 || (before.is_finite() && settled) {
                return Ok(true);
            }
            let mut memory = borrow_workspace(workspace, M::Vector::LEN, M::Rows::LEN);
            // What was picked above lies at the start.
            let (right, delta) = (memory.take(k), memory.take(k));
            let block = self.positions.factor(model, state, &mut memory);
            self.worst = self.worst.min(block.quality());
            if block.fails(&self.positions) {
                return Ok(false);
            }
            block.solve(right, delta);
            change = 0.0;
            for (i, delta) in delta.iter().enumerate() {
                let x = &mut state.q_mut()[self.positions.columns[i] as usize];
                *x -= delta;
                change = crate::math::max(change, delta.abs() / (1.0 + x.abs()));
            }
            if change.is_nan() || change > 1.0 {
                return Ok(false);
            }
        }
        Ok(false)
    }

    /// One linear solve for the dependent velocities; whether the block allowed it.
    fn restore_velocities(
        &mut self,
        model: &M,
        state: &mut M::State,
        workspace: &mut [f64],
    ) -> Result<bool, SolveError> {
        let k = self.velocities.rank;
        let residual = model.velocity_residual(state);
        let mut memory = borrow_workspace(workspace, M::Vector::LEN, M::Rows::LEN);
        let (right, delta) = (memory.take(k), memory.take(k));
        (0..k).for_each(|i| right[i] = residual[self.velocities.rows[i] as usize]);
        if !max_abs(right).is_finite() {
            return Err(self.not_finite(&residual));
        }
        let block = self.velocities.factor(model, state, &mut memory);
        self.worst = self.worst.min(block.quality());
        if block.fails(&self.velocities) {
            return Ok(false);
        }
        block.solve(right, delta);
        for (i, delta) in delta.iter().enumerate() {
            state.u_mut()[self.velocities.columns[i] as usize] -= delta;
        }
        Ok(true)
    }

    /// The chosen rows' values, at the start of the workspace.
    fn pick<'w>(&self, values: &impl Vector, workspace: &'w mut [f64]) -> &'w [f64] {
        let k = self.positions.rank;
        (0..k).for_each(|i| workspace[i] = values[self.positions.rows[i] as usize]);
        &workspace[..k]
    }

    #[cold]
    fn not_finite(&self, values: &impl Vector) -> SolveError {
        let row = values.as_slice().iter().position(|x| !x.is_finite()).unwrap_or(0);
        SolveError::ConstraintNotFinite { row: system_names::<M>().row(row) }
    }

    /// Chooses the blocks anew if they lack rows or their conditioning has degraded, and better ones exist:
    /// to be called at accepted steps. Returns whether they changed: rows that are determined from here on
    /// want the state to be restored again.
    ///
    /// # Errors
    /// As [`Embedding::new`]; [`SolveError::OffConstraint`] where rows that repeat the chosen ones contradict
    /// them now.
    pub fn renew(&mut self, model: &M, state: &M::State, workspace: &mut [f64]) -> Result<bool, SolveError> {
        let quality = |partition: &PartitionOf<M>, workspace: &mut [f64]| {
            let mut memory = borrow_workspace(workspace, M::Vector::LEN, M::Rows::LEN);
            let block = partition.factor(model, state, &mut memory);
            if block.fails(partition) { 0.0 } else { block.quality() }
        };
        let now = [quality(&self.positions, workspace), quality(&self.velocities, workspace)];
        // At a change point a block lacks rows, which are there again where the motion goes on.
        let fine = |now: f64, partition: &PartitionOf<M>| {
            !partition.lacks() && now > 0.0 && now >= DEGRADED * partition.quality
        };
        if fine(now[0], &self.positions) && fine(now[1], &self.velocities) {
            return Ok(false);
        }
        let (positions, velocities) = Self::choose(model, state, workspace)?;
        let then = [quality(&positions, workspace), quality(&velocities, workspace)];
        let more = positions.rank > self.positions.rank || velocities.rank > self.velocities.rank;
        let changed = more || (0..2).any(|k| then[k] > WORTH * now[k]);
        if changed {
            (self.positions, self.velocities) = (positions, velocities);
            self.renewals += 1;
        }
        if self.positions.lacks() {
            admit(model, state, "positions", workspace)?;
        }
        if self.velocities.lacks() {
            admit(model, state, "velocities", workspace)?;
        }
        Ok(changed)
    }
}

type PartitionOf<M> = Partition<<M as Model>::Vector, <M as Constraints>::Rows>;
type PartitionPair<M> = (PartitionOf<M>, PartitionOf<M>);

impl<V: Vector, R: Vector> Partition<V, R> {
    /// Whether rows that hold are not in it, for they repeat those that are.
    fn lacks(&self) -> bool {
        self.rank < self.active
    }

    /// The block of chosen rows and columns, factored.
    fn factor<'w, M: Constraints<Vector = V, Rows = R>>(
        &self,
        model: &M,
        state: &M::State,
        memory: &mut WorkMemory<'w>,
    ) -> FactoredBlock<'w> {
        let k = self.rank;
        let (block, weight, scale) = (memory.take(k * k), memory.take(k), memory.take(k));
        let gradients = Gradients::alone(model, state, memory.take(gradients::memory(V::LEN, R::LEN)));
        (0..k).for_each(|j| scale[j] = self.scale[self.columns[j] as usize]);
        for (i, row) in block.chunks_exact_mut(k.max(1)).enumerate() {
            let gradient = gradients.row(self.rows[i] as usize);
            let of = |j: usize| gradient[j] * self.scale[j];
            weight[i] = 1.0 / sqrt((0..V::LEN).map(|j| of(j) * of(j)).sum());
            (0..k).for_each(|j| row[j] = weight[i] * of(self.columns[j] as usize));
        }
        let factored = Lu::new(block, k, memory);
        FactoredBlock { factored, weight, scale }
    }
}

/// A factored block.
struct FactoredBlock<'w> {
    factored: Lu<'w>,
    weight: &'w mut [f64],
    scale: &'w mut [f64],
}

impl FactoredBlock<'_> {
    /// 1 where nothing is dependent.
    fn quality(&self) -> f64 {
        if self.factored.least > 1.0 { 1.0 } else { self.factored.least }
    }

    /// Whether it is of no use or not finite, or a dead point lies between here and where it was chosen:
    /// beyond it, what leads has turned, and the others follow from it on another branch.
    fn fails<V: Vector, R: Vector>(&self, partition: &Partition<V, R>) -> bool {
        let quality = self.quality();
        quality.is_nan() || quality < USELESS || self.factored.negative != partition.negative
    }

    /// Φ_D δ = right, which is overwritten.
    fn solve(&self, right: &mut [f64], delta: &mut [f64]) {
        right.iter_mut().zip(&*self.weight).for_each(|(x, weight)| *x *= weight);
        self.factored.solve(right, delta);
        delta.iter_mut().zip(&*self.scale).for_each(|(x, scale)| *x *= scale);
    }
}

/// Chooses rows and columns for the rows of Φ_q that `active` admits.
fn partition<M: Constraints>(
    model: &M,
    state: &M::State,
    active: &dyn Fn(usize) -> bool,
    workspace: &mut [f64],
) -> Result<PartitionOf<M>, SolveError> {
    let (n, r) = (M::Vector::LEN, M::Rows::LEN);
    let mut memory = borrow_workspace(workspace, n, r);
    let ModelTerms { mass, force, jacobian: matrix, gamma } = ModelTerms::new(n, r, &mut memory);
    gradients::terms(model, state, &mut Terms { mass, force, jacobian: matrix, gamma }, memory.take(r));
    let scale = memory.take(n);
    let (mut rows, mut columns) = (memory.indices(r), memory.indices(n));
    let mut m = 0;
    for row in (0..r).filter(|row| active(*row)) {
        matrix.copy_within(row * n..(row + 1) * n, m * n);
        if !max_abs(&matrix[m * n..(m + 1) * n]).is_finite() {
            return Err(SolveError::ConstraintNotFinite { row: system_names::<M>().row(row) });
        }
        rows.set(m, row);
        m += 1;
    }
    scale_coordinates(mass, &matrix[..m * n], scale);
    for row in matrix[..m * n].chunks_exact_mut(n) {
        row.iter_mut().zip(&*scale).for_each(|(x, s)| *x *= s);
        let length = norm(row);
        // A row that has vanished, at a change point, is never chosen.
        if length > 0.0 {
            row.iter_mut().for_each(|x| *x /= length);
        }
    }
    let (rank, _) = lu::choose(&mut matrix[..m * n], m, n, RANK_TOLERANCE, &mut rows, &mut columns);
    let mut chosen = Partition {
        active: m,
        rank,
        rows: M::Rows::zeros(),
        columns: M::Rows::zeros(),
        scale: M::Vector::zeros(),
        quality: 0.0,
        negative: false,
    };
    chosen.scale.as_mut_slice().copy_from_slice(scale);
    for i in 0..rank {
        chosen.rows[i] = rows.get(i) as f64;
        chosen.columns[i] = columns.get(i) as f64;
    }
    let mut memory = borrow_workspace(workspace, n, r);
    // A block that is taken because there is no better one is judged by itself.
    let block = chosen.factor(model, state, &mut memory);
    (chosen.quality, chosen.negative) = (block.quality(), block.factored.negative);
    Ok(chosen)
}

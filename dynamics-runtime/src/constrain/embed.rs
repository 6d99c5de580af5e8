//! Minimal coordinates by coordinate partitioning: independent coordinates, and dependent ones that follow
//! from the constraints.
//!
//! The dependent coordinates q_D follow from the independent q_I by Newton's method on the block Φ_D of
//! Φ(q, t) = 0, started from their last values. The dependent velocities follow likewise from Φ_q
//! q̇ + Φ_t = 0 and A q̇ + b = 0, by one linear solve. With nonholonomic rows there are fewer independent
//! velocities than coordinates. Source: Wehage & Haug, J. Mech. Design 104 (1982) 247–255.
//!
//! The blocks are chosen by Gaussian elimination with complete pivoting, coordinates scaled by their inertia
//! and rows to unit length, so that light coordinates that move most become dependent. The quality of a block
//! is its least pivot, with rows of Φ_q at unit length. [`Embedding::renew`] chooses new blocks where the
//! quality has fallen to seven tenths of what it was, if that helps. Where a block fails, at a dead point,
//! states are projected, weighted by masses, and counted.
//!
//! This is for questions about a state, and for users' own integrators. Runs use the blocks only within a
//! step, because a step may pass a dead point, and where blocks change the errors of the independent
//! coordinates move to others. Measured with DOP853, with stages and ends by blocks that were judged at every
//! step: the error is a hundred to two thousand times that of projection on an elliptic trammel that spins,
//! ten times on pendulums in x and y. See [`Formulation::Embedded`](crate::simulate::Formulation::Embedded).

use super::project::{
    ConstraintLevel, check_admissible, is_converged, project_positions, project_velocities,
};
use super::system::{ModelTerms, RANK_TOLERANCE, scale_coordinates};
use super::{Gradients, borrow_workspace, gradients, holds, system_names};
use crate::error::SolveError;
use crate::linalg::lu::{self, Lu};
use crate::linalg::{WorkspaceSlices, max_abs, norm};
use crate::math::sqrt;
use crate::model::{ActiveSet, Constraints, Model, ModelState, Terms, Vector};

/// A new block is looked for where the quality has fallen to this part of that at its choice. The dependent
/// coordinates have the errors of the independent ones, amplified as the block gets worse, and the next step
/// starts from them. Measured with a fifth instead: pendulums in x and y lose one to two digits at the same
/// tolerance and take a fifth more steps.
const RENEWAL_QUALITY_RATIO: f64 = 0.7;
/// Ratio of qualities from which on a new block replaces the old one. It keeps two equally good blocks from
/// alternating.
const RENEWAL_GAIN: f64 = 1.05;
/// Quality below which a block is not used: the dependent coordinates would lose nine of sixteen digits.
const MIN_BLOCK_QUALITY: f64 = 1e-9;
/// Most Newton steps for dependent coordinates. A block that needs more fails, and the state is projected.
const MAX_NEWTON_STEPS: u32 = 12;

/// Which rows determine which dependent coordinates.
#[derive(Clone, Copy, Debug)]
struct Partition<V, R> {
    /// Number of active rows.
    active: usize,
    rank: usize,
    /// Indices, stored as `f64`: `M::Rows` is the only array with one entry per row.
    rows: R,
    columns: R,
    /// Scales of the coordinates when the partition was chosen, in which its quality is measured.
    scale: V,
    /// Least pivot of the block then.
    quality: f64,
    /// Whether the determinant of the block was negative then.
    negative: bool,
}

/// Independent and dependent coordinates and velocities of a model.
#[derive(Clone, Copy, Debug)]
pub struct Embedding<M: Constraints> {
    positions: PartitionOf<M>,
    velocities: PartitionOf<M>,
    active_set: ActiveSet,
    /// How often other blocks were chosen.
    pub renewals: u64,
    /// How often a block failed and the state was projected instead.
    pub projections: u64,
    /// The lowest quality of a block that was used: its least pivot, with rows of Φ_q at unit length.
    pub worst: f64,
}

/// Length of the workspace of an embedding.
pub(super) const fn workspace_len(n: usize, r: usize) -> usize {
    let choice = n * n + 3 * n + n * r + 3 * r;
    let block = r * r + 4 * r + lu::workspace_len(r) + gradients::workspace_len(n, r);
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
        Ok(Self { positions, velocities, active_set: state.active_set(), renewals: 0, projections: 0, worst })
    }

    fn choose(model: &M, state: &M::State, workspace: &mut [f64]) -> Result<PartitionPair<M>, SolveError> {
        let active_set = state.active_set();
        let velocities = partition(model, state, &|row| holds::<M>(active_set, row), workspace)?;
        if M::Residual::LEN == M::Rows::LEN {
            return Ok((velocities, velocities));
        }
        let holonomic = |row: usize| row < M::Residual::LEN && holds::<M>(active_set, row);
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

    /// Computes the dependent coordinates and velocities by the blocks; false where these fail, with the
    /// state as it was.
    fn restore_by_blocks(
        &mut self,
        model: &M,
        state: &mut M::State,
        workspace: &mut [f64],
    ) -> Result<bool, SolveError> {
        if state.active_set() != self.active_set {
            // Other constraints are active: another partition.
            let renewed = Self::new(model, state, workspace)?;
            *self = Self {
                renewals: self.renewals + 1,
                projections: self.projections,
                worst: self.worst.min(renewed.worst),
                ..renewed
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
        for _ in 0..MAX_NEWTON_STEPS {
            let residual = model.residual(state);
            let last_size = core::mem::replace(&mut size, max_abs(self.chosen_values(&residual, workspace)));
            if !size.is_finite() {
                return Err(self.not_finite(&residual));
            }
            if size == 0.0 || (last_size.is_finite() && is_converged(change, last_size, size)) {
                return Ok(true);
            }
            let mut slices = borrow_workspace(workspace, M::Vector::LEN, M::Rows::LEN);
            // The residuals of the chosen rows are at the start of the workspace.
            let (right, delta) = (slices.take(k), slices.take(k));
            let block = self.positions.factor(model, state, &mut slices);
            self.worst = self.worst.min(block.quality());
            if block.has_failed(&self.positions) {
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
        let mut slices = borrow_workspace(workspace, M::Vector::LEN, M::Rows::LEN);
        let (right, delta) = (slices.take(k), slices.take(k));
        (0..k).for_each(|i| right[i] = residual[self.velocities.rows[i] as usize]);
        if !max_abs(right).is_finite() {
            return Err(self.not_finite(&residual));
        }
        let block = self.velocities.factor(model, state, &mut slices);
        self.worst = self.worst.min(block.quality());
        if block.has_failed(&self.velocities) {
            return Ok(false);
        }
        block.solve(right, delta);
        for (i, delta) in delta.iter().enumerate() {
            state.u_mut()[self.velocities.columns[i] as usize] -= delta;
        }
        Ok(true)
    }

    /// The chosen rows' values, at the start of the workspace.
    fn chosen_values<'w>(&self, values: &impl Vector, workspace: &'w mut [f64]) -> &'w [f64] {
        let k = self.positions.rank;
        (0..k).for_each(|i| workspace[i] = values[self.positions.rows[i] as usize]);
        &workspace[..k]
    }

    #[cold]
    fn not_finite(&self, values: &impl Vector) -> SolveError {
        let row = values.as_slice().iter().position(|x| !x.is_finite()).unwrap_or(0);
        SolveError::ConstraintNotFinite { row: system_names::<M>().row(row) }
    }

    /// Chooses new blocks where the old ones lack rows or have lost quality, if there are better ones. To be
    /// called at accepted steps. Returns whether the blocks changed: rows that belong to a block from here on
    /// then require the state to be restored again.
    ///
    /// # Errors
    /// As [`Embedding::new`]; [`SolveError::OffConstraint`] where rows that repeat the chosen ones contradict
    /// them now.
    pub fn renew(&mut self, model: &M, state: &M::State, workspace: &mut [f64]) -> Result<bool, SolveError> {
        let block_quality = |partition: &PartitionOf<M>, workspace: &mut [f64]| {
            let mut slices = borrow_workspace(workspace, M::Vector::LEN, M::Rows::LEN);
            let block = partition.factor(model, state, &mut slices);
            if block.has_failed(partition) { 0.0 } else { block.quality() }
        };
        let quality_now =
            [block_quality(&self.positions, workspace), block_quality(&self.velocities, workspace)];
        // At a change point a block lacks rows, which are independent again where the motion goes on.
        let is_good = |quality_now: f64, partition: &PartitionOf<M>| {
            !partition.lacks_rows()
                && quality_now > 0.0
                && quality_now >= RENEWAL_QUALITY_RATIO * partition.quality
        };
        if is_good(quality_now[0], &self.positions) && is_good(quality_now[1], &self.velocities) {
            return Ok(false);
        }
        let (positions, velocities) = Self::choose(model, state, workspace)?;
        let new_quality = [block_quality(&positions, workspace), block_quality(&velocities, workspace)];
        let has_more_rows = positions.rank > self.positions.rank || velocities.rank > self.velocities.rank;
        let changed = has_more_rows || (0..2).any(|k| new_quality[k] > RENEWAL_GAIN * quality_now[k]);
        if changed {
            (self.positions, self.velocities) = (positions, velocities);
            self.renewals += 1;
        }
        if self.positions.lacks_rows() {
            check_admissible(model, state, ConstraintLevel::Positions, workspace)?;
        }
        if self.velocities.lacks_rows() {
            check_admissible(model, state, ConstraintLevel::Velocities, workspace)?;
        }
        Ok(changed)
    }
}

type PartitionOf<M> = Partition<<M as Model>::Vector, <M as Constraints>::Rows>;
type PartitionPair<M> = (PartitionOf<M>, PartitionOf<M>);

impl<V: Vector, R: Vector> Partition<V, R> {
    /// Whether active rows are not in the block, because they repeat those that are.
    fn lacks_rows(&self) -> bool {
        self.rank < self.active
    }

    /// The block of chosen rows and columns, factored.
    fn factor<'w, M: Constraints<Vector = V, Rows = R>>(
        &self,
        model: &M,
        state: &M::State,
        workspace: &mut WorkspaceSlices<'w>,
    ) -> FactoredBlock<'w> {
        let k = self.rank;
        let (block, weight, scale) = (workspace.take(k * k), workspace.take(k), workspace.take(k));
        let gradients =
            Gradients::alone(model, state, workspace.take(gradients::workspace_len(V::LEN, R::LEN)));
        (0..k).for_each(|j| scale[j] = self.scale[self.columns[j] as usize]);
        for (i, row) in block.chunks_exact_mut(k.max(1)).enumerate() {
            let gradient = gradients.row(self.rows[i] as usize);
            let of = |j: usize| gradient[j] * self.scale[j];
            weight[i] = 1.0 / sqrt((0..V::LEN).map(|j| of(j) * of(j)).sum());
            (0..k).for_each(|j| row[j] = weight[i] * of(self.columns[j] as usize));
        }
        let factored = Lu::new(block, k, workspace);
        FactoredBlock { factored, weight, scale }
    }
}

/// The block Φ_D of a partition, scaled and factored.
struct FactoredBlock<'w> {
    factored: Lu<'w>,
    weight: &'w mut [f64],
    scale: &'w mut [f64],
}

impl FactoredBlock<'_> {
    /// The least pivot; 1 where nothing is dependent.
    fn quality(&self) -> f64 {
        if self.factored.least > 1.0 { 1.0 } else { self.factored.least }
    }

    /// Whether the block is singular or not finite, or a dead point lies between here and where it was
    /// chosen. Beyond a dead point the determinant has the other sign, the independent coordinate has turned
    /// round, and the dependent ones would follow on another branch.
    fn has_failed<V: Vector, R: Vector>(&self, partition: &Partition<V, R>) -> bool {
        let quality = self.quality();
        quality.is_nan() || quality < MIN_BLOCK_QUALITY || self.factored.negative != partition.negative
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
    let mut slices = borrow_workspace(workspace, n, r);
    let ModelTerms { mass, force, jacobian: matrix, gamma } = ModelTerms::new(n, r, &mut slices);
    gradients::terms(model, state, &mut Terms { mass, force, jacobian: matrix, gamma }, slices.take(r));
    let scale = slices.take(n);
    let (mut rows, mut columns) = (slices.indices(r), slices.indices(n));
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
        // A vanished row, at a change point, is never chosen.
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
    let mut slices = borrow_workspace(workspace, n, r);
    // The quality is that of this block, even where it is bad and there is no better one.
    let block = chosen.factor(model, state, &mut slices);
    (chosen.quality, chosen.negative) = (block.quality(), block.factored.negative);
    Ok(chosen)
}

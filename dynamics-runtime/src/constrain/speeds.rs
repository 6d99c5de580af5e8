//! Velocities from generalized speeds: (Φ_q; A; Y) q̇ = (−Φ_t; −b; w − y) with the active constraints.
//!
//! Rows and columns are scaled to 1, because they have units of their own; speeds of one unit share a scale.
//! The elimination uses complete pivoting, so that the rank is found at any position, and redundant
//! constraints are no obstacle. Rows of constraints come first: speeds that the constraints do not admit are
//! missed, not the constraints. The residuals of speeds and constraints are checked afterwards.

use super::active_set::active_rows;
use super::{TopContributors, with_workspace};
use crate::error::StateError;
use crate::linalg::{Indices, WorkspaceSlices, max_abs};
use crate::model::{Constraints, ModelState, Terms, Vector};

/// Pivots of the scaled equations below this are rounding: velocities would have four digits at most.
const SINGULAR_PIVOT: f64 = 1e-12;
/// Rows of constraints with pivots below this are eliminated after those of the speeds. Redundant rows leave
/// such pivots where the position is a little off the constraints.
const REPEATED_ROW_PIVOT: f64 = 1e-6;
/// How far a speed may be from the given value, relative to the largest of its unit, and a constraint from 0,
/// relative to its terms.
const SPEED_TOLERANCE: f64 = 1e-9;

/// Length of the workspace for n coordinates and r constraint rows. There are at most as many speeds as
/// coordinates.
pub(super) const fn workspace_len(n: usize, r: usize) -> usize {
    let read = n * n + n + n * r + r + n * (n + 1);
    read + (n + r) * (n + 1) + 5 * n
}

/// Sets the velocities of a state so that its generalized speeds are `speeds`, in the order of
/// [`Dynamics::SPEEDS`](crate::model::Dynamics::SPEEDS), and the active constraints are fulfilled. On an
/// error the state stays as it is.
///
/// # Errors
/// [`StateError::SpeedsSingular`] where the speeds do not determine the velocities in this position,
/// [`StateError::SpeedNotMet`] where the active constraints do not admit them,
/// [`StateError::VelocityNotAssembled`] where the constraints contradict each other,
/// [`StateError::NotFinite`].
///
/// # Panics
/// Where there are not as many values as the model has speeds.
pub fn move_by_speeds<M: Constraints>(
    model: &M,
    state: &mut M::State,
    speeds: &[f64],
) -> Result<(), StateError> {
    assert!(speeds.len() == M::SPEEDS.len(), "{} values for {} speeds", speeds.len(), M::SPEEDS.len());
    if let Some((value, named)) = speeds.iter().zip(M::SPEEDS).find(|(value, _)| !value.is_finite()) {
        return Err(StateError::NotFinite { what: "speed", name: named.name, value: *value });
    }
    let mut moved = *state;
    moved.u_mut().as_mut_slice().fill(0.0);
    StateError::check_parameters(model)?;
    StateError::check::<M>(&moved)?;
    with_workspace::<M, _>(|workspace| {
        let workspace = &mut WorkspaceSlices::new(workspace);
        let mut system = SpeedSystem::read(model, &moved, speeds, workspace);
        if let Err(pivot) = system.eliminate() {
            let shares = system.undetermined_shares(workspace);
            let coordinates = TopContributors::ranked(M::COORDINATES, shares);
            return Err(StateError::SpeedsSingular { coordinates, pivot });
        }
        system.solve(moved.u_mut().as_mut_slice());
        system.check_constraints(model, &moved)?;
        system.check_speeds(model, &moved, speeds, workspace)?;
        *state = moved;
        Ok(())
    })
}

/// The equations by rows, with the right-hand side as the last column. Rows and columns are in the order of
/// their elimination.
struct SpeedSystem<'w> {
    /// N.
    unknowns: usize,
    /// Y by rows, then y.
    speed_rows: &'w [f64],
    /// Φ_q by rows.
    jacobian: &'w [f64],
    entries: &'w mut [f64],
    /// Number of rows of constraints, which come before those of the speeds.
    constraint_rows: usize,
    /// What each column was divided by.
    scales: &'w mut [f64],
    /// The coordinates of the columns.
    order: Indices<'w>,
    /// Pivots found.
    rank: usize,
}

impl<'w> SpeedSystem<'w> {
    /// Reads the equations at a state at rest, where the residuals of the constraints are the terms without
    /// velocities.
    fn read<M: Constraints>(
        model: &M,
        state: &M::State,
        speeds: &[f64],
        workspace: &mut WorkspaceSlices<'w>,
    ) -> Self {
        let (n, s, r) = (M::Vector::LEN, speeds.len(), M::ROWS.len());
        let mass = workspace.zeros(n * n);
        let (force, jacobian, gamma) = (workspace.zeros(n), workspace.zeros(n * r), workspace.zeros(r));
        model.terms(state, &mut Terms { mass, force, jacobian, gamma });
        let (speed_rows, jacobian): (_, &'w [f64]) = (workspace.zeros(s * n + s), jacobian);
        model.speed_equations(state, speed_rows);
        let speed_rows: &'w [f64] = speed_rows;
        let rows = active_rows::<M>(state.active_set(), false);
        let constraint_rows = rows.clone().count();
        let entries = workspace.zeros((constraint_rows + s) * (n + 1));
        let residual = model.velocity_residual(state);
        let of_rows = rows.map(|row| (&jacobian[row * n..][..n], -residual[row]));
        let of_speeds = (0..s).map(|i| (&speed_rows[i * n..][..n], speeds[i] - speed_rows[s * n + i]));
        for (to, (gradient, right)) in entries.chunks_exact_mut(n + 1).zip(of_rows.chain(of_speeds)) {
            to[..n].copy_from_slice(gradient);
            to[n] = right;
        }
        let (scales, order) = (workspace.zeros(n), workspace.indices(n));
        let mut system =
            Self { unknowns: n, speed_rows, jacobian, entries, constraint_rows, scales, order, rank: 0 };
        system.scale::<M>(workspace.zeros(n));
        system
    }

    /// Scales the largest element of every column, then of every row, to 1. Rows of speeds of one unit share
    /// their scale, so that rounding in one of them stays small.
    fn scale<M: Constraints>(&mut self, sizes: &mut [f64]) {
        let (n, width) = (self.unknowns, self.unknowns + 1);
        for (j, scale) in self.scales.iter_mut().enumerate() {
            let column = || self.entries.iter().skip(j).step_by(width);
            let largest = column().fold(0.0, |most: f64, x| most.max(x.abs()));
            *scale = if largest > 0.0 { largest } else { 1.0 };
            self.entries.iter_mut().skip(j).step_by(width).for_each(|x| *x /= *scale);
        }
        let divide = |row: &mut [f64], largest: f64| {
            if largest > 0.0 {
                row.iter_mut().for_each(|x| *x /= largest);
            }
        };
        let (constraint_rows, speeds) = self.entries.split_at_mut(self.constraint_rows * width);
        constraint_rows.chunks_exact_mut(width).for_each(|row| divide(row, max_abs(&row[..n])));
        sizes.iter_mut().zip(speeds.chunks_exact(width)).for_each(|(size, row)| *size = max_abs(&row[..n]));
        speeds
            .chunks_exact_mut(width)
            .enumerate()
            .for_each(|(i, row)| divide(row, largest_of_same_kind::<M>(i, |j| sizes[j])));
    }

    /// Brings the equations to triangular form.
    ///
    /// # Errors
    /// The pivot that is too small.
    fn eliminate(&mut self) -> Result<(), f64> {
        let (n, width) = (self.unknowns, self.unknowns + 1);
        let rows = self.entries.len() / width;
        while self.rank < n {
            let k = self.rank;
            let largest = |rows: usize| {
                let left = (k..rows).flat_map(|i| (k..n).map(move |j| (i, j)));
                let sized = left.map(|(i, j)| (self.entries[i * width + j].abs(), i, j));
                // NaN is no pivot.
                sized.filter(|(size, ..)| size.is_finite()).reduce(|a, b| if b.0 > a.0 { b } else { a })
            };
            let of_held = largest(self.constraint_rows).filter(|(size, ..)| *size > REPEATED_ROW_PIVOT);
            let (size, row, column) = of_held.or_else(|| largest(rows)).unwrap_or((0.0, k, k));
            if size <= SINGULAR_PIVOT {
                return Err(size);
            }
            for j in 0..width {
                self.entries.swap(row * width + j, k * width + j);
            }
            for i in 0..rows {
                self.entries.swap(i * width + column, i * width + k);
            }
            self.order.swap(column, k);
            let (done, rest) = self.entries.split_at_mut((k + 1) * width);
            let pivot = &done[k * width..];
            for row in rest.chunks_exact_mut(width) {
                let factor = row[k] / pivot[k];
                row[k..].iter_mut().zip(&pivot[k..]).for_each(|(x, p)| *x -= factor * p);
            }
            self.rank += 1;
        }
        Ok(())
    }

    /// Back substitution: the velocities of the triangular form.
    fn solve(&self, u: &mut [f64]) {
        let (n, width) = (self.unknowns, self.unknowns + 1);
        for k in (0..n).rev() {
            let row = &self.entries[k * width..][..width];
            let known = (k + 1..n).map(|j| {
                let c = self.order.get(j);
                row[j] * u[c] * self.scales[c]
            });
            let c = self.order.get(k);
            u[c] = (row[n] - known.sum::<f64>()) / row[k] / self.scales[c];
        }
    }

    /// A null vector of the equations, by coordinate, in scaled velocities: one column without a pivot is 1,
    /// and the columns with pivots follow.
    fn undetermined_shares(
        &self,
        workspace: &mut WorkspaceSlices<'w>,
    ) -> impl Iterator<Item = (usize, f64)> + Clone + use<'w> {
        let width = self.unknowns + 1;
        let shares = workspace.zeros(self.unknowns);
        shares[self.order.get(self.rank)] = 1.0;
        for k in (0..self.rank).rev() {
            let row = &self.entries[k * width..][..width];
            let known: f64 = (k + 1..=self.rank).map(|j| row[j] * shares[self.order.get(j)]).sum();
            shares[self.order.get(k)] = -known / row[k];
        }
        let shares: &'w [f64] = shares;
        shares.iter().copied().enumerate()
    }

    /// Checks the constraints. They are missed where they contradict each other or are nearly singular at
    /// this position, and never because of the speeds.
    fn check_constraints<M: Constraints>(&self, model: &M, state: &M::State) -> Result<(), StateError> {
        let (n, u, residual) = (self.unknowns, state.u(), model.velocity_residual(state));
        for row in active_rows::<M>(state.active_set(), false) {
            let terms = || self.jacobian[row * n..][..n].iter().enumerate().map(|(j, x)| x * u[j]);
            let offset = residual[row] - terms().sum::<f64>();
            let size = terms().fold(offset.abs(), |sum, term| sum + term.abs());
            if residual[row].abs() > SPEED_TOLERANCE * size {
                let given = TopContributors::ranked(M::COORDINATES, core::iter::empty());
                return Err(StateError::VelocityNotAssembled {
                    row: M::ROWS[row].name,
                    residual: residual[row],
                    given,
                });
            }
        }
        Ok(())
    }

    /// Checks the speeds against the given ones. The scale is the largest speed and offset y of the same
    /// unit, or the size of their terms where all of these are 0.
    fn check_speeds<M: Constraints>(
        &self,
        model: &M,
        state: &M::State,
        speeds: &[f64],
        workspace: &mut WorkspaceSlices<'w>,
    ) -> Result<(), StateError> {
        let (n, s, u) = (self.unknowns, speeds.len(), state.u());
        let (values, terms) = (workspace.zeros(s), workspace.zeros(n));
        model.speeds(state, values);
        let term = |i: usize, j: usize| (self.speed_rows[i * n + j] * u[j]).abs();
        let size = |i: usize| {
            let given = largest_of_same_kind::<M>(i, |j| speeds[j].abs() + self.speed_rows[s * n + j].abs());
            if given > 0.0 { given } else { (0..n).map(|j| term(i, j)).sum() }
        };
        let missed = (0..s).map(|i| (i, (values[i] - speeds[i]).abs(), size(i)));
        // NaN is a miss, too.
        let worst = missed.filter(|(_, miss, size)| miss.is_nan() || *miss > SPEED_TOLERANCE * size);
        let worst = worst.reduce(|a, b| if b.1 * a.2 > a.1 * b.2 { b } else { a });
        let Some((i, _, size)) = worst else { return Ok(()) };
        terms.iter_mut().enumerate().for_each(|(j, share)| *share = term(i, j));
        // Velocities may be so large that their rounding exceeds the tolerance, though no pivot is small.
        let is_lost_in_rounding = f64::EPSILON * max_abs(terms) > SPEED_TOLERANCE * size;
        Err(if is_lost_in_rounding || !max_abs(terms).is_finite() {
            let (shares, pivot): (&[f64], _) = (terms, size / max_abs(terms));
            let coordinates = TopContributors::ranked(M::COORDINATES, shares.iter().copied().enumerate());
            StateError::SpeedsSingular { coordinates, pivot }
        } else {
            StateError::SpeedNotMet { speed: M::SPEEDS[i].name, given: speeds[i], found: values[i] }
        })
    }
}

/// The largest value among the speeds of the unit of speed `i`, or of its array.
fn largest_of_same_kind<M: Constraints>(i: usize, value: impl Fn(usize) -> f64) -> f64 {
    let speed = &M::SPEEDS[i];
    let is_of_same_kind = |j: &usize| {
        let other = &M::SPEEDS[*j];
        declaration_of::<M>(i) == declaration_of::<M>(*j)
            || (!speed.unit.is_empty() && speed.unit == other.unit)
    };
    (0..M::SPEEDS.len()).filter(is_of_same_kind).map(value).fold(0.0, f64::max)
}

/// Index of the declaration that speed `i` belongs to. Without lengths every speed has its own.
fn declaration_of<M: Constraints>(i: usize) -> usize {
    let mut end = 0;
    let ends = M::SPEED_LENGTHS.iter().map(|length| {
        end += length;
        end
    });
    if M::SPEED_LENGTHS.is_empty() { i } else { ends.take_while(|end| *end <= i).count() }
}

//! Velocities from generalized speeds: (Φ_q; A; Y) q̇ = (−Φ_t; −b; w − y) with the constraints that hold.
//!
//! Rows and columns are scaled to 1, as they have units of their own, speeds of one unit alike, and
//! eliminated with complete pivoting: rank is told at any position, and more rows than velocities, where
//! constraints repeat each other, are no obstacle. Constraints come first, so that what they do not admit is
//! missed by a speed and not by them. What is left over is checked against the speeds and the constraints.

use super::active_set::active_rows;
use super::{TopContributors, with_workspace};
use crate::error::StateError;
use crate::linalg::{Indices, WorkMemory, max_abs};
use crate::model::{Constraints, ModelState, Terms, Vector};

/// Pivots of the scaled equations below this are rounding: velocities would be known to no digit.
const SINGULAR: f64 = 1e-12;
/// Pivots of the constraints below this wait for those of the speeds: rows that repeat others leave such,
/// where the position is a little off them.
const REPEATED: f64 = 1e-6;
/// How far a speed may be from the one that was given, relative to the largest of its unit; and a constraint
/// from 0, relative to its terms.
const MET: f64 = 1e-9;

/// Memory for n coordinates and r constraint rows; there are at most as many speeds as coordinates.
pub(super) const fn memory(n: usize, r: usize) -> usize {
    let read = n * n + n + n * r + r + n * (n + 1);
    read + (n + r) * (n + 1) + 5 * n
}

/// Sets the velocities of a state so that its generalized speeds are `speeds`, in the order of
/// [`Dynamics::SPEEDS`](crate::model::Dynamics::SPEEDS), and the constraints that hold are fulfilled. Where
/// that fails the state stays as it is.
///
/// # Errors
/// [`StateError::SpeedsSingular`] where the speeds do not determine the velocities in this position,
/// [`StateError::SpeedNotMet`] where the constraints that hold do not admit them,
/// [`StateError::VelocityNotAssembled`] where these contradict each other, [`StateError::NotFinite`].
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
    with_workspace::<M, _>(|memory| {
        let memory = &mut WorkMemory::new(memory);
        let mut system = SpeedSystem::read(model, &moved, speeds, memory);
        if let Err(pivot) = system.eliminate() {
            let shares = system.undetermined(memory);
            let coordinates = TopContributors::ranked(M::COORDINATES, shares);
            return Err(StateError::SpeedsSingular { coordinates, pivot });
        }
        system.solve(moved.u_mut().as_mut_slice());
        system.check_constraints(model, &moved)?;
        system.check_speeds(model, &moved, speeds, memory)?;
        *state = moved;
        Ok(())
    })
}

/// The equations by rows, the right-hand side behind, rows and columns in the order in which they are
/// eliminated.
struct SpeedSystem<'w> {
    /// N.
    unknowns: usize,
    /// Y by rows, then y.
    own: &'w [f64],
    /// Φ_q by rows.
    jacobian: &'w [f64],
    entries: &'w mut [f64],
    /// Rows of constraints, which stand before those of the speeds.
    held: usize,
    /// What each column was divided by.
    scales: &'w mut [f64],
    /// The coordinates of the columns.
    order: Indices<'w>,
    /// Pivots found.
    rank: usize,
}

impl<'w> SpeedSystem<'w> {
    /// Of a state at rest, so that the constraints' residuals are what does not come from velocities.
    fn read<M: Constraints>(
        model: &M,
        state: &M::State,
        speeds: &[f64],
        memory: &mut WorkMemory<'w>,
    ) -> Self {
        let (n, s, r) = (M::Vector::LEN, speeds.len(), M::ROWS.len());
        let mass = memory.zeros(n * n);
        let (force, jacobian, gamma) = (memory.zeros(n), memory.zeros(n * r), memory.zeros(r));
        model.terms(state, &mut Terms { mass, force, jacobian, gamma });
        let (own, jacobian): (_, &'w [f64]) = (memory.zeros(s * n + s), jacobian);
        model.speed_equations(state, own);
        let own: &'w [f64] = own;
        let rows = active_rows::<M>(state.modes(), false);
        let held = rows.clone().count();
        let entries = memory.zeros((held + s) * (n + 1));
        let residual = model.velocity_residual(state);
        let of_rows = rows.map(|row| (&jacobian[row * n..][..n], -residual[row]));
        let of_speeds = (0..s).map(|i| (&own[i * n..][..n], speeds[i] - own[s * n + i]));
        for (to, (gradient, right)) in entries.chunks_exact_mut(n + 1).zip(of_rows.chain(of_speeds)) {
            to[..n].copy_from_slice(gradient);
            to[n] = right;
        }
        let (scales, order) = (memory.zeros(n), memory.indices(n));
        let mut system = Self { unknowns: n, own, jacobian, entries, held, scales, order, rank: 0 };
        system.scale::<M>(memory.zeros(n));
        system
    }

    /// The largest elements of columns, then of rows, become 1; of the rows of speeds of one unit together:
    /// what is rounding in one of them stays that.
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
        let (held, speeds) = self.entries.split_at_mut(self.held * width);
        held.chunks_exact_mut(width).for_each(|row| divide(row, max_abs(&row[..n])));
        sizes.iter_mut().zip(speeds.chunks_exact(width)).for_each(|(size, row)| *size = max_abs(&row[..n]));
        speeds
            .chunks_exact_mut(width)
            .enumerate()
            .for_each(|(i, row)| divide(row, alike::<M>(i, |j| sizes[j])));
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
                // What is not a number is no pivot.
                sized.filter(|(size, ..)| size.is_finite()).reduce(|a, b| if b.0 > a.0 { b } else { a })
            };
            let of_held = largest(self.held).filter(|(size, ..)| *size > REPEATED);
            let (size, row, column) = of_held.or_else(|| largest(rows)).unwrap_or((0.0, k, k));
            if size <= SINGULAR {
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

    /// The velocities of the triangular form.
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

    /// By coordinate, the scaled velocities that no equation sees: one without a pivot moves, and those with
    /// pivots follow.
    fn undetermined(
        &self,
        memory: &mut WorkMemory<'w>,
    ) -> impl Iterator<Item = (usize, f64)> + Clone + use<'w> {
        let width = self.unknowns + 1;
        let shares = memory.zeros(self.unknowns);
        shares[self.order.get(self.rank)] = 1.0;
        for k in (0..self.rank).rev() {
            let row = &self.entries[k * width..][..width];
            let known: f64 = (k + 1..=self.rank).map(|j| row[j] * shares[self.order.get(j)]).sum();
            shares[self.order.get(k)] = -known / row[k];
        }
        let shares: &'w [f64] = shares;
        shares.iter().copied().enumerate()
    }

    /// Constraints that contradict each other, or that the position makes weak, may be missed: not where the
    /// speeds alone ask for too much.
    fn check_constraints<M: Constraints>(&self, model: &M, state: &M::State) -> Result<(), StateError> {
        let (n, u, residual) = (self.unknowns, state.u(), model.velocity_residual(state));
        for row in active_rows::<M>(state.modes(), false) {
            let terms = || self.jacobian[row * n..][..n].iter().enumerate().map(|(j, x)| x * u[j]);
            let offset = residual[row] - terms().sum::<f64>();
            let size = terms().fold(offset.abs(), |sum, term| sum + term.abs());
            if residual[row].abs() > MET * size {
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

    /// The speeds are those that were given, to what those of their unit and their offsets y, or, where all
    /// of these are 0, their terms leave of digits.
    fn check_speeds<M: Constraints>(
        &self,
        model: &M,
        state: &M::State,
        speeds: &[f64],
        memory: &mut WorkMemory<'w>,
    ) -> Result<(), StateError> {
        let (n, s, u) = (self.unknowns, speeds.len(), state.u());
        let (values, terms) = (memory.zeros(s), memory.zeros(n));
        model.speeds(state, values);
        let term = |i: usize, j: usize| (self.own[i * n + j] * u[j]).abs();
        let size = |i: usize| {
            let given = alike::<M>(i, |j| speeds[j].abs() + self.own[s * n + j].abs());
            if given > 0.0 { given } else { (0..n).map(|j| term(i, j)).sum() }
        };
        let missed = (0..s).map(|i| (i, (values[i] - speeds[i]).abs(), size(i)));
        // What is not a number is missed as well.
        let worst = missed.filter(|(_, miss, size)| miss.is_nan() || *miss > MET * size);
        let worst = worst.reduce(|a, b| if b.1 * a.2 > a.1 * b.2 { b } else { a });
        let Some((i, _, size)) = worst else { return Ok(()) };
        terms.iter_mut().enumerate().for_each(|(j, share)| *share = term(i, j));
        // Velocities may be so large that speeds drown in them, though no pivot is small.
        let drowned = f64::EPSILON * max_abs(terms) > MET * size;
        Err(if drowned || !max_abs(terms).is_finite() {
            let (shares, pivot): (&[f64], _) = (terms, size / max_abs(terms));
            let coordinates = TopContributors::ranked(M::COORDINATES, shares.iter().copied().enumerate());
            StateError::SpeedsSingular { coordinates, pivot }
        } else {
            StateError::SpeedNotMet { speed: M::SPEEDS[i].name, given: speeds[i], found: values[i] }
        })
    }
}

/// The largest of what speeds of the unit of speed `i` have; without units, of its array.
fn alike<M: Constraints>(i: usize, of: impl Fn(usize) -> f64) -> f64 {
    let array = |name: &'static str| name.split('[').next();
    let own = &M::SPEEDS[i];
    let same = |j: &usize| {
        let other = &M::SPEEDS[*j];
        array(own.name) == array(other.name) || (!own.unit.is_empty() && own.unit == other.unit)
    };
    (0..M::SPEEDS.len()).filter(same).map(of).fold(0.0, f64::max)
}

//! Velocities from generalized speeds: (Y; Φ_q; A) q̇ = (u − y; −Φ_t; −b) with the constraints that hold.
//!
//! Rows and columns are scaled to 1, as they have units of their own, and eliminated with complete pivoting: rank is told at any position, and more rows than
//! velocities, where constraints repeat each other, are no obstacle. What is left over is checked against the speeds and the constraints.

use super::held::active_rows;
use super::memory::{Indices, Memory, max_abs};
use super::{Involved, with_workspace};
use crate::error::StateError;
use crate::model::{Constraints, ModelState, Terms, Vector};

/// Pivots of the scaled equations below this are rounding: velocities would be known to no digit.
const SINGULAR: f64 = 1e-12;
/// How far a speed may be from the one that was given, relative to the largest of them.
const MET: f64 = 1e-9;

/// Memory for n coordinates and r constraint rows; there are at most as many speeds as coordinates.
pub(super) const fn memory(n: usize, r: usize) -> usize {
    let read = n * n + n + n * r + r + n * (n + 1);
    read + (n + r) * (n + 1) + 5 * n
}

/// Sets the velocities of a state so that its generalized speeds are `speeds`, in the order of [`Dynamics::SPEEDS`](crate::model::Dynamics::SPEEDS), and the constraints that hold are fulfilled.
///
/// # Errors
/// [`StateError::SpeedsSingular`] where the speeds do not determine the velocities in this position, [`StateError::SpeedNotMet`] where the constraints that hold
/// do not admit them, [`StateError::NotFinite`].
///
/// # Panics
/// Where there are not as many values as the model has speeds.
pub fn move_by_speeds<M: Constraints>(model: &M, state: &mut M::State, speeds: &[f64]) -> Result<(), StateError> {
    assert!(speeds.len() == M::SPEEDS.len(), "{} values for {} speeds", speeds.len(), M::SPEEDS.len());
    if let Some((value, named)) = speeds.iter().zip(M::SPEEDS).find(|(value, _)| !value.is_finite()) {
        return Err(StateError::NotFinite { what: "speed", name: named.name, value: *value });
    }
    state.u_mut().as_mut_slice().fill(0.0);
    StateError::check_parameters(model)?;
    StateError::check::<M>(state)?;
    with_workspace::<M, _>(|memory| {
        let memory = &mut Memory::rest(memory);
        let mut system = System::read(model, state, speeds, memory);
        if let Err(pivot) = system.eliminate() {
            let shares = system.undetermined(memory);
            let coordinates = Involved::ranked(M::COORDINATES, shares);
            return Err(StateError::SpeedsSingular { coordinates, pivot });
        }
        system.solve(state.u_mut().as_mut_slice());
        let values = memory.zeros(speeds.len());
        model.speeds(state, values);
        let size = speeds.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let met = |i: &usize| (values[*i] - speeds[*i]).abs() <= MET * size;
        let Some(i) = (0..speeds.len()).find(|i| !met(i)) else { return Ok(()) };
        // A row that is nothing but rounding has a pivot as good as any once it is scaled: the velocities tell, which are then so large that speeds drown in them.
        let (shares, u) = (memory.zeros(M::Vector::LEN), state.u());
        for row in system.gradients.chunks_exact(shares.len()) {
            let terms = row.iter().enumerate().map(|(j, y)| (y * u[j]).abs());
            shares.iter_mut().zip(terms).for_each(|(share, term)| *share = share.max(term));
        }
        let drowned = f64::EPSILON * max_abs(shares) > MET * size;
        Err(if drowned || !max_abs(shares).is_finite() {
            let (shares, pivot): (&[f64], _) = (shares, size / max_abs(shares));
            let coordinates = Involved::ranked(M::COORDINATES, shares.iter().copied().enumerate());
            StateError::SpeedsSingular { coordinates, pivot }
        } else {
            StateError::SpeedNotMet { speed: M::SPEEDS[i].name, given: speeds[i], found: values[i] }
        })
    })
}

/// The equations by rows, the right-hand side behind, rows and columns in the order in which they are eliminated.
struct System<'w> {
    /// N.
    unknowns: usize,
    /// Y by rows.
    gradients: &'w [f64],
    entries: &'w mut [f64],
    /// What each column was divided by.
    scales: &'w mut [f64],
    /// The coordinates of the columns.
    order: Indices<'w>,
    /// Pivots found.
    rank: usize,
}

impl<'w> System<'w> {
    /// Of a state at rest, so that the constraints' residuals are what does not come from velocities.
    fn read<M: Constraints>(model: &M, state: &M::State, speeds: &[f64], memory: &mut Memory<'w>) -> Self {
        let (n, s, r) = (M::Vector::LEN, speeds.len(), M::ROWS.len());
        let mass = memory.zeros(n * n);
        let (force, jacobian, gamma) = (memory.zeros(n), memory.zeros(n * r), memory.zeros(r));
        model.terms(state, &mut Terms { mass, force, jacobian, gamma });
        let own = memory.zeros(s * n + s);
        model.speed_equations(state, own);
        let own: &'w [f64] = own;
        let held = active_rows::<M>(state.modes(), false);
        let entries = memory.zeros((s + held.clone().count()) * (n + 1));
        let residual = model.velocity_residual(state);
        let of_speeds = (0..s).map(|i| (&own[i * n..][..n], speeds[i] - own[s * n + i]));
        let of_rows = held.map(|row| (&jacobian[row * n..][..n], -residual[row]));
        for (to, (gradient, right)) in entries.chunks_exact_mut(n + 1).zip(of_speeds.chain(of_rows)) {
            to[..n].copy_from_slice(gradient);
            to[n] = right;
        }
        let (scales, order) = (memory.zeros(n), memory.indices(n));
        let gradients = &own[..s * n];
        let mut system = Self { unknowns: n, gradients, entries, scales, order, rank: 0 };
        system.scale();
        system
    }

    /// The largest elements of columns, then of rows, become 1.
    fn scale(&mut self) {
        let (n, width) = (self.unknowns, self.unknowns + 1);
        for (j, scale) in self.scales.iter_mut().enumerate() {
            let column = || self.entries.iter().skip(j).step_by(width);
            let largest = column().fold(0.0, |most: f64, x| most.max(x.abs()));
            *scale = if largest > 0.0 { largest } else { 1.0 };
            self.entries.iter_mut().skip(j).step_by(width).for_each(|x| *x /= *scale);
        }
        for row in self.entries.chunks_exact_mut(width) {
            let largest = max_abs(&row[..n]);
            if largest > 0.0 {
                row.iter_mut().for_each(|x| *x /= largest);
            }
        }
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
            let left = (k..rows).flat_map(|i| (k..n).map(move |j| (i, j)));
            let sized = left.map(|(i, j)| (self.entries[i * width + j].abs(), i, j));
            // What is not a number is no pivot.
            let largest = sized.filter(|(size, ..)| size.is_finite()).reduce(|a, b| if b.0 > a.0 { b } else { a });
            let (size, row, column) = largest.unwrap_or((0.0, k, k));
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

    /// By coordinate, the scaled velocities that no equation sees: one without a pivot moves, and those with pivots follow.
    fn undetermined(&self, memory: &mut Memory<'w>) -> impl Iterator<Item = (usize, f64)> + Clone + use<'w> {
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
}

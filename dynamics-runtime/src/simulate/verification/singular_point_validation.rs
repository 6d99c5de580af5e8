//! Whether a singular position that was passed is one: whether the constraints hold in it.
//!
//! A mechanism whose links nearly come in line turns round there, a hair's breadth from one that passes, and
//! steps cannot tell them apart where what lies between is less than their errors. Beside such a place, with
//! w the left singular vector of the smallest singular value of (Φ_q, Φ_t) and W the others, the unfolded
//! position is where
//!
//! ```text
//! WᵀΦ(q, t) = 0        and        wᵀ(Φ_q, Φ_t) = 0
//! ```
//!
//! the latter along all directions that W leaves open: a critical point of wᵀΦ, which Newton's method finds.
//! There β = wᵀΦ is 0 where branches cross; else that is by how much the constraints miss it, and the
//! branches avoid each other. Source: W. Govaerts, Numerical Methods for Bifurcations of Dynamical
//! Equilibria, SIAM 2000, ch. 4.

use alloc::vec::Vec;

use nalgebra::{DMatrix, DVector};

use crate::constrain::held::active_rows;
use crate::constrain::nearby::at_time;
use crate::constrain::{Gradients, with_workspace};
use crate::linalg::max_abs;
use crate::math;
use crate::model::{Constraints, ModelState, Vector};

/// Most Newton steps.
const MOST: u32 = 20;
/// A position further away, in parts of 1 + |q|, is another one.
const NEAR: f64 = 0.03;
/// Step of differences of (Φ_q, Φ_t).
const BESIDE: f64 = 1e-5;
/// Singular values of Newton's matrix below this part of the largest leave directions open, in which
/// positions of this kind form a family.
const OPEN: f64 = 1e-7;
/// Singular values of unit rows below this are those of rows that repeat others.
const RANK: f64 = 1e-6;
/// Smallest over largest singular value beside a singular position, at most.
const WEAK: f64 = 0.05;
/// Φ of a position in which branches cross, in parts of 1 + |q|: rounding.
const ROUNDING: f64 = 1e-13;

/// |β| beside a state, over the length of the constraints' gradients; `None` where it is rounding, or nothing
/// of the kind is found. Rows count that bind positions and hold; those that are meant to repeat others do
/// not.
pub(crate) fn missed_by<M: Constraints>(model: &M, state: &M::State) -> Option<f64> {
    let repeats = |row: &usize| {
        let mut constraints = M::CONSTRAINTS.iter();
        constraints.any(|one| one.redundant && (one.first..one.first + one.rows).contains(row))
    };
    let all: Vec<usize> =
        active_rows::<M>(state.modes(), false).filter(|row| *row < M::Residual::LEN).collect();
    let rows: Vec<usize> = all.iter().copied().filter(|row| !repeats(row)).collect();
    if rows.is_empty() || rows.len() > M::Vector::LEN {
        return None;
    }
    let (beside, whole) = (Beside::new(model, state, rows), Beside::new(model, state, all));
    let (size, clock) = (1.0 + max_abs(state.q().as_slice()), 1.0 + state.t().abs());
    critical(&beside, &whole, beside.place(state).into(), (size, clock))
}

/// What Newton's method asks of constraints, on slices: it is compiled once, and not with every model.
trait Near {
    /// How many rows there are.
    fn rows(&self) -> usize;
    /// Φ at (q, t), in parts of the lengths.
    fn residual(&self, z: &[f64]) -> Vec<f64>;
    /// (Φ_q, Φ_t) by rows, likewise.
    fn jacobian(&self, z: &[f64]) -> Vec<f64>;
}

fn jacobian(near: &dyn Near, z: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_row_slice(near.rows(), z.len(), &near.jacobian(z.as_slice()))
}

/// |β| at the critical point beside a position of this size, at a time of this size: see [`missed_by`].
/// `whole` has all rows, `beside` those that do not repeat others.
fn critical(
    beside: &dyn Near,
    whole: &dyn Near,
    start: DVector<f64>,
    (size, clock): (f64, f64),
) -> Option<f64> {
    // What is left out repeats the others here, and it is these that nearly lose a direction.
    let (kept, all) = (jacobian(beside, &start), jacobian(whole, &start));
    if !kept.iter().chain(all.iter()).all(|x| x.is_finite()) {
        return None;
    }
    let values = kept.singular_values();
    if kept.rank(RANK) != all.rank(RANK) || values.min() > WEAK * values.max() {
        return None;
    }
    let n = start.len() - 1;
    let mut z = start.clone();
    for _ in 0..MOST {
        let (matrix, right, _) = equations(beside, &z)?;
        let step = matrix.svd(true, true).solve(&right, OPEN).ok()?;
        z -= &step;
        if (&z - &start).amax() > NEAR * size {
            return None;
        }
        if step.rows(0, n).amax() <= 1e-11 * size && step[n].abs() <= 1e-11 * clock {
            let beta = equations(beside, &z)?.2;
            return (beta > ROUNDING * size).then_some(beta);
        }
    }
    None
}

/// Newton's matrix and right side at (q, t), and |β| there.
fn equations(near: &dyn Near, z: &DVector<f64>) -> Option<(DMatrix<f64>, DVector<f64>, f64)> {
    let (r, unknowns) = (near.rows(), z.len());
    let (at, residual) = (jacobian(near, z), DVector::from(near.residual(z.as_slice())));
    if !at.iter().chain(residual.iter()).all(|x| x.is_finite()) {
        return None;
    }
    // With rows of zeros, so that all right singular vectors are there.
    let svd = at.clone().resize_vertically(unknowns, 0.0).svd(true, true);
    let (left, right) = (svd.u?, svd.v_t?);
    let w = left.column(r - 1).rows(0, r).into_owned();
    let (mut matrix, mut values) = (DMatrix::zeros(unknowns, unknowns), DVector::zeros(unknowns));
    for k in 0..r - 1 {
        let strong = left.column(k).rows(0, r).into_owned();
        matrix.row_mut(k).copy_from(&(strong.transpose() * &at));
        values[k] = strong.dot(&residual);
    }
    for k in r - 1..unknowns {
        let along = right.row(k).transpose();
        let slope = |sign: f64| w.transpose() * jacobian(near, &(z + &along * (sign * BESIDE)));
        matrix.row_mut(k).copy_from(&((slope(1.0) - slope(-1.0)) / (2.0 * BESIDE)));
        values[k] = (w.transpose() * &at * along)[0];
    }
    Some((matrix, values, w.dot(&residual).abs()))
}

/// The constraints near a state, rows in parts of the length of their gradient there.
struct Beside<'m, M: Constraints> {
    model: &'m M,
    state: M::State,
    rows: Vec<usize>,
    lengths: Vec<f64>,
}

impl<'m, M: Constraints> Beside<'m, M> {
    fn new(model: &'m M, state: &M::State, rows: Vec<usize>) -> Self {
        let lengths = with_workspace::<M, _>(|workspace| {
            let gradients = Gradients::of(model, state, workspace);
            let norm = |row: usize| math::sqrt(gradients.row(row).iter().map(|x| x * x).sum());
            rows.iter().map(|row| math::max(norm(*row), gradients.usual[*row])).collect()
        });
        Self { model, state: *state, rows, lengths }
    }

    /// (q, t).
    fn place(&self, state: &M::State) -> Vec<f64> {
        let mut place = state.q().as_slice().to_vec();
        place.push(state.t());
        place
    }

    fn state(&self, z: &[f64]) -> M::State {
        let n = M::Vector::LEN;
        let mut state = at_time(&self.state, z[n]);
        state.q_mut().as_mut_slice().copy_from_slice(&z[..n]);
        state.u_mut().as_mut_slice().fill(0.0);
        state
    }
}

impl<M: Constraints> Near for Beside<'_, M> {
    fn rows(&self) -> usize {
        self.rows.len()
    }

    fn residual(&self, z: &[f64]) -> Vec<f64> {
        let residual = self.model.residual(&self.state(z));
        self.rows.iter().zip(&self.lengths).map(|(row, length)| residual[*row] / length).collect()
    }

    fn jacobian(&self, z: &[f64]) -> Vec<f64> {
        let state = self.state(z);
        // At rest Φ̇ is Φ_t.
        let by_time = self.model.velocity_residual(&state);
        with_workspace::<M, _>(|workspace| {
            let gradients = Gradients::of(self.model, &state, workspace);
            let mut values = Vec::with_capacity(self.rows.len() * z.len());
            for (row, length) in self.rows.iter().zip(&self.lengths) {
                values.extend(gradients.row(*row).iter().map(|x| x / length));
                values.push(by_time[*row] / length);
            }
            values
        })
    }
}

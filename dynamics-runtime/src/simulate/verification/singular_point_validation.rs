//! Validation of a singular position that was passed: whether the constraints hold in it.
//!
//! A mechanism whose links nearly come in line turns round there; one whose links do come in line may pass.
//! Steps cannot tell the two apart where the gap is less than their errors. Let w be the left singular vector
//! of the smallest singular value of (Φ_q, Φ_t), and W the others. The unfolded position near it is where
//!
//! ```text
//! WᵀΦ(q, t) = 0        and        wᵀ(Φ_q, Φ_t) = 0
//! ```
//!
//! the latter along all directions that W leaves open. It is a critical point of wᵀΦ, which Newton's
//! method finds. There β = wᵀΦ is 0 where branches cross. Otherwise |β| is the distance by which the
//! constraints miss the singular position, and the branches avoid each other. Source: W. Govaerts, Numerical
//! Methods for Bifurcations of Dynamical Equilibria, SIAM 2000, ch. 4.

use alloc::vec::Vec;

use nalgebra::{DMatrix, DVector};

use crate::constrain::active_set::active_rows;
use crate::constrain::nearby::at_time;
use crate::constrain::{Gradients, with_workspace};
use crate::linalg::max_abs;
use crate::math;
use crate::model::{Constraints, ModelState, Vector};

/// Most Newton steps.
const MAX_NEWTON_STEPS: u32 = 20;
/// A critical point further away, in parts of 1 + |q|, belongs to another position.
const MAX_DISTANCE: f64 = 0.03;
/// Step of the central differences of (Φ_q, Φ_t): near the cube root of ε, where truncation and rounding
/// balance.
const DIFFERENCE_STEP: f64 = 1e-5;
/// Singular values of Newton's matrix below this part of the largest leave directions open, in which
/// positions of this kind form a family.
const OPEN_DIRECTION_TOLERANCE: f64 = 1e-7;
/// Singular values of unit rows below this come from rows that repeat others. With a smaller value rounding
/// of a repeated row counts as a row of its own; with a larger one the row that a singular position nearly
/// loses counts as repeated, and nothing is found.
const REPEATED_ROW_TOLERANCE: f64 = 1e-6;
/// Largest ratio of smallest and largest singular value near a singular position.
const SINGULAR_RATIO: f64 = 0.05;
/// |β| of crossing branches, in parts of 1 + |q|: rounding.
const RESIDUAL_ROUNDING: f64 = 1e-13;

/// |β| near a state, in units of the constraints' gradients; `None` where it is rounding, or where no such
/// critical point is found. Only active holonomic rows count, without those that are declared redundant.
pub(crate) fn missed_by<M: Constraints>(model: &M, state: &M::State) -> Option<f64> {
    let is_redundant = |row: &usize| {
        let mut constraints = M::CONSTRAINTS.iter();
        constraints.any(|one| one.redundant && (one.first..one.first + one.rows).contains(row))
    };
    let all: Vec<usize> =
        active_rows::<M>(state.active_set(), false).filter(|row| *row < M::Residual::LEN).collect();
    let rows: Vec<usize> = all.iter().copied().filter(|row| !is_redundant(row)).collect();
    if rows.is_empty() || rows.len() > M::Vector::LEN {
        return None;
    }
    let (independent, all_rows) =
        (ScaledConstraints::new(model, state, rows), ScaledConstraints::new(model, state, all));
    let (size, time_size) = (1.0 + max_abs(state.q().as_slice()), 1.0 + state.t().abs());
    critical_residual(&independent, &all_rows, independent.position(state).into(), (size, time_size))
}

/// The constraints as Newton's method needs them, on slices, so that it is compiled once and not for every
/// model.
trait LocalConstraints {
    /// How many rows there are.
    fn rows(&self) -> usize;
    /// Φ at (q, t), in parts of the lengths.
    fn residual(&self, z: &[f64]) -> Vec<f64>;
    /// (Φ_q, Φ_t) by rows, likewise.
    fn jacobian(&self, z: &[f64]) -> Vec<f64>;
}

fn jacobian(constraints: &dyn LocalConstraints, z: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_row_slice(constraints.rows(), z.len(), &constraints.jacobian(z.as_slice()))
}

/// |β| at the critical point near a position of this size, at a time of this size: see [`missed_by`].
/// `all_rows` includes redundant rows, `independent` does not.
fn critical_residual(
    independent: &dyn LocalConstraints,
    all_rows: &dyn LocalConstraints,
    start: DVector<f64>,
    (size, time_size): (f64, f64),
) -> Option<f64> {
    // The redundant rows repeat the others here, and the others nearly lose rank.
    let (kept, all) = (jacobian(independent, &start), jacobian(all_rows, &start));
    if !kept.iter().chain(all.iter()).all(|x| x.is_finite()) {
        return None;
    }
    let values = kept.singular_values();
    if kept.rank(REPEATED_ROW_TOLERANCE) != all.rank(REPEATED_ROW_TOLERANCE)
        || values.min() > SINGULAR_RATIO * values.max()
    {
        return None;
    }
    let n = start.len() - 1;
    let mut z = start.clone();
    for _ in 0..MAX_NEWTON_STEPS {
        let (matrix, right, _) = equations(independent, &z)?;
        let step = matrix.svd(true, true).solve(&right, OPEN_DIRECTION_TOLERANCE).ok()?;
        z -= &step;
        if (&z - &start).amax() > MAX_DISTANCE * size {
            return None;
        }
        if step.rows(0, n).amax() <= 1e-11 * size && step[n].abs() <= 1e-11 * time_size {
            let beta = equations(independent, &z)?.2;
            return (beta > RESIDUAL_ROUNDING * size).then_some(beta);
        }
    }
    None
}

/// Newton's matrix and right side at (q, t), and |β| there.
fn equations(
    constraints: &dyn LocalConstraints,
    z: &DVector<f64>,
) -> Option<(DMatrix<f64>, DVector<f64>, f64)> {
    let (r, unknowns) = (constraints.rows(), z.len());
    let (at, residual) = (jacobian(constraints, z), DVector::from(constraints.residual(z.as_slice())));
    if !at.iter().chain(residual.iter()).all(|x| x.is_finite()) {
        return None;
    }
    // Padded with rows of zeros, so that the decomposition has all right singular vectors.
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
        let slope =
            |sign: f64| w.transpose() * jacobian(constraints, &(z + &along * (sign * DIFFERENCE_STEP)));
        matrix.row_mut(k).copy_from(&((slope(1.0) - slope(-1.0)) / (2.0 * DIFFERENCE_STEP)));
        values[k] = (w.transpose() * &at * along)[0];
    }
    Some((matrix, values, w.dot(&residual).abs()))
}

/// The constraints near a state, rows scaled to unit gradients there.
struct ScaledConstraints<'m, M: Constraints> {
    model: &'m M,
    state: M::State,
    rows: Vec<usize>,
    lengths: Vec<f64>,
}

impl<'m, M: Constraints> ScaledConstraints<'m, M> {
    fn new(model: &'m M, state: &M::State, rows: Vec<usize>) -> Self {
        let lengths = with_workspace::<M, _>(|workspace| {
            let gradients = Gradients::of(model, state, workspace);
            let norm = |row: usize| math::sqrt(gradients.row(row).iter().map(|x| x * x).sum());
            rows.iter().map(|row| math::max(norm(*row), gradients.usual_lengths[*row])).collect()
        });
        Self { model, state: *state, rows, lengths }
    }

    /// (q, t).
    fn position(&self, state: &M::State) -> Vec<f64> {
        let mut position = state.q().as_slice().to_vec();
        position.push(state.t());
        position
    }

    fn state(&self, z: &[f64]) -> M::State {
        let n = M::Vector::LEN;
        let mut state = at_time(&self.state, z[n]);
        state.q_mut().as_mut_slice().copy_from_slice(&z[..n]);
        state.u_mut().as_mut_slice().fill(0.0);
        state
    }
}

impl<M: Constraints> LocalConstraints for ScaledConstraints<'_, M> {
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

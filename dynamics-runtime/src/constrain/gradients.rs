//! Gradients of the constraints at a state, and distances from them.

use super::nearby::{NEARBY_DISTANCE, nearby_state};
#[cfg(feature = "alloc")]
use crate::linalg::dot;
use crate::linalg::{max_abs, norm};
#[cfg(feature = "alloc")]
use crate::math;
use crate::model::{Constraints, Terms, Vector};

/// Φ_q by rows, in memory that a caller lends: by value it may be too large for a stack. Rows that have
/// vanished are zero.
pub(crate) struct Gradients<'w> {
    /// Row by row.
    pub(crate) rows: &'w [f64],
    /// The usual length of each row: see [`terms`].
    pub(crate) usual_lengths: &'w [f64],
    n: usize,
}

/// Most numbers of a Jacobian that is taken by value: 8 kB of stack.
const MAX_NUMBERS_ON_STACK: usize = 1024;

/// Memory of [`Gradients`].
pub(crate) const fn memory(n: usize, r: usize) -> usize {
    n * n + n + r * n + 2 * r
}

impl<'w> Gradients<'w> {
    /// Of all rows at a state, whether they hold or not.
    pub(crate) fn of<M: Constraints>(model: &M, state: &M::State, workspace: &'w mut [f64]) -> Self {
        let (n, r) = (M::Vector::LEN, M::Rows::LEN);
        let (mass, remaining) = workspace.split_at_mut(n * n);
        let (force, remaining) = remaining.split_at_mut(n);
        let (jacobian, remaining) = remaining.split_at_mut(r * n);
        let (gamma, remaining) = remaining.split_at_mut(r);
        let usual_lengths = &mut remaining[..r];
        // What is always zero may not be written.
        jacobian.fill(0.0);
        terms(model, state, &mut Terms { mass, force, jacobian, gamma }, usual_lengths);
        Self { rows: jacobian, usual_lengths, n }
    }

    /// The same where it is asked for again and again: without M, Q and γ where the model is small enough.
    pub(crate) fn alone<M: Constraints>(model: &M, state: &M::State, workspace: &'w mut [f64]) -> Self {
        // By itself: the stack must have room for its variables only where it is called.
        #[inline(never)]
        fn by_value<M: Constraints>(model: &M, state: &M::State, rows: &mut [f64]) {
            let jacobian = model.jacobian(state);
            for (i, row) in rows.chunks_exact_mut(M::Vector::LEN).enumerate() {
                row.iter_mut().enumerate().for_each(|(j, x)| *x = jacobian[(i, j)]);
            }
        }
        let (n, r) = (M::Vector::LEN, M::Rows::LEN);
        if n * r > MAX_NUMBERS_ON_STACK {
            return Self::of(model, state, workspace);
        }
        let (rows, remaining) = workspace.split_at_mut(r * n);
        let usual_lengths = &mut remaining[..r];
        by_value(model, state, rows);
        if has_short_row(rows, n) {
            let nearby_state = nearby_state::<M>(state);
            let mut lengths_here = M::Rows::zeros();
            measure_lengths(rows, n, lengths_here.as_mut_slice());
            by_value(model, &nearby_state, rows);
            measure_lengths(rows, n, usual_lengths);
            by_value(model, state, rows);
            clear_vanished_rows(rows, n, lengths_here.as_slice(), usual_lengths);
        } else {
            usual_lengths.fill(0.0);
        }
        Self { rows, usual_lengths, n }
    }

    /// The gradient of a row.
    pub(crate) fn row(&self, row: usize) -> &[f64] {
        &self.rows[row * self.n..][..self.n]
    }

    /// [`distance`] of a row.
    pub(crate) fn distance(&self, row: usize, residual: f64) -> f64 {
        distance(residual, self.row(row), self.usual_lengths[row])
    }
}

/// Part of its usual length below which a row has vanished: at a distance d of the place where it does,
/// velocities along what it leaves open are known to ε/d and accelerations to ε/d², to nothing at 10⁻⁸. What
/// is left is rounding, of sin π say, and scaled to unit length it would count as a constraint like any
/// other.
const VANISHED_LENGTH_RATIO: f64 = 1e-8;

/// A row is looked at where it is shorter than this, against the longest one and 1: else its usual length
/// would be asked for at every evaluation.
const SHORT_LENGTH_RATIO: f64 = 1e-6;

/// M, Q, Φ_q and γ at a state, with rows of Φ_q set to zero where they have vanished: against the length that
/// they have `usual_lengths`ly, one unit and the size of the coordinates away, which is told (0 where no row is
/// short). Zeros of `terms` must be zero where the model does not write.
pub(crate) fn terms<M: Constraints>(
    model: &M,
    state: &M::State,
    terms: &mut Terms<'_>,
    usual_lengths: &mut [f64],
) {
    model.terms(state, terms);
    let n = M::Vector::LEN;
    if !has_short_row(terms.jacobian, n) {
        usual_lengths.fill(0.0);
        return;
    }
    let mut lengths_here = M::Rows::zeros();
    measure_lengths(terms.jacobian, n, lengths_here.as_mut_slice());
    model.terms(&nearby_state::<M>(state), terms);
    measure_lengths(terms.jacobian, n, usual_lengths);
    model.terms(state, terms);
    clear_vanished_rows(terms.jacobian, n, lengths_here.as_slice(), usual_lengths);
}

fn has_short_row(rows: &[f64], n: usize) -> bool {
    let sizes = rows.chunks_exact(n.max(1)).map(max_abs);
    let (least, most) = sizes.fold((f64::INFINITY, 1.0_f64), |(least, most), x| (least.min(x), most.max(x)));
    least < SHORT_LENGTH_RATIO * most
}

fn measure_lengths(rows: &[f64], n: usize, measure_lengths: &mut [f64]) {
    measure_lengths.iter_mut().zip(rows.chunks_exact(n)).for_each(|(length, row)| *length = norm(row));
}

/// `usual_lengths`: the lengths beside the state, which become those that are usual.
fn clear_vanished_rows(rows: &mut [f64], n: usize, lengths_here: &[f64], usual_lengths: &mut [f64]) {
    for ((row, lengths_here), usual_lengths) in rows.chunks_exact_mut(n).zip(lengths_here).zip(usual_lengths)
    {
        // Near the place where a row vanishes it grows with the distance.
        *usual_lengths /= NEARBY_DISTANCE;
        if lengths_here.is_finite() && *lengths_here <= VANISHED_LENGTH_RATIO * *usual_lengths {
            row.fill(0.0);
        }
    }
}

/// M at a state by rows, in memory that a caller lends; by itself where the model is small enough.
#[cfg(feature = "alloc")]
pub(crate) fn mass<'w, M: Constraints>(model: &M, state: &M::State, workspace: &'w mut [f64]) -> &'w [f64] {
    #[inline(never)]
    fn by_value<M: Constraints>(model: &M, state: &M::State, rows: &mut [f64]) {
        let mass = model.mass_matrix(state);
        for (i, row) in rows.chunks_exact_mut(M::Vector::LEN).enumerate() {
            row.iter_mut().enumerate().for_each(|(j, x)| *x = mass[(i, j)]);
        }
    }
    let n = M::Vector::LEN;
    if n * n <= MAX_NUMBERS_ON_STACK {
        by_value(model, state, &mut workspace[..n * n]);
    } else {
        workspace[..n * n].fill(0.0);
        Gradients::of(model, state, workspace);
    }
    &workspace[..n * n]
}

/// Part of its diagonal element by which a pivot of M is positive for sure: rounding is far smaller.
#[cfg(feature = "alloc")]
const POSITIVE_PIVOT_RATIO: f64 = 1e-8;

/// Whether M is positive definite at a state, without doubt: then it is so along whatever constraints leave
/// free. By Cholesky's elimination of M alone, a thirtieth of what the general solver takes for Andrews'
/// mechanism.
#[cfg(feature = "alloc")]
pub(crate) fn is_positive<M: Constraints>(model: &M, state: &M::State, workspace: &mut [f64]) -> bool {
    let n = M::Vector::LEN;
    mass(model, state, workspace);
    let mass = &mut workspace[..n * n];
    for j in 0..n {
        for i in j..n {
            let entry = mass[i * n + j];
            let remaining = entry - dot(&mass[i * n..i * n + j], &mass[j * n..j * n + j]);
            if i > j {
                mass[i * n + j] = remaining / mass[j * n + j];
            } else if remaining > POSITIVE_PIVOT_RATIO * entry {
                mass[j * n + j] = math::sqrt(remaining);
            } else {
                return false;
            }
        }
    }
    true
}

/// Part of its usual length that a gradient counts for which has vanished, where distances from its
/// constraint are told: rounding of the residual is none, and a residual by which no state is on the
/// constraint is one.
const VANISHED_ROW_LENGTH: f64 = 1e-4;

/// |residual|/‖gradient‖, how far a state is from fulfilling a row; 0 where the residual is, infinite where
/// the gradient vanishes here and elsewhere. `usual_lengths`: its usual length, see [`terms`].
pub(crate) fn distance(residual: f64, gradient: &[f64], usual_lengths: f64) -> f64 {
    let length = norm(gradient);
    if residual == 0.0 {
        0.0
    } else if length == 0.0 {
        residual.abs() / (VANISHED_ROW_LENGTH * usual_lengths)
    } else {
        residual.abs() / length
    }
}

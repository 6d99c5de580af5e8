//! Gradients of the constraints at a state, and distances from them.

use super::nearby::{NEARBY, beside};
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
    pub(crate) usual: &'w [f64],
    n: usize,
}

/// Most numbers of a Jacobian that is taken by value: 8 kB of stack.
const BY_VALUE: usize = 1024;

/// Memory of [`Gradients`].
pub(crate) const fn memory(n: usize, r: usize) -> usize {
    n * n + n + r * n + 2 * r
}

impl<'w> Gradients<'w> {
    /// Of all rows at a state, whether they hold or not.
    pub(crate) fn of<M: Constraints>(model: &M, state: &M::State, workspace: &'w mut [f64]) -> Self {
        let (n, r) = (M::Vector::LEN, M::Rows::LEN);
        let (mass, rest) = workspace.split_at_mut(n * n);
        let (force, rest) = rest.split_at_mut(n);
        let (jacobian, rest) = rest.split_at_mut(r * n);
        let (gamma, rest) = rest.split_at_mut(r);
        let usual = &mut rest[..r];
        // What is always zero may not be written.
        jacobian.fill(0.0);
        terms(model, state, &mut Terms { mass, force, jacobian, gamma }, usual);
        Self { rows: jacobian, usual, n }
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
        if n * r > BY_VALUE {
            return Self::of(model, state, workspace);
        }
        let (rows, rest) = workspace.split_at_mut(r * n);
        let usual = &mut rest[..r];
        by_value(model, state, rows);
        if are_short(rows, n) {
            let beside = beside::<M>(state);
            let mut here = M::Rows::zeros();
            lengths(rows, n, here.as_mut_slice());
            by_value(model, &beside, rows);
            lengths(rows, n, usual);
            by_value(model, state, rows);
            clear(rows, n, here.as_slice(), usual);
        } else {
            usual.fill(0.0);
        }
        Self { rows, usual, n }
    }

    /// The gradient of a row.
    pub(crate) fn row(&self, row: usize) -> &[f64] {
        &self.rows[row * self.n..][..self.n]
    }

    /// [`distance`] of a row.
    pub(crate) fn distance(&self, row: usize, residual: f64) -> f64 {
        distance(residual, self.row(row), self.usual[row])
    }
}

/// Part of its usual length below which a row has vanished: at a distance d of the place where it does,
/// velocities along what it leaves open are known to ε/d and accelerations to ε/d², to nothing at 10⁻⁸. What
/// is left is rounding, of sin π say, and scaled to unit length it would count as a constraint like any
/// other.
const VANISHED: f64 = 1e-8;

/// A row is looked at where it is shorter than this, against the longest one and 1: else its usual length
/// would be asked for at every evaluation.
const SHORT: f64 = 1e-6;

/// M, Q, Φ_q and γ at a state, with rows of Φ_q set to zero where they have vanished: against the length that
/// they have `usual`ly, one unit and the size of the coordinates away, which is told (0 where no row is
/// short). Zeros of `terms` must be zero where the model does not write.
pub(crate) fn terms<M: Constraints>(model: &M, state: &M::State, terms: &mut Terms<'_>, usual: &mut [f64]) {
    model.terms(state, terms);
    let n = M::Vector::LEN;
    if !are_short(terms.jacobian, n) {
        usual.fill(0.0);
        return;
    }
    let mut here = M::Rows::zeros();
    lengths(terms.jacobian, n, here.as_mut_slice());
    model.terms(&beside::<M>(state), terms);
    lengths(terms.jacobian, n, usual);
    model.terms(state, terms);
    clear(terms.jacobian, n, here.as_slice(), usual);
}

fn are_short(rows: &[f64], n: usize) -> bool {
    let sizes = rows.chunks_exact(n.max(1)).map(max_abs);
    let (least, most) = sizes.fold((f64::INFINITY, 1.0_f64), |(least, most), x| (least.min(x), most.max(x)));
    least < SHORT * most
}

fn lengths(rows: &[f64], n: usize, lengths: &mut [f64]) {
    lengths.iter_mut().zip(rows.chunks_exact(n)).for_each(|(length, row)| *length = norm(row));
}

/// `usual`: the lengths beside the state, which become those that are usual.
fn clear(rows: &mut [f64], n: usize, here: &[f64], usual: &mut [f64]) {
    for ((row, here), usual) in rows.chunks_exact_mut(n).zip(here).zip(usual) {
        // Near the place where a row vanishes it grows with the distance.
        *usual /= NEARBY;
        if here.is_finite() && *here <= VANISHED * *usual {
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
    if n * n <= BY_VALUE {
        by_value(model, state, &mut workspace[..n * n]);
    } else {
        workspace[..n * n].fill(0.0);
        Gradients::of(model, state, workspace);
    }
    &workspace[..n * n]
}

/// Part of its diagonal element by which a pivot of M is positive for sure: rounding is far smaller.
#[cfg(feature = "alloc")]
const POSITIVE: f64 = 1e-8;

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
            let rest = entry - dot(&mass[i * n..i * n + j], &mass[j * n..j * n + j]);
            if i > j {
                mass[i * n + j] = rest / mass[j * n + j];
            } else if rest > POSITIVE * entry {
                mass[j * n + j] = math::sqrt(rest);
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
const UNTOLD: f64 = 1e-4;

/// |residual|/‖gradient‖, how far a state is from fulfilling a row; 0 where the residual is, infinite where
/// the gradient vanishes here and elsewhere. `usual`: its usual length, see [`terms`].
pub(crate) fn distance(residual: f64, gradient: &[f64], usual: f64) -> f64 {
    let length = norm(gradient);
    if residual == 0.0 {
        0.0
    } else if length == 0.0 {
        residual.abs() / (UNTOLD * usual)
    } else {
        residual.abs() / length
    }
}

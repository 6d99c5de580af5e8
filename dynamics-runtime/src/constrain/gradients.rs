//! Gradients of the constraints at a state, distances from them, and whether they are good for something.

use super::assemble::{NEARBY, beside, beside_on_constraints};
use super::held::active_rows;
#[cfg(feature = "alloc")]
use super::memory::dot;
use super::memory::{Memory, max_abs, norm, swap_rows};
use super::names;
use crate::error::SolveError;
#[cfg(feature = "alloc")]
use crate::math;
use crate::model::{Constraints, Known, ModelState, Terms, Vector};

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

/// Memory of [`check_gradients`], besides that of an assembly.
pub(super) const fn check_memory(n: usize, r: usize) -> usize {
    n * n + 2 * r * n
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

/// |residual|/‖gradient‖, how far a state is from fulfilling a row; 0 where the residual is, infinite where the gradient vanishes here and elsewhere.
/// `usual`: its usual length, see [`terms`].
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

/// A row whose gradient is this small against that [`beside`] the state is suspected of holding nothing.
/// Found where coordinates are within [`super::assemble::CONSISTENT`] of the place where it vanishes.
const VANISHING: f64 = 1e-3;

/// The holonomic constraints that hold have gradients that are good for something. A gradient may vanish at a
/// change point, where the branches of a mechanism cross: Φ is then a saddle, and velocities decide the
/// branch. Where Φ touches zero without crossing it, as (x² + y² − l²)² does, the gradient vanishes on the
/// whole manifold: the equations of motion know nothing of the constraint, and what they give is noise.
///
/// A gradient is suspected where it is at most a thousandth of what it is beside the state, 10⁻³ of the
/// coordinates' size away. Then Φ touches where its second derivatives are semidefinite, or where its
/// gradient vanishes at another state on the constraints as well: the first sees states that are off the
/// constraints, too; the second sees what touches only within the other constraints, and models that are too
/// large for second derivatives.
///
/// Costs two evaluations, and for each row that is suspected one more and an assembly. `workspace`: as long
/// as for [`super::solve`].
///
/// # Errors
/// [`SolveError::VanishingGradient`].
pub fn check_gradients<M: Constraints>(
    model: &M,
    state: &M::State,
    workspace: &mut [f64],
) -> Result<(), SolveError> {
    match vanishing_row(model, state, workspace) {
        Some(row) => Err(SolveError::VanishingGradient { row: names::<M>().row(row) }),
        None => Ok(()),
    }
}

/// The first row that [`check_gradients`] finds.
pub(super) fn vanishing_row<M: Constraints>(
    model: &M,
    state: &M::State,
    workspace: &mut [f64],
) -> Option<usize> {
    if M::IS_FREE {
        return None;
    }
    let mut lengths = |state: &M::State| {
        let gradients = Gradients::of(model, state, workspace);
        let mut lengths = M::Rows::zeros();
        (0..M::Rows::LEN).for_each(|row| lengths[row] = norm(gradients.row(row)));
        lengths
    };
    let (here, there) = (lengths(state), lengths(&beside::<M>(state)));
    let suspected = |row: &usize| here[*row] <= VANISHING * there[*row] || here[*row] == 0.0;
    let mut suspects = active_rows::<M>(state.modes(), true).filter(suspected);
    suspects.find(|row| {
        touches(model, state, *row, workspace) || {
            let along = beside_on_constraints(model, state, workspace);
            along.is_some_and(|along| {
                norm(Gradients::of(model, &along, workspace).row(*row)) <= VANISHING * there[*row]
            })
        }
    })
}

/// Whether the second derivatives of a row are known and semidefinite.
fn touches<M: Constraints>(model: &M, state: &M::State, row: usize, workspace: &mut [f64]) -> bool {
    let (n, r) = (M::Vector::LEN, M::Rows::LEN);
    let values = Memory::new(workspace, n, r).zeros(check_memory(n, r));
    let mut one = M::Rows::zeros();
    one[row] = 1.0;
    model.constraint_derivatives(state, &one, values);
    let hessian = &mut values[..n * n];
    max_abs(hessian).is_finite() && is_semidefinite(hessian, n)
}

/// Whether a symmetric matrix, which is overwritten, has no eigenvalues of both signs, up to 10⁻⁴ of the
/// largest: Cholesky with pivoting.
fn is_semidefinite(h: &mut [f64], n: usize) -> bool {
    let diagonal = (0..n).map(|i| h[i * n + i]);
    let largest = diagonal.fold(0.0_f64, |most, x| if x.abs() > most.abs() { x } else { most });
    let tolerance = 1e-4 * max_abs(h);
    if largest < 0.0 {
        h.iter_mut().for_each(|x| *x = -*x);
    }
    for k in 0..n {
        let remaining = (k..n).map(|i| (i, h[i * n + i]));
        let (at, pivot) =
            remaining.fold((k, f64::NEG_INFINITY), |best, next| if next.1 > best.1 { next } else { best });
        if pivot <= tolerance {
            // What is left must be zero.
            return (k..n).all(|i| (k..n).all(|j| h[i * n + j].abs() <= tolerance));
        }
        swap_rows(h, n, k, at);
        (0..n).for_each(|i| h.swap(i * n + k, i * n + at));
        for i in k + 1..n {
            let factor = h[i * n + k] / h[k * n + k];
            for j in k + 1..n {
                h[i * n + j] -= factor * h[k * n + j];
            }
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::is_semidefinite;

    #[test]
    fn squares_are_semidefinite_and_saddles_are_not() {
        for sign in [1.0, -1.0] {
            let semidefinite = |h: [f64; 4]| is_semidefinite(&mut h.map(|x| sign * x), 2);
            assert!(
                semidefinite([4.0, 2.0, 2.0, 1.0])
                    && semidefinite([0.0; 4])
                    && semidefinite([0.0, 0.0, 0.0, 3.0])
            );
            assert!(!semidefinite([1.0, 0.0, 0.0, -1.0]) && !semidefinite([0.0, 1.0, 1.0, 0.0]));
            assert!(!semidefinite([1.0, 2.0, 2.0, 1.0]));
        }
    }
}

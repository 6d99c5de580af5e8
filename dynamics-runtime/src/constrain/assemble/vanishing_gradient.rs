//! Constraints whose gradients vanish on the whole manifold, so that they have no effect in the equations of
//! motion.

use super::nearby_on_constraints;
use crate::constrain::active_set::active_rows;
use crate::constrain::gradients::Gradients;
use crate::constrain::nearby::nearby_state;
use crate::constrain::{borrow_workspace, system_names};
use crate::error::SolveError;
use crate::linalg::{max_abs, norm, swap_rows};
use crate::model::{Constraints, ModelState, StaticTraits, Vector};

/// Length of the workspace of [`check_gradients`], besides the assembly.
pub(in crate::constrain) const fn check_workspace_len(n: usize, r: usize) -> usize {
    n * n + 2 * r * n
}

/// A row is suspected where its gradient is below this part of that at a nearby state. Suspicion arises where
/// coordinates are within [`CONSISTENT`](super::CONSISTENT) of the place where the gradient vanishes.
const SUSPECT_LENGTH_RATIO: f64 = 1e-3;

/// Checks that the gradients of active holonomic constraints do not vanish on the whole manifold.
///
/// A gradient may vanish at a change point, where branches of a mechanism cross: Φ is then a saddle, and
/// velocities select the branch. Where Φ touches zero without crossing it, as (x² + y² − l²)² does,
/// the gradient vanishes on the whole manifold. The constraint then has no effect in the equations of motion,
/// and accelerations are noise.
///
/// A gradient is suspected where it is at most a thousandth of that at a state displaced by 10⁻³ of the
/// coordinates' size. Then Φ touches zero where its second derivatives are semidefinite, or where its
/// gradient vanishes at another state on the constraints, too. The first test also works for states off the
/// constraints. The second finds rows that touch zero only within the other constraints, and models that are
/// too large for second derivatives.
///
/// Costs two evaluations, and one more and an assembly for each suspected row. `workspace`: as long as for
/// [`solve`](crate::constrain::solve).
///
/// # Errors
/// [`SolveError::VanishingGradient`].
// Users call `build` and `assemble` of a start, which call this.
#[doc(hidden)]
pub fn check_gradients<M: Constraints>(
    model: &M,
    state: &M::State,
    workspace: &mut [f64],
) -> Result<(), SolveError> {
    match vanishing_row(model, state, workspace) {
        Some(row) => Err(SolveError::VanishingGradient { row: system_names::<M>().row(row) }),
        None => Ok(()),
    }
}

/// The first row that [`check_gradients`] finds.
pub(super) fn vanishing_row<M: Constraints>(
    model: &M,
    state: &M::State,
    workspace: &mut [f64],
) -> Option<usize> {
    if M::IS_UNCONSTRAINED {
        return None;
    }
    let mut lengths = |state: &M::State| {
        let gradients = Gradients::of(model, state, workspace);
        let mut lengths = M::Rows::zeros();
        (0..M::Rows::LEN).for_each(|row| lengths[row] = norm(gradients.row(row)));
        lengths
    };
    let (here, there) = (lengths(state), lengths(&nearby_state::<M>(state)));
    let suspected = |row: &usize| here[*row] <= SUSPECT_LENGTH_RATIO * there[*row] || here[*row] == 0.0;
    let mut suspects = active_rows::<M>(state.active_set(), true).filter(suspected);
    suspects.find(|row| {
        has_semidefinite_hessian(model, state, *row, workspace) || {
            let on_constraints = nearby_on_constraints(model, state, workspace);
            on_constraints.is_some_and(|on_constraints| {
                norm(Gradients::of(model, &on_constraints, workspace).row(*row))
                    <= SUSPECT_LENGTH_RATIO * there[*row]
            })
        }
    })
}

/// Whether the second derivatives of a row are known and semidefinite.
fn has_semidefinite_hessian<M: Constraints>(
    model: &M,
    state: &M::State,
    row: usize,
    workspace: &mut [f64],
) -> bool {
    let (n, r) = (M::Vector::LEN, M::Rows::LEN);
    let values = borrow_workspace(workspace, n, r).zeros(check_workspace_len(n, r));
    let mut one = M::Rows::zeros();
    one[row] = 1.0;
    model.constraint_derivatives(state, &one, values);
    let hessian = &mut values[..n * n];
    max_abs(hessian).is_finite() && is_semidefinite(hessian, n)
}

/// Whether a symmetric matrix, which is overwritten, has no eigenvalues of both signs, apart from those below
/// 10⁻⁴ of the largest: by Cholesky's elimination with pivoting.
fn is_semidefinite(h: &mut [f64], n: usize) -> bool {
    let diagonal = (0..n).map(|i| h[i * n + i]);
    let largest = diagonal.fold(0.0_f64, |most, x| if x.abs() > most.abs() { x } else { most });
    let tolerance = 1e-4 * max_abs(h);
    if largest < 0.0 {
        h.iter_mut().for_each(|x| *x = -*x);
    }
    for k in 0..n {
        let remaining = (k..n).map(|i| (i, h[i * n + i]));
        let (pivot_row, pivot) =
            remaining.fold((k, f64::NEG_INFINITY), |best, next| if next.1 > best.1 { next } else { best });
        if pivot <= tolerance {
            // The remaining block must be zero.
            return (k..n).all(|i| (k..n).all(|j| h[i * n + j].abs() <= tolerance));
        }
        swap_rows(h, n, k, pivot_row);
        (0..n).for_each(|i| h.swap(i * n + k, i * n + pivot_row));
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

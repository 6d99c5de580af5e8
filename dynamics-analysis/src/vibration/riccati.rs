//! The stabilising solution of the continuous algebraic Riccati equation AᵀX + X A − X G X + Q = 0, G and Q
//! symmetric, n×n.
//!
//! The stable subspace of the Hamiltonian matrix H = [A −G; −Q −Aᵀ] is that of [1; X]. Newton's iteration Z ←
//! ½(c Z + (c Z)⁻¹) with c = |det Z|^{−1/2n} takes H to its sign S quadratically (J. D. Roberts, Int. J.
//! Control 32 (1980) 677; R. Byers, Linear Algebra Appl. 85 (1987) 267), and (S + 1)[1; X] = 0. The remaining
//! rounding error is removed by Newton's method on the equation itself (D. L. Kleinman, IEEE Trans. Autom.
//! Control 13 (1968) 114): one Lyapunov equation (A − G X)ᵀδ + δ(A − G X) = −residual each, by the Schur form
//! (Bartels & Stewart, Comm. ACM 15 (1972) 820). O(n³) each. Fails where H has eigenvalues on the imaginary
//! axis, which its callers exclude.

use nalgebra::linalg::Schur;
use nalgebra::linalg::balancing::balance_parlett_reinsch;
use nalgebra::{Complex, DMatrix};

use super::VibrationError;

/// Most iterations for the sign of the Hamiltonian matrix; it takes about ten.
const MAX_SIGN_ITERATIONS: usize = 100;
/// Relative change of an iterate above which it is scaled. Scaling speeds the iteration up far from the sign,
/// and disturbs its quadratic convergence close to it.
const MIN_CHANGE_TO_SCALE: f64 = 1e-2;
/// Relative change at which the sign has converged.
const CONVERGED_SIGN_CHANGE: f64 = 1e-13;
/// Relative change from which on an iteration that no longer halves it has reached rounding.
const STALLED_SIGN_CHANGE: f64 = 1e-6;
/// Largest last change of a sign that is accepted. Newton's method on the equation removes the rest of the
/// error; a larger value would give it a start from which it may go to another solution.
const MAX_SIGN_CHANGE: f64 = 1e-3;
/// Most Newton steps on the equation. They end by themselves where the residual no longer falls.
const MAX_NEWTON_STEPS: usize = 12;
/// Most iterations per row for the Schur form of the Lyapunov equation; only a limit.
const MAX_QR_ITERATIONS_PER_ROW: usize = 300;

/// A solution X.
#[derive(Clone, Debug)]
pub(super) struct Riccati {
    pub(super) x: DMatrix<f64>,
    /// ‖AᵀX + X A − X G X + Q‖ relative to the sum of the norms of its terms.
    pub(super) residual: f64,
    /// Number of Newton steps.
    pub(super) refinements: usize,
}

/// Solves the equation. The callers exclude eigenvalues of H on the imaginary axis.
pub(super) fn solve(a: &DMatrix<f64>, g: &DMatrix<f64>, q: &DMatrix<f64>) -> Result<Riccati, VibrationError> {
    // Scale the states so that A is balanced, and X so that G and Q have equal norms.
    let mut balanced = a.clone();
    let units = DMatrix::from_diagonal(&balance_parlett_reinsch(&mut balanced));
    let back = units.map(|x| if x == 0.0 { 0.0 } else { 1.0 / x });
    let (g, q) = (&back * g * &back, &units * q * &units);
    let size = (q.norm() / g.norm()).sqrt();
    let size = if size.is_normal() { size } else { 1.0 };
    let (g, q) = (g * size, q / size);
    let mut x = by_sign(&balanced, &g, &q)?;
    let mut found = (residual(&balanced, &g, &q, &x), 0);
    for _ in 0..MAX_NEWTON_STEPS {
        let closed = &balanced - &g * &x;
        let Some(change) = lyapunov(&closed, &found.0.0) else { break };
        let next = &x + change;
        let next = 0.5 * (&next + next.transpose());
        let then = residual(&balanced, &g, &q, &next);
        if then.1.is_nan() || then.1 >= found.0.1 {
            break;
        }
        x = next;
        found = (then, found.1 + 1);
    }
    Ok(Riccati { x: &back * (x * size) * &back, residual: found.0.1, refinements: found.1 })
}

/// The residual, and its norm relative to the terms.
fn residual(a: &DMatrix<f64>, g: &DMatrix<f64>, q: &DMatrix<f64>, x: &DMatrix<f64>) -> (DMatrix<f64>, f64) {
    let (linear, square) = (a.tr_mul(x), x * g * x);
    let left = &linear + linear.transpose() - &square + q;
    let size = 2.0 * linear.norm() + square.norm() + q.norm();
    let part = left.norm() / size;
    (left, part)
}

/// X from the sign of the Hamiltonian matrix.
fn by_sign(a: &DMatrix<f64>, g: &DMatrix<f64>, q: &DMatrix<f64>) -> Result<DMatrix<f64>, VibrationError> {
    let n = a.nrows();
    let failed = |iterations, residual| VibrationError::NoConvergence {
        what: "the sign of the Hamiltonian matrix",
        iterations,
        residual,
    };
    // H, then Newton's iteration for its sign.
    let mut z = DMatrix::zeros(2 * n, 2 * n);
    z.view_mut((0, 0), (n, n)).copy_from(a);
    z.view_mut((0, n), (n, n)).copy_from(&-g);
    z.view_mut((n, 0), (n, n)).copy_from(&-q);
    z.view_mut((n, n), (n, n)).copy_from(&-a.transpose());
    let mut change = f64::INFINITY;
    for k in 0..MAX_SIGN_ITERATIONS {
        let factors = z.clone().lu();
        // |det|^{1/2n} without overflow.
        let logarithm: f64 = (0..2 * n).map(|i| factors.lu_internal()[(i, i)].abs().ln()).sum();
        let inverse = factors.try_inverse().ok_or_else(|| failed(k, change))?;
        let c = if change > MIN_CHANGE_TO_SCALE { (-logarithm / (2 * n) as f64).exp() } else { 1.0 };
        let next = (&z * c + inverse / c) * 0.5;
        let now = (&next - &z).norm() / next.norm();
        if !now.is_finite() {
            return Err(failed(k, now));
        }
        let settled = now < CONVERGED_SIGN_CHANGE || (now < STALLED_SIGN_CHANGE && now >= 0.5 * change);
        (z, change) = (next, now);
        if settled {
            break;
        }
    }
    if change > MAX_SIGN_CHANGE {
        return Err(failed(MAX_SIGN_ITERATIONS, change));
    }
    // (S + 1)[1; X] = 0 by least squares.
    let mut left = DMatrix::zeros(2 * n, n);
    left.rows_mut(0, n).copy_from(&z.view((0, n), (n, n)));
    left.rows_mut(n, n).copy_from(&(z.view((n, n), (n, n)) + DMatrix::identity(n, n)));
    let mut right = DMatrix::zeros(2 * n, n);
    right.rows_mut(0, n).copy_from(&-(z.view((0, 0), (n, n)) + DMatrix::identity(n, n)));
    right.rows_mut(n, n).copy_from(&-z.view((n, 0), (n, n)));
    let x =
        left.svd(true, true).solve(&right, f64::EPSILON).map_err(|_| failed(MAX_SIGN_ITERATIONS, change))?;
    Ok(0.5 * (&x + x.transpose()))
}

/// δ with Aᵀδ + δA = −`right`; `None` where two eigenvalues of A sum to zero, or the Schur form does not
/// settle.
fn lyapunov(a: &DMatrix<f64>, right: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = a.nrows();
    let complex = |m: &DMatrix<f64>| m.map(|x| Complex::new(x, 0.0));
    let (u, t) = Schur::try_new(complex(a), f64::EPSILON, MAX_QR_ITERATIONS_PER_ROW * n)?.unpack();
    let c = u.adjoint() * complex(&-right) * &u;
    let mut y: DMatrix<Complex<f64>> = DMatrix::zeros(n, n);
    for j in 0..n {
        // (Tᴴ + t_jj) y_j = c_j − Σ y_k t_kj: lower triangular.
        for i in 0..n {
            let known = (0..j).map(|k| y[(i, k)] * t[(k, j)]).sum::<Complex<f64>>()
                + (0..i).map(|k| t[(k, i)].conj() * y[(k, j)]).sum::<Complex<f64>>();
            let pivot = t[(i, i)].conj() + t[(j, j)];
            if pivot.norm() == 0.0 {
                return None;
            }
            y[(i, j)] = (c[(i, j)] - known) / pivot;
        }
    }
    let found = (&u * y * u.adjoint()).map(|x| x.re);
    found.iter().all(|x| x.is_finite()).then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lyapunov_equations_are_solved() {
        let a = DMatrix::from_row_slice(3, 3, &[-1.0, 2.0, 0.3, -2.5, -0.4, 1.0, 0.0, 0.1, -3.0]);
        let right = DMatrix::from_row_slice(3, 3, &[2.0, 0.5, 0.1, 0.5, 1.0, -0.3, 0.1, -0.3, 4.0]);
        let x = lyapunov(&a, &right).expect("a stable matrix");
        assert!((a.tr_mul(&x) + &x * &a + right).amax() < 1e-14);
    }

    /// X = 2 for ẋ = x + w with cost 0·x² + w²: the least energy that stabilises mirrors the eigenvalue.
    #[test]
    fn the_least_energy_that_stabilises_mirrors_the_eigenvalue() {
        let one = DMatrix::identity(1, 1);
        let found = solve(&one, &one, &DMatrix::zeros(1, 1)).expect("solved");
        assert!((found.x[(0, 0)] - 2.0).abs() < 1e-14, "{found:?}");
        let found = solve(&one, &one, &DMatrix::from_element(1, 1, 1e-12)).expect("solved");
        assert!((found.x[(0, 0)] - (1.0 + (1.0 + 1e-12f64).sqrt())).abs() < 1e-12, "{found:?}");
    }
}

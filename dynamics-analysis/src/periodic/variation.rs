//! Derivatives of the constrained accelerations along a motion.
//!
//! If the engine generated ∂q̈/∂q and ∂q̈/∂q̇, they are used. Otherwise, for example if rows repeat each
//! other, the unsolved equations are differentiated: with r = M q̈ − Q − Φ_qᵀλ and Φ̈ = Φ_q q̈ − γ
//!
//! ```text
//! M δq̈ + r_q δq + r_u δq̇ = Φ_qᵀ δλ        Φ_q δq̈ + Φ̈_q δq + Φ̈_u δq̇ = 0
//! δq̈ = E a + p,  p the dependent part of Φ_q p = −(Φ̈_q δq + Φ̈_u δq̇)
//! EᵀM E a = −Eᵀ(r_q δq + r_u δq̇ + M p)
//! ```
//!
//! E spans the velocities that the rows leave. δλ need not be unique and is not computed.

use alloc::vec::Vec;

use dynamics_runtime::model::{Constraints, Vector};
use nalgebra::DMatrix;

use crate::LinearizeError;
use crate::linearize::{ModelDerivatives, Tangent};

/// ∂q̈/∂q and ∂q̈/∂q̇ at a state, N×N by rows.
pub(super) fn derivatives<M: Constraints>(
    model: &M,
    state: &M::State,
    by: &mut [Vec<f64>; 2],
) -> Result<(), LinearizeError> {
    let [by_q, by_u] = by;
    if !model.acceleration_derivatives(state, by_q, by_u) {
        solve(model, state, by)?;
    }
    if by.iter().flatten().all(|x| x.is_finite()) { Ok(()) } else { Err(LinearizeError::NotFinite) }
}

/// By the equations before their solution.
pub(super) fn solve<M: Constraints>(
    model: &M,
    state: &M::State,
    by: &mut [Vec<f64>; 2],
) -> Result<(), LinearizeError> {
    let n = M::Vector::LEN;
    let read = ModelDerivatives::of(model, state)?;
    let tangent = Tangent::new(&read.jacobian, read.holonomic, &read.mass, [&[]; 2]);
    let e = &tangent.velocities;
    let factors = e.tr_mul(&(&read.mass * e)).cholesky().ok_or(LinearizeError::Inertia)?;
    for ((by, force_by), rows_by) in by.iter_mut().zip(&read.force_by).zip(&read.gamma_by) {
        let dependent = tangent.particular(rows_by);
        let free = factors.solve(&e.tr_mul(&(force_by + &read.mass * &dependent)));
        let found: DMatrix<f64> = dependent - e * free;
        (0..n * n).for_each(|k| by[k] = found[(k / n, k % n)]);
    }
    Ok(())
}

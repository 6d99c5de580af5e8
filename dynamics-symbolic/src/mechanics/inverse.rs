//! Derivatives of q̈ by the implicit function theorem: with r(q̈; x) = M q̈ − Q = 0, ∂q̈/∂x = −M⁻¹ ∂r/∂x at fixed q̈.

use crate::algebra::Factors;
use crate::calculus::{ZeroDenominator, gradient, substitute};
use crate::graph::{Dependence, Graph, NodeId, Symbol};

/// r = M q̈ − Q with symbols for q̈.
pub(super) fn residual(g: &mut Graph, mass: &[Vec<NodeId>], force: &[NodeId]) -> Vec<NodeId> {
    let n = force.len();
    (0..n)
        .map(|i| {
            let mut sum = g.neg(force[i]);
            for (j, entry) in mass[i].iter().enumerate() {
                let a = g.symbol(Symbol::Acceleration(j as u32));
                let term = g.mul(*entry, a);
                sum = g.add(sum, term);
            }
            sum
        })
        .collect()
}

/// ∂q̈/∂x for the given symbols x: one row per coordinate.
pub(super) fn jacobian(
    g: &mut Graph,
    residual: &[NodeId],
    factors: &Factors,
    accelerations: &[NodeId],
    by: &[Symbol],
) -> Result<Vec<Vec<NodeId>>, ZeroDenominator> {
    let minus = g.integer(-1);
    let rows: Vec<Vec<NodeId>> = residual.iter().map(|r| gradient(g, &[(*r, minus)], by)).collect();
    let flat: Vec<NodeId> = rows.into_iter().flatten().collect();
    let flat = with_accelerations(g, &flat, accelerations)?;
    let n = residual.len();
    let mut result = vec![Vec::with_capacity(by.len()); n];
    for column in 0..by.len() {
        let right: Vec<NodeId> = (0..n).map(|i| flat[i * by.len() + column]).collect();
        for (row, x) in result.iter_mut().zip(factors.solve(g, &right)) {
            row.push(x);
        }
    }
    Ok(result)
}

/// Replaces the symbols q̈ by their values.
pub(super) fn with_accelerations(
    g: &mut Graph,
    roots: &[NodeId],
    accelerations: &[NodeId],
) -> Result<Vec<NodeId>, ZeroDenominator> {
    if roots.iter().all(|r| !g.dependence(*r).on(Dependence::ACCELERATIONS)) {
        return Ok(roots.to_vec());
    }
    substitute(g, roots, &mut |_, s| match s {
        Symbol::Acceleration(i) => accelerations.get(i as usize).copied(),
        _ => None,
    })
}

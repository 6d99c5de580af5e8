//! Derivatives of q̈ by the implicit function theorem: with r(q̈; x) = M q̈ − Q = 0, ∂q̈/∂x = −M⁻¹ ∂r/∂x at fixed q̈.

use crate::algebra::Factors;
use crate::calculus::{ZeroDenominator, directional, gradient, substitute};
use crate::graph::{Dependence, Graph, NodeId, Symbol};

/// r = M q̈ − Q with symbols for q̈: from the entries of M and Q, or as `swept` where that takes fewer operations beside them.
pub(super) fn residual(g: &mut Graph, mass: &[Vec<NodeId>], force: &[NodeId], swept: Vec<NodeId>) -> Vec<NodeId> {
    let mut entered = Vec::with_capacity(force.len());
    for (row, f) in mass.iter().zip(force) {
        let mut sum = g.neg(*f);
        for (j, entry) in row.iter().enumerate() {
            let a = g.symbol(Symbol::Acceleration(j as u32));
            let term = g.mul(*entry, a);
            sum = g.add(sum, term);
        }
        entered.push(sum);
    }
    let known: Vec<NodeId> = mass.iter().flatten().chain(force).copied().collect();
    let operations = |g: &Graph, r: &[NodeId]| g.operations(&[r, &known].concat());
    if operations(g, &entered) <= operations(g, &swept) { entered } else { swept }
}

/// How ∂r/∂x is swept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sweep {
    /// One forward sweep per symbol x.
    Forward,
    /// One reverse sweep per coordinate.
    Reverse,
}

/// What all derivatives of q̈ need.
pub(super) struct Implicit<'a> {
    /// r with symbols for q̈.
    pub(super) residual: &'a [NodeId],
    /// Factors of M.
    pub(super) factors: &'a Factors,
    /// q̈.
    pub(super) accelerations: &'a [NodeId],
}

impl Implicit<'_> {
    /// ∂q̈/∂x for the given symbols x: one row per coordinate.
    pub(super) fn jacobian(
        &self,
        g: &mut Graph,
        by: &[Symbol],
        sweep: Sweep,
    ) -> Result<Vec<Vec<NodeId>>, ZeroDenominator> {
        let columns: Vec<Vec<NodeId>> = match sweep {
            Sweep::Forward => {
                by.iter().map(|x| directional(g, self.residual, &mut |g, s| (s == *x).then(|| g.integer(-1)))).collect()
            }
            Sweep::Reverse => {
                let minus = g.integer(-1);
                let rows: Vec<_> = self.residual.iter().map(|r| gradient(g, &[(*r, minus)], by)).collect();
                (0..by.len()).map(|j| rows.iter().map(|row| row[j]).collect()).collect()
            }
        };
        let mut result = vec![Vec::with_capacity(by.len()); self.residual.len()];
        for column in columns {
            let right = with_accelerations(g, &column, self.accelerations)?;
            for (row, x) in result.iter_mut().zip(self.factors.solve(g, &right)) {
                row.push(x);
            }
        }
        Ok(result)
    }
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

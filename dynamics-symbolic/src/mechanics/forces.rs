//! Generalized forces: Fᵀ∂p/∂q for a force at a point, magnitude·∂e/∂q along an expression, −∂D/∂q̇ for
//! dissipation.

use crate::calculus::gradient;
use crate::graph::{Graph, NodeId, Symbol};

use super::model::symbols;
use super::model::{Force, ForceTerm};

/// The generalized force of an applied force.
pub(super) fn generalized(g: &mut Graph, force: &Force, n: usize) -> Vec<NodeId> {
    let mut seeded = Vec::new();
    for term in &force.terms {
        match term {
            ForceTerm::At { point, vector } => {
                seeded.extend(point.iter().copied().zip(vector.iter().copied()))
            }
            ForceTerm::Along { expression, magnitude } => seeded.push((*expression, *magnitude)),
        }
    }
    // ∂ṗ/∂q̇ = ∂p/∂q, so the positions themselves are swept.
    gradient(g, &seeded, &symbols(n, Symbol::Coordinate))
}

/// −∂D/∂q̇.
pub(super) fn dissipated(g: &mut Graph, dissipation: NodeId, n: usize) -> Vec<NodeId> {
    let minus = g.integer(-1);
    gradient(g, &[(dissipation, minus)], &symbols(n, Symbol::Rate))
}

/// Σ fᵢ q̇ᵢ.
pub(super) fn power(g: &mut Graph, force: &[NodeId]) -> NodeId {
    let mut sum = g.zero();
    for (i, f) in force.iter().enumerate() {
        let rate = g.symbol(Symbol::Rate(i as u32));
        let term = g.mul(*f, rate);
        sum = g.add(sum, term);
    }
    sum
}

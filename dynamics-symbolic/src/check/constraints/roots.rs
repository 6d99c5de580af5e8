//! A row that is a root or a power of something, as √f or ∛f, holds where f = 0, and there its gradient pf_q
//! f^(p−1) is infinite (p < 1) or zero (p > 1).
//!
//! Descents onto Φ = 0 do not tell: those of √f step to where f < 0 and have no value there.

use crate::graph::{Binary, Dependence, Graph, Node, NodeId, Unary};
use crate::mechanics::Model;

use super::contents::foreign;
use crate::check::finding::ConstraintFinding;

/// Holonomic rows that are roots of what moves. One finding per row.
pub(super) fn roots(model: &Model, found: &mut Vec<ConstraintFinding>) {
    for c in model.constraints.iter().filter(|c| c.is_holonomic()) {
        for (suffix, node) in &c.components {
            if !foreign(model.graph.dependence(*node)) && is_root(&model.graph, *node) {
                found.push(ConstraintFinding::GradientVanishes {
                    name: format!("{}{suffix}", c.name),
                    origin: c.origin,
                });
            }
        }
    }
}

/// Whether a value is a root or a power of something that moves, or a multiple of one by what does not.
fn is_root(g: &Graph, id: NodeId) -> bool {
    let moves = |x: NodeId| g.dependence(x).on(Dependence::COORDINATES);
    match g.node(id) {
        Node::Unary(Unary::Sqrt | Unary::Cbrt, a) => moves(a),
        Node::Binary(Binary::Powf, a, p) => {
            moves(a) && g.as_number(p).is_some_and(|p| p.value() > 0.0 && p.value() != 1.0)
        }
        Node::Neg(a) => is_root(g, a),
        Node::Mul(a, b) if !moves(a) => is_root(g, b),
        Node::Mul(a, b) | Node::Div(a, b) => !moves(b) && is_root(g, a),
        _ => false,
    }
}

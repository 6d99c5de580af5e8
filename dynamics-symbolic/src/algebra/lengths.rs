//! Guards against gradients that vanish: at a change point a row of Φ_q may be rounding alone, and a pivot
//! that is compared with the other elements of that row does not show it.

use std::collections::BTreeMap;

use crate::graph::{Graph, Node, NodeId, Unary};

use super::sparse::dot;
use super::unrolled::{Guard, Guarded};

/// Length of a row, relative to its natural size, below which it counts as vanished. At a distance d from the
/// place where it vanishes, velocities are uncertain by ε/d and accelerations by ε/d². At d = 10⁻⁸ no
/// digit of an acceleration is left.
const LEAST_ROW_LENGTH: f64 = 1e-8;

/// ‖row‖² against the sum of the squares of its terms, sines and cosines at their largest: what rounding of
/// the row is relative to. Rows with an element that never vanishes need none.
pub(super) fn guards(g: &mut Graph, jacobian: &[Vec<NodeId>], needed: impl Fn(usize) -> bool) -> Vec<Guard> {
    let mut known = BTreeMap::new();
    let mut guards = Vec::new();
    for (row, entries) in jacobian.iter().enumerate().filter(|(row, _)| needed(*row)) {
        let entries: Vec<NodeId> = entries.iter().copied().filter(|x| !g.is_zero(*x)).collect();
        if entries.iter().any(|x| g.is_constant(*x)) {
            continue;
        }
        // Differences of coordinates are exact where they are small.
        let turns = |id: &NodeId| matches!(g.node(*id), Node::Unary(Unary::Sin | Unary::Cos, _));
        if !g.cone(&entries).iter().any(turns) {
            continue;
        }
        let pivot = dot(g, &entries, &entries);
        if g.is_constant(pivot) {
            continue;
        }
        let mut scale = g.zero();
        for x in entries {
            let size = squares(g, x, &mut known);
            scale = g.add(scale, size);
        }
        guards.push(Guard {
            of: Guarded::Row(row),
            pivot,
            scale,
            tolerance: LEAST_ROW_LENGTH * LEAST_ROW_LENGTH,
        });
    }
    guards
}

/// The sum of the squares of the terms that a node is made of.
fn squares(g: &mut Graph, root: NodeId, known: &mut BTreeMap<NodeId, NodeId>) -> NodeId {
    // Children have smaller ids than their parents: no recursion.
    for id in g.cone(&[root]) {
        if known.contains_key(&id) {
            continue;
        }
        let value = match g.node(id) {
            Node::Add(a, b) | Node::Sub(a, b) => {
                let (a, b) = (known[&a], known[&b]);
                g.add(a, b)
            }
            Node::Mul(a, b) => {
                let (a, b) = (known[&a], known[&b]);
                g.mul(a, b)
            }
            Node::Neg(a) => known[&a],
            Node::Unary(Unary::Sin | Unary::Cos, _) => g.one(),
            _ => g.mul(id, id),
        };
        known.insert(id, value);
    }
    known[&root]
}

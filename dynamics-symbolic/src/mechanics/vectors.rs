//! Vectors and matrices of three on the graph.

use crate::graph::{Graph, NodeId};

/// A vector.
pub(super) type V3 = [NodeId; 3];
/// A matrix by rows.
pub(super) type M3 = [V3; 3];

pub(super) fn zero(g: &Graph) -> V3 {
    [g.zero(); 3]
}

pub(super) fn added(g: &mut Graph, a: &V3, b: &V3) -> V3 {
    [0, 1, 2].map(|i| g.add(a[i], b[i]))
}

pub(super) fn dot(g: &mut Graph, a: &V3, b: &V3) -> NodeId {
    (0..3).fold(g.zero(), |sum, i| {
        let term = g.mul(a[i], b[i]);
        g.add(sum, term)
    })
}

pub(super) fn cross(g: &mut Graph, a: &V3, b: &V3) -> V3 {
    [0, 1, 2].map(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let (forward, backward) = (g.mul(a[j], b[k]), g.mul(a[k], b[j]));
        g.sub(forward, backward)
    })
}

pub(super) fn scaled(g: &mut Graph, factor: NodeId, v: &V3) -> V3 {
    v.map(|x| g.mul(factor, x))
}

/// m·v.
pub(super) fn turned(g: &mut Graph, m: &M3, v: &V3) -> V3 {
    m.each_ref().map(|row| dot(g, row, v))
}

pub(super) fn transposed(m: &M3) -> M3 {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| m[j][i]))
}

//! What decides the choices in an expression. The derivative of a choice is that of the branch taken and says
//! nothing of the jump where it switches: what is invariant has deciding functions that are invariant too.

use crate::graph::{Binary, Fingerprint, Graph, Node, NodeId, Unary};

/// The functions whose sign decides `if`, `min`, `max`, `abs` and `signum` in the expressions: left − right,
/// or the argument.
pub(super) fn deciders(g: &mut Graph, roots: &[NodeId]) -> Vec<NodeId> {
    let mut found: Vec<(Fingerprint, NodeId)> = Vec::new();
    for id in g.cone(roots) {
        let decider = match g.node(id) {
            Node::Select { left, right, .. } | Node::Binary(Binary::Min | Binary::Max, left, right) => {
                g.sub(left, right)
            }
            Node::Unary(Unary::Abs | Unary::Signum, argument) => argument,
            _ => continue,
        };
        let value = g.fingerprint(decider);
        if found.iter().all(|(known, _)| *known != value && *known != value.neg()) {
            found.push((value, decider));
        }
    }
    found.into_iter().map(|(_, decider)| decider).collect()
}

//! Forward sweep: directional derivatives.

use crate::graph::{Graph, Node, NodeId, Symbol};

use super::local::{BranchChoice, partials};

/// Derivatives of `roots` along the direction in which every symbol s moves with velocity `seed(s)` (`None`:
/// it does not move).
pub fn directional(
    g: &mut Graph,
    roots: &[NodeId],
    seed: &mut dyn FnMut(&mut Graph, Symbol) -> Option<NodeId>,
) -> Vec<NodeId> {
    let ids = g.cone(roots);
    let end = ids.last().map_or(0, |id| id.index() + 1);
    let mut tangent: Vec<Option<NodeId>> = vec![None; end];
    for id in ids {
        let node = g.node(id);
        if let Node::Symbol(s) = node {
            tangent[id.index()] = seed(g, s);
            continue;
        }
        if node.children().all(|c| tangent[c.index()].is_none()) {
            continue;
        }
        if let Some(choice) = BranchChoice::of(node) {
            let zero = g.zero();
            let [then, otherwise] =
                [choice.then, choice.otherwise].map(|c| tangent[c.index()].unwrap_or(zero));
            let chosen = choice.between(g, then, otherwise);
            tangent[id.index()] = Some(chosen).filter(|s| !g.is_zero(*s));
            continue;
        }
        let locals = partials(g, id, &|c| tangent[c.index()].is_some());
        let mut sum: Option<NodeId> = None;
        for (child, partial) in locals {
            let Some(speed) = tangent[child.index()] else { continue };
            let term = g.mul(partial, speed);
            sum = Some(match sum {
                Some(s) => g.add(s, term),
                None => term,
            });
        }
        tangent[id.index()] = sum.filter(|s| !g.is_zero(*s));
    }
    let zero = g.zero();
    roots.iter().map(|r| tangent[r.index()].unwrap_or(zero)).collect()
}

//! Terms that do not change with the index of the round, though they are written with it.
//!
//! A place is `pitch * i + s[i]`, so the length of an element is the difference of two places: the index
//! cancels. Evaluated as written, that costs operations, and digits where the index is large. Here every part
//! whose value is the same for all indices is written for index 0.

use crate::calculus::rebuild;
use crate::graph::{Graph, NodeId, Symbol};
use crate::mechanics::ForceTerm;

use super::model::{FamilyModel, Source, TermKind};

/// Rewrites all terms. Values stay as they are.
pub(super) fn drop_index(model: &mut FamilyModel) {
    for index in 0..model.sources.len() {
        if matches!(model.sources[index], Source::Round(_)) {
            drop_one(model, Symbol::Parameter(index as u32));
        }
    }
}

fn drop_one(model: &mut FamilyModel, index: Symbol) {
    let g = &mut model.model.graph;
    let index = g.symbol(index);
    let mut places: Vec<&mut NodeId> = Vec::new();
    for term in &mut model.terms {
        match &mut term.kind {
            TermKind::Energy(_, id) => places.push(id),
            TermKind::Force(forces) => {
                for force in forces {
                    match force {
                        ForceTerm::At { point, vector } => places.extend(point.iter_mut().chain(vector)),
                        ForceTerm::Along { expression, magnitude } => {
                            places.extend([expression, magnitude]);
                        }
                    }
                }
            }
        }
    }
    let roots: Vec<NodeId> = places.iter().map(|id| **id).collect();
    let new = g.afresh(&[], |g| without(g, &roots, index));
    places.into_iter().zip(new).for_each(|(place, new)| *place = new);
}

/// The roots, with the index only where their values change with it.
fn without(g: &mut Graph, roots: &[NodeId], index: NodeId) -> Vec<NodeId> {
    let ids = g.cone(roots);
    let end = ids.last().map_or(0, |id| id.index() + 1);
    // For every node: whether the index is in it, its form at index 0, and its new form.
    let mut reads = vec![false; end];
    let mut at_zero: Vec<Option<NodeId>> = vec![None; end];
    let mut new: Vec<Option<NodeId>> = vec![None; end];
    for id in ids {
        let (k, node) = (id.index(), g.node(id));
        reads[k] = id == index || node.children().any(|child| reads[child.index()]);
        let form = |of: &[Option<NodeId>], child: NodeId| of[child.index()].unwrap_or(child);
        // A division by zero at index 0 leaves the node as it is. The form at index 0 comes first: a node
        // that is there already would stand for it.
        if id == index {
            at_zero[k] = Some(g.zero());
        } else if reads[k] && node.children().all(|child| at_zero[child.index()].is_some()) {
            at_zero[k] = rebuild(g, node, &|child| form(&at_zero, child)).ok();
        }
        new[k] = at_zero[k].filter(|zero| g.fingerprint(*zero) == g.fingerprint(id));
        if new[k].is_none() {
            new[k] = rebuild(g, node, &|child| form(&new, child)).ok();
        }
        if !reads[k] {
            at_zero[k] = new[k];
        }
    }
    roots.iter().map(|root| new[root.index()].unwrap_or(*root)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// (pitch (i + 1) + b) − (pitch i + a) becomes pitch + b − a; the product with i keeps its index.
    #[test]
    fn an_index_that_cancels_is_gone() {
        let mut g = Graph::new();
        let [pitch, i] = [0, 1].map(|k| g.symbol(Symbol::Parameter(k)));
        let [a, b] = [0, 1].map(|k| g.symbol(Symbol::Coordinate(k)));
        let one = g.one();
        let next = g.add(i, one);
        let (far, near) = (g.mul(pitch, next), g.mul(pitch, i));
        let (far, near) = (g.add(far, b), g.add(near, a));
        let length = g.sub(far, near);
        let weighted = g.mul(length, i);
        let before = [length, weighted].map(|id| g.fingerprint(id));
        let new = g.afresh(&[], |g| without(g, &[length, weighted], i));
        assert_eq!([new[0], new[1]].map(|id| g.fingerprint(id)), before);
        assert!(!g.cone(&new[..1]).contains(&i) && g.cone(&new[1..]).contains(&i));
        assert_eq!(g.operations(&new[..1]), 2);
    }
}

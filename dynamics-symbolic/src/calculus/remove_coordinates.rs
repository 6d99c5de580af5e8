//! Expressions that are written with coordinates and do not depend on them.

use super::substitute::substitute;
use crate::graph::{Dependence, Graph, NodeId, Number, Sampler, Symbol};

/// `roots`, where each that contains coordinates but does not depend on them is replaced by its form at a
/// place where that is short.
///
/// The inertia of a body in its own axes follows from that in coordinates, with all their sines and cosines.
/// Multiplied out, it is a sum of products of parameters, of which no node exists yet. Where coordinates are
/// 0, or one of them is 1, it folds to that sum. A root that has no value in any of these places stays as it
/// is.
#[must_use]
pub fn remove_coordinates(g: &mut Graph, roots: &[NodeId]) -> Vec<NodeId> {
    let [here, there] = {
        let sampler = Sampler::new(g, roots);
        let moved = |s| matches!(s, Symbol::Coordinate(_));
        [0, 1].map(|point| sampler.with(&mut |s| sampler.random(s, if moved(s) { point } else { 0 })))
    };
    let mut all = roots.to_vec();
    for (root, (a, b)) in all.iter_mut().zip(here.into_iter().zip(there)) {
        if a == b && g.dependence(*root).on(Dependence::COORDINATES) {
            *root = in_some_place(g, *root);
        }
    }
    all
}

/// A value that does not depend on coordinates, in the first place in which it has one.
fn in_some_place(g: &mut Graph, root: NodeId) -> NodeId {
    let mut read: Vec<u32> = Vec::new();
    for id in g.cone(&[root]) {
        if let crate::graph::Node::Symbol(Symbol::Coordinate(i)) = g.node(id) {
            read.push(i);
        }
    }
    for one in std::iter::once(None).chain(read.into_iter().map(Some)) {
        let [zero, unit] = [0, 1].map(|n| g.number(Number::integer(n)));
        let place = |_: &mut Graph, s| match s {
            Symbol::Coordinate(i) if Some(i) == one => Some(unit),
            Symbol::Coordinate(_) => Some(zero),
            _ => None,
        };
        if let Ok(folded) = substitute(g, &[root], &mut { place })
            && g.fingerprint(folded[0]) == g.fingerprint(root)
            && !g.dependence(folded[0]).on(Dependence::COORDINATES)
        {
            return folded[0];
        }
    }
    root
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::Unary;

    #[test]
    fn a_turned_inertia_is_that_of_the_body() {
        let mut g = Graph::new();
        let [angle, a, b] =
            [Symbol::Coordinate(0), Symbol::Parameter(0), Symbol::Parameter(1)].map(|s| g.symbol(s));
        let [sin, cos] = [Unary::Sin, Unary::Cos].map(|f| g.unary(f, angle));
        // (a + b) cos² + (a + b) sin², term by term, beside what moves.
        let mut sum = g.zero();
        for (factor, f) in [(a, cos), (b, sin), (b, cos), (a, sin)] {
            let once = g.mul(factor, f);
            let twice = g.mul(once, f);
            sum = g.add(sum, twice);
        }
        let moving = g.mul(a, sin);
        assert!(!g.is_constant(sum));
        let found = remove_coordinates(&mut g, &[sum, moving]);
        assert!(g.is_constant(found[0]) && g.cone(&found[..1]).len() == 3, "a + b");
        assert_eq!(found[1], moving);
    }
}

//! Forces along a line between two places, in few operations.
//!
//! The force of a spring of length l is (a l + b) d/l, where d is the difference of two places and a and b
//! depend on parameters alone. As derived it is `-(1/p)·(d·((a·(l/p − 1) + b)·(1/l)))`: a dozen operations
//! for each element, whatever the number of its components. Here a quotient of a sum and a root becomes a
//! sum, so that one factor c = a + b/l is left, which takes up what depends on parameters alone: the force is
//! d·c.

use crate::graph::{Dependence, Graph, Node, NodeId, Unary};

/// A product in parts.
struct Product {
    /// What depends on parameters alone, with the sign.
    constant: NodeId,
    /// The other factors.
    factors: Vec<NodeId>,
    /// The other divisors.
    divisors: Vec<NodeId>,
}

/// The forces, rewritten where that takes fewer operations. Values stay as they are.
pub(super) fn shorten(g: &mut Graph, forces: &mut [(usize, NodeId)]) {
    let roots: Vec<NodeId> = forces.iter().map(|(_, force)| *force).collect();
    let before = g.weight(&roots);
    // Parts that stay stand for their values; the forces are built anew.
    let kept: Vec<NodeId> = roots.iter().flat_map(|root| parts(g, *root)).collect();
    let kept = g.cone(&kept);
    let new = g.afresh(&kept, |g| roots.iter().map(|root| spring(g, *root)).collect::<Vec<_>>());
    let same = roots.iter().zip(&new).all(|(old, new)| g.fingerprint(*old) == g.fingerprint(*new));
    if same && g.weight(&new) < before {
        forces.iter_mut().zip(new).for_each(|((_, force), new)| *force = new);
    }
}

fn is_constant(g: &Graph, id: NodeId) -> bool {
    g.dependence(id).within(Dependence::PARAMETERS)
}

/// The factors and divisors of a force that stay as they are: all but sums with a root.
fn parts(g: &mut Graph, force: NodeId) -> Vec<NodeId> {
    if let Node::Add(x, y) | Node::Sub(x, y) = g.node(force) {
        let both = [x, y].map(|term| parts(g, term));
        return both.concat();
    }
    let Product { factors, divisors, .. } = product(g, force);
    let mut parts = divisors;
    let roots: Vec<NodeId> = parts.clone();
    let is_law = |g: &mut Graph, id: NodeId| roots.iter().any(|root| law(g, id, *root).is_some());
    for factor in factors {
        if !is_law(g, factor) {
            parts.push(factor);
        }
    }
    parts
}

/// A force in its short form: a product, or a sum of such.
fn spring(g: &mut Graph, force: NodeId) -> NodeId {
    match g.node(force) {
        Node::Add(x, y) => {
            let [x, y] = [x, y].map(|term| spring(g, term));
            return g.add(x, y);
        }
        Node::Sub(x, y) => {
            let [x, y] = [x, y].map(|term| spring(g, term));
            return g.sub(x, y);
        }
        _ => {}
    }
    let Product { constant, mut factors, divisors } = product(g, force);
    let found = divisors.iter().enumerate().find_map(|(d, root)| {
        let found = factors.iter().enumerate().find_map(|(f, id)| Some((f, law(g, *id, *root)?)));
        found.map(|(f, law)| (d, f, law))
    });
    let Some((d, f, [slope, rest])) = found else { return force };
    factors.remove(f);
    // a + b/l, with the constant in a and b.
    let (a, b) = (g.mul(constant, slope), g.mul(constant, rest));
    let Some(b) = g.div(b, divisors[d]) else { return force };
    let mut result = g.add(a, b);
    for factor in factors {
        result = g.mul(factor, result);
    }
    for (k, divisor) in divisors.iter().enumerate() {
        if k != d {
            let Some(quotient) = g.div(result, *divisor) else { return force };
            result = quotient;
        }
    }
    result
}

/// A product in parts: through products, quotients and changes of sign.
fn product(g: &mut Graph, id: NodeId) -> Product {
    let mut all = Product { constant: g.one(), factors: Vec::new(), divisors: Vec::new() };
    let mut left = vec![(id, false)];
    while let Some((id, below)) = left.pop() {
        if is_constant(g, id) {
            let with = if below { g.div(all.constant, id) } else { Some(g.mul(all.constant, id)) };
            match (with, below) {
                (Some(with), _) => all.constant = with,
                (None, true) => all.divisors.push(id),
                (None, false) => all.factors.push(id),
            }
            continue;
        }
        match g.node(id) {
            Node::Mul(a, b) => left.extend([(b, below), (a, below)]),
            Node::Div(a, b) => left.extend([(b, !below), (a, below)]),
            Node::Neg(a) => {
                all.constant = g.neg(all.constant);
                left.push((a, below));
            }
            _ if below => all.divisors.push(id),
            _ => all.factors.push(id),
        }
    }
    all
}

/// A sum as a·root + b with a and b of parameters alone: [a, b].
fn law(g: &mut Graph, sum: NodeId, root: NodeId) -> Option<[NodeId; 2]> {
    if !matches!(g.node(root), Node::Unary(Unary::Sqrt, _)) {
        return None;
    }
    let zero = g.zero();
    if sum == root {
        return Some([g.one(), zero]);
    }
    if is_constant(g, sum) {
        return Some([zero, sum]);
    }
    match g.node(sum) {
        Node::Add(x, y) => {
            let ([a, b], [c, d]) = (law(g, x, root)?, law(g, y, root)?);
            Some([g.add(a, c), g.add(b, d)])
        }
        Node::Sub(x, y) => {
            let ([a, b], [c, d]) = (law(g, x, root)?, law(g, y, root)?);
            Some([g.sub(a, c), g.sub(b, d)])
        }
        Node::Neg(x) => Some(law(g, x, root)?.map(|part| g.neg(part))),
        Node::Mul(x, y) if is_constant(g, x) => Some(law(g, y, root)?.map(|part| g.mul(x, part))),
        Node::Mul(x, y) if is_constant(g, y) => Some(law(g, x, root)?.map(|part| g.mul(y, part))),
        Node::Div(x, y) if is_constant(g, y) => {
            let [a, b] = law(g, x, root)?;
            Some([g.div(a, y)?, g.div(b, y)?])
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::Symbol;

    /// −(1/p)·(x·((a·(l/p − 1) + b)/l)) and the same with y: one root, one quotient, one sum and two
    /// products.
    #[test]
    fn a_spring_is_a_factor_and_a_direction() {
        let mut g = Graph::new();
        let [p, a, b] = [0, 1, 2].map(|k| g.symbol(Symbol::Parameter(k)));
        let [x, y] = [0, 1].map(|k| g.symbol(Symbol::Coordinate(k)));
        let (xx, yy) = (g.mul(x, x), g.mul(y, y));
        let square = g.add(xx, yy);
        let root = g.unary(Unary::Sqrt, square);
        let by_pitch = g.div(root, p).expect("not zero");
        let one = g.one();
        let stretch = g.sub(by_pitch, one);
        let pull = g.mul(a, stretch);
        let pull = g.add(pull, b);
        let factor = g.div(pull, root).expect("not zero");
        let factor = g.div(factor, p).expect("not zero");
        let mut forces: Vec<(usize, NodeId)> = [x, y].iter().map(|d| (0, g.mul(*d, factor))).collect();
        forces.iter_mut().for_each(|(_, force)| *force = g.neg(*force));
        let before: Vec<_> = forces.iter().map(|(_, force)| g.fingerprint(*force)).collect();
        let roots: Vec<NodeId> = forces.iter().map(|(_, force)| *force).collect();
        let long = g.weight(&roots);
        shorten(&mut g, &mut forces);
        let roots: Vec<NodeId> = forces.iter().map(|(_, force)| *force).collect();
        let after: Vec<_> = roots.iter().map(|force| g.fingerprint(*force)).collect();
        assert_eq!(before, after);
        let moving = |id: &NodeId| !is_constant(&g, *id);
        let cone: Vec<NodeId> = g.cone(&roots).into_iter().filter(moving).collect();
        let count = |is: fn(&Node) -> bool| cone.iter().filter(|id| is(&g.node(**id))).count();
        // Two squares, two directions and what both parts of c share; one quotient; the sum of the squares
        // and that of c.
        assert_eq!(count(|node| matches!(node, Node::Mul(..))), 5);
        assert_eq!(count(|node| matches!(node, Node::Div(..))), 1);
        assert_eq!(count(|node| matches!(node, Node::Add(..) | Node::Sub(..))), 2);
        assert!(g.weight(&roots) < long);
    }

    /// What is no spring stays.
    #[test]
    fn other_forces_stay() {
        let mut g = Graph::new();
        let [x, y] = [0, 1].map(|k| g.symbol(Symbol::Coordinate(k)));
        let root = g.unary(Unary::Sqrt, y);
        let sum = g.add(x, root);
        let force = g.div(sum, root).expect("not zero");
        let mut forces = [(0, force)];
        shorten(&mut g, &mut forces);
        assert_eq!(forces[0].1, force);
    }
}

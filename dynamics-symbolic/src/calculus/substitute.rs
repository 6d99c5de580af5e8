//! Replacing symbols.

use crate::graph::{Graph, Node, NodeId, Symbol};

/// A quotient whose denominator became identically zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ZeroDenominator;

/// `roots` with every symbol s replaced by `value(s)` (`None`: kept).
///
/// # Errors
/// A denominator that becomes identically zero.
pub fn substitute(
    g: &mut Graph,
    roots: &[NodeId],
    value: &mut dyn FnMut(&mut Graph, Symbol) -> Option<NodeId>,
) -> Result<Vec<NodeId>, ZeroDenominator> {
    replace(g, roots, &mut |g, id| match g.node(id) {
        Node::Symbol(s) => value(g, s),
        _ => None,
    })
}

/// `roots` with every node n that they contain replaced by `by(n)` (`None`: kept, made of what its children
/// became).
///
/// # Errors
/// A denominator that becomes identically zero.
pub(super) fn replace(
    g: &mut Graph,
    roots: &[NodeId],
    by: &mut dyn FnMut(&mut Graph, NodeId) -> Option<NodeId>,
) -> Result<Vec<NodeId>, ZeroDenominator> {
    let ids = g.cone(roots);
    let end = ids.last().map_or(0, |id| id.index() + 1);
    let mut new: Vec<Option<NodeId>> = vec![None; end];
    for id in ids {
        let node = g.node(id);
        new[id.index()] = by(g, id);
        if new[id.index()].is_none() && node.children().any(|c| new[c.index()].is_some()) {
            new[id.index()] = Some(rebuild(g, node, &|c| new[c.index()].unwrap_or(c))?);
        }
    }
    Ok(roots.iter().map(|r| new[r.index()].unwrap_or(*r)).collect())
}

/// An operation on what its arguments became, be it in another graph.
///
/// # Errors
/// A denominator that becomes identically zero.
pub(crate) fn rebuild(
    g: &mut Graph,
    node: Node,
    at: &dyn Fn(NodeId) -> NodeId,
) -> Result<NodeId, ZeroDenominator> {
    Ok(match node {
        Node::Number(n) => g.number(n),
        Node::Symbol(s) => g.symbol(s),
        Node::Add(a, b) => g.add(at(a), at(b)),
        Node::Sub(a, b) => g.sub(at(a), at(b)),
        Node::Mul(a, b) => g.mul(at(a), at(b)),
        Node::Div(a, b) => g.div(at(a), at(b)).ok_or(ZeroDenominator)?,
        Node::Neg(a) => g.neg(at(a)),
        Node::Unary(f, a) => g.unary(f, at(a)),
        Node::Binary(f, a, b) => g.binary(f, at(a), at(b)),
        Node::Select { comparison, left, right, then, otherwise } => {
            g.select(comparison, at(left), at(right), at(then), at(otherwise))
        }
        Node::Smooth { function, order, argument } => g.smooth(function, order, at(argument)),
    })
}

//! Partial derivatives of one operation with respect to its arguments.
//!
//! Convention where a function is not smooth: the derivative of the branch taken; |x|′ = signum x, signum′ =
//! 0, min and max take the first argument on ties. The same convention holds for the runtime's time jets.

use crate::graph::{Binary, Comparison, Graph, Node, NodeId, Number, Unary};

/// A node that takes the value of one of two others.
///
/// Its derivative is a choice between their derivatives. A sum of both, weighted by 1 and 0, will not do: 0 ·
/// NaN is NaN, and the branch not taken is often outside of its domain, which is why it is not taken.
#[derive(Clone, Copy, Debug)]
pub(super) struct BranchChoice {
    comparison: Comparison,
    left: NodeId,
    right: NodeId,
    pub(super) then: NodeId,
    pub(super) otherwise: NodeId,
}

impl BranchChoice {
    /// The choice that a node is, if it is one.
    pub(super) fn of(node: Node) -> Option<Self> {
        let comparison = Comparison::LessEqual;
        match node {
            Node::Select { comparison, left, right, then, otherwise } => {
                Some(Self { comparison, left, right, then, otherwise })
            }
            Node::Binary(Binary::Min, a, b) => {
                Some(Self { comparison, left: a, right: b, then: a, otherwise: b })
            }
            Node::Binary(Binary::Max, a, b) => {
                Some(Self { comparison, left: b, right: a, then: a, otherwise: b })
            }
            _ => None,
        }
    }

    /// The same choice between two other nodes.
    pub(super) fn between(self, g: &mut Graph, then: NodeId, otherwise: NodeId) -> NodeId {
        g.select(self.comparison, self.left, self.right, then, otherwise)
    }
}

/// Partial derivatives of `node` with respect to the arguments for which `wanted` holds: (argument, partial).
pub(super) fn partials(g: &mut Graph, id: NodeId, wanted: &dyn Fn(NodeId) -> bool) -> Vec<(NodeId, NodeId)> {
    let mut out = Vec::with_capacity(2);
    match g.node(id) {
        Node::Number(_) | Node::Symbol(_) => {}
        Node::Add(a, b) => {
            let one = g.one();
            out.extend([(a, one), (b, one)]);
        }
        Node::Sub(a, b) => {
            let (one, minus) = (g.one(), g.integer(-1));
            out.extend([(a, one), (b, minus)]);
        }
        Node::Mul(a, b) => out.extend([(a, b), (b, a)]),
        Node::Div(a, b) => {
            let one = g.one();
            if wanted(a) {
                out.push((a, quotient(g, one, b)));
            }
            if wanted(b) {
                let slope = quotient(g, id, b);
                out.push((b, g.neg(slope)));
            }
        }
        Node::Neg(a) => {
            let minus = g.integer(-1);
            out.push((a, minus));
        }
        Node::Unary(f, a) => {
            if wanted(a) {
                out.push((a, unary(g, id, f, a)));
            }
        }
        Node::Binary(f, a, b) => binary(g, id, f, (a, b), wanted, &mut out),
        // Choices have no partial derivatives that could be multiplied: see [`BranchChoice`].
        Node::Select { .. } => {}
        Node::Smooth { function, order, argument } => {
            if wanted(argument) {
                out.push((argument, g.smooth(function, order + 1, argument)));
            }
        }
    }
    out.retain(|(argument, _)| wanted(*argument));
    out
}

/// a / b where b is a denominator that the graph holds already, or a value that is not identically zero.
fn quotient(g: &mut Graph, a: NodeId, b: NodeId) -> NodeId {
    g.div(a, b).expect("the denominator of an existing node is not identically zero")
}

fn unary(g: &mut Graph, id: NodeId, f: Unary, a: NodeId) -> NodeId {
    let one = g.one();
    match f {
        Unary::Sin => g.unary(Unary::Cos, a),
        Unary::Cos => {
            let sin = g.unary(Unary::Sin, a);
            g.neg(sin)
        }
        Unary::Tan => {
            let square = g.mul(id, id);
            g.add(one, square)
        }
        Unary::Tanh => {
            let square = g.mul(id, id);
            g.sub(one, square)
        }
        // 1/√(1 − x²) as (1 − x)(1 + x), which keeps its digits near ±1.
        Unary::Asin | Unary::Acos => {
            let (below, above) = (g.sub(one, a), g.add(one, a));
            let product = g.mul(below, above);
            let root = g.unary(Unary::Sqrt, product);
            let slope = quotient(g, one, root);
            if f == Unary::Asin { slope } else { g.neg(slope) }
        }
        Unary::Atan => {
            let square = g.mul(a, a);
            let sum = g.add(one, square);
            quotient(g, one, sum)
        }
        Unary::Sinh => g.unary(Unary::Cosh, a),
        Unary::Cosh => g.unary(Unary::Sinh, a),
        Unary::Exp => id,
        Unary::Ln => quotient(g, one, a),
        Unary::Sqrt => {
            let half = g.number(Number::ratio(1, 2));
            quotient(g, half, id)
        }
        Unary::Cbrt => {
            let third = g.number(Number::ratio(1, 3));
            let square = g.mul(id, id);
            quotient(g, third, square)
        }
        Unary::Abs => g.unary(Unary::Signum, a),
        Unary::Signum => g.zero(),
    }
}

fn binary(
    g: &mut Graph,
    id: NodeId,
    f: Binary,
    (a, b): (NodeId, NodeId),
    wanted: &dyn Fn(NodeId) -> bool,
    out: &mut Vec<(NodeId, NodeId)>,
) {
    match f {
        Binary::Atan2 => {
            let (aa, bb) = (g.mul(a, a), g.mul(b, b));
            let sum = g.add(aa, bb);
            if wanted(a) {
                out.push((a, quotient(g, b, sum)));
            }
            if wanted(b) {
                let slope = quotient(g, a, sum);
                out.push((b, g.neg(slope)));
            }
        }
        Binary::Hypot => {
            if wanted(a) {
                out.push((a, quotient(g, a, id)));
            }
            if wanted(b) {
                out.push((b, quotient(g, b, id)));
            }
        }
        Binary::Powf => {
            if wanted(a) {
                let one = g.one();
                let exponent = g.sub(b, one);
                let power = g.binary(Binary::Powf, a, exponent);
                out.push((a, g.mul(b, power)));
            }
            if wanted(b) {
                let log = g.unary(Unary::Ln, a);
                out.push((b, g.mul(id, log)));
            }
        }
        Binary::Min | Binary::Max => {}
    }
}

//! Numeric interpreter: the oracle of tests and the tool of numeric checks.

use super::{Comparison, FunctionId, Graph, Node, NodeId, Symbol, functions};

/// Values of what a graph does not know.
pub trait Bindings {
    /// Value of a symbol.
    fn symbol(&self, symbol: Symbol) -> f64;
    /// Derivative of given order of a smooth function at x.
    fn smooth(&self, function: FunctionId, order: u8, x: f64) -> f64;
}

impl Graph {
    /// Values of `roots` and all that they are made of, indexed by node; NaN elsewhere.
    #[must_use]
    pub fn evaluate(&self, roots: &[NodeId], bindings: &(impl Bindings + ?Sized)) -> Vec<f64> {
        let ids = self.cone(roots);
        let mut v = vec![f64::NAN; ids.last().map_or(0, |id| id.index() + 1)];
        for id in ids {
            let at = |x: NodeId| v[x.index()];
            let value = match self.node(id) {
                Node::Number(n) => n.value(),
                Node::Symbol(s) => bindings.symbol(s),
                Node::Add(a, b) => at(a) + at(b),
                Node::Sub(a, b) => at(a) - at(b),
                Node::Mul(a, b) => at(a) * at(b),
                Node::Div(a, b) => at(a) / at(b),
                Node::Neg(a) => -at(a),
                Node::Unary(f, a) => functions::evaluate(f, at(a)),
                Node::Binary(f, a, b) => functions::evaluate_binary(f, at(a), at(b)),
                Node::Select { comparison, left, right, then, otherwise } => {
                    let holds = match comparison {
                        Comparison::Less => at(left) < at(right),
                        Comparison::LessEqual => at(left) <= at(right),
                        Comparison::Equal => at(left) == at(right),
                    };
                    if holds { at(then) } else { at(otherwise) }
                }
                Node::Smooth { function, order, argument } => bindings.smooth(function, order, at(argument)),
            };
            v[id.index()] = value;
        }
        v
    }
}

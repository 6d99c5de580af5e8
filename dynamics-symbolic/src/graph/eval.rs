//! Numeric interpreter: the oracle of tests and the tool of numeric checks.

use super::{Binary, Comparison, FunctionId, Graph, Node, NodeId, Symbol, build};

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
    pub fn evaluate(&self, roots: &[NodeId], bindings: &impl Bindings) -> Vec<f64> {
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
                Node::Unary(f, a) => build::evaluate(f, at(a)),
                Node::Binary(f, a, b) => match f {
                    Binary::Atan2 => at(a).atan2(at(b)),
                    Binary::Powf => at(a).powf(at(b)),
                    Binary::Hypot => at(a).hypot(at(b)),
                    Binary::Min => {
                        if at(b) < at(a) {
                            at(b)
                        } else {
                            at(a)
                        }
                    }
                    Binary::Max => {
                        if at(b) > at(a) {
                            at(b)
                        } else {
                            at(a)
                        }
                    }
                },
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

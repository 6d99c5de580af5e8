//! Numeric interpreter: the oracle of tests and the tool of numeric checks.

use super::{Comparison, FunctionId, Graph, Node, NodeId, Symbol, functions};

/// Values of symbols and of smooth functions, which a graph does not contain.
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
        let mut values = Vec::new();
        Tape::new(self, roots).run(self, bindings, &mut values);
        values
    }
}

/// The operations behind some nodes in order, for evaluating them many times.
#[derive(Clone, Debug)]
pub(crate) struct Tape {
    ids: Vec<NodeId>,
}

impl Tape {
    /// For the values of `roots`.
    pub(crate) fn new(graph: &Graph, roots: &[NodeId]) -> Self {
        Self { ids: graph.cone(roots) }
    }

    /// Values of all that the roots are made of, indexed by node; NaN elsewhere. The graph is the one that it
    /// was made for.
    pub(crate) fn run(&self, graph: &Graph, bindings: &(impl Bindings + ?Sized), v: &mut Vec<f64>) {
        v.resize(self.ids.last().map_or(0, |id| id.index() + 1), f64::NAN);
        for id in &self.ids {
            let at = |x: NodeId| v[x.index()];
            let value = match graph.node(*id) {
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
    }
}

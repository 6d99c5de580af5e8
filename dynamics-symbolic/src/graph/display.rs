//! Debugging text of a node, fully parenthesised.

use super::{Graph, Node, NodeId};

impl Graph {
    /// The expression below a node, for tests and debugging; shared parts are written again, so it can be long.
    #[must_use]
    pub fn display(&self, id: NodeId) -> String {
        let d = |x| self.display(x);
        match self.node(id) {
            Node::Number(n) => n.value().to_string(),
            Node::Symbol(s) => format!("{s:?}"),
            Node::Add(a, b) => format!("({} + {})", d(a), d(b)),
            Node::Sub(a, b) => format!("({} - {})", d(a), d(b)),
            Node::Mul(a, b) => format!("({} * {})", d(a), d(b)),
            Node::Div(a, b) => format!("({} / {})", d(a), d(b)),
            Node::Neg(a) => format!("(-{})", d(a)),
            Node::Unary(f, a) => format!("{f:?}({})", d(a)),
            Node::Binary(f, a, b) => format!("{f:?}({}, {})", d(a), d(b)),
            Node::Select { comparison, left, right, then, otherwise } => {
                format!("(if {} {comparison:?} {} then {} else {})", d(left), d(right), d(then), d(otherwise))
            }
            Node::Smooth { function, order, argument } => format!("f{}^({order})({})", function.0, d(argument)),
        }
    }
}

//! Where a model is not smooth, and where it may be undefined: not mistakes, but what a user should know before a run meets it.

use crate::graph::{Binary, Dependence, Graph, Node, NodeId, Unary};
use crate::mechanics::{Equations, Model};

/// A place where a branch changes: left = right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Switch {
    /// One side.
    pub left: NodeId,
    /// The other side; `None` for zero (absolute values and signs).
    pub right: Option<NodeId>,
}

/// What M, Q, and the constraints contain.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Hazards {
    /// Changes of branch for which no event is declared.
    pub switches: Vec<Switch>,
    /// Expressions by which something is divided, except those that are positive in every state.
    pub denominators: Vec<NodeId>,
    /// Expressions under roots and logarithms that may be negative.
    pub domains: Vec<NodeId>,
}

impl Hazards {
    /// Looks at a model's equations; what depends on parameters alone is left out.
    #[must_use]
    pub fn of(model: &Model, equations: &Equations) -> Self {
        let g = &model.graph;
        let mut needed = vec![false; g.len()];
        let mass = equations.mass_matrix.iter().flatten();
        let held =
            equations.constraints.iter().flat_map(|c| c.jacobian.iter().flatten().chain(&c.gamma).chain(&c.residual));
        mass.chain(&equations.generalized_force).chain(held).for_each(|r| needed[r.index()] = true);
        let mut found = Self::default();
        for id in g.ids().rev() {
            if needed[id.index()] {
                g.node(id).children().for_each(|c| needed[c.index()] = true);
            }
        }
        for id in g.ids().filter(|id| needed[id.index()]) {
            found.look(g, g.node(id));
        }
        let positive = |id: NodeId| least(g, id, DEPTH) == Some(Sign::Positive);
        found.switches.retain(|s| !(watched(model, *s) || s.right.is_none() && positive(s.left)));
        found.denominators.retain(|d| !positive(*d));
        found.domains.retain(|d| least(g, *d, DEPTH).is_none());
        found
    }

    fn look(&mut self, g: &Graph, node: Node) {
        match node {
            Node::Select { left, right, .. } => self.switch(g, left, Some(right)),
            Node::Binary(Binary::Min | Binary::Max, left, right) => self.switch(g, left, Some(right)),
            Node::Unary(Unary::Abs | Unary::Signum, a) => self.switch(g, a, None),
            Node::Div(_, b) if !g.is_constant(b) => push(&mut self.denominators, b),
            Node::Unary(Unary::Sqrt | Unary::Ln, a) | Node::Binary(Binary::Powf, a, _) if !g.is_constant(a) => {
                push(&mut self.domains, a);
            }
            _ => {}
        }
    }

    fn switch(&mut self, g: &Graph, left: NodeId, right: Option<NodeId>) {
        let both = right.map_or(Dependence::NONE, |r| g.dependence(r)).with(g.dependence(left));
        // Against zero the other side says it all.
        let (left, right) = match right {
            Some(r) if g.is_zero(r) => (left, None),
            Some(r) if g.is_zero(left) => (r, None),
            _ => (left, right),
        };
        let known = |s: &Switch| *s == Switch { left, right } || Some(s.left) == right && s.right == Some(left);
        if !both.within(Dependence::PARAMETERS) && !self.switches.iter().any(known) {
            self.switches.push(Switch { left, right });
        }
    }
}

/// How deep signs are looked for.
const DEPTH: usize = 12;

/// What a value is at least, whatever the state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Sign {
    /// ≥ 0.
    NotNegative,
    /// > 0.
    Positive,
}

/// The sign of 1 + x² and the like; `None` where nothing is known.
fn least(g: &Graph, id: NodeId, depth: usize) -> Option<Sign> {
    let depth = depth.checked_sub(1)?;
    let of = |x: NodeId| least(g, x, depth);
    match g.node(id) {
        Node::Number(n) if n.value() > 0.0 => Some(Sign::Positive),
        Node::Mul(a, b) if a == b => Some(of(a).unwrap_or(Sign::NotNegative)),
        Node::Mul(a, b) | Node::Div(a, b) => Some(of(a)?.min(of(b)?)),
        Node::Add(a, b) => Some(of(a)?.max(of(b)?)),
        Node::Unary(Unary::Exp | Unary::Cosh, _) => Some(Sign::Positive),
        Node::Unary(Unary::Sqrt | Unary::Cbrt, a) => of(a),
        Node::Unary(Unary::Abs, a) => Some(of(a).unwrap_or(Sign::NotNegative)),
        Node::Binary(Binary::Hypot, a, b) => Some(of(a).max(of(b)).unwrap_or(Sign::NotNegative)),
        _ => None,
    }
}

fn push(list: &mut Vec<NodeId>, id: NodeId) {
    if !list.contains(&id) {
        list.push(id);
    }
}

/// Whether an event crosses zero where a branch changes.
fn watched(model: &Model, s: Switch) -> bool {
    let g = &model.graph;
    let right = s.right.map_or(crate::graph::Fingerprint::ZERO, |r| g.fingerprint(r));
    let difference = g.fingerprint(s.left).sub(right);
    model.events.iter().map(|e| g.fingerprint(e.node)).any(|f| f == difference || f == difference.neg())
}

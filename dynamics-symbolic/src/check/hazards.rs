//! Where a model is not smooth, and where it may be undefined. These are not mistakes, but a user should read
//! of them before a run meets them.

use crate::graph::{Binary, Comparison, Dependence, FunctionId, Graph, Node, NodeId, Unary};
use crate::mechanics::{Equations, Model};

/// A place where a branch changes: left = right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Switch {
    /// One side.
    pub left: NodeId,
    /// The other side; `None` for zero (absolute values and signs).
    pub right: Option<NodeId>,
}

/// A value, and where in it the accelerations are not smooth: at zero, or between the pieces of a function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kink {
    /// What changes its sign, or the function's argument.
    pub value: NodeId,
    /// The change of branch.
    pub switch: Option<Switch>,
    /// The function.
    pub function: Option<FunctionId>,
}

/// What is known only when the equations are solved.
const SOLUTION: Dependence = Dependence::ACCELERATIONS.with(Dependence::MULTIPLIERS);

/// Most kinks that a run follows. It equals `dynamics_runtime::model::MAX_KINKS`.
pub const MOST_KINKS: usize = 64;

/// What M, Q, and the constraints contain.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Hazards {
    /// Changes of branch.
    pub switches: Vec<Switch>,
    /// Arguments y, x of atan2: where y = 0 and x < 0 it jumps by a turn.
    pub cuts: Vec<(NodeId, NodeId)>,
    /// Smooth functions with their arguments: they may be made of pieces.
    pub functions: Vec<(FunctionId, NodeId)>,
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
        let mass = equations.inertia();
        let held = equations.constraints.iter().flat_map(|c| {
            // Of rows on velocities the offset is no part of γ where it jumps.
            c.jacobian.iter().flatten().chain(&c.gamma).chain(&c.residual).chain(&c.velocity_offset)
        });
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
        let positive = |id: NodeId| least(g, id, SIGN_DEPTH) == Some(Sign::Positive);
        found.switches.retain(|s| s.right.is_some() || !positive(s.left));
        found.cuts.retain(|(_, x)| least(g, *x, SIGN_DEPTH).is_none());
        found.denominators.retain(|d| !positive(*d));
        found.domains.retain(|d| least(g, *d, SIGN_DEPTH).is_none());
        found
    }

    /// Where steps can be made to end: what has to change its sign, or leave its piece of a function, for the
    /// accelerations not to be smooth. Nothing where there are more than [`MOST_KINKS`] of them. What depends
    /// on the solution itself is left out: see [`Hazards::reaction_kinks`].
    #[must_use]
    pub fn kinks(&self, g: &mut Graph) -> Vec<Kink> {
        let mut kinks = self.all(g);
        kinks.retain(|kink| !g.dependence(kink.value).on(SOLUTION));
        kinks
    }

    /// Likewise for what depends on reactions, as the size of a friction force does.
    #[must_use]
    pub fn reaction_kinks(&self, g: &mut Graph) -> Vec<Kink> {
        let mut kinks = self.all(g);
        kinks.retain(|kink| {
            let on = g.dependence(kink.value);
            on.on(Dependence::MULTIPLIERS) && !on.on(Dependence::ACCELERATIONS)
        });
        kinks
    }

    fn all(&self, g: &mut Graph) -> Vec<Kink> {
        let switches = self.followed();
        if switches.len() + self.functions.len() > MOST_KINKS {
            return Vec::new();
        }
        let switches = switches.iter().map(|s| match s.right {
            None => Kink { value: s.left, switch: Some(*s), function: None },
            Some(right) => Kink { value: g.sub(s.left, right), switch: Some(*s), function: None },
        });
        let mut kinks: Vec<Kink> = switches.collect();
        kinks.extend(self.functions.iter().map(|(f, argument)| Kink {
            value: *argument,
            switch: None,
            function: Some(*f),
        }));
        kinks
    }

    /// Whether [`Hazards::kinks`] and [`Hazards::reaction_kinks`] contain every change of branch.
    #[must_use]
    pub fn are_followed(&self, g: &Graph) -> bool {
        let on_solution = |id: NodeId| g.dependence(id).on(Dependence::ACCELERATIONS);
        let unknown = |s: &Switch| on_solution(s.left) || s.right.is_some_and(on_solution);
        let switches = self.followed();
        switches.len() + self.functions.len() <= MOST_KINKS && !switches.iter().any(unknown)
    }

    /// The changes of branch and, for the cuts, those of the sign of y. Where x > 0 that changes nothing; but
    /// a value that changes its sign on the cut alone would itself have to jump.
    fn followed(&self) -> Vec<Switch> {
        let mut all = self.switches.clone();
        self.cuts.iter().for_each(|(y, _)| push(&mut all, Switch { left: *y, right: None }));
        all
    }

    fn look(&mut self, g: &Graph, node: Node) {
        match node {
            Node::Select { left, right, .. } => self.switch(g, left, Some(right)),
            Node::Binary(Binary::Min | Binary::Max, left, right) => self.switch(g, left, Some(right)),
            Node::Unary(Unary::Abs | Unary::Signum, a) => self.switch(g, a, None),
            Node::Binary(Binary::Atan2, y, x) if !g.dependence(y).within(Dependence::PARAMETERS) => {
                push(&mut self.cuts, (y, x));
            }
            Node::Smooth { function, argument, .. } if !g.is_constant(argument) => {
                push(&mut self.functions, (function, argument));
            }
            Node::Div(_, b) if !g.is_constant(b) => push(&mut self.denominators, b),
            Node::Unary(Unary::Sqrt | Unary::Ln, a) | Node::Binary(Binary::Powf, a, _)
                if !g.is_constant(a) =>
            {
                push(&mut self.domains, a);
            }
            _ => {}
        }
    }

    fn switch(&mut self, g: &Graph, left: NodeId, right: Option<NodeId>) {
        let both = right.map_or(Dependence::NONE, |r| g.dependence(r)).with(g.dependence(left));
        let known = self.switches.iter().any(|s| s.order(g, left, right).is_some());
        if !both.within(Dependence::PARAMETERS) && !known {
            self.switches.push(Switch::new(g, left, right).0);
        }
    }
}

impl Switch {
    /// A change of branch where left = right, and whether the sides were exchanged.
    fn new(g: &Graph, left: NodeId, right: Option<NodeId>) -> (Self, bool) {
        // Against zero the other side says it all.
        match right {
            Some(r) if g.is_zero(r) => (Self { left, right: None }, false),
            Some(r) if g.is_zero(left) => (Self { left: r, right: None }, true),
            _ => (Self { left, right }, false),
        }
    }

    /// Whether this is where left = right, and if so, whether its sides are exchanged.
    fn order(&self, g: &Graph, left: NodeId, right: Option<NodeId>) -> Option<bool> {
        let (other, exchanged) = Self::new(g, left, right);
        if *self == other {
            return Some(exchanged);
        }
        (Some(self.left) == other.right && self.right == Some(other.left)).then_some(!exchanged)
    }
}

/// Which kink decides an operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Branch {
    /// Index of the kink.
    pub kink: usize,
    /// Its value is right − left and not left − right.
    pub exchanged: bool,
}

impl Branch {
    /// The kink that decides an operation, if it is a choice and one of these does.
    #[must_use]
    pub fn of(g: &Graph, id: NodeId, kinks: &[Kink]) -> Option<Self> {
        let (left, right) = match g.node(id) {
            Node::Select { comparison: Comparison::Less | Comparison::LessEqual, left, right, .. } => {
                (left, Some(right))
            }
            Node::Binary(Binary::Min | Binary::Max, left, right) => (left, Some(right)),
            Node::Unary(Unary::Abs | Unary::Signum, a) | Node::Binary(Binary::Atan2, a, _) => (a, None),
            _ => return None,
        };
        let mut orders = kinks.iter().map(|kink| kink.switch?.order(g, left, right)).enumerate();
        orders.find_map(|(kink, exchanged)| Some(Self { kink, exchanged: exchanged? }))
    }
}

/// Levels of nodes through which the sign of a denominator is followed. The search branches at every level; a
/// larger value recognises longer denominators as positive, and takes up to twice the time for each level.
const SIGN_DEPTH: usize = 12;

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

fn push<T: PartialEq>(list: &mut Vec<T>, new: T) {
    if !list.contains(&new) {
        list.push(new);
    }
}

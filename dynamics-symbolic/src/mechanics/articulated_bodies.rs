//! The velocities of a velocity form as sums of other velocities, for articulated-body elimination, which
//! never forms M.
//!
//! Gauss's principle: q̈ makes Σ w ẋ ẏ − δW stationary, where ẋ, ẏ are derivatives of true velocities and δW
//! is the power of the forces along q̈. Velocities are linear in q̇; how they are written says how they share
//! parts: v₃ = v₂ + l₃ cos θ₃ θ̇₃. Whatever is read more than once, or has weight in T, becomes an
//! intermediate quantity of [`ArticulatedForm`], with
//!
//!   v = Σ c v′    ⇒    v̇ = Σ c v̇′ + Σ ċ v′.

use std::collections::{BTreeMap, BTreeSet};

use crate::algebra::{ArticulatedForm, Definition};
use crate::calculus::{directional, substitute};
use crate::graph::{Dependence, Graph, Node, NodeId, Symbol};

use super::velocity_form::{VelocityForm, transport};

/// The articulated form of T = `form`, with the forces of the Lagrangian's rest `general`, free of
/// velocities, and `applied` by coordinate; `None` where time enters or velocities are not made of one
/// another by sums and factors.
pub(super) fn articulated_form(
    g: &mut Graph,
    form: &VelocityForm,
    general: NodeId,
    applied: &[NodeId],
) -> Option<ArticulatedForm> {
    let n = applied.len();
    let velocities = form.velocities();
    let moved = |g: &Graph, v: &NodeId| g.dependence(*v).on(Dependence::TIME);
    if g.dependence(general).on(Dependence::RATES) || velocities.iter().any(|v| moved(g, v)) {
        return None;
    }
    // The symbols q̈ stand for any velocities here: those of T and those along which the forces work.
    let weighted = directional(g, velocities, &mut |g, s| match s {
        Symbol::Rate(j) => Some(g.symbol(Symbol::Acceleration(j))),
        _ => None,
    });
    let power = directional(g, &[general], &mut |g, s| match s {
        Symbol::Coordinate(j) => Some(g.symbol(Symbol::Acceleration(j))),
        _ => None,
    })[0];
    let tape = LinearTape::new(g, &weighted, power, n)?;
    let mut inertia = Vec::new();
    for (weight, x, y) in form.products() {
        let two = g.integer(2);
        for (i, a) in &tape.forms[&weighted[x]] {
            for (j, b) in &tape.forms[&weighted[y]] {
                let factor = g.mul(*a, *b);
                let entry = g.mul(weight, factor);
                inertia.push((*i, *j, if i == j { g.mul(two, entry) } else { entry }));
            }
        }
    }
    let mut force: Vec<(usize, NodeId)> = applied.iter().copied().enumerate().collect();
    force.extend(tape.forms.get(&power).into_iter().flatten().map(|(i, c)| (*i, *c)));
    Some(ArticulatedForm { unknowns: n, definitions: tape.definitions(g)?, inertia, force })
}

/// A linear combination of unknowns and intermediate quantities.
type LinearForm = BTreeMap<usize, NodeId>;

/// Nodes that are linear in the symbols q̈.
struct LinearTape {
    unknowns: usize,
    /// What each of them is made of.
    forms: BTreeMap<NodeId, LinearForm>,
    /// Intermediate quantities in order.
    defined: Vec<(NodeId, LinearForm)>,
}

impl LinearTape {
    fn new(g: &mut Graph, weighted: &[NodeId], power: NodeId, unknowns: usize) -> Option<Self> {
        let mut tape = Self { unknowns, forms: BTreeMap::new(), defined: Vec::new() };
        let linear = |g: &Graph, id: NodeId| g.dependence(id).on(Dependence::ACCELERATIONS);
        let mut ids = g.cone(&[weighted, &[power]].concat());
        ids.retain(|id| linear(g, *id));
        let mut uses: BTreeMap<NodeId, usize> = BTreeMap::new();
        for child in ids.iter().flat_map(|id| g.node(*id).children().collect::<Vec<_>>()) {
            *uses.entry(child).or_default() += 1;
        }
        let heavy: BTreeSet<NodeId> = weighted.iter().copied().collect();
        for id in ids {
            let mut form = tape.form(g, id)?;
            form.retain(|_, c| !g.is_zero(*c));
            let shared = form.len() > 1 && uses.get(&id).is_some_and(|uses| *uses > 1);
            // What turns with the coordinates has an offset.
            let turns = form.len() > 1 || form.values().any(|c| !g.is_constant(*c));
            if shared || turns && heavy.contains(&id) {
                let quantity = unknowns + tape.defined.len();
                let itself = LinearForm::from([(quantity, g.one())]);
                tape.defined.push((id, core::mem::replace(&mut form, itself)));
            }
            tape.forms.insert(id, form);
        }
        Some(tape)
    }

    /// What a node is made of; `None` where it is not linear.
    fn form(&self, g: &mut Graph, id: NodeId) -> Option<LinearForm> {
        match g.node(id) {
            Node::Symbol(Symbol::Acceleration(j)) => Some(LinearForm::from([(j as usize, g.one())])),
            Node::Add(a, b) => self.sum(g, a, b, Graph::add),
            Node::Sub(a, b) => self.sum(g, a, b, Graph::sub),
            Node::Neg(a) => {
                let minus = g.integer(-1);
                self.scaled(g, a, minus)
            }
            Node::Mul(a, b) if self.forms.contains_key(&b) => self.scaled(g, b, a),
            Node::Mul(a, b) => self.scaled(g, a, b),
            Node::Div(a, b) => {
                let one = g.one();
                let reciprocal = g.div(one, b)?;
                self.scaled(g, a, reciprocal)
            }
            _ => None,
        }
    }

    fn sum(
        &self,
        g: &mut Graph,
        a: NodeId,
        b: NodeId,
        f: fn(&mut Graph, NodeId, NodeId) -> NodeId,
    ) -> Option<LinearForm> {
        let (mut sum, other) = (self.forms.get(&a)?.clone(), self.forms.get(&b)?);
        for (i, c) in other {
            let old = sum.get(i).copied().unwrap_or(g.zero());
            sum.insert(*i, f(g, old, *c));
        }
        Some(sum)
    }

    fn scaled(&self, g: &mut Graph, of: NodeId, factor: NodeId) -> Option<LinearForm> {
        if g.dependence(factor).on(Dependence::ACCELERATIONS) {
            return None;
        }
        Some(self.forms.get(&of)?.iter().map(|(i, c)| (*i, g.mul(factor, *c))).collect())
    }

    /// The intermediate quantities as accelerations.
    fn definitions(&self, g: &mut Graph) -> Option<Vec<Definition>> {
        let nodes: Vec<NodeId> = self.defined.iter().map(|(node, _)| *node).collect();
        let mut speeds: Vec<NodeId> = (0..self.unknowns as u32).map(|j| g.symbol(Symbol::Rate(j))).collect();
        let as_rates = substitute(g, &nodes, &mut |g, s| match s {
            Symbol::Acceleration(j) => Some(g.symbol(Symbol::Rate(j))),
            _ => None,
        });
        speeds.extend(as_rates.ok()?);
        let definition = |(_, form): &(NodeId, LinearForm)| {
            let (on, factors): (Vec<usize>, Vec<NodeId>) = form.iter().map(|(i, c)| (*i, *c)).unzip();
            let turning = directional(g, &factors, &mut transport);
            let mut offset = Vec::new();
            for (i, turning) in on.iter().zip(turning) {
                if !g.is_zero(turning) {
                    let (factor, rate) = apart(g, turning);
                    offset.push((factor, g.mul(rate, speeds[*i])));
                }
            }
            Definition { terms: on.into_iter().zip(factors).collect(), offset }
        };
        Some(self.defined.iter().map(definition).collect())
    }
}

/// A product as (what is free of velocities, the rest).
fn apart(g: &mut Graph, product: NodeId) -> (NodeId, NodeId) {
    let (mut free, mut rest) = (g.one(), g.one());
    let mut stack = vec![product];
    while let Some(id) = stack.pop() {
        match g.node(id) {
            _ if !g.dependence(id).on(Dependence::RATES) => free = g.mul(free, id),
            Node::Mul(a, b) => stack.extend([b, a]),
            Node::Neg(a) => {
                free = g.neg(free);
                stack.push(a);
            }
            _ => rest = g.mul(rest, id),
        }
    }
    (free, rest)
}

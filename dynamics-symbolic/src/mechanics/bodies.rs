//! Rigid bodies as a tree: the steps from the world to their frames, and the inertia that each step carries.
//!
//! Two bodies whose frames begin with the same steps share them, so that an arm becomes a chain of links,
//! however its model is written. A link carries mass m, first moment h = m c and inertia J about the origin,
//! in its own axes:
//!
//!   T = Σ ½ m v² + v·(ω×h) + ½ ω·Jω
//!
//! Before anything is derived, inertia is moved toward the world as far as T permits: through steps that do
//! not move, all of it; through a turn about an axis, the part that the turn does not change (m, h along the
//! axis, the part of J that is equal across it); through a shift, J. Only parameters are involved, so this is
//! done once for each model. The rest is what the recursions carry: 7 numbers for a link with a hinge instead
//! of 10. These are the base parameters of robotics (W. Khalil, E. Dombre, *Modeling, Identification and
//! Control of Robots*, Hermes Penton 2002, §9.4).

use std::collections::BTreeMap;

use crate::graph::{Dependence, Graph, Node, NodeId, Number};

use super::model::{Body, FrameStep, Model};
use super::vectors::{M3, V3, added, cross, dot, scaled, transposed, turned, zero};

/// Mass, first moment about the origin, and inertia about it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Carried {
    pub(super) mass: NodeId,
    pub(super) moment: V3,
    pub(super) inertia: M3,
}

/// A step with what hangs on it.
#[derive(Clone, Debug)]
pub(super) struct Link {
    /// The step before, an index that is smaller than this link's; `None`: the world.
    pub(super) parent: Option<usize>,
    pub(super) step: FrameStep,
    pub(super) own: Carried,
}

/// Bodies by the steps to their frames.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    /// Parents before children.
    pub(super) links: Vec<Link>,
    /// Number of coordinates.
    pub(super) coordinates: usize,
    /// −g: what a frame at rest feels; 0 where weights are not taken along.
    pub(super) lift: V3,
    /// What T and V are without the bodies.
    pub(super) kinetic: NodeId,
    pub(super) potential: NodeId,
    /// All that the steps are made of.
    made_of: Vec<NodeId>,
}

impl Tree {
    /// The tree of a model's bodies beside the rest of T = `kinetic` and V = `potential`. `None` without
    /// bodies, where steps contain more than coordinates and parameters, or where a turn is not a rotation
    /// for all coordinates (Euler parameters off the unit sphere).
    pub(super) fn of(model: &mut Model, kinetic: NodeId, potential: NodeId) -> Option<Self> {
        if model.bodies.is_empty() {
            return None;
        }
        let (bodies, coordinates) = (model.bodies.clone(), model.coordinates.len());
        let g = &mut model.graph;
        if !bodies.iter().all(|body| is_plain(g, body)) {
            return None;
        }
        let made_of: Vec<NodeId> =
            bodies.iter().flat_map(|body| body.steps.iter().flat_map(FrameStep::nodes)).collect();
        let mut tree = Self {
            links: Vec::new(),
            coordinates,
            lift: zero(g),
            kinetic,
            potential,
            made_of: g.cone(&made_of),
        };
        let mut known: BTreeMap<(Option<usize>, FrameStep), usize> = BTreeMap::new();
        for body in &bodies {
            let mut at = None;
            for step in &body.steps {
                let next = *known.entry((at, step.clone())).or_insert_with(|| {
                    let none = Carried { mass: g.zero(), moment: zero(g), inertia: [zero(g); 3] };
                    tree.links.push(Link { parent: at, step: step.clone(), own: none });
                    tree.links.len() - 1
                });
                at = Some(next);
            }
            // A body that stands still has neither energy nor motion.
            if let Some(at) = at {
                let carried = Carried::of(g, body);
                tree.links[at].own = tree.links[at].own.and(g, &carried);
            }
        }
        tree.kinetic = without(g, kinetic, bodies.iter().map(|body| body.kinetic));
        tree.take_weights(g, &bodies);
        tree.move_inward(g);
        Some(tree)
    }

    /// Gravity as an acceleration of the world, where it is the same for all bodies.
    fn take_weights(&mut self, g: &mut Graph, bodies: &[Body]) {
        let Some((gravity, _)) = bodies.first().and_then(|body| body.weight) else { return };
        let alike = |body: &Body| body.weight.is_some_and(|(other, _)| other == gravity);
        if gravity.iter().all(|x| g.is_constant(*x)) && bodies.iter().all(alike) {
            self.lift = gravity.map(|x| g.neg(x));
            self.potential =
                without(g, self.potential, bodies.iter().filter_map(|body| Some(body.weight?.1)));
        }
    }

    fn move_inward(&mut self, g: &mut Graph) {
        for k in (0..self.links.len()).rev() {
            let Link { parent: Some(parent), step, own } = self.links[k].clone() else { continue };
            let (moves, stays) = own.split(g, &step);
            let moved = moves.before(g, &step);
            self.links[k].own = stays;
            self.links[parent].own = self.links[parent].own.and(g, &moved);
        }
    }

    /// Runs `work` on new forms of whatever the steps are not made of.
    pub(super) fn afresh<T>(&self, g: &mut Graph, work: impl FnOnce(&mut Graph) -> T) -> T {
        g.afresh(&self.made_of, work)
    }
}

impl FrameStep {
    /// Its nodes.
    pub(super) fn nodes(&self) -> Vec<NodeId> {
        match self {
            Self::Shift(by) => by.to_vec(),
            Self::Turn { rotation, rate } => rotation.iter().flatten().chain(rate).copied().collect(),
        }
    }

    /// Whether it does not move.
    fn is_still(&self, g: &Graph) -> bool {
        self.nodes().iter().all(|x| g.is_constant(*x))
    }
}

/// The coordinate axis that a rotation leaves where it is.
pub(super) fn axis(g: &Graph, rotation: &M3) -> Option<usize> {
    (0..3).find(|&k| {
        (0..3).all(|i| i == k || g.is_zero(rotation[i][k]) && g.is_zero(rotation[k][i]))
            && g.is_one(rotation[k][k])
    })
}

/// Whether steps and inertia are such that the recursions hold.
fn is_plain(g: &mut Graph, body: &Body) -> bool {
    let Body { mass, center, inertia, .. } = body;
    let carried = [mass].into_iter().chain(center).chain(inertia.iter().flatten());
    let moved = Dependence::PARAMETERS.with(Dependence::COORDINATES);
    let placed = |g: &Graph, x: &NodeId| g.dependence(*x).within(moved);
    let turning = |g: &Graph, x: &NodeId| g.dependence(*x).within(moved.with(Dependence::RATES));
    carried.into_iter().all(|x| g.is_constant(*x))
        && body.steps.iter().all(|step| match step {
            FrameStep::Shift(by) => by.iter().all(|x| placed(g, x)),
            FrameStep::Turn { rotation, rate } => {
                rotation.iter().flatten().all(|x| placed(g, x))
                    && rate.iter().all(|x| turning(g, x))
                    && is_rotation(g, rotation)
            }
        })
}

/// Whether RᵀR = 1 and det R = 1, whatever the coordinates are.
fn is_rotation(g: &mut Graph, rotation: &M3) -> bool {
    let columns = transposed(rotation);
    let across = cross(g, &columns[0], &columns[1]);
    let determinant = dot(g, &across, &columns[2]);
    // Mirrors carry angular velocities otherwise.
    g.is_one(determinant)
        && (0..3).all(|i| {
            (0..3).all(|j| {
                let product = dot(g, &columns[i], &columns[j]);
                if i == j { g.is_one(product) } else { g.is_zero(product) }
            })
        })
}

/// A sum without some of its terms. Those that stand in it are left out; others are subtracted.
fn without(g: &mut Graph, sum: NodeId, terms: impl Iterator<Item = NodeId>) -> NodeId {
    let mut terms: Vec<NodeId> = terms.collect();
    let mut rest = g.zero();
    let mut stack = vec![(g.one(), sum)];
    while let Some((weight, node)) = stack.pop() {
        let value = g.fingerprint(weight).mul(g.fingerprint(node));
        if let Some(at) = terms.iter().position(|term| g.fingerprint(*term) == value) {
            terms.swap_remove(at);
            continue;
        }
        match g.node(node) {
            Node::Add(a, b) => stack.extend([(weight, b), (weight, a)]),
            Node::Sub(a, b) => {
                let minus = g.neg(weight);
                stack.extend([(minus, b), (weight, a)]);
            }
            Node::Neg(a) => stack.push((g.neg(weight), a)),
            Node::Mul(a, b) if g.is_constant(a) => stack.push((g.mul(weight, a), b)),
            _ => {
                let term = g.mul(weight, node);
                rest = g.add(rest, term);
            }
        }
    }
    terms.into_iter().fold(rest, |rest, term| g.sub(rest, term))
}

impl Carried {
    /// What a body carries, about the origin of its frame.
    fn of(g: &mut Graph, body: &Body) -> Self {
        let point = Self { mass: body.mass, moment: zero(g), inertia: [zero(g); 3] };
        let mut carried = point.shifted(g, &body.center);
        // Of the inertia T sees the symmetric part.
        let half = g.number(Number::ratio(1, 2));
        for i in 0..3 {
            for j in 0..3 {
                let mean = g.add(body.inertia[i][j], body.inertia[j][i]);
                let mean = g.mul(half, mean);
                carried.inertia[i][j] = g.add(carried.inertia[i][j], mean);
            }
        }
        carried
    }

    /// Both together.
    pub(super) fn and(&self, g: &mut Graph, other: &Self) -> Self {
        Self {
            mass: g.add(self.mass, other.mass),
            moment: added(g, &self.moment, &other.moment),
            inertia: [0, 1, 2].map(|i| {
                [0, 1, 2].map(|j| g.add(self.inertia[i.min(j)][i.max(j)], other.inertia[i.min(j)][i.max(j)]))
            }),
        }
    }

    /// What T does not see move with the step, and the rest.
    fn split(&self, g: &mut Graph, step: &FrameStep) -> (Self, Self) {
        let none = Self { mass: g.zero(), moment: zero(g), inertia: [zero(g); 3] };
        if step.is_still(g) {
            return (*self, none);
        }
        let (mut moves, mut stays) = (none, *self);
        match step {
            FrameStep::Shift(_) => {
                moves.inertia = self.inertia;
                stays.inertia = none.inertia;
            }
            FrameStep::Turn { rotation, rate } => {
                let Some(k) = axis(g, rotation) else { return (none, *self) };
                if (0..3).any(|i| i != k && !g.is_zero(rate[i])) {
                    return (none, *self);
                }
                let (i, j) = ((k + 1) % 3, (k + 2) % 3);
                (moves.mass, stays.mass) = (self.mass, g.zero());
                (moves.moment[k], stays.moment[k]) = (self.moment[k], g.zero());
                let across = self.inertia[j][j];
                (moves.inertia[i][i], moves.inertia[j][j]) = (across, across);
                stays.inertia[i][i] = g.sub(self.inertia[i][i], across);
                stays.inertia[j][j] = g.zero();
            }
        }
        (moves, stays)
    }

    /// The same in the frame before a step.
    pub(super) fn before(&self, g: &mut Graph, step: &FrameStep) -> Self {
        match step {
            FrameStep::Shift(by) => self.shifted(g, by),
            FrameStep::Turn { rotation, .. } => Self {
                mass: self.mass,
                moment: turned(g, rotation, &self.moment),
                inertia: match axis(g, rotation) {
                    Some(k) => self.inertia_about(g, rotation, k),
                    None => {
                        let columns = transposed(&self.inertia).map(|column| turned(g, rotation, &column));
                        // Rows of R J are columns of J Rᵀ, as J is symmetric.
                        transposed(&columns).map(|row| turned(g, rotation, &row))
                    }
                },
            },
        }
    }

    /// About a point from which this one is `by` away: J + 2 p·h 1 − p hᵀ − h pᵀ + m (p² 1 − p pᵀ).
    fn shifted(&self, g: &mut Graph, by: &V3) -> Self {
        let (mass, h) = (self.mass, &self.moment);
        let own = scaled(g, mass, by);
        let two = g.integer(2);
        let mut inertia = self.inertia;
        // The share of the mass is of parameters alone where the step is.
        let along: V3 = [0, 1, 2].map(|i| {
            let (double, square) = (g.mul(two, by[i]), g.mul(by[i], own[i]));
            let product = g.mul(double, h[i]);
            g.add(product, square)
        });
        for i in 0..3 {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let across = g.add(along[j], along[k]);
            inertia[i][i] = g.add(inertia[i][i], across);
            let (forward, backward, both) = (g.mul(by[i], h[j]), g.mul(by[j], h[i]), g.mul(by[i], own[j]));
            let mixed = g.add(forward, backward);
            let mixed = g.add(mixed, both);
            inertia[i][j] = g.sub(inertia[i][j], mixed);
            inertia[j][i] = inertia[i][j];
        }
        Self { mass, moment: added(g, h, &own), inertia }
    }

    /// R J Rᵀ of a turn about axis k: with t = c (Jᵢᵢ − Jⱼⱼ) − 2 s Jᵢⱼ it is Jⱼⱼ + c t, Jᵢᵢ − c t and Jᵢⱼ + s
    /// t.
    fn inertia_about(&self, g: &mut Graph, rotation: &M3, k: usize) -> M3 {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let (cos, sin) = (rotation[i][i], rotation[j][i]);
        let old = &self.inertia;
        let mut new = *old;
        let (difference, two) = (g.sub(old[i][i], old[j][j]), g.integer(2));
        let double = g.mul(two, old[i][j]);
        let (one, other) = (g.mul(cos, difference), g.mul(sin, double));
        let t = g.sub(one, other);
        let (ct, st) = (g.mul(cos, t), g.mul(sin, t));
        new[i][i] = g.add(old[j][j], ct);
        new[j][j] = g.sub(old[i][i], ct);
        new[i][j] = g.add(old[i][j], st);
        new[j][i] = new[i][j];
        let axial = turned(g, rotation, &[0, 1, 2].map(|n| if n == k { g.zero() } else { old[n][k] }));
        for n in [i, j] {
            new[n][k] = axial[n];
            new[k][n] = axial[n];
        }
        new
    }

    /// Momentum and angular momentum about the origin of a motion with v and ω.
    pub(super) fn momenta(&self, g: &mut Graph, v: &V3, omega: &V3) -> (V3, V3) {
        let (along, turning) = (scaled(g, self.mass, v), cross(g, omega, &self.moment));
        let (spin, lever) = (turned(g, &self.inertia, omega), cross(g, &self.moment, v));
        (added(g, &along, &turning), added(g, &spin, &lever))
    }
}

#[cfg(test)]
mod tests;

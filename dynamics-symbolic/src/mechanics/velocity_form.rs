//! The part of T that is a sum of products of true velocities: T = Σ w x y with x = d/dt X(q,t), y = d/dt
//! Y(q,t), w constant.
//!
//! With v all such velocities, J = ∂v/∂q̇ and W the symmetric matrix of weights, T = ½ vᵀWv and
//!
//!   M = JᵀWJ    column by column: one forward sweep for J eⱼ, one reverse sweep for Jᵀ(W J eⱼ)
//!   c = Jᵀ(W v̇₀)    one forward sweep for v̇₀ = v̇ at q̈ = 0, one reverse sweep
//!   p = Jᵀ(W v)    one reverse sweep
//!
//! so that d/dt(∂T/∂q̇) − ∂T/∂q = M q̈ + c. The formula for c needs d/dt(∂v/∂q̇) = ∂v/∂q for every velocity.
//! An angular velocity in a body frame fails that test although it is linear in q̇; what fails is left to the
//! general derivation.

use std::collections::{BTreeMap, BTreeSet};

use crate::calculus::{ForwardSweeps, directional, gradient, gradient_entries};
use crate::graph::{Dependence, Fingerprint, Graph, Node, NodeId, Symbol};

use super::model::symbols;

/// A term w·x·y of T.
#[derive(Clone, Copy, Debug)]
struct QuadraticTerm {
    /// Its place in T.
    number: usize,
    weight: NodeId,
    x: usize,
    y: usize,
}

impl QuadraticTerm {
    /// The weight of one velocity's rate in the momentum of the other, and how many such pairs there are.
    fn ways(&self, g: &mut Graph) -> (NodeId, usize) {
        if self.x == self.y {
            let two = g.integer(2);
            (g.mul(two, self.weight), 1)
        } else {
            (self.weight, 2)
        }
    }
}

/// T split into a part in velocity form and the rest.
#[derive(Clone, Debug, Default)]
pub(super) struct VelocityForm {
    velocities: Vec<NodeId>,
    products: Vec<QuadraticTerm>,
}

impl VelocityForm {
    /// Splits T; the second value is what is not in velocity form.
    pub(super) fn split(g: &mut Graph, kinetic: NodeId, n: usize) -> (Self, NodeId) {
        let (terms, others) = products(g, kinetic);
        let mut candidates: Vec<NodeId> = terms.iter().flat_map(|(_, x, y)| [*x, *y]).collect();
        candidates.sort_unstable();
        candidates.dedup();
        let valid = true_velocities(g, &candidates, n);
        let mut form = Self { velocities: Vec::new(), products: Vec::new() };
        let mut rest = g.zero();
        for (weight, x, y) in terms {
            if valid.contains(&x) && valid.contains(&y) {
                let (x, y) = (form.index(x), form.index(y));
                form.products.push(QuadraticTerm { number: form.products.len(), weight, x, y });
            } else {
                let square = g.mul(x, y);
                let term = g.mul(weight, square);
                rest = g.add(rest, term);
            }
        }
        for other in others {
            rest = g.add(rest, other);
        }
        (form, rest)
    }

    /// Whether there is nothing in velocity form.
    pub(super) fn is_empty(&self) -> bool {
        self.products.is_empty()
    }

    /// The velocities.
    pub(super) fn velocities(&self) -> &[NodeId] {
        &self.velocities
    }

    /// The terms w x y of T as (w, x, y), velocities by their numbers.
    pub(super) fn products(&self) -> impl Iterator<Item = (NodeId, usize, usize)> + '_ {
        self.products.iter().map(|product| (product.weight, product.x, product.y))
    }

    fn index(&mut self, velocity: NodeId) -> usize {
        self.velocities.iter().position(|v| *v == velocity).unwrap_or_else(|| {
            self.velocities.push(velocity);
            self.velocities.len() - 1
        })
    }

    /// Jᵀ W x for one value per velocity.
    fn project(&self, g: &mut Graph, x: &[NodeId], n: usize) -> Vec<NodeId> {
        let zero = g.zero();
        let mut seeds = vec![zero; x.len()];
        for product in &self.products {
            let (weight, ways) = product.ways(g);
            for (to, from) in [(product.x, product.y), (product.y, product.x)].into_iter().take(ways) {
                let term = g.mul(weight, x[from]);
                seeds[to] = g.add(seeds[to], term);
            }
        }
        let seeded: Vec<(NodeId, NodeId)> = self.velocities.iter().copied().zip(seeds).collect();
        gradient(g, &seeded, &symbols(n, Symbol::Rate))
    }

    /// Columns of M; `None` once the graph has more than `most` nodes.
    pub(super) fn mass_columns(&self, g: &mut Graph, n: usize, most: usize) -> Option<Vec<Vec<NodeId>>> {
        let (zero, one) = (g.zero(), g.one());
        let mut columns = Vec::with_capacity(n);
        if n == 0 {
            return Some(columns);
        }
        let first = directional(g, &self.velocities, &mut |g, s| (s == Symbol::Rate(0)).then(|| g.one()));
        columns.push(self.project(g, &first, n));
        // The first sweep went back from all velocities. The others have nothing new to say of those that
        // their coordinate does not move.
        let mut of_velocity = vec![Vec::new(); self.velocities.len()];
        for product in &self.products {
            of_velocity[product.x].push(*product);
            if product.x != product.y {
                of_velocity[product.y].push(*product);
            }
        }
        let mut sweeps = ForwardSweeps::new(g, &self.velocities);
        for j in 1..n {
            let along = sweeps.along(g, Symbol::Rate(j as u32), one);
            let mut column = vec![zero; n];
            for (i, entry) in self.project_entries(g, &along, &of_velocity, n) {
                column[i] = entry;
            }
            columns.push(column);
            if g.len() > most {
                return None;
            }
        }
        Some(columns)
    }

    /// M q̈ with symbols for q̈.
    pub(super) fn mass_product(&self, g: &mut Graph, n: usize) -> Vec<NodeId> {
        let moved = directional(g, &self.velocities, &mut |g, s| match s {
            Symbol::Rate(j) => Some(g.symbol(Symbol::Acceleration(j))),
            _ => None,
        });
        self.project(g, &moved, n)
    }

    /// Jᵀ W x for the velocities that move, by number, whose products are given.
    fn project_entries(
        &self,
        g: &mut Graph,
        moved: &[(usize, NodeId)],
        of_velocity: &[Vec<QuadraticTerm>],
        n: usize,
    ) -> Vec<(usize, NodeId)> {
        let mut seeds: BTreeMap<usize, NodeId> = BTreeMap::new();
        let speeds: BTreeMap<usize, NodeId> = moved.iter().copied().collect();
        // In the order in which the products stand in T, each once.
        let mut products: Vec<&QuadraticTerm> = moved.iter().flat_map(|(v, _)| &of_velocity[*v]).collect();
        products.sort_by_key(|product| product.number);
        products.dedup_by_key(|product| product.number);
        for product in products {
            let (weight, ways) = product.ways(g);
            for (to, from) in [(product.x, product.y), (product.y, product.x)].into_iter().take(ways) {
                let Some(speed) = speeds.get(&from) else { continue };
                let term = g.mul(weight, *speed);
                let old = seeds.get(&to).copied().unwrap_or(g.zero());
                let sum = g.add(old, term);
                seeds.insert(to, sum);
            }
        }
        // In the order of the velocities, as all of them would be.
        let seeded: Vec<(NodeId, NodeId)> =
            seeds.into_iter().map(|(v, seed)| (self.velocities[v], seed)).collect();
        gradient_entries(g, &seeded, Symbol::Rate, n)
    }

    /// Coriolis and centripetal terms c, on the left-hand side: by the sweep, or, in small models, by
    /// products of velocities where that takes fewer operations beside `mass`.
    pub(super) fn coriolis(&self, g: &mut Graph, mass: &[Vec<NodeId>]) -> Vec<NodeId> {
        let n = mass.len();
        let stationary = self.velocities.iter().all(|v| !g.dependence(*v).on(Dependence::TIME));
        if n > Self::MOST_COORDINATES || !stationary {
            return self.coriolis_by_sweep(g, n);
        }
        // Tried on copies, so that what is not taken leaves no trace.
        let operations = |derive: &dyn Fn(&mut Graph) -> Vec<NodeId>| {
            let mut trial = g.clone();
            let mut roots = derive(&mut trial);
            roots.extend(mass.iter().flatten());
            trial.operations(&roots)
        };
        let swept = operations(&|g| self.coriolis_by_sweep(g, n));
        let multiplied = operations(&|g| self.coriolis_by_products(g, n));
        if multiplied < swept { self.coriolis_by_products(g, n) } else { self.coriolis_by_sweep(g, n) }
    }

    /// Most coordinates for which products of velocities are tried. Their number grows with the cube.
    const MOST_COORDINATES: usize = 4;

    pub(super) fn coriolis_by_sweep(&self, g: &mut Graph, n: usize) -> Vec<NodeId> {
        let accelerations = directional(g, &self.velocities, &mut transport);
        self.project(g, &accelerations, n)
    }

    /// Σⱼₗ q̇ⱼ q̇ₗ Jᵀ W ∂Jⱼ/∂qₗ, for velocities without explicit time: terms that cancel between links are
    /// found term by term.
    fn coriolis_by_products(&self, g: &mut Graph, n: usize) -> Vec<NodeId> {
        let mut sum = vec![g.zero(); n];
        for j in 0..n as u32 {
            let column =
                directional(g, &self.velocities, &mut |g, s| (s == Symbol::Rate(j)).then(|| g.one()));
            for l in 0..=j {
                let bent = directional(g, &column, &mut |g, s| (s == Symbol::Coordinate(l)).then(|| g.one()));
                if bent.iter().all(|b| g.is_zero(*b)) {
                    continue;
                }
                // ∂Jⱼ/∂qₗ = ∂Jₗ/∂qⱼ for true velocities.
                let times = g.integer(if j == l { 1 } else { 2 });
                let (uj, ul) = (g.symbol(Symbol::Rate(j)), g.symbol(Symbol::Rate(l)));
                let speeds = g.mul(uj, ul);
                let speeds = g.mul(times, speeds);
                for (total, part) in sum.iter_mut().zip(self.project(g, &bent, n)) {
                    let term = g.mul(part, speeds);
                    *total = g.add(*total, term);
                }
            }
        }
        sum
    }

    /// Jᵀ(W v̇) with symbols for q̈: M q̈ + c.
    pub(super) fn inverse(&self, g: &mut Graph, n: usize) -> Vec<NodeId> {
        let accelerations = directional(g, &self.velocities, &mut along_motion);
        self.project(g, &accelerations, n)
    }

    /// ∂T/∂q̇.
    pub(super) fn momenta(&self, g: &mut Graph, n: usize) -> Vec<NodeId> {
        self.project(g, &self.velocities, n)
    }
}

/// The direction in which q and t move while q̇ is held.
pub(super) fn transport(g: &mut Graph, symbol: Symbol) -> Option<NodeId> {
    match symbol {
        Symbol::Coordinate(i) => Some(g.symbol(Symbol::Rate(i))),
        Symbol::Time => Some(g.one()),
        _ => None,
    }
}

/// The direction of motion: q̇, q̈ as symbols, and 1 for t.
pub(super) fn along_motion(g: &mut Graph, symbol: Symbol) -> Option<NodeId> {
    match symbol {
        Symbol::Rate(i) => Some(g.symbol(Symbol::Acceleration(i))),
        other => transport(g, other),
    }
}

/// T as Σ w x y with parameter-only w and rate-dependent x, y, and the terms that are not of this form.
fn products(g: &mut Graph, kinetic: NodeId) -> (Vec<(NodeId, NodeId, NodeId)>, Vec<NodeId>) {
    let (mut found, mut others) = (Vec::new(), Vec::new());
    let mut stack = vec![(g.one(), kinetic)];
    while let Some((weight, node)) = stack.pop() {
        match g.node(node) {
            Node::Add(a, b) => stack.extend([(weight, b), (weight, a)]),
            Node::Sub(a, b) => {
                let minus = g.neg(weight);
                stack.extend([(minus, b), (weight, a)]);
            }
            Node::Neg(a) => stack.push((g.neg(weight), a)),
            Node::Mul(a, b) if g.is_constant(a) => stack.push((g.mul(weight, a), b)),
            Node::Mul(a, b) if [a, b].iter().all(|x| g.dependence(*x).on(Dependence::RATES)) => {
                found.push((weight, a, b))
            }
            _ if g.is_zero(node) => {}
            _ => others.push(g.mul(weight, node)),
        }
    }
    (found, others)
}

/// Those of `candidates`, ascending, for which d/dt(∂v/∂q̇) = ∂v/∂q. Worked out on a copy, so that nothing of
/// it stays in the graph.
fn true_velocities(g: &Graph, candidates: &[NodeId], n: usize) -> BTreeSet<NodeId> {
    let mut scratch = g.clone();
    let mut valid = BTreeSet::new();
    for v in candidates {
        // The condition is linear in v: in a chain, each velocity is that of the link before and a term.
        let further = match g.node(*v) {
            Node::Add(a, b) | Node::Sub(a, b) => match [a, b].map(|x| valid.contains(&x)) {
                [true, true] => None,
                [true, false] => Some(b),
                [false, true] => Some(a),
                [false, false] => Some(*v),
            },
            _ => Some(*v),
        };
        let holds = |g: &mut Graph, v: NodeId| is_true_velocity(g, v, n);
        if further.is_none_or(|x| holds(&mut scratch, x) || x != *v && holds(&mut scratch, *v)) {
            valid.insert(*v);
        }
    }
    valid
}

fn is_true_velocity(g: &mut Graph, v: NodeId, n: usize) -> bool {
    if g.dependence(v).on(Dependence::INPUTS.with(Dependence::ACCELERATIONS)) {
        return false;
    }
    let one = g.one();
    let by_rates = gradient_entries(g, &[(v, one)], Symbol::Rate, n);
    if by_rates.iter().any(|(_, s)| g.dependence(*s).on(Dependence::RATES)) {
        return false;
    }
    let (numbers, slopes): (Vec<usize>, Vec<NodeId>) = by_rates.into_iter().unzip();
    let moved = directional(g, &slopes, &mut transport);
    let mut apart: BTreeMap<usize, Fingerprint> =
        numbers.into_iter().zip(moved).map(|(i, slope)| (i, g.fingerprint(slope))).collect();
    for (i, slope) in gradient_entries(g, &[(v, one)], Symbol::Coordinate, n) {
        let difference = apart.entry(i).or_insert(Fingerprint::ZERO);
        *difference = difference.sub(g.fingerprint(slope));
    }
    apart.into_values().all(|difference| difference == Fingerprint::ZERO)
}

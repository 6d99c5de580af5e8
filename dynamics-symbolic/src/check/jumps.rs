//! Energies do not jump where a choice (`if`, `abs`, `signum`) changes. They do with the velocity of a
//! position that has a corner, with masses that are chosen, and with steps of a potential.
//!
//! Lagrange's equations contain no jump: a body keeps its velocities q̇ there, and not its momentum or
//! energy. The check evaluates energies on both sides of the choice, on a few random lines across it. An
//! energy that is the same on both sides, such as one of x|x|, does not jump.

use crate::graph::{
    Bindings, Dependence, Fingerprint, FunctionId, Node, NodeId, Sampler, Symbol, Tape, Unary,
};
use crate::mechanics::{EnergyRole, Model};

use super::Finding;

/// Random lines on which a jump is searched. One that crosses the choice and shows the jump is enough.
const LINES: u64 = 6;
/// Length of a line to both sides, in sizes of random coordinates. A choice farther away is not found.
const REACH: f64 = 8.0;
/// Parts of a line in each of which one change of the choice is found.
const PARTS_OF_LINE: u32 = 128;
/// Distance of both sides from where the choice changes, relative to 1 + |s|. Bisection finds that place to
/// rounding, 1e-16.
const BESIDE_CHOICE: f64 = 1e-11;
/// Smallest difference across the choice, relative to the size of the energies, that may be a jump. A slope
/// changes them by about [`BESIDE_CHOICE`], or a hundred times that.
const LEAST_JUMP: f64 = 1e-4;
/// Relative difference between the jumps seen from one and from a hundred distances, up to which they are a
/// step. A logarithm, the slowest function that grows without bounds, differs by ln 100 of ln 10⁹, or 0.22.
const STEP_TOLERANCE: f64 = 0.1;

/// Energies that jump. No force is the slope of a step: what passes it would gain or lose its height, or
/// climb it with no effort.
pub(super) fn jumps(model: &Model, found: &mut Vec<Finding>) {
    for e in &model.energies {
        let known =
            found.iter().any(|f| matches!(f, Finding::NotQuadratic { origin, .. } if *origin == e.origin));
        if known || e.role == EnergyRole::Dissipation {
            continue;
        }
        let moving = e.role != EnergyRole::Potential && jumps_somewhere(model, e.node, true);
        if moving || e.role != EnergyRole::Kinetic && jumps_somewhere(model, e.node, false) {
            found.push(Finding::EnergyJumps { name: e.name.clone(), origin: e.origin, at_rest: !moving });
        }
    }
}

/// Whether an energy jumps: what the velocities add to it, or what is left of it at rest.
fn jumps_somewhere(model: &Model, energy: NodeId, moving: bool) -> bool {
    let g = &model.graph;
    let chosen = g.cone(&[energy]).into_iter().filter_map(|id| match g.node(id) {
        Node::Select { left, right, .. } => Some((left, Some(right))),
        Node::Unary(Unary::Signum, a) => Some((a, None)),
        // √(x²) is |x| by another name.
        Node::Unary(Unary::Sqrt, square) => match g.node(square) {
            Node::Mul(a, b) if a == b => Some((a, None)),
            _ => None,
        },
        _ => None,
    });
    let mut chosen: Vec<(NodeId, Option<NodeId>)> = chosen.collect();
    chosen.sort_unstable();
    chosen.dedup();
    chosen.into_iter().any(|(left, right)| {
        let on =
            |what| g.dependence(left).on(what) || right.is_some_and(|right| g.dependence(right).on(what));
        // Choices by velocity are not choices by place.
        let placed = on(Dependence::COORDINATES) || on(Dependence::TIME);
        let by_time = !on(Dependence::COORDINATES);
        let across = ChoiceCrossing { model, energy, left, right, by_time, moving };
        // A potential that jumps at some time strikes nothing: it is work from outside.
        placed
            && (moving || !by_time)
            && !on(Dependence::RATES)
            && (0..LINES).any(|line| across.jumps_on(line))
    })
}

/// A choice, and an energy in which it is made.
struct ChoiceCrossing<'a> {
    model: &'a Model,
    energy: NodeId,
    left: NodeId,
    right: Option<NodeId>,
    /// Whether time alone decides.
    by_time: bool,
    /// Whether the part of the energy that velocities add is examined.
    moving: bool,
}

impl ChoiceCrossing<'_> {
    fn jumps_on(&self, line: u64) -> bool {
        let Some(s) = self.crossing(line) else { return false };
        let beside = BESIDE_CHOICE * (1.0 + s.abs());
        let [near, far] = [1.0, 100.0].map(|times| self.difference(line, s, times * beside));
        // A step is as high from farther away. A function that begins at zero there, as a spring that is met,
        // differs by less the nearer it is evaluated. An infinite one, as 1/|x|, differs by more, as both
        // sides are evaluated at slightly different distances.
        near.zip(far).is_some_and(|(near, far)| (near - far).abs() <= STEP_TOLERANCE * far)
    }

    /// The difference of the energies on both sides of s, if it is more than a small part of them.
    fn difference(&self, line: u64, s: f64, beside: f64) -> Option<f64> {
        let sides = [s - beside, s + beside]
            .map(|s| [1.0, 0.0, -1.0].map(|rates| self.value(self.energy, line, s, rates)));
        let [forward, rest, back] = [0, 1, 2].map(|k| sides[1][k] - sides[0][k]);
        // A spring that begins here is nearly zero on both sides: its size is that farther away.
        let away = [s - 1.0, s + 1.0]
            .map(|s| self.value(self.energy, line, s, 1.0))
            .into_iter()
            .filter(|x| x.is_finite());
        let size: f64 = sides.iter().flatten().copied().chain(away).map(f64::abs).sum();
        // A mass that is left behind at some time takes its momentum along; a push at some time is one.
        let jump = match (self.moving, self.by_time) {
            (false, _) => rest,
            (true, true) => forward - back,
            (true, false) => (forward - rest).abs().max((back - rest).abs()),
        };
        // Not where anything is infinite or not a number.
        (size.is_finite() && jump.abs() > LEAST_JUMP * size).then_some(jump.abs())
    }

    /// Where on a line the choice changes.
    fn crossing(&self, line: u64) -> Option<f64> {
        let decider = |s: f64| {
            let right = self.right.map_or(0.0, |right| self.value(right, line, s, 0.0));
            self.value(self.left, line, s, 0.0) - right
        };
        let at = |k: u32| REACH * (2.0 * f64::from(k) / f64::from(PARTS_OF_LINE) - 1.0);
        let changes = |a: f64, b: f64| a < 0.0 && b >= 0.0 || a >= 0.0 && b < 0.0;
        let part = (0..PARTS_OF_LINE).find(|k| changes(decider(at(*k)), decider(at(k + 1))))?;
        let (mut low, mut high) = (at(part), at(part + 1));
        let first = decider(low);
        for _ in 0..64 {
            let middle = 0.5 * (low + high);
            if changes(first, decider(middle)) { high = middle } else { low = middle }
        }
        Some(high)
    }

    fn value(&self, node: NodeId, line: u64, s: f64, rates: f64) -> f64 {
        let (g, mut values) = (&self.model.graph, Vec::new());
        let point = Point { sampler: Sampler::new(g, &[]), model: self.model, line, s, rates };
        Tape::new(g, &[node]).run(g, &point, &mut values);
        values[node.index()]
    }
}

/// A state on a line; velocities are the same ones everywhere on it, but for a factor.
struct Point<'a> {
    sampler: Sampler<'a>,
    model: &'a Model,
    line: u64,
    s: f64,
    rates: f64,
}

impl Bindings for Point<'_> {
    fn symbol(&self, symbol: Symbol) -> f64 {
        // From 0 to 1.
        let random = |k: u64| unit(self.sampler.random(symbol, 2 * self.line + k));
        let along = |size: f64| size * (2.0 * random(0) - 1.0) + self.s * (2.0 * random(1) - 1.0);
        match symbol {
            Symbol::Parameter(i) => {
                let given = self.model.nominal.iter().find(|(p, _)| *p == i);
                given.map_or_else(|| 0.2 + 3.0 * random(0) * random(0), |(_, value)| *value)
            }
            Symbol::Rate(_) => self.rates * (2.0 * random(0) - 1.0),
            _ => along(1.0),
        }
    }

    /// Any smooth function: a sine.
    fn smooth(&self, _: FunctionId, order: u8, x: f64) -> f64 {
        match order % 4 {
            0 => x.sin(),
            1 => x.cos(),
            2 => -x.sin(),
            _ => -x.cos(),
        }
    }
}

fn unit(value: Fingerprint) -> f64 {
    value.residue(0) as f64 / (1u64 << 61) as f64
}

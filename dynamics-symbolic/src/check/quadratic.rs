//! T of `#[kinetic]` is a polynomial of second degree in the velocities; linear and constant parts come from
//! moving frames.
//!
//! Along a random line q̇ = a + s·d the third difference vanishes then, and only then (up to a chance of 1 in
//! 2⁶¹).

use crate::graph::{Dependence, Fingerprint, Node, NodeId, Sampler, Symbol};
use crate::mechanics::{EnergyRole, Model};

use super::Finding;

/// Kinetic energies that are not quadratic.
pub(super) fn quadratic(model: &Model, found: &mut Vec<Finding>) {
    for e in model.energies.iter().filter(|e| e.role == EnergyRole::Kinetic) {
        // Accelerations are reported as such.
        let clean = !model.graph.dependence(e.node).on(Dependence::ACCELERATIONS);
        // Between its branches such a choice is quadratic; across its corner it is nothing.
        let chooses = chooses_velocities(model, e.node);
        if clean && (chooses || !degree_at_most(model, &[e.node], 2, &|s| matches!(s, Symbol::Rate(_)))) {
            found.push(Finding::NotQuadratic { name: e.name.clone(), origin: e.origin, chooses });
        }
    }
}

/// Whether there is a choice between velocities that the velocities do not make themselves: a position chosen
/// by `if`, `min` or `max`, differentiated.
fn chooses_velocities(model: &Model, node: NodeId) -> bool {
    let g = &model.graph;
    let moves = |id: NodeId| g.dependence(id).on(Dependence::RATES);
    g.cone(&[node]).into_iter().any(|id| match g.node(id) {
        Node::Select { left, right, then, otherwise, .. } => {
            !moves(left) && !moves(right) && (moves(then) || moves(otherwise))
        }
        _ => false,
    })
}

/// Whether nodes are polynomials of at most this degree (1 or 2) in the chosen symbols together.
pub(super) fn degree_at_most(
    model: &Model,
    nodes: &[NodeId],
    degree: usize,
    moves: &dyn Fn(Symbol) -> bool,
) -> bool {
    let sampler = Sampler::new(&model.graph, nodes);
    let mut step = Fingerprint::ZERO;
    let mut samples = Vec::new();
    for _ in 0..degree + 2 {
        samples.push(sampler.with(&mut |s| {
            let start = sampler.random(s, 0);
            if moves(s) { start.add(step.mul(sampler.random(s, 1))) } else { start }
        }));
        step = step.add(Fingerprint::ONE);
    }
    // Differences of differences: after degree + 1 rounds nothing is left.
    for _ in 0..=degree {
        samples =
            samples.windows(2).map(|w| w[1].iter().zip(&w[0]).map(|(b, a)| b.sub(*a)).collect()).collect();
    }
    samples.iter().flatten().all(|d| *d == Fingerprint::ZERO)
}

//! Every direction of motion has inertia: M has no null vector that holds in every state.
//!
//! The null space of M is found by elimination modulo 2⁶¹ − 31 at random states. Directions that are the same
//! everywhere are named (`x - 2 y`); of others only the coordinates that take part are known.

use crate::calculus::{directional, gradient};
use crate::graph::{Fingerprint, NodeId, Origin, Sampler, Symbol};
use crate::mechanics::{EnergyRole, Model};

use super::Finding;
use super::modular::{combination, integers, null_space};

/// Directions without inertia; called where the factorization of M met a pivot that is identically zero.
///
/// A zero pivot of a regular M means that M is indefinite (L = ẋẏ): then some direction has negative inertia.
pub(super) fn inertia(model: &mut Model, pivot: usize, found: &mut Vec<Finding>) {
    let n = model.coordinates.len();
    let mass = mass_matrix(model);
    let flat: Vec<NodeId> = mass.iter().flatten().copied().collect();
    let sampler = Sampler::new(&model.graph, &flat);
    let rows =
        |point: u64| sampler.at(point).chunks(n.max(1)).map(<[Fingerprint]>::to_vec).collect::<Vec<_>>();
    let here = null_space(rows(0), n);
    let everywhere = null_space((0..3).flat_map(rows).collect(), n);
    let constant: Vec<Vec<i64>> = everywhere.iter().filter_map(|v| integers(v)).collect();
    for direction in &constant {
        let names: Vec<&str> = model.coordinates.iter().map(|c| c.name.as_str()).collect();
        let origins = involved(model, |i| direction[i] != 0);
        found.push(Finding::NoInertia { direction: combination(direction, &names), origins });
    }
    if here.is_empty() {
        let takes_part = |i: usize| i == pivot || !model.graph.is_zero(mass[pivot][i]);
        let direction = format!("a combination of {}", named(model, takes_part));
        found.push(Finding::NegativeInertia {
            direction,
            nominal: false,
            origins: involved(model, takes_part),
        });
    } else if constant.len() < here.len() {
        // What the named directions do not explain.
        let varying = |i: usize| {
            let named = constant.iter().any(|c| c[i] != 0);
            !named && here.iter().any(|v| v[i] != Fingerprint::ZERO)
        };
        let direction =
            format!("a combination of {} that depends on state or parameters", named(model, varying));
        found.push(Finding::NoInertia { direction, origins: involved(model, varying) });
    }
}

pub(super) fn named(model: &Model, takes_part: impl Fn(usize) -> bool) -> String {
    let names =
        model.coordinates.iter().enumerate().filter(|(i, _)| takes_part(*i)).map(|(_, c)| c.name.as_str());
    names.collect::<Vec<_>>().join(", ")
}

pub(super) fn involved(model: &Model, takes_part: impl Fn(usize) -> bool) -> Vec<Origin> {
    let mut origins: Vec<Origin> = Vec::new();
    for (_, c) in model.coordinates.iter().enumerate().filter(|(i, _)| takes_part(*i)) {
        if !origins.contains(&c.origin) {
            origins.push(c.origin);
        }
    }
    origins
}

/// ∂²L/∂q̇² in the plainest way.
pub(super) fn mass_matrix(model: &mut Model) -> Vec<Vec<NodeId>> {
    let n = model.coordinates.len() as u32;
    let g = &mut model.graph;
    let mut lagrangian = g.zero();
    for e in model.energies.iter().filter(|e| matches!(e.role, EnergyRole::Kinetic | EnergyRole::Lagrangian))
    {
        lagrangian = g.add(lagrangian, e.node);
    }
    let one = g.one();
    let rates: Vec<Symbol> = (0..n).map(Symbol::Rate).collect();
    let momenta = gradient(g, &[(lagrangian, one)], &rates);
    (0..n).map(|j| directional(g, &momenta, &mut |g, s| (s == Symbol::Rate(j)).then(|| g.one()))).collect()
}

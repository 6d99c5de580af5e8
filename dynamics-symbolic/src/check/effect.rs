//! What is declared does something: a potential that depends on no coordinate, a force that moves nothing, an
//! event that cannot happen.

use crate::calculus::gradient;
use crate::graph::{Dependence, Graph, NodeId, Symbol};
use crate::mechanics::{EnergyRole, ForceTerm, Model};

use super::Finding;

/// Energies and events without effect.
pub(super) fn without_effect(model: &Model, found: &mut Vec<Finding>) {
    let g = &model.graph;
    let on = |node: NodeId, what| g.dependence(node).on(what);
    let motion = Dependence::COORDINATES.with(Dependence::RATES);
    // Accelerations are reported as such.
    for e in model.energies.iter().filter(|e| !on(e.node, Dependence::ACCELERATIONS)) {
        let reason = match e.role {
            _ if g.is_zero(e.node) => "is identically zero",
            EnergyRole::Kinetic if !on(e.node, motion) => "does not depend on any velocity",
            EnergyRole::Potential if !on(e.node, motion) => "does not depend on any coordinate",
            EnergyRole::Lagrangian if !on(e.node, motion) => "does not depend on the motion",
            EnergyRole::Dissipation if !on(e.node, Dependence::RATES) => "does not depend on any velocity",
            _ => continue,
        };
        found.push(Finding::NoEffect { role: e.role.text(), name: e.name.clone(), reason, origin: e.origin });
    }
    for e in &model.events {
        if g.is_constant(e.node) {
            let (name, reason) = (e.name.clone(), "never crosses zero because it is constant");
            found.push(Finding::NoEffect { role: "event", name, reason, origin: e.origin });
        }
    }
}

/// Forces whose generalized force is identically zero.
pub(super) fn idle_forces(model: &mut Model, found: &mut Vec<Finding>) {
    let n = model.coordinates.len() as u32;
    let coordinates: Vec<Symbol> = (0..n).map(Symbol::Coordinate).collect();
    for f in &model.forces {
        let mut seeded = Vec::new();
        for term in &f.terms {
            match term {
                ForceTerm::At { point, vector } => {
                    seeded.extend(point.iter().copied().zip(vector.iter().copied()))
                }
                ForceTerm::Along { expression, magnitude } => seeded.push((*expression, *magnitude)),
            }
        }
        let g: &mut Graph = &mut model.graph;
        let generalized = gradient(g, &seeded, &coordinates);
        if generalized.iter().all(|q| g.is_zero(*q)) {
            let reason = "acts on nothing that can move, or is identically zero";
            found.push(Finding::NoEffect { role: "force", name: f.name.clone(), reason, origin: f.origin });
        }
    }
}

//! What each role may contain. T, V, L and D are functions of q, q̇, t: accelerations have no place in them;
//! a potential is a function of q and t; inputs have no known rates, so that nothing that is differentiated
//! by time may contain them.

use crate::graph::{Dependence, Fingerprint, NodeId, Sampler, Symbol};
use crate::mechanics::{EnergyRole, ForceTerm, Model};

use super::Finding;

impl EnergyRole {
    /// Name for messages.
    pub(super) const fn text(self) -> &'static str {
        match self {
            Self::Kinetic => "kinetic energy",
            Self::Potential => "potential energy",
            Self::Lagrangian => "Lagrangian",
            Self::Dissipation => "dissipation function",
        }
    }
}

/// Accelerations, velocities, inputs, reactions and modes where they cannot be.
pub(super) fn contents(model: &Model, found: &mut Vec<Finding>) {
    let on = |node: NodeId, what| model.graph.dependence(node).on(what);
    for e in &model.energies {
        let mut report = |what, reason| {
            let (role, name, origin) = (e.role.text(), e.name.clone(), e.origin);
            found.push(Finding::Contains { role, name, what, reason, origin });
        };
        if on(e.node, Dependence::ACCELERATIONS) {
            report("accelerations", "energies are functions of coordinates, velocities and time");
        } else if on(e.node, Dependence::MULTIPLIERS) {
            report("reactions", "what depends on them is a `#[force]`");
        } else if on(e.node, Dependence::MODES) {
            report(
                "modes",
                "it would jump where a constraint is switched; what depends on them is a `#[force]`",
            );
        } else if e.role == EnergyRole::Potential && on(e.node, Dependence::RATES) {
            report("velocities", "a potential is a function of coordinates and time");
        } else if matches!(e.role, EnergyRole::Kinetic | EnergyRole::Lagrangian)
            && input_in_momenta(model, e.node)
        {
            report("inputs", "the momenta would contain them, and their rates are not known");
        }
    }
    for f in &model.forces {
        let mut report = |what, reason| {
            found.push(Finding::Contains {
                role: "force",
                name: f.name.clone(),
                what,
                reason,
                origin: f.origin,
            });
        };
        let (mut places, mut values) = (Vec::new(), Vec::new());
        for term in &f.terms {
            match term {
                ForceTerm::At { point, vector } => {
                    places.extend(point);
                    values.extend(vector);
                }
                ForceTerm::Along { expression, magnitude } => {
                    places.push(*expression);
                    values.push(*magnitude);
                }
            }
        }
        if places.iter().chain(&values).any(|n| on(*n, Dependence::ACCELERATIONS)) {
            report("accelerations", "they are what the forces decide");
        } else if places.iter().any(|n| on(*n, Dependence::MULTIPLIERS.with(Dependence::MODES))) {
            report(
                "reactions or modes",
                "the place where a force acts is a function of coordinates and time",
            );
        } else if places.iter().any(|n| on(*n, Dependence::RATES)) {
            report("velocities", "the place where a force acts is a function of coordinates and time");
        }
    }
}

/// Whether ∂(node)/∂q̇ contains an input: whether node(w) − node(w′) depends on the velocities.
fn input_in_momenta(model: &Model, node: NodeId) -> bool {
    let dependence = model.graph.dependence(node);
    if !dependence.on(Dependence::INPUTS) || !dependence.on(Dependence::RATES) {
        return false;
    }
    let sampler = Sampler::new(&model.graph, &[node]);
    let at = |input: u64, rate: u64| -> Fingerprint {
        let value = sampler.with(&mut |s| match s {
            Symbol::Input(_) => sampler.random(s, input),
            Symbol::Rate(_) => sampler.random(s, rate),
            _ => sampler.random(s, 0),
        });
        value[0]
    };
    at(0, 0).sub(at(1, 0)) != at(0, 1).sub(at(1, 1))
}

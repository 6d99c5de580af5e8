//! Origins of the engine ↔ places in the user's tokens, and the engine's findings in the user's words.

use std::collections::BTreeSet;

use dynamics_symbolic::check::Finding;
use dynamics_symbolic::check::constraints::ConstraintFinding as Fault;
use dynamics_symbolic::graph::Origin;

use crate::diagnostics::{Diagnostics, Place};
use crate::messages::{self, Message};
use crate::syntax::{ConstraintOptions, Function};

use super::findings;

/// Where everything was declared.
#[derive(Clone, Debug, Default)]
pub(crate) struct Origins {
    places: Vec<Place>,
    /// Options of constraints.
    options: Vec<(Origin, ConstraintOptions)>,
    /// Declarations in functions with mistakes. Findings about the rest of them are not reported.
    mistaken: BTreeSet<u32>,
}

impl Origins {
    /// A new origin.
    pub(crate) fn add(&mut self, place: Place) -> Origin {
        self.places.push(place);
        Origin(self.places.len() as u32 - 1)
    }

    /// A new origin of a constraint, with its options.
    pub(crate) fn add_constraint(&mut self, function: &Function) -> Origin {
        let origin = self.add(Place::from(function.name.span()));
        self.options.push((origin, function.options));
        origin
    }

    /// The place of an origin.
    pub(crate) fn place(&self, origin: Origin) -> Option<Place> {
        self.places.get(origin.0 as usize).copied()
    }

    /// Number of origins so far.
    pub(crate) fn len(&self) -> usize {
        self.places.len()
    }

    /// The origins from the one of this number on stand in a function with a mistake.
    pub(crate) fn mistaken_from(&mut self, first: usize) {
        self.mistaken.extend(first as u32..self.places.len() as u32);
    }

    /// Says what the engine found of what has no mistakes beside.
    pub(crate) fn report_whole(
        &self,
        mut findings: Vec<Finding>,
        model: Place,
        diagnostics: &mut Diagnostics,
    ) {
        findings
            .retain(|finding| !describe(finding).1.iter().any(|origin| self.mistaken.contains(&origin.0)));
        self.report(findings, model, diagnostics);
    }

    /// Findings in words, each with its place.
    pub(crate) fn beside(&self, findings: Vec<Finding>) -> Vec<(Message, Option<Place>)> {
        let described = findings.iter().map(describe);
        described.map(|(message, origins)| (message, origins.first().and_then(|o| self.place(*o)))).collect()
    }

    /// Says what the engine found, where the first of the terms is of which it finds the same.
    pub(crate) fn report_at_terms(
        &self,
        findings: Vec<Finding>,
        of_terms: &[(Message, Option<Place>)],
        model: Place,
        diagnostics: &mut Diagnostics,
    ) {
        for finding in findings {
            let said = describe(&finding).0;
            match of_terms.iter().find(|(message, _)| *message == said) {
                Some((_, Some(place))) if of_a_sum(&finding) => diagnostics.error(*place, &said),
                _ => self.report(vec![finding], model, diagnostics),
            }
        }
    }

    /// Says what the engine found, each at its place, or at the struct's name where it has none.
    pub(crate) fn report(&self, findings: Vec<Finding>, model: Place, diagnostics: &mut Diagnostics) {
        for finding in findings {
            let (message, origins) = describe(&finding);
            let place = self
                .in_vain(&finding)
                .or_else(|| origins.first().and_then(|o| self.place(*o)))
                .unwrap_or(model);
            diagnostics.error(place, &message);
        }
    }

    /// The option that has no effect according to a finding.
    fn in_vain(&self, finding: &Finding) -> Option<Place> {
        let options =
            |of: &Origin| self.options.iter().find(|(origin, _)| origin == of).map(|(_, options)| options);
        match finding {
            Finding::Constraint(Fault::RedundantInVain { origin, .. }) => options(origin)?.redundant,
            Finding::Constraint(Fault::IntegrableInVain { origin, .. }) => options(origin)?.integrable,
            _ => None,
        }
    }
}

/// Whether a finding is about an energy or a force, of which one term may be the cause.
fn of_a_sum(finding: &Finding) -> bool {
    use Finding::{Contains, EnergyJumps, NoEffect, NotQuadratic};
    matches!(finding, Contains { .. } | EnergyJumps { .. } | NoEffect { .. } | NotQuadratic { .. })
}

/// `1 speed`, `2 speeds`.
fn count(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

/// A finding in words, and where it belongs.
fn describe(finding: &Finding) -> (Message, Vec<Origin>) {
    match finding {
        Finding::Unused { what, name, origin } => (messages::unused(what, name), vec![*origin]),
        Finding::NoInertia { direction, origins } => (messages::no_inertia(direction), origins.clone()),
        Finding::ZeroDenominator => (messages::zero_denominator(), Vec::new()),
        Finding::TooLarge { function, operations, limit } => {
            (messages::too_large(function, operations, limit), Vec::new())
        }
        Finding::NotQuadratic { name, origin, chooses: true } => {
            (messages::corner_in_position(name), vec![*origin])
        }
        Finding::EnergyJumps { name, origin, at_rest: true } => {
            (messages::potential_jumps(name), vec![*origin])
        }
        Finding::EnergyJumps { name, origin, .. } => (messages::energy_jumps(name), vec![*origin]),
        Finding::NotQuadratic { name, origin, .. } => (messages::not_quadratic(name), vec![*origin]),
        Finding::Contains { role, name, what, reason, origin } => {
            (messages::contains(role, name, what, reason), vec![*origin])
        }
        Finding::NoEffect { role, name, reason, origin } => {
            (messages::no_effect(role, name, reason), vec![*origin])
        }
        Finding::NegativeInertia { direction, nominal, origins } => {
            let when = if *nominal { " at the nominal values" } else { "" };
            (messages::negative_inertia(direction, when), origins.clone())
        }
        Finding::NotKeptARotation { name, of, origin } => {
            let of: Vec<String> = of.iter().map(|name| format!("`{name}`")).collect();
            (messages::not_kept_a_rotation(name, of.join(", ")), vec![*origin])
        }
        Finding::SpeedNotLinear { name, origin } => (messages::speed_not_linear(name), vec![*origin]),
        Finding::SpeedsCount { speeds, needed, coordinates, rank, origin } => {
            let left = match rank {
                0 => format!(
                    "{} move{}",
                    count(*coordinates, "coordinate"),
                    if *coordinates == 1 { "s" } else { "" }
                ),
                rows => format!(
                    "{} of constraints leave {} of {coordinates} velocities",
                    count(*rows, "row"),
                    needed
                ),
            };
            (messages::speeds_count(count(*speeds, "speed"), left, needed), vec![*origin])
        }
        Finding::SpeedDependent { name, of, origin } if of.is_empty() => {
            (messages::speed_dependent(name, "is zero whatever moves"), vec![*origin])
        }
        Finding::SpeedDependent { name, of, origin } => {
            let of: Vec<String> = of.iter().map(|name| format!("`{name}`")).collect();
            (messages::speed_dependent(name, format!("follows from {}", of.join(", "))), vec![*origin])
        }
        Finding::Constraint(fault) => findings::constraint(fault),
        // Findings that this catalogue does not contain are reported as they are.
        other => (messages::finding(format!("{other:?}")), Vec::new()),
    }
}

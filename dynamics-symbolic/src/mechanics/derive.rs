//! The pass from a declared model to its equations of motion.

use crate::algebra::Factors;
use crate::calculus::{ZeroDenominator, directional};
use crate::graph::{Dependence, Graph, NodeId, Symbol};

use super::equations::{Derivation, Equations, Named, Pivot};
use super::forces::{dissipated, generalized, power};
use super::inverse::{Failure, Implicit, Sweep, residual, with_accelerations};
use super::lagrange::{inverse, lagrange, mixed};
use super::model::{EnergyRole, Model};
use super::velocity_form::VelocityForm;

/// Why equations could not be derived.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Underivable {
    /// A pivot of M is identically zero: the coordinate's index.
    Singular(usize),
    /// A denominator in an output or event is identically zero once the accelerations are put in.
    ZeroDenominator,
}

impl From<ZeroDenominator> for Underivable {
    fn from(_: ZeroDenominator) -> Self {
        Self::ZeroDenominator
    }
}

/// Derives the equations of motion. The conserved quantities are left empty: finding them is a check.
///
/// # Errors
/// A mass matrix that is singular in every state, or a zero denominator.
pub fn derive(model: &mut Model) -> Result<Equations, Underivable> {
    let n = model.coordinates.len();
    let g = &mut model.graph;
    let sum = |g: &mut Graph, role: EnergyRole| {
        let mut total = g.zero();
        for energy in model.energies.iter().filter(|e| e.role == role) {
            total = g.add(total, energy.node);
        }
        total
    };
    let kinetic = sum(g, EnergyRole::Kinetic);
    let potential = sum(g, EnergyRole::Potential);
    let direct = sum(g, EnergyRole::Lagrangian);
    let natural = g.sub(kinetic, potential);
    let lagrangian = g.add(natural, direct);
    let plain = model.energies.iter().all(|e| e.role != EnergyRole::Lagrangian);

    let (form, rest) = VelocityForm::split(g, kinetic, n);
    let derivation = match () {
        () if form.is_empty() => Derivation::Momenta,
        () if g.dependence(rest).on(Dependence::RATES) => Derivation::Mixed,
        () => Derivation::VelocityForm,
    };
    let general = if form.is_empty() {
        lagrangian
    } else {
        let rest = g.sub(rest, potential);
        g.add(rest, direct)
    };
    let inertia = if form.is_empty() { lagrange(g, general, n) } else { mixed(g, &form, general, n) };
    let mut force = inertia.force;
    let mut swept = inverse(g, &form, general, n);
    let mut powers = Vec::new();
    let applied = model.forces.iter().map(|f| (f.name.clone(), generalized(g, f, n))).collect::<Vec<_>>();
    let lost = model.energies.iter().filter(|e| e.role == EnergyRole::Dissipation);
    let lost = lost.map(|e| (e.name.clone(), dissipated(g, e.node, n))).collect::<Vec<_>>();
    for (name, part) in applied.into_iter().chain(lost) {
        for (total, f) in force.iter_mut().zip(&part) {
            *total = g.add(*total, *f);
        }
        for (total, f) in swept.iter_mut().zip(&part) {
            *total = g.sub(*total, *f);
        }
        powers.push(Named { name, unit: String::new(), node: power(g, &part) });
    }
    let explicit = directional(g, &[lagrangian], &mut |g, s| (s == Symbol::Time).then(|| g.one()))[0];
    if !g.is_zero(explicit) {
        powers.push(Named { name: "explicit time".into(), unit: String::new(), node: g.neg(explicit) });
    }

    let factors = Factors::new(g, &inertia.mass).map_err(Underivable::Singular)?;
    let accelerations = factors.solve(g, &force);
    let pivots = factors
        .pivots()
        .map(|(i, pivot)| Pivot { coordinate: i, pivot, diagonal: inertia.mass[i][i] })
        .filter(|p| g.as_number(p.pivot).is_none())
        .collect();
    // Built first, so that it stands for the energy function wherever the two are equal.
    g.add(kinetic, potential);
    let energy_function = {
        let twice = power(g, &inertia.momenta);
        g.sub(twice, lagrangian)
    };

    let residual = residual(g, &inertia.mass, &force, swept);
    // Measured: the residual of a velocity form is swept best along each symbol, any other, and parameters always, best backwards.
    let sweep = if derivation == Derivation::VelocityForm { Sweep::Forward } else { Sweep::Reverse };
    let implicit = Implicit { residual: &residual, factors: &factors, accelerations: &accelerations };
    let jacobians = match implicit.jacobians(g, sweep, model.inputs.len(), model.parameters.len()) {
        Ok(jacobians) => Ok(jacobians),
        Err(Failure::TooLarge(nodes)) => Err(nodes),
        Err(Failure::ZeroDenominator) => return Err(Underivable::ZeroDenominator),
    };

    let uses = |g: &Graph, node: NodeId| g.dependence(node).on(Dependence::ACCELERATIONS);
    let outputs_use_accelerations = model.outputs.iter().flat_map(|o| &o.components).any(|(_, node)| uses(g, *node));
    let events_use_accelerations = model.events.iter().any(|e| uses(g, e.node));
    let mut outputs = Vec::new();
    for output in &model.outputs {
        for (suffix, node) in &output.components {
            let node = with_accelerations(g, &[*node], &accelerations)?[0];
            outputs.push(Named { name: format!("{}{suffix}", output.name), unit: output.unit.clone(), node });
        }
    }
    let mut events = Vec::new();
    for event in &model.events {
        let node: NodeId = with_accelerations(g, &[event.node], &accelerations)?[0];
        events.push(Named { name: event.name.clone(), unit: String::new(), node });
    }
    Ok(Equations {
        derivation,
        mass_matrix: inertia.mass,
        generalized_force: force,
        accelerations,
        pivots,
        momenta: inertia.momenta,
        energy_function,
        energies: plain.then_some((kinetic, potential)),
        powers,
        conserved: Vec::new(),
        jacobians,
        outputs,
        events,
        outputs_use_accelerations,
        events_use_accelerations,
    })
}

//! The pass from a declared model to its equations of motion.

use crate::calculus::{ZeroDenominator, directional, timeless};
use crate::graph::{Dependence, Graph, NodeId, Symbol};

use super::constraints;
use super::equations::{ConstraintEquations, Derivation, Equations, Named};
use super::forces::{dissipated, generalized, power};
use super::inverse::{self, Residual, SOLVED_FOR, Sweep};
use super::lagrange::{Inertia, inverse as inverse_dynamics, lagrange, mixed};
use super::model::{Energy, EnergyRole, Force, Model, Output};
use super::solution::{Manifold, Solved};
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
/// Without constraints, a mass matrix that is singular in every state; a zero denominator.
pub fn derive(model: &mut Model) -> Result<Equations, Underivable> {
    derive_on(model, &Manifold::default())
}

/// Derives the equations of motion of a model of whose constraints something is known beforehand.
///
/// # Errors
/// As for [`derive`].
pub fn derive_on(model: &mut Model, manifold: &Manifold) -> Result<Equations, Underivable> {
    let n = model.coordinates.len();
    let mut constraints = constraints::constraint_equations(model);
    let g = &mut model.graph;
    let energies = Energies::sum(g, &model.energies);
    let parts = Parts::split(g, &energies, n);
    let inertia = parts.inertia(g, n);
    let own = inertia.force;
    let applied = applied(g, &model.forces, &model.energies, n);
    let force = applied.iter().fold(own.clone(), |total, (_, part)| each(g, &total, part, Graph::add));
    // A frame that turns at a given rate is in the positions and, where it does not matter, not in the results.
    let inertia = Inertia {
        mass: inertia.mass.iter().map(|row| timeless(g, row)).collect(),
        force: timeless(g, &force),
        momenta: timeless(g, &inertia.momenta),
    };
    let mut powers = powers(g, &applied, energies.lagrangian);
    if let Some(c) = &mut constraints {
        powers.extend(constraints::powers(g, &model.constraints, &c.velocity_offset));
        c.force_by_multipliers = constraints::force_by_multipliers(g, &inertia.force, c.rows.len());
        c.free_force = free_force(g, &own, &applied);
    }
    let solved = Solved::new(g, &inertia, constraints.as_ref(), manifold)?;
    // T + V is there already, so it stands for the energy function wherever the two are equal.
    let energy_function = {
        let twice = power(g, &inertia.momenta);
        let energy = g.sub(twice, energies.lagrangian);
        timeless(g, &[energy])[0]
    };
    let swept: Residual = &|g| {
        let inverse = parts.inverse(g, n);
        applied.iter().fold(inverse, |total, (_, part)| each(g, &total, part, Graph::sub))
    };
    let size = (model.inputs.len(), model.parameters.len());
    let jacobians = solved.jacobians(g, &inertia, constraints.as_ref(), (swept, parts.sweep()), size)?;
    if let Some(c) = &mut constraints {
        c.derivatives = constraints::derivatives(g, c, n);
    }

    let uses = |g: &Graph, node: NodeId| g.dependence(node).on(SOLVED_FOR);
    let declared: Vec<Named> = model.outputs.iter().flat_map(scalars).collect();
    let watched: Vec<Named> = model.events.iter().map(|e| named(&e.name, "", e.node)).collect();
    let outputs_use_accelerations = declared.iter().any(|o| uses(g, o.node));
    let events_use_accelerations = watched.iter().any(|e| uses(g, e.node));
    let accelerations = solved.free_accelerations();
    Ok(Equations {
        derivation: parts.derivation,
        pivots: solved.pivots(g, &inertia.mass),
        outputs: put_in(g, declared, accelerations)?,
        events: put_in(g, watched, accelerations)?,
        accelerations: accelerations.map_or_else(Vec::new, <[NodeId]>::to_vec),
        mass_matrix: inertia.mass,
        generalized_force: inertia.force,
        momenta: inertia.momenta,
        energy_function,
        energies: energies.apart(&model.energies).map(|(t, v)| (timeless(g, &[t])[0], timeless(g, &[v])[0])),
        powers,
        conserved: Vec::new(),
        jacobians,
        outputs_use_accelerations,
        events_use_accelerations,
        constraints: constraints.map(|c| match solved.into_solution() {
            Some(solution) => ConstraintEquations { solution, ..c },
            None => c,
        }),
    })
}

/// The energies by role.
struct Energies {
    kinetic: NodeId,
    potential: NodeId,
    /// What `#[lagrangian]` functions give.
    direct: NodeId,
    /// T − V + what is given directly.
    lagrangian: NodeId,
}

impl Energies {
    fn sum(g: &mut Graph, declared: &[Energy]) -> Self {
        let [kinetic, potential, direct] =
            [EnergyRole::Kinetic, EnergyRole::Potential, EnergyRole::Lagrangian].map(|role| {
                let zero = g.zero();
                declared.iter().filter(|e| e.role == role).fold(zero, |total, e| g.add(total, e.node))
            });
        g.add(kinetic, potential);
        let natural = g.sub(kinetic, potential);
        Self { kinetic, potential, direct, lagrangian: g.add(natural, direct) }
    }

    /// T and V, where the model gives nothing else.
    fn apart(&self, declared: &[Energy]) -> Option<(NodeId, NodeId)> {
        declared.iter().all(|e| e.role != EnergyRole::Lagrangian).then_some((self.kinetic, self.potential))
    }
}

/// L as a part in velocity form and a general rest.
struct Parts {
    form: VelocityForm,
    general: NodeId,
    derivation: Derivation,
}

impl Parts {
    fn split(g: &mut Graph, energies: &Energies, n: usize) -> Self {
        let (form, rest) = VelocityForm::split(g, energies.kinetic, n);
        if form.is_empty() {
            return Self { form, general: energies.lagrangian, derivation: Derivation::Momenta };
        }
        let rest = g.sub(rest, energies.potential);
        let general = g.add(rest, energies.direct);
        let mixed = g.dependence(general).on(Dependence::RATES);
        Self { form, general, derivation: if mixed { Derivation::Mixed } else { Derivation::VelocityForm } }
    }

    fn inertia(&self, g: &mut Graph, n: usize) -> Inertia {
        if self.form.is_empty() { lagrange(g, self.general, n) } else { mixed(g, &self.form, self.general, n) }
    }

    fn inverse(&self, g: &mut Graph, n: usize) -> Vec<NodeId> {
        inverse_dynamics(g, &self.form, self.general, n)
    }

    /// Measured on models of 6 to 11 coordinates: the residual of a velocity form is swept best along each symbol, any other best backwards.
    fn sweep(&self) -> Sweep {
        if self.derivation == Derivation::VelocityForm { Sweep::Forward } else { Sweep::Reverse }
    }
}

fn each(g: &mut Graph, a: &[NodeId], b: &[NodeId], f: fn(&mut Graph, NodeId, NodeId) -> NodeId) -> Vec<NodeId> {
    a.iter().zip(b).map(|(a, b)| f(g, *a, *b)).collect()
}

/// The generalized force of every force and every dissipation function, by name.
fn applied(g: &mut Graph, forces: &[Force], energies: &[Energy], n: usize) -> Vec<(String, Vec<NodeId>)> {
    let mut applied: Vec<_> = forces.iter().map(|f| (f.name.clone(), generalized(g, f, n))).collect();
    let lossy = energies.iter().filter(|e| e.role == EnergyRole::Dissipation);
    applied.extend(lossy.map(|e| (e.name.clone(), dissipated(g, e.node, n))));
    applied
}

fn named(name: &str, unit: &str, node: NodeId) -> Named {
    Named { name: name.into(), unit: unit.into(), node }
}

/// Powers by name, and −∂L/∂t where L contains time: dE/dt is their sum.
fn powers(g: &mut Graph, applied: &[(String, Vec<NodeId>)], lagrangian: NodeId) -> Vec<Named> {
    let mut powers: Vec<Named> = applied.iter().map(|(name, part)| named(name, "", power(g, part))).collect();
    let explicit = directional(g, &[lagrangian], &mut |g, s| (s == Symbol::Time).then(|| g.one()))[0];
    if !g.is_zero(explicit) {
        powers.push(named("explicit time", "", g.neg(explicit)));
    }
    powers
}

/// Q without the applied forces that contain reactions.
fn free_force(g: &mut Graph, own: &[NodeId], applied: &[(String, Vec<NodeId>)]) -> Vec<NodeId> {
    let free = applied.iter().filter(|(_, part)| part.iter().all(|f| !g.dependence(*f).on(Dependence::MULTIPLIERS)));
    let free: Vec<&Vec<NodeId>> = free.map(|(_, part)| part).collect();
    let force = free.into_iter().fold(own.to_vec(), |total, part| each(g, &total, part, Graph::add));
    timeless(g, &force)
}

fn scalars(output: &Output) -> impl Iterator<Item = Named> {
    output.components.iter().map(|(suffix, node)| named(&format!("{}{suffix}", output.name), &output.unit, *node))
}

/// With accelerations replaced by their values, where these are on the graph.
fn put_in(g: &mut Graph, named: Vec<Named>, accelerations: Option<&[NodeId]>) -> Result<Vec<Named>, Underivable> {
    let mut nodes: Vec<NodeId> = named.iter().map(|n| n.node).collect();
    if let Some(accelerations) = accelerations {
        nodes = inverse::put_in(g, &nodes, accelerations, &[])?;
    }
    let nodes = timeless(g, &nodes);
    Ok(named.into_iter().zip(nodes).map(|(named, node)| Named { node, ..named }).collect())
}

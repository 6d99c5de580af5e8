//! The pass from a declared model to its equations of motion.

use crate::algebra::ArticulatedForm;
use crate::calculus::{directional, gradient, remove_time};
use crate::graph::{Dependence, Graph, NodeId, Symbol};

use super::articulated_bodies::articulated_form;
use super::bodies::Tree;
use super::constraints::{self, ConstraintTerms};
use super::equations::{
    ConstraintEquations, Derivation, Equations, Named, NoSpeedForm, Released, Solution, Underivable,
    Variations,
};
use super::forces::{dissipated, generalized, power};
use super::inverse::{self, Residual, SOLVED_FOR, SweepDirection, residual_by_entries};
use super::lagrange::{Inertia, inverse as inverse_dynamics, lagrange, mixed, without_mass_matrix};
use super::limits::{MOST_NODES, MOST_OPERATIONS};
use super::model::{Energy, EnergyRole, Force, Model, Output};
use super::solution::{Manifold, Solved, with_constraints};
use super::speeds::{CoordinateEquations, Speeds};
use super::velocity_form::VelocityForm;

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
/// As for [`fn@derive`].
pub fn derive_on(model: &mut Model, manifold: &Manifold) -> Result<Equations, Underivable> {
    let n = model.coordinates.len();
    let rows = ConstraintTerms::of(model);
    let speeds = Speeds::of(model);
    let mut energies = Energies::sum(&mut model.graph, &model.energies);
    let tree = Tree::of(model, energies.kinetic, energies.potential);
    let g = &mut model.graph;
    let applied = applied(g, &model.forces, &model.energies, n);
    let parts = Parts::shortest(g, &energies, tree, n, &|g, parts| {
        let (inertia, _) = parts.balance(g, &applied, n);
        match &rows {
            // With constraints the rest of the work is the same.
            Some(_) => Some([inertia.mass.concat(), inertia.force].concat()),
            None => Some(
                Solved::free(g, &inertia, &|g| parts.articulated_form(g, &applied, n)).ok()?.free_results(),
            ),
        }
    });
    parts.rewrite(g, &mut energies);
    let needs_mass_matrix = rows.is_some() || speeds.is_some();
    let without = if needs_mass_matrix { None } else { parts.without_mass_matrix(g, n) };
    let (inertia, free_force) = match without {
        Some(inertia) => parts.balanced(g, inertia, &applied),
        None => parts.balance(g, &applied, n),
    };
    let mut powers = powers(g, &applied, energies.lagrangian);
    powers.extend(
        rows.iter().flat_map(|rows| constraints::powers(g, &model.constraints, &rows.velocity_offset)),
    );
    let unsolved = speeds.is_some().then(|| g.clone());
    let solved = match &rows {
        Some(rows) => Solved::constrained(g, &inertia, rows, manifold),
        None => Solved::free(g, &inertia, &|g| parts.articulated_form(g, &applied, n))?,
    };
    let (solved, aside) = match (&speeds, unsolved) {
        (Some(speeds), Some(unsolved)) if !model.constraints.iter().any(|c| c.switched || c.redundant) => {
            let mut before = unsolved;
            let given = energies.given(&mut before, &applied, n);
            let beside = CoordinateEquations {
                inertia: &inertia,
                rows: rows.as_ref(),
                given: given.as_deref(),
                states: manifold.states,
            };
            speeds.lead(g, solved, &before, &beside)
        }
        _ => (solved, Some(NoSpeedForm::Constraints)),
    };
    let speeds = speeds.map(|speeds| speeds.into_equations(g, &solved, aside));
    let energy_function = energy_function(g, &inertia.momenta, energies.lagrangian);
    let swept: Residual = &|g| {
        let inverse = parts.inverse(g, n);
        applied.iter().fold(inverse, |total, (_, part)| each(g, &total, part, Graph::sub))
    };
    let size = (model.inputs.len(), model.parameters.len());
    let jacobians = solved.jacobians(g, &inertia, rows.as_ref(), (swept, parts.sweep()), size)?;
    let outputs = model.outputs.iter().flat_map(scalars).collect();
    let events = model.events.iter().map(|e| named(&e.name, "", e.node)).collect();
    let (outputs, outputs_use_accelerations) = put_in(g, outputs, &solved)?;
    let (events, events_use_accelerations) = put_in(g, events, &solved)?;
    let energies =
        energies.apart(&model.energies).map(|(t, v)| (remove_time(g, &[t])[0], remove_time(g, &[v])[0]));
    let pivots = solved.pivots(g);
    let accelerations = solved.free_accelerations().map_or_else(Vec::new, <[NodeId]>::to_vec);
    let released = rows
        .as_ref()
        .map_or_else(Vec::new, |rows| solved.released(g, &inertia, rows, &model.constraints, manifold));
    let constraints = rows.zip(solved.into_solution()).map(|(rows, solution)| {
        let forces = (inertia.force.as_slice(), free_force);
        constraint_equations(g, rows, forces, solution, released)
    });
    Ok(Equations {
        derivation: parts.derivation,
        mass_matrix: inertia.mass,
        mass_product: inertia.product,
        generalized_force: inertia.force,
        momenta: inertia.momenta,
        conserved: Vec::new(),
        accelerations,
        pivots,
        energy_function,
        energies,
        powers,
        jacobians,
        outputs,
        events,
        outputs_use_accelerations,
        events_use_accelerations,
        speeds,
        constraints,
    })
}

/// ṗ = ∂L/∂q and the applied forces: with p, what Hamilton's equations say.
pub fn momentum_rates(model: &mut Model) -> Vec<NodeId> {
    let n = model.coordinates.len();
    let g = &mut model.graph;
    let (lagrangian, one) = (Energies::sum(g, &model.energies).lagrangian, g.one());
    let coordinates: Vec<Symbol> = (0..n as u32).map(Symbol::Coordinate).collect();
    let own = gradient(g, &[(lagrangian, one)], &coordinates);
    let applied = applied(g, &model.forces, &model.energies, n);
    let all = applied.iter().fold(own, |total, (_, part)| each(g, &total, part, Graph::add));
    remove_time(g, &all)
}

/// The equations before they are solved, with symbols for q̈ and λ: M q̈ − Q − Φ_qᵀλ (N), which is inverse
/// dynamics, and Φ_q q̈ − γ (R). In the form that takes the fewest operations: of bodies that hang on one
/// another by one recursion outward and one inward, so that operations are in proportion to the joints (J. Y.
/// S. Luh, M. W. Walker and R. P. C. Paul, J. Dyn. Syst. Meas. Control 102 (1980) 69).
pub fn residual(model: &mut Model) -> Vec<NodeId> {
    let n = model.coordinates.len();
    let rows = ConstraintTerms::of(model);
    let energies = Energies::sum(&mut model.graph, &model.energies);
    let tree = Tree::of(model, energies.kinetic, energies.potential);
    let g = &mut model.graph;
    let parts = Parts::shortest(g, &energies, tree, n, &|g, parts| Some(parts.inverse(g, n)));
    let applied = applied(g, &model.forces, &model.energies, n);
    let inverse = parts.inverse(g, n);
    let residual = applied.iter().fold(inverse, |total, (_, part)| each(g, &total, part, Graph::sub));
    match &rows {
        Some(rows) => with_constraints(g, residual, rows),
        None => residual,
    }
}

/// Derivatives of the equations before they are solved, which are [`residual`], by the sweeps that take fewer
/// operations; nothing else needs them.
///
/// # Errors
/// The nodes that were taken, where they are more than can end in programs that are emitted.
pub fn variations(model: &mut Model, joined: &[NodeId]) -> Result<Variations, usize> {
    let size = (model.coordinates.len(), model.inputs.len());
    let rows = ConstraintTerms::of(model);
    let g = &mut model.graph;
    let velocities = rows.as_ref().map_or(&[][..], |rows| rows.velocity_residual.as_slice());
    let mut best: Result<(usize, Graph, Variations), usize> = Err(0);
    for sweep in [SweepDirection::Forward, SweepDirection::Reverse] {
        // On a copy, so that what is not taken leaves no trace.
        let mut trial = g.clone();
        match inverse::variations(&mut trial, joined, velocities, sweep, size) {
            Ok(found) => {
                let operations = trial.operations(&found.all());
                if best.as_ref().map_or(true, |(least, ..)| operations < *least) {
                    best = Ok((operations, trial, found));
                }
            }
            Err(nodes) => best = best.map_err(|most| most.max(nodes)),
        }
    }
    best.map(|(_, graph, found)| {
        *g = graph;
        found
    })
}

/// Derivatives of the outputs as they were declared, by q, q̇, q̈, λ and inputs, one matrix after the other,
/// by rows: what C and D of a state space are made of.
///
/// # Errors
/// The nodes that were taken, where they are more than can end in programs that are emitted.
pub fn output_variations(model: &mut Model) -> Result<Vec<NodeId>, usize> {
    let roots: Vec<NodeId> = model.outputs.iter().flat_map(scalars).map(|output| output.node).collect();
    let (n, inputs) = (model.coordinates.len(), model.inputs.len());
    let rows = ConstraintTerms::of(model).map_or(0, |rows| rows.named.len());
    // On a copy, so that what is not taken leaves no trace.
    let mut trial = model.graph.clone();
    let found = inverse::output_variations(&mut trial, &roots, (n, rows, inputs))?;
    model.graph = trial;
    Ok(found)
}

/// q̇·∂L/∂q̇ − L. T + V is there already, so it stands for the energy function wherever the two are equal.
fn energy_function(g: &mut Graph, momenta: &[NodeId], lagrangian: NodeId) -> NodeId {
    let twice = power(g, momenta);
    let energy = g.sub(twice, lagrangian);
    remove_time(g, &[energy])[0]
}

/// What the rows give; `forces`: Q, and Q without what depends on multipliers.
fn constraint_equations(
    g: &mut Graph,
    rows: ConstraintTerms,
    (force, free_force): (&[NodeId], Vec<NodeId>),
    solution: Solution,
    released: Vec<Released>,
) -> ConstraintEquations {
    ConstraintEquations {
        force_by_multipliers: constraints::force_by_multipliers(g, force, rows.named.len()),
        derivatives: constraints::derivatives(g, &rows, force.len()),
        free_force,
        rows: rows.named,
        holonomic: rows.holonomic,
        residual: rows.residual,
        velocity_residual: rows.velocity_residual,
        jacobian: rows.jacobian,
        velocity_offset: rows.velocity_offset,
        gamma: rows.gamma,
        solution,
        released,
    }
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

    /// Forces without those of inertia: −∂V/∂q and applied forces. `None` where L is given directly, as
    /// V is then not known.
    fn given(&self, g: &mut Graph, applied: &[(String, Vec<NodeId>)], n: usize) -> Option<Vec<NodeId>> {
        if !g.is_zero(self.direct) {
            return None;
        }
        let minus = g.integer(-1);
        let coordinates: Vec<Symbol> = (0..n as u32).map(Symbol::Coordinate).collect();
        let own = gradient(g, &[(self.potential, minus)], &coordinates);
        Some(applied.iter().fold(own, |total, (_, part)| each(g, &total, part, Graph::add)))
    }

    /// T and V, where the model gives nothing else.
    fn apart(&self, declared: &[Energy]) -> Option<(NodeId, NodeId)> {
        declared.iter().all(|e| e.role != EnergyRole::Lagrangian).then_some((self.kinetic, self.potential))
    }
}

/// Fewest coordinates of a model whose M may be left out. The M of smaller ones has no more than 820
/// different elements, and is worth its operations.
const FEWEST_COORDINATES_WITHOUT_MASS_MATRIX: usize = 40;

/// L as bodies that hang on one another, a part in velocity form and a general rest.
struct Parts {
    bodies: Option<Tree>,
    form: VelocityForm,
    general: NodeId,
    derivation: Derivation,
}

impl Parts {
    fn split(g: &mut Graph, energies: &Energies, bodies: Option<Tree>, n: usize) -> Self {
        let (kinetic, potential) = bodies
            .as_ref()
            .map_or((energies.kinetic, energies.potential), |tree| (tree.kinetic, tree.potential));
        let (form, rest) = VelocityForm::split(g, kinetic, n);
        if form.is_empty() && bodies.is_none() {
            return Self { bodies, form, general: energies.lagrangian, derivation: Derivation::Momenta };
        }
        let rest = g.sub(rest, potential);
        let general = g.add(rest, energies.direct);
        let mixed = g.dependence(general).on(Dependence::RATES);
        let derivation = match bodies {
            Some(_) => Derivation::Bodies,
            None if mixed => Derivation::Mixed,
            None => Derivation::VelocityForm,
        };
        Self { bodies, form, general, derivation }
    }

    /// With the tree of bodies or without, whichever has the shorter results.
    fn shortest(
        g: &mut Graph,
        energies: &Energies,
        tree: Option<Tree>,
        n: usize,
        results: &dyn Fn(&mut Graph, &Self) -> Option<Vec<NodeId>>,
    ) -> Self {
        let Some(tree) = tree else { return Self::split(g, energies, None, n) };
        // On copies, so that what is not taken leaves no trace.
        let weight = |tree: Option<Tree>| {
            let mut trial = g.clone();
            let parts = Self::split(&mut trial, energies, tree, n);
            let results = results(&mut trial, &parts)?;
            Some(trial.weight(&results))
        };
        let (without, with) = (weight(None), weight(Some(tree.clone())));
        let shorter = with.is_some_and(|with| without.is_none_or(|without| with < without));
        let taken = shorter && Self::agree(g, energies, &tree, n);
        Self::split(g, energies, taken.then_some(tree), n)
    }

    /// Whether M q̈ − Q, both ways, is that of T and V: the bodies are noted beside the energies, and what
    /// was noted proves itself before it is used.
    fn agree(g: &Graph, energies: &Energies, tree: &Tree, n: usize) -> bool {
        let mut trial = g.clone();
        let g = &mut trial;
        let expected = Self::split(g, energies, None, n).inverse(g, n);
        let parts = Self::split(g, energies, Some(tree.clone()), n);
        let found = parts.inertia(g, n);
        let by_entries = residual_by_entries(g, &found.mass, &found.force);
        let by_recursion = parts.inverse(g, n);
        let same =
            |a: &[NodeId], b: &[NodeId]| a.iter().zip(b).all(|(a, b)| g.fingerprint(*a) == g.fingerprint(*b));
        same(&by_entries, &expected) && same(&by_recursion, &expected)
    }

    /// Replaces T by its form from the recursion, where that is shorter than the declared one.
    fn rewrite(&self, g: &mut Graph, energies: &mut Energies) {
        let Some(tree) = &self.bodies else { return };
        let energy = tree.afresh(g, |g| tree.energy(g));
        let kinetic = g.add(energy, tree.kinetic);
        if g.weight(&[kinetic]) < g.weight(&[energies.kinetic]) {
            energies.kinetic = kinetic;
            // T + V, too, is to be made of it.
            let parts = g.cone(&[kinetic, energies.potential]);
            g.afresh(&parts, |g| g.add(kinetic, energies.potential));
        }
    }

    fn inertia(&self, g: &mut Graph, n: usize) -> Inertia {
        let beside = if self.form.is_empty() {
            lagrange(g, self.general, n)
        } else {
            mixed(g, &self.form, self.general, n)
        };
        match &self.bodies {
            Some(tree) => tree.afresh(g, |g| tree.inertia(g)).and(g, &beside),
            None => beside,
        }
    }

    /// M, Q and p with the applied forces, and Q without those that contain reactions.
    fn balance(&self, g: &mut Graph, applied: &[(String, Vec<NodeId>)], n: usize) -> (Inertia, Vec<NodeId>) {
        let inertia = self.inertia(g, n);
        self.balanced(g, inertia, applied)
    }

    /// The same of what follows from L alone.
    fn balanced(
        &self,
        g: &mut Graph,
        inertia: Inertia,
        applied: &[(String, Vec<NodeId>)],
    ) -> (Inertia, Vec<NodeId>) {
        let all =
            applied.iter().fold(inertia.force.clone(), |total, (_, part)| each(g, &total, part, Graph::add));
        let without = free_force(g, &inertia.force, applied);
        // A frame that turns at a given rate is in the positions and, where it does not matter, not in the
        // results.
        let inertia = Inertia {
            mass: inertia.mass.iter().map(|row| remove_time(g, row)).collect(),
            product: remove_time(g, &inertia.product),
            left_out: inertia.left_out,
            force: remove_time(g, &all),
            momenta: remove_time(g, &inertia.momenta),
        };
        (inertia, remove_time(g, &without))
    }

    /// What follows from L without M, where M is too large to be emitted and all velocities are those of a
    /// velocity form.
    fn without_mass_matrix(&self, g: &mut Graph, n: usize) -> Option<Inertia> {
        if n < FEWEST_COORDINATES_WITHOUT_MASS_MATRIX || self.derivation != Derivation::VelocityForm {
            return None;
        }
        // On a copy, so that an M that is not wanted leaves no trace.
        let mut trial = g.clone();
        let most = trial.len() + MOST_NODES;
        let columns = self.form.mass_columns(&mut trial, n, most);
        let works = |id: &&NodeId| trial.node(**id).children().next().is_some();
        let operations = match columns {
            Some(columns) => trial.cone(&columns.concat()).iter().filter(works).count(),
            None => trial.len() - g.len(),
        };
        let too_large = operations > MOST_OPERATIONS;
        too_large.then(|| without_mass_matrix(g, &self.form, self.general, n, operations))
    }

    fn inverse(&self, g: &mut Graph, n: usize) -> Vec<NodeId> {
        let beside = inverse_dynamics(g, &self.form, self.general, n);
        match &self.bodies {
            Some(tree) => {
                let bodies = tree.afresh(g, |g| tree.inverse(g));
                each(g, &bodies, &beside, Graph::add)
            }
            None => beside,
        }
    }

    /// T by velocities that are sums of other velocities, where they are.
    fn articulated_form(
        &self,
        g: &mut Graph,
        applied: &[(String, Vec<NodeId>)],
        n: usize,
    ) -> Option<ArticulatedForm> {
        let none = vec![g.zero(); n];
        let applied = applied.iter().fold(none, |total, (_, part)| each(g, &total, part, Graph::add));
        if self.derivation == Derivation::VelocityForm {
            articulated_form(g, &self.form, self.general, &applied)
        } else {
            None
        }
    }

    /// Measured on models of 6 to 11 coordinates: the residual of a velocity form is swept best along each
    /// symbol, any other best backwards.
    fn sweep(&self) -> SweepDirection {
        if self.derivation == Derivation::VelocityForm {
            SweepDirection::Forward
        } else {
            SweepDirection::Reverse
        }
    }
}

fn each(
    g: &mut Graph,
    a: &[NodeId],
    b: &[NodeId],
    f: fn(&mut Graph, NodeId, NodeId) -> NodeId,
) -> Vec<NodeId> {
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
    let is_free =
        |g: &Graph, part: &[NodeId]| part.iter().all(|f| !g.dependence(*f).on(Dependence::MULTIPLIERS));
    let free: Vec<&Vec<NodeId>> =
        applied.iter().map(|(_, part)| part).filter(|part| is_free(g, part)).collect();
    free.into_iter().fold(own.to_vec(), |total, part| each(g, &total, part, Graph::add))
}

fn scalars(output: &Output) -> impl Iterator<Item = Named> {
    output
        .components
        .iter()
        .map(|(suffix, node)| named(&format!("{}{suffix}", output.name), &output.unit, *node))
}

/// With accelerations replaced by their values, where these are on the graph without multipliers; and whether
/// any were declared in terms of what is known only once the equations are solved.
fn put_in(g: &mut Graph, named: Vec<Named>, solved: &Solved) -> Result<(Vec<Named>, bool), Underivable> {
    let mut nodes: Vec<NodeId> = named.iter().map(|n| n.node).collect();
    let used = nodes.iter().any(|node| g.dependence(*node).on(SOLVED_FOR));
    if let Some(accelerations) = solved.free_accelerations() {
        nodes = inverse::put_in(g, &nodes, accelerations, &[])?;
    }
    let nodes = remove_time(g, &nodes);
    Ok((named.into_iter().zip(nodes).map(|(named, node)| Named { node, ..named }).collect(), used))
}

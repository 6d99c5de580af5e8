//! The engine's driver: one line per pass.

mod portable;

use std::collections::{BTreeMap, BTreeSet};

use crate::algebra::{Guard, States, Unrolled};
use crate::check::constraints::Sample;
use crate::check::hazards::{Branch, Hazards, Kink};
use crate::check::{self, Finding};
use crate::graph::{Bindings, FunctionId, Graph, Node, NodeId};
pub use crate::mechanics::MOST_OPERATIONS;
use crate::mechanics::{
    ConstraintEquations, Equations, General, Manifold, Model, Named, NoDerivatives, Solution, Underivable,
    derive_on, momentum_rates, output_variations, residual, variations,
};
use crate::schedule::{Program, Staging, schedule};
use crate::series::{Series, Unexpandable, expand};
use crate::text::{self, Portability};

/// Programs of a model, one per function that the runtime's traits ask for. Results are flattened row by row.
#[derive(Clone, Debug)]
pub struct Programs {
    /// q̈ (N), then for every pivot Dᵢ and Mᵢᵢ; with constraints as in [`ConstraintPrograms`]. Staged:
    /// what depends on parameters alone is hoisted.
    pub accelerations: Program,
    /// M, N×N by rows; without results where it is left out.
    pub mass_matrix: Program,
    /// M q̈ (N), reading accelerations as symbols, where M is left out: the columns of M are those of unit
    /// accelerations.
    pub mass_product: Option<Program>,
    /// Q (N).
    pub generalized_force: Program,
    /// ∂L/∂q̇ (N).
    pub momenta: Program,
    /// E.
    pub energy_function: Program,
    /// T; only without `#[lagrangian]`.
    pub kinetic_energy: Option<Program>,
    /// V; only without `#[lagrangian]`.
    pub potential_energy: Option<Program>,
    /// Conserved quantities.
    pub conserved: Program,
    /// Powers.
    pub powers: Program,
    /// Derivatives of q̈, or why there are none: then the model is not linearised.
    pub jacobians: Result<JacobianPrograms, NoJacobians>,
    /// Inverse dynamics, M q̈ − Q − Φ_qᵀλ (N), reading accelerations and multipliers as symbols;
    /// `None` where it is too large to be emitted. Not listed.
    pub inverse: Option<Program>,
    /// What [`Variations`](crate::mechanics::Variations) holds, one matrix after the other, by rows, reading
    /// accelerations and multipliers as symbols; `None` where it is too large to be emitted, or takes fourth
    /// derivatives of functions that are given by values. Not listed.
    pub variations: Option<Program>,
    /// Derivatives of the outputs by q, q̇, q̈, λ and inputs, one matrix after the other, by rows, reading
    /// accelerations and multipliers as symbols; `None` as for `variations`, and without outputs. Not listed.
    pub output_variations: Option<Program>,
    /// The generalized speeds w (S), then Y (S×N by rows) and y (S); empty without any.
    pub speeds: Program,
    /// Outputs, then, where any of them uses accelerations, Dᵢ and Mᵢᵢ for every pivot.
    pub outputs: Program,
    /// Events, likewise.
    pub events: Program,
    /// The values of [`Model::assumptions`], one after the other. Not listed.
    pub assumptions: Program,
    /// Programs of the constraints; `None` without any.
    pub constraints: Option<ConstraintPrograms>,
    /// Taylor coefficients of motions, or why there are none.
    pub series: Result<Series, Unexpandable>,
    /// Where the accelerations are not smooth.
    pub kinks: Kinks,
    /// ṗ (N), where Q contains velocities and there are no constraints. Elsewhere p contains no more than
    /// q̇. Not listed.
    pub momentum_rates: Option<Program>,
}

/// Values at whose change of sign, or of piece, the accelerations are not smooth: steps are made to end
/// there.
#[derive(Clone, Debug)]
pub struct Kinks {
    /// Whether they are all of them, as [`Hazards::are_followed`] has it.
    pub are_all: bool,
    /// The values.
    pub program: Program,
    /// For each the function whose argument it is; `None` for what matters where it changes its sign.
    pub functions: Vec<Option<FunctionId>>,
    /// The operations that they decide.
    pub branches: BTreeMap<NodeId, Branch>,
    /// Values that depend on λ, likewise. No branch of theirs is held.
    pub of_reactions: Program,
    /// Their functions.
    pub reaction_functions: Vec<Option<FunctionId>>,
}

/// Programs of a model with constraints; N coordinates, R rows, H of them holonomic. Where there are some,
/// `Programs::accelerations` gives q̈ (N), λ (R), and for every guard its pivot and scale, where the
/// solution is unrolled, else nothing. Outputs, events and powers read accelerations and multipliers as
/// symbols.
#[derive(Clone, Debug)]
pub struct ConstraintPrograms {
    /// Φ, H.
    pub residual: Program,
    /// Φ_q q̇ + Φ_t joined by A q̇ + b, R.
    pub velocity_residual: Program,
    /// Φ_q joined by A, R×N by rows.
    pub jacobian: Program,
    /// Φ_t joined by b, R.
    pub velocity_offset: Program,
    /// γ, R.
    pub gamma: Program,
    /// M (N×N), Q (N), Φ_q (R×N), γ (R) at once: what the general solver needs; Q without the forces that
    /// contain reactions.
    pub terms: Program,
    /// Q (N) and ∂Q/∂λ (N×R by rows), reading multipliers, where forces contain reactions.
    pub friction: Option<Program>,
    /// δ (N), then for every guard its pivot and scale, reading multipliers as right-hand sides; where the
    /// solution is unrolled and this program not too large to be emitted. Staged like the accelerations.
    pub correction: Option<Program>,
    /// The same where some switched constraints are released, in the order of
    /// [`ConstraintEquations::released`].
    pub released: Vec<ReleasedPrograms>,
    /// ∂(Φ_qᵀλ)/∂q (N×N by rows), ∂γ/∂q (R×N), ∂γ/∂q̇ (R×N), reading multipliers;
    /// unless it is too large to be emitted.
    pub derivatives: Result<Program, Excess>,
}

/// Programs for a set of switched constraints that are released.
#[derive(Clone, Debug)]
pub struct ReleasedPrograms {
    /// As `Programs::accelerations`; λ of released rows is 0.
    pub accelerations: Program,
    /// As [`ConstraintPrograms::correction`].
    pub correction: Program,
}

/// Why a model is not linearised.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum NoJacobians {
    /// One of them is too large to be emitted.
    TooLarge(Excess),
    /// q̈ is found by the general solver, at run time.
    General,
    /// M is left out, and q̈ found without it.
    NoMassMatrix,
}

/// Programs for the derivatives of q̈; with constraints pivot and scale of every guard stand in the place of
/// Dᵢ and Mᵢᵢ.
#[derive(Clone, Debug)]
pub struct JacobianPrograms {
    /// q̈ (N), ∂q̈/∂q (N×N by rows), ∂q̈/∂q̇ (N×N by rows), then Dᵢ and Mᵢᵢ for every
    /// pivot. Staged like the accelerations.
    pub state: Program,
    /// ∂q̈/∂w (N×W by rows), then Dᵢ and Mᵢᵢ for every pivot.
    pub inputs: Program,
    /// ∂q̈/∂p (N×P by rows), then Dᵢ and Mᵢᵢ for every pivot.
    pub parameters: Program,
}

/// A program with more operations than can be emitted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Excess {
    /// The function.
    pub function: String,
    /// Its operations; where deriving it was given up, the number of nodes by then.
    pub operations: usize,
}

/// Most operations of the derivatives for small motions. Few programs ask for them, and every build would pay
/// for more.
const MOST_VARIATION_OPERATIONS: usize = 15_000;

/// Most operations of inverse dynamics where M is left out. It is emitted as a table of 16-bit places, which
/// is compiled in no time.
const MOST_INVERSE_OPERATIONS_WITHOUT_MASS_MATRIX: usize = 2 * MOST_OPERATIONS;

/// A model with everything that was derived from it.
#[derive(Clone, Debug)]
pub struct Compiled {
    /// The model; its graph holds all nodes.
    pub model: Model,
    /// The derived equations.
    pub equations: Equations,
    /// The programs to emit.
    pub programs: Programs,
    /// Degrees of freedom, conserved quantities, structure, cost.
    pub report: String,
    /// The derived program as stable text with operation counts.
    pub listing: String,
    /// Readable equations.
    pub equations_text: String,
    /// The equations in LaTeX.
    pub latex: String,
    /// The equations in MathML: one `<p class="eq">` per equation, each term a `<math>` of its own.
    pub mathml: String,
    /// The programs in JavaScript, for pages.
    pub portability: Portability,
}

/// Derives, checks and schedules a model.
///
/// # Errors
/// Everything that the checks found.
pub fn compile(mut model: Model) -> Result<Compiled, Vec<Finding>> {
    let found = check::declared(&model);
    if !found.is_empty() {
        return Err(found);
    }
    let constraints = check::constraints::analyse(&model);
    if !constraints.findings.is_empty() {
        return Err(constraints.findings);
    }
    let found = check::speeds(&model, &constraints);
    if !found.is_empty() {
        return Err(found);
    }
    let [anywhere, likely, passed] =
        [&constraints.guides[..], constraints.likely.as_slice(), &constraints.passed].map(bindings);
    let states = States { anywhere: &anywhere, likely: &likely, passed: &passed };
    let manifold = Manifold { states, redundant: constraints.redundant };
    let mut equations = derive_on(&mut model, &manifold).map_err(|e| findings(&mut model, &e))?;
    equations.conserved = check::conserved(&mut model, &equations);
    equations.powers.iter_mut().for_each(|p| p.unit = check::power_unit(&model));
    let found = check::derived(&mut model, &equations, &constraints);
    if !found.is_empty() {
        return Err(found);
    }
    let found = too_many_derivatives(&model, &equations);
    if !found.is_empty() {
        return Err(found);
    }
    let mut programs = fitting_programs(&model, &mut equations);
    let excesses: Vec<Finding> = programs.required().filter_map(excess).map(Excess::into_finding).collect();
    if !excesses.is_empty() {
        return Err(excesses);
    }
    programs.momentum_rates = canonical(&mut model, &equations);
    let hazards = Hazards::of(&model, &equations);
    let (kinks, of_reactions) = (hazards.kinks(&mut model.graph), hazards.reaction_kinks(&mut model.graph));
    let driven = |p: &&Program| !model.inputs.is_empty() || p.name != "input_jacobian";
    let printed: Vec<&Program> = programs.all().filter(driven).collect();
    let withheld = programs.jacobians.as_ref().err().map(|reason| match reason {
        NoJacobians::TooLarge(e) => (e.function.as_str(), NoDerivatives::TooLarge(e.operations)),
        NoJacobians::General => ("state_jacobian", NoDerivatives::General),
        NoJacobians::NoMassMatrix => ("state_jacobian", NoDerivatives::NoMassMatrix),
    });
    let mut report = text::report(&model, &equations, &constraints, &printed, withheld);
    report.push_str(&text::picture_entry(&model));
    let mut listing = text::listing(&model, &equations, &printed);
    let text::EquationTexts { plain: equations_text, latex, mathml } =
        text::equations(&mut model, &equations);
    programs.series = expand(&mut model.graph, &equations);
    report.push_str(&text::series_entry(&model, &programs.series));
    listing.push_str(&text::series_section(&model, &programs.series));
    let joined = residual(&mut model);
    // Without M nothing else has inverse dynamics.
    let most = if equations.leaves_out_mass_matrix() {
        MOST_INVERSE_OPERATIONS_WITHOUT_MASS_MATRIX
    } else {
        MOST_VARIATION_OPERATIONS
    };
    programs.inverse = fitting(&model.graph, "inverse", &joined[..model.coordinates.len()], most);
    programs.variations = fitting_variations(&mut model, &joined);
    programs.output_variations = fitting_output_variations(&mut model);
    // Of all nodes that are printed: series bring choices of their own.
    programs.kinks = followed(&model.graph, hazards.are_followed(&model.graph), &kinks, &of_reactions);
    let portability = text::javascript(&mut model, &equations, &portable::portable(&programs));
    Ok(Compiled { model, equations, programs, report, listing, equations_text, latex, mathml, portability })
}

fn bindings(states: &[Sample]) -> Vec<&dyn Bindings> {
    states.iter().map(|state| state as &dyn Bindings).collect()
}

fn findings(model: &mut Model, reason: &Underivable) -> Vec<Finding> {
    match reason {
        Underivable::Singular(i) => check::singular(model, *i),
        Underivable::TooLarge(operations) => {
            vec![Excess { function: "mass_matrix".to_owned(), operations: *operations }.into_finding()]
        }
        Underivable::ZeroDenominator => vec![Finding::ZeroDenominator],
    }
}

/// Smooth functions give a value and three derivatives. Equations of motion take two, their Jacobians three;
/// only a model that divides velocities out again to get at a slope can ask for more.
fn too_many_derivatives(model: &Model, e: &Equations) -> Vec<Finding> {
    let named = [&e.powers, &e.outputs, &e.events].into_iter().flatten();
    let named = named.chain(e.conserved.iter().map(|c| &c.quantity)).map(|n| n.node);
    let mut roots: Vec<NodeId> = e.accelerations.iter().copied().chain(named).collect();
    // What cancels in the accelerations is still printed by the functions that return it.
    roots.extend(e.inertia().chain(&e.generalized_force).chain(&e.momenta));
    roots.extend(e.pivots.iter().flat_map(|p| [p.pivot, p.diagonal]));
    roots.extend(e.energies.into_iter().flat_map(|(t, v)| [t, v]).chain([e.energy_function]));
    if let Ok(j) = &e.jacobians {
        roots.extend([&j.by_q, &j.by_u, &j.by_inputs, &j.by_parameters].into_iter().flatten().flatten());
    }
    if let Some(s) = &e.speeds {
        roots.extend(s.values.iter().chain(s.jacobian.iter().flatten()).chain(&s.offset));
    }
    if let Some(c) = &e.constraints {
        roots.extend([&c.residual, &c.velocity_residual, &c.velocity_offset, &c.gamma].into_iter().flatten());
        roots.extend(c.released.iter().flat_map(|r| &r.unrolled.accelerations));
        roots.extend(c.jacobian.iter().flatten().chain(c.force_by_multipliers.iter().flatten().flatten()));
        if let Ok(d) = &c.derivatives {
            roots.extend([&d.reaction_by_q, &d.gamma_by_q, &d.gamma_by_u].into_iter().flatten().flatten());
        }
    }
    let functions: BTreeSet<u32> = fourth_derivatives(&model.graph, &roots).collect();
    let declared = functions.iter().filter_map(|f| model.functions.get(*f as usize));
    declared.map(|f| Finding::TooManyDerivatives { name: f.name.clone(), origin: f.origin }).collect()
}

/// ṗ for methods in canonical variables, unless M is constant and the forces have no velocities.
fn canonical(model: &mut Model, e: &Equations) -> Option<Program> {
    if e.constraints.is_some() || !e.has_velocity_forces(&model.graph) {
        return None;
    }
    let rates = momentum_rates(model);
    Some(schedule(&model.graph, "momentum_rates", &rates, Staging::Inline))
        .filter(|program| excess(program).is_none())
}

/// All programs; a solution that is too large to be emitted is left to the general solver.
fn fitting_programs(model: &Model, e: &mut Equations) -> Programs {
    let all = programs(model, e);
    let Some((c, excess)) = e.constraints.as_mut().zip(excess(&all.accelerations)) else { return all };
    c.solution = Solution::General(General::TooLarge(excess.operations));
    c.released.clear();
    e.jacobians = Err(NoDerivatives::General);
    programs(model, e)
}

/// One program per function that the runtime's traits ask for.
fn programs(model: &Model, e: &Equations) -> Programs {
    let g = &model.graph;
    let nodes = |named: &[Named]| named.iter().map(|n| n.node).collect::<Vec<_>>();
    let (accelerations, multipliers, checks): (&[NodeId], &[NodeId], _) =
        match e.constraints.as_ref().map(|c| &c.solution) {
            None => (&e.accelerations, &[], e.pivots.iter().flat_map(|p| [p.pivot, p.diagonal]).collect()),
            Some(Solution::General(_)) => (&[], &[], Vec::new()),
            Some(Solution::Unrolled(u)) => (&u.accelerations, &u.multipliers, guards(&u.guards)),
        };
    let flat = |rows: &[Vec<NodeId>]| rows.iter().flatten().copied().collect::<Vec<_>>();
    let staged = |name: &str, results: &[NodeId]| schedule(g, name, results, Staging::Hoisted);
    let inline = |name: &str, results: &[NodeId]| schedule(g, name, results, Staging::Inline);
    // Pivots are reported where accelerations enter; with constraints these are given.
    let checked = |declared: bool, named: &[Named]| {
        if declared { [nodes(named), checks.clone()].concat() } else { nodes(named) }
    };
    let constrained = e.constraints.is_some();
    Programs {
        accelerations: staged("accelerations", &[accelerations, multipliers, &checks].concat()),
        mass_matrix: inline("mass_matrix", &flat(&e.mass_matrix)),
        mass_product: e.leaves_out_mass_matrix().then(|| inline("mass_product", &e.mass_product)),
        generalized_force: inline("generalized_force", &e.generalized_force),
        momenta: inline("momenta", &e.momenta),
        energy_function: inline("energy_function", &[e.energy_function]),
        kinetic_energy: e.energies.map(|(t, _)| inline("kinetic_energy", &[t])),
        potential_energy: e.energies.map(|(_, v)| inline("potential_energy", &[v])),
        conserved: inline("conserved", &e.conserved.iter().map(|c| c.quantity.node).collect::<Vec<_>>()),
        powers: inline("powers", &nodes(&e.powers)),
        jacobians: match &e.jacobians {
            Err(NoDerivatives::General) => Err(NoJacobians::General),
            Err(NoDerivatives::NoMassMatrix) => Err(NoJacobians::NoMassMatrix),
            Err(NoDerivatives::TooLarge(nodes)) => {
                Err(NoJacobians::TooLarge(Excess { function: "state_jacobian".into(), operations: *nodes }))
            }
            Ok(j) => jacobians(
                staged("state_jacobian", &[accelerations, &flat(&j.by_q), &flat(&j.by_u), &checks].concat()),
                inline("input_jacobian", &[flat(&j.by_inputs), checks.clone()].concat()),
                inline("parameter_jacobian", &[flat(&j.by_parameters), checks.clone()].concat()),
            ),
        },
        speeds: inline(
            "speeds",
            &e.speeds
                .as_ref()
                .map_or_else(Vec::new, |s| [s.values.clone(), flat(&s.jacobian), s.offset.clone()].concat()),
        ),
        outputs: inline("outputs", &checked(e.outputs_use_accelerations && !constrained, &e.outputs)),
        assumptions: inline(
            "assumptions",
            &model.assumptions.iter().flat_map(|p| p.nodes.iter().copied()).collect::<Vec<_>>(),
        ),
        events: inline("events", &checked(e.events_use_accelerations && !constrained, &e.events)),
        constraints: e.constraints.as_ref().map(|c| constraints(model, e, c)),
        // Made last: they add nodes of their own.
        series: Err(Unexpandable::TooLarge(0)),
        kinks: followed(g, true, &[], &[]),
        momentum_rates: None,
        inverse: None,
        variations: None,
        output_variations: None,
    }
}

/// Derivatives of the equations before they are solved, unless they are too large or ask smooth functions for
/// more than these give.
fn fitting_variations(model: &mut Model, joined: &[NodeId]) -> Option<Program> {
    let all = variations(model, joined).ok()?.all();
    fitting(&model.graph, "variations", &all, MOST_VARIATION_OPERATIONS)
}

/// Derivatives of the outputs, likewise.
fn fitting_output_variations(model: &mut Model) -> Option<Program> {
    if model.outputs.is_empty() {
        return None;
    }
    let all = output_variations(model).ok()?;
    fitting(&model.graph, "output_variations", &all, MOST_VARIATION_OPERATIONS)
}

fn fitting(g: &Graph, name: &str, all: &[NodeId], most: usize) -> Option<Program> {
    if fourth_derivatives(g, all).next().is_some() {
        return None;
    }
    let fits = |program: &Program| program.cost.total() <= most;
    Some(schedule(g, name, all, Staging::Inline)).filter(fits)
}

/// The functions of whose derivatives the fourth or a higher one is asked for.
fn fourth_derivatives(g: &Graph, roots: &[NodeId]) -> impl Iterator<Item = u32> {
    g.cone(roots).into_iter().filter_map(|id| match g.node(id) {
        Node::Smooth { function, order, .. } if order > 3 => Some(function.0),
        _ => None,
    })
}

fn followed(g: &Graph, are_all: bool, kinks: &[Kink], of_reactions: &[Kink]) -> Kinks {
    let values = |kinks: &[Kink]| kinks.iter().map(|kink| kink.value).collect::<Vec<_>>();
    let functions = |kinks: &[Kink]| kinks.iter().map(|kink| kink.function).collect();
    let choices = if kinks.iter().all(|kink| kink.switch.is_none()) { 0 } else { g.len() };
    Kinks {
        are_all,
        program: schedule(g, "kinks", &values(kinks), Staging::Inline),
        functions: functions(kinks),
        branches: g.ids().take(choices).filter_map(|id| Some((id, Branch::of(g, id, kinks)?))).collect(),
        of_reactions: schedule(g, "reaction_kinks", &values(of_reactions), Staging::Inline),
        reaction_functions: functions(of_reactions),
    }
}

/// Pivot and scale of every guard.
fn guards(guards: &[Guard]) -> Vec<NodeId> {
    guards.iter().flat_map(|guard| [guard.pivot, guard.scale]).collect()
}

/// Programs of a solution: q̈, λ and guards; a correction and guards.
fn unrolled(g: &Graph, u: &Unrolled, which: &str) -> ReleasedPrograms {
    let hoisted =
        |name: &str, results: &[NodeId]| schedule(g, &format!("{name}{which}"), results, Staging::Hoisted);
    let solution = [u.accelerations.as_slice(), &u.multipliers, &guards(&u.guards)].concat();
    let correction = [u.correction.as_slice(), &guards(&u.correction_guards)].concat();
    ReleasedPrograms {
        accelerations: hoisted("accelerations", &solution),
        correction: hoisted("correction", &correction),
    }
}

fn constraints(model: &Model, e: &Equations, c: &ConstraintEquations) -> ConstraintPrograms {
    let g = &model.graph;
    let flat = |rows: &[Vec<NodeId>]| rows.iter().flatten().copied().collect::<Vec<_>>();
    let inline = |name: &str, results: &[NodeId]| schedule(g, name, results, Staging::Inline);
    let terms = [flat(&e.mass_matrix), c.free_force.clone(), flat(&c.jacobian), c.gamma.clone()].concat();
    let friction =
        |by: &Vec<Vec<NodeId>>| inline("friction", &[e.generalized_force.clone(), flat(by)].concat());
    ConstraintPrograms {
        residual: inline("residual", &c.residual),
        velocity_residual: inline("velocity_residual", &c.velocity_residual),
        jacobian: inline("jacobian", &flat(&c.jacobian)),
        velocity_offset: inline("velocity_offset", &c.velocity_offset),
        gamma: inline("gamma", &c.gamma),
        terms: inline("terms", &terms),
        friction: c.force_by_multipliers.as_ref().map(friction),
        correction: match &c.solution {
            Solution::General(_) => None,
            // Where it is too large the general solver serves as well.
            Solution::Unrolled(u) => {
                Some(unrolled(g, u, "").correction).filter(|program| excess(program).is_none())
            }
        },
        released: c.released.iter().map(|r| unrolled(g, &r.unrolled, &r.suffix(model))).collect(),
        derivatives: match &c.derivatives {
            Err(nodes) => Err(Excess { function: "constraint_derivatives".into(), operations: *nodes }),
            Ok(d) => {
                let all = [flat(&d.reaction_by_q), flat(&d.gamma_by_q), flat(&d.gamma_by_u)].concat();
                let program = inline("constraint_derivatives", &all);
                excess(&program).map_or(Ok(program), Err)
            }
        },
    }
}

fn jacobians(state: Program, inputs: Program, parameters: Program) -> Result<JacobianPrograms, NoJacobians> {
    let excess = [&state, &inputs, &parameters].into_iter().find_map(excess);
    match excess {
        Some(excess) => Err(NoJacobians::TooLarge(excess)),
        None => Ok(JacobianPrograms { state, inputs, parameters }),
    }
}

fn excess(program: &Program) -> Option<Excess> {
    let operations = program.hoisted_cost.total().max(program.cost.total());
    (operations > MOST_OPERATIONS).then(|| Excess { function: program.name.clone(), operations })
}

impl Excess {
    fn into_finding(self) -> Finding {
        Finding::TooLarge { function: self.function, operations: self.operations, limit: MOST_OPERATIONS }
    }
}

impl Programs {
    /// All programs that are emitted, in the order of the listing.
    pub fn all(&self) -> impl Iterator<Item = &Program> {
        let jacobians = self.jacobians.iter().flat_map(|j| [&j.state, &j.inputs, &j.parameters]);
        let derivatives = self.constraints.iter().flat_map(|c| &c.derivatives);
        self.required().chain(jacobians).chain(derivatives)
    }

    /// The programs that every model has, in a fixed order; the Jacobians are apart.
    pub fn required(&self) -> impl Iterator<Item = &Program> {
        let always = [
            &self.accelerations,
            &self.mass_matrix,
            &self.generalized_force,
            &self.momenta,
            &self.energy_function,
            &self.conserved,
            &self.powers,
            &self.speeds,
            &self.outputs,
            &self.events,
        ];
        let constraints = self.constraints.iter().flat_map(ConstraintPrograms::required);
        let always = always.into_iter().chain(&self.mass_product);
        always.chain(&self.kinetic_energy).chain(&self.potential_energy).chain(constraints)
    }
}

impl ConstraintPrograms {
    /// All programs but the derivatives, in the order of the listing.
    fn required(&self) -> impl Iterator<Item = &Program> {
        let always = [
            &self.residual,
            &self.velocity_residual,
            &self.jacobian,
            &self.velocity_offset,
            &self.gamma,
            &self.terms,
        ];
        let released =
            self.released.iter().flat_map(|programs| [&programs.accelerations, &programs.correction]);
        always.into_iter().chain(&self.friction).chain(&self.correction).chain(released)
    }
}

//! The report: degrees of freedom, conserved quantities, structure, what was simplified, and what the model
//! costs; for a terminal.

use crate::check::Analysis;
use crate::check::hazards::Hazards;
use crate::check::structure::{Linearity, Pattern, Structure};
use crate::graph::{Dependence, Graph, Node, NodeId};
use crate::mechanics::{Derivation, Equations, Model, Named, NoDerivatives, NoSpeedForm, SpeedEquations};
use crate::schedule::Program;

use super::formula::Formulas;
use super::plain::Plain;

mod constraints;

/// Columns of a line.
const WIDTH: usize = 96;
/// Columns of the headings at the left.
const HEADING_WIDTH: usize = 20;

/// The report on a model. `withheld` is the Jacobian that there is not, with the reason.
#[must_use]
pub fn report(
    model: &Model,
    equations: &Equations,
    analysis: &Analysis,
    programs: &[&Program],
    withheld: Option<(&str, NoDerivatives)>,
) -> String {
    let structure = Structure::of(model, equations);
    let mut out = format!("{}\n\n", model.name);
    declared(&mut out, model);
    constraints::constraints(&mut out, model, equations, analysis);
    derived(&mut out, model, equations, &structure);
    conserved(&mut out, equations);
    watch(&mut out, model, equations);
    simplified(&mut out, model, equations, programs);
    cost(&mut out, programs);
    if let Some((function, why)) = withheld {
        let text = match why {
            NoDerivatives::TooLarge(operations) => format!(
                "none: {function} would take some {operations} operations; write velocities in body frames, \
                 or fewer parameters, to make it smaller"
            ),
            NoDerivatives::NoMassMatrix => {
                "none: the mass matrix is left out, and accelerations are found without it".to_owned()
            }
            NoDerivatives::General => {
                "none: accelerations are found by the general solver, at run time".to_owned()
            }
        };
        entry(&mut out, "Jacobians", &text);
    }
    out
}

/// A heading with its text, wrapped under itself.
pub(crate) fn entry(out: &mut String, heading: &str, text: &str) {
    let mut line = format!("{heading:HEADING_WIDTH$}");
    let mut empty = true;
    for word in text.split(' ') {
        if !empty && line.chars().count() + 1 + word.chars().count() > WIDTH {
            out.push_str(line.trim_end());
            out.push('\n');
            line = " ".repeat(HEADING_WIDTH);
            empty = true;
        }
        if !empty {
            line.push(' ');
        }
        line.push_str(word);
        empty = false;
    }
    out.push_str(line.trim_end());
    out.push('\n');
}

fn declared(out: &mut String, model: &Model) {
    let coordinates = model.coordinates.iter().map(|c| (c.name.as_str(), c.unit.as_str()));
    let heading = if model.constraints.is_empty() { "degrees of freedom" } else { "coordinates" };
    entry(out, heading, &list(coordinates));
    let parameters = model.parameters.iter().map(|c| (c.name.as_str(), c.unit.as_str()));
    entry(out, "parameters", &list(parameters));
    if !model.speeds.is_empty() {
        entry(out, "speeds", &list(model.speeds.iter().map(|c| (c.name.as_str(), c.unit.as_str()))));
    }
    if !model.functions.is_empty() {
        entry(out, "functions", &list(model.functions.iter().map(|c| (c.name.as_str(), c.unit.as_str()))));
    }
    if !model.inputs.is_empty() {
        entry(out, "inputs", &list(model.inputs.iter().map(|c| (c.name.as_str(), c.unit.as_str()))));
    }
    if !model.forces.is_empty() {
        entry(out, "forces", &list(model.forces.iter().map(|f| (f.name.as_str(), ""))));
    }
}

/// `3: x (m), theta[0] … theta[1] (rad)`; runs of one array are shortened.
fn list<'a>(all: impl Iterator<Item = (&'a str, &'a str)>) -> String {
    let all: Vec<(&str, &str)> = all.collect();
    if all.is_empty() {
        return "none".to_owned();
    }
    let base = |name: &'a str| name.split('[').next().filter(|b| b.len() < name.len());
    let mut parts: Vec<String> = Vec::new();
    let mut at = 0;
    while at < all.len() {
        let (name, unit) = all[at];
        let same = |x: &&(&'a str, &'a str)| base(x.0).is_some() && base(x.0) == base(name) && x.1 == unit;
        let run = all[at..].iter().take_while(same).count().max(1);
        let unit = if unit.is_empty() { String::new() } else { format!(" ({unit})") };
        match run {
            1 => parts.push(format!("{name}{unit}")),
            2 => parts.push(format!("{name}, {}{unit}", all[at + 1].0)),
            _ => parts.push(format!("{name} ... {}{unit}", all[at + run - 1].0)),
        }
        at += run;
    }
    format!("{}: {}", all.len(), parts.join(", "))
}

fn derived(out: &mut String, model: &Model, equations: &Equations, structure: &Structure) {
    let derivation = match equations.derivation {
        Derivation::VelocityForm => "velocities are time derivatives of positions: M = sum of w (dv/dq')^2",
        Derivation::Momenta => "momenta p = dL/dq', M = dp/dq'",
        Derivation::Bodies => "bodies that hang on one another: M of composite bodies, forces by recursion",
        Derivation::Mixed => {
            "partly from velocities that are time derivatives of positions, partly from momenta"
        }
    };
    entry(out, "derivation", derivation);
    entry(out, "mass matrix", &mass_matrix(model, equations, structure));
    if let Some(speeds) = &equations.speeds {
        entry(out, "solved in", &solved_in(model, speeds));
    }
    entry(out, "equations", &kind(structure));
    let name = |i: &usize| (model.coordinates[*i].name.as_str(), "");
    if structure.subsystems.len() > 1 {
        let groups: Vec<String> = structure
            .subsystems
            .iter()
            .take(8)
            .map(|group| group.iter().map(|i| name(i).0).collect::<Vec<_>>().join(", "))
            .collect();
        let more = if structure.subsystems.len() > 8 { "; ..." } else { "" };
        let text = format!(
            "{} that do not act on each other: {}{more}",
            structure.subsystems.len(),
            groups.join("; ")
        );
        entry(out, "subsystems", &text);
    }
    if !structure.ignorable.is_empty() {
        entry(out, "ignorable", &list(structure.ignorable.iter().map(name)));
    }
    if structure.gyroscopic {
        entry(
            out,
            "linear in rates",
            "L has terms of first degree in the velocities (gyroscopic, magnetic, moving frames)",
        );
    }
}

fn mass_matrix(model: &Model, equations: &Equations, structure: &Structure) -> String {
    let n = model.coordinates.len();
    let pattern = match &structure.pattern {
        _ if n == 1 => "one element".to_owned(),
        Pattern::Diagonal => "diagonal".to_owned(),
        Pattern::Blocks(sizes) => {
            let sizes: Vec<String> = sizes.iter().map(ToString::to_string).collect();
            format!("blocks of {}", sizes.join(", "))
        }
        Pattern::Banded(band) => format!("banded, {band} beside the diagonal"),
        Pattern::Sparse(zeros) => format!("{zeros} of {} pairs uncoupled", n * (n - 1) / 2),
        Pattern::Dense => "full".to_owned(),
        Pattern::LeftOut => "left out: column by column when asked for".to_owned(),
    };
    let depends = match what(structure.mass) {
        None if model.constraints.is_empty() && structure.pattern != Pattern::LeftOut => {
            "constant: factored once per model".to_owned()
        }
        None => "constant".to_owned(),
        Some(on) => format!("depends on {on}"),
    };
    let constant = equations
        .mass_matrix
        .iter()
        .enumerate()
        .flat_map(|(i, row)| &row[..=i])
        .filter(|id| model.graph.is_constant(**id) && !model.graph.is_zero(**id))
        .count();
    let some = if constant > 0 && what(structure.mass).is_some() {
        format!(", {constant} of {} elements constant", n * (n + 1) / 2)
    } else {
        String::new()
    };
    format!("{n} x {n}, {pattern}, {depends}{some}")
}

/// Whether the equations are those of the speeds, and with which inertia.
fn solved_in(model: &Model, speeds: &SpeedEquations) -> String {
    let inertia = match &speeds.inertia {
        Ok(inertia) => inertia,
        Err(aside) => return format!("coordinates, {}", why(*aside)),
    };
    let g = &model.graph;
    let (size, all) = (inertia.len(), inertia.iter().flatten());
    let depends = all.clone().fold(Dependence::NONE, |d, id| d.with(g.dependence(*id)));
    let apart = inertia
        .iter()
        .enumerate()
        .all(|(i, row)| row.iter().enumerate().all(|(j, x)| i == j || g.is_zero(*x)));
    let shape = if apart && size > 1 { ", diagonal" } else { "" };
    let depends = what(depends).map_or_else(|| "constant".to_owned(), |on| format!("depends on {on}"));
    format!("the speeds, with inertia {size} x {size}{shape}, {depends}")
}

/// Why speeds do not lead.
fn why(aside: NoSpeedForm) -> &'static str {
    match aside {
        NoSpeedForm::Constraints => "as constraints are switched or redundant",
        NoSpeedForm::General => "by the general solver",
        NoSpeedForm::Unsafe => "as the speeds could be singular where the mass matrix is not",
        NoSpeedForm::Longer => "which takes no more work than the speeds",
    }
}

/// `coordinates and time`; `None` for nothing but parameters.
fn what(dependence: Dependence) -> Option<String> {
    let names: Vec<&str> = [
        (Dependence::COORDINATES, "coordinates"),
        (Dependence::RATES, "velocities"),
        (Dependence::INPUTS, "inputs"),
        (Dependence::TIME, "time"),
    ]
    .into_iter()
    .filter(|(d, _)| dependence.on(*d))
    .map(|(_, name)| name)
    .collect();
    match &names[..] {
        [] => None,
        [one] => Some((*one).to_owned()),
        [first @ .., last] => Some(format!("{} and {last}", first.join(", "))),
    }
}

fn kind(structure: &Structure) -> String {
    let linearity = match structure.linearity {
        Linearity::ConstantCoefficients => "linear with constant coefficients",
        Linearity::TimeDependent => "linear, coefficients depend on time",
        Linearity::Nonlinear => "nonlinear",
    };
    let both = structure.mass.with(structure.force).with(structure.constraints);
    let time = if both.on(Dependence::TIME) { "time enters explicitly" } else { "time does not enter" };
    let inputs = if both.on(Dependence::INPUTS) { ", driven by inputs" } else { "" };
    format!("{linearity}, {time}{inputs}")
}

fn conserved(out: &mut String, equations: &Equations) {
    if equations.conserved.is_empty() {
        return entry(out, "conserved", "nothing");
    }
    for (i, conserved) in equations.conserved.iter().enumerate() {
        let Named { name, unit, .. } = &conserved.quantity;
        let unit = if unit.is_empty() { String::new() } else { format!(" ({unit})") };
        entry(out, if i == 0 { "conserved" } else { "" }, &format!("{name}{unit}"));
    }
}

/// Where the model is not smooth, or not defined.
fn watch(out: &mut String, model: &Model, equations: &Equations) {
    let hazards = Hazards::of(model, equations);
    let text = |id: NodeId| Formulas::whole(&Plain::READABLE, model, id).map(|formula| formula.text);
    let mut line = |heading: &str, parts: Vec<Option<String>>, end: &str| {
        // What is too long to read is not worth its place.
        let short: Vec<&str> =
            parts.iter().flatten().map(String::as_str).filter(|p| p.len() <= 60).take(4).collect();
        if short.is_empty() {
            return;
        }
        let more = if short.len() < parts.len() {
            format!(" and {} more", parts.len() - short.len())
        } else {
            String::new()
        };
        entry(out, heading, &format!("{}{more}{end}", short.join(", ")));
    };
    let switches = hazards.switches.iter().map(|s| {
        let right = s.right.map_or_else(|| Some("0".to_owned()), text)?;
        Some(format!("{} = {right}", text(s.left)?))
    });
    let cuts = hazards.cuts.iter().map(|(y, x)| Some(format!("{} = 0 with {} < 0", text(*y)?, text(*x)?)));
    let end = match hazards.are_followed(&model.graph) {
        true => "; steps end there",
        false => "; an event there keeps the order of the method",
    };
    line("not smooth where", switches.chain(cuts).collect(), end);
    line("divides by", hazards.denominators.iter().map(|d| text(*d)).collect(), "");
    line("roots and logs of", hazards.domains.iter().map(|d| text(*d)).collect(), "");
}

/// What sharing and hoisting saved.
fn simplified(out: &mut String, model: &Model, equations: &Equations, programs: &[&Program]) {
    let mut roots: Vec<NodeId> = equations.generalized_force.clone();
    roots.extend(equations.mass_matrix.iter().enumerate().flat_map(|(i, row)| &row[..=i]));
    roots.extend(&equations.mass_product);
    let (written_out, shared) = sizes(&model.graph, &roots);
    let mut lines = Vec::new();
    if written_out > shared as f64 {
        let inertia = if equations.leaves_out_mass_matrix() { "M q''" } else { "M" };
        lines.push(format!(
            "{inertia} and Q: {} operations written out, {shared} after sharing",
            rounded(written_out)
        ));
    }
    if let Some(p) = programs.iter().find(|p| p.name == "accelerations")
        && !p.constants.is_empty()
    {
        let once = counted(p.hoisted_cost.total(), "operation");
        let kept = counted(p.constants.len(), "constant");
        lines.push(format!("accelerations: {once} on parameters alone once per model, kept in {kept}"));
    }
    for (i, line) in lines.iter().enumerate() {
        entry(out, if i == 0 { "simplified" } else { "" }, line);
    }
}

/// `1 row`, `2 rows`.
fn counted(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

/// Operations below some nodes: as trees, and with every node counted once.
fn sizes(g: &Graph, roots: &[NodeId]) -> (f64, usize) {
    let end = roots.iter().map(|r| r.index() + 1).max().unwrap_or(0);
    let mut needed = vec![false; end];
    roots.iter().for_each(|r| needed[r.index()] = true);
    let ids: Vec<NodeId> = g.ids().take(end).collect();
    for id in ids.iter().rev() {
        if needed[id.index()] {
            g.node(*id).children().for_each(|c| needed[c.index()] = true);
        }
    }
    let mut tree = vec![0.0f64; end];
    let mut shared = 0;
    for id in &ids {
        let node = g.node(*id);
        if matches!(node, Node::Number(_) | Node::Symbol(_)) || !needed[id.index()] {
            continue;
        }
        shared += 1;
        tree[id.index()] = 1.0 + node.children().map(|c| tree[c.index()]).sum::<f64>();
    }
    (roots.iter().map(|r| tree[r.index()]).sum(), shared)
}

/// A count, in powers of ten where it is beyond reading.
fn rounded(x: f64) -> String {
    if x < 1e6 { format!("{x:.0}") } else { format!("{x:.1e}") }
}

/// One line per function.
fn cost(out: &mut String, programs: &[&Program]) {
    out.push('\n');
    let width = programs.iter().map(|p| p.name.len()).max().unwrap_or(0).max(HEADING_WIDTH);
    out.push_str(&format!(
        "{:width$}{:>10}{:>10}{:>16}\n",
        "operations", "per call", "sin/cos", "once per model"
    ));
    for p in programs.iter().filter(|p| !p.results.is_empty()) {
        let once = match p.hoisted_cost.total() {
            0 => String::new(),
            n => n.to_string(),
        };
        let pairs = match p.cost.sin_cos {
            0 => String::new(),
            n => n.to_string(),
        };
        let line = format!("{:width$}{:>10}{pairs:>10}{once:>16}", p.name, p.cost.total());
        out.push_str(line.trim_end());
        out.push('\n');
    }
}

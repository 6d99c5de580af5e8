//! The listing: the derived programs as stable text with operation counts, for snapshot tests and for reading
//! what is computed.

use crate::mechanics::{
    ConstraintEquations, Equations, Guard, Guarded, Model, Named, Pivot, Solution, Unrolled,
};
use crate::schedule::{Cost, Program};

use super::plain::Plain;
use super::program::{Line, Style, lines};
use super::target::Text;

/// Most operations of a Jacobian that the listing prints. Of longer ones it prints the number alone.
const MOST_OF_JACOBIAN: usize = 400;
/// The same for all other programs.
const MOST_OF_PROGRAM: usize = 4000;

/// The listing of a model's programs.
#[must_use]
pub fn listing(model: &Model, equations: &Equations, programs: &[&Program]) -> String {
    let mut out = format!("listing of {}\n", model.name);
    header(&mut out, "coordinates", model.coordinates.iter().map(|c| (&c.name, &c.unit)));
    header(&mut out, "speeds", model.speeds.iter().map(|c| (&c.name, &c.unit)));
    header(&mut out, "inputs", model.inputs.iter().map(|c| (&c.name, &c.unit)));
    header(&mut out, "parameters", model.parameters.iter().map(|c| (&c.name, &c.unit)));
    header(&mut out, "functions", model.functions.iter().map(|c| (&c.name, &c.unit)));
    for program in programs.iter().filter(|p| !p.results.is_empty()) {
        section(&mut out, model, equations, program);
    }
    out
}

fn header<'a>(out: &mut String, what: &str, names: impl Iterator<Item = (&'a String, &'a String)>) {
    let all: Vec<String> = names
        .map(|(name, unit)| if unit.is_empty() { name.clone() } else { format!("{name} [{unit}]") })
        .collect();
    if !all.is_empty() {
        out.push_str(&format!("{what}: {}\n", all.join(", ")));
    }
}

fn section(out: &mut String, model: &Model, equations: &Equations, program: &Program) {
    out.push_str(&format!("\n{}: {}", program.name, count(&program.cost)));
    if program.hoisted_cost.total() > 0 {
        out.push_str(&format!("; once per model {}", count(&program.hoisted_cost)));
    }
    out.push('\n');
    let jacobian = program.name.ends_with("_jacobian") || program.name == "constraint_derivatives";
    let size = program.cost.total() + program.hoisted_cost.total();
    // M, Q, Φ_q and γ are printed each by itself.
    if program.name == "terms" || size > if jacobian { MOST_OF_JACOBIAN } else { MOST_OF_PROGRAM } {
        out.push_str("  (counted only)\n");
        return;
    }
    let taken = |prefix: &str| super::formula::is_taken(model, prefix);
    let pick = |choices: [&'static str; 3]| choices.into_iter().find(|p| !taken(p)).unwrap_or("_");
    let prefixes = [pick(["c", "k", "const_"]), pick(["v", "w", "step_"])];
    let style = Style { inline: 72, inline_angle: 24, prefixes };
    // Zeros of matrices are left out: those of large ones are most of them.
    let sparse = jacobian || ["mass_matrix", "jacobian"].contains(&program.name.as_str());
    let shown: Vec<usize> =
        (0..program.results.len()).filter(|i| !sparse || !model.graph.is_zero(program.results[*i])).collect();
    let program =
        &Program { results: shown.iter().map(|i| program.results[*i]).collect(), ..program.clone() };
    let (body, results) = lines(&Plain::PROGRAM, model, program, style);
    let part = |out: &mut String, title: &str, hoisted: bool| {
        let chosen: Vec<&Line> = body.iter().filter(|l| l.hoisted == hoisted).collect();
        if hoisted && !chosen.is_empty() {
            out.push_str(title);
        }
        chosen.iter().for_each(|l| out.push_str(&format!("    {}\n", l.text)));
    };
    part(out, "  once per model\n", true);
    if body.iter().any(|l| l.hoisted) {
        out.push_str("  per call\n");
    }
    part(out, "", false);
    for (label, Text { text, .. }) in labels(model, equations, &program.name, &shown).into_iter().zip(results)
    {
        // Elements above the diagonal have no label.
        if !label.is_empty() {
            out.push_str(&format!("  {label} = {text}\n"));
        }
    }
}

/// `36 operations (10 add, 20 multiply, 2 divide, 2 sin/cos)`.
pub(super) fn count(cost: &Cost) -> String {
    let total = cost.total();
    let parts: Vec<String> = [
        (cost.additions, "add"),
        (cost.multiplications, "multiply"),
        (cost.divisions, "divide"),
        (cost.roots, "sqrt"),
        (cost.sin_cos, "sin/cos"),
        (cost.functions, "other"),
    ]
    .into_iter()
    .filter(|(n, _)| *n > 0)
    .map(|(n, what)| format!("{n} {what}"))
    .collect();
    match total {
        0 => "no operations".to_owned(),
        1 => format!("1 operation ({})", parts.join(", ")),
        _ => format!("{total} operations ({})", parts.join(", ")),
    }
}

/// What the results of a program with these numbers are called; empty where one is not printed.
fn labels(model: &Model, equations: &Equations, program: &str, shown: &[usize]) -> Vec<String> {
    let q: Vec<&str> = model.coordinates.iter().map(|c| c.name.as_str()).collect();
    let element = |at: usize| (at / q.len(), at % q.len());
    match program {
        "mass_matrix" => {
            let entry = |(i, j): (usize, usize)| {
                if j <= i { format!("M[{}, {}]", q[i], q[j]) } else { String::new() }
            };
            shown.iter().map(|at| entry(element(*at))).collect()
        }
        "jacobian" => {
            let rows: Vec<&Named> = equations.constraints.iter().flat_map(|c| &c.rows).collect();
            let entry = |(r, j): (usize, usize)| format!("J[{}, {}]", rows[r].name, q[j]);
            shown.iter().map(|at| entry(element(*at))).collect()
        }
        _ => {
            let mut all = all_labels(model, equations, program);
            shown.iter().map(|at| all.get_mut(*at).map(core::mem::take).unwrap_or_default()).collect()
        }
    }
}

/// What all results of a program are called.
fn all_labels(model: &Model, equations: &Equations, program: &str) -> Vec<String> {
    let q: Vec<&str> = model.coordinates.iter().map(|c| c.name.as_str()).collect();
    let each = |wrap: &dyn Fn(&str) -> String| q.iter().map(|n| wrap(n)).collect::<Vec<_>>();
    let accelerations = each(&|n| format!("{n}''"));
    let of_inertia = |p: &Pivot| {
        let (name, i) = (q[p.coordinate], p.coordinate);
        let own = equations.mass_matrix.get(i).map(|row| model.graph.fingerprint(row[i]));
        let led = equations.speeds.as_ref().is_some_and(|s| s.inertia.is_ok());
        let compared = match own == Some(model.graph.fingerprint(p.diagonal)) {
            true => format!("M[{name}, {name}]"),
            false if led => format!("scale[{name}]"),
            false => format!("rod[{name}]"),
        };
        [format!("pivot[{name}]"), compared]
    };
    let (program, solution) = solution_of(model, equations, program);
    let pivots: Vec<String> = match &equations.constraints {
        None => equations.pivots.iter().flat_map(of_inertia).collect(),
        Some(c) => solution.map_or_else(Vec::new, |u| guards(model, c, u)),
    };
    let jacobian = |by: &[String]| -> Vec<String> {
        q.iter().flat_map(|n| by.iter().map(move |x| format!("d {n}'' / d {x}"))).collect()
    };
    let own = |names: &mut dyn Iterator<Item = String>| names.collect::<Vec<String>>();
    match program {
        "accelerations" => [accelerations, multipliers(equations), pivots].concat(),
        "mass_product" => each(&|n| format!("(M q'')[{n}]")),
        "generalized_force" => each(&|n| format!("Q[{n}]")),
        "momenta" => each(&|n| format!("p[{n}]")),
        "energy_function" => vec!["E".to_owned()],
        "kinetic_energy" => vec!["T".to_owned()],
        "potential_energy" => vec!["V".to_owned()],
        "conserved" => own(&mut equations.conserved.iter().map(|c| c.quantity.name.clone())),
        "powers" => own(&mut equations.powers.iter().map(|p| format!("power of {}", p.name))),
        "speeds" => {
            let name =
                |by: &dyn Fn(&str) -> String| model.speeds.iter().map(|s| by(&s.name)).collect::<Vec<_>>();
            let slopes =
                model.speeds.iter().flat_map(|s| q.iter().map(move |n| format!("d {} / d {n}'", s.name)));
            [name(&|s| s.to_owned()), slopes.collect(), name(&|s| format!("offset[{s}]"))].concat()
        }
        "outputs" => [own(&mut equations.outputs.iter().map(|o| o.name.clone())), pivots].concat(),
        "events" => [own(&mut equations.events.iter().map(|e| e.name.clone())), pivots].concat(),
        "state_jacobian" => {
            let rates = each(&|n| format!("{n}'"));
            [accelerations, jacobian(&each(&|n| n.to_owned())), jacobian(&rates), pivots].concat()
        }
        "input_jacobian" => {
            [jacobian(&own(&mut model.inputs.iter().map(|i| i.name.clone()))), pivots].concat()
        }
        "parameter_jacobian" => {
            [jacobian(&own(&mut model.parameters.iter().map(|p| p.name.clone()))), pivots].concat()
        }
        other => constraint_labels(model, equations, other, pivots),
    }
}

/// What the results of the constraints' programs are called.
fn constraint_labels(
    model: &Model,
    equations: &Equations,
    program: &str,
    pivots: Vec<String>,
) -> Vec<String> {
    let q: Vec<&str> = model.coordinates.iter().map(|c| c.name.as_str()).collect();
    let rows: Vec<String> =
        equations.constraints.iter().flat_map(|c| &c.rows).map(|row| row.name.clone()).collect();
    let each = |wrap: &dyn Fn(&str) -> String| rows.iter().map(|n| wrap(n)).collect::<Vec<_>>();
    let by = |of: &[String], prefix: &str, suffix: &str| -> Vec<String> {
        let entry = |a: &String, b: &str| format!("d {a} / d {prefix}{b}{suffix}");
        of.iter().flat_map(|a| q.iter().map(move |b| entry(a, b))).collect()
    };
    match program {
        "residual" => each(&|n| n.to_owned()),
        "velocity_residual" => each(&|n| format!("{n}'")),
        "velocity_offset" => each(&|n| format!("offset[{n}]")),
        "gamma" => each(&|n| format!("gamma[{n}]")),
        "friction" => {
            let force: Vec<String> = q.iter().map(|n| format!("Q[{n}]")).collect();
            let by = force.iter().flat_map(|f| rows.iter().map(move |r| format!("d {f} / d lambda[{r}]")));
            force.iter().cloned().chain(by).collect()
        }
        "correction" => {
            let corrections = q.iter().map(|n| format!("delta[{n}]"));
            corrections.chain(pivots).collect()
        }
        "constraint_derivatives" => {
            let reaction: Vec<String> = q.iter().map(|n| format!("reaction[{n}]")).collect();
            let gamma = each(&|n| format!("gamma[{n}]"));
            [by(&reaction, "", ""), by(&gamma, "", ""), by(&gamma, "", "'")].concat()
        }
        _ => Vec::new(),
    }
}

/// λ by row.
fn multipliers(equations: &Equations) -> Vec<String> {
    let rows = equations.constraints.iter().flat_map(|c| &c.rows);
    rows.map(|row| format!("lambda[{}]", row.name)).collect()
}

/// Pivot and scale of every guard.
fn guards(model: &Model, c: &ConstraintEquations, solution: &Unrolled) -> Vec<String> {
    let name = |of| match of {
        Guarded::Coordinate(i) => model.coordinates[i].name.clone(),
        Guarded::Row(r) => c.rows[r].name.clone(),
    };
    let labels = |guard: &Guard| [format!("pivot[{}]", name(guard.of)), format!("scale[{}]", name(guard.of))];
    solution.guards.iter().flat_map(labels).collect()
}

/// The name of a program without what is released in it, and the solution that it belongs to.
fn solution_of<'a>(
    model: &Model,
    equations: &'a Equations,
    program: &'a str,
) -> (&'a str, Option<&'a Unrolled>) {
    let Some(c) = &equations.constraints else { return (program, None) };
    let released =
        c.released.iter().find_map(|r| Some((program.strip_suffix(&r.suffix(model))?, &r.unrolled)));
    match (released, &c.solution) {
        (Some((program, unrolled)), _) => (program, Some(unrolled)),
        (None, Solution::Unrolled(unrolled)) => (program, Some(unrolled)),
        (None, Solution::General(_)) => (program, None),
    }
}

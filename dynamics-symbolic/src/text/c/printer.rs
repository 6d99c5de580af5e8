//! From programs to functions: arguments, bodies, and the statuses that they return.

use std::collections::BTreeSet;

use crate::algebra::{Guard, Unrolled};
use crate::graph::NodeId;
use crate::mechanics::{ConstraintEquations, Equations, Model, Solution};
use crate::schedule::{Program, Staging, schedule};

use super::super::program::lines_from;
use super::super::source::STYLE;
use super::super::target::Text;
use super::{C, ForC, PlainProgram};

/// Smallest ratio of a pivot of M to its diagonal element: `PIVOT_TOLERANCE` of the runtime.
const PIVOT_TOLERANCE: f64 = 1e-13;

/// A function of the text.
pub(super) struct Declared {
    /// What it does, in words; empty for those that the header does not declare.
    pub(super) about: String,
    /// Its head as the header has it.
    pub(super) declaration: String,
    pub(super) text: String,
}

/// What the last results of a program decide.
#[derive(Clone, Copy)]
enum Check<'a> {
    /// Nothing: the function returns nothing.
    Nothing,
    /// Pivots of M and diagonal elements; perhaps none.
    Pivots,
    /// Pivots and scales of guards.
    Guards(&'a [Guard]),
}

/// A function that is to be printed.
struct Request<'a> {
    about: &'a str,
    name: &'a str,
    /// Its arguments beside p, t, q, u, w, m.
    given: &'a [&'a str],
    /// The arrays of results, with how many they take; the rest is for the check.
    into: &'a [(&'a str, usize)],
    check: Check<'a>,
    /// Whether the file alone sees it.
    local: bool,
}

/// Words of a head. Programs in C++ may include the header, which knows no `restrict`.
struct Words {
    real: String,
    restrict: String,
}

impl Words {
    fn of_source() -> Self {
        Self { real: "real".to_owned(), restrict: "restrict".to_owned() }
    }
    fn of_header(name: &str) -> Self {
        Self { real: format!("{name}_real"), restrict: format!("{}_RESTRICT", name.to_uppercase()) }
    }
}

/// A solution on the graph.
struct Path<'a> {
    /// The switched constraints that are released, by their modes.
    modes: &'a [usize],
    unrolled: &'a Unrolled,
    accelerations: &'a Program,
    correction: &'a Program,
}

/// What prints all functions of a model.
pub(super) struct Printer<'a> {
    pub(super) language: C<'a>,
    pub(super) model: &'a Model,
    pub(super) equations: &'a Equations,
    pub(super) programs: &'a ForC<'a>,
    pub(super) constants: &'a [NodeId],
}

impl Printer<'_> {
    fn rows(&self) -> usize {
        self.equations.constraints.as_ref().map_or(0, |c| c.rows.len())
    }

    fn switched(&self) -> usize {
        self.model.constraints.iter().filter(|c| c.switched).count()
    }

    /// `NAME_constants`.
    pub(super) fn constants(&self, staged: &Program) -> Declared {
        let name = self.language.name;
        let model = self.model;
        let hoisted = Program {
            body: staged.hoisted.clone(),
            hoisted: Vec::new(),
            constants: Vec::new(),
            results: staged.constants.clone(),
            ..staged.clone()
        };
        let (lines, results) = lines_from(&self.language, model, &hoisted, STYLE, &[]);
        let head = |Words { real, restrict }: Words| {
            let arguments = [format!("const {real} *{restrict} p"), format!("{real} *{restrict} k")];
            wrapped(&format!("void {name}_constants("), arguments)
        };
        let mut body: String = lines.iter().map(|line| format!("  {}\n", line.text)).collect();
        body.extend(results.iter().enumerate().map(|(i, value)| format!("  k[{i}] = {};\n", value.text)));
        let text = format!("{}\n{{\n{}{body}}}\n", head(Words::of_source()), unused(&["p", "k"], &body));
        let about = "Computes the constants k from the parameters p: once, and after each change of them.";
        let declaration = head(Words::of_header(name));
        Declared { about: about.to_owned(), declaration, text }
    }

    /// `NAME_accelerations` and `NAME_correction`.
    pub(super) fn solving(&self) -> Vec<Declared> {
        let (n, r, programs) = (self.model.coordinates.len(), self.rows(), self.programs);
        let Some(constraints) = &self.equations.constraints else {
            let request = Request {
                about: "Accelerations a at a state.",
                name: "accelerations",
                given: &["k"],
                into: &[("a", n)],
                check: Check::Pivots,
                local: false,
            };
            return vec![self.function(programs.accelerations, &request)];
        };
        let paths = self.paths(constraints);
        let switched = self.switched() > 0;
        let accelerations = Request {
            about: "Accelerations a and multipliers l (reactions) at a state.",
            name: "accelerations",
            given: &["k"],
            into: &[("a", n), ("l", r)],
            check: Check::Nothing,
            local: switched,
        };
        let correction = Request {
            about: "out: the smallest change of q (or u) in the metric of M with J out = r, for positions \
                    and velocities that drift.",
            name: "correction",
            given: &["k", "r"],
            into: &[("out", n)],
            check: Check::Nothing,
            local: switched,
        };
        let mut all = Vec::new();
        for request in [&accelerations, &correction] {
            let is_correction = request.name == "correction";
            for (i, Path { unrolled, accelerations, correction, .. }) in paths.iter().enumerate() {
                let own = if switched { format!("{}_{i}", request.name) } else { request.name.to_owned() };
                let (program, guards) = match is_correction {
                    true => (correction, &unrolled.correction_guards),
                    false => (accelerations, &unrolled.guards),
                };
                let request = Request { name: &own, check: Check::Guards(guards), ..*request };
                all.push(self.function(program, &request));
            }
            if switched {
                let modes: Vec<&[usize]> = paths.iter().map(|path| path.modes).collect();
                all.push(self.choice(request, &modes));
            }
        }
        all
    }

    /// The solutions on the graph: with all constraints, then with sets of them released.
    fn paths<'b>(&'b self, constraints: &'b ConstraintEquations) -> Vec<Path<'b>> {
        let programs = self.programs;
        let whole = match (&constraints.solution, programs.correction) {
            (Solution::Unrolled(unrolled), Some(correction)) => {
                Some(Path { modes: &[], unrolled, accelerations: programs.accelerations, correction })
            }
            _ => None,
        };
        let released = constraints.released.iter().zip(&programs.released);
        let released = released.map(|(set, &(accelerations, correction))| Path {
            modes: &set.modes,
            unrolled: &set.unrolled,
            accelerations,
            correction,
        });
        whole.into_iter().chain(released).collect()
    }

    /// The function that calls one of several by the modes of switched constraints.
    fn choice(&self, request: &Request<'_>, sets: &[&[usize]]) -> Declared {
        let name = self.language.name;
        let request = Request { local: false, check: Check::Pivots, ..*request };
        let head = self.head(&request, &Words::of_source());
        let upper = name.to_uppercase();
        let arguments = self.arguments(&request).join(", ");
        let mut body = format!("  int status = {upper}_RELEASED;\n");
        for (i, modes) in sets.iter().enumerate() {
            let tests = (0..self.switched()).map(|mode| {
                let sign = if modes.contains(&mode) { "!=" } else { "==" };
                format!("m[{mode}] {sign} 0.0@")
            });
            let tests: Vec<String> = tests.collect();
            let start = if i == 0 { "  if" } else { " else if" };
            let call = format!("{name}_{}_{i}({arguments})", request.name);
            body.push_str(&format!("{start} ({}) {{\n    status = {call};\n  }}", tests.join(" && ")));
        }
        let text = format!("{head}\n{{\n{body}\n  return status;\n}}\n");
        let declaration = self.head(&request, &Words::of_header(name));
        Declared { about: request.about.to_owned(), declaration, text }
    }

    /// Everything else that shows what a model does.
    pub(super) fn plain(&self) -> Vec<Declared> {
        let ForC { energies, named, .. } = self.programs;
        let energies: Vec<NodeId> = energies.iter().flat_map(|program| program.results.clone()).collect();
        let about = match energies.len() {
            1 => "The energy function.",
            _ => "The energy function, the kinetic and the potential energy.",
        };
        let program = schedule(&self.model.graph, "energies", &energies, Staging::Inline);
        let into: &[(&str, usize)] = &[("out", energies.len())];
        let check = Check::Nothing;
        let request = Request { about, name: "energies", given: &[], into, check, local: false };
        let mut all = vec![self.function(&program, &request)];
        for &(which, program) in named.iter().filter(|(_, program)| !program.results.is_empty()) {
            let [name, about] = which.texts();
            let (count, check) = match which {
                PlainProgram::Outputs => (self.equations.outputs.len(), Check::Pivots),
                PlainProgram::Events => (self.equations.events.len(), Check::Pivots),
                _ => (program.results.len(), Check::Nothing),
            };
            let reads_solution =
                matches!(which, PlainProgram::Powers | PlainProgram::Outputs | PlainProgram::Events);
            let given: &[&str] = if reads_solution && self.rows() > 0 { &["a", "l"] } else { &[] };
            let into: &[(&str, usize)] = &[("out", count)];
            all.push(self.function(program, &Request { about, name, given, into, check, local: false }));
        }
        all
    }

    /// `NAME_directional`.
    pub(super) fn directional(&self) -> Option<Declared> {
        let program = self.programs.directional?;
        let about = "out: how fast accelerations, multipliers, energies, outputs, events and kinks change \
                     where t, q, u, inputs and parameters change as fast as dt, dq, du, dw and dp say: \
                     derivatives along a direction. a and l are those of the state.";
        let solution: &[&str] = if self.rows() > 0 {
            &["a", "l", "dt", "dq", "du", "dw", "dp"]
        } else {
            &["dt", "dq", "du", "dw", "dp"]
        };
        let into: &[(&str, usize)] = &[("out", program.results.len())];
        let check = Check::Nothing;
        let request = Request { about, name: "directional", given: solution, into, check, local: false };
        Some(self.function(program, &request))
    }

    /// The names of a function's arguments, in order.
    fn arguments<'b>(&self, request: &Request<'b>) -> Vec<&'b str> {
        let model = self.model;
        let into = || request.into.iter().map(|(name, _)| *name);
        let known = |name: &str| match name {
            "p" | "t" | "q" | "u" => true,
            "w" => !model.inputs.is_empty(),
            "dw" => !model.inputs.is_empty() && request.given.contains(&name),
            "m" => self.switched() > 0,
            name => request.given.contains(&name) || into().any(|other| other == name),
        };
        let all = ["p", "k", "t", "q", "u", "w", "m", "a", "l", "r", "dt", "dq", "du", "dw", "dp", "out"];
        all.into_iter().filter(|name| known(name)).collect()
    }

    /// The head of a function, in the source or in the header.
    fn head(&self, request: &Request<'_>, words: &Words) -> String {
        let Words { real, restrict } = words;
        let arguments = self.arguments(request).into_iter().map(|argument| {
            let is_result = request.into.iter().any(|(other, _)| *other == argument);
            match argument {
                "t" | "dt" => format!("{real} {argument}"),
                _ if is_result => format!("{real} *{restrict} {argument}"),
                _ => format!("const {real} *{restrict} {argument}"),
            }
        });
        let result = if matches!(request.check, Check::Nothing) { "void" } else { "int" };
        let local = if request.local { "static " } else { "" };
        wrapped(&format!("{local}{result} {}_{}(", self.language.name, request.name), arguments)
    }

    fn function(&self, program: &Program, request: &Request<'_>) -> Declared {
        let model = self.model;
        let body = Program { hoisted: Vec::new(), constants: Vec::new(), ..program.clone() };
        let named = |(i, id): (usize, &NodeId)| (*id, Text::atom(format!("k[{i}]")));
        let given: Vec<(NodeId, Text)> = self.constants.iter().enumerate().map(named).collect();
        let is_staged = !program.constants.is_empty() || !program.hoisted.is_empty();
        let given = if is_staged { given } else { Vec::new() };
        let language = C { right: request.given.contains(&"r"), ..self.language.clone() };
        let (lines, results) = lines_from(&language, model, &body, STYLE, &given);
        let mut text: String = lines.iter().map(|line| format!("  {}\n", line.text)).collect();
        let mut rest = results.iter();
        for (into, count) in request.into {
            for (i, value) in rest.by_ref().take(*count).enumerate() {
                text.push_str(&format!("  {into}[{i}] = {};\n", value.text));
            }
        }
        text.push_str(&self.check(rest.as_slice(), request.check));
        let head = self.head(request, &Words::of_source());
        let text = format!("{head}\n{{\n{}{text}}}\n", unused(&self.arguments(request), &text));
        let about = if request.local { String::new() } else { request.about.to_owned() };
        let declaration = self.head(request, &Words::of_header(self.language.name));
        Declared { about, declaration, text }
    }

    /// The return of a status, from pairs of pivots and what they are compared with.
    fn check(&self, values: &[Text], check: Check<'_>) -> String {
        let graph = &self.model.graph;
        let (name, upper) = (self.language.name, self.language.name.to_uppercase());
        let is_number = |id: NodeId| graph.as_number(id).is_some();
        let tolerated = |tolerance: f64| format!("{name}_bound({})", self.language.suffixed(tolerance));
        // A Lagrangian may be indefinite, a kinetic energy may not.
        let positive = self.equations.energies.is_some();
        let pairs = values.chunks(2).enumerate();
        let mut text = String::new();
        let mut tests = Vec::new();
        let mut known = BTreeSet::new();
        for (i, pair) in pairs {
            let (skipped, tolerance) = match check {
                Check::Guards(guards) => (is_number(guards[i].pivot), guards[i].tolerance),
                _ => (is_number(self.equations.pivots[i].pivot), PIVOT_TOLERANCE),
            };
            if skipped || !known.insert([&pair[0].text, &pair[1].text]) {
                continue;
            }
            text.push_str(&format!("  const real d{i} = {};\n", pair[0].text));
            let bound = format!("{}*fabs@({})", tolerated(tolerance), pair[1].text);
            tests.push(match check {
                Check::Guards(_) => format!("fabs@(d{i}) > {bound}"),
                _ if positive => format!("!(d{i} <= {bound})"),
                _ => format!("!(fabs@(d{i}) <= {bound})"),
            });
        }
        let failed = if matches!(check, Check::Guards(_)) { "GUARDED" } else { "SINGULAR" };
        match (check, tests.is_empty()) {
            (Check::Nothing, _) => text,
            (_, true) => format!("{text}  return {upper}_OK;\n"),
            _ => {
                let tests = tests.join("\n    && ");
                format!("{text}  return ({tests})\n    ? {upper}_OK : {upper}_{failed};\n")
            }
        }
    }
}

/// The head of a function, in lines of at most so many letters.
fn wrapped(start: &str, arguments: impl IntoIterator<Item = String>) -> String {
    const WIDTH: usize = 96;
    let mut head = start.to_owned();
    let mut column = head.len();
    for (i, argument) in arguments.into_iter().enumerate() {
        if i > 0 {
            head.push(',');
            let broken = column + argument.len() > WIDTH;
            head.push_str(if broken { "\n  " } else { " " });
            column = if broken { 2 } else { column + 2 };
        }
        column += argument.len();
        head.push_str(&argument);
    }
    head.push(')');
    head
}

/// Statements that use the arguments that a body does not.
fn unused(arguments: &[&str], body: &str) -> String {
    let words: BTreeSet<&str> = body.split(|c: char| !c.is_ascii_alphanumeric() && c != '_').collect();
    let unused = arguments.iter().filter(|name| !words.contains(*name));
    unused.map(|name| format!("  (void)({name});\n")).collect()
}

#[cfg(test)]
mod tests {
    use super::wrapped;

    #[test]
    fn heads_have_short_lines() {
        let head = wrapped("int f(", (0..40).map(|i| format!("const double *restrict a{i}")));
        assert!(head.lines().all(|line| line.len() <= 98), "{head}");
        assert_eq!(head.matches(',').count(), 39);
    }
}

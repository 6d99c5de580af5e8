//! C99: a header and the functions that it declares, one per program.
//!
//! The functions allocate nothing, have no state and print nothing. Arguments are pointers to arrays: `p`
//! parameters, `k` what was computed from them once, `t`, `q`, `u`, `w` inputs, `m` modes of switched
//! constraints, `a` accelerations, `l` multipliers, `out` results. A function has those that its kind of
//! program can read; where the model has none, as inputs, all functions lack the argument.
//!
//! The texts are templates: `@` stands for the suffix of numbers and of functions of `<math.h>`, which is
//! empty for doubles and `f` for floats.

mod header;
mod support;

use std::collections::BTreeSet;

use crate::algebra::{Guard, Unrolled};
use crate::compile::{Compiled, Programs};
use crate::graph::{Binary, Comparison, NodeId, Number, Symbol, Unary};
use crate::mechanics::{General, Model, Solution};
use crate::schedule::{Program, Staging, Step, schedule};

use super::program::lines_from;
use super::source::{STYLE, element, literal};
use super::target::{Level, Target, Text, comparison_sign};

/// Smallest ratio of a pivot of M to its diagonal element: `PIVOT_TOLERANCE` of the runtime.
const PIVOT_TOLERANCE: f64 = 1e-13;

/// A model's programs in C.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct InC {
    /// What all names of the text begin with: the struct's name in small letters.
    pub name: String,
    /// The header.
    pub header: String,
    /// The short name of numbers, and functions that the programs call, but for smooth functions.
    pub support: String,
    /// The functions that the header declares.
    pub programs: String,
    /// Length of the array of constants.
    pub constants: usize,
    /// What stands against it, in words; then the texts are empty.
    pub obstacles: Vec<String>,
}

/// The programs of a model in C.
#[must_use]
pub fn c(compiled: &Compiled) -> InC {
    let Compiled { model, equations, programs, .. } = compiled;
    let name = prefix(&model.name);
    let obstacles = obstacles(compiled);
    if !obstacles.is_empty() {
        return InC { name, obstacles, ..InC::default() };
    }
    let staged = staged(programs);
    let language = C { name: &name, functions: model.functions.iter().map(|f| f.name.as_str()).collect() };
    let printer = Printer { language, compiled, constants: &staged.constants };
    let mut declared = vec![printer.constants(&staged)];
    declared.extend(printer.solving());
    declared.extend(printer.plain());
    let texts: Vec<&str> = declared.iter().map(|function| function.text.as_str()).collect();
    let text = texts.join("\n");
    InC {
        header: header::header(&name, compiled, equations, staged.constants.len(), &declared),
        support: format!("typedef {name}_real real;\n\n{}", support::support(&name, &text)),
        programs: text,
        constants: staged.constants.len(),
        name,
        obstacles,
    }
}

/// Why a model cannot be printed, in words.
fn obstacles(compiled: &Compiled) -> Vec<String> {
    let constraints = compiled.equations.constraints.as_ref();
    let reason = constraints.and_then(|constraints| match &constraints.solution {
        Solution::Unrolled(_) => None,
        Solution::General(reason) => Some(match reason {
            General::Redundant => "its constraints repeat one another; remove the rows that do".to_owned(),
            General::Friction => {
                "its forces depend on the reactions of the same instant; let them depend on \
                                  the state alone"
                    .to_owned()
            }
            General::NoPivots => "no order of elimination suits all states; take other coordinates, in \
                                  which fewer constraints are needed"
                .to_owned(),
            General::TooLarge(operations) => {
                format!("they would take {operations} operations; divide the model into smaller ones")
            }
        }),
    });
    if let Some(reason) = reason {
        return vec![format!("its accelerations are found by the general solver, which C lacks: {reason}")];
    }
    if compiled.programs.constraints.as_ref().is_some_and(|c| c.correction.is_none()) {
        return vec![
            "its corrections are too large for generated code; divide it into smaller models".to_owned(),
        ];
    }
    Vec::new()
}

/// Names of headers of the standard library, and of the file with the example.
const TAKEN: &[&str] = &[
    "assert", "complex", "ctype", "errno", "fenv", "float", "inttypes", "iso646", "limits", "locale", "main",
    "math", "setjmp", "signal", "stdarg", "stdbool", "stddef", "stdint", "stdio", "stdlib", "string",
    "tgmath", "time", "wchar", "wctype",
];

/// `DoublePendulum` as `double_pendulum`, in letters that all compilers take.
fn prefix(name: &str) -> String {
    let letters: Vec<char> = name.strip_prefix("r#").unwrap_or(name).chars().collect();
    let is_lower = |i: usize| letters.get(i).is_some_and(|c: &char| c.is_lowercase());
    let mut out = String::new();
    for (i, c) in letters.iter().enumerate() {
        let begins = c.is_uppercase() && i > 0 && (!letters[i - 1].is_uppercase() || is_lower(i + 1));
        if begins && !out.is_empty() && !out.ends_with('_') {
            out.push('_');
        }
        for c in c.to_lowercase() {
            match c {
                '_' if out.is_empty() => {}
                'a'..='z' | '0'..='9' | '_' => out.push(c),
                other => out.push_str(&format!("u{:x}", u32::from(other))),
            }
        }
    }
    if out.is_empty() || TAKEN.contains(&out.as_str()) || out.starts_with(|c: char| c.is_ascii_digit()) {
        out = format!("model_{out}").trim_end_matches('_').to_owned();
    }
    out
}

/// Everything that is computed from parameters alone, for all programs together.
fn staged(programs: &Programs) -> Program {
    let mut all = programs.accelerations.clone();
    let mut known: BTreeSet<NodeId> = all.hoisted.iter().flat_map(defined).collect();
    let constraints = programs.constraints.iter();
    let released = constraints.clone().flat_map(|c| &c.released);
    let released = released.flat_map(|r| [&r.accelerations, &r.correction]);
    for program in constraints.flat_map(|c| &c.correction).chain(released) {
        for step in &program.hoisted {
            if defined(step).any(|id| !known.contains(&id)) {
                known.extend(defined(step));
                all.hoisted.push(step.clone());
            }
        }
        for id in &program.constants {
            if !all.constants.contains(id) {
                all.constants.push(*id);
            }
        }
    }
    all
}

/// What a step computes.
fn defined(step: &Step) -> impl Iterator<Item = NodeId> {
    let all: Vec<NodeId> = match step {
        Step::Node(id) => vec![*id],
        Step::SinCos { sin, cos, .. } => [*sin, *cos].into_iter().flatten().collect(),
        Step::Smooth { orders } => orders.iter().flatten().copied().collect(),
    };
    all.into_iter()
}

/// A function of the text.
struct Declared {
    /// What it does, in words; empty for those that the header does not declare.
    about: String,
    /// Its head as the header has it.
    declaration: String,
    text: String,
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

struct Printer<'a> {
    language: C<'a>,
    compiled: &'a Compiled,
    constants: &'a [NodeId],
}

impl Printer<'_> {
    fn rows(&self) -> usize {
        self.compiled.equations.constraints.as_ref().map_or(0, |c| c.rows.len())
    }

    fn switched(&self) -> usize {
        self.compiled.model.constraints.iter().filter(|c| c.switched).count()
    }

    /// `NAME_constants`.
    fn constants(&self, staged: &Program) -> Declared {
        let name = self.language.name;
        let model = &self.compiled.model;
        let hoisted = Program {
            body: staged.hoisted.clone(),
            hoisted: Vec::new(),
            constants: Vec::new(),
            results: staged.constants.clone(),
            ..staged.clone()
        };
        let (lines, results) = lines_from(&self.language, model, &hoisted, STYLE, &[]);
        let head = |real: &str| {
            let arguments = [format!("const {real} *restrict p"), format!("{real} *restrict k")];
            wrapped(&format!("void {name}_constants("), arguments)
        };
        let mut body: String = lines.iter().map(|line| format!("  {}\n", line.text)).collect();
        body.extend(results.iter().enumerate().map(|(i, value)| format!("  k[{i}] = {};\n", value.text)));
        let text = format!("{}\n{{\n{}{body}}}\n", head("real"), unused(&["p", "k"], &body));
        let about = "Computes the constants k from the parameters p: once, and after each change of them.";
        let declaration = head(&format!("{name}_real"));
        Declared { about: about.to_owned(), declaration, text }
    }

    /// `NAME_accelerations` and `NAME_correction`.
    fn solving(&self) -> Vec<Declared> {
        let Compiled { model, equations, programs, .. } = self.compiled;
        let (n, r) = (model.coordinates.len(), self.rows());
        let Some((constraints, of)) = equations.constraints.as_ref().zip(programs.constraints.as_ref())
        else {
            let request = Request {
                about: "Accelerations a at a state.",
                name: "accelerations",
                given: &["k"],
                into: &[("a", n)],
                check: Check::Pivots,
                local: false,
            };
            return vec![self.function(&programs.accelerations, &request)];
        };
        let Solution::Unrolled(whole) = &constraints.solution else { return Vec::new() };
        let mut paths: Vec<(&[usize], &Unrolled, &Program, Option<&Program>)> =
            vec![(&[], whole, &programs.accelerations, of.correction.as_ref())];
        paths.extend(constraints.released.iter().zip(&of.released).map(|(set, programs)| {
            (set.modes.as_slice(), &set.unrolled, &programs.accelerations, Some(&programs.correction))
        }));
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
            about: "The smallest step out, by inertia, by which the rows of the constraints change by l: for \
                    positions and velocities that drift.",
            name: "correction",
            given: &["k", "l"],
            into: &[("out", n)],
            check: Check::Nothing,
            local: switched,
        };
        let mut all = Vec::new();
        for request in [&accelerations, &correction] {
            let is_correction = request.name == "correction";
            for (i, (_, unrolled, program, corrected)) in paths.iter().enumerate() {
                let own = if switched { format!("{}_{i}", request.name) } else { request.name.to_owned() };
                let (program, guards) = match (is_correction, corrected) {
                    (true, Some(program)) => (*program, &unrolled.correction_guards),
                    _ => (*program, &unrolled.guards),
                };
                let request = Request { name: &own, check: Check::Guards(guards), ..*request };
                all.push(self.function(program, &request));
            }
            if switched {
                let modes: Vec<&[usize]> = paths.iter().map(|path| path.0).collect();
                all.push(self.choice(request, &modes));
            }
        }
        all
    }

    /// The function that calls one of several by the modes of switched constraints.
    fn choice(&self, request: &Request<'_>, sets: &[&[usize]]) -> Declared {
        let name = self.language.name;
        let request = Request { local: false, check: Check::Pivots, ..*request };
        let head = self.head(&request, "real");
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
        let declaration = self.head(&request, &format!("{name}_real"));
        Declared { about: request.about.to_owned(), declaration, text }
    }

    /// Everything else that shows what a model does.
    fn plain(&self) -> Vec<Declared> {
        let Compiled { model, programs, equations, .. } = self.compiled;
        let count = |program: &Program| program.results.len();
        let solution: &[&str] = if self.rows() > 0 { &["a", "l"] } else { &[] };
        let energies: Vec<NodeId> = [Some(&programs.energy_function)]
            .into_iter()
            .chain([programs.kinetic_energy.as_ref(), programs.potential_energy.as_ref()])
            .flatten()
            .flat_map(|program| program.results.iter().copied())
            .collect();
        let about = match energies.len() {
            1 => "The energy function.",
            _ => "The energy function, the kinetic and the potential energy.",
        };
        let energies = schedule(&model.graph, "energies", &energies, Staging::Inline);
        let named = equations.outputs.len();
        let events = equations.events.len();
        let mut list: Vec<(&str, &str, &Program, &[&str], usize, Check<'_>)> = vec![
            ("energies", about, &energies, &[], count(&energies), Check::Nothing),
            (
                "conserved",
                "Conserved quantities.",
                &programs.conserved,
                &[],
                count(&programs.conserved),
                Check::Nothing,
            ),
            (
                "powers",
                "Powers of the forces.",
                &programs.powers,
                solution,
                count(&programs.powers),
                Check::Nothing,
            ),
            ("outputs", "Outputs.", &programs.outputs, solution, named, Check::Pivots),
            (
                "events",
                "Events: values whose changes of sign matter.",
                &programs.events,
                solution,
                events,
                Check::Pivots,
            ),
            (
                "kinks",
                "Values at whose changes of sign, or of piece, accelerations are not smooth.",
                &programs.kinks.program,
                &[],
                count(&programs.kinks.program),
                Check::Nothing,
            ),
        ];
        if let Some(of) = &programs.constraints {
            let rows: [(&str, &str, &Program); 3] = [
                ("residual", "What holonomic constraints miss zero by.", &of.residual),
                (
                    "velocity_residual",
                    "What all constraints miss zero by in velocities.",
                    &of.velocity_residual,
                ),
                (
                    "terms",
                    "M, Q, the Jacobian and gamma, each by rows one after the other: M a = Q + J' l, J a = gamma.",
                    &of.terms,
                ),
            ];
            list.extend(rows.map(|(name, about, program)| {
                let none: &[&str] = &[];
                (name, about, program, none, program.results.len(), Check::Nothing)
            }));
        }
        let kept = list.into_iter().filter(|(_, _, program, ..)| !program.results.is_empty());
        kept.map(|(name, about, program, given, count, check)| {
            let into: &[(&str, usize)] = &[("out", count)];
            self.function(program, &Request { about, name, given, into, check, local: false })
        })
        .collect()
    }

    /// The names of a function's arguments, in order.
    fn arguments<'b>(&self, request: &Request<'b>) -> Vec<&'b str> {
        let model = &self.compiled.model;
        let into = || request.into.iter().map(|(name, _)| *name);
        let known = |name: &str| match name {
            "p" | "t" | "q" | "u" => true,
            "w" => !model.inputs.is_empty(),
            "m" => self.switched() > 0,
            name => request.given.contains(&name) || into().any(|other| other == name),
        };
        ["p", "k", "t", "q", "u", "w", "m", "a", "l", "out"].into_iter().filter(|name| known(name)).collect()
    }

    /// The head of a function whose numbers have this type: `real` in the source, `NAME_real` in the header.
    fn head(&self, request: &Request<'_>, real: &str) -> String {
        let arguments = self.arguments(request).into_iter().map(|argument| {
            let is_result = request.into.iter().any(|(other, _)| *other == argument);
            match argument {
                "t" => format!("{real} t"),
                _ if is_result => format!("{real} *restrict {argument}"),
                _ => format!("const {real} *restrict {argument}"),
            }
        });
        let result = if matches!(request.check, Check::Nothing) { "void" } else { "int" };
        let local = if request.local { "static " } else { "" };
        wrapped(&format!("{local}{result} {}_{}(", self.language.name, request.name), arguments)
    }

    fn function(&self, program: &Program, request: &Request<'_>) -> Declared {
        let model = &self.compiled.model;
        let body = Program { hoisted: Vec::new(), constants: Vec::new(), ..program.clone() };
        let named = |(i, id): (usize, &NodeId)| (*id, Text::atom(format!("k[{i}]")));
        let given: Vec<(NodeId, Text)> = self.constants.iter().enumerate().map(named).collect();
        let is_staged = !program.constants.is_empty() || !program.hoisted.is_empty();
        let given = if is_staged { given } else { Vec::new() };
        let (lines, results) = lines_from(&self.language, model, &body, STYLE, &given);
        let mut text: String = lines.iter().map(|line| format!("  {}\n", line.text)).collect();
        let mut rest = results.iter();
        for (into, count) in request.into {
            for (i, value) in rest.by_ref().take(*count).enumerate() {
                text.push_str(&format!("  {into}[{i}] = {};\n", value.text));
            }
        }
        text.push_str(&self.check(rest.as_slice(), request.check));
        let head = self.head(request, "real");
        let text = format!("{head}\n{{\n{}{text}}}\n", unused(&self.arguments(request), &text));
        let about = if request.local { String::new() } else { request.about.to_owned() };
        let declaration = self.head(request, &format!("{}_real", self.language.name));
        Declared { about, declaration, text }
    }

    /// The return of a status, from pairs of pivots and what they are compared with.
    fn check(&self, values: &[Text], check: Check<'_>) -> String {
        let graph = &self.compiled.model.graph;
        let (name, upper) = (self.language.name, self.language.name.to_uppercase());
        let is_number = |id: NodeId| graph.as_number(id).is_some();
        let tolerated = |tolerance: f64| format!("{}*{name}_margin", self.language.suffixed(tolerance));
        // A Lagrangian may be indefinite, a kinetic energy may not.
        let positive = self.compiled.equations.energies.is_some();
        let pairs = values.chunks(2).enumerate();
        let mut text = String::new();
        let mut tests = Vec::new();
        for (i, pair) in pairs {
            let (skipped, tolerance) = match check {
                Check::Guards(guards) => (is_number(guards[i].pivot), guards[i].tolerance),
                _ => (is_number(self.compiled.equations.pivots[i].pivot), PIVOT_TOLERANCE),
            };
            if skipped {
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

/// The language.
struct C<'a> {
    /// What all names begin with.
    name: &'a str,
    /// Names of the smooth functions, in order.
    functions: Vec<&'a str>,
}

impl C<'_> {
    /// A literal of the type of the text.
    fn suffixed(&self, value: f64) -> String {
        let text = literal(Number::Float(value));
        let is_float = text.contains(['.', 'e']);
        format!("{text}{}@", if is_float { "" } else { ".0" })
    }
}

impl Target for C<'_> {
    fn symbol(&self, _model: &Model, symbol: Symbol) -> Text {
        Text::atom(element(symbol))
    }
    fn smooth(&self, name: &str, order: u8, argument: &Text) -> Text {
        let index = self.functions.iter().position(|known| *known == name).unwrap_or(self.functions.len());
        Text::atom(format!("{}_function_{index}({}, {order})", self.name, argument.text))
    }
    fn unary(&self, f: Unary, a: &Text) -> Text {
        let own = match f {
            Unary::Sin | Unary::Cos | Unary::Signum => Some(f.name()),
            _ => None,
        };
        let name = match f {
            Unary::Ln => "log",
            Unary::Abs => "fabs",
            other => other.name(),
        };
        Text::atom(match own {
            Some(own) => format!("{}_{own}({})", self.name, a.text),
            None => format!("{name}@({})", a.text),
        })
    }
    fn binary(&self, f: Binary, a: &Text, b: &Text) -> Text {
        let name = match f {
            Binary::Atan2 => "atan2@".to_owned(),
            Binary::Powf => "pow@".to_owned(),
            Binary::Hypot => "hypot@".to_owned(),
            Binary::Min => format!("{}_min", self.name),
            Binary::Max => format!("{}_max", self.name),
        };
        Text::atom(format!("{name}({}, {})", a.text, b.text))
    }
    fn select(
        &self,
        comparison: Comparison,
        [left, right]: [&Text; 2],
        then: &Text,
        otherwise: &Text,
    ) -> Text {
        let sign = comparison_sign(comparison);
        let [left, right, then, otherwise] =
            [left, right, then, otherwise].map(|text| self.fit(text, Level::Sum));
        Text::new(format!("({left} {sign} {right}) ? {then} : {otherwise}"), Level::Choice)
    }
    fn assign(&self, name: &Text, value: &Text) -> String {
        format!("const real {} = {};", name.text, value.text)
    }
    fn assign_sin_cos(&self, [sin, cos]: [&Text; 2], angle: &Text) -> Option<String> {
        let (name, sin, cos, angle) = (self.name, &sin.text, &cos.text, &angle.text);
        Some(format!("real {cos}; const real {sin} = {name}_sin_cos({angle}, &{cos});"))
    }
    fn number(&self, n: Number) -> Text {
        let text = self.suffixed(n.value());
        let level = if text.starts_with('-') { Level::Sum } else { Level::Atom };
        Text::new(text, level)
    }
}

#[cfg(test)]
mod tests {
    use super::{prefix, wrapped};

    #[test]
    fn names_are_those_of_c() {
        for (name, expected) in [
            ("DoublePendulum", "double_pendulum"),
            ("MBSModel", "mbs_model"),
            ("Pendulum2D", "pendulum2_d"),
            ("Andrews", "andrews"),
            ("Größe", "gruf6udfe"),
            ("_Hidden", "hidden"),
            ("Main", "model_main"),
            ("Math", "model_math"),
            ("_", "model"),
        ] {
            assert_eq!(prefix(name), expected);
        }
    }

    #[test]
    fn heads_have_short_lines() {
        let head = wrapped("int f(", (0..40).map(|i| format!("const double *restrict a{i}")));
        assert!(head.lines().all(|line| line.len() <= 98), "{head}");
        assert_eq!(head.matches(',').count(), 39);
    }
}

//! C99: a header and the functions that it declares, one per program.
//!
//! The functions allocate nothing, have no state and print nothing. Arguments are pointers to arrays: `p`
//! parameters, `k` what was computed from them once, `t`, `q`, `u`, `w` inputs, `m` modes of switched
//! constraints, `a` accelerations, `l` multipliers, `r` right-hand sides of rows, `dt`, `dq`, `du`, `dw`,
//! `dp` rates along a direction, `out` results. A function has those that its kind of program can read; where
//! the model has none, as inputs, all functions lack the argument.
//!
//! The texts are templates: `@` stands for the suffix of numbers and of functions of `<math.h>`, which is
//! empty for doubles and `f` for floats.

mod header;
mod printer;
mod support;

use std::collections::BTreeSet;

use crate::graph::{Binary, Comparison, FunctionId, NodeId, Number, Symbol, Unary};
use crate::mechanics::{Equations, General, Model, Solution};
use crate::schedule::{Program, Step};

use super::source::{element, literal};
use super::target::{Level, Target, Text, comparison_sign};
use printer::Printer;

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
    /// For each kink the number of the smooth function whose argument it is; `None` for what changes its
    /// sign.
    pub kink_functions: Vec<Option<usize>>,
    /// Whether there are derivatives along a direction.
    pub directional: bool,
    /// What stands against it, in words; then the texts are empty.
    pub obstacles: Vec<String>,
}

/// The programs that are printed.
#[derive(Clone, Debug)]
pub struct ForC<'a> {
    /// The listing of the model, by whose hash the text is known.
    pub listing: &'a str,
    /// q̈, with constraints λ, and guards.
    pub accelerations: &'a Program,
    /// The energy function, then kinetic and potential energy, where there are such.
    pub energies: Vec<&'a Program>,
    /// Those that every model has, by name: without results where there is nothing to compute.
    pub named: Vec<(PlainProgram, &'a Program)>,
    /// Rates of q̈, λ, energies, outputs, events and kinks along a direction; `None` where it was left out.
    pub directional: Option<&'a Program>,
    /// For each kink the function whose argument it is; `None` for what changes its sign.
    pub kink_functions: &'a [Option<FunctionId>],
    /// δ and guards, with all constraints; `None` without constraints, and where it is too large.
    pub correction: Option<&'a Program>,
    /// Accelerations and corrections with released constraints, in the order of
    /// [`ConstraintEquations::released`](crate::mechanics::ConstraintEquations::released).
    pub released: Vec<(&'a Program, &'a Program)>,
}

/// Programs that are printed as they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlainProgram {
    /// Conserved quantities.
    Conserved,
    /// Powers of the forces.
    Powers,
    /// Outputs.
    Outputs,
    /// Events.
    Events,
    /// Where accelerations are not smooth.
    Kinks,
    /// Φ.
    Residual,
    /// What velocities miss all rows by.
    VelocityResidual,
    /// M, Q, Φ_q and γ.
    Terms,
}

impl PlainProgram {
    /// Its name in C, and what it does.
    fn texts(self) -> [&'static str; 2] {
        match self {
            Self::Conserved => ["conserved", "Conserved quantities."],
            Self::Powers => ["powers", "Powers of the forces."],
            Self::Outputs => ["outputs", "Outputs."],
            Self::Events => ["events", "Events: values whose changes of sign matter."],
            Self::Kinks => {
                ["kinks", "Values at whose changes of sign, or of piece, accelerations are not smooth."]
            }
            Self::Residual => ["residual", "Phi of the holonomic rows: 0 on every motion."],
            Self::VelocityResidual => {
                ["velocity_residual", "Phi_q u + Phi_t, and A u + b: 0 on every motion."]
            }
            Self::Terms => {
                let about = "M, Q, the Jacobian J and gamma, each by rows, one after the other: \
                             M a = Q + J' l, J a = gamma.";
                ["terms", about]
            }
        }
    }
}

/// The programs of a model in C.
#[must_use]
pub fn c(model: &Model, equations: &Equations, programs: &ForC<'_>) -> InC {
    let name = prefix(&model.name);
    let obstacles = obstacles(equations, programs);
    if !obstacles.is_empty() {
        return InC { name, obstacles, ..InC::default() };
    }
    let staged = staged(programs);
    let functions = model.functions.iter().map(|f| f.name.as_str()).collect();
    let language = C { name: &name, functions, right: false };
    let printer = Printer { language, model, equations, programs, constants: &staged.constants };
    let mut declared = vec![printer.constants(&staged)];
    declared.extend(printer.solving());
    declared.extend(printer.plain());
    declared.extend(printer.directional());
    let texts: Vec<&str> = declared.iter().map(|function| function.text.as_str()).collect();
    let text = texts.join("\n");
    InC {
        header: header::header(&name, &printer, &declared),
        support: format!("typedef {name}_real real;\n\n{}", support::support(&name, &text)),
        programs: text,
        constants: staged.constants.len(),
        kink_functions: programs.kink_functions.iter().map(|of| of.map(|id| id.0 as usize)).collect(),
        directional: programs.directional.is_some(),
        name,
        obstacles,
    }
}

/// Why a model cannot be printed, in words.
fn obstacles(equations: &Equations, programs: &ForC<'_>) -> Vec<String> {
    let Some(constraints) = &equations.constraints else { return Vec::new() };
    let text = match &constraints.solution {
        Solution::Unrolled(_) if programs.correction.is_some() => return Vec::new(),
        Solution::Unrolled(_) => {
            "its corrections are too large for generated code; divide it into smaller models".to_owned()
        }
        Solution::General(reason) => {
            let reason = match reason {
                General::Redundant => {
                    "its constraints repeat one another; remove the rows that do".to_owned()
                }
                General::Friction => "its forces depend on the reactions of the same instant; let them \
                                      depend on the state alone"
                    .to_owned(),
                General::NoPivots => "no order of elimination suits all states; take coordinates in which \
                                      fewer constraints are needed"
                    .to_owned(),
                General::TooLarge(operations) => {
                    format!("they would take {operations} operations; divide the model into smaller ones")
                }
            };
            format!("its accelerations are found by the general solver, which C lacks: {reason}")
        }
    };
    vec![text]
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
fn staged(programs: &ForC<'_>) -> Program {
    let mut all = programs.accelerations.clone();
    let mut known: BTreeSet<NodeId> = all.hoisted.iter().flat_map(defined).collect();
    let released =
        programs.released.iter().flat_map(|(accelerations, correction)| [accelerations, correction]);
    for program in programs.correction.iter().chain(released) {
        for step in &program.hoisted {
            if defined(step).any(|id| !known.contains(&id)) {
                known.extend(defined(step));
                all.hoisted.push(*step);
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

/// A symbol behind the model's own, which is a rate along a direction
/// ([`directions`](crate::mechanics::directions)).
fn rate(model: &Model, symbol: Symbol) -> Option<String> {
    let behind = |array: &str, count: usize| {
        let index = (symbol.number()? as usize).checked_sub(count)?;
        Some(format!("{array}[{index}]"))
    };
    let n = model.coordinates.len();
    match symbol {
        Symbol::Coordinate(i) if i as usize == 2 * n => Some("dt".to_owned()),
        Symbol::Coordinate(_) => behind("dq", n),
        Symbol::Rate(_) => behind("du", n),
        Symbol::Input(_) => behind("dw", model.inputs.len()),
        Symbol::Parameter(_) => behind("dp", model.parameters.len()),
        _ => None,
    }
}

/// The language.
#[derive(Clone)]
struct C<'a> {
    /// What all names begin with.
    name: &'a str,
    /// Names of the smooth functions, in order.
    functions: Vec<&'a str>,
    /// Whether the symbols of multipliers stand for right-hand sides of rows, as in corrections.
    right: bool,
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
    fn symbol(&self, model: &Model, symbol: Symbol) -> Text {
        if let Some(rate) = rate(model, symbol) {
            return Text::atom(rate);
        }
        match symbol {
            Symbol::Multiplier(i) if self.right => Text::atom(format!("r[{i}]")),
            _ => Text::atom(element(symbol)),
        }
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
    use super::prefix;

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
}

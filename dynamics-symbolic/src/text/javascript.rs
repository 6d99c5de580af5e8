//! JavaScript: one object literal with all programs that a live page runs.
//!
//! It is evaluated where the page's functions (`sin_cos`, `min`, …) are in scope. Every program is an
//! object `{ results, constants, hoist(p, f, k), run(p, k, f, t, q, u, w, m, a, l, out) }`: parameters, the
//! program's constants, smooth functions, time, coordinates, velocities, inputs, modes, accelerations,
//! multipliers, and where the results go. All programs have the same arguments, so that a page calls them all
//! in one way.

mod picture;
mod round;

pub(crate) use picture::quoted;
pub(crate) use round::{PrintedRound, round};

use std::collections::BTreeMap;

use crate::algebra::{Guard, Unrolled};
use crate::graph::{Binary, Comparison, FunctionId, Number, Symbol, Unary};
use crate::mechanics::{Equations, Extra, Figures, Model, Picture, Solution};
use crate::schedule::Program;

use super::mathml::{Dots, symbol_mathml};
use super::program::Line;
use super::report::entry;
use super::source::{Function, Language, element, function, literal};
use super::target::{Level, Target, Text, comparison_sign};

/// The arguments of all programs.
const ARGUMENTS: &str = "p, k, f, t, q, u, w, m, a, l, out";
/// Most operations of all programs of a page together.
const MOST_OPERATIONS: usize = 20_000;

/// What a model brings along for a page.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Portability {
    /// The object with all programs; empty where they are too large.
    pub javascript: String,
    /// The symbols of coordinates, inputs and parameters in MathML, in this order.
    pub symbols: Vec<String>,
    /// What a page cannot do with the model, in words.
    pub obstacles: Vec<String>,
    /// Whether its picture shows anything of space.
    pub spatial: bool,
    /// Whether there is a program of places where accelerations are not smooth.
    pub has_kinks: bool,
    /// Whether there are programs of kinetic and potential energy.
    pub has_energies: bool,
}

/// The programs of a model in JavaScript.
#[must_use]
pub fn javascript(model: &mut Model, equations: &Equations, printed: &Portable<'_>) -> Portability {
    let shown = model.picture.take().unwrap_or_default();
    let operations: usize =
        printed.all().map(|program| program.hoisted_cost.total() + program.cost.total()).sum();
    if operations > MOST_OPERATIONS {
        let obstacle =
            format!("its programs take {operations} operations; a page holds at most {MOST_OPERATIONS}");
        return Portability { symbols: symbols(model), obstacles: vec![obstacle], ..Portability::default() };
    }
    let language = JavaScript {
        functions: model.functions.iter().map(|f| f.name.clone()).collect(),
        parameters: model.parameters.len() as u32,
        extras: shown.extras.clone(),
        names: BTreeMap::new(),
    };
    let mut obstacles: Vec<String> = not_followed(&shown).into_iter().collect();
    let picture = picture::picture(&language, model, shown, MOST_OPERATIONS - operations);
    obstacles.extend(picture.obstacle);
    let object = |program: &Program| function(&language, model, program);
    let mut out = String::from("({\n");
    out.push_str(&sizes(model, equations, &picture.about));
    out.push_str(&picture.programs);
    for (name, program) in &printed.named {
        out.push_str(&format!("{name}: {},\n", object(program)));
    }
    let unrolled = equations.constraints.as_ref().and_then(|c| match &c.solution {
        Solution::Unrolled(unrolled) => Some(unrolled),
        Solution::General(_) => None,
    });
    out.extend(unrolled.map(|unrolled| format!("{},\n", bounds(model, unrolled))));
    if !printed.kink_functions.is_empty() {
        // The smooth function whose argument a value is; of others the sign decides.
        let of = printed.kink_functions.iter();
        let of: Vec<String> = of.map(|f| f.map_or_else(|| "null".to_owned(), |f| f.0.to_string())).collect();
        out.push_str(&format!("kink_functions: [{}],\n", of.join(", ")));
    }
    if !printed.released.is_empty() {
        out.push_str("released: [\n");
        let sets = equations.constraints.iter().flat_map(|c| &c.released);
        for ((accelerations, correction), set) in printed.released.iter().zip(sets) {
            let (accelerations, correction) = (object(accelerations), object(correction));
            let (modes, bounds) = (&set.modes, bounds(model, &set.unrolled));
            out.push_str(&format!("{{ modes: {modes:?}, {bounds}, accelerations: {accelerations}, "));
            out.push_str(&format!("correction: {correction} }},\n"));
        }
        out.push_str("],\n");
    }
    out.push_str("})");
    let has = |program: &str| printed.named.iter().any(|(name, _)| *name == program);
    Portability {
        javascript: out,
        symbols: symbols(model),
        obstacles,
        spatial: picture.in_space,
        has_kinks: !printed.kink_functions.is_empty(),
        has_energies: has("kinetic_energy") && has("potential_energy"),
    }
}

/// The smallest admissible ratios of the pivots at the end of a solution's programs to their scales. A pivot
/// that is a number needs no check: its bound is negative.
fn bounds(model: &Model, unrolled: &Unrolled) -> String {
    let of = |guards: &[Guard]| -> Vec<f64> {
        let is_number = |guard: &Guard| model.graph.as_number(guard.pivot).is_some();
        guards.iter().map(|guard| if is_number(guard) { -1.0 } else { guard.tolerance }).collect()
    };
    let (accelerations, correction) = (of(&unrolled.guards), of(&unrolled.correction_guards));
    format!("bounds: {{ accelerations: {accelerations:?}, correction: {correction:?} }}")
}

/// Why a page draws points instead of the model's own drawing, or nothing, in words.
fn not_followed(picture: &Picture) -> Option<String> {
    match &picture.figures {
        Figures::NotFollowed(reason) if picture.points.is_empty() => Some(format!(
            "{reason}: its live page has no picture; no helper that a role calls returns a point"
        )),
        Figures::NotFollowed(reason) => Some(format!("{reason}: its live page draws points")),
        Figures::None | Figures::Of(_) => None,
    }
}

/// The line of the report, where the drawing is not followed.
#[must_use]
pub fn picture_entry(model: &Model) -> String {
    let mut out = String::new();
    if let Some(text) = model.picture.as_ref().and_then(not_followed) {
        entry(&mut out, "drawing", &text);
    }
    out
}

/// The symbols of coordinates, inputs and parameters in MathML.
fn symbols(model: &Model) -> Vec<String> {
    let coordinates = model.coordinates.iter().map(|c| &c.name);
    let inputs = model.inputs.iter().map(|c| &c.name);
    let parameters = model.parameters.iter().map(|c| &c.name);
    let all = coordinates.chain(inputs).chain(parameters);
    all.map(|name| symbol_mathml(name, Dots::None)).collect()
}

/// Numbers of everything, and which coordinate each pivot belongs to.
fn sizes(model: &Model, equations: &Equations, about: &str) -> String {
    let rows = equations.constraints.as_ref().map_or(0, |c| c.rows.len());
    let holonomic = equations.constraints.as_ref().map_or(0, |c| c.residual.len());
    let switched = model.constraints.iter().filter(|c| c.switched).count();
    let pivots: Vec<usize> = equations.pivots.iter().map(|pivot| pivot.coordinate).collect();
    format!(
        "sizes: {{ coordinates: {}, parameters: {}, inputs: {}, rows: {rows}, holonomic: {holonomic}, \
         switched: {switched}, speeds: {} }},\nmodel: {{ pivots: {pivots:?}, {about} }},\n",
        model.coordinates.len(),
        model.parameters.len(),
        model.inputs.len(),
        model.speeds.len(),
    )
}

/// The programs that are printed.
#[derive(Clone, Debug)]
pub struct Portable<'a> {
    /// Those with results, by the names that they have in other languages.
    pub named: Vec<(&'static str, &'a Program)>,
    /// Accelerations and corrections with released constraints, in the order of
    /// [`ConstraintEquations::released`](crate::mechanics::ConstraintEquations::released).
    pub released: Vec<(&'a Program, &'a Program)>,
    /// The functions whose arguments the values of `kinks` are, see [`Kinks`](crate::compile::Kinks).
    pub kink_functions: &'a [Option<FunctionId>],
}

impl<'a> Portable<'a> {
    fn all(&self) -> impl Iterator<Item = &'a Program> {
        let released =
            self.released.iter().flat_map(|(accelerations, correction)| [accelerations, correction]);
        self.named.iter().map(|(_, program)| program).chain(released).copied()
    }
}

/// The language.
struct JavaScript {
    /// Names of the smooth functions, in order.
    functions: Vec<String>,
    /// Number of the parameters of the model.
    parameters: u32,
    /// What the parameters behind them are.
    extras: Vec<Extra>,
    /// Symbols that are read in another way, as those of elements of families.
    names: BTreeMap<Symbol, String>,
}

impl Target for JavaScript {
    fn symbol(&self, _model: &Model, symbol: Symbol) -> Text {
        if let Some(name) = self.names.get(&symbol) {
            return Text::atom(name.clone());
        }
        let extra = match symbol {
            Symbol::Parameter(i) => i.checked_sub(self.parameters).and_then(|i| self.extras.get(i as usize)),
            _ => None,
        };
        Text::atom(match extra {
            None => element(symbol),
            Some(Extra::Running) => "s".to_owned(),
            Some(Extra::Start(function)) => format!("f[{}].domain[0]", function.0),
            Some(Extra::End(function)) => format!("f[{}].domain[1]", function.0),
        })
    }
    fn smooth(&self, name: &str, order: u8, argument: &Text) -> Text {
        let index = self.functions.iter().position(|known| known == name);
        let index = index.map_or_else(|| "undefined".to_owned(), |i| i.to_string());
        Text::atom(format!("f[{index}]({}, {order})", argument.text))
    }
    fn unary(&self, f: Unary, a: &Text) -> Text {
        let name = match f {
            // The page's own have the bits of the library's.
            Unary::Sin => "sin",
            Unary::Cos => "cos",
            Unary::Signum => "signum",
            Unary::Ln => "Math.log",
            other => return Text::atom(format!("Math.{}({})", other.name(), a.text)),
        };
        Text::atom(format!("{name}({})", a.text))
    }
    fn binary(&self, f: Binary, a: &Text, b: &Text) -> Text {
        let name = match f {
            Binary::Atan2 => "Math.atan2",
            Binary::Powf => "powf",
            Binary::Hypot => "hypot",
            Binary::Min => "min",
            Binary::Max => "max",
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
        let sign = match comparison {
            Comparison::Equal => "===",
            other => comparison_sign(other),
        };
        let [left, right, then, otherwise] =
            [left, right, then, otherwise].map(|text| self.fit(text, Level::Sum));
        Text::new(format!("{left} {sign} {right} ? {then} : {otherwise}"), Level::Choice)
    }
    fn assign(&self, name: &Text, value: &Text) -> String {
        format!("const {} = {};", name.text, value.text)
    }
    fn assign_sin_cos(&self, [sin, cos]: [&Text; 2], angle: &Text) -> Option<String> {
        Some(format!("const {} = sin_cos({}), {} = cosine[0];", sin.text, angle.text, cos.text))
    }
    fn assign_root(&self, [root, reciprocal]: [&Text; 2], square: &Text) -> Option<String> {
        let (root, inverse) = (&root.text, &reciprocal.text);
        Some(format!("const {root} = root({}), {inverse} = reciprocal[0];", square.text))
    }
    fn number(&self, n: Number) -> Text {
        let text = literal(n);
        let level = if text.starts_with('-') { Level::Sum } else { Level::Atom };
        Text::new(text, level)
    }
}

impl Language for JavaScript {
    fn constant(&self, index: usize) -> Text {
        Text::atom(format!("k[{index}]"))
    }
    fn function(&self, function: &Function) -> String {
        let body = |(lines, results): &(Vec<Line>, Vec<Text>), into: &str| {
            let lines = lines.iter().map(|line| format!("  {}\n", line.text));
            let results = results.iter().enumerate();
            let results = results.map(|(i, value)| format!("  {into}[{i}] = {};\n", value.text));
            lines.chain(results).collect::<String>()
        };
        let constants = function.hoisted.1.len();
        let hoist = match constants {
            0 => String::new(),
            _ => format!("hoist(p, f, k) {{\n{}}}, ", body(&function.hoisted, "k")),
        };
        format!(
            "{{ results: {}, constants: {constants}, {hoist}run({ARGUMENTS}) {{\n{}}} }}",
            function.results,
            body(&function.body, "out"),
        )
    }
}

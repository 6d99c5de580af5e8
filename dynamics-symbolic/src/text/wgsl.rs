//! WGSL, the language of kernels for graphics cards of all makers: the accelerations, in single precision.
//!
//! Two functions: `model_constants(p)`, what is computed from the parameters once, and
//! `model_accelerations(p, k, t, q, u, w)`, the accelerations and behind them 1 where they exist and 0 where
//! not. Arguments are arrays by value; arrays of no numbers have one, since the language has no empty ones.

use crate::graph::{Binary, Comparison, Number, Symbol, Unary};
use crate::mechanics::{Equations, Model};
use crate::schedule::{Program, Step};

use super::program::Line;
use super::source::{Function, Language, element, function, literal};
use super::target::{Level, Target, Text, comparison_sign};

/// Smallest ratio of a pivot of M to its diagonal element in single precision: that of doubles, times 2²⁹, by
/// which the last place is larger.
const PIVOT_TOLERANCE: &str = "5.4e-5f";

/// A model's accelerations in WGSL.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct InWgsl {
    /// Both functions.
    pub programs: String,
    /// Length of the array of constants.
    pub constants: usize,
    /// What stands against it, in words; then the text is empty.
    pub obstacles: Vec<String>,
}

/// The accelerations of a model in WGSL.
#[must_use]
pub fn wgsl(model: &Model, equations: &Equations, accelerations: &Program) -> InWgsl {
    let obstacles = obstacles(model, equations, accelerations);
    if !obstacles.is_empty() {
        return InWgsl { obstacles, ..InWgsl::default() };
    }
    let is_number = |i: usize| model.graph.as_number(equations.pivots[i].pivot).is_some();
    let language = Wgsl {
        parameters: model.parameters.len(),
        coordinates: model.coordinates.len(),
        inputs: model.inputs.len(),
        checked: (0..equations.pivots.len()).map(|i| !is_number(i)).collect(),
        positive: equations.energies.is_some(),
    };
    let programs = function(&language, model, accelerations);
    InWgsl { programs, constants: accelerations.constants.len(), obstacles }
}

/// Why a model cannot be printed, in words.
fn obstacles(model: &Model, equations: &Equations, accelerations: &Program) -> Vec<String> {
    let mut all = Vec::new();
    if equations.constraints.is_some() {
        all.push("it has constraints, which kernels do not hold".to_owned());
    }
    if !model.functions.is_empty() {
        all.push("it has smooth functions, which kernels in WGSL do not have".to_owned());
    }
    let steps = accelerations.hoisted.iter().chain(&accelerations.body);
    let read = steps.flat_map(|step| match step {
        Step::Node(id) => model.graph.node(*id).children().collect(),
        Step::SinCos { angle, .. } => vec![*angle],
        Step::Smooth { .. } => Vec::new(),
    });
    let numbers = read.chain(accelerations.results.iter().copied());
    let mut numbers = numbers.filter_map(|id| model.graph.as_number(id)).map(|number| number.value());
    // Not numbers that cards may take for 0 either.
    let is_lost = |x: &f64| *x != 0.0 && !(*x as f32).is_normal();
    if let Some(x) = numbers.find(is_lost) {
        all.push(format!("single precision does not hold the number {x:e} of its equations"));
    }
    all
}

/// The language.
struct Wgsl {
    parameters: usize,
    coordinates: usize,
    inputs: usize,
    /// For each pivot of M whether it is to be checked.
    checked: Vec<bool>,
    /// Whether pivots have to be positive.
    positive: bool,
}

/// An array of so many numbers, or of one.
fn array(count: usize) -> String {
    format!("array<f32, {}>", count.max(1))
}

impl Target for Wgsl {
    fn symbol(&self, _model: &Model, symbol: Symbol) -> Text {
        Text::atom(element(symbol))
    }
    fn smooth(&self, name: &str, order: u8, argument: &Text) -> Text {
        // Such models are refused before.
        Text::atom(format!("{name}_{order}({})", argument.text))
    }
    fn unary(&self, f: Unary, a: &Text) -> Text {
        let a = &a.text;
        Text::atom(match f {
            Unary::Sin => format!("sin_cos({a}).x"),
            Unary::Cos => format!("sin_cos({a}).y"),
            Unary::Ln => format!("log({a})"),
            Unary::Cbrt => format!("(sign({a})*pow(abs({a}), 0.33333334f))"),
            Unary::Signum => format!("select(-1.0f, 1.0f, {a} >= 0.0f)"),
            other => format!("{}({a})", other.name()),
        })
    }
    fn binary(&self, f: Binary, a: &Text, b: &Text) -> Text {
        let (a, b) = (&a.text, &b.text);
        Text::atom(match f {
            Binary::Atan2 => format!("atan2({a}, {b})"),
            Binary::Powf => format!("pow({a}, {b})"),
            Binary::Hypot => format!("length(vec2<f32>({a}, {b}))"),
            Binary::Min => format!("min({a}, {b})"),
            Binary::Max => format!("max({a}, {b})"),
        })
    }
    fn select(
        &self,
        comparison: Comparison,
        [left, right]: [&Text; 2],
        then: &Text,
        otherwise: &Text,
    ) -> Text {
        let sign = comparison_sign(comparison);
        let [left, right] = [left, right].map(|text| self.fit(text, Level::Sum));
        Text::atom(format!("select({}, {}, {left} {sign} {right})", otherwise.text, then.text))
    }
    fn assign(&self, name: &Text, value: &Text) -> String {
        format!("let {} = {};", name.text, value.text)
    }
    fn assign_sin_cos(&self, [sin, cos]: [&Text; 2], angle: &Text) -> Option<String> {
        let (sin, cos, angle) = (&sin.text, &cos.text, &angle.text);
        Some(format!(
            "let {sin}{cos} = sin_cos({angle}); let {sin} = {sin}{cos}.x; let {cos} = {sin}{cos}.y;"
        ))
    }
    fn number(&self, n: Number) -> Text {
        let text = literal(n);
        let is_float = text.contains(['.', 'e']);
        let level = if text.starts_with('-') { Level::Sum } else { Level::Atom };
        Text::new(format!("{text}{}f", if is_float { "" } else { ".0" }), level)
    }
}

impl Language for Wgsl {
    fn constant(&self, index: usize) -> Text {
        Text::atom(format!("k[{index}]"))
    }
    fn function(&self, function: &Function) -> String {
        let (parameters, constants) = (array(self.parameters), array(function.hoisted.1.len()));
        let (state, inputs, n) = (array(self.coordinates), array(self.inputs), self.coordinates);
        let out = array(n + 1);
        let lines =
            |lines: &[Line]| lines.iter().map(|line| format!("  {}\n", line.text)).collect::<String>();
        let stored = |name: &str, values: &[Text]| {
            let values = values.iter().enumerate();
            values.map(|(i, value)| format!("  {name}[{i}] = {};\n", value.text)).collect::<String>()
        };
        let (values, pivots) = function.body.1.split_at(n);
        let checks = pivots.chunks(2).zip(&self.checked).filter(|(_, checked)| **checked);
        let tests = checks.map(|(pair, _)| {
            let (pivot, bound) = (&pair[0].text, format!("{PIVOT_TOLERANCE}*abs({})", pair[1].text));
            if self.positive { format!("{pivot} > {bound}") } else { format!("abs({pivot}) > {bound}") }
        });
        let tests: Vec<String> = tests.collect();
        let exists = match tests.is_empty() {
            true => "1.0f".to_owned(),
            false => format!("select(0.0f, 1.0f, {})", tests.join(" && ")),
        };
        format!(
            "fn model_constants(p: {parameters}) -> {constants} {{\n  var k: {constants};\n{}{}  return k;\n}}\n\n\
             fn model_accelerations(p: {parameters}, k: {constants}, t: f32, q: {state}, u: {state}, \
             w: {inputs}) -> {out} {{\n  var out: {out};\n{}{}  out[{n}] = {exists};\n  return out;\n}}\n",
            lines(&function.hoisted.0),
            stored("k", &function.hoisted.1),
            lines(&function.body.0),
            stored("out", values),
        )
    }
}

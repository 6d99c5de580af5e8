//! Models of further kinds, in cases from [`FIRST`] on: bodies on one another in the plane and in space, rows
//! that repeat others, generalized speeds beside constraints, friction by reactions; with units and without.
//!
//! They are made of the library's words, not of random expressions: those are what the other cases are for.

mod friction;
mod links;
mod planar;
mod spatial;
mod speeds;

use std::fmt::Write;

use crate::expressions::mentions;
use crate::random::Random;

/// The first case of these kinds.
pub const FIRST: u64 = 1_000_000;

/// A model that is being written.
struct Draft<'a> {
    r: &'a mut Random,
    /// Name and unit, `a: rad`, with a length for arrays, `x: [m; 3]`.
    coordinates: Vec<(String, Of)>,
    speeds: Vec<(String, Of)>,
    inputs: Vec<(String, Of)>,
    functions: String,
    /// The rows of constraints so far.
    rows: usize,
}

/// A unit, or so many of it.
#[derive(Clone, Copy)]
enum Of {
    One(&'static str),
    Many(&'static str, usize),
}

/// What models may have as parameters, with units and values; those are declared that are read.
const PARAMETERS: [(&str, &str, f64); 9] = [
    ("m", "kg", 0.9),
    ("l", "m", 0.7),
    ("g", "m / s^2", 1.7),
    ("k", "N / m", 2.3),
    ("c", "N * s / m", 0.4),
    ("torque", "N * m", 0.6),
    ("mu", "1", 0.1),
    ("v", "m / s", 0.8),
    ("w", "rad / s", 0.9),
];

/// The model of a number.
pub fn model(case: u64) -> String {
    let mut random = Random::new(case.wrapping_mul(0xd6e8_feb8_6659_fd93) ^ 0x1b87_3593);
    let mut draft = Draft {
        r: &mut random,
        coordinates: Vec::new(),
        speeds: Vec::new(),
        inputs: Vec::new(),
        functions: String::new(),
        rows: 0,
    };
    match draft.r.below(6) {
        0 | 1 => draft.planar(),
        2 => draft.spatial(),
        3 => draft.links(),
        4 => draft.with_speeds(),
        _ => draft.rubbing(),
    }
    draft.finish()
}

impl Draft<'_> {
    /// A number, once in a while a whole one.
    fn number(&mut self, low: f64, high: f64) -> String {
        let tenth = low + (high - low) * self.r.below(101) as f64 / 100.0;
        if self.r.one_in(6) { format!("{:.1}", tenth.round()) } else { format!("{tenth:.3}") }
    }

    fn coordinate(&mut self, name: &str, of: Of) {
        self.coordinates.push((name.to_owned(), of));
    }

    /// A function with a role; it reads `q`.
    fn function(&mut self, attribute: &str, name: &str, returns: &str, body: &str) {
        let attribute = match attribute {
            "" => String::new(),
            "redundant" => "    #[holonomic]\n    #[redundant]\n".to_owned(),
            role => format!("    #[{role}]\n"),
        };
        let _ = writeln!(
            self.functions,
            "{attribute}    fn {name}(&self, q: &Coordinates<Self>) -> {returns} {{\n        {body}\n    }}"
        );
    }

    /// A function that takes the number of a body.
    fn of_body(&mut self, name: &str, returns: &str, body: &str) {
        let _ = writeln!(
            self.functions,
            "    fn {name}(&self, q: &Coordinates<Self>, i: usize) -> {returns} {{\n        {body}\n    }}"
        );
    }

    /// A force along something, and its parts for the judge.
    fn along(&mut self, name: &str, place: &str, size: &str) {
        self.function("", &format!("{name}_place"), "Expr", place);
        self.function("", &format!("{name}_size"), "Expr", size);
        let body = format!("Force::along(self.{name}_place(q), self.{name}_size(q))");
        self.function("force", name, "Force", &body);
    }

    /// A force at a point, likewise.
    fn at(&mut self, name: &str, vector: &str, place: &str, size: &str) {
        self.function("", &format!("{name}_place"), vector, place);
        self.function("", &format!("{name}_size"), vector, size);
        let body = format!("Force::at(self.{name}_place(q), self.{name}_size(q))");
        self.function("force", name, "Force", &body);
    }

    /// A sum over bodies, by a loop or term by term.
    fn over(&mut self, n: usize, term: &str) -> String {
        if self.r.one_in(2) {
            return format!(
                "let mut sum = Expr::ZERO;\n        for i in 0..{n} \
                {{\n            sum += {term};\n        }}\n        sum"
            );
        }
        let each: Vec<String> = (0..n).map(|i| term.replace("q, i)", &format!("q, {i})"))).collect();
        let each: Vec<String> =
            each.iter().enumerate().map(|(i, t)| t.replace("[i]", &format!("[{i}]"))).collect();
        each.join("\n            + ")
    }

    fn finish(self) -> String {
        let units = !self.r.one_in(3);
        let list = |all: &[(String, Of)]| {
            let one = |(name, of): &(String, Of)| match of {
                Of::One(unit) if units => format!("{name}: {unit}"),
                Of::One(_) => name.clone(),
                Of::Many(unit, n) if units => format!("{name}: [{unit}; {n}]"),
                Of::Many(_, n) => format!("{name}: [_; {n}]"),
            };
            all.iter().map(one).collect::<Vec<_>>().join(", ")
        };
        let is_read = |name: &str| mentions(&self.functions, &format!("self.{name}"));
        let read: Vec<(&str, &str, f64)> =
            PARAMETERS.into_iter().filter(|(name, ..)| is_read(name)).collect();
        let nominal = self.r.one_in(2);
        let values: Vec<String> = read
            .iter()
            .map(|(name, _, value)| {
                // A nominal value is one near which values are.
                let off = 0.0003 + 0.2 * self.r.below(1000) as f64 / 1000.0;
                format!("{name}: {:.4}", value * (0.9 + off))
            })
            .collect();
        let mut text = format!("// model: Subject {{ {} }}\n", values.join(", "));
        text += "#![allow(nonstandard_style, unused_parens, clippy::all)]\nuse ::dynamics::prelude::*;\n";
        let _ =
            writeln!(text, "#[derive(Clone, Debug, Dynamics)]\n#[coordinates({})]", list(&self.coordinates));
        if !self.speeds.is_empty() {
            let _ = writeln!(text, "#[speeds({})]", list(&self.speeds));
        }
        if !self.inputs.is_empty() {
            let _ = writeln!(text, "#[inputs({})]", list(&self.inputs));
        }
        if units && !read.is_empty() {
            let all: Vec<String> = read.iter().map(|(name, unit, _)| format!("{name}: {unit}")).collect();
            let _ = writeln!(text, "#[units({})]", all.join(", "));
        }
        if nominal && !read.is_empty() {
            let all: Vec<String> =
                read.iter().map(|(name, _, value)| format!("{name} = {value:?}")).collect();
            let _ = writeln!(text, "#[nominal({})]", all.join(", "));
        }
        text += "pub struct Subject {\n";
        read.iter().for_each(|(name, ..)| text += &format!("    pub {name}: f64,\n"));
        format!("{text}}}\n#[dynamics]\nimpl Subject {{\n{}}}\n", self.functions)
    }
}

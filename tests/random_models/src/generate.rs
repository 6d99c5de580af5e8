//! Random whole models, valid ones: a struct with parameters and coordinates, and functions of every role.

mod declare;
mod energies;
mod further;
mod roles;

use std::fmt::Write;

use crate::cases::Expectation;
use crate::expressions::{Helper, Kind, Scope, Writer, mentions};
use crate::names::{GENERATED, MATHEMATICAL, NASTY, NOT_FOR_COORDINATES, Names, PLAIN_STRUCTS, STRUCTS};
use crate::random::Random;

/// A coordinate or an array of such.
struct Coordinate {
    name: String,
    length: Option<usize>,
    /// `m`, or an angle.
    is_length: bool,
}

impl Coordinate {
    /// The jets that it holds.
    fn jets(&self) -> Vec<String> {
        match self.length {
            None if self.is_length => vec![format!("(q.{} / self.span)", self.name)],
            None => vec![format!("q.{}", self.name)],
            Some(length) => (0..length).map(|i| format!("q.{}[{i}]", self.name)).collect(),
        }
    }
}

/// A model that is being written.
struct Draft<'a> {
    r: &'a mut Random,
    names: Names,
    name: String,
    coordinates: Vec<Coordinate>,
    inputs: Vec<String>,
    /// Name and number of generalized speeds.
    speeds: Option<(String, usize)>,
    scalars: Vec<String>,
    arrays: Vec<(String, usize)>,
    /// A vector of the plane, a vector of space, a matrix.
    shapes: Vec<(String, &'static str)>,
    /// Name and declaration.
    constants: Vec<(String, String)>,
    outside: String,
    functions: String,
    scope: Scope,
    either: bool,
    /// Units are declared: the dimensions of numbers are made by `SCALES`.
    units: bool,
    /// The energies, and the same model with a Lagrangian that differs from theirs by a total time
    /// derivative.
    energies: [String; 2],
}

/// What carries the dimensions of a model with units: everything else in it is a number.
const SCALES: [(&str, &str); 5] = [
    ("span", "m"),
    ("period", "s"),
    ("inertia", "kg * m^2"),
    ("strength", "N * m"),
    ("viscosity", "N * m * s"),
];

/// Where the energies stand among the functions.
const ENERGIES: &str = "    // energies\n";

/// A model and what is expected of it.
pub struct Generated {
    pub text: String,
    /// The same with another Lagrangian of the same motions.
    pub twin: Option<String>,
    pub expectation: Expectation,
}

/// A random model; what `further` draws stands beside it, or instead.
pub fn model(r: &mut Random, further: &mut Random) -> Generated {
    let name = if r.one_in(4) { r.pick(STRUCTS) } else { r.pick(PLAIN_STRUCTS) }.to_owned();
    let mut draft = Draft {
        names: Names::default(),
        name,
        coordinates: Vec::new(),
        inputs: Vec::new(),
        speeds: None,
        scalars: Vec::new(),
        arrays: Vec::new(),
        shapes: Vec::new(),
        constants: Vec::new(),
        outside: String::new(),
        functions: String::new(),
        scope: Scope::default(),
        either: false,
        units: false,
        energies: Default::default(),
        r,
    };
    draft.declare();
    if draft.r.one_in(40) {
        draft.chain();
    } else {
        draft.helpers();
        draft.energies();
        draft.others();
        std::mem::swap(draft.r, further);
        if draft.r.one_in(30) {
            draft.jointed();
        } else {
            draft.further();
        }
        std::mem::swap(draft.r, further);
    }
    draft.finish()
}

impl Draft<'_> {
    fn writer(&mut self) -> (Writer<'_>, Scope) {
        (Writer { r: self.r, wraps: &mut self.either }, self.scope.clone())
    }

    fn jet(&mut self, depth: usize) -> String {
        let (mut w, scope) = self.writer();
        w.jet(&scope, depth)
    }

    fn number(&mut self, depth: usize) -> String {
        let (mut w, scope) = self.writer();
        w.number(&scope, depth)
    }

    fn ty(&self, name: &str) -> String {
        self.scope.word(name)
    }

    /// A factor with this dimension, where the model has units.
    fn scale(&self, name: &str) -> String {
        if self.units { format!("self.{name} * ") } else { String::new() }
    }

    /// A name for a variable, unless a static of the module has it.
    fn free(&self, name: &str) -> String {
        if self.scope.taken.iter().any(|t| t == name) { format!("{name}_") } else { name.to_owned() }
    }

    fn signature(&self, name: &str, returns: &str) -> String {
        format!("    fn {name}(&self, q: &{}<Self>) -> {}", self.ty("Coordinates"), self.ty(returns))
    }

    fn function(&mut self, attribute: &str, name: &str, returns: &str, body: &str) {
        let body = self.reading(returns, body);
        let signature = self.signature(name, returns);
        let _ = writeln!(self.functions, "    #[{attribute}]\n{signature} {{\n        {body}\n    }}");
    }

    /// A body that reads `q`: an argument that is not read is a warning of rustc's.
    fn reading(&self, returns: &str, body: &str) -> String {
        let first = self.coordinates[0].jets()[0].clone();
        match returns {
            _ if mentions(body, "q") => body.to_owned(),
            "Expr" => format!("({first} + {body})"),
            _ => format!("({first} * {body})"),
        }
    }

    fn finish(mut self) -> Generated {
        let scales = self.read_scales();
        let mut text = self.values(&scales);
        text += "#![allow(nonstandard_style, unused_parens, clippy::all)]\n";
        text += "use ::dynamics::prelude::*;\n";
        text += &self.outside;
        text += &self.attributes(&scales);
        text += &self.fields(&scales);
        let _ = writeln!(text, "#[dynamics]\nimpl {} {{", self.name);
        let [first, second] = [0, 1].map(|i| format!("{text}{}}}\n", self.constants_and_functions(i)));
        let expectation = self.expectation();
        // The gauge needs a time.
        let has_time = !self.units || scales.iter().any(|(name, _)| *name == "period");
        let may_have_twin = expectation == Expectation::Runs && has_time && self.functions.contains(ENERGIES);
        let twin = (may_have_twin && self.r.one_in(8)).then_some(second);
        Generated { text: first, twin, expectation }
    }

    /// The scales that some function reads: what nothing reads is an error.
    fn read_scales(&self) -> Vec<(&'static str, &'static str)> {
        let is_read = |name: &str| [&self.functions, &self.energies[0]].iter().any(|text| reads(text, name));
        SCALES.into_iter().filter(|(name, _)| self.units && is_read(name)).collect()
    }

    /// A line of comment with the values of all parameters.
    fn values(&mut self, scales: &[(&str, &str)]) -> String {
        let mut values = Vec::new();
        // No value is a bound that an expression has (`.min(0.9)`): there is no derivative at a corner.
        let mut value = |from: f64| format!("{:.4}", from + 0.0003 + self.r.below(1000) as f64 / 1000.0);
        for p in &self.scalars {
            values.push(format!("{p}: {}", value(0.4)));
        }
        if self.units {
            values.extend(scales.iter().map(|(p, _)| format!("{p}: {}", value(0.6))));
        }
        for (p, length) in &self.arrays {
            let list: Vec<String> = (0..*length).map(|_| value(0.3)).collect();
            values.push(format!("{p}: [{}]", list.join(", ")));
        }
        for (p, shape) in &self.shapes {
            values.push(match *shape {
                "Vec2" => format!("{p}: ::dynamics::Vec2::new(0.3, -0.8)"),
                "Vec3" => format!("{p}: ::dynamics::Vec3::new(0.4, -0.2, 0.7)"),
                _ => format!(
                    "{p}: ::dynamics::Mat3::from([[1.0, 0.2, -0.1], [0.3, 0.8, 0.4], [-0.2, 0.1, 0.9]])"
                ),
            });
        }
        format!("// model: {} {{ {} }}\n", self.name, values.join(", "))
    }

    /// The derive and its attributes.
    fn attributes(&self, scales: &[(&str, &str)]) -> String {
        let coordinate = |c: &Coordinate| match c.length {
            None if c.is_length => format!("{}: m", c.name),
            None if self.units => format!("{}: rad", c.name),
            None => c.name.clone(),
            Some(n) if self.units => format!("{}: [rad; {n}]", c.name),
            Some(n) => format!("{}: [_; {n}]", c.name),
        };
        let coordinates: Vec<String> = self.coordinates.iter().map(coordinate).collect();
        let mut text = "#[derive(Clone, Debug, Dynamics)]\n".to_owned();
        let _ = writeln!(text, "#[coordinates({})]", coordinates.join(", "));
        if !self.inputs.is_empty() {
            let _ = writeln!(text, "#[inputs({})]", self.inputs.join(", "));
        }
        if let Some((name, length)) = &self.speeds {
            let length = if *length == 1 { String::new() } else { format!(": [_; {length}]") };
            let _ = writeln!(text, "#[speeds({name}{length})]");
        }
        if self.units {
            let units: Vec<String> = scales.iter().map(|(p, unit)| format!("{p}: {unit}")).collect();
            let _ = writeln!(text, "#[units({})]", units.join(", "));
        }
        text
    }

    /// The struct with its fields.
    fn fields(&self, scales: &[(&str, &str)]) -> String {
        let mut text = format!("pub struct {} {{\n", self.name);
        if self.units {
            scales.iter().for_each(|(p, _)| text += &format!("    pub {p}: f64,\n"));
        }
        for p in &self.scalars {
            let _ = writeln!(text, "    pub {p}: f64,");
        }
        for (p, length) in &self.arrays {
            let _ = writeln!(text, "    pub {p}: [f64; {length}],");
        }
        for (p, shape) in &self.shapes {
            let _ = writeln!(text, "    pub {p}: {}<f64>,", self.scope.word(shape));
        }
        text + "}\n"
    }

    /// The contents of the impl block, with the energies or those of the twin.
    fn constants_and_functions(&self, energies: usize) -> String {
        let functions = self.functions.replace(ENERGIES, &self.energies[energies]);
        // A constant that nothing reads is a warning of rustc's.
        let is_read = |name: &str| mentions(&functions, &format!("Self::{name}"));
        let read = self.constants.iter().filter(|(name, _)| is_read(name));
        let constants: String = read.map(|(_, line)| line.as_str()).collect();
        constants + &functions
    }

    fn expectation(&self) -> Expectation {
        let is_generated = |text: &&String| text.contains(&format!("fn {GENERATED}("));
        match [&self.functions, &self.energies[0]].iter().any(is_generated) {
            _ if self.either => Expectation::Either,
            true => Expectation::Refused,
            false => Expectation::Runs,
        }
    }
}

/// Whether a text reads this parameter.
fn reads(text: &str, parameter: &str) -> bool {
    mentions(text, &format!("self.{parameter}"))
}

/// Terms over lines.
fn sum(terms: &[String]) -> String {
    terms.join("\n            + ")
}

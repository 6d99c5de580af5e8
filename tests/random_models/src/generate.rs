//! Random whole models, valid ones: a struct with parameters and coordinates, and functions of every role.

use std::fmt::Write;

use crate::cases::Expectation;
use crate::expressions::{Helper, Kind, Scope, Writer, mentions};
use crate::names::{MATHEMATICAL, NASTY, NOT_FOR_COORDINATES, Names, PLAIN_STRUCTS, STRUCTS};
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
    scalars: Vec<String>,
    arrays: Vec<(String, usize)>,
    constants: String,
    outside: String,
    functions: String,
    scope: Scope,
    either: bool,
    /// Units are declared: the dimensions of numbers are made by `SCALES`.
    units: bool,
    /// The energies, and the same model with a Lagrangian that differs from theirs by a total time derivative.
    energies: [String; 2],
}

/// What carries the dimensions of a model with units: everything else in it is a number.
const SCALES: [(&str, &str); 5] =
    [("span", "m"), ("period", "s"), ("inertia", "kg * m^2"), ("strength", "N * m"), ("viscosity", "N * m * s")];

/// Where the energies stand among the functions.
const ENERGIES: &str = "    // energies\n";

/// A model and what is expected of it.
pub struct Generated {
    pub text: String,
    /// The same with another Lagrangian of the same motions.
    pub twin: Option<String>,
    pub expectation: Expectation,
}

/// A random model.
pub fn model(r: &mut Random) -> Generated {
    let name = if r.one_in(4) { r.pick(STRUCTS) } else { r.pick(PLAIN_STRUCTS) }.to_owned();
    let mut draft = Draft {
        names: Names::default(),
        name,
        coordinates: Vec::new(),
        inputs: Vec::new(),
        scalars: Vec::new(),
        arrays: Vec::new(),
        constants: String::new(),
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
    }
    draft.finish()
}

impl Draft<'_> {
    fn declare(&mut self) {
        self.names.keep("t");
        self.scope.hidden = vec![self.name.clone()];
        self.units = self.r.one_in(4);
        if self.units {
            SCALES.iter().for_each(|(name, _)| self.names.keep(name));
            self.scope.period = Some("self.period".to_owned());
        }
        let count = [1, 1, 2, 2, 3][self.r.below(5)];
        for _ in 0..count {
            let name = self.coordinate_name();
            let length = self.r.one_in(6).then(|| 2 + self.r.below(2));
            let is_length = self.units && length.is_none() && self.r.one_in(2);
            self.coordinates.push(Coordinate { name, length, is_length });
        }
        for _ in 0..1 + self.r.below(3) {
            let name = self.names.fresh(self.r);
            self.scalars.push(name);
        }
        if self.r.one_in(3) {
            let name = self.names.fresh(self.r);
            self.arrays.push((name, 2 + self.r.below(2)));
        }
        if self.r.one_in(3) {
            let name = self.coordinate_name();
            self.inputs.push(name);
        }
        if self.r.one_in(3) {
            self.block_constants();
        }
        if self.r.one_in(4) {
            self.surroundings();
        }
        let (scope, coordinates) = (&mut self.scope, &self.coordinates);
        for c in coordinates {
            match c.length {
                None => scope.jets.extend(c.jets()),
                Some(length) => scope.jet_arrays.push((format!("q.{}", c.name), length)),
            }
        }
        scope.numbers.extend(self.scalars.iter().map(|p| format!("self.{p}")));
        scope.number_arrays.extend(self.arrays.iter().map(|(p, n)| (format!("self.{p}"), *n)));
        if self.r.one_in(3) {
            self.scope.jets.push(if self.units { "(q.t / self.period)" } else { "q.t" }.to_owned());
        }
    }

    /// A name that is not one of a state's own.
    fn coordinate_name(&mut self) -> String {
        loop {
            let name = self.names.fresh(self.r);
            if !NOT_FOR_COORDINATES.contains(&name.as_str()) {
                return name;
            }
        }
    }

    /// Constants of the block, some of them called as std's.
    fn block_constants(&mut self) {
        let name =
            if self.r.one_in(2) { self.r.pick(MATHEMATICAL) } else { self.r.pick(&["K", "RATIO", "X", "Q", "T", "N"]) };
        let value = [2.1, 0.3, 1.7, 3.0][self.r.below(4)];
        let _ = writeln!(self.constants, "    const {name}: f64 = {value:?};");
        self.names.keep(name);
        self.scope.numbers.push(format!("Self::{name}"));
    }

    /// What stands around a model in its module.
    fn surroundings(&mut self) {
        let allow = "#[allow(dead_code, nonstandard_style, unused_imports)]\n";
        match self.r.below(6) {
            // A constant of the module, called as one of std's or not.
            0 => {
                let name = self.r.pick(MATHEMATICAL);
                let _ = writeln!(self.outside, "{allow}const {name}: f64 = 2.75;");
                self.scope.numbers.push(name.to_owned());
                self.either = true;
            }
            1 => {
                let (module, name) = (self.r.pick(&["consts", "material", "values"]), self.r.pick(MATHEMATICAL));
                let _ = writeln!(self.outside, "{allow}mod {module} {{ pub const {name}: f64 = 2.75; }}");
                self.scope.numbers.push(format!("{module}::{name}"));
                self.either = true;
            }
            2 => {
                let name = self.r.pick(MATHEMATICAL);
                let _ = writeln!(self.outside, "use std::f64::consts::{name};");
                self.scope.numbers.push(name.to_owned());
                // Of those that are imported one has to be read.
                let _ = writeln!(self.outside, "{allow}const READ: f64 = {name};");
            }
            3 | 4 => {
                for _ in 0..3 {
                    let name = self.r.pick(NASTY);
                    if self.names.is_free(name)
                        && !["core", "std", "f64", "usize", "bool", "dynamics", "r#type"].contains(&name)
                    {
                        let _ = match self.r.below(3) {
                            0 => writeln!(self.outside, "{allow}static {name}: f64 = 0.5;"),
                            1 => writeln!(self.outside, "{allow}const {name}: f64 = 0.5;"),
                            _ => writeln!(self.outside, "{allow}fn {name}() {{}}"),
                        };
                        self.names.keep(name);
                        self.scope.taken.push(name.to_owned());
                    }
                }
            }
            _ => {
                let name = self.r.pick(STRUCTS);
                let word = [
                    "Expr",
                    "Coordinates",
                    "Force",
                    "Vec2",
                    "Vec3",
                    "Mat3",
                    "Dynamics",
                    "dynamics",
                    "std",
                    "core",
                    "Clone",
                    "Debug",
                ];
                if name != self.name && !word.contains(&name) {
                    let _ = writeln!(self.outside, "{allow}struct {name};");
                }
            }
        }
    }

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

    /// Functions without a role, each may call those before it.
    fn helpers(&mut self) {
        for _ in 0..self.r.below(4) {
            let name = self.names.fresh(self.r);
            let takes_coordinates = !self.r.one_in(4);
            let returns = match self.r.below(6) {
                0 => Kind::Number,
                1 => Kind::Vec2,
                2 => Kind::Vec3,
                _ => Kind::Jet,
            };
            let mut arguments = Vec::new();
            let mut scope = self.scope.clone();
            if !takes_coordinates || returns == Kind::Number {
                scope.jets.clear();
                scope.jet_arrays.clear();
            }
            let takes_coordinates = takes_coordinates && returns != Kind::Number;
            let mut list = vec!["&self".to_owned()];
            if takes_coordinates {
                list.push(format!("q: &{}<Self>", self.ty("Coordinates")));
            }
            for k in 0..self.r.below(3) {
                let argument = match self.r.below(3) {
                    _ if returns == Kind::Number && k == 0 => Kind::Count,
                    0 if returns != Kind::Number => Kind::Jet,
                    1 => Kind::Number,
                    _ => Kind::Count,
                };
                let options = ["i", "s", "a", "x", "angle", "v0", "index", "w", "m", "r#type", "at"];
                let name = options[(self.r.below(options.len() - 2) + k) % options.len()].to_owned();
                if list.iter().any(|l| l.starts_with(&format!("{name}:"))) || self.scope.taken.contains(&name) {
                    continue;
                }
                let (ty, to) = match argument {
                    Kind::Jet => (self.ty("Expr"), &mut scope.jets),
                    Kind::Number => ("f64".to_owned(), &mut scope.numbers),
                    _ => ("usize".to_owned(), &mut scope.counts),
                };
                list.push(format!("{name}: {ty}"));
                to.push(name);
                arguments.push(argument);
            }
            let depth = 1 + self.r.below(2);
            let mut w = Writer { r: self.r, wraps: &mut self.either };
            let (body, ty) = match returns {
                Kind::Number => (w.number(&scope, depth), "f64".to_owned()),
                Kind::Vec2 => (w.vec2(&scope, depth), self.scope.word("Vec2")),
                Kind::Vec3 => (w.vec3(&scope, depth), self.scope.word("Vec3")),
                _ => (w.jet(&scope, depth), self.scope.word("Expr")),
            };
            // What is declared is used.
            let mut body = body;
            for (k, l) in list.iter().enumerate().skip(1) {
                let argument = l.split(':').next().unwrap_or_default();
                if !mentions(&body, argument) {
                    body = match (k, l.split(": ").nth(1).unwrap_or_default()) {
                        (_, "f64") if matches!(returns, Kind::Vec2 | Kind::Vec3) => format!("({argument} * {body})"),
                        (_, "f64") => format!("({argument} + {body})"),
                        (_, "usize") if matches!(returns, Kind::Vec2 | Kind::Vec3) => {
                            format!("({argument} as f64 * {body})")
                        }
                        (_, "usize") => format!("({argument} as f64 + {body})"),
                        _ if matches!(returns, Kind::Vec2 | Kind::Vec3) && argument != "q" => {
                            format!("({argument} * {body})")
                        }
                        _ if argument != "q" => format!("({argument} + {body})"),
                        _ => {
                            let first = self.coordinates[0].jets()[0].clone();
                            let operator = if matches!(returns, Kind::Vec2 | Kind::Vec3) { "*" } else { "+" };
                            format!("({first} {operator} {body})")
                        }
                    };
                }
            }
            let _ = writeln!(self.functions, "    fn {name}({}) -> {ty} {{\n        {body}\n    }}", list.join(", "));
            self.scope.helpers.push(Helper { name, takes_coordinates, arguments, returns });
        }
    }

    /// T and V, every coordinate with inertia, every parameter read.
    fn energies(&mut self) {
        let mut kinetic = Vec::new();
        let jets: Vec<String> = self.coordinates.iter().flat_map(Coordinate::jets).collect();
        for c in &self.coordinates {
            let weight = match self.r.below(3) {
                0 => format!("self.{}", self.scalars[self.r.below(self.scalars.len())]),
                1 => "0.8".to_owned(),
                _ => "1.3".to_owned(),
            };
            match c.length {
                None => kinetic.push(format!("0.5 * {weight} * {}.dt().powi(2)", c.jets()[0])),
                Some(_) if self.r.one_in(2) => {
                    kinetic.extend(c.jets().iter().map(|j| format!("0.5 * {weight} * {j}.dt() * {j}.dt()")));
                }
                Some(length) => {
                    let zero = format!("{}::ZERO", self.scope.word("Expr"));
                    let (sum, i) = (self.free("sum"), self.free("i"));
                    kinetic.push(format!(
                        "({{ let mut {sum} = {zero}; for {i} in 0..{length} {{ {sum} += 0.5 * {weight} * q.{}[{i}].dt().powi(2); }} {sum} }})",
                        c.name
                    ));
                }
            }
        }
        // Places whose velocities couple the coordinates; products of velocities, which are derived by the momenta.
        if !self.r.one_in(3) {
            let depth = 1 + self.r.below(2);
            let (mut w, scope) = self.writer();
            let place = if w.r.one_in(2) { w.vec2(&scope, depth) } else { w.vec3(&scope, depth) };
            let weight = self.number(0).replace('-', "");
            kinetic.push(format!("0.5 * {weight} * {place}.dt().norm_squared()"));
        }
        if self.r.one_in(4) {
            let (a, b) = (&jets[self.r.below(jets.len())], &jets[self.r.below(jets.len())]);
            let (a, b) = (a.clone(), b.clone());
            let factor = self.jet(1);
            kinetic.push(format!("0.2 * {factor}.cos() * {a}.dt() * {b}.dt()"));
        }
        if self.r.one_in(8) {
            let a = jets[self.r.below(jets.len())].clone();
            let factor = self.jet(1);
            kinetic.push(format!("0.3 * {factor}.powi(2) * {a}.dt().powi(2)"));
        }
        // Masses must not have corners.
        self.scope.corners = self.r.one_in(3);
        let depth = 1 + self.r.below(3);
        let mut potential = vec![self.jet(depth)];
        for p in &self.scalars {
            potential.push(format!("self.{p} * {}.sin()", jets[self.r.below(jets.len())]));
        }
        for (p, length) in &self.arrays {
            for i in 0..*length {
                potential.push(format!("self.{p}[{i}] * {}.cos()", jets[self.r.below(jets.len())]));
            }
        }
        // Every coordinate is pulled back: no motion leaves the range of the states.
        let first = jets.iter().map(|j| format!("0.4 * {j}.powi(2)")).collect::<Vec<_>>().join(" + ");
        potential.push(first);
        let dimension =
            |scale: String, terms: String| if scale.is_empty() { terms } else { format!("{scale}({terms})") };
        let t = dimension(self.scale("inertia"), sum(&kinetic));
        let v = dimension(self.scale("strength"), sum(&potential));
        let mut role = || if self.r.one_in(3) { self.names.fresh(self.r) } else { String::new() };
        let (first, second) = (role(), role());
        let name = |chosen: String, usual: &str, names: &mut Names| {
            if !chosen.is_empty() {
                chosen
            } else if names.is_free(usual) {
                names.keep(usual);
                usual.to_owned()
            } else {
                format!("{usual}_of_it")
            }
        };
        let first = name(first, "kinetic", &mut self.names);
        let second = name(second, "potential", &mut self.names);
        // The gauge is d/dt of a function of the coordinates: momenta change, motions do not.
        let gauge = self.jet(1);
        let gauge = if self.units { format!("self.inertia * {gauge} / self.period") } else { gauge };
        let before = std::mem::take(&mut self.functions);
        self.function("lagrangian", &first, "Expr", &format!("{t} - ({v}) + ({gauge}).dt()"));
        let twin = std::mem::take(&mut self.functions);
        if self.r.one_in(6) {
            self.function("lagrangian", &first, "Expr", &format!("{t} - ({v})"));
        } else {
            self.function("kinetic", &first, "Expr", &t);
            self.function("potential", &second, "Expr", &v);
        }
        self.energies = [std::mem::replace(&mut self.functions, before), twin];
        self.functions += ENERGIES;
    }

    fn others(&mut self) {
        let jets: Vec<String> = self.coordinates.iter().flat_map(Coordinate::jets).collect();
        for input in std::mem::take(&mut self.inputs) {
            self.force(Some(&input));
            self.inputs.push(input);
        }
        if self.r.one_in(3) {
            self.force(None);
        }
        if self.r.one_in(3) {
            let name = self.names.fresh(self.r);
            let j = jets[self.r.below(jets.len())].clone();
            let k = self.number(1);
            let scale = self.scale("viscosity");
            let body = format!("0.3 * {scale}(1.0 + {k} * {k}) * {j}.dt().powi(2)");
            self.function("dissipation", &name, "Expr", &body);
        }
        if self.r.one_in(4) && jets.len() > 1 {
            self.constraint(&jets);
        }
        self.unused_helpers(&jets);
        for _ in 0..1 + self.r.below(2) {
            let name = if self.r.one_in(40) {
                // The name of a coordinate: an error.
                self.either = true;
                self.coordinates[0].name.clone()
            } else {
                self.names.fresh(self.r)
            };
            if self.functions.contains(&format!("fn {name}(")) {
                continue;
            }
            self.scope.rates = true;
            let depth = 2 + self.r.below(2);
            let (mut w, scope) = self.writer();
            match w.r.below(5) {
                0 => {
                    let body = w.vec2(&scope, depth);
                    self.function("output", &name, "Vec2", &body);
                }
                1 => {
                    let body = w.vec3(&scope, depth);
                    self.function("output", &name, "Vec3", &body);
                }
                _ => {
                    let body = w.jet(&scope, depth);
                    self.function("output", &name, "Expr", &body);
                }
            }
            self.scope.rates = false;
        }
        if self.r.one_in(4) {
            let name = self.names.fresh(self.r);
            let body = format!("{} - {}", self.jet(1), self.number(0));
            let body = format!("{} + {body}", jets[0]);
            self.function("event", &name, "Expr", &body);
        }
    }

    fn called(&self, name: &str) -> bool {
        [&self.functions, &self.energies[0]].iter().any(|text| text.contains(&format!("self.{name}(")))
    }

    /// An output of what no function called: what is never used is a warning of rustc's.
    fn unused_helpers(&mut self, jets: &[String]) {
        let helpers = self.scope.helpers.clone();
        let unused: Vec<&Helper> = helpers.iter().filter(|h| !self.called(&h.name)).collect();
        if unused.is_empty() {
            return;
        }
        let mut terms = vec![jets[0].clone()];
        for helper in unused {
            let (mut w, scope) = self.writer();
            let call = w.call(&scope, helper, 1);
            terms.push(match helper.returns {
                Kind::Vec2 | Kind::Vec3 => format!("{call}.y"),
                _ => call,
            });
        }
        let name = self.names.fresh(self.r);
        self.function("output", &name, "Expr", &sum(&terms));
    }

    /// A force along something, once more as its parts for the judge.
    fn force(&mut self, input: Option<&str>) {
        let name = self.names.fresh(self.r);
        let plain = name.trim_start_matches("r#").to_owned();
        let jets: Vec<String> = self.coordinates.iter().flat_map(Coordinate::jets).collect();
        let place = if self.r.one_in(2) {
            jets[self.r.below(jets.len())].clone()
        } else {
            format!("(1.3 * {} + 0.4 * {}.sin())", jets[0], self.jet(1))
        };
        self.scope.rates = true;
        let size = self.jet(2);
        self.scope.rates = false;
        let (scale, size) = (self.scale("strength"), self.reading("Expr", &size));
        let size = input.map_or(format!("{scale}(0.37 + {size})"), |w| format!("q.{w} + {scale}({size})"));
        let (place_name, size_name) = (format!("{plain}_place"), format!("{plain}_size"));
        for (name, body) in [(&place_name, place), (&size_name, size)] {
            let (signature, body) = (self.signature(name, "Expr"), self.reading("Expr", &body));
            let _ = writeln!(self.functions, "{signature} {{\n        {body}\n    }}");
        }
        let force = self.ty("Force");
        let body = format!("{force}::along(self.{place_name}(q), self.{size_name}(q))");
        self.function("force", &name, "Force", &body);
    }

    fn constraint(&mut self, jets: &[String]) {
        let name = self.names.fresh(self.r);
        let (a, b) = (jets[0].clone(), jets[1 + self.r.below(jets.len() - 1)].clone());
        if self.r.one_in(3) {
            let body = format!("{a}.dt() - 0.7 * {b}.sin() * {b}.dt() - 0.2 * {a}.cos() * {b}.dt()");
            self.function("nonholonomic(integrable)", &name, "Expr", &body);
        } else {
            let inner = self.jet(1);
            let body = format!("{a} + 0.3 * {b}.powi(2) - 0.1 * {inner}.sin()");
            self.function("holonomic", &name, "Expr", &body);
        }
        if self.r.one_in(2) && self.names.is_free("held") {
            self.names.keep("held");
            let body = format!("q.reaction(Self::{name}) * {}", jets[0]);
            self.function("output", "held", "Expr", &body);
        }
    }

    /// Many equal masses and springs: constant M.
    fn chain(&mut self) {
        // Above 20 coordinates other code solves.
        let n = [1, 2, 3, 5, 21, 22][self.r.below(6)];
        self.units = false;
        self.coordinates =
            vec![Coordinate { name: self.coordinates[0].name.clone(), length: Some(n), is_length: false }];
        self.inputs.clear();
        self.arrays.clear();
        let x = format!("q.{}", self.coordinates[0].name);
        let (m, k) = (self.scalars[0].clone(), self.scalars[self.scalars.len() - 1].clone());
        self.scalars.retain(|p| *p == m || *p == k);
        self.constants.clear();
        self.outside.clear();
        self.either = false;
        let zero = format!("{}::ZERO", self.ty("Expr"));
        let t = format!(
            "let mut sum = {zero};\n        for i in 0..{n} {{\n            sum += 0.5 * self.{m} * {x}[i].dt().powi(2);\n        }}\n        sum"
        );
        let v = format!(
            "let mut sum = 0.5 * self.{k} * ({x}[0].powi(2) + {x}[{}].powi(2));\n        for i in 1..{n} {{\n            sum += 0.5 * self.{k} * ({x}[i] - {x}[i - 1]).powi(2);\n        }}\n        sum",
            n - 1
        );
        self.function("kinetic", "moving", "Expr", &t);
        self.function("potential", "springs", "Expr", &v);
        if self.r.one_in(3) {
            let d = format!(
                "let mut sum = {zero};\n        for i in 0..{n} {{\n            sum += 0.1 * {x}[i].dt().powi(2);\n        }}\n        sum"
            );
            self.function("dissipation", "dampers", "Expr", &d);
        }
    }

    fn finish(self) -> Generated {
        // What nothing reads is an error.
        let scales: Vec<(&str, &str)> = SCALES
            .into_iter()
            .filter(|(name, _)| self.units && [&self.functions, &self.energies[0]].iter().any(|text| reads(text, name)))
            .collect();
        let mut text = String::new();
        let mut values = Vec::new();
        for p in &self.scalars {
            values.push(format!("{p}: {:.3}", 0.4 + self.r.below(1000) as f64 / 1000.0));
        }
        if self.units {
            values.extend(scales.iter().map(|(p, _)| format!("{p}: {:.3}", 0.6 + self.r.below(1000) as f64 / 1000.0)));
        }
        for (p, length) in &self.arrays {
            let list: Vec<String> =
                (0..*length).map(|_| format!("{:.3}", 0.3 + self.r.below(1000) as f64 / 1000.0)).collect();
            values.push(format!("{p}: [{}]", list.join(", ")));
        }
        let _ = writeln!(text, "// model: {} {{ {} }}", self.name, values.join(", "));
        text += "#![allow(nonstandard_style, unused_parens, clippy::all)]\n";
        text += "use ::dynamics::prelude::*;\n";
        text += &self.outside;
        let coordinates: Vec<String> = self
            .coordinates
            .iter()
            .map(|c| match c.length {
                None if c.is_length => format!("{}: m", c.name),
                None if self.units => format!("{}: rad", c.name),
                None => c.name.clone(),
                Some(n) if self.units => format!("{}: [rad; {n}]", c.name),
                Some(n) => format!("{}: [_; {n}]", c.name),
            })
            .collect();
        text += "#[derive(Clone, Debug, Dynamics)]\n";
        let _ = writeln!(text, "#[coordinates({})]", coordinates.join(", "));
        if !self.inputs.is_empty() {
            let _ = writeln!(text, "#[inputs({})]", self.inputs.join(", "));
        }
        if self.units {
            let units: Vec<String> = scales.iter().map(|(p, unit)| format!("{p}: {unit}")).collect();
            let _ = writeln!(text, "#[units({})]", units.join(", "));
        }
        let _ = writeln!(text, "pub struct {} {{", self.name);
        if self.units {
            scales.iter().for_each(|(p, _)| text += &format!("    pub {p}: f64,\n"));
        }
        for p in &self.scalars {
            let _ = writeln!(text, "    pub {p}: f64,");
        }
        for (p, length) in &self.arrays {
            let _ = writeln!(text, "    pub {p}: [f64; {length}],");
        }
        let _ = writeln!(text, "}}\n#[dynamics]\nimpl {} {{", self.name);
        // A constant that nothing reads is a warning of rustc's.
        let mut constants = self.constants;
        if let Some(name) = constants.trim().strip_prefix("const ").and_then(|c| c.split(':').next())
            && ![&self.functions, &self.energies[0]].iter().any(|text| mentions(text, &format!("Self::{name}")))
        {
            constants.clear();
        }
        let whole = |energies: &str| format!("{text}{constants}{}}}\n", self.functions.replace(ENERGIES, energies));
        let (first, second) = (whole(&self.energies[0]), whole(&self.energies[1]));
        let runs = !self.either;
        let twin = (runs && self.functions.contains(ENERGIES) && self.r.one_in(8)).then_some(second);
        Generated { text: first, twin, expectation: if runs { Expectation::Runs } else { Expectation::Either } }
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

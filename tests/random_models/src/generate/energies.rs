//! Helpers and energies.

use std::fmt::Write;

use super::*;

impl Draft<'_> {
    /// Functions without a role, each may call those before it.
    pub(super) fn helpers(&mut self) {
        for _ in 0..self.r.below(4) {
            let name = self.names.function(self.r);
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
                if list.iter().any(|l| l.starts_with(&format!("{name}:"))) || self.scope.taken.contains(&name)
                {
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
                // A loop's index of the same name hides the argument.
                if !mentions(&body, argument) || body.contains(&format!("for {argument} in ")) {
                    body = match (k, l.split(": ").nth(1).unwrap_or_default()) {
                        (_, "f64") if matches!(returns, Kind::Vec2 | Kind::Vec3) => {
                            format!("({argument} * {body})")
                        }
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
            let _ = writeln!(
                self.functions,
                "    fn {name}({}) -> {ty} {{\n        {body}\n    }}",
                list.join(", ")
            );
            self.scope.helpers.push(Helper { name, takes_coordinates, arguments, returns });
        }
    }

    /// T and V, every coordinate with inertia, every parameter read.
    pub(super) fn energies(&mut self) {
        let jets: Vec<String> = self.coordinates.iter().flat_map(Coordinate::jets).collect();
        let mut kinetic = self.inertia_of_coordinates();
        self.couple_velocities(&jets, &mut kinetic);
        // Masses must not have corners.
        self.scope.corners = self.r.one_in(3);
        let potential = self.potential_terms(&jets);
        let dimension =
            |scale: String, terms: String| if scale.is_empty() { terms } else { format!("{scale}({terms})") };
        let t = dimension(self.scale("inertia"), sum(&kinetic));
        let v = dimension(self.scale("strength"), sum(&potential));
        let [first, second] = self.energy_names();
        let gauge = self.gauge();
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

    /// Terms of T, one or several for each coordinate.
    fn inertia_of_coordinates(&mut self) -> Vec<String> {
        let mut kinetic = Vec::new();
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
                        "({{ let mut {sum} = {zero}; for {i} in 0..{length} \
                         {{ {sum} += 0.5 * {weight} * q.{}[{i}].dt().powi(2); }} {sum} }})",
                        c.name
                    ));
                }
            }
        }
        kinetic
    }

    /// Adds terms of T that couple coordinates: places, products of velocities (which are derived by the
    /// momenta), a body.
    fn couple_velocities(&mut self, jets: &[String], kinetic: &mut Vec<String>) {
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
        if !self.units && self.r.one_in(12) {
            let (a, b) = (jets[self.r.below(jets.len())].clone(), jets[self.r.below(jets.len())].clone());
            let (along, tilt) = (self.jet(1), self.number(0));
            let words = ["RigidBody", "vec3", "Inertia", "Frame", "Mat3"].map(|word| self.scope.word(word));
            let [body, vec3, inertia, frame, mat3] = words;
            kinetic.push(format!(
                "{body}::new(0.7, {vec3}(0.1, 0.2, -0.3), {inertia}::cuboid(0.7, 0.2, 0.5, 0.9), \
                 {frame}::new({vec3}({along}, 0.3, {b}), {mat3}::rotation_z({a}) * {mat3}::rotation_x({tilt} \
                 * {b}))).kinetic_energy()"
            ));
        }
    }

    /// Terms of V: every parameter is read, and every coordinate is pulled back.
    fn potential_terms(&mut self, jets: &[String]) -> Vec<String> {
        let depth = [1, 1, 2, 2, 3][self.r.below(5)];
        let mut potential = vec![self.jet(depth)];
        for p in &self.scalars {
            potential.push(format!("self.{p} * {}.sin()", jets[self.r.below(jets.len())]));
        }
        for (p, length) in &self.arrays {
            for i in 0..*length {
                potential.push(format!("self.{p}[{i}] * {}.cos()", jets[self.r.below(jets.len())]));
            }
        }
        for (p, shape) in &self.shapes {
            let element = if *shape == "Mat3" { "[(1, 2)]" } else { ".y" };
            potential.push(format!("self.{p}{element} * {}.sin()", jets[self.r.below(jets.len())]));
            // Of vectors every component has to be read.
            let all = match *shape {
                "Vec2" => format!("self.{p}.norm_squared()"),
                "Vec3" => format!("self.{p}.dot(self.{p})"),
                _ => format!("(self.{p}.transpose() * self.{p}).trace()"),
            };
            potential.push(format!("0.1 * {all} * {}.cos()", jets[self.r.below(jets.len())]));
        }
        // Every coordinate is pulled back: no motion leaves the range of the states.
        let first = jets.iter().map(|j| format!("0.4 * {j}.powi(2)")).collect::<Vec<_>>().join(" + ");
        potential.push(first);
        potential
    }

    /// Names of the functions of both energies: random ones, or else the usual ones.
    fn energy_names(&mut self) -> [String; 2] {
        let mut random = || self.r.one_in(3).then(|| self.names.function(self.r));
        let (first, second) = (random(), random());
        let mut or_usual = |name: Option<String>, usual: &str| match name {
            Some(name) => name,
            None if self.names.is_free(usual) => {
                self.names.keep(usual);
                usual.to_owned()
            }
            None => format!("{usual}_of_it"),
        };
        [or_usual(first, "kinetic"), or_usual(second, "potential")]
    }

    /// A function of the coordinates. Its time derivative, added to a Lagrangian, changes momenta and no
    /// motions.
    fn gauge(&mut self) -> String {
        let corners = std::mem::take(&mut self.scope.corners);
        let gauge = self.jet(1);
        self.scope.corners = corners;
        if self.units { format!("self.inertia * {gauge} / self.period") } else { gauge }
    }

    /// Begins anew, with arrays of these lengths as coordinates and two parameters at most.
    pub(super) fn alone(&mut self, coordinates: Vec<(String, usize)>) {
        self.units = false;
        let array = |(name, length)| Coordinate { name, length: Some(length), is_length: false };
        self.coordinates = coordinates.into_iter().map(array).collect();
        self.inputs.clear();
        self.arrays.clear();
        self.shapes.clear();
        let (m, k) = (self.scalars[0].clone(), self.scalars[self.scalars.len() - 1].clone());
        self.scalars.retain(|p| *p == m || *p == k);
        self.constants.clear();
        self.outside.clear();
        self.functions.clear();
        self.energies = Default::default();
        self.either = false;
    }

    /// Many equal masses and springs: constant M.
    pub(super) fn chain(&mut self) {
        // Above 20 coordinates other code solves.
        let n = [1, 2, 3, 5, 21, 22][self.r.below(6)];
        self.alone(vec![(self.coordinates[0].name.clone(), n)]);
        let x = format!("q.{}", self.coordinates[0].name);
        let (m, k) = (self.scalars[0].clone(), self.scalars[self.scalars.len() - 1].clone());
        let zero = format!("{}::ZERO", self.ty("Expr"));
        let t = format!(
            "let mut sum = {zero};\n        for i in 0..{n} \
             {{\n            sum += 0.5 * self.{m} * {x}[i].dt().powi(2);\n        }}\n        sum"
        );
        let v = format!(
            "let mut sum = 0.5 * self.{k} * ({x}[0].powi(2) + {x}[{}].powi(2));\n        for i in 1..{n} \
             {{\n            sum += 0.5 * self.{k} * ({x}[i] - {x}[i - 1]).powi(2);\n        }}\n        sum",
            n - 1
        );
        self.function("kinetic", "moving", "Expr", &t);
        self.function("potential", "springs", "Expr", &v);
        if self.r.one_in(3) {
            let d = format!(
                "let mut sum = {zero};\n        for i in 0..{n} \
                 {{\n            sum += 0.1 * {x}[i].dt().powi(2);\n        }}\n        sum"
            );
            self.function("dissipation", "dampers", "Expr", &d);
        }
    }
}

//! Forces, dampers, constraints, outputs, events.

use std::fmt::Write;

use super::*;

impl Draft<'_> {
    /// A size as a constant of the block, where something is that long.
    pub(super) fn size(&mut self) {
        let Some((array, length)) = self.arrays.first() else { return };
        if self.names.is_free("LINKS") && self.r.one_in(3) {
            self.constants.push(("LINKS".to_owned(), format!("    const LINKS: usize = {length};\n")));
            self.names.keep("LINKS");
            let (zero, first) =
                (format!("{}::ZERO", self.scope.word("Expr")), self.coordinates[0].jets()[0].clone());
            let sums = [
                format!(
                    "let mut all = {zero};\n        for l in 0..Self::LINKS \
                     {{\n            all += self.{array}[l] * {first};\n        }}\n        all"
                ),
                format!(
                    "let mut all = {zero};\n        for (l, weight) in self.{array}.iter().enumerate() \
                     {{\n            all += *weight * {first} * l as f64;\n        }}\n        all + \
                     Self::LINKS as f64"
                ),
                format!(
                    "let mut all = {zero};\n        for l in (0..self.{array}.len()).rev() \
                     {{\n            all += (self.{array}[l] + {first}).sin();\n        }}\n        all / \
                     Self::LINKS as f64"
                ),
                format!("let [first, ..] = self.{array};\n        first * {first} * Self::LINKS as f64"),
                format!("self.{array}.iter().sum::<f64>() * {first} * (Self::LINKS - 1) as f64"),
            ];
            let body = sums[self.r.below(sums.len())].clone();
            self.function("output", "over_links", "Expr", &body);
        }
    }

    pub(super) fn others(&mut self) {
        let jets: Vec<String> = self.coordinates.iter().flat_map(Coordinate::jets).collect();
        for input in std::mem::take(&mut self.inputs) {
            self.force(Some(&input));
            self.inputs.push(input);
        }
        if self.r.one_in(3) {
            if !self.units && self.r.one_in(2) { self.force_at() } else { self.force(None) }
        }
        if self.r.one_in(3) {
            let name = self.names.function(self.r);
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
        self.size();
        for _ in 0..[1, 1, 2][self.r.below(3)] {
            let name = if self.r.one_in(40) {
                // The name of a coordinate: an error.
                self.either = true;
                self.coordinates[0].name.clone()
            } else {
                self.names.function(self.r)
            };
            if self.functions.contains(&format!("fn {name}(")) {
                continue;
            }
            self.scope.rates = true;
            let depth = [1, 2, 2, 3][self.r.below(4)];
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
            let name = self.names.function(self.r);
            let body = format!("{} - {}", self.jet(1), self.number(0));
            let body = format!("{} + {body}", jets[0]);
            self.function("event", &name, "Expr", &body);
        }
    }

    pub(super) fn called(&self, name: &str) -> bool {
        [&self.functions, &self.energies[0]].iter().any(|text| text.contains(&format!("self.{name}(")))
    }

    /// An output of what no function called: what is never used is a warning of rustc's.
    pub(super) fn unused_helpers(&mut self, jets: &[String]) {
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
        let name = self.names.function(self.r);
        self.function("output", &name, "Expr", &sum(&terms));
    }

    /// A force along something, once more as its parts for the judge.
    pub(super) fn force(&mut self, input: Option<&str>) {
        let name = self.names.function(self.r);
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

    /// A force at a point, once more as its parts for the judge.
    pub(super) fn force_at(&mut self) {
        let name = self.names.function(self.r);
        let plain = name.trim_start_matches("r#").to_owned();
        let first = self.coordinates[0].jets()[0].clone();
        let vector = ["Vec2", "Vec3"][self.r.below(2)];
        let is_flat = vector == "Vec2";
        let (mut w, scope) = self.writer();
        let place = if is_flat { w.vec2(&scope, 1) } else { w.vec3(&scope, 1) };
        let size = if is_flat { w.vec2(&scope, 1) } else { w.vec3(&scope, 1) };
        let axis = format!("{first} * {}::X", self.ty(vector));
        for (part, body) in
            [("place", format!("{place} + {axis}")), ("size", format!("{size} + {}::X", self.ty(vector)))]
        {
            let signature = self.signature(&format!("{plain}_{part}"), vector);
            let body = if mentions(&body, "q") { body } else { format!("{body} * {first}.cos()") };
            let _ = writeln!(self.functions, "{signature} {{\n        {body}\n    }}");
        }
        let body = format!("{}::at(self.{plain}_place(q), self.{plain}_size(q))", self.ty("Force"));
        self.function("force", &name, "Force", &body);
    }

    pub(super) fn constraint(&mut self, jets: &[String]) {
        let name = self.names.function(self.r);
        let (a, b) = (jets[0].clone(), jets[1 + self.r.below(jets.len() - 1)].clone());
        if self.r.one_in(3) {
            let body = format!("{a}.dt() - 0.7 * {b}.sin() * {b}.dt() - 0.2 * {a}.cos() * {b}.dt()");
            self.function("nonholonomic(integrable)", &name, "Expr", &body);
        } else if jets.len() > 2 && self.r.one_in(2) {
            let (inner, c) = (self.jet(1), jets[2].clone());
            let rows =
                format!("{a} + 0.3 * {c}.powi(2) - 0.1 * {inner}.sin(), {} - 0.5 * {c}.sin()", jets[1]);
            let expr = self.ty("Expr");
            let (returns, body) = match self.r.below(2) {
                0 => (format!("[{expr}; 2]"), format!("[{rows}]")),
                _ => ("Vec2".to_owned(), format!("{}({rows})", self.ty("vec2"))),
            };
            self.function("holonomic", &name, &returns, &body);
            return;
        } else if self.r.one_in(4) {
            let body = format!("{a} + 0.3 * {b}.powi(2) - 0.2");
            self.function("holonomic(switched)", &name, "Expr", &body);
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
}

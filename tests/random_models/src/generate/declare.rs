//! What a model declares, and what stands around it.

use std::fmt::Write;

use super::*;

impl Draft<'_> {
    pub(super) fn declare(&mut self) {
        self.names.keep("t");
        self.scope.hidden = vec![self.name.clone()];
        self.units = self.r.one_in(4);
        if self.units {
            SCALES.iter().for_each(|(name, _)| self.names.keep(name));
            self.scope.period = Some("self.period".to_owned());
        }
        let count = [1, 1, 1, 2, 2, 3][self.r.below(6)];
        for _ in 0..count {
            let name = self.coordinate_name();
            let length = self.r.one_in(8).then(|| 2 + self.r.below(2));
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
        if self.r.one_in(4) {
            let name = self.names.fresh(self.r);
            let shape = ["Vec2", "Vec3", "Mat3"][self.r.below(3)];
            self.scope.shapes.push((format!("self.{name}"), shape));
            self.shapes.push((name, shape));
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
    pub(super) fn coordinate_name(&mut self) -> String {
        loop {
            let name = self.names.fresh(self.r);
            if !NOT_FOR_COORDINATES.contains(&name.as_str()) {
                return name;
            }
        }
    }

    /// Constants of the block, some of them called as std's.
    pub(super) fn block_constants(&mut self) {
        let name = if self.r.one_in(2) {
            self.r.pick(MATHEMATICAL)
        } else {
            self.r.pick(&["K", "RATIO", "X", "Q", "T", "N"])
        };
        let value = [2.1, 0.3, 1.7, 3.0][self.r.below(4)];
        self.constants.push((name.to_owned(), format!("    const {name}: f64 = {value:?};\n")));
        self.names.keep(name);
        self.scope.numbers.push(format!("Self::{name}"));
    }

    /// What stands around a model in its module.
    pub(super) fn surroundings(&mut self) {
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
                let (module, name) =
                    (self.r.pick(&["consts", "material", "values"]), self.r.pick(MATHEMATICAL));
                let _ = writeln!(self.outside, "{allow}mod {module} {{ pub const {name}: f64 = 2.75; }}");
                self.scope.numbers.push(format!("{module}::{name}"));
                self.either = true;
            }
            2 => {
                let name = self.r.pick(MATHEMATICAL);
                let _ = writeln!(self.outside, "use ::std::f64::consts::{name};");
                self.scope.numbers.push(name.to_owned());
                // Of those that are imported one has to be read.
                let _ = writeln!(self.outside, "{allow}const READ: f64 = {name};");
            }
            3 | 4 => {
                for _ in 0..3 {
                    let name = self.r.pick(NASTY);
                    if self.names.is_free(name)
                        && !["core", "std", "f64", "usize", "bool", "dynamics", "r#type", "vec2", "q"]
                            .contains(&name)
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
                    // The functions' own argument would be a pattern of it.
                    "q",
                ];
                if name != self.name && !word.contains(&name) {
                    let _ = writeln!(self.outside, "{allow}struct {name};");
                    self.scope.taken.push(name.to_owned());
                }
            }
        }
    }
}

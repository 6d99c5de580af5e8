//! Names that users give, the nasty ones among them.

use crate::random::Random;

/// Names of structs: those that generated code, the prelude or the standard library might mean something else
/// by. Types that models are written with are not among them: a struct of such a name is refused, see
/// `defects/`.
pub const STRUCTS: &[&str] = &[
    "Model",
    "T",
    "F",
    "Result",
    "State",
    "Vector",
    "Option",
    "Vec",
    "String",
    "Box",
    "E",
    "PI",
    "M",
    "N",
    "S",
    "Q",
    "R",
    "A",
    "V",
    "P",
    "C",
    "D",
    "Quantity",
    "SVector",
    "SMatrix",
    "Clone",
    "Copy",
    "Debug",
    "Default",
    "From",
    "Send",
    "Sync",
    "Fn",
    "Iterator",
    "PartialEq",
    "Dynamics",
    "Linearize",
    "Outputs",
    "Events",
    "Parameters",
    "Powers",
    "Constraints",
    "Energies",
    "Draw",
    "ActiveSet",
    "Lanes",
    "Table",
    "Constants",
    "Memory",
    "Series",
    "Kink",
    "Solved",
    "Terms",
    "SolverKind",
    "Matrix",
    "Inputs",
    "Rows",
    "Jacobian",
    "Residual",
    "Workspace",
    "InputJacobian",
    "SolveError",
    "Drawing",
    "Point",
    "Reactions",
    "TypeId",
    "Some",
    "None",
    "Ok",
    "Err",
    "x",
    "q",
    "m",
    "model",
    "state",
    "std",
    "core",
    "dynamics",
];

/// Ordinary names of structs.
pub const PLAIN_STRUCTS: &[&str] = &["Pendulum", "Cart", "Linkage", "Rotor", "Chain", "Oscillator"];

/// Names of parameters, coordinates, inputs, helpers, roles and variables.
pub const NASTY: &[&str] = &[
    "x",
    "y",
    "v0",
    "v1",
    "v2",
    "v10",
    "a",
    "m",
    "q",
    "u",
    "s",
    "c",
    "r#type",
    "r#match",
    "r#fn",
    "r#loop",
    "model",
    "state",
    "e",
    "pi",
    "sin",
    "cos",
    "dt",
    "n",
    "i",
    "j",
    "k",
    "value",
    "values",
    "out",
    "constants",
    "h",
    "f",
    "b",
    "lambda",
    "memory",
    "scale",
    "core",
    "std",
    "f64",
    "usize",
    "result",
    "row",
    "p",
    "w",
    "z",
    "delta",
    "table",
    "angle",
    "new",
    "inputs",
    "modes",
    "active_set",
    "mass",
    "force",
    "energy",
    "rate",
    "parameter",
    "index",
    "mass_matrix",
    "accelerations",
    "outputs",
    "events",
    "momenta",
    "g",
    "l",
    "r",
    "_x",
    "x_",
    "x1",
    "θ",
    "φ",
    "ω",
    "vec2",
    "dynamics",
    "some",
    "ok",
    "bool",
    "string",
    "clone",
    "build",
    "d",
    "t0",
    "time",
    "step",
    "acc",
    "tmp",
    "result_",
    "visit",
    "by_q",
    "by_u",
    "jacobian",
    "gamma",
    "residual",
    "multipliers",
    "reaction",
    "slip",
    "unit",
    "name",
    "kind",
    "at",
    "rows",
    "kinks",
    "lanes",
    "norm",
    "dot",
    "zero",
    "one",
    "powi",
    "max",
    "min",
    "len",
    "iter",
    "get",
    "hold",
    "branches",
    "speeds",
    "series",
];

/// Names that have meanings of their own as fields of `q`, or methods of states: not for coordinates and
/// inputs.
pub const NOT_FOR_COORDINATES: &[&str] =
    &["t", "q", "u", "inputs", "modes", "active_set", "build", "new", "hold"];

/// The function that every model has already: a model with one of this name is refused.
pub const GENERATED: &str = "state";

/// The name of a result of every model: an output of this name is refused, a helper is not.
const OF_RESULTS: &str = "energy";

/// Ordinary names.
pub const PLAIN: &[&str] = &[
    "mass",
    "stiffness",
    "length",
    "gravity",
    "theta",
    "phi",
    "height",
    "radius",
    "angle",
    "torque",
    "damping",
    "ratio",
    "offset",
    "speed",
    "arm",
    "rod",
    "slide",
    "spin",
    "lift",
    "sway",
    "push",
    "drag",
    "load",
    "tilt",
    "stretch",
    "bend",
];

/// Names of std's constants, for constants of the user's.
pub const MATHEMATICAL: &[&str] = &[
    "E",
    "PI",
    "TAU",
    "SQRT_2",
    "LN_2",
    "LN_10",
    "LOG2_E",
    "LOG10_E",
    "LOG2_10",
    "LOG10_2",
    "FRAC_PI_2",
    "FRAC_PI_3",
    "FRAC_PI_4",
    "FRAC_PI_6",
    "FRAC_PI_8",
    "FRAC_1_PI",
    "FRAC_2_PI",
    "FRAC_2_SQRT_PI",
    "FRAC_1_SQRT_2",
];

/// Hands out names, each once.
#[derive(Clone, Debug, Default)]
pub struct Names {
    used: Vec<String>,
}

impl Names {
    pub fn keep(&mut self, name: &str) {
        self.used.push(name.to_owned());
    }

    pub fn is_free(&self, name: &str) -> bool {
        // Rates of coordinates and parts of forces have names of their own.
        let stem = name.strip_prefix("r#").unwrap_or(name);
        let clashes = |other: &String| {
            let other = other.strip_prefix("r#").unwrap_or(other);
            other == stem
                || other.strip_prefix(stem) == Some("_rate")
                || stem.strip_prefix(other) == Some("_rate")
        };
        !self.used.iter().any(clashes)
    }

    /// A name of a function.
    pub fn function(&mut self, r: &mut Random) -> String {
        loop {
            let name = self.fresh(r);
            if name != OF_RESULTS {
                return name;
            }
        }
    }

    /// A name that is not used yet.
    pub fn fresh(&mut self, r: &mut Random) -> String {
        for _ in 0..20 {
            let list = if r.one_in(2) { NASTY } else { PLAIN };
            let name = r.pick(list);
            if self.is_free(name) {
                self.keep(name);
                return name.to_owned();
            }
        }
        let name = format!("name_{}", self.used.len());
        self.keep(&name);
        name
    }
}

//! Random expressions over the vocabulary of models. All stay within a few units for arguments within a few
//! units, so that both routes can be compared.

use crate::random::Random;

/// A helper of the model: its call, and what it takes.
#[derive(Clone, Debug)]
pub struct Helper {
    pub name: String,
    pub takes_coordinates: bool,
    pub arguments: Vec<Kind>,
    pub returns: Kind,
}

/// Types of values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// `Expr`.
    Jet,
    /// `f64`.
    Number,
    /// `usize`, at most a few units.
    Count,
    Vec2,
    Vec3,
}

/// What is in scope where an expression stands.
#[derive(Clone, Debug, Default)]
pub struct Scope {
    pub jets: Vec<String>,
    pub numbers: Vec<String>,
    pub counts: Vec<String>,
    /// Arrays of jets and of numbers with their lengths.
    pub jet_arrays: Vec<(String, usize)>,
    pub number_arrays: Vec<(String, usize)>,
    pub helpers: Vec<Helper>,
    /// Derivatives may be asked for.
    pub rates: bool,
    /// Words with corners are allowed.
    pub corners: bool,
    /// How the words of the prelude are called here, where the model hides one.
    pub hidden: Vec<String>,
    /// Vectors and matrices of numbers.
    pub shapes: Vec<(String, &'static str)>,
    /// What makes rates numbers, in models with units.
    pub period: Option<String>,
    /// Names that variables must not take: statics of the module.
    pub taken: Vec<String>,
    pub locals: usize,
}

impl Scope {
    /// A word of the prelude.
    pub fn word(&self, name: &str) -> String {
        if self.hidden.iter().any(|h| h == name) {
            format!("::dynamics::prelude::{name}")
        } else {
            name.to_owned()
        }
    }
}

/// Writes expressions.
pub struct Writer<'a> {
    pub r: &'a mut Random,
    /// Something was written that the macro may refuse: integers that wrap, roundings to `f32`.
    pub wraps: &'a mut bool,
}

const LOCALS: &[&str] = &[
    "v0",
    "v1",
    "v2",
    "x",
    "a",
    "s",
    "c",
    "sum",
    "total",
    "m",
    "k",
    "e",
    "pi",
    "value",
    "h",
    "f",
    "state",
    "model",
    "w0",
    "p",
    "u",
    "out",
    "r#type",
    "angle",
    "values",
    "constants",
    "lambda",
    "row",
];

impl Writer<'_> {
    fn literal(&mut self) -> String {
        let whole = ["1.0", "2.0", "0.5", "3.0", "0.25"];
        if self.r.one_in(3) {
            self.r.pick(&whole).to_owned()
        } else {
            format!("{:.2}", 0.11 + self.r.below(140) as f64 / 100.0)
        }
    }

    fn local(&mut self, scope: &mut Scope) -> String {
        for _ in 0..10 {
            let name = self.r.pick(LOCALS);
            let taken = scope
                .jets
                .iter()
                .chain(&scope.numbers)
                .chain(&scope.counts)
                .chain(&scope.taken)
                .any(|n| n == name);
            if !taken {
                return name.to_owned();
            }
        }
        scope.locals += 1;
        format!("local_{}", scope.locals)
    }

    /// An expression of type `Expr`.
    pub fn jet(&mut self, scope: &Scope, depth: usize) -> String {
        if depth == 0 {
            return self.jet_leaf(scope);
        }
        let d = depth - 1;
        match self.r.below(36) {
            0..4 => {
                format!("({} {} {})", self.jet(scope, d), self.r.pick(&["+", "-", "*"]), self.jet(scope, d))
            }
            4 | 5 => {
                let (a, b) = (self.jet(scope, d), self.number(scope, d));
                let o = self.r.pick(&["+", "-", "*"]);
                if self.r.one_in(2) { format!("({a} {o} {b})") } else { format!("({b} {o} {a})") }
            }
            6 => format!(
                "({} / ({} + {}.sin()))",
                self.jet(scope, d),
                ["1.5", "2.0", "3.0"][self.r.below(3)],
                self.jet(scope, d)
            ),
            7..12 => format!(
                "{}.{}()",
                self.jet(scope, d),
                self.r.pick(&["sin", "cos", "tanh", "atan", "sin", "cos"])
            ),
            12 => format!(
                "(0.4 * {}.sin()).{}()",
                self.jet(scope, d),
                self.r.pick(&["tan", "asin", "acos", "sinh", "cosh", "exp", "atan"])
            ),
            13 => format!(
                "(1.0 + {}.powi(2)).{}()",
                self.jet(scope, d),
                self.r.pick(&["sqrt", "ln", "recip", "cbrt"])
            ),
            14 => format!(
                "(2.0 + {}.cos()).{}",
                self.jet(scope, d),
                self.r.pick(&["powf(0.5)", "powf(-1.5)", "powi(-2)", "ln()", "cbrt()", "powi(3)"])
            ),
            15 => format!("{}.powi({})", self.jet(scope, d), self.r.pick(&["2", "3", "1", "0", "2"])),
            16 => format!("{}.atan2(1.5 + {}.powi(2))", self.jet(scope, d), self.jet(scope, d)),
            17 => format!("{}.hypot(0.7 + {}.powi(2))", self.jet(scope, d), self.jet(scope, d)),
            18 => format!("{}.mul_add({}, {})", self.jet(scope, d), self.jet(scope, d), self.jet(scope, d)),
            19 => format!("(-{})", self.jet(scope, d)),
            20 => self.sine_and_cosine(scope, d),
            21 => self.turn(scope, d),
            22 => self.block(scope, d),
            23 => self.summed(scope, d),
            24 => self.matched(scope, d),
            25 if scope.corners && scope.rates => format!(
                "if {} {{ {} }} else {{ {} }}",
                self.condition(scope, d),
                self.jet(scope, d),
                self.jet(scope, d)
            )
            .wrapped(),
            26 if scope.corners => {
                let word = ["min", "max"][self.r.below(2)];
                format!("{}.{word}({})", self.jet(scope, d), self.jet(scope, d))
            }
            27 if scope.corners => format!("{}.abs()", self.jet(scope, d)),
            28 if scope.corners => format!("{}.clamp(-0.6, 0.8)", self.jet(scope, d)),
            29 | 30 => self.called(scope, Kind::Jet, d).unwrap_or_else(|| self.jet_leaf(scope)),
            31 => self.of_vectors(scope, d),
            32 if scope.rates => match &scope.period {
                Some(period) => format!("({}.dt() * {period})", self.jet_leaf(scope)),
                None => format!("{}.dt()", self.jet_leaf(scope)),
            },
            33 => format!(
                "{}.{}().{}()",
                self.jet_leaf(scope),
                self.r.pick(&["sin", "cos"]),
                self.r.pick(&["sin", "cos"])
            ),
            _ => self.jet_leaf(scope),
        }
    }

    fn jet_leaf(&mut self, scope: &Scope) -> String {
        if !scope.jet_arrays.is_empty() && self.r.one_in(3) {
            let (array, length) = scope.jet_arrays[self.r.below(scope.jet_arrays.len())].clone();
            return format!("{array}[{}]", self.index(scope, length));
        }
        if scope.jets.is_empty() {
            return format!("{}::from({})", scope.word("Expr"), self.literal());
        }
        scope.jets[self.r.below(scope.jets.len())].clone()
    }

    fn index(&mut self, scope: &Scope, length: usize) -> String {
        if !scope.counts.is_empty() && self.r.one_in(2) {
            let count = scope.counts[self.r.below(scope.counts.len())].clone();
            return match self.r.below(2) {
                0 => format!("{count} % {length}"),
                _ => format!("({count} + 1) % {length}"),
            };
        }
        self.r.below(length).to_string()
    }

    /// An angle that is a product with time, or a bare one.
    fn turn(&mut self, scope: &Scope, depth: usize) -> String {
        let word = ["sin", "cos"][self.r.below(2)];
        if let Some(clock) =
            scope.jets.iter().find(|j| mentions(j, "q") && j.contains("q.t") && !j.contains("q.t_"))
        {
            let inner =
                format!("({} * {clock}).{}()", self.number(scope, 0), ["sin", "cos"][self.r.below(2)]);
            if self.r.one_in(2) { format!("{inner}.{word}()") } else { inner }
        } else {
            format!("({} * {}).{word}()", self.number(scope, 0), self.jet(scope, depth))
        }
    }

    fn sine_and_cosine(&mut self, scope: &Scope, depth: usize) -> String {
        let (mut inner, value) = (scope.clone(), self.jet(scope, depth));
        let s = self.local(&mut inner);
        inner.jets.push(s.clone());
        let c = self.local(&mut inner);
        format!("({{ let ({s}, {c}) = {value}.sin_cos(); {s} * {c} + {s} }})")
    }

    fn block(&mut self, scope: &Scope, depth: usize) -> String {
        let mut inner = scope.clone();
        let name = self.local(&mut inner);
        let (value, kind) =
            if self.r.one_in(3) { (self.number(scope, depth), 0) } else { (self.jet(scope, depth), 1) };
        match kind {
            0 => inner.numbers.push(name.clone()),
            _ => inner.jets.push(name.clone()),
        }
        if self.r.one_in(3) && kind == 1 {
            let change = format!("{name} {} {};", self.r.pick(&["+=", "-=", "*="]), self.jet(scope, depth));
            return format!(
                "({{ let mut {name} = {value}; {change} {name} + {} }})",
                self.jet(&inner, depth)
            );
        }
        format!("({{ let {name} = {value}; {name} * {} }})", self.jet(&inner, depth))
    }

    /// A sum by a loop.
    fn summed(&mut self, scope: &Scope, depth: usize) -> String {
        let mut inner = scope.clone();
        let sum = self.local(&mut inner);
        inner.jets.retain(|j| *j != sum);
        let i = ["i", "j", "n", "k0"]
            .iter()
            .find(|i| !scope.counts.iter().chain(&scope.taken).any(|c| c == *i))
            .copied()
            .unwrap_or("i9");
        inner.counts.push(i.to_owned());
        inner.numbers.retain(|n| n != i);
        inner.jets.retain(|n| n != i);
        let range = ["0..2", "0..3", "1..=2", "0..=2", "1..3"][self.r.below(5)];
        let zero = format!("{}::ZERO", scope.word("Expr"));
        let term = self.jet(&inner, depth.min(1));
        // The result of a loop grows with its length.
        let mut weight = self.number(&inner, 1);
        if !mentions(&format!("{weight} {term}"), i) {
            weight = format!("({i} as f64 - 0.5)");
        }
        format!("({{ let mut {sum} = {zero}; for {i} in {range} {{ {sum} += {weight} * {term}; }} {sum} }})")
    }

    fn matched(&mut self, scope: &Scope, depth: usize) -> String {
        let Some(count) =
            (!scope.counts.is_empty()).then(|| scope.counts[self.r.below(scope.counts.len())].clone())
        else {
            return self.jet(scope, depth);
        };
        format!(
            "(match {count} {{ 0 => {}, 1 | 2 => {}, _ => {} }})",
            self.jet(scope, depth),
            self.jet(scope, 0),
            self.jet(scope, 0)
        )
    }

    fn condition(&mut self, scope: &Scope, depth: usize) -> String {
        let one = |w: &mut Self| {
            format!(
                "{} {} {}",
                w.jet(scope, depth.min(1)),
                w.r.pick(&["<", ">", "<=", ">="]),
                w.number(scope, 0)
            )
        };
        match self.r.below(4) {
            0 => format!("{} && {}", one(self), one(self)),
            1 => format!("{} || {}", one(self), one(self)),
            2 if !scope.counts.is_empty() => {
                let count = scope.counts[self.r.below(scope.counts.len())].clone();
                format!("{count} % 2 == {}", self.r.below(2))
            }
            _ => one(self),
        }
    }

    fn called(&mut self, scope: &Scope, kind: Kind, depth: usize) -> Option<String> {
        let fitting: Vec<&Helper> = scope.helpers.iter().filter(|h| h.returns == kind).collect();
        if fitting.is_empty() {
            return None;
        }
        let helper = fitting[self.r.below(fitting.len())].clone();
        if helper.takes_coordinates
            && !scope.jets.iter().any(|j| j.starts_with("q."))
            && scope.jet_arrays.is_empty()
        {
            return None;
        }
        Some(self.call(scope, &helper, depth))
    }

    /// A call of a helper.
    pub fn call(&mut self, scope: &Scope, helper: &Helper, depth: usize) -> String {
        let mut arguments = Vec::new();
        if helper.takes_coordinates {
            arguments.push("q".to_owned());
        }
        for argument in &helper.arguments {
            arguments.push(match argument {
                Kind::Number => self.number(scope, depth.min(1)),
                Kind::Count if !scope.counts.is_empty() && self.r.one_in(2) => {
                    scope.counts[self.r.below(scope.counts.len())].clone()
                }
                Kind::Count => self.r.below(3).to_string(),
                _ => self.jet(scope, depth.min(1)),
            });
        }
        let receiver = if helper.name.starts_with("Self::") { String::new() } else { "self.".to_owned() };
        format!("{receiver}{}({})", helper.name, arguments.join(", "))
    }

    fn of_vectors(&mut self, scope: &Scope, depth: usize) -> String {
        let d = depth.min(1);
        if self.r.one_in(2) {
            let (a, b) = (self.vec2(scope, d), self.vec2(scope, 0));
            match self.r.below(5) {
                0 => format!("{a}.dot({b})"),
                1 => format!("{a}.cross({b})"),
                2 => format!("{a}.norm_squared()"),
                3 => format!("({a} + {b}.perp()).x"),
                _ => format!("({a} - 0.5 * {b})[1]"),
            }
        } else {
            let (a, b) = (self.vec3(scope, d), self.vec3(scope, 0));
            match self.r.below(6) {
                0 => format!("{a}.dot({b})"),
                1 => format!("{a}.cross({b}).z"),
                2 => format!("{a}.norm_squared()"),
                3 => format!("(1.0 + {a}.norm_squared()).sqrt()"),
                4 => format!(
                    "({}::rotation_{}({}) * {a}).y",
                    scope.word("Mat3"),
                    self.r.pick(&["x", "y", "z"]),
                    self.jet(scope, 0)
                ),
                _ => format!("({a} / 2.0 + {b}).x"),
            }
        }
    }

    /// A vector of the plane.
    pub fn vec2(&mut self, scope: &Scope, depth: usize) -> String {
        if let Some((name, _)) = scope.shapes.iter().find(|(_, shape)| *shape == "Vec2")
            && self.r.one_in(3)
        {
            return format!("({} * {name})", self.jet(scope, depth));
        }
        if self.r.one_in(4)
            && let Some(call) = self.called(scope, Kind::Vec2, depth)
        {
            return call;
        }
        format!("{}({}, {})", scope.word("vec2"), self.jet(scope, depth), self.jet(scope, depth))
    }

    /// A vector of space.
    pub fn vec3(&mut self, scope: &Scope, depth: usize) -> String {
        if let Some((name, shape)) = scope.shapes.iter().find(|(_, shape)| *shape != "Vec2")
            && self.r.one_in(3)
        {
            let jet = self.jet(scope, depth);
            return if *shape == "Vec3" {
                format!("({jet} * {name})")
            } else {
                format!("({jet} * {name}.row({}))", self.r.below(3))
            };
        }
        if self.r.one_in(4)
            && let Some(call) = self.called(scope, Kind::Vec3, depth)
        {
            return call;
        }
        format!(
            "{}({}, {}, {})",
            scope.word("vec3"),
            self.jet(scope, depth),
            self.number(scope, depth),
            self.jet(scope, 0)
        )
    }

    /// An expression of type `f64`.
    pub fn number(&mut self, scope: &Scope, depth: usize) -> String {
        if depth == 0 {
            return self.number_leaf(scope);
        }
        let d = depth - 1;
        match self.r.below(14) {
            0 | 1 => format!(
                "({} {} {})",
                self.number(scope, d),
                self.r.pick(&["+", "-", "*"]),
                self.number(scope, d)
            ),
            2 => format!(
                "{}.{}()",
                self.number_leaf(scope),
                self.r.pick(&["sin", "cos", "abs", "tanh", "atan"])
            )
            .on_float(),
            3 => {
                format!("({} / (1.5 + {}.abs()))", self.number(scope, d), self.number_leaf(scope).on_float())
            }
            4 => format!(
                "{}.{}",
                self.number_leaf(scope),
                self.r.pick(&["powi(2)", "max(0.3)", "min(0.9)", "clamp(0.1, 0.9)"])
            )
            .on_float(),
            5..8 => self.cast(scope),
            8 => self.called(scope, Kind::Number, d).unwrap_or_else(|| self.number_leaf(scope)),
            _ => self.number_leaf(scope),
        }
    }

    fn number_leaf(&mut self, scope: &Scope) -> String {
        if !scope.number_arrays.is_empty() && self.r.one_in(4) {
            let (array, length) = scope.number_arrays[self.r.below(scope.number_arrays.len())].clone();
            return format!("{array}[{}]", self.index(scope, length));
        }
        if scope.numbers.is_empty() || self.r.one_in(4) {
            return self.literal();
        }
        scope.numbers[self.r.below(scope.numbers.len())].clone()
    }

    /// A number made of an integer.
    fn cast(&mut self, scope: &Scope) -> String {
        let Some(i) =
            (!scope.counts.is_empty()).then(|| scope.counts[self.r.below(scope.counts.len())].clone())
        else {
            if self.r.one_in(12) {
                *self.wraps = true;
                let odd = [
                    "f64::from(0.1f32)",
                    "f64::from(0.7_f32)",
                    "((0.3_f64 as f32) as f64)",
                    "((2.7_f64 as i32) as f64)",
                    "((300_i32 as u8) as f64)",
                ];
                return odd[self.r.below(odd.len())].to_owned();
            }
            return self.number_leaf(scope);
        };
        match self.r.below(16) {
            0..3 => format!("({i} as f64)"),
            3 => format!("(({i} + 1) as f64)"),
            4 => format!("f64::from({i} as u32 + 1)"),
            5 => format!("((2 * {i} + 1) as f64)"),
            6 => format!("(({i} % 2) as f64)"),
            7 => {
                // Remainders that are dropped are refused.
                *self.wraps = true;
                format!("(({i} / 2) as f64)")
            }
            8 => format!("f64::from({i} as i32 - 1)"),
            9 => format!("(0.5 * ({i} as i32 - 2) as f64)"),
            10 => format!("0.5_f64.powi({i} as i32)"),
            11 => format!("(({i} * {i}) as f64)"),
            12 => format!("(({i} as u8) as f64)"),
            13 => {
                *self.wraps = true;
                format!("f64::from({i} as f32)")
            }
            _ => {
                *self.wraps = true;
                let odd = [
                    format!("(0.01 * (({i} as i32 - 2) as u8) as f64)"),
                    format!("((({i} + 254) as u8) as f64)"),
                    format!("(0.1 * ((100 * {i} + 200) as u8) as f64)"),
                    format!("f64::from(0.1_f32 * {i} as f32)"),
                    format!("((200 * {i} + 100) as i8 as f64 * 0.01)"),
                    format!("((-0.6 - {i} as f64) as i32 as f64)"),
                    format!("((({i} as f64 - 1.7) as u32) as f64)"),
                ];
                odd[self.r.below(odd.len())].clone()
            }
        }
    }
}

/// Whether a word stands in a text, not as a part of another.
pub fn mentions(text: &str, word: &str) -> bool {
    let part = |c: char| c.is_alphanumeric() || c == '_';
    text.match_indices(word).any(|(i, _)| {
        !text[..i].ends_with(part)
            && (!text[..i].ends_with('.') || text[..i].ends_with(".."))
            && !text[i + word.len()..].starts_with(part)
    })
}

trait Text {
    fn wrapped(self) -> String;
    fn on_float(self) -> String;
}

impl Text for String {
    fn wrapped(self) -> String {
        format!("({self})")
    }
    /// Methods on literals want a type.
    fn on_float(self) -> String {
        let literal = self.starts_with(|c: char| c.is_ascii_digit()) && !self.contains("_f64");
        if literal {
            let end = self.char_indices().find(|(i, c)| {
                !(c.is_ascii_digit() || *c == '.' && self[i + 1..].starts_with(|d: char| d.is_ascii_digit()))
            });
            let end = end.map_or(self.len(), |(i, _)| i);
            return format!("{}_f64{}", &self[..end], &self[end..]);
        }
        self
    }
}

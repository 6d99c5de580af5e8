//! Programs as functions of a language that computes: JavaScript, and whatever implements [`Language`].
//!
//! The order of operations is that of the program, and every literal reads back as the number that the graph
//! holds. So all languages that compute with doubles have the bits of the Rust program, as far as their
//! functions have. Nothing is decided about mechanics here.
//!
//! Names of what is given are arrays by index, `q[0]`, never the user's names: those may be reserved words,
//! or as long as they like.

use crate::graph::{NodeId, Number, Symbol};
use crate::mechanics::Model;
use crate::schedule::Program;

use super::program::{Line, Style, lines_from};
use super::target::{Target, Text};

/// How programs are written: sines and cosines of one angle stand together, short steps where they are used.
pub(super) const STYLE: Style<'_> = Style { inline: 72, inline_angle: 0, prefixes: ["c", "v"] };

/// A function to be written.
#[derive(Clone, Debug)]
pub(super) struct Function {
    /// Number of results.
    pub(super) results: usize,
    /// What is computed once per set of parameters: the assignments, and the texts of the constants that the
    /// body reads.
    pub(super) hoisted: (Vec<Line>, Vec<Text>),
    /// What is computed at every call: the assignments, and the texts of the results.
    pub(super) body: (Vec<Line>, Vec<Text>),
}

/// A language with functions.
pub(super) trait Language: Target {
    /// How the constant of a number is read in the body.
    fn constant(&self, index: usize) -> Text;
    /// A function as text.
    fn function(&self, function: &Function) -> String;
}

/// A program as a function of a language.
pub(super) fn function(language: &dyn Language, model: &Model, program: &Program) -> String {
    let hoisted = Program {
        body: program.hoisted.clone(),
        hoisted: Vec::new(),
        constants: Vec::new(),
        results: program.constants.clone(),
        ..program.clone()
    };
    let body = Program { hoisted: Vec::new(), constants: Vec::new(), ..program.clone() };
    let named = |(i, id): (usize, &NodeId)| (*id, language.constant(i));
    let given: Vec<(NodeId, Text)> = program.constants.iter().enumerate().map(named).collect();
    language.function(&Function {
        results: program.results.len(),
        hoisted: lines_from(language, model, &hoisted, STYLE, &[]),
        body: lines_from(language, model, &body, STYLE, &given),
    })
}

/// A symbol as the element of an array.
pub(super) fn element(symbol: Symbol) -> String {
    match symbol {
        Symbol::Time => "t".to_owned(),
        Symbol::Coordinate(i) => format!("q[{i}]"),
        Symbol::Rate(i) => format!("u[{i}]"),
        Symbol::Acceleration(i) => format!("a[{i}]"),
        Symbol::Input(i) => format!("w[{i}]"),
        Symbol::Parameter(i) => format!("p[{i}]"),
        Symbol::Multiplier(i) => format!("l[{i}]"),
        Symbol::Mode(i) => format!("m[{i}]"),
    }
}

/// The shortest decimal that reads back as the number that Rust computes with.
pub(super) fn literal(number: Number) -> String {
    let value = number.value();
    let text = format!("{:?}", if value == 0.0 { 0.0 } else { value });
    text.strip_suffix(".0").map(str::to_owned).unwrap_or(text)
}

#[cfg(test)]
mod tests {
    use super::literal;
    use crate::graph::Number;

    #[test]
    fn literals_read_back_as_the_same_number() {
        for number in [
            Number::Rational(1, 3),
            Number::Rational(-7, 2),
            Number::Rational(i128::from(u64::MAX), 1),
            Number::Rational(12_345_678_901_234_567, 10),
            Number::Float(5e-324),
            Number::Float(-1.797_693_134_862_315_7e308),
            Number::Float(0.1 + 0.2),
        ] {
            let read: f64 = literal(number).parse().expect("a number");
            assert_eq!(read.to_bits(), number.value().to_bits(), "{number:?}");
        }
        assert_eq!(literal(Number::Rational(2, 1)), "2");
        assert_eq!(literal(Number::Float(-0.0)), "0");
    }
}

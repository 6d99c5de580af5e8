//! Plain text: `m2 l1 l2 cos(theta1 - theta2) theta2''`, or with `*` for listings.

use crate::graph::{Binary, Comparison, Symbol, Unary};
use crate::mechanics::Model;

use super::target::{Level, Target, Text, comparison_sign};

/// Plain text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plain {
    times: &'static str,
}

impl Plain {
    /// Products by juxtaposition, as in a book.
    pub const READABLE: Self = Self { times: " " };
    /// Products with `*`, as in a program.
    pub const PROGRAM: Self = Self { times: "*" };
}

impl Target for Plain {
    fn times(&self) -> &'static str {
        self.times
    }
    fn symbol(&self, model: &Model, symbol: Symbol) -> Text {
        let q = |i: u32, primes: &str| format!("{}{primes}", model.coordinates[i as usize].name);
        Text::atom(match symbol {
            Symbol::Time => "t".to_owned(),
            Symbol::Coordinate(i) => q(i, ""),
            Symbol::Rate(i) => q(i, "'"),
            Symbol::Acceleration(i) => q(i, "''"),
            Symbol::Input(i) => model.inputs[i as usize].name.clone(),
            Symbol::Parameter(i) => model.parameters[i as usize].name.clone(),
            Symbol::Multiplier(i) => format!("lambda[{}]", model.row_name(i)),
            Symbol::Mode(i) => format!("mode[{}]", model.mode_name(i)),
        })
    }
    fn smooth(&self, name: &str, order: u8, argument: &Text) -> Text {
        Text::atom(format!("{name}{}({})", "'".repeat(order.into()), argument.text))
    }
    fn unary(&self, f: Unary, a: &Text) -> Text {
        Text::atom(format!("{}({})", f.name(), a.text))
    }
    fn binary(&self, f: Binary, a: &Text, b: &Text) -> Text {
        let name = match f {
            Binary::Atan2 => "atan2",
            Binary::Powf => {
                let (base, exponent) = (self.fit(a, Level::Atom), self.fit(b, Level::Atom));
                return Text::new(format!("{base}^{exponent}"), Level::Power);
            }
            Binary::Hypot => "hypot",
            Binary::Min => "min",
            Binary::Max => "max",
        };
        Text::atom(format!("{name}({}, {})", a.text, b.text))
    }
    fn select(
        &self,
        comparison: Comparison,
        [left, right]: [&Text; 2],
        then: &Text,
        otherwise: &Text,
    ) -> Text {
        let sign = comparison_sign(comparison);
        let text = format!(
            "if {} {sign} {} {{ {} }} else {{ {} }}",
            left.text, right.text, then.text, otherwise.text
        );
        Text::new(text, Level::Choice)
    }
    fn assign(&self, name: &Text, value: &Text) -> String {
        format!("{} = {}", name.text, value.text)
    }
}

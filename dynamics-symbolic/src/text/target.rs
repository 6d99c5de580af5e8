//! What a target language has to say: one implementation per language, with the defaults of an infix
//! language.

use crate::graph::{Binary, Comparison, Number, Symbol, Unary};
use crate::mechanics::Model;

/// How tightly a text holds together; the order is that of binding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Level {
    /// `if … else …`.
    Choice,
    /// Sums and anything with a leading minus.
    Sum,
    /// Products and quotients.
    Product,
    /// Powers.
    Power,
    /// Names, calls, numbers, groups.
    Atom,
}

/// A piece of text in a target language.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Text {
    /// The text.
    pub text: String,
    /// Its outermost operation.
    pub level: Level,
}

impl Text {
    /// A text with its level.
    #[must_use]
    pub fn new(text: impl Into<String>, level: Level) -> Self {
        Self { text: text.into(), level }
    }
    /// A text that needs no parentheses anywhere.
    #[must_use]
    pub fn atom(text: impl Into<String>) -> Self {
        Self::new(text, Level::Atom)
    }
}

/// A target language.
pub trait Target {
    /// A symbol under its user's name.
    fn symbol(&self, model: &Model, symbol: Symbol) -> Text;
    /// A smooth parameter function at an argument, derivative of the given order.
    fn smooth(&self, name: &str, order: u8, argument: &Text) -> Text;
    /// A function of one argument.
    fn unary(&self, f: Unary, a: &Text) -> Text;
    /// A function of two arguments.
    fn binary(&self, f: Binary, a: &Text, b: &Text) -> Text;
    /// A selection.
    fn select(&self, comparison: Comparison, sides: [&Text; 2], then: &Text, otherwise: &Text) -> Text;
    /// An assignment to a name.
    fn assign(&self, name: &Text, value: &Text) -> String;

    /// One assignment of the sine and the cosine of an angle to two names, in languages that have it.
    fn assign_sin_cos(&self, _names: [&Text; 2], _angle: &Text) -> Option<String> {
        None
    }

    /// One assignment of a root and of its reciprocal to two names, in languages that have it.
    fn assign_root(&self, _names: [&Text; 2], _square: &Text) -> Option<String> {
        None
    }

    /// What stands between factors.
    fn times(&self) -> &'static str {
        "*"
    }
    /// A name made by the printer: prefix and number from 1.
    fn variable(&self, prefix: &str, number: usize) -> Text {
        Text::atom(format!("{prefix}{number}"))
    }
    /// A number.
    fn number(&self, n: Number) -> Text {
        let text = match n {
            Number::Rational(n, 1) => n.to_string(),
            Number::Rational(n, d) => match decimal(n, d) {
                Some(text) => text,
                None => {
                    return Text::new(format!("{n}/{d}"), if n < 0 { Level::Sum } else { Level::Product });
                }
            },
            Number::Float(x) => float(x),
        };
        let level = if text.starts_with('-') { Level::Sum } else { Level::Atom };
        Text::new(text, level)
    }
    /// A positive coefficient of a product: what stands above and what below the fraction bar.
    fn coefficient(&self, n: Number) -> (Option<Text>, Option<Text>) {
        match n {
            Number::Rational(1, 1) => (None, None),
            Number::Rational(n, d) if d != 1 && decimal(n, d).is_none() => {
                let above = (n != 1).then(|| Text::atom(n.to_string()));
                (above, Some(Text::atom(d.to_string())))
            }
            n => (Some(self.number(n)), None),
        }
    }
    /// A text in parentheses.
    fn group(&self, inner: &Text) -> Text {
        Text::atom(format!("({})", inner.text))
    }
    /// A text, in parentheses where it binds less tightly than `least`.
    fn fit(&self, text: &Text, least: Level) -> String {
        if text.level < least { self.group(text).text } else { text.text.clone() }
    }
    /// Terms with their signs (`true`: minus). Only the first may itself be a sum.
    fn sum(&self, terms: &[(bool, Text)]) -> Text {
        let mut out = String::new();
        for (i, (minus, term)) in terms.iter().enumerate() {
            match (i, minus) {
                (0, false) => out.push_str(&self.fit(term, Level::Sum)),
                (0, true) => out.push_str(&format!("-{}", self.fit(term, Level::Product))),
                (_, false) => out.push_str(&format!(" + {}", self.fit(term, Level::Product))),
                (_, true) => out.push_str(&format!(" - {}", self.fit(term, Level::Product))),
            }
        }
        Text::new(out, Level::Sum)
    }
    /// A product over a product; 1 where nothing stands above. Only the first factor may itself be a product.
    fn product(&self, above: &[Text], below: &[Text]) -> Text {
        let factors: Vec<String> = above
            .iter()
            .enumerate()
            .map(|(i, f)| self.fit(f, if i == 0 { Level::Product } else { Level::Power }))
            .collect();
        let numerator = if factors.is_empty() { "1".to_owned() } else { factors.join(self.times()) };
        let text = match below {
            [] => {
                return Text::new(
                    numerator,
                    if above.len() == 1 { above[0].level.max(Level::Product) } else { Level::Product },
                );
            }
            [one] => format!("{numerator}/{}", self.fit(one, Level::Power)),
            many => {
                let inner: Vec<String> = many.iter().map(|f| self.fit(f, Level::Power)).collect();
                format!(
                    "{numerator}/{}",
                    self.group(&Text::new(inner.join(self.times()), Level::Product)).text
                )
            }
        };
        Text::new(text, Level::Product)
    }
    /// A power with a positive integer exponent.
    fn power(&self, base: &Text, exponent: u32) -> Text {
        Text::new(format!("{}^{exponent}", self.fit(base, Level::Atom)), Level::Power)
    }
}

/// A fraction as a decimal of at most four places, where it is one.
pub(super) fn decimal(n: i128, d: i128) -> Option<String> {
    let scale = [10i128, 100, 1000, 10_000].into_iter().position(|s| s % d == 0)?;
    let places = scale + 1;
    let power = 10i128.pow(places as u32);
    let scaled = n.checked_mul(power / d)?;
    let (whole, part) = (scaled.abs() / power, scaled.abs() % power);
    let sign = if n < 0 { "-" } else { "" };
    Some(format!("{sign}{whole}.{part:0places$}"))
}

/// The shortest text of a float that reads back as the same.
pub(super) fn float(x: f64) -> String {
    let magnitude = x.abs();
    if magnitude != 0.0 && !(1e-4..1e9).contains(&magnitude) { format!("{x:e}") } else { format!("{x}") }
}

/// Signs of comparisons.
pub(super) fn comparison_sign(c: Comparison) -> &'static str {
    match c {
        Comparison::Less => "<",
        Comparison::LessEqual => "<=",
        Comparison::Equal => "==",
    }
}

#[cfg(test)]
mod tests {
    use super::{decimal, float};

    #[test]
    fn fractions_are_decimals_where_that_is_short() {
        assert_eq!(decimal(1, 2).as_deref(), Some("0.5"));
        assert_eq!(decimal(-5, 4).as_deref(), Some("-1.25"));
        assert_eq!(decimal(981, 100).as_deref(), Some("9.81"));
        assert_eq!(decimal(1, 16).as_deref(), Some("0.0625"));
        assert_eq!(decimal(1, 3), None);
        assert_eq!(float(6.674e-11), "6.674e-11");
        assert_eq!(float(0.1), "0.1");
    }
}

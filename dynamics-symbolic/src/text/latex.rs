//! LaTeX: `\dot{\theta}_{1}^{2}`, fractions, Greek letters by their names. Needs `amsmath`.

use crate::graph::{Binary, Comparison, Number, Symbol, Unary};
use crate::mechanics::Model;

use super::names::{Name, is_greek, small_letter_name, split_digits};
use super::target::{Level, Target, Text, decimal};

/// LaTeX.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Latex;

impl Target for Latex {
    fn times(&self) -> &'static str {
        " "
    }
    fn symbol(&self, model: &Model, symbol: Symbol) -> Text {
        let q = |i: u32, accent: &str| name(&model.coordinates[i as usize].name, accent);
        Text::atom(match symbol {
            Symbol::Time => "t".to_owned(),
            Symbol::Coordinate(i) => q(i, ""),
            Symbol::Rate(i) => q(i, "\\dot"),
            Symbol::Acceleration(i) => q(i, "\\ddot"),
            Symbol::Input(i) => name(&model.inputs[i as usize].name, ""),
            Symbol::Parameter(i) => name(&model.parameters[i as usize].name, ""),
            Symbol::Multiplier(i) => format!("\\lambda_{{{}}}", name(&model.row_name(i), "")),
            Symbol::Mode(i) => name(&model.mode_name(i), ""),
        })
    }
    fn variable(&self, prefix: &str, number: usize) -> Text {
        Text::atom(format!("{prefix}_{{{number}}}"))
    }
    fn smooth(&self, function: &str, order: u8, argument: &Text) -> Text {
        Text::atom(format!(
            "{}{}{}",
            name(function, ""),
            "'".repeat(order.into()),
            parentheses(&argument.text)
        ))
    }
    fn number(&self, n: Number) -> Text {
        match n {
            Number::Rational(n, d) if d != 1 => {
                let fraction = format!("\\frac{{{}}}{{{d}}}", n.unsigned_abs());
                if n < 0 {
                    Text::new(format!("-{fraction}"), Level::Sum)
                } else {
                    Text::new(fraction, Level::Product)
                }
            }
            n => {
                let plain = match n {
                    Number::Rational(n, _) => n.to_string(),
                    Number::Float(x) => super::target::float(x),
                };
                let level = if plain.starts_with('-') { Level::Sum } else { Level::Atom };
                match plain.split_once('e') {
                    Some((mantissa, exponent)) => {
                        Text::new(format!("{mantissa} \\cdot 10^{{{exponent}}}"), level.min(Level::Product))
                    }
                    None => Text::new(plain, level),
                }
            }
        }
    }
    fn coefficient(&self, n: Number) -> (Option<Text>, Option<Text>) {
        match n {
            Number::Rational(1, 1) => (None, None),
            // 9.81 reads better than 981/100, ½ better than 0.5.
            Number::Rational(n, d) if d != 1 => {
                let decimal = if d > 8 { decimal(n, d) } else { None };
                let text = decimal.unwrap_or_else(|| format!("\\frac{{{n}}}{{{d}}}"));
                (Some(Text::atom(text)), None)
            }
            n => (Some(self.number(n)), None),
        }
    }
    fn group(&self, inner: &Text) -> Text {
        Text::atom(parentheses(&inner.text))
    }
    fn product(&self, above: &[Text], below: &[Text]) -> Text {
        let side = |factors: &[Text]| match factors {
            [] => "1".to_owned(),
            [one] => one.text.clone(),
            many => juxtaposed(many.iter().map(|f| self.fit(f, Level::Product))),
        };
        if below.is_empty() {
            return Text::new(side(above), Level::Product);
        }
        Text::new(format!("\\frac{{{}}}{{{}}}", side(above), side(below)), Level::Product)
    }
    fn power(&self, base: &Text, exponent: u32) -> Text {
        // sin²θ, as in books.
        for f in ["\\sin", "\\cos", "\\tan"] {
            // Not (sin θ + 1)², which begins with a sine too.
            let call = base.text.strip_prefix(f).filter(|_| base.level == Level::Atom);
            if let Some(argument) = call.filter(|rest| rest.starts_with("\\left")) {
                return Text::new(format!("{f}^{{{exponent}}}{argument}"), Level::Power);
            }
        }
        Text::new(format!("{}^{{{exponent}}}", self.fit(base, Level::Atom)), Level::Power)
    }
    fn unary(&self, f: Unary, a: &Text) -> Text {
        let call = |name: &str| Text::atom(format!("{name}{}", parentheses(&a.text)));
        match f {
            Unary::Sin => call("\\sin"),
            Unary::Cos => call("\\cos"),
            Unary::Tan => call("\\tan"),
            Unary::Asin => call("\\arcsin"),
            Unary::Acos => call("\\arccos"),
            Unary::Atan => call("\\arctan"),
            Unary::Sinh => call("\\sinh"),
            Unary::Cosh => call("\\cosh"),
            Unary::Tanh => call("\\tanh"),
            Unary::Ln => call("\\ln"),
            Unary::Signum => call("\\operatorname{sgn}"),
            Unary::Exp => Text::new(format!("e^{{{}}}", a.text), Level::Power),
            Unary::Sqrt => Text::atom(format!("\\sqrt{{{}}}", a.text)),
            Unary::Cbrt => Text::atom(format!("\\sqrt[3]{{{}}}", a.text)),
            Unary::Abs => Text::atom(format!("\\left|{}\\right|", a.text)),
        }
    }
    fn binary(&self, f: Binary, a: &Text, b: &Text) -> Text {
        let call =
            |name: &str| Text::atom(format!("{name}{}", parentheses(&format!("{}, {}", a.text, b.text))));
        match f {
            Binary::Atan2 => call("\\operatorname{atan2}"),
            Binary::Powf => Text::new(format!("{}^{{{}}}", self.fit(a, Level::Atom), b.text), Level::Power),
            Binary::Hypot => call("\\operatorname{hypot}"),
            Binary::Min => call("\\min"),
            Binary::Max => call("\\max"),
        }
    }
    fn select(
        &self,
        comparison: Comparison,
        [left, right]: [&Text; 2],
        then: &Text,
        otherwise: &Text,
    ) -> Text {
        let sign = match comparison {
            Comparison::Less => "<",
            Comparison::LessEqual => "\\le",
            Comparison::Equal => "=",
        };
        let condition = format!("\\text{{if }} {} {sign} {}", left.text, right.text);
        let cases = format!("{} & {condition} \\\\ {} & \\text{{otherwise}}", then.text, otherwise.text);
        Text::atom(format!("\\begin{{cases}} {cases} \\end{{cases}}"))
    }
    fn assign(&self, name: &Text, value: &Text) -> String {
        format!("{} &= {}", name.text, value.text)
    }
}

/// Factors side by side, with a space that is seen only next to words: m l cos θ, but cart g.
fn juxtaposed(factors: impl Iterator<Item = String>) -> String {
    let word = |f: &str| ["\\mathrm", "\\text", "\\operatorname"].iter().any(|w| f.contains(w));
    let mut out = String::new();
    let mut before = None;
    for factor in factors {
        let own = word(&factor);
        match before {
            None => {}
            Some(false) if !own => out.push(' '),
            Some(_) => out.push_str(" \\, "),
        }
        out.push_str(&factor);
        before = Some(own);
    }
    out
}

fn parentheses(inner: &str) -> String {
    format!("\\left({inner}\\right)")
}

/// A user's name: `theta1` → `\theta_{1}`, `theta[3]` → `\theta_{3}`, `m_cart` → `m_{\mathrm{cart}}`,
/// `axis.x` → `\mathrm{axis}_{x}`; the accent goes over the letter, not over its index.
pub(super) fn name(user: &str, accent: &str) -> String {
    let Name { base, indices } = Name::new(user);
    let indices: Vec<String> = indices.into_iter().map(part).collect();
    let base = part(base);
    let base = if accent.is_empty() { base } else { format!("{accent}{{{base}}}") };
    if indices.is_empty() { base } else { format!("{base}_{{{}}}", indices.join(",")) }
}

/// A name without index.
fn part(word: &str) -> String {
    let (letters, digits) = split_digits(word);
    let written = if is_greek(letters) {
        format!("\\{letters}")
    } else if letters.chars().count() == 1 {
        single(letters)
    } else if letters.chars().all(|c| c.is_ascii_digit()) {
        letters.to_owned()
    } else if letters.is_ascii() {
        format!("\\mathrm{{{letters}}}")
    } else {
        format!("\\text{{{letters}}}")
    };
    if digits.is_empty() { written } else { format!("{written}_{{{digits}}}") }
}

fn single(letter: &str) -> String {
    match letter.chars().next().and_then(small_letter_name) {
        Some(name) => format!("\\{name}"),
        None if letter.is_ascii() => letter.to_owned(),
        None => format!("\\text{{{letter}}}"),
    }
}

#[cfg(test)]
mod tests {
    use super::{Latex, name};
    use crate::graph::Unary;
    use crate::text::target::{Target, Text};

    #[test]
    fn squares_of_sines_are_written_as_in_books() {
        let x = Text::atom("x");
        let sine = Latex.unary(Unary::Sin, &x);
        assert_eq!(Latex.power(&sine, 2).text, "\\sin^{2}\\left(x\\right)");
        let sum = Latex.sum(&[(false, sine), (false, x)]);
        assert_eq!(Latex.power(&sum, 2).text, "\\left(\\sin\\left(x\\right) + x\\right)^{2}");
    }

    #[test]
    fn names_become_letters_with_indices() {
        for (user, plain, dotted) in [
            ("theta1", "\\theta_{1}", "\\dot{\\theta}_{1}"),
            ("theta[3]", "\\theta_{3}", "\\dot{\\theta}_{3}"),
            ("x", "x", "\\dot{x}"),
            ("m_cart", "m_{\\mathrm{cart}}", "\\dot{m}_{\\mathrm{cart}}"),
            ("omega_z2", "\\omega_{z_{2}}", "\\dot{\\omega}_{z_{2}}"),
            ("axis.x", "\\mathrm{axis}_{x}", "\\dot{\\mathrm{axis}}_{x}"),
            ("inertia[0, 1]", "\\mathrm{inertia}_{0,1}", "\\dot{\\mathrm{inertia}}_{0,1}"),
            ("θ", "\\theta", "\\dot{\\theta}"),
            ("π2", "\\pi_{2}", "\\dot{\\pi}_{2}"),
            ("ω", "\\omega", "\\dot{\\omega}"),
            ("ξ", "\\xi", "\\dot{\\xi}"),
        ] {
            assert_eq!(name(user, ""), plain);
            assert_eq!(name(user, "\\dot"), dotted);
        }
    }
}

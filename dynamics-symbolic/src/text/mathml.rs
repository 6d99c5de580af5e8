//! MathML Core: presentation only, as browsers show it without scripts or fonts of their own.
//!
//! The symbol of every coordinate, rate, acceleration, parameter and input carries the user's name in
//! `data-s`, so that a page can find it. Every text is a sequence of whole elements.

use crate::graph::{Binary, Comparison, Number, Symbol, Unary};
use crate::mechanics::Model;

use super::names::{Name, letter, split_digits};
use super::target::{Level, Target, Text, decimal};

/// MathML.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MathMl;

/// Between the name of a function and its argument: seen by screen readers only.
const APPLY: &str = "<mo>\u{2061}</mo>";
/// Between factors, likewise.
const TIMES: &str = "<mo>\u{2062}</mo>";
/// Between factors of which one is a word: the space that TeX sets around `\sin`.
const THIN_SPACE: &str = "<mspace width=\"0.17em\"/>";
/// Between numbers, which side by side would read as one.
const DOT: &str = "<mo>⋅</mo>";
/// A minus in front of a term. Behind a parenthesis it would be taken for the operator between two terms.
const LEADING_MINUS: &str = "<mo form=\"prefix\">−</mo>";

impl Target for MathMl {
    fn symbol(&self, model: &Model, symbol: Symbol) -> Text {
        let tagged = |name: &str, dots| self::symbol(name, dots, Some(name));
        let coordinate = |i: u32, dots| tagged(&model.coordinates[i as usize].name, dots);
        Text::atom(match symbol {
            Symbol::Time => "<mi>t</mi>".to_owned(),
            Symbol::Coordinate(i) => coordinate(i, Dots::None),
            Symbol::Rate(i) => coordinate(i, Dots::One),
            Symbol::Acceleration(i) => coordinate(i, Dots::Two),
            Symbol::Input(i) => tagged(&model.inputs[i as usize].name, Dots::None),
            Symbol::Parameter(i) => tagged(&model.parameters[i as usize].name, Dots::None),
            Symbol::Multiplier(i) => {
                format!("<msub><mi>λ</mi>{}</msub>", one(&name(&model.row_name(i), Dots::None)))
            }
            Symbol::Mode(i) => name(&model.mode_name(i), Dots::None),
        })
    }
    fn variable(&self, prefix: &str, number: usize) -> Text {
        Text::atom(format!("<msub><mi>{}</mi><mn>{number}</mn></msub>", escaped(prefix)))
    }
    fn smooth(&self, function: &str, order: u8, argument: &Text) -> Text {
        let plain = self::symbol(function, Dots::None, Some(function));
        let derived = match order {
            0 => plain,
            order => raised(&plain, &format!("<mo>{}</mo>", primes(order))),
        };
        Text::atom(format!("{derived}{APPLY}{}", parentheses(&argument.text)))
    }
    fn number(&self, n: Number) -> Text {
        match n {
            Number::Rational(n, d) if d != 1 => {
                let fraction = fraction(&format!("<mn>{}</mn>", n.unsigned_abs()), &format!("<mn>{d}</mn>"));
                match n < 0 {
                    true => Text::new(format!("{LEADING_MINUS}{fraction}"), Level::Sum),
                    false => Text::new(fraction, Level::Product),
                }
            }
            Number::Rational(n, _) => written(&n.to_string()),
            Number::Float(x) => written(&super::target::float(x)),
        }
    }
    fn coefficient(&self, n: Number) -> (Option<Text>, Option<Text>) {
        match n {
            Number::Rational(1, 1) => (None, None),
            // As in LaTeX: 9.81 reads better than 981/100, ½ better than 0.5.
            Number::Rational(n, d) if d != 1 => {
                let decimal = if d > 8 { decimal(n, d).map(|text| format!("<mn>{text}</mn>")) } else { None };
                let fraction = || fraction(&format!("<mn>{n}</mn>"), &format!("<mn>{d}</mn>"));
                (Some(Text::atom(decimal.unwrap_or_else(fraction))), None)
            }
            n => (Some(self.number(n)), None),
        }
    }
    fn group(&self, inner: &Text) -> Text {
        Text::atom(parentheses(&inner.text))
    }
    fn sum(&self, terms: &[(bool, Text)]) -> Text {
        let mut out = String::new();
        for (i, (minus, term)) in terms.iter().enumerate() {
            match (i, minus) {
                (0, false) => out.push_str(&self.fit(term, Level::Sum)),
                (0, true) => out.push_str(&format!("{LEADING_MINUS}{}", self.fit(term, Level::Product))),
                (_, false) => out.push_str(&format!("<mo>+</mo>{}", self.fit(term, Level::Product))),
                (_, true) => out.push_str(&format!("<mo>−</mo>{}", self.fit(term, Level::Product))),
            }
        }
        Text::new(out, Level::Sum)
    }
    fn product(&self, above: &[Text], below: &[Text]) -> Text {
        let side = |factors: &[Text]| match factors {
            [] => "<mn>1</mn>".to_owned(),
            [one] => one.text.clone(),
            many => juxtaposed(many.iter().map(|f| self.fit(f, Level::Product))),
        };
        if below.is_empty() {
            return Text::new(side(above), Level::Product);
        }
        Text::new(fraction(&side(above), &side(below)), Level::Product)
    }
    fn power(&self, base: &Text, exponent: u32) -> Text {
        let exponent = format!("<mn>{exponent}</mn>");
        // sin²θ, as in books.
        for f in ["sin", "cos", "tan"].map(|f| format!("<mi>{f}</mi>")) {
            let call = base.text.strip_prefix(&f).filter(|_| base.level == Level::Atom);
            if let Some(argument) = call.filter(|rest| rest.starts_with(APPLY)) {
                return Text::new(format!("{}{argument}", raised(&f, &exponent)), Level::Power);
            }
        }
        Text::new(raised(&self.base(base), &exponent), Level::Power)
    }
    fn unary(&self, f: Unary, a: &Text) -> Text {
        let call = |name: &str| Text::atom(format!("<mi>{name}</mi>{APPLY}{}", parentheses(&a.text)));
        match f {
            Unary::Asin => call("arcsin"),
            Unary::Acos => call("arccos"),
            Unary::Atan => call("arctan"),
            Unary::Signum => call("sgn"),
            Unary::Sin | Unary::Cos | Unary::Tan | Unary::Sinh | Unary::Cosh | Unary::Tanh | Unary::Ln => {
                call(f.name())
            }
            Unary::Exp => Text::new(format!("<msup><mi>e</mi>{}</msup>", one(&a.text)), Level::Power),
            Unary::Sqrt => Text::atom(format!("<msqrt>{}</msqrt>", a.text)),
            Unary::Cbrt => Text::atom(format!("<mroot>{}<mn>3</mn></mroot>", one(&a.text))),
            Unary::Abs => Text::atom(format!(
                "<mrow><mo form=\"prefix\" stretchy=\"true\">|</mo>{}<mo form=\"postfix\" \
                 stretchy=\"true\">|</mo></mrow>",
                a.text
            )),
        }
    }
    fn binary(&self, f: Binary, a: &Text, b: &Text) -> Text {
        let call = |name: &str| {
            let arguments = parentheses(&format!("{}<mo>,</mo>{}", a.text, b.text));
            Text::atom(format!("<mi>{name}</mi>{APPLY}{arguments}"))
        };
        match f {
            Binary::Atan2 => call("atan2"),
            Binary::Powf => Text::new(format!("<msup>{}{}</msup>", self.base(a), one(&b.text)), Level::Power),
            Binary::Hypot => call("hypot"),
            Binary::Min => call("min"),
            Binary::Max => call("max"),
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
            Comparison::Less => "&lt;",
            Comparison::LessEqual => "≤",
            Comparison::Equal => "=",
        };
        let condition = format!("<mtext>if\u{a0}</mtext>{}<mo>{sign}</mo>{}", left.text, right.text);
        let row = |value: &str, when: &str| format!("<mtr><mtd>{value}</mtd><mtd>{when}</mtd></mtr>");
        let rows = row(&then.text, &condition) + &row(&otherwise.text, "<mtext>otherwise</mtext>");
        Text::atom(format!("<mrow><mo>{{</mo><mtable columnalign=\"left\">{rows}</mtable></mrow>"))
    }
    fn assign(&self, name: &Text, value: &Text) -> String {
        format!("{}<mo>=</mo>{}", name.text, value.text)
    }
}

impl MathMl {
    /// What can carry an exponent: a single element, all else in parentheses; a root too, whose exponent
    /// would seem to stand under it.
    fn base(self, text: &Text) -> String {
        let is_root = ["<msqrt", "<mroot"].iter().any(|root| text.text.starts_with(root));
        if text.level == Level::Atom && !is_root && is_one(&text.text) {
            text.text.clone()
        } else {
            parentheses(&text.text)
        }
    }

    /// The terms of a sum, each a `<math>` of its own so that lines break between them; the first begins
    /// with `lead`.
    pub(super) fn terms(self, lead: &str, terms: &[(bool, Text)]) -> Vec<String> {
        let written = terms.iter().enumerate().map(|(i, (minus, term))| {
            // A line that begins with an operator would set it as a sign.
            let sign = match (i, minus) {
                (0, false) => lead.to_owned(),
                (0, true) => format!("{lead}{LEADING_MINUS}"),
                (_, false) => "<mo form=\"infix\">+</mo>".to_owned(),
                (_, true) => "<mo form=\"infix\">−</mo>".to_owned(),
            };
            let least = if i == 0 && !minus { Level::Sum } else { Level::Product };
            format!("<math>{sign}{}</math>", self.fit(term, least))
        });
        written.collect()
    }
}

/// What a right-hand side begins with.
pub(super) const EQUALS: &str = "<mo form=\"infix\">=</mo>";

/// Derivatives by time that a symbol shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Dots {
    /// The quantity itself: q.
    #[default]
    None,
    /// Its rate: q̇.
    One,
    /// Its acceleration: q̈.
    Two,
}

/// A user's name as MathML, to be put into `<math>`: `theta1` as θ with index 1.
#[must_use]
pub fn symbol_mathml(user: &str, dots: Dots) -> String {
    symbol(user, dots, None)
}

/// A symbol, its outermost element with `data-s`.
fn symbol(user: &str, dots: Dots, data: Option<&str>) -> String {
    let plain = name(user, dots);
    let Some(data) = data else { return plain };
    let end = plain.find('>').expect("a name is an element");
    format!("{} data-s=\"{}\"{}", &plain[..end], escaped(data), &plain[end..])
}

/// A user's name; the dots go over the letter, not over its index.
pub(super) fn name(user: &str, dots: Dots) -> String {
    let Name { base, indices } = Name::new(user);
    let base = part(base);
    let base = match dots {
        Dots::None => base,
        Dots::One => format!("<mover>{base}<mo>˙</mo></mover>"),
        Dots::Two => format!("<mover>{base}<mo>¨</mo></mover>"),
    };
    let indices: Vec<String> = indices.into_iter().map(part).collect();
    match indices.is_empty() {
        true => base,
        false => format!("<msub>{base}{}</msub>", one(&indices.join("<mo>,</mo>"))),
    }
}

/// A name without index.
fn part(word: &str) -> String {
    if let Some((first, sign, last)) = index_sum(word) {
        return format!("<mrow>{}<mo>{sign}</mo>{}</mrow>", part(first), part(last));
    }
    let (letters, digits) = split_digits(word);
    let written = if letters.chars().all(|c| c.is_ascii_digit()) {
        format!("<mn>{letters}</mn>")
    } else {
        let greek = letter(letters).map(String::from);
        format!("<mi>{}</mi>", escaped(&greek.unwrap_or_else(|| letters.to_owned())))
    };
    if digits.is_empty() { written } else { format!("<msub>{written}<mn>{digits}</mn></msub>") }
}

/// The parts of an index `i + 1` or `nodes - 1`.
fn index_sum(word: &str) -> Option<(&str, &str, &str)> {
    let (first, rest) = word.split_once(' ')?;
    let (sign, last) = rest.split_once(' ')?;
    Some((first, if sign == "-" { "−" } else { sign }, last))
}

/// The sign of a derivative by the argument.
fn primes(order: u8) -> String {
    match order {
        1 => "′".to_owned(),
        2 => "″".to_owned(),
        3 => "‴".to_owned(),
        order => format!("({order})"),
    }
}

/// A decimal number as `to_string` has it.
fn written(plain: &str) -> Text {
    let (sign, digits) = match plain.strip_prefix('-') {
        Some(digits) => (LEADING_MINUS, digits),
        None => ("", plain),
    };
    let (text, level) = match digits.split_once('e') {
        Some((mantissa, exponent)) => {
            let exponent = match exponent.strip_prefix('-') {
                Some(digits) => format!("<mrow>{LEADING_MINUS}<mn>{digits}</mn></mrow>"),
                None => format!("<mn>{exponent}</mn>"),
            };
            (format!("<mn>{mantissa}</mn>{DOT}<msup><mn>10</mn>{exponent}</msup>"), Level::Product)
        }
        None if digits == "inf" => ("<mi>∞</mi>".to_owned(), Level::Atom),
        None => (format!("<mn>{digits}</mn>"), Level::Atom),
    };
    Text::new(format!("{sign}{text}"), if sign.is_empty() { level } else { Level::Sum })
}

/// A base with an exponent or primes: x², and x₁² with both at one place.
fn raised(base: &str, exponent: &str) -> String {
    let indexed = base.strip_prefix("<msub").and_then(|rest| rest.strip_suffix("</msub>"));
    match indexed.filter(|rest| rest.starts_with(['>', ' ']) && is_one(base)) {
        Some(inner) => format!("<msubsup{inner}{exponent}</msubsup>"),
        None => format!("<msup>{}{exponent}</msup>", one(base)),
    }
}

fn fraction(above: &str, below: &str) -> String {
    format!("<mfrac>{}{}</mfrac>", one(above), one(below))
}

fn parentheses(inner: &str) -> String {
    format!("<mrow><mo>(</mo>{inner}<mo>)</mo></mrow>")
}

/// A text as one element.
fn one(text: &str) -> String {
    if is_one(text) { text.to_owned() } else { format!("<mrow>{text}</mrow>") }
}

/// Whether a text is a single element.
fn is_one(text: &str) -> bool {
    let mut depth = 0usize;
    let mut elements = 0;
    for tag in text.split('<').skip(1) {
        if tag.starts_with('/') {
            depth -= 1;
            continue;
        }
        elements += usize::from(depth == 0);
        let is_empty = tag.split('>').next().is_some_and(|inside| inside.ends_with('/'));
        depth += usize::from(!is_empty);
    }
    elements == 1
}

/// Factors side by side: a thin space next to words, a dot between numbers.
fn juxtaposed(factors: impl Iterator<Item = String>) -> String {
    let mut out = String::new();
    for factor in factors {
        if !out.is_empty() {
            out.push_str(match (Neighbour::last(&out), Neighbour::first(&factor)) {
                (Neighbour::Number, Neighbour::Number) => DOT,
                (Neighbour::Word, _) | (_, Neighbour::Word) => THIN_SPACE,
                _ => TIMES,
            });
        }
        out.push_str(&factor);
    }
    out
}

/// What a factor begins or ends with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Neighbour {
    Number,
    Word,
    Other,
}

impl Neighbour {
    fn first(text: &str) -> Self {
        Self::of(text.split('<').find_map(|tag| tag.split_once('>').filter(|(_, inside)| !inside.is_empty())))
    }
    fn last(text: &str) -> Self {
        Self::of(
            text.rsplit('<').find_map(|tag| tag.split_once('>').filter(|(_, inside)| !inside.is_empty())),
        )
    }
    fn of(token: Option<(&str, &str)>) -> Self {
        match token {
            Some((tag, _)) if tag.starts_with("mn") => Self::Number,
            Some((tag, inside)) if tag.starts_with("mi") && inside.chars().nth(1).is_some() => Self::Word,
            _ => Self::Other,
        }
    }
}

/// A text between tags or within quotes.
pub(super) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use core::slice;

    use crate::graph::{Binary, Comparison, Number, Unary};

    use super::{APPLY, Dots, LEADING_MINUS, MathMl, escaped, is_one, symbol, symbol_mathml};
    use crate::text::target::{Level, Target, Text};

    fn x() -> Text {
        Text::atom("<mi>x</mi>")
    }

    #[test]
    fn names_become_letters_with_indices() {
        for (user, plain) in [
            ("x", "<mi>x</mi>"),
            ("theta1", "<msub><mi>θ</mi><mn>1</mn></msub>"),
            ("theta[3]", "<msub><mi>θ</mi><mn>3</mn></msub>"),
            ("m_cart", "<msub><mi>m</mi><mi>cart</mi></msub>"),
            ("omega_z2", "<msub><mi>ω</mi><msub><mi>z</mi><mn>2</mn></msub></msub>"),
            ("Omega", "<mi>Ω</mi>"),
            ("ξ", "<mi>ξ</mi>"),
            ("axis.x", "<msub><mi>axis</mi><mi>x</mi></msub>"),
            ("inertia[0, 1]", "<msub><mi>inertia</mi><mrow><mn>0</mn><mo>,</mo><mn>1</mn></mrow></msub>"),
            ("a<b&c", "<mi>a&lt;b&amp;c</mi>"),
        ] {
            assert_eq!(symbol_mathml(user, Dots::None), plain);
        }
        assert_eq!(symbol_mathml("x", Dots::One), "<mover><mi>x</mi><mo>˙</mo></mover>");
        assert_eq!(
            symbol_mathml("theta1", Dots::Two),
            "<msub><mover><mi>θ</mi><mo>¨</mo></mover><mn>1</mn></msub>"
        );
    }

    #[test]
    fn symbols_carry_the_users_name() {
        assert_eq!(symbol("g", Dots::None, Some("g")), "<mi data-s=\"g\">g</mi>");
        assert_eq!(
            symbol("q[0]", Dots::One, Some("q[0]")),
            "<msub data-s=\"q[0]\"><mover><mi>q</mi><mo>˙</mo></mover><mn>0</mn></msub>"
        );
        assert_eq!(escaped("<a href=\"x\" b='c'>&"), "&lt;a href=&quot;x&quot; b=&#39;c&#39;&gt;&amp;");
    }

    #[test]
    fn exponents_stand_over_indices() {
        let power = |text: &str| MathMl.power(&Text::atom(text), 2).text;
        assert_eq!(power("<mi>x</mi>"), "<msup><mi>x</mi><mn>2</mn></msup>");
        assert_eq!(
            power("<msub data-s=\"l1\"><mi>l</mi><mn>1</mn></msub>"),
            "<msubsup data-s=\"l1\"><mi>l</mi><mn>1</mn><mn>2</mn></msubsup>"
        );
        let sum = MathMl.sum(&[(false, x()), (true, x())]);
        assert_eq!(
            MathMl.power(&sum, 3).text,
            "<msup><mrow><mo>(</mo><mi>x</mi><mo>−</mo><mi>x</mi><mo>)</mo></mrow><mn>3</mn></msup>"
        );
        let root = MathMl.unary(Unary::Sqrt, &x());
        assert_eq!(
            MathMl.power(&root, 3).text,
            "<msup><mrow><mo>(</mo><msqrt><mi>x</mi></msqrt><mo>)</mo></mrow><mn>3</mn></msup>"
        );
    }

    #[test]
    fn squares_of_sines_are_written_as_in_books() {
        let sine = MathMl.unary(Unary::Sin, &x());
        let argument = format!("{APPLY}<mrow><mo>(</mo><mi>x</mi><mo>)</mo></mrow>");
        assert_eq!(MathMl.power(&sine, 2).text, format!("<msup><mi>sin</mi><mn>2</mn></msup>{argument}"));
        // Not those of sums that begin with one.
        let sum = MathMl.sum(&[(false, sine), (false, x())]);
        assert_eq!(
            MathMl.power(&sum, 2).text,
            format!(
                "<msup><mrow><mo>(</mo><mi>sin</mi>{argument}<mo>+</mo><mi>x</mi><mo>)</mo></mrow>\
                 <mn>2</mn></msup>"
            )
        );
    }

    #[test]
    fn derivatives_of_functions_have_primes() {
        let call = |name: &str, order| MathMl.smooth(name, order, &x()).text;
        let argument = format!("{APPLY}<mrow><mo>(</mo><mi>x</mi><mo>)</mo></mrow>");
        let f = "<mi data-s=\"f\">f</mi>";
        assert_eq!(call("f", 0), format!("{f}{argument}"));
        for (order, sign) in [(1, "′"), (2, "″"), (3, "‴"), (4, "(4)")] {
            assert_eq!(call("f", order), format!("<msup>{f}<mo>{sign}</mo></msup>{argument}"));
        }
        assert_eq!(
            call("f_1", 1),
            format!("<msubsup data-s=\"f_1\"><mi>f</mi><mn>1</mn><mo>′</mo></msubsup>{argument}")
        );
    }

    #[test]
    fn numbers_read_as_in_books() {
        let number = |n| MathMl.number(n).text;
        assert_eq!(number(Number::Float(9.81)), "<mn>9.81</mn>");
        assert_eq!(number(Number::Float(-2.0)), format!("{LEADING_MINUS}<mn>2</mn>"));
        assert_eq!(
            number(Number::Float(6.674e-11)),
            format!(
                "<mn>6.674</mn><mo>⋅</mo><msup><mn>10</mn><mrow>{LEADING_MINUS}<mn>11</mn></mrow></msup>"
            )
        );
        assert_eq!(
            number(Number::Rational(-1, 3)),
            format!("{LEADING_MINUS}<mfrac><mn>1</mn><mn>3</mn></mfrac>")
        );
        let coefficient = |n| MathMl.coefficient(n).0.map(|text| text.text);
        assert_eq!(coefficient(Number::ONE), None);
        assert_eq!(coefficient(Number::Rational(981, 100)).as_deref(), Some("<mn>9.81</mn>"));
        let half = "<mfrac><mn>1</mn><mn>2</mn></mfrac>";
        assert_eq!(coefficient(Number::Rational(1, 2)).as_deref(), Some(half));
    }

    #[test]
    fn factors_are_kept_apart() {
        let product = |texts: &[&str]| {
            let factors: Vec<Text> = texts.iter().map(|t| Text::atom(*t)).collect();
            MathMl.product(&factors, &[]).text
        };
        let space = "<mspace width=\"0.17em\"/>";
        assert_eq!(product(&["<mi>m</mi>", "<mi>g</mi>"]), "<mi>m</mi><mo>\u{2062}</mo><mi>g</mi>");
        assert_eq!(product(&["<mi>m</mi>", "<mi>sin</mi>"]), format!("<mi>m</mi>{space}<mi>sin</mi>"));
        assert_eq!(product(&["<mi>cart</mi>", "<mi>g</mi>"]), format!("<mi>cart</mi>{space}<mi>g</mi>"));
        assert_eq!(product(&["<mn>2</mn>", "<mn>3</mn>"]), "<mn>2</mn><mo>⋅</mo><mn>3</mn>");
    }

    #[test]
    fn arguments_of_schemata_are_single_elements() {
        assert!(is_one("<mi>x</mi>") && is_one("<msub><mi>x</mi><mn>1</mn></msub>"));
        assert!(!is_one("<mi>x</mi><mi>y</mi>") && !is_one("<mi>x</mi><mspace width=\"0.17em\"/>"));
        let sum = MathMl.sum(&[(true, x()), (false, x())]);
        let inner = format!("<mrow>{LEADING_MINUS}<mi>x</mi><mo>+</mo><mi>x</mi></mrow>");
        assert_eq!(MathMl.unary(Unary::Exp, &sum).text, format!("<msup><mi>e</mi>{inner}</msup>"));
        assert_eq!(MathMl.unary(Unary::Cbrt, &sum).text, format!("<mroot>{inner}<mn>3</mn></mroot>"));
        assert_eq!(
            MathMl.product(&[x()], slice::from_ref(&sum)).text,
            format!("<mfrac><mi>x</mi>{inner}</mfrac>")
        );
        assert_eq!(MathMl.binary(Binary::Powf, &x(), &sum).text, format!("<msup><mi>x</mi>{inner}</msup>"));
    }

    #[test]
    fn selections_are_cases() {
        let cases = MathMl.select(Comparison::Less, [&x(), &x()], &x(), &x());
        assert_eq!(cases.level, Level::Atom);
        assert!(cases.text.contains("<mo>&lt;</mo>") && is_one(&cases.text), "{}", cases.text);
    }
}

//! Unit expressions as users write them: `m / s^2`, `N*m`, `kg*m^2/s`, `1`, `_`.

use super::table::{COHERENT, MISSPELLED, SCALED};
use super::{Dimension, Exponent, System};

/// A declared unit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unit {
    /// Its dimension.
    pub dimension: Dimension,
    /// The system it belongs to; `None` for units of both (`s`, `rad`, `1`).
    pub system: Option<System>,
    /// As written, without spaces; empty for `1`. Radians are kept here although they count as 1.
    pub text: String,
}

/// Why a text is not a unit. `token` is the position among the tokens that were given.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum UnitError {
    /// A name that is no unit.
    Unknown {
        /// The name.
        name: String,
        /// What was probably meant.
        suggestion: Option<&'static str>,
        /// Position.
        token: usize,
    },
    /// A multiple of a coherent unit; values are to be given in the coherent one.
    Scaled {
        /// The name, for example `mm`.
        name: String,
        /// What it is worth, for example `0.001 m`.
        equals: &'static str,
        /// The coherent unit, for example `m`.
        coherent: &'static str,
        /// Position.
        token: usize,
    },
    /// Units of two systems in one expression.
    Mixed {
        /// The unit that does not fit.
        name: String,
        /// Its system.
        system: System,
        /// The system of what stands before it.
        before: System,
        /// Position.
        token: usize,
    },
    /// Not the grammar of units.
    Syntax {
        /// What was expected: `a unit`, `an integer exponent`, `\`*\` or \`/\``, ….
        expected: &'static str,
        /// What stands there; `None` at the end.
        found: Option<String>,
        /// Position.
        token: usize,
    },
    /// An exponent beyond all reason.
    Exponent {
        /// Position.
        token: usize,
    },
}

impl UnitError {
    /// Position of the offending token; one past the last where something is missing.
    #[must_use]
    pub fn token(&self) -> usize {
        match self {
            Self::Unknown { token, .. }
            | Self::Scaled { token, .. }
            | Self::Mixed { token, .. }
            | Self::Syntax { token, .. }
            | Self::Exponent { token } => *token,
        }
    }
}

/// Most parentheses within parentheses. Deeper ones are an error, so that parsing cannot exhaust the stack.
const MOST_PARENTHESES: usize = 32;

impl Unit {
    /// Parses a text; `None` for `_`, a unit to be inferred.
    ///
    /// # Errors
    /// See [`UnitError`]; its tokens are names, integers or decimals, and single signs.
    pub fn parse(text: &str) -> Result<Option<Self>, UnitError> {
        let tokens = tokens(text);
        Self::parse_tokens(&tokens)
    }

    /// Parses tokens: names, numbers, and the signs `*` `/` `^` `-` `(` `)` one by one.
    ///
    /// # Errors
    /// See [`UnitError`].
    pub fn parse_tokens<S: AsRef<str>>(tokens: &[S]) -> Result<Option<Self>, UnitError> {
        let tokens: Vec<&str> = tokens.iter().map(AsRef::as_ref).collect();
        if tokens == ["_"] {
            return Ok(None);
        }
        let mut parser = Parser { tokens: &tokens, at: 0, system: None };
        let dimension = parser.product(0)?;
        if parser.at < tokens.len() {
            return Err(parser.expected("`*` or `/`"));
        }
        let text = if tokens == ["1"] { String::new() } else { tokens.concat() };
        Ok(Some(Self { dimension, system: parser.system, text }))
    }
}

/// Splits a text into names, numbers and single signs.
fn tokens(text: &str) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    let mut word = false;
    for c in text.chars() {
        let part = c.is_alphanumeric() || c == '_' || c == '.';
        match out.last_mut() {
            Some(last) if part && word => last.push(c),
            _ if c.is_whitespace() => {}
            _ => out.push(c.to_string()),
        }
        word = part;
    }
    out
}

struct Parser<'a> {
    tokens: &'a [&'a str],
    at: usize,
    system: Option<System>,
}

impl<'a> Parser<'a> {
    fn peek(&self) -> Option<&'a str> {
        self.tokens.get(self.at).copied()
    }
    fn take(&mut self, sign: &str) -> bool {
        let there = self.peek() == Some(sign);
        self.at += usize::from(there);
        there
    }
    fn expected(&self, expected: &'static str) -> UnitError {
        UnitError::Syntax { expected, found: self.peek().map(str::to_owned), token: self.at }
    }

    fn product(&mut self, depth: usize) -> Result<Dimension, UnitError> {
        let mut product = self.power(depth)?;
        loop {
            let divide = match self.peek() {
                Some("*") => false,
                Some("/") => true,
                _ => return Ok(product),
            };
            self.at += 1;
            let start = self.at;
            let factor = self.power(depth)?;
            let exponent = Exponent::integer(if divide { -1 } else { 1 });
            product = factor
                .pow(exponent)
                .and_then(|f| product.mul(&f))
                .ok_or(UnitError::Exponent { token: start })?;
        }
    }

    fn power(&mut self, depth: usize) -> Result<Dimension, UnitError> {
        let base = self.atom(depth)?;
        if !self.take("^") {
            return Ok(base);
        }
        let start = self.at;
        let exponent = self.exponent()?;
        base.pow(exponent).ok_or(UnitError::Exponent { token: start })
    }

    fn atom(&mut self, depth: usize) -> Result<Dimension, UnitError> {
        let token = self.at;
        if self.take("(") {
            if depth == MOST_PARENTHESES {
                return Err(UnitError::Syntax {
                    expected: "fewer parentheses",
                    found: Some("(".to_owned()),
                    token,
                });
            }
            let inner = self.product(depth + 1)?;
            return if self.take(")") { Ok(inner) } else { Err(self.expected("`)`")) };
        }
        if self.take("1") {
            return Ok(Dimension::ONE);
        }
        match self.peek() {
            Some(name) if name.starts_with(|c: char| c.is_alphabetic()) => {
                let name = name.to_owned();
                self.at += 1;
                self.named(name, token)
            }
            _ => Err(self.expected("a unit")),
        }
    }

    fn named(&mut self, name: String, token: usize) -> Result<Dimension, UnitError> {
        if let Some(unit) = COHERENT.iter().find(|u| u.name == name) {
            return match (self.system, unit.system) {
                (Some(before), Some(system)) if before != system => {
                    Err(UnitError::Mixed { name, system, before, token })
                }
                (before, system) => {
                    self.system = before.or(system);
                    Ok(unit.dimension)
                }
            };
        }
        if let Some((_, equals, coherent)) = SCALED.iter().find(|(scaled, ..)| *scaled == name) {
            return Err(UnitError::Scaled { name, equals, coherent, token });
        }
        let suggestion = MISSPELLED.iter().find(|(wrong, _)| *wrong == name).map(|(_, right)| *right);
        Err(UnitError::Unknown { name, suggestion, token })
    }

    /// `2`, `-2`, `0.5`, `(1/2)`, `(-1/2)`.
    fn exponent(&mut self) -> Result<Exponent, UnitError> {
        if self.take("(") {
            let numerator = self.signed()?;
            let value = if self.take("/") {
                let token = self.at;
                let denominator = self.signed()?;
                numerator.over(denominator).ok_or(UnitError::Exponent { token })?
            } else {
                numerator
            };
            return if self.take(")") { Ok(value) } else { Err(self.expected("`)`")) };
        }
        self.signed()
    }

    fn signed(&mut self) -> Result<Exponent, UnitError> {
        let negative = self.take("-");
        let token = self.at;
        let wrong = self.expected("a number as exponent");
        let digits = self.peek().ok_or(wrong.clone())?;
        let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
        let all = format!("{whole}{fraction}");
        if all.is_empty() || !all.bytes().all(|b| b.is_ascii_digit()) {
            return Err(wrong);
        }
        // Exponents of more digits than this are a mistake, not physics.
        if all.len() > 6 {
            return Err(UnitError::Exponent { token });
        }
        let magnitude: i128 = all.parse().map_err(|_| wrong)?;
        self.at += 1;
        let scale = 10i128.pow(u32::try_from(fraction.len()).unwrap_or(0));
        let signed = if negative { -magnitude } else { magnitude };
        Exponent::ratio(signed, scale).ok_or(UnitError::Exponent { token })
    }
}

#[cfg(test)]
mod tests {
    use super::super::table::{COHERENT, MISSPELLED, SCALED};
    use super::{Dimension, System, Unit, UnitError};

    fn unit(text: &str) -> Unit {
        Unit::parse(text).unwrap().unwrap()
    }

    #[test]
    fn unit_expressions_have_the_dimension_that_they_say() {
        for (text, dimension, system) in [
            ("1", Dimension::ONE, None),
            ("rad", Dimension::ONE, None),
            ("rad / s", Dimension::mechanical(0, 0, -1), None),
            ("m / s ^ 2", Dimension::mechanical(1, 0, -2), Some(System::Si)),
            ("N*m", Dimension::ENERGY, Some(System::Si)),
            ("kg*m^2/s", Dimension::mechanical(2, 1, -1), Some(System::Si)),
            ("kg*m^2*s^-1", Dimension::mechanical(2, 1, -1), Some(System::Si)),
            ("m^3/(kg*s^2)", Dimension::mechanical(3, -1, -2), Some(System::Si)),
            ("ft*lb", Dimension::ENERGY, Some(System::UsCustomary)),
            ("lbf/ft", Dimension::mechanical(0, 1, -2), Some(System::UsCustomary)),
            ("1/s", Dimension::mechanical(0, 0, -1), None),
            ("V*A", Dimension::POWER, Some(System::Si)),
            ("T*A*m", Dimension::FORCE, Some(System::Si)),
        ] {
            let unit = unit(text);
            assert_eq!((unit.dimension, unit.system), (dimension, system), "{text}");
        }
        assert_eq!(unit("(m^(1/2))^2"), Unit { text: "(m^(1/2))^2".to_owned(), ..unit("m") });
        assert_eq!(unit("m^0.5").dimension, unit("m^(1/2)").dimension);
        assert_eq!(Unit::parse("_"), Ok(None));
        assert_eq!(unit("rad/s").text, "rad/s");
        assert_eq!(unit("1").text, "");
    }

    #[test]
    fn what_is_no_coherent_unit_is_an_error_at_its_token() {
        let error = |text: &str| Unit::parse(text).unwrap_err();
        assert_eq!(
            error("kg*mm"),
            UnitError::Scaled { name: "mm".into(), equals: "0.001 m", coherent: "m", token: 2 }
        );
        assert_eq!(error("sec"), UnitError::Unknown { name: "sec".into(), suggestion: Some("s"), token: 0 });
        assert_eq!(error("m/foo"), UnitError::Unknown { name: "foo".into(), suggestion: None, token: 2 });
        assert_eq!(
            error("slug*m"),
            UnitError::Mixed { name: "m".into(), system: System::Si, before: System::UsCustomary, token: 2 }
        );
        for (text, expected, found, token) in [
            ("", "a unit", None, 0),
            ("N m", "`*` or `/`", Some("m"), 1),
            ("m*", "a unit", None, 2),
            ("m**2", "a unit", Some("*"), 2),
            ("m^", "a number as exponent", None, 2),
            ("m^x", "a number as exponent", Some("x"), 2),
            ("(m", "`)`", None, 2),
            ("m)", "`*` or `/`", Some(")"), 1),
            ("2*m", "a unit", Some("2"), 0),
        ] {
            let found = found.map(str::to_owned);
            assert_eq!(error(text), UnitError::Syntax { expected, found, token }, "{text}");
        }
        assert_eq!(error("m^(1/0)").token(), 5);
        assert_eq!(error("m^99999999999999").token(), 2);
        assert!(matches!(
            error(&"(".repeat(100_000)),
            UnitError::Syntax { expected: "fewer parentheses", .. }
        ));
    }

    #[test]
    fn the_tables_agree_with_each_other() {
        let names = COHERENT
            .iter()
            .map(|u| u.name)
            .chain(SCALED.iter().map(|s| s.0))
            .chain(MISSPELLED.iter().map(|m| m.0));
        let mut names: Vec<&str> = names.collect();
        let all = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), all, "a name stands in two tables");
        for (name, equals, coherent) in SCALED {
            assert!(equals.ends_with(coherent), "{name}");
            assert!(Unit::parse(coherent).is_ok(), "{name}");
        }
        for (name, right) in MISSPELLED {
            assert!(Unit::parse(right).is_ok(), "{name}");
        }
    }
}

//! One line of measurements: a flat JSON object of texts, numbers and lists of numbers.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

/// The value of a field.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum JsonValue {
    Null,
    Truth(bool),
    Number(f64),
    Text(String),
    Numbers(Vec<f64>),
}

/// The names and values of an object, in their order; the reason if the line is no such object.
pub(super) fn object(line: &str) -> Result<Vec<(String, JsonValue)>, String> {
    let mut rest = Reader { rest: line };
    rest.expect('{')?;
    let mut fields = Vec::new();
    if !rest.take('}') {
        loop {
            let name = rest.text()?;
            rest.expect(':')?;
            let value = rest.value()?;
            if fields.iter().any(|(other, _)| *other == name) {
                return Err(format!("`{name}` stands there twice"));
            }
            fields.push((name, value));
            if rest.take('}') {
                break;
            }
            rest.expect(',')?;
        }
    }
    match rest.peek() {
        None => Ok(fields),
        Some(_) => Err(format!("`{}` follows the object", shortened(rest.rest))),
    }
}

struct Reader<'a> {
    rest: &'a str,
}

impl Reader<'_> {
    fn peek(&mut self) -> Option<char> {
        self.rest = self.rest.trim_start_matches([' ', '\t', '\r', '\n']);
        self.rest.chars().next()
    }

    fn take(&mut self, c: char) -> bool {
        let there = self.peek() == Some(c);
        if there {
            self.rest = &self.rest[c.len_utf8()..];
        }
        there
    }

    fn expect(&mut self, c: char) -> Result<(), String> {
        if self.take(c) {
            return Ok(());
        }
        let found = if self.rest.is_empty() { "the end" } else { shortened(self.rest) };
        Err(format!("`{c}` expected, not `{found}`"))
    }

    fn value(&mut self) -> Result<JsonValue, String> {
        match self.peek() {
            Some('"') => self.text().map(JsonValue::Text),
            Some('[') => self.numbers().map(JsonValue::Numbers),
            Some('{') => Err("an object within the object".into()),
            _ => {
                for (word, value) in [
                    ("null", JsonValue::Null),
                    ("true", JsonValue::Truth(true)),
                    ("false", JsonValue::Truth(false)),
                ] {
                    if let Some(rest) = self.rest.strip_prefix(word) {
                        self.rest = rest;
                        return Ok(value);
                    }
                }
                self.number().map(JsonValue::Number)
            }
        }
    }

    fn numbers(&mut self) -> Result<Vec<f64>, String> {
        self.expect('[')?;
        let mut numbers = Vec::new();
        if self.take(']') {
            return Ok(numbers);
        }
        loop {
            self.peek();
            numbers.push(self.number()?);
            if self.take(']') {
                return Ok(numbers);
            }
            self.expect(',')?;
        }
    }

    fn number(&mut self) -> Result<f64, String> {
        let ends = |c: char| !(c.is_ascii_digit() || matches!(c, '+' | '-' | '.' | 'e' | 'E'));
        let (digits, rest) = self.rest.split_at(self.rest.find(ends).unwrap_or(self.rest.len()));
        // `f64` also reads `.5` and `+1`, which JSON does not allow. Accepting them does no harm.
        match digits.parse::<f64>() {
            Ok(number) if number.is_finite() => {
                self.rest = rest;
                Ok(number)
            }
            _ => Err(format!("`{}` is no value", shortened(self.rest))),
        }
    }

    fn text(&mut self) -> Result<String, String> {
        self.expect('"')?;
        let mut text = String::new();
        let mut chars = self.rest.chars();
        loop {
            match chars.next().ok_or("a text without its end")? {
                '"' => break,
                '\\' => match chars.next().ok_or("a text without its end")? {
                    c @ ('"' | '\\' | '/') => text.push(c),
                    'n' => text.push('\n'),
                    't' => text.push('\t'),
                    'r' => text.push('\r'),
                    'b' | 'f' => text.push(' '),
                    'u' => {
                        let code =
                            chars.as_str().get(..4).and_then(|digits| u32::from_str_radix(digits, 16).ok());
                        // Halves of surrogate pairs become the replacement character.
                        text.push(
                            char::from_u32(code.ok_or("`\\u` without four digits")?).unwrap_or('\u{fffd}'),
                        );
                        chars = chars.as_str()[4..].chars();
                    }
                    c => return Err(format!("`\\{c}` in a text")),
                },
                c => text.push(c),
            }
        }
        self.rest = chars.as_str();
        Ok(text)
    }
}

/// The beginning of a text, for messages.
fn shortened(text: &str) -> &str {
    let text = text.trim_end();
    text.char_indices().nth(12).map_or(text, |(at, _)| &text[..at])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flat_objects_are_read() {
        let fields =
            object(r#" {"a": 1e-3, "b":"x\"\u00e9\n", "c":[1, -2.5,3E2 ], "d":null,"e":true,"f":[]} "#)
                .unwrap();
        let values: Vec<JsonValue> = fields.into_iter().map(|(_, value)| value).collect();
        assert_eq!(
            values,
            [
                JsonValue::Number(1e-3),
                JsonValue::Text("x\"é\n".into()),
                JsonValue::Numbers([1.0, -2.5, 300.0].to_vec()),
                JsonValue::Null,
                JsonValue::Truth(true),
                JsonValue::Numbers(Vec::new())
            ]
        );
        assert_eq!(object("{}").unwrap(), []);
    }

    #[test]
    fn what_is_no_flat_object_is_said() {
        for (line, message) in [
            ("", "`{` expected, not `the end`"),
            ("[1]", "`{` expected, not `[1]`"),
            ("{\"a\":}", "`}` is no value"),
            ("{\"a\":1e999}", "`1e999}` is no value"),
            ("{\"a\":NaN}", "`NaN}` is no value"),
            ("{\"a\":1 \"b\":2}", "`,` expected, not `\"b\":2}`"),
            ("{\"a\":1,}", "`\"` expected, not `}`"),
            ("{\"a\":\"x", "a text without its end"),
            ("{\"a\":\"\\u12\"}", "`\\u` without four digits"),
            ("{\"a\":{}}", "an object within the object"),
            ("{\"a\":1,\"a\":2}", "`a` stands there twice"),
            ("{\"a\":1} x", "`x` follows the object"),
            ("{\"a\":[1;2]}", "`,` expected, not `;2]}`"),
        ] {
            assert_eq!(object(line).unwrap_err(), message, "{line}");
        }
    }
}

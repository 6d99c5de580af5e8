//! A small strict reader of JSON for the tests: what it accepts, browsers accept.

use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::ops::Index;

#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Json {
    Null,
    Bool(bool),
    Number(f64),
    Text(String),
    List(Vec<Json>),
    Object(Vec<(String, Json)>),
}

impl Json {
    pub(crate) fn list(&self) -> &[Json] {
        match self {
            Self::List(items) => items,
            other => panic!("{other:?} is no list"),
        }
    }

    pub(crate) fn number(&self) -> f64 {
        match self {
            Self::Number(number) => *number,
            other => panic!("{other:?} is no number"),
        }
    }

    pub(crate) fn text(&self) -> &str {
        match self {
            Self::Text(text) => text,
            other => panic!("{other:?} is no text"),
        }
    }
}

impl Index<&str> for Json {
    type Output = Json;
    fn index(&self, name: &str) -> &Json {
        let Self::Object(members) = self else { panic!("{self:?} is no object") };
        &members.iter().find(|(known, _)| known == name).unwrap_or_else(|| panic!("no `{name}`")).1
    }
}

/// Panics, naming the place, where `text` is not one JSON value.
pub(crate) fn read(text: &str) -> Json {
    let mut rest = text;
    let value = value(&mut rest);
    assert_eq!(rest.trim_start(), "", "after the value");
    value
}

fn take(rest: &mut &str, token: &str) -> bool {
    *rest = rest.trim_start();
    rest.strip_prefix(token).map(|after| *rest = after).is_some()
}

fn value(rest: &mut &str) -> Json {
    for (token, value) in [("null", Json::Null), ("true", Json::Bool(true)), ("false", Json::Bool(false))] {
        if take(rest, token) {
            return value;
        }
    }
    if take(rest, "[") {
        return Json::List(items(rest, "]", value));
    }
    if take(rest, "{") {
        let member = |rest: &mut &str| {
            assert!(take(rest, "\""), "a name at {rest:.20}");
            let name = string(rest);
            assert!(take(rest, ":"), "a colon at {rest:.20}");
            (name, value(rest))
        };
        let members = items(rest, "}", member);
        for (k, (name, _)) in members.iter().enumerate() {
            assert!(members[..k].iter().all(|(other, _)| other != name), "`{name}` twice");
        }
        return Json::Object(members);
    }
    if take(rest, "\"") {
        return Json::Text(string(rest));
    }
    let end = rest.find(|c: char| !(c.is_ascii_digit() || "+-.eE".contains(c))).unwrap_or(rest.len());
    let (number, after) = rest.split_at(end);
    *rest = after;
    let digits = number.strip_prefix('-').unwrap_or(number);
    let plain = digits.starts_with('0') && digits.len() > 1 && digits.as_bytes()[1].is_ascii_digit();
    assert!(
        digits.starts_with(|c: char| c.is_ascii_digit()) && !plain && !digits.ends_with('.'),
        "number `{number}`"
    );
    Json::Number(number.parse().unwrap())
}

fn items<T>(rest: &mut &str, end: &str, item: impl Fn(&mut &str) -> T) -> Vec<T> {
    let mut items = Vec::new();
    if take(rest, end) {
        return items;
    }
    loop {
        items.push(item(rest));
        if take(rest, end) {
            return items;
        }
        assert!(take(rest, ","), "a comma at {:?}", rest.chars().take(20).collect::<String>());
    }
}

fn string(rest: &mut &str) -> String {
    let mut out = String::new();
    let mut chars = rest.char_indices();
    while let Some((at, c)) = chars.next() {
        match c {
            '"' => {
                *rest = &rest[at + 1..];
                return out;
            }
            '\\' => match chars.next().map(|(_, c)| c) {
                Some('u') => {
                    let digits: String = chars.by_ref().take(4).map(|(_, c)| c).collect();
                    let code = u32::from_str_radix(&digits, 16).unwrap();
                    out.push(char::from_u32(code).unwrap());
                }
                Some('n') => out.push('\n'),
                Some(c @ ('"' | '\\' | '/')) => out.push(c),
                other => panic!("escape {other:?}"),
            },
            c => {
                assert!(c >= ' ', "a control character in a string");
                out.push(c);
            }
        }
    }
    panic!("a string does not end: {out}")
}

#[test]
fn the_reader_is_not_blind() {
    let read_back = read(" {\"a\": [1, -2.5e-3, null, true], \"b\": \"\\u003c\\n\\\"\"} ");
    assert_eq!(read_back["a"].list()[1], Json::Number(-2.5e-3));
    assert_eq!(read_back["b"], Json::Text("<\n\"".to_string()));
    for bad in [
        "[1,]",
        "[1 2]",
        "{\"a\":1,\"a\":2}",
        "NaN",
        "01",
        "1.",
        "\"a",
        "{a:1}",
        "[] []",
        "inf",
        "\"\n\"",
        "",
    ] {
        assert!(std::panic::catch_unwind(|| read(bad)).is_err(), "{bad}");
    }
}

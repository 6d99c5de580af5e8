//! Text for XML, JSON, tables and readers: escaping and number formats.

use alloc::format;
use alloc::string::String;
use core::fmt::Write;

/// `text` for XML or HTML content and quoted attributes. Characters that XML 1.0 forbids become U+FFFD.
pub fn xml(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            '\t' | '\n' | '\r' => out.push(c),
            c if c < ' ' || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

/// `text` as a JSON string, quotes included, safe inside an HTML `script` element.
pub fn json(text: &str) -> String {
    let mut out = String::with_capacity(text.len() + 2);
    out.push('"');
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            '\n' => out.push_str("\\n"),
            // `</script>` and `<!--` would end or confuse the element that carries the data.
            '<' | '>' | '&' | '\u{2028}' | '\u{2029}' => {
                let _ = write!(out, "\\u{:04x}", c as u32);
            }
            c if c < ' ' => {
                let _ = write!(out, "\\u{:04x}", c as u32);
            }
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

/// `x` as a JSON number that reads back as the same value; `null` where JSON has no number for it.
pub fn json_number(x: f64) -> String {
    if x.is_finite() { exact(x) } else { String::from("null") }
}

/// The shortest digits that read back as `x`, with an exponent where plain digits would be long.
pub fn exact(x: f64) -> String {
    let magnitude = x.abs();
    if x == 0.0 || !x.is_finite() || (1e-5..1e16).contains(&magnitude) {
        format!("{x}")
    } else {
        format!("{x:e}")
    }
}

/// `template` with every `{{name}}` replaced; what is put in is not looked at again, whatever it holds.
pub fn fill(template: &str, values: &[(&str, &str)]) -> String {
    let mut out = String::new();
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        out.push_str(before);
        let (name, after) = after.split_once("}}").unwrap_or((after, ""));
        let value = values.iter().find(|(known, _)| *known == name);
        out.push_str(value.map_or("", |(_, value)| value));
        rest = after;
    }
    out.push_str(rest);
    out
}

/// A field of a table of comma-separated values, after RFC 4180.
pub fn quoted(field: String) -> String {
    if field.contains([',', '"', '\n', '\r']) { format!("\"{}\"", field.replace('"', "\"\"")) } else { field }
}

/// `x` with `digits` significant digits for people: `1234`, `0.00123`, `1.2×10⁻⁹`; a real minus sign, no
/// trailing zeros.
pub fn readable(x: f64, digits: usize) -> String {
    if !x.is_finite() {
        return format!("{x}");
    }
    let rounded = format!("{:.*e}", digits.saturating_sub(1), x);
    let Some((mantissa, exponent)) = rounded.split_once('e') else {
        return rounded;
    };
    let exponent: i32 = exponent.parse().unwrap_or(0);
    if x == 0.0 {
        return String::from("0");
    }
    if (-4..6).contains(&exponent) {
        let decimals = usize::try_from(digits as i32 - 1 - exponent).unwrap_or(0);
        return minus(&trimmed(&format!("{x:.decimals$}")));
    }
    match trimmed(mantissa).as_str() {
        "1" => power_of_ten(exponent),
        "-1" => format!("−{}", power_of_ten(exponent)),
        mantissa => format!("{}×{}", minus(mantissa), power_of_ten(exponent)),
    }
}

/// `10⁻³`, with 1 and 10 as such.
pub(crate) fn power_of_ten(exponent: i32) -> String {
    match exponent {
        0 => return String::from("1"),
        1 => return String::from("10"),
        _ => {}
    }
    let mut out = String::from("10");
    out.extend(format!("{exponent}").chars().map(superscript));
    out
}

/// A digit or an ASCII hyphen of an exponent, raised.
fn superscript(c: char) -> char {
    match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '0' | '4'..='9' => char::from_u32('⁰' as u32 + c as u32 - '0' as u32).unwrap_or(c),
        other => other,
    }
}

/// A number's ASCII hyphen as a minus sign.
pub(crate) fn minus(number: &str) -> String {
    number.replace('-', "−")
}

/// Without the zeros after the decimal point that say nothing.
pub(crate) fn trimmed(number: &str) -> String {
    if number.contains('.') {
        let number = number.trim_end_matches('0').trim_end_matches('.');
        String::from(if number == "-0" { "0" } else { number })
    } else {
        String::from(number)
    }
}

/// A coordinate of a picture in pixels: a tenth of a pixel is as fine as anyone sees.
pub(crate) fn pixel(x: f64) -> String {
    trimmed(&format!("{x:.1}"))
}

/// A unit as it is printed: `m/s²` for `m/s^2`, `kg·m²` for `kg*m^2`. What is no power of a whole number
/// stays as it is.
pub fn typeset(unit: &str) -> String {
    let mut out = String::with_capacity(unit.len());
    let mut rest = unit;
    while let Some(c) = rest.chars().next() {
        rest = &rest[c.len_utf8()..];
        match c {
            '*' => out.push('·'),
            '^' => {
                let sign = usize::from(rest.starts_with('-'));
                let digits = rest[sign..].bytes().take_while(u8::is_ascii_digit).count();
                let (power, after) = rest.split_at(sign + digits);
                let whole = digits > 0 && !after.starts_with('.');
                if whole {
                    out.extend(power.chars().map(superscript));
                    rest = after;
                } else {
                    out.push('^');
                }
            }
            c => out.push(c),
        }
    }
    out
}

/// `name in unit` with the unit typeset, or the name alone: titles of axes and columns of pages.
pub fn with_unit(name: &str, unit: &str) -> String {
    if unit.is_empty() { String::from(name) } else { format!("{name} in {}", typeset(unit)) }
}

/// A value for people, with its unit, typeset, where that is known.
pub(crate) fn value_with_unit(value: f64, unit: &str) -> String {
    let value = readable(value, 3);
    if unit.is_empty() { value } else { format!("{value} {}", typeset(unit)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hostile_text_is_escaped() {
        assert_eq!(xml("<a b='\"'>&\u{0}"), "&lt;a b=&#39;&quot;&#39;&gt;&amp;\u{fffd}");
        assert_eq!(json("</script>\"\\\n\u{1}"), "\"\\u003c/script\\u003e\\\"\\\\\\n\\u0001\"");
    }

    #[test]
    fn only_what_must_be_is_quoted() {
        assert_eq!(quoted("theta[1] [rad]".into()), "theta[1] [rad]");
        assert_eq!(quoted("a,b \"c\"".into()), "\"a,b \"\"c\"\"\"");
    }

    #[test]
    fn json_knows_no_infinity() {
        assert_eq!(json_number(f64::NAN), "null");
        assert_eq!(json_number(f64::NEG_INFINITY), "null");
        assert_eq!(json_number(-2.5e-300), "-2.5e-300");
    }

    #[test]
    fn exact_numbers_read_back() {
        for x in [0.1, 1.0 / 3.0, 1e300, 5e-324, f64::MAX, -0.0, 123_456.789, 1e16, 1e-5] {
            let back: f64 = exact(x).parse().unwrap();
            assert_eq!(back.to_bits(), x.to_bits(), "{}", exact(x));
            assert!(exact(x).len() < 26);
        }
        assert_eq!(
            (exact(1e20).as_str(), exact(-2.5e-7).as_str(), exact(1e15).as_str()),
            ("1e20", "-2.5e-7", "1000000000000000")
        );
        assert!(exact(f64::NAN).parse::<f64>().unwrap().is_nan());
    }

    #[test]
    fn units_are_typeset() {
        let units =
            ["m/s^2", "kg*m^2", "rad/s", "N*m*s/rad", "m^-1", "kg/(m*s^10)", "m^0.5", "m^", "", "(m/s)/s"];
        let printed =
            ["m/s²", "kg·m²", "rad/s", "N·m·s/rad", "m⁻¹", "kg/(m·s¹⁰)", "m^0.5", "m^", "", "(m/s)/s"];
        assert_eq!(units.map(typeset), printed);
        assert_eq!(with_unit("x", "m/s^2"), "x in m/s²");
        assert_eq!(value_with_unit(0.5, "kg*m^2"), "0.5 kg·m²");
    }

    #[test]
    fn numbers_for_people() {
        assert_eq!(readable(1234.0, 3), "1234");
        assert_eq!(readable(0.00123, 3), "0.00123");
        assert_eq!(readable(-1.25e-9, 3), "−1.25×10⁻⁹");
        assert_eq!(readable(1e7, 3), "10⁷");
        assert_eq!(readable(-1e-20, 2), "−10⁻²⁰");
        assert_eq!(readable(0.0, 3), "0");
        assert_eq!(readable(9.9999, 3), "10");
        assert_eq!(power_of_ten(-304), "10⁻³⁰⁴");
    }
}

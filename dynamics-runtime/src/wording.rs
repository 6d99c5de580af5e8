//! Numbers in messages and summaries: times, counts and multiples in few digits.

use core::fmt;

/// Absolute values that are written without a power of ten: with at most seven digits before the point, or
/// four zeros behind it.
const RANGE_WITHOUT_EXPONENT: core::ops::Range<f64> = 1e-4..1e7;

fn needs_no_exponent(x: f64) -> bool {
    x == 0.0 || !x.is_finite() || RANGE_WITHOUT_EXPONENT.contains(&x.abs())
}

/// A number with all its digits, and a power of ten where it is very large or small.
pub struct Readable(pub f64);

impl fmt::Display for Readable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if needs_no_exponent(self.0) { write!(f, "{}", self.0) } else { write!(f, "{:e}", self.0) }
    }
}

/// A number with seven digits.
pub struct Rounded(pub f64);

impl fmt::Display for Rounded {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        Readable(alloc::format!("{:.6e}", self.0).parse().unwrap_or(self.0)).fmt(f)
    }
}

/// A number with commas between thousands.
pub struct Grouped(pub u64);

impl fmt::Display for Grouped {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let digits = alloc::format!("{}", self.0);
        for (i, digit) in digits.chars().enumerate() {
            if i > 0 && (digits.len() - i) % 3 == 0 {
                f.write_str(",")?;
            }
            write!(f, "{digit}")?;
        }
        Ok(())
    }
}

/// A multiple in two digits.
pub struct Times(pub f64);

impl fmt::Display for Times {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            ..1e2 => Grouped(self.0 as u64).fmt(f),
            ..1e3 => Grouped((self.0 / 10.0) as u64 * 10).fmt(f),
            ..1e5 => Grouped((self.0 / 100.0) as u64 * 100).fmt(f),
            _ => write!(f, "{:.0e}", self.0),
        }
    }
}

/// A part of a whole in per cent; from ten times the whole on in two digits.
pub struct Part(pub f64);

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0 < 10.0 {
            write!(f, "{:.1} %", 100.0 * self.0)
        } else {
            write!(f, "{} %", Times(100.0 * self.0))
        }
    }
}

/// Names, quoted, with commas between.
pub(crate) fn names(f: &mut fmt::Formatter<'_>, names: &[&str]) -> fmt::Result {
    for (k, name) in names.iter().enumerate() {
        write!(f, "{}`{name}`", if k > 0 { ", " } else { "" })?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use alloc::string::ToString;

    use super::{Grouped, Part, Readable, Rounded, Times};

    #[test]
    fn times_are_short() {
        let cases = [
            (0.0, "0"),
            (10.0, "10"),
            (21600.0, "21600"),
            (12.644728254874169, "12.64473"),
            (0.0000007871337039784605, "7.871337e-7"),
            (-1.0 / 3.0, "-0.3333333"),
            (f64::NAN, "NaN"),
        ];
        for (number, text) in cases {
            assert_eq!(Rounded(number).to_string(), text);
        }
    }

    #[test]
    fn all_digits_are_few_characters() {
        for x in [0.1 + 0.2, 1e300, -f64::MAX, f64::MIN_POSITIVE, 5e-324, 1e7 / 3.0] {
            let text = Readable(x).to_string();
            assert!(text.len() <= 24, "{text}");
            assert_eq!(text.parse(), Ok(x));
        }
    }

    #[test]
    fn large_numbers_are_grouped() {
        for (number, text) in [(0, "0"), (999, "999"), (1_000, "1,000"), (1_234_567, "1,234,567")] {
            assert_eq!(Grouped(number).to_string(), text);
        }
    }

    #[test]
    fn times_have_two_digits() {
        let cases = [(17.6, "17"), (75.1, "75"), (134.9, "130"), (3456.0, "3,400"), (2.4e6, "2e6")];
        for (times, text) in cases {
            assert_eq!(Times(times).to_string(), text);
        }
    }

    #[test]
    fn parts_far_beyond_the_whole_are_short() {
        for (part, text) in [(0.012, "1.2 %"), (3.0, "300.0 %"), (29.9, "2,900 %"), (3e22, "3e24 %")] {
            assert_eq!(Part(part).to_string(), text);
        }
    }
}

//! Axes: ranges, round tick values and their labels, from 10⁻³⁰⁰ to 10³⁰⁰, on linear and logarithmic scales.
//!
//! An axis works in *axis coordinates*: the value itself on a linear scale, its decimal logarithm on a
//! logarithmic one.

use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;

use crate::text;

/// The range of an axis, in axis coordinates, `lo < hi`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Range {
    pub(crate) lo: f64,
    pub(crate) hi: f64,
}

/// Largest bound of a linear axis. A larger one could not be padded without overflow.
const LARGEST_BOUND: f64 = 1e307;
/// Smallest spread of a linear axis. The step of its ticks would no longer be a normal number.
const SMALLEST_SPREAD: f64 = 1e-290;

impl Range {
    /// The range that holds `values` with a little air; a single value or none gets a range about it. Values
    /// are in axis coordinates; those that are not finite are passed over.
    pub(crate) fn around(values: impl Iterator<Item = f64>, log: bool) -> Self {
        let (lo, hi) = values
            .filter(|value| value.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), value| (lo.min(value), hi.max(value)));
        if lo > hi {
            return if log { Self { lo: 0.0, hi: 1.0 } } else { Self { lo: -1.0, hi: 1.0 } };
        }
        let (lo, hi) = (lo.clamp(-LARGEST_BOUND, LARGEST_BOUND), hi.clamp(-LARGEST_BOUND, LARGEST_BOUND));
        let middle = 0.5 * lo + 0.5 * hi;
        // Neither rounding noise of a constant nor a constant alone is spread over the whole panel.
        let least = if log { 0.5 } else { (middle.abs() * 1e-12).max(SMALLEST_SPREAD) };
        let half = 0.5 * hi - 0.5 * lo;
        let half = if half > least {
            1.08 * half
        } else if log || half > 0.0 {
            least
        } else if middle == 0.0 {
            1.0
        } else {
            (0.5 * middle.abs()).max(least)
        };
        Self { lo: middle - half, hi: middle + half }
    }

    /// The part of the range, 0 at `lo` and 1 at `hi`, at which a value lies. Halved, so that the widest
    /// range does not overflow.
    pub(crate) fn part(self, value: f64) -> f64 {
        (0.5 * value - 0.5 * self.lo) / (0.5 * self.hi - 0.5 * self.lo)
    }
}

/// Where ticks stand, in axis coordinates, and what they say.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Ticks {
    /// Ticks with a label.
    pub(crate) major: Vec<(f64, String)>,
    /// Ticks without.
    pub(crate) minor: Vec<f64>,
    /// What the labels are multiples of and what is to be added to them: `×10⁻⁹`, `+ 1.5`; empty if they are
    /// the values.
    pub(crate) factor: String,
}

impl Ticks {
    /// The largest part of the axis beyond its labels, at either end.
    pub(crate) fn bare(&self, range: Range) -> f64 {
        match (self.major.first(), self.major.last()) {
            (Some((first, _)), Some((last, _))) => range.part(*first).max(1.0 - range.part(*last)),
            _ => 1.0,
        }
    }
}

/// A round step: `digit` · 10^`exponent` with digit 1, 2 or 5.
#[derive(Clone, Copy)]
struct Step {
    digit: i64,
    exponent: i32,
}

impl Step {
    /// The smallest round step that is at least `least` > 0.
    fn at_least(least: f64) -> Self {
        let exponent = libm::floor(libm::log10(least)) as i32;
        let mantissa = least / libm::pow(10.0, f64::from(exponent));
        // The slack keeps a step of exactly 1, 2 or 5 in spite of rounding.
        match mantissa {
            m if m <= 1.0 + 1e-9 => Self { digit: 1, exponent },
            m if m <= 2.0 + 1e-9 => Self { digit: 2, exponent },
            m if m <= 5.0 + 1e-9 => Self { digit: 5, exponent },
            _ => Self { digit: 1, exponent: exponent + 1 },
        }
    }

    fn value(self) -> f64 {
        self.digit as f64 * libm::pow(10.0, f64::from(self.exponent))
    }
}

/// At most `count` (at least 1) round ticks of a linear axis.
pub(crate) fn linear(range: Range, count: usize) -> Ticks {
    let count = count.max(1) as f64;
    let step = Step::at_least(range.hi / count - range.lo / count);
    let value = step.value();
    // A tick on the very edge belongs to the axis in spite of rounding.
    let slack = 1e-9;
    let first = libm::ceil(range.lo / value - slack) as i64;
    let last = libm::floor(range.hi / value + slack) as i64;
    let labels = Labels::choose(first, last, step);
    Ticks {
        major: (first..=last).map(|k| (k as f64 * value, labels.of(k))).collect(),
        minor: Vec::new(),
        factor: labels.factor,
    }
}

/// How the multiples of a step are written.
struct Labels {
    step: Step,
    /// The multiple from which the labels count.
    origin: i64,
    /// The labels' power of ten.
    exponent: i32,
    factor: String,
}

impl Labels {
    fn choose(first: i64, last: i64, step: Step) -> Self {
        let exponent_of = |largest: i64| {
            let largest = (largest.max(1) * step.digit) as f64;
            libm::floor(libm::log10(largest) + 1e-12) as i32 + step.exponent
        };
        let top = exponent_of(first.abs().max(last.abs()));
        // More than five digits on every label: count from the first tick instead.
        let origin = if top - step.exponent > 5 { first } else { 0 };
        let top = if origin == 0 { top } else { exponent_of(last - first) };
        let exponent = if (-3..5).contains(&top) { 0 } else { top };
        let mut factor = String::new();
        if exponent != 0 {
            factor = format!("×{}", text::power_of_ten(exponent));
        }
        if origin != 0 {
            let offset = decimal(origin * step.digit, step.exponent);
            let (sign, offset) = match offset.strip_prefix('−') {
                Some(offset) => ("−", offset.to_string()),
                None => ("+", offset),
            };
            let space = if factor.is_empty() { "" } else { " " };
            factor = format!("{factor}{space}{sign} {offset}");
        }
        Self { step, origin, exponent, factor }
    }

    fn of(&self, k: i64) -> String {
        let multiple = (k - self.origin) * self.step.digit;
        fixed(multiple, self.step.exponent - self.exponent)
    }
}

/// `multiple` · 10^`exponent` in plain digits; `exponent` is small.
fn fixed(multiple: i64, exponent: i32) -> String {
    if exponent >= 0 {
        let zeros = "0".repeat(if multiple == 0 { 0 } else { exponent as usize });
        return text::minus(&format!("{multiple}{zeros}"));
    }
    let decimals = exponent.unsigned_abs() as usize;
    let digits = format!("{:0>width$}", multiple.unsigned_abs(), width = decimals + 1);
    let (whole, part) = digits.split_at(digits.len() - decimals);
    let sign = if multiple < 0 { "−" } else { "" };
    format!("{sign}{whole}.{part}")
}

/// `multiple` · 10^`exponent` with all its digits, whatever the exponent.
fn decimal(multiple: i64, exponent: i32) -> String {
    let digits = multiple.unsigned_abs().to_string();
    let top = digits.len() as i32 - 1 + exponent;
    if (-3..9).contains(&top) && exponent <= 0 {
        return text::trimmed(&fixed(multiple, exponent));
    }
    // 10 and 2000 are shorter than 1×10 and 2×10³.
    if exponent > 0 && top < 4 {
        return fixed(multiple, exponent);
    }
    let sign = if multiple < 0 { "−" } else { "" };
    let (whole, part) = digits.split_at(1);
    let mantissa = text::trimmed(&format!("{whole}.{part}0"));
    format!("{sign}{mantissa}×{}", text::power_of_ten(top))
}

/// At most about `count` ticks of a logarithmic axis whose range is in decades.
pub(crate) fn logarithmic(range: Range, count: usize) -> Ticks {
    let count = count.max(1);
    let (first, last) = (libm::ceil(range.lo - 1e-9) as i32, libm::floor(range.hi + 1e-9) as i32);
    if first > last || (last - first < 2 && count > 2) {
        return within_a_decade(range, count);
    }
    let count = i32::try_from(count).unwrap_or(i32::MAX);
    let every = round_decades((last - first) / count + 1);
    let major = (first..=last)
        .filter(|exponent| exponent.rem_euclid(every) == 0)
        .map(|exponent| (f64::from(exponent), text::power_of_ten(exponent)))
        .collect();
    let minor = match every {
        1 => parts_of_decades(range).filter(|(_, digit)| *digit > 1).map(|(at, _)| at).collect(),
        // Closer than this they would be a grey area.
        20.. => Vec::new(),
        _ => (first..=last).filter(|exponent| exponent.rem_euclid(every) != 0).map(f64::from).collect(),
    };
    Ticks { major, minor, factor: String::new() }
}

/// The smallest of 1, 2, 3, 5, 10, 20, … that is at least `least`.
fn round_decades(least: i32) -> i32 {
    (0..)
        .flat_map(|k| [1, 2, 3, 5].map(|digit| digit * 10_i32.pow(k)))
        .find(|every| *every >= least)
        .unwrap_or(least)
}

/// log₁₀(digit · 10^k) for all digits 1 to 9 and all k within the range.
fn parts_of_decades(range: Range) -> impl Iterator<Item = (f64, u8)> {
    let (first, last) = (libm::floor(range.lo) as i32, libm::floor(range.hi) as i32);
    (first..=last)
        .flat_map(|k| (1..=9u8).map(move |digit| (f64::from(k) + libm::log10(f64::from(digit)), digit)))
        .filter(move |(at, _)| (range.lo..=range.hi).contains(at))
}

/// Ticks where the range holds hardly a decade: 1, 2 and 5, or, where even these are too few, round values.
fn within_a_decade(range: Range, count: usize) -> Ticks {
    let power = |at: f64| libm::pow(10.0, at);
    let round: Vec<_> = parts_of_decades(range)
        .filter(|(_, digit)| matches!(digit, 1 | 2 | 5))
        .map(|(at, digit)| {
            let exponent = libm::round(at - libm::log10(f64::from(digit))) as i32;
            (at, decimal(i64::from(digit), exponent))
        })
        .collect();
    // Of two decades the powers of ten themselves, where 2 and 5 would be too many: equal distances of the
    // values would leave most of the axis without a label.
    let tens: Vec<_> = round.iter().filter(|(at, _)| (at - libm::round(*at)).abs() < 1e-9).cloned().collect();
    if round.len() > count.max(2) && tens.len() > 1 {
        let minor = parts_of_decades(range).filter(|(_, digit)| *digit > 1).map(|(at, _)| at).collect();
        return Ticks { major: tens, minor, factor: String::new() };
    }
    let (lo, hi) = (power(range.lo), power(range.hi));
    if (2..=count.max(2)).contains(&round.len()) || lo < SMALLEST_SPREAD || hi > LARGEST_BOUND {
        let minor = parts_of_decades(range)
            .filter(|(_, digit)| !matches!(digit, 1 | 2 | 5))
            .map(|(at, _)| at)
            .collect();
        return Ticks { major: round, minor, factor: String::new() };
    }
    let mut ticks = linear(Range { lo, hi }, count);
    for (at, _) in &mut ticks.major {
        *at = libm::log10(*at);
    }
    ticks.major.retain(|(at, _)| at.is_finite());
    ticks
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec;
    use proptest::prelude::*;

    fn labels(ticks: &Ticks) -> Vec<&str> {
        ticks.major.iter().map(|(_, label)| label.as_str()).collect()
    }

    #[test]
    fn two_decades_have_their_powers_of_ten_where_there_is_room_for_no_more() {
        let range = Range { lo: libm::log10(0.49), hi: libm::log10(62.0) };
        assert_eq!(labels(&logarithmic(range, 4)), ["1", "10"]);
        assert_eq!(labels(&logarithmic(range, 7)), ["0.5", "1", "2", "5", "10", "20", "50"]);
        let range = Range { lo: 3.1, hi: 5.05 };
        assert_eq!(labels(&logarithmic(range, 3)), ["1×10⁴", "1×10⁵"]);
    }

    #[test]
    fn round_values_with_as_many_decimals_as_the_step_has() {
        let ticks = linear(Range { lo: -0.13, hi: 0.52 }, 7);
        assert_eq!(labels(&ticks), ["−0.1", "0.0", "0.1", "0.2", "0.3", "0.4", "0.5"]);
        assert_eq!(ticks.factor, "");
        let ticks = linear(Range { lo: 0.0, hi: 10.0 }, 5);
        assert_eq!(labels(&ticks), ["0", "2", "4", "6", "8", "10"]);
    }

    #[test]
    fn small_and_large_values_get_a_common_power_of_ten() {
        let ticks = linear(Range { lo: -2e-9, hi: 2e-9 }, 5);
        assert_eq!(labels(&ticks), ["−2", "−1", "0", "1", "2"]);
        assert_eq!(ticks.factor, "×10⁻⁹");
        let ticks = linear(Range { lo: 0.0, hi: 3e12 }, 6);
        assert_eq!(labels(&ticks), ["0.0", "0.5", "1.0", "1.5", "2.0", "2.5", "3.0"]);
        assert_eq!(ticks.factor, "×10¹²");
    }

    #[test]
    fn a_small_change_of_a_large_value_is_counted_from_the_first_tick() {
        let ticks = linear(Range { lo: 1000.5, hi: 1_000.500_004 }, 4);
        assert_eq!(labels(&ticks), ["0", "1", "2", "3", "4"]);
        assert_eq!(ticks.factor, "×10⁻⁶ + 1000.5");
    }

    #[test]
    fn decades() {
        let ticks = logarithmic(Range { lo: -3.2, hi: 1.1 }, 8);
        assert_eq!(labels(&ticks), ["10⁻³", "10⁻²", "10⁻¹", "1", "10"]);
        assert!(ticks.minor.iter().any(|at| (at - 2f64.log10()).abs() < 1e-12));
        let ticks = logarithmic(Range { lo: -320.0, hi: 308.0 }, 8);
        assert_eq!(ticks.major.len(), 7);
        assert_eq!(ticks.major[0], (-300.0, "10⁻³⁰⁰".to_string()));
    }

    #[test]
    fn less_than_a_decade_still_has_labels() {
        let ticks = logarithmic(Range { lo: 0.1, hi: 0.9 }, 6);
        assert_eq!(labels(&ticks), ["2", "5"]);
        let ticks = logarithmic(Range { lo: 0.31, hi: 0.36 }, 6);
        assert!(ticks.major.len() >= 2, "{ticks:?}");
    }

    #[test]
    fn constants_and_nothing_have_a_range() {
        for (values, log) in [
            (vec![], false),
            (vec![0.0], false),
            (vec![f64::NAN], false),
            (vec![-7.0, -7.0], false),
            (vec![5e-324], false),
            (vec![f64::MAX, -f64::MAX], false),
            (vec![-323.3], true),
            (vec![], true),
        ] {
            let range = Range::around(values.iter().copied(), log);
            assert!(range.lo < range.hi, "{values:?}");
            let ticks = if log { logarithmic(range, 6) } else { linear(range, 6) };
            assert!(!ticks.major.is_empty(), "{values:?} {range:?}");
        }
    }

    #[test]
    fn rounding_noise_is_not_blown_up() {
        let range = Range::around([1.0, 1.0 + f64::EPSILON].into_iter(), false);
        assert!(range.hi - range.lo > 1e-13, "{range:?}");
    }

    /// What a reader makes of a label.
    fn read(label: &str, factor: &str) -> f64 {
        let number = |s: &str| s.trim().replace('−', "-").replace("- ", "-");
        let superscript = |s: &str| -> i32 {
            s.chars()
                .map(|c| "⁰¹²³⁴⁵⁶⁷⁸⁹⁻".chars().position(|d| d == c).unwrap())
                .map(|k| char::from(b"0123456789-"[k]))
                .collect::<String>()
                .parse()
                .unwrap()
        };
        let scientific = |s: &str| -> f64 {
            match s.split_once("×10") {
                Some((mantissa, power)) => {
                    let mantissa = number(mantissa);
                    let exponent = if power.is_empty() { 1 } else { superscript(power) };
                    format!("{mantissa}e{exponent}").parse().unwrap()
                }
                None => number(s).parse().unwrap(),
            }
        };
        let (power, offset) = match factor.split_once(['+', '−']) {
            Some((power, offset)) if factor.starts_with('×') => (power.trim(), {
                let sign = if factor.contains("+ ") { 1.0 } else { -1.0 };
                sign * scientific(offset.trim())
            }),
            _ if factor.starts_with('+') => ("", scientific(factor[1..].trim())),
            _ if factor.starts_with('−') => ("", -scientific(factor['−'.len_utf8()..].trim())),
            _ => (factor, 0.0),
        };
        let label = number(label);
        let value = match power.strip_prefix("×10") {
            Some(exponent) => {
                let exponent = if exponent.is_empty() { 1 } else { superscript(exponent) };
                format!("{label}e{exponent}")
            }
            None => label,
        };
        value.parse::<f64>().unwrap() + offset
    }

    proptest! {
        #[test]
        fn labels_say_where_the_ticks_are(
            middle in -10.0..10.0f64, spread in 0.0..12.0f64, power in -250i32..250, count in 3usize..10,
        ) {
            let scale = 10f64.powi(power);
            let half = 10f64.powf(-spread) * middle.abs().max(1e-3);
            let range = Range::around([(middle - half) * scale, (middle + half) * scale].into_iter(), false);
            let ticks = linear(range, count);
            prop_assert!(ticks.major.len() <= count + 1);
            prop_assert!(!ticks.major.is_empty());
            let width = range.hi - range.lo;
            let mut previous = f64::NEG_INFINITY;
            for (at, label) in &ticks.major {
                prop_assert!(*at >= range.lo - 1e-6 * width && *at <= range.hi + 1e-6 * width);
                prop_assert!(*at > previous);
                previous = *at;
                let read = read(label, &ticks.factor);
                let tolerance = 1e-6 * width + 1e-14 * at.abs();
                prop_assert!((read - at).abs() < tolerance, "{at} reads {label} {}", ticks.factor);
            }
        }
    }
}

//! Output times at equal intervals.

use alloc::vec::Vec;

/// Part of an interval by which rounding may shorten a span: 10 / 0.1 must give the last of its 101 times.
const INTERVAL_SLACK: f64 = 1e-6;

/// Number of intervals in a span.
pub(crate) fn intervals(span: f64, interval: f64) -> u64 {
    (span / interval + INTERVAL_SLACK) as u64
}

/// Times at equal intervals from the start, the end included where an interval ends there.
pub(crate) fn every(start: f64, end: f64, interval: f64) -> Vec<f64> {
    let direction = if end < start { -1.0 } else { 1.0 };
    let at = |k: u64| {
        let t = start + direction * (k as f64 * interval);
        if (end - t) * direction < 0.0 { end } else { t }
    };
    (0..=intervals((end - start).abs(), interval)).map(at).collect()
}

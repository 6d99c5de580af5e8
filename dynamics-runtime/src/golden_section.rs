//! Golden section search: the maximum of a unimodal function of one variable.
//!
//! Source: Kiefer, Proc. Amer. Math. Soc. 4 (1953) 502.

/// Reductions of the interval, each by the factor 0.618: 40 leave 4·10⁻⁹ of it. A maximum is known no better
/// than to √ε of the interval, 1.5·10⁻⁸.
const REDUCTIONS: usize = 40;
/// 2 − φ with the golden ratio φ: where the inner points divide the interval.
const INNER_PART: f64 = 0.381_966_011_250_105_1;

/// The argument of the largest value between a and b, and the value.
pub(crate) fn golden_section_maximum(
    mut a: f64,
    mut b: f64,
    value: &mut dyn FnMut(f64) -> f64,
) -> (f64, f64) {
    let (mut left, mut right) = (a + INNER_PART * (b - a), b - INNER_PART * (b - a));
    let (mut at_left, mut at_right) = (value(left), value(right));
    for _ in 0..REDUCTIONS {
        if at_left > at_right {
            (b, right, at_right) = (right, left, at_left);
            left = a + INNER_PART * (b - a);
            at_left = value(left);
        } else {
            (a, left, at_left) = (left, right, at_right);
            right = b - INNER_PART * (b - a);
            at_right = value(right);
        }
    }
    if at_left > at_right { (left, at_left) } else { (right, at_right) }
}

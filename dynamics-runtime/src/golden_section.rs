//! The golden section search.

/// Bisections of the golden section.
const SECTIONS: usize = 40;

/// The place of the greatest value between two, by golden section, and the value.
pub(crate) fn golden(mut a: f64, mut b: f64, value: &mut dyn FnMut(f64) -> f64) -> (f64, f64) {
    const PART: f64 = 0.381_966_011_250_105_1;
    let (mut left, mut right) = (a + PART * (b - a), b - PART * (b - a));
    let (mut at_left, mut at_right) = (value(left), value(right));
    for _ in 0..SECTIONS {
        if at_left > at_right {
            (b, right, at_right) = (right, left, at_left);
            left = a + PART * (b - a);
            at_left = value(left);
        } else {
            (a, left, at_left) = (left, right, at_right);
            right = b - PART * (b - a);
            at_right = value(right);
        }
    }
    if at_left > at_right { (left, at_left) } else { (right, at_right) }
}

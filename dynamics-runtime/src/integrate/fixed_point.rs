//! When iterations have done what rounding permits: for equations that are to be solved to the last digit, as the structure of a motion asks for.

/// Most iterations for the equations of a step.
const MOST: u32 = 100;
/// Corrections that no longer shrink are rounding errors, if they are as small as this part of what the step changes.
const ROUNDING: f64 = 1e-12;
/// What the step changes is taken for no smaller than this part of what it is: rounding errors are not in proportion to changes.
const LEAST: f64 = 1e-2;
/// Corrections that are so many times the smallest one so far diverge.
const GROWTH: f64 = 1e3;

/// The course of an iteration.
#[derive(Clone, Copy, Debug)]
pub(super) struct FixedPoint {
    before: f64,
    least: f64,
    left: u32,
}

/// What to do next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Course {
    Again,
    Solved,
    Lost,
}

impl FixedPoint {
    pub(super) fn new() -> Self {
        Self { before: f64::INFINITY, least: f64::INFINITY, left: MOST }
    }

    /// After a correction of this size, as a part of what the step changes.
    pub(super) fn after(&mut self, size: f64) -> Course {
        let before = core::mem::replace(&mut self.before, size);
        self.least = self.least.min(size);
        self.left -= 1;
        if size == 0.0 || size >= before && size < ROUNDING {
            Course::Solved
        } else if self.left == 0 || size.is_nan() || size > GROWTH * self.least {
            Course::Lost
        } else {
            Course::Again
        }
    }
}

/// The largest correction of values that stood at `from` where the step starts, as a part of what the step changes: of (old, new, from).
pub(super) fn share(values: impl Iterator<Item = (f64, f64, f64)>) -> f64 {
    let (mut correction, mut change) = (0.0f64, 0.0f64);
    for (old, new, from) in values {
        // NaN stays.
        correction = if (new - old).abs() <= correction { correction } else { (new - old).abs() };
        change = change.max((new - from).abs()).max(LEAST * new.abs());
    }
    if correction == 0.0 { 0.0 } else { correction / change }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ends(mut sizes: impl FnMut(u32) -> f64) -> (u32, Course) {
        let mut course = FixedPoint::new();
        (1..).map(|k| (k, course.after(sizes(k)))).find(|(_, course)| *course != Course::Again).unwrap()
    }

    #[test]
    fn ends_where_rounding_stalls_it_and_not_before() {
        assert_eq!(ends(|k| 0.1f64.powi(k as i32).max(1e-16)), (18, Course::Solved));
        assert_eq!(ends(|k| if k < 4 { 0.1 } else { 0.0 }), (4, Course::Solved));
        assert_eq!(ends(|k| 3f64.powi(k as i32)).1, Course::Lost);
        assert_eq!(ends(|_| 0.5), (100, Course::Lost));
        assert_eq!(ends(|k| if k < 3 { 0.1 } else { f64::NAN }), (3, Course::Lost));
    }
}

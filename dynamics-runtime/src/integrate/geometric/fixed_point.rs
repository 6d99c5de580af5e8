//! When iterations have done what rounding permits: for equations that are to be solved to the last digit, as
//! the structure of a motion asks for.

/// Most iterations for the equations of a step.
const MOST_FIXED_POINT_ITERATIONS: u32 = 100;
/// Corrections that no longer shrink are rounding errors, if they are as small as this part of what the step
/// changes.
const ROUNDING: f64 = 1e-12;
/// What the step changes is taken for no smaller than this part of what it is: rounding errors are not in
/// proportion to changes.
const LEAST_CHANGE: f64 = 1e-2;
/// Corrections that are so many times the smallest one so far diverge.
const GROWTH: f64 = 1e3;

/// Rounding errors of positions that a step starts with, in units of their last place.
const UNITS: f64 = 4.0;
/// Corrections that have not become smaller by this factor in so many iterations are rounding errors, too, if
/// they are below this part of what the step changes: an equation of momenta with a mass matrix of condition
/// κ is solved to κ ε.
const SHRINKS: f64 = 0.9;
const STALLED: u32 = 10;
const STALLED_BELOW: f64 = 1e-9;

/// The course of an iteration.
#[derive(Clone, Copy, Debug)]
pub(in crate::integrate) struct FixedPoint {
    before: f64,
    least: f64,
    left: u32,
    /// Iterations since corrections became smaller.
    stalled: u32,
}

/// How far an iteration moved velocities of a step.
#[derive(Clone, Copy, Debug)]
pub(in crate::integrate) struct IterationChange {
    /// As a part of what the step changes.
    pub(in crate::integrate) size: f64,
    /// What rounding of the positions makes of it, likewise.
    pub(in crate::integrate) rounding: f64,
}

/// What to do next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::integrate) enum Course {
    Again,
    Solved,
    Lost,
}

impl FixedPoint {
    pub(in crate::integrate) fn new() -> Self {
        Self { before: f64::INFINITY, least: f64::INFINITY, left: MOST_FIXED_POINT_ITERATIONS, stalled: 0 }
    }

    /// After a correction.
    pub(in crate::integrate) fn after(
        &mut self,
        IterationChange { size, rounding }: IterationChange,
    ) -> Course {
        let before = core::mem::replace(&mut self.before, size);
        self.stalled = if size < SHRINKS * self.least { 0 } else { self.stalled + 1 };
        self.least = self.least.min(size);
        self.left -= 1;
        let rounds = size >= before && size < ROUNDING.max(rounding);
        if size == 0.0 || rounds || self.stalled >= STALLED && size < STALLED_BELOW {
            Course::Solved
        } else if self.left == 0 || size.is_nan() || size > GROWTH * self.least.max(rounding) {
            Course::Lost
        } else {
            Course::Again
        }
    }
}

/// The largest correction of velocities that stood at `from` where the step starts, of (old, new, from), in a
/// step of length `h` from positions `q`.
///
/// Positions are rounded to ε |q|. Iterations that converge at all have h² |∂q̈/∂q| below 1, so that this
/// moves velocities by ε |q|/h at most: what is smaller may be rounding, as of an angle that has made some
/// thousand turns.
pub(in crate::integrate) fn correction(
    values: impl Iterator<Item = (f64, f64, f64)>,
    (q, h): (&[f64], f64),
) -> IterationChange {
    let (mut correction, mut change) = (0.0f64, 0.0f64);
    for (old, new, from) in values {
        // NaN stays.
        correction = if (new - old).abs() <= correction { correction } else { (new - old).abs() };
        change = change.max((new - from).abs()).max(LEAST_CHANGE * new.abs());
    }
    let farthest = q.iter().fold(0.0f64, |most, q| most.max(q.abs()));
    let rounding = UNITS * f64::EPSILON * farthest / h.abs();
    // What is at rest may be held there by rounding alone.
    let part = |x: f64| if x == 0.0 { 0.0 } else { x / change };
    IterationChange { size: part(correction), rounding: part(rounding) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ends(mut sizes: impl FnMut(u32) -> f64) -> (u32, Course) {
        let mut course = FixedPoint::new();
        (1..)
            .map(|k| (k, course.after(IterationChange { size: sizes(k), rounding: 0.0 })))
            .find(|(_, course)| *course != Course::Again)
            .unwrap()
    }

    #[test]
    fn ends_where_rounding_stalls_it_and_not_before() {
        assert_eq!(ends(|k| 0.1f64.powi(k as i32).max(1e-16)), (18, Course::Solved));
        assert_eq!(ends(|k| if k < 4 { 0.1 } else { 0.0 }), (4, Course::Solved));
        assert_eq!(ends(|k| 3f64.powi(k as i32)).1, Course::Lost);
        assert_eq!(ends(|_| 0.5), (100, Course::Lost));
        assert_eq!(ends(|k| if k < 3 { 0.1 } else { f64::NAN }), (3, Course::Lost));
        // At the rounding of a badly conditioned equation corrections go up and down.
        let stalls = |k: u32| 0.1f64.powi(k as i32).max(1e-11 * (1.0 + 0.5 * f64::from(k % 3)));
        assert_eq!(ends(stalls).1, Course::Solved);
    }

    /// An angle of a thousand turns is known to 1e-12, and velocities that follow from it in steps of a
    /// millisecond to 1e-9.
    #[test]
    fn rounding_of_large_positions_is_no_lack_of_convergence() {
        let values = |by: f64| [(1.0 + by, 1.0, 0.5)].into_iter();
        let of = |by, q: f64| correction(values(by), (&[q], 1e-3));
        let (mut near, mut far) = (FixedPoint::new(), FixedPoint::new());
        for by in [1e-3, 1e-6, 1e-11] {
            assert_eq!(near.after(of(by, 1.0)), Course::Again);
            assert_eq!(far.after(of(by, 6000.0)), Course::Again);
        }
        assert_eq!(near.after(of(2e-11, 1.0)), Course::Again);
        assert_eq!(far.after(of(2e-11, 6000.0)), Course::Solved);
    }
}

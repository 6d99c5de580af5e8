//! When fixed-point iterations have reached rounding: for equations that are solved to the last digit, as
//! structure-preserving methods need.

/// Most iterations for the equations of a step.
const MAX_FIXED_POINT_ITERATIONS: u32 = 100;
/// Corrections that no longer shrink are rounding, if they are below this part of what the step changes.
const ROUNDING_CORRECTION: f64 = 1e-12;
/// The change of a step counts as no smaller than this part of its values: rounding is in proportion to
/// values, not to changes.
const MIN_CHANGE_PART: f64 = 1e-2;
/// Corrections that are so many times the smallest one so far diverge. The first iterations of a step that
/// converges may grow, but by less.
const DIVERGENCE_GROWTH: f64 = 1e3;
/// Rounding of the positions at the start of a step, in units of their last place.
const POSITION_ROUNDING_UNITS: f64 = 4.0;
/// Corrections stall if they do not become smaller by this factor in [`STALLED_ITERATIONS`] iterations. They
/// are then rounding, too, if they are below [`STALLED_CORRECTION`]: an equation of momenta whose mass matrix
/// has the condition κ is solved to κ ε.
const STALLED_FACTOR: f64 = 0.9;
/// See [`STALLED_FACTOR`].
const STALLED_ITERATIONS: u32 = 10;
/// See [`STALLED_FACTOR`]; a part of what the step changes.
const STALLED_CORRECTION: f64 = 1e-9;

/// The progress of an iteration.
#[derive(Clone, Copy, Debug)]
pub(super) struct FixedPoint {
    previous: f64,
    smallest: f64,
    iterations_left: u32,
    /// Iterations since corrections became smaller.
    stalled: u32,
}

/// The correction of the velocities of a step by an iteration.
#[derive(Clone, Copy, Debug)]
pub(super) struct IterationChange {
    /// As a part of what the step changes.
    pub(super) size: f64,
    /// The correction that rounding of the positions may cause, likewise.
    pub(super) rounding: f64,
}

/// Whether an iteration goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum IterationStatus {
    /// It goes on.
    Continue,
    /// Only rounding is left of the corrections.
    Converged,
    /// It diverges, or has taken too many iterations.
    Diverged,
}

impl FixedPoint {
    /// Before the first iteration.
    pub(super) fn new() -> Self {
        Self {
            previous: f64::INFINITY,
            smallest: f64::INFINITY,
            iterations_left: MAX_FIXED_POINT_ITERATIONS,
            stalled: 0,
        }
    }

    /// The status after a correction.
    pub(super) fn judge(&mut self, IterationChange { size, rounding }: IterationChange) -> IterationStatus {
        let previous = core::mem::replace(&mut self.previous, size);
        self.stalled = if size < STALLED_FACTOR * self.smallest { 0 } else { self.stalled + 1 };
        self.smallest = self.smallest.min(size);
        self.iterations_left -= 1;
        let is_rounding = size >= previous && size < ROUNDING_CORRECTION.max(rounding);
        if size == 0.0 || is_rounding || self.stalled >= STALLED_ITERATIONS && size < STALLED_CORRECTION {
            IterationStatus::Converged
        } else if self.iterations_left == 0
            || size.is_nan()
            || size > DIVERGENCE_GROWTH * self.smallest.max(rounding)
        {
            IterationStatus::Diverged
        } else {
            IterationStatus::Continue
        }
    }
}

/// The largest correction of velocities, from triples (before, after, at the start of the step), in a step of
/// length `h` from positions `q`.
///
/// Positions are rounded to ε |q|. Iterations that converge at all have h² |∂q̈/∂q| below 1, so that this
/// moves velocities by ε |q|/h at most. Smaller corrections may be rounding, as of an angle after some
/// thousand turns.
pub(super) fn relative_correction(
    values: impl Iterator<Item = (f64, f64, f64)>,
    (q, h): (&[f64], f64),
) -> IterationChange {
    let (mut correction, mut change) = (0.0f64, 0.0f64);
    for (before, after, at_start) in values {
        // NaN stays.
        correction = if (after - before).abs() <= correction { correction } else { (after - before).abs() };
        change = change.max((after - at_start).abs()).max(MIN_CHANGE_PART * after.abs());
    }
    let farthest = q.iter().fold(0.0f64, |most, q| most.max(q.abs()));
    let rounding = POSITION_ROUNDING_UNITS * f64::EPSILON * farthest / h.abs();
    // At rest nothing changes: no correction is a part of that.
    let part = |x: f64| if x == 0.0 { 0.0 } else { x / change };
    IterationChange { size: part(correction), rounding: part(rounding) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ends(mut sizes: impl FnMut(u32) -> f64) -> (u32, IterationStatus) {
        let mut progress = FixedPoint::new();
        (1..)
            .map(|k| (k, progress.judge(IterationChange { size: sizes(k), rounding: 0.0 })))
            .find(|(_, status)| *status != IterationStatus::Continue)
            .unwrap()
    }

    #[test]
    fn ends_where_rounding_stalls_it_and_not_before() {
        assert_eq!(ends(|k| 0.1f64.powi(k as i32).max(1e-16)), (18, IterationStatus::Converged));
        assert_eq!(ends(|k| if k < 4 { 0.1 } else { 0.0 }), (4, IterationStatus::Converged));
        assert_eq!(ends(|k| 3f64.powi(k as i32)).1, IterationStatus::Diverged);
        assert_eq!(ends(|_| 0.5), (100, IterationStatus::Diverged));
        assert_eq!(ends(|k| if k < 3 { 0.1 } else { f64::NAN }), (3, IterationStatus::Diverged));
        // At the rounding of a badly conditioned equation corrections go up and down.
        let stalls = |k: u32| 0.1f64.powi(k as i32).max(1e-11 * (1.0 + 0.5 * f64::from(k % 3)));
        assert_eq!(ends(stalls).1, IterationStatus::Converged);
    }

    /// An angle of a thousand turns is known to 1e-12, and velocities that follow from it in steps of a
    /// millisecond to 1e-9.
    #[test]
    fn rounding_of_large_positions_is_no_lack_of_convergence() {
        let values = |by: f64| [(1.0 + by, 1.0, 0.5)].into_iter();
        let of = |by, q: f64| relative_correction(values(by), (&[q], 1e-3));
        let (mut near, mut far) = (FixedPoint::new(), FixedPoint::new());
        for by in [1e-3, 1e-6, 1e-11] {
            assert_eq!(near.judge(of(by, 1.0)), IterationStatus::Continue);
            assert_eq!(far.judge(of(by, 6000.0)), IterationStatus::Continue);
        }
        assert_eq!(near.judge(of(2e-11, 1.0)), IterationStatus::Continue);
        assert_eq!(far.judge(of(2e-11, 6000.0)), IterationStatus::Converged);
    }
}

//! Runs that come to no end: steps that become shorter and shorter towards a time that they do not reach.
//!
//! Whenever the number of steps has doubled, the time that was won with the later half of them is set beside
//! what the half before had won. Where it is a part r < 1 of that again and again, doubling on wins no more
//! than r/(1 − r) times as much.

use crate::math;

/// Steps after which this is looked at first.
const FIRST: u64 = 1024;
/// Part of what the half before has won, at most.
const SHRINKS: f64 = 0.7;
/// Doublings in a row with so little: at 65,536 steps at the earliest, of which the last half has won a sixth
/// of a hundredth of the first.
const IN_A_ROW: u32 = 5;

/// Steps after which it is looked at how far they came where something nearly loses a direction.
const CRAWLS: u64 = 512;

#[derive(Clone, Copy, Debug)]
pub(crate) struct StepSizeCollapse {
    next: u64,
    last: Option<f64>,
    won: f64,
    row: u32,
    /// The number of steps at which the next look is taken, and when the last one was.
    look: (u64, f64),
}

impl StepSizeCollapse {
    pub(crate) fn new() -> Self {
        Self { next: FIRST, last: None, won: 0.0, row: 0, look: (CRAWLS, f64::NEG_INFINITY) }
    }

    /// So many steps were made, up to t: the time that they approach, if they do not come to the end.
    #[inline]
    pub(crate) fn note(&mut self, made: u64, t: f64, end: f64) -> Option<f64> {
        if made < self.next { None } else { self.doubled(made, t, end) }
    }

    /// The time that the last [`CRAWLS`] steps took, where so many were made.
    #[inline]
    pub(crate) fn took(&mut self, made: u64, t: f64) -> Option<f64> {
        if made < self.look.0 {
            return None;
        }
        let (_, last) = core::mem::replace(&mut self.look, (made + CRAWLS, t));
        Some((t - last).abs())
    }

    /// Whether steps that go on as the last [`CRAWLS`] did, which took this time, are used up before the end:
    /// what rests beside such a position comes to its end.
    pub(crate) fn runs_out(&self, took: f64, (made, limit): (u64, u64), (t, end): (f64, f64)) -> bool {
        took * (limit.saturating_sub(made) as f64) < CRAWLS as f64 * (end - t).abs()
    }

    #[cold]
    fn doubled(&mut self, made: u64, t: f64, end: f64) -> Option<f64> {
        self.next = made.max(self.next).saturating_mul(2);
        let won = (t - self.last.replace(t)?).abs();
        let ratio = won / math::max(self.won, f64::MIN_POSITIVE);
        self.won = won;
        self.row = if ratio <= SHRINKS { self.row + 1 } else { 0 };
        let at = t + (won * ratio / (1.0 - ratio)).copysign(end - t);
        // Twice as far it does not come to the end either.
        let short = (at - t).abs() < 0.5 * (end - t).abs();
        (self.row >= IN_A_ROW && short).then_some(at)
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use super::StepSizeCollapse;

    /// Steps of this size at these times: the number after which it is seen that they do not reach 10, and
    /// the time they approach.
    fn seen(h: impl Fn(f64) -> f64) -> Option<(u64, f64)> {
        let (mut creep, mut t) = (StepSizeCollapse::new(), 0.0);
        (1..1_000_000).find_map(|made| {
            t += h(t);
            assert!(t < 10.0 || made > 1000);
            (t < 10.0).then(|| creep.note(made, t, 10.0)).flatten().map(|at| (made, at))
        })
    }

    #[test]
    fn what_many_steps_took_is_told() {
        let mut creep = StepSizeCollapse::new();
        let took: Vec<f64> = (1..=2048).filter_map(|made| creep.took(made, 0.5 * made as f64)).collect();
        assert_eq!(took, [f64::INFINITY, 256.0, 256.0, 256.0]);
    }

    #[test]
    fn steps_that_vanish_are_seen_and_others_are_not() {
        let (made, at) = seen(|t| 1e-3 * (2.0 - t).powi(2)).unwrap();
        assert!(made <= 1 << 17 && (at - 2.0).abs() < 1e-3, "{made} {at}");
        // Equal ones, ones that become shorter and reach the end, and ones that are short for a while.
        assert_eq!(seen(|_| 1e-5), None);
        assert_eq!(seen(|t| 1e-4 * (-t).exp().max(2e-1)), None);
        assert_eq!(seen(|t| 1e-6 + 1e-2 * (t - 2.0).powi(2)), None);
    }
}

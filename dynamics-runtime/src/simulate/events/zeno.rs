//! Zeno accumulation: events that follow each other in ever shorter intervals whose sum is finite.
//!
//! A bouncing ball has intervals that shrink by a constant ratio r, and the rest of the sum is r/(1 − r)
//! times the last interval. A ball that is squeezed between walls has intervals in proportion to the square
//! of the time that is left. An event function like sin eᵗ has shrinking intervals whose sum is infinite,
//! and is no accumulation.
//!
//! `location.rs` notes each event here after its action. A contact that comes to rest below its rest speed
//! closes before it accumulates, see `stabilization/contacts.rs`. Steps that shrink without events are found
//! by `run/monitors/step_size_collapse.rs`.

use alloc::string::String;

use crate::math;
use crate::simulate::failure::SimulationErrorKind as Kind;

/// Times in a row that an event may happen at one instant. Contacts that touch together may hit each other by
/// turns a few times; more repeats without end. A smaller value ends motions whose contacts are hit in turn,
/// a larger one only finds repetition later.
const MAX_EVENTS_AT_ONE_INSTANT: u32 = 16;

/// Smallest power p for which intervals that shrink as n⁻ᵖ have a finite sum here. The zeros of sin eᵗ
/// have p = 1 and no end; a squeezed ball has p = 2; a bouncing ball shrinks faster than any power. The bound
/// is the middle of 1 and 2.
const MIN_SUMMABLE_POWER: f64 = 1.5;

/// Intervals up to this many units in the last place of the time are one instant. A smaller value counts
/// rounding of one instant as an interval; a larger one ends motions late in a run whose events are near to
/// each other.
const MAX_ULPS_OF_ONE_INSTANT: f64 = 16.0;
/// Fewest intervals in a row, each shorter than the one before, that count as an accumulation. With fewer, a
/// few intervals that shrink fast, as of a bounce that is followed by others, would; more find the end later.
const MIN_SHRINKING_INTERVALS: u32 = 8;
/// Last interval, in parts of the first one, below which shrinking intervals accumulate. A larger bound would
/// find the end sooner, but also end motions whose events become rarer again.
const ACCUMULATED_INTERVAL: f64 = 1e-6;

/// Finds the accumulation of one event.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Zeno {
    last_time: Option<f64>,
    first_interval: f64,
    interval: f64,
    shrinking: u32,
    /// Two earlier intervals with their numbers: the last but one whose number is a power of two, and the
    /// last one.
    marks: [(u32, f64); 2],
    events_at_instant: u32,
    /// Speed of the hit at which the intervals began to shrink.
    first_speed: f64,
}

impl Zeno {
    /// Notes an event at a time, in a step of size h, and returns an error where the events accumulate.
    /// `speed` is that of a contact's hit, 0 for other events: hits of a ball that comes to rest become
    /// slower, hits of a squeezed ball faster.
    pub(crate) fn note_event(&mut self, t: f64, h: f64, speed: f64, event: String) -> Result<(), Kind> {
        let Some(last_time) = self.last_time.replace(t) else {
            return Ok(());
        };
        let interval = (t - last_time).abs();
        if interval <= MAX_ULPS_OF_ONE_INSTANT * f64::EPSILON * t.abs() {
            self.events_at_instant += 1;
            return match self.events_at_instant < MAX_EVENTS_AT_ONE_INSTANT {
                true => Ok(()),
                false => Err(Kind::EventsAccumulate { event, at: t, squeezed: false }),
            };
        }
        if interval < self.interval {
            self.shrinking += 1;
        } else {
            (self.first_interval, self.first_speed, self.shrinking) = (interval, speed, 0);
            self.marks = [(1, interval); 2];
        }
        if self.shrinking == 2 * self.marks[1].0 {
            self.marks = [self.marks[1], (self.shrinking, interval)];
        }
        let ratio = interval / self.interval;
        (self.interval, self.events_at_instant) = (interval, 0);
        if self.shrinking >= MIN_SHRINKING_INTERVALS
            && interval < ACCUMULATED_INTERVAL * self.first_interval
            && self.decay_power() > MIN_SUMMABLE_POWER
        {
            let squeezed = speed > self.first_speed;
            // `ratio` is below 1, as the last interval is shorter than the one before.
            let time_left = if squeezed {
                // An interval is c τ² with the time τ that is left at its start. So √ratio is the ratio
                // of these times for the last two intervals, and the first of them, d = interval/ratio, is
                // their difference: τ = d/(1 − √ratio). Of τ the two intervals have passed.
                let root = math::sqrt(ratio);
                interval / ratio / (1.0 - root) - interval - interval / ratio
            } else {
                // The geometric series.
                interval * ratio / (1.0 - ratio)
            };
            return Err(Kind::EventsAccumulate { event, at: t + time_left.copysign(h), squeezed });
        }
        Ok(())
    }

    /// The power p of their number n with which intervals shrink, n⁻ᵖ, over at least the last half of
    /// them.
    fn decay_power(&self) -> f64 {
        let (number, interval) = self.marks[0];
        math::ln(interval / self.interval) / math::ln(f64::from(self.shrinking) / f64::from(number))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The number of the event, counted from 1, at which these times are found to accumulate, and where.
    fn found(times: impl Iterator<Item = f64>, speed: impl Fn(f64) -> f64) -> Option<(usize, f64)> {
        let mut zeno = Zeno::default();
        times.enumerate().find_map(|(i, t)| match zeno.note_event(t, 1e-3, speed(t), "e".into()) {
            Err(Kind::EventsAccumulate { at, .. }) => Some((i + 1, at)),
            _ => None,
        })
    }

    #[test]
    fn what_bounces_comes_to_rest() {
        for ratio in [0.05f64, 0.18, 0.5, 0.9, 0.99] {
            let times = (0..10_000).map(|k| (1.0 - ratio.powi(k)) / (1.0 - ratio));
            let (events, at) = found(times, |_| 0.0).unwrap();
            let fewest = 1.0 + (1e-6f64.ln() / ratio.ln()).max(8.0);
            assert!((events as f64 - fewest).abs() < 3.0, "{ratio}: {events}, {fewest}");
            assert!((at - 1.0 / (1.0 - ratio)).abs() < 1e-6, "{ratio}: {at}");
        }
    }

    /// Times 1 − 1/k, ever faster.
    #[test]
    fn what_is_squeezed_has_intervals_as_the_square_of_the_time_left() {
        let (events, at) =
            found((1..100_000).map(|k| 1.0 - 1.0 / f64::from(k)), |t| 1.0 / (1.0 - t)).unwrap();
        assert!((500..2000).contains(&events) && (at - 1.0).abs() < 1e-4, "{events} {at}");
    }

    /// The zeros of sin eᵗ: ever shorter intervals, and no end. Of sin t⁴ likewise.
    #[test]
    fn a_chirp_does_not_accumulate() {
        let zero = |k: u32| f64::from(k) * core::f64::consts::PI;
        assert_eq!(found((1..3_000_000).map(|k| zero(k).ln()), |_| 0.0), None);
        assert_eq!(found((1..3_000_000).map(|k| zero(k).sqrt().sqrt()), |_| 0.0), None);
    }
}

//! Events that follow each other in ever shorter time.

use alloc::string::String;

use crate::math;
use crate::simulate::failure::SimulationErrorKind as Fault;

/// Times in a row that an event may happen at one instant: contacts that touch together hit each other by
/// turns.
const MOST_AT_ONCE: u32 = 16;

/// Power p of n from which on intervals that shrink as n⁻ᵖ are taken for ones that add up to a time. A chirp,
/// sin eᵗ, has p = 1 and goes on for ever; what is squeezed has p = 2; what bounces has them shrink by a
/// ratio, which is more than any power.
const ADDS_UP: f64 = 1.5;

/// Guards one event against accumulation: many resets in a row, each sooner than the one before, at last a
/// millionth of the first interval apart, in intervals that add up to a time; or many at one instant.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Zeno {
    last: Option<f64>,
    first_interval: f64,
    interval: f64,
    shrinking: u32,
    /// Two intervals before, each with its number: the last whose number is a power of two, and the one
    /// before that.
    marks: [(u32, f64); 2],
    at_once: u32,
    /// The speed with which a contact was hit where the intervals began to shrink.
    first_speed: f64,
}

impl Zeno {
    /// `speed`: that with which a contact is hit, 0 of other events. What comes to rest is hit ever more
    /// slowly; what is squeezed between contacts that approach each other ever faster, in intervals as the
    /// square of the time that is left.
    pub(crate) fn note(&mut self, t: f64, h: f64, speed: f64, event: String) -> Result<(), Fault> {
        let Some(last) = self.last.replace(t) else {
            return Ok(());
        };
        let interval = (t - last).abs();
        if interval <= 16.0 * f64::EPSILON * t.abs() {
            self.at_once += 1;
            return match self.at_once < MOST_AT_ONCE {
                true => Ok(()),
                false => Err(Fault::EventsAccumulate { event, at: t, squeezed: false }),
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
        (self.interval, self.at_once) = (interval, 0);
        if self.shrinking >= 8 && interval < 1e-6 * self.first_interval && self.power() > ADDS_UP {
            let squeezed = speed > self.first_speed;
            let root = math::sqrt(ratio);
            let left = match squeezed {
                true => interval / ratio / (1.0 - root) - interval - interval / ratio,
                false => interval * ratio / (1.0 - ratio),
            };
            let left = if ratio < 1.0 { left } else { 0.0 };
            return Err(Fault::EventsAccumulate { event, at: t + left.copysign(h), squeezed });
        }
        Ok(())
    }

    /// With which power of their number intervals shrink, over at least the last half of them.
    fn power(&self) -> f64 {
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
        times.enumerate().find_map(|(i, t)| match zeno.note(t, 1e-3, speed(t), "e".into()) {
            Err(Fault::EventsAccumulate { at, .. }) => Some((i + 1, at)),
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

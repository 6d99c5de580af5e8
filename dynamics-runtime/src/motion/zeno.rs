//! Events that follow each other in ever shorter time.

use alloc::string::String;

use super::error::SimulationErrorKind as Fault;

/// Times in a row that an event may happen at one instant: contacts that touch together hit each other by turns.
const MOST_AT_ONCE: u32 = 16;

/// Guards one event against accumulation: many resets in a row, each sooner than the one before, at last a millionth of the
/// first interval apart; or many at one instant.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Zeno {
    last: Option<f64>,
    first_interval: f64,
    interval: f64,
    shrinking: u32,
    at_once: u32,
}

impl Zeno {
    pub(super) fn note(&mut self, t: f64, h: f64, event: String) -> Result<(), Fault> {
        let Some(last) = self.last.replace(t) else {
            return Ok(());
        };
        let interval = (t - last).abs();
        if interval <= 16.0 * f64::EPSILON * t.abs() {
            self.at_once += 1;
            return if self.at_once < MOST_AT_ONCE { Ok(()) } else { Err(Fault::EventsAccumulate { event, at: t }) };
        }
        if interval < self.interval {
            self.shrinking += 1;
        } else {
            (self.first_interval, self.shrinking) = (interval, 0);
        }
        let ratio = interval / self.interval;
        (self.interval, self.at_once) = (interval, 0);
        if self.shrinking >= 8 && interval < 1e-6 * self.first_interval {
            let left = if ratio < 1.0 { interval * ratio / (1.0 - ratio) } else { 0.0 };
            return Err(Fault::EventsAccumulate { event, at: t + left.copysign(h) });
        }
        Ok(())
    }
}

//! Events that follow each other in ever shorter time.

use alloc::string::String;

use super::error::SimulationErrorKind as Fault;
use crate::math;

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
    /// The speed with which a contact was hit where the intervals began to shrink.
    first_speed: f64,
}

impl Zeno {
    /// `speed`: that with which a contact is hit, 0 of other events. What comes to rest is hit ever more slowly; what is squeezed between contacts
    /// that approach each other ever faster, in intervals as the square of the time that is left.
    pub(super) fn note(&mut self, t: f64, h: f64, speed: f64, event: String) -> Result<(), Fault> {
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
        }
        let ratio = interval / self.interval;
        (self.interval, self.at_once) = (interval, 0);
        if self.shrinking >= 8 && interval < 1e-6 * self.first_interval {
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
}

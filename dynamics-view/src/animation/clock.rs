//! Which instants of a motion a page holds, and how fast it plays them.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use super::Animation;
use crate::text::{self, readable};

/// Instants for each second of playing: the rate of usual screens.
const FRAMES_PER_SECOND: f64 = 60.0;

/// Most instants of a page unless it is set: one minute, some 100 kB for a mechanism of a few links.
const MOST_FRAMES: usize = 3600;

/// Length of a motion, in its own time, below which it is slowed down unless the speed is set.
const SLOWED_BELOW: f64 = 2.0;

/// Length of a motion, in its own time, above which it is sped up to about a minute.
const SPED_UP_ABOVE: f64 = 60.0;

/// The instants that a page holds.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Clock {
    pub(super) start: f64,
    pub(super) step: f64,
    pub(super) frames: usize,
    /// Seconds of the motion per second of playing.
    pub(super) speed: f64,
    /// Notes about them for the viewer.
    pub(super) notes: Vec<String>,
}

impl Clock {
    pub(super) fn of(animation: &Animation<'_>) -> Self {
        let unit = animation.time_unit();
        let spans: Vec<_> = animation.films.iter().map(|(film, _)| film.span()).collect();
        let [start, end] = union(&spans);
        let duration = (end - start).abs();
        let speed = animation.speed.unwrap_or_else(|| usual_speed(duration));
        let most = animation.most_frames.unwrap_or(MOST_FRAMES);
        // Long motions get as many instants as allowed, so that a viewer can slow them down.
        let wanted = if duration > SPED_UP_ABOVE {
            most as f64
        } else {
            libm::ceil(duration / speed * FRAMES_PER_SECOND) + 1.0
        };
        let frames = if duration > 0.0 { (wanted.min(most as f64) as usize).max(2) } else { 1 };
        let step = if frames > 1 { (end - start) / (frames - 1) as f64 } else { 0.0 };
        let mut notes = Vec::new();
        if speed != 1.0 && duration > 0.0 {
            notes.push(format!("played {} × as fast as real time", readable(speed, 3)));
        }
        // Slowed down to real time, the page would show less than it could.
        if step.abs() > 1.01 / FRAMES_PER_SECOND {
            notes.push(format!("one instant every {}", text::value_with_unit(step.abs(), &unit)));
        }
        Self { start, step, frames, speed, notes }
    }

    /// The instants, none outside of `span`: a motion that is over stays where it ended.
    pub(super) fn times(&self, [start, end]: [f64; 2]) -> Vec<f64> {
        let (lo, hi) = (start.min(end), start.max(end));
        (0..self.frames).map(|k| (self.start + k as f64 * self.step).clamp(lo, hi)).collect()
    }
}

/// From the first beginning to the last end, in the direction of the first motion.
fn union(spans: &[[f64; 2]]) -> [f64; 2] {
    let all = || spans.iter().flatten().copied().filter(|t| t.is_finite());
    let (lo, hi) = all().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), t| (lo.min(t), hi.max(t)));
    match spans.first() {
        _ if lo > hi => [0.0, 0.0],
        Some([start, end]) if end < start => [hi, lo],
        _ => [lo, hi],
    }
}

/// Real time where that can be watched; else the round speed with which playing takes 5 to 12 or 24 to 60
/// seconds.
fn usual_speed(duration: f64) -> f64 {
    let round = |least: f64| {
        let power = libm::pow(10.0, libm::floor(libm::log10(least)));
        [1.0, 2.0, 5.0, 10.0]
            .map(|digit| digit * power)
            .into_iter()
            .find(|speed| *speed >= least * (1.0 - 1e-9))
            .unwrap_or(least)
    };
    if duration > SPED_UP_ABOVE {
        round(duration / SPED_UP_ABOVE)
    } else if duration > 0.0 && duration < SLOWED_BELOW {
        round(duration / 12.0)
    } else {
        1.0
    }
}

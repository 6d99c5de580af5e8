//! A progress bar for runs that take more than a second; nothing without the feature `progress`.

#[cfg(feature = "progress")]
use std::time::{Duration, Instant};

/// Shows how far a run has come.
pub struct Progress {
    #[cfg(feature = "progress")]
    bar: Option<Bar>,
}

#[cfg(feature = "progress")]
struct Bar {
    start: f64,
    end: f64,
    what: &'static str,
    begun: Instant,
    updated: Instant,
    bar: Option<indicatif::ProgressBar>,
}

impl Progress {
    /// Shows nothing.
    #[must_use]
    pub fn none() -> Self {
        Self {
            #[cfg(feature = "progress")]
            bar: None,
        }
    }

    /// For a run from start to end.
    #[cfg(feature = "progress")]
    pub(crate) fn new(start: f64, end: f64) -> Self {
        Self::of("t", start, end)
    }

    /// For a quantity `what` that goes from start to end.
    #[cfg(feature = "progress")]
    #[must_use]
    pub fn of(what: &'static str, start: f64, end: f64) -> Self {
        let now = Instant::now();
        Self { bar: Some(Bar { start, end, what, begun: now, updated: now, bar: None }) }
    }

    /// Notes that a run has come to time t.
    #[inline]
    pub fn at(&mut self, t: f64) {
        #[cfg(feature = "progress")]
        if let Some(bar) = &mut self.bar {
            bar.at(t);
        }
        #[cfg(not(feature = "progress"))]
        let _ = t;
    }
}

#[cfg(feature = "progress")]
impl Bar {
    /// Positions of the bar: thousandths of the run.
    const POSITIONS: u64 = 1000;

    /// Updates the bar, ten times a second at most and after the first second.
    fn at(&mut self, t: f64) {
        let now = Instant::now();
        if now - self.updated < Duration::from_millis(100) || now - self.begun < Duration::from_secs(1) {
            return;
        }
        self.updated = now;
        let share = (t - self.start) / (self.end - self.start);
        let bar = self.bar.get_or_insert_with(|| {
            let style =
                indicatif::ProgressStyle::with_template("{bar:40} {msg}  {elapsed} of about {duration}");
            let bar = indicatif::ProgressBar::new(Self::POSITIONS);
            if let Ok(style) = style {
                bar.set_style(style);
            }
            bar
        });
        bar.set_position((share * Self::POSITIONS as f64) as u64);
        bar.set_message(format!("{} = {t:.6}", self.what));
    }
}

#[cfg(feature = "progress")]
impl Drop for Bar {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

//! The estimated error in the words of the summary.

use core::fmt;

use crate::motion::trajectory::global_error::{GlobalError, MUCH, ReferenceSettings, Shift};
use crate::wording::{Grouped, Rounded, Times};

impl GlobalError {
    /// Whether the error is too large to pass unnoticed: more than a thousand permitted ones, no digit left,
    /// or an event in one run alone.
    #[must_use]
    pub fn is_large(&self) -> bool {
        let much = |ratio: Option<f64>| ratio.is_some_and(|ratio| ratio.is_nan() || ratio > MUCH);
        much(self.ratio) || much(self.between) || self.lost_at.is_some() || self.unmatched.is_some()
    }
}

impl fmt::Display for GlobalError {
    /// The lines of the summary, without an end of line.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "  error        ")?;
        for (what, largest) in [("coordinates", self.coordinates), ("velocities", self.velocities)] {
            let comma = if what == "velocities" { ", " } else { "" };
            write!(f, "{comma}{what} {:.1e}", largest.error)?;
            if largest.error != 0.0 {
                write!(f, " ({} at t = {})", largest.name, Rounded(largest.time))?;
            }
        }
        if let Some(ratio) = self.ratio {
            match ratio {
                ..10.0 => write!(f, ": {ratio:.1} times the tolerance")?,
                ..1e6 => write!(f, ": {} times the tolerance", Grouped(ratio as u64))?,
                _ => write!(f, ": {ratio:.1e} times the tolerance")?,
            }
        }
        if let Some(between) = self.more_between() {
            write!(f, ", between steps {}", Times(between))?;
        }
        let evaluations = Grouped(self.evaluations);
        match self.reference {
            ReferenceSettings::HalfStep(h) => {
                write!(f, "\n               by a second run with a step of {h:e}")?
            }
            ReferenceSettings::Tighter { absolute, relative } => {
                write!(f, "\n               by a second run at tolerance {:.1e}", absolute.max(relative))?;
            }
            ReferenceSettings::Looser { absolute, relative } => {
                let second = absolute.max(relative);
                write!(
                    f,
                    "\n               at most, by a second run at tolerance {second:.1e}: rounding permits \
                     none below"
                )?;
            }
        }
        write!(f, ", {evaluations} evaluations")?;
        if let Some(Shift { name, time, by }) = self.shift.as_ref().filter(|shift| shift.by != 0.0) {
            write!(
                f,
                "\n               events shift by {:.1e} at most ({name} at t = {})",
                by.abs(),
                Rounded(*time)
            )?;
        }
        self.write_warnings(f)
    }
}

impl GlobalError {
    /// The error between steps, where it is worth saying: beyond ten permitted ones, and twice that at the
    /// ends.
    fn more_between(&self) -> Option<f64> {
        let ratio = self.ratio?;
        self.between.filter(|between| *between > 2.0 * ratio && *between > 10.0)
    }

    fn write_warnings(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const WARNING: &str = "\n  warning      ";
        if let Some((t, why)) = &self.broken_off {
            write!(
                f,
                "{WARNING}the second run broke off at t = {}: {why}; later errors are not known",
                Rounded(*t)
            )?;
        }
        if let Some(Shift { name, time, .. }) = &self.unmatched {
            write!(
                f,
                "{WARNING}event {name} at t = {} happens in one of the two runs alone; shorten the steps by \
                 `.max_step(..)` or a smaller tolerance",
                Rounded(*time)
            )?;
        }
        match (self.lost_at, self.ratio) {
            (Some(t), _) => write!(
                f,
                "{WARNING}errors as large as the motion from t = {} on: nothing later can be trusted",
                Rounded(t)
            )?,
            (None, _) if self.more_between().is_some_and(|between| between > MUCH) => write!(
                f,
                "{WARNING}states between steps are off far beyond the tolerance; shorten the steps by \
                 `.max_step(..)`"
            )?,
            (None, Some(ratio)) if ratio.is_nan() || ratio > MUCH => {
                write!(
                    f,
                    "{WARNING}the motion amplifies errors far beyond the tolerance; give a smaller one for \
                     more digits"
                )?;
            }
            _ => {}
        }
        if let Some(time) = self.doubling_time {
            let (time, digit) = (Rounded(time), Rounded(time / core::f64::consts::LOG10_2));
            write!(
                f,
                "\n               errors double every {time:.3}: a digit more of tolerance lasts {digit:.3} \
                 longer"
            )?;
        }
        Ok(())
    }
}

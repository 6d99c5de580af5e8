//! Text of the estimated error in the summary.

use alloc::vec::Vec;
use core::fmt;

use crate::simulate::trajectory::global_error::{
    ErrorFinding, EventShift, GlobalError, LARGE_ERROR, ReferenceSettings,
};
use crate::wording::{Grouped, Rounded, Times};

impl GlobalError {
    /// Whether the error is too large to pass unnoticed: more than a thousand permitted ones, no digit left,
    /// or an event in one run alone.
    #[must_use]
    pub fn is_large(&self) -> bool {
        let is_beyond = |ratio: Option<f64>| ratio.is_some_and(|ratio| ratio.is_nan() || ratio > LARGE_ERROR);
        is_beyond(self.ratio) || is_beyond(self.between) || self.lost_at.is_some() || self.unmatched.is_some()
    }
}

impl fmt::Display for GlobalError {
    /// The lines of the summary, without an end of line.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.write_lines(f)?;
        self.findings().iter().try_for_each(|finding| write!(f, "\n  warning      {finding}"))
    }
}

impl GlobalError {
    /// The lines without warnings.
    pub(crate) fn write_lines(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
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
        if let Some(EventShift { name, time, by }) = self.shift.as_ref().filter(|shift| shift.by != 0.0) {
            write!(
                f,
                "\n               events shift by {:.1e} at most ({name} at t = {})",
                by.abs(),
                Rounded(*time)
            )?;
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

    /// Findings that make the motion doubtful.
    #[must_use]
    pub fn findings(&self) -> Vec<ErrorFinding> {
        let mut findings = Vec::new();
        if let Some((time, reason)) = &self.broken_off {
            findings.push(ErrorFinding::ReferenceBrokeOff { time: *time, reason: reason.clone() });
        }
        if let Some(EventShift { name, time, .. }) = &self.unmatched {
            findings.push(ErrorFinding::EventUnmatched { name: name.clone(), time: *time });
        }
        match (self.lost_at, self.ratio) {
            (Some(from), _) => findings.push(ErrorFinding::AsLargeAsTheMotion { from }),
            (None, _) if self.more_between().is_some_and(|between| between > LARGE_ERROR) => {
                findings.push(ErrorFinding::LargeBetweenSteps);
            }
            (None, Some(ratio)) if ratio.is_nan() || ratio > LARGE_ERROR => {
                findings.push(ErrorFinding::Amplified { ratio });
            }
            _ => {}
        }
        findings
    }

    /// The error between steps, where it is more than ten permitted errors and more than twice that at the
    /// ends.
    fn more_between(&self) -> Option<f64> {
        let ratio = self.ratio?;
        self.between.filter(|between| *between > 2.0 * ratio && *between > 10.0)
    }
}

impl fmt::Display for ErrorFinding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ReferenceBrokeOff { time, reason } => write!(
                f,
                "the second run broke off at t = {}: {reason}; later errors are not known",
                Rounded(*time)
            ),
            Self::EventUnmatched { name, time } => write!(
                f,
                "event {name} at t = {} happens in one of the two runs alone; shorten the steps by \
                 `.max_step(..)` or a smaller tolerance",
                Rounded(*time)
            ),
            Self::AsLargeAsTheMotion { from } => write!(
                f,
                "errors as large as the motion from t = {} on: nothing later can be trusted",
                Rounded(*from)
            ),
            Self::LargeBetweenSteps => f.write_str(
                "states between steps are off far beyond the tolerance; shorten the steps by `.max_step(..)`",
            ),
            Self::Amplified { .. } => f.write_str(
                "the motion amplifies errors far beyond the tolerance; give a smaller one for more digits",
            ),
        }
    }
}

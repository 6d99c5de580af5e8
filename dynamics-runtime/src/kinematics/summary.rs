//! Cost of a kinematic analysis, and how near it came to singular positions.

use alloc::vec::Vec;
use core::fmt;

use crate::constrain::TopContributors;
use crate::simulate::Counts;
use crate::wording::Rounded;

/// A bifurcation that was passed.
#[derive(Clone, Debug, PartialEq)]
pub struct Passage {
    /// When.
    pub time: f64,
    /// The rows that depend on each other there.
    pub rows: TopContributors,
    /// The coordinates that could have gone either way.
    pub coordinates: TopContributors,
}

/// The summary of a kinematic analysis.
#[derive(Clone, Debug, PartialEq)]
pub struct KinematicSummary {
    /// Name of the model.
    pub model: &'static str,
    /// The interval that was covered.
    pub interval: (f64, f64),
    /// Steps of the path.
    pub steps: u64,
    /// Steps that were refused and made shorter.
    pub rejected: u64,
    /// Newton corrections of positions, those of refused steps included.
    pub corrections: u64,
    /// Largest condition number of Φ_q on the path (largest over smallest singular value, with rows at unit
    /// length and coordinates scaled by √Mᵢᵢ): positions and velocities lose log₁₀ of it of their sixteen
    /// digits there.
    pub worst_condition: f64,
    /// When it was met.
    pub worst_condition_time: f64,
    /// Bifurcations that were passed.
    pub passages: Vec<Passage>,
}

impl KinematicSummary {
    /// The counts of the motion.
    pub(super) fn counts(&self) -> Counts {
        let Self { steps, rejected, corrections, .. } = *self;
        Counts { steps, rejected, evaluations: corrections, ..Counts::default() }
    }
}

impl fmt::Display for KinematicSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (start, end) = (Rounded(self.interval.0), Rounded(self.interval.1));
        writeln!(f, "{} driven from t = {start} to {end}", self.model)?;
        let per_step = self.corrections as f64 / (self.steps + self.rejected).max(1) as f64;
        writeln!(
            f,
            "  steps        {} accepted, {} refused, {} Newton corrections ({per_step:.1} per step)",
            self.steps, self.rejected, self.corrections
        )?;
        write!(
            f,
            "  conditioning {:.1e} at most, at t = {}",
            self.worst_condition,
            Rounded(self.worst_condition_time)
        )?;
        for Passage { time, rows, coordinates } in &self.passages {
            write!(
                f,
                "\n  passed       a bifurcation at t = {}: the rank falls with {rows}, {coordinates} could \
                 go either way",
                Rounded(*time)
            )?;
        }
        Ok(())
    }
}

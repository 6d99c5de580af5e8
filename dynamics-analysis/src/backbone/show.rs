//! A family of closed motions as text and as a chart of frequency over energy.

use alloc::format;
use alloc::vec::Vec;
use core::fmt;

use dynamics_runtime::model::ModelState;
use dynamics_view::text::with_unit;
use dynamics_view::{Axis, Panel};

use super::BackboneCurve;

impl<S: ModelState> BackboneCurve<S> {
    /// Frequency over energy, in two curves: where disturbances do not grow, and where they grow or the
    /// stability is unknown. The linear frequency is shown, too.
    #[must_use]
    pub fn panel(&self) -> Panel {
        let mut panel = Panel::new(
            Axis::new(with_unit("energy above rest", self.energy_unit)),
            Axis::new("frequency in rad/s"),
        );
        panel = self.lines("", panel);
        let most = self.points.iter().fold(0.0, |most: f64, point| most.max(point.energy));
        let linear = self.mode.eigenvalue.im;
        panel.line("linear", [(0.0, linear), (most, linear)])
    }

    /// Adds the curve to a panel of frequencies over energies, its lines named after `name`.
    #[must_use]
    pub fn lines(&self, name: &str, mut panel: Panel) -> Panel {
        let mut first = 0;
        let ends: Vec<usize> = self.changes().into_iter().chain([self.points.len()]).collect();
        for end in ends {
            let from = first.max(1) - 1;
            let stable = self.points.get(first).is_some_and(|point| point.orbit.floquet.is_stable());
            let what = if stable { "stable" } else { "not stable" };
            let separator = if name.is_empty() { "" } else { ", " };
            let line: Vec<(f64, f64)> =
                self.points[from..end].iter().map(|p| (p.energy, p.frequency)).collect();
            panel = panel.line(format!("{name}{separator}{what}"), line);
            first = end;
        }
        panel
    }
}

/// The linear mode, then a line for each motion.
impl<S: ModelState> fmt::Display for BackboneCurve<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.mode)?;
        write!(f, "{:>14} {:>16}  multipliers", "energy", "rad/s")?;
        for point in &self.points {
            write!(
                f,
                "\n{:>14.6e} {:>16.10}  {}",
                point.energy, point.frequency, point.orbit.floquet.verdict
            )?;
        }
        Ok(())
    }
}

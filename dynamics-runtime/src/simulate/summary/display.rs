//! Text of the summary.

use alloc::string::String;
use core::fmt;

use crate::integrate::Tolerances;
use crate::simulate::options::defaults::DEFAULT_TOLERANCE;
use crate::simulate::stabilization::StabilizationCounts;
use crate::simulate::summary::{Drift, Summary};
use crate::simulate::verification::conditioning::{Conditioning, NearestSingularPosition};
use crate::simulate::verification::constraint_drift::ConstraintDrift;
use crate::wording::{Grouped, Rounded};

/// The line of a summary without the checks of [`Motion::verify`](crate::simulate::Motion::verify).
pub(crate) const NOT_VERIFIED: &str =
    "  not checked  what steps pass over and what their errors add up to: ask `.verify()`";

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (start, end) = self.interval;
        writeln!(f, "{} from t = {} to {}", self.model, Rounded(start), Rounded(end))?;
        writeln!(f, "  method       {}, {}", self.method, self.reason)?;
        if let Some((from, method)) = self.switched {
            let why = "because stability and not accuracy bounded the steps of the first";
            writeln!(f, "               from t = {} on {method}, {why}", Rounded(from))?;
        }
        if let Some(Tolerances { absolute, relative }) = self.tolerances.filter(|t| t.absolute < t.relative) {
            writeln!(f, "  tolerances   {absolute:.1e} absolute, {relative:.1e} relative")?;
        }
        writeln!(
            f,
            "  steps        {} accepted, {} rejected, {} evaluations of the accelerations",
            Grouped(self.steps),
            Grouped(self.rejected),
            Grouped(self.evaluations)
        )?;
        if let (steps @ 1.., Some(first)) = self.subdivided_steps {
            let (were, at) = if steps == 1 { ("was", "at") } else { ("were", "first at") };
            let steps = Grouped(steps);
            writeln!(
                f,
                "               {steps} {were} made in parts, to go round a singular position, {at} t = {}",
                Rounded(first)
            )?;
        }
        if let Some(time) = self.wall_time {
            writeln!(f, "  wall time    {time:.3?}")?;
        }
        if let Some(error) = &self.error {
            error.write_lines(f)?;
            writeln!(f)?;
        }
        self.write_drift(f)?;
        self.write_constraints(f)?;
        let Conditioning { largest, time, looked_at: (seen, all) } = self.conditioning;
        if largest != 1.0 {
            write!(f, "\n  conditioning mass matrix {largest:.1e} at most, at t = {}", Rounded(time))?;
            if seen < all {
                write!(f, ", of {} of {} states", Grouped(seen as u64), Grouped(all as u64))?;
            }
        }
        if let Some(locking) = &self.gimbal_lock {
            write!(f, "\n               {}, at t = {}", locking.describe(), Rounded(locking.time))?;
        }
        for (k, few) in self.few_digits.iter().enumerate() {
            write!(f, "\n  {:<11}  {few}", if k == 0 { "few digits" } else { "" })?;
        }
        self.write_events(f)
    }
}

impl Summary {
    /// Drift of what should stay constant.
    fn write_drift(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.energy_scale.is_infinite() {
            write!(f, "  drift        energy grows beyond all numbers")?;
        } else if self.has_work && !self.verified {
            let (name, unit) = (self.energy_name, SpacedUnit(self.energy_unit));
            write!(f, "  drift        {name}, of {:.6e}{unit}: ask `.verify()`", self.energy_scale)?;
        } else if self.energy_drift.is_nan() {
            write!(f, "  drift        energy cannot be accounted for: inputs or their rates are not known")?;
        } else {
            let unit = SpacedUnit(self.energy_unit);
            write!(
                f,
                "  drift        {} {:.1e} of {:.6e}{unit}",
                self.energy_name, self.energy_drift, self.energy_scale
            )?;
        }
        for Drift { name, largest, scale, .. } in &self.conserved {
            // A quantity whose value is no larger than its drift, such as the momentum of a system at rest,
            // has no scale of its own.
            if *largest < 0.1 * scale {
                write!(f, "\n               {name} {:.1e} of {scale:.6e}", largest / scale)?;
            } else if *largest == 0.0 {
                write!(f, "\n               {name} stays 0")?;
            } else {
                write!(f, "\n               {name} stays within {largest:.1e} of its start")?;
            }
        }
        Ok(())
    }

    /// Events, warnings, omitted checks, and the line about the global error.
    fn write_events(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, (name, count)) in self.events.iter().enumerate() {
            let label = if i == 0 { "events" } else { "" };
            let times = if *count == 1 { "once" } else { "times" };
            let count =
                if *count == 1 { String::new() } else { alloc::format!("{} ", Grouped(*count as u64)) };
            write!(f, "\n  {label:<11}  {name} {count}{times}")?;
        }
        if let Some(name) = &self.stopped_by {
            write!(f, "\n  stopped      by event {name}")?;
        }
        for warning in self.warnings() {
            write!(f, "\n  warning      {warning}")?;
        }
        if self.verified {
            fmt::Display::fmt(&self.accuracy.unchecked, f)?;
        } else {
            write!(f, "\n{NOT_VERIFIED}")?;
        }
        if self.error.is_none() {
            self.accuracy.write_global_error(f)?;
        }
        Ok(())
    }

    fn write_constraints(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some((formulation, reason)) = &self.formulation else {
            return Ok(());
        };
        write!(f, "\n  constraints  {formulation}, {reason}")?;
        let largest = |of: fn(&ConstraintDrift) -> f64| {
            self.constraints.iter().fold(("", 0.0f64), |worst, drift| {
                let value = of(drift);
                if value > worst.1 || value.is_nan() { (drift.row, value) } else { worst }
            })
        };
        for (what, (row, value)) in [
            ("position", largest(|drift| drift.residual)),
            ("velocity", largest(|drift| drift.velocity_residual)),
        ] {
            if !row.is_empty() {
                write!(f, "\n               {what} drift {value:.1e} at most, of {row}")?;
            }
        }
        self.write_stabilization(f)?;
        self.write_nearest(f)?;
        if self.impacts > 0 {
            let (impacts, unit) = (Grouped(self.impacts as u64), SpacedUnit(self.energy_unit));
            write!(f, "\n  impacts      {impacts}, {:.6e}{unit} of energy lost", self.energy_lost)?;
        }
        let StabilizationCounts { rests, fastest_rest, .. } = self.stabilization;
        if rests > 0 {
            let times = if rests == 1 { String::new() } else { alloc::format!(", {} times", Grouped(rests)) };
            write!(
                f,
                "\n               too slow to rebound at {fastest_rest:.1e} or less{times}: no `rest_speed` \
                 is given"
            )?;
        }
        Ok(())
    }

    /// Why evaluations fell back to the general solver, and that they are slow where there are many.
    fn describe_fallbacks(&self, fallbacks: u64) -> String {
        let mut words = String::from(" by the general solver, where a pivot of the generated code vanished");
        if let Some((vanished, t)) = self.pivot_breakdown.as_ref().zip(self.stabilization.general_at) {
            words += &alloc::format!(": {vanished}, first at t = {}", Rounded(t));
        }
        if fallbacks as f64 > MANY_FALLBACKS_SHARE * self.evaluations as f64 {
            words += "; each takes several times as long";
        }
        words
    }

    /// Cost of the constraint stabilization.
    fn write_stabilization(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let StabilizationCounts { general, released, dependent, dependent_at, repartitions, .. } =
            self.stabilization;
        let StabilizationCounts { projected, largest_move, .. } = self.stabilization;
        // Without generated code the general solver is no fallback.
        let (released, fallbacks) = if self.falls_back { (released, general - released) } else { (0, 0) };
        let mut line = |count: u64, what: &str, how: &str| match count {
            0 => Ok(()),
            1 => write!(f, "\n               1 {what}{how}"),
            _ => write!(f, "\n               {} {what}s{how}", Grouped(count)),
        };
        let by_general = alloc::format!(" by the general solver ({} released)", self.released.join(", "));
        line(released, "evaluation", &by_general)?;
        line(fallbacks, "evaluation", &self.describe_fallbacks(fallbacks))?;
        line(
            repartitions,
            "choice",
            " of other dependent coordinates, where a pivot of the generated code vanished",
        )?;
        line(dependent, "evaluation", " with dependent constraints, where reactions are not unique")?;
        if let Some(t) = dependent_at {
            write!(f, ", first at t = {}", Rounded(t))?;
        }
        // Adaptive steps that end further away are repeated.
        if largest_move > LARGE_MOVE {
            write!(
                f,
                "\n               {} ends of steps put back onto the constraints, by ",
                Grouped(projected)
            )?;
            match self.accuracy.fixed {
                true => write!(
                    f,
                    "{largest_move:.1e} of what a tolerance of {DEFAULT_TOLERANCE:e} permits at most; \
                     shorten the fixed step"
                )?,
                false => write!(
                    f,
                    "{largest_move:.1e} permitted errors at most; shorten them with `.max_step(..)` or a \
                     smaller tolerance"
                )?,
            }
        }
        Ok(())
    }

    /// The nearest approach to a singular position.
    fn write_nearest(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(NearestSingularPosition { condition, time, rows, coordinates, passed, .. }) =
            &self.nearest
            && *condition > 1e3
        {
            match passed {
                0 => write!(f, "\n               near a singular position")?,
                1 => write!(f, "\n               passed a singular position")?,
                more => write!(
                    f,
                    "\n               passed {} singular positions, the nearest",
                    Grouped(*more as u64)
                )?,
            }
            write!(
                f,
                " at t = {}: {} in {coordinates}, conditioning {condition:.1e}",
                Rounded(*time),
                rows.rank_loss()
            )?;
        } else if let Some((largest, time)) = self.stabilization.conditioning
            && largest > 1e3
        {
            write!(f, "\n               conditioning {largest:.1e} at most, at t = {}", Rounded(time))?;
        }
        Ok(())
    }
}

/// Fallbacks to the general solver beyond this part of all evaluations are reported as slow.
const MANY_FALLBACKS_SHARE: f64 = 0.1;
/// Projections by more than this many permitted errors are reported.
const LARGE_MOVE: f64 = 10.0;

/// A unit after a space; empty where there is none.
struct SpacedUnit(&'static str);

impl fmt::Display for SpacedUnit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.is_empty() { Ok(()) } else { write!(f, " {}", self.0) }
    }
}

//! What a motion cost and how far it can be trusted.

use alloc::string::{String, ToString};
use alloc::vec;
use alloc::vec::Vec;
use core::fmt;
use core::time::Duration;

use crate::integrate::{Method, Tolerances};
use crate::model::{Constraint, ConstraintKind, Known, ModelState, Route, SimulationModel};
use crate::motion::events::action::Impact;
use crate::motion::failure::gimbal_lock::GimbalLock;
use crate::motion::options::defaults::DEFAULT_TOLERANCE;
use crate::motion::options::formulation::Formulation;
use crate::motion::pilot_run::{CoordinateSizes, FewDigits};
use crate::motion::stabilization::StabilizationCounts;
use crate::motion::stabilization::adaptive_gain::DriftInfluence;
use crate::motion::trajectory::global_error::GlobalError;
use crate::motion::trajectory::motion::Motion;
use crate::motion::verification::accuracy_diagnostics::AccuracyDiagnostics;
use crate::motion::verification::conditioning::{Conditioning, Nearest};
use crate::motion::verification::constraint_drift::ConstraintDrift;
use crate::motion::verification::pivot_breakdown::PivotBreakdown;
use crate::wording::{Grouped, Part, Rounded};

/// How much a quantity that should stay constant has changed.
#[derive(Clone, Debug, PartialEq)]
pub struct Drift {
    /// Its name.
    pub name: String,
    /// Largest change from its value at the start, or since the last reset.
    pub largest: f64,
    /// Largest |value| met.
    pub scale: f64,
}

/// The summary of a run: method, costs, drift of what should stay constant, events.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// Name of the model.
    pub model: &'static str,
    /// The simulated interval.
    pub interval: (f64, f64),
    /// The method.
    pub method: Method,
    /// Why this method.
    pub reason: String,
    /// When and with which method the run went on, because the motion was stiff for the first one.
    pub switched: Option<(f64, Method)>,
    /// Accepted steps.
    pub steps: u64,
    /// Rejected steps.
    pub rejected: u64,
    /// Evaluations of the accelerations.
    pub evaluations: u64,
    /// Time the run took; `None` without the standard library.
    pub wall_time: Option<Duration>,
    /// Largest |E − E₀ − work| over the accepted steps, relative to `energy_scale`; NaN where inputs do work
    /// that is not known, as [`Motion::work`] says.
    pub energy_drift: f64,
    /// Largest of |½ q̇·∂L/∂q̇|, |E − ½ q̇·∂L/∂q̇|, |E| met: of T and V for natural systems.
    pub energy_scale: f64,
    /// Unit of `energy_scale` and `energy_lost`; empty where the model has no units.
    pub energy_unit: &'static str,
    /// What drifts: `energy`, `energy function` where that is kept and T + V is not, `energy less work` where
    /// something works.
    pub energy_name: &'static str,
    /// Whether forces, dissipation or explicit time change the energy, so that their work enters
    /// `energy_drift`.
    pub has_work: bool,
    /// Drift of every quantity that the model knows to be conserved, beside the energy.
    pub conserved: Vec<Drift>,
    /// How constraints were kept, and why so; `None` without constraints.
    pub formulation: Option<(Formulation, String)>,
    /// Drift of every row of the constraints.
    pub constraints: Vec<ConstraintDrift>,
    /// What it took to keep them.
    pub stabilization: StabilizationCounts,
    /// There is generated code for accelerations and reactions, so that evaluations by the general solver
    /// with all constraints on are fallbacks.
    pub falls_back: bool,
    /// What no longer followed from its constraints where that came about first, if it is known.
    pub pivot_breakdown: Option<PivotBreakdown>,
    /// Switched constraints that were released at some time.
    pub released: Vec<&'static str>,
    /// Where the motion came nearest to a singular position of its constraints, and how many it passed.
    pub nearest: Option<Nearest>,
    /// How often constraints were hit.
    pub impacts: usize,
    /// Energy that the moving bodies lost in them, see
    /// [`EventRecord::energy_lost`](crate::motion::EventRecord::energy_lost).
    pub energy_lost: f64,
    /// The first impact that a sticking contact took part in: a switched nonholonomic constraint, and when.
    /// It holds whatever the impulse is.
    pub stuck_in_impact: Option<(&'static str, f64)>,
    /// Worst conditioning of the mass matrix over the accepted states.
    pub conditioning: Conditioning,
    /// Where angles came nearest to gimbal lock, if that is felt.
    pub gimbal_lock: Option<GimbalLock>,
    /// Names of the events and how often each happened.
    pub events: Vec<(String, usize)>,
    /// Events whose functions constraints held at zero while they were engaged: crossings there are rounding,
    /// and were not counted.
    pub kept: Vec<String>,
    /// Whether an event ended the motion: its name.
    pub stopped_by: Option<String>,
    /// When the problem was first found stiff for the method.
    pub stiff_at: Option<f64>,
    /// The error by a second run, where
    /// [`Simulation::estimate_error`](crate::motion::Simulation::estimate_error) asked for it.
    pub error: Option<GlobalError>,
    /// When the motion was first found to slide along a place where accelerations jump: they lead to it from
    /// both sides.
    pub slides_at: Option<f64>,
    /// How many fixed steps were made in parts, to go round positions where constraints nearly lose rank, and
    /// when the first began.
    pub parted: (u64, Option<f64>),
    /// The tolerances that its steps kept; `None` with a fixed step.
    pub tolerances: Option<Tolerances>,
    /// Coordinates and velocities that stay within a thousand absolute tolerances, and so have few digits.
    pub few_digits: Vec<FewDigits>,
    /// What makes its accuracy doubtful.
    pub accuracy: AccuracyDiagnostics,
}

impl<M: SimulationModel> Motion<'_, M> {
    /// Method, costs, drift, conditioning and events. Computes energies, works, condition numbers and the
    /// motion in half steps, so it costs three to five times as much as the run, or a few tenths of a second.
    /// What would take longer is left out, and the summary says so. Laws of inputs are asked again for that,
    /// at times and states that the run has not seen.
    #[must_use]
    pub fn summary(&self) -> Summary {
        #[cfg(feature = "std")]
        let _watch = crate::slow::Watch::start();
        let (mut conditions, asks) = (Vec::new(), self.asks_for_nearest());
        let history = self.energy_history(|sampler, index| {
            if asks {
                self.add_conditions(sampler, index, &mut conditions);
            }
        });
        let worst = history.errors.iter().fold(0.0f64, |worst, (_, error)| larger(worst, error.abs()));
        let counts = self.counts();
        let mut events: Vec<(String, usize)> = Vec::new();
        for event in self.events() {
            match events.iter_mut().find(|(name, _)| *name == event.name) {
                Some((_, count)) => *count += 1,
                None => events.push((event.name.clone(), 1)),
            }
        }
        // The energy has its own row, against its own scale: its value may be near zero by chance.
        let is_energy = |name: &str| matches!(name, "energy" | "energy function");
        let kept = M::CONSERVED.iter().map(|quantity| quantity.name).find(|name| is_energy(name));
        Summary {
            model: M::NAME,
            interval: (self.start_time(), self.end_time()),
            method: self.method(),
            reason: self.trajectory.reason.clone(),
            switched: self.switched(),
            steps: counts.steps,
            rejected: counts.rejected,
            evaluations: counts.evaluations,
            wall_time: counts.wall_time,
            energy_drift: if worst == 0.0 { 0.0 } else { worst / history.scale },
            energy_scale: history.scale,
            energy_unit: crate::model::names::energy_unit::<M>(),
            energy_name: if M::POWERS.is_empty() { kept.unwrap_or("energy") } else { "energy less work" },
            has_work: !M::POWERS.is_empty(),
            conserved: self.drifts().into_iter().filter(|drift| !is_energy(&drift.name)).collect(),
            formulation: self.trajectory.formulation.clone(),
            constraints: self.constraint_drift(),
            stabilization: self.trajectory.stabilization,
            falls_back: matches!(M::ROUTE, Route::Unrolled { .. }),
            pivot_breakdown: self.pivot_breakdown(),
            released: self.released(),
            nearest: self.nearest(&conditions),
            impacts: self
                .events()
                .iter()
                .flat_map(|event| &event.impacts)
                .filter(|impact| !impact.held)
                .count(),
            energy_lost: self.events().iter().fold(0.0, |lost, event| lost + event.energy_lost()),
            stuck_in_impact: self.stuck_in_impact(),
            conditioning: self.conditioning(),
            gimbal_lock: self.gimbal_lock(),
            events,
            kept: self.trajectory.kept.clone(),
            stopped_by: self.events().iter().find(|e| e.stopped).map(|e| e.name.clone()),
            stiff_at: counts.stiff_at,
            error: self.global_error().cloned(),
            slides_at: counts.slides_at,
            parted: counts.parted,
            tolerances: self.kept_tolerances(),
            few_digits: self.few_digits(),
            accuracy: self.accuracy(worst, history.scale),
        }
    }

    /// The tolerances of its steps, if they depended on any.
    fn kept_tolerances(&self) -> Option<Tolerances> {
        let kept = !self.trajectory.fixed && self.trajectory.erased_method.is_some();
        kept.then_some(self.trajectory.tolerances)
    }

    fn few_digits(&self) -> Vec<FewDigits> {
        let Some(tolerances) = self.kept_tolerances() else { return Vec::new() };
        let mut sizes = CoordinateSizes::of::<M>(&self.trajectory.records[0].state);
        self.trajectory.records.iter().for_each(|record| sizes.add::<M>(&record.state));
        sizes.few_digits::<M>(&tolerances)
    }

    fn stuck_in_impact(&self) -> Option<(&'static str, f64)> {
        if M::IS_UNSWITCHED {
            return None;
        }
        let sticks = |name: &str| {
            let held = |c: &&Constraint| c.kind == ConstraintKind::Nonholonomic && c.switched.is_some();
            M::CONSTRAINTS.iter().filter(held).any(|c| c.name == name)
        };
        self.events().iter().find_map(|event| {
            let largest = |impact: &Impact| impact.impulse.iter().fold(0.0f64, |most, x| most.max(x.abs()));
            // Far below what was struck with, it is rounding.
            let least = 1e-9 * event.impacts.iter().map(largest).fold(0.0, f64::max);
            let stuck =
                event.impacts.iter().find(|i| i.held && largest(i) > least && sticks(i.constraint))?;
            Some((stuck.constraint, event.time()))
        })
    }

    /// Names of the switched constraints that some recorded state leaves released.
    fn released(&self) -> Vec<&'static str> {
        if M::IS_UNSWITCHED {
            return Vec::new();
        }
        let off =
            |index: &usize| self.trajectory.records.iter().any(|record| !record.state.modes().holds(*index));
        M::CONSTRAINTS.iter().filter(|c| c.switched.as_ref().is_some_and(off)).map(|c| c.name).collect()
    }

    fn drifts(&self) -> Vec<Drift> {
        let count = M::CONSERVED.len();
        let (mut base, mut values) = (vec![0.0; count], vec![0.0; count]);
        let new = |quantity: &crate::model::Quantity| Drift {
            name: quantity.name.into(),
            largest: 0.0,
            scale: 0.0,
        };
        let mut drifts: Vec<Drift> = M::CONSERVED.iter().map(new).collect();
        let mut afresh = true;
        for record in &self.trajectory.records {
            self.model().conserved(&self.complete(record.state), &mut values);
            if afresh {
                base.copy_from_slice(&values);
            }
            // A reset may change what is conserved between resets.
            afresh = record.h == 0.0;
            for ((drift, value), base) in drifts.iter_mut().zip(&values).zip(&base) {
                drift.largest = larger(drift.largest, (value - base).abs());
                drift.scale = larger(drift.scale, value.abs());
            }
        }
        drifts
    }
}

/// The larger one; NaN wins, so that it is seen.
fn larger(a: f64, b: f64) -> f64 {
    if b.is_nan() || a.is_nan() { f64::NAN } else { a.max(b) }
}

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
        if let (parted @ 1.., Some(first)) = self.parted {
            let (were, at) = if parted == 1 { ("was", "at") } else { ("were", "first at") };
            let parted = Grouped(parted);
            writeln!(
                f,
                "               {parted} {were} made in parts, to go round a singular position, {at} t = {}",
                Rounded(first)
            )?;
        }
        if let Some(time) = self.wall_time {
            writeln!(f, "  wall time    {time:.3?}")?;
        }
        if let Some(error) = &self.error {
            writeln!(f, "{error}")?;
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

/// What a line of the summary begins with that is a warning.
const WARNING: &str = "  warning ";

impl Summary {
    /// What makes the motion doubtful, a sentence for each warning of the summary, for programs that go on
    /// only where there is none: errors beyond the tolerance, stiffness, what is passed over, drift. What it
    /// is in numbers stands in [`Summary::accuracy`], [`Summary::error`] and their neighbours.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        self.to_string()
            .lines()
            .filter_map(|line| line.strip_prefix(WARNING))
            .map(|line| line.trim().into())
            .collect()
    }

    /// What should stay constant.
    fn write_drift(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.energy_scale.is_infinite() {
            write!(f, "  drift        energy grows beyond all numbers")?;
        } else if self.energy_drift.is_nan() {
            write!(f, "  drift        energy cannot be accounted for: inputs or their rates are not known")?;
        } else {
            let unit = Spaced(self.energy_unit);
            write!(
                f,
                "  drift        {} {:.1e} of {:.6e}{unit}",
                self.energy_name, self.energy_drift, self.energy_scale
            )?;
        }
        for Drift { name, largest, scale } in &self.conserved {
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

    /// What happened, and what is to be minded.
    fn write_events(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, (name, count)) in self.events.iter().enumerate() {
            let label = if i == 0 { "events" } else { "" };
            let times = if *count == 1 { "once" } else { "times" };
            let count =
                if *count == 1 { String::new() } else { alloc::format!("{} ", Grouped(*count as u64)) };
            write!(f, "\n  {label:<11}  {name} {count}{times}")?;
        }
        for name in &self.kept {
            write!(
                f,
                "\n  warning      event {name} is what a constraint holds at zero: while it holds, crossings \
                 are rounding, and do not count"
            )?;
        }
        if let Some(name) = &self.stopped_by {
            write!(f, "\n  stopped      by event {name}")?;
        }
        if let Some(t) = self.stiff_at
            && self.switched.is_none()
        {
            write!(
                f,
                "\n  warning      stiff from t = {}: stability, not accuracy, bounds the step of this \
                 explicit method; use methods::Radau5",
                Rounded(t)
            )?;
        }
        if let Some(t) = self.slides_at {
            write!(
                f,
                "\n  warning      slides from t = {} along a jump of the accelerations: short steps there, \
                 to and fro; let what sticks be a switched constraint",
                Rounded(t)
            )?;
        }
        if let Some(DriftInfluence { part, time }) =
            self.stabilization.turned.filter(|turned| turned.part > TURNED)
        {
            write!(
                f,
                "\n  warning      drift of the constraints turned the motion by up to {} at t = {}; use \
                 Formulation::Projected",
                Part(part),
                Rounded(time)
            )?;
        }
        if let Some(locking) = self.gimbal_lock.as_ref().filter(|locking| locking.doubtful) {
            write!(
                f,
                "\n  warning      gimbal lock at t = {}: {}; use Euler parameters (`#[coordinates(e: [_; \
                 4])]`, `EulerParameters::new(q.e).rotation()` and its `norm_constraint()` under \
                 `#[holonomic]`), change charts (`ChartSwitching`), or take a set whose middle angle stays away from \
                 its singular values, such as {}",
                Rounded(locking.time),
                locking.what_it_takes(),
                locking.other_set()
            )?;
        }
        if let Some((by, time)) = self.nearest.as_ref().and_then(|nearest| nearest.missed) {
            let remedy = match self.accuracy.fixed {
                true => "with this fixed step; give a tolerance well below that in its place",
                false => "at this tolerance; give one well below that",
            };
            write!(
                f,
                "\n  warning      the constraints miss the singular position at t = {} by {by:.1e}: whether \
                 a motion goes on or turns round there is not told {remedy}",
                Rounded(time)
            )?;
        }
        self.accuracy.write(f, self.error.is_some())?;
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
            let (impacts, unit) = (Grouped(self.impacts as u64), Spaced(self.energy_unit));
            write!(f, "\n  impacts      {impacts}, {:.6e}{unit} of energy lost", self.energy_lost)?;
        }
        if let Some((constraint, time)) = self.stuck_in_impact {
            write!(
                f,
                "\n  warning      `{constraint}` stuck in an impact at t = {}, however large its impulse is; \
                 where friction would let go, release it in the event's action with `.release_to(..)`",
                Rounded(time)
            )?;
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

    /// Where evaluations were left to the general solver, and what of it where these are many.
    fn words_of_fallen(&self, fallen: u64) -> String {
        let mut words = String::from(" by the general solver, where a pivot of the generated code vanished");
        if let Some((vanished, t)) = self.pivot_breakdown.as_ref().zip(self.stabilization.general_at) {
            words += &alloc::format!(": {vanished}, first at t = {}", Rounded(t));
        }
        if fallen as f64 > MANY * self.evaluations as f64 {
            words += "; each takes several times as long";
        }
        words
    }

    /// What it took to keep the constraints.
    fn write_stabilization(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let StabilizationCounts { general, released, dependent, dependent_at, repartitions, .. } =
            self.stabilization;
        let StabilizationCounts { settled, largest_move, .. } = self.stabilization;
        // Where the general solver is the route it is no fallback.
        let (released, fallen) = if self.falls_back { (released, general - released) } else { (0, 0) };
        let mut line = |count: u64, what: &str, how: &str| match count {
            0 => Ok(()),
            1 => write!(f, "\n               1 {what}{how}"),
            _ => write!(f, "\n               {} {what}s{how}", Grouped(count)),
        };
        let by_general = alloc::format!(" by the general solver ({} released)", self.released.join(", "));
        line(released, "evaluation", &by_general)?;
        line(fallen, "evaluation", &self.words_of_fallen(fallen))?;
        line(
            repartitions,
            "choice",
            " of other dependent coordinates, where a pivot of the generated code vanished",
        )?;
        line(dependent, "evaluation", " with dependent constraints, where reactions are not unique")?;
        if let Some(t) = dependent_at {
            write!(f, ", first at t = {}", Rounded(t))?;
        }
        // Where steps are free to be chosen, those that end further away are made again.
        if largest_move > MUCH {
            write!(
                f,
                "\n               {} ends of steps put back onto the constraints, by ",
                Grouped(settled)
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

    /// How near the motion came to a position where constraints lose rank.
    fn write_nearest(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(Nearest { condition, time, rows, coordinates, passed, .. }) = &self.nearest
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

/// Drift that turns the velocity by more than this part of it is warned of.
const TURNED: f64 = 3e-4;
/// Evaluations by the general solver of which more than this part of all are told to take long.
const MANY: f64 = 0.1;
/// Moves back onto the constraints by more permitted errors than this are told of.
const MUCH: f64 = 10.0;

/// A unit behind a blank; nothing where there is none.
struct Spaced(&'static str);

impl fmt::Display for Spaced {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.is_empty() { Ok(()) } else { write!(f, " {}", self.0) }
    }
}

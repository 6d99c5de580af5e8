//! The summary of a motion: method, costs, energy, the shortest waves.

use core::fmt;
use core::time::Duration;

use dynamics_runtime::wording::{Grouped, Part, Rounded};

use crate::constraints::ConstraintSummary;
use crate::methods::FamilyMethod;
use crate::model::{EnergyParts, FamilyModel, FamilyState};
use crate::motion::FamilyMotion;
use crate::run::AT_BOUND;

/// A field whose Σ u² is below this part of its largest is at rest: its velocities may be rounding.
const AT_REST: f64 = 1e-6;
/// sin²(θ/2) of a wave of six nodes per length, whose speed is wrong by several per cent.
const SHORT_WAVES: f64 = 0.25;
/// Energy drift, in parts of its scale, that is warned of.
const MUCH_DRIFT: f64 = 0.01;

/// How much of a family's motion is in waves of few nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShortWaves {
    /// The family.
    pub field: &'static str,
    /// Largest Σ (uᵢ − uᵢ₊₁)²/(4 Σ uᵢ²) of the recorded instants: 0 for long waves, 1/2 for waves of four
    /// nodes and for velocities without a pattern, 1 where neighbours move against each other.
    pub share: f64,
    /// When that was.
    pub time: f64,
}

/// Why a motion may be less accurate than it looks. Its [`Display`](fmt::Display) is a sentence with a
/// remedy.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum FamilyWarning {
    /// Neighbours move so differently that the grid decides.
    ShortWaves(ShortWaves),
    /// The energy drifts by much.
    EnergyDrift {
        /// In parts of its scale.
        part: f64,
        /// The steps were as long as was asked for.
        fixed: bool,
    },
    /// Stability, not accuracy, bounded the steps of an explicit method.
    StabilityBound {
        /// The mean step.
        mean: f64,
    },
}

impl fmt::Display for FamilyWarning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ShortWaves(ShortWaves { field, share, time }) => write!(
                f,
                "velocities of `{field}` change from node to node ({share:.2} of 1 at t = {}): waves of six \
                 nodes or fewer, whose speed the grid decides; take more nodes, or a smoother start, unless \
                 nodes are the physics, as in a lattice",
                Rounded(*time)
            ),
            Self::EnergyDrift { part, fixed } => {
                let remedy = if *fixed { "shorten the fixed step" } else { "give a smaller tolerance" };
                write!(f, "energy drifts by {} of its scale; {remedy}", Part(*part))
            }
            Self::StabilityBound { mean } => write!(
                f,
                "stability, not accuracy, bounds the steps of this explicit method, {mean:.3e} in the mean; \
                 an implicit method makes longer ones"
            ),
        }
    }
}

/// The summary of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct FamilySummary {
    /// Name of the model.
    pub model: &'static str,
    /// The simulated interval.
    pub interval: (f64, f64),
    /// Coordinates.
    pub unknowns: usize,
    /// The structure of the mass matrix in words.
    pub mass: String,
    /// The constraints, where the model has some.
    pub constraints: Option<ConstraintSummary>,
    /// The method.
    pub method: FamilyMethod,
    /// Why this method.
    pub reason: String,
    /// Accepted steps.
    pub steps: u64,
    /// Rejected steps.
    pub rejected: u64,
    /// Shortest and longest accepted step; none where no step was made.
    pub step_sizes: Option<[f64; 2]>,
    /// Evaluations of the accelerations.
    pub evaluations: u64,
    /// Time the run took.
    pub wall_time: Duration,
    /// Nanoseconds for each unknown and accepted step, frames included.
    pub nanoseconds: f64,
    /// Bytes that the run held: memory of the method, matrices, and recorded states.
    pub bytes: usize,
    /// Recorded instants.
    pub frames: usize,
    /// Energies at the start and at the end.
    pub energies: [EnergyParts; 2],
    /// Largest |E − E₀| in parts of `energy_scale`, at recorded instants or the ends of the steps around
    /// them; none where the model does not conserve its energy.
    pub energy_drift: Option<f64>,
    /// Largest of T, |V| and |E| met.
    pub energy_scale: f64,
    /// The longest step of leapfrog at the start, a bound; none where there is none.
    pub longest_step: Option<f64>,
    /// Of each family with three nodes or more.
    pub short_waves: Vec<ShortWaves>,
    /// Why the motion may be less accurate than it looks.
    pub warnings: Vec<FamilyWarning>,
}

impl<M: FamilyModel> FamilyMotion<'_, M> {
    /// Method, costs, energy, shortest waves and warnings.
    #[must_use]
    pub fn summary(&self) -> FamilySummary {
        let record = &self.record;
        let unknowns = record.start.q().len();
        let kept = record.frames.iter().filter(|frame| frame.state.is_some()).count() + 2;
        let energies = || record.frames.iter().map(|frame| frame.energies);
        let first = energies().next().unwrap_or_default();
        let (drift, scale) = (record.energy.change, record.energy.scale);
        let work = (record.steps.max(1) as f64) * unknowns.max(1) as f64;
        let mut summary = FamilySummary {
            model: M::NAME,
            interval: (self.start_time(), self.end_time()),
            unknowns,
            mass: record.mass.describe(),
            constraints: record.constraints.clone(),
            method: record.method,
            reason: record.reason.clone(),
            steps: record.steps,
            rejected: record.rejected,
            step_sizes: record.step_sizes,
            evaluations: record.evaluations,
            wall_time: record.wall_time,
            nanoseconds: record.wall_time.as_secs_f64() * 1e9 / work,
            bytes: record.bytes + 16 * unknowns * kept,
            frames: record.frames.len(),
            energies: [first, energies().next_back().unwrap_or_default()],
            energy_drift: M::CONSERVATIVE.then_some(if scale > 0.0 { drift / scale } else { 0.0 }),
            energy_scale: scale,
            longest_step: record.longest,
            short_waves: self.short_waves(),
            warnings: Vec::new(),
        };
        summary.warnings = self.warnings(&summary);
        summary
    }

    fn short_waves(&self) -> Vec<ShortWaves> {
        let frames = &self.record.frames;
        let mut begin = 0;
        let mut waves = Vec::new();
        for (field, (declared, &end)) in M::FIELDS.iter().zip(self.record.start.ends().iter()).enumerate() {
            let long = end - begin >= 3;
            begin = end;
            if !long {
                continue;
            }
            let mut worst = ShortWaves { field: declared.name, share: 0.0, time: self.start_time() };
            let largest = frames.iter().fold(0.0f64, |most, frame| most.max(frame.short_waves[field].1));
            for frame in frames {
                let (share, size) = frame.short_waves[field];
                if share > worst.share && size >= AT_REST * largest {
                    (worst.share, worst.time) = (share, frame.t);
                }
            }
            waves.push(worst);
        }
        waves
    }

    fn warnings(&self, summary: &FamilySummary) -> Vec<FamilyWarning> {
        let record = &self.record;
        let mut warnings = Vec::new();
        let short = summary.short_waves.iter().filter(|waves| waves.share > SHORT_WAVES);
        warnings.extend(short.map(|&waves| FamilyWarning::ShortWaves(waves)));
        if let Some(part) = summary
            .energy_drift
            .filter(|&part| part.partial_cmp(&MUCH_DRIFT) != Some(core::cmp::Ordering::Less))
        {
            warnings.push(FamilyWarning::EnergyDrift { part, fixed: record.fixed.is_some() });
        }
        if let (None, Some(longest)) = (record.fixed, record.longest) {
            let mean = (self.end_time() - self.start_time()).abs() / record.steps.max(1) as f64;
            if record.steps > 50 && mean > AT_BOUND * 0.5 * record.method.stability_border() * longest {
                warnings.push(FamilyWarning::StabilityBound { mean });
            }
        }
        warnings
    }
}

impl fmt::Display for FamilySummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (start, end) = self.interval;
        writeln!(f, "{} from t = {} to {}", self.model, Rounded(start), Rounded(end))?;
        writeln!(f, "  unknowns     {}; mass matrix {}", Grouped(self.unknowns as u64), self.mass)?;
        if let Some(ConstraintSummary { rows, system, correction, residual }) = &self.constraints {
            writeln!(f, "  constraints  {} rows, {system}", Grouped(*rows as u64))?;
            writeln!(
                f,
                "               corrections to {correction:.1e}, residual of the solution {residual:.1e}"
            )?;
        }
        writeln!(f, "  method       {}, {}", self.method, self.reason)?;
        writeln!(
            f,
            "  steps        {} accepted, {} rejected, {} evaluations of the accelerations",
            Grouped(self.steps),
            Grouped(self.rejected),
            Grouped(self.evaluations)
        )?;
        if let Some([least, most]) = self.step_sizes {
            write!(f, "  step size    {}", Rounded(most))?;
            if least < most * (1.0 - 1e-9) {
                write!(f, " at most, {} at least", Rounded(least))?;
            }
            match self.longest_step {
                Some(longest) => writeln!(f, "; bound of leapfrog at the start {}", Rounded(longest))?,
                None => writeln!(f, "; no bound of frequencies is known")?,
            }
        }
        write!(f, "  wall time    {:.3?}", self.wall_time)?;
        if self.steps > 0 {
            write!(f, ", {:.2} ns for each unknown and step", self.nanoseconds)?;
        }
        writeln!(f)?;
        writeln!(
            f,
            "  memory       {:.1} MiB, {} frames",
            self.bytes as f64 / f64::from(1 << 20),
            Grouped(self.frames as u64)
        )?;
        let [first, last] = self.energies;
        match self.energy_drift {
            Some(drift) => write!(f, "  drift        energy {drift:.1e} of {:.6e}", self.energy_scale)?,
            None => write!(
                f,
                "  energy       {:.6e} at the start, {:.6e} at the end; forces work",
                first.total(),
                last.total()
            )?,
        }
        for (k, ShortWaves { field, share, time }) in self.short_waves.iter().enumerate() {
            let label = if k == 0 { "short waves" } else { "" };
            write!(f, "\n  {label:<11}  {share:.1e} of {field} at most, at t = {}", Rounded(*time))?;
        }
        for warning in &self.warnings {
            write!(f, "\n  warning      {warning}")?;
        }
        Ok(())
    }
}

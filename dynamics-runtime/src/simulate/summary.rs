//! The summary of a motion: costs, drift of what should stay constant, accuracy.
//!
//! [`Motion::summary`] reads the recorded states. [`Motion::verify`] repeats steps and runs too, and costs
//! several times the run. Warnings are data (`warning.rs`), found by the list in `checks.rs`; `display.rs`
//! prints them.

pub(crate) mod checks;
pub(crate) mod display;
pub(crate) mod warning;

use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;
use core::time::Duration;

use crate::integrate::{Method, Tolerances};
use crate::model::{
    ConservedKind, ConservedQuantity, Constraint, ConstraintKind, ModelState, SimulationModel, SolverKind,
    StaticTraits,
};
use crate::simulate::events::action::Impact;
use crate::simulate::failure::gimbal_lock::GimbalLock;
use crate::simulate::options::formulation::Formulation;
use crate::simulate::pilot_run::{CoordinateSizes, FewDigits};
use crate::simulate::stabilization::StabilizationCounts;
use crate::simulate::trajectory::global_error::GlobalError;
use crate::simulate::trajectory::motion::Motion;
use crate::simulate::trajectory::work::EnergyHistory;
use crate::simulate::verification::accuracy_diagnostics::AccuracyDiagnostics;
use crate::simulate::verification::conditioning::{Conditioning, NearestSingularPosition};
use crate::simulate::verification::constraint_drift::ConstraintDrift;
use crate::simulate::verification::pivot_breakdown::PivotBreakdown;

/// How much a quantity that should stay constant has changed.
#[derive(Clone, Debug, PartialEq)]
pub struct Drift {
    /// What it is.
    pub kind: ConservedKind,
    /// Its name.
    pub name: &'static str,
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
    /// Whether [`Motion::verify`] was asked, so that what takes more runs is known: `nearest`, the works in
    /// `energy_drift`, and of `accuracy` what repeats the motion.
    pub verified: bool,
    /// The simulated interval.
    pub interval: (f64, f64),
    /// The method.
    pub method: Method,
    /// Why this method.
    pub reason: String,
    /// When the run changed its method because the motion was stiff, and to which.
    pub switched: Option<(f64, Method)>,
    /// Accepted steps.
    pub steps: u64,
    /// Rejected steps.
    pub rejected: u64,
    /// Evaluations of the accelerations.
    pub evaluations: u64,
    /// Time the run took; `None` without the standard library.
    pub wall_time: Option<Duration>,
    /// Largest |E − E₀ − work| over the accepted steps, relative to `energy_scale`. NaN where inputs do
    /// work that is not known, as [`Motion::work`] says, and where `has_work` and [`Motion::verify`] was not
    /// asked to integrate the works.
    pub energy_drift: f64,
    /// Largest of |½ q̇·∂L/∂q̇|, |E − ½ q̇·∂L/∂q̇|, |E| met: of T and V for natural
    /// systems.
    pub energy_scale: f64,
    /// Unit of `energy_scale` and `energy_lost`; empty where the model has no units.
    pub energy_unit: &'static str,
    /// The quantity whose drift is `energy_drift`: `energy`, `energy function` where that is conserved and
    /// T + V is not, `energy less work` where forces work.
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
    /// Counts of the constraint stabilization.
    pub stabilization: StabilizationCounts,
    /// There is generated code for accelerations and reactions, so that evaluations by the general solver
    /// with all constraints active are fallbacks.
    pub falls_back: bool,
    /// The coordinates that no longer followed from their constraints at the first fallback, if they are
    /// known.
    pub pivot_breakdown: Option<PivotBreakdown>,
    /// Switched constraints that were released at some time.
    pub released: Vec<&'static str>,
    /// Where the motion came nearest to a singular position of its constraints, and how many it passed;
    /// `None` where [`Motion::verify`] was not asked.
    pub nearest: Option<NearestSingularPosition>,
    /// How often constraints were hit.
    pub impacts: usize,
    /// Energy that the moving bodies lost in them, see
    /// [`EventRecord::energy_lost`](crate::simulate::EventRecord::energy_lost).
    pub energy_lost: f64,
    /// The first impact that a sticking contact took part in: a switched nonholonomic constraint, and when.
    /// It holds whatever the impulse is.
    pub stuck_in_impact: Option<(&'static str, f64)>,
    /// Worst conditioning of the mass matrix over the accepted states.
    pub conditioning: Conditioning,
    /// Where angles came nearest to gimbal lock, if the mass matrix suffers from it.
    pub gimbal_lock: Option<GimbalLock>,
    /// Names of the events and how often each happened.
    pub events: Vec<(String, usize)>,
    /// Events whose functions constraints held at zero while they were engaged: crossings there are rounding,
    /// and were not counted.
    pub masked_events: Vec<String>,
    /// Whether an event ended the motion: its name.
    pub stopped_by: Option<String>,
    /// When the problem was first found stiff for the method.
    pub stiff_at: Option<f64>,
    /// The error by a second run, where
    /// [`Simulation::estimate_error`](crate::simulate::Simulation::estimate_error) asked for it.
    pub error: Option<GlobalError>,
    /// When the motion was first found to slide along a place where accelerations jump: they lead to it from
    /// both sides.
    pub slides_at: Option<f64>,
    /// How many fixed steps were made in parts, to go round positions where constraints nearly lose rank, and
    /// when the first began.
    pub subdivided_steps: (u64, Option<f64>),
    /// The tolerances that its steps kept; `None` with a fixed step.
    pub tolerances: Option<Tolerances>,
    /// Coordinates and velocities that stay within a thousand absolute tolerances, and so have few digits.
    pub few_digits: Vec<FewDigits>,
    /// What makes its accuracy doubtful.
    pub accuracy: AccuracyDiagnostics,
}

impl<M: SimulationModel> Motion<'_, M> {
    /// Method, costs, drift, conditioning, events, and the findings of the run itself. It evaluates energies,
    /// constraints and conserved quantities once at each accepted state, and repeats no step. Checks that do
    /// are part of [`Motion::verify`].
    #[must_use]
    pub fn summary(&self) -> Summary {
        let conserves = M::POWERS.is_empty();
        let energy = self.energy_history(conserves, |_, _| {});
        self.summary_with(energy, None, false)
    }

    /// The summary with all checks that repeat the motion: the works of forces and with them the drift of the
    /// energy, singular positions that were passed, forces between the stages of a step, instability and
    /// stiffness that steps hide, and the global error, estimated by the motion in half steps.
    ///
    /// It costs three to five times as much as the run, or a few tenths of a second. Checks that would take
    /// longer are omitted, and the summary lists them. Fixed steps have no tolerance to compare errors with,
    /// so that such a motion is not repeated in half steps. Singular positions are not searched in models of
    /// more than 32 coordinates. The closure of `.inputs(..)` is called again, at times and states that the
    /// run has not seen.
    ///
    /// ```
    /// # use dynamics_runtime::simulate::{Motion, Simulate};
    /// # fn trusted<M: Simulate>(motion: &Motion<'_, M>) -> bool {
    /// let verified = motion.verify();
    /// println!("{verified}");
    /// verified.warnings().is_empty()
    /// # }
    /// ```
    #[must_use]
    pub fn verify(&self) -> Summary {
        #[cfg(feature = "std")]
        let _watch = crate::slow_build::SlowBuildNote::start();
        let (mut conditions, has_constraints) = (Vec::new(), self.checks_singular_positions());
        let energy = self.energy_history(true, |sampler, index| {
            if has_constraints {
                self.add_conditions(sampler, index, &mut conditions);
            }
        });
        self.summary_with(energy, self.nearest(&conditions), true)
    }

    fn summary_with(
        &self,
        history: EnergyHistory,
        nearest: Option<NearestSingularPosition>,
        verified: bool,
    ) -> Summary {
        let worst = history.errors.iter().fold(0.0f64, |worst, (_, error)| larger(worst, error.abs()));
        let counts = self.counts();
        let mut events: Vec<(String, usize)> = Vec::new();
        for event in self.events() {
            match events.iter_mut().find(|(name, _)| *name == event.name) {
                Some((_, count)) => *count += 1,
                None => events.push((event.name.clone(), 1)),
            }
        }
        let conserved = M::CONSERVED.iter().find(|quantity| quantity.kind.is_energy());
        let conserved_name = conserved.map_or("energy", |quantity| quantity.name);
        Summary {
            model: M::NAME,
            verified,
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
            energy_name: if M::POWERS.is_empty() { conserved_name } else { "energy less work" },
            has_work: !M::POWERS.is_empty(),
            // The energy has its own row, against its own scale: its value may be near zero by chance.
            conserved: self.drifts().into_iter().filter(|drift| !drift.kind.is_energy()).collect(),
            formulation: self.trajectory.formulation.clone(),
            constraints: self.constraint_drift(),
            stabilization: self.trajectory.stabilization,
            falls_back: matches!(M::SOLVER, SolverKind::Unrolled { .. }),
            pivot_breakdown: self.pivot_breakdown(),
            released: self.released(),
            nearest,
            impacts: self
                .events()
                .iter()
                .flat_map(|event| &event.impacts)
                .filter(|impact| !impact.held)
                .count(),
            energy_lost: self.events().iter().fold(0.0, |lost, event| lost + event.energy_lost()),
            stuck_in_impact: self.stuck_in_impact(),
            conditioning: self.conditioning(),
            gimbal_lock: self.gimbal_lock(verified),
            events,
            masked_events: self.trajectory.masked_events.clone(),
            stopped_by: self.events().iter().find(|e| e.stopped).map(|e| e.name.clone()),
            stiff_at: counts.stiff_at,
            error: self.global_error().cloned(),
            slides_at: counts.slides_at,
            subdivided_steps: counts.subdivided_steps,
            tolerances: self.tolerances_of_steps(),
            few_digits: self.few_digits(),
            accuracy: self.accuracy((worst, history.scale), verified),
        }
    }

    /// The tolerances of its steps, if they depended on any.
    fn tolerances_of_steps(&self) -> Option<Tolerances> {
        let is_controlled = !self.trajectory.fixed && self.trajectory.erased_method.is_some();
        is_controlled.then_some(self.trajectory.tolerances)
    }

    fn few_digits(&self) -> Vec<FewDigits> {
        let Some(tolerances) = self.tolerances_of_steps() else { return Vec::new() };
        let mut sizes = CoordinateSizes::of::<M>(&self.trajectory.records[0].state);
        self.trajectory.records.iter().for_each(|record| sizes.include::<M>(&record.state));
        sizes.few_digits::<M>(&tolerances)
    }

    /// The first impact with a sticking contact, and when.
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
            // Impulses far below the largest are rounding.
            let least = 1e-9 * event.impacts.iter().map(largest).fold(0.0, f64::max);
            let stuck =
                event.impacts.iter().find(|i| i.held && largest(i) > least && sticks(i.constraint))?;
            Some((stuck.constraint, event.time()))
        })
    }

    /// Names of the switched constraints that are released in some recorded state.
    fn released(&self) -> Vec<&'static str> {
        if M::IS_UNSWITCHED {
            return Vec::new();
        }
        let was_released = |index: &usize| {
            self.trajectory.records.iter().any(|record| !record.state.active_set().holds(*index))
        };
        M::CONSTRAINTS
            .iter()
            .filter(|c| c.switched.as_ref().is_some_and(was_released))
            .map(|c| c.name)
            .collect()
    }

    /// Drift of every conserved quantity, from its value at the start or after the last reset.
    fn drifts(&self) -> Vec<Drift> {
        let count = M::CONSERVED.len();
        let (mut reference, mut values) = (vec![0.0; count], vec![0.0; count]);
        let new = |quantity: &ConservedQuantity| Drift {
            kind: quantity.kind,
            name: quantity.name,
            largest: 0.0,
            scale: 0.0,
        };
        let mut drifts: Vec<Drift> = M::CONSERVED.iter().map(new).collect();
        let mut restart = true;
        for record in &self.trajectory.records {
            self.model().conserved(&self.complete(record.state), &mut values);
            if restart {
                reference.copy_from_slice(&values);
            }
            // A reset may change what is conserved between resets.
            restart = record.h == 0.0;
            for ((drift, value), reference) in drifts.iter_mut().zip(&values).zip(&reference) {
                drift.largest = larger(drift.largest, (value - reference).abs());
                drift.scale = larger(drift.scale, value.abs());
            }
        }
        drifts
    }
}

/// The larger value; NaN if either is.
fn larger(a: f64, b: f64) -> f64 {
    if b.is_nan() || a.is_nan() { f64::NAN } else { a.max(b) }
}

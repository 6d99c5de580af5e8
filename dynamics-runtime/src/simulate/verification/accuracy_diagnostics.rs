//! Accuracy diagnostics: why the error of a motion may be far larger than its tolerance suggests.
//!
//! A step control bounds the error of each step. It does not see six things, which are searched here at the
//! recorded steps: tolerances below the rounding of the values; energy drift that permitted errors do not
//! explain; forces between the stages of a step (`undersampled_force.rs`); instability that long steps pass
//! over (`missed_instability.rs`); stiffness that short steps hide (`stiffness.rs`); and the accumulation of
//! step errors by the motion (`step_doubling.rs`). The last is an estimate of the global error, as a rule no
//! smaller than the error and at most four times as large.
//! [`Simulation::estimate_error`](crate::simulate::Simulation::estimate_error) is more reliable: its second
//! run chooses its own steps.

use core::fmt;

use crate::integrate::{Method, Tolerances};
use crate::model::{ModelState, SimulationModel, Vector};
use crate::simulate::trajectory::global_error::LARGE_ERROR;
use crate::simulate::trajectory::motion::Motion;
use crate::simulate::verification::missed_instability::MissedInstability;
use crate::simulate::verification::step_doubling::StepDoubling;
use crate::simulate::verification::undersampled_force::UndersampledForce;
use crate::wording::{Rounded, Times};

/// Errors above this many tolerances are reported in a line that is no warning. It is the bound at which
/// `docs/warnings-judged.md` counts an error as beyond its tolerance. A smaller value prints the line for
/// ordinary motions, a larger one is silent about errors that users would want to see.
pub(crate) const NOTABLE_ERROR: f64 = 10.0;
/// Errors by step doubling above this many tolerances are a warning: for motions that are not stiff, and for
/// stiff ones, whose errors mostly decay. Smaller values warn of motions that amplify errors as such motions
/// do, larger ones are silent where digits are lost. `docs/warnings-judged.md` counts false and missing
/// warnings at these bounds; `JUDGED` (CONTRIBUTING, "How to add a check") counts them again.
const LARGE_DOUBLING_ERROR: (f64, f64) = (300.0, 60.0);
/// Permitted errors of fewer units in the last place are below rounding: the stages of a step make about as
/// many. With a smaller value steps that rounding decides are not reported, with a larger one tolerances are
/// that steps still keep.
const MIN_ROUNDING_UNITS: f64 = 10.0;
/// Label of the line about the accuracy that is no warning.
const ACCURACY_LABEL: &str = "\n  accuracy     ";
/// Number of states at which the change of energy by permitted errors is computed, by one evaluation for each
/// coordinate and velocity. With fewer the largest change may be missed, and the drift is overrated; more
/// cost evaluations.
const SAMPLES: usize = 16;
/// Part of the energy's scale that counts as rounding of its drift, in units in the last place: sums of many
/// terms over many steps. A smaller value takes rounding of the energy for a drift at tolerances near 1e-14,
/// a larger one hides drift.
const ENERGY_ROUNDING_UNITS: f64 = 1e3;
/// Least displacement for the derivatives of the energy, in parts of 1 + |value|. With a smaller one,
/// rounding of the energy exceeds the difference; with a larger one, its curvature does.
const ENERGY_DISPLACEMENT: f64 = 1e-6;

/// A value whose permitted error is below its rounding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BelowRounding {
    /// The coordinate, or that whose velocity it is.
    pub name: &'static str,
    /// Whether it is a velocity.
    pub rate: bool,
    /// Its value.
    pub value: f64,
    /// When.
    pub time: f64,
    /// The error that was permitted in a step there.
    pub permitted: f64,
}

/// Results of all accuracy diagnostics of a motion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AccuracyDiagnostics {
    /// The value whose permitted error is furthest below its rounding; `None` with a fixed step or where
    /// there is none.
    pub below_rounding: Option<BelowRounding>,
    /// Drift of the energy, less all work, over what the permitted errors of one step can change it by;
    /// `None` with a fixed step.
    pub energy: Option<f64>,
    /// Drift of the energy, less all work, in parts of its scale; `None` where it has none.
    pub energy_part: Option<f64>,
    /// The steps were as long as was asked for.
    pub fixed: bool,
    /// How far the motion is from one in half steps, in permitted errors, where that lasts or at the end: as
    /// a rule most of its error. `None` with a fixed step.
    pub step_doubling: Option<f64>,
    /// The same at its largest, which may last for a moment only, as where something jumps a little late;
    /// warned of by itself from a thousand on. `None` with a fixed step.
    pub step_doubling_at_most: Option<f64>,
    /// The motion is stiff, or its method is for stiff ones.
    pub stiff: bool,
    /// The method has stages of too low an order to follow a stiff direction that turns.
    pub low_stages: bool,
    /// Forces, dissipation or explicit time change the energy, and their work enters its drift; not said of
    /// models with constraints.
    pub works: bool,
    /// The model has constraints, which a motion may go on along the wrong branch of.
    pub held: bool,
    /// A force that is over between the stages of a step; `None` with a fixed step.
    pub undersampled_force: Option<UndersampledForce>,
    /// When the motion was first found stiff for a method whose steps do not show it, by implicit steps more
    /// than twenty times as long; `None` where they do, and of fewer than 120 steps.
    pub hidden_stiffness: Option<f64>,
    /// An instability that long steps pass over.
    pub missed_instability: Option<MissedInstability>,
    /// The checks that were omitted.
    pub unchecked: Unchecked,
}

/// Checks that a summary omitted, because they would take far longer than the run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Unchecked {
    /// Whether implicit steps pass over what keeps steps of an explicit method short.
    pub stiffness: bool,
    /// Instability that long steps pass over.
    pub instability: bool,
    /// The motion in half steps, from this time on.
    pub half_steps: Option<f64>,
}

impl fmt::Display for Unchecked {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const LONGER: &str = "it takes longer than the run";
        let mut label = "not checked";
        if self.stiffness {
            write!(f, "\n  {label:<11}  whether it is stiff: {LONGER}")?;
            label = "";
        }
        if self.instability {
            write!(f, "\n  {label:<11}  whether steps pass over an instability: {LONGER}")?;
            label = "";
        }
        if let Some(t) = self.half_steps {
            write!(f, "\n  {label:<11}  what errors add up to from t = {} on: {LONGER}", Rounded(t))?;
        }
        Ok(())
    }
}

impl<M: SimulationModel> Motion<'_, M> {
    /// All diagnostics. `drift`: the largest drift of the energy, of size `scale`. `verified`: include the
    /// checks that repeat steps.
    pub(crate) fn accuracy(&self, (drift, scale): (f64, f64), verified: bool) -> AccuracyDiagnostics {
        // Energy drift relative to its scale; infinite where the energy has overflowed.
        let energy_part = (scale > 0.0 || scale.is_nan()).then_some(if scale.is_finite() {
            drift / scale
        } else {
            f64::INFINITY
        });
        // Unknown works give NaN, and no result.
        let energy_part = energy_part.filter(|part| !part.is_nan());
        let (fixed, repeatable) = (self.trajectory.fixed, verified && self.is_repeatable());
        let missed_instability = repeatable.then(|| self.missed_instability()).flatten();
        if fixed || self.trajectory.erased_method.is_none() {
            let missed_instability = missed_instability.filter(|_| fixed);
            let unchecked = Unchecked {
                instability: fixed && repeatable && !self.affords_instability_check(),
                ..Unchecked::default()
            };
            return AccuracyDiagnostics {
                energy_part: energy_part.filter(|_| fixed),
                fixed,
                missed_instability,
                unchecked,
                ..AccuracyDiagnostics::default()
            };
        }
        // With adaptive steps: drift in permitted errors, stiffness, step doubling.
        let permitted = self.permitted_energy_error();
        let stiff = self.is_stiff();
        let doubling = repeatable.then(|| self.step_doubling());
        let (checks_stiffness, affords_stiffness_check) =
            (repeatable && !stiff, self.affords_implicit_steps());
        let unchecked = Unchecked {
            stiffness: checks_stiffness && !affords_stiffness_check && self.has_many_steps(),
            instability: repeatable && !self.affords_instability_check(),
            half_steps: doubling.and_then(|doubling| doubling.given_up),
        };
        AccuracyDiagnostics {
            below_rounding: self.below_rounding(),
            // Rounding of the energy is subtracted from the drift.
            energy: (permitted > 0.0 && !drift.is_nan())
                .then(|| (drift - ENERGY_ROUNDING_UNITS * f64::EPSILON * scale).max(0.0) / permitted),
            energy_part,
            fixed,
            step_doubling: doubling.map(|StepDoubling { lasting, .. }| lasting),
            step_doubling_at_most: doubling.map(|StepDoubling { largest, .. }| largest),
            stiff,
            low_stages: self.method() == Method::Esdirk4,
            works: !M::POWERS.is_empty() && M::CONSTRAINTS.is_empty(),
            held: !M::CONSTRAINTS.is_empty(),
            hidden_stiffness: (checks_stiffness && affords_stiffness_check)
                .then(|| self.hidden_stiffness())
                .flatten(),
            missed_instability,
            unchecked,
            undersampled_force: repeatable.then(|| self.undersampled_force(stiff)).flatten(),
        }
    }

    /// The value whose permitted error is furthest below its rounding.
    fn below_rounding(&self) -> Option<BelowRounding> {
        let Tolerances { absolute, relative } = self.trajectory.tolerances;
        let mut worst: Option<(f64, BelowRounding)> = None;
        for record in &self.trajectory.records {
            for (rate, values) in [(false, record.state.q()), (true, record.state.u())] {
                for (i, value) in values.as_slice().iter().enumerate() {
                    let permitted = absolute + relative * value.abs();
                    let units = permitted / (f64::EPSILON * value.abs());
                    if units < worst.as_ref().map_or(MIN_ROUNDING_UNITS, |(least, _)| *least) {
                        let name = M::COORDINATES[i].name;
                        let time = record.state.t();
                        worst = Some((units, BelowRounding { name, rate, value: *value, time, permitted }));
                    }
                }
            }
        }
        worst.map(|(_, found)| found)
    }

    /// Largest change of the energy by the permitted errors of one step, over some states of the motion.
    fn permitted_energy_error(&self) -> f64 {
        let records = &self.trajectory.records;
        let tolerances = &self.trajectory.tolerances;
        let mut most = 0.0f64;
        for record in records.iter().step_by(records.len().div_ceil(SAMPLES)) {
            let mut state = self.complete(record.state);
            let here = self.model().energy_function(&state);
            let mut sum = 0.0;
            for i in 0..2 * M::Vector::LEN {
                // In place: copying a large state takes as long as its energy.
                let value = *element(&mut state, i);
                let permitted = tolerances.scale(value, value);
                let step = permitted.max(ENERGY_DISPLACEMENT * (1.0 + value.abs()));
                *element(&mut state, i) = value + step;
                sum += (self.model().energy_function(&state) - here).abs() * permitted / step;
                *element(&mut state, i) = value;
            }
            most = most.max(sum);
        }
        most
    }

    /// Whether the motion is stiff, so that differences decay within steps.
    fn is_stiff(&self) -> bool {
        self.counts().stiff_at.is_some() || self.switched().is_some() || self.method().is_for_stiff()
    }
}

/// A coordinate, or behind them a velocity.
fn element<S: ModelState>(state: &mut S, i: usize) -> &mut f64 {
    match i.checked_sub(S::Vector::LEN) {
        None => &mut state.q_mut()[i],
        Some(i) => &mut state.u_mut()[i],
    }
}

impl AccuracyDiagnostics {
    /// Lasting errors by step doubling above this many tolerances are a warning.
    pub(crate) fn large_error(&self) -> f64 {
        if self.stiff { LARGE_DOUBLING_ERROR.1 } else { LARGE_DOUBLING_ERROR.0 }
    }

    /// The line about errors by step doubling that are no warning.
    pub(crate) fn write_global_error(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Some(times), Some(most)) = (self.step_doubling, self.step_doubling_at_most) else {
            return Ok(());
        };
        let note = "(estimated by step doubling)";
        if times > self.large_error() || most > LARGE_ERROR {
            Ok(())
        } else if times > NOTABLE_ERROR {
            write!(f, "{ACCURACY_LABEL}global error about {} tolerances {note}", Times(times))
        } else if most > NOTABLE_ERROR {
            let (most, times) = (Times(most), Times(times));
            write!(
                f,
                "{ACCURACY_LABEL}global error about {most} tolerances for a moment, otherwise {times} {note}"
            )
        } else {
            Ok(())
        }
    }
}

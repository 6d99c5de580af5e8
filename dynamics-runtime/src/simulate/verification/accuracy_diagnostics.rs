//! Why a motion may be further from the true one than its tolerance lets hope, as far as the motion itself
//! shows it.
//!
//! A step control keeps what steps leave. Five things it does not see are looked for here, at the recorded
//! steps: tolerances that are finer than the rounding of the values they are kept for; energy that drifts by
//! more than so many permitted errors can; forces that its stages miss (`undersampled_force.rs`);
//! instability that long steps pass over (`missed_instability.rs`); and what errors of steps add up to, with
//! what the motion makes of them (`step_doubling.rs`). The last is an estimate of the error, as a rule no
//! smaller and at most four times as large:
//! [`Simulation::estimate_error`](crate::simulate::Simulation::estimate_error), by a second run that chooses
//! its own steps, depends on less.

use core::fmt;

use crate::integrate::{Method, Tolerances};
use crate::model::{ModelState, SimulationModel, Vector};
use crate::simulate::trajectory::motion::Motion;
use crate::simulate::verification::missed_instability::MissedInstability;
use crate::simulate::verification::step_doubling::StepDoubling;
use crate::simulate::verification::undersampled_force::UndersampledForce;
use crate::wording::{Rounded, Times};

/// More permitted errors than this are warned of.
pub(crate) const LARGE_ERROR: f64 = 1e3;
/// More permitted errors than this are told of, in a line that is no warning: what the tolerance was to be is
/// left.
pub(crate) const NOTABLE_ERROR: f64 = 10.0;
/// What half steps show lasts, and is known within a factor: so many permitted errors, and fewer of stiff
/// motions, where errors mostly die.
const LARGE_DOUBLING_ERROR: (f64, f64) = (300.0, 60.0);
/// Permitted errors of fewer units in the last place are below rounding: the stages of a step make as many.
const MIN_ROUNDING_UNITS: f64 = 10.0;
/// What a line about the accuracy begins with that is no warning.
const ACCURACY_LABEL: &str = "\n  accuracy     ";
/// Places at which the energy's change by permitted errors is looked at.
const SAMPLES: usize = 16;

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

/// What makes the accuracy of a motion doubtful.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AccuracyDiagnostics {
    /// The value that is furthest below rounding with its permitted error; `None` with a fixed step or where
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
    /// What was not looked for.
    pub unchecked: Unchecked,
}

/// What a summary did not look for, because it would take far longer than the run did.
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
    /// `drift` of the energy at most, of `scale`. `verified`: what repeats the motion is looked for, too.
    pub(crate) fn accuracy(&self, (drift, scale): (f64, f64), verified: bool) -> AccuracyDiagnostics {
        // What has grown beyond all numbers has no scale.
        let energy_part = (scale > 0.0 || scale.is_nan()).then_some(if scale.is_finite() {
            drift / scale
        } else {
            f64::INFINITY
        });
        // Works that are not known leave nothing to be said.
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
            // What rounds the energy is no drift.
            energy: (permitted > 0.0 && !drift.is_nan())
                .then(|| (drift - 1e3 * f64::EPSILON * scale).max(0.0) / permitted),
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

    /// By how much permitted errors of one step change the energy, at most, at some places of the motion.
    fn permitted_energy_error(&self) -> f64 {
        let records = &self.trajectory.records;
        let tolerances = &self.trajectory.tolerances;
        let mut most = 0.0f64;
        for record in records.iter().step_by(records.len().div_ceil(SAMPLES)) {
            let state = self.complete(record.state);
            let here = self.model().energy_function(&state);
            let mut sum = 0.0;
            for i in 0..2 * M::Vector::LEN {
                let mut moved = state;
                let part = match i.checked_sub(M::Vector::LEN) {
                    None => &mut moved.q_mut()[i],
                    Some(i) => &mut moved.u_mut()[i],
                };
                let permitted = tolerances.scale(*part, *part);
                let step = permitted.max(1e-6 * (1.0 + part.abs()));
                *part += step;
                sum += (self.model().energy_function(&moved) - here).abs() * permitted / step;
            }
            most = most.max(sum);
        }
        most
    }

    /// Whether differences die within steps.
    fn is_stiff(&self) -> bool {
        self.counts().stiff_at.is_some() || self.switched().is_some() || self.method().is_for_stiff()
    }
}

impl AccuracyDiagnostics {
    /// More permitted errors than this are warned of, of those that half steps show to last.
    pub(crate) fn large_error(&self) -> f64 {
        if self.stiff { LARGE_DOUBLING_ERROR.1 } else { LARGE_DOUBLING_ERROR.0 }
    }

    /// What half steps show where that is no warning but worth a line: that little is left of the tolerance.
    pub(crate) fn write_global_error(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Some(times), Some(most)) = (self.step_doubling, self.step_doubling_at_most) else {
            return Ok(());
        };
        let estimate_note = "(estimated by step doubling)";
        if times > self.large_error() || most > LARGE_ERROR {
            Ok(())
        } else if times > NOTABLE_ERROR {
            write!(f, "{ACCURACY_LABEL}global error about {} tolerances {estimate_note}", Times(times))
        } else if most > NOTABLE_ERROR {
            let (most, times) = (Times(most), Times(times));
            write!(
                f,
                "{ACCURACY_LABEL}global error about {most} tolerances for a moment, otherwise {times} {estimate_note}"
            )
        } else {
            Ok(())
        }
    }
}

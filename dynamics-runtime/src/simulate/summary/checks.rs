//! The checks of a summary: one function for each warning that a motion has at most once, in the order in
//! which they are printed. Warnings that may occur several times, of the global error and of masked events,
//! come first ([`Summary::warnings`]).

use alloc::vec::Vec;

use crate::simulate::summary::Summary;
use crate::simulate::summary::warning::Warning;
use crate::simulate::trajectory::global_error::LARGE_ERROR;
use crate::simulate::verification::accuracy_diagnostics::NOTABLE_ERROR;

/// All checks. A new warning needs a variant of [`Warning`] with its text in `warning.rs`, and a check in
/// this list.
const CHECKS: [fn(&Summary) -> Option<Warning>; 14] = [
    stuck_in_impact,
    stiffness,
    sliding_mode,
    drift_influence,
    gimbal_lock,
    singular_position,
    below_rounding,
    undersampled_force,
    hidden_stiffness,
    missed_instability,
    energy_beyond_tolerance,
    energy_drift,
    step_doubling,
    error_peak,
];

/// Drift of constraints is a warning where it turns the velocity by more than this part of it. It lies above
/// the largest influence, 2.7e-4, of the steps that drift inspection leaves out
/// (`stabilization/drift_inspection.rs`), so that no warning depends on which steps were inspected. A smaller
/// value would; a larger one is silent about branches that drift has turned.
const DRIFT_TURN_SHARE: f64 = 3e-4;
/// Energy drift below this many permitted errors is what the tolerance allows. A smaller value warns of loose
/// tolerances that are kept, a larger one is silent where the drift is large against the energy.
const PERMITTED_ENERGY_ERRORS: f64 = 10.0;
/// Energy drift above this part of its scale is a warning: the motion is visibly another one. A smaller value
/// warns of motions at loose tolerances whose energy need not be accurate, a larger one comes after digits
/// are lost. `docs/warnings-judged.md` names the one motion of which it warned falsely.
const ENERGY_DRIFT_SHARE: f64 = 0.01;

impl Summary {
    /// Everything that makes the motion doubtful, so that programs can stop where there is any: errors beyond
    /// the tolerance, stiffness, effects that steps pass over, drift. Findings that take further runs are
    /// included where the summary is that of [`Motion::verify`](crate::simulate::Motion::verify).
    #[must_use]
    pub fn warnings(&self) -> Vec<Warning> {
        let of_error = self.error.iter().flat_map(|error| error.findings()).map(Warning::GlobalError);
        let masked = self.masked_events.iter().map(|event| Warning::MaskedEvent { event: event.clone() });
        let checked = CHECKS.iter().filter_map(|check| check(self));
        of_error.chain(masked).chain(checked).collect()
    }
}

fn stuck_in_impact(summary: &Summary) -> Option<Warning> {
    let (constraint, time) = summary.stuck_in_impact?;
    Some(Warning::StuckInImpact { constraint, time })
}

fn stiffness(summary: &Summary) -> Option<Warning> {
    let from = summary.stiff_at.filter(|_| summary.switched.is_none())?;
    Some(Warning::Stiff { from })
}

fn sliding_mode(summary: &Summary) -> Option<Warning> {
    Some(Warning::SlidingMode { from: summary.slides_at? })
}

fn drift_influence(summary: &Summary) -> Option<Warning> {
    summary.stabilization.turned.filter(|turned| turned.part > DRIFT_TURN_SHARE).map(Warning::DriftInfluence)
}

fn gimbal_lock(summary: &Summary) -> Option<Warning> {
    summary.gimbal_lock.filter(|locking| locking.doubtful).map(Warning::GimbalLock)
}

fn singular_position(summary: &Summary) -> Option<Warning> {
    let (by, time) = summary.nearest.as_ref()?.missed?;
    Some(Warning::SingularPositionMissed { by, time, fixed: summary.accuracy.fixed })
}

fn below_rounding(summary: &Summary) -> Option<Warning> {
    summary.accuracy.below_rounding.map(Warning::BelowRounding)
}

fn undersampled_force(summary: &Summary) -> Option<Warning> {
    summary.accuracy.undersampled_force.map(Warning::UndersampledForce)
}

fn hidden_stiffness(summary: &Summary) -> Option<Warning> {
    Some(Warning::HiddenStiffness { time: summary.accuracy.hidden_stiffness? })
}

fn missed_instability(summary: &Summary) -> Option<Warning> {
    let growth = summary.accuracy.missed_instability?;
    Some(Warning::MissedInstability { growth, fixed: summary.accuracy.fixed })
}

/// Whether the drift of the energy is used. It is not where forces work and half steps agree: works are
/// integrated over states within the steps, and a step far longer than a stiff damper needs does not resolve
/// them. With constraints it always is, because whole and half steps may agree on the wrong branch.
fn energy_counts(summary: &Summary) -> bool {
    let accuracy = &summary.accuracy;
    !(accuracy.works && accuracy.step_doubling.is_some_and(|times| times <= NOTABLE_ERROR))
}

fn energy_beyond_tolerance(summary: &Summary) -> Option<Warning> {
    let times = summary.accuracy.energy.filter(|times| *times > LARGE_ERROR && energy_counts(summary))?;
    Some(Warning::EnergyBeyondTolerance { times })
}

fn energy_drift(summary: &Summary) -> Option<Warning> {
    let accuracy = &summary.accuracy;
    let finite = accuracy.energy_part.is_some_and(f64::is_finite);
    let few = accuracy.energy.is_some_and(|times| times <= PERMITTED_ENERGY_ERRORS);
    let permitted = finite && !accuracy.held && few;
    let part = accuracy.energy_part.filter(|part| *part > ENERGY_DRIFT_SHARE && !permitted)?;
    energy_counts(summary).then_some(Warning::EnergyDrift { part, fixed: accuracy.fixed })
}

/// Not where a second run has measured the error.
fn step_doubling(summary: &Summary) -> Option<Warning> {
    let accuracy = &summary.accuracy;
    let tolerances = accuracy.step_doubling.filter(|times| *times > accuracy.large_error())?;
    let low_stages = accuracy.low_stages;
    summary.error.is_none().then_some(Warning::StepDoubling { tolerances, low_stages })
}

fn error_peak(summary: &Summary) -> Option<Warning> {
    let accuracy = &summary.accuracy;
    let tolerances = accuracy.step_doubling_at_most.filter(|most| *most > LARGE_ERROR)?;
    let lasts = accuracy.step_doubling.is_none_or(|times| times > accuracy.large_error());
    let low_stages = accuracy.low_stages;
    (summary.error.is_none() && !lasts).then_some(Warning::ErrorPeak { tolerances, low_stages })
}

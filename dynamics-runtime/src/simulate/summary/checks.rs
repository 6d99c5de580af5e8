//! What a summary is looked through for: one check for each warning, in the order in which they are told.

use alloc::vec::Vec;

use crate::simulate::summary::Summary;
use crate::simulate::summary::warning::Warning;
use crate::simulate::verification::accuracy_diagnostics::{LARGE_ERROR, NOTABLE_ERROR};

/// Whoever adds a warning gives [`Warning`] a variant for it, and puts what finds it into this list.
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

/// Drift of constraints that turns the velocity by more than this part of it is warned of.
const DRIFT_TURN_SHARE: f64 = 3e-4;
/// Energy that drifts by less than so many permitted errors is no more than the tolerance lets it.
const PERMITTED_ENERGY_ERRORS: f64 = 10.0;
/// Part of the energy that may drift before that is warned of.
const ENERGY_DRIFT_SHARE: f64 = 0.01;

impl Summary {
    /// What makes the motion doubtful, for programs that go on only where there is nothing: errors beyond the
    /// tolerance, stiffness, what is passed over, drift. What takes runs to find is in it where the summary
    /// is of [`Motion::verify`](crate::simulate::Motion::verify).
    #[must_use]
    pub fn warnings(&self) -> Vec<Warning> {
        let of_error = self.error.iter().flat_map(|error| error.findings()).map(Warning::GlobalError);
        let masked = self.kept.iter().map(|event| Warning::MaskedEvent { event: event.clone() });
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

/// Whether the energy is asked. Where forces work and half steps agree, but for moments, it is not: works are
/// integrated over states between the ends of steps, which a step far longer than a stiff damper needs does
/// not resolve, and what they miss in a moment stays. With constraints it is asked always: whole and half
/// steps may agree on the wrong branch.
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

/// Where the error was measured nothing is guessed of it.
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

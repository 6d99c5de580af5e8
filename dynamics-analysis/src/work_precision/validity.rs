//! Whether a study is valid: it is not if all runs failed, no error is significant, or runs contradict the
//! given end.

use alloc::vec::Vec;

use dynamics_runtime::integrate::Method;
use dynamics_runtime::simulate::Simulate;

use super::error::WorkPrecisionError;
use super::errors::Errors;
use super::reference::chosen;
use super::study::{RunMeasurement, Study};
use super::{Candidate, WorkPrecision};

/// If the ends of two methods agree to this share of their distance from the given end, they have found
/// another end. Errors of unrelated methods are so nearly equal by chance in one of some hundred thousand
/// pairs.
const AGREEMENT_RATIO: f64 = 1e-5;
/// Two runs that are nearer to each other than this share of their distance from the given end have found
/// another end, or have similar errors. A reference run near rounding decides.
const SUSPICIOUS_RATIO: f64 = 0.3;
/// Distances below this many uncertainties contradict nothing, because uncertainties are estimates.
const MIN_UNCERTAINTIES_APART: f64 = 10.0;

impl<M: Simulate> Study<'_, M> {
    /// Refuses a study that is not valid.
    pub(super) fn check(&self, study: &WorkPrecision<'_, M>) -> Result<(), WorkPrecisionError> {
        if self.runs().next().is_none() {
            let first = self.curves.iter().find_map(|curve| Some((curve, curve.points.first()?)));
            let (method, reason) = first.map_or_else(Default::default, |(curve, point)| {
                (curve.name.clone(), point.outcome.as_ref().err().cloned().unwrap_or_default())
            });
            return Err(WorkPrecisionError::NoRunSucceeded { method, reason });
        }
        let Errors { positions, velocities, .. } = self.reference.uncertainty;
        if !self.runs().any(|run| run.errors.positions > positions || run.errors.velocities > velocities) {
            return Err(WorkPrecisionError::NothingToBelieve { uncertainty: positions });
        }
        // A reference that was found has shorter steps than any run, and is not in doubt.
        if !self.reference.given {
            return Ok(());
        }
        self.contradicted(&study.candidates)?;
        if self.is_suspicious() { self.found_elsewhere(study) } else { Ok(()) }
    }

    /// Whether two runs are much nearer to each other than to the end that was given.
    fn is_suspicious(&self) -> bool {
        let runs: Vec<&RunMeasurement> = self.runs().collect();
        (1..runs.len())
            .any(|k| runs[..k].iter().any(|other| self.agree(runs[k], other, SUSPICIOUS_RATIO).is_some()))
    }

    /// Whether runs near rounding contradict the known end by more than their uncertainty. If they fail or
    /// disagree with each other, there is no contradiction.
    fn found_elsewhere(&self, study: &WorkPrecision<'_, M>) -> Result<(), WorkPrecisionError> {
        let Ok(found) = chosen(study, self.interval.1) else { return Ok(()) };
        let distance = found.end.errors(&self.reference.end);
        let may = found.uncertainty.zip(self.reference.uncertainty, f64::max);
        for (what, distance, may, uncertainty) in [
            ("positions", distance.positions, may.positions, found.uncertainty.positions),
            ("velocities", distance.velocities, may.velocities, found.uncertainty.velocities),
        ] {
            if distance > MIN_UNCERTAINTIES_APART * may {
                return Err(WorkPrecisionError::OtherEnd { how: found.how, what, distance, uncertainty });
            }
        }
        Ok(())
    }

    /// Whether two methods agree on another end than the one that was given.
    fn contradicted(&self, candidates: &[Candidate<'_, M>]) -> Result<(), WorkPrecisionError> {
        let finest = self.curves.iter().zip(candidates).filter_map(|(curve, candidate)| {
            let run = curve.points.iter().rev().find_map(|point| point.outcome.as_ref().ok())?;
            // The default method is no second method beside the one that it is.
            Some((candidate.method.as_ref()?.method(), curve.name.as_str(), run))
        });
        let finest: Vec<(Method, &str, &RunMeasurement)> = finest.collect();
        for (k, (method, name, run)) in finest.iter().enumerate() {
            for (_, other, second) in finest[..k].iter().filter(|(other, ..)| other != method) {
                if let Some((what, distance, apart)) = self.agree(run, second, AGREEMENT_RATIO) {
                    let methods = [(*other).into(), (*name).into()];
                    return Err(WorkPrecisionError::Contradicted { methods, what, distance, apart });
                }
            }
        }
        Ok(())
    }

    /// The part (positions or velocities) in which two runs are nearer to each other than `ratio` times their
    /// distance from the reference, with this distance and the one between them.
    fn agree(&self, a: &RunMeasurement, b: &RunMeasurement, ratio: f64) -> Option<(&'static str, f64, f64)> {
        let apart = a.end.as_ref()?.errors(b.end.as_ref()?);
        let uncertainty = self.reference.uncertainty;
        let parts = [
            ("positions", apart.positions, a.errors.positions.min(b.errors.positions), uncertainty.positions),
            (
                "velocities",
                apart.velocities,
                a.errors.velocities.min(b.errors.velocities),
                uncertainty.velocities,
            ),
        ];
        let agreed = parts.into_iter().find(|(_, apart, distance, uncertainty)| {
            *distance > MIN_UNCERTAINTIES_APART * uncertainty && *apart < ratio * distance
        });
        agreed.map(|(what, apart, distance, _)| (what, distance, apart))
    }
}

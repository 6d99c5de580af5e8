//! The runs of a study: their errors, and the medians of their times.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::time::Duration;

use dynamics_runtime::integrate::Method;
use dynamics_runtime::model::{ModelState, Vector};
use dynamics_runtime::simulate::{Simulate, Simulation};

use super::errors::{End, largest};
use super::reference::ReferenceSolution;
use super::study::{Point, RunMeasurement, WorkPrecisionCurve};
use super::{Candidate, WorkPrecision};
use crate::runs::{self, check_end, first_line};

/// All methods at all their tolerances or steps.
pub(super) fn curves<M: Simulate>(
    study: &WorkPrecision<'_, M>,
    end: f64,
    reference: &ReferenceSolution,
) -> Vec<WorkPrecisionCurve> {
    let mut curves: Vec<WorkPrecisionCurve> = study
        .candidates
        .iter()
        .map(|candidate| {
            let point = |setting: f64| Point {
                setting,
                outcome: first_run(study, candidate, setting, end, reference),
            };
            WorkPrecisionCurve {
                name: candidate.name.clone(),
                outside: false,
                is_default: candidate.method.is_none(),
                adaptive: candidate.is_adaptive(),
                points: study.settings(candidate).into_iter().map(point).collect(),
            }
        })
        .collect();
    time(study, end, &mut curves, reference);
    curves
}

fn simulation<'m, M: Simulate>(
    study: &WorkPrecision<'m, M>,
    candidate: &Candidate<'m, M>,
    setting: f64,
    end: f64,
) -> Simulation<'m, M> {
    let simulation = study.simulation(end, candidate.method.as_ref(), None);
    let adaptive = candidate.is_adaptive();
    let simulation = if adaptive { simulation.tolerance(setting) } else { simulation.fixed_step(setting) };
    match &candidate.options {
        Some(options) => options(simulation),
        None => simulation,
    }
}

/// The run that gives errors and counts.
fn first_run<'m, M: Simulate>(
    study: &WorkPrecision<'m, M>,
    candidate: &Candidate<'m, M>,
    setting: f64,
    end: f64,
    reference: &ReferenceSolution,
) -> Result<RunMeasurement, String> {
    let motion = simulation(study, candidate, setting, end).run().map_err(|error| first_line(&error))?;
    check_end(&motion.end(), end)?;
    let reached = End::of(study.model, &motion.end());
    let counts = motion.counts();
    Ok(RunMeasurement {
        errors: reached.errors(&reference.end),
        time: counts.wall_time.unwrap_or_default(),
        repeats: Some(0),
        // A Taylor series costs as much as many evaluations, so that their number says nothing.
        evaluations: (motion.method() != Method::Taylor).then_some(counts.evaluations),
        steps: Some(counts.steps),
        rejected: Some(counts.rejected),
        stiff_at: counts.stiff_at,
        end: Some(reached),
    })
}

/// Sets the time of every run that succeeded to the median of its repeats. A run whose repeats end elsewhere,
/// by more than the uncertainty of the reference, is not reproducible and has failed.
fn time<M: Simulate>(
    study: &WorkPrecision<'_, M>,
    end: f64,
    curves: &mut [WorkPrecisionCurve],
    reference: &ReferenceSolution,
) {
    let runs: Vec<(&Candidate<'_, M>, f64)> = curves
        .iter()
        .zip(&study.candidates)
        .flat_map(|(curve, candidate)| curve.points.iter().map(move |point| (candidate, point.setting)))
        .collect();
    // The first run kept its motion and met cold memory, so that its time only determines the number of
    // repeats.
    let about: Vec<Option<Duration>> = curves
        .iter()
        .flat_map(|curve| &curve.points)
        .map(|point| point.outcome.as_ref().ok().map(|run| run.time))
        .collect();
    let first: Vec<Option<End>> = curves
        .iter()
        .flat_map(|curve| &curve.points)
        .map(|point| point.outcome.as_ref().ok().and_then(|run| run.end.clone()))
        .collect();
    let mut differing: Vec<Option<String>> = alloc::vec![None; runs.len()];
    let medians = runs::medians(&about, study.effort, |i| {
        let (candidate, setting) = runs[i];
        let again = runs::timed_run(simulation(study, candidate, setting, end));
        if differing[i].is_none() {
            let again = again.as_ref().map(|(_, state)| state);
            differing[i] = first[i].as_ref().and_then(|first| not_reproduced(first, again, reference));
        }
        again.map(|(time, _)| time)
    });
    for ((point, median), differing) in
        curves.iter_mut().flat_map(|curve| &mut curve.points).zip(medians).zip(differing)
    {
        if let (Ok(measured), Some(median)) = (&mut point.outcome, median) {
            (measured.time, measured.repeats) = (median.time, Some(median.repeats));
        }
        if let Some(reason) = differing {
            point.outcome = Err(reason);
        }
    }
}

/// The reason if a repeat ends elsewhere than the run.
fn not_reproduced<S: ModelState>(
    first: &End,
    again: Option<&S>,
    reference: &ReferenceSolution,
) -> Option<String> {
    const REMEDY: &str = "let what the run calls depend on time and state alone";
    let Some(again) = again else { return Some(format!("it fails when it is repeated; {REMEDY}")) };
    let by = [largest(&first.q, again.q().as_slice()), largest(&first.u, again.u().as_slice())];
    let most = [reference.uncertainty.positions, reference.uncertainty.velocities];
    let significant = by.iter().zip(most).find(|(by, most)| by.is_nan() || **by > *most)?;
    Some(format!("it ends elsewhere when it is repeated, by {:.1e}; {REMEDY}", significant.0))
}

//! The runs, and how long they take.

use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::time::Duration;
use std::time::Instant;

use super::reference::{End, Found, reaches};
use super::study::{Curve, Measured, Point};
use super::{Candidate, WorkPrecision};
use crate::motion::{Simulate, Simulation};

/// Rounds over all runs: what disturbs the machine for a while disturbs a part of the repeats of many runs, not all of one.
const ROUNDS: u32 = 3;
/// Most repeats in one round.
const MOST: u32 = 101;

/// All methods at all their tolerances or steps.
pub(super) fn curves<M: Simulate>(study: &WorkPrecision<'_, M>, end: f64, reference: &Found) -> Vec<Curve> {
    let mut curves: Vec<Curve> = study
        .candidates
        .iter()
        .map(|candidate| {
            let point = |setting: f64| Point { setting, outcome: first_run(study, candidate, setting, end, reference) };
            Curve {
                name: candidate.name.clone(),
                outside: false,
                adaptive: candidate.method.is_adaptive(),
                points: study.settings(candidate).into_iter().map(point).collect(),
            }
        })
        .collect();
    time(study, end, &mut curves);
    curves
}

fn simulation<'m, M: Simulate>(
    study: &WorkPrecision<'m, M>,
    candidate: &Candidate<'m, M>,
    setting: f64,
    end: f64,
) -> Simulation<'m, M> {
    let simulation = study.simulation(end, &candidate.method);
    let adaptive = candidate.method.is_adaptive();
    let simulation = if adaptive { simulation.tolerance(setting) } else { simulation.fixed_step(setting) };
    match &candidate.options {
        Some(options) => options(simulation),
        None => simulation,
    }
}

/// The run that tells errors and counts.
fn first_run<'m, M: Simulate>(
    study: &WorkPrecision<'m, M>,
    candidate: &Candidate<'m, M>,
    setting: f64,
    end: f64,
    reference: &Found,
) -> Result<Measured, String> {
    let motion = simulation(study, candidate, setting, end).run().map_err(|error| in_a_line(&error))?;
    reaches(&motion.end(), end)?;
    let reached = End::of(study.model, &motion.end());
    let counts = motion.counts();
    Ok(Measured {
        errors: reached.errors(&reference.end),
        time: counts.wall_time.unwrap_or_default(),
        evaluations: Some(counts.evaluations),
        steps: Some(counts.steps),
        rejected: Some(counts.rejected),
        stiff_at: counts.stiff_at,
        end: Some(reached),
    })
}

/// What happened and when; the state there, which follows in further lines, has no place in a table.
pub(super) fn in_a_line(error: &impl ToString) -> String {
    error.to_string().lines().next().unwrap_or_default().to_string()
}

/// Sets the time of every run that succeeded to the median of its repeats.
fn time<M: Simulate>(study: &WorkPrecision<'_, M>, end: f64, curves: &mut [Curve]) {
    let mut repeats: Vec<Vec<Vec<Duration>>> = curves.iter().map(|c| alloc::vec![Vec::new(); c.points.len()]).collect();
    for _ in 0..ROUNDS {
        for ((curve, candidate), repeats) in curves.iter().zip(&study.candidates).zip(&mut repeats) {
            for (point, repeats) in curve.points.iter().zip(repeats) {
                let Ok(measured) = &point.outcome else { continue };
                // The first run kept its motion and met cold memory; it says about how long one takes, no more.
                let about = measured.time.max(Duration::from_nanos(100)).as_secs_f64();
                let count = study.effort.as_secs_f64() / f64::from(ROUNDS) / about;
                for _ in 0..(count as u32).clamp(1, MOST) {
                    let simulation = simulation(study, candidate, point.setting, end);
                    let begun = Instant::now();
                    let ended = simulation.run_with(|_| {});
                    let taken = begun.elapsed();
                    // It succeeded before, with the same numbers.
                    if ended.is_ok() {
                        repeats.push(taken);
                    }
                }
            }
        }
    }
    for (curve, repeats) in curves.iter_mut().zip(repeats) {
        for (point, mut repeats) in curve.points.iter_mut().zip(repeats) {
            if let Ok(measured) = &mut point.outcome
                && let Some(median) = median(&mut repeats)
            {
                measured.time = median;
            }
        }
    }
}

/// The middle one, the lower of two.
pub(super) fn median(times: &mut [Duration]) -> Option<Duration> {
    times.sort_unstable();
    times.get(times.len().saturating_sub(1) / 2).copied()
}

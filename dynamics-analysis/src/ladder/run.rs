//! The runs of a comparison and their differences.

use alloc::boxed::Box;
use alloc::string::ToString;
use alloc::vec::Vec;
use core::time::Duration;

use dynamics_runtime::simulate::Counts;

use super::comparison::{Compared, Comparison, Difference, RungReport};
use super::error::LadderError;
use super::rung::AnyMotion;
use super::{AnyRung, Ladder};
use crate::runs::{self, Median};

/// Tolerance of the runs that measure errors, relative to that of the others. Their own errors are then about
/// a hundredth, so that the difference is the error of the others to a percent.
const TIGHTER_TOLERANCE_RATIO: f64 = 1e-2;
/// An uncertainty of a difference below this share of the output is always accepted, even if it hides the
/// difference: the models then agree to three digits.
const ACCEPTED_UNCERTAINTY_SHARE: f64 = 1e-3;

/// The runs of one rung.
struct RungRun {
    counts: Counts,
    /// Outputs at the common times, from the run at the tighter tolerance.
    values: Vec<Vec<f64>>,
    /// Their errors in the run at the ladder's tolerance, by output.
    errors: Vec<f64>,
}

/// Runs all rungs and compares them.
pub(super) fn run(
    ladder: &Ladder<'_>,
    mut outputs: Vec<Compared>,
    interval: (f64, f64),
) -> Result<Comparison, LadderError> {
    // First runs, whose steps belong to the common times; then runs at a tighter tolerance.
    let runs: Vec<Box<dyn AnyMotion + '_>> = ladder
        .rungs
        .iter()
        .map(|rung| rung.run(interval.1, ladder.tolerance, false))
        .collect::<Result<_, _>>()?;
    let times = common_times(interval, ladder.intervals, runs.iter().flat_map(|run| run.knots()));
    let names: Vec<&str> = outputs.iter().map(|output| output.name.as_str()).collect();
    let measured: Vec<RungRun> = ladder
        .rungs
        .iter()
        .zip(&runs)
        .map(|(rung, run)| {
            error_run(&**rung, &**run, interval.1, TIGHTER_TOLERANCE_RATIO * ladder.tolerance, &times, &names)
        })
        .collect::<Result<_, _>>()?;
    let [.., full] = &*measured else { return Err(LadderError::TooFew { rungs: 0 }) };
    // Scales of relative differences: the largest values on the last rung.
    for (output, values) in outputs.iter_mut().zip(&full.values) {
        if output.scale.is_nan() {
            output.scale = values.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        }
        if output.scale == 0.0 {
            return Err(LadderError::NoScale { output: output.name.clone() });
        }
    }
    // Times, by repeats.
    let about: Vec<Option<Duration>> =
        measured.iter().map(|one| Some(one.counts.wall_time.unwrap_or_default())).collect();
    let medians =
        runs::medians(&about, ladder.effort, |i| ladder.rungs[i].time(interval.1, ladder.tolerance));
    let mut rungs = Vec::with_capacity(measured.len());
    for (k, (rung, own)) in ladder.rungs.iter().zip(&measured).enumerate() {
        let is_full = k + 1 == measured.len();
        let once = Median { time: own.counts.wall_time.unwrap_or_default(), repeats: 0 };
        let time = medians[k].unwrap_or(once);
        rungs.push(report(&**rung, own, full, is_full, &times, &outputs, time)?);
    }
    Ok(Comparison {
        scene: ladder.scene.clone(),
        interval,
        tolerance: ladder.tolerance,
        times,
        outputs,
        rungs,
    })
}

/// Equal intervals joined by the steps, in the order of the motion.
fn common_times((start, end): (f64, f64), intervals: usize, knots: impl Iterator<Item = f64>) -> Vec<f64> {
    let part = |k: usize| k as f64 / intervals as f64;
    let at = |k: usize| if k == intervals { end } else { start + part(k) * (end - start) };
    let mut times: Vec<f64> = (0..=intervals).map(at).chain(knots).collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    if end < start {
        times.reverse();
    }
    times
}

/// Runs a rung once more at a tighter tolerance, and measures the errors of its first run.
fn error_run(
    rung: &dyn AnyRung,
    run: &dyn AnyMotion,
    end: f64,
    tighter: f64,
    times: &[f64],
    outputs: &[&str],
) -> Result<RungRun, LadderError> {
    let loose = run.sample(times, outputs)?;
    let values = rung.run(end, tighter, true)?.sample(times, outputs)?;
    let apart =
        |(a, b): (&Vec<f64>, &Vec<f64>)| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let rounding =
        |values: &Vec<f64>| f64::EPSILON * values.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let errors = loose.iter().zip(&values).map(|pair| apart(pair).max(rounding(pair.1))).collect();
    Ok(RungRun { counts: run.counts(), values, errors })
}

/// The report of a rung: its cost, and its differences from the last one.
fn report(
    rung: &dyn AnyRung,
    own: &RungRun,
    full: &RungRun,
    is_full: bool,
    times: &[f64],
    outputs: &[Compared],
    median: Median,
) -> Result<RungReport, LadderError> {
    let mut differences = Vec::with_capacity(outputs.len());
    for (o, output) in outputs.iter().enumerate() {
        let uncertainty = if is_full { own.errors[o] } else { own.errors[o] + full.errors[o] };
        let difference = difference(times, &own.values[o], &full.values[o], uncertainty);
        // Differences that are uncertain by more than half of themselves and by three digits of the output
        // are not converged.
        let hidden = difference.uncertainty > 0.5 * difference.largest;
        if hidden && difference.uncertainty > ACCEPTED_UNCERTAINTY_SHARE * output.scale {
            return Err(LadderError::NotConverged {
                rung: rung.name().to_string(),
                output: output.name.clone(),
                difference: difference.largest,
                uncertainty: difference.uncertainty,
                scale: output.scale,
            });
        }
        differences.push(difference);
    }
    // Its cost.
    let size = rung.size();
    Ok(RungReport {
        name: rung.name().to_string(),
        coordinates: size.coordinates,
        constraints: size.constraints,
        operations: size.operations,
        evaluations: own.counts.evaluations,
        steps: own.counts.steps,
        time: median.time,
        repeats: median.repeats,
        values: own.values.clone(),
        differences,
    })
}

/// The difference of an output from that of the last rung: its largest value and its root mean square.
fn difference(times: &[f64], own: &[f64], full: &[f64], uncertainty: f64) -> Difference {
    let apart: Vec<f64> = own.iter().zip(full).map(|(a, b)| a - b).collect();
    let (mut largest, mut at) = (0.0, times[0]);
    for (t, d) in times.iter().zip(&apart) {
        if d.abs() > largest {
            (largest, at) = (d.abs(), *t);
        }
    }
    // The difference is linear between the times, and the integral of its square is exact for that.
    let square = |d: &[f64]| (d[0] * d[0] + d[0] * d[1] + d[1] * d[1]) / 3.0;
    let integral: f64 =
        times.windows(2).zip(apart.windows(2)).map(|(t, d)| (t[1] - t[0]).abs() * square(d)).sum();
    let span = (times[times.len() - 1] - times[0]).abs();
    Difference { largest, at, rms: libm::sqrt(integral / span), at_start: apart[0].abs(), uncertainty }
}

//! Runs of studies and comparisons: whether a run reached its end, and how long it takes.
//!
//! A time is the median of repeats. Repeats are made in rounds over all runs, so that a disturbance of the
//! machine hits a few repeats of many runs, not all repeats of one.

use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::time::Duration;
use std::time::Instant;

use dynamics_runtime::model::{ModelState, Vector};
use dynamics_runtime::simulate::{Simulate, Simulation};

/// Time for the repeats of one run unless it is set: some dozens of runs of a millisecond. A study of
/// some forty runs takes a few seconds.
pub(super) const DEFAULT_EFFORT: Duration = Duration::from_millis(60);
/// Errors and differences below this share of their uncertainty are drawn at it. How far below they are is
/// not known, and rounding would stretch the axis.
pub(super) const PLOT_FLOOR_SHARE: f64 = 0.1;

/// Number of rounds. With three, a disturbance of one round leaves the median of the other two.
const TIMING_ROUNDS: u32 = 3;
/// Most repeats of a run in one round. It bounds the repeats of very short runs; an odd number has a middle.
const MAX_REPEATS_PER_ROUND: u32 = 101;
/// Runs that took less than this are repeated as often as runs that took this long, so that a time of zero
/// gives a finite number of repeats.
const SHORTEST_RUN: Duration = Duration::from_nanos(100);

/// Longest step of a reference run, relative to the time of the motion. A force that lasts for a hundredth of
/// the motion then has five steps. With longer steps all runs might miss such a force and agree.
const MAX_REFERENCE_STEP: f64 = 2e-3;
/// The longest step is set only if it is larger than this many roundings of the time. Shorter steps would be
/// dominated by the rounding of the time.
const MIN_STEP_IN_ROUNDINGS: f64 = 1e3;

/// The simulation with steps of at most [`MAX_REFERENCE_STEP`], if time resolves them.
pub(super) fn with_short_steps<'m, M: Simulate>(
    simulation: Simulation<'m, M>,
    (start, end): (f64, f64),
) -> Simulation<'m, M> {
    let longest = MAX_REFERENCE_STEP * (end - start).abs();
    let resolved = longest > MIN_STEP_IN_ROUNDINGS * f64::EPSILON * end.abs().max(start.abs());
    if resolved { simulation.max_step(longest) } else { simulation }
}

/// The first line of an error: what happened and when. The state follows in further lines, which a table has
/// no room for.
pub(super) fn first_line(error: &impl ToString) -> String {
    error.to_string().lines().next().unwrap_or_default().to_string()
}

/// Checks that a run went to the end of the motion (an event may have stopped it) and that its end is finite.
pub(super) fn check_end<S: ModelState>(state: &S, end: f64) -> Result<(), String> {
    let finite = |v: &[f64]| v.iter().all(|x| x.is_finite());
    if state.t() != end {
        return Err(format!("it stopped at t = {}, before the end", state.t()));
    }
    if !finite(state.q().as_slice()) || !finite(state.u().as_slice()) {
        return Err("its end is not finite".into());
    }
    Ok(())
}

/// Time and last state of a run that records nothing; `None` if it failed.
pub(super) fn timed_run<M: Simulate>(simulation: Simulation<'_, M>) -> Option<(Duration, M::State)> {
    let begun = Instant::now();
    let ended = simulation.run_with(|_| {});
    let taken = begun.elapsed();
    Some((taken, ended.ok()?))
}

/// The time of a run, measured by repeats.
#[derive(Clone, Copy)]
pub(super) struct Median {
    pub(super) time: Duration,
    pub(super) repeats: usize,
}

/// Median times of all runs. `about`: the approximate time of each run, `None` for runs that are left out;
/// `effort`: the time that all repeats of one run may take; `once`: makes the run of an index.
pub(super) fn medians(
    about: &[Option<Duration>],
    effort: Duration,
    mut once: impl FnMut(usize) -> Option<Duration>,
) -> Vec<Option<Median>> {
    let mut repeats = alloc::vec![Vec::new(); about.len()];
    for _ in 0..TIMING_ROUNDS {
        for (i, (about, repeats)) in about.iter().zip(&mut repeats).enumerate() {
            let Some(about) = about else { continue };
            let about = (*about).max(SHORTEST_RUN).as_secs_f64();
            let count = effort.as_secs_f64() / f64::from(TIMING_ROUNDS) / about;
            // No repeat fails: the run succeeded before, and it is deterministic.
            repeats.extend((0..(count as u32).clamp(1, MAX_REPEATS_PER_ROUND)).filter_map(|_| once(i)));
        }
    }
    let of = |times: &mut Vec<Duration>| median(times).map(|time| Median { time, repeats: times.len() });
    repeats.iter_mut().map(of).collect()
}

/// A sentence that says how often runs were repeated; a count of 0 is a run that was not repeated.
pub(super) fn repeats_in_words(counts: impl Iterator<Item = usize>) -> String {
    let (least, most) =
        counts.fold((usize::MAX, 0), |(least, most), count| (least.min(count), most.max(count)));
    match (least, most) {
        (_, 0) => "times are those of single runs".into(),
        (least, most) if least == most => format!("times are medians of {most} repeats"),
        (least, most) => format!("times are medians of {least} to {most} repeats"),
    }
}

/// The median; of an even number of times the lower of the two in the middle.
pub(super) fn median(times: &mut [Duration]) -> Option<Duration> {
    times.sort_unstable();
    times.get(times.len().saturating_sub(1) / 2).copied()
}

//! Whether a run reached its end, and how long it takes.

use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::time::Duration;
use std::time::Instant;

use dynamics_runtime::model::{ModelState, Vector};
use dynamics_runtime::simulate::{Simulate, Simulation};

/// Rounds over all runs: what disturbs the machine for a while disturbs a part of the repeats of many runs,
/// not all of one.
const ROUNDS: u32 = 3;
/// Most repeats in one round.
const MOST_REPEATS: u32 = 101;

/// Longest steps of a run that others are measured against, in parts of the motion.
const LONGEST: f64 = 2e-3;

/// With steps so short that they do not go over what lasts for a hundredth of the motion, where time resolves
/// them: runs that all missed that would agree.
pub(super) fn with_short_steps<'m, M: Simulate>(
    simulation: Simulation<'m, M>,
    (start, end): (f64, f64),
) -> Simulation<'m, M> {
    let longest = LONGEST * (end - start).abs();
    let resolved = longest > 1e3 * f64::EPSILON * end.abs().max(start.abs());
    if resolved { simulation.max_step(longest) } else { simulation }
}

/// What happened and when; the state there, which follows in further lines, has no place in a table.
pub(super) fn in_a_line(error: &impl ToString) -> String {
    error.to_string().lines().next().unwrap_or_default().to_string()
}

/// Whether a run went to the end of the motion; an event may have stopped it.
pub(super) fn reaches<S: ModelState>(state: &S, end: f64) -> Result<(), String> {
    let finite = |v: &[f64]| v.iter().all(|x| x.is_finite());
    if state.t() != end {
        return Err(format!("it stopped at t = {}, before the end", state.t()));
    }
    if !finite(state.q().as_slice()) || !finite(state.u().as_slice()) {
        return Err("its end is not finite".into());
    }
    Ok(())
}

/// Time of a run that keeps nothing, and its end; `None` where it failed.
pub(super) fn once<M: Simulate>(simulation: Simulation<'_, M>) -> Option<(Duration, M::State)> {
    let begun = Instant::now();
    let ended = simulation.run_with(|_| {});
    let taken = begun.elapsed();
    Some((taken, ended.ok()?))
}

/// What repeats of a run took.
#[derive(Clone, Copy)]
pub(super) struct Median {
    pub(super) time: Duration,
    pub(super) repeats: usize,
}

/// Medians of repeats, in rounds over all runs. `about`: about how long each takes, `None` for those that are
/// left out; `effort`: time that the repeats of each may take; `once`: runs one of them.
pub(super) fn medians(
    about: &[Option<Duration>],
    effort: Duration,
    mut once: impl FnMut(usize) -> Option<Duration>,
) -> Vec<Option<Median>> {
    let mut repeats = alloc::vec![Vec::new(); about.len()];
    for _ in 0..ROUNDS {
        for (i, (about, repeats)) in about.iter().zip(&mut repeats).enumerate() {
            let Some(about) = about else { continue };
            let about = (*about).max(Duration::from_nanos(100)).as_secs_f64();
            let count = effort.as_secs_f64() / f64::from(ROUNDS) / about;
            // It succeeded before, with the same numbers.
            repeats.extend((0..(count as u32).clamp(1, MOST_REPEATS)).filter_map(|_| once(i)));
        }
    }
    let of = |times: &mut Vec<Duration>| median(times).map(|time| Median { time, repeats: times.len() });
    repeats.iter_mut().map(of).collect()
}

/// How often runs were repeated, in words.
pub(super) fn repeated(counts: impl Iterator<Item = usize>) -> String {
    let (least, most) =
        counts.fold((usize::MAX, 0), |(least, most), count| (least.min(count), most.max(count)));
    match (least, most) {
        (_, 0) => "times are those of single runs".into(),
        (least, most) if least == most => format!("times are medians of {most} repeats"),
        (least, most) => format!("times are medians of {least} to {most} repeats"),
    }
}

/// The middle one, the lower of two.
pub(super) fn median(times: &mut [Duration]) -> Option<Duration> {
    times.sort_unstable();
    times.get(times.len().saturating_sub(1) / 2).copied()
}

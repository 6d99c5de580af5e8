//! What ensembles cost beside sweeps: runs per second of a sweep, of an ensemble in memory, and of ensembles
//! into files, with progress.
//!
//! `cargo bench -p dynamics-benches --bench ensemble_files` makes 160 × 160 double pendulums of 10 s at a
//! tolerance of 1e-9 on one core, or on all with `--features parallel`. Times are the least of five passes,
//! in turn: time of the processor on one core where the system tells it (Linux), so that other programs do
//! not count, else time of the clock. The lines `rows alone` are of runs that compute nothing: what points,
//! blocks and files cost by themselves. Files go to a folder below `target`.

#[path = "../tests/models/double_pendulum.rs"]
mod double_pendulum;

use std::f64::consts::PI;
use std::path::PathBuf;
use std::time::Instant;

use double_pendulum::DoublePendulum;
use dynamics::ensembles::{Ensemble, Grid, OpenEnsemble};
use dynamics::prelude::*;

type Outcome = Result<(), Box<dyn std::error::Error>>;
/// Makes all runs once.
type Way<'a> = Box<dyn Fn() -> Outcome + 'a>;

/// Starts on each axis, length of the runs in s, tolerance.
const ACROSS: u32 = 160;
const UNTIL: f64 = 10.0;
const TOLERANCE: f64 = 1e-9;
const PASSES: usize = 5;

const MODEL: DoublePendulum = DoublePendulum { m1: 1.0, m2: 1.0, l1: 1.0, l2: 1.0, g: 9.81 };

fn angles() -> impl Iterator<Item = f64> {
    (0..ACROSS).map(|k| PI * (f64::from(2 * k + 1) / f64::from(ACROSS) - 1.0))
}

fn ensemble(start: State<DoublePendulum>) -> Ensemble<'static, DoublePendulum> {
    let grid = Grid::new().over("theta2", angles()).over("theta1", angles());
    let ensemble = MODEL.ensemble(start, grid).until(UNTIL).tolerance(TOLERANCE);
    ensemble.keep_ends(["end1", "end2"], |_, end| [end.theta1(), end.theta2()])
}

/// Seconds since any instant: of the processor for this thread, where that is known and there is one thread.
fn seconds(begun: Instant) -> f64 {
    let stat =
        (!cfg!(feature = "parallel")).then(|| std::fs::read_to_string("/proc/thread-self/schedstat").ok());
    let nanoseconds = stat.flatten().and_then(|text| text.split(' ').next()?.parse::<f64>().ok());
    nanoseconds.map_or_else(|| begun.elapsed().as_secs_f64(), |time| 1e-9 * time)
}

fn main() -> Outcome {
    let start = MODEL.state().build()?;
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../target/ensemble_files");
    let sweep = || -> Outcome {
        let sweep = MODEL.sweep(start).over("theta2", angles()).over("theta1", angles());
        let ends = sweep.ends(
            ["end1", "end2"],
            |_, run| run.until(UNTIL).tolerance(TOLERANCE),
            |_, end| [end.theta1(), end.theta2()],
        )?;
        assert!(ends.failures().count() == 0);
        Ok(())
    };
    let in_memory = || -> Outcome {
        assert!(ensemble(start).run()?.failed().is_empty());
        Ok(())
    };
    let to = |ending: &str| -> Outcome {
        let _ = std::fs::remove_dir_all(&folder);
        let ensemble = ensemble(start).to(folder.join(format!("runs.{ending}")));
        #[cfg(feature = "progress")]
        let ensemble = ensemble.progress();
        assert!(ensemble.run()?.failed().is_empty());
        Ok(())
    };
    let rows_alone = |ending: Option<&str>| -> Outcome {
        let _ = std::fs::remove_dir_all(&folder);
        let grid = Grid::new().over("theta2", angles()).over("theta1", angles());
        let rows =
            MODEL.ensemble(start, grid).compute(["end1", "end2"], |_, start| [start.theta1().sin(); 2]);
        let rows = match ending {
            Some(ending) => rows.to(folder.join(format!("runs.{ending}"))),
            None => rows,
        };
        assert!(rows.run()?.failed().is_empty());
        Ok(())
    };
    let mut ways: Vec<(&str, Way<'_>)> = vec![
        ("sweep", Box::new(sweep)),
        ("ensemble in memory", Box::new(in_memory)),
        ("ensemble to .npy", Box::new(|| to("npy"))),
        ("ensemble to .csv", Box::new(|| to("csv"))),
    ];
    ways.push(("rows alone, in memory", Box::new(|| rows_alone(None))));
    ways.push(("rows alone, to .npy", Box::new(|| rows_alone(Some("npy")))));
    ways.push(("rows alone, to .csv", Box::new(|| rows_alone(Some("csv")))));
    if cfg!(feature = "parquet") {
        ways.push(("ensemble to .parquet", Box::new(|| to("parquet"))));
        ways.push(("rows alone, to .parquet", Box::new(|| rows_alone(Some("parquet")))));
    }
    let (begun, mut least) = (Instant::now(), vec![f64::INFINITY; ways.len()]);
    for _ in 0..PASSES {
        for (least, (_, way)) in least.iter_mut().zip(&ways) {
            let before = seconds(begun);
            way()?;
            *least = least.min(seconds(begun) - before);
        }
    }
    let runs = f64::from(ACROSS * ACROSS);
    println!("{runs} runs, {UNTIL} s at a tolerance of {TOLERANCE:e}; least of {PASSES} passes");
    for ((name, _), taken) in ways.iter().zip(&least) {
        let more = 100.0 * (taken / least[0] - 1.0);
        println!("{name:24} {taken:8.3} s  {:8.2} µs per run  {more:+6.2} %", 1e6 * taken / runs);
    }
    Ok(())
}

//! Many runs of which only the ends are wanted: side by side ([`ends`](dynamics::simulate::ends)), and one
//! after the other by the default method.
//!
//! `cargo bench -p dynamics-benches --bench ensembles` prints, for each model and tolerance, the time per run
//! and the median error of both. Words after `--` choose models by a part of their name. Times are the least
//! of five passes, in turn, on one core. The error of a run is the largest of its coordinates at the end,
//! against a run at a tolerance of 1e-13.
//!
//! With `ENSEMBLES_TO=folder` the starts and ends of the double pendulums are written there, for other
//! solvers (`benches/peers/run.sh ensembles`).

#[path = "../tests/models/double_pendulum.rs"]
mod double_pendulum;
#[path = "../tests/models/kepler.rs"]
mod kepler;
#[path = "../tests/slow/snapshots/models.rs"]
#[allow(dead_code, unused_imports, reason = "snapshots use more of it")]
mod models;

use std::f64::consts::PI;
use std::fmt::Write as _;
use std::path::Path;
use std::time::Instant;

use dynamics::model::{ModelState, Vector};
use dynamics::prelude::*;
use dynamics::simulate::ends;

type Outcome = Result<(), Box<dyn std::error::Error>>;

/// Median and ninth tenth of the errors at the end.
fn errors<S: ModelState>(found: &[S], exact: &[S]) -> [f64; 2] {
    let largest =
        |(a, b): (&S, &S)| (0..S::Vector::LEN).map(|i| (a.q()[i] - b.q()[i]).abs()).fold(0.0, f64::max);
    let mut errors: Vec<f64> = found.iter().zip(exact).map(largest).collect();
    errors.sort_by(f64::total_cmp);
    [errors[errors.len() / 2], errors[errors.len() * 9 / 10]]
}

/// Prints the comparison for one model, if it was asked for. Returns the ends.
fn compare<M: Simulate>(
    name: &str,
    model: &M,
    starts: &[M::State],
    until: f64,
) -> Result<Vec<M::State>, Box<dyn std::error::Error>> {
    let words: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    if !words.is_empty() && !words.iter().any(|word| name.contains(word.as_str())) {
        return Ok(Vec::new());
    }
    let run = |start: &M::State, tolerance: f64| model.simulate(*start).until(until).tolerance(tolerance);
    let alone = |tolerance: f64| -> Result<Vec<M::State>, String> {
        let one = |start| run(start, tolerance).run_with(|_| ()).map_err(|error| error.to_string());
        starts.iter().map(one).collect()
    };
    let together = |tolerance: f64| -> Result<Vec<M::State>, String> {
        let found = ends(starts.iter().map(|start| run(start, tolerance)));
        found.into_iter().map(|end| end.map_err(|error| error.to_string())).collect()
    };
    let exact = alone(1e-13)?;
    println!("{name}, {} runs", starts.len());
    println!("{:>9}  {:>34}  {:>34}", "", "side by side", "one after the other");
    let heads = ["µs per run", "error", "90 %"];
    println!(
        "{:>9}  {:>14}{:>10}{:>10}  {:>14}{:>10}{:>10}",
        "tolerance", heads[0], heads[1], heads[2], heads[0], heads[1], heads[2]
    );
    for tolerance in [1e-4, 1e-6, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12] {
        let (mut least, mut found) = ([f64::INFINITY; 2], [Vec::new(), Vec::new()]);
        for _ in 0..5 {
            for (k, all) in [&together as &dyn Fn(f64) -> _, &alone].into_iter().enumerate() {
                let begun = Instant::now();
                found[k] = all(tolerance)?;
                least[k] = least[k].min(begun.elapsed().as_secs_f64());
            }
        }
        let us = least.map(|seconds| 1e6 * seconds / starts.len() as f64);
        let [[a, b], [c, d]] = [errors(&found[0], &exact), errors(&found[1], &exact)];
        println!(
            "{tolerance:>9.0e}  {:>14.2}{a:>10.1e}{b:>10.1e}  {:>14.2}{c:>10.1e}{d:>10.1e}",
            us[0], us[1]
        );
    }
    Ok(exact)
}

fn main() -> Outcome {
    let model = double_pendulum::DoublePendulum { m1: 1.0, m2: 1.0, l1: 1.0, l2: 1.0, g: 9.81 };
    let angle = |k: u32| PI * (f64::from(2 * k + 1) / 32.0 - 1.0);
    let starts: Result<Vec<_>, _> =
        (0..1024).map(|k| model.state().theta1(angle(k / 32)).theta2(angle(k % 32)).build()).collect();
    let starts = starts?;
    let exact = compare("double pendulum", &model, &starts, 10.0)?;
    if let Ok(folder) = std::env::var("ENSEMBLES_TO") {
        let mut lines = String::from("theta1,theta2,theta1 at 10 s,theta2 at 10 s\n");
        for (start, end) in starts.iter().zip(&exact) {
            writeln!(lines, "{},{},{},{}", start.theta1(), start.theta2(), end.theta1(), end.theta2())?;
        }
        std::fs::create_dir_all(&folder)?;
        std::fs::write(Path::new(&folder).join("double_pendulums.csv"), lines)?;
    }

    let model = kepler::Kepler { mu: 1.0 };
    let eccentricity = |k: u32| 0.9 * f64::from(k) / 511.0;
    let start = |e: f64| model.state().x(1.0 - e).y_rate(((1.0 + e) / (1.0 - e)).sqrt()).build();
    let starts: Result<Vec<_>, _> = (0..512).map(|k| start(eccentricity(k))).collect();
    compare("Kepler", &model, &starts?, 20.0)?;

    let model = models::Chain { cart: 1.0, mass: [1.0; 4], length: [1.0; 4], g: 9.81 };
    let bent = |k: u32| {
        let angle = |i: u32| (0.7 * f64::from(7 * k + i)).sin();
        model.state().theta([angle(0), angle(1), angle(2), angle(3)]).build()
    };
    let starts: Result<Vec<_>, _> = (0..256).map(bent).collect();
    compare("cart with four links", &model, &starts?, 5.0)?;
    Ok(())
}

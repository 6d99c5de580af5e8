//! Error against cost beside `ode_solvers`, on the same derived right-hand sides and the same tolerances.
//! `cargo run --release --manifest-path benches/peers/Cargo.toml`.
//!
//! `ode_solvers` integrates the first-order system (q, q̇) and keeps its accepted steps, as it cannot but do;
//! this library keeps nothing.

mod problems;

use std::fmt::Write;
use std::time::{Duration, Instant};

use dynamics::adapters::FirstOrder;
use dynamics::adapters::ode_solvers::solvers::{Dop853, Dopri5, OutputType, SVector};
use dynamics::analysis::{Cost, ErrorOf, Page, Reference};
use dynamics::model::Vector;
use dynamics::prelude::*;
use problems::Problem;

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// Runs of one setting; their median counts.
const REPEATS: usize = 7;
/// The published end values hold to all digits printed.
const UNCERTAINTY: f64 = 1e-15;

fn tolerances() -> impl Iterator<Item = f64> {
    (3..=13).map(|k| 10f64.powi(-k))
}

/// Lines of measurements of one of their methods, for `Study::add_outside`.
macro_rules! measured {
    ($solver:ident, $name:literal, $problem:expr, $lines:expr) => {
        let system = FirstOrder::new(&$problem.model, $problem.start)?;
        let y = SVector::<f64, 4>::from_column_slice(&system.initial());
        for tolerance in tolerances() {
            for _ in 0..REPEATS {
                let clock = Instant::now();
                let mut solver =
                    $solver::new(&system, 0.0, $problem.end, $problem.end, y, tolerance, tolerance);
                solver.set_output(OutputType::Sparse);
                let stats = solver.integrate();
                let time = clock.elapsed().as_secs_f64() * 1e6;
                write!($lines, "{{\"problem\":\"{}\",\"solver\":\"{}\",", $problem.name, $name)?;
                write!($lines, "\"tolerance\":{tolerance:e},")?;
                match (stats, solver.y_out().last()) {
                    (Ok(stats), Some(end)) => writeln!(
                        $lines,
                        "\"time_us\":{time:e},\"evaluations\":{},\"end\":[{:e},{:e},{:e},{:e}]}}",
                        stats.num_eval, end[0], end[1], end[2], end[3]
                    )?,
                    (Err(error), _) => writeln!($lines, "\"failure\":\"{error}\"}}")?,
                    (Ok(_), None) => writeln!($lines, "\"failure\":\"it returned nothing\"}}")?,
                }
            }
        }
    };
}

fn study<M: Simulate>(page: Page, problem: &Problem<M>) -> Result<Page> {
    let [q1, q2, u1, u2] = problem.reference;
    let mut end = problem.start;
    end.q_mut().as_mut_slice().copy_from_slice(&[q1, q2]);
    end.u_mut().as_mut_slice().copy_from_slice(&[u1, u2]);
    let end = M::State::new(problem.end, *end.q(), *end.u(), *end.inputs());
    let mut study = dynamics::analysis::Analyze::work_precision(&problem.model, problem.start)
        .problem(problem.name)
        .until(problem.end)
        .reference(Reference::known(end, UNCERTAINTY))
        .tolerances(tolerances())
        .effort(Duration::from_millis(100))
        .run()?;
    let mut lines = String::new();
    measured!(Dop853, "ode_solvers DOP853", problem, lines);
    measured!(Dopri5, "ode_solvers DOPRI5", problem, lines);
    study.add_outside(&lines)?;
    println!("{study}\n");
    for cost in [Cost::Time, Cost::Evaluations] {
        println!("{}", study.comparison(ErrorOf::State, cost, &[1e-3, 1e-6, 1e-9, 1e-12]));
    }
    Ok(page.study(&study))
}

fn main() -> Result<()> {
    let page = Page::new("Beside ode_solvers");
    let page = study(page, &problems::double_pendulum())?;
    let page = study(page, &problems::kepler())?;
    let page = study(page, &problems::arenstorf())?;
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("results/ode_solvers.html");
    page.write_html(&path)?;
    println!("curves: {}", path.display());
    Ok(())
}

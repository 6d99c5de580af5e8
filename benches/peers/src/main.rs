//! Error against cost beside `ode_solvers`, on the same derived right-hand sides and the same tolerances.
//! `cargo run --release --manifest-path benches/peers/Cargo.toml`.
//!
//! Both keep the accepted steps. `ode_solvers` integrates the first-order system (q, u).

#[path = "../../integration/problems.rs"]
mod problems;
#[path = "../../integration/table.rs"]
mod table;

use dynamics::model::Vector;
use dynamics::prelude::*;
use ode_solvers::dop_shared::{OutputType, Stats};
use ode_solvers::{Dop853, Dopri5, System, Vector4};
use problems::Problem;
use table::{Curve, measure, methods, report, tolerances};

/// A model as the first-order system (q, u)˙ = (u, q̈).
struct FirstOrder<'m, M: Dynamics> {
    model: &'m M,
    constants: M::Constants,
}

impl<M: Dynamics> System<f64, Vector4<f64>> for FirstOrder<'_, M> {
    fn system(&self, t: f64, y: &Vector4<f64>, slope: &mut Vector4<f64>) {
        let (mut q, mut u) = (M::Vector::zeros(), M::Vector::zeros());
        for i in 0..2 {
            (q[i], u[i]) = (y[i], y[2 + i]);
        }
        let state = M::State::new(t, q, u, M::Inputs::zeros());
        let a = self.model.accelerations_with(&self.constants, &state).expect("a regular problem");
        *slope = Vector4::new(u[0], u[1], a[0], a[1]);
    }
}

fn peers<M: Simulate>(problem: &Problem<M>) -> Vec<Curve> {
    let Problem { model, start, end, reference, .. } = problem;
    let y = Vector4::new(start.q()[0], start.q()[1], start.u()[0], start.u()[1]);
    let system = || FirstOrder { model, constants: model.constants().expect("a regular problem") };
    let result = |stats: Stats, steps: &[Vector4<f64>]| {
        let last = steps.last().expect("at least the start");
        (u64::from(stats.num_eval), [last[0], last[1], last[2], last[3]])
    };
    let dopri5 = |tolerance: f64| {
        measure(*reference, || {
            let mut solver = Dopri5::new(system(), 0.0, *end, *end, y, tolerance, tolerance);
            solver.set_output(OutputType::Sparse);
            let stats = solver.integrate().expect("a regular problem");
            result(stats, solver.y_out())
        })
    };
    let dop853 = |tolerance: f64| {
        measure(*reference, || {
            let mut solver = Dop853::new(system(), 0.0, *end, *end, y, tolerance, tolerance);
            solver.set_output(OutputType::Sparse);
            let stats = solver.integrate().expect("a regular problem");
            result(stats, solver.y_out())
        })
    };
    vec![
        Curve { solver: "ode_solvers Dopri5", runs: tolerances().map(dopri5).collect() },
        Curve { solver: "ode_solvers Dop853", runs: tolerances().map(dop853).collect() },
    ]
}

fn all<M: Simulate>(chart: Chart, problem: &Problem<M>) -> Chart
where
    M::Vector: Into<[f64; 2]>,
{
    let curves: Vec<Curve> = methods(problem).into_iter().chain(peers(problem)).collect();
    report(chart, problem.name, &curves)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let chart = Chart::new("Error against cost beside other solvers").panel_height(280.0);
    let chart = all(chart, &problems::double_pendulum());
    let chart = all(chart, &problems::kepler());
    let chart = all(chart, &problems::arenstorf());
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/benches-output/peers.svg");
    chart.write_svg(&path)?;
    println!("\ncurves: {}", path.display());
    Ok(())
}

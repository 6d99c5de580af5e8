//! Error against cost of the integration methods on problems with known end values. `cargo bench --bench integration`.
//!
//! The machine decides the microseconds; the evaluations and the ratios inside one run are what can be compared. The same table
//! with solvers of other crates on the same right-hand sides: `cargo run --release --manifest-path benches/peers/Cargo.toml`.

#[path = "integration/problems.rs"]
mod problems;
#[path = "integration/table.rs"]
mod table;

use dynamics::prelude::*;
use table::{methods, report};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let chart = Chart::new("Error against cost of the integration methods").panel_height(280.0);
    let problem = problems::double_pendulum();
    let chart = report(chart, problem.name, &methods(&problem));
    let problem = problems::kepler();
    let chart = report(chart, problem.name, &methods(&problem));
    let problem = problems::arenstorf();
    let chart = report(chart, problem.name, &methods(&problem));
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("target/benches-output/integration.svg");
    chart.write_svg(&path)?;
    println!("\ncurves: {}", path.display());
    Ok(())
}

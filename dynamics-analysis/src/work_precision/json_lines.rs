//! The runs of a study as one JSON object per line, the format that `outside.rs` reads.

use alloc::string::String;
use alloc::vec::Vec;
use core::fmt::Write;

use dynamics_runtime::simulate::Simulate;
use dynamics_view::text::{exact, json, json_number};

use super::errors::Errors;
use super::study::{RunMeasurement, Study};

impl<M: Simulate> Study<'_, M> {
    /// All runs as one JSON object per line, with errors and steps. A study with the feature `json` reads
    /// this format by `add_outside`.
    #[must_use]
    pub fn json_lines(&self) -> String {
        let mut out = String::new();
        for curve in &self.curves {
            for point in &curve.points {
                let setting = if curve.adaptive { "tolerance" } else { "step" };
                let _ = write!(
                    out,
                    "{{\"problem\":{},\"solver\":{},\"{setting}\":{}",
                    json(&self.problem),
                    json(&curve.name),
                    exact(point.setting)
                );
                match &point.outcome {
                    Ok(run) => write_run(&mut out, run),
                    Err(reason) => {
                        let _ = write!(out, ",\"failure\":{}", json(reason));
                    }
                }
                out.push_str("}\n");
            }
        }
        out
    }
}

fn write_run(out: &mut String, run: &RunMeasurement) {
    let _ = write!(out, ",\"time_us\":{}", json_number(run.time.as_nanos() as f64 * 1e-3));
    if let Some(repeats) = run.repeats {
        let _ = write!(out, ",\"repeats\":{repeats}");
    }
    for (name, count) in [("evaluations", run.evaluations), ("steps", run.steps), ("rejected", run.rejected)]
    {
        if let Some(count) = count {
            let _ = write!(out, ",\"{name}\":{count}");
        }
    }
    let Errors { positions, velocities, multipliers, energy } = run.errors;
    let known = [Some(positions), Some(velocities), multipliers, Some(energy)];
    for (name, error) in ["positions", "velocities", "multipliers", "energy"].into_iter().zip(known) {
        if let Some(error) = error.filter(|error| error.is_finite()) {
            let _ = write!(out, ",\"{name}\":{}", exact(error));
        }
    }
    if let Some(end) = &run.end {
        let values: Vec<String> = end.q.iter().chain(&end.u).map(|x| exact(*x)).collect();
        let _ = write!(out, ",\"end\":[{}]", values.join(","));
    }
}

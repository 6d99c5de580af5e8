//! Measurements of other solvers, one JSON object per line, and those of a study in the same format.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::time::Duration;
use std::path::Path;

use dynamics_runtime::model::{ModelState, Vector};
use dynamics_runtime::simulate::Simulate;
use serde_json::{Map, Value};

use super::error::OutsideError;
use super::errors::{End, Errors};
use super::study::{Point, RunMeasurement, Study, WorkPrecisionCurve};
use crate::runs::median;

/// One line of a file.
struct Line {
    solver: String,
    tolerance: f64,
    outcome: Result<RunMeasurement, String>,
}

impl<M: Simulate> Study<'_, M> {
    /// Adds curves that were measured elsewhere, one JSON object per line:
    ///
    /// ```text
    /// {"problem":"Pendulum","solver":"heyoka","tolerance":1e-9,"time_us":194.0,"end":[0.1,0.2,-0.3,0.4]}
    /// {"problem":"Pendulum","solver":"CVODE BDF","tolerance":1e-9,"failure":"error test failures"}
    /// ```
    ///
    /// `end` are the coordinates and then the velocities at the end, in the order of the model: errors are
    /// measured against the reference of this study. Without it, errors are given: `positions`, `velocities`,
    /// `multipliers`, `energy`, each as far as it is known. `evaluations` and `repeats`, of which the time is
    /// the median, may be left out; names that are not known here are passed over. Lines with the name of
    /// another problem are, too. Where a solver has several lines at one tolerance, the median of their times
    /// counts. Returns how many lines were taken.
    pub fn add_outside(&mut self, lines: &str) -> Result<usize, OutsideError> {
        let mut found: Vec<(String, Vec<Line>)> = Vec::new();
        for (i, text) in lines.lines().enumerate().filter(|(_, text)| !text.trim().is_empty()) {
            let failed = |problem| OutsideError::Line { line: i + 1, problem };
            let Some(line) = self.line(text).map_err(failed)? else { continue };
            if self.curve(&line.solver).is_some() {
                return Err(failed(format!("there is a curve `{}` already", line.solver)));
            }
            match found.iter_mut().find(|(solver, _)| *solver == line.solver) {
                Some((_, of_solver)) => of_solver.push(line),
                None => found.push((line.solver.clone(), alloc::vec![line])),
            }
        }
        let taken = found.iter().map(|(_, lines)| lines.len()).sum();
        self.curves.extend(found.into_iter().map(|(name, lines)| curve(name, lines)));
        Ok(taken)
    }

    /// Adds curves from a file: see [`Study::add_outside`].
    pub fn read_outside(&mut self, path: impl AsRef<Path>) -> Result<usize, OutsideError> {
        let path = path.as_ref();
        let text = std::fs::read_to_string(path)
            .map_err(|source| OutsideError::File { path: path.to_path_buf(), source })?;
        self.add_outside(&text)
    }

    /// Reads a line; `None` if it belongs to another problem.
    fn line(&self, text: &str) -> Result<Option<Line>, String> {
        let fields: Map<String, Value> = serde_json::from_str(text).map_err(|error| error.to_string())?;
        let field = |name: &str| fields.get(name);
        let of_text = |name: &str| match field(name) {
            Some(Value::String(text)) => Ok(text.clone()),
            _ => Err(format!("`{name}` is no text")),
        };
        // Which run the line is about.
        if of_text("problem")? != self.problem {
            return Ok(None);
        }
        let solver = of_text("solver")?;
        let tolerance = field("tolerance").and_then(Value::as_f64).filter(|tolerance| *tolerance > 0.0);
        let tolerance = tolerance.ok_or("`tolerance` is no number above 0")?;
        if field("failure").is_some() {
            return Ok(Some(Line { solver, tolerance, outcome: Err(of_text("failure")?) }));
        }
        // Its cost.
        let number = |name: &str| match field(name) {
            None | Some(Value::Null) => Ok(None),
            Some(value) => match value.as_f64() {
                Some(number) if number >= 0.0 => Ok(Some(number)),
                _ => Err(format!("`{name}` is no number of at least 0")),
            },
        };
        let time = number("time_us")?.filter(|time| *time > 0.0).ok_or("`time_us` is missing or 0")?;
        let time = Duration::try_from_secs_f64(time * 1e-6).map_err(|_| "`time_us` is too large")?;
        // Its errors, from the end if that is given.
        let end = match field("end") {
            None => None,
            Some(value) => {
                let list: Option<Vec<f64>> =
                    value.as_array().and_then(|list| list.iter().map(Value::as_f64).collect());
                Some(self.end_of(&list.ok_or("`end` is no list of numbers")?)?)
            }
        };
        let errors = match &end {
            Some(end) => end.errors(&self.reference.end),
            None => {
                let [positions, velocities, multipliers, energy] =
                    ["positions", "velocities", "multipliers", "energy"].map(number);
                Errors {
                    positions: positions?.ok_or("neither `end` nor `positions` is there")?,
                    velocities: velocities?.unwrap_or(f64::NAN),
                    multipliers: multipliers?,
                    energy: energy?.unwrap_or(f64::NAN),
                }
            }
        };
        let whole = |count: Option<f64>| count.map(|count| count as u64);
        let run = RunMeasurement {
            errors,
            time,
            repeats: whole(number("repeats")?).map(|count| count as usize),
            evaluations: whole(number("evaluations")?),
            steps: whole(number("steps")?),
            rejected: whole(number("rejected")?),
            stiff_at: None,
            end,
        };
        Ok(Some(Line { solver, tolerance, outcome: Ok(run) }))
    }

    /// The end with these coordinates and velocities, in one list.
    fn end_of(&self, values: &[f64]) -> Result<End, String> {
        let n = M::Vector::LEN;
        if values.len() != 2 * n {
            return Err(format!(
                "`end` has {} numbers; {n} coordinates and {n} velocities are needed",
                values.len()
            ));
        }
        let mut state =
            M::State::new(self.interval.1, M::Vector::zeros(), M::Vector::zeros(), *self.start.inputs());
        state.q_mut().as_mut_slice().copy_from_slice(&values[..n]);
        state.u_mut().as_mut_slice().copy_from_slice(&values[n..]);
        // The motion is that of the reference, and so are its inputs and active constraints at the end.
        state.inputs_mut().as_mut_slice().copy_from_slice(&self.reference.end.inputs);
        *state.active_set_mut() = self.reference.end.modes;
        Ok(End::of(self.model, &state))
    }
}

/// The lines of one solver, from coarse to fine, one per tolerance.
fn curve(name: String, mut lines: Vec<Line>) -> WorkPrecisionCurve {
    lines.sort_by(|a, b| b.tolerance.total_cmp(&a.tolerance));
    let mut points: Vec<Point> = Vec::new();
    for same in lines.chunk_by(|a, b| a.tolerance == b.tolerance) {
        let runs = || same.iter().filter_map(|line| line.outcome.as_ref().ok());
        let mut times: Vec<Duration> = runs().map(|run| run.time).collect();
        let outcome = match (runs().next(), median(&mut times)) {
            (Some(first), Some(time)) => Ok(RunMeasurement { time, ..first.clone() }),
            _ => same[0].outcome.clone(),
        };
        points.push(Point { setting: same[0].tolerance, outcome });
    }
    WorkPrecisionCurve { name, outside: true, is_default: false, adaptive: true, points }
}

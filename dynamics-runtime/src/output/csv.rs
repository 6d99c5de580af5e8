//! Motions as comma-separated values.
//!
//! The first line names the columns, with units where they are known: time, coordinates, velocities
//! (`theta1_rate`), accelerations (`theta1_acceleration`), multipliers of constraints (`lambda[closure.x]`),
//! inputs, outputs and the energy function. Numbers are the shortest that read back as the same value; what
//! does not exist (an acceleration at a singular mass matrix) is `NaN`. Fields with commas, quotes or line
//! ends are quoted after RFC 4180; lines end with a single line feed.

use alloc::string::String;
use alloc::vec::Vec;
use core::fmt::Write;

#[cfg(feature = "std")]
use dynamics_view::file::{self, Content, FileError};
use dynamics_view::{OutputError, text};

use crate::model::names::{self, Column};
use crate::model::{ModelState, StaticTraits, Vector};
use crate::simulate::{Motion, Simulate};

/// Relative rounding of a number of intervals, of very many intervals.
const RELATIVE_TIME_ROUNDING: f64 = 1e-12;
/// Rounding of a number of intervals in intervals.
const TIME_ROUNDING: f64 = 1e-9;

/// A motion as a table, from [`Motion::csv`].
///
/// A row for each requested output time of the simulation, or for each accepted step where none were
/// requested; with [`every`](Csv::every), at regular times.
pub struct Csv<'a, 'm, M: Simulate> {
    motion: &'a Motion<'m, M>,
    interval: Option<f64>,
}

impl<'m, M: Simulate> Motion<'m, M> {
    /// The motion as a table of comma-separated values.
    #[must_use]
    pub fn csv(&self) -> Csv<'_, 'm, M> {
        Csv { motion: self, interval: None }
    }

    /// Writes the motion as comma-separated values, a row for each requested output time or accepted step;
    /// makes the folders that the path needs. An error where the path has an extension other than `.csv` or
    /// `.txt`.
    #[cfg(feature = "std")]
    pub fn write_csv(&self, path: impl AsRef<std::path::Path>) -> Result<(), OutputError> {
        self.csv().write(path)
    }
}

impl<M: Simulate> Csv<'_, '_, M> {
    /// A row every `interval` of time from the start on, as long as the motion lasts.
    #[must_use]
    pub fn every(mut self, interval: f64) -> Self {
        self.interval = Some(interval);
        self
    }

    /// The table as text.
    pub fn to_text(&self) -> Result<String, OutputError> {
        let mut out = String::new();
        self.lines(|line| {
            out.push_str(line);
            Ok(())
        })?;
        Ok(out)
    }

    /// Writes the table.
    #[cfg(feature = "std")]
    pub fn write_to(&self, mut writer: impl std::io::Write) -> Result<(), OutputError> {
        self.lines(|line| writer.write_all(line.as_bytes()).map_err(OutputError::Stream))?;
        writer.flush().map_err(OutputError::Stream)
    }

    /// Writes the table to a file, `.csv`, `.txt` or without an extension, and makes the folders that its
    /// path needs.
    #[cfg(feature = "std")]
    pub fn write(&self, path: impl AsRef<std::path::Path>) -> Result<(), OutputError> {
        let path = path.as_ref();
        // Before the file is created: a wrong interval leaves an old file unchanged.
        self.times()?;
        let file = file::create(path, Content::Table)?;
        self.write_to(file).map_err(|error| match error {
            OutputError::Stream(source) => {
                OutputError::File(FileError { path: path.to_path_buf(), action: "write", source })
            }
            other => other,
        })
    }

    fn lines(&self, mut put: impl FnMut(&str) -> Result<(), OutputError>) -> Result<(), OutputError> {
        let mut line = String::new();
        put(&header::<M>())?;
        let mut row = |state: M::State| {
            line.clear();
            self.row(&state, &mut line);
            put(&line)
        };
        match self.times()? {
            Some(times) => self.motion.sample(times).try_for_each(&mut row),
            None => self.motion.states().try_for_each(&mut row),
        }
    }

    /// The regular times, or none where the motion's own are wanted.
    fn times(&self) -> Result<Option<impl Iterator<Item = f64> + use<M>>, OutputError> {
        let Some(interval) = self.interval else {
            return Ok(None);
        };
        let (start, end) = (self.motion.start_time(), self.motion.end_time());
        let advances = |t: f64| t + interval != t;
        if !(interval > 0.0 && interval.is_finite() && advances(start) && advances(end)) {
            return Err(OutputError::Interval { interval });
        }
        // The end is in the table in spite of rounding of the times.
        let intervals = (end - start).abs() / interval;
        let rows = libm::floor(intervals * (1.0 + RELATIVE_TIME_ROUNDING) + TIME_ROUNDING) as u64;
        let signed = if end < start { -interval } else { interval };
        let (lo, hi) = (start.min(end), start.max(end));
        Ok(Some((0..=rows).map(move |k| (start + k as f64 * signed).clamp(lo, hi))))
    }

    pub(super) fn row(&self, state: &M::State, line: &mut String) {
        let mut put = |value: f64| {
            if !line.is_empty() {
                line.push(',');
            }
            line.push_str(&text::exact(value));
        };
        put(state.t());
        let accelerations = self.motion.accelerations_of(state);
        let inputs = state.inputs().as_slice();
        // Without constraints there is nothing to solve.
        let multipliers =
            if M::IS_UNCONSTRAINED { M::Rows::zeros() } else { self.motion.multipliers_of(state) };
        let (a, lambda) = (accelerations.as_slice(), multipliers.as_slice());
        for values in [state.q().as_slice(), state.u().as_slice(), a, lambda, inputs] {
            values.iter().copied().for_each(&mut put);
        }
        self.motion.outputs_of(state).into_iter().for_each(&mut put);
        put(self.motion.model().energy_function(state));
        line.push('\n');
    }
}

pub(super) fn header<M: Simulate>() -> String {
    let mut columns: Vec<Column> = [names::time::<M>()].to_vec();
    columns.extend(names::coordinates::<M>());
    columns.extend(names::velocities::<M>());
    columns.extend(names::accelerations::<M>());
    columns.extend(names::multipliers::<M>());
    columns.extend(names::plain(M::INPUTS));
    columns.extend(names::plain(M::OUTPUTS));
    columns.push(names::energy::<M>());
    let mut line = String::new();
    for (k, Column { name, unit }) in columns.into_iter().enumerate() {
        if k > 0 {
            line.push(',');
        }
        let mut field = name;
        if !unit.is_empty() {
            let _ = write!(field, " [{unit}]");
        }
        line.push_str(&text::quoted(field));
    }
    line.push('\n');
    line
}

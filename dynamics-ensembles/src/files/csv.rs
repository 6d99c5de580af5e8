//! Comma-separated values, as sweeps write them: a line for each run, its inputs, what was kept, the reason
//! of a failure. Of a run that failed the kept fields are empty, of any other one the reason. Numbers are the
//! shortest that read back as the same value; fields are quoted after RFC 4180.

use std::fmt::Write;

use dynamics_view::text::quoted;

use crate::description::Description;
use crate::rows::{FailedRun, Rows};

/// The column with the reasons of failures.
pub(super) const REASON: &str = "error";

pub(super) fn head(description: &Description) -> Vec<u8> {
    let mut head = String::new();
    for column in &description.columns {
        head += &quoted(column.head());
        head.push(',');
    }
    head += REASON;
    head.push('\n');
    head.into_bytes()
}

pub(super) fn lines(description: &Description, rows: &Rows) -> Vec<u8> {
    let (width, inputs) = (description.columns.len(), description.inputs());
    // A number has 17 digits or fewer, a point and an exponent.
    let mut lines = String::with_capacity(rows.values.len() * 20);
    let mut failed = rows.failed.iter().peekable();
    for (row, run) in rows.values.chunks(width).zip(rows.runs.clone()) {
        let failure = failed.next_if(|failure| failure.run == run);
        for (k, value) in row.iter().enumerate() {
            if failure.is_none() || k < inputs {
                let _ = write!(lines, "{}", Shortest(*value));
            }
            lines.push(',');
        }
        if let Some(failure) = failure {
            lines += &quoted(failure.message.clone());
        }
        lines.push('\n');
    }
    lines.into_bytes()
}

/// A number as [`exact`](dynamics_view::text::exact) writes it, without a string of its own.
struct Shortest(f64);

impl std::fmt::Display for Shortest {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&dynamics_view::text::exact(self.0))
    }
}

/// The rows of a whole file.
pub(super) fn read(bytes: &[u8], description: &Description) -> Result<Rows, String> {
    let text = std::str::from_utf8(bytes).map_err(|_| "it is not UTF-8".to_owned())?;
    let (width, inputs) = (description.columns.len(), description.inputs());
    let lines = text.strip_prefix(&*String::from_utf8_lossy(&head(description)));
    let lines = lines.ok_or("its columns are not those of its plan")?;
    let mut rows = Rows::default();
    for (run, line) in lines.lines().enumerate() {
        let mut fields = line.splitn(width + 1, ',');
        for column in 0..width {
            let field = fields.next().ok_or_else(|| format!("the line of run {run} is cut off"))?;
            let is_kept = column >= inputs;
            rows.values.push(match field {
                "" if is_kept => f64::NAN,
                _ => field.parse().map_err(|_| format!("run {run} has `{field}` for a number"))?,
            });
        }
        match fields.next() {
            None => return Err(format!("the line of run {run} is cut off")),
            Some("") => {}
            Some(message) => {
                let inner = message.strip_prefix('"').and_then(|message| message.strip_suffix('"'));
                let message = inner.map_or(message.to_owned(), |inner| inner.replace("\"\"", "\""));
                rows.failed.push(FailedRun { run, message });
            }
        }
        rows.runs.end = run + 1;
    }
    if rows.runs.end != description.runs || !lines.ends_with('\n') {
        return Err(format!("it has {} of {} runs", rows.runs.end, description.runs));
    }
    Ok(rows)
}

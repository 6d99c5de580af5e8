//! Sweeps as comma-separated values.
//!
//! A row for each run: the values on the axes, the results, and the error. Of a run that failed the fields of
//! the results are empty, of any other run that of the error. Numbers are the shortest that read back as the
//! same value; fields are quoted after RFC 4180.

use alloc::format;
use alloc::string::String;
use core::fmt::Write;

use dynamics_view::file::{self, FileError};
use dynamics_view::text::{exact, quoted};

use super::Sweep;

impl<const K: usize> Sweep<K> {
    /// The table as text.
    #[must_use]
    pub fn to_csv(&self) -> String {
        let mut out = String::new();
        for axis in &self.axes {
            let unit = if axis.unit.is_empty() { String::new() } else { format!(" [{}]", axis.unit) };
            let _ = write!(out, "{},", quoted(format!("{}{unit}", axis.name)));
        }
        for name in &self.names {
            let _ = write!(out, "{},", quoted(name.clone()));
        }
        out.push_str("error\n");
        for (index, result) in self.results.iter().enumerate() {
            for value in self.at(index) {
                let _ = write!(out, "{},", exact(value));
            }
            match result {
                Ok(values) => values.iter().for_each(|value| {
                    let _ = write!(out, "{},", exact(*value));
                }),
                Err(failure) => {
                    self.names.iter().for_each(|_| out.push(','));
                    // The first line only; the state follows in further lines.
                    out.push_str(&quoted(failure.message.lines().next().unwrap_or_default().into()));
                }
            }
            out.push('\n');
        }
        out
    }

    /// Writes the table to a file and makes the folders that its path needs.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_csv(&self, path: impl AsRef<std::path::Path>) -> Result<(), FileError> {
        file::write(path.as_ref(), file::Content::Table, self.to_csv().as_bytes())
    }
}

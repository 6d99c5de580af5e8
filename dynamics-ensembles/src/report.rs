//! What an ensemble cost and found.

use std::path::PathBuf;
use std::time::Duration;

use crate::rows::FailedRun;

/// What an ensemble cost and found. It prints as a few lines.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EnsembleReport {
    /// Rows of the table.
    pub runs: usize,
    /// Runs that failed.
    pub failed: usize,
    /// The first of them.
    pub first_failure: Option<FailedRun>,
    /// Runs that were made now; the others were in files.
    pub made: usize,
    /// Blocks that were in files and damaged. They were made again.
    pub damaged_blocks: usize,
    /// How runs were made, and why.
    pub way: String,
    /// Where runs were made.
    pub place: String,
    /// The time that all took.
    pub time: Duration,
    /// The file or folder that has the rows.
    pub written_to: Option<PathBuf>,
    /// The file from which they were read.
    pub read_from: Option<PathBuf>,
}

impl std::fmt::Display for EnsembleReport {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { runs, failed, made, .. } = self;
        if let Some(path) = &self.read_from {
            writeln!(f, "runs         {runs}, read from `{}`", path.display())?;
        } else {
            write!(f, "runs         {runs}")?;
            if made < runs {
                write!(f, ", of which {} were in files", runs - made)?;
            }
            if self.damaged_blocks > 0 {
                write!(f, "; {} damaged blocks were made again", self.damaged_blocks)?;
            }
            let seconds = self.time.as_secs_f64();
            writeln!(f, "\ntime         {seconds:.2} s on {}", self.place)?;
            if *made > 0 && seconds > 0.0 {
                writeln!(f, "             {:.0} runs per second", *made as f64 / seconds)?;
            }
            writeln!(f, "way          {}", self.way)?;
        }
        match &self.first_failure {
            Some(FailedRun { run, message }) => {
                writeln!(f, "failed       {failed}, the first is run {run}: {message}")?;
            }
            None => writeln!(f, "failed       none")?,
        }
        if let Some(path) = &self.written_to {
            writeln!(f, "written to   `{}`", path.display())?;
        }
        Ok(())
    }
}

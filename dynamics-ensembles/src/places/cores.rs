//! The cores of this machine.

use super::{Job, Made, Place};
use crate::error::EnsembleError;

/// The cores of this machine: all with the feature `parallel`, or as many as are asked for. Without the
/// feature one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cores {
    threads: Option<usize>,
}

impl Cores {
    /// This many cores, at least one.
    #[cfg(feature = "parallel")]
    #[must_use]
    pub fn threads(count: usize) -> Self {
        Self { threads: Some(count.max(1)) }
    }
}

impl Place for Cores {
    fn name(&self) -> String {
        match self.threads.unwrap_or_else(dynamics_analysis::shared::cores) {
            1 => "one core".into(),
            cores => format!("{cores} cores"),
        }
    }

    fn is_divided(&self) -> bool {
        false
    }

    fn is_main(&self) -> bool {
        true
    }

    fn of_main(&self, value: u64) -> u64 {
        value
    }

    fn first_failed(&self, is_failed: bool) -> Option<usize> {
        is_failed.then_some(0)
    }

    fn make(&self, job: &Job<'_>) -> Result<Made, EnsembleError> {
        let missing = job.missing()?;
        let bar = job.bar(missing.runs, true);
        let in_memory = job.make_blocks(&missing.blocks, self.threads, &bar)?;
        Ok(Made { in_memory, made: missing.runs, damaged: missing.damaged })
    }
}

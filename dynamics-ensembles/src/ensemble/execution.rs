//! The course of an ensemble: what is there already, what is missing, the runs, the file.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use dynamics_runtime::model::Parameters;
use dynamics_runtime::simulate::Simulate;

use super::Ensemble;
use super::planning::{Planned, Rest};
use crate::assembly::{assemble, load_all};
use crate::blocks::Blocks;
use crate::error::EnsembleError;
use crate::files::FileFormat;
use crate::places::{Job, Made};
use crate::report::EnsembleReport;
use crate::shards;
use crate::table::EnsembleTable;

impl<M: Simulate + Parameters + Clone + Sync> Ensemble<'_, M> {
    /// Makes all runs that are not in files, and returns the table.
    ///
    /// # Errors
    /// Names that are unknown, values and options that cannot be, files that cannot be written or belong to
    /// another plan. A run that fails is a row with its reason, unless [`Ensemble::fail_fast`] is set.
    pub fn run(self) -> Result<EnsembleTable, EnsembleError> {
        let begun = Instant::now();
        let (planned, rest) = self.planned()?;
        let divided = rest.place.is_divided();
        let who = if divided { "running on several ranks" } else { "a shard" };
        if divided && rest.shard.is_some() {
            return Err(EnsembleError::ShardTwice { who });
        }
        let result = match rest.path.clone() {
            Some(path) => run_to(&planned, &rest, &path, begun),
            None if divided || rest.shard.is_some() => Err(EnsembleError::NoFile { who }),
            None => {
                let made = rest.place.make(&planned.job(&rest, None))?;
                let report = planned.report(&rest, &made, begun);
                Ok(EnsembleTable::new(planned.description.clone(), made.in_memory, report))
            }
        };
        result.map(|mut table| {
            table.report.time = begun.elapsed();
            table
        })
    }
}

/// Runs into a file, or into the folder of a shard.
fn run_to<M: Simulate + Parameters + Clone + Sync>(
    planned: &Planned<'_, M>,
    rest: &Rest<'_>,
    path: &Path,
    begun: Instant,
) -> Result<EnsembleTable, EnsembleError> {
    let place = &rest.place;
    let format = FileFormat::of(path)?;
    let folder = match rest.shard {
        Some((rank, ranks)) => shards::folder(path, rank, ranks),
        None => blocks_beside(path),
    };
    if rest.shard.is_none() {
        let there = place.is_main().then(|| complete(planned, format, path)).transpose();
        let is_there = place.of_main(u64::from(matches!(there, Ok(Some(true)))));
        place.all_or_none(there.map(|_| ()))?;
        if is_there == 1 {
            let blocks = Blocks::of_plan(folder, &planned.description, planned.partition);
            if place.is_main() && blocks.folder().exists() {
                // The program ended after the file was complete.
                blocks.remove()?;
            }
            return read(planned, format, path);
        }
    }
    let opened = Blocks::open(folder, &planned.description, planned.partition);
    let (blocks, opened) = match opened {
        Ok(blocks) => (Some(blocks), Ok(())),
        Err(error) => (None, Err(error)),
    };
    place.all_or_none(opened)?;
    // There are blocks, or the line above has returned.
    let Some(blocks) = blocks else { return Err(EnsembleError::NoFile { who: "an ensemble" }) };
    let job = planned.job(rest, Some(&blocks));
    let (made, done) = match place.make(&job) {
        Ok(made) => (made, Ok(())),
        Err(error) => (Made::default(), Err(error)),
    };
    place.all_or_none(done)?;
    let mut report = planned.report(rest, &made, begun);
    if rest.shard.is_some() {
        report.written_to = Some(blocks.folder().into());
        let parts = load_all(&blocks, &job.wanted)?;
        return Ok(EnsembleTable::new(planned.description.clone(), parts, report));
    }
    report.written_to = Some(path.into());
    let assembled = place.is_main().then(|| assemble(&blocks, path, &planned.description)).transpose();
    let (parts, assembled) = match assembled {
        Ok(parts) => (parts, Ok(())),
        Err(error) => (None, Err(error)),
    };
    place.all_or_none(assembled)?;
    match parts {
        Some(parts) => {
            blocks.remove()?;
            Ok(EnsembleTable::new(planned.description.clone(), parts, report))
        }
        // Another process has written it.
        None => read(planned, format, path),
    }
}

/// The folder with the blocks of a file.
fn blocks_beside(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".blocks");
    path.with_file_name(name)
}

/// Whether the file is complete; an error where it is that of another plan.
fn complete<M: Simulate>(
    planned: &Planned<'_, M>,
    format: FileFormat,
    path: &Path,
) -> Result<bool, EnsembleError> {
    let Some(there) = format.describe(path)? else { return Ok(false) };
    let differences = planned.description.plan.differences(&there.plan);
    if differences.is_empty() {
        return Ok(true);
    }
    Err(EnsembleError::OtherPlan { path: path.into(), differences })
}

/// The table of a file that is complete.
fn read<M: Simulate>(
    planned: &Planned<'_, M>,
    format: FileFormat,
    path: &Path,
) -> Result<EnsembleTable, EnsembleError> {
    let description = format.describe(path)?.unwrap_or_else(|| planned.description.clone());
    EnsembleTable::from_file(format, path, description)
}

impl<M: Simulate + Parameters + Clone + Sync> Planned<'_, M> {
    fn job<'j>(&'j self, rest: &Rest<'_>, blocks: Option<&'j Blocks>) -> Job<'j> {
        let (rank, ranks) = rest.shard.unwrap_or((0, 1));
        Job {
            maker: &self.runs,
            partition: self.partition,
            blocks,
            wanted: (rank..self.partition.blocks()).step_by(ranks).collect(),
            fail_fast: rest.fail_fast,
            progress: rest.progress,
            stopped: AtomicBool::new(false),
        }
    }

    fn report(&self, rest: &Rest<'_>, made: &Made, begun: Instant) -> EnsembleReport {
        EnsembleReport {
            made: made.made,
            damaged_blocks: made.damaged,
            way: match &self.runs.elsewhere {
                Some(place) => format!("{}{}", self.way, place.remark()),
                None => self.way.clone(),
            },
            place: rest.place.name(),
            time: begun.elapsed(),
            ..EnsembleReport::default()
        }
    }
}

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
use crate::description::Description;
use crate::error::EnsembleError;
use crate::files::FileFormat;
use crate::places::{Job, Made, agreed};
use crate::report::EnsembleReport;
use crate::shards;
use crate::table::EnsembleTable;

impl<M: Simulate + Parameters + Clone + Sync> Ensemble<'_, M> {
    /// Makes all runs that are not in files, and returns the table.
    ///
    /// # Errors
    /// Names that are unknown, values and options that cannot be, files that cannot be written or belong to
    /// another plan. A run that fails is a row with its reason, unless [`Ensemble::fail_fast`] is set.
    pub fn run(mut self) -> Result<EnsembleTable, EnsembleError> {
        let begun = Instant::now();
        let mut rest = self.rest();
        let planned = self.planned(&mut rest);
        let planned = agreed(&*rest.place, planned)?;
        let result = match rest.path.clone() {
            Some(path) => run_to(&planned, &rest, &path, begun),
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
    let place = &*rest.place;
    let format = FileFormat::of(path)?;
    let description = &planned.description;
    let folder = match rest.shard {
        Some((rank, ranks)) => shards::folder(path, rank, ranks),
        None => blocks_beside(path),
    };
    let blocks = Blocks::of_plan(folder, description, planned.partition);
    let job = planned.job(rest, Some(&blocks));
    if rest.shard.is_none() {
        let is_there = match place.is_main() {
            true => format.is_there(path, &description.plan),
            false => Ok(false),
        };
        let is_there = agreed(place, is_there)?;
        if place.of_main(u64::from(is_there)) == 1 {
            let table = read(description, format, path).and_then(|table| {
                table.parts.iter().try_for_each(|rows| job.check(rows, path))?;
                Ok(table)
            });
            let table = agreed(place, table)?;
            if place.is_main() {
                remove(&blocks, description);
            }
            return Ok(table);
        }
    }
    // The others look at the plan only when it has been written.
    let opened = if place.is_main() { blocks.open(description) } else { Ok(()) };
    agreed(place, opened)?;
    let is_same = place.of_main(blocks.digest()) == blocks.digest();
    agreed(place, if is_same { Ok(()) } else { Err(blocks.of_other_plan(description)) })?;
    let made = agreed(place, place.make(&job))?;
    let mut report = planned.report(rest, &made, begun);
    if rest.shard.is_some() {
        report.written_to = Some(blocks.folder().into());
        let parts = load_all(&blocks, &job.wanted)?;
        return Ok(EnsembleTable::new(description.clone(), parts, report));
    }
    report.written_to = Some(path.into());
    let assembled = place.is_main().then(|| assemble(&blocks, path, description)).transpose();
    let table = match agreed(place, assembled)? {
        Some(parts) => {
            remove(&blocks, description);
            Ok(EnsembleTable::new(description.clone(), parts, report))
        }
        // Rank 0 has written it.
        None => read(description, format, path),
    };
    agreed(place, table)
}

/// Removes the blocks of a file that is complete. Where that fails nothing is lost: the next call, which
/// reads the file, tries again.
fn remove(blocks: &Blocks, description: &Description) {
    let _ = blocks.remove_if_ours(description);
}

/// The folder with the blocks of a file.
fn blocks_beside(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".blocks");
    path.with_file_name(name)
}

/// The table of a file, which must be that of the plan.
fn read(description: &Description, format: FileFormat, path: &Path) -> Result<EnsembleTable, EnsembleError> {
    match format.is_there(path, &description.plan)? {
        true => EnsembleTable::read(path),
        false => {
            let problem = "it was there a moment ago; run the ensemble again".into();
            Err(EnsembleError::Unreadable { path: path.into(), problem })
        }
    }
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

//! Shards: parts of an ensemble that were made apart, each in a folder of its own, and their union.

use std::path::{Path, PathBuf};

use crate::assembly::{load, write_in_order};
use crate::blocks::{Blocks, Found};
use crate::error::EnsembleError;
use crate::files::FileFormat;
use crate::report::EnsembleReport;
use crate::rows::Rows;
use crate::table::EnsembleTable;

/// The folder of a shard: `flips.csv.3-of-16`.
pub(crate) fn folder(path: &Path, rank: usize, ranks: usize) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{rank}-of-{ranks}"));
    path.with_file_name(name)
}

/// What shards have in common, found by [`merge`].
#[derive(Clone, Debug)]
pub struct Merged {
    /// The table of all runs.
    pub table: EnsembleTable,
    /// Runs that several folders have, as intervals of first and last: they are the same there.
    pub overlaps: Vec<(usize, usize)>,
}

/// Joins the shards of an ensemble that lie beside each other, as [`Ensemble::shard`](crate::Ensemble::shard)
/// leaves them, to the file that one run would have written, byte for byte. The folders stay.
///
/// # Errors
/// As of [`merge`]; shards that are missing are named.
pub fn merge_shards(path: impl AsRef<Path>, ranks: usize) -> Result<Merged, EnsembleError> {
    let path = path.as_ref();
    let folders: Vec<PathBuf> = (0..ranks).map(|rank| folder(path, rank, ranks)).collect();
    let there: Vec<&PathBuf> = folders.iter().filter(|folder| folder.exists()).collect();
    if there.is_empty() {
        let problem =
            format!("there is no folder `{}`, nor one of another shard", folder(path, 0, ranks).display());
        return Err(EnsembleError::Unreadable { path: path.into(), problem });
    }
    join(&there, path, Some(ranks))
}

/// Joins folders of blocks, of shards or of a run that was ended, to the file that one run would have
/// written, byte for byte. The folders stay.
///
/// # Errors
/// Folders of different plans, which are told apart by what differs; runs that no folder has; common runs
/// that differ; files that cannot be read or written; a file that is there already with other runs.
pub fn merge<P: AsRef<Path>>(
    folders: impl IntoIterator<Item = P>,
    to: impl AsRef<Path>,
) -> Result<Merged, EnsembleError> {
    let folders: Vec<P> = folders.into_iter().collect();
    join(&folders, to.as_ref(), None)
}

fn join<P: AsRef<Path>>(folders: &[P], to: &Path, ranks: Option<usize>) -> Result<Merged, EnsembleError> {
    FileFormat::of(to)?;
    let Some(first) = folders.first() else {
        let problem = "no folder of a shard was given".into();
        return Err(EnsembleError::Unreadable { path: to.into(), problem });
    };
    let no_plan = |folder: &Path| EnsembleError::Unreadable {
        path: folder.into(),
        problem: "it is not a folder of blocks: it has no `plan.txt`".into(),
    };
    let description = Blocks::described(first.as_ref())?.ok_or_else(|| no_plan(first.as_ref()))?;
    let partition = description.plan.partition().ok_or_else(|| no_plan(first.as_ref()))?;
    let mut shards = Vec::new();
    for folder in folders.iter().map(AsRef::as_ref) {
        let there = Blocks::described(folder)?.ok_or_else(|| no_plan(folder))?;
        let differences = description.plan.differences(&there.plan);
        if !differences.is_empty() {
            return Err(EnsembleError::OtherPlan { path: folder.into(), differences });
        }
        shards.push(Blocks::of_plan(folder.into(), &description, partition));
    }
    let Sources { of_block, overlaps } = sources(&shards, ranks)?;
    let rows_of = |block: usize| load(&shards[of_block[block]], block);
    let rows = write_in_order(to, None, &description, of_block.len(), rows_of)?;
    let report = EnsembleReport {
        way: format!("joined from {} folders", shards.len()),
        place: "one machine".into(),
        written_to: Some(to.into()),
        ..EnsembleReport::default()
    };
    Ok(Merged { table: EnsembleTable::new(description, rows, report), overlaps })
}

/// Which shard has which block.
struct Sources {
    of_block: Vec<usize>,
    overlaps: Vec<(usize, usize)>,
}

/// Finds every block, and compares those that several shards have.
fn sources(shards: &[Blocks], ranks: Option<usize>) -> Result<Sources, EnsembleError> {
    let partition = shards[0].partition();
    let (mut of_block, mut overlaps, mut gaps) = (Vec::new(), Vec::new(), Vec::new());
    for block in 0..partition.blocks() {
        let runs = partition.runs_of(block);
        let runs = (runs.start, runs.end - 1);
        let mut found: Option<(usize, Rows)> = None;
        for (shard, blocks) in shards.iter().enumerate() {
            let Found::Rows(rows) = blocks.load(block)? else { continue };
            match &found {
                None => found = Some((shard, rows)),
                Some((_, known)) if rows.has_bits_of(known) => overlaps.push(runs),
                Some((other, _)) => {
                    let folders = [*other, shard].map(|shard| shards[shard].folder().into());
                    return Err(EnsembleError::Overlap { runs, folders });
                }
            }
        }
        match found {
            Some((shard, _)) => of_block.push(shard),
            None => gaps.push((block, runs)),
        }
    }
    if gaps.is_empty() {
        return Ok(Sources { of_block, overlaps: joined(overlaps) });
    }
    let mut missing: Vec<usize> =
        ranks.iter().flat_map(|ranks| gaps.iter().map(move |(k, _)| k % ranks)).collect();
    missing.sort_unstable();
    missing.dedup();
    let shards = missing.iter().map(|rank| format!("shard {rank} of {}", ranks.unwrap_or(0))).collect();
    Err(EnsembleError::Gaps { runs: joined(gaps.into_iter().map(|(_, runs)| runs).collect()), shards })
}

/// Intervals, with those that follow each other joined.
fn joined(intervals: Vec<(usize, usize)>) -> Vec<(usize, usize)> {
    let mut joined: Vec<(usize, usize)> = Vec::new();
    for (first, last) in intervals {
        match joined.last_mut() {
            Some((_, end)) if *end + 1 >= first => *end = last.max(*end),
            _ => joined.push((first, last)),
        }
    }
    joined
}

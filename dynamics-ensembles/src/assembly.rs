//! From blocks to one file, in the order of the runs.

use std::path::Path;

use dynamics_analysis::shared::shared;

use crate::blocks::{Blocks, Found};
use crate::description::Description;
use crate::error::EnsembleError;
use crate::files::{Encoded, FileFormat, TableWriter};
use crate::rows::Rows;

/// Blocks that are read and encoded at once, by all cores. Files with groups of rows have one for each of
/// these, so it is part of the format.
const BLOCKS_AT_ONCE: usize = 64;

/// The rows of a block that has to be there.
pub(crate) fn load(blocks: &Blocks, block: usize) -> Result<Rows, EnsembleError> {
    match blocks.load(block)? {
        Found::Rows(rows) => Ok(rows),
        Found::Nothing | Found::Damaged => {
            let problem = format!("block {block} is no longer there; run the ensemble again");
            Err(EnsembleError::Unreadable { path: blocks.folder().into(), problem })
        }
    }
}

/// The rows of some blocks.
pub(crate) fn load_all(blocks: &Blocks, wanted: &[usize]) -> Result<Vec<Rows>, EnsembleError> {
    wanted.iter().map(|block| load(blocks, *block)).collect()
}

/// Writes all blocks to a file, and returns their rows.
pub(crate) fn assemble(
    blocks: &Blocks,
    path: &Path,
    description: &Description,
) -> Result<Vec<Rows>, EnsembleError> {
    let count = blocks.partition().blocks();
    write_in_order(path, Some(blocks.folder()), description, count, |block| load(blocks, block))
}

/// Writes `count` blocks to a file in their order, wherever they come from, and returns their rows. Until the
/// file is complete it lies in `folder`, or beside its place.
pub(crate) fn write_in_order(
    path: &Path,
    folder: Option<&Path>,
    description: &Description,
    count: usize,
    rows_of: impl Fn(usize) -> Result<Rows, EnsembleError> + Sync,
) -> Result<Vec<Rows>, EnsembleError> {
    let format = FileFormat::of(path)?;
    let mut writer = TableWriter::create(path, folder, description.clone())?;
    let mut all = Vec::with_capacity(count);
    for first in (0..count).step_by(BLOCKS_AT_ONCE) {
        let encoded = |place: usize| -> Result<(Rows, Encoded), EnsembleError> {
            let rows = rows_of(first + place)?;
            let encoded = format.encode(description, &rows);
            Ok((rows, encoded))
        };
        let at_once = BLOCKS_AT_ONCE.min(count - first);
        for part in shared(at_once, None, encoded).map_err(EnsembleError::Threads)? {
            let (rows, encoded) = part?;
            writer.add(encoded)?;
            all.push(rows);
        }
        writer.end_group()?;
    }
    writer.finish()?;
    Ok(all)
}

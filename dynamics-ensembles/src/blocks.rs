//! The folder of blocks: what has been computed, one file for each block of consecutive runs.
//!
//! A file of a block is complete or absent: it is written under another name and then renamed. It names its
//! plan and has a check sum, so a file that is damaged or of another plan is never taken for rows. Two
//! processes that compute the same block write the same bytes.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use dynamics_view::file::FileError;

use crate::description::Description;
use crate::error::EnsembleError;
use crate::hash::of_bytes;
use crate::plan::{Partition, PlanDifference};
use crate::rows::{FailedRun, Rows};
use crate::whole_file::{PART, write_whole};

/// The first bytes of every block.
const MAGIC: &[u8; 16] = b"dynamics block 1";
/// The name of the plan in the folder.
const PLAN: &str = "plan.txt";
/// The ending of blocks.
const ENDING: &str = "block";

/// A folder of blocks of one plan.
#[derive(Clone, Debug)]
pub(crate) struct Blocks {
    folder: PathBuf,
    digest: u64,
    width: usize,
    partition: Partition,
}

/// What a file of a block is.
pub(crate) enum Found {
    Nothing,
    Damaged,
    Rows(Rows),
}

impl Blocks {
    /// Begins the folder, or goes on in an existing one with the same plan.
    pub(crate) fn open(&self, description: &Description) -> Result<(), EnsembleError> {
        match Self::described(&self.folder)? {
            Some(there) => match description.plan.differences(&there.plan) {
                none if none.is_empty() => Ok(()),
                differences => Err(EnsembleError::OtherPlan { path: self.folder.clone(), differences }),
            },
            None => {
                let failed = |action, path: &Path| {
                    let path = path.to_path_buf();
                    move |source| FileError { path, action, source }
                };
                fs::create_dir_all(&self.folder).map_err(failed("create the folder", &self.folder))?;
                let path = self.folder.join(PLAN);
                let text = description.to_text();
                write_whole(&path, &self.folder, text.as_bytes()).map_err(failed("write", &path))?;
                Ok(())
            }
        }
    }

    /// The error of a rank whose plan is not that of rank 0, which has begun the folder.
    pub(crate) fn of_other_plan(&self, description: &Description) -> EnsembleError {
        let there = Self::described(&self.folder).ok().flatten().unwrap_or_default();
        let differences = description.plan.differences(&there.plan);
        EnsembleError::OtherPlan { path: self.folder.clone(), differences }
    }

    pub(crate) fn digest(&self) -> u64 {
        self.digest
    }

    /// The blocks of a folder whose plan is known.
    pub(crate) fn of_plan(folder: PathBuf, description: &Description, partition: Partition) -> Self {
        let Description { plan, columns, .. } = description;
        Self { folder, digest: plan.digest(), width: columns.len(), partition }
    }

    /// The plan and the columns of a folder, if it has them.
    pub(crate) fn described(folder: &Path) -> Result<Option<Description>, EnsembleError> {
        let path = folder.join(PLAN);
        match fs::read_to_string(&path) {
            // One that was cut off is none: it is written again.
            Ok(text) => Ok(Description::from_text(&text)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(EnsembleError::Unreadable { path, problem: error.to_string() }),
        }
    }

    pub(crate) fn folder(&self) -> &Path {
        &self.folder
    }

    pub(crate) fn partition(&self) -> Partition {
        self.partition
    }

    fn path(&self, block: usize) -> PathBuf {
        self.folder.join(format!("{block:09}.{ENDING}"))
    }

    /// Writes a block.
    pub(crate) fn save(&self, block: usize, rows: &Rows) -> Result<(), EnsembleError> {
        let path = self.path(block);
        let bytes = self.to_bytes(block, rows);
        write_whole(&path, &self.folder, &bytes)
            .map_err(|source| FileError { path, action: "write", source }.into())
    }

    /// Reads a block.
    pub(crate) fn load(&self, block: usize) -> Result<Found, EnsembleError> {
        let path = self.path(block);
        match fs::read(&path) {
            Ok(bytes) => match self.plan_of(&bytes) {
                Some(there) if there != self.digest => {
                    let text = |digest: u64| Some(format!("the one with digest {digest:016x}"));
                    let (name, here) = ("plan".into(), text(self.digest));
                    let differences = vec![PlanDifference { name, there: text(there), here }];
                    Err(EnsembleError::OtherPlan { path, differences })
                }
                _ => Ok(self.rows_in(block, &bytes).map_or(Found::Damaged, Found::Rows)),
            },
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Found::Nothing),
            Err(error) => Err(EnsembleError::Unreadable { path, problem: error.to_string() }),
        }
    }

    /// Removes the folder of a table that is complete. One of another plan stays: its runs are in no other
    /// file.
    pub(crate) fn remove_if_ours(&self, description: &Description) -> Result<(), EnsembleError> {
        match Self::described(&self.folder)? {
            Some(there) if description.plan.differences(&there.plan).is_empty() => self.remove(),
            Some(_) => Ok(()),
            None => {
                // The plan goes last, so a folder without one is empty, or not ours.
                let _ = fs::remove_dir(&self.folder);
                Ok(())
            }
        }
    }

    /// Removes the folder with what this crate wrote into it, the plan last.
    fn remove(&self) -> Result<(), EnsembleError> {
        let failed = |source| FileError { path: self.folder.clone(), action: "remove", source };
        for entry in fs::read_dir(&self.folder).map_err(failed)? {
            let path = entry.map_err(failed)?.path();
            if path.extension().is_some_and(|of| of == ENDING || of == PART) {
                fs::remove_file(path).map_err(failed)?;
            }
        }
        fs::remove_file(self.folder.join(PLAN)).map_err(failed)?;
        // What a user has put there stays, and the folder with it.
        let _ = fs::remove_dir(&self.folder);
        Ok(())
    }

    /// Head, rows, failures, check sum; all numbers with their lowest byte first.
    fn to_bytes(&self, block: usize, rows: &Rows) -> Vec<u8> {
        let head = [self.digest, block as u64, self.width as u64, rows.failed.len() as u64];
        let mut bytes = Vec::with_capacity(64 + 8 * rows.values.len());
        bytes.extend_from_slice(MAGIC);
        head.iter().for_each(|word| bytes.extend_from_slice(&word.to_le_bytes()));
        rows.values.iter().for_each(|x| bytes.extend_from_slice(&x.to_le_bytes()));
        for FailedRun { run, message } in &rows.failed {
            bytes.extend_from_slice(&(*run as u64).to_le_bytes());
            bytes.extend_from_slice(&(message.len() as u64).to_le_bytes());
            bytes.extend_from_slice(message.as_bytes());
        }
        let sum = of_bytes(&bytes);
        bytes.extend_from_slice(&sum.to_le_bytes());
        bytes
    }

    /// The digest of the plan of a block; `None` if it is damaged.
    fn plan_of(&self, bytes: &[u8]) -> Option<u64> {
        let (content, sum) = bytes.split_last_chunk::<8>()?;
        let mut reader = Reader(content);
        let is_whole = of_bytes(content) == u64::from_le_bytes(*sum) && reader.take(MAGIC.len())? == MAGIC;
        is_whole.then(|| reader.word())?
    }

    /// The rows of a block; `None` if the bytes are not this block of this plan.
    fn rows_in(&self, block: usize, bytes: &[u8]) -> Option<Rows> {
        let (content, sum) = bytes.split_last_chunk::<8>()?;
        if of_bytes(content) != u64::from_le_bytes(*sum) {
            return None;
        }
        let mut reader = Reader(content);
        let is_ours = reader.take(MAGIC.len())? == MAGIC
            && reader.word()? == self.digest
            && reader.word()? == block as u64
            && reader.word()? == self.width as u64;
        let failures = reader.word()?;
        let runs = self.partition.runs_of(block);
        if !is_ours {
            return None;
        }
        let (numbers, _) = reader.take(8 * self.width * runs.len())?.as_chunks::<8>();
        let values = numbers.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
        let mut failed = Vec::new();
        for _ in 0..failures {
            let run = reader.word()? as usize;
            let length = reader.word()? as usize;
            failed.push(FailedRun { run, message: String::from_utf8(reader.take(length)?.into()).ok()? });
        }
        reader.0.is_empty().then_some(Rows { runs, values, failed })
    }
}

/// Bytes that have not been read.
struct Reader<'b>(&'b [u8]);

impl<'b> Reader<'b> {
    fn take(&mut self, count: usize) -> Option<&'b [u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    fn word(&mut self) -> Option<u64> {
        let (word, rest) = self.0.split_first_chunk::<8>()?;
        self.0 = rest;
        Some(u64::from_le_bytes(*word))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn blocks() -> (Blocks, Rows) {
        let partition = Partition { runs: 7, block: 4 };
        let blocks = Blocks { folder: PathBuf::new(), digest: 42, width: 2, partition };
        let failed = vec![FailedRun { run: 5, message: "it broke".into() }];
        let values = vec![1.0, 2.0, 3.0, f64::NAN, 5.0, -0.0];
        (blocks, Rows { runs: 4..7, values, failed })
    }

    #[test]
    fn blocks_read_back() {
        let (blocks, rows) = blocks();
        let read = blocks.rows_in(1, &blocks.to_bytes(1, &rows)).unwrap();
        let bits = |rows: &Rows| rows.values.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!((bits(&read), &read.runs, &read.failed), (bits(&rows), &rows.runs, &rows.failed));
    }

    /// Cut off anywhere, changed anywhere, another block or another plan: never taken for rows.
    #[test]
    fn damaged_blocks_are_not_taken_for_rows() {
        let (blocks, rows) = blocks();
        let bytes = blocks.to_bytes(1, &rows);
        for length in 0..bytes.len() {
            assert!(blocks.rows_in(1, &bytes[..length]).is_none(), "{length}");
        }
        for place in 0..bytes.len() {
            let mut changed = bytes.clone();
            changed[place] ^= 16;
            assert!(blocks.rows_in(1, &changed).is_none(), "{place}");
        }
        assert!(blocks.rows_in(0, &bytes).is_none());
        let other = Blocks { digest: 43, ..blocks };
        assert!(other.rows_in(1, &bytes).is_none());
        // Another plan is told from damage.
        assert_eq!((other.plan_of(&bytes), other.plan_of(&bytes[1..])), (Some(42), None));
    }
}

//! Where the runs are made. Files and their order do not depend on it; results depend on it only where the
//! plan says so, for graphics cards.

#[cfg(any(feature = "cuda", feature = "wgpu"))]
mod cards;
mod cores;
#[cfg(feature = "mpi")]
mod mpi;

pub use cores::Cores;
#[cfg(feature = "mpi")]
pub use mpi::Mpi;

use std::ops::Range;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use dynamics_analysis::shared::{ProgressBar, cores as all_cores, shared, side_by_side_length};
use dynamics_runtime::simulate::{Simulate, Simulation, SimulationError};

use crate::blocks::{Blocks, Found};
use crate::error::EnsembleError;
use crate::plan::{Partition, PlanDifference};
use crate::rows::Rows;

/// Where an ensemble runs: [`Cores`], or, with the feature `mpi`, the ranks of MPI.
pub trait Place {
    /// Its name, in summaries.
    #[doc(hidden)]
    fn name(&self) -> String;
    /// Whether it divides the runs between processes.
    #[doc(hidden)]
    fn is_divided(&self) -> bool;
    /// Whether this process writes the file and shows progress.
    #[doc(hidden)]
    fn is_main(&self) -> bool;
    /// The value of the main process, in all processes.
    #[doc(hidden)]
    fn of_main(&self, value: u64) -> u64;
    /// The first process that reports a failure, in all processes. All of them have to call it.
    #[doc(hidden)]
    fn first_failed(&self, is_failed: bool) -> Option<usize>;
    /// Makes the blocks of a job that are missing.
    #[doc(hidden)]
    fn make(&self, job: &Job<'_>) -> Result<Made, EnsembleError>;
}

/// A result in all processes, or an error in all of them if there is one in any: none waits for another that
/// has returned.
pub(crate) fn agreed<T>(place: &dyn Place, result: Result<T, EnsembleError>) -> Result<T, EnsembleError> {
    match (place.first_failed(result.is_err()), result) {
        (Some(rank), Ok(_)) => Err(EnsembleError::Rank { rank }),
        (_, result) => result,
    }
}

/// Where an ensemble of a model runs: a [`Place`]; with the features `cuda` and `wgpu` a card, or the result
/// of looking for one.
pub trait PlaceFor<M: Simulate> {
    /// The place, and what makes ends there in place of the lanes of the processor.
    #[doc(hidden)]
    fn opened<'p>(self) -> Opened<'p, M>
    where
        Self: 'p;
}

/// A place that was opened for a model.
#[doc(hidden)]
pub struct Opened<'p, M: Simulate> {
    pub(crate) place: Box<dyn Place + 'p>,
    pub(crate) elsewhere: Option<Box<dyn EndsElsewhere<M> + 'p>>,
}

impl<M: Simulate, P: Place> PlaceFor<M> for P {
    fn opened<'p>(self) -> Opened<'p, M>
    where
        Self: 'p,
    {
        Opened { place: Box::new(self), elsewhere: None }
    }
}

/// Ends in the order of their runs.
pub(crate) type Ends<M> = Vec<Result<<M as dynamics_runtime::model::Model>::State, SimulationError<M>>>;

/// What makes ends in place of the lanes of the processor.
pub(crate) trait EndsElsewhere<M: Simulate>: Sync {
    /// The ends of so many runs, in order.
    fn ends<'a>(
        &self,
        count: usize,
        run: &dyn Fn(usize) -> Simulation<'a, M>,
    ) -> Result<Ends<M>, EnsembleError>
    where
        M: 'a;
    /// On what the last digits depend, as part of the plan.
    fn way(&self) -> String;
    /// What is known of the runs that were made, for the report.
    fn remark(&self) -> String;
}

/// What makes the rows of runs.
pub(crate) trait MakesRows: Sync {
    /// The rows of some runs. They do not depend on which others are asked for at the same time.
    ///
    /// # Errors
    /// What makes the runs fails as a whole.
    fn rows(&self, runs: Range<usize>) -> Result<Rows, EnsembleError>;
    /// Writes the inputs of a run to the first columns of a row.
    fn inputs(&self, run: usize, row: &mut [f64]);
    /// Whether runs are made side by side, so that a core should make many at once.
    fn is_in_lanes(&self) -> bool;
}

/// The runs to be made.
#[doc(hidden)]
pub struct Job<'j> {
    pub(crate) maker: &'j dyn MakesRows,
    pub(crate) partition: Partition,
    /// Where blocks are kept; `None`: in memory.
    pub(crate) blocks: Option<&'j Blocks>,
    /// The blocks of this shard.
    pub(crate) wanted: Vec<usize>,
    pub(crate) fail_fast: bool,
    pub(crate) progress: bool,
    /// Set where no further runs are to be made.
    pub(crate) stopped: AtomicBool,
}

/// What a place has made.
#[doc(hidden)]
#[derive(Default)]
pub struct Made {
    /// The blocks, where they are not in files.
    pub(crate) in_memory: Vec<Rows>,
    /// Runs that were made now.
    pub(crate) made: usize,
    /// Blocks that were there and damaged.
    pub(crate) damaged: usize,
}

/// Blocks that have to be made.
pub(crate) struct Missing {
    pub(crate) blocks: Vec<usize>,
    pub(crate) runs: usize,
    pub(crate) damaged: usize,
}

impl Job<'_> {
    /// The blocks that no file has.
    pub(crate) fn missing(&self) -> Result<Missing, EnsembleError> {
        let (mut blocks, mut damaged) = (Vec::new(), 0);
        for block in &self.wanted {
            if let Some(of) = self.blocks {
                match of.load(*block)? {
                    Found::Rows(rows) => {
                        self.check(&rows, of.folder())?;
                        continue;
                    }
                    Found::Nothing => {}
                    Found::Damaged => damaged += 1,
                }
            }
            blocks.push(*block);
        }
        let runs = blocks.iter().map(|block| self.partition.runs_of(*block).len()).sum();
        Ok(Missing { blocks, runs, damaged })
    }

    /// Checks rows that are in files: their inputs must be those of this ensemble at the first, the middle
    /// and the last run of each block, since a plan may say little of a closure that makes them. With
    /// `.fail_fast()` a failure among them is an error, as if it were made now.
    pub(crate) fn check(&self, rows: &Rows, path: &Path) -> Result<(), EnsembleError> {
        let width = rows.values.len() / rows.runs.len().max(1);
        for block in rows.runs.start / self.partition.block..rows.runs.end.div_ceil(self.partition.block) {
            let runs = self.partition.runs_of(block);
            for run in [runs.start, runs.start + runs.len() / 2, runs.end - 1] {
                let row = rows.values.chunks(width).nth(run - rows.runs.start);
                row.map_or(Ok(()), |row| self.check_inputs(run, row, path))?;
            }
        }
        rows.failed.first().filter(|_| self.fail_fast).map_or(Ok(()), |failed| Err(failed.clone().into()))
    }

    fn check_inputs(&self, run: usize, row: &[f64], path: &Path) -> Result<(), EnsembleError> {
        let mut here = row.to_vec();
        self.maker.inputs(run, &mut here);
        let differs =
            |k: &usize| here[*k].to_bits() != row[*k].to_bits() && !(here[*k].is_nan() && row[*k].is_nan());
        let Some(k) = (0..row.len()).find(differs) else { return Ok(()) };
        let text = |row: &[f64]| Some(dynamics_view::text::exact(row[k]));
        let name = format!("input {k} of run {run}");
        let differences = vec![PlanDifference { name, there: text(row), here: text(&here) }];
        Err(EnsembleError::OtherPlan { path: path.into(), differences })
    }

    /// A bar for these runs, if this process shows one.
    pub(crate) fn bar(&self, runs: usize, is_main: bool) -> ProgressBar {
        ProgressBar::new(runs, self.progress && is_main)
    }

    /// Makes some blocks with several cores. Returns those that are not in files.
    pub(crate) fn make_blocks(
        &self,
        blocks: &[usize],
        threads: Option<usize>,
        bar: &ProgressBar,
    ) -> Result<Vec<Rows>, EnsembleError> {
        /// Blocks of each core, above which blocks are not divided between cores.
        const BLOCKS_OF_CORE: usize = 4;
        let cores = threads.unwrap_or_else(all_cores);
        let is_divided = cores > 1 && blocks.len() < BLOCKS_OF_CORE * cores;
        let length = match self.maker.is_in_lanes() {
            // Each run alone, so that progress is shown after each.
            false => 1,
            true if is_divided => {
                let runs = blocks.iter().map(|block| self.partition.runs_of(*block).len()).sum();
                side_by_side_length(runs, threads)
            }
            true => self.partition.block,
        };
        let one = |place: usize| self.make_block(blocks[place], length, is_divided, bar);
        let made = match cores {
            1 => (0..blocks.len()).map(one).collect(),
            _ => shared(blocks.len(), threads, one).map_err(EnsembleError::Threads)?,
        };
        let made = made.into_iter().collect::<Result<Vec<_>, _>>()?;
        Ok(made.into_iter().flatten().collect())
    }

    /// Makes blocks that follow each other, all of their runs at once. Returns those that are not in files.
    #[cfg(any(feature = "cuda", feature = "wgpu"))]
    pub(crate) fn make_together(
        &self,
        blocks: Range<usize>,
        bar: &ProgressBar,
    ) -> Result<Vec<Rows>, EnsembleError> {
        let runs_of = |block: usize| self.partition.runs_of(block);
        let (Some(first), Some(last)) = (blocks.clone().next(), blocks.clone().next_back()) else {
            return Ok(Vec::new());
        };
        let Some(rows) = self.make_runs(runs_of(first).start..runs_of(last).end, bar)? else {
            return Ok(Vec::new());
        };
        let parts = blocks.map(|block| self.kept(block, rows.part(runs_of(block))));
        Ok(parts.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect())
    }

    /// Saves a block. Returns it if it is kept in memory.
    fn kept(&self, block: usize, rows: Rows) -> Result<Option<Rows>, EnsembleError> {
        let Some(blocks) = self.blocks else { return Ok(Some(rows)) };
        let saved = blocks.save(block, &rows);
        if saved.is_err() {
            self.stopped.store(true, Ordering::Relaxed);
        }
        saved.map(|()| None)
    }

    /// Makes a block, this many runs at once. If it is divided, cores that have nothing else to do help.
    fn make_block(
        &self,
        block: usize,
        length: usize,
        is_divided: bool,
        bar: &ProgressBar,
    ) -> Result<Option<Rows>, EnsembleError> {
        let runs = self.partition.runs_of(block);
        let part = |k: usize| {
            let from = runs.start + k * length;
            self.make_runs(from..(from + length).min(runs.end), bar)
        };
        let parts = runs.len().div_ceil(length);
        let parts = match is_divided {
            true => shared(parts, None, part).map_err(EnsembleError::Threads)?,
            false => (0..parts).map(part).collect(),
        };
        let mut rows = Rows { runs: runs.start..runs.start, ..Rows::default() };
        for part in parts {
            match part? {
                Some(part) => rows.append(part),
                // Another block has failed.
                None => return Ok(None),
            }
        }
        self.kept(block, rows)
    }

    /// The rows of some runs; `None` if the job was stopped.
    fn make_runs(&self, runs: Range<usize>, bar: &ProgressBar) -> Result<Option<Rows>, EnsembleError> {
        if self.stopped.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let made = self.maker.rows(runs);
        if made.is_err() {
            self.stopped.store(true, Ordering::Relaxed);
        }
        let rows = made?;
        bar.more(rows.runs.len());
        match rows.failed.first() {
            Some(failed) if self.fail_fast => {
                self.stopped.store(true, Ordering::Relaxed);
                Err(failed.clone().into())
            }
            _ => Ok(Some(rows)),
        }
    }
}

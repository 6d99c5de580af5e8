//! The ranks of MPI, on one machine or many.
//!
//! Rank 0 hands out the numbers of blocks, one after the other, to whoever asks, and makes blocks itself in a
//! second thread. Blocks are files in a folder that all ranks see, so MPI carries only their numbers: a rank
//! that dies loses the block that it was making, and the next run makes what is missing. A rank asks for its
//! next block before it makes the one that it has, so that it never waits for an answer.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use ::mpi::Threading;
use ::mpi::collective::SystemOperation;
use ::mpi::environment::Universe;
use ::mpi::topology::{Rank, SimpleCommunicator};
use ::mpi::traits::{Communicator, CommunicatorCollectives, Destination, Root, Source};

use super::{Job, Made, Missing, Place};
use crate::error::EnsembleError;
use dynamics_analysis::shared::ProgressBar;

/// Tags of messages to rank 0, and of its answers.
const TO_MAIN: i32 = 1;
const TO_RANK: i32 = 2;
/// The first numbers of messages to rank 0: a block is asked for, nothing more is asked for, a run failed.
/// The second number is that of the runs made since the last message.
const WANT: u64 = 0;
const DONE: u64 = 1;
const FAILED: u64 = 2;
/// The answer where there are no more blocks.
const NO_MORE: u64 = u64::MAX;
/// How long rank 0 waits before it looks for messages again. Ranks ask a block in advance, so it costs
/// nothing; a block takes ten milliseconds or more.
const PAUSE: Duration = Duration::from_micros(500);

/// The ranks of MPI: start the program by `mpirun` or `srun`, and call [`Mpi::start`] once, before all
/// ensembles. MPI ends when it is dropped.
///
/// ```text
/// let mpi = Mpi::start()?;
/// let done = model.ensemble(start, inputs).until(30.0).to("flips.parquet").on(&mpi).run()?;
/// if mpi.rank() == 0 {
///     println!("{}", done.report());
/// }
/// ```
///
/// All ranks must see the folder of the file. All of them get the whole table. Each makes its runs on one
/// core, or on as many as [`Mpi::threads`] says.
pub struct Mpi {
    // Before the universe, so that it is dropped before.
    world: SimpleCommunicator,
    _universe: Universe,
    threads: usize,
}

impl Mpi {
    /// Starts MPI.
    ///
    /// # Errors
    /// Where it was started before in this process.
    pub fn start() -> Result<Self, EnsembleError> {
        let started = ::mpi::initialize_with_threading(Threading::Funneled);
        let (universe, threading) =
            started.ok_or(EnsembleError::Mpi("MPI was started before; call `Mpi::start()` once"))?;
        if threading < Threading::Funneled {
            return Err(EnsembleError::Mpi("this MPI permits no threads; use one that was built with them"));
        }
        Ok(Self { world: universe.world(), _universe: universe, threads: 1 })
    }

    /// The cores of each rank, at least one: 1 without this, so that there are as many ranks as cores.
    #[must_use]
    pub fn threads(mut self, count: usize) -> Self {
        self.threads = count.max(1);
        self
    }

    /// The number of this rank, from 0.
    #[must_use]
    pub fn rank(&self) -> usize {
        self.world.rank() as usize
    }

    /// How many ranks there are.
    #[must_use]
    pub fn ranks(&self) -> usize {
        self.world.size() as usize
    }

    /// Rank 0: answers the others while a thread makes blocks, too.
    fn lead(&self, job: &Job<'_>) -> Result<Made, EnsembleError> {
        let (missing, found) = match job.missing() {
            Ok(missing) => (missing, Ok(())),
            Err(error) => (Missing { blocks: Vec::new(), runs: 0, damaged: 0 }, Err(error)),
        };
        let (made, damaged) = (missing.runs, missing.damaged);
        let bar = job.bar(made, true);
        let queue = Mutex::new(missing.blocks.into_iter());
        let next = || {
            let stopped = job.stopped.load(Ordering::Relaxed);
            // A thread that panics ends the process.
            queue.lock().ok().filter(|_| !stopped).and_then(|mut queue| queue.next())
        };
        let (is_done, threads) = (AtomicBool::new(false), self.threads);
        let own = std::thread::scope(|scope| {
            let own = scope.spawn(|| {
                let mut result = Ok(());
                while let Some(block) = next().filter(|_| result.is_ok()) {
                    result = job.make_blocks(&[block], Some(threads), &bar).map(|_| ());
                    if result.is_err() {
                        job.stopped.store(true, Ordering::Relaxed);
                    }
                }
                is_done.store(true, Ordering::Release);
                result
            });
            self.answer(job, &bar, &next, &|| is_done.load(Ordering::Acquire) || own.is_finished());
            own.join()
        });
        found?;
        match own {
            Ok(result) => result.map(|()| Made { in_memory: Vec::new(), made, damaged }),
            Err(panic) => std::panic::resume_unwind(panic),
        }
    }

    /// Answers until all others and this rank have nothing more to do.
    fn answer(
        &self,
        job: &Job<'_>,
        bar: &ProgressBar,
        next: &dyn Fn() -> Option<usize>,
        is_done: &dyn Fn() -> bool,
    ) {
        let mut working = self.world.size() - 1;
        loop {
            while self.world.any_process().immediate_probe_with_tag(TO_MAIN).is_some() {
                let (message, status) = self.world.any_process().receive_vec_with_tag::<u64>(TO_MAIN);
                let (kind, runs) = (message.first().copied(), message.get(1).copied().unwrap_or(0));
                bar.more(runs as usize);
                match kind {
                    Some(WANT) => {
                        let block = next().map_or(NO_MORE, |block| block as u64);
                        let rank = self.world.process_at_rank(status.source_rank());
                        rank.send_with_tag(&[block][..], TO_RANK);
                    }
                    Some(FAILED) => job.stopped.store(true, Ordering::Relaxed),
                    _ => working -= 1,
                }
            }
            if working == 0 && is_done() {
                return;
            }
            std::thread::sleep(PAUSE);
        }
    }

    /// Other ranks: make the blocks that rank 0 names.
    fn follow(&self, job: &Job<'_>) -> Result<Made, EnsembleError> {
        let main = self.world.process_at_rank(0);
        let tell = |kind: u64, runs: usize| main.send_with_tag(&[kind, runs as u64][..], TO_MAIN);
        let hear = || main.receive_vec_with_tag::<u64>(TO_RANK).0.first().copied().unwrap_or(NO_MORE);
        let bar = job.bar(0, false);
        let (mut result, mut made, mut untold) = (Ok(()), 0, 0);
        tell(WANT, 0);
        let mut block = hear();
        while block != NO_MORE {
            // The next one in advance.
            tell(WANT, untold);
            untold = 0;
            if result.is_ok() {
                let block = block as usize;
                result = job.make_blocks(&[block], Some(self.threads), &bar).map(|_| ());
                match result {
                    Ok(()) => untold = job.partition.runs_of(block).len(),
                    Err(_) => tell(FAILED, 0),
                }
                made += untold;
            }
            block = hear();
        }
        tell(DONE, untold);
        result.map(|()| Made { in_memory: Vec::new(), made, damaged: 0 })
    }
}

impl Drop for Mpi {
    fn drop(&mut self) {
        if std::thread::panicking() {
            // The others would wait for this rank for ever.
            self.world.abort(101);
        }
    }
}

impl Place for &Mpi {
    fn name(&self) -> String {
        match (self.ranks(), self.threads) {
            (1, threads) => format!("one rank of {threads} threads"),
            (ranks, 1) => format!("{ranks} ranks"),
            (ranks, threads) => format!("{ranks} ranks of {threads} threads each"),
        }
    }

    fn is_divided(&self) -> bool {
        true
    }

    fn is_main(&self) -> bool {
        self.rank() == 0
    }

    fn of_main(&self, mut value: u64) -> u64 {
        self.world.process_at_rank(0).broadcast_into(&mut value);
        value
    }

    fn first_failed(&self, is_failed: bool) -> Option<usize> {
        let (size, mut first) = (self.world.size(), 0);
        let own: Rank = if is_failed { self.world.rank() } else { size };
        self.world.all_reduce_into(&own, &mut first, SystemOperation::min());
        (first < size).then_some(first as usize)
    }

    fn make(&self, job: &Job<'_>) -> Result<Made, EnsembleError> {
        if self.is_main() { self.lead(job) } else { self.follow(job) }
    }
}

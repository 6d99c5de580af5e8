//! Independent runs on all cores. Results are in the order of the runs, whichever core computed them. Without
//! the feature `parallel` the runs follow each other.

use alloc::string::String;
#[cfg(feature = "parallel")]
use alloc::string::ToString;
use alloc::vec::Vec;
use core::ops::Range;

/// `run(0), …, run(count − 1)`. `threads`: how many cores, `None` for all; `progress`: whether a bar is
/// shown.
pub(super) fn ordered<T: Send>(
    count: usize,
    threads: Option<usize>,
    progress: bool,
    run: impl Fn(usize) -> T + Sync,
) -> Result<Vec<T>, String> {
    ordered_blocks(count, 1, threads, progress, |block| block.map(&run).collect())
}

/// As [`ordered`], where `run` makes all runs of a block of `length` consecutive ones, the last one shorter.
pub(super) fn ordered_blocks<T: Send>(
    count: usize,
    length: usize,
    threads: Option<usize>,
    progress: bool,
    run: impl Fn(Range<usize>) -> Vec<T> + Sync,
) -> Result<Vec<T>, String> {
    let bar = ProgressBar::new(count, progress);
    let one = |block: usize| {
        let first = block * length;
        let results = run(first..count.min(first + length));
        bar.more(results.len());
        results
    };
    let blocks = shared(count.div_ceil(length), threads, one)?;
    Ok(blocks.into_iter().flatten().collect())
}

/// `task(0), …, task(count − 1)`, shared by cores; the results in order. Tasks may call it again: it then
/// uses the cores that have nothing to do.
///
/// # Errors
/// Threads that cannot be started.
pub fn shared<T: Send>(
    count: usize,
    threads: Option<usize>,
    task: impl Fn(usize) -> T + Sync,
) -> Result<Vec<T>, String> {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        let all = || (0..count).into_par_iter().map(&task).collect();
        let Some(threads) = threads else { return Ok(all()) };
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|error| error.to_string())?;
        Ok(pool.install(all))
    }
    #[cfg(not(feature = "parallel"))]
    {
        let _ = threads;
        Ok((0..count).map(task).collect())
    }
}

/// How many runs a core takes at once where they are made side by side: many enough that lanes without a run
/// at the end cost little, few enough that no core waits long for the last one.
#[must_use]
pub fn side_by_side_length(count: usize, threads: Option<usize>) -> usize {
    let blocks = BLOCKS_OF_CORE * threads.unwrap_or_else(cores);
    (count / blocks).clamp(RUNS_OF_BLOCK[0], RUNS_OF_BLOCK[1])
}

/// Fewest and most runs that a core takes at once where they are made side by side. While the last ones of a
/// block run, some lanes have none: with fewer runs of a block that is a larger part of the time.
const RUNS_OF_BLOCK: [usize; 2] = [16, 512];
/// Blocks of each core, so that none waits long for the last one.
const BLOCKS_OF_CORE: usize = 4;

/// How many cores runs are shared by where no number is asked for.
#[must_use]
pub fn cores() -> usize {
    #[cfg(feature = "parallel")]
    {
        rayon::current_num_threads()
    }
    #[cfg(not(feature = "parallel"))]
    {
        1
    }
}

/// A progress bar on the error stream. It appears if all runs take longer than a second; without the feature
/// `progress` it never does.
pub struct ProgressBar {
    #[cfg(feature = "progress")]
    shown: Option<shown::ShownBar>,
}

impl ProgressBar {
    /// A bar of this many runs, shown if `progress`.
    #[must_use]
    pub fn new(count: usize, progress: bool) -> Self {
        let _ = (count, progress);
        Self {
            #[cfg(feature = "progress")]
            shown: progress.then(|| shown::ShownBar::new(count)),
        }
    }

    /// Notes that further runs are done.
    pub fn more(&self, runs: usize) {
        let _ = runs;
        #[cfg(feature = "progress")]
        if let Some(shown) = &self.shown {
            shown.more(runs as u64);
        }
    }
}

#[cfg(feature = "progress")]
mod shown {
    use core::sync::atomic::{AtomicU64, Ordering};
    use std::sync::Mutex;
    use std::time::{Duration, Instant};

    /// Time before the bar appears.
    const DELAY: Duration = Duration::from_secs(1);
    /// Time between two drawings.
    const REDRAW_INTERVAL: Duration = Duration::from_millis(100);

    pub(super) struct ShownBar {
        done: AtomicU64,
        count: u64,
        begun: Instant,
        /// When the bar was last drawn, and the bar after it has appeared. A thread that finds it locked goes
        /// on, since another thread is drawing.
        bar: Mutex<(Instant, Option<indicatif::ProgressBar>)>,
    }

    impl ShownBar {
        pub(super) fn new(count: usize) -> Self {
            let now = Instant::now();
            Self { done: AtomicU64::new(0), count: count as u64, begun: now, bar: Mutex::new((now, None)) }
        }

        pub(super) fn more(&self, runs: u64) {
            let done = self.done.fetch_add(runs, Ordering::Relaxed) + runs;
            let Ok(mut drawn) = self.bar.try_lock() else { return };
            let now = Instant::now();
            if now - drawn.0 < REDRAW_INTERVAL || now - self.begun < DELAY {
                return;
            }
            drawn.0 = now;
            let bar = drawn.1.get_or_insert_with(|| {
                let bar = indicatif::ProgressBar::new(self.count);
                let template = "{bar:40} {pos} of {len} runs  {elapsed} of about {duration}";
                if let Ok(style) = indicatif::ProgressStyle::with_template(template) {
                    bar.set_style(style);
                }
                bar
            });
            bar.set_position(done);
        }
    }

    impl Drop for ShownBar {
        fn drop(&mut self) {
            if let Ok((_, Some(bar))) = self.bar.get_mut().as_deref() {
                bar.finish_and_clear();
            }
        }
    }
}

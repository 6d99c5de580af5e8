//! The builder of an ensemble: one method for each option, then `.run()`.

mod execution;
mod planning;

use std::path::PathBuf;

use dynamics_analysis::RunFailure;
use dynamics_runtime::model::Parameters;
use dynamics_runtime::simulate::{Motion, Simulate, Simulation};

use crate::inputs::Inputs;
use crate::places::{Cores, Opened, PlaceFor};
use crate::rows::EnsembleColumn;
use crate::runs::{Kept, RunOptions};

/// Runs of a block, without another choice: some ten milliseconds of work of a core, or more, so that files
/// cost little beside it and a kill loses little.
const DEFAULT_BLOCK: usize = 1024;

/// Opens ensembles. Every model has it that can be simulated, cloned and changed.
pub trait OpenEnsemble: Simulate + Parameters + Clone {
    /// Opens an ensemble: many runs of this model. What does not vary has the values of this model and this
    /// start. Options follow; [`Ensemble::run`] runs it.
    fn ensemble<'m>(&'m self, start: Self::State, inputs: impl Inputs + 'm) -> Ensemble<'m, Self> {
        Ensemble::new(self, start, Box::new(inputs))
    }
}

impl<M: Simulate + Parameters + Clone> OpenEnsemble for M {}

/// Numbers that are kept of a run, or why there are none.
pub trait KeptNumbers<const K: usize> {
    /// The numbers.
    ///
    /// # Errors
    /// Why the run counts as failed.
    fn numbers(self) -> Result<[f64; K], RunFailure>;
}

impl<const K: usize> KeptNumbers<K> for [f64; K] {
    fn numbers(self) -> Result<[f64; K], RunFailure> {
        Ok(self)
    }
}

// For one type of errors only, so that closures may use `?` without naming it.
impl<const K: usize> KeptNumbers<K> for Result<[f64; K], RunFailure> {
    fn numbers(self) -> Self {
        self
    }
}

/// Writes numbers to a row.
fn write<const K: usize>(numbers: impl KeptNumbers<K>, row: &mut [f64]) -> Result<(), RunFailure> {
    row.copy_from_slice(&numbers.numbers()?);
    Ok(())
}

/// An ensemble with its options, before it runs.
///
/// ```text
/// let done = model
///     .ensemble(start, Grid::new().over("theta1", angles.clone()).over("theta2", angles))
///     .until(30.0)
///     .tolerance(1e-9)
///     .options(|_, run| run.event("top", |state| state.theta2().powi(2) - PI * PI).stop_at("top", Rising))
///     .keep_ends(["flips_at [s]"], |_, end| [end.t()])
///     .to("flips.csv") // goes on where it stopped
///     .run()?;
/// println!("{}", done.report());
/// ```
#[must_use = "an ensemble does nothing until `.run()`"]
pub struct Ensemble<'m, M: Simulate> {
    model: &'m M,
    start: M::State,
    inputs: Box<dyn Inputs + 'm>,
    until: Option<f64>,
    tolerance: Option<f64>,
    options: Option<RunOptions<'m, M>>,
    kept: Kept<'m, M>,
    columns: Option<Vec<EnsembleColumn>>,
    label: Option<String>,
    block: usize,
    shard: Option<(usize, usize)>,
    path: Option<PathBuf>,
    fail_fast: bool,
    progress: bool,
    place: Opened<'m, M>,
}

impl<'m, M: Simulate + Parameters + Clone> Ensemble<'m, M> {
    fn new(model: &'m M, start: M::State, inputs: Box<dyn Inputs + 'm>) -> Self {
        Self {
            model,
            start,
            inputs,
            until: None,
            tolerance: None,
            options: None,
            kept: Kept::EndState,
            columns: None,
            label: None,
            block: DEFAULT_BLOCK,
            shard: None,
            path: None,
            fail_fast: false,
            progress: false,
            place: Cores::default().opened(),
        }
    }

    /// The end time of all runs. For an end that depends on the run see [`Ensemble::options`].
    pub fn until(mut self, t: f64) -> Self {
        self.until = Some(t);
        self
    }

    /// The permitted error of each step, as of [`Simulation::tolerance`].
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.tolerance = Some(tolerance);
        self
    }

    /// Completes the simulation of each run: an end time of its own, events, `.stop_at(..)`, every other
    /// option. The closure gets the model of the run.
    pub fn options(
        mut self,
        options: impl for<'a> Fn(&'a M, Simulation<'a, M>) -> Simulation<'a, M> + Sync + 'm,
    ) -> Self {
        self.options = Some(Box::new(options));
        self
    }

    /// Keeps numbers of each motion, under these names, with a unit if it stands in brackets: `"energy_drift
    /// [J]"`. The closure returns the numbers, or a `Result` of them with a [`RunFailure`], to which the
    /// errors of runs convert by `?`. Runs are made one by one; if the last state is enough,
    /// [`Ensemble::keep_ends`] takes a part of the time.
    pub fn keep<const K: usize, R: KeptNumbers<K>>(
        mut self,
        names: [&str; K],
        of: impl Fn(&Motion<'_, M>) -> R + Sync + 'm,
    ) -> Self {
        self.kept = Kept::Motion(Box::new(move |motion, row| write(of(motion), row)));
        self.named(&names)
    }

    /// Keeps numbers of the end of each run, under these names: the closure gets the model and the last
    /// state, at the end time or where `.stop_at(..)` ended the run. Runs are made side by side where that is
    /// possible, see [`ends`](dynamics_runtime::simulate::ends).
    ///
    /// Without this, [`Ensemble::keep`] and [`Ensemble::compute`] the last state is kept: `end_t`, and
    /// `end_theta`, `end_theta_rate` for each coordinate.
    pub fn keep_ends<const K: usize, R: KeptNumbers<K>>(
        mut self,
        names: [&str; K],
        of: impl Fn(&M, M::State) -> R + Sync + 'm,
    ) -> Self {
        self.kept = Kept::End(Box::new(move |model, end, row| write(of(model, end), row)));
        self.named(&names)
    }

    /// Makes each run by a function of its model and its start, and keeps the numbers that it returns: an
    /// equilibrium, frequencies, several simulations.
    pub fn compute<const K: usize, R: KeptNumbers<K>>(
        mut self,
        names: [&str; K],
        of: impl Fn(&M, M::State) -> R + Sync + 'm,
    ) -> Self {
        self.kept = Kept::Computed(Box::new(move |model, start, row| write(of(model, start), row)));
        self.named(&names)
    }

    /// A text that is part of the plan. Closures cannot be compared: give another text if one computes
    /// something else than before, so that runs of both are not mixed in a file.
    pub fn label(mut self, text: &str) -> Self {
        self.label = Some(text.into());
        self
    }

    /// Runs of a block, 1,024 without this. A block is written when all of its runs are done.
    pub fn block(mut self, runs: usize) -> Self {
        self.block = runs;
        self
    }

    /// Writes the table to a file: `.csv`, `.npy`, or `.parquet` with the feature `parquet`. Until all runs
    /// are done the blocks are files in a folder beside it, `flips.csv.blocks`. If the program ends before,
    /// the same call goes on where it stopped. If the file is complete already, it is read.
    pub fn to(mut self, path: impl Into<PathBuf>) -> Self {
        self.path = Some(path.into());
        self
    }

    /// Makes the part of the blocks with this number, from 0, of `ranks` parts, and leaves them in a folder
    /// beside the file of [`Ensemble::to`]: `flips.csv.3-of-16`. [`merge_shards`](crate::merge_shards) joins
    /// them.
    pub fn shard(mut self, rank: usize, ranks: usize) -> Self {
        self.shard = Some((rank, ranks));
        self
    }

    /// Where the runs are made: [`Cores`] without this. With the features `cuda` and `wgpu` also a graphics
    /// card: `.on(Gpu::first())` takes the cores if there is none, and the report says why.
    pub fn on(mut self, place: impl PlaceFor<M> + 'm) -> Self {
        self.place = place.opened();
        self
    }

    /// Ends the ensemble at the first run that fails, with its error. Without this such a run is a row with
    /// its reason.
    pub fn fail_fast(mut self) -> Self {
        self.fail_fast = true;
        self
    }

    /// Shows how many runs are done and the time to go, on the error stream, where all take longer than a
    /// second.
    #[cfg(feature = "progress")]
    pub fn progress(mut self) -> Self {
        self.progress = true;
        self
    }

    fn named(mut self, names: &[&str]) -> Self {
        self.columns = Some(names.iter().map(|name| EnsembleColumn::kept(name)).collect());
        self
    }
}

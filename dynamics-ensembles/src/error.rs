//! Why an ensemble has no result.

use std::path::PathBuf;

use dynamics_analysis::VariableError;
use dynamics_view::file::FileError;

use crate::inputs::InputError;
use crate::plan::PlanDifference;
use crate::rows::FailedRun;

/// Why there is no ensemble. A run that fails is no reason, unless `.fail_fast()` asks for it.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum EnsembleError {
    /// A name that is not a parameter or a start of the model.
    #[error(transparent)]
    Variable(#[from] VariableError),
    /// Values that cannot be.
    #[error(transparent)]
    Input(#[from] InputError),
    /// What makes the runs fails as a whole.
    #[error("{place} cannot make the runs: {message}")]
    Place {
        /// Its name.
        place: String,
        /// Why.
        message: String,
    },
    /// Two columns of the table have one name.
    #[error("two columns are named `{name}`; give the number that is kept another name")]
    ColumnTwice {
        /// The name.
        name: String,
    },
    /// A column of the table has the name of the one that says which runs failed.
    #[error(
        "files that end with `.{ending}` say in a column `{name}` which runs failed; give the number that is \
         kept another name, or write another kind of file"
    )]
    ColumnReserved {
        /// The name.
        name: &'static str,
        /// The ending of the file.
        ending: &'static str,
    },
    /// No column of a table has this name.
    #[error("the table has no column `{name}`{}; it has {}", near(.nearest), listed(.columns))]
    NoColumn {
        /// The name.
        name: String,
        /// A similar name.
        nearest: Option<String>,
        /// All columns.
        columns: Vec<String>,
    },
    /// Runs that are not simulated have no options of simulations.
    #[error(
        "`.{option}(..)` does nothing with `.compute(..)`, which makes its runs itself; leave one of them out"
    )]
    OptionOfNothing {
        /// The option.
        option: &'static str,
    },
    /// A shard that is none.
    #[error("there is no shard {rank} of {ranks}; shards are numbered from 0 to their number − 1")]
    Shard {
        /// The number of the shard.
        rank: usize,
        /// How many there were to be.
        ranks: usize,
    },
    /// A shard, or ranks that share no memory, without a file.
    #[error("{who} needs a file for its runs; add `.to(\"runs.csv\")`")]
    NoFile {
        /// What needs it.
        who: &'static str,
    },
    /// Shards, and a place that divides the runs by itself.
    #[error("{who} divides the runs by itself; leave `.shard(..)` out")]
    ShardTwice {
        /// The place.
        who: &'static str,
    },
    /// A block without runs.
    #[error("blocks have at least one run; `.block(1024)` is the default")]
    EmptyBlock,
    /// A file of an unknown kind.
    #[error(fmt = extension)]
    Extension {
        /// The file.
        path: PathBuf,
    },
    /// A file could not be written.
    #[error(transparent)]
    File(#[from] FileError),
    /// A file could not be read.
    #[error("cannot read `{}`: {problem}", .path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        problem: String,
    },
    /// The table of a shard, as a whole one.
    #[error(
        "a table of some of the runs is not written as one of all; join the shards with `merge_shards(..)`"
    )]
    PartOfTable,
    /// A file that is there already, of unknown origin.
    #[error("`{}` is there already, and nothing beside it says its plan; remove it, or write to another file",
        .path.display())]
    Unknown {
        /// The file.
        path: PathBuf,
    },
    /// Files of another plan.
    #[error(
        "`{}` has the runs of another plan: {}; write to another file, or remove this one with what belongs \
         to it",
        .path.display(),
        sentence(.differences)
    )]
    OtherPlan {
        /// The file or folder.
        path: PathBuf,
        /// What differs.
        differences: Vec<PlanDifference>,
    },
    /// Runs that no shard has.
    #[error("{}", missing_in_words(.runs, .shards))]
    Gaps {
        /// The missing runs, as intervals of first and last.
        runs: Vec<(usize, usize)>,
        /// The shards that have them, as far as the folders' names tell.
        shards: Vec<String>,
    },
    /// Shards whose common runs differ.
    #[error(
        "runs {} to {} differ between `{}` and `{}`; one of them is damaged, or a closure was changed \
         between",
        .runs.0, .runs.1, .folders[0].display(), .folders[1].display()
    )]
    Overlap {
        /// First and last run.
        runs: (usize, usize),
        /// The two folders.
        folders: [PathBuf; 2],
    },
    /// A run failed, and `.fail_fast()` was asked for.
    #[error("run {run} failed: {message}")]
    Run {
        /// The run.
        run: usize,
        /// Its failure.
        message: String,
    },
    /// Too few runs for a statistic.
    #[error("{what} needs at least {least} runs without failure, and there are {found}")]
    TooFewRuns {
        /// What was asked for.
        what: &'static str,
        /// How many it needs.
        least: usize,
        /// How many there are.
        found: usize,
    },
    /// A probability or confidence that is none.
    #[error("{what} must lie between 0 and 1, and {value} does not")]
    Probability {
        /// What was given.
        what: &'static str,
        /// The value.
        value: f64,
    },
    /// Values of a column that are not numbers.
    #[error("`{column}` has no finite value in run {run}; statistics need finite values")]
    NotFinite {
        /// The column.
        column: String,
        /// The run.
        run: usize,
    },
    /// The importance of inputs from runs that were not made for it.
    #[error(
        "these runs do not give the importance of inputs; sample with `Samples::sobol(n)…for_importance()`"
    )]
    NotForImportance,
    /// A number that is the same in all runs.
    #[error("`{column}` is the same in all runs, so no input has a part in its variance")]
    Constant {
        /// The column.
        column: String,
    },
    /// A number that is the same in nearly all runs.
    #[error(
        "`{column}` is the same in nearly all runs, too many for intervals of the importance; make more runs, or \
         widen the inputs"
    )]
    NearlyConstant {
        /// The column.
        column: String,
    },
    /// The cores cannot be had.
    #[error("the threads cannot be started ({0}); ask for fewer with `Cores::threads(..)`")]
    Threads(String),
    /// Another rank ended with an error.
    #[error("rank {rank} ended with an error, which it returns there")]
    Rank {
        /// The rank.
        rank: usize,
    },
    /// MPI cannot be used.
    #[error("{0}")]
    Mpi(&'static str),
}

dynamics_runtime::sentence_for_debugging!(EnsembleError);

impl From<FailedRun> for EnsembleError {
    fn from(FailedRun { run, message }: FailedRun) -> Self {
        Self::Run { run, message }
    }
}

fn near(nearest: &Option<String>) -> String {
    nearest.as_ref().map_or(String::new(), |near| format!(" (did you mean `{near}`?)"))
}

fn listed(columns: &[String]) -> String {
    columns.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

fn extension(path: &std::path::Path, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
    write!(f, "cannot write runs to `{}`: ", path.display())?;
    if path.extension().is_some_and(|of| of.eq_ignore_ascii_case("parquet")) {
        return write!(f, "the feature `parquet` is off; turn it on, or name the file `.csv` or `.npy`");
    }
    write!(f, "the ending of the name says the format; end it with `.csv`, `.npy` or `.parquet`")
}

fn sentence(differences: &[PlanDifference]) -> String {
    /// Most differences that are written out.
    const WRITTEN_OUT: usize = 4;
    let shown = differences.iter().take(WRITTEN_OUT).map(ToString::to_string);
    let mut text = shown.collect::<Vec<_>>().join(", ");
    if differences.len() > WRITTEN_OUT {
        text += &format!(", and {} more differ", differences.len() - WRITTEN_OUT);
    }
    text
}

fn missing_in_words(runs: &[(usize, usize)], shards: &[String]) -> String {
    /// Most intervals that are written out.
    const WRITTEN_OUT: usize = 6;
    let interval = |(first, last): &(usize, usize)| format!("{first} to {last}");
    let mut text = runs.iter().take(WRITTEN_OUT).map(interval).collect::<Vec<_>>().join(", ");
    if runs.len() > WRITTEN_OUT {
        text += &format!(" and {} more stretches", runs.len() - WRITTEN_OUT);
    }
    let remedy = match shards {
        [] => "run the shards that have them, or name their folders".into(),
        shards => format!("run {} again: runs that are there are not repeated", shards.join(", ")),
    };
    format!("runs {text} are missing; {remedy}")
}

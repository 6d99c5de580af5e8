//! Why there is no unit.

use std::io;
use std::path::PathBuf;

use dynamics_export::ExportError;
use dynamics_runtime::simulate::SimulationErrorKind;
use dynamics_view::FileError;

/// A model or what was chosen for it cannot be written as a functional mock-up unit.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum FmuError {
    /// The model cannot be written in C.
    #[error(transparent)]
    Export(#[from] ExportError),
    /// No simulation begins at the start.
    #[error("the unit cannot begin at its start: {source}")]
    Start {
        /// Why, as a simulation says it.
        source: Box<SimulationErrorKind>,
    },
    /// The generated solution of the constraints does not apply at the start.
    #[error(
        "the equations in C have no solution at the start, where Rust takes its general solver; {remedy}"
    )]
    Unsolved {
        /// What helps.
        remedy: &'static str,
    },
    /// An input of the start has no value.
    #[error("the input `{name}` is {value}; a unit needs a number to begin with: set it in the start")]
    Input {
        /// Its name.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// A number that was chosen is out of its range.
    #[error("{option} is {value}; it has to be {range}")]
    Number {
        /// Which.
        option: &'static str,
        /// What was given.
        value: f64,
        /// What may be given.
        range: &'static str,
    },
    /// There is no compiler of C for `.with_binary()`.
    #[error(
        "`.with_binary()` needs a compiler of C, and `{compiler}` cannot be run: {source}; install one, set \
         the environment variable CC, or leave `.with_binary()` out: importers compile the sources"
    )]
    NoCompiler {
        /// What was run.
        compiler: String,
        /// Why it cannot be.
        source: io::Error,
    },
    /// The compiler refused the sources.
    #[error("`{compiler}` does not compile the sources in `{}`:\n{said}", .folder.display())]
    Compiler {
        /// What was run.
        compiler: String,
        /// Where the sources are: a folder for temporary files, which is kept.
        folder: PathBuf,
        /// What it said.
        said: String,
    },
    /// The standard has no name for the platform.
    #[error(
        "`.with_binary()` knows no name of FMI 3.0 for the platform {platform}; leave it out: importers compile \
         the sources"
    )]
    Platform {
        /// Architecture and system.
        platform: String,
    },
    /// The file would be larger than its format can be.
    #[error("the unit has more than 4 GB; `{name}` does not fit into it")]
    TooLarge {
        /// The file within it.
        name: String,
    },
    /// A file could not be written.
    #[error(transparent)]
    File(#[from] FileError),
}

/// Its sentence: that is what `main` and `unwrap` print.
impl core::fmt::Debug for FmuError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        core::fmt::Display::fmt(self, f)
    }
}

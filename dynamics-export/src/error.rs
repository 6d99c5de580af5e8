//! Why there is no text in C.

use std::path::PathBuf;

use dynamics_runtime::simulate::SimulationErrorKind;
use dynamics_view::FileError;

/// A model or what was chosen for it cannot be written in C.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// The equations of the model have no programs.
    #[error("`{model}` cannot be written in C: {}", .reasons.join("; "))]
    NotPrintable {
        /// Its name.
        model: &'static str,
        /// What stands against it, with remedies.
        reasons: Vec<String>,
    },
    /// A smooth function is written in Rust alone.
    #[error(
        "the smooth function `{name}` is written in Rust alone; C needs its pieces: take a `CubicSpline`, or \
         implement `SmoothFunction::pieces`"
    )]
    Function {
        /// Its field.
        name: String,
    },
    /// The pieces of a smooth function are not those of a function, or of another one.
    #[error(
        "the pieces of the smooth function `{name}` {fault}; return the polynomials that its `derivatives` \
         are made of from `SmoothFunction::pieces`, or take a `CubicSpline`"
    )]
    Pieces {
        /// Its field.
        name: String,
        /// What is wrong with them.
        fault: String,
    },
    /// The library's sines exist for doubles, and for models that use them in Rust.
    #[error("`.library_sines()` is given, and {reason}; leave it out")]
    Sines {
        /// What stands against them.
        reason: &'static str,
    },
    /// No simulation begins with the example's start.
    #[error("the example cannot begin at {start}: {source}{}", remedy(.is_given))]
    Start {
        /// Which, in words.
        start: &'static str,
        /// Whether it was given.
        is_given: bool,
        /// Why, as a simulation says it.
        source: Box<SimulationErrorKind>,
    },
    /// The generated solution of the constraints does not apply at the example's start.
    #[error(
        "the equations in C have no solution at {start}, where Rust takes its general solver; {remedy}, or \
         write it `.without_example()`"
    )]
    Unsolved {
        /// Which, in words.
        start: &'static str,
        /// What helps.
        remedy: &'static str,
    },
    /// An input of the start has no value.
    #[error("the input `{name}` is {value}; the example needs a number: set it in the start")]
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
    /// A number of the model is too large or too small for a float.
    #[error("{what} is {value:e}, which no float holds; leave out `.single_precision()`")]
    Float {
        /// Whose it is.
        what: String,
        /// Its value.
        value: f64,
    },
    /// A file of the example's names is not one that was written here.
    #[error(
        "`{}` is a file of your own and would be replaced; take another folder, or write \
         `.without_example()`",
        .path.display()
    )]
    Foreign {
        /// Which.
        path: PathBuf,
    },
    /// A file could not be written.
    #[error(transparent)]
    File(#[from] FileError),
}

fn remedy(is_given: &bool) -> &'static str {
    if *is_given { "" } else { "; give `.start(..)`" }
}

/// Its sentence: that is what `main` and `unwrap` print.
impl core::fmt::Debug for ExportError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        core::fmt::Display::fmt(self, f)
    }
}

//! Why there is no page.

use dynamics_runtime::simulate::{OptionError, SimulationErrorKind};
use dynamics_view::{FileError, suggest};

/// A model or what was chosen for its page does not fit into one.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum LiveError {
    /// The model has no programs outside of Rust.
    #[error(
        "`{model}` has no live page: {}; `.animate(..)` of a recorded motion shows it",
        .reasons.join("; ")
    )]
    NotPortable {
        /// Its name.
        model: &'static str,
        /// What stands against it.
        reasons: Vec<String>,
    },
    /// A smooth function is written in Rust alone.
    #[error(
        "the smooth function `{name}` is written in Rust alone; a page needs its pieces: take a \
         `CubicSpline`, or implement `SmoothFunction::pieces`"
    )]
    Function {
        /// Its field.
        name: String,
    },
    /// The pieces of a smooth function are not those of a function, or of another one.
    #[error("the pieces of the smooth function `{name}` {fault}")]
    Pieces {
        /// Its field.
        name: String,
        /// What is wrong with them.
        fault: String,
    },
    /// A simulation would refuse the model, its parameters, or what was declared for its motion.
    #[error(transparent)]
    Option(Box<OptionError>),
    /// No simulation goes from a start.
    #[error("no motion begins at the start `{start}`: {source}")]
    Start {
        /// Its name.
        start: String,
        /// Why, as a simulation says it.
        source: Box<SimulationErrorKind>,
    },
    /// No simulation of a model with families goes from a start.
    #[cfg(feature = "families")]
    #[error("no motion begins at the start `{start}`: {source}")]
    FamilyStart {
        /// Its name.
        start: String,
        /// Why, as a simulation says it.
        source: Box<dynamics_families::FamilyErrorKind>,
    },
    /// Pages do not have the method for a model with families.
    #[cfg(feature = "families")]
    #[error(
        "pages do not have {method} for models with families; choose `methods::StormerVerlet`, `Rk4`, \
         `DormandPrince5`, `Dop853` or `ImplicitMidpoint`"
    )]
    FamilyMethod {
        /// The method.
        method: String,
    },
    /// A model with families has more unknowns than a page can keep.
    #[cfg(feature = "families")]
    #[error(
        "`{model}` has {unknowns} unknowns, and a page holds at most {most}; take fewer nodes, or a page of \
         the recorded motion, `motion.animate(..)`"
    )]
    Unknowns {
        /// Its name.
        model: &'static str,
        /// How many there are.
        unknowns: usize,
        /// How many a page holds.
        most: usize,
    },
    /// Two starts have one name, by which the page lets its reader choose.
    #[error("two starts are called `{name}`; the page tells them apart by their names")]
    TwoStarts {
        /// The name.
        name: String,
    },
    /// An input of a start is infinite.
    #[error("the input `{name}` is {value}; a page needs a number")]
    Input {
        /// Its name.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// An input has neither a slider nor a value.
    #[error("the input `{name}` has no slider and no value; set it in every start, or do not `.hold(..)` it")]
    HeldInput {
        /// Its name.
        name: &'static str,
    },
    /// There is nothing of this name.
    #[error("there is no {what} `{name}`{}", hint(.name, .known))]
    UnknownName {
        /// `parameter`, `input`, `coordinate`, `switched constraint`, `event`, `quantity`.
        what: &'static str,
        /// The name that was given.
        name: String,
        /// The names that there are.
        known: Vec<String>,
    },
    /// A count, or a list of numbers of any length, has no slider.
    #[error(
        "`{name}` is a count or a list of any length, which a page holds at its value; write a page for each \
         value that is to be shown"
    )]
    Fixed {
        /// Its name.
        name: &'static str,
    },
    /// The ends of a slider are not two increasing numbers.
    #[error(
        "the slider of `{name}` goes from {} to {}; the second has to be greater, both finite",
        .range[0], .range[1]
    )]
    Range {
        /// Name of the parameter or input.
        name: String,
        /// What was given.
        range: [f64; 2],
    },
    /// The value of a parameter or an input is not between the ends of its slider.
    #[error(
        "the slider of `{name}` goes from {} to {} and cannot show its value, {value}",
        .range[0], .range[1]
    )]
    OutOfRange {
        /// Its name.
        name: &'static str,
        /// The ends that were given.
        range: [f64; 2],
        /// Its value; 0 for an input that is not set.
        value: f64,
    },
    /// A tolerance or a step that the method does not have.
    #[error("{given}; {remedy}")]
    Accuracy {
        /// What was given.
        given: &'static str,
        /// What to give instead.
        remedy: &'static str,
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
    /// A page of a gallery has no name of its own that can be that of a file.
    #[error(
        "`{name}` cannot be the name of a page; each page of a gallery needs a name of its own, of letters, \
         digits, `_` and `-`, other than `index`"
    )]
    PageName {
        /// What was given.
        name: String,
    },
    /// The file could not be written.
    #[error(transparent)]
    File(#[from] FileError),
}

fn hint(name: &str, known: &[String]) -> String {
    match suggest(name, known.iter().map(String::as_str)) {
        Some(near) => format!("; did you mean `{near}`?"),
        None if known.is_empty() => "; the model has none".to_owned(),
        None => format!("; there are `{}`", known.join("`, `")),
    }
}

/// Its sentence: that is what `main` and `unwrap` print.
impl core::fmt::Debug for LiveError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        core::fmt::Display::fmt(self, f)
    }
}

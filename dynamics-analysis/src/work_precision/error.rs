//! Errors of studies, and of measurements that were made elsewhere.

use alloc::string::String;
use core::fmt;

/// No result would be reliable, or the options are invalid.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum WorkPrecisionError {
    /// `.until(..)` is missing.
    #[error("the study has no end; say `.until(..)`")]
    NoEnd,
    /// The end is the start or no finite time.
    #[error("a motion until {end} cannot be studied; give a finite time beside the start's")]
    End {
        /// What was given.
        end: f64,
    },
    /// `.methods([..])` or `.methods_at(..)` has named none.
    #[error(
        "a list of methods is empty; name some in `.methods([..])`, or leave it out for those that \
         simulations choose by themselves"
    )]
    NoMethods,
    /// A list is empty that a method needs.
    #[error("{method} has no {what} to run with; say `.{what}([..])`, or name some in `.methods_at(..)`")]
    NoSettings {
        /// `tolerances` or `steps`.
        what: &'static str,
        /// The method.
        method: String,
    },
    /// A list was given that no method uses: tolerances where all choose no step, steps where none is fixed,
    /// either where all have settings of their own.
    #[error(fmt = no_method)]
    NoMethod {
        /// `tolerances` or `steps`.
        what: &'static str,
    },
    /// A tolerance or a step is not a positive number.
    #[error("{value} is not possible among the {what}; give numbers above 0")]
    Setting {
        /// `tolerances` or `steps`.
        what: &'static str,
        /// What was given.
        value: f64,
    },
    /// Two curves have one name.
    #[error("two curves are called {name}; name one of them with `.variant(..)`")]
    SameName {
        /// The name.
        name: String,
    },
    /// The uncertainty of a reference is negative or not a number.
    #[error("a reference cannot be uncertain by {value}; give 0 or a positive number")]
    Uncertainty {
        /// What was given.
        value: f64,
    },
    /// The state given as the reference is not at the end of the motion, or not finite.
    #[error("the reference state is at t = {time} and the end at t = {end}; give finite values at the end")]
    ReferenceState {
        /// Its time.
        time: f64,
        /// The end of the motion.
        end: f64,
    },
    /// A run of the reference failed.
    #[error(
        "the reference by {method} at tolerance {tolerance:e} fails: {reason}; choose its methods and \
         tolerance with `Reference::runs(..)`, or give a known end with `Reference::known(..)`"
    )]
    ReferenceFails {
        /// Its method.
        method: String,
        /// Its tolerance.
        tolerance: f64,
        /// Why.
        reason: String,
    },
    /// The runs of the reference differ so much that it has fewer than three digits.
    #[error(
        "the reference is not converged: its {what} of {scale:.1e} are uncertain by {uncertainty:.1e}; study \
         a shorter motion, or give a known end with `Reference::known(..)`"
    )]
    NotConverged {
        /// `positions` or `velocities`.
        what: &'static str,
        /// Twice their largest difference.
        uncertainty: f64,
        /// The largest of what is compared.
        scale: f64,
    },
    /// No run reached the end.
    #[error("no run reached the end; {method} stopped because {reason}")]
    NoRunSucceeded {
        /// The first of them.
        method: String,
        /// Why it failed.
        reason: String,
    },
    /// Methods agree with each other, and not with the end that was given.
    #[error(fmt = contradicted)]
    Contradicted {
        /// Two of them.
        methods: [String; 2],
        /// `positions` or `velocities`.
        what: &'static str,
        /// How far both are from that end.
        distance: f64,
        /// How far they are from each other.
        apart: f64,
    },
    /// Runs near rounding end elsewhere than was said.
    #[error(
        "the known end is {distance:.1e} from that of {how}, which is uncertain by {uncertainty:.1e}, in \
         {what}: it is the end of another motion, or not as certain as was said; compare parameters, start \
         and time with its source, or let the reference be found"
    )]
    OtherEnd {
        /// Which runs.
        how: String,
        /// `positions` or `velocities`.
        what: &'static str,
        /// How far their end is from the one that was given.
        distance: f64,
        /// How far it may be wrong.
        uncertainty: f64,
    },
    /// The errors of all runs are below the uncertainty of the reference.
    #[error(
        "all errors are below the uncertainty of the reference, {uncertainty:.1e} in positions; give coarser \
         tolerances or a better reference"
    )]
    NothingToBelieve {
        /// That of positions.
        uncertainty: f64,
    },
}

fn no_method(what: &str, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let methods = if what == "steps" { "a fixed step" } else { "step control" };
    write!(
        f,
        "no method runs with the {what} of `.{what}([..])`; add one with {methods}, or leave \
         them out"
    )
}

fn contradicted(
    methods: &[String; 2],
    what: &str,
    distance: &f64,
    apart: &f64,
    f: &mut fmt::Formatter<'_>,
) -> fmt::Result {
    let [first, second] = methods;
    write!(
        f,
        "{first} and {second} end {distance:.1e} from the known end and {apart:.1e} from each other, \
         in {what}: it is the end of another motion, or both pass over something; compare \
         parameters, start and time with its source, or let the reference be found"
    )
}

dynamics_runtime::sentence_for_debugging!(WorkPrecisionError);

/// A file of outside measurements cannot be taken.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum OutsideError {
    /// A line is not what the format says.
    #[error("line {line} is no measurement: {problem}; see `Study::add_outside` for the format")]
    Line {
        /// Which one, from 1.
        line: usize,
        /// What is wrong with it.
        problem: String,
    },
    /// The file cannot be read.
    #[error("cannot read `{}`: {source}", .path.display())]
    File {
        /// The file.
        path: std::path::PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

dynamics_runtime::sentence_for_debugging!(OutsideError);

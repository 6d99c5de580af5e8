//! Errors of a comparison of models.

use alloc::string::String;
use core::fmt;

/// The comparison would not be reliable, or the options are invalid.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LadderError {
    /// `.until(..)` is missing.
    #[error("the comparison has no end; say `.until(..)`")]
    NoEnd,
    /// The end is the start, or not a finite time.
    #[error("motions until {end} cannot be compared; give a finite time beside the start's")]
    End {
        /// What was given.
        end: f64,
    },
    /// There are fewer than two rungs.
    #[error("a ladder of {rungs} rungs compares nothing; add models with `.rung(..)`")]
    TooFew {
        /// How many.
        rungs: usize,
    },
    /// Two rungs have one name.
    #[error("two rungs are called `{name}`; give each a name of its own")]
    SameName {
        /// The name.
        name: String,
    },
    /// Two rungs start at different times.
    #[error(
        "`{first}` starts at t = {start} and `{other}` at t = {other_start}; let all rungs start at the same \
         time"
    )]
    Starts {
        /// The first rung.
        first: String,
        /// When it starts.
        start: f64,
        /// Another one.
        other: String,
        /// When that starts.
        other_start: f64,
    },
    /// The tolerance is not valid, or too small for a run at a hundredth of it.
    #[error(
        "at tolerance {tolerance:e} errors cannot be told by a run at a hundredth of it; give one from 1e-12 \
         to below 1"
    )]
    Tolerance {
        /// What was given.
        tolerance: f64,
    },
    /// There are no intervals between common times, or more than memory holds.
    #[error("{intervals} intervals are no common times; give from 1 to 10,000,000")]
    Intervals {
        /// What was given.
        intervals: usize,
    },
    /// No output is common to all rungs.
    #[error(
        "no output is common to all rungs; declare it with `#[output]` in every model, or add it with \
         `Rung::output(..)`"
    )]
    NoOutputs,
    /// A rung does not have an output.
    #[error(fmt = unknown_output)]
    UnknownOutput {
        /// The rung.
        rung: String,
        /// The output.
        output: String,
        /// One that it has and that may be meant.
        suggestion: Option<String>,
    },
    /// An output is declared in different units.
    #[error(
        "`{output}` is in {one} in `{first}` and in {other} in `{second}`; give it one unit, or \
         another name",
        first = .rungs[0],
        second = .rungs[1],
        one = .units[0],
        other = .units[1]
    )]
    Units {
        /// The output.
        output: String,
        /// The units.
        units: [String; 2],
        /// The rungs that declare them.
        rungs: [String; 2],
    },
    /// The scale of an output is no positive number.
    #[error("{scale} is no scale for `{output}`; give a positive number in its unit")]
    Scale {
        /// The output.
        output: String,
        /// What was given.
        scale: f64,
    },
    /// A scale was given for an output that is not compared.
    #[error("`{output}` has a scale and is not compared; name it in `.outputs([..])`")]
    ScaleOfNothing {
        /// The output.
        output: String,
    },
    /// An output is always 0 on the last rung, so its differences have no scale.
    #[error(
        "`{output}` is 0 on the last rung, so that no difference is a part of it; say `.scale(\"{output}\", \
         ..)`"
    )]
    NoScale {
        /// The output.
        output: String,
    },
    /// A run failed.
    #[error(
        "`{rung}` at tolerance {tolerance:e} fails: {reason}; choose its method with `Rung::with(..)`, or \
         compare a shorter motion"
    )]
    Fails {
        /// The rung.
        rung: String,
        /// At which tolerance.
        tolerance: f64,
        /// Why.
        reason: String,
    },
    /// An output has no value somewhere.
    #[error("`{output}` of `{rung}` is {value} at t = {time}; compare it where it has a value")]
    NotFinite {
        /// The rung.
        rung: String,
        /// The output.
        output: String,
        /// Where.
        time: f64,
        /// What it is there.
        value: f64,
    },
    /// The numerical errors of a rung and of the last one are as large as their difference, and not small.
    #[error(
        "`{rung}` differs in `{output}` by {difference:.1e}, and the runs may be wrong by {uncertainty:.1e} \
         where it is {scale:.1e}; give a tighter tolerance or compare a shorter motion"
    )]
    NotConverged {
        /// The rung.
        rung: String,
        /// The output.
        output: String,
        /// Its largest difference from the last rung.
        difference: f64,
        /// The errors of both together.
        uncertainty: f64,
        /// The largest value of the output, or what was set as its scale.
        scale: f64,
    },
    /// An accuracy is no positive number.
    #[error("{accuracy} is no accuracy; give a positive part of the outputs, 0.01 for one percent")]
    Accuracy {
        /// What was given.
        accuracy: f64,
    },
    /// The numerical errors of the runs may be as large as the requested accuracy.
    #[error(
        "whether a rung suffices for {accuracy:.1e} cannot be told while the run of `{rung}` may be wrong by \
         {uncertainty:.1e}; give the ladder a tighter tolerance"
    )]
    TooFine {
        /// What was asked for, as a part of the outputs.
        accuracy: f64,
        /// A rung.
        rung: String,
        /// What it may be wrong by, likewise.
        uncertainty: f64,
    },
}

fn unknown_output(
    rung: &str,
    output: &str,
    suggestion: &Option<String>,
    f: &mut fmt::Formatter<'_>,
) -> fmt::Result {
    write!(f, "`{rung}` has no output `{output}`")?;
    match suggestion {
        Some(name) => write!(f, "; `{name}` is there"),
        None => f.write_str("; declare it with `#[output]` or add it with `Rung::output(..)`"),
    }
}

dynamics_runtime::sentence_for_debugging!(LadderError);

//! Why a motion has no answer, and names that may have been meant.

use alloc::string::String;
use core::fmt;

use crate::error::SolveError;
use crate::wording::Readable;

/// Why a motion has no answer to a question.
#[derive(Clone, PartialEq)]
#[non_exhaustive]
pub enum MotionError {
    /// The time lies outside the motion.
    OutOfRange {
        /// What was asked.
        time: f64,
        /// Start of the motion.
        start: f64,
        /// End of the motion.
        end: f64,
    },
    /// There is no output of this name.
    UnknownOutput {
        /// What was asked.
        name: String,
        /// The nearest known name.
        suggestion: Option<String>,
    },
    /// There is no constraint of this name.
    UnknownConstraint {
        /// What was asked.
        name: String,
        /// The nearest known name.
        suggestion: Option<String>,
    },
    /// Accelerations or reactions do not exist there.
    Solve(SolveError),
}

impl fmt::Display for MotionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OutOfRange { time, start, end } => {
                let [time, start, end] = [*time, *start, *end].map(Readable);
                write!(f, "t = {time} lies outside the motion, which goes from {start} to {end}")
            }
            Self::UnknownOutput { name, suggestion: Some(near) } => {
                write!(f, "there is no output `{name}`; did you mean `{near}`?")
            }
            Self::UnknownOutput { name, suggestion: None } => {
                write!(f, "there is no output `{name}`; declare it with `#[output]`")
            }
            Self::UnknownConstraint { name, suggestion: Some(near) } => {
                write!(f, "there is no constraint `{name}`; did you mean `{near}`?")
            }
            Self::UnknownConstraint { name, suggestion: None } => {
                write!(
                    f,
                    "there is no constraint `{name}`; declare it with `#[holonomic]` or `#[nonholonomic]`"
                )
            }
            Self::Solve(error) => error.fmt(f),
        }
    }
}

crate::error::sentence_for_debugging!(MotionError);
impl core::error::Error for MotionError {}

/// The known name nearest to the given one, if it is near enough to be meant.
pub(crate) fn suggest<'a>(name: &str, mut known: impl Iterator<Item = &'a str>) -> Option<String> {
    nearest(name, &mut || known.next())
}

/// As [`suggest`]; compiled once, and not with every model.
fn nearest<'a>(name: &str, known: &mut dyn FnMut() -> Option<&'a str>) -> Option<String> {
    let near = |candidate: &str| distance(name, candidate);
    core::iter::from_fn(known)
        .map(|candidate| (near(candidate), candidate))
        .filter(|&(d, candidate)| d <= 1 + candidate.chars().count().max(name.chars().count()) / 3)
        .min_by_key(|&(d, _)| d)
        .map(|(_, candidate)| candidate.into())
}

/// Insertions, deletions and replacements between two words (Levenshtein).
fn distance(a: &str, b: &str) -> usize {
    let mut row: alloc::vec::Vec<usize> = (0..=b.chars().count()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = core::mem::replace(&mut row[0], i + 1);
        for (j, y) in b.chars().enumerate() {
            let replace = diagonal + usize::from(x != y);
            diagonal = row[j + 1];
            row[j + 1] = replace.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.chars().count()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn suggests_what_may_be_meant_and_nothing_else() {
        let known = || ["impact", "apex", "return"].into_iter();
        assert_eq!(suggest("impct", known()).as_deref(), Some("impact"));
        assert_eq!(suggest("apexx", known()).as_deref(), Some("apex"));
        assert_eq!(suggest("temperature", known()), None);
        assert_eq!(distance("kitten", "sitting"), 3);
    }
}

//! What can go wrong when a motion is shown.

use alloc::string::String;
use alloc::vec::Vec;
use core::fmt;

/// A motion could not be shown or written.
#[derive(Debug)]
#[non_exhaustive]
pub enum OutputError {
    /// There is no quantity of this name.
    UnknownName {
        /// The name that was asked for.
        name: String,
        /// The names that there are.
        known: Vec<String>,
    },
    /// The interval between samples is not a positive number, or so small that time does not advance by it.
    Interval {
        /// The interval.
        interval: f64,
    },
    /// A file could not be written.
    #[cfg(feature = "std")]
    File(super::file::FileError),
}

impl fmt::Display for OutputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnknownName { name, known } => {
                write!(f, "there is no quantity `{name}`")?;
                match nearest(name, known) {
                    Some(near) => write!(f, "; did you mean `{near}`?"),
                    None => write!(f, "; there are `{}`", known.join("`, `")),
                }
            }
            Self::Interval { interval } => write!(
                f,
                "samples every {interval} are not possible; the interval must be positive and large enough for time to advance"
            ),
            #[cfg(feature = "std")]
            Self::File(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for OutputError {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            #[cfg(feature = "std")]
            Self::File(error) => error.source(),
            _ => None,
        }
    }
}

#[cfg(feature = "std")]
impl From<super::file::FileError> for OutputError {
    fn from(error: super::file::FileError) -> Self {
        Self::File(error)
    }
}

/// The known name that a third of the letters at most keeps apart from `name`.
fn nearest<'a>(name: &str, known: &'a [String]) -> Option<&'a str> {
    known
        .iter()
        .map(|candidate| (distance(name, candidate), candidate.as_str()))
        .filter(|(distance, candidate)| 3 * distance <= candidate.len().max(name.len()))
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}

/// Number of letters to insert, delete or replace (Levenshtein).
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, letter) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for j in 0..b.len() {
            let replaced = diagonal + usize::from(letter != b[j]);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::string::ToString;

    #[test]
    fn a_misspelt_name_gets_its_neighbour_and_a_foreign_one_the_list() {
        let known: Vec<String> = ["theta1", "theta1_rate", "x"].map(ToString::to_string).to_vec();
        let message =
            |name: &str| OutputError::UnknownName { name: name.to_string(), known: known.clone() }.to_string();
        assert_eq!(message("teta1"), "there is no quantity `teta1`; did you mean `theta1`?");
        assert_eq!(message("energy"), "there is no quantity `energy`; there are `theta1`, `theta1_rate`, `x`");
        assert_eq!(distance("kitten", "sitting"), 3);
        assert_eq!(distance("", "ab"), 2);
    }
}

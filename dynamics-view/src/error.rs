//! What can go wrong when a motion is shown.

use alloc::string::String;
use alloc::vec::Vec;
use core::fmt;

use crate::suggest::suggest;

/// A motion could not be shown or written.
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
    /// The speed of an animation is not a positive number.
    Speed {
        /// Seconds of the motion per second of playing.
        speed: f64,
    },
    /// An animation of fewer than two instants does not move.
    Frames {
        /// The most instants allowed.
        most: usize,
    },
    /// Motions in space cannot be seen from there.
    Eye {
        /// Degrees about z, from the x-axis.
        azimuth: f64,
        /// Degrees above the level.
        elevation: f64,
    },
    /// A table could not be written to where it should go.
    #[cfg(feature = "std")]
    Stream(std::io::Error),
    /// A file could not be written.
    #[cfg(feature = "std")]
    File(crate::file::FileError),
}

impl fmt::Display for OutputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnknownName { name, known } => {
                write!(f, "there is no quantity `{name}`")?;
                match suggest(name, known.iter().map(String::as_str)) {
                    Some(near) => write!(f, "; did you mean `{near}`?"),
                    None => write!(f, "; there are `{}`", known.join("`, `")),
                }
            }
            Self::Interval { interval } => write!(
                f,
                "samples every {interval} are not possible; the interval must be positive and large enough \
                 for time to advance"
            ),
            Self::Speed { speed } => {
                write!(f, "an animation cannot be played {speed} times as fast; the speed must be positive")
            }
            Self::Frames { most } => {
                write!(f, "an animation of {most} instants does not move; allow at least 2")
            }
            Self::Eye { azimuth, elevation } => write!(
                f,
                "an eye at azimuth {azimuth}° and elevation {elevation}° is nowhere; the elevation must be \
                 from −90 to 90"
            ),
            #[cfg(feature = "std")]
            Self::Stream(error) => write!(f, "the table cannot be written: {error}"),
            #[cfg(feature = "std")]
            Self::File(error) => error.fmt(f),
        }
    }
}

/// Its sentence: that is what `main` and `unwrap` print.
impl fmt::Debug for OutputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl core::error::Error for OutputError {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            #[cfg(feature = "std")]
            Self::Stream(error) => Some(error),
            #[cfg(feature = "std")]
            Self::File(error) => error.source(),
            _ => None,
        }
    }
}

#[cfg(feature = "std")]
impl From<crate::file::FileError> for OutputError {
    fn from(error: crate::file::FileError) -> Self {
        Self::File(error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::string::ToString;

    #[test]
    fn a_misspelt_name_gets_its_neighbour_and_a_foreign_one_the_list() {
        let known: Vec<String> = ["theta1", "theta1_rate", "x"].map(ToString::to_string).to_vec();
        let message = |name: &str| {
            OutputError::UnknownName { name: name.to_string(), known: known.clone() }.to_string()
        };
        assert_eq!(message("teta1"), "there is no quantity `teta1`; did you mean `theta1`?");
        assert_eq!(
            message("energy"),
            "there is no quantity `energy`; there are `theta1`, `theta1_rate`, `x`"
        );
    }
}

//! Verdicts in plain words.

use core::fmt;

use super::{Stability, StabilityVerdict, Undecided};

impl fmt::Display for StabilityVerdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stable => f.write_str("stable: energy is conserved, and least in this position"),
            Self::AsymptoticallyStable => f.write_str("asymptotically stable: small disturbances die out"),
            Self::GyroscopicallyStabilised => f.write_str(
                "gyroscopically stabilised: energy is not least here, but to first order nothing grows; damping will in the end destroy this",
            ),
            Self::Marginal(why) => write!(f, "not decided by linear theory: {why}"),
            Self::Divergence { growth, coordinate } => {
                write!(f, "unstable by divergence: `{coordinate}` leaves as e^({growth:.6} t)")
            }
            Self::Flutter { growth, frequency, coordinate } => {
                write!(f, "unstable by flutter: `{coordinate}` swings at {frequency:.6} rad/s and grows as e^({growth:.6} t)")
            }
        }
    }
}

impl fmt::Display for Undecided {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NothingResists { coordinate } => {
                write!(
                    f,
                    "nothing resists along `{coordinate}`, to what is known of it (a buckling load, a fold, or equilibria side by side)"
                )
            }
            Self::Swings { frequency } => write!(
                f,
                "what swings at {frequency:.6} rad/s is neither damped nor driven to first order, and energy is not known to be conserved"
            ),
            Self::FrequenciesMeet { frequency, conditioning } => write!(
                f,
                "two frequencies meet at {frequency:.6} rad/s (conditioning {conditioning:.1e}), at the edge of flutter"
            ),
        }
    }
}

/// The verdict, and a line of evidence.
impl fmt::Display for Stability {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.verdict)?;
        if let Some(square) = self.least_omega_squared {
            write!(f, "least stiffness per inertia {square:.6e}/s²; ")?;
        }
        write!(
            f,
            "largest real part {:.6e}/s, sure to {:.1e}; conditioning {:.1e}",
            self.abscissa, self.uncertainty, self.conditioning
        )?;
        for (i, coordinate) in self.ignorable.iter().enumerate() {
            write!(f, "{}`{}`", if i == 0 { "; left out, as nothing depends on it: " } else { ", " }, coordinate.name)?;
        }
        Ok(())
    }
}

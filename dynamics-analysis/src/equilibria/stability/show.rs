//! Verdicts of stability as text.

use core::fmt;

use super::{Stability, StabilityVerdict, Undecided};

/// A rate or a frequency with six digits after the point, in which small and large ones would have none or
/// too many.
fn rate(value: f64) -> alloc::string::String {
    match value == 0.0 || (1e-3..1e6).contains(&value.abs()) {
        true => alloc::format!("{value:.6}"),
        false => alloc::format!("{value:.6e}"),
    }
}

impl fmt::Display for StabilityVerdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stable => f.write_str("stable: energy is conserved, and least in this position"),
            Self::AsymptoticallyStable => f.write_str("asymptotically stable: small disturbances die out"),
            Self::PartlyDamped { frequency, coordinate } => write!(
                f,
                "stable: energy never grows, and is least in this position; to first order the mode at {} \
                 rad/s, in which `{coordinate}` moves most, is not damped",
                rate(*frequency)
            ),
            Self::GyroscopicallyStabilised => f.write_str(
                "gyroscopically stabilised: energy is not least here, but to first order nothing grows; \
                 damping will in the end destroy this",
            ),
            Self::Marginal(why) => write!(f, "not decided by linear theory: {why}"),
            Self::Divergence { growth, coordinate } => {
                write!(f, "unstable by divergence: `{coordinate}` leaves as e^({} t)", rate(*growth))
            }
            Self::Flutter { growth, frequency, coordinate } => {
                write!(
                    f,
                    "unstable by flutter: `{coordinate}` swings at {} rad/s and grows as e^({} t)",
                    rate(*frequency),
                    rate(*growth)
                )
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
                    "nothing resists along `{coordinate}`, to what is known of it (a buckling load, a fold, \
                     or equilibria side by side)"
                )
            }
            Self::Swings { frequency } => write!(
                f,
                "what swings at {} rad/s is neither damped nor driven to first order, and energy is not \
                 known to be conserved",
                rate(*frequency)
            ),
            Self::FrequenciesMeet { frequency, conditioning } => write!(
                f,
                "two frequencies meet at {} rad/s (conditioning {conditioning:.1e}), at the edge of flutter",
                rate(*frequency)
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
            write!(
                f,
                "{}`{}`",
                if i == 0 { "; left out, as nothing depends on it: " } else { ", " },
                coordinate.name
            )?;
        }
        Ok(())
    }
}

//! Multipliers and their verdict in words.

use core::fmt;

use super::{Floquet, FloquetVerdict, Multiplier, Threshold};
use crate::periodic::symmetry::Trivial;

impl fmt::Display for Trivial {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Time => f.write_str("the same motion, later"),
            Self::Coordinate { name } => write!(f, "nothing depends on `{name}`"),
            Self::Conserved { name } => write!(f, "{name} is conserved"),
        }
    }
}

impl fmt::Display for Threshold {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Fold => "through +1 (fold, pitchfork)",
            Self::Flip => "through -1 (the period doubles)",
            Self::NeimarkSacker => "as a complex pair (Neimark-Sacker)",
        })
    }
}

impl fmt::Display for FloquetVerdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::AsymptoticallyStable => f.write_str("asymptotically stable"),
            Self::StableToFirstOrder => {
                f.write_str("stable to first order: what is disturbed neither grows nor dies out")
            }
            Self::Unstable { threshold, growth, coordinate } => {
                write!(
                    f,
                    "unstable {threshold}: disturbances, most of `{coordinate}`, grow by {growth:.6} \
                    in a period"
                )
            }
            Self::Undecided { threshold, excess, uncertainty } => write!(
                f,
                "not decided to first order: a multiplier that would leave {threshold} has |μ| - 1 = \
                 {excess:.1e}, known to {uncertainty:.1e}"
            ),
        }
    }
}

/// μ, its uncertainty, and the reason why it is 1, if there is one.
impl fmt::Display for Multiplier {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let re = self.value.re + 0.0;
        match self.value.im {
            0.0 => write!(f, "{re:.10}")?,
            im => write!(f, "{re:.10} {} {:.10}i", if im < 0.0 { '-' } else { '+' }, im.abs())?,
        }
        match self.trivial {
            Some(why) => write!(f, " ({why})"),
            None => write!(f, " ± {:.1e}, |μ| = {:.10}", self.uncertainty, self.value.norm()),
        }
    }
}

/// The verdict, then one line for each multiplier.
impl fmt::Display for Floquet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.verdict)?;
        self.multipliers.iter().try_for_each(|multiplier| writeln!(f, "  μ = {multiplier}"))?;
        write!(f, "period {:.12}, {} steps, misses its start by {:.1e}", self.period, self.steps, self.miss)
    }
}

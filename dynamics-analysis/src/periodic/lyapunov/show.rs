//! Exponents in words.

use core::fmt;

use dynamics_runtime::model::ModelState;

use super::{Exponent, ExponentSign, LyapunovExponents};

impl fmt::Display for Exponent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let meaning = match self.sign {
            ExponentSign::Positive => "neighbours part",
            ExponentSign::Zero => "0 for a reason",
            ExponentSign::Negative => "neighbours come together",
            ExponentSign::Undecided => "sign not decided",
        };
        write!(f, "{:>11.6} ± {:.6} 1/s: {meaning}", self.value, self.uncertainty)
    }
}

/// One line for each exponent, then the divergence, the time and the steps of the run.
impl<S: ModelState> fmt::Display for LyapunovExponents<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.exponents.iter().try_for_each(|one| writeln!(f, "{one}"))?;
        write!(f, "mean divergence {:.6} 1/s", self.divergence)?;
        if let Some(defect) = self.sum_defect() {
            write!(f, ", the sum differs from it by {defect:.1e}")?;
        }
        write!(
            f,
            "; over {} s, {} orthonormalisations, {} steps",
            self.time, self.orthonormalisations, self.steps
        )
    }
}

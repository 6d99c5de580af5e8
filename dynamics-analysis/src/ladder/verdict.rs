//! The plainest rung that suffices for an accuracy.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::fmt;

use dynamics_view::suggest;
use dynamics_view::text::readable;

use super::comparison::{Comparison, Difference, RungReport};
use super::error::LadderError;

/// The plainest rung that suffices for an accuracy, with what it saves. Shows itself as a sentence.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// Largest difference from the last rung that was permitted, as a part of the outputs.
    pub accuracy: f64,
    /// The outputs that were asked for.
    pub outputs: Vec<String>,
    /// The rung that suffices.
    pub rung: String,
    /// Its largest relative difference over all outputs; 0 for the last rung.
    pub off_by: f64,
    /// The last rung, the reference of this statement.
    pub full: String,
    /// Time of the last rung over that of the one that suffices.
    pub time_ratio: f64,
    /// Operations of all evaluations, likewise; `None` if one of them is unknown.
    pub work_ratio: Option<f64>,
    /// The rung before the one that suffices, and its difference.
    pub too_plain: Option<(String, f64)>,
}

impl Comparison {
    /// The plainest rung whose outputs all differ from those of the last one by at most this part: 0.01 for
    /// one percent.
    ///
    /// # Errors
    /// [`LadderError::Accuracy`] if the argument is not positive, [`LadderError::TooFine`] if the errors of
    /// the runs may be larger.
    pub fn sufficient(&self, accuracy: f64) -> Result<Verdict, LadderError> {
        self.judge((0..self.outputs.len()).collect(), accuracy)
    }

    /// The plainest rung that is so near to the last one in one output.
    ///
    /// # Errors
    /// As [`Comparison::sufficient`]; [`LadderError::UnknownOutput`] for a name that was not compared.
    pub fn sufficient_for(&self, output: &str, accuracy: f64) -> Result<Verdict, LadderError> {
        let Some(index) = self.outputs.iter().position(|known| known.name == output) else {
            let suggestion = suggest(output, self.outputs.iter().map(|known| known.name.as_str()));
            return Err(LadderError::UnknownOutput {
                rung: self.full().name.clone(),
                output: output.into(),
                suggestion,
            });
        };
        self.judge([index].into(), accuracy)
    }

    /// The plainest rung that suffices for these outputs.
    fn judge(&self, outputs: Vec<usize>, accuracy: f64) -> Result<Verdict, LadderError> {
        if !(accuracy > 0.0 && accuracy.is_finite()) {
            return Err(LadderError::Accuracy { accuracy });
        }
        let most = |rung: &RungReport, of: fn(&Difference) -> f64| {
            let part = |o: &usize| of(&rung.differences[*o]) / self.outputs[*o].scale;
            outputs.iter().map(part).fold(0.0, f64::max)
        };
        let full = self.full();
        let last = self.rungs.len() - 1;
        let mut first = last;
        for (k, rung) in self.rungs.iter().enumerate() {
            if most(rung, Difference::bound) <= accuracy {
                first = k;
                break;
            }
            // If the uncertainty hides whether the rung suffices, there is no verdict. A rung that is
            // certainly too far off is passed over.
            let uncertainty = most(rung, |difference| difference.uncertainty);
            if uncertainty > 0.5 * accuracy && most(rung, |d| d.largest - d.uncertainty) <= accuracy {
                return Err(LadderError::TooFine { accuracy, rung: rung.name.clone(), uncertainty });
            }
        }
        let rung = &self.rungs[first];
        let before = first.checked_sub(1).map(|k| &self.rungs[k]);
        Ok(Verdict {
            accuracy,
            outputs: outputs.iter().map(|o| self.outputs[*o].name.clone()).collect(),
            rung: rung.name.clone(),
            off_by: if first == last { 0.0 } else { most(rung, Difference::bound) },
            full: full.name.clone(),
            time_ratio: full.time.as_secs_f64() / rung.time.as_secs_f64(),
            work_ratio: full.work().zip(rung.work()).map(|(full, own)| full / own),
            too_plain: before.map(|rung| (rung.name.clone(), most(rung, |difference| difference.largest))),
        })
    }
}

/// `1 %`.
pub(super) fn percent(part: f64) -> String {
    format!("{} %", readable(100.0 * part, 2))
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [others @ .., last] = &*self.outputs else { return Ok(()) };
        let outputs =
            if others.is_empty() { last.clone() } else { format!("{} and {last}", others.join(", ")) };
        let (accuracy, too_plain) = (percent(self.accuracy), self.too_plain.as_ref());
        if self.rung == self.full {
            write!(f, "to {accuracy} of {outputs} it takes `{}`", self.full)?;
            return match too_plain {
                Some((rung, off_by)) => write!(f, "; `{rung}` is off by {}", percent(*off_by)),
                None => Ok(()),
            };
        }
        write!(f, "to {accuracy} of {outputs} `{}` suffices (off by {}", self.rung, percent(self.off_by))?;
        if let Some((rung, off_by)) = too_plain {
            write!(f, ", `{rung}` by {}", percent(*off_by))?;
        }
        write!(f, "); `{}` costs {} times its time", self.full, readable(self.time_ratio, 2))?;
        match self.work_ratio {
            Some(ratio) => write!(f, " and {} times its operations", readable(ratio, 2)),
            None => Ok(()),
        }
    }
}

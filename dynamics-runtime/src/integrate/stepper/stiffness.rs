//! Stiffness detection: steps that stability bounds and not accuracy.
//!
//! Source: Hairer, Wanner, *Solving Ordinary Differential Equations II*, §IV.2; codes `dopri5.f`, `dop853.f`.

use crate::integrate::stepper::Stepper;
use crate::integrate::{Scheme, StepNode};
use crate::model::Vector;

/// Steps between two stiffness tests while no step was suspicious. A smaller number costs time, a larger one
/// finds stiffness later.
pub(super) const STIFFNESS_INTERVAL: u64 = 32;
/// Steps beyond the border of stability that count as stiffness, and steps away from it that end a suspicion:
/// those of Hairer's codes.
const STIFF_STEPS: u32 = 15;
/// See [`STIFF_STEPS`].
const NOT_STIFF_STEPS: u32 = 6;

impl<V: Vector, S: Scheme<V>> Stepper<V, S> {
    /// Hairer's stiffness test: [`STIFF_STEPS`] steps beyond the border of stability, not interrupted by
    /// [`NOT_STIFF_STEPS`] steps away from it.
    pub(super) fn test_stiffness(&mut self, h: f64, end: &StepNode<V>) {
        let Some(size) = self.scheme.stiffness(h, end) else {
            return;
        };
        if size > S::STABILITY_BORDER {
            self.stiffness_counts = (self.stiffness_counts.0 + 1, 0);
            if self.stiffness_counts.0 >= STIFF_STEPS {
                self.stiff_at.get_or_insert(end.t);
                self.stiffness_counts = (0, 0);
            }
        } else {
            self.stiffness_counts.1 += 1;
            if self.stiffness_counts.1 >= NOT_STIFF_STEPS {
                self.stiffness_counts = (0, 0);
            }
        }
    }
}

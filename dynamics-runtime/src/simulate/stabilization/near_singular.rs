//! The influence of drift on the direction of a motion near a singular position.
//!
//! Constraints that have drifted by Φ lead the motion along a slightly different branch. The influence is
//! the larger of two figures, both from the correction δ = −Φ_q⁺Φ: how much Newton's next correction
//! ½ Φ_q⁺Φ_qq δ² is of δ, and how much of the velocity Φ_q⁺Φ_qq δ q̇ is. Both grow as c/(kx)²
//! at a distance x from the singular position, see [`crate::simulate::diagnosis::singular_position`]. Second
//! derivatives are found by differences. `drift_inspection.rs` decides when this is worth its cost.

use crate::constrain::Gradients;
use crate::constrain::active_set::active_rows;
use crate::constrain::nearby::{NEARBY_DISTANCE, nearby_state};
use crate::error::SolveError;
use crate::linalg::{max_abs, norm};
use crate::model::{Constraints, ModelState, Vector};
use crate::simulate::stabilization::singular_start::combined;
use crate::{constrain, math};

/// Largest |q| that counts for the size of a coordinate: angles that count revolutions are no larger
/// displacements. Without it, displacements for differences, and distances to singular positions, would grow
/// with the revolutions. It is above 2π, so that angles within one revolution count in full.
pub(crate) const MAX_COUNTED_ANGLE: f64 = 10.0;

/// Largest permitted influence of drift, as a part of the velocity or of the correction: above it a motion
/// that is near a singular position ends, as its branch is not determined. A smaller value ends motions whose
/// drift only turns them a little; a larger one lets drift choose the branch. The summary warns of less, see
/// `summary/checks.rs`.
pub(crate) const MAX_DRIFT_INFLUENCE: f64 = 0.02;

/// Displacement for second differences, in parts of the size of the coordinates: ε^(1/4), at which
/// truncation and rounding errors are about equal. Rounding exceeds the difference at a smaller value, the
/// neglected terms of order four do at a larger one.
const PROBE_DISPLACEMENT: f64 = 1e-4;

/// Influence of drift on the direction of a motion. A small violation of the constraints changes the
/// direction a little, and by much near positions where the constraints nearly lose rank.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriftInfluence {
    /// The larger of two ratios: the second of Newton's corrections back to the constraints over the first
    /// one, and the rate at which the first one changes over the velocity.
    pub part: f64,
    /// Time of the largest influence.
    pub time: f64,
}

/// A state at which the influence of drift is measured.
pub(crate) struct ProbedState<M: Constraints> {
    /// Φ.
    pub(crate) residual: M::Residual,
    /// Lengths of the rows' gradients.
    pub(crate) lengths: M::Rows,
    /// √Mᵢᵢ, see [`weigh`](crate::constrain::assemble::weigh).
    pub(crate) weights: M::Vector,
}

/// Measures the influence of drift at a state.
pub(crate) struct DriftProbe<'p, M: Constraints> {
    model: &'p M,
    constants: &'p M::Constants,
    state: &'p M::State,
    here: &'p ProbedState<M>,
    workspace: &'p mut [f64],
}

impl<'p, M: Constraints> DriftProbe<'p, M> {
    pub(crate) fn new(
        model: &'p M,
        constants: &'p M::Constants,
        state: &'p M::State,
        here: &'p ProbedState<M>,
        workspace: &'p mut [f64],
    ) -> Self {
        Self { model, constants, state, here, workspace }
    }

    /// The influence of the drift, in parts of the motion. Above [`MAX_DRIFT_INFLUENCE`] the state is nearer
    /// to a singular position than its drift permits.
    pub(crate) fn influence(&mut self, reference_lengths: &M::Rows) -> Result<f64, SolveError> {
        let (state, residual) = (self.state, self.drift_with_rounding(reference_lengths));
        let delta = self.correction(&residual, -1.0)?;
        let (length, speed) = (self.length(&delta), self.length(state.u()));
        if length == 0.0 {
            return Ok(0.0);
        }
        // Φ_qq δ² by a displacement along δ; Φ_qq δ q̇ by two along the sum and the difference of both
        // at the same length.
        let scale = PROBE_DISPLACEMENT * self.size() / length;
        let along_correction = scaled(&delta, scale);
        let curvature = combined(&self.second_difference(&along_correction), 1.0, &self.here.residual, -2.0);
        let newton = self.correction(&curvature, 0.5 / (scale * scale))?;
        let contraction = self.length(&newton) / length;
        if contraction > MAX_DRIFT_INFLUENCE || speed == 0.0 {
            return Ok(contraction);
        }
        let time = scale * length / speed;
        let [plus, minus] = [1.0, -1.0]
            .map(|sign| self.second_difference(&combined(&along_correction, 1.0, state.u(), sign * time)));
        let mixed = combined(&plus, 1.0, &minus, -1.0);
        let turning = self.correction(&mixed, 0.25 / (scale * time))?;
        Ok(math::max(contraction, self.length(&turning) / speed))
    }

    /// Lengths of the rows' gradients. Of a gradient that nearly vanishes: the rate at which it grows with
    /// the distance from the state, so that rounding errors of its row have a scale.
    pub(crate) fn reference_lengths(&mut self) -> M::Rows {
        let mut reference_lengths = self.here.lengths;
        let nearby = nearby_state::<M>(self.state);
        let gradients = Gradients::alone(self.model, &nearby, self.workspace);
        for row in 0..M::Rows::LEN {
            reference_lengths[row] = math::max(
                reference_lengths[row],
                (norm(gradients.row(row)) - reference_lengths[row]).abs() / NEARBY_DISTANCE,
            );
        }
        reference_lengths
    }

    /// Φ enlarged by its rounding error, below which no drift is known.
    fn drift_with_rounding(&self, reference_lengths: &M::Rows) -> M::Residual {
        let rounding = f64::EPSILON * (1.0 + max_abs(self.state.q().as_slice()).min(MAX_COUNTED_ANGLE));
        let mut drift = self.here.residual;
        for row in 0..M::Residual::LEN {
            drift[row] += (rounding * reference_lengths[row]).copysign(drift[row]);
        }
        drift
    }

    /// factor · Φ_q⁺ of values of the holonomic rows.
    fn correction(&mut self, values: &M::Residual, factor: f64) -> Result<M::Vector, SolveError> {
        let mut right = M::Rows::zeros();
        for row in active_rows::<M>(self.state.active_set(), true) {
            right[row] = factor * values[row];
        }
        constrain::correct(self.model, self.constants, self.state, &right, self.workspace)
    }

    fn length(&self, x: &M::Vector) -> f64 {
        math::sqrt(
            x.as_slice().iter().zip(self.here.weights.as_slice()).map(|(x, w)| (x * w) * (x * w)).sum(),
        )
    }

    /// ‖w (1 + |q|)‖ with the weights w, and |q| up to [`MAX_COUNTED_ANGLE`].
    fn size(&self) -> f64 {
        let terms = self.state.q().as_slice().iter().zip(self.here.weights.as_slice());
        math::sqrt(terms.map(|(q, w)| math::powi(w * (1.0 + q.abs().min(MAX_COUNTED_ANGLE)), 2)).sum())
    }

    /// Φ(q + x) + Φ(q − x) = 2Φ(q) + Φ_qq x² + O(x⁴).
    fn second_difference(&self, x: &M::Vector) -> M::Residual {
        let mut displaced = *self.state;
        let mut at = |sign: f64| {
            (0..M::Vector::LEN).for_each(|i| displaced.q_mut()[i] = self.state.q()[i] + sign * x[i]);
            self.model.residual(&displaced)
        };
        combined(&at(1.0), 1.0, &at(-1.0), 1.0)
    }
}

fn scaled<V: Vector>(x: &V, factor: f64) -> V {
    let mut out = *x;
    out.as_mut_slice().iter_mut().for_each(|x| *x *= factor);
    out
}

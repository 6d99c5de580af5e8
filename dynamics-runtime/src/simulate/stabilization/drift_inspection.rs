//! Drift inspection: how far constraints have drifted where a formulation lets them, and whether the drift
//! decides the direction of the motion.
//!
//! A full inspection finds both and takes as long as half a step of a method of high order (Andrews'
//! mechanism, Verner 9(8)). Most steps are far from where drift matters. For these one correction
//! δ = Φ_q⁺r decides whether an inspection is needed, which leaves a tenth of the cost. Here
//! rᵢ = |Φᵢ| + h|Φ̇ᵢ| + rounding.
//!
//! * Bound of the drift: no row is violated by more than |δ|, as |rᵢ| = |Φ_q,ᵢ δ| ≤ ‖Φ_q,ᵢ‖
//!   |δ|, and no rate by more than |δ|/h.
//! * Prediction of the influence: at a distance x from a singular position, drift c has the influence
//!   c/(kx)² ([`crate::simulate::diagnosis::singular_position`]). |δ| is c/(kx), and |δ|/|r| grows as 1/x.
//!   So |δ|²/|r| is proportional to the influence, and predicts it from the last full inspection.
//!
//! The influence itself is measured in `near_singular.rs`. The monitor that asks after every step, and ends
//! the motion, is `run/monitors/constraint_drift.rs`. This file changes no state.

use crate::constrain::Gradients;
use crate::constrain::active_set::active_rows;
use crate::constrain::assemble::{least_size, size_along, weigh};
use crate::constrain::project::ConstraintLevel;
use crate::error::SolveError;
use crate::linalg::{max_abs, norm};
use crate::math;
use crate::model::{ActiveSet, Constraints, ModelState, Vector};
use crate::simulate::stabilization::near_singular::{
    DriftInfluence, DriftProbe, MAX_DRIFT_INFLUENCE, ProbedState,
};
use crate::simulate::stabilization::{Distances, Stabilization};

/// Steps for which an inspection predicts those that follow, as the directions of the gradients change. The
/// number doubles up to [`MAX_STEPS_UNINSPECTED`] with each inspection that confirms the prediction. Smaller
/// values cost more full inspections, each half a step of a method of high order. With larger ones a
/// prediction is used where the gradients have turned; for what was measured see [`INSPECTED_INFLUENCE`].
const MIN_STEPS_UNINSPECTED: u32 = 3;
/// See [`MIN_STEPS_UNINSPECTED`].
const MAX_STEPS_UNINSPECTED: u32 = 12;
/// An inspection confirms a prediction if it finds at most so many times the predicted influence. A smaller
/// value inspects more steps; a larger one trusts predictions that were too small.
const CONFIRMED_PREDICTION: f64 = 3.0;
/// Predicted influence below which a step is not inspected, in parts of the velocity: a three-hundredth of
/// what the summary warns of. After [`MIN_STEPS_UNINSPECTED`] steps the bound falls with the age of the
/// inspection.
///
/// Measured on 675,000 steps that were not inspected, of four-bars, slider-cranks and chains of rods through
/// and past their change points, by four methods at tolerances from 1e-3 to 1e-9 and two in fixed steps: the
/// largest influence was 2.7e-4, below what the summary warns of and an eightieth of what ends a motion. It
/// was the same with [`MIN_STEPS_UNINSPECTED`] steps at most. Without the age one step would have deserved
/// the warning.
const INSPECTED_INFLUENCE: f64 = 1e-6;
/// Lengths of gradients above this part of those at the inspection, and below [`MAX_SIMILAR_LENGTH`] times
/// the reference, are similar: reference lengths of the inspection are then still valid. A narrower range
/// computes them again more often, by gradients at a displaced state; a wider one judges drift by lengths
/// that the gradients no longer have.
const MIN_SIMILAR_LENGTH: f64 = 0.5;
/// See [`MIN_SIMILAR_LENGTH`].
const MAX_SIMILAR_LENGTH: f64 = 2.0;

/// A constraint that has drifted too far.
pub(crate) struct Drifted {
    pub(crate) what: &'static str,
    pub(crate) row: &'static str,
    pub(crate) residual: f64,
    pub(crate) distance: f64,
    pub(crate) limit: f64,
}

/// What an inspection says of a step.
pub(crate) enum DriftVerdict {
    Harmless,
    TooFar(Drifted),
    /// The drift decides this part of the motion's direction. A gradient is `shortened` times shorter than at
    /// nearby positions.
    Decides {
        part: f64,
        shortened: f64,
    },
}

/// Result of a full inspection, by which the steps that follow are judged.
#[derive(Clone, Copy)]
pub(crate) struct DriftInspection<R> {
    active_set: ActiveSet,
    /// Lengths of the gradients.
    lengths: R,
    /// See [`DriftProbe::reference_lengths`].
    reference_lengths: R,
    /// Influence of the drift, in parts of the motion.
    influence: f64,
    /// |δ|²/|r| at the inspection.
    amplified: f64,
    /// Steps for which the inspection may predict the influence.
    steps: u32,
    /// Those of them that are left.
    steps_left: u32,
}

impl<R: Vector> DriftInspection<R> {
    /// The predicted influence where |δ|²/|r| is `amplified`.
    fn predicts(&self, amplified: f64) -> f64 {
        self.influence / self.amplified * amplified
    }

    /// Age of the inspection, in units of [`MIN_STEPS_UNINSPECTED`] steps, at least 1.
    fn age(&self) -> f64 {
        math::max(1.0, f64::from(self.steps - self.steps_left + 1) / f64::from(MIN_STEPS_UNINSPECTED))
    }

    /// The number of steps for which the next inspection may predict, if it does or does not confirm this
    /// one.
    fn next_steps(&self, is_confirmed: bool) -> u32 {
        if is_confirmed { (2 * self.steps).min(MAX_STEPS_UNINSPECTED) } else { MIN_STEPS_UNINSPECTED }
    }

    /// Whether all gradients are about as long as at the inspection, so that its reference lengths are valid.
    fn has_similar_lengths(&self, lengths: &R) -> bool {
        let is_similar = |row: usize| {
            MIN_SIMILAR_LENGTH * self.lengths[row] <= lengths[row]
                && lengths[row] <= MAX_SIMILAR_LENGTH * self.reference_lengths[row]
        };
        (0..R::LEN).all(is_similar)
    }
}

/// The correction δ of this file's header. |r| is the largest rᵢ over the reference length of its row.
#[derive(Clone, Copy)]
struct DriftCorrection {
    /// |δ|.
    length: f64,
    /// |δ|²/|r|.
    amplified: f64,
}

impl<M: Constraints> Stabilization<M> {
    /// Inspects the drift at the end of a step of length `h`: how far it is, and whether it decides the
    /// direction of the motion. By prediction alone where that is certain enough.
    #[inline]
    pub(crate) fn inspect_drift(
        &mut self,
        model: &M,
        state: &M::State,
        h: f64,
    ) -> Result<DriftVerdict, SolveError> {
        let residuals = (model.residual(state), model.velocity_residual(state));
        let last = self.last_inspection.filter(|last| last.active_set == state.active_set());
        let last = last.and_then(|last| {
            Some((last, self.drift_correction(model, state, h, &residuals, &last.reference_lengths)?))
        });
        if let Some((last, DriftCorrection { length, amplified })) = last {
            let limit = self.drift_limit * self.least_size(model);
            let is_harmless = amplified > 0.0 && last.age() * last.predicts(amplified) <= INSPECTED_INFLUENCE;
            if last.steps_left > 0 && is_harmless && length <= limit && length <= h.abs() * limit {
                self.last_inspection = Some(DriftInspection { steps_left: last.steps_left - 1, ..last });
                return Ok(DriftVerdict::Harmless);
            }
        }
        self.inspect_fully(model, state, h, &residuals, last)
    }

    /// Lower bound of the sizes of all rows.
    fn least_size(&mut self, model: &M) -> f64 {
        *self.least_size.get_or_insert_with(|| least_size(model))
    }

    /// The correction δ for these residuals; `None` where there is no generated code to find it.
    #[inline]
    fn drift_correction(
        &self,
        model: &M,
        state: &M::State,
        h: f64,
        (position, velocity): &(M::Residual, M::Rows),
        reference_lengths: &M::Rows,
    ) -> Option<DriftCorrection> {
        let rounding = f64::EPSILON * (1.0 + max_abs(state.q().as_slice()));
        let (mut right, mut largest) = (M::Rows::zeros(), 0.0);
        for row in active_rows::<M>(state.active_set(), false) {
            let position = if row < M::Residual::LEN { position[row] } else { 0.0 };
            let violation = position.abs() + (h * velocity[row]).abs() + rounding * reference_lengths[row];
            right[row] = violation.copysign(position);
            largest = math::max(largest, violation / reference_lengths[row]);
        }
        let delta = model.correct_unrolled(&self.constants, state, &right)?;
        let length: f64 = math::sqrt(delta.as_slice().iter().map(|x| x * x).sum());
        Some(DriftCorrection { length, amplified: length * length / largest })
    }

    /// The full inspection. `last`: the last one, with the correction at this state.
    fn inspect_fully(
        &mut self,
        model: &M,
        state: &M::State,
        h: f64,
        residuals: &(M::Residual, M::Rows),
        last: Option<(DriftInspection<M::Rows>, DriftCorrection)>,
    ) -> Result<DriftVerdict, SolveError> {
        // How far: by the lower bound of all sizes first, then row by row.
        let mut here: ProbedState<M> =
            ProbedState { residual: residuals.0, lengths: M::Rows::zeros(), weights: M::Vector::zeros() };
        let (limit, least) = (self.drift_limit, self.least_size(model));
        let distances = Distances::of(model, state, &mut self.workspace);
        (0..M::Rows::LEN).for_each(|row| here.lengths[row] = norm(distances.gradients.row(row)));
        let is_small = |row: usize, residual: f64| residual.abs() <= limit * least * here.lengths[row];
        let mut rows = active_rows::<M>(state.active_set(), false);
        let all_small = rows.all(|row| {
            (row >= M::Residual::LEN || is_small(row, residuals.0[row])) && is_small(row, residuals.1[row])
        });
        if !all_small && let Some(drifted) = find_drifted(model, state, limit, residuals, &distances) {
            return Ok(DriftVerdict::TooFar(drifted));
        }
        // The influence. The workspace begins with M, which was found along with the gradients.
        let n = M::Vector::LEN;
        (0..n).for_each(|i| here.weights[i] = self.workspace[i * (n + 1)]);
        weigh(here.weights.as_mut_slice());
        let mut probe = DriftProbe::new(model, &self.constants, state, &here, &mut self.workspace);
        let similar = last.filter(|(last, _)| last.has_similar_lengths(&here.lengths));
        let reference_lengths =
            similar.map_or_else(|| probe.reference_lengths(), |(last, _)| last.reference_lengths);
        let influence = probe.influence(&reference_lengths)?;
        if self.counts.turned.is_none_or(|turned| influence > turned.part) {
            self.counts.turned = Some(DriftInfluence { part: influence, time: state.t() });
        }
        // What predicts the influence of the next steps.
        let steps = last.map_or(MIN_STEPS_UNINSPECTED, |(last, DriftCorrection { amplified, .. })| {
            last.next_steps(influence <= CONFIRMED_PREDICTION * last.predicts(amplified))
        });
        let correction = similar
            .map(|(_, correction)| correction)
            .or_else(|| self.drift_correction(model, state, h, residuals, &reference_lengths));
        // At rest only a part of the influence is seen, so nothing is predicted from it.
        let correction = correction.filter(|_| max_abs(state.u().as_slice()) > 0.0);
        self.last_inspection = correction.map(|DriftCorrection { amplified, .. }| DriftInspection {
            active_set: state.active_set(),
            lengths: here.lengths,
            reference_lengths,
            influence,
            amplified,
            steps,
            steps_left: steps,
        });
        Ok(match influence > MAX_DRIFT_INFLUENCE {
            true => DriftVerdict::Decides {
                part: influence,
                shortened: self.shortening(model, state, &reference_lengths),
            },
            false => DriftVerdict::Harmless,
        })
    }

    /// The largest reference length of a gradient over its length.
    #[cold]
    fn shortening(&mut self, model: &M, state: &M::State, reference_lengths: &M::Rows) -> f64 {
        let gradients = Gradients::alone(model, state, &mut self.workspace);
        let rows = active_rows::<M>(state.active_set(), false);
        rows.map(|row| reference_lengths[row] / norm(gradients.row(row))).fold(1.0, math::max)
    }
}

/// The first row whose positions or velocities have drifted by more than the part `limit` of their
/// [size](size_along).
#[cold]
fn find_drifted<M: Constraints>(
    model: &M,
    state: &M::State,
    limit: f64,
    (position, velocity): &(M::Residual, M::Rows),
    distances: &Distances<'_>,
) -> Option<Drifted> {
    if !limit.is_finite() {
        return None;
    }
    let drifted = |level: ConstraintLevel, row: usize, residual, values: &M::Vector| {
        let distance = distances.distance(row, residual);
        let limit = limit * size_along(model, values.as_slice(), distances.gradients.row(row));
        // Negated, so that a distance or a limit that is not a number is reported.
        let is_permitted = distance <= limit;
        (!is_permitted).then_some(Drifted {
            what: level.name(),
            row: M::ROWS[row].name,
            residual,
            distance,
            limit,
        })
    };
    active_rows::<M>(state.active_set(), false).find_map(|row| {
        let position = (row < M::Residual::LEN).then(|| position[row]);
        position
            .and_then(|position| drifted(ConstraintLevel::Positions, row, position, state.q()))
            .or_else(|| drifted(ConstraintLevel::Velocities, row, velocity[row], state.u()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::SVector;

    type R = SVector<f64, 2>;

    /// An inspection counts for 3, 6, 12, 12, … steps, and for 3 again once it is not confirmed. Older ones
    /// predict with less certainty.
    #[test]
    fn predictions_are_trusted_as_they_are_confirmed() {
        let of = |steps, steps_left| DriftInspection {
            active_set: ActiveSet::ALL_HOLD,
            lengths: R::new(1.0, 1.0),
            reference_lengths: R::new(1.0, 5.0),
            influence: 2e-9,
            amplified: 1e-6,
            steps,
            steps_left,
        };
        assert_eq!([3, 6, 12].map(|steps| of(steps, steps).next_steps(true)), [6, 12, 12]);
        assert_eq!(of(12, 4).next_steps(false), MIN_STEPS_UNINSPECTED);
        assert_eq!([12, 10, 7, 1].map(|left| of(12, left).age()), [1.0, 1.0, 2.0, 4.0]);
        assert!((of(3, 3).predicts(3e-6) - 6e-9).abs() < 1e-24);
        let similar = |[a, b]: [f64; 2]| of(3, 3).has_similar_lengths(&R::new(a, b));
        assert!(similar([0.6, 1.0]) && similar([1.9, 9.0]) && !similar([0.4, 1.0]) && !similar([1.0, 11.0]));
        assert!(!similar([f64::NAN, 1.0]));
    }
}

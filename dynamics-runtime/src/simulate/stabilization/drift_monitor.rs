//! What constraints have drifted where a formulation lets them: how far, and whether it decides where the
//! motion goes on.
//!
//! A close look, at both, takes as long as half a step of a high order (Andrews' mechanism, Verner 9(8));
//! with what follows a tenth of one is left. Most steps are far from where it matters, and one correction
//! tells: with δ = Φ_q⁺r, rᵢ = |Φᵢ| + h|Φ̇ᵢ| + rounding, no row is missed by more than |δ|, as
//! |rᵢ| = |Φ_q,ᵢ δ| ≤ ‖Φ_q,ᵢ‖ |δ|, nor its rate by more than |δ|/h. What drift decides is c/(kx)² at a
//! distance x from a singular position (see [`crate::simulate::diagnosis::singular_position`]), |δ| is
//! c/(kx), and by how much δ is larger than r is 1/x: the product of both is in proportion to what a close
//! look finds, and foretells it from the last one.

use crate::constrain::Gradients;
use crate::constrain::active_set::active_rows;
use crate::constrain::assemble::{least_size, size_along, weigh};
use crate::error::SolveError;
use crate::linalg::{max_abs, norm};
use crate::math;
use crate::model::{Constraints, ModelState, Modes, Vector};
use crate::simulate::stabilization::adaptive_gain::DriftInfluence;
use crate::simulate::stabilization::near_singular::{DECIDED, DriftProbe, ProbedState};
use crate::simulate::stabilization::{Distances, Stabilization};

/// Steps without a close look: directions change. Twice as many after each that found no more than [`SURE`]
/// times what was foretold.
const FEWEST: u32 = 3;
const MOST_STEPS_UNSEEN: u32 = 12;
const SURE: f64 = 3.0;
/// What is foretold below this part of the motion is not looked at, a three-hundredth of what summaries warn
/// of; from [`FEWEST`] steps on the less the older it is. Of 675,000 steps of four-bars, slider-cranks and
/// chains of rods through and past their change points that were passed over, by four methods at tolerances
/// from 1e-3 to 1e-9 and two in fixed steps, none was beyond what is warned of, 2.7e-4 at most, an eightieth
/// of what ends a motion; nor was one with [`FEWEST`] steps at most, with the same 2.7e-4. Were the age of it
/// nothing, one would have been.
const INSPECTED_DRIFT: f64 = 1e-6;

/// A constraint that has drifted too far.
pub(crate) struct Drifted {
    pub(crate) what: &'static str,
    pub(crate) row: &'static str,
    pub(crate) residual: f64,
    pub(crate) distance: f64,
    pub(crate) limit: f64,
}

/// What a close look says of a step.
pub(crate) enum DriftVerdict {
    Harmless,
    TooFar(Drifted),
    /// Where the motion goes on: what part of it, and by how much a gradient is shorter there than beside it.
    Decides {
        part: f64,
        shortened: f64,
    },
}

/// What a close look found, by which the steps after it are judged.
#[derive(Clone, Copy)]
pub(crate) struct DriftInspection<R> {
    modes: Modes,
    /// Lengths of the gradients, and those of [`DriftProbe::usual`].
    lengths: R,
    usual: R,
    /// Part of the motion that drift decides, for |δ|²/|r| of this.
    part: f64,
    reach: f64,
    /// Steps for which that may do, and those of them that are left.
    steps: u32,
    left: u32,
}

impl<R: Vector> DriftInspection<R> {
    /// The part of the motion that drift decides where |δ|²/|r| is this.
    fn foretells(&self, reach: f64) -> f64 {
        self.part / self.reach * reach
    }

    /// For how many times as many steps as the fewest this has done, at least 1.
    fn age(&self) -> f64 {
        math::max(1.0, f64::from(self.steps - self.left + 1) / f64::from(FEWEST))
    }

    /// For how many steps a close look may do that found no more than was foretold, or more.
    fn trust(&self, foretold: bool) -> u32 {
        if foretold { (2 * self.steps).min(MOST_STEPS_UNSEEN) } else { FEWEST }
    }

    /// Whether gradients are about as long as they were: then their usual lengths are those of then.
    fn is_alike(&self, lengths: &R) -> bool {
        let alike =
            |row: usize| 0.5 * self.lengths[row] <= lengths[row] && lengths[row] <= 2.0 * self.usual[row];
        (0..R::LEN).all(alike)
    }
}

/// |δ| and |δ|²/|r| of this file's header, r in parts of the lengths of gradients.
#[derive(Clone, Copy)]
struct Reach {
    delta: f64,
    reach: f64,
}

impl<M: Constraints> Stabilization<M> {
    /// What the constraints have drifted up to the end of a step of length `h`: how far, and whether that
    /// decides where the motion goes on, see [`crate::simulate::stabilization::near_singular`].
    #[inline]
    pub(crate) fn look(&mut self, model: &M, state: &M::State, h: f64) -> Result<DriftVerdict, SolveError> {
        let missed = (model.residual(state), model.velocity_residual(state));
        let last = self.look.filter(|look| look.modes == state.modes());
        let last = last.and_then(|look| Some((look, self.reach(model, state, h, &missed, &look.usual)?)));
        if let Some((look, Reach { delta, reach })) = last {
            let least = self.drift_limit * self.least_size(model);
            let little = reach > 0.0 && look.age() * look.foretells(reach) <= INSPECTED_DRIFT;
            if look.left > 0 && little && delta <= least && delta <= h.abs() * least {
                self.look = Some(DriftInspection { left: look.left - 1, ..look });
                return Ok(DriftVerdict::Harmless);
            }
        }
        self.look_closely(model, state, h, &missed, last)
    }

    /// By less no row is judged.
    fn least_size(&mut self, model: &M) -> f64 {
        *self.least_size.get_or_insert_with(|| least_size(model))
    }

    /// From what is missed of positions and velocities; `None` where there is no generated code.
    #[inline]
    fn reach(
        &self,
        model: &M,
        state: &M::State,
        h: f64,
        (position, velocity): &(M::Residual, M::Rows),
        usual: &M::Rows,
    ) -> Option<Reach> {
        let rounding = f64::EPSILON * (1.0 + max_abs(state.q().as_slice()));
        let (mut right, mut most) = (M::Rows::zeros(), 0.0);
        for row in active_rows::<M>(state.modes(), false) {
            let position = if row < M::Residual::LEN { position[row] } else { 0.0 };
            let off = position.abs() + (h * velocity[row]).abs() + rounding * usual[row];
            right[row] = off.copysign(position);
            most = math::max(most, off / usual[row]);
        }
        let delta = model.correct_unrolled(&self.constants, state, &right)?;
        let delta = math::sqrt(delta.as_slice().iter().map(|x| x * x).sum());
        Some(Reach { delta, reach: delta * delta / most })
    }

    /// The same closely. `last`: what the last close look found, and what that foretells.
    fn look_closely(
        &mut self,
        model: &M,
        state: &M::State,
        h: f64,
        missed: &(M::Residual, M::Rows),
        last: Option<(DriftInspection<M::Rows>, Reach)>,
    ) -> Result<DriftVerdict, SolveError> {
        let mut here: ProbedState<M> =
            ProbedState { residual: missed.0, lengths: M::Rows::zeros(), weights: M::Vector::zeros() };
        let (limit, least) = (self.drift_limit, self.least_size(model));
        let distances = Distances::of(model, state, &mut self.workspace);
        (0..M::Rows::LEN).for_each(|row| here.lengths[row] = norm(distances.gradients.row(row)));
        let little = |row: usize, residual: f64| residual.abs() <= limit * least * here.lengths[row];
        let mut rows = active_rows::<M>(state.modes(), false);
        let all = rows
            .all(|row| (row >= M::Residual::LEN || little(row, missed.0[row])) && little(row, missed.1[row]));
        if !all && let Some(drifted) = drifted(model, state, limit, missed, &distances) {
            return Ok(DriftVerdict::TooFar(drifted));
        }
        // M has been found along with the gradients.
        let n = M::Vector::LEN;
        (0..n).for_each(|i| here.weights[i] = self.workspace[i * (n + 1)]);
        weigh(here.weights.as_mut_slice());
        let mut probe = DriftProbe::new(model, &self.constants, state, &here, &mut self.workspace);
        let kept = last.filter(|(look, _)| look.is_alike(&here.lengths));
        let usual = kept.map_or_else(|| probe.usual(), |(look, _)| look.usual);
        let part = probe.part(&usual)?;
        if self.counts.turned.is_none_or(|turned| part > turned.part) {
            self.counts.turned = Some(DriftInfluence { part, time: state.t() });
        }
        let steps = last
            .map_or(FEWEST, |(look, Reach { reach, .. })| look.trust(part <= SURE * look.foretells(reach)));
        let reach = kept.map(|(_, reach)| reach).or_else(|| self.reach(model, state, h, missed, &usual));
        // At rest only a part of what drift decides is seen.
        let reach = reach.filter(|_| max_abs(state.u().as_slice()) > 0.0);
        let (modes, lengths) = (state.modes(), here.lengths);
        self.look = reach.map(|Reach { reach, .. }| DriftInspection {
            modes,
            lengths,
            usual,
            part,
            reach,
            steps,
            left: steps,
        });
        Ok(match part > DECIDED {
            true => DriftVerdict::Decides { part, shortened: self.shortened(model, state, &usual) },
            false => DriftVerdict::Harmless,
        })
    }

    /// Usual over actual length of the gradient that is shortened most.
    #[cold]
    fn shortened(&mut self, model: &M, state: &M::State, usual: &M::Rows) -> f64 {
        let gradients = Gradients::alone(model, state, &mut self.workspace);
        let rows = active_rows::<M>(state.modes(), false);
        rows.map(|row| usual[row] / norm(gradients.row(row))).fold(1.0, math::max)
    }
}

/// The row that has drifted further than permitted, in its positions or its velocities: further than a part
/// `limit` of its [size](size_along).
#[cold]
fn drifted<M: Constraints>(
    model: &M,
    state: &M::State,
    limit: f64,
    (position, velocity): &(M::Residual, M::Rows),
    distances: &Distances<'_>,
) -> Option<Drifted> {
    if !limit.is_finite() {
        return None;
    }
    let drifted = |what, row: usize, residual, values: &M::Vector| {
        let distance = distances.along(row, residual);
        let limit = limit * size_along(model, values.as_slice(), distances.gradients.row(row));
        // What is not a number, on either side, has drifted.
        let kept = distance <= limit;
        (!kept).then_some(Drifted { what, row: M::ROWS[row].name, residual, distance, limit })
    };
    active_rows::<M>(state.modes(), false).find_map(|row| {
        let position = (row < M::Residual::LEN).then(|| position[row]);
        position
            .and_then(|position| drifted("positions", row, position, state.q()))
            .or_else(|| drifted("velocities", row, velocity[row], state.u()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::SVector;

    type R = SVector<f64, 2>;

    /// 3, 6, 12, 12, …, and 3 again after more was found than foretold; what is older than three steps is
    /// believed less.
    #[test]
    fn what_is_foretold_is_trusted_as_it_proves_true() {
        let of = |steps, left| DriftInspection {
            modes: Modes::ALL_HOLD,
            lengths: R::new(1.0, 1.0),
            usual: R::new(1.0, 5.0),
            part: 2e-9,
            reach: 1e-6,
            steps,
            left,
        };
        assert_eq!([3, 6, 12].map(|steps| of(steps, steps).trust(true)), [6, 12, 12]);
        assert_eq!(of(12, 4).trust(false), FEWEST);
        assert_eq!([12, 10, 7, 1].map(|left| of(12, left).age()), [1.0, 1.0, 2.0, 4.0]);
        assert!((of(3, 3).foretells(3e-6) - 6e-9).abs() < 1e-24);
        let alike = |[a, b]: [f64; 2]| of(3, 3).is_alike(&R::new(a, b));
        assert!(alike([0.6, 1.0]) && alike([1.9, 9.0]) && !alike([0.4, 1.0]) && !alike([1.0, 11.0]));
        assert!(!alike([f64::NAN, 1.0]));
    }
}

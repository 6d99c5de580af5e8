//! What constraints have drifted where a formulation lets them: how far, and whether it decides where the motion goes on.
//!
//! A close look, at both, takes as long as half a step of a high order (Andrews' mechanism, Verner 9(8)); with what follows a tenth of one is left. Most steps are far from where it matters, and one correction tells: with
//! δ = Φ_q⁺r, rᵢ = |Φᵢ| + h|Φ̇ᵢ| + rounding, no row is missed by more than |δ|, as |rᵢ| = |Φ_q,ᵢ δ| ≤ ‖Φ_q,ᵢ‖ |δ|, nor its rate by more than |δ|/h. What
//! drift decides is c/(kx)² at a distance x from a singular position (see [`super::super::singular`]), |δ| is c/(kx), and by how much δ is larger than r is 1/x: the product of
//! both is in proportion to what a close look finds, and foretells it from the last one.

use super::super::pace::Turned;
use super::super::singular::{self, Decided};
use super::{Distances, Upkeep};
use crate::constrain::Gradients;
use crate::constrain::assemble::{least_size, size_along};
use crate::constrain::held::active_rows;
use crate::constrain::memory::{max_abs, norm};
use crate::error::SolveError;
use crate::math;
use crate::model::{Constraints, ModelState, Modes, Vector};

/// Most steps without a close look: directions change.
const MOST: u32 = 3;
/// What is foretold below this part of the motion is not looked at, a three-hundredth of what summaries warn of. Of 324,000 steps of linkages through their change
/// points 97 % were passed over, with three times as much and twice as many between looks: four of them were beyond what is warned of, 6.8e-4 at most, a thirtieth of what ends a
/// motion.
const FAR: f64 = 1e-6;

/// A constraint that has drifted too far.
pub(crate) struct Drifted {
    pub(crate) what: &'static str,
    pub(crate) row: &'static str,
    pub(crate) residual: f64,
    pub(crate) distance: f64,
    pub(crate) limit: f64,
}

/// What a close look found, by which the steps after it are judged.
#[derive(Clone, Copy)]
pub(super) struct Look<R> {
    modes: Modes,
    /// Lengths of the gradients.
    usual: R,
    /// Part of the motion that drift decides, for |δ|²/|r| of this.
    part: f64,
    reach: f64,
    /// Steps for which that may do.
    left: u32,
}

/// |δ| and |δ|²/|r| of this file's header, r in parts of the lengths of gradients.
#[derive(Clone, Copy)]
struct Reach {
    delta: f64,
    reach: f64,
}

impl<M: Constraints> Upkeep<M> {
    /// Whether nothing of what has drifted up to the end of a step of length `h` can matter, as far as that is told without a close look.
    #[inline]
    pub(crate) fn is_far(&mut self, model: &M, state: &M::State, h: f64) -> bool {
        let Some(look) = self.look.filter(|look| look.left > 0 && look.modes == state.modes()) else { return false };
        let Some(Reach { delta, reach }) = self.reach(model, state, h, &look.usual) else { return false };
        // No row is judged by less.
        let least = self.drift_limit * least_size(model);
        let little = reach > 0.0 && look.part * reach <= FAR * look.reach;
        let far = little && delta <= least && delta <= h.abs() * least;
        self.look = Some(Look { left: look.left - 1, ..look });
        far
    }

    /// `None` where there is no generated code.
    #[inline]
    fn reach(&self, model: &M, state: &M::State, h: f64, usual: &M::Rows) -> Option<Reach> {
        let (position, velocity) = (model.residual(state), model.velocity_residual(state));
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

    /// The row that has drifted further than permitted, in its positions or its velocities.
    pub(crate) fn drifted(&mut self, model: &M, state: &M::State) -> Option<Drifted> {
        if M::Rows::LEN == 0 || !self.drift_limit.is_finite() {
            return None;
        }
        let (position, velocity) = (model.residual(state), model.velocity_residual(state));
        let distances = Distances::of(model, state, &mut self.workspace);
        let drifted = |what, row: usize, residual, values: &M::Vector| {
            let distance = distances.along(row, residual);
            let limit = self.drift_limit * size_along(model, values.as_slice(), distances.gradients.row(row));
            let row = M::ROWS[row].name;
            // What is not a number, on either side, has drifted.
            let kept = distance <= limit;
            (!kept).then_some(Drifted { what, row, residual, distance, limit })
        };
        active_rows::<M>(state.modes(), false).find_map(|row| {
            let position = (row < M::Residual::LEN).then(|| position[row]);
            position
                .and_then(|position| drifted("positions", row, position, state.q()))
                .or_else(|| drifted("velocities", row, velocity[row], state.u()))
        })
    }

    /// Whether what the constraints have drifted up to the end of a step of length `h` decides where the motion goes on, see [`super::singular`]: the part of it, and by how
    /// much a gradient is shorter there than beside it.
    pub(crate) fn drift_decides(
        &mut self,
        model: &M,
        state: &M::State,
        h: f64,
    ) -> Result<Option<(f64, f64)>, SolveError> {
        let found = singular::part_of_drift(model, &self.constants, state, &mut self.workspace)?;
        let Decided { part, usual } = found;
        if self.upkept.turned.is_none_or(|turned| part > turned.part) {
            self.upkept.turned = Some(Turned { part, time: state.t() });
        }
        // At rest only a part of what drift decides is seen.
        let moves = max_abs(state.u().as_slice()) > 0.0;
        self.look = self.reach(model, state, h, &usual).filter(|_| moves).map(|Reach { reach, .. }| Look {
            modes: state.modes(),
            usual,
            part,
            reach,
            left: MOST,
        });
        Ok((part > singular::DECIDED).then(|| (part, self.shortened(model, state, &usual))))
    }

    /// Usual over actual length of the gradient that is shortened most.
    #[cold]
    fn shortened(&mut self, model: &M, state: &M::State, usual: &M::Rows) -> f64 {
        let gradients = Gradients::alone(model, state, &mut self.workspace);
        let rows = active_rows::<M>(state.modes(), false);
        rows.map(|row| usual[row] / norm(gradients.row(row))).fold(1.0, math::max)
    }
}

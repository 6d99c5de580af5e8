//! What drift decides near a singular position.

use crate::constrain::Gradients;
use crate::constrain::active_set::active_rows;
use crate::constrain::nearby::{NEARBY_DISTANCE, nearby_state};
use crate::error::SolveError;
use crate::linalg::{max_abs, norm};
use crate::model::{Constraints, ModelState, Vector};
use crate::simulate::stabilization::singular_start::combined;
use crate::{constrain, math};

/// Up to here the size of a coordinate counts: angles count revolutions.
pub(crate) const TURNS: f64 = 10.0;

/// Part of the velocity, or of the step back to the constraints, that may be decided by drift.
pub(crate) const DECIDED: f64 = 0.02;

/// Displacement by which second derivatives are measured, against the size of the coordinates.
const PROBE: f64 = 1e-4;

/// What is known of a state of which it is asked what drift decides there.
pub(crate) struct ProbedState<M: Constraints> {
    /// Φ.
    pub(crate) residual: M::Residual,
    /// Lengths of the rows' gradients.
    pub(crate) lengths: M::Rows,
    /// √Mᵢᵢ, see [`weigh`](crate::constrain::assemble::weigh).
    pub(crate) weights: M::Vector,
}

/// What drift decides at a state.
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

    /// The part of the motion that drift decides: from [`DECIDED`] on it is nearer to a singular position
    /// than its drift permits. `usual`: see [`Self::usual`].
    pub(crate) fn part(&mut self, usual: &M::Rows) -> Result<f64, SolveError> {
        let (state, residual) = (self.state, self.drift(usual));
        let delta = self.back(&residual, -1.0)?;
        let (length, speed) = (self.length(&delta), self.length(state.u()));
        if length == 0.0 {
            return Ok(0.0);
        }
        // Φ_qq δ² by a displacement along δ; Φ_qq δ q̇ by two along the sum and the difference of both at the
        // same length.
        let scale = PROBE * self.size() / length;
        let straight = scaled(&delta, scale);
        let curved = combined(&self.second(&straight), 1.0, &self.here.residual, -2.0);
        let newton = self.back(&curved, 0.5 / (scale * scale))?;
        let contracts = self.length(&newton) / length;
        if contracts > DECIDED || speed == 0.0 {
            return Ok(contracts);
        }
        let pace = scale * length / speed;
        let [plus, minus] =
            [1.0, -1.0].map(|sign| self.second(&combined(&straight, 1.0, state.u(), sign * pace)));
        let mixed = combined(&plus, 1.0, &minus, -1.0);
        let turning = self.back(&mixed, 0.25 / (scale * pace))?;
        Ok(math::max(contracts, self.length(&turning) / speed))
    }

    /// Lengths of the rows' gradients; of those that nearly vanish, by how much they grow beside the state.
    pub(crate) fn usual(&mut self) -> M::Rows {
        let mut usual = self.here.lengths;
        let nearby = nearby_state::<M>(self.state);
        let gradients = Gradients::alone(self.model, &nearby, self.workspace);
        for row in 0..M::Rows::LEN {
            usual[row] =
                math::max(usual[row], (norm(gradients.row(row)) - usual[row]).abs() / NEARBY_DISTANCE);
        }
        usual
    }

    /// Φ, with what rounding leaves open of it: no drift is known to be less. Of rows whose gradient nearly
    /// vanishes, too.
    fn drift(&self, usual: &M::Rows) -> M::Residual {
        let rounding = f64::EPSILON * (1.0 + max_abs(self.state.q().as_slice()).min(TURNS));
        let mut drift = self.here.residual;
        for row in 0..M::Residual::LEN {
            drift[row] += (rounding * usual[row]).copysign(drift[row]);
        }
        drift
    }

    /// factor · Φ_q⁺ of values of the holonomic rows.
    fn back(&mut self, values: &M::Residual, factor: f64) -> Result<M::Vector, SolveError> {
        let mut right = M::Rows::zeros();
        for row in active_rows::<M>(self.state.modes(), true) {
            right[row] = factor * values[row];
        }
        constrain::correct(self.model, self.constants, self.state, &right, self.workspace)
    }

    fn length(&self, x: &M::Vector) -> f64 {
        math::sqrt(
            x.as_slice().iter().zip(self.here.weights.as_slice()).map(|(x, w)| (x * w) * (x * w)).sum(),
        )
    }

    /// ‖w (1 + |q|)‖, see [`TURNS`].
    fn size(&self) -> f64 {
        let terms = self.state.q().as_slice().iter().zip(self.here.weights.as_slice());
        math::sqrt(terms.map(|(q, w)| math::powi(w * (1.0 + q.abs().min(TURNS)), 2)).sum())
    }

    /// Φ(q + x) + Φ(q − x) = 2Φ(q) + Φ_qq x², but for terms of the fourth order; Φ(q) drops out of
    /// differences.
    fn second(&self, x: &M::Vector) -> M::Residual {
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

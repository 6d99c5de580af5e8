//! Events whose function is what an engaged constraint holds at zero: the sign of such a function is that of
//! rounding, or of drift.
//!
//! A function is held where its gradient is made of those of the constraints that hold, and its value is no
//! more than what rounding, or the drift of these constraints, leaves; and this not at an instant but all
//! over a step. Of functions of positions alone the gradient by coordinates counts, of others that by
//! velocities.

use alloc::vec;
use alloc::vec::Vec;

use crate::constrain::Gradients;
use crate::constrain::active_set::active_rows;
use crate::linalg::{dot, max_abs};
use crate::math;
use crate::model::{Known, ModelState, SimulationModel, Vector};
use crate::simulate::events::functions::EventFunctions;
use crate::simulate::failure::SimulationErrorKind as Fault;

/// Displacements for differences, in parts of 1 + |x|.
const DIFFERENCE_STEP: f64 = 1e-6;
/// A gradient that the constraints leave less of than this part is made of theirs.
const LEFT: f64 = 1e-5;
/// Parts of 1 + |q| + |u| that rounding may leave of a function over the length of its gradient.
const ROUNDED: f64 = 1e-13;
/// Times that of the drift of the constraints.
const DRIFTED: f64 = 10.0;

impl<M: SimulationModel> EventFunctions<'_, M> {
    /// Whether a function is zero at a state, and stays so, because constraints hold.
    pub(crate) fn is_kept(&self, index: usize, state: &M::State, scratch: &mut [f64]) -> Result<bool, Fault> {
        let value = self.value(index, state, scratch)?;
        if M::IS_FREE {
            return Ok(false);
        }
        let (mut of_positions, mut of_velocities) = (vec![0.0; M::Vector::LEN], vec![0.0; M::Vector::LEN]);
        for j in 0..M::Vector::LEN {
            of_positions[j] = self.slope(index, state, |state| &mut state.q_mut()[j], scratch)?;
            of_velocities[j] = self.slope(index, state, |state| &mut state.u_mut()[j], scratch)?;
        }
        let moves = of_velocities.iter().any(|x| *x != 0.0);
        let mut gradient = if moves { of_velocities } else { of_positions };
        let length = math::sqrt(dot(&gradient, &gradient));
        let mut workspace = self.workspace();
        let gradients = Gradients::alone(self.model, state, &mut workspace);
        let rows: Vec<usize> = active_rows::<M>(state.modes(), !moves).collect();
        let (residual, rates) = (self.model.residual(state), self.model.velocity_residual(state));
        let off = |row: &usize| if moves { rates[*row] } else { residual[*row] };
        let drift = rows.iter().map(|row| gradients.distance(*row, off(row))).fold(0.0, f64::max);
        let size = 1.0 + max_abs(state.q().as_slice()) + max_abs(state.u().as_slice());
        if !(length > 0.0 && value.abs() <= length * (ROUNDED * size + DRIFTED * drift)) {
            return Ok(false);
        }
        project_out(&mut gradient, rows.iter().map(|row| gradients.row(*row)));
        Ok(math::sqrt(dot(&gradient, &gradient)) <= LEFT * length)
    }

    /// The derivative of a function by a number of the state.
    fn slope(
        &self,
        index: usize,
        state: &M::State,
        number: impl Fn(&mut M::State) -> &mut f64,
        scratch: &mut [f64],
    ) -> Result<f64, Fault> {
        let mut beside = *state;
        let x = *number(&mut beside);
        let epsilon = DIFFERENCE_STEP * (1.0 + x.abs());
        *number(&mut beside) = x + epsilon;
        let up = self.value(index, &beside, scratch)?;
        *number(&mut beside) = x - epsilon;
        let down = self.value(index, &beside, scratch)?;
        Ok((up - down) / (2.0 * epsilon))
    }
}

/// Takes out of a vector what it has along others.
fn project_out<'g>(vector: &mut [f64], others: impl Iterator<Item = &'g [f64]>) {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let take = |from: &mut [f64], unit: &[f64]| {
        let along = dot(from, unit);
        from.iter_mut().zip(unit).for_each(|(x, e)| *x -= along * e);
    };
    for other in others {
        let mut unit = other.to_vec();
        let length = math::sqrt(dot(&unit, &unit));
        // Twice is enough.
        (0..2).for_each(|_| basis.iter().for_each(|e| take(&mut unit, e)));
        let left = math::sqrt(dot(&unit, &unit));
        if left > 1e-9 * length {
            unit.iter_mut().for_each(|x| *x /= left);
            basis.push(unit);
        }
    }
    (0..2).for_each(|_| basis.iter().for_each(|e| take(vector, e)));
}

//! Masked events: functions that an engaged constraint holds at zero, so that their sign is that of rounding
//! or drift.
//!
//! A function g is masked where its gradient is a combination of the gradients of the constraints that hold,
//! and its value is no more than rounding or the drift of these constraints explains. `location.rs` asks at
//! four states of a step, as this may be so at an instant by chance. For functions of positions alone the
//! gradient by coordinates counts, for others the gradient by velocities. The summary lists masked events.

use alloc::vec;
use alloc::vec::Vec;

use crate::constrain::Gradients;
use crate::constrain::active_set::active_rows;
use crate::linalg::{dot, max_abs};
use crate::math;
use crate::model::{ModelState, SimulationModel, StaticTraits, Vector};
use crate::simulate::events::functions::EventFunctions;
use crate::simulate::failure::SimulationErrorKind as Kind;

/// Displacement for central differences, in parts of 1 + |x|: near ε^(1/3), where truncation and rounding
/// errors are both small.
const DIFFERENCE_STEP: f64 = 1e-6;
/// Largest part of a gradient orthogonal to those of the constraints, for which it is a combination of
/// theirs. It is above the error of the differences, about 1e-10. A larger bound might mask an event that is
/// nearly tangent to the constraints.
const MAX_FREE_GRADIENT: f64 = 1e-5;
/// Largest |g| over the length of its gradient that counts as rounding, in parts of 1 + |q| + |q̇|.
const MAX_ROUNDING_VALUE: f64 = 1e-13;
/// Largest |g| over the length of its gradient that counts as drift, in units of the drift of the
/// constraints: a combination of several rows may have more than each of them.
const MAX_DRIFTS: f64 = 10.0;

/// Gradients of which this part or less is orthogonal to the others are dependent.
const MIN_INDEPENDENT_PART: f64 = 1e-9;

impl<M: SimulationModel> EventFunctions<'_, M> {
    /// Whether constraints that hold keep a function at zero at a state.
    pub(crate) fn is_masked(
        &self,
        index: usize,
        state: &M::State,
        scratch: &mut [f64],
    ) -> Result<bool, Kind> {
        let value = self.value(index, state, scratch)?;
        if M::IS_UNCONSTRAINED {
            return Ok(false);
        }
        let (mut of_positions, mut of_velocities) = (vec![0.0; M::Vector::LEN], vec![0.0; M::Vector::LEN]);
        for j in 0..M::Vector::LEN {
            of_positions[j] = self.derivative(index, state, |state| &mut state.q_mut()[j], scratch)?;
            of_velocities[j] = self.derivative(index, state, |state| &mut state.u_mut()[j], scratch)?;
        }
        let depends_on_velocities = of_velocities.iter().any(|x| *x != 0.0);
        let mut gradient = if depends_on_velocities { of_velocities } else { of_positions };
        let length = math::sqrt(dot(&gradient, &gradient));
        let mut workspace = self.workspace();
        let gradients = Gradients::alone(self.model, state, &mut workspace);
        let rows: Vec<usize> = active_rows::<M>(state.active_set(), !depends_on_velocities).collect();
        let (residual, rates) = (self.model.residual(state), self.model.velocity_residual(state));
        let violation = |row: &usize| if depends_on_velocities { rates[*row] } else { residual[*row] };
        let drift = rows.iter().map(|row| gradients.distance(*row, violation(row))).fold(0.0, f64::max);
        let size = 1.0 + max_abs(state.q().as_slice()) + max_abs(state.u().as_slice());
        if !(length > 0.0 && value.abs() <= length * (MAX_ROUNDING_VALUE * size + MAX_DRIFTS * drift)) {
            return Ok(false);
        }
        project_out(&mut gradient, rows.iter().map(|row| gradients.row(*row)));
        Ok(math::sqrt(dot(&gradient, &gradient)) <= MAX_FREE_GRADIENT * length)
    }

    /// The derivative of a function by one coordinate or velocity.
    fn derivative(
        &self,
        index: usize,
        state: &M::State,
        number: impl Fn(&mut M::State) -> &mut f64,
        scratch: &mut [f64],
    ) -> Result<f64, Kind> {
        let mut displaced = *state;
        let x = *number(&mut displaced);
        let epsilon = DIFFERENCE_STEP * (1.0 + x.abs());
        *number(&mut displaced) = x + epsilon;
        let up = self.value(index, &displaced, scratch)?;
        *number(&mut displaced) = x - epsilon;
        let down = self.value(index, &displaced, scratch)?;
        Ok((up - down) / (2.0 * epsilon))
    }
}

/// Subtracts from a vector its components along others, by Gram–Schmidt orthogonalization.
fn project_out<'g>(vector: &mut [f64], others: impl Iterator<Item = &'g [f64]>) {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let take = |from: &mut [f64], unit: &[f64]| {
        let component = dot(from, unit);
        from.iter_mut().zip(unit).for_each(|(x, e)| *x -= component * e);
    };
    for other in others {
        let mut unit = other.to_vec();
        let length = math::sqrt(dot(&unit, &unit));
        // Two passes reach rounding level.
        (0..2).for_each(|_| basis.iter().for_each(|e| take(&mut unit, e)));
        let left = math::sqrt(dot(&unit, &unit));
        if left > MIN_INDEPENDENT_PART * length {
            unit.iter_mut().for_each(|x| *x /= left);
            basis.push(unit);
        }
    }
    (0..2).for_each(|_| basis.iter().for_each(|e| take(vector, e)));
}

//! Whether the linear equations have constant coefficients, as at an equilibrium or on a steady motion.
//!
//! Two tests. First, no independent velocity may accelerate. Second, the equations are assembled again at two
//! later times of the motion (the independent velocities stay, the coordinates go on), and the state matrix
//! must be the same there. Only states that have an influence on others are compared: the place of a vehicle
//! on a plane or the angle of a round wheel goes on, but nothing depends on it.

use dynamics_runtime::constrain::active_rows;
use dynamics_runtime::constrain::at_time;
use dynamics_runtime::constrain::solve_once;
use dynamics_runtime::model::{Constraints, ModelState, Vector};
use nalgebra::{DMatrix, DVector};

use super::reduce::Tangent;
use super::spectrum::drop_rounding;
use super::{Linearization, LinearizeError, ModelDerivatives, assemble};
use crate::displacement::{displaced, projected};

/// Largest acceleration at rest, relative to the acceleration that a displacement or velocity by its own size
/// (at least 1) would cause. It is about the error of an equilibrium from an iteration, or typed in with nine
/// digits.
const MAX_REST_ACCELERATION: f64 = 1e-8;
/// Largest acceleration at rest if nothing else gives a scale, in units of the velocity per second: rounding
/// of numbers near 1.
const ROUNDING_OF_ACCELERATIONS: f64 = 1e-14;
/// Largest change of the coefficients of a steady motion between now and the comparison times, relative to
/// the largest of their row. Coefficients that turn with the motion change by about 1e-2 in that time. A
/// larger value accepts slower changes, a smaller one refuses states that are steady only to a few digits.
pub(crate) const MAX_COEFFICIENT_CHANGE: f64 = 1e-7;
/// Times after which coefficients are compared, relative to the reciprocal of the largest velocity (1 s at
/// rest): a hundredth, and √7 hundredths. No period divides both, so no periodic coefficient is the same at
/// both.
pub(crate) const COMPARISON_TIMES: [f64; 2] = [1e-2, 2.645_751_311_064_590_7e-2];

/// Why the state is neither an equilibrium nor on a steady motion, so that eigenvalues have no meaning;
/// `None` if it is one of them.
pub(super) fn why_unsteady<M: Constraints>(
    model: &M,
    state: &M::State,
    linear: &Linearization,
    tangent: &Tangent,
) -> Option<LinearizeError> {
    // Without a state matrix there are no eigenvalues, and the error is that of `eigenvalues`.
    let mut a = linear.state_matrix().ok()?;
    drop_rounding(&mut a);
    if let Some(error) = accelerates(state, linear, tangent, &a) {
        return Some(error);
    }
    let rate = state.u().as_slice().iter().fold(1.0, |most: f64, u| most.max(u.abs()));
    let influential = influential_states(&a);
    for part in COMPARISON_TIMES {
        let Some((there, derivatives, tangent)) = state_after(model, state, tangent, part / rate) else {
            return Some(LinearizeError::Ends);
        };
        let then = assemble::<M>(&derivatives, &tangent);
        let Ok(mut b) = then.state_matrix() else { return Some(LinearizeError::Ends) };
        drop_rounding(&mut b);
        // A state without influence now may have a force later, for example the angle of a wheel that turns
        // to where a force acts on it.
        let is_moving = state.u().as_slice().iter().any(|u| *u != 0.0);
        if let Some(error) = accelerates(&there, &then, &tangent, &b).filter(|_| is_moving) {
            return Some(error);
        }
        if then.coordinates != linear.coordinates || then.velocities != linear.velocities {
            return Some(LinearizeError::Ends);
        }
        let of = |m: &DMatrix<f64>| m.select_rows(&influential).select_columns(&influential);
        let (now, then) = (of(&a), of(&b));
        // Row by row, because stiff rows are no scale for soft ones. But the rounding of stiff rows is in
        // all.
        let least =
            (a.nrows() as f64 * f64::EPSILON / MAX_COEFFICIENT_CHANGE * a.amax()).max(f64::MIN_POSITIVE);
        let of_row = |i: usize| (then.row(i) - now.row(i)).amax() / now.row(i).amax().max(least);
        let change = (0..now.nrows()).map(of_row).fold(0.0, f64::max);
        if change > MAX_COEFFICIENT_CHANGE {
            return Some(LinearizeError::Varies { change });
        }
    }
    None
}

/// The independent velocity with the largest acceleration relative to its scale, if one accelerates.
fn accelerates<S: ModelState>(
    state: &S,
    linear: &Linearization,
    tangent: &Tangent,
    a: &DMatrix<f64>,
) -> Option<LinearizeError> {
    let c = tangent.coordinates.len();
    let size = |x: f64| x.abs().max(1.0);
    let usual = |i: usize| {
        let of_z = tangent
            .coordinates
            .iter()
            .enumerate()
            .map(|(j, q)| a[(c + i, j)].abs() * size(state.q().as_slice()[*q]));
        let of_v = tangent
            .rates
            .iter()
            .enumerate()
            .map(|(j, q)| a[(c + i, c + j)].abs() * size(state.u().as_slice()[*q]));
        of_z.chain(of_v).fold(0.0, f64::max)
    };
    let excess = |i: &usize| {
        linear.accelerations[*i].abs() > MAX_REST_ACCELERATION * usual(*i) + ROUNDING_OF_ACCELERATIONS
    };
    let worst = (0..tangent.rates.len()).filter(excess).max_by(|i, j| {
        let of = |i: usize| linear.accelerations[i].abs() / usual(i).max(f64::MIN_POSITIVE);
        of(*i).total_cmp(&of(*j))
    })?;
    Some(LinearizeError::Accelerates {
        name: linear.velocities[worst].name,
        acceleration: linear.accelerations[worst],
    })
}

/// The states on which others depend, directly or through others. Columns of zeros are removed until none is
/// left.
fn influential_states(a: &DMatrix<f64>) -> alloc::vec::Vec<usize> {
    let mut left: alloc::vec::Vec<usize> = (0..a.nrows()).collect();
    while let Some(k) = left.iter().position(|j| left.iter().all(|i| a[(*i, *j)] == 0.0)) {
        left.remove(k);
    }
    left
}

/// The state after a short time on a motion whose independent velocities are constant, with the derivatives
/// and the tangent space there in the same coordinates; `None` if the motion or the model ends before.
pub(crate) fn state_after<M: Constraints>(
    model: &M,
    state: &M::State,
    tangent: &Tangent,
    after: f64,
) -> Option<(M::State, ModelDerivatives, Tangent)> {
    let constants = model.constants().ok()?;
    let solved = solve_once(model, &constants, state).ok()?;
    // Independent velocities are constant. Their accelerations are rounding, which stiff parts would turn
    // into a visible displacement within this time. So only the dependent parts of the accelerations are
    // used.
    let all = DVector::from_column_slice(solved.accelerations.as_slice());
    let dependent = &all - &tangent.velocities * all.select_rows(&tangent.rates);
    let step = state.u().as_slice().iter().zip(&dependent).map(|(u, a)| after * (u + 0.5 * after * a));
    let later = displaced(&at_time(state, state.t() + after), step);
    let mut later = projected(model, &constants, later).ok()?;
    let same = [tangent.coordinates.as_slice(), &tangent.rates];
    let at = |state: &M::State| {
        let derivatives = ModelDerivatives::of(model, state).ok()?;
        let tangent = Tangent::new(&derivatives.jacobian, derivatives.holonomic, &derivatives.mass, same);
        Some((derivatives, tangent))
    };
    // The independent velocities stay exactly as they are; the dependent ones follow from the constraints.
    let (_, there) = at(&later)?;
    let missed = model.velocity_residual(&later);
    let held = active_rows::<M>(state.active_set(), false).map(|row| missed.as_slice()[row]);
    let missed = DMatrix::from_iterator(there.row_count(), 1, held);
    let change = there.particular(&missed);
    later.u_mut().as_mut_slice().iter_mut().zip(change.iter()).for_each(|(u, d)| *u += d);
    let (derivatives, tangent) = at(&later)?;
    Some((later, derivatives, tangent))
}

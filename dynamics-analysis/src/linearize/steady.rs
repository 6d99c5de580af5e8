//! Whether the linear equations have constant coefficients, as at an equilibrium or on a steady motion.

use dynamics_runtime::constrain::active_rows;
use dynamics_runtime::constrain::at_time;
use dynamics_runtime::constrain::{project_positions, solve_once, with_workspace};
use dynamics_runtime::model::{Constraints, ModelState, Vector};
use nalgebra::{DMatrix, DVector};

use super::reduce::Tangent;
use super::spectrum::drop_rounding;
use super::{Linearization, LinearizeError, ModelDerivatives, assemble};

/// Accelerations below this part of what a displacement or velocity by 1, or by its own size, would cause
/// count as rest: about the error of an equilibrium that was iterated for, or typed in with nine digits.
const REST: f64 = 1e-8;
/// Change of coefficients over a hundredth of the motion's time scale that counts as one.
const CONSTANT: f64 = 1e-7;

/// Why eigenvalues would say nothing; `None` in an equilibrium and beside steady motions.
pub(super) fn judge<M: Constraints>(
    model: &M,
    state: &M::State,
    linear: &Linearization,
    tangent: &Tangent,
) -> Option<LinearizeError> {
    // What has no state matrix has no eigenvalues either.
    let mut a = linear.state_matrix().ok()?;
    drop_rounding(&mut a);
    if let Some(error) = accelerates(state, linear, tangent, &a) {
        return Some(error);
    }
    // At rest what moves is time, in seconds or whatever the unit is.
    let rate = state.u().as_slice().iter().fold(1.0, |most: f64, u| most.max(u.abs()));
    let essential = essential(&a);
    // No period divides both.
    for part in [1e-2, 2.645_751_311_064_590_7e-2] {
        let Some((there, read, tangent)) = later(model, state, tangent, part / rate) else {
            return Some(LinearizeError::Ends);
        };
        let then = assemble::<M>(&read, &tangent);
        let Ok(mut b) = then.state_matrix() else { return Some(LinearizeError::Ends) };
        drop_rounding(&mut b);
        // What only counts what happens may yet be pushed, later on, by what it has turned to.
        let is_moving = state.u().as_slice().iter().any(|u| *u != 0.0);
        if let Some(error) = accelerates(&there, &then, &tangent, &b).filter(|_| is_moving) {
            return Some(error);
        }
        if then.coordinates != linear.coordinates || then.velocities != linear.velocities {
            return Some(LinearizeError::Ends);
        }
        let of = |m: &DMatrix<f64>| m.select_rows(&essential).select_columns(&essential);
        let (now, then) = (of(&a), of(&b));
        // Row by row: what is stiff is no measure for the rest; but rounding of it is no change.
        let least = (a.nrows() as f64 * f64::EPSILON / CONSTANT * a.amax()).max(f64::MIN_POSITIVE);
        let of_row = |i: usize| (then.row(i) - now.row(i)).amax() / now.row(i).amax().max(least);
        let change = (0..now.nrows()).map(of_row).fold(0.0, f64::max);
        if change > CONSTANT {
            return Some(LinearizeError::Varies { change });
        }
    }
    None
}

/// The velocity that changes most, where some do.
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
    let excess = |i: &usize| linear.accelerations[*i].abs() > REST * usual(*i) + 1e-14;
    let worst = (0..tangent.rates.len()).filter(excess).max_by(|i, j| {
        let of = |i: usize| linear.accelerations[i].abs() / usual(i).max(f64::MIN_POSITIVE);
        of(*i).total_cmp(&of(*j))
    })?;
    Some(LinearizeError::Accelerates {
        name: linear.velocities[worst].name,
        acceleration: linear.accelerations[worst],
    })
}

/// The states on which others depend: without those that only count what happens, as the place on a plane or
/// the angle of a round wheel.
fn essential(a: &DMatrix<f64>) -> alloc::vec::Vec<usize> {
    let mut left: alloc::vec::Vec<usize> = (0..a.nrows()).collect();
    while let Some(k) = left.iter().position(|j| left.iter().all(|i| a[(*i, *j)] == 0.0)) {
        left.remove(k);
    }
    left
}

/// What is there a little later on a motion whose independent velocities stay.
pub(crate) fn later<M: Constraints>(
    model: &M,
    state: &M::State,
    tangent: &Tangent,
    after: f64,
) -> Option<(M::State, ModelDerivatives, Tangent)> {
    let constants = model.constants().ok()?;
    let solved = solve_once(model, &constants, state).ok()?;
    // Independent velocities stay: what rounding leaves of their rates, times the square of a time in which
    // what is stiff swings often, is no motion.
    let all = DVector::from_column_slice(solved.accelerations.as_slice());
    let dependent = &all - &tangent.velocities * all.select_rows(&tangent.rates);
    let mut later = at_time(state, state.t() + after);
    for i in 0..M::Vector::LEN {
        later.q_mut().as_mut_slice()[i] += after * (state.u().as_slice()[i] + 0.5 * after * dependent[i]);
    }
    with_workspace::<M, _>(|memory| project_positions(model, &constants, &mut later, memory)).ok()?;
    let same = [tangent.coordinates.as_slice(), &tangent.rates];
    let at = |state: &M::State| {
        let read = ModelDerivatives::of(model, state).ok()?;
        let tangent = Tangent::new(&read.jacobian, read.holonomic, &read.mass, same);
        Some((read, tangent))
    };
    // Dependent velocities follow from the others, which stay exactly as they are.
    let (_, there) = at(&later)?;
    let missed = model.velocity_residual(&later);
    let held = active_rows::<M>(state.modes(), false).map(|row| missed.as_slice()[row]);
    let missed = DMatrix::from_iterator(there.row_count(), 1, held);
    let change = there.particular(&missed);
    later.u_mut().as_mut_slice().iter_mut().zip(change.iter()).for_each(|(u, d)| *u += d);
    let (read, tangent) = at(&later)?;
    Some((later, read, tangent))
}

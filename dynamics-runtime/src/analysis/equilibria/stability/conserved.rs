//! Whether energy is conserved beside an equilibrium, the work of dead loads included.
//!
//! The compiler knows it where no force is declared. Where forces are, as a dead load or a spring written as a force, it is asked of numbers: their
//! power is linear in the velocities, so that they depend on positions alone, and the derivatives of what is left in independent coordinates are symmetric, so that
//! it is a gradient, at every one of some positions around that nothing singles out. Force fields made of smooth functions that pass are gradients, but
//! for chance; a follower force, a damper, an explicit time or a moving constraint do not pass.

use nalgebra::{DMatrix, DVector};

use super::super::statics::{Statics, scales};
use crate::constrain::assemble::at_time;
use crate::constrain::held::active_rows;
use crate::constrain::{project_positions, with_workspace};
use crate::model::{Constraints, ModelState, Powers, Vector};

/// Parts of what coordinates are measured by: positions near and far.
const AROUND: [f64; 4] = [1e-2, -0.1, 0.4, -0.9];
/// Rounding of powers, against the largest, and of elements of matrices, against each other.
const ROUNDED: f64 = 1e-13;

/// Of a model all of whose independent velocities are rates of these coordinates.
pub(super) fn energy_is_kept<M: Constraints + Powers>(
    model: &M,
    state: &M::State,
    order: &[usize],
    damping: &DMatrix<f64>,
) -> bool {
    if M::CONSERVED.iter().any(|quantity| matches!(quantity.name, "energy" | "energy function")) {
        return true;
    }
    if !is_even(damping, -1.0) {
        return false;
    }
    let Ok(constants) = model.constants() else { return false };
    let scales = scales(M::COORDINATES, state.q().as_slice());
    let Ok(here) = Statics::of(model, state, order) else { return false };
    let mut looked = 0;
    for (sample, part) in AROUND.into_iter().enumerate() {
        let step = DVector::from_fn(order.len(), |k, _| part * scales[order[k]] * number(7 * sample + k));
        let change = &here.tangent.positions * step;
        let mut beside = at_time(state, state.t() + 0.73 * (1 + sample) as f64);
        beside.q_mut().as_mut_slice().iter_mut().zip(change.iter()).for_each(|(q, d)| *q += d);
        let placed = with_workspace::<M, _>(|memory| project_positions(model, &constants, &mut beside, memory));
        // Where the mechanism cannot go nothing is to be asked.
        if placed.is_err() {
            continue;
        }
        let Ok(there) = Statics::of(model, &beside, order) else { return false };
        let Ok(before) = Statics::of(model, &at_time(&beside, state.t()), order) else { return false };
        if !is_same(&before, &there) {
            return false;
        }
        let k = &there.stiffness;
        if there.tangent.coordinates != order || !k.is_square() {
            continue;
        }
        if !is_even(k, 1.0) || moves(model, &beside) || !is_linear(model, &beside, &there, sample) {
            return false;
        }
        looked += 1;
    }
    looked >= 2
}

/// Whether a matrix is symmetric (sign 1) or skew (−1), element by element, so that nothing is lost beside what is stiff.
fn is_even(m: &DMatrix<f64>, sign: f64) -> bool {
    let pair = |i: usize, j: usize| {
        let (x, y) = (m[(i, j)], sign * m[(j, i)]);
        let size = if i == j { m.row(i).amax() } else { x.abs().max(y.abs()) };
        (x - y).abs() <= ROUNDED * size + 16.0 * f64::EPSILON * (m[(i, i)] * m[(j, j)]).abs().sqrt()
    };
    (0..m.nrows()).all(|i| (0..=i).all(|j| pair(i, j)))
}

/// Whether forces and stiffnesses at two times are the same, each element beside its own size.
fn is_same<R: Vector>(one: &Statics<R>, other: &Statics<R>) -> bool {
    let force = |i: usize| (one.force[i] - other.force[i]).abs() <= 16.0 * (one.rounding[i] + other.rounding[i]);
    let (k, l) = (&one.stiffness, &other.stiffness);
    let stiffness = |(i, j): (usize, usize)| (k[(i, j)] - l[(i, j)]).abs() <= ROUNDED * k.row(i).amax();
    let elements = (0..k.nrows()).flat_map(|i| (0..k.ncols()).map(move |j| (i, j)));
    one.force.len() == other.force.len()
        && k.shape() == l.shape()
        && (0..one.force.len()).all(force)
        && elements.into_iter().all(stiffness)
}

/// Numbers in ±(0.3, 1), the same always.
fn number(k: usize) -> f64 {
    let wave = (1.7 + 2.399_963 * k as f64).sin();
    (0.3 + 0.7 * wave.abs()).copysign(wave)
}

/// Whether a row that holds moves while everything rests.
fn moves<M: Constraints>(model: &M, state: &M::State) -> bool {
    let mut rest = *state;
    rest.u_mut().as_mut_slice().fill(0.0);
    let rates = model.velocity_residual(&rest);
    active_rows::<M>(state.modes(), false).any(|row| rates[row] != 0.0)
}

/// Whether power is linear in admissible velocities.
fn is_linear<M: Constraints + Powers>(model: &M, state: &M::State, there: &Statics<M::Rows>, sample: usize) -> bool {
    let e = &there.tangent.velocities;
    let velocity = |first: usize| e * DVector::from_fn(e.ncols(), |k, _| number(31 * sample + first + k));
    let mut values = alloc::vec![0.0; M::POWERS.len()];
    let mut size: f64 = 0.0;
    let mut power = |u: &DVector<f64>| {
        let mut moving = *state;
        moving.u_mut().as_mut_slice().copy_from_slice(u.as_slice());
        model.powers(&moving, &mut values);
        size = values.iter().fold(size, |most, x| most.max(x.abs()));
        values.iter().sum::<f64>()
    };
    let (u, w) = (velocity(3), velocity(17));
    let (of_u, of_w) = (power(&u), power(&w));
    let misses = [power(&(&u + &w)) - of_u - of_w, power(&(-&u)) + of_u, power(&(3.0 * &w)) - 3.0 * of_w];
    misses.iter().all(|miss| miss.abs() <= ROUNDED * size)
}

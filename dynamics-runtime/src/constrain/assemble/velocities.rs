//! Velocities of least kinetic energy that fulfil the constraints.

use super::room::{Room, free, shift};
use super::{ASSEMBLED, NONE, beside_on_constraints, size, worst};
use crate::constrain::Involved;
use crate::constrain::held::active_rows;
use crate::constrain::nearby::NEARBY;
use crate::error::StateError;
use crate::linalg::Svd;
use crate::linalg::{dot, norm};
use crate::math;
use crate::model::{Constraints, ModelState, Vector};

/// Singular values below this part of the largest count as zero: at a singular position, which is itself
/// known to √ε = 1.5·10⁻⁸ only, they come out about as large as that.
const RANK: f64 = 1e-7;

/// Solves the velocities that are not given, which are 0 in the state. Says whether the constraints had fewer
/// than their rows of rank, so that the position may be singular.
pub(super) fn solve<M: Constraints>(
    model: &M,
    state: &mut M::State,
    given: &[bool],
    room: &mut Room<'_>,
) -> Result<bool, StateError> {
    room.evaluate(model, state);
    room.weigh();
    room.decompose::<M>(state.modes(), false, given)?;
    least_energy(state, given, room);
    // The second pass takes away the rounding errors of the first.
    for _ in 0..2 {
        room.load::<M>(state.modes(), false, model.velocity_residual(state).as_slice())?;
        room.solve(0, RANK, 0.0);
        shift(state.u_mut().as_mut_slice(), given, room.weights, 1.0, room.steps[0]);
        least_energy(state, given, room);
    }
    let values = model.velocity_residual(state);
    let tolerance = ASSEMBLED * size(state.u().as_slice());
    let Some(missed) =
        worst::<M>(state.modes(), false, values.as_slice(), (room.jacobian, room.usual), |_| tolerance)?
    else {
        let (rows, free) = room.shape;
        return Ok(open(room) > free.saturating_sub(rows));
    };
    room.load::<M>(state.modes(), false, values.as_slice())?;
    Err(StateError::VelocityNotAssembled {
        row: M::ROWS[missed.row].name,
        residual: missed.residual,
        given: culprits::<M>(state, given, room),
    })
}

/// How many directions the free velocities have left.
fn open(room: &Room<'_>) -> usize {
    let svd = room.svd();
    svd.sigma.iter().filter(|sigma| **sigma <= RANK * svd.largest()).count()
}

/// Refuses velocities that the constraints leave open at this position alone: those of least energy are then
/// on none of the branches that meet here. What is at rest is on all of them.
pub(super) fn check_branch<M: Constraints>(
    model: &M,
    state: &M::State,
    given: &[bool],
    memory: &mut [f64],
) -> Result<(), StateError> {
    let n = given.len();
    let (Some(none), Some(beside)) = (NONE.get(..n), beside_on_constraints(model, state, memory)) else {
        return Ok(());
    };
    let room = &mut Room::new(memory, n, M::ROWS.len());
    let decompose = |room: &mut Room<'_>, at: &M::State, given: &[bool]| {
        room.evaluate(model, at);
        room.weigh();
        room.decompose::<M>(at.modes(), false, given)
    };
    decompose(room, &beside, given)?;
    let elsewhere = open(room);
    keep_open(room, 1);
    decompose(room, state, given)?;
    if open(room) <= elsewhere {
        return Ok(());
    }
    keep_open(room, 2);
    // What is open beside it, too, differs by how far away that is.
    let lost = |k: usize| room.steps[2][k] - room.steps[1][k];
    let shares =
        free(given).enumerate().map(|(k, j)| (j, if lost(k) > 10.0 * NEARBY { lost(k) } else { 0.0 }));
    let coordinates = Involved::ranked(M::COORDINATES, shares);
    let rest = ASSEMBLED * size(state.u().as_slice());
    if !free(given).any(|j| state.u()[j].abs() > rest && coordinates.contains(M::COORDINATES[j].name)) {
        return Ok(());
    }
    decompose(room, state, none)?;
    let svd = room.svd();
    let (cut, all) = (RANK * svd.largest(), 0..svd.sigma.len());
    // What the others do not reach: 1 − Σ (A v/σ)².
    let reached = |k: usize, c: usize| math::powi(svd.column(c)[k] / svd.sigma[c], 2);
    let beyond =
        |k: usize| 1.0 - all.clone().filter(|c| svd.sigma[*c] > cut).map(|c| reached(k, c)).sum::<f64>();
    let rows = active_rows::<M>(state.modes(), false).enumerate().map(|(k, row)| (row, beyond(k)));
    Err(StateError::VelocityUndetermined { rows: Involved::ranked(M::ROWS, rows), coordinates })
}

/// Writes to `steps\[to\]` what part of each free coordinate is open: Σ v² over the directions that nothing
/// holds.
fn keep_open(room: &mut Room<'_>, to: usize) {
    let (_, f) = room.shape;
    let Room { v, sigma, steps, .. } = room;
    let cut = RANK * sigma[..f].iter().copied().fold(0.0, f64::max);
    for (i, share) in steps[to][..f].iter_mut().enumerate() {
        *share = (0..f).filter(|c| sigma[*c] <= cut).map(|c| math::powi(v[c * f + i], 2)).sum();
    }
}

/// Moves the velocities within the null space of the constraints to the least kinetic energy ½ q̇ᵀ M q̇: with
/// q̇ + Z w, (Zᵀ M Z) w = −Zᵀ M q̇. Where M leaves a direction without inertia its part of w is the shortest
/// one.
fn least_energy<S: ModelState>(state: &mut S, given: &[bool], room: &mut Room<'_>) {
    let n = given.len();
    let (_, f) = room.shape;
    let Room {
        mass,
        weights,
        v: right,
        sigma: singular,
        steps: [step, shares, image],
        spare: [a, v, sigma],
        ..
    } = room;
    let cut = RANK * singular[..f].iter().copied().fold(0.0, f64::max);
    let null = || (0..f).filter(|c| singular[*c] <= cut).map(|c| &right[c * f..][..f]);
    let k = null().count();
    // Wᵀ M x of a vector in plain coordinates, in those that are free.
    let weighted = |x: &[f64], out: &mut [f64]| {
        for (out, j) in out.iter_mut().zip(free(given)) {
            *out = dot(&mass[j * n..][..n], x) / weights[j];
        }
    };
    weighted(state.u().as_slice(), image);
    for (share, z) in shares.iter_mut().zip(null()) {
        *share = -dot(z, &image[..f]);
    }
    for (column, z) in null().enumerate() {
        step.fill(0.0);
        shift(step, given, weights, 1.0, z);
        weighted(step, image);
        for (row, z) in null().enumerate() {
            a[column * k + row] = dot(z, &image[..f]);
        }
    }
    let svd = Svd::new(k, &mut a[..k * k], &mut v[..k * k], &mut sigma[..k]);
    svd.solve(&shares[..k], f64::EPSILON * k as f64 * svd.largest(), 0.0, &mut step[..k]);
    for (z, share) in null().zip(&step[..k]) {
        shift(state.u_mut().as_mut_slice(), given, weights, *share, z);
    }
}

/// The given velocities that would have to change.
fn culprits<M: Constraints>(state: &M::State, given: &[bool], room: &Room<'_>) -> Involved {
    let n = given.len();
    let (m, _) = room.shape;
    let noise = 1e-6 * norm(&room.right[..m]);
    let pull = |j: usize| -> f64 {
        let rows = active_rows::<M>(state.modes(), false).enumerate();
        let terms = rows.map(|(k, row)| room.right[k] * room.jacobian[row * n + j] / room.scales[k]);
        let pull = terms.sum::<f64>() / room.weights[j];
        if pull.abs() > noise { pull } else { 0.0 }
    };
    Involved::ranked(M::COORDINATES, (0..n).filter(|j| given[*j]).map(|j| (j, pull(j))))
}

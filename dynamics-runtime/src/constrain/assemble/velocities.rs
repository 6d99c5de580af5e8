//! Velocities of least kinetic energy that fulfil the constraints.

use super::workspace::{AssemblyWorkspace, free_columns, shift};
use super::{ASSEMBLY_TOLERANCE, NOTHING_GIVEN, nearby_on_constraints, one_plus_largest, worst_violation};
use crate::constrain::active_set::active_rows;
use crate::constrain::nearby::NEARBY_DISTANCE;
use crate::constrain::{SINGULAR_VALUE_TOLERANCE, TopContributors};
use crate::error::StateError;
use crate::linalg::Svd;
use crate::linalg::{dot, norm};
use crate::math;
use crate::model::{Constraints, ModelState, Vector};

/// Solves for the velocities that are not given, which are 0 in the state. Returns whether the rank was below
/// the number of rows, so that the position may be singular.
pub(super) fn solve<M: Constraints>(
    model: &M,
    state: &mut M::State,
    given: &[bool],
    work: &mut AssemblyWorkspace<'_>,
) -> Result<bool, StateError> {
    work.evaluate(model, state);
    work.weigh();
    work.decompose::<M>(state.active_set(), false, given)?;
    least_energy(state, given, work);
    // The second pass removes the rounding errors of the first.
    for _ in 0..2 {
        work.load_residual::<M>(state.active_set(), false, model.velocity_residual(state).as_slice())?;
        work.solve(0, SINGULAR_VALUE_TOLERANCE, 0.0);
        shift(state.u_mut().as_mut_slice(), given, work.weights, 1.0, work.steps[0]);
        least_energy(state, given, work);
    }
    let values = model.velocity_residual(state);
    let tolerance = ASSEMBLY_TOLERANCE * one_plus_largest(state.u().as_slice());
    let Some(violation) = worst_violation::<M>(
        state.active_set(),
        false,
        values.as_slice(),
        (work.jacobian, work.usual_lengths),
        |_| tolerance,
    )?
    else {
        let (rows, free_columns) = work.shape;
        return Ok(open_directions(work) > free_columns.saturating_sub(rows));
    };
    work.load_residual::<M>(state.active_set(), false, values.as_slice())?;
    Err(StateError::VelocityNotAssembled {
        row: M::ROWS[violation.row].name,
        residual: violation.residual,
        given: blocking_velocities::<M>(state, given, work),
    })
}

/// Number of directions in which the constraints leave the free velocities open.
fn open_directions(work: &AssemblyWorkspace<'_>) -> usize {
    let svd = work.svd();
    svd.sigma.iter().filter(|sigma| **sigma <= SINGULAR_VALUE_TOLERANCE * svd.largest()).count()
}

/// Rejects velocities along directions that are open at this position only. Those of least energy then belong
/// to none of the branches that meet here. At rest they belong to all of them.
pub(super) fn check_branch<M: Constraints>(
    model: &M,
    state: &M::State,
    given: &[bool],
    workspace: &mut [f64],
) -> Result<(), StateError> {
    let n = given.len();
    let (Some(nothing_given), Some(nearby_state)) =
        (NOTHING_GIVEN.get(..n), nearby_on_constraints(model, state, workspace))
    else {
        return Ok(());
    };
    let work = &mut AssemblyWorkspace::new(workspace, n, M::ROWS.len());
    let decompose = |work: &mut AssemblyWorkspace<'_>, at: &M::State, given: &[bool]| {
        work.evaluate(model, at);
        work.weigh();
        work.decompose::<M>(at.active_set(), false, given)
    };
    decompose(work, &nearby_state, given)?;
    let elsewhere = open_directions(work);
    store_open_shares(work, 1);
    decompose(work, state, given)?;
    if open_directions(work) <= elsewhere {
        return Ok(());
    }
    store_open_shares(work, 2);
    // Directions that are also open at the nearby state differ by its distance.
    let newly_open = |k: usize| work.steps[2][k] - work.steps[1][k];
    let shares = free_columns(given)
        .enumerate()
        .map(|(k, j)| (j, if newly_open(k) > 10.0 * NEARBY_DISTANCE { newly_open(k) } else { 0.0 }));
    let coordinates = TopContributors::ranked(M::COORDINATES, shares);
    let rest = ASSEMBLY_TOLERANCE * one_plus_largest(state.u().as_slice());
    if !free_columns(given).any(|j| state.u()[j].abs() > rest && coordinates.contains(M::COORDINATES[j].name))
    {
        return Ok(());
    }
    decompose(work, state, nothing_given)?;
    let svd = work.svd();
    let (cut, all) = (SINGULAR_VALUE_TOLERANCE * svd.largest(), 0..svd.sigma.len());
    // The rows that depend on each other: 1 − Σ (A v/σ)² of the independent directions.
    let reached = |k: usize, c: usize| math::powi(svd.column(c)[k] / svd.sigma[c], 2);
    let unreached_share =
        |k: usize| 1.0 - all.clone().filter(|c| svd.sigma[*c] > cut).map(|c| reached(k, c)).sum::<f64>();
    let rows =
        active_rows::<M>(state.active_set(), false).enumerate().map(|(k, row)| (row, unreached_share(k)));
    Err(StateError::VelocityUndetermined { rows: TopContributors::ranked(M::ROWS, rows), coordinates })
}

/// Writes to `steps\[to\]` the open part of each free coordinate: Σ v² over the open directions.
fn store_open_shares(work: &mut AssemblyWorkspace<'_>, to: usize) {
    let (_, f) = work.shape;
    let AssemblyWorkspace { v, sigma, steps, .. } = work;
    let cut = SINGULAR_VALUE_TOLERANCE * sigma[..f].iter().copied().fold(0.0, f64::max);
    for (i, share) in steps[to][..f].iter_mut().enumerate() {
        *share = (0..f).filter(|c| sigma[*c] <= cut).map(|c| math::powi(v[c * f + i], 2)).sum();
    }
}

/// Moves the velocities within the null space of the constraints to the least kinetic energy ½ q̇ᵀ M q̇: with
/// q̇ + Z w, (Zᵀ M Z) w = −Zᵀ M q̇. Where M leaves a direction without inertia its part of w is the shortest
/// one.
fn least_energy<S: ModelState>(state: &mut S, given: &[bool], work: &mut AssemblyWorkspace<'_>) {
    let n = given.len();
    let (_, f) = work.shape;
    let AssemblyWorkspace {
        mass,
        weights,
        v: right_vectors,
        sigma: singular_values,
        steps: [step, shares, image],
        spare: [a, v, sigma],
        ..
    } = work;
    let cut = SINGULAR_VALUE_TOLERANCE * singular_values[..f].iter().copied().fold(0.0, f64::max);
    let null = || (0..f).filter(|c| singular_values[*c] <= cut).map(|c| &right_vectors[c * f..][..f]);
    let k = null().count();
    // Wᵀ M x of a vector in unscaled coordinates, for the free ones.
    let weighted = |x: &[f64], out: &mut [f64]| {
        for (out, j) in out.iter_mut().zip(free_columns(given)) {
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
fn blocking_velocities<M: Constraints>(
    state: &M::State,
    given: &[bool],
    work: &AssemblyWorkspace<'_>,
) -> TopContributors {
    let n = given.len();
    let (m, _) = work.shape;
    let noise = 1e-6 * norm(&work.right[..m]);
    let pull = |j: usize| -> f64 {
        let rows = active_rows::<M>(state.active_set(), false).enumerate();
        let terms = rows.map(|(k, row)| work.right[k] * work.jacobian[row * n + j] / work.scales[k]);
        let pull = terms.sum::<f64>() / work.weights[j];
        if pull.abs() > noise { pull } else { 0.0 }
    };
    TopContributors::ranked(M::COORDINATES, (0..n).filter(|j| given[*j]).map(|j| (j, pull(j))))
}

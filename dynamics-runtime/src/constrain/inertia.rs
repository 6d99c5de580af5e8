//! The least inertia on the velocities that the constraints leave, and the coordinates that have it.
//!
//! With P the orthogonal projection onto these velocities, the eigenvalues of P M P there are the inertias. A
//! singular value decomposition of the rows gives P, another one the least eigenvalue.

use alloc::vec;
use alloc::vec::Vec;

use super::active_set::active_rows;
use super::gradients::{Gradients, mass};
use super::system::scale_coordinates;
use super::{SINGULAR_VALUE_TOLERANCE, with_workspace};
use crate::declaration::TopContributors;
use crate::linalg::Svd;
use crate::linalg::{dot, max_abs, norm};
use crate::model::{Constraints, ModelState, StaticTraits, Vector};

/// The least eigenvalue of NᵀMN, N an orthonormal basis of the velocities that the constraints leave, in
/// coordinates of a given scale.
pub(crate) struct LeastInertia {
    /// The eigenvalue of least size, with its sign.
    pub(crate) least: f64,
    /// The coordinates that move in its direction.
    pub(crate) coordinates: TopContributors,
}

/// Scales in which every coordinate has inertia 1 at a state. Coordinates without inertia get the size of
/// those that they share constraints with.
pub(crate) fn unit_inertias<M: Constraints>(model: &M, state: &M::State) -> Vec<f64> {
    let (mut scale, mass, rows) =
        (vec![0.0; M::Vector::LEN], mass_matrix(model, state), active_gradients(model, state));
    scale_coordinates(&mass, &rows, &mut scale);
    scale
}

/// [`LeastInertia`] at a state; `None` where a value is not finite.
pub(crate) fn least_inertia<M: Constraints>(
    model: &M,
    state: &M::State,
    scale: &[f64],
) -> Option<LeastInertia> {
    let n = M::Vector::LEN;
    // Held directions get more inertia than any free direction can have.
    let mut mass = projected_inertia(model, state, scale, |mass, _| (n as f64 * max_abs(mass)).max(1.0))?;
    let (mut v, mut sigma) = (vec![0.0; n * n], vec![0.0; n]);
    let svd = Svd::new(n, &mut mass, &mut v, &mut sigma);
    let least = (0..n).reduce(|a, b| if svd.sigma[b] < svd.sigma[a] { b } else { a })?;
    let direction = svd.right(least);
    let coordinates = TopContributors::ranked(M::COORDINATES, direction.iter().copied().enumerate());
    Some(LeastInertia { least: svd.sigma[least].copysign(dot(svd.column(least), direction)), coordinates })
}

/// P M P + b (1 − P) by rows in scaled coordinates, P onto the velocities that the constraints leave. Free
/// directions keep their own inertia. Held directions get the inertia b, which `held_inertia` computes from P
/// M P and the number of held directions. `None` where a value is not finite.
pub(crate) fn projected_inertia<M: Constraints>(
    model: &M,
    state: &M::State,
    scale: &[f64],
    held_inertia: impl Fn(&[f64], usize) -> f64,
) -> Option<Vec<f64>> {
    let n = M::Vector::LEN;
    let mut mass = mass_matrix(model, state);
    (0..n * n).for_each(|k| mass[k] *= scale[k / n] * scale[k % n]);
    let held_directions_basis = held_directions(model, state, scale)?;
    if mass.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let project = |x: &mut [f64]| {
        for direction in held_directions_basis.chunks_exact(n) {
            let along = dot(direction, x);
            x.iter_mut().zip(direction).for_each(|(x, d)| *x -= along * d);
        }
    };
    mass.chunks_exact_mut(n).for_each(project);
    transpose(&mut mass, n);
    mass.chunks_exact_mut(n).for_each(project);
    let bound = held_inertia(&mass, held_directions_basis.len() / n);
    for direction in held_directions_basis.chunks_exact(n) {
        (0..n * n).for_each(|k| mass[k] += bound * direction[k / n] * direction[k % n]);
    }
    Some(mass)
}

fn mass_matrix<M: Constraints>(model: &M, state: &M::State) -> Vec<f64> {
    with_workspace::<M, _>(|workspace| mass(model, state, workspace).to_vec())
}

/// Φ_q of the active rows.
fn active_gradients<M: Constraints>(model: &M, state: &M::State) -> Vec<f64> {
    if M::IS_UNCONSTRAINED {
        return Vec::new();
    }
    with_workspace::<M, _>(|workspace| {
        let gradients = Gradients::alone(model, state, workspace);
        active_rows::<M>(state.active_set(), false)
            .flat_map(|row| gradients.row(row).iter().copied())
            .collect()
    })
}

/// An orthonormal basis of the row space of Φ_q in scaled coordinates, vector by vector.
fn held_directions<M: Constraints>(model: &M, state: &M::State, scale: &[f64]) -> Option<Vec<f64>> {
    if M::IS_UNCONSTRAINED {
        return Some(Vec::new());
    }
    let n = M::Vector::LEN;
    let mut rows = active_gradients(model, state);
    for row in rows.chunks_exact_mut(n) {
        row.iter_mut().zip(scale).for_each(|(x, s)| *x *= s);
        let length = norm(row);
        if length > 0.0 {
            row.iter_mut().for_each(|x| *x /= length);
        }
    }
    if rows.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let m = rows.len() / n;
    let (mut v, mut sigma) = (vec![0.0; m * m], vec![0.0; m]);
    let svd = Svd::new(n, &mut rows, &mut v, &mut sigma);
    let is_held = |j: &usize| svd.sigma[*j] > SINGULAR_VALUE_TOLERANCE * svd.largest();
    Some((0..m).filter(is_held).flat_map(|j| svd.column(j).iter().map(move |x| x / svd.sigma[j])).collect())
}

fn transpose(a: &mut [f64], n: usize) {
    for i in 0..n {
        for j in 0..i {
            a.swap(i * n + j, j * n + i);
        }
    }
}

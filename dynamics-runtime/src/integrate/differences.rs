//! Derivatives of accelerations by one-sided differences: for systems without derivatives of their own.

use super::{Phase, StepNode};
use crate::linalg::max_abs;
use crate::math;
use crate::model::Vector;

/// Elements below this part of the largest one have its scale times this: elements that are zero by chance
/// have no scale of their own.
const MIN_SCALE_PART: f64 = 1e-2;
/// Smallest scale of an element, in its unit. A smaller one makes differences of nearly zero elements
/// rounding, a larger one makes curvature an error in small mechanisms.
const MIN_SCALE: f64 = 1e-3;

/// The increment of an element: √ε of its scale, for which rounding and curvature cost about the same, and a
/// difference of two representable numbers.
pub(crate) fn increment(x: f64, largest: f64) -> f64 {
    let size = x.abs().max(MIN_SCALE_PART * largest).max(MIN_SCALE);
    let there = x + math::sqrt(f64::EPSILON) * size;
    there - x
}

/// ∂a/∂q and ∂a/∂u at a point, N×N by rows; 2N + 1 evaluations.
pub(crate) fn by_state<V: Vector, E>(
    at: &StepNode<V>,
    by_q: &mut [f64],
    by_u: &mut [f64],
    mut accelerations: impl FnMut(&Phase<V>) -> Result<V, E>,
) -> Result<(), E> {
    let here = accelerations(&at.y)?;
    let (of_q, of_u) = (max_abs(at.y.q.as_slice()), max_abs(at.y.u.as_slice()));
    for j in 0..V::LEN {
        let mut moved = at.y;
        let by = increment(moved.q[j], of_q);
        moved.q[j] += by;
        column(by_q, j, &here, &accelerations(&moved)?, by);
        let mut moved = at.y;
        let by = increment(moved.u[j], of_u);
        moved.u[j] += by;
        column(by_u, j, &here, &accelerations(&moved)?, by);
    }
    Ok(())
}

/// Writes the difference quotient of column j.
fn column<V: Vector>(matrix: &mut [f64], j: usize, here: &V, there: &V, by: f64) {
    for i in 0..V::LEN {
        matrix[i * V::LEN + j] = (there[i] - here[i]) / by;
    }
}

//! Matrices that turn frames are rotations in the states that satisfy the constraints: Euler parameters have
//! their norm constraint, nine elements their six.
//!
//! The check evaluates them in states that satisfy the constraints, or in a random state without constraints.
//! Matrices that contain parameters are checked by the run, where the parameters have values.

use crate::graph::{Bindings, Dependence, NodeId};
use crate::mechanics::{AssumptionKind, Model};

use super::constraints::{Analysis, Sample};
use super::finding::Finding;

/// Largest element of RᵀR − 1 up to which a matrix may be a rotation. States satisfy constraints to 1e-6
/// or better, so that a rotation stays far below it.
const CLEARLY_NO_ROTATION: f64 = 1e-3;

/// Matrices that turn frames and are no rotation in any state that is known.
pub(super) fn rotations(model: &Model, analysis: &Analysis, found: &mut Vec<Finding>) {
    let anywhere = [Sample::anywhere(model)];
    let samples = if model.constraints.is_empty() { &anywhere[..] } else { &analysis.samples };
    let moving = Dependence::COORDINATES.with(Dependence::TIME);
    for assumption in model.assumptions.iter().filter(|p| p.kind == AssumptionKind::Rotation && !p.constant) {
        let of_state = assumption.nodes.iter().all(|node| model.graph.dependence(*node).within(moving));
        if of_state
            && !samples.is_empty()
            && samples.iter().all(|state| defect(model, &assumption.nodes, state) > CLEARLY_NO_ROTATION)
        {
            let (name, of, origin) = (assumption.within.clone(), assumption.of.clone(), assumption.origin);
            found.push(Finding::NotKeptARotation { name, of, origin });
        }
    }
}

/// The largest element of RᵀR − 1.
fn defect(model: &Model, nodes: &[NodeId], state: &dyn Bindings) -> f64 {
    let values = model.graph.evaluate(nodes, state);
    let m = |i: usize, j: usize| values[nodes[3 * i + j].index()];
    let product = |i: usize, j: usize| (0..3).map(|k| m(k, i) * m(k, j)).sum::<f64>();
    let all = (0..3).flat_map(|i| (0..3).map(move |j| (i, j)));
    all.fold(0.0, |most, (i, j)| f64::max(most, (product(i, j) - f64::from(u8::from(i == j))).abs()))
}

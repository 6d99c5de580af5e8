//! Edges of contacts: where a body meets the ground in a corner of it, its gap has the gradient of either face, and which of them it is may be undecided.

use super::simulate::Simulate;
use super::upkeep::Upkeep;
use crate::constrain::memory::{max_abs, norm};
use crate::model::{Branches, Constraint, Kink, MOST_KINKS, ModelState, Vector};

/// Nearer to an edge than this part of 1 + |q| nothing says on which side of it a state is.
const NEAR: f64 = 1e-12;
/// Part of their length by which the gradients of two faces differ.
const BENT: f64 = 1e-6;

/// Whether a contact of one row is hit in an edge of its ground, at which the motion stands now and a little later.
pub(super) fn is_hit<M: Simulate>(
    model: &M,
    upkeep: &mut Upkeep<M>,
    [now, later]: [&M::State; 2],
    constraint: &Constraint,
) -> bool {
    let near = NEAR * (1.0 + max_abs(now.q().as_slice()));
    let [here, there] = [now, later].map(|state| {
        let mut kinks = [Kink::NONE; MOST_KINKS];
        model.kinks(state, &mut kinks);
        kinks
    });
    let mut undecided = (0..M::KINKS).filter(|i| {
        let value = |kinks: &[Kink]| kinks[*i].decides && kinks[*i].value.abs() <= near;
        value(&here) && value(&there)
    });
    undecided.any(|i| {
        let mut face = |below: bool| {
            let (mut branches, mut state) = (Branches::FREE, *now);
            branches.hold(i, below);
            state.hold(branches);
            let mut gradient = M::Vector::zeros();
            gradient.as_mut_slice().copy_from_slice(upkeep.gradients(model, &state).row(constraint.first));
            gradient
        };
        let (one, mut other) = (face(false), face(true));
        let length = norm(one.as_slice()).max(norm(other.as_slice()));
        (0..M::Vector::LEN).for_each(|j| other[j] -= one[j]);
        norm(other.as_slice()) > BENT * length
    })
}

/// Part of the gap beside it by which the gap on another branch differs, where it jumps.
const JUMPS: f64 = 0.5;

/// Whether a gap may have jumped to where it is: one of the branches of the model makes another gap.
pub(super) fn jumps<M: Simulate>(model: &M, state: &M::State, row: usize, gap: f64) -> bool {
    (0..M::KINKS).any(|i| {
        let on = |below: bool| {
            let (mut branches, mut state) = (Branches::FREE, *state);
            branches.hold(i, below);
            state.hold(branches);
            model.residual(&state)[row]
        };
        // What is not a number on a branch tells nothing.
        let same = (on(true) - on(false)).abs() <= JUMPS * gap.abs();
        !same
    })
}

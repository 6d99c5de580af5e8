//! Edges of contacts: where a body meets the ground in a corner of it, its gap has the gradient of either
//! face, and which of them it is may be undecided. And corners of constraints without a rule in which a
//! motion rests: from both sides accelerations lead back, and no step goes on.

use crate::constrain::solve_once;
use crate::linalg::{max_abs, norm};
use crate::model::{Branches, Constraint, Kink, MOST_KINKS, ModelState, SimulationModel, Vector};
use crate::simulate::stabilization::Stabilization;

/// Nearer to an edge than this part of 1 + |q| nothing says on which side of it a state is.
const EDGE_RESOLUTION: f64 = 1e-12;
/// Part of their length by which the gradients of two faces differ.
const BENT: f64 = 1e-6;
/// Displacement in parts of 1 + |q| by which it is seen to where accelerations lead.
const CORNER_PROBE: f64 = 1e-6;

/// Whether a contact of one row is hit in an edge of its ground, at which the motion stands now and a little
/// later.
pub(crate) fn is_hit<M: SimulationModel>(
    model: &M,
    stabilization: &mut Stabilization<M>,
    [now, later]: [&M::State; 2],
    constraint: &Constraint,
) -> bool {
    undecided(model, now, later).any(|kink| is_bent(model, stabilization, now, (kink, constraint.first)))
}

/// The row among these in a corner of which a motion rests, and whether accelerations lead away from it on
/// both of its sides, or back to it from both. `None` where they say to which side it goes.
pub(crate) fn rests_in<M: SimulationModel>(
    model: &M,
    (constants, stabilization): (&M::Constants, &mut Stabilization<M>),
    [now, later]: [&M::State; 2],
    rows: impl Iterator<Item = usize> + Clone,
) -> Option<(usize, bool)> {
    let leads_away = |kink: usize| {
        // What the argument of the kink becomes, on either side, by a displacement along the accelerations
        // there.
        let becomes = |below: bool| {
            let a = solve_once(model, constants, &on_side(now, kink, below)).ok()?.accelerations;
            let largest = max_abs(a.as_slice());
            if largest == 0.0 {
                return None;
            }
            let mut there = *now;
            let by = CORNER_PROBE * (1.0 + max_abs(now.q().as_slice())) / largest;
            (0..M::Vector::LEN).for_each(|j| there.q_mut()[j] += by * a[j]);
            Some(kinks_of(model, &there)[kink].value)
        };
        let near = near(now);
        match (becomes(false)?, becomes(true)?) {
            (above, below) if above < -near && below > near => Some(false),
            (above, below) if above > near && below < -near => Some(true),
            _ => None,
        }
    };
    undecided(model, now, later).find_map(|kink| {
        let row = rows.clone().find(|row| is_bent(model, stabilization, now, (kink, *row)))?;
        Some((row, leads_away(kink)?))
    })
}

/// Up to here the argument of a kink is zero.
fn near<S: ModelState>(state: &S) -> f64 {
    EDGE_RESOLUTION * (1.0 + max_abs(state.q().as_slice()))
}

fn kinks_of<M: SimulationModel>(model: &M, state: &M::State) -> [Kink; MOST_KINKS] {
    let mut kinks = [Kink::NONE; MOST_KINKS];
    model.kinks(state, &mut kinks);
    kinks
}

/// The kinks on no side of which a motion is, now and a little later.
fn undecided<M: SimulationModel>(
    model: &M,
    now: &M::State,
    later: &M::State,
) -> impl Iterator<Item = usize> + use<M> {
    let (near, kinks) = (near(now), [now, later].map(|state| kinks_of(model, state)));
    (0..M::KINKS)
        .filter(move |i| kinks.iter().all(|kinks| kinks[*i].decides && kinks[*i].value.abs() <= near))
}

/// The state on one side of a kink.
fn on_side<S: ModelState>(state: &S, kink: usize, below: bool) -> S {
    let (mut branches, mut state) = (Branches::FREE, *state);
    branches.hold(kink, below);
    state.hold(branches);
    state
}

/// Whether a row has another gradient on either side of a kink.
fn is_bent<M: SimulationModel>(
    model: &M,
    stabilization: &mut Stabilization<M>,
    now: &M::State,
    (kink, row): (usize, usize),
) -> bool {
    let mut face = |below: bool| {
        let mut gradient = M::Vector::zeros();
        let state = on_side(now, kink, below);
        gradient.as_mut_slice().copy_from_slice(stabilization.gradients(model, &state).row(row));
        gradient
    };
    let (one, mut other) = (face(false), face(true));
    let length = norm(one.as_slice()).max(norm(other.as_slice()));
    (0..M::Vector::LEN).for_each(|j| other[j] -= one[j]);
    norm(other.as_slice()) > BENT * length
}

/// Part of the gap beside it by which the gap on another branch differs, where it jumps.
const JUMPS: f64 = 0.5;

/// Whether a gap may have jumped to where it is: one of the branches of the model makes another gap.
pub(crate) fn jumps<M: SimulationModel>(model: &M, state: &M::State, row: usize, gap: f64) -> bool {
    (0..M::KINKS).any(|i| {
        let on = |below: bool| model.residual(&on_side(state, i, below))[row];
        // What is not a number on a branch tells nothing.
        let same = (on(true) - on(false)).abs() <= JUMPS * gap.abs();
        !same
    })
}

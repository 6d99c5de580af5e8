//! Contact corners: states at which a kink of a constraint's function is zero, so that its gradient is not
//! unique.
//!
//! * A contact that is hit in an edge of the ground has the gradient of either face. Which of them acts is
//!   undecided ([`is_hit_in_edge`]); the impact is refused.
//! * A motion that rests in a corner of a constraint without a rule cannot continue: accelerations on both
//!   sides lead back to the corner, or both lead away from it ([`rests_in`]).
//! * A gap that jumps from one branch to another ([`gap_jumps`]).
//!
//! Constraints with a rule that pass a corner during a motion are treated in
//! `run/constraint_discontinuity.rs`.

use crate::constrain::solve_once;
use crate::linalg::{max_abs, norm};
use crate::model::{Branches, Constraint, Kink, MAX_KINKS, ModelState, SimulationModel, Vector};
use crate::simulate::stabilization::Stabilization;

/// Values of a kink up to this part of 1 + |q| are zero: the state is on neither side. It is above rounding,
/// and below what a step ends away from an edge by chance.
const EDGE_RESOLUTION: f64 = 1e-12;
/// Smallest difference of the gradients of two faces, in parts of their length, that is a bend and not
/// rounding.
const MIN_GRADIENT_CHANGE: f64 = 1e-6;
/// Displacement along the accelerations, in parts of 1 + |q|, by which the side to which they lead is found.
/// It is a million times [`EDGE_RESOLUTION`].
const PROBE_DISPLACEMENT: f64 = 1e-6;

/// Whether a contact of one row is hit in an edge of its ground: whether a kink that bends its gradient is
/// zero at the state now and at a state a little later.
pub(crate) fn is_hit_in_edge<M: SimulationModel>(
    model: &M,
    stabilization: &mut Stabilization<M>,
    [now, later]: [&M::State; 2],
    constraint: &Constraint,
) -> bool {
    undecided_kinks(model, now, later)
        .any(|kink| has_two_gradients(model, stabilization, now, (kink, constraint.first)))
}

/// The row in whose corner a motion rests, and whether the accelerations lead away from the corner on both
/// sides (true) or back to it from both (false). `None` where they lead to one side.
pub(crate) fn rests_in<M: SimulationModel>(
    model: &M,
    (constants, stabilization): (&M::Constants, &mut Stabilization<M>),
    [now, later]: [&M::State; 2],
    rows: impl Iterator<Item = usize> + Clone,
) -> Option<(usize, bool)> {
    let leads_away = |kink: usize| {
        // The value of the kink behind a displacement along the accelerations on one side.
        let value_after = |below: bool| {
            let a = solve_once(model, constants, &on_side(now, kink, below)).ok()?.accelerations;
            let largest = max_abs(a.as_slice());
            if largest == 0.0 {
                return None;
            }
            let mut there = *now;
            let factor = PROBE_DISPLACEMENT * (1.0 + max_abs(now.q().as_slice())) / largest;
            (0..M::Vector::LEN).for_each(|j| there.q_mut()[j] += factor * a[j]);
            Some(kinks_of(model, &there)[kink].value)
        };
        let zero = kink_resolution(now);
        match (value_after(false)?, value_after(true)?) {
            (above, below) if above < -zero && below > zero => Some(false),
            (above, below) if above > zero && below < -zero => Some(true),
            _ => None,
        }
    };
    undecided_kinks(model, now, later).find_map(|kink| {
        let row = rows.clone().find(|row| has_two_gradients(model, stabilization, now, (kink, *row)))?;
        Some((row, leads_away(kink)?))
    })
}

/// Largest value of a kink that is zero, see [`EDGE_RESOLUTION`].
fn kink_resolution<S: ModelState>(state: &S) -> f64 {
    EDGE_RESOLUTION * (1.0 + max_abs(state.q().as_slice()))
}

fn kinks_of<M: SimulationModel>(model: &M, state: &M::State) -> [Kink; MAX_KINKS] {
    let mut kinks = [Kink::NONE; MAX_KINKS];
    model.kinks(state, &mut kinks);
    kinks
}

/// The kinks that are zero both now and a little later.
fn undecided_kinks<M: SimulationModel>(
    model: &M,
    now: &M::State,
    later: &M::State,
) -> impl Iterator<Item = usize> + use<M> {
    let (zero, kinks) = (kink_resolution(now), [now, later].map(|state| kinks_of(model, state)));
    (0..M::KINKS)
        .filter(move |i| kinks.iter().all(|kinks| kinks[*i].decides && kinks[*i].value.abs() <= zero))
}

/// The state, evaluated on one side of a kink.
fn on_side<S: ModelState>(state: &S, kink: usize, below: bool) -> S {
    let (mut branches, mut state) = (Branches::FREE, *state);
    branches.hold(kink, below);
    state.hold(branches);
    state
}

/// Whether a row has different gradients on the two sides of a kink.
fn has_two_gradients<M: SimulationModel>(
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
    norm(other.as_slice()) > MIN_GRADIENT_CHANGE * length
}

/// Smallest difference of the gaps on two branches, in parts of the gap, that explains the gap as a jump.
const MIN_GAP_JUMP: f64 = 0.5;

/// Whether a gap may be the result of a jump: whether it differs between the branches of some kink.
pub(crate) fn gap_jumps<M: SimulationModel>(model: &M, state: &M::State, row: usize, gap: f64) -> bool {
    (0..M::KINKS).any(|i| {
        let on = |below: bool| model.residual(&on_side(state, i, below))[row];
        // Negated, so that a gap that is not a number on a branch counts as a jump.
        let same = (on(true) - on(false)).abs() <= MIN_GAP_JUMP * gap.abs();
        !same
    })
}

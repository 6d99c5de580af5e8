//! The equations while switched constraints are released: each set of them is a system of its own, with fewer
//! rows, solved on the graph like the whole one, so that a contact model runs on generated code in flight as
//! on the ground.

use crate::algebra::{ConstrainedEquations, Guard, Guarded, States, Unrolled, unroll};
use crate::graph::{Graph, NodeId};

use super::constraints::ConstraintTerms;
use super::equations::Released;
use super::lagrange::Inertia;
use super::model::Constraint;

/// Most switched constraints for which every set of them is solved: seven sets. With more, only the release
/// of all together is solved.
const MOST_SWITCHED: usize = 3;
/// Operations that the solutions of all sets together may take in any model.
const OPERATIONS_ALLOWED: usize = 1000;
/// How many times the operations of the solution with all constraints they may take in a large one.
const TIMES_OF_WHOLE: usize = 2;

/// Solutions for the sets of switched constraints that may be released, all of them first, as long as they
/// have room beside `whole`.
pub(super) fn released(
    g: &mut Graph,
    inertia: &Inertia,
    rows: &ConstraintTerms,
    constraints: &[Constraint],
    states: &States,
    whole: Option<&Unrolled>,
) -> Vec<Released> {
    let mut room = whole.map_or(0, |whole| TIMES_OF_WHOLE * operations(g, whole)).max(OPERATIONS_ALLOWED);
    let mut found = Vec::new();
    for modes in sets(constraints.iter().filter(|c| c.switched).count()) {
        let held = rows_without(constraints, &modes);
        if let Some(unrolled) = without(g, inertia, rows, &held, states, room) {
            let taken = operations(g, &unrolled);
            if taken <= room {
                room -= taken;
                found.push(Released { modes, unrolled });
            }
        }
    }
    found
}

/// The sets of modes that are solved, the largest first.
fn sets(switched: usize) -> Vec<Vec<usize>> {
    let all: Vec<usize> = (0..switched).collect();
    if switched > MOST_SWITCHED {
        return vec![all];
    }
    let of_bits = |bits: usize| all.iter().copied().filter(|mode| bits >> mode & 1 == 1).collect::<Vec<_>>();
    let mut sets: Vec<Vec<usize>> = (1..1 << switched).map(of_bits).collect();
    sets.sort_by(|a, b| (b.len(), a).cmp(&(a.len(), b)));
    sets
}

/// The rows of all constraints but those with these modes.
fn rows_without(constraints: &[Constraint], modes: &[usize]) -> Vec<usize> {
    let mut held = Vec::new();
    let (mut mode, mut first) = (0, 0);
    for constraint in constraints {
        let rows = first..first + constraint.components.len();
        first = rows.end;
        if !(constraint.switched && modes.contains(&mode)) {
            held.extend(rows);
        }
        mode += usize::from(constraint.switched);
    }
    held
}

/// The solution with these rows alone; `None` where they have none on the graph.
fn without(
    g: &mut Graph,
    inertia: &Inertia,
    rows: &ConstraintTerms,
    held: &[usize],
    states: &States,
    limit: usize,
) -> Option<Unrolled> {
    let jacobian: Vec<Vec<NodeId>> = held.iter().map(|row| rows.jacobian[*row].clone()).collect();
    let gamma: Vec<NodeId> = held.iter().map(|row| rows.gamma[*row]).collect();
    let system = ConstrainedEquations {
        mass: &inertia.mass,
        force: &inertia.force,
        jacobian: &jacobian,
        gamma: &gamma,
        numbers: held,
    };
    let (unrolled, _) = unroll(g, &system, states, limit).ok()?;
    let mut multipliers = vec![g.zero(); rows.named.len()];
    held.iter().zip(&unrolled.multipliers).for_each(|(row, x)| multipliers[*row] = *x);
    let named = |guards: &[Guard]| {
        let of = |of| match of {
            Guarded::Row(row) => Guarded::Row(held[row]),
            coordinate @ Guarded::Coordinate(_) => coordinate,
        };
        guards.iter().map(|guard| Guard { of: of(guard.of), ..*guard }).collect()
    };
    let (guards, correction_guards) = (named(&unrolled.guards), named(&unrolled.correction_guards));
    Some(Unrolled { multipliers, guards, correction_guards, ..unrolled })
}

/// Of q̈ and λ, and of a correction.
fn operations(g: &Graph, unrolled: &Unrolled) -> usize {
    let Unrolled { accelerations, multipliers, guards, correction, correction_guards, .. } = unrolled;
    let checked =
        |guards: &[Guard]| guards.iter().flat_map(|guard| [guard.pivot, guard.scale]).collect::<Vec<_>>();
    let solution = [&accelerations[..], multipliers, &checked(guards)].concat();
    g.operations(&solution) + g.operations(&[&correction[..], &checked(correction_guards)].concat())
}

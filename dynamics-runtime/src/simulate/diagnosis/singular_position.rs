//! Singular positions: where constraints lose rank on the way of a motion.
//!
//! Where branches cross, the weak direction y of the constraints and the direction x of the motion fulfil y
//! (y − k x) = c to second order, c = 0 on the manifold. States that have drifted have c ≠ 0: the crossing
//! opens into two hyperbolas, and a motion that follows one of them turns, within |x| of order √c, to the
//! other branch or back, smoothly and without a growing residual. What decides is the drift, so the motion
//! is not determined there. It is told by the step δ = −Φ_q⁺Φ back to the constraints, which is c/(k x):
//! where Newton's method does not contract from the state (½‖Φ_q⁺Φ_qq δ²‖/‖δ‖, Kantorovich's condition), or
//! where δ changes at a rate that is a part of the motion's own velocity, ‖Φ_q⁺Φ_qq δ q̇‖/‖q̇‖. Both are of
//! order c/(k x)². A step over the position that leaves none of its states there goes on on its branch.

use alloc::boxed::Box;

use crate::constrain::nearby::at_time;
use crate::constrain::weakness::{Weakness, condition as condition_of, weakness, weakness_against};
use crate::error::SolveError;
use crate::golden_section::golden;
use crate::linalg::max_abs;
use crate::model::{Constraints, Known, ModelState, Vector};
use crate::simulate::diagnosis::RunMethod;
use crate::simulate::failure::{Met, SimulationErrorKind as Kind};
use crate::simulate::stabilization::singular_start::SINGULAR_CONDITION;

/// Up to here the size of a coordinate counts: angles count revolutions.
const TURNS: f64 = 10.0;

/// Part by which conditioning has to be worse than at the start for what fails to be put down to it; what a
/// start that is singular itself has counts as no more than [`USUAL`].
const WORSE: f64 = 10.0;
/// See [`WORSE`].
const USUAL: f64 = 1e3;

/// The same against the lengths that gradients had at the start, which change on other ways, too.
const SHORTER: f64 = 100.0;
/// How far ahead it is looked where a step was not made, in its own length.
const AHEAD: f64 = 1.5;

/// Conditioning from which on steps without end are put down to it: where rounding errors count for more than
/// the tolerance they come nearer and nearer.
const CREEPS: f64 = 1e5;

/// Length of a step, in parts of what is left to a singular position, below which that makes it so short:
/// without it steps are of its size.
const SHORT: f64 = 1e-3;

/// A failure that singular constraints may cause (see [`crate::simulate::diagnosis`]), told as that: where
/// they are much nearer to losing rank than they were at the start, or so near that nothing could be
/// computed anywhere.
pub(crate) fn explain<M: Constraints>(
    model: &M,
    start: &M::State,
    state: &M::State,
    (kind, h): (Kind, f64),
    way: RunMethod,
) -> Kind {
    let creeps = matches!(kind, Kind::TooManySteps { .. } | Kind::StepsVanish { .. });
    if M::IS_FREE {
        return kind;
    }
    let found = weakest_ahead(state, h, &kind, |state| weakness(model, state));
    let worse = found.condition >= SINGULAR_CONDITION
        || found.condition >= WORSE * condition_of(model, start).min(USUAL);
    // A single row shows it against the length that it had.
    let (worse, found) = if worse {
        (true, found)
    } else {
        let found = weakest_ahead(state, h, &kind, |state| weakness_against(model, start, state));
        (found.condition >= SHORTER, found)
    };
    let Weakness { condition, rows, coordinates } = found;
    // What is left to such a position is 1/κ of the size of the mechanism: steps of a part of that are short
    // because of it.
    if creeps && condition < CREEPS && way_in(state, h) * condition > SHORT {
        return kind;
    }
    match worse {
        true => Kind::SingularPosition {
            rows,
            coordinates,
            condition,
            met: Box::new(Met { kind, over: way.over() }),
        },
        false => kind,
    }
}

/// Where a step was not made for what lies ahead in it, as a fixed one that cannot be shorter: the worst on
/// the straight way on, else here.
fn weakest_ahead<S: ModelState>(
    state: &S,
    h: f64,
    kind: &Kind,
    weakness: impl Fn(&S) -> Weakness,
) -> Weakness {
    let here = weakness(state);
    let lies_ahead = matches!(
        kind,
        Kind::Solve(SolveError::OffConstraint { .. })
            | Kind::StepNotSolved { .. }
            | Kind::StepDisplaced { .. }
    );
    if !lies_ahead || h == 0.0 {
        return here;
    }
    let ahead = |part: f64| {
        let mut ahead = at_time(state, state.t() + part * h);
        (0..S::Vector::LEN).for_each(|i| ahead.q_mut()[i] += part * h * state.u()[i]);
        weakness(&ahead)
    };
    let (part, worst) = golden(0.0, AHEAD, &mut |part| ahead(part).condition);
    if worst > here.condition { ahead(part) } else { here }
}

/// The way of a motion in a time, in parts of its size.
fn way_in<S: ModelState>(state: &S, time: f64) -> f64 {
    time.abs() * max_abs(state.u().as_slice()) / (1.0 + max_abs(state.q().as_slice()).min(TURNS))
}

/// Part of what is left to a singular position that many steps come at least, where they come past it.
const COMES: f64 = 0.05;

/// Whether many steps that took this time do not come past the singular position that is near.
pub(crate) fn stalls_before_singular_position<M: Constraints>(
    model: &M,
    state: &M::State,
    took: f64,
) -> bool {
    let way = way_in(state, took);
    M::IS_HELD && way * CREEPS < COMES && {
        let condition = condition_of(model, state);
        condition >= CREEPS && way * condition < COMES
    }
}

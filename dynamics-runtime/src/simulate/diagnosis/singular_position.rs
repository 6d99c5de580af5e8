//! Singular positions: where constraints lose rank on the path of a motion.
//!
//! What a run does there:
//!
//! * If the motion starts there, it gets the accelerations of the branch of its velocities
//!   (`stabilization/singular_start.rs`).
//! * If a stage of a step lies there, it gets their limit along the branch (`Stabilization::branch_limit`).
//! * If a step passes near it, the step is repeated with projected stages, or with another end
//!   (`integrate/stepper/singularity_crossing.rs`).
//! * Monitors end the motion (`run/monitors/`) where drift would choose the branch (`constraint_drift.rs`),
//!   where its branch is lost among branches that touch (`branch_identification.rs`), and where steps hardly
//!   advance (`singular_stall.rs`).
//! * If a run ends early, [`explain`] attributes the failure to the position, with rows and coordinates.
//!
//! Where branches cross, the weak direction y of the constraints and the direction x of the motion fulfil y
//! (y − k x) = c to second order, with c = 0 on the manifold. States that have drifted have c ≠ 0. The
//! crossing then opens into two hyperbolas. A motion along one of them turns, within |x| of order √c, to
//! the other branch or back, smoothly and without a growing residual. The drift decides, so that the motion
//! is not determined there. The step δ = −Φ_q⁺Φ back to the constraints, which is c/(k x), shows this
//! in two ways: Newton's method does not contract from the state (½‖Φ_q⁺Φ_qq δ²‖/‖δ‖,
//! Kantorovich's condition), or δ changes at a rate that is a part of the motion's own velocity,
//! ‖Φ_q⁺Φ_qq δ q̇‖/‖q̇‖. Both are of order c/(k x)². A step across the position that has no
//! stage near it stays on its branch.

use alloc::boxed::Box;

use crate::constrain::nearby::at_time;
use crate::constrain::rank_margin::{RankMargin, gradient_condition, rank_margin, rank_margin_against};
use crate::error::SolveError;
use crate::golden_section::golden_section_maximum;
use crate::linalg::max_abs;
use crate::model::{Constraints, ModelState, StaticTraits, Vector};
use crate::simulate::diagnosis::RunMethod;
use crate::simulate::failure::{SimulationErrorKind as Kind, SingularPositionCause};
use crate::simulate::stabilization::near_singular::MAX_COUNTED_ANGLE;
use crate::simulate::stabilization::singular_start::BRANCH_LIMIT_CONDITION;

/// A failure is attributed to a singular position where the condition number is this many times that at the
/// start. That of a singular start counts as [`MAX_START_CONDITION`] at most.
const WORSE_THAN_START: f64 = 10.0;
/// See [`WORSE_THAN_START`].
const MAX_START_CONDITION: f64 = 1e3;

/// The same for rows in the scale of their lengths at the start. It is larger, because lengths also change
/// for other reasons.
const SHORTENED_CONDITION: f64 = 100.0;
/// Distance ahead that is searched after a step that failed, in its own length.
const LOOK_AHEAD: f64 = 1.5;

/// Condition number from which on too many steps are attributed to a singular position. Where rounding errors
/// exceed the tolerance, steps approach it without end.
const STALL_CONDITION: f64 = 1e5;

/// Steps below this part of the distance to a singular position are not attributed to it: it makes steps of
/// about its distance.
const SHORT_STEP_SHARE: f64 = 1e-3;

/// A failure with a singular position as its cause: where constraints are much nearer to losing rank than at
/// the start, or so near that no result could be accurate.
pub(crate) fn explain<M: Constraints>(
    model: &M,
    start: &M::State,
    state: &M::State,
    (kind, h): (Kind, f64),
    run_method: RunMethod,
) -> Kind {
    let has_many_steps = matches!(kind, Kind::TooManySteps { .. } | Kind::StepsVanish { .. });
    if M::IS_UNCONSTRAINED {
        return kind;
    }
    let found = weakest_ahead(state, h, &kind, |state| rank_margin(model, state));
    let worse = found.condition >= BRANCH_LIMIT_CONDITION
        || found.condition >= WORSE_THAN_START * gradient_condition(model, start).min(MAX_START_CONDITION);
    // A single row shows it against the length that it had.
    let (worse, found) = if worse {
        (true, found)
    } else {
        let found = weakest_ahead(state, h, &kind, |state| rank_margin_against(model, start, state));
        (found.condition >= SHORTENED_CONDITION, found)
    };
    let RankMargin { condition, rows, coordinates } = found;
    // The distance to such a position is 1/κ of the size of the mechanism; compare the step with it.
    if has_many_steps
        && condition < STALL_CONDITION
        && relative_distance(state, h) * condition > SHORT_STEP_SHARE
    {
        return kind;
    }
    match worse {
        true => Kind::SingularPosition {
            rows,
            coordinates,
            condition,
            cause: Box::new(SingularPositionCause { kind, crossing: run_method.crossing_settings() }),
        },
        false => kind,
    }
}

/// The smallest rank margin: after a step that failed on its way, on the straight path ahead, otherwise at
/// the state.
fn weakest_ahead<S: ModelState>(
    state: &S,
    h: f64,
    kind: &Kind,
    rank_margin: impl Fn(&S) -> RankMargin,
) -> RankMargin {
    let here = rank_margin(state);
    let lies_ahead = matches!(
        kind,
        Kind::Solve(SolveError::OffConstraint { .. })
            | Kind::StepNotSolved { .. }
            | Kind::StepDisplaced { .. }
    );
    if !lies_ahead || h == 0.0 {
        return here;
    }
    let state_ahead = |part: f64| {
        let mut state_ahead = at_time(state, state.t() + part * h);
        (0..S::Vector::LEN).for_each(|i| state_ahead.q_mut()[i] += part * h * state.u()[i]);
        rank_margin(&state_ahead)
    };
    let (part, worst) = golden_section_maximum(0.0, LOOK_AHEAD, &mut |part| state_ahead(part).condition);
    if worst > here.condition { state_ahead(part) } else { here }
}

/// Distance that a motion covers in a time, in parts of its size.
fn relative_distance<S: ModelState>(state: &S, time: f64) -> f64 {
    time.abs() * max_abs(state.u().as_slice()) / (1.0 + max_abs(state.q().as_slice()).min(MAX_COUNTED_ANGLE))
}

/// Many steps that pass a singular position cover at least this part of the distance to it.
const PASSING_SHARE: f64 = 0.05;

/// Whether many steps, which took this time, do not pass a singular position nearby.
pub(crate) fn stalls_before_singular_position<M: Constraints>(
    model: &M,
    state: &M::State,
    took: f64,
) -> bool {
    let distance = relative_distance(state, took);
    M::IS_CONSTRAINED && distance * STALL_CONDITION < PASSING_SHARE && {
        let condition = gradient_condition(model, state);
        condition >= STALL_CONDITION && distance * condition < PASSING_SHARE
    }
}

//! Constraint drift: ends a motion whose constraints have drifted too far, or whose drift decides its
//! direction.
//!
//! Drift is measured in `stabilization/drift_inspection.rs`; formulations that project have none. Near a
//! singular position the drift would choose the branch: that is `BranchUndetermined`. Elsewhere the drift
//! limit applies.

use alloc::boxed::Box;

use crate::constrain::rank_margin::{RankMargin, rank_margin};
use crate::integrate::{Dense, Hermite, Method, Step};
use crate::math;
use crate::model::{SimulationModel, StaticTraits};
use crate::simulate::diagnosis::{self, RowDiscontinuity};
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::simulate::right_hand_side::NEARLY_SINGULAR_CONDITION;
use crate::simulate::run::monitor::{Monitor, Objection, Valid, Watched};
use crate::simulate::stabilization::{DriftVerdict, Drifted};

/// Largest influence of drift where the condition does not show a singular position. The condition of a
/// single row is always 1, although its gradient may vanish. Then the shortening of the gradient counts, with
/// this larger bound. A smaller value ends motions in which a gradient is short for another reason; with a
/// larger one drift decides the direction where a single row vanishes.
const MAX_INFLUENCE_OF_ONE_ROW: f64 = 0.1;

/// Checks every step of a formulation that does not project.
pub(crate) struct DriftMonitor;

impl<M: SimulationModel> Monitor<M> for DriftMonitor {
    fn begin(_: &mut Watched<'_, '_, '_, M>, _: Method) -> Self {
        Self
    }

    #[inline(always)]
    fn after_attempt(
        &mut self,
        run: &mut Watched<'_, '_, '_, M>,
        step: &Step<M::Vector>,
    ) -> Result<(), Objection> {
        if M::IS_UNCONSTRAINED || run.plan.rhs.stabilization.projects() {
            return Ok(());
        }
        check_drift(run, step).map_err(|kind| valid_up_to_corner(run, step, kind))
    }
}

/// An error where the constraints have drifted too far at the end of a step.
#[inline]
fn check_drift<M: SimulationModel>(
    run: &mut Watched<'_, '_, '_, M>,
    step: &Step<M::Vector>,
) -> Result<(), Kind> {
    let rhs = &mut run.plan.rhs;
    let state = rhs.state(step.end.t, &step.end.y.q, &step.end.y.u);
    let (part, shortened) = match rhs.stabilization.inspect_drift(rhs.model, &state, step.h)? {
        DriftVerdict::Harmless => return Ok(()),
        DriftVerdict::TooFar(Drifted { what, row, residual, distance, limit }) => {
            return Err(Kind::Drift { what, row, residual, distance, limit });
        }
        DriftVerdict::Decides { part, shortened } => (part, shortened),
    };
    let RankMargin { condition, rows, coordinates } = rank_margin(rhs.model, &state);
    // Far from lost rank, the drift limit alone applies.
    if condition < NEARLY_SINGULAR_CONDITION
        && (part < MAX_INFLUENCE_OF_ONE_ROW || shortened < NEARLY_SINGULAR_CONDITION)
    {
        return Ok(());
    }
    let condition = math::max(condition, shortened);
    Err(Kind::BranchUndetermined { rows, coordinates, condition })
}

/// If a constraint has a corner within the step, that is why it has drifted: the motion is valid up to the
/// corner.
#[cold]
fn valid_up_to_corner<M: SimulationModel>(
    run: &mut Watched<'_, '_, '_, M>,
    step: &Step<M::Vector>,
    kind: Kind,
) -> Objection {
    let Step { start, end, h, .. } = step;
    let rhs = &mut run.plan.rhs;
    let between = Hermite::between(start, end, *h);
    let corner = diagnosis::find_discontinuity_within(rhs.model, |theta| {
        let y = between.at(theta);
        rhs.state(start.t + theta * h, &y.q, &y.u)
    });
    let Some(RowDiscontinuity { row, what, jump, at }) =
        corner.filter(|_| matches!(kind, Kind::Drift { .. }))
    else {
        return Objection { kind, valid: Valid::Whole };
    };
    let kind = Kind::ConstraintJumps { row: M::ROWS[row].name, what, jump, cause: Box::new(kind) };
    Objection { kind, valid: Valid::UpTo(at) }
}

//! Constraints that a formulation lets drift: how far they may, and where drift decides how the motion goes
//! on.

use alloc::boxed::Box;

use crate::constrain::rank_margin::{RankMargin, rank_margin};
use crate::integrate::{Dense, Hermite, Method, Step};
use crate::math;
use crate::model::{Known, SimulationModel};
use crate::simulate::diagnosis::{self, RowDiscontinuity};
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::simulate::run::monitor::{Monitor, Objection, Valid, Watched};
use crate::simulate::stabilization::{DriftVerdict, Drifted};

/// Conditioning of constraints from which on a singular position is near.
const NEARLY_SINGULAR: f64 = 5.0;
/// Part of a motion that drift may decide where no singular position is known to be near: a single row says
/// nothing of its size, and loses its direction where its gradient vanishes.
const MOST_DECIDED: f64 = 0.1;

/// Looks at every step of a formulation that does not project its states.
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
        if M::IS_FREE || run.plan.rhs.stabilization.projects() {
            return Ok(());
        }
        drift(run, step).map_err(|kind| up_to_corner(run, step, kind))
    }
}

/// An error where the constraints have drifted too far at the end of a step.
#[inline]
fn drift<M: SimulationModel>(run: &mut Watched<'_, '_, '_, M>, step: &Step<M::Vector>) -> Result<(), Kind> {
    let rhs = &mut run.plan.rhs;
    let state = rhs.state(step.end.t, &step.end.y.q, &step.end.y.u);
    let (part, shortened) = match rhs.stabilization.look(rhs.model, &state, step.h)? {
        DriftVerdict::Harmless => return Ok(()),
        DriftVerdict::TooFar(Drifted { what, row, residual, distance, limit }) => {
            return Err(Kind::Drift { what, row, residual, distance, limit });
        }
        DriftVerdict::Decides { part, shortened } => (part, shortened),
    };
    let RankMargin { condition, rows, coordinates } = rank_margin(rhs.model, &state);
    // Plain drift of constraints that are far from losing rank has a limit of its own.
    if condition < NEARLY_SINGULAR && (part < MOST_DECIDED || shortened < NEARLY_SINGULAR) {
        return Ok(());
    }
    let condition = math::max(condition, shortened);
    Err(Kind::BranchUndetermined { rows, coordinates, condition })
}

/// Where one of the constraints that have drifted has a corner within the step, the motion is right up to
/// there.
#[cold]
fn up_to_corner<M: SimulationModel>(
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

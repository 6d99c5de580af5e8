//! Released constraints that begin to slip against the side by which they rub: see
//! [`crate::simulate::events::slip_direction`].

use alloc::vec::Vec;

use crate::integrate::{Method, Step};
use crate::model::{Known, SimulationModel};
use crate::simulate::events::slip_direction::{self, SlipDirection, SlipReversal};
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::simulate::run::failure::evaluation;
use crate::simulate::run::monitor::{Monitor, Objection, Valid, Watched};

/// Ends the motion where a slip turns round and nothing says what comes then.
pub(crate) struct SlipReversalMonitor;

impl<M: SimulationModel> Monitor<M> for SlipReversalMonitor {
    fn begin(_: &mut Watched<'_, '_, '_, M>, _: Method) -> Self {
        Self
    }

    #[inline]
    fn before_record(
        &mut self,
        run: &mut Watched<'_, '_, '_, M>,
        step: &Step<M::Vector>,
    ) -> Result<(), Objection> {
        if M::IS_UNSWITCHED || run.plan.rhs.modes.all_hold() {
            return Ok(());
        }
        let plan = &mut *run.plan;
        let unilaterals = plan.locator.unilaterals().map(|(_, unilateral)| unilateral);
        let unfollowed = slip_direction::unfollowed::<M>(plan.rhs.modes, unilaterals);
        let rhs = &mut plan.rhs;
        let suspects =
            unfollowed.filter_map(|slipping| Some((slipping, slip_direction::suspect(rhs, step, slipping)?)));
        let suspects: Vec<_> = suspects.collect();
        if suspects.is_empty() { Ok(()) } else { confirm(run, step, &suspects) }
    }
}

/// Objects to a step in which one of the suspects slips against its side by the method's own interpolant,
/// too.
#[cold]
fn confirm<M: SimulationModel>(
    run: &mut Watched<'_, '_, '_, M>,
    step: &Step<M::Vector>,
    suspects: &[(SlipDirection, usize)],
) -> Result<(), Objection> {
    let (rhs, tolerances) = (&mut run.plan.rhs, run.plan.options.tolerances);
    let dense = run
        .stepper
        .dense(rhs, step, false)
        .map_err(|error| Objection { kind: evaluation::<M>(error), valid: Valid::Nothing })?;
    let turned = suspects.iter().filter_map(|(slipping, place)| {
        slip_direction::turned(rhs, step, &*dense, &tolerances, *slipping, *place)
    });
    let Some(first) = turned.min_by(|a, b| a.theta.total_cmp(&b.theta)) else { return Ok(()) };
    let SlipReversal { constraint, side, slip, theta, at, sticks } = first;
    let kind = Kind::SlipsBack { constraint: constraint.name, side, slip, at, sticks };
    // What comes before is right, and belongs to the motion.
    Err(Objection { kind, valid: Valid::UpTo(theta) })
}

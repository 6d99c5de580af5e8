//! Slip reversal: a released friction constraint without a rule begins to slip against its side.
//!
//! Friction would then drive the motion. How a reversal is found is in
//! [`crate::simulate::events::slip_direction`].

use alloc::vec::Vec;

use crate::integrate::{Method, Step};
use crate::model::{SimulationModel, StaticTraits};
use crate::simulate::events::slip_direction::{self, SlipDirection, SlipReversal};
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::simulate::run::failure::evaluation;
use crate::simulate::run::monitor::{Monitor, Objection, Valid, Watched};

/// Ends the motion where a slip reverses and no rule determines how it continues.
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
        if M::IS_UNSWITCHED || run.plan.rhs.active_set.all_hold() {
            return Ok(());
        }
        let plan = &mut *run.plan;
        let unilaterals = plan.locator.unilaterals().map(|(_, unilateral)| unilateral);
        let without_rule = slip_direction::without_rule::<M>(plan.rhs.active_set, unilaterals);
        let rhs = &mut plan.rhs;
        let suspects = without_rule
            .filter_map(|slipping| Some((slipping, slip_direction::find_suspect(rhs, step, slipping)?)));
        let suspects: Vec<_> = suspects.collect();
        if suspects.is_empty() { Ok(()) } else { confirm(run, step, &suspects) }
    }
}

/// Objects to a step in which a suspect slips against its side on the method's interpolant, too.
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
    let reversals = suspects.iter().filter_map(|(slipping, part)| {
        slip_direction::locate_reversal(rhs, step, &*dense, &tolerances, *slipping, *part)
    });
    let Some(first) = reversals.min_by(|a, b| a.theta.total_cmp(&b.theta)) else { return Ok(()) };
    let SlipReversal { constraint, side, slip, theta, at, sticks } = first;
    let kind = Kind::SlipsBack { constraint: constraint.name, side, slip, at, sticks };
    // The step is valid up to the reversal.
    Err(Objection { kind, valid: Valid::UpTo(theta) })
}

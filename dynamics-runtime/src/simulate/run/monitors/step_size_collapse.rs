//! Runs that come to no end: steps that become shorter and shorter towards a time that they do not reach.
//!
//! Whenever the number of steps has doubled, the time that the later half of them took is compared with the
//! time that the half before took. Where it is a part r < 1 of that again and again, all further doublings
//! together take no more than r/(1 − r) times as much.

use alloc::vec::Vec;

use crate::constrain::TopContributors;
use crate::integrate::Method;
use crate::math;
use crate::model::{Known, SimulationModel, Vector};
use crate::simulate::erased_method::stepping::StepStatistics;
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::simulate::right_hand_side::RightHandSide;
use crate::simulate::run::monitor::{Monitor, Watched};

/// Steps after which this is looked at first.
const FIRST_LOOK: u64 = 1024;
/// Part of the time that the half before took, at most.
const SHRINKS: f64 = 0.7;
/// Doublings in a row with so little: at 65,536 steps at the earliest, of which the last half took a sixth of
/// a hundredth of the first.
const DOUBLINGS_IN_A_ROW: u32 = 5;

/// Ends a motion whose steps become shorter without end.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StepSizeCollapse {
    /// The number of steps at which the next look is taken.
    next: u64,
    /// When the last look was.
    last: Option<f64>,
    /// The time that the steps between the last two looks took.
    took: f64,
    /// Doublings in a row that shrank.
    row: u32,
}

impl<M: SimulationModel> Monitor<M> for StepSizeCollapse {
    fn begin(_: &mut Watched<'_, '_, '_, M>, _: Method) -> Self {
        Self::new()
    }

    #[inline(always)]
    fn before_step(
        &mut self,
        run: &mut Watched<'_, '_, '_, M>,
        statistics: &StepStatistics,
    ) -> Result<(), Kind> {
        // Where the motion is stiff or slides, that is what is to be said.
        if let Some(at) = self.approached(run.steps_tried(statistics), statistics.t, run.plan.end)
            && statistics.stiff_at.is_none()
            && statistics.slides_at.is_none()
        {
            return Err(steps_vanish(run, at));
        }
        Ok(())
    }
}

/// Steps become shorter without end towards a time: which coordinates accelerate most there, and which
/// constraints pull most.
#[cold]
pub(crate) fn steps_vanish<M: SimulationModel>(run: &mut Watched<'_, '_, '_, M>, at: f64) -> Kind {
    let state = run.now();
    let accelerations = run.stepper.now().a;
    let coordinates =
        TopContributors::ranked(M::COORDINATES, accelerations.as_slice().iter().copied().enumerate());
    let RightHandSide { model, constants, stabilization, .. } = &mut run.plan.rhs;
    let mut pulls = Vec::new();
    if M::IS_FREE {
        // Nothing holds it.
    } else if let Ok(reactions) = stabilization.reactions(model, constants, &state) {
        let gradients = stabilization.gradients(model, &state);
        pulls.extend((0..M::Rows::LEN).map(|row| {
            let length = gradients.row(row).iter().map(|x| x * x).sum::<f64>();
            (row, reactions[row] * math::sqrt(length))
        }));
    }
    Kind::StepsVanish { at, coordinates, rows: TopContributors::ranked(M::ROWS, pulls.into_iter()) }
}

impl StepSizeCollapse {
    fn new() -> Self {
        Self { next: FIRST_LOOK, last: None, took: 0.0, row: 0 }
    }

    /// So many steps were made, up to t: the time that they approach, if they do not come to the end.
    #[inline]
    fn approached(&mut self, made: u64, t: f64, end: f64) -> Option<f64> {
        if made < self.next { None } else { self.doubled(made, t, end) }
    }

    #[cold]
    fn doubled(&mut self, made: u64, t: f64, end: f64) -> Option<f64> {
        self.next = made.max(self.next).saturating_mul(2);
        let took = (t - self.last.replace(t)?).abs();
        let ratio = took / math::max(self.took, f64::MIN_POSITIVE);
        self.took = took;
        self.row = if ratio <= SHRINKS { self.row + 1 } else { 0 };
        let at = t + (took * ratio / (1.0 - ratio)).copysign(end - t);
        // Twice as far it does not come to the end either.
        let short = (at - t).abs() < 0.5 * (end - t).abs();
        (self.row >= DOUBLINGS_IN_A_ROW && short).then_some(at)
    }
}

#[cfg(test)]
mod tests {
    use super::StepSizeCollapse;

    /// Steps of this size at these times: the number after which it is seen that they do not reach 10, and
    /// the time they approach.
    fn seen(h: impl Fn(f64) -> f64) -> Option<(u64, f64)> {
        let (mut collapse, mut t) = (StepSizeCollapse::new(), 0.0);
        (1..1_000_000).find_map(|made| {
            t += h(t);
            assert!(t < 10.0 || made > 1000);
            (t < 10.0).then(|| collapse.approached(made, t, 10.0)).flatten().map(|at| (made, at))
        })
    }

    #[test]
    fn steps_that_vanish_are_seen_and_others_are_not() {
        let (made, at) = seen(|t| 1e-3 * (2.0 - t).powi(2)).unwrap();
        assert!(made <= 1 << 17 && (at - 2.0).abs() < 1e-3, "{made} {at}");
        // Equal ones, ones that become shorter and reach the end, and ones that are short for a while.
        assert_eq!(seen(|_| 1e-5), None);
        assert_eq!(seen(|t| 1e-4 * (-t).exp().max(2e-1)), None);
        assert_eq!(seen(|t| 1e-6 + 1e-2 * (t - 2.0).powi(2)), None);
    }
}

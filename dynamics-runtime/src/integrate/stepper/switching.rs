//! Steps that end at discontinuities of the accelerations, with held branches up to there.
//!
//! [`discontinuity`](crate::integrate::discontinuity) says why, and counts attempts.

use crate::integrate::dense::Hermite;
use crate::integrate::stepper::first_step::first_step;
use crate::integrate::stepper::{Stepper, Trial};
use crate::integrate::{BranchHold, Controller, Dense, Scheme, StepNode, System};
use crate::model::Vector;

impl<V: Vector, S: Scheme<V>> Stepper<V, S> {
    /// End and signed size of the step, if it has to be repeated to end at a kink.
    #[inline(always)]
    pub(super) fn end_at_kink<Y: System<V>>(
        &mut self,
        system: &mut Y,
        trial: &Trial<V>,
    ) -> Result<Option<(f64, f64)>, Y::Error> {
        let Trial { start, end, flags, error, .. } = trial;
        if Y::IS_SMOOTH || !flags.branches || !self.discontinuity.has_attempts_left() {
            return Ok(None);
        }
        let h = end.t - start.t;
        // The first stage may belong to this step: see `Accelerations::begin_attempt`.
        let begin = StepNode { a: self.scheme.stages()[0].u, ..*start };
        let (step, fails) = ((start.t, h), *error > 1.0 && !self.is_fixed());
        let part = if system.is_hermite_enough_for_kinks() {
            let path = Hermite::between(&begin, end, h);
            system.locate_kink(step, fails, |theta| path.at(theta))
        } else {
            let path = self.scheme.dense(system, &begin, end, h)?;
            system.locate_kink(step, fails, |theta| path.at(theta))
        };
        let Some(part) = part else { return Ok(None) };
        let end_t = start.t + part * h;
        self.discontinuity.count_attempt();
        Ok((end_t != start.t && end_t != end.t).then_some((end_t, end_t - start.t)))
    }

    /// Before the first attempt of a step: holds branches and chooses the size of the step anew where these
    /// have changed, or where the method proposes it.
    #[inline(always)]
    pub(super) fn begin_step<Y: System<V>>(&mut self, system: &mut Y, limit: f64) -> Result<(), Y::Error> {
        let direction = if limit < self.now.t { -1.0 } else { 1.0 };
        let h = self.next_time(limit).1;
        if h != 0.0 {
            let is_controlled = !S::PROPOSES_STEP && !self.is_fixed();
            match self.hold_branches(system, h)? {
                BranchHold::Changed if is_controlled => {
                    // The errors of the steps before say nothing of the motion behind the kink.
                    let (most, tolerances) = (self.h.min(self.options.most), self.options.tolerances);
                    self.h = first_step(
                        system,
                        &self.now,
                        (S::ORDER, S::LONG_STEPS),
                        direction,
                        most,
                        &tolerances,
                    );
                    self.control.iter_mut().for_each(Controller::restart);
                }
                BranchHold::Same if is_controlled => self.h = self.discontinuity.limit_growth(self.h),
                _ => {}
            }
        }
        self.propose(system, limit);
        Ok(())
    }

    /// Holds the branches of a step from here on; the accelerations here become theirs. Never returns
    /// [`BranchHold::Sliding`]: the handling is then suspended, and branches are free.
    #[inline(always)]
    pub(super) fn hold_branches<Y: System<V>>(
        &mut self,
        system: &mut Y,
        h: f64,
    ) -> Result<BranchHold, Y::Error> {
        if Y::IS_SMOOTH {
            return Ok(BranchHold::Free);
        }
        let on = (!self.is_fixed() || self.discontinuity.is_requested()) && self.discontinuity.is_active();
        let held = system.hold_branches(&mut self.now, h, on)?;
        if held != BranchHold::Sliding {
            return Ok(held);
        }
        self.slides_at.get_or_insert(self.now.t);
        self.slides += 1;
        self.discontinuity.suspend();
        Ok(BranchHold::Free)
    }
}

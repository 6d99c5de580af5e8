//! Steps that end where accelerations stop being smooth, with the branches that they hold up to there.

use crate::integrate::dense::Hermite;
use crate::integrate::stepper::first_step::first_step;
use crate::integrate::stepper::{Stepper, Trial};
use crate::integrate::{Controller, Dense, Hold, Scheme, StepNode, System};
use crate::model::Vector;

impl<V: Vector, S: Scheme<V>> Stepper<V, S> {
    /// End and signed size of the step, if it is to be made again to end where the accelerations stop being
    /// smooth.
    #[inline(always)]
    pub(super) fn landing<Y: System<V>>(
        &mut self,
        system: &mut Y,
        trial: &Trial<V>,
    ) -> Result<Option<(f64, f64)>, Y::Error> {
        let Trial { start, end, kept, error, .. } = trial;
        if Y::IS_SMOOTH || !kept.branches || !self.landing.is_worth_trying() {
            return Ok(None);
        }
        let h = end.t - start.t;
        // The first stage may be the step's own: see `Accelerations::attempting`.
        let begin = StepNode { a: self.scheme.stages()[0].u, ..*start };
        let (step, fails) = ((start.t, h), *error > 1.0 && !self.is_fixed());
        let part = if system.finds_kinks_by_ends() {
            let path = Hermite::between(&begin, end, h);
            system.kink(step, fails, |theta| path.at(theta))
        } else {
            let path = self.scheme.dense(system, &begin, end, h)?;
            system.kink(step, fails, |theta| path.at(theta))
        };
        let Some(part) = part else { return Ok(None) };
        let end_t = start.t + part * h;
        self.landing.attempt();
        Ok((end_t != start.t && end_t != end.t).then_some((end_t, end_t - start.t)))
    }

    /// Before the first attempt of a step: holds branches, and lets the method, or what changed with them,
    /// say how long the step is.
    #[inline(always)]
    pub(super) fn begin<Y: System<V>>(&mut self, system: &mut Y, limit: f64) -> Result<(), Y::Error> {
        let direction = if limit < self.now.t { -1.0 } else { 1.0 };
        let h = self.next_time(limit).1;
        if h != 0.0 {
            let free = !S::PROPOSES && !self.is_fixed();
            match self.hold_branches(system, h)? {
                Hold::Changed if free => {
                    // What lies behind tells nothing of how fast it goes on from here.
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
                Hold::On if free => self.h = self.landing.unchanged(self.h),
                _ => {}
            }
        }
        self.propose(system, limit);
        Ok(())
    }

    /// Holds the branches of a step from here on; the accelerations here become theirs.
    #[inline(always)]
    pub(super) fn hold_branches<Y: System<V>>(&mut self, system: &mut Y, h: f64) -> Result<Hold, Y::Error> {
        if Y::IS_SMOOTH {
            return Ok(Hold::Off);
        }
        let on = (!self.is_fixed() || self.landing.is_asked()) && self.landing.is_on();
        let held = system.hold_branches(&mut self.now, h, on)?;
        if held != Hold::Slides {
            return Ok(held);
        }
        self.slides_at.get_or_insert(self.now.t);
        self.slides += 1;
        self.landing.slides();
        Ok(Hold::Off)
    }
}

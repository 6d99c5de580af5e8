//! Steps that are cut short, taken back or rejected after they were made, and restarts from another state.

use crate::integrate::stepper::first_step::start_accelerations;
use crate::integrate::stepper::{Step, StepError, Stepper, Trial};
use crate::integrate::{Controller, Phase, Scheme, StepNode, System};
use crate::model::Vector;

impl<V: Vector, S: Scheme<V>> Stepper<V, S> {
    /// Repeats the step just made with another, not larger size, so that it ends exactly at an event. The
    /// stepper then stands there.
    pub fn shorten<Y: System<V>>(
        &mut self,
        system: &mut Y,
        step: &Step<V>,
        end_t: f64,
    ) -> Result<Step<V>, StepError<Y::Error>> {
        self.now = step.start;
        self.origin = (end_t, 0);
        let h = end_t - step.start.t;
        self.scheme.prepare_replay(step, h / step.h);
        match self.try_step::<_, true>(system, end_t, h) {
            Ok(Trial { start, end, flags, .. }) => {
                self.now = end;
                Ok(Step { start, end, h, flags })
            }
            Err(failure) => {
                // What was prepared for this step must not start the iterations of another one.
                let error = self.give_up(failure, h);
                self.scheme.forget_history();
                Err(error)
            }
        }
    }

    /// Takes the step just made back; it no longer counts as accepted.
    pub fn undo(&mut self, step: &Step<V>) {
        self.now = step.start;
        self.origin = (step.start.t, 0);
        self.accepted -= 1;
        self.scheme.forget_history();
    }

    /// Returns to a state some steps before. They remain counted.
    pub fn roll_back(&mut self, to: &StepNode<V>) {
        self.now = *to;
        self.origin = (to.t, 0);
        self.scheme.forget_history();
    }

    /// Takes the step just made back and counts it as rejected.
    pub fn reject(&mut self, step: &Step<V>) {
        self.undo(step);
        self.rejected += 1;
    }

    /// Has the next step, of fixed size, end where a branch of the accelerations changes. The step just
    /// `made`, if there is one, is taken back.
    pub fn end_at_branch(&mut self, made: Option<&Step<V>>) {
        if let Some(step) = made {
            self.undo(step);
        }
        self.discontinuity.request();
    }

    /// Goes on from another state, after a discontinuity. The step size is kept, the controller's memory is
    /// not. A method that is stable for all step sizes would step over a fast transient and miss what happens
    /// in it: its step is chosen as at a start, in direction of `limit`, where that is shorter.
    pub fn restart<Y: System<V>>(
        &mut self,
        system: &mut Y,
        t: f64,
        y: Phase<V>,
        limit: f64,
    ) -> Result<(), StepError<Y::Error>> {
        let a = start_accelerations(system, t, &y)?;
        self.now = StepNode { t, y, a };
        self.scheme.forget_history();
        self.origin = (t, 0);
        self.control.iter_mut().for_each(Controller::restart);
        if S::STABILITY_BORDER.is_infinite() && self.options.fixed.is_none() {
            self.h = self.h.min(self.first_step(system, limit));
        }
        Ok(())
    }
}

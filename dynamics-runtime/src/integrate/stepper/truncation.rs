//! What becomes of steps that were made: they end at events, are taken back, left by another state, or made
//! once more.

use crate::integrate::phase::zip;
use crate::integrate::stepper::{Step, StepError, Stepper, Trial, start_accelerations};
use crate::integrate::{Controller, Phase, Scheme, StepNode, System, Tolerances};
use crate::model::Vector;

/// Ends that are apart by no more permitted errors are the same.
const SAME: f64 = 1.0;

impl<V: Vector, S: Scheme<V>> Stepper<V, S> {
    /// The step just made, again with another size (not longer): ends it exactly at an event. The stepper
    /// stands there then.
    pub fn shorten<Y: System<V>>(
        &mut self,
        system: &mut Y,
        step: &Step<V>,
        end_t: f64,
    ) -> Result<Step<V>, StepError<Y::Error>> {
        self.now = step.start;
        self.origin = (end_t, 0);
        let h = end_t - step.start.t;
        self.scheme.retrace(step, h / step.h);
        match self.try_step::<_, true>(system, end_t, h) {
            Ok(Trial { start, end, kept, .. }) => {
                self.now = end;
                Ok(Step { start, end, h, kept })
            }
            Err(failure) => {
                // What was foretold of it is of no other step.
                let error = self.give_up(failure, h);
                self.scheme.forget();
                Err(error)
            }
        }
    }

    /// Takes the step just made back.
    pub fn undo(&mut self, step: &Step<V>) {
        self.now = step.start;
        self.origin = (step.start.t, 0);
        self.accepted -= 1;
        self.scheme.forget();
    }

    /// Stands again where it stood some steps before. They remain counted.
    pub fn go_back(&mut self, to: &StepNode<V>) {
        self.now = *to;
        self.origin = (to.t, 0);
        self.scheme.forget();
    }

    /// Takes it back as one that was tried in vain.
    pub fn reject(&mut self, step: &Step<V>) {
        self.undo(step);
        self.rejected += 1;
    }

    /// Has the next step, of fixed size, end where a branch of the accelerations changes: instead of the one
    /// just made, if there is one.
    pub fn end_at_branch(&mut self, made: Option<&Step<V>>) {
        if let Some(step) = made {
            self.undo(step);
        }
        self.landing.ask();
    }

    /// Goes on from another state, after a discontinuity. The step size is kept, the controller's memory is
    /// not. What is A-stable would step over what dies out fast after it, and know nothing of what happens
    /// there: its step is chosen as at a start, in direction of `limit`, where that is shorter.
    pub fn restart<Y: System<V>>(
        &mut self,
        system: &mut Y,
        t: f64,
        y: Phase<V>,
        limit: f64,
    ) -> Result<(), StepError<Y::Error>> {
        let a = start_accelerations(system, t, &y)?;
        self.now = StepNode { t, y, a };
        self.scheme.forget();
        self.origin = (t, 0);
        self.control.iter_mut().for_each(Controller::restart);
        if S::STABILITY_BORDER.is_infinite() && self.options.fixed.is_none() {
            self.h = self.h.min(self.first_step(system, limit));
        }
        Ok(())
    }

    /// The interpolant of the step just made.
    pub fn dense<Y: System<V>>(&mut self, system: &mut Y, step: &Step<V>) -> Result<S::Dense, Y::Error> {
        // The first stage may be the step's own: see `Accelerations::attempting`.
        let start = StepNode { a: self.scheme.stages()[0].u, ..step.start };
        system.hold_stages(step.kept.stages, &self.options.tolerances);
        self.scheme.dense(system, &start, &step.end, step.h)
    }

    /// Makes a recorded step once more, for its interpolant; `None` where it would end elsewhere now:
    /// iterations may end at another solution of their equations, or at none.
    pub fn again<Y: System<V>>(
        scheme: &mut S,
        system: &mut Y,
        step: &Step<V>,
        tolerances: &Tolerances,
    ) -> Result<Option<S::Dense>, Y::Error> {
        let mut start = step.start;
        system.hold_stages(step.kept.stages, tolerances);
        system.hold_branches(&mut start, step.h, step.kept.branches)?;
        system.attempting(&mut start, step.h)?;
        let mut end = step.end;
        if step.kept.branches {
            // The step that follows may have found others there.
            end.a = system.accelerations(end.t, &end.y.q, &end.y.u)?;
        }
        if let Some(dense) = scheme.by_ends(system, &start, &end, step.h, tolerances)? {
            return Ok(Some(dense));
        }
        let strays = scheme.retrace(&Step { start, end, ..*step }, 1.0);
        let (found, _) = Self::attempt_again(scheme, system, (&start, step.h), tolerances)?;
        if strays && !(scheme.converged() && Self::ends_there(system, step, found, tolerances)?) {
            return Ok(None);
        }
        let dense = scheme.dense(system, &start, &end, step.h)?;
        // The step after it may be made again, too.
        scheme.accepted(step);
        Ok(Some(dense))
    }

    /// What a step of this size leads to, before it is projected. Attempts are inlined where steps are made;
    /// everywhere else this one copy serves, for they are most of what a method is to a compiler.
    #[inline(never)]
    pub(crate) fn attempt_again<Y: System<V>>(
        scheme: &mut S,
        system: &mut Y,
        (start, h): (&StepNode<V>, f64),
        tolerances: &Tolerances,
    ) -> Result<(Phase<V>, f64), Y::Error> {
        scheme.attempt_again(system, start, h, tolerances)
    }

    /// Whether a step that was made once more ends where it did.
    fn ends_there<Y: System<V>>(
        system: &mut Y,
        step: &Step<V>,
        mut end: Phase<V>,
        tolerances: &Tolerances,
    ) -> Result<bool, Y::Error> {
        let Step { start, end: StepNode { t, y, .. }, .. } = step;
        let apart = |end: &Phase<V>| tolerances.norm(&zip(end, y, |found, known| found - known), &start.y, y);
        if apart(&end) > SAME && system.projects() {
            system.project(*t, &mut end, tolerances)?;
        }
        Ok(apart(&end) <= SAME)
    }

    /// The end of a step with this start, size and flags, projected, and its error, 1 where it is just
    /// permitted; `None` where its equations are not solved.
    pub fn end_of<Y: System<V>>(
        scheme: &mut S,
        system: &mut Y,
        step: &Step<V>,
        tolerances: &Tolerances,
    ) -> Result<Option<(Phase<V>, f64)>, Y::Error> {
        let mut start = step.start;
        system.hold_branches(&mut start, step.h, step.kept.branches)?;
        Self::end_on_branches(scheme, system, &Step { start, ..*step }, tolerances)
    }

    /// As [`Stepper::end_of`], on whatever branches the system holds: those of another motion, beside which
    /// this one is followed.
    pub(crate) fn end_on_branches<Y: System<V>>(
        scheme: &mut S,
        system: &mut Y,
        step: &Step<V>,
        tolerances: &Tolerances,
    ) -> Result<Option<(Phase<V>, f64)>, Y::Error> {
        let mut start = step.start;
        system.hold_stages(step.kept.stages, tolerances);
        system.attempting(&mut start, step.h)?;
        let (mut end, error) = Self::attempt_again(scheme, system, (&start, step.h), tolerances)?;
        if !(scheme.converged() && end.is_finite() && error.is_finite()) {
            return Ok(None);
        }
        if system.projects() {
            system.project(start.t + step.h, &mut end, tolerances)?;
        }
        Ok(Some((end, error)))
    }
}

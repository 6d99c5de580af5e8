//! Recorded steps that are made once more: for their interpolant, or for their end alone.

use crate::integrate::phase::zip;
use crate::integrate::stepper::{Step, Stepper};
use crate::integrate::{Phase, Scheme, StepNode, System, Tolerances};
use crate::model::Vector;

/// Two ends of a step, the recorded and the repeated one, are the same if they differ by no more permitted
/// errors: iterations that start elsewhere leave as much.
const SAME_END: f64 = 1.0;

impl<V: Vector, S: Scheme<V>> Stepper<V, S> {
    /// The interpolant of the step just made.
    pub fn dense<Y: System<V>>(&mut self, system: &mut Y, step: &Step<V>) -> Result<S::Dense, Y::Error> {
        // The first stage may belong to this step: see `Accelerations::begin_attempt`.
        let start = StepNode { a: self.scheme.stages()[0].u, ..step.start };
        system.project_stages(step.flags.stages, &self.options.tolerances);
        self.scheme.dense(system, &start, &step.end, step.h)
    }

    /// The interpolant of a recorded step, which is made once more for it; `None` where it would end
    /// elsewhere now, since its iterations converge to another solution or not at all.
    pub fn replay<Y: System<V>>(
        scheme: &mut S,
        system: &mut Y,
        step: &Step<V>,
        tolerances: &Tolerances,
    ) -> Result<Option<S::Dense>, Y::Error> {
        // The accelerations at both ends, with the branches of this step.
        let mut start = step.start;
        system.project_stages(step.flags.stages, tolerances);
        system.hold_branches(&mut start, step.h, step.flags.branches)?;
        system.begin_attempt(&mut start, step.h)?;
        let mut end = step.end;
        if step.flags.branches {
            // The record has those of the next step, which may hold other branches.
            end.a = system.accelerations(end.t, &end.y.q, &end.y.u)?;
        }
        if let Some(dense) = scheme.dense_from_ends(system, &start, &end, step.h, tolerances)? {
            return Ok(Some(dense));
        }
        let is_iterative = scheme.prepare_replay(&Step { start, end, ..*step }, 1.0);
        let (found, _) = Self::replay_attempt(scheme, system, (&start, step.h), tolerances)?;
        if is_iterative && !(scheme.has_converged() && Self::ends_there(system, step, found, tolerances)?) {
            return Ok(None);
        }
        let dense = scheme.dense(system, &start, &end, step.h)?;
        // The replay of the next step may start its iterations from this one.
        scheme.accept_step(step);
        Ok(Some(dense))
    }

    /// The end of an attempt, before it is projected. Attempts are inlined where runs make steps; all other
    /// callers share this one copy, since attempts are most of a method's code.
    #[inline(never)]
    pub(crate) fn replay_attempt<Y: System<V>>(
        scheme: &mut S,
        system: &mut Y,
        (start, h): (&StepNode<V>, f64),
        tolerances: &Tolerances,
    ) -> Result<(Phase<V>, f64), Y::Error> {
        scheme.replay_attempt(system, start, h, tolerances)
    }

    /// Whether a repeated step ends where the recorded one did.
    fn ends_there<Y: System<V>>(
        system: &mut Y,
        step: &Step<V>,
        mut end: Phase<V>,
        tolerances: &Tolerances,
    ) -> Result<bool, Y::Error> {
        let Step { start, end: StepNode { t, y, .. }, .. } = step;
        let difference =
            |end: &Phase<V>| tolerances.norm(&zip(end, y, |found, known| found - known), &start.y, y);
        if difference(&end) > SAME_END && system.needs_projection() {
            system.project(*t, &mut end, tolerances)?;
        }
        Ok(difference(&end) <= SAME_END)
    }

    /// The projected end of a step with this start, size and flags, and its error, 1 where it is just
    /// permitted; `None` where its equations are not solved.
    pub fn replay_end<Y: System<V>>(
        scheme: &mut S,
        system: &mut Y,
        step: &Step<V>,
        tolerances: &Tolerances,
    ) -> Result<Option<(Phase<V>, f64)>, Y::Error> {
        let mut start = step.start;
        system.hold_branches(&mut start, step.h, step.flags.branches)?;
        Self::replay_end_on_held_branches(scheme, system, &Step { start, ..*step }, tolerances)
    }

    /// As [`Stepper::replay_end`], on the branches that the system holds already: those of a reference
    /// motion, with which this one is compared.
    pub(crate) fn replay_end_on_held_branches<Y: System<V>>(
        scheme: &mut S,
        system: &mut Y,
        step: &Step<V>,
        tolerances: &Tolerances,
    ) -> Result<Option<(Phase<V>, f64)>, Y::Error> {
        let mut start = step.start;
        system.project_stages(step.flags.stages, tolerances);
        system.begin_attempt(&mut start, step.h)?;
        let (mut end, error) = Self::replay_attempt(scheme, system, (&start, step.h), tolerances)?;
        if !(scheme.has_converged() && end.is_finite() && error.is_finite()) {
            return Ok(None);
        }
        if system.needs_projection() {
            system.project(start.t + step.h, &mut end, tolerances)?;
        }
        Ok(Some((end, error)))
    }
}

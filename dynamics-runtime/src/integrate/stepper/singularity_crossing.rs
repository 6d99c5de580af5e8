//! Steps across positions at which the constraint Jacobian nearly loses rank (change points).
//!
//! At a distance x of such a position the constraint violation of a stage is amplified by 1/x², and so its
//! accelerations are wrong. There are two cases.
//!
//! **Fixed steps.** No tolerance judges them. A stage that happens to lie beside a change point can throw the
//! end of the step along the constraints, by percents of its velocity. Φ and Φ̇ do not show it, and the next
//! step does not either. The stages do: they disagree by many times their usual disagreement. Such a step is
//! divided so that its stages lie elsewhere ([`SingularityCrossing::judge`]); its parts end where the whole
//! step would have ended.
//!
//! **Step control.** Steps have to get across while rounding counts for less than the tolerance. Rounding is
//! ε/x³ of the accelerations of a stage and ε/x² of the velocities at the ends. It lies along M⁻¹Φ_qᵀ, in the
//! direction that the constraints nearly lose, and projecting the end removes it, except for what turns out
//! of this direction between the stage and the end. That remainder is measured and judged instead of the
//! whole move ([`Stepper::projection_error`]). Of uncertain ends the longest is taken whose uncertainty is
//! not much larger than that of others ([`SingularityCrossing::better_end`]). Motions then pass at tolerances
//! of 1e-13 (tested), and passed at 1e-14 in trials.

use crate::integrate::phase::zip;
use crate::integrate::stepper::{OFF_CONSTRAINT_ERROR, StepRejection, Stepper, Trial};
use crate::integrate::{Phase, ProjectedEnd, Scheme, StepNode, System};
use crate::math;
use crate::model::Vector;

/// Largest violation, in permitted errors, that projecting the end of a step may remove without counting as
/// an error of the step. Beyond, the constraints would decide the motion instead of the method. A smaller
/// value rejects more steps of long runs, a larger one accepts steps that projection displaces.
const MAX_VIOLATION: f64 = 10.0;
/// Further attempts to make a step near rank loss, each with other stages and another end. At the position
/// itself rounding decides, and ever shorter steps come only nearer to it.
const MAX_RETRIES: u32 = 5;
/// Under step control each retry is this factor times as long as the one before.
const RETRY_FACTOR: f64 = 0.8;

/// Where a retry of a fixed step ends: at `part` of what is left to the end of the step, and `behind` of a
/// fixed step later.
struct RetryEnd {
    part: f64,
    behind: f64,
}

/// The ends of the retries of a fixed step, in their order. Retries before the end and behind it alternate,
/// since the end itself may be the singular position.
const RETRY_ENDS: [RetryEnd; 5] = [
    RetryEnd { part: 1.0, behind: 0.3 },
    RetryEnd { part: 0.8, behind: 0.0 },
    RetryEnd { part: 1.0, behind: 0.15 },
    RetryEnd { part: 0.6, behind: 0.0 },
    RetryEnd { part: 0.4, behind: 0.0 },
];

/// A step is inspected whose stages disagree by so many times their usual disagreement. A smaller value
/// inspects steps of ordinary motions, a larger one misses steps that were thrown.
const UNUSUAL_DISAGREEMENT: f64 = 30.0;
/// The usual disagreement follows that of the last step by no more than this factor, up or down, so that one
/// unusual step does not become the measure.
const USUAL_CHANGE: f64 = 2.0;
/// Stages that disagree by less, in permitted errors, do so by rounding.
const ROUNDING_DISAGREEMENT: f64 = 0.1;
/// Largest part of the way of a fixed step, in positions or in velocities, by which projection may displace
/// its end. No tolerance judges it; beyond, the step is an error.
const MAX_DISPLACEMENT: f64 = 0.02;
/// The end of a shorter step replaces a longer one only if its uncertainty is smaller by this factor: the
/// longer step has come further, and may have passed the position.
const PREFERRED_CERTAINTY: f64 = 4.0;
/// A projection whose second-order part is larger than this is not treated as a straight move. A move of
/// `by` permitted errors is by·tolerance long, and its second-order part is by²·tolerance permitted errors.
const MAX_CURVATURE: f64 = 0.1;
/// Part of a fixed step by which an end may miss that of the step and still counts as the same time.
const SAME_TIME_PART: f64 = 1e-6;
/// Uncertainty from rounding at the end of a step, in permitted errors, from which on it counts as a
/// disagreement of the stages. Smaller uncertainty is unavoidable near the position, so no other attempt
/// would be better.
pub(super) const UNCERTAIN_END: f64 = 100.0;

/// What is kept from one fixed step to the next, and from one attempt to the next.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SingularityCrossing {
    /// Usual disagreement of the stages of fixed steps; 0 where it is not known.
    usual: f64,
    /// The attempt whose stages disagreed least so far, and by how much.
    best: Option<(u32, f64)>,
    /// No other attempt follows this one.
    is_last: bool,
    /// Disagreement of the stages in the last attempt.
    disagreement: f64,
    /// Number of fixed steps that were divided, and the start of the first.
    subdivided: (u64, Option<f64>),
    /// The present fixed step is already counted as divided.
    is_subdivided: bool,
    /// Under step control: end time and uncertainty of the best attempt whose end rounding makes uncertain.
    best_uncertain: Option<(f64, f64)>,
}

/// What to do with an attempt at a fixed step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum CrossingVerdict {
    /// Accept it: it is as good as others.
    Accept,
    /// Accept it although its stages disagree unusually: no other attempt is better.
    AcceptBest,
    /// Repeat the step as the retry of this number.
    Retry(u32),
}

impl SingularityCrossing {
    /// Begins a new step.
    pub(super) fn begin_step(&mut self) {
        (self.best, self.is_last, self.best_uncertain) = (None, false, None);
    }

    /// Whether a step under step control is repeated shorter, so that its end and its stages lie elsewhere;
    /// counts `retries`. `projects`: whether the ends of steps are projected.
    pub(super) fn needs_retry<V>(&mut self, retries: &mut u32, trial: &Trial<V>, projects: bool) -> bool {
        let is_doubtful = trial.noise > 1.0 || projects && trial.error > OFF_CONSTRAINT_ERROR;
        if !is_doubtful || self.is_last {
            return false;
        }
        if trial.error <= 1.0
            && self.best_uncertain.is_none_or(|(_, least)| PREFERRED_CERTAINTY * trial.noise < least)
        {
            self.best_uncertain = Some((trial.end.t, trial.noise));
        }
        let is_left = *retries < MAX_RETRIES;
        *retries += u32::from(is_left);
        is_left
    }

    /// The end time of an earlier attempt that was better than the last one.
    pub(super) fn better_end<V>(&mut self, trial: &Trial<V>, retries: u32) -> Option<f64> {
        let (end, least) = self.best_uncertain.take()?;
        // A certain end is better than any uncertain one. A step whose error is merely too large is left to
        // the step control.
        let is_uncertain = trial.noise > 1.0 && least <= PREFERRED_CERTAINTY * trial.noise;
        let is_given_up = trial.error > 1.0 && retries == MAX_RETRIES;
        let is_better = end != trial.end.t && (is_uncertain || is_given_up);
        self.is_last |= is_better;
        is_better.then_some(end)
    }

    /// Judges an attempt at a fixed step by the disagreement of its stages, infinite where it failed. `near`
    /// evaluates whether the step is near rank loss.
    pub(super) fn judge(
        &mut self,
        attempt: u32,
        disagreement: f64,
        near: impl FnOnce() -> bool,
    ) -> CrossingVerdict {
        self.disagreement = disagreement;
        let is_usual = self.usual > 0.0 && disagreement <= UNUSUAL_DISAGREEMENT * self.usual;
        let is_first = self.usual == 0.0 && disagreement.is_finite();
        if is_usual || is_first || attempt == 0 && self.best.is_none() && !near() {
            return CrossingVerdict::Accept;
        }
        if self.is_last {
            return CrossingVerdict::AcceptBest;
        }
        if self.best.is_none_or(|(_, least)| disagreement < least) {
            self.best = Some((attempt, disagreement));
        }
        if (attempt as usize) < RETRY_ENDS.len() {
            return CrossingVerdict::Retry(attempt + 1);
        }
        // All retries are made: the best of them is repeated.
        self.is_last = true;
        match self.best {
            Some((best, _)) if best != attempt => CrossingVerdict::Retry(best),
            _ => CrossingVerdict::AcceptBest,
        }
    }

    /// Number of fixed steps that were divided, and the start of the first.
    pub(super) fn subdivided_steps(&self) -> (u64, Option<f64>) {
        self.subdivided
    }

    /// Counts a step from `t` that is a `whole` fixed step or a part of one; `done`: the last part.
    fn count_part(&mut self, t: f64, whole: bool, done: bool) {
        if self.best.is_some() && !whole && !self.is_subdivided {
            self.subdivided = (self.subdivided.0 + 1, self.subdivided.1.or(Some(t)));
            self.is_subdivided = true;
        }
        self.is_subdivided &= !done;
    }

    /// Updates the usual disagreement after a `whole` fixed step. Parts of steps are not representative.
    fn update_usual(&mut self, whole: bool) {
        if whole && self.disagreement.is_finite() {
            let found = math::max(self.disagreement, ROUNDING_DISAGREEMENT);
            let follow = |usual: f64| found.clamp(usual / USUAL_CHANGE, usual * USUAL_CHANGE);
            self.usual = if self.usual == 0.0 { found } else { follow(self.usual) };
        }
    }
}

impl<V: Vector, S: Scheme<V>> Stepper<V, S> {
    /// The error that a projection adds to a step, 1 where it is just permitted. See the header.
    #[inline(always)]
    pub(super) fn projection_error<Y: System<V>>(
        &self,
        system: &mut Y,
        moved: &ProjectedEnd,
        ends: (&Phase<V>, &Phase<V>),
        end_t: f64,
    ) -> Result<f64, Y::Error> {
        let violated = moved.violation / MAX_VIOLATION;
        if Y::IS_UNCONSTRAINED || violated <= 1.0 || self.is_fixed() {
            Ok(violated)
        } else {
            self.turned_error(system, moved, ends, end_t)
        }
    }

    /// The same where the projection moved the end far. Near rank loss a move along the direction in which
    /// the start of the step would be projected is no error of the step; the rest of it is.
    #[cold]
    fn turned_error<Y: System<V>>(
        &self,
        system: &mut Y,
        moved: &ProjectedEnd,
        (from, to): (&Phase<V>, &Phase<V>),
        end_t: f64,
    ) -> Result<f64, Y::Error> {
        let (start, tolerances) = (&self.now, &self.options.tolerances);
        let violated = moved.violation / MAX_VIOLATION;
        let tolerance = math::max(tolerances.absolute, tolerances.relative);
        let end = StepNode { t: end_t, y: *to, a: start.a };
        let is_rounding = moved.noise > 1.0;
        if !is_rounding
            || moved.by * moved.by * tolerance > MAX_CURVATURE
            || !system.is_near_rank_loss(start, &end)
        {
            return Ok(violated);
        }
        let moved = zip(from, to, |from, to| from - to);
        let rest = system.error_after_projection(start.t, &start.y, &moved)?;
        Ok(rest.map_or(violated, |rest| math::min(violated, tolerances.norm(&rest, &start.y, to))))
    }

    /// Judges an attempt at a fixed step of a constrained system. See the header.
    #[inline(always)]
    pub(super) fn judge_crossing<Y: System<V>>(
        &mut self,
        system: &mut Y,
        (attempt, h): (u32, f64),
        trial: &Result<Trial<V>, StepRejection<Y::Error>>,
    ) -> CrossingVerdict {
        if Y::IS_UNCONSTRAINED || self.options.fixed.is_none() || !system.has_constraints() {
            return CrossingVerdict::Accept;
        }
        let start = &self.now;
        match trial {
            // Stages of implicit methods satisfy their equations where these have a solution.
            Ok(_) if !S::IS_EXPLICIT => CrossingVerdict::Accept,
            Ok(trial) => self
                .crossing
                .judge(attempt, trial.stage_disagreement, || system.is_near_rank_loss(start, &trial.end)),
            // Away from rank loss such a step is merely too long.
            Err(StepRejection::Displaced(_) | StepRejection::Evaluation(_) | StepRejection::NotSolved) => {
                let ahead = |x: f64, u: f64| x + h * u;
                let y = zip(&start.y, &Phase { q: start.y.u, u: start.a }, ahead);
                let end = StepNode { t: start.t + h, y, a: start.a };
                self.crossing.judge(attempt, f64::INFINITY, || system.is_near_rank_loss(start, &end))
            }
            Err(_) => CrossingVerdict::Accept,
        }
    }

    /// See [`SingularityCrossing::needs_retry`].
    #[inline(always)]
    pub(super) fn needs_retry<Y: System<V>>(
        &mut self,
        system: &Y,
        retries: &mut u32,
        trial: &Trial<V>,
    ) -> bool {
        if Y::IS_UNCONSTRAINED {
            return false;
        }
        !self.is_fixed() && self.crossing.needs_retry(retries, trial, system.needs_projection())
    }

    /// See [`SingularityCrossing::better_end`].
    #[inline(always)]
    pub(super) fn better_end<Y: System<V>>(&mut self, trial: &Trial<V>, retries: u32) -> Option<f64> {
        if Y::IS_UNCONSTRAINED { None } else { self.crossing.better_end(trial, retries) }
    }

    /// The best attempt at a fixed step near rank loss, or an error where its stages disagree by more than
    /// [`MAX_DISPLACEMENT`] of its way.
    #[cold]
    pub(super) fn check_disagreement<E>(
        &self,
        trial: Result<Trial<V>, StepRejection<E>>,
        h: f64,
    ) -> Result<Trial<V>, StepRejection<E>> {
        let trial = trial?;
        let apart = self.scheme.stage_disagreement();
        let shifted = zip(&trial.end.y, &apart, |end, apart| end - apart);
        match self.displaced_coordinate(&shifted, &trial.end.y, h) {
            Some(coordinate) => Err(StepRejection::Displaced(coordinate)),
            None => Ok(trial),
        }
    }

    /// The disagreement of the stages of an attempt, in permitted errors.
    #[inline(always)]
    pub(super) fn stage_disagreement<Y: System<V>>(&self, system: &Y, error: f64, end: &Phase<V>) -> f64 {
        if S::CONTROL.is_none() && S::IS_EXPLICIT && system.has_constraints() {
            return self.options.tolerances.norm(&self.scheme.stage_disagreement(), &self.now.y, end);
        }
        error
    }

    /// Notes an accepted step of fixed size, or a part of one. The part that follows ends where the whole
    /// step was to end.
    #[inline(always)]
    pub(super) fn note_fixed_step(&mut self, end_t: f64, h: f64) {
        let Some(fixed) = self.options.fixed else { return };
        let whole = h.abs() >= (1.0 - SAME_TIME_PART) * fixed.abs();
        let planned_end = self.origin.0 + (self.origin.1 + 1) as f64 * fixed.abs().copysign(h);
        let left = (planned_end - end_t) * h.signum();
        let done = left <= SAME_TIME_PART * fixed.abs();
        self.origin.1 += u64::from(done);
        self.crossing.count_part(self.now.t, whole, done);
        self.crossing.update_usual(whole);
    }

    /// The end of a retry of a step of size h.
    #[cold]
    pub(super) fn retry_end(&self, (h, retry): (f64, u32), limit: f64) -> f64 {
        let t = self.now.t;
        let Some(fixed) = self.options.fixed else {
            return t + h * math::powi(RETRY_FACTOR, retry as i32);
        };
        let RetryEnd { part, behind } = RETRY_ENDS[retry as usize - 1];
        let end = t + part * h + (behind * fixed).copysign(h);
        if (limit - end) * h.signum() < 0.0 { limit } else { end }
    }

    /// The coordinate that a move displaced most, if that was by more than [`MAX_DISPLACEMENT`] of the way
    /// of a step from here.
    #[cold]
    pub(super) fn displaced_coordinate(&self, from: &Phase<V>, to: &Phase<V>, h: f64) -> Option<usize> {
        // The measure of a part of a fixed step, however short, is the whole step.
        let h = h.abs().max(self.options.fixed.unwrap_or(0.0).abs());
        let parts = [&from.q, &to.q, &from.u, &to.u, &self.now.y.u];
        displaced_coordinate(parts.map(|part| part.as_slice()), h)
    }
}

/// See [`Stepper::displaced_coordinate`]: positions before and after the move, velocities before and after
/// it, and the velocities at the start of the step.
fn displaced_coordinate([q, to_q, u, to_u, at_start]: [&[f64]; 5], h: f64) -> Option<usize> {
    let largest =
        |values: &mut dyn Iterator<Item = f64>| values.fold(0.0f64, |most, x| math::max(most, x.abs()));
    let is_far = |from: &[f64], to: &[f64], way: f64| {
        largest(&mut to.iter().zip(from).map(|(to, from)| to - from)) > MAX_DISPLACEMENT * way
    };
    let speed = 0.5 * (largest(&mut at_start.iter().copied()) + largest(&mut to_u.iter().copied()));
    let is_far_in_q = is_far(q, to_q, speed * h);
    let (from, to) = if is_far_in_q { (q, to_q) } else { (u, to_u) };
    let by = |i: usize| (to[i] - from[i]).abs();
    let most = || (0..from.len()).max_by(|&i, &j| by(i).total_cmp(&by(j))).unwrap_or(0);
    (is_far_in_q || is_far(u, to_u, speed)).then(most)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(steps: &[f64]) -> SingularityCrossing {
        let mut crossing = SingularityCrossing::default();
        for found in steps {
            crossing.begin_step();
            assert_eq!(crossing.judge(0, *found, || panic!("nothing unusual")), CrossingVerdict::Accept);
            crossing.update_usual(true);
        }
        crossing.begin_step();
        crossing
    }

    #[test]
    fn steps_that_change_slowly_are_usual() {
        let steps: [f64; 200] = core::array::from_fn(|k| 1e3 + k as f64 * if k < 100 { 300.0 } else { -4.0 });
        after(&steps);
    }

    #[test]
    fn an_unusual_step_is_shortened_until_it_is_usual() {
        let mut crossing = after(&[1.0, 2.0, 1.0]);
        assert_eq!(crossing.judge(0, 1e3, || true), CrossingVerdict::Retry(1));
        assert_eq!(crossing.judge(1, 2e3, || true), CrossingVerdict::Retry(2));
        assert_eq!(crossing.judge(2, 3.0, || true), CrossingVerdict::Accept);
        crossing.update_usual(false);
        crossing.begin_step();
        // Away from rank loss it is accepted.
        assert_eq!(crossing.judge(0, 1e3, || false), CrossingVerdict::Accept);
    }

    #[test]
    fn steps_in_parts_are_counted_once() {
        let mut crossing = after(&[1.0, 1.0]);
        crossing.count_part(1.0, true, true);
        assert_eq!(crossing.subdivided_steps(), (0, None));
        assert_eq!(crossing.judge(0, 1e3, || true), CrossingVerdict::Retry(1));
        [false, true].into_iter().for_each(|done| crossing.count_part(2.0, false, done));
        assert_eq!(crossing.subdivided_steps(), (1, Some(2.0)));
        crossing.begin_step();
        // The last step of a run, which is shorter than the others.
        crossing.count_part(3.0, false, true);
        assert_eq!(crossing.subdivided_steps(), (1, Some(2.0)));
    }

    #[test]
    fn of_uncertain_ends_the_longest_is_taken_that_is_not_much_worse() {
        let trial = |t: f64, error: f64, noise: f64| {
            let zeros = nalgebra::SVector::<f64, 1>::zeros();
            let at = |t| StepNode { t, y: Phase::zeros(), a: zeros };
            Trial {
                start: at(0.0),
                end: at(t),
                error,
                stage_disagreement: error,
                noise,
                flags: Default::default(),
            }
        };
        let taken = |tried: &[(f64, f64, f64)]| {
            let (mut crossing, mut retries) = (SingularityCrossing::default(), 0);
            crossing.begin_step();
            for (k, &(t, error, noise)) in tried.iter().enumerate() {
                let on = crossing.needs_retry(&mut retries, &trial(t, error, noise), true);
                assert_eq!(on, k + 1 < tried.len(), "{k}");
            }
            let (t, error, noise) = tried[tried.len() - 1];
            let better = crossing.better_end(&trial(t, error, noise), retries);
            // The repeated attempt is accepted.
            assert!(better.is_none_or(|end| !crossing.needs_retry(&mut 0, &trial(end, 0.5, 9.0), true)));
            better.unwrap_or(t)
        };
        assert_eq!(taken(&[(1.0, 0.5, 9.0), (0.8, 0.5, 5.0), (0.6, 0.5, 0.9)]), 0.6);
        let uncertain = |last: f64| {
            [
                (1.0, 90.0, 0.0),
                (0.9, 0.5, 20.0),
                (0.8, 0.5, 9.0),
                (0.7, 40.0, 2.0),
                (0.6, 0.5, 50.0),
                (0.5, 0.5, last),
            ]
        };
        assert_eq!((taken(&uncertain(6.0)), taken(&uncertain(4.0))), (0.9, 0.5));
        // An attempt whose error is too large is not better.
        let mut refused = uncertain(0.1);
        refused[5].1 = 2.0;
        assert_eq!(taken(&refused), 0.9);
    }

    #[test]
    fn where_none_is_usual_the_best_is_made_again() {
        let mut crossing = after(&[1.0]);
        let found = [f64::INFINITY, 700.0, 400.0, 500.0, 900.0, 600.0];
        for (k, found) in found.iter().enumerate().take(5) {
            assert_eq!(crossing.judge(k as u32, *found, || true), CrossingVerdict::Retry(k as u32 + 1));
        }
        assert_eq!(crossing.judge(5, found[5], || true), CrossingVerdict::Retry(2));
        assert_eq!(crossing.judge(2, found[2], || true), CrossingVerdict::AcceptBest);
    }
}

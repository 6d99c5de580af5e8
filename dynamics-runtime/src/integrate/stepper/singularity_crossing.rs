//! How steps go over positions at which what holds them nearly loses a direction.
//!
//! No tolerance judges a fixed step. Where one of its stages happens to lie beside a change point of a
//! mechanism it has the accelerations of no motion: what a stage is off by, which is no matter elsewhere, is
//! amplified by the square of the distance, and the end of the step is thrown along the constraints, by up to
//! percents of its velocity. Φ and Φ̇ show nothing of it, and neither does the next step. The stages
//! themselves do: they disagree by many times what is usual. Such a step is made in parts, so that stages lie
//! elsewhere, and goes on to where it would have ended.
//!
//! Under step control, steps at a distance x of such a position have to get over it while rounding counts for
//! less than the tolerance: in them it is ε/x³ of the accelerations of a stage and ε/x² of the velocities
//! where they end. But all of it lies along M⁻¹Φ_qᵀ, in the direction that constraints nearly lose, and
//! projecting the end takes it back: what is left is only what turns out of that direction on the way from the
//! stage to the end. That is measured, and judged, instead of all that was taken back ([`Stepper::decided`]),
//! and of ends that are uncertain the longest is taken that is not much more so than others
//! ([`Passing::better`]). Rounding then lets motions pass at tolerances of 1e-13 (tested), and of 1e-14 as
//! far as was tried.

use crate::integrate::phase::zip;
use crate::integrate::stepper::{SURPRISE, StepRejection, Stepper, Trial};
use crate::integrate::{Method, Phase, ProjectedEnd, Scheme, StepNode, System};
use crate::math;
use crate::model::Vector;

/// A step whose end is projected by more than so many permitted errors is rejected, unless they are known to be
/// none: what holds it in place would then decide the motion, and not the method.
const MOST_MOVE: f64 = 10.0;
/// Attempts to make a step whose end and stages avoid a singular position of what holds it, each shorter than
/// the one before by the factor [`DETOUR`]: the position is then passed between stages. At the position
/// itself rounding errors decide, and shorter steps come nearer to it.
const MOST_DETOURS: u32 = 5;
/// See [`MOST_DETOURS`].
const DETOUR: f64 = 0.8;
/// Where the attempts end after the first: at a part of what is left to the end of the step, or behind that
/// by a part of a step, as the end itself may be the place.
const ENDS: [(f64, f64); 5] = [(1.0, 0.3), (0.8, 0.0), (1.0, 0.15), (0.6, 0.0), (0.4, 0.0)];
/// How many times as much as usual stages disagree where a step is looked at.
const UNUSUAL: f64 = 30.0;
/// What is usual follows the last step by no more than this factor.
const FOLLOWS: f64 = 2.0;
/// Stages that disagree by less, in permitted errors, do so by rounding.
const ROUNDING: f64 = 0.1;

/// The part of the way of a fixed step, in positions or in velocities, by which projecting may move its end. No
/// tolerance judges it, and a stage that lies beside a singular position throws it anywhere.
const MOST_PART: f64 = 0.02;
/// How many times less uncertain the end of a shorter step has to be.
const PREFERRED: f64 = 4.0;
/// The square of a move, in permitted errors, from which on it is too large for that: directions turn along
/// it.
const BENT: f64 = 0.1;
/// Part of a fixed step that it may miss its end by.
const SLACK: f64 = 1e-6;

/// What rounding makes uncertain at the end of a step is no matter below this, in permitted errors: the
/// nearer such a position is the larger it is, on either side.
pub(super) const UNCERTAIN: f64 = 100.0;

/// What is remembered from one fixed step to the next, and from one attempt to the next.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Passing {
    /// By how much stages disagree usually; 0: not known.
    usual: f64,
    /// The attempt that was best so far, and by how much its stages disagreed.
    best: Option<(u32, f64)>,
    /// No other is to be made after this one.
    last: bool,
    /// By how much the stages disagreed in the attempt made last.
    found: f64,
    /// How many steps were made in parts, and where the first of them starts.
    parted: (u64, Option<f64>),
    /// The step that is being made has been in parts already.
    parting: bool,
    /// Where the best of the steps under step control ended that rounding makes uncertain, and by how much.
    aside: Option<(f64, f64)>,
}

/// What is to be done with an attempt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Verdict {
    /// It is as good as others.
    Good,
    /// It is not, and no other is better.
    Best,
    /// It is to be made again, as this attempt.
    Again(u32),
}

impl Passing {
    /// A new step begins.
    pub(super) fn begin(&mut self) {
        (self.best, self.last, self.aside) = (None, false, None);
    }

    /// Whether a step under step control is to be made shorter, to end and have its stages elsewhere: see
    /// [`MOST_DETOURS`]; `projects`: whether something holds the ends of steps.
    pub(super) fn goes_on<V>(&mut self, detours: &mut u32, trial: &Trial<V>, projects: bool) -> bool {
        let awkward = trial.noise > 1.0 || projects && trial.error > SURPRISE;
        if !awkward || self.last {
            return false;
        }
        // The longer one has come further, and may have passed the position.
        if trial.error <= 1.0 && self.aside.is_none_or(|(_, least)| PREFERRED * trial.noise < least) {
            self.aside = Some((trial.end.t, trial.noise));
        }
        let goes_on = *detours < MOST_DETOURS;
        *detours += u32::from(goes_on);
        goes_on
    }

    /// Where a step ended that was better than the last one.
    pub(super) fn better<V>(&mut self, trial: &Trial<V>, detours: u32) -> Option<f64> {
        let (end, least) = self.aside.take()?;
        // An end that rounding leaves certain is better than any other; a step that is only too long becomes
        // shorter.
        let uncertain = trial.noise > 1.0 && least <= PREFERRED * trial.noise;
        let given_up = trial.error > 1.0 && detours == MOST_DETOURS;
        let is_better = end != trial.end.t && (uncertain || given_up);
        self.last |= is_better;
        is_better.then_some(end)
    }

    /// Judges an attempt by how much its stages disagree, infinite where it failed; `near` says whether it is
    /// near a position of that kind.
    pub(super) fn judge(&mut self, attempt: u32, found: f64, near: impl FnOnce() -> bool) -> Verdict {
        self.found = found;
        let usual = self.usual > 0.0 && found <= UNUSUAL * self.usual;
        let unknown = self.usual == 0.0 && found.is_finite();
        if usual || unknown || attempt == 0 && self.best.is_none() && !near() {
            return Verdict::Good;
        }
        if self.last {
            return Verdict::Best;
        }
        if self.best.is_none_or(|(_, least)| found < least) {
            self.best = Some((attempt, found));
        }
        if (attempt as usize) < ENDS.len() {
            return Verdict::Again(attempt + 1);
        }
        self.last = true;
        match self.best {
            Some((best, _)) if best != attempt => Verdict::Again(best),
            _ => Verdict::Best,
        }
    }

    pub(super) fn parted(&self) -> (u64, Option<f64>) {
        self.parted
    }

    /// A piece of a step that starts at `t` is made, `whole` or not; `done`: the last piece of it.
    fn count(&mut self, t: f64, whole: bool, done: bool) {
        if self.best.is_some() && !whole && !self.parting {
            self.parted = (self.parted.0 + 1, self.parted.1.or(Some(t)));
            self.parting = true;
        }
        self.parting &= !done;
    }

    /// A step is made. Of shorter ones nothing is learned.
    pub(super) fn made(&mut self, whole: bool) {
        if whole && self.found.is_finite() {
            let found = math::max(self.found, ROUNDING);
            let follows = |usual: f64| found.clamp(usual / FOLLOWS, usual * FOLLOWS);
            self.usual = if self.usual == 0.0 { found } else { follows(self.usual) };
        }
    }
}

impl<V: Vector, S: Scheme<V>> Stepper<V, S> {
    /// By how much a move onto what holds the end of a step has decided the motion, 1: by as much as is
    /// permitted. See the header.
    #[inline(always)]
    pub(super) fn decided<Y: System<V>>(
        &self,
        system: &mut Y,
        moved: &ProjectedEnd,
        ends: (&Phase<V>, &Phase<V>),
        end_t: f64,
    ) -> Result<f64, Y::Error> {
        let violated = moved.violation / MOST_MOVE;
        if Y::IS_FREE || violated <= 1.0 || self.is_fixed() {
            Ok(violated)
        } else {
            self.turned(system, moved, ends, end_t)
        }
    }

    /// The same where it moved far: what was taken back where the step ends, along the direction in which
    /// that would be done where it starts, was no error.
    #[cold]
    fn turned<Y: System<V>>(
        &self,
        system: &mut Y,
        moved: &ProjectedEnd,
        (from, to): (&Phase<V>, &Phase<V>),
        end_t: f64,
    ) -> Result<f64, Y::Error> {
        let (start, tolerances) = (&self.now, &self.options.tolerances);
        let violated = moved.violation / MOST_MOVE;
        let tolerance = math::max(tolerances.absolute, tolerances.relative);
        let end = StepNode { t: end_t, y: *to, a: start.a };
        let rounding = moved.noise > 1.0;
        if !rounding || moved.by * moved.by * tolerance > BENT || !system.is_weak(start, &end) {
            return Ok(violated);
        }
        let moved = zip(from, to, |from, to| from - to);
        let along = system.lasting(start.t, &start.y, &moved)?;
        Ok(along.map_or(violated, |along| math::min(violated, tolerances.norm(&along, &start.y, to))))
    }

    /// Looks at an attempt at a fixed step of what is held: see the header.
    #[inline(always)]
    pub(super) fn passes<Y: System<V>>(
        &mut self,
        system: &mut Y,
        (attempt, h): (u32, f64),
        trial: &Result<Trial<V>, StepRejection<Y::Error>>,
    ) -> Verdict {
        if Y::IS_FREE || self.options.fixed.is_none() || !system.is_held() {
            return Verdict::Good;
        }
        let start = &self.now;
        match trial {
            // Stages of implicit methods lie elsewhere; where they exist they are right.
            Ok(_) if !Self::is_explicit() => Verdict::Good,
            Ok(trial) => self.passing.judge(attempt, trial.apart, || system.is_weak(start, &trial.end)),
            // Elsewhere it is just too long.
            Err(StepRejection::Displaced(_) | StepRejection::Evaluation(_) | StepRejection::NotSolved) => {
                let ahead = |x: f64, u: f64| x + h * u;
                let y = zip(&start.y, &Phase { q: start.y.u, u: start.a }, ahead);
                let end = StepNode { t: start.t + h, y, a: start.a };
                self.passing.judge(attempt, f64::INFINITY, || system.is_weak(start, &end))
            }
            Err(_) => Verdict::Good,
        }
    }

    /// See [`Passing::goes_on`].
    #[inline(always)]
    pub(super) fn goes_on<Y: System<V>>(&mut self, system: &Y, detours: &mut u32, trial: &Trial<V>) -> bool {
        if Y::IS_FREE {
            return false;
        }
        !self.is_fixed() && self.passing.goes_on(detours, trial, system.projects())
    }

    /// See [`Passing::better`].
    #[inline(always)]
    pub(super) fn better<Y: System<V>>(&mut self, trial: &Trial<V>, detours: u32) -> Option<f64> {
        if Y::IS_FREE { None } else { self.passing.better(trial, detours) }
    }

    /// The best that can be made of a step near a position where what holds it nearly loses a direction:
    /// refused where its stages disagree by a part of its way.
    #[cold]
    pub(super) fn left_where_it_is<E>(
        &self,
        trial: Result<Trial<V>, StepRejection<E>>,
        h: f64,
    ) -> Result<Trial<V>, StepRejection<E>> {
        let trial = trial?;
        match self.displaced(
            &zip(&trial.end.y, &self.scheme.disagreement(), |end, apart| end - apart),
            &trial.end.y,
            h,
        ) {
            Some(coordinate) => Err(StepRejection::Displaced(coordinate)),
            None => Ok(trial),
        }
    }

    /// By how much the stages of an attempt disagree, in permitted errors.
    #[inline(always)]
    pub(super) fn apart<Y: System<V>>(&self, system: &Y, error: f64, end: &Phase<V>) -> f64 {
        if S::CONTROL.is_none() && Self::is_explicit() && system.is_held() {
            return self.options.tolerances.norm(&self.scheme.disagreement(), &self.now.y, end);
        }
        error
    }

    /// A step is made. The next one ends where this one was to end, if it was made in parts.
    #[inline(always)]
    pub(super) fn note_passed(&mut self, end_t: f64, h: f64) {
        let Some(fixed) = self.options.fixed else { return };
        let whole = h.abs() >= (1.0 - SLACK) * fixed.abs();
        let there = self.origin.0 + (self.origin.1 + 1) as f64 * fixed.abs().copysign(h);
        let left = (there - end_t) * h.signum();
        let done = left <= SLACK * fixed.abs();
        self.origin.1 += u64::from(done);
        self.passing.count(self.now.t, whole, done);
        self.passing.made(whole);
    }

    /// Where a step of size h that goes round such a position ends, at its so-and-so-many-th attempt.
    #[cold]
    pub(super) fn end_of_detour(&self, (h, attempt): (f64, u32), limit: f64) -> f64 {
        let t = self.now.t;
        let Some(fixed) = self.options.fixed else {
            return t + h * math::powi(DETOUR, attempt as i32);
        };
        let (part, behind) = ENDS[attempt as usize - 1];
        let end = t + part * h + (behind * fixed).copysign(h);
        if (limit - end) * h.signum() < 0.0 { limit } else { end }
    }

    /// The coordinate that projecting moved most, if that was by more than [`MOST_PART`] of a step from here.
    #[cold]
    pub(super) fn displaced(&self, from: &Phase<V>, to: &Phase<V>, h: f64) -> Option<usize> {
        // Parts of a step, however short, have a part in its errors only.
        let h = h.abs().max(self.options.fixed.unwrap_or(0.0).abs());
        let parts = [&from.q, &to.q, &from.u, &to.u, &self.now.y.u];
        displaced(parts.map(|part| part.as_slice()), h)
    }

    /// Whether its stages are states near the solution, each made of those before.
    pub(super) const fn is_explicit() -> bool {
        matches!(
            S::METHOD,
            Method::Rk4 | Method::DormandPrince5 | Method::Tsit5 | Method::Dop853 | Method::Verner9
        )
    }
}

/// See [`Stepper::displaced`]: from and to of positions and of velocities, and the velocities where the step
/// starts.
fn displaced([q, to_q, u, to_u, at_start]: [&[f64]; 5], h: f64) -> Option<usize> {
    let most =
        |values: &mut dyn Iterator<Item = f64>| values.fold(0.0f64, |most, x| math::max(most, x.abs()));
    let far = |from: &[f64], to: &[f64], way: f64| {
        most(&mut to.iter().zip(from).map(|(to, from)| to - from)) > MOST_PART * way
    };
    let speed = 0.5 * (most(&mut at_start.iter().copied()) + most(&mut to_u.iter().copied()));
    let of_q = far(q, to_q, speed * h);
    let (from, to) = if of_q { (q, to_q) } else { (u, to_u) };
    let by = |i: usize| (to[i] - from[i]).abs();
    let most = || (0..from.len()).max_by(|&i, &j| by(i).total_cmp(&by(j))).unwrap_or(0);
    (of_q || far(u, to_u, speed)).then(most)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(steps: &[f64]) -> Passing {
        let mut passing = Passing::default();
        for found in steps {
            passing.begin();
            assert_eq!(passing.judge(0, *found, || panic!("nothing unusual")), Verdict::Good);
            passing.made(true);
        }
        passing.begin();
        passing
    }

    #[test]
    fn steps_that_change_slowly_are_usual() {
        let steps: [f64; 200] = core::array::from_fn(|k| 1e3 + k as f64 * if k < 100 { 300.0 } else { -4.0 });
        after(&steps);
    }

    #[test]
    fn an_unusual_step_is_shortened_until_it_is_usual() {
        let mut passing = after(&[1.0, 2.0, 1.0]);
        assert_eq!(passing.judge(0, 1e3, || true), Verdict::Again(1));
        assert_eq!(passing.judge(1, 2e3, || true), Verdict::Again(2));
        assert_eq!(passing.judge(2, 3.0, || true), Verdict::Good);
        passing.made(false);
        passing.begin();
        // Elsewhere it is left as it is.
        assert_eq!(passing.judge(0, 1e3, || false), Verdict::Good);
    }

    #[test]
    fn steps_in_parts_are_counted_once() {
        let mut passing = after(&[1.0, 1.0]);
        passing.count(1.0, true, true);
        assert_eq!(passing.parted(), (0, None));
        assert_eq!(passing.judge(0, 1e3, || true), Verdict::Again(1));
        [false, true].into_iter().for_each(|done| passing.count(2.0, false, done));
        assert_eq!(passing.parted(), (1, Some(2.0)));
        passing.begin();
        // The last one, which is as short as the motion leaves it.
        passing.count(3.0, false, true);
        assert_eq!(passing.parted(), (1, Some(2.0)));
    }

    #[test]
    fn of_uncertain_ends_the_longest_is_taken_that_is_not_much_worse() {
        let trial = |t: f64, error: f64, noise: f64| {
            let zeros = nalgebra::SVector::<f64, 1>::zeros();
            let at = |t| StepNode { t, y: Phase::zeros(), a: zeros };
            Trial { start: at(0.0), end: at(t), error, apart: error, noise, kept: Default::default() }
        };
        let taken = |tried: &[(f64, f64, f64)]| {
            let (mut passing, mut detours) = (Passing::default(), 0);
            passing.begin();
            for (k, &(t, error, noise)) in tried.iter().enumerate() {
                let on = passing.goes_on(&mut detours, &trial(t, error, noise), true);
                assert_eq!(on, k + 1 < tried.len(), "{k}");
            }
            let (t, error, noise) = tried[tried.len() - 1];
            let better = passing.better(&trial(t, error, noise), detours);
            // What is made again is taken.
            assert!(better.is_none_or(|end| !passing.goes_on(&mut 0, &trial(end, 0.5, 9.0), true)));
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
        // One that is refused is none.
        let mut refused = uncertain(0.1);
        refused[5].1 = 2.0;
        assert_eq!(taken(&refused), 0.9);
    }

    #[test]
    fn where_none_is_usual_the_best_is_made_again() {
        let mut passing = after(&[1.0]);
        let found = [f64::INFINITY, 700.0, 400.0, 500.0, 900.0, 600.0];
        for (k, found) in found.iter().enumerate().take(5) {
            assert_eq!(passing.judge(k as u32, *found, || true), Verdict::Again(k as u32 + 1));
        }
        assert_eq!(passing.judge(5, found[5], || true), Verdict::Again(2));
        assert_eq!(passing.judge(2, found[2], || true), Verdict::Best);
    }
}

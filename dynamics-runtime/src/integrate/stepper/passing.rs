//! How fixed steps go over positions at which what holds them nearly loses a direction.
//!
//! No tolerance judges a fixed step. Where one of its stages happens to lie beside a change point of a mechanism it has the accelerations of no motion: what a stage
//! is off by, which is no matter elsewhere, is amplified by the square of the distance, and the end of the step is thrown along the constraints, by up to percents of its velocity. Φ and
//! Φ̇ show nothing of it, and neither does the next step. The stages themselves do: they disagree by many times what is usual. Such a step is made in
//! parts, so that stages lie elsewhere, and goes on to where it would have ended.

use super::super::tableau::zip;
use super::super::{Knot, Method, Phase, Scheme, System};
use super::{DETOUR, Failure, Stepper, Trial};
use crate::math;
use crate::model::Vector;

/// Where the attempts end after the first: at a part of what is left to the end of the step, or behind that by a part of a step, as the end itself may be the place.
const ENDS: [(f64, f64); 5] = [(1.0, 0.3), (0.8, 0.0), (1.0, 0.15), (0.6, 0.0), (0.4, 0.0)];
/// How many times as much as usual stages disagree where a step is looked at.
const UNUSUAL: f64 = 30.0;
/// What is usual follows the last step by no more than this factor.
const FOLLOWS: f64 = 2.0;
/// Stages that disagree by less, in permitted errors, do so by rounding.
const ROUNDING: f64 = 0.1;

/// The part of the way of a fixed step, in positions or in velocities, by which settling may move its end. No tolerance judges it, and a stage that lies
/// beside a singular position throws it anywhere.
const MOST_PART: f64 = 0.02;
/// Part of a fixed step that it may miss its end by.
const SLACK: f64 = 1e-6;

/// What rounding makes uncertain at the end of a step is no matter below this, in permitted errors: the nearer such a position is the larger it is, on either side.
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
        (self.best, self.last) = (None, false);
    }

    /// Judges an attempt by how much its stages disagree, infinite where it failed; `near` says whether it is near a position of that kind.
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
    /// Looks at an attempt at a fixed step of what is held: see the header.
    #[inline(always)]
    pub(super) fn passes<Y: System<V>>(
        &mut self,
        system: &mut Y,
        (attempt, h): (u32, f64),
        trial: &Result<Trial<V>, Failure<Y::Error>>,
    ) -> Verdict {
        if self.options.fixed.is_none() || !system.is_held() {
            return Verdict::Good;
        }
        let start = &self.now;
        match trial {
            // Stages of implicit methods lie elsewhere; where they exist they are right.
            Ok(_) if !Self::is_explicit() => Verdict::Good,
            Ok(trial) => self.passing.judge(attempt, trial.apart, || system.is_weak(start, &trial.end)),
            // Elsewhere it is just too long.
            Err(Failure::Displaced(_) | Failure::Evaluation(_) | Failure::NotSolved) => {
                let ahead = |x: f64, u: f64| x + h * u;
                let y = zip(&start.y, &Phase { q: start.y.u, u: start.a }, ahead);
                let end = Knot { t: start.t + h, y, a: start.a };
                self.passing.judge(attempt, f64::INFINITY, || system.is_weak(start, &end))
            }
            Err(_) => Verdict::Good,
        }
    }

    /// The best that can be made of a step near a position where what holds it nearly loses a direction: refused where its stages disagree by a part of its way.
    #[cold]
    pub(super) fn left_where_it_is<E>(
        &self,
        trial: Result<Trial<V>, Failure<E>>,
        h: f64,
    ) -> Result<Trial<V>, Failure<E>> {
        let trial = trial?;
        match self.displaced(&zip(&trial.end.y, &self.scheme.disagreement(), |end, apart| end - apart), &trial.end.y, h)
        {
            Some(coordinate) => Err(Failure::Displaced(coordinate)),
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

    /// The coordinate that settling moved most, if that was by more than [`MOST_PART`] of a step from here.
    #[cold]
    pub(super) fn displaced(&self, from: &Phase<V>, to: &Phase<V>, h: f64) -> Option<usize> {
        let size = |v: &V| v.as_slice().iter().fold(0.0f64, |most, x| math::max(most, x.abs()));
        let moved = zip(to, from, |to, from| to - from);
        let speed = 0.5 * (size(&self.now.y.u) + size(&to.u));
        // Parts of a step, however short, have a part in its errors only.
        let h = h.abs().max(self.options.fixed.unwrap_or(0.0).abs());
        let far = |moved: &V, way: f64| size(moved) > MOST_PART * way;
        let by = if far(&moved.q, speed * h) { moved.q } else { moved.u };
        let most = || (0..V::LEN).max_by(|&i, &j| by[i].abs().total_cmp(&by[j].abs())).unwrap_or(0);
        (far(&moved.q, speed * h) || far(&moved.u, speed)).then(most)
    }

    /// Whether its stages are states near the solution, each made of those before.
    pub(super) const fn is_explicit() -> bool {
        matches!(S::METHOD, Method::Rk4 | Method::DormandPrince5 | Method::Tsit5 | Method::Dop853 | Method::Verner9)
    }
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

//! How branches meet, from the change of the parameter a little way along each of them.
//!
//! ```text
//! p − p* = A h + B h² + C h³ + …        h along the direction of a branch, to both sides
//! ```
//!
//! A branch with A ≠ 0 passes the point; one with A = 0 and B ≠ 0 turns round there, as the arms of a
//! pitchfork do (M. Golubitsky & D. G. Schaeffer, *Singularities and Groups in Bifurcation Theory* I, chapter
//! II). At a single distance a small A is hidden by B, and C looks like A. Half the difference of both sides,
//! A h + C h³, separates them: from h to h/4 it falls to a quarter, or to a 64th.

use alloc::boxed::Box;

use dynamics_runtime::model::{Constraints, Powers};

use super::branch::SpecialKind;
use super::problem::{Balance, Direction};
use super::trace::{Sample, Tracer};

/// How far branches are followed from where they meet, at first, and by what part of that then.
const ASIDE: f64 = 1e-2;
const CLOSER: f64 = 0.25;
const TIMES: usize = 14;
/// How far where the parameter does not move at all.
const FARTHER: [f64; 5] = [0.1, 1.0, 10.0, 100.0, 1000.0];
/// Changes of the parameter below this part of its range and size are rounding.
const NEUTRAL: f64 = 1e-12;
/// A difference of both sides below this part of their mean may come from where the point itself was found.
const LOPSIDED: f64 = 1e-6;
/// What falls by less than this to a quarter of the distance falls with the distance, not with its third
/// power.
const LINEAR: f64 = 8.0;

/// What the parameter does along a branch beside a point of it.
enum Course<M: Constraints> {
    /// It passes the point: the change of the parameter per length.
    Passes(f64),
    /// It turns round: the side on which the branch lies.
    Turns(Box<Sample<M>>),
    /// It stays as it is, or could not be followed.
    Unknown,
}

impl<M: Constraints + Powers> Tracer<'_, M> {
    /// How two branches meet, of which these are the directions.
    pub(super) fn tell(&self, balance: &Balance<M>, ways: &[Direction; 2]) -> SpecialKind {
        let [own, other] = ways;
        let (bent, slope, straight) = match (self.course(balance, other), self.course(balance, own)) {
            (Course::Passes(_), Course::Passes(_)) => return SpecialKind::Transcritical,
            (Course::Turns(bent), Course::Passes(slope)) => (bent, slope, own),
            (Course::Passes(slope), Course::Turns(bent)) => (bent, slope, other),
            _ => return SpecialKind::BranchPoint,
        };
        // Compared at the same value of the parameter: a little farther on the straight one may have changed
        // once more.
        let h = (bent.place().p[0] - balance.place.p[0]) / slope;
        match self.arm(balance, &straight.scaled(h.signum()), h.abs()) {
            Some(beside) => {
                SpecialKind::Pitchfork { supercritical: bent.watch.negative() < beside.watch.negative() }
            }
            None => SpecialKind::BranchPoint,
        }
    }

    fn course(&self, balance: &Balance<M>, way: &Direction) -> Course<M> {
        let star = balance.place.p[0];
        let noise = NEUTRAL * (self.problem.widths[0] + star.abs());
        let sides = |h: f64| {
            let [plus, minus] = [1.0, -1.0].map(|sign| self.arm(balance, &way.scaled(sign), h));
            let places = [plus?, minus?];
            let gone = [&places[0], &places[1]].map(|sample| sample.place().p[0] - star);
            Some((places, 0.5 * (gone[0] + gone[1]), 0.5 * (gone[0] - gone[1])))
        };
        let (mut turned, mut before): (Option<Sample<M>>, Option<f64>) = (None, None);
        for h in aside() {
            let Some((places, mean, apart)) = sides(h) else {
                (turned, before) = (None, None);
                continue;
            };
            let is_level = apart.abs() <= noise + LOPSIDED * mean.abs();
            if !is_level && before.is_some_and(|before| (before / apart).abs() < LINEAR) {
                return Course::Passes(apart / h);
            }
            if mean.abs() > noise.max(apart.abs()) && turned.is_none() {
                let [plus, _] = places;
                turned = Some(plus);
            }
            match turned {
                Some(place) if is_level => return Course::Turns(Box::new(place)),
                None if is_level => break,
                _ => before = Some(apart),
            }
        }
        if turned.is_some() || before.is_some() {
            return Course::Unknown;
        }
        let mut far = FARTHER.into_iter().filter_map(|h| Some((h, sides(h)?)));
        match far.find(|(_, (_, mean, apart))| mean.abs().max(apart.abs()) > noise) {
            Some((h, (_, mean, apart))) if apart.abs() > mean.abs() => Course::Passes(apart / h),
            Some((_, ([plus, _], mean, apart))) if apart.abs() <= noise + LOPSIDED * mean.abs() => {
                Course::Turns(Box::new(plus))
            }
            _ => Course::Unknown,
        }
    }

    /// A place of another branch, a little way from where it meets this one.
    pub(super) fn arm(&self, balance: &Balance<M>, way: &Direction, h: f64) -> Option<Sample<M>> {
        let guess = self.problem.moved(&balance.place, &way.scaled(h));
        let coordinates = &balance.statics.tangent.coordinates;
        let arrived = self.problem.solve(&guess, coordinates, Some((way, &guess)), None, 3.0 * h).ok()?;
        self.sample(arrived.balance, way).ok()
    }
}

/// Distances at which branches are looked for from where they meet.
pub(super) fn aside() -> impl Iterator<Item = f64> {
    core::iter::successors(Some(ASIDE), |h| Some(h * CLOSER)).take(TIMES)
}

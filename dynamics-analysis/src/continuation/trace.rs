//! Steps along a branch.
//!
//! A step goes along the tangent and returns to the branch in the plane normal to it (Keller's
//! pseudo-arclength; the plane of one value of the parameter under load control). Its length follows the
//! angle between tangents and the corrections that it took (E. L. Allgower & K. Georg, *Introduction to
//! Numerical Continuation Methods*, chapter 6); it is cut where the tangent turns too far, so that the branch
//! is not left for another one nearby. The middle of each step is computed, too, and the point at which a
//! stiffness or the slope of the parameter seems to have its minimum. A quantity that passes zero and comes
//! back within a step is detected there.

use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec::Vec;
use core::f64::consts::TAU;

use dynamics_runtime::model::{Constraints, ModelState, Powers, Vector};
use dynamics_runtime::progress::Progress;

use super::branch::{Branch, BranchEnd, BranchPoint, Special};
use super::error::ContinuationError;
use super::newton::{Missed, Singular};
use super::problem::{Balance, ContinuationPoint, ContinuationProblem, Direction};
use super::watch::Watch;
use crate::equilibria::{EquilibriumError, judge};

/// The desired angle between tangents, and the largest that is accepted, in rad.
const AIM: f64 = 0.12;
const TURN: f64 = 0.35;

/// Longer steps are rejected if a quantity passes zero in them that is neither a fold nor a branch point.
const UNSOUND: f64 = 1e-6;
/// After this many consecutive steps shorter than this, the branch is given up.
const CREEP: f64 = 1e-7;
const CREPT: usize = 40;

/// Load control ends at a fold that is nearer than this.
const NEAR_LIMIT: f64 = 1e-2;
/// The middle of a step may deviate from the cubic through its ends by this part of the step.
const CUBIC_DEVIATION: f64 = 0.01;
/// A branch has returned to its first point within this distance.
const CLOSED: f64 = 1e-6;

/// How a branch is followed.
#[derive(Clone, Debug)]
pub(super) struct ContinuationOptions {
    pub(super) name: String,
    pub(super) range: [f64; 2],
    pub(super) first: f64,
    pub(super) longest: f64,
    pub(super) shortest: f64,
    pub(super) points: usize,
    pub(super) load_control: bool,
    #[cfg(feature = "progress")]
    pub(super) progress: bool,
}

/// A point on a branch with its properties.
pub(super) struct Sample<M: Constraints> {
    pub(super) balance: Balance<M>,
    pub(super) tangent: Direction,
    pub(super) watch: Watch,
}

impl<M: Constraints> Sample<M> {
    pub(super) fn place(&self) -> &ContinuationPoint<M::State> {
        &self.balance.place
    }

    pub(super) fn coordinates(&self) -> &[usize] {
        &self.balance.statics.tangent.coordinates
    }
}

/// What follows one branch.
pub(super) struct Tracer<'t, M: Constraints> {
    pub(super) problem: &'t ContinuationProblem<'t, M>,
    pub(super) options: &'t ContinuationOptions,
    pub(super) periodic: &'t [bool],
    pub(super) points: Vec<BranchPoint<M::State>>,
    pub(super) special: Vec<Special<M::State>>,
    rejected: usize,
    unsure: f64,
    progress: Progress,
}

/// How a step ended.
enum StepOutcome<M: Constraints> {
    Taken(Box<Sample<M>>, Box<Sample<M>>, f64),
    /// At an end of the range.
    Last(Box<Sample<M>>, Box<Sample<M>>),
}

impl<'t, M: Constraints + Powers> Tracer<'t, M> {
    pub(super) fn new(
        problem: &'t ContinuationProblem<'t, M>,
        options: &'t ContinuationOptions,
        periodic: &'t [bool],
    ) -> Self {
        #[cfg(feature = "progress")]
        let progress = if options.progress {
            Progress::of("points", 0.0, options.points as f64)
        } else {
            Progress::none()
        };
        #[cfg(not(feature = "progress"))]
        let progress = Progress::none();
        let (points, special) = (Vec::new(), Vec::new());
        Self { problem, options, periodic, points, special, rejected: 0, unsure: 0.0, progress }
    }

    /// A point in balance, with the direction in which its branch continues.
    pub(super) fn sample(&self, balance: Balance<M>, along: &Direction) -> Result<Sample<M>, Missed> {
        let tangent = self.problem.tangent(&balance, along, None).ok_or(Missed::Far)?;
        let watch = Watch::of(self.problem, &balance, &tangent).map_err(Missed::Model)?;
        Ok(Sample { balance, tangent, watch })
    }

    /// The point on the branch in the plane normal to the tangent of a sample, at this distance along it, no
    /// farther from there than `reach`.
    pub(super) fn beside(&self, from: &Sample<M>, s: f64, reach: f64) -> Result<(Sample<M>, usize), Missed> {
        let guess = self.problem.moved(from.place(), &from.tangent.scaled(s));
        let plane = Some((&from.tangent, &guess));
        let arrived = self.problem.solve(&guess, from.coordinates(), plane, None, reach)?;
        Ok((self.sample(arrived.balance, &from.tangent)?, arrived.iterations))
    }

    /// As [`Tracer::beside`], at the value of the parameter that the tangent has there.
    fn at_parameter(&self, from: &Sample<M>, s: f64, reach: f64) -> Result<(Sample<M>, usize), Missed> {
        let guess = self.problem.moved(from.place(), &from.tangent.scaled(s));
        let normal = Direction { q: &from.tangent.q * 0.0, p: [1.0, 0.0] };
        let arrived = self.problem.solve(&guess, from.coordinates(), Some((&normal, &guess)), None, reach)?;
        Ok((self.sample(arrived.balance, &from.tangent)?, arrived.iterations))
    }

    /// Starts at a point in balance along a direction; `branching` if branches meet at this point.
    pub(super) fn run(
        mut self,
        first: Sample<M>,
        branching: bool,
    ) -> Result<Branch<M::State>, ContinuationError<M::State>> {
        let (mut here, mut h) = (first, self.options.first.min(self.options.longest));
        let (origin, direction) = (*here.place(), here.tangent.clone());
        self.push(&here, 0.0);
        if !branching {
            self.begin_in_fold(&here);
        }
        let (mut missed, mut crept) = (Missed::Far, 0);
        while self.points.len() < self.options.points {
            self.progress.at(self.points.len() as f64);
            let leaving = branching && self.points.len() == 1;
            let step = match self.step(&here, h, leaving) {
                Ok(step) => step,
                Err(why) => {
                    self.rejected += 1;
                    missed = if let Missed::Model(_) = why { why } else { missed };
                    h *= 0.5;
                    if h < self.options.shortest {
                        return Err(self.ended(&here, h, missed));
                    }
                    continue;
                }
            };
            if h > CREEP {
                (missed, crept) = (Missed::Far, 0);
            } else {
                crept += 1;
                if crept > CREPT {
                    return Err(self.ended(&here, h, missed));
                }
            }
            let (middle, next, after, last) = match step {
                StepOutcome::Taken(middle, next, after) => (middle, next, after, false),
                StepOutcome::Last(middle, next) => (middle, next, h, true),
            };
            let known = self.special.len();
            let sound = leaving || self.inspect_step(&here, &middle, &next);
            if !sound && h > UNSOUND {
                // Shorter steps follow the turn that this one cut.
                self.special.truncate(known);
                (self.rejected, h) = (self.rejected + 1, 0.5 * h);
                continue;
            }
            let gone = self.problem.distance(here.place(), middle.place())
                + self.problem.distance(middle.place(), next.place());
            if !last && self.closes(&origin, &direction, &here, &next) {
                self.close(here.place());
                return self.timeless(BranchEnd::Closed);
            }
            self.push(&next, gone);
            if !leaving {
                self.inspect_flutter(&here, &next);
            }
            (here, h) = (*next, after.min(self.options.longest));
            if last {
                return self.timeless(BranchEnd::Range);
            }
        }
        self.timeless(BranchEnd::Points)
    }

    /// One step of length h, or up to the end of the range.
    fn step(&self, here: &Sample<M>, h: f64, leaving: bool) -> Result<StepOutcome<M>, Missed> {
        let [lo, hi] = self.options.range;
        let p = |sample: &Sample<M>| sample.place().p[0];
        let slope = here.tangent.p[0];
        let bound = if slope > 0.0 { hi } else { lo };
        // How far it is to the end of the range along the tangent.
        let left = if slope == 0.0 { f64::INFINITY } else { (bound - p(here)) / slope };
        let (mut s, mut last) = if left <= h { (left.max(0.0), true) } else { (h, false) };
        let mut found = None;
        if !last {
            let reach = if leaving { 3.0 * s } else { 0.5 * s };
            let (next, iterations) = match self.options.load_control {
                true => self.at_parameter(here, s, reach)?,
                false => self.beside(here, s, reach)?,
            };
            if (lo..=hi).contains(&p(&next)) {
                found = Some((next, iterations));
            } else {
                // It bends out of the range within the step.
                (s, last) = (s * ((bound - p(here)) / (p(&next) - p(here))).clamp(0.0, 1.0), true);
            }
        }
        let (mut next, iterations) = match found {
            Some(found) => found,
            None => self.to_bound(here, s, bound, 0.5 * h)?,
        };
        if last {
            next.balance.place.p[0] = bound;
        }
        let middle =
            self.beside(here, 0.5 * self.ahead(here, &next), if leaving { 3.0 * s } else { 0.5 * s })?.0;
        let cosine = self.problem.dot(&here.tangent, &next.tangent).clamp(-1.0, 1.0);
        let angle = cosine.acos();
        if !leaving && (angle > TURN || self.leaps(here, &middle, &next)) {
            return Err(Missed::Far);
        }
        // Shorter steps then go up to where that begins.
        next.balance.check_time(false).map_err(Missed::Model)?;
        if last {
            return Ok(StepOutcome::Last(Box::new(middle), Box::new(next)));
        }
        let by_angle = if angle > 0.0 { (AIM / angle).clamp(0.5, 2.0) } else { 2.0 };
        let by_effort = if iterations > 6 { 0.5 } else { 2.0 };
        let after = if leaving { h } else { h * by_angle.min(by_effort) };
        Ok(StepOutcome::Taken(Box::new(middle), Box::new(next), after))
    }

    /// Whether the middle of a step deviates from the cubic through its ends (Hermite): the step then leads
    /// to another branch, or cuts a bend.
    fn leaps(&self, here: &Sample<M>, middle: &Sample<M>, next: &Sample<M>) -> bool {
        let length = self.problem.distance(here.place(), next.place());
        let chord = self.problem.between(here.place(), next.place());
        let to = self.problem.between(here.place(), middle.place());
        let (a, b) = (&here.tangent, &next.tangent);
        let cubic = |c: f64, a: f64, b: f64| 0.5 * c + 0.125 * length * (a - b);
        let off = Direction {
            q: &to.q - &chord.q * 0.5 - (&a.q - &b.q) * (0.125 * length),
            p: [to.p[0] - cubic(chord.p[0], a.p[0], b.p[0]), 0.0],
        };
        // The middle is one along the tangent at the beginning, and so may stand a little before or after
        // that of the cubic.
        let along = self.problem.dot(&off, &middle.tangent);
        (self.problem.dot(&off, &off) - along * along).max(0.0).sqrt() > CUBIC_DEVIATION * length
    }

    /// The point at the end of the range, about this distance along the tangent.
    fn to_bound(
        &self,
        here: &Sample<M>,
        s: f64,
        bound: f64,
        reach: f64,
    ) -> Result<(Sample<M>, usize), Missed> {
        let mut guess = self.problem.moved(here.place(), &here.tangent.scaled(s));
        guess.p[0] = bound;
        let normal = Direction { q: &here.tangent.q * 0.0, p: [1.0, 0.0] };
        let arrived = self.problem.solve(&guess, here.coordinates(), Some((&normal, &guess)), None, reach)?;
        Ok((self.sample(arrived.balance, &here.tangent)?, arrived.iterations))
    }

    /// How far a place is ahead along the tangent of another.
    pub(super) fn ahead(&self, from: &Sample<M>, to: &Sample<M>) -> f64 {
        self.problem.dot(&from.tangent, &self.problem.between(from.place(), to.place()))
    }

    /// Whether the step passes the first point, in its direction; angles on which the model depends with
    /// period 2π count by what is left of turns.
    fn closes(
        &self,
        origin: &ContinuationPoint<M::State>,
        direction: &Direction,
        here: &Sample<M>,
        next: &Sample<M>,
    ) -> bool {
        if self.points.len() < 4 || self.problem.dot(direction, &next.tangent) < 0.5 {
            return false;
        }
        let gone = |to: &Sample<M>| {
            let mut by = self.problem.between(origin, to.place());
            for (q, _) in by.q.iter_mut().zip(self.periodic).filter(|(_, periodic)| **periodic) {
                *q -= TAU * (*q / TAU).round();
            }
            by
        };
        let (before, after) = (gone(here), gone(next));
        let (a, b) = (self.problem.dot(direction, &before), self.problem.dot(direction, &after));
        let length = self.problem.distance(here.place(), next.place());
        if !(a < 0.0 && b >= 0.0) || self.problem.norm(&after) > 2.0 * length {
            return false;
        }
        // Where the chord passes it: a step bends less than this away from its chord.
        let part = -a / (b - a);
        let mix = |x: [f64; 2], k: usize| (1.0 - part) * x[0] + part * if k == 0 { x[1] } else { 0.0 };
        let q = &before.q * (1.0 - part) + &after.q * part;
        let p = [mix([before.p[0], after.p[0]], 0), 0.0];
        if self.problem.norm(&Direction { q, p }) > 0.1 * length {
            return false;
        }
        // What only passes near it is another piece of the branch.
        let Ok((there, _)) = self.beside(here, part * self.ahead(here, next), 0.5 * length) else {
            return false;
        };
        let back = there.tangent.scaled(-self.problem.dot(&there.tangent, &gone(&there)));
        let left = gone(&there);
        let missed = Direction { q: &left.q + &back.q, p: [left.p[0] + back.p[0], 0.0] };
        let along = self.problem.norm(&back);
        // To first order the rest is along the branch, to second order it bends away from its tangent.
        self.problem.norm(&missed) <= CLOSED + along * along / length
    }

    /// Ends with the first point once more.
    fn close(&mut self, here: &ContinuationPoint<M::State>) {
        let [first, .., last] = &self.points[..] else { return };
        let first = first.clone();
        let there = ContinuationPoint { state: first.state, p: [first.parameter, 0.0] };
        let mut by = self.problem.between(here, &there);
        by.q.iter_mut()
            .zip(self.periodic)
            .filter(|(_, p)| **p)
            .for_each(|(q, _)| *q -= TAU * (*q / TAU).round());
        let arclength = last.arclength + self.problem.norm(&by);
        let state = self.problem.moved(here, &by).state;
        self.points.push(BranchPoint { arclength, state, ..first });
    }

    pub(super) fn push(&mut self, sample: &Sample<M>, gone: f64) {
        let arclength = self.points.last().map_or(0.0, |last| last.arclength) + gone;
        let (place, model) = (sample.place(), &sample.balance.model);
        self.unsure = self.unsure.max(sample.balance.unsure);
        let stability = judge(model, &place.state);
        self.points.push(BranchPoint { parameter: place.p[0], state: place.state, arclength, stability });
    }

    /// The length of the branch up to a place beside its last point.
    pub(super) fn arclength(&self, place: &ContinuationPoint<M::State>) -> f64 {
        self.points.last().map_or(0.0, |last| {
            last.arclength
                + self.problem.distance(
                    &ContinuationPoint { state: last.state, p: [last.parameter, place.p[1]] },
                    place,
                )
        })
    }

    fn finish(self, end: BranchEnd) -> Branch<M::State> {
        let mut special = self.special;
        special.sort_by(|a, b| a.arclength.total_cmp(&b.arclength));
        Branch {
            points: self.points,
            special,
            end,
            parameter: self.options.name.clone(),
            coordinates: M::COORDINATES,
            rejected: self.rejected,
            derivative_error: self.unsure,
        }
    }

    /// The branch, if nothing on it changes with time. Its last point and its special points are checked like
    /// the start. If this finds a change, all points are checked.
    fn timeless(self, end: BranchEnd) -> Result<Branch<M::State>, ContinuationError<M::State>> {
        match self.changing() {
            None => Ok(self.finish(end)),
            Some((known, reason)) => Err(self.ends_in_time(known, reason)),
        }
    }

    /// The number of points before forces change with time, and the reason.
    fn changing(&self) -> Option<(usize, EquilibriumError)> {
        let at = |state: M::State, parameter: f64| {
            let found = self.problem.check_times(&ContinuationPoint { state, p: [parameter, 0.0] });
            found.err().filter(EquilibriumError::is_of_time)
        };
        let last = self.points.last().and_then(|point| at(point.state, point.parameter));
        let special =
            || self.special.iter().find_map(|one| Some((one.arclength, at(one.state, one.parameter)?)));
        let (arclength, reason) = last.map(|reason| (f64::INFINITY, reason)).or_else(special)?;
        let first =
            self.points.iter().enumerate().find_map(|(k, one)| Some((k, at(one.state, one.parameter)?)));
        let before = self.points.iter().filter(|point| point.arclength <= arclength).count();
        Some(first.filter(|(k, _)| *k <= before).unwrap_or((before, reason)))
    }

    /// Ends after this number of points, because forces change with time beyond.
    pub(super) fn ends_in_time(
        mut self,
        known: usize,
        reason: EquilibriumError,
    ) -> ContinuationError<M::State> {
        self.points.truncate(known);
        let Some(last) = self.points.last() else { return ContinuationError::Start(reason) };
        let (parameter, arclength) = (last.parameter, last.arclength);
        self.special.retain(|one| one.arclength <= arclength);
        ContinuationError::Model { parameter, reason, branch: Box::new(self.finish(BranchEnd::Points)) }
    }

    /// Why no step can be taken.
    fn ended(self, here: &Sample<M>, step: f64, missed: Missed) -> ContinuationError<M::State> {
        let parameter = here.place().p[0];
        let missed = match (missed, self.changing()) {
            (Missed::Model(reason), None) if reason.is_of_time() => {
                let known = self.points.len();
                return self.ends_in_time(known, reason);
            }
            (_, Some((known, reason))) => return self.ends_in_time(known, reason),
            (missed, None) => missed,
        };
        if self.options.load_control
            && let Some((limit, at)) = self.limit(here)
        {
            let (name, branch) = (self.options.name.clone(), self.finish(BranchEnd::Points));
            return ContinuationError::LimitLoad {
                parameter: name,
                limit,
                at: Box::new(at),
                branch: Box::new(branch),
            };
        }
        let beyond = self.problem.moved(here.place(), &here.tangent.scaled(1e-4));
        let missed = self.problem.balance(&beyond, here.coordinates()).err().map_or(missed, Missed::Model);
        let branch = Box::new(self.finish(BranchEnd::Points));
        match missed {
            Missed::Model(reason) => ContinuationError::Model { parameter, reason, branch },
            Missed::Far => ContinuationError::Stuck { parameter, step, branch },
        }
    }

    /// The fold just ahead.
    fn limit(&self, here: &Sample<M>) -> Option<(f64, M::State)> {
        let singular = Singular::beside(&here.balance, false, None)?;
        let found =
            self.problem.solve(here.place(), here.coordinates(), None, Some(&singular), NEAR_LIMIT).ok()?;
        let place = found.balance.place;
        Some((place.p[0], place.state))
    }
}

/// Zero except in the coordinates of a direction, whose largest element is 1.
pub(super) fn shape<V: Vector>(of: &Direction) -> V {
    let mut out = V::zeros();
    let most = of.q.amax();
    let first = of.q.iter().find(|x| x.abs() >= 0.999_999 * most).copied().unwrap_or(1.0);
    if most > 0.0 {
        out.as_mut_slice().iter_mut().zip(of.q.iter()).for_each(|(x, q)| *x = q / first + 0.0);
    }
    out
}

/// The start of a branch: a state in balance.
pub(super) fn check_near<S: ModelState>(
    start: &S,
    found: &S,
    scales: &[f64],
    uncertainty: &[f64],
    names: &'static [dynamics_runtime::model::Quantity],
) -> Result<(), ContinuationError<S>> {
    let off = |i: usize| (start.q().as_slice()[i] - found.q().as_slice()[i]).abs();
    let worst = (0..scales.len()).max_by(|i, j| (off(*i) / scales[*i]).total_cmp(&(off(*j) / scales[*j])));
    match worst {
        Some(i) if off(i) > 1e-6 * scales[i] + 10.0 * uncertainty[i] => {
            Err(ContinuationError::NotInBalance { coordinate: names[i].name, off: off(i), nearest: *found })
        }
        _ => Ok(()),
    }
}

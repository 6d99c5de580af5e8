//! Whether a motion has gone on along its own branch where branches of a constraint touch.
//!
//! The gradient of a constraint of one row vanishes where branches of it meet, and so does, of several rows,
//! that of the combination that loses rank there ([`degenerate_rows`]). Where they cross, Φ ≈ ½ ξᵀHξ with Hτ
//! ≠ 0 along the motion's direction τ: gradients vanish with the first power of the distance, and velocities
//! tell the branches apart. Where they touch, Hτ = 0, as with y² = x⁴, y² = x⁶: gradients vanish with a
//! higher power, branches are apart by as much, and steps that come near go on along any of them, with every
//! digit of energy and constraints. Rows are scaled to unit length wherever rank is asked for, so
//! conditioning says nothing of it.
//!
//! What is different is that a motion is smooth and one that changes branches is not. From states before the
//! place, a distance D away and more, a polynomial through q and q̇ (Hermite, of degree 7, and one of degree
//! 5, to judge the first by) is continued to a distance D behind it. Between neighbouring branches Φ changes
//! its sign there and ∂Φ/∂q with it, from g to −g: where the gradients at both ends of the polynomials agree
//! to a quarter of their length it is decided on which branch the motion belongs, and where that at the state
//! reached differs by more than half of it, it is on another one. Distances are taken as they come, from the
//! smallest at which that is decided; until the place is left behind. Where none decides nothing is known,
//! and a motion ends there, too.
//!
//! Source: M. Golubitsky & D. G. Schaeffer, Singularities and Groups in Bifurcation Theory I, Springer 1985,
//! ch. II (contact of branches, x^k: A₁ crossing, A₃ tacnode, A₅ …).

pub(crate) mod degenerate_rows;
pub(crate) mod path;

use alloc::collections::VecDeque;
use alloc::vec::Vec;

use crate::constrain::TopContributors;
use crate::integrate::{Dense, Hermite, Method, StepNode};
use crate::linalg::norm;
use crate::math;
use crate::model::{Constraints, Known, ModelState, SimulationModel, Vector};
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::simulate::right_hand_side::RightHandSide;
use crate::simulate::run::monitor::{Advice, Monitor, Retreat, Watched};
use crate::simulate::run::monitors::branch_identification::degenerate_rows::{
    DegenerateRowSet, DegenerateRows, Lengths, rows_of,
};
use crate::simulate::run::monitors::branch_identification::path::BranchPath;

/// Part of the largest gradient met below which its row may be about to vanish on the way between steps.
const VANISHES: f64 = 1e-3;
/// Relative rise of a gradient on one side of a place where it is least, at least: others are rounding.
const RISES: f64 = 1e-2;
/// Power of the distance with which a gradient vanishes, from which on branches touch.
const TOUCH: f64 = 1.4;
/// The same from which on it vanishes at all, as far as can be told at a distance.
const VANISHING: f64 = 0.6;
/// Part of the longest gradient of a combination of rows above which it is not asked where it is least
/// between states.
const MAY_VANISH: f64 = 0.1;
/// Most states that are kept.
const MOST: usize = 128;
/// Distance at which it is tried first, in usual steps: the polynomial reaches over as much as one of them.
const SPAN: f64 = 0.25;
/// Parts of the longest gradient: up to the first it is tried at any distance, whatever steps are; below the
/// second rounding counts, above the last the place is left behind.
const SMALL: f64 = 1e-2;
/// See [`SMALL`].
const LEAST: f64 = 1e-5;
/// See [`SMALL`].
const LARGE: f64 = 0.1;
/// Usual steps behind the place from which on it is tried.
const FIRST: f64 = 0.05;
/// Halvings of the distance at which it is tried to decide.
const HALVINGS: u32 = 8;
/// Usual steps behind the place up to which it is tried.
const FAR: f64 = 4.0;
/// How much farther on it is tried again.
const NEXT: f64 = 1.4;
/// Places at which gradients are looked at between the ends of a step.
const PLACES: usize = 8;
/// Bisections of the golden section between two of them.
const SECTIONS: usize = 30;
/// Part of the longest step within which a place is that of the start.
const BEGINS: f64 = 1e-3;
/// Part of its gradient and of its speed below which a motion has come to rest in such a place.
const RESTS: (f64, f64) = (1e-6, 1e-2);

/// Branches of a constraint that touch on the way of a motion.
struct BranchContact<V> {
    rows: TopContributors,
    /// When.
    at: f64,
    /// It is known that the motion has gone over to another branch; else it could not be decided.
    changed: bool,
    /// The last state before.
    before: StepNode<V>,
}

/// A place where the gradient of a row vanishes, behind which it is not decided yet on which branch the
/// motion is.
#[derive(Clone, Copy)]
struct Pending {
    degenerate: DegenerateRows,
    at: f64,
    /// The distance from which on it is tried next.
    next: f64,
    /// How far behind it the gradient was still small.
    small: f64,
}

/// A state that was reached, with the lengths of the gradients there.
struct Seen<M: Constraints> {
    knot: StepNode<M::Vector>,
    lengths: Lengths<M::Rows>,
}

/// Follows the gradients of constraints along a run.
pub(crate) struct BranchIdentification<M: Constraints> {
    degenerates: DegenerateRowSet<M>,
    seen: VecDeque<Seen<M>>,
    /// The longest gradients and the largest speed met.
    most: (Lengths<M::Rows>, f64),
    /// The longest step.
    longest: f64,
    pending: Option<Pending>,
}

impl<M: SimulationModel> Monitor<M> for BranchIdentification<M> {
    fn begin(run: &mut Watched<'_, '_, '_, M>, _: Method) -> Self {
        let start = run.now();
        Self::from(&mut run.plan.rhs, &start)
    }

    #[inline(always)]
    fn after_step(
        &mut self,
        run: &mut Watched<'_, '_, '_, M>,
        ends: bool,
    ) -> Result<Advice, Retreat<M::Vector>> {
        if M::IS_FREE || self.is_idle() {
            return Ok(Advice::Continue);
        }
        match self.reached(&mut run.plan.rhs, run.stepper.now(), ends) {
            None => Ok(Advice::Continue),
            Some(BranchContact { rows, at, changed, before }) => {
                Err(Retreat { kind: Kind::BranchesTouch { rows, at, changed }, to: before })
            }
        }
    }

    /// What was before says nothing of another state.
    fn restart(&mut self) {
        self.seen.clear();
        self.pending = None;
    }
}

impl<M: Constraints> BranchIdentification<M> {
    /// Of a run that starts at a state.
    fn from(rhs: &mut RightHandSide<'_, '_, M>, start: &M::State) -> Self {
        let mut degenerates = DegenerateRowSet::none();
        if M::IS_FREE {
            // Nothing to follow, and nothing of it compiled.
        } else if rhs.stabilization.projects() {
            degenerates.workspace = rhs.stabilization.lend();
            degenerates.follow(rhs.model, start);
            rhs.stabilization.take_back(core::mem::take(&mut degenerates.workspace));
        }
        let seen = VecDeque::with_capacity(if degenerates.all.is_empty() { 0 } else { MOST + 1 });
        Self { degenerates, seen, most: (Lengths::zeros(), 0.0), longest: 0.0, pending: None }
    }

    /// Whether there is nothing to follow: no constraint, or one that may drift.
    fn is_idle(&self) -> bool {
        self.degenerates.all.is_empty()
    }

    /// A step has ended here, the `last` of the motion or before it jumps. What touches, where the motion is
    /// known not to go on along its branch, or where it cannot be known.
    fn reached(
        &mut self,
        rhs: &mut RightHandSide<'_, '_, M>,
        now: &StepNode<M::Vector>,
        last: bool,
    ) -> Option<BranchContact<M::Vector>> {
        self.degenerates.workspace = rhs.stabilization.lend();
        let found = self.look(rhs, now, last);
        rhs.stabilization.take_back(core::mem::take(&mut self.degenerates.workspace));
        found
    }

    fn look(
        &mut self,
        rhs: &RightHandSide<'_, '_, M>,
        now: &StepNode<M::Vector>,
        last: bool,
    ) -> Option<BranchContact<M::Vector>> {
        self.add(rhs, now);
        if self.pending.is_none() {
            self.suspect(rhs, last);
        }
        let pending = self.pending.as_mut()?;
        let gone = (now.t - pending.at).abs();
        let part = self.seen[self.seen.len() - 1].lengths.of(pending.degenerate)
            / self.most.0.of(pending.degenerate);
        if part <= SMALL {
            pending.small = math::max(pending.small, gone);
        }
        let pending = *pending;
        let rests = self.rests(rhs, &pending);
        if gone < pending.next && !last && !rests {
            return None;
        }
        let Pending { degenerate, at, .. } = pending;
        let before = self.before(at);
        let touch = |changed| {
            let state = rhs.state(before.t, &before.y.q, &before.y.u);
            BranchContact { rows: rows_of(rhs.model, &state, degenerate), at, changed, before }
        };
        match self.decide(rhs, &pending) {
            Some(true) => {
                self.pending = None;
                None
            }
            Some(false) => Some(touch(true)),
            None if rests || last && gone > 0.0 || part > LARGE && gone > FAR * self.longest => {
                Some(touch(false))
            }
            None => {
                self.pending = Some(Pending { next: NEXT * gone, ..pending });
                None
            }
        }
    }

    fn add(&mut self, rhs: &RightHandSide<'_, '_, M>, now: &StepNode<M::Vector>) {
        let state = rhs.state(now.t, &now.y.q, &now.y.u);
        let lengths = self.degenerates.lengths(rhs.model, rhs.constants, &state);
        self.most.0.at_least(&lengths);
        self.most.1 = math::max(self.most.1, self.length(&now.y.u));
        if let Some(last) = self.seen.back() {
            self.longest = math::max(self.longest, (now.t - last.knot.t).abs());
        }
        self.seen.push_back(Seen { knot: *now, lengths });
        if self.seen.len() > MOST {
            // What lies right behind the place is the least certain.
            let behind = self.pending.and_then(|pending| {
                let direction = now.t - self.seen[0].knot.t;
                (1..MOST).find(|i| (self.seen[*i].knot.t - pending.at) * direction > 0.0)
            });
            self.seen.remove(behind.unwrap_or(0));
        }
    }

    fn length(&self, x: &M::Vector) -> f64 {
        let weights = self.degenerates.weights.as_slice();
        math::sqrt(x.as_slice().iter().zip(weights).map(|(x, w)| (x * w) * (x * w)).sum())
    }

    /// Looks whether a gradient vanishes around the last state but one, or around the last one where no other
    /// follows.
    fn suspect(&mut self, rhs: &RightHandSide<'_, '_, M>, last: bool) {
        let n = self.seen.len();
        for k in 0..self.degenerates.all.len() {
            let degenerate = self.degenerates.all[k];
            let Some(i) = self.shortest(degenerate, last) else { continue };
            let StepNode { t, y, .. } = self.seen[n - 1].knot;
            if !self.degenerates.holds(&rhs.state(t, &y.q, &y.u), degenerate) {
                continue;
            }
            let (from, to) = (i.saturating_sub(1), (i + 1).min(n - 1));
            let found = (from..to).map(|i| self.least_between(rhs, degenerate, i));
            let found = found.collect::<Vec<_>>().into_iter().reduce(|a, b| if b.1 < a.1 { b } else { a });
            let Some((place, least)) = found else { continue };
            // A start in such a place has been looked at.
            let begins = (place.t() - self.seen[0].knot.t).abs() <= BEGINS * self.longest;
            if least > VANISHES * self.most.0.of(degenerate) || begins {
                continue;
            }
            let (one, other) = (self.seen[from].knot.y.q, self.seen[to].knot.y.q);
            let mut way = other;
            (0..M::Vector::LEN).for_each(|i| way[i] -= one[i]);
            let way = self.length(&way);
            if !self.degenerates.is_plain((rhs.model, rhs.constants), &place, degenerate, way) {
                let next = FIRST * self.longest;
                self.pending = Some(Pending { degenerate, at: place.t(), next, small: 0.0 });
                return;
            }
        }
    }

    /// The state beside which a gradient is least: the last but one, or the last.
    fn shortest(&self, degenerate: DegenerateRows, last: bool) -> Option<usize> {
        let n = self.seen.len();
        let at = |i: usize| self.seen[i].lengths.of(degenerate);
        let least = |i: &usize| {
            let (before, after) = (i.checked_sub(1).map(at), (i + 1 < n).then(|| at(i + 1)));
            let beside = math::max(before.unwrap_or(0.0), after.unwrap_or(0.0));
            before.is_none_or(|x| x >= at(*i))
                && after.is_none_or(|x| x >= at(*i))
                && at(*i) < (1.0 - RISES) * beside
        };
        let most = self.most.0.of(degenerate);
        let suspects = [n.checked_sub(2), if last { n.checked_sub(1) } else { None }];
        // One that only fades, and nobody comes to rest, does not vanish.
        let stops = at(n - 1) <= RESTS.0 * most && self.is_slow(&self.seen[n - 1].knot);
        let here = if stops { Some(n - 1) } else { None };
        let may_vanish = |i: &usize| degenerate != DegenerateRows::All || at(*i) <= MAY_VANISH * most;
        suspects.into_iter().flatten().find(least).or(here).filter(may_vanish)
    }

    /// Where a gradient is least in a step, along the quintic through its ends, and how long it is there.
    fn least_between(
        &mut self,
        rhs: &RightHandSide<'_, '_, M>,
        degenerate: DegenerateRows,
        step: usize,
    ) -> (M::State, f64) {
        let (start, end) = (self.seen[step].knot, self.seen[step + 1].knot);
        let h = end.t - start.t;
        let between = Hermite::between(&start, &end, h);
        let state = |theta: f64| {
            let y = between.at(theta);
            rhs.state(start.t + theta * h, &y.q, &y.u)
        };
        let mut value = |theta: f64| {
            let gradient = self.degenerates.gradient(rhs.model, rhs.constants, &state(theta), degenerate);
            norm(gradient.as_slice())
        };
        let places = (0..=PLACES).map(|k| k as f64 / PLACES as f64);
        let mut best = (0.0, f64::INFINITY);
        for theta in places {
            let found = value(theta);
            best = if found < best.1 { (theta, found) } else { best };
        }
        let beside = 1.0 / PLACES as f64;
        let (mut a, mut b) = (math::max(best.0 - beside, 0.0), (best.0 + beside).min(1.0));
        for _ in 0..SECTIONS {
            let (left, right) = (a + 0.382 * (b - a), b - 0.382 * (b - a));
            if value(left) < value(right) { b = right } else { a = left }
        }
        let middle = 0.5 * (a + b);
        let found = value(middle);
        best = if found < best.1 { (middle, found) } else { best };
        (state(best.0), best.1)
    }

    /// Whether it has come to rest in the place.
    fn rests(&self, rhs: &RightHandSide<'_, '_, M>, pending: &Pending) -> bool {
        let Some(now) = self.seen.back() else { return false };
        let state = rhs.state(now.knot.t, &now.knot.y.q, &now.knot.y.u);
        let short = now.lengths.of(pending.degenerate) <= RESTS.0 * self.most.0.of(pending.degenerate);
        short && self.degenerates.holds(&state, pending.degenerate) && self.is_slow(&now.knot)
    }

    fn is_slow(&self, now: &StepNode<M::Vector>) -> bool {
        self.length(&now.y.u) <= RESTS.1 * self.most.1
    }

    /// The last state before a time.
    fn before(&self, t: f64) -> StepNode<M::Vector> {
        let direction = self.seen[self.seen.len() - 1].knot.t - self.seen[0].knot.t;
        let before = self.seen.iter().rev().find(|seen| (t - seen.knot.t) * direction > 0.0);
        before.unwrap_or(&self.seen[0]).knot
    }

    /// Whether the motion is on its branch behind the place; `None` where that is not decided yet.
    fn decide(&mut self, rhs: &RightHandSide<'_, '_, M>, pending: &Pending) -> Option<bool> {
        let least = LEAST * self.most.0.of(pending.degenerate);
        let Self { seen, degenerates, .. } = self;
        let knots = seen.iter().map(|seen| seen.knot).collect::<Vec<_>>();
        let mut path = BranchPath::new(rhs, &knots, (pending.at, pending.degenerate), degenerates);
        let most = (knots[knots.len() - 1].t - pending.at).abs();
        let most = most.min(math::max(SPAN * self.longest, pending.small));
        let mut found = None;
        for k in 0..HALVINGS {
            let distance = most * math::powi(0.5, k as i32);
            let Some(power) = path.power(distance, least) else { continue };
            let kept = match power {
                // At this distance it is as long as anywhere: nothing is seen of the place.
                _ if power < VANISHING => continue,
                _ if power < TOUCH => Some(true),
                _ => path.keeps(distance),
            };
            match kept {
                Some(true) => return kept,
                // Polynomials that reach too far agree by chance.
                Some(false) if found == kept => return kept,
                _ => found = kept.or(found),
            }
        }
        None
    }
}

//! Branch identification: whether a motion has continued on its own branch where branches of a constraint
//! touch.
//!
//! The gradient of a constraint of one row vanishes where its branches meet; of several rows, that of the
//! combination that loses rank there ([`degenerate_rows`]). Let Φ ≈ ½ ξᵀHξ there, and τ be the
//! motion's direction. Where branches cross, Hτ ≠ 0: gradients vanish with the first power of the
//! distance, and velocities determine the branch. Where branches touch, Hτ = 0, as for y² = x⁴ or
//! y² = x⁶: gradients vanish with a higher power, the branches differ by as little, and a step may
//! continue on any of them. Energy and constraints are then right to every digit. The condition does not show
//! this, because rows are scaled to unit length for ranks.
//!
//! But a motion is smooth, and one that changes its branch is not. From states at a distance D and more
//! before the place, a polynomial through q and q̇ (Hermite, of degree 7) is extrapolated to D behind it,
//! and one of degree 5 as a check ([`path`]). From one branch to a neighbouring one, ∂Φ/∂q changes from
//! g to −g. If the gradients at the ends of both polynomials agree to a quarter of their length, the
//! extrapolation decides: the motion is on another branch if the gradient at its state differs by more than
//! half the length. The distance shrinks until one decides. If none does before the place is left behind, the
//! branch is unknown, and the motion ends as well.
//!
//! Formulations that let constraints drift are not followed: the drift monitor ends their motion near such a
//! place.
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
use crate::model::{Constraints, ModelState, SimulationModel, StaticTraits, Vector};
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::simulate::right_hand_side::RightHandSide;
use crate::simulate::run::monitor::{Advice, Monitor, Retreat, Watched};
use crate::simulate::run::monitors::branch_identification::degenerate_rows::{
    DegenerateRowSet, DegenerateRows, Lengths, rows_of,
};
use crate::simulate::run::monitors::branch_identification::path::BranchPath;

/// Least length of a gradient within a step, in parts of the longest one met, above which its row does not
/// vanish there.
const NEARLY_VANISHING: f64 = 1e-3;
/// Relative rise of a gradient on one side of a minimum, below which the minimum is rounding.
const MIN_RISE: f64 = 1e-2;
/// Power of the distance with which a gradient vanishes, from which on branches touch: between 1, where they
/// cross, and 2, the least power where they touch.
const MIN_TOUCHING_POWER: f64 = 1.4;
/// Power below which the gradient does not vanish, as far as can be seen at a distance: between 0 and 1.
const MIN_VANISHING_POWER: f64 = 0.6;
/// Length of the gradient of a combination of rows at a state, in parts of the longest one met, above which
/// its minimum between states is not searched. The search costs many corrections.
const MAX_SUSPECT_LENGTH: f64 = 0.1;
/// Most nodes that are kept. Behind a pending place the oldest one behind it is dropped first.
const MAX_KEPT_NODES: usize = 128;
/// Largest distance of the first decision, in longest steps: the polynomial of degree 7 reaches back over
/// four times the distance, as much as one step.
const FIRST_DECISION_DISTANCE: f64 = 0.25;
/// Length of a gradient, in parts of the longest one met, up to which a distance is considered whatever the
/// step size is, so that short steps decide, too.
const SHORT_GRADIENT: f64 = 1e-2;
/// Length of a gradient, in the same parts, below which it is rounding.
const ROUNDING_GRADIENT: f64 = 1e-5;
/// Length of a gradient, in the same parts, above which the place is left behind.
const GRADIENT_BEHIND: f64 = 0.1;
/// Delay of the first decision behind the place, in longest steps.
const FIRST_DECISION_DELAY: f64 = 0.05;
/// Distances of a decision: each is half the one before.
const DISTANCE_HALVINGS: u32 = 8;
/// Delay behind the place, in longest steps, after which the branch is unknown if nothing was decided.
const LAST_DECISION_DELAY: f64 = 4.0;
/// Factor of the delay from one decision to the next.
const DELAY_GROWTH: f64 = 1.4;
/// Parts of a step at whose ends its gradients are sampled to bracket a minimum.
const SAMPLES_PER_STEP: usize = 8;
/// Golden-section steps in the bracket: to 0.618³⁰, 5e-7 of it.
const GOLDEN_SECTIONS: usize = 30;
/// Time from the start, in longest steps, within which a place is the start, which was checked before the
/// run.
const START_VICINITY: f64 = 1e-3;
/// Length of the gradient, in parts of the longest one met, below which a motion is in the place.
const AT_REST_GRADIENT: f64 = 1e-6;
/// Speed, in parts of the largest one met, below which a motion that is in the place comes to rest there.
const AT_REST_SPEED: f64 = 1e-2;

/// Branches of a constraint that touch on the path of a motion.
struct BranchContact<V> {
    rows: TopContributors,
    /// Time of the contact.
    at: f64,
    /// Whether the motion has changed to another branch. If false, the branch is unknown.
    changed: bool,
    /// The last node before the contact.
    before: StepNode<V>,
}

/// A place where a gradient vanishes, behind which the branch of the motion is not decided yet.
#[derive(Clone, Copy)]
struct Pending {
    degenerate: DegenerateRows,
    at: f64,
    /// Time behind the place of the next decision.
    next_decision: f64,
    /// Time behind the place up to which the gradient is short.
    short_until: f64,
}

/// A node of the motion, with the lengths of the gradients there.
struct NodeLengths<M: Constraints> {
    node: StepNode<M::Vector>,
    lengths: Lengths<M::Rows>,
}

/// Follows the gradients of constraints along a run.
pub(crate) struct BranchIdentification<M: Constraints> {
    degenerates: DegenerateRowSet<M>,
    nodes: VecDeque<NodeLengths<M>>,
    /// The longest gradients and the largest speed met.
    largest: (Lengths<M::Rows>, f64),
    /// Length of the longest step.
    longest_step: f64,
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
        if M::IS_UNCONSTRAINED || self.is_idle() {
            return Ok(Advice::Continue);
        }
        match self.after_node(&mut run.plan.rhs, run.stepper.now(), ends) {
            None => Ok(Advice::Continue),
            Some(BranchContact { rows, at, changed, before }) => {
                Err(Retreat { kind: Kind::BranchesTouch { rows, at, changed }, to: before })
            }
        }
    }

    /// Nodes before an action do not continue behind it.
    fn restart(&mut self) {
        self.nodes.clear();
        self.pending = None;
    }
}

impl<M: Constraints> BranchIdentification<M> {
    /// For a run that starts at a state.
    fn from(rhs: &mut RightHandSide<'_, '_, M>, start: &M::State) -> Self {
        let mut degenerates = DegenerateRowSet::none();
        if M::IS_UNCONSTRAINED {
            // No constraints: the code below is not compiled.
        } else if rhs.stabilization.projects() {
            degenerates.workspace = rhs.stabilization.lend_workspace();
            degenerates.follow(rhs.model, start);
            rhs.stabilization.return_workspace(core::mem::take(&mut degenerates.workspace));
        }
        let nodes = VecDeque::with_capacity(if degenerates.all.is_empty() { 0 } else { MAX_KEPT_NODES + 1 });
        Self { degenerates, nodes, largest: (Lengths::zeros(), 0.0), longest_step: 0.0, pending: None }
    }

    /// Whether there is nothing to follow: no constraint, or one that may drift.
    fn is_idle(&self) -> bool {
        self.degenerates.all.is_empty()
    }

    /// Follows the motion to a node, the `last` one of the motion or before an action. Returns a contact of
    /// branches at which the motion has changed its branch, or its branch is unknown.
    fn after_node(
        &mut self,
        rhs: &mut RightHandSide<'_, '_, M>,
        now: &StepNode<M::Vector>,
        last: bool,
    ) -> Option<BranchContact<M::Vector>> {
        self.degenerates.workspace = rhs.stabilization.lend_workspace();
        let found = self.follow(rhs, now, last);
        rhs.stabilization.return_workspace(core::mem::take(&mut self.degenerates.workspace));
        found
    }

    /// See [`Self::after_node`], with the lent workspace.
    fn follow(
        &mut self,
        rhs: &RightHandSide<'_, '_, M>,
        now: &StepNode<M::Vector>,
        last: bool,
    ) -> Option<BranchContact<M::Vector>> {
        self.add_node(rhs, now);
        if self.pending.is_none() {
            self.find_suspect(rhs, last);
        }
        // Wait for the time of the next decision, unless the motion ends or rests here.
        let pending = self.pending.as_mut()?;
        let time_behind = (now.t - pending.at).abs();
        let part = self.nodes[self.nodes.len() - 1].lengths.of(pending.degenerate)
            / self.largest.0.of(pending.degenerate);
        if part <= SHORT_GRADIENT {
            pending.short_until = math::max(pending.short_until, time_behind);
        }
        let pending = *pending;
        let is_at_rest = self.is_at_rest(rhs, &pending);
        if time_behind < pending.next_decision && !last && !is_at_rest {
            return None;
        }
        // Decide, or wait again while the place is not left behind.
        let Pending { degenerate, at, .. } = pending;
        let before = self.last_node_before(at);
        let contact = |changed| {
            let state = rhs.state(before.t, &before.y.q, &before.y.u);
            BranchContact { rows: rows_of(rhs.model, &state, degenerate), at, changed, before }
        };
        match self.decide(rhs, &pending) {
            Some(true) => {
                self.pending = None;
                None
            }
            Some(false) => Some(contact(true)),
            None if is_at_rest
                || last && time_behind > 0.0
                || part > GRADIENT_BEHIND && time_behind > LAST_DECISION_DELAY * self.longest_step =>
            {
                Some(contact(false))
            }
            None => {
                self.pending = Some(Pending { next_decision: DELAY_GROWTH * time_behind, ..pending });
                None
            }
        }
    }

    /// Adds a node, and drops one if there are too many.
    fn add_node(&mut self, rhs: &RightHandSide<'_, '_, M>, now: &StepNode<M::Vector>) {
        let state = rhs.state(now.t, &now.y.q, &now.y.u);
        let lengths = self.degenerates.lengths(rhs.model, rhs.constants, &state);
        self.largest.0.at_least(&lengths);
        self.largest.1 = math::max(self.largest.1, self.length(&now.y.u));
        if let Some(last) = self.nodes.back() {
            self.longest_step = math::max(self.longest_step, (now.t - last.node.t).abs());
        }
        self.nodes.push_back(NodeLengths { node: *now, lengths });
        if self.nodes.len() > MAX_KEPT_NODES {
            // The nodes right behind the place are the least accurate ones.
            let behind = self.pending.and_then(|pending| {
                let direction = now.t - self.nodes[0].node.t;
                (1..MAX_KEPT_NODES).find(|i| (self.nodes[*i].node.t - pending.at) * direction > 0.0)
            });
            self.nodes.remove(behind.unwrap_or(0));
        }
    }

    /// Length of a vector of coordinates or velocities, weighted by √Mᵢᵢ.
    fn length(&self, x: &M::Vector) -> f64 {
        let weights = self.degenerates.weights.as_slice();
        math::sqrt(x.as_slice().iter().zip(weights).map(|(x, w)| (x * w) * (x * w)).sum())
    }

    /// Finds a gradient that vanishes around the last node but one, or around the last one if no other
    /// follows.
    fn find_suspect(&mut self, rhs: &RightHandSide<'_, '_, M>, last: bool) {
        let n = self.nodes.len();
        for k in 0..self.degenerates.all.len() {
            let degenerate = self.degenerates.all[k];
            let Some(i) = self.suspect_node(degenerate, last) else { continue };
            let StepNode { t, y, .. } = self.nodes[n - 1].node;
            if !self.degenerates.holds(&rhs.state(t, &y.q, &y.u), degenerate) {
                continue;
            }
            let (from, to) = (i.saturating_sub(1), (i + 1).min(n - 1));
            let found = (from..to).map(|i| self.least_between(rhs, degenerate, i));
            let found = found.collect::<Vec<_>>().into_iter().reduce(|a, b| if b.1 < a.1 { b } else { a });
            let Some((place, least)) = found else { continue };
            // A singular start was treated before the run.
            let is_at_start = (place.t() - self.nodes[0].node.t).abs() <= START_VICINITY * self.longest_step;
            if least > NEARLY_VANISHING * self.largest.0.of(degenerate) || is_at_start {
                continue;
            }
            let (one, other) = (self.nodes[from].node.y.q, self.nodes[to].node.y.q);
            let mut displacement = other;
            (0..M::Vector::LEN).for_each(|i| displacement[i] -= one[i]);
            let distance = self.length(&displacement);
            if !self.degenerates.is_only_short((rhs.model, rhs.constants), &place, degenerate, distance) {
                let next_decision = FIRST_DECISION_DELAY * self.longest_step;
                self.pending = Some(Pending { degenerate, at: place.t(), next_decision, short_until: 0.0 });
                return;
            }
        }
    }

    /// The node at which a gradient has a minimum: the last but one, or the last.
    fn suspect_node(&self, degenerate: DegenerateRows, last: bool) -> Option<usize> {
        let n = self.nodes.len();
        let at = |i: usize| self.nodes[i].lengths.of(degenerate);
        let least = |i: &usize| {
            let (before, after) = (i.checked_sub(1).map(at), (i + 1 < n).then(|| at(i + 1)));
            let neighbour = math::max(before.unwrap_or(0.0), after.unwrap_or(0.0));
            before.is_none_or(|x| x >= at(*i))
                && after.is_none_or(|x| x >= at(*i))
                && at(*i) < (1.0 - MIN_RISE) * neighbour
        };
        let longest = self.largest.0.of(degenerate);
        let candidates = [n.checked_sub(2), if last { n.checked_sub(1) } else { None }];
        // A gradient that decreases up to the end vanishes only if the motion comes to rest.
        let stops = at(n - 1) <= AT_REST_GRADIENT * longest && self.is_slow(&self.nodes[n - 1].node);
        let here = if stops { Some(n - 1) } else { None };
        let may_vanish =
            |i: &usize| degenerate != DegenerateRows::All || at(*i) <= MAX_SUSPECT_LENGTH * longest;
        candidates.into_iter().flatten().find(least).or(here).filter(may_vanish)
    }

    /// The state of a step at which a gradient is least, on the quintic through the ends, and its length
    /// there.
    fn least_between(
        &mut self,
        rhs: &RightHandSide<'_, '_, M>,
        degenerate: DegenerateRows,
        step: usize,
    ) -> (M::State, f64) {
        let (start, end) = (self.nodes[step].node, self.nodes[step + 1].node);
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
        let samples = (0..=SAMPLES_PER_STEP).map(|k| k as f64 / SAMPLES_PER_STEP as f64);
        let mut best = (0.0, f64::INFINITY);
        for theta in samples {
            let found = value(theta);
            best = if found < best.1 { (theta, found) } else { best };
        }
        // Golden section between the neighbours of the smallest sample.
        let part = 1.0 / SAMPLES_PER_STEP as f64;
        let (mut a, mut b) = (math::max(best.0 - part, 0.0), (best.0 + part).min(1.0));
        for _ in 0..GOLDEN_SECTIONS {
            let (left, right) = (a + 0.382 * (b - a), b - 0.382 * (b - a));
            if value(left) < value(right) { b = right } else { a = left }
        }
        let middle = 0.5 * (a + b);
        let found = value(middle);
        best = if found < best.1 { (middle, found) } else { best };
        (state(best.0), best.1)
    }

    /// Whether the motion has come to rest in the place.
    fn is_at_rest(&self, rhs: &RightHandSide<'_, '_, M>, pending: &Pending) -> bool {
        let Some(now) = self.nodes.back() else { return false };
        let state = rhs.state(now.node.t, &now.node.y.q, &now.node.y.u);
        let short =
            now.lengths.of(pending.degenerate) <= AT_REST_GRADIENT * self.largest.0.of(pending.degenerate);
        short && self.degenerates.holds(&state, pending.degenerate) && self.is_slow(&now.node)
    }

    /// Whether the motion is almost at rest.
    fn is_slow(&self, now: &StepNode<M::Vector>) -> bool {
        self.length(&now.y.u) <= AT_REST_SPEED * self.largest.1
    }

    /// The last node before a time.
    fn last_node_before(&self, t: f64) -> StepNode<M::Vector> {
        let direction = self.nodes[self.nodes.len() - 1].node.t - self.nodes[0].node.t;
        let before = self.nodes.iter().rev().find(|visited| (t - visited.node.t) * direction > 0.0);
        before.unwrap_or(&self.nodes[0]).node
    }

    /// Whether the motion is on its own branch behind the place; `None` if that is not decided yet.
    fn decide(&mut self, rhs: &RightHandSide<'_, '_, M>, pending: &Pending) -> Option<bool> {
        let least = ROUNDING_GRADIENT * self.largest.0.of(pending.degenerate);
        let Self { nodes, degenerates, .. } = self;
        let path_nodes = nodes.iter().map(|visited| visited.node).collect::<Vec<_>>();
        let mut path = BranchPath::new(rhs, &path_nodes, (pending.at, pending.degenerate), degenerates);
        // From the largest distance on that the nodes behind the place permit, to smaller ones.
        let behind = (path_nodes[path_nodes.len() - 1].t - pending.at).abs();
        let largest = behind.min(math::max(FIRST_DECISION_DISTANCE * self.longest_step, pending.short_until));
        let mut found = None;
        for k in 0..DISTANCE_HALVINGS {
            let distance = largest * math::powi(0.5, k as i32);
            let Some(power) = path.power(distance, least) else { continue };
            let stays = match power {
                // At this distance the gradient does not show the place.
                _ if power < MIN_VANISHING_POWER => continue,
                _ if power < MIN_TOUCHING_POWER => Some(true),
                _ => path.stays_on_branch(distance),
            };
            match stays {
                Some(true) => return stays,
                // Two distances have to agree: polynomials that reach too far may decide by chance.
                Some(false) if found == stays => return stays,
                _ => found = stays.or(found),
            }
        }
        None
    }
}

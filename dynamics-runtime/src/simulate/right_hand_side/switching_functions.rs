//! Switching functions: where within a step the accelerations of a model stop being smooth.
//!
//! A kink is a function of the state, as the argument of |x|, at whose zero the accelerations change their
//! branch. The branches at the start of a step are held throughout the step, so that its stages see smooth
//! accelerations. The first zero within the step is located on the step's interpolant; the stepper then makes
//! the step again to end there (`integrate/stepper/switching.rs`, `integrate/discontinuity.rs`). Where the
//! accelerations on each branch lead back to the other one the motion slides ([`Hold::Slides`]; Filippov,
//! Differential Equations with Discontinuous Righthand Sides, 1988).
//!
//! Constraints that change with a branch are treated in `run/constraint_discontinuity.rs`. The model's kinks
//! are defined in [`crate::model`].

use crate::integrate::{
    Accelerations, BranchHold, Phase, Scan, ScanError, StepNode, Switching as _, sample_position,
};
use crate::linalg::max_abs;
use crate::model::{Branches, Constraints, Kink, MAX_KINKS, ModelState, StaticTraits, Vector};
use crate::simulate::right_hand_side::{EvaluationError, RightHandSide};

/// Part of a step at which its branches are determined. Not at its start: that may lie a rounding error
/// before the zero at which the last step was made to end. A zero before this part is missed.
const BRANCH_LOOKUP_PART: f64 = 1e-9;
/// A zero nearer to the end of a step than this part is its end: the step is not made again.
const END_RESOLUTION: f64 = 1e-13;
/// Parts of a step at whose ends kinks are sampled first. The scan adds samples where two zeros between them
/// are possible, so more parts would only cost time.
const KINK_SAMPLE_PARTS: usize = 4;
/// The same for kinks of reactions. Fewer, because each sample solves for the reactions.
const REACTION_SAMPLE_PARTS: usize = 2;
/// Rounding error of a kink's value, relative to four times its largest value in the step plus 1 + |q|: some
/// units in the last place. Zeros of smaller values are not crossings.
const KINK_ROUNDING: f64 = 4.0 * f64::EPSILON;
/// A step in which a kink changes its sign faster than the scan resolves is made again with this part of its
/// size.
const UNRESOLVED_STEP_FACTOR: f64 = 0.1;

/// Most evaluations to find branches that agree with the accelerations on them. Where several kinks meet one
/// may change after the other; without agreement the motion slides.
const MAX_BRANCH_CHANGES: usize = 4;

/// Largest time, in parts of 1 + |t|, by which [`RightHandSide::shifted_onto`] shifts a state to reach other
/// branches. It doubles from rounding on, so most shifts are much smaller.
const MAX_SHIFT: f64 = 1e-6;

type Kinks = [Kink; MAX_KINKS];

impl<M: Constraints> RightHandSide<'_, '_, M> {
    /// Holds the branches just after the start of a step, with the accelerations on them; `on` is false where
    /// branches are to be released. See
    /// [`Switching::hold_branches`](crate::integrate::Switching::hold_branches).
    #[cold]
    pub(crate) fn follow_branches(
        &mut self,
        start: &mut StepNode<M::Vector>,
        h: f64,
        on: bool,
    ) -> Result<BranchHold, EvaluationError> {
        let mut branches = if on { self.branches_after(start, h) } else { Branches::FREE };
        let before = self.acceleration_branches;
        self.held_branches = branches;
        if branches == before {
            return Ok(if on { BranchHold::Same } else { BranchHold::Free });
        }
        for _ in 0..MAX_BRANCH_CHANGES {
            self.held_branches = branches;
            start.a = self.accelerations(start.t, &start.y.q, &start.y.u)?;
            self.acceleration_branches = branches;
            let after = if on { self.branches_after(start, h) } else { Branches::FREE };
            if after == branches {
                let was_free = before == Branches::FREE;
                return Ok(if !on {
                    BranchHold::Free
                } else if was_free {
                    BranchHold::Same
                } else {
                    BranchHold::Changed
                });
            }
            branches = after;
        }
        // On every branch that was held the accelerations lead back to another one.
        self.release_branches();
        start.a = self.accelerations(start.t, &start.y.q, &start.y.u)?;
        Ok(BranchHold::Sliding)
    }

    /// The branches just after the start of a step.
    pub(crate) fn branches_after(&self, start: &StepNode<M::Vector>, h: f64) -> Branches {
        let shift = h * first_lookup(start.t, h);
        let (mut q, mut u) = (start.y.q, start.y.u);
        for i in 0..M::Vector::LEN {
            q[i] += shift * start.y.u[i];
            u[i] += shift * start.a[i];
        }
        self.branches_at(&self.state(start.t + shift, &q, &u))
    }

    /// The nearest state ahead (`direction` 1) or back (−1) along the velocities that lies on the branches
    /// `to`, and the shift in time.
    pub(crate) fn shifted_onto(
        &self,
        state: &M::State,
        to: Branches,
        direction: f64,
    ) -> Option<(M::State, f64)> {
        let size = 1.0 + state.t().abs();
        let mut shift = f64::EPSILON * state.t().abs().max(f64::EPSILON);
        while shift <= MAX_SHIFT * size {
            let mut q = *state.q();
            (0..M::Vector::LEN).for_each(|i| q[i] += direction * shift * state.u()[i]);
            let shifted = self.state(state.t() + direction * shift, &q, state.u());
            if self.is_on_branches(&shifted, to) {
                return Some((shifted, shift));
            }
            shift *= 2.0;
        }
        None
    }

    /// Whether a state lies on these branches.
    pub(crate) fn is_on_branches(&self, state: &M::State, branches: Branches) -> bool {
        let here = self.branches_at(state);
        here.agrees(branches) && branches.is_part_of(here)
    }

    /// Whether a branch cut of an angle lies between two sets of branches.
    pub(crate) fn is_cut_between(&self, state: &M::State, before: Branches, after: Branches) -> bool {
        let mut kinks = [Kink::NONE; MAX_KINKS];
        self.model.kinks(state, &mut kinks);
        let changes =
            |i: usize| before.holds(i) && after.holds(i) && before.below(i, false) != after.below(i, false);
        kinks.iter().enumerate().any(|(i, kink)| kink.is_cut && changes(i))
    }

    /// The branches by the signs of the kinks at a state.
    fn branches_at(&self, state: &M::State) -> Branches {
        let mut kinks = [Kink::NONE; MAX_KINKS];
        self.model.kinks(state, &mut kinks);
        let mut branches = Branches::FREE;
        // A kink that is zero, or not a number, leaves its branch free.
        let decided = kinks.iter().enumerate().filter(|(_, kink)| kink.decides && kink.value.abs() > 0.0);
        decided.for_each(|(i, kink)| branches.hold(i, kink.value < 0.0));
        branches
    }

    /// The part of the step at which the first kink changes its sign; `None` where there is none before its
    /// end. Kinks with held branches cannot be why a step `fails`, and are skipped then. See
    /// [`Switching::locate_kink`](crate::integrate::Switching::locate_kink).
    #[cold]
    pub(crate) fn first_kink(
        &mut self,
        (t, h): (f64, f64),
        fails: bool,
        path: &dyn Fn(f64) -> Phase<M::Vector>,
    ) -> Option<f64> {
        const {
            assert!(M::KINKS <= MAX_KINKS && M::REACTION_KINKS <= MAX_KINKS, "more kinks than are followed");
        };
        let size = 1.0 + max_abs(path(1.0).q.as_slice());
        let mut search = SwitchingSearch { t, h, size, resolution: resolution(t, h), first: f64::INFINITY };
        if M::HAS_KINKS {
            let branches = self.held_branches;
            let start_sign = |i: usize, kink: &Kink| match (kink.decides, branches.holds(i)) {
                (true, true) if branches.below(i, false) => -1.0,
                (true, true) | (false, _) => 1.0,
                (true, false) => 0.0,
            };
            search.scan::<{ KINK_SAMPLE_PARTS + 1 }>(M::KINKS, start_sign, fails, |theta| {
                let (y, mut kinks) = (path(theta), [Kink::NONE; MAX_KINKS]);
                self.model.kinks(&self.state(t + theta * h, &y.q, &y.u), &mut kinks);
                kinks
            });
        }
        if M::HAS_REACTION_KINKS {
            // Where there is no solution the kinks stay as they are: the step itself fails with the reason.
            search.scan::<{ REACTION_SAMPLE_PARTS + 1 }>(
                M::REACTION_KINKS,
                |_, _| 1.0,
                false,
                |theta| {
                    let (y, mut kinks) = (path(theta), [Kink::NONE; MAX_KINKS]);
                    let state = self.on_branches(&self.state(t + theta * h, &y.q, &y.u));
                    self.evaluations += 1;
                    if let Ok(multipliers) = self.stabilization.reactions(self.model, self.constants, &state)
                    {
                        self.model.reaction_kinks(&state, &multipliers, &mut kinks);
                        kinks.iter_mut().for_each(|kink| kink.decides = false);
                    }
                    kinks
                },
            );
        }
        (search.first < 1.0 - search.resolution.max(END_RESOLUTION)).then_some(search.first)
    }
}

/// Search for the first zero of several kinks in a step.
struct SwitchingSearch {
    t: f64,
    h: f64,
    /// 1 + |q|.
    size: f64,
    /// Part of the step that the resolution of time permits to tell apart.
    resolution: f64,
    /// The first zero so far, as a part of the step.
    first: f64,
}

impl SwitchingSearch {
    /// Scans `count` kinks, whose values at a part of the step `at` gives. `start_sign` is the sign at the
    /// start, 0 where the first sample decides.
    fn scan<const SAMPLES: usize>(
        &mut self,
        count: usize,
        start_sign: impl Fn(usize, &Kink) -> f64,
        fails: bool,
        mut at: impl FnMut(f64) -> Kinks,
    ) {
        let thetas: [f64; SAMPLES] = core::array::from_fn(|part| {
            if part == 0 { first_lookup(self.t, self.h) } else { sample_position(part, SAMPLES - 1) }
        });
        let samples = thetas.map(&mut at);
        for i in 0..count {
            let from = samples[0][i];
            if fails && from.decides {
                continue;
            }
            let value = |kinks: &Kinks| {
                if from.decides { kinks[i].value } else { interval_function(kinks[i].value, from.smooth) }
            };
            let column: [(f64, f64); SAMPLES] = core::array::from_fn(|k| (thetas[k], value(&samples[k])));
            let largest = column.iter().fold(0.0f64, |largest, (_, g)| largest.max(g.abs()));
            let noise = KINK_ROUNDING * (4.0 * largest.min(f64::MAX) + self.size);
            let mut scan = Scan::new(start_sign(i, &from), self.resolution, noise).up_to(self.first);
            let follow = scan.follow(
                &column,
                |theta| Ok::<f64, ()>(value(&at(theta))),
                |theta, _| {
                    self.first = self.first.min(theta);
                    false
                },
            );
            if let Err(ScanError::Unresolved) = follow {
                self.first = self.first.min(UNRESOLVED_STEP_FACTOR);
            }
        }
    }
}

/// A smooth function of a value that is positive within an interval and zero at its ends.
fn interval_function(value: f64, [lower, upper]: [f64; 2]) -> f64 {
    match (lower.is_finite(), upper.is_finite()) {
        (true, true) => (value - lower) * ((upper - value) / (upper - lower)),
        (true, false) => value - lower,
        (false, true) => upper - value,
        (false, false) => 1.0,
    }
}

/// The smallest part of a step that `f64` resolves at its time.
fn resolution(t: f64, h: f64) -> f64 {
    4.0 * f64::EPSILON * (t / h).abs().max(1.0)
}

/// The part of a step at which its branches are determined.
fn first_lookup(t: f64, h: f64) -> f64 {
    resolution(t, h).max(BRANCH_LOOKUP_PART)
}

//! Where within a step the accelerations of a model stop being smooth, and the branches that they keep up to
//! there.

use crate::integrate::{
    Accelerations, BranchHold, Phase, Scan, ScanError, StepNode, Switching as _, sample_position,
};
use crate::linalg::max_abs;
use crate::model::{Branches, Constraints, Kink, Known, MOST_KINKS, ModelState, Vector};
use crate::simulate::right_hand_side::{EvaluationError, RightHandSide};

/// Where the branches of a step are looked up, as a part of it: its start may stand a rounding error before
/// the place at which the last one was made to end.
const BRANCH_LOOKUP: f64 = 1e-9;
/// Nearer to the end, as a part of the step, it ends there already.
const AT_END: f64 = 1e-13;
/// Parts in which kinks are sampled first.
const PARTS: usize = 4;
/// Likewise those of reactions, which have to be solved for.
const REACTION_PARTS: usize = 2;
/// Rounding errors of a kink's value, in parts of four times its largest value in a step plus 1 + |q|.
const NOISE: f64 = 4.0 * f64::EPSILON;
/// A step in which a kink comes and goes faster than can be followed is made again this much shorter.
const UNRESOLVED: f64 = 0.1;

/// How often branches are asked for, each time with the accelerations of those before: one changes after the
/// other where several meet.
const MOST_TRIALS: usize = 4;

/// How far from a place at which a step ended just behind, or before, others are looked for, in parts of
/// 1 + |t|.
const FARTHEST: f64 = 1e-6;

type Kinks = [Kink; MOST_KINKS];

impl<M: Constraints> RightHandSide<'_, '_, M> {
    /// See [`Switching::hold_branches`].
    #[cold]
    pub(crate) fn follow_branches(
        &mut self,
        start: &mut StepNode<M::Vector>,
        h: f64,
        on: bool,
    ) -> Result<BranchHold, EvaluationError> {
        let mut branches = if on { self.branches_after(start, h) } else { Branches::FREE };
        let before = self.known;
        self.branches = branches;
        if branches == before {
            return Ok(if on { BranchHold::Same } else { BranchHold::Free });
        }
        for _ in 0..MOST_TRIALS {
            self.branches = branches;
            start.a = self.accelerations(start.t, &start.y.q, &start.y.u)?;
            self.known = branches;
            let after = if on { self.branches_after(start, h) } else { Branches::FREE };
            if after == branches {
                let begins = before == Branches::FREE;
                return Ok(if !on {
                    BranchHold::Free
                } else if begins {
                    BranchHold::Same
                } else {
                    BranchHold::Changed
                });
            }
            branches = after;
        }
        // Whichever is held, the accelerations lead back to another one.
        self.release_branches();
        start.a = self.accelerations(start.t, &start.y.q, &start.y.u)?;
        Ok(BranchHold::Sliding)
    }

    /// The branches just after the start of a step.
    pub(crate) fn branches_after(&self, start: &StepNode<M::Vector>, h: f64) -> Branches {
        let by = h * begin(start.t, h);
        let (mut q, mut u) = (start.y.q, start.y.u);
        for i in 0..M::Vector::LEN {
            q[i] += by * start.y.u[i];
            u[i] += by * start.a[i];
        }
        self.branches_at(&self.state(start.t + by, &q, &u))
    }

    /// The state straight ahead, or back, from where on other branches hold, by as little as rounding
    /// permits; and by what time.
    pub(crate) fn shifted_onto(
        &self,
        state: &M::State,
        to: Branches,
        direction: f64,
    ) -> Option<(M::State, f64)> {
        let size = 1.0 + state.t().abs();
        let mut by = f64::EPSILON * state.t().abs().max(f64::EPSILON);
        while by <= FARTHEST * size {
            let mut q = *state.q();
            (0..M::Vector::LEN).for_each(|i| q[i] += direction * by * state.u()[i]);
            let shifted = self.state(state.t() + direction * by, &q, state.u());
            if self.is_on(&shifted, to) {
                return Some((shifted, by));
            }
            by *= 2.0;
        }
        None
    }

    /// Whether the values at a state decide for these branches.
    pub(crate) fn is_on(&self, state: &M::State, branches: Branches) -> bool {
        let here = self.branches_at(state);
        here.agrees(branches) && branches.is_part_of(here)
    }

    /// Whether an angle is cut between branches.
    pub(crate) fn is_cut_between(&self, state: &M::State, before: Branches, after: Branches) -> bool {
        let mut kinks = [Kink::NONE; MOST_KINKS];
        self.model.kinks(state, &mut kinks);
        let changes =
            |i: usize| before.holds(i) && after.holds(i) && before.below(i, false) != after.below(i, false);
        kinks.iter().enumerate().any(|(i, kink)| kink.is_cut && changes(i))
    }

    /// The branches that the values at a state decide.
    fn branches_at(&self, state: &M::State) -> Branches {
        let mut kinks = [Kink::NONE; MOST_KINKS];
        self.model.kinks(state, &mut kinks);
        let mut branches = Branches::FREE;
        // A value that is zero, or not a number, decides when it is something else.
        let decided = kinks.iter().enumerate().filter(|(_, kink)| kink.decides && kink.value.abs() > 0.0);
        decided.for_each(|(i, kink)| branches.hold(i, kink.value < 0.0));
        branches
    }

    /// See [`Switching::locate_kink`]. Where a step fails it is not for a branch, which is held.
    #[cold]
    pub(crate) fn first_kink(
        &mut self,
        (t, h): (f64, f64),
        fails: bool,
        path: &dyn Fn(f64) -> Phase<M::Vector>,
    ) -> Option<f64> {
        const {
            assert!(M::KINKS <= MOST_KINKS && M::REACTION_KINKS <= MOST_KINKS, "more kinks than are followed")
        };
        let size = 1.0 + max_abs(path(1.0).q.as_slice());
        let mut search = SwitchingSearch { t, h, size, resolution: resolution(t, h), first: f64::INFINITY };
        if M::HAS_KINKS {
            let branches = self.branches;
            let begins = |i: usize, kink: &Kink| match (kink.decides, branches.holds(i)) {
                (true, true) if branches.below(i, false) => -1.0,
                (true, true) | (false, _) => 1.0,
                (true, false) => 0.0,
            };
            search.run::<{ PARTS + 1 }>(M::KINKS, begins, fails, |theta| {
                let (y, mut kinks) = (path(theta), [Kink::NONE; MOST_KINKS]);
                self.model.kinks(&self.state(t + theta * h, &y.q, &y.u), &mut kinks);
                kinks
            });
        }
        if M::HAS_REACTION_KINKS {
            // Where there is no solution, the step itself says so.
            search.run::<{ REACTION_PARTS + 1 }>(
                M::REACTION_KINKS,
                |_, _| 1.0,
                false,
                |theta| {
                    let (y, mut kinks) = (path(theta), [Kink::NONE; MOST_KINKS]);
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
        (search.first < 1.0 - search.resolution.max(AT_END)).then_some(search.first)
    }
}

/// The first of all places in a step where a kink is.
struct SwitchingSearch {
    t: f64,
    h: f64,
    /// 1 + |q|.
    size: f64,
    resolution: f64,
    first: f64,
}

impl SwitchingSearch {
    /// Looks at so many kinks; `begins` is the sign that one has at the start, 0 where that is what is found
    /// there.
    fn run<const SAMPLES: usize>(
        &mut self,
        count: usize,
        begins: impl Fn(usize, &Kink) -> f64,
        fails: bool,
        mut at: impl FnMut(f64) -> Kinks,
    ) {
        let places: [f64; SAMPLES] = core::array::from_fn(|part| {
            if part == 0 { begin(self.t, self.h) } else { sample_position(part, SAMPLES - 1) }
        });
        let samples = places.map(&mut at);
        for i in 0..count {
            let from = samples[0][i];
            if fails && from.decides {
                continue;
            }
            let value = |kinks: &Kinks| {
                if from.decides { kinks[i].value } else { within(kinks[i].value, from.smooth) }
            };
            let column: [(f64, f64); SAMPLES] = core::array::from_fn(|k| (places[k], value(&samples[k])));
            let most = column.iter().fold(0.0f64, |most, (_, g)| most.max(g.abs()));
            let noise = NOISE * (4.0 * most.min(f64::MAX) + self.size);
            let mut scan = Scan::new(begins(i, &from), self.resolution, noise).up_to(self.first);
            let follow = scan.follow(
                &column,
                |theta| Ok::<f64, ()>(value(&at(theta))),
                |theta, _| {
                    self.first = self.first.min(theta);
                    false
                },
            );
            if let Err(ScanError::Unresolved) = follow {
                self.first = self.first.min(UNRESOLVED);
            }
        }
    }
}

/// Positive within an interval, zero at its ends, and smooth.
fn within(value: f64, [least, most]: [f64; 2]) -> f64 {
    match (least.is_finite(), most.is_finite()) {
        (true, true) => (value - least) * ((most - value) / (most - least)),
        (true, false) => value - least,
        (false, true) => most - value,
        (false, false) => 1.0,
    }
}

/// The part of a step that time resolves.
fn resolution(t: f64, h: f64) -> f64 {
    4.0 * f64::EPSILON * (t / h).abs().max(1.0)
}

fn begin(t: f64, h: f64) -> f64 {
    resolution(t, h).max(BRANCH_LOOKUP)
}

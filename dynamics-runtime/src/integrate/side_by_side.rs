//! Several motions side by side, each with its own time, step and end.
//!
//! * **Method**: Verner 9(8), as in [`Verner9`](crate::integrate::Verner9): the same tableau, error norm and
//!   limits of the step. The accelerations of all motions are evaluated at once, one motion in each lane.
//! * **Step control**: integral control with the exponent 1/8, by square roots, where the method alone has
//!   1/9 by powers. After a rejection the step does not grow; an attempt without value is repeated with a
//!   quarter of its size.
//! * **Lanes do not know each other**: masks choose for each what it does, and every operation acts on each
//!   lane alone. A motion has the same bits in whatever company and width it is made.
//! * A motion that needs more than this (too many rejections, steps that stability bounds, no resolved step)
//!   is [`LaneOutcomes::unusual`]: it is to be run alone, by a stepper that reports what happens. After a
//!   number of attempts it pauses ([`LaneOutcomes::paused`]), so that it can be looked at.

use alloc::vec;
use alloc::vec::Vec;
use core::marker::PhantomData;

use crate::integrate::explicit::verner9_table::*;
use crate::integrate::phase::{Phase, Stages};
use crate::integrate::step::StepOptions;
use crate::lanes::{Lanes, Wide};
use crate::model::Vector;

/// The accelerations of the motions.
pub(crate) trait AccelerationsSideBySide<V: Vector, L: Lanes> {
    /// Writes q̈ at times `t` for the states `y`; NaN in a lane where it does not exist.
    fn accelerations(&mut self, t: L, y: &Stages<V, L>, a: &mut V::Wide<L>);
}

/// A motion that enters a lane.
pub(crate) struct Entry<'a, V> {
    pub(crate) t: f64,
    pub(crate) y: &'a Phase<V>,
    pub(crate) end: f64,
    /// Size of the first step, positive.
    pub(crate) h: f64,
    pub(crate) options: &'a StepOptions,
    /// Attempts up to the first pause.
    pub(crate) pause: u64,
}

/// What became of the motions in an attempt, a bit for each lane.
#[derive(Clone, Copy)]
pub(crate) struct LaneOutcomes {
    /// The step was accepted.
    pub(crate) accepted: u32,
    /// It ends the motion.
    pub(crate) ended: u32,
    /// The motion is to be run alone.
    pub(crate) unusual: u32,
    /// It has made the attempts up to the next pause.
    pub(crate) paused: u32,
}

const STAGES: usize = 16;

/// The rows of the stages; the first is the start of the step.
const ROWS: [&[(usize, f64)]; STAGES] =
    [&[], &A1, &A2, &A3, &A4, &A5, &A6, &A7, &A8, &A9, &A10, &A11, &A12, &A13, &A14, &A15];

/// The method in numbers, for what is not written in Rust: kernels of graphics cards.
#[derive(Clone, Copy, Debug)]
pub struct LaneMethod {
    /// The row of each stage, (stage, coefficient); the first is empty. The last two are at the same time.
    pub rows: &'static [&'static [(usize, f64)]],
    /// The node of each stage.
    pub nodes: &'static [f64],
    /// Weights of the result.
    pub weights: &'static [(usize, f64)],
    /// Weights of the error.
    pub errors: &'static [(usize, f64)],
    /// Factor below 1 of the step.
    pub safety: f64,
    /// Smallest factor of the step.
    pub shrink: f64,
    /// Largest factor of the step.
    pub grow: f64,
    /// Factor after an attempt that has no value.
    pub failed_step_part: f64,
    /// Rejections in a row after which a motion is run alone.
    pub max_rejections: f64,
    /// Steps beyond the border of stability after which a motion is run alone. Steps within it are
    /// subtracted.
    pub stiff_steps: f64,
    /// |hλ| above which stability bounds the step.
    pub stability_border: f64,
    /// A step below this part of |t| is not resolved.
    pub resolved_step_part: f64,
    /// The last step may be longer by this part of it.
    pub last_step_stretch: f64,
    /// A step that the end has cut below this part does not shorten the next one.
    pub cut_short_part: f64,
}

/// Verner 9(8) with the step control of lanes.
pub const LANE_METHOD: LaneMethod = LaneMethod {
    rows: &ROWS,
    nodes: &C,
    weights: &B,
    errors: &E,
    // On 1,024 double pendulums at tolerances from 1e-6 to 1e-12, 0.9 rejects a fifth to a quarter of the
    // attempts, and 0.75 a sixth (1e-6) to a fiftieth (1e-12): from 1e-9 on that is 7 % to 11 % fewer
    // attempts, for no larger errors.
    safety: 0.75,
    // Those of `Verner9`.
    shrink: 0.333,
    grow: 6.0,
    failed_step_part: 0.25,
    max_rejections: 12.0,
    stiff_steps: 15.0,
    // That of `Verner9`.
    stability_border: 4.1,
    // See `stepper.rs`.
    resolved_step_part: 4.0 * f64::EPSILON,
    last_step_stretch: 1e-2,
    cut_short_part: 0.99,
};

/// Drives the motions.
pub(crate) struct SideBySide<V: Vector, L: Lanes> {
    /// Where the motions stand.
    t: L,
    y: Stages<V, L>,
    /// Where the last accepted steps began.
    from: (L, Stages<V, L>),
    end: L,
    /// Signed size of the next attempt; 0 in a lane without motion, which then stays where it is.
    h: L,
    /// Largest |h|.
    most: L,
    absolute: L,
    relative: L,
    /// Attempts up to the next pause.
    left: L,
    /// Rejections in a row.
    rejections: L,
    /// See [`LaneMethod::stiff_steps`].
    beyond_stability: L,
    k: [Stages<V, L>; STAGES],
}

impl<V: Vector, L: Lanes> SideBySide<V, L> {
    pub(crate) fn new() -> Self {
        let (zero, zeros) = (L::zero(), Stages::zeros());
        Self {
            t: zero,
            y: zeros,
            from: (zero, zeros),
            end: zero,
            h: zero,
            most: zero,
            absolute: L::splat(1.0),
            relative: zero,
            left: L::splat(f64::INFINITY),
            rejections: zero,
            beyond_stability: zero,
            k: [zeros; STAGES],
        }
    }

    /// Puts a motion into a lane.
    #[cold]
    pub(crate) fn enter(&mut self, lane: usize, entry: &Entry<'_, V>) {
        let Entry { t, y, end, h, options, pause } = *entry;
        self.y.put(lane, y);
        self.from.1.put(lane, y);
        let set = |to: &mut L, x: f64| *to = to.with_lane(lane, x);
        set(&mut self.t, t);
        set(&mut self.from.0, t);
        set(&mut self.end, end);
        set(&mut self.h, h.copysign(end - t));
        set(&mut self.most, options.most);
        set(&mut self.absolute, options.tolerances.absolute);
        set(&mut self.relative, options.tolerances.relative);
        set(&mut self.left, pause as f64);
        set(&mut self.rejections, 0.0);
        set(&mut self.beyond_stability, 0.0);
    }

    /// Lets a motion go on after a pause, for so many attempts.
    #[cold]
    pub(crate) fn go_on(&mut self, lane: usize, attempts: u64) {
        self.left = self.left.with_lane(lane, attempts as f64);
    }

    /// Leaves a lane without motion, where its last step began: that state can be evaluated.
    #[cold]
    pub(crate) fn rest(&mut self, lane: usize) {
        let (t, y) = self.from(lane);
        self.rest_at(lane, t, &y);
    }

    /// Leaves a lane without motion, at a state that can be evaluated.
    #[cold]
    pub(crate) fn rest_at(&mut self, lane: usize, t: f64, y: &Phase<V>) {
        self.y.put(lane, y);
        self.from.1.put(lane, y);
        let set = |to: &mut L, x: f64| *to = to.with_lane(lane, x);
        set(&mut self.t, t);
        set(&mut self.from.0, t);
        set(&mut self.end, t);
        set(&mut self.h, 0.0);
        set(&mut self.left, f64::INFINITY);
        set(&mut self.rejections, 0.0);
        set(&mut self.beyond_stability, 0.0);
    }

    /// Where its last accepted step began.
    fn from(&self, lane: usize) -> (f64, Phase<V>) {
        (self.from.0.lane(lane), self.from.1.of(lane))
    }

    /// Writes where all motions stand and where their last accepted steps began.
    #[inline(always)]
    pub(crate) fn write(&self, to: &mut Positions<V, L>) {
        let mut places = to.numbers.chunks_exact_mut(L::COUNT);
        for (t, y) in [(&self.t, &self.y), (&self.from.0, &self.from.1)] {
            for x in [core::slice::from_ref(t), y.q.as_slice(), y.u.as_slice()].into_iter().flatten() {
                if let Some(place) = places.next() {
                    x.store(place);
                }
            }
        }
    }

    /// One attempt at a step of every motion.
    #[inline(always)]
    pub(crate) fn attempt<S: AccelerationsSideBySide<V, L>>(&mut self, system: &mut S) -> LaneOutcomes {
        // The steps. The last one may be a little longer, to meet the end.
        let left = self.end - self.t;
        let proposed = least(self.h.abs(), self.most);
        let is_last = left.abs().at_most(proposed * L::splat(1.0 + LANE_METHOD.last_step_stretch));
        let backwards = left.less(L::zero());
        let end_t = self.end.or(is_last, self.t + (-proposed).or(backwards, proposed));
        let h = end_t - self.t;
        // The stages.
        let mut at = self.y;
        let mut fourteenth = self.y;
        for (stage, row) in ROWS.iter().enumerate() {
            if stage == STAGES - 1 {
                fourteenth = at;
            }
            at = advance(&self.y, h, row, &self.k);
            let k = &mut self.k[stage];
            system.accelerations(self.t + L::splat(C[stage]) * h, &at, &mut k.u);
            k.q = at.u;
        }
        // The ends, and the squares of the errors.
        let y = advance(&self.y, h, &B, &self.k);
        let error = advance(&Stages::zeros(), h, &E, &self.k);
        let (mut squares, mut size) = (L::zero(), L::zero());
        for (error, from, to) in [(&error.q, &self.y.q, &y.q), (&error.u, &self.y.u, &y.u)] {
            for i in 0..V::LEN {
                let largest = most(from.as_slice()[i].abs(), to.as_slice()[i].abs());
                let part = error.as_slice()[i] / (self.absolute + self.relative * largest);
                (squares, size) = (squares + part * part, size + largest);
            }
        }
        let squared = squares * L::splat(1.0 / (2 * V::LEN) as f64);
        let infinite = L::splat(f64::INFINITY);
        let has_value = squared.less(infinite) & size.less(infinite);
        let accepted = has_value & squared.at_most(L::splat(1.0));
        // The next steps.
        let root = squared.sqrt().sqrt().sqrt().sqrt();
        let factor = least(
            most(L::splat(LANE_METHOD.safety) / root, L::splat(LANE_METHOD.shrink)),
            L::splat(LANE_METHOD.grow),
        );
        let may_grow = accepted & self.rejections.at_most(L::zero());
        let factor = factor.or(may_grow, least(factor, L::splat(1.0)));
        let next = h.abs() * factor.or(has_value, L::splat(LANE_METHOD.failed_step_part));
        let cut = h.abs().less(L::splat(LANE_METHOD.cut_short_part) * proposed);
        self.h = most(next, proposed).or(accepted & cut, next);
        // What has happened.
        let is_stiff = self.is_beyond_stability(h, &fourteenth, &at);
        let more = self.beyond_stability + L::splat(1.0).or(is_stiff, L::splat(-1.0));
        self.beyond_stability = most(more, L::zero()).or(accepted, self.beyond_stability);
        self.rejections = L::zero().or(accepted, self.rejections + L::splat(1.0));
        self.left = self.left - L::splat(1.0);
        // Against the end, too: a motion that breaks down at t = 0 would make its steps ever shorter.
        let unresolved =
            self.h.at_most(L::splat(LANE_METHOD.resolved_step_part) * (self.t.abs() + self.end.abs()));
        let unusual = (!is_last & (unresolved | h.abs().at_most(L::zero())))
            | L::splat(LANE_METHOD.max_rejections).less(self.rejections)
            | L::splat(LANE_METHOD.stiff_steps).at_most(self.beyond_stability);
        let paused = self.left.at_most(L::zero());
        self.from = (self.t.or(accepted, self.from.0), choose(accepted, &self.y, &self.from.1));
        self.t = end_t.or(accepted, self.t);
        self.y = choose(accepted, &y, &self.y);
        LaneOutcomes {
            accepted: L::bits(accepted),
            ended: L::bits(accepted & is_last),
            unusual: L::bits(unusual),
            paused: L::bits(paused),
        }
    }

    /// Whether |hλ| of the dominant eigenvalue λ is beyond the border of stability, by the last two stages,
    /// which are at the same time: see [`stiffness`](crate::integrate::explicit::tableau::stiffness).
    #[inline(always)]
    fn is_beyond_stability(&self, h: L, x: &Stages<V, L>, y: &Stages<V, L>) -> L::Mask {
        let q = square_distance::<V, L>(&x.q, &y.q);
        let u = square_distance::<V, L>(&x.u, &y.u);
        let a = square_distance::<V, L>(&self.k[STAGES - 2].u, &self.k[STAGES - 1].u);
        let border = L::splat(LANE_METHOD.stability_border * LANE_METHOD.stability_border);
        let squared = h * h;
        (border * u).less(squared * a) & (border * border * q).less(squared * squared * a)
    }
}

/// Times and states of all motions, as numbers.
pub(crate) struct Positions<V, L> {
    /// Those of one element in all lanes stand together: t, q and u now, then those of the last step's start.
    numbers: Vec<f64>,
    of: PhantomData<(V, L)>,
}

impl<V: Vector, L: Lanes> Positions<V, L> {
    pub(crate) fn new() -> Self {
        Self { numbers: vec![0.0; 2 * (1 + 2 * V::LEN) * L::COUNT], of: PhantomData }
    }

    /// Where a motion stands.
    pub(crate) fn now(&self, lane: usize) -> (f64, Phase<V>) {
        self.place(lane, 0)
    }

    /// Where its last accepted step began.
    pub(crate) fn from(&self, lane: usize) -> (f64, Phase<V>) {
        self.place(lane, 1 + 2 * V::LEN)
    }

    fn place(&self, lane: usize, first: usize) -> (f64, Phase<V>) {
        let at = |element: usize| self.numbers[(first + element) * L::COUNT + lane];
        let mut y = Phase::<V>::zeros();
        for i in 0..V::LEN {
            (y.q[i], y.u[i]) = (at(1 + i), at(1 + V::LEN + i));
        }
        (at(0), y)
    }
}

/// y + h Σⱼ aⱼ kⱼ.
#[inline(always)]
fn advance<V: Vector, L: Lanes>(
    y: &Stages<V, L>,
    h: L,
    row: &[(usize, f64)],
    k: &[Stages<V, L>; STAGES],
) -> Stages<V, L> {
    let mut out = Stages::<V, L>::zeros();
    let (q, u) = (out.q.as_mut_slice(), out.u.as_mut_slice());
    for &(stage, coefficient) in row {
        let (of, coefficient) = (&k[stage % STAGES], L::splat(coefficient));
        for i in 0..V::LEN {
            q[i] = coefficient.times_plus(of.q.as_slice()[i], q[i]);
            u[i] = coefficient.times_plus(of.u.as_slice()[i], u[i]);
        }
    }
    for i in 0..V::LEN {
        q[i] = h.times_plus(q[i], y.q.as_slice()[i]);
        u[i] = h.times_plus(u[i], y.u.as_slice()[i]);
    }
    out
}

/// `x` in the lanes of a mask, `y` in the others.
#[inline(always)]
fn choose<V: Vector, L: Lanes>(mask: L::Mask, x: &Stages<V, L>, y: &Stages<V, L>) -> Stages<V, L> {
    let mut out = *y;
    for i in 0..V::LEN {
        out.q.as_mut_slice()[i] = x.q.as_slice()[i].or(mask, y.q.as_slice()[i]);
        out.u.as_mut_slice()[i] = x.u.as_slice()[i].or(mask, y.u.as_slice()[i]);
    }
    out
}

/// Σ(xᵢ − yᵢ)².
#[inline(always)]
fn square_distance<V: Vector, L: Lanes>(x: &V::Wide<L>, y: &V::Wide<L>) -> L {
    let mut sum = L::zero();
    for i in 0..V::LEN {
        let difference = x.as_slice()[i] - y.as_slice()[i];
        sum = difference.times_plus(difference, sum);
    }
    sum
}

/// The larger of two; `y` where one is no number.
#[inline(always)]
fn most<L: Lanes>(x: L, y: L) -> L {
    x.or(y.less(x), y)
}

/// The smaller of two; `y` where one is no number.
#[inline(always)]
fn least<L: Lanes>(x: L, y: L) -> L {
    x.or(x.less(y), y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::Tolerances;
    use crate::lanes::Portable;
    use nalgebra::SVector;

    type V = SVector<f64, 2>;

    /// Two coupled oscillators, one of them with a pole beside its way.
    struct Coupled;

    impl<L: Lanes> AccelerationsSideBySide<V, L> for Coupled {
        fn accelerations(&mut self, t: L, y: &Stages<V, L>, a: &mut [L; 2]) {
            let [x, z] = y.q;
            let drive = (t + t).sin_cos().0;
            *a = [drive - x - x * z, x / (L::splat(3.0) - z) - L::splat(0.1) * y.u[1] - z];
        }
    }

    fn start(k: usize) -> (f64, Phase<V>, f64, Tolerances) {
        let r = |i: usize| (1.7 * (5 * k + i) as f64).sin();
        let y = Phase { q: V::new(r(0), 0.5 * r(1)), u: V::new(r(2), r(3)) };
        let end = if k.is_multiple_of(3) { -4.0 } else { 6.0 + r(4) };
        (0.1 * k as f64, y, end, Tolerances::both(if k.is_multiple_of(2) { 1e-6 } else { 1e-11 }))
    }

    /// The ends of motions, each started in the lane that becomes free.
    fn ends<L: Lanes>(count: usize) -> Vec<[u64; 5]> {
        let mut stepper = SideBySide::<V, L>::new();
        let (mut ends, mut lanes, mut next) = (vec![[0; 5]; count], vec![None; L::COUNT], 0);
        loop {
            for (lane, run) in lanes.iter_mut().enumerate() {
                if run.is_none() && next < count {
                    let (t, y, end, tolerances) = start(next);
                    let options = StepOptions { tolerances, fixed: None, first: None, most: 0.7 };
                    stepper.enter(lane, &Entry { t, y: &y, end, h: 1e-3, options: &options, pause: 10_000 });
                    (*run, next) = (Some(next), next + 1);
                }
            }
            if lanes.iter().all(Option::is_none) {
                return ends;
            }
            let LaneOutcomes { ended, unusual, paused, .. } = stepper.attempt(&mut Coupled);
            let unusual = unusual | paused;
            for (lane, run) in lanes.iter_mut().enumerate() {
                let Some(index) = *run else { continue };
                assert_eq!(unusual >> lane & 1, 0, "{index}");
                if ended >> lane & 1 == 1 {
                    let mut places = Positions::new();
                    stepper.write(&mut places);
                    let (t, Phase { q, u }) = places.now(lane);
                    ends[index] = [t, q[0], q[1], u[0], u[1]].map(f64::to_bits);
                    *run = None;
                    stepper.rest(lane);
                }
            }
        }
    }

    /// One lane and four have the same bits, and both end where they should.
    #[test]
    fn the_number_of_lanes_changes_no_bit() {
        let one = ends::<f64>(31);
        assert_eq!(one, ends::<Portable>(31));
        for (k, end) in one.iter().enumerate() {
            assert_eq!(f64::from_bits(end[0]), start(k).2);
            assert!(end.iter().all(|x| f64::from_bits(*x).is_finite()), "{k}");
        }
    }

    /// A motion without value, one that is not resolved and one with too many steps are unusual.
    #[test]
    fn what_steps_cannot_do_is_unusual() {
        struct Force(f64);
        impl AccelerationsSideBySide<V, f64> for Force {
            fn accelerations(&mut self, _: f64, y: &Stages<V, f64>, a: &mut [f64; 2]) {
                *a = [self.0 * y.q[0], -1e9 * y.u[1]];
            }
        }
        let attempts = |factor: f64, velocity: f64, pause: u64| {
            let mut stepper = SideBySide::<V, f64>::new();
            let options =
                StepOptions { tolerances: Tolerances::both(1e-6), fixed: None, first: None, most: 1.0 };
            let y = Phase { q: V::new(1.0, 0.0), u: V::new(0.0, velocity) };
            stepper.enter(0, &Entry { t: 0.0, y: &y, end: 10.0, h: 1e-3, options: &options, pause });
            let unusual = (1..10_000).find(|_| {
                let outcomes = stepper.attempt(&mut Force(factor));
                outcomes.unusual == 1 || outcomes.paused == 1
            });
            let mut places = Positions::new();
            stepper.write(&mut places);
            (unusual, places.now(0).0)
        };
        let (no_value, t) = attempts(f64::NAN, 0.0, 10_000);
        assert!(no_value.is_some_and(|attempts| attempts < 20) && t == 0.0, "{no_value:?} {t}");
        let (stiff, t) = attempts(-1.0, 1.0, 10_000);
        assert!(stiff.is_some_and(|attempts| attempts < 200) && t < 1e-5, "{stiff:?} {t}");
        assert_eq!(attempts(-1.0, 0.0, 5).0, Some(5));
    }
}

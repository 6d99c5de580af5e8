//! GraggBulirschStoer: extrapolation of the midpoint rule, its columns side by side.
//!
//! * **Problem**: smooth, not stiff, tolerances from about 10⁻⁴ to 10⁻¹², accelerations that can be
//!   evaluated for four states at once ([`Accelerations::derivatives`](super::Accelerations::derivatives)):
//!   models whose generated code has lanes. Without lanes
//!   the results are the same, and it is slow.
//! * **Formula**: the modified midpoint rule z₀ = y, z₁ = y + ηf(y), zᵢ₊₁ = zᵢ₋₁ +
//!   2ηf(zᵢ) with η = h/n has an error in even powers of η only. Its results for n = 2, 4, …, 14 are
//!   extrapolated to η = 0: the weight of column n is Π n²/(n² − m²) over the other columns m.
//! * **Order** 14; what the last column changes is the error estimate, of the order 12 of the other six.
//! * **Side by side**: columns are independent. Column n has n − 1 evaluations besides f(y). Four lanes of
//!   equal length, with 13, 11 + 1, 9 + 3 and 7 + 5 of them, make 49 evaluations in the time of 13. Three
//!   lanes are done one call before the longest. Their last call evaluates the end of the step as the six
//!   finished columns give it; this and the end itself give the stiffness estimate.
//! * **Dense output**: the polynomial of degree 11 that has q, q̇ and q̈ at the ends of the step and a
//!   third of it from either; u is its derivative. The two inner nodes are found by the same rule with n = 2,
//!   4, …, 10, of order 10 over a third of the step, from its start and backwards from its end: again four
//!   lanes, 14 calls, only when dense output is asked for.
//! * **Rounding**: the weights of the columns have the absolute sum 56, so that errors stay at some
//!   10⁻¹³, and tolerances below 10⁻¹² only make more steps. The interpolant is built from
//!   displacements from the nearer end, not from positions, and the distance of the ends contributes to u
//!   only where it is more than the rounding of q: u is accurate far from the origin of q, too.
//! * **Stability**: real axis to −6.6.
//! * **Cost**: 13 evaluations of four states side by side and one more per step; 14 with dense output more.
//! * **Source**: Gragg, SIAM J. Numer. Anal. 2 (1965) 384; Bulirsch, Stoer, Numer. Math. 8 (1966) 1; Hairer,
//!   Nørsett, Wanner, *Solving Ordinary Differential Equations I*, §II.9. Columns in parallel: Ketcheson,
//!   bin Waheed, Commun. Appl. Math. Comput. Sci. 9 (2014) 175.

mod dense;

use super::{ControllerSettings, Method, Phase, Scheme, Stages, StepNode, System, Tolerances};
use crate::integrate::explicit::tableau::stiffness;
use crate::integrate::phase::zip;
use crate::lanes::{Code, Lanes, Task, Wide, in_four_lanes};
use crate::model::Vector;

pub use dense::FourPointHermite;
use dense::InnerNode;

/// Lanes of a plan.
const COUNT: usize = 4;
/// Most columns of one lane.
const MAX_LANE_COLUMNS: usize = 3;
/// Evaluations of the longest lane.
const LANE_EVALUATIONS: usize = 13;

/// Numbers of substeps of the columns that a lane has, one after the other; 0: none.
type Columns = [[usize; MAX_LANE_COLUMNS]; COUNT];

/// The plan for the end of the step and its error.
const STEP_PLAN: [PlannedEvaluation; LANE_EVALUATIONS] =
    plan([[14, 0, 0], [12, 2, 0], [10, 4, 0], [8, 6, 0]], 14);
/// The plan for dense output: five columns for each of two inner nodes.
const DENSE_PLAN: [PlannedEvaluation; LANE_EVALUATIONS] =
    plan([[10, 4, 2], [8, 6, 0], [10, 4, 2], [8, 6, 0]], 10);

/// One evaluation of four stages in a plan.
#[derive(Clone, Copy, Debug)]
struct PlannedEvaluation {
    /// Times of the stages, as parts of the step.
    time: [f64; COUNT],
    /// Twice the substep, as a part of the step.
    double_substep: [f64; COUNT],
    /// Lanes in which a column ends here, as bits.
    ended: u32,
    /// Lanes in which this is the first column.
    first: u32,
    /// Lanes in which this is the last column.
    last: u32,
    /// Whether a column ends in any lane.
    any: bool,
    /// Weights of the ended columns, in the end of the step and in its error.
    weights: [[f64; COUNT]; 2],
    /// Substeps of the columns that begin then, as parts of the step.
    substep: [f64; COUNT],
}

/// The evaluations of the columns of four lanes, in order; `most` is the largest number of substeps.
const fn plan(columns: Columns, most: usize) -> [PlannedEvaluation; LANE_EVALUATIONS] {
    let zero = [0.0; COUNT];
    let call = PlannedEvaluation {
        time: zero,
        double_substep: zero,
        ended: 0,
        first: 0,
        last: 0,
        any: false,
        weights: [zero; 2],
        substep: zero,
    };
    let mut plan = [call; LANE_EVALUATIONS];
    let mut lane = 0;
    while lane < COUNT {
        // Column i of the lane, its substeps so far, and the evaluation.
        let (mut i, mut made, mut at) = (0, 1, 0);
        while at < LANE_EVALUATIONS {
            // A finished lane evaluates the end of the step.
            let n = if i < MAX_LANE_COLUMNS && columns[lane][i] > 0 { columns[lane][i] } else { 1 };
            plan[at].time[lane] = made as f64 / n as f64;
            plan[at].double_substep[lane] = 2.0 / n as f64;
            made += 1;
            if made == n {
                let following = if i + 1 < MAX_LANE_COLUMNS { columns[lane][i + 1] } else { 0 };
                plan[at].any = true;
                plan[at].ended |= 1 << lane;
                plan[at].first |= ((i == 0) as u32) << lane;
                plan[at].last |= ((following == 0) as u32) << lane;
                let end = weight(n, most);
                plan[at].weights[0][lane] = end;
                plan[at].weights[1][lane] = end - if n < most { weight(n, most - 2) } else { 0.0 };
                plan[at].substep[lane] = if following > 0 { 1.0 / following as f64 } else { 0.0 };
                (i, made) = (i + 1, 1);
            }
            at += 1;
        }
        lane += 1;
    }
    plan
}

/// The weight of column n that extrapolates columns 2, 4, …, `most` to substeps of no length.
const fn weight(n: usize, most: usize) -> f64 {
    let (mut weight, mut m) = (1.0, 2);
    while m <= most {
        if m != n {
            weight *= (n * n) as f64 / ((n * n) as f64 - (m * m) as f64);
        }
        m += 2;
    }
    weight
}

/// The starts of the four lanes.
struct LaneStarts<V: Vector, L: Lanes> {
    t: L,
    y: Stages<V, L>,
    slope: Stages<V, L>,
    /// The length of each lane.
    h: L,
}

/// Extrapolation of the midpoint rule, of order 14(12).
#[derive(Clone, Copy, Debug)]
pub struct GraggBulirschStoer<V: Vector> {
    /// The derivatives at the start, and the mean ones of the step, or the first that are not finite.
    stages: [Phase<V>; 2],
    error: Phase<V>,
    /// The end of the step by the first six columns, and the accelerations there.
    six_columns: (Phase<V>, V),
}

impl<V: Vector> GraggBulirschStoer<V> {
    /// Evaluates the columns of a plan. Returns the weighted sums of their changes for the end of the step
    /// and for its error, lane by lane. `observe` receives stages and derivatives of each evaluation. `last`
    /// may replace the stages of finished lanes before the last evaluation; it receives the sums so far.
    #[inline(always)]
    fn run_plan<S: System<V>, L: Lanes>(
        system: &mut S,
        start: &LaneStarts<V, L>,
        plan: &[PlannedEvaluation; LANE_EVALUATIONS],
        mut last: impl FnMut(&mut Stages<V, L>, &[Stages<V, L>; 2]),
        mut observe: impl FnMut(usize, &Stages<V, L>, &Stages<V, L>),
    ) -> Result<[Stages<V, L>; 2], S::Error> {
        let part = |of: &[f64; COUNT]| start.h * L::load(of);
        // Displacements after even and odd substeps; each one replaces the last but one. The first evaluation
        // is at the end of the first substep.
        let [mut even, mut odd] = [Stages::<V, L>::zeros(), scaled(part(&plan[0].time), &start.slope)];
        let (mut first, mut sums, mut slope) =
            (Stages::<V, L>::zeros(), [Stages::zeros(); 2], Stages::zeros());
        let mut stage = sum(&start.y, &odd);
        for (i, call) in plan.iter().enumerate() {
            if i + 1 == LANE_EVALUATIONS {
                last(&mut stage, &sums);
            }
            system.derivatives(start.t + part(&call.time), &stage, &mut slope)?;
            observe(i, &stage, &slope);
            let (now, next) = if i % 2 == 0 { (&mut odd, &mut even) } else { (&mut even, &mut odd) };
            let twice = part(&call.double_substep);
            let (y, begin) = (&start.y, &start.slope);
            if !call.any {
                midpoint_substep::<V, L>(twice, [&mut next.q, &mut stage.q], [&slope.q, &y.q]);
                midpoint_substep::<V, L>(twice, [&mut next.u, &mut stage.u], [&slope.u, &y.u]);
                continue;
            }
            let substeps = (twice, part(&call.substep));
            let [end, error] = &mut sums;
            let of_q = [&mut now.q, &mut next.q, &mut stage.q, &mut first.q, &mut end.q, &mut error.q];
            finish::<V, L>(call, substeps, of_q, [&slope.q, &y.q, &begin.q]);
            let of_u = [&mut now.u, &mut next.u, &mut stage.u, &mut first.u, &mut end.u, &mut error.u];
            finish::<V, L>(call, substeps, of_u, [&slope.u, &y.u, &begin.u]);
        }
        Ok(sums)
    }
}

/// One substep zᵢ₊₁ = zᵢ₋₁ + 2ηf(zᵢ), in place of zᵢ₋₁, and the stage there.
#[inline(always)]
fn midpoint_substep<V: Vector, L: Lanes>(
    twice: L,
    [next, stage]: [&mut V::Wide<L>; 2],
    [slope, y]: [&V::Wide<L>; 2],
) {
    for i in 0..V::LEN {
        let next = &mut next.as_mut_slice()[i];
        *next = *next + twice * slope.as_slice()[i];
        stage.as_mut_slice()[i] = y.as_slice()[i] + *next;
    }
}

/// The data of stages of so few elements stay in registers, if no function is called. Longer ones are in
/// memory in any case.
const MAX_ELEMENTS_INLINE: usize = 4;

/// [`finish_columns`], inlined where stages are short. For longer ones inlining would cost a tenth of the
/// time of a run of Andrews' mechanism.
#[inline(always)]
fn finish<V: Vector, L: Lanes>(
    call: &PlannedEvaluation,
    substeps: (L, L),
    changed: [&mut V::Wide<L>; 6],
    read: [&V::Wide<L>; 3],
) {
    let finish = FinishColumns::<V, L> { call, substeps, changed, read };
    if V::LEN <= MAX_ELEMENTS_INLINE { finish.run() } else { L::call(finish) }
}

/// [`finish_columns`] as code that may use the instructions of its lanes where it is not inlined.
struct FinishColumns<'a, V: Vector, L: Lanes> {
    call: &'a PlannedEvaluation,
    substeps: (L, L),
    changed: [&'a mut V::Wide<L>; 6],
    read: [&'a V::Wide<L>; 3],
}

impl<V: Vector, L: Lanes> Code for FinishColumns<'_, V, L> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        finish_columns::<V, L>(self.call, self.substeps, self.changed, self.read);
    }
}

/// A substep after which columns end: they are added to the sums, and the next columns of their lanes begin.
#[inline(always)]
fn finish_columns<V: Vector, L: Lanes>(
    call: &PlannedEvaluation,
    (twice, substep): (L, L),
    [now, next, stage, first, end, error]: [&mut V::Wide<L>; 6],
    [slope, y, begin]: [&V::Wide<L>; 3],
) {
    let weights = [L::load(&call.weights[0]), L::load(&call.weights[1])];
    let (ended, is_first, is_last) = (L::mask(call.ended), L::mask(call.first), L::mask(call.last));
    for i in 0..V::LEN {
        let found = next.as_slice()[i] + twice * slope.as_slice()[i];
        let of_end = end.as_slice()[i] + weights[0] * found;
        let of_error = error.as_slice()[i] + weights[1] * found;
        let of_first = found.or(is_first, first.as_slice()[i]);
        let before = L::zero().or(ended, now.as_slice()[i]);
        let after = of_first.or(is_last, (substep * begin.as_slice()[i]).or(ended, found));
        (end.as_mut_slice()[i], error.as_mut_slice()[i]) = (of_end, of_error);
        (first.as_mut_slice()[i], now.as_mut_slice()[i]) = (of_first, before);
        (next.as_mut_slice()[i], stage.as_mut_slice()[i]) = (after, y.as_slice()[i] + after);
    }
}

/// x + y.
#[inline(always)]
fn sum<V: Vector, L: Lanes>(x: &Stages<V, L>, y: &Stages<V, L>) -> Stages<V, L> {
    let mut out = *x;
    for i in 0..V::LEN {
        out.q.as_mut_slice()[i] = x.q.as_slice()[i] + y.q.as_slice()[i];
        out.u.as_mut_slice()[i] = x.u.as_slice()[i] + y.u.as_slice()[i];
    }
    out
}

/// factor·y.
#[inline(always)]
fn scaled<V: Vector, L: Lanes>(factor: L, y: &Stages<V, L>) -> Stages<V, L> {
    let mut out = *y;
    for i in 0..V::LEN {
        out.q.as_mut_slice()[i] = factor * y.q.as_slice()[i];
        out.u.as_mut_slice()[i] = factor * y.u.as_slice()[i];
    }
    out
}

/// Puts other values into some lanes.
#[inline(always)]
fn replace<V: Vector, L: Lanes>(of: &mut Stages<V, L>, lanes: u32, by: &Stages<V, L>) {
    let lanes = L::mask(lanes);
    for i in 0..V::LEN {
        of.q.as_mut_slice()[i] = by.q.as_slice()[i].or(lanes, of.q.as_slice()[i]);
        of.u.as_mut_slice()[i] = by.u.as_slice()[i].or(lanes, of.u.as_slice()[i]);
    }
}

/// The same phase in every lane.
#[inline(always)]
fn fill<V: Vector, L: Lanes>(phase: &Phase<V>) -> Stages<V, L> {
    let mut out = Stages::<V, L>::zeros();
    for i in 0..V::LEN {
        out.q.as_mut_slice()[i] = L::splat(phase.q[i]);
        out.u.as_mut_slice()[i] = L::splat(phase.u[i]);
    }
    out
}

/// The sum over some lanes.
#[inline(always)]
fn total<V: Vector, L: Lanes>(of: &Stages<V, L>, lanes: core::ops::Range<usize>) -> Phase<V> {
    let mut out = Phase::<V>::zeros();
    for i in 0..V::LEN {
        out.q[i] = of.q.as_slice()[i].array()[lanes.clone()].iter().sum();
        out.u[i] = of.u.as_slice()[i].array()[lanes.clone()].iter().sum();
    }
    out
}

/// The end of a step; what else the method keeps of it is written there.
struct Attempt<'a, V: Vector, S> {
    method: &'a mut GraggBulirschStoer<V>,
    system: &'a mut S,
    start: &'a StepNode<V>,
    h: f64,
    /// Whether the first derivatives that are not finite are kept, so that the error names their coordinate.
    watches: bool,
}

impl<V: Vector, S: System<V>> Task for Attempt<'_, V, S> {
    type Output = Result<Phase<V>, S::Error>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let Self { method, system, start, h, watches } = self;
        let (y, slope) = (&start.y, start.derivative());
        let from =
            LaneStarts::<V, L> { t: L::splat(start.t), y: fill(y), slope: fill(&slope), h: L::splat(h) };
        let (six_columns, mut not_finite) = (&mut method.six_columns, None);
        // While column 14 is missing, the difference of the sums is the change by the other six.
        let six = |stage: &mut Stages<V, L>, sums: &[Stages<V, L>; 2]| {
            // One by one: `map` of an array is a call, without the vectors of the lanes.
            let (change, error) = (total(&sums[0], 0..COUNT), total(&sums[1], 0..COUNT));
            let six = zip(y, &zip(&change, &error, |change, error| change - error), |y, change| y + change);
            replace(stage, 0b1110, &fill(&six));
        };
        let plan = &STEP_PLAN;
        let [changes, errors] =
            GraggBulirschStoer::<V>::run_plan(system, &from, plan, six, |call, stage, slope| {
                if call + 1 == LANE_EVALUATIONS {
                    *six_columns = (stage.of(1), slope.of(1).u);
                }
                if watches {
                    let first = || (0..COUNT).map(|lane| slope.of(lane)).find(|slope| !slope.is_finite());
                    not_finite = not_finite.or_else(first);
                }
            })?;
        let change = total(&changes, 0..COUNT);
        let end = zip(y, &change, |y, change| y + change);
        method.error = total(&errors, 0..COUNT);
        let mean = zip(&change, &change, |change, _| change / h);
        method.stages = [slope, not_finite.unwrap_or(mean)];
        Ok(end)
    }
}

/// The inner nodes of the interpolant of a step with these ends.
struct InnerNodes<'a, V: Vector, S> {
    system: &'a mut S,
    ends: [&'a StepNode<V>; 2],
    h: f64,
}

impl<V: Vector, S: System<V>> Task for InnerNodes<'_, V, S> {
    type Output = Result<[InnerNode<V>; 2], S::Error>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let Self { system, ends: [start, end], h } = self;
        let third = h / 3.0;
        let (mut y, mut slope) = (fill::<V, L>(&start.y), fill(&start.derivative()));
        let back = 0b1100;
        replace(&mut y, back, &fill(&end.y));
        replace(&mut slope, back, &fill(&end.derivative()));
        let t = L::load(&[start.t, start.t, end.t, end.t]);
        let from = LaneStarts { t, y, slope, h: L::load(&[third, third, -third, -third]) };
        let [changes, _] =
            GraggBulirschStoer::<V>::run_plan(system, &from, &DENSE_PLAN, |_, _| {}, |_, _, _| {})?;
        let ways = [total(&changes, 0..2), total(&changes, 2..4)];
        let plus = |from: &StepNode<V>, way: &Phase<V>| zip(&from.y, way, |y, way| y + way);
        let inner = [plus(start, &ways[0]), plus(end, &ways[1])];
        let mut stages = fill(&inner[0]);
        replace(&mut stages, back, &fill(&inner[1]));
        let mut slopes = Stages::zeros();
        system.derivatives(t + from.h, &stages, &mut slopes)?;
        let node = |i: usize| InnerNode { displacement: ways[i].q, u: inner[i].u, a: slopes.of(2 * i).u };
        Ok([node(0), node(1)])
    }
}

impl<V: Vector> Scheme<V> for GraggBulirschStoer<V> {
    const METHOD: Method = Method::GraggBulirschStoer;
    const ORDER: u32 = 14;
    const ERROR_ORDER: u32 = 12;
    // The fastest of safeties from 0.6 to 0.9, growths from 1.7 to 10 and β from −0.02 to 0.04, to the
    // errors 1e-6, 1e-9 and 1e-12 of Andrews' mechanism, a double pendulum and an eccentric orbit. Steps are
    // long compared with the times in which the motion changes, so that a growing error goes on growing: β <
    // 0 anticipates that.
    const CONTROL: Option<ControllerSettings> =
        Some(ControllerSettings { safety: 0.7, beta: -0.007, shrink: 0.2, grow: 3.0 });
    // Stages of columns of few substeps are not states of the solution: sums over a step use the interpolant.
    const WEIGHTS: &'static [f64] = &[];
    // Steps that stability bounds settle at 5.3 of the 6.6.
    const STABILITY_BORDER: f64 = 5.0;
    const EVENT_PANELS: usize = 16;
    const DEFECT_SAMPLES: &'static [f64] = &[0.09, 0.42];
    const LONG_STEPS: bool = true;
    type Dense = FourPointHermite<V>;

    fn new() -> Self {
        Self { stages: [Phase::zeros(); 2], error: Phase::zeros(), six_columns: (Phase::zeros(), V::zeros()) }
    }

    #[inline(always)]
    fn attempt<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        h: f64,
        tolerances: &Tolerances,
    ) -> Result<(Phase<V>, f64), S::Error> {
        let mut watches = false;
        loop {
            // One call: its code is compiled once.
            let end = in_four_lanes(Attempt { method: self, system, start, h, watches })?;
            if watches || end.is_finite() {
                return Ok((end, tolerances.norm(&self.error, &start.y, &end)));
            }
            watches = true;
        }
    }

    fn dense<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        end: &StepNode<V>,
        h: f64,
    ) -> Result<FourPointHermite<V>, S::Error> {
        let nodes = in_four_lanes(InnerNodes { system, ends: [start, end], h })?;
        Ok(FourPointHermite::new([start, end], &nodes, h))
    }

    /// Dense output needs the ends only.
    fn dense_from_ends<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        end: &StepNode<V>,
        h: f64,
        _: &Tolerances,
    ) -> Result<Option<FourPointHermite<V>>, S::Error> {
        self.dense(system, start, end, h).map(Some)
    }

    fn stages(&self) -> &[Phase<V>] {
        &self.stages
    }

    fn error_vector(&self) -> Phase<V> {
        self.error
    }

    fn stiffness(&self, h: f64, end: &StepNode<V>) -> Option<f64> {
        stiffness(h, (&end.y, &end.a), (&self.six_columns.0, &self.six_columns.1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::Dense as _;
    use nalgebra::SVector;

    type V = SVector<f64, 1>;

    /// Σ w = 1 and Σ w/n²ᵏ = 0 as far as the order goes; every lane is busy up to the last call but one.
    #[test]
    fn weights_extrapolate_to_substeps_of_no_length() {
        let moment = |plan: &[PlannedEvaluation; LANE_EVALUATIONS], which: usize, k: i32| -> f64 {
            let ended = plan.iter().flat_map(|call| {
                (0..COUNT).filter(|lane| call.ended >> lane & 1 == 1).map(move |lane| (call, lane))
            });
            ended.map(|(call, lane)| call.weights[which][lane] * call.double_substep[lane].powi(2 * k)).sum()
        };
        for k in 0..7 {
            let one = f64::from(k == 0);
            assert!((moment(&STEP_PLAN, 0, k) - one).abs() < 1e-13, "{k}");
            // The difference of two extrapolations, the second of one order less.
            assert!(moment(&STEP_PLAN, 1, k).abs() < 1e-13 || k == 6, "{k}");
            assert!(k > 4 || (0.5 * moment(&DENSE_PLAN, 0, k) - one).abs() < 1e-13, "{k}");
        }
        assert!(moment(&STEP_PLAN, 1, 6).abs() > 1e-6);
        for plan in [STEP_PLAN, DENSE_PLAN] {
            for lane in 0..COUNT {
                let last = plan.iter().position(|call| call.last >> lane & 1 == 1).unwrap();
                assert!(last + 2 >= LANE_EVALUATIONS && plan[last].time[lane] < 1.0, "{last}");
            }
        }
    }

    fn between([start, first, second, end]: [StepNode<V>; 4], h: f64) -> FourPointHermite<V> {
        let place = |knot: &StepNode<V>, from: &StepNode<V>| InnerNode {
            displacement: knot.y.q - from.y.q,
            u: knot.y.u,
            a: knot.a,
        };
        FourPointHermite::new([&start, &end], &[place(&first, &start), place(&second, &end)], h)
    }

    #[test]
    fn knots_reproduce_a_polynomial_and_its_derivative() {
        let value = |order: u32, t: f64| -> f64 {
            let factor = |k: u32| (0..order).map(|i| f64::from(k) - f64::from(i)).product::<f64>();
            (0..12).map(|k| (f64::from(k) - 4.3) * factor(k) * t.powi(k as i32 - order as i32)).sum()
        };
        let (t0, h) = (-0.31, 0.9);
        let knot = |theta: f64| {
            let at = t0 + theta * h;
            let y = Phase { q: V::new(value(0, at)), u: V::new(value(1, at)) };
            StepNode { t: at, y, a: V::new(value(2, at)) }
        };
        let dense = between([0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0].map(knot), h);
        for theta in [0.0, 0.1, 1.0 / 3.0, 0.5, 0.77, 1.0] {
            let (y, t) = (dense.at(theta), t0 + theta * h);
            assert!((y.q[0] - value(0, t)).abs() < 1e-12, "{theta}");
            assert!((y.u[0] - value(1, t)).abs() < 1e-11, "{theta}");
            let slope = dense.slope(theta).unwrap();
            assert!((slope.q[0] - h * value(1, t)).abs() < 1e-11, "{theta}");
            assert!((slope.u[0] - h * value(2, t)).abs() < 1e-10, "{theta}");
        }
    }

    /// The distance of the ends is known to the rounding of q only: at 10⁸ a step of 10⁻³ had left four
    /// digits of u.
    #[test]
    fn rounding_of_positions_is_none_of_velocities() {
        for (origin, h, permitted) in [
            (0.0, 0.9, 1e-11),
            (0.0, 1e-3, 3e-13),
            (1e8, 0.9, 1e-10),
            (1e8, 1e-3, 3e-13),
            (-1e12, 1e-2, 3e-13),
        ] {
            let knot = |t: f64, origin: f64| StepNode {
                t,
                y: Phase { q: V::new(origin + t.sin()), u: V::new(t.cos()) },
                a: V::new(-t.sin()),
            };
            let (start, end) = (knot(0.7, origin), knot(0.7 + h, origin));
            let place = |theta: f64, from: f64| {
                let (at, from) = (0.7 + theta * h, 0.7 + from * h);
                // sin at − sin from, without what is common to both.
                let way = 2.0 * (0.5 * (at + from)).cos() * (0.5 * (at - from)).sin();
                InnerNode { displacement: V::new(way), u: V::new(at.cos()), a: V::new(-at.sin()) }
            };
            let dense =
                FourPointHermite::new([&start, &end], &[place(1.0 / 3.0, 0.0), place(2.0 / 3.0, 1.0)], h);
            for theta in [0.1, 0.3, 0.5, 0.8] {
                let (y, t) = (dense.at(theta), 0.7 + theta * h);
                assert!((y.u[0] - t.cos()).abs() < permitted, "{origin:e}, {h}: {:e}", y.u[0] - t.cos());
                assert!(
                    (y.q[0] - (origin + t.sin())).abs() < 1e-12 + 4e-16 * origin.abs(),
                    "{origin:e}, {h}"
                );
            }
            assert!((dense.at(1.0).q[0] - end.y.q[0]).abs() <= f64::EPSILON * end.y.q[0].abs());
        }
    }
}

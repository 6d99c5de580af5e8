//! Accelerations of derived models beside hand-written Rust: nanoseconds per call and the error of the
//! results in units of rounding. `cargo bench -p dynamics-benches --bench evaluation`; with
//! `RUSTFLAGS="-C target-cpu=native"` what the machine at hand can do.
//!
//! Every candidate is called through the same opaque pointer at states that the compiler cannot see.
//! Throughput is the time per call where calls do not wait for each other; latency that of a chain in which
//! each waits for the one before, as in most integrators.
//!
//! The machine decides the nanoseconds; the ratios inside one run are what can be compared. Other people's
//! work disturbs one way only, so that the quickest of many passes counts, taken in turn with those of the
//! other candidates.

#[path = "evaluation/arm.rs"]
mod arm;
#[path = "evaluation/by_hand.rs"]
mod by_hand;
#[macro_use]
#[path = "evaluation/models.rs"]
mod models;
#[path = "evaluation/long.rs"]
mod long;
#[path = "evaluation/loops.rs"]
mod loops;
#[path = "evaluation/real.rs"]
mod real;
#[path = "evaluation/states.rs"]
mod states;

use std::hint::black_box;
use std::sync::LazyLock;
use std::time::Instant;

use dynamics::model::{ModelState, Vector};
use dynamics::prelude::*;
use long::{Chain5Accurate, Chain10Accurate, Chain20, Chain50, DoublePendulumAccurate};
use models::{Chain5, Chain10, DoublePendulum};
use real::{Inlined, Pair, Real, Standard};
use states::{states, states_near};

/// Timed passes of each candidate.
const ROUNDS: usize = 300;
/// Nanoseconds of a pass, about.
const PASS: f64 = 0.2e6;

/// A state as [q, u].
pub(crate) type Place<const N: usize> = [[f64; N]; 2];

/// What every candidate is, ours and others': reads a state and writes q̈. In C,
/// `void function(const double *state, double *accelerations)`. It is called through a pointer that the
/// compiler cannot see through, so nobody's code is inlined into the loop that times it.
pub(crate) type Function<const N: usize> = extern "C" fn(&Place<N>, &mut [f64; N]);

/// One way to evaluate accelerations.
pub(crate) struct Candidate<const N: usize> {
    pub(crate) name: &'static str,
    pub(crate) function: Function<N>,
}

/// Somebody else's accelerations of models, where `benches/peers/evaluation` has them.
pub(crate) trait Others {
    fn of_model<const N: usize>(model: &str) -> Vec<Candidate<N>>;
}

/// Nobody else's.
pub(crate) struct Nobody;

impl Others for Nobody {
    fn of_model<const N: usize>(_: &str) -> Vec<Candidate<N>> {
        Vec::new()
    }
}

/// What a pass measures.
#[derive(Clone, Copy)]
enum Pass {
    /// All states one after the other, none of which depends on the results of another.
    Throughput,
    /// A chain: zero times the last accelerations is added to each state, so that it cannot begin before
    /// they are known.
    Latency,
}

/// Nanoseconds per call.
fn once<const N: usize>(function: Function<N>, places: &[Place<N>], pass: Pass, passes: usize) -> f64 {
    let (function, zero) = (black_box(function), black_box(0.0));
    let mut results = vec![[0.0; N]; places.len()];
    let mut last = [0.0; N];
    let start = Instant::now();
    for _ in 0..passes {
        match pass {
            Pass::Throughput => {
                for (place, result) in places.iter().zip(&mut results) {
                    function(place, result);
                }
                black_box(&mut results);
            }
            Pass::Latency => {
                for [q, u] in places {
                    let next = [q, u].map(|x| std::array::from_fn(|i| x[i] + zero * last[i]));
                    function(&next, &mut last);
                }
            }
        }
    }
    black_box(last);
    start.elapsed().as_secs_f64() * 1e9 / (passes * places.len()) as f64
}

/// Times the candidates and prints them beside each other; `exact` gives what is right, with 31 digits.
fn compare<O: Others, const N: usize>(
    model: &str,
    places: &[Place<N>],
    exact: &[[f64; N]],
    candidates: impl Into<Vec<Candidate<N>>>,
) {
    let mut candidates = candidates.into();
    candidates.extend(O::of_model(model));
    let kinds = [Pass::Throughput, Pass::Latency];
    let passes: Vec<[usize; 2]> = candidates
        .iter()
        .map(|candidate| {
            kinds.map(|kind| {
                let warm = once(candidate.function, places, kind, 20);
                ((PASS / (warm * places.len() as f64)) as usize).max(1)
            })
        })
        .collect();
    let mut best = vec![[f64::INFINITY; 2]; candidates.len()];
    for _ in 0..ROUNDS {
        for ((candidate, passes), best) in candidates.iter().zip(&passes).zip(&mut best) {
            for ((kind, passes), best) in kinds.into_iter().zip(passes).zip(best) {
                *best = best.min(once(candidate.function, places, kind, *passes));
            }
        }
    }
    for (candidate, [throughput, latency]) in candidates.iter().zip(&best) {
        let mut results = vec![[0.0; N]; places.len()];
        places.iter().zip(&mut results).for_each(|(place, result)| (candidate.function)(place, result));
        let (ratios, [error, worst]) =
            ([throughput / best[0][0], latency / best[0][1]], errors(&results, exact));
        println!(
            "{model:<16} {:<30} {throughput:>8.1} {:>6.2} {latency:>8.1} {:>6.2} {error:>7.1} {worst:>8.1}",
            candidate.name, ratios[0], ratios[1]
        );
    }
}

/// The largest difference at each state, in units of 2⁻⁵² of the state's largest acceleration: their
/// median, and the largest. NaN counts as large.
fn errors<const N: usize>(results: &[[f64; N]], exact: &[[f64; N]]) -> [f64; 2] {
    let of_state = |(result, exact): (&[f64; N], &[f64; N])| {
        let scale = exact.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let differences = result.iter().zip(exact).map(|(a, b)| (a - b).abs());
        differences.max_by(f64::total_cmp).unwrap_or(0.0) / (scale * f64::EPSILON)
    };
    let mut errors: Vec<f64> = results.iter().zip(exact).map(of_state).collect();
    errors.sort_by(f64::total_cmp);
    [errors[errors.len() / 2], errors[errors.len() - 1]]
}

/// A derived model as a candidate.
macro_rules! derived {
    ($name:literal, $Model:ty, $n:literal, $model:expr) => {{
        type Prepared = ($Model, <$Model as Dynamics>::Constants);
        static PREPARED: LazyLock<Prepared> = LazyLock::new(|| {
            let model = $model;
            let constants = model.constants().expect("a regular model");
            (model, constants)
        });
        extern "C" fn function(&[q, u]: &Place<$n>, result: &mut [f64; $n]) {
            let (model, constants) = &*PREPARED;
            let state = State::<$Model>::new(0.0, q.into(), u.into(), Default::default());
            *result = model.accelerations_with(constants, &state).map_or([f64::NAN; $n], Into::into);
        }
        Candidate { name: $name, function }
    }};
}

fn places<S: ModelState, const N: usize>(states: &[S]) -> Vec<Place<N>> {
    let array = |x: &S::Vector| Vector::as_slice(x).try_into().expect("N coordinates");
    states.iter().map(|state| [array(state.q()), array(state.u())]).collect()
}

/// A hand-written function of q and u as a candidate.
macro_rules! by_hand {
    ($name:expr, $n:literal, $written:expr) => {{
        extern "C" fn function([q, u]: &Place<$n>, result: &mut [f64; $n]) {
            *result = $written(&q.map(Real::of), &u.map(Real::of)).map(Real::to_f64);
        }
        Candidate { name: $name, function }
    }};
}

/// What is right.
fn exact<const N: usize>(
    places: &[Place<N>],
    function: impl Fn(&[Pair; N], &[Pair; N]) -> [Pair; N],
) -> Vec<[f64; N]> {
    places.iter().map(|[q, u]| function(&q.map(Pair::of), &u.map(Pair::of)).map(Real::to_f64)).collect()
}

fn double_pendulum<O: Others>() {
    let places = places(&states::<State<DoublePendulum>, 2>());
    compare::<O, _>(
        "double pendulum",
        &places,
        &exact(&places, by_hand::double_pendulum),
        [
            derived!(
                "derived",
                DoublePendulum,
                2,
                DoublePendulum { m1: 1.0, m2: 1.3, l1: 1.0, l2: 0.8, g: 9.81 }
            ),
            derived!(
                "derived, sin_cos = accurate",
                DoublePendulumAccurate,
                2,
                DoublePendulumAccurate { m1: 1.0, m2: 1.3, l1: 1.0, l2: 0.8, g: 9.81 }
            ),
            by_hand!("closed form, inlined sines", 2, by_hand::double_pendulum::<Inlined>),
            by_hand!("closed form", 2, by_hand::double_pendulum::<Standard>),
        ],
    );
}

/// A chain of links, with what else is a candidate.
macro_rules! compare_chain {
    ($others:ident, $model:ident, $links:literal, $n:literal, $name:literal $(, $accurate:ident)?) => {{
        macro_rules! chain {
            ($Model:ident) => {
                $Model {
                    cart: 2.0,
                    m: std::array::from_fn(by_hand::mass),
                    l: std::array::from_fn(by_hand::length),
                    g: 9.81,
                }
            };
        }
        let places = places(&states::<State<$model>, $n>());
        compare::<$others, _>(
            $name,
            &places,
            &exact(&places, by_hand::chain_tensions::<Pair, $links, $n>),
            [
                derived!("derived", $model, $n, chain!($model)),
                $(derived!("derived, sin_cos = accurate", $accurate, $n, chain!($accurate)),)?
                by_hand!(
                    "rod tensions, inlined sines",
                    $n,
                    by_hand::chain_tensions::<Inlined, $links, $n>
                ),
                by_hand!("rod tensions", $n, by_hand::chain_tensions::<Standard, $links, $n>),
                by_hand!("dense LDLᵀ", $n, by_hand::chain_dense::<Standard, $links, $n>),
            ],
        );
    }};
}

fn arm_of_seven_hinges<O: Others>() {
    let states_of = states::<State<arm::Arm>, 7>();
    let at = places(&states_of);
    compare::<O, _>(
        "arm",
        &at,
        &exact(&at, arm::in_the_world),
        [
            derived!("derived", arm::Arm, 7, arm::arm()),
            derived!("derived, sin_cos = accurate", arm::accurate::ArmAccurate, 7, arm::arm_accurate()),
            by_hand!("in the world, inlined sines", 7, arm::in_the_world::<Inlined>),
            by_hand!("in the world", 7, arm::in_the_world::<Standard>),
        ],
    );
    arm_for_control(&states_of);
}

/// Times what has nothing to be set beside it here.
fn alone<S>(model: &str, name: &str, states: &[S], mut evaluate: impl FnMut(&S)) {
    let passes = 50;
    let mut least = f64::INFINITY;
    for _ in 0..ROUNDS {
        let start = Instant::now();
        for state in (0..passes).flat_map(|_| states) {
            evaluate(black_box(state));
        }
        least = least.min(start.elapsed().as_secs_f64() * 1e9 / (passes * states.len()) as f64);
    }
    println!("{model:<16} {name:<30} {least:>8.1} ns");
}

/// What else is asked of an arm.
fn arm_for_control(states: &[State<arm::Arm>]) {
    let model = arm::arm();
    alone("arm", "inverse dynamics", states, |state| {
        black_box(model.inverse_dynamics(state, black_box(state.u())));
    });
    let (mut by_q, mut by_u) = ([0.0; 49], [0.0; 49]);
    alone("arm", "q̈ by q and q̇", states, |state| {
        black_box(model.acceleration_derivatives(state, &mut by_q, &mut by_u));
    });
}

fn mechanisms<O: Others>() {
    let states_of = states_near::<State<loops::andrews::Andrews>, 7>(&loops::andrews::START, 0.05);
    let at = places(&states_of);
    compare::<O, _>(
        "Andrews",
        &at,
        &exact(&at, loops::andrews_loops),
        [
            derived!("derived", loops::andrews::Andrews, 7, loops::andrews::PUBLISHED),
            by_hand!("loop by loop, inlined sines", 7, loops::andrews_loops::<Inlined>),
            by_hand!("loop by loop", 7, loops::andrews_loops::<Standard>),
            by_hand!("whole matrix, LU", 7, loops::andrews_whole),
        ],
    );
    let states_of = states_near::<State<loops::SliderCrank>, 3>(&loops::SLIDER_START, 0.3);
    let at = places(&states_of);
    compare::<O, _>(
        "slider-crank",
        &at,
        &exact(&at, loops::slider_loops),
        [
            derived!("derived", loops::SliderCrank, 3, loops::slider_crank()),
            by_hand!("loop by loop, inlined sines", 3, loops::slider_loops::<Inlined>),
            by_hand!("loop by loop", 3, loops::slider_loops::<Standard>),
            by_hand!("whole matrix, LU", 3, loops::slider_whole),
        ],
    );
}

/// All tables, with the others' accelerations among the candidates.
pub(crate) fn tables<O: Others>() {
    println!("nanoseconds per call; errors at {} states, in eps of the largest", states::STATES);
    println!("acceleration there; ratios to the first line of each model");
    println!(
        "{:<16} {:<30} {:>8} {:>6} {:>8} {:>6} {:>7} {:>8}",
        "model", "accelerations", "through.", "ratio", "latency", "ratio", "median", "largest"
    );
    double_pendulum::<O>();
    compare_chain!(O, Chain5, 5, 6, "chain 5", Chain5Accurate);
    compare_chain!(O, Chain10, 10, 11, "chain 10", Chain10Accurate);
    compare_chain!(O, Chain20, 20, 21, "chain 20");
    compare_chain!(O, Chain50, 50, 51, "chain 50");
    arm_of_seven_hinges::<O>();
    mechanisms::<O>();
}

#[allow(dead_code, reason = "`benches/peers/evaluation` has its own")]
fn main() {
    tables::<Nobody>();
}

//! Accelerations of derived models beside hand-written Rust: nanoseconds per call and the error of the
//! results in units of rounding. `cargo bench -p dynamics-benches --bench evaluation`; with
//! `RUSTFLAGS="-C target-cpu=native"` what the machine at hand can do.
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
use std::sync::OnceLock;
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
const PASS: f64 = 0.5e6;

/// A state as (q, u).
type Place<const N: usize> = ([f64; N], [f64; N]);

/// Writes the accelerations at all states, one after the other as an integrator asks for them: each is a
/// black box, or two would be evaluated side by side.
type Evaluate<const N: usize> = Box<dyn Fn(&mut [[f64; N]])>;

/// One way to evaluate accelerations.
struct Candidate<const N: usize> {
    name: &'static str,
    evaluate: Evaluate<N>,
}

/// Reads q and u and writes q̈.
pub(crate) type Run = dyn Fn(&[f64], &[f64], &mut [f64]);

/// Somebody else's accelerations of a model.
pub(crate) struct Other {
    pub(crate) name: &'static str,
    pub(crate) run: Box<Run>,
}

/// Gives those of a model, where `benches/peers/evaluation` has set it.
pub(crate) static OTHERS: OnceLock<fn(&str) -> Vec<Other>> = OnceLock::new();

/// The others of a model as candidates.
fn others<const N: usize>(model: &str, places: &[Place<N>]) -> Vec<Candidate<N>> {
    let known = OTHERS.get().map_or_else(Vec::new, |others| others(model));
    let candidate = |Other { name, run }: Other| {
        let places = places.to_vec();
        Candidate {
            name,
            evaluate: Box::new(move |results: &mut [[f64; N]]| {
                for ((q, u), result) in places.iter().map(black_box).zip(results) {
                    run(q, u, result);
                }
            }),
        }
    };
    known.into_iter().map(candidate).collect()
}

/// Times the candidates and prints them beside each other; `exact` gives what is right, with 31 digits.
fn compare<const N: usize>(
    model: &str,
    places: &[Place<N>],
    exact: &[[f64; N]],
    candidates: impl Into<Vec<Candidate<N>>>,
) {
    let mut candidates = candidates.into();
    candidates.extend(others(model, places));
    let mut results = vec![vec![[0.0; N]; exact.len()]; candidates.len()];
    let once = |index: usize, result: &mut Vec<[f64; N]>, passes: usize| {
        let start = Instant::now();
        for _ in 0..passes {
            (candidates[index].evaluate)(black_box(result));
        }
        start.elapsed().as_secs_f64() * 1e9 / (passes * exact.len()) as f64
    };
    let mut best = vec![f64::INFINITY; candidates.len()];
    let passes: Vec<usize> = (0..candidates.len())
        .map(|index| {
            let warm = once(index, &mut results[index], 20);
            ((PASS / (warm * exact.len() as f64)) as usize).max(1)
        })
        .collect();
    for _ in 0..ROUNDS {
        for index in 0..candidates.len() {
            best[index] = best[index].min(once(index, &mut results[index], passes[index]));
        }
    }
    for (index, candidate) in candidates.iter().enumerate() {
        let (ratio, [error, worst]) = (best[index] / best[0], errors(&results[index], exact));
        println!(
            "{model:<16} {:<30} {:>8.1} ns {ratio:>6.2} {error:>6.1} {worst:>8.1}",
            candidate.name, best[index]
        );
    }
}

/// The largest difference at each state, in units of 2⁻⁵² of the state's largest acceleration: their median,
/// and the largest. NaN counts as large.
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
    ($name:literal, $model:expr, $states:expr) => {{
        let (model, states) = ($model, $states);
        let constants = model.constants().expect("a regular model");
        Candidate {
            name: $name,
            evaluate: Box::new(move |results| {
                for (state, result) in states.iter().zip(results) {
                    *result = model
                        .accelerations_with(&constants, black_box(state))
                        .map_or([f64::NAN; _], Into::into);
                }
            }),
        }
    }};
}

fn places<S: ModelState, const N: usize>(states: &[S]) -> Vec<Place<N>> {
    let array = |x: &S::Vector| Vector::as_slice(x).try_into().expect("N coordinates");
    states.iter().map(|state| (array(state.q()), array(state.u()))).collect()
}

/// A hand-written function of (q, u) as a candidate.
fn by_hand<T: Real + 'static, const N: usize>(
    name: &'static str,
    places: &[Place<N>],
    function: impl Fn(&[T; N], &[T; N]) -> [T; N] + 'static,
) -> Candidate<N> {
    let places: Vec<([T; N], [T; N])> = places.iter().map(|(q, u)| (q.map(T::of), u.map(T::of))).collect();
    Candidate {
        name,
        evaluate: Box::new(move |results| {
            for ((q, u), result) in places.iter().map(black_box).zip(results) {
                *result = function(q, u).map(Real::to_f64);
            }
        }),
    }
}

/// What is right.
fn exact<const N: usize>(
    places: &[Place<N>],
    function: impl Fn(&[Pair; N], &[Pair; N]) -> [Pair; N],
) -> Vec<[f64; N]> {
    places.iter().map(|(q, u)| function(&q.map(Pair::of), &u.map(Pair::of)).map(Real::to_f64)).collect()
}

fn double_pendulum() {
    let model = DoublePendulum { m1: 1.0, m2: 1.3, l1: 1.0, l2: 0.8, g: 9.81 };
    let accurate = DoublePendulumAccurate { m1: 1.0, m2: 1.3, l1: 1.0, l2: 0.8, g: 9.81 };
    let states_of = states::<State<DoublePendulum>, 2>();
    let places = places(&states_of);
    compare(
        "double pendulum",
        &places,
        &exact(&places, by_hand::double_pendulum),
        [
            derived!("derived", model, states_of),
            derived!("derived, sin_cos = accurate", accurate, states::<State<DoublePendulumAccurate>, 2>()),
            by_hand("closed form, inlined sines", &places, by_hand::double_pendulum::<Inlined>),
            by_hand("closed form", &places, by_hand::double_pendulum::<Standard>),
        ],
    );
}

/// A chain of links, with what else is a candidate.
macro_rules! compare_chain {
    ($model:ident, $links:literal, $n:literal, $name:literal $(, $accurate:ident)?) => {{
        let (m, l) = (std::array::from_fn(by_hand::mass), std::array::from_fn(by_hand::length));
        let states_of = states::<State<$model>, $n>();
        let places = places(&states_of);
        compare(
            $name,
            &places,
            &exact(&places, by_hand::chain_tensions::<Pair, $links, $n>),
            [
                derived!("derived", $model { cart: 2.0, m, l, g: 9.81 }, states_of),
                $(derived!(
                    "derived, sin_cos = accurate",
                    $accurate { cart: 2.0, m, l, g: 9.81 },
                    states::<State<$accurate>, $n>()
                ),)?
                by_hand("rod tensions, inlined \
                    sines", &places, by_hand::chain_tensions::<Inlined, $links, $n>),
                by_hand("rod tensions", &places, by_hand::chain_tensions::<Standard, $links, $n>),
                by_hand("dense LDLᵀ", &places, by_hand::chain_dense::<Standard, $links, $n>),
            ],
        );
    }};
}

fn arm_of_seven_hinges() {
    let states_of = states::<State<arm::Arm>, 7>();
    let at = places(&states_of);
    compare(
        "arm",
        &at,
        &exact(&at, arm::in_the_world),
        [
            derived!("derived", arm::arm(), states_of.clone()),
            derived!(
                "derived, sin_cos = accurate",
                arm::arm_accurate(),
                states::<State<arm::accurate::ArmAccurate>, 7>()
            ),
            by_hand("in the world, inlined sines", &at, arm::in_the_world::<Inlined>),
            by_hand("in the world", &at, arm::in_the_world::<Standard>),
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

fn mechanisms() {
    let states_of = states_near::<State<loops::andrews::Andrews>, 7>(&loops::andrews::START, 0.05);
    let at = places(&states_of);
    compare(
        "Andrews",
        &at,
        &exact(&at, loops::andrews_loops),
        [
            derived!("derived", loops::andrews::PUBLISHED, states_of),
            by_hand("loop by loop, inlined sines", &at, loops::andrews_loops::<Inlined>),
            by_hand("loop by loop", &at, loops::andrews_loops::<Standard>),
            by_hand("whole matrix, LU", &at, loops::andrews_whole),
        ],
    );
    let states_of = states_near::<State<loops::SliderCrank>, 3>(&loops::SLIDER_START, 0.3);
    let at = places(&states_of);
    compare(
        "slider-crank",
        &at,
        &exact(&at, loops::slider_loops),
        [
            derived!("derived", loops::slider_crank(), states_of),
            by_hand("loop by loop, inlined sines", &at, loops::slider_loops::<Inlined>),
            by_hand("loop by loop", &at, loops::slider_loops::<Standard>),
            by_hand("whole matrix, LU", &at, loops::slider_whole),
        ],
    );
}

pub(crate) fn main() {
    println!("errors at {} states, in eps of the largest acceleration there", states::STATES);
    println!(
        "{:<16} {:<30} {:>11} {:>6} {:>6} {:>8}",
        "model", "accelerations", "time", "ratio", "median", "largest"
    );
    double_pendulum();
    compare_chain!(Chain5, 5, 6, "chain 5", Chain5Accurate);
    compare_chain!(Chain10, 10, 11, "chain 10", Chain10Accurate);
    compare_chain!(Chain20, 20, 21, "chain 20");
    compare_chain!(Chain50, 50, 51, "chain 50");
    arm_of_seven_hinges();
    mechanisms();
}

//! Accelerations of derived models beside hand-written Rust: nanoseconds per call, medians of one interleaved run, and the difference
//! of the results. `cargo bench --bench evaluation`.
//!
//! The machine decides the nanoseconds; the ratios inside one run are what can be compared.

#[path = "evaluation/by_hand.rs"]
mod by_hand;
#[path = "evaluation/loops.rs"]
mod loops;
#[path = "evaluation/models.rs"]
mod models;
#[path = "evaluation/states.rs"]
mod states;

use std::hint::black_box;
use std::time::Instant;

use dynamics::model::Vector;
use dynamics::prelude::*;
use models::{Chain5, Chain10, DoublePendulum};
use states::{states, states_near};

/// Timed passes of each candidate; the median counts.
const ROUNDS: usize = 61;

/// Writes the accelerations at some states, one after the other as an integrator asks for them: each is a black box, or two would be
/// evaluated side by side.
type Evaluate<'a, S, const N: usize> = dyn Fn(&[S], &mut [[f64; N]]) + 'a;

/// One way to evaluate accelerations at a state given as q and u.
struct Candidate<'a, S, const N: usize> {
    name: &'static str,
    evaluate: Box<Evaluate<'a, S, N>>,
}

fn compare<S, const N: usize>(model: &str, states: &[S], candidates: &[Candidate<'_, S, N>]) {
    let mut results = vec![vec![[0.0; N]; states.len()]; candidates.len()];
    for (candidate, result) in candidates.iter().zip(&mut results) {
        (candidate.evaluate)(states, result);
    }
    let once = |index: usize, result: &mut Vec<[f64; N]>, passes: usize| {
        let start = Instant::now();
        for _ in 0..passes {
            (candidates[index].evaluate)(black_box(states), black_box(result));
        }
        start.elapsed().as_secs_f64() * 1e9 / (passes * states.len()) as f64
    };
    let warm = once(0, &mut results[0], 20);
    let passes = ((1.0e6 / (warm * states.len() as f64)) as usize).max(1);
    let mut times = vec![Vec::with_capacity(ROUNDS); candidates.len()];
    for _ in 0..ROUNDS {
        for index in 0..candidates.len() {
            let time = once(index, &mut results[index], passes);
            times[index].push(time);
        }
    }
    let medians: Vec<f64> = times
        .iter_mut()
        .map(|times| {
            times.sort_by(f64::total_cmp);
            times[ROUNDS / 2]
        })
        .collect();
    for (index, candidate) in candidates.iter().enumerate() {
        let scale = results[0].iter().flatten().fold(0.0f64, |m, x| m.max(x.abs()));
        let error = results[index]
            .iter()
            .flatten()
            .zip(results[0].iter().flatten())
            .fold(0.0f64, |m, (a, b)| m.max((a - b).abs() / scale));
        println!(
            "{model:<16} {:<28} {:>8.1} ns {:>6.2} {:>10.1e}",
            candidate.name,
            medians[index],
            medians[index] / medians[0],
            error
        );
    }
}

/// The derived model as a candidate.
macro_rules! derived {
    ($model:expr, $n:literal) => {{
        let constants = $model.constants().expect("a regular model");
        Candidate::<_, $n> {
            name: "derived",
            evaluate: Box::new(move |states, results| {
                for (state, result) in states.iter().zip(results) {
                    match $model.accelerations_with(&constants, black_box(state)) {
                        Ok(a) => *result = a.into(),
                        Err(_) => *result = [f64::NAN; $n],
                    }
                }
            }),
        }
    }};
}

/// A hand-written function of (q, u) as a candidate.
fn by_hand<S: ModelState, const N: usize>(
    name: &'static str,
    function: impl Fn(&[f64; N], &[f64; N]) -> [f64; N] + 'static,
) -> Candidate<'static, S, N> {
    Candidate {
        name,
        evaluate: Box::new(move |states, results| {
            for (state, result) in states.iter().map(black_box).zip(results) {
                let (q, u) = (Vector::as_slice(state.q()), Vector::as_slice(state.u()));
                *result = function(q.try_into().expect("N coordinates"), u.try_into().expect("N velocities"));
            }
        }),
    }
}

fn main() {
    println!("{:<16} {:<28} {:>11} {:>6} {:>10}", "model", "accelerations", "time", "ratio", "difference");
    let model = &DoublePendulum { m1: 1.0, m2: 1.3, l1: 1.0, l2: 0.8, g: 9.81 };
    compare(
        "double pendulum",
        &states::<State<DoublePendulum>, 2>(),
        &[derived!(model, 2), by_hand("by hand, closed form", by_hand::double_pendulum)],
    );
    let model =
        &Chain5 { cart: 2.0, m: std::array::from_fn(by_hand::mass), l: std::array::from_fn(by_hand::length), g: 9.81 };
    compare(
        "chain 5",
        &states::<State<Chain5>, 6>(),
        &[
            derived!(model, 6),
            by_hand("by hand, dense LDLᵀ", by_hand::chain_dense::<5, 6>),
            by_hand("by hand, rod tensions", by_hand::chain_tensions::<5, 6>),
        ],
    );
    let model =
        &Chain10 { cart: 2.0, m: std::array::from_fn(by_hand::mass), l: std::array::from_fn(by_hand::length), g: 9.81 };
    compare(
        "chain 10",
        &states::<State<Chain10>, 11>(),
        &[
            derived!(model, 11),
            by_hand("by hand, dense LDLᵀ", by_hand::chain_dense::<10, 11>),
            by_hand("by hand, rod tensions", by_hand::chain_tensions::<10, 11>),
        ],
    );
    let model = &loops::andrews::PUBLISHED;
    compare(
        "Andrews",
        &states_near::<State<loops::andrews::Andrews>, 7>(&loops::andrews::START, 0.05),
        &[
            derived!(model, 7),
            by_hand("by hand, whole matrix, LU", loops::andrews_whole),
            by_hand("by hand, loop by loop", loops::andrews_loops),
        ],
    );
    let model = &loops::slider_crank();
    compare(
        "slider-crank",
        &states_near::<State<loops::SliderCrank>, 3>(&loops::SLIDER_START, 0.3),
        &[
            derived!(model, 3),
            by_hand("by hand, whole matrix, LU", loops::slider_whole),
            by_hand("by hand, loop by loop", loops::slider_loops),
        ],
    );
}

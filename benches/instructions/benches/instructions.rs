//! Instructions of evaluations and motions: they are the same on every run, where times are not. `run.sh` of
//! this package runs it.
#![allow(clippy::duplicate_mod, reason = "models are included where they are used")]

#[path = "../../evaluation/by_hand.rs"]
#[allow(dead_code, reason = "masses and lengths are wanted here, not what is timed beside")]
mod by_hand;
mod counts;
#[path = "../../evaluation/loops.rs"]
#[allow(dead_code, reason = "the models are wanted here, not what is timed beside")]
mod loops;
#[path = "../../evaluation/models.rs"]
mod models;
#[path = "../../evaluation/real.rs"]
#[allow(dead_code, reason = "what is timed beside runs on it")]
mod real;
#[path = "../../evaluation/states.rs"]
mod states;
#[path = "../../../tests/models/work_precision.rs"]
#[allow(unused_imports, reason = "one of its models is wanted here")]
mod stiff;

use std::hint::black_box;

use dynamics::prelude::*;
use gungraun::{
    Callgrind, EventKind, LibraryBenchmarkConfig, library_benchmark, library_benchmark_group, main,
};
use loops::SliderCrank;
use loops::andrews::Andrews;
use models::{Chain5, Chain10, DoublePendulum};
use states::{states, states_near};
use stiff::StiffSpring;

/// Fails where a count grows by more than the tolerance.
fn at_most(count: u64) -> LibraryBenchmarkConfig {
    let mut callgrind = Callgrind::default();
    callgrind.hard_limits([(EventKind::Ir, count + count * counts::TOLERANCE / 100)]);
    LibraryBenchmarkConfig::default().tool(callgrind).clone()
}

/// A model with its constants and states.
struct Evaluated<M: Simulate> {
    model: M,
    constants: M::Constants,
    states: Vec<M::State>,
}

fn evaluated<M: Simulate>(model: M, states: Vec<M::State>) -> Evaluated<M> {
    Evaluated { constants: model.constants().expect("a regular model"), model, states }
}

fn accelerations<M: Simulate>(all: &Evaluated<M>) {
    for state in &all.states {
        let _ = black_box(all.model.accelerations_with(&all.constants, black_box(state)));
    }
}

fn double_pendulum() -> DoublePendulum {
    DoublePendulum { m1: 1.0, m2: 1.3, l1: 1.0, l2: 0.8, g: 9.81 }
}

fn two_links() -> Evaluated<DoublePendulum> {
    evaluated(double_pendulum(), states::<_, 2>())
}

fn chain_5() -> Evaluated<Chain5> {
    let (m, l) = (std::array::from_fn(by_hand::mass), std::array::from_fn(by_hand::length));
    evaluated(Chain5 { cart: 2.0, m, l, g: 9.81 }, states::<_, 6>())
}

fn chain_10() -> Evaluated<Chain10> {
    let (m, l) = (std::array::from_fn(by_hand::mass), std::array::from_fn(by_hand::length));
    evaluated(Chain10 { cart: 2.0, m, l, g: 9.81 }, states::<_, 11>())
}

#[library_benchmark]
#[bench::all(args = (two_links()), config = at_most(counts::DOUBLE_PENDULUM))]
fn evaluate_double_pendulum(all: Evaluated<DoublePendulum>) {
    accelerations(&all);
}

#[library_benchmark]
#[bench::all(args = (chain_5()), config = at_most(counts::CHAIN_5))]
fn evaluate_chain_5(all: Evaluated<Chain5>) {
    accelerations(&all);
}

#[library_benchmark]
#[bench::all(args = (chain_10()), config = at_most(counts::CHAIN_10))]
fn evaluate_chain_10(all: Evaluated<Chain10>) {
    accelerations(&all);
}

#[library_benchmark]
#[bench::all(
    args = (evaluated(loops::andrews::PUBLISHED, states_near(&loops::andrews::START, 0.05))),
    config = at_most(counts::ANDREWS)
)]
fn evaluate_andrews(all: Evaluated<Andrews>) {
    accelerations(&all);
}

#[library_benchmark]
#[bench::all(
    args = (evaluated(loops::slider_crank(), states_near(&loops::SLIDER_START, 0.3))),
    config = at_most(counts::SLIDER_CRANK)
)]
fn evaluate_slider_crank(all: Evaluated<SliderCrank>) {
    accelerations(&all);
}

/// A motion of which nothing is kept.
fn moved<M: Simulate>(model: &M, start: M::State, end: f64, method: methods::Any<M>, tolerance: f64) {
    let simulation = model.simulate(start).until(end).method(method).tolerance(tolerance);
    black_box(simulation.run_with(|_| {}).map_err(|error| error.to_string()).expect("it ends"));
}

fn swinging() -> (DoublePendulum, State<DoublePendulum>) {
    let model = double_pendulum();
    let start = model.state().theta1(1.5).theta2(1.0).build().expect("finite values");
    (model, start)
}

fn squeezing() -> (Andrews, State<Andrews>) {
    let model = loops::andrews::PUBLISHED;
    let [beta, theta, gamma, phi, delta, omega, epsilon] = loops::andrews::START;
    let start = model
        .state()
        .beta(beta)
        .theta(theta)
        .gamma(gamma)
        .phi(phi)
        .delta(delta)
        .omega(omega)
        .epsilon(epsilon);
    let start = start.build().expect("it is assembled");
    (model, start)
}

fn stiff_spring() -> (StiffSpring, State<StiffSpring>) {
    let model = StiffSpring { mass: 1.0, stiffness: 1e8, damping: 2e4, length: 1.0, g: 9.81 };
    let start = model.state().x(1.0).build().expect("finite values");
    (model, start)
}

#[library_benchmark]
#[bench::all(args = (swinging()), config = at_most(counts::DOP853_DOUBLE_PENDULUM))]
fn dop853_double_pendulum((model, start): (DoublePendulum, State<DoublePendulum>)) {
    moved(&model, start, 2.0, methods::Dop853.into(), 1e-9);
}

#[library_benchmark]
#[bench::all(args = (swinging()), config = at_most(counts::TAYLOR_DOUBLE_PENDULUM))]
fn taylor_double_pendulum((model, start): (DoublePendulum, State<DoublePendulum>)) {
    moved(&model, start, 2.0, methods::Taylor::default().into(), 1e-12);
}

#[library_benchmark]
#[bench::all(args = (squeezing()), config = at_most(counts::DOP853_ANDREWS))]
fn dop853_andrews((model, start): (Andrews, State<Andrews>)) {
    moved(&model, start, 0.01, methods::Dop853.into(), 1e-6);
}

#[library_benchmark]
#[bench::all(args = (stiff_spring()), config = at_most(counts::RADAU5_SPRING))]
fn radau5_stiff_spring((model, start): (StiffSpring, State<StiffSpring>)) {
    moved(&model, start, 0.5, methods::Radau5.into(), 1e-6);
}

library_benchmark_group!(
    name = evaluation;
    benchmarks =
        evaluate_double_pendulum,
        evaluate_chain_5,
        evaluate_chain_10,
        evaluate_andrews,
        evaluate_slider_crank
);
library_benchmark_group!(
    name = integration;
    benchmarks = dop853_double_pendulum, taylor_double_pendulum, dop853_andrews, radau5_stiff_spring
);
main!(library_benchmark_groups = evaluation, integration);

//! Accelerations and motions, timed by Criterion: what has changed since the last run on this machine.
//! `cargo bench -p dynamics-benches --bench criterion`.
//!
//! Ratios beside code by hand, with errors, are in `evaluation`, which takes its candidates in turn; error
//! against cost of the methods is in `examples/work_precision.rs`; what does not depend on the machine's
//! mood, instructions, in `benches/instructions/`.

#[path = "evaluation/by_hand.rs"]
#[allow(dead_code, reason = "masses and lengths are wanted here, not what is timed beside")]
mod by_hand;
#[path = "../tests/models/kepler.rs"]
mod kepler;
#[path = "evaluation/loops.rs"]
#[allow(dead_code, reason = "the models are wanted here, not what is timed beside")]
mod loops;
#[path = "evaluation/models.rs"]
mod models;
#[path = "evaluation/real.rs"]
#[allow(dead_code, reason = "what is timed beside runs on it")]
mod real;
#[path = "evaluation/states.rs"]
mod states;

use std::hint::black_box;
use std::time::Duration;

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main};
use dynamics::analysis::{Banded, lowest_modes};
use dynamics::prelude::*;
use kepler::Kepler;
use models::{Chain5, Chain10, DoublePendulum};
use states::{states, states_near};

/// Accelerations at all states, one after the other as an integrator asks for them.
fn accelerations<M: Simulate>(
    group: &mut BenchmarkGroup<'_, WallTime>,
    name: &str,
    model: &M,
    states: &[M::State],
) {
    let constants = model.constants().expect("a regular model");
    group.throughput(Throughput::Elements(states.len() as u64));
    group.bench_function(name, |bencher| {
        bencher.iter(|| {
            for state in states {
                let _ = black_box(model.accelerations_with(&constants, black_box(state)));
            }
        });
    });
}

fn evaluation(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("evaluation");
    let model = DoublePendulum { m1: 1.0, m2: 1.3, l1: 1.0, l2: 0.8, g: 9.81 };
    accelerations(&mut group, "double pendulum", &model, &states::<_, 2>());
    let (m, l) = (std::array::from_fn(by_hand::mass), std::array::from_fn(by_hand::length));
    accelerations(&mut group, "chain 5", &Chain5 { cart: 2.0, m, l, g: 9.81 }, &states::<_, 6>());
    let (m, l) = (std::array::from_fn(by_hand::mass), std::array::from_fn(by_hand::length));
    accelerations(&mut group, "chain 10", &Chain10 { cart: 2.0, m, l, g: 9.81 }, &states::<_, 11>());
    let near = states_near(&loops::andrews::START, 0.05);
    accelerations(&mut group, "Andrews", &loops::andrews::PUBLISHED, &near);
    accelerations(
        &mut group,
        "slider-crank",
        &loops::slider_crank(),
        &states_near(&loops::SLIDER_START, 0.3),
    );
    group.finish();
}

/// A motion of which nothing is kept, by methods at two tolerances.
fn motion<M: Simulate>(
    group: &mut BenchmarkGroup<'_, WallTime>,
    name: &str,
    model: &M,
    start: M::State,
    end: f64,
) {
    for method in
        [methods::Dop853.into(), methods::DormandPrince5.into(), methods::Any::from(methods::Radau5)]
    {
        for tolerance in [1e-6, 1e-9] {
            let simulation = || model.simulate(start).until(end).method(&method).tolerance(tolerance);
            group.bench_function(format!("{name}, {method} at {tolerance:e}"), |bencher| {
                bencher.iter(|| {
                    simulation().run_with(|_| {}).map_err(|error| error.to_string()).expect("it ends")
                });
            });
        }
    }
}

fn integration(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("integration");
    let model = DoublePendulum { m1: 1.0, m2: 1.3, l1: 1.0, l2: 0.8, g: 9.81 };
    let start = model.state().theta1(1.5).theta2(1.0).build().expect("finite values");
    motion(&mut group, "double pendulum, 10 s", &model, start, 10.0);
    let model = Kepler { mu: 1.0 };
    let start = model.state().x(0.1).y_rate(19f64.sqrt()).build().expect("finite values");
    motion(&mut group, "Kepler e = 0.9, t = 20", &model, start, 20.0);
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
    motion(&mut group, "Andrews, 0.03 s", &model, start.build().expect("it is assembled"), 0.03);
    group.finish();
}

/// The 20 lowest modes of a chain of 1,000 masses.
fn vibration(criterion: &mut Criterion) {
    let (mass, mut stiffness) = (Banded::diagonal(&[1.0; 1000]), Banded::zeros(1000, 1));
    for i in 0..1000 {
        stiffness.add(i, i, 2.0).expect("on the diagonal");
        if i > 0 {
            stiffness.add(i, i - 1, -1.0).expect("beside the diagonal");
        }
    }
    criterion.bench_function("vibration/20 modes of 1,000 masses", |bencher| {
        bencher.iter(|| lowest_modes(&mass, &stiffness, 20).expect("a definite chain"));
    });
}

criterion_group! {
    name = all;
    config = Criterion::default()
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(2));
    targets = evaluation, integration, vibration
}
criterion_main!(all);

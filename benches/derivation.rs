//! Deriving models, checks and texts included, timed by Criterion: what a macro costs while a program is
//! compiled. `cargo bench -p dynamics-benches --bench derivation`.

#[path = "../dynamics-symbolic/tests/common/mod.rs"]
mod common;

use std::hint::black_box;
use std::time::Duration;

use common::mechanisms::{andrews, slider_crank};
use common::{arm, chain, double_pendulum, rods};
use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use dynamics_symbolic::compile::compile;
use dynamics_symbolic::mechanics::Model;

fn derivation(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("derivation");
    let mut derive = |name: &str, model: fn() -> Model| {
        group.bench_function(name, |bencher| {
            bencher.iter_batched(
                model,
                |model| black_box(compile(model).expect("a good model")),
                BatchSize::LargeInput,
            );
        });
    };
    derive("double pendulum", double_pendulum);
    derive("chain 5", || chain(5));
    derive("chain 10", || chain(10));
    derive("chain 20", || chain(20));
    derive("chain 100", || chain(100));
    derive("rods 100", || rods(100));
    derive("rods 400", || rods(400));
    derive("arm 4", || arm(4));
    derive("slider-crank", || slider_crank().closed());
    derive("Andrews", || andrews().closed());
    group.finish();
}

criterion_group! {
    name = all;
    config = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(3));
    targets = derivation
}
criterion_main!(all);

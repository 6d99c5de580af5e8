//! Orders of all methods, and that steps do not allocate.

use dynamics_families::model::FamilyState;
use dynamics_families::{Every, FamilyMethod, SimulateFamilies};

use crate::common::{GuitarString, Lattice, state};

const SPLITTINGS: [FamilyMethod; 4] = [
    FamilyMethod::StormerVerlet,
    FamilyMethod::Composition4,
    FamilyMethod::Composition6,
    FamilyMethod::Composition8,
];
const RUNGE_KUTTA: [FamilyMethod; 3] =
    [FamilyMethod::Rk4, FamilyMethod::DormandPrince5, FamilyMethod::Dop853];

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0f64, |most, (a, b)| most.max((a - b).abs()))
}

/// Halved steps have 2^−order of the error.
#[test]
fn methods_have_their_orders() {
    let lattice = Lattice { masses: 6, alpha: 0.25 };
    let start = state(&lattice, |i| (i as f64).sin(), |i| (2.0 * i as f64).cos());
    let exact = lattice.simulate(start.clone()).until(3.0).tolerance(1e-14).run().expect("runs");
    for method in SPLITTINGS.into_iter().chain(RUNGE_KUTTA) {
        let steps = match method.order() {
            2 => 100.0,
            4 => 30.0,
            5 | 6 => 16.0,
            _ => 8.0,
        };
        let error = |steps: f64| {
            let run = lattice.simulate(start.clone()).until(3.0).method(method).fixed_step(3.0 / steps);
            let end = run.record(Every::Last).run().expect("runs");
            distance(end.end().q(), exact.end().q())
        };
        let (coarse, fine) = (error(steps), error(2.0 * steps));
        let order = (coarse / fine).log2();
        let expected = f64::from(method.order());
        assert!(
            order > expected - 0.45 && order < expected + 1.0,
            "{method}: order {order:.2}, {coarse:e} {fine:e}"
        );
    }
}

/// With damping, two fields and an input: Runge–Kutta methods agree.
#[test]
fn methods_agree_on_a_damped_string() {
    let string = GuitarString::uniform(12);
    let pi = core::f64::consts::PI;
    let pull = |i: usize| if i < 12 { 0.0 } else { 0.05 * (pi * (i - 11) as f64 / 13.0).sin() };
    let start = state(&string, pull, |_| 0.0);
    let simulate = || string.simulate(start.clone()).until(1.0).inputs(|t, _| [0.01 * (3.0 * t).sin()]);
    let exact = simulate().tolerance(1e-13).run().expect("runs");
    let five = simulate().tolerance(1e-6).run().expect("runs");
    assert_eq!((exact.method(), five.method()), (FamilyMethod::Dop853, FamilyMethod::DormandPrince5));
    assert!(distance(five.end().q(), exact.end().q()) < 1e-5);
    let four = simulate().fixed_step(1e-3).run().expect("runs");
    assert_eq!(four.method(), FamilyMethod::Rk4);
    assert!(distance(four.end().q(), exact.end().q()) < 1e-8);
    // Back in time, through the same states.
    let back = string.simulate(exact.end().clone()).until(0.0).inputs(|t, _| [0.01 * (3.0 * t).sin()]);
    let back = back.tolerance(1e-13).run().expect("runs");
    assert!(distance(back.end().q(), start.q()) < 1e-9);
}

/// A hundred times as many steps allocate no more.
#[test]
fn steps_do_not_allocate() {
    let lattice = Lattice { masses: 40, alpha: 0.25 };
    let start = state(&lattice, |i| (i as f64).sin(), |_| 0.0);
    let count = |method: FamilyMethod, steps: f64| {
        let start = start.clone();
        let info = allocation_counter::measure(|| {
            let run = lattice.simulate(start).until(0.01 * steps).method(method).fixed_step(0.01);
            assert!(run.record(Every::Last).run().is_ok());
        });
        info.count_total
    };
    for method in SPLITTINGS.into_iter().chain(RUNGE_KUTTA) {
        assert_eq!(count(method, 10.0), count(method, 1000.0), "{method}");
    }
    let adaptive = |until: f64| {
        let start = start.clone();
        let info = allocation_counter::measure(|| {
            assert!(lattice.simulate(start).until(until).record(Every::Last).run().is_ok());
        });
        info.count_total
    };
    assert_eq!(adaptive(1.0), adaptive(30.0));
}

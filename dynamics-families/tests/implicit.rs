//! Implicit methods: order, stability far beyond the waves of the grid, invariants, damping.

use dynamics_families::model::FamilyState;
use dynamics_families::{Every, FamilyMethod, SimulateFamilies, methods};

use crate::common::{Bar, GuitarString, Lattice, state};

const METHODS: [FamilyMethod; 4] = [
    FamilyMethod::ImplicitMidpoint,
    FamilyMethod::Newmark,
    FamilyMethod::GeneralizedAlpha { rho: 0.8 },
    FamilyMethod::GeneralizedAlpha { rho: 0.0 },
];

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0f64, |most, (a, b)| most.max((a - b).abs()))
}

/// On a nonlinear string of two fields with damping and an input, whose tangent is banded by node.
#[test]
fn implicit_methods_are_of_order_two() {
    let string = GuitarString::uniform(9);
    let pi = core::f64::consts::PI;
    let pull = |i: usize| if i < 9 { 0.0 } else { 0.1 * (pi * (i - 8) as f64 / 10.0).sin() };
    let start = state(&string, pull, |_| 0.0);
    let simulate = || string.simulate(start.clone()).until(1.0).inputs(|t, _| t.sin()).record(Every::Last);
    let exact = simulate().tolerance(1e-12).run().expect("runs");
    for method in METHODS {
        let error = |steps: f64| {
            let motion = simulate().method(method).fixed_step(1.0 / steps).run().expect("runs");
            distance(motion.end().q(), exact.end().q())
        };
        let order = (error(1000.0) / error(2000.0)).log2();
        assert!((order - 2.0).abs() < 0.1, "{method}: {order}");
    }
}

/// Steps of a hundred times the bound of leapfrog, and a motion of long waves: energy stays, order is seen.
#[test]
fn long_steps_are_stable() {
    for between_walls in [true, false] {
        let bar = Bar::<true> { elements: 2000, length: 2.0, ea: 7.0, rho: 3.0, between_walls };
        let part = if between_walls { 1.0 } else { 0.5 };
        let shape = |i: usize| ((i + 1) as f64 * part * core::f64::consts::PI / 2000.0).sin();
        let start = state(&bar, shape, |_| 0.0);
        let mode = &bar.modes(&start, 1).expect("modes")[0];
        let longest = bar.longest_step(&start).expect("a bound");
        for method in METHODS {
            let step = 100.0 * longest;
            let run = bar.simulate(start.clone()).until(40.0 * step).method(method).fixed_step(step);
            let motion = run.run().expect("stable");
            let exact = (mode.frequency() * 40.0 * step).cos();
            let error = (motion.end().q()[999] / start.q()[999] - exact).abs();
            assert!(error < 0.01, "{method}: {error:e}");
            let conserves = matches!(method, FamilyMethod::ImplicitMidpoint | FamilyMethod::Newmark);
            let drift = motion.summary().energy_drift.expect("conserved");
            assert!(!conserves || drift < 1e-9, "{method}: {drift:e}");
            // A step of a linear model takes a solution, and one that finds nothing left.
            assert!(motion.summary().evaluations <= 40 * 3 + 400, "{method}");
        }
    }
}

/// ρ∞ = 0 damps the shortest waves at once; the midpoint rule keeps them.
#[test]
fn generalized_alpha_damps_what_steps_cannot_resolve() {
    let lattice = Lattice { masses: 60, alpha: 0.0 };
    let start = state(&lattice, |i| if i % 2 == 0 { 1.0 } else { -1.0 }, |_| 0.0);
    let run = |method: FamilyMethod| {
        let motion = lattice.simulate(start.clone()).until(2000.0).method(method).fixed_step(100.0).run();
        let motion = motion.expect("stable");
        motion.energies_of(motion.end()).total() / motion.energies_of(motion.start()).total()
    };
    assert!((run(FamilyMethod::ImplicitMidpoint) - 1.0).abs() < 1e-9);
    assert!(run(methods::GeneralizedAlpha { rho: 0.0 }.into()) < 1e-3);
}

#[test]
fn implicit_steps_do_not_allocate() {
    let string = GuitarString::uniform(20);
    let start = state(&string, |i| 0.01 * (i as f64).sin(), |_| 0.0);
    let count = |method: FamilyMethod, steps: f64| {
        let start = start.clone();
        allocation_counter::measure(|| {
            let run = string.simulate(start).until(1e-3 * steps).method(method).fixed_step(1e-3);
            assert!(run.inputs(|_, _| 0.0).record(Every::Last).run().is_ok());
        })
        .count_total
    };
    for method in METHODS {
        assert_eq!(count(method, 10.0), count(method, 300.0), "{method}");
    }
}

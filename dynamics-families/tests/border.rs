//! Models whose matrices have a border: a trolley in whose frame a whole chain is described.

use dynamics_families::model::FamilyState;
use dynamics_families::{Every, FamilyMethod, SimulateFamilies, methods};

use crate::common::{Trolley, state};

/// In absolute places a free chain of n + 1 masses, of which the first weighs M: with M = 1 it has the
/// frequencies 2 √k sin(jπ/2(n + 1)), the first of them 0.
#[test]
fn a_trolley_as_heavy_as_a_mass_makes_a_free_chain() {
    let n = 400;
    let trolley = Trolley { masses: n, trolley: 1.0, k: 4.0 };
    let rest = state(&trolley, |_| 0.0, |_| 0.0);
    let modes = trolley.modes(&rest, 12).expect("modes");
    for (j, mode) in modes.iter().enumerate() {
        let exact = 4.0 * (j as f64 * core::f64::consts::PI / (2 * (n + 1)) as f64).sin();
        assert!((mode.omega_squared - exact * exact).abs() < 1e-9, "{j} {}", mode.omega_squared);
    }
    // M is not dominant: the bound comes from counts. ω < 4.
    let longest = trolley.longest_step(&rest).expect("a bound");
    assert!((longest - 0.5).abs() < 1e-4 && longest > 0.5 * (1.0 - 1e-6), "{longest}");
}

/// Momentum stays, whatever the method, and methods agree.
#[test]
fn borders_move_right() {
    let trolley = Trolley { masses: 400, trolley: 20.0, k: 4.0 };
    let hump = |i: usize| if i == 0 { 0.0 } else { (-((i as f64 - 100.0) / 20.0).powi(2)).exp() };
    let start = state(&trolley, hump, |i| if i == 0 { 0.5 } else { 0.0 });
    let run = || trolley.simulate(start.clone()).until(150.0).record(Every::Last);
    let exact = run().tolerance(1e-11).run().expect("runs");
    assert!(exact.summary().mass.ends_with("border of 1"), "{}", exact.summary());
    for (motion, permitted) in [
        (run().fixed_step(0.05).method(methods::Composition6).run(), 1e-8),
        (run().fixed_step(0.05).run(), 1e-3),
        (run().fixed_step(0.05).method(FamilyMethod::ImplicitMidpoint).run(), 1e-3),
        (run().fixed_step(0.05).method(FamilyMethod::Newmark).run(), 1e-3),
    ] {
        let motion = motion.expect("runs");
        let momentum = 20.0 * motion.end().u()[0]
            + motion.end().u()[1..].iter().map(|u| u + motion.end().u()[0]).sum::<f64>();
        assert!((momentum - 420.0 * 0.5).abs() < 1e-9, "{}: {momentum}", motion.method());
        let error =
            motion.end().q().iter().zip(exact.end().q()).fold(0.0f64, |most, (a, b)| most.max((a - b).abs()));
        assert!(error < permitted, "{}: {error:e}", motion.method());
        assert!(motion.summary().energy_drift.expect("conserved") < 1e-4);
    }
}

//! Waves against closed forms and digits from elsewhere.

use dynamics_families::model::FamilyState;
use dynamics_families::{Every, FamilyErrorKind, SimulateFamilies, methods};

use crate::common::{Bar, Lattice, state};

/// Leapfrog on a lumped bar with h = element/c moves waves without any error: after 2N steps the start is
/// back, after N its negative mirror image.
#[test]
fn at_courant_number_one_waves_are_exact() {
    let bar = Bar::<false> { elements: 1001, length: 1001.0, ea: 1.0, rho: 1.0, between_walls: true };
    let n = bar.nodes();
    let hump = |i: usize| (-((i as f64 - 300.0) / 25.0).powi(2)).exp() + 0.1 * ((i * i) as f64).sin();
    let start = state(&bar, hump, |_| 0.0);
    let motion = bar
        .simulate(start.clone())
        .until(2.0 * 1001.0)
        .fixed_step(1.0)
        .record(Every::time(1001.0))
        .run()
        .expect("stable");
    let middle = motion.at(1001.0).expect("a frame");
    for i in 0..n {
        assert!((motion.end().q()[i] - start.q()[i]).abs() < 1e-12, "{i}");
        assert!((middle.q()[i] + start.q()[n - 1 - i]).abs() < 1e-12, "{i}");
    }
    assert_eq!(motion.summary().steps, 2002);

    let error = bar.simulate(start).until(2002.0).fixed_step(1.001).run().expect_err("refused");
    assert!(
        matches!(error.kind, FamilyErrorKind::StepTooLong { longest, .. } if (longest - 1.0).abs() < 1e-12)
    );
    assert_eq!(
        error.to_string(),
        "`Bar` was not simulated: a fixed step of 1.001 is too long for Störmer–Verlet (order 2): waves grow \
         without bounds above 1.000000e0, the bound by `longest_step`; shorten the step, or choose an \
         implicit method"
    );
}

/// x_n(t) = J_2n(2t) at t = 20 (Schrödinger 1914).
#[test]
fn a_displaced_mass_of_a_long_lattice_makes_bessel_functions() {
    let lattice = Lattice { masses: 201, alpha: 0.0 };
    let start = state(&lattice, |i| if i == 100 { 1.0 } else { 0.0 }, |_| 0.0);
    let bessel = [
        (0, 0.00736689058423729),
        (1, -0.0010649746823580325),
        (2, -0.01785674764351508),
        (5, 0.11938336278226096),
        (10, 0.1277939335508489),
        (15, -0.10408594976564972),
        (18, 0.1758137789805756),
        (20, 0.13078054528516672),
        (22, 0.027211252985837243),
        (25, 0.0006818524353176831),
    ];
    let rates = [(0, -0.25207663607517), (10, -0.08250528751764223)];
    for (motion, permitted) in [
        (lattice.simulate(start.clone()).until(20.0).tolerance(1e-12).record(Every::Last).run(), 1e-10),
        (lattice.simulate(start.clone()).until(20.0).tolerance(1e-6).record(Every::Last).run(), 1e-4),
        (lattice.simulate(start).until(20.0).fixed_step(0.05).method(methods::Composition8).run(), 1e-11),
    ] {
        let motion = motion.expect("runs");
        for (n, exact) in bessel {
            for i in [100 - n, 100 + n] {
                let error = (motion.end().q()[i] - exact).abs();
                assert!(error < permitted, "{n} {error:e} {}", motion.method());
            }
        }
        for (n, exact) in rates {
            assert!((motion.end().u()[100 + n] - exact).abs() < permitted);
        }
    }
}

/// Modal energies of Fermi, Pasta, Ulam and Tsingou's lattice at t = 1000, of 24 digits.
#[test]
fn the_lattice_of_fermi_pasta_ulam_and_tsingou() {
    let pi = core::f64::consts::PI;
    let lattice = Lattice { masses: 31, alpha: 0.25 };
    let start = state(&lattice, |j| (pi * (j + 1) as f64 / 32.0).sin(), |_| 0.0);
    let motion = lattice.simulate(start).until(1000.0).tolerance(1e-12).run().expect("runs");
    let end = motion.end();
    let modal = |k: usize| {
        let part = |x: &[f64]| {
            let sum: f64 = (0..31).map(|j| x[j] * (pi * ((j + 1) * k) as f64 / 32.0).sin()).sum();
            (2.0f64 / 32.0).sqrt() * sum
        };
        let omega = 2.0 * (k as f64 * pi / 64.0).sin();
        0.5 * (part(end.u()).powi(2) + omega * omega * part(end.q()).powi(2))
    };
    for (k, exact) in [(1, 0.05346533209470659), (2, 0.010775348382184217), (3, 0.004884702470052221)] {
        assert!((modal(k) - exact).abs() < 1e-9, "{k} {:e}", modal(k) - exact);
    }
    assert!((end.q()[15] + 0.5129958421433948).abs() < 1e-9);
    assert!((motion.energies_of(end).total() - 0.07704437324484982).abs() < 1e-11);
}

/// The lowest mode of a bar of consistent mass swings with its closed frequency.
#[test]
fn a_mode_of_a_consistent_bar_comes_back_after_its_period() {
    let bar = Bar::<true> { elements: 25, length: 2.0, ea: 7.0, rho: 3.0, between_walls: false };
    let theta = core::f64::consts::PI / 50.0;
    let cosine = theta.cos();
    let omega = (6.0 * (1.0 - cosine) / (2.0 + cosine)).sqrt() * bar.c() / bar.h();
    let start = state(&bar, |i| 1e-6 * ((i + 1) as f64 * theta).sin(), |_| 0.0);
    let period = 2.0 * core::f64::consts::PI / omega;
    let motion = bar.simulate(start.clone()).until(period).tolerance(1e-11).run().expect("runs");
    for (end, start) in motion.end().q().iter().zip(start.q()) {
        assert!((end - start).abs() < 1e-15, "{:e}", end - start);
    }
    assert!(motion.summary().energy_drift.expect("conserved") < 1e-9);
    assert!(motion.summary().mass.starts_with("banded, half width 1"));
}

//! Closed motions found by shooting.

use std::f64::consts::{PI, TAU};

use dynamics::analysis::{FloquetVerdict, PeriodicError, Threshold, Trivial};
use dynamics::prelude::*;

use crate::double_pendulum::DoublePendulum;
use crate::models::{Duffing, Pendulum, VanDerPol};

/// 2K(k)/π by the arithmetic-geometric mean.
fn slower(k: f64) -> f64 {
    let (mut a, mut b) = (1.0, (1.0 - k * k).sqrt());
    for _ in 0..12 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    1.0 / a
}

#[test]
fn van_der_pol_has_its_published_cycle() {
    // Period for μ = 1: Andersen & Geer, SIAM J. Appl. Math. 42 (1982) 678; amplitude
    // 2.00861986087484313650940188 with ẋ = 0.
    let model = VanDerPol { mu: 1.0 };
    let orbit = model.periodic(model.state().x(2.0).build().unwrap(), 6.0).run().unwrap();
    assert!((orbit.period - 6.663_286_859_323_13).abs() < 1e-10, "{orbit}");
    assert!(orbit.floquet.autonomous && orbit.repeats == 1, "{orbit}");
    let known: Vec<_> = orbit.floquet.multipliers.iter().map(|one| one.trivial).collect();
    assert_eq!(known, [None, Some(Trivial::Time)]);
    // The other one is what volumes are multiplied by: ∫ (1 − x²) along a motion of another kind.
    let other = orbit.floquet.multipliers[0];
    assert!((other.value.re.ln() - orbit.floquet.divergence).abs() < 1e-8, "{orbit}");
    let motion =
        model.simulate(orbit.start).until(orbit.start.t + orbit.period).tolerance(1e-12).run().unwrap();
    let n = 2000;
    let mean: f64 = (0..n)
        .map(|k| motion.at(orbit.start.t + orbit.period * f64::from(k) / f64::from(n)))
        .map(|s| 1.0 - s.x().powi(2))
        .sum();
    assert!((mean / f64::from(n) * orbit.period - orbit.floquet.divergence).abs() < 1e-8);
    assert!((other.value.re - 8.59e-4).abs() < 1e-6 && other.uncertainty < 1e-8, "{orbit}");
    assert_eq!(orbit.floquet.verdict, FloquetVerdict::AsymptoticallyStable);

    // Three segments find the same, and so do two periods, which say so.
    let parts = model.periodic(model.state().x(2.0).build().unwrap(), 6.0).segments(3).run().unwrap();
    assert!((parts.period - orbit.period).abs() < 1e-10 && parts.nodes.len() == 3, "{parts}");
    assert!((parts.floquet.multipliers[0].value.re - other.value.re).abs() < 1e-8, "{parts}");
    let double = model.periodic(orbit.start, 2.0 * orbit.period).run().unwrap();
    assert_eq!(double.repeats, 2, "{double}");

    // Stiffer: period for μ = 10 by Urabe, 19.07836956693.
    let stiff = VanDerPol { mu: 10.0 };
    let settled = stiff.simulate(stiff.state().x(2.0).build().unwrap()).until(60.0).run().unwrap().end();
    let found = stiff.periodic(settled, 19.0).run().unwrap();
    assert!((found.period - 19.078_369_566_9).abs() < 1e-8, "{found}");
}

#[test]
fn a_pendulum_takes_the_elliptic_integral_and_its_family_is_told() {
    let model = Pendulum { m: 0.7, l: 1.3, g: 9.81 };
    let linear = TAU * (1.3_f64 / 9.81).sqrt();
    for theta in [0.3, 1.0, 2.0, 3.0_f64] {
        let wanted = linear * slower((0.5 * theta).sin());
        let start = model.state().theta(0.97 * theta).build().unwrap();
        let by_amplitude = model.periodic(start, wanted * 0.95).hold("theta", theta).run().unwrap();
        assert!((by_amplitude.period / wanted - 1.0).abs() < 1e-10, "{theta}: {by_amplitude}");
        assert!(by_amplitude.start.theta_rate().abs() < 1e-9, "{by_amplitude}");
        // Both multipliers are 1 for a reason, so that nothing is left to decide.
        let why: Vec<_> = by_amplitude.floquet.multipliers.iter().map(|one| one.trivial).collect();
        assert_eq!(why, [Some(Trivial::Time), Some(Trivial::Conserved { name: "energy" })], "{by_amplitude}");
        assert_eq!(by_amplitude.floquet.verdict, FloquetVerdict::StableToFirstOrder, "{by_amplitude}");
        let energy = -0.7 * 9.81 * 1.3 * theta.cos();
        let by_energy = model.periodic(start, wanted * 0.95).hold_energy(energy).run().unwrap();
        assert!((by_energy.period / wanted - 1.0).abs() < 1e-10, "{theta}: {by_energy}");
        let by_period = model.periodic(start, wanted).hold_period().run().unwrap();
        assert!((by_period.start.theta() - theta).abs() < 1e-8, "{theta}: {by_period}");
    }
    // None chosen: which one is not known.
    let start = model.state().theta(1.0).build().unwrap();
    let said = model.periodic(start, 2.4).run().unwrap_err();
    let PeriodicError::NotIsolated { conserved, ratio, .. } = &said else { panic!("{said}") };
    assert!(
        conserved == &["energy"] && *ratio < 1e-9 && said.to_string().contains(".hold_energy("),
        "{said}"
    );
    let PeriodicError::NotIsolated { remedies, .. } = &said else { panic!("{said}") };
    assert_eq!(remedies[..], [".hold_energy(..)", ".hold(\"theta\", ..)", ".hold_period()"], "{said}");
    // Round and round: the angle is a turn further.
    let start = model.state().theta_rate(9.0).build().unwrap();
    let energy = 0.5 * 0.7 * (1.3 * 9.0_f64).powi(2) - 0.7 * 9.81 * 1.3;
    let turning = model.periodic(start, 0.8).hold_energy(energy).advance("theta", TAU).run().unwrap();
    let k = (4.0 * 9.81 / 1.3_f64).sqrt() / 9.0;
    let wanted = 2.0 / 9.0 * PI * slower(k);
    assert!((turning.period / wanted - 1.0).abs() < 1e-10, "{turning}");
    // As it is, without a search: known to turn, it closes; not known, it does not.
    let judged = model.periodic(turning.start, turning.period).advance("theta", TAU).judge().unwrap();
    assert_eq!(judged.verdict, turning.floquet.verdict, "{judged}");
    assert!((judged.monodromy - &turning.floquet.monodromy).amax() < 1e-9);
    let said = model.floquet(&turning.start, turning.period).unwrap_err();
    assert!(
        matches!(said, PeriodicError::NotClosed { .. }) && said.to_string().contains(".advance("),
        "{said}"
    );
}

/// A motion that is as fast again 3 rad further does not go on so: gravity is another there.
#[test]
fn what_is_further_by_no_whole_turn_does_not_repeat() {
    let model = Pendulum { m: 0.7, l: 1.3, g: 9.81 };
    let start = model.state().theta(-1.5).theta_rate(9.0).build().unwrap();
    let search = || model.periodic(start, 0.3).hold("theta", -1.5).advance("theta", 3.0);
    for said in [search().run().unwrap_err(), search().judge().unwrap_err()] {
        let closed = matches!(said, PeriodicError::NotClosed { .. });
        let alike = matches!(said, PeriodicError::NotAlike { turned: "theta", by: 3.0, .. });
        assert!(closed || alike, "{said}");
    }
    assert!(matches!(search().run().unwrap_err(), PeriodicError::NotAlike { .. }));
    // Nothing depends on where a free body is: there it does.
    let free = Pendulum { m: 0.7, l: 1.3, g: 0.0 };
    let start = free.state().theta_rate(2.0).build().unwrap();
    let orbit = free.periodic(start, 1.5).advance("theta", 3.0).judge().unwrap();
    assert!(orbit.multipliers.iter().all(|one| one.value.re == 1.0), "{orbit}");
}

#[test]
fn a_pair_of_ones_that_nobody_knows_of_is_not_decided() {
    // A constant force: energy and its work are conserved, which neither the parameters nor the powers tell.
    // The second 1 is off by rounding.
    let model = Duffing { alpha: 1.0, beta: 1.0, delta: 0.0, gamma: 0.1, omega: 0.0 };
    for x in [0.5, 0.8, 1.0, 1.3, 2.0, 3.0_f64] {
        let guess = TAU / (1.0 + 0.72 * x * x).sqrt();
        let orbit = model.periodic(model.state().x(x).build().unwrap(), guess).hold("x", x).run().unwrap();
        assert_eq!(orbit.floquet.nontrivial().count(), 1, "{orbit}");
        let other = orbit.floquet.multipliers[0];
        assert!((other.value.re - 1.0).abs() <= other.uncertainty && other.uncertainty < 1e-9, "{orbit}");
        assert!(
            matches!(orbit.floquet.verdict, FloquetVerdict::Undecided { threshold: Threshold::Fold, .. }),
            "{orbit}"
        );
    }
}

#[test]
fn a_driven_duffing_oscillator_has_three_motions_where_the_curve_leans_over() {
    // One harmonic: (α − ω² + ¾βA²)² + (δω)² = (γ/A)²; the harmonics beside it change it by per cents.
    let model = Duffing { alpha: 1.0, beta: 0.05, delta: 0.1, gamma: 0.5, omega: 1.2 };
    let balance = |a: f64| (1.0 - 1.44 + 0.0375 * a * a).powi(2) + (0.12_f64).powi(2) - (0.5 / a).powi(2);
    let (mut last, mut crossings) = (balance(0.05), Vec::new());
    for k in 2..200 {
        let a = 0.05 * f64::from(k);
        let now = balance(a);
        if now.signum() != last.signum() {
            crossings.push(a - 0.025);
        }
        last = now;
    }
    assert_eq!(crossings.len(), 3, "{crossings:?}");
    let mut verdicts = Vec::new();
    for a in crossings {
        let stiffness = 1.0 - 1.44 + 0.0375 * a * a;
        let lag = (0.12_f64).atan2(stiffness);
        let start = model.state().x(a * lag.cos()).x_rate(a * 1.2 * lag.sin()).build().unwrap();
        let orbit = model.periodic(start, TAU / 1.2).run().unwrap();
        let reach = model.simulate(orbit.start).until(orbit.period).run().unwrap();
        let most = reach.steps().map(|s| s.x().abs()).fold(0.0, f64::max);
        assert!((most / a - 1.0).abs() < 0.1, "{a} {most}");
        assert!((orbit.floquet.monodromy.determinant().ln() + 0.1 * orbit.period).abs() < 1e-9);
        verdicts.push(orbit.floquet.verdict);
    }
    assert_eq!(verdicts[0], FloquetVerdict::AsymptoticallyStable);
    assert!(
        matches!(verdicts[1], FloquetVerdict::Unstable { threshold: Threshold::Fold, .. }),
        "{}",
        verdicts[1]
    );
    assert_eq!(verdicts[2], FloquetVerdict::AsymptoticallyStable);
}

#[test]
fn modes_of_a_double_pendulum_go_on_to_large_swings() {
    let model = DoublePendulum { m1: 1.0, m2: 1.0, l1: 1.0, l2: 1.0, g: 9.81 };
    // ω² = (2 ∓ √2) g/l with θ₂ = ±√2 θ₁.
    for (sign, square) in [(1.0, 2.0 - 2f64.sqrt()), (-1.0, 2.0 + 2f64.sqrt())] {
        let small = TAU / (square * 9.81).sqrt();
        let start = |a: f64| model.state().theta1(a).theta2(sign * 2f64.sqrt() * a).build().unwrap();
        let first = model.periodic(start(1e-4), small).hold("theta1", 1e-4).run().unwrap();
        assert!((first.period / small - 1.0).abs() < 1e-6, "{first}");
        let next = model.periodic(start(0.3), small).hold("theta1", 0.3).run().unwrap();
        assert!((next.period / small - 1.0).abs() > 1e-3, "{next}");
        // Two of four are 1, the others a pair on the circle.
        assert_eq!(next.floquet.nontrivial().count(), 2, "{next}");
        assert!(next.floquet.symplectic_defect < 1e-8, "{next}");
        assert_eq!(next.floquet.verdict, FloquetVerdict::StableToFirstOrder, "{next}");
        let product: nalgebra::Complex<f64> = next.floquet.nontrivial().map(|one| one.value).product();
        assert!((product.re - 1.0).abs() < 1e-9 && product.im.abs() < 1e-9, "{next}");
    }
}

#[test]
fn what_runs_away_within_a_period_is_held_by_segments() {
    // ẍ = 9x + γ cos ωt: x = −γ/(9 + ω²) cos ωt, beside which all grows by e^{3T} = 2·10¹⁶.
    let model = Duffing { alpha: -9.0, beta: 0.0, delta: 0.0, gamma: 0.1, omega: 0.5 };
    let period = TAU / 0.5;
    let rest = model.state().build().unwrap();
    let said = model.periodic(rest, period).run().unwrap_err();
    assert!(
        matches!(said, PeriodicError::RunsAway { coordinate: "x", .. })
            && said.to_string().contains(".through("),
        "{said}"
    );
    let orbit = model.periodic(rest, period).through([rest; 8]).run().unwrap();
    for (k, node) in orbit.nodes.iter().enumerate() {
        let time = period * k as f64 / 8.0;
        assert!(
            (node.t - time).abs() < 1e-12 && (node.x() + 0.1 / 9.25 * (0.5 * time).cos()).abs() < 1e-10,
            "{orbit}"
        );
    }
    let FloquetVerdict::Unstable { threshold: Threshold::Fold, growth, .. } = orbit.floquet.verdict else {
        panic!("{orbit}")
    };
    assert!((growth.ln() / (3.0 * period) - 1.0).abs() < 1e-9, "{orbit}");
    // Of the small one rounding beside the large one leaves nothing, and it says so.
    let small = orbit.floquet.multipliers[1];
    assert!(small.uncertainty > (small.value.norm() - (-3.0 * period).exp()).abs(), "{orbit}");
}

#[test]
fn searches_that_fail_say_why() {
    let model = VanDerPol { mu: 1.0 };
    // From within rest attracts Newton's method: it has every period.
    let said = model.periodic(model.state().x(0.01).build().unwrap(), 6.0).run().unwrap_err();
    assert!(matches!(said, PeriodicError::Rests { .. } | PeriodicError::NoConvergence { .. }), "{said}");
    // Far away, with a period that is none.
    let said = model
        .periodic(model.state().x(40.0).x_rate(-300.0).build().unwrap(), 0.3)
        .max_iterations(4)
        .run()
        .unwrap_err();
    let PeriodicError::NoConvergence { at, period, .. } = &said else { panic!("{said}") };
    assert!(at.len() == 2 && *period > 0.0 && said.to_string().contains("start nearer"), "{said}");
    // A spring that pushes: the shot runs away within the period.
    let away = Duffing { alpha: 1.0, beta: -1.0, delta: 0.0, gamma: 0.1, omega: 1.0 };
    let said = away.periodic(away.state().x(3.0).build().unwrap(), TAU).run().unwrap_err();
    assert!(
        matches!(
            said,
            PeriodicError::RunsAway { .. } | PeriodicError::Ends { .. } | PeriodicError::Stalls { .. }
        ),
        "{said}"
    );
    // Equations that do not have the period.
    let driven = Duffing { alpha: 1.0, beta: 1.0, delta: 0.1, gamma: 0.5, omega: 1.2 };
    let said = driven.periodic(driven.state().build().unwrap(), 5.0).run().unwrap_err();
    assert!(matches!(said, PeriodicError::NotPeriodic { .. }), "{said}");
    let said = model.periodic(model.state().x(2.0).build().unwrap(), 6.0).hold("y", 1.0).run().unwrap_err();
    assert!(matches!(said, PeriodicError::UnknownCoordinate { .. }), "{said}");
    // More is held than there is.
    let pendulum = Pendulum { m: 1.0, l: 1.0, g: 9.81 };
    let held = pendulum.periodic(pendulum.state().theta(0.5).build().unwrap(), 2.0);
    let said = held.hold("theta", 0.5).hold_energy(3.0).hold_period().run().unwrap_err();
    assert!(matches!(said, PeriodicError::NoConvergence { .. }), "{said}");
    let said = model.periodic(model.state().x(2.0).build().unwrap(), 6.0).segments(0).run().unwrap_err();
    assert!(matches!(said, PeriodicError::Option { .. }), "{said}");
}

#[test]
fn what_is_held_has_to_be_a_number() {
    let model = VanDerPol { mu: 1.0 };
    let orbit = model.periodic(model.state().x(2.0).build().unwrap(), 6.6).run().unwrap();
    // From a start that is a solution already.
    let search = || model.periodic(orbit.start, orbit.period);
    for said in [
        search().hold("x", f64::NAN).run().unwrap_err(),
        search().hold_energy(f64::NAN).run().unwrap_err(),
        search().advance("x", f64::NAN).run().unwrap_err(),
        search().hold("x", f64::INFINITY).run().unwrap_err(),
    ] {
        assert!(matches!(said, PeriodicError::Option { needed: "finite", .. }), "{said}");
    }
}

#[test]
fn a_coordinate_that_is_held_says_where_on_a_lone_cycle_it_starts() {
    let model = VanDerPol { mu: 1.0 };
    let guess = model.state().x(2.0).build().unwrap();
    for x in [0.0, 1.0] {
        let orbit = model.periodic(guess, 6.6).hold("x", x).run().unwrap();
        assert!((orbit.start.x() - x).abs() < 1e-12, "{orbit}");
        assert!((orbit.period - 6.663_286_859_323_13).abs() < 1e-9, "{orbit}");
        assert_eq!(orbit.floquet.verdict, FloquetVerdict::AsymptoticallyStable, "{orbit}");
    }
}

#[test]
fn what_is_fast_has_not_run_away() {
    // Of 1e9 rad/s, from rest: its speed is 1e9 times its start.
    let model = Pendulum { m: 1.0, l: 1.0, g: 1e18 };
    let start = model.state().theta(1.0).build().unwrap();
    let orbit = model.periodic(start, 6.5e-9).hold("theta", 1.0).run().unwrap();
    let wanted = TAU * 1e-9 * slower(0.5_f64.sin());
    assert!((orbit.period / wanted - 1.0).abs() < 1e-10, "{orbit}");
}

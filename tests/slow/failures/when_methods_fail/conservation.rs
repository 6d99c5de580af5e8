//! What should stay, and does not.

use dynamics::methods;
use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;
use dynamics::simulate::SimulationErrorKind;

use super::charts;
use super::models::*;

/// Equations of index 3 that are differentiated twice hold Φ̈ = 0 alone: Φ grows with the square of the time.
#[test]
fn constraints_drift_where_nothing_holds_them() {
    let start = ROD.state().x(1.0).build().unwrap();
    let run = |formulation| ROD.simulate(start).until(200.0).tolerance(1e-6).formulation(formulation).run();
    let error = run(Formulation::Augmented).unwrap_err();
    let SimulationErrorKind::Drift { row, distance, limit, .. } = error.kind else { panic!("{error}") };
    assert!(row == "rod" && distance > limit, "{error}");
    let motion = error.motion(&ROD).unwrap();
    let drift = |motion: &Motion<'_, Rod>| -> Vec<(f64, f64)> {
        motion.steps().map(|state| (state.t, (state.x().hypot(state.y()) - 1.0).abs())).collect()
    };
    let grown = drift(&motion);
    let at =
        |t: f64| grown.iter().take_while(|(time, _)| *time <= t).fold(0.0f64, |most, (_, x)| most.max(*x));
    assert!(at(error.time) > 3.0 * at(0.5 * error.time), "faster than in proportion");
    let mut panel = Panel::new(Axis::new("time in s"), Axis::log("length of the rod less its own in m"));
    panel = panel.line("augmented, ended by `drift_limit`", charts::envelope(&grown, 60));
    for (name, formulation) in [
        ("Baumgarte", Formulation::Baumgarte { alpha: 10.0, beta: 10.0 }),
        ("projected", Formulation::Projected),
    ] {
        let motion = run(formulation).unwrap();
        let most = motion.summary().constraints[0].residual;
        assert!(most < 1e-4, "{name}: {most:e}");
        if name == "Baumgarte" {
            panel = panel.line(name, charts::envelope(&drift(&motion), 60));
        } else {
            assert!(most < 1e-12, "at rounding, and no curve: {most:e}");
        }
    }
    charts::is_current(
        "drift",
        &Chart::new("A pendulum in Cartesian coordinates at tolerance 1e-6").panel(panel),
    );
}

/// The energy of an explicit method with fixed steps goes one way.
#[test]
fn energy_drifts_with_fixed_steps() {
    let start = SPRING.state().x(1.0).push(0.0).build().unwrap();
    let run = |h: f64, end: f64| {
        SPRING.simulate(start).until(end).fixed_step(h).method(methods::Rk4).run().unwrap()
    };
    let motion = run(0.5, 1000.0);
    let lost = |t: f64| 1.0 - motion.energy_at(t) / motion.energy_at(0.0);
    // RK4's factor of amplification: |R(iz)|² = 1 − z⁶/72 + z⁸/576.
    let per_step: f64 = 0.5f64.powi(6) / 72.0 - 0.5f64.powi(8) / 576.0;
    for t in [100.0, 1000.0] {
        let exact = 1.0 - (1.0 - per_step).powf(t / 0.5);
        assert!((lost(t) / exact - 1.0).abs() < 1e-9, "{} for {exact}", lost(t));
    }
    assert!(motion.verify().to_string().contains("shorten the fixed step"), "{}", motion.verify());
    assert!(!run(0.05, 1000.0).verify().to_string().contains("warning"));
    // Beyond its region of stability it explodes, and says so.
    let error = SPRING.simulate(start).until(1e4).fixed_step(2.9).method(methods::Rk4).run();
    let told = match error {
        Ok(motion) => motion.verify().to_string().contains("shorten the fixed step"),
        Err(_) => true,
    };
    assert!(told, "it grows by a factor in every step");
}

/// Störmer and Verlet's method keeps an energy near the true one for ever, as long as its steps stay away
/// from resonance: at ω h = 1.9 the true one falls to a tenth and comes back, at ω h > 2 nothing is.
#[test]
fn symplectic_steps_come_into_resonance() {
    let start = SPRING.state().x(1.0).push(0.0).build().unwrap();
    let run = |h: f64, end: f64| {
        SPRING.simulate(start).until(end).fixed_step(h).method(methods::StormerVerlet).run()
    };
    let most = |motion: &Motion<'_, Spring>| motion.steps().map(|s| s.x().abs()).fold(0.0, f64::max);
    // What is kept is x²(1 − h²/4) + u²: the true energy falls to that part of itself, and comes back.
    for h in [0.1f64, 0.9, 1.9] {
        let motion = run(h, 5000.0 * h).unwrap();
        let kept = 1.0 - 0.25 * h * h;
        let of = |s: State<Spring>| s.x().powi(2) + s.x_rate().powi(2);
        let (least, most) =
            motion.steps().map(of).fold((f64::MAX, 0.0f64), |(lo, hi), e| (lo.min(e), hi.max(e)));
        assert!((least / kept - 1.0).abs() < 0.02 && (most - 1.0).abs() < 0.02, "{least} {most} for {kept}");
        assert_eq!(
            motion.verify().to_string().contains("shorten the fixed step"),
            h > 0.5,
            "{}",
            motion.verify()
        );
    }
    // Beyond 2 it explodes.
    match run(2.05, 100.0) {
        Ok(motion) => {
            assert!(most(&motion) > 1e3, "{:e}", most(&motion));
            assert!(motion.verify().to_string().contains("shorten the fixed step"), "{}", motion.verify());
        }
        Err(error) => assert!(error.time < 100.0, "{error}"),
    }
}

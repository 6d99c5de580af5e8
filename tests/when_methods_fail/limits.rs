//! Where numbers end.

use dynamics::motion::SimulationErrorKind;
use dynamics::prelude::*;

use crate::models::*;

/// A value of 10⁷ has no digits of 10⁻¹⁰: what is permitted is what rounding does anyway, and more steps make more of it.
#[test]
fn tolerances_below_rounding_are_named() {
    // A guide that goes a long way slowly.
    let model = Guided { mass: 1.0, stiffness: 1.0, damping: 2.0, amplitude: 1e7, omega: 0.1 };
    let start = model.state().x(1e7).build().unwrap();
    let run = |absolute: f64| model.simulate(start).until(10.0).tolerances(absolute, 0.0).max_steps(100_000).run();
    let error = |motion: &Motion<'_, Guided>| (motion.end().x() - 1e7 * 1f64.cos()).abs();
    let good = run(1e-6).unwrap();
    assert!(error(&good) < 1e-5 && !good.summary().to_string().contains("below rounding"), "{}", good.summary());
    match run(1e-10) {
        Ok(motion) => {
            assert!(motion.summary().to_string().contains("tolerance below rounding"), "{}", motion.summary());
            assert!(error(&motion) > 1e-10, "{:e}", error(&motion));
        }
        Err(error) => {
            let kind = &error.kind;
            let told =
                matches!(kind, SimulationErrorKind::StepSizeTooSmall { .. } | SimulationErrorKind::TooManySteps { .. });
            assert!(told, "{error}");
        }
    }
}

/// Into a centre of attraction: the steps collapse at the instant of the closed form, π/(2√2), and the error names it.
#[test]
fn steps_collapse_at_a_singularity() {
    let model = Falling { mass: 1.0, strength: 1.0 };
    let start = model.state().x(1.0).build().unwrap();
    for tolerance in [1e-6, 1e-8, 1e-12] {
        let error = model.simulate(start).until(2.0).tolerance(tolerance).run().unwrap_err();
        assert!(matches!(error.kind, SimulationErrorKind::StepSizeTooSmall { .. }), "{error}");
        let exact = std::f64::consts::PI / 8f64.sqrt();
        assert!((error.time - exact).abs() < 1e-3, "{} for {exact}", error.time);
        // What was computed up to there is in hand.
        let motion = error.motion(&model).unwrap();
        assert!(motion.end_time() == error.time && motion.end().x() < 1e-2);
    }
    // A loose tolerance may jump over it, thrown out at any speed: the summary tells that errors grow.
    for tolerance in [1e-3, 1e-4, 1e-5, 1e-2] {
        if let Ok(motion) = model.simulate(start).until(2.0).tolerance(tolerance).run() {
            let summary = motion.summary().to_string();
            println!("{tolerance:e} {:?}", motion.summary().doubts);
            assert!(summary.contains("warning"), "at {tolerance:e}: {summary}");
        }
    }
    // With a fixed step it is jumped over, and the energy tells.
    match model.simulate(start).until(2.0).fixed_step(0.01).run() {
        Ok(motion) => assert!(motion.summary().to_string().contains("shorten the fixed step"), "{}", motion.summary()),
        Err(error) => assert!((error.time - 1.11).abs() < 0.05, "{error}"),
    }
}

//! Where numbers end.

use dynamics::prelude::*;
use dynamics::simulate::SimulationErrorKind;

use super::models::neutral::Neutral;
use super::models::*;

/// A value of 10⁷ has no digits of 10⁻¹⁰: what is permitted is what rounding does anyway, and more steps make
/// more of it.
#[test]
fn tolerances_below_rounding_are_named() {
    // A guide that goes a long way slowly.
    let model = Guided { mass: 1.0, stiffness: 1.0, damping: 2.0, amplitude: 1e7, omega: 0.1 };
    let start = model.state().x(1e7).build().unwrap();
    let run =
        |absolute: f64| model.simulate(start).until(10.0).tolerances(absolute, 0.0).max_steps(100_000).run();
    let error = |motion: &Motion<'_, Guided>| (motion.end().x() - 1e7 * 1f64.cos()).abs();
    let good = run(1e-6).unwrap();
    assert!(
        error(&good) < 1e-5 && !good.verify().to_string().contains("below rounding"),
        "{}",
        good.verify()
    );
    match run(1e-10) {
        Ok(motion) => {
            assert!(motion.verify().to_string().contains("tolerance below rounding"), "{}", motion.verify());
            assert!(error(&motion) > 1e-10, "{:e}", error(&motion));
        }
        Err(error) => {
            let kind = &error.kind;
            let told = matches!(
                kind,
                SimulationErrorKind::StepSizeTooSmall { .. } | SimulationErrorKind::TooManySteps { .. }
            );
            assert!(told, "{error}");
        }
    }
}

/// Into a centre of attraction: the steps collapse at the instant of the closed form, π/(2√2), and the error
/// names it.
#[test]
fn steps_collapse_at_a_singularity() {
    let model = Falling { mass: 1.0, strength: 1.0 };
    let start = model.state().x(1.0).build().unwrap();
    for tolerance in [1e-6, 1e-8, 1e-12] {
        let error = model.simulate(start).until(2.0).tolerance(tolerance).run().unwrap_err();
        let SimulationErrorKind::StepsVanish { at, .. } = error.kind else { panic!("{error}") };
        assert_eq!(at, error.time);
        let exact = std::f64::consts::PI / 8f64.sqrt();
        assert!((error.time - exact).abs() < 1e-3, "{} for {exact}", error.time);
        // What was computed up to there is in hand.
        let motion = error.motion(&model).unwrap();
        assert!(motion.end_time() == error.time && motion.end().x() < 1e-2);
    }
    // A loose tolerance may jump over it, thrown out at any speed: the summary tells that errors grow.
    for tolerance in [1e-3, 1e-4, 1e-5, 1e-2] {
        if let Ok(motion) = model.simulate(start).until(2.0).tolerance(tolerance).run() {
            let summary = motion.verify().to_string();
            println!("{tolerance:e} {:?}", motion.verify().accuracy);
            assert!(summary.contains("warning"), "at {tolerance:e}: {summary}");
        }
    }
    // With a fixed step it is jumped over, and the energy tells.
    match model.simulate(start).until(2.0).fixed_step(0.01).run() {
        Ok(motion) => {
            assert!(motion.verify().to_string().contains("shorten the fixed step"), "{}", motion.verify())
        }
        Err(error) => assert!((error.time - 1.11).abs() < 0.05, "{error}"),
    }
}

/// RATTLE puts the end of a step onto the constraints along their gradients where it starts: beside a change
/// point these do not lead there. What is left is an error, which names the place; a step may come to be
/// right over it, and passes. Explicit methods pass as a rule.
#[test]
fn rattle_does_not_pass_change_points() {
    let model = Neutral { inertia: 1.0, lengths: [0.3, 0.9, 0.5, 0.7] };
    let (mut told, mut passed) = (0, 0);
    for rate in [-1.0, -1.7, -2.3] {
        let start = model
            .state()
            .crank(1.0)
            .coupler_guess(0.5)
            .rocker_guess(1.5)
            .crank_rate(rate)
            .assemble()
            .unwrap();
        let run = || model.simulate(start).until(2.5 / -rate);
        let truth = run().method(methods::Verner9).tolerance(1e-11).run().unwrap().end();
        passed += usize::from(run().method(methods::Dop853).tolerance(1e-8).run().is_ok());
        for h in [0.03, 0.01, 0.003] {
            match run().method(methods::Rattle).fixed_step(h).run() {
                Ok(motion) => {
                    let off = (motion.end().rocker() - truth.rocker()).abs();
                    assert!(off < 20.0 * (rate * h).powi(2), "{rate} {h}: {off:e}");
                }
                Err(error) => {
                    let SimulationErrorKind::SingularPosition { rows, .. } = error.kind else {
                        panic!("{error}")
                    };
                    assert!(
                        rows.contains("closure.x") && error.to_string().contains("use methods::Dop853"),
                        "{error}"
                    );
                    told += 1;
                }
            }
        }
    }
    println!("{told} of 9 told");
    assert!(told >= 5 && passed == 3, "{told} {passed}");
}

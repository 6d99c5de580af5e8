//! What the summary doubts by itself, beside what is true.

use crate::common;

use common::*;
use dynamics_runtime::integrate::Direction;
use dynamics_runtime::methods::{self, Any};
use dynamics_runtime::model::{ModelState as _, Vector as _};
use dynamics_runtime::simulate::{Motion, Simulate, SimulationErrorKind, Unchecked};

/// What half steps show at most beside the estimate by a second run: both in permitted errors.
fn shown_and_measured<M: Simulate>(motion: &Motion<'_, M>) -> [f64; 2] {
    let measured = motion.global_error().unwrap().ratio.unwrap();
    let summary = motion.verify();
    assert!(
        !summary.to_string().contains("step doubling"),
        "what is measured is not shown otherwise: {summary}"
    );
    [summary.accuracy.step_doubling_at_most.unwrap(), measured]
}

/// Half steps leave a small part of the error, where order 5 is that of the method a thirtieth.
#[test]
fn errors_beyond_the_tolerance_are_shown() {
    let pendulum_start =
        at_rest_or_not([2.0 * std::f64::consts::PI / 3.0, -std::f64::consts::PI / 18.0], [0.0, 0.0]);
    let orbit = at_rest_or_not([0.1, 0.0], [0.0, 19f64.sqrt()]);
    let mut rows = Vec::new();
    for tolerance in [1e-5, 1e-7, 1e-9, 1e-11] {
        let chaotic: [Any<DoublePendulum>; 3] =
            [methods::DormandPrince5.into(), methods::Verner9.into(), methods::Tsit5.into()];
        for method in &chaotic {
            let simulation = DoublePendulum::UNIT.simulate(pendulum_start).until(10.0).method(method);
            let motion = simulation.tolerance(tolerance).estimate_error().run().unwrap();
            rows.push((format!("double pendulum {method} {tolerance:e}"), shown_and_measured(&motion)));
        }
        let regular: [Any<Kepler>; 3] =
            [methods::DormandPrince5.into(), methods::Dop853.into(), methods::Verner9.into()];
        for method in &regular {
            let simulation = Kepler.simulate(orbit).until(50.0).method(method);
            let motion = simulation.tolerance(tolerance).estimate_error().run().unwrap();
            rows.push((format!("Kepler {method} {tolerance:e}"), shown_and_measured(&motion)));
        }
    }
    for (name, [shown, measured]) in &rows {
        println!("{name}: {shown:.1e} shown, {measured:.1e} measured");
    }
    for (name, [shown, measured]) in rows {
        assert!(shown > 0.3 * measured, "{name}: {shown:e} shown, {measured:e} measured");
        assert!(shown < 2.0 * measured, "{name}: {shown:e} shown, {measured:e} measured");
    }
}

#[test]
fn motions_that_keep_their_accuracy_raise_no_doubts() {
    for tolerance in [1e-4, 1e-8, 1e-12] {
        let oscillator = Oscillator { omega: 2.0 };
        let motion =
            oscillator.simulate(at_rest_or_not([1.0], [0.0])).until(30.0).tolerance(tolerance).run().unwrap();
        let summary = motion.verify();
        assert!(!summary.to_string().contains("warning"), "{summary}");
        // Errors of an oscillator add up, and no more.
        let error = (motion.end().q[0] - 60f64.cos()).abs() / (tolerance * (1.0 + 60f64.cos().abs()));
        let shown = summary.accuracy.step_doubling_at_most.unwrap();
        assert!(shown < summary.steps as f64 && shown > 0.3 * error, "{error} {summary}");
    }
    // What forgets its errors keeps those of a few steps.
    let damped = Closure(|_, q, u| -q - 2.0 * u);
    let motion = damped.simulate(at_rest_or_not([1.0], [0.0])).until(50.0).max_step(0.1).run().unwrap();
    let summary = motion.verify();
    assert!(summary.steps >= 500 && summary.accuracy.step_doubling_at_most.unwrap() < 1.0, "{summary}");
}

/// Up the separatrix of a pendulum: e²⁰ = 5e8 within the run.
#[test]
fn growth_by_the_motion_is_found() {
    let upright = Closure(|_, q, _| q.sin());
    let start = at_rest_or_not([2.0], [-2.0 * 1f64.sin()]);
    let motion = upright.simulate(start).until(20.0).tolerance(1e-10).run().unwrap();
    let error = (motion.end().q[0] - 4.0 * (0.5f64.tan() * (-20f64).exp()).atan()).abs();
    assert!(error > 1e3 * 1e-10, "{error:e}");
    let summary = motion.verify();
    assert!(summary.to_string().contains("warning      global error about"), "{summary}");
    let shown = 1e-10 * summary.accuracy.step_doubling.unwrap();
    assert!(shown > 0.3 * error && shown < 3.0 * error, "{shown:e} {error:e}");
}

#[test]
fn stiff_motions_raise_no_false_alarm() {
    let stiff = Closure(|t, q, u| -1e8 * (q - t.cos()) - 2e4 * u);
    for method in [None, Some(Any::from(methods::Radau5)), Some(methods::Esdirk4.into())] {
        let simulation = stiff.simulate(at_rest_or_not([1.0], [0.0])).until(10.0).tolerance(1e-6);
        let simulation = if let Some(method) = &method { simulation.method(method) } else { simulation };
        let summary = simulation.run().unwrap().verify();
        assert!(!summary.to_string().contains("warning      global error"), "{summary}");
        assert!(summary.accuracy.step_doubling.unwrap() < 60.0, "{summary}");
    }
}

/// Half steps beside the estimate by a second run: van der Pol's equation, whose stiff parts forget, and an
/// oscillator, whose errors add up with one sign.
#[test]
fn errors_of_stiff_methods_that_add_up_are_shown_by_half_steps() {
    let relaxing = Closure(|_, q, u| ((1.0 - q * q) * u - q) / 1e-6);
    let swinging = Closure(|_, q, _| -1e4 * q);
    let list: [Any<Closure>; 2] = [methods::Radau5.into(), methods::Esdirk4.into()];
    for (method, tolerance) in
        list.iter().flat_map(|method| [1e-4, 1e-6].map(|tolerance| (method, tolerance)))
    {
        for (model, until) in [(&relaxing, 2.0), (&swinging, 5.0)] {
            let run = || {
                model.simulate(at_rest_or_not([2.0], [0.0])).until(until).tolerance(tolerance).method(method)
            };
            let estimated = run().estimate_error().run().unwrap();
            let measured = estimated.global_error().unwrap().ratio.unwrap();
            let summary = run().run().unwrap().verify();
            let shown = summary.accuracy.step_doubling.unwrap();
            println!("{method} {tolerance:e} to {until}: {shown:.1} shown, {measured:.1} measured");
            let warned = summary.to_string().contains("warning      global error about");
            assert_eq!(warned, shown > 60.0, "{summary}");
            match until {
                // In its jumps, of a millionth of the time, what is off by a small time is off by any value:
                // that does not last, and is told as what it is.
                2.0 => {
                    assert!(shown < 50.0 && measured > 1e3, "{shown} {measured}");
                    let peaks = summary.to_string().contains("warning      errors peak and pass");
                    assert_eq!(peaks, summary.accuracy.step_doubling_at_most.unwrap() > 1e3, "{summary}");
                    assert!(peaks || measured < 2e3, "{measured} {summary}");
                }
                // Where a value passes zero little is permitted of it, for a moment; of its amplitude it is
                // what half steps show, at least.
                _ => {
                    let error = estimated.global_error().unwrap();
                    let of_amplitude =
                        (error.coordinates.error / 3.0).max(error.velocities.error / 201.0) / tolerance;
                    assert!(
                        shown > 0.5 * of_amplitude && shown < 2.0 * measured,
                        "{shown} {of_amplitude} {measured}"
                    );
                }
            }
            assert!(
                !estimated.verify().to_string().contains("step doubling"),
                "what is measured is not shown otherwise"
            );
        }
    }
}

/// What a relaxation oscillation is off by for more than a hundredth of its time, beside a motion that is far
/// nearer: small shifts of its jumps are no doubt, ESDIRK at 1e-3, which is off by a thousand permitted
/// errors for half of the time, is one.
#[test]
fn half_steps_show_what_lasts_of_relaxation_oscillations() {
    let fast = Closure(|_, q, u| ((1.0 - q * q) * u - q) / 1e-6);
    let slow = Closure(|_, q, u| ((1.0 - q * q) * u - q) / 1e-3);
    let (radau, esdirk): (Any<Closure>, Any<Closure>) = (methods::Radau5.into(), methods::Esdirk4.into());
    let start = at_rest_or_not([2.0], [0.0]);
    let mut warned = [0, 0];
    for (model, method) in [(&fast, &radau), (&fast, &esdirk), (&slow, &radau), (&slow, &esdirk)] {
        let reference =
            model.simulate(start).until(11.0).tolerance(1e-9).method(methods::Radau5).run().unwrap();
        for tolerance in [1e-3, 1e-5] {
            let motion = model.simulate(start).until(11.0).tolerance(tolerance).method(method).run().unwrap();
            let summary = motion.verify();
            let (shown, lasts) =
                (summary.accuracy.step_doubling.unwrap(), lasting(&motion, &reference, tolerance, 0.01));
            println!("{method} {tolerance:e}: {shown:.1} shown, {lasts:.1} true");
            assert!(
                shown > 0.3 * lasts && shown < 3.0 * lasts,
                "{method} {tolerance:e}: {shown:.1} shown, {lasts:.1} true"
            );
            let says = summary.to_string().contains("warning      global error about");
            assert_eq!(says, shown > 60.0, "{summary}");
            let long = lasting(&motion, &reference, tolerance, 0.1);
            assert!(
                says || long < 100.0,
                "{method} {tolerance:e}: off by {long:.1} for a tenth of the time\n{summary}"
            );
            warned[usize::from(says)] += 1;
        }
    }
    assert_eq!(warned, [5, 3]);
}

/// What a motion is off by at the ends of its steps, in permitted errors, for more than a part of its time.
fn lasting<M: Simulate>(motion: &Motion<'_, M>, reference: &Motion<'_, M>, tolerance: f64, part: f64) -> f64 {
    let states: Vec<_> = motion.steps().collect();
    let error = |state: &M::State| {
        let exact = reference.at(state.t());
        let pairs = [(state.q(), exact.q()), (state.u(), exact.u())];
        let pairs =
            pairs.into_iter().flat_map(|(x, y)| x.as_slice().iter().copied().zip(y.as_slice().to_vec()));
        pairs.map(|(x, y)| (x - y).abs() / (tolerance * (1.0 + x.abs().max(y.abs())))).fold(0.0, f64::max)
    };
    let mut apart: Vec<(f64, f64)> = states
        .windows(2)
        .map(|ends| (ends[1].t() - ends[0].t(), error(&ends[0]).min(error(&ends[1]))))
        .collect();
    let mut left = part * apart.iter().map(|(h, _)| h).sum::<f64>();
    apart.sort_by(|(_, a), (_, b)| b.total_cmp(a));
    let lasts = apart.into_iter().find(|(h, _)| {
        left -= h;
        left <= 0.0
    });
    lasts.unwrap().1
}

#[test]
fn tolerances_below_rounding_are_named() {
    let far = Closure(|_, q, _| 1e6 - q);
    let start = at_rest_or_not([1e6 + 1.0], [0.0]);
    let run =
        |absolute: f64| far.simulate(start).until(5.0).tolerances(absolute, 0.0).max_steps(20_000).run();
    let summary = run(1e-9).unwrap().verify();
    let found = summary.accuracy.below_rounding.unwrap();
    assert_eq!((found.name, found.rate, found.permitted), ("x", false, 1e-9));
    assert!(
        summary.to_string().contains("tolerance below rounding: 1.0e-9 permitted of x = 1000001"),
        "{summary}"
    );
    let said = summary.warnings();
    assert!(
        said.iter().any(|warning| warning.to_string().starts_with("tolerance below rounding: 1.0e-9")),
        "{said:?}"
    );
    assert_eq!(said.len(), summary.to_string().matches("\n  warning  ").count());
    let plain = run(1e-8).unwrap().verify();
    assert!(plain.accuracy.below_rounding.is_none(), "{plain}");
    let swing =
        Oscillator { omega: 2.0 }.simulate(at_rest_or_not([1.0], [0.0])).until(5.0).run().unwrap().verify();
    assert!(swing.warnings().is_empty(), "{swing}");
}

#[test]
fn fixed_steps_that_lose_the_energy_are_too_long() {
    let oscillator = Oscillator { omega: 2.0 };
    let run =
        |h: f64| oscillator.simulate(at_rest_or_not([1.0], [0.0])).until(100.0).fixed_step(h).run().unwrap();
    let summary = run(0.4).verify();
    assert!(
        summary.energy_drift > 0.1 && summary.to_string().contains("shorten the fixed step"),
        "{summary}"
    );
    let summary = run(0.05).verify();
    assert!(summary.energy_drift < 1e-3 && !summary.to_string().contains("warning"), "{summary}");
    assert_eq!((summary.accuracy.step_doubling, summary.accuracy.below_rounding), (None, None));
}

/// What grows beyond all numbers is said to, and no part of it is infinite; runs of no length, stopped and
/// failed ones, there and back, have a summary.
#[test]
fn summaries_say_no_number_that_is_none() {
    let grows = Closure(|_, q, _| 1e4 * q);
    let blows_up = Closure(|_, q, _| q * q * q);
    let relaxing = Closure(|_, q, u| ((1.0 - q * q) * u - q) / 1e-2);
    let list: [Any<Closure>; 4] = [
        methods::Dop853.into(),
        methods::Radau5.into(),
        methods::Esdirk4.into(),
        methods::GraggBulirschStoer.into(),
    ];
    let (mut failed, mut beyond) = (0, 0);
    for (model, method) in
        [&grows, &blows_up, &relaxing].into_iter().flat_map(|m| list.iter().map(move |x| (m, x)))
    {
        for until in [0.0, 1e-300, 3.0, -3.0, 60.0] {
            let run =
                || model.simulate(at_rest_or_not([1.0], [0.5])).until(until).method(method).tolerance(1e-6);
            let run = || run().max_steps(3000);
            let stopped = run().event("near", |s| s.q[0] - 1.001).stop_at("near", Direction::Any);
            for run in [run().run(), stopped.run(), run().event("end", |s| s.t - until).run()] {
                failed += u32::from(run.is_err());
                let motion = run.or_else(|error| error.motion(model).ok_or(error)).unwrap();
                let said = motion.verify().to_string();
                assert!(!said.contains("inf") && !said.contains("NaN"), "{said}");
                beyond += u32::from(
                    said.contains("warning      energy grows beyond all numbers; give a smaller tolerance"),
                );
            }
        }
    }
    assert!(failed > 10 && beyond > 4, "{failed} {beyond}");
}

/// Between ten tolerances and what needs action there is a plain line.
#[test]
fn errors_beyond_ten_tolerances_are_told_plainly() {
    let mut told = 0;
    // Nearest distance: at the far end it is 2 less that.
    for (near, tolerance, periods) in
        [(0.3, 1e-5, 0.5), (0.3, 1e-7, 3.0), (0.6, 1e-7, 2.0), (0.8, 1e-9, 1.0), (0.8, 1e-9, 3.0)]
    {
        let orbit = at_rest_or_not([near, 0.0], [0.0, ((2.0 - near) / near).sqrt()]);
        for method in [Any::from(methods::DormandPrince5), methods::Dop853.into()] {
            let run = Kepler.simulate(orbit).until(periods * std::f64::consts::TAU).tolerance(tolerance);
            let summary = run.method(&method).run().unwrap().verify();
            let (text, shown) = (summary.to_string(), summary.accuracy.step_doubling.unwrap());
            let plain = text.contains("\n  accuracy     global error about ");
            assert_eq!(plain, shown > 10.0 && shown <= 300.0, "{shown} {text}");
            assert_eq!(summary.warnings().is_empty(), shown <= 300.0, "{shown} {text}");
            told += u32::from(plain);
        }
    }
    assert!(told > 2, "{told}");
}

/// Growth without bounds is no singularity.
#[test]
fn overflow_is_called_by_its_name() {
    let grows = Closure(|_, q, _| 1e4 * q);
    for method in [Any::from(methods::Dop853), methods::Verner9.into(), methods::Tsit5.into()] {
        let run =
            grows.simulate(at_rest_or_not([1.0], [0.0])).until(60.0).tolerance(1e-6).method(&method).run();
        let error = run.err().unwrap();
        assert!(matches!(error.kind, SimulationErrorKind::Overflow { coordinate: "x", .. }), "{error}");
        assert!(error.to_string().contains("grows beyond all numbers"), "{error}");
        assert!(error.to_string().lines().all(|line| line.len() < 300), "{error}");
    }
}

/// Accelerations that are beyond all numbers at the start are called that, and not a matter of the tolerance;
/// and those by the inverse square of a distance that vanishes, as of a plate that is pulled in, no jump.
#[test]
fn accelerations_beyond_all_bounds_are_called_by_their_name() {
    for model in [Closure(|_, q, _| -1e160 * q), Closure(|_, q, _| 1e160 * q)] {
        let error = model.simulate(at_rest_or_not([1.0], [0.0])).until(1.0).run().unwrap_err();
        assert!(
            matches!(error.kind, SimulationErrorKind::Overflow { coordinate: "x", order: 2, .. }),
            "{error}"
        );
        assert!(error.to_string().contains("the acceleration of `x` is "), "{error}");
    }
    let [plate, stronger]: [fn(f64, f64, f64) -> f64; 2] =
        [|_, q, u| 0.5 / (1.0 - q).powi(2) - q - 0.5 * u, |_, q, u| 4.5 / (1.0 - q).powi(2) - q - 0.5 * u];
    for plate in [Closure(plate), Closure(stronger)] {
        for tolerance in [1e-6, 1e-9, 1e-12] {
            let run = plate.simulate(at_rest_or_not([0.0], [0.0])).until(100.0).tolerance(tolerance).run();
            let error = run.unwrap_err();
            assert!(matches!(error.kind, SimulationErrorKind::StepsVanish { .. }), "{error}");
            assert!(
                error.state.q[0] < 1.0 && error.to_string().contains("as d - x in a force by"),
                "{error}"
            );
        }
    }
    // A jump is none of that.
    let rubs = Closure(|_, q, u| 0.1 - q - 10.0 * u.signum());
    let error = rubs.simulate(at_rest_or_not([0.0], [1.0])).until(10.0).tolerance(1e-9).run().unwrap_err();
    assert!(!matches!(error.kind, SimulationErrorKind::StepsVanish { .. }), "{error}");
}

/// A summary takes no longer than some runs: of many coordinates some states are looked at, and what would
/// take longer is named.
#[test]
fn a_summary_takes_its_share_of_the_run() {
    let start: [f64; 60] = std::array::from_fn(|i| 1.0 + 0.01 * i as f64);
    let motion = Sixty.simulate(at_rest_or_not(start, [0.0; 60])).until(100.0).run().unwrap();
    let summary = motion.verify();
    let (looked, all) = summary.conditioning.looked_at;
    assert!(all == motion.steps().len() && all > 150, "{summary}");
    // n²/8 evaluations each; 8 at least, and as many beside the worst.
    let share = 8 * motion.counts().evaluations as usize / (60 * 60);
    assert!(looked <= share.max(8) + 9 && looked < all, "{looked} of {all}, {share}");
    assert!(summary.to_string().contains(&format!(", of {looked} of {all} states")), "{summary}");
    assert!(summary.accuracy.unchecked.stiffness && summary.warnings().is_empty(), "{summary}");
    assert!(
        summary.to_string().ends_with("not checked  whether it is stiff: it takes longer than the run"),
        "{summary}"
    );
    // Of few coordinates all is looked at.
    let few =
        DoublePendulum::UNIT.simulate(at_rest_or_not([1.0, 0.0], [0.0, 0.0])).until(20.0).run().unwrap();
    let summary = few.verify();
    assert!(summary.conditioning.looked_at.0 == few.steps().len(), "{summary}");
    assert!(
        summary.accuracy.unchecked == Unchecked::default() && !summary.to_string().contains("not checked")
    );
}

/// Van der Pol's equation, μ = 1000, at tolerances at which an explicit method needs a million steps: an
/// implicit one goes on, and who insists on the explicit one is told why it takes so many.
#[test]
fn stiff_motions_are_handed_over_at_tight_tolerances_too() {
    let model = Closure(|_, q, u| 1e3 * (1.0 - q * q) * u - q);
    let simulate =
        |tolerance| model.simulate(at_rest_or_not([2.0], [0.0])).until(2000.0).tolerance(tolerance);
    let fine = simulate(1e-13).run().unwrap();
    for tolerance in [1e-11, 1e-12, 1e-13] {
        let motion = simulate(tolerance).run().unwrap();
        assert!(motion.switched().is_some() && motion.counts().steps < 10_000, "{}", motion.verify());
        // One jump lies between, which shifts by the error of the way to it.
        let apart = (motion.at(700.0).q() - fine.at(700.0).q()).amax();
        assert!(apart < 1e-7, "{tolerance:e}: {apart:e}");
    }
    // However few steps there are, and however stiff it is.
    let stiffer = Closure(|_, q, u| 1e6 * (1.0 - q * q) * u - q);
    for (model, most) in [(&model, 2_000), (&model, 40_000), (&stiffer, 2_000), (&stiffer, 20_000)] {
        let simulation = model.simulate(at_rest_or_not([2.0], [0.0])).until(2000.0).tolerance(1e-12);
        let error = simulation.method(methods::Dop853).max_steps(most).run().unwrap_err();
        assert!(matches!(error.kind, SimulationErrorKind::TooManySteps { stiff_at: Some(_), .. }), "{error}");
        assert!(error.to_string().contains("stiff at t = "), "{error}");
    }
    // What is only long is not called stiff.
    let oscillator = Oscillator { omega: 1.0 };
    let simulation = oscillator.simulate(at_rest_or_not([1.0], [0.0])).until(1e4).tolerance(1e-12);
    let error = simulation.method(methods::Dop853).max_steps(2_000).run().unwrap_err();
    assert!(matches!(error.kind, SimulationErrorKind::TooManySteps { stiff_at: None, .. }), "{error}");
    // Nor what `.max_step(..)` makes long.
    let simulation = oscillator.simulate(at_rest_or_not([1.0], [0.0])).until(100.0).tolerance(1e-6);
    let error = simulation.method(methods::Dop853).max_step(1e-3).max_steps(2_000).run().unwrap_err();
    assert!(matches!(error.kind, SimulationErrorKind::TooManySteps { stiff_at: None, .. }), "{error}");
    // What is stiff late has long steps before.
    let late = Closure(|t, q, u| -q - 5e5 * (1.0 + (t - 500.0).tanh()) * u);
    let simulation = late.simulate(at_rest_or_not([1.0], [0.0])).until(2000.0).tolerance(1e-12);
    let error = simulation.method(methods::Dop853).max_steps(40_000).run().unwrap_err();
    assert!(matches!(error.kind, SimulationErrorKind::TooManySteps { stiff_at: Some(_), .. }), "{error}");
    // What is not stiff goes on as it began.
    let oscillator = Oscillator { omega: 1.0 };
    let motion =
        oscillator.simulate(at_rest_or_not([1.0], [0.0])).until(1000.0).tolerance(1e-13).run().unwrap();
    assert_eq!(motion.switched(), None);
}

/// What is small against its tolerance is no slow motion with short steps, and what damps within a step
/// does work that no state between its ends tells.
#[test]
fn small_and_damped_motions_raise_no_false_alarm() {
    let swing = Closure(|_, q, _| -9.81 * q.sin());
    for (size, tolerance) in [(1e-3, 1e-5), (1e-5, 1e-7), (1e-7, 1e-8)] {
        for method in
            [Any::from(methods::Verner9), methods::Dop853.into(), methods::GraggBulirschStoer.into()]
        {
            let run = swing
                .simulate(at_rest_or_not([size], [0.0]))
                .until(300.0)
                .tolerance(tolerance)
                .method(&method);
            let summary = run.run().unwrap().verify();
            assert!(
                summary.accuracy.hidden_stiffness.is_none() && summary.stiff_at.is_none(),
                "{size:e} {summary}"
            );
        }
    }
    for c in [1e3, 1e5, 1e7] {
        let damped = Driven { m: 1.0, k: c, c };
        let mut start = PlainState::new(0.0, [0.0].into(), [0.0].into(), [0.0].into());
        for force in [1e-3, 1.0] {
            start.inputs[0] = force;
            for method in [None, Some(Any::from(methods::Radau5))] {
                let run = damped.simulate(start).until(20.0).tolerance(1e-6);
                let run = if let Some(method) = &method { run.method(method) } else { run };
                let summary = run.run().unwrap().verify();
                assert!(summary.warnings().is_empty(), "{summary}");
            }
        }
    }
}

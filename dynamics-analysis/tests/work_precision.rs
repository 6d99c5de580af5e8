//! Studies of error against cost: what they say is true, and what could not be trusted is refused.

use crate::common;

use std::cell::Cell;
use std::collections::HashSet;
use std::time::Duration;

use common::constrained::Rod;
use common::*;
use dynamics_analysis::{
    Analyze, Cost, ErrorOf, OutsideError, Page, Reference, Study, WorkPrecision, WorkPrecisionError,
};
use dynamics_runtime::methods::{Any, Dop853, DormandPrince5, Rk4};
use dynamics_runtime::output::Chart;
use dynamics_runtime::simulate::{Direction, Simulate, Simulation};

const END: f64 = 10.0;

fn study(model: &Oscillator) -> WorkPrecision<'_, Oscillator> {
    model.work_precision(at_rest_or_not([1.0], [0.5])).until(END).effort(Duration::ZERO)
}

/// The end in closed form.
fn exact(omega: f64) -> PlainState<1, 0> {
    let (s, c) = (omega * END).sin_cos();
    PlainState { t: END, ..at_rest_or_not([c + 0.5 / omega * s], [0.5 * c - omega * s]) }
}

fn ran<M: Simulate>(study: WorkPrecision<'_, M>) -> Study<'_, M> {
    study.run().unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn errors_are_those_of_the_closed_form_and_the_reference_knows_its_own() {
    let model = Oscillator { omega: 2.0 };
    let (by_runs, exact) = (ran(study(&model)), exact(2.0));
    let known = ran(study(&model).reference(Reference::known(exact, 1e-15)));
    let uncertainty = by_runs.uncertainty();
    assert!(uncertainty.positions < 1e-12 && uncertainty.velocities < 1e-12, "{uncertainty:?}");
    assert_eq!(by_runs.curves().len(), 4);
    for (runs, closed) in by_runs.curves().iter().zip(known.curves()) {
        assert_eq!((runs.name.as_str(), runs.points.len()), (closed.name.as_str(), 11));
        for (run, closed) in runs.points.iter().zip(&closed.points) {
            let (run, closed) = (run.outcome.as_ref().unwrap(), closed.outcome.as_ref().unwrap());
            for part in [ErrorOf::Positions, ErrorOf::Velocities, ErrorOf::State, ErrorOf::Energy] {
                let (a, b) = (run.errors.of(part).unwrap(), closed.errors.of(part).unwrap());
                let apart = uncertainty.of(part).unwrap() + 1e-14;
                assert!((a - b).abs() <= apart, "{part} of {}: {a:e} {b:e}", runs.name);
            }
            assert_eq!((run.errors.multipliers, run.evaluations), (None, closed.evaluations));
        }
    }
    // What the study measures is what the simulation does.
    let motion =
        model.simulate(at_rest_or_not([1.0], [0.5])).until(END).method(Dop853).tolerance(1e-6).run().unwrap();
    let point = &known.curve("DOP853 (order 8)").unwrap().points[3];
    let run = point.outcome.as_ref().unwrap();
    assert_eq!((point.setting, run.evaluations), (1e-6, Some(motion.counts().evaluations)));
    assert_eq!(run.errors.positions, (motion.end().q[0] - exact.q[0]).abs());
    assert!(run.time > Duration::ZERO);
}

/// What a study tells of an error is true to within what the reference may be wrong by, where all that there
/// is is rounding, too: three runs with the same steps round alike, and agreed.
#[test]
fn errors_are_true_to_within_the_uncertainty_where_steps_only_round() {
    let model = Closure(|_, _, _| 0.0);
    let some = (0..40).map(f64::from).map(|k| (0.3 * k - 5.0, 0.1 + 0.037 * k, 2.0 + 0.21 * k));
    for (from, v, end) in
        some.chain([(0.0, 0.1, 2.0), (1.0, 1.0 / 3.0, 10.0), (-0.7, 0.7, 3.3), (0.0, 1e-3, 7.0)])
    {
        let start = at_rest_or_not([from], [v]);
        let study = model.work_precision(start).until(end).tolerances([1e-6]).effort(Duration::ZERO);
        let study = match study.run() {
            Ok(study) => study,
            // All ends agree to rounding: that no error is believed is right.
            Err(WorkPrecisionError::NothingToBelieve { .. }) => continue,
            Err(error) => panic!("{error}"),
        };
        for curve in study.curves() {
            let method =
                if curve.name == "DOP853 (order 8)" { Any::from(Dop853) } else { DormandPrince5.into() };
            let true_end =
                model.simulate(start).until(end).tolerance(1e-6).method(&method).run().unwrap().end();
            let error = (true_end.q[0] - (from + v * end)).abs();
            let told = curve.points[0].outcome.as_ref().unwrap().errors.positions;
            let uncertainty = study.uncertainty().positions;
            assert!(
                (told - error).abs() <= uncertainty,
                "{}: {error:e}, told {told:e}, ± {uncertainty:e}",
                curve.name
            );
        }
    }
}

/// A kick that steps go over which have grown before it: runs that all miss it agree, and so would those of a
/// reference with steps as long.
#[test]
fn what_long_steps_miss_the_reference_has_seen() {
    let model = Closure(|t, _, _| (-((t - 50.0) / 0.2_f64).powi(2)).exp());
    let study = model.work_precision(at_rest_or_not([0.0], [1.0])).until(100.0).effort(Duration::ZERO);
    let found = ran(study
        .tolerances([1e-6])
        .methods([Dop853.into()])
        .variant("short steps", Dop853, |s| s.max_step(0.05)));
    let velocity = |curve| found.curve(curve).unwrap().points[0].outcome.as_ref().unwrap().errors.velocities;
    let kick = 0.2 * core::f64::consts::PI.sqrt();
    assert!((velocity("DOP853 (order 8)") - kick).abs() < 1e-6 && velocity("short steps") < 1e-6, "{found}");
}

#[test]
fn costs_lie_between_runs_and_no_error_is_reached_below_the_uncertainty() {
    let model = Oscillator { omega: 2.0 };
    let steps = (4..12).map(|k| END / f64::from(1 << k));
    let study = ran(study(&model)
        .methods([Rk4.into(), Dop853.into()])
        .steps(steps)
        .reference(Reference::known(exact(2.0), 1e-12)));
    let cost = |error: f64| study.cost("RK4 (order 4)", ErrorOf::State, error, Cost::Evaluations);
    // Order 4: sixteen times the accuracy for twice the evaluations.
    let ratio = cost(1e-7).unwrap() / cost(16e-7).unwrap();
    assert!((ratio - 2.0).abs() < 0.02, "{ratio}");
    let runs: Vec<(f64, f64)> = study.curves()[0]
        .points
        .iter()
        .map(|point| point.outcome.as_ref().unwrap())
        .map(|run| (run.errors.of(ErrorOf::State).unwrap(), run.evaluations.unwrap() as f64))
        .collect();
    for pair in runs.windows(2) {
        assert_eq!(cost(pair[1].0), Some(pair[1].1), "at a run it is that run");
        let between = cost((pair[0].0 * pair[1].0).sqrt()).unwrap();
        assert!(pair[0].1 < between && between < pair[1].1);
    }
    assert_eq!(cost(1e-13), None, "the reference is uncertain by more");
    assert_eq!(cost(1e-11), None, "no run is so accurate");
    assert_eq!(study.cost("another", ErrorOf::State, 1e-3, Cost::Time), None);
    assert_eq!(study.cost("RK4 (order 4)", ErrorOf::Multipliers, 1e-3, Cost::Time), None);
}

#[test]
fn multipliers_are_judged_apart() {
    let (model, start) = (Rod { m: 1.0, l: 1.0, g: 9.81 }, at_rest_or_not([1.0, 0.0], [0.0, 0.0]));
    let study = ran(model.work_precision(start).until(3.0).tolerances([1e-4, 1e-8]).effort(Duration::ZERO));
    assert_eq!(study.parts().len(), 5);
    for curve in study.curves() {
        let errors: Vec<f64> = curve
            .points
            .iter()
            .map(|point| point.outcome.as_ref().unwrap().errors.of(ErrorOf::Multipliers).unwrap())
            .collect();
        assert!(
            errors[1] > 0.0 && errors[1] < 1e-2 * errors[0] && errors[0] < 1.0,
            "{}: {errors:?}",
            curve.name
        );
    }
    assert!(study.to_string().contains("multipliers"));
}

#[test]
fn runs_that_fail_stay_in_the_table_with_their_reason() {
    let model = Oscillator { omega: 2.0 };
    let study = ran(study(&model)
        .methods([Dop853.into()])
        .variant("short of steps", DormandPrince5, |simulation| simulation.max_steps(40))
        .variant("stopped by an event of the model, DOP853 projected", Dop853, |simulation| {
            simulation.stop_at("centre", Direction::Falling)
        })
        .tolerances([1e-2, 1e-10]));
    let short = &study.curve("short of steps").unwrap().points;
    assert!(short[0].outcome.is_ok() && short[1].outcome.is_err());
    let table = study.to_string();
    assert!(
        table.lines().any(|line| line.starts_with("short of steps") && line.contains("failed: ")),
        "{table}"
    );
    assert!(
        table.lines().any(|line| line.starts_with("stopped") && line.contains("before the end")),
        "{table}"
    );
    assert!(study.chart().to_svg().contains("short of steps (1 failed)"));
    assert!(study.json_lines().lines().any(|line| line.contains("\"failure\":\"")));
    // What has no run left is no method that was not tried, and in narrow charts names are whole.
    assert!(study.chart().to_svg().contains("DOP853 projected (all 2 failed)"));
    let page = Page::new("").study(&study).to_html();
    let narrow = page.split("<div class=\"narrow\">").nth(1).unwrap().split("</svg>").next().unwrap();
    assert!(narrow.contains("2 failed)</text>") && !narrow.contains('…'), "{narrow}");
}

#[test]
fn what_cannot_be_trusted_is_refused() {
    let model = Oscillator { omega: 2.0 };
    let refused = |study: WorkPrecision<'_, Oscillator>| study.run().err().expect("refused");
    let loose = |end: PlainState<1, 0>, by: f64| study(&model).reference(Reference::known(end, by));
    use WorkPrecisionError::*;
    let end = exact(2.0);
    assert_eq!(
        refused(loose(end, 1e-4).tolerances([1e-9])),
        NothingToBelieve { uncertainty: 1e-4 },
        "errors below the uncertainty are no result"
    );
    assert!(matches!(refused(loose(end, 0.1)), NotConverged { what: "positions", .. }));
    assert_eq!(refused(loose(end, -1.0)), Uncertainty { value: -1.0 });
    assert!(matches!(refused(loose(end, f64::NAN)), Uncertainty { .. }));
    assert_eq!(refused(loose(PlainState { t: 9.0, ..end }, 0.0)), ReferenceState { time: 9.0, end: END });
    let broken = PlainState { q: [f64::NAN].into(), ..end };
    assert!(matches!(refused(loose(broken, 0.0)), ReferenceState { .. }));

    // A known end of another motion: the methods agree, and not with it.
    let wrong = refused(loose(exact(2.0 + 1e-7), 1e-15).tolerances([1e-6, 1e-13]));
    assert!(
        matches!(&wrong,
            Contradicted { what: "positions", distance, apart, .. } if *distance > 1e-7 && *apart < 1e-12),
        "{wrong}"
    );
    // Coarse runs, of several methods or of one, err by less than such an end does: runs near rounding tell.
    let off = |by: f64| PlainState { q: end.q.add_scalar(by), ..end };
    let coarse = |end| loose(end, 1e-10).tolerances([1e-4, 1e-6]);
    for study in [coarse(off(1e-3)), coarse(off(1e-3)).methods([Dop853.into()])] {
        let wrong = refused(study);
        assert!(
            matches!(&wrong, OtherEnd { what: "positions", distance, .. } if (distance - 1e-3).abs() < 1e-9),
            "{wrong}"
        );
    }
    // What is wrong by no more than was said is an end, and so is one that a single coarse run cannot tell
    // from its own error.
    assert!(coarse(off(1e-10)).run().is_ok() && coarse(end).methods([Dop853.into()]).run().is_ok());
    let turned = PlainState { u: -end.u, ..end };
    assert!(matches!(refused(loose(turned, 1e-15)), Contradicted { what: "velocities", .. }));
    // Steps of two sizes by one method err alike, and may.
    let alike =
        loose(end, 1e-15).variant("DOP853", Dop853, |s| s).variant("the same", Dop853, |s| s.max_step(5.0));
    assert!(alike.tolerances([1e-4]).run().is_ok());

    let none = refused(loose(end, 1e-15).variant("short", Dop853, |simulation| simulation.max_steps(1)));
    assert!(matches!(&none, NoRunSucceeded { method, .. } if method == "short"), "{none}");
    let stopped = study(&model).with(|simulation| simulation.stop_at("centre", Direction::Falling));
    assert!(matches!(refused(stopped), ReferenceFails { .. }));

    // A fall into the centre: every run of the reference stops short of it.
    let fall = Kepler.work_precision(at_rest_or_not([1.0, 0.0], [0.0, 0.0])).until(2.0).run();
    assert!(matches!(fall.err(), Some(ReferenceFails { .. })));
    // Errors double in less than a second: after two minutes nothing is left of sixteen digits.
    let chaos = DoublePendulum { m1: 1.0, m2: 1.0, l1: 1.0, l2: 1.0, g: 9.81 };
    let chaos = chaos.work_precision(at_rest_or_not([2.5, 2.0], [0.0, 0.0])).until(120.0).run().err();
    assert!(matches!(chaos, Some(NotConverged { .. })), "{chaos:?}");
}

/// What is not the same from run to run has no error: a variant whose steps depend on how often it was asked
/// for, and one that then fails.
#[test]
fn runs_that_end_elsewhere_when_they_are_repeated_have_failed() {
    let (model, asked, failing) = (Oscillator { omega: 2.0 }, Cell::new(0), Cell::new(0));
    let again = |count: &Cell<u32>| count.replace(count.get() + 1) > 0;
    let study = ran(study(&model)
        .methods([Dop853.into()])
        .variant("wandering", Dop853, |s| if again(&asked) { s.max_step(0.1) } else { s })
        .variant("failing", Dop853, |s| if again(&failing) { s.max_steps(2) } else { s })
        .tolerances([1e-6]));
    let outcome = |name| study.curve(name).unwrap().points[0].outcome.as_ref();
    assert!(
        outcome("wandering").unwrap_err().starts_with("it ends elsewhere when it is repeated, by"),
        "{study}"
    );
    assert!(outcome("failing").unwrap_err().starts_with("it fails when it is repeated"), "{study}");
    assert_eq!(outcome("DOP853 (order 8)").unwrap().repeats, Some(3));
}

#[test]
fn options_without_sense_are_named() {
    let model = Oscillator { omega: 2.0 };
    let refused = |study: WorkPrecision<'_, Oscillator>| study.run().err().expect("refused").to_string();
    let open = || model.work_precision(at_rest_or_not([1.0], [0.0]));
    for (study, message) in [
        (open(), "the study has no end"),
        (open().until(f64::NAN), "a motion until NaN"),
        (open().until(0.0), "a motion until 0"),
        (study(&model).methods([]), "a list of methods is empty"),
        (study(&model).methods([Dop853.into()]).methods_at([0.1], []), "a list of methods is empty"),
        (study(&model).tolerances([]), "DOP853 (order 8) has no tolerances"),
        (study(&model).methods([Rk4.into()]), "RK4 (order 4) has no steps"),
        (study(&model).default_method().default_method(), "two curves are called default method"),
        (study(&model).methods_at([], [Dop853.into()]), "DOP853 (order 8) has no tolerances"),
        (study(&model).methods_at([], [Rk4.into()]).steps([0.1]), "RK4 (order 4) has no steps"),
        (study(&model).methods_at([1e-3, 0.0], [Dop853.into()]), "0 is not possible among the tolerances"),
        (study(&model).methods_at([-0.1], [Rk4.into()]), "-0.1 is not possible among the steps"),
        (study(&model).tolerances([1e-3, -1.0]), "-1 is not possible among the tolerances"),
        (study(&model).tolerances([f64::NAN]), "NaN is not possible among the tolerances"),
        (
            study(&model).steps([0.1]),
            "no method runs with the steps of `.steps([..])`; add one with a fixed step",
        ),
        (
            study(&model).methods([Rk4.into()]).steps([0.1]).tolerances([1e-6]),
            "no method runs with the tolerances of `.tolerances([..])`; add one with step control",
        ),
        (study(&model).methods([Rk4.into()]).steps([f64::INFINITY]), "inf is not possible among the steps"),
        (study(&model).methods([Dop853.into(), Dop853.into()]), "two curves are called DOP853 (order 8)"),
        (study(&model).reference(Reference::runs(Dop853, Rk4, 1e-14)), "the reference by RK4 (order 4)"),
        (
            study(&model).reference(Reference::runs(Dop853, Dop853, 0.0)),
            "0 is not possible among the tolerances",
        ),
    ] {
        let said = refused(study);
        assert!(said.starts_with(message), "{said}");
    }
}

/// What is cheap for one method takes another for ever: lists of their own, in any order, beside those of
/// all.
#[test]
fn methods_run_at_tolerances_and_steps_of_their_own() {
    let model = Oscillator { omega: 2.0 };
    let study = ran(study(&model)
        .tolerances([1e-4, 1e-9])
        .methods([Dop853.into()])
        .methods_at([1e-5, 1e-3], [DormandPrince5.into()])
        .methods_at([0.01, 0.02], [Rk4.into()]));
    let settings =
        study.curves().iter().map(|curve| curve.points.iter().map(|point| point.setting).collect::<Vec<_>>());
    assert_eq!(settings.collect::<Vec<_>>(), [[1e-4, 1e-9], [1e-3, 1e-5], [0.02, 0.01]]);
    let steps = |k: usize| {
        study.curves()[k].points.iter().map(|point| point.outcome.as_ref().unwrap().steps.unwrap())
    };
    assert_eq!(steps(2).collect::<Vec<_>>(), [500, 1000]);
    let alone = [1e-3, 1e-5].map(|tolerance| {
        let simulation = model.simulate(at_rest_or_not([1.0], [0.5])).until(END).method(DormandPrince5);
        simulation.tolerance(tolerance).run().unwrap().counts().steps
    });
    assert_eq!(steps(1).collect::<Vec<_>>(), alone);
}

/// At each tolerance the curve of the default method is what a simulation chooses there.
#[test]
fn the_default_method_stands_beside_the_named_ones() {
    let (model, tolerances) = (Oscillator { omega: 2.0 }, [1e-3, 1e-5, 1e-9]);
    let found = ran(study(&model).tolerances(tolerances).default_method().methods([Dop853.into()]));
    let evaluations = |curve: &str| {
        let points = &found.curve(curve).unwrap().points;
        points.iter().map(|point| point.outcome.as_ref().unwrap().evaluations).collect::<Vec<_>>()
    };
    let (default, named) = (evaluations("default method"), evaluations("DOP853 (order 8)"));
    for (tolerance, found) in tolerances.into_iter().zip(&default) {
        let simulation = model.simulate(at_rest_or_not([1.0], [0.5])).until(END);
        let motion = simulation.tolerance(tolerance).run().unwrap();
        assert_eq!(*found, Some(motion.counts().evaluations), "{tolerance}");
    }
    let same: Vec<bool> = default.iter().zip(&named).map(|(a, b)| a == b).collect();
    assert_eq!(same, [false, true, false]);
    // It is no further method for advice, and does not stand in for those that are studied by default.
    assert!(found.sentences().iter().all(|text| !text.contains("is default method")), "{found}");
    assert!(found.sentences().iter().any(|text| text.contains("the default method takes")), "{found}");
    assert_eq!(ran(study(&model).default_method()).curves().len(), 5);
}

#[cfg(feature = "json")]
#[test]
fn measurements_from_elsewhere_are_judged_by_the_same_reference() {
    let model = Oscillator { omega: 2.0 };
    let mut own = ran(study(&model).methods([Dop853.into()]).tolerances([1e-4, 1e-8]));
    let lines =
        own.json_lines().replace("DOP853 (order 8)", "another").replace("\"positions\"", "\"passed over\"");
    assert_eq!(own.add_outside(&lines).unwrap(), 2);
    let (ours, theirs) = (&own.curves()[0], &own.curves()[1]);
    assert!(!ours.outside && theirs.outside);
    for (a, b) in ours.points.iter().zip(&theirs.points) {
        assert_eq!(a.outcome, b.outcome, "the end tells the errors");
    }
    let comparison = own.comparison(ErrorOf::State, Cost::Evaluations, &[1e-4]);
    assert!(comparison.lines().last().unwrap().ends_with(" 1"), "{comparison}");

    let text = r#"
        {"problem":"elsewhere","solver":"x","tolerance":1e-3}
        {"problem":"Oscillator","solver":"x","tolerance":1e-3,"time_us":30,"positions":1e-3}
        {"problem":"Oscillator","solver":"x","tolerance":1e-3,"time_us":10,"positions":1e-3}
        {"problem":"Oscillator","solver":"x","tolerance":1e-3,"time_us":20,"positions":1e-3}
        {"problem":"Oscillator","solver":"x","tolerance":1e-6,"failure":"it gave up"}"#;
    assert_eq!(own.add_outside(text).unwrap(), 4);
    let x = &own.curve("x").unwrap().points;
    assert_eq!(x[0].outcome.as_ref().unwrap().time, Duration::from_micros(20), "the median of three");
    assert_eq!(x[1].outcome.as_ref().unwrap_err(), "it gave up");
    assert_eq!(own.cost("x", ErrorOf::State, 1e-3, Cost::Time), Some(20e-6));

    let line =
        |rest: &str| format!("\n{{\"problem\":\"Oscillator\",\"solver\":\"y\",\"tolerance\":1e-3{rest}}}");
    for (text, problem) in [
        ("{\"solver\":1}".to_string(), "line 1 is no measurement: `problem` is no text"),
        (line(""), "line 2 is no measurement: `time_us` is missing or 0"),
        (line(",\"time_us\":1"), "line 2 is no measurement: neither `end` nor `positions` is there"),
        (line(",\"time_us\":1,\"end\":[1]"), "line 2 is no measurement: `end` has 1 numbers"),
        (
            line(",\"time_us\":1,\"positions\":-1"),
            "line 2 is no measurement: `positions` is no number of at least 0",
        ),
        (
            line(",\"time_us\":1,\"positions\":1").replace('y', "x"),
            "line 2 is no measurement: there is a curve `x` already",
        ),
        ("nonsense".to_string(), "line 1 is no measurement: expected ident"),
    ] {
        let said = own.add_outside(&text).unwrap_err().to_string();
        assert!(said.starts_with(problem), "{said}");
    }
    assert!(matches!(own.read_outside("/no/such/file"), Err(OutsideError::File { .. })));
}

/// An end from elsewhere has the inputs that the motion has there, not those of the start.
#[cfg(feature = "json")]
#[test]
fn ends_from_elsewhere_have_the_inputs_of_the_end() {
    let PlainState { t, q, u, active_set, .. } = at_rest_or_not([1.0], [0.5]);
    let start = PlainState { t, q, u, inputs: [0.0].into(), active_set };
    let lifted = |simulation: Simulation<'static, Lifted>| simulation.inputs(|t, _| [3.0 * t]);
    let study =
        Lifted.work_precision(start).until(END).with(lifted).tolerances([1e-4]).effort(Duration::ZERO);
    let mut own = ran(study.methods([Dop853.into()]));
    assert_eq!(own.add_outside(&own.json_lines().replace("DOP853 (order 8)", "another")).unwrap(), 1);
    let energy = |k: usize| own.curves()[k].points[0].outcome.as_ref().unwrap().errors.energy;
    assert_eq!(energy(0), energy(1));
    assert!(energy(0) > 0.0 && energy(0) < 1e-2);
}

/// Which method to take, in a sentence for each accuracy that was reached.
#[cfg(feature = "json")]
#[test]
fn sentences_name_the_cheapest_and_what_is_alike() {
    let model = Oscillator { omega: 2.0 };
    let mut study =
        ran(study(&model).methods([Dop853.into(), DormandPrince5.into()]).tolerances([1e-4, 1e-7]));
    let line = |solver: &str, time: f64, evaluations: u32| {
        format!(
            "{{\"problem\":\"Oscillator\",\"solver\":\"{solver}\",\"tolerance\":1e-3,\"time_us\":{time},\
             \"positions\":1e-4,\"evaluations\":{evaluations}}}\n"
        )
    };
    let lines = [line("a", 1.0, 9), line("b", 1.05, 8), line("c", 1.2, 70)].concat();
    assert_eq!(study.add_outside(&lines).unwrap(), 3);
    let sentences = study.sentences();
    assert_eq!(
        sentences[0],
        "to 0.001 in positions and velocities: fastest here is a (measured elsewhere) with 1 µs (alike: b \
         (measured elsewhere) with 1.05); fewest evaluations, on any machine: b (measured elsewhere) with 8"
    );
    let second = &sentences[1];
    assert!(
        second.starts_with("to 10⁻⁶ in") && second.contains("evaluations, on any machine: DOP853"),
        "{second}"
    );
    assert_eq!(sentences.len(), 2, "no run has an error of 1e-9: {sentences:?}");
    assert!(study.to_string().ends_with(sentences[1].as_str()));
}

/// Of sixteen curves each has a look of its own: after a round of eight colours comes another sign.
#[test]
fn many_curves_differ() {
    let model = Oscillator { omega: 2.0 };
    let study = (0..16).fold(study(&model).tolerances([1e-4]), |study, k| {
        study.variant(format!("number {k}"), Dop853, move |s| s.max_step(1.0 + f64::from(k)))
    });
    let svg = Chart::from(ran(study).panel(ErrorOf::State, Cost::Evaluations)).to_svg();
    let sample = |k: usize| {
        let name = svg.find(&format!(">number {k}</text>")).unwrap();
        let sign = svg[..name].lines().rev().nth(1).unwrap();
        let color = sign.split("fill=\"").nth(1).unwrap().split('"').next().unwrap();
        (sign.split(' ').next().unwrap().to_string(), sign.matches(',').count(), color.to_string())
    };
    let looks: HashSet<_> = (0..16).map(sample).collect();
    assert_eq!(looks.len(), 16, "{looks:?}");
}

#[test]
fn charts_show_what_is_believed_and_what_is_not() {
    let model = Oscillator { omega: 2.0 };
    let reference = || Reference::known(exact(2.0), 1e-8);
    let study_of = |tolerances: &[f64]| {
        ran(study(&model)
            .methods([Dop853.into()])
            .tolerances(tolerances.iter().copied())
            .reference(reference()))
    };
    let hollow = |tolerances: &[f64]| {
        let chart = study_of(tolerances).chart().to_svg();
        assert!(chart.contains("uncertainty of the reference"));
        chart.matches("fill=\"#ffffff\" stroke=").count()
    };
    assert_eq!(hollow(&[1e-3, 1e-4]), 0);
    assert!(hollow(&[1e-3, 1e-13]) > 0);

    let study = study_of(&[1e-3, 1e-13]);
    assert!(study.to_string().contains("< 10⁻⁸"), "{study}");
    let page = Page::new("a <page>").text("measured & drawn").study(&study).to_html();
    assert!(page.contains("<h1>a &lt;page&gt;</h1>") && page.contains("measured &amp; drawn"));
    // Tables scroll by themselves, with names that are short: their captions stand above.
    assert!(page.contains("table{display:block;") && !page.contains("<pre>"));
    assert!(page.contains("to an error of positions of</p>\n<table>\n<tr><th></th><th>0.001</th>"), "{page}");
    // A chart drawn for wide windows has letters of 7 pixels on a telephone: there is one drawn for those
    // beside each.
    let narrow = |page: &str| {
        let charts = page.split("<div class=\"narrow\">").skip(1);
        charts
            .map(|chart| chart.split_once(" width=\"").unwrap().1.split('"').next().unwrap().parse().unwrap())
            .collect()
    };
    let widths: Vec<f64> = narrow(&page);
    assert_eq!(widths.len(), page.matches("<figure>").count());
    assert!(!widths.is_empty() && widths.iter().all(|width| *width <= 360.0), "{widths:?}");
    // Each error stands over time and over evaluations; what is pointed at says which run it is, where there
    // is something to point with.
    let panels = ["positions and velocities", "positions", "velocities", "energy"];
    assert!(
        panels.iter().all(|part| page.matches(&format!(">error of {part}</text>")).count() == 4),
        "{page}"
    );
    assert_eq!(widths.len(), 2 * panels.len());
    let said = "<title>DOP853 (order 8), tolerance 1e-3: error ";
    let drawn: Vec<&str> = page.split("<div class=\"narrow\">").collect();
    assert!(drawn[0].contains(said) && !drawn[1].split("</svg>").next().unwrap().contains(said), "{page}");
    assert!(
        page.contains("times are medians of 3 repeats") && page.contains("evaluations to an error of"),
        "{page}"
    );
    let outside = page.replace("http://www.w3.org/2000/svg", "");
    assert!(!outside.contains("http") && !outside.contains("<script"), "no network, nothing to run");
}

//! Models of one scene beside each other: differences are those of closed forms, and what could not be
//! trusted is refused.

use crate::common;

use std::time::Duration;

use common::constrained::Rod;
use common::*;
use dynamics_analysis::{Comparison, Ladder, LadderError, Page, Rung, compare};
use dynamics_runtime::methods::Rk4;
use dynamics_runtime::simulate::Direction;

fn oscillator<'m>(name: &str, model: &'m Oscillator) -> Rung<'m, Oscillator> {
    Rung::new(name, model, at_rest_or_not([1.0], [0.0])).output("x", |_, state| state.q[0])
}

fn ran(ladder: Ladder<'_>) -> Comparison {
    ladder.effort(Duration::ZERO).run().unwrap_or_else(|error| panic!("{error}"))
}

fn refused(ladder: Ladder<'_>) -> LadderError {
    ladder.effort(Duration::ZERO).run().expect_err("refused")
}

const SLOW: Oscillator = Oscillator { omega: 1.9 };
const NEAR: Oscillator = Oscillator { omega: 1.999 };
const FULL: Oscillator = Oscillator { omega: 2.0 };

const KICKED: Closure = Closure(|t, _, _| (-((t - 50.0) / 0.2_f64) * ((t - 50.0) / 0.2)).exp());

fn oscillators<'m>() -> Ladder<'m> {
    let rungs = compare("oscillators").rung(oscillator("slow", &SLOW)).rung(oscillator("near", &NEAR));
    rungs.rung(oscillator("full", &FULL)).until(10.0)
}

#[test]
fn differences_are_those_of_the_closed_form() {
    let found = ran(oscillators());
    assert_eq!((found.scene(), found.interval(), found.rungs().len()), ("oscillators", (0.0, 10.0), 3));
    // The starts are steps, and steps join the equal intervals.
    assert!(found.times().len() > 1001 && found.times().windows(2).all(|pair| pair[0] < pair[1]));
    for (name, omega) in [("slow", 1.9), ("near", 1.999)] {
        let apart = |t: f64| (omega * t).cos() - (2.0 * t).cos();
        let fine: Vec<f64> = (0..=100_000).map(|k| apart(1e-4 * f64::from(k))).collect();
        let largest = fine.iter().fold(0.0f64, |most, d| most.max(d.abs()));
        let rms = (fine.iter().map(|d| d * d).sum::<f64>() / 100_000.0).sqrt();
        let difference = found.difference(name, "x").unwrap();
        assert!((difference.largest / largest - 1.0).abs() < 1e-3, "{} {largest}", difference.largest);
        assert!((difference.rms / rms - 1.0).abs() < 1e-3, "{} {rms}", difference.rms);
        assert!((apart(difference.at).abs() - difference.largest).abs() < 1e-8);
        assert!(difference.is_believed() && difference.uncertainty < 1e-7 && difference.at_start == 0.0);
        let rung = found.rung(name).unwrap();
        for (t, x) in found.times().iter().zip(&rung.values[0]) {
            assert!((x - (omega * t).cos()).abs() < difference.uncertainty, "at {t}");
        }
        assert!(rung.evaluations > 0 && rung.steps > 0 && rung.time > Duration::ZERO);
        assert_eq!((rung.coordinates, rung.constraints, rung.operations), (1, 0, None));
    }
    assert!((found.outputs()[0].scale - 1.0).abs() < 1e-8);
    assert_eq!(found.difference("full", "x").unwrap().largest, 0.0);
    assert_eq!((found.difference("none", "x"), found.difference("slow", "y")), (None, None));
}

#[test]
fn the_plainest_rung_that_suffices_is_named() {
    let found = ran(oscillators());
    let of = |accuracy| found.sufficient(accuracy).unwrap();
    // cos 1.999 t differs from cos 2 t by up to 10 · 0.001 · sin 20, cos 1.9 t by up to 2 sin 0.44.
    let near = of(0.011);
    assert_eq!((near.rung.as_str(), near.full.as_str(), near.work_ratio), ("near", "full", None));
    assert!((near.off_by - 0.0091).abs() < 1e-4, "{}", near.off_by);
    assert!(
        near.too_plain
            .as_ref()
            .is_some_and(|(rung, off_by)| rung == "slow" && (*off_by - 0.857).abs() < 0.01)
    );
    let said = near.to_string();
    assert!(
        said.starts_with("to 1.1 % of x `near` suffices (off by ") && said.contains(", `slow` by 86 %"),
        "{said}"
    );
    assert!(said.contains("`full` costs ") && said.ends_with(" times its time"), "{said}");
    let full = of(1e-3);
    assert_eq!((full.rung.as_str(), full.off_by, full.time_ratio), ("full", 0.0, 1.0));
    assert!(full.to_string().starts_with("to 0.1 % of x it takes `full`; `near` is off by "), "{full}");
    assert_eq!(of(2.5).rung, "slow");
    assert_eq!(found.sufficient_for("x", 0.011), Ok(near));
    // In parts of ten times as much, a tenth of the accuracy suffices.
    assert_eq!(ran(oscillators().scale("x", 10.0)).sufficient(1.1e-3).unwrap().rung, "near");

    assert_eq!(found.sufficient(0.0), Err(LadderError::Accuracy { accuracy: 0.0 }));
    assert!(matches!(found.sufficient(f64::NAN), Err(LadderError::Accuracy { .. })));
    assert!(matches!(found.sufficient(1e-15), Err(LadderError::TooFine { accuracy: 1e-15, .. })));
    assert!(matches!(
        found.sufficient_for("X", 0.1),
        Err(LadderError::UnknownOutput { suggestion: Some(_), .. })
    ));
}

/// A pendulum in its angle and the same one in Cartesian coordinates on its rod.
fn pendulums<'m>(minimal: &'m Pendulum, redundant: &'m Rod) -> Ladder<'m> {
    let l = redundant.l;
    compare("pendulum")
        .rung(Rung::new("angle", minimal, at_rest_or_not([1.0], [0.0])))
        .rung(
            Rung::new(
                "coordinates and rod",
                redundant,
                at_rest_or_not([l * 1f64.sin(), -l * 1f64.cos()], [0.0; 2]),
            )
            .output("tension", move |motion, state| -l * motion.multipliers_of(state)[0]),
        )
        .until(5.0)
}

#[test]
fn models_that_agree_agree_to_their_own_errors() {
    let (minimal, redundant) = (Pendulum { m: 2.0, l: 0.7, g: 9.81 }, Rod { m: 2.0, l: 0.7, g: 9.81 });
    let found = ran(pendulums(&minimal, &redundant));
    let difference = found.difference("angle", "tension").unwrap();
    assert!(difference.uncertainty > 0.0 && difference.bound() < 1e-5, "{difference:?}");
    assert_eq!(found.sufficient(1e-6).unwrap().rung, "angle");
    assert!(matches!(found.sufficient(1e-12), Err(LadderError::TooFine { .. })));
    assert_eq!((found.rungs()[1].coordinates, found.rungs()[1].constraints), (2, 1));
}

#[test]
fn starts_that_do_not_correspond_are_pointed_out() {
    let said = |x: f64| {
        let other =
            Rung::new("other start", &FULL, at_rest_or_not([x], [0.0])).output("x", |_, state| state.q[0]);
        let ladder = compare("starts").rung(other).rung(oscillator("full", &FULL)).until(10.0);
        ran(ladder).to_string()
    };
    assert!(said(1.1).contains("`other start` differs in x by 0.1 at the start already"));
    assert!(!said(1.0).contains("at the start"));
    assert!(!ran(oscillators()).to_string().contains("at the start"));
}

#[test]
fn motions_may_run_backwards() {
    let found = ran(oscillators().until(-10.0));
    assert!(found.times().windows(2).all(|pair| pair[0] > pair[1]));
    let (back, forth) = (found.difference("near", "x").unwrap(), ran(oscillators()));
    let forth = forth.difference("near", "x").unwrap();
    assert!((back.largest - forth.largest).abs() < 1e-6 && (back.rms - forth.rms).abs() < 1e-6);
}

#[test]
fn what_cannot_be_trusted_is_refused() {
    // Errors double in less than a second: after two minutes nothing is left of two models' difference.
    let (a, b) = (DoublePendulum::UNIT, DoublePendulum { g: 9.81, ..DoublePendulum::UNIT });
    fn rung<'m>(name: &str, model: &'m DoublePendulum) -> Rung<'m, DoublePendulum> {
        Rung::new(name, model, at_rest_or_not([2.5, 2.0], [0.0; 2])).output("x", |_, state| state.q[0].sin())
    }
    let chaos = |end| compare("chaos").rung(rung("a", &a)).rung(rung("b", &b)).until(end);
    let error = refused(chaos(120.0));
    assert!(matches!(&error, LadderError::NotConverged { output, .. } if output == "x"), "{error}");
    assert!(ran(chaos(1.0)).difference("a", "x").unwrap().is_believed());

    // A kick that long steps go over, on both rungs.
    let kick =
        |name| Rung::new(name, &KICKED, at_rest_or_not([0.0], [1.0])).output("x", |_, state| state.q[0]);
    let error = refused(compare("kick").rung(kick("one")).rung(kick("other")).until(100.0));
    assert!(matches!(error, LadderError::NotConverged { .. }), "{error}");

    let stopped =
        oscillators().rung(oscillator("x", &FULL).with(|s| s.stop_at("centre", Direction::Falling)));
    assert!(matches!(
        &refused(stopped),
        LadderError::Fails { rung, reason, .. }
        if rung == "x" && reason.contains("before the end")
    ));
    let fixed = oscillators().rung(oscillator("x", &FULL).with(|s| s.method(Rk4).fixed_step(0.1)));
    assert!(matches!(refused(fixed), LadderError::Fails { .. }));
    let nowhere =
        |rung: Rung<'static, Oscillator>| rung.output("x", |_, s| if s.t > 9.0 { f64::NAN } else { 1.0 });
    let error = refused(oscillators().rung(nowhere(oscillator("nan", &FULL))));
    assert!(
        matches!(&error, LadderError::NotFinite { rung, time, .. } if rung == "nan" && *time > 9.0),
        "{error}"
    );
    let nothing = oscillators().rung(oscillator("rest", &FULL).output("x", |_, _| 0.0));
    assert_eq!(refused(nothing), LadderError::NoScale { output: "x".into() });
    assert!(
        ran(oscillators().rung(oscillator("rest", &FULL).output("x", |_, _| 0.0)).scale("x", 1.0))
            .sufficient(1.1)
            .is_ok()
    );
}

#[test]
fn options_without_sense_are_named() {
    let pendulum = Pendulum { m: 1.0, l: 1.0, g: 9.81 };
    let open = || compare("x").rung(oscillator("a", &SLOW));
    let two = || open().rung(oscillator("b", &FULL));
    let late = PlainState { t: 1.0, ..at_rest_or_not([1.0], [0.0]) };
    for (ladder, message) in [
        (two(), "the comparison has no end"),
        (two().until(0.0), "motions until 0 cannot"),
        (two().until(f64::NAN), "motions until NaN cannot"),
        (open().until(1.0), "a ladder of 1 rungs"),
        (two().rung(oscillator("a", &FULL)).until(1.0), "two rungs are called `a`"),
        (open().rung(Rung::new("late", &FULL, late)).until(2.0), "`a` starts at t = 0 and `late` at t = 1"),
        (two().until(1.0).tolerance(1e-13), "at tolerance 1e-13 errors cannot be told"),
        (two().until(1.0).tolerance(f64::NAN), "at tolerance NaN errors"),
        (two().until(1.0).intervals(0), "0 intervals are no common times"),
        (
            open().rung(Rung::new("p", &pendulum, at_rest_or_not([1.0], [0.0]))).until(1.0),
            "no output is common",
        ),
        (two().outputs(["y"]).until(1.0), "`a` has no output `y`; `x` is there"),
        (two().until(1.0).scale("x", -1.0), "-1 is no scale for `x`"),
        (two().until(1.0).scale("z", 1.0), "`z` has a scale and is not compared"),
    ] {
        let said = refused(ladder).to_string();
        assert!(said.starts_with(message), "{said}");
        assert!(said.contains("; "), "problem; remedy: {said}");
    }
}

#[test]
fn pages_and_charts_show_every_rung() {
    let found = ran(oscillators());
    let table = found.table();
    assert!(table.lines().count() == 4 && table.lines().nth(3).unwrap().contains('±'), "{table}");
    let svg = found.chart().to_svg();
    for name in ["slow", "near", "full", "largest difference", "difference of x"] {
        assert!(svg.contains(name), "{name}");
    }
    let page = Page::new("ladder").comparison(&found).to_html();
    assert!(page.contains("to 1 % of x") && page.contains("fullest of 3 models"));
    let outside = page.replace("http://www.w3.org/2000/svg", "");
    assert!(!outside.contains("http") && !outside.contains("<script"), "no network, nothing to run");
}

//! The error of a motion by a second run, against closed forms and published values.

use crate::common;

use common::*;
use dynamics_runtime::methods::{self, Any};
use dynamics_runtime::model::ModelState;
use dynamics_runtime::simulate::{
    Direction, Motion, OptionError, ReferenceSettings, Simulate, SimulationErrorKind,
};

const OSCILLATOR: Oscillator = Oscillator { omega: 2.0 };

fn from_one() -> PlainState<1, 0> {
    at_rest_or_not([1.0], [0.0])
}

/// Largest errors of x = cos 2t and ẋ at the steps.
fn true_errors(motion: &Motion<'_, Oscillator>) -> [f64; 2] {
    motion.steps().fold([0.0f64; 2], |[q, u], state| {
        let (sine, cosine) = (2.0 * state.t()).sin_cos();
        [q.max((state.q[0] - cosine).abs()), u.max((state.u[0] + 2.0 * sine).abs())]
    })
}

/// The second run's own error is at most a few percent of the first one's: smaller by 100 to the power that
/// the method follows its tolerance with.
#[test]
fn the_estimate_is_the_error_of_the_closed_form() {
    let list: [Any<Oscillator>; 5] = [
        methods::DormandPrince5.into(),
        methods::Tsit5.into(),
        methods::Dop853.into(),
        methods::Verner9.into(),
        methods::Radau5.into(),
    ];
    for method in &list {
        for tolerance in [1e-4, 1e-6, 1e-8, 1e-10] {
            let simulation = OSCILLATOR.simulate(from_one()).until(30.0).tolerance(tolerance).method(method);
            let motion = simulation.estimate_error().run().unwrap();
            let estimate = motion.global_error().unwrap();
            let tighter =
                ReferenceSettings::Tighter { absolute: tolerance / 100.0, relative: tolerance / 100.0 };
            assert_eq!(estimate.reference, tighter);
            let found = [estimate.coordinates.error, estimate.velocities.error];
            println!("{method} {tolerance:e}: {found:?} for {:?}", true_errors(&motion));
            for (found, exact) in found.into_iter().zip(true_errors(&motion)) {
                assert!(
                    (found / exact - 1.0).abs() < 0.1,
                    "{method} at {tolerance:e}: {found:e} for {exact:e}"
                );
            }
            assert_eq!(
                (estimate.lost_at, estimate.doubling_time),
                (None, None),
                "an oscillator is not chaotic"
            );
            assert_eq!(estimate.history.len(), motion.steps().len());
            // The run itself is the one without estimate.
            let plain = OSCILLATOR
                .simulate(from_one())
                .until(30.0)
                .tolerance(tolerance)
                .method(method)
                .run()
                .unwrap();
            assert_eq!(
                (plain.end(), plain.counts().evaluations),
                (motion.end(), motion.counts().evaluations)
            );
            assert!(plain.global_error().is_none() && plain.summary().error.is_none());
            let summary = motion.verify().to_string();
            assert!(summary.contains("\n  error        coordinates "), "{summary}");
        }
    }
}

#[test]
fn halved_steps_estimate_the_error_of_fixed_ones() {
    for h in [0.1, 0.05, 0.02] {
        let motion =
            OSCILLATOR.simulate(from_one()).until(10.0).fixed_step(h).estimate_error().run().unwrap();
        let estimate = motion.global_error().unwrap();
        assert_eq!((estimate.reference, estimate.ratio), (ReferenceSettings::HalfStep(0.5 * h), None));
        let exact = true_errors(&motion);
        for (found, exact) in [estimate.coordinates.error, estimate.velocities.error].into_iter().zip(exact) {
            assert!((found / exact - 1.0).abs() < 0.05, "h = {h}: {found:e} for {exact:e}");
        }
    }
}

/// Where rounding permits no smaller tolerance the second run has a larger one, and what is found bounds the
/// error.
#[test]
fn at_the_finest_tolerance_the_estimate_is_a_bound() {
    let motion = OSCILLATOR.simulate(from_one()).until(30.0).tolerance(1e-14).estimate_error().run().unwrap();
    let estimate = motion.global_error().unwrap();
    assert_eq!(estimate.reference, ReferenceSettings::Looser { absolute: 1e-13, relative: 1e-13 });
    let [q, u] = true_errors(&motion);
    assert!(
        estimate.coordinates.error > 0.5 * q && estimate.velocities.error > 0.5 * u,
        "{estimate}\n{q:e} {u:e}"
    );
    assert!(estimate.coordinates.error < 1e-11, "{estimate}");
    assert!(estimate.to_string().contains("at most, by a second run at tolerance 1.0e-13"), "{estimate}");
}

/// e = 0.9 after 16 revolutions, Kepler's equation solved to 60 digits: the error grows with time, many times
/// beyond the tolerance.
#[test]
fn orbits_amplify_errors_without_doubling_them() {
    let start = at_rest_or_not([0.1, 0.0], [0.0, 19f64.sqrt()]);
    let [q, u] = [[-0.7506333330296452, -0.4310000275773213], [1.1423476744354137, 0.07521912809626714]];
    for tolerance in [1e-5, 1e-7, 1e-9] {
        let motion = Kepler.simulate(start).until(100.0).tolerance(tolerance).estimate_error().run().unwrap();
        let (end, estimate) = (motion.end(), motion.global_error().unwrap());
        let apart = |a: &[f64], b: [f64; 2]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let exact = apart(end.q.as_slice(), q).max(apart(end.u.as_slice(), u));
        let (_, at_end) = *estimate.history.last().unwrap();
        println!("tolerance {tolerance:e}: at the end {exact:.2e}\n{estimate}");
        // Ranges are 2 and 8.7 or so.
        assert!(at_end > 0.1 * exact && at_end < exact, "{at_end:e} for {exact:e}");
        assert!(estimate.doubling_time.is_none(), "{estimate}");
        assert!(estimate.coordinates.error.max(estimate.velocities.error) >= 0.9 * exact);
        assert!(estimate.ratio.unwrap() > 1000.0 && estimate.is_large());
        assert!(motion.verify().to_string().contains("warning"), "{}", motion.verify());
    }
}

/// Errors of this double pendulum grow like e^{0.9 t}: they double every 0.77.
#[test]
fn chaos_doubles_errors_until_nothing_is_left() {
    let start = at_rest_or_not([2.0 * std::f64::consts::PI / 3.0, -std::f64::consts::PI / 18.0], [0.0, 0.0]);
    let run = |tolerance: f64, end: f64| {
        let simulation = DoublePendulum::UNIT.simulate(start).until(end).tolerance(tolerance);
        simulation.estimate_error().run().unwrap()
    };
    // Levien & Tan's start, to 22 digits by two formulations.
    let (q, u) = ([-0.5317385636317109, -5.014305231077322], [4.524457260308953, 1.215802845560709]);
    let motion = run(1e-11, 20.0);
    let estimate = motion.global_error().unwrap();
    let exact = motion.end().u.iter().zip(u).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let exact_q = motion.end().q.iter().zip(q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    println!("{exact:.2e} {exact_q:.2e}\n{}", motion.verify());
    assert!(exact > 1e-7, "chaos is what is tested: {exact:e}");
    assert!(
        estimate.velocities.error > 0.5 * exact && estimate.velocities.error < 20.0 * exact,
        "{exact:e}\n{estimate}"
    );
    assert!(estimate.is_large() && estimate.lost_at.is_none(), "{estimate}");
    let doubling = estimate.doubling_time.unwrap();
    assert!((0.4..1.2).contains(&doubling), "{doubling}");
    // To t = 60 no tolerance of `f64` is enough, and the same time says when each ends.
    let lost = [1e-8, 1e-12].map(|tolerance| run(tolerance, 60.0).global_error().unwrap().lost_at.unwrap());
    println!("nothing is left from t = {lost:?} on");
    let digits = 4.0;
    let expected = digits * doubling / std::f64::consts::LOG10_2;
    assert!(
        (lost[1] - lost[0]) / expected > 0.5 && (lost[1] - lost[0]) / expected < 2.0,
        "{lost:?}, {expected}"
    );
    let summary = run(1e-8, 60.0).verify().to_string();
    assert!(summary.contains("nothing later can be trusted"), "{summary}");
}

/// The runs bounce at instants that differ by rounding and tolerance: between them velocities differ by twice
/// their size, which is no error.
#[test]
fn shifted_impacts_are_shifts_and_no_errors() {
    let ball = Ball { g: 9.81 };
    let simulation = ball.simulate(from_one()).until(2.5).tolerance(1e-6);
    let motion =
        simulation.on_event("impact", Direction::Falling, |s| s.u[0] *= -0.8).estimate_error().run().unwrap();
    let estimate = motion.global_error().unwrap();
    assert!(motion.events().len() > 5);
    assert!(estimate.coordinates.error < 1e-12 && estimate.velocities.error < 1e-12, "{estimate}");
    assert!(estimate.shift.as_ref().unwrap().by.abs() < 1e-12 && estimate.unmatched.is_none(), "{estimate}");

    // With a pendulum that hits a wall the shift is that of the error.
    let pendulum = Pendulum { m: 1.0, l: 1.0, g: 9.81 };
    let simulation =
        pendulum.simulate(from_one()).until(20.0).tolerance(1e-6).event("wall", |s| s.q[0] + 0.5);
    let motion =
        simulation.on_event("wall", Direction::Falling, |s| s.u[0] *= -1.0).estimate_error().run().unwrap();
    let estimate = motion.global_error().unwrap();
    println!("{estimate}");
    let shift = estimate.shift.as_ref().unwrap();
    assert_eq!(shift.name, "wall");
    assert!(shift.by.abs() > 1e-9 && shift.by.abs() < 1e-4, "{estimate}");
    assert!(estimate.velocities.error < 1e-3, "no velocity differs by twice its size: {estimate}");
    assert!(estimate.to_string().contains("events shift by"), "{estimate}");
}

/// A crossing that only just happens: one run has it, the other has not, and both would keep it to
/// themselves.
#[test]
fn an_event_in_one_run_alone_is_told() {
    let simulation = OSCILLATOR.simulate(from_one()).until(20.0).tolerance(1e-4).method(methods::Radau5);
    let motion = simulation.event("peak", |s| s.q[0] - 0.99999).estimate_error().run().unwrap();
    let estimate = motion.global_error().unwrap();
    println!("{estimate}");
    let unmatched = estimate.unmatched.as_ref().unwrap();
    assert_eq!(unmatched.name, "peak");
    // The first run loses height by its error, and at some peak has too little of it.
    let peaks = (1..=6).map(|k| std::f64::consts::PI * f64::from(k));
    let near =
        |t: f64| motion.events().iter().any(|event| event.name == "peak" && (event.time() - t).abs() < 0.1);
    let missed = peaks.into_iter().find(|t| !near(*t)).unwrap();
    assert!((unmatched.time - missed).abs() < 0.1, "{} for {missed}: {estimate}", unmatched.time);
    assert!(
        estimate.is_large() && motion.verify().to_string().contains("one of the two runs alone"),
        "{estimate}"
    );
}

#[test]
fn a_second_run_that_breaks_off_says_how_far_it_came() {
    let mut calls = 0;
    let simulation = OSCILLATOR.simulate(from_one()).until(4.0);
    let action = |s: &mut PlainState<1, 0>| {
        calls += 1;
        // The first run comes through the centre three times.
        s.u[0] *= if calls > 3 { f64::NAN } else { 1.0 };
    };
    let motion = simulation.on_event("centre", Direction::Any, action).estimate_error().run().unwrap();
    assert_eq!(motion.end_time(), 4.0);
    let estimate = motion.global_error().unwrap();
    let (t, why) = estimate.broken_off.as_ref().unwrap();
    assert!((t - std::f64::consts::FRAC_PI_4).abs() < 1e-6, "{t} {why}");
    assert!(estimate.coordinates.error < 1e-7 && estimate.unmatched.is_none(), "{estimate}");
    assert!(estimate.to_string().contains("the second run broke off at t = 0.785"), "{estimate}");
}

#[test]
fn what_keeps_no_motion_has_nothing_to_compare() {
    let error = OSCILLATOR.simulate(from_one()).until(1.0).estimate_error().run_with(|_| {}).unwrap_err();
    assert_eq!(error.kind, SimulationErrorKind::from(OptionError::NothingToCompare));
    assert!(error.to_string().contains("use `.run()`"), "{error}");
}

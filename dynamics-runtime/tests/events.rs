//! Events: where they are found, what they do, and where they are refused.

use crate::common;

use std::f64::consts::PI;

use common::*;
use dynamics_runtime::methods;
use dynamics_runtime::model::ModelState;
use dynamics_runtime::simulate::{Direction, Flow, OptionError, Simulate, SimulationErrorKind};
use proptest::prelude::*;

const G: f64 = 9.81;

/// Impact times of a ball dropped from height 1 with restitution e: t₀ = √(2/g), then flights of 2 v₀ eᵏ/g.
fn impacts(restitution: f64, count: usize) -> Vec<f64> {
    let first = (2.0 / G).sqrt();
    let mut times = vec![first];
    for k in 1..count {
        times.push(times[k - 1] + 2.0 * first * restitution.powi(k as i32));
    }
    times
}

#[test]
fn a_bouncing_ball_meets_the_closed_form() {
    let ball = Ball { g: G };
    for method in &[
        methods::Any::from(methods::Rk4),
        methods::DormandPrince5.into(),
        methods::Dop853.into(),
        methods::Heun.into(),
        methods::AdamsBashforth2.into(),
        methods::AdamsBashforth4.into(),
    ] {
        let simulation = ball.simulate(at_rest_or_not([1.0], [0.0])).until(2.5).method(method);
        let simulation = if method.is_adaptive() { simulation } else { simulation.fixed_step(0.05) };
        let motion = simulation.on_event("impact", Direction::Falling, |s| s.u[0] *= -0.8).run().unwrap();
        let found: Vec<_> = motion.events().iter().filter(|e| e.name == "impact").collect();
        let expected: Vec<f64> = impacts(0.8, 20).into_iter().take_while(|t| *t < 2.5).collect();
        assert_eq!(found.len(), expected.len(), "{method}");
        for (event, time) in found.iter().zip(&expected) {
            assert!((event.time() - time).abs() < 1e-13, "{method}: impact at {} for {time}", event.time());
            assert!(event.before.q[0].abs() < 1e-14 && event.before.u[0] < 0.0);
            assert_eq!(event.after.u[0], -0.8 * event.before.u[0]);
            assert!(!event.stopped && event.direction == Direction::Falling);
        }
        // The ball is nowhere below the floor, and `at` gives the state after a reset.
        let lowest =
            motion.sample((0..=2500).map(|k| 1e-3 * f64::from(k))).map(|s| s.q[0]).fold(f64::MAX, f64::min);
        assert!(lowest > -1e-12, "{method}: the ball sinks to {lowest}");
        assert_eq!(motion.at(found[0].time()).u, found[0].after.u);
        let account = motion.work();
        let lost: f64 = account.resets.iter().map(|row| row.work).sum();
        assert!(
            (lost - (account.energy_end - account.energy_start)).abs() < 1e-12 && lost < -5.0,
            "{account}"
        );
        assert_eq!(account.resets[0].name, "impact");
        assert!(motion.verify().energy_drift < 1e-13, "resets do not count as drift");
        // Apexes, one after every impact, are listed without having been asked for.
        let apexes = motion.events().iter().filter(|e| e.name == "apex").count();
        assert!(apexes >= expected.len() - 1, "{apexes}");
    }
}

#[test]
fn impacts_that_accumulate_are_an_error_that_names_the_limit() {
    let ball = Ball { g: G };
    let end = 10.0;
    let error = ball
        .simulate(at_rest_or_not([1.0], [0.0]))
        .until(end)
        .on_event("impact", Direction::Falling, |s| s.u[0] *= -0.5)
        .run()
        .unwrap_err();
    // t₀ + 2 t₀ (e + e² + …) = t₀ (1 + e)/(1 − e)
    let limit = (2.0 / G).sqrt() * 3.0;
    match &error.kind {
        SimulationErrorKind::EventsAccumulate { event, at, squeezed: false } => {
            assert_eq!(event, "impact");
            assert!((at - limit).abs() < 1e-9, "{at} for {limit}");
        }
        other => panic!("{other:?}"),
    }
    let motion = error.motion(&ball).unwrap();
    assert!(motion.events().len() > 10 && motion.end_time() < limit + 1e-9);
    assert!(error.to_string().contains("accumulates at about t = 1.35"), "{error}");
    // The remedy that the message names.
    let stopped = ball
        .simulate(at_rest_or_not([1.0], [0.0]))
        .until(end)
        .on_event("impact", Direction::Falling, |s| {
            s.u[0] *= -0.5;
            if s.u[0] < 1e-3 { Flow::Stop } else { Flow::Continue }
        })
        .run()
        .unwrap();
    assert!(stopped.end_time() < limit && stopped.events().last().unwrap().stopped);
    assert_eq!(stopped.summary().stopped_by.as_deref(), Some("impact"));
}

#[test]
fn a_reset_that_lays_the_ball_on_the_floor_is_an_error_and_one_that_slows_it_lets_it_pass() {
    let ball = Ball { g: G };
    let run = |height: f64, factor: f64| {
        ball.simulate(at_rest_or_not([height], [0.0]))
            .until(2.0)
            .on_event("impact", Direction::Falling, move |s| s.u[0] *= factor)
            .run()
    };
    let fall = (2.0 / G).sqrt();
    let error = run(1.0, 0.0).unwrap_err();
    assert_eq!(error.kind, SimulationErrorKind::EventRepeats { event: "impact".into() });
    assert!((error.time - fall).abs() < 1e-12, "the motion ends at the impact");
    assert!(
        matches!(run(0.0, -0.8).unwrap_err().kind, SimulationErrorKind::EventRepeats { .. }),
        "at rest on the floor"
    );
    // A ball that falls into water.
    let through = run(1.0, 0.5).unwrap();
    assert_eq!(through.events().iter().filter(|e| e.name == "impact").count(), 1);
    let rest = 2.0 - fall;
    assert!((through.end().q[0] + 0.5 * G * fall * rest + 0.5 * G * rest * rest).abs() < 1e-10);
}

#[test]
fn a_ball_that_starts_on_the_floor_moving_down_bounces_at_once() {
    let ball = Ball { g: G };
    let bounce = |speed: f64| {
        ball.simulate(at_rest_or_not([0.0], [speed]))
            .until(0.1)
            .on_event("impact", Direction::Falling, |s| s.u[0] = -s.u[0])
            .run()
            .unwrap()
    };
    let down = bounce(-2.0);
    assert_eq!((down.events().len(), down.events()[0].time()), (1, 0.0));
    assert!((down.end().q[0] - (0.2 - 0.5 * G * 0.01)).abs() < 1e-12);
    let up = bounce(2.0);
    assert!(up.events().is_empty(), "leaving the floor is no impact: {:?}", up.events());
}

/// An action that only looks at the motion is called at the very start, too, and changes nothing there.
#[test]
fn an_action_that_changes_nothing_at_the_very_start_is_none_that_repeats() {
    let ball = Ball { g: G };
    let mut seen = Vec::new();
    let run = ball.simulate(at_rest_or_not([0.0], [-2.0])).until(0.1);
    let end = run.on_event("impact", Direction::Falling, |s| seen.push((s.t, s.u[0]))).run().unwrap().end();
    assert!((end.q[0] + 0.2 + 0.5 * G * 0.01).abs() < 1e-12 && seen == [(0.0, -2.0)], "{end:?} {seen:?}");
    // A rate that is zero at the start of a fall falls with a slope.
    let mut calls = 0;
    let run = ball.simulate(at_rest_or_not([1.0], [0.0])).until(0.1).event("rate", |s| s.u[0]);
    let end = run.on_event("rate", Direction::Falling, |_| calls += 1).run().unwrap().end();
    assert!(calls == 1 && (end.q[0] - 1.0 + 0.5 * G * 0.01).abs() < 1e-12, "{calls} {end:?}");
}

#[test]
fn a_function_that_is_zero_at_the_start_has_not_crossed() {
    let oscillator = Oscillator { omega: 1.0 };
    let motion = oscillator
        .simulate(at_rest_or_not([0.0], [1.0]))
        .until(100.0)
        .stop_at("centre", Direction::Rising)
        .run()
        .unwrap();
    assert!(
        (motion.end_time() - 2.0 * PI).abs() < 1e-9,
        "stops after one period, not at once: {}",
        motion.end_time()
    );
    assert_eq!(motion.events().len(), 2, "falling at π, rising at 2π");
}

#[test]
fn directions_hold_along_the_motion_backwards_too() {
    let oscillator = Oscillator { omega: 1.0 };
    for (end, sign) in [(10.0, 1.0), (-10.0, -1.0)] {
        let motion =
            oscillator.simulate(at_rest_or_not([1.0], [0.0])).until(end).tolerance(1e-12).run().unwrap();
        let found: Vec<(f64, Direction)> = motion.events().iter().map(|e| (e.time(), e.direction)).collect();
        let expected = [(0.5, Direction::Falling), (1.5, Direction::Rising), (2.5, Direction::Falling)];
        assert_eq!(found.len(), 3);
        for ((time, direction), (halves, expected)) in found.into_iter().zip(expected) {
            assert!((time - sign * halves * PI).abs() < 1e-11 && direction == expected);
        }
    }
}

#[test]
fn several_events_in_one_step_come_in_order() {
    let oscillator = Oscillator { omega: 1.0 };
    // One step of RK4 holds all of these.
    let motion = oscillator
        .simulate(at_rest_or_not([1.0], [0.0]))
        .until(3.0)
        .fixed_step(3.0)
        .event("late", |s| s.t() - 2.7)
        .event("early", |s| s.t() - 0.1)
        .event("pair", |s| (s.t() - 1.50) * (s.t() - 1.51))
        .run()
        .unwrap();
    let listed: Vec<&str> =
        motion.events().iter().map(|e| e.name.as_str()).filter(|n| *n != "centre").collect();
    assert_eq!(listed, ["early", "pair", "pair", "late"]);
    let times: Vec<f64> = motion.events().iter().map(|e| e.time()).collect();
    assert!(times.is_sorted(), "{times:?}");
    for (event, time) in motion.events().iter().filter(|e| e.name != "centre").zip([0.1, 1.50, 1.51, 2.7]) {
        assert!((event.time() - time).abs() < 1e-12);
    }
}

#[test]
fn events_at_the_same_instant_all_act() {
    let oscillator = Oscillator { omega: 1.0 };
    let motion = oscillator
        .simulate(at_rest_or_not([1.0], [0.0]))
        .until(3.0)
        .event("a", |s| s.t() - 1.0)
        .event("b", |s| 1.0 - s.t())
        .on_event("a", Direction::Any, |s| s.u_mut()[0] += 1.0)
        .on_event("b", Direction::Any, |s| s.u_mut()[0] += 2.0)
        .run()
        .unwrap();
    let jump: Vec<f64> =
        motion.events().iter().filter(|e| e.name != "centre").map(|e| e.after.u[0] - e.before.u[0]).collect();
    assert_eq!(jump.len(), 2);
    assert!((jump[0] - 1.0).abs() < 1e-12 && (jump[1] - 2.0).abs() < 1e-12);
}

/// A thermostat: the input is switched, the state is not moved, and the function goes on through its zero.
#[test]
fn inputs_set_by_a_reset_are_held() {
    let model = Driven { m: 1.0, k: 0.0, c: 0.0 };
    let start = PlainState {
        t: 0.0,
        q: [0.0].into(),
        u: [0.0].into(),
        inputs: [1.0].into(),
        active_set: Default::default(),
    };
    let motion = model
        .simulate(start)
        .until(4.0)
        .tolerance(1e-12)
        .event("half way", |s| s.q[0] - 0.5)
        .event("turned", |s| s.u[0])
        .on_event("half way", Direction::Rising, |s| s.inputs[0] = -1.0)
        .stop_at("turned", Direction::Falling)
        .run()
        .unwrap();
    // Accelerated by 1 for 1 s, then slowed by 1 for 1 s.
    assert!((motion.end_time() - 2.0).abs() < 1e-10, "{}", motion.end_time());
    assert!((motion.end().q[0] - 1.0).abs() < 1e-10);
    assert_eq!(motion.at(0.5).inputs[0], 1.0);
    assert_eq!(motion.at(1.5).inputs[0], -1.0);
    assert!(motion.verify().energy_drift < 1e-11);
}

/// A relay with memory: the mode stands in an input that only resets change, the law turns it into the force.
#[test]
fn an_inputs_law_sees_what_a_reset_set() {
    let model = Driven { m: 1.0, k: 0.0, c: 0.0 };
    let start = PlainState {
        t: 0.0,
        q: [0.0].into(),
        u: [0.0].into(),
        inputs: [2.0].into(),
        active_set: Default::default(),
    };
    let motion = model
        .simulate(start)
        .until(4.0)
        .tolerance(1e-12)
        .inputs(|_, s| [0.5 * s.inputs[0]])
        .event("half way", |s| s.q[0] - 0.5)
        .event("turned", |s| s.u[0])
        .on_event("half way", Direction::Rising, |s| s.inputs[0] = -2.0)
        .stop_at("turned", Direction::Falling)
        .run()
        .unwrap();
    assert!((motion.end_time() - 2.0).abs() < 1e-10 && (motion.end().q[0] - 1.0).abs() < 1e-10);
    assert_eq!((motion.at(0.5).inputs[0], motion.at(1.5).inputs[0]), (1.0, -1.0));
    assert_eq!(motion.events()[0].after.inputs[0], -1.0);
}

#[test]
fn the_state_at_an_event_has_the_accuracy_of_the_step() {
    let end = Kepler
        .simulate(at_rest_or_not([0.5, 0.0], [0.0, 3f64.sqrt()]))
        .until(100.0)
        .tolerance(1e-13)
        .stop_at("apsis", Direction::Falling)
        .run()
        .unwrap();
    // e = ½, a = 1: the aphelion is at (−1.5, 0) after π.
    let [late, off] = [end.end_time() - PI, (end.end().q[0] + 1.5).abs().max(end.end().q[1].abs())];
    assert!(late.abs() < 3e-12 && off < 3e-12, "{late:e}, {off:e}");
    assert!(end.end().q.dot(&end.end().u).abs() < 1e-15, "the event function is zero at the state itself");
}

/// The reset itself is fine, what it leads to cannot be evaluated: the motion ends before it, and no reset is
/// in its account.
#[test]
fn a_reset_to_a_place_without_accelerations_is_not_kept() {
    let model = Closure(|_, q, _| if q < 2.0 { 1.0 } else { f64::NAN });
    let error = model
        .simulate(at_rest_or_not([0.0], [0.0]))
        .until(4.0)
        .event("half", |s| s.q[0] - 0.5)
        .on_event("half", Direction::Any, |s| s.q[0] = 3.0)
        .run()
        .unwrap_err();
    assert!((error.time - 1.0).abs() < 1e-9, "{error}");
    let motion = error.motion(&model).unwrap();
    assert!(motion.events().is_empty() && motion.work().resets.is_empty());
    assert!(motion.steps().map(|s| s.t).collect::<Vec<_>>().is_sorted_by(|a, b| a < b), "no state twice");
}

#[test]
fn bad_events_are_errors() {
    let ball = Ball { g: G };
    let open = || ball.simulate(at_rest_or_not([1.0], [0.0])).until(1.0);
    let kind = |s: dynamics_runtime::simulate::Simulation<'_, Ball>| s.run().unwrap_err().kind;
    assert_eq!(
        kind(open().stop_at("impcat", Direction::Any)),
        OptionError::UnknownEvent { name: "impcat".into(), suggestion: Some("impact".into()) }.into()
    );
    assert_eq!(
        kind(open().event("apex", |s| s.q[0])),
        OptionError::DuplicateEvent { name: "apex".into() }.into()
    );
    assert_eq!(
        kind(open().event("log", |s| (s.q[0] - 0.5).ln())),
        SimulationErrorKind::EventNotANumber { event: "log".into() }
    );
    assert_eq!(
        kind(open().on_event("impact", Direction::Any, |s| s.u[0] = f64::NAN)),
        SimulationErrorKind::BadReset { event: "impact".into(), name: "y" }
    );
    assert_eq!(
        kind(open().on_event("impact", Direction::Any, |s| s.t += 1.0)),
        SimulationErrorKind::BadReset { event: "impact".into(), name: "t" }
    );
}

/// Free flight in steps as long as the flight: events that oscillate within a step are found, or the run says
/// that they are not.
#[test]
fn events_that_oscillate_faster_than_the_steps_are_found() {
    for method in &[methods::Any::from(methods::DormandPrince5), methods::Dop853.into()] {
        let oscillator = Oscillator { omega: 1.0 };
        let run = |omega: f64| {
            let run =
                oscillator.simulate(at_rest_or_not([1.0], [0.0])).until(10.0).method(method).tolerance(1e-8);
            run.event("quick", move |s| (omega * s.t() + 0.3).sin()).run()
        };
        for omega in [3.0, 20.0, 200.0, 500.0] {
            let motion = run(omega).unwrap();
            let found: Vec<f64> =
                motion.events().iter().filter(|e| e.name == "quick").map(|e| e.time()).collect();
            assert_eq!(found.len(), ((10.0 * omega + 0.3) / PI) as usize, "{method} {omega}");
            assert!(
                found.iter().enumerate().all(|(k, t)| (omega * t + 0.3 - (k + 1) as f64 * PI).abs() < 1e-9)
            );
        }
        let error = run(1e6).unwrap_err();
        assert_eq!(error.kind, SimulationErrorKind::EventUnresolved { event: "quick".into() });
        assert!(error.to_string().contains("`.max_step(..)`") && error.time < 10.0, "{error}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, ..ProptestConfig::default() })]

    /// Whatever the ball, the tolerance and the step, every impact is found at its time, and the ball is
    /// never below the floor.
    #[test]
    fn any_bouncing_ball(
        height in 0.01..100.0f64,
        restitution in 0.3..0.95f64,
        offset in -5.0..5.0f64,
        tolerance in -12.0..-2.0f64,
        first_step in -8.0..1.0f64,
        floor in -1e3..1e3f64,
    ) {
        let ball = Ball { g: G };
        let fall = (2.0 * height / G).sqrt();
        // Up to when flights are a thousandth of the first.
        let count = (1e-3f64.ln() / restitution.ln()) as usize;
        let mut expected = vec![offset + fall];
        for k in 1..count {
            expected.push(expected[k - 1] + 2.0 * fall * restitution.powi(k as i32));
        }
        let end = expected[count - 1] + 0.4 * fall * restitution.powi(count as i32);
        let start = PlainState { t: offset, ..at_rest_or_not([floor + height], [0.0]) };
        let motion = ball
            .simulate(start)
            .until(end)
            .tolerance(10f64.powf(tolerance))
            .first_step(10f64.powf(first_step))
            .event("floor", move |s| s.q[0] - floor)
            .on_event("floor", Direction::Falling, |s| s.u[0] *= -restitution)
            .run();
        let motion = match motion {
            Ok(motion) => motion,
            Err(error) => return Err(TestCaseError::fail(error.to_string())),
        };
        let found: Vec<f64> =
            motion.events().iter().filter(|e| e.name == "floor").map(|e| e.time()).collect();
        prop_assert_eq!(found.len(), expected.len());
        // Rounding of the floor's height moves the impacts.
        let resolution = 1e-11 * fall
            + 1e-13 * (floor.abs() + height) / (G * fall * restitution.powi(count as i32));
        for (k, (found, expected)) in found.iter().zip(&expected).enumerate() {
            prop_assert!((found - expected).abs() < 100.0 * resolution, "impact {k} at {found} for \
                {expected}");
        }
        let span = end - offset;
        let lowest =
            motion.sample((0..=500).map(|k| offset + span * f64::from(k) / 500.0)).map(|s| s.q[0] - floor);
        prop_assert!(lowest.fold(f64::MAX, f64::min) > -1e-12 * (floor.abs() + height));
        prop_assert!(motion.verify().energy_drift < 1e-12);
    }

    /// Crossings of an oscillator with drifting thresholds: as many as there are, each on the threshold, in
    /// both directions of time.
    #[test]
    fn any_threshold(
        threshold in -0.95..0.95f64,
        omega in 0.5..50.0f64,
        end in prop_oneof![-20.0..-1.0f64, 1.0..20.0f64]
    ) {
        let oscillator = Oscillator { omega };
        let motion = oscillator
            .simulate(at_rest_or_not([1.0], [0.0]))
            .until(end)
            .tolerance(1e-11)
            .event("threshold", move |s| s.q[0] - threshold)
            .run()
            .unwrap();
        let angle = threshold.acos();
        let mut expected: Vec<f64> = (0..)
            .flat_map(|k| [2.0 * PI * f64::from(k) + angle, 2.0 * PI * f64::from(k + 1) - angle])
            .map(|phase| phase / omega)
            .take_while(|t| *t < end.abs())
            .collect();
        expected.sort_by(f64::total_cmp);
        let found: Vec<f64> =
            motion.events().iter().filter(|e| e.name == "threshold").map(|e| e.time().abs()).collect();
        prop_assert_eq!(found.len(), expected.len());
        for (found, expected) in found.iter().zip(&expected) {
            prop_assert!((found - expected).abs() < 1e-6 / omega, "{found} for {expected}");
        }
    }

    /// A stone thrown up in one long step, seen against a threshold that it just passes, or just misses, at
    /// its summit; and a cubic dip in its way.
    #[test]
    fn any_dip_in_a_long_step(
        speed in 1.0..50.0f64,
        depth in -12.0..-0.5f64,
        passes in any::<bool>(),
        place in 0.05..0.95f64,
        skew in -1.0..1.0f64,
        high_order in any::<bool>(),
    ) {
        let ball = Ball { g: G };
        let (flight, summit) = (2.0 * speed / G, 0.5 * speed * speed / G);
        let depth = 10f64.powf(depth);
        let signed = if passes { depth } else { -depth };
        let dip = move |t: f64| {
            let x = t / flight - place;
            x * x * (1.0 + skew * x) - signed
        };
        let start = PlainState { t: 0.0, ..at_rest_or_not([0.0], [speed]) };
        let run = ball.simulate(start).until(flight).tolerance(1e-6).first_step(flight);
        let run = if high_order { run.method(methods::Dop853) } else { run.method(methods::DormandPrince5) };
        let motion = run
            .event("summit", move |s| s.q[0] - summit * (1.0 - signed))
            .event("dip", move |s| dip(s.t()))
            .run().unwrap();
        let count = |name: &str| motion.events().iter().filter(|e| e.name == name).count();
        prop_assert_eq!(count("summit"), if passes { 2 } else { 0 });
        // Its zeros, by bisection from its vertex to the ends, the two turning points known.
        let mut edges = vec![0.0, place, 1.0];
        let turn = place - 2.0 / (3.0 * skew);
        if turn > 0.0 && turn < 1.0 {
            edges.push(turn);
        }
        edges.sort_by(f64::total_cmp);
        let signs =
            edges.windows(2).filter(|pair| dip(pair[0] * flight) * dip(pair[1] * flight) < 0.0).count();
        prop_assert_eq!(count("dip"), signs);
    }
}

/// A falling ball passes gates |y − c| = w of widths far below a step and wherever they are in one: two
/// crossings each, where a closed form says.
#[test]
fn gates_narrower_than_a_step_are_seen() {
    let ball = Ball { g: G };
    let end = 2.0;
    let time = |y: f64| (2.0 * (1.0 - y) / G).sqrt();
    for (method, tolerance) in
        [(methods::Any::from(methods::DormandPrince5), 1e-4), (methods::Dop853.into(), 1e-8)]
    {
        for k in 0..400 {
            let (center, width) = (0.9 - 0.0431 * f64::from(k), 10f64.powf(-0.5 - 0.05 * f64::from(k % 60)));
            let run =
                ball.simulate(at_rest_or_not([1.0], [0.0])).until(end).tolerance(tolerance).method(&method);
            let motion = run.event("gate", move |s| (s.q[0] - center).abs() - width).run().unwrap();
            let found: Vec<f64> =
                motion.events().iter().filter(|e| e.name == "gate").map(|e| e.time()).collect();
            let edges = [center + width, center - width].into_iter().filter(|y| *y < 1.0).map(time);
            let expected: Vec<f64> = edges.filter(|t| *t < end).collect();
            assert_eq!(found.len(), expected.len(), "{method}: gate of {width} at {center}");
            assert!(found.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-6), "{found:?} {expected:?}");
        }
    }
}

/// Two functions that are zero at one place: one is located by the interpolant, the other ends the step,
/// whose end the method itself finds. What is listed is in the order of time.
#[test]
fn events_are_listed_in_the_order_of_time() {
    let oscillator = Oscillator { omega: 1.0 };
    for end in [30.0, -30.0] {
        for tolerance in [1e-3, 1e-5, 1e-8] {
            for k in 0..20 {
                let place = 0.9 - 0.09 * f64::from(k);
                let run = oscillator.simulate(at_rest_or_not([1.0], [0.3])).until(end).tolerance(tolerance);
                let run = run.method(methods::Dop853).event("passes", move |s| s.q[0] - place);
                let run = run
                    .event("acts", move |s| s.q[0] - place)
                    .on_event("acts", Direction::Any, |_| Flow::Continue);
                let motion = run.run().unwrap();
                let times: Vec<f64> =
                    motion.events().iter().map(|event| event.time() * end.signum()).collect();
                assert!(times.len() > 15 && times.is_sorted(), "{end} {tolerance:e} {place}: {times:?}");
            }
        }
    }
}

/// A function of time alone that is zero at the start, and steps that are longer than the time to its next
/// zero.
#[test]
fn an_action_that_changes_nothing_within_the_first_step_is_none_that_repeats() {
    let oscillator = Oscillator { omega: 1.0 };
    let run =
        oscillator.simulate(at_rest_or_not([1.0], [0.0])).until(10.0).tolerance(1e-3).method(methods::Dop853);
    let run = run.first_step(0.5).event("tick", |s| (41.0 * s.t).sin());
    let motion = run.on_event("tick", Direction::Any, |_| Flow::Continue).run().unwrap();
    assert_eq!(motion.events().iter().filter(|event| event.name == "tick").count(), 130);
    assert!((motion.end().q[0] - 10.0_f64.cos()).abs() < 1e-2);
}

//! What a step control does not see.

use dynamics::methods::{self, Any};
use dynamics::prelude::*;

use super::models::*;

fn at_rest() -> State<Spring> {
    SPRING.state().push(0.0).build().unwrap()
}

/// x(t) of the spring from rest under a push of this height from `from` to `to`.
fn pushed(height: f64, from: f64, to: f64, t: f64) -> f64 {
    height * ((t - to).cos() - (t - from).cos())
}

/// An input that jumps costs rejected steps at the jump, and the tolerance holds.
#[test]
fn inputs_that_jump_are_seen_by_step_control() {
    let push = |t: f64, _: &State<Spring>| [if (3.0..8.0).contains(&t) { 1.0 } else { 0.0 }];
    for tolerance in [1e-4, 1e-7, 1e-10] {
        let motion = SPRING
            .simulate(at_rest())
            .until(20.0)
            .tolerance(tolerance)
            .max_step(1.0)
            .inputs(push)
            .run()
            .unwrap();
        let error = (motion.end().x() - pushed(1.0, 3.0, 8.0, 20.0)).abs();
        assert!(error < 300.0 * tolerance, "{error:e} at {tolerance:e}");
        assert!(motion.counts().rejected > 5, "{}", motion.verify());
    }
}

/// A push that is over before a stage falls into it has not happened, for no run whatever its tolerance: no
/// step control can know. With `.max_step(..)` of its length it is found. Where it is over within less than a
/// thousandth of the motion, this is the one failure that nothing need tell of.
#[test]
fn pushes_between_the_stages_are_missed_without_max_step() {
    let push = |t: f64, _: &State<Spring>| [if (5.0..5.001).contains(&t) { 1000.0 } else { 0.0 }];
    let exact = pushed(1000.0, 5.0, 5.001, 10.0);
    assert!(exact.abs() > 0.9);
    let simulation = || SPRING.simulate(at_rest()).until(10.0).tolerance(1e-9).inputs(push);
    let missed = simulation().estimate_error().run().unwrap();
    assert_eq!(missed.end().x(), 0.0, "{}", missed.verify());
    let found = simulation().max_step(0.001).run().unwrap();
    assert!((found.end().x() - exact).abs() < 1e-6, "{} for {exact}", found.end().x());
    // Better still: an event at the instant of the push ends a step there.
    let held = SPRING.simulate(at_rest()).until(10.0).tolerance(1e-9);
    let held = held.event("on", |s| s.t - 5.0).event("off", |s| s.t - 5.001);
    let held = held.on_event("on", Direction::Rising, |s: &mut State<Spring>| s.inputs[0] = 1000.0);
    let held =
        held.on_event("off", Direction::Rising, |s: &mut State<Spring>| s.inputs[0] = 0.0).run().unwrap();
    assert!((held.end().x() - exact).abs() < 1e-8, "{} for {exact}", held.end().x());
}

/// Steps that grow while nothing happens go over what happens for a hundredth of the time, with every method
/// somewhere; the summary looks between their stages.
#[test]
fn pushes_that_last_are_told_where_the_stages_miss_them() {
    let run = || KICKED.simulate(KICKED.state().x_rate(1.0).build().unwrap()).until(100.0);
    let exact = 1.0 + std::f64::consts::PI.sqrt();
    let list: [Any<Kicked>; 6] = [
        methods::Dop853.into(),
        methods::Verner9.into(),
        methods::Tsit5.into(),
        methods::Radau5.into(),
        methods::Taylor::default().into(),
        methods::GraggBulirschStoer.into(),
    ];
    let mut missed = 0;
    for (method, k) in list.iter().flat_map(|method| (3..=12).map(move |k| (method, k))) {
        let tolerance = 10f64.powi(-k);
        let motion = run().tolerance(tolerance).method(method).run().unwrap();
        let (off, summary) = ((motion.end().x_rate() - exact).abs() / tolerance, motion.verify());
        let told = summary.to_string().contains("and is missed: by");
        assert_eq!(told, off > 300.0, "{method} {tolerance:e}: {off:.0} permitted errors\n{summary}");
        missed += u32::from(told);
        let watched = run().tolerance(tolerance).method(method).max_step(1.0).run().unwrap();
        let (off, summary) = ((watched.end().x_rate() - exact).abs() / tolerance, watched.verify());
        assert!(
            summary.accuracy.undersampled_force.is_none() && off < 300.0,
            "{method} {tolerance:e}: {off:.0}\n{summary}"
        );
    }
    assert!((15..55).contains(&missed), "{missed} of 60 runs");
}

/// A well leaves the velocity as it was: what is missed is how far the motion is.
#[test]
fn wells_that_are_passed_over_are_told() {
    let well = Well { mass: 1.0, depth: 0.02, width: 0.003 };
    let run = || well.simulate(well.state().x(-1.0).x_rate(0.1).build().unwrap()).until(20.0);
    // Energy: ∫ (1/v∞ − 1/v) dx is the time that is gained, by the trapezoidal rule, which is as good as
    // exact for what fades away.
    let gained = |k: i32| {
        let deep = (-(f64::from(k) * 0.01).powi(2)).exp();
        1.0 / 0.1 - 1.0 / (0.1_f64 * 0.1 + 2.0 * 0.02 * deep).sqrt()
    };
    let exact = 1.0 + 0.1 * 0.003 * 0.01 * (-1000..=1000).map(gained).sum::<f64>();
    let list: [(Any<Well>, i32); 4] = [
        (methods::Dop853.into(), 12),
        (methods::Verner9.into(), 12),
        (methods::Tsit5.into(), 12),
        // Beyond that it takes seconds.
        (methods::Radau5.into(), 7),
    ];
    for (method, least) in &list {
        for k in 4..=*least {
            let tolerance = 10f64.powi(-k);
            let motion = run().tolerance(tolerance).method(method).run().unwrap();
            let (off, summary) = ((motion.end().x() - exact).abs() / tolerance, motion.verify());
            let told = summary.accuracy.undersampled_force.is_some();
            assert!(told || off < 300.0, "{method} {tolerance:e}: {off:.0} permitted errors\n{summary}");
            let watched = run().tolerance(tolerance).method(method).max_step(0.02).run().unwrap();
            let (off, summary) = ((watched.end().x() - exact).abs() / tolerance, watched.verify());
            assert!(
                summary.accuracy.undersampled_force.is_none() && off < 300.0,
                "{method} {tolerance:e}: {off:.0}\n{summary}"
            );
        }
    }
}

/// A gate that the motion passes twice within a step is found; a crossing that only just happens is one run's
/// own, and an estimate tells.
#[test]
fn events_that_only_just_happen_are_told() {
    let start = SPRING.state().x(1.0).push(0.0).build().unwrap();
    // 2.5 ms long, in steps of seconds.
    let gate = |s: &State<Spring>| s.x() - (1.0 - 8e-7);
    let simulation = SPRING.simulate(start).until(40.0).tolerance(1e-9).event("gate", gate);
    let motion = simulation.method(methods::Dop853).estimate_error().run().unwrap();
    let passed = motion.events().iter().filter(|event| event.name == "gate").count();
    assert_eq!(passed, 13, "out at the start, in and out six times");
    assert!(motion.global_error().unwrap().unmatched.is_none(), "{}", motion.verify());
    // The error of a loose tolerance takes more than the gate is high.
    let simulation = SPRING.simulate(start).until(40.0).tolerance(1e-5).event("gate", gate);
    let motion = simulation.method(methods::Radau5).estimate_error().run().unwrap();
    assert!(
        motion.verify().to_string().contains("happens in one of the two runs alone"),
        "{}",
        motion.verify()
    );
}

//! Runs that cannot reach their end say why, when and where, and hand out what was computed.

use crate::common;

use std::cell::Cell;
use std::error::Error;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use common::constrained::Rod;
use common::*;
use dynamics_runtime::error::SolveError;
use dynamics_runtime::methods;
use dynamics_runtime::model::ModelState as _;
use dynamics_runtime::simulate::{
    Flow, Formulation, Method, Motion, MotionError, OptionError, Simulate, Simulation, SimulationError,
    SimulationErrorKind,
};

fn kind(simulation: Simulation<'_, Oscillator>) -> SimulationErrorKind {
    simulation.run().unwrap_err().kind
}

#[test]
fn options_without_sense_are_errors_that_say_what_has_sense() {
    let model = Oscillator { omega: 1.0 };
    let open = || model.simulate(at_rest_or_not([1.0], [0.0]));
    let run = || open().until(1.0);
    assert_eq!(kind(open()), OptionError::NoEnd.into());
    assert_eq!(kind(run().method(methods::Rk4)), OptionError::NeedsFixedStep { method: Method::Rk4 }.into());
    for (simulation, option) in [
        (open().until(f64::NAN), "until"),
        (open().until(f64::INFINITY), "until"),
        (run().tolerance(0.0), "tolerance"),
        (run().tolerance(-1e-6), "tolerance"),
        (run().tolerance(f64::NAN), "tolerance"),
        (run().tolerance(1e-17), "tolerance"),
        (run().tolerance(1.0), "tolerance"),
        (run().fixed_step(0.0), "fixed_step"),
        (run().fixed_step(f64::NAN), "fixed_step"),
        (run().fixed_step(1e-17), "fixed_step"),
        (run().first_step(-1.0), "first_step"),
        (run().first_step(1e-300), "first_step"),
        (run().max_step(0.0), "max_step"),
        (run().max_steps(0), "max_steps"),
        (run().every(0.0), "every"),
        (run().every(1e-12), "every"),
    ] {
        match kind(simulation) {
            SimulationErrorKind::Option(OptionError::Number { option: found, .. }) => {
                assert_eq!(found, option)
            }
            other => panic!("{option}: {other:?}"),
        }
    }
    for (simulation, option) in [
        (run().fixed_step(0.1).tolerance(1e-9), "tolerance"),
        (run().fixed_step(0.1).max_step(0.1), "max_step"),
        (run().fixed_step(0.1).first_step(0.1), "first_step"),
    ] {
        assert_eq!(kind(simulation), OptionError::FixedStepExcludes { option }.into());
    }
    let error = kind(run().method(methods::Taylor { order: Some(40) })).to_string();
    assert_eq!(error, "`order: 40` of Taylor series is not possible; give an order from 4 to 30, or none");
}

#[test]
fn tolerances_without_sense_are_errors_that_say_what_has_sense() {
    let model = Oscillator { omega: 1.0 };
    let run = || model.simulate(at_rest_or_not([1.0], [0.0])).until(1.0);
    for (simulation, text) in [
        (
            run().tolerances(0.0, 1e-9),
            "`.tolerances(0, 1e-9)` is not possible; give an absolute tolerance above 0",
        ),
        (
            run().tolerances(1e-9, -1.0),
            "`.tolerances(1e-9, -1)` is not possible; give a relative tolerance of 0 or more",
        ),
        (
            run().tolerances(1e-9, f64::INFINITY),
            "`.tolerances(1e-9, inf)` is not possible; give a relative tolerance of",
        ),
        (
            run().tolerances(1e-9, 1e-16),
            "`.tolerances(1e-9, 1e-16)` is not possible; give a relative tolerance of at least",
        ),
        (
            run().tolerances(1e3, 1.0),
            "`.tolerances(1000, 1)` is not possible; give a relative tolerance below 1",
        ),
        (
            run().tolerance(10.0),
            "`.tolerance(10)` is not possible; give less than 1: from there on no digit is asked for",
        ),
    ] {
        let found = kind(simulation).to_string();
        assert!(found.starts_with(text), "{found}");
    }
    assert!(run().tolerances(1e3, 0.9).run().is_ok() && run().tolerance(0.9).run().is_ok());
    let error = run().tolerance(0.0).run().unwrap_err();
    assert!(
        error.to_string().starts_with(
            "`Oscillator` was not simulated: `.tolerance(0)` is not possible; give a tolerance above 0"
        ),
        "{error}"
    );
    assert!(error.motion(&model).is_none());
}

#[test]
fn output_times_have_to_be_within_the_run_and_in_its_order() {
    let model = Oscillator { omega: 1.0 };
    let run = || model.simulate(at_rest_or_not([1.0], [0.0])).until(1.0);
    for time in [-0.1, 1.1, f64::NAN] {
        match kind(run().output_times([0.5, time])) {
            SimulationErrorKind::Option(OptionError::OutputTime { start: 0.0, end: 1.0, .. }) => {}
            other => panic!("output time {time}: {other:?}"),
        }
    }
    let error = kind(run().output_times([0.2, 1.0, 0.5])).to_string();
    assert_eq!(error, "output time 1 is followed by 0.5; give them in ascending order");
    let error = kind(run().until(-1.0).output_times([-0.5, -0.2])).to_string();
    assert_eq!(
        error,
        "output time -0.5 is followed by -0.2; give them in descending order, as the motion runs"
    );
}

#[test]
fn what_is_missed_is_told_where_it_says_anything() {
    let contradiction = |residual| SolveError::Contradiction { row: "motor", residual, rank: 3 }.to_string();
    assert!(
        contradiction(-0.25).contains("satisfies `motor` (missed by -2.5e-1) together"),
        "{}",
        contradiction(-0.25)
    );
    // At a lock-up: the acceleration of the last step that was tried.
    assert!(contradiction(-4.4e16).contains("satisfies `motor` together"), "{}", contradiction(-4.4e16));
    assert!(contradiction(f64::NAN).contains("satisfies `motor` together"));
}

#[test]
fn a_start_that_is_not_finite_is_named() {
    let model = Oscillator { omega: 1.0 };
    let run = |q: f64, u: f64, t: f64| {
        kind(model.simulate(PlainState { t, ..at_rest_or_not([q], [u]) }).until(1.0))
    };
    let named = |name, rate| SimulationErrorKind::from(OptionError::StartNotFinite { name, rate });
    assert_eq!(run(f64::NAN, 0.0, 0.0), named("x", false));
    assert_eq!(run(0.0, f64::INFINITY, 0.0), named("x", true));
    assert_eq!(run(0.0, 0.0, f64::NAN), named("t", false));
}

#[test]
fn inputs_without_value_or_with_a_bad_one_are_named() {
    let model = Driven { m: 1.0, k: 1.0, c: 0.0 };
    let start = PlainState {
        t: 0.0,
        q: [0.0].into(),
        u: [0.0].into(),
        inputs: [f64::NAN].into(),
        active_set: Default::default(),
    };
    let error = model.simulate(start).until(1.0).run().unwrap_err();
    assert_eq!(error.kind, OptionError::InputWithoutValue { input: "force" }.into());
    let law = |t: f64, _: &PlainState<1, 1>| [if t < 0.5 { 1.0 } else { f64::NAN }];
    let error = model.simulate(start).until(1.0).inputs(law).run().unwrap_err();
    assert_eq!(error.kind, SimulationErrorKind::InputNotFinite { input: "force" });
    assert!((error.time - 0.5).abs() < 1e-9, "{}", error.time);
    // The closure went with the simulation; given again, the motion is whole.
    let lost = error.motion(&model).unwrap();
    assert!(lost.at(0.25).inputs[0].is_nan() && (lost.at(0.25).q[0] - (1.0 - 0.25f64.cos())).abs() < 1e-7);
    assert!(lost.work().closure_error.is_nan());
    let whole = error.motion_with_inputs(&model, law).unwrap();
    assert_eq!(whole.at(0.25).inputs[0], 1.0);
    assert!((whole.at(0.25).q[0] - (1.0 - 0.25f64.cos())).abs() < 1e-9);
    assert!(whole.work().closure_error.abs() < 1e-9);
}

/// At a large time a run begins with steps of a few resolutions of this time, which then grow.
#[test]
fn steps_grow_from_the_resolution_of_a_large_time() {
    let rest = Closure(|_, _, _| 0.0);
    for t in [3e8, 1.7e9, 4e9] {
        let start = PlainState { t, ..at_rest_or_not([0.0], [0.0]) };
        let end = rest.simulate(start).until(t + 1e3).run().unwrap_or_else(|error| panic!("{error}")).end();
        assert_eq!((end.t, end.q[0]), (t + 1e3, 0.0));
    }
}

/// The interpolant of DOP853 asks for stages at 0.1, 0.2 and 7/9 of a step, which the step itself does
/// without.
#[test]
fn a_step_without_interpolant_is_taken_back() {
    let model = Driven { m: 1.0, k: 0.0, c: 0.0 };
    let start = PlainState {
        t: 0.0,
        q: [0.0].into(),
        u: [0.0].into(),
        inputs: [0.0].into(),
        active_set: Default::default(),
    };
    let law = |t: f64, _: &PlainState<1, 1>| [if (t - 1.2).abs() < 1e-3 { f64::NAN } else { 1.0 }];
    let run = || model.simulate(start).until(3.0).method(methods::Dop853).fixed_step(1.0).inputs(law);
    assert_eq!(run().run().unwrap().end_time(), 3.0, "nobody asks there");
    let error = run().event("far", |s| s.q[0] - 100.0).run().unwrap_err();
    assert_eq!(error.kind, SimulationErrorKind::InputNotFinite { input: "force" });
    assert_eq!(error.time, 1.0);
    let motion = error.motion_with_inputs(&model, law).unwrap();
    assert_eq!((motion.counts().steps, motion.steps().len(), motion.end_time()), (1, 2, 1.0));
    assert!((motion.at(0.5).q[0] - 0.125).abs() < 1e-12, "½·1·½² = ⅛");
}

/// A bead that is shot up a cycloid reaches the cusp, where its inertia vanishes.
#[test]
fn a_singular_mass_matrix_is_located() {
    let model = CycloidBead { radius: 1.0, g: 9.81 };
    // 2 R² (1 + cos θ) vanishes at θ = π; E is enough to get there.
    let error = model.simulate(at_rest_or_not([0.0], [4.0])).until(10.0).run().unwrap_err();
    match error.kind {
        SimulationErrorKind::SingularMassMatrix(singular) => assert_eq!(singular.name, "theta"),
        SimulationErrorKind::StepSizeTooSmall { coordinate } => assert_eq!(coordinate, "theta"),
        ref other => panic!("{other:?}"),
    }
    assert!((error.state.q[0] - std::f64::consts::PI).abs() < 1e-3, "{error}");
    let motion = error.motion(&model).unwrap();
    assert!(motion.counts().steps > 10 && motion.verify().energy_drift < 1e-6);
    assert_eq!(motion.end_time(), error.time);
    // At the start itself nothing is computed, and the start is still in hand.
    let error = model.simulate(at_rest_or_not([std::f64::consts::PI], [1.0])).until(1.0).run().unwrap_err();
    assert!(matches!(error.kind, SimulationErrorKind::SingularMassMatrix(_)));
    let motion = error.motion(&model).unwrap();
    assert_eq!((motion.steps().len(), motion.end_time()), (1, 0.0));
}

#[test]
fn blow_up_and_not_a_number_are_told_apart() {
    // q = 1/(1 − t): the step collapses at t = 1.
    let blow_up = Closure(|_, q, _| 2.0 * q * q * q);
    let error = blow_up.simulate(at_rest_or_not([1.0], [1.0])).until(2.0).run().unwrap_err();
    assert!((error.time - 1.0).abs() < 1e-4, "{error}");
    assert!(matches!(
        error.kind,
        SimulationErrorKind::StepSizeTooSmall { coordinate: "x" }
            | SimulationErrorKind::AccelerationNotFinite { coordinate: "x" }
    ));
    assert!(error.to_string().contains("stopped at t = ") && error.to_string().contains("x = "), "{error}");
    // √(1 − t) is not a number beyond t = 1.
    let edge = Closure(|t, _, _| (1.0 - t).sqrt());
    let error = edge.simulate(at_rest_or_not([0.0], [0.0])).until(2.0).run().unwrap_err();
    assert_eq!(error.kind, SimulationErrorKind::AccelerationNotFinite { coordinate: "x" });
    assert!((error.time - 1.0).abs() < 1e-9, "{error}");
    // A fixed step has no way around.
    let error = edge.simulate(at_rest_or_not([0.0], [0.0])).until(2.0).fixed_step(0.3).run().unwrap_err();
    assert_eq!(error.kind, SimulationErrorKind::AccelerationNotFinite { coordinate: "x" });
    assert_eq!(error.time, 0.3 * 3.0);
}

/// At t = 10¹² a second has 8,192 parts; a motion of a millisecond is not resolved.
#[test]
fn times_too_large_for_their_motion_are_an_error() {
    let model = Oscillator { omega: 1e6 };
    let start = PlainState { t: 1e12, ..at_rest_or_not([1.0], [0.0]) };
    let error = model.simulate(start).until(1e12 + 1.0).run().unwrap_err();
    assert!(matches!(error.kind, SimulationErrorKind::StepSizeTooSmall { coordinate: "x" }), "{error}");
}

#[test]
fn a_jump_that_no_step_resolves_passes_or_is_an_error_never_a_wrong_answer() {
    let jump = Closure(|t, _, _| if t < 0.5 { 1.0 } else { -1.0 });
    let motion = jump.simulate(at_rest_or_not([0.0], [0.0])).until(1.0).tolerance(1e-10).run().unwrap();
    // ½·½² + ½·½ − ½·½² = ¼
    assert!((motion.end().q[0] - 0.25).abs() < 1e-9, "{:?}", motion.end());
}

#[test]
fn step_limits_and_cancelling_leave_the_motion_in_hand() {
    let model = DoublePendulum::UNIT;
    let start = at_rest_or_not([2.0, 0.0], [0.0, 0.0]);
    let error = model.simulate(start).until(1e3).max_steps(100).method(methods::Dop853).run().unwrap_err();
    assert!(matches!(
        error.kind,
        SimulationErrorKind::TooManySteps { limit: 100, stiff_at: None, slides_at: None, gain: None }
    ));
    let motion = error.motion(&model).unwrap();
    assert_eq!(motion.counts().steps + motion.counts().rejected, 100);
    let whole = model.simulate(start).until(error.time).run().unwrap();
    let half = 0.5 * error.time;
    assert!((motion.at(half).q - whole.at(half).q).norm() < 1e-7);

    let (flag, calls) = (AtomicBool::new(false), AtomicU32::new(0));
    let error = model
        .simulate(start)
        .until(1e9)
        .cancel(&flag)
        .event("watch", |s| {
            if calls.fetch_add(1, Ordering::Relaxed) > 200 {
                flag.store(true, Ordering::Relaxed);
            }
            s.q[0] + 100.0
        })
        .run()
        .unwrap_err();
    assert_eq!(error.kind, SimulationErrorKind::Cancelled);
    assert!(error.time > 0.0 && error.motion(&model).unwrap().end_time() == error.time);

    // The function is asked before every step: the run ends after as many as it allows.
    let asked = Cell::new(0);
    let error = model
        .simulate(start)
        .until(1e9)
        .method(methods::Dop853)
        .cancel_when(|| asked.replace(asked.get() + 1) == 50)
        .run()
        .unwrap_err();
    let motion = error.motion(&model).unwrap();
    assert_eq!(error.kind, SimulationErrorKind::Cancelled);
    assert!(motion.counts().steps <= 50 && motion.counts().steps > 25, "{:?}", motion.counts());
}

#[test]
fn a_motion_lives_apart_from_its_model() {
    let (model, start) = (DoublePendulum::UNIT, at_rest_or_not([2.0, 0.0], [0.0, 0.0]));
    let motion = model.simulate(start).until(1.0).run().unwrap();
    let (at, end) = (motion.at(0.4), motion.end());
    let record = motion.record();
    drop(motion);
    let handed_over = std::thread::spawn(move || (record.motion(&DoublePendulum::UNIT).at(0.4), record));
    let (there, record) = handed_over.join().unwrap();
    assert!(there == at && record.motion(&model).end() == end);

    // Its inputs are those of the closure, if it is given again, and else unknown.
    let driven = Driven { m: 1.0, k: 2.0, c: 0.1 };
    let law = |t: f64, _: &PlainState<1, 1>| t.cos();
    let start = PlainState::<1, 1>::new(0.0, [0.0].into(), [0.0].into(), [0.0].into());
    let motion = driven.simulate(start).until(1.0).inputs(law).run().unwrap();
    let (at, record) = (motion.at(0.4), motion.record());
    assert!(record.motion(&driven).at(0.4).inputs[0].is_nan());
    assert_eq!(record.motion_with_inputs(&driven, law).at(0.4), at);
}

#[test]
fn nothing_is_shown_of_a_run_that_is_refused() {
    let model = Oscillator { omega: 1.0 };
    let observe = |state: &PlainState<1, 0>| -> Flow { panic!("shown: {state:?}") };
    model.simulate(at_rest_or_not([f64::NAN], [0.0])).until(1.0).run_with(observe).unwrap_err();
    model.simulate(at_rest_or_not([1.0], [0.0])).until(1.0).tolerance(-1.0).run_with(observe).unwrap_err();
    model.simulate(at_rest_or_not([1.0], [0.0])).until(1.0).every(-1.0).run_with(observe).unwrap_err();
}

#[test]
fn errors_travel() {
    fn run() -> Result<(), Box<dyn Error + Send + Sync>> {
        let model = Oscillator { omega: 1.0 };
        model.simulate(at_rest_or_not([1.0], [0.0])).run()?;
        Ok(())
    }
    let error = run().unwrap_err();
    assert!(error.downcast_ref::<SimulationError<Oscillator>>().is_some());
    assert!(size_of::<SimulationError<Oscillator>>() <= 128, "results stay small");
    fn crosses_threads<T: Send + Sync>() {}
    crosses_threads::<Motion<'_, Oscillator>>();
}

#[test]
fn questions_without_answer_are_errors_or_not_a_number() {
    let model = Pendulum { m: 2.0, l: 0.5, g: 9.81 };
    let motion = model.simulate(at_rest_or_not([1.0], [0.0])).until(1.0).run().unwrap();
    for t in [-0.1, 1.1, f64::NAN] {
        assert!(motion.at(t).q[0].is_nan() && motion.energy_at(t).is_nan());
        assert!(motion.accelerations_at(t)[0].is_nan() && motion.outputs_at(t)[0].is_nan());
        match motion.try_at(t) {
            Err(MotionError::OutOfRange { start: 0.0, end: 1.0, .. }) => {}
            other => panic!("{other:?}"),
        }
        assert!(motion.output("tension", t).is_err());
    }
    assert_eq!(motion.at(1.0 + 4e-16).q, motion.end().q, "rounding does not lead out of the motion");
    match motion.output("tenson", 0.5) {
        Err(MotionError::UnknownOutput { suggestion: Some(near), .. }) => assert_eq!(near, "tension"),
        other => panic!("{other:?}"),
    }
    let tension = motion.output("tension", 0.5).unwrap();
    let state = motion.at(0.5);
    assert_eq!(tension, 2.0 * (0.5 * state.u[0] * state.u[0] + 9.81 * state.q[0].cos()));
    assert_eq!(motion.outputs_of(&state), [tension]);
}

/// The step after which the constraint has drifted too far belongs to the motion: its start and its end are
/// recorded, so that states within the last steps are between them.
#[test]
fn the_step_in_which_constraints_drift_too_far_is_part_of_the_motion() {
    let model = Rod { m: 1.0, l: 1.0, g: 9.81 };
    let start = at_rest_or_not([1.0, 0.0], [0.0, 0.0]);
    let run = |limit: f64| {
        let run = model.simulate(start).until(1000.0).tolerance(1e-6).drift_limit(limit);
        run.formulation(Formulation::Augmented).max_steps(100_000).run()
    };
    let error = run(1e-3).unwrap_err();
    assert!(matches!(error.kind, SimulationErrorKind::Drift { .. }), "{error}");
    let motion = error.motion(&model).unwrap();
    assert_eq!(motion.end_time(), error.time);
    assert_eq!(motion.steps().count() as u64, motion.counts().steps + 1);
    // A run with a larger limit makes the same steps and goes on.
    let further = match run(2e-3) {
        Ok(_) => panic!("the drift grows"),
        Err(further) => further,
    };
    let further = further.motion(&model).unwrap();
    assert!(further.end_time() > motion.end_time());
    let times: Vec<f64> = motion.steps().map(|state| state.t).collect();
    for pair in times.windows(2).rev().take(3) {
        for part in [0.25, 0.5, 0.75] {
            let t = pair[0] + part * (pair[1] - pair[0]);
            let difference = (motion.at(t).q - further.at(t).q).amax();
            assert!(difference < 1e-9, "{t}: {difference:e}");
        }
    }
}

//! What a motion answers: states between steps, output times, works, and the same answers by independent
//! routes.

use crate::common;

use common::*;
use dynamics_runtime::integrate::Tolerances;
use dynamics_runtime::methods;
use dynamics_runtime::model::ModelState;
use dynamics_runtime::simulate::{Flow, Method, Motion, Simulate};
use nalgebra::SMatrix;
use proptest::prelude::*;

fn all<M: Simulate>() -> [methods::Any<M>; 3] {
    [methods::Rk4.into(), methods::DormandPrince5.into(), methods::Dop853.into()]
}

/// The oscillator's motion by one of the methods, at an accuracy of about 1e-9.
fn swing<'m>(model: &'m Oscillator, method: &methods::Any<Oscillator>) -> Motion<'m, Oscillator> {
    let simulation = model.simulate(at_rest_or_not([1.0], [0.5])).until(10.0).method(method);
    let simulation =
        if method.is_adaptive() { simulation.tolerance(1e-11) } else { simulation.fixed_step(0.002) };
    simulation.run().unwrap()
}

#[test]
fn states_between_steps_are_as_good_as_the_steps() {
    let model = Oscillator { omega: 2.0 };
    for method in &all() {
        let motion = swing(&model, method);
        let times: Vec<f64> = (0..=1000).map(|k| 0.01 * f64::from(k)).collect();
        for (state, &t) in motion.sample(times.iter().copied()).zip(&times) {
            let (sin, cos) = (2.0 * t).sin_cos();
            assert!((state.q[0] - cos - 0.25 * sin).abs() < 2e-9, "{method} at {t}");
            assert!((state.u[0] + 2.0 * sin - 0.5 * cos).abs() < 4e-9, "{method} at {t}");
            assert_eq!(state, motion.at(t), "one by one and in a row");
            assert_eq!(state.t, t);
        }
        // Backwards through the times the answers are the same.
        for (state, &t) in motion.sample(times.iter().rev().copied()).zip(times.iter().rev()) {
            assert_eq!(state, motion.at(t));
        }
        let (acceleration, state) = (motion.accelerations_at(3.3)[0], motion.at(3.3));
        assert_eq!(acceleration, -4.0 * state.q[0]);
        assert_eq!(motion.coordinates_at(3.3), (state, [acceleration].into()));
        assert_eq!(motion.energy_at(3.3), 0.5 * (state.u[0] * state.u[0] + 4.0 * state.q[0] * state.q[0]));
        assert_eq!(motion.steps().len() as u64, motion.counts().steps + 1);
        assert_eq!(motion.states().count(), motion.steps().len());
        assert_eq!((motion.start(), motion.end()), (motion.at(0.0), motion.at(10.0)));
    }
}

#[test]
fn output_times_are_met_and_change_no_step() {
    let model = Oscillator { omega: 2.0 };
    let run = || model.simulate(at_rest_or_not([1.0], [0.0])).until(1.0);
    let free = run().run().unwrap();
    let motion = run().every(0.1).run().unwrap();
    let times: Vec<f64> = motion.states().map(|s| s.t).collect();
    assert_eq!(times.len(), 11, "{times:?}");
    assert!(times.iter().enumerate().all(|(k, t)| (t - 0.1 * k as f64).abs() < 1e-15));
    assert_eq!((motion.counts().steps, motion.end()), (free.counts().steps, free.end()));
    let asked = run().output_times([0.2, 0.7, 0.7, 1.0]).run().unwrap();
    assert_eq!(asked.states().map(|s| s.t).collect::<Vec<_>>(), [0.2, 0.7, 0.7, 1.0]);
    let backwards = model.simulate(at_rest_or_not([1.0], [0.0])).until(-1.0).every(0.25).run().unwrap();
    assert_eq!(backwards.states().map(|s| s.t).collect::<Vec<_>>(), [0.0, -0.25, -0.5, -0.75, -1.0]);
    let stopped = run()
        .every(0.25)
        .event("early", |s| s.t - 0.6)
        .stop_at("early", dynamics_runtime::simulate::Direction::Any)
        .run()
        .unwrap();
    assert_eq!(stopped.states().map(|s| s.t).collect::<Vec<_>>(), [0.0, 0.25, 0.5]);
    let still = model.simulate(at_rest_or_not([1.0], [0.0])).until(0.0).run().unwrap();
    assert_eq!((still.steps().len(), still.at(0.0).q[0], still.verify().energy_drift), (1, 1.0, 0.0));
}

#[test]
fn observers_see_what_a_motion_keeps() {
    let model = DoublePendulum::UNIT;
    let start = at_rest_or_not([2.0, -0.5], [0.0, 0.3]);
    let run = || model.simulate(start).until(3.0);
    let motion = run().run().unwrap();
    let mut seen = Vec::new();
    let end = run().run_with(|s| seen.push(*s)).unwrap();
    assert_eq!(seen, motion.steps().collect::<Vec<_>>());
    assert_eq!(end, motion.end());
    let sampled = run().every(0.1).run().unwrap();
    let mut seen = Vec::new();
    run().every(0.1).run_with(|s| seen.push(*s)).unwrap();
    assert_eq!(seen.len(), 31);
    for (a, b) in seen.iter().zip(sampled.states()) {
        assert_eq!(a.t, b.t);
        assert!((a.q - b.q).norm() < 1e-13);
    }
    // A motion of no length still has its start.
    let mut seen = Vec::new();
    model.simulate(start).until(0.0).output_times([0.0, 0.0]).run_with(|s| seen.push(*s)).unwrap();
    assert_eq!(seen, [start, start]);
    let mut count = 0;
    let early = run()
        .run_with(|s| {
            count += 1;
            if s.t > 1.0 { Flow::Stop } else { Flow::Continue }
        })
        .unwrap();
    assert!(early.t > 1.0 && early.t < 1.5 && count > 2);
}

#[test]
fn fixed_steps_lie_on_their_grid_and_end_where_asked() {
    let model = Oscillator { omega: 1.0 };
    for method in &all() {
        let run = |h: f64| {
            model.simulate(at_rest_or_not([1.0], [0.0])).until(10.0).fixed_step(h).method(method).run()
        };
        let motion = run(0.1).unwrap();
        assert_eq!(motion.counts().steps, 100, "{method}: no tiny last step");
        for (k, state) in motion.steps().enumerate() {
            assert!((state.t - 0.1 * k as f64).abs() < 2e-15, "{method}");
        }
        assert_eq!(run(0.3).unwrap().counts().steps, 34, "{method}: the last one is shorter");
        assert_eq!(run(0.3).unwrap().end_time(), 10.0);
        assert_eq!(run(100.0).unwrap().counts().steps, 1);
    }
}

#[test]
fn the_method_is_chosen_with_a_reason() {
    let model = Oscillator { omega: 1.0 };
    let run = || model.simulate(at_rest_or_not([1.0], [0.0])).until(1.0);
    assert_eq!(run().run().unwrap().method(), Method::Verner9);
    assert_eq!(run().tolerance(1e-3).run().unwrap().method(), Method::Tsit5);
    assert_eq!(run().fixed_step(0.1).run().unwrap().method(), Method::Rk4);
    let text = run().tolerance(1e-3).run().unwrap().verify().to_string();
    assert!(text.contains("Tsitouras 5(4), because tolerance 1e-3 asks for few digits"), "{text}");
}

/// m ẍ = −k x − c ẋ + F₀ cos Ωt in closed form, and the works of both forces.
#[test]
fn the_account_of_work_closes_to_the_tolerance() {
    let (omega, amplitude) = (1.7, 0.8);
    let model = Driven { m: 1.5, k: 3.0, c: 0.4 };
    let start = PlainState {
        t: 0.0,
        q: [0.2].into(),
        u: [-0.1].into(),
        inputs: [f64::NAN].into(),
        active_set: Default::default(),
    };
    for (method, tolerance, closure) in [
        (methods::Any::from(methods::Dop853), 1e-12, 1e-11),
        (methods::Dop853.into(), 1e-6, 1e-5),
        (methods::DormandPrince5.into(), 1e-9, 1e-8),
    ] {
        let law = |t: f64, _: &PlainState<1, 1>| [amplitude * (omega * t).cos()];
        let motion =
            model.simulate(start).until(20.0).tolerance(tolerance).method(&method).inputs(law).run().unwrap();
        let account = motion.work();
        println!("{account}");
        assert_eq!(account.forces[0].name, "drive");
        assert!(account.closure_error.abs() < closure * account.scale, "{method}: {account}");
        assert!(account.closure_error != 0.0, "closed by construction would show nothing");
        assert!(account.forces[1].work < 0.0, "a damper takes energy");
        // The damper's work by Simpson's rule on the dense output.
        let parts = 20_000;
        let h = 20.0 / f64::from(parts);
        let power: Vec<f64> =
            motion.sample((0..=parts).map(|k| h * f64::from(k))).map(|s| -0.4 * s.u[0] * s.u[0]).collect();
        let simpson: f64 = power
            .iter()
            .enumerate()
            .map(|(k, p)| p * if k == 0 || k == parts as usize { 1.0 } else { 2.0 + 2.0 * (k % 2) as f64 })
            .sum::<f64>()
            * h
            / 3.0;
        assert!(
            (simpson - account.forces[1].work).abs() < 30.0 * closure,
            "{simpson} for {}",
            account.forces[1].work
        );
        assert!(
            motion.verify().energy_drift < 10.0 * closure,
            "the same error against the smaller scale of T and V"
        );
        assert!(motion.verify().has_work);
    }
}

/// Inputs as a closure of time and state: feedback u = −k x − c ẋ turns a free mass into an oscillator.
#[test]
fn feedback_through_inputs_is_the_model_with_the_force_built_in() {
    let free = Driven { m: 2.0, k: 0.0, c: 0.0 };
    let built_in = Driven { m: 2.0, k: 5.0, c: 0.3 };
    let start = |input: f64| PlainState {
        t: 0.0,
        q: [1.0].into(),
        u: [0.0].into(),
        inputs: [input].into(),
        active_set: Default::default(),
    };
    let fed = free
        .simulate(start(f64::NAN))
        .until(7.0)
        .tolerance(1e-12)
        .inputs(|_, s| [-5.0 * s.q[0] - 0.3 * s.u[0]])
        .run()
        .unwrap();
    let direct = built_in.simulate(start(0.0)).until(7.0).tolerance(1e-12).run().unwrap();
    for t in [0.0, 0.3, 2.0, 6.9, 7.0] {
        assert!((fed.at(t).q - direct.at(t).q).norm() < 1e-10);
        let state = fed.at(t);
        assert_eq!(state.inputs[0], -5.0 * state.q[0] - 0.3 * state.u[0]);
    }
}

/// The bar goes to the error stream and changes nothing.
#[cfg(feature = "progress")]
#[test]
fn a_progress_bar_changes_nothing() {
    let model = DoublePendulum::UNIT;
    let run = || model.simulate(at_rest_or_not([2.0, -0.5], [0.0, 0.3])).until(300.0).tolerance(1e-13);
    assert_eq!(run().progress().run().unwrap().end(), run().run().unwrap().end());
}

#[test]
fn summaries_read_well() {
    let model = Kepler;
    let motion = model.simulate(at_rest_or_not([0.5, 0.0], [0.0, 3f64.sqrt()])).until(10.0).run().unwrap();
    let text = motion.verify().to_string();
    for part in [
        "Kepler from t = 0 to 10",
        "Verner 9(8), because its long steps win at tolerance 1e-9",
        " accepted, ",
        "evaluations of the accelerations",
        "wall time",
        "energy ",
        "angular momentum ",
        "apsis 3 times",
    ] {
        assert!(text.contains(part), "`{part}` is missing in\n{text}");
    }
    let errors = motion.energy_errors();
    assert_eq!(errors.len(), motion.steps().len());
    let largest = errors.iter().map(|(_, e)| e.abs()).fold(0.0, f64::max);
    assert!((largest - motion.verify().energy_drift).abs() <= 1e-3 * largest);
}

/// Jacobians are values whatever the model is: the oscillator is neither `Copy` nor `Debug` nor comparable.
#[test]
fn jacobians_are_values() {
    use dynamics_runtime::model::StateJacobian;
    let jacobian = StateJacobian::<Oscillator> {
        accelerations: [1.0].into(),
        by_q: SMatrix::<f64, 1, 1>::new(-4.0),
        by_u: SMatrix::<f64, 1, 1>::new(0.0),
    };
    let copy = jacobian;
    assert_eq!(jacobian, copy);
    assert_ne!(jacobian, StateJacobian { by_u: SMatrix::<f64, 1, 1>::new(1.0), ..copy });
    assert!(
        format!("{jacobian:?}").starts_with("StateJacobian { accelerations: [[1.0]], by_q: [[-4.0]]"),
        "{jacobian:?}"
    );
}

/// A light bob above a heavy one: S = [[1, r], [r, 1]] with r = cos(θ₁ − θ₂) √(m₂/(m₁ + m₂)), so κ =
/// (1 + |r|)/(1 − |r|).
#[test]
fn the_worst_conditioning_is_found_whatever_the_units() {
    for (m1, m2, l1, l2) in [(1.0, 1.0, 1.0, 1.0), (1e-6, 1.0, 1.0, 1.0), (1.0, 2.0, 1e3, 1e-3)] {
        let model = DoublePendulum { m1, m2, l1, l2, g: 9.8 };
        let motion = model.simulate(at_rest_or_not([0.3, -0.5], [0.0, 0.0])).until(1.0).run().unwrap();
        let number = |s: &PlainState<2, 0>| {
            let r = ((s.q[0] - s.q[1]).cos() * (m2 / (m1 + m2)).sqrt()).abs();
            (1.0 + r) / (1.0 - r)
        };
        let worst = motion.steps().max_by(|a, b| number(a).total_cmp(&number(b))).unwrap();
        let found = motion.summary().conditioning;
        assert!(
            (found.largest / number(&worst) - 1.0).abs() < 1e-8,
            "{found:?} instead of {}",
            number(&worst)
        );
        assert_eq!(found.time, worst.t);
        let line = format!("conditioning mass matrix {:.1e} at most, at t = ", found.largest);
        assert!(motion.verify().to_string().contains(&line), "{}", motion.verify());
    }
    let model = Oscillator { omega: 1.0 };
    let motion = model.simulate(at_rest_or_not([1.0], [0.0])).until(1.0).run().unwrap();
    assert_eq!(motion.summary().conditioning.largest, 1.0);
    assert!(!motion.verify().to_string().contains("conditioning"));
    // At the cusp the bead has no inertia.
    let cusp = at_rest_or_not([std::f64::consts::PI], [1.0]);
    let bead = CycloidBead { radius: 1.0, g: 9.81 };
    let error = bead.simulate(cusp).until(1.0).run().unwrap_err();
    assert_eq!(error.motion(&bead).unwrap().summary().conditioning.largest, f64::INFINITY);
}

/// x = a cos ωt and v/ω sin ωt: from nanometres to metres, in rest or through the middle, fast and slow,
/// errors are parts of the motion.
#[test]
fn small_motions_have_the_digits_of_large_ones() {
    for omega in [1e-3, 1.0, 1e4] {
        let model = Oscillator { omega };
        for size in [1.0, 1e-3, 1e-6, 1e-9] {
            for start in [at_rest_or_not([size], [0.0]), at_rest_or_not([0.0], [size * omega])] {
                let motion = model.simulate(start).until(20.0 / omega).run().unwrap();
                let (sin, cos) = 20.0f64.sin_cos();
                let exact = start.q[0] * cos + start.u[0] / omega * sin;
                let error = (motion.end().q[0] - exact).abs() / size;
                // Below a micrometre the absolute tolerance ends at some units in the last place of 1.
                assert!(error < 1e-7f64.max(1e-13 / size), "{omega} {size}: {error:e}\n{}", motion.verify());
                let steps = motion.counts().steps;
                assert!(steps < 100, "{omega} {size}: {steps}");
            }
        }
    }
}

/// What is at rest, but for rounding, asks for nothing, nor does a motion that dies away; a tolerance that
/// was given in two parts is kept.
#[test]
fn absolute_tolerances_follow_motions_and_not_rounding() {
    let kept = |motion: &Motion<'_, Closure>| motion.summary().tolerances.unwrap();
    let both = |absolute| Tolerances { absolute, relative: 1e-9 };
    let rest = Closure(|_, _, _| 0.0);
    assert_eq!(kept(&rest.simulate(at_rest_or_not([0.0], [0.0])).until(1.0).run().unwrap()), both(1e-9));
    // A stiff spring whose force is rounding where it rests: 1e8 N/m at 1 m.
    let stretched = Closure(|_, q, u| -1e8 * (q - 0.3) - 2e3 * u);
    let rounding = stretched.simulate(at_rest_or_not([0.3 + 1e-16], [0.0])).until(1.0).run().unwrap();
    assert!(rounding.counts().steps < 5000, "{}", rounding.verify());
    let damped = Closure(|_, q, u| -q - 0.5 * u);
    let motion = damped.simulate(at_rest_or_not([1.0], [0.0])).until(60.0).run().unwrap();
    assert_eq!(kept(&motion), both(1e-9));
    assert!(motion.counts().steps < 150 && motion.summary().few_digits.is_empty(), "{}", motion.verify());
    let spring = Closure(|_, q, _| -q);
    let small = at_rest_or_not([5e-7], [0.0]);
    let given = spring.simulate(small).until(10.0).tolerances(1e-9, 1e-9).run().unwrap();
    assert_eq!(kept(&given), both(1e-9));
    let summary = given.verify();
    assert_eq!(summary.few_digits.len(), 2, "{summary}");
    let line = "few digits   x stays within 5e-7, 500 times the absolute tolerance; for more digits of it \
        give";
    assert!(summary.to_string().contains(line), "{summary}");
    let own = spring.simulate(small).until(10.0).run().unwrap().verify();
    // Ten times the size, of places or velocities, in the first steps.
    let absolute = own.tolerances.unwrap().absolute;
    assert!((4e-15..=5e-15).contains(&absolute) && own.few_digits.is_empty(), "{own}");
    assert!(own.to_string().contains("e-15 absolute, 1.0e-9 relative"), "{own}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    /// Along any motion of the double pendulum energy holds, and halves of it fit together.
    #[test]
    fn any_double_pendulum(
        q in prop::array::uniform2(-3.0..3.0f64),
        u in prop::array::uniform2(-3.0..3.0f64),
        masses in prop::array::uniform2(0.1..5.0f64),
        lengths in prop::array::uniform2(0.2..2.0f64),
        middle in 0.1..1.9f64,
    ) {
        let model = DoublePendulum { m1: masses[0], m2: masses[1], l1: lengths[0], l2: lengths[1], g: 9.8 };
        let whole = model.simulate(at_rest_or_not(q, u)).until(2.0).tolerance(1e-11).run().unwrap();
        prop_assert!(whole.verify().energy_drift < 1e-8);
        let first = model.simulate(at_rest_or_not(q, u)).until(middle).tolerance(1e-11).run().unwrap();
        prop_assert!((first.end().q - whole.at(middle).q).norm() < 1e-5);
        let second = model.simulate(first.end()).until(2.0).tolerance(1e-11).run().unwrap();
        prop_assert!((second.end().q() - whole.end().q()).norm() < 1e-4);
        prop_assert!(whole.steps().map(|s| s.t).collect::<Vec<_>>().is_sorted());
    }
}

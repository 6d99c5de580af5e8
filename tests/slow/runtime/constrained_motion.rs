//! Motions of constrained models: drift by formulation, reactions, and runs that leave their constraints and
//! say so.

use crate::common;

use common::constrained::{Rod, SliderCrank};
use common::*;
use dynamics_runtime::integrate::{Direction, Dop853, Phase, StepOptions, Stepper, Tolerances};
use dynamics_runtime::methods;
use dynamics_runtime::model::Constraints;
use dynamics_runtime::simulate::{Flow, Formulation, Motion, Simulate, SimulationErrorKind};

const ROD: Rod = Rod { m: 2.0, l: 1.5, g: 9.81 };

/// On the rod at an angle from the lowest point, moving with angular velocity ω.
fn on_rod(theta: f64, omega: f64) -> PlainState<2, 0> {
    let (s, c) = theta.sin_cos();
    at_rest_or_not([ROD.l * s, -ROD.l * c], [ROD.l * omega * c, ROD.l * omega * s])
}

const ALL: [Formulation; 5] = [
    Formulation::Augmented,
    Formulation::Baumgarte { alpha: 5.0, beta: 5.0 },
    Formulation::BaumgarteTied,
    Formulation::Projected,
    Formulation::Embedded,
];

/// Errors of the steps grow along a swing of ten seconds: as they do in the angle alone, in the geometric
/// mean over five tolerances.
#[test]
fn every_formulation_follows_the_pendulum() {
    follow_the_pendulum(methods::DormandPrince5);
    follow_the_pendulum(methods::Dop853);
}

fn follow_the_pendulum(method: impl methods::Choice + std::fmt::Debug) {
    let minimal = Pendulum { m: ROD.m, l: ROD.l, g: ROD.g };
    let swing = || minimal.simulate(at_rest_or_not([2.0], [0.5])).until(10.0);
    let exact = swing().tolerance(1e-13).run().unwrap();
    // Largest errors of positions and velocities, and of λ = −tension/l for Φ = ½(x² + y² − l²).
    let worst = |of: &dyn Fn(f64) -> (PlainState<2, 0>, f64)| {
        (1..=100).map(|k| 0.1 * f64::from(k)).fold([0.0f64; 2], |worst, t| {
            let (state, tension) = of(t);
            let theta = exact.at(t);
            let wanted = on_rod(theta.q[0], theta.u[0]);
            let phase = (state.q - wanted.q).amax().max((state.u - wanted.u).amax());
            [worst[0].max(phase), worst[1].max((tension - minimal_tension(&exact, t)).abs())]
        })
    };
    let tolerances = [1e-6, 1e-7, 1e-8, 1e-9, 1e-10];
    let of_angle = tolerances.map(|tolerance| {
        let angle = swing().tolerance(tolerance).method(method).run().unwrap();
        worst(&|t| (on_rod(angle.at(t).q[0], angle.at(t).u[0]), minimal_tension(&angle, t)))
    });
    for formulation in ALL {
        let mut excess = [0.0; 2];
        for (tolerance, of_angle) in tolerances.iter().zip(&of_angle) {
            let run = ROD.simulate(on_rod(2.0, 0.5)).until(10.0).tolerance(*tolerance).method(method);
            let motion = run.drift_limit(1e-3).formulation(formulation).run().unwrap();
            let met = worst(&|t| (motion.at(t), -motion.reaction_at("rod", t).unwrap()[0] * ROD.l));
            (0..2).for_each(|k| excess[k] += (met[k] / of_angle[k]).ln() / tolerances.len() as f64);
        }
        let excess = excess.map(f64::exp);
        println!("{method:?} {formulation}: {excess:.1?}");
        // Where the constraint drifts, its errors are those of coordinates that may miss it.
        let most = if formulation.is_exact() { 6.0 } else { 20.0 };
        assert!(excess.iter().all(|excess| *excess < most), "{method:?} {formulation}: {excess:?}");
    }
}

fn minimal_tension(exact: &Motion<'_, Pendulum>, t: f64) -> f64 {
    exact.output("tension", t).unwrap()
}

/// 1,000 s: what is projected stays, what is not drifts, and each says how far.
#[test]
fn drift_over_a_thousand_seconds() {
    let run = |formulation| {
        let run = ROD.simulate(on_rod(2.0, 0.0)).until(1000.0).tolerance(1e-9).formulation(formulation);
        run.run().unwrap().verify()
    };
    let [augmented, gains, tied, projected, embedded] = ALL.map(run);
    let drift = |summary: &dynamics_runtime::simulate::Summary| {
        let rod = &summary.constraints[0];
        (rod.residual, rod.velocity_residual)
    };
    for summary in [&augmented, &gains, &tied, &projected, &embedded] {
        println!("{summary}\n");
    }
    for summary in [&projected, &embedded] {
        assert!(drift(summary).0 < 1e-12 && drift(summary).1 < 1e-12, "{summary}");
    }
    assert!(drift(&augmented).0 > 1e-7, "{augmented}");
    for summary in [&gains, &tied] {
        let (position, velocity) = drift(summary);
        assert!(position < 1e-8 && velocity < 1e-7 && position > 1e-14, "{summary}");
    }
}

/// However long a constrained run is, it allocates a fixed number of times.
#[test]
fn constrained_steps_do_not_allocate() {
    for formulation in ALL {
        let observed = |end: f64| {
            let mut states = 0_u64;
            let simulation = ROD.simulate(on_rod(2.0, 0.5)).until(end).formulation(formulation);
            let info = allocation_counter::measure(|| {
                simulation.run_with(|_| states += 1).unwrap();
            });
            (states, info.count_total)
        };
        let ((few, short), (many, long)) = (observed(1.0), observed(30.0));
        assert!(many > 20 * few, "{formulation}: {few} {many}");
        assert_eq!(short, long, "{formulation}");
    }
    // All methods that take constraints and forces with velocities.
    for method in [
        methods::Any::from(methods::Rk4),
        methods::DormandPrince5.into(),
        methods::Tsit5.into(),
        methods::Dop853.into(),
        methods::Verner9.into(),
        methods::GraggBulirschStoer.into(),
        methods::Radau5.into(),
        methods::Esdirk4.into(),
        methods::GeneralizedAlpha::default().into(),
        methods::SemiImplicitEuler.into(),
        methods::ExplicitEuler.into(),
        methods::Heun.into(),
        methods::AdamsBashforth4.into(),
    ] {
        let observed = |end: f64| {
            let simulation = ROD.simulate(on_rod(2.0, 0.5)).until(end).method(&method);
            let simulation =
                if method.is_adaptive() { simulation.tolerance(1e-6) } else { simulation.fixed_step(2e-3) };
            let info = allocation_counter::measure(|| {
                simulation.run_with(|_| {}).unwrap();
            });
            info.count_total
        };
        assert_eq!(observed(0.2), observed(2.0), "{method}");
    }
}

/// Gains tied to the step take an error back in two steps, down to what the curvature of the constraint
/// leaves of it.
#[test]
fn tied_gains_take_an_error_back_in_two_steps() {
    let off = 1e-6;
    let mut start = on_rod(0.5 * core::f64::consts::PI, 0.0);
    start.q[0] += off / ROD.l;
    for h in [1e-2, 1e-3, -1e-3] {
        let run = ROD.simulate(start).until(6.0 * h).method(methods::Rk4).fixed_step(f64::abs(h));
        let motion = run.formulation(Formulation::BaumgarteTied).run().unwrap();
        let residuals: Vec<f64> = motion.steps().map(|state| ROD.residual(&state)[0]).collect();
        // [½, ¼; −1, −½] halves Φ, and then leaves nothing.
        assert!((residuals[1] / off - 0.5).abs() < 1e-2, "{h}: {residuals:?}");
        assert!(residuals[2..].iter().all(|residual| residual.abs() < 1e-3 * off), "{h}: {residuals:?}");
        // What lies between two steps is the step's own.
        let middle = ROD.residual(&motion.at(0.5 * h))[0];
        assert!(middle < off && middle > 0.5 * off, "{h}: {middle:e}");
    }
    // Where the step is chosen it is not the push of the step before that chooses it.
    for method in &[methods::Any::from(methods::DormandPrince5), methods::Dop853.into()] {
        let run = ROD.simulate(start).until(1.0).tolerance(1e-9).method(method);
        let motion = run.formulation(Formulation::BaumgarteTied).run().unwrap();
        let drift = ROD.residual(&motion.end())[0];
        assert!(
            drift.abs() < 1e-8 && motion.counts().steps < 100,
            "{method}: {drift:e}, {}",
            motion.verify()
        );
    }
}

/// Steps that end at an event, however short, leave the motion as accurate as it is without.
#[test]
fn events_cut_no_step_short_of_what_tied_gains_can_take_back() {
    let (mut worst, mut ratio) = (0.0f64, 0.0f64);
    for tolerance in [1e-6, 1e-8, 1e-10] {
        for method in
            [methods::Any::from(methods::DormandPrince5), methods::Dop853.into(), methods::Tsit5.into()]
        {
            let run = || ROD.simulate(on_rod(2.0, 0.5)).until(10.0).tolerance(tolerance).method(&method);
            let truth = run().formulation(Formulation::Projected).tolerance(1e-13).run().unwrap().end();
            let off = |state: &PlainState<2, 0>| (state.q - truth.q).amax().max((state.u - truth.u).amax());
            let plain = off(&run().formulation(Formulation::BaumgarteTied).run().unwrap().end());
            for frequency in [0.7_f64, 3.1, 11.9, 17.3] {
                let run = run()
                    .formulation(Formulation::BaumgarteTied)
                    .event("tick", move |s| (frequency * s.t).sin());
                let run = run.on_event("tick", Direction::Any, |_| Flow::Continue).run();
                let motion =
                    run.unwrap_or_else(|error| panic!("{method} {tolerance:e} {frequency}: {error}"));
                assert!(motion.events().len() as f64 > 3.0 * frequency - 1.0);
                worst = worst.max(off(&motion.end()) / tolerance);
                ratio = ratio.max(off(&motion.end()) / plain);
                let drift = &motion.constraint_drift()[0];
                assert!(drift.residual < 100.0 * tolerance, "{method} {tolerance:e} {frequency}: {drift:?}");
                assert!(
                    drift.velocity_residual < 1e3 * tolerance,
                    "{method} {tolerance:e} {frequency}: {drift:?}"
                );
                // Steps that are made again, for what lies between them, have the gains that they had.
                let step = motion.steps().nth(7).unwrap();
                let (at, beside) = (motion.at(step.t), motion.at(step.t - 1e-9));
                assert!((at.u - beside.u).amax() < 1e-6);
            }
        }
    }
    println!("{worst:.1} permitted errors at most, {ratio:.1} times those without events");
    assert!(ratio < 10.0 && worst < 1e4, "{worst:e} {ratio:e}");
}

/// Fixed steps are made in parts where constraints nearly lose a direction, and nowhere else: what is just
/// too long is refused.
#[test]
fn fixed_steps_that_are_too_long_are_refused() {
    for (formulation, h) in
        [(Formulation::Projected, 0.3), (Formulation::Projected, 0.4), (Formulation::Embedded, 0.3)]
    {
        let run = ROD.simulate(on_rod(2.0, 0.5)).until(10.0).formulation(formulation).method(methods::Rk4);
        let error = run.fixed_step(h).run().unwrap_err();
        assert!(
            matches!(error.kind, SimulationErrorKind::StepDisplaced { .. }),
            "{formulation} {h}: {error}"
        );
    }
}

/// An event that leaves nothing of the first step leaves tied gains finite.
#[test]
fn an_event_at_the_start_is_met_in_every_formulation() {
    for formulation in ALL {
        let run = ROD.simulate(on_rod(2.0, 0.5)).until(1.0).tolerance(1e-9).formulation(formulation);
        let run =
            run.event("at once", |s| s.t - 1e-18).on_event("at once", Direction::Rising, |s| s.u *= 0.5);
        let motion = run.run().unwrap_or_else(|error| panic!("{formulation}: {error}"));
        let slower = ROD.simulate(on_rod(2.0, 0.25)).until(1.0).tolerance(1e-12).run().unwrap();
        assert_eq!(motion.events().len(), 1, "{formulation}");
        let error = (motion.end().q - slower.end().q).amax();
        assert!(error < 1e-7, "{formulation}: {error:e}");
    }
}

/// A linkage that starts where two of its assemblies meet has a row less there than a step further: embedded,
/// it is chosen among all of them from there on.
#[test]
fn an_embedded_run_that_starts_at_a_change_point_keeps_all_its_rows() {
    use core::f64::consts::FRAC_PI_2;
    // Crank and rod are alike, and no reaction has to keep them so: a slider that goes through the bearing of
    // the crank.
    let model = SliderCrank { a: 0.3, b: 0.3, j: 0.02, rod: 0.02, slider: 0.5, load: -4.0 };
    let rate = 3.0;
    let angle = crank_angle(&model, rate, 1.0);
    for tolerance in [1e-7, 1e-9, 1e-11] {
        let run = |formulation| {
            let start = at_rest_or_not([FRAC_PI_2, -FRAC_PI_2, 0.0], [rate, -rate, -2.0 * model.a * rate]);
            let motion =
                model.simulate(start).until(1.0).tolerance(tolerance).formulation(formulation).run().unwrap();
            let error = (motion.end().q
                - nalgebra::SVector::from([angle, -angle, 2.0 * model.a * angle.cos()]))
            .amax();
            assert!(error < 10.0 * tolerance, "{formulation} at {tolerance:e}: {error:e}");
            motion.verify()
        };
        let (projected, embedded) = (run(Formulation::Projected), run(Formulation::Embedded));
        for row in &embedded.constraints {
            assert!(row.residual < 1e-12 && row.velocity_residual < 1e-12, "{embedded}");
        }
        assert!(embedded.evaluations < 2 * projected.evaluations, "{projected}\n{embedded}");
    }
}

/// As long as the slider is not left in the bearing, the rod mirrors the crank: one angle, x = 2a cos θ.
fn crank_angle(model: &SliderCrank, rate: f64, end: f64) -> f64 {
    type V = nalgebra::SVector<f64, 1>;
    let reach = 2.0 * model.a;
    let mut minimal = |_: f64, q: &V, u: &V| {
        let (s, c) = q[0].sin_cos();
        let moved = model.slider * reach * reach;
        let force = -model.load * reach * s - moved * s * c * u[0] * u[0];
        Ok::<V, core::convert::Infallible>(V::new(force / (model.j + model.rod + moved * s * s)))
    };
    let options =
        StepOptions { tolerances: Tolerances::both(1e-13), fixed: None, first: None, most: f64::INFINITY };
    let start = Phase { q: V::new(core::f64::consts::FRAC_PI_2), u: V::new(rate) };
    let mut stepper = Stepper::<V, Dop853<V>>::new(&mut minimal, 0.0, start, end, options).unwrap();
    while stepper.now().t < end {
        stepper.step(&mut minimal, end).unwrap();
    }
    stepper.now().y.q[0]
}

/// What damps errors in one direction of time drives them in the other: gains follow the run.
#[test]
fn fixed_gains_hold_drift_backwards_as_they_do_forwards() {
    for (alpha, beta) in [(10.0, 10.0), (5.0, 20.0), (3.0, 0.0)] {
        let formulation = Formulation::Baumgarte { alpha, beta };
        let run = |end: f64, rate: f64| {
            let run = ROD.simulate(on_rod(2.0, rate)).until(end).tolerance(1e-9).formulation(formulation);
            run.drift_limit(f64::INFINITY).run().unwrap()
        };
        // Without friction the motion back in time is the one forwards with the opposite velocity.
        let (forwards, backwards) = (run(5.0, 0.5), run(-5.0, -0.5));
        assert!((forwards.end().q - backwards.end().q).amax() < 1e-9);
        let drift = |motion: &Motion<'_, Rod>| {
            let rod = &motion.constraint_drift()[0];
            (rod.residual, rod.velocity_residual)
        };
        let (ahead, back) = (drift(&forwards), drift(&backwards));
        assert!(back.0 <= 2.0 * ahead.0 && back.1 <= 2.0 * ahead.1, "{formulation}: {ahead:?} {back:?}");
        assert!(back.0 < 1e-7 && back.1 < 1e-6, "{formulation}: {back:?}");
        // Between steps, made again, it is the motion that was run.
        let middle = (backwards.at(-2.345).q - forwards.at(2.345).q).amax();
        assert!(middle < 1e-8, "{formulation}: {middle:e}");
    }
}

/// Fixed steps that are too long end far from the constraints, and the projection decides where: the summary
/// says by how much.
#[test]
fn the_summary_says_where_the_projection_made_the_motion() {
    let run = |h: f64| {
        let run = ROD.simulate(on_rod(2.0, 0.5)).until(3.0).method(methods::Rk4).fixed_step(h);
        run.run().unwrap().verify()
    };
    let (coarse, fine) = (run(0.1), run(2e-4));
    assert_eq!(coarse.stabilization.projected, 30);
    assert!(coarse.stabilization.largest_move > 1e3, "{:?}", coarse.stabilization);
    let line = "30 ends of steps put back onto the constraints, by ";
    assert!(coarse.to_string().contains(line), "{coarse}");
    assert!(
        fine.stabilization.largest_move < 10.0 && !fine.to_string().contains("ends of steps put back"),
        "{fine}"
    );
}

/// A heavy slider cannot lead over the dead centre of its crank, beyond which no position of the slider gives
/// one of the crank; fixed steps that go over it are as good as others, and as those that are projected.
#[test]
fn embedded_steps_go_over_dead_centres() {
    let model = SliderCrank { a: 0.1, b: 0.3, j: 0.02, rod: 1e-3, slider: 20.0, load: -40.0 };
    let (theta, rate) = (-0.5_f64, 20.0);
    let beta = (-model.a / model.b * theta.sin()).asin();
    let swing = -model.a * theta.cos() * rate / (model.b * beta.cos());
    let x = model.a * theta.cos() + model.b * beta.cos();
    let slide = -model.a * theta.sin() * rate - model.b * beta.sin() * swing;
    let start = at_rest_or_not([theta, beta, x], [rate, swing, slide]);
    let truth = model.simulate(start).until(0.05).tolerance(1e-13).run().unwrap().end();
    let run = |formulation, h| {
        let run =
            model.simulate(start).until(0.05).method(methods::Rk4).fixed_step(h).formulation(formulation);
        run.run()
    };
    let embedded = run(Formulation::Embedded, 0.0025).unwrap();
    // A step that constraints would move by much of its way is made in parts.
    let coarse = run(Formulation::Embedded, 0.0125).unwrap();
    assert!(
        (coarse.end().q - embedded.end().q).amax() < 0.03 && coarse.counts().rejected > 0,
        "{}",
        coarse.verify()
    );
    let projected = run(Formulation::Projected, 0.0025).unwrap();
    let summary = embedded.verify();
    assert!(
        summary.constraints.iter().all(|row| row.residual < 1e-12 && row.velocity_residual < 1e-12),
        "{summary}"
    );
    let errors = [&embedded, &projected].map(|motion| (motion.end().q - truth.q).amax());
    println!("{errors:?} {}", (coarse.end().q - truth.q).amax());
    assert!(errors[0] < 0.03 && errors[0] < 3.0 * errors[1], "{errors:?}");
}

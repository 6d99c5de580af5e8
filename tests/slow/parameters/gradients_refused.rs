//! Objectives that have no gradient, or one that jumps: errors that say so.

use dynamics::analysis::{LinearizeError, PeriodicError, SensitivityError};
use dynamics::model::Model;
use dynamics::prelude::*;

use super::difference;
use super::models::{BALL, Ball, Oscillator};

#[test]
fn objectives_that_make_no_sense_are_refused() {
    let model = Oscillator::PLAIN;
    let start = model.state().x(0.3).build().unwrap();
    let asked = || model.objective(start).until(1.0);
    assert_eq!(asked().run().err().unwrap(), SensitivityError::NoObjective);
    assert_eq!(asked().squares("x", 1.0, []).run().err().unwrap(), SensitivityError::NoObjective);
    assert_eq!(model.objective(start).end("x", 1.0).run().err().unwrap(), SensitivityError::NoEnd);
    let error = asked().end("y", 1.0).run().err().unwrap();
    assert!(matches!(error, SensitivityError::UnknownQuantity { .. }), "{error}");
    let error = asked().integral("x", f64::NAN).run().err().unwrap();
    assert!(matches!(error, SensitivityError::Weight { .. }), "{error}");
    let error = asked().squares("x", 1.0, [(0.5, 0.1), (0.6, f64::INFINITY)]).run().err().unwrap();
    assert!(matches!(error, SensitivityError::NotANumber { row: 1, .. }), "{error}");
    let error = asked().at(1.5, "x", 1.0).run().err().unwrap();
    assert_eq!(error, SensitivityError::OutOfRange { time: 1.5, start: 0.0, end: 1.0 });
    let found = asked().end("x", 1.0).by(["mass"]).run().unwrap();
    assert_eq!(found.get("damping").unwrap_err(), SensitivityError::NotAsked { name: "damping".into() });
}

/// Drawn back by a force that jumps in the middle.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
struct Relay {
    mass: f64,
    force: f64,
}

#[dynamics]
impl Relay {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.x.dt().powi(2)
    }
    #[force]
    fn relay(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, -self.force * q.x.signum())
    }
}

/// Pushed from a given time on.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
struct Clock {
    mass: f64,
    force: f64,
    when: f64,
}

#[dynamics]
impl Clock {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.x.dt().powi(2)
    }
    #[force]
    fn push(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, if q.t < self.when { Expr::ZERO } else { Expr::from(1.0) } * self.force)
    }
}

#[test]
fn jumps_are_refused_with_their_time() {
    let start = BALL.state().height(1.0).build().unwrap();
    let asked = || BALL.objective(start).end("height", 1.0).until(0.4);
    let at_low = (1.0_f64 / 9.81).sqrt();
    let error =
        asked().with(|s| s.on_event("low", Direction::Falling, |state| state.u[0] = -state.u[0])).run();
    let Some(SensitivityError::Jump { time, .. }) = error.err() else { panic!("a rebound was not seen") };
    assert!((time - at_low).abs() < 1e-9);
    let error = asked().with(|s| s.stop_at("low", Direction::Falling)).run().err().unwrap();
    let SensitivityError::EndsBefore { time, end } = error else { panic!("{error}") };
    assert!((time - at_low).abs() < 1e-9 && end == 0.4);
    // Steps of a fixed size end at no change of branch.
    let relay = Relay { mass: 1.0, force: 1.0 };
    let middle = relay.state().x(1.0).build().unwrap();
    let forward =
        relay.sensitivities(middle).by(["force"]).until(2.5).with(|s| s.fixed_step(0.01)).run().err();
    let back = relay.objective(middle).end("x", 1.0).until(2.5).with(|s| s.fixed_step(0.01)).run().err();
    for error in [forward, back] {
        let error = error.expect("a jump within a step was not seen");
        let SensitivityError::Jump { time, .. } = error else { panic!("{error}") };
        assert!((time - 2f64.sqrt()).abs() < 1e-4, "{error}");
    }
    // Also on the very instant at which a step is looked at.
    let clock = Clock { mass: 1.0, force: 1.0, when: 0.505 };
    let still = clock.state().build().unwrap();
    let error = clock.objective(still).end("x", 1.0).until(1.0).with(|s| s.fixed_step(0.01)).run().err();
    let Some(SensitivityError::Jump { time, .. }) = error else {
        panic!("a jump within a step was not seen: {error:?}")
    };
    assert!((time - 0.505).abs() < 1e-9);
    // A corner is none.
    let bounced = || BALL.objective(start).end("height", 1.0).by(["g"]).until(0.6);
    let adaptive = bounced().run().unwrap().get("g").unwrap();
    let off = [1e-3, 1e-4].map(|h| {
        let found = bounced().with(move |s| s.fixed_step(h)).run().unwrap();
        (found.get("g").unwrap() / adaptive - 1.0).abs()
    });
    assert!(off[0] < 1e-2 && off[1] < 0.1 * off[0], "{off:?}");
    for output in ["lit", "flash"] {
        let error =
            asked().integral(output, 1.0).run().err().unwrap_or_else(|| panic!("{output} was integrated"));
        let SensitivityError::Jump { time, what } = &error else { panic!("{error}") };
        assert!((time - at_low).abs() < 0.04 && what.contains("output"), "{error}");
    }
}

/// Corners are none: of the force, and of what is integrated.
#[test]
fn corners_are_integrated() {
    let start = BALL.state().height(1.0).build().unwrap();
    let of = |model: &Ball, tolerance: f64| {
        let found =
            model.objective(start).integral("depth", 1.0).end("height", 0.1).until(1.4).tolerance(tolerance);
        let found = found.by(["g", "stiffness"]).run().unwrap();
        (found.value, found.derivatives().to_vec())
    };
    let (_, by) = of(&BALL, 1e-11);
    for (k, h) in [1e-3, 0.1].into_iter().enumerate() {
        let moved = |h: f64| {
            let mut model = BALL;
            *[&mut model.g, &mut model.stiffness][k] += h;
            of(&model, 1e-12).0
        };
        let expected = difference(h, moved);
        assert!((by[k] / expected - 1.0).abs() < 1e-6, "{k}: {} {expected}", by[k]);
    }
}

/// A shaft that a switch drives back and forth.
mod switch {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(theta: rad)]
    #[inputs(torque: N * m)]
    #[units(inertia: kg * m^2)]
    struct Shaft {
        inertia: f64,
    }
    #[dynamics]
    impl Shaft {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.inertia * q.theta.dt().powi(2)
        }
        #[force]
        fn drive(&self, q: &Coordinates<Self>) -> Force {
            Force::along(q.theta, q.torque)
        }
    }

    /// What a switch does, that the angle throws, moves with the start; what a clock throws does not.
    #[test]
    fn laws_that_jump_with_the_state_are_refused() {
        let model = Shaft { inertia: 1.0 };
        let start = model.state().theta(1.0).torque(0.0).build().unwrap();
        let asked = || model.sensitivities(start).by(["theta", "inertia"]).until(2.5);
        let thrown = |_: f64, state: &<Shaft as Model>::State| [if state.theta() > 0.0 { -1.0 } else { 1.0 }];
        let error = asked().with(move |s| s.inputs(thrown)).run().err().expect("a switch was not seen");
        let SensitivityError::Jump { time, what } = &error else { panic!("{error}") };
        assert!((time - 2f64.sqrt()).abs() < 1e-6 && what == "torque", "{error}");
        let asked_all = model.objective(start).end("theta", 1.0).until(2.5);
        let error = asked_all.with(move |s| s.inputs(thrown)).run().err().expect("a switch was not seen");
        assert!(matches!(error, SensitivityError::Jump { .. }), "{error}");

        let found = asked().with(|s| s.inputs(|t, _| [if t < 1.0 { -1.0 } else { 1.0 }])).run().unwrap();
        let by = |name: &str| found.series("theta", name).unwrap().last().unwrap().1;
        // θ = 1 + (−½·1² − 1·1.5 + ½·1.5²)/I.
        assert!(
            (by("theta") - 1.0).abs() < 1e-9 && (by("inertia") - 0.875).abs() < 1e-7,
            "{}",
            by("inertia")
        );
    }

    /// A law that bends within a thousandth of a radian is followed by steps that are as small.
    #[test]
    fn laws_that_bend_sharply_have_their_derivatives() {
        let model = Shaft { inertia: 1.0 };
        let start = model.state().theta(1e-5).torque(0.0).build().unwrap();
        let asked =
            model.sensitivities(start).by(["theta"]).until(1e-2).output_times([1e-2]).tolerance(1e-11);
        let law = |_: f64, state: &<Shaft as Model>::State| [-(2e4 * state.theta()).tanh()];
        let found = asked.with(move |s| s.inputs(law).tolerances(1e-17, 1e-12)).run().unwrap();
        let moved = |h: f64| {
            let start = model.state().theta(1e-5 + h).torque(0.0).build().unwrap();
            model
                .simulate(start)
                .inputs(law)
                .tolerances(1e-18, 1e-13)
                .until(1e-2)
                .run()
                .unwrap()
                .end()
                .theta()
        };
        let (by, expected) = (found.series("theta", "theta").unwrap()[0].1, difference(1e-7, moved));
        assert!((by / expected - 1.0).abs() < 1e-6, "{by} {expected}");
    }
}

/// More blocks that rub than branches are followed: each turns round, and nobody sees it.
mod many {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: [m; 3])]
    #[units(mass: kg, rub: N, stiffness: N / m, apart: m)]
    struct Brushes {
        mass: f64,
        rub: f64,
        stiffness: f64,
        apart: f64,
    }
    #[dynamics]
    impl Brushes {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.mass * (q.x[0].dt().powi(2) + q.x[1].dt().powi(2) + q.x[2].dt().powi(2))
        }
        #[potential]
        fn springs(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.stiffness * (q.x[0].powi(2) + q.x[1].powi(2) + q.x[2].powi(2))
        }
        #[force]
        fn bristles(&self, q: &Coordinates<Self>) -> Force {
            let mut sum = Expr::ZERO;
            for i in 0..70 {
                sum += self.rub * (q.x[0] - i as f64 * self.apart).signum();
            }
            Force::along(q.x[0], -sum)
        }
    }

    #[test]
    fn branches_that_are_not_followed_are_said() {
        let model = Brushes { mass: 1.0, rub: 0.01, stiffness: 4.0, apart: 0.1 };
        let start = model.state().x([-1.0, 0.0, 0.0]).build().unwrap();
        let wanted = SensitivityError::Linearize(LinearizeError::BranchesNotFollowed);
        let found = model.sensitivities(start).by(["apart"]).until(1.5).run();
        assert_eq!(found.err().expect("jumps that nobody saw"), wanted);
        let found = model.objective(start).end("x[0]", 1.0).until(1.5).run();
        assert_eq!(found.err().expect("jumps that nobody saw"), wanted);
        let found = model.lyapunov(start).during(10.0).run();
        assert_eq!(found.err(), Some(PeriodicError::Derivatives(LinearizeError::BranchesNotFollowed)));
    }
}

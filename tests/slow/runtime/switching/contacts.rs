//! Contacts on positions: rebounds and rest, lift-off and landing, and options that are refused.

use super::*;

/// A ball over a floor: Φ = y ≥ 0.
struct Ball {
    m: f64,
    g: f64,
}

impl Held<2, 1, 1> for Ball {
    fn mass(&self, _: &PlainState<2, 0>) -> SMatrix<f64, 2, 2> {
        SMatrix::identity() * self.m
    }
    fn force(&self, _: &PlainState<2, 0>) -> SVector<f64, 2> {
        SVector::from([0.0, -self.m * self.g])
    }
    fn energy(&self, s: &PlainState<2, 0>) -> f64 {
        self.m * (0.5 * s.u.norm_squared() + self.g * s.q[1])
    }
    fn phi(&self, s: &PlainState<2, 0>) -> SVector<f64, 1> {
        SVector::from([s.q[1]])
    }
    fn phi_q(&self, _: &PlainState<2, 0>) -> SMatrix<f64, 1, 2> {
        SMatrix::<f64, 1, 2>::new(0.0, 1.0)
    }
    fn right(&self, _: &PlainState<2, 0>) -> SVector<f64, 1> {
        SVector::zeros()
    }
}
held!(Ball, 2 coordinates ["x", "y"], 1 + 0 = 1 rows ["floor"],
    [switched("floor", ConstraintKind::Holonomic, 0, 0)], friction false, events []);

/// Impacts at t₁ = √(2h/g) and then after flights of 2 eⁿ v₁/g, until the speed is a thousandth of v₁; then
/// it lies.
#[test]
fn a_ball_bounces_and_comes_to_rest() {
    let ball = Ball { m: 0.5, g: 9.81 };
    let (h, e) = (2.0, 0.7);
    let start = released(at_rest_or_not([0.0, h], [1.0, 0.0]), [0]);
    let motion = ball.simulate(start).until(6.0).tolerance(1e-10).contact("floor", e).run().unwrap();
    let (first, speed) = ((2.0 * h / ball.g).sqrt(), (2.0 * ball.g * h).sqrt());
    // eⁿ ≤ 1e-3 first for n = 20: impacts 0 to 19 rebound, the one after closes.
    assert_eq!(motion.events().len(), 21);
    let mut expected = first;
    for (n, event) in motion.events().iter().enumerate() {
        assert!((event.time() - expected).abs() < 1e-9, "impact {n}: {} {expected}", event.time());
        let hit = &event.impacts[0];
        let approach = speed * e.powi(n as i32);
        let restitution = if n < 20 { e } else { 0.0 };
        assert_eq!((event.name.as_str(), hit.constraint), ("floor contact", "floor"));
        assert!((hit.approach[0] + approach).abs() < 1e-8);
        assert!((hit.impulse[0] - ball.m * (1.0 + restitution) * approach).abs() < 1e-8);
        assert!(
            (hit.energy_lost - 0.5 * ball.m * approach * approach * (1.0 - restitution * restitution)).abs()
                < 1e-8
        );
        expected += 2.0 * e.powi(n as i32 + 1) * speed / ball.g;
    }
    let end = motion.end();
    assert!(end.active_set.all_hold() && end.q[1].abs() < 1e-15 && end.u[1].abs() < 1e-15);
    assert!((end.q[0] - 6.0).abs() < 1e-9, "it goes on sliding");
    assert!((motion.reaction_at("floor", 5.9).unwrap()[0] - ball.m * ball.g).abs() < 1e-12);
    assert_eq!(motion.reaction_at("floor", 0.5).unwrap(), [0.0], "in flight");
    let account = motion.work();
    assert!(account.resets.len() == 1 && account.resets[0].name == "floor contact", "{account}");
    assert!((account.resets[0].work + ball.m * ball.g * h).abs() < 1e-9, "{account}");
    let summary = motion.verify();
    assert_eq!(summary.impacts, 21);
    assert!((summary.energy_lost - ball.m * ball.g * h).abs() < 1e-9, "{summary}");
    assert!(summary.energy_drift < 1e-8, "{summary}");
    assert!(summary.to_string().contains("impacts      21, "), "{summary}");
    let slowest = speed * e.powi(20);
    assert!(
        summary.stabilization.rests == 1 && (summary.stabilization.fastest_rest - slowest).abs() < 1e-8,
        "{summary}"
    );
    assert!(
        summary.to_string().contains(&format!("too slow to rebound at {slowest:.1e} or less")),
        "{summary}"
    );
    // Asked for, it is no news.
    let contact = Contact { restitution: e, rest_speed: Some(0.01) };
    let motion = ball.simulate(start).until(6.0).contact("floor", contact).run().unwrap();
    assert!(motion.end().active_set.all_hold() && !motion.verify().to_string().contains("too slow"));
}

#[test]
fn without_rest_speed_a_bouncing_ball_is_an_error_that_says_where_it_ends() {
    let ball = Ball { m: 1.0, g: 9.81 };
    let contact = Contact { restitution: 0.5, rest_speed: Some(0.0) };
    let start = released(at_rest_or_not([0.0, 1.0], [0.0, 0.0]), [0]);
    let error = ball.simulate(start).until(6.0).contact("floor", contact).run().unwrap_err();
    let first = (2.0 / ball.g).sqrt();
    match &error.kind {
        SimulationErrorKind::EventsAccumulate { event, at, squeezed: false } => {
            assert_eq!(event, "floor contact");
            assert!((at - 3.0 * first).abs() < 1e-4, "{at}");
        }
        other => panic!("{other:?}"),
    }
    let text = error.to_string();
    assert!(
        text.contains("give `.contact(\"floor\", ..)` a larger `rest_speed`") && !text.contains("Flow::Stop"),
        "{text}"
    );
    assert!(error.motion(&ball).unwrap().events().len() > 10);
}

/// A bead on a dome of radius R, and the ground below: Φ = (r² − R²)/2 ≥ 0, Φ = y ≥ 0.
struct Dome {
    r: f64,
    g: f64,
}

impl Held<2, 2, 2> for Dome {
    fn mass(&self, _: &PlainState<2, 0>) -> SMatrix<f64, 2, 2> {
        SMatrix::identity()
    }
    fn force(&self, _: &PlainState<2, 0>) -> SVector<f64, 2> {
        SVector::from([0.0, -self.g])
    }
    fn energy(&self, s: &PlainState<2, 0>) -> f64 {
        0.5 * s.u.norm_squared() + self.g * s.q[1]
    }
    fn phi(&self, s: &PlainState<2, 0>) -> SVector<f64, 2> {
        SVector::from([0.5 * (s.q.norm_squared() - self.r * self.r), s.q[1]])
    }
    fn phi_q(&self, s: &PlainState<2, 0>) -> SMatrix<f64, 2, 2> {
        SMatrix::<f64, 2, 2>::new(s.q[0], s.q[1], 0.0, 1.0)
    }
    fn right(&self, s: &PlainState<2, 0>) -> SVector<f64, 2> {
        SVector::from([-s.u.norm_squared(), 0.0])
    }
}
held!(Dome, 2 coordinates ["x", "y"], 2 + 0 = 2 rows ["dome", "ground"],
    [switched("dome", ConstraintKind::Holonomic, 0, 0), switched("ground", ConstraintKind::Holonomic, 1, 1)],
    friction false, events []);

/// From the top with speed v: it lifts off where g cos θ = (v² + 2 g R (1 − cos θ))/R, that is cos θ = 2/3 +
/// v²/(3 g R), flies, and stays on the ground.
#[test]
fn a_bead_lifts_off_its_dome_and_lands() {
    let dome = Dome { r: 2.0, g: 9.81 };
    let speed = 1.0;
    for formulation in [Formulation::Projected, Formulation::Embedded, Formulation::BaumgarteTied] {
        let start = released(at_rest_or_not([0.0, dome.r], [speed, 0.0]), [1]);
        let run = dome.simulate(start).until(3.0).tolerance(1e-11).formulation(formulation);
        let motion = run.contact("dome", 0.0).contact("ground", 0.0).run().unwrap();
        let names: Vec<&str> = motion.events().iter().map(|event| event.name.as_str()).collect();
        assert_eq!(names, ["dome contact", "ground contact"], "{formulation}");
        let off = motion.events()[0].before;
        let cos = 2.0 / 3.0 + speed * speed / (3.0 * dome.g * dome.r);
        assert!((off.q[1] / dome.r - cos).abs() < 1e-8, "{formulation}: {} {cos}", off.q[1] / dome.r);
        assert!(motion.events()[0].impacts.is_empty(), "lifting off is no impact");
        // The flight is a parabola.
        let down = &motion.events()[1];
        let fall = down.time() - motion.events()[0].time();
        assert!((off.q[1] + off.u[1] * fall - 0.5 * dome.g * fall * fall).abs() < 1e-8, "{formulation}");
        let end = motion.end();
        assert!(end.q[1].abs() < 1e-12 && (end.u[0] - off.u[0]).abs() < 1e-9 && !end.active_set.all_hold());
        assert!((motion.reaction_at("ground", 2.9).unwrap()[0] - dome.g).abs() < 1e-9);
        let lost = 0.5 * (off.u[1] - dome.g * fall).powi(2);
        assert!((down.energy_lost() - lost).abs() < 1e-7, "{} {lost}", down.energy_lost());
    }
}

/// A contact that would have to pull lets go at once, at the start as later.
#[test]
fn a_contact_never_pulls() {
    let dome = Dome { r: 2.0, g: 9.81 };
    // Faster than √(g R): it flies off the top.
    let start = released(at_rest_or_not([0.0, dome.r], [6.0, 0.0]), [1]);
    let motion = dome.simulate(start).until(0.5).contact("dome", 0.0).run().unwrap();
    assert_eq!((motion.events().len(), motion.events()[0].time()), (1, 0.0));
    let end = motion.end();
    assert!((end.q[0] - 3.0).abs() < 1e-9 && (end.q[1] - (2.0 - 0.125 * dome.g)).abs() < 1e-9, "{end:?}");
    assert!((0..50).all(|k| motion.reaction_at("dome", 0.01 * f64::from(k) + 0.001).unwrap()[0] >= 0.0));
}

/// A reset must leave a state on the constraints, also where these may drift: what drift there was before is
/// no excuse.
#[test]
fn a_reset_that_leaves_the_constraints_is_refused_in_every_formulation() {
    let dome = Dome { r: 2.0, g: 9.81 };
    let formulations =
        [Formulation::Projected, Formulation::Embedded, Formulation::Augmented, Formulation::BaumgarteTied];
    for formulation in formulations {
        let run = |action: fn(&mut EventAction<'_, Dome>)| {
            let start = released(at_rest_or_not([0.0, dome.r], [0.5, 0.0]), [1]);
            let run =
                dome.simulate(start).until(0.4).formulation(formulation).event("mark", |s| s.q[0] - 0.1);
            run.on_event_with("mark", Direction::Rising, action).run()
        };
        // Along the dome, as fast again.
        assert!(run(|change| change.state_mut().u *= 2.0).is_ok(), "{formulation}");
        let faster: fn(&mut EventAction<'_, Dome>) = |change| change.state_mut().u[1] += 1.6;
        let higher: fn(&mut EventAction<'_, Dome>) = |change| change.state_mut().q[1] += 0.1;
        for action in [faster, higher] {
            match run(action).unwrap_err().kind {
                SimulationErrorKind::EventAction { event, error } => {
                    assert!(
                        event == "mark" && matches!(*error, EventActionError::State(_)),
                        "{formulation}: {error}"
                    );
                }
                other => panic!("{formulation}: {other:?}"),
            }
        }
    }
}

#[test]
fn guards_that_cannot_be_are_refused() {
    let ball = Ball { m: 1.0, g: 9.81 };
    let start = released(at_rest_or_not([0.0, 1.0], [0.0, 0.0]), [0]);
    let refused = |run: dynamics_runtime::simulate::Simulation<'_, Ball>| match run
        .until(1.0)
        .run()
        .unwrap_err()
        .kind
    {
        SimulationErrorKind::Option(error) => error,
        other => panic!("{other:?}"),
    };
    let open = || ball.simulate(start);
    assert!(matches!(refused(open().contact("flor", 0.0)), OptionError::Constraint(_)));
    let springy = refused(open().contact("floor", 1.1));
    assert!(matches!(springy, OptionError::Contact { option: "restitution", .. }));
    assert!(springy.to_string().starts_with("`.contact(\"floor\", ..)` with restitution 1.1"), "{springy}");
    let rest = Contact { rest_speed: Some(-1.0), ..Contact::default() };
    assert!(matches!(
        refused(open().contact("floor", rest)),
        OptionError::Contact { option: "rest_speed", .. }
    ));
    // Which constraint is wrong comes before which event is.
    for sticky in [open().stick_slip("floor", "x"), open().event("x", |_| 1.0).stick_slip("floor", "x")] {
        let error = refused(sticky);
        assert!(matches!(
            error,
            OptionError::NotForUnilateral { option: "stick_slip", constraint: "floor", .. }
        ));
        let said = "`.stick_slip(..)` is not possible for `floor`, a constraint on positions \
            (`#[holonomic]`); `.contact(..)` is for those";
        assert!(error.to_string().starts_with(said), "{error}");
    }
    let back = open().contact("floor", 0.8).until(-2.0).run().unwrap_err().kind;
    let expected = OptionError::Backwards { option: "contact", constraint: "floor".into() };
    assert_eq!(back, SimulationErrorKind::Option(expected));
    let below = ball
        .simulate(released(at_rest_or_not([0.0, -0.5], [0.0, 0.0]), [0]))
        .until(1.0)
        .contact("floor", 0.0);
    let kind = below.run().unwrap_err().kind;
    assert_eq!(kind, SimulationErrorKind::Penetration { row: "floor", residual: -0.5 });
}

#[test]
fn stopping_in_a_change_stops() {
    let ball = Ball { m: 1.0, g: 9.81 };
    let start = released(at_rest_or_not([0.0, 1.0], [0.0, 0.0]), [0]);
    let run = ball.simulate(start).until(5.0).contact("floor", 0.5);
    let motion = run.on_event_with("floor contact", Direction::Falling, |_| Flow::Stop).run().unwrap();
    assert_eq!((motion.events().len(), motion.events()[0].stopped), (1, true));
    assert!(motion.end().u[1] > 0.0, "after the rebound");
}

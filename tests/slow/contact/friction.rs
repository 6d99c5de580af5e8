//! Friction by the side to which a constraint was released: it brakes, or the motion ends with an error. It
//! never drives.

use dynamics::prelude::*;
use dynamics::simulate::{Flow, SimulationErrorKind as Kind};

mod laws;
use crate::parcel;

use parcel::Parcel;

/// A block on an incline with a wall, which rubs by its reaction where it slips; it may be lifted and blown
/// at.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[inputs(lift: N, wind: N)]
#[units(mass: kg, g: m / s^2, wall: m)]
#[nominal(mass = 1.0, g = 9.81, mu = 0.4, slope = 0.1, wall = 1.0)]
struct Incline {
    mass: f64,
    g: f64,
    mu: f64,
    slope: f64,
    wall: f64,
}

#[dynamics]
impl Incline {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * (q.y * self.slope.cos() + q.x * self.slope.sin())
    }
    #[holonomic(switched)]
    fn floor(&self, q: &Coordinates<Self>) -> Expr {
        q.y
    }
    #[holonomic(switched)]
    fn stop(&self, q: &Coordinates<Self>) -> Expr {
        self.wall - q.x
    }
    #[nonholonomic(switched, integrable)]
    fn stick(&self, q: &Coordinates<Self>) -> Expr {
        q.x.dt()
    }
    #[force]
    fn pull(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.y, 1.0 * q.lift) + Force::along(q.x, 1.0 * q.wind)
    }
    #[force]
    fn rub(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, -self.mu * q.reaction(Self::floor) * q.slip(Self::stick))
    }
    #[event]
    fn limit(&self, q: &Coordinates<Self>) -> Expr {
        self.mu * q.reaction(Self::floor) - q.reaction(Self::stick).abs()
    }
}

/// Index of `stick` among the switched constraints.
const STICK: usize = 2;
const G: f64 = 9.81;
const FORMULATIONS: [Formulation; 4] =
    [Formulation::Projected, Formulation::Embedded, Formulation::BaumgarteTied, Formulation::Augmented];

fn incline(slope: f64) -> Incline {
    Incline { mass: 1.0, g: G, mu: 0.4, slope, wall: 100.0 }
}

/// A start without lift or wind, clear of the wall.
macro_rules! free {
    ($model:expr) => {
        $model.state().lift(0.0).wind(0.0).release("stop")
    };
}

/// What is released at rest slips to where it is pushed, up or down; the same where only the run knows the
/// inputs.
#[test]
fn what_is_released_at_rest_is_braked() {
    for slope in [0.6f64, -0.6] {
        let (model, braked) = (incline(slope), -G * (slope.sin() - 0.4 * slope.cos() * slope.signum()));
        for start in [free!(model).release("stick").build(), free!(model).release("stick").assemble()] {
            let start = start.unwrap();
            assert_eq!(start.active_set.side(STICK), -slope.signum());
            assert!((model.accelerations(&start).unwrap()[0] - braked).abs() < 1e-12);
            for formulation in FORMULATIONS {
                let run = model.simulate(start).until(1.0).tolerance(1e-9).formulation(formulation);
                let motion = run.contact("floor", 0.0).run().unwrap();
                assert!(
                    (motion.end().x() - 0.5 * braked).abs() < 1e-7,
                    "{formulation}: {}",
                    motion.end().x()
                );
            }
        }
        // What is given is taken, and found to be wrong by the run.
        let given = free!(model).release_to("stick", slope).build().unwrap();
        let error = model.simulate(given).until(1.0).run().unwrap_err();
        let Kind::SlipsBack { constraint: "stick", at, sticks, .. } = error.kind else { panic!("{error}") };
        assert!(
            error.time == 0.0 && at > 0.0 && !sticks && error.to_string().contains("release_to(\"stick\", "),
            "{error}"
        );
    }
    // The inputs of a law are not known at the start.
    let (model, inputs) = (incline(0.0), |_: f64, _: &InclineState| [0.0, -5.0]);
    let start = model.state().release("stop").release("stick").build().unwrap();
    let error = model.simulate(start).until(1.0).inputs(inputs).run().unwrap_err();
    assert!(matches!(error.kind, Kind::SlipsBack { side: 1.0, .. }), "{error}");
    let start = model.state().release("stop").release_to("stick", -1.0).build().unwrap();
    let motion = model.simulate(start).until(1.0).inputs(inputs).run().unwrap();
    assert!((motion.end().x() + 0.5 * (5.0 - 0.4 * G)).abs() < 1e-9);
}

/// On a flat floor, or one that is not steep enough, nothing slips: it would have to stick, and without a
/// rule that is an error at once.
#[test]
fn what_would_stick_is_no_motion_without_a_rule() {
    for slope in [0.0, 0.3] {
        let model = incline(slope);
        let start = free!(model).release("stick").build().unwrap();
        let error = model.simulate(start).until(1.0).run().unwrap_err();
        // The other side is no remedy.
        assert!(
            matches!(error.kind, Kind::SlipsBack { sticks: true, .. }) && error.time == 0.0,
            "{slope}: {error}"
        );
        assert!(!error.to_string().contains("release_to"), "{error}");
        let motion = model
            .simulate(start)
            .until(1.0)
            .contact("floor", 0.0)
            .stick_slip("stick", "limit")
            .run()
            .unwrap();
        assert!(motion.end().x().abs() < 1e-12 && motion.end().is_engaged("stick").unwrap());
    }
}

/// A block that stops stands, or the motion ends where it stops; with steps of every length.
#[test]
fn friction_ends_a_motion_that_it_would_drive_back() {
    let model = incline(0.0);
    let start = free!(model).x_rate(2.0).release("stick").build().unwrap();
    let (stops, at) = (2.0 / (0.4 * G), 2.0 / (0.4 * G));
    for formulation in FORMULATIONS {
        for method in [methods::Any::from(methods::DormandPrince5), methods::Dop853.into()] {
            let run =
                model.simulate(start).until(2.0).method(&method).tolerance(1e-9).formulation(formulation);
            let error = run.run().unwrap_err();
            let Kind::SlipsBack { constraint, side, slip, at: seen, sticks } = error.kind else {
                panic!("{error}")
            };
            // By then it has slipped so far back, with the friction that drives it.
            let driven = -0.4 * G * (seen - stops);
            assert!(sticks && (slip / driven - 1.0).abs() < 1e-5, "{slip} {driven}: {error}");
            assert!(constraint == "stick" && side == 1.0 && slip < 0.0);
            // What was computed up to there is right.
            assert!((error.time - stops).abs() < 1e-7, "{formulation}: {} {stops}", error.time);
            assert!((error.state.x() - at).abs() < 1e-7, "{formulation}: {}", error.state.x());
            assert!((error.motion(&model).unwrap().at(0.3).x() - (0.6 - 0.045 * 0.4 * G)).abs() < 1e-7);
            let text = error.to_string();
            // The other side would drive it likewise.
            assert!(text.contains("`.stick_slip(\"stick\", ..)`") && !text.contains("release_to"), "{text}");
        }
    }
    // An event that is declared beside it changes nothing, one that engages it is what was asked for.
    let watched = model.simulate(start).until(2.0).event("late", |s| s.t - 1.9).run().unwrap_err();
    assert!(matches!(watched.kind, Kind::SlipsBack { .. }) && (watched.time - stops).abs() < 1e-7);
    let run = model.simulate(start).until(2.0).event("stops", |s| s.x_rate());
    let motion = run.on_event_with("stops", Direction::Falling, |change| {
        change.engage("stick");
        Flow::Continue
    });
    assert!((motion.run().unwrap().end().x() - at).abs() < 1e-7);
    let ruled = model.simulate(start).until(2.0).stick_slip("stick", "limit").run().unwrap();
    assert!((ruled.end().x() - at).abs() < 1e-7);
}

/// A slip that turns round and back again within one step is seen.
#[test]
fn a_slip_that_turns_twice_within_a_step_is_seen() {
    // It is below zero from t = 1 to t = 3, between the ends of the step.
    let model = incline(0.0);
    let start = free!(model).x_rate(3.0).release("stick").build().unwrap();
    let run = model.simulate(start).until(4.0).method(methods::Dop853).fixed_step(4.0);
    let error = run.inputs(|t, _| [0.0, 0.4 * G + 2.0 * t - 4.0]).run().unwrap_err();
    assert!(matches!(error.kind, Kind::SlipsBack { .. }) && (error.time - 1.0).abs() < 1e-9, "{error}");
}

/// Friction turns with a velocity that jumps, with a rule and without; and is as it was at events that leave
/// it alone.
#[test]
fn friction_turns_where_the_velocity_jumps() {
    let model = Incline { wall: 1.0, ..incline(0.0) };
    let start = model
        .state()
        .lift(0.0)
        .wind(0.0)
        .x(0.1)
        .x_rate(4.0)
        .release("stick")
        .release("stop")
        .build()
        .unwrap();
    let braking = 0.4 * G;
    let hits = (16.0 - 2.0 * braking * 0.9f64).sqrt();
    let (at, rebound) = ((4.0 - hits) / braking, 0.5 * hits);
    let end = 0.5 - at;
    let expected = 1.0 - rebound * end + 0.5 * braking * end * end;
    for formulation in FORMULATIONS {
        let run =
            model.simulate(start).until(0.5).tolerance(1e-9).formulation(formulation).contact("stop", 0.5);
        let motion = run.contact("floor", 0.0).run().unwrap();
        assert!((motion.end().x() - expected).abs() < 1e-7, "{formulation}: {} {expected}", motion.end().x());
        let run = model.simulate(start).until(0.5).tolerance(1e-9).formulation(formulation);
        let run = run.contact("floor", 0.0).event("half", |s| s.x() - 1.0);
        let motion = run.on_event("half", Direction::Rising, |s| s.u[0] *= -0.5).run().unwrap();
        assert!((motion.end().x() - expected).abs() < 1e-7, "{formulation}: {} {expected}", motion.end().x());
    }
}

/// A block that turns in flight does not rub there: no error, and when it lands it is braked on the way back.
#[test]
fn a_side_that_does_not_count_is_no_error() {
    let model = incline(0.0);
    let start = model.state().lift(0.0).wind(-2.0).x(1.0).x_rate(1.0).y_rate(0.5 * G);
    let start = start.release("stop").release("floor").release("stick").build().unwrap();
    let motion = model.simulate(start).until(1.2).tolerance(1e-9).contact("floor", 0.0).run().unwrap();
    let (v, a, t) = (-1.0, 0.4 * G - 2.0, 0.2);
    assert!((motion.end().x() - (1.0 + v * t + 0.5 * a * t * t)).abs() < 1e-7, "{}", motion.end().x());
    assert!(motion.at(0.9).x_rate() < 0.0 && motion.at(0.9).active_set.side(STICK) == 1.0);
    assert_eq!(motion.end().active_set.side(STICK), -1.0);
    let frictionless = Incline { mu: 0.0, ..incline(0.3) };
    let start = free!(frictionless).x_rate(1.0).release("stick").build().unwrap();
    let motion = frictionless.simulate(start).until(2.0).run().unwrap();
    assert!((motion.end().x() - (2.0 - 2.0 * G * 0.3f64.sin())).abs() < 1e-9);
}

/// Where nothing presses, friction does nothing, and an event of one's own may release what sticks without a
/// word on the side.
#[test]
fn what_sticks_without_load_is_released_by_an_event() {
    let model = incline(0.0);
    let start = model.state().release("stop").build().unwrap();
    let lift = |t: f64, _: &InclineState| [5.0 * t, 0.0];
    let run = model.simulate(start).until(3.0).inputs(lift).contact("floor", 0.0);
    let motion =
        run.on_event_with("limit", Direction::Falling, |change| change.release("stick")).run().unwrap();
    let flown = 3.0 - G / 5.0;
    assert!((motion.end().y() - 5.0 * flown.powi(3) / 6.0).abs() < 1e-8, "{}", motion.end().y());
}

/// A block held by friction of a given size, and one that runs into it and latches.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(runner: m, block: m)]
#[units(runs: kg, rests: kg, most: N)]
struct Latched {
    runs: f64,
    rests: f64,
    most: f64,
}

#[dynamics]
impl Latched {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.runs * q.runner.dt().powi(2) + 0.5 * self.rests * q.block.dt().powi(2)
    }
    #[holonomic(switched)]
    fn latch(&self, q: &Coordinates<Self>) -> Expr {
        q.block - q.runner
    }
    #[nonholonomic(switched, integrable)]
    fn stick(&self, q: &Coordinates<Self>) -> Expr {
        q.block.dt()
    }
    #[force]
    fn rub(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.block, -self.most * q.slip(Self::stick))
    }
    #[event]
    fn limit(&self, q: &Coordinates<Self>) -> Expr {
        self.most - q.reaction(Self::stick).abs()
    }
    #[event]
    fn gap(&self, q: &Coordinates<Self>) -> Expr {
        q.block - q.runner
    }
}

/// What sticks takes any impulse, and the summary says so; released in the action, both slide on together
/// at 1.2 m/s, for half a metre.
#[test]
fn what_sticks_in_an_impact_is_named() {
    let model = Latched { runs: 2.0, rests: 3.0, most: 7.2 };
    let start = model.state().block(0.3).runner_rate(3.0).release("latch").build().unwrap();
    let run = || model.simulate(start).until(2.0).tolerance(1e-9).stick_slip("stick", "limit");
    let stuck =
        run().on_event_with("gap", Direction::Falling, |change| change.engage("latch")).run().unwrap();
    let (name, time) = stuck.summary().stuck_in_impact.unwrap();
    assert!(name == "stick" && (time - 0.1).abs() < 1e-9 && stuck.end().block() == 0.3);
    assert!(
        stuck.verify().to_string().contains("`stick` stuck in an impact at t = 0.1"),
        "{}",
        stuck.verify()
    );
    let slid = run().on_event_with("gap", Direction::Falling, |change| {
        change.release_to("stick", 1.0);
        change.engage("latch");
    });
    let slid = slid.run().unwrap();
    assert!(slid.summary().stuck_in_impact.is_none());
    assert!(
        (slid.end().block() - (0.3 + 1.2 * 1.2 / (2.0 * 7.2 / 5.0))).abs() < 1e-7,
        "{}",
        slid.end().block()
    );
}

/// A block that sticks without side load is lifted off: at that instant neither side rubs.
#[test]
fn what_sticks_without_load_is_lifted_off() {
    let model = incline(0.0);
    let start = free!(model).build().unwrap();
    let lifts = G / 5.0;
    let expected = 5.0 / 6.0 * (64.0 - lifts.powi(3))
        - 2.5 * lifts * lifts * (4.0 - lifts)
        - 0.5 * G * (4.0 - lifts).powi(2);
    for formulation in FORMULATIONS {
        let run = || model.simulate(start).until(4.0).tolerance(1e-9).formulation(formulation);
        let run = || run().inputs(|t, _| [5.0 * t, 0.0]);
        let orders = [
            run().contact("floor", 0.0).stick_slip("stick", "limit"),
            run().stick_slip("stick", "limit").contact("floor", 0.0),
        ];
        for (k, run) in orders.into_iter().enumerate() {
            let motion = run.run().unwrap_or_else(|error| panic!("{formulation} {k}: {error}"));
            let end = motion.end();
            assert!((end.y() - expected).abs() < 1e-6, "{formulation} {k}: {} {expected}", end.y());
            assert!(end.x() == 0.0 && !end.is_engaged("floor").unwrap());
            let lift = motion.events().iter().find(|event| event.name == "floor contact").unwrap();
            assert!((lift.time() - lifts).abs() < 1e-8, "{formulation} {k}: {}", lift.time());
        }
    }
}

/// Where the slip jumps through zero nothing is caught: friction has no impulse, and slips to the other side
/// from there.
#[test]
fn a_slip_that_jumps_through_zero_turns_its_side() {
    let end = |limit: f64, then: f64, (at, seam): (f64, f64)| {
        let a: f64 = limit;
        // From rest on the first belt until the instant, or the place; then toward the speed of the second,
        // and with it.
        let change = at.min((2.0 * seam / a).sqrt());
        let (x, u) = (0.5 * a * change * change, a * change);
        let slipping = (then - u).abs() / a;
        let side = (then - u).signum();
        let left = 5.0 - change;
        let during = slipping.min(left);
        let (x, v) = (x + u * during + 0.5 * side * a * during * during, u + side * a * during);
        x + v * (left - during)
    };
    for (then, place) in [
        (-1.0, (1.0, f64::MAX)),
        (0.2, (1.0, f64::MAX)),
        (-1.0, (1.2345, f64::MAX)),
        (0.3, (f64::MAX, 0.4)),
        (0.1, (f64::MAX, 0.3)),
        (3.0, (f64::MAX, 0.4)),
    ] {
        let parcel = Parcel { mass: 1.0, limit: 0.4, first: 1.0, then, at: place.0, seam: place.1 };
        let truth = end(0.4, then, place);
        let start = parcel.state().release("stick").build().unwrap();
        for formulation in FORMULATIONS {
            for tolerance in [1e-4, 1e-7, 1e-10] {
                let run = parcel.simulate(start).until(5.0).tolerance(tolerance).formulation(formulation);
                let motion = run.stick_slip("stick", "grip").run().unwrap();
                let error = (motion.end().x() - truth).abs();
                assert!(
                    error < 30.0 * tolerance,
                    "{then} {place:?} {formulation} {tolerance:e}: {} instead of {truth}",
                    motion.end().x()
                );
                let jumps = motion.events().iter().map(|e| (e.after.x_rate() - e.before.x_rate()).abs());
                assert!(jumps.fold(0.0, f64::max) < 1e-3, "{then} {place:?} {formulation} {tolerance:e}");
            }
        }
    }
}

/// A block that sticks is shoved: the force jumps past the limit in an instant that belongs to what was
/// before, or to what comes.
#[test]
fn what_sticks_breaks_away_where_a_force_jumps_past_the_limit() {
    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: m)]
    #[units(mass: kg, limit: N, before: N, push: N, at: s, later: s)]
    struct Shoved {
        mass: f64,
        limit: f64,
        before: f64,
        push: f64,
        at: f64,
        later: f64,
    }
    #[dynamics]
    impl Shoved {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.mass * q.x.dt().powi(2)
        }
        #[nonholonomic(switched, integrable)]
        fn stick(&self, q: &Coordinates<Self>) -> Expr {
            q.x.dt()
        }
        #[force]
        fn rub(&self, q: &Coordinates<Self>) -> Force {
            Force::along(q.x, -self.limit * q.slip(Self::stick))
        }
        #[force]
        fn shove(&self, q: &Coordinates<Self>) -> Force {
            let first = if q.t > self.at { self.push } else { self.before };
            let second = if q.t < self.later { Expr::from(first) } else { Expr::ZERO };
            Force::along(q.x, second)
        }
        #[event]
        fn grip(&self, q: &Coordinates<Self>) -> Expr {
            self.limit - q.reaction(Self::stick).abs()
        }
    }
    for (at, during) in [(1.0, 0.5), (0.7, 0.01), (1.2345, 1.0), (2.0, 0.1), (0.3, 2.0)] {
        for (before, push) in [(0.0, 10.0), (0.0, -10.0), (0.5, -10.0), (-5.0, 8.0), (3.0, 7.0)] {
            let block = Shoved { mass: 2.0, limit: 6.0, before, push, at, later: at + during };
            let start = block.state().build().unwrap();
            // It speeds up while it is pushed and comes to rest: v t/2 in both.
            let speed = (f64::abs(push) - 6.0) / 2.0 * during;
            let truth = push.signum() * 0.5 * speed * (during + speed / 3.0);
            for formulation in FORMULATIONS {
                let run = block.simulate(start).until(8.0).tolerance(1e-9).formulation(formulation);
                let motion = run.stick_slip("stick", "grip").run();
                let motion =
                    motion.unwrap_or_else(|e| panic!("{at} {during} {before} {push} {formulation}: {e}"));
                let error = (motion.end().x() - truth).abs();
                assert!(
                    error < 3e-8,
                    "{at} {during} {before} {push} {formulation}: {}, not {truth}",
                    motion.end().x()
                );
            }
        }
    }
}

/// A block on a floor with a pendulum that hangs on it.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, a: m, b: m)]
#[units(block: kg, bob: kg, length: m, g: m / s^2)]
#[nominal(length = 1.0)]
struct Rig {
    block: f64,
    bob: f64,
    length: f64,
    g: f64,
    mu: f64,
}

#[dynamics]
impl Rig {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let (block, bob) = (vec2(q.x, q.y), vec2(q.a, q.b));
        0.5 * self.block * block.dt().norm_squared() + 0.5 * self.bob * bob.dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.g * (self.block * q.y + self.bob * q.b)
    }
    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        vec2(q.a - q.x, q.b - q.y).norm() - self.length
    }
    #[holonomic(switched)]
    fn floor(&self, q: &Coordinates<Self>) -> Expr {
        q.y
    }
    #[nonholonomic(switched, integrable)]
    fn stick(&self, q: &Coordinates<Self>) -> Expr {
        q.x.dt()
    }
    #[force]
    fn rub(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, -self.mu * q.reaction(Self::floor) * q.slip(Self::stick))
    }
    #[event]
    fn limit(&self, q: &Coordinates<Self>) -> Expr {
        self.mu * q.reaction(Self::floor) - q.reaction(Self::stick).abs()
    }
}

/// What comes to stick is no impact: a contact that bears it does not part by what rounding leaves of its
/// velocity.
#[test]
fn a_contact_goes_on_bearing_what_comes_to_stick() {
    for mu in [0.25, 0.02] {
        let rig = Rig { block: 2.0, bob: 1.0, length: 1.0, g: 10.0, mu };
        for angle in [core::f64::consts::FRAC_PI_2, 0.5] {
            let start = rig.state().x(0.0).y(0.0).a(angle.sin()).b_guess(-angle.cos()).assemble().unwrap();
            for (formulation, tolerance) in FORMULATIONS.into_iter().flat_map(|f| [(f, 1e-6), (f, 1e-9)]) {
                let run = || {
                    let run = rig.simulate(start).until(6.0).tolerance(tolerance).formulation(formulation);
                    run.stick_slip("stick", "limit")
                };
                let alone = run().run().unwrap().end();
                for contact in [0.0.into(), Contact { restitution: 0.3, rest_speed: Some(0.1) }] {
                    let case = format!("{mu} {angle} {formulation} {tolerance:e} {contact:?}");
                    let borne = run()
                        .contact("floor", contact)
                        .run()
                        .unwrap_or_else(|error| panic!("{case}: {error}"));
                    let error = (borne.end().x() - alone.x()).abs().max((borne.end().a() - alone.a()).abs());
                    assert!(error < 1e3 * tolerance, "{case}: {error:e}");
                    assert!(!borne.events().iter().any(|event| event.name == "floor contact"), "{case}");
                }
            }
        }
    }
}

mod feet;

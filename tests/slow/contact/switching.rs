//! Switched constraints of generated models: with inputs from a law, on the side that the velocity says, hit
//! and left by actions.

use dynamics::error::StateError;
use dynamics::prelude::*;

/// A pendulum that is pushed, with a stop to its left.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y)]
#[inputs(push)]
struct Pushed {
    m: f64,
    l: f64,
    g: f64,
}

#[dynamics]
impl Pushed {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2))
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * q.y
    }
    #[force]
    fn pushing(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, 1.0 * q.push)
    }
    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        (q.x.powi(2) + q.y.powi(2)).sqrt() - self.l
    }
    #[holonomic(switched)]
    fn stop(&self, q: &Coordinates<Self>) -> Expr {
        1.1 + q.x
    }
}

/// A start is put onto the constraints whether the inputs are known there or come from the law, and whether a
/// value was set or not.
#[test]
fn a_law_supplies_the_inputs_where_a_constraint_is_released() {
    let model = Pushed { m: 1.0, l: 1.3, g: 9.81 };
    let (sin, cos) = 0.71f64.sin_cos();
    let state = || model.state().x(1.3 * sin + 1e-9).y(-1.3 * cos).release("stop");
    let run = |start: PushedState| {
        let run = model.simulate(start).contact("stop", 0.5).inputs(|t, _| [t.sin()]).until(1.0);
        *run.run().unwrap().end().q()
    };
    let (unset, set) = (run(state().build().unwrap()), run(state().push(0.0).build().unwrap()));
    assert_eq!(unset, set);
    assert!((unset.norm() - 1.3).abs() < 1e-12);
    // The projection itself asks for no forces.
    let mut start = state().build().unwrap();
    let moved = dynamics::constrain::with_workspace::<Pushed, _>(|workspace| {
        dynamics::constrain::project_positions(&model, &model.constants().unwrap(), &mut start, workspace)
    });
    assert!(moved.unwrap().general == 0 && (start.q().norm() - 1.3).abs() < 1e-15);
}

/// Output between steps is put onto the constraints, with a law as without.
#[test]
fn consistent_output_with_a_law_is_on_the_constraints() {
    let model = Pushed { m: 1.0, l: 1.3, g: 9.81 };
    let start = model.state().y(-1.3).x_rate(0.4).release("stop").build().unwrap();
    let run = model.simulate(start).consistent_output().inputs(|t, _| [t.sin()]).until(1.0);
    let motion = run.run().unwrap();
    for k in 1..20 {
        let state = motion.at(0.049 * f64::from(k) + 0.0123);
        assert!((state.q().norm() - 1.3).abs() < 1e-14 && state.push() == state.t.sin(), "{state:?}");
    }
}

/// A block that rubs where it slips.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
struct Block {
    m: f64,
    rubbing: f64,
}

#[dynamics]
impl Block {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }
    #[force]
    fn friction(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, -self.rubbing * q.slip(Self::stick))
    }
    #[nonholonomic(switched, integrable)]
    fn stick(&self, q: &Coordinates<Self>) -> Expr {
        q.x.dt()
    }
}

/// Friction never drives: a start is released to the side to which it slips, and a side that contradicts the
/// velocity is refused.
#[test]
fn what_slips_is_released_to_the_side_of_its_velocity() {
    let model = Block { m: 2.0, rubbing: 3.0 };
    for rate in [-1.0, 1.0] {
        let given = model.state().x_rate(rate).release("stick");
        for start in [given.build().unwrap(), given.assemble().unwrap()] {
            assert_eq!(start.active_set.side(0), rate);
            assert!((model.accelerations(&start).unwrap()[0] + 1.5 * rate).abs() < 1e-14);
        }
        let given = given.release_to("stick", -rate);
        for error in [given.build().unwrap_err(), given.assemble().unwrap_err()] {
            assert_eq!(error, StateError::WrongSide { row: "stick", slip: rate });
            assert!(error.to_string().contains(&format!("`.release_to(name, {rate})`")), "{error}");
        }
        assert_eq!(given.release_to("stick", rate).build().unwrap().active_set.side(0), rate);
        // By hand, and found where the motion starts.
        let mut start = model.state().x_rate(rate).release("stick").build().unwrap();
        start.release_to("stick", -rate).unwrap();
        let error = model.simulate(start).until(0.1).run().unwrap_err();
        assert!(error.to_string().contains("is released to the side"), "{error}");
    }
    // At rest the side is what was asked for.
    assert_eq!(model.state().release("stick").build().unwrap().active_set.side(0), 1.0);
    assert_eq!(model.state().release_to("stick", -1.0).build().unwrap().active_set.side(0), -1.0);
}

/// A point between two pairs of stops: more switched constraints than every set of which has code of its own.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, z: m, w: m)]
#[units(m: kg)]
struct Gripped {
    m: f64,
}

#[dynamics]
impl Gripped {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2) + q.z.dt().powi(2) + q.w.dt().powi(2))
    }
    #[holonomic(switched)]
    fn first(&self, q: &Coordinates<Self>) -> Expr {
        q.x + q.y
    }
    #[holonomic(switched)]
    fn second(&self, q: &Coordinates<Self>) -> Expr {
        q.y
    }
    #[holonomic(switched)]
    fn third(&self, q: &Coordinates<Self>) -> Expr {
        q.z
    }
    #[holonomic(switched)]
    fn fourth(&self, q: &Coordinates<Self>) -> Expr {
        q.w + q.z
    }
}

/// What is released and has no code of its own is computed by the general solver because that is the way, not
/// because something failed.
#[test]
fn the_summary_says_why_the_general_solver_was_used() {
    let model = Gripped { m: 1.0 };
    let run = |start: GrippedState| model.simulate(start).until(0.1).run().unwrap().verify();
    let summary = run(model.state().x_rate(1.0).release("first").build().unwrap());
    assert_eq!(
        (&summary.released[..], summary.stabilization.released),
        (&["first"][..], summary.stabilization.general)
    );
    let text = summary.to_string();
    assert!(text.contains(" evaluations by the general solver (first released)"), "{text}");
    assert!(!text.contains("fell back") && !text.contains("vanished"), "{text}");
    // All on or all off, and every set of fewer switched constraints, have generated code.
    let all = ["first", "second", "third", "fourth"]
        .iter()
        .fold(model.state().x_rate(1.0), |s, name| s.release(name));
    let pushed = Pushed { m: 1.0, l: 1.3, g: 9.81 };
    let state = |x: f64| pushed.state().x(x).y(-(1.69 - x * x).max(0.0).sqrt()).push(0.0);
    let run_pushed = |start: PushedState| pushed.simulate(start).until(0.1).run().unwrap().verify();
    for summary in [
        run(model.state().build().unwrap()),
        run(all.build().unwrap()),
        run_pushed(state(1.3).release("stop").build().unwrap()),
        run_pushed(state(-1.1).build().unwrap()),
    ] {
        assert_eq!((summary.stabilization.released, summary.stabilization.general), (0, 0));
        assert!(!summary.to_string().contains("general solver"), "{summary}");
    }
}

/// A block with two corners over a floor, tumbling where it bounces.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y, a)]
struct Tumbling {
    m: f64,
    j: f64,
    w: f64,
    h: f64,
    g: f64,
}

#[dynamics]
impl Tumbling {
    fn corner(&self, q: &Coordinates<Self>, side: f64) -> Vec2 {
        vec2(q.x, q.y) + side * self.w * vec2(q.a.cos(), q.a.sin()) - self.h * vec2(-q.a.sin(), q.a.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2)) + 0.5 * self.j * q.a.dt().powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * q.y
    }
    #[holonomic(switched)]
    fn left(&self, q: &Coordinates<Self>) -> Expr {
        self.corner(q, -1.0).y
    }
    #[holonomic(switched)]
    fn right(&self, q: &Coordinates<Self>) -> Expr {
        self.corner(q, 1.0).y
    }
}

/// In flight one step lasts as long as the flight, while the corners turn by radians: no corner passes
/// through the floor between samples.
#[test]
fn a_tumbling_block_never_sinks_into_the_floor() {
    let block = Tumbling { m: 1.0, j: 0.1, w: 0.5, h: 0.2, g: 9.81 };
    for (e, tilt) in [(1.0, 0.2), (0.9, 0.3), (1.0, 0.35), (0.95, -0.1)] {
        let start = block.state().y(1.0).a(tilt).release("left").release("right").build().unwrap();
        let motion = block.simulate(start).until(6.0).contact("left", e).contact("right", e).run().unwrap();
        let lowest = (0..6_000).map(|k| {
            let q = motion.coordinates_at(1e-3 * f64::from(k));
            block.corner(&q, 1.0).y.value().min(block.corner(&q, -1.0).y.value())
        });
        assert!(lowest.fold(f64::MAX, f64::min) > -1e-9, "e = {e}, tilt {tilt}");
        let lost = motion.summary().energy_lost;
        assert!(
            (motion.energy_at(6.0) + lost - 9.81).abs() < 1e-8 && (e < 1.0 || lost.abs() < 1e-8),
            "{lost}"
        );
    }
}

mod shaken;

/// A ball in a bowl, and an event on the very function that the bowl holds at zero; one on its rate, and one
/// that the ball does cross.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(mass: kg, g: m / s^2, r: m)]
struct Bowl {
    mass: f64,
    g: f64,
    r: f64,
}

#[dynamics]
impl Bowl {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * q.y
    }
    #[holonomic(switched)]
    fn bowl(&self, q: &Coordinates<Self>) -> Expr {
        self.r - vec2(q.x, q.y).norm()
    }
    #[event]
    fn touches(&self, q: &Coordinates<Self>) -> Expr {
        3.0 * (self.r.powi(2) - vec2(q.x, q.y).norm_squared())
    }
    #[event]
    fn sinks(&self, q: &Coordinates<Self>) -> Expr {
        vec2(q.x, q.y).norm().dt()
    }
    #[event]
    fn bottom(&self, q: &Coordinates<Self>) -> Expr {
        q.x
    }
}

const BOWL: Bowl = Bowl { mass: 1.0, g: 9.81, r: 1.0 };

const FORMULATIONS: [Formulation; 5] = [
    Formulation::Projected,
    Formulation::Embedded,
    Formulation::BaumgarteTied,
    Formulation::Augmented,
    Formulation::Baumgarte { alpha: 5.0, beta: 5.0 },
];

/// What a constraint holds at zero has the sign of rounding, or of drift: no event, no action, and a word in
/// the summary.
#[test]
fn what_a_constraint_holds_at_zero_does_not_happen() {
    let start = BOWL.state().x(0.6).y(-0.8).build().unwrap();
    for formulation in FORMULATIONS {
        for tolerance in [1e-6, 1e-10] {
            let run = BOWL.simulate(start).until(10.0).tolerance(tolerance).formulation(formulation);
            let run = run.on_event("touches", Direction::Any, |state| state.u[0] = 0.0);
            let motion =
                run.event("rate", |s| 2.0 * (s.x() * s.x_rate() + s.y() * s.y_rate())).run().unwrap();
            let summary = motion.verify();
            // ω² = g/r: the period at 36.87° is longer by 2.6 %.
            let [(name, count)] = &summary.events[..] else {
                panic!("{formulation} {tolerance:e}: {summary}")
            };
            assert!(name == "bottom" && (9..=10).contains(count), "{summary}");
            for event in &summary.masked_events {
                assert!(["touches", "sinks", "rate"].contains(&event.as_str()), "{event}");
            }
            let warned = summary.to_string().matches("is what a constraint holds at zero").count();
            assert!(
                warned == summary.masked_events.len() && warned > 0,
                "{formulation} {tolerance:e}: {summary}"
            );
        }
    }
}

/// Where the constraint is released the same function says when it is back.
#[test]
fn the_same_function_happens_where_nothing_holds_it() {
    let falling = BOWL.state().x(0.5).y(0.0).release("bowl").build().unwrap();
    let run = BOWL.simulate(falling).until(2.0).tolerance(1e-9).contact("bowl", 0.0);
    let motion = run.run().unwrap();
    let lands = (2.0 * 0.75f64.sqrt() / 9.81).sqrt();
    let times: Vec<f64> = motion.events().iter().filter(|e| e.name == "touches").map(|e| e.time()).collect();
    assert!(times.len() == 1 && (times[0] - lands).abs() < 1e-9, "{times:?} {lands}");
}

/// A sleeve on a rod that turns, and a latch on it.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(mass: kg, speed: rad / s, place: m, bell: s)]
#[nominal(speed = 2.0)]
struct Sleeve {
    mass: f64,
    speed: f64,
    place: f64,
    bell: f64,
}

#[dynamics]
impl Sleeve {
    fn along(&self, q: &Coordinates<Self>) -> Expr {
        q.x * (self.speed * q.t).cos() + q.y * (self.speed * q.t).sin()
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared()
    }
    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        q.y * (self.speed * q.t).cos() - q.x * (self.speed * q.t).sin()
    }
    #[holonomic(switched)]
    fn latch(&self, q: &Coordinates<Self>) -> Expr {
        self.along(q) - self.place
    }
    #[event]
    fn at_the_place(&self, q: &Coordinates<Self>) -> Expr {
        self.along(q) - self.place
    }
    #[event]
    fn bell(&self, q: &Coordinates<Self>) -> Expr {
        q.t - self.bell
    }
}

/// What the latch holds at zero does not happen again by rounding, and does not when it is let go.
#[test]
fn a_latch_on_what_turns_catches_once() {
    for speed in [1.0, 2.0, 3.7] {
        let sleeve = Sleeve { mass: 1.0, speed, place: 0.5, bell: 1.5 };
        let start = sleeve.state().x(0.2).x_rate(0.3).y_rate(0.2 * speed).release("latch").build().unwrap();
        for tolerance in [1e-6, 1e-9, 1e-10, 1e-12] {
            for formulation in [
                Formulation::Projected,
                Formulation::Embedded,
                Formulation::Augmented,
                Formulation::BaumgarteTied,
                Formulation::Baumgarte { alpha: 5.0, beta: 5.0 },
            ] {
                let case = format!("{speed} {formulation} {tolerance:e}");
                let run = || {
                    let run = sleeve.simulate(start).until(3.0).tolerance(tolerance).formulation(formulation);
                    run.on_event_with("at_the_place", Direction::Rising, |change| change.engage("latch"))
                };
                let far = |state: State<Sleeve>| state.x().hypot(state.y());
                let caught = run().run().unwrap_or_else(|error| panic!("{case}: {error}"));
                assert!((far(caught.end()) - 0.5).abs() < 30.0 * tolerance, "{case}: {}", far(caught.end()));
                let catches = caught.events().iter().filter(|event| event.name == "at_the_place").count();
                assert_eq!(catches, 1, "{case}");

                let bell =
                    run().on_event_with("bell", Direction::Rising, |change| change.release("latch")).run();
                let bell = bell.unwrap_or_else(|error| panic!("{case}, let go: {error}"));
                let truth = 0.5 * (1.5 * speed).cosh();
                assert!(
                    (far(bell.end()) / truth - 1.0).abs() < 300.0 * tolerance,
                    "{case}: {}, not {truth}",
                    far(bell.end())
                );
            }
        }
    }
}

/// A constraint that pushes only cannot be hit from behind.
#[test]
fn an_impact_from_behind_is_refused() {
    let sleeve = Sleeve { mass: 1.0, speed: 2.0, place: 0.5, bell: 9.0 };
    let start = sleeve.state().x(0.2).x_rate(0.3).y_rate(0.4).release("latch").build().unwrap();
    let run = sleeve.simulate(start).until(3.0);
    let run = run.on_event_with("at_the_place", Direction::Rising, |change| change.impact("latch", 0.5));
    let error = run.run().unwrap_err();
    let message = error.to_string();
    assert!(message.contains("at event `at_the_place`: `latch` is to be hit while it grows"), "{message}");
    assert!((error.state.x().hypot(error.state.y()) - 0.5).abs() < 1e-5, "{message}");
}

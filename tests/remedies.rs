//! Runs that cannot be as they were asked for say what to do instead, and that works.

#![allow(missing_docs, reason = "test models")]

use dynamics::motion::SimulationErrorKind;
use dynamics::prelude::*;

/// A pendulum in a vertical plane, with a wall at its middle.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(m: kg, l: m, g: m / s^2)]
#[nominal(l = 1.0)]
struct Pendulum {
    m: f64,
    l: f64,
    g: f64,
}

#[dynamics]
impl Pendulum {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * vec2(q.x, q.y).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * q.y
    }
    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        vec2(q.x, q.y).norm() - self.l
    }
    #[holonomic(switched)]
    fn wall(&self, q: &Coordinates<Self>) -> Expr {
        q.x
    }
}

const PENDULUM: Pendulum = Pendulum { m: 1.0, l: 1.0, g: 9.81 };

fn start() -> State<Pendulum> {
    PENDULUM.state().x(0.6).y(-0.8).release("wall").build().unwrap()
}

#[track_caller]
fn says<T>(result: Result<T, impl core::fmt::Display>, text: &str) {
    let error = result.err().expect("an error").to_string();
    assert!(error.contains(text), "{error}");
}

#[test]
fn a_switched_constraint_that_does_not_hold_may_be_released() {
    let open = || PENDULUM.state().x(0.6).y(-0.8);
    says(open().build(), "or begin with it released, `.release(\"wall\")`");
    assert!(open().release("wall").build().is_ok());
    // One that always holds cannot.
    let error = PENDULUM.state().x(0.7).y(-0.8).release("wall").build().unwrap_err().to_string();
    assert!(error.contains("constraint `rod` does not hold") && !error.contains("release"), "{error}");
    says(PENDULUM.state().x(0.0).y(-1.0).x_rate(1.0).build(), "`.release(\"wall\")`");
}

#[test]
fn a_contact_has_one_law() {
    let run = PENDULUM.simulate(start()).until(1.0);
    says(
        run.contact("wall", 0.2).contact("wall", 0.5).run(),
        "`.contact(\"wall\", ..)` is given twice; drop one of them",
    );
}

#[test]
fn what_has_no_mass_is_named_with_the_parameter() {
    let model = Pendulum { m: 0.0, ..PENDULUM };
    let error = model.simulate(start()).until(1.0).run().unwrap_err();
    let SimulationErrorKind::NoInertia { coordinates, parameters, .. } = &error.kind else { panic!("{error}") };
    assert!(coordinates.names().eq(["x", "y"]) && parameters.names().eq(["m"]), "{error}");
    says(
        Err::<(), _>(error),
        "`x`, `y` have no inertia at this state; give what moves with them a positive mass (parameter `m` is 0)",
    );
}

/// Steps of a nanosecond, as drift is to be back within one.
#[test]
fn gains_that_bound_the_steps_are_named() {
    let large = Formulation::Baumgarte { alpha: 1e9, beta: 1e9 };
    let run =
        |formulation, limit| PENDULUM.simulate(start()).until(2.0).formulation(formulation).max_steps(limit).run();
    says(run(large, 2000), "gains of 1e9 take drift back within 1e-9, which may keep steps short: lower the gains");
    // Gains that bound nothing are no cause.
    let slack = Formulation::Baumgarte { alpha: 1.0, beta: 1.0 };
    let error = PENDULUM.simulate(start()).until(1e3).formulation(slack).max_steps(2000).run().unwrap_err();
    says(Err::<(), _>(error), "more than 2000 steps; raise `.max_steps(..)` or loosen the tolerance");
    assert!(run(Formulation::Baumgarte { alpha: 20.0, beta: 20.0 }, 2000).is_ok());
    assert!(run(Formulation::Projected, 2000).is_ok());
}

/// There is no tolerance to make smaller.
#[test]
fn fixed_steps_that_end_off_the_constraints_are_to_be_shortened() {
    let run = PENDULUM.simulate(start()).until(1.0).method(methods::Rattle).fixed_step(0.01).run().unwrap();
    let text = run.summary().to_string();
    assert!(text.contains("of what a tolerance of 1e-9 permits at most; shorten the fixed step"), "{text}");
    assert!(!text.contains("smaller tolerance"), "{text}");
}

#[test]
fn motions_without_impacts_lose_no_negative_nothing() {
    let motion = PENDULUM.simulate(start()).until(1.0).run().unwrap();
    let lost = motion.summary().energy_lost;
    assert!(lost == 0.0 && lost.is_sign_positive());
}

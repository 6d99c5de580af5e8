//! Runs that cannot be as they were asked for say what to do instead, and that works.

#![allow(missing_docs, reason = "test models")]

use dynamics::prelude::*;
use dynamics::simulate::SimulationErrorKind;

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
    #[event]
    fn peg(&self, q: &Coordinates<Self>) -> Expr {
        q.x - 0.5 * self.l
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
    let SimulationErrorKind::NoInertia { coordinates, parameters, .. } = &error.kind else {
        panic!("{error}")
    };
    assert!(coordinates.names().eq(["x", "y"]) && parameters.names().eq(["m"]), "{error}");
    says(
        Err::<(), _>(error),
        "`x`, `y` have no inertia at this state; give what moves with them a positive mass (parameter \
         `m` is 0)",
    );
}

/// What makes a start consistent is not at hand in an action.
#[test]
fn actions_change_what_a_constraint_ties_together() {
    let struck = |action: fn(&mut State<Pendulum>)| {
        PENDULUM.simulate(start()).until(1.0).on_event("peg", Direction::Falling, action).run()
    };
    says(
        struck(|state| state.u[0] *= -0.5),
        "change those that it ties together alike, as `state.u *= -0.5` does",
    );
    says(struck(|state| state.q[0] += 0.1), "the action moved coordinates off constraint `rod`");
    assert!(!struck(|state| state.u *= -1.0).unwrap().events().is_empty());
}

/// Steps of a nanosecond, as drift is to be back within one.
#[test]
fn gains_that_bound_the_steps_are_named() {
    let large = Formulation::Baumgarte { alpha: 1e9, beta: 1e9 };
    let run = |formulation, limit| {
        PENDULUM.simulate(start()).until(2.0).formulation(formulation).max_steps(limit).run()
    };
    says(
        run(large, 2000),
        "gains of 1e9 take drift back within 1e-9, which may keep steps short: lower the gains",
    );
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
    let text = run.verify().to_string();
    assert!(text.contains("of what a tolerance of 1e-9 permits at most; shorten the fixed step"), "{text}");
    assert!(!text.contains("smaller tolerance"), "{text}");
}

#[test]
fn motions_without_impacts_lose_no_negative_nothing() {
    let motion = PENDULUM.simulate(start()).until(1.0).run().unwrap();
    let lost = motion.summary().energy_lost;
    assert!(lost == 0.0 && lost.is_sign_positive());
}

/// A board on two skates that are steered against each other, and a rotor that the rider turns; Bloch,
/// Nonholonomic Mechanics and Control, 2nd ed. 2015, 1.11. Where both stand at right angles to the board they
/// are parallel and hold the same velocity.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, theta: rad, psi: rad, phi: rad)]
#[units(m: kg, l: m, j: kg * m^2, rotor: kg * m^2, wheels: kg * m^2)]
struct Snakeboard {
    m: f64,
    l: f64,
    j: f64,
    rotor: f64,
    wheels: f64,
}

#[dynamics]
impl Snakeboard {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let board = 0.5 * self.m * vec2(q.x, q.y).dt().norm_squared() + 0.5 * self.j * q.theta.dt().powi(2);
        let rotor = 0.5 * self.rotor * (q.theta.dt() + q.psi.dt()).powi(2);
        board + rotor + self.wheels * (q.theta.dt().powi(2) + q.phi.dt().powi(2))
    }
    #[nonholonomic]
    fn skates(&self, q: &Coordinates<Self>) -> [Expr; 2] {
        let (front, rear) = (q.theta + q.phi, q.theta - q.phi);
        let arm = self.l * q.theta.dt() * q.phi.cos();
        [
            q.y.dt() * front.cos() - q.x.dt() * front.sin() + arm,
            q.y.dt() * rear.cos() - q.x.dt() * rear.sin() - arm,
        ]
    }
}

/// Velocities that have drifted make rows contradict each other where they should repeat each other. Along
/// the board it moves with v, and lateral not at all: v sin φ = l θ̇ cos φ. With v = w l cos φ, θ̇ = w sin φ
/// the energies of the rotor's constant momentum and of the steering, which nothing moves, stay, and so does
/// w² (m l² cos² φ + (j + 2 wheels) sin² φ).
#[test]
fn velocities_that_contradict_each_other_by_drift_are_to_be_projected() {
    let board = Snakeboard { m: 2.0, l: 0.3, j: 0.1, rotor: 0.05, wheels: 0.01 };
    let (phi, along, end) = (0.4f64, 0.5, 3.0);
    let w = along / (board.l * phi.cos());
    let start = board.state().phi(phi).phi_rate(1.0).psi_rate(3.0).x_rate(along).theta_rate(w * phi.sin());
    let start = start.build().unwrap();
    let run = |formulation| board.simulate(start).until(end).formulation(formulation).tolerance(1e-9).run();
    let gains = Formulation::Baumgarte { alpha: 5.0, beta: 5.0 };
    for drifts in [Formulation::Augmented, gains] {
        let error = run(drifts).expect_err("skates that contradict each other");
        assert!((error.state.t() - (0.5 * core::f64::consts::PI - phi)).abs() < 1e-6, "{error}");
        says(
            Err::<(), _>(error),
            "choose `Formulation::Projected`, so that steps go over such positions; if the mechanism cannot \
             move on here, change",
        );
    }
    for formulation in [Formulation::Projected, Formulation::Embedded] {
        let state = run(formulation).unwrap_or_else(|error| panic!("{formulation:?}: {error}")).end();
        let inertia = |phi: f64| {
            let (s, c) = phi.sin_cos();
            board.m * (board.l * c).powi(2) + (board.j + 2.0 * board.wheels) * s * s
        };
        let (s, c) = state.phi().sin_cos();
        let w = w * (inertia(phi) / inertia(state.phi())).sqrt();
        let (sine, cosine) = state.theta().sin_cos();
        let expected = [
            (state.phi(), phi + end),
            (state.theta_rate(), w * s),
            (state.x_rate(), w * board.l * c * cosine),
            (state.y_rate(), w * board.l * c * sine),
            (state.theta_rate() + state.psi_rate(), start.theta_rate() + start.psi_rate()),
        ];
        assert!(
            expected.iter().all(|(is, wanted)| (is - wanted).abs() < 1e-7),
            "{formulation:?}: {expected:?}"
        );
    }
}

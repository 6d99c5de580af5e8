//! Starts by speeds: what they become, and where they are refused.

use dynamics::constrain::move_by_speeds;
use dynamics::error::StateError;
use dynamics::prelude::*;

use super::models::*;

const TOP: Top = Top { a: 1.0, b: 2.0, c: 2.5, weight: 0.0, height: 1.0 };

#[test]
fn speeds_and_rates_are_two_ways_to_say_the_same() {
    let by_speeds = TOP.state().phi(0.3).theta(1.0).psi(0.2).omega([1.0, 2.0, 3.0]).build().expect("regular");
    let rates = TOP.state().phi(0.3).theta(1.0).psi(0.2);
    let [phi, theta, psi] = [by_speeds.phi_rate(), by_speeds.theta_rate(), by_speeds.psi_rate()];
    let by_rates = rates.phi_rate(phi).theta_rate(theta).psi_rate(psi).build().expect("finite");
    assert_eq!(by_speeds, by_rates);
    // ψ̇ = ω₃ − φ̇ cos θ.
    assert!((psi - (3.0 - phi * 1.0_f64.cos())).abs() < 1e-14);
    let both = rates.omega([1.0, 2.0, 3.0]).theta_rate(0.1).build();
    assert_eq!(both, Err(StateError::RateBesideSpeeds { coordinate: "theta" }));
    let text = both.expect_err("both").to_string();
    assert!(text.contains("`theta`") && text.contains("give the speeds or the rates"), "{text}");
}

#[test]
fn a_position_in_which_the_speeds_do_not_tell_the_rates_is_named() {
    for theta in [0.0, std::f64::consts::PI] {
        let error = TOP.state().phi(0.3).theta(theta).omega([1.0, 2.0, 3.0]).build().expect_err("locked");
        let StateError::SpeedsSingular { coordinates, pivot } = &error else { panic!("{error}") };
        assert!(
            coordinates.count() == 2 && coordinates.contains("phi") && coordinates.contains("psi"),
            "{error}"
        );
        assert!(*pivot < 1e-12);
        let text = error.to_string();
        assert!(text.contains("the rates of `p") && text.contains("apart in this position"), "{text}");
        // Rest is no exception: what is rounding in one row is rounding beside the others of its unit.
        let rest = TOP.state().phi(0.3).theta(theta).omega([0.0; 3]).build();
        assert!(matches!(rest, Err(StateError::SpeedsSingular { .. })), "{rest:?}");
        TOP.state().theta(theta).build().expect("by rates");
    }
    let beside = TOP.state().theta(1e-6).omega([1.0, 2.0, 3.0]).build().expect("regular, if barely");
    let mut speeds = [0.0; 3];
    TOP.speeds(&beside, &mut speeds);
    assert!((speeds[0] - 1.0).abs() < 1e-9 && (speeds[1] - 2.0).abs() < 1e-9);
}

#[test]
fn what_is_no_number_is_refused() {
    let error = TOP.state().theta(1.0).omega([1.0, f64::NAN, 0.0]).build().expect_err("no number");
    assert!(matches!(error, StateError::NotFinite { what: "speed", name: "omega[1]", .. }), "{error}");
    let nowhere = TOP.state().theta(f64::INFINITY).omega([1.0; 3]).build().expect_err("nowhere");
    assert!(matches!(nowhere, StateError::NotFinite { what: "coordinate", name: "theta", .. }), "{nowhere}");
}

#[test]
fn constraints_take_part() {
    let sleigh = Sleigh { mass: 1.0, inertia: 0.1, a: 0.2 };
    let state = sleigh.state().x(0.2).phi(0.7).v(2.0).spin(0.5).build().expect("regular");
    // The skate goes ahead; the center swings about it.
    let (sin, cos) = 0.7_f64.sin_cos();
    let [x, y] = [2.0 * cos - 0.2 * 0.5 * sin, 2.0 * sin + 0.2 * 0.5 * cos];
    assert!(
        (state.x_rate() - x).abs() < 1e-15 && (state.y_rate() - y).abs() < 1e-15 && state.phi_rate() == 0.5
    );
    // What is not given is 0.
    let turning = sleigh.state().spin(0.5).build().expect("regular");
    let mut speeds = [f64::NAN; 2];
    sleigh.speeds(&turning, &mut speeds);
    assert!(speeds[0].abs() < 1e-16 && speeds[1] == 0.5, "{speeds:?}");
    // A position off the constraints is refused as ever.
    let satellite = Satellite { inertia: Mat3::diagonal(1.0, 1.0, 1.0) };
    let off = satellite.state().e([1.0, 0.0, 0.1, 0.0]).omega([1.0, 0.0, 0.0]);
    let error = off.build().expect_err("off the unit sphere");
    assert!(matches!(error, StateError::ConstraintViolated { row: "unit", .. }), "{error}");
    let closed =
        satellite.state().e_guess([1.0, 0.0, 0.1, 0.0]).omega([1.0, 2.0, 0.0]).assemble().expect("assembles");
    let mut speeds = [f64::NAN; 3];
    satellite.speeds(&closed, &mut speeds);
    assert!((speeds[0] - 1.0).abs() < 1e-14 && (speeds[1] - 2.0).abs() < 1e-14, "{speeds:?}");
    assert!(
        satellite.residual(&closed)[0].abs() < 1e-14 && satellite.velocity_residual(&closed)[0].abs() < 1e-14
    );
}

#[test]
fn rest_on_a_turntable_is_a_start() {
    // ẋ = Ω × r, to rounding: speeds of 0 are compared with what the table turns by.
    let table = Turntable { m: 1.5, turning: 0.7, k: 2.0 };
    for i in 0..50 {
        let t = 0.37 * f64::from(i);
        let state =
            table.state().at_time(t).x(0.8).y(-0.4).seen([0.0, 0.0]).build().expect("at rest on the table");
        assert!((state.x_rate() - 0.7 * 0.4).abs() < 1e-15 && (state.y_rate() - 0.7 * 0.8).abs() < 1e-15);
    }
}

/// A spinning bead on a table that a brake may hold along x, in both components of its velocity.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, phi: rad)]
#[speeds(v: [m / s; 2], spin: rad / s)]
#[units(m: kg, inertia: kg * m^2)]
struct Bead {
    m: f64,
    inertia: f64,
}

#[dynamics]
impl Bead {
    #[kinematic]
    fn v(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, q.y).dt()
    }
    #[kinematic]
    fn spin(&self, q: &Coordinates<Self>) -> Expr {
        q.phi.dt()
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * self.v(q).norm_squared() + 0.5 * self.inertia * self.spin(q).powi(2)
    }
    #[nonholonomic(switched, integrable)]
    fn brake(&self, q: &Coordinates<Self>) -> Expr {
        q.x.dt()
    }
}

#[test]
fn speeds_that_a_switched_constraint_does_not_admit_are_refused() {
    let bead = Bead { m: 1.0, inertia: 1.0 };
    bead.state().v([0.0, 2.0]).build().expect("along the brake");
    // The speed that is to blame, however fast the other unit's are.
    for spin in [0.0, 1e9] {
        let error = bead.state().v([1e-3, 2.0]).spin(spin).build().expect_err("across it");
        assert_eq!(error, StateError::SpeedNotMet { speed: "v[0]", given: 1e-3, found: 0.0 });
    }
    let free = bead.state().release("brake").v([1.0, 2.0]).build().expect("released");
    assert_eq!([free.x_rate(), free.y_rate()], [1.0, 2.0]);
    // Nor are they by the function, which leaves the state alone then.
    let mut state = bead.state().v([0.0, 2.0]).spin(3.0).build().expect("along the brake");
    let before = state;
    let error = move_by_speeds(&bead, &mut state, &[1.0, 5.0, 7.0]).expect_err("across the brake");
    assert!(matches!(error, StateError::SpeedNotMet { speed: "v[0]", .. }), "{error}");
    assert_eq!(state, before);
}

#[test]
fn a_state_that_cannot_be_moved_stays_as_it_is() {
    let mut state = TOP.state().theta(0.0).phi_rate(1.5).build().expect("by rates");
    let before = state;
    move_by_speeds(&TOP, &mut state, &[0.1, 0.2, 0.3]).expect_err("locked");
    assert_eq!(state, before);
}

/// A rod in space that is held in the plane z = 0 twice, in the speed of its turning.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, z: m)]
#[speeds(turning: rad / s)]
#[units(m: kg, l: m, g: m / s^2)]
struct HeldTwice {
    m: f64,
    l: f64,
    g: f64,
}

#[dynamics]
impl HeldTwice {
    #[kinematic]
    fn turning(&self, q: &Coordinates<Self>) -> Expr {
        (q.x * q.y.dt() - q.y * q.x.dt()) / self.l.powi(2)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * vec3(q.x, q.y, q.z).dt().norm_squared()
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * q.y
    }
    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * (vec3(q.x, q.y, q.z).norm_squared() - self.l.powi(2))
    }
    #[holonomic]
    fn plane(&self, q: &Coordinates<Self>) -> Expr {
        q.z
    }
    #[holonomic]
    #[redundant]
    fn again(&self, q: &Coordinates<Self>) -> Expr {
        2.0 * q.z
    }
}

#[test]
fn beside_redundant_constraints_speeds_serve_starts_and_outputs() {
    let (l, g) = (2.0, 9.81);
    let rod = HeldTwice { m: 1.5, l, g };
    assert!(HeldTwice::REPORT.contains("coordinates, as constraints are switched or redundant"));
    let (sin, cos) = 0.4_f64.sin_cos();
    let state = rod.state().x(l * sin).y(-l * cos).turning(3.0).build().expect("regular");
    assert!((state.x_rate() - 3.0 * l * cos).abs() < 1e-14 && (state.y_rate() - 3.0 * l * sin).abs() < 1e-14);
    assert_eq!(state.z_rate(), 0.0);
    // θ̈ = −(g/l) sin θ.
    let q = HeldTwice::coordinates_with(&state, &rod.accelerations(&state).expect("regular"), &[]);
    assert!((rod.turning(&q).dt().value() + g / l * sin).abs() < 1e-12);
    let motion = rod.simulate(state).until(1.0).tolerance(1e-10).run().expect("runs");
    // ½ l² θ̇² − g l cos θ stays.
    let energy = |t: f64| {
        let (q, turning) = (motion.at(t).q, motion.output("turning", t).expect("an output"));
        0.5 * (l * turning).powi(2) + g * q[1]
    };
    assert!((energy(1.0) - energy(0.0)).abs() < 1e-8);
}

#[test]
fn velocities_are_set_while_a_program_runs() {
    let mut state = TOP.state().theta(1.0).build().expect("finite");
    move_by_speeds(&TOP, &mut state, &[0.1, 0.2, 0.3]).expect("regular");
    let mut speeds = [0.0; 3];
    TOP.speeds(&state, &mut speeds);
    assert!(speeds.iter().zip([0.1, 0.2, 0.3]).all(|(a, b)| (a - b).abs() < 1e-15));
}

#[test]
fn speeds_are_named_with_their_units_and_are_outputs() {
    let named: Vec<_> = Aircraft::SPEEDS.iter().map(|speed| (speed.name, speed.unit)).collect();
    let expected = ["v[0]", "v[1]", "v[2]"].map(|name| (name, "m/s")).into_iter();
    assert!(
        named
            .iter()
            .copied()
            .eq(expected.chain(["omega[0]", "omega[1]", "omega[2]"].map(|name| (name, "rad/s"))))
    );
    assert!(
        Sleigh::OUTPUTS.iter().map(|output| output.name).eq(["speed_and_spin", "v", "spin"]),
        "behind the others"
    );
    assert!(
        Aircraft::REPORT.contains("6: v[0] ... v[2] (m/s), omega[0] ... omega[2] (rad/s)"),
        "{}",
        Aircraft::REPORT
    );
    assert_eq!(TopInAngles::SPEEDS, &[]);
    // A speed without a unit has that of its function.
    assert_eq!(Satellite::SPEEDS.len(), 3);
}

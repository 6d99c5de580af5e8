//! Beside steady motions: what turns with them has constant coefficients, what is seen or pushed from the
//! side has none.

use dynamics::analysis::{SignalUnavailable, VibrationError};
use dynamics::prelude::*;

/// A body that is pushed along its own axis, with a mark that is seen from the side.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, theta: rad)]
#[inputs(thrust: N, torque: N * m)]
#[units(m: kg, inertia: kg * m^2, k: N / m, rate: rad / s)]
struct Spinner {
    m: f64,
    inertia: f64,
    k: f64,
    rate: f64,
}
#[dynamics]
impl Spinner {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * vec2(q.x, q.y).dt().norm_squared() + 0.5 * self.inertia * q.theta.dt().powi(2)
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.k * (q.x.powi(2) + q.y.powi(2))
    }
    #[force]
    fn engine(&self, q: &Coordinates<Self>) -> Force {
        Force::at(vec2(q.x, q.y), q.thrust * vec2(q.theta.cos(), q.theta.sin()))
            + Force::along(q.theta, q.torque)
    }
    #[output]
    fn mark(&self, q: &Coordinates<Self>) -> Expr {
        q.theta.cos()
    }
    #[output]
    fn swept(&self, q: &Coordinates<Self>) -> Expr {
        q.x * (self.rate * q.t).cos()
    }
    #[output]
    fn spin(&self, q: &Coordinates<Self>) -> Expr {
        2.0 * q.theta.dt()
    }
}

impl Spinner {
    fn new() -> Self {
        Self { m: 2.0, inertia: 3.0, k: 8.0, rate: 3.0 }
    }
    fn turning(&self, rate: f64) -> State<Self> {
        self.state().theta(0.4).theta_rate(rate).thrust(0.0).torque(0.0).build().unwrap()
    }
}

#[test]
fn what_changes_along_the_motion_has_no_response() {
    let model = Spinner::new();
    let space = model.state_space(&model.turning(10.0)).unwrap();
    let varies = |input: &str, output: &str, name: &str| {
        let wanted = VibrationError::NoRow { name: name.into(), why: SignalUnavailable::Varies };
        assert_eq!(space.frequency_response(input, output, &[3.0]), Err(wanted));
    };
    varies("torque", "mark", "mark");
    varies("torque", "swept", "swept");
    varies("thrust", "x", "thrust");
    let value =
        |input: &str, output: &str| space.frequency_response(input, output, &[3.0]).unwrap().values[0];
    // −1/(I ω²), 2/(I iω), 1/(k − m ω²).
    assert!((value("torque", "theta").re + 1.0 / 27.0).abs() < 1e-15);
    assert!((value("torque", "spin").im + 2.0 / 9.0).abs() < 1e-15);
    assert!((value("x", "x").re + 0.1).abs() < 1e-15);
    let lqr =
        space.lqr().weight("x", 1.0).weight("theta", 1.0).weight("thrust", 1.0).weight("torque", 1.0).solve();
    assert_eq!(
        lqr.unwrap_err(),
        VibrationError::NoRow { name: "thrust".into(), why: SignalUnavailable::Varies }
    );
    // At rest both are what they are, but for what time sweeps.
    let space = model.state_space(&model.turning(0.0)).unwrap();
    let along = space.frequency_response("thrust", "x", &[1.0]).unwrap().values[0];
    assert!((along.re - 0.4f64.cos() / 6.0).abs() < 1e-15, "{along}");
    assert!(space.frequency_response("torque", "mark", &[1.0]).is_ok());
    assert!(space.frequency_response("x", "swept", &[1.0]).is_err());
}

/// A flywheel on a motor.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta: rad)]
#[inputs(torque: N * m)]
#[units(inertia: kg * m^2)]
struct Flywheel {
    inertia: f64,
}
#[dynamics]
impl Flywheel {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.inertia * q.theta.dt().powi(2)
    }
    #[force]
    fn motor(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.theta, q.torque)
    }
}

/// The angle that a regulator wants goes on with the motion.
#[test]
fn a_regulator_follows_the_motion() {
    let model = Flywheel { inertia: 2.0 };
    let start = model.state().theta(0.4).theta_rate(10.0).torque(0.0).build().unwrap();
    let control = model.state_space(&start).unwrap();
    let control =
        control.lqr().weight("theta", 1.0).weight("theta_rate", 1.0).weight("torque", 1.0).solve().unwrap();
    let end = model.simulate(start).until(5.0).run().unwrap().end();
    assert!((end.theta() - 50.4).abs() < 1e-12 && control.inputs_at(&end)[0].abs() < 1e-12);
    // Let go behind and too fast it comes back into step.
    let late = model.state().theta(0.1).theta_rate(10.5).torque(0.0).build().unwrap();
    let motion =
        model.simulate(late).until(60.0).tolerance(1e-10).inputs(|_, s| control.inputs_at(s)).run().unwrap();
    let end = motion.end();
    assert!((end.theta() - 600.4).abs() < 1e-7 && (end.theta_rate() - 10.0).abs() < 1e-7, "{end:?}");
}

/// Of a wheel whose speed alone is held the angle goes where it goes: q = ρ, K = √(q/r) by the Riccati
/// equation of one state, 2·0·X − X²/(I² r) + q = 0.
#[test]
fn a_speed_is_held_and_the_angle_left_to_itself() {
    let model = Flywheel { inertia: 2.0 };
    let start = model.state().theta(0.4).theta_rate(10.0).torque(0.0).build().unwrap();
    let control = model.state_space(&start).unwrap();
    let control = control.lqr().weight("theta_rate", 4.0).weight("torque", 0.25).solve().unwrap();
    assert_eq!(control.left_out.iter().map(|one| one.name.as_str()).collect::<Vec<_>>(), ["theta"]);
    assert_eq!(control.gain_of("torque", "theta"), Some(0.0));
    assert!((control.gain_of("torque", "theta_rate").unwrap() - 4.0).abs() < 1e-13, "{control}");
    assert!(control.closed_loop.len() == 1 && (control.closed_loop[0].re + 2.0).abs() < 1e-13, "{control}");
    assert!(control.to_string().contains("left to itself: `theta`"), "{control}");
    // As soon as the angle counts it is not left out.
    let both = model.state_space(&start).unwrap();
    let both =
        both.lqr().weight("theta", 1e-6).weight("theta_rate", 4.0).weight("torque", 0.25).solve().unwrap();
    assert!(both.left_out.is_empty() && both.closed_loop.len() == 2, "{both}");
}

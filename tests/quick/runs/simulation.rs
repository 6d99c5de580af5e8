//! Derived models in motion: what the macro emits, driven by everything that a simulation offers.

#![allow(
    missing_docs,
    unreachable_pub,
    clippy::excessive_precision,
    reason = "test models; reference values keep their digits"
)]

use crate::double_pendulum;

use double_pendulum::DoublePendulum;
use dynamics::prelude::*;

/// The contract's own lines, and the reference of Levien and Tan's double pendulum at t = 10 (30 digits
/// proven). A mass without a lever turns nothing: giving it more mass would be no remedy.
#[test]
fn levers_of_no_length_are_named() {
    let model = DoublePendulum { m1: 1.0, m2: 1.0, l1: 1.0, l2: 0.0, g: 9.8 };
    let error =
        model.simulate(model.state().theta1(1.0).build().unwrap()).until(1.0).run().unwrap_err().to_string();
    assert!(
        error.contains("`theta2` has no inertia at this state")
            && error.contains("a lever that is not 0 (parameter `l2` is 0)"),
        "{error}"
    );
    // Where a mass is 0, it is that.
    let model = DoublePendulum { m2: 0.0, ..model };
    let error =
        model.simulate(model.state().theta1(1.0).build().unwrap()).until(1.0).run().unwrap_err().to_string();
    assert!(error.contains("a positive mass (parameter `m2` is 0)"), "{error}");
}

#[test]
fn a_derived_double_pendulum_meets_its_reference() {
    let model = DoublePendulum { m1: 1.0, m2: 1.0, l1: 1.0, l2: 1.0, g: 9.8 };
    let pi = std::f64::consts::PI;
    let start = model.state().theta1(2.0 * pi / 3.0).theta2(-pi / 18.0).build().unwrap();
    let motion = model.simulate(start).until(10.0).tolerance(1e-14).run().unwrap();
    let end = motion.at(10.0);
    assert!((end.theta1() + 0.792596116598799467).abs() < 1e-9);
    assert!((end.theta2() + 2.46949450975492676).abs() < 1e-9);
    assert!((end.theta1_rate() + 1.97580988134385349).abs() < 1e-9);
    assert!((end.theta2_rate() + 2.38063119314817533).abs() < 1e-9);
    assert!(motion.verify().energy_drift < 1e-12, "{}", motion.verify());
    let long = model.simulate(start).until(1000.0).tolerance(1e-12).run().unwrap();
    assert!(long.verify().energy_drift < 1e-9, "{}", long.verify());
    let place = model.bob2(&motion.coordinates_at(3.0)).value();
    let q = motion.at(3.0).q;
    assert!((place.x - q[0].sin() - q[1].sin()).abs() < 1e-15);
}

/// A cart with a pendulum: motor force, viscous damping, a tether along a distance, one output and one event.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, theta: rad)]
#[inputs(motor: N)]
#[units(cart: kg, bob: kg, l: m, g: m / s^2, c: N * s / m, k: N / m)]
pub struct CartPole {
    pub cart: f64,
    pub bob: f64,
    pub l: f64,
    pub g: f64,
    pub c: f64,
    pub k: f64,
}

#[dynamics]
impl CartPole {
    fn bob(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, 0.0) + self.l * vec2(q.theta.sin(), -q.theta.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.cart * q.x.dt().powi(2) + 0.5 * self.bob * self.bob(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.bob * self.g * self.bob(q).y
    }
    #[dissipation]
    fn friction(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.c * q.x.dt().powi(2)
    }
    #[force]
    fn drive(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, q.motor)
    }
    #[force]
    fn tether(&self, q: &Coordinates<Self>) -> Force {
        Force::at(self.bob(q), -self.k * self.bob(q))
    }
    #[output]
    fn height(&self, q: &Coordinates<Self>) -> Expr {
        self.bob(q).y
    }
    #[event]
    fn upright(&self, q: &Coordinates<Self>) -> Expr {
        q.theta.cos()
    }
}

fn cart_pole() -> CartPole {
    CartPole { cart: 1.0, bob: 0.3, l: 0.5, g: 9.81, c: 0.2, k: 1.5 }
}

#[test]
fn the_work_of_every_named_force_closes_the_account() {
    let model = cart_pole();
    let start = model.state().theta(0.4).x_rate(1.0).build().unwrap();
    for method in &[methods::Any::from(methods::Dop853), methods::DormandPrince5.into()] {
        let motion = model
            .simulate(start)
            .until(8.0)
            .tolerance(1e-11)
            .method(method)
            .inputs(|t, s| [2.0 * (3.0 * t).sin() - 0.1 * s.theta_rate()])
            .run()
            .unwrap();
        let account = motion.work();
        println!("{account}");
        let names: Vec<&str> = account.forces.iter().map(|row| row.name.as_str()).collect();
        for name in ["friction", "drive", "tether"] {
            assert!(names.contains(&name), "{names:?}");
        }
        let largest = account.forces.iter().map(|row| row.work.abs()).fold(0.0, f64::max);
        assert!(largest > 0.1, "forces do work");
        assert!(account.closure_error.abs() < 1e-9 * account.scale, "{method}\n{account}");
        let t = 4.321;
        assert_eq!(motion.output("height", t).unwrap(), -0.5 * motion.at(t).theta().cos());
        assert_eq!(motion.at(t).motor(), 2.0 * (3.0 * t).sin() - 0.1 * motion.at(t).theta_rate());
    }
}

#[test]
fn declared_events_are_found_and_act() {
    let model = cart_pole();
    let start = model.state().theta(0.3).theta_rate(15.0).motor(0.0).build().unwrap();
    let listed = model.simulate(start).until(2.0).run().unwrap();
    assert!(listed.events().len() >= 3);
    for event in listed.events() {
        assert!(event.name == "upright" && event.before.theta().cos().abs() < 1e-12);
    }
    let stopped = model.simulate(start).until(2.0).stop_at("upright", Direction::Rising).run().unwrap();
    assert!(stopped.end().theta().cos().abs() < 1e-14);
    let braked = model
        .simulate(start)
        .until(2.0)
        .on_event("upright", Direction::Falling, |s| s.u[1] *= 0.5)
        .run()
        .unwrap();
    let account = braked.work();
    assert!(account.resets[0].work < 0.0 && account.closure_error.abs() < 1e-8 * account.scale, "{account}");
}

/// A mass on a spring whose anchor is moved: the Lagrangian contains time.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
pub struct Driven {
    pub m: f64,
    pub k: f64,
    pub a: f64,
}

#[dynamics]
impl Driven {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.k * (q.x - self.a * (2.0 * q.t).sin()).powi(2)
    }
}

#[test]
fn explicit_time_does_work_of_its_own() {
    let model = Driven { m: 1.0, k: 9.0, a: 0.3 };
    let motion =
        model.simulate(model.state().x(0.1).build().unwrap()).until(5.0).tolerance(1e-12).run().unwrap();
    // ẍ = 9 (a sin 2t − x): x = 0.1 cos 3t + (9a/5)(sin 2t − ⅔ sin 3t)
    let exact =
        |t: f64| 0.1 * (3.0 * t).cos() + 9.0 * 0.3 / 5.0 * ((2.0 * t).sin() - (3.0 * t).sin() * 2.0 / 3.0);
    for t in [0.5, 2.0, 5.0] {
        assert!((motion.at(t).x() - exact(t)).abs() < 1e-10);
    }
    let account = motion.work();
    assert!(account.forces[0].name == "explicit time" && account.forces[0].work.abs() > 0.01, "{account}");
    assert!(account.closure_error.abs() < 1e-10 * account.scale, "{account}");
}

/// The same spring with its anchor as an input.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
#[inputs(anchor)]
pub struct Pulled {
    pub m: f64,
    pub k: f64,
}

#[dynamics]
impl Pulled {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.k * (q.x - q.anchor).powi(2)
    }
}

/// Held, the input does no work and its jumps are in the account; as a function of time it does work that
/// only its rate would tell, and no drift of the energy is made of that.
#[test]
fn inputs_in_energies_are_accounted_for_or_said_to_be_unknown() {
    let model = Pulled { m: 1.0, k: 9.0 };
    let start = model.state().x(0.1).anchor(0.0).build().unwrap();
    let run = || model.simulate(start).until(5.0).tolerance(1e-12);
    let switched = run()
        .event("one second", |s| s.t - 1.0)
        .on_event("one second", Direction::Rising, |s| s.inputs[0] = 0.3)
        .run()
        .unwrap();
    let account = switched.work();
    assert!(
        account.resets[0].work.abs() > 0.01 && account.closure_error.abs() < 1e-10 * account.scale,
        "{account}"
    );
    assert!(switched.verify().energy_drift < 1e-10);

    let pulled = run().inputs(|t, _| [0.3 * (2.0 * t).sin()]).run().unwrap();
    let account = pulled.work();
    assert!(
        account.forces.last().unwrap().name == "changing inputs" && account.closure_error.is_nan(),
        "{account}"
    );
    let summary = pulled.verify();
    assert!(
        summary.energy_drift.is_nan() && summary.to_string().contains("energy cannot be accounted for"),
        "{summary}"
    );
    // The input moves the anchor as explicit time does.
    let timed = Driven { m: 1.0, k: 9.0, a: 0.3 };
    let reference =
        timed.simulate(timed.state().x(0.1).build().unwrap()).until(5.0).tolerance(1e-12).run().unwrap();
    assert!((pulled.end().x() - reference.end().x()).abs() < 1e-10);

    // The law for one input may return the number itself, or the inputs' vector.
    let number = run().inputs(|t, _| 0.3 * (2.0 * t).sin()).run().unwrap();
    assert_eq!(number.end(), pulled.end());
    let vector = run().inputs(|t, s| s.inputs.map(|_| 0.3 * (2.0 * t).sin())).run().unwrap();
    assert_eq!(vector.end(), pulled.end());
    assert_eq!(
        run().inputs(|_, _| 0.25).run().unwrap().end(),
        run().inputs(|_, _| [0.25]).run().unwrap().end()
    );
}

/// Two masses and a wheel, without a function that says where anything is.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: [m; 2], y: [m; 2], psi: rad)]
#[units(m: kg, inertia: kg * m^2)]
struct Unplaced {
    m: f64,
    inertia: f64,
}

#[dynamics]
impl Unplaced {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = 0.5 * self.inertia * q.psi.dt().powi(2);
        for i in 0..2 {
            sum += 0.5 * self.m * (q.x[i].dt().powi(2) + q.y[i].dt().powi(2));
        }
        sum
    }
}

/// A wheel by itself: an angle is no place.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(psi: rad)]
#[units(inertia: kg * m^2)]
struct Wheel {
    inertia: f64,
}

#[dynamics]
impl Wheel {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.inertia * q.psi.dt().powi(2)
    }
}

#[test]
fn no_picture_is_empty() {
    let model = Unplaced { m: 1.0, inertia: 1.0 };
    let start = model.state().x([1.0, 2.0]).y_rate([0.5, -0.5]).build().unwrap();
    let shown = model.draw(&Unplaced::coordinates_with(&start, &[0.0; 5].into(), &[]));
    assert_eq!(shown.shapes().len(), 4, "a trace and a dot for each mass");
    let motion = model.simulate(start).until(1.0).run().unwrap();
    assert!(!motion.animation().to_html().unwrap().contains("nothing is known to draw"));
    let wheel = Wheel { inertia: 1.0 };
    let motion = wheel.simulate(wheel.state().psi_rate(1.0).build().unwrap()).until(1.0).run().unwrap();
    assert!(motion.animation().to_html().unwrap().contains("nothing is known to draw"));
}

/// A mass on a shaken table: nothing is free, and steps are as long as the projection makes them.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(y: m)]
#[units(m: kg, g: m / s^2, amplitude: m, omega: rad / s)]
struct Shaken {
    m: f64,
    g: f64,
    amplitude: f64,
    omega: f64,
}

#[dynamics]
impl Shaken {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.y.dt().powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * q.y
    }
    #[holonomic]
    fn table(&self, q: &Coordinates<Self>) -> Expr {
        q.y - self.amplitude * (self.omega * q.t).sin()
    }
}

#[test]
fn the_work_of_a_constraint_that_moves_is_accounted_for() {
    let model = Shaken { m: 1.0, g: 9.81, amplitude: 0.005, omega: 40.0 };
    let start = model.state().assemble().unwrap();
    for (tolerance, permitted) in [(1e-6, 1e-3), (1e-9, 1e-9), (1e-12, 1e-12)] {
        let motion = model.simulate(start).until(3.0).tolerance(tolerance).run().unwrap();
        let summary = motion.verify();
        assert!(summary.energy_drift < permitted, "{summary}");
        // What the table did is what the mass has.
        let gained = motion.energy_at(3.0) - motion.energy_at(0.0);
        let work: f64 = motion.work().forces.iter().map(|row| row.work).sum();
        assert!((work - gained).abs() < permitted * summary.energy_scale, "{}", motion.work());
    }
}

/// A mass that a fuse holds, which breaks at a limit; the pull jumps at a time.
mod fuse {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: m)]
    #[units(m: kg, before: N, after: N, limit: N, on: s)]
    pub(super) struct Held {
        pub(super) m: f64,
        pub(super) before: f64,
        pub(super) after: f64,
        pub(super) limit: f64,
        pub(super) on: f64,
    }
    #[dynamics]
    impl Held {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m * q.x.dt().powi(2)
        }
        #[force]
        fn pull(&self, q: &Coordinates<Self>) -> Force {
            Force::along(q.x, if q.t < self.on { Expr::from(self.before) } else { Expr::from(self.after) })
        }
        #[holonomic(switched)]
        fn hold(&self, q: &Coordinates<Self>) -> Expr {
            q.x
        }
        #[event]
        fn fuse(&self, q: &Coordinates<Self>) -> Expr {
            self.limit - q.reaction(Self::hold).abs()
        }
    }
}

/// Steps are as long as nothing happens; a secant across the jump of the reaction led away from it, by up to
/// milliseconds, wherever the function was farther from zero behind it.
#[test]
fn actions_where_reactions_jump_happen_in_their_instant() {
    for on in [0.5, 5.5, 50.3] {
        for (before, after) in [(0.0, 3.0), (0.5, 1.4), (0.5, 3.0), (-0.9, 3.0), (0.5, 30.0)] {
            let model = fuse::Held { m: 1.0, before, after, limit: 1.0, on };
            for formulation in [Formulation::Projected, Formulation::Embedded] {
                let run =
                    model.simulate(model.state().build().unwrap()).until(on + 1.0).formulation(formulation);
                let run = run.on_event_with("fuse", Direction::Falling, |change| change.release("hold"));
                let motion = run.run().unwrap_or_else(|e| panic!("{on}, {before} to {after}: {e}"));
                let (off, x) = (motion.events()[0].time() - on, motion.end().x() - 0.5 * after);
                println!("{on}, {before} to {after} {formulation}: {off:e} s, {x:e} m");
                assert!(
                    off.abs() < 1e-9 && x.abs() < 1e-8,
                    "{on}, {before} to {after} {formulation}: {off:e} s, {x:e} m"
                );
            }
        }
    }
}

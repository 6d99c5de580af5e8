//! Equilibria of derived models: all of them, once each, against closed forms and other coordinates; where
//! there is none, the error says so.

mod damping;
#[path = "../../models/free_hoop.rs"]
mod free_hoop;
mod hard;
#[path = "../../models/hencky.rs"]
mod hencky;
mod linearize;
#[path = "../../models/parallelogram.rs"]
mod parallelogram;
mod published;
#[path = "../../models/rolling_disk.rs"]
mod rolling_disk;
mod stability;
#[path = "../../models/top.rs"]
mod top;
#[path = "../../models/truss.rs"]
mod truss;
#[path = "../../models/turned_hoop.rs"]
mod turned_hoop;
#[path = "../../models/two_bars.rs"]
mod two_bars;
mod weak;
mod writings;
#[path = "../../models/ziegler.rs"]
mod ziegler;

use std::f64::consts::PI;

use dynamics::analysis::EquilibriumError;
use dynamics::prelude::*;
use free_hoop::FreeHoop;
use turned_hoop::TurnedHoop;

/// Two bobs on rods, in angles and in the plane, one rod twice.
mod pendulum {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(theta: [rad; 2])]
    #[inputs(torque: N * m)]
    #[units(m: kg, l: m, g: m / s^2)]
    pub(super) struct Angles {
        pub(super) m: f64,
        pub(super) l: f64,
        pub(super) g: f64,
    }
    #[dynamics]
    impl Angles {
        fn bobs(&self, q: &Coordinates<Self>) -> [Vec2; 2] {
            let first = self.l * vec2(q.theta[0].sin(), -q.theta[0].cos());
            [first, first + self.l * vec2(q.theta[1].sin(), -q.theta[1].cos())]
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            let [a, b] = self.bobs(q);
            0.5 * self.m * (a.dt().norm_squared() + b.dt().norm_squared())
        }
        #[potential]
        fn weight(&self, q: &Coordinates<Self>) -> Expr {
            let [a, b] = self.bobs(q);
            self.m * self.g * (a.y + b.y)
        }
        #[force]
        fn motor(&self, q: &Coordinates<Self>) -> Force {
            Force::along(q.theta[0], q.torque)
        }
    }

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: [m; 2], y: [m; 2])]
    #[units(m: kg, l: m, g: m / s^2)]
    pub(super) struct Plane {
        pub(super) m: f64,
        pub(super) l: f64,
        pub(super) g: f64,
    }
    #[dynamics]
    impl Plane {
        fn bobs(&self, q: &Coordinates<Self>) -> [Vec2; 2] {
            [vec2(q.x[0], q.y[0]), vec2(q.x[1], q.y[1])]
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            let [a, b] = self.bobs(q);
            0.5 * self.m * (a.dt().norm_squared() + b.dt().norm_squared())
        }
        #[potential]
        fn weight(&self, q: &Coordinates<Self>) -> Expr {
            let [a, b] = self.bobs(q);
            self.m * self.g * (a.y + b.y)
        }
        #[holonomic]
        fn rods(&self, q: &Coordinates<Self>) -> [Expr; 2] {
            let [a, b] = self.bobs(q);
            [0.5 * (a.norm_squared() - self.l.powi(2)), 0.5 * ((b - a).norm_squared() - self.l.powi(2))]
        }
        #[holonomic]
        #[redundant]
        fn again(&self, q: &Coordinates<Self>) -> Expr {
            let [a, _] = self.bobs(q);
            a.norm() - self.l
        }
    }
}

#[test]
fn a_double_pendulum_has_four() {
    let model = pendulum::Angles { m: 1.5, l: 0.8, g: 9.81 };
    let around = model.state().torque(0.0).build().unwrap();
    let found = model.equilibria(around).random(100).run().unwrap();
    let wanted = [[0.0, 0.0], [0.0, PI], [PI, 0.0], [PI, PI]];
    assert_eq!(found.equilibria.len(), 4, "{found}");
    for (one, wanted) in found.equilibria.iter().zip(wanted) {
        let q = one.state.q();
        assert!((0..2).all(|i| (q[i] - wanted[i]).abs() < 1e-15) && one.force_left < 1e-14, "{one}");
        assert!(one.state.u().amax() == 0.0 && one.conditioning < 100.0, "{one}");
    }
    assert!(
        found.hits.iter().sum::<usize>() + found.failures.len() == 101 && found.unseen() == Some(0.0),
        "{found}"
    );
    // The same again; others with another seed.
    assert_eq!(found, model.equilibria(around).random(100).run().unwrap());
    assert_ne!(found.hits, model.equilibria(around).random(100).seed(1).run().unwrap().hits);

    // A motor that holds the first rod at 30 degrees, and one that is too strong for any balance.
    let weight = 2.0 * 1.5 * 9.81 * 0.8;
    let lifted = model.equilibrium(&model.state().torque(0.5 * weight).build().unwrap()).unwrap();
    assert!(
        (lifted.state.theta(0) - PI / 6.0).abs() < 1e-15 && lifted.state.theta(1).abs() < 1e-15,
        "{lifted}"
    );
    let error = model.equilibrium(&model.state().torque(1.25 * weight).build().unwrap()).unwrap_err();
    let EquilibriumError::NoEquilibrium { coordinate, force_left, soft, ref at } = error else {
        panic!("{error}")
    };
    assert_eq!((coordinate, soft), ("theta[0]", "theta[0]"));
    assert!(
        (force_left + 0.25 * weight).abs() < 1e-9 * weight && (at[0] - 0.5 * PI).abs() < 1e-4,
        "{error}: {at:?}"
    );
    // Without a value of the motor there is no balance to be found.
    let error = model.equilibrium(&model.state().build().unwrap()).unwrap_err();
    assert_eq!(error, EquilibriumError::InputNotSet { input: "torque" });
}

#[test]
fn the_same_with_constraints_that_repeat() {
    let (m, l, g) = (1.5, 0.8, 9.81);
    let model = pendulum::Plane { m, l, g };
    let around = model.state().y([-l, -2.0 * l]).build().unwrap();
    let found = model.equilibria(around).random(100).spread(2.0).run().unwrap();
    assert_eq!(found.equilibria.len(), 4, "{found}");
    for one in &found.equilibria {
        let (x, y) = ([0, 1].map(|i| one.state.x(i)), [0, 1].map(|i| one.state.y(i)));
        assert!(x.iter().all(|x| x.abs() < 1e-14), "{one}");
        let signs = [y[0] / l, (y[1] - y[0]) / l];
        assert!(signs.iter().all(|s| (s.abs() - 1.0).abs() < 1e-14), "{one}");
        // The lower rod carries one bob, by a force along the rod: λ l = −m g (b − a)_y / l.
        let rods = one.reactions.iter().find(|r| r.name == "rods").unwrap();
        assert!((rods.multipliers[1] - m * g / l * signs[1]).abs() < 1e-13 * m * g, "{one}");
        // The upper one is held twice, which leaves the shares open, but not their sum.
        let held: f64 = one.reactions.iter().map(|r| r.generalized_force[2]).sum();
        assert!(!rods.unique && (held - m * g).abs() < 1e-13 * m * g, "{one}");
    }
    // Coordinates without a range are named.
    let error = model.equilibria(around).random(1).within("x", [-1.0, 1.0]).run().unwrap_err();
    assert_eq!(error, EquilibriumError::NoRange { coordinate: "y[0]" });
}

/// At which load the truss has its apex at z.
fn load_at(z: f64) -> f64 {
    let (free, length) = (1.25_f64.sqrt(), (1.0 + z * z).sqrt());
    2.0 * z / free * (free / length - 1.0)
}

#[test]
fn a_truss_up_to_its_limit_load_and_beyond() {
    let model = |load: f64| truss::Truss { load, ..truss::TRUSS };
    let at = |load: f64, z: f64| {
        let model = model(load);
        model.equilibrium(&model.state().z(z).build().unwrap())
    };
    // Unloaded: up, flat, down. Loaded: two above, one hanging.
    for load in [0.0, 0.02, 0.038] {
        let model = model(load);
        let found = model
            .equilibria(model.state().build().unwrap())
            .random(60)
            .within("z", [-1.0, 1.0])
            .run()
            .unwrap();
        assert_eq!(found.equilibria.len(), 3, "{found}");
        for one in &found.equilibria {
            assert!((load_at(one.state.z()) - load).abs() < 1e-15, "{one}");
        }
    }
    // Toward the fold digits are lost as the root of the distance, and the result says how many.
    let [limit, fold] = truss::LIMIT;
    for part in [1e-2, 1e-6, 1e-10, 1e-14] {
        let one = at(limit * (1.0 - part), 0.5).unwrap();
        // z − z* from the series of P(z) about the fold: its third term is a part √part of the second.
        let slope = 1e-5;
        let curvature = (load_at(fold + slope) - 2.0 * limit + load_at(fold - slope)) / (slope * slope);
        let distance = (2.0 * limit * part / -curvature).sqrt();
        let found = one.state.z() - fold;
        assert!(
            (found / distance - 1.0).abs() < 2.0 * part.sqrt().max(1e-4) + 1e-15 / distance.powi(2),
            "{part:e}: {one}"
        );
        let lost = 1.0 / part.sqrt();
        assert!(one.conditioning < 100.0 * lost && one.conditioning > 0.01 * lost, "{part:e}: {one}");
        assert!(one.uncertainty[0] < 1e-7, "{one}");
    }
    // At the limit load itself half of the digits are there.
    let one = at(limit, 0.5).unwrap();
    assert!((one.state.z() - fold).abs() < one.uncertainty[0] && one.uncertainty[0] < 1e-6, "{one}");
    // Beyond it nothing balances up there, whatever little it is beyond; the snapped position hangs below.
    for part in [1e-10, 1e-6, 1e-2] {
        let error = at(limit * (1.0 + part), 0.5).unwrap_err();
        let EquilibriumError::NoEquilibrium { coordinate: "z", force_left, soft: "z", ref at } = error else {
            panic!("{part:e}: {error}")
        };
        assert!((force_left - part * limit).abs() < 1e-6 * part * limit + 1e-16, "{part:e}: {error}");
        assert!((at[0] - fold).abs() < 1e-3 * part.sqrt() + 1e-8, "{part:e}: {at:?}");
        assert!(error.to_string().contains("a fold, beyond the limit load"), "{error}");
    }
    let hanging = at(limit * 1.01, -0.6).unwrap();
    assert!((load_at(hanging.state.z()) - 1.01 * limit).abs() < 1e-15, "{hanging}");
}

#[test]
fn a_bead_on_both_sides_of_the_pitchfork() {
    let (m, g, radius) = (0.1, 9.81, 0.5);
    let critical = (g / radius).sqrt();
    for (speed, count) in [(0.999 * critical, 2), (critical, 2), (1.001 * critical, 4), (6.0, 4)] {
        let model = TurnedHoop { m, g, radius, speed, drag: 0.0 };
        let found = model.equilibria(model.state().build().unwrap()).random(60).run().unwrap();
        assert_eq!(found.equilibria.len(), count, "{speed}: {found}");
        let aside = found.equilibria.iter().filter(|one| one.state.theta().sin().abs() > 1e-3);
        for one in aside {
            let wanted = (g / (radius * speed * speed)).acos();
            assert!((one.state.theta().abs() - wanted).abs() < 10.0 * one.uncertainty[0] + 1e-15, "{one}");
        }
    }
    // As a steady motion of the hoop that turns by itself: the speed is given.
    let model = FreeHoop { m, g, radius, inertia: 0.02 };
    let one = model.steady(&model.state().theta(0.7).phi_rate(6.0).build().unwrap()).unwrap();
    assert!(
        (one.state.theta() - 0.994_407_212_058_699_5).abs() < 1e-15 && one.state.phi_rate() == 6.0,
        "{one}"
    );
    // What has a velocity that others depend on is not steady.
    let error = model.steady(&model.state().theta(0.7).theta_rate(1.0).build().unwrap()).unwrap_err();
    assert!(
        matches!(error, EquilibriumError::NotSteady { .. } | EquilibriumError::NoEquilibrium { .. }),
        "{error}"
    );
}

/// A mass in a plane between springs, with whatever makes balance difficult.
mod plane {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: m, y: m)]
    #[units(m: kg, k: N / m, pull: N, rub: N, stop: N / m, edge: m, shaken: N, speed: rad / s, far: N * m^2)]
    pub(super) struct Plane {
        pub(super) m: f64,
        pub(super) k: [f64; 2],
        pub(super) pull: f64,
        /// Dry friction on x, as a jump.
        pub(super) rub: f64,
        /// Of a stop at `edge`.
        pub(super) stop: f64,
        pub(super) edge: f64,
        pub(super) shaken: f64,
        pub(super) speed: f64,
        /// A repulsion far/r².
        pub(super) far: f64,
    }
    #[dynamics]
    impl Plane {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m * vec2(q.x, q.y).dt().norm_squared()
        }
        #[potential]
        fn springs(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.k[0] * q.x.powi(2) + 0.5 * self.k[1] * q.y.powi(2) + self.far / q.x
        }
        #[potential]
        fn stop(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.stop * (q.x - self.edge).max(0.0).powi(2)
        }
        #[force]
        fn forces(&self, q: &Coordinates<Self>) -> Force {
            Force::along(q.x, self.pull - self.rub * q.x.dt().signum())
                + Force::along(q.y, self.shaken * (self.speed * q.t).sin())
        }
    }
    pub(super) const PLANE: Plane = Plane {
        m: 1.0,
        k: [4.0, 9.0],
        pull: 0.0,
        rub: 0.0,
        stop: 0.0,
        edge: 1.0,
        shaken: 0.0,
        speed: 1.0,
        far: 0.0,
    };
}

#[test]
fn what_has_no_equilibrium_says_why() {
    use plane::{PLANE, Plane};
    let from = |model: &Plane, x: f64| model.equilibrium(&model.state().x(x).y(0.3).build().unwrap());
    let still = from(&Plane { pull: 2.0, ..PLANE }, 1.0).unwrap();
    assert!(still.state.x() == 0.5 && still.state.y().abs() < 1e-30 && still.force_left < 1e-30, "{still}");
    // Nothing holds y, and nothing moves it: wherever it is. Nothing holds x, and something pulls it.
    let loose = from(&Plane { pull: 2.0, k: [4.0, 0.0], ..PLANE }, 1.0).unwrap();
    assert_eq!((loose.state.x(), loose.state.y()), (0.5, 0.3), "{loose}");
    let error = from(&Plane { pull: 2.0, k: [0.0, 9.0], ..PLANE }, 1.0).unwrap_err();
    assert!(
        matches!(error, EquilibriumError::NoEquilibrium { coordinate: "x", force_left: -2.0, soft: "x", .. }),
        "{error}"
    );
    // A push that vanishes far away is no balance there.
    let error = from(&Plane { far: 1.0, k: [0.0, 9.0], ..PLANE }, 1.0).unwrap_err();
    assert!(matches!(error, EquilibriumError::Diverged { coordinate: "x", .. }), "{error}");
    // Friction that jumps holds anywhere between two positions; a jump in position has no balance between.
    let error = from(&Plane { pull: 2.0, rub: 1.0, ..PLANE }, 1.0).unwrap_err();
    assert!(matches!(error, EquilibriumError::Corner { coordinate: "x", .. }), "{error}");
    // Shaken: at rest for an instant only, unless the instant is what is asked for.
    for speed in [1e-6, 1.0, 1e4] {
        let shaken = Plane { shaken: 3.0, speed, pull: 2.0, ..PLANE };
        let error = from(&shaken, 1.0).unwrap_err();
        assert!(matches!(error, EquilibriumError::DependsOnTime { coordinate: "y", .. }), "{error}");
        let found = shaken.equilibria(shaken.state().x(0.3).build().unwrap()).at(0.5).run().unwrap();
        let y = 3.0 * (0.5 * speed).sin() / 9.0;
        assert!((found.equilibria[0].state.y() - y).abs() < 1e-16 + 1e-15 * y.abs(), "{found}");
        assert_eq!(found.equilibria[0].state.t(), 0.5);
    }
    let mut unset = PLANE.state().build().unwrap();
    unset.q_mut()[1] = f64::NAN;
    assert!(matches!(PLANE.equilibrium(&unset), Err(EquilibriumError::State(_))));
}

#[test]
fn stiff_beside_soft_small_beside_large() {
    use plane::{PLANE, Plane};
    // A spring of 10¹⁶ takes nothing from the digits of one of 10⁻³.
    let uneven = Plane { k: [1e16, 1e-3], pull: 2.0, ..PLANE };
    let one = uneven.equilibrium(&uneven.state().x(1.0).y(0.3).build().unwrap()).unwrap();
    assert!((one.state.x() - 2e-16).abs() < 1e-30 && one.state.y().abs() < 1e-18, "{one}");
    // Micrometres, and a stop that is reached: on its inner side the spring alone, beyond it both.
    for (pull, wanted) in [(3e-6, 0.75e-6), (6e-6, (6e-6 + 50.0 * 1e-6) / 54.0)] {
        let small = Plane { pull, stop: 50.0, edge: 1e-6, ..PLANE };
        let one = small.equilibrium(&small.state().x(-3e-6).build().unwrap()).unwrap();
        assert!((one.state.x() - wanted).abs() < 1e-21, "{one}");
    }
    // On the very edge both sides are in balance.
    let edge = Plane { pull: 4.0, stop: 50.0, edge: 1.0, ..PLANE };
    let one = edge.equilibrium(&edge.state().x(0.2).build().unwrap()).unwrap();
    assert_eq!(one.state.x(), 1.0, "{one}");
}

/// A slider on a skate that a spring pulls, and a rod whose foot is driven.
mod held {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: m, y: m, phi: rad)]
    #[units(m: kg, inertia: kg * m^2, anchor: m, k: N / m, twist: N * m)]
    pub(super) struct Skate {
        pub(super) m: f64,
        pub(super) inertia: f64,
        pub(super) anchor: f64,
        pub(super) k: f64,
        pub(super) twist: f64,
    }
    #[dynamics]
    impl Skate {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m * vec2(q.x, q.y).dt().norm_squared() + 0.5 * self.inertia * q.phi.dt().powi(2)
        }
        #[potential]
        fn springs(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.k * ((q.x - self.anchor).powi(2) + q.y.powi(2))
                + 0.5 * self.twist * (q.phi - 0.3).powi(2)
        }
        #[nonholonomic]
        fn blade(&self, q: &Coordinates<Self>) -> Expr {
            q.y.dt() * q.phi.cos() - q.x.dt() * q.phi.sin()
        }
    }

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: m, y: m)]
    #[units(m: kg, g: m / s^2, l: m, speed: m / s)]
    pub(super) struct Towed {
        pub(super) m: f64,
        pub(super) g: f64,
        pub(super) l: f64,
        pub(super) speed: f64,
    }
    #[dynamics]
    impl Towed {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m * vec2(q.x, q.y).dt().norm_squared()
        }
        #[potential]
        fn weight(&self, q: &Coordinates<Self>) -> Expr {
            self.m * self.g * q.y
        }
        #[holonomic]
        fn rope(&self, q: &Coordinates<Self>) -> Expr {
            vec2(q.x - self.speed * q.t, q.y).norm() - self.l
        }
    }
}

#[test]
fn a_skate_rests_where_its_blade_holds_it_and_what_is_towed_never() {
    // Two conditions for three coordinates: the equilibria are a line, and the nearest point of it is found.
    // The blade carries the rest.
    let model = held::Skate { m: 2.0, inertia: 0.1, anchor: 1.0, k: 5.0, twist: 0.7 };
    let one = model.equilibrium(&model.state().x(0.2).y(0.6).phi(1.0).build().unwrap()).unwrap();
    let (dx, y, phi) = (one.state.x() - 1.0, one.state.y(), one.state.phi());
    assert!((phi - 0.3).abs() < 1e-15 && (dx * phi.cos() + y * phi.sin()).abs() < 1e-15, "{one}");
    let across = 5.0 * (y * phi.cos() - dx * phi.sin());
    assert!((one.reactions[0].multipliers[0] - across).abs() < 1e-14 && across.abs() > 0.1, "{one}");

    let towed = held::Towed { m: 1.0, g: 9.81, l: 2.0, speed: 0.4 };
    let start = towed.state().y(-2.0).x_rate(0.4).build().unwrap();
    let error = towed.equilibrium(&start).unwrap_err();
    assert!(matches!(error, EquilibriumError::Moving { row: "rope", .. }), "{error}");
    let error = towed.equilibria(start).at(0.0).run().unwrap_err();
    assert!(matches!(error, EquilibriumError::Moving { row: "rope", .. }), "{error}");
    let still = held::Towed { speed: 0.0, ..towed };
    let one = still.equilibrium(&still.state().x(1.2).y(-1.6).build().unwrap()).unwrap();
    assert!(one.state.x().abs() < 1e-15 && (one.reactions[0].multipliers[0] + 9.81).abs() < 1e-13, "{one}");
}

//! Nonlinear modes: families of closed motions against elliptic integrals, series and other coordinates.

use std::f64::consts::TAU;

use dynamics::analysis::BackboneError;
use dynamics::prelude::*;

use super::double_pendulum::DoublePendulum;

/// Two springs of the third power with one between, a pendulum in the plane, and what is damped.
mod springs {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: [_; 2])]
    pub(super) struct Pair {
        pub(super) k: f64,
        pub(super) between: f64,
        pub(super) cubic: f64,
    }
    #[dynamics]
    impl Pair {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * (q.x[0].dt().powi(2) + q.x[1].dt().powi(2))
        }
        #[potential]
        fn springs(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.k * (q.x[0].powi(2) + q.x[1].powi(2))
                + 0.5 * self.between * (q.x[1] - q.x[0]).powi(2)
                + 0.25 * self.cubic * (q.x[0].powi(4) + q.x[1].powi(4))
        }
    }

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: m, y: m)]
    #[units(m: kg, l: m, g: m / s^2)]
    pub(super) struct Plane {
        pub(super) m: f64,
        pub(super) l: f64,
        pub(super) g: f64,
    }
    #[dynamics]
    impl Plane {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m * vec2(q.x, q.y).dt().norm_squared()
        }
        #[potential]
        fn weight(&self, q: &Coordinates<Self>) -> Expr {
            self.m * self.g * q.y
        }
        #[holonomic]
        fn rod(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * (vec2(q.x, q.y).norm_squared() - self.l.powi(2))
        }
    }

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x)]
    pub(super) struct Damped {
        pub(super) drag: f64,
    }
    #[dynamics]
    impl Damped {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * q.x.dt().powi(2)
        }
        #[potential]
        fn spring(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * q.x.powi(2)
        }
        #[dissipation]
        fn damper(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.drag * q.x.dt().powi(2)
        }
    }
}
use springs::{Damped, Pair, Plane};

/// The arithmetic-geometric mean.
fn agm(mut a: f64, mut b: f64) -> f64 {
    for _ in 0..40 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    a
}

/// The frequency of ẍ + κ x + μ x³ = 0 at an energy: ω = π √(κ + μ a²)/(2 K(m)), m = μ a²/(2 (κ + μ a²)).
fn duffing(kappa: f64, mu: f64, energy: f64) -> f64 {
    // ½ κ a² + ¼ μ a⁴ = E.
    let square = if mu == 0.0 {
        2.0 * energy / kappa
    } else {
        ((kappa * kappa + 4.0 * mu * energy).sqrt() - kappa) / mu
    };
    let m = 0.5 * mu * square / (kappa + mu * square);
    (kappa + mu * square).sqrt() * agm(1.0, (1.0 - m).sqrt())
}

#[test]
fn both_modes_of_two_equal_springs_stay_straight() {
    // x₁ = ±x₂ = y: ÿ + (k + 2c·[−]) y + μ y³ = 0, and 2 of them share the energy (R. M. Rosenberg, 1962).
    let model = Pair { k: 1.0, between: 0.4, cubic: 0.5 };
    let rest = model.state().build().unwrap();
    for (mode, kappa, sign) in [(0, 1.0, 1.0), (1, 1.8, -1.0)] {
        let curve = model.nonlinear_mode(&rest, mode).until(8.0).points(8).run().unwrap();
        let last = curve.points.last().unwrap().energy;
        assert!((last - 8.0).abs() < 1e-7, "{last}");
        for point in &curve.points {
            let wanted = duffing(kappa, 0.5, 0.5 * point.energy);
            assert!((point.frequency / wanted - 1.0).abs() < 1e-9, "{mode}: {} {wanted}", point.frequency);
            let x = [0, 1].map(|i| point.orbit.start.x(i));
            assert!((x[0] - sign * x[1]).abs() < 1e-7 * (1.0 + x[0].abs()), "{mode}: {x:?}");
        }
    }
}

#[test]
fn a_pendulum_by_its_rod_up_to_near_the_top() {
    let model = Plane { m: 0.7, l: 1.3, g: 9.81 };
    let rest = model.state().y(-1.3).build().unwrap();
    let top = 2.0 * 0.7 * 9.81 * 1.3;
    let curve = model.nonlinear_mode(&rest, 0).until(0.95 * top).points(8).run().unwrap();
    for point in &curve.points {
        // E = 2 m g l sin²(θ/2): k² = E/E_top.
        let wanted = (9.81_f64 / 1.3).sqrt() * agm(1.0, (1.0 - point.energy / top).sqrt());
        assert!((point.frequency / wanted - 1.0).abs() < 1e-8, "{} {wanted}", point.frequency);
    }
    // At the top the period has no end: the family stops below it, and what there is of it is in the error.
    let error = model.nonlinear_mode(&rest, 0).until(1.2 * top).points(12).run().unwrap_err();
    let BackboneError::Stopped { energy, ref curve, .. } = error else { panic!("{error}") };
    assert!(energy > 0.9 * top && energy < top && curve.points.len() > 6, "{error}");
}

#[test]
fn modes_of_a_double_pendulum_begin_with_the_linear_ones() {
    let model = DoublePendulum { m1: 1.0, m2: 1.0, l1: 1.0, l2: 1.0, g: 9.81 };
    let rest = model.state().build().unwrap();
    for (mode, square) in [(0, 2.0 - 2f64.sqrt()), (1, 2.0 + 2f64.sqrt())] {
        let curve = model.nonlinear_mode(&rest, mode).until(6.0).points(6).run().unwrap();
        let linear = (square * 9.81).sqrt();
        assert!((curve.points[0].frequency / linear - 1.0).abs() < 1e-5, "{curve}");
        // ω falls with the energy, at first in proportion to it.
        let slopes: Vec<f64> = curve.points[1..4].iter().map(|p| (p.frequency - linear) / p.energy).collect();
        assert!(slopes.iter().all(|s| *s < 0.0) && (slopes[0] / slopes[1] - 1.0).abs() < 0.15, "{slopes:?}");
        for point in &curve.points {
            // Each closes, in a simulation of another method.
            let period = TAU / point.frequency;
            let end = model
                .simulate(point.orbit.start)
                .until(point.orbit.start.t + period)
                .tolerance(1e-11)
                .run()
                .unwrap()
                .end();
            assert!((end.theta1() - point.orbit.start.theta1()).abs() < 1e-7, "{curve}");
            assert!((end.theta2() - point.orbit.start.theta2()).abs() < 1e-7, "{curve}");
        }
    }
}

#[test]
fn what_begins_no_family_is_refused() {
    let model = Pair { k: 1.0, between: 0.4, cubic: 0.5 };
    let rest = model.state().build().unwrap();
    for (energy, points) in [(0.0, 12), (f64::NAN, 12), (-1.0, 12), (1.0, 3)] {
        let error = model.nonlinear_mode(&rest, 0).until(energy).points(points).run().unwrap_err();
        assert!(matches!(error, BackboneError::Option { .. }), "{error}");
    }
    let error = model.nonlinear_mode(&rest, 2).until(1.0).run().unwrap_err();
    assert!(matches!(error, BackboneError::NoMode { mode: 2, count: 2 }), "{error}");
    let moving = model.state().x([1.0, 0.0]).build().unwrap();
    let error = model.nonlinear_mode(&moving, 0).until(1.0).run().unwrap_err();
    assert!(matches!(error, BackboneError::Rest(_)), "{error}");
    let over = Pair { k: -1.0, ..model };
    let error = over.nonlinear_mode(&over.state().build().unwrap(), 1).until(1.0).run().unwrap_err();
    assert!(matches!(error, BackboneError::DoesNotSwing { .. }), "{error}");
    // Two masses that nothing holds: of one energy there is a motion for each momentum.
    let loose = Pair { k: 0.0, ..model };
    let loose = Pair { cubic: 0.0, ..loose };
    let error = loose.nonlinear_mode(&loose.state().build().unwrap(), 1).until(1.0).run().unwrap_err();
    assert!(
        matches!(error, BackboneError::Stopped { .. }) && error.to_string().contains("momentum"),
        "{error}"
    );
    assert!(!error.to_string().contains("hold_energy"), "{error}");
    let damped = Damped { drag: 0.1 };
    let error = damped.nonlinear_mode(&damped.state().build().unwrap(), 0).until(1.0).run().unwrap_err();
    assert!(matches!(error, BackboneError::NotConserved), "{error}");
}

//! Small motions of derived models beside equilibria and steady motions: matrices against closed forms,
//! eigenvalues against published ones, reduced equations against differences of the constrained motion, and
//! what is refused.

use crate::parallelogram;
use crate::rolling_disk as disk;
use crate::turned_hoop;
use crate::two_bars;
use crate::ziegler;

use dynamics::analysis::{LinearizeError, Mode};
use dynamics::prelude::*;
use nalgebra::{Complex, DMatrix, DVector};
use parallelogram::Parallelogram;
use turned_hoop::TurnedHoop;
use two_bars::TwoBars;
use ziegler::Ziegler;

/// A bob on a massless rod: in an angle, and in the plane with a constraint.
mod pendulum {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(theta: rad)]
    #[inputs(torque: N * m)]
    #[units(mass: kg, length: m, drag: N * m * s, g: m / s^2)]
    pub(super) struct Angle {
        pub(super) mass: f64,
        pub(super) length: f64,
        pub(super) drag: f64,
        pub(super) g: f64,
    }
    #[dynamics]
    impl Angle {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.mass * (self.length * q.theta.dt()).powi(2)
        }
        #[potential]
        fn weight(&self, q: &Coordinates<Self>) -> Expr {
            -self.mass * self.g * self.length * q.theta.cos()
        }
        #[dissipation]
        fn pivot(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.drag * q.theta.dt().powi(2)
        }
        #[force]
        fn motor(&self, q: &Coordinates<Self>) -> Force {
            Force::along(q.theta, q.torque)
        }
    }

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: m, y: m)]
    #[units(mass: kg, length: m, g: m / s^2)]
    pub(super) struct Cartesian {
        pub(super) mass: f64,
        pub(super) length: f64,
        pub(super) g: f64,
    }
    #[dynamics]
    impl Cartesian {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared()
        }
        #[potential]
        fn weight(&self, q: &Coordinates<Self>) -> Expr {
            self.mass * self.g * q.y
        }
        #[holonomic]
        fn rod(&self, q: &Coordinates<Self>) -> Expr {
            vec2(q.x, q.y).norm_squared() - self.length.powi(2)
        }
    }
}

#[test]
fn a_pendulum_hanging_and_on_its_head() {
    let model = pendulum::Angle { mass: 2.0, length: 0.5, drag: 0.3, g: 9.81 };
    let hanging = model.linearize(&model.state().torque(0.0).build().unwrap()).unwrap();
    assert_eq!((hanging.coordinates[0].name, hanging.velocities[0].name), ("theta", "theta"));
    let scalars = [&hanging.mass, &hanging.damping, &hanging.stiffness, &hanging.input].map(|m| m[(0, 0)]);
    assert_eq!(scalars, [0.5, 0.3, 2.0 * 9.81 * 0.5, 1.0]);
    let modes = hanging.modes().unwrap();
    assert_eq!(modes.len(), 1);
    let natural = (9.81f64 / 0.5).sqrt();
    assert!((modes[0].frequency() - natural).abs() < 1e-14 * natural);
    assert!((modes[0].damping_ratio() - 0.3 / (2.0 * 0.5 * natural)).abs() < 1e-15, "{}", modes[0]);
    let up = model.state().theta(std::f64::consts::PI).torque(0.0).build().unwrap();
    let found = model.linearize(&up).unwrap().eigenvalues().unwrap();
    let half = 0.3 / (2.0 * 0.5);
    for (found, sign) in found.iter().zip([-1.0, 1.0]) {
        let wanted = -half + sign * (half * half + 9.81 / 0.5).sqrt();
        assert!((found - Complex::new(wanted, 0.0)).norm() < 1e-14, "{found}");
    }
}

/// λ holds the bob: its part of the stiffness is all there is in Cartesian coordinates.
#[test]
fn the_same_in_coordinates_with_a_constraint() {
    let model = pendulum::Cartesian { mass: 2.0, length: 0.5, g: 9.81 };
    for (y, square) in [(-0.5, 9.81 / 0.5), (0.5, -9.81 / 0.5)] {
        let linear = model.linearize(&model.state().y(y).build().unwrap()).unwrap();
        assert_eq!(linear.coordinates[0].name, "x");
        assert!(
            (linear.stiffness[(0, 0)] - 2.0 * square).abs() < 1e-14
                && (linear.mass[(0, 0)] - 2.0).abs() < 1e-15
        );
        let wanted = if square > 0.0 {
            Complex::new(0.0, square.sqrt())
        } else {
            Complex::new(square.abs().sqrt(), 0.0)
        };
        let found = linear.eigenvalues().unwrap();
        assert!((found[1] - wanted).norm() < 1e-14, "{found:?}");
    }
    // Tilted, there is no equilibrium: matrices, but no eigenvalues.
    let tilted = model.linearize(&model.state().x(0.3).y(-0.4).build().unwrap()).unwrap();
    assert!(matches!(tilted.eigenvalues(), Err(LinearizeError::Accelerates { .. })), "{tilted:?}");
    assert!(
        tilted.eigenvalues().unwrap_err().to_string().contains("neither an equilibrium nor a steady motion")
    );
}

mod double_pendulum {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(theta: [rad; 2])]
    #[units(m: kg, l: m, g: m / s^2)]
    pub(super) struct Angles {
        pub(super) m: [f64; 2],
        pub(super) l: [f64; 2],
        pub(super) g: f64,
    }
    #[dynamics]
    impl Angles {
        fn bobs(&self, q: &Coordinates<Self>) -> [Vec2; 2] {
            let first = self.l[0] * vec2(q.theta[0].sin(), -q.theta[0].cos());
            [first, first + self.l[1] * vec2(q.theta[1].sin(), -q.theta[1].cos())]
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            let [a, b] = self.bobs(q);
            0.5 * self.m[0] * a.dt().norm_squared() + 0.5 * self.m[1] * b.dt().norm_squared()
        }
        #[potential]
        fn weight(&self, q: &Coordinates<Self>) -> Expr {
            let [a, b] = self.bobs(q);
            self.g * (self.m[0] * a.y + self.m[1] * b.y)
        }
    }

    /// Bobs in the plane, rods as constraints, and one rod twice.
    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: [m; 2], y: [m; 2])]
    #[units(m: kg, l: m, g: m / s^2)]
    pub(super) struct Bobs {
        pub(super) m: [f64; 2],
        pub(super) l: [f64; 2],
        pub(super) g: f64,
    }
    #[dynamics]
    impl Bobs {
        fn bobs(&self, q: &Coordinates<Self>) -> [Vec2; 2] {
            [vec2(q.x[0], q.y[0]), vec2(q.x[1], q.y[1])]
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            let [a, b] = self.bobs(q);
            0.5 * self.m[0] * a.dt().norm_squared() + 0.5 * self.m[1] * b.dt().norm_squared()
        }
        #[potential]
        fn weight(&self, q: &Coordinates<Self>) -> Expr {
            self.g * (self.m[0] * q.y[0] + self.m[1] * q.y[1])
        }
        #[holonomic]
        fn rods(&self, q: &Coordinates<Self>) -> [Expr; 2] {
            let [a, b] = self.bobs(q);
            [a.norm_squared() - self.l[0].powi(2), (b - a).norm_squared() - self.l[1].powi(2)]
        }
        #[holonomic]
        #[redundant]
        fn again(&self, q: &Coordinates<Self>) -> Expr {
            let [a, _] = self.bobs(q);
            a.norm() - self.l[0]
        }
    }
}

#[test]
fn a_double_pendulum() {
    let (m, l, g) = ([1.5, 0.7], [0.8, 1.1], 9.81);
    let model = double_pendulum::Angles { m, l, g };
    let linear = model.linearize(&model.state().build().unwrap()).unwrap();
    let coupling = m[1] * l[0] * l[1];
    let mass =
        DMatrix::from_row_slice(2, 2, &[(m[0] + m[1]) * l[0] * l[0], coupling, coupling, m[1] * l[1] * l[1]]);
    let stiffness = DMatrix::from_row_slice(2, 2, &[(m[0] + m[1]) * g * l[0], 0.0, 0.0, m[1] * g * l[1]]);
    assert!((&linear.mass - mass).amax() < 1e-15 && (&linear.stiffness - stiffness).amax() < 2e-15);
    assert!(linear.damping.amax() == 0.0);
    // ω⁴ (det M) − ω² (..) + det K = 0, solved without cancellation.
    let total = m[0] + m[1];
    let (a, b, c) = (m[0] * l[0] * l[1], -total * g * (l[0] + l[1]), total * g * g);
    let larger = (-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a);
    let wanted = [(c / (a * larger)).sqrt(), larger.sqrt()];
    let modes = linear.modes().unwrap();
    for (mode, wanted) in modes.iter().zip(wanted) {
        assert!((mode.frequency() - wanted).abs() < 1e-14 * wanted, "{mode}");
        assert_eq!(mode.conditioning, 1.0);
    }
    // In phase first, against each other then.
    let ratio = |mode: &Mode| (mode.of("theta[0]").unwrap() / mode.of("theta[1]").unwrap()).re;
    assert!(ratio(&modes[0]) > 0.0 && ratio(&modes[1]) < 0.0);

    let bobs = double_pendulum::Bobs { m, l, g };
    let hanging = bobs.state().y([-l[0], -l[0] - l[1]]).build().unwrap();
    let linear = bobs.linearize(&hanging).unwrap();
    assert_eq!(linear.coordinates.iter().map(|q| q.name).collect::<Vec<_>>(), ["x[0]", "x[1]"]);
    for (mode, wanted) in linear.modes().unwrap().iter().zip(wanted) {
        assert!((mode.frequency() - wanted).abs() < 1e-13 * wanted, "{mode}");
        assert!(mode.of("y[0]").unwrap().norm() < 1e-15);
    }
}

/// Masses on springs between two walls; Rayleigh, *Theory of Sound*.
mod chain {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: [m; 10])]
    #[units(m: kg, k: N / m)]
    pub(super) struct Chain {
        pub(super) m: f64,
        pub(super) k: f64,
        /// 1 where the far end is held, 0 where it is free.
        pub(super) held: f64,
    }
    #[dynamics]
    impl Chain {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            let mut sum = Expr::ZERO;
            for i in 0..10 {
                sum += 0.5 * self.m * q.x[i].dt().powi(2);
            }
            sum
        }
        #[potential]
        fn springs(&self, q: &Coordinates<Self>) -> Expr {
            let mut sum = q.x[0].powi(2) + self.held * q.x[9].powi(2);
            for i in 1..10 {
                sum += (q.x[i] - q.x[i - 1]).powi(2);
            }
            0.5 * self.k * sum
        }
    }
}

#[test]
fn a_chain_of_masses() {
    for (held, factor) in [(1.0, 11.0), (0.0, 10.5)] {
        let model = chain::Chain { m: 2.0, k: 50.0, held };
        let modes = model.linearize(&model.state().build().unwrap()).unwrap().modes().unwrap();
        for (j, mode) in modes.iter().enumerate() {
            let j = if held > 0.0 { j as f64 + 1.0 } else { j as f64 + 0.5 };
            let wanted = 2.0 * 5.0 * (0.5 * j * std::f64::consts::PI / factor).sin();
            assert!((mode.frequency() - wanted).abs() < 1e-13 * wanted, "{wanted}: {mode}");
        }
    }
}

#[test]
fn a_follower_force() {
    let at = |p: f64, c: f64| {
        let model = Ziegler { follows: 1.0, m: 1.0, l: 1.0, k: 1.0, c, p };
        model.linearize(&model.state().build().unwrap()).unwrap()
    };
    let linear = at(1.3, 0.0);
    let wanted = DMatrix::from_row_slice(2, 2, &[2.0 - 1.3, 1.3 - 1.0, -1.0, 1.0]);
    assert!((&linear.stiffness - wanted).amax() < 1e-15);
    assert!((linear.circulatory().unwrap()[(0, 1)] - 0.65).abs() < 1e-15);
    let quiet = at(2.0, 0.0).eigenvalues().unwrap();
    for (found, wanted) in quiet.iter().zip([-1.0, -0.5f64.sqrt(), 0.5f64.sqrt(), 1.0]) {
        assert!((found - Complex::new(0.0, wanted)).norm() < 1e-14, "{quiet:?}");
    }
    let flutter = at(2.2, 0.0).eigenvalues().unwrap();
    let (re, im) = (0.16897748546263128, 0.8237435223376715);
    for (found, wanted) in flutter.iter().zip([(-re, -im), (-re, im), (re, -im), (re, im)]) {
        assert!((found - Complex::new(wanted.0, wanted.1)).norm() < 1e-13, "{flutter:?}");
    }
    // Damping of both joints alike brings flutter from 2.0858 down to 41/28 + c²/2.
    let growth =
        |p: f64, c: f64| at(p, c).eigenvalues().unwrap().iter().map(|x| x.re).fold(f64::MIN, f64::max);
    for (c, critical) in [(1e-3, 1.4642862142857143), (0.1, 1.4692857142857143), (1.0, 1.9642857142857142)] {
        let (mut low, mut high) = (1.0, 2.5);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            *(if growth(middle, c) > 0.0 { &mut high } else { &mut low }) = middle;
        }
        assert!((low - critical).abs() < 1e-10, "c = {c}: {low} instead of {critical}");
    }
    // Where frequencies meet the matrix is defective: half of the digits, and the modes say so.
    let modes = at(3.5 - 2.0f64.sqrt(), 0.0).modes().unwrap();
    assert!(
        modes
            .iter()
            .all(|mode| mode.conditioning > 1e6 && (mode.frequency() - 0.5f64.powf(0.25)).abs() < 1e-7)
    );
}

/// A disk on a flexible shaft with damping that turns along; D. M. Smith, Proc. R. Soc. A 142 (1933) 92.
mod rotor {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: m, y: m)]
    #[units(m: kg, k: N / m, outside: N * s / m, inside: N * s / m, speed: rad / s)]
    pub(super) struct Rotor {
        pub(super) m: f64,
        pub(super) k: f64,
        pub(super) outside: f64,
        pub(super) inside: f64,
        pub(super) speed: f64,
    }
    #[dynamics]
    impl Rotor {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m * vec2(q.x, q.y).dt().norm_squared()
        }
        #[potential]
        fn shaft(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.k * vec2(q.x, q.y).norm_squared()
        }
        #[dissipation]
        fn bearings(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.outside * vec2(q.x, q.y).dt().norm_squared()
        }
        #[force]
        fn shaft_damping(&self, q: &Coordinates<Self>) -> Force {
            let slip = vec2(q.x.dt() + self.speed * q.y, q.y.dt() - self.speed * q.x);
            Force::at(vec2(q.x, q.y), -self.inside * slip)
        }
    }
}

#[test]
fn a_rotor_with_damping_that_turns_along() {
    for (speed, growth) in
        [(20.0, -0.04997750520387463), (26.0, 0.00999337473186844), (40.0, 0.1498054532229453)]
    {
        let model = rotor::Rotor { m: 1.0, k: 100.0, outside: 0.3, inside: 0.2, speed };
        let linear = model.linearize(&model.state().build().unwrap()).unwrap();
        assert!((linear.circulatory().unwrap()[(0, 1)] - 0.2 * speed).abs() < 1e-14);
        assert!(linear.gyroscopic().amax() == 0.0 && (linear.dissipative()[(0, 0)] - 0.5).abs() < 1e-15);
        let found = linear.eigenvalues().unwrap();
        assert!((found[3].re - growth).abs() < 1e-13, "{found:?}");
    }
}

/// A bead on a hoop that is turned, as a point with two constraints, one of which moves.
mod hoop {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: m, y: m, z: m)]
    #[units(m: kg, g: m / s^2, radius: m, speed: rad / s)]
    pub(super) struct Turned {
        pub(super) m: f64,
        pub(super) g: f64,
        pub(super) radius: f64,
        pub(super) speed: f64,
    }
    #[dynamics]
    impl Turned {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m * vec3(q.x, q.y, q.z).dt().norm_squared()
        }
        #[potential]
        fn weight(&self, q: &Coordinates<Self>) -> Expr {
            self.m * self.g * q.z
        }
        #[holonomic]
        fn sphere(&self, q: &Coordinates<Self>) -> Expr {
            vec3(q.x, q.y, q.z).norm_squared() - self.radius.powi(2)
        }
        #[holonomic]
        fn plane(&self, q: &Coordinates<Self>) -> Expr {
            let angle = self.speed * q.t;
            q.x * angle.sin() - q.y * angle.cos()
        }
    }
}

#[test]
fn a_bead_on_a_hoop_that_is_turned() {
    let model = TurnedHoop { m: 0.1, g: 9.81, radius: 0.5, speed: 6.0, drag: 0.0 };
    let theta = 0.9944072120586995f64;
    let modes = model.linearize(&model.state().theta(theta).build().unwrap()).unwrap().modes().unwrap();
    assert!((modes[0].eigenvalue - Complex::new(0.0, 5.030616264435203)).norm() < 1e-13, "{:?}", modes[0]);
    let bottom = model.linearize(&model.state().build().unwrap()).unwrap().eigenvalues().unwrap();
    assert!((bottom[1] - Complex::new(4.047221268969612, 0.0)).norm() < 1e-13, "{bottom:?}");

    // In coordinates of the world the same equilibrium is a circle, beside which coefficients turn: refused,
    // the instant's matrices are given.
    let model = hoop::Turned { m: 0.1, g: 9.81, radius: 0.5, speed: 6.0 };
    let (s, c) = theta.sin_cos();
    let start = model.state().x(0.5 * s).z(-0.5 * c).y_rate(0.5 * s * 6.0).build().unwrap();
    let linear = model.linearize(&start).unwrap();
    let refused = linear.eigenvalues();
    assert!(
        matches!(refused, Err(LinearizeError::Accelerates { .. } | LinearizeError::Varies { .. })),
        "{refused:?}"
    );
}

/// A sleigh on a skate: steady straight on, where the center of mass is in front it steers back, behind it
/// turns round (Neimark & Fufaev, *Dynamics of Nonholonomic Systems*, chapter 3).
mod sleigh {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: m, y: m, phi: rad)]
    #[units(m: kg, inertia: kg * m^2, ahead: m)]
    pub(super) struct Sleigh {
        pub(super) m: f64,
        pub(super) inertia: f64,
        /// From the skate to the center of mass.
        pub(super) ahead: f64,
    }
    #[dynamics]
    impl Sleigh {
        fn center(&self, q: &Coordinates<Self>) -> Vec2 {
            vec2(q.x, q.y) + self.ahead * vec2(q.phi.cos(), q.phi.sin())
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m * self.center(q).dt().norm_squared() + 0.5 * self.inertia * q.phi.dt().powi(2)
        }
        #[nonholonomic]
        fn skate(&self, q: &Coordinates<Self>) -> Expr {
            q.y.dt() * q.phi.cos() - q.x.dt() * q.phi.sin()
        }
    }
}

#[test]
fn a_sleigh() {
    for (speed, heading) in [(1.3, 0.0), (-0.7, 0.0), (1.3, 0.8f64)] {
        let model = sleigh::Sleigh { m: 1.0, inertia: 0.1, ahead: 0.2 };
        let start = model.state().phi(heading).x_rate(speed * heading.cos()).y_rate(speed * heading.sin());
        let linear = model.linearize_in(&start.build().unwrap(), &["x", "phi"]).unwrap();
        assert_eq!(linear.velocities.iter().map(|q| q.name).collect::<Vec<_>>(), ["x", "phi"]);
        assert_eq!(linear.coordinates.len(), 3);
        // (I + m a²) ω̇ = −m a v ω; everything else only counts what happens.
        let rate = -0.2 * speed / (0.1 + 0.2f64.powi(2));
        let mut wanted = [rate, 0.0, 0.0, 0.0, 0.0];
        wanted.sort_by(f64::total_cmp);
        let found = linear.eigenvalues().unwrap();
        assert_eq!(found.len(), 5);
        for (found, wanted) in found.iter().zip(wanted) {
            assert!((found - Complex::new(wanted, 0.0)).norm() < 2e-15 * rate.abs(), "{found:?}");
        }
    }
}

mod differences;

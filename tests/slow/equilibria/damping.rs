//! Verdicts where dampers reach not every mode, and where a constraint turns the axes.

use dynamics::analysis::{StabilityVerdict, Undecided};
use dynamics::prelude::*;
use nalgebra::Complex;

/// Two masses between walls, with springs, and dampers at a wall and in the middle.
mod pair {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: [m; 2])]
    #[units(m: kg, k: N / m, wall: N * s / m, middle: N * s / m, square: N * s^2 / m^2)]
    pub(super) struct Pair {
        pub(super) m: f64,
        pub(super) k: [f64; 3],
        pub(super) wall: f64,
        pub(super) middle: f64,
        /// Of drag by the square of the velocity.
        pub(super) square: f64,
    }
    #[dynamics]
    impl Pair {
        fn stretches(&self, q: &Coordinates<Self>) -> [Expr; 3] {
            [q.x[0], q.x[1] - q.x[0], q.x[1]]
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m * (q.x[0].dt().powi(2) + q.x[1].dt().powi(2))
        }
        #[potential]
        fn springs(&self, q: &Coordinates<Self>) -> Expr {
            let [a, b, c] = self.stretches(q);
            0.5 * (self.k[0] * a.powi(2) + self.k[1] * b.powi(2) + self.k[2] * c.powi(2))
        }
        #[dissipation]
        fn dampers(&self, q: &Coordinates<Self>) -> Expr {
            let [a, b, _] = self.stretches(q);
            0.5 * (self.wall * a.dt().powi(2) + self.middle * b.dt().powi(2))
        }
        #[force]
        fn drag(&self, q: &Coordinates<Self>) -> Force {
            Force::along(q.x[0], -self.square * q.x[0].dt().abs() * q.x[0].dt())
        }
    }
    pub(super) const PAIR: Pair = Pair { m: 2.0, k: [8.0; 3], wall: 0.0, middle: 0.0, square: 0.0 };
}

/// Kelvin, Tait & Chetaev: stable wherever V is least and dampers take energy; asymptotically so if every
/// mode reaches one.
#[test]
fn damping_that_reaches_not_every_mode() {
    use pair::{PAIR, Pair};
    let of = |model: &Pair| model.stability(&model.state().build().unwrap()).unwrap();
    let at_wall = of(&Pair { wall: 0.3, ..PAIR });
    assert_eq!(at_wall.verdict, StabilityVerdict::AsymptoticallyStable, "{at_wall}");
    // Between equal masses on equal springs the damper is not moved where they swing together, at √(k/m);
    // opposed, m s² + 2 c s + 3 k = 0.
    let middle = of(&Pair { middle: 0.3, ..PAIR });
    let StabilityVerdict::PartlyDamped { frequency, .. } = middle.verdict else { panic!("{middle}") };
    assert!((frequency - 2.0).abs() < 1e-14 && middle.is_stable() && !middle.is_unstable(), "{middle}");
    let wanted = Complex::new(-0.15, (12.0_f64 - 0.0225).sqrt());
    assert!(middle.eigenvalues.iter().any(|x| (x - wanted).norm() < 1e-14), "{:?}", middle.eigenvalues);
    assert!(middle.to_string().contains("the mode at 2.000000 rad/s"), "{middle}");
    // As soon as the springs differ by more than digits, it is: by about (δk/k)² of the damper.
    let uneven = of(&Pair { middle: 0.3, k: [8.0, 8.0, 8.0 * (1.0 + 1e-4)], ..PAIR });
    assert_eq!(uneven.verdict, StabilityVerdict::AsymptoticallyStable, "{uneven}");
    // Drag by the square is none to first order, and takes energy all the same; as a drive it gives some.
    let square = of(&Pair { square: 0.5, ..PAIR });
    assert!(matches!(square.verdict, StabilityVerdict::PartlyDamped { .. }), "{square}");
    for driven in [Pair { square: -0.5, ..PAIR }, Pair { square: -1e-9, middle: 0.3, ..PAIR }] {
        let judged = of(&driven);
        assert!(matches!(judged.verdict, StabilityVerdict::Marginal(Undecided::Swings { .. })), "{judged}");
    }
    // A drive below the digits of eigenvalues is seen in the matrix.
    let judged = of(&Pair { wall: -1e-18, ..PAIR });
    assert!(!judged.is_stable() && !judged.is_unstable(), "{judged}");
    let judged = of(&Pair { wall: -0.1, middle: 0.3, ..PAIR });
    assert!(matches!(judged.verdict, StabilityVerdict::Flutter { .. }), "{judged}");
    // Without a spring at the walls nothing holds the two together; on hills they leave.
    let judged = of(&Pair { middle: 0.3, k: [0.0, 8.0, 0.0], ..PAIR });
    assert!(!judged.is_stable(), "{judged}");
    let judged = of(&Pair { middle: 0.3, k: [-1.0, 8.0, -1.0], ..PAIR });
    assert!(matches!(judged.verdict, StabilityVerdict::Divergence { .. }), "{judged}");
    // Growth that is small has its digits.
    let slow = of(&Pair { wall: -4e-9, middle: 0.3, ..PAIR }).to_string();
    assert!(slow.contains("e-10 t)"), "{slow}");
}

/// A mass on a shaft of two stiffnesses, in axes that a constraint turns: φ = Ωt.
mod shaft {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: m, y: m, phi: rad)]
    #[units(m: kg, k: N / m, drag: N * s / m, inertia: kg * m^2, speed: rad / s, wobble: rad, g: m / s^2)]
    pub(super) struct Shaft {
        pub(super) m: f64,
        pub(super) k: [f64; 2],
        pub(super) drag: f64,
        pub(super) inertia: f64,
        pub(super) speed: f64,
        /// An unevenness of the drive.
        pub(super) wobble: f64,
        pub(super) g: f64,
    }
    #[dynamics]
    impl Shaft {
        fn place(&self, q: &Coordinates<Self>) -> Vec2 {
            let (s, c) = (q.phi.sin(), q.phi.cos());
            vec2(q.x * c - q.y * s, q.x * s + q.y * c)
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m * self.place(q).dt().norm_squared() + 0.5 * self.inertia * q.phi.dt().powi(2)
        }
        #[potential]
        fn springs(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * (self.k[0] * q.x.powi(2) + self.k[1] * q.y.powi(2)) + self.m * self.g * self.place(q).y
        }
        #[dissipation]
        fn inside(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.drag * (q.x.dt().powi(2) + q.y.dt().powi(2))
        }
        #[holonomic]
        fn turned(&self, q: &Coordinates<Self>) -> Expr {
            q.phi - self.speed * q.t - self.wobble * (3.0 * self.speed * q.t).sin()
        }
    }
    pub(super) const SHAFT: Shaft =
        Shaft { m: 1.0, k: [1.0, 4.0], drag: 0.0, inertia: 0.2, speed: 0.0, wobble: 0.0, g: 0.0 };
}

/// λ⁴ + (5 + 2Ω²) λ² + (1 − Ω²)(4 − Ω²) = 0 with m = 1, k = 1 and 4: least energy of Jacobi below Ω = 1, a
/// saddle up to 2, and its top beyond, held by Coriolis forces.
#[test]
fn what_a_constraint_turns_is_judged_in_axes_that_turn() {
    use shaft::{SHAFT, Shaft};
    let of = |speed: f64, drag: f64| {
        let model = Shaft { speed, drag, ..SHAFT };
        let one = model.steady(&model.state().phi_rate(speed).build().unwrap()).unwrap();
        model.stability(&one.state).unwrap()
    };
    for speed in [0.1, 0.5, 1.0 - 1e-9] {
        let judged = of(speed, 0.0);
        assert_eq!(judged.verdict, StabilityVerdict::Stable, "{speed}: {judged}");
        let least = judged.least_omega_squared.unwrap();
        assert!((least - (1.0 - speed * speed)).abs() < 1e-15, "{speed}: {judged}");
    }
    for speed in [1.0 + 1e-9, 1.5, 2.0 - 1e-9] {
        let judged = of(speed, 0.0);
        let StabilityVerdict::Divergence { growth, .. } = judged.verdict else { panic!("{speed}: {judged}") };
        let (b, c) = (5.0 + 2.0 * speed * speed, (1.0 - speed * speed) * (4.0 - speed * speed));
        let wanted = (-2.0 * c / (b + (b * b - 4.0 * c).sqrt())).sqrt();
        assert!((growth / wanted - 1.0).abs() < 1e-6, "{speed}: {judged}");
    }
    for speed in [2.0 + 1e-6, 3.0, 10.0] {
        let judged = of(speed, 0.0);
        assert_eq!(judged.verdict, StabilityVerdict::GyroscopicallyStabilised, "{speed}: {judged}");
        // Damping that turns along undoes it.
        let judged = of(speed, 0.01);
        assert!(judged.is_unstable(), "{speed}: {judged}");
    }
    assert_eq!(of(0.5, 0.1).verdict, StabilityVerdict::AsymptoticallyStable);
    for speed in [1.0, 2.0] {
        let judged = of(speed, 0.0);
        assert!(matches!(judged.verdict, StabilityVerdict::Marginal(_)), "{speed}: {judged}");
    }
    // A drive that is not even leaves nothing steady; nor does weight across the axis.
    for uneven in [Shaft { speed: 0.5, wobble: 0.1, ..SHAFT }, Shaft { speed: 0.5, g: 9.81, ..SHAFT }] {
        let start = uneven.state().phi_rate(uneven.speed * (1.0 + 3.0 * uneven.wobble)).build().unwrap();
        assert!(uneven.steady(&start).is_err() && uneven.stability(&start).is_err());
    }
}

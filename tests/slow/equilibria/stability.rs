//! Verdicts on equilibria and steady motions against published thresholds, on both sides and as near as
//! digits allow.

use std::f64::consts::PI;

use dynamics::analysis::{Equilibrium, EquilibriumError, LinearizeError, StabilityVerdict, Undecided};
use dynamics::error::SolveError;
use dynamics::prelude::*;

use super::free_hoop::FreeHoop;
use super::hencky::Hencky;
use super::turned_hoop::TurnedHoop;
use super::ziegler::Ziegler;
use super::{pendulum, plane, top, truss};

fn verdict<M: Simulate>(model: &M, state: &M::State) -> StabilityVerdict {
    model.stability(state).unwrap().verdict
}

#[test]
fn a_double_pendulum_and_a_truss() {
    let model = pendulum::Angles { m: 1.5, l: 0.8, g: 9.81 };
    let found = model.equilibria(model.state().torque(0.0).build().unwrap()).random(30).run().unwrap();
    for one in &found.equilibria {
        let judged = model.stability(&one.state).unwrap();
        let hangs = one.state.theta(0).abs() < 1.0 && one.state.theta(1).abs() < 1.0;
        match judged.verdict {
            StabilityVerdict::Stable => {
                assert!(hangs && judged.least_omega_squared.unwrap() > 0.0, "{one}\n{judged}")
            }
            StabilityVerdict::Divergence { growth, .. } => {
                let square = judged.least_omega_squared.unwrap();
                assert!(!hangs && (growth * growth + square).abs() < 1e-13 * square.abs(), "{one}\n{judged}");
            }
            other => panic!("{other}"),
        }
    }
    // In the plane, by constraints of which one repeats another: the same squares.
    let plane = pendulum::Plane { m: 1.5, l: 0.8, g: 9.81 };
    for y in [[-0.8, -1.6], [-0.8, 0.0], [0.8, 0.0], [0.8, 1.6]] {
        let there = plane.stability(&plane.state().y(y).build().unwrap()).unwrap();
        let theta = [if y[0] < 0.0 { 0.0 } else { PI }, if y[1] < y[0] { 0.0 } else { PI }];
        let here = model.stability(&model.state().torque(0.0).theta(theta).build().unwrap()).unwrap();
        let (a, b) = (there.least_omega_squared.unwrap(), here.least_omega_squared.unwrap());
        assert!((a - b).abs() < 1e-12 * b.abs() && there.is_stable() == here.is_stable(), "{there}\n{here}");
    }
    // Up to its limit load the truss is stable, on the branch beyond it not; in the fold itself nothing can
    // be said.
    let [limit, fold] = truss::LIMIT;
    for (part, z, wanted) in [(0.9, 0.5, 1), (0.9, 0.1, -1), (1.0 - 1e-9, 0.5, 1), (1.0, 0.5, 0)] {
        let model = truss::Truss { load: limit * part, ..truss::TRUSS };
        let one = model.equilibrium(&model.state().z(z).build().unwrap()).unwrap();
        let judged = model.stability(&one.state).unwrap();
        assert_eq!(
            i32::from(judged.is_stable()) - i32::from(judged.is_unstable()),
            wanted,
            "{part}: {one}\n{judged}"
        );
        if wanted == 0 {
            let resists = StabilityVerdict::Marginal(Undecided::NothingResists { coordinate: "z" });
            assert!(judged.verdict == resists && (one.state.z() - fold).abs() < 1e-6, "{judged}");
        }
    }
}

#[test]
fn a_bead_on_a_hoop() {
    let (m, g, radius) = (0.1, 9.81, 0.5_f64);
    let critical = (g / radius).sqrt();
    let with = |drag: f64, speed: f64, theta: f64| {
        let model = TurnedHoop { m, g, radius, speed, drag };
        model
            .stability(&model.equilibrium(&model.state().theta(theta).build().unwrap()).unwrap().state)
            .unwrap()
    };
    let driven = |speed: f64, theta: f64| with(0.0, speed, theta);
    let nothing = StabilityVerdict::Marginal(Undecided::NothingResists { coordinate: "theta" });
    // Rubbing does not make a stiffness of rounding.
    for drag in [1e-6, 0.01, 1.0] {
        for ulp in -3..=3 {
            let judged = with(drag, critical * (1.0 + f64::from(ulp) * f64::EPSILON), 0.0);
            assert_eq!(judged.verdict, nothing, "{drag}, {ulp}: {judged}");
        }
        let [below, above] = [1.0 - 1e-12, 1.0 + 1e-12].map(|part| with(drag, part * critical, 0.0));
        assert_eq!(below.verdict, StabilityVerdict::AsymptoticallyStable, "{drag}: {below}");
        assert!(matches!(above.verdict, StabilityVerdict::Divergence { .. }), "{drag}: {above}");
    }
    for (part, wanted) in [(0.5, 1), (1.0 - 1e-13, 1), (1.0, 0), (1.0 + 1e-13, -1), (2.0, -1)] {
        let judged = driven(part * critical, 0.0);
        assert_eq!(
            i32::from(judged.is_stable()) - i32::from(judged.is_unstable()),
            wanted,
            "{part}: {judged}"
        );
        assert_eq!(judged.verdict == nothing, wanted == 0, "{judged}");
    }
    let aside = driven(6.0, 1.0);
    assert!(aside.verdict == StabilityVerdict::Stable, "{aside}");
    assert!(
        (aside.least_omega_squared.unwrap() - 5.030_616_264_435_203_f64.powi(2)).abs() < 1e-13,
        "{aside}"
    );
    let StabilityVerdict::Divergence { growth, .. } = driven(6.0, 0.0).verdict else { panic!("it leaves") };
    assert!((growth - 4.047_221_268_969_612).abs() < 1e-14, "{growth}");
    // The hoop that turns by itself keeps its angular momentum: the bead's weight in it stiffens what is left
    // (Routh).
    let model = FreeHoop { m, g, radius, inertia: 0.02 };
    let one = model.steady(&model.state().theta(0.7).phi_rate(6.0).build().unwrap()).unwrap();
    let judged = model.stability(&one.state).unwrap();
    let (s, c) = one.state.theta().sin_cos();
    let (moment, speed) = (m * radius * radius, 6.0_f64);
    let routh = speed * speed * s * s + moment * (2.0 * speed * s * c).powi(2) / (0.02 + moment * s * s);
    assert!(judged.verdict == StabilityVerdict::Stable && judged.ignorable[0].name == "phi", "{judged}");
    assert!((judged.least_omega_squared.unwrap() - routh).abs() < 1e-13 * routh, "{judged}: {routh}");
}

/// A hoop without inertia leaves a spherical pendulum: in a cone cos θ = g/(l ω²) it goes round for ever;
/// upright its angle turns, and it does not. Next to the pole, where rounding ends the search, the momentum
/// of next to no inertia would hold it up.
#[test]
fn a_pole_is_not_judged_by_what_turns_in_it() {
    let (g, radius, speed) = (9.81, 1.0, 3.5_f64);
    let model = FreeHoop { m: 1.0, g, radius, inertia: 0.0 };
    let around = model.state().theta(0.5).phi_rate(speed).build().unwrap();
    let found = model.steady_motions(around).random(30).within("theta", [-3.1, 3.1]).run().unwrap();
    let cone = (g / (radius * speed * speed)).acos();
    let mut cones = 0;
    for one in &found.equilibria {
        assert_eq!((one.state.phi_rate(), one.state.phi()), (speed, 0.0), "{one}");
        match model.stability(&one.state) {
            Ok(judged) => {
                assert!(
                    (one.state.theta().abs() - cone).abs() < 1e-14 && judged.is_stable(),
                    "{one}\n{judged}"
                );
                // Routh: ω² sin²θ + 4 ω² cos²θ.
                let wanted = speed * speed * (1.0 + 3.0 * cone.cos().powi(2));
                assert!((judged.least_omega_squared.unwrap() / wanted - 1.0).abs() < 1e-13, "{judged}");
                cones += 1;
            }
            Err(error) => {
                let singular = matches!(error, EquilibriumError::Solve(SolveError::SingularMassMatrix(_)));
                assert!(one.state.theta().sin().abs() < 1e-15, "{one}: {error}");
                assert!(singular || matches!(error, EquilibriumError::Pole { coordinate: "phi" }), "{error}");
            }
        }
    }
    assert!(cones == 2 && found.equilibria.len() == 4, "{found}");
}

#[test]
fn zieglers_column_with_and_without_damping() {
    let at = |p: f64, c: f64| {
        let model = Ziegler { follows: 1.0, m: 1.0, l: 1.0, k: 1.0, c, p };
        verdict(&model, &model.state().build().unwrap())
    };
    // Undamped: swings below, flutter above, and in between two frequencies that meet. No potential:
    // Dirichlet says nothing of it.
    let critical = 3.5 - 2.0_f64.sqrt();
    for part in [0.5, 0.99, 1.0 - 1e-9] {
        let found = at(critical * part, 0.0);
        assert!(matches!(found, StabilityVerdict::Marginal(Undecided::Swings { .. })), "{part}: {found}");
    }
    let found = at(critical, 0.0);
    let StabilityVerdict::Marginal(Undecided::FrequenciesMeet { frequency, conditioning }) = found else {
        panic!("{found}")
    };
    assert!((frequency - 0.5_f64.powf(0.25)).abs() < 1e-7 && conditioning > 1e6, "{found}");
    for part in [1.0 + 1e-9, 1.01, 2.0] {
        let found = at(critical * part, 0.0);
        assert!(matches!(found, StabilityVerdict::Flutter { .. }), "{part}: {found}");
    }
    // Damping brings the load down, from 2.09 to 1.46 however little it is.
    for c in [1e-3, 0.1, 1.0] {
        let critical = 41.0 / 28.0 + 0.5 * c * c;
        let below = at(critical * (1.0 - 1e-9), c);
        assert!(below == StabilityVerdict::AsymptoticallyStable, "{c}: {below}");
        let above = at(critical * (1.0 + 1e-9), c);
        assert!(matches!(above, StabilityVerdict::Flutter { growth, .. } if growth < 1e-8), "{c}: {above}");
    }
    // Beyond the end of flutter real eigenvalues are left.
    let found = at(3.5 + 2.0_f64.sqrt() + 0.1, 0.0);
    assert!(matches!(found, StabilityVerdict::Divergence { .. }), "{found}");
}

#[test]
fn a_sleeping_top() {
    let model = top::Top { across: 0.05, along: 0.01, weight: 0.5 * 9.81 * 0.1 };
    let at = |spin: f64| model.stability(&model.state().spin_rate(spin).build().unwrap()).unwrap();
    let critical = 31.320_919_526_731_65;
    for spin in [critical * (1.0 + 1e-9), 50.0, 60.0, 70.0, 100.0] {
        let judged = at(spin);
        assert!(judged.verdict == StabilityVerdict::GyroscopicallyStabilised, "{spin}: {judged}");
        assert!(judged.least_omega_squared.unwrap() < -9.0 && judged.ignorable[0].name == "spin", "{judged}");
        // A ξ̈ − i C ω ξ̇ − m g l ξ = 0.
        let root = ((0.01 * spin).powi(2) - 4.0 * 0.05 * model.weight).sqrt();
        let wanted = [(0.01 * spin - root) / 0.1, (0.01 * spin + root) / 0.1];
        let mut found: Vec<f64> = judged.eigenvalues.iter().map(|x| x.im).filter(|im| *im > 0.0).collect();
        found.sort_by(f64::total_cmp);
        let off = (found[0] - wanted[0]).abs().max((found[1] - wanted[1]).abs());
        assert!(off < 1e-12 * judged.conditioning.powi(2).min(1e5), "{spin}: {off:e} {judged}");
    }
    assert!(
        (at(50.0).eigenvalues.iter().map(|x| x.im).fold(0.0, f64::max) - 8.897_435_053_981_015).abs() < 1e-13
    );
    let meets = at(critical).verdict;
    assert!(matches!(meets, StabilityVerdict::Marginal(Undecided::FrequenciesMeet { .. })), "{meets}");
    for spin in [critical * (1.0 - 1e-9), 20.0] {
        assert!(matches!(at(spin).verdict, StabilityVerdict::Flutter { .. }), "{}", at(spin));
    }
    assert!(matches!(at(0.0).verdict, StabilityVerdict::Divergence { .. }), "{}", at(0.0));
}

/// The plane restricted problem of three bodies, in the frame that turns with two of them; V. Szebehely,
/// *Theory of Orbits*.
pub(super) mod moon {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x, y)]
    pub(crate) struct Moon {
        pub(crate) mu: f64,
    }
    #[dynamics]
    impl Moon {
        #[lagrangian]
        fn lagrangian(&self, q: &Coordinates<Self>) -> Expr {
            let first = vec2(q.x + self.mu, q.y).norm();
            let second = vec2(q.x - 1.0 + self.mu, q.y).norm();
            let turning = vec2(q.x.dt() - q.y, q.y.dt() + q.x);
            0.5 * turning.norm_squared() + (1.0 - self.mu) / first + self.mu / second
        }
    }
}

#[test]
fn lagrange_points() {
    let earth = moon::Moon { mu: 0.012_150_585_6 };
    let starts = [[0.8, 0.1], [1.2, 0.05], [-1.1, 0.02], [0.4, 0.8], [0.4, -0.8]];
    let starts = starts.map(|[x, y]| earth.state().x(x).y(y).build().unwrap());
    let found = earth.equilibria(starts[0]).from(starts).run().unwrap();
    let half = 0.866_025_403_784_438_6;
    let wanted = [
        (-1.005_062_645_806_260_7, 0.0),
        (0.487_849_414_4, -half),
        (0.487_849_414_4, half),
        (0.836_915_125_819_712_5, 0.0),
        (1.155_682_165_407_869_3, 0.0),
    ];
    assert_eq!(found.equilibria.len(), 5, "{found}");
    for (one, (x, y)) in found.equilibria.iter().zip(wanted) {
        assert!((one.state.x() - x).abs() < 1e-14 && (one.state.y() - y).abs() < 1e-14, "{one}");
        let judged = earth.stability(&one.state).unwrap();
        // In a line: unstable. In the triangle: at the top of the potential that counts, held by Coriolis
        // forces alone.
        match y == 0.0 {
            true => assert!(matches!(judged.verdict, StabilityVerdict::Divergence { .. }), "{judged}"),
            false => {
                assert!(judged.verdict == StabilityVerdict::GyroscopicallyStabilised, "{judged}");
                let slow = judged.eigenvalues.iter().map(|x| x.im.abs()).fold(f64::MAX, f64::min);
                assert!((slow - 0.298_208_172_927_014_1).abs() < 1e-13, "{judged}");
            }
        }
    }
    let routh = 0.038_520_896_504_551_4;
    let triangle = |mu: f64| {
        let model = moon::Moon { mu };
        verdict(&model, &model.state().x(0.5 - mu).y(0.75_f64.sqrt()).build().unwrap())
    };
    assert_eq!(triangle(routh * (1.0 - 1e-9)), StabilityVerdict::GyroscopicallyStabilised);
    assert!(matches!(triangle(routh * (1.0 + 1e-9)), StabilityVerdict::Flutter { .. }));
    assert!(
        matches!(triangle(routh), StabilityVerdict::Marginal(Undecided::FrequenciesMeet { .. })),
        "{}",
        triangle(routh)
    );
}

#[test]
fn henckys_chain_buckles() {
    let model = |p: f64| Hencky { m: 1.0, l: 1.0, k: 1.0, p };
    let critical = |j: u32| 4.0 * (f64::from(2 * j - 1) * PI / 22.0).sin().powi(2);
    assert!((critical(1) - 0.081_014_052_771_005_2).abs() < 1e-16);
    let straight = |p: f64| {
        let model = model(p);
        model.stability(&model.state().build().unwrap()).unwrap()
    };
    for part in [0.0, 0.5, 1.0 - 1e-10] {
        // A dead load has a potential, though it is written as a force.
        assert_eq!(straight(part * critical(1)).verdict, StabilityVerdict::Stable, "{part}");
    }
    let judged = straight(critical(1));
    let resists = matches!(judged.verdict, StabilityVerdict::Marginal(Undecided::NothingResists { .. }));
    assert!(resists && judged.least_omega_squared.unwrap().abs() < 1e-15, "{judged}");
    for j in 1..=3 {
        let StabilityVerdict::Divergence { growth, .. } = straight(critical(j) * (1.0 + 1e-10)).verdict
        else {
            panic!("beyond load {j} it stands")
        };
        assert!(growth > 0.0, "{j}");
    }
    // Between the first two loads it leans to either side, between the second and the third it has two more
    // ways to.
    for (j, count) in [(1, 3), (2, 5)] {
        let model = model(0.5 * (critical(j) + critical(j + 1)));
        let around = model.state().build().unwrap();
        // Far beyond the first load few starts lead to where the end hangs down: two that lean are given.
        let leaning =
            |side: f64| model.state().theta([1.9, 2.7, 3.0, 3.1, 3.1].map(|x| side * x)).build().unwrap();
        let starts = [around, leaning(1.0), leaning(-1.0)];
        let found = model.equilibria(around).from(starts).random(40).spread(2.5).run().unwrap();
        let small = found.equilibria.iter().filter(|one| one.state.q().iter().all(|q| q.abs() < PI));
        let small: Vec<_> = small.map(|one| (one, model.stability(&one.state).unwrap())).collect();
        let stable = small.iter().filter(|(_, judged)| judged.is_stable()).count();
        assert!(small.len() >= count && stable == 2, "{found}");
        // What leans to one side leans to the other.
        for (one, _) in &small {
            let mirror =
                |other: &Equilibrium<_>| (one.state.q() + State::<Hencky>::q(&other.state)).amax() < 1e-9;
            assert!(small.iter().any(|(other, _)| mirror(other)), "{one}\n{found}");
        }
    }
}

/// A slider on a crank, pushed by a spring: by the angle alone, and by angle and place with the rod as a
/// constraint.
mod slider {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(phi: rad)]
    #[units(inertia: kg * m^2, m: kg, r: m, l: m, k: N / m, free: m, torque: N * m)]
    #[nominal(r = 0.3, l = 0.7)]
    pub(super) struct Angle {
        pub(super) inertia: f64,
        pub(super) m: f64,
        pub(super) r: f64,
        pub(super) l: f64,
        pub(super) k: f64,
        pub(super) free: f64,
        pub(super) torque: f64,
    }
    #[dynamics]
    impl Angle {
        fn place(&self, q: &Coordinates<Self>) -> Expr {
            self.r * q.phi.cos() + (self.l.powi(2) - (self.r * q.phi.sin()).powi(2)).sqrt()
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.inertia * q.phi.dt().powi(2) + 0.5 * self.m * self.place(q).dt().powi(2)
        }
        #[potential]
        fn spring(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.k * (self.place(q) - self.free).powi(2)
        }
        #[force]
        fn motor(&self, q: &Coordinates<Self>) -> Force {
            Force::along(q.phi, self.torque)
        }
    }

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(phi: rad, x: m)]
    #[units(inertia: kg * m^2, m: kg, r: m, l: m, k: N / m, free: m, torque: N * m)]
    #[nominal(r = 0.3, l = 0.7)]
    pub(super) struct Loop {
        pub(super) inertia: f64,
        pub(super) m: f64,
        pub(super) r: f64,
        pub(super) l: f64,
        pub(super) k: f64,
        pub(super) free: f64,
        pub(super) torque: f64,
    }
    #[dynamics]
    impl Loop {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.inertia * q.phi.dt().powi(2) + 0.5 * self.m * q.x.dt().powi(2)
        }
        #[potential]
        fn spring(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.k * (q.x - self.free).powi(2)
        }
        #[force]
        fn motor(&self, q: &Coordinates<Self>) -> Force {
            Force::along(q.phi, self.torque)
        }
        #[holonomic]
        fn rod(&self, q: &Coordinates<Self>) -> Expr {
            (vec2(q.x, 0.0) - self.r * vec2(q.phi.cos(), q.phi.sin())).norm() - self.l
        }
    }
}

#[test]
fn a_loop_with_a_spring_as_in_one_coordinate() {
    let (inertia, m, r, l, k, free, torque) = (0.02, 1.3, 0.3, 0.7, 90.0, 0.62, 1.1);
    let angle = slider::Angle { inertia, m, r, l, k, free, torque };
    let found = angle.equilibria(angle.state().build().unwrap()).random(40).run().unwrap();
    let closed = slider::Loop { inertia, m, r, l, k, free, torque };
    let around = closed.state().phi(0.0).x(r + l).build().unwrap();
    let looped = closed.equilibria(around).random(40).within("x", [0.3, 1.1]).run().unwrap();
    assert!(found.equilibria.len() == 4 && looped.equilibria.len() == 4, "{found}\n{looped}");
    let mut stable = 0;
    for (one, other) in found.equilibria.iter().zip(&looped.equilibria) {
        assert!((one.state.phi() - other.state.phi()).abs() < 1e-13, "{one}\n{other}");
        let (a, b) = (angle.stability(&one.state).unwrap(), closed.stability(&other.state).unwrap());
        assert!(
            (a.least_omega_squared.unwrap() / b.least_omega_squared.unwrap() - 1.0).abs() < 1e-11,
            "{a}\n{b}"
        );
        assert_eq!((a.is_stable(), a.is_unstable()), (b.is_stable(), b.is_unstable()), "{a}\n{b}");
        stable += i32::from(a.is_stable());
        // What the rod pushes the slider with.
        let along = (other.state.x() - r * other.state.phi().cos()) / l;
        let pushed = other.reactions[0].multipliers[0] * along - k * (other.state.x() - free);
        assert!(pushed.abs() < 1e-12 * k, "{other}");
    }
    assert_eq!(stable, 2, "{found}");
}

/// Two masses with weak forces of all kinds beside strong ones.
mod weak {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: m, y: m)]
    #[units(
        m: kg, k: N / m, around: N / m, drag: N * s / m, fourth: N / m^3, load: N, turning: N * s / m,
        shaken: N, speed: rad / s
    )]
    pub(super) struct Weak {
        pub(super) m: f64,
        pub(super) k: [f64; 2],
        /// A force across the displacement.
        pub(super) around: f64,
        pub(super) drag: [f64; 2],
        pub(super) fourth: f64,
        pub(super) load: f64,
        /// A force across the velocity.
        pub(super) turning: f64,
        pub(super) shaken: f64,
        pub(super) speed: f64,
    }
    #[dynamics]
    impl Weak {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m * vec2(q.x, q.y).dt().norm_squared()
        }
        #[potential]
        fn springs(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * (self.k[0] * q.x.powi(2) + self.k[1] * q.y.powi(2)) + 0.25 * self.fourth * q.x.powi(4)
        }
        #[force]
        fn forces(&self, q: &Coordinates<Self>) -> Force {
            let across = self.around * vec2(-q.y, q.x) + self.turning * vec2(-q.y.dt(), q.x.dt());
            let drag = vec2(self.drag[0] * q.x.dt(), self.drag[1] * q.y.dt());
            let load = self.load + self.shaken * (self.speed * q.t).sin();
            Force::at(vec2(q.x, q.y), across - drag + vec2(0.0, load))
        }
    }
    pub(super) const WEAK: Weak = Weak {
        m: 1.0,
        k: [1.0, 4.0],
        around: 0.0,
        drag: [0.0; 2],
        fourth: 0.0,
        load: 0.0,
        turning: 0.0,
        shaken: 0.0,
        speed: 1.0,
    };
}

#[test]
fn what_is_weak_decides_beside_what_is_strong() {
    use weak::{WEAK, Weak};
    let of = |model: &Weak| {
        let rest = model.equilibrium(&model.state().build().unwrap()).unwrap();
        model.stability(&rest.state).unwrap()
    };
    assert_eq!(of(&WEAK).verdict, StabilityVerdict::Stable);
    assert_eq!(of(&Weak { load: 1e6, ..WEAK }).verdict, StabilityVerdict::Stable);
    // Where stiffness vanishes higher terms decide, of which nothing is known.
    let nothing = StabilityVerdict::Marginal(Undecided::NothingResists { coordinate: "x" });
    for fourth in [-1.0, 1.0] {
        let judged = of(&Weak { k: [0.0, 4.0], fourth, ..WEAK });
        assert_eq!(judged.verdict, nothing, "{judged}");
    }
    // A force across the displacement of equal springs takes them apart, beside a dead load or a stiff
    // spring, too.
    for (around, load) in [(0.1, 0.0), (1e-6, 1e3), (1e-9, 0.0)] {
        let judged = of(&Weak { k: [1.0, 1.0], around, load, ..WEAK });
        let StabilityVerdict::Flutter { growth, .. } = judged.verdict else { panic!("{around}: {judged}") };
        assert!((growth / (0.5 * around) - 1.0).abs() < around + 1e-6, "{around}: {judged}");
    }
    let uneven = of(&Weak { k: [1e12, 1.0], around: 1e-3, ..WEAK });
    assert!(!uneven.is_stable() && !uneven.is_unstable(), "{uneven}");
    // Damping of one of two that are not coupled leaves the other; a little of both is enough; a drive takes
    // over.
    let judged = of(&Weak { drag: [0.3, 0.0], ..WEAK });
    let swings = |verdict| {
        matches!(verdict,
        StabilityVerdict::Marginal(Undecided::Swings { frequency }) if frequency == 2.0)
    };
    assert!(swings(judged.verdict), "{judged}");
    for (load, drag) in [(0.0, [0.3, 1e-9]), (1e9, [0.3, 1e-9]), (0.0, [1e-9, 1e-9])] {
        let judged = of(&Weak { drag, load, ..WEAK });
        assert_eq!(judged.verdict, StabilityVerdict::AsymptoticallyStable, "{judged}");
    }
    for (load, drag) in [(0.0, [0.3, -1e-9]), (1e9, [0.3, -1e-9])] {
        let judged = of(&Weak { drag, load, ..WEAK });
        let flutters = matches!(judged.verdict, StabilityVerdict::Flutter { coordinate: "y", .. });
        assert!(flutters && (judged.abscissa / 5e-10 - 1.0).abs() < 1e-5, "{judged}");
    }
    // Forces across the velocity hold two masses on a hill, which the least drag undoes; energy is kept, but
    // no declaration says so.
    let hill = Weak { k: [-1.0, -1.5], turning: 5.0, ..WEAK };
    assert!(!of(&hill).is_stable() && !of(&hill).is_unstable(), "{}", of(&hill));
    let judged = of(&Weak { drag: [1e-6; 2], ..hill });
    assert!(matches!(judged.verdict, StabilityVerdict::Flutter { .. }), "{judged}");
}

#[test]
fn what_does_not_stay_is_not_judged() {
    use weak::{WEAK, Weak};
    // Shaken by a load the coefficients are constant, but the place is not.
    let shaken = Weak { shaken: 3.0, ..WEAK };
    let found = shaken.equilibria(shaken.state().build().unwrap()).at(0.5).run().unwrap();
    let error = shaken.stability(&found.equilibria[0].state).unwrap_err();
    assert!(matches!(error, EquilibriumError::DependsOnTime { coordinate: "y", .. }), "{error}");
    let error = WEAK.stability(&WEAK.state().x(0.1).build().unwrap()).unwrap_err();
    assert!(
        matches!(error, EquilibriumError::Derivatives(LinearizeError::Accelerates { name: "x", .. })),
        "{error}"
    );
    // On the edge of a stop each side has a stiffness of its own.
    let edge = plane::Plane { pull: 4.0, stop: 50.0, edge: 1.0, ..plane::PLANE };
    let error = edge.stability(&edge.state().x(1.0).build().unwrap()).unwrap_err();
    assert_eq!(error, EquilibriumError::Derivatives(LinearizeError::Corner), "{error}");
    // What nothing holds is left out; where that is all, nothing is stable.
    let loose = Weak { k: [0.0, 4.0], ..WEAK };
    let judged = loose.stability(&loose.state().x(3.0).build().unwrap()).unwrap();
    assert!(judged.verdict == StabilityVerdict::Stable && judged.ignorable[0].name == "x", "{judged}");
    let free = Weak { k: [0.0, 0.0], ..WEAK };
    let judged = free.stability(&free.state().x(3.0).build().unwrap()).unwrap();
    assert!(
        matches!(judged.verdict, StabilityVerdict::Marginal(Undecided::NothingResists { .. })),
        "{judged}"
    );
    assert!(
        judged.to_string().starts_with("not decided by linear theory: nothing resists along `x`"),
        "{judged}"
    );
}

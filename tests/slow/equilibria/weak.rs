//! Rests where next to nothing holds: critical loads, forces that fade away, corners, coordinates in which a
//! force says nothing, and rolling.

use dynamics::analysis::{EquilibriumError, StabilityVerdict};
use dynamics::prelude::*;

use super::hencky::Hencky;
use super::rolling_disk::{DISK, Disk};

/// A pendulum, a bead in a bowl and masses on springs, in the coordinates that make them hard.
mod models {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: m, y: m)]
    #[units(m: kg, l: m, g: m / s^2)]
    pub(super) struct Cartesian {
        pub(super) m: f64,
        pub(super) l: f64,
        pub(super) g: f64,
    }
    #[dynamics]
    impl Cartesian {
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

    /// In a bowl z = (x² + 3 y²)/2a.
    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: m, y: m, z: m)]
    #[units(m: kg, a: m, g: m / s^2)]
    pub(super) struct Bowl {
        pub(super) m: f64,
        pub(super) a: f64,
        pub(super) g: f64,
    }
    #[dynamics]
    impl Bowl {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m * vec3(q.x, q.y, q.z).dt().norm_squared()
        }
        #[potential]
        fn weight(&self, q: &Coordinates<Self>) -> Expr {
            self.m * self.g * q.z
        }
        #[holonomic]
        fn bowl(&self, q: &Coordinates<Self>) -> Expr {
            q.z - (q.x.powi(2) + 3.0 * q.y.powi(2)) / (2.0 * self.a)
        }
    }

    /// `fading` tanh x + `slope` |x| + `flat` x⁴/4 + `soft` e^(−x) − `well` e^(−x²), with a mass y on a
    /// spring beside it.
    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x, y)]
    pub(super) struct Shapes {
        pub(super) fading: f64,
        pub(super) slope: f64,
        pub(super) flat: f64,
        pub(super) soft: f64,
        pub(super) well: f64,
        pub(super) aside: f64,
        /// A push at this time, as long as 0.1.
        pub(super) pulse: f64,
    }
    #[dynamics]
    impl Shapes {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * (q.x.dt().powi(2) + q.y.dt().powi(2))
        }
        #[potential]
        fn shapes(&self, q: &Coordinates<Self>) -> Expr {
            self.fading * q.x.tanh()
                + self.slope * q.x.abs()
                + 0.25 * self.flat * q.x.powi(4)
                + self.soft * (-q.x).exp()
                - self.well * (-q.x.powi(2)).exp()
        }
        #[potential]
        fn spring(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * (q.y - self.aside).powi(2)
        }
        #[force]
        fn push(&self, q: &Coordinates<Self>) -> Force {
            let late = (q.t - self.pulse) / 0.1;
            Force::along(q.y, (-late.powi(2)).exp())
        }
    }
    pub(super) const NONE: Shapes =
        Shapes { fading: 0.0, slope: 0.0, flat: 0.0, soft: 0.0, well: 0.0, aside: 0.3, pulse: -1e9 };

    /// A spring that begins with the fifth power.
    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x)]
    pub(super) struct Sextic {
        pub(super) size: f64,
    }
    #[dynamics]
    impl Sextic {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * q.x.dt().powi(2)
        }
        #[potential]
        fn spring(&self, q: &Coordinates<Self>) -> Expr {
            (q.x / self.size).powi(6)
        }
    }

    /// A soft spring to the ground, a stiff one between the masses.
    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: m, y: m, z: m)]
    #[units(m: kg, soft: N / m, stiff: N / m, free: m, pull: N)]
    pub(super) struct Uneven {
        pub(super) m: f64,
        pub(super) soft: f64,
        pub(super) stiff: f64,
        pub(super) free: f64,
        pub(super) pull: f64,
    }
    #[dynamics]
    impl Uneven {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m * vec3(q.x, q.y, q.z).dt().norm_squared()
        }
        #[potential]
        fn springs(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.soft * q.x.powi(2)
                + 0.5 * self.stiff * ((q.y - q.x - self.free).powi(2) + (q.z - q.y - self.free).powi(2))
                - self.pull * q.z
        }
    }
}
use models::{Bowl, Cartesian, NONE, Sextic, Shapes, Uneven};

#[test]
fn from_far_along_constraints() {
    let model = Cartesian { m: 1.0, l: 1.0, g: 9.81 };
    for degrees in [5, 30, 52, 60, 75, 85, 89, 91, 100, 120, 150, 179] {
        let angle = f64::from(degrees).to_radians();
        let one = model.equilibrium(&model.state().x(angle.sin()).y(-angle.cos()).build().unwrap());
        let one = one.unwrap_or_else(|error| panic!("{degrees}°: {error}"));
        // By the angle, too, Newton's method goes down from below the horizontal, and up from above.
        let y = if degrees < 90 { -1.0 } else { 1.0 };
        assert!(one.state.x().abs() < 1e-14 && (one.state.y() - y).abs() < 1e-15, "{degrees}°: {one}");
    }
    // Level the force along the circle is greatest, and its slope is zero: it begins to fall.
    for l in [1e-3, 1.0, 1e3] {
        let model = Cartesian { l, ..model };
        for side in [1.0, -1.0] {
            let one = model.equilibrium(&model.state().x(side * l).build().unwrap());
            let one = one.unwrap_or_else(|error| panic!("{l}, {side}: {error}"));
            assert!(
                one.state.x().abs() < 1e-14 * l && (one.state.y() + l).abs() < 1e-15 * l,
                "{l}, {side}: {one}"
            );
        }
        let level = model.state().x(l).build().unwrap();
        let found = model.equilibria(level).random(20).spread(l).run().unwrap();
        assert!(found.equilibria.len() == 2 && found.failures.is_empty(), "{l}: {found}");
    }
    let bowl = Bowl { m: 1.0, a: 0.1, g: 9.81 };
    for [x, y] in [[0.05, 0.02], [0.5, 0.1], [0.3, -0.7], [4.0, 3.0], [-100.0, 1.0]] {
        let z = (x * x + 3.0 * y * y) / 0.2;
        let one = bowl.equilibrium(&bowl.state().x(x).y(y).z(z).build().unwrap());
        let one = one.unwrap_or_else(|error| panic!("{x}, {y}: {error}"));
        assert!(one.state.q().amax() < 1e-15, "{x}, {y}: {one}");
    }
}

#[test]
fn at_a_critical_load_there_is_one_rest() {
    let critical = 4.0 * (std::f64::consts::PI / 22.0).sin().powi(2);
    let model = Hencky { m: 1.0, l: 1.0, k: 1.0, p: critical };
    let around = model.state().build().unwrap();
    for spread in [1e-6, 1e-4, 1e-2, 0.2] {
        let found = model.equilibria(around).random(60).spread(spread).run().unwrap();
        assert_eq!(found.equilibria.len(), 1, "{spread}: {found}");
        let one = &found.equilibria[0];
        let judged = model.stability(&one.state).unwrap();
        assert!(matches!(judged.verdict, StabilityVerdict::Marginal(_)), "{spread}: {one}\n{judged}");
        assert!(
            one.state.q().iter().zip(&one.uncertainty).all(|(q, off)| q.abs() <= *off),
            "{spread}: {one}"
        );
    }
    // Forces that begin with the fifth power, of which Newton's method takes a fifth at a time.
    for size in [1e-6, 1.0, 1e6] {
        let sextic = Sextic { size };
        let one = sextic.equilibrium(&sextic.state().x(0.9 * size).build().unwrap());
        let one = one.unwrap_or_else(|error| panic!("{size:e}: {error}"));
        assert!(one.state.x().abs() < 1e-15 * size, "{size:e}: {one}");
    }
    // A spring that begins with the third power.
    let quartic = Shapes { flat: 1.0, ..NONE };
    let found = quartic.equilibria(quartic.state().build().unwrap()).random(60).spread(1.0).run().unwrap();
    assert_eq!(found.equilibria.len(), 1, "{found}");
    let one = &found.equilibria[0];
    let judged = quartic.stability(&one.state).unwrap();
    assert!(matches!(judged.verdict, StabilityVerdict::Marginal(_)), "{one}\n{judged}");
}

#[test]
fn forces_that_fade_away_are_no_balance() {
    for x in [0.5, 3.0, 12.0, 19.0, 30.0, 400.0] {
        let fading = Shapes { fading: 1.0, ..NONE };
        let error = fading.equilibrium(&fading.state().x(x).build().unwrap());
        let error = error.expect_err(&format!("tanh from {x}"));
        assert!(
            matches!(
                error,
                EquilibriumError::Diverged { coordinate: "x", .. }
                    | EquilibriumError::Faded { coordinate: "x", .. }
            ),
            "tanh from {x}: {error}"
        );
    }
    for x in [0.5, 12.0, 40.0, 740.0, 760.0] {
        let soft = Shapes { soft: 1.0, ..NONE };
        let error =
            soft.equilibrium(&soft.state().x(x).build().unwrap()).expect_err(&format!("e^−x from {x}"));
        assert!(
            matches!(
                error,
                EquilibriumError::Diverged { coordinate: "x", .. }
                    | EquilibriumError::Faded { coordinate: "x", .. }
            ),
            "e^−x from {x}: {error}"
        );
    }
    // So far from a well that neither its force nor its stiffness is a number above zero: nothing there says
    // that it ends, and nothing holds it.
    let well = Shapes { well: 1.0, ..NONE };
    for x in [30.0, 40.0, 1000.0, 1e6] {
        let far = well.state().x(x).y(0.3).build().unwrap();
        for error in [well.equilibrium(&far).map(drop), well.stability(&far).map(drop)] {
            let error = error.expect_err(&format!("−e^−x² from {x}"));
            assert!(
                matches!(error, EquilibriumError::Faded { coordinate: "x", .. }),
                "−e^−x² from {x}: {error}"
            );
        }
    }
    let inside = well.equilibrium(&well.state().x(0.4).build().unwrap()).unwrap();
    assert!(inside.state.x().abs() < 1e-15 && well.stability(&inside.state).unwrap().is_stable(), "{inside}");
    // What nothing acts on stays where it is, and is at rest there.
    let free = NONE.equilibrium(&NONE.state().x(5.0).build().unwrap()).unwrap();
    assert_eq!((free.state.x(), free.state.y()), (5.0, 0.3));
}

#[test]
fn rests_in_corners_are_no_folds() {
    let corner = Shapes { slope: 1.0, ..NONE };
    for x in [1e-3, 0.5, -7.0] {
        let error = corner.equilibrium(&corner.state().x(x).build().unwrap()).unwrap_err();
        assert!(matches!(error, EquilibriumError::Corner { coordinate: "x", .. }), "{x}: {error}");
    }
    // A constant force is none either, but holds nothing.
    let hill = Shapes { slope: -1.0, ..NONE };
    let error = hill.equilibrium(&hill.state().x(0.5).build().unwrap()).unwrap_err();
    assert!(!matches!(error, EquilibriumError::Corner { .. }), "{error}");
}

#[test]
fn a_push_at_any_time_is_seen() {
    for pulse in [0.31, 3.0, 42.0, 99.9] {
        let model = Shapes { pulse, ..NONE };
        let error =
            model.equilibrium(&model.state().build().unwrap()).expect_err(&format!("a push at {pulse}"));
        assert!(matches!(error, EquilibriumError::DependsOnTime { coordinate: "y", .. }), "{pulse}: {error}");
    }
    // Later ones may fall between the times that are looked at: it is said that time stands in the model, and
    // of others that it does not.
    let late = Shapes { pulse: 5005.0, ..NONE };
    let one = late.equilibrium(&late.state().build().unwrap()).unwrap();
    assert!(one.contains_time && one.to_string().contains("time stands in the model"), "{one}");
    let model = Cartesian { m: 1.0, l: 1.0, g: 9.81 };
    let one = model.equilibrium(&model.state().y(-1.0).build().unwrap()).unwrap();
    assert!(!one.contains_time && !one.to_string().contains("time"), "{one}");
}

#[test]
fn soft_springs_beside_stiff_ones_are_as_sure_as_is_said() {
    let mut worst: f64 = 0.0;
    for (k, stiff) in [1e4, 1e6, 1e8, 1e10, 1e12].into_iter().enumerate() {
        for sample in 0..20 {
            let (free, pull) =
                (0.3 + 0.037 * f64::from(sample), 0.71 + 0.013 * f64::from(sample + 20 * k as i32));
            let model = Uneven { m: 1.0, soft: 1.0, stiff, free, pull };
            let one = model.equilibrium(&model.state().x(0.1).y(0.4).z(0.9).build().unwrap()).unwrap();
            let wanted = [pull, pull + free + pull / stiff, pull + 2.0 * free + 2.0 * pull / stiff];
            for (i, wanted) in wanted.into_iter().enumerate() {
                let off = (one.state.q()[i] - wanted).abs();
                worst = worst.max(off / (one.uncertainty[i] + f64::EPSILON));
            }
        }
    }
    assert!(worst <= 1.0, "off by {worst:.1} times what was said");
}

/// Leaning by β on a circle of radius R a thin disk of radius r spins with γ̇² = 4 g sin β/((6 − 5 ρ sin β) ρ
/// r cos β), ρ = r/R, and turns by −ρ γ̇.
#[test]
fn a_disk_rolls_in_a_steady_circle() {
    let rolling = |disk: &Disk, lean: f64, yaw: f64, spin: f64| {
        let start = disk.state().lean(lean).yaw_rate(yaw).spin_rate(spin);
        start.x_rate(disk.r * (spin + yaw * lean.sin())).build().unwrap()
    };
    for (lean, circle) in [(0.2_f64, 5.0), (0.4, 1.7), (0.05, 30.0)] {
        let ratio = 1.0 / circle;
        let square = 4.0 * lean.sin() / ((6.0 - 5.0 * ratio * lean.sin()) * ratio * lean.cos());
        let (spin, yaw) = (square.sqrt(), -ratio * square.sqrt());
        let one = DISK.steady(&rolling(&DISK, 0.9 * lean, yaw, spin)).unwrap();
        assert!((one.state.lean() - lean).abs() < 1e-12, "{lean}: {one}");
        assert!(
            (one.state.yaw_rate() - yaw).abs() < 1e-15 && (one.state.spin_rate() - spin).abs() < 1e-15,
            "{one}"
        );
        // The motion is a circle, and closes.
        let period = std::f64::consts::TAU / yaw.abs();
        let end = DISK.simulate(one.state).until(period).tolerance(1e-12).run().unwrap().end();
        assert!(
            (end.lean() - lean).abs() < 1e-7
                && (end.x() - one.state.x()).hypot(end.y() - one.state.y()) < 1e-6
        );
        // The reaction at the contact holds it on its circle: m v²/R of the centre, toward the middle.
        let speed = one.state.x_rate();
        assert!((speed * yaw).abs() > 0.0 && !one.reactions.is_empty());
    }
}

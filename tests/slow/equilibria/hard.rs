//! Equilibria where constraints or inertia are singular, switched, or leave more coordinates than velocities.

use dynamics::analysis::{EquilibriumError, LinearizeError, StabilityVerdict, Undecided};
use dynamics::error::SolveError;
use dynamics::prelude::*;

use super::parallelogram::Parallelogram;
use super::turned_hoop::TurnedHoop;
use super::two_bars::TwoBars;
use super::{held, pendulum};

#[test]
fn through_and_in_a_change_point() {
    let model = |rest: f64| Parallelogram { inertia: 1.0, l: 1.0, wide: 2.0, k: 3.0, rest };
    // Across the change point, a balance on the branch on the other side.
    let across = model(-0.4);
    let one = across.equilibrium(&across.state().a(0.5).c(0.5).build().unwrap()).unwrap();
    assert!((one.state.a() + 0.4).abs() < 1e-12 && one.state.b().abs() < 1e-12, "{one}");
    // In it.
    let inside = model(0.0);
    let one = inside.equilibrium(&inside.state().a(0.5).c(0.5).build().unwrap()).unwrap();
    assert!(one.state.a().abs() < 1e-6, "{one}");
    // Whether it stays there depends on the branch.
    let error = inside.stability(&one.state).unwrap_err();
    assert!(
        matches!(error, EquilibriumError::Derivatives(LinearizeError::SingularPosition { .. })),
        "{error}"
    );
    // From within it there is a way.
    let one = across.equilibrium(&across.state().build().unwrap()).unwrap();
    assert!((one.state.a() + 0.4).abs() < 1e-12, "{one}");
}

/// A mass on a spring in polar coordinates, and a load on a floor that can be left.
mod small {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(r: m, phi: rad)]
    #[units(m: kg, k: N / m, free: m)]
    pub(super) struct Polar {
        pub(super) m: f64,
        pub(super) k: f64,
        pub(super) free: f64,
    }
    #[dynamics]
    impl Polar {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m * (q.r * vec2(q.phi.cos(), q.phi.sin())).dt().norm_squared()
        }
        #[potential]
        fn spring(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.k * (q.r - self.free).powi(2)
        }
    }

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: m, y: m)]
    #[units(m: kg, g: m / s^2, k: N / m, free: m)]
    pub(super) struct Floor {
        pub(super) m: f64,
        pub(super) g: f64,
        pub(super) k: f64,
        pub(super) free: f64,
    }
    #[dynamics]
    impl Floor {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m * vec2(q.x, q.y).dt().norm_squared()
        }
        #[potential]
        fn forces(&self, q: &Coordinates<Self>) -> Expr {
            self.m * self.g * q.y + 0.5 * self.k * ((q.y - self.free).powi(2) + q.x.powi(2))
        }
        #[holonomic(switched)]
        fn floor(&self, q: &Coordinates<Self>) -> Expr {
            q.y
        }
    }
}

#[test]
fn in_the_pole_of_polar_coordinates_and_on_a_floor() {
    let polar = small::Polar { m: 1.0, k: 4.0, free: 0.5 };
    let one = polar.equilibrium(&polar.state().r(0.9).phi(1.0).build().unwrap()).unwrap();
    assert!(one.state.r() == 0.5 && one.state.phi() == 1.0, "{one}");
    let judged = polar.stability(&one.state).unwrap();
    assert!(judged.verdict == StabilityVerdict::Stable && judged.ignorable[0].name == "phi", "{judged}");
    let pole = small::Polar { free: 0.0, ..polar };
    // In the pole phi has no inertia: it is a balance, but small motions need other coordinates.
    let one = pole.equilibrium(&pole.state().r(0.9).phi(1.0).build().unwrap()).unwrap();
    assert_eq!(one.state.r(), 0.0);
    let error = pole.stability(&one.state).unwrap_err();
    assert!(matches!(error, EquilibriumError::Solve(SolveError::SingularMassMatrix(_))), "{error}");
    // It turns about: r from the balance of the spring and what turns.
    let steady = polar.steady(&polar.state().r(0.9).phi_rate(1.0).build().unwrap()).unwrap();
    assert!((steady.state.r() - 2.0 / 3.0).abs() < 1e-15, "{steady}");
    let judged = polar.stability(&steady.state).unwrap();
    assert!((judged.least_omega_squared.unwrap() - (4.0 - 1.0 + 4.0)).abs() < 1e-14, "{judged}");

    let floor = small::Floor { m: 2.0, g: 9.81, k: 100.0, free: 0.1 };
    let on = floor.equilibrium(&floor.state().x(0.3).build().unwrap()).unwrap();
    assert!(
        (on.reactions[0].multipliers[0] - (2.0 * 9.81 - 10.0)).abs() < 1e-13 && on.state.y() == 0.0,
        "{on}"
    );
    let off = floor.state().x(0.3).release("floor").build().unwrap();
    let off = floor.equilibrium(&off).unwrap();
    assert!(
        (off.state.y() - (0.1 - 0.1962)).abs() < 1e-15 && off.reactions[0].multipliers[0] == 0.0,
        "{off}"
    );
    assert!(!off.state.active_set().all_hold(), "released it stays released");
}

#[test]
fn a_skate_has_rests_side_by_side() {
    let model = held::Skate { m: 2.0, inertia: 0.1, anchor: 1.0, k: 5.0, twist: 0.7 };
    let one = model.equilibrium(&model.state().x(0.2).y(0.6).phi(1.0).build().unwrap()).unwrap();
    let judged = model.stability(&one.state).unwrap();
    assert!(
        matches!(judged.verdict, StabilityVerdict::Marginal(Undecided::NothingResists { .. })),
        "{judged}"
    );
    // Gliding straight on, its heading and its speed are as good as others.
    let gliding = held::Skate { k: 0.0, twist: 0.0, ..model };
    let judged = gliding.stability(&gliding.state().x_rate(1.3).build().unwrap()).unwrap();
    assert!(
        matches!(judged.verdict, StabilityVerdict::Marginal(Undecided::NothingResists { .. })),
        "{judged}"
    );
    assert_eq!(judged.ignorable.iter().map(|q| q.name).collect::<Vec<_>>(), ["x", "y"], "{judged}");
}

#[test]
fn options_that_make_no_sense_are_named() {
    let model = pendulum::Plane { m: 1.0, l: 1.0, g: 9.81 };
    let around = model.state().y([-1.0, -2.0]).build().unwrap();
    let search = || model.equilibria(around).random(3);
    let error = search().within("z", [0.0, 1.0]).run().unwrap_err();
    assert_eq!(error, EquilibriumError::UnknownCoordinate { name: "z".into() });
    for range in [[1.0, 1.0], [2.0, 1.0], [0.0, f64::INFINITY], [f64::NAN, 1.0]] {
        let error = search().within("x", range).run().unwrap_err();
        assert!(matches!(error, EquilibriumError::Range { ref name, .. } if name == "x"), "{error}");
    }
    assert!(matches!(search().spread(0.0).run(), Err(EquilibriumError::Range { .. })));
    // An array whole, and one of its elements by itself.
    let found = search()
        .within("x", [-1.0, 1.0])
        .within("y", [-2.0, 0.0])
        .within("y[1]", [-2.0, -1.0])
        .run()
        .unwrap();
    assert!(!found.equilibria.is_empty(), "{found}");
    // Starts that cannot be put together are counted, and where none leads anywhere, the first says why.
    let short =
        model.equilibria(around).random(20).within("x", [-9.0, 9.0]).within("y", [-9.0, 9.0]).run().unwrap();
    assert_eq!(short.hits.iter().sum::<usize>() + short.failures.len(), 21, "{short}");
}

/// The other way to know: let it go.
#[test]
fn verdicts_against_motions() {
    let (m, g, radius) = (0.1, 9.81, 0.5_f64);
    for part in [0.7, 1.4, 2.5] {
        let model = TurnedHoop { m, g, radius, speed: part * (g / radius).sqrt(), drag: 0.0 };
        let found = model.equilibria(model.state().build().unwrap()).random(40).run().unwrap();
        for rest in &found.equilibria {
            let judged = model.stability(&rest.state).unwrap();
            let off = 1e-7;
            let start = model.state().theta(rest.state.theta() + off).build().unwrap();
            let motion = model.simulate(start).until(2.0).tolerance(1e-13).run().unwrap();
            let theta = |t: f64| motion.at(t).theta() - rest.state.theta();
            match judged.verdict {
                // Beside a rest it goes as cosh(σ t), by its own rate.
                StabilityVerdict::Divergence { growth, .. } => {
                    for t in [0.5, 1.0] {
                        let wanted = off * (growth * t).cosh();
                        assert!((theta(t) / wanted - 1.0).abs() < 1e-4, "{part}, {t}: {rest}");
                    }
                }
                StabilityVerdict::Stable => {
                    let rate = judged.least_omega_squared.unwrap().sqrt();
                    for t in [0.5, 1.0, 2.0] {
                        assert!(
                            (theta(t) - off * (rate * t).cos()).abs() < 1e-5 * off,
                            "{part}, {t}: {rest}"
                        );
                    }
                }
                other => panic!("{other}"),
            }
        }
    }
}

/// Two masses on springs that are not coupled, the second shaken, braked dry, or held less and less.
mod apart {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: m, y: m)]
    #[units(m: kg, k: N / m, load: N, shaken: N, dry: N, parametric: N / m^3, speed: rad / s)]
    pub(super) struct Apart {
        pub(super) m: f64,
        pub(super) k: [f64; 2],
        pub(super) load: f64,
        pub(super) shaken: f64,
        pub(super) dry: f64,
        pub(super) parametric: f64,
        pub(super) speed: f64,
    }
    #[dynamics]
    impl Apart {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m * vec2(q.x, q.y).dt().norm_squared()
        }
        #[potential]
        fn springs(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.k[0] * q.x.powi(2) + 0.5 * self.k[1] * q.y.powi(2)
        }
        #[force]
        fn load(&self, q: &Coordinates<Self>) -> Force {
            let beat = (self.speed * q.t).cos() * q.y.powi(3);
            Force::along(
                q.y,
                self.load - self.dry * q.y.dt().signum() + self.shaken * (self.speed * q.t).sin()
                    - self.parametric * beat,
            )
        }
    }
    pub(super) const STILL: Apart =
        Apart { m: 1.0, k: [1.0, 4.0], load: 0.0, shaken: 0.0, dry: 0.0, parametric: 0.0, speed: 4.0 };
}

/// What is soft is judged by itself, not by what is stiff beside it, nor by a metre.
#[test]
fn stiff_springs_hide_nothing() {
    for stiff in [1.0, 1e10, 1e12] {
        let model = apart::Apart { k: [stiff, 4.0], shaken: 3.0, ..apart::STILL };
        let error = model.equilibrium(&model.state().build().unwrap()).unwrap_err();
        assert!(
            matches!(error, EquilibriumError::DependsOnTime { coordinate: "y", .. }),
            "{stiff:e}: {error}"
        );
        let model = apart::Apart { k: [stiff, 4.0], dry: 0.5, ..apart::STILL };
        let error = model.equilibrium(&model.state().build().unwrap()).unwrap_err();
        assert!(matches!(error, EquilibriumError::Corner { coordinate: "y", .. }), "{stiff:e}: {error}");
    }
    let nano = apart::Apart { load: 4e-9, shaken: 3e-9, ..apart::STILL };
    let error = nano.equilibrium(&nano.state().build().unwrap()).unwrap_err();
    assert!(matches!(error, EquilibriumError::DependsOnTime { coordinate: "y", .. }), "{error}");
}

/// A force that beats with time conserves no energy, though at every instant it is a gradient: at four times
/// the frequency it drives what it finds out of rest.
#[test]
fn forces_that_beat_conserve_no_energy() {
    let model = apart::Apart { k: [1.0, 1.0], parametric: 4.0, ..apart::STILL };
    let rest = model.state().build().unwrap();
    let verdict = model.stability(&rest).unwrap().verdict;
    assert!(!matches!(verdict, StabilityVerdict::Stable), "{verdict:?}");
    let still = apart::Apart { parametric: 0.0, ..model };
    assert!(matches!(still.stability(&rest).unwrap().verdict, StabilityVerdict::Stable));
}

/// A pin on two bars cannot move: its reactions are all there is to find.
#[test]
fn what_cannot_move_rests() {
    let frame = TwoBars { mass: 2.0, r: 5.0f64.sqrt(), base: 2.0, g: 10.0 };
    let start = frame.state().x_guess(0.8).y_guess(1.9).assemble().unwrap();
    let found = frame.equilibrium(&start).unwrap();
    assert!((found.state.x() - 1.0).abs() < 1e-12 && (found.state.y() - 2.0).abs() < 1e-12, "{found}");
    // Each bar bears half of the weight, by its slope: λ 2/√5 = −m g/2 in the sign of Φ = r − √5.
    let forces: Vec<f64> = found.reactions.iter().map(|reaction| reaction.multipliers[0]).collect();
    let wanted = 0.5 * 20.0 * 5.0f64.sqrt() / 2.0;
    assert!(forces.iter().all(|x| (x.abs() - wanted).abs() < 1e-12 * wanted), "{forces:?}");
    assert_eq!(frame.stability(&found.state).unwrap().verdict, StabilityVerdict::Stable);
}

/// A mass on a spring in polar coordinates, with a load across: at r = 0 no force on the angle says anything.
mod polar {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(r: m, phi: rad)]
    #[units(m: kg, k: N / m, load: N)]
    pub(super) struct Polar {
        pub(super) m: f64,
        pub(super) k: f64,
        pub(super) load: f64,
    }
    #[dynamics]
    impl Polar {
        fn place(&self, q: &Coordinates<Self>) -> Vec2 {
            q.r * vec2(q.phi.cos(), q.phi.sin())
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m * self.place(q).dt().norm_squared()
        }
        #[potential]
        fn potential(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.k * q.r.powi(2) + self.load * self.place(q).y
        }
    }
}

#[test]
fn poles_of_coordinates_are_no_equilibria() {
    let model = polar::Polar { m: 1.0, k: 1.0, load: 0.3 };
    let (mut poles, mut right) = (0, 0);
    for (r, phi) in [(0.5, 0.3), (0.2, 1.0), (0.1, 3.0), (0.3, -1.2), (1.0, -1.5), (0.4, 2.0)] {
        match model.equilibrium(&model.state().r(r).phi(phi).build().unwrap()) {
            Ok(found) => {
                let (r, phi) = (found.state.r(), found.state.phi());
                assert!((r * phi.cos()).abs() < 1e-12 && (r * phi.sin() + 0.3).abs() < 1e-12, "{found}");
                right += 1;
            }
            Err(EquilibriumError::Pole { .. }) => poles += 1,
            Err(error) => panic!("{r}, {phi}: {error}"),
        }
    }
    assert!(poles > 0 && right > 0, "{poles} {right}");
}

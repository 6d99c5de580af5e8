//! Equilibria where constraints or inertia are singular, switched, or leave more coordinates than velocities.

use dynamics::prelude::*;

use super::held;

/// A parallelogram with a torsional spring on its first crank, whose change point lies at zero.
mod parallelogram {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(a: rad, b: rad, c: rad)]
    #[units(inertia: kg * m^2, l: m, wide: m, k: N * m, rest: rad)]
    #[nominal(l = 1.0, wide = 2.0)]
    pub(super) struct FourBar {
        pub(super) inertia: f64,
        pub(super) l: f64,
        pub(super) wide: f64,
        pub(super) k: f64,
        pub(super) rest: f64,
    }
    #[dynamics]
    impl FourBar {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.inertia * (q.a.dt().powi(2) + q.b.dt().powi(2) + q.c.dt().powi(2))
        }
        #[potential]
        fn spring(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.k * (q.a - self.rest).powi(2)
        }
        #[holonomic]
        fn closure(&self, q: &Coordinates<Self>) -> Vec2 {
            let first = self.l * vec2(q.a.cos(), q.a.sin()) + self.wide * vec2(q.b.cos(), q.b.sin());
            first - self.l * vec2(q.c.cos(), q.c.sin()) - vec2(self.wide, 0.0)
        }
    }
}

#[test]
fn through_and_in_a_change_point() {
    let model = |rest: f64| parallelogram::FourBar { inertia: 1.0, l: 1.0, wide: 2.0, k: 3.0, rest };
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
    assert!(matches!(error, EquilibriumError::Derivatives(LinearizeError::SingularPosition { .. })), "{error}");
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
    assert!((judged.least_square.unwrap() - (4.0 - 1.0 + 4.0)).abs() < 1e-14, "{judged}");

    let floor = small::Floor { m: 2.0, g: 9.81, k: 100.0, free: 0.1 };
    let on = floor.equilibrium(&floor.state().x(0.3).build().unwrap()).unwrap();
    assert!((on.reactions[0].multipliers[0] - (2.0 * 9.81 - 10.0)).abs() < 1e-13 && on.state.y() == 0.0, "{on}");
    let off = floor.state().x(0.3).release("floor").build().unwrap();
    let off = floor.equilibrium(&off).unwrap();
    assert!((off.state.y() - (0.1 - 0.1962)).abs() < 1e-15 && off.reactions[0].multipliers[0] == 0.0, "{off}");
    assert!(!off.state.modes().all_hold(), "released it stays released");
}

#[test]
fn a_skate_has_rests_side_by_side() {
    let model = held::Skate { m: 2.0, inertia: 0.1, anchor: 1.0, k: 5.0, twist: 0.7 };
    let one = model.equilibrium(&model.state().x(0.2).y(0.6).phi(1.0).build().unwrap()).unwrap();
    let judged = model.stability(&one.state).unwrap();
    assert!(matches!(judged.verdict, StabilityVerdict::Marginal(Undecided::NothingResists { .. })), "{judged}");
}

//! Drives that ask for what no position gives.

use super::*;

/// A crank-rocker whose rocker is turned at a given rate, farther than it can go.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(crank: rad, coupler: rad, rocker: rad)]
#[units(inertia: kg * m^2, a: m, b: m, c: m, d: m, rate: rad / s)]
struct Driven {
    inertia: f64,
    a: f64,
    b: f64,
    c: f64,
    d: f64,
    rate: f64,
}

#[dynamics]
impl Driven {
    fn along(&self, length: f64, angle: Expr) -> Vec2 {
        length * vec2(angle.cos(), angle.sin())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.inertia * (q.crank.dt().powi(2) + q.coupler.dt().powi(2) + q.rocker.dt().powi(2))
    }
    #[holonomic]
    fn closure(&self, q: &Coordinates<Self>) -> Vec2 {
        self.along(self.a, q.crank) + self.along(self.b, q.coupler) - self.along(self.c, q.rocker) - vec2(self.d, 0.0)
    }
    #[holonomic]
    fn drive(&self, q: &Coordinates<Self>) -> Expr {
        q.rocker - 1.8 - self.rate * q.t
    }
}

/// At the lock-up crank and coupler lie in one line: (a + b)² = c² + d² − 2 c d cos ρ with the rocker at π − ρ to the ground.
#[test]
fn a_drive_that_asks_for_too_much_is_told_so() {
    let model = Driven { inertia: 1.0, a: 0.3, b: 0.9, c: 0.6, d: 0.8, rate: 0.2 };
    let start = model.state().rocker(1.8).crank_guess(1.0).coupler_guess(0.5).assemble().unwrap();
    // Folded: crank against coupler.
    let rocker = ((0.36_f64 + 0.64 - 0.36) / 0.96).acos();
    let locks = (core::f64::consts::PI - rocker - 1.8) / 0.2;
    let drifting = [Formulation::Augmented, Formulation::BaumgarteTied];
    for formulation in [Formulation::Projected, Formulation::Embedded].into_iter().chain(drifting) {
        for tolerance in [1e-4, 1e-6, 1e-8, 1e-10, 1e-12] {
            let run = model.simulate(start).until(10.0).tolerance(tolerance).formulation(formulation).run();
            let error = run.unwrap_err();
            let case = format!("{formulation} {tolerance:e}: {error}");
            let (SimulationErrorKind::SingularPosition { rows, coordinates, .. }
            | SimulationErrorKind::BranchUndetermined { rows, coordinates, .. }) = error.kind
            else {
                panic!("{case}")
            };
            assert!(rows.contains("drive") && rows.contains("closure.x"), "{case}");
            assert!(coordinates.contains("crank") && coordinates.contains("coupler"), "{case}");
            assert!((error.time - locks).abs() < 1e-2 * tolerance.powf(0.25) + 1e-5, "{locks}: {case}");
            if !drifting.contains(&formulation) {
                assert!(matches!(error.kind, SimulationErrorKind::SingularPosition { .. }), "{case}");
            }
            // Up to there the mechanism is closed.
            let motion = error.motion(&model).unwrap();
            assert!(motion.steps().all(|state| model.residual(&state).norm() < 1e-3), "{case}");
        }
    }
}

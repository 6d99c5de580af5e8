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
        self.along(self.a, q.crank) + self.along(self.b, q.coupler)
            - self.along(self.c, q.rocker)
            - vec2(self.d, 0.0)
    }
    #[holonomic]
    fn drive(&self, q: &Coordinates<Self>) -> Expr {
        q.rocker - 1.8 - self.rate * q.t
    }
}

/// At the lock-up crank and coupler lie in one line: (a + b)² = c² + d² − 2 c d cos ρ with the rocker at π −
/// ρ to the ground.
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

/// A crank that its slider leads.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta: rad, phi: rad, x: m)]
#[units(inertia: kg * m^2, crank: m, rod: m, reach: m, rate: rad / s)]
#[nominal(inertia = 0.1, crank = 1.0, rod = 3.0, reach = 0.9, rate = 1.0)]
struct Led {
    inertia: f64,
    crank: f64,
    rod: f64,
    reach: f64,
    rate: f64,
}

#[dynamics]
impl Led {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.inertia * q.theta.dt().powi(2)
    }
    #[holonomic]
    fn closure(&self, q: &Coordinates<Self>) -> Vec2 {
        let pin = self.crank * vec2(q.theta.cos(), q.theta.sin());
        vec2(q.x, 0.0) - pin - self.rod * vec2(q.phi.cos(), -q.phi.sin())
    }
    #[holonomic]
    fn drive(&self, q: &Coordinates<Self>) -> Expr {
        q.x - self.rod - self.reach * (self.rate * q.t).cos()
    }
}

/// A drive that turns round just at the dead point leaves two ways, with finite velocities: no lock-up, and
/// one of them is continuous.
#[test]
fn a_drive_that_turns_round_at_the_dead_point_meets_a_bifurcation() {
    for (reach, locks) in [(1.0, false), (1.000_001, true)] {
        let led = Led { inertia: 0.1, crank: 1.0, rod: 3.0, reach, rate: 1.0 };
        let start =
            led.state().at_time(1.0).theta_guess(-1.2).phi_guess(-0.3).x_guess(3.5).assemble().unwrap();
        let Err(error) = led.kinematics(start).until(8.0).run() else { panic!("went through") };
        let message = error.to_string();
        assert_eq!(message.contains("infinite velocity"), locks, "{message}");
        let Err(error) = led.kinematics(start).until(8.0).through_bifurcations().run() else {
            assert!(!locks);
            let motion = led.kinematics(start).until(8.0).through_bifurcations().run().unwrap();
            let end = motion.end();
            let cosine = (end.x().powi(2) - 8.0) / (2.0 * end.x());
            assert!((end.theta().cos() - cosine).abs() < 1e-9, "{end:?}");
            // The crank goes on, across the inner dead point and then the outer one, where 4 − x = (2/3) θ² =
            // t²/2 and θ̇² = 3/4.
            let outer = motion.at(std::f64::consts::TAU);
            assert!(
                end.theta() < -std::f64::consts::TAU && (outer.theta() + std::f64::consts::TAU).abs() < 1e-5
            );
            // Right beside it, where rounding decides what is solved for, velocities are those of the branch
            // to a hundredth.
            let places = [
                (-1e-3, 1e-5),
                (-1e-6, 0.01),
                (-1e-9, 0.01),
                (0.0, 0.01),
                (1e-12, 0.01),
                (1e-6, 0.01),
                (1e-3, 1e-5),
            ];
            for (beside, bound) in places {
                let state = motion.at(std::f64::consts::TAU + beside);
                assert!((state.theta_rate() + 0.75_f64.sqrt()).abs() < bound, "{beside:e}: {state:?}");
            }
            continue;
        };
        assert!(locks && error.to_string().contains("infinite velocity"), "{error}");
    }
}

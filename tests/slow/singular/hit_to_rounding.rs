//! Change points at multiples of π, where gradients are 10⁻¹⁶ and not zero: scaled to unit length they
//! counted as constraints like any other.

use core::f64::consts::PI;

use dynamics::error::{SolveError, StateError};

use super::*;

const TURNS: [f64; 7] = [-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0];

fn at(model: &Parallelogram, turns: f64, rates: [f64; 3]) -> Result<State<Parallelogram>, StateError> {
    let angle = turns * PI;
    // The coupler along the ground, turned by whole revolutions.
    let builder = model.state().crank(angle).coupler((turns - 1.0).max(0.0).floor() * 2.0 * PI).rocker(angle);
    builder.crank_rate(rates[0]).coupler_rate(rates[1]).rocker_rate(rates[2]).build()
}

#[test]
fn reactions_are_not_unique_and_velocities_on_no_branch_have_no_accelerations() {
    let model = Parallelogram::new(2.0, 0.0);
    let constants = model.constants().unwrap();
    for turns in TURNS {
        let start = at(&model, turns, [-1.0, 0.0, -1.0]).unwrap();
        let solved = solve_once(&model, &constants, &start).unwrap();
        assert!(!solved.unique() && solved.multipliers.amax() < 10.0, "{turns}: {solved:?}");
        let compared = model.compare_formulations(&start).unwrap();
        assert!(compared.rank == (1, 2) && !compared.unique, "{turns}: {compared}");
        assert!(compared.disagreement() < 1e-12, "{turns}: {compared}");
        // As at the exact place.
        let mut exact = at(&model, (turns % 2.0).abs(), [-1.0, 0.0, -1.0]).unwrap();
        exact.q[1] = 0.0;
        let there = solve_once(&model, &constants, &exact).unwrap();
        assert!((there.accelerations - solved.accelerations).amax() < 1e-13, "{turns}: {there:?} {solved:?}");
        let side = (turns * PI).cos();
        // Rates that Φ_q q̇ = 0 admits: a θ̇₁ cos θ + b θ̇₂ = a θ̇₃ cos θ.
        let astray = at(&model, turns, [1.0, 0.3, 1.0 + side * 0.48]).unwrap();
        let error = solve_once(&model, &constants, &astray).unwrap_err();
        assert!(matches!(error, SolveError::Contradiction { rank: 1, .. }), "{turns}: {error}");
    }
}

#[test]
fn starts_go_on_along_their_velocities_and_at_rest_under_weights_are_refused() {
    let model = Parallelogram::new(2.0, 0.0);
    for turns in TURNS {
        for formulation in [Formulation::Projected, Formulation::Embedded, Formulation::Augmented] {
            let run = |rate: f64| {
                let start = at(&model, turns, [rate, 0.0, rate]).unwrap();
                model.simulate(start).until(1.5).tolerance(1e-9).formulation(formulation).run()
            };
            let end = run(-1.0).unwrap_or_else(|error| panic!("{turns} {formulation}: {error}")).end();
            let truth = model.truth(turns * PI, -1.0, 1.5);
            let error = (end.crank() - truth).abs().max((end.rocker() - end.crank()).abs());
            assert!(error < 1e-7, "{turns} {formulation}: {error:e}");
            let error = run(0.0).unwrap_err();
            let message = error.to_string();
            let SimulationErrorKind::SingularStart { rows, coordinates } = error.kind else {
                panic!("{message}")
            };
            assert!(rows.contains("closure.x") && coordinates.contains("coupler"), "{message}");
            assert!(message.contains("constraint `closure.x` loses its gradient"), "{message}");
        }
    }
}

/// A step ended in the change point, to rounding; what followed was any position, at any energy, as a
/// success.
#[test]
fn fixed_steps_that_land_there_go_on_on_the_branch_or_say_where_they_are() {
    let model = Parallelogram::new(0.0, 0.0);
    let mut passed = 0;
    let formulations =
        [Formulation::Projected, Formulation::Embedded, Formulation::Augmented, Formulation::BaumgarteTied];
    for (rate, h) in [(-2.0, 0.05), (-2.0, 0.01), (-2.0, 0.001), (-1.0, 0.1), (-1.0, 0.01), (-1.0, 0.003)] {
        for formulation in formulations {
            let start = model.start(1.0, rate);
            let case = format!("{rate} {h} {formulation}");
            match model
                .simulate(start)
                .until(6.0)
                .method(methods::Rk4)
                .fixed_step(h)
                .formulation(formulation)
                .run()
            {
                Ok(motion) => {
                    passed += 1;
                    let (end, truth) = (motion.end(), 1.0 + 6.0 * rate);
                    assert!(
                        (end.crank() - truth).abs() < 1e-9 && (end.rocker() - truth).abs() < 1e-9,
                        "{case}"
                    );
                    assert!(motion.verify().energy_drift < 1e-9, "{case}: {}", motion.verify());
                }
                Err(error) => {
                    let near = error.state.crank().sin().abs();
                    let SimulationErrorKind::SingularPosition { ref rows, .. } = error.kind else {
                        panic!("{case}: {error}")
                    };
                    assert!(near < 2.0 * h * rate.abs() && rows.contains("closure.x"), "{case}: {error}");
                }
            }
        }
    }
    assert!(passed >= 20, "{passed}");
}

/// Two cranks whose pins a rod holds at a distance: a single row, and nothing beside it to compare its
/// gradient with.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(crank: rad, rocker: rad)]
#[units(inertia: kg * m^2, a: m, b: m, weight: N)]
struct Rod {
    inertia: f64,
    a: f64,
    b: f64,
    weight: f64,
}

#[dynamics]
impl Rod {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.inertia * (q.crank.dt().powi(2) + q.rocker.dt().powi(2))
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.weight * self.a * (q.crank.sin() + q.rocker.sin())
    }
    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        let pin = self.a * vec2(q.crank.cos(), q.crank.sin());
        let other = vec2(self.b, 0.0) + self.a * vec2(q.rocker.cos(), q.rocker.sin());
        0.5 * (other - pin).norm_squared() - 0.5 * self.b * self.b
    }
}

#[test]
fn a_single_row_that_vanishes_is_seen() {
    let model = Rod { inertia: 1.0, a: 0.5, b: 0.8, weight: 2.0 };
    let constants = model.constants().unwrap();
    for turns in TURNS {
        let start = |rates: [f64; 2]| {
            let builder = model.state().crank(turns * PI).rocker(turns * PI);
            builder.crank_rate(rates[0]).rocker_rate(rates[1]).build().unwrap()
        };
        let solved = solve_once(&model, &constants, &start([-1.0, -1.0])).unwrap();
        assert!(!solved.unique() && solved.multipliers[0].abs() < 10.0, "{turns}: {solved:?}");
        let error = solve_once(&model, &constants, &start([1.0, 0.3])).unwrap_err();
        assert!(matches!(error, SolveError::Contradiction { rank: 0, .. }), "{turns}: {error}");
        let end = model.simulate(start([-1.0, -1.0])).until(1.5).tolerance(1e-9).run().unwrap().end();
        let branch = Branch { inertia: 1.0, a: 0.5, weight: 2.0 };
        let alone = branch.state().crank(turns * PI).crank_rate(-1.0).build().unwrap();
        let truth = branch.simulate(alone).until(1.5).tolerance(1e-12).run().unwrap().end().crank();
        let error = (end.crank() - truth).abs().max((end.rocker() - truth).abs());
        assert!(error < 1e-7, "{turns}: {error:e}");
        let error = model.simulate(start([0.0, 0.0])).until(1.0).run().unwrap_err();
        assert!(matches!(error.kind, SimulationErrorKind::SingularStart { .. }), "{turns}: {error}");
    }
}

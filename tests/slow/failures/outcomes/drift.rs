//! Constraints that are not held, and those that are.

use super::*;

/// Nothing holds Φ = 0 where only Φ̈ = 0 is solved: at a loose tolerance the rod has grown by the limit
/// long before 1,000 s.
#[test]
fn unstabilised_motion_ends_where_it_has_left_the_constraint() {
    let model = pendulum();
    let start = model.state().x(1.0).build().unwrap();
    let run =
        |formulation| model.simulate(start).until(1000.0).tolerance(1e-6).formulation(formulation).run();
    let error = run(Formulation::Augmented).unwrap_err();
    let SimulationErrorKind::Drift { row, residual, distance, limit, .. } = error.kind else {
        panic!("{error}")
    };
    assert_eq!(row, "rod");
    assert!(residual.abs() > 1e-4 && distance > limit, "{error}");
    assert!(error.time > 1.0 && error.time < 1000.0, "{error}");
    let motion = error.motion(&model).unwrap();
    assert_eq!(motion.end_time(), error.time);
    let drift = motion.summary().constraints[0].residual;
    assert!(drift > 1e-4, "{drift}");
    // What the tolerance promises is kept by the projection over the whole time.
    let kept = run(Formulation::Projected).unwrap().verify();
    assert!(kept.constraints[0].residual < 1e-12 && kept.constraints[0].velocity_residual < 1e-12, "{kept}");
    // At a tight tolerance the drift stays small, grows with time, and is reported.
    let tight =
        model.simulate(start).until(1000.0).tolerance(1e-12).formulation(Formulation::Augmented).run();
    let tight = tight.unwrap().summary().constraints[0].residual;
    assert!(tight > 1e-10 && tight < 1e-3, "{tight:e}");
}

/// A sleigh on a spring to the origin, its knife in (x, y) and its centre of mass behind it.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, heading: rad)]
#[units(mass: kg, inertia: kg * m^2, behind: m, stiffness: N / m)]
struct Sleigh {
    mass: f64,
    inertia: f64,
    behind: f64,
    stiffness: f64,
}

#[dynamics]
impl Sleigh {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let centre = vec2(q.x, q.y) + self.behind * vec2(q.heading.cos(), q.heading.sin());
        0.5 * self.mass * centre.dt().norm_squared() + 0.5 * self.inertia * q.heading.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.stiffness * (q.x.powi(2) + q.y.powi(2))
    }
    #[nonholonomic]
    fn knife(&self, q: &Coordinates<Self>) -> Expr {
        q.y.dt() * q.heading.cos() - q.x.dt() * q.heading.sin()
    }
}

/// A knife has no position to drift in; what it slips ends the run all the same.
#[test]
fn a_knife_that_slips_ends_an_unstabilised_motion() {
    let model = Sleigh { mass: 1.0, inertia: 0.3, behind: 0.2, stiffness: 2.0 };
    let start = model.state().x(1.0).x_rate(0.5).heading_rate(2.0).build().unwrap();
    let run =
        |formulation| model.simulate(start).until(2000.0).tolerance(1e-3).formulation(formulation).run();
    let error = run(Formulation::Augmented).unwrap_err();
    let SimulationErrorKind::Drift { what, row, distance, limit, .. } = error.kind else { panic!("{error}") };
    assert_eq!((what, row), ("velocities", "knife"));
    // cos² + sin² = 1: the distance is the slip, and the limit is relative to the size of the sleigh and
    // its velocities.
    let there = &error.state;
    let (sine, cosine) = there.heading().sin_cos();
    let size = model.behind + there.x_rate().abs().max(there.y_rate().abs());
    let expected = 1e-3 * size * (sine.abs() + cosine.abs());
    assert!(distance > limit && distance < 10.0 * limit, "{error}");
    assert!((limit / expected - 1.0).abs() < 1e-12, "{limit} {expected}");
    assert!(error.time > 0.1 && error.time < 1000.0, "{error}");
    let kept = run(Formulation::Projected).unwrap().verify();
    assert!(kept.constraints[0].velocity_residual < 1e-12, "{kept}");
}

/// Gains beyond the region of stability of the method: errors of the constraint grow from step to step.
#[test]
fn gains_too_large_for_a_fixed_step_end_the_motion() {
    let model = pendulum();
    let start = model.state().x(1.0).build().unwrap();
    let run = |gain: f64| {
        let formulation = Formulation::Baumgarte { alpha: gain, beta: gain };
        model.simulate(start).until(10.0).method(methods::Rk4).fixed_step(0.01).formulation(formulation).run()
    };
    let good = run(50.0).unwrap().summary().constraints[0].residual;
    assert!(good < 1e-5, "{good:e}");
    let error = run(400.0).unwrap_err();
    assert!(matches!(error.kind, SimulationErrorKind::Drift { row: "rod", .. }), "{error}");
    assert!(error.time < 1.0, "{error}");
}

/// With step control the same gains give the motion, and cost steps.
#[test]
fn gains_too_large_for_the_motion_cost_steps() {
    let model = pendulum();
    let start = model.state().x(1.0).build().unwrap();
    let run = |gain: f64| {
        let formulation = Formulation::Baumgarte { alpha: gain, beta: gain };
        model.simulate(start).until(2.0).tolerance(1e-8).formulation(formulation).run().unwrap()
    };
    let (mild, strong) = (run(10.0), run(1000.0));
    assert!(strong.summary().steps > 10 * mild.summary().steps, "{}", strong.verify());
    assert!((strong.end().q - mild.end().q).norm() < 1e-6);
}

/// Gains may also be too small to hold anything.
#[test]
fn gains_of_zero_are_no_stabilisation() {
    let model = pendulum();
    let start = model.state().x(1.0).build().unwrap();
    let formulation = Formulation::Baumgarte { alpha: 0.0, beta: 0.0 };
    let error =
        model.simulate(start).until(1000.0).tolerance(1e-6).formulation(formulation).run().unwrap_err();
    assert!(matches!(error.kind, SimulationErrorKind::Drift { row: "rod", .. }), "{error}");
    let formulation = Formulation::Baumgarte { alpha: -1.0, beta: 1.0 };
    let error = model.simulate(start).until(1.0).formulation(formulation).run().unwrap_err();
    assert!(matches!(error.kind, SimulationErrorKind::Option(_)), "{error}");
}

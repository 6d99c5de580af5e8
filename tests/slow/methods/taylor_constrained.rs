//! Taylor series of derived models with constraints: against motions in minimal coordinates, closed solutions
//! and other methods; what they cannot do is refused.

use dynamics::model::{Constraints, ModelState, Vector};
use dynamics::prelude::*;

const TAYLOR: methods::Taylor = methods::Taylor { order: None };

/// A pendulum in Cartesian coordinates.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y)]
struct Bob {
    length: f64,
}

#[dynamics]
impl Bob {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * vec2(q.x, q.y).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        9.81 * q.y
    }
    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        vec2(q.x, q.y).norm() - self.length
    }
}

/// A bead of unit mass on a hoop that turns about a diameter, Φ in terms of time, without weight: its angle
/// from the axis obeys that of a pendulum.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y, z)]
struct Hoop {
    radius: f64,
    turn: f64,
}

#[dynamics]
impl Hoop {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * vec3(q.x, q.y, q.z).dt().norm_squared()
    }
    #[holonomic]
    fn sphere(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * (vec3(q.x, q.y, q.z).norm_squared() - self.radius.powi(2))
    }
    #[holonomic]
    fn plane(&self, q: &Coordinates<Self>) -> Expr {
        let angle = self.turn * q.t;
        q.y * angle.cos() - q.x * angle.sin()
    }
}

/// A crank of two equal bars, whose slider passes over the crank's bearing.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta, phi, x)]
struct EqualCrank {
    inertia: f64,
    bar: f64,
}

#[dynamics]
impl EqualCrank {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.inertia * (q.theta.dt().powi(2) + q.phi.dt().powi(2)) + 0.5 * q.x.dt().powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        q.theta.sin()
    }
    #[holonomic]
    fn closure(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, 0.0)
            - self.bar * vec2(q.theta.cos(), q.theta.sin())
            - self.bar * vec2(q.phi.cos(), q.phi.sin())
    }
}

/// A block that slides on a floor with Coulomb's friction.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y)]
struct Rubbing {
    mass: f64,
    mu: f64,
}

#[dynamics]
impl Rubbing {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        9.81 * self.mass * q.y
    }
    #[holonomic]
    fn floor(&self, q: &Coordinates<Self>) -> Expr {
        q.y - 0.1 * q.x
    }
    #[force]
    fn friction(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, -self.mu * q.reaction(Self::floor) * q.x.dt().signum())
    }
}

/// A bob whose rod is declared twice.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y)]
struct TwoRods {
    length: f64,
}

#[dynamics]
impl TwoRods {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * vec2(q.x, q.y).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        9.81 * q.y
    }
    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        vec2(q.x, q.y).norm() - self.length
    }
    #[holonomic]
    #[redundant]
    fn spare(&self, q: &Coordinates<Self>) -> Expr {
        vec2(q.x, q.y).norm_squared() - self.length.powi(2)
    }
}

/// Largest difference of coordinates and velocities.
fn distance<S: ModelState>(x: S, y: S) -> f64 {
    let pairs =
        x.q().as_slice().iter().zip(y.q().as_slice()).chain(x.u().as_slice().iter().zip(y.u().as_slice()));
    pairs.fold(0.0, |most, (a, b)| most.max((a - b).abs()))
}

/// Largest |Φ| and |Φ̇| at a state.
fn drift<M: Constraints>(model: &M, state: &M::State) -> f64 {
    let (place, velocity) = (model.residual(state), model.velocity_residual(state));
    place.as_slice().iter().chain(velocity.as_slice()).fold(0.0, |most: f64, x| most.max(x.abs()))
}

const BOB: Bob = Bob { length: 1.0 };

#[test]
fn the_error_follows_the_tolerance_down_to_rounding() {
    let start = BOB.state().x(0.8).y(-0.6).build().unwrap();
    let truth = BOB.simulate(start).until(10.0).tolerance(1e-15).run().unwrap().end();
    for tolerance in [1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-15] {
        let motion = BOB.simulate(start).until(10.0).tolerance(tolerance).method(TAYLOR).run().unwrap();
        let error = distance(motion.end(), truth);
        assert!(error < 100.0 * tolerance + 3e-13, "{tolerance:e}: {error:e}");
        assert!(
            tolerance < 1e-11 || error > 1e-3 * tolerance,
            "{tolerance:e}: {error:e}, no tolerance was used"
        );
        assert!(motion.steps().all(|state| drift(&BOB, &state) < 1e-14), "{}", motion.verify());
    }
}

/// Positions, velocities and multipliers at the order that is asked for; Φ, without projection, at no less.
#[test]
fn errors_fall_with_the_power_of_the_order() {
    let start = BOB.state().x(0.8).y(-0.6).x_rate(0.6).y_rate(0.8).build().unwrap();
    let truth = BOB.simulate(start).until(1.0).tolerance(1e-15).method(TAYLOR).run().unwrap();
    for order in [4, 6, 8, 12] {
        let method = methods::Taylor { order: Some(order) };
        let errors = |h: f64| {
            let run = |formulation| {
                BOB.simulate(start)
                    .until(1.0)
                    .fixed_step(h)
                    .formulation(formulation)
                    .method(method)
                    .run()
                    .unwrap()
            };
            let (projected, plain) = (run(Formulation::Projected), run(Formulation::Augmented));
            let reaction = |motion: &Motion<'_, Bob>| motion.multipliers_at(1.0)[0];
            let of_lambda = (reaction(&projected) - reaction(&truth)).abs();
            [distance(projected.end(), truth.end()), of_lambda, drift(&BOB, &plain.end())]
        };
        let h = [0.02, 0.04, 0.1, 0.2][[4, 6, 8, 12].iter().position(|p| *p == order).unwrap()];
        let (coarse, fine) = (errors(h), errors(0.5 * h));
        for (i, what) in ["state", "multiplier", "drift"].into_iter().enumerate() {
            let found = (coarse[i] / fine[i]).log2();
            assert!(
                found > order as f64 - 0.8,
                "{what} at order {order}: {:e} → {:e}, {found}",
                coarse[i],
                fine[i]
            );
        }
    }
}

#[test]
fn states_and_reactions_between_steps_are_as_accurate_as_at_them() {
    let start = BOB.state().x(0.8).y(-0.6).build().unwrap();
    let truth = BOB.simulate(start).until(3.0).tolerance(1e-15).run().unwrap();
    let motion = BOB.simulate(start).until(3.0).tolerance(1e-11).method(TAYLOR).run().unwrap();
    for i in 0..=300 {
        let t = 0.01 * f64::from(i);
        let (state, exact) = (motion.at(t), truth.at(t));
        // The reference is interpolated with 1e-10 of its own; energy and constraint have none.
        assert!(distance(state, exact) < 1e-9, "t = {t}");
        assert!(drift(&BOB, &state) < 1e-11, "t = {t}: {:e}", drift(&BOB, &state));
        let (energy, at) = (BOB.energy_function(&start), BOB.energy_function(&state));
        assert!((energy - at).abs() < 1e-10, "t = {t}: {:e}", energy - at);
        // λ = −(u² − g y): Φ has a gradient of unit length.
        let lambda = -(state.u().norm_squared() - 9.81 * state.y());
        assert!((motion.multipliers_at(t)[0] - lambda).abs() < 1e-9, "t = {t}");
    }
}

#[test]
fn constraints_that_move_are_followed_forwards_and_backwards() {
    let hoop = Hoop { radius: 0.5, turn: 3.0 };
    let start = hoop.state().x(0.3).z(0.4).x_rate(0.4).y_rate(0.9).z_rate(-0.3).build().unwrap();
    let truth = hoop.simulate(start).until(4.0).tolerance(1e-14).run().unwrap().end();
    let there = hoop.simulate(start).until(4.0).tolerance(1e-14).method(TAYLOR).run().unwrap();
    let error = distance(there.end(), truth);
    assert!(error < 1e-11, "{error:e}");
    assert!(there.steps().all(|state| drift(&hoop, &state) < 1e-13), "{}", there.verify());
    // ½ (ż² + …) − ½ Ω² ρ² is kept in the turning frame: T − Ω L with L the moment of momentum about the
    // axis.
    let jacobi =
        |s: &State<Hoop>| 0.5 * s.u().norm_squared() - 3.0 * (s.x() * s.y_rate() - s.y() * s.x_rate());
    let lost = there.steps().map(|s| (jacobi(&s) - jacobi(&start)).abs()).fold(0.0, f64::max);
    assert!(lost < 1e-13, "{lost:e}");
    let back = hoop.simulate(there.end()).until(0.0).tolerance(1e-14).method(TAYLOR).run().unwrap();
    assert!(distance(back.end(), start) < 1e-11, "{:e}", distance(back.end(), start));
}

/// At θ = ±π/2 the slider lies over the bearing, and both bars could turn as one: the way out is not decided
/// by the equations there.
#[test]
fn singular_positions_are_passed_or_named() {
    let model = EqualCrank { inertia: 0.4, bar: 1.0 };
    // On the branch φ = −θ: (I + ½ (2 sin θ)²) θ̇² + sin θ is kept.
    let energy = |s: &State<EqualCrank>| model.energy_function(s);
    for (k, rate) in [3.0, 3.1, 3.3, 4.0, 5.0, 7.0].into_iter().enumerate() {
        let start = model.state().theta(0.3).phi(-0.3).x(2.0 * 0.3f64.cos());
        let slide = -2.0 * 0.3f64.sin() * rate;
        let start = start.theta_rate(rate).phi_rate(-rate).x_rate(slide).build().unwrap();
        for tolerance in [1e-6, 1e-9, 1e-12] {
            let run = model.simulate(start).until(6.0).tolerance(tolerance).method(TAYLOR).run();
            match run {
                Ok(motion) => {
                    let end = motion.end();
                    let kept = (energy(&end) - energy(&start)).abs();
                    let branch = (end.theta() + end.phi()).abs();
                    let good = kept < 1e4 * tolerance && branch < 1e4 * tolerance;
                    assert!(
                        good,
                        "{k} {tolerance:e}: energy {kept:e}, branch {branch:e}\n{}",
                        motion.verify()
                    );
                }
                Err(error) => {
                    let text = error.to_string();
                    assert!(text.contains("closure"), "{k} {tolerance:e}: {text}");
                }
            }
        }
    }
    // Exactly there: both ways are open.
    let quarter = core::f64::consts::FRAC_PI_2;
    let start = model
        .state()
        .theta(quarter)
        .phi(-quarter)
        .theta_rate(3.0)
        .phi_rate(-3.0)
        .x_rate(-6.0)
        .build()
        .unwrap();
    match model.simulate(start).until(1.0).tolerance(1e-9).method(TAYLOR).run() {
        Ok(motion) => {
            let end = motion.end();
            assert!((end.theta() + end.phi()).abs() < 1e-6, "{}", motion.verify());
        }
        Err(error) => assert!(error.to_string().contains("closure"), "{error}"),
    }
}

/// A parallelogram of three bars by their angles, its ground as long as its coupler: folded flat it could go
/// on as an antiparallelogram.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(crank, coupler, rocker)]
struct Parallelogram {
    inertia: f64,
    weight: f64,
}

#[dynamics]
impl Parallelogram {
    fn along(&self, length: f64, angle: Expr) -> Vec2 {
        length * vec2(angle.cos(), angle.sin())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.inertia * (q.crank.dt().powi(2) + q.coupler.dt().powi(2) + q.rocker.dt().powi(2))
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.weight * (q.crank.sin() + q.rocker.sin())
    }
    #[holonomic]
    fn closure(&self, q: &Coordinates<Self>) -> Vec2 {
        self.along(1.0, q.crank) + self.along(2.0, q.coupler) - self.along(1.0, q.rocker) - vec2(2.0, 0.0)
    }
}

/// On its branch the coupler stays along the ground, and the crank is a pendulum: I θ̈ = −w cos θ.
#[test]
fn change_points_are_passed_on_the_branch_or_named() {
    let model = Parallelogram { inertia: 0.3, weight: 1.0 };
    let mut passed = 0;
    for k in 0..12 {
        let rate = 5.0 + 0.37 * f64::from(k);
        let start = model.state().crank(0.8).rocker(0.8).crank_rate(rate).rocker_rate(rate).build().unwrap();
        for tolerance in [1e-6, 1e-9, 1e-12] {
            let Ok(motion) =
                model.simulate(start).until(4.0).tolerance(tolerance).method(TAYLOR).run().inspect_err(
                    |error| assert!(error.to_string().contains("closure"), "{k} {tolerance:e}: {error}"),
                )
            else {
                continue;
            };
            let end = motion.end();
            let energy = |s: &State<Parallelogram>| model.energy_function(s);
            let off = [end.coupler(), end.crank() - end.rocker(), energy(&end) - energy(&start)];
            let worst = off.into_iter().fold(0.0, |most: f64, x| most.max(x.abs()));
            assert!(worst < 1e3 * tolerance + 1e-9, "{k} {tolerance:e}: {off:?}\n{}", motion.verify());
            passed += 1;
        }
    }
    assert!(passed > 30, "{passed}");
}

#[test]
fn what_has_no_series_is_refused_with_a_reason() {
    let start = BOB.state().x(1.0).build().unwrap();
    for formulation in [Formulation::Baumgarte { alpha: 5.0, beta: 5.0 }, Formulation::BaumgarteTied] {
        let run = BOB.simulate(start).until(1.0).method(TAYLOR).formulation(formulation);
        let refused = run.run().unwrap_err().to_string();
        assert!(refused.contains("satisfy the constraints in every coefficient"), "{refused}");
        assert!(refused.contains("drop `.formulation(..)`"), "{refused}");
    }
    let block = Rubbing { mass: 2.0, mu: 0.3 };
    let start = block.state().x_rate(1.0).y_rate(0.1).build().unwrap();
    let refused = block.simulate(start).until(1.0).method(TAYLOR).run().unwrap_err().to_string();
    assert!(refused.contains("its forces depend on reactions"), "{refused}");
    let twice = TwoRods { length: 1.0 };
    let start = twice.state().x(1.0).build().unwrap();
    let refused = twice.simulate(start).until(1.0).method(TAYLOR).run().unwrap_err().to_string();
    assert!(refused.contains("its constraints repeat each other"), "{refused}");
}

//! Constraints as the language declares them: what the macro emits against hand results and against the
//! model's own functions on jets.
#![allow(missing_docs, unreachable_pub, reason = "models as users write them")]

use dynamics::constrain::{solve_general, solve_once, with_workspace};
use dynamics::error::SolveError;
use dynamics::model::{ConstraintKind, Constraints, Terms, Vector};
use dynamics::prelude::*;
use proptest::prelude::*;

/// A mass point on a rod, in Cartesian coordinates.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(m: kg, l: m, g: m / s^2)]
pub struct Pendulum {
    pub m: f64,
    pub l: f64,
    pub g: f64,
}

#[dynamics]
impl Pendulum {
    fn place(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, q.y)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * self.place(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * q.y
    }
    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * (self.place(q).norm_squared() - self.l.powi(2))
    }
    #[output]
    fn tension(&self, q: &Coordinates<Self>) -> Expr {
        -q.reaction(Self::rod) * self.l
    }
}

#[test]
fn the_cartesian_pendulum() {
    let model = Pendulum { m: 2.0, l: 1.5, g: 9.81 };
    let (angle, rate) = (0.7_f64, 1.3_f64);
    let (s, c) = angle.sin_cos();
    let (l, g) = (model.l, model.g);
    let state = model.state().x(l * s).y(-l * c).x_rate(l * c * rate).y_rate(l * s * rate).build().unwrap();
    assert!(model.residual(&state)[0].abs() < 1e-15);
    assert!(model.velocity_residual(&state)[0].abs() < 1e-15);
    let (j, gamma) = (model.jacobian(&state), model.gamma(&state));
    assert!((j[(0, 0)] - l * s).abs() < 1e-15 && (j[(0, 1)] + l * c).abs() < 1e-15);
    assert!((gamma[0] + l * l * rate * rate).abs() < 1e-14);
    // θ̈ = −(g/l) sin θ, tension m(g cos θ + l θ̇²).
    let turning = -g / l * s;
    let a = model.accelerations(&state).unwrap();
    assert!((a[0] - l * (c * turning - s * rate * rate)).abs() < 1e-13, "{a}");
    assert!((a[1] - l * (s * turning + c * rate * rate)).abs() < 1e-13, "{a}");
    let mut outputs = [0.0];
    model.outputs(&state, &mut outputs).unwrap();
    assert!((outputs[0] - model.m * (g * c + l * rate * rate)).abs() < 1e-12, "{outputs:?}");
    assert_eq!(Pendulum::ROWS[0].name, "rod");
    assert_eq!(Pendulum::ROWS[0].unit, "m^2");
    assert_eq!(Pendulum::OUTPUTS[0].unit, "N");
}

/// Every shape that a constraint can have, fixed, moving and nonholonomic; outputs of everything that
/// constraints add.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(a: [_; 3], b: [_; 3], theta, s)]
pub struct Linkage {
    pub m: [f64; 3],
    pub l: f64,
    pub r: f64,
    pub k: f64,
}

#[dynamics]
impl Linkage {
    fn first(&self, q: &Coordinates<Self>) -> Vec3 {
        vec3(q.a[0], q.a[1], q.a[2])
    }
    fn second(&self, q: &Coordinates<Self>) -> Vec3 {
        vec3(q.b[0], q.b[1], q.b[2])
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let turning =
            self.m[2] * (q.theta.dt().powi(2) + q.s.dt().powi(2) + 0.3 * q.s.cos() * q.s.dt() * q.theta.dt());
        0.5 * self.m[0] * self.first(q).dt().norm_squared()
            + 0.5 * self.m[1] * self.second(q).dt().norm_squared()
            + turning
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.k * (q.b[2].powi(2) + q.theta.powi(2)) + q.a[2]
    }
    // Declared before the holonomic ones, and yet behind them in the rows.
    #[nonholonomic]
    fn skate(&self, q: &Coordinates<Self>) -> [Expr; 1] {
        [q.b[0].dt() * q.b[2].sin() - q.b[1].dt() * q.b[2].cos() - 0.2 * self.r * q.t.cos()]
    }
    #[holonomic]
    fn link(&self, q: &Coordinates<Self>) -> Expr {
        (self.first(q) - self.second(q)).norm_squared() - self.l.powi(2)
    }
    #[output]
    fn forces(&self, q: &Coordinates<Self>) -> Vec2 {
        q.reaction(Self::crank) * self.total(q)
    }
    #[holonomic]
    fn crank(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.a[0] - self.r * q.t.cos() * q.theta, q.a[1] - self.r * (2.0 * q.t).sin())
    }
    #[holonomic]
    fn gears(&self, q: &Coordinates<Self>) -> [Expr; 1] {
        [q.s - (q.theta * self.r).sin()]
    }
    fn total(&self, q: &Coordinates<Self>) -> Expr {
        q.reaction(Linkage::link) * q.a[2] + q.reaction(Self::skate)[0]
    }
    #[output]
    fn accelerated(&self, q: &Coordinates<Self>) -> Expr {
        self.second(q).dt().dt().norm_squared() + q.reaction(Self::gears)[0]
    }
    #[event]
    fn slack(&self, q: &Coordinates<Self>) -> Expr {
        q.reaction(Self::link)
    }
}

fn linkage() -> Linkage {
    Linkage { m: [1.2, 0.7, 0.4], l: 1.1, r: 0.8, k: 2.0 }
}

/// Any state, on the constraints or not.
fn state(values: &[f64]) -> LinkageState {
    let vector = |values: &[f64]| nalgebra::SVector::from_column_slice(values);
    LinkageState::new(values[16], vector(&values[..8]), vector(&values[8..16]), Vector::zeros())
}

#[track_caller]
fn near(a: f64, b: f64, scale: f64, what: &str) {
    assert!((a - b).abs() <= 1e-10 * (1.0 + scale.abs()), "{what}: {a} and {b}");
}

#[test]
fn rows_are_in_the_order_of_the_contract() {
    let names: Vec<&str> = Linkage::ROWS.iter().map(|r| r.name).collect();
    assert_eq!(names, ["link", "crank.x", "crank.y", "gears[0]", "skate[0]"]);
    let listed: Vec<(&str, usize, usize)> =
        Linkage::CONSTRAINTS.iter().map(|c| (c.name, c.first, c.rows)).collect();
    assert_eq!(listed, [("link", 0, 1), ("crank", 1, 2), ("gears", 3, 1), ("skate", 4, 1)]);
    assert_eq!(Linkage::CONSTRAINTS[3].kind, ConstraintKind::Nonholonomic);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    /// d²Φ/dt² = Φ_q q̈ − γ for any q̈, by the jets of the same functions.
    #[test]
    fn compiled_constraints_agree_with_jets(values in proptest::collection::vec(-1.5..1.5f64, 25)) {
        let (model, state) = (linkage(), state(&values));
        let mut a = nalgebra::SVector::<f64, 8>::zeros();
        a.as_mut_slice().copy_from_slice(&values[17..]);
        let q = Linkage::coordinates_with(&state, &a, &[]);
        let (crank, [gears]) = (model.crank(&q), model.gears(&q));
        let holonomic = [model.link(&q), crank.x, crank.y, gears];
        let (residual, rates) = (model.residual(&state), model.velocity_residual(&state));
        let (jacobian, gamma) = (model.jacobian(&state), model.gamma(&state));
        for (i, phi) in holonomic.into_iter().enumerate() {
            near(residual[i], phi.value(), 1.0, "Φ");
            near(rates[i], phi.rate(), 10.0, "Φ̇");
            near((jacobian * a)[i] - gamma[i], phi.acceleration(), 100.0, "Φ̈");
        }
        let [skate] = model.skate(&q);
        near(rates[4], skate.value(), 10.0, "A q̇ + b");
        near((jacobian * a)[4] - gamma[4], skate.rate(), 100.0, "d/dt (A q̇ + b)");
        let (velocity, offset) = (model.velocity_jacobian(&state), model.velocity_offset(&state));
        near((velocity * state.u)[0] + offset[0], skate.value(), 10.0, "A and b");
        prop_assert_eq!(velocity.row(0), jacobian.row(4));
    }

    /// M q̈ = Q + Φ_qᵀλ and Φ_q q̈ = γ; by the general solver as by the route that was chosen; outputs and
    /// events read that solution.
    #[test]
    fn the_solution_solves_and_is_read(values in proptest::collection::vec(-1.5..1.5f64, 17)) {
        let (model, state) = (linkage(), state(&values));
        let solved = solve_once(&model, &model.constants().unwrap(), &state);
        let general = with_workspace::<Linkage, _>(|workspace| solve_general(&model, &state, workspace));
        let (Ok(solved), Ok(general)) = (solved, general) else {
            return Err(TestCaseError::reject("singular"));
        };
        let (a, lambda) = (solved.accelerations, solved.multipliers);
        let size = a.norm() + lambda.norm();
        prop_assume!(size < 1e4);
        let jacobian = model.jacobian(&state);
        let left = model.mass_matrix(&state) * a;
        let right = model.generalized_force(&state) + jacobian.transpose() * lambda;
        (0..8).for_each(|i| near(left[i], right[i], size, "M q̈ = Q + Φ_qᵀλ"));
        (0..5).for_each(|i| near((jacobian * a)[i], model.gamma(&state)[i], size, "Φ_q q̈ = γ"));
        (0..5).for_each(|i| near(lambda[i], general.multipliers[i], 1e2 * size, "λ by two routes"));
        (0..8).for_each(|i| near(a[i], general.accelerations[i], 1e2 * size, "q̈ by two routes"));
        prop_assert_eq!(model.accelerations(&state).unwrap(), a);

        let q = Linkage::coordinates_with(&state, &a, lambda.as_slice());
        let mut outputs = [f64::NAN; 3];
        model.outputs(&state, &mut outputs).unwrap();
        let forces = model.forces(&q);
        near(outputs[0], forces.x.value(), size * size, "forces.x");
        near(outputs[1], forces.y.value(), size * size, "forces.y");
        near(outputs[2], model.accelerated(&q).value(), size * size, "accelerated");
        let mut events = [f64::NAN];
        model.events(&state, &mut events).unwrap();
        near(events[0], lambda[0], size, "slack");
    }

    /// A correction r of the constraints: M δ = Φ_qᵀμ, Φ_q δ = r.
    #[test]
    fn corrections_correct(values in proptest::collection::vec(-1.5..1.5f64, 22)) {
        let (model, state) = (linkage(), state(&values));
        let mut right = <Linkage as Constraints>::Rows::zeros();
        right.as_mut_slice().copy_from_slice(&values[17..]);
        let constants = model.constants().unwrap();
        let Some(delta) = model.correct_unrolled(&constants, &state, &right) else {
            let general = matches!(Linkage::SOLVER, dynamics::model::SolverKind::General { .. });
            return if general { Ok(()) } else { Err(TestCaseError::reject("singular")) };
        };
        let (jacobian, left) = (model.jacobian(&state), model.mass_matrix(&state) * delta);
        // The μ that comes closest.
        let Some(across) = (jacobian * jacobian.transpose()).try_inverse() else {
            return Err(TestCaseError::reject("singular"));
        };
        let mu = across * jacobian * left;
        let size = (delta.norm() + mu.norm()) * (1.0 + across.norm());
        prop_assume!(size < 1e4);
        let force = jacobian.transpose() * mu;
        (0..8).for_each(|i| near(left[i], force[i], size, "M δ = Φ_qᵀμ"));
        (0..5).for_each(|i| near((jacobian * delta)[i], right[i], size, "Φ_q δ = r"));
    }

    /// ∂q̈/∂q and ∂q̈/∂q̇ of the constrained motion, off the manifold too, against central differences of
    /// sixth order.
    #[test]
    fn linearisations_agree_with_differences(values in proptest::collection::vec(-1.5..1.5f64, 17)) {
        let (model, state) = (linkage(), state(&values));
        let Ok(jacobian) = model.state_jacobian(&state) else {
            return Err(TestCaseError::reject("singular"));
        };
        let a = model.accelerations(&state).unwrap();
        // Where elimination is near a singularity, differences say little.
        prop_assume!(a.norm() < 1e2 && jacobian.by_q.norm() < 1e3);
        near((jacobian.accelerations - a).norm(), 0.0, a.norm(), "q̈");
        let h = 1e-3;
        for j in 0..8 {
            for along_u in [false, true] {
                let at = |k: f64| {
                    let mut s = state;
                    if along_u { s.u[j] += k * h } else { s.q[j] += k * h }
                    model.accelerations(&s).unwrap()
                };
                let d = |k: f64| at(k) - at(-k);
                let expected = (d(1.0) * 45.0 - d(2.0) * 9.0 + d(3.0)) / (60.0 * h);
                let found = if along_u { jacobian.by_u.column(j) } else { jacobian.by_q.column(j) };
                let size = 1.0 + jacobian.by_q.norm() + jacobian.by_u.norm();
                prop_assert!((found - expected).norm() <= 1e-6 * size * size, "{along_u} {j}: {found} \
                    {expected}");
            }
        }
    }

    /// What the general solver reads at once is what the single functions give.
    #[test]
    fn terms_are_the_same(values in proptest::collection::vec(-1.5..1.5f64, 17)) {
        let (model, state) = (linkage(), state(&values));
        let (mut mass, mut force, mut jacobian, mut gamma) = ([1.0; 64], [1.0; 8], [1.0; 40], [1.0; 5]);
        model.terms(&state, &mut Terms {
            mass: &mut mass,
            force: &mut force,
            jacobian: &mut jacobian,
            gamma: &mut gamma
        });
        let (m, q, j, g) =
            (model.mass_matrix(&state), model.generalized_force(&state),
                model.jacobian(&state), model.gamma(&state));
        (0..64).for_each(|i| near(mass[i], m[(i / 8, i % 8)], 1.0, "M"));
        (0..8).for_each(|i| near(force[i], q[i], 1.0, "Q"));
        (0..40).for_each(|i| near(jacobian[i], j[(i / 8, i % 8)], 1.0, "Φ_q"));
        (0..5).for_each(|i| near(gamma[i], g[i], 10.0, "γ"));
    }

    /// ∂(Φ_qᵀλ)/∂q, ∂γ/∂q, ∂γ/∂q̇ against central differences of fourth order.
    #[test]
    fn derivatives_agree_with_differences(values in proptest::collection::vec(-1.5..1.5f64, 22)) {
        let (model, state) = (linkage(), state(&values));
        let mut lambda = <Linkage as Constraints>::Rows::zeros();
        lambda.as_mut_slice().copy_from_slice(&values[17..]);
        let mut derivatives = [f64::NAN; 64 + 80];
        model.constraint_derivatives(&state, &lambda, &mut derivatives);
        let h = 1e-3;
        let difference = |along_u: bool, j: usize, f: &dyn Fn(&LinkageState) -> f64| {
            let at = |k: f64| {
                let mut s = state;
                if along_u { s.u[j] += k * h } else { s.q[j] += k * h }
                f(&s)
            };
            (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * h)
        };
        for j in 0..8 {
            for i in 0..8 {
                let expected = difference(false, j, &|s| (model.jacobian(s).transpose() * lambda)[i]);
                prop_assert!((derivatives[8 * i + j] - expected).abs() < 1e-8, "∂(Φ_qᵀλ)/∂q {i} {j}");
            }
            for i in 0..5 {
                let by_q = difference(false, j, &|s| model.gamma(s)[i]);
                prop_assert!((derivatives[64 + 8 * i + j] - by_q).abs() < 1e-7, "∂γ/∂q {i} {j}");
                let by_u = difference(true, j, &|s| model.gamma(s)[i]);
                prop_assert!((derivatives[104 + 8 * i + j] - by_u).abs() < 1e-8, "∂γ/∂q̇ {i} {j}");
            }
        }
    }
}

/// A block on an incline, which sticks, slides or flies; dry friction of the reaction of the same instant.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(m: kg, g: m / s^2)]
pub struct Block {
    pub m: f64,
    pub g: f64,
    pub slope: f64,
    pub friction: f64,
}

#[dynamics]
impl Block {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2))
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * (q.y * self.slope.cos() - q.x * self.slope.sin())
    }
    #[holonomic(switched)]
    fn floor(&self, q: &Coordinates<Self>) -> Expr {
        q.y
    }
    #[nonholonomic(switched, integrable)]
    fn stick(&self, q: &Coordinates<Self>) -> Expr {
        q.x.dt()
    }
    #[force]
    fn rubbing(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, -self.friction * q.reaction(Self::floor) * q.slip(Self::stick))
    }
    #[output]
    fn normal(&self, q: &Coordinates<Self>) -> Expr {
        q.reaction(Self::floor)
    }
    #[output]
    fn side(&self, q: &Coordinates<Self>) -> Expr {
        q.slip(Self::stick)
    }
    #[event]
    fn breakaway(&self, q: &Coordinates<Self>) -> Expr {
        self.friction * q.reaction(Self::floor) - q.reaction(Self::stick).abs()
    }
}

/// q̈, outputs and the event.
fn evaluated(model: &Block, state: &BlockState) -> (f64, f64, [f64; 2], f64) {
    let (mut outputs, mut events) = ([f64::NAN; 2], [f64::NAN]);
    model.outputs(state, &mut outputs).unwrap();
    model.events(state, &mut events).unwrap();
    let a = model.accelerations(state).unwrap();
    (a[0], a[1], outputs, events[0])
}

#[test]
fn a_block_sticks_and_flies() {
    let model = Block { m: 2.0, g: 9.81, slope: 0.4, friction: 0.3 };
    let (s, c) = model.slope.sin_cos();
    let normal = model.m * model.g * c;
    const { assert!(Block::FRICTION) };
    assert_eq!(Block::ROWS.iter().map(|r| r.unit).collect::<Vec<_>>(), ["m", "m/s"]);

    let sticking = model.state().build().unwrap();
    let (ax, ay, [n, side], breakaway) = evaluated(&model, &sticking);
    near(ax, 0.0, 1.0, "it sticks");
    near(ay, 0.0, 1.0, "it stays on the floor");
    near(n, normal, 1.0, "normal force");
    near(breakaway, model.friction * normal - model.m * model.g * s, 1.0, "friction that is left");
    assert_eq!(side, 0.0);

    let flying = model.state().y(1.0).release("floor").release("stick").build().unwrap();
    let (ax, ay, [n, _], _) = evaluated(&model, &flying);
    near(ax, model.g * s, 1.0, "it falls");
    near(ay, -model.g * c, 1.0, "it falls");
    assert_eq!(n, 0.0);
}

#[test]
fn a_block_slides() {
    let model = Block { m: 2.0, g: 9.81, slope: 0.4, friction: 0.3 };
    let (s, c) = model.slope.sin_cos();
    let normal = model.m * model.g * c;
    for (u, side) in [(0.5, 1.0), (-0.5, -1.0)] {
        let mut sliding = model.state().build().unwrap();
        sliding.active_set_mut().release(1, side);
        sliding.set_x_rate(u);
        let (ax, ay, outputs, _) = evaluated(&model, &sliding);
        near(ax, model.g * (s - side * model.friction * c), 1.0, "it slides");
        near(ay, 0.0, 1.0, "it stays on the floor");
        assert_eq!(outputs[1], side);
        let q = Block::coordinates_with(&sliding, &Vector::zeros(), &[normal, 0.0]);
        assert_eq!(q.slip(Block::stick).value(), side);
        assert_eq!(q.reaction(Block::floor).value(), normal);
        assert_eq!(q.slip(Block::floor).value(), 0.0);
        // No constraint, and reactions that are not at hand, are not numbers.
        assert!(q.reaction(Block::gravity).value().is_nan() && q.slip(Block::gravity).value().is_nan());
        let unsolved = Block::coordinates_with(&sliding, &Vector::zeros(), &[]);
        assert!(unsolved.reaction(Block::floor).value().is_nan());
        // Powers: gravity is in the energy, friction takes away.
        let mut powers = [f64::NAN; 1];
        model.powers(&sliding, &mut powers);
        near(powers[0], -side * model.friction * normal * u, 1.0, "power of friction");
    }
}

#[test]
fn forces_that_depend_on_reactions_come_with_their_derivative() {
    let model = Block { m: 2.0, g: 9.81, slope: 0.4, friction: 0.3 };
    let mut state = model.state().build().unwrap();
    state.active_set_mut().release(1, 1.0);
    let lambda = nalgebra::Vector2::new(7.0, 3.0);
    let (mut force, mut by) = ([f64::NAN; 2], [f64::NAN; 4]);
    model.friction(&state, &lambda, &mut force, &mut by);
    let weight = model.m * model.g;
    near(force[0], weight * model.slope.sin() - model.friction * 7.0, 1.0, "Q₁(λ)");
    near(force[1], -weight * model.slope.cos(), 1.0, "Q₂(λ)");
    assert_eq!(by, [-model.friction, 0.0, 0.0, 0.0]);
    let (mut mass, mut jacobian, mut gamma) = ([0.0; 4], [0.0; 4], [0.0; 2]);
    model.terms(
        &state,
        &mut Terms { mass: &mut mass, force: &mut force, jacobian: &mut jacobian, gamma: &mut gamma },
    );
    near(force[0], weight * model.slope.sin(), 1.0, "without reactions");
}

/// A bead on a wire that lets go.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y)]
pub struct Bead {
    pub m: f64,
    pub g: f64,
}

#[dynamics]
impl Bead {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2))
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * q.y
    }
    #[holonomic(switched)]
    fn wire(&self, q: &Coordinates<Self>) -> Expr {
        q.y - q.x.powi(2)
    }
}

#[test]
fn derivatives_that_do_not_exist_are_errors() {
    let bead = Bead { m: 1.0, g: 9.81 };
    let on_wire = bead.state().x(0.5).y(0.25).build().unwrap();
    assert!(bead.state_jacobian(&on_wire).is_ok());
    let mut free = on_wire;
    free.release("wire").unwrap();
    assert_eq!(bead.accelerations(&free).unwrap().as_slice(), [0.0, -9.81]);
    let error = bead.state_jacobian(&free).unwrap_err();
    assert_eq!(error, SolveError::Released { constraint: "wire" });
    let flying = bead.solve_unrolled(&bead.constants().unwrap(), &free).unwrap();
    assert_eq!((flying.accelerations.as_slice(), flying.multipliers[0]), (&[0.0, -9.81][..], 0.0));
    let massless = Bead { m: 0.0, ..bead };
    assert!(massless.accelerations(&on_wire).is_err() && massless.state_jacobian(&on_wire).is_err());

    let pendulum = Pendulum { m: 2.0, l: 1.5, g: 9.81 };
    let origin = PendulumState::new(0.0, Vector::zeros(), Vector::zeros(), Vector::zeros());
    let error = pendulum.state_jacobian(&origin).unwrap_err();
    assert!(matches!(error, SolveError::DependentRow { row: "rod", .. }), "{error}");
    assert!(pendulum.solve_unrolled(&pendulum.constants().unwrap(), &origin).is_none());
    assert!(pendulum.accelerations(&origin).is_err(), "the rod has no direction");
}

#[test]
fn states_are_checked_and_completed() {
    let model = Pendulum { m: 2.0, l: 1.5, g: 9.81 };
    let error = model.state().x(1.0).y(0.3).build().unwrap_err();
    assert!(error.to_string().contains("`rod`"), "{error}");
    for (guess, sign) in [(-1.0, -1.0), (1.0, 1.0)] {
        let state = model.state().x(0.9).y_guess(guess).x_rate(0.4).assemble().unwrap();
        assert_eq!((state.x(), state.x_rate()), (0.9, 0.4));
        near(state.y(), sign * 1.2, 1.0, "the branch of the guess");
        near(state.y_rate(), -0.4 * 0.9 / state.y(), 1.0, "tangential");
        near(model.velocity_residual(&state)[0], 0.0, 1.0, "Φ̇");
    }
    assert!(model.state().x(2.0).assemble().is_err(), "the rod is shorter");

    let block = Block { m: 2.0, g: 9.81, slope: 0.4, friction: 0.3 };
    let mut state = block.state().release("stick").build().unwrap();
    assert_eq!((state.is_engaged("stick"), state.is_engaged("floor")), (Ok(false), Ok(true)));
    state.engage("stick").unwrap();
    state.release("floor").unwrap();
    assert_eq!((state.is_engaged("stick"), state.is_engaged("floor")), (Ok(true), Ok(false)));
    let unknown = block.state().release("flor").build().unwrap_err();
    assert_eq!(unknown.to_string(), "no switched constraint is called `flor`; there are `floor`, `stick`");
    let fixed = model.state().release("rod").build().unwrap_err();
    assert_eq!(fixed.to_string(), "constraint `rod` always holds; declare it with the option `switched`");
}

/// A bar over a floor, on which either end may rest, held by a latch.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, tilt: rad)]
#[units(m: kg, inertia: kg * m^2, half: m, g: m / s^2, drag: N, speed: m / s)]
pub struct Plank {
    pub m: f64,
    pub inertia: f64,
    pub half: f64,
    pub g: f64,
    pub drag: f64,
    pub speed: f64,
}

#[dynamics]
impl Plank {
    fn end(&self, q: &Coordinates<Self>, side: f64) -> Vec2 {
        vec2(q.x, q.y) + side * self.half * vec2(q.tilt.cos(), q.tilt.sin())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2)) + 0.5 * self.inertia * q.tilt.dt().powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * q.y
    }
    #[holonomic(switched)]
    fn left(&self, q: &Coordinates<Self>) -> Expr {
        self.end(q, -1.0).y
    }
    #[holonomic(switched)]
    fn right(&self, q: &Coordinates<Self>) -> Expr {
        self.end(q, 1.0).y
    }
    #[holonomic(switched)]
    fn latch(&self, q: &Coordinates<Self>) -> Expr {
        self.end(q, 1.0).x - self.speed * q.t
    }
    #[force]
    fn dragging(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.tilt, -self.drag * self.half * q.slip(Self::latch))
    }
}

/// Whatever is released, generated code gives what the general solver gives: accelerations, multipliers,
/// corrections.
#[test]
fn every_set_of_released_constraints_has_code_of_its_own() {
    let model = Plank { m: 2.0, inertia: 0.3, half: 0.7, g: 9.81, drag: 1.5, speed: 0.1 };
    let constants = model.constants().unwrap();
    let mut state = model.state().y(0.4).tilt(0.6).x_rate(0.3).y_rate(-0.2).tilt_rate(1.1).at_time(0.4);
    for name in ["left", "right", "latch"] {
        state = state.release(name);
    }
    let state = state.build().unwrap();
    let right = <Plank as Constraints>::Rows::new(0.3, -0.2, 0.5);
    for released in 0..8 {
        let mut state = state;
        *state.active_set_mut() = dynamics::model::ActiveSet::ALL_HOLD;
        let is_held = |mode: usize| released >> mode & 1 == 0;
        (0..3).filter(|mode| !is_held(*mode)).for_each(|mode| state.active_set_mut().release(mode, -1.0));
        let found =
            model.solve_unrolled(&constants, &state).unwrap_or_else(|| panic!("{:?}", state.active_set));
        let alone = model.accelerate_unrolled(&constants, &state).unwrap();
        let delta = model.correct_unrolled(&constants, &state, &right).unwrap();
        let general = dynamics::constrain::with_workspace::<Plank, _>(|workspace| {
            dynamics::constrain::solve_general(&model, &state, workspace).unwrap()
        });
        let size = general.accelerations.norm() + general.multipliers.norm();
        near((found.accelerations - general.accelerations).norm(), 0.0, size, "q̈");
        near((alone - general.accelerations).norm(), 0.0, size, "q̈ alone");
        near((found.multipliers - general.multipliers).norm(), 0.0, size, "λ");
        let (jacobian, held) = (model.jacobian(&state), (0..3).filter(|mode| is_held(*mode)));
        held.for_each(|row| near((jacobian * delta)[row], right[row], 10.0, "Φ_q δ = r"));
        // M δ is a reaction of what holds: no motion that this leaves takes part.
        let momentum = model.mass_matrix(&state) * delta;
        let mut rows = jacobian;
        (0..3).filter(|mode| !is_held(*mode)).for_each(|row| rows.row_mut(row).fill(0.0));
        let mut square = rows * rows.transpose();
        (0..3).filter(|mode| !is_held(*mode)).for_each(|row| square[(row, row)] = 1.0);
        let reaction = rows.transpose() * square.try_inverse().unwrap() * (rows * momentum);
        near((momentum - reaction).norm(), 0.0, 10.0, "M δ = Φ_qᵀμ");
    }
}

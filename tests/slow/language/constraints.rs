//! Constraints as the language declares them: what the macro emits against hand results and against the
//! model's own functions on jets.
#![allow(missing_docs, unreachable_pub, reason = "models as users write them")]

mod row_units;
mod switched;

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

    /// M q̈ = Q + Φ_qᵀλ and Φ_q q̈ = γ, by the general solver and by the one that was chosen. Outputs
    /// and events read that solution.
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

    /// ∂q̈/∂q and ∂q̈/∂q̇ of the constrained motion, off the manifold too, against central
    /// differences of sixth order.
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

//! What controls reach, and regulators, against closed forms and other routes.

use dynamics::analysis::{StateSpace, VibrationError};
use dynamics::prelude::*;
use nalgebra::{Complex, DMatrix, DVector};

use crate::models::CartPole;

fn matrices(a: DMatrix<f64>, b: DMatrix<f64>, c: DMatrix<f64>) -> StateSpace {
    let d = DMatrix::zeros(c.nrows(), b.ncols());
    StateSpace::from_matrices(a, b, c, d).unwrap()
}

/// ẍ = w with x² + p ẋ² + r w²: K = [1/√r, √(2/√r + p/r)].
#[test]
fn a_double_integrator() {
    for (p, r) in [(1.0, 1.0), (0.0, 1e-4), (3.0, 1e4)] {
        let a = DMatrix::from_row_slice(2, 2, &[0.0, 1.0, 0.0, 0.0]);
        let b = DMatrix::from_row_slice(2, 1, &[0.0, 1.0]);
        let space = matrices(a, b, DMatrix::identity(2, 2));
        let found = space.lqr().weight("y[0]", 1.0).weight("y[1]", p).weight("w[0]", r).solve().unwrap();
        let wanted = [1.0 / r.sqrt(), (2.0 / r.sqrt() + p / r).sqrt()];
        for (k, wanted) in wanted.into_iter().enumerate() {
            assert!((found.gain[(0, k)] - wanted).abs() < 1e-13 * wanted, "{p} {r}: {found}");
        }
        assert!(found.residual < 1e-14, "{:e}", found.residual);
    }
}

/// The closed loop has the stable eigenvalues of the Hamiltonian matrix: no equation was solved for these.
#[test]
fn a_pole_on_a_cart() {
    let model = CartPole { cart: 1.0, bob: 0.2, length: 0.5, g: 9.81 };
    let upright = model.state().force(0.0).build().unwrap();
    let space = model.state_space(&upright).unwrap();
    assert!(space.controllability(&["force"]).unwrap().iter().all(|reach| reach.is_reached()));
    let control = space
        .lqr()
        .weight("x", 4.0)
        .weight("theta", 9.0)
        .weight("theta_rate", 0.5)
        .weight("force", 0.25)
        .solve()
        .unwrap();
    assert!(control.residual < 1e-14 && control.closed_loop.iter().all(|x| x.re < 0.0), "{control}");
    let n = 4;
    let q = DMatrix::from_diagonal(&DVector::from_vec(vec![4.0, 9.0, 0.0, 0.5]));
    let b = space.b.column(0).into_owned();
    let mut hamiltonian = DMatrix::zeros(2 * n, 2 * n);
    hamiltonian.view_mut((0, 0), (n, n)).copy_from(&space.a);
    hamiltonian.view_mut((0, n), (n, n)).copy_from(&(&b * b.transpose() * -4.0));
    hamiltonian.view_mut((n, 0), (n, n)).copy_from(&-q);
    hamiltonian.view_mut((n, n), (n, n)).copy_from(&-space.a.transpose());
    let mut stable: Vec<Complex<f64>> =
        hamiltonian.complex_eigenvalues().iter().copied().filter(|x| x.re < 0.0).collect();
    stable.sort_by(|x, y| x.re.total_cmp(&y.re).then(x.im.total_cmp(&y.im)));
    for (found, wanted) in control.closed_loop.iter().zip(&stable) {
        assert!((found - wanted).norm() < 1e-11 * wanted.norm(), "{found} {wanted}");
    }
    // The nonlinear model, let go beside the upright, comes back, and costs what X says, to the third order.
    let start = |tilt: f64| model.state().theta(tilt).force(0.0).build().unwrap();
    let tilt = 1e-3;
    let motion = model
        .simulate(start(tilt))
        .until(20.0)
        .tolerance(1e-11)
        .inputs(|_, s| control.inputs_at(s))
        .run()
        .unwrap();
    assert!(motion.end().theta().abs() < 1e-9 && motion.end().x().abs() < 1e-9);
    let steps = 40_000;
    let running = |s: &State<CartPole>| {
        4.0 * s.x().powi(2)
            + 9.0 * s.theta().powi(2)
            + 0.5 * s.theta_rate().powi(2)
            + 0.25 * s.force().powi(2)
    };
    let h = 20.0 / f64::from(steps);
    // Simpson's rule.
    let cost: f64 = motion
        .sample((0..=steps).map(|k| h * f64::from(k)))
        .enumerate()
        .map(|(k, s)| {
            running(&s)
                * if k == 0 || k == steps as usize {
                    1.0
                } else if k % 2 == 1 {
                    4.0
                } else {
                    2.0
                }
        })
        .sum::<f64>()
        * h
        / 3.0;
    let wanted = control.cost(&[0.0, tilt, 0.0, 0.0]).unwrap();
    assert!((cost / wanted - 1.0).abs() < 1e-5, "{cost:e} {wanted:e}");
}

/// CAREX example 2 of category 1 (Benner, Laub & Mehrmann 1995): A unstable, R singular none, X known in
/// closed form.
#[test]
fn a_published_riccati_equation() {
    let a = DMatrix::from_row_slice(2, 2, &[4.0, 3.0, -4.5, -3.5]);
    let b = DMatrix::from_row_slice(2, 1, &[1.0, -1.0]);
    // Q = [9 6; 6 4] = cᵀc with c = [3 2]; X = (1 + √2) Q.
    let space = matrices(a, b, DMatrix::from_row_slice(1, 2, &[3.0, 2.0]));
    let found = space.lqr().weight("y[0]", 1.0).weight("w[0]", 1.0).solve().unwrap();
    let wanted = (1.0 + 2.0f64.sqrt()) * DMatrix::from_row_slice(2, 2, &[9.0, 6.0, 6.0, 4.0]);
    assert!((&found.riccati - &wanted).amax() < 1e-11, "{} {wanted}", found.riccati);
}

/// Two poles on one cart: of equal length the cart does not reach their difference, of nearly equal length
/// hardly.
mod twins {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: m, theta: [rad; 2])]
    #[inputs(force: N)]
    #[units(cart: kg, bob: kg, length: m, g: m / s^2)]
    pub(super) struct Twins {
        pub(super) cart: f64,
        pub(super) bob: f64,
        pub(super) length: [f64; 2],
        pub(super) g: f64,
    }
    #[dynamics]
    impl Twins {
        fn tip(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
            vec2(q.x + self.length[i] * q.theta[i].sin(), self.length[i] * q.theta[i].cos())
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.cart * q.x.dt().powi(2)
                + 0.5 * self.bob * (self.tip(q, 0).dt().norm_squared() + self.tip(q, 1).dt().norm_squared())
        }
        #[potential]
        fn gravity(&self, q: &Coordinates<Self>) -> Expr {
            self.bob * self.g * (self.tip(q, 0).y + self.tip(q, 1).y)
        }
        #[force]
        fn motor(&self, q: &Coordinates<Self>) -> Force {
            Force::along(q.x, q.force)
        }
    }
}

#[test]
fn what_no_control_reaches_is_named() {
    let space = |second: f64| {
        let model = twins::Twins { cart: 1.0, bob: 0.2, length: [0.5, second], g: 9.81 };
        model.state_space(&model.state().force(0.0).build().unwrap()).unwrap()
    };
    let design = |space: &StateSpace| {
        space.lqr().weight("theta[0]", 1.0).weight("x", 1.0).weight("force", 1.0).solve()
    };
    let refused = design(&space(0.5)).unwrap_err();
    let VibrationError::Unstabilisable { eigenvalue, states, .. } = &refused else { panic!("{refused}") };
    // The difference of the angles falls as one pole does.
    assert!((eigenvalue.norm() - (9.81f64 / 0.5).sqrt()).abs() < 1e-12, "{refused}");
    assert!(states.iter().any(|s| s.starts_with("theta")), "{refused}");
    assert!(refused.to_string().contains("no control reaches"));
    let unreached = space(0.5).controllability(&["force"]).unwrap();
    assert_eq!(unreached.iter().filter(|reach| !reach.is_reached()).count(), 2, "{unreached:?}");
    // A torque on one of them would do.
    assert!(
        space(0.5).controllability(&["force", "theta[0]"]).unwrap().iter().all(|reach| reach.is_reached())
    );
    // Nearly equal: reached, by as little as the distance says.
    let near: Vec<f64> = [0.51, 0.501, 0.5001]
        .map(|second| {
            let all = space(second).controllability(&["force"]).unwrap();
            all.iter().map(|reach| reach.distance).fold(f64::INFINITY, f64::min)
        })
        .to_vec();
    assert!(near[0] > 5.0 * near[1] && near[1] > 5.0 * near[2] && near[2] > 1e-9, "{near:?}");
    assert!(design(&space(0.55)).unwrap().closed_loop.iter().all(|x| x.re < 0.0));
}

#[test]
fn what_no_output_sees_is_told() {
    let model = CartPole { cart: 1.0, bob: 0.2, length: 0.5, g: 9.81 };
    let space = model.state_space(&model.state().force(0.0).build().unwrap()).unwrap();
    assert!(space.observability(&["x"]).unwrap().iter().all(|reach| reach.is_reached()));
    // The angle alone does not see where the cart is, nor how fast it goes.
    let blind = space.observability(&["theta"]).unwrap();
    assert!(blind.iter().filter(|reach| reach.eigenvalue.norm() < 1e-9).all(|reach| !reach.is_reached()));
    assert!(blind.iter().filter(|reach| reach.eigenvalue.norm() > 1.0).all(|reach| reach.is_reached()));
    // Nobody who weighs the angle alone brings the cart to rest.
    let refused = space.lqr().weight("theta", 1.0).weight("force", 1.0).solve().unwrap_err();
    assert!(matches!(refused, VibrationError::Undetectable { .. }), "{refused}");
}

#[test]
fn weights_that_cannot_be_are_refused() {
    let model = CartPole { cart: 1.0, bob: 0.2, length: 0.5, g: 9.81 };
    let space = model.state_space(&model.state().force(0.0).build().unwrap()).unwrap();
    let with =
        |name: &str, weight: f64| space.lqr().weight("x", 1.0).weight(name, weight).solve().unwrap_err();
    assert!(matches!(with("force", 0.0), VibrationError::Value { .. }));
    assert!(matches!(with("force", f64::NAN), VibrationError::Value { .. }));
    assert!(matches!(with("theta", -1.0), VibrationError::Value { .. }));
    assert!(matches!(with("theta", 1.0), VibrationError::NoWeight { of: "controls" }));
    assert!(matches!(space.lqr().weight("force", 1.0).solve(), Err(VibrationError::NoWeight { .. })));
    assert!(with("thetta", 1.0).to_string().contains("did you mean `theta`?"));
    let refused = space.lqr().weight("x_acceleration", 1.0).weight("force", 1.0).solve().unwrap_err();
    assert_eq!(
        refused,
        VibrationError::Feedthrough { output: "x_acceleration".into(), input: "force".into() }
    );
}

/// Ten masses in a row, steered at one end: twenty states, and the cost that X promises is that of the closed
/// loop, by its Lyapunov equation.
#[test]
fn twenty_states() {
    let chain = crate::normal::Chain::between([1.0, 0.0], 0.01, 0.0);
    let space = chain.state_space(&chain.rest()).unwrap();
    let control = space.lqr().weight("x[9]", 1.0).weight("x[0]", 0.5).weight("push", 0.01).solve().unwrap();
    assert!(control.residual < 1e-12 && control.closed_loop.last().unwrap().re < -0.01, "{control}");
    // ∫ xᵀ(Q + KᵀRK) x dt of the closed loop, by Simpson's rule over an exponential.
    let closed = &space.a - space.b.column(0) * &control.gain;
    let mut q = control.gain.tr_mul(&control.gain) * 0.01;
    q[(9, 9)] += 1.0;
    q[(0, 0)] += 0.5;
    let (h, count) = (0.02, 20_000);
    let step = (closed * h).exp();
    let start: Vec<f64> = (0..20).map(|k| (1.3 * f64::from(k) + 0.4).sin()).collect();
    let (mut x, mut sum) = (DVector::from_column_slice(&start), 0.0);
    for k in 0..=count {
        let weight = if k == 0 || k == count {
            1.0
        } else if k % 2 == 1 {
            4.0
        } else {
            2.0
        };
        sum += x.dot(&(&q * &x)) * weight * h / 3.0;
        x = &step * x;
    }
    let wanted = control.cost(&start).unwrap();
    assert!(x.amax() < 1e-3 && (sum / wanted - 1.0).abs() < 1e-6, "{sum} {wanted}");
    assert_eq!(control.cost(&start[1..]), None);
}

//! Every derived quantity by two routes: what the macro emitted against the model's own functions run on time
//! jets and differentiated numerically, and against equations derived by hand.

use crate::double_pendulum as two_bobs;

use dynamics::model::{Linearize, Model, ModelState, Powers, Vector};
use dynamics::prelude::*;
use nalgebra::{DMatrix, DVector};
use two_bobs::DoublePendulum;

/// A small deterministic generator, so that a failure can be repeated (xorshift64*).
struct Random(u64);

impl Random {
    fn next(&mut self, low: f64, high: f64) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        let unit = (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11) as f64 / (1u64 << 53) as f64;
        low + (high - low) * unit
    }
}

/// A state with its coordinates, velocities and inputs drawn at random around `center`.
fn random_state<M: Model>(random: &mut Random, center: f64) -> M::State {
    let (mut q, mut u, mut w) = (M::Vector::zeros(), M::Vector::zeros(), M::Inputs::zeros());
    q.as_mut_slice().iter_mut().for_each(|x| *x = center + random.next(-0.9, 0.9));
    u.as_mut_slice().iter_mut().for_each(|x| *x = random.next(-2.0, 2.0));
    w.as_mut_slice().iter_mut().for_each(|x| *x = random.next(-3.0, 3.0));
    M::State::new(random.next(0.1, 2.0), q, u, w)
}

/// The state with one of (t, q, u) moved.
#[derive(Clone, Copy)]
enum Slot {
    Time,
    Q(usize),
    U(usize),
    Input(usize),
}

fn moved<S: ModelState>(state: &S, slot: Slot, by: f64) -> S {
    let mut s = *state;
    match slot {
        Slot::Time => return S::new(s.t() + by, *s.q(), *s.u(), *s.inputs()),
        Slot::Q(i) => s.q_mut()[i] += by,
        Slot::U(i) => s.u_mut()[i] += by,
        Slot::Input(i) => s.inputs_mut()[i] += by,
    }
    s
}

/// Central difference of fourth order with step 1e-3: error about 1e-12 for functions of unit scale.
fn slope<S: ModelState>(f: &dyn Fn(&S) -> f64, state: &S, slot: Slot) -> f64 {
    let h = 1e-3;
    let d = |k: f64| f(&moved(state, slot, k * h)) - f(&moved(state, slot, -k * h));
    // Sixth order.
    (45.0 * d(1.0) - 9.0 * d(2.0) + d(3.0)) / (60.0 * h)
}

/// Asserts |a − b| ≤ tolerance·(1 + scale).
#[track_caller]
fn near(a: f64, b: f64, scale: f64, tolerance: f64, what: &str) {
    assert!((a - b).abs() <= tolerance * (1.0 + scale.abs()), "{what}: emitted {a}, independently {b}");
}

/// Lagrange's equations from nothing but values of the Lagrangian `l` and of the applied power, compared with
/// everything emitted.
fn verify<M>(
    model: &M,
    center: f64,
    l: impl Fn(&M::Coordinates) -> Expr,
    applied: impl Fn(&M::Coordinates) -> f64,
) where
    M: Linearize + Powers,
{
    let mut random = Random(0x1234_5678_9abc_def1);
    for _ in 0..20 {
        let state: M::State = random_state::<M>(&mut random, center);
        let lagrangian = |s: &M::State| l(&M::coordinates_with(s, &M::Vector::zeros(), &[])).value();
        let power = |a: &M::Vector| applied(&M::coordinates_with(&state, a, &[]));
        verify_momenta_and_energy(model, &state, &lagrangian);
        verify_mass_and_force(model, &state, &lagrangian, &power);
        verify_motion_and_powers(model, &state, &power);
        verify_jacobians(model, &state);
    }
}

/// p = ∂L/∂q̇, E = p·q̇ − L.
fn verify_momenta_and_energy<M: Linearize>(
    model: &M,
    state: &M::State,
    lagrangian: &dyn Fn(&M::State) -> f64,
) {
    let n = M::Vector::LEN;
    let p: Vec<f64> = (0..n).map(|i| slope(lagrangian, state, Slot::U(i))).collect();
    let momenta = model.momenta(state);
    for i in 0..n {
        near(momenta[i], p[i], p[i], 1e-8, "momentum");
    }
    let energy = model.energy_function(state);
    let expected = (0..n).map(|i| p[i] * state.u()[i]).sum::<f64>() - lagrangian(state);
    near(energy, expected, expected, 1e-8, "energy function");
}

/// M = ∂p/∂q̇ and Q = ∂L/∂q − (∂p/∂q) q̇ − ∂p/∂t + applied, the momenta now trusted.
fn verify_mass_and_force<M: Linearize + Powers>(
    model: &M,
    state: &M::State,
    lagrangian: &dyn Fn(&M::State) -> f64,
    power: &dyn Fn(&M::Vector) -> f64,
) {
    let n = M::Vector::LEN;
    let mass = model.mass_matrix(state);
    let force = model.generalized_force(state);
    let mut applied_power = 0.0;
    for i in 0..n {
        let momentum = |s: &M::State| model.momenta(s)[i];
        for j in 0..n {
            let expected = slope(&momentum, state, Slot::U(j));
            near(mass[(i, j)], expected, expected, 1e-8, "mass matrix");
            assert_eq!(mass[(i, j)], mass[(j, i)], "the mass matrix is symmetric");
        }
        let convected: f64 = (0..n).map(|j| slope(&momentum, state, Slot::Q(j)) * state.u()[j]).sum::<f64>()
            + slope(&momentum, state, Slot::Time);
        let inertial = slope(lagrangian, state, Slot::Q(i)) - convected;
        if M::POWERS.iter().all(|p| p.name == "explicit time") {
            near(force[i], inertial, inertial, 1e-7, "generalized force");
        }
        applied_power += (force[i] - inertial) * state.u()[i];
    }
    let still = power(&M::Vector::zeros());
    near(applied_power, still, still, 1e-7, "power of the applied part of Q");
}

/// M q̈ = Q, and dE/dt along the motion is the sum of the powers.
fn verify_motion_and_powers<M: Linearize + Powers>(
    model: &M,
    state: &M::State,
    power: &dyn Fn(&M::Vector) -> f64,
) {
    let n = M::Vector::LEN;
    let (mass, force) = (model.mass_matrix(state), model.generalized_force(state));
    let a = model.accelerations(state).expect("a regular state");
    for i in 0..n {
        let product: f64 = (0..n).map(|j| mass[(i, j)] * a[j]).sum();
        let scale: f64 = (0..n).map(|j| (mass[(i, j)] * a[j]).abs()).sum();
        near(product, force[i], scale, 1e-11, "M q̈ = Q");
    }
    let energy_of = |s: &M::State| model.energy_function(s);
    let rate: f64 = (0..n)
        .map(|i| {
            slope(&energy_of, state, Slot::Q(i)) * state.u()[i] + slope(&energy_of, state, Slot::U(i)) * a[i]
        })
        .sum::<f64>()
        + slope(&energy_of, state, Slot::Time);
    let mut powers = vec![0.0; M::POWERS.len()];
    model.powers(state, &mut powers);
    let scale = rate.abs() + energy_of(state).abs();
    near(powers.iter().sum(), rate, scale, 1e-7, "dE/dt = Σ powers");
    let of_forces: f64 =
        M::POWERS.iter().zip(&powers).filter(|(q, _)| q.name != "explicit time").map(|(_, p)| *p).sum();
    let jets = power(&a);
    near(of_forces, jets, jets, 1e-11, "power of forces and dissipation");
}

/// Jacobians against differences of the accelerations.
fn verify_jacobians<M: Linearize>(model: &M, state: &M::State) {
    let n = M::Vector::LEN;
    let a = model.accelerations(state).expect("a regular state");
    let jacobian = model.state_jacobian(state).expect("a regular state");
    let by_input = model.input_jacobian(state).expect("a regular state");
    for i in 0..n {
        let acceleration = |s: &M::State| model.accelerations(s).expect("a regular state")[i];
        near(jacobian.accelerations[i], a[i], a[i], 1e-12, "q̈ of the Jacobian");
        for j in 0..n {
            let expected = slope(&acceleration, state, Slot::Q(j));
            near(jacobian.by_q[(i, j)], expected, expected, 1e-6, "∂q̈/∂q");
            let expected = slope(&acceleration, state, Slot::U(j));
            near(jacobian.by_u[(i, j)], expected, expected, 1e-6, "∂q̈/∂q̇");
        }
        for j in 0..M::Inputs::LEN {
            let expected = slope(&acceleration, state, Slot::Input(j));
            near(by_input[(i, j)], expected, expected, 1e-6, "∂q̈/∂input");
        }
    }
}

/// ∂q̈/∂parameters against differences: parameters are fields, so the model is rebuilt by `with`.
fn verify_parameters<M: Linearize>(with: impl Fn(&[f64]) -> M, parameters: &[f64], center: f64) {
    let mut random = Random(0xfeed_beef_1234_5677);
    assert_eq!(parameters.len(), M::PARAMETERS.len());
    for _ in 0..10 {
        let state: M::State = random_state::<M>(&mut random, center);
        let jacobian = with(parameters).parameter_jacobian(&state).expect("a regular state");
        for (j, value) in parameters.iter().enumerate() {
            let h = 1e-4 * value.abs().max(0.1);
            for i in 0..M::Vector::LEN {
                let at = |x: f64| {
                    let mut p = parameters.to_vec();
                    p[j] = x;
                    with(&p).accelerations(&state).expect("a regular state")[i]
                };
                let d = |k: f64| at(value + k * h) - at(value - k * h);
                let expected = (45.0 * d(1.0) - 9.0 * d(2.0) + d(3.0)) / (60.0 * h);
                near(jacobian[(i, j)], expected, expected, 1e-7, M::PARAMETERS[j].name);
            }
        }
    }
}

mod pendulum {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(theta: rad)]
    #[units(m: kg, l: m, g: m / s^2, c: N * m * s)]
    pub(super) struct Pendulum {
        pub(super) m: f64,
        pub(super) l: f64,
        pub(super) g: f64,
        pub(super) c: f64,
    }

    #[dynamics]
    impl Pendulum {
        fn bob(&self, q: &Coordinates<Self>) -> Vec2 {
            self.l * vec2(q.theta.sin(), -q.theta.cos())
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m * self.bob(q).dt().norm_squared()
        }
        #[potential]
        fn gravity(&self, q: &Coordinates<Self>) -> Expr {
            self.m * self.g * self.bob(q).y
        }
        #[dissipation]
        fn bearing(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.c * q.theta.dt().powi(2)
        }
    }

    #[test]
    fn against_the_hand_derived_equation() {
        let Pendulum { m, l, g, c } = Pendulum { m: 0.7, l: 1.3, g: 9.81, c: 0.2 };
        let model = Pendulum { m, l, g, c };
        let mut random = Random(7);
        for _ in 0..100 {
            let state = random_state::<Pendulum>(&mut random, 0.0);
            let by_hand = -g / l * state.theta().sin() - c / (m * l * l) * state.theta_rate();
            near(model.accelerations(&state).unwrap()[0], by_hand, by_hand, 4.0 * f64::EPSILON, "θ̈");
            near(model.kinetic_energy(&state), 0.5 * m * l * l * state.theta_rate().powi(2), 1.0, 1e-15, "T");
            near(model.potential_energy(&state), -m * g * l * state.theta().cos(), 10.0, 1e-15, "V");
        }
    }

    #[test]
    fn negative_and_vanishing_inertia_are_errors() {
        let evaluate = |m: f64| {
            let model = Pendulum { m, l: 1.3, g: 9.81, c: 0.2 };
            let state = model.state().theta(0.3).build().unwrap();
            model.accelerations(&state).map_err(|e| e.to_string())
        };
        assert!(evaluate(0.7).is_ok());
        let message = evaluate(-0.7).unwrap_err();
        assert!(message.contains("`theta` has negative inertia"), "{message}");
        let message = evaluate(0.0).unwrap_err();
        assert!(message.contains("singular") && message.contains("`theta`"), "{message}");
    }

    #[test]
    fn by_two_routes() {
        let model = Pendulum { m: 0.7, l: 1.3, g: 9.81, c: 0.2 };
        verify(
            &model,
            0.3,
            |q| model.kinetic(q) - model.gravity(q),
            // The dissipated power is twice Rayleigh's function of a quadratic D.
            |q| -2.0 * model.bearing(q).value(),
        );
        verify_parameters(|p| Pendulum { m: p[0], l: p[1], g: p[2], c: p[3] }, &[0.7, 1.3, 9.81, 0.2], 0.3);
    }
}

mod cart_pole {
    use super::*;

    /// A cart pushed by a force, with a pole hinged to it.
    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: m, theta: rad)]
    #[inputs(push: N)]
    #[units(cart: kg, bob: kg, l: m, g: m / s^2)]
    pub(super) struct CartPole {
        pub(super) cart: f64,
        pub(super) bob: f64,
        pub(super) l: f64,
        pub(super) g: f64,
    }

    #[dynamics]
    impl CartPole {
        fn tip(&self, q: &Coordinates<Self>) -> Vec2 {
            vec2(q.x, 0.0) + self.l * vec2(q.theta.sin(), -q.theta.cos())
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.cart * q.x.dt().powi(2) + 0.5 * self.bob * self.tip(q).dt().norm_squared()
        }
        #[potential]
        fn gravity(&self, q: &Coordinates<Self>) -> Expr {
            self.bob * self.g * self.tip(q).y
        }
        #[force]
        fn drive(&self, q: &Coordinates<Self>) -> Force {
            Force::along(q.x, q.push)
        }
    }

    #[test]
    fn against_the_hand_derived_equations() {
        let (mc, m, l, g) = (2.0, 0.6, 0.9, 9.81);
        let model = CartPole { cart: mc, bob: m, l, g };
        let mut random = Random(8);
        for _ in 0..100 {
            let state = random_state::<CartPole>(&mut random, 0.0);
            let (s, c) = state.theta().sin_cos();
            let (w, f) = (state.theta_rate(), state.push());
            // (M + m sin²θ) ẍ = F + m sin θ (l θ̇² + g cos θ);  l θ̈ = −ẍ cos θ − g sin θ
            let ax = (f + m * s * (l * w * w + g * c)) / (mc + m * s * s);
            let at = (-ax * c - g * s) / l;
            let a = model.accelerations(&state).unwrap();
            near(a[0], ax, 10.0, 1e-15 * 10.0, "ẍ");
            near(a[1], at, 20.0, 1e-15 * 10.0, "θ̈");
        }
    }

    #[test]
    fn by_two_routes() {
        let model = CartPole { cart: 2.0, bob: 0.6, l: 0.9, g: 9.81 };
        verify(&model, 0.2, |q| model.kinetic(q) - model.gravity(q), |q| model.drive(q).power());
        verify_parameters(
            |p| CartPole { cart: p[0], bob: p[1], l: p[2], g: p[3] },
            &[2.0, 0.6, 0.9, 9.81],
            0.2,
        );
    }
}

mod double_pendulum {
    use super::*;
    #[test]
    fn against_the_hand_derived_equations() {
        let (m1, m2, l1, l2, g) = (1.1, 1.3, 1.0, 0.8, 9.81);
        let model = DoublePendulum { m1, m2, l1, l2, g };
        let mut random = Random(9);
        for _ in 0..100 {
            let s = random_state::<DoublePendulum>(&mut random, 0.0);
            let (sin, cos) = (s.theta1() - s.theta2()).sin_cos();
            let m = nalgebra::Matrix2::new(
                (m1 + m2) * l1 * l1,
                m2 * l1 * l2 * cos,
                m2 * l1 * l2 * cos,
                m2 * l2 * l2,
            );
            let q = nalgebra::Vector2::new(
                -m2 * l1 * l2 * sin * s.theta2_rate().powi(2) - (m1 + m2) * g * l1 * s.theta1().sin(),
                m2 * l1 * l2 * sin * s.theta1_rate().powi(2) - m2 * g * l2 * s.theta2().sin(),
            );
            let mass = model.mass_matrix(&s);
            let force = model.generalized_force(&s);
            let a = model.accelerations(&s).unwrap();
            let by_hand = m.try_inverse().unwrap() * q;
            for i in 0..2 {
                near(force[i], q[i], 40.0, 20.0 * f64::EPSILON, "Q");
                near(a[i], by_hand[i], 40.0, 100.0 * f64::EPSILON, "q̈");
                for j in 0..2 {
                    near(mass[(i, j)], m[(i, j)], 1.0, 4.0 * f64::EPSILON, "M");
                }
            }
        }
    }

    #[test]
    fn by_two_routes() {
        let model = DoublePendulum { m1: 1.1, m2: 1.3, l1: 1.0, l2: 0.8, g: 9.81 };
        verify(&model, 0.4, |q| model.kinetic(q) - model.gravity(q), |_| 0.0);
        verify_parameters(
            |p| DoublePendulum { m1: p[0], m2: p[1], l1: p[2], l2: p[3], g: p[4] },
            &[1.1, 1.3, 1.0, 0.8, 9.81],
            0.4,
        );
    }
}

mod everything;

#[test]
fn a_linear_change_of_coordinates_gives_the_same_motion() {
    // The double pendulum of above in the coordinates (θ₁, θ₂ − θ₁): relative instead of absolute angles.
    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(theta1: rad, relative: rad)]
    struct Relative {
        m1: f64,
        m2: f64,
        l1: f64,
        l2: f64,
        g: f64,
    }

    #[dynamics]
    impl Relative {
        fn bob1(&self, q: &Coordinates<Self>) -> Vec2 {
            self.l1 * vec2(q.theta1.sin(), -q.theta1.cos())
        }
        fn bob2(&self, q: &Coordinates<Self>) -> Vec2 {
            let angle = q.theta1 + q.relative;
            self.bob1(q) + self.l2 * vec2(angle.sin(), -angle.cos())
        }
        #[lagrangian]
        fn lagrangian(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m1 * self.bob1(q).dt().norm_squared()
                + 0.5 * self.m2 * self.bob2(q).dt().norm_squared()
                - self.g * (self.m1 * self.bob1(q).y + self.m2 * self.bob2(q).y)
        }
    }

    let absolute = DoublePendulum { m1: 1.1, m2: 1.3, l1: 1.0, l2: 0.8, g: 9.81 };
    let relative = Relative { m1: 1.1, m2: 1.3, l1: 1.0, l2: 0.8, g: 9.81 };
    let transform = DMatrix::from_row_slice(2, 2, &[1.0, 0.0, -1.0, 1.0]);
    let mut random = Random(21);
    for _ in 0..50 {
        let state = random_state::<DoublePendulum>(&mut random, 0.0);
        let map = |v: &[f64]| &transform * DVector::from_column_slice(v);
        let (q, u) = (map(state.q.as_slice()), map(state.u.as_slice()));
        let other = relative
            .state()
            .theta1(q[0])
            .relative(q[1])
            .theta1_rate(u[0])
            .relative_rate(u[1])
            .build()
            .unwrap();
        let expected = map(absolute.accelerations(&state).unwrap().as_slice());
        let a = relative.accelerations(&other).unwrap();
        for i in 0..2 {
            near(a[i], expected[i], 50.0, 1e-13, "q̈ in other coordinates");
        }
        near(relative.energy_function(&other), absolute.energy_function(&state), 10.0, 1e-14, "energy");
    }
}

//! Random systems: what moves, from where, for how long.
#![allow(unreachable_pub, reason = "of one test")]

use std::f64::consts::TAU;

use dynamics_runtime::constrain;
use dynamics_runtime::error::{SingularMassMatrix, SolveError};
use dynamics_runtime::model::{
    Constraint, ConstraintKind, Constraints, Dynamics, Events, Model, Outputs, Powers, Quantity, Solved,
    SolverKind, Terms,
};
use nalgebra::{DMatrix, DVector, Matrix3, SMatrix, SVector, Vector3};

use crate::common::constrained::{FourBar, Held, constraint, held};
use crate::common::{ByHand, PlainState, conserved, names};

/// Random numbers by Steele, Lea & Flood's SplitMix64.
pub struct Dice(pub u64);

impl Dice {
    /// In [0, 1).
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
    pub fn within(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * self.unit()
    }
    /// Evenly over the powers of ten.
    pub fn power(&mut self, from: f64, to: f64) -> f64 {
        10f64.powf(self.within(from.log10(), to.log10()))
    }
    pub fn below(&mut self, count: usize) -> usize {
        (self.unit() * count as f64) as usize
    }
}

type Field<const N: usize> = Box<dyn Fn(f64, &SVector<f64, N>, &SVector<f64, N>) -> SVector<f64, N>>;
type Scalar<const N: usize> = Box<dyn Fn(&SVector<f64, N>, &SVector<f64, N>) -> f64>;
type Power<const N: usize> = Box<dyn Fn(f64, &SVector<f64, N>, &SVector<f64, N>) -> f64>;

/// Accelerations and an energy; what the energy does not keep is work.
pub struct Free<const N: usize> {
    pub accelerations: Field<N>,
    pub energy: Scalar<N>,
    /// Its rate, where it is not constant.
    pub power: Option<Power<N>>,
}

/// A system of one size, without constraints, that keeps its energy or not.
macro_rules! free {
    ($model:ident, $n:literal, $q:expr, $conserved:expr, $powers:expr) => {
        pub struct $model(pub Free<$n>);
        impl ByHand<$n, 0> for $model {
            fn q_ddot(&self, s: &PlainState<$n, 0>) -> Result<SVector<f64, $n>, SolveError> {
                Ok((self.0.accelerations)(s.t, &s.q, &s.u))
            }
            fn mass(&self, _: &PlainState<$n, 0>) -> SMatrix<f64, $n, $n> {
                SMatrix::identity()
            }
            fn energy(&self, s: &PlainState<$n, 0>) -> f64 {
                (self.0.energy)(&s.q, &s.u)
            }
            fn force_powers(&self, s: &PlainState<$n, 0>, values: &mut [f64]) {
                let power = self.0.power.as_ref().map_or(0.0, |power| power(s.t, &s.q, &s.u));
                values.iter_mut().for_each(|value| *value = power);
            }
        }
        crate::common::by_hand!($model, $n, 0, coordinates $q, inputs [], conserved $conserved,
            powers $powers,
            outputs [], events []);
    };
}

free!(One, 1, ["x"], [], ["rest"]);
free!(Two, 2, ["x", "y"], ["energy"], []);
free!(Three, 3, ["theta", "phi", "psi"], ["energy"], []);
free!(Eight, 8, ["a", "b", "c", "d", "e", "f", "g", "h"], ["energy"], []);
free!(
    Twenty,
    20,
    ["a", "b", "c", "d", "e", "f", "g", "h", "i", "j", "k", "l", "m", "n", "o", "p", "q", "r", "s", "t"],
    ["energy"],
    []
);

/// A system with its start, its time, and whether it is stiff.
pub struct Scene<M: Model> {
    pub name: &'static str,
    pub model: M,
    pub start: M::State,
    pub until: f64,
    pub stiff: bool,
}

fn state<const N: usize>(q: [f64; N], u: [f64; N]) -> PlainState<N, 0> {
    crate::common::at_rest_or_not(q, u)
}

/// One coordinate in a potential, given with its slope, and what else acts.
fn one(
    (name, stiff): (&'static str, bool),
    potential: impl Fn(f64) -> (f64, f64) + Copy + 'static,
    rest: impl Fn(f64, f64, f64) -> f64 + Copy + 'static,
    ([q, u], until): ([f64; 2], f64),
) -> Scene<One> {
    let accelerations: Field<1> = Box::new(move |t, q, u| [rest(t, q[0], u[0]) - potential(q[0]).1].into());
    let power: Option<Power<1>> = Some(Box::new(move |t, q, u| u[0] * rest(t, q[0], u[0])));
    let energy: Scalar<1> = Box::new(move |q, u| 0.5 * u[0] * u[0] + potential(q[0]).0);
    Scene { name, model: One(Free { accelerations, energy, power }), start: state([q], [u]), until, stiff }
}

pub fn of_one(dice: &mut Dice) -> Scene<One> {
    let (a, v) = (dice.within(-2.0, 2.0), dice.within(-2.0, 2.0));
    let span = dice.power(2.0, 100.0);
    let spring = |k: f64| move |q: f64| (0.5 * k * q * q, k * q);
    match dice.below(10) {
        0 => {
            let w = dice.power(0.3, 30.0);
            one(("oscillator", false), spring(w * w), |_, _, _| 0.0, ([a, v], span * 3.0 / w))
        }
        1 => {
            let (w, zeta) = (dice.power(0.5, 10.0), dice.power(0.01, 3.0));
            one(("damped", false), spring(w * w), move |_, _, u| -2.0 * zeta * w * u, ([a, v], span / w))
        }
        2 => {
            let (g, size) = (dice.power(1.0, 20.0), dice.power(1e-3, 3.1));
            let height = move |q: f64| (-g * q.cos(), g * q.sin());
            one(("pendulum", false), height, |_, _, _| 0.0, ([size, 0.0], span))
        }
        3 => {
            let (c, force, w) = (dice.power(0.05, 0.5), dice.within(0.1, 0.5), dice.within(0.8, 1.6));
            let wells = |q: f64| (0.25 * q * q * q * q - 0.5 * q * q, q * q * q - q);
            one(("Duffing", false), wells, move |t, _, u| -c * u + force * (w * t).cos(), ([a, v], span))
        }
        4 => {
            let mu = dice.power(0.1, 1e3);
            let until = dice.within(0.5, 3.0) * mu.max(10.0);
            one(
                ("van der Pol", mu > 20.0),
                spring(1.0),
                move |_, q, u| mu * (1.0 - q * q) * u,
                ([2.0, 0.0], until),
            )
        }
        5 => {
            let (k, zeta, w) = (dice.power(1e2, 1e8), dice.power(0.5, 10.0), dice.within(0.5, 3.0));
            let guide =
                move |t: f64, _, u: f64| k * (w * t).cos() - 2.0 * zeta * k.sqrt() * (u + w * (w * t).sin());
            one(("stiff damper", k > 1e4), spring(k), guide, ([1.0, 0.0], dice.within(2.0, 10.0)))
        }
        6 => {
            let (k, c) = (dice.power(5.0, 1e4), dice.within(0.0, 2.0));
            let stop = move |q: f64| {
                let into = (q - 0.5).max(0.0);
                (0.5 * q * q + 0.5 * k * into * into, q + k * into)
            };
            one(("one-sided", false), stop, move |_, _, u| -c * u.max(0.0), ([-a.abs(), v], span.min(40.0)))
        }
        7 => {
            let (at, width) = (dice.within(0.2, 0.8) * span, dice.power(3e-3, 0.1) * span);
            let push = move |t: f64, _, u: f64| 5.0 * (-((t - at) / width).powi(2)).exp() - 0.1 * u;
            one(("pushed", false), spring(1.0), push, ([0.1 * a, 0.0], span))
        }
        8 => {
            let (g, off) = (dice.within(0.5, 5.0), dice.power(1e-6, 1.0));
            let until = dice.within(1.0, 20.0) / g.sqrt();
            one(("upright", false), move |q| (g * q.cos(), -g * q.sin()), |_, _, _| 0.0, ([off, 0.0], until))
        }
        _ => {
            let (mu, width) = (dice.within(0.05, 0.5), dice.power(1e-3, 0.1));
            let rubbed = move |t: f64, _, u: f64| 0.6 * (1.3 * t).sin() - mu * (u / width).tanh();
            one(("friction", false), spring(1.0), rubbed, ([a, v], span.min(40.0)))
        }
    }
}

fn free<const N: usize>(
    f: impl Fn(f64, &SVector<f64, N>, &SVector<f64, N>) -> SVector<f64, N> + 'static,
    energy: impl Fn(&SVector<f64, N>, &SVector<f64, N>) -> f64 + 'static,
) -> Free<N> {
    Free { accelerations: Box::new(f), energy: Box::new(energy), power: None }
}

pub fn of_two(dice: &mut Dice) -> Scene<Two> {
    let span = dice.power(2.0, 60.0);
    let (name, model, start, until) = match dice.below(5) {
        0 => {
            let eccentricity = dice.within(0.0, 0.95);
            let f = |_: f64, q: &SVector<f64, 2>, _: &SVector<f64, 2>| -q / q.norm().powi(3);
            let model = free(f, |q, u| 0.5 * u.norm_squared() - 1.0 / q.norm());
            let fast = ((1.0 + eccentricity) / (1.0 - eccentricity)).sqrt();
            ("Kepler", model, state([1.0 - eccentricity, 0.0], [0.0, fast]), TAU * dice.power(1.0, 20.0))
        }
        1 => {
            let size = dice.power(0.05, 3.0);
            let start = state([size, dice.within(-1.0, 1.0) * size], [0.0, 0.0]);
            (
                "double pendulum",
                double_pendulum(dice.power(0.2, 5.0), dice.power(0.5, 2.0)),
                start,
                span.min(20.0),
            )
        }
        2 => {
            let energy = |q: &SVector<f64, 2>, u: &SVector<f64, 2>| {
                0.5 * (u.norm_squared() + q.norm_squared()) + q[0] * q[0] * q[1] - q[1].powi(3) / 3.0
            };
            let model =
                free(|_, q, _| [-q[0] - 2.0 * q[0] * q[1], -q[1] - q[0] * q[0] + q[1] * q[1]].into(), energy);
            let r = dice.within(0.05, 0.35);
            ("Hénon–Heiles", model, state([r, dice.within(-r, r)], [0.0, r]), 3.0 * span)
        }
        3 => {
            let k = dice.power(10.0, 1e5);
            let energy = move |q: &SVector<f64, 2>, u: &SVector<f64, 2>| {
                0.5 * u.norm_squared() + 9.81 * q[1] + 0.5 * k * (q.norm() - 1.0).powi(2)
            };
            let f = move |_: f64, q: &SVector<f64, 2>, _: &SVector<f64, 2>| {
                let r = q.norm();
                SVector::<f64, 2>::new(0.0, -9.81) - q * (k * (r - 1.0) / r)
            };
            let angle: f64 = dice.within(0.1, 2.0);
            let start = state([angle.sin(), -angle.cos()], [0.0, 0.0]);
            ("spring pendulum", free(f, energy), start, span.min(2e3 / k.sqrt()))
        }
        _ => {
            let (w, k) = (dice.within(0.1, 2.0), dice.power(1.0, 100.0));
            let model = free(
                move |_, q, u| SVector::<f64, 2>::new(2.0 * w * u[1], -2.0 * w * u[0]) - k * q,
                move |q, u| 0.5 * u.norm_squared() + 0.5 * k * q.norm_squared(),
            );
            ("whirling", model, state([1.0, 0.0], [0.0, dice.within(-1.0, 1.0)]), span)
        }
    };
    Scene { name, model: Two(model), start, until, stiff: false }
}

fn double_pendulum(m: f64, l: f64) -> Free<2> {
    let pendulum = crate::common::DoublePendulum { m1: 1.0, m2: m, l1: 1.0, l2: l, g: 9.81 };
    let at = |q: &SVector<f64, 2>, u: &SVector<f64, 2>| state([q[0], q[1]], [u[0], u[1]]);
    let energy = move |q: &SVector<f64, 2>, u: &SVector<f64, 2>| pendulum.energy(&at(q, u));
    free(move |_, q, u| pendulum.q_ddot(&at(q, u)).expect("regular"), energy)
}

/// Symmetric tops by Euler's angles (nutation θ, precession φ, spin ψ), A = 1.
pub fn of_three(dice: &mut Dice) -> Scene<Three> {
    let (c, g) = (dice.within(0.2, 1.8), dice.within(0.0, 5.0));
    let f = move |_: f64, q: &SVector<f64, 3>, u: &SVector<f64, 3>| {
        let (s, k) = q[0].sin_cos();
        let spin = c * (u[2] + u[1] * k);
        let nods = u[1] * u[1] * s * k - spin * u[1] * s + g * s;
        let turns = (spin - 2.0 * u[1] * k) * u[0] / s;
        [nods, turns, u[1] * u[0] * s - turns * k].into()
    };
    let energy = move |q: &SVector<f64, 3>, u: &SVector<f64, 3>| {
        let (s, k) = q[0].sin_cos();
        0.5 * (u[0] * u[0] + (u[1] * s).powi(2) + c * (u[2] + u[1] * k).powi(2)) + g * k
    };
    let start = state(
        [dice.within(0.3, 2.5), 0.0, 0.0],
        [dice.within(-1.0, 1.0), dice.within(-2.0, 2.0), dice.power(1.0, 30.0)],
    );
    Scene {
        name: "top, angles",
        model: Three(free(f, energy)),
        start,
        until: dice.power(1.0, 30.0),
        stiff: false,
    }
}

/// A hanging chain of eight rods with bobs, absolute angles.
pub fn of_eight(dice: &mut Dice) -> Scene<Eight> {
    fn mass(q: &SVector<f64, 8>) -> DMatrix<f64> {
        DMatrix::from_fn(8, 8, |i, j| (8 - i.max(j)) as f64 * (q[i] - q[j]).cos())
    }
    let g = 9.81;
    let f = move |_: f64, q: &SVector<f64, 8>, u: &SVector<f64, 8>| {
        let row = |i: usize| {
            let pulls = |j: usize| (8 - i.max(j)) as f64 * (q[i] - q[j]).sin() * u[j] * u[j];
            -((8 - i) as f64) * g * q[i].sin() - (0..8).map(pulls).sum::<f64>()
        };
        // What is tried of no number has no root.
        let solved = mass(q).cholesky().map(|root| root.solve(&DVector::from_fn(8, |i, _| row(i))));
        SVector::from_fn(|i, _| solved.as_ref().map_or(f64::NAN, |solved| solved[i]))
    };
    let energy = move |q: &SVector<f64, 8>, u: &SVector<f64, 8>| {
        let u = DVector::from_fn(8, |i, _| u[i]);
        0.5 * u.dot(&(mass(q) * &u)) - (0..8).map(|i| (8 - i) as f64 * g * q[i].cos()).sum::<f64>()
    };
    let size = dice.power(0.01, 1.5);
    let mut start = state([0.0; 8], [0.0; 8]);
    let uneven = dice.unit();
    (0..8).for_each(|i| start.q[i] = size * (1.0 - uneven * dice.unit()));
    Scene {
        name: "chain of rods",
        model: Eight(free(f, energy)),
        start,
        until: dice.power(1.0, 15.0),
        stiff: false,
    }
}

/// Pendulums in a row with springs between them, and beads on a string.
pub fn of_twenty(dice: &mut Dice) -> Scene<Twenty> {
    let (g, k, cubic) =
        (dice.within(0.0, 5.0), dice.power(1.0, 300.0), dice.below(2) as f64 * dice.within(0.0, 1.0));
    let pull = move |x: f64| k * x + cubic * k * x * x * x;
    let f = move |_: f64, q: &SVector<f64, 20>, _: &SVector<f64, 20>| {
        let at = |i: usize| if (1..=20).contains(&i) { q[i - 1] } else { 0.0 };
        SVector::from_fn(|i, _| -g * q[i].sin() + pull(at(i + 2) - at(i + 1)) - pull(at(i + 1) - at(i)))
    };
    let energy = move |q: &SVector<f64, 20>, u: &SVector<f64, 20>| {
        let at = |i: usize| if (1..=20).contains(&i) { q[i - 1] } else { 0.0 };
        let springs: f64 =
            (0..=20).map(|i| at(i + 1) - at(i)).map(|x| 0.5 * k * x * x + 0.25 * cubic * k * x.powi(4)).sum();
        0.5 * u.norm_squared() + springs - g * q.iter().map(|x| x.cos()).sum::<f64>()
    };
    let mut start = state([0.0; 20], [0.0; 20]);
    let (one, size) = (dice.below(2) == 0, dice.power(0.01, 1.0));
    if one {
        start.u[dice.below(20)] = 3.0 * size;
    } else {
        (0..20).for_each(|i| start.q[i] = size * dice.within(-1.0, 1.0));
    }
    Scene {
        name: "row of masses",
        model: Twenty(free(f, energy)),
        start,
        until: dice.power(3.0, 60.0),
        stiff: false,
    }
}

/// A body about a fixed point by Euler parameters, with weight at c along its third axis: 4 GᵀJG ë = −8 ĠᵀJG
/// ė + Q.
#[derive(Clone, Copy)]
pub struct EulerBody {
    pub inertia: Vector3<f64>,
    pub weight: f64,
}

impl EulerBody {
    /// In the axes of the world, with this angular velocity.
    pub fn turning(&self, omega: [f64; 3], turned: [f64; 4]) -> PlainState<4, 0> {
        let e = SVector::<f64, 4>::from(turned).normalize();
        state(e.into(), (0.5 * g_of(&e).transpose() * Vector3::from(omega)).into())
    }
}

fn g_of(e: &SVector<f64, 4>) -> SMatrix<f64, 3, 4> {
    SMatrix::<f64, 3, 4>::new(
        -e[1], e[0], e[3], -e[2], //
        -e[2], -e[3], e[0], e[1], //
        -e[3], e[2], -e[1], e[0],
    )
}

impl Held<4, 1, 1> for EulerBody {
    fn mass(&self, s: &PlainState<4, 0>) -> SMatrix<f64, 4, 4> {
        let g = g_of(&s.q);
        4.0 * g.transpose() * Matrix3::from_diagonal(&self.inertia) * g
    }
    fn force(&self, s: &PlainState<4, 0>) -> SVector<f64, 4> {
        let turns = Matrix3::from_diagonal(&self.inertia) * g_of(&s.q) * s.u;
        // V = w (e₀² − e₁² − e₂² + e₃²).
        let e = &s.q;
        -8.0 * g_of(&s.u).transpose() * turns
            - 2.0 * self.weight * SVector::<f64, 4>::new(e[0], -e[1], -e[2], e[3])
    }
    fn energy(&self, s: &PlainState<4, 0>) -> f64 {
        let e = &s.q;
        let height = e[0] * e[0] - e[1] * e[1] - e[2] * e[2] + e[3] * e[3];
        0.5 * s.u.dot(&(self.mass(s) * s.u)) + self.weight * height
    }
    fn phi(&self, s: &PlainState<4, 0>) -> SVector<f64, 1> {
        [0.5 * (s.q.norm_squared() - 1.0)].into()
    }
    fn phi_q(&self, s: &PlainState<4, 0>) -> SMatrix<f64, 1, 4> {
        s.q.transpose()
    }
    fn right(&self, s: &PlainState<4, 0>) -> SVector<f64, 1> {
        [-s.u.norm_squared()].into()
    }
}
held!(EulerBody, 4 coordinates ["e0", "e1", "e2", "e3"], 1 + 0 = 1 rows ["norm"],
    [constraint("norm", ConstraintKind::Holonomic, 0, 1)], friction false, events []);

pub fn of_bodies(dice: &mut Dice) -> Scene<EulerBody> {
    let a = dice.within(0.5, 2.0);
    let b = dice.within(0.5, 2.0);
    let c = dice.within((a - b).abs().max(0.2), a + b);
    let weight = dice.below(2) as f64 * dice.within(0.0, 5.0);
    let body = EulerBody { inertia: Vector3::new(a, b, c), weight };
    let mut e = SVector::<f64, 4>::from_fn(|_, _| dice.within(-1.0, 1.0));
    e /= e.norm();
    let mut omega = Vector3::from_fn(|_, _| dice.within(-1.0, 1.0));
    omega[dice.below(3)] += dice.power(1.0, 30.0);
    let rates = 0.5 * g_of(&e).transpose() * omega;
    let start = state(e.into(), rates.into());
    Scene { name: "body, Euler parameters", model: body, start, until: dice.power(1.0, 20.0), stiff: false }
}

/// Chaplygin's sleigh on an incline: a knife edge at (x, y), the centre of mass a ahead of it.
#[derive(Clone, Copy)]
pub struct Sleigh {
    a: f64,
    inertia: f64,
    slope: f64,
}

impl Held<3, 0, 1> for Sleigh {
    fn mass(&self, s: &PlainState<3, 0>) -> SMatrix<f64, 3, 3> {
        let (sine, cosine) = s.q[2].sin_cos();
        let (x, y) = (-self.a * sine, self.a * cosine);
        SMatrix::<f64, 3, 3>::new(1.0, 0.0, x, 0.0, 1.0, y, x, y, self.inertia + self.a * self.a)
    }
    fn force(&self, s: &PlainState<3, 0>) -> SVector<f64, 3> {
        let (sine, cosine) = s.q[2].sin_cos();
        let pull = self.a * s.u[2] * s.u[2];
        [self.slope + pull * cosine, pull * sine, -self.slope * self.a * sine].into()
    }
    fn energy(&self, s: &PlainState<3, 0>) -> f64 {
        0.5 * s.u.dot(&(self.mass(s) * s.u)) - self.slope * (s.q[0] + self.a * s.q[2].cos())
    }
    fn phi(&self, _: &PlainState<3, 0>) -> SVector<f64, 0> {
        SVector::zeros()
    }
    fn phi_q(&self, s: &PlainState<3, 0>) -> SMatrix<f64, 1, 3> {
        SMatrix::<f64, 1, 3>::new(-s.q[2].sin(), s.q[2].cos(), 0.0)
    }
    fn right(&self, s: &PlainState<3, 0>) -> SVector<f64, 1> {
        let (sine, cosine) = s.q[2].sin_cos();
        [(cosine * s.u[0] + sine * s.u[1]) * s.u[2]].into()
    }
}
held!(Sleigh, 3 coordinates ["x", "y", "theta"], 0 + 1 = 1 rows ["edge"],
    [constraint("edge", ConstraintKind::Nonholonomic, 0, 1)], friction false, events []);

pub fn of_sleighs(dice: &mut Dice) -> Scene<Sleigh> {
    let model = Sleigh {
        a: dice.below(3) as f64 * 0.2,
        inertia: dice.power(0.1, 2.0),
        slope: dice.below(2) as f64 * dice.within(0.2, 3.0),
    };
    let (angle, speed) = (dice.within(-3.0, 3.0), dice.within(-2.0, 2.0));
    let start = state([0.0, 0.0, angle], [speed * angle.cos(), speed * angle.sin(), dice.within(-5.0, 5.0)]);
    Scene { name: "sleigh", model, start, until: dice.power(1.0, 30.0), stiff: false }
}

/// Five bobs on massless rods in Cartesian coordinates.
#[derive(Clone, Copy)]
pub struct Rods;

fn rod(s: &SVector<f64, 10>, i: usize) -> [f64; 2] {
    if i == 0 { [s[0], s[1]] } else { [s[2 * i] - s[2 * i - 2], s[2 * i + 1] - s[2 * i - 1]] }
}

impl Held<10, 5, 5> for Rods {
    fn mass(&self, _: &PlainState<10, 0>) -> SMatrix<f64, 10, 10> {
        SMatrix::identity()
    }
    fn force(&self, _: &PlainState<10, 0>) -> SVector<f64, 10> {
        SVector::from_fn(|i, _| -9.81 * (i % 2) as f64)
    }
    fn energy(&self, s: &PlainState<10, 0>) -> f64 {
        0.5 * s.u.norm_squared() + 9.81 * (0..5).map(|i| s.q[2 * i + 1]).sum::<f64>()
    }
    fn phi(&self, s: &PlainState<10, 0>) -> SVector<f64, 5> {
        SVector::from_fn(|i, _| 0.5 * (rod(&s.q, i).iter().map(|x| x * x).sum::<f64>() - 1.0))
    }
    fn phi_q(&self, s: &PlainState<10, 0>) -> SMatrix<f64, 5, 10> {
        SMatrix::from_fn(|i, j| {
            let side = rod(&s.q, i)[j % 2];
            if j / 2 == i {
                side
            } else if j / 2 + 1 == i {
                -side
            } else {
                0.0
            }
        })
    }
    fn right(&self, s: &PlainState<10, 0>) -> SVector<f64, 5> {
        SVector::from_fn(|i, _| -rod(&s.u, i).iter().map(|x| x * x).sum::<f64>())
    }
}
held!(Rods, 10 coordinates ["x1", "y1", "x2", "y2", "x3", "y3", "x4", "y4", "x5", "y5"],
    5 + 0 = 5 rows ["rod1", "rod2", "rod3", "rod4", "rod5"],
    [constraint("rods", ConstraintKind::Holonomic, 0, 5)], friction false, events []);

pub fn of_rods(dice: &mut Dice) -> Scene<Rods> {
    let size = dice.power(0.03, 2.0);
    let (mut start, mut at) = (state([0.0; 10], [0.0; 10]), [0.0, 0.0]);
    for i in 0..5 {
        let angle = size * dice.within(0.3, 1.0);
        at = [at[0] + angle.sin(), at[1] - angle.cos()];
        (start.q[2 * i], start.q[2 * i + 1]) = (at[0], at[1]);
    }
    Scene { name: "rods, Cartesian", model: Rods, start, until: dice.power(1.0, 8.0), stiff: false }
}

pub fn of_loops(dice: &mut Dice) -> Scene<FourBar> {
    // Grashof's condition with a margin: the crank goes all round.
    let (crank, coupler, rocker) = (dice.within(0.3, 0.8), dice.within(1.8, 2.4), dice.within(1.6, 2.2));
    let model = FourBar { m: [1.0, 0.5, 2.0], l: [crank, coupler, -rocker], d: 2.0, g: 9.81 };
    let angle: f64 = dice.within(0.0, TAU);
    // The rocker's end from the crank's: two circles.
    let (x, y) = (2.0 - crank * angle.cos(), -crank * angle.sin());
    let far = x.hypot(y);
    let turn = ((far * far + coupler * coupler - rocker * rocker) / (2.0 * far * coupler)).acos();
    let bar = y.atan2(x) + turn;
    let (px, py) = (crank * angle.cos() + coupler * bar.cos(), crank * angle.sin() + coupler * bar.sin());
    let other = py.atan2(px - 2.0);
    let speed = dice.power(1.0, 10.0);
    // l₁ θ̇₁ (−s₁, c₁) + … = 0 for the other two.
    let column = |l: f64, a: f64| [-l * a.sin(), l * a.cos()];
    let ([a1, b1], [a2, b2], [a3, b3]) = (column(crank, angle), column(coupler, bar), column(-rocker, other));
    let det = a2 * b3 - a3 * b2;
    let (u2, u3) = (-speed * (a1 * b3 - a3 * b1) / det, -speed * (a2 * b1 - a1 * b2) / det);
    let start = state([angle, bar, other], [speed, u2, u3]);
    Scene { name: "four-bar", model, start, until: dice.power(1.0, 10.0), stiff: false }
}

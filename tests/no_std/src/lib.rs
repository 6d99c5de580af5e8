//! A pendulum on firmware: no standard library, no allocator.
//!
//! The library is what a firmware author writes. The program beside it (`main.rs`) links it with a panic handler and nothing else: had
//! anything below asked for an allocator or for `std`, it would not link.
#![no_std]
#![forbid(unsafe_code)]

use core::convert::Infallible;

use dynamics_runtime::integrate::{Dop853, Phase, StepError, StepOptions, Stepper, Tolerances};
use dynamics_runtime::math::F64Ext as _;
use dynamics_runtime::{Expr, Force, Mat3, SmoothFunction, Vec2, vec2};
use nalgebra::SVector;

/// A bob on a massless rod.
#[derive(Clone, Copy, Debug)]
pub struct Pendulum {
    /// Mass, kg.
    pub m: f64,
    /// Length, m.
    pub l: f64,
    /// Acceleration of gravity, m/s².
    pub g: f64,
}

impl Pendulum {
    /// Place of the bob.
    pub fn bob(&self, theta: Expr) -> Vec2 {
        self.l * vec2(theta.sin(), -theta.cos())
    }

    /// T + V, J.
    pub fn energy(&self, theta: Expr) -> Expr {
        0.5 * self.m * self.bob(theta).dt().norm_squared() + self.g * self.m * self.bob(theta).y
    }

    /// Frequency of small oscillations, rad/s: a function of parameters alone, by the methods of `f64`.
    pub fn frequency(&self) -> f64 {
        (self.g / self.l).sqrt()
    }
}

/// A track that a firmware author knows in closed form.
pub struct Bumps;

impl SmoothFunction for Bumps {
    fn derivatives(&self, x: f64) -> [f64; 4] {
        let (sin, cos) = x.sin_cos();
        [sin, cos, -sin, -cos]
    }
}

/// What went wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Failure {
    /// The integration stopped.
    Step,
    /// Energy drifted by this part of itself.
    Drift(f64),
    /// The amplitude grew to this angle.
    Amplitude(f64),
    /// An exact relation is off by this much.
    Relation(f64),
}

/// Swings the pendulum for 10 s and judges the motion.
pub fn swing(pendulum: &Pendulum) -> Result<(), Failure> {
    type Vector = SVector<f64, 1>;
    let square = pendulum.frequency() * pendulum.frequency();
    let mut equation = |_: f64, q: &Vector, _: &Vector| Ok::<_, Infallible>(Vector::new(-square * q[0].sin()));
    let start = Phase { q: Vector::new(2.0), u: Vector::new(0.0) };
    let options = StepOptions { tolerances: Tolerances::both(1e-12), fixed: None, first: None, most: f64::INFINITY };
    let failed = |_: StepError<Infallible>| Failure::Step;
    let mut stepper: Stepper<Vector, Dop853<Vector>> =
        Stepper::new(&mut equation, 0.0, start, 10.0, options).map_err(failed)?;
    let energy = |q: f64, u: f64| pendulum.energy(Expr::coordinate(q, u, f64::NAN)).value();
    let at_start = energy(2.0, 0.0);
    while stepper.now().t < 10.0 {
        stepper.step(&mut equation, 10.0).map_err(failed)?;
        let Phase { q, u } = stepper.now().y;
        let drift = (energy(q[0], u[0]) - at_start) / at_start;
        if drift.abs() > 1e-9 {
            return Err(Failure::Drift(drift));
        }
        if q[0].abs() > 2.0 + 1e-9 {
            return Err(Failure::Amplitude(q[0]));
        }
    }
    Ok(())
}

/// Relations that hold exactly, through every part of the vocabulary.
pub fn relations() -> Result<(), Failure> {
    let x = Expr::coordinate(0.7, -0.3, 1.1);
    let rotation = Mat3::rotation_z(x) * Mat3::rotation_x(0.4);
    let zeros = [
        x.sin().powi(2) + x.cos().powi(2) - 1.0,
        x.exp().ln() - x,
        x.tan().atan() - x,
        x.sin().asin() - x,
        x.cos().acos() - x,
        x.tanh() * x.cosh() - x.sinh(),
        x.powf(1.5) - x * x.sqrt(),
        x.cbrt().powi(3) - x,
        x.sin().atan2(x.cos()) - x,
        x.hypot(2.0) - (x * x + 4.0).sqrt(),
        Bumps.at(x) - x.sin(),
        rotation.determinant() - 1.0,
        Force::along(x, 2.0).power() - 2.0 * x.dt(),
    ];
    for zero in zeros {
        let error = zero.value().abs().max(zero.rate().abs()).max(zero.acceleration().abs());
        let only_value_known = zero.rate().is_nan() || zero.acceleration().is_nan();
        if zero.value().abs() > 1e-13 || (!only_value_known && error > 1e-13) {
            return Err(Failure::Relation(error));
        }
    }
    Ok(())
}

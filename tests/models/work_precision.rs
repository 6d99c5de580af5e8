//! Problems on which solvers of differential equations are compared, as energies and forces. Examples and
//! benchmarks include this file.

#[path = "double_pendulum.rs"]
mod double_pendulum;
#[path = "kepler.rs"]
mod kepler;

use dynamics::prelude::*;

pub(crate) use double_pendulum::DoublePendulum;
pub(crate) use kepler::Kepler;

/// A bob on a damped spring that is almost a rod: it swings in seconds and settles along the spring in 10⁻⁴
/// of them.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(mass: kg, stiffness: N / m, damping: N * s / m, length: m, g: m / s^2)]
pub(crate) struct StiffSpring {
    pub(crate) mass: f64,
    pub(crate) stiffness: f64,
    pub(crate) damping: f64,
    pub(crate) length: f64,
    pub(crate) g: f64,
}

#[dynamics]
impl StiffSpring {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * q.y
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.stiffness * (vec2(q.x, q.y).norm() - self.length).powi(2)
    }
    #[dissipation]
    fn damper(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.damping * vec2(q.x, q.y).norm().dt().powi(2)
    }
}

//! Problems on which solvers of differential equations are compared, as energies and forces. Examples and benchmarks include this file.

use dynamics::prelude::*;

/// Two bobs on massless rods.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta1: rad, theta2: rad)]
#[units(m1: kg, m2: kg, l1: m, l2: m, g: m / s^2)]
pub(crate) struct DoublePendulum {
    pub(crate) m1: f64,
    pub(crate) m2: f64,
    pub(crate) l1: f64,
    pub(crate) l2: f64,
    pub(crate) g: f64,
}

#[dynamics]
impl DoublePendulum {
    fn bob1(&self, q: &Coordinates<Self>) -> Vec2 {
        self.l1 * vec2(q.theta1.sin(), -q.theta1.cos())
    }
    fn bob2(&self, q: &Coordinates<Self>) -> Vec2 {
        self.bob1(q) + self.l2 * vec2(q.theta2.sin(), -q.theta2.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m1 * self.bob1(q).dt().norm_squared() + 0.5 * self.m2 * self.bob2(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.g * (self.m1 * self.bob1(q).y + self.m2 * self.bob2(q).y)
    }
}

/// A planet about a sun (Hairer, Lubich, Wanner, *Geometric Numerical Integration*, §I.2).
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y)]
pub(crate) struct Kepler {
    pub(crate) mu: f64,
}

#[dynamics]
impl Kepler {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * vec2(q.x, q.y).dt().norm_squared()
    }
    #[potential]
    fn gravitation(&self, q: &Coordinates<Self>) -> Expr {
        -self.mu / vec2(q.x, q.y).norm()
    }
}

/// A bob on a damped spring that is almost a rod: it swings in seconds and settles along the spring in 10⁻⁴ of them.
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

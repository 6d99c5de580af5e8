//! Long chains, and models whose sines are the standard library's: too slow to compile for what only counts
//! instructions.

use dynamics::prelude::*;

chain!(Chain20, 20,);
chain!(Chain50, 50,);
chain!(Chain5Accurate, 5, accurate);
chain!(Chain10Accurate, 10, accurate);

/// The double pendulum with the standard library's sines.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta1, theta2)]
#[model(sin_cos = accurate)]
pub(crate) struct DoublePendulumAccurate {
    pub(crate) m1: f64,
    pub(crate) m2: f64,
    pub(crate) l1: f64,
    pub(crate) l2: f64,
    pub(crate) g: f64,
}

#[dynamics]
impl DoublePendulumAccurate {
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

//! Two bobs on massless rods.

use dynamics::prelude::*;

/// Two bobs on massless rods.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta1: rad, theta2: rad)]
#[units(m1: kg, m2: kg, l1: m, l2: m, g: m / s^2)]
pub struct DoublePendulum {
    pub m1: f64,
    pub m2: f64,
    pub l1: f64,
    pub l2: f64,
    pub g: f64,
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

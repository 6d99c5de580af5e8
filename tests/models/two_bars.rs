//! A loaded pin on two bars, each about an end of a base.

use dynamics::prelude::*;

#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(mass: kg, r: m, base: m, g: m / s^2)]
pub(crate) struct TwoBars {
    pub(crate) mass: f64,
    pub(crate) r: f64,
    pub(crate) base: f64,
    pub(crate) g: f64,
}

#[dynamics]
impl TwoBars {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared()
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * q.y
    }
    #[holonomic]
    fn left(&self, q: &Coordinates<Self>) -> Expr {
        vec2(q.x, q.y).norm() - self.r
    }
    #[holonomic]
    fn right(&self, q: &Coordinates<Self>) -> Expr {
        vec2(q.x - self.base, q.y).norm() - self.r
    }
}

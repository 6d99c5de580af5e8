//! A parallelogram with a torsional spring on its first crank, whose change point lies at zero: there its
//! rows are not independent.

use dynamics::prelude::*;

#[derive(Clone, Debug, Dynamics)]
#[coordinates(a: rad, b: rad, c: rad)]
#[units(inertia: kg * m^2, l: m, wide: m, k: N * m, rest: rad)]
#[nominal(l = 1.0, wide = 2.0)]
pub(crate) struct Parallelogram {
    pub(crate) inertia: f64,
    pub(crate) l: f64,
    pub(crate) wide: f64,
    pub(crate) k: f64,
    pub(crate) rest: f64,
}

#[dynamics]
impl Parallelogram {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.inertia * (q.a.dt().powi(2) + q.b.dt().powi(2) + q.c.dt().powi(2))
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.k * (q.a - self.rest).powi(2)
    }
    #[holonomic]
    fn closure(&self, q: &Coordinates<Self>) -> Vec2 {
        let first = self.l * vec2(q.a.cos(), q.a.sin()) + self.wide * vec2(q.b.cos(), q.b.sin());
        first - self.l * vec2(q.c.cos(), q.c.sin()) - vec2(self.wide, 0.0)
    }
}

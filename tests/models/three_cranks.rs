//! Three cranks of one length below one coupler: parallelograms that repeat each other.

use dynamics::prelude::*;

/// Three cranks on one coupler, by angles: the third crank repeats what the others say.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(first: rad, coupler: rad, second: rad, third: rad)]
#[units(inertia: kg * m^2, a: m, b: m, weight: N)]
#[nominal(a = 0.5, b = 0.8)]
pub(crate) struct ThreeCranks {
    pub(crate) inertia: f64,
    pub(crate) a: f64,
    pub(crate) b: f64,
    pub(crate) weight: f64,
}

#[dynamics]
impl ThreeCranks {
    fn along(&self, length: f64, angle: Expr) -> Vec2 {
        length * vec2(angle.cos(), angle.sin())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let squares = q.first.dt().powi(2) + q.second.dt().powi(2) + q.third.dt().powi(2);
        0.5 * self.inertia * (squares + q.coupler.dt().powi(2))
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.weight * self.a * (q.first.sin() + q.second.sin() + q.third.sin())
    }
    #[holonomic]
    fn closure(&self, q: &Coordinates<Self>) -> Vec2 {
        self.along(self.a, q.first) + self.along(self.b, q.coupler)
            - self.along(self.a, q.second)
            - vec2(self.b, 0.0)
    }
    #[holonomic]
    #[redundant]
    fn middle(&self, q: &Coordinates<Self>) -> Vec2 {
        self.along(self.a, q.first) + self.along(0.5 * self.b, q.coupler)
            - self.along(self.a, q.third)
            - vec2(0.5 * self.b, 0.0)
    }
}

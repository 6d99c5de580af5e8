//! A linkage whose links come into one line: there it has a change point.

use dynamics::prelude::*;

/// Four bars, a + b = c + d.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(crank: rad, coupler: rad, rocker: rad)]
#[units(inertia: kg * m^2, lengths: m)]
pub(crate) struct Neutral {
    pub(crate) inertia: f64,
    pub(crate) lengths: [f64; 4],
}

#[dynamics]
impl Neutral {
    fn bar(&self, length: f64, angle: Expr) -> Vec2 {
        length * vec2(angle.cos(), angle.sin())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.inertia
            * (q.crank.dt().powi(2) + 0.3 * q.coupler.dt().powi(2) + 1.4 * q.rocker.dt().powi(2))
    }
    #[holonomic]
    fn closure(&self, q: &Coordinates<Self>) -> Vec2 {
        let [a, b, c, d] = self.lengths;
        self.bar(a, q.crank) + self.bar(b, q.coupler) - self.bar(c, q.rocker) - vec2(d, 0.0)
    }
}

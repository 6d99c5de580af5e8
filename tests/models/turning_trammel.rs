//! An elliptic trammel by the angle of its rod alone.

use dynamics::prelude::*;

#[derive(Clone, Debug, Dynamics)]
#[coordinates(phi: rad)]
#[units(half: m, mass: kg, inertia: kg * m^2, g: m / s^2)]
pub(crate) struct Turning {
    pub(crate) half: f64,
    pub(crate) mass: f64,
    pub(crate) inertia: f64,
    pub(crate) g: f64,
}

#[dynamics]
impl Turning {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * (self.inertia + self.mass * self.half.powi(2)) * q.phi.dt().powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        -self.mass * self.g * self.half * q.phi.sin()
    }
}

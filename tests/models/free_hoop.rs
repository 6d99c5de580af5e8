//! A bead on a hoop that turns by itself about its vertical diameter.

use dynamics::prelude::*;

#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta: rad, phi: rad)]
#[units(m: kg, g: m / s^2, radius: m, inertia: kg * m^2)]
pub(crate) struct FreeHoop {
    pub(crate) m: f64,
    pub(crate) g: f64,
    pub(crate) radius: f64,
    pub(crate) inertia: f64,
}

#[dynamics]
impl FreeHoop {
    fn bead(&self, q: &Coordinates<Self>) -> Vec3 {
        let out = self.radius * q.theta.sin();
        vec3(out * q.phi.cos(), out * q.phi.sin(), -self.radius * q.theta.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * self.bead(q).dt().norm_squared() + 0.5 * self.inertia * q.phi.dt().powi(2)
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * self.bead(q).z
    }
}

//! A bead on a hoop that is turned at a given speed about its vertical diameter; S. H. Strogatz, *Nonlinear
//! Dynamics and Chaos*, §3.5.

use dynamics::prelude::*;

#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta: rad)]
#[units(m: kg, g: m / s^2, radius: m, speed: rad / s, drag: N * m * s)]
pub(crate) struct TurnedHoop {
    pub(crate) drag: f64,
    pub(crate) m: f64,
    pub(crate) g: f64,
    pub(crate) radius: f64,
    pub(crate) speed: f64,
}

#[dynamics]
impl TurnedHoop {
    fn bead(&self, q: &Coordinates<Self>) -> Vec3 {
        let angle = self.speed * q.t;
        let out = self.radius * q.theta.sin();
        vec3(out * angle.cos(), out * angle.sin(), -self.radius * q.theta.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * self.bead(q).dt().norm_squared()
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * self.bead(q).z
    }
    #[dissipation]
    fn rub(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.drag * q.theta.dt().powi(2)
    }
}

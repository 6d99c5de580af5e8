//! A heavy body that turns about a fixed point.

use dynamics::prelude::*;

/// In Euler parameters, which lock nowhere.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(e: [_; 4])]
#[units(m: kg, length: m, inertia: kg * m^2, g: m / s^2)]
pub(crate) struct Parametrised {
    pub(crate) m: f64,
    pub(crate) length: f64,
    pub(crate) inertia: Vec3<f64>,
    pub(crate) g: f64,
}
#[dynamics]
impl Parametrised {
    pub(crate) fn body(&self, q: &Coordinates<Self>) -> RigidBody {
        let [a, b, c] = self.inertia.to_array();
        let frame = Frame::turned(EulerParameters::new(q.e).rotation());
        RigidBody::new(self.m, self.length * Vec3::Y, Mat3::diagonal(a, b, c), frame)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        self.body(q).kinetic_energy()
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        self.body(q).potential_energy(-self.g * Vec3::Z)
    }
    #[holonomic]
    fn unit(&self, q: &Coordinates<Self>) -> Expr {
        EulerParameters::new(q.e).norm_constraint()
    }
}

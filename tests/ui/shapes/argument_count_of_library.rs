use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(phi: rad, x: m)]
#[units(m: kg, inertia: kg * m^2)]
pub struct Wheel {
    pub m: f64,
    pub inertia: Mat3<f64>,
}

#[dynamics]
impl Wheel {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let frame = Frame::turned(Mat3::rotation_z(q.phi));
        RigidBody::new(self.m, self.inertia, frame).kinetic_energy() + 0.5 * self.m * q.x.dt().powi(2)
    }
}

fn main() {}

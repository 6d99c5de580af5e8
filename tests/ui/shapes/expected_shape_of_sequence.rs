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
        let frame = Frame::turned(Mat3::euler([2, 0, 2], [q.phi, q.phi, q.phi]));
        RigidBody::new(self.m, vec3(q.x, 0.0, 0.0), self.inertia, frame).kinetic_energy()
    }
}

fn main() {}

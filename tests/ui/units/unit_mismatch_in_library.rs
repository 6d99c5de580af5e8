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
        let frame = Frame::new(vec3(q.x, 0.0, 0.0), Mat3::rotation_z(q.phi));
        // The mass is missing: an inertia stands in its place.
        RigidBody::new(self.inertia[(2, 2)], Vec3::ZERO, self.inertia, frame).kinetic_energy()
    }
}

fn main() {}

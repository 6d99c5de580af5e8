use dynamics::prelude::*;

// No body is as hard to turn about one axis as this without being so about the others.
#[derive(Dynamics)]
#[coordinates(a: rad, b: rad)]
struct Gyroscope {
    mass: f64,
}

#[dynamics]
impl Gyroscope {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let frame = Frame::turned(Mat3::rotation_z(q.a) * Mat3::rotation_x(q.b));
        RigidBody::new(self.mass, vec3(0.0, 0.0, 1.0), Mat3::diagonal(1.0, 1.0, 2.5), frame).kinetic_energy()
    }
}

fn main() {}

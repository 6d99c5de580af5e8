use dynamics::prelude::*;

// Three digits of a sine are no turn.
#[derive(Dynamics)]
#[coordinates(angle: rad)]
struct Wheel {
    inertia: f64,
}

#[dynamics]
impl Wheel {
    fn fork(&self) -> Frame {
        Frame::turned(Mat3::from([[0.866, -0.5, 0.0], [0.5, 0.866, 0.0], [0.0, 0.0, 1.0]]))
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let wheel = self.fork().frame(Vec3::ZERO, Mat3::rotation_y(q.angle));
        let inertia = Mat3::diagonal(self.inertia, self.inertia, self.inertia);
        RigidBody::new(1.0, Vec3::ZERO, inertia, wheel).kinetic_energy()
    }
}

fn main() {}

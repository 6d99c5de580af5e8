use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(angle: rad)]
struct Wheel {
    inertia: f64,
}

#[dynamics]
impl Wheel {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let inertia = Mat3::diagonal(self.inertia, self.inertia, self.inertia);
        Mat3::axis_angle(vec3(0.0, 3e200, 4e200), q.angle).rotational_energy(inertia)
    }
}

fn main() {}

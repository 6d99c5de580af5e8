use dynamics::prelude::*;

// The norm constraint is forgotten: the bar would stretch.
#[derive(Dynamics)]
#[coordinates(e: [_; 4])]
struct Bar {
    mass: f64,
    length: f64,
}

#[dynamics]
impl Bar {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let frame = Frame::turned(EulerParameters::new(q.e).rotation());
        let inertia = Inertia::cuboid(self.mass, self.length, 0.1 * self.length, 0.2 * self.length);
        RigidBody::new(self.mass, vec3(0.5 * self.length, 0.0, 0.0), inertia, frame).kinetic_energy()
    }
}

fn main() {}

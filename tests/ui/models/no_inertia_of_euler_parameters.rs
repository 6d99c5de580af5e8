use dynamics::prelude::*;

// The norm constraint is forgotten.
#[derive(Dynamics)]
#[coordinates(e: [_; 4])]
pub struct Satellite {
    pub inertia: Mat3<f64>,
}

#[dynamics]
impl Satellite {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        EulerParameters::new(q.e).rotation().rotational_energy(self.inertia)
    }
}

fn main() {}

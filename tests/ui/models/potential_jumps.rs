use dynamics::prelude::*;

// A step of the ground, which nothing climbs.
#[derive(Dynamics)]
#[coordinates(x)]
struct Step {
    mass: f64,
    height: f64,
}

#[dynamics]
impl Step {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.x.dt().powi(2)
    }
    #[potential]
    fn ground(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.height * q.x.signum()
    }
}

fn main() {}

use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x: m)]
struct Force {
    m: f64,
    k: f64,
}

#[dynamics]
impl Force {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }

    #[force]
    fn spring(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, -self.k * q.x)
    }
}

fn main() {}
